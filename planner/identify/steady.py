"""Power in steady flight: means over stretches in which nothing changes."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from planner.identify.noise import mean_with_error

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy as np
    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]


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
    air_density_kg_m3: float | None = None
    """Mean air density, where it is known. [kg m⁻³]"""
    mass_kg: float | None = None
    """Mass that flew, where it is known. [kg]"""
    source: str = ""
    """Name of the log."""


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
