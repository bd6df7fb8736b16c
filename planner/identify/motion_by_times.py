r"""Motion responses of a vehicle that logs no references, from how long its manoeuvres took.

A second-order response without overshoot, delay d and natural frequency ω, loses the same time in every
level leg, until its speed is within 2 % of none; from braking it needs the distance v (d + 2/ω).  Lost
times and stopping distances of the legs therefore give both:

.. math:: t_{lost} = d + x / \omega, \quad s_{stop} / v = d + 2 / \omega,
          \quad (1 + x) e^{-x} = 0.02.

A height changes by a step that holds its peak rate ω X / e for what is beyond the step X identified:

.. math:: t(h) = d + x_X / \omega + (h - X) e / (\omega X), \quad (1 + x_X) e^{-x_X} = 1\,\mathrm{m} / X,

of which a straight line through the durations over the heights gives ω and d.  Ramps of an autopilot are
no such responses: the line through lost times over speed would rise.  What that costs is told by the fit on
flights left out.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.identify.commands import Answer
from planner.identify.estimate import Estimate
from planner.identify.outcome import SegmentUse, StateOutcome, Status
from planner.identify.quality import fit_percent
from planner.identify.response_states import ResponseIdentification
from planner.identify.timed_manoeuvres import TimedChange, TimedLeg, timed_flight
from planner.physics.transfer_function import TransferFunction
from planner.vehicle.model import ManoeuvreResponse

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_SPEED_LEFT = 0.02
"""Of the speed, at which a leg is over: as `planner.flight.motion.step_response` has it. [-]"""
_HEIGHT_LEFT_M = 1.0
"""From the height, at which a climb is over. [m]"""
_LEAST_FLIGHTS = 3
_LEAST_DELAY_S = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class _Fit:
    """A critically damped response."""

    natural_frequency_rad_s: float
    delay_s: float
    step: float
    """Step it is identified on: height or speed. [m or m s⁻¹]"""


def has_references(record: FlightRecord) -> bool:
    """Return whether a record tells what its vehicle was told to do."""
    columns = (record.reference_height_m, record.reference_speed_m_s)
    return any(bool(np.isfinite(column).any()) for column in columns)


def identify_motion_by_times(
    records: Sequence[FlightRecord],
) -> tuple[ResponseIdentification, ResponseIdentification]:
    """Identify the answers of height and speed from the durations of manoeuvres.

    Parameters
    ----------
    records : sequence of FlightRecord
        Flights from standing motors to standing motors, with level legs.

    Returns
    -------
    tuple of ResponseIdentification
        Altitude and speed; without a response where fewer than three flights tell it.
    """
    flights = [timed_flight(record) for record in records]
    refused = tuple(
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
    )
    told = [flight for flight in flights if not flight.refusal]
    if len(told) < _LEAST_FLIGHTS:
        why = f"{len(told)} flights have level legs between a take-off and a landing: too few"
        altitude, speed = (_nothing(a, why, refused) for a in (Answer.ALTITUDE, Answer.SPEED))
        return altitude, speed
    changes = [flight.changes for flight in told]
    legs = [flight.legs for flight in told]
    return (
        _identified(Answer.ALTITUDE, changes, _fit_altitude, _change_s, refused),
        _identified(Answer.SPEED, legs, _fit_speed, _leg_s, refused),
    )


def _fit_speed(legs: Sequence[TimedLeg]) -> _Fit:
    lost_s = float(np.median([leg.lost_s for leg in legs]))
    stop_s = float(np.median([leg.stopping_distance_m / leg.speed_m_s for leg in legs]))
    settled = _settled(_SPEED_LEFT)
    frequency = (settled - 2.0) / max(lost_s - stop_s, 1e-9)
    delay_s = stop_s - 2.0 / frequency
    if delay_s < _LEAST_DELAY_S:
        # Times count for more than distances: the delay is none, and the lost time is kept.
        delay_s, frequency = _LEAST_DELAY_S, settled / lost_s
    return _Fit(
        natural_frequency_rad_s=frequency,
        delay_s=delay_s,
        step=max(leg.speed_m_s for leg in legs),
    )


def _fit_altitude(changes: Sequence[TimedChange]) -> _Fit:
    heights = np.array([abs(change.rise_m) for change in changes])
    durations = np.array([change.duration_s for change in changes])
    if np.ptp(heights) < 0.5 * heights.mean():
        msg = "all flights have nearly one height: times do not tell a rate of climb"
        raise IdentificationError(msg)
    per_m, at_ground_s = np.polyfit(heights, durations, 1)
    step_m = float(heights.min())
    frequency = math.e / (per_m * step_m)
    settled_s = _settled(_HEIGHT_LEFT_M / step_m) / frequency
    delay_s = float(at_ground_s + per_m * step_m - settled_s)
    return _Fit(
        natural_frequency_rad_s=float(frequency),
        delay_s=max(delay_s, _LEAST_DELAY_S),
        step=step_m,
    )


def _leg_s(fit: _Fit, leg: TimedLeg) -> float:
    lost_s = fit.delay_s + _settled(_SPEED_LEFT) / fit.natural_frequency_rad_s
    return leg.length_m / leg.speed_m_s + lost_s


def _change_s(fit: _Fit, change: TimedChange) -> float:
    size = abs(change.rise_m)
    step_m = min(size, fit.step)
    settled = _settled(min(_HEIGHT_LEFT_M / step_m, 0.5))
    rate = fit.natural_frequency_rad_s * step_m / math.e
    return fit.delay_s + settled / fit.natural_frequency_rad_s + (size - step_m) / rate


def _settled(left: float) -> float:
    """Return x of (1 + x) exp(−x) = left: natural frequency times time to come so near."""
    x = 1.0
    for _ in range(60):
        x = math.log((1.0 + x) / left)
    return x


def _identified(
    answer: Answer,
    flights: Sequence[Sequence[TimedLeg] | Sequence[TimedChange]],
    fit_of: Callable[..., _Fit],
    predicted_s: Callable[..., float],
    refused: tuple[SegmentUse, ...],
) -> ResponseIdentification:
    """Fit all manoeuvres of one kind, and tell how each flight is predicted without itself."""
    try:
        fit = fit_of([m for flight in flights for m in flight])
        fits = [
            fit_of([m for other in flights if other is not flight for m in other])
            for flight in flights
        ]
    except IdentificationError as error:
        return _nothing(answer, str(error), refused)
    measured = np.array([m.duration_s for flight in flights for m in flight])
    told = np.array(
        [predicted_s(own, m) for own, flight in zip(fits, flights, strict=True) for m in flight]
    )
    rows = {
        "natural_frequency_rad_s": [f.natural_frequency_rad_s for f in fits],
        "delay_s": [f.delay_s for f in fits],
    }
    unit = "m" if answer is Answer.ALTITUDE else "m/s"
    frequency = fit.natural_frequency_rad_s
    return ResponseIdentification(
        response=ManoeuvreResponse(
            transfer_function=TransferFunction(
                numerator=(_rounded(frequency**2),),
                denominator=(1.0, _rounded(2.0 * frequency), _rounded(frequency**2)),
                delay_s=_rounded(fit.delay_s),
            ),
            input_gain=1.0,
            identified_step_m=_rounded(fit.step) if answer is Answer.ALTITUDE else None,
            identified_speed_m_s=_rounded(fit.step) if answer is Answer.SPEED else None,
        ),
        outcome=StateOutcome(
            name=answer.value,
            status=Status.IDENTIFIED,
            said=(
                f"critically damped with a delay, by the durations of {measured.size} manoeuvres: the "
                "logs tell no references"
            ),
            unit="s",
            estimates=tuple(
                Estimate(name=name, value=getattr(fit, name), error=_jackknife_error(values))
                for name, values in rows.items()
            ),
            segments=(
                *refused,
                *(
                    SegmentUse(
                        log=m.log,
                        flight=m.flight,
                        start_s=m.start_s,
                        duration_s=m.duration_s,
                        what=f"{answer.value} {_size(m):+.4g} {unit}",
                        is_held_out=True,
                    )
                    for flight in flights
                    for m in flight
                ),
            ),
            fit_percent=fit_percent(measured, told),
            rms=float(np.sqrt(np.mean((told - measured) ** 2))),
        ),
    )


def _size(manoeuvre: TimedLeg | TimedChange) -> float:
    return manoeuvre.speed_m_s if isinstance(manoeuvre, TimedLeg) else manoeuvre.rise_m


def _jackknife_error(values: Sequence[float]) -> float:
    """Return the standard error that fits without each flight in turn tell (Quenouille, Tukey)."""
    count = len(values)
    return float(np.sqrt((count - 1) / count * np.sum((np.array(values) - np.mean(values)) ** 2)))


def _nothing(answer: Answer, why: str, refused: tuple[SegmentUse, ...]) -> ResponseIdentification:
    return ResponseIdentification(
        response=None,
        outcome=StateOutcome(name=answer.value, status=Status.LEFT_OUT, said=why, segments=refused),
    )


def _rounded(value: float) -> float:
    return float(f"{value:.6g}")
