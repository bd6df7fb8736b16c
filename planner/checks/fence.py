"""Rules on the fence: areas that enclose nothing, and straight legs that leave what is allowed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers
from planner.catalogue.fence import FENCE_IN_PART, PATH_CROSSES
from planner.geo.local_frame import LocalFrame

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.checks.case import Case
    from planner.findings import Finding
    from planner.geo.fence import Fence

_ONE_INCLUSION_IS_ENOUGH = 2
"""Bit of ArduPilot's FENCE_OPTIONS."""


def check_fence(case: Case) -> Iterator[Finding]:
    """Yield what is wrong with the fence as a geometry, and where straight legs leave it."""
    fence = case.mission.fence
    if not fence:
        return
    from planner.geo.fence_area import make_fence_area  # shapely takes time to load
    from planner.vehicle.ardupilot_parameters import ArduPilotParameters

    parameters = case.parameters
    unite = isinstance(parameters, ArduPilotParameters) and bool(
        parameters.fence_options & _ONE_INCLUSION_IS_ENOUGH
    )
    frame = _frame_at(fence)
    area = make_fence_area(fence, frame, inclusions_unite=unite)
    yield from area.findings
    stages = case.route.stages
    if not stages:
        return
    places = case.route.frame.latitude_longitude_deg(
        [0.0, *(s.east_m for s in stages)], [0.0, *(s.north_m for s in stages)]
    )
    stretches = area.stretches_outside(*frame.east_north_m(*places))
    if stretches:
        first = stretches[0]
        item = stages[min(first.leg, len(stages) - 1)].item
        outside_m = sum(stretch.end_m - stretch.start_m for stretch in stretches)
        yield PATH_CROSSES.finding(
            f"the straight way to here is beyond {first.barrier.label}; "
            f"{numbers.distance(outside_m)} of the mission's legs are outside the fence",
            item=item,
            place=case.mission.items[item - 1].place,
        )
    yield FENCE_IN_PART.finding(
        "straight legs are checked against the fence; curves, the way home, heights and the room "
        "to stop are not"
    )


def _frame_at(fence: Fence) -> LocalFrame:
    """Return a local frame at a fence, which may lie far from home."""
    places = [vertex for polygon in fence.polygons for vertex in polygon.vertices_deg]
    places += [(circle.latitude_deg, circle.longitude_deg) for circle in fence.circles]
    latitude_deg, longitude_deg = places[0]
    return LocalFrame(latitude_deg=latitude_deg, longitude_deg=longitude_deg)
