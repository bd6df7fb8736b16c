"""The logs of a vehicle: listed and downloaded by its file protocol, else by its log protocol."""

from __future__ import annotations

import os
import re
from contextlib import suppress
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import LinkError, OutputError
from planner.link.file_transfer import FileDownload, FileRefusedError, FolderListing
from planner.link.log_transfer import LogDownload, LogListing, VehicleLog
from planner.link.message import message

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.link.pymavlink_link import PymavlinkLink

_FOLDERS = {
    Autopilot.PX4: ("/fs/microsd/log", "/log"),
    Autopilot.ARDUPILOT: ("/APM/LOGS", "/logs"),
}
"""Where autopilots keep their logs; the second is that of their simulators."""
_SUFFIXES = (".ulg", ".bin")
_TRIES = 5
"""Requests until a vehicle counts as one without a file protocol."""
_MOST_FOLDERS = 500
_OVERLAP = 4096
"""Bytes of a part that are read again, to see that it is of the same log. [B]"""
_SAFE = re.compile(r"[^A-Za-z0-9._-]")


def fetch_log_list(link: PymavlinkLink) -> tuple[VehicleLog, ...]:
    """Return the logs that a vehicle keeps, in its own order.

    Raises
    ------
    LinkError
        If it answers neither protocol.
    """
    for folder in _FOLDERS.get(link.identity.autopilot or Autopilot.PX4, ()):
        try:
            return _files(link, folder)
        except FileRefusedError:
            continue
        except LinkError:
            break  # it knows no files
    listing = LogListing(link.settings)
    link.run(listing, "list of logs")
    suffix = ".bin" if link.identity.has_home_slot else ".ulg"
    return tuple(
        VehicleLog(name=f"log-{number:05}{suffix}", size_bytes=size, number=number)
        for number, size in listing.sizes.items()
    )


def download_logs(
    link: PymavlinkLink, logs: Sequence[VehicleLog], folder: Path
) -> tuple[Path, ...]:
    """Download logs of a list that was just fetched, going on where an earlier call ended.

    Parameters
    ----------
    link : PymavlinkLink
        The vehicle.
    logs : sequence of VehicleLog
        Some of its list.
    folder : Path
        Where to keep them; what is not whole ends in ``.part``.

    Returns
    -------
    tuple of Path
        Their files.

    Raises
    ------
    LinkError
        If a transfer stalls; what came is kept.
    OutputError
        If a file cannot be written.
    """
    try:
        return tuple(_download_log(link, log, folder) for log in logs)
    finally:
        if any(not log.path for log in logs):
            with suppress(LinkError):  # the first word counts
                link.connection.send(message("LOG_REQUEST_END"))  # ArduPilot writes logs again


def _download_log(link: PymavlinkLink, log: VehicleLog, folder: Path) -> Path:
    target = folder / log.name
    part = folder / f"{log.name}.part"
    if target.is_file() and target.stat().st_size == log.size_bytes:
        return target
    try:
        folder.mkdir(parents=True, exist_ok=True)
        try:
            _download(link, log, part)
        except _AnotherLogError:
            part.unlink()
            _download(link, log, part)
        part.replace(target)
    except OSError as error:
        msg = f"{part}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
    return target


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


def _download(link: PymavlinkLink, log: VehicleLog, path: Path) -> None:
    if path.exists() and path.stat().st_size > log.size_bytes:
        path.unlink()  # of a longer log
    part = _PartFile(path)
    try:
        if log.path:
            whole = FileDownload(log.path, part.start, part.write, link.settings, link.file_numbers)
            link.run(whole, log.name)
        else:
            link.run(LogDownload(log, part.start, part.write, link.settings), log.name)
    finally:
        part.close()


def _files(link: PymavlinkLink, top: str) -> tuple[VehicleLog, ...]:
    """Return the logs in a folder and the folders in it."""
    found: list[VehicleLog] = []
    listing = FolderListing(top, link.settings, link.file_numbers, retries=_TRIES)
    link.run(listing, f"files in {top}")
    inner = [f"{top}/{name}" for name in sorted(listing.folders)[:_MOST_FOLDERS]]
    found += _logs(listing, top, prefix="")
    for folder in inner:
        deeper = FolderListing(folder, link.settings, link.file_numbers)
        link.run(deeper, f"files in {folder}")
        found += _logs(deeper, folder, prefix=f"{folder.rpartition('/')[2]}-")
    return tuple(found)


def _logs(listing: FolderListing, folder: str, *, prefix: str) -> list[VehicleLog]:
    return [
        VehicleLog(
            # The vehicle's word becomes a file's name here: nothing of a path is left in it.
            name=_SAFE.sub("_", f"{prefix}{name}").lstrip("."),
            size_bytes=size,
            path=f"{folder}/{name}",
        )
        for name, size in sorted(listing.files.items())
        if name.lower().endswith(_SUFFIXES)
    ]
