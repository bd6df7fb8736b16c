"""The flight over time: one quantity at a time, with a cursor; which moment and item belong together."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np
from textual.binding import Binding, BindingType

from planner import quantity
from planner.flight.returns.path import return_profile
from planner.tui.widgets.canvas import DOTS_ACROSS, DOTS_DOWN, VEHICLE, Canvas, Drawing
from planner.units import wh_from_j
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from textual import events

    from planner.arrays import FloatArray
    from planner.rules.assessment import Assessment

SAMPLES = 2400
"""Times a flight is looked at, evenly: several to each dot of a wide terminal."""
_MOST_ENDS = 20_000
"""Segments whose ends are looked at besides."""


class Curve(Value, eq=False):
    """One line of a picture."""

    time_s: FloatArray
    value: FloatArray
    name: str = ""
    """Shown on all but the first."""
    ink: str = "curve"


class Picture(Value, eq=False):
    """One quantity over time."""

    name: str
    lines: tuple[Curve, ...]
    """The quantity itself first."""
    shown: Callable[[float | None], str]
    """From a value to its text."""

    def low_high(self) -> tuple[float, float]:
        """Return the range to draw: that of all lines, never nothing, zero within."""
        values = np.concatenate([line.value for line in self.lines])
        low, high = min(float(values.min()), 0.0), max(float(values.max()), 0.0)
        return (low, high) if high > low else (low, low + 1.0)

    def at(self, time_s: float) -> float:
        """Return the quantity at a time."""
        return float(np.interp(time_s, self.lines[0].time_s, self.lines[0].value))


def pictures(assessment: Assessment | None) -> tuple[Picture, ...]:
    """Return the pictures of a flight: altitude, speed, power, energy, charge, as far as known."""
    if assessment is None or not assessment.flight.time_s > 0.0:
        return ()
    flight = assessment.flight
    end_s = flight.motion.segments.end_s
    time_s = np.linspace(0.0, flight.time_s, SAMPLES)
    if len(end_s) <= _MOST_ENDS:
        time_s = np.union1d(time_s, np.clip(end_s, 0.0, flight.time_s))
    state = flight.motion.state_at_time(time_s)

    def single(name: str, value: FloatArray, shown: Callable[[float | None], str]) -> Picture:
        return Picture(name=name, lines=(Curve(time_s=time_s, value=value),), shown=shown)

    found = [
        single("altitude above home", state.height_m, quantity.height),
        single("ground speed", state.ground_speed_m_s, quantity.speed),
    ]
    if not assessment.vehicle.is_power_known:
        return tuple(found)
    found += [
        single("power", flight.power_w(time_s), quantity.power),
        _energy(assessment),
        *_charge(assessment),
    ]
    return tuple(found)


def _used(assessment: Assessment) -> tuple[FloatArray, FloatArray]:
    """Return times and the energy used by then, at the ends of the segments."""
    flight = assessment.flight
    time_s = np.append(0.0, flight.motion.segments.end_s)
    return time_s, np.append(0.0, np.cumsum(wh_from_j(flight.segment_energy_j)))


def _energy(assessment: Assessment) -> Picture:
    time_s, used_wh = _used(assessment)
    home = return_profile(assessment.returns)
    at_home_wh = home.used_wh + home.return_wh
    lines = [
        Curve(time_s=time_s, value=used_wh),
        Curve(name="used and return", time_s=home.time_s, value=at_home_wh, ink="second"),
    ]
    if assessment.battery is not None:
        above_wh = assessment.battery.usable_wh - assessment.battery.reserve_wh
        lines.append(_level("above the reserve", above_wh, assessment.flight.time_s))
    return Picture(name="energy", lines=tuple(lines), shown=quantity.energy)


def _charge(assessment: Assessment) -> Iterator[Picture]:
    """Yield the charge left: of the battery's own curve where it is known, else of its energy."""
    battery = assessment.battery
    if battery is None or not battery.capacity_wh > 0.0:
        return
    time_s, used_wh = _used(assessment)
    if assessment.discharge is None:
        name, left = "energy left in the battery", battery.usable_wh - used_wh
        reserve = battery.reserve_wh / battery.capacity_wh
        lines = [
            Curve(time_s=time_s, value=left / battery.capacity_wh),
            _level("reserve", reserve, assessment.flight.time_s),
        ]
    else:
        name = "charge left in the battery"
        left = np.append(assessment.charge, assessment.discharge.state_of_charge)
        lines = [Curve(time_s=time_s, value=left)]
    yield Picture(name=name, lines=tuple(lines), shown=quantity.percent)


