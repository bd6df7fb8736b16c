"""What a mission command means for a prediction, and what each autopilot does with it.

Two tables, written by name and looked up in MAVLink's own: what a command does to the time and
energy of a multicopter's flight, and whether an autopilot takes it.
"""

from __future__ import annotations

from enum import StrEnum
from functools import cache
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.frozen import frozen
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    Frame,
    load_command_table,
)

if TYPE_CHECKING:
    from collections.abc import Mapping


class CommandEffect(StrEnum):
    """What a command does to the time and energy of a multicopter's flight."""

    MODELLED = "modelled"
    """Its flight is predicted."""
    NO_EFFECT = "no effect"
    """Cameras, gimbals, places to look at, relays, markers: instant, no flight."""
    NOT_MODELLED = "not modelled"
    """It may take time, move the vehicle or change its mass, and that is not predicted."""
    NOT_MULTICOPTER = "not multicopter"
    """It belongs to fixed-wing aircraft, VTOLs, rovers or boats."""
    FENCE_RALLY = "fence or rally"
    """It belongs to the fence or the rally points, which have lists of their own."""


class Support(StrEnum):
    """What an autopilot does with a command in a multicopter's mission."""

    ACCEPTED = "accepted"
    SKIPPED = "skipped"
    """Taken at upload, passed over in flight."""
    BLOCKS_ARMING = "blocks arming"
    """Taken at upload; the vehicle then finds the mission infeasible."""
    REFUSED = "refused"
    """Refused at upload, and the whole mission with it."""
    UNKNOWN = "unknown"
    """Not found out, or different between versions."""


SOURCES: Mapping[Autopilot, str] = {
    Autopilot.PX4: (
        "PX4 mavlink_mission.cpp (parse_mavlink_mission_item) and FeasibilityChecker.cpp "
        "(checkMissionItemValidity), 1.16 to early 2026"
    ),
    Autopilot.ARDUPILOT: (
        "ArduPilot AP_Mission.cpp (mavlink_int_to_mission_cmd, start_command), Copter "
        "mode_auto.cpp (start_command), 4.1 to 4.7; camera commands by ardupilot.org, 4.4 to 4.6"
    ),
}
"""Where the answers of `support` come from."""

