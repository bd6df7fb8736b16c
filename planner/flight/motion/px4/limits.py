"""Limits: what limits the speed along straights, on two axes at once."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.ramps import ramp_time_s
from planner.flight.motion.px4.speeds import allowed_speed_m_s, braking_distance_m, half_b_m_s
from planner.flight.motion.px4.turns import CLAMPED_M_S
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.vehicle.parameters.px4 import Px4Parameters


_LEVEL, _UPRIGHT = 0, 1
"""The two laws that limit a speed: of the horizontal and of the vertical axes."""


@frozen(eq=False)
class Limits(Columns):
    """What limits the speed along straights; lengths and speeds count along them."""

    direction: FloatArray
    """Unit vectors. (n, 3)"""
    length_m: FloatArray
    tail_m: FloatArray
    """From the end of the straight on to its target."""
    cruise_m_s: FloatArray
    ramp_m_s2: FloatArray
    """Greatest acceleration."""
    ramp_m_s3: FloatArray
    """Greatest jerk of it."""
    binds: BoolArray
    """Which of the two braking laws count. (n, 2)"""
    brake_m_s2: FloatArray
    """Acceleration of the braking laws. (n, 2)"""
    brake_m_s3: FloatArray
    """Jerk of the braking laws. (n, 2)"""
    final_m_s: FloatArray
    """Final speed of the braking laws. (n, 2)"""

    def allowed_m_s(self, distance_m: FloatArray) -> FloatArray:
        """Return the speeds both laws allow so far from the target, infinite where unbound. (n, 2)"""
        speed = allowed_speed_m_s(
            distance_m[:, None],
            self.final_m_s,
            acceleration_m_s2=self.brake_m_s2,
            jerk_m_s3=self.brake_m_s3,
        )
        return np.where(self.binds, speed, np.inf)

    def lowest_allowed_m_s(self, distance_m: FloatArray) -> FloatArray:
        """Return the speeds all laws allow at distances from the target. (n,) [m s⁻¹]"""
        allowed = self.allowed_m_s(distance_m)
        return np.minimum(allowed[:, _LEVEL], allowed[:, _UPRIGHT])

    def way_m(self, speed_m_s: FloatArray, law: IntArray) -> FloatArray:
        """Return how far before the target one law of each row allows speeds. (n,) [m]"""
        rows = np.arange(len(law))
        a, final = self.brake_m_s2[rows, law], self.final_m_s[rows, law]
        half_b = half_b_m_s(a, self.brake_m_s3[rows, law])
        way: FloatArray = (speed_m_s * (speed_m_s + 2.0 * half_b) - final**2) / (2.0 * a)
        return way

    def reach_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target braking from speeds begins. (n,) [m]"""
        way = braking_distance_m(
            speed_m_s[:, None],
            self.final_m_s,
            acceleration_m_s2=self.brake_m_s2,
            jerk_m_s3=self.brake_m_s3,
        )
        level, upright = way[:, _LEVEL], way[:, _UPRIGHT]
        binds = self.binds
        return np.maximum(
            np.where(binds[:, _LEVEL], level, 0.0), np.where(binds[:, _UPRIGHT], upright, 0.0)
        )


def limits_along(
    start_m: FloatArray,
    end_m: FloatArray,
    *,
    tail_m: FloatArray,
    speed_m_s: FloatArray,
    final_level_m_s: FloatArray,
    final_upright_m_s: FloatArray,
    parameters: Px4Parameters,
) -> Limits:
    """Return what limits the speed along straights.

    Parameters
    ----------
    start_m, end_m : ndarray
        Their ends. (n, 3) [m]
    tail_m : ndarray
        From the end on to the target. (n,) [m]
    speed_m_s : ndarray
        Greatest horizontal speed. (n,) [m s⁻¹]
    final_level_m_s, final_upright_m_s : ndarray
        Horizontal and vertical speed at the target. (n,) [m s⁻¹]
    parameters : Px4Parameters
        The vehicle's.

    Notes
    -----
    The velocity points at the target; its horizontal and its vertical part both stay below what their
    axes allow, so the slower scales the whole (``clampToXYNorm``, ``clampToZNorm``).  With c and s the
    horizontal and vertical parts of the direction, an axis limited to v, a, j limits the straight to
    v/c, a/c, j/c.  Below 0.5 m/s only the slow axis is slowed: a gentle slope that ends level does not
    stop the flight.  Each of the north and east axes has the whole acceleration to itself.
    """
    way = end_m - start_m
    length = np.sqrt((way**2).sum(axis=1))
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=length[:, None] > 0.0)
    level = np.hypot(direction[:, 0], direction[:, 1])
    upright = np.abs(direction[:, 2])
    rising = direction[:, 2] > 0.0
    vertical = np.where(rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    vertical_speed = np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    jerk = np.full_like(length, parameters.jerk_m_s3)
    shares = np.maximum(np.column_stack((level, upright)), 1e-9)
    cruise = np.minimum(speed_m_s / shares[:, 0], vertical_speed / shares[:, 1])

    acceleration = np.column_stack((np.full_like(length, parameters.acceleration_m_s2), vertical))
    at_end = np.minimum(
        speed_m_s,
        allowed_speed_m_s(
            level * tail_m,
            final_level_m_s,
            acceleration_m_s2=acceleration[:, 0],
            jerk_m_s3=jerk,
        ),
    )
    steep = upright > level
    binds = np.column_stack(
        (
            ~steep | (level * cruise >= CLAMPED_M_S),
            steep | (at_end * upright >= CLAMPED_M_S * shares[:, 0]),
        )
    )

    # Acceleration: the axis that takes longest sets the time of all.
    widest = np.maximum(np.abs(direction[:, :2]).max(axis=1), 1e-9)
    axes = np.column_stack((widest, shares[:, 1]))
    times = ramp_time_s(
        cruise[:, None] * axes, acceleration_m_s2=acceleration, jerk_m_s3=jerk[:, None]
    )
    slowest = np.where(times[:, 1] > times[:, 0], 1, 0)
    rows = np.arange(len(length))
    share = axes[rows, slowest]
    return Limits(
        direction=direction,
        length_m=length,
        tail_m=tail_m,
        cruise_m_s=cruise,
        ramp_m_s2=acceleration[rows, slowest] / share,
        ramp_m_s3=jerk / share,
        binds=binds,
        brake_m_s2=acceleration / shares,
        brake_m_s3=jerk[:, None] / shares,
        final_m_s=np.column_stack((final_level_m_s, final_upright_m_s)) / shares,
    )
