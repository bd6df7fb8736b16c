"""Reader of flight logs in CSV to a recording, by a mapping of the columns."""

from __future__ import annotations

import csv
import gzip
import math
import re
import zlib
from array import array
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.catalogue.flight_log import LOG_DAMAGED
from planner.errors import LogFileError
from planner.logs.attitude import euler_angles_deg
from planner.logs.clock import Clock
from planner.logs.csv_known import KNOWN_MAPPINGS
from planner.logs.csv_mapping import STATES, Axes
from planner.logs.electrical import electrical_series
from planner.logs.recording import Recording
from planner.logs.series import Series

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from mmap import mmap

    from planner.findings import Finding
    from planner.logs.csv_mapping import CsvMapping, Orientation
    from planner.logs.record import FloatArray, IntArray
    from planner.logs.recording import LogFile

GZIP_MAGIC = b"\x1f\x8b"
_MOST_CHARACTERS = 1 << 30
"""A day at ten rows a second is a fifth of that."""
_HEADER_CHARACTERS = 1 << 16
_MARKS = (",", ";", "\t")
"""What may stand between columns."""
_PERIODIC = ("yaw_deg", "roll_deg", "course_deg", "longitude_deg", "reference_longitude_deg")
_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")
_TRUE = frozenset(("1", "1.0", "true", "yes", "on"))
_HELD_SHARE = 0.5
"""Where fewer rows bring a new value, the old one is repeated until the next is measured. [-]"""
_LONGEST_HOLD_S = 5.0
"""No battery is measured more seldom than this. [s]"""
_LEAST_CHANGES = 10
"""Fewer changes tell no rate."""


def csv_recordings(file: LogFile, mapping: CsvMapping | None) -> tuple[Recording, ...]:
    """Return what a CSV file tells, a recording for each run of its clock.

    Parameters
    ----------
    file : LogFile
        Which file, plain or gzipped.
    mapping : CsvMapping, optional
        Which column is what; recognised by the headers where it is one of the known.

    Returns
    -------
    tuple of Recording
        One, unless time goes back.

    Raises
    ------
    LogFileError
        If columns are missing or no row has a time.
    """
    table = _read(file.source, mapping)
    numbers = table.numbers()
    clock = Clock.of(np.arange(table.count, dtype=np.int64), numbers["time_s"])
    if not len(clock.places):
        msg = f"no row has a number in the column {table.mapping.columns['time_s'].column!r}"
        raise LogFileError(msg, source=file.source)
    findings = (*table.findings(), *clock.findings(file.source))
    return tuple(
        _recording(table, numbers, chosen, file, findings)
        for begin, end in clock.runs()
        if len(chosen := clock.places[(clock.places >= begin) & (clock.places < end)])
    )


_CONTROLS = re.compile(rb"[\x00-\x08\x0e-\x1f]")
"""Bytes that no line of a text has."""
NO_KNOWN_LOG = "is no log of a kind that is known: DataFlash, ULog, telemetry (tlog) or CSV"


def looks_like_csv(data: mmap) -> bool:
    """Return whether the first line of a file is text with separators in it."""
    head = data[:_HEADER_CHARACTERS]
    if head[:2] == GZIP_MAGIC:
        return True
    line = head.split(b"\n", 1)[0]
    return not _CONTROLS.search(line) and any(mark.encode() in line for mark in _MARKS)


class _Table:
    """The wanted columns of the rows so far."""

    def __init__(self, mapping: CsvMapping, headers: tuple[str, ...], source: str) -> None:
        missing = sorted(mapping.headers - set(headers))
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            msg = f"has no column {missing[0]!r}{more}, which the mapping {mapping.name} names"
            raise LogFileError(msg, source=source)
        self.mapping = mapping
        self.source = source
        self.count = 0
        self.breaks_off = ""
        self._short = 0
        self._width = len(headers)
        turned = () if mapping.orientation is None else mapping.orientation.columns
        self._numbers = {
            name: (headers.index(entry.column), entry.factor, array("d"))
            for name, entry in mapping.columns.items()
            if name not in STATES
        }
        self._numbers |= {name: (headers.index(name), 1.0, array("d")) for name in turned}
        self._texts: dict[str, tuple[int, list[str]]] = {
            name: (headers.index(entry.column), [])
            for name, entry in mapping.columns.items()
            if name in STATES
        }

    def add(self, row: list[str]) -> None:
        """Add a row; cells that are no numbers are not known."""
        if not row:
            return
        if len(row) < self._width:
            self._short += 1
            return
        for index, factor, values in self._numbers.values():
            values.append(_number(row[index]) * factor)
        for index, texts in self._texts.values():
            texts.append(row[index].strip())
        self.count += 1

    def numbers(self) -> dict[str, FloatArray]:
        """Return the columns of numbers by the names of quantities, quaternions by header."""
        return {name: np.array(values) for name, (_, _, values) in self._numbers.items()}

    def texts(self, name: str) -> list[str] | None:
        """Return a column of text."""
        return self._texts[name][1] if name in self._texts else None

    def findings(self) -> Iterator[Finding]:
        """Return what is wrong with the rows."""
        if self._short:
            yield LOG_DAMAGED.finding(
                f"{self.source}: fewer columns than the header: {self._short} of "
                f"{numbers.count(self.count + self._short, 'row')} left out"
            )
        if self.breaks_off:
            yield LOG_DAMAGED.finding(
                f"{self.source}: breaks off after {numbers.count(self.count, 'row')}: {self.breaks_off}"
            )


