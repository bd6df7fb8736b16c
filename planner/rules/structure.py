"""Rules on the mission's structure: endless loops, items an autopilot refuses or skips."""

from __future__ import annotations

from functools import cache
from math import hypot
from operator import attrgetter
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.mission import (
    COMMAND_UNSUPPORTED,
    HOME_FAR,
    JUMP_WITHOUT_FLIGHT,
    LANDING_ALTITUDE,
    VALUE_NOT_SET,
)
from planner.catalogue.time import ENDLESS, ITEM_NOT_MODELLED
from planner.findings import Remarks, Severity
from planner.mission.commands import (
    RELATIVE_FRAMES,
    Command,
    Support,
    command_name,
    frame_name,
    support,
)
from planner.mission.route.stage import StageKind
from planner.rules.fence import is_fenced
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from planner.findings import Finding
    from planner.mission.items import MissionItem
    from planner.mission.route.stage import Lap
    from planner.rules.assessment import Assessment

_FAR_M = 10_000.0
"""No multicopter begins its mission so far from home: PX4's MIS_DIST_1WP. [m]"""
_ELSEWHERE_M = 100_000.0
_PLACELESS = frozenset({StageKind.TAKEOFF, StageKind.RETURN, StageKind.DELAY})
"""Stages that lead to no place of the mission."""

_MAY_BE_UNSET: Mapping[int, frozenset[int]] = {
    Command.NAV_WAYPOINT: frozenset({4}),
    Command.NAV_LOITER_UNLIM: frozenset({4}),
    Command.NAV_LAND: frozenset({4}),
    Command.NAV_TAKEOFF: frozenset({4}),
    Command.NAV_ARC_WAYPOINT: frozenset({2, 3, 4}),
    Command.NAV_VTOL_TAKEOFF: frozenset({4}),
    Command.NAV_VTOL_LAND: frozenset({3, 4}),
}
"""Parameters that ArduPilot takes as NaN (AP_Mission.cpp, ``sanity_check_params``)."""


def check_endless(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the mission repeats itself for ever, with what one lap takes."""
    lap = a.route.lap
    if lap is None or not _flies(a, lap):
        return
    motion = a.flight.motion
    begin = int(motion.done_segment[lap.first_stage - 1]) + 1 if lap.first_stage else 0
    time_s = float(motion.segments.duration_s[begin:].sum())
    energy_wh = wh_from_j(float(a.flight.segment_energy_j[begin:].sum()))
    yield ENDLESS.finding(
        f"jumps back for ever: one lap takes {quantity.duration(time_s)} and {quantity.energy(energy_wh)}; "
        "the totals hold the way to it and one more lap",
        item=lap.item,
        place=a.mission.items[lap.item - 1].place,
    )


def check_loops(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where an endless jump leads round and nothing on the way is flown."""
    lap = a.route.lap
    if lap is not None and not _flies(a, lap):
        yield JUMP_WITHOUT_FLIGHT.finding(
            "jumps back for ever, and nothing on the way round is flown: the mission never goes on",
            item=lap.item,
            place=a.mission.items[lap.item - 1].place,
        )


def _flies(a: Assessment, lap: Lap) -> bool:
    """Return whether anything is flown in the lap of an endless jump."""
    return lap.first_stage < len(a.route.stages)


def check_home_place(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where home is nowhere near the mission."""
    if a.mission.home is None:
        return
    places = [
        (hypot(stage.east_m, stage.north_m), stage.item)
        for stage in a.route.stages
        if stage.kind not in _PLACELESS
    ]
    if not places:
        return
    away_m, item = min(places)
    is_px4 = a.target is not None and a.target.autopilot is Autopilot.PX4
    if away_m < (_ELSEWHERE_M if is_px4 else _FAR_M):
        return
    yield HOME_FAR.finding(
        f"home is {quantity.distance(away_m)} from the nearest place of the mission: the way there is "
        "counted",
        severity=Severity.ERROR if away_m >= _ELSEWHERE_M else None,
        item=item,
        place=a.mission.items[item - 1].place,
    )


def check_landing_altitude(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for landings that name an altitude other than that of home."""
    remarks = Remarks()
    for number, item in enumerate(a.mission.items, start=1):
        if item.command == Command.NAV_LAND and item.altitude_m and item.frame in RELATIVE_FRAMES:
            message = f"lands at an altitude of {quantity.height(item.altitude_m)} above home"
            remarks.add(LANDING_ALTITUDE, message, item=number, place=item.place)
    yield from remarks.findings()


def check_support(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for each command the autopilot refuses or skips, and how often it stands."""
    if a.target is None:
        return
    autopilot, version = a.target.autopilot, a.target.version
    by_command: dict[tuple[int, int], Remarks] = {}
    answers = {
        (command, frame): support(command, autopilot, frame=frame, version=version)
        for command, frame in {(item.command, item.frame) for item in a.mission.items}
    }
    for number, item in enumerate(a.mission.items, start=1):
        taken = answers[item.command, item.frame]
        if taken is Support.ACCEPTED or taken is Support.UNKNOWN:
            continue
        name = command_name(item.command)
        refusal = f"{autopilot.label} refuses {name}"
        severity = Severity.ERROR
        if taken is Support.SKIPPED:
            message, severity = f"{autopilot.label} skips {name} in flight", Severity.WARNING
        elif taken is Support.BLOCKS_ARMING:
            message = f"{autopilot.label} will not arm with {name}"
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


def check_unset_values(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a value is not set that ArduPilot wants."""
    if a.target is None or a.target.autopilot is not Autopilot.ARDUPILOT:
        return
    remarks = Remarks()
    for number, item in enumerate(a.mission.items, start=1):
        values = _wanted_values(item.command)(item)
        if None in values:
            what = _wanted_names(item.command)[values.index(None)]
            message = f"ArduPilot refuses {command_name(item.command)} with {what} not set"
            remarks.add(VALUE_NOT_SET, message, item=number, place=item.place)
    yield from remarks.findings()


def _wanted(command: int) -> list[int]:
    """Return which of the first four parameters of a command may not be NaN."""
    return [n for n in range(1, 5) if n not in _MAY_BE_UNSET.get(command, ())]


def _wanted_names(command: int) -> list[str]:
    return [*(f"parameter {n}" for n in _wanted(command)), "the altitude"]


@cache
def _wanted_values(command: int) -> Callable[[MissionItem], tuple[float | None, ...]]:
    """Return what takes those parameters and the altitude from an item."""
    return attrgetter(*(f"param{n}" for n in _wanted(command)), "altitude_m")


def check_curves(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a curve is flown straight: reference steps know no curves."""
    if a.autopilot is not Autopilot.STEP:
        return
    splines = [stage for stage in a.route.stages if stage.kind is StageKind.SPLINE]
    if splines:
        unjudged = [
            name
            for name, given in (
                ("the fence", is_fenced(a)),
                ("the ground", a.terrain is not None),
            )
            if given
        ]
        where = f"; {' and '.join(unjudged)} cannot be judged on the curve" if unjudged else ""
        yield ITEM_NOT_MODELLED.finding(
            f"{quantity.count(len(splines), 'spline')} flown straight, with a stop at each: the model "
            f"answers steps of its reference{where}",
            severity=Severity.ERROR if unjudged else None,
            item=splines[0].item,
            place=a.mission.items[splines[0].item - 1].place,
        )
