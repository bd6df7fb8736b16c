"""Two missions item by item: what a transfer changed or lost.

Compared are meanings: frames that mean the same are one, places are rounded to the 10⁻⁷ degrees and
numbers to the four bytes that MAVLink has for them.  Home is left out: a vehicle has its own.
"""

from __future__ import annotations

import math
from difflib import SequenceMatcher
from enum import StrEnum
from itertools import zip_longest
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
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
from planner.mission.items import numbered_in_order
from planner.mission.storage import stored_hold_s, stored_radius_m, stored_turns
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.geo.fence import Fence, RallyPoint
    from planner.mission.items import Mission, MissionItem


_PLACE_DIGITS = 7
_CENTIMETRE_M = 0.0101
"""ArduPilot keeps altitudes in whole centimetres. [m]"""
_YAW_DEG = 0.01
"""PX4 keeps headings in radians. [°]"""
_RELATIVE = 1e-6
"""A number of four bytes has 24 bits."""


class DifferenceKind(StrEnum):
    """What a difference means for the flight."""

    CHANGED = "changed"
    MISSING = "missing"
    """In the first mission only."""
    ADDED = "added"
    """In the second mission only."""
    STORED = "stored"
    """As the autopilot stores it: rounded by a known rule, which a check reckons with."""
    UNUSED = "unused"
    """A value the autopilot does not keep, and does not fly by."""


class Difference(Value):
    """One thing that two missions do not have in common."""

    part: str
    """``mission``, ``fence`` or ``rally``."""
    number: int | None = None
    """Item, area or point, from 1, of the mission that has it."""
    field: str = ""
    """What differs; empty where the whole is missing or added."""
    first: float | str | None = None
    second: float | str | None = None
    kind: DifferenceKind
    message: str
    """One sentence."""

    @property
    def matters(self) -> bool:
        """Whether another flight may come of it."""
        return self.kind not in {DifferenceKind.STORED, DifferenceKind.UNUSED}


def _whole(part: str, number: int | None, kind: DifferenceKind, what: str) -> Difference:
    """Return that the whole of something is in one mission only."""
    where = "missing" if kind is DifferenceKind.MISSING else "in the second one only"
    return Difference(part=part, number=number, kind=kind, message=f"{what} is {where}")


def _place_key(value: float | None) -> int | None:
    """Return degrees as MAVLink counts them; equal where two places are."""
    return None if value is None else round(value * 10**_PLACE_DIGITS)


def _is_same_number(
    first: float | None, second: float | None, autopilot: Autopilot | None, *, is_yaw: bool = False
) -> bool:
    """Return whether two numbers are the same to an autopilot."""
    if first is None or second is None:
        # To ArduPilot a value that is not specified is 0; PX4 flies another way then.
        is_zero_none = autopilot is Autopilot.ARDUPILOT
        return first is second or (is_zero_none and not first and not second)
    if is_yaw:
        return abs(math.remainder(first - second, 360.0)) <= _YAW_DEG
    return math.isclose(first, second, rel_tol=_RELATIVE, abs_tol=1e-9)


def _is_same_altitude(
    first: float | None, second: float | None, autopilot: Autopilot | None
) -> bool:
    """Return whether two altitudes [m] are the same to an autopilot."""
    if first is not None and second is not None and autopilot is Autopilot.ARDUPILOT:
        return abs(first - second) <= _CENTIMETRE_M
    return _is_same_number(first, second, autopilot)


def _shown(value: float | str | None) -> str:
    if value is None:
        return "not specified"
    return value if isinstance(value, str) else f"{value:.10g}"


def _compare_fences(
    first: Fence | None, second: Fence | None, autopilot: Autopilot | None
) -> Iterator[Difference]:
    """Yield what differs between two fences; the order of their areas does not."""
    ours, theirs = _areas(first), _areas(second)
    for areas, others, kind in (
        (ours, theirs, DifferenceKind.MISSING),
        (theirs, ours, DifferenceKind.ADDED),
    ):
        left = list(others)
        for number, area in enumerate(areas, start=1):
            if area in left:
                left.remove(area)
            else:
                yield _whole("fence", number, kind, f"area {number} of the fence ({area[0]})")
    back = None if first is None else first.breach_return_deg_m
    other_back = None if second is None else second.breach_return_deg_m
    if _point(back) != _point(other_back) and autopilot is not Autopilot.PX4:
        yield Difference(
            part="fence",
            field="breach_return",
            first=_shown_place(back),
            second=_shown_place(other_back),
            kind=DifferenceKind.CHANGED,
            message=f"the fence's return point is {_shown_place(back)}, then "
            f"{_shown_place(other_back)}",
        )


