"""Pieces: the parts of moves collected kind by kind, and put into flown order as one motion."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import Columns, clipped, dot, horizontal, quotient, rows_of
from planner.flight.motion.px4.laws import Brakes, Px4Law, Settlings
from planner.physics.quadrature import unit_quadrature
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.vehicle.parameters.px4 import Px4Parameters


_ROUGHLY = 1.01
"""Squared: a cubic passes its limit by a quarter of a per cent before it is made of parts. [-]"""


class Curves(Columns, eq=False):
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
        time = np.where(duration_s > 0.0, duration_s, 1.0)
        mean = (end_m - place_m) / time[:, None]
        bent = 3.0 * mean - velocity_m_s - end_m_s
        half = 0.5 * (velocity_m_s + end_m_s)
        alpha = np.full(len(time), 0.5)
        fits = np.ones(len(time), dtype=np.bool_)
        for axes, limit in ((slice(2), level_m_s), (slice(2, 3), upright_m_s)):
            u, m, w, b, h = (
                dot(v[:, axes], v[:, axes]) for v in (velocity_m_s, mean, end_m_s, bent, half)
            )
            most = np.maximum(np.maximum(limit**2, m), np.maximum(u, w))
            fits &= b <= _ROUGHLY * most
            # |m − α w|² = (1 − α)² L², w the mean of the velocities at the ends.
            p = np.minimum(h - most, 0.0)
            q = most - dot(mean[:, axes], half[:, axes])
            r = m - most
            alpha = np.minimum(
                alpha, quotient(-r, q + np.sqrt(np.maximum(q * q - p * r, 0.0)), alpha)
            )
        change = alpha * time
        kept = (mean - alpha[:, None] * half) / (1.0 - alpha)[:, None]
        rate = np.where(change > 0.0, change, 1.0)[:, None]
        single, t = fits[:, None], time[:, None]
        turned = place_m + 0.5 * (velocity_m_s + kept) * change[:, None]
        steady = np.maximum(time - 2.0 * change, 0.0)
        parts = np.zeros((len(time), 3, 3, 4))
        parts[:, 0, :, 0] = place_m
        parts[:, 0, :, 1] = velocity_m_s
        parts[:, 0, :, 2] = np.where(
            single,
            (3.0 * mean - 2.0 * velocity_m_s - end_m_s) / t,
            0.5 * (kept - velocity_m_s) / rate,
        )
        parts[:, 0, :, 3] = np.where(single, (velocity_m_s + end_m_s - 2.0 * mean) / t**2, 0.0)
        parts[:, 1, :, 0] = turned
        parts[:, 1:, :, 1] = kept[:, None]
        parts[:, 2, :, 0] = turned + kept * steady[:, None]
        parts[:, 2, :, 2] = 0.5 * (end_m_s - kept) / rate
        duration = np.where(
            single, t * np.array([1.0, 0.0, 0.0]), np.column_stack((change, steady, change))
        )
        return cls(
            duration_s=np.where((duration_s > 0.0)[:, None], duration, 0.0), coefficients=parts
        )

    def state_at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return places and velocities at times up to the duration. (n, 3), (n, 3) [m, m s⁻¹]"""
        ends = np.cumsum(self.duration_s, axis=1)
        part = np.minimum((time_s[:, None] > ends).sum(axis=1), self.duration_s.shape[1] - 1)
        rows = np.arange(len(time_s))
        t = (time_s - (ends - self.duration_s)[rows, part])[:, None]
        c0, c1, c2, c3 = np.moveaxis(self.coefficients[rows, part], -1, 0)
        return c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3)


PAUSE, RAMP, CRUISE, BRAKE, HOLD, SLOTS = range(6)
"""Segments a move may have, in flown order."""
ORDERS = 24
"""Pieces a move may have at most."""

_SHORTEST_S = 1e-9
"""Shorter pieces are left out. [s]"""


