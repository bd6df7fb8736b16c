r"""How agents answer commanded velocities, exactly from tick to tick.

An agent's reference follows the command at once, or, where an autopilot shapes it, within limits of
acceleration :math:`a` and jerk :math:`j`: a ramp of the one, and its mean over :math:`a / j`, which is an
S-curve.  Its velocity is the answer of a linear system of unit gain to that reference,

.. math:: V(s) = G(s) e^{-s T} U(s), \qquad G(0) = 1 ,

in both level directions alike.  Two things follow from the unit gain.  Told to stop, an agent comes to
rest where the integral of its reference leads, whatever the order of :math:`G` and the delay
(`DynamicsStack.rest_m`); and its way there is linear in its state, so that a matrix made once gives the
ways of all agents (`DynamicsStack.ways_m`).
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.physics.response import TransferFunction
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray

_AT_REST = 0.002
"""What a stopped agent may still have to go, over its speed, when its way is no longer looked at. [s]"""
_WAY_SAMPLES = 24
_MOST_TICKS = 4000
_SERIES = 16
"""Terms of an exponential of at most one half: those left out are below 1e-19."""
_NOBODY = TransferFunction(numerator=(1.0,), denominator=(1.0,))
_SAME = 1e-9
"""Of a tick, by which a delay may miss a whole one. [-]"""
_FASTEST_M_S = 40.0
"""No multicopter's reference is faster; so long its braking is followed. [m s⁻¹]"""


class Dynamics(Value):
    """How one agent answers a commanded velocity."""

    response: TransferFunction
    """From the reference to the velocity, of unit gain and stable."""
    acceleration_m_s2: float = math.inf
    """By how much its reference follows the command. [m s⁻²]"""
    smoothing_s: float = 0.0
    """Its reference is the mean of that over so long: its jerk is at most the acceleration over it. [s]"""


class Motions(Value, eq=False):
    """Where n agents are and how they move."""

    state: FloatArray
    """Place, inner states of the system, references of this and earlier ticks, the newest first, and the
    integral of all references from the first place on. (n, k, 2) [m], …"""
    reference: FloatArray
    """Reference at the end of the tick. (n, 2) [m s⁻¹]"""

    @property
    def place_m(self) -> FloatArray:
        """East and north. (n, 2) [m]"""
        return self.state[:, 0]


