"""Reader of binary DataFlash logs (``.bin``): which bytes are which message.

A log is a run of messages: 0xA3 0x95, a type, and as many bytes as the FMT message (type 128) of
that type has said before.  There is no checksum; a message is believed if another follows it.
"""

from __future__ import annotations

import struct
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planner.logs.dataflash_messages import (
    WANTED,
    DataflashLog,
    MessageFormat,
    MessageTable,
    message_format,
)

if TYPE_CHECKING:
    from mmap import mmap

    import numpy.typing as npt

    from planner.logs.record import FloatArray, IntArray

HEADER = b"\xa3\x95"
_FMT_TYPE = 128
_FMT = struct.Struct("<BB4s16s64s")
_FMT_LENGTH = 3 + _FMT.size
_LONGEST = 255
"""A length is one byte."""

_NUMBERS: dict[str, tuple[str, float]] = {
    "b": ("<i1", 1.0),
    "B": ("<u1", 1.0),
    "M": ("<u1", 1.0),
    "h": ("<i2", 1.0),
    "H": ("<u2", 1.0),
    "c": ("<i2", 1e-2),
    "C": ("<u2", 1e-2),
    "g": ("<f2", 1.0),
    "i": ("<i4", 1.0),
    "I": ("<u4", 1.0),
    "e": ("<i4", 1e-2),
    "E": ("<u4", 1e-2),
    "L": ("<i4", 1e-7),
    "f": ("<f4", 1.0),
    "d": ("<f8", 1.0),
    "q": ("<i8", 1.0),
    "Q": ("<u8", 1.0),
}
"""Type and unit of the format letters that stand for numbers."""
_SIZES = {letter: int(kind[2]) for letter, (kind, _) in _NUMBERS.items()}
_SIZES |= {"n": 4, "N": 16, "Z": 64, "a": 64}


@dataclass(slots=True)
class _Walk:
    """What one pass over the bytes brings."""

    formats: dict[int, MessageFormat] = field(default_factory=dict)
    lengths: list[int] = field(default_factory=lambda: [0] * 256)
    places: dict[int, array[int]] = field(default_factory=dict)
    unreadable: int = 0
    first_unreadable: int | None = None
    stopped_by: str = ""


def read_binary(data: mmap) -> DataflashLog:
    """Return the wanted messages of a binary DataFlash log.

    Parameters
    ----------
    data : mmap
        The file.

    Returns
    -------
    DataflashLog
        Empty where the file holds no message.
    """
    walk = _walk(data)
    content = np.frombuffer(data, np.uint8)
    tables: dict[str, MessageTable] = {}
    for kind, places in walk.places.items():
        if len(places):
            table = _table(content, walk.formats[kind], np.array(places, np.int64))
            tables.setdefault(table.message.name, table)
    return DataflashLog(
        tables=tables,
        size=len(data),
        unit="bytes",
        unreadable=walk.unreadable,
        first_unreadable=walk.first_unreadable,
        stopped_by=walk.stopped_by,
    )


def _walk(data: mmap) -> _Walk:
    """Find the messages; this loop sees every one of them, so it does little."""
    walk = _Walk()
    walk.lengths[_FMT_TYPE] = _FMT_LENGTH
    lengths, places = walk.lengths, walk.places
    first, second = HEADER
    at, end = 0, len(data)
    last: array[int] | None = None
    while at + 3 <= end:
        kind = data[at + 2]
        length = lengths[kind]
        if data[at] != first or data[at + 1] != second or not length:
            if last:  # what stands before no message is damaged itself
                last.pop()
            last = None
            at = _behind_damage(data, at, walk)
            continue
        if at + length > end:
            break
        last = places.get(kind)
        if last is not None:
            last.append(at)
        elif kind == _FMT_TYPE and not _define(data, at, walk):
            walk.unreadable += end - at
            break
        at += length
    return walk


def _behind_damage(data: mmap, at: int, walk: _Walk) -> int:
    """Return where the next message may begin, and count what lies before it."""
    behind = data.find(HEADER, at + 1)
    while behind >= 0 and behind + 3 <= len(data) and not walk.lengths[data[behind + 2]]:
        behind = data.find(HEADER, behind + 1)
    if behind < 0:
        behind = len(data)
        rest = data[at:]
        if len(rest) < _LONGEST or not rest.strip(b"\x00\xff"):
            return behind  # the last message, cut off, or memory that was never written
    walk.unreadable += behind - at
    if walk.first_unreadable is None:
        walk.first_unreadable = at
    return behind


def _define(data: mmap, at: int, walk: _Walk) -> bool:
    """Note a definition; return whether it agrees with those before it."""
    kind, length, name, letters, columns = _FMT.unpack_from(data, at + 3)
    defined = message_format(_text(name), _text(letters), _text(columns))
    known = walk.formats.get(kind)
    if known is not None:
        if known == defined and walk.lengths[kind] == length:
            return True
        walk.stopped_by = f"{known.name} is defined twice"
        if walk.first_unreadable is None:
            walk.first_unreadable = at
        return False
    if length < 3 or kind == _FMT_TYPE:
        return True
    walk.formats[kind] = defined
    walk.lengths[kind] = length
    size = 3 + sum(_SIZES.get(letter, _LONGEST) for letter in defined.letters)
    if defined.name in WANTED and size == length and len(defined.fields) == len(defined.letters):
        walk.places[kind] = array("q")
    return True


def _table(
    content: npt.NDArray[np.uint8], message: MessageFormat, places: IntArray
) -> MessageTable:
    numbers: dict[str, FloatArray] = {}
    texts: dict[str, tuple[str, ...]] = {}
    at = 3
    for name, letter in zip(message.fields, message.letters, strict=True):
        size = _SIZES[letter]
        if name in WANTED[message.name]:
            cells = content[(places + at)[:, np.newaxis] + np.arange(size)]
            if letter in _NUMBERS:
                kind, unit = _NUMBERS[letter]
                numbers[name] = cells.view(kind)[:, 0].astype(np.float64) * unit
            else:
                texts[name] = tuple(_text(row.tobytes()) for row in cells)
        at += size
    return MessageTable(message=message, places=places, numbers=numbers, texts=texts)


def _text(cells: bytes) -> str:
    """Return the text before the first zero byte."""
    return cells.split(b"\x00", 1)[0].decode("latin-1")
