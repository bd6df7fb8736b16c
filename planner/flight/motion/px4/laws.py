"""Laws of motion PX4 needs besides polynomials: braking, and settling at an exponential rate."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import KinematicState
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.flight.motion.kinematics import FloatArray, IntArray


_NEWTON_ROUNDS = 4
_VANISHING = -690.0
"""Where ω is below 1e-299, which is nothing."""


def wright_omega(y: FloatArray) -> FloatArray:
    """Return ω with ω + ln ω = y, for real y.

    Newton's method from e^y/(1 + e^y) or y − ln y y/(1 + y), both good to a few per cent.
    """
    vanishing = y < _VANISHING
    y = np.maximum(y, _VANISHING)
    small = np.exp(np.minimum(y, 1.0))
    large = np.maximum(y, 1.0)
    omega = np.where(y < 1.0, small / (1.0 + small), large - np.log(large) * large / (1.0 + large))
    for _ in range(_NEWTON_ROUNDS):
        omega = omega * (1.0 + (y - omega - np.log(omega)) / (1.0 + omega))
    return np.where(vanishing, 0.0, omega)


@frozen(eq=False)
class BrakeLaw:
    """Flight at the speed allowed by the way left, u² + b u = 2 a d + v_f², along straight lines."""

    aim_m: FloatArray
    """Place to which d is counted: east, north, height above home. (rows, 3) [m]"""
    direction: FloatArray
    """Direction of flight, of length 1. (rows, 3) [-]"""
    start_m_s: FloatArray
    """Speed at time zero, greater than zero. (rows,) [m s⁻¹]"""
    final_m_s: FloatArray
    """v_f. (rows,) [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    half_b_m_s: FloatArray
    """b/2 = 2 a²/j. (rows,) [m s⁻¹]"""
    rate: FloatArray
    """Seconds of the law per second of flight: PX4 slows time down. (rows,) [-]"""

    @classmethod
    def joined(cls, laws: Sequence[Self]) -> Self:
        """Return the rows of several as one."""
        vector, scalar = (np.zeros((0, 3)),), (np.zeros(0),)
        return cls(
            aim_m=np.concatenate([law.aim_m for law in laws] or vector),
            direction=np.concatenate([law.direction for law in laws] or vector),
            start_m_s=np.concatenate([law.start_m_s for law in laws] or scalar),
            final_m_s=np.concatenate([law.final_m_s for law in laws] or scalar),
            acceleration_m_s2=np.concatenate([law.acceleration_m_s2 for law in laws] or scalar),
            half_b_m_s=np.concatenate([law.half_b_m_s for law in laws] or scalar),
            rate=np.concatenate([law.rate for law in laws] or scalar),
        )

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time.

        t = (u₀ − u)/a + (b/2a) ln(u₀/u) is solved by u = (b/2) ω(y), y = u₀/(b/2) + ln(u₀/(b/2)) −
        t a/(b/2), with Wright's ω.
        """
        half_b, a = self.half_b_m_s[row], self.acceleration_m_s2[row]
        start = self.start_m_s[row] / half_b
        rate = self.rate[row]
        speed = half_b * wright_omega(start + np.log(start) - time_s * rate * a / half_b)
        left = (speed * (speed + 2.0 * half_b) - self.final_m_s[row] ** 2) / (2.0 * a)
        position = self.aim_m[row] - self.direction[row] * left[..., None]
        velocity = self.direction[row] * (speed * rate)[..., None]
        return KinematicState(
            east_m=position[..., 0],
            north_m=position[..., 1],
            height_m=position[..., 2],
            east_m_s=velocity[..., 0],
            north_m_s=velocity[..., 1],
            climb_m_s=velocity[..., 2],
        )


@frozen(eq=False)
class SettlingLaw:
    """On each axis a cubic of time plus two exponentials that die away."""

    coefficients: FloatArray
    """Rising powers of time for east, north, height above home. (rows, 3, 4) [m, m s⁻¹, …]"""
    amplitude_m: FloatArray
    """Of the exponentials. (rows, 3, 2) [m]"""
    rate_per_s: FloatArray
    """Of their decay. (rows, 3, 2) [s⁻¹]"""

    @classmethod
    def joined(cls, laws: Sequence[Self]) -> Self:
        """Return the rows of several as one."""
        pairs = (np.zeros((0, 3, 2)),)
        cubics = [law.coefficients for law in laws] or (np.zeros((0, 3, 4)),)
        return cls(
            coefficients=np.concatenate(cubics),
            amplitude_m=np.concatenate([law.amplitude_m for law in laws] or pairs),
            rate_per_s=np.concatenate([law.rate_per_s for law in laws] or pairs),
        )

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        c = self.coefficients[row]
        t = time_s[..., None]
        rate = self.rate_per_s[row]
        fading = self.amplitude_m[row] * np.exp(-rate * t[..., None])
        position = c[..., 0] + t * (c[..., 1] + t * (c[..., 2] + t * c[..., 3]))
        position = position + fading.sum(axis=-1)
        velocity = c[..., 1] + t * (2.0 * c[..., 2] + t * 3.0 * c[..., 3])
        velocity = velocity - (rate * fading).sum(axis=-1)
        return KinematicState(
            east_m=position[..., 0],
            north_m=position[..., 1],
            height_m=position[..., 2],
            east_m_s=velocity[..., 0],
            north_m_s=velocity[..., 1],
            climb_m_s=velocity[..., 2],
        )
