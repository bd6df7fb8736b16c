"""What DO_ items command: speeds, homes, fences, parachutes, where to look."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import (
    PARACHUTE_OFF,
    PARACHUTE_ON,
    RELATIVE_FRAMES,
    ROI_LOCATION,
    ROIS_BY_MODE,
    Command,
    CommandEffect,
    Frame,
    Support,
    command_effect,
    command_name,
    goes_on_flying,
    is_destination,
    support,
)
from planner.mission.route.circles import EDGE_NEAR_M
from planner.mission.route.stage import (
    LANDED_STAGES,
    FenceAction,
    FenceSwitch,
    HomePlace,
    ParachuteSwitch,
    StageKind,
)
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import MissionItem
    from planner.mission.route.state import MissionState

_FENCE_ACTIONS = {int(action): action for action in FenceAction}

DESCENT = 3.0
"""First parameter of DO_CHANGE_SPEED for that of a descent."""
FASTEST_M_S = 1000.0
_DELIVERED_M_S = {"climb": 2.5, "descent": 1.5}
"""WPNAV_SPEED_UP and WPNAV_SPEED_DN as delivered."""
_NO_LEGS = frozenset({StageKind.TAKEOFF, StageKind.DELAY})
_KEPT_BY_LEGS = frozenset({StageKind.GO, StageKind.SPLINE, StageKind.LOITER})
_BEGUN_ANEW = frozenset({Command.NAV_SPLINE_WAYPOINT, Command.NAV_LOITER_TURNS})
"""Flown to without ``ModeAuto::wp_start``, which alone takes up again what was commanded."""
_BY_OWN_SPEEDS = LANDED_STAGES | {StageKind.SET_DOWN, StageKind.CHANGE_HEIGHT}
_SAME_HEIGHT_M = 0.045
"""``ModeAuto::loiter_to_alt_run`` is done so near to its height: 0.05 m less a lag. [m]"""


def change_speed(state: MissionState, item: MissionItem) -> None:
    """Take a new speed for what follows."""
    state.remark_gate("where PX4 passes the CONDITION_GATE that this speed counts from")
    kind, speed = item.param1 or 0.0, item.param2
    if speed is not None and speed > FASTEST_M_S:
        state.refuse(item, f"a speed of {speed:g} m/s cannot be flown")
    if state.dialect is Autopilot.PX4:
        _change_px4_speed(state, speed)
    elif speed is None or speed <= 0.0:
        return
    elif kind == 2.0:
        state.climb_speed_m_s = state.asked_climb_m_s = speed
        state.is_climb_late = state.queued > 0
    elif kind == DESCENT:
        state.descent_speed_m_s = state.asked_descent_m_s = speed
        state.is_descent_late = state.queued > 0
    elif kind in {0.0, 1.0}:
        state.speed_m_s = speed
        state.is_speed_late = state.queued > 0
    else:
        message = (
            f"DO_CHANGE_SPEED: no speed type {kind:g}; speed unchanged, by some versions and boards of "
            "ArduPilot flown as the level speed"
        )
        # 4.7 leaves the speed as it is, but for what has a sign, which boards keep otherwise.
        is_left = state.habits.circles_by_rate is True and kind > DESCENT
        state.remark(ITEM_NOT_MODELLED, message, severity=None if is_left else Severity.ERROR)


def begin_leg(state: MissionState, item: MissionItem) -> None:
    """Take up the speeds of climbs and descents commanded, but raised ones that ArduPilot does not keep.

    Notes
    -----
    ``ModeAuto::wp_start`` commands them again where no leg is before, nor a LOITER_TO_ALT that is over as it
    is there.  ``AC_WPNav`` takes a parameter other than delivered for a changed one as it first flies to a
    place (``update_wpnav``), and goes by it; a spline, or the way to a circle, not begun from another leg
    goes by it always (``set_spline_destination``, ``circle_movetoedge_start``).  All but the first of the
    queue come later, and are kept.  Flown by a build of 4.7: with WPNAV_SPEED_UP 100 the leg takes 30 %
    longer, with 250 the speed is kept; a take-off is flown at it in any case.  Of a lowered one, lost too,
    the slower counts.
    """
    follows_leg = _follows_leg(state)
    if not follows_leg and not _is_over_as_it_is_there(state):
        state.climb_speed_m_s = state.asked_climb_m_s
        state.descent_speed_m_s = state.asked_descent_m_s
    if state.dialect is not Autopilot.ARDUPILOT:
        return
    is_anew = item.command in _BEGUN_ANEW and not follows_leg
    is_first = not any(_is_leg(state, number) for number in range(len(state.stages)))

    def left_m_s(asked_m_s: float | None, own_m_s: float, what: str) -> float | None:
        is_lost = is_anew or (is_first and not math.isclose(own_m_s, _DELIVERED_M_S[what]))
        if asked_m_s is None or asked_m_s <= own_m_s or not is_lost:
            return asked_m_s
        before = f"this {command_name(item.command)}" if is_anew else "the first leg"
        state.remark(
            ITEM_NOT_MODELLED,
            f"a {what} at {quantity.speed(asked_m_s)} set before {before}: ArduPilot may not keep it; "
            f"predicted at {quantity.speed(own_m_s)} of its parameters; set it behind this item",
        )
        return own_m_s

    own = state.habits
    if not state.is_climb_late:
        state.climb_speed_m_s = left_m_s(state.climb_speed_m_s, own.climb_speed_m_s, "climb")
    if not state.is_descent_late:
        state.descent_speed_m_s = left_m_s(
            state.descent_speed_m_s, own.descent_speed_m_s, "descent"
        )


def end_item(state: MissionState) -> None:
    """Take the vehicle's own speeds of climbs and descents behind what ArduPilot flies at those.

    Notes
    -----
    ``ModeAuto::land_start``, ``do_loiter_to_alt``, ``PayloadPlace::start_descent`` and ``ModeRTL::init`` set
    the limits of ``AC_PosControl`` by the parameters; what the queue commands when they have, is kept.
    Flown with WPNAV_SPEED_UP 100, and 4 m/s asked for before: a take-off behind a landing takes 62 s for
    60 m, one behind a LOITER_TO_ALT 40 s for 40 m, LOITER_TO_ALT where the vehicle is 43 s for 40 m.
    """
    stage = state.stages[-1]
    if stage.kind not in _BY_OWN_SPEEDS:
        return
    is_at_once = stage.is_here or stage.kind in {StageKind.CHANGE_HEIGHT, StageKind.RETURN}
    if not (is_at_once and state.is_climb_late):
        state.climb_speed_m_s = None
    if not (is_at_once and state.is_descent_late):
        state.descent_speed_m_s = None
    if stage.kind is StageKind.SET_DOWN:
        stage = replace(stage, climb_speed_m_s=None)
    elif stage.kind is StageKind.CHANGE_HEIGHT:
        rises = _rise_m(state) > 0.0
        there_m_s = state.climb_speed_m_s if rises else state.descent_speed_m_s
        stage = replace(stage, lands_at_m_s=there_m_s)
    state.stages[-1] = stage


def _rise_m(state: MissionState) -> float:
    """Return how far the last stage leads up. [m]"""
    before_m = state.stages[-2].height_m if len(state.stages) > 1 else 0.0
    return state.stages[-1].height_m - before_m


def _is_over_as_it_is_there(state: MissionState) -> bool:
    """Return whether a LOITER_TO_ALT is before that has no height left to change, the leg to it still flown.

    Flown: 40 m off and 0.8 m up it is, 0.9 m up not; 1.6 m up with WPNAV_RADIUS 50 it is, with
    100 not.
    """
    if len(state.stages) < 2 or state.stages[-1].kind is not StageKind.CHANGE_HEIGHT:
        return False
    within_m = state.habits.waypoint_radius_m
    way_m = float(distance_m(*state.places_deg[-2], *state.places_deg[-1]))
    return abs(_rise_m(state)) * within_m / max(way_m, within_m) < _SAME_HEIGHT_M


def _follows_leg(state: MissionState) -> bool:
    """Return whether ArduPilot's controller for places is at work: not behind turns, nor a take-off."""
    kinds = (stage.kind for stage in reversed(state.stages))
    return next((kind for kind in kinds if kind is not StageKind.DELAY), None) in _KEPT_BY_LEGS


