r"""The International Standard Atmosphere up to 11 km, with the temperature and the pressure of the day.

.. math::
   p(h) = p_0 \left(1 - \frac{L h}{T_0}\right)^{g / (R L)}, \qquad \rho = \frac{p}{R T},

ISO 2533:1975; :math:`T` is the measured or standard temperature at home, falling by the standard
lapse rate above it.  :math:`p_0` is the pressure reduced to sea level by the same law, as altimeters are
set by it (QNH), or the standard one.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.units import GRAVITY_M_S2, ZERO_CELSIUS_K

if TYPE_CHECKING:
    import numpy.typing as npt

SEA_LEVEL_PRESSURE_PA = 101_325.0
"""ISO 2533:1975, table 1. [Pa]"""
SEA_LEVEL_TEMPERATURE_K = 288.15
"""ISO 2533:1975, table 1. [K]"""
LAPSE_RATE_K_M = 0.0065
"""Fall of temperature with height in the troposphere, ISO 2533:1975, table 4. [K m⁻¹]"""
GAS_CONSTANT_J_KG_K = 287.05287
"""Specific gas constant of dry air, ISO 2533:1975, table 1. [J kg⁻¹ K⁻¹]"""
_COLDEST_K = 1.0
"""The linear law would fall through zero. [K]"""
SEA_LEVEL_DENSITY_KG_M3 = 1.225
"""Of the standard atmosphere. [kg m⁻³]"""


def standard_temperature_c(altitude_amsl_m: float) -> float:
    """Return the standard temperature at an altitude. [°C]"""
    return SEA_LEVEL_TEMPERATURE_K - LAPSE_RATE_K_M * altitude_amsl_m - ZERO_CELSIUS_K


def air_density_kg_m3(
    altitude_amsl_m: npt.ArrayLike,
    *,
    home_amsl_m: float,
    home_temperature_c: float,
    sea_level_pressure_pa: float = SEA_LEVEL_PRESSURE_PA,
) -> npt.NDArray[np.float64]:
    """Return the air density at altitudes below 11 000 m, with the temperature at home given. [kg m⁻³]

    Examples
    --------
    >>> f"{float(air_density_kg_m3(0.0, home_amsl_m=0.0, home_temperature_c=15.0)):.4f}"
    '1.2250'
    """
    altitude = np.asarray(altitude_amsl_m, dtype=np.float64)
    exponent = GRAVITY_M_S2 / (GAS_CONSTANT_J_KG_K * LAPSE_RATE_K_M)
    # Above 44 km the law ends: what is left of the air carries nothing, and is not less than nothing.
    standard_k = np.maximum(SEA_LEVEL_TEMPERATURE_K - LAPSE_RATE_K_M * altitude, _COLDEST_K)
    pressure_pa = sea_level_pressure_pa * (standard_k / SEA_LEVEL_TEMPERATURE_K) ** exponent
    temperature_k = home_temperature_c + ZERO_CELSIUS_K - LAPSE_RATE_K_M * (altitude - home_amsl_m)
    return np.asarray(pressure_pa / (GAS_CONSTANT_J_KG_K * np.maximum(temperature_k, _COLDEST_K)))


def standard_density_kg_m3(altitude_amsl_m: float) -> float:
    """Return the density of standard air at an altitude. [kg m⁻³]"""
    temperature_c = standard_temperature_c(altitude_amsl_m)
    return float(
        air_density_kg_m3(
            altitude_amsl_m, home_amsl_m=altitude_amsl_m, home_temperature_c=temperature_c
        )
    )
