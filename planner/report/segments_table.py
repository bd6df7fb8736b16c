"""The decomposition of a flight: a row per segment, as text or CSV."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers
from planner.report.columns_csv import columns_csv
from planner.report.json_report import SEGMENT_KEYS
from planner.report.table import table_lines

if TYPE_CHECKING:
    from planner.service import CheckResult

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
            numbers.decimals(segment.start_s, 1),
            numbers.decimals(segment.duration_s, 1),
            numbers.decimals(segment.distance_m, 1),
            numbers.decimals(segment.climb_m, 1),
            numbers.decimals(segment.speed_m_s, 1),
            numbers.decimals(segment.energy_wh, 3),
            ""
            if segment.stopping_distance_m is None
            else numbers.decimals(segment.stopping_distance_m, 1),
        )
        for segment in result.segments
    ]
    return "\n".join(table_lines([*_HEADS, *rows], alignment=">><>>>>>>>")) + "\n"


def segments_csv(result: CheckResult) -> str:
    """Return the segments as CSV, with the keys of the JSON report as heads."""
    return columns_csv(
        {key: [getattr(segment, key) for segment in result.segments] for key in SEGMENT_KEYS}
    )
