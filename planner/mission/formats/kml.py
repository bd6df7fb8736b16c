"""Missions in KML: a drawn line with altitudes, and the waypoints of DJI's WPML.

The XML of strangers is parsed without any declaration of a document type, so that no entity can expand.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place
from planner.geo.fence import FencePolygon
from planner.mission.commands import Frame
from planner.mission.formats.foreign import Ending, RoutePoint, foreign_mission, line_points

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.mission.items import Mission


LARGEST_CHARACTERS = 16 * 2**20
"""Of an XML text; DJI's largest mission of 65,535 points has fewer."""
_DEEPEST = 100
_DJI = "dji.com/wpmz"
_FRAMES = {"relativeToGround": Frame.GLOBAL_TERRAIN_ALT, "absolute": Frame.GLOBAL}
_DJI_ENDINGS = {
    "goHome": Ending.RETURN,
    "autoLand": Ending.LAND,
    "noAction": Ending.HOVER,
    "gotoFirstWaypoint": Ending.FIRST,
}
_DJI_HEIGHTS = {
    "WGS84": "the ellipsoid, which no map of the ground is given above",
    "realTimeFollowSurface": "the ground as its radar finds it",
}


def read_kml(text: str, *, source: str) -> Mission:
    """Return the mission in a KML text: the one line drawn in it, or DJI's waypoints.

    Raises MissionFileError where none, or more than one, can be meant, and where altitudes are missing.
    """
    root = _parsed(text, source=source)
    if any(_namespace(element).find(_DJI) >= 0 for element in root.iter()):
        return _read_wpml(root, source=source)
    return _read_line(root, source=source)


def _parsed(text: str, *, source: str) -> ET.Element:
    if len(text) > LARGEST_CHARACTERS:
        msg = f"XML of more than {LARGEST_CHARACTERS // 2**20} MiB: no mission is that large"
        raise MissionFileError(msg, source=source)
    if re.search(r"<!(?:DOCTYPE|ENTITY)", text, re.IGNORECASE):
        msg = "XML with a document type or entities: export it again without them"
        raise MissionFileError(msg, source=source)
    # The text is decoded: what encoding it names is not its own any more.
    body = re.sub(r"^\s*<\?xml[^>]*\?>", "", text, count=1)
    builder = _Bounded()
    parser = ET.XMLParser(target=builder)
    try:
        parser.feed(body)
        root: ET.Element = parser.close()
    except ET.ParseError as error:
        line, column = error.position
        msg = "XML that is broken here: export it again"
        raise MissionFileError(msg, source=source, place=Place(line, column + 1)) from None
    except _TooDeepError:
        msg = f"XML nested deeper than {_DEEPEST}: no mission is"
        raise MissionFileError(msg, source=source) from None
    return root


class _TooDeepError(Exception):
    """Elements in each other that no mission has."""


class _Bounded(ET.TreeBuilder):
    """A tree of bounded depth."""

    def __init__(self) -> None:
        super().__init__()
        self._depth = 0

    def start(self, tag: str, attrs: dict[str, str], /) -> ET.Element:
        self._depth += 1
        if self._depth > _DEEPEST:
            raise _TooDeepError
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> ET.Element:
        self._depth -= 1
        return super().end(tag)


def _namespace(element: ET.Element) -> str:
    return element.tag[1:].partition("}")[0] if element.tag.startswith("{") else ""


def _name(element: ET.Element) -> str:
    return element.tag.rpartition("}")[2]


def _all(element: ET.Element, name: str) -> Iterator[ET.Element]:
    return (one for one in element.iter() if _name(one) == name)


def _text(element: ET.Element, name: str) -> str | None:
    """Return the text of the first child of a name, wherever below; ``None`` where there is none."""
    found = next(_all(element, name), None)
    return None if found is None else (found.text or "").strip()


def _number(text: str, *, what: str, source: str) -> float:
    try:
        return float(text)
    except ValueError:
        msg = f"{what}: expected a number, got {text[:40]!r}"
        raise MissionFileError(msg, source=source) from None


def _read_line(root: ET.Element, *, source: str) -> Mission:
    lines = [
        (_text(mark, "name") or "without a name", line)
        for mark in _all(root, "Placemark")
        for line in _all(mark, "LineString")
    ]
    if len(lines) != 1:
        drawn = {name: sum(1 for _ in _all(root, name)) for name in ("Polygon", "Track", "Point")}
        if lines:
            names = ", ".join(name for name, _ in lines[:5])
            held = f"{len(lines)} lines ({names}{', …' if len(lines) > 5 else ''})"
        else:
            counts = [quantity.count(number, name.lower()) for name, number in drawn.items()]
            held = f"no line ({', '.join(counts)})"
        msg = f"Google Earth document (KML) with {held}: one line is flown, keep only that in the file"
        raise MissionFileError(msg, source=source)
    [(name, line)] = lines
    mode = _text(line, "altitudeMode") or "clampToGround"
    frame = _FRAMES.get(mode)
    if frame is None:
        msg = (
            f"the line '{name}' has no altitudes to fly at (altitudeMode {mode}): "
            "draw it relative to the ground or absolute, with altitudes"
        )
        raise MissionFileError(msg, source=source)
    points = line_points(_corners(line, name, source=source), f"the line '{name}'", source=source)
    areas = [
        FencePolygon(inclusion=True, vertices_deg=_ring(polygon, source=source))
        for polygon in _all(root, "Polygon")
    ]
    return foreign_mission(
        points,
        what=f"the line '{name}' of a Google Earth document (KML)",
        source=source,
        frame=frame,
        assumed=["a return home at the end", "the vehicle's own speed"],
        areas=areas,
    )


