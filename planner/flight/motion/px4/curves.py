"""Curves: moves between given places and velocities in a given time, within speed limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.flight.motion.kinematics import FloatArray

_ROUGHLY = 1.01
"""Squared: a cubic passes its limit by a quarter of a per cent before it is made of parts. [-]"""


@frozen(eq=False)
class Curves(Columns):
    """Curves of up to three cubics of time each, as columns of length n."""

    duration_s: FloatArray
    """Of their parts; zero where there is none. (n, 3) [s]"""
    coefficients: FloatArray
    """Rising powers of the time of each part, by part and axis. (n, 3, 3, 4) [m, m s⁻¹, …]"""

    @classmethod
    def between(
        cls,
        place_m: FloatArray,
        velocity_m_s: FloatArray,
        end_m: FloatArray,
        end_m_s: FloatArray,
        *,
        duration_s: FloatArray,
        level_m_s: FloatArray,
        upright_m_s: FloatArray,
    ) -> Curves:
        """Return curves that begin and end as given, no faster than their limits allow.

        Parameters
        ----------
        place_m, velocity_m_s, end_m, end_m_s : ndarray
            Places and velocities: east, north, upwards. (n, 3) [m, m s⁻¹]
        duration_s : ndarray
            (n,) [s]
        level_m_s, upright_m_s : ndarray
            Greatest horizontal and vertical speed; the speeds at the ends, and the mean, if those are
            greater. (n,) [m s⁻¹]

        Notes
        -----
        Where it keeps to the limits within a quarter of a per cent, one cubic.  Its velocity is a
        parabola, within the triangle of the velocities v₀, 3 m − v₀ − v₁, v₁ (Bézier), m the mean.
        Else the velocity changes evenly from v₀ to u in the first α T, keeps, and changes evenly to v₁
        in the last α T.  Speed is then greatest at an end or at u = (m − α (v₀ + v₁)/2)/(1 − α); α is
        the greatest up to 1/2 that keeps u within the limits, so that the acceleration is least.
        """
        moving = duration_s > 0.0
        time = np.where(moving, duration_s, 1.0)
        way = end_m - place_m
        mean = way / time[:, None]
        bent = 3.0 * mean - velocity_m_s - end_m_s
        half = 0.5 * (velocity_m_s + end_m_s)
        share = np.full(len(time), 0.5)
        fits = np.ones(len(time), dtype=np.bool_)
        for axes, limit in ((slice(2), level_m_s), (slice(2, 3), upright_m_s)):
            u, m, w, b = (_square(v[:, axes]) for v in (velocity_m_s, mean, end_m_s, bent))
            most = np.maximum(np.maximum(limit**2, m), np.maximum(u, w))
            fits &= b <= _ROUGHLY * most
            # |m − α w|² = (1 − α)² L², w the mean of the velocities at the ends.
            p = np.minimum(_square(half[:, axes]) - most, 0.0)
            q = most - (mean[:, axes] * half[:, axes]).sum(axis=1)
            r = m - most
            root = q + np.sqrt(np.maximum(q * q - p * r, 0.0))
            share = np.minimum(share, np.divide(-r, root, out=share.copy(), where=root > 0.0))
        change = share * time
        share = share[:, None]
        kept = (mean - share * half) / (1.0 - share)
        rate = np.where(change > 0.0, change, 1.0)[:, None]
        first = np.where(fits, time, change)
        parts = np.zeros((len(time), 3, 3, 4))
        parts[:, 0, :, 0] = place_m
        parts[:, 0, :, 1] = velocity_m_s
        single = fits[:, None]
        t = time[:, None]
        parts[:, 0, :, 2] = np.where(
            single,
            (3.0 * mean - 2.0 * velocity_m_s - end_m_s) / t,
            0.5 * (kept - velocity_m_s) / rate,
        )
        parts[:, 0, :, 3] = np.where(single, (velocity_m_s + end_m_s - 2.0 * mean) / t**2, 0.0)
        turned = place_m + 0.5 * (velocity_m_s + kept) * change[:, None]
        steady = np.maximum(time - 2.0 * change, 0.0)
        parts[:, 1, :, 0] = turned
        parts[:, 1, :, 1] = kept
        parts[:, 2, :, 0] = turned + kept * steady[:, None]
        parts[:, 2, :, 1] = kept
        parts[:, 2, :, 2] = 0.5 * (end_m_s - kept) / rate
        duration = np.column_stack(
            (first, np.where(fits, 0.0, steady), np.where(fits, 0.0, change))
        )
        return cls(duration_s=np.where(moving[:, None], duration, 0.0), coefficients=parts)

    def parts(self, until_s: FloatArray) -> Iterator[tuple[FloatArray, FloatArray]]:
        """Yield duration and cubics of each part as far as it is flown until a time. (n,), (n, 3, 4)"""
        left = until_s
        for part in range(self.duration_s.shape[1]):
            flown = np.clip(left, 0.0, self.duration_s[:, part])
            yield flown, self.coefficients[:, part]
            left = left - self.duration_s[:, part]

    def state_at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places and velocities at times up to the duration. (n, 3), (n, 3) [m, m s⁻¹]"""
        ends = np.cumsum(self.duration_s, axis=1)
        part = np.minimum((time_s[:, None] > ends).sum(axis=1), self.duration_s.shape[1] - 1)
        rows = np.arange(len(time_s))
        t = (time_s - (ends - self.duration_s)[rows, part])[:, None]
        c0, c1, c2, c3 = np.moveaxis(self.coefficients[rows, part], -1, 0)
        return c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3)


def _square(vectors: FloatArray) -> FloatArray:
    """Return the squared lengths of vectors. (n,)"""
    squares: FloatArray = (vectors**2).sum(axis=1)
    return squares
