"""Mean power of whole manoeuvres, of flights whose loads differ and are not told.

A vehicle that seldom flies steadily for long tells its power by the means over whole manoeuvres.  Where
flights carry different loads that no log tells, a law fitted to all of them would take loads for speeds:
each flight's powers are brought to the mean of the flights first, so that only what differs within
flights shapes the law (fixed effects), and their mean gives its level.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.identify.estimate import Estimate
from planner.identify.noise import mean_with_error
from planner.identify.outcome import SegmentUse, StateOutcome, Status
from planner.identify.power_states import PowerIdentification
from planner.identify.quality import fit_percent
from planner.identify.steady import SteadyPower, speed_through_air_m_s
from planner.identify.timed_manoeuvres import timed_flight
from planner.vehicle.power import (
    AltitudeLaw,
    CruisePower,
    VerticalPower,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.timed_manoeuvres import TimedChange
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_CLIMBED = 0.95
"""Share of a climb after which it slows down. [-]"""
_LEAST_LEGS = 4
_KNOTS = 5
"""Of the table over airspeed, hover counted: a parabola between them is a straight line to 1 W."""
_KNOWN = 0.9
"""Share of a manoeuvre that power and airspeed must be known for. [-]"""


def manoeuvre_powers(
    record: FlightRecord, *, air_density_kg_m3: FloatArray, mass_kg: float | None
) -> tuple[SteadyPower, ...]:
    """Return the mean power of each manoeuvre of a flight.

    Parameters
    ----------
    record : FlightRecord
        One flight.
    air_density_kg_m3 : ndarray, shape (n,)
        Air density at each sample. [kg m⁻³]
    mass_kg : float, optional
        Mass that flew. [kg]

    Returns
    -------
    tuple of SteadyPower
        Climb, legs and both halves of the descent, ground time left out; empty where the flight is
        no such flight or power is not known.
    """
    flight = timed_flight(record)
    if flight.refusal:
        return ()
    spans = [
        _climb(record, flight.takeoff),
        *((leg.start_s, leg.start_s + leg.duration_s, 0.0) for leg in flight.legs),
        *_descent_halves(record, flight.landing),
    ]
    airspeed = speed_through_air_m_s(record)
    found = []
    for begin_s, end_s, rise_m in spans:
        part = (record.time_s >= begin_s) & (record.time_s < end_s)
        known = part & np.isfinite(record.power_w) & np.isfinite(airspeed)
        if known.sum() < _KNOWN * max(part.sum(), 1):
            continue
        power_w, error_w = mean_with_error([record.power_w[known]])
        found.append(
            SteadyPower(
                power_w=power_w,
                error_w=error_w,
                duration_s=end_s - begin_s,
                height_above_home_m=float(np.nanmean(record.height_above_home_m[part])),
                airspeed_m_s=float(airspeed[known].mean()),
                climb_rate_m_s=rise_m / (end_s - begin_s),
                air_density_kg_m3=float(np.nanmean(air_density_kg_m3[part])),
                mass_kg=mass_kg,
                source=f"{record.source}#{record.number}",
                start_s=begin_s,
            )
        )
    return tuple(found)


_Span = tuple[float, float, float]
"""Beginning, end and rise. [s], [s], [m]"""


def _climb(record: FlightRecord, change: TimedChange) -> _Span:
    """Return a take-off from lift-off until hardly anything is left to climb."""
    begin_s = change.start_s + change.ground_s
    end_s = change.start_s + change.duration_s
    part = (record.time_s >= begin_s) & (record.time_s < end_s)
    times_s, above_m = record.time_s[part], record.height_above_home_m[part]
    up = np.flatnonzero(above_m >= _CLIMBED * change.rise_m)
    end_s = float(times_s[up[0]]) if up.size else end_s
    return begin_s, end_s, _CLIMBED * change.rise_m


def _descent_halves(record: FlightRecord, change: TimedChange) -> tuple[_Span, _Span]:
    """Return both halves of a landing by height, of which the lower one is the slower."""
    end_s = change.start_s + change.duration_s - change.ground_s
    part = (record.time_s >= change.start_s) & (record.time_s < end_s)
    times_s, height_m = record.time_s[part], record.height_above_home_m[part]
    half_m = float(height_m[np.isfinite(height_m)][-1]) - 0.5 * change.rise_m
    low = np.flatnonzero(height_m < half_m)
    middle_s = float(times_s[low[0]]) if low.size else 0.5 * (change.start_s + end_s)
    rise_m = 0.5 * change.rise_m
    return (change.start_s, middle_s, rise_m), (middle_s, end_s, rise_m)


def at_mean_load(flights: Sequence[Sequence[SteadyPower]]) -> tuple[SteadyPower, ...]:
    """Return the powers of flights with unknown loads, each flight brought to the mean of all.

    Parameters
    ----------
    flights : sequence of sequence of SteadyPower
        Mean powers flight by flight.

    Returns
    -------
    tuple of SteadyPower
        All of them in a row.
    """
    told = [flight for flight in flights if flight]
    if not told:
        return ()
    levels = [_level_w(flight) for flight in told]
    mean_w = float(np.mean(levels))
    return tuple(
        replace(power, power_w=power.power_w * mean_w / level)
        for flight, level in zip(told, levels, strict=True)
        for power in flight
    )


def _level_w(flight: Sequence[SteadyPower]) -> float:
    """Return the mean power of a flight over its time. [W]"""
    return float(np.average([p.power_w for p in flight], weights=[p.duration_s for p in flight]))


def identify_manoeuvre_power(
    means: Sequence[SteadyPower], refusals: tuple[SegmentUse, ...] = ()
) -> PowerIdentification:
    r"""Identify the power of flights whose mass is not known, from the means over manoeuvres.

    A parabola :math:`P = P_0 + c V^2` through the level legs gives hover power, the same at every height,
    and cruise power over the airspeed; where flights left out are described no better by it than by one
    power, that is taken.  The mean powers of climbs, and of the faster and the slower half of
    the descents, less the parabola, give the power over the climb rate.

    Parameters
    ----------
    means : sequence of SteadyPower
        Mean powers of manoeuvres, at one load.
    refusals : tuple of SegmentUse
        Flights that tell no power, each with the reason.

    Returns
    -------
    PowerIdentification
        Without laws where there are fewer than four level legs.
    """
    level = [m for m in means if m.climb_rate_m_s == 0.0]
    if len(level) < _LEAST_LEGS:
        said = f"too few level legs with power and airspeed: {len(level)}"
        outcome = StateOutcome(name="hover", status=Status.LEFT_OUT, said=said, segments=refusals)
        return PowerIdentification(outcomes=(outcome,))
    speeds = np.array([m.airspeed_m_s for m in level])
    powers = np.array([m.power_w for m in level])
    (growth, hover_w), covariance = np.polyfit(speeds**2, powers, 1, cov="unscaled")
    residuals = powers - hover_w - growth * speeds**2
    scatter = float(residuals @ residuals) / (len(level) - 2)
    growth_error, hover_error = np.sqrt(np.diagonal(covariance) * scatter)
    is_flat = _is_flat(level)
    if is_flat:
        growth, hover_w = 0.0, float(powers.mean())
        residuals = powers - hover_w
        hover_error = float(powers.std(ddof=1) / np.sqrt(len(level)))
    knots = np.linspace(0.0, float(speeds.max()), _KNOTS)
    rates, excess = _vertical_w(means, float(hover_w), float(growth))
    outcome = StateOutcome(
        name="steady power",
        status=Status.IDENTIFIED,
        said=(
            f"{'the same at every airspeed' if is_flat else 'parabola over airspeed'}, table over "
            f"climb rate, from {numbers.count(len(means), 'manoeuvre')}"
        ),
        unit="W",
        estimates=(
            Estimate(name="hover_w", value=float(hover_w), error=float(hover_error)),
            Estimate(name="growth_w_s2_m2", value=float(growth), error=float(growth_error)),
        ),
        segments=(*refusals, *(_use(m) for m in means)),
        fit_percent=fit_percent(powers, powers - residuals),
        rms=float(np.sqrt(np.mean(residuals**2))),
    )
    return PowerIdentification(
        hover=AltitudeLaw(
            coefficient_w=_rounded(float(hover_w)), exponent=0.0, lowest_height_m=1.0
        ),
        cruise=CruisePower(
            speed_m_s=tuple(_rounded(v) for v in knots.tolist()),
            power_above_hover_w=tuple(_rounded(w) for w in (growth * knots**2 + 0.0).tolist()),
        ),
        vertical=VerticalPower(climb_rate_m_s=rates, power_above_hover_w=excess) if rates else None,
        outcomes=(outcome,),
        readings=("No mass is known: the power does not depend on the height or on the payload.",),
    )


def _is_flat(level: Sequence[SteadyPower]) -> bool:
    """Whether one power describes the legs of flights left out better than a parabola does."""
    sources = np.array([leg.source for leg in level])
    squares = np.array([leg.airspeed_m_s for leg in level]) ** 2
    powers = np.array([leg.power_w for leg in level])
    errors = {0: 0.0, 1: 0.0}
    for source in set(sources.tolist()):
        own = sources == source
        for degree in errors:
            if len(set(squares[~own].tolist())) <= degree:
                return True
            law = np.polyfit(squares[~own], powers[~own], degree)
            errors[degree] += float(np.sum((powers[own] - np.polyval(law, squares[own])) ** 2))
    return errors[0] <= errors[1]


def _vertical_w(
    means: Sequence[SteadyPower], hover_w: float, growth: float
) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return climb rates, rising, and the power above that of level flight at each. [m/s], [W]"""
    climbs = [m for m in means if m.climb_rate_m_s > 0.0]
    descents = sorted((m for m in means if m.climb_rate_m_s < 0.0), key=lambda m: m.climb_rate_m_s)
    half = len(descents) // 2
    table = {0.0: 0.0}
    for group in (descents[:half], descents[half:], climbs):
        if group:
            rate = _rounded(float(np.mean([m.climb_rate_m_s for m in group])))
            above = [m.power_w - hover_w - growth * m.airspeed_m_s**2 for m in group]
            table[rate] = _rounded(float(np.mean(above)))
    if len(table) == 1:
        return (), ()
    rates = tuple(sorted(table))
    return rates, tuple(table[rate] for rate in rates)


def _use(mean: SteadyPower) -> SegmentUse:
    log, _, flight = mean.source.rpartition("#")
    return SegmentUse(
        log=log,
        flight=int(flight or 1),
        start_s=mean.start_s,
        duration_s=mean.duration_s,
        what=f"{mean.airspeed_m_s:.1f} m/s, climb {mean.climb_rate_m_s:+.1f} m/s",
    )


def _rounded(value: float) -> float:
    return float(f"{value:.5g}")
