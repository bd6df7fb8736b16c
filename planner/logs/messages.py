"""Messages of a log as tables of their fields, and what every format makes of them."""

from __future__ import annotations

from array import array
from dataclasses import dataclass
from typing import TYPE_CHECKING, Self

import numpy as np

from planner.logs.record import LOG_DAMAGED, LoggedHome, LoggedItem
from planner.logs.series import Clock, Series
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from mmap import mmap

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding

PERIODIC = frozenset(("yaw_deg", "course_deg", "longitude_deg"))


class MessageTable(Value, eq=False):
    """All messages of one kind, as columns of the fields used."""

    name: str
    places: IntArray
    """Where in the log, rising until `in_order`: byte, line or number."""
    time_s: FloatArray
    """As the message has it, NaN where it has none; by :func:`table_runs` on the log's clock. [s]"""
    numbers: Mapping[str, FloatArray]
    """NaN where a message lacks the field."""
    texts: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    def rows(self, chosen: BoolArray | IntArray) -> Self:
        """Return some of the messages, of numbers in their order."""
        return replace(
            self,
            places=self.places[chosen],
            time_s=self.time_s[chosen],
            numbers={name: values[chosen] for name, values in self.numbers.items()},
            texts={
                name: tuple(np.array(texts, np.object_)[chosen].tolist())
                for name, texts in self.texts.items()
            },
        )

    def in_order(self) -> Self:
        """Return the messages in the order of their times, which is nearly that of their places."""
        if np.all(self.time_s[1:] >= self.time_s[:-1]):
            return self
        return self.rows(np.argsort(self.time_s, kind="stable"))

    def has(self, *fields: str) -> bool:
        """Whether it has all of these numbers."""
        return self.numbers.keys() >= set(fields)

    def value(self, name: str, row: int, unit: float = 1.0) -> float | None:
        """Return one number; ``None`` where it is missing."""
        number = float(self.numbers[name][row]) if name in self.numbers else np.nan
        return number * unit if np.isfinite(number) else None

    def series(
        self, name: str, *, unit: float = 1.0, valid: str | None = None, period: float | None = None
    ) -> Series | None:
        """Return a field as a series; ``None`` where it is missing or never known.

        ``valid`` is the field that marks the samples that count, where the table has it.
        """
        if name not in self.numbers:
            return None
        values = self.numbers[name] * unit
        if valid is not None and valid in self.numbers:
            values = np.where(self.numbers[valid] != 0.0, values, np.nan)
        return Series.of(self.time_s, values, f"{self.name}.{name}", period=period) or None

    def events(self, name: str, is_on: BoolArray, chosen: BoolArray | None = None) -> Series | None:
        """Return a state that a field gives as events; ``None`` where it is never known."""
        rows = np.ones(is_on.shape, np.bool_) if chosen is None else chosen
        found_in = f"{self.name}.{name}"
        return Series.of(self.time_s[rows], is_on[rows], found_in, is_event=True) or None

    def without_null_places(self, latitude: str, longitude: str) -> Self:
        """Return the table with latitude and longitude unknown where both are zero."""
        if not self.has(latitude, longitude):
            return self
        place = {name: self.numbers[name] for name in (latitude, longitude)}
        known = (place[latitude] != 0.0) | (place[longitude] != 0.0)
        known_place = {name: np.where(known, values, np.nan) for name, values in place.items()}
        return replace(self, numbers={**self.numbers, **known_place})


Tables = dict[str, MessageTable]
"""Tables by the name of their message."""


class MessageColumns:
    """The messages of one kind read so far."""

    def __init__(self, numbers: Iterable[str], texts: Iterable[str]) -> None:
        self.places = array("q")
        self.numbers = {name: array("d") for name in numbers}
        self.texts: dict[str, list[str]] = {name: [] for name in texts}

    def table(self, name: str) -> MessageTable:
        """Return them as a table, without times."""
        return MessageTable(
            name=name,
            places=np.array(self.places, np.int64),
            time_s=np.full(len(self.places), np.nan),
            numbers={name: np.array(values, np.float64) for name, values in self.numbers.items()},
            texts={name: tuple(texts) for name, texts in self.texts.items()},
        )


GIVE_UP_BYTES = 16 << 20
"""After so much that is no message the rest of a log is not looked at: a bad sector or a lost cluster of a
card is far smaller, and a sparse file of 1 GB ends at once. [B]"""
LONGEST_LINE = 1 << 16
"""Of a log in text: ArduPilot's lines have 200 characters."""


