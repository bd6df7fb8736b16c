"""Destinations: where a return leads from each point of a flight, by the vehicle's own rules.

Returns that have to do with the mission are those of PX4 with RTL_TYPE 1 to 4, after
``RTL::setRtlTypeAndDestination`` and the classes it chooses from, as of PX4 1.16.  The mission's landing
is its first landing item; it begins at the first DO_LAND_START before that, else at the landing itself
(``MavlinkMissionManager``).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.findings import Rule, Severity
from planner.mission.commands import LANDINGS, RELATIVE_FRAMES, TAKEOFFS, Command
from planner.mission.route.position import ground_amsl_m
from planner.mission.route.stage import ReturnPath, Stage, StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.fence_schedule import FenceSchedule
    from planner.geo.terrain import TerrainGrid
    from planner.mission.items import Mission, MissionItem
    from planner.mission.route.stage import Route
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

HOME = 0
"""Home among destinations; rally point n of the mission is n."""
LANDING = -1
"""The mission's landing, straight to where it begins."""
ALONG = -2
"""Along the mission: on to its landing, or back to where it began."""
HERE = -3
"""Down where the vehicle is."""
_NEARER_M = 2.0
"""A place this much nearer than home is taken: ``MIN_DIST_THRESHOLD`` of PX4's rtl.cpp. [m]"""
_FARTHEST_M = 1e9
_AT_HOME_M = 10.0
"""A rally point this near to home is home: ``MAX_DIST_FROM_HOME_FOR_LAND_APPROACHES``. [m]"""
_RALLY_TYPES = frozenset({0, 1, 3, 5})
"""RTL_TYPE that looks at rally points; 2 and 4 follow the mission, 6 goes home if it can."""
_NOT_HOME = frozenset({1, 5})
"""RTL_TYPE that leads home only where there is nothing else; 5 not even then."""
_RALLY_ONLY = 5
_TO_LANDING = frozenset({1, 3})
_FOLLOW_MISSION = frozenset({2, 4})
_STRAIGHT = frozenset({0, _RALLY_ONLY})
_FORWARD_IF_IT_LANDS = 2
_HOME_IF_REACHED = 6
_LOITERS = (Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TIME, Command.NAV_LOITER_TO_ALT)
_PLACES = frozenset({Command.NAV_WAYPOINT, *_LOITERS}) | LANDINGS | TAKEOFFS
"""Items that hold a place (``MissionBlock::item_contains_position``)."""
_JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG})
_KINDS: Mapping[int, StageKind] = {
    Command.NAV_LAND: StageKind.LAND,
    Command.NAV_VTOL_LAND: StageKind.LAND,
    Command.NAV_LOITER_TO_ALT: StageKind.CHANGE_HEIGHT,
}


class ReturnTargets(Value, eq=False):
    """Where each of n returns leads."""

    ground_m: FloatArray
    """East, north, height of the ground above the first home. (n, 3) [m]"""
    above_ground_m: FloatArray
    """Height of the place above that ground as the autopilot has it: a rally point's, a moved home's.
    (n,) [m]"""
    datum_m: FloatArray
    """Height above the first home of the home that counts then. (n,) [m]"""
    return_ceiling_m: FloatArray
    """Height above that home at which the fence keeps the return; NaN: as the parameters have it. (n,) [m]"""
    paths: tuple[ReturnPath | None, ...] = ()
    """Of those that lead along the mission; empty where none does. (n,)"""
    stated_height_m: float | None = None
    """Height above the home that counts that the mission's file states for returns. [m]"""


