"""Reader of ArduPilot's DataFlash logs, binary and text, to recordings."""

from __future__ import annotations

import struct
from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.errors import LogFileError
from planner.logs import dataflash_quantities as events
from planner.logs.dataflash_quantities import other_batteries, quantity_series
from planner.logs.record import LOG_DAMAGED, Recording, carried_over
from planner.logs.series import Clock, MessageColumns, MessageTable
from planner.values import Value, field_values

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from mmap import mmap

    import numpy.typing as npt

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.logs.record import LogFile


_ATTITUDE_ESTIMATE = ("TimeUS", "TimeMS", "C", "VN", "VE", "VD")
_WIND_ESTIMATE = ("TimeUS", "TimeMS", "C", "VWN", "VWE")
_BATTERY = ("TimeUS", "TimeMS", "Inst", "Instance", "Volt", "Curr")
_COMMAND = (
    *("TimeUS", "TimeMS", "CTot", "CNum", "CId", "Frame", "Lat", "Lng", "Alt"),
    *("Prm1", "Prm2", "Prm3", "Prm4"),
)

WANTED: Mapping[str, frozenset[str]] = {
    name: frozenset(fields)
    for name, fields in {
        "ARM": ("TimeUS", "ArmState"),
        "ARSP": ("TimeUS", "TimeMS", "I", "Airspeed"),
        "ATT": ("TimeUS", "TimeMS", "Roll", "Pitch", "Yaw"),
        "BAT": _BATTERY,
        "BAT2": _BATTERY,
        "CMD": _COMMAND,
        "CTUN": ("TimeUS", "TimeMS", "Alt", "DAlt", "CRt", "DCRt"),
        "CURR": _BATTERY,
        "CUR2": _BATTERY,
        "EKF1": _ATTITUDE_ESTIMATE,
        "EKF2": _WIND_ESTIMATE,
        "EV": ("TimeUS", "TimeMS", "Id"),
        "GPS": (
            *("TimeUS", "T", "TimeMS", "I", "Status", "Lat", "Lng", "Alt", "RelAlt"),
            *("Spd", "GCrs", "VZ"),
        ),
        "MISE": _COMMAND,
        "MODE": ("TimeUS", "TimeMS", "Mode", "ModeNum"),
        "MSG": ("TimeUS", "TimeMS", "Message"),
        "NKF1": _ATTITUDE_ESTIMATE,
        "NKF2": _WIND_ESTIMATE,
        "NTUN": (
            *("TimeUS", "TimeMS", "DPosX", "DPosY", "PosX", "PosY", "DVelX", "DVelY"),
            *("VelX", "VelY"),
        ),
        "ORGN": ("TimeUS", "TimeMS", "Type", "Lat", "Lng", "Alt"),
        "PARM": ("TimeUS", "TimeMS", "Name", "Value"),
        "POS": ("TimeUS", "TimeMS", "Lat", "Lng", "Alt", "RelHomeAlt", "RelAlt"),
        "PSC": ("TimeUS", "TPX", "TPY", "PX", "PY", "TVX", "TVY", "VX", "VY"),
        "PSCZ": ("TimeUS", "TPZ", "PZ", "DVZ", "TVZ", "VZ"),
        "PSCN": ("TimeUS", "TPN", "PN", "DVN", "VN"),
        "PSCE": ("TimeUS", "TPE", "PE", "DVE", "VE"),
        "PSCD": ("TimeUS", "TPD", "PD", "DVD", "VD"),
        "STAT": ("TimeUS", "Armed"),
        "XKF1": _ATTITUDE_ESTIMATE,
        "XKF2": _WIND_ESTIMATE,
    }.items()
}
"""The fields used, by message; all names any firmware has had."""


class MessageFormat(Value):
    """The definition of a message: its FMT."""

    name: str
    letters: str
    """A letter for the type of each field."""
    fields: tuple[str, ...]


