"""A canvas of braille dots, two by four to a character cell, and a widget that shows one."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from rich.segment import Segment as Run
from textual.geometry import Region
from textual.message import Message
from textual.strip import Strip
from textual.widget import Widget

if TYPE_CHECKING:
    from rich.style import Style
    from textual import events
    from textual.app import RenderResult

    from planner.arrays import FloatArray


VEHICLE = "▲"
"""Where the vehicle on the line is."""
INKS = ("curve", "second", "limit", "cursor", "axis", "inclusion", "exclusion", "mark", "stretch")


class Drawing(Widget, can_focus=True):
    """A canvas in inks; a class of its own says what is on it."""

    COMPONENT_CLASSES: ClassVar[set[str]] = {f"drawing--{ink}" for ink in INKS}
    DEFAULT_CSS = """
    Drawing {
        background: $surface;
        color: $foreground;
        & > .drawing--curve { color: $text-primary; }
        & > .drawing--second { color: $text-accent; }
        & > .drawing--limit { color: $text-error; }
        & > .drawing--cursor { color: $foreground; text-style: bold; }
        & > .drawing--axis { color: $text-muted; }
        & > .drawing--inclusion { color: $text-success; }
        & > .drawing--exclusion { color: $text-error; }
        & > .drawing--mark { color: $foreground; text-style: bold; }
        & > .drawing--stretch { color: $text-error; text-style: bold; }
    }
    """

    @dataclass
    class Moved(Message):
        """The cursor went to another moment of the flight."""

        time_s: float

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self.cursor_s = 0.0
        self._still: Canvas | None = None
        self._shown: Canvas | None = None
        self._stale: Canvas | None = None
        """What the screen still shows of a cursor that has moved."""
        self._styles: dict[str, Style] = {}

    @property
    def end_s(self) -> float:
        """When the flight ends; 0 where nothing is flown. [s]"""
        raise NotImplementedError

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return what stays while the cursor moves."""
        raise NotImplementedError

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw what moves with the cursor."""
        raise NotImplementedError

    def point_at(self, time_s: float) -> None:
        """Put the cursor on a moment without saying so."""
        if time_s != self.cursor_s:
            self.cursor_s = time_s
            self.move_cursor()

    def move_to(self, time_s: float) -> None:
        """Put the cursor on a moment of the flight, and report it."""
        if self.end_s > 0.0:
            self.point_at(min(max(time_s, 0.0), self.end_s))
            self.post_message(self.Moved(self.cursor_s))

    def redraw(self) -> None:
        """Draw everything again."""
        self._still = self._shown = self._stale = None
        self.refresh()

    def move_cursor(self) -> None:
        """Draw the cursor again: of a key that moves it twice once, and only the rows that change."""
        if self._shown is None:
            if self._stale is None:
                self.refresh()
            return
        if self._stale is not None:  # painted since, nobody knows how much of it
            self.refresh()
        self._stale, self._shown = self._shown, None
        self.call_next(self._show_moved)

    def _show_moved(self) -> None:
        stale, self._stale = self._stale, None
        if stale is not None and self.size:
            for row in self._drawn().rows_unlike(stale):
                self.refresh(Region(0, row, self.size.width, 1))

    def notify_style_update(self) -> None:
        """Look the styles up again."""
        self._styles.clear()
        super().notify_style_update()

    def _style(self, ink: str) -> Style:
        """Return the style of an ink; the widget's own where there is none."""
        style = self._styles.get(ink)
        if style is None:
            style = self.get_component_rich_style(f"drawing--{ink}") if ink else self.rich_style
            self._styles[ink] = style
        return style

    def on_resize(self, event: events.Resize) -> None:  # noqa: ARG002 - given by textual
        """Draw for the new size."""
        self.redraw()

    def render(self) -> RenderResult:
        """Return nothing: the lines are rendered one by one."""
        return ""

    def render_line(self, y: int) -> Strip:
        """Return a row of the canvas."""
        shown = self._drawn()
        if y >= shown.rows:
            return Strip.blank(self.size.width, self._style(""))
        return Strip([Run(text, self._style(ink)) for text, ink in shown.runs(y)], self.size.width)

    def _drawn(self) -> Canvas:
        """Return the canvas with the cursor where it is."""
        if self._shown is None:
            if self._still is None:
                self._still = self.still_canvas(self.size.width, self.size.height)
            self._shown = self._still.copy()
            self.draw_cursor(self._shown)
        return self._shown


DOTS_ACROSS, DOTS_DOWN = 2, 4
"""Dots of a cell."""
_BRAILLE = 0x2800
# Unicode counts the dots of a cell down the left column, down the right, then the lowest pair.
_WEIGHTS = np.array([[0x01, 0x08], [0x02, 0x10], [0x04, 0x20], [0x40, 0x80]], dtype=np.int64)