class Destinations(Value, eq=False):
    """Where the returns of a flight may lead."""

    home_first_stage: IntArray
    """Stage from which each home counts, rising from 0. (h,)"""
    home_ground_m: FloatArray
    """East, north, height of the ground there. (h, 3) [m]"""
    home_datum_m: FloatArray
    """Height of each home's own altitude above the first: heights above home count from it. (h,) [m]"""
    rally_ground_m: FloatArray
    """(r, 3) [m]"""
    rally_height_m: FloatArray
    """Height of each rally point above whichever home counts. (r,) [m]"""
    parameters: FlightParameters | None
    """Of the autopilot that chooses; ``None`` for reference steps."""
    landing: ReturnPath | None = None
    """Straight to the mission's landing, and down along it; ``None``: there is none, or the vehicle
    takes no notice."""
    along: tuple[ReturnPath, ...] = ()
    """Along the mission, forward or back, from each stage of the route; empty where the vehicle does
    not return so, or it is not predicted."""
    stated_height_m: float | None = None
    """As of `ReturnTargets`. [m]"""
    return_ceiling_m: FloatArray | None = None
    """As of `ReturnTargets`, of each stage of the route. (stages,) [m]"""
    rally_is_taken: BoolArray | None = None
    """Whether the fence lets returns that begin in a stage lead to a rally point; ``None``: it does.
    (stages, r)"""
    as_legs_begin: Destinations | None = None
    """Those of the mission's own returns, by the fence as their legs begin; ``None``: these."""
    findings: tuple[Finding, ...] = ()
    """What of the vehicle's returns is not predicted as it flies them."""

    def home_of(self, stage: IntArray) -> IntArray:
        """Return which home counts while stages are flown, as positions among the homes. (n,)"""
        return np.searchsorted(self.home_first_stage, stage, side="right") - 1

    def targets(
        self, stage: IntArray, destination: IntArray | int, place_m: FloatArray
    ) -> ReturnTargets:
        """Return the targets of returns. (n,)

        Parameters
        ----------
        stage : ndarray of int
            Stages flown when they begin, which decide what home is. (n,)
        destination : ndarray of int
            ``HOME``, rally points, ``LANDING``, ``ALONG`` or ``HERE``. (n,)
        place_m : ndarray
            East, north, height above home where they begin. (n, 3) [m]
        """
        destination = np.broadcast_to(np.asarray(destination, dtype=np.intp), stage.shape)
        home = self.home_of(stage)
        ground_m, datum_m = self.home_ground_m[home], self.home_datum_m[home]
        above_m = datum_m - ground_m[:, 2]
        rally = destination > HOME
        if rally.any():
            number = destination[rally] - 1
            ground_m[rally] = self.rally_ground_m[number]
            above_m[rally] = datum_m[rally] + self.rally_height_m[number] - ground_m[rally, 2]
        paths: list[ReturnPath | None] = []
        if (destination < HOME).any():
            above_m[destination < HOME] = 0.0
            ground_m[destination == HERE, :2] = place_m[destination == HERE, :2]
            paths = [None] * len(stage)
        for row in np.flatnonzero((destination == LANDING) | (destination == ALONG)).tolist():
            path = self.landing if destination[row] == LANDING else self.along[stage[row]]
            if path is not None:
                paths[row], landing = path, path.stages[-1]
                ground_m[row] = (landing.east_m, landing.north_m, landing.height_m)
        return ReturnTargets(
            ground_m=ground_m,
            above_ground_m=above_m,
            datum_m=datum_m,
            return_ceiling_m=(
                np.full(len(stage), np.nan)
                if self.return_ceiling_m is None
                else self.return_ceiling_m[stage]
            ),
            paths=tuple(paths),
            stated_height_m=self.stated_height_m,
        )

    def chosen(self, point_m: FloatArray, stage: IntArray) -> IntArray:
        """Return the destination the vehicle itself chooses from places (n, 3) [m] in stages. (n,)

        PX4 (``RTL::findRtlDestination``): with RTL_TYPE 0 the nearest of home and the rally points; 3 looks
        at the mission's landing too, 1 at that and the rally points, 5 at rally points alone, and lands
        where it is without; 2 and 4 lead along the mission.  ArduPilot
        (``AP_Rally::calc_best_rally_or_home_location``): the nearest rally point that is within the limits of
        the fence that are on, unless it is beyond RALLY_LIMIT_KM, or home is nearer and RALLY_INCL_HOME is
        set.  Without parameters home alone is known.
        """
        home = np.full(len(stage), HOME, dtype=np.intp)
        if self.along:
            return np.full_like(home, ALONG)
        if self.parameters is None:
            return home
        from planner.vehicle.parameters.ardupilot import ArduPilotParameters

        to_home = self.home_ground_m[self.home_of(stage), :2] - point_m[:, :2]
        home_m = np.hypot(to_home[:, 0], to_home[:, 1])
        away = point_m[:, None, :2] - self.rally_ground_m[None, :, :2]
        rally_m = np.hypot(away[..., 0], away[..., 1])
        parameters = self.parameters
        if not isinstance(parameters, ArduPilotParameters):
            return self._chosen_by_px4(
                parameters.return_type, point_m, home_m, rally_m, self.home_of(stage)
            )
        if not len(self.rally_ground_m):
            return home
        if self.rally_is_taken is not None:
            rally_m = np.where(self.rally_is_taken[stage], rally_m, np.inf)
        nearest, nearest_m = rally_m.argmin(axis=1), rally_m.min(axis=1)
        far = nearest_m > (
            parameters.rally_limit_m if parameters.rally_limit_m > 0.0 else _FARTHEST_M
        )
        taken = ~(far | ((home_m < nearest_m) & bool(parameters.rally_includes_home)))
        return np.where(taken, nearest + 1, home)

    def _chosen_by_px4(
        self,
        return_type: int,
        point_m: FloatArray,
        home_m: FloatArray,
        rally_m: FloatArray,
        home: IntArray,
    ) -> IntArray:
        """Return the destination PX4 chooses among home, the landing and the rally points. (n,)"""
        least_m = np.full(len(home_m), np.inf) if return_type in _NOT_HOME else home_m
        none_else = HERE if return_type == _RALLY_ONLY else HOME
        chosen = np.full(len(home_m), none_else, dtype=np.intp)
        if self.landing is not None:
            landing = self.landing.stages[-1]
            landing_m = np.hypot(landing.east_m - point_m[:, 0], landing.north_m - point_m[:, 1])
            nearer = landing_m + _NEARER_M < least_m
            chosen = np.where(nearer, LANDING, chosen)
            least_m = np.where(nearer, landing_m, least_m)
        if not len(self.rally_ground_m) or return_type not in _RALLY_TYPES:
            return chosen
        if return_type != _RALLY_ONLY:
            away = self.home_ground_m[home, None, :2] - self.rally_ground_m[None, :, :2]
            rally_m = np.where(np.hypot(away[..., 0], away[..., 1]) > _AT_HOME_M, rally_m, np.inf)
        nearest = rally_m.argmin(axis=1)
        taken = rally_m[np.arange(len(nearest)), nearest] + _NEARER_M < least_m
        return np.where(taken, nearest + 1, chosen)