EFFECTS: Mapping[CommandEffect, str] = {
    CommandEffect.MODELLED: """
        NAV_WAYPOINT NAV_LOITER_UNLIM NAV_LOITER_TURNS NAV_LOITER_TIME NAV_RETURN_TO_LAUNCH
        NAV_LAND NAV_TAKEOFF NAV_LOITER_TO_ALT NAV_SPLINE_WAYPOINT NAV_DELAY DO_JUMP
        DO_CHANGE_SPEED DO_SET_HOME JUMP_TAG DO_JUMP_TAG
    """,
    # The CONDITION commands hold back the next DO command while the flight goes on.
    CommandEffect.NO_EFFECT: """
        NAV_ROI CONDITION_DELAY CONDITION_DISTANCE CONDITION_YAW DO_SET_RELAY DO_REPEAT_RELAY
        DO_SET_SERVO DO_REPEAT_SERVO DO_SET_ACTUATOR DO_RETURN_PATH_START DO_LAND_START
        DO_SET_ROI_LOCATION DO_SET_ROI_WPNEXT_OFFSET DO_SET_ROI_NONE DO_SET_ROI_SYSID
        DO_CONTROL_VIDEO DO_SET_ROI DO_DIGICAM_CONFIGURE DO_DIGICAM_CONTROL DO_MOUNT_CONFIGURE
        DO_MOUNT_CONTROL DO_MOUNT_CONTROL_QUAT DO_SET_CAM_TRIGG_DIST DO_SET_CAM_TRIGG_INTERVAL
        DO_FENCE_ENABLE DO_SET_RESUME_REPEAT_DIST DO_GUIDED_LIMITS OBLIQUE_SURVEY
        ILLUMINATOR_ON_OFF DO_ILLUMINATOR_CONFIGURE REQUEST_CAMERA_INFORMATION
        REQUEST_CAMERA_SETTINGS REQUEST_STORAGE_INFORMATION STORAGE_FORMAT
        REQUEST_CAMERA_CAPTURE_STATUS RESET_CAMERA_SETTINGS SET_CAMERA_MODE SET_CAMERA_ZOOM
        SET_CAMERA_FOCUS SET_STORAGE_USAGE SET_CAMERA_SOURCE DO_GIMBAL_MANAGER_PITCHYAW
        DO_GIMBAL_MANAGER_CONFIGURE IMAGE_START_CAPTURE IMAGE_STOP_CAPTURE
        REQUEST_CAMERA_IMAGE_CAPTURE DO_TRIGGER_CONTROL CAMERA_TRACK_POINT CAMERA_TRACK_RECTANGLE
        CAMERA_STOP_TRACKING VIDEO_START_CAPTURE VIDEO_STOP_CAPTURE VIDEO_START_STREAMING
        VIDEO_STOP_STREAMING REQUEST_VIDEO_STREAM_INFORMATION REQUEST_VIDEO_STREAM_STATUS
        LOGGING_START LOGGING_STOP PANORAMA_CREATE DO_ADSB_OUT_IDENT
    """,
    CommandEffect.NOT_MULTICOPTER: """
        NAV_CONTINUE_AND_CHANGE_ALT NAV_ALTITUDE_WAIT NAV_VTOL_TAKEOFF NAV_VTOL_LAND DO_RALLY_LAND
        DO_GO_AROUND DO_SET_REVERSE DO_INVERTED_FLIGHT NAV_SET_YAW_SPEED DO_VTOL_TRANSITION
    """,
    CommandEffect.FENCE_RALLY: """
        NAV_FENCE_RETURN_POINT NAV_FENCE_POLYGON_VERTEX_INCLUSION
        NAV_FENCE_POLYGON_VERTEX_EXCLUSION NAV_FENCE_CIRCLE_INCLUSION NAV_FENCE_CIRCLE_EXCLUSION
        NAV_RALLY_POINT
    """,
}
"""Every command that is not named here is NOT_MODELLED; none is named twice."""

_PX4_WITH_POSITION = """
    NAV_WAYPOINT NAV_LOITER_UNLIM NAV_LOITER_TIME NAV_LAND NAV_TAKEOFF NAV_LOITER_TO_ALT NAV_ROI
    DO_SET_ROI DO_SET_ROI_LOCATION NAV_VTOL_TAKEOFF NAV_VTOL_LAND CONDITION_GATE
    NAV_FENCE_RETURN_POINT NAV_FENCE_POLYGON_VERTEX_INCLUSION NAV_FENCE_POLYGON_VERTEX_EXCLUSION
    NAV_FENCE_CIRCLE_INCLUSION NAV_FENCE_CIRCLE_EXCLUSION NAV_RALLY_POINT
"""
_PX4_WITHOUT_POSITION = """
    DO_JUMP NAV_ROI DO_SET_ROI DO_WINCH DO_GRIPPER DO_CHANGE_SPEED DO_SET_HOME DO_LAND_START
    DO_TRIGGER_CONTROL DO_DIGICAM_CONTROL DO_MOUNT_CONFIGURE DO_MOUNT_CONTROL
    DO_GIMBAL_MANAGER_PITCHYAW DO_GIMBAL_MANAGER_CONFIGURE IMAGE_START_CAPTURE IMAGE_STOP_CAPTURE
    VIDEO_START_CAPTURE VIDEO_STOP_CAPTURE DO_CONTROL_VIDEO DO_SET_CAM_TRIGG_DIST OBLIQUE_SURVEY
    DO_SET_CAM_TRIGG_INTERVAL SET_CAMERA_MODE DO_VTOL_TRANSITION NAV_DELAY NAV_RETURN_TO_LAUNCH
    DO_SET_ROI_WPNEXT_OFFSET DO_SET_ROI_NONE CONDITION_DELAY CONDITION_DISTANCE
"""
# The feasibility check knows none of the first four, the parser does; VTOL items it refuses on a
# multicopter.
_PX4_INFEASIBLE = """
    CONDITION_DELAY CONDITION_DISTANCE NAV_FENCE_RETURN_POINT NAV_RALLY_POINT
    NAV_FENCE_POLYGON_VERTEX_INCLUSION NAV_FENCE_POLYGON_VERTEX_EXCLUSION
    NAV_FENCE_CIRCLE_INCLUSION NAV_FENCE_CIRCLE_EXCLUSION
    NAV_VTOL_TAKEOFF NAV_VTOL_LAND DO_VTOL_TRANSITION
"""
# The parser of some versions takes these; whether the feasibility check does was not found out.
_PX4_UNKNOWN = "DO_SET_ACTUATOR SET_CAMERA_ZOOM SET_CAMERA_FOCUS"

