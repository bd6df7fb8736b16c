"""Ramps of a vehicle that logs no references, from how long its manoeuvres took.

With acceleration a and braking b, a leg of length L at speed v takes L/v + k v, where k = (1/a + 1/b)/2, and
stops within v²/2b.  What is slower than u = 1 m/s counts as standing: a first leg, seen from u to u, loses
k (v − u)²/v beyond its length over its speed, which gives k.  Each further leg is seen from standstill to
standstill and loses k v and a wait w.  The stops give b.

Durations of take-offs and of landings are straight lines over the height, whose slopes are one over the
speeds.  What a take-off takes beyond is lift-off, ramps and the wait before the first leg; what a landing
takes beyond is the slow part before the ground, whose speed is read off the height, and the stop.

Medians throughout, and the median of the slopes between all pairs (Theil 1950, Sen 1968): a pilot who
dawdles once counts for one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import IdentificationError
from planner.identify.segments import FlightPart, SegmentUse, StateOutcome, run_bounds, smoothed
from planner.identify.uncertainty import Estimate, rounded, told_fit_percent
from planner.values import Value, field_names
from planner.vehicle.model import Ramps

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planner.arrays import FloatArray
    from planner.logs.record import FlightRecord


MOVING_M_S = 1.0
"""Slower is standing: wind pushes a hovering vehicle about at half of that. [m s⁻¹]"""
_BRAKING_S = 6.0
"""No vehicle of level legs brakes for longer. [s]"""
STOPPING_FRACTION = 0.98
"""Of the speed held: a stop is measured from there on. [-]"""
_LEAST_LEG_M = 30.0
_KNOWN = 0.9
"""Fraction of the flight that speed and height must be known for. [-]"""
OFF_GROUND_M = 0.5
"""Height at which a take-off, or a landing, is seen. [m]"""
_LOW_M = (1.0, 8.0)
_MEAN_SAMPLES = 10
_LEVEL_FRACTION = 0.2
"""A flight is level between its first and last leg to this fraction of its height. [-]"""
_SMOOTHING_S = 1.0
_COMMANDED_PERCENTILE = 80.0
"""Of the speeds above half of the highest: commanded speeds are held for most of a leg."""


class TimedLeg(FlightPart):
    """A level leg with the standstill before it: from the end of what was before until standstill."""

    length_m: float
    speed_m_s: float
    """Speed held. [m s⁻¹]"""
    stopping_distance_m: float
    """From 98 % of the speed it brakes from. [m]"""
    stopped_from_m_s: float
    """Highest speed shortly before standstill: gusts and dips make it another one. [m s⁻¹]"""

    @property
    def label(self) -> str:
        """What it is called in a report."""
        return f"leg {self.length_m:.0f} m at {self.speed_m_s:.1f} m/s"

    @property
    def lost_s(self) -> float:
        """Time beyond that of its length at its speed. [s]"""
        return self.duration_s - self.length_m / self.speed_m_s


class TimedChange(FlightPart):
    """A take-off until the first leg begins, or a landing until the motors stop."""

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


class TimedFlight(Value):
    """The manoeuvres of one flight: a take-off, legs and a landing one after the other."""

    takeoff: TimedChange
    legs: tuple[TimedLeg, ...]
    landing: TimedChange

    @property
    def manoeuvres(self) -> tuple[TimedLeg | TimedChange, ...]:
        """All of them, in the order flown."""
        return (self.takeoff, *self.legs, self.landing)


def timed_flight(record: FlightRecord) -> TimedFlight:
    """Return the manoeuvres of a flight from standing motors to standing motors.

    Raises IdentificationError if it does not take off, fly level legs, and land: the reason.
    """
    speed, height = record.ground_speed_m_s, record.height_above_home_m
    known = np.isfinite(speed) & np.isfinite(height)
    if known.mean() < _KNOWN:
        msg = "speed or height is not known throughout"
        raise IdentificationError(msg)
    time_s = record.time_s
    smooth = smoothed(
        np.interp(time_s, time_s[known], speed[known]), round(_SMOOTHING_S / record.step_s)
    )
    bounds = _legs(record, smooth)
    if not bounds:
        msg = "no level leg"
        raise IdentificationError(msg)
    level = height[bounds[0][0] : bounds[-1][1]]
    level_m = float(np.nanmedian(level))
    if level_m < _LOW_M[1] or np.nanmax(np.abs(level - level_m)) > _LEVEL_FRACTION * level_m:
        msg = "climbs or descends between its legs"
        raise IdentificationError(msg)
    filled = np.interp(time_s, time_s[known], height[known])
    if level_m - max(filled[0], filled[-1]) < _LOW_M[1]:
        msg = "does not begin and end on the ground"
        raise IdentificationError(msg)
    starts = [bounds[0][0], *(end for _, end in bounds[:-1])]
    return TimedFlight(
        takeoff=_takeoff(record, filled, bounds[0][0]),
        legs=tuple(
            _timed_leg(record, smooth, since, begin, end)
            for since, (begin, end) in zip(starts, bounds, strict=True)
        ),
        landing=_landing(record, filled, bounds[-1][1]),
    )


def _takeoff(record: FlightRecord, height: FloatArray, end: int) -> TimedChange:
    above = height[: end + 1] - height[0]
    return TimedChange.within(
        record,
        duration_s=float(record.time_s[end]),
        rise_m=float(above[max(end - _MEAN_SAMPLES, 0) :].mean()),
        ground_s=float(record.time_s[int(np.argmax(above > OFF_GROUND_M))]),
        low_speed_m_s=_low_speed_m_s(above, record),
    )


def _landing(record: FlightRecord, height: FloatArray, begin: int) -> TimedChange:
    above = height[begin:] - height[-1]
    begin_s = float(record.time_s[begin])
    touched = begin + int(np.flatnonzero(above > OFF_GROUND_M)[-1])
    return TimedChange.within(
        record,
        start_s=begin_s,
        duration_s=record.duration_s - begin_s,
        rise_m=-float(above[:_MEAN_SAMPLES].mean()),
        ground_s=record.duration_s - float(record.time_s[touched]),
        low_speed_m_s=_low_speed_m_s(above[::-1], record),
    )


def _low_speed_m_s(above: FloatArray, record: FlightRecord) -> float:
    """Return the speed from 1 m to 8 m above the ground, of heights counted from the ground on."""
    low, high = _LOW_M
    samples = int(np.argmax(above > high)) - int(np.argmax(above > low))
    return (high - low) / (max(samples, 1) * record.step_s)


def _legs(record: FlightRecord, speed: FloatArray) -> list[tuple[int, int]]:
    """Return the first samples, and those after the last, of the spans far enough for a leg."""
    moving = speed > MOVING_M_S
    found = []
    for begin, end in zip(*(bound.tolist() for bound in run_bounds(moving)), strict=True):
        if moving[begin] and speed[begin:end].sum() * record.step_s > _LEAST_LEG_M:
            found.append((begin, min(end, speed.size - 1)))
    return found


def _timed_leg(
    record: FlightRecord, speed: FloatArray, since: int, begin: int, end: int
) -> TimedLeg:
    time_s = record.time_s
    flown = speed[begin:end]
    held = float(np.percentile(flown[flown > 0.5 * flown.max()], _COMMANDED_PERCENTILE))
    braked_from = float(flown[-round(_BRAKING_S / record.step_s) :].max())
    brake = end - int(np.argmax(flown[::-1] >= STOPPING_FRACTION * braked_from)) - 1
    return TimedLeg.within(
        record,
        start_s=float(time_s[since]),
        duration_s=float(time_s[end] - time_s[since]),
        length_m=float(np.trapezoid(speed[since : end + 1], time_s[since : end + 1])),
        speed_m_s=held,
        stopping_distance_m=float(np.trapezoid(speed[brake : end + 1], time_s[brake : end + 1])),
        stopped_from_m_s=braked_from,
    )


_LEAST_FLIGHTS = 3
_LEAST_SPREAD = 0.5
"""Range of the heights over their mean, under which they show no speed. [-]"""
_LEAST_INVERSE = 0.05
"""Of accelerations: 20 m/s² is out of reach of any multirotor. [s² m⁻¹]"""


class RampIdentification(Value):
    """Ramps for the model file, if the flights show them, and what was found."""

    ramps: Ramps | None
    default_speed_m_s: float | None
    """Median of the speeds flown. [m s⁻¹]"""
    outcome: StateOutcome


def has_references(record: FlightRecord) -> bool:
    """Return whether a record holds what its vehicle was commanded."""
    return bool(np.isfinite([record.reference_height_m, record.reference_speed_m_s]).any())


def identify_ramps(records: Sequence[FlightRecord]) -> RampIdentification:
    """Identify how a vehicle without references flies from place to place.

    There are no ramps where fewer than three flights show them, or all at one height.
    """
    usable: list[TimedFlight] = []
    refused: list[SegmentUse] = []
    for record in records:
        try:
            usable.append(timed_flight(record))
        except IdentificationError as error:
            refused.append(SegmentUse.within(record, what="flight", refusal=str(error)))
    try:
        ramps = fit_ramps(usable)
        others = [fit_ramps([o for o in usable if o is not flight]) for flight in usable]
    except IdentificationError as error:
        outcome = StateOutcome.left_out("ramps", str(error), tuple(refused))
        return RampIdentification(ramps=None, default_speed_m_s=None, outcome=outcome)
    manoeuvres = [manoeuvre for flight in usable for manoeuvre in flight.manoeuvres]
    measured = np.array([manoeuvre.duration_s for manoeuvre in manoeuvres])
    predicted = np.concatenate(
        [durations_s(flight, without) for flight, without in zip(usable, others, strict=True)]
    )
    estimates = tuple(
        Estimate(
            name=name,
            value=getattr(ramps, name),
            error=_jackknife_error([getattr(other, name) for other in others]),
        )
        for name in field_names(Ramps)
    )
    outcome = StateOutcome(
        name="ramps",
        summary=(
            f"from rest to rest, by the durations of "
            f"{quantity.count(len(measured), 'manoeuvre')}: no references in the logs"
        ),
        unit="s",
        estimates=estimates,
        not_shown=tuple(e.name for e in estimates if e.error > e.value),
        segments=(*refused, *(SegmentUse.of(m, m.label, is_held_out=True) for m in manoeuvres)),
        fit_percent=told_fit_percent(measured, predicted),
        rms=float(np.sqrt(np.mean((predicted - measured) ** 2))),
    )
    speeds = [leg.speed_m_s for flight in usable for leg in flight.legs]
    return RampIdentification(
        ramps=ramps, default_speed_m_s=rounded(float(np.median(speeds)), 4), outcome=outcome
    )


def fit_ramps(flights: Sequence[TimedFlight]) -> Ramps:
    """Fit ramps to the manoeuvres of flights.

    Raises IdentificationError if there are fewer than three flights, all have one leg or one
    height, or the durations do not grow with the heights.
    """
    if len(flights) < _LEAST_FLIGHTS:
        msg = f"too few flights have level legs between a take-off and a landing: {len(flights)}"
        raise IdentificationError(msg)
    first = [flight.legs[0] for flight in flights]
    later = [leg for flight in flights for leg in flight.legs[1:]]
    if not later:
        msg = "every flight has one leg: the wait between two legs is unknown"
        raise IdentificationError(msg)
    per_speed = max(
        _median(leg.lost_s * leg.speed_m_s / (leg.speed_m_s - MOVING_M_S) ** 2 for leg in first),
        _LEAST_INVERSE,
    )
    braking = _median(
        ((STOPPING_FRACTION * leg.stopped_from_m_s) ** 2 - MOVING_M_S**2)
        / (2.0 * leg.stopping_distance_m)
        for leg in (*first, *later)
    )
    slack = 2.0 * per_speed - 1.0 / braking
    acceleration = 1.0 / slack if slack > _LEAST_INVERSE else 1.0 / per_speed
    braking = braking if slack > _LEAST_INVERSE else 1.0 / per_speed
    turn_wait_s = _median(leg.lost_s - per_speed * leg.speed_m_s for leg in later)
    ups = [flight.takeoff for flight in flights]
    downs = [flight.landing for flight in flights]
    climb, beyond_up_s = _line(ups)
    descent, beyond_down_s = _line(downs)
    # The first leg is seen to begin late, the last one to end early.
    beyond_up_s -= MOVING_M_S / acceleration
    beyond_down_s -= MOVING_M_S / braking
    inverse = 0.5 * (1.0 / acceleration + 1.0 / braking)
    landing = min(_median(change.low_speed_m_s for change in downs), descent)
    # Both are seen half a metre above the ground.
    lifting_s = float(np.sqrt(2.0 * OFF_GROUND_M / acceleration))
    start_s = max(_median(change.ground_s for change in ups) - lifting_s, 0.0)
    stop_s = max(_median(change.ground_s for change in downs) - OFF_GROUND_M / landing, 0.0)
    slow_s = beyond_down_s - stop_s - descent * inverse - 0.5 * landing / acceleration
    slower = 1.0 / landing - 1.0 / descent
    values = {
        "start_s": start_s,
        "climb_m_s": climb,
        "climb_wait_s": max(beyond_up_s - start_s - climb * inverse, 0.0),
        "acceleration_m_s2": acceleration,
        "braking_m_s2": braking,
        "turn_wait_s": max(turn_wait_s, 0.0),
        "descent_m_s": descent,
        "landing_m_s": landing,
        "landing_height_m": max(slow_s / slower, 0.0) if slower > 0.0 else 0.0,
        "stop_s": stop_s,
    }
    return Ramps(**{name: rounded(value, 4) for name, value in values.items()})


def _line(changes: Sequence[TimedChange]) -> tuple[float, float]:
    """Return the speed of climbs or descents, and what they take beyond. [m s⁻¹], [s]"""
    heights = np.array([abs(change.rise_m) for change in changes])
    durations = np.array([change.duration_s for change in changes])
    if np.ptp(heights) < _LEAST_SPREAD * heights.mean():
        msg = "all flights have nearly one height: durations do not show the speed of a climb"
        raise IdentificationError(msg)
    one, other = np.triu_indices(heights.size, 1)
    apart = np.abs(heights[other] - heights[one]) > 0.25 * np.ptp(heights)
    slopes = (durations[other] - durations[one])[apart] / (heights[other] - heights[one])[apart]
    slope = float(np.median(slopes))
    if not slope > 0.0:
        msg = "higher flights take no longer: durations do not show the speed of a climb"
        raise IdentificationError(msg)
    return 1.0 / slope, float(np.median(durations - slope * heights))


def durations_s(flight: TimedFlight, ramps: Ramps) -> list[float]:
    """Return the duration that ramps give each of the manoeuvres of a flight. [s]"""
    inverse = 0.5 * (1.0 / ramps.acceleration_m_s2 + 1.0 / ramps.braking_m_s2)
    up_m, down_m = abs(flight.takeoff.rise_m), abs(flight.landing.rise_m)
    slow_m = min(down_m, ramps.landing_height_m)
    legs = []
    for number, leg in enumerate(flight.legs):
        lost_s = inverse * (leg.speed_m_s - MOVING_M_S) ** 2 / leg.speed_m_s
        if number:
            lost_s = inverse * leg.speed_m_s + ramps.turn_wait_s
        legs.append(leg.length_m / leg.speed_m_s + lost_s)
    takeoff = (
        ramps.start_s
        + up_m / ramps.climb_m_s
        + ramps.climb_m_s * inverse
        + ramps.climb_wait_s
        + MOVING_M_S / ramps.acceleration_m_s2
    )
    landing = (
        (down_m - slow_m) / ramps.descent_m_s
        + ramps.descent_m_s * inverse
        + slow_m / ramps.landing_m_s
        + 0.5 * ramps.landing_m_s / ramps.acceleration_m_s2
        + ramps.stop_s
        + MOVING_M_S / ramps.braking_m_s2
    )
    return [takeoff, *legs, landing]


def _median(values: Iterable[float]) -> float:
    return float(np.median(list(values)))


def _jackknife_error(values: Sequence[float]) -> float:
    """Return the standard error of fits without each flight in turn (Quenouille, Tukey)."""
    count = len(values)
    return float(np.sqrt((count - 1) / count * np.sum((np.array(values) - np.mean(values)) ** 2)))
