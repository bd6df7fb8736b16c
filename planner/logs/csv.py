"""Reader of flight logs in CSV to a recording, by a mapping of the columns."""

from __future__ import annotations

import csv
import gzip
import math
import re
import zlib
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any, TextIO, cast

import numpy as np

from planner import quantity
from planner.errors import LogFileError, described, nearest_hint
from planner.files import read_bounded, toml_document
from planner.logs.messages import LONGEST_LINE, MessageColumns, electrical_series, modes_entered
from planner.logs.record import ABSENCE_COSTS, LOG_DAMAGED, Recording
from planner.logs.series import Clock, Series, euler_angles_deg, wind_north_east_m_s
from planner.units import LENGTH_UNITS_M, SPEED_UNITS_M_S
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from mmap import mmap

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.logs.record import LogFile


SCHEMA = 1

_SPEEDS = SPEED_UNITS_M_S | {"cm/s": 1e-2, "ft/s": LENGTH_UNITS_M["ft"]}
_ANGLE_UNITS = {"deg": 1.0, "rad": 57.29577951308232, "1e-7deg": 1e-7}
_UNITS: Mapping[str, Mapping[str, float]] = {
    "_deg": _ANGLE_UNITS,
    "_m_s": _SPEEDS,
    "_m": LENGTH_UNITS_M,
    "_s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "_v": {"V": 1.0, "mV": 1e-3},
    "_a": {"A": 1.0, "mA": 1e-3, "cA": 1e-2},
    "_w": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
}
"""Units by the end of a quantity's name; the first of each is the one in the name."""

STATES = ("is_armed", "is_landed", "mission_item", "mode")
"""Quantities without a unit."""
NUMBERS = (
    *("time_s", *(name for name in ABSENCE_COSTS if name not in STATES)),
    *("local_north_m", "local_east_m", "local_height_m"),
    *("velocity_forward_m_s", "velocity_right_m_s", "course_deg"),
    *("wind_speed_m_s", "wind_from_deg"),
    *("reference_latitude_deg", "reference_longitude_deg", "reference_altitude_amsl_m"),
)
"""Quantities with a unit, the one at the end of the name."""


_TOGETHER = (
    ("velocity_north_m_s", "velocity_east_m_s"),
    ("velocity_forward_m_s", "velocity_right_m_s", "yaw_deg"),
    ("wind_north_m_s", "wind_east_m_s"),
    ("wind_speed_m_s", "wind_from_deg"),
    ("latitude_deg", "longitude_deg"),
    ("local_north_m", "local_east_m"),
)
"""Quantities that mean nothing without each other; either of the first two asks for them all."""


class Axes(StrEnum):
    """From which axes of the body to which of the Earth a quaternion turns."""

    FRD_NED = "frd-ned"
    """Forward, right, down to north, east, down."""
    FLU_ENU = "flu-enu"
    """Forward, left, up to east, north, up."""


class ColumnSource(Value):
    """The column of a quantity."""

    column: str
    """Its header, without blanks around it."""
    factor: float = 1.0
    """The column times this is in the unit of the quantity."""


class Orientation(Value):
    """Four columns that hold a quaternion, scalar first."""

    columns: tuple[str, str, str, str]
    axes: Axes


class CsvMapping(Value):
    """Which column of a CSV file is which quantity."""

    name: str
    vehicle: str
    """What flew, where the mapping knows."""
    columns: Mapping[str, ColumnSource]
    """By the names of quantities; ``time_s`` is always there."""
    orientation: Orientation | None = None

    @property
    def headers(self) -> frozenset[str]:
        """The columns a file must have to be read by this mapping."""
        turned = () if self.orientation is None else self.orientation.columns
        return frozenset((*(source.column for source in self.columns.values()), *turned))


def units_of(name: str) -> Mapping[str, float]:
    """Return the units a quantity may be given in, each with its factor to the quantity's own."""
    if name in STATES:
        return {}
    return next(units for end, units in _UNITS.items() if name.endswith(end))


def read_csv_mapping(path: str | Path) -> CsvMapping:
    """Read a mapping from TOML.

    Raises
    ------
    LogFileError
        If it cannot be read, or holds something unknown.
    """
    source = str(path)
    data = read_bounded(path, most_bytes=_MOST_BYTES, error=LogFileError, what="mapping")
    document = toml_document(data, source=source, error=LogFileError, what="mapping")
    _refuse_unknown(document, ("schema", "name", "vehicle", "columns", "orientation"), "", source)
    if document.get("schema") != SCHEMA:
        msg = f"must be {SCHEMA}: this program knows no other"
        raise LogFileError(msg, source=source, key="schema")
    entries = document.get("columns")
    if not isinstance(entries, dict) or "time_s" not in entries:
        msg = "must be a table with time_s in it"
        raise LogFileError(msg, source=source, key="columns")
    _refuse_unknown(entries, (*NUMBERS, *STATES), "columns.", source)
    directions = {"yaw_deg"} if "orientation" in document else set()
    for group in _TOGETHER:
        lacking = set(group) - entries.keys() - directions
        if lacking and not set(group[:2]).isdisjoint(entries):
            msg = f"also needs {' and '.join(sorted(lacking))}"
            first = next(name for name in group if name in entries)
            raise LogFileError(msg, source=source, key=f"columns.{first}")
    return CsvMapping(
        name=str(document.get("name", Path(path).stem)),
        vehicle=str(document.get("vehicle", "")),
        columns={name: _source(name, entry, source) for name, entry in entries.items()},
        orientation=_orientation(document.get("orientation"), source),
    )


