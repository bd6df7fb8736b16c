"""Missions in KML: a drawn line with altitudes, and the waypoints of DJI's WPML.

The XML of strangers is parsed without any declaration of a document type, so that no entity can expand.
"""

from __future__ import annotations

import math
import re
from itertools import pairwise
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place
from planner.mission.commands import Frame
from planner.mission.formats.foreign import (
    LONGEST_ACTION_S,
    Ending,
    RouteEnds,
    RoutePoint,
    drawn_areas,
    foreign_mission,
    left_out,
    line_points,
)
from planner.mission.items import MOST_ITEMS

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.mission.formats.foreign import DrawnArea
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
_BESIDE = {
    "Point": "point",
    "Track": "track",
    "Model": "model",
    "GroundOverlay": "image",
    "NetworkLink": "network link",
}
_STATED = ("description", "value", "SimpleData")
"""What a placemark says of itself beside its name."""
_AT_POINTS = "reachPoint"
_STOPS, _STOP_S = "toPointAndStop", 1.0
"""Turns that stand still at their point: the shortest hold that both autopilots keep. [s]"""
_WITHOUT_TIME = frozenset({"zoom", "focus", "customDirName", "gimbalEvenlyRotate"})
"""Actions that go on while it flies."""
_ACTION_S = {
    "takePhoto": LONGEST_ACTION_S,
    "startRecord": LONGEST_ACTION_S,
    "stopRecord": LONGEST_ACTION_S,
    "gimbalRotate": LONGEST_ACTION_S,
    "rotateYaw": LONGEST_ACTION_S,
    "orientedShoot": 3.0 * LONGEST_ACTION_S,
    "accurateShoot": 3.0 * LONGEST_ACTION_S,
}
"""The last two turn the vehicle and the gimbal, and take a photo."""
_DJI_HEIGHTS = {
    "WGS84": "the ellipsoid, which no map of the ground is given above",
    "realTimeFollowSurface": "the ground as its radar finds it",
}


def read_kml(text: str, *, source: str, template: str = "") -> Mission:
    """Return the mission in a KML text: the one line drawn in it, or DJI's waypoints.

    ``template`` is what lies beside DJI's: the drawing that it was made from.

    Raises MissionFileError where none, or more than one, can be meant, and where altitudes are missing.
    """
    root = _parsed(text, source=source)
    if any(_namespace(element).find(_DJI) >= 0 for element in root.iter()):
        drawn = _parsed(template, source=source) if template.strip() else root
        return _read_wpml(root, drawn, source=source)
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
    offset_m = _optional(line, "altitudeOffset", source=source)
    if offset_m:
        msg = f"the line '{name}' is moved by {offset_m:g} m (altitudeOffset): draw it at its altitudes"
        raise MissionFileError(msg, source=source)
    points = line_points(_corners(line, name, source=source), f"the line '{name}'", source=source)
    rings = sum(1 for _ in _all(root, "LinearRing"))
    if rings > sum(1 for polygon in _all(root, "Polygon") for _ in _all(polygon, "LinearRing")):
        msg = "a ring that is neither a line to fly nor a polygon: draw it as one of them, or remove it"
        raise MissionFileError(msg, source=source)
    beside = {word: sum(1 for _ in _all(root, name)) for name, word in _BESIDE.items()}
    return foreign_mission(
        points,
        what=f"the line '{name}' of a Google Earth document (KML)",
        source=source,
        frame=frame,
        assumed=["a return home at the end", "the vehicle's own speed", *left_out(beside)],
        areas=list(_areas(root, "", source=source)),
    )


def _corners(element: ET.Element, name: str, *, source: str) -> list[list[float]]:
    texts = (_text(element, "coordinates") or "").split()
    return [
        [_number(one, what=f"coordinates of '{name}'", source=source) for one in corner.split(",")]
        for corner in texts
    ]


