"""Moves: what PX4's navigator makes of the stages of a route, as columns."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.mission.stage import Stage
    from planner.vehicle.px4_parameters import Px4Parameters

_SMALLEST_RADIUS_M = 0.001
"""An acceptance radius below this stands for NAV_ACC_RAD (``mission_item_to_position_setpoint``). [m]"""
_CONE_ANGLES_RAD = (np.radians(1.0), np.radians(89.0))
"""Half angles of the cone over home that mean something (``RTL::computeReturnAltitude``). [rad]"""


class Move(NamedTuple):
    """One flight to one place."""

    stage: int
    item: int
    east_m: float
    north_m: float
    height_m: float
    seen_height_m: float
    """Height of the place as the move before sees it. [m]"""
    speed_m_s: float
    radius_m: float
    hold_s: float
    yaw_rad: float
    """NaN where free."""
    is_stop: bool
    """Ends standing still, whatever follows."""
    is_delay: bool
    """A wait that the look-ahead of the move before looks past."""
    is_takeoff: bool
    is_landing: bool
    is_return: bool
    """Belongs to a return, which the look-ahead of the move before does not see."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Moves:
    """Moves as columns of length n, in flown order; several flights may stand one after the other."""

    stage: IntArray
    item: IntArray
    target_m: FloatArray
    """East, north, height above home. (n, 3) [m]"""
    seen_height_m: FloatArray
    speed_m_s: FloatArray
    radius_m: FloatArray
    hold_s: FloatArray
    yaw_rad: FloatArray
    is_stop: BoolArray
    is_delay: BoolArray
    is_takeoff: BoolArray
    is_landing: BoolArray
    is_return: BoolArray
    is_first: BoolArray
    """Begins a flight of its own."""
    start_m: FloatArray
    """Place from which a flight of its own begins; of no meaning elsewhere. (n, 3) [m]"""

    def __len__(self) -> int:
        """Return the number of moves."""
        return len(self.stage)

    @classmethod
    def of(cls, rows: Sequence[Move], starts: Sequence[tuple[int, tuple[float, ...]]]) -> Moves:
        """Return rows as columns; ``starts`` are the first rows of flights and where these begin."""
        columns = list(zip(*rows, strict=True))
        numbers = np.array(columns[2:10], dtype=np.float64)
        start = np.zeros((len(rows), 3))
        first = np.zeros(len(rows), dtype=np.bool_)
        for row, place in starts:
            start[row], first[row] = place, True
        flags = np.array(columns[10:], dtype=np.bool_)
        return cls(
            stage=np.array(columns[0], dtype=np.intp),
            item=np.array(columns[1], dtype=np.intp),
            target_m=numbers[:3].T.copy(),
            seen_height_m=numbers[3],
            speed_m_s=numbers[4],
            radius_m=numbers[5],
            hold_s=numbers[6],
            yaw_rad=numbers[7],
            is_stop=flags[0],
            is_delay=flags[1],
            is_takeoff=flags[2],
            is_landing=flags[3],
            is_return=flags[4],
            is_first=first,
            start_m=start,
        )


def moves_of_stages(stages: Sequence[Stage], parameters: Px4Parameters) -> Moves:
    """Return the moves of a flight that begins on the ground at home.

    Splines, circles and set-downs, which PX4 refuses at upload, are flown straight to their place.
    """
    navigator = _Navigator(parameters)
    return Moves.of([move for k, s in enumerate(stages) for move in navigator.moves(k, s)], [_HOME])


_HOME = (0, (0.0, 0.0, 0.0))


def moves_home(places_m: FloatArray, home_m: FloatArray, parameters: Px4Parameters) -> Moves:
    """Return the moves of returns from places, flights of their own, numbered as stages and items.

    Parameters
    ----------
    places_m : ndarray
        East, north, height above home. (k, 3) [m]
    home_m : ndarray
        Where they lead, the ground there included. (k, 3) [m]
    parameters : Px4Parameters
        The vehicle's.
    """
    rows: list[Move] = []
    starts: list[tuple[int, tuple[float, ...]]] = []
    for index, (place, home) in enumerate(zip(places_m.tolist(), home_m.tolist(), strict=True)):
        navigator = _Navigator(parameters, place=tuple(place), is_airborne=True)
        starts.append((len(rows), tuple(place)))
        rows.extend(navigator.return_moves(index, index, home))
    return Moves.of(rows, starts)


