"""Two missions item by item: what a transfer changed or lost.

Compared are meanings: frames that say the same are one, places are rounded to the 10⁻⁷ degrees and
numbers to the four bytes that MAVLink has for them.  Home is left out: a vehicle has its own.
"""

from __future__ import annotations

from difflib import SequenceMatcher
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.mission.ardupilot_storage import stored_hold_s, stored_radius_m, stored_turns
from planner.mission.area_comparison import compare_fences, compare_rally_points
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    command_name,
    frame_name,
    load_command_table,
    parameter_names,
)
from planner.mission.difference import (
    Difference,
    DifferenceKind,
    is_close,
    is_same_altitude,
    is_same_number,
    place_key,
    shown,
    whole_difference,
)
from planner.mission.jump_numbers import numbered_in_order

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.mission.items import Mission, MissionItem

_USED: Mapping[Autopilot, Mapping[int, set[int]]] = {
    Autopilot.ARDUPILOT: {
        Command.NAV_WAYPOINT: {1},
        Command.NAV_SPLINE_WAYPOINT: {1},
        Command.NAV_LOITER_TIME: {1},
        Command.NAV_LOITER_TURNS: {1, 3},
        Command.NAV_LOITER_UNLIM: set(),
        Command.NAV_LAND: set(),
        Command.NAV_TAKEOFF: set(),
        Command.NAV_RETURN_TO_LAUNCH: set(),
    },
    Autopilot.PX4: {
        Command.NAV_WAYPOINT: {1, 2, 4},
        Command.NAV_LOITER_UNLIM: {3, 4},
        Command.NAV_LOITER_TIME: {1},  # it keeps the heading, and sends something else for it
        Command.NAV_LOITER_TO_ALT: {2},
        Command.NAV_TAKEOFF: {4},
        Command.NAV_LAND: {2, 4},
        Command.NAV_VTOL_TAKEOFF: {4},
        Command.NAV_VTOL_LAND: {4},
        Command.CONDITION_GATE: set(),
        Command.NAV_RETURN_TO_LAUNCH: set(),
        Command.DO_SET_ROI: set(),
        Command.DO_SET_ROI_LOCATION: set(),
    },
}
"""Parameters that a multicopter flies by; the others of these commands need not come back."""


def compare_missions(
    first: Mission, second: Mission, *, autopilot: Autopilot | None
) -> tuple[Difference, ...]:
    """Return what differs between two missions.

    Parameters
    ----------
    first : Mission
        As it was meant.
    second : Mission
        As it came out of the vehicle.
    autopilot : Autopilot or None
        Who stored the second one; ``None``: nobody, nothing may differ.
    """
    return (
        *_compare_items(first.items, second.items, autopilot),
        *compare_fences(first.fence, second.fence, autopilot),
        *compare_rally_points(first.rally, second.rally, autopilot),
    )


def _compare_items(
    first: Sequence[MissionItem], second: Sequence[MissionItem], autopilot: Autopilot | None
) -> Iterator[Difference]:
    ours, theirs = numbered_in_order(first), numbered_in_order(second)
    for one, other in _pairs(ours, theirs):
        if one is None or other is None:
            present = one or other
            assert present is not None  # a pair has one of them
            number = present.jump_id
            kind = DifferenceKind.MISSING if other is None else DifferenceKind.ADDED
            what = f"item {number} ({command_name(present.command)})"
            yield whole_difference("mission", number, kind, what)
        else:
            yield from _compare_pair(one, other, autopilot)


def _pairs(
    first: Sequence[MissionItem], second: Sequence[MissionItem]
) -> Iterator[tuple[MissionItem | None, MissionItem | None]]:
    """Yield items that belong together; where some are missing, by what they do and where."""
    if len(first) == len(second):
        yield from zip(first, second, strict=True)
        return
    matcher = SequenceMatcher(
        None,
        [_identity(item) for item in first],
        [_identity(item) for item in second],
        autojunk=False,
    )
    for _, start, end, other_start, other_end in matcher.get_opcodes():
        ours, theirs = list(first[start:end]), list(second[other_start:other_end])
        paired = min(len(ours), len(theirs))
        yield from zip(ours[:paired], theirs[:paired], strict=True)
        yield from ((item, None) for item in ours[paired:])
        yield from ((None, item) for item in theirs[paired:])


