"""MAVLink's file protocol, for reading: folders and files of a vehicle, whatever the line loses."""

from __future__ import annotations

import struct
from enum import IntEnum
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.frozen import frozen
from planner.link.chunks import ChunkStream
from planner.link.message import message
from planner.link.retransmission import Retransmission

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.link.message import Message
    from planner.link.settings import LinkSettings

_HEAD = struct.Struct("<HBBBBBxI")
_MOST_CONTENT = 239
_MOST_ENTRIES = 10_000
"""Entries of one folder; a vehicle that goes on is not believed."""
_REOPENINGS = 5
_NAME = "FILE_TRANSFER_PROTOCOL"


class Operation(IntEnum):
    """What is asked for, of operations that only read."""

    TERMINATE_SESSION = 1
    LIST_DIRECTORY = 3
    OPEN_FILE_RO = 4
    READ_FILE = 5
    BURST_READ_FILE = 15
    ACK = 128
    NAK = 129


class FileError(IntEnum):
    """Why something is refused, as far as it is acted upon."""

    INVALID_SESSION = 4
    END_OF_FILE = 6


class FileRefusedError(LinkError):
    """The vehicle refuses a file or a folder."""


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


def read_packet(received: Message) -> FilePacket | None:
    """Return what a message holds; ``None`` where it is no answer of the file protocol."""
    if received.name != _NAME:
        return None
    payload = bytes(received["payload"]).ljust(251, b"\0")
    number, session, operation, size, answered, last, offset = _HEAD.unpack_from(payload)
    if operation not in {Operation.ACK, Operation.NAK}:
        return None
    content = payload[_HEAD.size : _HEAD.size + min(size, _MOST_CONTENT)]
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


