"""Columns as CSV: the trace of a flight, or its segments; units are in the heads."""

from __future__ import annotations

import csv
import io
import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping


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
