"""How far air drag lets a vehicle fall behind its trajectory, and what PX4's trajectory waits for it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import horizontal, quotient
from planner.flight.motion.px4.braking import STILL_M
from planner.flight.motion.px4.landing import CLIMB_LATE_S, RECORDED_DRAG_PER_S
from planner.flight.motion.px4.pieces import HOLD, PAUSE, Ordered
from planner.units import GRAVITY_M_S2
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
_LEAST_SCALE = 0.1
"""Of the trajectory's time. [-]"""
_STILL_M_S = 1e-3
_WINDOW = 300.0
"""Time constants summed up at once: e³⁰⁰ and its inverse are numbers. [-]"""
_BETWEEN_FLIGHTS = 30.0
"""Time constants between flights of their own: nothing is left of the one before. [-]"""


class Tracking(Value):
    """How a vehicle follows its trajectory."""

    noise_m: float = 0.0
    """Mean horizontal distance between where it should be and its own estimate in a hover. [m]"""
    drag_per_s: float | None = None
    """Deceleration by the air over airspeed; ``None``: it does not lag. [s⁻¹]"""


class TrackingLag(Value):
    """The error of the position that drag causes, by PX4's controller.

    Notes
    -----
    With the acceleration D v of the air, the controllers of position (MPC_XY_P = P) and velocity
    (MPC_XY_VEL_P_ACC = k, MPC_XY_VEL_I_ACC = i) and the integral z,

        a_t + k q + z = D v + v̇,  ż = i q,  q = P e + v_t − v,  v = s v_t,

    v_t and a_t the velocity and acceleration of the trajectory, which are commanded as if its time were not
    stretched, e the vehicle behind it, s = 1 − |e|/E its time (MPC_XY_ERR_MAX = E;
    ``PositionSmoothing::_generateTrajectory``) where e points along v_t and 1 where the vehicle is ahead.
    So z follows D v + v̇ − a_t with the time constant k/i, and

        e = |D v_t − z|/(k (P + v_t/E) + D v_t/E) behind, |D v_t − z|/(k P) ahead.

    After a turn e points across.  Where it is larger than what lies along v_t would be waited for, the
    trajectory waits by turns, only as often as keeps the vehicle beside it: (1 − s) v_t (k + D) = D v_t − z.

    That leaves v̇ − a_t out of e: it takes the fast modes' 1 s to build up, as a vehicle takes its time to
    lean.  With it legs come out 0.3 to 0.9 s too short.

    MPC_TILTMAX_AIR bounds the acceleration by A, the speed by A/D; there the integral stops at A − k q/2
    (anti-windup, ``PositionControl::_velocityControl``).

    Against 23 recorded flights at a drag of 1/s missions are 0.9 % off in the mean and up to 2.7 %, the worst
    at the limit of the tilt.  Open: the first leg after a climb takes 0.5 s more, while the hover thrust PX4
    learnt in the climb holds back its integral.
    """

    drag_per_s: float
    """Deceleration by the air over airspeed. [s⁻¹]"""
    parameters: Px4Parameters

    def off_m(self, ordered: Ordered, moves: Moves) -> tuple[FloatArray, FloatArray]:
        """Return how far ahead of their trajectory vehicles are as moves end, and how far beside. (n,), (n,)

        Ahead is below 0 behind.
        """
        _, force, velocity = self._followed(ordered, moves, _ROUNDS_AHEAD)
        last = _last_flown(ordered, moves)
        rows = np.maximum(last, 0)
        speed = horizontal(velocity[rows])
        along = quotient((force[rows] * velocity[rows]).sum(axis=1), speed, above=_STILL_M_S)
        across = np.sqrt(np.maximum(horizontal(force[rows]) ** 2 - along**2, 0.0))
        waiting = np.where(along > 0.0, self._waiting_per_s2(speed), 0.0)
        ahead, beside = -along / (self._still_per_s2 + waiting), across / self._still_per_s2
        return np.where(last >= 0, ahead, 0.0), np.where(last >= 0, beside, 0.0)

    def past_m(self, ordered: Ordered, moves: Moves) -> FloatArray:
        """Return how far past the heights of their trajectories vehicles are as moves end. (n,)

        The same law upwards, by MPC_Z_P, MPC_Z_VEL_P_ACC and MPC_Z_VEL_I_ACC; no time is stretched for it.
        """
        p, last = self.parameters, _last_flown(ordered, moves)
        edges = ordered.velocities_m_s(np.linspace(0.0, 1.0, _PARTS + 1))[:, :, 2]
        drag = 0.5 * self.drag_per_s * (edges[:, :-1] + edges[:, 1:]).reshape(-1, 1)
        time_s, gap = _parts(ordered, moves)
        constants = time_s * p.vertical_integral_gain_per_s2 / p.vertical_velocity_gain_per_s
        before = slice(_PARTS - 1, None, _PARTS)
        built = _smoothed(drag, constants, gap)[before]
        left = np.exp(-constants[before])[:, None]
        force = (
            self.drag_per_s * edges[:, -1] - (drag[before] + (built - drag[before]) * left)[:, 0]
        )
        stiffness = p.vertical_velocity_gain_per_s * p.vertical_position_gain_per_s
        past = -force * np.sign(edges[:, -1]) / stiffness
        return np.where(last >= 0, past[np.maximum(last, 0)], 0.0)

    def climb_late_s(self) -> float:
        """Return by how much a take-off is late: its height is kept at the vehicle's, k q + z = D v. [s]"""
        drag = self.drag_per_s - RECORDED_DRAG_PER_S
        return max(CLIMB_LATE_S + drag / self.parameters.vertical_integral_gain_per_s2, 0.0)

    def waited_for(self, ordered: Ordered, moves: Moves) -> Ordered:
        """Return pieces with the time the trajectory waits for the vehicle."""
        scale, _, _ = self._followed(ordered, moves, _ROUNDS)
        return ordered.slowed(scale)

    @property
    def _still_per_s2(self) -> float:
        """Acceleration that goes with an error of 1 m, k P. [s⁻²]"""
        return self.parameters.velocity_gain_per_s * self.parameters.position_gain_per_s

    def _waiting_per_s2(self, speed_m_s: FloatArray) -> FloatArray:
        """Return by how much less is asked of a trajectory that waits for an error of 1 m: b. [s⁻²]"""
        p = self.parameters
        return speed_m_s / p.position_error_max_m * (p.velocity_gain_per_s + self.drag_per_s)

    def _error_m(
        self, force_m_s2: FloatArray, velocity_m_s: FloatArray, comes_back: BoolArray
    ) -> FloatArray:
        """Return the errors that trajectories wait for, by D v_t − z and v_t. (n,) [m]

        Notes
        -----
        With f along the trajectory and an error y across it, f = k P x + b sqrt(x² + y²) has no error x
        behind where f < b y: waited for is f/b, in the mean.
        """
        speed = horizontal(velocity_m_s)
        moves = speed > _STILL_M_S
        along = quotient((force_m_s2 * velocity_m_s).sum(axis=1), speed, above=_STILL_M_S)
        still, waiting = self._still_per_s2, self._waiting_per_s2(speed)
        all_of = horizontal(force_m_s2)
        beside = np.sqrt(np.maximum(all_of**2 - along**2, 0.0)) / still
        root = np.sqrt(np.maximum(along**2 + (still**2 - waiting**2) * beside**2, 0.0))
        behind = along**2 - (waiting * beside) ** 2
        behind = quotient(np.maximum(behind, 0.0), still * along + waiting * root)
        error = np.where(behind > 0.0, np.hypot(behind, beside), quotient(along, waiting))
        error = np.where(moves & (along > 0.0), error, 0.0)
        return np.where(comes_back, all_of / (still + waiting), error)

    def _followed(
        self, ordered: Ordered, moves: Moves, rounds: int
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return time scales, and D v_t − z and velocities as pieces end. (p,), (p, 2), (p, 2)"""
        p, count = self.parameters, len(ordered.duration_s)
        settling_s = p.velocity_gain_per_s / p.velocity_integral_gain_per_s2
        edges = ordered.velocities_m_s(np.linspace(0.0, 1.0, _PARTS + 1))[:, :, :2]
        velocity = 0.5 * (edges[:, :-1] + edges[:, 1:]).reshape(-1, 2)
        speed = horizontal(velocity)
        time_s, gap = _parts(ordered, moves)
        drag = self.drag_per_s * velocity
        most_m_s2 = GRAVITY_M_S2 * math.tan(p.lean_angle_max_rad)
        tilted = np.minimum(1.0, quotient(most_m_s2, self.drag_per_s * speed, 1.0))
        # What the integral settles at where the tilt is at its limit.
        asked = speed + (1.0 - tilted) * p.position_gain_per_s * p.position_error_max_m
        error_m_s = np.minimum(asked, max(p.speed_max_m_s, 0.0)) - tilted * speed
        wound = np.maximum(most_m_s2 - 0.5 * p.velocity_gain_per_s * error_m_s, 0.0)
        share = np.where(tilted < 1.0, quotient(wound, self.drag_per_s * speed, 1.0), 1.0)
        given_m_s2 = np.diff(edges, axis=1).reshape(-1, 2) / time_s[:, None]
        comes_back = np.repeat(_comes_back(moves)[ordered.segment_move[ordered.segment]], _PARTS)
        scale, constants, built = tilted, time_s, drag
        for _ in range(rounds):
            constants = time_s / scale / settling_s
            gained = _accelerations_m_s2(edges, scale, time_s / scale) - given_m_s2
            gained = np.where((tilted < 1.0)[:, None], 0.0, gained)
            built = _smoothed(drag * np.minimum(scale, share)[:, None] + gained, constants, gap)
            force = drag - built
            mean = -np.expm1(-constants) / np.maximum(constants, 1e-12)
            error_m = self._error_m(force * mean[:, None], velocity, comes_back)
            slowed = np.maximum(1.0 - error_m / p.position_error_max_m, _LEAST_SCALE)
            scale = np.minimum(slowed, tilted)
        flown_s = (time_s / scale).reshape(count, _PARTS).sum(axis=1)
        left = np.exp(-constants[_PARTS - 1 :: _PARTS])[:, None]
        at_end = edges[:, -1]
        before = slice(_PARTS - 1, None, _PARTS)
        built_at_end = drag[before] + (built[before] - drag[before]) * left
        whole = quotient(ordered.duration_s, flown_s, 1.0)
        return whole, self.drag_per_s * at_end - built_at_end, at_end


def _parts(ordered: Ordered, moves: Moves) -> tuple[FloatArray, FloatArray]:
    """Return the durations of parts of pieces [s], and the gaps before them, in time constants."""
    time_s = np.repeat(ordered.duration_s / _PARTS, _PARTS)
    gap = np.zeros(len(time_s))
    flight = np.cumsum(moves.is_first)[ordered.segment_move[ordered.segment]]
    gap[::_PARTS] = np.where(np.diff(flight, prepend=-1) > 0, _BETWEEN_FLIGHTS, 0.0)
    return time_s, gap


def _last_flown(ordered: Ordered, moves: Moves) -> IntArray:
    """Return the last piece of each move that is no wait; −1 where there is none. (n,)"""
    last = np.full(len(moves.item), -1)
    pieces = np.flatnonzero((ordered.piece_slot != HOLD) & (ordered.piece_slot != PAUSE))
    last[ordered.segment_move[ordered.segment[pieces]]] = pieces
    return last


def _comes_back(moves: Moves) -> BoolArray:
    """Return which moves a trajectory comes back in, behind which a vehicle is that overshot. (n,)

    A return climbs where it is begun, in motion: ``RTL`` takes the place of the vehicle.
    """
    way = moves.target_m - moves.beginnings_m()
    climbs = (horizontal(way) < STILL_M) & (way[:, 2] > 0.0)
    return np.asarray(moves.is_return & ~moves.is_landing & climbs)


def _accelerations_m_s2(
    edges_m_s: FloatArray, scale: FloatArray, flown_s: FloatArray
) -> FloatArray:
    """Return the accelerations of vehicles that fly the velocities of a trajectory at its scale. (n, 2)"""
    around = np.concatenate((scale[:1], 0.5 * (scale[1:] + scale[:-1]), scale[-1:]))
    begins, ends = edges_m_s[:, :-1].reshape(-1, 2), edges_m_s[:, 1:].reshape(-1, 2)
    gained = around[1:, None] * ends - around[:-1, None] * begins
    return np.asarray(gained / flown_s[:, None])


def _smoothed(values: FloatArray, constants: FloatArray, gap: FloatArray) -> FloatArray:
    """Return what follows values, as each begins: z' = z e^(−h) + value (1 − e^(−h)), from 0. (n, k)

    With a gap before it, in time constants, in which z dies away.
    """
    ends = np.cumsum(constants + gap)
    begins = ends - constants
    result, kept = np.empty_like(values), np.zeros(values.shape[1])
    first, start = 0, 0.0
    while first < len(values):
        last = max(int(np.searchsorted(ends, start + _WINDOW)), first + 1)
        some = slice(first, last)
        if last == first + 1:
            result[first] = kept * np.exp(-min(begins[first] - start, _WINDOW))
            fades = np.exp(-min(constants[first], _WINDOW))
            kept = result[first] * fades + values[first] * (1.0 - fades)
        else:
            growth = np.exp(ends[some] - start)[:, None]
            added = -np.expm1(-constants[some])[:, None] * values[some] * growth
            total = kept + np.cumsum(added, axis=0)
            before = np.vstack((kept, total[:-1]))
            result[some] = before * np.exp(start - begins[some])[:, None]
            kept = total[-1] / growth[-1]
        first, start = last, float(ends[last - 1])
    return result
