"""MAVLink's mission commands: their numbers, names and parameters.

The table is generated from the dialects common and ardupilotmega as pymavlink carries them, see
``tests/generate_mavlink_commands.py``.
"""

from __future__ import annotations

from enum import IntEnum, StrEnum
from functools import cache, lru_cache
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from planner.autopilot import Autopilot
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping


class Command(IntEnum):
    """The commands this program speaks about by name."""

    NAV_WAYPOINT = 16
    NAV_LOITER_UNLIM = 17
    NAV_LOITER_TURNS = 18
    NAV_LOITER_TIME = 19
    NAV_RETURN_TO_LAUNCH = 20
    NAV_LAND = 21
    NAV_TAKEOFF = 22
    NAV_CONTINUE_AND_CHANGE_ALT = 30
    NAV_LOITER_TO_ALT = 31
    NAV_ARC_WAYPOINT = 36
    NAV_ROI = 80
    NAV_SPLINE_WAYPOINT = 82
    NAV_ALTITUDE_WAIT = 83
    NAV_VTOL_TAKEOFF = 84
    NAV_VTOL_LAND = 85
    NAV_GUIDED_ENABLE = 92
    NAV_DELAY = 93
    NAV_PAYLOAD_PLACE = 94
    CONDITION_DELAY = 112
    CONDITION_DISTANCE = 114
    CONDITION_YAW = 115
    DO_FENCE_ENABLE = 207
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_RETURN_PATH_START = 188
    DO_LAND_START = 189
    DO_GO_AROUND = 191
    DO_SET_REVERSE = 194
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI_WPNEXT_OFFSET = 196
    DO_SET_ROI_NONE = 197
    DO_SET_ROI = 201
    DO_SET_CAM_TRIGG_DIST = 206
    DO_INVERTED_FLIGHT = 210
    DO_PARACHUTE = 208
    DO_GRIPPER = 211
    DO_AUX_FUNCTION = 218
    NAV_SET_YAW_SPEED = 213
    JUMP_TAG = 600
    DO_JUMP_TAG = 601
    DO_GIMBAL_MANAGER_PITCHYAW = 1000
    DO_VTOL_TRANSITION = 3000
    CONDITION_GATE = 4501
    DO_WINCH = 42600
    NAV_FENCE_RETURN_POINT = 5000
    NAV_FENCE_POLYGON_VERTEX_INCLUSION = 5001
    NAV_FENCE_POLYGON_VERTEX_EXCLUSION = 5002
    NAV_FENCE_CIRCLE_INCLUSION = 5003
    NAV_FENCE_CIRCLE_EXCLUSION = 5004
    NAV_RALLY_POINT = 5100


class Frame(IntEnum):
    """The coordinate frames a mission item is written in."""

    GLOBAL = 0
    LOCAL_NED = 1
    MISSION = 2
    GLOBAL_RELATIVE_ALT = 3
    LOCAL_ENU = 4
    GLOBAL_INT = 5
    GLOBAL_RELATIVE_ALT_INT = 6
    GLOBAL_TERRAIN_ALT = 10
    GLOBAL_TERRAIN_ALT_INT = 11


AMSL_FRAMES = frozenset({Frame.GLOBAL, Frame.GLOBAL_INT})
"""Altitude above mean sea level."""
RELATIVE_FRAMES = frozenset({Frame.GLOBAL_RELATIVE_ALT, Frame.GLOBAL_RELATIVE_ALT_INT})
"""Height above home."""
TERRAIN_FRAMES = frozenset({Frame.GLOBAL_TERRAIN_ALT, Frame.GLOBAL_TERRAIN_ALT_INT})
"""Height above the terrain."""
GLOBAL_FRAMES = AMSL_FRAMES | RELATIVE_FRAMES | TERRAIN_FRAMES
TAKEOFFS = frozenset({Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF})
LANDINGS = frozenset({Command.NAV_LAND, Command.NAV_VTOL_LAND})
"""They end on the ground, whatever their altitude."""
"""Positions in degrees."""

UNSET_YAW = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LAND, Command.NAV_TAKEOFF),
        *(Command.NAV_ARC_WAYPOINT, Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND),
    }
)
"""Commands whose fourth parameter ArduPilot lets be no number; it refuses all others."""

