"""What PX4's feasibility check and ArduPilot's arming check refuse, and limits they apply.

After ``FeasibilityChecker.cpp`` and ``mission_block.cpp`` of PX4 1.14 to early 2026, and ArduPilot's
``AP_Arming.cpp``, ``AP_Mission.cpp`` and ``AP_Rally.cpp``.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Remarks, Rule, Severity
from planner.geo.geodesy import distance_m, most_distance_m
from planner.mission.commands import AMSL_FRAMES, TAKEOFFS, TERRAIN_FRAMES, Command, is_destination
from planner.mission.route.order import is_counted
from planner.mission.route.queue import JUMPS
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, ARDUPILOT_TARGET, PX4, PX4_TARGET, judges

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    import numpy.typing as npt

    from planner.autopilot import Target
    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters

_CLOSEST_GATE_M = 0.05
_ACCEPTANCE_RADIUS_M = 2.0
"""Default of NAV_ACC_RAD on a multicopter. [m]"""
_LEAST_CLIMB_M = 1.0
"""Of a take-off, beyond NAV_ACC_RAD. [m]"""
_FROM_HOME_UP = (1, 17)
"""The version from which PX4 takes any take-off that ends above home."""
_ROUNDING_M = 1e-3
_WARNS_ONLY = (1, 16)
"""The version from which a first place far away is a warning (PX4 #23568)."""
_FIRST_PLACE_M = 10_000.0
"""Default of MIS_DIST_1WP. [m]"""
_PLACES = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TIME,
        Command.NAV_LAND,
        Command.NAV_TAKEOFF,
        Command.NAV_LOITER_TO_ALT,
        Command.NAV_VTOL_TAKEOFF,
        Command.NAV_VTOL_LAND,
    }
)
"""``MissionBlock::item_contains_position``, of which a gate is none."""
_TAKEOFF, _LANDING, _BOTH, _BOTH_OR_NONE = {1}, {2}, {3}, {4, 5}
"""MIS_TKO_LAND_REQ; 5 asks for more in the air only."""
_REQUIRED: Mapping[int, Command] = {
    0: Command.NAV_LAND,
    1: Command.NAV_VTOL_LAND,
    2: Command.DO_LAND_START,
    3: Command.NAV_TAKEOFF,
    4: Command.NAV_VTOL_TAKEOFF,
    6: Command.NAV_RETURN_TO_LAUNCH,
}
"""Item by bit of ARMING_MIS_ITEMS (AP_Arming.cpp, ``mission_checks``)."""
_FEWEST_COUNTED, _MOST_COUNTED = 15, 100
"""AP_MISSION_MAX_NUM_DO_JUMP_COMMANDS, by the memory of the board (AP_Mission.h)."""
_RALLY_BIT = 5
_RALLY_LIMIT_M = 300.0
"""Copter's default of RALLY_LIMIT_KM. [m]"""
_LANDINGS = frozenset(
    {Command.NAV_LAND, Command.NAV_VTOL_LAND, Command.NAV_RETURN_TO_LAUNCH, Command.DO_LAND_START}
)

REQUIRED_ITEM_MISSING = Rule(
    "M116 required-item-missing",
    Severity.ERROR,
    summary="The mission lacks an item without which the vehicle refuses it.",
    why="The upload succeeds, and the vehicle refuses in the field (QGroundControl #7836: 'one of the "
    "most common user complaints'; MAVSDK #2103).",
    how="PX4 MIS_TKO_LAND_REQ: 1 take-off, 2 landing, 3 both, 4 and 5 both or neither; a return does "
    "not count as a landing.  ArduPilot ARMING_MIS_ITEMS, bits 0 NAV_LAND, 1 VTOL_LAND, 2 "
    "DO_LAND_START, 3 NAV_TAKEOFF, 4 VTOL_TAKEOFF, 5 a rally point within RALLY_LIMIT_KM of home, 6 "
    "RETURN_TO_LAUNCH.",
    fix="add the item, or change the parameter on the vehicle",
    instead="a mission with the items it asks for, or --params",
)


