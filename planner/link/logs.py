"""The logs of a vehicle: listed and downloaded by its file protocol, else by its log protocol."""

from __future__ import annotations

import errno
import filecmp
import os
import re
import sqlite3
from contextlib import ExitStack, closing, contextmanager, suppress
from itertools import count
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import LinkError, OutputError
from planner.link.connection import TwoVehiclesError
from planner.link.files import (
    ChunkStream,
    FileChecksum,
    FileDownload,
    FileRefusedError,
    FolderListing,
    crc32_of,
    stalled_file,
)
from planner.link.transfers import Transfer
from planner.link.wire import message
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence
    from pathlib import Path

    from planner.link.transfers import LinkSettings
    from planner.link.vehicle import VehicleLink
    from planner.link.wire import Message


_ALL = 0xFFFF
_WINDOW = 90 * 256
"""Bytes asked for at once: 90 in each message. [B]"""


class VehicleLog(Value):
    """A log that a vehicle keeps."""

    name: str
    """File name to keep it under."""
    size_bytes: int
    path: str = ""
    """On the vehicle's file system; empty where it has only a number."""
    number: int | None = None
    """In the log protocol."""


class LogListing(Transfer):
    """The logs a vehicle is asked for."""

    def __init__(self, settings: LinkSettings) -> None:
        super().__init__(settings)
        self._count: int | None = None
        self._sizes: dict[int, int] = {}

    @property
    def progress(self) -> tuple[int, int | None]:
        """Logs so far, and how many there are."""
        return len(self._sizes), self._count

    @property
    def sizes(self) -> dict[int, int]:
        """Size by number, once it is done. [B]"""
        return dict(sorted(self._sizes.items()))

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name != "LOG_ENTRY":
            return ()
        self._count = received["num_logs"]
        if self._count and received["id"] not in self._sizes:
            self._sizes[received["id"]] = received["size"]
            self._timer.sent(now_s)
        self.is_done = len(self._sizes) >= self._count
        return ()

    def _requests(self) -> tuple[Message, ...]:
        return (message("LOG_REQUEST_LIST", start=0, end=_ALL),)

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - as every transfer
        got, count = self.progress
        return f"the list of logs stalled at {got} of {'?' if count is None else count}"


class LogDownload(Transfer):
    """One log by its number, after the vehicle was asked for its list.

    LOG_REQUEST_END is not part of it: PX4 forgets its list by it, and sends no other log.
    """

    def __init__(
        self, log: VehicleLog, start: int, write: Callable[[bytes], None], settings: LinkSettings
    ) -> None:
        super().__init__(settings)
        self._log = log
        self._stream = ChunkStream(log.size_bytes, start, write)
        self._asked_until = 0
        self.is_done = self._stream.is_whole

    @property
    def progress(self) -> tuple[int, int | None]:
        """Bytes so far, and how many there are."""
        return self._stream.offset, self._stream.size

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if self.is_done or received.name != "LOG_DATA" or received["id"] != self._log.number:
            return ()
        content = bytes(received["data"])[: received["count"]]
        offset = received["ofs"]
        has_grown = self._stream.take(offset, content)
        if self._stream.is_whole:
            self.is_done = True
            return ()
        if has_grown:
            self._timer.answered(now_s)
            self._timer.sent(now_s)
        has_written_all = has_grown and self._stream.offset >= self._asked_until
        is_end = offset + len(content) >= self._asked_until
        return self._requests() if has_written_all or is_end else ()

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - as every transfer
        return stalled_file(self._log.name, *self.progress)

    def _requests(self) -> tuple[Message, ...]:
        start = self._stream.offset
        count = min(self._stream.gap() or _WINDOW, _WINDOW, self._stream.size - start)
        self._asked_until = start + count
        return (message("LOG_REQUEST_DATA", id=self._log.number, ofs=start, count=count),)


_FOLDERS = {Autopilot.PX4: ("/fs/microsd/log", "/log"), Autopilot.ARDUPILOT: ("/APM/LOGS", "/logs")}
"""Where autopilots keep their logs; the second is that of their simulators."""
_SUFFIXES = (".ulg", ".bin")
_TRIES = 5
"""Requests until a vehicle counts as one without a file protocol."""
_MOST_FOLDERS = 500
_OVERLAP = 4096
"""Bytes of a part that are read again, to see that it is of the same log. [B]"""
_SAFE = re.compile(r"[^A-Za-z0-9._-]")


