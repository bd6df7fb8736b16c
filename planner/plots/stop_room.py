"""The room to stop about a flight, as areas on the map: what must not reach over the fence."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.geo.swept_area import swept_areas
from planner.rules.fenced_flight import make_fenced_flight

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.plots.places import Row
    from planner.rules.assessment import Assessment

_MOST_POINTS = 1_500
"""Corners of all areas together; more are thinned out."""
_DOT = 1.0 / 1_000
"""What an outline may be off at first, as a share of the extent of the flight. [-]"""
_ALIKE_DIGITS = 1
"""Legs flown again and again, to a tenth of a metre, are one: a union of many takes long."""
_LEAST_M = 0.1
"""A finer dot shows nothing more. [m]"""
_ARC_POINTS = 4
"""Of a quarter turn."""


def stop_room_rows(assessment: Assessment) -> list[Row]:
    """Return what a flight would pass over if it were told to stop anywhere, a row per corner.

    Around every place of the path it is the way straight ahead until the vehicle stands still (to
    react, to stop, what the wind adds), and the margin by which its position may be wrong: where that
    reaches over a fence there is a finding F102.

    Parameters
    ----------
    assessment : Assessment
        What is flown; without a fence there is no such area, nor where none of it could be seen.

    Returns
    -------
    list
        ``area``, ``order``, ``east_m``, ``north_m``; an area with holes is one line that goes there
        and back, round each hole the other way, so that it is filled as it should be.
    """
    if not assessment.mission.fence:
        return []
    import shapely

    flown = make_fenced_flight(assessment)
    dot_m = _DOT * float(np.ptp(flown.points_m, axis=0).max())
    farthest_m = float(np.hypot(*(flown.stopped_m - flown.points_m).T).max()) + flown.margin_m
    if farthest_m < dot_m:
        return []
    stretch, legs = _stretches(flown.path.length_m, dot_m), np.arange(len(flown.path.item))
    ahead = np.concatenate(
        [points[rows] for points in (flown.points_m, flown.stopped_m) for rows in (legs, legs + 1)]
    )
    hulls = swept_areas(np.round(ahead, _ALIKE_DIGITS), np.tile(stretch, 4)).hulls
    _, first = np.unique(shapely.to_wkb(shapely.normalize(hulls)), return_index=True)
    # widened one by one: hulls of legs straight ahead are slivers, which a union may lose
    room = shapely.union_all(shapely.buffer(hulls[first], flown.margin_m, quad_segs=_ARC_POINTS))
    outline = shapely.simplify(room, dot_m)
    while shapely.get_num_coordinates(outline) > _MOST_POINTS:
        dot_m *= 2.0
        outline = shapely.simplify(room, dot_m)
    rows: list[Row] = []
    for number, polygon in enumerate(shapely.get_parts(outline), start=1):
        places = _single_line(polygon)
        degrees = flown.frame.latitude_longitude_deg(places[:, 0], places[:, 1])
        east_m, north_m = assessment.route.frame.east_north_m(*degrees)
        rows += [
            {"area": number, "order": order, "east_m": round(east, 1), "north_m": round(north, 1)}
            for order, (east, north) in enumerate(
                zip(east_m.tolist(), north_m.tolist(), strict=True)
            )
        ]
    return rows


def _stretches(length_m: FloatArray, short_m: float) -> IntArray:
    """Return the stretch each leg is part of, from 0: legs that are short together make one. (n,)"""
    middle_m = np.cumsum(length_m) - 0.5 * length_m
    bins = np.floor(middle_m / max(short_m, _LEAST_M))
    return np.cumsum(np.diff(bins, prepend=bins[0]) != 0.0)


def _single_line(polygon: Any) -> FloatArray:  # noqa: ANN401 - shapely has no types
    """Return the outline of an area and of its holes as one line. (n, 2) [m]"""
    from shapely.geometry.polygon import orient

    turned = orient(polygon)
    outside = np.asarray(turned.exterior.coords)
    pieces = [outside]
    for hole in turned.interiors:
        pieces += [np.asarray(hole.coords), outside[:1]]
    return np.concatenate(pieces)
