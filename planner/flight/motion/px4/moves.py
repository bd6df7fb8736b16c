"""Moves: what PX4's navigator makes of the stages of a route, as columns."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import Columns, horizontal, lengths, quotient, rows_of
from planner.flight.motion.px4.braking import (
    allowed_speed_m_s,
    braking_distance_m,
    half_b_m_s,
    yaw_time_s,
)
from planner.flight.motion.px4.laws import braked_speed_m_s
from planner.flight.motion.px4.lift_off import RECORDED_DRAG_PER_S, lift_off, relaunch_s
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.returns.destination import ReturnTargets
    from planner.mission.route.stage import ReturnPath, Stage
    from planner.vehicle.parameters.px4 import Px4Parameters


def directions(way_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the unit vectors of ways, zero for one of no length, and their lengths. (n, 3), (n,)"""
    length = lengths(way_m)
    return quotient(way_m, length[:, None]), length


_CONE_ANGLES_RAD = (np.radians(1.0), np.radians(89.0))
"""Half angles of the cone over home that mean something (``RTL::computeReturnAltitude``). [rad]"""


def return_legs(
    places_m: FloatArray,
    home_m: FloatArray,
    parameters: Px4Parameters,
    above_ground_m: FloatArray | float = 0.0,
    *,
    lowest_m: float = 0.0,
) -> tuple[FloatArray, BoolArray, FloatArray]:
    """Return targets, whether they are flown to, and holds of the four legs of k returns.

    Up, home, down to wait, to the ground: (k, 4, 3) [m], (k, 4), (4,) [s].  The heights of a return
    count from the rally point, ``above_ground_m`` above the ground; 0 for home.  None is flown
    below ``lowest_m``.

    Notes
    -----
    ``RtlDirect``: at MPC_XY_CRUISE, whatever the mission commanded.  RTL_LAND_DELAY at RTL_DESCEND_ALT,
    if there is one; where it is below zero the vehicle stays there, and the motion ends.
    """
    way = home_m - places_m
    height = return_heights_m(horizontal(way), -way[:, 2] - above_ground_m, parameters)
    height = np.maximum(height, lowest_m)
    datum = home_m[:, 2] + above_ground_m
    targets = np.stack((places_m, home_m, home_m, home_m), axis=1)
    targets[:, :2, 2] = (datum + height)[:, None]
    targets[:, 2, 2] = datum + np.minimum(parameters.return_descend_altitude_m, height)
    delay = parameters.return_land_delay_s
    is_flown = np.tile((True, True, delay != 0.0, delay >= 0.0), (len(way), 1))
    is_flown[:, 0] = targets[:, 0, 2] > places_m[:, 2]
    return targets, is_flown, np.array((0.0, 0.0, max(delay, 0.0), 0.0))


def return_path_height_m(place_m: FloatArray, path: ReturnPath, parameters: Px4Parameters) -> float:
    """Return the height above home at which a return along the mission sets out. [m]

    Notes
    -----
    Only a return to the mission's landing climbs first (``RtlDirectMissionLand::on_activation``), to
    what ``RTL::computeReturnAltitude`` says over the altitude of the landing item from where that return
    is chosen.
    """
    present = float(place_m[2])
    over = path.climbs_over_m
    if over is None:
        return present
    landing = path.stages[-1]
    chosen_at = path.height_chosen_m
    east, north, height = place_m.tolist() if chosen_at is None else chosen_at
    distance = math.hypot(landing.east_m - east, landing.north_m - north)
    wanted = return_heights_m(np.array([distance]), np.array([height - over]), parameters)
    return max(over + float(wanted[0]), present)


