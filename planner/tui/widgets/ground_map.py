"""The flight from above, north up, in metres east and north of home."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from textual.binding import Binding, BindingType

from planner import quantity
from planner.report.tables import fence_outlines, place_rows
from planner.tui.widgets.canvas import DOTS_ACROSS, DOTS_DOWN, VEHICLE, Canvas, Drawing
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from textual import events

    from planner.arrays import FloatArray
    from planner.findings import FlightStretch
    from planner.geo.geodesy import LocalFrame
    from planner.physics.wind import Wind
    from planner.rules.assessment import Assessment
    from planner.tui.widgets.fleet_plots import FleetGround


_SAMPLES = 3000
_MOST_ENDS = 50_000
_ARROWS = "↓↙←↖↑↗→↘"
"""Where a wind from north, north-east, … blows to."""


class Outline(Value, eq=False):
    """A closed line: a part of the fence."""

    is_inclusion: bool
    east_m: FloatArray
    north_m: FloatArray


class Mark(Value):
    """A place with a letter: home or a rally point."""

    letter: str
    east_m: float
    north_m: float


class Ground(Value, eq=False):
    """What lies under a flight."""

    time_s: FloatArray
    east_m: FloatArray
    north_m: FloatArray
    """Places of the vehicle at those times. (n,) [m]"""
    outlines: tuple[Outline, ...]
    marks: tuple[Mark, ...]
    frame: LocalFrame
    wind: Wind

    @property
    def end_s(self) -> float:
        """When the flight ends. [s]"""
        return float(self.time_s[-1])

    @property
    def tracks_m(self) -> tuple[tuple[FloatArray, FloatArray], ...]:
        """East and north of what is flown. (n,) [m]"""
        return ((self.east_m, self.north_m),)

    def vehicles_at(self, time_s: float) -> tuple[tuple[str, tuple[float, float]], ...]:
        """Return a sign for each vehicle, and where it is at a time. [m]"""
        return (("◆", self.place_m(time_s)),)

    def place_m(self, time_s: float) -> tuple[float, float]:
        """Return where the vehicle is at a time, east and north. [m]"""
        return (
            float(np.interp(time_s, self.time_s, self.east_m)),
            float(np.interp(time_s, self.time_s, self.north_m)),
        )

    def extent_m(self) -> tuple[float, float, float, float]:
        """Return west, south, east and north ends of all there is to draw. [m]"""
        return extent_m(self.tracks_m, (*self.outlines, *self.marks))

    def stretch_m(self, stretch: FlightStretch) -> list[tuple[FloatArray, FloatArray]]:
        """Return the parts of a finding's stretch, east and north of each. (n,) [m]"""
        return [
            self.frame.east_north_m(*zip(*line_deg, strict=True)) for line_deg in stretch.lines_deg
        ]

    def at_m(self, latitude_deg: float, longitude_deg: float) -> tuple[float, float]:
        """Return where a place is, east and north. [m]"""
        east_m, north_m = self.frame.east_north_m([latitude_deg], [longitude_deg])
        return float(east_m[0]), float(north_m[0])

    def stretch_span_s(
        self, stretch: FlightStretch, within_s: tuple[float, float]
    ) -> tuple[float, float]:
        """Return when the ends of a stretch are flown, in a span of time; of a spot, a moment. [s]"""
        inside = (self.time_s >= within_s[0]) & (self.time_s <= within_s[1])
        if not inside.any():
            return within_s
        times_s = [
            float(
                self.time_s[inside][
                    np.argmin(np.hypot(self.east_m - east_m, self.north_m - north_m)[inside])
                ]
            )
            for east_m, north_m in (self.at_m(*stretch.start_deg), self.at_m(*stretch.end_deg))
        ]
        return min(times_s), max(times_s)

    def time_near(self, east_m: float, north_m: float) -> float:
        """Return when the vehicle is nearest to a place. [s]"""
        nearest = np.argmin(np.hypot(self.east_m - east_m, self.north_m - north_m))
        return float(self.time_s[nearest])