def make_destinations(
    mission: Mission,
    route: Route,
    parameters: FlightParameters | None,
    *,
    terrain: TerrainGrid | None = None,
    follows_mission: bool = True,
) -> Destinations:
    """Return the places the returns of a flight may lead to.

    ``parameters`` are those of the autopilot that chooses, ``None`` where none is known.  Without terrain
    the ground under rally points and landings is level with home.  Reference steps do not follow the
    mission on a return (``follows_mission``): X904 says so where the vehicle does.
    """
    homes = route.moved_homes
    latitude_deg = np.array([point.latitude_deg for point in mission.rally])
    longitude_deg = np.array([point.longitude_deg for point in mission.rally])
    east, north = route.frame.east_north_m(latitude_deg, longitude_deg)
    ground = np.zeros(len(mission.rally))
    if terrain is not None and mission.rally:
        known = terrain.height_amsl_m(latitude_deg, longitude_deg)
        ground = np.ma.filled(known - route.ground_datum_m, 0.0)
    height = np.array([point.height_above_home_m for point in mission.rally], dtype=np.float64)
    straight = Destinations(
        home_first_stage=np.array([0, *(home.first_stage for home in homes)], dtype=np.intp),
        home_ground_m=np.array(
            [(0.0, 0.0, 0.0), *((home.east_m, home.north_m, home.ground_m) for home in homes)]
        ),
        home_datum_m=np.array([0.0, *(home.datum_m for home in homes)]),
        rally_ground_m=np.column_stack((east, north, ground)),
        rally_height_m=height,
        parameters=parameters,
        stated_height_m=route.return_height_m,
    )
    if parameters is None:
        return straight
    from planner.vehicle.parameters.px4 import Px4Parameters

    if not isinstance(parameters, Px4Parameters):
        from planner.flight.fence_schedule import fence_schedule

        acting = fence_schedule(route, parameters, acts=True)
        fenced = _with_fence(straight, route, parameters, acting)
        if not any(one.is_late for one in route.fence_switches):
            return fenced
        begun = fence_schedule(route, parameters, acts=True, as_legs_begin=True)
        return replace(fenced, as_legs_begin=_with_fence(straight, route, parameters, begun))
    if not follows_mission and leads_along(mission, parameters.return_type):
        return straight
    return _with_mission(straight, mission, route, parameters.return_type, terrain)