def _source(name: str, entry: Any, source: str) -> ColumnSource:  # noqa: ANN401 - as TOML has it
    key = f"columns.{name}"
    if not isinstance(entry, dict) or not isinstance(entry.get("column"), str):
        msg = 'must be a table with the header: { column = "…" }'
        raise LogFileError(msg, source=source, key=key)
    _refuse_unknown(entry, ("column", "unit", "is_negated"), f"{key}.", source)
    unit, units = entry.get("unit"), units_of(name)
    if unit is not None and not (isinstance(unit, str) and unit in units):
        msg = f"must be one of {', '.join(units) or 'none: leave it out'}, got {described(unit)}"
        raise LogFileError(msg, source=source, key=f"{key}.unit")
    sign = -1 if entry.get("is_negated", False) is True else 1
    return ColumnSource(column=entry["column"].strip(), factor=sign * units.get(unit or "", 1.0))


def _orientation(entry: Any, source: str) -> Orientation | None:  # noqa: ANN401 - as TOML has it
    if entry is None:
        return None
    columns = entry.get("columns") if isinstance(entry, dict) else None
    if (
        not isinstance(columns, list)
        or [type(column) for column in columns] != [str] * 4
        or entry.get("axes") not in list(Axes)
    ):
        msg = f"must have columns, four headers w x y z, and axes, one of {', '.join(Axes)}"
        raise LogFileError(msg, source=source, key="orientation")
    w, x, y, z = (column.strip() for column in columns)
    return Orientation(columns=(w, x, y, z), axes=Axes(entry["axes"]))


def _refuse_unknown(
    entries: Mapping[str, object], known: tuple[str, ...], where: str, source: str
) -> None:
    for key in entries:
        if key not in known:
            msg = f"is not known here{nearest_hint(key, known)}"
            raise LogFileError(msg, source=source, key=f"{where}{key}")


def _columns(*rows: tuple[str, str, str | None, int]) -> Mapping[str, ColumnSource]:
    """Return columns by quantity, header, unit, and −1 for one that counts the other way."""
    return {
        name: ColumnSource(column=column, factor=sign * units_of(name).get(unit or "", 1.0))
        for name, column, unit, sign in rows
    }


AIRDATA = CsvMapping(
    name="airdata",
    vehicle="",
    columns=_columns(
        ("time_s", "time(millisecond)", "ms", 1),
        ("latitude_deg", "latitude", "deg", 1),
        ("longitude_deg", "longitude", "deg", 1),
        ("height_above_home_m", "height_above_takeoff(feet)", "ft", 1),
        ("altitude_amsl_m", "altitude_above_seaLevel(feet)", "ft", 1),
        ("velocity_north_m_s", "xSpeed(mph)", "mph", 1),
        ("velocity_east_m_s", "ySpeed(mph)", "mph", 1),
        ("climb_m_s", "zSpeed(mph)", "mph", -1),
        ("ground_speed_m_s", "speed(mph)", "mph", 1),
        ("yaw_deg", "compass_heading(degrees)", "deg", 1),
        ("pitch_deg", "pitch(degrees)", "deg", 1),
        ("roll_deg", "roll(degrees)", "deg", 1),
        ("voltage_v", "voltage(v)", "V", 1),
        ("current_a", "current(A)", "A", 1),
        ("mode", "flycState", None, 1),
    ),
)
"""DJI flights as AirData exports them in feet and miles: velocities north, east, down."""

MATRICE_100 = CsvMapping(
    name="matrice-100",
    vehicle="DJI Matrice 100",
    columns=_columns(
        ("time_s", "time", "s", 1),
        ("longitude_deg", "position_x", "deg", 1),
        ("latitude_deg", "position_y", "deg", 1),
        ("altitude_amsl_m", "position_z", "m", 1),
        ("velocity_forward_m_s", "velocity_x", "m/s", 1),
        ("velocity_right_m_s", "velocity_y", "m/s", -1),
        ("airspeed_m_s", "wind_speed", "m/s", 1),
        ("voltage_v", "battery_voltage", "V", 1),
        ("current_a", "battery_current", "A", 1),
    ),
    orientation=Orientation(
        columns=("orientation_w", "orientation_x", "orientation_y", "orientation_z"),
        axes=Axes.FLU_ENU,
    ),
)
"""The flights of Rodrigues et al. 2021 (Sci. Data 8:155): an anemometer rides on the vehicle.

That the velocities are along the body's axes, forward and left, and the quaternion turns to east,
north, up, was found by comparing both with the track.
"""

