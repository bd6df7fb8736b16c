"""Power in steady flight: means over stretches in which nothing changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import FlightState
from planner.identify.noise import mean_with_error

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.states import StateSegment
    from planner.logs.record import FlightRecord

    FloatArray = npt.NDArray[np.float64]

_SETTLING_S = 5.0
"""Taken off the beginning of a steady stretch, where the power of the manoeuvre before it rings."""
_SHORTEST_S = 5.0
_HEIGHT_RANGE_M = 2.0
_SPEED_RANGE_M_S = 2.0
"""Largest difference between the 5th and the 95th percentile in a stretch that counts as steady."""


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyPower:
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


def steady_power(
    stretches_w: Sequence[FloatArray],
    *,
    step_s: float,
    height_above_home_m: float,
    airspeed_m_s: float = 0.0,
    air_density_kg_m3: float | None = None,
    mass_kg: float | None = None,
    source: str = "",
) -> SteadyPower:
    """Mean power over one or more stretches of the same steady flight.

    Parameters
    ----------
    stretches_w : sequence of ndarray, each shape (n,)
        Power, evenly sampled without a gap in each. [W]
    step_s : float
        Sampling step. [s]
    height_above_home_m, airspeed_m_s, air_density_kg_m3, mass_kg, source
        What was steady; see `SteadyPower`.

    Returns
    -------
    SteadyPower
        Mean with its standard error.

    Raises
    ------
    ValueError
        If there are fewer than two samples.
    """
    mean, error = mean_with_error(stretches_w)
    return SteadyPower(
        power_w=mean,
        error_w=error,
        duration_s=step_s * sum(stretch.size for stretch in stretches_w),
        height_above_home_m=height_above_home_m,
        airspeed_m_s=airspeed_m_s,
        air_density_kg_m3=air_density_kg_m3,
        mass_kg=mass_kg,
        source=source,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyStretch:
    """A hover or cruise of a record, and the mean power it gives, if any."""

    segment: StateSegment
    power: SteadyPower | None
    refusal: str = ""
    """Why it gives none; empty where it does."""


def steady_stretches(
    record: FlightRecord,
    segments: Sequence[StateSegment],
    *,
    air_density_kg_m3: FloatArray | None = None,
    mass_kg: float | None = None,
    settling_s: float = _SETTLING_S,
) -> tuple[SteadyStretch, ...]:
    """Mean powers of the hovers and cruises of a record.

    Parameters
    ----------
    record : FlightRecord
        One flight.
    segments : sequence of StateSegment
        Its flight states.
    air_density_kg_m3 : ndarray, shape (n,), optional
        Air density at each sample. [kg m⁻³]
    mass_kg : float, optional
        Mass that flew. [kg]
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
        power: SteadyPower | None = None
        if not refusal:
            is_hover = segment.state is FlightState.HOVER
            power = steady_power(
                [record.power_w[part]],
                step_s=step_s,
                height_above_home_m=float(record.height_above_home_m[part].mean()),
                airspeed_m_s=0.0 if is_hover else float(speed_through_air_m_s(record)[part].mean()),
                air_density_kg_m3=(
                    None if air_density_kg_m3 is None else float(air_density_kg_m3[part].mean())
                ),
                mass_kg=mass_kg,
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
