"""Parts of a mission: where it can be broken off and taken up again, and the items of each part."""

from __future__ import annotations

from bisect import bisect_left
from dataclasses import replace
from itertools import pairwise
from typing import TYPE_CHECKING

from planner.frozen import frozen
from planner.mission.carried_state import bare_command, is_output, is_relative_yaw, is_repeatable
from planner.mission.commands import AMSL_FRAMES, TERRAIN_FRAMES, Command, Frame
from planner.mission.items import Mission, MissionFormat, MissionItem
from planner.mission.jump_numbers import numbered_in_order
from planner.mission.plan import PlanDocument
from planner.mission.stage import StageKind
from planner.mission.steps import is_takeoff_assumed

if TYPE_CHECKING:
    from planner.mission.steps import Steps

OVERLAP_M = 10.0
"""Flown twice besides the way between two photos: autopilots count a waypoint as reached up to so far
before it, PX4's NAV_ACC_RAD. [m]"""
_STEP_M = 10.0
"""Between two places of a leg at which it may be cut. [m]"""
_MOST_CUTS_A_LEG = 2000
_SPEED_UNKNOWN_M_S = 15.0
"""Of legs flown at the vehicle's own speed, for photos by time: faster than surveys are. [m s⁻¹]"""
_SAME_HEIGHT_M = 1.0
_DELAYING = frozenset({Command.CONDITION_DELAY, Command.CONDITION_DISTANCE})
_STRAIGHT_COMMANDS = frozenset({Command.NAV_WAYPOINT, Command.NAV_LOITER_TIME})
_UNCUT_BEFORE = frozenset({StageKind.SPLINE, StageKind.TAKEOFF, StageKind.RETURN})
_UNCUT_BEHIND = frozenset({StageKind.SPLINE, StageKind.CIRCLE, StageKind.TAKEOFF})


@frozen
class Cut:
    """A point of a mission: everything before a step is done, and a share of the leg to it."""

    step: int
    """Position among the steps."""
    share: float = 0.0
    """Of the leg to that step. [-]"""


@frozen
class Part:
    """A part of a mission, as a mission of its own."""

    mission: Mission
    first_own: int
    """The first item that flies the whole's legs, from 1; those before lead there."""
    last_own: int
    """The last of them; those behind lead home."""


def possible_cuts(steps: Steps, *, inside_legs: bool) -> list[Cut]:
    """Return where a mission may be cut, in flown order.

    Parameters
    ----------
    steps : Steps
        The mission.
    inside_legs : bool
        Whether straight legs may be cut too, every 10 m.
    """
    flying = steps.flying
    cuts: list[Cut] = []
    for previous, step in pairwise(flying):
        if not _may_cut(steps, previous, step):
            continue
        if resumption(steps, Cut(step=step)) is not None:
            cuts.append(Cut(step=step))
        if inside_legs and _is_straight(steps, step):
            length_m = steps.length_m(step)
            count = min(int(length_m / _STEP_M), _MOST_CUTS_A_LEG)
            inside = (Cut(step=step, share=number / count) for number in range(1, count))
            cuts += [cut for cut in inside if resumption(steps, cut) is not None]
    return cuts


def _may_cut(steps: Steps, previous: int, step: int) -> bool:
    """Return whether the flight may be broken off between two steps that fly."""
    between = steps.items[previous + 1 : step]
    return (
        steps.stage(step).kind not in _UNCUT_BEFORE
        and steps.stage(previous).kind not in _UNCUT_BEHIND
        and not any(item.command in _DELAYING or is_relative_yaw(item) for item in between)
    )


def _is_straight(steps: Steps, step: int) -> bool:
    """Return whether the leg to a step is a straight line that can be cut anywhere.

    A spline leaves with the whole leg before it as its tangent: a shorter one would bend it otherwise.
    """
    here, there = steps.stage_before(step), steps.stage(step)
    after = bisect_left(steps.flying, step) + 1
    bends = after < len(steps.flying) and steps.stage(steps.flying[after]).kind is StageKind.SPLINE
    item = steps.items[step]
    before = steps.mission.items[here.item - 1]
    is_terrain = item.frame in TERRAIN_FRAMES
    return (
        there.kind in {StageKind.GO, StageKind.LOITER}
        and here.kind not in _UNCUT_BEHIND
        and not bends
        and item.command in _STRAIGHT_COMMANDS
        and is_terrain is (before.frame in TERRAIN_FRAMES)
        and not (is_terrain and not (item.altitude_m and before.altitude_m))
    )


def resumption(steps: Steps, cut: Cut) -> Cut | None:
    """Return where the flight is taken up again after a cut; ``None`` where that is impossible.

    Where a camera is triggered on the way, it is so much before the cut that no photo is missing: the
    way between two photos, and `OVERLAP_M`.
    """
    flying = steps.flying
    step, share = cut.step, cut.share
    overlap_m = _spacing_m(steps, step)
    if overlap_m == 0.0:
        return cut
    overlap_m += OVERLAP_M
    while True:
        length_m = steps.length_m(step)
        room_m = share * length_m
        if room_m >= overlap_m:
            return Cut(step=step, share=share - overlap_m / length_m)
        at = bisect_left(flying, step)
        if at == 0:
            return None
        previous = flying[at - 1]
        if _spacing_m(steps, previous) == 0.0:
            return Cut(step=step)
        repeated = steps.items[previous + 1 : step]
        if (
            at == 1
            or not _is_straight(steps, previous)
            or not _may_cut(steps, flying[at - 2], previous)
            or not all(map(is_repeatable, repeated))
            or steps.items[previous].param1  # a hold
        ):
            return None
        overlap_m -= room_m
        step, share = previous, 1.0


