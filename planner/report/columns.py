"""Columns as CSV: the trace of a flight, or its segments; units are in the heads."""

from __future__ import annotations

import csv
import io
import math
from importlib import import_module
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.errors import libraries_of
from planner.report.json import SEGMENT_KEYS
from planner.report.text import printable, table_lines
from planner.setup import UNNAMED

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping
    from types import ModuleType

    from planner.service.preflight import CheckResult


def columns_csv(columns: Mapping[str, Iterable[object]]) -> str:
    """Return columns of equal length, by heads that name the unit, as CSV; what is absent is empty."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([cell(value) for value in row] for row in zip(*columns.values(), strict=True))
    return text.getvalue()


def columns_parquet(columns: Mapping[str, Iterable[object]]) -> bytes:
    """Return columns of equal length as a Parquet file; what is absent is null.

    Raises ``UsageError`` if the library of ``mavjoule[parquet]`` is missing.
    """
    arrow, parquet = load_parquet()
    table = arrow.table(
        {  # of an array with its own type, also where all of it is absent
            name: arrow.array(
                column if isinstance(column, np.ndarray) else [*column], from_pandas=True
            )
            for name, column in columns.items()
        }
    )
    data = io.BytesIO()
    parquet.write_table(table, data)
    return data.getvalue()


def load_parquet() -> tuple[ModuleType, ModuleType]:
    """Return pyarrow and its Parquet files; without them raise ``UsageError``."""
    with libraries_of("parquet"):
        return import_module("pyarrow"), import_module("pyarrow.parquet")


def cell(value: object) -> object:
    """Return a value as CSV writes it: what is absent is empty."""
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    # repr of a plain float is the shortest text that reads back as the same number
    return float(value) if isinstance(value, float) else value


DIGITS = {
    "start_s": 1,
    "duration_s": 1,
    "distance_m": 1,
    "climb_m": 1,
    "speed_m_s": 1,
    "energy_wh": 3,
    "stopping_distance_m": 1,
    "farthest_stop_m": 1,
    "stopping_distance_m_p90": 1,
    "arrival_s": 1,
    "energy_used_wh": 3,
    "left_s": 1,
}
"""Decimals of the columns of tables of segments and items, whose heads name the unit."""
_HEADS = (
    ("", "item", "state", "start", "time", "distance", "climb", "speed", "energy", "stop"),
    ("", "", "", "s", "s", "m", "m", "m/s", "Wh", "m"),
)


def cell_text(key: str, value: Any, absent: str = "") -> str:  # noqa: ANN401 - number, text, nothing
    """Return a value in the column of a key."""
    if value is None:
        return absent
    return quantity.decimals(value, DIGITS[key]) if key in DIGITS else printable(str(value))


def segments_text(result: CheckResult) -> str:
    """Return the segments as an aligned table; ``stop`` is to stand still."""
    rows = [
        [cell_text(key, getattr(one, key)) for key in SEGMENT_KEYS[:-2]] for one in result.segments
    ]
    lines = table_lines([*_HEADS, *rows], alignment=">><>>>>>>>")
    if not result.setup.is_vehicle_named:
        lines = [f"{UNNAMED[0].upper()}{UNNAMED[1:]}.", "", *lines]
    return "\n".join(lines) + "\n"


def segments_csv(result: CheckResult) -> str:
    """Return the segments as CSV, with the keys of the JSON report as heads."""
    return columns_csv(
        {key: [getattr(one, key) for one in result.segments] for key in SEGMENT_KEYS}
    )
