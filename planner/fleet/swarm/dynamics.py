r"""How agents answer commanded velocities, exactly from tick to tick.

An agent's reference follows the command at once, or, where an autopilot shapes it, within a limit of
acceleration :math:`a`; its velocity is the answer of a linear system of unit gain to that reference,

.. math:: V(s) = G(s) e^{-s T} U(s), \qquad G(0) = 1 ,

in both level directions alike.  Two things follow from the unit gain.  Told to stop, an agent comes to
rest where the integral of its reference leads, whatever the order of :math:`G` and the delay
(`Motions.rest_m`); and its way there is linear in its state, so that a matrix made once gives the ways
of all agents (`DynamicsStack.stop_ways_m`).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.physics.response import TransferFunction

_AT_REST = 0.002
"""What a stopped agent may still have to go, over its speed, when its way is no longer looked at. [s]"""
_WAY_SAMPLES = 24
_MOST_TICKS = 4000
_FASTEST_M_S = 40.0
"""No multicopter's reference is faster; so long its braking is followed. [m s⁻¹]"""


class Dynamics(Value):
    """How one agent answers a commanded velocity."""

    response: TransferFunction
    """From the reference to the velocity, of unit gain and stable."""
    acceleration_m_s2: float = math.inf
    """By how much its reference follows the command. [m s⁻²]"""


class Motions(Value, eq=False):
    """Where n agents are and how they move; ``k`` is the highest order of their systems and one."""

    inner: FloatArray
    """Place, then the states of the system. (n, k, 2) [m], …"""
    inputs: FloatArray
    """References of this and earlier ticks, the newest first. (n, ticks, 2) [m s⁻¹]"""
    reference: FloatArray
    """Reference at the end of the tick. (n, 2) [m s⁻¹]"""
    input_m: FloatArray
    """Integral of the references, from the first place on. (n, 2) [m]"""

    @property
    def place_m(self) -> FloatArray:
        """East and north. (n, 2) [m]"""
        return self.inner[:, 0]


class _System(NamedTuple):
    """One system with its integral, sampled at the ticks."""

    step: FloatArray
    """(k, k)"""
    by_older: FloatArray
    """By the reference from before the delay, for the first part of the tick. (k,)"""
    by_newer: FloatArray
    ticks_late: int
    """Whole ticks of the delay."""
    velocity_of: FloatArray
    """Velocity from the inner state, (k,), and directly from the reference."""
    direct: float


