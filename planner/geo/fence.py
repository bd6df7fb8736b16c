"""The fence and the rally points of a mission, as values in degrees."""

from __future__ import annotations

import math
from itertools import combinations, pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.geo.barrier import Barrier, CircleBarrier, path_legs, polygon_barrier
from planner.values import Value, replace

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import FloatArray, IndexArray
    from planner.findings import Finding, Place
    from planner.geo.geodesy import LocalFrame


class FencePolygon(Value):
    """One polygon of a fence; its edges are straight in latitude and longitude."""

    inclusion: bool
    """``True``: stay inside; ``False``: keep out."""
    vertices_deg: tuple[tuple[float, float], ...]
    """(latitude, longitude) of each vertex, not closed. [°]"""
    place: Place | None = None
    area: str = ""
    """Area to stay inside that it is a part of: being in one part is enough; empty: one of its own."""


class FenceCircle(Value):
    """One circle of a fence."""

    inclusion: bool
    """``True``: stay inside; ``False``: keep out."""
    latitude_deg: float
    longitude_deg: float
    radius_m: float
    place: Place | None = None


class Fence(Value):
    """Every area of a mission's fence."""

    polygons: tuple[FencePolygon, ...] = ()
    circles: tuple[FenceCircle, ...] = ()
    breach_return_deg_m: tuple[float, float, float | None] | None = None
    """(latitude °, longitude °, altitude above home m) to return to after a breach."""
    readings: tuple[Fence, ...] = ()
    """What else the areas of a drawing may mean, none of it certain."""

    @property
    def as_held(self) -> Fence:
        """As a vehicle holds it: no area is a part of another, each has to be kept."""
        alone = tuple(replace(polygon, area="") for polygon in self.polygons)
        return replace(self, polygons=alone)

    @property
    def area_count(self) -> int:
        """Polygons and circles."""
        return len(self.polygons) + len(self.circles)

    def __bool__(self) -> bool:
        return bool(self.polygons or self.circles)


class RallyPoint(Value, kw_only=False):
    """A place to return to instead of home."""

    latitude_deg: float
    longitude_deg: float
    height_above_home_m: float
    place: Place | None = None


OUTLINE_TOLERANCE_M = 0.01
"""How far a drawn edge may be from the true one. [m]"""

# Probes at the quarters may miss the worst place of a piece by a little: half is asked of them.
_PROBE_TOLERANCE_M = OUTLINE_TOLERANCE_M / 2.0
# A 20 km edge needs 5 halvings, one around half the globe 15.
_MOST_HALVINGS = 18
# MAVLink sends positions as whole multiples of this. [°]
_RESOLUTION_DEG = 1e-7


def is_position(latitude_deg: float, longitude_deg: float) -> bool:
    """Whether latitude and longitude are a place on the Earth (NaN is none)."""
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0


def distinct_vertices_deg(
    vertices_deg: tuple[tuple[float, float], ...],
) -> tuple[tuple[float, float], ...]:
    """Return the vertices without those that repeat the one before; the last precedes the first.

    Vertices are one where they are sent as the same numbers: rounded to 1e-7°, about 1 cm.
    """
    sent = [tuple(round(angle / _RESOLUTION_DEG) for angle in vertex) for vertex in vertices_deg]
    return tuple(vertex for i, vertex in enumerate(vertices_deg) if sent[i] != sent[i - 1])


