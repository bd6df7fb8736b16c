"""The flight from above, north up."""

from __future__ import annotations

from typing import TYPE_CHECKING, ClassVar

import numpy as np
from textual.binding import Binding, BindingType

from planner import quantity
from planner.tui.ground import scale_bar_m, scale_to_fit, wind_arrow
from planner.tui.widgets.canvas import DOTS_ACROSS, DOTS_DOWN, VEHICLE, Canvas, Drawing

if TYPE_CHECKING:
    from textual import events

    from planner.arrays import FloatArray
    from planner.findings import FlightStretch
    from planner.tui.ground import Ground, Scale


_FINEST_M = 0.05
"""A dot is no less than this. [m]"""


class GroundMap(Drawing):
    """Path, fence, home and rally points, the wind, and the place of the cursor."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("left,h", "step(-1)", "Earlier", show=False),
        Binding("right,l", "step(1)", "Later", show=False),
        Binding("plus,equals_sign", "zoom(1)", "Zoom in"),
        Binding("minus", "zoom(-1)", "out"),
        Binding("0", "fit", "Whole map", show=False),
        Binding("shift+left,H", "pan(-1, 0)", "Pan west", show=False),
        Binding("shift+right,L", "pan(1, 0)", "Pan east", show=False),
        Binding("shift+up,K", "pan(0, 1)", "Pan north", show=False),
        Binding("shift+down,J", "pan(0, -1)", "Pan south", show=False),
    ]

    def __init__(self, *, id: str | None = None, classes: str | None = None) -> None:  # noqa: A002 - textual's
        super().__init__(id=id, classes=classes)
        self._ground: Ground | None = None
        self._cursor_s = 0.0
        self._stretch: FlightStretch | None = None
        self._span_s: tuple[float, float] | None = None
        self._scale: Scale | None = None
        self._vehicle_m: tuple[float, float] | None = None
        self._zoom = 0
        """How many times the map is doubled; 0: all there is to draw is in sight."""
        self._middle_m = (0.0, 0.0)
        """What is in the middle of a map that is zoomed, east and north. [m]"""

    def show(self, ground: Ground | None) -> None:
        """Show another flight."""
        self._ground = ground
        self.redraw()

    def point_at(self, time_s: float) -> None:
        """Put the cursor on a moment without saying so."""
        if time_s != self._cursor_s:
            self._cursor_s = time_s
            self._keep_in_sight()
            self.move_cursor()

    def _keep_in_sight(self) -> None:
        """Move the map where the cursor would leave it."""
        if self._ground is None or self._scale is None or not self._zoom:
            return
        place_m = self._ground.place_m(self._cursor_s)
        x, y = self._scale.dots(np.array([place_m[0]]), np.array([place_m[1]]))
        width, height = self.size.width * DOTS_ACROSS, self.size.height * DOTS_DOWN
        if not (0.0 <= x[0] < width and 0.0 <= y[0] < height):
            self._middle_m = place_m
            self.redraw()

    def show_vehicle(self, place_m: tuple[float, float] | None) -> None:
        """Show where the vehicle itself is, east and north of home. [m]"""
        if place_m != self._vehicle_m:
            self._vehicle_m = place_m
            self.move_cursor()

    def mark(
        self, stretch: FlightStretch | None, span_s: tuple[float, float] | None = None
    ) -> None:
        """Mark the stretch of a finding, or the part of the path flown in a span of time."""
        if (stretch, span_s) != (self._stretch, self._span_s):
            self._stretch, self._span_s = stretch, span_s
            self.move_cursor()

    def action_step(self, by: int) -> None:
        """Move the cursor along the path by a hundredth of the flight."""
        if self._ground is not None:
            end_s = float(self._ground.time_s[-1])
            self.point_at(min(max(self._cursor_s + by * end_s / 100.0, 0.0), end_s))
            self.post_message(self.Moved(self._cursor_s))

    def action_zoom(self, by: int) -> None:
        """Double or halve the map about its middle; the first time about the cursor."""
        if self._ground is None or self._scale is None:
            return
        if by > 0 and self._scale.m_per_dot <= _FINEST_M:
            return
        if not self._zoom:
            self._middle_m = self._ground.place_m(self._cursor_s)
        self._zoom = max(self._zoom + by, 0)
        self.redraw()

    def action_fit(self) -> None:
        """Show all there is to draw."""
        self._zoom = 0
        self.redraw()

    def action_pan(self, east: int, north: int) -> None:
        """Move a zoomed map by a quarter of what is in sight."""
        if self._zoom and self._scale is not None:
            across_m = self._scale.m_per_dot * self.size.width * DOTS_ACROSS
            down_m = self._scale.m_per_dot * self.size.height * DOTS_DOWN
            self._middle_m = (
                self._middle_m[0] + east * across_m / 4.0,
                self._middle_m[1] + north * down_m / 4.0,
            )
            self.redraw()

    def on_mouse_scroll_up(self, event: events.MouseScrollUp) -> None:
        """Zoom in."""
        event.stop()
        self.action_zoom(1)

    def on_mouse_scroll_down(self, event: events.MouseScrollDown) -> None:
        """Zoom out."""
        event.stop()
        self.action_zoom(-1)

    def on_click(self, event: events.Click) -> None:
        """Put the cursor on the point of the path nearest to the mouse."""
        if self._ground is None or self._scale is None:
            return
        east_m = self._scale.west_m + (event.x + 0.5) * DOTS_ACROSS * self._scale.m_per_dot
        north_m = self._scale.north_m - (event.y + 0.5) * DOTS_DOWN * self._scale.m_per_dot
        self.point_at(self._ground.time_near(east_m, north_m))
        self.post_message(self.Moved(self._cursor_s))

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return everything but the cursor."""
        canvas, ground = Canvas(columns, rows), self._ground
        self._scale = None
        if ground is None:
            canvas.write(1, 0, "nothing is flown", "axis")
            return canvas
        scale = scale_to_fit(ground.extent_m(), canvas.width, canvas.height)
        if self._zoom:
            scale = scale.about(self._middle_m, 2.0**self._zoom, canvas.width, canvas.height)
        self._scale = scale
        for outline in ground.outlines:
            x, y = scale.dots(outline.east_m, outline.north_m)
            canvas.line(x, y, "inclusion" if outline.is_inclusion else "exclusion")
            if not outline.is_inclusion:  # crossed out, so that no colour is needed
                column, row = int(x.mean()) // DOTS_ACROSS, int(y.mean()) // DOTS_DOWN
                canvas.write(column, row, "✖", "exclusion")
        canvas.line(*scale.dots(ground.east_m, ground.north_m), "curve")
        for mark in ground.marks:
            x, y = scale.dots(np.array([mark.east_m]), np.array([mark.north_m]))
            canvas.write(int(x[0]) // DOTS_ACROSS, int(y[0]) // DOTS_DOWN, mark.letter, "mark")
        self._write_legend(canvas, ground, scale)
        if self._zoom:
            text = f"×{2**self._zoom}, 0: all"
            canvas.write(canvas.columns - len(text), canvas.rows - 1, text, "axis")
        return canvas

    @staticmethod
    def _write_legend(canvas: Canvas, ground: Ground, scale: Scale) -> None:
        length_m = scale_bar_m(scale.m_per_dot, canvas.width // 4)
        bar = "─" * max(round(length_m / scale.m_per_dot / DOTS_ACROSS) - 2, 0)
        canvas.write(0, canvas.rows - 1, f"├{bar}┤ {quantity.distance(length_m)}", "axis")
        if ground.wind.speed_m_s:
            wind = f"wind {wind_arrow(ground.wind)} {quantity.speed(ground.wind.speed_m_s)}"
        else:
            wind = "no wind"
        canvas.write(canvas.columns - len(wind), 0, wind, "axis")
        canvas.write(0, 0, "N↑", "axis")

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw where the vehicle is, and the stretch in question."""
        ground, scale = self._ground, self._scale
        if ground is None or scale is None:
            return
        if self._span_s is not None:
            at = np.linspace(*self._span_s, 200)
            east_m = np.interp(at, ground.time_s, ground.east_m)
            north_m = np.interp(at, ground.time_s, ground.north_m)
            self._draw_stretch(canvas, *scale.dots(east_m, north_m))
        if self._stretch is not None:
            for part_m in ground.stretch_m(self._stretch):
                self._draw_stretch(canvas, *scale.dots(*part_m))
        self._write_at(canvas, ground.place_m(self._cursor_s), scale, "◆")
        if self._vehicle_m is not None:
            self._write_at(canvas, self._vehicle_m, scale, VEHICLE)

    @staticmethod
    def _draw_stretch(canvas: Canvas, x: FloatArray, y: FloatArray) -> None:
        """Draw the stretch in question, a sign at its ends so that no colour is needed."""
        canvas.line(x, y, "stretch")
        for end in (0, -1):
            canvas.write(int(x[end] // DOTS_ACROSS), int(y[end] // DOTS_DOWN), "○", "stretch")

    @staticmethod
    def _write_at(canvas: Canvas, place_m: tuple[float, float], scale: Scale, sign: str) -> None:
        x, y = scale.dots(np.array([place_m[0]]), np.array([place_m[1]]))
        canvas.write(int(x[0] // DOTS_ACROSS), int(y[0] // DOTS_DOWN), sign, "cursor")
