"""The files of a simulated vehicle, served for reading as PX4 and ArduPilot serve theirs.

Sources: PX4's ``mavlink_ftp.cpp``; ArduPilot's ``GCS_FTP.cpp``, and of the files that it makes up when they
are opened ``AP_Filesystem_Param.cpp`` and ``AP_Filesystem_Mission.cpp``.
"""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING, TypeAlias

from planner.autopilot import Autopilot
from planner.link.files import (
    MOST_CONTENT,
    FileError,
    FilePacket,
    Operation,
    packet_message,
    read_packet,
)
from planner.simulator.servers import NEVER_S
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.wire import Message

_MADE_UP = "@"
"""Begins the names of files that are not on the card, and in no folder."""
_MADE_UP_SIZE = 1 << 20
"""ArduPilot gives a size of such a file that is never reached."""
_BURST = 200
"""Pieces of one burst: PX4's are of 35 kB, ArduPilot's of 2000 pieces."""
_SESSIONS = 5
_IDLE_S = 3.0
"""ArduPilot closes what is not read for so long where another session is wanted. [s]"""
_ONES = 0xFFFFFFFF


_Owner: TypeAlias = tuple[int, int, int]
"""System, component and session of who asks; of PX4 all are one."""


class _Session:
    """One open file, or none yet."""

    def __init__(self) -> None:
        self.content: bytes | None = None
        self.used_s = 0.0


