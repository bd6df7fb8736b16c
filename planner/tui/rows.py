"""The tables of a review: findings, segments, items."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.report.columns import DIGITS, cell_text
from planner.report.text import finding_message, printable
from planner.rules.ledger import LedgerEntry
from planner.service.preflight import CheckResult
from planner.tui.widgets.row_list import Table, TableColumn
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.flight.prediction import ItemArrival
    from planner.service.preflight import UnreadableMission


MARKS = {Severity.ERROR: "✖", Severity.WARNING: "▲", Severity.INFO: "·"}
"""Signs of severities, so that colour is never needed."""
LEFT_OPEN = "–"
"""Sign of what could not be checked."""
NOT_CHECKED = "NOT CHECKED"
"""The verdict where nothing is wrong but what was left open."""
_SEGMENT_HEADS = {
    "start_s": "start s",
    "duration_s": "time s",
    "distance_m": "dist m",
    "energy_wh": "Wh",
    "speed_m_s": "m/s",
    "climb_m": "climb m",
    "stopping_distance_m": "stop m",
}


def finding_table(findings: Sequence[Finding], left_open: Sequence[LedgerEntry] = ()) -> Table:
    """Return findings as rows, then the rules not checked: mark, code, item and message."""

    def cells(one: Finding | LedgerEntry) -> tuple[str, ...]:
        if isinstance(one, LedgerEntry):
            return LEFT_OPEN, one.code, "", f"{one.name} not checked: needs {one.needs}"
        item = "" if one.item is None else str(one.item)
        return MARKS[one.severity], one.code, item, printable(one.message)

    return Table(
        entries=(*findings, *left_open),
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="code", width=4, is_right=False),
            TableColumn(head="item", width=4),
            TableColumn(head="what was found", width=0, is_right=False),
        ),
        cells_of=cells,
        tone_of=lambda one: "warning" if isinstance(one, LedgerEntry) else one.severity.label,
    )


def segment_table(result: CheckResult | UnreadableMission) -> Table:
    """Return the segments, columns as wide as the numbers; none of a mission not read."""
    assessment = result.assessment if isinstance(result, CheckResult) else None
    widths = {key: len(head) for key, head in {**_SEGMENT_HEADS, "item": "item"}.items()}
    if assessment is not None:
        own = assessment.flight.motion.segments
        numbers = {"start_s": own.end_s, "energy_wh": wh_from_j(assessment.flight.segment_energy_j)}
        for key, width in widths.items():
            values = np.asarray(numbers[key] if key in numbers else getattr(own, key), np.float64)
            ends = values[np.isfinite(values)]
            texts = [
                quantity.decimals(float(end), DIGITS.get(key, 0))
                for end in ((ends.min(), ends.max()) if ends.size else ())
            ]
            widths[key] = max(width, *map(len, texts), 0)
    return Table(
        entries=result.segments if isinstance(result, CheckResult) else (),
        columns=(
            TableColumn(head="item", width=widths["item"]),
            TableColumn(head="state", width=10, is_right=False),
            *(TableColumn(head=head, width=widths[key]) for key, head in _SEGMENT_HEADS.items()),
        ),
        cells_of=lambda one: tuple(
            cell_text(key, getattr(one, key)) for key in ("item", "state", *_SEGMENT_HEADS)
        ),
    )


def item_table(result: CheckResult | UnreadableMission) -> Table:
    """Return the items, each with its worst finding; none of a mission that cannot be read."""
    worst: dict[int, Severity] = {}
    for finding in result.findings:
        if finding.item is not None:
            worst[finding.item] = max(worst.get(finding.item, Severity.INFO), finding.severity)

    def cells(arrival: ItemArrival) -> tuple[str, ...]:
        return (
            MARKS[worst[arrival.item]] if arrival.item in worst else "",
            str(arrival.item),
            arrival.command,
            quantity.duration(arrival.arrival_s),
            quantity.energy(arrival.energy_used_wh),
        )

    return Table(
        entries=result.items if isinstance(result, CheckResult) else (),
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="item", width=5),
            TableColumn(head="command", width=0, is_right=False),
            TableColumn(head="reached", width=14),
            TableColumn(head="used", width=8),
        ),
        cells_of=cells,
        tone_of=lambda arrival: worst[arrival.item].label if arrival.item in worst else "",
    )


def finding_line(finding: Finding) -> str:
    """Return a finding in one line: its mark, code and sentence."""
    return f"{MARKS[finding.severity]} {finding.code} {finding_message(finding)}"
