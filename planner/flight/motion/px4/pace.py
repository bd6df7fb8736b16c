"""Pace: how fast PX4's time passes while the vehicle is off its trajectory."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.vehicle.parameters.px4 import Px4Parameters

_WANDER_SHARE = 0.7
"""Ground speed of a hovering vehicle over the speed its position controller asks for, MPC_XY_P times
the position error: the rest is movement only the estimate makes.  0.70, 0.69 and 0.69 measured in three
simulated flights, where the truth is known. [-]"""

_LAG_S = 0.1
"""Time by which the speed of a vehicle that speeds up is behind that of its trajectory: 0.10 s identified,
as of a second-order answer, from three simulated flights. [s]"""


@frozen
class Pace:
    """Seconds of PX4's trajectory per second of flight, by horizontal speed of the trajectory.

    Notes
    -----
    Each step the trajectory's time advances by 1 − e/MPC_XY_ERR_MAX of the real time while the vehicle is
    behind it, e the distance between the two on the map; the height waits with it
    (``PositionSmoothing::_generateTrajectory``; PX4 after 1.17 slows the height by its own error only).
    Recorded speeds of the trajectory agree with that to 0.0001 in the mean of climbs and descents.

    With noise alone the vehicle is behind half of the time.  Moving, a trajectory that waits is caught up
    with: let ẋ = w − MPC_XY_P x − v (1 − pace) be the error along the way, x > 0 behind.  In a hover its
    deviation is σ = ē √(2/π), ē the mean of e, and the disturbance w, slower than 1/MPC_XY_P as it is
    (correlated over 2.5 s in three recordings), has MPC_XY_P σ.  At speed the time stretches by just as
    much as w pushes the vehicle back, v (1 − pace) = E[max(w, 0)] = MPC_XY_P σ/√(2π) = MPC_XY_P ē/π; at
    none it does so by ē/(2 MPC_XY_ERR_MAX).  The hyperbola through both,

        1 − pace = ē/(2 MPC_XY_ERR_MAX) / (1 + v/v₀),  v₀ = (2/π) MPC_XY_P MPC_XY_ERR_MAX,

    is within a fifth of what a w from a normal distribution gives in between.  Recorded at 0.32 m, in the
    524 s of four flights' cruises at 3 to 12 m/s: 0.070 m/s lost; the law: 0.078.
    """

    share: float
    """ē/MPC_XY_ERR_MAX. [-]"""
    half_speed_m_s: float
    """v₀: speed at which half of the slowing down is left. [m s⁻¹]"""
    lag_s: float
    """Time by which the vehicle lags as far as it is lost. [s]"""
    wander_m_s: float
    """Ground speed of the vehicle where its trajectory stands. [m s⁻¹]"""

    @classmethod
    def of(cls, hover_noise_m: float, parameters: Px4Parameters) -> Pace:
        """Return the pace of a vehicle with a mean horizontal position error in a hover.

        Raises
        ------
        ValueError
            If the error is not zero or more and below MPC_XY_ERR_MAX, where time stands still.
        """
        share = hover_noise_m / parameters.position_error_max_m
        if not 0.0 <= share < 1.0:
            msg = (
                f"hover_noise_m must be from 0 to below MPC_XY_ERR_MAX "
                f"({parameters.position_error_max_m:g} m), got {hover_noise_m}"
            )
            raise ValueError(msg)
        gain = parameters.position_gain_per_s
        lag_m = _LAG_S * parameters.acceleration_m_s2 / gain
        return cls(
            share=share,
            half_speed_m_s=2.0 / math.pi * gain * parameters.position_error_max_m,
            lag_s=_LAG_S * min(hover_noise_m / lag_m, 1.0),
            wander_m_s=_WANDER_SHARE * gain * hover_noise_m,
        )

    @property
    def standing(self) -> float:
        """Where the trajectory stands still on the map: it counts as led by the vehicle never. [-]"""
        return 1.0 - self.share

    @property
    def upright(self) -> float:
        """Where it creeps: straight up, down, or settling on a place. [-]"""
        return 1.0 - 0.5 * self.share

    def between(self, first_m_s: FloatArray, last_m_s: FloatArray) -> FloatArray:
        """Return the mean pace of evenly changing horizontal speeds, by their ends.

        The mean of 1/(1 + v/v₀) over v is v₀ ln(r)/(v₂ − v₁), r the ratio of v + v₀.
        """
        low = self.half_speed_m_s + np.minimum(first_m_s, last_m_s)
        grown = np.abs(last_m_s - first_m_s) / low
        changes = grown > _SMALL
        mean = np.divide(np.log1p(grown), grown, out=1.0 - 0.5 * grown, where=changes)
        pace: FloatArray = 1.0 - 0.5 * self.share * self.half_speed_m_s / low * mean
        return pace

    def lagging(
        self, duration_s: FloatArray, first_m_s: FloatArray, last_m_s: FloatArray
    ) -> FloatArray:
        """Return the mean pace where a vehicle speeds up behind a turn.

        Parameters
        ----------
        duration_s : ndarray
            In the trajectory's time. [s]
        first_m_s, last_m_s : ndarray
            Horizontal speeds before and after. [m s⁻¹]

        Notes
        -----
        Accelerating at a the vehicle lags: ẋ = w + T a − MPC_XY_P x − v x/E, T = _LAG_S, E = MPC_XY_ERR_MAX.
        At rest x/E = T a/(MPC_XY_P E + v), which sums up to T ln((MPC_XY_P E + v₂)/(MPC_XY_P E + v₁)).
        As braking puts it ahead by T a/MPC_XY_P before, that is only lost with a noise as large, and with
        none next to nothing.
        """
        catching_m_s = 0.5 * math.pi * self.half_speed_m_s
        gained = np.log1p(np.maximum(last_m_s - first_m_s, 0.0) / (catching_m_s + first_m_s))
        flown = duration_s / self.between(first_m_s, last_m_s) + self.lag_s * gained
        pace: FloatArray = np.divide(
            duration_s, flown, out=np.ones_like(flown), where=duration_s > 0.0
        )
        return pace

    def wandered_m(self, time_s: FloatArray, way_m: FloatArray) -> FloatArray:
        """Return how much longer than their ways on the map flights of some time are. [m]

        √(v² + w²) − v for each second: the mean length of a velocity v with a normal disturbance whose
        mean length is w.
        """
        return np.hypot(way_m, self.wander_m_s * time_s) - way_m


_SMALL = 1e-6
"""Change of speed below which a series does. [-]"""
