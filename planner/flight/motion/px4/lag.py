"""How far air drag lets a vehicle fall behind its trajectory, and what PX4's trajectory waits for it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import horizontal, quotient, rows_of
from planner.flight.motion.px4.braking import STILL_M, tilted_m_s2
from planner.flight.motion.px4.pieces import HOLD, PAUSE, Ordered
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.moves import Moves
    from planner.vehicle.parameters.px4 import Px4Parameters

_PARTS = 4
"""Parts of a piece over which its velocity counts as constant."""
_ROUNDS, _ROUNDS_AHEAD = 5, 3
"""What is waited for makes a vehicle slower, and that the drag less: after five rounds legs change by less
than 0.3 %, after three the place by centimetres."""
_DIVISIONS = np.array([0.5, 1.0, 1.5, 2.0, 3.0])
"""Where pieces are divided, in time constants: what a vehicle is off by changes less and less."""
_LEAST_SCALE = 0.1
"""Of the trajectory's time. [-]"""
_STILL_M_S = 1e-3
_TINY = 1e-300
"""Divides nothing into nothing. [-]"""
_ABREAST = 8
"""Steps that stretches of a recurrence take beside each other."""
_ONE_BY_ONE = 64
"""Steps of a recurrence that are sooner taken one after the other."""


_NO_INTEGRAL = 1e-9
"""A gain below this builds up nothing during any flight. [s⁻²]"""


