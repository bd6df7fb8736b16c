"""The packets of MAVLink's file protocol, of which one fills a FILE_TRANSFER_PROTOCOL."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import TYPE_CHECKING

from planner.frozen import frozen
from planner.link.message import message

if TYPE_CHECKING:
    from planner.link.message import Message

_HEAD = struct.Struct("<HBBBBBxI")
MOST_CONTENT = 239
"""Bytes that one packet has room for. [B]"""
_NAME = "FILE_TRANSFER_PROTOCOL"


class Operation(IntEnum):
    """What is asked for, of operations that only read."""

    TERMINATE_SESSION = 1
    RESET_SESSIONS = 2
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    CALC_FILE_CRC32 = 14
    BURST_READ_FILE = 15
    ACK = 128
    NAK = 129


class FileError(IntEnum):
    """Why something is refused, as far as it is acted upon."""

    FAIL = 1
    NO_SESSIONS = 5
    END_OF_FILE = 6


@frozen
class FilePacket:
    """The content of a FILE_TRANSFER_PROTOCOL."""

    number: int
    """Of the request; answers count on from it."""
    operation: int
    session: int = 0
    size: int = 0
    answered: int = 0
    """In an answer, the operation that is answered."""
    is_last: bool = False
    """In an answer to a burst, whether it is the last."""
    offset: int = 0
    content: bytes = b""

    @property
    def error(self) -> int:
        """In a refusal, why."""
        return self.content[0] if self.content else 0


def read_packet(received: Message) -> FilePacket | None:
    """Return what a message holds; ``None`` where it is no answer of the file protocol."""
    if received.name != _NAME:
        return None
    payload = bytes(received["payload"]).ljust(251, b"\0")
    number, session, operation, size, answered, last, offset = _HEAD.unpack_from(payload)
    if operation not in {Operation.ACK, Operation.NAK}:
        return None
    content = payload[_HEAD.size : _HEAD.size + min(size, MOST_CONTENT)]
    return FilePacket(
        number=number,
        operation=operation,
        session=session,
        size=size,
        answered=answered,
        is_last=bool(last),
        offset=offset,
        content=content,
    )


def packet_message(packet: FilePacket) -> Message:
    """Return a request as a message."""
    size = packet.size or len(packet.content)
    head = _HEAD.pack(
        packet.number & 0xFFFF, packet.session, packet.operation, size, 0, 0, packet.offset
    )
    return message(_NAME, payload=(head + packet.content).ljust(251, b"\0"))


class FileNumbers:
    """Numbers of the requests on one line: each greater than all that were used or seen.

    PX4 answers the number that it answered last by the same answer, whatever is asked and whoever
    asks (``MavlinkFTP::_process_request``): no two requests may have one.

    Parameters
    ----------
    start : int
        Any; best another one for each line.
    """

    def __init__(self, start: int) -> None:
        self._last = start

    def following(self, *, leaving: int = 0) -> int:
        """Return a new number, leaving out some."""
        self._last = (self._last + leaving + 1) & 0xFFFF
        return self._last

    def see(self, number: int) -> None:
        """Take the number of an answer: those of a burst count on from its request."""
        if is_after(number, self._last):
            self._last = number


def is_after(number: int, other: int) -> bool:
    """Return whether a number of 16 bits comes after another one."""
    return 0 < (number - other) & 0xFFFF < 0x8000