def _is_leg(state: MissionState, number: int) -> bool:
    """Return whether it flies to the place of a stage: not to a circle nearby, nor to no place."""
    stage = state.stages[number]
    if stage.kind is not StageKind.CIRCLE:
        needs_place = stage.kind in {StageKind.CHANGE_HEIGHT, StageKind.LAND}
        return stage.kind not in _NO_LEGS and not (needs_place and stage.is_here)
    if not number or not stage.radius_m:
        return False
    way_m = float(distance_m(*state.places_deg[number - 1], *state.places_deg[number]))
    rise_m = stage.height_m - state.stages[number - 1].height_m
    return math.hypot(way_m - abs(stage.radius_m), rise_m) > EDGE_NEAR_M


def _change_px4_speed(state: MissionState, speed_m_s: float | None) -> None:
    """Take a speed: PX4 does not look at the type, and nothing above zero resets to its own."""
    asked_m_s = speed_m_s if speed_m_s is not None and speed_m_s > 0.0 else None
    is_fresh = state.sped_at == len(state.stages) and state.speed_m_s is not None
    if asked_m_s is None and is_fresh:
        state.remark(
            ITEM_NOT_MODELLED,
            "DO_CHANGE_SPEED back to PX4's own speed, right behind one to "
            f"{quantity.speed(state.speed_m_s)}: PX4 flies the next leg at that all the same, which is "
            "not predicted; leave out the one that does not count",
            severity=Severity.ERROR,
        )
    state.speed_m_s, state.sped_at = asked_m_s, len(state.stages)


