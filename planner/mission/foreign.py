"""Files that are not missions: what they look like, and what to do instead."""

from __future__ import annotations

import re

_GIVE_A_MISSION = "give a .plan or .waypoints file"
_VERIFY = "compare it with a prediction by 'mavjoule verify'"

_SIGNATURES: tuple[tuple[bytes, int, str], ...] = (
    (b"ULog\x01\x12\x35", 0, f"this is a PX4 flight log, no mission: {_VERIFY}"),
    (b"\xa3\x95", 0, f"this is an ArduPilot flight log, no mission: {_VERIFY}"),
    (b"\xfd", 8, f"this looks like a telemetry log, no mission: {_VERIFY}"),
    (b"\xfe", 8, f"this looks like a telemetry log, no mission: {_VERIFY}"),
    (b"%PDF", 0, f"this is a PDF document, no mission: {_GIVE_A_MISSION}"),
    (b"\x89PNG", 0, f"this is a picture, no mission: {_GIVE_A_MISSION}"),
    (b"\xff\xd8\xff", 0, f"this is a picture, no mission: {_GIVE_A_MISSION}"),
    (b"\x7fELF", 0, f"this is a program, no mission: {_GIVE_A_MISSION}"),
    (b"SQLite format 3", 0, f"this is a database, no mission: {_GIVE_A_MISSION}"),
    (b"BZh", 0, "this is compressed with bzip2: unpack it and give the mission file"),
    (b"\xfd7zXZ\0", 0, "this is compressed with xz: unpack it and give the mission file"),
    (b"(\xb5/\xfd", 0, "this is compressed with Zstandard: unpack it and give the mission file"),
    (b"7z\xbc\xaf\x27\x1c", 0, "this is a 7-Zip archive: unpack it and give the mission file"),
    (b"\x1f\x8b", 0, "this is compressed twice: unpack it and give the mission file"),
    (b"PK\x03\x04", 0, "this is a zip archive in another: unpack it and give the mission file"),
)
"""First bytes, where they stand, and the sentence."""

_XML_ROOT = re.compile(r"<\s*([A-Za-z_][\w.-]*:)?([A-Za-z_][\w.-]*)")
_XML_SKIP = re.compile(r"<\?.*?\?>|<!--.*?-->|<!DOCTYPE[^>]*>", re.DOTALL | re.IGNORECASE)
_XML: dict[str, str] = {
    "mission": "this is a MultiWii or iNav mission (XML): those autopilots do not speak MAVLink's "
    "mission items; plan it in QGroundControl or Mission Planner",
    "kml": "this is a Google Earth document (KML): import it in QGroundControl and save a plan",
    "gpx": "this is a GPS track (GPX): plan it in QGroundControl or Mission Planner",
    "html": "this is a web page, no mission: the download may have gone wrong",
}
_PYTHON = re.compile(
    r"^(?:import \w|from \w+(?:\.\w+)* import |def \w+\(|class \w+|#!.*python)", re.MULTILINE
)
_PARAMETERS = re.compile(
    r"^(?:\d+\s+\d+\s+)?[A-Z][A-Z0-9_]{2,15}[\s,]+[-+.\deE]+(?:\s+\d+)?\s*$", re.MULTILINE
)


def describe_binary(data: bytes) -> str | None:
    """Return the sentence about a file known by its first bytes, ``None`` for any other."""
    for signature, offset, sentence in _SIGNATURES:
        # A telemetry log is told by a zero high byte of its time stamp and a packet after it.
        if offset and (data[:1] != b"\0" or len(data) < offset + 8):
            continue
        if data.startswith(signature, offset):
            return sentence
    return None


def describe_xml(text: str) -> str:
    """Return the sentence about a text that begins like XML."""
    # Comments may be long; what names the document stands near its beginning.
    match = _XML_ROOT.search(_XML_SKIP.sub("", text[:20_000]))
    root = "" if match is None else match[2]
    return _XML.get(root.lower(), f"this is XML (<{root[:40]}>), no mission: {_GIVE_A_MISSION}")


def describe_text(text: str) -> str:
    """Return the sentence about a text that is no mission."""
    head = text[:20_000]
    if _PYTHON.search(head):
        return f"this is Python source, no mission: {_GIVE_A_MISSION}"
    if len(_PARAMETERS.findall(head)) >= 3:
        return "this is a parameter file, no mission: give it with --params"
    first = head.strip().splitlines()[0][:40]
    return f"this is no mission, it begins with {first!r}: {_GIVE_A_MISSION}"
