"""Turns about a place, and where on their circle they end."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import TERRAIN_FRAMES, Command, command_name, is_destination
from planner.mission.route.stage import StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED, LARGEST_RADIUS_M
from planner.mission.storage import stored_radius_m, stored_turns
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import MissionItem
    from planner.mission.route.state import MissionState

_METRES_PER_DEGREE = 111_319.0
"""Of latitude, as ArduPilot has it."""
_AT_CENTRE_DEG = 0.5 / _METRES_PER_DEGREE
"""So near to a centre the vehicle is there. [°]"""
EDGE_NEAR_M = 3.0
"""``ModeAuto::circle_movetoedge_start`` flies to a circle from farther away only. [m]"""
MOST_TURNS = 100_000.0


def circle(state: MissionState, item: MissionItem) -> None:
    """Fly turns about a place; the vehicle is on their circle afterwards."""
    from_deg, from_m = (state.latitude_deg, state.longitude_deg), state.height_m
    state.move_to(item)
    state.height_m = state.height_to_m(item)
    turns, radius = abs(item.param1 or 0.0), item.param3 or 0.0
    if turns > MOST_TURNS or abs(radius) > LARGEST_RADIUS_M:
        state.refuse(item, f"{quantity.count(turns, 'turn')} of {radius:g} m cannot be flown")
    if state.dialect is not Autopilot.PX4:  # which refuses circles
        if (item.param1 or 0.0) < 0.0:
            message = (
                f"{command_name(item.command)}: ArduPilot keeps its count of {item.param1:g} without a "
                f"sign, as none or up to 255 turns by its board: predicted as {turns:g}"
            )
            state.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
        kept_turns = stored_turns(turns)
        kept_radius = stored_radius_m(radius)
        written = f"{quantity.count(turns, 'turn')} of {radius:g} m"
        if (kept_turns, kept_radius) != (turns, radius):
            state.remark_stored(item, written, f"{kept_turns:g} of {kept_radius:g} m")
        if kept_radius == 0.0:
            way_m = float(distance_m(*from_deg, state.latitude_deg, state.longitude_deg))
            _remark_no_radius(state, math.hypot(way_m, state.height_m - from_m))
        turns, radius = kept_turns, _flown_radius_m(state, item, kept_radius, kept_turns)
    follows = item.frame in TERRAIN_FRAMES and state.dialect is Autopilot.ARDUPILOT
    ground_m = state.known_ground_m() if follows else None
    state.add(
        replace(
            state.stage(StageKind.CIRCLE),
            turns=turns,
            radius_m=radius,
            followed_ground_m=()
            if ground_m is None
            else (ground_m + (state.ground_datum_m or 0.0),),
            follows_ground=ground_m is not None,
        )
    )
    if radius and state.dialect is not Autopilot.PX4:
        _leave_centre(state, from_deg, radius, turns)


def _remark_no_radius(state: MissionState, way_m: float) -> None:
    """Tell of turns without a radius ``way_m`` away, which versions of ArduPilot fly differently.

    Notes
    -----
    ``AC_Circle`` until 4.6 has no radius either until one is set, and ``circle_movetoedge_start`` goes to
    the centre then; no flight of those is known.
    """
    name = "NAV_LOITER_TURNS"
    if state.habits.circles_by_rate is None and way_m > EDGE_NEAR_M:
        message = (
            f"{name} has no radius: ArduCopter 4.7 turns at once, on the way to its place and at the "
            "height before, others fly there first, as predicted: give it a radius, or the version with "
            "--target"
        )
        severity = Severity.ERROR if state.dialect is None else None
        state.remark(ITEM_NOT_MODELLED, message, severity=severity)
    elif state.habits.circles_by_rate is False and state.circle_radius_m == 0.0:
        message = (
            f"{name} has no radius, nor has one before: ArduPilot may turn on the spot at its place, by "
            "its source; predicted is a circle of CIRCLE_RADIUS"
        )
        state.remark(ITEM_NOT_MODELLED, message)


def _leave_centre(
    state: MissionState, from_deg: tuple[float, float], radius_m: float, turns: float
) -> None:
    """Go from the centre of a circle to where its turns end, begun nearest to where the vehicle was.

    On a plane: circles are small.  At the centre itself its heading tells, which is not known.
    """
    east_deg = math.cos(math.radians(state.latitude_deg))
    away = complex(
        from_deg[0] - state.latitude_deg,
        math.remainder(from_deg[1] - state.longitude_deg, 360.0) * east_deg,
    )
    is_at_centre = abs(away) <= _AT_CENTRE_DEG
    begun = "begun at its centre, which ArduPilot leaves straight behind, by its heading"
    state.unknown_side = begun if is_at_centre else ""
    away = complex(-1.0, 0.0) if is_at_centre else away / abs(away)
    turned = math.copysign(math.tau * turns, radius_m)
    away *= complex(math.cos(turned), math.sin(turned)) * (abs(radius_m) / _METRES_PER_DEGREE)
    state.latitude_deg += away.real
    state.longitude_deg += away.imag / east_deg


def _flown_radius_m(state: MissionState, item: MissionItem, radius_m: float, turns: float) -> float:
    """Return the radius that ArduPilot gives a circle, negative for counter-clockwise; 0: on the spot.

    Notes
    -----
    ``ModeAuto::circle_movetoedge_start`` and ``circle_start``.  Until 4.6 the direction is the item's,
    and ``AC_Circle`` keeps its radius where the item has none; 4.7 takes 0 as it is, and turns by
    CIRCLE_RATE: ``AC_Circle::get_rate_degs`` returns that, no longer the rate whose sign was set.
    Flown with 4.7.0-dev: clockwise for a radius of -20 m, and on the spot behind it for 0.
    """
    habits = state.habits
    if radius_m == 0.0 and habits.circles_by_rate:
        return 0.0
    asked_m = _circle_radius_m(state, item, radius_m)
    by_rate_m = math.copysign(asked_m, 1.0 if habits.circles_clockwise else -1.0)
    if habits.circles_by_rate is False or by_rate_m == asked_m:
        return asked_m
    way = "clockwise" if habits.circles_clockwise else "counter-clockwise"
    message = (
        f"{command_name(item.command)}: ArduCopter 4.7 turns {way}, by the sign of CIRCLE_RATE"
    )
    if habits.circles_by_rate:
        state.remark(ITEM_NOT_MODELLED, f"{message}, not by the item's radius, and is predicted so")
        return by_rate_m
    is_part = turns % 1.0 != 0.0
    state.remark(
        ITEM_NOT_MODELLED,
        f"{message}, others by the item's radius, as predicted"
        + (": give the version with --target" if is_part else ""),
        severity=Severity.ERROR if is_part else Severity.WARNING,
    )
    return asked_m


def _circle_radius_m(state: MissionState, item: MissionItem, radius_m: float) -> float:
    """Return the radius of a circle until ArduCopter 4.6: where it has none, that of the one before."""
    if radius_m == 0.0 and state.circle_radius_m > 0.0:
        before = quantity.distance(state.circle_radius_m)
        message = (
            f"{command_name(item.command)} has no radius: ArduPilot flies the {before} of the "
        )
        state.remark(ITEM_NOT_MODELLED, message + "circle before")
        return state.circle_radius_m
    state.circle_radius_m = abs(radius_m)
    return radius_m or state.habits.circle_radius_m


def circles_on(state: MissionState) -> bool:
    """Whether ArduPilot flies on round the circle behind it while it is delayed.

    ``ModeAuto::do_nav_delay`` starts nothing: ``circle_run`` goes on.  Flown: a quarter of a circle of
    20 m and 20 s of NAV_DELAY lead all round it.
    """
    circles = bool(state.stages) and state.stages[-1].kind is StageKind.CIRCLE
    return circles and state.dialect is not Autopilot.PX4 and state.stages[-1].radius_m != 0.0


def circle_on(state: MissionState, item: MissionItem, seconds: float) -> None:
    """Wait on the circle that ArduPilot flies on round meanwhile."""
    circle = state.stages[-1]
    state.stages[-1] = replace(circle, hold_s=circle.hold_s + seconds)
    state.unknown_side = "and NAV_DELAY, while which ArduPilot circles on"
    if state.waiting:
        message = (
            f"{command_name(item.command)} behind LOITER_TURNS, and what conditions hold back: ArduPilot "
            "carries that out while it circles on, which is not predicted"
        )
        state.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)


def remark_unknown_side(state: MissionState, item: MissionItem) -> None:
    """Tell what is "here" behind a circle that may be left on any side of it."""
    if not state.unknown_side:
        return
    goes, sets_home = is_destination(item.command), item.command == Command.DO_SET_HOME
    if not (goes or sets_home):
        return
    if item.sets_home_here if sets_home else not item.names_place:
        message = (
            f"{command_name(item.command)} here, behind LOITER_TURNS {state.unknown_side}: not "
            "predicted where that is: give it a place"
        )
        state.remark(ITEM_NOT_MODELLED, message, severity=Severity.ERROR)
    elif goes:
        state.unknown_side = ""