def _spacing_m(steps: Steps, step: int) -> float:
    """Return the way between two photos on the leg to a step; 0 where none is taken. [m]"""
    speed_m_s = steps.stage(step).speed_m_s or _SPEED_UNKNOWN_M_S
    return steps.states[step].trigger_spacing_m(speed_m_s)


def part_of(steps: Steps, start: Cut | None, end: Cut | None, *, name: str) -> Part:
    """Return one part: take-off, way to where it begins, its steps, way home.

    Parameters
    ----------
    steps : Steps
        The whole.
    start : Cut or None
        Where it is taken up, as `resumption` says; ``None``: at the beginning.
    end : Cut or None
        Where it is broken off; ``None``: at the end.
    name : str
        Its file.
    """
    if start is None:
        begin, items = steps.first, list(steps.items[: steps.first])
        if is_takeoff_assumed(steps.route):
            items.append(_takeoff(steps, 0.0))
    else:
        begin, items = start.step, _way_out(steps, start)
    before = len(items)
    items += steps.items[begin : len(steps.items) if end is None else end.step]
    if end is not None and end.share > 0.0:
        items.append(_waypoint(steps, end, steps.items[end.step]))
    returns = end is None and steps.route.stages[-1].kind is StageKind.RETURN
    last_own = len(items) - int(returns)
    if end is not None:
        items += steps.states[end.step].stopping_items()
    if end is not None or not steps.ends:
        items.append(bare_command(Command.NAV_RETURN_TO_LAUNCH))
    document = steps.mission.document
    mission = replace(
        steps.mission,
        source=name,
        file_format=MissionFormat.PLAN,
        items=numbered_in_order([replace(item, jump_id=None) for item in items]),
        findings=(),
        document=document if isinstance(document, PlanDocument) else None,
    )
    return Part(mission=mission, first_own=before + 1, last_own=last_own)


def _way_out(steps: Steps, start: Cut) -> list[MissionItem]:
    """Return what leads from home to where a part is taken up, and sets there what was set.

    The way is level: at the height of the take-off or of that place, whichever is higher.
    """
    before = steps.items[: start.step]
    state = steps.states[start.step]
    place = _waypoint(steps, start, steps.items[_previous(steps, start.step)])
    rise_m = _height_m(steps, start) - steps.route.stages[0].height_m
    items = [
        item
        for item, stage in zip(before[: steps.first], steps.stages, strict=False)
        if stage is None
        and item.command not in {Command.NAV_DELAY, *_DELAYING}
        and not (is_repeatable(item) or is_output(item))
    ]
    items.append(_takeoff(steps, max(rise_m, 0.0)))
    items += state.speeds()
    if rise_m < -_SAME_HEIGHT_M:
        items.append(replace(place, altitude_m=(place.altitude_m or 0.0) - rise_m))
    return [*items, place, *state.settings()]


def _takeoff(steps: Steps, higher_m: float) -> MissionItem:
    """Return the take-off of a part, from home, so much higher than that of the mission."""
    home = steps.mission.home
    assert home is not None  # else the mission is refused
    if is_takeoff_assumed(steps.route):
        own = replace(
            bare_command(Command.NAV_RETURN_TO_LAUNCH),
            command=int(Command.NAV_TAKEOFF),
            frame=int(Frame.GLOBAL_RELATIVE_ALT),
            param4=None,
            altitude_m=steps.route.stages[0].height_m,
        )
    else:
        own = steps.items[steps.first - 1]
    return replace(
        own,
        latitude_deg=home.latitude_deg,
        longitude_deg=home.longitude_deg,
        altitude_m=None if own.altitude_m is None else own.altitude_m + higher_m,
    )


def _previous(steps: Steps, step: int) -> int:
    """Return the flying step before one."""
    return next(one for one in range(step - 1, -1, -1) if steps.stages[one] is not None)


def _height_m(steps: Steps, cut: Cut) -> float:
    here, there = steps.stage_before(cut.step), steps.stage(cut.step)
    return here.height_m + cut.share * (there.height_m - here.height_m)


def _waypoint(steps: Steps, cut: Cut, like: MissionItem) -> MissionItem:
    """Return a waypoint at a cut, in the altitude reference and with the heading of an item."""
    here, there = steps.stage_before(cut.step), steps.stage(cut.step)
    before = steps.items[_previous(steps, cut.step)]
    latitude_deg, longitude_deg = steps.route.frame.latitude_longitude_deg(
        here.east_m + cut.share * (there.east_m - here.east_m),
        here.north_m + cut.share * (there.north_m - here.north_m),
    )
    place = (float(latitude_deg), float(longitude_deg))
    if cut.share == 0.0 and before.latitude_deg and before.longitude_deg:
        place = (before.latitude_deg, before.longitude_deg)  # as the file says, to the last digit
    frame, altitude_m = int(Frame.GLOBAL_RELATIVE_ALT), _height_m(steps, cut)
    if before.frame in AMSL_FRAMES:
        frame, altitude_m = before.frame, altitude_m + steps.route.home_amsl_m
    elif before.frame in TERRAIN_FRAMES and before.altitude_m:
        above_m = steps.items[cut.step].altitude_m if cut.share > 0.0 else before.altitude_m
        frame = before.frame
        altitude_m = before.altitude_m + cut.share * ((above_m or 0.0) - before.altitude_m)
    return replace(
        bare_command(Command.NAV_RETURN_TO_LAUNCH),
        command=int(Command.NAV_WAYPOINT),
        frame=frame,
        param4=like.param4 if like.command in _STRAIGHT_COMMANDS else None,
        latitude_deg=place[0],
        longitude_deg=place[1],
        altitude_m=altitude_m,
    )
