"""Getting at the bytes of a mission file: bounded reading, unpacking, decoding."""

from __future__ import annotations

import codecs
import os
import stat
import sys
from pathlib import Path
from typing import TYPE_CHECKING, BinaryIO

from planner.catalogue.loader_text import FILE_ENCODING, FILE_PACKED
from planner.errors import MissionFileError, NoMissionFileError
from planner.frozen import frozen
from planner.mission.foreign import describe_binary

if TYPE_CHECKING:
    from planner.findings import Finding

LARGEST_FILE_BYTES = 64 * 2**20
"""No mission of 65,535 items comes near it, in any format."""
STANDARD_INPUT = "-"


@frozen
class FileText:
    """The text of a file and what getting at it brought to light."""

    text: str
    findings: tuple[Finding, ...]
    inner_name: str | None
    """The name inside an archive, ``None`` where there is no archive."""


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file, or of standard input for ``-``, up to the largest size.

    Raises
    ------
    MissionFileError
        If it cannot be read, is no ordinary file or is too large.
    """
    source = str(path)
    try:
        if source == STANDARD_INPUT:
            if sys.stdin is None:
                msg = "standard input is closed: there is no mission in it"
                raise MissionFileError(msg, source=source)
            return sys.stdin.buffer.read(LARGEST_FILE_BYTES + 1)
        mode = Path(path).stat().st_mode
        if stat.S_ISDIR(mode):
            msg = "this is a folder: give the mission files in it"
            raise NoMissionFileError(msg, source=source)
        # A pipe is how a shell hands over the output of another program.
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            msg = "this is a device, not a file"
            raise NoMissionFileError(msg, source=source)
        with _open_pipe(path) if stat.S_ISFIFO(mode) else Path(path).open("rb") as stream:
            return stream.read(LARGEST_FILE_BYTES + 1)
    except FileNotFoundError:
        msg = "there is no such file"
        raise NoMissionFileError(msg, source=source) from None
    except PermissionError:
        msg = "no permission to read this file"
        raise NoMissionFileError(msg, source=source) from None
    except (OSError, ValueError) as error:
        # ValueError: a NUL character in the name.
        reason = getattr(error, "strerror", None) or str(error)
        msg = f"the file cannot be read: {reason}"
        raise NoMissionFileError(msg, source=source) from None


def _open_pipe(path: str | Path) -> BinaryIO:
    """Open a pipe for reading; one that nobody writes to is at its end and not waited for."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return os.fdopen(descriptor, "rb")


def read_text(data: bytes, *, source: str) -> FileText:
    """Return the text in the bytes of a mission file, unpacked and decoded.

    Raises
    ------
    MissionFileError
        If they are too many, empty, not text, or an archive without exactly one mission.
    """
    _refuse_large(data, source=source)
    findings: list[Finding] = []
    inner_name: str | None = None
    most_bytes = LARGEST_FILE_BYTES + 1
    if data.startswith(b"\x1f\x8b"):
        from planner.mission.archive import unpack_gzip

        data = unpack_gzip(data, most_bytes=most_bytes, source=source)
        findings.append(FILE_PACKED.finding("read from a gzip file"))
    elif data.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        from planner.mission.archive import unpack_zip

        data, inner_name = unpack_zip(data, most_bytes=most_bytes, source=source)
        findings.append(FILE_PACKED.finding(f"read from '{inner_name}' inside a zip archive"))
    _refuse_large(data, source=source)
    text, odd = _decode(data, source=source)
    if odd:
        findings.append(FILE_ENCODING.finding(odd))
    if not text.strip():
        msg = "the file is empty"
        raise MissionFileError(msg, source=source)
    return FileText(text=text, findings=tuple(findings), inner_name=inner_name)


def _refuse_large(data: bytes, *, source: str) -> None:
    if len(data) > LARGEST_FILE_BYTES:
        size = LARGEST_FILE_BYTES // 2**20
        msg = f"more than {size} MiB: no mission is that large"
        raise MissionFileError(msg, source=source)


def _decode(data: bytes, *, source: str) -> tuple[str, str]:
    """Return the text, and what is odd about its encoding (``""`` for plain UTF-8)."""
    binary = describe_binary(data)
    if binary is not None:
        raise MissionFileError(binary, source=source)
    odd = ""
    utf_16 = _utf_16_variant(data)
    if utf_16 is not None:
        text = data.decode(utf_16, errors="replace").removeprefix("\ufeff")
        odd = "the file is UTF-16: other loaders refuse it"
    else:
        try:
            text = data.decode("utf-8")
        except UnicodeDecodeError:
            text = data.decode("latin-1")
            odd = "the file is not UTF-8: read as Latin-1"
        if text.startswith("\ufeff"):
            text = text[1:]
            odd = "the file begins with a byte order mark: other loaders refuse it as text"
    if "\0" in text:
        msg = "the file is binary, no mission: give a .plan or .waypoints file"
        raise MissionFileError(msg, source=source)
    return text, odd


def _utf_16_variant(data: bytes) -> str | None:
    """Return the codec of UTF-16 text, told by its mark or by every second byte being zero."""
    if data.startswith(codecs.BOM_UTF16_LE):
        return "utf-16-le"
    if data.startswith(codecs.BOM_UTF16_BE):
        return "utf-16-be"
    head = data[:64]
    if len(head) >= 4 and not any(head[1::2]) and all(head[0::2]):
        return "utf-16-le"
    if len(head) >= 4 and not any(head[0::2]) and all(head[1::2]):
        return "utf-16-be"
    return None
