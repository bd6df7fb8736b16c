"""How well flights repeat that nothing but chance sets apart: what is known before a vehicle has flown.

Few flights show their own spread badly: three that happen to agree would promise what the fourth does not
keep.  What is known beforehand counts as one observation of each at most, the unit information of R. E. Kass
and L. Wasserman, J. Am. Stat. Assoc. 90 (1995) 928; the flights of a vehicle soon outweigh it.
"""

from __future__ import annotations

from planner.autopilot import Autopilot
from planner.values import Value

ENERGY_FRACTION = 0.006
"""Of the energy of a flight: one mission flown four times by one DJI Matrice 100 with one payload (Rodrigues
et al., Sci. Data 8:155, 2021) took ±0.6 %. [-]"""


WIND_ENERGY_FRACTION_S_M = 0.006
"""Of the energy of a flight, for each m/s of mean wind: the wind told is not the wind flown in, and a law of
power fitted in one wind errs in another, both in proportion to it.  Over 87 flights of one DJI Matrice 100
what was predicted fell behind what was flown by 0.63 ± 0.19 % for each m/s. [s m⁻¹]"""


DAY_FRACTION = 0.02
"""Of the power of a flight: calibration of the current, air and propellers of the day, where a model knows
nothing of other days; a power module is calibrated to 1 to 3 %. [-]"""


class Repeatability(Value):
    """Standard deviations of the times of an autopilot, where the position is known without noise.

    ``None`` where nothing is known beforehand.
    """

    time_fraction: float
    """Of the time of a flight. [-]"""
    leg_s: float | None = None
    """Of the time of a leg, besides. [s]"""
    landing_s: float | None = None
    """Of the time of a landing until the motors stop, besides. [s]"""


REPEATABILITY = {
    # Long legs take 0.1 % longer than their S-curves, unexplained; others are off by 0.01 to 0.16 s (root
    # mean square by kind of leg).  From touch-down to disarming take 1.9 to 3.1 s, evenly: 1.2 s / √12.
    Autopilot.ARDUPILOT: Repeatability(time_fraction=0.001, leg_s=0.1, landing_s=0.35),
    # 43 flights of little noise took -0.7 to +1.0 % of their prediction, evenly: 1.7 % / √12; four legs of
    # 300 m at 3 to 12 m/s 0.1 to 0.3 s; the thrust has gone 0.45 s after touch-down (LANDED_AFTER_S).
    Autopilot.PX4: Repeatability(time_fraction=0.005, leg_s=0.17, landing_s=0.45),
    # Stop-to-stop trapezoids against 196 flights of a DJI Matrice 100: 2.4 %.
    Autopilot.STEP: Repeatability(time_fraction=0.024),
}
"""Measured on recorded flights of each, before any vehicle's own (autopilots' defaults, calm air)."""
