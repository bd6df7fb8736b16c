"""Manoeuvres of a flight without references: how long each took, for how far.

Some vehicles log no references.  What their autopilots do can then be told from the motion alone, as
manoeuvres one after the other: the take-off until the first leg begins, each level leg with the standstill
before it, the landing from the last standstill to the end of the flight.  Their durations together are
the flight.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.identify.states import run_bounds

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

MOVING_M_S = 1.0
"""Slower is standing: wind pushes a hovering vehicle about at half of that. [m s⁻¹]"""
_BRAKING_S = 6.0
"""No vehicle of level legs brakes for longer. [s]"""
STOPPING_SHARE = 0.98
"""Of the speed held: a stop is measured from there on. [-]"""
_LEAST_LEG_M = 30.0
_KNOWN = 0.9
"""Share of the flight that speed and height must be known for. [-]"""
OFF_GROUND_M = 0.5
"""Height at which a take-off, or a landing, is seen. [m]"""
_LOW_M = (1.0, 8.0)
_MEAN_SAMPLES = 10
_LEVEL_SHARE = 0.2
"""A flight is level between its first and last leg to this share of its height. [-]"""
_SMOOTHING_S = 1.0
_COMMANDED_PERCENTILE = 80.0
"""Of the speeds above half of the highest: commanded speeds are held for most of a leg."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedLeg:
    """A level leg with the standstill before it."""

    log: str
    flight: int
    start_s: float
    """End of the leg before, or of the wait after the take-off. [s]"""
    duration_s: float
    """Until it stands again. [s]"""
    length_m: float
    speed_m_s: float
    """Speed held. [m s⁻¹]"""
    stopping_distance_m: float
    """From 98 % of the speed it brakes from. [m]"""
    stopped_from_m_s: float
    """Highest speed shortly before it stands: gusts and dips make it another one. [m s⁻¹]"""

    @property
    def label(self) -> str:
        """What it is called in a report."""
        return f"leg {self.length_m:.0f} m at {self.speed_m_s:.1f} m/s"

    @property
    def lost_s(self) -> float:
        """Time beyond that of its length at its speed. [s]"""
        return self.duration_s - self.length_m / self.speed_m_s


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedChange:
    """A take-off until the first leg begins, or a landing until the motors stand."""

    log: str
    flight: int
    start_s: float
    duration_s: float
    rise_m: float
    """Negative for a landing. [m]"""
    ground_s: float
    """Part of it spent on the ground. [s]"""
    low_speed_m_s: float
    """Speed near the ground, from 8 m to 1 m above it or the other way, positive. [m s⁻¹]"""

    @property
    def label(self) -> str:
        """What it is called in a report."""
        return f"{'take-off' if self.rise_m > 0.0 else 'landing'} {abs(self.rise_m):.0f} m"


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedFlight:
    """The manoeuvres of one flight, where it is a take-off, legs and a landing one after the other."""

    log: str
    flight: int
    refusal: str = ""
    """Why it is no such flight; the rest is empty then."""
    takeoff_and_landing: tuple[TimedChange, TimedChange] | None = None
    legs: tuple[TimedLeg, ...] = ()

    @property
    def takeoff(self) -> TimedChange:
        """The take-off of a flight that is not refused."""
        assert self.takeoff_and_landing is not None
        return self.takeoff_and_landing[0]

    @property
    def landing(self) -> TimedChange:
        """The landing of a flight that is not refused."""
        assert self.takeoff_and_landing is not None
        return self.takeoff_and_landing[1]


