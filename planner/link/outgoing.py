"""The one gate through which every message goes out, ours and those of MAVSDK.

Nothing here ever arms, takes off, changes a mode or sets a parameter: what is not in these tables
does not leave the computer.
"""

from __future__ import annotations

from collections import Counter
from enum import Enum
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping


class Purpose(Enum):
    """What a line to a vehicle is opened for."""

    READ = "read"
    UPLOAD = "upload"
    """Mission, fence and rally points are replaced."""
    GUARD = "guard"
    """Arming is authorised or not, the verdict is announced."""


_HEARTBEAT = 0
_COMMAND_LONG = 76
_FILE_TRANSFER = 110

_READING: Mapping[int, str] = {
    _HEARTBEAT: "HEARTBEAT",
    4: "PING",
    20: "PARAM_REQUEST_READ",
    21: "PARAM_REQUEST_LIST",
    43: "MISSION_REQUEST_LIST",
    47: "MISSION_ACK",
    51: "MISSION_REQUEST_INT",
    _COMMAND_LONG: "COMMAND_LONG",
    _FILE_TRANSFER: "FILE_TRANSFER_PROTOCOL",
    111: "TIMESYNC",
    117: "LOG_REQUEST_LIST",
    119: "LOG_REQUEST_DATA",
    122: "LOG_REQUEST_END",
    412: "REQUEST_EVENT",
}
_UPLOADING: Mapping[int, str] = {44: "MISSION_COUNT", 73: "MISSION_ITEM_INT"}
_GUARDING: Mapping[int, str] = {77: "COMMAND_ACK", 253: "STATUSTEXT"}

MESSAGES: Mapping[Purpose, Mapping[int, str]] = {
    Purpose.READ: _READING,
    Purpose.UPLOAD: {**_READING, **_UPLOADING},
    Purpose.GUARD: {**_READING, **_GUARDING},
}
"""By purpose, the numbers and names of the messages that may go out."""
COMMANDS: Mapping[int, str] = {
    410: "GET_HOME_POSITION",
    511: "SET_MESSAGE_INTERVAL",
    512: "REQUEST_MESSAGE",
    519: "REQUEST_PROTOCOL_VERSION",
    520: "REQUEST_AUTOPILOT_CAPABILITIES",
}
"""The commands that may stand in a COMMAND_LONG: each asks for a message and does nothing else."""
FILE_OPERATIONS: Mapping[int, str] = {
    0: "None",
    1: "TerminateSession",
    2: "ResetSessions",
    3: "ListDirectory",
    4: "OpenFileRO",
    5: "ReadFile",
    14: "CalcFileCRC32",
    15: "BurstReadFile",
}
"""The operations of the file protocol that may go out: none of them writes."""

_COMMAND_AT = 28
"""Where the number of the command stands in the content of a COMMAND_LONG."""
_OPERATION_AT = 6
"""Where the operation stands in the content of a FILE_TRANSFER_PROTOCOL."""


class Gate:
    """Lets frames out, or not.

    Parameters
    ----------
    purpose : Purpose
        What the line was opened for.
    """

    def __init__(self, purpose: Purpose) -> None:
        self.purpose = purpose
        self.refused: Counter[str] = Counter()
        """What was held back, by the sentence that says so."""

    def lets_out(self, frame: bytes) -> bool:
        """Return whether a frame may go out; one that may not is counted.

        Parameters
        ----------
        frame : bytes
            One whole MAVLink frame of either version.
        """
        why = self._objection(frame)
        if why:
            self.refused[why] += 1
        return not why

    def _objection(self, frame: bytes) -> str:
        if len(frame) >= 12 and frame[0] == 0xFD and len(frame) >= 12 + frame[1]:
            number = int.from_bytes(frame[7:10], "little")
            content = frame[10 : 10 + frame[1]]
        elif len(frame) >= 8 and frame[0] == 0xFE and len(frame) >= 8 + frame[1]:
            number = frame[5]
            content = frame[6 : 6 + frame[1]]
        else:
            return "bytes that are no frame"
        if number not in MESSAGES[self.purpose]:
            return f"message {number}"
        if number == _COMMAND_LONG:
            command = int.from_bytes(content[_COMMAND_AT : _COMMAND_AT + 2], "little")
            return "" if command in COMMANDS else f"command {command}"
        if number == _FILE_TRANSFER:
            operation = int.from_bytes(content[_OPERATION_AT : _OPERATION_AT + 1], "little")
            return "" if operation in FILE_OPERATIONS else f"file operation {operation}"
        return ""
