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

from planner.identify.noise import mean_with_error
from planner.identify.steady import SteadyPower, speed_through_air_m_s
from planner.identify.timed_manoeuvres import timed_flight

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.timed_manoeuvres import TimedChange
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_CLIMBED = 0.95
"""Share of a climb after which it slows down. [-]"""
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
