"""Columns as CSV: the trace of a flight, or its segments; units are in the heads."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.report.json import SEGMENT_KEYS
from planner.report.text import table_lines

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.service.preflight import CheckResult


def columns_csv(columns: Mapping[str, Iterable[object]]) -> str:
    """Return named columns of equal length as CSV, an empty cell for what is absent.

    Parameters
    ----------
    columns : mapping of str to iterable
        The values of each column by its head, which names the unit.

    Raises
    ------
    ValueError
        If the columns are not equally long.
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(columns)
    writer.writerows([_cell(value) for value in row] for row in zip(*columns.values(), strict=True))
    return text.getvalue()


def _cell(value: object) -> object:
    if value is None or (isinstance(value, float) and not math.isfinite(value)):
        return ""
    # repr of a plain float is the shortest text that reads back as the same number
    return float(value) if isinstance(value, float) else value


_HEADS = (
    ("", "item", "state", "start", "time", "distance", "height", "speed", "energy", "stop"),
    ("", "", "", "s", "s", "m", "m", "m/s", "Wh", "m"),
)


def segments_text(result: CheckResult) -> str:
    """Return the segments as an aligned table; heights are changes, ``stop`` is to stand still."""
    rows = [
        (
            str(segment.index),
            str(segment.item),
            str(segment.state),
            quantity.decimals(segment.start_s, 1),
            quantity.decimals(segment.duration_s, 1),
            quantity.decimals(segment.distance_m, 1),
            quantity.decimals(segment.climb_m, 1),
            quantity.decimals(segment.speed_m_s, 1),
            quantity.decimals(segment.energy_wh, 3),
            ""
            if segment.stopping_distance_m is None
            else quantity.decimals(segment.stopping_distance_m, 1),
        )
        for segment in result.segments
    ]
    return "\n".join(table_lines([*_HEADS, *rows], alignment=">><>>>>>>>")) + "\n"


def segments_csv(result: CheckResult) -> str:
    """Return the segments as CSV, with the keys of the JSON report as heads."""
    return columns_csv(
        {key: [getattr(segment, key) for segment in result.segments] for key in SEGMENT_KEYS}
    )