def extent_m(
    tracks_m: Sequence[tuple[FloatArray, FloatArray]], drawn: Sequence[Outline | Mark]
) -> tuple[float, float, float, float]:
    """Return west, south, east and north ends of tracks and of what else is drawn. [m]"""
    places_m = [*tracks_m, *((one.east_m, one.north_m) for one in drawn)]
    east_m, north_m = (
        np.concatenate([np.atleast_1d(place_m[axis]) for place_m in places_m]) for axis in (0, 1)
    )
    return float(east_m.min()), float(north_m.min()), float(east_m.max()), float(north_m.max())


def ground(assessment: Assessment | None) -> Ground | None:
    """Return the ground of a flight; ``None`` where nothing is flown."""
    if assessment is None or not assessment.flight.time_s > 0.0:
        return None
    flight, frame = assessment.flight, assessment.route.frame
    time_s = np.linspace(0.0, flight.time_s, _SAMPLES)
    end_s = flight.motion.segments.end_s
    if len(end_s) <= _MOST_ENDS:
        time_s = np.union1d(time_s, np.clip(end_s, 0.0, flight.time_s))
    state = flight.motion.state_at_time(time_s)
    return Ground(
        time_s=time_s,
        east_m=np.asarray(state.east_m, dtype=np.float64),
        north_m=np.asarray(state.north_m, dtype=np.float64),
        outlines=tuple(
            Outline(is_inclusion=is_inside, east_m=east_m, north_m=north_m)
            for is_inside, east_m, north_m in fence_outlines(assessment)
        ),
        marks=tuple(
            Mark(letter=row["short"][0], east_m=row["east_m"], north_m=row["north_m"])
            for row in place_rows(assessment)
        ),
        frame=frame,
        wind=assessment.setup.wind,
    )


def wind_arrow(wind: Wind) -> str:
    """Return an arrow that points where the wind blows to, north being up."""
    return _ARROWS[round(wind.from_deg / 45.0) % 8]