class DynamicsStack:
    """The dynamics of all agents, sampled at the ticks of one clock.

    Parameters
    ----------
    dynamics : sequence of Dynamics
        One of each agent.
    tick_s : float
        Length of a tick; commands change only between ticks. [s]
    """

    def __init__(self, dynamics: Sequence[Dynamics], tick_s: float) -> None:
        self.tick_s = tick_s
        kinds = list(dict.fromkeys(dynamics))
        self._kind_of = np.array([kinds.index(one) for one in dynamics], np.intp)
        self._groups = [np.flatnonzero(self._kind_of == kind) for kind in range(len(kinds))]
        self._size = 1 + max((one.response.order for one in kinds), default=0)
        self._systems = [_sampled(one.response, tick_s, self._size) for one in kinds]
        of = self._kind_of
        self._late = np.array([one.ticks_late for one in self._systems], np.intp)[of]
        self._length = int(self._late.max(initial=0)) + 2
        self._step, self._by_older, self._by_newer = (
            np.array([getattr(one, name) for one in self._systems])[of]
            for name in ("step", "by_older", "by_newer")
        )
        self._velocity_of = np.array([one.velocity_of for one in self._systems])[of]
        self._direct = np.array([one.direct for one in self._systems])[of]
        self._gain_m_s = np.array([one.acceleration_m_s2 for one in dynamics]) * tick_s
        self._ways = [_stop_way(one, tick_s, self._size) for one in kinds]
        self._rows = np.arange(len(of))
        self._powers: dict[int, tuple[FloatArray, FloatArray]] = {}

    def at_rest(self, place_m: FloatArray) -> Motions:
        """Return agents that stand still at places (n, 2) [m]."""
        inner = np.zeros((len(place_m), self._size, 2))
        inner[:, 0] = place_m
        still = np.zeros((len(place_m), 2))
        inputs = np.zeros((len(place_m), self._length, 2))
        return Motions(inner=inner, inputs=inputs, reference=still, input_m=np.array(place_m))

    def advanced(self, motions: Motions, command_m_s: FloatArray) -> Motions:
        """Return agents a tick later, which fly by commands (n, 2) [m s⁻¹]."""
        reference, given = self._shaped(motions.reference, command_m_s)
        inputs = np.concatenate((given[:, None], motions.inputs[:, :-1]), axis=1)
        older, newer = inputs[self._rows, self._late + 1], inputs[self._rows, self._late]
        inner = self._step @ motions.inner
        inner += self._by_older[:, :, None] * older[:, None]
        inner += self._by_newer[:, :, None] * newer[:, None]
        return Motions(
            inner=inner,
            inputs=inputs,
            reference=reference,
            input_m=motions.input_m + self.tick_s * given,
        )

    def is_even(self, motions: Motions, command_m_s: FloatArray) -> bool:
        """Return whether every agent has had its command for so long that none is under way."""
        return bool(
            (motions.inputs == command_m_s[:, None]).all()
            and (motions.reference == command_m_s).all()
        )

    def advanced_evenly(self, motions: Motions, ticks: int) -> Motions:
        """Return agents some ticks later, all of whose references stay as they are (`is_even`)."""
        if ticks not in self._powers:
            size = self._size
            whole = np.zeros((len(self._rows), size + 1, size + 1))
            whole[:, :size, :size] = self._step
            whole[:, :size, size] = self._by_older + self._by_newer
            whole[:, size, size] = 1.0
            power = np.linalg.matrix_power(whole, ticks)
            self._powers[ticks] = power[:, :size, :size], power[:, :size, size]
        step, by_input = self._powers[ticks]
        given = motions.reference
        return replace(
            motions,
            inner=step @ motions.inner + by_input[:, :, None] * given[:, None],
            input_m=motions.input_m + ticks * self.tick_s * given,
        )

    def velocity_m_s(self, motions: Motions) -> FloatArray:
        """Return how agents move at the end of the tick. (n, 2) [m s⁻¹]"""
        inside = np.einsum("nk,nkx->nx", self._velocity_of, motions.inner)
        return np.asarray(inside + self._direct[:, None] * motions.inputs[self._rows, self._late])

    def rest_m(self, motions: Motions) -> FloatArray:
        """Return where agents come to rest, told now to stop. (n, 2) [m]"""
        speed = np.hypot(*motions.reference.T)
        return motions.input_m + self._running_out_s(speed)[:, None] * motions.reference

    def leading_m_s(self, motions: Motions, way_m: FloatArray, speed_m_s: FloatArray) -> FloatArray:
        """Return commands that lead the places of rest along ways (n, 2) [m], at a speed at most.

        What is left of a way is gone in the last tick, by a part of what the tick could do.
        """
        length = np.hypot(*way_m.T)
        if np.isinf(self._gain_m_s).all():
            reached = np.minimum(speed_m_s / np.maximum(length, 1e-12), 1.0 / self.tick_s)
            return np.asarray(reached[:, None] * way_m)
        unit = way_m / np.maximum(length, 1e-12)[:, None]
        now = np.hypot(*motions.reference.T)
        least = np.maximum(now - self._gain_m_s, 0.0)
        most = np.minimum(speed_m_s, now + self._gain_m_s)
        forward = self.advanced(motions, most[:, None] * unit)
        gone = np.hypot(*(self.rest_m(forward) - self.rest_m(motions)).T)
        part = np.minimum(length / np.maximum(gone, 1e-12), 1.0)
        return np.asarray((least + part * np.maximum(most - least, 0.0))[:, None] * unit)

    def _running_out_s(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the integral of references that fall to zero, over what they are now. (n,) [s]"""
        with np.errstate(invalid="ignore", divide="ignore"):
            ticks = np.where(np.isinf(self._gain_m_s), 0.0, speed_m_s / self._gain_m_s)
            whole = np.floor(ticks)
            # each tick has the mean of its two ends; the last ends at zero
            total = whole * (ticks - 0.5 * whole) + 0.5 * (ticks - whole)
            return np.where(ticks > 0.0, self.tick_s * total / ticks, 0.0)

    def _shaped(
        self, reference: FloatArray, command_m_s: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Return references at the end of the tick, and their means over it."""
        change = command_m_s - reference
        size = np.hypot(*change.T)
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(size > self._gain_m_s, self._gain_m_s / size, 1.0)
        after = np.where(part[:, None] < 1.0, reference + part[:, None] * change, command_m_s)
        mean = np.where(np.isinf(self._gain_m_s)[:, None], after, 0.5 * (reference + after))
        return after, mean

    def stop_ways_m(self, motions: Motions) -> FloatArray:
        """Return the ways of agents told now to stop, (n, samples, 2) [m]: here first, at rest last."""
        ways = np.empty((len(self._rows), _WAY_SAMPLES + 2, 2))
        ways[:, 0] = motions.place_m
        ways[:, -1] = self.rest_m(motions)
        for group, way in zip(self._groups, self._ways, strict=True):
            begun = np.concatenate(
                (motions.inner[group], motions.inputs[group, : way.pending]), axis=1
            )
            found = way.of_begun @ begun
            if way.of_future.size:
                reference = motions.reference[group]
                speed = np.hypot(*reference.T)
                lost = self._gain_m_s[group][:, None] * np.arange(way.of_future.shape[1] + 1)
                left = np.maximum(1.0 - lost / np.maximum(speed, 1e-12)[:, None], 0.0)
                inputs = (0.5 * (left[:, 1:] + left[:, :-1]))[..., None] * reference[:, None]
                found += way.of_future @ inputs
            ways[group, 1:-1] = found
        return ways


@lru_cache(maxsize=64)
def _sampled(response: TransferFunction, tick_s: float, size: int) -> _System:
    """Return a system and the integral of its answer, sampled: exact for references even over a tick."""
    from scipy.linalg import expm

    order = response.order
    lead = response.denominator[0]
    monic = np.array(response.denominator) / lead
    numerator = np.zeros(order + 1)
    numerator[order + 1 - len(response.numerator) :] = np.array(response.numerator) / lead
    direct = float(numerator[0])
    velocity_of = np.zeros(size)
    velocity_of[1 : order + 1] = numerator[1:] - direct * monic[1:]
    whole = np.zeros((size + 1, size + 1))  # with the reference as last state
    whole[0, :size], whole[0, size] = velocity_of, direct
    if order:
        whole[1, 1 : order + 1] = -monic[1:]
        whole[1, size] = 1.0
        whole[range(2, order + 1), range(1, order)] = 1.0
    ticks = response.delay_s / tick_s
    late = math.floor(ticks + 1e-9)
    first_s = max(ticks - late, 0.0) * tick_s
    before, after = expm(whole * first_s), expm(whole * (tick_s - first_s))
    return _System(
        step=(after @ before)[:size, :size],
        by_older=after[:size, :size] @ before[:size, size],
        by_newer=after[:size, size],
        ticks_late=late,
        velocity_of=velocity_of,
        direct=direct,
    )


class _StopWay(NamedTuple):
    """The way of a stop as a linear function of where it begins."""

    of_begun: FloatArray
    """Places from the inner state and the references under way. (samples, k + pending)"""
    of_future: FloatArray
    """Places from the references to come, while they fall to zero. (samples, ticks)"""
    pending: int


@lru_cache(maxsize=64)
def _stop_way(dynamics: Dynamics, tick_s: float, size: int) -> _StopWay:
    """Return the way of a stop, at times spread until the agent stands."""
    system = _sampled(dynamics.response, tick_s, size)
    pending = system.ticks_late + 1
    settled = _ticks_to_rest(system)
    braking = 0
    if not math.isinf(dynamics.acceleration_m_s2):
        braking = math.ceil(_FASTEST_M_S / (dynamics.acceleration_m_s2 * tick_s)) + 1
    horizon = min(settled + pending + braking, _MOST_TICKS)
    # denser at first: an agent is fastest there
    share = (np.arange(1, _WAY_SAMPLES + 1) / _WAY_SAMPLES) ** 1.5
    chosen = np.unique(np.maximum(np.round(share * horizon), 1).astype(np.intp))
    chosen = np.concatenate((chosen, np.full(_WAY_SAMPLES - len(chosen), chosen[-1])))

    def places(state: FloatArray, inputs: FloatArray) -> FloatArray:
        """Return the places of agents (n, k) at chosen ticks, by references (n, ticks) from the oldest."""
        found = np.empty((horizon + 1, len(state)))
        for tick in range(1, horizon + 1):
            state = state @ system.step.T
            state = state + np.outer(inputs[:, tick - 1], system.by_older)
            state = state + np.outer(inputs[:, tick], system.by_newer)
            found[tick] = state[:, 0]
        return found[chosen]

    count = size + pending
    state = np.zeros((count, size))
    state[:size] = np.eye(size)
    inputs = np.zeros((count, horizon + 1))
    for ago in range(pending):
        # what was commanded ``ago`` ticks ago acts, in full or in part, late - ago ticks from now
        inputs[size + ago, pending - 1 - ago] = 1.0
    of_begun = places(state, inputs)
    of_future = np.zeros((len(chosen), 0))
    if braking:
        inputs = np.zeros((braking, horizon + 1))
        for tick in range(braking):
            if pending + tick <= horizon:
                inputs[tick, pending + tick] = 1.0
        of_future = places(np.zeros((braking, size)), inputs)
    return _StopWay(of_begun=of_begun, of_future=of_future, pending=pending)


def _ticks_to_rest(system: _System) -> int:
    """Return after how many ticks without reference an agent has all but ended its way."""
    state = np.zeros(len(system.step))
    for _ in range(_MOST_TICKS):  # in steady flight at 1 m/s
        before = state
        state = system.step @ state + system.by_older + system.by_newer
        state[0] = 0.0
        if np.abs(state - before).max() <= 1e-9 * max(np.abs(state).max(), 1.0):
            break
    ways = []
    for _ in range(_MOST_TICKS):
        state = system.step @ state
        ways.append(state[0])
        if len(ways) > 1 and np.abs(state[1:]).max(initial=0.0) <= 1e-9:
            break
    left = np.abs(np.array(ways) - ways[-1]) > _AT_REST
    return int(np.flatnonzero(left)[-1]) + 2 if left.any() else 1