class DataflashTable(MessageTable, eq=False):
    """All messages of one name, in the unit the format letter gives: c and e are hundredths, L degrees."""

    message: MessageFormat

    def letter(self, field: str) -> str:
        """Return the type of a field."""
        return self.message.letters[self.message.fields.index(field)]

    def time_s(self) -> FloatArray | None:
        """Return the messages' own times since boot; ``None`` where they have none. [s]"""
        if "TimeUS" in self.numbers:
            return self.numbers["TimeUS"] * 1e-6
        if "T" in self.numbers:  # beside TimeMS of old GPS messages, which is the satellites' time
            return self.numbers["T"] * 1e-3
        if "TimeMS" in self.numbers and self.message.name != "GPS":
            return self.numbers["TimeMS"] * 1e-3
        return None


class DataflashLog(Value, eq=False):
    """The wanted messages of a log."""

    tables: Mapping[str, DataflashTable]
    size: int
    """Bytes or lines of the log."""
    unit: str
    """``bytes`` or ``lines``."""
    unreadable: int
    """How many of them are no messages."""
    first_unreadable: int | None
    """The first of them."""
    stopped_by: str = ""
    """Why nothing after a place was read, where that is so."""

    def between(self, begin: int, end: int) -> Mapping[str, DataflashTable]:
        """Return the messages from one place to before another, tables without any left out."""
        tables = {
            name: table.rows((table.places >= begin) & (table.places < end))
            for name, table in self.tables.items()
        }
        return {name: table for name, table in tables.items() if len(table.places)}


def message_format(name: str, letters: str, columns: str) -> MessageFormat:
    """Return the definition of a message from the texts of its FMT."""
    fields = tuple(field.strip() for field in columns.split(",")) if columns.strip() else ()
    return MessageFormat(name=name.strip(), letters=letters.strip(), fields=fields)


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
"""Type and unit of the format letters of numbers."""
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
    """Return the wanted messages of a binary DataFlash log."""
    walk = _walk(data)
    content = np.frombuffer(data, np.uint8)
    tables: dict[str, DataflashTable] = {}
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
            if last:  # a message before damage is damaged itself
                last.pop()
            last = None
            at = _after_damage(data, at, walk)
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


def _after_damage(data: mmap, at: int, walk: _Walk) -> int:
    """Return where the next message may begin, and count what lies before it."""
    after = data.find(HEADER, at + 1)
    while after >= 0 and after + 3 <= len(data) and not walk.lengths[data[after + 2]]:
        after = data.find(HEADER, after + 1)
    if after < 0:
        after = len(data)
        rest = data[at:]
        if len(rest) < _LONGEST or not rest.strip(b"\x00\xff"):
            return after  # the last message, cut off, or memory that was never written
    walk.unreadable += after - at
    if walk.first_unreadable is None:
        walk.first_unreadable = at
    return after


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
) -> DataflashTable:
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
    return DataflashTable(message=message, places=places, numbers=numbers, texts=texts)


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
        self.wanted = tuple(
            (number, name, letter in _TEXT_LETTERS)
            for number, (name, letter) in enumerate(
                zip(message.fields, message.letters, strict=True)
            )
            if name in WANTED[message.name]
        )
        """Number, name and whether it is text, of each field wanted."""
        super().__init__(
            (name for _, name, is_text in self.wanted if not is_text),
            (name for _, name, is_text in self.wanted if is_text),
        )


def read_text(data: mmap) -> DataflashLog:
    """Return the wanted messages of a DataFlash log in text."""
    rows: dict[bytes, _TextRows] = {}
    unreadable = 0
    first_unreadable: int | None = None
    number = 0
    while line := data.readline():
        number += 1
        name = line[: line.find(b",")].strip()
        if name == b"FMT":
            _define_text(line.decode("latin-1"), rows)
        elif name in rows and not _add(line.decode("latin-1"), number, rows[name]):
            unreadable += 1
            first_unreadable = first_unreadable or number
    return DataflashLog(
        tables={
            text.message.name: DataflashTable(message=text.message, **field_values(text.table()))
            for text in rows.values()
            if len(text.places)
        },
        size=number,
        unit="lines",
        unreadable=unreadable,
        first_unreadable=first_unreadable,
    )