class FolderListing:
    """The entries of one folder.

    Parameters
    ----------
    path : str
        The folder.
    settings : LinkSettings
        How patient to be.
    retries : int, optional
        How often to ask, where a vehicle may know no files at all.
    """

    def __init__(self, path: str, settings: LinkSettings, *, retries: int | None = None) -> None:
        self._path = path
        self._timer = Retransmission(settings, retries=retries)
        self._number = 0
        self.files: dict[str, int] = {}
        """Sizes by name. [B]"""
        self.folders: list[str] = []
        self._entries = 0
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When to ask again. [s]"""
        return self._timer.deadline_s

    @property
    def progress(self) -> tuple[int, int | None]:
        """Entries so far."""
        return self._entries, None

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for the first entries."""
        self._timer.sent(now_s)
        return (self._request(),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle.

        Raises
        ------
        FileRefusedError
            If there is no such folder.
        """
        packet = read_packet(received)
        if packet is None or packet.answered != Operation.LIST_DIRECTORY:
            return ()
        if packet.number != (self._number + 1) & 0xFFFF:
            return ()  # the answer to an earlier request
        if packet.operation == Operation.NAK:
            if packet.content[:1] != bytes([FileError.END_OF_FILE]):
                msg = f"the vehicle has no folder {self._path}"
                raise FileRefusedError(msg)
            self.is_done = True
            return ()
        entries = [one for one in packet.content.split(b"\0") if one]
        self._entries += len(entries)
        if not entries or self._entries > _MOST_ENTRIES:
            self.is_done = True
            return ()
        for entry in entries:
            self._take_entry(entry.decode("utf-8", errors="replace"))
        self._number += 2
        self._timer.answered(now_s)
        self._timer.sent(now_s)
        return (self._request(),)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again, or give up.

        Raises
        ------
        LinkError
            If it was asked often enough.
        """
        if self._timer.is_used_up:
            msg = f"the folder {self._path} stalled at entry {self._entries + 1}"
            raise LinkError(msg)
        self._timer.repeated(now_s)
        return (self._request(),)

    def _take_entry(self, entry: str) -> None:
        kind, name = entry[:1], entry[1:]
        if kind == "D" and name not in {".", ".."}:
            self.folders.append(name)
        elif kind == "F":
            name, _, size = name.partition("\t")
            self.files[name] = int(size) if size.isascii() and size.isdigit() else 0

    def _request(self) -> Message:
        return packet_message(
            FilePacket(
                number=self._number,
                operation=Operation.LIST_DIRECTORY,
                offset=self._entries,
                content=self._path.encode()[:_MOST_CONTENT],
            )
        )


class FileDownload:
    """One file by its path.

    Parameters
    ----------
    path : str
        On the vehicle.
    start : int
        How much of it is there already. [B]
    write : callable
        Given each piece in its order.
    settings : LinkSettings
        How patient to be.
    """

    def __init__(
        self, path: str, start: int, write: Callable[[bytes], None], settings: LinkSettings
    ) -> None:
        self._path = path
        self._start = start
        self._write = write
        self._timer = Retransmission(settings)
        self._number = 0x100
        self._session: int | None = None
        self._stream: ChunkStream | None = None
        self._openings = 0
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When to ask again. [s]"""
        return self._timer.deadline_s

    @property
    def progress(self) -> tuple[int, int | None]:
        """Bytes so far, and how many there are."""
        return (0, None) if self._stream is None else (self._stream.offset, self._stream.size)

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for the file to be opened."""
        self._timer.sent(now_s)
        return (self._request(),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle.

        Raises
        ------
        FileRefusedError
            If there is no such file, or it cannot be read.
        """
        packet = read_packet(received)
        if self.is_done or packet is None:
            return ()
        if not 0 < (packet.number - self._number) & 0xFFFF < 0x8000:
            return ()  # the answer to an earlier request
        if self._session is None:
            if packet.answered != Operation.OPEN_FILE_RO:
                return ()
            return self._take_opened(packet, now_s)
        if packet.answered in {Operation.READ_FILE, Operation.BURST_READ_FILE}:
            return self._take_piece(packet, now_s)
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask for what is missing, or give up.

        Raises
        ------
        LinkError
            If it was asked for often enough.
        """
        if self._timer.is_used_up:
            done, size = self.progress
            at = "before it was opened" if size is None else f"at {done} of {size} bytes"
            msg = f"{self._path} stalled {at}; what came is kept, call again to go on"
            raise LinkError(msg)
        self._timer.repeated(now_s)
        return (self._request(),)

    def _take_opened(self, packet: FilePacket, now_s: float) -> tuple[Message, ...]:
        if packet.operation == Operation.NAK or len(packet.content) < 4:
            msg = f"the vehicle does not open {self._path} (error {packet.content[:1].hex()})"
            raise FileRefusedError(msg)
        self._session = packet.session
        (size,) = struct.unpack_from("<I", packet.content)
        if self._stream is None:
            self._stream = ChunkStream(size, min(self._start, size), self._write)
        self._timer.answered(now_s)
        self._timer.sent(now_s)
        return self._next()

    def _take_piece(self, packet: FilePacket, now_s: float) -> tuple[Message, ...]:
        assert self._stream is not None  # it is made when the file is opened
        if packet.operation == Operation.NAK:
            if packet.content[:1] == bytes([FileError.INVALID_SESSION]):
                return self._reopen(now_s)
            return ()  # the end of a burst that ran into the end of the file; asked again
        if self._stream.take(packet.offset, packet.content):
            self._timer.answered(now_s)
            self._timer.sent(now_s)
        is_asked = packet.answered == Operation.READ_FILE or packet.is_last
        return self._next() if is_asked or self._stream.is_whole else ()

    def _reopen(self, now_s: float) -> tuple[Message, ...]:
        self._openings += 1
        if self._openings > _REOPENINGS:
            msg = f"the vehicle closes {self._path} again and again"
            raise FileRefusedError(msg)
        self._session = None
        self._timer.sent(now_s)
        return (self._request(),)

    def _next(self) -> tuple[Message, ...]:
        assert self._stream is not None  # it is made when the file is opened
        if not self._stream.is_whole:
            return (self._request(),)
        self.is_done = True
        self._number += 0x100
        end = FilePacket(
            number=self._number,
            operation=Operation.TERMINATE_SESSION,
            session=self._session or 0,
        )
        return (packet_message(end),)

    def _request(self) -> Message:
        # The answers of a burst count on from its request: a new one begins well behind them.
        if self._session is None or self._stream is None:
            content = self._path.encode()[:_MOST_CONTENT]
            opened = FilePacket(
                number=self._number, operation=Operation.OPEN_FILE_RO, content=content
            )
            return packet_message(opened)
        self._number += 1
        gap = self._stream.gap()
        return packet_message(
            FilePacket(
                number=self._number,
                operation=Operation.BURST_READ_FILE if gap is None else Operation.READ_FILE,
                session=self._session,
                size=min(gap or _MOST_CONTENT, _MOST_CONTENT),
                offset=self._stream.offset,
            )
        )