class _Navigator:
    """Where the vehicle is meant to be while stages are taken apart."""

    def __init__(
        self,
        parameters: Px4Parameters,
        *,
        place: tuple[float, ...] = (0.0, 0.0, 0.0),
        is_airborne: bool = False,
    ) -> None:
        self.parameters = parameters
        self.east_m, self.north_m, self.height_m = place
        self.is_airborne = is_airborne

    def moves(self, index: int, stage: Stage) -> Iterator[Move]:
        """Yield the moves of one stage."""
        match stage.kind:
            case StageKind.TAKEOFF:
                yield from self._take_off(index, stage)
            case StageKind.DELAY:
                yield self._move(index, stage.item, hold_s=stage.hold_s, is_delay=True)
            case StageKind.CHANGE_HEIGHT:
                # Level flight first; the height changes once the place is reached
                # (``MissionBlock``, NAV_CMD_LOITER_TO_ALT).
                self.east_m, self.north_m = stage.east_m, stage.north_m
                yield self._go(index, stage, is_stop=True, hold_s=0.0)
                self.height_m = stage.height_m
                yield self._go(index, stage, is_stop=True)
            case StageKind.LAND:
                self.east_m, self.north_m = stage.east_m, stage.north_m
                move = self._go(index, stage, is_stop=True, hold_s=0.0)
                yield move._replace(seen_height_m=stage.height_m, yaw_rad=np.nan)
                yield self._land(index, stage.item, stage.height_m)
            case StageKind.RETURN:
                home = [stage.east_m, stage.north_m, stage.height_m]
                yield from self.return_moves(index, stage.item, home)
            case _:
                self._place_at(stage)
                yield self._go(index, stage, is_stop=stage.kind is StageKind.LOITER)

    def return_moves(self, index: int, item: int, home: list[float]) -> Iterator[Move]:
        """Yield the moves of a return (``RtlDirect``); at MPC_XY_CRUISE, whatever was commanded."""
        parameters = self.parameters
        height = return_height_m(
            float(np.hypot(self.east_m - home[0], self.north_m - home[1])),
            self.height_m - home[2],
            parameters,
        )
        if height + home[2] > self.height_m:
            self.height_m = height + home[2]
            yield self._move(index, item, is_stop=True, is_return=True)
        self.east_m, self.north_m = home[0], home[1]
        yield self._move(index, item, is_stop=True, is_return=True)
        delay = parameters.return_land_delay_s
        if delay != 0.0:
            self.height_m = home[2] + min(parameters.return_descend_altitude_m, height)
            yield self._move(index, item, is_stop=True, is_return=True, hold_s=max(delay, 0.0))
        if delay >= 0.0:
            yield self._land(index, item, home[2])._replace(is_return=True)

    def _take_off(self, index: int, stage: Stage) -> Iterator[Move]:
        if not self.is_airborne:
            # Straight up where it stands; flying, a take-off item is a waypoint.
            self.height_m = stage.height_m
            yield self._move(index, stage.item, is_stop=True, is_takeoff=True)
            self.is_airborne = True
        self._place_at(stage)
        # Any heading is good enough for a take-off (``MissionBlock::is_mission_item_reached``).
        yield self._go(index, stage)._replace(yaw_rad=np.nan)

    def _land(self, index: int, item: int, ground_m: float) -> Move:
        self.height_m, self.is_airborne = ground_m, False
        return self._move(index, item, is_stop=True, is_landing=True)

    def _place_at(self, stage: Stage) -> None:
        self.east_m, self.north_m, self.height_m = stage.east_m, stage.north_m, stage.height_m

    def _go(
        self, index: int, stage: Stage, *, is_stop: bool = False, hold_s: float | None = None
    ) -> Move:
        """Return the flight to where the vehicle is now meant to be, as its stage wants it."""
        move = self._move(
            index,
            stage.item,
            hold_s=stage.hold_s if hold_s is None else hold_s,
            is_stop=is_stop or stage.hold_s > 0.0,
        )
        parameters = self.parameters
        speed, radius = stage.speed_m_s, stage.acceptance_radius_m
        return move._replace(
            speed_m_s=(move.speed_m_s if speed is None else min(speed, parameters.speed_max_m_s)),
            radius_m=(move.radius_m if radius is None or radius < _SMALLEST_RADIUS_M else radius),
            yaw_rad=np.nan if stage.yaw_deg is None else np.radians(stage.yaw_deg),
        )

    def _move(
        self,
        index: int,
        item: int,
        *,
        hold_s: float = 0.0,
        is_stop: bool = False,
        is_delay: bool = False,
        is_takeoff: bool = False,
        is_landing: bool = False,
        is_return: bool = False,
    ) -> Move:
        parameters = self.parameters
        return Move(
            index,
            item,
            self.east_m,
            self.north_m,
            self.height_m,
            self.height_m,
            min(parameters.cruise_speed_m_s, parameters.speed_max_m_s),
            parameters.acceptance_radius_m,
            hold_s,
            np.nan,
            is_stop,
            is_delay,
            is_takeoff,
            is_landing,
            is_return,
        )


def return_height_m(distance_m: float, height_m: float, parameters: Px4Parameters) -> float:
    """Return the height above home at which a return is flown. [m]

    Parameters
    ----------
    distance_m : float
        Horizontal distance from home. [m]
    height_m : float
        Height above home at which the return begins. [m]
    parameters : Px4Parameters
        RTL_RETURN_ALT, RTL_CONE_ANG, RTL_MIN_DIST, NAV_ACC_RAD.

    Notes
    -----
    ``RTL::computeReturnAltitude``: never below the present height; nearer than RTL_MIN_DIST no higher
    than the cone over home, but 2 NAV_ACC_RAD at least; within NAV_ACC_RAD twice the distance.
    """
    highest = parameters.return_altitude_m
    radius = parameters.acceptance_radius_m
    wanted = highest
    if parameters.return_cone_angle_rad > 0.0:
        if distance_m <= radius:
            wanted = 2.0 * distance_m
        else:
            if distance_m <= parameters.return_min_distance_m:
                angle = float(np.clip(parameters.return_cone_angle_rad, *_CONE_ANGLES_RAD))
                wanted = min(distance_m / float(np.tan(angle)), highest)
            wanted = max(wanted, 2.0 * radius)
    return max(min(wanted, highest), height_m)