def fetch_log_list(link: VehicleLink) -> tuple[VehicleLog, ...]:
    """Return the logs that a vehicle keeps; `LinkError` where it answers neither protocol."""
    for folder in _FOLDERS.get(link.identity.autopilot or Autopilot.PX4, ()):
        try:
            return _files(link, folder)
        except FileRefusedError:
            continue
        except TwoVehiclesError:
            raise
        except LinkError:
            break  # it knows no files
    listing = LogListing(link.settings)
    link.run(listing, "list of logs")
    suffix = ".bin" if link.identity.has_home_slot else ".ulg"
    return tuple(
        VehicleLog(name=f"log-{number:05}{suffix}", size_bytes=size, number=number)
        for number, size in listing.sizes.items()
    )


class DownloadedLog(Value):
    """A log of a vehicle that is whole on disk."""

    log: VehicleLog
    path: Path
    """Its own name, or that with a number, where another file has that."""
    is_new: bool
    is_confirmed: bool
    """Whether it has the checksum that the vehicle reports."""


def download_logs(
    link: VehicleLink, logs: Sequence[VehicleLog], folder: Path, *, is_replacing: bool = False
) -> tuple[DownloadedLog, ...]:
    """Download logs of a list that was just fetched, continuing where an earlier call ended.

    No file is lost: a log whose name another file has gets a number, unless it is replaced.  What is
    there already counts as the vehicle's where it has the checksum that the vehicle reports, or is the
    same byte by byte; what is not whole ends in ``.part``.

    Raises LinkError if a transfer stalls; what came is kept.
    Raises OutputError if a file cannot be written.
    """
    try:
        return tuple(_download_log(link, log, folder, is_replacing=is_replacing) for log in logs)
    finally:
        if any(not log.path for log in logs):
            with suppress(LinkError):  # the first error counts
                link.connection.send(message("LOG_REQUEST_END"))  # ArduPilot writes logs again


def _download_log(
    link: VehicleLink, log: VehicleLog, folder: Path, *, is_replacing: bool
) -> DownloadedLog:
    target = folder / log.name
    crc32 = _checksum(link, log)
    with ExitStack() as stack, _told_if_unwritable(target):
        folder.mkdir(parents=True, exist_ok=True)
        stack.enter_context(_alone(target))
        if crc32 is not None:
            for path in _existing(target, log):
                if crc32_of(path) == crc32:
                    return DownloadedLog(log=log, path=path, is_new=False, is_confirmed=True)
        part = _downloaded_part(link, log, target)
        is_confirmed = crc32 is not None and crc32_of(part) == crc32
        if crc32 is not None and not is_confirmed and _checksum(link, log) == crc32:
            msg = (
                f"{log.name} has another checksum than the vehicle reports: what came is kept as {part}, "
                "remove it and call again"
            )
            raise LinkError(msg)
        if not is_confirmed:
            for path in _existing(target, log):
                if filecmp.cmp(path, part, shallow=False):
                    part.unlink()
                    return DownloadedLog(log=log, path=path, is_new=False, is_confirmed=False)
        if not is_replacing:
            target = next(path for path in _names(target) if not os.path.lexists(path))
        part.replace(target)
    return DownloadedLog(log=log, path=target, is_new=True, is_confirmed=is_confirmed)


@contextmanager
def _told_if_unwritable(target: Path) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        msg = f"{error.filename or target}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error


