"""Messages and fields that PX4 sends and pymavlink's dialects, which are ArduPilot's, do not know.

The events interface (EVENT and what asks for it), and the numbers by which MISSION_CURRENT and
MISSION_COUNT tell one list of items from another.  All are of MAVLink's common.xml.
"""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    Checksum = Callable[[bytes], int]

_HEAD = 10
"""Bytes of a version 2 frame before its content."""


@frozen
class Layout:
    """How a message stands in its frame."""

    number: int
    crc_extra: int
    """MAVLink's check sum over the definition, which that of a frame includes."""
    fields: tuple[tuple[str, str], ...]
    """Names and formats of `struct`, in the order of the frame."""

    @property
    def structure(self) -> struct.Struct:
        """The content."""
        return struct.Struct("<" + "".join(form for _, form in self.fields))


@frozen
class Extension:
    """Fields behind those that a dialect knows of a message."""

    start: int
    """Bytes of the content before them."""
    crc_extra: int
    fields: tuple[str, ...]
    """Names; each takes four bytes, 0 where it is not told."""


LAYOUTS: Mapping[str, Layout] = {
    "EVENT": Layout(
        number=410,
        crc_extra=160,
        fields=(
            *(("id", "I"), ("event_time_boot_ms", "I"), ("sequence", "H")),
            *(("destination_component", "B"), ("destination_system", "B")),
            *(("log_levels", "B"), ("arguments", "40s")),
        ),
    ),
    "CURRENT_EVENT_SEQUENCE": Layout(
        number=411, crc_extra=106, fields=(("sequence", "H"), ("flags", "B"))
    ),
    "REQUEST_EVENT": Layout(
        number=412,
        crc_extra=33,
        fields=(
            *(("first_sequence", "H"), ("last_sequence", "H")),
            *(("target_system", "B"), ("target_component", "B")),
        ),
    ),
}
"""By name, the messages that a dialect may lack."""
EXTENSIONS: Mapping[str, Extension] = {
    "MISSION_CURRENT": Extension(
        start=6, crc_extra=28, fields=("mission_id", "fence_id", "rally_points_id")
    ),
    "MISSION_COUNT": Extension(start=5, crc_extra=221, fields=("opaque_id",)),
}
"""By name, the messages of which a dialect may lack fields."""
_NAMES = {layout.number: name for name, layout in LAYOUTS.items()}


def frame_content(frame: bytes) -> bytes:
    """Return the content of a whole frame of either version."""
    head = _HEAD if frame[0] == 0xFD else 6
    return frame[head : head + frame[1]]


def read_newer(frame: bytes, checksum: Checksum) -> tuple[str, dict[str, Any]] | None:
    """Return name and fields of a frame; ``None`` where it is no such message, or damaged.

    Parameters
    ----------
    frame : bytes
        Whole, of a message that the dialect does not know.
    checksum : callable
        MAVLink's, over bytes.
    """
    if frame[0] != 0xFD or len(frame) < _HEAD + frame[1] + 2:
        return None
    name = _NAMES.get(int.from_bytes(frame[7:10], "little"))
    if name is None:
        return None
    layout, end = LAYOUTS[name], _HEAD + frame[1]
    told = int.from_bytes(frame[end : end + 2], "little")
    if checksum(frame[1:end] + bytes([layout.crc_extra])) != told:
        return None
    structure = layout.structure
    content = frame[_HEAD:end][: structure.size].ljust(structure.size, b"\0")
    names = [field for field, _ in layout.fields]
    return name, dict(zip(names, structure.unpack(content), strict=True))


def extension_fields(name: str, frame: bytes) -> dict[str, int]:
    """Return the fields of a frame that the dialect does not know."""
    extension = EXTENSIONS.get(name)
    if extension is None:
        return {}
    size = 4 * len(extension.fields)
    content = frame_content(frame)[extension.start :][:size].ljust(size, b"\0")
    values = struct.unpack(f"<{len(extension.fields)}I", content)
    return dict(zip(extension.fields, values, strict=True))


def newer_frame(
    name: str,
    fields: Mapping[str, Any],
    checksum: Checksum,
    *,
    sender: tuple[int, int],
    number: int,
) -> bytes:
    """Return a message that a dialect may lack as a frame.

    Parameters
    ----------
    name : str
        Of the message.
    fields : mapping
        Those that it lacks are 0.
    checksum : callable
        MAVLink's, over bytes.
    sender : tuple of int
        System and component.
    number : int
        Of the frame.
    """
    layout = LAYOUTS[name]
    content = layout.structure.pack(
        *(fields.get(field, b"" if "s" in form else 0) for field, form in layout.fields)
    )
    head = _head(layout.number, sender, number)
    return _frame(head, content, layout.crc_extra, checksum)


def extended_frame(name: str, frame: bytes, fields: Mapping[str, Any], checksum: Checksum) -> bytes:
    """Return a frame of the dialect's with the fields that it does not know."""
    extension = EXTENSIONS.get(name)
    values = [] if extension is None else [fields.get(field, 0) for field in extension.fields]
    if extension is None or not any(values):
        return frame
    content = frame_content(frame)[: extension.start].ljust(extension.start, b"\0")
    content += struct.pack(f"<{len(values)}I", *values)
    return _frame(frame[:_HEAD], content, extension.crc_extra, checksum)


def _head(message: int, sender: tuple[int, int], number: int) -> bytes:
    return bytes([0xFD, 0, 0, 0, number & 0xFF, *sender]) + message.to_bytes(3, "little")


def _frame(head: bytes, content: bytes, crc_extra: int, checksum: Checksum) -> bytes:
    content = content[:1] + content[1:].rstrip(b"\0")  # version 2 leaves zeros out at the end
    whole = head[:1] + bytes([len(content)]) + head[2:] + content
    return whole + checksum(whole[1:] + bytes([crc_extra])).to_bytes(2, "little")
