"""The checksum of a file on a vehicle, by MAVLink's file protocol, and of one on disk."""

from __future__ import annotations

import struct
import zlib
from dataclasses import replace
from typing import TYPE_CHECKING

from planner.link.exchange import Exchange
from planner.link.file_packet import (
    MOST_CONTENT,
    FileError,
    FilePacket,
    Operation,
    packet_message,
    read_packet,
)

if TYPE_CHECKING:
    from pathlib import Path

    from planner.link.file_packet import FileNumbers
    from planner.link.message import Message
    from planner.link.settings import LinkSettings

_LEAST_WAIT_S = 5.0
"""A vehicle reads the whole file before it answers: some 10 s for 50 MB off a slow card. [s]"""
_TRIES = 8
_ONES = 0xFFFFFFFF
_PIECE = 1 << 20


class FileChecksum(Exchange):
    """The checksum of one file, which a vehicle may not tell.

    Parameters
    ----------
    path : str
        On the vehicle.
    settings : LinkSettings
        How patient to be.
    numbers : FileNumbers
        Those of the line.
    """

    def __init__(self, path: str, settings: LinkSettings, numbers: FileNumbers) -> None:
        patient = replace(settings, reply_timeout_s=max(settings.reply_timeout_s, _LEAST_WAIT_S))
        super().__init__(patient, retries=_TRIES)
        self._path = path
        self._numbers = numbers
        # Asked again by the same number, PX4 repeats what it said instead of reading the file anew.
        self._number = numbers.following()
        self.value: int | None = None
        """As `crc32_of` has it; ``None`` where the vehicle tells none."""

    @property
    def progress(self) -> tuple[int, int | None]:
        """Whether it is there."""
        return int(self.is_done), None

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every exchange
        """Take a message of the vehicle."""
        packet = read_packet(received)
        if packet is None or packet.number != (self._number + 1) & 0xFFFF:
            return ()
        self._numbers.see(packet.number)
        if packet.operation == Operation.NAK and packet.error == FileError.NO_SESSIONS:
            self._number = self._numbers.following()
            return ()  # asked again when the time has come
        if packet.operation == Operation.ACK and len(packet.content) >= 4:
            (self.value,) = struct.unpack_from("<I", packet.content)
        self.is_done = True
        return ()

    def _requests(self) -> tuple[Message, ...]:
        asked = FilePacket(
            number=self._number,
            operation=Operation.CALC_FILE_CRC32,
            content=self._path.encode()[:MOST_CONTENT],
        )
        return (packet_message(asked),)

    def _give_up(self, now_s: float) -> None:  # noqa: ARG002 - as every exchange
        self.is_done = True


def crc32_of(path: Path) -> int:
    """Return the checksum of a file as vehicles compute it.

    That is the CRC-32 of ISO 3309, reflected polynomial 0xEDB88320, begun at 0 and not inverted
    (PX4's ``crc32part``, ArduPilot's ``crc_crc32``); zlib's is begun at all ones and inverted.

    Raises
    ------
    OSError
        If it cannot be read.
    """
    value = _ONES
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            value = zlib.crc32(piece, value)
    return value ^ _ONES