class _Maps(NamedTuple):
    """What follows from a state, linear in it: of one kind of agent, or of each agent."""

    tick: FloatArray
    """State a tick later, by the state and the mean reference of that tick. (k, k + 1)"""
    velocity: FloatArray
    """(1, k)"""
    stop: FloatArray
    """Places on the way of a stop: here first, at rest last. (samples, k)"""
    future: FloatArray
    """The same by the references of ticks to come, while they fall to zero. (samples, ticks)"""


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
        kinds = list(dict.fromkeys(dynamics)) or [Dynamics(response=_NOBODY)]
        delays = [
            math.floor((one.response.delay_s + one.smoothing_s) / tick_s + _SAME) for one in kinds
        ]
        self._inner = 1 + max(one.response.order + (one.smoothing_s > 0.0) for one in kinds)
        self._inputs = 2 + max(delays)
        maps = [_maps(one, tick_s, self._inner, self._inputs) for one in kinds]
        future = max(one.future.shape[1] for one in maps)
        kind_of = np.array([kinds.index(one) for one in dynamics], np.intp)

        def of_each(matrices: Sequence[FloatArray]) -> FloatArray:
            return matrices[0] if len(matrices) == 1 else np.array(matrices)[kind_of]

        self._maps = _Maps(
            tick=of_each([one.tick for one in maps]),
            velocity=of_each([one.velocity for one in maps]),
            stop=of_each([one.stop for one in maps]),
            future=of_each([_widened(one.future, future) for one in maps]),
        )
        self._gain_m_s = np.array([one.acceleration_m_s2 for one in dynamics]) * tick_s
        self._is_shaped = bool(np.isfinite(self._gain_m_s).any())
        self._powers: dict[int, FloatArray] = {}
        self._ways: dict[int, FloatArray] = {}

    def at_rest(self, place_m: FloatArray) -> Motions:
        """Return agents that stand still at places (n, 2) [m]."""
        state = np.zeros((len(place_m), self._inner + self._inputs + 1, 2))
        state[:, 0] = state[:, -1] = place_m
        return Motions(state=state, reference=np.zeros((len(place_m), 2)))

    def advanced(self, motions: Motions, command_m_s: FloatArray) -> Motions:
        """Return agents a tick later, which fly by commands (n, 2) [m s⁻¹]."""
        reference, given = self._shaped(motions.reference, command_m_s)
        return Motions(state=self._maps.tick @ _given(motions, given), reference=reference)

    def is_even(self, motions: Motions, command_m_s: FloatArray) -> bool:
        """Return whether every agent has had its command for so long that none is under way."""
        given = motions.state[:, self._inner : -1]
        return bool(
            (given == command_m_s[:, None]).all() and (motions.reference == command_m_s).all()
        )

    def advanced_evenly(self, motions: Motions, ticks: int) -> Motions:
        """Return agents some ticks later, all of whose references stay as they are (`is_even`)."""
        state = self._power(ticks) @ _given(motions, motions.reference)
        return replace(motions, state=state)

    def _power(self, ticks: int) -> FloatArray:
        """Return the state some ticks later, by the state and one reference in all of them."""
        if ticks not in self._powers:
            tick = self._maps.tick
            held = np.broadcast_to(
                np.eye(tick.shape[-1])[-1:], (*tick.shape[:-2], 1, tick.shape[-1])
            )
            whole = np.concatenate((tick, held), axis=-2)
            self._powers[ticks] = np.linalg.matrix_power(whole, ticks)[..., :-1, :]
        return self._powers[ticks]

    def velocity_m_s(self, motions: Motions) -> FloatArray:
        """Return how agents move at the end of the tick. (n, 2) [m s⁻¹]"""
        return np.asarray((self._maps.velocity @ motions.state)[:, 0])

    def rest_m(self, motions: Motions) -> FloatArray:
        """Return where agents come to rest, told now to stop. (n, 2) [m]"""
        integral_m = motions.state[:, -1]
        if not self._is_shaped:
            return integral_m
        speed = np.hypot(*motions.reference.T)
        return integral_m + self._running_out_s(speed)[:, None] * motions.reference

    def leading_m_s(self, motions: Motions, way_m: FloatArray, speed_m_s: FloatArray) -> FloatArray:
        """Return commands that lead the places of rest along ways (n, 2) [m], at a speed at most.

        What is left of a way is gone in the last tick, by a part of what the tick could do.
        """
        length = np.hypot(*way_m.T)
        if not self._is_shaped:
            reached = np.minimum(speed_m_s / np.maximum(length, 1e-12), 1.0 / self.tick_s)
            return np.asarray(reached[:, None] * way_m)
        unit = way_m / np.maximum(length, 1e-12)[:, None]
        now = np.hypot(*motions.reference.T)
        # in the last tick: of the references along the way those it can reach; else as if it flew along it
        ahead = (motions.reference * unit).sum(axis=1)
        room = self._gain_m_s**2 - now**2 + ahead**2
        is_last = (room >= 0.0) & (length <= self.tick_s * self._gain_m_s)
        ahead = np.where(is_last, ahead, now)
        reach = np.where(is_last, np.sqrt(np.maximum(room, 0.0)), self._gain_m_s)
        least = np.maximum(ahead - reach, 0.0)
        most = np.minimum(speed_m_s, np.maximum(ahead + reach, 0.0))
        forward = self.advanced(motions, most[:, None] * unit)
        gone = np.hypot(*(self.rest_m(forward) - self.rest_m(motions)).T)
        part = np.minimum(length / np.maximum(gone, 1e-12), 1.0)
        return np.asarray((least + part * np.maximum(most - least, 0.0))[:, None] * unit)

    def leading_ahead_m_s(
        self, motions: Motions, way_m: FloatArray, speed_m_s: FloatArray, ticks: int
    ) -> FloatArray:
        """Return commands of several ticks that lead as `leading_m_s` does. (ticks, n, 2) [m s⁻¹]"""
        if not self._is_shaped:
            length = np.maximum(np.hypot(*way_m.T), 1e-12)
            whole = length / (speed_m_s * self.tick_s)
            parts = np.clip(whole - np.arange(ticks)[:, None], 0.0, 1.0)
            return np.asarray((parts * (speed_m_s / length))[..., None] * way_m)
        goal_m, found = self.rest_m(motions) + way_m, np.empty((ticks, *way_m.shape))
        for number in range(ticks):
            found[number] = self.leading_m_s(motions, goal_m - self.rest_m(motions), speed_m_s)
            motions = self.advanced(motions, found[number])
        return found

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
        if not self._is_shaped:
            return command_m_s, command_m_s
        change = command_m_s - reference
        size = np.hypot(*change.T)
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.where(size > self._gain_m_s, self._gain_m_s / size, 1.0)
        after = np.where(part[:, None] < 1.0, reference + part[:, None] * change, command_m_s)
        mean = np.where(np.isinf(self._gain_m_s)[:, None], after, 0.5 * (reference + after))
        return after, mean

    def ways_m(
        self, motions: Motions, command_m_s: FloatArray | None = None, ticks: int = 0
    ) -> FloatArray:
        """Return the ways of agents, (n, samples, 2) [m]: here first, at rest last.

        They fly by commands for some ticks, and are then told to stop.
        """
        if command_m_s is None or not ticks:
            return self._stop_ways_m(motions)
        if not self._is_shaped:
            if ticks not in self._ways:
                passed = [self._power(tick)[..., :1, :] for tick in range(ticks)]
                after = self._maps.stop @ self._power(ticks)
                self._ways[ticks] = np.concatenate((*passed, after), axis=-2)
            return np.asarray(self._ways[ticks] @ _given(motions, command_m_s))
        passed = []
        for _ in range(ticks):
            passed.append(motions.place_m[:, None])
            motions = self.advanced(motions, command_m_s)
        return np.concatenate((*passed, self._stop_ways_m(motions)), axis=1)

    def _stop_ways_m(self, motions: Motions) -> FloatArray:
        ways = self._maps.stop @ motions.state
        if not self._is_shaped:
            return np.asarray(ways)
        reference, future = motions.reference, self._maps.future
        speed = np.maximum(np.hypot(*reference.T), 1e-12)
        with np.errstate(invalid="ignore"):
            lost = self._gain_m_s[:, None] * np.arange(future.shape[-1] + 1)
        left = np.maximum(1.0 - lost / speed[:, None], 0.0)
        left[np.isinf(self._gain_m_s)] = 0.0
        parts = (future @ (0.5 * (left[:, 1:] + left[:, :-1]))[..., None])[..., 0]
        return np.asarray(ways + parts[..., None] * reference[:, None])


