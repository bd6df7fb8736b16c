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

_MOVING_M_S = 1.0
"""Slower is standing: wind pushes a hovering vehicle about at half of that. [m s⁻¹]"""
_LEAST_LEG_M = 30.0
_LEAST_LEGS = 1
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
    """From 98 % of that speed. [m]"""

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


@dataclass(frozen=True, slots=True, kw_only=True)
class TimedFlight:
    """The manoeuvres of one flight; empty where it is not one after the other."""

    changes: tuple[TimedChange, ...] = ()
    legs: tuple[TimedLeg, ...] = ()
    refusal: str = ""
    """Why there are none."""


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
    if known.mean() < 0.9:
        return TimedFlight(refusal="speed or height is not known throughout")
    time_s = record.time_s
    step_s = float(time_s[1] - time_s[0])
    smooth = _smoothed(np.interp(time_s, time_s[known], speed[known]), round(_SMOOTHING_S / step_s))
    bounds = _legs(record, smooth)
    if len(bounds) < _LEAST_LEGS:
        return TimedFlight(refusal="no level leg")
    level = height[bounds[0][0] : bounds[-1][1]]
    level_m = float(np.nanmedian(level))
    if np.nanmax(np.abs(level - level_m)) > _LEVEL_SHARE * abs(level_m):
        return TimedFlight(refusal="climbs or descends between its legs")
    first, last = bounds[0][0], bounds[-1][1]
    legs = []
    for index, (begin, end) in enumerate(bounds):
        since = begin if index == 0 else bounds[index - 1][1]
        legs.append(_timed_leg(record, smooth, since, begin, end))
    takeoff = TimedChange(
        log=record.source,
        flight=record.number,
        start_s=0.0,
        duration_s=float(time_s[first]),
        rise_m=float(np.nanmean(height[max(first - 10, 0) : first + 1])),
    )
    landing = TimedChange(
        log=record.source,
        flight=record.number,
        start_s=float(time_s[last]),
        duration_s=record.duration_s - float(time_s[last]),
        rise_m=-float(np.nanmean(height[last : last + 10]) - height[known][-1]),
    )
    return TimedFlight(changes=(takeoff, landing), legs=tuple(legs))


def _smoothed(column: FloatArray, window: int) -> FloatArray:
    weights = np.ones(2 * (window // 2) + 1)
    counts = np.convolve(np.ones(column.size), weights, mode="same")
    return np.convolve(column, weights, mode="same") / counts


def _legs(record: FlightRecord, speed: FloatArray) -> list[tuple[int, int]]:
    """Return the first samples, and those after the last, of the stretches far enough for a leg."""
    moving = speed > _MOVING_M_S
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
    brake = begin + int(np.flatnonzero(flown >= 0.98 * held)[-1])
    return TimedLeg(
        log=record.source,
        flight=record.number,
        start_s=float(time_s[since]),
        duration_s=float(time_s[end] - time_s[since]),
        length_m=float(np.trapezoid(speed[since : end + 1], time_s[since : end + 1])),
        speed_m_s=held,
        stopping_distance_m=float(np.trapezoid(speed[brake : end + 1], time_s[brake : end + 1])),
    )
