"""The rows of the tables: findings, segments, items; made one by one where they are looked at."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.report.text import finding_message, printable
from planner.service.preflight import CheckResult
from planner.units import wh_from_j
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.prediction import ItemArrival, Segment
    from planner.service.preflight import UnreadableMission


MARKS = {Severity.ERROR: "✖", Severity.WARNING: "▲", Severity.INFO: "·"}
"""Signs of severities, so that colour is never needed."""


class TableColumn(Value):
    """One column of a table."""

    head: str
    width: int
    """In cells; 0 takes what is left."""
    is_right: bool = True


class Table(Protocol):
    """The rows of a table."""

    @property
    def columns(self) -> tuple[TableColumn, ...]:
        """Heads and widths."""
        ...

    def __len__(self) -> int:
        """Return how many rows there are."""
        ...

    def cells(self, index: int) -> tuple[str, ...]:
        """Return the texts of a row."""
        ...

    def tone(self, index: int) -> str:
        """Return what a row is to look like: ``error``, ``warning``, ``info`` or nothing."""
        ...


class FindingTable(Value, eq=False):
    """Findings, worst first."""

    findings: tuple[Finding, ...]
    columns: tuple[TableColumn, ...] = (
        TableColumn(head="", width=1),
        TableColumn(head="code", width=4, is_right=False),
        TableColumn(head="item", width=4),
        TableColumn(head="what was found", width=0, is_right=False),
    )

    def __len__(self) -> int:
        return len(self.findings)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return mark, code, item and message."""
        finding = self.findings[index]
        item = "" if finding.item is None else str(finding.item)
        return MARKS[finding.severity], finding.code, item, printable(finding.message)

    def tone(self, index: int) -> str:
        """Return the severity."""
        return self.findings[index].severity.label


class SegmentTable(Value, eq=False):
    """The segments of a flight; climbs are changes of height, ``stop`` is to stand still."""

    segments: Sequence[Segment]
    columns: tuple[TableColumn, ...]
    """The first are shown where there is no room for all."""

    def __len__(self) -> int:
        return len(self.segments)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return the figures of a segment."""
        segment = self.segments[index]
        stop_m = segment.stopping_distance_m
        return (
            str(segment.item),
            str(segment.state),
            quantity.decimals(segment.start_s, 1),
            quantity.decimals(segment.duration_s, 1),
            quantity.decimals(segment.distance_m, 1),
            quantity.decimals(segment.energy_wh, 3),
            quantity.decimals(segment.speed_m_s, 1),
            quantity.decimals(segment.climb_m, 1),
            "" if stop_m is None else quantity.decimals(stop_m, 1),
        )

    def tone(self, index: int) -> str:  # noqa: ARG002 - as the other rows
        """Return nothing: no segment is worse than another."""
        return ""


class ItemTable(Value, eq=False):
    """The items of a mission with the worst finding of each."""

    items: tuple[ItemArrival, ...]
    worst: dict[int, Severity]
    """By item."""
    columns: tuple[TableColumn, ...] = (
        TableColumn(head="", width=1),
        TableColumn(head="item", width=5),
        TableColumn(head="command", width=0, is_right=False),
        TableColumn(head="reached", width=14),
        TableColumn(head="used", width=8),
    )

    def __len__(self) -> int:
        return len(self.items)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return mark, number, command, time and energy."""
        arrival = self.items[index]
        worst = self.worst.get(arrival.item)
        return (
            "" if worst is None else MARKS[worst],
            str(arrival.item),
            arrival.command,
            quantity.duration(arrival.arrival_s),
            quantity.energy(arrival.energy_used_wh),
        )

    def tone(self, index: int) -> str:
        """Return the severity of the worst finding."""
        worst = self.worst.get(self.items[index].item)
        return "" if worst is None else worst.label


def segment_table(result: CheckResult | UnreadableMission) -> SegmentTable:
    """Return the segments, columns as wide as the numbers; none of a mission not read."""
    assessment = result.assessment if isinstance(result, CheckResult) else None
    columns: dict[str, tuple[FloatArray | list[float], int]] = {
        "item": ([], 0),
        "start s": ([], 1),
        "time s": ([], 1),
        "dist m": ([], 1),
        "Wh": ([], 3),
        "m/s": ([], 1),
        "climb m": ([], 1),
        "stop m": ([], 1),
    }
    if assessment is not None:
        own = assessment.flight.motion.segments
        columns |= {
            "item": (own.item.astype(float), 0),
            "start s": (own.end_s, 1),
            "time s": (own.duration_s, 1),
            "dist m": (own.distance_m, 1),
            "Wh": (wh_from_j(assessment.flight.segment_energy_j), 3),
            "m/s": (own.speed_m_s, 1),
            "climb m": (own.climb_m, 1),
            "stop m": (own.stopping_distance_m, 1),
        }
    made = [
        TableColumn(head=head, width=_width(head, *numbers_)) for head, numbers_ in columns.items()
    ]
    made.insert(1, TableColumn(head="state", width=10, is_right=False))
    return SegmentTable(
        segments=result.segments if isinstance(result, CheckResult) else (), columns=tuple(made)
    )


def _width(head: str, values: FloatArray | list[float], digits: int) -> int:
    """Return the cells that the widest of some numbers takes, and its head."""
    known = np.asarray(values)[np.isfinite(values)]
    ends = (float(known.min()), float(known.max())) if len(known) else ()
    return max(len(head), *(len(quantity.decimals(value, digits)) for value in ends), 0)


def item_table(result: CheckResult | UnreadableMission) -> ItemTable:
    """Return the items; none of a mission that cannot be read."""
    worst: dict[int, Severity] = {}
    for finding in result.findings:
        if finding.item is not None:
            worst[finding.item] = max(worst.get(finding.item, Severity.INFO), finding.severity)
    return ItemTable(items=result.items if isinstance(result, CheckResult) else (), worst=worst)


def finding_line(finding: Finding) -> str:
    """Return a finding in one line: its mark, code and sentence."""
    return f"{MARKS[finding.severity]} {finding.code} {finding_message(finding)}"
