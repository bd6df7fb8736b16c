"""Rules on the structure of a mission: endless loops, unsupported items, home."""

from __future__ import annotations

from itertools import pairwise
from math import hypot, inf, pi
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Remarks, Rule, Severity
from planner.flight.fence_schedule import CEILING, FLOOR, fence_schedule
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import is_4_7
from planner.flight.returns.destination import HOME
from planner.mission.commands import (
    RELATIVE_FRAMES,
    ROIS_BY_MODE,
    Command,
    Support,
    command_name,
    frame_name,
    px4_takes_roi,
    support,
)
from planner.mission.items import MissionFormat
from planner.mission.route.circles import EDGE_NEAR_M
from planner.mission.route.order import JUMP_WITHOUT_FLIGHT
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.mission.route.walk import ENDLESS
from planner.mission.storage import stored_radius_m
from planner.mission.takers import BOTH, unset_value
from planner.rules.assessment import numbers
from planner.rules.declaration import (
    ARDUPILOT,
    ARDUPILOT_TARGET,
    FENCE,
    PROFILE,
    PX4,
    TARGET,
    judges,
)
from planner.rules.fence_settings import is_from_file
from planner.units import JOULES_PER_WATT_HOUR, wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.autopilot import Target
    from planner.findings import Finding
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters

_PX4_ITEMS, _PX4_SMALL_ITEMS = 2000, 500
"""Items that fit with an SD card, and without."""
_ARDUCOPTER_STORAGE_B = 16_384
"""Of most boards: what is judged by where the vehicle does not report it. [B]"""
_ARDUCOPTER_MISSION_B = {4_096: 2_422, 8_192: 4_554, 16_384: 9_758, 32_768: 19_600}
"""By storage, what of it holds the mission: the areas of copters in StorageManager.cpp. [B]"""
_STORED_HEAD_B, _STORED_ITEM_B = 4, 15
"""Of the mission there (AP_Mission.h): 650 items in 16 kB, as ArduCopter 4.7 holds. [B]"""

_FAR_M = 10_000.0
"""No multicopter begins its mission so far from home: PX4's MIS_DIST_1WP. [m]"""
_ELSEWHERE_M = 100_000.0
_PLACELESS = frozenset({StageKind.TAKEOFF, StageKind.RETURN, StageKind.DELAY})
"""Stages that lead to no place of the mission."""
_AVOIDS_FENCES = 3
"""Default of AVOID_ENABLE; bit 0: fences."""
_SAME_TIME_S = 0.5
_SAME_HEIGHT_M = 1.0
_ALTITUDE_REACHED_M = 0.05
"""``ModeAuto::loiter_to_alt_run``. [m]"""
_HELD_WITHIN_M = 0.3
"""So far off a vehicle may be that is level there: it has to climb or descend to be within the other. [m]"""
_AVOIDS_FLOOR = (4, 6)
"""The version from which no vehicle descends into the margin of FENCE_ALT_MIN, as far as is known."""
TAKES_ANY_HEADING = frozenset({StageKind.TAKEOFF, StageKind.LAND, StageKind.RETURN})


@judges(ENDLESS, JUMP_WITHOUT_FLIGHT)
def _endless(a: Assessment) -> Iterator[Finding]:
    lap, motion = a.route.lap, a.flight.motion
    if lap is None:
        return
    if lap.first_stage >= len(a.route.stages):
        yield a.finding(
            JUMP_WITHOUT_FLIGHT,
            "endless loop without flight: the mission never continues",
            item=lap.item,
        )
        return
    begin = int(motion.done_segment[lap.first_stage - 1]) + 1 if lap.first_stage else 0
    time_s = float(motion.segments.duration_s[begin:].sum())
    energy_wh = wh_from_j(float(a.flight.segment_energy_j[begin:].sum()))
    yield a.finding(
        ENDLESS,
        f"endless loop: one lap takes {quantity.duration(time_s)} and {quantity.energy(energy_wh)}; totals "
        "include one lap",
        item=lap.item,
    )