def _given(motions: Motions, reference: FloatArray) -> FloatArray:
    """Return states with the reference of the next tick below them. (n, k + 1, 2)"""
    return np.concatenate((motions.state, reference[:, None]), axis=1)


def _widened(matrix: FloatArray, columns: int) -> FloatArray:
    return np.pad(matrix, ((0, 0), (0, columns - matrix.shape[1])))


@lru_cache(maxsize=64)
def _maps(dynamics: Dynamics, tick_s: float, inner: int, inputs: int) -> _Maps:
    """Return what follows from the states of one kind of agent.

    Parameters
    ----------
    dynamics : Dynamics
    tick_s : float
        Length of a tick. [s]
    inner : int
        Of the state, place and inner states.
    inputs : int
        Of the state, references.
    """
    tick, velocity = _sampled(dynamics, tick_s, inner, inputs)
    braking = 0
    if not math.isinf(dynamics.acceleration_m_s2):
        braking = math.ceil(_FASTEST_M_S / (dynamics.acceleration_m_s2 * tick_s)) + 1
    horizon = min(_ticks_to_rest(tick) + braking, _MOST_TICKS)
    # denser at first: an agent is fastest there
    share = (np.arange(1, _WAY_SAMPLES + 1) / _WAY_SAMPLES) ** 1.5
    chosen = np.unique(np.maximum(np.round(share * horizon), 1).astype(np.intp))
    chosen = np.concatenate((chosen, np.full(_WAY_SAMPLES - len(chosen), chosen[-1])))
    freely = tick[:, :-1]
    place = np.zeros((horizon + 1, len(tick)))
    place[0, 0] = 1.0
    for number in range(horizon):
        place[number + 1] = place[number] @ freely
    # a reference acts on places from the tick after it on
    answer = np.append(0.0, place @ tick[:, -1])
    ago = chosen[:, None] - np.arange(braking)
    future = np.where(ago > 0, answer[np.maximum(ago, 0)], 0.0)
    none, rest = np.zeros((1, braking)), np.full((1, braking), tick_s)
    return _Maps(
        tick=tick,
        velocity=velocity[None],
        stop=np.vstack((place[0], place[chosen], np.eye(len(tick))[-1])),
        future=np.vstack((none, future, rest)),
    )