def _areas(element: ET.Element, words: str, *, source: str) -> Iterator[DrawnArea]:
    """Yield the areas drawn in an element; ``words`` is what the folders around it say of them."""
    kind = _name(element)
    if kind == "Polygon":
        outer, holes = (
            [ring for side in _all(element, name) for ring in _all(side, "LinearRing")]
            for name in ("outerBoundaryIs", "innerBoundaryIs")
        )
        if len(outer) != 1:
            msg = f"a polygon with {len(outer)} outer rings: mend or remove it"
            raise MissionFileError(msg, source=source)
        rings = [_corners(ring, "a polygon", source=source) for ring in (*outer, *holes)]
        yield from drawn_areas(rings, words, source=source)
        return
    if kind in {"Folder", "Placemark"}:
        said = [one for one in element if _name(one) == "name"]
        said += (one for name in _STATED if kind == "Placemark" for one in _all(element, name))
        words = "\n".join((words, *(one.text or "" for one in said)))
    for child in element:
        yield from _areas(child, words, source=source)


def _read_wpml(root: ET.Element, drawn: ET.Element, *, source: str) -> Mission:
    """Return the mission of waylines.wpml, https://developer.dji.com, "DJI WPML".

    The place of the take-off is in the template it was made from (``drawn``), if anywhere.
    """
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
    indexed = [(_index(mark, "index", source=source), mark) for mark in marks]
    cruise = _text(route, "autoFlightSpeed")
    indexed.sort(key=lambda pair: pair[0])
    for (before, _), (index, _) in pairwise(indexed):
        if before == index:
            msg = f"two waypoints with the index {index}: which is flown first is not known"
            raise MissionFileError(msg, source=source)
    held = _held_s(route, indexed, source=source)
    points = [
        _wpml_point(mark, cruise, held.get(index, (0.0, 0.0)), source=source)
        for index, mark in indexed
    ]
    finish = _text(root, "finishAction") or "none"
    ending = _DJI_ENDINGS.get(finish)
    if ending is None:
        msg = f"DJI mission (WPML) that ends with '{finish[:40]}', which is not known"
        raise MissionFileError(msg, source=source)
    climb_m = _optional(root, "takeOffSecurityHeight", source=source)
    if climb_m is not None and points and _text(root, "flyToWaylineMode") == "safely":
        climb_m = max(climb_m, points[0].altitude_m)
    # Where both say one, it may be either.
    given_m = (_optional(one, "globalRTHHeight", source=source) for one in (root, drawn))
    heights_m = [height_m for height_m in given_m if height_m is not None]
    return foreign_mission(
        points,
        what="a DJI mission (WPML)",
        source=source,
        frame=Frame.GLOBAL_RELATIVE_ALT,
        ends=RouteEnds(
            home_deg=_takeoff_place(root, drawn, source=source),
            takeoff_height_m=climb_m,
            first_speed_m_s=_optional(root, "globalTransitionalSpeed", source=source),
            ending=ending,
            return_height_m=max(heights_m, default=None),
        ),
        assumed=_dji_assumptions(root, route),
    )


def _takeoff_place(
    root: ET.Element, drawn: ET.Element, *, source: str
) -> tuple[float, float] | None:
    """Return latitude and longitude of takeOffRefPoint; ``None`` where it is absent or all zeros. [°]

    Its height is one above the ellipsoid: the heights of the route count from the ground there.
    """
    text = _text(root, "takeOffRefPoint") or _text(drawn, "takeOffRefPoint") or ""
    values = [_number(one, what="takeOffRefPoint", source=source) for one in text.split(",") if one]
    if not any(values):
        return None
    if len(values) < 2:
        msg = "takeOffRefPoint: expected latitude, longitude and height"
        raise MissionFileError(msg, source=source)
    return values[0], values[1]


def _dji_assumptions(root: ET.Element, route: ET.Element) -> Sequence[str]:
    done = {(one.text or "").strip() for one in _all(route, "actionActuatorFunc")} - {"hover"}
    actions = [f"no time for {', '.join(sorted(done))}"] if done else []
    lost = _text(root, "executeRCLostAction") or _text(root, "exitOnRCLost")
    link = [f"the vehicle's own action at a lost link, not '{lost[:40]}'"] if lost else []
    return ["the heights above home", "turns as the autopilot flies them", *actions, *link]


