"""What each command makes of the flight."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import (
    LANDINGS,
    ROIS_BY_MODE,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    command_name,
    is_destination,
    is_navigation,
)
from planner.mission.route import circles, commanded, landings
from planner.mission.route.stage import StageKind
from planner.mission.route.state import (
    ITEM_NOT_MODELLED,
    LARGEST_RADIUS_M,
    LONGEST_HOLD_S,
    WAITS_FOR_EVER,
)
from planner.mission.storage import reads_as_place, stored_hold_s
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.mission.items import MissionItem
    from planner.mission.route.state import MissionState

LIFTS_OFF = TAKEOFFS | {Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME}
"""What PX4 takes off to after a landing."""
_AT_REST_S = 4.0
"""After so long in a place PX4 rests there: it enters it at 1.2 m/s, and loses that within 1.5 s times the
logarithm (MPC_ACC_HOR 3, MPC_JERK_AUTO 4), down to 0.2 m/s, below which it turns nowhere. [s]"""
_LEVEL_PLACES = LANDINGS | {Command.NAV_PAYLOAD_PLACE}
_LED_TO = (
    _LEVEL_PLACES | TAKEOFFS | {Command.NAV_GUIDED_ENABLE, Command.NAV_CONTINUE_AND_CHANGE_ALT}
)
"""Towards whose place and altitude ArduPilot ends a spline; predicted is that it ends level, and towards the
places of the first alone."""
_UP_OR_DOWN = TAKEOFFS | LANDINGS
_LONGEST_TANGENTS = 4.0
"""``SplineCurve`` keeps the tangents at both ends of a spline together within so many times its length."""
_SWINGS = 4.0 / 27.0
"""How far a cubic that begins at rest leaves the line between its ends, of the tangent at its end. [-]"""
_LITTLE_SWING_M, _GREAT_SWING_M = 0.5, 5.0
"""Flown, 2 m do nothing; 5 m may be beyond a fence that the level flight is well inside of. [m]"""
_LOW_M = 10.0
"""Nearer to the ground a swing counts, whatever it is. [m]"""

ENDLESS = Rule(
    "T101 endless-jump",
    Severity.ERROR,
    summary="The mission never ends: an endless jump, an unlimited loiter, a wait for what never comes.",
    why="Time and energy of an endless mission are infinite; only those of one lap are finite.",
    how="A DO_JUMP with an endless count, LOITER_UNLIM, or LOITER_TURNS on ArduPilot with CIRCLE_RATE 0 "
    "(ModeAuto::verify_circle waits for turns that are never flown), or a heading on PX4 with MIS_YAW_ERR 0 "
    "and MIS_YAW_TMT not above 0 (MissionBlock::is_mission_item_reached), or LOITER_TO_ALT on ArduPilot "
    "that climbs above FENCE_ALT_MAX less FENCE_MARGIN, or from 4.6 on descends below FENCE_ALT_MIN and "
    "FENCE_MARGIN, while that limit is on, with AVOID_ENABLE bit 0 (AC_Avoid::adjust_velocity_z), is reached "
    "in flown order; or ArduPilot's return where a DO_SET_HOME that is not the first DO_ item before it "
    "moves home up or down by more than 1 m as it begins (flown).",
    fix="give the jump a count, or end the mission with a return or a landing",
    instead="a count for the jump, turns that end, a return or a landing",
)

WAIT_NOT_COUNTED = Rule(
    "T107 wait-not-counted",
    Severity.WARNING,
    summary="A wait of unknown length is not counted.",
    why="A wait until a time of day lasts as long as the clock demands (QGroundControl counts -1 s "
    "for it), in the air or with motors that idle.",
    how="NAV_DELAY with a time of day (an error, but on PX4, which has none), or in seconds before the "
    "take-off: an error where idling motors, 0.12 of the hover power where the model has none, take more "
    "than the flight and its returns leave above the reserve, or than 5 % of the battery, by which its "
    "voltage and its failsafes would be wrong; ArduPilot's "
    "return where RTL_LOIT_TIME is shorter than half a turn at ATC_RATE_WPY_MAX (ModeRTL, which waits "
    "for the heading it was armed with).",
    fix="use a delay in seconds, or allow for the wait yourself",
    instead="a delay in seconds",
)

ZERO_TAKEOFF = Rule(
    "A106 zero-takeoff",
    Severity.ERROR,
    summary="The take-off altitude is not above home.",
    why="A take-off to zero is refused, or flown to a height that is in no file (ArduPilot #33792).",
    how="The take-off item's altitude, resolved to a height above home, is 0 m or less.  PX4 refuses "
    "it, ArduPilot does not arm with it from 4.8 on.",
    fix="give the take-off item an altitude above home",
    instead="a take-off above home",
)

HEADING_NORTH = Rule(
    "M114 heading-north",
    Severity.INFO,
    summary="Waypoints ask PX4 for a heading of exactly 0°.",
    why="PX4 takes 0 in the fourth parameter for north, turns there and waits until it has; 'free' is "
    "null.  Text files and scripts write 0 and mean nothing by it.",
    how="NAV_WAYPOINT with a fourth parameter of exactly 0, flown as PX4 would.",
    fix="write null (nan in text) where the heading does not matter",
)


def go(state: MissionState, item: MissionItem) -> None:
    """Fly to a place in the manner of the command, and hold there."""
    if (
        item.param4 == 0.0
        and state.dialect is Autopilot.PX4
        and item.command == Command.NAV_WAYPOINT
    ):
        message = "NAV_WAYPOINT asks for heading 0°: PX4 turns north before it continues"
        state.remark(HEADING_NORTH, message)
    kind = StageKind.TAKEOFF if state.has_landed else _KINDS[item.command]
    hold_s = state.hold_s(item)
    begun = (state.latitude_deg, state.longitude_deg), state.height_m
    state.go_to(kind, item, hold_s=hold_s)
    if (
        kind is StageKind.SPLINE
        and not stored_hold_s(hold_s)
        and state.dialect is not Autopilot.PX4
    ):
        (from_deg, from_m), here_deg = begun, (state.latitude_deg, state.longitude_deg)
        level_m = float(distance_m(*from_deg, *here_deg))
        length_m = math.hypot(level_m, state.height_m - from_m)
        state.spline = length_m, item.frame in TERRAIN_FRAMES
    is_short = kind is StageKind.LOITER and hold_s < _AT_REST_S
    if state.dialect is Autopilot.PX4 and is_short and (item.param4 or 0.0) > 0.0:
        state.is_left_on_tangent = True


def loiter_for_ever(state: MissionState, item: MissionItem) -> None:
    """Fly to a place and stay: the prediction ends."""
    state.go_to(StageKind.LOITER, item)
    state.remark(ENDLESS, "unlimited loiter: the vehicle stays here")
    state.is_over = True


def change_height(state: MissionState, item: MissionItem) -> None:
    """Fly to a place, then change height there."""
    state.go_to(StageKind.CHANGE_HEIGHT, item)
    radius_m = item.param2 or 0.0
    state.stages[-1] = replace(
        state.stages[-1],
        radius_m=max(min(radius_m, LARGEST_RADIUS_M), -LARGEST_RADIUS_M),
        leaves_on_tangent=(item.param4 or 0.0) > 0.0,
    )


def take_off(state: MissionState, item: MissionItem) -> None:
    """Leave the ground."""
    if state.dialect is not Autopilot.ARDUPILOT:  # ArduPilot takes off where it is
        state.move_to(item)
    state.height_m = state.height_to_m(item)
    is_first = not any(d.kind is not StageKind.DELAY for d in state.stages)
    state.add(state.stage(StageKind.TAKEOFF, yaw_deg=item.param4))
    if is_first and state.height_m <= 0.0:
        height = quantity.height(state.height_m)
        state.remark(ZERO_TAKEOFF, f"take-off altitude {height} above home")


def delay(state: MissionState, item: MissionItem) -> None:
    """Wait for a time, or until a time of day."""
    seconds = item.param1 or 0.0
    if seconds > LONGEST_HOLD_S:
        state.refuse(item, f"a delay of {seconds:g} s is longer than any flight")
    in_air = state.in_air
    if seconds <= 0.0:
        _end_at_rest(state)
        clock = [item.param2, item.param3, item.param4]
        if any(part is not None and part >= 0.0 for part in clock):
            until = ":".join("--" if p is None or p < 0.0 else f"{p:02.0f}" for p in clock)
            where = "in the air" if in_air else "on the ground"
            message = f"waits {where} until {until} UTC: not counted"
            severity: Severity | None = Severity.ERROR  # a hover, or idling, of any length
            if state.dialect is Autopilot.PX4:
                message = f"PX4 has no time of day: it does not wait until {until} UTC"
                severity = None
            state.remark(WAIT_NOT_COUNTED, message, severity=severity)
    elif state.has_landed:
        landing = state.stages[-1]
        state.stages[-1] = replace(landing, hold_s=landing.hold_s + seconds)
    elif not in_air:
        wait = quantity.duration(seconds)
        message = f"waits {wait} on the ground before the take-off: not counted"
        state.remark(WAIT_NOT_COUNTED, message, fix="wait less, or allow for the wait yourself")
    elif circles.circles_on(state):
        circles.circle_on(state, item, seconds)
    else:
        state.add(state.stage(StageKind.DELAY, hold_s=seconds))


def arc(state: MissionState, item: MissionItem) -> None:
    """Fly straight to a place; the arc is only reported."""
    state.go_to(StageKind.GO, item)
    half_rad = 0.5 * math.radians(min(abs(item.param1 or 0.0), 359.0))
    longer = ""
    if half_rad > 0.0:  # arc over chord
        longer = f", {quantity.decimals(half_rad / math.sin(half_rad), 2)} times as long"
    state.remark(
        ITEM_NOT_MODELLED,
        "NAV_ARC_WAYPOINT is not modelled: a straight flight to its place is assumed, not the "
        f"arc of {abs(item.param1 or 0.0):g}°{longer}",
        severity=Severity.ERROR if longer else None,
    )


def gate(state: MissionState, item: MissionItem) -> None:
    """Leave out a gate, which no vehicle flies to.

    ``Mission::setActiveMissionItems`` of PX4 sets course for the next item with a place; what stands in
    between is carried out where the way there passes the gate.
    """
    if state.dialect is Autopilot.ARDUPILOT:
        commanded.pass_by(state, item)
        return
    state.is_behind_gate = True
    state.remark(
        ITEM_NOT_MODELLED,
        "CONDITION_GATE is not modelled: a straight flight past it to the next place is assumed, as PX4 "
        "flies",
    )


def guided(state: MissionState, item: MissionItem) -> None:
    """Hand over to a companion computer, which decides when the mission continues."""
    if state.dialect is not Autopilot.ARDUPILOT:
        commanded.pass_by(state, item)
        return
    _end_at_rest(state)
    if stored_hold_s(item.param1 or 0.0):  # below 0 it is on or off by its board
        state.remark(
            WAITS_FOR_EVER,
            "NAV_GUIDED_ENABLE: ArduPilot waits for a companion computer until it or "
            "DO_GUIDED_LIMITS ends it; predicted without the wait",
            fix="remove NAV_GUIDED_ENABLE, unless a companion computer will end it",
        )


def remark_tangent(state: MissionState, item: MissionItem) -> None:
    """Tell of a leg that PX4 begins far beside it, and how slowly.

    Notes
    -----
    ``MissionBlock::is_mission_item_reached_or_completed``: ``loiter_exit_xtrack`` moves the place of a
    LOITER_TIME, too, to where the tangent leads to the next one.  Flown: 0 s and 40 m, from 2 m before
    the place 39 m across it to that tangent, at the 1.3 m/s it had by then, 30 s; at rest it turns
    nowhere.  That of a LOITER_TO_ALT is predicted.
    """
    if not state.is_left_on_tangent or not is_destination(item.command):
        return
    state.is_left_on_tangent = False
    state.remark(
        ITEM_NOT_MODELLED,
        "NAV_LOITER_TIME, so short and with parameter 4 above 0, right before: PX4 takes that for leaving by "
        "the tangent of its radius, slowly, which is not predicted; write 0 there",
        severity=Severity.ERROR,
    )


def stop_before(state: MissionState, item: MissionItem) -> None:
    """Let ArduPilot stop at the place before one whose altitude counts from elsewhere.

    ``AC_WPNav::set_wp_destination_next`` plans no next leg where only one of the two is above terrain,
    ``set_spline_destination`` no tangent.  Flown: five legs of 60 m in 159 s, in one frame 132 s.
    """
    if not is_destination(item.command):
        return
    before, state.is_above_terrain = state.is_above_terrain, item.frame in TERRAIN_FRAMES
    if before != state.is_above_terrain and state.dialect is not Autopilot.PX4:
        _end_at_rest(state)


def _end_at_rest(state: MissionState) -> None:
    """Let ArduPilot stop at the place before: ``ModeAuto::set_next_wp`` plans no next one.

    Nor where what comes is over at once.  Flown, 60 m and 60 m on: 105.1 s with a NAV_DELAY of 0 s between,
    103.5 s with NAV_GUIDED_ENABLE of 0, 99 s without.
    """
    if state.stages:
        state.stages[-1] = replace(state.stages[-1], is_next_unseen=True)


def remark_swing(state: MissionState, item: MissionItem) -> None:
    """Tell of a spline that ArduPilot ends towards a place which is none, or is predicted without.

    Notes
    -----
    ``ModeAuto::get_spline_from_cmd`` asks the next item for its place, whatever that is;
    ``AC_WPNav::set_spline_destination`` leaves it out where only one of both is above terrain.  Flown:
    60 m, 25 m up, before a NAV_DELAY with -1 as hour, minute and second: into the ground; before a
    landing with altitude 100 m, 11 m down; before LOITER, take-off, circle 35 m higher, 5.2 m down.
    """
    if state.spline is None or not is_navigation(item.command):
        return
    (length_m, is_above_terrain), state.spline = state.spline, None
    way_m = 0.0
    if reads_as_place(item, above_terrain=is_above_terrain):
        way_m = math.inf
    elif item.command in _LED_TO and (item.frame in TERRAIN_FRAMES) == is_above_terrain:
        way_m = _way_beyond_m(state, item)
    swing_m = _SWINGS * min(way_m, _LONGEST_TANGENTS * length_m)
    if swing_m <= _LITTLE_SWING_M:
        return
    takes = "reads its numbers as a place" if math.isinf(way_m) else "takes its altitude"
    is_delay = item.command == Command.NAV_DELAY
    write = "whole seconds, and 0 in parameters 2 to 4" if is_delay else "0 there"
    left_m = state.height_m - state.ground_m() - swing_m
    is_grave = swing_m >= _GREAT_SWING_M or left_m < _LOW_M or state.terrain is not None
    state.remark(
        ITEM_NOT_MODELLED,
        f"{command_name(item.command)} right behind a spline: ArduPilot {takes}, lets the spline lead on "
        f"to that and swings up to {quantity.height(swing_m)} up or down on it, which is not predicted; "
        f"write {write}, or hold for 1 s at the spline",
        severity=Severity.ERROR if is_grave else None,
    )


def _way_beyond_m(state: MissionState, item: MissionItem) -> float:
    """Return how far beyond its end a spline is led that is predicted level. [m]"""
    up_m = state.height_of_m(item) - state.height_m if item.altitude_m else 0.0
    level_m = 0.0
    if item.names_place and item.command not in _LEVEL_PLACES:
        there = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        level_m = float(distance_m(state.latitude_deg, state.longitude_deg, *there))
    return math.hypot(level_m, up_m)


_KINDS: Mapping[int, StageKind] = {
    Command.NAV_WAYPOINT: StageKind.GO,
    Command.NAV_SPLINE_WAYPOINT: StageKind.SPLINE,
    Command.NAV_LOITER_TIME: StageKind.LOITER,
}
_HANDLERS: Mapping[int, Callable[[MissionState, MissionItem], None]] = {
    **dict.fromkeys(_KINDS, go),
    Command.NAV_LOITER_TURNS: circles.circle,
    Command.NAV_LOITER_TO_ALT: change_height,
    Command.NAV_LOITER_UNLIM: loiter_for_ever,
    Command.NAV_TAKEOFF: take_off,
    Command.NAV_VTOL_TAKEOFF: take_off,
    Command.NAV_LAND: landings.land,
    Command.NAV_VTOL_LAND: landings.land,
    Command.NAV_RETURN_TO_LAUNCH: landings.return_home,
    Command.NAV_DELAY: delay,
    Command.NAV_PAYLOAD_PLACE: landings.set_down,
    Command.NAV_ARC_WAYPOINT: arc,
    Command.CONDITION_GATE: gate,
    Command.NAV_GUIDED_ENABLE: guided,
    Command.DO_CHANGE_SPEED: commanded.change_speed,
    Command.DO_SET_HOME: commanded.set_home,
    Command.DO_FENCE_ENABLE: commanded.switch_fence,
    Command.DO_PARACHUTE: commanded.switch_parachute,
    **dict.fromkeys(
        (
            *ROIS_BY_MODE,
            Command.DO_SET_ROI_LOCATION,
            Command.DO_SET_ROI_WPNEXT_OFFSET,
            Command.DO_SET_ROI_NONE,
        ),
        commanded.look_at,
    ),
}
"""How each command is followed; any other is passed by."""


def carry_out(state: MissionState, item: MissionItem) -> None:
    """Make of the flight what the command of an item makes of it."""
    if state.asked_climb_m_s is not None or state.asked_descent_m_s is not None:
        rises_here = item.command == Command.NAV_LOITER_TO_ALT and not item.names_place
        if is_destination(item.command) and item.command not in _UP_OR_DOWN and not rises_here:
            commanded.begin_leg(state, item)
    _HANDLERS.get(item.command, commanded.pass_by)(state, item)
