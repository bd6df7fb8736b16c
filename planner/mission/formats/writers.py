"""A mission as the text of a QGroundControl plan.

What was read from a JSON file is written with its own content: unknown keys, complex items, fence
and rally points stay as they were, and only what has changed since, or what QGroundControl would
refuse, is written again.
"""

from __future__ import annotations

import json
import re
from itertools import groupby
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.fetched import KEY as FETCHED_KEY
from planner.mission.commands import UNSET_YAW, Command, Frame, has_location, load_command_table
from planner.mission.formats.fence_items import fence_items, rally_items
from planner.mission.formats.plan import (
    AREA_VERSION,
    AUTOPILOTS,
    FILE_VERSION,
    SECTION_VERSION,
    PlanDocument,
    is_legacy,
    read_plan,
)
from planner.mission.formats.simple_item import (
    ALTITUDE_KEYS,
    ALTITUDE_MODE_OF_FRAME,
    CALCULATED_MODE,
    has_whole_copies,
    is_complex,
)
from planner.mission.formats.wpl import HEADER
from planner.mission.items import Mission, MissionItem, VehicleKind, numbered_in_order
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.geo.fence import Fence, RallyPoint
    from planner.mission.items import Home


_OLDER_KEYS = ("coordinate", "id", "param1", "param2", "param3", "param4")
_LARGEST_EXACT = 2**53
"""Whole numbers up to here are the same in a double."""


def _elements(items: tuple[MissionItem, ...], *, before: Mission) -> list[dict[str, Any]]:
    """Return the elements of a plan's ``items``.

    An item from the place of an element of the file is written on top of it, so that keys nobody
    knows are kept.  A complex item stays while all of its items are as they were, and one without
    items keeps its place in the list.  The items are numbered again unless they are those read.
    """
    document = before.document if isinstance(before.document, PlanDocument) else None
    elements = [] if document is None else document.elements
    spans = {} if document is None else _spans(document.origins)
    origins = {before.items[span.start].place: origin for origin, span in spans.items()}
    numbered = items if items == before.items else numbered_in_order(items)
    waiting = [index for index in range(len(elements)) if index not in spans]
    written: list[dict[str, Any]] = []
    at = 0
    while at < len(items):
        origin = origins.get(items[at].place)
        raw: dict[str, Any] = {}
        if origin is not None:
            while waiting and waiting[0] < origin:
                written.append(_named_complex(elements[waiting.pop(0)]))
            raw = elements[origin]
            if is_complex(raw):
                group = before.items[spans[origin]]
                end = at + len(group)
                if items[at:end] == group:
                    written.append(_complex_element(numbered[at:end], raw))
                    at = end
                    continue
                raw = {}
        written.append(_simple_element(numbered[at], raw))
        at += 1
    written += (_named_complex(elements[index]) for index in waiting)
    return written


def put(fields: dict[str, Any], key: str, value: object) -> None:
    """Set a key, unless the file has the same value written another way."""
    was = fields.get(key)
    if was != value or isinstance(was, bool) is not isinstance(value, bool):  # 1 == True
        fields[key] = value


def _spans(origins: Sequence[int]) -> dict[int, slice]:
    spans: dict[int, slice] = {}
    for origin, group in groupby(range(len(origins)), key=origins.__getitem__):
        indexes = list(group)
        spans[origin] = slice(indexes[0], indexes[-1] + 1)
    return spans


def _named_complex(raw: dict[str, Any]) -> dict[str, Any]:
    return raw if raw.get("type") == "ComplexItem" else raw | {"type": "ComplexItem"}


def _complex_element(items: Sequence[MissionItem], raw: dict[str, Any]) -> dict[str, Any]:
    """Return a complex item as it was, the items that it holds with their present numbers."""
    raw = _named_complex(raw)
    transects = raw.get("TransectStyleComplexItem")
    if not isinstance(transects, dict) or "Items" not in transects:
        return raw
    inner = [_simple_element(*pair) for pair in zip(items, transects["Items"], strict=True)]
    return raw | {"TransectStyleComplexItem": transects | {"Items": inner}}


