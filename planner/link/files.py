"""MAVLink's file protocol, for reading: folders and files of a vehicle, whatever the line loses."""

from __future__ import annotations

import struct
import zlib
from enum import IntEnum
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.transfers import Retransmission, Transfer
from planner.link.wire import message
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable
    from pathlib import Path

    from planner.link.transfers import LinkSettings
    from planner.link.wire import Message


_MOST_AHEAD = 1 << 20
"""Bytes kept beyond a gap; further ones come again. [B]"""


class ChunkStream:
    """A file of known size, written from where it is there already to its end. [B]"""

    def __init__(self, size: int, start: int, write: Callable[[bytes], None]) -> None:
        self.size = size
        self.offset = start
        """Everything before this is written. [B]"""
        self._write = write
        self._ahead: dict[int, bytes] = {}

    @property
    def is_whole(self) -> bool:
        """Whether everything is written."""
        return self.offset >= self.size

    def take(self, offset: int, content: bytes) -> bool:
        """Take a piece; return whether something could be written."""
        content = content[: max(self.size - offset, 0)]
        if not content or offset + len(content) <= self.offset:
            return False
        if offset > self.offset:
            if offset - self.offset < _MOST_AHEAD:
                self._ahead[offset] = content
            return False
        self._put(content[self.offset - offset :])
        while self.offset in self._ahead:
            self._put(self._ahead.pop(self.offset))
        self._ahead = {at: one for at, one in self._ahead.items() if at > self.offset}
        return True

    def gap(self) -> int | None:
        """Return how many bytes are missing before the next piece that is there."""
        return min(self._ahead) - self.offset if self._ahead else None

    def _put(self, content: bytes) -> None:
        self._write(content)
        self.offset += len(content)


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
    INVALID_SESSION = 4
    NO_SESSIONS = 5
    END_OF_FILE = 6
    UNKNOWN_COMMAND = 7
    NOT_FOUND = 10


class FilePacket(Value):
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


def read_packet(received: Message, *, answers: bool = True) -> FilePacket | None:
    """Return what a message holds; ``None`` where it is no answer of the file protocol, or no request."""
    if received.name != _NAME:
        return None
    payload = bytes(received["payload"]).ljust(251, b"\0")
    number, session, operation, size, answered, last, offset = _HEAD.unpack_from(payload)
    if answers != (operation in {Operation.ACK, Operation.NAK}):
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


def packet_message(packet: FilePacket, **target: int) -> Message:
    """Return a request or an answer as a message, perhaps to a target."""
    head = _HEAD.pack(
        packet.number & 0xFFFF,
        packet.session,
        packet.operation,
        packet.size or len(packet.content),
        packet.answered,
        packet.is_last,
        packet.offset,
    )
    return message(_NAME, payload=(head + packet.content).ljust(251, b"\0"), **target)


class FileNumbers:
    """Numbers of the requests on one line: each greater than all that were used or seen.

    PX4 answers the number that it answered last by the same answer, whatever is asked and whoever
    asks (``MavlinkFTP::_process_request``): no two requests may have one.
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


_MOST_ENTRIES = 10_000
"""Entries of one folder; more are not believed."""
_REOPENINGS = 8
"""How often a file is opened again without a byte of it; PX4 and ArduPilot close what is idle."""
_BETWEEN_FILES = 0x800
"""Numbers left out before a file: more than one burst of ArduPilot's takes (2000)."""
_MOST_MADE_UP = 1 << 20
"""A longer file that a vehicle makes up is not believed. [B]"""
_LATE_PACKETS = 0x4000
"""An answer that so many others have overtaken is none: a quarter of the numbers, 8 bursts of ArduPilot's."""
_BUSY = frozenset({FileError.FAIL, FileError.NO_SESSIONS})
"""Answers to an opening while another file is open: perhaps one of ours, whose end was lost."""


class FileRefusedError(LinkError):
    """The vehicle refuses a file or a folder."""


def stalled_file(name: str, done: int, size: int | None) -> str:
    """Return the message of a file that did not come whole."""
    at = "before it was opened" if size is None else f"at {done} of {size} bytes"
    return f"{name} stalled {at}; what came is kept, call again to continue"


