"""Steady flight found in a record: stretches in which the vehicle does not accelerate.

Hovers, cruises, climbs and descents alike; their mean powers are what a map of power over airspeed and
climb rate is fitted to (`planner.identify.steady_map`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.identify.noise import mean_with_error
from planner.identify.states import run_bounds, slope_per_s
from planner.identify.steady import SteadyPower, speed_through_air_m_s
from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]

_SLOPE_S = 3.0
"""Window of an acceleration. [s]"""
_STEADY_M_S2 = 0.3
"""Mean acceleration over that below which flight is steady: gusts shake a vehicle by more than this."""
_SETTLING_S = 1.5
"""Taken off the beginning of a stretch: the rotors still answer what was before it. [s]"""
_SHORTEST_S = 3.0
_LONGEST_S = 20.0
"""Longer stretches are cut: height, wind and density change over them. [s]"""
_GROUND_S = 3.0
"""Left out after lift-off and before touch-down: the ground carries part of the weight. [s]"""


def record_air_density_kg_m3(
    record: FlightRecord, *, home_temperature_c: float | None = None
) -> FloatArray:
    """Density of the air along a record.

    Parameters
    ----------
    record : FlightRecord
        One flight.
    home_temperature_c : float, optional
        Air temperature at home; left out, that of the standard atmosphere there. [°C]

    Returns
    -------
    ndarray, shape (n,)
        NaN where no height is known. [kg m⁻³]
    """
    home_amsl_m = record.home.altitude_amsl_m or 0.0
    altitude = record.altitude_amsl_m
    if not np.isfinite(altitude).any():
        altitude = record.height_above_home_m + home_amsl_m
    temperature_c = (
        standard_temperature_c(home_amsl_m) if home_temperature_c is None else home_temperature_c
    )
    return air_density_kg_m3(altitude, home_amsl_m=home_amsl_m, home_temperature_c=temperature_c)


def steady_flight(
    record: FlightRecord,
    *,
    air_density_kg_m3: FloatArray,
    mass_kg: float | None = None,
) -> tuple[SteadyPower, ...]:
    """Mean powers of all steady flight of a record.

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
        In the order flown; empty where the log tells no power or no motion.
    """
    step_s = float(record.time_s[1] - record.time_s[0])
    airspeed = speed_through_air_m_s(record)
    climb = record.climb_m_s
    if not np.isfinite(climb).any():
        climb = slope_per_s(record.height_above_home_m, round(3.0 / step_s), step_s)
    columns = np.stack([record.power_w, airspeed, climb, air_density_kg_m3])
    steady = (
        np.isfinite(columns).all(axis=0)
        & _is_clear_of_ground(record.is_landed, step_s)
        & (_acceleration_m_s2(record, climb, step_s) < _STEADY_M_S2)
    )
    found = []
    settling, longest = round(_SETTLING_S / step_s), round(_LONGEST_S / step_s)
    for start, end in zip(*run_bounds(steady), strict=True):
        if not steady[start]:
            continue
        pieces = max(1, round((end - start - settling) / longest))
        edges = np.linspace(start + settling, end, pieces + 1).astype(int)
        for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if (last - first) * step_s < _SHORTEST_S:
                continue
            part = slice(first, last)
            power_w, error_w = mean_with_error([record.power_w[part]])
            found.append(
                SteadyPower(
                    power_w=power_w,
                    error_w=error_w,
                    duration_s=(last - first) * step_s,
                    height_above_home_m=float(np.nanmean(record.height_above_home_m[part])),
                    airspeed_m_s=float(airspeed[part].mean()),
                    climb_rate_m_s=_mean_climb_m_s(record, climb, part),
                    air_density_kg_m3=float(air_density_kg_m3[part].mean()),
                    mass_kg=mass_kg,
                    source=f"{record.source}#{record.number}",
                    start_s=float(record.time_s[first]),
                )
            )
    return tuple(found)


def _mean_climb_m_s(record: FlightRecord, climb_m_s: FloatArray, part: slice) -> float:
    """Mean climb rate by the heights where they are known: climb rates are often biased in cruise."""
    heights = record.height_above_home_m[part]
    if not np.isfinite(heights).all():
        return float(climb_m_s[part].mean())
    return float(np.polyfit(record.time_s[part], heights, 1)[0])


def _acceleration_m_s2(record: FlightRecord, climb_m_s: FloatArray, step_s: float) -> FloatArray:
    """Magnitude of the acceleration over ground; of the speed where the velocity is not known."""
    window = round(_SLOPE_S / step_s)
    columns = [record.velocity_north_m_s, record.velocity_east_m_s]
    if not np.isfinite(columns).any(axis=1).all():
        columns = [speed_through_air_m_s(record)]
    slopes = [slope_per_s(column, window, step_s) for column in (*columns, climb_m_s)]
    magnitude: FloatArray = np.sqrt(np.sum(np.square(slopes), axis=0))
    return np.where(np.isfinite(magnitude), magnitude, np.inf)


def _is_clear_of_ground(is_landed: BoolArray, step_s: float) -> BoolArray:
    """Where the vehicle is not on the ground, nor was or will be in a moment."""
    near = round(_GROUND_S / step_s)
    kernel = np.ones(2 * near + 1)
    return np.convolve(is_landed, kernel, mode="same")[: is_landed.size] < 0.5