class Canvas:
    """Lines and characters on a grid of cells; what is drawn later covers what was there."""

    def __init__(self, columns: int, rows: int) -> None:
        self.columns, self.rows = max(columns, 1), max(rows, 1)
        self.width, self.height = self.columns * DOTS_ACROSS, self.rows * DOTS_DOWN
        self._dots = np.zeros((self.height, self.width), dtype=bool)
        self._inks = np.full((self.rows, self.columns), "", dtype=object)
        self._characters: dict[tuple[int, int], str] = {}

    def copy(self) -> Canvas:
        """Return a canvas with the same drawing, to draw on without changing this one."""
        other = Canvas(self.columns, self.rows)
        other._dots = self._dots.copy()
        other._inks = self._inks.copy()
        other._characters = dict(self._characters)
        return other

    def line(self, x: FloatArray, y: FloatArray, ink: str) -> None:
        """Draw a line through finite points, y downwards; what lies outside is left out. (n,) [dots]"""
        across, down = np.rint(x), np.rint(y)
        moved = np.ones(len(across), dtype=bool)
        moved[1:] = (np.diff(across) != 0.0) | (np.diff(down) != 0.0)
        across, down = across[moved], down[moved]
        if len(across) < 2:
            self.dots(across, down, ink)
            return
        right, lower = np.diff(across), np.diff(down)
        steps = np.maximum(np.abs(right), np.abs(lower))
        begins, ends = np.zeros(len(steps)), np.ones(len(steps))
        for start, change, size in ((across, right, self.width), (down, lower, self.height)):
            low, high = _fractions_inside(start[:-1], change, size)
            begins, ends = np.maximum(begins, low), np.minimum(ends, high)
        first = np.floor(begins * steps)  # of the dots of each leg, those in sight alone are made
        counts = np.maximum(np.ceil(ends * steps) - first, 0.0).astype(np.int64)
        leg = np.repeat(np.arange(len(steps)), counts)
        own = np.arange(len(leg)) - np.repeat(np.cumsum(counts) - counts, counts)
        fraction = (first[leg] + own) / steps[leg]
        self.dots(
            np.append(across[leg] + fraction * right[leg], across[-1]),
            np.append(down[leg] + fraction * lower[leg], down[-1]),
            ink,
        )

    def dots(self, x: FloatArray, y: FloatArray, ink: str) -> None:
        """Draw single dots; those outside are left out. (n,) [dots]"""
        across, down = np.rint(x).astype(np.int64), np.rint(y).astype(np.int64)
        inside = (across >= 0) & (across < self.width) & (down >= 0) & (down < self.height)
        across, down = across[inside], down[inside]
        self._dots[down, across] = True
        self._inks[down // DOTS_DOWN, across // DOTS_ACROSS] = ink

    def write(
        self, column: int, row: int, text: str, ink: str, *, only_blank: bool = False
    ) -> None:
        """Write characters from a cell on, if asked where none is; what lies outside is left out."""
        for at, character in enumerate(text, start=column):
            if only_blank and (row, at) in self._characters:
                continue
            if 0 <= at < self.columns and 0 <= row < self.rows:
                self._characters[row, at] = character
                self._inks[row, at] = ink

    def write_apart(self, column: int, row: int, text: str, ink: str) -> bool:
        """Write a label where a blank is left before and after it; return whether there was room."""
        last = column + len(text)
        taken = any((row, at) in self._characters for at in range(column - 1, last + 1))
        if taken or column < 0 or last > self.columns:
            return False
        self.write(column, row, text, ink)
        return True

    def strike(self, column: int, row: int, character: str, ink: str) -> None:
        """Write a character of a line through everything: of a letter it takes the ink alone."""
        there = self._characters.get((row, column), "")
        self.write(column, row, there if there.isalnum() else character, ink)

    def rows_unlike(self, other: Canvas) -> list[int]:
        """Return the rows on which another drawing, of any size, is not the same."""
        if (self.rows, self.columns) != (other.rows, other.columns):
            return list(range(self.rows))
        dots = (self._dots != other._dots).any(axis=1)
        unlike = dots.reshape(-1, DOTS_DOWN).any(axis=1) | (self._inks != other._inks).any(axis=1)
        written = self._characters.items() ^ other._characters.items()
        unlike[[row for (row, _), _ in written]] = True
        return np.flatnonzero(unlike).tolist()

    def runs(self, row: int) -> list[tuple[str, str]]:
        """Return one row as runs of text, each with its ink; blank where nothing was drawn."""
        cells = self._dots[row * DOTS_DOWN : (row + 1) * DOTS_DOWN]
        weights = cells.reshape(DOTS_DOWN, self.columns, DOTS_ACROSS) * _WEIGHTS[:, None, :]
        codes = weights.sum(axis=(0, 2)).tolist()
        found: list[tuple[str, str]] = []
        for column, (code, ink) in enumerate(zip(codes, self._inks[row].tolist(), strict=True)):
            plain = chr(_BRAILLE + code) if code else " "
            character = self._characters.get((row, column), plain)
            if found and found[-1][1] == ink:
                found[-1] = (found[-1][0] + character, ink)
            else:
                found.append((character, ink))
        return found


def _fractions_inside(
    start: FloatArray, change: FloatArray, size: int
) -> tuple[FloatArray, FloatArray]:
    """Return between which fractions of their change lines are on a canvas; none where high is lower."""
    moves = change != 0.0
    by = np.where(moves, change, 1.0)
    crossings = np.stack(((-1.0 - start) / by, (size - start) / by))
    inside = (start >= -1.0) & (start <= size)
    low = np.where(moves, crossings.min(axis=0), np.where(inside, 0.0, 1.0))
    high = np.where(moves, crossings.max(axis=0), np.where(inside, 1.0, 0.0))
    return np.clip(low, 0.0, 1.0), np.clip(high, 0.0, 1.0)
