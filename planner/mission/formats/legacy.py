"""Formats from before plans: QGroundControl's older JSON, ArduPilot's lists of points.

JSON of version 1.0 (2016) has ``param1`` to ``param4`` and ``coordinate`` in each item and an item
for home; version 2 (2017) has the mission section of a plan as the whole file.  A fence is a list of
"latitude longitude" lines, rally points are lines "RALLY …".
"""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place, Remarks, Rule, Severity
from planner.geo.fence import Fence, FencePolygon, RallyPoint
from planner.mission.formats.fence_items import FENCE_INCOMPLETE, FENCE_ITEM_BROKEN
from planner.mission.formats.json_document import JsonFields, describe
from planner.mission.formats.plan import (
    PlanDocument,
    read_autopilot,
    read_home,
    read_items,
    read_vehicle,
)
from planner.mission.formats.simple_item import COMPLEX_ITEM_UNKNOWN
from planner.mission.formats.wpl import MOST_ROWS, TEXT_NO_MISSION, read_lines
from planner.mission.items import Home, Mission, MissionFormat

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.mission.formats.json_document import JsonDocument


LEGACY_FORMAT = Rule(
    "L117 legacy-format",
    Severity.WARNING,
    summary="The file is written in a JSON format from before plans.",
    why="QGroundControl since 3.3 opens plans only; other programs never read it.",
    how="The file has items at its top, or the file type 'Mission'.",
    fix="open it in an old QGroundControl and save it as a plan",
)


def read_legacy(document: JsonDocument, source: str) -> Mission:
    """Return the mission in a JSON text from before plans.

    Returns
    -------
    Mission
        Its ``document`` is a `PlanDocument`.
    """
    remarks = Remarks()
    mission = JsonFields(document=document, value=document.root, title="the mission")
    version = mission.value.get("version")
    if version not in ("1.0", 1, 2, None):
        mission.refuse(f'its version is {describe(version)}, expected "1.0" or 2', "version")
    message = (
        f"a mission file of version {'unknown' if version is None else version}, from before "
        "plans: QGroundControl no longer opens it, and it holds no fence"
    )
    remarks.add(LEGACY_FORMAT, message, place=document.place(mission.value))
    complex_items = mission.value.get("complexItems")
    if complex_items:
        message = f"'complexItems' is {describe(complex_items)}: missing from this prediction"
        place = document.place(mission.value, "complexItems")
        remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=place)
    firmware_key = "MAV_AUTOPILOT" if "MAV_AUTOPILOT" in mission.value else "firmwareType"
    autopilot = read_autopilot(mission, firmware_key)
    read = read_items(mission, remarks, autopilot=autopilot, is_legacy=True)
    home = _read_home(mission)
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=read.items,
        home=home,
        autopilot=autopilot,
        vehicle=read_vehicle(mission, read.items, home),
        findings=(*document.findings, *remarks.findings()),
        document=PlanDocument(json=document, section=mission.value, origins=read.origins),
    )


def _read_home(mission: JsonFields) -> Home | None:
    """Return the planned home, which version 1.0 writes as an item."""
    key = "plannedHomePosition"
    if not isinstance(mission.value.get(key), dict):
        return read_home(mission)
    home = mission.fields(key, "the planned home")
    coordinate = home.listed("coordinate")
    if len(coordinate) != 3:
        home.refuse("'coordinate' must be [latitude, longitude, altitude]", "coordinate")
    latitude_deg, longitude_deg = home.position("coordinate")
    return Home(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=home.altitude("coordinate", 2),
    )


_FENCE_LINE = re.compile(r"[+-]?\d+\.?\d*[\s,]+[+-]?\d+\.?\d*")
_RALLY_LINE = re.compile(r"RALLY\s", re.IGNORECASE)


def is_fence_line(line: str) -> bool:
    """Return whether a line is one point of an old fence list."""
    return _FENCE_LINE.fullmatch(line.strip()) is not None


def is_rally_line(line: str) -> bool:
    """Return whether a line is one point of an old rally list."""
    return _RALLY_LINE.match(line.strip()) is not None


