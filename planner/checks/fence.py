"""Rules on the fence itself: areas that enclose nothing, inclusions without a place in common."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.geo.local_frame import LocalFrame
from planner.vehicle.ardupilot_parameters import ArduPilotParameters

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.checks.case import Case
    from planner.findings import Finding
    from planner.geo.fence import Fence

_ONE_INCLUSION_IS_ENOUGH = 2
"""Bit of ArduPilot's FENCE_OPTIONS."""


def check_fence_validity(case: Case) -> Iterator[Finding]:
    """Yield what is wrong with the fence as a geometry, wherever the mission flies."""
    fence = case.mission.fence
    if not fence:
        return
    from planner.geo.fence_area import make_fence_area  # shapely takes time to load

    parameters = case.parameters
    unite = isinstance(parameters, ArduPilotParameters) and bool(
        parameters.fence_options & _ONE_INCLUSION_IS_ENOUGH
    )
    yield from make_fence_area(fence, _frame_at(fence), inclusions_unite=unite).findings


def _frame_at(fence: Fence) -> LocalFrame:
    """Return a local frame at a fence, which may lie far from home."""
    places = [vertex for polygon in fence.polygons for vertex in polygon.vertices_deg]
    places += [(circle.latitude_deg, circle.longitude_deg) for circle in fence.circles]
    latitude_deg, longitude_deg = places[0]
    return LocalFrame(latitude_deg=latitude_deg, longitude_deg=longitude_deg)
