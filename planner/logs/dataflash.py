"""Reader of ArduPilot's DataFlash logs, binary and text, to tables of their messages."""

from __future__ import annotations

import struct
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import LogFileError
from planner.logs.dataflash_quantities import WANTED, dataflash_recording
from planner.logs.messages import (
    GIVE_UP_BYTES,
    LONGEST_LINE,
    Damage,
    MessageColumns,
    MessageTable,
    is_unwritten,
    table_clock,
    table_runs,
)
from planner.logs.record import carried_over
from planner.values import Value, replace

if TYPE_CHECKING:
    from mmap import mmap

    import numpy.typing as npt

    from planner.arrays import FloatArray, IntArray
    from planner.logs.messages import Tables
    from planner.logs.record import LogFile, Recording


class MessageFormat(Value):
    """The definition of a message: its FMT."""

    name: str
    letters: str
    """A letter for the type of each field."""
    fields: tuple[str, ...]

    @property
    def is_wanted(self) -> bool:
        """Whether any of its fields may be used."""
        return self.name in WANTED and len(self.fields) == len(self.letters)


def _message_format(name: str, letters: str, columns: str) -> MessageFormat:
    fields = tuple(field.strip() for field in columns.split(",")) if columns.strip() else ()
    return MessageFormat(name=name.strip(), letters=letters.strip(), fields=fields)


def _timed(table: MessageTable, message: MessageFormat) -> MessageTable:
    """Return a table with the messages' own times, and its currents and voltages in A and V."""
    numbers = dict(table.numbers)
    for name, letter in zip(message.fields, message.letters, strict=True):
        if name in {"Volt", "Curr"} and letter in "hH" and name in numbers:
            numbers[name] = numbers[name] * 1e-2  # Copter 3 wrote hundredths as plain integers
    time_s = table.time_s
    if "TimeUS" in numbers:
        time_s = numbers["TimeUS"] * 1e-6
    elif "T" in numbers:  # beside TimeMS of old GPS messages, which is the satellites' time
        time_s = numbers["T"] * 1e-3
    elif "TimeMS" in numbers and message.name != "GPS":
        time_s = numbers["TimeMS"] * 1e-3
    return replace(table, numbers=numbers, time_s=time_s)


HEADER = b"\xa3\x95"
_FMT_TYPE = 128
_FMT = struct.Struct("<BB4s16s64s")
_FMT_LENGTH = 3 + _FMT.size
_LONGEST = 255
"""A length is one byte."""

_KINDS = {
    letter: kind
    for kind, letters in (
        *(("<i1", "b"), ("<u1", "BM"), ("<i2", "hc"), ("<u2", "HC"), ("<i4", "ieL"), ("<u4", "IE")),
        *(("<i8", "q"), ("<u8", "Q"), ("<f2", "g"), ("<f4", "f"), ("<f8", "d")),
    )
    for letter in letters
}
"""Type by the format letter of a number."""
_UNITS = {**dict.fromkeys("cCeE", 1e-2), "L": 1e-7}
_SIZES = {letter: int(kind[2]) for letter, kind in _KINDS.items()}
_SIZES |= {"n": 4, "N": 16, "Z": 64, "a": 64}


@dataclass(slots=True)
class _Walk:
    """What one pass over the bytes brings."""

    damage: Damage
    formats: dict[int, MessageFormat] = field(default_factory=dict)
    lengths: list[int] = field(default_factory=lambda: [0] * 256)
    places: dict[int, array[int]] = field(default_factory=dict)


def read_binary(data: mmap, damage: Damage) -> Tables:
    """Return the wanted messages of a binary DataFlash log, and note what is no message."""
    content = np.frombuffer(data, np.uint8)
    heads = _heads(content)
    walk = _Walk(damage)
    walk.lengths[_FMT_TYPE] = _FMT_LENGTH
    at, last = _walk_definitions(data, heads, walk)
    if at is not None:
        _walk_messages(data, heads, walk, at, last)
    tables: Tables = {}
    for kind, places in walk.places.items():
        if len(places):
            table = _table(content, walk.formats[kind], np.array(places, np.int64))
            tables.setdefault(table.name, table)
    return tables


class _Heads(Value, eq=False):
    """Where a message may begin, and of which kind it is then."""

    places: IntArray
    kinds: npt.NDArray[np.uint8]


_BLOCK = 1 << 24


