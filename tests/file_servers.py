"""File servers in the manners of PX4 (mavlink_ftp.cpp) and ArduPilot (GCS_FTP.cpp), without a line."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING

from planner.link.files import _HEAD, FilePacket, Operation
from planner.link.wire import Message

if TYPE_CHECKING:
    from collections.abc import Mapping

_FAIL, _FAIL_ERRNO, _INVALID_SESSION, _NO_SESSIONS, _END, _NOT_FOUND = 1, 2, 4, 5, 6, 10
_BURST = 10
"""Pieces of a burst: PX4's are of 35 kB, ArduPilot's of 2000 pieces."""


def bitwise_crc32(data: bytes) -> int:
    """Return the CRC-32 of reflected polynomial 0xEDB88320, begun at 0 and not inverted."""
    crc = 0
    for byte in data:
        crc ^= byte
        for _ in range(8):
            crc = crc >> 1 ^ (0xEDB88320 if crc & 1 else 0)
    return crc


class FileServer:
    """Folders and files by their paths; each request has its answers."""

    def __init__(self, files: Mapping[str, bytes]) -> None:
        self.files = files
        self.has_checksums = True
        self.requests: list[int] = []
        """Operations asked for, in order."""

    def __call__(self, request: Message) -> list[Message]:
        payload = bytes(request["payload"])
        number, session, operation, size, _, _, offset = _HEAD.unpack_from(payload)
        self.requests.append(operation)
        asked = FilePacket(
            number=number,
            operation=operation,
            session=session,
            size=size,
            offset=offset,
            content=payload[_HEAD.size : _HEAD.size + size],
        )
        return [_message(one, answered=operation) for one in self.answers(asked)]

    def answers(self, asked: FilePacket) -> list[FilePacket]:
        """Return what is said to a request."""
        raise NotImplementedError

    def _listed(self, asked: FilePacket) -> list[FilePacket]:
        folder = asked.content.decode()
        inside = [path[len(folder) + 1 :] for path in self.files if path.startswith(f"{folder}/")]
        if not inside:
            return [_nak(asked, _NOT_FOUND)]
        folders = {name.split("/")[0] for name in inside if "/" in name}
        entries = ["S", *(f"D{name}" for name in sorted(folders))]
        entries += [
            f"F{name}\t{len(self.files[f'{folder}/{name}'])}" for name in inside if "/" not in name
        ]
        left = entries[asked.offset : asked.offset + 2]
        if not left:
            return [_nak(asked, _END)]
        return [_ack(asked, content="".join(f"{one}\0" for one in left).encode())]

    def _checked(self, asked: FilePacket) -> list[FilePacket]:
        found = self.files.get(asked.content.decode())
        if found is None or not self.has_checksums:
            return [_nak(asked, _FAIL_ERRNO)]
        return [_ack(asked, content=struct.pack("<I", bitwise_crc32(found)))]

    def _burst(self, asked: FilePacket, content: bytes) -> list[FilePacket]:
        starts = range(asked.offset, min(asked.offset + _BURST * 239, len(content)), 239)
        said = [
            _ack(
                asked,
                content=content[at : at + 239],
                offset=at,
                later=later,
                is_last=later == _BURST - 1,
            )
            for later, at in enumerate(starts)
        ]
        if len(starts) < _BURST:
            said.append(_nak(asked, _END, later=len(starts)))
        return said


class Px4Files(FileServer):
    """One session, of whoever; a number that was answered last is answered the same again."""

    def __init__(self, files: Mapping[str, bytes], *, is_open: bool = False) -> None:
        super().__init__(files)
        self.opened: bytes | None = b"another's" if is_open else None
        self._last: tuple[int, FilePacket] | None = None

    def answers(self, asked: FilePacket) -> list[FilePacket]:
        if self._last is not None and self._last[0] == asked.number:
            return [self._last[1]]
        said = self._answers(asked)
        self._last = None
        if said and len(said[-1].content) <= 4:
            self._last = (said[-1].number - 1, said[-1])
        return said

    def _answers(self, asked: FilePacket) -> list[FilePacket]:  # noqa: C901, PLR0911 - one for each case
        if asked.operation == Operation.LIST_DIRECTORY:
            return self._listed(asked)
        if asked.operation == Operation.CALC_FILE_CRC32:
            return self._checked(asked)
        if asked.operation == Operation.OPEN_FILE_RO:
            if self.opened is not None:
                return [_nak(asked, _NO_SESSIONS)]
            self.opened = self.files.get(asked.content.decode())
            if self.opened is None:
                return [_nak(asked, _NOT_FOUND)]
            return [_ack(asked, content=struct.pack("<I", len(self.opened)))]
        if asked.operation == Operation.RESET_SESSIONS:
            self.opened = None
            return [_ack(asked)]
        if asked.operation == Operation.TERMINATE_SESSION:
            if self.opened is None:
                return [_nak(asked, _INVALID_SESSION)]
            self.opened = None
            return [_ack(asked)]
        if self.opened is None:
            is_burst = asked.operation == Operation.BURST_READ_FILE
            return [_nak(asked, _FAIL_ERRNO if is_burst else _INVALID_SESSION)]
        if asked.operation == Operation.READ_FILE:
            if asked.offset >= len(self.opened):
                return [_nak(asked, _END)]
            # Whatever size is asked for, it reads as much as fits.
            piece = self.opened[asked.offset : asked.offset + 239]
            return [_ack(asked, content=piece, offset=asked.offset)]
        return self._burst(asked, self.opened)


class ArdupilotFiles(FileServer):
    """Few sessions, each of which is kept for a while; session 0 has a new one made."""

    def __init__(self, files: Mapping[str, bytes], *, sessions: int = 5) -> None:
        super().__init__(files)
        self._most = sessions
        self.sessions: dict[int, bytes | None] = {}
        """The open file of each, by its number."""
        self._next = 1

    def forget(self) -> None:
        """Let the time pass after which idle sessions are closed."""
        self.sessions.clear()

    def answers(self, asked: FilePacket) -> list[FilePacket]:  # noqa: C901, PLR0911 - one for each case
        if asked.operation == Operation.RESET_SESSIONS:
            self.sessions.clear()
            return [_ack(asked)]
        session = asked.session
        if session not in self.sessions:
            if len(self.sessions) >= self._most:
                return [_nak(asked, _NO_SESSIONS)]
            if session == 0:
                session, self._next = self._next, self._next + 1
            self.sessions[session] = None
        asked = FilePacket(
            number=asked.number,
            operation=asked.operation,
            session=session,
            size=asked.size,
            offset=asked.offset,
            content=asked.content,
        )
        opened = self.sessions[session]
        if asked.operation == Operation.LIST_DIRECTORY:
            return self._listed(asked)
        if asked.operation == Operation.CALC_FILE_CRC32:
            return self._checked(asked)
        if asked.operation == Operation.OPEN_FILE_RO:
            if opened is not None:
                return [_nak(asked, _FAIL)]
            found = self.files.get(asked.content.decode())
            if found is None:
                return [_nak(asked, _NOT_FOUND)]
            self.sessions[session] = found
            return [_ack(asked, content=struct.pack("<I", len(found)))]
        if asked.operation == Operation.TERMINATE_SESSION:
            del self.sessions[session]
            return [_ack(asked)]
        if opened is None:
            return [_nak(asked, _NOT_FOUND)]
        if asked.operation == Operation.READ_FILE:
            piece = opened[asked.offset : asked.offset + asked.size]
            return [_ack(asked, content=piece, offset=asked.offset) if piece else _nak(asked, _END)]
        return self._burst(asked, opened)


def _ack(
    asked: FilePacket,
    *,
    content: bytes = b"",
    offset: int = 0,
    later: int = 0,
    is_last: bool = False,
) -> FilePacket:
    return FilePacket(
        number=(asked.number + 1 + later) & 0xFFFF,
        operation=Operation.ACK,
        session=asked.session,
        size=len(content),
        is_last=is_last,
        offset=offset,
        content=content,
    )


def _nak(asked: FilePacket, error: int, *, later: int = 0) -> FilePacket:
    return FilePacket(
        number=(asked.number + 1 + later) & 0xFFFF,
        operation=Operation.NAK,
        session=asked.session,
        size=1,
        content=bytes([error]),
    )


def _message(packet: FilePacket, *, answered: int) -> Message:
    head = _HEAD.pack(
        packet.number,
        packet.session,
        packet.operation,
        len(packet.content),
        answered,
        int(packet.is_last),
        packet.offset,
    )
    payload = (head + packet.content).ljust(251, b"\0")
    return Message(name="FILE_TRANSFER_PROTOCOL", fields={"payload": payload})
