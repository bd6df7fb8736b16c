"""Getting at the bytes of a mission file: bounded reading, unpacking, decoding."""

from __future__ import annotations

import codecs
import io
import re
import stat
import sys
import zlib
from pathlib import Path, PurePosixPath
from typing import TYPE_CHECKING

from planner.errors import MissionFileError, NoMissionFileError
from planner.files import open_pipe
from planner.findings import Rule, Severity
from planner.values import Value

if TYPE_CHECKING:
    from planner.findings import Finding


MISSION_SUFFIXES = frozenset({".plan", ".waypoints", ".mission", ".wpl"})
"""What mission files alone are called; a file that is named by the user may be called anything."""
_UNPACK_ERRORS = (OSError, EOFError, zlib.error, RuntimeError, ValueError)
"""What the standard library raises for a broken archive; RuntimeError for an encrypted one."""


def _unpack_gzip(data: bytes, *, source: str) -> bytes:
    import gzip

    try:
        with gzip.GzipFile(fileobj=io.BytesIO(data)) as stream:
            return stream.read(LARGEST_FILE_BYTES + 1)
    except _UNPACK_ERRORS:
        msg = "a gzip file that is broken: compress it again"
        raise MissionFileError(msg, source=source) from None


def _unpack_zip(data: bytes, *, source: str) -> tuple[bytes, str, bytes]:
    """Return content and name of the one mission in a zip archive, and what it was made from.

    Up to the largest size; empty where that is not there.
    """
    import zipfile

    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            names = [
                name
                for name in archive.namelist()
                if PurePosixPath(name).suffix.lower() in MISSION_SUFFIXES
                and not name.startswith("__MACOSX/")
            ]
            if not names:  # what DJI executes, else what Google Earth shows
                held_kml = [name for name in archive.namelist() if name.lower().endswith(".kml")]
                names = [name for name in archive.namelist() if name == _DJI_ROUTE] or held_kml
            if len(names) != 1:
                held = f"{len(names)} missions" if names else "no mission"
                msg = f"a zip archive that holds {held}: unpack it and give one mission file"
                raise MissionFileError(msg, source=source)
            beside = b""
            if names[0] == _DJI_ROUTE and _DJI_TEMPLATE in archive.namelist():
                with archive.open(_DJI_TEMPLATE) as stream:
                    beside = stream.read(LARGEST_FILE_BYTES + 1)
            with archive.open(names[0]) as stream:
                return stream.read(LARGEST_FILE_BYTES + 1), names[0], beside
    except (*_UNPACK_ERRORS, zipfile.BadZipFile):
        msg = "a zip archive that is broken or encrypted: unpack it and give the mission file"
        raise MissionFileError(msg, source=source) from None


_DJI_ROUTE, _DJI_TEMPLATE = "wpmz/waylines.wpml", "wpmz/template.kml"
_GIVE_A_MISSION = "give a .plan or .waypoints file"
_VERIFY = "compare it with a prediction by 'mavjoule verify'"

_SIGNATURES: tuple[tuple[bytes, int, str], ...] = (
    (b"ULog\x01\x12\x35", 0, f"this is a PX4 flight log, not a mission: {_VERIFY}"),
    (b"\xa3\x95", 0, f"this is an ArduPilot flight log, not a mission: {_VERIFY}"),
    (b"\xfd", 8, f"this looks like a telemetry log, not a mission: {_VERIFY}"),
    (b"\xfe", 8, f"this looks like a telemetry log, not a mission: {_VERIFY}"),
    (b"%PDF", 0, f"this is a PDF document, not a mission: {_GIVE_A_MISSION}"),
    (b"\x89PNG", 0, f"this is a picture, not a mission: {_GIVE_A_MISSION}"),
    (b"\xff\xd8\xff", 0, f"this is a picture, not a mission: {_GIVE_A_MISSION}"),
    (b"\x7fELF", 0, f"this is a program, not a mission: {_GIVE_A_MISSION}"),
    (b"SQLite format 3", 0, f"this is a database, not a mission: {_GIVE_A_MISSION}"),
    (b"BZh", 0, "this is compressed with bzip2: unpack it and give the mission file"),
    (b"\xfd7zXZ\0", 0, "this is compressed with xz: unpack it and give the mission file"),
    (b"(\xb5/\xfd", 0, "this is compressed with Zstandard: unpack it and give the mission file"),
    (b"7z\xbc\xaf\x27\x1c", 0, "this is a 7-Zip archive: unpack it and give the mission file"),
    (b"\x1f\x8b", 0, "this is compressed twice: unpack it and give the mission file"),
    (b"PK\x03\x04", 0, "this is a zip archive in another: unpack it and give the mission file"),
)
"""First bytes, their offset, and the sentence."""

_XML_ROOT = r"<\s*([A-Za-z_][\w.-]*:)?([A-Za-z_][\w.-]*)"
_XML_SKIP = r"(?si)<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>"
_XML: dict[str, str] = {
    "mission": "this is a MultiWii or iNav mission (XML): those autopilots do not speak MAVLink's "
    "mission items; plan it in QGroundControl or Mission Planner",
    "gpx": "this is a GPS track (GPX): plan it in QGroundControl or Mission Planner",
    "html": "this is a web page, not a mission: the download may have gone wrong",
}
_PYTHON = r"(?m)^(?:import \w|from \w+(?:\.\w+)* import |def \w+\(|class \w+|#!.*python)"
_PARAMETERS = r"(?m)^(?:\d+\s+\d+\s+)?[A-Z][A-Z0-9_]{2,15}[\s,]+[-+.\deE]+(?:\s+\d+)?\s*$"