def _heads(content: npt.NDArray[np.uint8]) -> _Heads:
    """Return every place of the bytes all messages begin with, also those inside of messages."""
    first, second = HEADER
    found = []
    for begin in range(0, len(content) - 2, _BLOCK):
        end = min(begin + _BLOCK, len(content) - 2)
        is_head = (content[begin:end] == first) & (content[begin + 1 : end + 1] == second)
        found.append(np.flatnonzero(is_head) + begin)
    places = np.concatenate([np.zeros(0, np.int64), *found])
    return _Heads(places=places, kinds=content[places + 2])


def _walk_definitions(
    data: mmap, heads: _Heads, walk: _Walk
) -> tuple[int | None, array[int] | None]:
    """Find the messages up to the last definition, one by one.

    Returns where the next may begin and the places of the last one's kind; ``None``: there are no more.
    """
    defining = heads.places[heads.kinds == _FMT_TYPE]
    until = int(defining[-1]) if len(defining) else -1
    lengths, places = walk.lengths, walk.places
    first, second = HEADER
    at, end = 0, len(data)
    last: array[int] | None = None
    while at <= until and at + 3 <= end:
        kind = data[at + 2]
        length = lengths[kind]
        if data[at] != first or data[at + 1] != second or not length:
            if last:  # a message before damage is damaged itself
                last.pop()
            last = None
            at = _after_damage(data, at, walk)
            continue
        if at + length > end:
            return None, None
        last = places.get(kind)
        if last is not None:
            last.append(at)
        elif kind == _FMT_TYPE and not _define(data, at, walk):
            walk.damage.add(at, end - at)
            return None, None
        at += length
    return at, last


def _walk_messages(
    data: mmap, heads: _Heads, walk: _Walk, at: int, last: array[int] | None
) -> None:
    """Find the messages after the last definition, of which each says where the next begins.

    A run of them is taken at once: heads that follow each other without one inside of a message.
    """
    size = np.array(walk.lengths)[heads.kinds]
    after = heads.places + size
    following = np.searchsorted(heads.places, after)
    count, end = len(heads.places), len(data)
    is_next = (size > 0) & (following == np.arange(1, count + 1)) & (following < count)
    which = following[is_next]
    is_next[is_next] = (heads.places[which] == after[is_next]) & (size[which] > 0)
    last_of_run = np.flatnonzero(~is_next)
    taken: list[tuple[int, int]] = []
    while at + 3 <= end:
        begin = int(np.searchsorted(heads.places, at))
        if begin == count or heads.places[begin] != at or not size[begin]:
            if taken:  # a message before damage is damaged itself
                taken[-1] = (taken[-1][0], taken[-1][1] - 1)
            elif last:
                last.pop()
            last = None
            at = _after_damage(data, at, walk)
            continue
        if after[begin] > end:
            break
        stop = int(last_of_run[np.searchsorted(last_of_run, begin)])
        stop -= int(after[stop] > end)  # the last message, cut off
        taken.append((begin, stop + 1))
        at = int(after[stop])
    is_taken = np.zeros(count, np.bool_)
    for begin, stop in taken:
        is_taken[begin:stop] = True
    for kind, places in walk.places.items():
        places.frombytes(heads.places[is_taken & (heads.kinds == kind)].tobytes())


def _after_damage(data: mmap, at: int, walk: _Walk) -> int:
    """Return where the next message may begin, and count what lies before it."""
    stop = min(len(data), at + GIVE_UP_BYTES)
    after = data.find(HEADER, at + 1, stop)
    while after >= 0 and after + 3 <= len(data) and not walk.lengths[data[after + 2]]:
        after = data.find(HEADER, after + 1, stop)
    if after < 0:
        after = len(data)
        if after - at < _LONGEST or is_unwritten(data, at):
            return after  # the last message, cut off, or memory that was never written
        if after > stop:
            walk.damage.stopped_by = f"no message within {GIVE_UP_BYTES >> 20} MiB"
    walk.damage.add(at, after - at)
    return after