KNOWN_MAPPINGS = (AIRDATA, MATRICE_100)


GZIP_MAGIC = b"\x1f\x8b"
_MOST_CHARACTERS = 1 << 28
"""A day at ten rows of 250 characters a second is less."""
_MOST_BYTES = 1 << 20
"""Of a mapping."""
_HEADER_CHARACTERS = 1 << 16
_SEPARATORS = (",", ";", "\t")
_PERIODIC = ("yaw_deg", "roll_deg", "course_deg", "longitude_deg", "reference_longitude_deg")
_ANGLES = ("roll_deg", "pitch_deg", "yaw_deg")
_TRUE = frozenset(("1", "1.0", "true", "yes", "on"))
_HELD_FRACTION = 0.5
"""Where fewer rows bring a new value, the old one is repeated until the next is measured. [-]"""
_LONGEST_HOLD_S = 5.0
"""No battery is measured more seldom than this. [s]"""
_LEAST_CHANGES = 10
"""Fewer changes show no rate."""


def csv_recordings(file: LogFile, mapping: CsvMapping | None) -> tuple[Recording, ...]:
    """Return what a CSV file holds, a recording for each run of its clock.

    A mapping left out is recognised by the headers where it is one of the known.
    """
    table = _read(file.source, mapping)
    numbers = table.known_numbers()
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
NO_KNOWN_LOG = "is not a known kind of log (DataFlash, ULog, telemetry or CSV)"


def looks_like_csv(data: mmap) -> bool:
    """Return whether the first line of a file is text with separators in it."""
    head = data[:_HEADER_CHARACTERS]
    if head[:2] == GZIP_MAGIC:
        return True
    line = head.split(b"\n", 1)[0]
    return not _CONTROLS.search(line) and any(mark.encode() in line for mark in _SEPARATORS)


class _Table(MessageColumns):
    """The wanted columns of the rows so far."""

    def __init__(self, mapping: CsvMapping, headers: tuple[str, ...], source: str) -> None:
        missing = sorted(mapping.headers - set(headers))
        if missing:
            more = f" and {len(missing) - 1} more" if len(missing) > 1 else ""
            msg = f"has no column {missing[0]!r}{more}, which the mapping {mapping.name} names"
            raise LogFileError(msg, source=source)
        turned = () if mapping.orientation is None else mapping.orientation.columns
        columns = {**{name: ColumnSource(column=name) for name in turned}, **mapping.columns}
        super().__init__(
            (name for name in columns if name not in STATES),
            (name for name in columns if name in STATES),
        )
        self.mapping, self.source = mapping, source
        self.count = 0
        self.breaks_off = ""
        self._short = 0
        self._width = len(headers)
        self._index = {name: headers.index(entry.column) for name, entry in columns.items()}

    def add(self, row: list[str]) -> None:
        """Add a row; cells that are no numbers are not known."""
        if not row:
            return
        if len(row) < self._width:
            self._short += 1
            return
        for name, values in self.numbers.items():
            values.append(_number(row[self._index[name]]))
        for name, texts in self.texts.items():
            texts.append(row[self._index[name]].strip())
        self.count += 1

    def known_numbers(self) -> dict[str, FloatArray]:
        """Return the columns of numbers by the names of quantities, quaternions by header."""
        columns = self.mapping.columns
        return {
            name: np.array(values) * (columns[name].factor if name in columns else 1.0)
            for name, values in self.numbers.items()
        }

    def findings(self) -> Iterator[Finding]:
        """Return what is wrong with the rows."""
        if self._short:
            yield LOG_DAMAGED.finding(
                f"{self.source}: fewer columns than the header: {self._short} of "
                f"{quantity.count(self.count + self._short, 'row')} left out"
            )
        if self.breaks_off:
            yield LOG_DAMAGED.finding(
                f"{self.source}: breaks off after {quantity.count(self.count, 'row')}: {self.breaks_off}"
            )


def _read(source: str, mapping: CsvMapping | None) -> _Table:
    path = Path(source)
    with path.open("rb") as file:
        is_zipped = file.read(len(GZIP_MAGIC)) == GZIP_MAGIC
    opened = gzip.open if is_zipped else open
    table: _Table | None = None
    try:
        with cast(
            "TextIO", opened(path, "rt", encoding="utf-8-sig", errors="replace", newline="")
        ) as text:
            header = text.readline(_HEADER_CHARACTERS)
            mark = separator_of(header)
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


