"""Measured weather: rows of a CSV file, with the units in the heads.

The columns are known by words of their heads: time or date, wind speed, wind direction, gust,
temperature, pressure at sea level; each but the time names its unit, ``wind_speed_10m (km/h)`` or
``wind_m_s``.
"""

from __future__ import annotations

import csv
import io
import math
import re
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import InputError, shortened
from planner.files import decoded, read_bounded
from planner.findings import Place
from planner.logs.csv import units_of
from planner.service.sweep.axes import GUST_M_S, WIND_FROM_DEG, WIND_M_S
from planner.setting import declared
from planner.setup import Setup
from planner.units import FREEZING_F, KELVINS_PER_FAHRENHEIT, PRESSURE_UNITS_HPA, ZERO_CELSIUS_K
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence
    from pathlib import Path

    from planner.setting import Setting

_MOST_BYTES = 1 << 28
_WHAT = "weather file"
TEMPERATURE_C, PRESSURE_HPA = (
    next(one for one in declared(Setup) if one.key == key)
    for key in ("temperature_c", "pressure_hpa")
)


class WeatherFileError(InputError):
    """A file of measured weather that cannot be used."""


class MeasuredWeather(Value):
    """Measured weather, a row for each time."""

    source: str
    times: tuple[str, ...]
    """As the file writes them."""
    keys: tuple[str, ...]
    """What was measured, by the keys of columns, in the order of the values of a row."""
    rows: tuple[tuple[float | None, ...], ...]
    """A row holds ``None`` where nothing was measured."""
    unused: tuple[str, ...] = ()
    """Heads of columns that nothing is made of."""


def _scaled(factor: float, offset: float = 0.0) -> Callable[[float], float]:
    return lambda value: factor * value + offset


def _speeds() -> Mapping[str, Callable[[float], float]]:
    units = {unit: _scaled(factor) for unit, factor in units_of("wind_speed_m_s").items()}
    return units | {
        "kt": units["kn"],
        "kmh": units["km/h"],
        "m_s": units["m/s"],
        "ms": units["m/s"],
    }


_DEGREES = dict.fromkeys(("deg", "°", "degrees"), _scaled(1.0))
_DEGREES_TO = dict.fromkeys(
    _DEGREES, lambda to_deg: (to_deg + 180.0) % 360.0 if 0.0 <= to_deg <= 360.0 else to_deg
)
"""Of a direction that the wind blows to."""
_TEMPERATURES = {
    "c": _scaled(1.0),
    "k": _scaled(1.0, -ZERO_CELSIUS_K),
    "f": _scaled(KELVINS_PER_FAHRENHEIT, -KELVINS_PER_FAHRENHEIT * FREEZING_F),
}
_COLUMNS: Sequence[tuple[str, Setting, Callable[[], Mapping[str, Callable[[float], float]]]]] = (
    (
        r"qnh|\bslp\b|press.*(msl|sea)|(msl|sea).*press",
        PRESSURE_HPA,
        lambda: {unit: _scaled(factor) for unit, factor in PRESSURE_UNITS_HPA.items()},
    ),
    (r"gust", GUST_M_S, _speeds),
    (r"\bto\b|_to_|toward|going", WIND_FROM_DEG, lambda: _DEGREES_TO),
    (r"dir|from", WIND_FROM_DEG, lambda: _DEGREES),
    (r"wind", WIND_M_S, _speeds),
    (r"temp", TEMPERATURE_C, lambda: _TEMPERATURES),
)
"""Words of a head, what it is then, and the units it may have; the first that is met counts.

A pressure that does not say that it is reduced to sea level is that of a station at an unknown altitude."""


