"""Power in steady flight: means over stretches in which nothing changes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.flight.motion.kinematics import FlightState
from planner.identify.noise import mean_with_error
from planner.identify.outcome import Estimate
from planner.identify.states import run_bounds, slope_per_s
from planner.physics.atmosphere import air_density_kg_m3, standard_temperature_c
from planner.physics.rotor import Rotor, momentum_power_w
from planner.units import GRAVITY_M_S2
from planner.values import Value
from planner.vehicle.power import MomentumLaw

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.identify.states import StateSegment
    from planner.logs.record import FlightRecord


_SETTLING_S = 5.0
"""Taken off the beginning of a steady stretch, where the power of the manoeuvre before it rings."""
_SHORTEST_S = 5.0
_HEIGHT_RANGE_M = 2.0
_SPEED_RANGE_M_S = 2.0
"""Largest difference between the 5th and the 95th percentile in a stretch that counts as steady."""


class MeasuredPower(Value):
    """Mean power over steady flight at one height and speed."""

    power_w: float
    """Mean electrical power. [W]"""
    error_w: float
    """Standard error of the mean, memory of the noise counted. [W]"""
    duration_s: float
    """Time it was measured for. [s]"""
    height_above_home_m: float
    """Mean height. [m]"""
    airspeed_m_s: float = 0.0
    """Mean horizontal airspeed. [m/s]"""
    climb_rate_m_s: float = 0.0
    """Mean climb rate, descent negative. [m/s]"""
    air_density_kg_m3: float | None = None
    """Mean air density, where it is known. [kg m⁻³]"""
    mass_kg: float | None = None
    """Mass that flew, where it is known. [kg]"""
    source: str = ""
    """Name of the log."""
    start_s: float = 0.0
    """When it begins, in the flight. [s]"""


class SteadyStretch(Value):
    """A hover or cruise of a record, and the mean power it gives, if any."""

    segment: StateSegment
    power: MeasuredPower | None
    refusal: str = ""
    """Why it gives none; empty where it does."""


def steady_stretches(
    record: FlightRecord,
    segments: Sequence[StateSegment],
    *,
    settling_s: float = _SETTLING_S,
) -> tuple[SteadyStretch, ...]:
    """Mean powers of the hovers and cruises of a record.

    Parameters
    ----------
    record : FlightRecord
        One flight.
    segments : sequence of StateSegment
        Its flight states.
    settling_s : float
        Time left out at the beginning of each. [s]

    Returns
    -------
    tuple of SteadyStretch
        Every hover and cruise, used or refused.
    """
    found = []
    step_s = float(record.time_s[1] - record.time_s[0])
    for segment in segments:
        if segment.state not in {FlightState.HOVER, FlightState.CRUISE}:
            continue
        part = slice(segment.first + round(settling_s / step_s), segment.end)
        refusal = _unsteadiness(record, segment, part, step_s)
        power: MeasuredPower | None = None
        if not refusal:
            is_hover = segment.state is FlightState.HOVER
            mean_w, error_w = mean_with_error([record.power_w[part]])
            power = MeasuredPower(
                power_w=mean_w,
                error_w=error_w,
                duration_s=step_s * (part.stop - part.start),
                height_above_home_m=float(record.height_above_home_m[part].mean()),
                airspeed_m_s=0.0 if is_hover else float(speed_through_air_m_s(record)[part].mean()),
                source=f"{record.source}#{record.number}",
            )
        found.append(SteadyStretch(segment=segment, power=power, refusal=refusal))
    return tuple(found)


def speed_through_air_m_s(record: FlightRecord) -> FloatArray:
    """Horizontal airspeed of a record where it is told, else its ground speed (n,) [m/s]."""
    is_told = bool(np.isfinite(record.airspeed_m_s).any())
    return record.airspeed_m_s if is_told else record.ground_speed_m_s


def _unsteadiness(record: FlightRecord, segment: StateSegment, part: slice, step_s: float) -> str:
    """Why the power over a stretch is no steady power; empty where it is."""
    if (part.stop - part.start) * step_s < _SHORTEST_S:
        return f"lasts {segment.duration_s:.1f} s: too short to settle and to average"
    if not np.isfinite(record.power_w[part]).all():
        return "the log does not tell the power throughout"
    speed = speed_through_air_m_s(record)[part]
    if not np.isfinite([record.height_above_home_m[part], speed]).all():
        return "the log does not tell height and speed throughout"
    if np.ptp(np.percentile(record.height_above_home_m[part], (5, 95))) > _HEIGHT_RANGE_M:
        return "the height is not steady"
    if np.ptp(np.percentile(speed, (5, 95))) > _SPEED_RANGE_M_S:
        return "the speed is not steady"
    return ""


_SLOPE_S = 3.0
"""Window of an acceleration. [s]"""
_STEADY_M_S2 = 0.3
"""Mean acceleration over that below which flight is steady: gusts shake a vehicle by more than this."""
_FLIGHT_SETTLING_S = 1.5
"""Taken off the beginning of a stretch: the rotors still answer what was before it. [s]"""
_SHORTEST_FLIGHT_S = 3.0
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
) -> tuple[MeasuredPower, ...]:
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
    tuple of MeasuredPower
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
    settling, longest = round(_FLIGHT_SETTLING_S / step_s), round(_LONGEST_S / step_s)
    for start, end in zip(*run_bounds(steady), strict=True):
        if not steady[start]:
            continue
        pieces = max(1, round((end - start - settling) / longest))
        edges = np.linspace(start + settling, end, pieces + 1).astype(int)
        for first, last in zip(edges[:-1].tolist(), edges[1:].tolist(), strict=True):
            if (last - first) * step_s < _SHORTEST_FLIGHT_S:
                continue
            part = slice(first, last)
            power_w, error_w = mean_with_error([record.power_w[part]])
            found.append(
                MeasuredPower(
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


_DISK_LOADING_N_M2 = 70.0
"""Of multirotors from 30 to 160: centre of the prior of the disk area. [N m⁻²]"""
_DRAG_AREA_AT_1_KG_M2 = 0.015
"""Of a body of 1 kg, growing with the mass to the power 2/3: centre of its prior. [m²]"""
_FACTORS = (1.6, 1.4, 0.35, 0.2)
"""Centres of the priors of the factors: electrical over ideal watts. [-]"""
_SPREADS = (0.5, 0.8, 0.3, 0.3, 0.6, 1.0)
"""Standard deviations of the priors, of the logarithms. [-]"""
_MODEL_SHARE = 0.01
"""To which momentum theory describes a multirotor. [-]"""
_LEAST_CELLS = 3
"""Of level flight, hover counted: fewer tell nothing about the power over speed."""


class SteadyMap(Value, eq=False):
    """Momentum theory fitted to steady flight."""

    law: MomentumLaw
    estimates: tuple[Estimate, ...]
    """The six numbers with their errors."""
    from_prior: tuple[str, ...]
    """Those of which the flights tell next to nothing."""
    cells: int
    """Number of different airspeeds and climb rates."""
    beyond_kg: Mapping[str, float]
    """Mass of each flight beyond the one given, by source, where it was fitted. [kg]"""

    def residuals_w(self, flights: Sequence[MeasuredPower]) -> FloatArray:
        """Return predicted less measured power of steady flights, (n,) [W]."""
        values = np.array([getattr(self.law, name) for name in Rotor._fields])
        measured: FloatArray = np.array([f.power_w for f in flights])
        beyond_kg = np.array([self.beyond_kg.get(f.source, 0.0) for f in flights])
        return _powers_w(values, flights, beyond_kg) - measured


def cell_of(flight: MeasuredPower) -> tuple[int, int]:
    """Return the cell of the map that a steady flight belongs to: 1 m/s by 0.5 m/s."""
    return round(flight.airspeed_m_s), round(2.0 * flight.climb_rate_m_s)


def fit_steady_map(
    flights: Sequence[MeasuredPower], *, mass_deviation_kg: float = 0.0
) -> SteadyMap:
    """Fit momentum theory to steady flights.

    Parameters
    ----------
    flights : sequence of MeasuredPower
        With mass and air density, in three cells of level flight at least.
    mass_deviation_kg : float
        Standard deviation of the mass from flight to flight, where the payload is not known: each
        flight then has a mass of its own, fitted beside the law. [kg]

    Returns
    -------
    SteadyMap
        The law, its errors, and what came from the priors.

    Raises
    ------
    IdentificationError
        If a mass or a density is not known, or there are too few airspeeds.
    """
    from scipy.optimize import least_squares

    if any(f.mass_kg is None or f.air_density_kg_m3 is None for f in flights):
        msg = "momentum theory needs the mass and the air density of every steady flight"
        raise IdentificationError(msg)
    cells = [cell_of(f) for f in flights]
    level = {speed for speed, climb in cells if climb == 0}
    if len(level) < _LEAST_CELLS:
        msg = (
            f"momentum theory needs level flight at {_LEAST_CELLS} airspeeds, hover counted, "
            f"the flights have {len(level)}"
        )
        raise IdentificationError(msg)
    powers = np.array([f.power_w for f in flights])
    errors = np.hypot([f.error_w for f in flights], _MODEL_SHARE * powers)
    counts = np.array([cells.count(cell) for cell in cells])
    scale = errors * np.sqrt(counts)
    mass_kg = float(np.mean([f.mass_kg or 0.0 for f in flights]))
    centre = np.log(
        [
            mass_kg * GRAVITY_M_S2 / _DISK_LOADING_N_M2,
            _DRAG_AREA_AT_1_KG_M2 * mass_kg ** (2.0 / 3.0),
            *_FACTORS,
        ]
    )
    spreads = np.array(_SPREADS)

    sources = sorted({f.source for f in flights}) if mass_deviation_kg > 0.0 else []
    flight_of = [sources.index(f.source) for f in flights] if sources else []

    def residuals(x: FloatArray) -> FloatArray:
        own, beyond = x[: len(Rotor._fields)], x[len(Rotor._fields) :]
        beyond_kg = mass_deviation_kg * beyond[flight_of] if sources else 0.0
        data = (_powers_w(np.exp(own), flights, beyond_kg) - powers) / scale
        return np.concatenate([data, (own - centre) / spreads, beyond])

    start = np.concatenate([centre, np.zeros(len(sources))])
    size = np.concatenate([spreads, np.ones(len(sources))])
    found = least_squares(residuals, start, jac="3-point", x_scale=size)
    if not found.success:
        msg = "the fit of momentum theory to the steady flights did not end"
        raise IdentificationError(msg)
    data = found.fun[: powers.size]
    surplus = len(set(cells)) - len(Rotor._fields)
    scatter = max(1.0, float(data @ data) / surplus) if surplus > 0 else 1.0
    of_data = found.jac[: powers.size]
    information = of_data.T @ of_data / scatter + np.diag(size**-2.0)
    deviations = np.sqrt(np.diagonal(np.linalg.inv(information)))
    values = np.exp(found.x[: len(Rotor._fields)])
    law = MomentumLaw(**{name: _rounded(v) for name, v in zip(Rotor._fields, values, strict=True)})
    return SteadyMap(
        law=law,
        estimates=tuple(
            Estimate(name=name, value=getattr(law, name), error=_rounded(float(v * d)))
            for name, v, d in zip(
                Rotor._fields, values, deviations[: len(Rotor._fields)], strict=True
            )
        ),
        from_prior=tuple(
            name
            for name, d, spread in zip(
                Rotor._fields, deviations[: len(Rotor._fields)], spreads, strict=True
            )
            if d > 0.8 * spread
        ),
        cells=len(set(cells)),
        beyond_kg={
            source: mass_deviation_kg * float(x)
            for source, x in zip(sources, found.x[len(Rotor._fields) :], strict=True)
        },
    )


def _powers_w(
    values: FloatArray, flights: Sequence[MeasuredPower], beyond_kg: FloatArray | float = 0.0
) -> FloatArray:
    """Return the power of steady flights by the six numbers, (n,) [W]."""
    powers = np.empty(len(flights))
    masses = np.array([f.mass_kg or 0.0 for f in flights]) + beyond_kg
    speed = np.array([f.airspeed_m_s for f in flights])
    climb = np.array([f.climb_rate_m_s for f in flights])
    density = np.array([f.air_density_kg_m3 or 0.0 for f in flights])
    for mass_kg in np.unique(masses):
        own = masses == mass_kg
        powers[own] = momentum_power_w(
            speed[own],
            climb[own],
            Rotor(*values.tolist()),
            mass_kg=float(mass_kg),
            air_density_kg_m3=density[own],
        )
    return powers


def _rounded(value: float) -> float:
    """Six digits: far more than flights tell, and short enough for people to compare."""
    return float(f"{value:.6g}") if math.isfinite(value) else value