def _simple_element(item: MissionItem, raw: dict[str, Any]) -> dict[str, Any]:
    """Return an item on top of what the file held at its place."""
    element = dict(raw)
    params = raw.get("params", [])
    has_present_form = len(params) == 7 and "coordinate" not in raw
    if not has_present_form:
        for key in _OLDER_KEYS:
            element.pop(key, None)
    has_same_altitude = (
        has_present_form
        and (params[6], raw["frame"]) == (item.altitude_m, item.frame)
        and has_whole_copies(raw)
    )
    if not has_same_altitude:
        for key in ALTITUDE_KEYS:
            element.pop(key, None)
        element |= _altitude_copies(item)
    put(element, "autoContinue", item.autocontinue)
    put(element, "command", item.command)
    if item.jump_id is None:
        element.pop("doJumpId", None)
    else:
        put(element, "doJumpId", item.jump_id)
    put(element, "frame", item.frame)
    put(element, "params", [_number(value) for value in item.parameters])
    put(element, "type", "SimpleItem")
    return element


def _altitude_copies(item: MissionItem) -> dict[str, Any]:
    """Return the copies that QGroundControl shows, as it writes them itself.

    It leaves them out of items without a place, and refuses them without a number.
    """
    altitude_m, mode = item.altitude_m, ALTITUDE_MODE_OF_FRAME.get(item.frame)
    if item.unresolved_agl_m is not None:
        altitude_m, mode = item.unresolved_agl_m, CALCULATED_MODE
    elif altitude_m is None or mode is None or not has_location(item.command):
        return {}
    return dict(zip(ALTITUDE_KEYS, (None, _number(altitude_m), mode), strict=True))


def _number(value: float | None) -> float | None:
    """Return a number that is written in the fewest digits: ``5`` for 5.0."""
    if value is None or value % 1.0 or abs(value) > _LARGEST_EXACT:
        return value
    return int(value)


_FIRMWARE_TYPES: dict[Autopilot | None, int] = {
    autopilot: number for number, autopilot in AUTOPILOTS.items()
}
_GENERIC_FIRMWARE = 0
_VEHICLE_TYPES = {
    VehicleKind.MULTICOPTER: 2,
    VehicleKind.HELICOPTER: 4,
    VehicleKind.FIXED_WING: 1,
    VehicleKind.VTOL: 20,
    VehicleKind.ROVER: 10,
    VehicleKind.BOAT: 11,
    VehicleKind.SUBMARINE: 12,
}
"""MAV_TYPE that QGroundControl writes for each kind; other kinds have none."""
_SPEEDS_M_S = {"cruiseSpeed": 15, "hoverSpeed": 5}
"""QGroundControl's own defaults; it shows times with them and sends them to no vehicle. [m/s]"""
_LEGACY_KEYS = frozenset({"MAV_AUTOPILOT", "fileType", "groundStation", "version"})
_SURROGATE = re.compile("[\ud800-\udfff]")


class _Basis(Value):
    """What a mission is written on top of: the content it was read from, if any."""

    before: Mission
    """The mission as it was read."""
    head: Mapping[str, Any] = {}
    """The file's top."""
    section: Mapping[str, Any] = {}
    """Its mission section."""
    text: str | None = None
    """The file itself."""


def plan_text(mission: Mission) -> str:
    """Return a mission as the text of a plan.

    One read from a plan or an older JSON mission keeps all that its file held: where there is nothing
    to change, it is the file itself.
    """
    basis = _basis(mission)
    plan = dict(basis.head)
    put(plan, "fileType", "Plan")
    plan["geoFence"] = _fence_section(mission.fence, basis)
    if not isinstance(plan.get("groundStation"), str):
        plan["groundStation"] = "mavjoule"
    plan["mission"] = _mission_section(mission, basis)
    plan["rallyPoints"] = _rally_section(mission.rally, basis)
    put(plan, "version", FILE_VERSION)
    if mission.fetched is not None:
        plan[FETCHED_KEY] = mission.fetched.text
    text = _json_text(plan)
    if basis.text is None or plan != basis.head:  # equal values may still be other texts: 1, true
        return text
    return basis.text if text == _json_text(basis.head) else text


