"""A table of any length: only the rows in sight are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment as Run
from textual.binding import Binding, BindingType
from textual.geometry import Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

if TYPE_CHECKING:
    from textual import events

    from planner.tui.rows import Table, TableColumn

_GAP = 1
"""Blank cells between columns."""
_LEAST_FLEXIBLE = 12


class RowList(ScrollView, can_focus=True):
    """Rows under a head that stays, with one of them selected."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {
        "row-list--head",
        "row-list--cursor",
        "row-list--error",
        "row-list--warning",
        "row-list--info",
    }
    DEFAULT_CSS = """
    RowList {
        background: $surface;
        color: $foreground;
        overflow-x: hidden;
        scrollbar-size-vertical: 1;
        & > .row-list--head { color: $text-muted; text-style: underline; }
        & > .row-list--cursor { background: $panel-lighten-2; text-style: bold; }
        & > .row-list--error { color: $text-error; }
        & > .row-list--warning { color: $text-warning; }
        & > .row-list--info { color: $text-muted; }
        &:focus > .row-list--cursor { background: $primary-darken-2; color: auto 100%; text-style: bold; }
    }
    """
    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up,k", "move(-1)", "Up", show=False),
        Binding("down,j", "move(1)", "Down", show=False),
        Binding("pageup", "page(-1)", "Page up", show=False),
        Binding("pagedown", "page(1)", "Page down", show=False),
        Binding("home,g", "move_to(0)", "First", show=False),
        Binding("end,G", "move_to(-1)", "Last", show=False),
        Binding("enter", "choose", "Choose", show=False),
    ]

    @dataclass
    class Selected(Message):
        """The cursor went to another row."""

        row_list: RowList
        index: int

        @property
        def control(self) -> RowList:
            """The list it happened in."""
            return self.row_list

    @dataclass
    class Chosen(Message):
        """A row was chosen: Enter, or a click on the selected row."""

        row_list: RowList
        index: int

        @property
        def control(self) -> RowList:
            """The list it happened in."""
            return self.row_list

    def __init__(
        self,
        rows: Table,
        *,
        empty: str,
        id: str | None = None,  # noqa: A002 - textual's name
        classes: str | None = None,
    ) -> None:
        super().__init__(id=id, classes=classes)
        self._rows = rows
        self._empty = empty
        self._cursor = 0

    @property
    def rows(self) -> Table:
        """What is shown."""
        return self._rows

    @property
    def cursor(self) -> int:
        """The selected row, from 0."""
        return self._cursor

    def show(self, rows: Table, *, empty: str | None = None) -> None:
        """Show other rows; the cursor stays where it was, as far as there are rows.

        Parameters
        ----------
        rows : Rows
            What is shown.
        empty : str, optional
            Text shown from now on where there are none.
        """
        self._rows = rows
        self._empty = self._empty if empty is None else empty
        self._cursor = min(self._cursor, max(len(rows) - 1, 0))
        self._measure()
        self.refresh()

    def select(self, index: int) -> None:
        """Put the cursor on a row without saying so."""
        index = max(min(index, len(self._rows) - 1), 0)
        if index != self._cursor:
            before, self._cursor = self._cursor, index
            if not self._reveal():
                self._refresh_row(before)
                self._refresh_row(index)

    def on_mount(self) -> None:
        """Measure the rows."""
        self._measure()

    def _measure(self) -> None:
        self.virtual_size = Size(self.size.width, len(self._rows) + 1)

    def _shown_rows(self) -> int:
        return max(self.scrollable_content_region.height - 1, 1)

    def _refresh_row(self, index: int) -> None:
        if 0 < index + 1 - self.scroll_offset.y <= self._shown_rows():
            self.refresh_line(index + 1)

    def _reveal(self) -> bool:
        """Scroll until the cursor is in sight; return whether that moved anything."""
        top, height = self.scroll_offset.y, self._shown_rows()
        wanted = min(max(top, self._cursor - height + 1), self._cursor)
        if wanted == top:
            return False
        self.scroll_to(y=wanted, animate=False, immediate=True, force=True)
        self.refresh()
        return True

    def action_move(self, by: int) -> None:
        """Move the cursor by some rows."""
        self._go(self._cursor + by)

    def action_page(self, by: int) -> None:
        """Move the cursor by a page."""
        self._go(self._cursor + by * self._shown_rows())

    def action_move_to(self, index: int) -> None:
        """Move the cursor to a row, counted from the end where negative."""
        self._go(index if index >= 0 else len(self._rows) + index)

    def action_choose(self) -> None:
        """Say that the selected row was chosen."""
        if len(self._rows):
            self.post_message(self.Chosen(self, self._cursor))

    def _go(self, index: int) -> None:
        if len(self._rows):
            self.select(index)
            self.post_message(self.Selected(self, self._cursor))

    def on_click(self, event: events.Click) -> None:
        """Select the row under the mouse; choose the one that is selected already."""
        offset = event.get_content_offset(self)
        if offset is None or offset.y == 0:
            return
        index = self.scroll_offset.y + offset.y - 1
        if index >= len(self._rows):
            return
        if index == self._cursor:
            self.action_choose()
        else:
            self._go(index)

    def on_focus(self) -> None:
        """Say what is selected: the details follow the list in use."""
        if len(self._rows):
            self.post_message(self.Selected(self, self._cursor))

    def render_line(self, y: int) -> Strip:
        """Return the head, a row, or a blank line."""
        width = self.scrollable_content_region.width
        if y == 0:
            head = tuple(column.head for column in self._rows.columns)
            return self._strip(head, "head", width)
        index = self.scroll_offset.y + y - 1
        if index >= len(self._rows):
            text = f" {self._empty}" if y == 1 and not len(self._rows) else ""
            return Strip([Run(set_cell_size(text, width), self.rich_style)], width)
        part = "cursor" if index == self._cursor else self._rows.tone(index)
        return self._strip(self._rows.cells(index), part, width)

    def _strip(self, cells: tuple[str, ...], part: str, width: int) -> Strip:
        columns = self._rows.columns
        while len(columns) > 1 and _taken(columns) > width:
            columns = columns[:-1]  # a column is left out before a number is cut
        flexible = max(width - _taken(columns) + _LEAST_FLEXIBLE, _LEAST_FLEXIBLE)
        text = ""
        for column, cell in zip(columns, cells, strict=False):
            text += " " * _GAP + fitted(cell, column.width or flexible, is_right=column.is_right)
        style = self.get_component_rich_style(f"row-list--{part}") if part else self.rich_style
        return Strip([Run(set_cell_size(text, width), style)], width)


def _taken(columns: tuple[TableColumn, ...]) -> int:
    """Return the cells that columns need."""
    return sum((column.width or _LEAST_FLEXIBLE) + _GAP for column in columns)


def fitted(text: str, width: int, *, is_right: bool) -> str:
    """Return a text in so many cells; what is cut off leaves an ellipsis."""
    taken = cell_len(text)
    if taken > width:
        return set_cell_size(text, width - 1) + "…" if width > 1 else set_cell_size(text, width)
    blank = " " * (width - taken)
    return blank + text if is_right else text + blank