def _identity(item: MissionItem) -> tuple[object, ...]:
    return item.command, place_key(item.latitude_deg), place_key(item.longitude_deg)


def _compare_pair(
    one: MissionItem, other: MissionItem, autopilot: Autopilot | None
) -> Iterator[Difference]:
    if one.command != other.command:
        commands = command_name(one.command), command_name(other.command)
        yield _difference(one, "command", commands, DifferenceKind.CHANGED, autopilot)
        return
    changed, unused = DifferenceKind.CHANGED, DifferenceKind.UNUSED
    if _reference(one.frame) != _reference(other.frame):
        kind = changed if _has_place(one) else unused
        frames = frame_name(one.frame), frame_name(other.frame)
        yield _difference(one, "frame", frames, kind, autopilot)
    if one.autocontinue is not other.autocontinue:
        kind = unused if autopilot is Autopilot.ARDUPILOT else changed
        flags = str(one.autocontinue).lower(), str(other.autocontinue).lower()
        yield _difference(one, "autocontinue", flags, kind, autopilot)
    names = parameter_names(one.command)
    for position in range(1, 5):
        field = f"param{position}"
        first, second = getattr(one, field), getattr(other, field)
        is_yaw = "Yaw" in names[position - 1]
        if not is_same_number(first, second, autopilot, is_yaw=is_yaw):
            kind = _parameter_kind(one.command, position, first, second, autopilot)
            yield _difference(one, field, (first, second), kind, autopilot)
    yield from _compare_position(one, other, autopilot)


def _compare_position(
    one: MissionItem, other: MissionItem, autopilot: Autopilot | None
) -> Iterator[Difference]:
    names = parameter_names(one.command)[4:]
    for name, field in zip(names, ("latitude_deg", "longitude_deg", "altitude_m"), strict=True):
        first, second = getattr(one, field), getattr(other, field)
        if field == "altitude_m":
            is_same = is_same_altitude(first, second, autopilot)
        elif _has_place(one):
            is_same = place_key(first) == place_key(second)
        else:
            is_same = is_same_number(first, second, autopilot)
        if not is_same:
            is_used = _has_place(one) or bool(name)
            kind = DifferenceKind.CHANGED if is_used else DifferenceKind.UNUSED
            yield _difference(one, field, (first, second), kind, autopilot)


def _difference(
    item: MissionItem,
    field: str,
    values: tuple[float | str | None, float | str | None],
    kind: DifferenceKind,
    autopilot: Autopilot | None,
) -> Difference:
    first, second = values
    who = "it" if autopilot is None else autopilot.label
    tails = {
        DifferenceKind.STORED: f", as {who} stores it",
        DifferenceKind.UNUSED: f", which {who} does not fly by",
    }
    what = f"item {item.jump_id} ({command_name(item.command)})"
    change = f"{field} is {shown(first)}, then {shown(second)}"
    return Difference(
        part="mission",
        number=item.jump_id,
        field=field,
        first=first,
        second=second,
        kind=kind,
        message=f"{what}: {change}{tails.get(kind, '')}",
    )


def _has_place(item: MissionItem) -> bool:
    definition = load_command_table().commands.get(item.command)
    return definition is None or definition.has_location


def _parameter_kind(
    command: int,
    position: int,
    first: float | None,
    second: float | None,
    autopilot: Autopilot | None,
) -> DifferenceKind:
    used = None if autopilot is None else _USED.get(autopilot, {}).get(command)
    if autopilot is not None and (
        not parameter_names(command)[position - 1] or (used is not None and position not in used)
    ):
        return DifferenceKind.UNUSED
    if autopilot is Autopilot.ARDUPILOT and first is not None and second is not None:
        stored = None
        if command == Command.NAV_LOITER_TURNS and position == 1 and first > 0.0:
            stored = stored_turns(first)
        elif command == Command.NAV_LOITER_TURNS and position == 3:
            stored = stored_radius_m(first)
        elif position == 1 and command in {
            *(Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT, Command.NAV_LOITER_TIME),
        }:
            stored = stored_hold_s(first)
        if stored is not None and is_close(stored, second):
            return DifferenceKind.STORED
    return DifferenceKind.CHANGED


def _reference(frame: int) -> object:
    """Return what a frame counts altitudes from; the frame itself where it is another kind."""
    for frames in (AMSL_FRAMES, RELATIVE_FRAMES, TERRAIN_FRAMES):
        if frame in set(frames):
            return frames
    return frame