class FileServer:
    """Folders and files by their paths; PX4 has one session for all, ArduPilot some for each station."""

    def __init__(self, autopilot: Autopilot, files: Mapping[str, Callable[[], bytes]]) -> None:
        self._is_px4 = autopilot is Autopilot.PX4
        self._files = files
        self._sessions: dict[_Owner, _Session] = {}
        self._last: FilePacket | None = None
        """PX4 gives its last answer again to whoever asks by the same number."""
        self.deadline_s = NEVER_S

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        asked = read_packet(received, answers=False)
        if asked is None:
            return ()
        if self._is_px4 and self._last is not None and _number(asked, 1) == self._last.number:
            found = [self._last]
        else:
            owner = (received.system, received.component, asked.session)
            found = self._answers(asked, (0, 0, 0) if self._is_px4 else owner, now_s)
            is_short = bool(found) and len(found[-1].content) <= 4
            self._last = found[-1] if is_short else None
        return tuple(
            packet_message(
                replace(one, answered=asked.operation),
                target_system=received.system,
                target_component=received.component,
            )
            for one in found
        )

    def expire(self, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every server
        """Do nothing: every answer comes at once."""
        return ()

    def _answers(self, asked: FilePacket, owner: _Owner, now_s: float) -> list[FilePacket]:
        if asked.operation == Operation.RESET_SESSIONS:
            self._sessions = {
                one: session for one, session in self._sessions.items() if one[:2] != owner[:2]
            }
            return [_ack(asked)]
        session = self._session(owner, now_s)
        if session is None:
            return [_nak(asked, FileError.NO_SESSIONS)]
        session.used_s = now_s
        answers: dict[int, Callable[[FilePacket, _Session], list[FilePacket]]] = {
            Operation.LIST_DIRECTORY: self._listed,
            Operation.CALC_FILE_CRC32: self._checked,
            Operation.OPEN_FILE_RO: self._opened,
            Operation.TERMINATE_SESSION: self._ended,
            Operation.READ_FILE: self._pieces,
            Operation.BURST_READ_FILE: self._pieces,
        }
        answer = answers.get(asked.operation)
        if answer is None:
            return [_nak(asked, FileError.UNKNOWN_COMMAND)]
        return answer(asked, session)

    def _session(self, owner: _Owner, now_s: float) -> _Session | None:
        """Return the session of who asks, a new one for a new one; ``None`` where all are in use."""
        if owner not in self._sessions and len(self._sessions) >= _SESSIONS:
            oldest = min(self._sessions, key=lambda one: self._sessions[one].used_s)
            if now_s - self._sessions[oldest].used_s < _IDLE_S:
                return None
            del self._sessions[oldest]
        return self._sessions.setdefault(owner, _Session())

    def _ended(self, asked: FilePacket, session: _Session) -> list[FilePacket]:
        session.content = None
        return [_ack(asked)]

    def _listed(self, asked: FilePacket, _: _Session) -> list[FilePacket]:
        folder = asked.content.rstrip(b"\0").decode(errors="replace").rstrip("/")
        inside = {
            path[len(folder) + 1 :]: read
            for path, read in self._files.items()
            if path.startswith(f"{folder}/") and not path.startswith(_MADE_UP)
        }
        if not inside:
            return [_nak(asked, FileError.NOT_FOUND)]
        entries = [f"D{name}" for name in sorted({n.split("/")[0] for n in inside if "/" in n})]
        entries += [
            f"F{name}\t{len(read())}" for name, read in sorted(inside.items()) if "/" not in name
        ]
        content = b""
        for entry in entries[asked.offset :]:
            if len(content) + len(entry) >= MOST_CONTENT:
                break
            content += entry.encode() + b"\0"
        return [_ack(asked, content) if content else _nak(asked, FileError.END_OF_FILE)]

    def _checked(self, asked: FilePacket, _: _Session) -> list[FilePacket]:
        read = self._found(asked)
        if read is None:
            return [_nak(asked, FileError.NOT_FOUND)]
        # As the vehicles have it: begun at 0 and not inverted.
        return [_ack(asked, struct.pack("<I", zlib.crc32(read(), _ONES) ^ _ONES))]

    def _opened(self, asked: FilePacket, session: _Session) -> list[FilePacket]:
        if session.content is not None:
            return [_nak(asked, FileError.NO_SESSIONS if self._is_px4 else FileError.FAIL)]
        read = self._found(asked)
        if read is None:
            return [_nak(asked, FileError.NOT_FOUND)]
        session.content = read()
        is_made_up = asked.content.startswith(_MADE_UP.encode())
        size = _MADE_UP_SIZE if is_made_up else len(session.content)
        return [_ack(asked, struct.pack("<I", size))]

    def _found(self, asked: FilePacket) -> Callable[[], bytes] | None:
        return self._files.get(asked.content.rstrip(b"\0").decode(errors="replace"))

    def _pieces(self, asked: FilePacket, session: _Session) -> list[FilePacket]:
        if session.content is None:
            closed = FileError.INVALID_SESSION if self._is_px4 else FileError.NOT_FOUND
            return [_nak(asked, closed)]
        content = session.content
        # Whatever size is asked for, PX4 reads as much as fits.
        size = MOST_CONTENT if self._is_px4 else asked.size or MOST_CONTENT
        most = _BURST if asked.operation == Operation.BURST_READ_FILE else 1
        starts = range(asked.offset, min(asked.offset + most * size, len(content)), size)
        pieces = [
            replace(
                _ack(asked, content[at : at + size]),
                number=_number(asked, later),
                offset=at,
                is_last=later == most,
            )
            for later, at in enumerate(starts, 1)
        ]
        if len(pieces) == most:
            return pieces
        end = replace(
            _nak(asked, FileError.END_OF_FILE), number=_number(asked, len(pieces) + 1), is_last=True
        )
        return [*pieces, end]


def _number(asked: FilePacket, later: int) -> int:
    return (asked.number + later) & 0xFFFF


def _ack(asked: FilePacket, content: bytes = b"") -> FilePacket:
    return replace(
        asked, number=_number(asked, 1), operation=Operation.ACK, size=0, content=content
    )


def _nak(asked: FilePacket, error: FileError) -> FilePacket:
    return replace(_ack(asked, bytes([error])), operation=Operation.NAK, offset=0)