def _with_fence(
    straight: Destinations, route: Route, parameters: ArduPilotParameters, schedule: FenceSchedule
) -> Destinations:
    """Return destinations of ArduPilot's returns where the fence is on by a schedule."""
    from planner.flight.fence_schedule import rally_is_taken, return_ceilings_m

    home_m = straight.home_ground_m[straight.home_of(np.arange(len(route.stages))), :2]
    away_m = straight.rally_ground_m[None, :, :2] - home_m[:, None]
    return replace(
        straight,
        return_ceiling_m=return_ceilings_m(parameters, schedule),
        rally_is_taken=rally_is_taken(
            parameters,
            schedule,
            height_m=straight.rally_height_m,
            from_home_m=np.hypot(away_m[..., 0], away_m[..., 1]),
        ),
    )


def leads_along(mission: Mission, return_type: int) -> bool:
    """Return whether PX4's RTL_TYPE leads along items of a mission."""
    if return_type in _TO_LANDING:
        return any(item.command in LANDINGS for item in mission.items)
    return return_type in _FOLLOW_MISSION


def with_own_returns(route: Route, destinations: Destinations) -> Route:
    """Return a route whose own returns lead where the vehicle itself would return to.

    They lead straight home in what is given; what takes off again after one does so from there.
    """
    destinations = destinations.as_legs_begin or destinations
    stages = list(route.stages)
    for first, number in route.return_spans:
        before, own = route.stages[first - 1], route.stages[number]
        place_m = np.array([[before.east_m, before.north_m, before.height_m]])
        stage = np.array([first])
        chosen = destinations.chosen(place_m, stage)
        if destinations.return_ceiling_m is not None:
            own = replace(own, return_ceiling_m=float(destinations.return_ceiling_m[first]))
            stages[number] = own
        if chosen[0] == HOME:
            continue
        targets = destinations.targets(stage, chosen, place_m)
        east_m, north_m, ground_m = targets.ground_m[0].tolist()
        stages[number] = replace(
            own,
            east_m=east_m,
            north_m=north_m,
            height_m=ground_m,
            above_ground_m=float(targets.above_ground_m[0]),
            return_path=targets.paths[0] if targets.paths else None,
        )
        there_m = east_m - own.east_m, north_m - own.north_m
        begun = before.east_m, before.north_m
        whole_m = math.dist(begun, (own.east_m, own.north_m))
        for at in range(first, number):  # as far along the other way
            leg = stages[at]
            fraction = math.dist(begun, (leg.east_m, leg.north_m)) / whole_m
            stages[at] = replace(
                leg,
                east_m=leg.east_m + fraction * there_m[0],
                north_m=leg.north_m + fraction * there_m[1],
            )
        if number + 1 < len(stages):
            stages[number + 1] = replace(stages[number + 1], east_m=east_m, north_m=north_m)
    return replace(route, stages=tuple(stages))