class Places(NamedTuple):
    """Where k pieces belong; what is the same for all may be a number."""

    move: IntArray
    order: IntArray | int
    """Place among the pieces of its move."""
    slot: IntArray | int
    """Segment of its move."""
    duration_s: FloatArray
    """In the time of PX4's trajectory. (k,) [s]"""
    time_scale: FloatArray | float = 1.0
    """Seconds of that per second of flight. [-]"""
    is_grounded: BoolArray | bool = False


@dataclass(slots=True)
class Px4Pieces:
    """Pieces while they are collected."""

    time_scale: TimeScale
    parts: list[tuple[Px4Law, Places]] = field(default_factory=list)

    def add_lines(
        self,
        places: Places,
        place_m: FloatArray,
        direction: FloatArray | float = 0.0,
        *powers: FloatArray,
    ) -> None:
        """Add straight pieces by speed, acceleration and jerk; by default they stay where they are."""
        cubics = np.zeros((len(place_m), 3, 4))
        cubics[..., 0] = place_m
        for power, part in enumerate(powers, start=1):
            cubics[..., power] = direction * (part / math.factorial(power))[:, None]
        self.add(places, cubics)

    def add_curves(self, places: Places, curves: Curves) -> None:
        """Add curves as far as they are flown in the durations of places."""
        begins = np.cumsum(curves.duration_s, axis=1) - curves.duration_s
        flown = clipped(places.duration_s[:, None] - begins, 0.0, curves.duration_s)
        row, part = np.nonzero(flown > _SHORTEST_S)
        move, slot, scale = np.broadcast_arrays(places.move, places.slot, places.time_scale)
        own = Places(move[row], places.order, slot[row], flown[row, part], scale[row])
        self.add(own, curves.coefficients[row, part])

    def add(
        self, places: Places, cubics: FloatArray, added: Brakes | Settlings | None = None
    ) -> None:
        """Add pieces by their rising powers of time, (k, 3, 4), and what is added to those."""
        self.parts.append((Px4Law.of(cubics, added), places))


_LENGTH_NODES, _LENGTH_WEIGHTS = unit_quadrature(8)
"""A vehicle may turn back within a piece: within 1 % of that way."""


