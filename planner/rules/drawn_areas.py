"""What the areas of a drawing may mean besides what is certain of them."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

from planner.findings import Severity
from planner.geo.barrier import make_fence_frame
from planner.geo.fence import Fence, is_thin, make_fence_area, region_of
from planner.mission.formats.foreign import AREA_SIDE_UNKNOWN
from planner.rules.declaration import DRAWN, judges
from planner.rules.fence import flight_in_fence
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.geo.fence import FencePolygon
    from planner.geo.geodesy import LocalFrame
    from planner.rules.assessment import Assessment


@judges(AREA_SIDE_UNKNOWN, needs=(DRAWN,))
def _other_readings(a: Assessment, fence: Fence) -> Iterator[Finding]:
    """Yield what breaks another reading of the areas, of a flight that keeps the certain one."""
    if any(one.severity is Severity.ERROR for one in flight_in_fence(a)):
        return
    is_fenced = any(polygon.inclusion for polygon in fence.polygons)
    for reading in fence.readings:
        other = _each_of(a, reading) if is_fenced else reading
        if other is None:
            continue
        found = flight_in_fence(replace(a, mission=replace(a.mission, fence=other)))
        first = next((one for one in found if one.severity is Severity.ERROR), None)
        if first is not None:
            what = "each of the areas" if is_fenced else "the area of the work"
            yield a.finding(
                AREA_SIDE_UNKNOWN,
                f"nothing settles whether to stay inside {what}: {first.message}",
                item=first.item,
                stretch=first.stretch,
            )


def _each_of(a: Assessment, reading: Fence) -> Fence | None:
    """Return the fence of a flight that is inside each of the areas that have places in common.

    Of areas that have none, one is enough: each becomes one with all those that it has nothing to do with.
    ``None``: no two of them have any.
    """
    home = a.route.frame
    frame = make_fence_frame(reading, (home.latitude_deg, home.longitude_deg))
    insides = [polygon for polygon in reading.polygons if polygon.inclusion]
    regions = [_region(polygon, frame) for polygon in insides]
    names, group = [polygon.area for polygon in insides], list(range(len(insides)))
    for (one, first), (other, second) in combinations(enumerate(regions), 2):
        shared = first.intersection(second)
        if is_thin(shared):
            continue
        group = [group[one] if number == group[other] else number for number in group]
        # Parts of one are drawn beside each other: what lies within another of its name may be none.
        inner = other if second.area <= first.area else one
        if insides[one].area == insides[other].area and shared.area >= 0.5 * regions[inner].area:
            names[inner] = f"{insides[inner].area} {inner}"
    areas = dict.fromkeys(zip(group, names, strict=True))
    if len(areas) == len(set(group)):
        return None
    polygons = [
        replace(polygon, area=f"{own} {name}")
        for own, name in areas
        for polygon, its_group, its_name in zip(insides, group, names, strict=True)
        if its_group != own or its_name == name
    ]
    outs = [polygon for polygon in reading.polygons if not polygon.inclusion]
    return Fence(polygons=(*polygons, *outs))


def _region(polygon: FencePolygon, frame: LocalFrame) -> Any:  # noqa: ANN401 - shapely has no types
    """Return what a valid polygon encloses."""
    [barrier] = make_fence_area(Fence(polygons=(polygon,)), frame).barriers
    return region_of(barrier)