def edge_points_m(
    vertices_deg: tuple[tuple[float, float], ...],
    frame: LocalFrame,
    ardupilot_origin: LocalFrame | None = None,
) -> tuple[FloatArray, IndexArray]:
    """Return points along a polygon's edges, close enough to replace them.

    Edges are straight in latitude and longitude, the short way round; in a frame of metres they
    bow (8.4 m in 20 km along the 47th parallel, PX4 #28759).  ArduPilot's are straight in its own
    metres (:mod:`planner.geo.geodesy`).  Each is halved until its pieces are within
    :data:`OUTLINE_TOLERANCE_M` of it.

    ArduPilot's metres are counted from an origin; without one, edges are straight in degrees.  Points
    are east and north from the first vertex on, not closed, (n, 2) [m]; with each comes the edge it begins
    or lies on, from 0.
    """
    corners = np.array([*vertices_deg, vertices_deg[0]], np.float64)
    step = np.diff(corners[:, 1])
    longitude = np.concatenate([corners[:1, 1], step - 360.0 * np.round(step / 360.0)]).cumsum()
    index = np.arange(len(corners))
    linear = longitude
    if ardupilot_origin is not None:
        turn = longitude[0] - ardupilot_origin.longitude_deg
        longitude = longitude - ardupilot_origin.longitude_deg - 360.0 * np.round(turn / 360.0)
        linear = longitude * _mean_cosine(corners[:, 0], ardupilot_origin)

    def points_m(t: FloatArray) -> FloatArray:
        latitude_deg, longitude_deg = (np.interp(t, index, c) for c in (corners[:, 0], linear))
        if ardupilot_origin is not None:
            longitude_deg = longitude_deg / _mean_cosine(latitude_deg, ardupilot_origin)
            longitude_deg += ardupilot_origin.longitude_deg
        east, north = frame.east_north_m(latitude_deg, longitude_deg)
        return np.stack([east, north], axis=-1)

    low, high = index[:-1].astype(np.float64), index[1:].astype(np.float64)
    done = []
    for _ in range(_MOST_HALVINGS):
        quarters = low + (high - low) * np.array([[0.0], [0.25], [0.5], [0.75], [1.0]])
        true = points_m(quarters)
        chord = true[4] - true[0]
        length = np.hypot(chord[:, 0], chord[:, 1])
        across = np.stack([-chord[:, 1], chord[:, 0]], axis=-1)
        across /= np.where(length > 0.0, length, 1.0)[:, None]
        bow = np.max(np.abs(np.sum((true[1:4] - true[0]) * across, axis=-1)), axis=0)
        rough = bow > _PROBE_TOLERANCE_M
        done.append(low[~rough])
        low, half, high = low[rough], quarters[2][rough], high[rough]
        low, high = np.concatenate([low, half]), np.concatenate([half, high])
        if not len(low):
            break
    t = np.sort(np.concatenate([*done, low]))
    return points_m(t), np.floor(t).astype(np.intp)


def _mean_cosine(latitude_deg: FloatArray, origin: LocalFrame) -> FloatArray:
    """Return the cosine of the mean of latitudes and the origin's, 0.01 at least, as ArduPilot."""
    mean: FloatArray = np.radians(0.5 * (latitude_deg + origin.latitude_deg))
    return np.maximum(np.cos(mean), 0.01)


def is_thin(region: Any) -> bool:  # noqa: ANN401 - shapely has no types
    """Whether a region in local metres is no wider than what edges are known to."""
    return bool(region.area <= OUTLINE_TOLERANCE_M * region.length)


def outline_problem(points_m: FloatArray, edge: IndexArray) -> str | None:
    """Return what keeps an outline from enclosing an area, ``None`` where nothing does."""
    import shapely

    region = shapely.Polygon(points_m)
    if not region.is_valid and (crossing := _first_crossing(points_m, edge)) is not None:
        i, j = crossing
        return f"crosses itself: the edge after vertex {i} meets that after vertex {j}"
    if is_thin(region):
        return "encloses no area"
    if not region.is_valid or _folds_back(points_m):
        return "folds back on itself"
    return None


