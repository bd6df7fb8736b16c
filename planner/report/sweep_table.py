"""The table of a sweep as Parquet or CSV: a row for each case, units in the heads.

``pandas.read_parquet("sweep.parquet")`` and ``polars.read_csv("sweep.csv")`` read it back.
"""

from __future__ import annotations

import csv
import io
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.files import replacing
from planner.report.columns import cell, load_parquet

if TYPE_CHECKING:
    from typing import BinaryIO

    from planner.service.sweep.sweep import Sweep

SUFFIXES = (".parquet", ".csv")
_ROWS_AT_ONCE = 16_384
"""Rows of a group of the Parquet file, and so many are in memory: the same however it was worked out."""


def refuse_table(path: Path) -> None:
    """Raise ``UsageError`` where no table can be written to a file of this name."""
    if path.suffix not in SUFFIXES:
        msg = f"{path}: a sweep is written to a {' or '.join(SUFFIXES)} file"
        raise UsageError(msg)
    if path.suffix == ".parquet":
        load_parquet()


def write_sweep(sweep: Sweep, path: Path | str) -> None:
    """Write the table of a sweep to a .parquet or .csv file.

    Raises
    ------
    UsageError
        If the file is called otherwise, or the library of ``mavjoule[parquet]`` is missing.
    OutputError
        If it cannot be written.
    """
    path = Path(path)
    refuse_table(path)
    with replacing(path) as file:
        if path.suffix == ".parquet":
            _write_parquet(sweep, file)
        else:
            _write_csv(sweep, file)


def _write_parquet(sweep: Sweep, file: BinaryIO) -> None:
    arrow, parquet = load_parquet()
    columns = sweep.table.columns
    schema = arrow.schema(
        [
            (name, arrow.float64() if is_number else arrow.string())
            for name, is_number in zip(columns.names, columns.is_number, strict=True)
        ]
    )
    rows = sweep.rows()
    with parquet.ParquetWriter(file, schema) as writer:
        while some := list(islice(rows, _ROWS_AT_ONCE)):
            values = dict(zip(columns.names, zip(*some, strict=True), strict=True))
            writer.write_table(
                arrow.table({name: list(own) for name, own in values.items()}, schema=schema)
            )


def _write_csv(sweep: Sweep, file: BinaryIO) -> None:
    text = io.TextIOWrapper(file, encoding="utf-8", newline="", write_through=True)
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(sweep.table.columns.names)
    writer.writerows([cell(value) for value in row] for row in sweep.rows())
    text.flush()
    text.detach()