def _basis(mission: Mission) -> _Basis:
    document = mission.document
    if not isinstance(document, PlanDocument):
        nothing = Mission(source=mission.source, file_format=mission.file_format, items=())
        return _Basis(before=nothing)
    content = document.json
    before = read_plan(content, mission.source)
    if not is_legacy(content):
        text = content.origin.text
        return _Basis(before=before, head=content.root, section=document.section, text=text)
    head = {key: content.root[key] for key in ("groundStation",) if key in content.root}
    section = {key: value for key, value in document.section.items() if key not in _LEGACY_KEYS}
    return _Basis(before=before, head=head, section=section)


def _mission_section(mission: Mission, basis: _Basis) -> dict[str, Any]:
    section = dict(basis.section)
    before = basis.before
    if basis.text is None:  # plans may lack them, new ones have them
        section = _SPEEDS_M_S | section
    for key, speed_m_s in _SPEEDS_M_S.items():
        if key in section and type(section[key]) not in {int, float}:
            section[key] = speed_m_s
    if "firmwareType" not in section or mission.autopilot is not before.autopilot:
        section["firmwareType"] = _FIRMWARE_TYPES.get(mission.autopilot, _GENERIC_FIRMWARE)
    section["items"] = _elements(mission.items, before=before)
    if mission.home != before.home or not isinstance(section.get("plannedHomePosition"), list):
        home = mission.home
        section["plannedHomePosition"] = (
            [None, None, None]
            if home is None
            else [home.latitude_deg, home.longitude_deg, home.altitude_amsl_m]
        )
    if mission.vehicle_kind in _VEHICLE_TYPES and mission.vehicle_kind is not before.vehicle_kind:
        section["vehicleType"] = _VEHICLE_TYPES[mission.vehicle_kind]
    put(section, "version", SECTION_VERSION)
    return section


def _fence_section(fence: Fence | None, basis: _Basis) -> dict[str, Any]:
    section: dict[str, Any] = basis.head.get("geoFence", {})
    empty: dict[str, Any] = {"circles": [], "polygons": []}
    if fence == basis.before.fence:
        return _completed(section, empty)
    written = {key: value for key, value in section.items() if key != "breachReturn"}
    written |= empty | {"version": SECTION_VERSION}
    if fence is None:
        return written
    if fence.breach_return_deg_m is not None:
        written["breachReturn"] = list(fence.breach_return_deg_m)
    written["circles"] = [
        {
            "circle": {"center": [area.latitude_deg, area.longitude_deg], "radius": area.radius_m},
            "inclusion": area.inclusion,
            "version": AREA_VERSION,
        }
        for area in fence.circles
    ]
    written["polygons"] = [
        {
            "inclusion": polygon.inclusion,
            "polygon": [list(vertex) for vertex in polygon.vertices_deg],
            "version": AREA_VERSION,
        }
        for polygon in fence.polygons
    ]
    return written


def _rally_section(rally: tuple[RallyPoint, ...], basis: _Basis) -> dict[str, Any]:
    section: dict[str, Any] = basis.head.get("rallyPoints", {})
    if rally == basis.before.rally:
        return _completed(section, {"points": []})
    points = [
        [point.latitude_deg, point.longitude_deg, point.height_above_home_m] for point in rally
    ]
    return section | {"points": points, "version": SECTION_VERSION}


