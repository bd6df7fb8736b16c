"""A fleet over time on the terminal: who has what and when, and the ground below all tracks."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from textual.binding import Binding, BindingType

from planner import quantity
from planner.report.tables import fleet_outlines
from planner.tui.widgets.canvas import Canvas, Drawing
from planner.tui.widgets.ground_map import Mark, Outline, extent_m
from planner.values import Value

if TYPE_CHECKING:
    from textual import events

    from planner.arrays import FloatArray
    from planner.physics.wind import Wind
    from planner.service.fleet import FleetResult
    from planner.service.fleet_timeline import FleetTimeline, Track

SIGNS = "123456789abcdefghijklmnopqrstuvwxyz"
"""Of the vehicles, in the order of the fleet; more than these have the last."""
USE_SIGNS = {"flight": "█", "swap": "░", "charge": "▒", "stand": "·"}
_USE_INKS = {"flight": "curve", "swap": "second", "charge": "inclusion", "stand": "axis"}
_USE_WORDS = {"flight": "in flight", "swap": "pack change", "charge": "charging", "stand": "on pad"}
_CROSS = "✖"
_MOST_LABEL = 18
_LEAST_BARS = 30
"""Columns for the bars, before names are cut."""
_BELOW = 2
"""Lines below the rows: the time, and what the signs are."""


def sign(number: int) -> str:
    """Return the sign of a vehicle."""
    return SIGNS[min(number, len(SIGNS) - 1)]


class FleetGround(Value, eq=False):
    """What lies under all flights of a fleet."""

    timeline: FleetTimeline
    outlines: tuple[Outline, ...]
    marks: tuple[Mark, ...]
    wind: Wind | None
    """``None``: it is not the same for all."""

    @property
    def end_s(self) -> float:
        """When the operation ends. [s]"""
        return self.timeline.end_s

    @property
    def tracks_m(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """East and north of what is flown. (n,) [m]"""
        return tuple((one.place_m[:, 0], one.place_m[:, 1]) for one in self.timeline.tracks)

    def vehicles_at(self, time_s: float) -> tuple[tuple[str, tuple[float, float]], ...]:
        """Return a sign for each vehicle, and where it is at a time; those in the air last. [m]"""
        found = [
            (track.is_flying(time_s), sign(number), track.place_at(time_s)[:2])
            for number, track in enumerate(self.timeline.vehicles_at(time_s))
        ]
        return tuple((one, place_m) for _, one, place_m in sorted(found))

    def place_m(self, time_s: float) -> tuple[float, float]:
        """Return where one of those in the air is at a time. [m]"""
        return self.vehicles_at(time_s)[-1][1]

    def time_near(self, east_m: float, north_m: float) -> float:
        """Return when a vehicle is nearest to a place. [s]"""

        def nearest(one: Track) -> tuple[float, float]:
            away_m = np.hypot(one.place_m[:, 0] - east_m, one.place_m[:, 1] - north_m)
            return float(away_m.min()), float(one.time_s[away_m.argmin()])

        return min(map(nearest, self.timeline.tracks))[1]

    def extent_m(self) -> tuple[float, float, float, float]:
        """Return west, south, east and north ends of all there is to draw. [m]"""
        return extent_m(self.tracks_m, (*self.outlines, *self.marks))


def fleet_ground(result: FleetResult, timeline: FleetTimeline) -> FleetGround | None:
    """Return the ground of a fleet; ``None`` where nothing is flown."""
    frame = timeline.frame
    if frame is None:
        return None
    winds = {one.assessment.setup.wind for one in result.sorties if one.assessment is not None}
    pads: list[tuple[Any, Any]] = [
        frame.east_north_m(one.latitude_deg, one.longitude_deg)
        for one in result.fleet.pads.values()
    ]
    homes = [tuple(one.place_m[0, :2]) for one in timeline.tracks if not pads]
    crosses = [one.place_m for one in timeline.marks if one.place_m is not None]
    return FleetGround(
        timeline=timeline,
        outlines=tuple(
            Outline(is_inclusion=is_inside, east_m=east_m, north_m=north_m)
            for is_inside, east_m, north_m in fleet_outlines(result, frame)
        ),
        marks=tuple(
            Mark(letter=letter, east_m=float(east_m), north_m=float(north_m))
            for letter, (east_m, north_m) in (
                *(("H", place_m) for place_m in (*pads, *homes)),
                *((_CROSS, place_m) for place_m in crosses),
            )
        ),
        wind=winds.pop() if len(winds) == 1 else None,
    )


class FleetPlot(Drawing):
    """Vehicles, packs, chargers and pads over time, a line each, with what is found of them."""

    BINDINGS: ClassVar[list[BindingType]] = [
        Binding("up,k", "scroll_rows(-1)", "Up", show=False),
        Binding("down,j", "scroll_rows(1)", "Down", show=False),
    ]

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self._timeline: FleetTimeline | None = None
        self._top = 0
        self._label = 0

    @property
    def end_s(self) -> float:
        """When the operation ends; 0 where nothing is flown. [s]"""
        return 0.0 if self._timeline is None else self._timeline.end_s

    def show(self, timeline: FleetTimeline) -> None:
        """Show another fleet."""
        self._timeline = timeline
        self.redraw()

    def action_scroll_rows(self, by: int) -> None:
        """Show rows that there is no room for."""
        if self._timeline is not None:
            hidden = len(self._timeline.rows) - (self.size.height - _BELOW)
            self._top = min(max(self._top + by, 0), max(hidden, 0))
            self.redraw()

    def on_click(self, event: events.Click) -> None:
        """Put the cursor on the moment under the mouse."""
        bars = self.size.width - self._label
        if bars > 0:
            self.move_to((event.x - self._label + 0.5) / bars * self.end_s)

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return everything but the cursor."""
        canvas, timeline = Canvas(columns, rows), self._timeline
        if timeline is None or not timeline.rows:
            canvas.write(1, 0, "nothing is flown", "axis")
            return canvas
        names = [f"{row.kind} {row.name}" for row in timeline.rows]
        widest = min(max(map(len, names)), _MOST_LABEL, max(columns - _LEAST_BARS, 0))
        self._label = widest + 1
        shown = range(self._top, min(self._top + rows - _BELOW, len(names)))
        for line, number in enumerate(shown):
            canvas.write(0, line, names[number][-widest:], "axis")
            for span in timeline.rows[number].spans:
                first, last = self._column(span.start_s, columns), self._column(span.end_s, columns)
                width = max(last - first, 1)
                canvas.write(first, line, USE_SIGNS[span.use] * width, _USE_INKS[span.use])
                if len(span.name) + 2 <= width:
                    canvas.write(first + 1, line, span.name, "mark")
            for mark in timeline.marks:
                if number in mark.rows:
                    canvas.write(self._column(mark.at_s, columns), line, _CROSS, "exclusion")
        self._write_axis(canvas, timeline, len(shown), hidden=len(names) - len(shown))
        return canvas

    def _write_axis(
        self, canvas: Canvas, timeline: FleetTimeline, line: int, *, hidden: int
    ) -> None:
        end = quantity.clock(timeline.end_s)
        canvas.write(self._label, line, quantity.clock(0.0), "axis")
        canvas.write_apart(canvas.columns - len(end), line, end, "axis")
        used = {span.use for row in timeline.rows for span in row.spans}
        legend = [f"{USE_SIGNS[use]} {_USE_WORDS[use]}" for use in USE_SIGNS if use in used]
        legend += [f"{_CROSS} finding"] if timeline.marks else []
        legend += [f"↑↓ {hidden} more"] if hidden else []
        canvas.write(0, line + 1, "  ".join(legend), "axis")

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw a line through all rows."""
        if self._timeline is None:
            return
        column = self._column(self.cursor_s, canvas.columns)
        for line in range(min(len(self._timeline.rows), canvas.rows - _BELOW)):
            canvas.strike(column, line, "│", "cursor")

    def _column(self, time_s: float, columns: int) -> int:
        """Return the column of a time."""
        bars = columns - self._label - 1
        return self._label + round(time_s / max(self.end_s, 1e-9) * bars)