def timed_flight(record: FlightRecord) -> TimedFlight:
    """Return the manoeuvres of a flight that takes off, flies level legs, and lands.

    Parameters
    ----------
    record : FlightRecord
        One flight, from standing motors to standing motors.

    Returns
    -------
    TimedFlight
        Its manoeuvres, or why it is no such flight.
    """
    speed, height = record.ground_speed_m_s, record.height_above_home_m
    known = np.isfinite(speed) & np.isfinite(height)

    def refused(why: str) -> TimedFlight:
        return TimedFlight(log=record.source, flight=record.number, refusal=why)

    if known.mean() < _KNOWN:
        return refused("speed or height is not known throughout")
    time_s = record.time_s
    step_s = float(time_s[1] - time_s[0])
    smooth = _smoothed(np.interp(time_s, time_s[known], speed[known]), round(_SMOOTHING_S / step_s))
    bounds = _legs(record, smooth)
    if not bounds:
        return refused("no level leg")
    level = height[bounds[0][0] : bounds[-1][1]]
    level_m = float(np.nanmedian(level))
    if level_m < _LOW_M[1] or np.nanmax(np.abs(level - level_m)) > _LEVEL_SHARE * level_m:
        return refused("climbs or descends between its legs")
    filled = np.interp(time_s, time_s[known], height[known])
    if level_m - max(filled[0], filled[-1]) < _LOW_M[1]:
        return refused("does not begin and end on the ground")
    legs = []
    for index, (begin, end) in enumerate(bounds):
        since = begin if index == 0 else bounds[index - 1][1]
        legs.append(_timed_leg(record, smooth, since, begin, end))
    return TimedFlight(
        log=record.source,
        flight=record.number,
        takeoff_and_landing=(
            _takeoff(record, filled, bounds[0][0]),
            _landing(record, filled, bounds[-1][1]),
        ),
        legs=tuple(legs),
    )


def _takeoff(record: FlightRecord, height: FloatArray, end: int) -> TimedChange:
    above = height[: end + 1] - height[0]
    return TimedChange(
        log=record.source,
        flight=record.number,
        start_s=0.0,
        duration_s=float(record.time_s[end]),
        rise_m=float(above[max(end - _MEAN_SAMPLES, 0) :].mean()),
        ground_s=float(record.time_s[int(np.argmax(above > OFF_GROUND_M))]),
        low_speed_m_s=_low_speed_m_s(above, record),
    )


def _landing(record: FlightRecord, height: FloatArray, begin: int) -> TimedChange:
    above = height[begin:] - height[-1]
    touched = begin + int(np.flatnonzero(above > OFF_GROUND_M)[-1])
    return TimedChange(
        log=record.source,
        flight=record.number,
        start_s=float(record.time_s[begin]),
        duration_s=record.duration_s - float(record.time_s[begin]),
        rise_m=-float(above[:_MEAN_SAMPLES].mean()),
        ground_s=record.duration_s - float(record.time_s[touched]),
        low_speed_m_s=_low_speed_m_s(above[::-1], record),
    )


def _low_speed_m_s(above: FloatArray, record: FlightRecord) -> float:
    """Return the speed from 1 m to 8 m above the ground, of heights counted from the ground on."""
    low, high = _LOW_M
    samples = int(np.argmax(above > high)) - int(np.argmax(above > low))
    step_s = float(record.time_s[1] - record.time_s[0])
    return (high - low) / (max(samples, 1) * step_s)


def _smoothed(column: FloatArray, window: int) -> FloatArray:
    weights = np.ones(2 * (window // 2) + 1)
    counts = np.convolve(np.ones(column.size), weights, mode="same")
    return np.convolve(column, weights, mode="same") / counts


def _legs(record: FlightRecord, speed: FloatArray) -> list[tuple[int, int]]:
    """Return the first samples, and those after the last, of the stretches far enough for a leg."""
    moving = speed > MOVING_M_S
    step_s = float(record.time_s[1] - record.time_s[0])
    found = []
    for begin, end in zip(*(bound.tolist() for bound in run_bounds(moving)), strict=True):
        if moving[begin] and speed[begin:end].sum() * step_s > _LEAST_LEG_M:
            found.append((begin, min(end, speed.size - 1)))
    return found


def _timed_leg(
    record: FlightRecord, speed: FloatArray, since: int, begin: int, end: int
) -> TimedLeg:
    time_s = record.time_s
    flown = speed[begin:end]
    held = float(np.percentile(flown[flown > 0.5 * flown.max()], _COMMANDED_PERCENTILE))
    step_s = float(time_s[1] - time_s[0])
    tail = flown[-round(_BRAKING_S / step_s) :]
    braked_from = float(tail.max())
    brake = end - int(np.argmax(flown[::-1] >= STOPPING_SHARE * braked_from)) - 1
    return TimedLeg(
        log=record.source,
        flight=record.number,
        start_s=float(time_s[since]),
        duration_s=float(time_s[end] - time_s[since]),
        length_m=float(np.trapezoid(speed[since : end + 1], time_s[since : end + 1])),
        speed_m_s=held,
        stopping_distance_m=float(np.trapezoid(speed[brake : end + 1], time_s[brake : end + 1])),
        stopped_from_m_s=braked_from,
    )