def _first_crossing(points_m: FloatArray, edge: IndexArray) -> tuple[int, int] | None:
    """Return the vertices, from 1, after which two edges begin that meet but are no neighbours."""
    import shapely

    closed = np.concatenate([points_m, points_m[:1]])
    starts = np.searchsorted(edge, np.arange(edge[-1] + 2))
    edges = [shapely.LineString(closed[first : last + 1]) for first, last in pairwise(starts)]
    first, second = shapely.STRtree(edges).query(edges, predicate="intersects")
    apart = (second - first > 1) & (second - first < len(edges) - 1)
    pairs = sorted(zip((first[apart] + 1).tolist(), (second[apart] + 1).tolist(), strict=True))
    return pairs[0] if pairs else None


def _folds_back(points_m: FloatArray) -> bool:
    """Whether an edge returns along the one before it, to within what edges are known to."""
    before, after = (np.roll(points_m, step, axis=0) - points_m for step in (1, -1))
    longer = np.maximum(np.hypot(*before.T), np.hypot(*after.T))
    crossed = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    apart = crossed / np.where(longer > 0.0, longer, 1.0)
    return bool(np.any((np.sum(before * after, axis=1) > 0.0) & (apart <= OUTLINE_TOLERANCE_M)))


# Where circles have to become polygons (unions, emptiness): inscribed, within this of the circle.
_CIRCLE_TOLERANCE_M = 0.001
# Gaps up to twice this between areas drawn edge to edge are closed: positions are sent in 1e-7°.
_SEAM_M = 0.01


class OutsideSpan(Value, kw_only=False):
    """A span of a path beyond one area of the fence."""

    start_m: float
    """Where it begins, from the start of the path. [m]"""
    end_m: float
    """Where it ends, from the start of the path. [m]"""
    leg: int
    """Index of the leg it begins on, from 0."""
    barrier: Barrier
    """The area it is beyond."""