def is_unwritten(data: mmap | bytes, at: int) -> bool:
    """Return whether all from a place on is memory that was never written: zeros, or ones.

    Of more than what is searched for a message nobody knows.
    """
    return len(data) - at <= GIVE_UP_BYTES and not data[at:].strip(b"\x00\xff")


@dataclass(slots=True)
class Damage:
    """What of a log is no message."""

    count: int = 0
    """Bytes or lines."""
    first: int | None = None
    """The first of them."""
    stopped_by: str = ""
    """Why nothing after a place was read, where that is so."""

    def add(self, place: int, count: int) -> None:
        """Note a damaged part."""
        self.count += count
        if self.first is None:
            self.first = place

    def findings(self, source: str, size: int, unit: str) -> Iterator[Finding]:
        """Report the damage of a log of so many bytes or lines."""
        if self.count:
            why = f" ({self.stopped_by}; nothing after it is read)" if self.stopped_by else ""
            yield LOG_DAMAGED.finding(
                f"{source}: {self.count} of {size} {unit}, the first at {self.first}, are not "
                f"messages: left out{why}"
            )


def table_clock(tables: Iterable[MessageTable]) -> Clock:
    """Return the clock that the timed messages show."""
    columns = [(table.places, table.time_s) for table in tables]
    places, times = (np.concatenate(column) for column in zip(*columns, strict=True))
    return Clock.of(places, times)


def table_runs(tables: Mapping[str, MessageTable], clock: Clock) -> Iterator[Tables]:
    """Yield the messages of each run of the clock, strays and empty tables left out.

    A message without a time has that of the timed one before it.
    """
    for begin, end in clock.runs():
        found: Tables = {}
        for name, table in tables.items():
            inside = (table.places >= begin) & (table.places < end)
            inside &= np.isnan(table.time_s) | clock.is_in_time(table.places)
            if inside.any():
                chosen = table.rows(inside)
                before_s = clock.time_at_s(chosen.places)
                time_s = np.where(np.isnan(chosen.time_s), before_s, chosen.time_s)
                found[name] = replace(chosen, time_s=time_s)
        yield found


class Source(Value):
    """One field of one message."""

    message: str
    """Message or topic."""
    field: str
    unit: float
    """The field times this is in the column's unit; negative where the log counts downwards."""
    valid: str | None
    """Field of the message that marks the samples that count."""


def sources(*places: str, unit: float = 1.0, valid: str | None = None) -> tuple[Source, ...]:
    """Return sources written as ``MESSAGE.field``, all in the same unit."""
    return tuple(
        Source(message=message, field=name, unit=unit, valid=valid)
        for message, name in (place.split(".", 1) for place in places)
    )


def source_fields(quantities: Mapping[str, Sequence[Source]]) -> dict[str, set[str]]:
    """Return the fields that quantities are found in, by message."""
    fields: dict[str, set[str]] = {}
    for source in (source for places in quantities.values() for source in places):
        fields.setdefault(source.message, set()).add(source.field)
    return fields


def quantity_series(
    tables: Mapping[str, MessageTable], quantities: Mapping[str, Sequence[Source]]
) -> dict[str, Series]:
    """Return each quantity from the first of its places that has it."""
    found: dict[str, Series] = {}
    for name, places in quantities.items():
        candidates = (
            tables[s.message].series(
                s.field, unit=s.unit, valid=s.valid, period=360.0 if name in PERIODIC else None
            )
            for s in places
            if s.message in tables
        )
        series = next(filter(None, candidates), None)
        if series is not None:
            found[name] = series
    return found


def begin_and_end_s(tables: Mapping[str, MessageTable]) -> tuple[float, float]:
    """Return the times of the first and of the last message."""
    times = np.concatenate([table.time_s for table in tables.values()])
    return float(times.min()), float(times.max())


def modes_entered(time_s: FloatArray, modes: Sequence[str]) -> tuple[tuple[float, str], ...]:
    """Return time and name of each mode entered, of modes that are reported again and again."""
    entered = [
        (at_s, mode)
        for at_s, mode, before in zip(time_s.tolist(), modes, ("", *modes), strict=False)
        if mode and mode != before
    ]
    return tuple(entered)