def _sampled(
    dynamics: Dynamics, tick_s: float, inner: int, inputs: int
) -> tuple[FloatArray, FloatArray]:
    """Return the state a tick later, (k, k + 1), and the velocity, (k,): see `_Maps`.

    Exact for references that are even over a tick.
    """
    response, smoothing_s = dynamics.response, dynamics.smoothing_s
    order = response.order
    lead = response.denominator[0]
    monic = np.array(response.denominator) / lead
    numerator = np.zeros(order + 1)
    numerator[order + 1 - len(response.numerator) :] = np.array(response.numerator) / lead
    direct = float(numerator[0])
    # with the reference as last state; its mean is one before it
    mean = inner - 1 if smoothing_s else inner
    whole = np.zeros((inner + 1, inner + 1))
    whole[0, 1 : order + 1], whole[0, mean] = numerator[1:] - direct * monic[1:], direct
    if order:
        whole[1, 1 : order + 1] = -monic[1:]
        whole[1, mean] = 1.0
        whole[range(2, order + 1), range(1, order)] = 1.0
    size = inner + inputs + 1
    tick = np.zeros((size, size + 1))
    tick[:inner, :inner] = _exponential(whole * tick_s)[:inner, :inner]
    # references move on by one: that of this tick acts at once where there is no delay
    given = [size, *range(inner, inner + inputs)]
    tick[range(inner, inner + inputs), given[:-1]] = 1.0
    tick[-1, [size - 1, size]] = 1.0, tick_s
    # a mean grows by what enters its time, and falls by what leaves it
    acting = [(response.delay_s, 1.0)]
    if smoothing_s:
        acting = [
            (response.delay_s, 1.0 / smoothing_s),
            (response.delay_s + smoothing_s, -1.0 / smoothing_s),
        ]
    for delay_s, part in acting:
        if smoothing_s:
            whole[mean, inner] = part
        ticks = delay_s / tick_s
        late = math.floor(ticks + _SAME)
        first_s = max(ticks - late, 0.0) * tick_s
        before, after = _exponential(whole * first_s), _exponential(whole * (tick_s - first_s))
        tick[:inner, given[late + 1]] += after[:inner, :inner] @ before[:inner, inner]
        tick[:inner, given[late]] += after[:inner, inner]
    velocity = np.zeros(size)
    velocity[:inner] = whole[0, :inner]
    if not smoothing_s:
        velocity[inner + math.floor(response.delay_s / tick_s + _SAME)] = direct
    return tick, velocity


def _exponential(matrix: FloatArray) -> FloatArray:
    """Return the exponential of a small matrix: its series, of a part of it that is squared again.

    That of `scipy.linalg`, whose import takes a third of a second.
    """
    halvings = max(math.ceil(math.log2(max(float(np.abs(matrix).sum(axis=1).max()), 1e-9))) + 1, 0)
    part = matrix / 2.0**halvings
    term = total = np.eye(len(matrix))
    for power in range(1, _SERIES + 1):
        term = term @ part / power
        total = total + term
    return np.linalg.matrix_power(total, 2**halvings)


def _ticks_to_rest(tick: FloatArray) -> int:
    """Return after how many ticks without reference an agent has all but ended its way."""
    freely = tick[:, :-1]
    state = np.zeros(len(tick))
    for _ in range(_MOST_TICKS):  # in steady flight at 1 m/s
        before = state
        state = freely @ state + tick[:, -1]
        state[[0, -1]] = 0.0
        if np.abs(state - before).max() <= 1e-9 * max(np.abs(state).max(), 1.0):
            break
    ways = []
    for _ in range(_MOST_TICKS):
        state = freely @ state
        ways.append(state[0])
        if np.abs(state[1:-1]).max(initial=0.0) <= 1e-9:
            break
    left = np.abs(np.array(ways) - ways[-1]) > _AT_REST
    return int(np.flatnonzero(left)[-1]) + 2 if left.any() else 1