def _areas(fence: Fence | None) -> list[tuple[str, tuple[object, ...]]]:
    """Return the areas of a fence as values that are equal where the areas are."""
    if fence is None:
        return []
    areas: list[tuple[str, tuple[object, ...]]] = []
    for polygon in fence.polygons:
        vertices = tuple(
            (_place_key(north), _place_key(east)) for north, east in polygon.vertices_deg
        )
        areas.append((f"{'keep in' if polygon.inclusion else 'keep out'}, polygon", vertices))
    for circle in fence.circles:
        centre = (_place_key(circle.latitude_deg), _place_key(circle.longitude_deg))
        what = (*centre, round(circle.radius_m, 2))
        areas.append((f"{'keep in' if circle.inclusion else 'keep out'}, circle", what))
    return areas


def _compare_rally_points(
    first: Sequence[RallyPoint], second: Sequence[RallyPoint], autopilot: Autopilot | None
) -> Iterator[Difference]:
    """Yield what differs between two lists of rally points, point by point."""
    for number, (one, other) in enumerate(zip_longest(first, second), start=1):
        what = f"rally point {number}"
        if one is None or other is None:
            kind = DifferenceKind.MISSING if other is None else DifferenceKind.ADDED
            yield _whole("rally", number, kind, what)
            continue
        for field in ("latitude_deg", "longitude_deg", "height_above_home_m"):
            ours, theirs = getattr(one, field), getattr(other, field)
            is_height = field == "height_above_home_m"
            if (
                _is_same_altitude(ours, theirs, autopilot)
                if is_height
                else _place_key(ours) == _place_key(theirs)
            ):
                continue
            # ArduPilot keeps a rally point's height in whole metres.
            is_stored = is_height and autopilot is Autopilot.ARDUPILOT and int(ours) == theirs
            yield Difference(
                part="rally",
                number=number,
                field=field,
                first=ours,
                second=theirs,
                kind=DifferenceKind.STORED if is_stored else DifferenceKind.CHANGED,
                message=f"{what}: {field} is {_shown(ours)}, then {_shown(theirs)}",
            )


def _point(place: tuple[float, float, float | None] | None) -> tuple[object, ...] | None:
    return None if place is None else (_place_key(place[0]), _place_key(place[1]), place[2] or 0.0)


def _shown_place(place: tuple[float, float, float | None] | None) -> str:
    return "none" if place is None else f"{place[0]:.7f}°, {place[1]:.7f}°"


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
    """Return what differs between a mission as it was meant and as it came out of a vehicle.

    The autopilot stored the second one; ``None``: nobody did, nothing may differ.
    """
    return (
        *_compare_items(first.items, second.items, autopilot),
        *_compare_fences(first.fence, second.fence, autopilot),
        *_compare_rally_points(first.rally, second.rally, autopilot),
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
            yield _whole("mission", number, kind, what)
        else:
            yield from _compare_pair(one, other, autopilot)


def _pairs(
    first: Sequence[MissionItem], second: Sequence[MissionItem]
) -> Iterator[tuple[MissionItem | None, MissionItem | None]]:
    """Yield items that belong together; where some are missing, by what they do and where."""
    if len(first) == len(second):
        yield from zip(first, second, strict=True)
        return
    ours, theirs = ([_identity(item) for item in items] for items in (first, second))
    matcher = SequenceMatcher(None, ours, theirs, autojunk=False)
    for _, start, end, other_start, other_end in matcher.get_opcodes():
        yield from zip_longest(first[start:end], second[other_start:other_end])


def _identity(item: MissionItem) -> tuple[object, ...]:
    return item.command, _place_key(item.latitude_deg), _place_key(item.longitude_deg)


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
        if not _is_same_number(first, second, autopilot, is_yaw=is_yaw):
            kind = _parameter_kind(one.command, position, first, second, autopilot)
            yield _difference(one, field, (first, second), kind, autopilot)
    for name, field in zip(names[4:], ("latitude_deg", "longitude_deg", "altitude_m"), strict=True):
        first, second = getattr(one, field), getattr(other, field)
        if field == "altitude_m":
            is_same = _is_same_altitude(first, second, autopilot)
        elif _has_place(one):
            is_same = _place_key(first) == _place_key(second)
        else:
            is_same = _is_same_number(first, second, autopilot)
        if not is_same:
            kind = changed if _has_place(one) or name else unused
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
    change = f"{field} is {_shown(first)}, then {_shown(second)}"
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
            *(Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT, Command.NAV_LOITER_TIME)
        }:
            stored = stored_hold_s(first)
        if stored is not None and math.isclose(stored, second, rel_tol=_RELATIVE, abs_tol=1e-9):
            return DifferenceKind.STORED
    return DifferenceKind.CHANGED


def _reference(frame: int) -> object:
    """Return what a frame counts altitudes from; the frame itself where it is another kind."""
    for frames in (AMSL_FRAMES, RELATIVE_FRAMES, TERRAIN_FRAMES):
        if frame in set(frames):
            return frames
    return frame
