"""Changes of speed at limited acceleration and jerk, as PX4 smooths them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray


def ramp_time_s(
    change_m_s: FloatArray, *, acceleration_m_s2: FloatArray | float, jerk_m_s3: FloatArray | float
) -> FloatArray:
    """Return the time of a change of speed from and to no acceleration. [s]

    Δ/a + a/j, or 2 √(Δ/j) where the acceleration is not reached (``VelocitySmoothing``).
    """
    full = change_m_s >= acceleration_m_s2**2 / jerk_m_s3
    return np.where(
        full,
        change_m_s / acceleration_m_s2 + acceleration_m_s2 / jerk_m_s3,
        2.0 * np.sqrt(change_m_s / jerk_m_s3),
    )


def cut_ramp_time_s(
    change_m_s: FloatArray, *, acceleration_m_s2: FloatArray, jerk_m_s3: FloatArray
) -> FloatArray:
    """Return the time of a change of speed from no acceleration, cut off before it is taken back. [s]

    Δ/a + a/2j, or √(2Δ/j) where the acceleration is not reached.
    """
    full = change_m_s >= 0.5 * acceleration_m_s2**2 / jerk_m_s3
    return np.where(
        full,
        change_m_s / acceleration_m_s2 + 0.5 * acceleration_m_s2 / jerk_m_s3,
        np.sqrt(2.0 * change_m_s / jerk_m_s3),
    )


@frozen(eq=False)
class Ramps:
    """Changes of speed: jerk, steady acceleration, jerk back; one per row."""

    jerk_m_s3: FloatArray
    """Zero or more; the change may as well be one downwards. (n,) [m s⁻³]"""
    jerk_s: FloatArray
    """Time of the jerk at the beginning. (n,) [s]"""
    steady_s: FloatArray
    """Time of steady acceleration. (n,) [s]"""
    back_s: FloatArray
    """Time of the jerk at the end: as long as that at the beginning, or none. (n,) [s]"""

    @classmethod
    def of(
        cls, change_m_s: FloatArray, *, acceleration_m_s2: FloatArray, jerk_m_s3: FloatArray
    ) -> Ramps:
        """Return the fastest ramps of changes of zero or more within limits."""
        peak = np.minimum(acceleration_m_s2, np.sqrt(jerk_m_s3 * change_m_s))
        jerk_s = peak / jerk_m_s3
        steady = np.divide(change_m_s, peak, out=np.zeros_like(peak), where=peak > 0.0) - jerk_s
        return cls(
            jerk_m_s3=jerk_m_s3, jerk_s=jerk_s, steady_s=np.maximum(steady, 0.0), back_s=jerk_s
        )

    def cut(
        self, is_cut: BoolArray, change_m_s: FloatArray, *, acceleration_m_s2: FloatArray
    ) -> Ramps:
        """Return ramps of the same changes, some of them cut off at their acceleration."""
        peak = np.minimum(acceleration_m_s2, np.sqrt(2.0 * self.jerk_m_s3 * change_m_s))
        jerk_s = peak / self.jerk_m_s3
        moving = peak > 0.0
        steady = np.divide(change_m_s, peak, out=np.zeros_like(peak), where=moving) - 0.5 * jerk_s
        return Ramps(
            jerk_m_s3=self.jerk_m_s3,
            jerk_s=np.where(is_cut, jerk_s, self.jerk_s),
            steady_s=np.where(is_cut, np.maximum(steady, 0.0), self.steady_s),
            back_s=np.where(is_cut, 0.0, self.back_s),
        )

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each ramp. (n,) [s]"""
        return self.jerk_s + self.steady_s + self.back_s

    @property
    def change_m_s(self) -> FloatArray:
        """Change of speed of each ramp. (n,) [m s⁻¹]"""
        return self.jerk_m_s3 * self.jerk_s * (0.5 * (self.jerk_s + self.back_s) + self.steady_s)

    def time_at_s(self, fraction: FloatArray) -> FloatArray:
        """Return when a fraction (0 to 1) of the change of whole ramps is reached. (n,) [s]"""
        total = self.change_m_s
        soon, late = fraction * total, (1.0 - fraction) * total
        in_jerk = 0.5 * self.jerk_m_s3 * self.jerk_s**2
        peak = np.where(self.jerk_s > 0.0, self.jerk_m_s3 * self.jerk_s, 1.0)
        return np.select(
            [soon <= in_jerk, late <= in_jerk],
            [
                np.sqrt(2.0 * soon / self.jerk_m_s3),
                self.duration_s - np.sqrt(2.0 * late / self.jerk_m_s3),
            ],
            0.5 * self.jerk_s + soon / peak,
        )

    def gained(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return way, speed and acceleration gained from rest by a time. (n,) [m, m s⁻¹, m s⁻²]"""
        first = np.minimum(time_s, self.jerk_s)
        steady = np.clip(time_s - self.jerk_s, 0.0, self.steady_s)
        last = np.clip(time_s - self.jerk_s - self.steady_s, 0.0, self.back_s)
        jerk = self.jerk_m_s3
        peak = jerk * first
        speed_1 = 0.5 * peak * first
        speed_2 = speed_1 + peak * steady
        way = peak * first**2 / 6.0 + steady * (speed_1 + 0.5 * peak * steady)
        way += last * (speed_2 + last * (0.5 * peak - jerk * last / 6.0))
        speed = speed_2 + last * (peak - 0.5 * jerk * last)
        return way, speed, peak - jerk * last