def _read(source: str, mapping: CsvMapping | None) -> _Table:
    """Return the columns of a file, as far as it can be read."""
    path = Path(source)
    with path.open("rb") as file:
        is_zipped = file.read(len(GZIP_MAGIC)) == GZIP_MAGIC
    opened = gzip.open if is_zipped else open
    table: _Table | None = None
    try:
        with opened(path, "rt", encoding="utf-8-sig", errors="replace", newline="") as text:
            header = text.readline(_HEADER_CHARACTERS)
            mark = max(_MARKS, key=header.count)
            if mark not in header:
                msg = NO_KNOWN_LOG
                if is_zipped:
                    msg += "; gzipped logs of other kinds must be unpacked first"
                raise LogFileError(msg, source=source)
            headers = tuple(name.strip() for name in next(csv.reader([header], delimiter=mark)))
            table = _Table(mapping or _known_mapping(headers, source), headers, source)
            for row in csv.reader(_limited(text, source), delimiter=mark):
                table.add(row)
    except (csv.Error, EOFError, OSError, zlib.error) as error:
        if table is None or not table.count:
            msg = f"cannot be read: {getattr(error, 'strerror', None) or error}"
            raise LogFileError(msg, source=source) from error
        table.breaks_off = str(error)
    return table


def _limited(lines: Iterable[str], source: str) -> Iterator[str]:
    """Yield lines until there are too many of them for a log."""
    characters = 0
    for line in lines:
        characters += len(line)
        if characters > _MOST_CHARACTERS:
            msg = f"is larger than {_MOST_CHARACTERS >> 20} MiB of text: this is no flight log"
            raise LogFileError(msg, source=source)
        yield line


def _known_mapping(headers: tuple[str, ...], source: str) -> CsvMapping:
    for mapping in KNOWN_MAPPINGS:
        if mapping.headers <= set(headers):
            return mapping
    known = ", ".join(mapping.name for mapping in KNOWN_MAPPINGS)
    msg = f"has columns of no known kind ({known}): give a mapping of its columns"
    raise LogFileError(msg, source=source)


def _number(cell: str) -> float:
    try:
        return float(cell)
    except ValueError:
        return math.nan


def _recording(
    table: _Table,
    numbers: Mapping[str, FloatArray],
    chosen: IntArray,
    file: LogFile,
    findings: tuple[Finding, ...],
) -> Recording:
    mapping = table.mapping
    values = {name: column[chosen] for name, column in numbers.items()}
    time_s = values.pop("time_s")
    headers = {name: entry.column for name, entry in mapping.columns.items()}
    if mapping.orientation is not None:
        values |= _angles(mapping.orientation, values)
        headers |= dict.fromkeys(_ANGLES, ", ".join(mapping.orientation.columns))
    for turned, components in (_by_yaw(values), _by_origin(values)):
        if turned:
            values |= turned
            headers |= dict.fromkeys(turned, ", ".join(headers[name] for name in components))
    series = {
        name: Series.of(
            time_s,
            column,
            headers[name],
            period=360.0 if name in _PERIODIC else None,
        )
        for name, column in values.items()
        if name not in {"voltage_v", "current_a"}
    }
    electrical, remarks = _electrical(time_s, values, headers)
    series |= electrical
    return Recording(
        file=file,
        begin_s=float(time_s.min()),
        end_s=float(time_s.max()),
        series={name: found for name, found in series.items() if len(found)},
        is_armed=_state(table, "is_armed", time_s, chosen),
        is_landed=_state(table, "is_landed", time_s, chosen),
        modes=_modes(table, time_s, chosen),
        modes_found_in=headers.get("mode", ""),
        mission_item=_state(table, "mission_item", time_s, chosen),
        homes=(),
        missions=(),
        parameters=(),
        autopilot=None,
        firmware="",
        vehicle=mapping.vehicle,
        position_jumps=(),
        remarks=remarks,
        findings=findings,
    )


