"""What a text finds in a review: findings and items."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.text import printable
from planner.service import CheckResult
from planner.tui.rows import MARKS, Column
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding, Severity
    from planner.flight.prediction import ItemArrival
    from planner.service import UnreadableMission

MOST_HITS = 200
"""Enough to see that a text finds too much."""


class Hit(Value):
    """Something that was found."""

    text: str
    finding: int | None = None
    """Which finding, from 0; ``None`` where it is an item."""
    item: int | None = None
    """Which item, from 1."""
    severity: Severity | None = None


class HitRows(Value, eq=False):
    """Hits as rows of a table."""

    hits: tuple[Hit, ...]
    columns: tuple[Column, ...] = (
        Column(head="", width=1),
        Column(head="number, code or text", width=0, is_right=False),
    )

    def __len__(self) -> int:
        return len(self.hits)

    def cells(self, index: int) -> tuple[str, ...]:
        """Return the sign of a finding's severity, and what was found."""
        hit = self.hits[index]
        return "" if hit.severity is None else MARKS[hit.severity], hit.text

    def tone(self, index: int) -> str:
        """Return the severity."""
        severity = self.hits[index].severity
        return "" if severity is None else severity.label


def hits(
    result: CheckResult | UnreadableMission, findings: Sequence[Finding], text: str
) -> tuple[Hit, ...]:
    """Return what a text finds, of a number the item itself first.

    Parameters
    ----------
    result : CheckResult or UnreadableMission
        The mission, for its items.
    findings : sequence of Finding
        As they are listed.
    text : str
        A number of an item, a code or the beginning of one, or any words; case does not count.
    """
    wanted = text.strip().casefold()
    if not wanted:
        return ()
    items = result.items if isinstance(result, CheckResult) else ()
    found: list[Hit] = []
    if wanted.isdecimal() and 0 < int(wanted) <= len(items):
        found.append(_item_hit(items[int(wanted) - 1]))
    found += _findings_that_hold(findings, wanted)
    if not wanted.isdecimal():
        matching = (arrival for arrival in items if wanted in arrival.command.casefold())
        for arrival in matching:
            if len(found) >= MOST_HITS:
                break
            found.append(_item_hit(arrival))
    return tuple(found[:MOST_HITS])


def _findings_that_hold(findings: Sequence[Finding], wanted: str) -> Iterator[Hit]:
    for index, finding in enumerate(findings):
        if wanted.isdecimal():
            is_hit = str(finding.item) == wanted
        else:
            said = f"{finding.code} {finding.name} {finding.message}"
            is_hit = wanted in said.casefold()
        if is_hit:
            item = "" if finding.item is None else f" item {finding.item}:"
            yield Hit(
                text=f"{finding.code}{item} {printable(finding.message)}",
                finding=index,
                severity=finding.severity,
            )


def _item_hit(arrival: ItemArrival) -> Hit:
    return Hit(text=f"item {arrival.item}: {arrival.command}", item=arrival.item)
