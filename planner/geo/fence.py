"""The fence and the rally points of a mission, as values in degrees."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.findings import Place


@frozen
class FencePolygon:
    """One polygon of a fence; its edges are straight in latitude and longitude."""

    inclusion: bool
    """``True``: stay inside; ``False``: keep out."""
    vertices_deg: tuple[tuple[float, float], ...]
    """(latitude, longitude) of each vertex, not closed. [°]"""
    place: Place | None = None


@frozen
class FenceCircle:
    """One circle of a fence."""

    inclusion: bool
    """``True``: stay inside; ``False``: keep out."""
    latitude_deg: float
    longitude_deg: float
    radius_m: float
    place: Place | None = None


@frozen
class Fence:
    """Every area of a mission's fence."""

    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()
    breach_return_deg_m: tuple[float, float, float | None] | None = None
    """(latitude °, longitude °, altitude above home m) to return to after a breach."""

    @property
    def area_count(self) -> int:
        """Polygons and circles."""
        return len(self.polygons) + len(self.circles)

    def __bool__(self) -> bool:
        return bool(self.polygons or self.circles)


@frozen
class RallyPoint:
    """A place to return to instead of home."""

    latitude_deg: float
    longitude_deg: float
    height_above_home_m: float
    place: Place | None = None