def _angles(orientation: Orientation, values: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return roll, pitch and yaw, and take the quaternion away."""
    w, x, y, z = (values.pop(column) for column in orientation.columns)
    roll_deg, pitch_deg, yaw_deg = euler_angles_deg(w, x, y, z)
    if orientation.axes is Axes.FLU_ENU:
        # Left and up turn the other way than right and down; yaw is from east to north.
        pitch_deg, yaw_deg = -pitch_deg, 90.0 - yaw_deg
    return dict(zip(_ANGLES, (roll_deg, pitch_deg, yaw_deg), strict=True))


def _by_yaw(values: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], tuple[str, str]]:
    """Return the velocity by north and east where it is given along the body, and take that away."""
    components = "velocity_forward_m_s", "velocity_right_m_s"
    if not {*components, "yaw_deg"} <= values.keys():
        return {}, components
    forward, right = (values.pop(name) for name in components)
    yaw = np.radians(values["yaw_deg"])
    return {
        "velocity_north_m_s": forward * np.cos(yaw) - right * np.sin(yaw),
        "velocity_east_m_s": forward * np.sin(yaw) + right * np.cos(yaw),
    }, components


def _by_origin(values: dict[str, FloatArray]) -> tuple[dict[str, FloatArray], tuple[str, str]]:
    """Return the wind by north and east where speed and origin are given, and take those away."""
    components = "wind_speed_m_s", "wind_from_deg"
    if not set(components) <= values.keys():
        return {}, components
    speed, origin_deg = (values.pop(name) for name in components)
    origin = np.radians(origin_deg)
    return {
        "wind_north_m_s": -speed * np.cos(origin),
        "wind_east_m_s": -speed * np.sin(origin),
    }, components


def _electrical(
    time_s: FloatArray, values: Mapping[str, FloatArray], headers: Mapping[str, str]
) -> tuple[dict[str, Series], dict[str, str]]:
    columns = [values[name] for name in ("voltage_v", "current_a") if name in values]
    if not columns:
        return {}, {}
    measured = _measured_rows(time_s, columns)
    return electrical_series(
        time_s[measured],
        values["voltage_v"][measured] if "voltage_v" in values else None,
        values["current_a"][measured] if "current_a" in values else None,
        message="",
        fields=(headers.get("voltage_v", ""), headers.get("current_a", "")),
    )


def _measured_rows(time_s: FloatArray, columns: list[FloatArray]) -> IntArray:
    """Return the rows that bring a measurement, where most rows repeat the last one.

    A sensor slower than the log shows a new value ever so often.  Where a value stays for longer
    than usual it was measured again and had not changed.
    """
    is_new = np.ones(time_s.shape, np.bool_)
    is_new[1:] = np.any([column[1:] != column[:-1] for column in columns], axis=0)
    rows = np.arange(len(time_s), dtype=np.int64)
    if np.mean(is_new) > _HELD_SHARE or np.sum(is_new) < _LEAST_CHANGES:
        return rows
    usual_s = float(np.median(np.diff(time_s[is_new])))
    if not 0.0 < usual_s < _LONGEST_HOLD_S:
        return rows
    since_s = time_s - np.maximum.accumulate(np.where(is_new, time_s, -np.inf))
    repeats = np.floor(since_s / usual_s + 1e-6)
    is_new[1:] |= repeats[1:] > repeats[:-1]
    return rows[is_new]


def _state(table: _Table, name: str, time_s: FloatArray, chosen: IntArray) -> Series | None:
    texts = table.texts(name)
    if texts is None:
        return None
    if name == "mission_item":
        values = np.array([_number(texts[row]) for row in chosen.tolist()])
    else:
        values = np.array([float(texts[row].lower() in _TRUE) for row in chosen.tolist()])
    series = Series.of(time_s, values, table.mapping.columns[name].column, is_event=True)
    return series if len(series) else None


def _modes(table: _Table, time_s: FloatArray, chosen: IntArray) -> tuple[tuple[float, str], ...]:
    texts = table.texts("mode")
    if texts is None:
        return ()
    modes: list[tuple[float, str]] = []
    for row, at_s in zip(chosen.tolist(), time_s.tolist(), strict=True):
        if texts[row] and (not modes or modes[-1][1] != texts[row]):
            modes.append((at_s, texts[row]))
    return tuple(modes)
