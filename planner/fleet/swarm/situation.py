"""What agents know at one moment, and which commands leave every stop free."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.fleet.swarm.zones import (
    Capsules,
    capsules_about,
    differ,
    distances_m,
    in_plane,
    near_pairs,
    sizes,
)
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import BoolArray, FloatArray, IndexArray, IntArray
    from planner.fleet.swarm.dynamics import DynamicsStack, Motions


SWING = 1.5
"""A pulse of the command moves no agent farther than this times what it moves it in the end: models
overshoot by less. [-]"""


_AHEAD_S = 20.0
"""For so long ahead the others keep out of the way of one that does not stop: enough to set out and to go
15 m aside at 2 m/s, with the article's response. [s]"""


class Pairs(NamedTuple):
    """Rows of two agents, the first the smaller."""

    first: IndexArray
    second: IndexArray
    room_m: FloatArray
    """Between their zones beyond the separation. (n,) [m]"""


class SwarmSituation(Value, eq=False, dict=True):
    """All agents at one tick; rows are agents, east and north their columns."""

    time_s: float
    tick_s: float
    place_m: FloatArray
    """(n, 2) [m]"""
    velocity_m_s: FloatArray
    """(n, 2) [m s⁻¹]"""
    rest_m: FloatArray
    """Where each comes to rest, told now to stop. (n, 2) [m]"""
    command_m_s: FloatArray
    """What each commanded in the tick before. (n, 2) [m s⁻¹]"""
    wanted_m_s: FloatArray
    """What each would command if it were alone. (n, 2) [m s⁻¹]"""
    speed_m_s: FloatArray
    """Greatest speed. (n,) [m s⁻¹]"""
    has_arrived: BoolArray
    """Whether it stands where it was sent to. (n,)"""
    rank: IntArray
    """The lower goes first; no two are equal. (n,)"""
    waited_s: FloatArray
    """For how long each has not got what it wants. (n,) [s]"""
    is_there: BoolArray
    """Whether it is in the air, in the way of others. (n,)"""
    is_led: BoolArray
    """Whether it flies in the plane and does what it is told; others have all of the evading to do. (n,)"""
    is_deaf: BoolArray
    """Whether it keeps its command whatever it is told. (n,)"""
    is_evading: BoolArray
    """Whether it wants out of the way of such a one. (n,)"""
    error_m: FloatArray
    """How wrong its place may be. (n,) [m]"""
    separation_m: float
    """Distance any two keep. [m]"""
    zones: Capsules
    """Where each may still come, told now to stop; no two are nearer than the separation."""
    dynamics: DynamicsStack
    motions: Motions

    def zones_after(self, command_m_s: FloatArray, ticks: int = 1) -> Capsules:
        """Return where agents may come that fly by commands for some ticks and are told to stop then."""
        ways_m = self.dynamics.ways_m(self.motions, command_m_s, ticks)
        zones = capsules_about(ways_m, self.velocity_m_s, more_m=self.error_m)
        if not self.is_deaf.any():
            return zones
        motions = self.motions
        for _ in range(ticks):
            motions = self.dynamics.advanced(motions, command_m_s)
        return zones_ahead(zones, self.dynamics, motions, self.is_deaf)

    def granted_zones(self, command_m_s: FloatArray, ticks: int = 1) -> Capsules:
        """Return where agents may come by commands; of those that stop, where they might have come before."""
        after = self.zones_after(command_m_s, ticks)
        stops = ~(differ(command_m_s) | self.is_deaf)
        after.put(stops, self.zones.select(stops))
        return after

    def may(self, command_m_s: FloatArray, ticks: int = 1) -> BoolArray:
        """Return which agents may fly by commands (n, 2) [m s⁻¹] for some ticks; the others must stop.

        The zone an agent then has keeps the separation from what every other may need: the zone it is in
        already, or, where it goes first by its rank and may go on, the one it then has.  So whatever the
        delay and the overshoot of their models, each agent can stop at every moment without coming too near
        to where any other flies or stops.  Who is too near already may do what brings it
        no nearer.
        """
        command_m_s = np.where(self.is_deaf[:, None], self.command_m_s, command_m_s)
        pairs = self.touching(sizes(command_m_s), ticks)
        if not len(pairs.first):
            return np.ones(len(self.rank), np.bool_)
        after = self.granted_zones(command_m_s, ticks)
        rank = np.where(self.is_deaf, -1, self.rank)
        return _granted(self.zones, after, pairs, rank, self.separation_m) | self.is_deaf

    def zones_ahead(self, flown: Sequence[Motions], moves: BoolArray) -> Capsules | None:
        """Return where agents may come by motions of ticks to come, told to stop after them.

        Of those that do not move, where they may come already.  ``None``: some may come too near to
        others, and have to be asked for sooner.
        """
        passed = [one.place_m[:, None] for one in (self.motions, *flown[:-1])]
        ways_m = np.concatenate((*passed, self.dynamics.ways_m(flown[-1])), axis=1)
        after = capsules_about(ways_m, self.velocity_m_s, more_m=self.error_m)
        after.put(~moves, self.zones.select(~moves))
        pairs = self.touching(np.where(moves, self.speed_m_s, 0.0), len(flown))
        first, second = after.select(pairs.first), after.select(pairs.second)
        return after if (distances_m(first, second) >= self.separation_m).all() else None

    def touching(self, speed_m_s: FloatArray, ticks: int = 1) -> Pairs:
        """Return pairs whose zones may come too near to each other within some ticks.

        At speeds (n,) [m s⁻¹]: those that stop stay within the zones they are in.
        """
        first, second, room_m = self._near(ticks)
        if self.is_deaf.any():  # the way ahead of those swings farther
            return Pairs(first, second, room_m)
        # ends of a way and its bend swing alike
        swing_m = 2.0 * SWING * ticks * self.tick_s * speed_m_s
        kept = room_m < swing_m[first] + swing_m[second]
        return Pairs(first[kept], second[kept], room_m[kept])

    @cached_property
    def _found(self) -> dict[int, Pairs]:
        """Those that are near, by the ticks within which they may meet: policies ask several times."""
        return {}

    def _near(self, ticks: int) -> Pairs:
        """Return pairs that may meet within some ticks."""
        most = max(self._found, default=0)
        if ticks > most:
            most = ticks
            further_m = SWING * ticks * self.tick_s * float(self.speed_m_s.max(initial=0.0))
            reach_m = self.separation_m + 2.0 * further_m
            first, second = near_pairs(self.zones, reach_m, self.is_there)
            apart_m = distances_m(self.zones.select(first), self.zones.select(second))
            self._found[ticks] = Pairs(first, second, apart_m - self.separation_m)
        return self._found[most]


