"""The quantities of a flight over time, as curves; which moment, segment and item belong together."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.flight.returns.path import return_profile
from planner.units import wh_from_j
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import FloatArray
    from planner.rules.assessment import Assessment


SAMPLES = 2400
"""Times a flight is looked at, evenly: several to each dot of a wide terminal."""
_MOST_ENDS = 20_000
"""Segments whose ends are looked at besides."""


class Curve(Value, eq=False):
    """One line of a picture."""

    name: str
    time_s: FloatArray
    value: FloatArray
    ink: str


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
    found = [
        Picture(
            name="altitude above home",
            lines=(Curve(name="altitude", time_s=time_s, value=state.height_m, ink="curve"),),
            shown=quantity.height,
        ),
        Picture(
            name="ground speed",
            lines=(Curve(name="speed", time_s=time_s, value=state.ground_speed_m_s, ink="curve"),),
            shown=quantity.speed,
        ),
    ]
    if not assessment.vehicle.is_power_known:
        return tuple(found)
    power = Curve(name="power", time_s=time_s, value=flight.power_w(time_s), ink="curve")
    found.append(Picture(name="power", lines=(power,), shown=quantity.power))
    found.append(_energy(assessment))
    if (charge := _charge(assessment)) is not None:
        found.append(charge)
    return tuple(found)


def _used(assessment: Assessment) -> tuple[FloatArray, FloatArray]:
    """Return times and the energy used by then, at the ends of the segments."""
    flight = assessment.flight
    time_s = np.append(0.0, flight.motion.segments.end_s)
    return time_s, np.append(0.0, np.cumsum(wh_from_j(flight.segment_energy_j)))


def _energy(assessment: Assessment) -> Picture:
    time_s, used_wh = _used(assessment)
    lines = [Curve(name="used", time_s=time_s, value=used_wh, ink="curve")]
    home = return_profile(assessment.returns)
    lines.append(
        Curve(
            name="used and return",
            time_s=home.time_s,
            value=home.used_wh + home.return_wh,
            ink="second",
        )
    )
    if assessment.battery is not None:
        above_wh = assessment.battery.usable_wh - assessment.battery.reserve_wh
        lines.append(_level("above the reserve", above_wh, assessment.flight.time_s))
    return Picture(name="energy", lines=tuple(lines), shown=quantity.energy)


def _charge(assessment: Assessment) -> Picture | None:
    """Return the charge left: of the battery's own curve where it is known, else of its energy."""
    battery = assessment.battery
    if battery is None or not battery.capacity_wh > 0.0:
        return None
    time_s, used_wh = _used(assessment)
    if assessment.discharge is None:
        name, left = "energy left in the battery", battery.usable_wh - used_wh
        left = left / battery.capacity_wh
    else:
        name = "charge left in the battery"
        left = np.append(assessment.charge, assessment.discharge.state_of_charge)
    lines = [Curve(name="left", time_s=time_s, value=left, ink="curve")]
    if assessment.discharge is None:
        share = battery.reserve_wh / battery.capacity_wh
        lines.append(_level("reserve", share, assessment.flight.time_s))
    return Picture(name=name, lines=tuple(lines), shown=quantity.percent)


def _level(name: str, value: float, time_s: float) -> Curve:
    return Curve(name=name, time_s=np.array([0.0, time_s]), value=np.full(2, value), ink="limit")


def thinned(
    time_s: FloatArray, value: FloatArray, *, end_s: float, columns: int
) -> tuple[FloatArray, FloatArray]:
    """Return a line with at most two points a column: its lowest and highest there.

    Parameters
    ----------
    time_s, value : ndarray
        The line, times rising. (n,)
    end_s : float
        Time at the right edge. [s]
    columns : int
        Columns of dots.

    Returns
    -------
    x, value : ndarray
        Column and value of each point kept.
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
        return segment_span_s(assessment, int(of_item[0]))[0], segment_span_s(
            assessment, int(last)
        )[1]
    arrival_s = assessment.items[item - 1].arrival_s if 0 < item <= len(assessment.items) else None
    return None if arrival_s is None else (arrival_s, arrival_s)