def _limited(text: TextIO, source: str) -> Iterator[str]:
    characters = 0
    while line := text.readline(LONGEST_LINE):
        characters += len(line)
        if len(line) == LONGEST_LINE:
            msg = f"a line has more than {LONGEST_LINE} characters"
            raise csv.Error(msg)
        if characters > _MOST_CHARACTERS:
            msg = f"is larger than {_MOST_CHARACTERS >> 20} MiB of text: this is no flight log"
            raise LogFileError(msg, source=source)
        yield line


def separator_of(header: str) -> str:
    """Return what separates the columns of a CSV file with that first line: the most frequent of , ; tab."""
    return max(_SEPARATORS, key=header.count)


def _known_mapping(headers: tuple[str, ...], source: str) -> CsvMapping:
    for mapping in KNOWN_MAPPINGS:
        if mapping.headers <= set(headers):
            return mapping
    known = ", ".join(mapping.name for mapping in KNOWN_MAPPINGS)
    msg = (
        f"has columns of no known kind ({known}): "
        "name them with --mapping FILE.toml (mavjoule help vehicle)"
    )
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
    _turn_north(values, headers)
    electrical, remarks = _electrical(time_s, values, headers)
    series = {
        name: Series.of(time_s, column, headers[name], period=360.0 if name in _PERIODIC else None)
        for name, column in values.items()
        if name not in {"voltage_v", "current_a"}
    }
    texts = {name: [column[row] for row in chosen.tolist()] for name, column in table.texts.items()}
    states = {
        name: Series.of(time_s, _state_values(name, cells), headers[name], is_event=True) or None
        for name, cells in texts.items()
        if name != "mode"
    }
    return Recording(
        file=file,
        begin_s=float(time_s.min()),
        end_s=float(time_s.max()),
        series={name: found for name, found in (series | electrical).items() if len(found)},
        is_armed=states.get("is_armed"),
        is_landed=states.get("is_landed"),
        mission_item=states.get("mission_item"),
        modes=modes_entered(time_s, texts.get("mode", ())),
        modes_found_in=headers.get("mode", ""),
        vehicle=mapping.vehicle,
        remarks=remarks,
        findings=findings,
    )


def _state_values(name: str, cells: list[str]) -> list[float]:
    if name == "mission_item":
        return [_number(cell) for cell in cells]
    return [float(cell.lower() in _TRUE) for cell in cells]


def _angles(orientation: Orientation, values: dict[str, FloatArray]) -> dict[str, FloatArray]:
    """Return roll, pitch and yaw, and take the quaternion away."""
    w, x, y, z = (values.pop(column) for column in orientation.columns)
    roll_deg, pitch_deg, yaw_deg = euler_angles_deg(w, x, y, z)
    if orientation.axes is Axes.FLU_ENU:
        # Left and up turn the other way than right and down; yaw is from east to north.
        pitch_deg, yaw_deg = -pitch_deg, 90.0 - yaw_deg
    return dict(zip(_ANGLES, (roll_deg, pitch_deg, yaw_deg), strict=True))


def _turn_north(values: dict[str, FloatArray], headers: dict[str, str]) -> None:
    """Replace velocity along the body, and wind by speed and origin, by those north and east."""
    along = ("velocity_forward_m_s", "velocity_right_m_s")
    if {*along, "yaw_deg"} <= values.keys():
        forward, right = (values.pop(name) for name in along)
        yaw = np.radians(values["yaw_deg"])
        values["velocity_north_m_s"] = forward * np.cos(yaw) - right * np.sin(yaw)
        values["velocity_east_m_s"] = forward * np.sin(yaw) + right * np.cos(yaw)
        found_in = ", ".join(headers[name] for name in along)
        headers |= dict.fromkeys(("velocity_north_m_s", "velocity_east_m_s"), found_in)
    by_origin = ("wind_speed_m_s", "wind_from_deg")
    if set(by_origin) <= values.keys():
        north, east = wind_north_east_m_s(*(values.pop(name) for name in by_origin))
        values |= {"wind_north_m_s": north, "wind_east_m_s": east}
        found_in = ", ".join(headers[name] for name in by_origin)
        headers |= dict.fromkeys(("wind_north_m_s", "wind_east_m_s"), found_in)


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
    if np.mean(is_new) > _HELD_FRACTION or np.sum(is_new) < _LEAST_CHANGES:
        return rows
    usual_s = float(np.median(np.diff(time_s[is_new])))
    if not 0.0 < usual_s < _LONGEST_HOLD_S:
        return rows
    since_s = time_s - np.maximum.accumulate(np.where(is_new, time_s, -np.inf))
    repeats = np.floor(since_s / usual_s + 1e-6)
    is_new[1:] |= repeats[1:] > repeats[:-1]
    return rows[is_new]