ROIS_BY_MODE = (Command.NAV_ROI, Command.DO_SET_ROI)
"""Commands of a region of interest whose first parameter is a MAV_ROI."""
ROI_LOCATION = 3
_PX4_ROI_MODES = {True: frozenset({0, ROI_LOCATION}), False: frozenset({0, 1, 2})}
"""MAV_ROI that PX4 takes with a place, and without: MAV_ROI_NONE, _WPNEXT, _WPINDEX, _LOCATION."""

NEEDS_ALTITUDE = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TURNS),
        *(Command.NAV_LOITER_TIME, Command.NAV_LOITER_TO_ALT, Command.NAV_SPLINE_WAYPOINT),
        *(Command.NAV_LAND, Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND),
        *(Command.NAV_ARC_WAYPOINT, Command.NAV_CONTINUE_AND_CHANGE_ALT, Command.NAV_PAYLOAD_PLACE),
        *(Command.NAV_GUIDED_ENABLE, Command.DO_SET_HOME, Command.DO_RETURN_PATH_START),
        *(
            Command.DO_LAND_START,
            Command.DO_GO_AROUND,
            Command.DO_SET_ROI,
            Command.DO_SET_ROI_LOCATION,
        ),
        Command.DO_GIMBAL_MANAGER_PITCHYAW,
    }
)
"""Commands whose seventh parameter ArduPilot takes: all others may have no number there.

Those it keeps as a place (``AP_Mission::stored_in_location``; 4.7.0-dev refuses just these at upload), and
the gimbal's device, over which that build stops.
"""


class CommandDefinition(Value):
    """MAVLink's definition of one command."""

    name: str
    """Without the ``MAV_CMD_`` prefix."""
    has_location: bool
    """Whether parameters 5 to 7 are a place."""
    is_destination: bool
    """Whether the vehicle goes to that place."""
    parameters: tuple[str, ...]
    """The seven parameters' names, ``""`` where one is not used."""


_UNKNOWN = CommandDefinition(
    name="", has_location=False, is_destination=False, parameters=("",) * 7
)


class CommandTable(Value):
    """MAVLink's enumerations MAV_CMD and MAV_FRAME."""

    commands: Mapping[int, CommandDefinition]
    frames: Mapping[int, str]


@cache
def load_command_table() -> CommandTable:
    """Return the generated table; read once, on first use."""
    table = msgspec.json.decode(Path(__file__).with_name("mavlink_commands.json").read_bytes())
    return CommandTable(
        commands={
            int(number): CommandDefinition(
                name=name,
                has_location=has_location,
                is_destination=is_destination,
                parameters=tuple(parameters),
            )
            for number, (name, has_location, is_destination, *parameters) in table[
                "commands"
            ].items()
        },
        frames={int(number): name for number, name in table["frames"].items()},
    )


@lru_cache(maxsize=1024)  # the same few of thousands of items
def command_name(command: int) -> str:
    """Return ``NAV_WAYPOINT`` for 16; ``MAV_CMD 50001`` for a number MAVLink does not know."""
    definition = load_command_table().commands.get(command)
    return f"MAV_CMD {command}" if definition is None else definition.name


def parameter_names(command: int) -> tuple[str, ...]:
    """Return the seven names of a command's parameters, ``""`` where one is not used or unknown."""
    return load_command_table().commands.get(command, _UNKNOWN).parameters


def has_location(command: int) -> bool:
    """Return whether parameters 5 to 7 of a command are a place; ``False`` if it is not known."""
    return load_command_table().commands.get(command, _UNKNOWN).has_location


def is_destination(command: int) -> bool:
    """Return whether the vehicle goes to the place of a command; ``False`` if it is not known."""
    return load_command_table().commands.get(command, _UNKNOWN).is_destination


def frame_name(frame: int) -> str:
    """Return ``GLOBAL_RELATIVE_ALT`` for 3; ``MAV_FRAME 99`` for a number MAVLink does not know."""
    return load_command_table().frames.get(frame, f"MAV_FRAME {frame}")


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


# Where the answers of `support` come from:
# PX4 mavlink_mission.cpp (parse_mavlink_mission_item) and FeasibilityChecker.cpp
# (checkMissionItemValidity), 1.16 to early 2026; ArduPilot AP_Mission.cpp (mavlink_int_to_mission_cmd,
# start_command), Copter mode_auto.cpp (start_command), 4.1 to 4.7; camera commands by ardupilot.org,
# 4.4 to 4.6.