_ARDUPILOT_FLOWN = """
    NAV_WAYPOINT NAV_LOITER_UNLIM NAV_LOITER_TURNS NAV_LOITER_TIME NAV_RETURN_TO_LAUNCH NAV_LAND
    NAV_TAKEOFF NAV_LOITER_TO_ALT NAV_SPLINE_WAYPOINT NAV_VTOL_TAKEOFF NAV_VTOL_LAND
    NAV_GUIDED_ENABLE NAV_DELAY NAV_PAYLOAD_PLACE NAV_SCRIPT_TIME NAV_ATTITUDE_TIME
    CONDITION_DELAY CONDITION_DISTANCE CONDITION_YAW DO_JUMP DO_CHANGE_SPEED DO_SET_HOME
    DO_SET_RELAY DO_REPEAT_RELAY DO_SET_SERVO DO_REPEAT_SERVO DO_RETURN_PATH_START DO_LAND_START
    DO_SET_ROI_LOCATION DO_SET_ROI_NONE DO_SET_ROI DO_DIGICAM_CONFIGURE DO_DIGICAM_CONTROL
    DO_MOUNT_CONTROL DO_SET_CAM_TRIGG_DIST DO_FENCE_ENABLE DO_PARACHUTE DO_GRIPPER
    DO_SET_RESUME_REPEAT_DIST DO_SPRAYER DO_SEND_SCRIPT_MESSAGE DO_AUX_FUNCTION DO_GUIDED_LIMITS
    SET_CAMERA_ZOOM SET_CAMERA_FOCUS SET_CAMERA_SOURCE JUMP_TAG DO_JUMP_TAG
    DO_GIMBAL_MANAGER_PITCHYAW IMAGE_START_CAPTURE IMAGE_STOP_CAPTURE VIDEO_START_CAPTURE
    VIDEO_STOP_CAPTURE DO_WINCH
"""
_ARDUPILOT_SKIPPED = """
    NAV_CONTINUE_AND_CHANGE_ALT NAV_ALTITUDE_WAIT DO_SET_MODE DO_GO_AROUND DO_SET_REVERSE
    DO_INVERTED_FLIGHT DO_AUTOTUNE_ENABLE NAV_SET_YAW_SPEED DO_ENGINE_CONTROL DO_VTOL_TRANSITION
"""
# New since 4.7, or in the parser of some versions only.
_ARDUPILOT_UNKNOWN = """
    NAV_ARC_WAYPOINT DO_SET_ROI_SYSID DO_SET_CAM_TRIGG_INTERVAL DO_MOUNT_CONFIGURE
    DO_PAUSE_CONTINUE SET_CAMERA_MODE CAMERA_TRACK_POINT CAMERA_TRACK_RECTANGLE
    CAMERA_STOP_TRACKING
"""


_FLIES_ON = """
    CONDITION_GATE DO_GRIPPER DO_WINCH DO_SPRAYER DO_SEND_SCRIPT_MESSAGE DO_AUX_FUNCTION
    DO_AUTOTUNE_ENABLE DO_ENGINE_CONTROL
"""
"""Not modelled, but the vehicle flies on as it did; what it carries may weigh less, or take power."""


