"""Missions in GeoJSON (RFC 7946): one line with altitudes, and areas about it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from planner.errors import MissionFileError
from planner.mission.commands import Frame
from planner.mission.formats.area_names import AreaSide, side_of
from planner.mission.formats.foreign import drawn_areas, foreign_mission, left_out, line_points

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.mission.formats.foreign import DrawnArea
    from planner.mission.items import Mission


_SIDES = ("inclusion", "is_inclusion")
"""Properties of an area that say which side of it is flown on; the second is written by ``--export``."""
_COLLECTIONS = {"FeatureCollection": "features", "GeometryCollection": "geometries"}
_POINTS = frozenset({"Point", "MultiPoint"})
_GEOMETRIES = _POINTS | {"LineString", "MultiLineString", "Polygon", "MultiPolygon"}


def is_geojson(root: object) -> bool:
    """Return whether the root of a JSON text is that of GeoJSON."""
    kinds = {*_COLLECTIONS, *_GEOMETRIES, "Feature"}
    return isinstance(root, dict) and root.get("type") in kinds and "fileType" not in root


def read_geojson(root: dict[str, Any], *, source: str) -> Mission:
    """Return the mission of the one line in parsed GeoJSON.

    Raises MissionFileError where there is none, or more than one, and where altitudes are missing.
    """
    shapes = list(_geometries(root, source))
    lines = [shape for shape, _ in shapes if shape["type"] == "LineString"]
    if len(lines) != 1 or any(shape["type"] == "MultiLineString" for shape, _ in shapes):
        count = len(lines) + sum(
            len(parts)
            for shape, _ in shapes
            if shape["type"] == "MultiLineString"
            and isinstance(parts := shape.get("coordinates"), list)
        )
        msg = f"GeoJSON with {count or 'no'} lines: one line is flown, keep only that in the file"
        raise MissionFileError(msg, source=source)
    corners = line_points(
        _positions(lines[0].get("coordinates"), source),
        "the line",
        source=source,
        advice=": give each longitude, latitude, altitude",
    )
    areas = [
        area
        for shape, properties in shapes
        for rings in _polygons(shape)
        for area in _areas(rings, properties, source)
    ]
    points = sum(shape["type"] in _POINTS for shape, _ in shapes)
    return foreign_mission(
        corners,
        what="the line of a GeoJSON text",
        source=source,
        frame=Frame.GLOBAL,
        assumed=[
            "altitudes above mean sea level",
            "a return home at the end",
            "the vehicle's own speed",
            *left_out({"point": points}),
        ],
        areas=areas,
    )


def _geometries(root: Any, source: str) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:  # noqa: ANN401 - whatever JSON holds
    """Yield every geometry with its properties, of collections in collections too."""
    waiting: list[tuple[Any, dict[str, Any]]] = [(root, {})]
    while waiting:
        one, properties = waiting.pop()
        if one is None:  # a feature that is nowhere
            continue
        kind = str(one.get("type")) if isinstance(one, dict) else "none"
        if kind == "Feature":
            said = one.get("properties")
            waiting.append((one.get("geometry"), said if isinstance(said, dict) else {}))
        elif kind in _COLLECTIONS:
            members = _listed(one.get(_COLLECTIONS[kind]))
            waiting += ((member, properties) for member in members[::-1])
        elif kind in _GEOMETRIES:
            _refuse_circle(kind, properties, source)
            yield one, properties
        else:
            msg = f"GeoJSON with a geometry {kind[:40]!r}: draw it as a line or a polygon, or remove it"
            raise MissionFileError(msg, source=source)


def _refuse_circle(kind: str, properties: dict[str, Any], source: str) -> None:
    """Refuse a point that stands for the area around it, as drawing programs write circles."""
    is_wide = any("radius" in key.lower() and _is_number(properties[key]) for key in properties)
    if kind in _POINTS and is_wide:
        msg = (
            f"GeoJSON with a circle '{_words(properties)[:40]}': draw it as a polygon, or remove it"
        )
        raise MissionFileError(msg, source=source)


def _words(properties: dict[str, Any]) -> str:
    """Return whatever a feature says of itself: programs call it name, Name, title, type …"""
    said = (value for key, value in properties.items() if key not in _SIDES)
    return "\n".join(value for value in said if isinstance(value, str))


def _polygons(shape: dict[str, Any]) -> list[object]:
    """Return the rings of each polygon of a geometry."""
    held = shape.get("coordinates")
    return {"Polygon": [held], "MultiPolygon": _listed(held) or [None]}.get(shape["type"], [])


def _areas(rings: object, properties: dict[str, Any], source: str) -> Iterator[DrawnArea]:
    """Return an area with the side of it to fly on: as it states, else as its name says."""
    stated = {properties[key] for key in _SIDES if isinstance(properties.get(key), bool)}
    others = [key for key in _SIDES if not isinstance(properties.get(key), bool | None)]
    words = _words(properties)
    if others or len(stated) > 1 or (True in stated and side_of(words) is AreaSide.OUTSIDE):
        key = others[0] if others else next(key for key in _SIDES if key in properties)
        msg = (
            f"GeoJSON with an area '{words[:40]}' of {key} {str(properties[key])[:20]!r}: give true to stay "
            "inside, false to stay out, and no name that says otherwise"
        )
        raise MissionFileError(msg, source=source)
    drawn = [_positions(ring, source) for ring in _listed(rings)]
    return drawn_areas(drawn, words, is_inside=next(iter(stated), None), source=source)


def _listed(found: object) -> list[Any]:
    return found if isinstance(found, list) else []


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
