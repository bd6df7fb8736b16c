"""Physical constants with their sources, and the only unit conversions.

SI inside: metres, seconds, kilograms, watts, joules, radians.  Reports speak Wh, mAh, degrees.
"""

from __future__ import annotations

import math

GRAVITY_M_S2 = 9.80665
"""Standard gravity: 3rd CGPM (1901), resolution 2. [m s⁻²]"""

JOULES_PER_WATT_HOUR = 3600.0
SECONDS_PER_HOUR = 3600.0
MILLIAMPERE_HOURS_PER_AMPERE_HOUR = 1000.0


def wh_from_j(energy_j: float) -> float:
    """Energy in watt-hours from joules."""
    return energy_j / JOULES_PER_WATT_HOUR


def rad_from_deg(angle_deg: float) -> float:
    """Angle in radians from degrees."""
    return math.radians(angle_deg)
