"""The law that pieces of PX4's motion follow: cubics of time, and what braking or settling adds to some."""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import Columns, KinematicState, PolynomialLaw, rows_of
from planner.values import field_values, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray

_ROUNDS = 2
_ALL, _UP = range(3), 2
"""The axes, and that of the height; the others are level."""
_VANISHING = -690.0
"""Where ω is below 1e-299, which is nothing."""


def wright_omega(y: FloatArray) -> FloatArray:
    """Return ω with ω + ln ω = y, for real y.

    The method of Fritsch, Shafer and Crowley (1973), of which each round takes the error to its fourth power,
    from e^y/(1 + e^y) or y − ln y y/(1 + y), both good to a few per cent.
    """
    vanishing = y < _VANISHING
    y = np.maximum(y, _VANISHING)
    small = np.exp(np.minimum(y, 1.0))
    large = np.maximum(y, 1.0)
    omega = np.where(y < 1.0, small / (1.0 + small), large - np.log(large) * large / (1.0 + large))
    for _ in range(_ROUNDS):
        left, more = y - omega - np.log(omega), 1.0 + omega
        steep = more * (more + left / 1.5)
        omega = omega * (1.0 + left / more * (steep - 0.5 * left) / (steep - left))
    return np.where(vanishing, 0.0, omega)


def braked_speed_m_s(
    speed_m_s: FloatArray,
    time_s: FloatArray,
    acceleration_m_s2: FloatArray | float,
    half_b_m_s: FloatArray | float,
) -> FloatArray:
    """Return the speeds left after times of braking by the way left, from ones greater than zero. [m s⁻¹]

    t = (u₀ − u)/a + (b/2a) ln(u₀/u) is solved by u = (b/2) ω(y), y = u₀/(b/2) + ln(u₀/(b/2)) −
    t a/(b/2), with Wright's ω.
    """
    begun = speed_m_s / half_b_m_s
    faded = begun + np.log(begun) - time_s * acceleration_m_s2 / half_b_m_s
    return np.asarray(half_b_m_s * wright_omega(faded))


class Brakes(Columns, eq=False):
    """Flight at the speed allowed by the way left, u² + b u = 2 a d + v_f², along straight lines.

    Added to the place to which d is counted: how far before it a vehicle is.
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

    def added(
        self, row: IntArray, time_s: FloatArray, axes: range
    ) -> Iterator[tuple[int, FloatArray, FloatArray]]:
        """Yield axes, and what is added to places and velocities on them at times."""
        half_b, a, rate = self.half_b_m_s[row], self.acceleration_m_s2[row], self.rate[row]
        speed = braked_speed_m_s(self.start_m_s[row], time_s * rate, a, half_b)
        left = (speed * (speed + 2.0 * half_b) - self.final_m_s[row] ** 2) / (2.0 * a)
        speed *= rate
        for axis in axes:
            along = self.direction[:, axis][row]
            yield axis, -along * left, along * speed

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own."""
        return replace(self, rate=self.rate * factor)


