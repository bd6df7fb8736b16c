"""Corners as ArduPilot flies them through: the next leg begins before the last one has ended.

Each leg is planned from standstill to standstill.  While one slows down the next already speeds up; the
vehicle moves by the sum of both.  After ``SCurve::advance_target_along_track``: they overlap for the
longest time 2 t for which, half-way through the overlap, the vehicle

- is within WP_RADIUS of the waypoint,
- is slower than either leg's speed limit,
- has a horizontal acceleration below WP_ACC_CNR,
- has a vertical acceleration below WP_ACC_Z,

and 2 t does not exceed either ramp.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray
    from planner.flight.motion.speed_ramps import SpeedRamps

_BISECTIONS = 16
"""Halvings of a few seconds: to a tenth of a millisecond, where ArduPilot steps by 2.5 ms."""
_BELOW = 1.0 - 1e-9
"""What is below a limit."""


@frozen(eq=False)
class Corners:
    """Waypoints between two straight legs, one per row."""

    before: FloatArray
    """Direction of the leg before: east, north, up. (n, 3) [-]"""
    after: FloatArray
    """Direction of the leg after. (n, 3) [-]"""
    slowing: SpeedRamps
    """Ramps at the end of the legs before."""
    speeding: SpeedRamps
    """Ramps at the beginning of the legs after."""
    speed_limit_m_s: FloatArray
    """Lower of the two legs' speed limits. (n,) [m s⁻¹]"""

    def speed_m_s(self, half_s: FloatArray) -> FloatArray:
        """Return the speed half-way through overlaps of twice ``half_s``. (n,) [m s⁻¹]"""
        _, slowing, _ = self.slowing.begun(half_s)
        _, speeding, _ = self.speeding.begun(half_s)
        return _length(speeding, slowing, -self._cosine())

    def _cosine(self) -> FloatArray:
        cosine: FloatArray = np.einsum("ij,ij->i", self.before, self.after)
        return cosine

    def _select(self, rows: BoolArray) -> Corners:
        return Corners(
            before=self.before[rows],
            after=self.after[rows],
            slowing=self.slowing.select(rows),
            speeding=self.speeding.select(rows),
            speed_limit_m_s=self.speed_limit_m_s[rows],
        )


def half_overlap_s(
    corners: Corners,
    *,
    radius_m: float,
    corner_acceleration_m_s2: float,
    vertical_acceleration_m_s2: float,
) -> FloatArray:
    """Return half the time by which the legs about each corner overlap. (n,) [s]

    The corner is announced as reached half-way through.

    Parameters
    ----------
    corners : Corners
        Waypoints that are flown through.
    radius_m : float
        WP_RADIUS. [m]
    corner_acceleration_m_s2 : float
        WP_ACC_CNR, or twice WP_ACC. [m s⁻²]
    vertical_acceleration_m_s2 : float
        WP_ACC_Z. [m s⁻²]
    """
    limits = (radius_m, corner_acceleration_m_s2, vertical_acceleration_m_s2)
    half = 0.5 * np.minimum(corners.slowing.duration_s, corners.speeding.duration_s) * _BELOW
    limited = ~_Limits.of(corners, *limits).allow(half)
    if limited.any():
        # Within half a ramp ways, speeds and accelerations only grow: one crossing each.
        some = _Limits.of(corners._select(limited), *limits)  # noqa: SLF001 -- its own module
        low, high = np.zeros(limited.sum()), half[limited]
        for _ in range(_BISECTIONS):
            middle = 0.5 * (low + high)
            good = some.allow(middle)
            low, high = np.where(good, middle, low), np.where(good, high, middle)
        half[limited] = low
    return half


@frozen(eq=False)
class _Limits:
    """The four limits of corners, with what of the directions they depend on."""

    ramps: SpeedRamps
    """The legs before and after, in two rows: what is asked of both is asked at once. (2, n)"""
    level: FloatArray
    """Horizontal parts of both directions. (2, n) [-]"""
    upward: FloatArray
    """Vertical parts of both directions. (2, n) [-]"""
    cosines: FloatArray
    """Of the angle between the legs, that of their sum, and as seen from above. (3, n) [-]"""
    speed_limit_m_s: FloatArray
    radius_m: float
    corner_acceleration_m_s2: float
    vertical_acceleration_m_s2: float

    @classmethod
    def of(
        cls,
        corners: Corners,
        radius_m: float,
        corner_acceleration_m_s2: float,
        vertical_acceleration_m_s2: float,
    ) -> _Limits:
        before, after = corners.before, corners.after
        level = np.stack((np.hypot(before[:, 0], before[:, 1]), np.hypot(after[:, 0], after[:, 1])))
        both = level[0] * level[1]
        across = before[:, 0] * after[:, 0] + before[:, 1] * after[:, 1]
        from_above = np.divide(across, both, out=np.zeros_like(both), where=both > 0.0)
        cosine = corners._cosine()  # noqa: SLF001 -- its own module
        return cls(
            ramps=corners.slowing.beside(corners.speeding),
            level=level,
            upward=np.stack((before[:, 2], after[:, 2])),
            cosines=np.stack((cosine, -cosine, from_above)),
            speed_limit_m_s=corners.speed_limit_m_s,
            radius_m=radius_m,
            corner_acceleration_m_s2=corner_acceleration_m_s2,
            vertical_acceleration_m_s2=vertical_acceleration_m_s2,
        )

    def allow(self, half_s: FloatArray) -> BoolArray:
        """Return whether overlaps of twice ``half_s`` keep within all four. (n,)"""
        way, speed, acceleration = self.ramps.begun(half_s)
        climb = acceleration * self.upward
        before, after = np.stack((way, speed, acceleration * self.level), axis=1)
        distance, together, level = _length(after, before, self.cosines)
        allowed: BoolArray = (
            (distance < self.radius_m)
            & (together <= self.speed_limit_m_s * _BELOW)
            & (level <= self.corner_acceleration_m_s2 * _BELOW)
            & (np.abs(climb[1] - climb[0]) <= self.vertical_acceleration_m_s2 * _BELOW)
        )
        return allowed


def _length(one: FloatArray, other: FloatArray, cosine: FloatArray) -> FloatArray:
    """Return the length of the difference of two vectors: the law of cosines."""
    return np.sqrt(np.maximum(one * one + other * other - 2.0 * one * other * cosine, 0.0))
