"""One area of a fence as geometry: how far inside of it straight legs stay, and where they leave.

A barrier is passed by nothing: an inclusion area from inside, an exclusion area from outside.
Its signed distance is positive on the allowed side.  Everything here is computed from whole legs
and whole edges, never from samples along them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from planner.errors import PathTooLongError
from planner.geo.geodesy import LocalFrame, distance_m
from planner.values import Value

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import FloatArray, IndexArray
    from planner.findings import Place
    from planner.geo.fence import Fence


_DEPTH_TOLERANCE_M = 0.01
_MOST_CUTS = 10_000_000
"""Pairs of legs and edges to cut: some 5 s; 40,000 legs across the 250 edges an autopilot has room for."""


class LegClearance(Value, kw_only=False, eq=False):
    """The least signed distance of each of n legs to a barrier, and its place."""

    clearance_m: FloatArray
    """Negative where the leg passes the barrier: how deep. Shape (n,). [m]"""
    along_m: FloatArray
    """Where on the leg, from its start. Shape (n,). [m]"""


class LegSpans(Value, kw_only=False, eq=False):
    """The pieces of legs on the wrong side of a barrier."""

    leg: IndexArray
    """Index of the leg of each piece, rising. Shape (k,)."""
    start_m: FloatArray
    """Start of the piece, from the start of its leg. Shape (k,). [m]"""
    end_m: FloatArray
    """End of the piece, from the start of its leg. Shape (k,). [m]"""


class CircleBarrier(Value):
    """A circle, computed exactly."""

    label: str
    """What a message calls it, such as ``exclusion circle 2``."""
    place: Place | None
    keep_inside: bool
    """``True``: stay inside; ``False``: keep out."""
    east_m: float
    north_m: float
    radius_m: float

    def signed_distance_m(self, points_m: FloatArray) -> FloatArray:
        """Distance of points to the circle, positive on the allowed side."""
        outside: FloatArray = np.hypot(*(points_m - self._centre_m).T) - self.radius_m
        return -outside if self.keep_inside else outside

    def leg_clearance(self, legs: PathLegs) -> LegClearance:
        """Return the least signed distance of each leg: at an end, or at the foot of the centre."""
        if self.keep_inside:
            at_start, at_end = (self.signed_distance_m(p) for p in (legs.start_m, legs.end_m))
            along = np.where(at_start <= at_end, 0.0, legs.length_m)
            return LegClearance(np.minimum(at_start, at_end), along)
        foot = np.clip(self._foot_m(legs), 0.0, legs.length_m)
        return LegClearance(self.signed_distance_m(legs.point_m(foot)), foot)

    def spans_outside(self, legs: PathLegs) -> LegSpans:
        """Return the pieces of legs beyond the circle: the roots of |start + t u − centre| = r."""
        foot = self._foot_m(legs)
        offset = self._centre_m - legs.start_m
        half_chord_squared = self.radius_m**2 - (np.sum(offset**2, axis=1) - foot**2)
        half_chord = np.sqrt(np.maximum(half_chord_squared, 0.0))
        first = np.clip(foot - half_chord, 0.0, legs.length_m)
        last = np.clip(foot + half_chord, 0.0, legs.length_m)
        leg = np.arange(len(foot))
        zero = np.zeros_like(foot)
        if self.keep_inside:
            leg = np.concatenate([leg, leg])
            start, end = np.concatenate([zero, last]), np.concatenate([first, legs.length_m])
        else:
            start, end = first, last
        # The test in the middle of a piece also covers a leg that stands still or stays clear.
        middle = legs.point_m((start + end) / 2.0, leg)
        standing = legs.length_m[leg] == 0.0
        beyond = (self.signed_distance_m(middle) < 0.0) & ((end > start) | standing)
        return _sorted_spans(leg[beyond], start[beyond], end[beyond])

    @property
    def _centre_m(self) -> FloatArray:
        return np.array([self.east_m, self.north_m])

    def _foot_m(self, legs: PathLegs) -> FloatArray:
        """Where on the line of each leg the centre is nearest, in metres from the leg's start."""
        length = np.where(legs.length_m > 0.0, legs.length_m, 1.0)
        along: FloatArray = np.sum(
            (self._centre_m - legs.start_m) * (legs.end_m - legs.start_m), axis=1
        )
        return along / length