@judges(ENDLESS, needs=(ARDUPILOT,))
def _never_turns(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    if parameters.circle_rate_rad_s:
        return
    circles = [one.item for one in a.route.stages_of(StageKind.CIRCLE) if one.turns > 0.0]
    if circles:
        yield a.finding(
            ENDLESS,
            "CIRCLE_RATE is 0: ArduPilot does not turn, and waits here for turns that never end",
            item=circles[0],
            fix="set CIRCLE_RATE to the rate the circles are meant to be flown at",
        )


FIRST_ROW_LOST = Rule(
    "M129 first-row-lost",
    Severity.ERROR,
    summary="The first item of the text file is not flown: its place is that of home.",
    why="ArduPilot's item 0 is home whatever is sent for it, and QGroundControl takes the first row for "
    "home: of a mission whose take-off stands there the rest is left, and the vehicle does not start "
    "(ModeAuto::init: 'Missing Takeoff Cmd').",
    how="A WPL text for ArduPilot whose first row is no home (L152): what was predicted is not what the "
    "vehicle will hold.",
    fix="put a home row before it: sequence 0, frame 0, command 16, altitude AMSL",
    instead="a home row in the file",
)


@judges(FIRST_ROW_LOST, needs=(ARDUPILOT_TARGET,))
def _first_row_lost(a: Assessment, _target: Target) -> Iterator[Finding]:
    if a.mission.file_format is not MissionFormat.WPL:
        return
    from planner.mission.formats.wpl import TEXT_NO_HOME_ROW

    if any(one.code == TEXT_NO_HOME_ROW.code for one in a.mission.findings):
        yield a.finding(
            FIRST_ROW_LOST,
            f"{command_name(a.mission.items[0].command)} is in the place of home: ArduPilot does not fly it",
            item=1,
        )


@judges(ENDLESS, needs=(PX4,))
def _never_turned(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    if parameters.yaw_acceptance_rad > 0.0 or parameters.yaw_timeout_s > 0.0:
        return
    waits = [
        stage.item
        for stage in a.route.stages
        if stage.yaw_deg is not None and stage.kind not in TAKES_ANY_HEADING
    ]
    if waits:
        yield a.finding(
            ENDLESS,
            "MIS_YAW_ERR is 0 and MIS_YAW_TMT not above 0: PX4 waits here for a heading that is never exact",
            item=waits[0],
            fix="set MIS_YAW_ERR to some degrees, its default is 12",
        )


@judges(ENDLESS, needs=(ARDUPILOT,))
def _never_at_height(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield a LOITER_TO_ALT into the margin of the fence, where AC_Avoid lets no vehicle climb or descend.

    ``ModeAuto::loiter_to_alt_run`` takes its climb rate from ``AC_Avoid::adjust_velocity_z``, which asks what
    is enabled then, by the height above the home that counts; the floor from 4.6 on.
    """
    avoids = int(numbers(a).get("AVOID_ENABLE", _AVOIDS_FENCES)) & 1
    if not (avoids and is_from_file(parameters)):
        return
    schedule = fence_schedule(a.route, parameters, acts=True)
    homes = a.returns.destinations
    version = None if a.target is None else a.target.version
    margin_m, kind = parameters.fence_margin_m, parameters.fence_type
    highest_m = parameters.fence_height_max_m - margin_m if kind & CEILING else inf
    lowest_m = parameters.fence_height_min_m + margin_m if kind & FLOOR else -inf
    if version is not None and version < _AVOIDS_FLOOR:
        lowest_m = -inf
    before_m, changing = 0.0, dict(a.mission.numbered(Command.NAV_LOITER_TO_ALT))
    for number, stage in enumerate(a.route.stages if changing else ()):
        begun_m, before_m = before_m, stage.height_m
        if stage.item not in changing:
            continue
        datum_m = float(homes.home_datum_m[homes.home_of(np.array([number]))][0])
        height_m, up_m = stage.height_m - datum_m, stage.height_m - begun_m
        if (
            up_m > -_HELD_WITHIN_M
            and schedule.limits[number]
            and height_m > highest_m + _ALTITUDE_REACHED_M
        ):
            does, limit_m, name = "climbs no higher", highest_m, "FENCE_ALT_MAX less"
            fix = "loiter lower, or raise FENCE_ALT_MAX"
        elif (
            up_m < _HELD_WITHIN_M
            and schedule.floor[number]
            and height_m < lowest_m - _ALTITUDE_REACHED_M
        ):
            does, limit_m, name = "descends no lower", lowest_m, "FENCE_ALT_MIN and"
            fix = "loiter higher, or lower FENCE_ALT_MIN"
        else:
            continue
        yield a.finding(
            ENDLESS,
            f"waits for {quantity.height(height_m)}: ArduPilot {does} than {quantity.height(limit_m)}, "
            f"{name} FENCE_MARGIN, and never goes on",
            item=stage.item,
            fix=fix,
        )
        return


LANDING_MISSING = Rule(
    "M102 land-missing",
    Severity.ERROR,
    summary="The mission, or a return of the vehicle, does not end on the ground.",
    why="The vehicle hovers at the last item, or over home, until its battery failsafe ends the flight, "
    "or the empty battery does.",
    how="No LAND or RETURN_TO_LAUNCH is reached; or ArduPilot's RTL_ALT_FINAL is above 0, or PX4's "
    "RTL_LAND_DELAY negative, so that the return stays in the air.  The energy left at the end, down "
    "to the charge at which a failsafe that returns or lands acts (BATT_LOW_MAH, BATT_CRT_MAH; "
    "BAT_CRIT_THR with COM_LOW_BAT_ACT 1 to 3), over the power of a hover there.  Of a mission that "
    "lands itself a return that stays in the air is a warning where such a failsafe lands it, else an "
    "error: what calls for a return, such as a lost link, leaves nobody to land it.",
    fix="end the mission with a return or a landing",
    instead="a landing or a return at the end",
)


@judges(LANDING_MISSING)
def _ends_in_the_air(a: Assessment) -> Iterator[Finding]:
    last, over_home = a.route.stages[-1], _where_returns_hover(a)
    if last.kind is StageKind.RETURN and over_home is not None:
        place = over_home
    elif a.route.ends_in_air and all(one.code != ENDLESS.code for one in a.route.findings):
        place = "at the last item"
    elif over_home is not None:
        from planner.flight.failsafe import own_landing

        name, _ = own_landing(a.own_parameters)
        yield a.finding(
            LANDING_MISSING,
            f"a return of the vehicle ends in the air: it hovers {over_home} {_until(name)}",
            severity=Severity.WARNING if name else None,
            fix="let returns land: RTL_ALT_FINAL 0 (ArduPilot), RTL_LAND_DELAY 0 or more (PX4)",
        )
        return
    else:
        return
    yield a.finding(
        LANDING_MISSING,
        f"the flight ends in the air: it hovers {place} {_until_what(a)}",
        item=last.item,
    )


def _where_returns_hover(a: Assessment) -> str | None:
    """Return where returns of the vehicle stay in the air; ``None``: they land."""
    ardupilot, px4, sample = ARDUPILOT.of(a), PX4.of(a), a.returns.sample
    if ardupilot and ardupilot.return_final_altitude_m > 0.0:
        return f"{quantity.height(ardupilot.return_final_altitude_m)} above home (RTL_ALT_FINAL)"
    leads_home = sample is None or bool((sample.destination >= HOME).any())
    if px4 and px4.return_land_delay_s < 0.0 and leads_home:
        return f"over home (RTL_LAND_DELAY {px4.return_land_delay_s:g} s)"
    return None


def _until(name: str) -> str:
    return f"until {name} acts" if name else "until the battery is empty, as no failsafe lands it"


def _until_what(a: Assessment) -> str:
    """Return what ends a hover at the end of the flight, and the time and energy until then."""
    from planner.flight.failsafe import own_landing

    name, left_fraction = own_landing(a.own_parameters)
    until = _until(name)
    if a.battery is None or left_fraction is None:
        return until
    hover_w = a.flight.hover_near_home_w
    hover_wh = a.battery.usable_wh - a.totals.energy_wh - left_fraction * a.battery.capacity_wh
    if hover_wh <= 0.0 or not hover_w > 0.0:
        return until
    time = quantity.duration(hover_wh * JOULES_PER_WATT_HOUR / hover_w)
    return f"{until}: {time} later, with {quantity.energy(hover_wh)} more"


HOME_FAR = Rule(
    "M124 home-far",
    Severity.WARNING,
    summary="Home is nowhere near the mission.",
    why="The planned home was left from another site, and the flight from there is included without a "
    "word: surveys of hundreds of kilometres result (MissionPlanner #1947).",
    how="Distance from home to the nearest place of the mission, take-off and return not counted: 10 "
    "km or more, an error from 100 km on.  On PX4, M104 reports less.",
    fix="set the planned home to the place of take-off",
)


@judges(HOME_FAR)
def _home_far(a: Assessment) -> Iterator[Finding]:
    if a.mission.home is None:
        return
    stages, placeless = a.route.stages, {*a.route.rows_of(*_PLACELESS)}
    places = [
        (hypot(stage.east_m, stage.north_m), stage.item)
        for row, stage in enumerate(stages)
        if row not in placeless
    ]
    if not places:
        return
    away_m, item = min(places)
    is_px4 = a.target is not None and a.target.autopilot is Autopilot.PX4
    if away_m >= (_ELSEWHERE_M if is_px4 else _FAR_M):
        yield a.finding(
            HOME_FAR,
            f"home is {quantity.distance(away_m)} from the nearest place of the mission; the flight there "
            "is included",
            severity=Severity.ERROR if away_m >= _ELSEWHERE_M else None,
            item=item,
        )


LANDING_ALTITUDE = Rule(
    "M120 landing-altitude",
    Severity.WARNING,
    summary="A landing has an altitude other than home's.",
    why="PX4's multicopters and ArduCopter before 4.7 land on the ground and ignore it; from 4.7 on "
    "ArduCopter takes it for the height of the ground and is slow from 10 m above it, or too fast (T120).  "
    "ArduPilot's users ask for this check and for a way to turn it off (#4701).",
    how="NAV_LAND in a frame above home with an altitude that is not 0.",
    fix="write 0, where the ground is level with home",
    is_default=False,
)


@judges(LANDING_ALTITUDE)
def _landing_altitude(a: Assessment) -> Iterator[Finding]:
    remarks = Remarks()
    for number, item in a.mission.numbered(Command.NAV_LAND):
        if item.altitude_m and item.frame in RELATIVE_FRAMES:
            message = f"landing altitude {quantity.height(item.altitude_m)} above home"
            remarks.add(LANDING_ALTITUDE, message, item=number, place=item.place)
    yield from remarks.findings()


COMMAND_UNSUPPORTED = Rule(
    "M105 unsupported-command",
    Severity.ERROR,
    summary="The autopilot refuses or skips an item.",
    why="PX4 refuses the whole mission for one item it does not support; ArduPilot skips such items "
    "in flight.  Upload tools report success all the same (MAVSDK #2103).",
    how="The command, and for PX4 its frame (0, 3, 5 and 6 for places, 2 for others) and of a region of "
    "interest its MAV_ROI, against what the autopilot's source accepts, in the version of --target.  Where "
    "nothing names the autopilot: an error where neither takes the upload, or where one that does would not "
    "fly it; any error of either is.",
    fix="use commands the autopilot flies",
    instead="commands the autopilot flies, or --target",
)


@judges(COMMAND_UNSUPPORTED, needs=(TARGET,))
def _command_unsupported(a: Assessment, target: Target) -> Iterator[Finding]:
    autopilot, version = target.autopilot, target.version
    by_command: dict[tuple[int, int], Remarks] = {}
    answers = {
        (command, frame): support(command, autopilot, frame=frame, version=version)
        for command, frame in {(item.command, item.frame) for item in a.mission.items}
    }
    wanting = {
        asked: taken
        for asked, taken in answers.items()
        if taken not in {Support.ACCEPTED, Support.UNKNOWN}
    }
    for number, item in enumerate(a.mission.items if wanting else (), start=1):
        taken = wanting.get((item.command, item.frame))
        if taken is None:
            continue
        name = command_name(item.command)
        refusal = f"{autopilot.label} refuses {name}"
        severity = Severity.ERROR
        if taken is Support.SKIPPED:
            message, severity = f"{autopilot.label} skips {name} in flight", Severity.WARNING
        elif taken is Support.BLOCKS_ARMING:
            message = f"{autopilot.label} does not arm with {name}"
        elif support(item.command, autopilot, version=version) is Support.ACCEPTED:
            frame = f"frame {item.frame} ({frame_name(item.frame)})"
            message = f"{refusal} in {frame}, and the whole mission with it"
        else:
            message = f"{refusal} at upload, and the whole mission with it"
        by_command.setdefault((item.command, item.frame), Remarks()).add(
            COMMAND_UNSUPPORTED, message, item=number, place=item.place, severity=severity
        )
    for remarks in by_command.values():
        yield from remarks.findings()


@judges(COMMAND_UNSUPPORTED, needs=(TARGET,))
def _roi_refused(a: Assessment, target: Target) -> Iterator[Finding]:
    if target.autopilot is not Autopilot.PX4:
        return
    remarks = Remarks()
    for number, item in a.mission.numbered(*ROIS_BY_MODE):
        taken = support(item.command, Autopilot.PX4, frame=item.frame) is not Support.REFUSED
        if taken and not px4_takes_roi(item.param1, item.frame):
            message = (
                f"PX4 refuses {command_name(item.command)} with {item.param1:g} for parameter 1 in frame "
                f"{item.frame} ({frame_name(item.frame)}), and the whole mission with it"
            )
            remarks.add(COMMAND_UNSUPPORTED, message, item=number, place=item.place)
    yield from remarks.findings()


VALUE_NOT_SET = Rule(
    "M112 value-not-set",
    Severity.ERROR,
    summary="ArduPilot refuses an item with a parameter that is not a number.",
    why="QGroundControl sends null as NaN.  PX4 reads it as 'not specified', ArduPilot refuses the "
    "item and with it the upload.",
    how="Parameters 1 to 4 of every item, and the altitude of those that ArduPilot keeps as a place "
    "(AP_Mission::stored_in_location); only a heading may be unset, in NAV_WAYPOINT, LOITER_UNLIM, LAND, "
    "TAKEOFF, ARC_WAYPOINT, VTOL_TAKEOFF and VTOL_LAND.",
    fix="write 0 for it",
    instead="a mission with its values, or --target",
)


@judges(VALUE_NOT_SET, needs=(ARDUPILOT_TARGET,))
def _value_not_set(a: Assessment, _target: Target) -> Iterator[Finding]:
    remarks = Remarks()
    for number, item in enumerate(a.mission.items, start=1):
        if (unset := unset_value(item)) is not None:
            message = f"ArduPilot refuses {command_name(item.command)} with {unset} not set"
            remarks.add(VALUE_NOT_SET, message, item=number, place=item.place)
    yield from remarks.findings()


@judges(ITEM_NOT_MODELLED, needs=(ARDUPILOT_TARGET,))
def _turns_on_the_way(a: Assessment, target: Target) -> Iterator[Finding]:
    """Yield turns without a radius that ArduCopter 4.7 begins before it is where they are predicted.

    Notes
    -----
    ``AC_Circle::get_closest_point_on_circle_NED_m`` returns 0 m to an edge without a radius, so
    ``ModeAuto::circle_movetoedge_start`` begins to turn at once, ``AC_Circle::update_ms`` keeps the height.
    Flown with 4.7.0-dev: from 4 m away on the turn lasts as long as without a way there, and where that is
    long enough it ends at the place, at the height before, 1 m off as well as 45 m.
    """
    if not is_4_7(target):
        return
    motion, remarks = a.flight.motion, Remarks()
    segments, done = motion.segments, np.maximum.accumulate(motion.done_segment)
    ends_s = np.append(segments.end_s, 0.0)[done]  # -1: nothing yet
    parameters = _flown_by(a)
    for row, stage in enumerate(a.route.stages[1:], start=1):
        if stage.kind is not StageKind.CIRCLE or stage.radius_m:
            continue
        turns_last = segments.state[done[row]] == STATE_INDEX[FlightState.HOVER]
        way_s = float(np.diff(ends_s)[row - 1] - turns_last * segments.duration_s[done[row]])
        if way_s <= _SAME_TIME_S:
            continue
        height_m = float(motion.state_at_time(ends_s[row - 1 : row]).height_m[0])
        turn_s = _turning_s(stage, parameters)
        severity = Severity.ERROR
        if abs(stage.height_m - height_m) > _SAME_HEIGHT_M and not stage.follows_ground:
            does = f"stays {quantity.height(height_m)} above home, not {quantity.height(stage.height_m)}"
        elif way_s > turn_s:
            does = "flies on before it is there"
        else:
            severity, does = (
                Severity.WARNING,
                f"takes {quantity.duration(way_s)} less than predicted",
            )
        remarks.add(
            ITEM_NOT_MODELLED,
            f"NAV_LOITER_TURNS without a radius: ArduCopter 4.7 turns at once, on the way to its place, and "
            f"{does}; put a waypoint there before it, or give it a radius",
            severity=severity,
            item=stage.item,
        )
    yield from remarks.findings()


def _flown_by(a: Assessment) -> ArduPilotParameters:
    """Return ArduPilot's parameters of the vehicle, as delivered where they are not known."""
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

    return ARDUPILOT.of(a) or ArduPilotParameters()


def _turning_s(stage: Stage, parameters: ArduPilotParameters) -> float:
    """Return how long the turns of a circle on the spot take; infinite where CIRCLE_RATE is 0. [s]"""
    rate_rad_s = abs(parameters.circle_rate_rad_s)
    return 2.0 * pi * stage.turns / rate_rad_s if rate_rad_s else inf


@judges(ITEM_NOT_MODELLED, needs=(ARDUPILOT_TARGET,))
def _turns_perhaps_on_the_way(a: Assessment, target: Target) -> Iterator[Finding]:
    """Yield turns without a radius that 4.7 would not fly at their place, where the version is not known."""
    if is_4_7(target) is not None:
        return
    parameters, remarks = _flown_by(a), Remarks()
    for before, stage in pairwise(a.route.stages):
        if stage.kind is not StageKind.CIRCLE or stored_radius_m(
            a.mission.items[stage.item - 1].param3 or 0.0
        ):
            continue
        way_m = hypot(stage.east_m - before.east_m, stage.north_m - before.north_m)
        speed_m_s = stage.speed_m_s or parameters.cruise_speed_m_s
        # Speeding up and slowing down take as long again as the speed divided by the acceleration.
        way_s = way_m / speed_m_s + 2.0 * speed_m_s / parameters.acceleration_m_s2
        rise_m = stage.height_m - before.height_m
        rises = abs(rise_m) > _SAME_HEIGHT_M and not stage.follows_ground
        if hypot(way_m, rise_m) > EDGE_NEAR_M and (rises or way_s > _turning_s(stage, parameters)):
            does = "stays at the height before" if rises else "flies on before it is there"
            remarks.add(
                ITEM_NOT_MODELLED,
                f"NAV_LOITER_TURNS without a radius: ArduCopter 4.7 {does}; put a waypoint there before it, "
                "give it a radius, or an older version with --target",
                severity=Severity.ERROR,
                item=stage.item,
            )
    yield from remarks.findings()


def _unjudged(a: Assessment, where: str) -> str:
    """Return what cannot be checked where a vehicle may fly instead; empty where nothing is asked."""
    profile = PROFILE.of(a)
    limits = () if profile is None else (profile.max_distance_m, profile.max_height_above_home_m)
    unjudged = [
        name
        for name, given in (
            ("the fence", FENCE.of(a) is not None),
            ("the ground", a.setup.terrain is not None),
            ("the limits of the site", any(one is not None for one in limits)),
        )
        if given
    ]
    return f"; {' and '.join(unjudged)} cannot be checked {where}" if unjudged else ""


_LOITER_RADIUS_M = 80.0
"""Of a LOITER_TO_ALT without one: NAV_LOITER_RAD as PX4 is delivered. [m]"""


@judges(ITEM_NOT_MODELLED)
def _splines(a: Assessment) -> Iterator[Finding]:
    if a.autopilot is not Autopilot.STEP:
        return
    curves = a.route.stages_of(StageKind.SPLINE)
    if curves:
        unjudged = _unjudged(a, "on the curve")
        yield a.finding(
            ITEM_NOT_MODELLED,
            f"{quantity.count(len(curves), 'spline')} predicted as straight legs with a stop at each "
            f"(step-response model){unjudged}",
            severity=Severity.ERROR if unjudged else None,
            item=curves[0].item,
        )


@judges(ITEM_NOT_MODELLED)
def _tangents(a: Assessment) -> Iterator[Finding]:
    """Yield what step-response models fly from place to place where PX4 leaves a circle by its tangent."""
    if a.autopilot is not Autopilot.STEP or Autopilot.PX4 not in a.may_fly:
        return
    for before, stage in pairwise(a.route.stages):
        if not before.leaves_on_tangent or stage.kind in RETURN_STAGES:
            continue
        radius_m = abs(before.radius_m) or _LOITER_RADIUS_M
        way_m = hypot(stage.east_m - before.east_m, stage.north_m - before.north_m)
        unjudged = _unjudged(a, "there")
        message = (
            "NAV_LOITER_TO_ALT with parameter 4 above 0 right before: PX4 flies here from that circle, by "
            f"its tangent, predicted from its centre (step-response model){unjudged}; write 0 there"
        )
        is_within = way_m <= radius_m
        if is_within:
            message = (
                "in the circle of the NAV_LOITER_TO_ALT right before, with parameter 4 above 0: PX4 may fly "
                "past this place and on for ever; write 0 there"
            )
        severity = Severity.ERROR if is_within or unjudged else None
        yield a.finding(ITEM_NOT_MODELLED, message, item=stage.item, severity=severity)


TOO_MANY_ITEMS = Rule(
    "M126 too-many-items",
    Severity.ERROR,
    summary="The mission has more items than the vehicle holds.",
    why="The vehicle refuses the upload, and keeps the mission it had.",
    how="Items, and on ArduPilot the home it stores before them, against 650 on ArduCopter "
    "(StorageManager.cpp, 16 kB of storage; that of a vehicle on the line is read from it, 1306 in 32 kB; "
    "not with BRD_SD_MISSION above 0, which stores more on the card) and 2000 on PX4 "
    "(NUM_MISSIONS_SUPPORTED with an SD card; a warning above 500, what boards without one hold); where no "
    "autopilot is known, against what those that take the upload hold: an error where neither holds them, a "
    "warning where neither is sure to.",
    fix="split the mission (mavjoule split)",
    instead="a mission with fewer items",
)


def ardupilot_items(storage_b: int | None) -> int:
    """Return how many items ArduCopter holds, with home, in a storage of a size; unknown: as most boards.

    Parameters
    ----------
    storage_b : int or None
        Storage for parameters and lists. [B]
    """
    storage_b = storage_b or _ARDUCOPTER_STORAGE_B
    fitting = [mission for size, mission in _ARDUCOPTER_MISSION_B.items() if size <= storage_b]
    return (max(fitting, default=0) - _STORED_HEAD_B) // _STORED_ITEM_B


@judges(TOO_MANY_ITEMS)
def _too_many_items(a: Assessment) -> Iterator[Finding]:
    by = (a.may_fly or BOTH) if a.target is None else {a.target.autopilot}
    held = [_held_too_few(a, one) for one in BOTH if one in by]
    least = min((severity for severity, _ in held), default=Severity.INFO)
    if least > Severity.INFO:  # else one holds them
        holds = ", ".join(most for _, most in held)
        yield a.finding(TOO_MANY_ITEMS, f"{len(a.mission.items)} items; {holds}", severity=least)


def _held_too_few(a: Assessment, by: Autopilot) -> tuple[Severity, str]:
    """Return how severe it is that an autopilot may not hold the items, and how many it holds."""
    count = len(a.mission.items)
    if by is Autopilot.PX4:
        if count > _PX4_ITEMS:
            return Severity.ERROR, f"PX4 holds {_PX4_ITEMS}"
        severity = Severity.WARNING if count > _PX4_SMALL_ITEMS else Severity.INFO
        return severity, f"PX4 holds {_PX4_SMALL_ITEMS} without an SD card"
    ardupilot = ARDUPILOT.of(a)
    most = ardupilot_items(None if a.setup.parameters is None else a.setup.parameters.storage_b)
    is_held = count + 1 <= most or (ardupilot is not None and ardupilot.mission_card_kb > 0)
    severity = Severity.INFO if is_held else Severity.ERROR
    return severity, f"ArduPilot holds {most - 1} beside home"
