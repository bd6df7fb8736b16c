r"""Ramps of a vehicle that logs no references, from how long its manoeuvres took.

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

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.errors import IdentificationError
from planner.identify.estimate import Estimate
from planner.identify.outcome import SegmentUse, StateOutcome, Status
from planner.identify.quality import fit_percent
from planner.identify.timed_manoeuvres import (
    MOVING_M_S,
    OFF_GROUND_M,
    STOPPING_SHARE,
    timed_flight,
)
from planner.vehicle.model import Ramps

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    import numpy.typing as npt

    from planner.identify.timed_manoeuvres import TimedChange, TimedFlight, TimedLeg
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_LEAST_FLIGHTS = 3
_LEAST_SPREAD = 0.5
"""Range of the heights over their mean, under which they tell no speed. [-]"""
_LEAST_INVERSE = 0.05
"""Of accelerations: 20 m/s² is out of reach of any multirotor. [s² m⁻¹]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class RampIdentification:
    """Ramps for the model file, if the flights tell them, and what was found."""

    ramps: Ramps | None
    default_speed_m_s: float | None
    """Median of the speeds flown. [m s⁻¹]"""
    outcome: StateOutcome


def has_references(record: FlightRecord) -> bool:
    """Return whether a record tells what its vehicle was told to do."""
    columns = (record.reference_height_m, record.reference_speed_m_s)
    return any(bool(np.isfinite(column).any()) for column in columns)


def identify_ramps(records: Sequence[FlightRecord]) -> RampIdentification:
    """Identify how a vehicle without references flies from place to place.

    Parameters
    ----------
    records : sequence of FlightRecord
        Flights from standing motors to standing motors, with level legs between.

    Returns
    -------
    RampIdentification
        Without ramps where fewer than three flights tell them, or all at one height.
    """
    flights = [timed_flight(record) for record in records]
    refused = [
        SegmentUse(
            log=record.source,
            flight=record.number,
            start_s=0.0,
            duration_s=record.duration_s,
            what="flight",
            refusal=flight.refusal,
        )
        for record, flight in zip(records, flights, strict=True)
        if flight.refusal
    ]
    told = [flight for flight in flights if not flight.refusal]
    try:
        ramps = fit_ramps(told)
        others = [fit_ramps([o for o in told if o is not flight]) for flight in told]
    except IdentificationError as error:
        outcome = StateOutcome(
            name="ramps", status=Status.LEFT_OUT, said=str(error), segments=tuple(refused)
        )
        return RampIdentification(ramps=None, default_speed_m_s=None, outcome=outcome)
    measured, predicted = [], []
    for flight, without in zip(told, others, strict=True):
        for manoeuvre, duration_s in durations_s(flight, without):
            measured.append(manoeuvre.duration_s)
            predicted.append(duration_s)
    errors = np.array(predicted) - np.array(measured)
    names = [field.name for field in fields(Ramps)]
    outcome = StateOutcome(
        name="ramps",
        status=Status.IDENTIFIED,
        said=(
            f"from rest to rest, by the durations of "
            f"{numbers.count(len(measured), 'manoeuvre')}: the logs tell no references"
        ),
        unit="s",
        estimates=tuple(
            Estimate(
                name=name,
                value=getattr(ramps, name),
                error=_jackknife_error([getattr(other, name) for other in others]),
            )
            for name in names
        ),
        segments=(*refused, *(use for flight in told for use in _uses(flight))),
        fit_percent=fit_percent(np.array(measured), np.array(predicted)),
        rms=float(np.sqrt(np.mean(errors**2))),
    )
    speeds = [leg.speed_m_s for flight in told for leg in flight.legs]
    return RampIdentification(
        ramps=ramps, default_speed_m_s=_rounded(float(np.median(speeds))), outcome=outcome
    )


