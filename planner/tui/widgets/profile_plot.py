"""The flight over time: one quantity at a time, with a cursor."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from textual.binding import Binding, BindingType

from planner import quantity
from planner.tui.curves import thinned
from planner.tui.widgets.canvas import DOTS_ACROSS, DOTS_DOWN, VEHICLE, Canvas, Drawing

if TYPE_CHECKING:
    from textual import events

    from planner.tui.curves import Picture

_LABELS = 9
"""Columns left of the curve."""
_HEADS = 1
_FEET = 1


class ProfilePlot(Drawing):
    """A curve over the time of the flight."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left,h", "step(-1)", "Earlier", show=False),
        Binding("right,l", "step(1)", "Later", show=False),
        Binding("shift+left", "step(-10)", "Much earlier", show=False),
        Binding("shift+right", "step(10)", "Much later", show=False),
        Binding("home", "edge(0)", "Start", show=False),
        Binding("end", "edge(1)", "End", show=False),
        Binding("up,k", "turn(-1)", "Previous quantity", show=False),
        Binding("down,j", "turn(1)", "Next quantity", show=False),
    ]

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - textual's
        super().__init__(id=id, classes=classes)
        self._pictures: tuple[Picture, ...] = ()
        self._index = 0
        self._cursor_s = 0.0
        self._span_s: tuple[float, float] | None = None
        self._vehicle_s: float | None = None

    @property
    def picture(self) -> Picture | None:
        """What is shown; ``None`` where nothing is flown."""
        return self._pictures[self._index % len(self._pictures)] if self._pictures else None

    def show(self, pictures: tuple[Picture, ...]) -> None:
        """Show the pictures of another flight, the same quantity of it."""
        self._pictures = pictures
        self.redraw()

    def point_at(self, time_s: float) -> None:
        """Put the cursor on a moment without saying so."""
        if time_s != self._cursor_s:
            self._cursor_s = time_s
            self.move_cursor()

    def show_vehicle(self, time_s: float | None) -> None:
        """Show at which moment of its flight the vehicle itself is; ``None``: at none."""
        if time_s != self._vehicle_s:
            self._vehicle_s = time_s
            self.move_cursor()

    def mark(self, span_s: tuple[float, float] | None) -> None:
        """Mark a stretch of time; ``None``: none."""
        if span_s != self._span_s:
            self._span_s = span_s
            self.move_cursor()

    def action_turn(self, by: int) -> None:
        """Show the next quantity."""
        self._index = (self._index + by) % max(len(self._pictures), 1)
        self.redraw()

    def action_step(self, by: int) -> None:
        """Move the cursor by some columns."""
        if (end_s := self._end_s()) > 0.0:
            self._move(self._cursor_s + by * end_s / max(self._across(self.size.width) - 1, 1))

    def action_edge(self, share: int) -> None:
        """Move the cursor to the start or the end."""
        self._move(share * self._end_s())

    def on_click(self, event: events.Click) -> None:
        """Put the cursor under the mouse."""
        across = max(self._across(self.size.width) - 1, 1)
        self._move((event.x - _LABELS) / across * self._end_s())

    def _move(self, time_s: float) -> None:
        if self._pictures:
            self.point_at(min(max(time_s, 0.0), self._end_s()))
            self.post_message(self.Moved(self._cursor_s))

    def _end_s(self) -> float:
        return float(self._pictures[0].lines[0].time_s[-1]) if self._pictures else 0.0

    @staticmethod
    def _across(columns: int) -> int:
        """Return the columns of the curve."""
        return max(columns - _LABELS, 2)

    def _y(
        self, canvas: Canvas, value: np.ndarray[tuple[int], np.dtype[np.float64]]
    ) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        picture = self.picture
        low, high = picture.low_high() if picture is not None else (0.0, 1.0)
        down = (canvas.rows - _HEADS - _FEET) * DOTS_DOWN - 1
        return _HEADS * DOTS_DOWN + (high - value) / (high - low) * down

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return the curve with its axes."""
        canvas = Canvas(columns, rows)
        picture = self.picture
        if picture is None or rows < _HEADS + _FEET + 1:
            canvas.write(1, 0, "nothing is flown", "axis")
            return canvas
        end_s, across = self._end_s(), self._across(columns)
        low, high = picture.low_high()
        for row in range(_HEADS, rows - _FEET):
            canvas.write(_LABELS - 1, row, "│", "axis")
        canvas.write(0, _HEADS, f"{picture.shown(high):>{_LABELS - 1}}", "axis")
        canvas.write(0, rows - _FEET - 1, f"{picture.shown(low):>{_LABELS - 1}}", "axis")
        end = quantity.duration(end_s)
        canvas.write(_LABELS, rows - 1, "0", "axis")
        canvas.write(columns - len(end), rows - 1, end, "axis")
        middle = quantity.duration(end_s / 2.0)
        canvas.write(_LABELS + (across - len(middle)) // 2, rows - 1, middle, "axis")
        for line in reversed(picture.lines):
            x, value = thinned(line.time_s, line.value, end_s=end_s, columns=across * DOTS_ACROSS)
            canvas.line(x + _LABELS * DOTS_ACROSS, self._y(canvas, value), line.ink)
        column = 1
        for line in picture.lines[1:]:  # named on the line itself, so that no colour is needed
            text = f"─ {line.name} "
            at = float(np.interp(end_s * 0.02, line.time_s, line.value))
            row = int(self._y(canvas, np.array([at]))[0]) // DOTS_DOWN
            canvas.write(_LABELS + column, max(row - 1, _HEADS), text, line.ink)
            column += len(text) + 1
        return canvas

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw the moment, the value there and the marked stretch."""
        picture, end_s = self.picture, self._end_s()
        if picture is None or not end_s > 0.0 or canvas.rows < _HEADS + _FEET + 1:
            return
        across = self._across(canvas.columns)
        if self._span_s is not None:
            line, span_s = picture.lines[0], self._span_s
            inside = (line.time_s >= span_s[0]) & (line.time_s <= span_s[1])
            x = _LABELS * DOTS_ACROSS + line.time_s[inside] / end_s * (across * DOTS_ACROSS - 1)
            canvas.line(x, self._y(canvas, line.value[inside]), "stretch")
            first, last = (_LABELS + round(time_s / end_s * (across - 1)) for time_s in span_s)
            for column in range(first, last + 1):
                canvas.write(column, canvas.rows - 1, "▔", "stretch", only_blank=True)
        column = _LABELS + round(self._cursor_s / end_s * (across - 1))
        for row in range(_HEADS, canvas.rows - _FEET):
            canvas.write(column, row, "┊", "cursor")
        value = picture.at(self._cursor_s)
        row = int(self._y(canvas, np.array([value]))[0]) // DOTS_DOWN
        canvas.write(column, min(max(row, _HEADS), canvas.rows - _FEET - 1), "◆", "cursor")
        if self._vehicle_s is not None:
            column = _LABELS + round(self._vehicle_s / end_s * (across - 1))
            canvas.write(column, canvas.rows - 1, VEHICLE, "cursor")
        text = f"{picture.name}: {picture.shown(value)} at {quantity.duration(self._cursor_s)}"
        hint = "  (p: next)" if len(self._pictures) > 1 else ""
        text += hint if len(text) + len(hint) < canvas.columns else ""
        canvas.write(1, 0, text, "cursor")