def _held_s(
    route: ET.Element, indexed: Sequence[tuple[int, ET.Element]], *, source: str
) -> dict[int, tuple[float, float]]:
    """Return how long the actions at points hover, by their index, and what else they may wait at most. [s]

    A group acts at each point from its first to its last; one that is not triggered at points does not stop
    the flight.  The actions before a route are done at its first point.
    """
    found: dict[int, tuple[float, float]] = {}
    groups = [(at, group) for at, mark in indexed for group in _all(mark, "actionGroup")]
    groups += [(indexed[0][0], group) for group in _all(route, "startActionGroup") if indexed]
    for at, group in groups:
        first = _index(group, "actionGroupStartIndex", at, source=source)
        last = _index(group, "actionGroupEndIndex", first, source=source)
        if first > last or not any(index == first for index, _ in indexed):
            msg = f"actions from waypoint {first} to {last}: there is no such part of the route"
            raise MissionFileError(msg, source=source)
        trigger = _text(group, "actionTriggerType") or _AT_POINTS
        hover_s = wait_s = 0.0
        for action in _all(group, "action"):
            name = _text(action, "actionActuatorFunc") or ""
            if name == "hover":
                own_s = _duration_s(action, "hoverTime", source=source)
                hover_s += own_s if trigger == _AT_POINTS else 0.0
                wait_s += 0.0 if trigger == _AT_POINTS else math.inf
            elif name == "gimbalRotate" and _text(action, "gimbalRotateTimeEnable") == "1":
                hover_s += _duration_s(action, "gimbalRotateTime", source=source)
            elif name not in _WITHOUT_TIME:
                wait_s += _ACTION_S.get(name, math.inf) if trigger == _AT_POINTS else 0.0
        for index in range(first, min(last, MOST_ITEMS) + 1):
            held_s, waited_s = found.get(index, (0.0, 0.0))
            found[index] = held_s + hover_s, waited_s + wait_s
    return found


def _wpml_point(
    mark: ET.Element, cruise: str | None, held_s: tuple[float, float], *, source: str
) -> RoutePoint:
    [corner, *_] = _corners(mark, "a waypoint", source=source) or [[]]
    if len(corner) < 2:
        msg = "a waypoint without coordinates: export the mission again"
        raise MissionFileError(msg, source=source)
    speed = _text(mark, "waypointSpeed") or cruise
    if _text(mark, "useGlobalSpeed") == "1":
        speed = cruise
    hold_s, wait_s = held_s
    if (_text(mark, "waypointTurnMode") or "").startswith(_STOPS):
        hold_s = max(hold_s, _STOP_S)
    return RoutePoint(
        latitude_deg=corner[1],
        longitude_deg=corner[0],
        altitude_m=_required(mark, "executeHeight", source=source),
        speed_m_s=None if speed is None else _number(speed, what="waypointSpeed", source=source),
        hold_s=hold_s,
        unstated_wait_s=wait_s,
    )


def _index(element: ET.Element, name: str, absent: int | None = None, *, source: str) -> int:
    """Return the number of a waypoint; ``absent`` where the file gives none, which it has to by default."""
    value = _optional(element, name, source=source)
    if value is None and absent is not None:
        return absent
    value = _required(element, name, source=source) if value is None else value
    if not (value >= 0.0 and value.is_integer()):
        msg = f"{name} is {value:g}: waypoints are counted from 0"
        raise MissionFileError(msg, source=source)
    return int(value)


def _duration_s(element: ET.Element, name: str, *, source: str) -> float:
    value_s = _required(element, name, source=source)
    if not 0.0 <= value_s < math.inf:
        msg = f"{name} is {value_s:g} s: give 0 or more"
        raise MissionFileError(msg, source=source)
    return value_s


def _optional(element: ET.Element, name: str, *, source: str) -> float | None:
    text = _text(element, name)
    return None if not text else _number(text, what=name, source=source)


def _required(element: ET.Element, name: str, *, source: str) -> float:
    text = _text(element, name)
    if text is None:
        msg = f"a waypoint or action without {name}: export the mission again"
        raise MissionFileError(msg, source=source)
    return _number(text, what=name, source=source)