def _define(data: mmap, at: int, walk: _Walk) -> bool:
    """Note a definition; return whether it agrees with those before it."""
    kind, length, name, letters, columns = _FMT.unpack_from(data, at + 3)
    defined = _message_format(_text(name), _text(letters), _text(columns))
    known = walk.formats.get(kind)
    if known is not None:
        if known == defined and walk.lengths[kind] == length:
            return True
        walk.damage.stopped_by = f"{known.name} is defined twice"
        return False
    if length < 3 or kind == _FMT_TYPE:
        return True
    walk.formats[kind] = defined
    walk.lengths[kind] = length
    size = 3 + sum(_SIZES.get(letter, _LONGEST) for letter in defined.letters)
    if defined.is_wanted and size == length:
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
            if letter in _KINDS:
                values = cells.view(_KINDS[letter])[:, 0].astype(np.float64)
                numbers[name] = values * _UNITS.get(letter, 1.0)
            else:
                texts[name] = tuple(_text(row.tobytes()) for row in cells)
        at += size
    unknown = np.full(places.shape, np.nan)
    table = MessageTable(
        name=message.name, places=places, time_s=unknown, numbers=numbers, texts=texts
    )
    return _timed(table, message)


def _text(cells: bytes) -> str:
    """Return the text before the first zero byte."""
    return cells.split(b"\x00", 1)[0].decode("latin-1")


MAGIC = b"FMT, "
"""The first bytes: the first line defines FMT itself."""

_TEXT_LETTERS = frozenset("nNZM")
"""Format letters of texts; modes are written as numbers or by name."""


class _TextRows(MessageColumns):
    """The lines of one message so far."""

    def __init__(self, message: MessageFormat) -> None:
        self.message = message
        wanted = [
            (number, name, letter in _TEXT_LETTERS)
            for number, (name, letter) in enumerate(
                zip(message.fields, message.letters, strict=True)
            )
            if name in WANTED[message.name]
        ]
        self.of_number = {name: number for number, name, is_text in wanted if not is_text}
        self.of_text = {name: number for number, name, is_text in wanted if is_text}
        super().__init__(self.of_number, self.of_text)

    def add(self, line: str, place: int) -> bool:
        """Add a line; return whether it fits its FMT."""
        count = len(self.message.fields)
        parts = line.split(",", count)[1:]
        if len(parts) != count:
            return False
        try:
            numbers = [float(parts[number]) for number in self.of_number.values()]
        except ValueError:
            return False
        for values, value in zip(self.numbers.values(), numbers, strict=True):
            values.append(value)
        for name, texts in self.texts.items():
            texts.append(parts[self.of_text[name]].strip())
        self.places.append(place)
        return True


def read_text(data: mmap, damage: Damage) -> tuple[Tables, int]:
    """Return the wanted messages of a DataFlash log in text, and the number of its lines."""
    rows: dict[bytes, _TextRows] = {}
    number = 0
    while line := _line(data):
        number += 1
        name = line[: line.find(b",")].strip()
        if name == b"FMT":
            _define_text(line.decode("latin-1"), rows)
        elif name in rows:
            if not rows[name].add(line.decode("latin-1"), number):
                damage.add(number, 1)
        elif len(line) == LONGEST_LINE and line.strip(b"\x00\xff"):
            damage.add(number, 1)
    return {
        text.message.name: _timed(text.table(text.message.name), text.message)
        for text in rows.values()
        if len(text.places)
    }, number


def _line(data: mmap) -> bytes:
    """Return the next line; of what is far too long for one the beginning, as the last."""
    begin = data.tell()
    end = data.find(b"\n", begin, begin + GIVE_UP_BYTES) + 1 or len(data)
    data.seek(end)
    return data[begin : min(end, begin + LONGEST_LINE)]


def _define_text(line: str, rows: dict[bytes, _TextRows]) -> None:
    parts = line.split(",", 5)
    if len(parts) == 6:
        message = _message_format(parts[3], parts[4], parts[5])
        if message.is_wanted:
            rows.setdefault(message.name.encode("latin-1"), _TextRows(message))


def dataflash_recordings(data: mmap, file: LogFile, *, is_binary: bool) -> tuple[Recording, ...]:
    """Return what a DataFlash log holds, a recording for each run of its clock."""
    damage = Damage()
    if is_binary:
        tables, size, unit = read_binary(data, damage), len(data), "bytes"
    else:
        (tables, size), unit = read_text(data, damage), "lines"
    if all(np.isnan(table.time_s).all() for table in tables.values()):
        msg = "holds no message with a time that ArduPilot 3.1 or newer would log"
        raise LogFileError(msg, source=file.source)
    clock = table_clock(tables.values())
    findings = (*damage.findings(file.source, size, unit), *clock.findings(file.source))
    runs = table_runs(tables, clock)
    return carried_over(dataflash_recording(run, file, findings) for run in runs)
