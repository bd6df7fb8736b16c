"""The MAVLink frames of a telemetry log: each behind eight bytes of time.

Ground stations write the time in microseconds since 1970, most significant byte first, and then
the frame as it came over the link.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator
    from mmap import mmap

_STAMP = 8
_V1, _V2 = 0xFE, 0xFD
_SIGNED = 1
"""Bit of a version 2 frame's incompatibility flags: 13 bytes of signature follow."""
_EARLIEST_S, _LATEST_S = 946_684_800.0, 4_102_444_800.0
"""The years 2000 and 2100."""


@dataclass(frozen=True, slots=True)
class Frame:
    """One frame: where it stands, when it came, whose it is."""

    place: int
    """First byte of its time in the log."""
    stamp_s: float
    """Since 1970, by the ground station's clock. [s]"""
    system: int
    component: int
    message: int
    """Number of the message."""
    content: bytes
    """The frame, from its marker to its checksum or signature."""


@dataclass(slots=True)
class Damage:
    """What of a log is no frame."""

    unreadable: int = 0
    first_unreadable: int | None = None


def is_tlog(data: mmap) -> bool:
    """Return whether a file begins with two frames behind plausible times."""
    first = _frame_end(data, 0)
    if first is None or not _EARLIEST_S < _stamp_s(data, 0) < _LATEST_S:
        return False
    return first == len(data) or _frame_end(data, first) is not None


def frames(data: mmap, wanted: frozenset[int], damage: Damage) -> Iterator[Frame]:
    """Yield the frames of wanted messages, in the order of the log.

    Parameters
    ----------
    data : mmap
        The file.
    wanted : frozenset of int
        Numbers of messages.
    damage : Damage
        Filled with what is no frame.
    """
    at = 0
    while at < len(data):
        end = _frame_end(data, at)
        if end is None:
            if len(data) - at < _STAMP + 280:
                return  # the last frame, cut off
            behind = _next_frame(data, at + 1)
            damage.unreadable += behind - at
            if damage.first_unreadable is None:
                damage.first_unreadable = at
            at = behind
            continue
        start = at + _STAMP
        if data[start] == _V1:
            system, component, message = data[start + 3], data[start + 4], data[start + 5]
        else:
            system, component = data[start + 5], data[start + 6]
            message = int.from_bytes(data[start + 7 : start + 10], "little")
        if message in wanted:
            yield Frame(at, _stamp_s(data, at), system, component, message, data[start:end])
        at = end


def _frame_end(data: mmap, at: int) -> int | None:
    """Return where the frame at a place ends; ``None`` where there is none, or not all of it."""
    start = at + _STAMP
    if start + 3 > len(data):
        return None
    if data[start] == _V1:
        end = start + 6 + data[start + 1] + 2
    elif data[start] == _V2:
        end = start + 10 + data[start + 1] + 2 + (13 if data[start + 2] & _SIGNED else 0)
    else:
        return None
    return end if end <= len(data) else None


def _next_frame(data: mmap, at: int) -> int:
    """Return the next place where two frames stand one behind the other, else the end."""
    while at < len(data):
        markers = [
            place
            for marker in (_V1, _V2)
            if (place := data.find(bytes([marker]), at + _STAMP)) >= 0
        ]
        if not markers:
            return len(data)
        at = min(markers) - _STAMP
        end = _frame_end(data, at)
        if end is not None and (end == len(data) or _frame_end(data, end) is not None):
            return at
        at += 1
    return len(data)


def _stamp_s(data: mmap, at: int) -> float:
    return int.from_bytes(data[at : at + _STAMP], "big") * 1e-6
