"""Lines and areas as RFC 7946 (GeoJSON) has them: cut in two where they cross the 180th meridian (3.1.9)."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.report.json import Document

_HALF_TURN_DEG, _TURN_DEG = 180.0, 360.0
Corner = tuple[float, float]
"""Longitude and latitude. [°]"""


def line_parts(columns: Mapping[str, Sequence[Any]]) -> list[dict[str, list[Any]]]:
    """Return columns of a line, a value for each position, as its parts on either side of the meridian.

    Each part ends on the meridian, where the next begins: numbers are interpolated there, of anything
    else it is the value before.  ``longitude_deg`` is one of the columns.
    """
    longitude_deg = columns["longitude_deg"]
    parts: list[dict[str, list[Any]]] = [{name: [] for name in columns}]
    for index, here_deg in enumerate(longitude_deg):
        if index and abs(here_deg - longitude_deg[index - 1]) > _HALF_TURN_DEG:
            before_deg = longitude_deg[index - 1]
            edge_deg = math.copysign(_HALF_TURN_DEG, before_deg)
            over_deg = here_deg + math.copysign(_TURN_DEG, before_deg) - before_deg
            at = (edge_deg - before_deg) / over_deg
            crossing = {
                name: _between(values[index - 1], values[index], at)
                for name, values in columns.items()
            }
            _append(parts[-1], crossing | {"longitude_deg": edge_deg})
            parts.append({name: [] for name in columns})
            _append(parts[-1], crossing | {"longitude_deg": -edge_deg})
        _append(parts[-1], {name: values[index] for name, values in columns.items()})
    return parts


def _append(part: dict[str, list[Any]], values: Mapping[str, object]) -> None:
    for name, value in values.items():
        part[name].append(value)


def _between(before: object, after: object, at: float) -> object:
    if isinstance(before, float) and isinstance(after, float):
        return round(before + at * (after - before), 7)
    return before


def one_or_all(parts: Sequence[object]) -> object:
    """Return the only part, or all: nested as the coordinates of a line or of several are."""
    return parts[0] if len(parts) == 1 else parts


def line_geometry(parts: Sequence[Sequence[object]]) -> Document:
    """Return the geometry of a line from the positions of its parts; a single one stands for no length."""
    lines = [[*part] * 2 if len(part) == 1 else [*part] for part in parts]
    kind = "LineString" if len(lines) == 1 else "MultiLineString"
    return {"type": kind, "coordinates": one_or_all(lines)}


def area_geometry(outline: Sequence[Corner]) -> Document:
    """Return the geometry of an area from its closed outline, turned against the clock."""
    unrolled_deg = [outline[0][0]]
    for (before_deg, _), (here_deg, _) in pairwise(outline):
        unrolled_deg.append(unrolled_deg[-1] + math.remainder(here_deg - before_deg, _TURN_DEG))
    if max(map(abs, unrolled_deg)) <= _HALF_TURN_DEG:
        return {"type": "Polygon", "coordinates": [_against_clock(outline)]}
    edge_deg = math.copysign(_HALF_TURN_DEG, max(unrolled_deg, key=abs))
    ring = [
        (longitude_deg - edge_deg, latitude_deg)  # from the edge
        for longitude_deg, (_, latitude_deg) in zip(unrolled_deg, outline, strict=True)
    ]
    west, east = (
        _west_of_edge(ring),
        _west_of_edge([(-along, latitude) for along, latitude in ring]),
    )
    sides = [
        [(round(_HALF_TURN_DEG + along, 7), latitude) for along, latitude in west],
        [(round(-_HALF_TURN_DEG - along, 7), latitude) for along, latitude in east],
    ]
    return {"type": "MultiPolygon", "coordinates": [[_against_clock(side)] for side in sides]}


def _west_of_edge(ring: Sequence[Corner]) -> list[Corner]:
    """Return the closed part of a closed outline where its first coordinate is no more than 0.

    By the algorithm of Sutherland and Hodgman (1974) for one edge.
    """
    kept: list[Corner] = []
    for (from_deg, from_latitude_deg), (to_deg, to_latitude_deg) in pairwise(ring):
        if from_deg <= 0.0:
            kept.append((from_deg, from_latitude_deg))
        if (from_deg <= 0.0) != (to_deg <= 0.0):
            at = from_deg / (from_deg - to_deg)
            kept.append((0.0, from_latitude_deg + at * (to_latitude_deg - from_latitude_deg)))
    return [*kept, kept[0]]


def _against_clock(outline: Sequence[Corner]) -> list[Corner]:
    """Return a closed outline as RFC 7946 has those of areas turn, by twice its signed area."""
    turns = (x * other_y - other_x * y for (x, y), (other_x, other_y) in pairwise(outline))
    return [*outline] if math.fsum(turns) > 0.0 else [*reversed(outline)]