def return_heights_m(
    distance_m: FloatArray, height_m: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the heights above home of returns that begin at a distance and height from it. (k,) [m]

    Notes
    -----
    ``RTL::computeReturnAltitude``: never below the present height; nearer than RTL_MIN_DIST no higher
    than the cone over home, but 2 NAV_ACC_RAD at least; within NAV_ACC_RAD twice the distance.
    """
    highest, radius = parameters.return_altitude_m, parameters.acceptance_radius_m
    wanted = np.full_like(distance_m, highest)
    if parameters.return_cone_angle_rad > 0.0:
        angle = np.clip(parameters.return_cone_angle_rad, *_CONE_ANGLES_RAD)
        in_cone = np.minimum(distance_m / np.tan(angle), highest)
        wanted = np.where(distance_m <= parameters.return_min_distance_m, in_cone, wanted)
        wanted = np.where(distance_m <= radius, 2.0 * distance_m, np.maximum(wanted, 2.0 * radius))
    return np.maximum(np.minimum(wanted, highest), height_m)


def heights_of_returns_m(
    points_m: FloatArray, targets: ReturnTargets, parameters: Px4Parameters
) -> FloatArray:
    """Return the heights above home at which returns from points are flown to targets. (n,) [m]"""
    way = targets.ground_m - points_m
    datum = targets.ground_m[:, 2] + targets.above_ground_m
    height_m = datum + return_heights_m(horizontal(way), points_m[:, 2] - datum, parameters)
    for row, along in enumerate(targets.paths):
        if along is not None:
            height_m[row] = return_path_height_m(points_m[row], along, parameters)
    return height_m


def return_looks_home(
    distance_m: FloatArray, leg: IntArray, parameters: Px4Parameters
) -> BoolArray:
    """Return which legs of returns wait for the heading of home, by the distance they begin at.

    Notes
    -----
    ``RtlDirect::set_rtl_item``: the leg home asks for it where it begins within RTL_MIN_DIST; the descent
    to where the vehicle waits always does, which RTL_LAND_DELAY other than 0 asks for; and the landing,
    which turns as it sinks but with MPC_YAW_MODE 4.
    """
    near = distance_m < parameters.return_min_distance_m
    return np.asarray(((leg == _HOMEWARD) & near) | (leg == _DOWN) | (leg == _LANDING))


def left_m(
    parameters: Px4Parameters, tail_m: FloatArray, speed_m_s: FloatArray, hold_s: FloatArray
) -> FloatArray:
    """Return how far before places the next is flown to, that count as reached so far before. (n,) [m]

    A hold counts from there, and the vehicle flies on (``MissionBlock::is_mission_item_reached``).
    """
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    speed = np.minimum(allowed_speed_m_s(tail_m, 0.0, a, j), speed_m_s)
    kept_m = np.maximum(tail_m - braking_distance_m(speed, 0.0, a, j), 0.0)
    braked_s = np.maximum(hold_s - quotient(kept_m, speed), 0.0)
    slow_m_s = braked_speed_m_s(np.maximum(speed, _STILL_M_S), braked_s, a, half_b_m_s(a, j))
    left = np.maximum(braking_distance_m(slow_m_s, 0.0, a, j), tail_m - speed * hold_s)
    return np.where(hold_s > 0.0, np.minimum(left, tail_m), tail_m)


RETURN_PLACE_ERROR_M = 3.0
"""By which a mission's return may begin nearer home or farther from it than predicted: flown 10.5 m from
home for 9.0 m predicted, in a wind of 5 m/s; an estimate drifts from home besides. [m]"""
_NEAR_HEIGHT_M = 0.8
"""A return that begins so far below or above its waypoint, NAV_MC_ALT_RAD by default, is taken to begin at
it: flown 0.3 to 0.7 m off. [m]"""
_WITHIN_M = 1e-3
"""A place counts as reached within its radius, not at it. [m]"""
SHORTEST_L1_M = 5.0
"""Least distance of the point steered for on the new leg (``PositionSmoothing::_getL1Point``). [m]"""
SLOWEST_TURN_M_S = 0.2
"""Speed below which nothing is turned (``PositionSmoothing::_isTurning``). [m s⁻¹]"""
ALIGNED_COS = 0.98
"""Cosine of the angle to the target from which a turn counts as done (``PositionSmoothing::_isTurning``)."""
_STILL_M_S = 1e-9
"""Speed that is none. [m s⁻¹]"""
_SMALLEST_RADIUS_M = 0.001
"""An acceptance radius below this means NAV_ACC_RAD (``mission_item_to_position_setpoint``). [m]"""
_NOT_LEFT = 2.0
"""In the radius of a LOITER_TO_ALT, how far from its centre a vehicle that waits there surely is not. [-]"""
_HOMEWARD, _DOWN, _LANDING = 1, 2, 3
"""Legs of the four of a return: home, down to wait, to the ground."""
HOME_YAW = math.inf
"""The heading of home, which is that at arming."""


_NOWHERE_M = (math.nan, math.nan)


class Move(NamedTuple):
    """One flight to one place."""

    stage: int
    item: int
    target_m: tuple[float, float, float]
    """East, north, height above home. [m]"""
    seen_height_m: float
    """Height of the place as the move before sees it. [m]"""
    speed_m_s: float
    radius_m: float
    reach_m: float
    """Distance on the map at which the place counts as reached; of a loiter more than the radius that
    shapes the trajectory."""
    hold_s: float
    yaw_rad: float
    """NaN where free, ``HOME_YAW`` where that of home is asked for."""
    is_stop: bool
    """Ends standing still, whatever follows."""
    goes_on: bool = False
    """Takes up the flight to the same place wherever the move before ends."""
    is_delay: bool = False
    """A wait that the look-ahead of the move before looks past."""
    is_takeoff: bool = False
    is_landing: bool = False
    is_return: bool = False
    """Belongs to a return, which the look-ahead of the move before does not see."""
    needs_heading: bool = False
    """Waits for its heading whatever MIS_YAW_TMT is."""
    circles: bool = False
    """Changes its height within the radius of a LOITER_TO_ALT."""
    looks_m: tuple[float, float] = _NOWHERE_M
    """East and north from the target, where the region of interest is; NaN: there is none. [m]"""
    line_from_m: tuple[float, float] = _NOWHERE_M
    """East and north of where its line begins; NaN: at the target of the move before. [m]"""


_AT_HOME_M = 1e-9
_COLUMN_TYPES = (*2 * (np.intp,), *7 * (np.float64,), *8 * (np.bool_,), *2 * (np.float64,))


class Moves(Columns, eq=False):
    """Moves as columns of length n, in flown order; several flights may follow one another."""

    parameters: Px4Parameters
    """Those of the vehicle that flies them all."""
    stage: IntArray
    item: IntArray
    target_m: FloatArray
    """(n, 3) [m]"""
    seen_height_m: FloatArray
    speed_m_s: FloatArray
    radius_m: FloatArray
    reach_m: FloatArray
    hold_s: FloatArray
    yaw_rad: FloatArray
    is_stop: BoolArray
    goes_on: BoolArray
    is_delay: BoolArray
    is_takeoff: BoolArray
    is_landing: BoolArray
    is_return: BoolArray
    needs_heading: BoolArray
    circles: BoolArray
    looks_m: FloatArray
    """(n, 2) [m]"""
    line_from_m: FloatArray
    """(n, 2) [m]"""
    is_first: BoolArray
    """Begins a flight of its own."""
    start_m: FloatArray
    """Place from which its flight begins. (n, 3) [m]"""
    start_yaw_rad: FloatArray
    """Heading with which its flight begins; NaN where not known."""
    late_s: FloatArray
    """By which a take-off is late. [s]"""
    past_m: FloatArray
    """How far past the height of its trajectory a vehicle is that arrives. [m]"""

    @property
    def looks(self) -> BoolArray:
        """Which look at a region of interest on their way. (n,)"""
        return np.isfinite(self.looks_m[:, 0]) & ~self.is_landing & ~self.is_takeoff

    @property
    def leaves_tangent(self) -> BoolArray:
        """Which are flown to by the tangent of a circle. (n,)"""
        return np.isfinite(self.line_from_m[:, 0])

    def beginnings_m(self) -> FloatArray:
        """Return where each is meant to begin: at the target of the one before, mostly. (n, 3) [m]"""
        before = np.vstack((self.start_m[:1], self.target_m[:-1]))
        before[self.leaves_tangent, :2] = self.line_from_m[self.leaves_tangent]
        return np.where(self.is_first[:, None], self.start_m, before)

    @classmethod
    def of(cls, rows: Sequence[Move], parameters: Px4Parameters) -> Moves:
        """Return the rows of one flight, which begins at home with any heading, as columns."""
        columns = zip(Move._fields, zip(*rows, strict=True), _COLUMN_TYPES, strict=True)
        arrays: dict[str, Any] = {
            name: np.array(column, dtype=dtype) for name, column, dtype in columns
        }
        # A place nearer than that is home: divisions by less overflow.
        arrays["target_m"][np.abs(arrays["target_m"]) < _AT_HOME_M] = 0.0
        return cls(
            parameters=parameters,
            **arrays,
            is_first=np.arange(len(rows)) == 0,
            start_m=np.zeros((len(rows), 3)),
            start_yaw_rad=np.full(len(rows), np.nan),
            late_s=np.full(len(rows), lift_off(parameters).late_s),
            past_m=np.zeros(len(rows)),
        )

    def armed_with(self, heading_rad: float | None) -> Moves:
        """Return the moves with the heading of home, where it is known."""
        if heading_rad is None:
            return self
        return replace(self, yaw_rad=np.where(self.yaw_rad == HOME_YAW, heading_rad, self.yaw_rad))


def moves_of_stages(
    stages: Sequence[Stage], parameters: Px4Parameters, *, drag_per_s: float = RECORDED_DRAG_PER_S
) -> Moves:
    """Return the moves of a flight that begins on the ground at home.

    Splines, circles and set-downs, which PX4 refuses at upload, are flown straight to their place.
    """
    navigator = _Navigator(parameters, drag_per_s=drag_per_s)
    rows = [move for k, s in enumerate(stages) for move in navigator.moves(k, s)]
    return Moves.of(rows, parameters)


def return_moves(
    places_m: FloatArray,
    home_m: FloatArray,
    parameters: Px4Parameters,
    above_ground_m: FloatArray | float = 0.0,
    return_paths: Sequence[ReturnPath | None] = (),
) -> Moves:
    """Return the moves of returns from places, flights of their own, numbered as stages and items.

    ``return_paths`` are of those that lead along the mission; empty where none does.
    """
    if any(path is not None for path in return_paths):
        return _moves_along(places_m, home_m, parameters, above_ground_m, return_paths)
    all_targets, is_flown, holds_s = return_legs(places_m, home_m, parameters, above_ground_m)
    flight, kind = np.nonzero(is_flown)
    targets = all_targets[flight, kind]
    false = np.zeros(len(flight), dtype=np.bool_)
    radius = np.full(len(flight), parameters.acceptance_radius_m)
    turns_home = return_looks_home(horizontal(home_m - places_m)[flight], kind, parameters)
    return Moves(
        parameters=parameters,
        stage=flight,
        item=flight,
        target_m=targets,
        seen_height_m=targets[:, 2],
        speed_m_s=np.full(len(flight), min(parameters.cruise_speed_m_s, parameters.speed_max_m_s)),
        radius_m=radius,
        reach_m=radius,
        hold_s=holds_s[kind],
        yaw_rad=np.where(turns_home, HOME_YAW, np.nan),
        is_stop=~false,
        goes_on=false,
        is_delay=false,
        is_takeoff=false,
        is_landing=kind == _LANDING,
        is_return=~false,
        needs_heading=false,
        circles=false,
        looks_m=np.full((len(flight), 2), np.nan),
        line_from_m=np.full((len(flight), 2), np.nan),
        is_first=np.diff(flight, prepend=-1) > 0,
        start_m=places_m[flight],
        start_yaw_rad=np.full(len(flight), np.nan),
        late_s=np.full(len(flight), lift_off(parameters).late_s),
        past_m=np.zeros(len(flight)),
    )


def _moves_along(
    places_m: FloatArray,
    home_m: FloatArray,
    parameters: Px4Parameters,
    above_ground_m: FloatArray | float,
    return_paths: Sequence[ReturnPath | None],
) -> Moves:
    """Return the moves of returns of which some lead along the mission."""
    rally_m = np.broadcast_to(above_ground_m, len(places_m)).tolist()
    rows: list[Move] = []
    for k, path in enumerate(return_paths):
        navigator = _Navigator(parameters, places_m[k].tolist())
        if path is None:
            rows += navigator.straight_home(k, k, home_m[k], rally_m[k])
        else:
            rows += navigator.home_along(k, k, path, begins_m=[places_m[k].tolist()])
    moves = Moves.of(rows, parameters)
    is_first = np.diff(moves.stage, prepend=-1) > 0
    return replace(moves, is_first=is_first, start_m=places_m[moves.stage])


def _unit(way: complex) -> complex:
    return way / (abs(way) or 1.0)


def _along(way: complex, other: complex) -> float:
    """Return the part of a way along another."""
    return (way * _unit(other).conjugate()).real


class _Navigator:
    """Where the vehicle is meant to be while stages are taken apart."""

    def __init__(
        self,
        parameters: Px4Parameters,
        place_m: tuple[float, float, float] | None = None,
        *,
        drag_per_s: float = RECORDED_DRAG_PER_S,
    ) -> None:
        self.parameters = parameters
        self.is_airborne = place_m is not None
        self.drag_per_s = drag_per_s
        self._has_landed = False
        self.east_m, self.north_m, self.height_m = place_m or (0.0, 0.0, 0.0)
        self.speed_m_s = min(parameters.cruise_speed_m_s, parameters.speed_max_m_s)
        self._circle: tuple[float, float, float] | None = None
        """Centre and radius, negative for counter-clockwise, of what is left by a tangent. [m]"""
        self._line_from_m = _NOWHERE_M
        """Where the line of the next move begins, if not at the place before. [m]"""
        self._here_m: tuple[float, float, float] | None = None
        """Where the vehicle is whose place counted as reached from afar; None: near that. [m]"""
        self._circling: Move | None = None
        """The LOITER_TO_ALT that it is still flying to then."""
        self._turns_s = 0.0
        """For how long at most it does so while it turns to that."""
        self._flown_to: tuple[tuple[float, float, float], Move] | None = None
        """Where the move to the waypoint just flown to began, and it."""

    def moves(self, index: int, stage: Stage) -> Iterator[Move]:
        """Yield the moves of one stage."""
        flown_to, self._flown_to = self._flown_to, None
        if stage.kind is not StageKind.DELAY:
            self._leave_circle(stage)
        match stage.kind:
            case StageKind.GO | StageKind.SPLINE | StageKind.CIRCLE | StageKind.SET_DOWN:
                begin = self._place_m
                self._place_at(stage)
                move = self._go(index, stage)
                yield move
                self._flown_to = begin, move
            case StageKind.LOITER:
                self._place_at(stage)
                yield self._go(index, stage, is_stop=True)
            case StageKind.TAKEOFF:
                yield from self._take_off(index, stage)
            case StageKind.DELAY:
                yield self._wait(index, stage)
            case StageKind.CHANGE_HEIGHT:
                yield from self._change_height(index, stage, self._passed_m(flown_to))
            case StageKind.LAND:
                self.east_m, self.north_m = stage.east_m, stage.north_m
                move = self._go(index, stage, is_stop=True, hold_s=0.0)
                yield move._replace(seen_height_m=stage.height_m, yaw_rad=math.nan)
                self.height_m, self._has_landed = stage.height_m, True
                hold_s = stage.hold_s
                yield self._move(index, stage.item, hold_s=hold_s, is_stop=True, is_landing=True)
            case StageKind.RETURN:
                yield from self._return(index, stage, self._passed_m(flown_to))

    def _return(
        self, index: int, stage: Stage, passed_m: tuple[float, float, float]
    ) -> Iterator[Move]:
        """Yield the moves of a return, begun where the place before it counts as reached.

        Or where the vehicle is once it has turned there: to the centre of a LOITER_TO_ALT reached from afar
        it flies on meanwhile, for half a turn at most.  The higher return of both is flown, and the longer.
        """
        near_m = min(self.parameters.acceptance_radius_m, RETURN_PLACE_ERROR_M)
        is_afar = math.dist(passed_m[:2], self._place_m[:2]) > near_m + _WITHIN_M
        is_afar |= abs(passed_m[2] - self.height_m) > _NEAR_HEIGHT_M + _WITHIN_M
        turned_m = passed_m if self._circling is None else self._flown_on_m(self._turns_s)
        if stage.return_path is not None:
            begins = passed_m if is_afar else self._place_m
            if self._here_m is not None:
                self.east_m, self.north_m, self.height_m = self._here_m
            path = stage.return_path
            yield from self.home_along(index, stage.item, path, begins_m=(begins, turned_m))
            return
        home = np.array((stage.east_m, stage.north_m, stage.height_m))
        distance = horizontal(home - np.array((passed_m, turned_m)))
        if is_afar:
            self._here_m = farther_m = passed_m if distance[0] >= distance[1] else turned_m
            self.east_m, self.north_m, self.height_m = farther_m
        every_m = return_heights_m(distance - _WITHIN_M, np.zeros(2), self.parameters)
        lowest_m = float(every_m.max())
        yield from self.straight_home(
            index, stage.item, home, stage.above_ground_m, lowest_m=lowest_m
        )

    def straight_home(
        self,
        index: int,
        item: int,
        home_m: FloatArray,
        above_ground_m: float,
        *,
        lowest_m: float = 0.0,
    ) -> Iterator[Move]:
        """Yield the moves of a return straight home, or to a rally point (``RtlDirect``).

        Where it may begin within RTL_MIN_DIST or beyond, it takes the higher way, none below ``lowest_m``,
        and waits for its heading.
        """
        place = np.array([self._place_m], dtype=np.float64)
        targets, is_flown, holds_s = return_legs(
            place, home_m[None], self._return_parameters, above_ground_m, lowest_m=lowest_m
        )
        distance = horizontal(home_m - place)
        nearer_m = np.maximum(distance - RETURN_PLACE_ERROR_M, 0.0)
        turns_home = return_looks_home(nearer_m, np.arange(len(holds_s)), self.parameters)
        for leg in rows_of(is_flown[0]).tolist():
            self.east_m, self.north_m, self.height_m = targets[0, leg].tolist()
            stop = self._move(index, item, hold_s=float(holds_s[leg]), is_stop=True, is_return=True)
            yaw = HOME_YAW if turns_home[leg] else math.nan
            # It begins anew: on a line from where the vehicle is, however far the place it had.
            goes_on, self._here_m = self._here_m is not None, None
            yield stop._replace(is_landing=leg == _LANDING, yaw_rad=yaw, goes_on=goes_on)
        self.is_airborne = False

    def home_along(
        self,
        index: int,
        item: int,
        path: ReturnPath,
        *,
        begins_m: Sequence[tuple[float, float, float]],
    ) -> Iterator[Move]:
        """Yield the moves of a return along items of the mission, begun at the last place or others near.

        Notes
        -----
        ``RtlMissionFast``, ``RtlMissionFastReverse``, ``RtlDirectMissionLand``: items with a place are
        waypoints without hold, LOITER_TO_ALT stays what it is; the speed last commanded before the item
        it sets out from is commanded again (``MissionBase::replayCachedSpeedChangeItems``).
        """
        speed = self.parameters.cruise_speed_m_s if path.speed_m_s is None else path.speed_m_s
        self.speed_m_s = min(speed, self.parameters.speed_max_m_s)
        is_seen = False
        height_m = max(
            return_path_height_m(np.array(place), path, self._return_parameters)
            for place in (self._place_m, *((*one[:2], self.height_m) for one in begins_m))
        )
        if height_m > self.height_m:
            self.height_m = height_m
            yield self._move(index, item, is_stop=True, is_return=True)
            is_seen = True
        for stage in path.stages:
            for move in self.moves(index, stage):
                yield move._replace(item=item, is_return=move.is_landing or not is_seen)
                is_seen = True

    def _take_off(self, index: int, stage: Stage) -> Iterator[Move]:
        if self._has_landed:
            # Behind a landing it is a waypoint: PX4 refuses a second take-off at upload.
            self._has_landed = False
            begins_s = relaunch_s(self.parameters, self.drag_per_s)
            yield self._move(index, stage.item, hold_s=begins_s, is_stop=True)
            self._place_at(stage)
            yield self._go(index, stage)
            return
        if not self.is_airborne:
            # Straight up from the ground; flying, a take-off item is a waypoint.
            self.height_m = stage.height_m
            yield self._move(index, stage.item, is_stop=True, is_takeoff=True)
            self.is_airborne = True
        self._place_at(stage)
        # Any heading is good enough for a take-off (``MissionBlock::is_mission_item_reached``).
        yield self._go(index, stage)._replace(yaw_rad=math.nan)

    def _change_height(
        self, index: int, stage: Stage, begins_m: tuple[float, float, float]
    ) -> Iterator[Move]:
        """Yield level flight towards a place, and the change of height on the way to it.

        Notes
        -----
        ``MissionBlock::is_mission_item_reached``, NAV_CMD_LOITER_TO_ALT: within the loiter radius and
        NAV_ACC_RAD of the place the height changes, and where it is reached the item ends.
        """
        reach = self._reach_m(stage)
        rise, place = stage.height_m - self.height_m, (stage.east_m, stage.north_m)
        # It may still be coming to rest at the place before: it is flown to from the nearer end of that.
        ends = begins_m[:2], self._vehicle_m[:2]
        east, north = min(ends, key=lambda one: math.dist(one, place))
        self.east_m, self.north_m = place
        way = math.hypot(stage.east_m - east, stage.north_m - north)
        if way > reach:
            level = self._go(index, stage, is_stop=True, hold_s=0.0)
            yield level._replace(reach_m=reach)
        self.height_m = stage.height_m
        changing = self._go(index, stage, is_stop=True, hold_s=0.0)
        changing = changing._replace(reach_m=reach, goes_on=way > reach, circles=True)
        yield changing
        left = min(way, reach) * min(
            self.parameters.altitude_acceptance_m / (abs(rise) or 1e-9), 1.0
        )
        self._here_m = self._circling = None
        if left > self.parameters.acceptance_radius_m:
            off_e, off_n = (east - stage.east_m) * left / way, (north - stage.north_m) * left / way
            self._here_m = stage.east_m + off_e, stage.north_m + off_n, stage.height_m
            self._circling = changing
            # Flown to from outside it looks at the centre already.
            half_s = float(yaw_time_s(np.array(math.pi), self.parameters))
            self._turns_s = 0.0 if way > reach - 2.0 * _WITHIN_M else half_s
        if stage.leaves_on_tangent and self._is_underway(min(way, reach), rise, changing.speed_m_s):
            radius = math.copysign(reach - self.parameters.acceptance_radius_m, stage.radius_m)
            self._circle = (stage.east_m, stage.north_m, radius)

    def _reach_m(self, stage: Stage) -> float:
        """Return within which distance of its place a change of height begins. [m]"""
        radius = abs(stage.radius_m) or self.parameters.loiter_radius_m
        return radius + self.parameters.acceptance_radius_m

    def _is_underway(self, way_m: float, rise_m: float, speed_m_s: float) -> bool:
        """Return whether a vehicle still moves on the map as a change of height ends.

        A way and a height are left together in proportion, once its speed has fallen to what the height
        allows.  At rest it turns nowhere (``PositionSmoothing::_isTurning``): it flies straight on.
        """
        p = self.parameters
        a, j, band = p.acceleration_m_s2, p.jerk_m_s3, np.array(p.altitude_acceptance_m)
        if abs(rise_m) <= band:
            return True
        left_m = max(way_m - 0.5 * speed_m_s * (speed_m_s / a + a / j), 0.0)
        vertical = p.acceleration_up_m_s2 if rise_m > 0.0 else p.acceleration_down_m_s2
        last_m_s = float(allowed_speed_m_s(band, 0.0, vertical, j))
        return last_m_s * left_m / abs(rise_m) > SLOWEST_TURN_M_S

    def _leave_circle(self, stage: Stage) -> None:
        """Begin the line of the next leg where it is the tangent of a circle.

        Notes
        -----
        Of a LOITER_TO_ALT with parameter 4 the place moves to where the tangent leads to the next place
        (``MissionBlock::is_mission_item_reached``, ``loiter_exit_xtrack``).  The vehicle, beside that
        leg, flies straight at that leg until near enough to turn into it
        (``PositionSmoothing::_getL1Point``): with 20 m, and 60 m to the next place, a build flew 74 m in 5 s
        more.
        """
        circle, self._circle = self._circle, None
        if circle is None or stage.kind in RETURN_STAGES:
            return
        east, north, radius = circle
        away_e, away_n = stage.east_m - east, stage.north_m - north
        # From within the circle none leads on: the place then moves to where the next is nearest to it.
        distance = max(math.hypot(away_e, away_n), abs(radius))
        turn = math.copysign(math.acos(abs(radius) / distance), radius)
        course = math.atan2(away_e, away_n) - turn
        out_e, out_n = math.sin(course), math.cos(course)
        vehicle_m, self._here_m = self._vehicle_m, None
        self._line_from_m = east + abs(radius) * out_e, north + abs(radius) * out_n
        if stage.kind is StageKind.CHANGE_HEIGHT:
            self._here_m = self._entered_m(stage, vehicle_m, (east, north))
        self.east_m, self.north_m = self._line_from_m

    def _entered_m(
        self, stage: Stage, vehicle_m: tuple[float, float, float], left_m: tuple[float, float]
    ) -> tuple[float, float, float] | None:
        """Return where a vehicle on its way to one centre comes within reach of the next. [m]

        It flies straight at what is ahead, else square to the line first
        (``PositionSmoothing::_getL1Point``).  ``None`` where that line begins out of reach.
        """
        reach = self._reach_m(stage) - _WITHIN_M
        place, here = complex(stage.east_m, stage.north_m), complex(*vehicle_m[:2])
        line_from, ahead = complex(*self._line_from_m), complex(*left_m) - here
        if abs(place - here) <= reach:
            return vehicle_m
        if abs(place - line_from) > reach:
            return None
        begin, end = here, place
        if _along(ahead, place - here) < ALIGNED_COS * abs(ahead):
            end = line_from + _unit(place - line_from) * _along(here - line_from, place - line_from)
        if abs(place - end) > reach:
            begin, end = end, place
        # Where a circle of that radius cuts the way.
        way = _along(place - begin, end - begin)
        beside = abs(place - begin - way * _unit(end - begin))
        way -= math.sqrt(max(reach**2 - beside**2, 0.0))
        entered = begin + way * _unit(end - begin)
        return entered.real, entered.imag, vehicle_m[2]

    def _passed_m(
        self, flown_to: tuple[tuple[float, float, float], Move] | None
    ) -> tuple[float, float, float]:
        """Return where the waypoint just flown to counts as reached: a return begins there. [m]

        RTL's decision (``RTL::computeReturnAltitude``) and its climb are of where the vehicle is, within
        the radius and NAV_MC_ALT_RAD of the place (``MissionBlock::is_mission_item_reached``).
        """
        if flown_to is None:
            return self._vehicle_m
        begin_m, move = flown_to
        way = np.subtract(move.target_m, begin_m)
        length = float(np.linalg.norm(way))
        # Its height counts as well as its place on the map, which a steep way comes near long before.
        level, rise = (
            max(one / (length or 1.0), 1e-9) for one in (math.hypot(*way[:2]), abs(way[2]))
        )
        tail = min(length, move.reach_m / level, self.parameters.altitude_acceptance_m / rise)
        asked = (np.array(one) for one in (tail, move.speed_m_s, move.hold_s))
        left = float(left_m(self.parameters, *asked))
        if left <= 0.0:
            return self._place_m
        east, north, height = (np.array(move.target_m) - way * (left / length)).tolist()
        return east, north, height

    def _wait(self, index: int, stage: Stage) -> Move:
        """Return a wait, in which the vehicle flies on to the place it has: an item without one sets none.

        From where a LOITER_TO_ALT counted as reached, it is still on the way to its centre.
        """
        wait = self._move(index, stage.item, hold_s=stage.hold_s, is_delay=True)
        if self._here_m is None or self._circling is None:
            return wait
        before = self._circling
        self._here_m = self._flown_on_m(stage.hold_s)
        self._turns_s = max(self._turns_s - stage.hold_s, 0.0)
        return wait._replace(
            speed_m_s=before.speed_m_s,
            radius_m=before.radius_m,
            reach_m=_NOT_LEFT * before.reach_m,
            goes_on=True,
            circles=True,
        )

    def _flown_on_m(self, time_s: float) -> tuple[float, float, float]:
        """Return where the vehicle is that flew on to the centre of a LOITER_TO_ALT for so long. [m]"""
        if self._circling is None:
            return self._vehicle_m
        east, north, height = self._vehicle_m
        left = math.dist((east, north), self._place_m[:2])
        part = min(self._circling.speed_m_s * time_s / left, 1.0) if left > 0.0 else 1.0
        return east + part * (self.east_m - east), north + part * (self.north_m - north), height

    def _place_at(self, stage: Stage) -> None:
        self._here_m = self._circling = None
        self.east_m, self.north_m, self.height_m = stage.east_m, stage.north_m, stage.height_m

    def _go(
        self, index: int, stage: Stage, *, is_stop: bool = False, hold_s: float | None = None
    ) -> Move:
        """Return the flight to where the vehicle is now meant to be, as its stage wants it."""
        speed, given, yaw = stage.speed_m_s, stage.acceptance_radius_m, stage.yaw_deg
        radius = self.parameters.acceptance_radius_m
        if given is not None and given >= _SMALLEST_RADIUS_M:
            radius = given
        move = self._move(
            index,
            stage.item,
            hold_s=stage.hold_s if hold_s is None else hold_s,
            is_stop=is_stop or stage.hold_s > 0.0,
            speed_m_s=None if speed is None else min(speed, self.parameters.speed_max_m_s),
            radius_m=radius,
            yaw_rad=math.nan if yaw is None else math.radians(yaw),
            needs_heading=stage.needs_heading,
        )
        return move if stage.looks_m is None else move._replace(looks_m=stage.looks_m)

    @property
    def _return_parameters(self) -> Px4Parameters:
        """Those with which no return that may begin beyond RTL_MIN_DIST stays in the cone."""
        nearer_m = max(self.parameters.return_min_distance_m - RETURN_PLACE_ERROR_M, 0.0)
        return replace(self.parameters, return_min_distance_m=nearer_m)

    @property
    def _vehicle_m(self) -> tuple[float, float, float]:
        return self._place_m if self._here_m is None else self._here_m

    @property
    def _place_m(self) -> tuple[float, float, float]:
        return self.east_m, self.north_m, self.height_m

    def _move(
        self,
        index: int,
        item: int,
        *,
        hold_s: float = 0.0,
        is_stop: bool = False,
        speed_m_s: float | None = None,
        radius_m: float | None = None,
        yaw_rad: float = math.nan,
        **flags: bool,
    ) -> Move:
        """Return a move to where the vehicle is now meant to be; speed and radius by default its own."""
        radius = self.parameters.acceptance_radius_m if radius_m is None else radius_m
        line_from_m, self._line_from_m = self._line_from_m, _NOWHERE_M
        return Move(
            stage=index,
            item=item,
            target_m=self._place_m,
            seen_height_m=self.height_m,
            speed_m_s=self.speed_m_s if speed_m_s is None else speed_m_s,
            radius_m=radius,
            reach_m=radius,
            hold_s=hold_s,
            yaw_rad=yaw_rad,
            is_stop=is_stop,
            looks_m=_NOWHERE_M,
            line_from_m=line_from_m,
            **flags,
        )
