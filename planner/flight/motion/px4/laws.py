"""The laws that pieces of PX4's motion follow: cubics of time, and what braking or settling adds to them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import KinematicState, PolynomialLaw
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray

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


class CubicLaw(PolynomialLaw, eq=False):
    """A cubic of time on each axis; a law of its kind adds something to it."""

    def velocities_m_s(self, time_s: FloatArray, axes: int) -> FloatArray:
        """Return east, north and upward velocities at times of each row, (k, rows). (axes, k, rows)"""
        powers = np.ascontiguousarray(self.coefficients[:, :axes, 1:].transpose(2, 1, 0))
        c1, c2, c3 = powers[:, :, None]
        velocity: FloatArray = time_s * (3.0 * c3)
        velocity += 2.0 * c2
        velocity *= time_s
        velocity += c1
        return velocity

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own: seconds of it per second of flight. (rows,)"""
        powers = np.ones((len(factor), 1, 4))
        for power in range(1, 4):
            powers[:, 0, power] = powers[:, 0, power - 1] * factor
        return replace(self, coefficients=self.coefficients * powers)

    def displaced(self, coefficients: FloatArray) -> Self:
        """Return the rows flown beside themselves by cubics of time. (rows, 3, 4)"""
        return replace(self, coefficients=self.coefficients + coefficients)


class BrakeLaw(CubicLaw, eq=False):
    """Flight at the speed allowed by the way left, u² + b u = 2 a d + v_f², along straight lines.

    The place to which d is counted is the cubic of time: it stays where it is, but beside a displaced law.
    """

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
    def to(cls, aim_m: FloatArray, **columns: FloatArray) -> Self:
        """Return the braking to places, (rows, 3), by the columns of the law."""
        cubics = np.zeros((len(aim_m), 3, 4))
        cubics[..., 0] = aim_m
        return cls(coefficients=cubics, rate=np.ones(len(aim_m)), **columns)

    def _speed_m_s(self, row: IntArray | slice, time_s: FloatArray) -> FloatArray:
        """Return speeds at times of the law.

        t = (u₀ − u)/a + (b/2a) ln(u₀/u) is solved by u = (b/2) ω(y), y = u₀/(b/2) + ln(u₀/(b/2)) −
        t a/(b/2), with Wright's ω.
        """
        half_b = self.half_b_m_s[row]
        start = self.start_m_s[row] / half_b
        rate = self.rate[row] * self.acceleration_m_s2[row] / half_b
        return half_b * wright_omega(start + np.log(start) - time_s * rate)

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        speed, aim = self._speed_m_s(row, time_s), super().state_at(row, time_s)
        way = speed * (speed + 2.0 * self.half_b_m_s[row]) - self.final_m_s[row] ** 2
        left, flown = way / (2.0 * self.acceleration_m_s2[row]), speed * self.rate[row]
        along = np.moveaxis(self.direction[row], -1, 0)
        return KinematicState.of(
            (
                aim.east_m - along[0] * left,
                aim.north_m - along[1] * left,
                aim.height_m - along[2] * left,
            ),
            (
                aim.east_m_s + along[0] * flown,
                aim.north_m_s + along[1] * flown,
                aim.climb_m_s + along[2] * flown,
            ),
        )

    def velocities_m_s(self, time_s: FloatArray, axes: int) -> FloatArray:
        """Return east, north and upward velocities at times of each row, (k, rows). (axes, k, rows)"""
        velocity = super().velocities_m_s(time_s, axes)
        velocity += self.direction.T[:axes, None] * (
            self._speed_m_s(slice(None), time_s) * self.rate
        )
        return velocity

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own."""
        return replace(super().slowed(factor), rate=self.rate * factor)


class SettlingLaw(CubicLaw, eq=False):
    """The cubic of time plus what dies away: two exponentials on the map, one of the height."""

    level_m: FloatArray
    """East and north of each exponential. (rows, 2, 2) [m]"""
    level_per_s: FloatArray
    """Of their decay. (rows, 2) [s⁻¹]"""
    height_m: FloatArray
    height_per_s: FloatArray

    def _dying(
        self, row: IntArray | slice, time_s: FloatArray
    ) -> Iterator[tuple[int, FloatArray, FloatArray]]:
        """Yield what dies away at times of the law: its axis, place and velocity."""
        east, north = np.moveaxis(self.level_m, 1, 0)
        for rates, sizes in (
            (self.level_per_s[:, 0], ((0, east[:, 0]), (1, north[:, 0]))),
            (self.level_per_s[:, 1], ((0, east[:, 1]), (1, north[:, 1]))),
            (self.height_per_s, ((2, self.height_m),)),
        ):
            rate = rates[row]
            fading = np.exp(-rate * time_s)
            for axis, size in sizes:
                off = size[row] * fading
                yield axis, off, -rate * off

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        state = super().state_at(row, time_s)
        place = [state.east_m, state.north_m, state.height_m]
        velocity = [state.east_m_s, state.north_m_s, state.climb_m_s]
        for axis, off_m, off_m_s in self._dying(row, time_s):
            place[axis], velocity[axis] = place[axis] + off_m, velocity[axis] + off_m_s
        return KinematicState.of(place, velocity)

    def velocities_m_s(self, time_s: FloatArray, axes: int) -> FloatArray:
        """Return east, north and upward velocities at times of each row, (k, rows). (axes, k, rows)"""
        velocity = super().velocities_m_s(time_s, axes)
        for axis, _, off_m_s in self._dying(slice(None), time_s):
            if axis < axes:
                velocity[axis] += off_m_s
        return velocity

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own."""
        return replace(
            super().slowed(factor),
            level_per_s=self.level_per_s * factor[:, None],
            height_per_s=self.height_per_s * factor,
        )