def _corners(element: ET.Element, name: str, *, source: str) -> list[list[float]]:
    texts = (_text(element, "coordinates") or "").split()
    return [
        [_number(one, what=f"coordinates of '{name}'", source=source) for one in corner.split(",")]
        for corner in texts
    ]


def _ring(polygon: ET.Element, *, source: str) -> tuple[tuple[float, float], ...]:
    corners = _corners(polygon, "a polygon", source=source)
    if any(len(corner) < 2 for corner in corners) or len(corners) < 4:
        msg = "a polygon with fewer than three corners: mend or remove it"
        raise MissionFileError(msg, source=source)
    return tuple((corner[1], corner[0]) for corner in corners[:-1])


def _read_wpml(root: ET.Element, *, source: str) -> Mission:
    """Return the mission of waylines.wpml, https://developer.dji.com, "DJI WPML"."""
    routes = [
        folder
        for folder in _all(root, "Folder")
        if any(_text(mark, "executeHeight") is not None for mark in _all(folder, "Placemark"))
    ]
    if len(routes) != 1:
        msg = f"DJI mission (WPML) with {len(routes)} routes to execute: one is flown; give a file with one"
        if not routes:
            msg = "DJI mission (WPML) without a route to execute: give the KMZ file, or its waylines.wpml"
        raise MissionFileError(msg, source=source)
    [route] = routes
    mode = _text(route, "executeHeightMode") or "none"
    if mode != "relativeToStartPoint":
        above = _DJI_HEIGHTS.get(mode, f"what it calls '{mode[:40]}'")
        msg = (
            f"DJI mission (WPML) with heights above {above}: "
            "save it with heights relative to the start point"
        )
        raise MissionFileError(msg, source=source)
    marks = [
        mark for mark in _all(route, "Placemark") if next(_all(mark, "Point"), None) is not None
    ]
    indexed = [(_required(mark, "index", source=source), mark) for mark in marks]
    cruise = _text(route, "autoFlightSpeed")
    points = [
        _wpml_point(mark, cruise, source=source)
        for _, mark in sorted(indexed, key=lambda pair: pair[0])
    ]
    finish = _text(root, "finishAction") or "none"
    ending = _DJI_ENDINGS.get(finish)
    if ending is None:
        msg = f"DJI mission (WPML) that ends with '{finish[:40]}', which is not known"
        raise MissionFileError(msg, source=source)
    climb = _text(root, "takeOffSecurityHeight")
    return foreign_mission(
        points,
        what="a DJI mission (WPML)",
        source=source,
        frame=Frame.GLOBAL_RELATIVE_ALT,
        ending=ending,
        takeoff_height_m=None
        if climb is None
        else _number(climb, what="takeOffSecurityHeight", source=source),
        assumed=_dji_assumptions(route),
    )


def _dji_assumptions(route: ET.Element) -> Sequence[str]:
    done = {(one.text or "").strip() for one in _all(route, "actionActuatorFunc")} - {"hover"}
    actions = [f"no time for {', '.join(sorted(done))}"] if done else []
    return ["the heights above home", "turns as the autopilot flies them", *actions]


def _wpml_point(mark: ET.Element, cruise: str | None, *, source: str) -> RoutePoint:
    [corner, *_] = _corners(mark, "a waypoint", source=source) or [[]]
    if len(corner) < 2:
        msg = "a waypoint without coordinates: export the mission again"
        raise MissionFileError(msg, source=source)
    speed = _text(mark, "waypointSpeed") or cruise
    hold_s = sum(
        _required(action, "hoverTime", source=source)
        for action in _all(mark, "action")
        if _text(action, "actionActuatorFunc") == "hover"
    )
    return RoutePoint(
        latitude_deg=corner[1],
        longitude_deg=corner[0],
        altitude_m=_required(mark, "executeHeight", source=source),
        speed_m_s=None if speed is None else _number(speed, what="waypointSpeed", source=source),
        hold_s=hold_s,
    )


def _required(element: ET.Element, name: str, *, source: str) -> float:
    text = _text(element, name)
    if text is None:
        msg = f"a waypoint or action without {name}: export the mission again"
        raise MissionFileError(msg, source=source)
    return _number(text, what=name, source=source)