def read_fence_list(text: str, *, source: str) -> Mission:
    """Return a mission without items whose fence is the listed one.

    The first point is where to return to after a breach, the others are the vertices of one
    inclusion polygon, whose last point repeats the first (pymavlink's ``MAVFenceLoader``).
    """
    points: list[tuple[float, float]] = []
    places: list[Place] = []
    for place, fields in _read_fields(text, source=source):
        if len(fields) != 2:
            msg = f"the line has {quantity.count(len(fields), 'value')}, expected a latitude and a longitude"
            raise MissionFileError(msg, source=source, place=place)
        points.append(_read_position(fields, source=source, place=place))
        places.append(place)
    findings: list[Finding] = []
    vertices = points[1:]
    if len(vertices) >= 2 and vertices[0] == vertices[-1]:
        vertices.pop()
    else:
        message = "the fence is not closed: its last point does not repeat the second line"
        findings.append(FENCE_ITEM_BROKEN.finding(message, place=places[-1]))
    polygons: tuple[FencePolygon, ...] = ()
    corners = quantity.count(len(vertices), "vertex", "vertices")
    if len(vertices) >= 3:
        polygon = FencePolygon(inclusion=True, vertices_deg=tuple(vertices), place=places[1])
        polygons = (polygon,)
    else:
        message = f"the fence has {corners}, fewer than 3: left out"
        findings.append(FENCE_INCOMPLETE.finding(message, place=places[0]))
    what = f"the file holds a fence of {corners} and no mission"
    fence = Fence(polygons=polygons, breach_return_deg_m=(*points[0], None))
    return _make_mission(text, what, fence=fence, findings=findings, source=source)


def read_rally_list(text: str, *, source: str) -> Mission:
    """Return a mission without items with the listed rally points.

    A line is ``RALLY latitude longitude altitude break-altitude land-direction flags``, the
    altitude in metres above home.
    """
    points: list[RallyPoint] = []
    for place, fields in _read_fields(text, source=source):
        if not is_rally_line(" ".join(fields) + " ") or len(fields) != 7:
            msg = "expected 'RALLY latitude longitude altitude break-altitude direction flags'"
            raise MissionFileError(msg, source=source, place=place)
        latitude_deg, longitude_deg = _read_position(fields[1:3], source=source, place=place)
        height_m = _read_number(fields[3], source=source, place=place)
        points.append(
            RallyPoint(
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                height_above_home_m=height_m,
                place=place,
            )
        )
    what = f"the file holds {quantity.count(len(points), 'rally point')} and no mission"
    return _make_mission(text, what, rally=tuple(points), source=source)


def _read_fields(text: str, *, source: str) -> list[tuple[Place, list[str]]]:
    """Return the fields of every line that is not blank and no comment."""
    fields = []
    for number, line in read_lines(text, source=source):
        content = line.strip()
        if content and not content.startswith("#"):
            place = Place(number, len(line) - len(line.lstrip()) + 1)
            fields.append((place, re.split(r"[\s,]+", content)))
            if len(fields) > MOST_ROWS:
                msg = f"more than {MOST_ROWS:,} points: MAVLink can send no more than that"
                raise MissionFileError(msg, source=source, place=place)
    return fields


def _read_position(fields: list[str], *, source: str, place: Place) -> tuple[float, float]:
    latitude_deg, longitude_deg = (
        _read_number(field, source=source, place=place) for field in fields
    )
    if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 180.0:
        msg = f"{latitude_deg:g}, {longitude_deg:g} is not a latitude and longitude"
        raise MissionFileError(msg, source=source, place=place)
    return latitude_deg, longitude_deg


def _read_number(field: str, *, source: str, place: Place) -> float:
    try:
        value = float(field)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        msg = f"'{field[:40]}' is not a number"
        raise MissionFileError(msg, source=source, place=place)
    return value


def _make_mission(
    text: str,
    what: str,
    *,
    source: str,
    fence: Fence | None = None,
    rally: tuple[RallyPoint, ...] = (),
    findings: list[Finding] | None = None,
) -> Mission:
    return Mission(
        source=source,
        file_format=MissionFormat.WPL,
        items=(),
        home=None,
        autopilot=None,
        vehicle=None,
        fence=fence,
        rally=rally,
        findings=(*(findings or ()), TEXT_NO_MISSION.finding(what)),
        document=text,
    )
