"""The landing patterns of a plan, expanded as QGroundControl does on upload."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Rule, Severity
from planner.mission.commands import Command, Frame
from planner.mission.items import ItemSequence

if TYPE_CHECKING:
    from planner.findings import Place, Remarks
    from planner.mission.formats.json_document import JsonFields
    from planner.mission.items import MissionItem


LAND_COMMANDS = {"fwLandingPattern": Command.NAV_LAND, "vtolLandingPattern": Command.NAV_VTOL_LAND}
_IMAGE_STOP_CAPTURE = 2001
_VIDEO_STOP_CAPTURE = 2501


LANDING_PATTERN_EXPANDED = Rule(
    "L116 landing-pattern-expanded",
    Severity.INFO,
    summary="A landing pattern is expanded as QGroundControl does on upload.",
    why="The file holds where to approach and land, not the items; MAVSDK refuses the file.",
    how="DO_LAND_START, what stops the camera, the approach and the landing.  A warning where one of "
    "its altitudes counts from home and the other does not.",
    fix="check the landing in QGroundControl before the upload",
)


def expand_landing_pattern(
    pattern: JsonFields, kind: str, place: Place, *, first_number: int, remarks: Remarks
) -> list[MissionItem]:
    """Return the items of a landing pattern: what stops the camera, the approach, the landing.

    Parameters
    ----------
    kind : str
        A key of ``LAND_COMMANDS``.
    """
    is_relative = _is_relative(pattern, first_number, place, remarks)
    frame = Frame.GLOBAL_RELATIVE_ALT if is_relative else Frame.GLOBAL
    is_newer = "landingApproachCoordinate" in pattern.value
    approach = _position(pattern, "landingApproachCoordinate" if is_newer else "loiterCoordinate")
    land = _position(pattern, "landCoordinate")
    sequence = ItemSequence(first_number=first_number, place=place)
    sequence.add(Command.DO_LAND_START)
    if pattern.truth("useDoChangeSpeed", default=False):
        speed_m_s = pattern.number("finalApproachSpeed")
        sequence.add(Command.DO_CHANGE_SPEED, 0.0, speed_m_s, -1.0)
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
        sequence.add(Command.NAV_WAYPOINT, 0.0, 0.0, 0.0, None, frame=frame, position=approach)
    sequence.add(LAND_COMMANDS[kind], 0.0, 0.0, 0.0, 0.0, frame=frame, position=land)
    message = f"{pattern.title}: {len(sequence.items)} items computed, the file holds none of them"
    remarks.add(LANDING_PATTERN_EXPANDED, message, item=first_number, place=place)
    return sequence.items


def _is_relative(pattern: JsonFields, first_number: int, place: Place, remarks: Remarks) -> bool:
    """Return whether the pattern's altitudes count from home."""
    if "altitudesAreRelative" in pattern.value:
        return pattern.truth("altitudesAreRelative")
    loiter = pattern.truth("loiterAltitudeRelative")
    land = pattern.truth("landAltitudeRelative")
    if loiter != land:
        message = (
            f"{pattern.title}: only one of its altitudes is relative to home; both are read as "
            "such, as QGroundControl does"
        )
        remarks.add(
            LANDING_PATTERN_EXPANDED,
            message,
            item=first_number,
            place=place,
            severity=Severity.WARNING,
        )
    return loiter or land


def _position(pattern: JsonFields, key: str) -> tuple[float, float, float | None]:
    values = pattern.listed(key)
    if len(values) != 3 or values[2] is None:
        pattern.refuse(f"'{key}' must be [latitude, longitude, altitude]", key)
    return (*pattern.position(key), pattern.altitude(key, 2))