class Ordered(Value, eq=False):
    """Pieces in flown order, and the segments they make."""

    law: Px4Law
    """A row for each piece."""
    segment: IntArray
    """Segment each piece belongs to. (p,)"""
    offset_s: FloatArray
    """The law's own time at which each piece begins."""
    duration_s: FloatArray
    is_grounded: BoolArray
    piece_slot: IntArray
    segment_move: IntArray
    """Move each segment belongs to. (n,)"""
    segment_slot: IntArray
    noise_delay_s: float
    """How much longer all of it takes for the noise of the position. [s]"""

    def velocities_m_s(self, fractions: FloatArray, axes: int) -> FloatArray:
        """Return velocities on the first axes at fractions of the time of each piece. (axes, k, p)"""
        time_s = self.offset_s + fractions[:, None] * self.duration_s
        return self.law.velocities_m_s(time_s, axes)

    def divided(self, at_s: FloatArray) -> Ordered:
        """Return the pieces divided at times since their beginnings, as many as leave a part as long."""
        shortest_s = at_s[0]
        counts = 1 + np.searchsorted(at_s, self.duration_s - shortest_s, side="right")
        piece = np.repeat(np.arange(len(counts)), counts)
        number = np.arange(len(piece)) - np.repeat(counts.cumsum() - counts, counts)
        begin_s = np.append(0.0, at_s)[number]
        end_s = np.where(
            number + 1 < counts[piece], np.append(at_s, 0.0)[number], self.duration_s[piece]
        )
        return replace(
            self,
            law=self.law.select(piece),
            segment=self.segment[piece],
            offset_s=self.offset_s[piece] + begin_s,
            duration_s=end_s - begin_s,
            is_grounded=self.is_grounded[piece],
            piece_slot=self.piece_slot[piece],
        )

    def displaced(self, powers: FloatArray) -> Ordered:
        """Return the pieces flown beside themselves, east and north, by powers of their time. (4, 2, p)"""
        # Counted from where the law's own time begins: c(t − t₀).
        (c0, c1, c2, c3), t = powers, -self.offset_s
        shifted = c0 + t * (c1 + t * (c2 + t * c3)), c1 + t * (2.0 * c2 + 3.0 * t * c3)
        coefficients = self.law.coefficients.copy()
        for power, beside in enumerate((*shifted, c2 + 3.0 * t * c3, c3)):
            for axis, own in enumerate(beside):
                coefficients[:, axis, power] += own
        return replace(self, law=replace(self.law, coefficients=coefficients))

    def slowed(self, scale: FloatArray) -> Ordered:
        """Return the pieces flown in more time, each at its share of the speed. (p,)"""
        return replace(
            self,
            law=self.law.slowed(scale),
            offset_s=self.offset_s / scale,
            duration_s=self.duration_s / scale,
        )

    def ways_m(self, *, curves: bool) -> FloatArray:
        """Return ways over the ground. (p,) [m]

        Of pieces that a vehicle may turn back in, ``curves``, by quadrature; else between the chord and
        the control polygon of what is nothing but a cubic (Bézier): of the others the chord.
        """
        if curves:
            east, north = self.velocities_m_s(_LENGTH_NODES, axes=2)
            mean_m_s = _LENGTH_WEIGHTS @ np.sqrt(east * east + north * north)
            return np.asarray(mean_m_s * self.duration_s)
        time = self.duration_s[:, None]
        time_s = self.offset_s[:, None] + time * (0.0, 1.0)
        ends = self.law.state_at(np.arange(len(time))[:, None], time_s)
        chord = np.column_stack((np.diff(ends.east_m), np.diff(ends.north_m)))
        thirds = np.stack((ends.east_m_s, ends.north_m_s), axis=-1) * (time / 3.0)[:, None]
        first, last = thirds[:, 0], thirds[:, 1]
        straight = horizontal(chord)
        polygon = horizontal(first) + horizontal(last) + horizontal(chord - first - last)
        return np.where(self.law.is_cubic, 0.5 * (polygon + straight), straight)

    def summed(self, of_pieces: FloatArray) -> FloatArray:
        """Return sums by segment. (n,)"""
        return np.bincount(self.segment, of_pieces).astype(np.float64)


def in_flown_order(pieces: Px4Pieces) -> Ordered:
    """Return collected pieces in flown order, with their segments; those of no duration are left out."""
    laws, places = zip(*pieces.parts, strict=True)
    counts = [len(own.duration_s) for own in places]
    columns = []
    for given in zip(*places, strict=True):
        every = [
            one if isinstance(one, np.ndarray) else np.full(count, one)
            for one, count in zip(given, counts, strict=True)
        ]
        columns.append(np.concatenate(every))
    move, order, slot, planned_s, time_scale, grounded = columns
    flown = rows_of(planned_s > _SHORTEST_S)
    flown = flown[np.argsort((move * ORDERS + order)[flown], kind="stable")]
    key = (move * SLOTS + slot)[flown]
    begins = np.concatenate(([True], key[1:] != key[:-1]))
    scale, planned_s = time_scale[flown], planned_s[flown]
    duration = planned_s / scale
    return Ordered(
        law=Px4Law.joined(laws).select(flown).slowed(scale),
        segment=begins.cumsum() - 1,
        offset_s=np.zeros(len(flown)),
        duration_s=duration,
        is_grounded=grounded[flown],
        piece_slot=key % SLOTS,
        segment_move=key[begins] // SLOTS,
        segment_slot=key[begins] % SLOTS,
        noise_delay_s=float((duration - planned_s).sum()),
    )


_WANDER_SHARE = 0.7
"""Ground speed of a hovering vehicle over the speed its position controller asks for, MPC_XY_P times
the position error: the rest is movement only the estimate makes.  0.70, 0.69 and 0.69 measured in three
simulated flights, where the truth is known. [-]"""

