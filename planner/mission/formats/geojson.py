"""Missions in GeoJSON (RFC 7946): one line with altitudes, and areas about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from planner.errors import MissionFileError
from planner.geo.fence import FencePolygon
from planner.mission.commands import Frame
from planner.mission.formats.foreign import foreign_mission, keeps_out, line_points

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.mission.items import Mission


_SIDES = ("inclusion", "is_inclusion")
"""Properties of an area that say which side of it is flown on; the second is written by ``--export``."""
_COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
_GEOMETRIES = frozenset(
    {"Point", "MultiPoint", "LineString", "MultiLineString", "Polygon", "MultiPolygon"}
)


def is_geojson(root: object) -> bool:
    """Return whether the root of a JSON text is that of GeoJSON."""
    kinds = {*_COLLECTIONS, *_GEOMETRIES, "Feature"}
    return isinstance(root, dict) and root.get("type") in kinds and "fileType" not in root


def read_geojson(root: dict[str, Any], *, source: str) -> Mission:
    """Return the mission of the one line in parsed GeoJSON.

    Raises MissionFileError where there is none, or more than one, and where altitudes are missing.
    """
    shapes = [shape for shape, _ in _geometries(root)]
    lines = [shape for shape in shapes if shape["type"] == "LineString"]
    if len(lines) != 1 or any(shape["type"] == "MultiLineString" for shape in shapes):
        count = len(lines) + sum(
            len(parts)
            for shape in shapes
            if shape["type"] == "MultiLineString"
            and isinstance(parts := shape.get("coordinates"), list)
        )
        msg = f"GeoJSON with {count or 'no'} lines: one line is flown, keep only that in the file"
        raise MissionFileError(msg, source=source)
    points = line_points(
        _positions(lines[0].get("coordinates"), source),
        "the line",
        source=source,
        advice=": give each longitude, latitude, altitude",
    )
    areas = [
        _sided(_area(shape, str(properties.get("name") or ""), source), properties, source)
        for shape, properties in _geometries(root)
        if shape["type"] == "Polygon"
    ]
    return foreign_mission(
        points,
        what="the line of a GeoJSON text",
        source=source,
        frame=Frame.GLOBAL,
        assumed=[
            "altitudes above mean sea level",
            "a return home at the end",
            "the vehicle's own speed",
        ],
        areas=areas,
    )


def _geometries(root: Any) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:  # noqa: ANN401 - whatever JSON holds
    """Yield every geometry with its properties, of collections in collections too, and nothing else."""
    waiting: list[tuple[Any, dict[str, Any]]] = [(root, {})]
    while waiting:
        one, properties = waiting.pop()
        if not isinstance(one, dict) or not isinstance(kind := one.get("type"), str):
            continue
        if kind == "Feature":
            said = one.get("properties")
            waiting.append((one.get("geometry"), said if isinstance(said, dict) else {}))
        elif kind in _COLLECTIONS and isinstance(members := one.get(_COLLECTIONS[kind]), list):
            waiting += ((member, properties) for member in members[::-1])
        elif kind in _GEOMETRIES:
            yield one, properties


def _sided(area: FencePolygon, properties: dict[str, Any], source: str) -> FencePolygon:
    """Return an area with the side of it to fly on: as it states, else as its name says."""
    stated = {properties[key] for key in _SIDES if isinstance(properties.get(key), bool)}
    others = [key for key in _SIDES if not isinstance(properties.get(key), bool | None)]
    if others or len(stated) > 1 or (not area.inclusion and True in stated):
        key = others[0] if others else next(key for key in _SIDES if key in properties)
        msg = (
            f"GeoJSON with an area '{str(properties.get('name') or '')[:40]}' of {key} "
            f"{str(properties[key])[:20]!r}: give true to stay inside, false to stay out, and no name that "
            "says otherwise"
        )
        raise MissionFileError(msg, source=source)
    is_inside = stated.pop() if stated else area.inclusion
    return FencePolygon(inclusion=is_inside, vertices_deg=area.vertices_deg)


def _area(shape: dict[str, Any], name: str, source: str) -> FencePolygon:
    rings = shape.get("coordinates")
    ring = _positions(rings[0], source) if isinstance(rings, list) and len(rings) == 1 else []
    if len(ring) < 4:
        msg = "GeoJSON with an area that has holes, or fewer than three corners: mend or remove it"
        raise MissionFileError(msg, source=source)
    corners = tuple((position[1], position[0]) for position in ring[:-1])
    return FencePolygon(inclusion=not keeps_out(name), vertices_deg=corners)


def _positions(found: object, source: str) -> list[list[float]]:
    """Return positions, each of two numbers or more."""
    if isinstance(found, list) and all(
        isinstance(position, list)
        and len(position) >= 2
        and all(_is_number(value) for value in position)
        for position in found
    ):
        return found
    msg = "GeoJSON with coordinates that are no list of positions: [longitude, latitude, altitude]"
    raise MissionFileError(msg, source=source)


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool) and math.isfinite(value)