EFFECTS: Mapping[CommandEffect, str] = {
    CommandEffect.MODELLED: """
        NAV_WAYPOINT NAV_LOITER_UNLIM NAV_LOITER_TURNS NAV_LOITER_TIME NAV_RETURN_TO_LAUNCH
        NAV_LAND NAV_TAKEOFF NAV_LOITER_TO_ALT NAV_SPLINE_WAYPOINT NAV_DELAY DO_JUMP
        DO_CHANGE_SPEED DO_SET_HOME DO_FENCE_ENABLE JUMP_TAG DO_JUMP_TAG
    """,
    # The CONDITION commands hold back the DO commands behind them: `planner.mission.route.queue`.
    CommandEffect.NO_EFFECT: """
        NAV_ROI CONDITION_DELAY CONDITION_DISTANCE CONDITION_YAW DO_SET_RELAY DO_REPEAT_RELAY
        DO_SET_SERVO DO_REPEAT_SERVO DO_SET_ACTUATOR DO_RETURN_PATH_START DO_LAND_START
        DO_SET_ROI_LOCATION DO_SET_ROI_WPNEXT_OFFSET DO_SET_ROI_NONE DO_SET_ROI_SYSID
        DO_CONTROL_VIDEO DO_SET_ROI DO_DIGICAM_CONFIGURE DO_DIGICAM_CONTROL DO_MOUNT_CONFIGURE
        DO_MOUNT_CONTROL DO_MOUNT_CONTROL_QUAT DO_SET_CAM_TRIGG_DIST DO_SET_CAM_TRIGG_INTERVAL
        DO_SET_RESUME_REPEAT_DIST DO_GUIDED_LIMITS OBLIQUE_SURVEY
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
# Flown by 1.17, which refuses SET_CAMERA_ZOOM; of other versions and frames it was not found out.
_PX4_UNKNOWN = "DO_SET_ACTUATOR SET_CAMERA_FOCUS SET_CAMERA_SOURCE"

# ``FeasibilityChecker::checkTakeoff``, 1.14 to early 2026: after anything else a take-off is refused.
_PX4_BEFORE_TAKEOFF = """
    NAV_DELAY DO_JUMP DO_CHANGE_SPEED DO_SET_HOME DO_SET_SERVO DO_LAND_START DO_TRIGGER_CONTROL
    DO_DIGICAM_CONTROL IMAGE_START_CAPTURE IMAGE_STOP_CAPTURE VIDEO_START_CAPTURE VIDEO_STOP_CAPTURE
    DO_CONTROL_VIDEO DO_MOUNT_CONFIGURE DO_MOUNT_CONTROL DO_GIMBAL_MANAGER_PITCHYAW
    DO_GIMBAL_MANAGER_CONFIGURE DO_SET_ROI DO_SET_ROI_LOCATION DO_SET_ROI_WPNEXT_OFFSET DO_SET_ROI_NONE
    DO_SET_CAM_TRIGG_DIST OBLIQUE_SURVEY DO_SET_CAM_TRIGG_INTERVAL SET_CAMERA_MODE SET_CAMERA_ZOOM
    SET_CAMERA_FOCUS SET_CAMERA_SOURCE DO_VTOL_TRANSITION
"""

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
    NAV_CONTINUE_AND_CHANGE_ALT NAV_ALTITUDE_WAIT DO_GO_AROUND DO_SET_REVERSE DO_PAUSE_CONTINUE
    DO_INVERTED_FLIGHT DO_AUTOTUNE_ENABLE NAV_SET_YAW_SPEED DO_ENGINE_CONTROL DO_VTOL_TRANSITION
"""
_LATER_NAVIGATION = frozenset({"NAV_SET_YAW_SPEED", "NAV_SCRIPT_TIME", "NAV_ATTITUDE_TIME"})
# In the parser of some versions only: the second is refused by 4.7, passed over before.
_ARDUPILOT_UNKNOWN = "NAV_ARC_WAYPOINT DO_SET_MODE"


_FLIES_ON = """
    CONDITION_GATE DO_GRIPPER DO_WINCH DO_SPRAYER DO_AUTOTUNE_ENABLE DO_SEND_SCRIPT_MESSAGE
"""
"""Not modelled, but the vehicle flies on as it did; what it carries may weigh less, or take power.  A message
to a script hands nothing over to it, as NAV_SCRIPT_TIME does (``AP_Mission::start_command_do_scripting``)."""
# fmt: off
_LOAD_FUNCTIONS = frozenset({
    0, 9, 15, 19, 27, 28, 29, 30, 34, 35, 36, 44, 45, 66, 67, 94, 102, 113, 163, 164, 166, 167, 168, 169,
    171, 174, 175, 177,
})
# fmt: on
"""Auxiliary functions of what a vehicle carries: camera, mount, gripper, winch, sprayer, relays, landing
gear, lights, log (``AUX_FUNC`` of ArduPilot's RC_Channel.h).  Any other may change how it flies: its mode,
its fence, its motors."""


PARACHUTE_OFF, PARACHUTE_ON = 0.0, 1.0
"""First parameters of DO_PARACHUTE that switch it off and on; 2 releases it (``ModeAuto::do_parachute``)."""


def goes_on_flying(command: int, param1: float | None, autopilot: Autopilot | None) -> bool:
    """Return whether a vehicle flies on past an item that is not modelled, as if it were not there.

    An autopilot that is known may skip it.
    """
    if command == Command.DO_AUX_FUNCTION:
        return param1 in _LOAD_FUNCTIONS
    if command == Command.DO_PARACHUTE:
        return param1 in {PARACHUTE_OFF, PARACHUTE_ON}
    skips = autopilot is not None and support(command, autopilot) is Support.SKIPPED
    return skips or command in _load_tables().flies_on


_LAST_NAVIGATION = 95
"""MAV_CMD_NAV_LAST."""


def is_navigation(command: int) -> bool:
    """Return whether ArduPilot takes a command for navigation, not for a condition or an action.

    ``AP_Mission::is_nav_cmd``.
    """
    return command <= _LAST_NAVIGATION or command_name(command) in _LATER_NAVIGATION


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

    Both autopilots refuse a command that MAVLink does not know; step references accept everything.  The
    answer of PX4 depends on the frame, by default the right one; the version may be unknown.
    """
    tables = _load_tables()
    if autopilot is Autopilot.STEP:
        return Support.ACCEPTED
    if autopilot is Autopilot.ARDUPILOT:
        since = tables.ardupilot_since.get(command)
        if since is not None and version is not None:
            return Support.ACCEPTED if version >= since else Support.REFUSED
        return tables.ardupilot.get(command, Support.REFUSED)
    answer = tables.px4.get(command, Support.REFUSED)
    if frame is None or answer is Support.UNKNOWN:
        return answer
    if frame in AMSL_FRAMES | RELATIVE_FRAMES:
        taken = tables.px4_with_position
    else:
        taken = tables.px4_without_position if frame == Frame.MISSION else frozenset()
    return answer if command in taken else Support.REFUSED


def px4_takes_roi(mode: float | None, frame: int) -> bool:
    """Return whether PX4 takes one of `ROIS_BY_MODE` with a first parameter (``parse_mavlink_mission_item``).

    Not a number is none on the processors it flies on.
    """
    return int(mode or 0.0) in _PX4_ROI_MODES[frame != Frame.MISSION]


def px4_takes_off_after(command: int) -> bool:
    """Return whether PX4 accepts a take-off behind a command: not behind one that it counts as a place."""
    return command in _load_tables().px4_before_takeoff


class _Tables(Value):
    effects: Mapping[int, CommandEffect]
    px4: Mapping[int, Support]
    px4_with_position: frozenset[int]
    px4_without_position: frozenset[int]
    px4_before_takeoff: frozenset[int]
    ardupilot: Mapping[int, Support]
    ardupilot_since: Mapping[int, tuple[int, int]]
    flies_on: frozenset[int]


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
        px4_before_takeoff=find(_PX4_BEFORE_TAKEOFF),
        ardupilot={
            **dict.fromkeys(find(_ARDUPILOT_FLOWN), Support.ACCEPTED),
            **dict.fromkeys(find(_ARDUPILOT_SKIPPED), Support.SKIPPED),
            **dict.fromkeys(find(_ARDUPILOT_UNKNOWN), Support.UNKNOWN),
        },
        flies_on=find(_FLIES_ON),
        ardupilot_since={numbers[name]: since for name, since in _ARDUPILOT_SINCE.items()},
    )
