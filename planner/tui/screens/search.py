"""Finds an item or a finding by number, code or text."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

from textual import on
from textual.binding import Binding, BindingType
from textual.containers import Vertical
from textual.screen import ModalScreen
from textual.widgets import Input

from planner.tui.search import Hit, HitRows
from planner.tui.widgets.row_list import RowList

if TYPE_CHECKING:
    from collections.abc import Callable

    from textual.app import ComposeResult


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
            yield RowList(HitRows(hits=()), empty="Nothing found.", id="hits")

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
        rows.show(HitRows(hits=self._search(event.value)))
        rows.select(0)

    @on(Input.Submitted)
    @on(RowList.Chosen)
    def _choose(self) -> None:
        rows = self.query_one("#hits", RowList)
        found = rows.rows
        if isinstance(found, HitRows) and found.hits:
            self.dismiss(found.hits[rows.cursor])