def logged_homes(
    table: MessageTable | None,
    fields: tuple[str, str, str],
    units: tuple[float, float] = (1.0, 1.0),
) -> tuple[tuple[float, LoggedHome], ...]:
    """Return the homes that messages set, those without a place left out.

    Fields are of latitude, longitude and altitude; the units those of places and of altitudes.
    """
    if table is None or not table.has(*fields):
        return ()
    homes = []
    for row, time_s in enumerate(table.time_s.tolist()):
        latitude, longitude = (table.value(name, row, units[0]) for name in fields[:2])
        if latitude is None or longitude is None or not 0.0 < abs(latitude) <= 90.0:
            continue
        home = LoggedHome(
            latitude_deg=latitude,
            longitude_deg=longitude,
            altitude_amsl_m=table.value(fields[2], row, units[1]),
            found_in=table.name,
        )
        homes.append((time_s, home))
    return tuple(homes)


def items_flown(
    table: MessageTable | None,
    name: str,
    first_item: int,
    modes: tuple[tuple[float, str], ...],
    mission_mode: str,
) -> Series | None:
    """Return the items flown, from the field of those current: they stay current in other modes too.

    Events; 0 outside the mission mode. ``first_item`` is the item the vehicle numbers 0.
    """
    if table is None or name not in table.numbers:
        return None
    found_in = f"{table.name}.{name}"
    current = Series.of(table.time_s, table.numbers[name] + first_item, found_in, is_event=True)
    entered_s = np.array([time_s for time_s, _ in modes])
    is_mission = np.array([False, *(name == mission_mode for _, name in modes)])
    times = np.union1d(table.time_s, entered_s)
    is_flown = is_mission[np.searchsorted(entered_s, times, side="right")]
    flown = np.where(is_flown, np.nan_to_num(current.at(times), nan=0.0), 0.0)
    return Series.of(times, flown, found_in, is_event=True)


NO_CURRENT_A = 0.2
"""No multirotor flies on less; a sensor that never shows more is none. [A]"""
_NO_VOLTAGE_V = 0.5
"""A monitor that never shows more is not connected. [V]"""


def battery_series(
    table: MessageTable | None, voltage: str, current: str
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return `electrical_series` of the fields of a table in V and A; nothing where there is none."""
    if table is None:
        return {}, {}
    columns = table.numbers.get(voltage), table.numbers.get(current)
    return electrical_series(table.time_s, *columns, message=table.name, fields=(voltage, current))


def logged_item(
    table: MessageTable, row: int, fields: str, *, added: int = 0, unit: float = 1.0
) -> LoggedItem:
    """Return the mission item in a row: number, command, frame, parameters, place and altitude.

    ``added`` is what the item is above its number in the log; ``unit`` is that of latitude and longitude.
    """
    values = [table.value(name, row) for name in fields.split()]
    values[7:9] = [None if degrees is None else degrees * unit for degrees in values[7:9]]
    frame = None if values[2] is None else int(values[2])
    return LoggedItem(int(values[0] or 0.0) + added, int(values[1] or 0.0), frame, *values[3:])


def electrical_series(
    time_s: FloatArray,
    voltage_v: FloatArray | None,
    current_a: FloatArray | None,
    *,
    message: str,
    fields: tuple[str, str],
) -> tuple[dict[str, Series], dict[str, str]]:
    """Return voltage, current and power of one battery message, and what is wrong with them.

    Voltage and current are NaN where not known, ``None`` where the message has none; its name is
    empty for columns of a file.  The remarks are by the names of the quantities no sensor gives.
    """
    of_voltage, of_current = (f"{message}.{name}" if message else name for name in fields)
    series: dict[str, Series] = {}
    remarks: dict[str, str] = {}
    if voltage_v is not None:
        # A monitor that has measured nothing yet shows zero.
        voltage_v = np.where(voltage_v > _NO_VOLTAGE_V, voltage_v, np.nan)
        if np.isfinite(voltage_v).any():
            series["voltage_v"] = Series.of(time_s, voltage_v, of_voltage)
        else:
            remarks["voltage_v"] = (
                f"{of_voltage} never exceeds {_NO_VOLTAGE_V:g} V: no voltage sensor"
            )
    if current_a is not None:
        if np.any(current_a > NO_CURRENT_A):
            series["current_a"] = Series.of(time_s, current_a, of_current)
        else:
            remarks["current_a"] = (
                f"{of_current} never exceeds {NO_CURRENT_A:g} A: no current sensor"
            )
    if voltage_v is not None and current_a is not None and len(series) == 2:
        power = Series.of(time_s, voltage_v * current_a, f"{of_voltage} × {fields[1]}")
        if len(power):
            series["power_w"] = power
    return series, remarks
