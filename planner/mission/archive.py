"""Missions in gzip files and zip archives."""

from __future__ import annotations

import gzip
import io
import zipfile
import zlib
from pathlib import PurePosixPath

from planner.errors import MissionFileError

MISSION_SUFFIXES = frozenset({".plan", ".waypoints", ".mission", ".wpl"})
_UNPACK_ERRORS = (OSError, EOFError, zlib.error, zipfile.BadZipFile, RuntimeError, ValueError)
"""What the standard library raises for a broken archive; RuntimeError for an encrypted one."""


def unpack_gzip(data: bytes, *, most_bytes: int, source: str) -> bytes:
    """Return the content of a gzip file, up to a size.

    Raises
    ------
    MissionFileError
        If it is broken.
    """
    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            unpacked = stream.read(most_bytes)
    except _UNPACK_ERRORS:
        msg = "a gzip file that is broken: make it anew"
        raise MissionFileError(msg, source=source) from None
    return unpacked


def unpack_zip(data: bytes, *, most_bytes: int, source: str) -> tuple[bytes, str]:
    """Return the content, up to a size, and the name of the one mission in a zip archive.

    Raises
    ------
    MissionFileError
        If it is broken or encrypted, or does not hold exactly one mission.
    """
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [
                name
                for name in archive.namelist()
                if PurePosixPath(name).suffix.lower() in MISSION_SUFFIXES
                and not name.startswith("__MACOSX/")
            ]
            if len(names) != 1:
                held = f"{len(names)} missions" if names else "no mission"
                if "doc.kml" in archive.namelist():
                    held = "a Google Earth document (KMZ), no mission"
                msg = f"a zip archive that holds {held}: unpack it and give one mission file"
                raise MissionFileError(msg, source=source)
            with archive.open(names[0]) as stream:
                unpacked = stream.read(most_bytes)
    except _UNPACK_ERRORS:
        msg = "a zip archive that is broken or encrypted: unpack it and give the mission file"
        raise MissionFileError(msg, source=source) from None
    return unpacked, names[0]
