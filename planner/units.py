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

KELVINS_PER_FAHRENHEIT = 5.0 / 9.0
FREEZING_F = 32.0
"""0 °C on Fahrenheit's scale. [°F]"""

PASCALS_PER_HECTOPASCAL = 100.0
PRESSURE_UNITS_HPA = {"hpa": 1.0, "mbar": 1.0, "mb": 1.0, "kpa": 10.0, "pa": 0.01, "inhg": 33.8639}
"""The inch of mercury at 0 °C and standard gravity: 3386.39 Pa (NIST SP 811, appendix B)."""
JOULES_PER_WATT_HOUR = 3600.0
SECONDS_PER_HOUR = 3600.0
SECONDS_PER_MINUTE = 60.0
MASS_UNITS_KG = {"kg": 1.0, "g": 1e-3, "lb": 0.45359237, "oz": 0.45359237 / 16}
"""The pound: international agreement of 1959. [kg]"""
LENGTH_UNITS_M = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "km": 1e3, "ft": 0.3048}
"""The foot: international agreement of 1959. [m]"""
_KNOT_M_S = 1852 / 3600
SPEED_UNITS_M_S = {"m/s": 1.0, "km/h": 1 / 3.6, "kt": _KNOT_M_S, "kn": _KNOT_M_S, "mph": 0.44704}
"""The knot: nautical miles of 1852 m (Monaco, 1929) an hour. [m s⁻¹]"""
TIME_UNITS_S = {"s": 1.0, "min": 60.0, "h": 3600.0}
MILLIAMPERE_HOURS_PER_AMPERE_HOUR = 1000.0

FASTEST_M_S = 100.0
"""No multicopter is faster, and in no such wind does one fly. [m s⁻¹]"""


def j_from_wh(energy_wh: Quantity) -> Quantity:
    """Energy in joules from watt-hours."""
    return energy_wh * JOULES_PER_WATT_HOUR


def wh_from_j(energy_j: Quantity) -> Quantity:
    """Energy in watt-hours from joules."""
    return energy_j / JOULES_PER_WATT_HOUR