@contextmanager
def _alone(target: Path) -> Iterator[None]:
    """Keep other calls from a log's files, by a lock of SQLite's: it ends with the process, on any system.

    Two calls would write one part, and one of them into the file that it has become.
    """
    lock = target.with_name(f".{target.name}.lock")
    with closing(sqlite3.connect(lock, timeout=0.0, isolation_level=None)) as connection:
        try:
            connection.execute("BEGIN EXCLUSIVE")
        except sqlite3.OperationalError as error:
            if error.sqlite_errorcode != sqlite3.SQLITE_BUSY:
                raise OSError(errno.EACCES, str(error), str(lock)) from error
            msg = f"{target}: another call downloads this log: wait for its end, then call again"
            raise OutputError(msg) from error
        if not lock.exists():  # its last holder has just taken it away
            msg = f"{target}: another call has just downloaded this log: call again"
            raise OutputError(msg)
        try:
            yield
        finally:
            with suppress(OSError):  # Windows keeps what is open
                lock.unlink()


def _checksum(link: VehicleLink, log: VehicleLog) -> int | None:
    """Return the vehicle's checksum; ``None`` of one that knows no files or no checksums."""
    if not log.path:
        return None
    question = FileChecksum(log.path, link.settings, link.file_numbers)
    link.run(question, f"checksum of {log.name}")
    return question.value


def _names(path: Path) -> Iterator[Path]:
    """Yield ``a.ulg``, ``a-2.ulg``, ``a-3.ulg``, …"""
    yield path
    for number in count(2):
        yield path.with_name(f"{path.stem}-{number}{path.suffix}")


def _existing(target: Path, log: VehicleLog) -> Iterator[Path]:
    """Yield the files of a log's name, numbered or not, that are as long as it."""
    for path in _names(target):
        if not os.path.lexists(path):
            return
        if path.is_file() and path.stat().st_size == log.size_bytes:
            yield path


def _downloaded_part(link: VehicleLink, log: VehicleLog, target: Path) -> Path:
    """Return the file that all of a log came to; parts of other logs are left alone."""
    for name in _names(target):
        part = name.with_name(f"{name.name}.part")
        if part.exists() and part.stat().st_size > log.size_bytes:
            continue  # of a longer log
        try:
            _download(link, log, part)
        except _AnotherLogError:
            continue
        return part
    raise AssertionError  # names have no end


class _AnotherLogError(Exception):
    """The part on disk is of another log."""


class _PartFile:
    """A part of a log on disk: its last bytes are compared, then it grows."""

    def __init__(self, path: Path) -> None:
        self._file = path.open("r+b" if path.exists() else "x+b")
        length = self._file.seek(0, os.SEEK_END)
        self.start = max(length - _OVERLAP, 0)
        self._file.seek(self.start)
        self._known = self._file.read()
        self._file.seek(self.start)

    def write(self, content: bytes) -> None:
        """Take the next bytes."""
        known = self._known[: len(content)]
        self._known = self._known[len(content) :]
        if known != content[: len(known)]:
            raise _AnotherLogError
        self._file.write(content)

    def close(self) -> None:
        """Close it, all of it on disk."""
        self._file.flush()
        os.fsync(self._file.fileno())
        self._file.close()


def _download(link: VehicleLink, log: VehicleLog, path: Path) -> None:
    part = _PartFile(path)
    try:
        if log.path:
            whole = FileDownload(log.path, part.start, part.write, link.settings, link.file_numbers)
            link.run(whole, f"bytes of {log.name}")
        else:
            link.run(
                LogDownload(log, part.start, part.write, link.settings), f"bytes of {log.name}"
            )
    finally:
        part.close()


def _files(link: VehicleLink, top: str) -> tuple[VehicleLog, ...]:
    listing = FolderListing(top, link.settings, link.file_numbers, retries=_TRIES)
    link.run(listing, f"files in {top}")
    found = dict(sorted(listing.files.items()))
    for folder in sorted(listing.folders)[:_MOST_FOLDERS]:
        deeper = FolderListing(f"{top}/{folder}", link.settings, link.file_numbers)
        link.run(deeper, f"files in {top}/{folder}")
        found |= {f"{folder}/{name}": size for name, size in sorted(deeper.files.items())}
    return tuple(
        VehicleLog(
            # The vehicle's text becomes a file's name here: nothing of a path is left in it.
            name=_SAFE.sub("_", name.replace("/", "-", 1)).lstrip("."),
            size_bytes=size,
            path=f"{top}/{name}",
        )
        for name, size in found.items()
        if name.lower().endswith(_SUFFIXES)
    )