def _completed(section: Mapping[str, Any], lists: Mapping[str, Any]) -> dict[str, Any]:
    """Return a section as it was, with what QGroundControl misses in it.

    One of version 1 stays so while it holds anything: every loader passes over its content, and
    under version 2 some of it would become a fence that nobody has flown with.
    """
    content = {key: value for key, value in section.items() if value not in ([], {}, None)}
    if content.pop("version", 1) == SECTION_VERSION:
        completed = dict(section) | {key: lists[key] for key in lists if key not in section}
        for key in ("circles", "polygons"):
            if key in completed:
                completed[key] = [
                    area if "version" in area else area | {"version": AREA_VERSION}
                    for area in completed[key]
                ]
        return completed
    if content:
        return {"version": 1} | dict(section)
    return dict(lists) | {"version": SECTION_VERSION}


def _json_text(value: Mapping[str, Any]) -> str:
    """Return a value as QGroundControl indents it, in characters that UTF-8 can carry."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=4) + "\n"
    return _SURROGATE.sub(lambda match: f"\\u{ord(match.group()):04x}", text)


def wpl_text(mission: Mission) -> str:
    """Return a mission as the text of a ``QGC WPL 110`` file, its items numbered again.

    Where it has none, its fence is written, and where it has no fence either, its rally points; with
    items neither is.  Twelve fields between tabs in each row, numbers in the fewest digits that read
    back the same, ``nan`` where a value is not specified, but see `written_items`.
    """
    if mission.items or not (mission.fence or mission.rally):
        rows = [_home_row(mission.home), *written_items(mission)]
    else:
        rows = [] if mission.home is None else [_home_row(mission.home)]
        rows += fence_items(mission.fence) if mission.fence else rally_items(mission.rally)
    lines = [HEADER]
    for number, item in enumerate(rows):
        values = map(_wpl_number, item.parameters)
        fields = (number, int(number == 0), int(item.frame), int(item.command), *values)
        lines.append("\t".join(map(str, (*fields, int(item.autocontinue)))))
    return "\n".join([*lines, ""])


def with_unused_position_zero(item: MissionItem) -> MissionItem:
    """Return an item whose unset position values are 0 where its command has no use for them.

    Loaders turn the position into whole numbers, which know no NaN: MAVSDK's makes −214.7° of it,
    pymavlink's fails.  0 means the same there, and does neither.
    """
    definition = load_command_table().commands.get(item.command)
    if definition is None or definition.has_location:
        return item
    fields = ("latitude_deg", "longitude_deg", "altitude_m")
    unused = zip(fields, definition.parameters[4:], strict=True)
    unset = [field for field, name in unused if not name and getattr(item, field) is None]
    return replace(item, **dict.fromkeys(unset, 0.0)) if unset else item


def written_items(mission: Mission) -> tuple[MissionItem, ...]:
    """Return the items of a mission as they are written: numbered again, 0 where that means the same.

    ArduPilot has no use for the heading of `UNSET_YAW`, and Mission Planner leaves out rows that
    hold ``nan``: of a mission for ArduPilot it is 0.
    """
    items = map(with_unused_position_zero, numbered_in_order(mission.items))
    if mission.autopilot is not Autopilot.ARDUPILOT:
        return tuple(items)
    return tuple(
        replace(item, param4=0.0) if item.param4 is None and item.command in UNSET_YAW else item
        for item in items
    )


def _home_row(home: Home | None) -> MissionItem:
    """Return the row of home; 0, 0 is how ground stations write that they know none."""
    frame, place, altitude_m = Frame.GLOBAL, (0.0, 0.0), 0.0
    if home is not None:
        place = (home.latitude_deg, home.longitude_deg)
        if home.altitude_amsl_m is None:
            frame = Frame.GLOBAL_RELATIVE_ALT
        else:
            altitude_m = home.altitude_amsl_m
    return MissionItem(Command.NAV_WAYPOINT, frame, 0.0, 0.0, 0.0, 0.0, *place, altitude_m)


def _wpl_number(value: float | None) -> str:
    return "nan" if value is None else repr(value).removesuffix(".0")