def goes_on_flying(command: int, autopilot: Autopilot | None) -> bool:
    """Return whether a vehicle flies on past an item that is not modelled, as if it were not there.

    Parameters
    ----------
    command : int
        MAV_CMD number.
    autopilot : Autopilot or None
        That flies the mission, and may skip the item; ``None``: not known.
    """
    skips = autopilot is not None and support(command, autopilot) is Support.SKIPPED
    return skips or command in _load_tables().flies_on


def command_effect(command: int) -> CommandEffect:
    """Return the one class a command is in; a number MAVLink does not know is NOT_MODELLED."""
    return _load_tables().effects.get(command, CommandEffect.NOT_MODELLED)


_ARDUPILOT_SINCE: Mapping[str, tuple[int, int]] = {"NAV_ARC_WAYPOINT": (4, 7)}
"""Commands that Copter flies from a version on; before, its parser refuses them."""


def support(
    command: int,
    autopilot: Autopilot,
    *,
    frame: int | None = None,
    version: tuple[int, int] | None = None,
) -> Support:
    """Return what an autopilot does with a command in a multicopter's mission.

    Parameters
    ----------
    command : int
        MAV_CMD number; one that MAVLink does not know is refused by both autopilots.
    autopilot : Autopilot
        Step references are no autopilot: they accept everything.
    frame : int, optional
        MAV_FRAME number, on which the answer of PX4 depends; default the right one.
    version : tuple of int, optional
        Major and minor version of the firmware; default not known.

    Returns
    -------
    Support
        By the sources in `SOURCES`.
    """
    tables = _load_tables()
    if autopilot is Autopilot.STEP:
        return Support.ACCEPTED
    if autopilot is Autopilot.ARDUPILOT:
        since = tables.ardupilot_since.get(command)
        if since is not None and version is not None:
            return Support.ACCEPTED if version >= since else Support.REFUSED
        return tables.ardupilot.get(command, Support.REFUSED)
    if frame is not None:
        known = tables.px4.get(command) is not Support.UNKNOWN
        commands = _px4_commands_in(frame, tables)
        if known and command not in commands:
            return Support.REFUSED
    return tables.px4.get(command, Support.REFUSED)


@frozen
class _Tables:
    effects: Mapping[int, CommandEffect]
    px4: Mapping[int, Support]
    px4_with_position: frozenset[int]
    px4_without_position: frozenset[int]
    ardupilot: Mapping[int, Support]
    ardupilot_since: Mapping[int, tuple[int, int]]
    flies_on: frozenset[int]


def _px4_commands_in(frame: int, tables: _Tables) -> frozenset[int]:
    """Return the commands that PX4's parser takes in a frame."""
    if frame in AMSL_FRAMES | RELATIVE_FRAMES:
        return tables.px4_with_position
    if frame == Frame.MISSION:
        return tables.px4_without_position
    return frozenset()


@cache
def _load_tables() -> _Tables:
    numbers = {
        definition.name: number for number, definition in load_command_table().commands.items()
    }

    def find(names: str) -> frozenset[int]:
        return frozenset(numbers[name] for name in names.split())

    with_position, without_position = find(_PX4_WITH_POSITION), find(_PX4_WITHOUT_POSITION)
    return _Tables(
        effects={number: effect for effect in EFFECTS for number in find(EFFECTS[effect])},
        px4={
            **dict.fromkeys(with_position | without_position, Support.ACCEPTED),
            **dict.fromkeys(find(_PX4_INFEASIBLE), Support.BLOCKS_ARMING),
            **dict.fromkeys(find(_PX4_UNKNOWN), Support.UNKNOWN),
        },
        px4_with_position=with_position,
        px4_without_position=without_position,
        ardupilot={
            **dict.fromkeys(find(_ARDUPILOT_FLOWN), Support.ACCEPTED),
            **dict.fromkeys(find(_ARDUPILOT_SKIPPED), Support.SKIPPED),
            **dict.fromkeys(find(_ARDUPILOT_UNKNOWN), Support.UNKNOWN),
        },
        flies_on=find(_FLIES_ON),
        ardupilot_since={numbers[name]: since for name, since in _ARDUPILOT_SINCE.items()},
    )
