"""A table of any length: only the rows in sight are made."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

from rich.cells import cell_len, set_cell_size
from rich.segment import Segment as Run
from textual.binding import Binding, BindingType
from textual.geometry import Size
from textual.message import Message
from textual.scroll_view import ScrollView
from textual.strip import Strip

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from textual import events

_GAP = 1
"""Blank cells between columns."""
_LEAST_FLEXIBLE = 12


class TableColumn(Value):
    """One column of a table."""

    head: str
    width: int
    """In cells; 0 takes what is left."""
    is_right: bool = True


class Table(Value, eq=False):
    """The rows of a table."""

    columns: tuple[TableColumn, ...]
    """The first are shown where there is no room for all."""
    entries: Sequence[Any]
    cells_of: Callable[[Any], tuple[str, ...]]
    """The texts of an entry, made where they are looked at."""
    tone_of: Callable[[Any], str] = lambda _: ""
    """What the row of an entry is to look like: ``error``, ``warning``, ``info`` or nothing."""

    def __len__(self) -> int:
        return len(self.entries)

    def row(self, index: int) -> tuple[tuple[str, ...], str]:
        """Return the texts of a row, and what it is to look like."""
        entry = self.entries[index]
        return self.cells_of(entry), self.tone_of(entry)


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
    class _OfRow(Message):
        row_list: RowList
        index: int

        @property
        def control(self) -> RowList:
            return self.row_list

    class Selected(_OfRow):
        """The cursor went to another row."""

    class Chosen(_OfRow):
        """A row was chosen: Enter, or a click on the selected row."""

    def __init__(self, rows: Table, *, empty: str, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self.rows = rows
        self.cursor = 0
        """The selected row, from 0."""
        self._empty = empty

    def show(self, rows: Table, *, empty: str | None = None) -> None:
        """Show other rows, and from now on another text where there are none.

        The cursor stays where it was, as far as there are rows.
        """
        self.rows = rows
        self._empty = self._empty if empty is None else empty
        self.cursor = min(self.cursor, max(len(rows) - 1, 0))
        self._measure()
        self.refresh()

    def select(self, index: int) -> None:
        """Put the cursor on a row without saying so."""
        index = max(min(index, len(self.rows) - 1), 0)
        if index != self.cursor:
            before, self.cursor = self.cursor, index
            self._show_moved(before)

    def _show_moved(self, before: int) -> None:
        if not self._reveal():
            self._refresh_row(before)
            self._refresh_row(self.cursor)

    def on_mount(self) -> None:
        """Measure the rows."""
        self._measure()

    def _measure(self) -> None:
        self.virtual_size = Size(self.size.width, len(self.rows) + 1)

    def _shown_rows(self) -> int:
        return max(self.scrollable_content_region.height - 1, 1)

    def _refresh_row(self, index: int) -> None:
        if 0 < index + 1 - self.scroll_offset.y <= self._shown_rows():
            self.refresh_line(index + 1)

    def _reveal(self) -> bool:
        """Scroll until the cursor is in sight; return whether that moved anything."""
        top, height = self.scroll_offset.y, self._shown_rows()
        wanted = min(max(top, self.cursor - height + 1), self.cursor)
        if wanted == top:
            return False
        self.scroll_to(y=wanted, animate=False, immediate=True, force=True)
        self.refresh()
        return True

    def action_move(self, by: int) -> None:
        """Move the cursor by some rows."""
        self._go(self.cursor + by)

    def action_page(self, by: int) -> None:
        """Move the cursor by a page."""
        self._go(self.cursor + by * self._shown_rows())

    def action_move_to(self, index: int) -> None:
        """Move the cursor to a row, counted from the end where negative."""
        self._go(index if index >= 0 else len(self.rows) + index)

    def action_choose(self) -> None:
        """Say that the selected row was chosen."""
        if len(self.rows):
            self.post_message(self.Chosen(self, self.cursor))

    def _go(self, index: int) -> None:
        if len(self.rows):
            before, self.cursor = self.cursor, max(min(index, len(self.rows) - 1), 0)
            self.post_message(self.Selected(self, self.cursor))
            # by way of the screen: it is drawn once, with the panes that follow
            self.screen.call_later(self._show_moved, before)

    def on_click(self, event: events.Click) -> None:
        """Select the row under the mouse; choose the one that is selected already."""
        offset = event.get_content_offset(self)
        if offset is None or offset.y == 0:
            return
        index = self.scroll_offset.y + offset.y - 1
        if index >= len(self.rows):
            return
        if index == self.cursor:
            self.action_choose()
        else:
            self._go(index)

    def on_focus(self) -> None:
        """Say what is selected: the details follow the list in use."""
        if len(self.rows):
            self.post_message(self.Selected(self, self.cursor))

    def render_line(self, y: int) -> Strip:
        """Return the head, a row, or a blank line."""
        width = self.scrollable_content_region.width
        if y == 0:
            head = tuple(column.head for column in self.rows.columns)
            return self._strip(head, "head", width)
        index = self.scroll_offset.y + y - 1
        if index >= len(self.rows):
            text = f" {self._empty}" if y == 1 and not len(self.rows) else ""
            return Strip([Run(set_cell_size(text, width), self.rich_style)], width)
        cells, tone = self.rows.row(index)
        return self._strip(cells, "cursor" if index == self.cursor else tone, width)

    def _strip(self, cells: tuple[str, ...], part: str, width: int) -> Strip:
        columns = self.rows.columns
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