def set_home(state: MissionState, item: MissionItem) -> None:
    """Move the place a return leads to."""
    _move_home(state, item)
    state.moved_homes.append(
        HomePlace(
            first_stage=len(state.stages),
            east_m=0.0,
            north_m=0.0,
            ground_m=state.home_ground_m(),
            datum_m=state.datum_m,
            item=state.number,
        )
    )
    state.homes_deg.append(state.home_deg)


def _move_home(state: MissionState, item: MissionItem) -> None:
    if (
        not item.names_place
        and item.altitude_m
        and item.param1 != 1.0
        and state.dialect is not Autopilot.PX4
    ):
        height = quantity.height(item.altitude_m)
        message = (
            f"DO_SET_HOME at 0°, 0° and {height}: ArduPilot moves home there, or refuses it, by its "
            "version; predicted as if it were refused"
        )
        state.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
        return
    if state.dialect is Autopilot.PX4 and item.frame == Frame.MISSION and not item.sets_home_here:
        message = (
            "DO_SET_HOME in frame 2: its latitude and longitude are sent in whole degrees, and PX4 moves "
            "home there, to another place than predicted; it takes the present place (parameter 1 of 1)"
        )
        state.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
    if item.param1 == 1.0 or not state.has_place(item):
        state.home_deg = (state.latitude_deg, state.longitude_deg)
        state.datum_m = state.height_m
        if state.height_m != state.ground_level_m:
            height = quantity.height(state.height_m)
            message = (
                f"DO_SET_HOME: home is moved to where the vehicle flies, {height} up; the "
                "return is predicted to end on the ground"
            )
            state.remark(ITEM_NOT_MODELLED, message)
        return
    state.home_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
    if item.altitude_m is None:
        return
    if item.frame in RELATIVE_FRAMES:  # of the home there has been until now
        state.datum_m += item.altitude_m
    else:
        state.amsl_items.append(state.number)
        state.datum_m = item.altitude_m - (state.home_amsl_m or 0.0)
    state.ground_level_m = state.datum_m


def switch_fence(state: MissionState, item: MissionItem) -> None:
    """Switch the fence on or off, or its floor off; any other value does nothing."""
    action = _FENCE_ACTIONS.get(int(item.param1 or 0.0))
    if action is not None and state.dialect is not Autopilot.PX4:
        first = len(state.stages)
        state.fence_switches.append(
            FenceSwitch(
                first_stage=first, action=action, item=state.number, is_late=state.queued > 0
            )
        )


def switch_parachute(state: MissionState, item: MissionItem) -> None:
    """Switch the parachute on or off: on at once, off only where no condition may hold it back."""
    is_on = item.param1 == PARACHUTE_ON
    if is_on or (item.param1 == PARACHUTE_OFF and not state.conditions):
        state.parachute_switches.append(
            ParachuteSwitch(first_stage=len(state.stages), is_on=is_on, item=state.number)
        )
    pass_by(state, item)


def look_at(state: MissionState, item: MissionItem) -> None:
    """Turn to a region of interest from the next item on, or no more.

    Notes
    -----
    ``Navigator::run`` takes the place of DO_SET_ROI_LOCATION alone: that of DO_SET_ROI and NAV_ROI stays
    0°, 0°.  DO_SET_ROI_WPNEXT_OFFSET looks along the way, beside an offset that is not predicted.
    """
    if state.dialect is Autopilot.PX4:
        state.looks_at_deg = None
        if item.command == Command.DO_SET_ROI_LOCATION:
            state.looks_at_deg = (item.latitude_deg or 0.0, item.longitude_deg or 0.0)
        elif item.command in ROIS_BY_MODE and int(item.param1 or 0.0) == ROI_LOCATION:
            state.looks_at_deg = (0.0, 0.0)
    pass_by(state, item)


def pass_by(state: MissionState, item: MissionItem) -> None:
    """Follow an item that is no flight of its own, or none that is predicted."""
    wait_s = state.habits.payload_waits_s.get(item.command, 0.0) if state.in_air else 0.0
    if wait_s > 0.0:
        state.add(state.stage(StageKind.DELAY, hold_s=wait_s))
    effect = command_effect(item.command)
    if effect is CommandEffect.NO_EFFECT or item.command in {
        Command.DO_JUMP,
        Command.DO_JUMP_TAG,
        Command.JUMP_TAG,
    }:
        return
    name = command_name(item.command)
    if item.command == Command.DO_AUX_FUNCTION:
        name += f" {item.param1 or 0.0:g}"
    if state.dialect is not None and support(item.command, state.dialect) is Support.SKIPPED:
        assumed = f"{state.dialect.label} skips it, 0 s and 0 Wh are assumed"
    elif is_destination(item.command) and state.has_place(item):
        state.go_to(StageKind.GO, item)
        assumed = "a straight flight to its place is assumed"
    elif wait_s > 0.0:
        assumed = f"a wait of {quantity.duration(wait_s)} is predicted, no change of mass"
    else:
        assumed = "0 s and 0 Wh are assumed"
    state.remark(
        ITEM_NOT_MODELLED,
        f"{name} is not modelled: {assumed}",
        severity=None
        if goes_on_flying(item.command, item.param1, state.dialect)
        else Severity.ERROR,
    )