SETTING_NOT_FOLLOWED = Rule(
    "T110 setting-not-followed",
    Severity.WARNING,
    summary="A setting of the vehicle makes it fly other than predicted.",
    why="A return that stays in the air, or leads elsewhere, takes other time and energy than "
    "predicted.",
    how="PX4's COM_DISARM_LAND is negative, or RTL_TYPE above 5; MPC_TKO_SPEED, or 0.6 of MPC_Z_VEL_ALL, is "
    "0.3 m/s or less, an error: it stays on the ground until it disarms; a heading that an item needs "
    "(NAV_LOITER_TIME, parameter 2, NAV_LOITER_TO_ALT, parameter 1: its own or that to a region of "
    "interest) is not reached in the whole seconds of MIS_YAW_TMT, an error: it gives the mission up; a "
    "precision landing that is "
    "required (RTL_PLD_MD 2, a second parameter of 2 in NAV_LAND) climbs to PLD_SRCH_ALT and searches "
    "PLD_MAX_SRCH times for PLD_SRCH_TOUT where it sees no target, an error where the margin does not hold "
    "that, and not checked where it climbs above a limit of height (X904); with a second parameter of 1 it "
    "lands where it is as the place counts as reached: told where NAV_ACC_RAD is above 3 m; "
    "ArduPilot's with PLND_STRICT 1 climbs and tries again, and stands for 7 s where it sees none, an error "
    "where the margin does not hold those, with 2 it stays in the air, an error; "
    "MOT_BAT_CURR_MAX is below the current of "
    "the flight at its lowest voltage, or, an error, of a hover: flown with a low MOT_THST_HOVER, it sank to "
    "the ground; PSC_NE_VEL_P, PSC_NE_VEL_I or PSC_NE_POS_P is below 0.8 of its default (flown 8 % longer "
    "with 1 and 0.3), an error where the margin does not hold a tenth of the energy; NAV_MIN_GND_DIST is "
    "above a place that is sunk to: with a range finder PX4 stops that descent.  "
    "An error where RTL_TYPE 1 to 4 leads along items that jump: the returns of PX4 1.16 do not "
    "count the jumps "
    "they take (MissionBase::getNextPositionItems), and go round without end.  With RTL_TYPE 1 or 3 and no "
    "place of the mission before its NAV_LAND, PX4 1.17 sinks while it flies there from where it has climbed "
    "to the height of its return (flown: from 30 m at 5 m/s it touches the ground after 129 m): an error "
    "where the landing is farther away than 0.8 of the way it flies at MPC_XY_CRUISE while it comes down, "
    "100 m then, and than 10 m; nearer a warning, and A104 is not checked (X904).  PX4 chooses the height of "
    "a return to "
    "the mission's landing where that becomes its return (RTL::setRtlTypeAndDestination): with RTL_TYPE 1 "
    "and no rally points standing at home, and so it is predicted; else in flight: told where it is 3 m "
    "higher than predicted, an error where the margin does not hold that climb, and where it is 3 m lower, "
    "A104 not checked then (X904).  Back along the mission (RTL_TYPE 2, 4) PX4 flies at the speed commanded "
    "before the item it goes back to, or the one before that (RtlMissionFastReverse::on_activation; flown at "
    "1 m/s for 10): where they differ an error for the mission's own return, of which 2 flights of 4 were as "
    "predicted, and for others where the margin does not hold what that may take.",
    fix="set the parameter so that the vehicle returns and lands as predicted, or allow for it "
    "yourself",
    instead="the parameters of --params",
)

RETURN_LANDS_HERE = Rule(
    "T113 return-lands-here",
    Severity.ERROR,
    summary="A return of the vehicle lands wherever it is at that moment.",
    why="Every failsafe that returns, and a return of the mission, would bring it down in water, in trees "
    "or among people: on no place that anybody chose.",
    how="PX4's RTL_TYPE is 5, which leads to rally points alone, and the mission has none (rtl.cpp).",
    fix="add a rally point to the mission, or set RTL_TYPE to 0",
    instead="a rally point in the mission, or the parameters of --params",
)


