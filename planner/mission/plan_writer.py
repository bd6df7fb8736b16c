"""A mission as the text of a QGroundControl plan.

What was read from a JSON file is written with its own content: unknown keys, complex items, fence
and rally points stay as they were, and only what has changed since, or what QGroundControl would
refuse, is written anew.
"""

from __future__ import annotations

import json
import re
from typing import TYPE_CHECKING, Any

from planner.frozen import frozen
from planner.mission.items import Mission, VehicleKind
from planner.mission.legacy_json import read_legacy
from planner.mission.plan import (
    AUTOPILOTS,
    FILE_VERSION,
    SECTION_VERSION,
    PlanDocument,
    is_legacy,
    read_plan,
)
from planner.mission.plan_areas import AREA_VERSION
from planner.mission.plan_item_writer import put, write_elements

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.autopilot import Autopilot
    from planner.geo.fence import Fence, RallyPoint
    from planner.mission.items import Home

_FIRMWARE_TYPES: dict[Autopilot | None, int] = {
    autopilot: number for number, autopilot in AUTOPILOTS.items()
}
_GENERIC_FIRMWARE = 0
_VEHICLE_TYPES = {
    VehicleKind.MULTICOPTER: 2,
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


@frozen
class _Basis:
    """What a mission is written on top of: the content it was read from, if any."""

    head: Mapping[str, Any]
    """The file's top."""
    section: Mapping[str, Any]
    """Its mission section."""
    before: Mission
    """The mission as it was read."""
    text: str | None = None
    """The file itself."""


def plan_text(mission: Mission) -> str:
    """Return a mission as the text of a plan.

    Parameters
    ----------
    mission : Mission
        One read from a plan or an older JSON mission keeps all that its file held.

    Returns
    -------
    str
        The file itself where there is nothing to write anew.
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
    text = _json_text(plan)
    if basis.text is None or plan != basis.head:  # equal values may still be other texts: 1, true
        return text
    return basis.text if text == _json_text(basis.head) else text


def _basis(mission: Mission) -> _Basis:
    document = mission.document
    if not isinstance(document, PlanDocument):
        unknown = Mission(
            source=mission.source,
            file_format=mission.file_format,
            items=(),
            home=None,
            autopilot=None,
            vehicle=None,
        )
        return _Basis(head={}, section={}, before=unknown)
    content = document.json
    if not is_legacy(content):
        return _Basis(
            head=content.root,
            section=document.section,
            before=read_plan(content, mission.source),
            text=content.origin.text,
        )
    head = {key: content.root[key] for key in ("groundStation",) if key in content.root}
    section = {key: value for key, value in document.section.items() if key not in _LEGACY_KEYS}
    return _Basis(head=head, section=section, before=read_legacy(content, mission.source))


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
    section["items"] = write_elements(mission.items, before=before)
    home = section.get("plannedHomePosition")
    if mission.home != before.home or not isinstance(home, list):
        section["plannedHomePosition"] = _home_list(mission.home)
    if mission.vehicle_kind in _VEHICLE_TYPES and mission.vehicle_kind is not before.vehicle_kind:
        section["vehicleType"] = _VEHICLE_TYPES[mission.vehicle_kind]
    put(section, "version", SECTION_VERSION)
    return section


def _home_list(home: Home | None) -> list[float | None]:
    if home is None:
        return [None, None, None]
    return [home.latitude_deg, home.longitude_deg, home.altitude_amsl_m]


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
            "circle": {
                "center": [circle.latitude_deg, circle.longitude_deg],
                "radius": circle.radius_m,
            },
            "inclusion": circle.inclusion,
            "version": AREA_VERSION,
        }
        for circle in fence.circles
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
                completed[key] = [_versioned(area) for area in completed[key]]
        return completed
    if content:
        return {"version": 1} | dict(section)
    return dict(lists) | {"version": SECTION_VERSION}


def _versioned(area: dict[str, Any]) -> dict[str, Any]:
    """Return a fence area that says its version, which QGroundControl requires."""
    return area if "version" in area else area | {"version": AREA_VERSION}


def _json_text(value: Mapping[str, Any]) -> str:
    """Return a value as QGroundControl indents it, in characters that UTF-8 can carry."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False, indent=4) + "\n"
    return _SURROGATE.sub(lambda match: f"\\u{ord(match.group()):04x}", text)