def zones_ahead(
    zones: Capsules, dynamics: DynamicsStack, motions: Motions, is_deaf: BoolArray
) -> Capsules:
    """Return zones in which those that keep their commands do not stop: they fly on for a while."""
    if is_deaf.any():
        ahead_m = dynamics.rest_m(motions) + _AHEAD_S * motions.reference
        begin = np.where(is_deaf, in_plane(motions.place_m), zones.begin)
        end = np.where(is_deaf, in_plane(ahead_m), zones.end)
        return Capsules(begin=begin, end=end, radius_m=zones.radius_m)
    return zones


def _rests(zones: Capsules, flies_on: BoolArray) -> Capsules:
    """Return where agents come to rest at last; of those that fly on, their ways."""
    begin = np.where(flies_on, zones.begin, zones.end)
    return Capsules(begin=begin, end=zones.end, radius_m=np.zeros(len(begin)))


def _granted(
    zones: Capsules, after: Capsules, pairs: Pairs, rank: IntArray, separation_m: float
) -> BoolArray:
    """Return which agents may have their zones after the tick."""
    granted = np.ones(len(rank), np.bool_)
    first, second, room_m = pairs
    if not len(first):
        return granted
    every, later, count = Capsules.joined((zones, after)), len(rank), len(first)
    apart = distances_m(
        every.select(np.concatenate((first + later, first + later, first))),
        every.select(np.concatenate((second + later, second, second + later))),
    ).reshape(3, count)
    both, one, two = apart >= separation_m
    open_ = np.flatnonzero(~(both & one & two))
    if not len(open_):
        return granted
    near = open_[room_m[open_] < 0.0]
    if len(near):
        now, then = (_rests(one, rank < 0) for one in (zones, after))
        low, high = first[near], second[near]
        before_m = distances_m(now.select(low), now.select(high))
        for each, its, other in ((both, then, then), (one, then, now), (two, now, then)):
            each[near] |= distances_m(its.select(low), other.select(high)) >= before_m
    # (other, both go on, it alone goes on) of each agent that somebody may be in the way of
    others: dict[int, list[tuple[int, bool, bool]]] = {}
    rows = zip(
        first[open_].tolist(),
        second[open_].tolist(),
        both[open_].tolist(),
        one[open_].tolist(),
        two[open_].tolist(),
        strict=True,
    )
    for low, high, together, low_alone, high_alone in rows:
        others.setdefault(low, []).append((high, together, low_alone))
        others.setdefault(high, []).append((low, together, high_alone))
    for agent in sorted(others, key=lambda row: int(rank[row])):
        granted[agent] = all(
            together if rank[other] < rank[agent] and granted[other] else alone
            for other, together, alone in others[agent]
        )
    return granted