def _define_text(line: str, rows: dict[bytes, _TextRows]) -> None:
    parts = line.split(",", 5)
    if len(parts) < 6:
        return
    message = message_format(parts[3], parts[4], parts[5])
    key = message.name.encode("latin-1")
    if message.name not in WANTED or len(message.fields) != len(message.letters) or key in rows:
        return
    rows[key] = _TextRows(message)


def _add(line: str, place: int, rows: _TextRows) -> bool:
    """Add a line; return whether it fits its FMT."""
    count = len(rows.message.fields)
    parts = line.split(",", count)[1:]
    if len(parts) != count:
        return False
    try:
        numbers = [float(parts[number]) for number, _, is_text in rows.wanted if not is_text]
    except ValueError:
        return False
    for values, value in zip(rows.numbers.values(), numbers, strict=True):
        values.append(value)
    for number, name, is_text in rows.wanted:
        if is_text:
            rows.texts[name].append(parts[number].strip())
    rows.places.append(place)
    return True


def dataflash_recordings(data: mmap, file: LogFile, *, is_binary: bool) -> tuple[Recording, ...]:
    """Return what a DataFlash log holds, a recording for each run of its clock."""
    log = read_binary(data) if is_binary else read_text(data)
    own_times = {name: table.time_s() for name, table in log.tables.items()}
    timed = {name: times for name, times in own_times.items() if times is not None}
    if not timed:
        msg = "holds no message with a time that ArduPilot 3.1 or newer would log"
        raise LogFileError(msg, source=file.source)
    clock = Clock.of(
        np.concatenate([log.tables[name].places for name in timed]),
        np.concatenate(list(timed.values())),
    )
    findings = (*_damage(log, file.source), *clock.findings(file.source))
    recordings: list[Recording] = []
    for begin, end in clock.runs():
        tables = {
            name: table.rows(clock.is_in_time(table.places)) if name in timed else table
            for name, table in log.between(begin, end).items()
        }
        recordings.append(_recording(tables, clock, file, findings))
    return carried_over(recordings)


def _recording(
    tables: Mapping[str, DataflashTable], clock: Clock, file: LogFile, findings: tuple[Finding, ...]
) -> Recording:
    times: dict[str, FloatArray] = {}
    for name, table in tables.items():
        own = table.time_s()
        times[name] = clock.time_at_s(table.places) if own is None else own
    series, remarks = quantity_series(tables, times)
    firmware, frame = events.firmware_and_frame(tables)
    entered = events.modes(tables, times, firmware)
    every = np.concatenate([np.empty(0), *(values for values in times.values())])
    return Recording(
        file=file,
        begin_s=float(np.min(every, initial=np.inf)),
        end_s=float(np.max(every, initial=-np.inf)),
        series=series,
        is_armed=events.armed_events(tables, times),
        is_landed=events.landed_events(tables, times),
        modes=entered,
        modes_found_in="MODE.Mode",
        mission_item=events.mission_item_events(tables, times, entered),
        homes=events.homes(tables, times),
        missions=events.missions(tables, times),
        parameters=events.parameters(tables, times),
        autopilot=Autopilot.ARDUPILOT,
        firmware=firmware,
        vehicle=frame,
        position_jumps=(),
        remarks=remarks,
        findings=(*findings, *other_batteries(tables, file.source)),
    )


def _damage(log: DataflashLog, source: str) -> Iterator[Finding]:
    if not log.unreadable:
        return
    why = f" ({log.stopped_by}; nothing after it is read)" if log.stopped_by else ""
    yield LOG_DAMAGED.finding(
        f"{source}: {log.unreadable} of {log.size} {log.unit}, the first at "
        f"{log.first_unreadable}, are not messages: left out{why}"
    )