class _PathTransfer(Transfer):
    """What is asked about one path, by requests with numbers."""

    def __init__(
        self,
        path: str,
        settings: LinkSettings,
        numbers: FileNumbers,
        *,
        retries: int | None = None,
        leaving: int = 0,
    ) -> None:
        super().__init__(settings, retries=retries)
        self._path = path
        self._numbers = numbers
        self._number = numbers.following(leaving=leaving)
        self._session = 0

    def _request(
        self, operation: Operation, *, number: int | None = None, size: int = 0, offset: int = 0
    ) -> Message:
        """Return a request of the session, by a new number unless it is the path that is asked for."""
        return packet_message(
            FilePacket(
                number=self._numbers.following() if number is None else number,
                operation=operation,
                session=self._session,
                size=size,
                offset=offset,
                content=b"" if number is None else self._path.encode()[:MOST_CONTENT],
            )
        )

    def _answer(self, received: Message) -> FilePacket | None:
        """Return the answer to the present request; a busy vehicle is asked again later."""
        packet = read_packet(received)
        if packet is None or packet.number != (self._number + 1) & 0xFFFF:
            return None  # the answer to an earlier request
        self._numbers.see(packet.number)
        if packet.operation == Operation.NAK and packet.error == FileError.NO_SESSIONS:
            self._number = self._numbers.following()
            return None
        return packet


class FolderListing(_PathTransfer):
    """The entries of one folder."""

    def __init__(
        self, path: str, settings: LinkSettings, numbers: FileNumbers, *, retries: int | None = None
    ) -> None:
        super().__init__(path, settings, numbers, retries=retries)
        self.files: dict[str, int] = {}
        """Sizes by name. [B]"""
        self.folders: list[str] = []
        self._entries = 0

    @property
    def progress(self) -> tuple[int, int | None]:
        """Entries so far."""
        return self._entries, None

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle; `FileRefusedError` where there is no such folder."""
        packet = self._answer(received)
        if packet is None or packet.answered != Operation.LIST_DIRECTORY:
            return ()
        self._session = packet.session  # ArduPilot has one made for 0, and few of them
        if packet.operation == Operation.NAK:
            if packet.error != FileError.END_OF_FILE:
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
        self._number = self._numbers.following()
        return self._go_on(now_s)

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - as every transfer
        return f"the folder {self._path} stalled at entry {self._entries + 1}"

    def _take_entry(self, entry: str) -> None:
        kind, name = entry[:1], entry[1:]
        if kind == "D" and name not in {".", ".."}:
            self.folders.append(name)
        elif kind == "F":
            name, _, size = name.partition("\t")
            self.files[name] = int(size) if size.isascii() and size.isdigit() else 0

    def _requests(self) -> tuple[Message, ...]:
        listing = Operation.LIST_DIRECTORY
        return (self._request(listing, number=self._number, offset=self._entries),)


class FileDownload(_PathTransfer):
    """One file by its path, from where it is there already [B]; each piece is written in its order.

    A file without a size is made up by the vehicle as it is read: its end is where nothing more comes.
    """

    def __init__(
        self,
        path: str,
        start: int,
        write: Callable[[bytes], None],
        settings: LinkSettings,
        numbers: FileNumbers,
        *,
        retries: int | None = None,
        has_size: bool = True,
    ) -> None:
        super().__init__(path, settings, numbers, retries=retries, leaving=_BETWEEN_FILES)
        self._has_size = has_size
        self._asked: tuple[int, int] | None = None
        """Number and offset of the latest request for a piece."""
        self._start = start
        self._write = write
        self._is_open = False
        self._stream: ChunkStream | None = None
        self._openings = 0
        self._earliest = self._number
        """Answers up to this number are of an earlier file; it follows those that come, which wrap."""

    @property
    def progress(self) -> tuple[int, int | None]:
        """Bytes so far, and how many there are."""
        if self._stream is None:
            return 0, None
        is_known = self._has_size or self.is_done
        return self._stream.offset, self._stream.size if is_known else None

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle; `FileRefusedError` where the file cannot be read."""
        packet = read_packet(received)
        if self.is_done or packet is None or not is_after(packet.number, self._earliest):
            return ()  # of an earlier file
        self._numbers.see(packet.number)
        if is_after(packet.number, (self._earliest + _LATE_PACKETS) & 0xFFFF):
            self._earliest = (packet.number - _LATE_PACKETS) & 0xFFFF
        if not self._is_open:
            is_opened = packet.answered == Operation.OPEN_FILE_RO
            return self._take_opened(packet, now_s) if is_opened else ()
        if packet.answered in {Operation.READ_FILE, Operation.BURST_READ_FILE}:
            return self._take_piece(packet, now_s)
        return ()

    def _requests(self) -> tuple[Message, ...]:
        stream = self._stream
        if not self._is_open or stream is None:
            # Asked by the same number, PX4 repeats that it is open, instead of refusing.
            return (self._request(Operation.OPEN_FILE_RO, number=self._number),)
        if stream.is_whole:
            self.is_done = True
            return (self._request(Operation.TERMINATE_SESSION),)
        gap = stream.gap()
        operation = Operation.BURST_READ_FILE if gap is None else Operation.READ_FILE
        size = min(gap or MOST_CONTENT, MOST_CONTENT)
        number = self._numbers.following()
        self._asked = number, stream.offset
        request = FilePacket(
            number=number,
            operation=operation,
            session=self._session,
            size=size,
            offset=stream.offset,
        )
        return (packet_message(request),)

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - as every transfer
        return stalled_file(self._path, *self.progress)

    def _take_opened(self, packet: FilePacket, now_s: float) -> tuple[Message, ...]:
        if packet.operation == Operation.NAK and packet.error in _BUSY:
            # PX4 has one session, and keeps it as long as it is asked for another one.
            return (self._request(Operation.RESET_SESSIONS), *self._reopen(now_s))
        if packet.operation == Operation.NAK or len(packet.content) < 4:
            msg = f"the vehicle does not open {self._path} (error {packet.content[:1].hex()})"
            raise FileRefusedError(msg)
        self._session, self._is_open = packet.session, True
        (size,) = struct.unpack_from("<I", packet.content)
        if self._stream is None:
            size = size if self._has_size else _MOST_MADE_UP
            self._stream = ChunkStream(size, min(self._start, size), self._write)
        return self._go_on(now_s)

    def _take_piece(self, packet: FilePacket, now_s: float) -> tuple[Message, ...]:
        assert self._stream is not None  # it is made when the file is opened
        if packet.operation == Operation.NAK:
            if packet.error == FileError.END_OF_FILE:
                return self._take_end(packet)
            return self._reopen(now_s)  # no longer open, which each autopilot reports in its way
        if self._stream.take(packet.offset, packet.content):
            self._openings = 0
            self._timer.answered(now_s)
            self._timer.sent(now_s)
        is_asked = packet.answered == Operation.READ_FILE or packet.is_last
        return self._requests() if is_asked or self._stream.is_whole else ()

    def _take_end(self, packet: FilePacket) -> tuple[Message, ...]:
        """Take it that there is nothing: a burst ran into the end, what is missing is asked for again."""
        assert self._stream is not None  # as above
        if self._has_size or self._asked is None:
            return ()
        number, offset = self._asked
        if is_after(number, packet.number) or number == packet.number:
            return ()  # asked again already
        if packet.number == (number + 1) & 0xFFFF and offset == self._stream.offset:
            self._stream.size = offset
        return self._requests()

    def _reopen(self, now_s: float) -> tuple[Message, ...]:
        """Open it again, after a while: ArduPilot keeps what is idle for 3 s."""
        self._openings += 1
        if self._openings > _REOPENINGS:
            msg = (
                f"the vehicle does not open {self._path}, or closes it again and again: is another "
                "ground station reading files?"
            )
            raise FileRefusedError(msg)
        self._session, self._is_open = 0, False
        self._number = self._earliest = self._numbers.following()
        self._timer = Retransmission(self._settings)
        self._timer.sent(now_s)
        return ()