class FenceArea(Value):
    """Where a fence allows to fly: the places on the right side of every barrier.

    Coordinates are those of the local frame the area was made in.  Distances are true within
    0.1 m up to 35 km from its origin.
    """

    barriers: tuple[Barrier, ...]
    """Each exclusion area; each inclusion area, or their union as one.  Empty: no fence."""
    findings: tuple[Finding, ...]
    """What is wrong with the fence itself (F105, F106).  Invalid areas are no barriers."""

    def signed_distance_m(self, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> FloatArray:
        """Distance of points to the boundary of the allowed region, positive inside.

        Exact inside, infinite without a fence.  Beyond a barrier, the distance back to the barrier
        farthest away; where several are overstepped the way back into the region may be longer. [m]
        """
        points = np.column_stack([np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)])
        distance = np.full(len(points), np.inf)
        for barrier in self.barriers:
            distance = np.minimum(distance, barrier.signed_distance_m(points))
        return distance

    def is_inside(self, east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> npt.NDArray[np.bool_]:
        """Whether points are in the allowed region or on its boundary."""
        return np.asarray(self.signed_distance_m(east_m, north_m) >= 0.0)

    def spans_outside(
        self, east_m: npt.ArrayLike, north_m: npt.ArrayLike
    ) -> tuple[OutsideSpan, ...]:
        """Return the spans of a path beyond each barrier, in the order they begin.

        A span continues over corners of the path; different barriers have their own.  The path has
        two finite points or more, else `path_legs` raises a ``ValueError``.
        """
        legs = path_legs(east_m, north_m)
        offset = np.concatenate([[0.0], np.cumsum(legs.length_m)])
        found: list[OutsideSpan] = []
        for barrier in self.barriers:
            spans = barrier.spans_outside(legs)
            leg = spans.leg
            if not len(leg):
                continue
            start, end = offset[leg] + spans.start_m, offset[leg] + spans.end_m
            # Rounding of sums parts the pieces of one span by less than a micrometre.
            first = np.flatnonzero(np.concatenate([[True], start[1:] > end[:-1] + 1e-6]))
            last = np.concatenate([first[1:], [len(leg)]]) - 1
            found.extend(
                OutsideSpan(float(start[i]), float(end[j]), int(leg[i]), barrier)
                for i, j in zip(first, last, strict=True)
            )
        return tuple(sorted(found, key=lambda span: span.start_m))


def make_fence_area(
    fence: Fence,
    frame: LocalFrame,
    *,
    inclusions_unite: bool = False,
    ardupilot_origin: LocalFrame | None = None,
) -> FenceArea:
    """Return the area a fence allows, in a local frame whose origin is near it.

    Edges are straight in latitude and longitude, or with an ArduPilot origin, home, in its metres;
    circles have a true radius on the ground.  Allowed is what is inside every inclusion area, as PX4 and
    ArduPilot demand, or where they unite inside any, as ArduPilot does with bit 1 of FENCE_OPTIONS; of an
    area in parts inside any.
    """
    findings: list[Finding] = []
    inclusions: list[Barrier] = []
    exclusions: list[Barrier] = []
    parts: dict[str, list[Barrier]] = {}
    for number, polygon in enumerate(fence.polygons, start=1):
        barrier = _polygon_barrier(polygon, number, frame, ardupilot_origin, findings)
        if barrier is None:
            continue
        if not polygon.inclusion:
            exclusions.append(barrier)
        else:
            parts.setdefault(polygon.area or f"polygon {number}", []).append(barrier)
    inclusions += [
        _united(own, list(map(region_of, own))) if len(own) > 1 else own[0]
        for own in parts.values()
    ]
    for number, circle in enumerate(fence.circles, start=1):
        barrier = _circle_barrier(circle, number, frame, findings)
        if barrier is not None:
            (inclusions if circle.inclusion else exclusions).append(barrier)

    if len(inclusions) > 1:
        regions = [region_of(barrier) for barrier in inclusions]
        if inclusions_unite:
            inclusions = [_united(inclusions, regions)]
        else:
            findings.extend(_check_common_place(inclusions, regions))
    return FenceArea(barriers=(*inclusions, *exclusions), findings=tuple(findings))


INVALID_POLYGON = Rule(
    "F105 invalid-polygon",
    Severity.ERROR,
    summary="A fence polygon or circle does not enclose an area.",
    why="An invalid polygon can switch the whole fence off without a word (ArduPilot #7138, #7411); "
    "PX4's test of a point is made for polygons that do not cross themselves.",
    how="Fewer than 3 different vertices, a vertex that is no position, edges that cross or fold "
    "back, an area thinner than 2 cm, a radius that is not positive.  Vertices given twice in a row "
    "are a warning.  The direction of turning does not matter.  A polygon across the 180th meridian too: "
    "PX4 and ArduPilot compare longitudes as they are, so its inside is outside for them.  A circle may be.",
    fix="draw the fence area again",
    instead="a fence that encloses an area",
)


def _polygon_barrier(
    polygon: FencePolygon,
    number: int,
    frame: LocalFrame,
    ardupilot_origin: LocalFrame | None,
    findings: list[Finding],
) -> Barrier | None:
    """Return the barrier of a polygon, ``None`` where it encloses nothing; add to findings."""
    import shapely

    label = f"{'inclusion' if polygon.inclusion else 'exclusion'} polygon {number}"

    def report(problem: str, severity: Severity = Severity.ERROR) -> None:
        findings.append(
            INVALID_POLYGON.finding(f"{label} {problem}", place=polygon.place, severity=severity)
        )

    for index, vertex in enumerate(polygon.vertices_deg, start=1):
        if not is_position(*vertex):
            report(f"has a vertex {index} that is no position: {vertex[0]}, {vertex[1]}")
            return None
    vertices = distinct_vertices_deg(polygon.vertices_deg)
    if len(set(vertices)) < 3:
        report("has fewer than 3 different vertices")
        return None
    points, edge = edge_points_m(vertices, frame, ardupilot_origin)
    if (problem := outline_problem(points, edge)) is not None:
        report(problem)
        return None
    if repeated := len(polygon.vertices_deg) - len(vertices):
        corners = quantity.count(repeated, "vertex", "vertices")
        report(f"has {corners} given twice in a row", Severity.WARNING)
    return polygon_barrier(
        shapely.Polygon(points), keep_inside=polygon.inclusion, label=label, place=polygon.place
    )


def _circle_barrier(
    circle: FenceCircle, number: int, frame: LocalFrame, findings: list[Finding]
) -> Barrier | None:
    """Return the barrier of a circle, ``None`` where it encloses nothing; add to findings."""
    label = f"{'inclusion' if circle.inclusion else 'exclusion'} circle {number}"
    problem = None
    if not is_position(circle.latitude_deg, circle.longitude_deg):
        problem = f"has a centre that is no position: {circle.latitude_deg}, {circle.longitude_deg}"
    elif not 0.0 < circle.radius_m < math.inf:  # `not` also refuses NaN
        problem = f"has a radius of {circle.radius_m} m"
    if problem is not None:
        findings.append(INVALID_POLYGON.finding(f"{label} {problem}", place=circle.place))
        return None
    east, north = frame.east_north_m(circle.latitude_deg, circle.longitude_deg)
    return CircleBarrier(
        label=label,
        place=circle.place,
        keep_inside=circle.inclusion,
        east_m=float(east),
        north_m=float(north),
        radius_m=circle.radius_m,
    )


def region_of(barrier: Barrier) -> Any:  # noqa: ANN401 - shapely has no types
    """Return what a barrier encloses as a polygon, a circle as one inscribed."""
    import shapely

    if not isinstance(barrier, CircleBarrier):
        return barrier.region
    # A chord of half-angle β is r (1 − cos β) from its arc; beyond 100 km relative to r.
    saving = max(_CIRCLE_TOLERANCE_M / barrier.radius_m, 1e-8)
    half_angle = math.acos(1.0 - min(saving, 0.01))
    return shapely.Point(barrier.east_m, barrier.north_m).buffer(
        barrier.radius_m, quad_segs=math.ceil(math.pi / 4.0 / half_angle)
    )


def _united(inclusions: list[Barrier], regions: list[Any]) -> Barrier:
    import shapely

    # Mitred corners are restored by the second buffer exactly.
    wider = shapely.union_all(shapely.buffer(regions, _SEAM_M, join_style="mitre"))
    union = shapely.buffer(wider, -_SEAM_M, join_style="mitre")
    return polygon_barrier(
        union,
        keep_inside=True,
        label=f"union of {len(inclusions)} inclusion areas",
        place=inclusions[0].place,
    )


INCLUSION_SEMANTICS = Rule(
    "F106 inclusion-semantics",
    Severity.ERROR,
    summary="No place is inside all the inclusion areas of the fence.",
    why="Inclusion areas look like alternatives, but PX4 (#27099) and ArduPilot require the vehicle "
    "to be inside every one of them: with areas apart from each other every flight is a breach.",
    how="The intersection of all inclusion polygons and circles is empty, or thinner than 2 cm.  "
    "ArduPilot takes their union where FENCE_OPTIONS has bit 1; then the rule does not apply.",
    fix="keep one inclusion area, make them overlap, or set bit 1 of FENCE_OPTIONS (ArduPilot)",
    instead="a fence that holds the mission",
)


def _check_common_place(inclusions: list[Barrier], regions: list[Any]) -> list[Finding]:
    import shapely

    if not is_thin(shapely.intersection_all(regions)):
        return []
    for (first, a), (second, b) in combinations(zip(inclusions, regions, strict=True), 2):
        if is_thin(a.intersection(b)):
            message = f"{first.label} and {second.label} have no place in common"
            return [INCLUSION_SEMANTICS.finding(message, place=second.place)]
    message = f"the {len(inclusions)} inclusion areas have no place common to all"
    return [INCLUSION_SEMANTICS.finding(message, place=inclusions[-1].place)]
