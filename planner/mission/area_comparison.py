"""Two fences, and two lists of rally points, compared as autopilots keep them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.mission.difference import (
    Difference,
    DifferenceKind,
    is_same_altitude,
    place_key,
    shown,
    whole_difference,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.geo.fence import Fence, RallyPoint


def compare_fences(
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
                yield whole_difference(
                    "fence", number, kind, f"area {number} of the fence ({area[0]})"
                )
    back = None if first is None else first.breach_return_deg_m
    other_back = None if second is None else second.breach_return_deg_m
    if _point(back) != _point(other_back) and autopilot is not Autopilot.PX4:
        yield Difference(
            part="fence",
            number=None,
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
            (place_key(north), place_key(east)) for north, east in polygon.vertices_deg
        )
        areas.append((f"{'keep in' if polygon.inclusion else 'keep out'}, polygon", vertices))
    for circle in fence.circles:
        centre = (place_key(circle.latitude_deg), place_key(circle.longitude_deg))
        what = (*centre, round(circle.radius_m, 2))
        areas.append((f"{'keep in' if circle.inclusion else 'keep out'}, circle", what))
    return areas


def compare_rally_points(
    first: Sequence[RallyPoint], second: Sequence[RallyPoint], autopilot: Autopilot | None
) -> Iterator[Difference]:
    """Yield what differs between two lists of rally points, point by point."""
    for number in range(1, max(len(first), len(second)) + 1):
        what = f"rally point {number}"
        if number > len(second):
            yield whole_difference("rally", number, DifferenceKind.MISSING, what)
            continue
        if number > len(first):
            yield whole_difference("rally", number, DifferenceKind.ADDED, what)
            continue
        one, other = first[number - 1], second[number - 1]
        for field in ("latitude_deg", "longitude_deg", "height_above_home_m"):
            ours, theirs = getattr(one, field), getattr(other, field)
            if field == "height_above_home_m":
                if is_same_altitude(ours, theirs, autopilot):
                    continue
                # ArduPilot keeps a rally point's height in whole metres.
                is_stored = autopilot is Autopilot.ARDUPILOT and int(ours) == theirs
            elif place_key(ours) == place_key(theirs):
                continue
            else:
                is_stored = False
            kind = DifferenceKind.STORED if is_stored else DifferenceKind.CHANGED
            yield Difference(
                part="rally",
                number=number,
                field=field,
                first=ours,
                second=theirs,
                kind=kind,
                message=f"{what}: {field} is {shown(ours)}, then {shown(theirs)}",
            )


def _point(place: tuple[float, float, float | None] | None) -> tuple[object, ...] | None:
    return None if place is None else (place_key(place[0]), place_key(place[1]), place[2] or 0.0)


def _shown_place(place: tuple[float, float, float | None] | None) -> str:
    return "none" if place is None else f"{place[0]:.7f}°, {place[1]:.7f}°"