def _with_mission(
    straight: Destinations,
    mission: Mission,
    route: Route,
    return_type: int,
    terrain: TerrainGrid | None,
) -> Destinations:
    """Return destinations with what RTL_TYPE has to do with the mission."""
    if return_type in _STRAIGHT:
        if return_type != _RALLY_ONLY or mission.rally:
            return straight
        message = "RTL_TYPE is 5 without rally points: a return lands where the vehicle is"
        return replace(straight, findings=(RETURN_LANDS_HERE.finding(message),))
    items = _ReturnItems(mission, route, terrain)
    leads, severity = "somewhere not known here", Severity.WARNING
    if return_type == _HOME_IF_REACHED:
        leads = "home if it can be reached, else to a rally point"
    elif return_type in _TO_LANDING:
        if items.landing is None:
            return straight
        if not items.has_jump(items.land_start, items.landing):
            path = items.landing_path(items.landing)
            if return_type in _NOT_HOME and not mission.rally:
                # No other is ever chosen: the height stays that chosen before the flight.
                path = replace(path, height_chosen_m=(0.0, 0.0, 0.0))
            return replace(straight, landing=path)
        leads = "to the mission's landing, and the mission jumps on the way there"
        severity = Severity.ERROR
    elif return_type in _FOLLOW_MISSION:
        if not items.has_jump(0, len(mission.items) - 1):
            homes_m = straight.home_ground_m[straight.home_of(np.arange(len(route.stages)))]
            always_forward = return_type == _FORWARD_IF_IT_LANDS
            return replace(
                straight,
                along=tuple(
                    items.path_along(stage.item, home_m, always_forward=always_forward)
                    for stage, home_m in zip(route.stages, homes_m.tolist(), strict=True)
                ),
            )
        leads = "along the mission, whose jumps PX4 may take again and again on the way"
        severity = Severity.ERROR
    returning = next(iter(route.stages_of(StageKind.RETURN)), None)
    finding = SETTING_NOT_FOLLOWED.finding(
        f"RTL_TYPE {return_type} returns {leads}: time, energy and fence are those of the "
        "straight return",
        item=None if returning is None else returning.item,
        severity=severity,
    )
    return replace(straight, findings=(finding,))