class TrackingLag(Value):
    """The error of the position that drag causes, by PX4's controller.

    Notes
    -----
    With the acceleration D v of the air, the controllers of position (MPC_XY_P = P) and velocity
    (MPC_XY_VEL_P_ACC = k, MPC_XY_VEL_I_ACC = i, MPC_XY_VEL_D_ACC = d) and the integral z,

        a_t + k q + z − d v̇ = D v + v̇,  ż = i q,  q = P e + v_t − v,  v = s v_t,

    v_t and a_t the velocity and acceleration of the trajectory, which are commanded as if its time were not
    stretched, e the vehicle behind it, s = 1 − |e|/E its time (MPC_XY_ERR_MAX = E;
    ``PositionSmoothing::_generateTrajectory``) where e points along v_t and 1 where the vehicle is ahead.
    So z follows D v + (1 + d) v̇ − a_t with the time constant k/i, and

        e = |D v_t − z|/(k (P + v_t/E) + D v_t/E) behind, |D v_t − z|/(k P) ahead.

    After a turn e points across.  Where it is larger than what lies along v_t would be waited for, the
    trajectory waits by turns, only as often as keeps the vehicle beside it: (1 − s) v_t (k + D) = D v_t − z.

    That leaves (1 + d) v̇ − a_t out of the e waited for: it takes the fast modes' 1 s to build up, as a
    vehicle takes its time to lean; what d v̇ has waited for as a leg is begun, it arrives sooner by.  Where
    the vehicle is, and what it has reached, is decided by the e that gets there at P (``_off_m``): braking
    it comes past its trajectory, by 1.7 m at the stops from 7 m/s recorded at a drag of 1/s.

    MPC_TILTMAX_AIR bounds the acceleration by A, the speed by A/D; there the integral stops at A − k q/2
    (anti-windup, ``PositionControl::_velocityControl``).

    Against 23 recorded flights at a drag of 1/s missions are 0.9 % off in the mean and up to 2.7 %, the worst
    at the limit of the tilt.  Open: the first leg after a climb takes 0.5 s more, while the hover thrust PX4
    learnt in the climb holds back its integral.
    """

    drag_per_s: float
    """Deceleration by the air over airspeed. [s⁻¹]"""
    parameters: Px4Parameters

    def off_m(self, ordered: Ordered, moves: Moves) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return how far off their trajectories vehicles are as moves end. (n,), (n,), (n,)

        Ahead, below 0 behind; beside; and past their heights.
        """
        parts, last = _Parts.of(ordered, moves, axes=3), _last_flown(ordered, moves)
        rows = np.maximum(last, 0)
        _, displaced = self._followed(parts, ordered, moves, _ROUNDS_AHEAD)
        off, velocity = displaced[:, rows], parts.level_m_s[:, -1, rows]
        ahead = quotient(_dot(off, velocity), _size(velocity), above=_STILL_M_S)
        beside = np.sqrt(np.maximum(_dot(off, off) - ahead**2, 0.0))
        flies = last >= 0
        return (
            np.where(flies, ahead, 0.0),
            np.where(flies, beside, 0.0),
            np.where(flies, self._past_m(parts)[rows], 0.0),
        )

    def _past_m(self, parts: _Parts) -> FloatArray:
        """Return how far past the heights of their trajectories vehicles are as pieces end. (p,)

        The same law upwards, by MPC_Z_P, MPC_Z_VEL_P_ACC and MPC_Z_VEL_I_ACC; no time is stretched for it.
        """
        p, edges = self.parameters, parts.velocity_m_s[2]
        drag = 0.5 * self.drag_per_s * (edges[:-1] + edges[1:])
        rate_per_s = p.vertical_integral_gain_per_s2 / p.vertical_velocity_gain_per_s
        settled = -np.expm1(-parts.time_s * rate_per_s)
        built = _smoothed(drag[None], settled, parts.first)[0, -1]
        force = self.drag_per_s * edges[-1] - built - (drag[-1] - built) * settled
        stiffness = p.vertical_velocity_gain_per_s * p.vertical_position_gain_per_s
        return np.asarray(-force * np.sign(edges[-1]) / stiffness)

    def followed(self, ordered: Ordered, moves: Moves) -> Ordered:
        """Return the pieces as the vehicle flies them, in the time the trajectory waits for it."""
        ordered = ordered.divided(self._settling_s * _DIVISIONS)
        parts = _Parts.of(ordered, moves, axes=2)
        scale, off_m = self._followed(parts, ordered, moves, _ROUNDS)
        slowed = ordered.slowed(scale)
        is_first = np.diff(_flights(ordered, moves), prepend=-1) > 0
        return slowed.displaced(_between_ends(off_m, slowed, is_first))

    @property
    def _settling_s(self) -> float:
        """Time constant in which the integral of the velocity follows the drag, k/i. [s]"""
        p = self.parameters
        return p.velocity_gain_per_s / max(p.velocity_integral_gain_per_s2, _NO_INTEGRAL)

    @property
    def _still_per_s2(self) -> float:
        """Acceleration that goes with an error of 1 m, k P. [s⁻²]"""
        return self.parameters.velocity_gain_per_s * self.parameters.position_gain_per_s

    def _waiting_per_s2(self, speed_m_s: FloatArray) -> FloatArray:
        """Return by how much less is asked of a trajectory that waits for an error of 1 m: b. [s⁻²]"""
        p = self.parameters
        return speed_m_s / p.position_error_max_m * (p.velocity_gain_per_s + self.drag_per_s)

    def _off_m(
        self, force_m_s2: FloatArray, velocity_m_s: FloatArray, time_s: FloatArray, first: IntArray
    ) -> FloatArray:
        """Return where vehicles are beside trajectories as pieces end. (2, p) [m]

        By D v_t − z and v_t of their parts.  They get there by ė = f/k − P e − v_t |e|/E: at P, and sooner
        where the trajectory waits.
        """
        speed, still = _size(velocity_m_s), self._still_per_s2
        heading = velocity_m_s / np.maximum(speed, _STILL_M_S)
        along = np.where(speed > _STILL_M_S, _dot(force_m_s2, heading), 0.0)
        stiffness = still + np.where(along > 0.0, self._waiting_per_s2(speed), 0.0)
        last = heading * (along * (1.0 / still - 1.0 / stiffness)) - force_m_s2 / still
        settled = -np.expm1(time_s * stiffness * (-1.0 / self.parameters.velocity_gain_per_s))
        begun = _smoothed(last, settled, first)[:, -1]
        return np.asarray(begun + (last[:, -1] - begun) * settled[-1])

    def _tilted(self, speed_m_s: FloatArray) -> tuple[FloatArray | float, FloatArray | float]:
        """Return what the tilt leaves of speeds, and the integral builds up of their drag. (n,), (n,) [-]

        1 where MPC_TILTMAX_AIR allows the speed.
        """
        p, drag_m_s2 = self.parameters, self.drag_per_s * speed_m_s
        most_m_s2 = tilted_m_s2(p)
        if not (drag_m_s2 > most_m_s2).any():
            return 1.0, 1.0
        tilted = np.minimum(1.0, quotient(most_m_s2, drag_m_s2, 1.0))
        asked = speed_m_s + (1.0 - tilted) * p.position_gain_per_s * p.position_error_max_m
        error_m_s = np.minimum(asked, max(p.speed_max_m_s, 0.0)) - tilted * speed_m_s
        # Of A, anti-windup leaves A − k q/2.
        built_m_s2 = np.maximum(most_m_s2 - 0.5 * p.velocity_gain_per_s * error_m_s, 0.0)
        return tilted, np.where(tilted < 1.0, quotient(built_m_s2, drag_m_s2, 1.0), 1.0)

    def _followed(
        self, parts: _Parts, ordered: Ordered, moves: Moves, rounds: int
    ) -> tuple[FloatArray, FloatArray]:
        """Return time scales, and where vehicles are beside trajectories as pieces end. (p,), (2, p)"""
        edges, time_s = parts.level_m_s, parts.time_s
        velocity = 0.5 * (edges[:, :-1] + edges[:, 1:])
        speed, drag = _size(velocity), self.drag_per_s * velocity
        tilted, most_of_drag = self._tilted(speed)
        given_m_s2 = (edges[:, 1:] - edges[:, :-1]) / time_s
        asked_per_s = (1.0 + self.parameters.velocity_derivative_gain) / time_s
        constants = time_s / self._settling_s
        waited_for = _WaitedFor.of(
            quotient(1.0, speed, above=_STILL_M_S) * velocity,
            self._waiting_per_s2(speed),
            self._still_per_s2,
            rows_of(_comes_back(moves)[ordered.segment_move[ordered.segment]]),
        )
        tilts, scale = isinstance(tilted, np.ndarray), np.minimum(np.ones_like(speed), tilted)
        built, settled = drag, scale
        sought, force = np.empty_like(drag), np.empty_like(drag)
        for _ in range(rounds):
            # Of a vehicle that flies the velocities of its trajectory at its scale.
            flown_m_s = _at_ends(scale) * edges
            np.subtract(flown_m_s[:, 1:], flown_m_s[:, :-1], out=sought)
            sought *= asked_per_s * scale
            sought -= given_m_s2
            if tilts:
                sought *= tilted >= 1.0
            drags = np.minimum(scale, most_of_drag) if tilts else scale
            sought += np.multiply(drag, drags, out=force)
            flown = constants / scale
            settled = np.expm1(-flown)
            np.negative(settled, out=settled)
            built = _smoothed(sought, settled, parts.first)
            np.subtract(drag, built, out=force)
            force *= np.divide(settled, flown, out=flown)
            scale = waited_for.error_m(force)
            scale /= -self.parameters.position_error_max_m
            scale += 1.0
            np.maximum(scale, _LEAST_SCALE, out=scale)
            np.minimum(scale, tilted, out=scale)
        flown_s = time_s / scale
        whole = quotient(ordered.duration_s, flown_s.sum(axis=0), 1.0)
        force = self.drag_per_s * edges[:, 1:] - built - (drag - built) * settled
        return whole, self._off_m(force, edges[:, 1:], flown_s, parts.first)


class _WaitedFor(Value, eq=False):
    """The errors that trajectories wait for, by D v_t − z.

    A trajectory that comes back to a vehicle which overshot waits for all of its error.

    Notes
    -----
    With f along the trajectory and an error y across it, f = k P x + b sqrt(x² + y²) has no error x
    behind where f < b y: waited for is f/b, in the mean.
    """

    along: FloatArray
    """Direction of v_t, 0 of one that stands. (2, k, p)"""
    waiting_per_s2: FloatArray
    """b of parts. (k, p)"""
    still_per_s2: float
    """k P."""
    beside: FloatArray
    """(b/k P)². (k, p)"""
    waiting_squared: FloatArray
    """b², no less than divides. (k, p)"""
    comes_back: IntArray
    """Pieces in which a trajectory comes back."""

    @classmethod
    def of(
        cls, along: FloatArray, waiting_per_s2: FloatArray, still_per_s2: float, back: IntArray
    ) -> _WaitedFor:
        """Return what the parts of pieces in these directions wait for."""
        squared = waiting_per_s2 * waiting_per_s2
        return cls(
            along=along,
            waiting_per_s2=waiting_per_s2,
            still_per_s2=still_per_s2,
            beside=squared * (1.0 / still_per_s2**2),
            waiting_squared=np.maximum(squared, _TINY),
            comes_back=back,
        )

    def error_m(self, force_m_s2: FloatArray) -> FloatArray:
        """Return the errors of forces. (k, p) [m]"""
        back = self.comes_back
        ahead = _dot(force_m_s2, self.along)
        np.maximum(ahead, 0.0, out=ahead)
        squared, ahead_squared = _dot(force_m_s2, force_m_s2), ahead * ahead
        back_m_s2 = np.sqrt(squared[:, back]) if len(back) else None
        np.maximum(squared, ahead_squared, out=squared)
        # b² y², no more than f² is waited for
        beside = squared - ahead_squared
        beside *= self.beside
        np.minimum(beside, ahead_squared, out=beside)
        squared -= beside
        root = np.sqrt(squared, out=squared)
        root *= self.waiting_per_s2
        ahead *= self.still_per_s2
        root += ahead
        behind = ahead_squared
        behind -= beside
        behind /= np.maximum(root, _TINY, out=root)
        behind *= behind
        beside /= self.waiting_squared
        behind += beside
        error: FloatArray = np.sqrt(behind, out=behind)
        if back_m_s2 is not None:
            error[:, back] = back_m_s2 / (self.still_per_s2 + self.waiting_per_s2[:, back])
        return error


class _Parts(Value, eq=False):
    """p pieces cut into parts, of which each is a row: over it the velocity counts as constant."""

    velocity_m_s: FloatArray
    """East and north, and up where heights are asked for, where parts begin and end. (axes, _PARTS + 1, p)"""
    time_s: FloatArray
    """Duration of a part of each piece. (p,) [s]"""
    first: IntArray
    """The pieces that flights of their own begin with."""

    @property
    def level_m_s(self) -> FloatArray:
        """East and north of the velocity. (2, _PARTS + 1, p)"""
        return self.velocity_m_s[:2]

    @classmethod
    def of(cls, ordered: Ordered, moves: Moves, *, axes: int) -> _Parts:
        """Return the parts of pieces in flown order."""
        return cls(
            velocity_m_s=ordered.velocities_m_s(np.linspace(0.0, 1.0, _PARTS + 1), axes),
            time_s=ordered.duration_s / _PARTS,
            first=rows_of(np.diff(_flights(ordered, moves), prepend=-1)),
        )


def _at_ends(values: FloatArray) -> FloatArray:
    """Return what is between parts: the mean of the two that meet there. (_PARTS + 1, p)"""
    ends = np.zeros((len(values) + 1, values.shape[1]))
    np.add(values[1:], values[:-1], out=ends[1:-1])
    np.add(values[-1, :-1], values[0, 1:], out=ends[0, 1:])
    ends *= 0.5
    ends[-1, :-1] = ends[0, 1:]
    ends[0, 0], ends[-1, -1] = values[0, 0], values[-1, -1]
    return ends


def _flights(ordered: Ordered, moves: Moves) -> IntArray:
    """Return the flight of its own that each piece belongs to. (p,)"""
    return np.asarray(moves.is_first.cumsum()[ordered.segment_move[ordered.segment]])


def _between_ends(off_m: FloatArray, ordered: Ordered, is_first: BoolArray) -> FloatArray:
    """Return cubics of time through what pieces end with, of which none passes its ends. (4, 2, p)

    Flights of their own begin with none.  The slope where two pieces meet is the harmonic mean of theirs, as
    the longer counts more (Fritsch and Butland 1984); on the ground nothing moves.
    """
    moving = ~ordered.is_grounded
    end = np.where(moving, off_m, 0.0)
    set_down = np.maximum.accumulate(np.where(moving | is_first, np.arange(len(moving)), 0))
    end = end.take(set_down, axis=1)
    begin = np.where(is_first, 0.0, np.concatenate((end[:, :1], end[:, :-1]), axis=1))
    time = ordered.duration_s
    mean = np.where(moving, (end - begin) / time, 0.0)
    before, after = mean[:, :-1], mean[:, 1:]
    short, long = time[:-1] + 2.0 * time[1:], 2.0 * time[:-1] + time[1:]
    same = (before * after > 0.0) & ~is_first[1:]
    ones = np.where(same, before, 1.0), np.where(same, after, 1.0)
    slopes = np.zeros((2, len(time) + 1))
    slopes[:, 1:-1] = np.where(same, (short + long) / (short / ones[0] + long / ones[1]), 0.0)
    first, last = slopes[:, :-1], slopes[:, 1:]
    bend, jerk = (3.0 * mean - 2.0 * first - last) / time, (first + last - 2.0 * mean) / time**2
    return np.array((begin, first, bend, jerk))


def _dot(one: FloatArray, other: FloatArray) -> FloatArray:
    """Return the scalar products of horizontal vectors, east and north apart. (2, …), (2, …)"""
    product: FloatArray = one[0] * other[0]
    product += one[1] * other[1]
    return product


def _size(vectors: FloatArray) -> FloatArray:
    """Return the lengths of horizontal vectors, east and north apart. (2, …)"""
    return np.asarray(np.sqrt(_dot(vectors, vectors)))


def _last_flown(ordered: Ordered, moves: Moves) -> IntArray:
    """Return the last piece of each move that is no wait; −1 where there is none. (n,)"""
    last = np.full(len(moves.item), -1)
    pieces = rows_of((ordered.piece_slot != HOLD) & (ordered.piece_slot != PAUSE))
    last[ordered.segment_move[ordered.segment[pieces]]] = pieces
    return last


def _comes_back(moves: Moves) -> BoolArray:
    """Return which moves a trajectory comes back in, behind which a vehicle is that overshot. (n,)

    A return climbs where it is begun, in motion: ``RTL`` takes the place of the vehicle.
    """
    way = moves.target_m - moves.beginnings_m()
    climbs = (horizontal(way) < STILL_M) & (way[:, 2] > 0.0)
    return np.asarray(moves.is_return & ~moves.is_landing & climbs)


def _smoothed(values: FloatArray, settled: FloatArray, first: IntArray) -> FloatArray:
    """Return what follows values, as each begins: z' = z + (value − z) settled, 0 as flights begin.

    Of parts, (m, k, p), by the fractions of the way to the values that are gone while they last, (k, p) or
    (p,), and the pieces that flights begin with.
    """
    edges = np.empty((len(values), values.shape[1] + 1, values.shape[2]))
    left, gained = np.empty(values.shape[1:]), edges[:, 1:]
    np.subtract(1.0, settled, out=left)
    np.multiply(values, settled, out=gained)
    left[-1, first - 1] = gained[:, -1, first - 1] = 0.0
    _recur(left, gained)
    edges[:, 0, 1:], edges[:, 0, 0] = edges[:, -1, :-1], 0.0
    return edges[:, :-1]


def _recur(left: FloatArray, gained: FloatArray) -> None:
    """Make what is gained z of z' = z left + gained, from 0: down each column, then the next.

    Of (k, n) and (m, k, n).  Columns are taken beside each other, each from 0; what they end with recurs the
    same way, in columns of their own, and dies away in the column after.
    """
    steps, columns = left.shape
    for step in range(1, steps):
        gained[:, step] += gained[:, step - 1] * left[step]
        left[step] *= left[step - 1]
    if columns == 1:
        return
    if columns <= _ONE_BY_ONE:
        kept = left[-1].tolist()
        before: FloatArray = np.array([_recurred(kept, one) for one in gained[:, -1].tolist()])
    else:
        filled = -columns % _ABREAST
        both = np.zeros((1 + len(gained), columns + filled))
        both[0, :columns], both[1:, :columns] = left[-1], gained[:, -1]
        both = both.reshape(len(both), -1, _ABREAST).swapaxes(1, 2).copy()
        own_left, own = both[0], both[1:]
        _recur(own_left, own)
        before = own.swapaxes(1, 2).reshape(len(own), -1)[:, : columns - 1]
    gained[..., 1:] += left[:, 1:] * before[:, None]


def _recurred(left: list[float], gained: list[float]) -> list[float]:
    """Return z of one column after the other but the last, from 0."""
    z, every = 0.0, list[float]()
    for kept, gain in zip(left[:-1], gained[:-1], strict=True):
        z = z * kept + gain
        every.append(z)
    return every