def fit_ramps(flights: Sequence[TimedFlight]) -> Ramps:
    """Fit ramps to the manoeuvres of flights.

    Raises
    ------
    IdentificationError
        If there are fewer than three flights, all have one leg or one height, or the durations do
        not grow with the heights.
    """
    if len(flights) < _LEAST_FLIGHTS:
        msg = f"too few flights have level legs between a take-off and a landing: {len(flights)}"
        raise IdentificationError(msg)
    first = [flight.legs[0] for flight in flights]
    later = [leg for flight in flights for leg in flight.legs[1:]]
    if not later:
        msg = "every flight has one leg: none tells how long the vehicle stands between two"
        raise IdentificationError(msg)
    per_speed = max(
        _median(leg.lost_s * leg.speed_m_s / (leg.speed_m_s - MOVING_M_S) ** 2 for leg in first),
        _LEAST_INVERSE,
    )
    braking = _median(
        ((STOPPING_SHARE * leg.stopped_from_m_s) ** 2 - MOVING_M_S**2)
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
    return Ramps(
        start_s=_rounded(start_s),
        climb_m_s=_rounded(climb),
        climb_wait_s=_rounded(max(beyond_up_s - start_s - climb * inverse, 0.0)),
        acceleration_m_s2=_rounded(acceleration),
        braking_m_s2=_rounded(braking),
        turn_wait_s=_rounded(max(turn_wait_s, 0.0)),
        descent_m_s=_rounded(descent),
        landing_m_s=_rounded(landing),
        landing_height_m=_rounded(max(slow_s / slower, 0.0) if slower > 0.0 else 0.0),
        stop_s=_rounded(stop_s),
    )


def _line(changes: Sequence[TimedChange]) -> tuple[float, float]:
    """Return the speed of climbs or descents, and what they take beyond. [m s⁻¹], [s]"""
    heights = np.array([abs(change.rise_m) for change in changes])
    durations = np.array([change.duration_s for change in changes])
    if np.ptp(heights) < _LEAST_SPREAD * heights.mean():
        msg = "all flights have nearly one height: durations do not tell the speed of a climb"
        raise IdentificationError(msg)
    one, other = np.triu_indices(heights.size, 1)
    apart = np.abs(heights[other] - heights[one]) > 0.25 * np.ptp(heights)
    slope = float(
        np.median(
            (durations[other] - durations[one])[apart] / (heights[other] - heights[one])[apart]
        )
    )
    if not slope > 0.0:
        msg = "higher flights take no longer: durations do not tell the speed of a climb"
        raise IdentificationError(msg)
    return 1.0 / slope, float(np.median(durations - slope * heights))


def durations_s(flight: TimedFlight, ramps: Ramps) -> list[tuple[TimedLeg | TimedChange, float]]:
    """Return the manoeuvres of a flight, each with the duration that ramps give it. [s]"""
    inverse = 0.5 * (1.0 / ramps.acceleration_m_s2 + 1.0 / ramps.braking_m_s2)
    found: list[tuple[TimedLeg | TimedChange, float]] = []
    up, down = flight.takeoff, flight.landing
    found.append(
        (
            up,
            ramps.start_s
            + abs(up.rise_m) / ramps.climb_m_s
            + ramps.climb_m_s * inverse
            + ramps.climb_wait_s
            + MOVING_M_S / ramps.acceleration_m_s2,
        )
    )
    for number, leg in enumerate(flight.legs):
        lost_s = inverse * (leg.speed_m_s - MOVING_M_S) ** 2 / leg.speed_m_s
        if number:
            lost_s = inverse * leg.speed_m_s + ramps.turn_wait_s
        found.append((leg, leg.length_m / leg.speed_m_s + lost_s))
    slow_m = min(abs(down.rise_m), ramps.landing_height_m)
    found.append(
        (
            down,
            (abs(down.rise_m) - slow_m) / ramps.descent_m_s
            + ramps.descent_m_s * inverse
            + slow_m / ramps.landing_m_s
            + 0.5 * ramps.landing_m_s / ramps.acceleration_m_s2
            + ramps.stop_s
            + MOVING_M_S / ramps.braking_m_s2,
        )
    )
    return found


def _uses(flight: TimedFlight) -> list[SegmentUse]:
    manoeuvres: tuple[TimedLeg | TimedChange, ...] = (flight.takeoff, *flight.legs, flight.landing)
    return [
        SegmentUse(
            log=manoeuvre.log,
            flight=manoeuvre.flight,
            start_s=manoeuvre.start_s,
            duration_s=manoeuvre.duration_s,
            what=manoeuvre.label,
            is_held_out=True,
        )
        for manoeuvre in manoeuvres
    ]


def _median(values: Iterable[float]) -> float:
    return float(np.median(list(values)))


def _jackknife_error(values: Sequence[float]) -> float:
    """Return the standard error that fits without each flight in turn tell (Quenouille, Tukey)."""
    count = len(values)
    return float(np.sqrt((count - 1) / count * np.sum((np.array(values) - np.mean(values)) ** 2)))


def _rounded(value: float) -> float:
    return float(f"{value:.4g}")