def describe_binary(data: bytes) -> str | None:
    """Return the sentence about a file known by its first bytes, ``None`` for any other."""
    for signature, offset, sentence in _SIGNATURES:
        # A telemetry log is recognised by a zero high byte of its time stamp and a packet after it.
        if offset and (data[:1] != b"\0" or len(data) < offset + 8):
            continue
        if data.startswith(signature, offset):
            return sentence
    return None


def describe_xml(text: str) -> str:
    """Return the sentence about a text that begins like XML."""
    root = xml_root(text)
    return _XML.get(root.lower(), f"this is XML (<{root[:40]}>), not a mission: {_GIVE_A_MISSION}")


def xml_root(text: str) -> str:
    """Return the name of the element that a text of XML is, without its prefix; ``""`` for none."""
    # Comments may be long; what names the document is near its beginning.
    match = re.search(_XML_ROOT, re.sub(_XML_SKIP, "", text[:20_000]))
    return "" if match is None else match[2]


def describe_text(text: str) -> str:
    """Return the sentence about a text that is no mission."""
    head = text.lstrip()[:20_000]
    if re.search(_PYTHON, head):
        return f"this is Python source, not a mission: {_GIVE_A_MISSION}"
    if len(re.findall(_PARAMETERS, head)) >= 3:
        return "this is a parameter file, not a mission: give it with --params"
    first = head.splitlines()[0][:40]
    return f"this is not a mission, it begins with {first!r}: {_GIVE_A_MISSION}"


LARGEST_FILE_BYTES = 64 * 2**20
"""No mission of 65,535 items comes near it, in any format."""
STANDARD_INPUT = "-"


class FileText(Value):
    """The text of a file and what getting at it brought to light."""

    text: str
    findings: tuple[Finding, ...]
    inner_name: str | None
    """The name inside an archive, ``None`` where there is no archive."""
    beside: str = ""
    """What lies beside it in the archive, where that says more of the mission."""


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file, or of standard input for ``-``, up to the largest size."""
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
        with open_pipe(path) if stat.S_ISFIFO(mode) else Path(path).open("rb") as stream:
            return stream.read(LARGEST_FILE_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a NUL character in the name
        match error:
            case FileNotFoundError():
                msg = "no such file"
            case PermissionError():
                msg = "no permission to read this file"
            case _:
                msg = f"the file cannot be read: {getattr(error, 'strerror', None) or error}"
        raise NoMissionFileError(msg, source=source) from None


FILE_ENCODING = Rule(
    "L162 file-encoding",
    Severity.INFO,
    summary="The file is not plain UTF-8.",
    why="Loaders compare the first bytes: with a byte order mark or in UTF-16 they refuse it.",
    how="Looks for byte order marks, UTF-16 and bytes that are not UTF-8.",
    fix="save the file as UTF-8 without a byte order mark",
)

FILE_PACKED = Rule(
    "L163 file-packed",
    Severity.INFO,
    summary="The mission was read from a compressed file.",
    why="Of the usual ground stations only QGroundControl opens such a file.",
    how="The first bytes are those of gzip or of a zip archive that holds one mission.",
    fix="unpack the file",
)


def read_text(data: bytes, *, source: str) -> FileText:
    """Return the text in the bytes of a mission file, unpacked and decoded."""
    _refuse_large(data, source=source)
    findings: list[Finding] = []
    inner_name: str | None = None
    beside = ""
    if data.startswith(b"\x1f\x8b"):
        data = _unpack_gzip(data, source=source)
        findings.append(FILE_PACKED.finding("read from a gzip file"))
    elif data.startswith((b"PK\x03\x04", b"PK\x05\x06")):
        data, inner_name, template = _unpack_zip(data, source=source)
        if template:
            _refuse_large(template, source=source)
            beside, _ = _decode(template, source=source)
        if not inner_name.lower().endswith((".kml", ".wpml")):  # those are always packed
            findings.append(FILE_PACKED.finding(f"read from '{inner_name}' inside a zip archive"))
    _refuse_large(data, source=source)
    text, odd = _decode(data, source=source)
    if odd:
        findings.append(FILE_ENCODING.finding(odd))
    if not text.strip():
        msg = "the file is empty"
        raise MissionFileError(msg, source=source)
    return FileText(text=text, findings=tuple(findings), inner_name=inner_name, beside=beside)


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
        msg = "the file is binary, not a mission: give a .plan or .waypoints file"
        raise MissionFileError(msg, source=source)
    return text, odd


def _utf_16_variant(data: bytes) -> str | None:
    """Return the codec of UTF-16 text, by its mark or by every second byte being zero."""
    head = data[:64]
    for codec, mark, zeros in (
        ("utf-16-le", codecs.BOM_UTF16_LE, 1),
        ("utf-16-be", codecs.BOM_UTF16_BE, 0),
    ):
        is_every_second = not any(head[zeros::2]) and all(head[1 - zeros :: 2])
        if data.startswith(mark) or (len(head) >= 4 and is_every_second):
            return codec
    return None
