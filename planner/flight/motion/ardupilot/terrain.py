r"""How fast ArduPilot follows the ground: it slows down where that rises or falls faster than it can.

A leg to an altitude above terrain is flown over the ground as over a plane; the ground's height h is
added to it, shaped by the vertical limits (``AC_PosControl::update_terrain``).  The shaped height z
follows with an error e = h − z at the speed of a square-root controller,

.. math:: \dot z = \min\left(\sqrt{2 b (e - b / 2 k^2)},\; v_{up}\right), \qquad |\ddot z| \le A_z,

b half the vertical acceleration A_z and k the gain of a change of height, and likewise downwards.
Where e exceeds half of the margin m (WP_TER_MARGIN), the vehicle goes on more slowly
(``pos_terrain_U_scaler_m``),

.. math:: v = V \cdot \max\left(0.01,\; 1 - \frac{|e| - m/2}{m/2}\right),

changing its speed by WP_ACC.  Over a long slope g it settles where g v = v_up: at v_up/g.  A rise of
less than m/2 costs nothing, however steep.

The differential equations are stepped over the heights of the ground on the way; of the leg its mean
speed is taken.  Neglected: the jerk of these changes, and the ramps of the leg itself.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.ardupilot.vertical import (
    BRAKING_SHARE,
    height_gain_per_s,
)

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_STEP_S = 0.05
_HARMLESS_M_S = 1.0
"""Ground that rises and falls no faster than this is followed without slowing down. [m s⁻¹]"""
_SLOWEST = 0.01
"""``pos_terrain_U_scaler_m`` leaves so much of the speed. [-]"""


def followed_speed_m_s(
    stage: IntArray,
    ground_m: FloatArray,
    length_m: FloatArray,
    speed_m_s: FloatArray,
    *,
    climb_m_s: FloatArray,
    descent_m_s: FloatArray,
    parameters: ArduPilotParameters,
) -> FloatArray:
    """Return the mean horizontal speeds of legs that follow the ground.

    Parameters
    ----------
    stage : ndarray of int
        Stage of each leg, rising; legs of consecutive stages follow each other. (n,)
    ground_m : ndarray
        Heights of the ground, evenly spaced from the beginning of each leg to its end. (n, k) [m]
    length_m : ndarray
        Horizontal lengths. (n,) [m]
    speed_m_s : ndarray
        Commanded horizontal speeds. (n,) [m s⁻¹]
    climb_m_s, descent_m_s : ndarray
        Vertical speed limits. (n,) [m s⁻¹]
    parameters : ArduPilotParameters
        The vehicle's parameters.

    Returns
    -------
    ndarray
        The commanded speed where nothing slows a leg down. (n,) [m s⁻¹]
    """
    found = speed_m_s.copy()
    slope = np.abs(np.diff(ground_m, axis=1)) * (ground_m.shape[1] - 1)
    steep = (slope.max(axis=1) * speed_m_s > _HARMLESS_M_S * length_m) & (length_m > 0.0)
    if not steep.any() or parameters.terrain_margin_m == 0.0:
        return found
    before: int | None = None
    motion = _LEVEL
    for row in np.flatnonzero(steep).tolist():
        follows = before is not None and stage[row] == stage[before] + 1
        leg = _Leg(
            ground_m=ground_m[row].tolist(),
            length_m=float(length_m[row]),
            speed_m_s=float(speed_m_s[row]),
            climb_m_s=float(climb_m_s[row]),
            descent_m_s=float(descent_m_s[row]),
        )
        begin = motion if follows else _LEVEL
        duration_s, motion = leg.flown(begin, parameters)
        found[row] = min(leg.length_m / duration_s, leg.speed_m_s)
        before = row
    return found


class _Motion(NamedTuple):
    """How a vehicle comes to a leg or leaves it."""

    error_m: float
    """Of its height against that of the ground. [m]"""
    rate_m_s: float
    """Vertical speed. [m s⁻¹]"""
    pace: float
    """Horizontal speed over the commanded one. [-]"""


_LEVEL = _Motion(0.0, 0.0, 1.0)


class _Leg(NamedTuple):
    """A leg over ground that may slow it down."""

    ground_m: list[float]
    length_m: float
    speed_m_s: float
    climb_m_s: float
    descent_m_s: float

    def flown(self, begin: _Motion, parameters: ArduPilotParameters) -> tuple[float, _Motion]:
        """Return the duration [s] and how the leg is left."""
        half_m = 0.5 * parameters.terrain_margin_m
        most_up = parameters.vertical_acceleration_m_s2 * _STEP_S
        most_on = parameters.acceleration_m_s2 / self.speed_m_s * _STEP_S
        braking = BRAKING_SHARE * parameters.vertical_acceleration_m_s2
        gain = height_gain_per_s(parameters)
        linear_m = braking / gain**2
        spaces = len(self.ground_m) - 1
        error, rate, pace = begin
        height = self.ground_m[0] - error
        share, duration = 0.0, 0.0  # of the way, of the time
        while share < 1.0:
            at = share * spaces
            below = min(int(at), spaces - 1)
            low, high = self.ground_m[below], self.ground_m[below + 1]
            error = low + (at - below) * (high - low) - height
            size = abs(error)
            wanted = (
                gain * size
                if size < linear_m
                else math.sqrt(2.0 * braking * (size - 0.5 * linear_m))
            )
            wanted = min(wanted, self.climb_m_s) if error > 0.0 else -min(wanted, self.descent_m_s)
            slowed = min(max(2.0 - size / half_m, _SLOWEST), 1.0)
            rate += min(max(wanted - rate, -most_up), most_up)
            pace += min(max(slowed - pace, -most_on), most_on)
            way = pace * self.speed_m_s / self.length_m
            step = min(_STEP_S, (1.0 - share) / way)  # the last step ends where the leg does
            share = share + way * step if step == _STEP_S else 1.0
            height += rate * step
            duration += step
        return duration, _Motion(error, rate, pace)
