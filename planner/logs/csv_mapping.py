"""Which column of a CSV file is which quantity: mappings, shipped and in TOML.

A mapping in TOML::

    schema = 1
    name = "my-logger"
    vehicle = "my hexacopter"       # optional

    [columns]
    time_s = { column = "t", unit = "ms" }
    height_above_home_m = { column = "alt", unit = "ft" }
    climb_m_s = { column = "vd", unit = "m/s", is_negated = true }
    current_a = { column = "I" }    # without a unit: the one in the name of the quantity

    [orientation]                   # optional: a quaternion instead of angles
    columns = ["qw", "qx", "qy", "qz"]
    axes = "frd-ned"                # or "flu-enu"
"""

from __future__ import annotations

import difflib
import tomllib
from enum import StrEnum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.errors import LogFileError
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping

SCHEMA = 1

_LENGTHS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "ft": 0.3048, "km": 1e3}
_SPEEDS = {"m/s": 1.0, "cm/s": 1e-2, "km/h": 1 / 3.6, "mph": 0.44704, "kn": 1852 / 3600}
_SPEEDS |= {"ft/s": 0.3048}
_ANGLES = {"deg": 1.0, "rad": 57.29577951308232, "1e-7deg": 1e-7}
_UNITS: Mapping[str, Mapping[str, float]] = {
    "_deg": _ANGLES,
    "_m_s": _SPEEDS,
    "_m": _LENGTHS,
    "_s": {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "min": 60.0},
    "_v": {"V": 1.0, "mV": 1e-3},
    "_a": {"A": 1.0, "mA": 1e-3, "cA": 1e-2},
    "_w": {"W": 1.0, "mW": 1e-3, "kW": 1e3},
}
"""Units by the end of a quantity's name; the first of each is the one the name says."""

STATES = ("is_armed", "is_landed", "mission_item", "mode")
"""Quantities without a unit."""
NUMBERS = (
    "time_s",
    "latitude_deg",
    "longitude_deg",
    "altitude_amsl_m",
    "height_above_home_m",
    "local_north_m",
    "local_east_m",
    "local_height_m",
    "velocity_north_m_s",
    "velocity_east_m_s",
    "velocity_forward_m_s",
    "velocity_right_m_s",
    "climb_m_s",
    "ground_speed_m_s",
    "course_deg",
    "airspeed_m_s",
    "wind_north_m_s",
    "wind_east_m_s",
    "wind_speed_m_s",
    "wind_from_deg",
    "roll_deg",
    "pitch_deg",
    "yaw_deg",
    "reference_north_m",
    "reference_east_m",
    "reference_height_m",
    "reference_latitude_deg",
    "reference_longitude_deg",
    "reference_altitude_amsl_m",
    "reference_velocity_north_m_s",
    "reference_velocity_east_m_s",
    "reference_climb_m_s",
    "reference_speed_m_s",
    "voltage_v",
    "current_a",
    "power_w",
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


@frozen
class ColumnSource:
    """The column a quantity stands in."""

    column: str
    """Its header, without blanks around it."""
    factor: float = 1.0
    """The column times this is in the unit of the quantity."""


@frozen
class Orientation:
    """Four columns that hold a quaternion, scalar first."""

    columns: tuple[str, str, str, str]
    axes: Axes


@frozen
class CsvMapping:
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


def column_source(name: str, column: str, unit: str | None = None, sign: int = 1) -> ColumnSource:
    """Return where a quantity stands.

    Parameters
    ----------
    name : str
        The quantity; the end of its name says its unit.
    column : str
        Header of the column.
    unit : str, optional
        Unit of the column; the quantity's own by default.
    sign : int, optional
        −1 for a column that counts the other way.

    Returns
    -------
    ColumnSource
        Column and factor.

    Raises
    ------
    KeyError
        If a quantity of this name cannot have that unit.
    """
    factor = 1.0 if unit is None else units_of(name)[unit]
    return ColumnSource(column=column.strip(), factor=sign * factor)


def units_of(name: str) -> Mapping[str, float]:
    """Return the units a quantity may be given in, each with its factor to the quantity's own."""
    if name in STATES:
        return {}
    return next(units for end, units in _UNITS.items() if name.endswith(end))


def read_csv_mapping(path: str | Path) -> CsvMapping:
    """Read a mapping from TOML.

    Parameters
    ----------
    path : str or Path
        The file.

    Returns
    -------
    CsvMapping
        What it says.

    Raises
    ------
    LogFileError
        If it cannot be read, or says something unknown.
    """
    source = str(path)
    try:
        document = tomllib.loads(Path(path).read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        msg = f"the mapping cannot be read: {getattr(error, 'strerror', None) or error}"
        raise LogFileError(msg, source=source) from error
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
            raise LogFileError(msg, source=source, key=f"columns.{_first_of(group, entries)}")
    return CsvMapping(
        name=str(document.get("name", Path(path).stem)),
        vehicle=str(document.get("vehicle", "")),
        columns={name: _source(name, entry, source) for name, entry in entries.items()},
        orientation=_orientation(document.get("orientation"), source),
    )


def _first_of(names: tuple[str, ...], entries: Mapping[str, object]) -> str:
    return next(name for name in names if name in entries)


def _source(name: str, entry: Any, source: str) -> ColumnSource:  # noqa: ANN401 - as TOML has it
    key = f"columns.{name}"
    if not isinstance(entry, dict) or not isinstance(entry.get("column"), str):
        msg = 'must be a table with the header: { column = "…" }'
        raise LogFileError(msg, source=source, key=key)
    _refuse_unknown(entry, ("column", "unit", "is_negated"), f"{key}.", source)
    unit = entry.get("unit")
    if unit is not None and unit not in units_of(name):
        known = ", ".join(units_of(name)) or "none: leave it out"
        msg = f"must be one of {known}, got {unit!r}"
        raise LogFileError(msg, source=source, key=f"{key}.unit")
    sign = -1 if entry.get("is_negated", False) is True else 1
    return column_source(name, entry["column"], unit, sign)


def _orientation(entry: Any, source: str) -> Orientation | None:  # noqa: ANN401 - as TOML has it
    if entry is None:
        return None
    key = "orientation"
    columns = entry.get("columns") if isinstance(entry, dict) else None
    if (
        not isinstance(columns, list)
        or len(columns) != 4
        or not all(isinstance(column, str) for column in columns)
        or entry.get("axes") not in list(Axes)
    ):
        msg = f"must have columns, four headers w x y z, and axes, one of {', '.join(Axes)}"
        raise LogFileError(msg, source=source, key=key)
    w, x, y, z = (column.strip() for column in columns)
    return Orientation(columns=(w, x, y, z), axes=Axes(entry["axes"]))


def _refuse_unknown(
    entries: Mapping[str, object], known: tuple[str, ...], where: str, source: str
) -> None:
    for key in entries:
        if key not in known:
            near = difflib.get_close_matches(key, known, n=1)
            hint = f"; is {near[0]} meant?" if near else ""
            msg = f"is not known here{hint}"
            raise LogFileError(msg, source=source, key=f"{where}{key}")
