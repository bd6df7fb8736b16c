"""MAVLink's mission commands: their numbers, names and parameters.

The table is generated from the dialects common and ardupilotmega as pymavlink carries them, see
``tests/generate_mavlink_commands.py``.
"""

from __future__ import annotations

import json
from enum import IntEnum
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from planner.frozen import frozen

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
    DO_JUMP = 177
    DO_CHANGE_SPEED = 178
    DO_SET_HOME = 179
    DO_RETURN_PATH_START = 188
    DO_LAND_START = 189
    DO_GO_AROUND = 191
    DO_SET_REVERSE = 194
    DO_SET_ROI_LOCATION = 195
    DO_SET_ROI = 201
    DO_SET_CAM_TRIGG_DIST = 206
    DO_INVERTED_FLIGHT = 210
    NAV_SET_YAW_SPEED = 213
    JUMP_TAG = 600
    DO_JUMP_TAG = 601
    DO_VTOL_TRANSITION = 3000
    CONDITION_GATE = 4501
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
"""Positions in degrees."""

UNSET_YAW = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LAND, Command.NAV_TAKEOFF),
        *(Command.NAV_ARC_WAYPOINT, Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND),
    }
)
"""Commands whose fourth parameter ArduPilot lets be no number; it refuses all others."""


@frozen
class CommandDefinition:
    """What MAVLink says about one command."""

    name: str
    """Without the ``MAV_CMD_`` prefix."""
    has_location: bool
    """Whether parameters 5 to 7 are a place."""
    is_destination: bool
    """Whether the vehicle goes to that place."""
    parameters: tuple[str, ...]
    """The seven parameters' names, ``""`` where one is not used."""


@frozen
class CommandTable:
    """MAVLink's enumerations MAV_CMD and MAV_FRAME."""

    commands: Mapping[int, CommandDefinition]
    frames: Mapping[int, str]


@cache
def load_command_table() -> CommandTable:
    """Return the generated table; read once, on first use."""
    text = Path(__file__).with_name("mavlink_commands.json").read_text("utf-8")
    table = json.loads(text)
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


def command_name(command: int) -> str:
    """Return ``NAV_WAYPOINT`` for 16; ``MAV_CMD 50001`` for a number MAVLink does not know."""
    definition = load_command_table().commands.get(command)
    return f"MAV_CMD {command}" if definition is None else definition.name


def parameter_names(command: int) -> tuple[str, ...]:
    """Return the seven names of a command's parameters, ``""`` where one is not used or unknown."""
    definition = load_command_table().commands.get(command)
    return ("",) * 7 if definition is None else definition.parameters


def has_location(command: int) -> bool:
    """Return whether parameters 5 to 7 of a command are a place; ``False`` if it is not known."""
    definition = load_command_table().commands.get(command)
    return definition is not None and definition.has_location


def is_destination(command: int) -> bool:
    """Return whether the vehicle goes to the place of a command; ``False`` if it is not known."""
    definition = load_command_table().commands.get(command)
    return definition is not None and definition.is_destination


def frame_name(frame: int) -> str:
    """Return ``GLOBAL_RELATIVE_ALT`` for 3; ``MAV_FRAME 99`` for a number MAVLink does not know."""
    return load_command_table().frames.get(frame, f"MAV_FRAME {frame}")