class Settlings(Columns, eq=False):
    """What dies away: two exponentials of time on the map, one of the height."""

    level_m: FloatArray
    """East and north of each exponential. (rows, 2, 2) [m]"""
    level_per_s: FloatArray
    """Of their decay. (rows, 2) [s⁻¹]"""
    height_m: FloatArray
    height_per_s: FloatArray

    def added(
        self, row: IntArray, time_s: FloatArray, axes: range
    ) -> Iterator[tuple[int, FloatArray, FloatArray]]:
        """Yield axes, and what is added to places and velocities on them at times."""
        if axes.start < _UP:
            rates = [-self.level_per_s[:, one][row] for one in range(2)]
            fading = [np.exp(rate * time_s) for rate in rates]
            for axis in axes[:_UP]:
                off, other = (self.level_m[:, axis, one][row] * fading[one] for one in range(2))
                yield axis, off + other, rates[0] * off + rates[1] * other
        if axes.stop > _UP:
            rate = -self.height_per_s[row]
            off = self.height_m[row] * np.exp(rate * time_s)
            yield _UP, off, rate * off

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own."""
        return replace(
            self,
            level_per_s=self.level_per_s * factor[:, None],
            height_per_s=self.height_per_s * factor,
        )


_CUBIC, _BRAKE, _SETTLING = range(3)
_NO_BRAKES = Brakes(
    direction=np.zeros((0, 3)),
    start_m_s=np.zeros(0),
    final_m_s=np.zeros(0),
    acceleration_m_s2=np.zeros(0),
    half_b_m_s=np.zeros(0),
    rate=np.zeros(0),
)
_NO_SETTLINGS = Settlings(
    level_m=np.zeros((0, 2, 2)),
    level_per_s=np.zeros((0, 2)),
    height_m=np.zeros(0),
    height_per_s=np.zeros(0),
)


class Px4Law(Columns, eq=False):
    """A cubic of time on each axis, and what braking or settling adds to it."""

    coefficients: FloatArray
    """Rising powers of time for east, north, height above home. (rows, 3, 4) [m, m s⁻¹, …]"""
    kind: IntArray
    """What is added. (rows,)"""
    brakes: Brakes
    """Of the rows that brake, in their order; like the next."""
    settlings: Settlings

    @classmethod
    def of(cls, cubics: FloatArray, added: Brakes | Settlings | None = None) -> Self:
        """Return cubics, (rows, 3, 4), with what is added to each of them."""
        is_brake, settles = isinstance(added, Brakes), isinstance(added, Settlings)
        return cls(
            coefficients=cubics,
            kind=np.full(len(cubics), _BRAKE * is_brake + _SETTLING * settles),
            brakes=added if isinstance(added, Brakes) else _NO_BRAKES,
            settlings=added if isinstance(added, Settlings) else _NO_SETTLINGS,
        )

    @property
    def is_cubic(self) -> BoolArray:
        """To which rows nothing is added. (rows,)"""
        return np.asarray(self.kind == _CUBIC)

    def _additions(self) -> Iterator[tuple[BoolArray, Brakes | Settlings]]:
        """Yield to which rows something is added, and what."""
        for kind, added in ((_BRAKE, self.brakes), (_SETTLING, self.settlings)):
            if len(next(iter(field_values(added).values()))):
                yield self.kind == kind, added

    def select(self, rows: IntArray | BoolArray) -> Self:
        """Return some of the rows."""
        rows = rows_of(rows) if rows.dtype == np.bool_ else rows
        own = {}
        for name, kind in (("brakes", _BRAKE), ("settlings", _SETTLING)):
            are = self.kind == kind
            own[name] = getattr(self, name).select((are.cumsum() - 1)[rows[are[rows]]])
        cubics = self.coefficients.take(rows, axis=0)
        return replace(self, coefficients=cubics, kind=self.kind[rows], **own)

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        state = PolynomialLaw(coefficients=self.coefficients).state_at(row, time_s)
        places = state.east_m, state.north_m, state.height_m
        velocities = state.east_m_s, state.north_m_s, state.climb_m_s
        for are, added in self._additions():
            chosen = rows_of(are[row])
            if len(chosen):
                own = (are.cumsum() - 1)[row[chosen]]
                for axis, place_m, velocity_m_s in added.added(own, time_s[chosen], _ALL):
                    places[axis][chosen] += place_m
                    velocities[axis][chosen] += velocity_m_s
        return state

    def climbs_m(self, duration_s: FloatArray) -> FloatArray:
        """Return the climbs of rows from the beginning of their time on. (rows,) [m]"""
        _, c1, c2, c3 = self.coefficients[:, _UP].T
        climb = duration_s * (c1 + duration_s * (c2 + duration_s * c3))
        for are, added in self._additions():
            own = np.arange(np.count_nonzero(are))
            ends = duration_s[are] * np.array([[0.0], [1.0]])
            [(_, height_m, _)] = added.added(own, ends, _ALL[_UP:])
            climb[are] += height_m[1] - height_m[0]
        return np.asarray(climb)

    def velocities_m_s(self, time_s: FloatArray, axes: int) -> FloatArray:
        """Return east, north and upward velocities at times of each row, (k, rows). (axes, k, rows)"""
        powers = np.ascontiguousarray(self.coefficients[:, :axes, 1:].transpose(2, 1, 0))
        c1, c2, c3 = powers[:, :, None]
        velocity: FloatArray = time_s * (3.0 * c3)
        velocity += 2.0 * c2
        velocity *= time_s
        velocity += c1
        for are, added in self._additions():
            rows = rows_of(are)
            own = added.added(np.arange(len(rows)), time_s.take(rows, axis=1), range(axes))
            for axis, _, velocity_m_s in own:
                velocity[axis][:, rows] += velocity_m_s
        return velocity

    def parted(self) -> tuple[tuple[PolynomialLaw, Px4Law], IntArray, IntArray]:
        """Return the rows that are nothing but cubics, and the others; which of both, and where each is.

        The ends of a cubic say what lies between them; of the others that has to be looked at.
        """
        is_cubic = self.is_cubic
        row = np.where(is_cubic, is_cubic.cumsum(), np.cumsum(~is_cubic)) - 1
        cubics = PolynomialLaw(coefficients=self.coefficients[is_cubic])
        return (cubics, self.select(~is_cubic)), np.asarray(~is_cubic, dtype=np.intp), row

    def slowed(self, factor: FloatArray) -> Self:
        """Return the rows each in a time of its own: seconds of it per second of flight. (rows,)"""
        powers = np.ones((len(factor), 1, 4))
        for power in range(1, 4):
            np.multiply(powers[:, 0, power - 1], factor, out=powers[:, 0, power])
        return replace(
            self,
            coefficients=self.coefficients * powers,
            brakes=self.brakes.slowed(factor[self.kind == _BRAKE]),
            settlings=self.settlings.slowed(factor[self.kind == _SETTLING]),
        )
