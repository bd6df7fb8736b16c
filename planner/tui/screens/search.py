"""Finds an item or a finding by number, code or text."""

from __future__ import annotations

from itertools import chain, islice
from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from planner.report.text import printable
from planner.service.preflight import CheckResult
from planner.tui.rows import MARKS
from planner.tui.widgets.row_list import RowList, Table, TableColumn
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

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


def hit_table(found: Sequence[Hit]) -> Table:
    """Return hits as rows: the sign of a finding's severity, and what was found."""
    return Table(
        entries=found,
        columns=(
            TableColumn(head="", width=1),
            TableColumn(head="number, code or text", width=0, is_right=False),
        ),
        cells_of=lambda hit: ("" if hit.severity is None else MARKS[hit.severity], hit.text),
        tone_of=lambda hit: "" if hit.severity is None else hit.severity.label,
    )


def hits(
    result: CheckResult | UnreadableMission, findings: Sequence[Finding], text: str
) -> tuple[Hit, ...]:
    """Return what a text finds among items and findings, whose order is that of the list.

    It is a number of an item, which comes first, a code or its beginning, or any words.
    """
    wanted = text.strip().casefold()
    if not wanted:
        return ()
    items = result.items if isinstance(result, CheckResult) else ()
    is_number = wanted.isdecimal()
    found = chain(
        (_item_hit(one) for one in items[int(wanted) - 1 : int(wanted)])
        if is_number and int(wanted) > 0
        else (),
        (
            Hit(text=_finding_text(one), finding=index, severity=one.severity)
            for index, one in enumerate(findings)
            if (
                str(one.item) == wanted
                if is_number
                else wanted in f"{one.code} {one.name} {one.message}".casefold()
            )
        ),
        (_item_hit(one) for one in items if not is_number and wanted in one.command.casefold()),
    )
    return tuple(islice(found, MOST_HITS))


def _finding_text(finding: Finding) -> str:
    item = "" if finding.item is None else f" item {finding.item}:"
    return f"{finding.code}{item} {printable(finding.message)}"


def _item_hit(arrival: ItemArrival) -> Hit:
    return Hit(text=f"item {arrival.item}: {arrival.command}", item=arrival.item)


class SearchScreen(ModalScreen[Hit | None]):
    """A field, and what the search finds of its text."""

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
            yield RowList(hit_table(()), empty="Nothing found.", id="hits")

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
        rows.show(hit_table(self._search(event.value)))
        rows.select(0)

    @on(Input.Submitted)
    @on(RowList.Chosen)
    def _choose(self) -> None:
        rows = self.query_one("#hits", RowList)
        if rows.rows.entries:
            self.dismiss(rows.rows.entries[rows.cursor])
