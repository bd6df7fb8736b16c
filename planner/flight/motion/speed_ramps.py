"""Changes of speed with limited acceleration, jerk and snap: rest, jerk, steady acceleration, and back.

After ArduPilot's ``AP_Math/SCurve.cpp``; what stands for its raised cosine is told in
`planner.flight.motion.s_curve`.
"""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray

_NEWTON_ROUNDS = 8
"""The cubic is convex beyond its root: from above, Newton halves its error at least."""
_ALMOST = 1.0 - 1e-6
"""Share of an acceleration that is nearly reached. [-]"""


@frozen(eq=False)
class SpeedRamps:
    """Changes of speed: rest, jerk, steady acceleration, jerk back, rest; one per row."""

    change_m_s: FloatArray
    """Change of speed, zero or more; the ramp is the same backwards. (n,) [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    """Greatest acceleration reached. (n,) [m s⁻²]"""
    jerk_m_s3: FloatArray
    rest_s: FloatArray
    """Time before and after, in which the jerk is on its way. (n,) [s]"""
    jerk_s: FloatArray
    """Time of either jerk. (n,) [s]"""
    steady_s: FloatArray
    """Time of steady acceleration. (n,) [s]"""

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each ramp. (n,) [s]"""
        return 2.0 * (self.rest_s + self.jerk_s) + self.steady_s

    def select(self, rows: IntArray | BoolArray) -> SpeedRamps:
        """Return some of the ramps."""
        return SpeedRamps(
            change_m_s=self.change_m_s[rows],
            acceleration_m_s2=self.acceleration_m_s2[rows],
            jerk_m_s3=self.jerk_m_s3[rows],
            rest_s=self.rest_s[rows],
            jerk_s=self.jerk_s[rows],
            steady_s=self.steady_s[rows],
        )

    def beside(self, other: SpeedRamps) -> SpeedRamps:
        """Return these ramps and others in two rows. (2, n)"""
        return SpeedRamps(
            **{
                column.name: np.stack((getattr(self, column.name), getattr(other, column.name)))
                for column in fields(self)
            }
        )

    def begun(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return way, speed and acceleration a time after the beginning, from rest.

        Only in the first half of the ramp, which is all that corners ask for.

        Parameters
        ----------
        time_s : ndarray
            At most half the duration. (n,) [s]

        Returns
        -------
        way_m, speed_m_s, acceleration_m_s2 : ndarray
            (n,) [m, m s⁻¹, m s⁻²]
        """
        since = np.maximum(time_s - self.rest_s, 0.0)
        jerking = np.minimum(since, self.jerk_s)
        steady = since - jerking
        acceleration = self.jerk_m_s3 * jerking
        speed = 0.5 * acceleration * jerking + acceleration * steady
        way = jerking * (acceleration * jerking / 6.0 + 0.5 * acceleration * steady)
        way += 0.5 * acceleration * steady**2
        # The jerk falls gradually: the acceleration is all there only when it has.
        rising = since < self.jerk_s + self.rest_s
        return way, speed, np.where(rising, acceleration * _ALMOST, acceleration)


def speed_ramps(
    change_m_s: FloatArray,
    *,
    acceleration_m_s2: FloatArray,
    jerk_m_s3: FloatArray,
    jerk_rise_s: FloatArray,
) -> SpeedRamps:
    """Return the fastest changes of speed within limits.

    Parameters
    ----------
    change_m_s : ndarray
        Changes of speed, zero or more. (n,) [m s⁻¹]
    acceleration_m_s2, jerk_m_s3 : ndarray
        Limits. (n,) [m s⁻², m s⁻³]
    jerk_rise_s : ndarray
        Time t_j the jerk takes to rise to its limit. (n,) [s]

    Notes
    -----
    ``SCurve::calculate_path``: ΔV = a (t_j + a/J) without steady acceleration, ΔV = A (t_j + A/J + t_4)
    with it.  Where the whole limits do not fit, the rise is shortened at the same snap.
    """
    rise, jerk = _shortened(
        jerk_rise_s,
        np.cbrt(change_m_s * jerk_rise_s / (2.0 * jerk_m_s3)),
        acceleration_m_s2,
        jerk_m_s3,
    )
    half = 0.5 * jerk * rise
    reached = np.sqrt(half**2 + jerk * change_m_s) - half
    acceleration = np.minimum(acceleration_m_s2, reached)
    moving = acceleration > 0.0
    jerk_s = np.divide(acceleration, jerk, out=np.zeros_like(jerk), where=moving)
    whole = np.divide(change_m_s, acceleration, out=np.zeros_like(jerk), where=moving)
    return SpeedRamps(
        change_m_s=change_m_s,
        acceleration_m_s2=acceleration,
        jerk_m_s3=jerk,
        rest_s=np.where(moving, 0.5 * rise, 0.0),
        jerk_s=jerk_s,
        steady_s=np.maximum(whole - jerk_s, 0.0),
    )


def peak_speed_from_rest_m_s(
    length_m: FloatArray,
    *,
    acceleration_m_s2: FloatArray,
    jerk_m_s3: FloatArray,
    jerk_rise_s: FloatArray,
) -> FloatArray:
    """Return the highest speed on the way from rest to rest where no speed limit holds. (n,) [m s⁻¹]

    Parameters
    ----------
    length_m : ndarray
        Way from rest to rest. (n,) [m]
    acceleration_m_s2, jerk_m_s3, jerk_rise_s : ndarray
        As in :func:`speed_ramps`. (n,)

    Notes
    -----
    Each half of the way is one ramp: V (V/A + A/J + t_j) = L with steady acceleration, and
    2 a (t_j + a/J)² = L without: x = t_j + a/J solves x³ − t_j x² = L/2J.
    """
    rise, jerk = _shortened(
        jerk_rise_s,
        np.sqrt(np.sqrt(length_m * jerk_rise_s / (8.0 * jerk_m_s3))),
        acceleration_m_s2,
        jerk_m_s3,
    )
    safe_jerk = np.where(jerk > 0.0, jerk, 1.0)
    volume = length_m / (2.0 * safe_jerk)
    x = rise + np.cbrt(volume)
    for _ in range(_NEWTON_ROUNDS):
        slope = x * (3.0 * x - 2.0 * rise)
        x -= np.divide(x * x * (x - rise) - volume, slope, out=np.zeros_like(x), where=slope > 0.0)
    reached = jerk * (x - rise)
    ramp_s = acceleration_m_s2 / safe_jerk + rise
    steady = 0.5 * (
        np.sqrt((acceleration_m_s2 * ramp_s) ** 2 + 4.0 * acceleration_m_s2 * length_m)
        - acceleration_m_s2 * ramp_s
    )
    return np.where(reached < acceleration_m_s2, reached * x, steady)


def _shortened(
    rise_s: FloatArray, fitting_s: FloatArray, acceleration_m_s2: FloatArray, jerk_m_s3: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return rise and jerk where the whole rise does not fit: snap stays, π J / 2 t_j."""
    limit = np.sqrt(acceleration_m_s2 * rise_s / jerk_m_s3)
    rise = np.minimum(np.minimum(rise_s, fitting_s), limit)
    share = np.divide(rise, rise_s, out=np.ones_like(rise), where=rise_s > 0.0)
    return rise, jerk_m_s3 * share