def _level(name: str, value: float, time_s: float) -> Curve:
    return Curve(name=name, time_s=np.array([0.0, time_s]), value=np.full(2, value), ink="limit")


def thinned(
    time_s: FloatArray, value: FloatArray, *, end_s: float, columns: int
) -> tuple[FloatArray, FloatArray]:
    """Return column and value of a line's lowest and highest point in each column of dots.

    Times rise; ``end_s`` is at the right edge.
    """
    x = time_s / end_s * (columns - 1) if end_s > 0.0 else np.zeros(len(time_s))
    if len(x) <= 4 * columns:
        return x, value
    column = np.rint(x)
    first = np.flatnonzero(np.diff(column, prepend=-1.0))
    lowest, highest = np.minimum.reduceat(value, first), np.maximum.reduceat(value, first)
    is_rising = value[first] <= (lowest + highest) / 2.0
    pair = np.stack(
        (np.where(is_rising, lowest, highest), np.where(is_rising, highest, lowest)), axis=1
    )
    return np.repeat(column[first], 2), pair.ravel()


def segment_at(assessment: Assessment, time_s: float) -> int:
    """Return the segment that is flown at a time."""
    end_s = assessment.flight.motion.segments.end_s
    return min(int(np.searchsorted(end_s, time_s, side="right")), len(end_s) - 1)


def segment_span_s(assessment: Assessment, segment: int) -> tuple[float, float]:
    """Return when a segment begins and ends. [s]"""
    columns = assessment.flight.motion.segments
    end_s = float(columns.end_s[segment])
    return end_s - float(columns.duration_s[segment]), end_s


def item_at(assessment: Assessment, time_s: float) -> int:
    """Return the item that is flown for at a time."""
    return int(assessment.flight.motion.segments.item[segment_at(assessment, time_s)])


def item_span_s(assessment: Assessment, item: int) -> tuple[float, float] | None:
    """Return when an item is first flown for, begin and end; ``None`` where it never is. [s]

    An item that only sets something is a moment.
    """
    of_item = np.flatnonzero(assessment.flight.motion.segments.item == item)
    if len(of_item):
        apart = np.flatnonzero(np.diff(of_item) > 1)
        last = of_item[apart[0]] if len(apart) else of_item[-1]
        begins_s, _ = segment_span_s(assessment, int(of_item[0]))
        return begins_s, segment_span_s(assessment, int(last))[1]
    arrival_s = assessment.items[item - 1].arrival_s if 0 < item <= len(assessment.items) else None
    return None if arrival_s is None else (arrival_s, arrival_s)


_LABELS = 9
"""Columns left of the curve."""
_HEADS = 1
_ROOMY = 8
"""Rows from which on marks have a row of their own above the labels of the time."""


