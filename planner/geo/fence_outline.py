"""The outline of a fence polygon in local metres, and what can be wrong with it."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from planner.geo.geodesy import FloatArray
    from planner.geo.local_frame import LocalFrame
    from planner.geo.path_legs import IndexArray

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
    metres (:mod:`planner.geo.ardupilot_lines`).  Each is halved until its pieces are within
    :data:`OUTLINE_TOLERANCE_M` of it.

    Parameters
    ----------
    vertices_deg : tuple of (float, float)
        Latitude and longitude of each vertex, not closed. [°]
    frame : LocalFrame
        Where to draw.
    ardupilot_origin : LocalFrame, optional
        Where ArduPilot's metres are counted from; ``None``: edges straight in degrees.

    Returns
    -------
    points_m : ndarray, shape (n, 2)
        East and north, from the first vertex on, not closed. [m]
    edge : ndarray of int, shape (n,)
        The edge each point begins or lies on, from 0: edge i starts at vertex i.
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
    """Return what keeps an outline from enclosing an area, ``None`` where nothing does.

    Parameters
    ----------
    points_m : ndarray, shape (n, 2)
        The outline as :func:`edge_points_m` returns it. [m]
    edge : ndarray of int, shape (n,)
        The edge of each point, likewise.
    """
    import shapely

    region = shapely.Polygon(points_m)
    if not region.is_valid:
        crossing = _first_crossing(points_m, edge)
        if crossing is not None:
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
    before, after = (
        np.roll(points_m, 1, axis=0) - points_m,
        np.roll(points_m, -1, axis=0) - points_m,
    )
    longer = np.maximum(np.hypot(*before.T), np.hypot(*after.T))
    crossed = np.abs(before[:, 0] * after[:, 1] - before[:, 1] * after[:, 0])
    apart = crossed / np.where(longer > 0.0, longer, 1.0)
    return bool(np.any((np.sum(before * after, axis=1) > 0.0) & (apart <= OUTLINE_TOLERANCE_M)))