_LAG_S = 0.1
"""Time by which the speed of a vehicle that speeds up is behind that of its trajectory: 0.10 s identified,
as of a second-order answer, from three simulated flights. [s]"""


class TimeScale(Value):
    """Seconds of PX4's trajectory per second of flight, by horizontal speed of the trajectory.

    Notes
    -----
    Each step the trajectory's time advances by 1 − e/MPC_XY_ERR_MAX of the real time while the vehicle is
    behind it, e the distance between the two on the map; the height waits with it
    (``PositionSmoothing::_generateTrajectory``; PX4 after 1.17 slows the height by its own error only).
    Recorded speeds of the trajectory agree with that to 0.0001 in the mean of climbs and descents.

    With noise alone the vehicle is behind half of the time.  Moving, a trajectory that waits is caught up
    with: let ẋ = w − MPC_XY_P x − v (1 − s) be the error along the way, x > 0 behind.  In a hover its
    deviation is σ = ē √(2/π), ē the mean of e, and the disturbance w, slower than 1/MPC_XY_P as it is
    (correlated over 2.5 s in three recordings), has MPC_XY_P σ.  At speed the time stretches by just as
    much as w pushes the vehicle back, v (1 − s) = E[max(w, 0)] = MPC_XY_P σ/√(2π) = MPC_XY_P ē/π; at
    none it does so by ē/(2 MPC_XY_ERR_MAX).  The hyperbola through both,

        1 − s = ē/(2 MPC_XY_ERR_MAX) / (1 + v/v₀),  v₀ = (2/π) MPC_XY_P MPC_XY_ERR_MAX,

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
    def of(cls, hover_noise_m: float, parameters: Px4Parameters) -> TimeScale:
        """Return the time scale of a vehicle with a mean horizontal position error in a hover.

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
        """Return the mean time scale of evenly changing horizontal speeds, by their ends.

        The mean of 1/(1 + v/v₀) over v is v₀ ln(r)/(v₂ − v₁), r the ratio of v + v₀.
        """
        low = self.half_speed_m_s + np.minimum(first_m_s, last_m_s)
        grown = np.abs(last_m_s - first_m_s) / low
        mean = quotient(np.log1p(grown), grown, 1.0 - 0.5 * grown, above=_SMALL)
        return np.asarray(1.0 - 0.5 * self.share * self.half_speed_m_s / low * mean)

    def lagging(
        self, duration_s: FloatArray, first_m_s: FloatArray, last_m_s: FloatArray
    ) -> FloatArray:
        """Return the mean time scale where a vehicle speeds up after a turn, in the trajectory's time.

        Accelerating at a the vehicle lags: ẋ = w + T a − MPC_XY_P x − v x/E, T = _LAG_S, E = MPC_XY_ERR_MAX.
        At rest x/E = T a/(MPC_XY_P E + v), which sums up to T ln((MPC_XY_P E + v₂)/(MPC_XY_P E + v₁)).
        As braking puts it ahead by T a/MPC_XY_P before, that is only lost with a noise as large, and with
        none next to nothing.
        """
        catching_m_s = 0.5 * math.pi * self.half_speed_m_s
        gained = np.log1p(np.maximum(last_m_s - first_m_s, 0.0) / (catching_m_s + first_m_s))
        flown = duration_s / self.between(first_m_s, last_m_s) + self.lag_s * gained
        return np.divide(duration_s, flown, out=np.ones_like(flown), where=duration_s > 0.0)

    def wandered_m(self, time_s: FloatArray, way_m: FloatArray) -> FloatArray:
        """Return how much longer than their ways on the map flights of some time are. [m]

        √(v² + w²) − v for each second: the mean length of a velocity v with a normal disturbance whose
        mean length is w.
        """
        return np.hypot(way_m, self.wander_m_s * time_s) - way_m


_SMALL = 1e-6
"""Change of speed below which a series does. [-]"""
