"""Finds an item or a finding by number, code or text."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from planner.report.text import printable
from planner.service.preflight import CheckResult
from planner.tui.rows import MARKS, TableColumn
from planner.tui.widgets.row_list import RowList
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from textual.app import ComposeResult

    from planner.findings import Finding, Severity
    from planner.flight.prediction import ItemArrival
    from planner.service.preflight import UnreadableMission


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


class HitTable(Value, eq=False):
    """Hits as rows of a table."""

    hits: tuple[Hit, ...]
    columns: tuple[TableColumn, ...] = (
        TableColumn(head="", width=1),
        TableColumn(head="number, code or text", width=0, is_right=False),
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
            searched = f"{finding.code} {finding.name} {finding.message}"
            is_hit = wanted in searched.casefold()
        if is_hit:
            item = "" if finding.item is None else f" item {finding.item}:"
            yield Hit(
                text=f"{finding.code}{item} {printable(finding.message)}",
                finding=index,
                severity=finding.severity,
            )


def _item_hit(arrival: ItemArrival) -> Hit:
    return Hit(text=f"item {arrival.item}: {arrival.command}", item=arrival.item)


class SearchScreen(ModalScreen[Hit | None]):
    """A field, and what its text finds.

    Parameters
    ----------
    search : callable
        From a text to what it finds.
    """

    DEFAULT_CSS = """
    SearchScreen { align: center top; background: $background 60%; }
    SearchScreen > Vertical {
        width: 90%; max-width: 100; height: 70%; max-height: 18; margin-top: 2;
        background: $panel; border: round $primary;
    }
    SearchScreen RowList { height: 1fr; background: $panel; }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("escape", "dismiss", "Back"),
        Binding("down", "move(1)", "Next", show=False, priority=True),
        Binding("up", "move(-1)", "Previous", show=False, priority=True),
    ]

    def __init__(self, search: Callable[[str], tuple[Hit, ...]]) -> None:
        super().__init__()
        self._search = search

    def compose(self) -> ComposeResult:
        """Yield the field and the list."""
        with Vertical():
            yield Input(placeholder="number of an item, code or text", id="wanted")
            yield RowList(HitTable(hits=()), empty="Nothing found.", id="hits")

    def on_mount(self) -> None:
        """Put the keyboard into the field."""
        self.query_one("#wanted").focus()

    def action_move(self, by: int) -> None:
        """Select another hit, the keyboard staying in the field."""
        rows = self.query_one("#hits", RowList)
        rows.select(rows.cursor + by)

    @on(Input.Changed)
    def _find(self, event: Input.Changed) -> None:
        rows = self.query_one("#hits", RowList)
        rows.show(HitTable(hits=self._search(event.value)))
        rows.select(0)

    @on(Input.Submitted)
    @on(RowList.Chosen)
    def _choose(self) -> None:
        rows = self.query_one("#hits", RowList)
        found = rows.rows
        if isinstance(found, HitTable) and found.hits:
            self.dismiss(found.hits[rows.cursor])