class PolygonBarrier(Value, eq=False):
    """A polygon (or several, where a union has several parts).  See :func:`polygon_barrier`."""

    label: str
    """What a message calls it, such as ``inclusion polygon 1``."""
    place: Place | None
    keep_inside: bool
    """``True``: stay inside; ``False``: keep out."""
    region: Any  # shapely.Polygon | shapely.MultiPolygon, untyped
    """The area in local metres, prepared."""
    boundary: Any  # shapely.LineString | shapely.MultiLineString
    """Its boundary, prepared."""
    edges: Any  # shapely.STRtree
    """The straight edges of its boundary, indexed."""

    def signed_distance_m(self, points_m: FloatArray) -> FloatArray:
        """Distance of points to the boundary, positive on the allowed side."""
        import shapely

        distance, _ = self._edge_distance_m(points_m)
        inside = shapely.intersects_xy(self.region, points_m[:, 0], points_m[:, 1])
        return np.where(inside == self.keep_inside, distance, -distance)

    def leg_clearance(self, legs: PathLegs) -> LegClearance:
        """Return the least signed distance of each leg; a depth is right within 1 cm."""
        import shapely

        clearance, along = np.empty(len(legs.length_m)), np.empty(len(legs.length_m))
        outside = self.spans_outside(legs)
        inside = np.setdiff1d(np.arange(len(clearance)), outside.leg)
        lines = _lines(legs)[inside]
        nearest = self.edges.geometries[self.edges.nearest(lines)]
        clearance[inside] = shapely.distance(lines, nearest)
        touch = shapely.get_coordinates(shapely.shortest_line(lines, nearest))[::2]
        along[inside] = np.hypot(*(touch - legs.start_m[inside]).T)
        if len(outside.leg):
            start = legs.point_m(outside.start_m, outside.leg)
            depth, fraction = self._greatest_depth_m(
                start, legs.point_m(outside.end_m, outside.leg)
            )
            where = outside.start_m + fraction * (outside.end_m - outside.start_m)
            deepest_last = np.argsort(depth, kind="stable")
            leg = outside.leg[deepest_last]
            clearance[leg] = -depth[deepest_last]
            along[leg] = where[deepest_last]
        return LegClearance(clearance, along)

    def spans_outside(self, legs: PathLegs) -> LegSpans:
        """Return the pieces of legs on the wrong side, by cutting each leg with the polygon.

        Raises `PathTooLongError` of more legs and edges than can be cut with each other.
        """
        import shapely

        lines = _lines(legs)
        passes = shapely.intersects(self.region, lines)
        if self.keep_inside:
            passes = ~shapely.covers(self.region, lines)
        leg = np.flatnonzero(passes)
        if len(leg) * len(self.edges) > _MOST_CUTS:
            what = f"{len(leg):,} legs that pass an area of {len(self.edges):,} edges"
            raise PathTooLongError(what)
        if self.keep_inside:
            pieces = shapely.difference(lines[leg], self.region)
        else:
            leg = leg[~shapely.touches(self.region, lines[leg])]
            pieces = shapely.intersection(lines[leg], self.region)
        parts, owner = shapely.get_parts(pieces, return_index=True)
        straight = shapely.length(parts) > 0.0
        parts, leg = parts[straight], leg[owner[straight]]
        ends = [
            np.hypot(*(shapely.get_coordinates(shapely.get_point(parts, i)) - legs.start_m[leg]).T)
            for i in (0, -1)
        ]
        standing = np.flatnonzero(legs.length_m == 0.0)
        standing = standing[self.signed_distance_m(legs.start_m[standing]) < 0.0]
        zero = np.zeros(len(standing))
        return _sorted_spans(
            np.concatenate([leg, standing]),
            np.concatenate([np.minimum(*ends), zero]),
            np.concatenate([np.maximum(*ends), zero]),
        )

    def _edge_distance_m(self, points_m: FloatArray) -> tuple[FloatArray, Any]:
        """Distance of points to the nearest edge, and that edge. [n]."""
        import shapely

        points = shapely.points(points_m)
        edge = self.edges.geometries[self.edges.nearest(points)]
        return np.asarray(shapely.distance(points, edge), np.float64), edge

    def _greatest_depth_m(
        self, start_m: FloatArray, end_m: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Greatest distance to the boundary along segments, and where (as a fraction).

        Branch and bound.  The distance to any one edge is convex along a segment, so that over
        an interval the distance to the boundary is at most the greater of the distances of the
        interval's ends to the edge nearest its middle.
        """
        import shapely

        at_start, _ = self._edge_distance_m(start_m)
        at_end, _ = self._edge_distance_m(end_m)
        best = np.maximum(at_start, at_end)
        fraction = np.where(at_start >= at_end, 0.0, 1.0)
        owner = np.arange(len(start_m))
        low, high = np.zeros(len(owner)), np.ones(len(owner))
        while len(owner):
            ends = [
                start_m[owner] + (end_m - start_m)[owner] * t[:, None]
                for t in (low, (low + high) / 2.0, high)
            ]
            middle, edge = self._edge_distance_m(ends[1])
            order = np.argsort(middle, kind="stable")
            deeper = order[middle[order] > best[owner[order]]]
            best[owner[deeper]] = middle[deeper]
            fraction[owner[deeper]] = ((low + high) / 2.0)[deeper]
            at_ends = (shapely.distance(shapely.points(ends[n]), edge) for n in (0, 2))
            bound = np.maximum(*at_ends)
            open_ = bound > best[owner] + _DEPTH_TOLERANCE_M
            low, high, owner = low[open_], high[open_], np.tile(owner[open_], 2)
            half = (low + high) / 2.0
            low, high = np.concatenate([low, half]), np.concatenate([half, high])
        return best, fraction


Barrier: TypeAlias = PolygonBarrier | CircleBarrier


def polygon_barrier(
    region: Any,  # noqa: ANN401 - shapely has no types
    *,
    keep_inside: bool,
    label: str,
    place: Place | None = None,
) -> PolygonBarrier:
    """Return the barrier of a valid, non-empty polygon or multipolygon in local metres."""
    import shapely

    boundary = shapely.boundary(region)
    shapely.prepare((region, boundary))
    rings = shapely.get_parts(boundary)
    points, ring = shapely.get_coordinates(rings, return_index=True)
    edges = np.stack([points[:-1], points[1:]], axis=1)[ring[:-1] == ring[1:]]
    return PolygonBarrier(
        label=label,
        place=place,
        keep_inside=keep_inside,
        region=region,
        boundary=boundary,
        edges=shapely.STRtree(shapely.linestrings(edges)),
    )


def _lines(legs: PathLegs) -> Any:  # noqa: ANN401 - an array of shapely's, which has no types
    import shapely

    return shapely.linestrings(np.stack([legs.start_m, legs.end_m], axis=1))


def _sorted_spans(leg: IndexArray, start_m: FloatArray, end_m: FloatArray) -> LegSpans:
    order = np.lexsort((start_m, leg))
    return LegSpans(leg[order], start_m[order], end_m[order])


_NEAR_HOME_M = 50_000.0
"""A fence this near home is drawn in the frame of home: distances are 1 cm in a kilometre true. [m]"""


def make_fence_frame(fence: Fence, home_deg: tuple[float, float] | None) -> LocalFrame:
    """Return the frame of home, or one at a fence that is far from it or has no home. [°]"""
    places = [vertex for polygon in fence.polygons for vertex in polygon.vertices_deg]
    places += [(circle.latitude_deg, circle.longitude_deg) for circle in fence.circles]
    sane = [place for place in places if abs(place[0]) <= 90.0 and abs(place[1]) <= 180.0]
    if home_deg is None:
        home_deg = sane[0] if sane else (0.0, 0.0)
    elif sane and np.max(distance_m(*home_deg, *np.array(sane).T)) >= _NEAR_HOME_M:
        home_deg = sane[0]
    return LocalFrame(latitude_deg=home_deg[0], longitude_deg=home_deg[1])


class PathLegs(Value, kw_only=False, eq=False):
    """The straight legs of a path of n + 1 points in a local frame."""

    start_m: FloatArray
    """East and north of the starts, shape (n, 2). [m]"""
    end_m: FloatArray
    """East and north of the ends, shape (n, 2). [m]"""
    length_m: FloatArray
    """Lengths, shape (n,). [m]"""

    def point_m(self, along_m: FloatArray, leg: IndexArray | slice = slice(None)) -> FloatArray:
        """East and north of the points so far from the start of each leg, shape (n, 2)."""
        length = np.where(self.length_m[leg] > 0.0, self.length_m[leg], 1.0)
        step = (self.end_m[leg] - self.start_m[leg]) * (along_m / length)[:, None]
        return self.start_m[leg] + step


def path_legs(east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> PathLegs:
    """Return the legs of the path through points of a local frame.

    Raises ValueError if there are fewer than two points, or one is not finite.
    """
    points = np.column_stack([np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)])
    if len(points) < 2 or not np.all(np.isfinite(points)):
        msg = "a path needs two finite points or more"
        raise ValueError(msg)
    start, end = points[:-1], points[1:]
    length = np.hypot(*(end - start).T)
    # A leg shorter than a nanometre stands still: its direction would be rounding.
    length = np.where(length > 1e-9, length, 0.0)
    return PathLegs(start, np.where(length[:, None] > 0.0, end, start), length)


class SweptAreas(Value, eq=False):
    """Convex areas in local metres, each the hull of its points.  See :func:`swept_areas`."""

    points_m: FloatArray
    """East and north of all points. (m, 2) [m]"""
    first: IndexArray
    """Index of the first point of each area. (n,)"""
    hulls: Any
    """Polygons, lines or points of shapely, which has no types. (n,)"""

    def near(self, barrier: Barrier, margin_m: float) -> npt.NDArray[np.bool_]:
        """Whether some place of each area is within a margin of a barrier, or beyond it. [n]."""
        import shapely

        if isinstance(barrier, CircleBarrier):
            centre = np.array([barrier.east_m, barrier.north_m])
            if barrier.keep_inside:  # the farthest place of a hull is one of its points
                away = np.hypot(*(self.points_m - centre).T)
                farthest = np.maximum.reduceat(away, self.first)
                return np.asarray(farthest > barrier.radius_m - margin_m)
            distance = shapely.distance(self.hulls, shapely.Point(centre))
            return np.asarray(distance < barrier.radius_m + margin_m)
        start = self.points_m[self.first]
        near = (
            shapely.intersects_xy(barrier.region, start[:, 0], start[:, 1]) != barrier.keep_inside
        )
        return np.asarray(near | shapely.dwithin(barrier.boundary, self.hulls, margin_m))


def swept_areas(points_m: FloatArray, owner: IndexArray) -> SweptAreas:
    """Return the convex hulls of points, each of the area that owns it, in any order, counted from 0.

    Each area has two points or more.
    """
    import shapely

    order = np.argsort(owner, kind="stable")
    # Places nearer than a nanometre are one: GEOS divides by the square of a side of a hull.
    points, owner = points_m[order].round(9), owner[order]
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return SweptAreas(
        points_m=points,
        first=first,
        # A line through the points has their hull, and is made faster than a set of them.
        hulls=shapely.convex_hull(shapely.linestrings(points, indices=owner)),
    )