def read_weather(path: Path) -> MeasuredWeather:
    """Return the weather measured in a CSV file.

    Raises
    ------
    WeatherFileError
        If it cannot be read, holds no wind, or a head or a number cannot be understood.
    """
    source = str(path)
    data = read_bounded(path, most_bytes=_MOST_BYTES, error=WeatherFileError, what=_WHAT)
    text = decoded(data, source=source, error=WeatherFileError, what=_WHAT)
    reader = csv.reader(io.StringIO(text), delimiter=";" if ";" in text.partition("\n")[0] else ",")
    try:
        lines = [(reader.line_num, line) for line in reader if any(cell.strip() for cell in line)]
    except csv.Error as error:
        msg = f"is not CSV: {error}"
        raise WeatherFileError(
            msg, source=source, place=Place(line=reader.line_num, column=1)
        ) from error
    if len(lines) < 2:
        msg = "holds no weather: expected a line of heads and a line for each time"
        raise WeatherFileError(msg, source=source)
    heads = [head.strip() for head in lines[0][1]]
    known = {column: _column(head, source) for column, head in enumerate(heads)}
    time = next((i for i, head in enumerate(heads) if re.search("time|date", head.lower())), None)
    used = {column: one for column, one in known.items() if one is not None and column != time}
    keys = tuple(setting.key for setting, _ in used.values())
    if WIND_M_S.key not in keys:
        msg = "holds no wind: expected a column such as wind_speed (m/s)"
        raise WeatherFileError(msg, source=source, place=Place(line=1, column=1))
    if twice := next((key for i, key in enumerate(keys) if key in keys[:i]), None):
        msg = f"two columns give {twice}: leave one"
        raise WeatherFileError(msg, source=source, place=Place(line=1, column=1))

    def row(number: int, line: Sequence[str]) -> tuple[float | None, ...]:
        values = []
        if any(cell.strip() for cell in line[len(heads) :]):
            count = quantity.count(len(line), "field")
            msg = f"{count} under {len(heads)} heads: which belongs to which is unknown"
            raise WeatherFileError(msg, source=source, place=Place(line=number, column=1))
        for column, (setting, convert) in used.items():
            cell = line[column] if column < len(line) else ""
            try:
                values.append(_number(cell, setting, convert))
            except ValueError as error:
                msg, place = f"{heads[column]}: {error}", Place(line=number, column=1)
                raise WeatherFileError(msg, source=source, place=place) from error
        return tuple(values)

    return MeasuredWeather(
        source=source,
        times=tuple(_time(line, time, number) for number, (_, line) in enumerate(lines[1:], 1)),
        keys=keys,
        rows=tuple(row(number, line) for number, line in lines[1:]),
        unused=tuple(head for i, head in enumerate(heads) if i not in used and i != time),
    )


def _time(line: Sequence[str], column: int | None, number: int) -> str:
    return str(number) if column is None or column >= len(line) else line[column].strip()


def _column(head: str, source: str) -> tuple[Setting, Callable[[float], float]] | None:
    """Return what the column of a head gives and how it is made SI; ``None``: nothing that counts."""
    lower = head.lower()
    for words, setting, units in _COLUMNS:
        if not re.search(words, lower):
            continue
        by_name = units()
        if found := re.search(r"[\[(]\s*(.*?)\s*[\])]\s*$", lower):
            unit = found[1].removeprefix("°") or "°"
        else:
            unit = next((one for one in by_name if lower.endswith(f"_{one}")), "")
        if unit not in by_name:
            names = ", ".join(by_name)
            msg = f"column {shortened(head)!r}: name its unit in brackets: {names}"
            raise WeatherFileError(msg, source=source, place=Place(line=1, column=1))
        return setting, by_name[unit]
    return None


def _number(cell: str, setting: Setting, convert: Callable[[float], float]) -> float | None:
    """Return the value of a cell, ``None`` of an empty one; raise ``ValueError`` with what it must be."""
    if cell.strip().lower() in {"", "nan", "null", "na", "-"}:
        return None
    try:
        value = convert(float(cell))
    except ValueError:
        value = math.nan
    refused = "a number" if math.isnan(value) else setting.kind.refusal(value)
    if refused:
        msg = f"expected {refused}, got {shortened(cell)!r}"
        raise ValueError(msg)
    return value


def distinct(rows: Iterable[tuple[float | None, ...]]) -> dict[tuple[float | None, ...], list[int]]:
    """Return the different rows, each with the positions it has, in the order of their first."""
    found: dict[tuple[float | None, ...], list[int]] = {}
    for position, row in enumerate(rows):
        found.setdefault(row, []).append(position)
    return found
