"""The reserve: what is to stay in a battery, as a share, as energy, or as time of hover."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import numbers
from planner.flight.motion.kinematics import KinematicState
from planner.flight.state import STATE_INDEX, FlightState
from planner.frozen import frozen
from planner.units import JOULES_PER_WATT_HOUR

if TYPE_CHECKING:
    from planner.flight.power import SteadyPower

HOVER_HEIGHT_M = 10.0
"""Height over home of the hover a reserve is counted in: low, over the landing place. [m]"""


@frozen
class Reserve:
    """What is to stay in a battery at landing; one of the three is given."""

    fraction: float | None = None
    """Of the capacity. [-]"""
    energy_wh: float | None = None
    hover_s: float | None = None
    """Time of hover over home. [s]"""

    def __post_init__(self) -> None:
        given = [one for one in (self.fraction, self.energy_wh, self.hover_s) if one is not None]
        if len(given) != 1 or not (math.isfinite(given[0]) and given[0] >= 0.0):
            msg = "a reserve is one of fraction, energy_wh or hover_s, zero or more"
            raise ValueError(msg)
        if self.fraction is not None and self.fraction > 1.0:
            msg = f"a reserve must be a fraction from 0 to 1, got {self.fraction}"
            raise ValueError(msg)

    def wh(self, *, capacity_wh: float, hover_power_w: float) -> float:
        """Return the energy that is to stay.

        Parameters
        ----------
        capacity_wh : float
            Energy of the full battery. [Wh]
        hover_power_w : float
            Power of the hover its time counts in. [W]
        """
        if self.fraction is not None:
            return self.fraction * capacity_wh
        if self.energy_wh is not None:
            return self.energy_wh
        return (self.hover_s or 0.0) * hover_power_w / JOULES_PER_WATT_HOUR

    def __str__(self) -> str:
        """Return for example ``20 %``, ``12.0 Wh``, ``3 min 00 s of hover``."""
        if self.fraction is not None:
            return numbers.percent(self.fraction)
        if self.energy_wh is not None:
            return numbers.energy(self.energy_wh)
        return f"{numbers.duration(self.hover_s)} of hover"


def hover_power_w(power: SteadyPower) -> float:
    """Return the power of a hover low over home, in the wind of the day. [W]"""
    zero = np.zeros(1)
    state = KinematicState(
        east_m=zero,
        north_m=zero,
        height_m=zero + HOVER_HEIGHT_M,
        east_m_s=zero,
        north_m_s=zero,
        climb_m_s=zero,
    )
    hovers = np.array([STATE_INDEX[FlightState.HOVER]])
    return float(power.power_w(state, hovers, zero)[0])