@judges(REQUIRED_ITEM_MISSING, needs=(PX4,))
def _required_by_px4(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    required, commands = parameters.takeoff_land_required, a.mission.commands
    takes_off = not commands.isdisjoint(TAKEOFFS)
    lands = Command.NAV_LAND in commands
    missing = []
    if not takes_off and (required in _TAKEOFF | _BOTH or (required in _BOTH_OR_NONE and lands)):
        missing.append("NAV_TAKEOFF")
    if not lands and (required in _LANDING | _BOTH or (required in _BOTH_OR_NONE and takes_off)):
        missing.append("NAV_LAND")
    if missing:
        home = " (a return does not count as a landing)" if "NAV_LAND" in missing else ""
        yield a.finding(
            REQUIRED_ITEM_MISSING,
            f"PX4 refuses the mission without {' and '.join(missing)}{home}: MIS_TKO_LAND_REQ is "
            f"{required}",
        )


@judges(REQUIRED_ITEM_MISSING, needs=(ARDUPILOT,))
def _required_by_ardupilot(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    from planner.rules.arming import is_checked
    from planner.rules.arming_checks import MISSION

    bits = parameters.mission_items_required
    if bits <= 0 or not is_checked(a, MISSION):
        return
    missing = [
        command.name
        for bit, command in _REQUIRED.items()
        if bits & 1 << bit and command not in a.mission.commands
    ]
    limit_m = _rally_limit_m(a)
    if bits & 1 << _RALLY_BIT and not any(
        math.hypot(*point_m) <= limit_m for point_m in _rally_m(a)
    ):
        within = "" if math.isinf(limit_m) else f" within {quantity.distance(limit_m)} of home"
        missing.append(f"a rally point{within}")
    if missing:
        yield a.finding(
            REQUIRED_ITEM_MISSING,
            f"ArduPilot does not arm without {', '.join(missing)}: ARMING_MIS_ITEMS is {bits}",
        )


FIRST_WAYPOINT_FAR = Rule(
    "M104 first-wp-far",
    Severity.WARNING,
    summary="The first waypoint is farther from home than PX4's MIS_DIST_1WP.",
    why="Probably a mission of another site: PX4 refused it up to 1.15 and warns since 1.16 (PX4 "
    "#8146, #21262, #23568).",
    how="Distance from home to the first item with a place: MIS_DIST_1WP or more, where that is "
    "positive.  An error for --target px4-1.15.",
    fix="check home and mission, or raise MIS_DIST_1WP",
    instead="a home near the mission, or MIS_DIST_1WP by --params",
)


@judges(FIRST_WAYPOINT_FAR, needs=(PX4_TARGET,))
def _first_waypoint_far(a: Assessment, target: Target) -> Iterator[Finding]:
    parameters, home = PX4.of(a), a.mission.home
    limit_m = _FIRST_PLACE_M if parameters is None else parameters.first_waypoint_distance_m
    number, latitude_deg, longitude_deg = next(_places(a), (0, 0.0, 0.0))
    if home is None or limit_m <= 0.0 or not number:
        return
    home_deg = home.latitude_deg, home.longitude_deg
    if most_distance_m(home_deg, (latitude_deg, longitude_deg)) < limit_m:
        return  # as nearly always: how far exactly takes a hundred times as long
    away_m = float(distance_m(*home_deg, latitude_deg, longitude_deg))
    if away_m >= limit_m:
        refuses = target.version is not None and target.version < _WARNS_ONLY
        yield a.finding(
            FIRST_WAYPOINT_FAR,
            f"first waypoint {quantity.beside(away_m, limit_m, quantity.distance)} from home; "
            f"MIS_DIST_1WP is {quantity.distance(limit_m)}: PX4 "
            f"{'refuses the mission' if refuses else 'warns'}",
            item=number,
            severity=Severity.ERROR if refuses else None,
        )


TAKEOFF_TOO_LOW = Rule(
    "M128 takeoff-too-low",
    Severity.ERROR,
    summary="The take-off is too low for PX4: it refuses the mission.",
    why="PX4 answers 'Mission rejected: Takeoff altitude too low!' on the field.",
    how="Altitude of NAV_TAKEOFF above home less than 1 m more than NAV_ACC_RAD, 2 m by default, before 1.17 "
    "or where the version is not known; from 1.17 on, none above home (FeasibilityChecker::checkTakeoff).",
    fix="take off to 3 m at least, or to 1 m more than NAV_ACC_RAD; or name the version (--target px4-1.17)",
    instead="a higher take-off",
)


@judges(TAKEOFF_TOO_LOW, needs=(PX4_TARGET,))
def _takeoff_too_low(a: Assessment, target: Target) -> Iterator[Finding]:
    parameters = PX4.of(a)
    radius_m = _ACCEPTANCE_RADIUS_M if parameters is None else parameters.acceptance_radius_m
    is_later = target.version is not None and target.version >= _FROM_HOME_UP
    least_m = 0.0 if is_later else radius_m + _LEAST_CLIMB_M
    for number, item in a.mission.numbered(*TAKEOFFS):
        if item.altitude_m is None:
            continue
        height_m = item.altitude_m
        if item.frame in AMSL_FRAMES:
            height_m -= a.route.home_amsl_m
        if height_m < least_m - _ROUNDING_M or height_m <= 0.0:
            least = (
                "that of home"
                if is_later
                else f"{quantity.decimals(least_m, 1)} m, NAV_ACC_RAD and 1 m"
            )
            yield a.finding(
                TAKEOFF_TOO_LOW,
                f"take-off to {quantity.decimals(height_m, 1)} m above home: PX4 "
                f"{'' if is_later else 'before 1.17 '}refuses less than {least}",
                item=number,
            )
            return


GATE_AT_WAYPOINT = Rule(
    "M119 gate-at-waypoint",
    Severity.ERROR,
    summary="A gate is at the same place as the next waypoint, and is never passed.",
    why="PX4 counts a gate as passed once the vehicle is beyond it in the direction of the next place "
    "(``MissionBlock::is_mission_item_reached_or_completed``): from a gate at that place there is none, and "
    "the mission hangs.  Flown: it hovers at the waypoint for ever.  A gate at the waypoint before it is "
    "passed at once.",
    how="CONDITION_GATE less than 5 cm from the next item with a place.",
    fix="move the gate away from the next waypoint",
    instead="a gate away from its neighbours",
)


@judges(GATE_AT_WAYPOINT, needs=(PX4_TARGET,))
def _gate_at_waypoint(a: Assessment, _target: Target) -> Iterator[Finding]:
    if Command.CONDITION_GATE not in a.mission.commands:
        return
    gates: list[tuple[int, float, float]] = []
    for place in _places(a, _PLACES | {Command.CONDITION_GATE}):
        number, *here = place
        if a.mission.items[number - 1].command == Command.CONDITION_GATE:
            gates.append(place)
            continue
        for gate, *there in gates:
            apart_m = float(distance_m(*there, *here))
            if apart_m < _CLOSEST_GATE_M:
                yield a.finding(
                    GATE_AT_WAYPOINT,
                    f"gate {apart_m:.2f} m from the next waypoint (item {number}): PX4 never passes it and "
                    "hovers there",
                    item=gate,
                )
        gates.clear()


def _places(
    a: Assessment, commands: frozenset[Command] = _PLACES
) -> Iterator[tuple[int, float, float]]:
    """Yield number, latitude and longitude of the items with a place. [°]"""
    for number, item in enumerate(a.mission.items, start=1):
        latitude_deg, longitude_deg = item.latitude_deg, item.longitude_deg
        if item.command in commands and latitude_deg is not None and longitude_deg is not None:
            yield number, latitude_deg, longitude_deg


_LEVEL_SPEEDS, _LEAST_SPEED_M_S = frozenset({0.0, 1.0}), 0.1
SPEED_CLAMPED = Rule(
    "T103 speed-clamped",
    Severity.WARNING,
    summary="A commanded speed is beyond the vehicle's limits and is not flown.",
    why="The autopilot flies slower without a message and takes longer than planned (PX4 #11764, "
    "#18598, ArduPilot #7741).",
    how="DO_CHANGE_SPEED against MPC_XY_VEL_MAX on PX4.  ArduPilot flies the commanded speed, as fast as its "
    "lean angle allows (W102); level speeds below 0.1 m/s are an error: all but its latest versions keep the "
    "speed before (AC_WPNav, WPNAV_WP_SPEED_MIN), which is not what is predicted.",
    fix="command a speed within the limit, or raise the limit on the vehicle",
)


@judges(SPEED_CLAMPED, needs=(PX4,))
def _speed_clamped(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    limit_m_s = parameters.speed_max_m_s
    remarks = Remarks()
    for number, item in a.mission.numbered(Command.DO_CHANGE_SPEED):
        if (item.param2 or 0.0) > limit_m_s:
            remarks.add(
                SPEED_CLAMPED,
                f"{quantity.beside(item.param2 or 0.0, limit_m_s, quantity.speed)} commanded; PX4 flies "
                f"{quantity.speed(limit_m_s)} (MPC_XY_VEL_MAX)",
                item=number,
                place=item.place,
            )
    yield from remarks.findings()


@judges(SPEED_CLAMPED, needs=(ARDUPILOT_TARGET,))
def _speed_not_taken(a: Assessment, _target: Target) -> Iterator[Finding]:
    for number, item in a.mission.numbered(Command.DO_CHANGE_SPEED):
        speed_m_s = item.param2 or 0.0
        if (item.param1 or 0.0) in _LEVEL_SPEEDS and 0.0 < speed_m_s < _LEAST_SPEED_M_S:
            yield a.finding(
                SPEED_CLAMPED,
                f"{speed_m_s:g} m/s commanded; ArduPilot takes no speed below {_LEAST_SPEED_M_S:g} m/s and "
                "keeps the one before: not as predicted",
                severity=Severity.ERROR,
                item=number,
                fix=f"command {_LEAST_SPEED_M_S:g} m/s or more, or wait with NAV_DELAY",
            )
            return


_ROUNDING_M = 0.01
"""Of heights above a grid. [m]"""

TERRAIN_OFF = Rule(
    "A118 terrain-off",
    Severity.ERROR,
    summary="The mission counts heights from terrain, and the vehicle's terrain data are off.",
    why="ArduPilot does not start an item above terrain without terrain data: it reports 'Terrain data "
    "missing', and its terrain failsafe returns.",
    how="Items in frame 10 or 11 on ArduPilot with TERRAIN_ENABLE 0 and no rangefinder that it follows "
    "the ground by: one that looks down (RNGFND1_TYPE to RNGFNDA_TYPE, their ORIENT 25) with WPNAV_RFND_USE "
    "1.  With one terrain data are not looked at (AC_WPNav::get_terrain_source): items higher above terrain "
    "than it reaches (RNGFND1_MAX_CM), or flown to from higher, where its readings are unhealthy and the "
    "terrain failsafe ends the mission (flown: take-off to 20 m, then 8 m above terrain by 12 m of reach).",
    fix="set TERRAIN_ENABLE to 1 and load terrain data, or write the altitudes above home",
    instead="parameters with TERRAIN_ENABLE 1",
)


@judges(TERRAIN_OFF, needs=(ARDUPILOT,))
def _terrain_off(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    from planner.rules.arming_checks import rangefinder_reach_m

    reach_m = rangefinder_reach_m(numbers(a))
    over_terrain = [
        number
        for number, item in enumerate(a.mission.items, start=1)
        if item.frame in TERRAIN_FRAMES and is_destination(item.command)
    ]
    if reach_m is not None:
        heights_m = {
            number: a.mission.items[number - 1].altitude_m or 0.0 for number in over_terrain
        }
        highest = max(heights_m, key=lambda number: heights_m[number], default=None)
        if highest is not None and heights_m[highest] > reach_m:
            yield a.finding(
                TERRAIN_OFF,
                f"{quantity.height(heights_m[highest])} above terrain; the rangefinder it follows the ground "
                f"by reaches {quantity.height(reach_m)}: ArduPilot returns (terrain failsafe)",
                item=highest,
                fix="set WPNAV_RFND_USE to 0 to follow terrain data, or fly within the rangefinder's reach",
            )
        else:
            yield from _begun_out_of_reach(a, reach_m, over_terrain)
        return
    if parameters.terrain_enable:
        return
    if over_terrain:
        yield a.finding(
            TERRAIN_OFF,
            f"{quantity.count(len(over_terrain), 'item')} above terrain, TERRAIN_ENABLE is 0: ArduPilot "
            "has no terrain data",
            item=over_terrain[0],
        )


def _begun_out_of_reach(
    a: Assessment, reach_m: float, over_terrain: list[int]
) -> Iterator[Finding]:
    """Yield the first item above terrain that is flown to from above the reach of the rangefinder."""
    from planner.rules.terrain_following import ends_above_ground_m

    begins_m = ends_above_ground_m(a)
    for row, stage in enumerate(a.route.stages[1:], start=1):
        if stage.item in over_terrain and begins_m[row - 1] > reach_m + _ROUNDING_M:
            yield a.finding(
                TERRAIN_OFF,
                f"flown to from {quantity.height(float(begins_m[row - 1]))} above the ground; the "
                f"rangefinder it follows that by reaches {quantity.height(reach_m)}: ArduPilot ends the "
                "mission (terrain failsafe)",
                item=stage.item,
                fix="come down within its reach before, or set WPNAV_RFND_USE to 0 to follow terrain data",
            )
            return


LAND_START_WITHOUT_LANDING = Rule(
    "M106 land-start-without-land",
    Severity.WARNING,
    summary="No landing follows a DO_LAND_START.",
    why="A failsafe that jumps there finds no landing, and the vehicle flies on or hovers (ArduPilot "
    "#4701).",
    how="No NAV_LAND, RETURN_TO_LAUNCH or next DO_LAND_START follows it in the file.",
    fix="move the landing after it, or delete it",
)


@judges(LAND_START_WITHOUT_LANDING, needs=(ARDUPILOT_TARGET,))
def _land_start_without_landing(a: Assessment, _target: Target) -> Iterator[Finding]:
    items = a.mission.items
    remarks = Remarks()
    for number, item in a.mission.numbered(Command.DO_LAND_START):
        if not any(later.command in _LANDINGS for later in items[number:]):
            message = "DO_LAND_START: no landing follows"
            remarks.add(LAND_START_WITHOUT_LANDING, message, item=number, place=item.place)
    yield from remarks.findings()


TOO_MANY_JUMPS = Rule(
    "M125 too-many-jumps",
    Severity.WARNING,
    summary="The mission has more counted jumps than ArduPilot supports.",
    why="ArduPilot ignores the jumps beyond that number: the vehicle flies fewer rounds than planned, "
    "without a message.",
    how="Items DO_JUMP with a count that the flight passes, against "
    "AP_MISSION_MAX_NUM_DO_JUMP_COMMANDS: 15 on boards with less than 500 kB of memory, 100 on others; "
    "an error above 100.  Endless jumps are not counted.  All jumps are predicted as taken.",
    fix="write the rounds out, or nest fewer jumps",
)


@judges(TOO_MANY_JUMPS, needs=(ARDUPILOT_TARGET,))
def _too_many_jumps(a: Assessment, _target: Target) -> Iterator[Finding]:
    reached = set(a.route.reached)
    counted = [
        number
        for number, item in a.mission.numbered(*JUMPS)
        if number in reached and is_counted(item)
    ]
    if len(counted) <= _FEWEST_COUNTED:
        return
    too_many = len(counted) > _MOST_COUNTED
    most = f"{_MOST_COUNTED}" if too_many else f"{_FEWEST_COUNTED} on small boards"
    yield a.finding(
        TOO_MANY_JUMPS,
        f"{len(counted)} jumps with a count; ArduPilot takes at most {most}",
        item=counted[_FEWEST_COUNTED],
        severity=Severity.ERROR if too_many else None,
    )


RALLY_FAR = Rule(
    "M118 rally-far",
    Severity.WARNING,
    summary="A rally point is farther from the whole mission than ArduPilot looks.",
    why="ArduPilot returns home instead of to a rally point beyond RALLY_LIMIT_KM, 300 m on Copter: "
    "the point is never used (ArduPilot #4701, #30575).",
    how="Distance from each rally point to the path that is flown, circles and splines as they curve, above "
    "RALLY_LIMIT_KM where that is not 0 (AP_Rally::find_nearest_rally_point).",
    fix="move the rally point, or raise RALLY_LIMIT_KM",
)


@judges(RALLY_FAR, needs=(ARDUPILOT_TARGET,))
def _rally_far(a: Assessment, _target: Target) -> Iterator[Finding]:
    rally, limit_m = a.mission.rally, _rally_limit_m(a)
    if not rally or not a.route.stages:
        return
    path_m = np.column_stack((a.path.east_m, a.path.north_m))
    remarks = Remarks()
    for number, (point, point_m) in enumerate(zip(rally, _rally_m(a), strict=True), start=1):
        away_m = _distance_to_path_m(point_m, path_m)
        if away_m > limit_m:
            remarks.add(
                RALLY_FAR,
                f"rally point {number} is {quantity.beside(away_m, limit_m, quantity.distance)} from the "
                f"mission; RALLY_LIMIT_KM is {limit_m / 1000.0:g}: ArduPilot never uses it",
                place=point.place,
            )
    yield from remarks.findings()


def _rally_limit_m(a: Assessment) -> float:
    """Return how far ArduPilot looks for a rally point; infinite where it takes any. [m]"""
    parameters = ARDUPILOT.of(a)
    return _RALLY_LIMIT_M if parameters is None else parameters.rally_limit_m or math.inf


def _rally_m(a: Assessment) -> npt.NDArray[np.float64]:
    """Return the rally points, east and north of home. (n, 2) [m]"""
    rally = a.mission.rally
    return np.column_stack(
        a.route.frame.east_north_m(
            [point.latitude_deg for point in rally], [point.longitude_deg for point in rally]
        )
    )


def _distance_to_path_m(point_m: npt.NDArray[np.float64], path_m: npt.NDArray[np.float64]) -> float:
    """Return the distance of a point (2,) from straight pieces through points (n, 2). [m]"""
    start, way = path_m[:-1], np.diff(path_m, axis=0)
    length2 = (way**2).sum(axis=1)
    fraction = ((point_m - start) * way).sum(axis=1) / np.where(length2 > 0.0, length2, 1.0)
    nearest = start + np.clip(fraction, 0.0, 1.0)[:, None] * way
    return float(np.hypot(*(point_m - nearest).T).min())