def _feet(rows: int) -> int:
    """Return the rows below the curve."""
    return 2 if rows >= _ROOMY else 1


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

    def __init__(self, **options: Any) -> None:  # noqa: ANN401 - of Widget
        super().__init__(**options)
        self._pictures: tuple[Picture, ...] = ()
        self._index = 0
        self._span_s: tuple[float, float] | None = None
        self._vehicle_s: float | None = None

    @property
    def end_s(self) -> float:
        """When the flight ends; 0 where nothing is flown. [s]"""
        return float(self._pictures[0].lines[0].time_s[-1]) if self._pictures else 0.0

    @property
    def picture(self) -> Picture | None:
        """What is shown; ``None`` where nothing is flown."""
        return self._pictures[self._index % len(self._pictures)] if self._pictures else None

    def show(self, pictures: tuple[Picture, ...]) -> None:
        """Show the pictures of another flight, the same quantity of it."""
        self._pictures = pictures
        self.redraw()

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
        self.move_to(self.cursor_s + by * self.end_s / max(self._across(self.size.width) - 1, 1))

    def action_edge(self, end: int) -> None:
        """Move the cursor to the start or the end."""
        self.move_to(end * self.end_s)

    def on_click(self, event: events.Click) -> None:
        """Put the cursor under the mouse."""
        across = max(self._across(self.size.width) - 1, 1)
        self.move_to((event.x - _LABELS) / across * self.end_s)

    @staticmethod
    def _across(columns: int) -> int:
        """Return the columns of the curve."""
        return max(columns - _LABELS, 2)

    def _y(self, canvas: Canvas, value: FloatArray) -> FloatArray:
        picture = self.picture
        low, high = picture.low_high() if picture is not None else (0.0, 1.0)
        down = (canvas.rows - _HEADS - _feet(canvas.rows)) * DOTS_DOWN - 1
        return _HEADS * DOTS_DOWN + (high - value) / (high - low) * down

    def still_canvas(self, columns: int, rows: int) -> Canvas:
        """Return the curve with its axes."""
        canvas = Canvas(columns, rows)
        picture = self.picture
        if picture is None or rows < _HEADS + _feet(rows) + 1:
            canvas.write(1, 0, "nothing is flown", "axis")
            return canvas
        end_s, across = self.end_s, self._across(columns)
        low, high = picture.low_high()
        for row in range(_HEADS, rows - _feet(rows)):
            canvas.write(_LABELS - 1, row, "│", "axis")
        edges = {rows - _feet(rows) - 1: low, _HEADS: high}  # one of them where there is one row
        for row, edge in edges.items():
            canvas.write(0, row, f"{picture.shown(edge):>{_LABELS - 1}}", "axis")
        end = quantity.duration(end_s)
        canvas.write(_LABELS, rows - 1, "0", "axis")
        canvas.write_apart(columns - len(end), rows - 1, end, "axis")
        middle = quantity.duration(end_s / 2.0)
        canvas.write_apart(_LABELS + (across - len(middle)) // 2, rows - 1, middle, "axis")
        for line in reversed(picture.lines):
            x, value = thinned(line.time_s, line.value, end_s=end_s, columns=across * DOTS_ACROSS)
            canvas.line(x + _LABELS * DOTS_ACROSS, self._y(canvas, value), line.ink)
        for line in picture.lines[1:]:
            self._label_curve(canvas, line)
        return canvas

    def _label_curve(self, canvas: Canvas, curve: Curve) -> None:
        """Write the name of a curve beside it where there is room, so that no colour is needed."""
        text = f"─ {curve.name}"
        across = self._across(canvas.columns)
        lowest = canvas.rows - _feet(canvas.rows) - 1
        for column in range(1, across - len(text), 2):
            at = float(np.interp(self.end_s * column / across, curve.time_s, curve.value))
            row = int(self._y(canvas, np.array([at]))[0]) // DOTS_DOWN
            for beside in (row - 1, row + 1):
                is_inside = _HEADS <= beside <= lowest
                if is_inside and canvas.write_apart(_LABELS + column, beside, text, curve.ink):
                    return

    def draw_cursor(self, canvas: Canvas) -> None:
        """Draw the moment, the value there and the marked stretch."""
        picture, end_s = self.picture, self.end_s
        if picture is None or not end_s > 0.0 or canvas.rows < _HEADS + _feet(canvas.rows) + 1:
            return
        across, marks = self._across(canvas.columns), canvas.rows - _feet(canvas.rows)
        if self._span_s is not None:
            line, span_s = picture.lines[0], self._span_s
            inside = (line.time_s >= span_s[0]) & (line.time_s <= span_s[1])
            x = _LABELS * DOTS_ACROSS + line.time_s[inside] / end_s * (across * DOTS_ACROSS - 1)
            canvas.line(x, self._y(canvas, line.value[inside]), "stretch")
            first, last = (_LABELS + round(time_s / end_s * (across - 1)) for time_s in span_s)
            for column in range(first, last + 1):
                canvas.write(column, marks, "▔", "stretch", only_blank=True)
        column = _LABELS + round(self.cursor_s / end_s * (across - 1))
        for row in range(_HEADS, marks):
            canvas.write(column, row, "┊", "cursor", only_blank=True)
        value = picture.at(self.cursor_s)
        row = int(self._y(canvas, np.array([value]))[0]) // DOTS_DOWN
        canvas.write(column, min(max(row, _HEADS), marks - 1), "◆", "cursor")
        if self._vehicle_s is not None:
            column = _LABELS + round(self._vehicle_s / end_s * (across - 1))
            canvas.write(column, marks, VEHICLE, "cursor")
        text = f"{picture.name}: {picture.shown(value)} at {quantity.duration(self.cursor_s)}"
        hint = "  (p: next)" if len(self._pictures) > 1 else ""
        text += hint if len(text) + len(hint) < canvas.columns else ""
        canvas.write(1, 0, text, "cursor")