class _ReturnItems:
    """The items of a mission as a return flies them; positions count from 0, in file order."""

    def __init__(self, mission: Mission, route: Route, terrain: TerrainGrid | None) -> None:
        self._items = mission.items
        self._route = route
        self._terrain = terrain
        # Of several stages of one item the last: the first may be a take-off put before it.
        flown = {stage.item: stage for stage in route.stages}
        self._stages = tuple(
            self._flown_to(at, item, flown.get(at + 1)) if item.command in _PLACES else None
            for at, item in enumerate(mission.items)
        )
        commands = [item.command for item in mission.items]
        landings = [at for at, command in enumerate(commands) if command in LANDINGS]
        starts = [at for at, command in enumerate(commands) if command == Command.DO_LAND_START]
        self.landing = landings[0] if landings else None
        self.land_start = min([*starts[:1], *landings[:1]], default=0)

    def has_jump(self, first: int, last: int) -> bool:
        """Return whether an item from one to another, both included, jumps."""
        # One of no repetition is passed over (``MissionBase::getNonJumpItem``).
        return any(
            item.command in _JUMPS and item.param2 != 0.0 for item in self._items[first : last + 1]
        )

    def landing_path(self, landing: int) -> ReturnPath:
        """Return the way down to the mission's landing, from where it begins."""
        return ReturnPath(
            stages=self._forward(self.land_start),
            speed_m_s=self._speed_m_s(self.land_start),
            climbs_over_m=self._height_m(landing),
        )

    def path_along(
        self, item: int, home_m: tuple[float, float, float], *, always_forward: bool
    ) -> ReturnPath:
        """Return the way along the mission while an item is flown: on to its landing, or back home."""
        flown = item - 1
        others: tuple[float | None, ...] = ()
        if self.landing is not None and (
            always_forward or self.land_start - flown < flown  # ``RTL::reverseIsFurther``
        ):
            stages = self._forward(flown)
        else:
            east_m, north_m, height_m = home_m
            down = Stage(
                kind=StageKind.LAND, item=item, east_m=east_m, north_m=north_m, height_m=height_m
            )
            stages, others = (*self._back(flown), down), self._other_speeds_m_s(flown)
        return ReturnPath(stages=stages, speed_m_s=self._speed_m_s(flown), other_speeds_m_s=others)

    def _other_speeds_m_s(self, flown: int) -> tuple[float | None, ...]:
        """Return other speeds than that before an item which a way back from there may be flown at.

        PX4 takes the speed commanded before the item it goes back to: the one before that flown to, or the
        place nearest to it (``RtlMissionFastReverse::on_activation``); of the mission's own return the place
        it comes from, or the item before that: 2 flights of 4 each.
        """
        place = next((at for at in range(flown - 1, 0, -1) if self._stages[at] is not None), 0)
        first = place - (self._items[flown].command == Command.NAV_RETURN_TO_LAUNCH)
        may_be = dict.fromkeys(self._speed_m_s(at) for at in range(max(first, 0), flown))
        return tuple(may_be.keys() - {self._speed_m_s(flown)})

    def _speed_m_s(self, before: int) -> float | None:
        """Return the speed last commanded before an item; ``None``: the vehicle's own."""
        for item in reversed(self._items[:before]):
            if item.command == Command.DO_CHANGE_SPEED:
                return item.param2 if item.param2 is not None and item.param2 > 0.0 else None
        return None

    def _height_m(self, at: int) -> float:
        """Return the altitude of an item above home."""
        item = self._items[at]
        datum_m = 0.0 if item.frame in RELATIVE_FRAMES else self._route.home_amsl_m
        return (item.altitude_m or 0.0) - datum_m

    def _forward(self, flown: int) -> tuple[Stage, ...]:
        """Return the places from an item to the landing, both included."""
        last = self.landing if self.landing is not None else len(self._stages) - 1
        return tuple(filter(None, self._stages[min(flown, last) : last + 1]))

    def _back(self, flown: int) -> tuple[Stage, ...]:
        """Return the places back from before an item to the take-off, or the first place there is."""
        back: list[Stage] = []
        # At the first item there is none before: that one is flown to.
        for at in range(max(flown - 1, 0), -1, -1):
            stage = self._stages[at]
            if stage is None:
                continue
            # A landing on the way back is a place like any other.
            kind = StageKind.GO if stage.kind is StageKind.LAND else stage.kind
            back.append(replace(stage, kind=kind))
            if self._items[at].command in TAKEOFFS:
                break
        return tuple(back)

    def _flown_to(self, at: int, item: MissionItem, stage: Stage | None) -> Stage:
        """Return a place of the mission as a return flies to it."""
        kind = _KINDS.get(item.command, StageKind.GO)
        if stage is not None:
            return replace(stage, kind=kind, hold_s=0.0, speed_m_s=None, return_path=None)
        latitude_deg, longitude_deg = item.latitude_deg or 0.0, item.longitude_deg or 0.0
        east, north = self._route.frame.east_north_m([latitude_deg], [longitude_deg])
        lands, changes = kind is StageKind.LAND, kind is StageKind.CHANGE_HEIGHT
        return Stage(
            kind=kind,
            item=at + 1,
            east_m=float(east[0]),
            north_m=float(north[0]),
            height_m=self._ground_m(latitude_deg, longitude_deg) if lands else self._height_m(at),
            radius_m=(item.param2 or 0.0) if changes else 0.0,
            leaves_on_tangent=changes and (item.param4 or 0.0) > 0.0,
        )

    def _ground_m(self, latitude_deg: float, longitude_deg: float) -> float:
        """Return the height of the ground above home, where it is known."""
        if self._terrain is None:
            return 0.0
        amsl_m = ground_amsl_m(self._terrain, latitude_deg, longitude_deg)
        return 0.0 if amsl_m is None else amsl_m - self._route.ground_datum_m