_LEAST_WAIT_S = 5.0
"""A vehicle reads the whole file before it answers: some 10 s for 50 MB off a slow card. [s]"""
_TRIES = 8
_ONES = 0xFFFFFFFF
_PIECE = 1 << 20


class FileChecksum(_PathTransfer):
    """The checksum of one file, which a vehicle may not have."""

    def __init__(self, path: str, settings: LinkSettings, numbers: FileNumbers) -> None:
        patient = replace(settings, reply_timeout_s=max(settings.reply_timeout_s, _LEAST_WAIT_S))
        super().__init__(path, patient, numbers, retries=_TRIES)
        self.value: int | None = None
        """As `crc32_of` has it; ``None`` where the vehicle reports none."""

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every transfer
        """Take a message of the vehicle."""
        packet = self._answer(received)
        if packet is None:
            return ()
        if packet.operation == Operation.ACK and len(packet.content) >= 4:
            (self.value,) = struct.unpack_from("<I", packet.content)
        self.is_done = True
        return ()

    def _requests(self) -> tuple[Message, ...]:
        # Asked again by the same number, PX4 repeats its answer instead of reading the file again.
        return (self._request(Operation.CALC_FILE_CRC32, number=self._number),)


def crc32_of(path: Path) -> int:
    """Return the checksum of a file as vehicles compute it.

    That is the CRC-32 of ISO 3309, reflected polynomial 0xEDB88320, begun at 0 and not inverted
    (PX4's ``crc32part``, ArduPilot's ``crc_crc32``); zlib's is begun at all ones and inverted.
    """
    value = _ONES
    with path.open("rb") as file:
        while piece := file.read(_PIECE):
            value = zlib.crc32(piece, value)
    return value ^ _ONES
