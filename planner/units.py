"""Physical constants with their sources, and the conversions of units.

SI inside: metres, seconds, kilograms, watts, joules, radians.  Reports speak Wh, mAh, degrees.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, TypeVar

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

Quantity = TypeVar("Quantity", float, "npt.NDArray[np.float64]")

GRAVITY_M_S2 = 9.80665
"""Standard gravity: 3rd CGPM (1901), resolution 2. [m s⁻²]"""

ZERO_CELSIUS_K = 273.15
"""0 °C on the thermodynamic scale: 13th CGPM (1967), resolution 3. [K]"""

JOULES_PER_WATT_HOUR = 3600.0
SECONDS_PER_HOUR = 3600.0
SECONDS_PER_MINUTE = 60.0
MASS_UNITS_KG = {"kg": 1.0, "g": 1e-3, "lb": 0.45359237}
"""The pound: international agreement of 1959. [kg]"""
MILLIAMPERE_HOURS_PER_AMPERE_HOUR = 1000.0

FASTEST_M_S = 100.0
"""No multicopter is faster, and in no such wind does one fly. [m s⁻¹]"""


def j_from_wh(energy_wh: Quantity) -> Quantity:
    """Energy in joules from watt-hours."""
    return energy_wh * JOULES_PER_WATT_HOUR


def wh_from_j(energy_j: Quantity) -> Quantity:
    """Energy in watt-hours from joules."""
    return energy_j / JOULES_PER_WATT_HOUR
