"""Complex items of a plan, expanded to mission items as QGroundControl does on upload."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import Command, Frame
from planner.mission.expand import structure_scan
from planner.mission.expand.survey import CLOSEST_SPACING_M, add_survey, read_frame, read_survey
from planner.mission.formats.json_document import (
    LARGEST_LENGTH_M,
    JsonDocument,
    JsonFields,
    describe,
)
from planner.mission.formats.simple_item import COMPLEX_ITEM_UNKNOWN, PLAN_VALUE
from planner.mission.items import MOST_ITEMS, make_items

if TYPE_CHECKING:
    from planner.mission.formats.simple_item import SimpleItemReader
    from planner.mission.items import ItemSequence


_LAND_COMMANDS = {"fwLandingPattern": Command.NAV_LAND, "vtolLandingPattern": Command.NAV_VTOL_LAND}
_VERSIONS = {
    "survey": (2, 3, 4, 5),
    "CorridorScan": (2,),
    "StructureScan": (3,),
    "fwLandingPattern": (1, 2),
    "vtolLandingPattern": (1,),
}
"""What QGroundControl accepts."""
_TRANSECT_VERSIONS = (1, 2)
_IMAGE_STOP_CAPTURE = 2001
_VIDEO_STOP_CAPTURE = 2501


COMPLEX_ITEM_VERSION = Rule(
    "L113 complex-item-version",
    Severity.WARNING,
    summary="A complex item is of a version that loaders refuse, but holds the items to fly.",
    why="QGroundControl refuses the whole plan, and MAVSDK any survey but version 5.",
    how="The version is compared with those QGroundControl accepts; the embedded items are used.",
    fix="save the plan again with QGroundControl",
)

SURVEY_REBUILT = Rule(
    "L114 survey-rebuilt",
    Severity.WARNING,
    summary="A survey holds no items: they are computed from its area as QGroundControl does.",
    why="QGroundControl computes what it uploads again, and its versions differ in where they begin "
    "and turn; MAVSDK refuses the file.",
    how="The path it is drawn with is used where there is one; otherwise parallel lines at the grid's "
    "angle and spacing are cut with the area, entered at the chosen corner and lengthened to turn "
    "around.  Surveys that do hold their items come out within 0.3 %.  An error where the survey is of the "
    "kind that holds its items: no ground station loads it, and a drawing may be of another area.",
    fix="open the plan in a current QGroundControl and save it: then it holds the items",
    instead="a plan that holds the items of its surveys",
)


def expand(
    document: JsonDocument,
    raw: dict[str, Any],
    simple_items: SimpleItemReader,
    sequence: ItemSequence,
) -> None:
    """Add the mission items of a complex item; none where it cannot be expanded, which is an error."""
    named, version = raw.get("complexItemType", raw.get("type")), raw.get("version")
    kind: str = named if isinstance(named, str) else ""
    title = f"item {sequence.first_number} ({kind[:30] if kind == named else describe(named)})"
    item = JsonFields(document=document, value=raw, title=title)
    is_known = version in _VERSIONS.get(kind, ())
    if raw.get("type") != "ComplexItem":
        found = describe(raw.get("type"))
        _report_refused(f"{title}: 'type' is {found}, read as ComplexItem", sequence)
    transects = raw.get("TransectStyleComplexItem")
    if isinstance(transects, dict) and transects.get("Items", []) != []:
        if not is_known:
            message = (
                f"{title} is of version {describe(version)}: its embedded items are used, "
                "QGroundControl refuses the file"
            )
            sequence.remark(COMPLEX_ITEM_VERSION, message)
        version = transects.get("version")
        if version not in _TRANSECT_VERSIONS:
            found = f"'TransectStyleComplexItem' is of version {describe(version)}"
            _report_refused(f"{title}: {found}", sequence)
        _add_embedded(item, simple_items, sequence)
    elif not is_known:
        _report_missing(title, f"version {describe(version)} is not known", sequence)
    elif kind == "StructureScan":
        structure_scan.add_structure_scan(item, sequence)
    elif kind in _LAND_COMMANDS:
        _add_landing_pattern(item, _LAND_COMMANDS[kind], sequence)
    elif not _add_drawn_path(item, sequence):
        _add_computed(item, kind, sequence)


def _report_refused(what: str, sequence: ItemSequence) -> None:
    """Report that QGroundControl does not open a file with this."""
    sequence.remark(PLAN_VALUE, f"{what}: QGroundControl refuses the file")


def _report_missing(title: str, why: str, sequence: ItemSequence) -> None:
    """Report that nothing of a complex item is in the prediction."""
    message = f"{title} cannot be expanded, {why}: missing from this prediction"
    sequence.remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=sequence.place)


def _add_embedded(item: JsonFields, simple_items: SimpleItemReader, sequence: ItemSequence) -> None:
    transects = item.fields("TransectStyleComplexItem", item.title)
    first_number = sequence.first_number
    if first_number - 1 + len(transects.listed("Items")) > MOST_ITEMS:
        transects.refuse(f"more than {MOST_ITEMS:,} items: MAVLink can send no more", "Items")
    sequence.items += make_items(
        [
            simple_items.read(raw, number, place)
            for number, (raw, place) in enumerate(
                zip(*transects.objects("Items"), strict=True), start=first_number
            )
        ]
    )
    _note_shown(transects, sequence)


DRAWN_ELSEWHERE = Rule(
    "L166 drawn-elsewhere",
    Severity.WARNING,
    summary="QGroundControl draws a survey or corridor elsewhere than its items lead, or at another height.",
    why="The items are what it sends; the path, the distance to the surface and what it works out from them "
    "are what it shows, and sends as soon as anything of the survey is edited.",
    how="A point of VisualTransectPoints more than 1 m from every item, or waypoints that are not at "
    "DistanceToSurface, to 0.01 m, where altitudes do not follow the terrain.  The items are predicted.",
    fix="open the plan in QGroundControl, move a corner of the area and save",
)
_ELSEWHERE_M = 1.0
_SAME_HEIGHT_M = 0.01


def _note_shown(transects: JsonFields, sequence: ItemSequence) -> None:
    """Report where what QGroundControl shows of a survey is not what its items fly."""
    flown = [
        (item.latitude_deg, item.longitude_deg)
        for item in sequence.items
        if item.latitude_deg is not None and item.longitude_deg is not None
    ]
    points = transects.value.get("VisualTransectPoints")
    drawn = [
        (float(point[0]), float(point[1]))
        for point in (points if isinstance(points, list) else ())
        if isinstance(point, list) and len(point) == 2 and all(map(_is_angle, point))
    ]
    title = transects.title
    if flown and (away := [point for point in drawn if point not in set(flown)]):
        latitudes, longitudes = np.array(flown).T
        off_m = max(float(np.min(distance_m(*point, latitudes, longitudes))) for point in away)
        if off_m > _ELSEWHERE_M:
            sequence.remark(
                DRAWN_ELSEWHERE,
                f"{title}: drawn up to {quantity.distance(off_m)} from where its items lead",
            )
    camera = transects.value.get("CameraCalc")
    if not isinstance(camera, dict) or not _is_number(camera.get("DistanceToSurface")):
        return
    shown_m = float(camera["DistanceToSurface"])
    frame = read_frame(transects, transects.fields("CameraCalc", title))
    heights_m = {
        item.altitude_m
        for item in sequence.items
        if item.command == Command.NAV_WAYPOINT
        and item.frame == frame
        and item.altitude_m is not None
    }
    if frame == Frame.GLOBAL_TERRAIN_ALT or not heights_m:
        return
    off_m = max(heights_m, key=lambda height_m: abs(height_m - shown_m))
    if abs(off_m - shown_m) > _SAME_HEIGHT_M:
        sequence.remark(
            DRAWN_ELSEWHERE, f"{title}: shown at {shown_m:.10g} m and flown at {off_m:.10g} m"
        )


def _is_number(value: object) -> bool:
    return type(value) in {int, float} and abs(value) <= LARGEST_LENGTH_M  # type: ignore[arg-type]


def _is_angle(value: object) -> bool:
    return _is_number(value) and abs(value) <= 180.0  # type: ignore[arg-type]


def _add_drawn_path(item: JsonFields, sequence: ItemSequence) -> bool:
    """Add waypoints along the path a survey or corridor is drawn with; return whether it is saved."""
    if not isinstance(item.value.get("TransectStyleComplexItem"), dict):
        return False
    transects = item.fields("TransectStyleComplexItem", item.title)
    if (
        not isinstance(transects.value.get("CameraCalc"), dict)
        or transects.value.get("HoverAndCapture")  # hovering at pictures is no part of the drawing
        or "VisualTransectPoints" not in transects.value
    ):
        return False
    camera = transects.fields("CameraCalc", item.title)
    frame, altitude_m = read_frame(transects, camera), camera.length("DistanceToSurface")
    for index in range(len(transects.listed("VisualTransectPoints"))):
        place_deg = transects.position("VisualTransectPoints", index)
        sequence.add_waypoint((*place_deg, altitude_m), frame=frame)
    if not sequence.items:
        return False
    message = (
        f"{item.title} holds no items: flown along the path it is drawn with, "
        f"{quantity.count(len(sequence.items), 'point')}; QGroundControl and MAVSDK refuse the file"
    )
    sequence.remark(SURVEY_REBUILT, message, severity=Severity.ERROR)
    return True


def _add_computed(item: JsonFields, kind: str, sequence: ItemSequence) -> None:
    """Add the items of a survey that the file holds neither items nor a path of."""
    survey = read_survey(item) if kind == "survey" else None
    if survey is None:
        _report_missing(item.title, "it holds neither items nor a path", sequence)
        return
    try:
        lines = add_survey(survey, sequence)
    except ValueError as error:
        item.refuse(f"it would have {error}")
    if not lines:
        _report_missing(item.title, "no line crosses its area", sequence)
        return
    flown = f"{quantity.count(lines, 'line')} {survey.spacing_m:g} m apart"
    if survey.spacing_m < CLOSEST_SPACING_M:
        flown = (
            f"a single line: its spacing is {survey.spacing_m:g} m, and QGroundControl flies one line "
            f"below {CLOSEST_SPACING_M:g} m"
        )
    computed = quantity.count(len(sequence.items), "item")
    message = f"{item.title} holds no items: {computed} computed from its area, {flown}"
    sequence.remark(SURVEY_REBUILT, message)


LANDING_PATTERN_EXPANDED = Rule(
    "L116 landing-pattern-expanded",
    Severity.INFO,
    summary="A landing pattern is expanded as QGroundControl does on upload.",
    why="The file holds where to approach and land, not the items; MAVSDK refuses the file.",
    how="DO_LAND_START, what stops the camera, the approach and the landing.  A warning where one of "
    "its altitudes counts from home and the other does not.",
    fix="check the landing in QGroundControl before the upload",
)


def _add_landing_pattern(pattern: JsonFields, command: Command, sequence: ItemSequence) -> None:
    """Add the items of a landing pattern: what stops the camera, the approach, the landing."""
    frame = Frame.GLOBAL_RELATIVE_ALT if _is_relative(pattern, sequence) else Frame.GLOBAL
    is_newer = "landingApproachCoordinate" in pattern.value
    approach = _position(pattern, "landingApproachCoordinate" if is_newer else "loiterCoordinate")
    land = _position(pattern, "landCoordinate")
    sequence.add(Command.DO_LAND_START)
    if pattern.truth("useDoChangeSpeed", default=False):
        sequence.add(Command.DO_CHANGE_SPEED, 0.0, pattern.number("finalApproachSpeed"), -1.0)
    if pattern.truth("stopTakingPhotos", default=False):
        sequence.add(Command.DO_SET_CAM_TRIGG_DIST)
        sequence.add(_IMAGE_STOP_CAPTURE, 0.0, None, None, None, None, None, None)
    if pattern.truth("stopVideoPhotos", default=False):
        sequence.add(_VIDEO_STOP_CAPTURE)
    if pattern.truth("useLoiterToAlt", default=True):
        radius_m = pattern.length("loiterRadius")
        if not pattern.truth("loiterClockwise"):
            radius_m = -radius_m
        sequence.add(
            Command.NAV_LOITER_TO_ALT, 1.0, radius_m, 0.0, 1.0, frame=frame, position=approach
        )
    else:
        sequence.add_waypoint(approach, frame=frame)
    sequence.add(command, frame=frame, position=land)
    message = f"{pattern.title}: {len(sequence.items)} items computed, the file holds none of them"
    sequence.remark(LANDING_PATTERN_EXPANDED, message)


def _is_relative(pattern: JsonFields, sequence: ItemSequence) -> bool:
    if "altitudesAreRelative" in pattern.value:
        return pattern.truth("altitudesAreRelative")
    loiter, land = pattern.truth("loiterAltitudeRelative"), pattern.truth("landAltitudeRelative")
    if loiter != land:
        message = (
            f"{pattern.title}: only one of its altitudes is relative to home; both are read as "
            "such, as QGroundControl does"
        )
        sequence.remark(LANDING_PATTERN_EXPANDED, message, severity=Severity.WARNING)
    return loiter or land


def _position(pattern: JsonFields, key: str) -> tuple[float, float, float | None]:
    values = pattern.listed(key)
    if len(values) != 3 or values[2] is None:
        pattern.refuse(f"'{key}' must be [latitude, longitude, altitude]", key)
    return (*pattern.position(key), pattern.altitude(key, 2))