class Scale(Value):
    """How ground becomes dots of a canvas: north up, as many metres across as down."""

    west_m: float
    north_m: float
    m_per_dot: float

    def dots(self, east_m: FloatArray, north_m: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places as dots of the canvas, y downwards."""
        return (east_m - self.west_m) / self.m_per_dot, (self.north_m - north_m) / self.m_per_dot

    def about(self, place_m: tuple[float, float], factor: float, width: int, height: int) -> Scale:
        """Return the scale that shows a place in the middle of so many dots, larger by a factor."""
        m_per_dot = self.m_per_dot / factor
        return Scale(
            west_m=place_m[0] - m_per_dot * (width - 1) / 2.0,
            north_m=place_m[1] + m_per_dot * (height - 1) / 2.0,
            m_per_dot=m_per_dot,
        )


def scale_to_fit(extent_m: tuple[float, float, float, float], width: int, height: int) -> Scale:
    """Return the scale that shows an extent in the middle of so many dots, with a border."""
    west_m, south_m, east_m, north_m = extent_m
    across, down = max(width - 5, 1), max(height - 5, 1)
    m_per_dot = max((east_m - west_m) / across, (north_m - south_m) / down, 0.01)
    middle_m = (west_m + east_m) / 2.0, (north_m + south_m) / 2.0
    return Scale(west_m=0.0, north_m=0.0, m_per_dot=m_per_dot).about(middle_m, 1.0, width, height)


def scale_bar_m(m_per_dot: float, dots: int) -> float:
    """Return the longest of 1, 2, 5, 10, … metres that takes at most so many dots. [m]"""
    most_m = m_per_dot * dots
    power = 10.0 ** math.floor(math.log10(most_m))
    return max(step * power for step in (1.0, 2.0, 5.0) if step * power <= most_m * (1 + 1e-9))


_TRACK_INKS = ("curve", "second")
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

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self._ground: Ground | FleetGround | None = None
        self._stretch: FlightStretch | None = None
        self._span_s: tuple[float, float] | None = None
        self._scale: Scale | None = None
        self._vehicle_m: tuple[float, float] | None = None
        self._zoom = 0
        """How many times the map is doubled; 0: all there is to draw is in sight."""
        self._middle_m = (0.0, 0.0)
        """What is in the middle of a map that is zoomed, east and north. [m]"""

    @property
    def end_s(self) -> float:
        """When the flight ends; 0 where nothing is flown. [s]"""
        return 0.0 if self._ground is None else self._ground.end_s

    def show(self, ground: Ground | FleetGround | None) -> None:
        """Show another flight, or those of a fleet."""
        self._ground = ground
        self.redraw()

    def point_at(self, time_s: float) -> None:
        """Put the cursor on a moment without saying so; the map moves where it would leave it."""
        super().point_at(time_s)
        if self._ground is None or self._scale is None or not self._zoom:
            return
        place_m = self._ground.place_m(self.cursor_s)
        column, row = _cell(place_m, self._scale)
        if not (0 <= column < self.size.width and 0 <= row < self.size.height):
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
        self.move_to(self.cursor_s + by * self.end_s / 100.0)

    def action_zoom(self, by: int) -> None:
        """Double or halve the map about its middle; the first time about the cursor."""
        if self._ground is None or self._scale is None:
            return
        if by > 0 and self._scale.m_per_dot <= _FINEST_M:
            return
        if not self._zoom:
            self._middle_m = self._ground.place_m(self.cursor_s)
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
        self.move_to(self._ground.time_near(east_m, north_m))

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
        for number, track_m in enumerate(ground.tracks_m):
            canvas.line(*scale.dots(*track_m), _TRACK_INKS[number % len(_TRACK_INKS)])
        for mark in ground.marks:
            canvas.write(*_cell((mark.east_m, mark.north_m), scale), mark.letter, "mark")
        self._write_legend(canvas, ground, scale)
        if self._zoom:
            text = f"×{2**self._zoom}, 0: all"
            for row in (canvas.rows - 1, canvas.rows - 2):
                if canvas.write_apart(canvas.columns - len(text), row, text, "axis"):
                    break
        return canvas

    @staticmethod
    def _write_legend(canvas: Canvas, ground: Ground | FleetGround, scale: Scale) -> None:
        length_m = scale_bar_m(scale.m_per_dot, canvas.width // 4)
        bar = "─" * max(round(length_m / scale.m_per_dot / DOTS_ACROSS) - 2, 0)
        canvas.write(0, canvas.rows - 1, f"├{bar}┤ {quantity.distance(length_m)}", "axis")
        if ground.wind is None:
            wind = ""
        elif ground.wind.speed_m_s:
            wind = f"wind {wind_arrow(ground.wind)} {quantity.speed(ground.wind.speed_m_s)}"
        else:
            wind = "no wind"
        canvas.write(0, 0, "N↑", "axis")
        canvas.write_apart(canvas.columns - len(wind), 0, wind, "axis")

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw where the vehicle is, and the stretch in question."""
        ground, scale = self._ground, self._scale
        if ground is None or scale is None:
            return
        if self._span_s is not None and isinstance(ground, Ground):
            at = np.linspace(*self._span_s, 200)
            east_m = np.interp(at, ground.time_s, ground.east_m)
            north_m = np.interp(at, ground.time_s, ground.north_m)
            self._draw_stretch(canvas, *scale.dots(east_m, north_m))
        if self._stretch is not None and isinstance(ground, Ground):
            for part_m in ground.stretch_m(self._stretch):
                self._draw_stretch(canvas, *scale.dots(*part_m))
        for sign, place_m in ground.vehicles_at(self.cursor_s):
            canvas.write(*_cell(place_m, scale), sign, "cursor")
        if self._vehicle_m is not None:
            canvas.write(*_cell(self._vehicle_m, scale), VEHICLE, "cursor")

    @staticmethod
    def _draw_stretch(canvas: Canvas, x: FloatArray, y: FloatArray) -> None:
        """Draw the stretch in question, a sign at its ends so that no colour is needed."""
        canvas.line(x, y, "stretch")
        for end in (0, -1):
            canvas.write(int(x[end] // DOTS_ACROSS), int(y[end] // DOTS_DOWN), "○", "stretch")


def _cell(place_m: tuple[float, float], scale: Scale) -> tuple[int, int]:
    """Return column and row of a place."""
    x, y = scale.dots(*np.array(place_m))
    return int(x // DOTS_ACROSS), int(y // DOTS_DOWN)
