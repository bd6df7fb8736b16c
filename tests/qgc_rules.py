"""QGroundControl's rules for opening a file, written down apart from our readers and writers.

From its sources of May 2026: ``PlanMasterController``, ``MissionController``, ``MissionItem``,
``SimpleMissionItem``, ``GeoFenceController``, ``RallyPointController`` and ``JsonParsing``.
"""

from __future__ import annotations

import json
from typing import Any, NoReturn

_VERSIONS = {
    "survey": {2, 3, 4, 5},
    "CorridorScan": {2},
    "StructureScan": {3},
    "fwLandingPattern": {1, 2},
    "vtolLandingPattern": {1},
}
_DO_JUMP = 177


class RefusedError(Exception):
    """The file is not opened; the text says why."""


def refuse_plan(text: str) -> None:
    """Raise `RefusedError` where QGroundControl would not open a plan."""
    plan = json.loads(text, parse_constant=_refuse_constant)
    _need(plan, "fileType", "version", "groundStation", "mission", "geoFence", "rallyPoints")
    _check(plan["fileType"] == "Plan", "fileType")
    _check(_is_number(plan["version"]) and plan["version"] == 1, "version")
    _check(isinstance(plan["groundStation"], str), "groundStation")
    for key in ("mission", "geoFence", "rallyPoints"):
        _check(isinstance(plan[key], dict), key)
    _refuse_mission(plan["mission"])
    _refuse_fence(plan["geoFence"])
    _refuse_rally(plan["rallyPoints"])


def refuse_text(text: str) -> None:
    """Raise `RefusedError` where QGroundControl would not open a ``QGC WPL`` text."""
    header, *rows = text.removesuffix("\n").split("\n")
    _check(header == "QGC WPL 110", "header")
    for row in rows:
        fields = row.split("\t")
        _check(len(fields) == 12, f"{len(fields)} fields")
        for whole in (*fields[:4], fields[11]):
            _check(whole.isdecimal(), whole)  # what is no number becomes 0 without a word
        for field in fields[4:11]:
            float(field)


def _refuse_mission(mission: dict[str, Any]) -> None:
    _need(mission, "items", "plannedHomePosition", "firmwareType")
    _refuse_coordinate(mission["plannedHomePosition"], size=3)
    for key in ("firmwareType", "vehicleType", "cruiseSpeed", "hoverSpeed"):
        _check(_is_number(mission.get(key, 0)), key)
    _check(isinstance(mission["items"], list), "items")
    ids = []
    for item in mission["items"]:
        _check(isinstance(item, dict) and isinstance(item.get("type"), str), "item without a type")
        if item["type"] == "SimpleItem":
            _refuse_simple_item(item)
            ids.append(item.get("doJumpId"))
        else:
            _check(item["type"] == "ComplexItem", "type")
            _refuse_complex_item(item)
    for item in mission["items"]:
        if item.get("command") == _DO_JUMP:
            _check(item["params"][0] in ids, "Could not find doJumpId")


def _refuse_simple_item(item: dict[str, Any]) -> None:
    _need(item, "frame", "command", "params", "autoContinue")
    _check(_is_number(item["frame"]) and _is_number(item["command"]), "frame, command")
    _check(isinstance(item["params"], list), "params")
    params = item["params"] + item.get("coordinate", [])
    _check(len(params) == 7, f"{len(params)} params")
    _check(all(value is None or _is_number(value) for value in params), "params")
    _check(isinstance(item["autoContinue"], bool), "autoContinue")
    _check(_is_number(item.get("doJumpId", 0)), "doJumpId")
    copies = ("AltitudeMode", "Altitude", "AMSLAltAboveTerrain")
    if any(key in item for key in copies):
        _need(item, *copies)
        _check(_is_number(item["AltitudeMode"]) and item["AltitudeMode"] in range(5), "mode")
        _check(_is_number(item["Altitude"]), "Altitude")
        _check(item[copies[2]] is None or _is_number(item[copies[2]]), copies[2])


def _refuse_complex_item(item: dict[str, Any]) -> None:
    kind, version = item.get("complexItemType"), item.get("version")
    _check(version in _VERSIONS.get(str(kind), ()), f"{kind} {version}")
    if kind == "CorridorScan" or (kind == "survey" and version in {4, 5}):
        _need(item, "TransectStyleComplexItem")
        transects = item["TransectStyleComplexItem"]
        _check(transects.get("version") in {1, 2}, "TransectStyleComplexItem")
        _need(transects, "Items")
        for inner in transects["Items"]:
            _refuse_simple_item(inner)


def _refuse_fence(fence: dict[str, Any]) -> None:
    if fence.get("version", 1) == 1:
        return
    _need(fence, "circles", "polygons")
    _check(fence["version"] == 2, "geoFence version")
    for polygon in fence["polygons"]:
        _refuse_area(polygon, "polygon")
        for vertex in polygon["polygon"]:
            _refuse_coordinate(vertex, size=2)
    for circle in fence["circles"]:
        _refuse_area(circle, "circle")
        _refuse_coordinate(circle["circle"]["center"], size=2)
        _check(_is_number(circle["circle"]["radius"]), "radius")
    if "breachReturn" in fence:
        _refuse_coordinate(fence["breachReturn"], size=3)


def _refuse_area(area: dict[str, Any], key: str) -> None:
    _need(area, "version", "inclusion", key)
    _check(area["version"] == 1, f"{key} version")
    _check(isinstance(area["inclusion"], bool), "inclusion")


def _refuse_rally(rally: dict[str, Any]) -> None:
    _need(rally, "version")
    if rally["version"] != 1:
        _check(rally["version"] == 2, "rallyPoints version")
        _need(rally, "points")
        for point in rally["points"]:
            _refuse_coordinate(point, size=3)


def _refuse_coordinate(value: object, *, size: int) -> None:
    is_right = isinstance(value, list) and len(value) == size
    _check(is_right, f"coordinate {value}")
    assert isinstance(value, list)
    _check(all(one is None or _is_number(one) for one in value), f"coordinate {value}")


def _is_number(value: object) -> bool:
    return isinstance(value, int | float) and not isinstance(value, bool)


def _need(fields: dict[str, Any], *keys: str) -> None:
    for key in keys:
        _check(key in fields, f"{key} is missing")


def _check(is_right: bool, what: str) -> None:  # noqa: FBT001 (as assert)
    if not is_right:
        raise RefusedError(what)


def _refuse_constant(token: str) -> NoReturn:
    raise RefusedError(token)
