"""The decomposition as rows."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from planner.report.columns import segments_csv, segments_text

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult


def test_csv_reads_back_as_the_same_numbers(flown: CheckResult) -> None:
    rows = list(csv.DictReader(io.StringIO(segments_csv(flown))))
    assert [row["state"] for row in rows] == ["takeoff", "cruise", "land"]
    assert [float(row["duration_s"]) for row in rows] == [30.4, 600.0, 62.0]
    assert [row["stopping_distance_m"] for row in rows] == ["", "26.4", ""]


def test_text_has_a_row_per_segment_under_heads_with_units(flown: CheckResult) -> None:
    heads, units, *rows = segments_text(flown).splitlines()
    assert heads.split()[:3] == ["item", "state", "start"]
    assert units.split() == ["s", "s", "m", "m", "m/s", "Wh", "m"]
    cells = " ".join(rows[1].split())
    assert cells == "1 2 cruise 30.4 600.0 4321.0 0.0 10.0 20.000 26.4"
    assert len(rows) == 3


def test_text_fits_eighty_columns(flown: CheckResult) -> None:
    assert max(map(len, segments_text(flown).splitlines())) <= 80
