"""The simulation of a swarm in its plane: from tick to tick, or to where something may change."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planner.fleet.swarm.answers import commands_m_s, goals_m
from planner.fleet.swarm.clearing import cleared_m_s, clearing, enters
from planner.fleet.swarm.dynamics import Dynamics, DynamicsStack, Motions
from planner.fleet.swarm.situation import SWING, SwarmSituation, zones_ahead
from planner.fleet.swarm.zones import (
    Capsules,
    capsules_about,
    differ,
    distances_m,
    near_pairs,
    sizes,
)
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.faults import SwarmFaults
    from planner.fleet.swarm.policies import Policy

TICK_S = 0.5
"""Time between two commands. [s]"""
_STANDS = 0.02
"""An agent stands when it moves no faster than this part of its speed, as legs of a mission end. [-]"""
_NEAR_GOAL_M = 1e-3
_SAME_M = 1e-9
"""Ways that are shorter are none. [m]"""
_SAME = 1e-9
"""Commands that differ by less of the speed are the same: nothing changes then for an agent. [-]"""
_TURN_S = 20.0
"""Agents that wait for each other for so long let another of them go first. [s]"""
_JAMMED_S = 60.0
"""The others clear the way of an agent that has not come on for so long in spite of all turns. [s]"""
_LEADS_S = 60.0
"""For so long at most, before it is another's turn. [s]"""
_CLEARED_S = 20.0
"""So much of its way ahead. [s]"""
_STUCK_S = 240.0
"""Agents none of which has come on for so long, each having had its turn, are in a deadlock. [s]"""
_COMES_ON_M, _COMES_ON_S = 1.0, 0.5
"""Who comes nearer to its goal than ever by so much, or by its way in so long, has come on: legs of a
mission end within it. [m], [s]"""
MOST_SKIPPED = 16
"""Ticks passed over at once where nothing can change: batteries are asked at least every 10 s. [-]"""
_BEND_M = 0.05
"""By so much may places on the chord of a step be wrong that passes ticks over: as in a tick of 0.5 s in
which an agent brakes by 2 m/s². [m]"""
_AHEAD_TICKS = (8, 4, 2)
"""For so many ticks commands are decided at once where all that is foreseen is free. [-]"""
_SKIPPED_WAITING = 4
"""So many at most while somebody waits, whose way may become free. [-]"""


class Agent(Value):
    """One agent of a swarm."""

    name: str
    dynamics: Dynamics
    speed_m_s: float
    """Steady speed it flies at. [m s⁻¹]"""
    east_m: float
    """Where it takes off. [m]"""
    north_m: float
    start_s: float = 0.0
    """When it takes off, where nobody is in its way. [s]"""
    climb_s: float = 0.0
    """From its take-off until it is in the plane of the swarm. [s]"""
    landing_s: float = 0.0
    """From the plane to the ground. [s]"""
    settle_s: float | None = None
    """From the command to stop until it counts as standing; ``None``: as soon as it does. [s]"""
    error_m: float = 0.0
    """How wrong its place may be. [m]"""
    priority: int = 0
    """The higher gives way last."""


class AgentPhase(IntEnum):
    """What an agent is about."""

    WAITS = 0
    CLIMBS = 1
    FLIES = 2
    LANDS = 3
    LANDED = 4


# plain integers: members of an enumeration are slow to look up, and every tick does so
_WAITS, _CLIMBS, _FLIES, _LANDS, _LANDED = map(int, AgentPhase)


class Step(Value, eq=False):
    """What all agents do from one moment until another, by commands that do not change in between."""

    begin_s: float
    end_s: float
    phase: IntArray
    """(n,)"""
    place_m: FloatArray
    """At the beginning. (n, 2) [m]"""
    velocity_m_s: FloatArray
    command_m_s: FloatArray
    wanted_m_s: FloatArray
    waits: BoolArray
    """Whether an agent does not get what it wants. (n,)"""
    carried_m: FloatArray
    """From where each reports to be to its place, by what nobody knows of. (n, 2) [m]"""
    against_m_s: FloatArray
    """The gusts that each flies against by now. (n, 2) [m s⁻¹]"""


class _Decided(NamedTuple):
    """What agents do in a tick."""

    command_m_s: FloatArray
    wanted_m_s: FloatArray
    waits: BoolArray
    motions: Motions
    """At its end."""


class _Granted(NamedTuple):
    """Where agents may come, by what was decided last."""

    situation: SwarmSituation
    command_m_s: FloatArray
    speed_m_s: FloatArray
    """No faster until it is decided anew. (n,) [m s⁻¹]"""
    ticks: int = 1
    ahead: Capsules | None = None
    """Of several ticks."""

    @property
    def zones(self) -> Capsules:
        if self.ahead is not None:
            return self.ahead
        return self.situation.granted_zones(self.command_m_s)


class Meter(Protocol):
    """What follows a simulation, such as the batteries of the agents."""

    def take(self, step: Step) -> BoolArray:
        """Take a step; return who has to fly home now. (n,)"""
        ...


class Swarm:
    """Agents that do what an algorithm wants, kept apart by a policy.

    Parameters
    ----------
    agents : sequence of Agent
    algorithm : Algorithm
    policy : Policy
    separation_m : float
        Distance any two keep, beyond the errors of their places. [m]
    until_s : float
        When the simulation ends at the latest. [s]
    tick_s : float, optional
    faults : callable, optional
        Makes what goes wrong, from the dynamics of the agents.
    """

    def __init__(
        self,
        agents: Sequence[Agent],
        algorithm: Algorithm,
        policy: Policy,
        *,
        separation_m: float,
        until_s: float,
        tick_s: float = TICK_S,
        faults: Callable[[DynamicsStack], SwarmFaults] | None = None,
    ) -> None:
        self.agents = tuple(agents)
        self._algorithm, self._policy = algorithm, policy
        self._separation_m, self._until_s, self._tick_s = separation_m, until_s, tick_s
        self._tick = 0
        self._dynamics = DynamicsStack([one.dynamics for one in agents], tick_s)
        self._home_m = np.array([(one.east_m, one.north_m) for one in agents]).reshape(-1, 2)
        self._nothing, self._nobody = np.zeros((len(agents), 2)), np.zeros(len(agents), np.bool_)
        for none in (self._nothing, self._nobody):
            none.flags.writeable = False
        self._speed, self._start_s, self._climb_s, self._landing_s, self._error_m = (
            np.array([getattr(one, name) for one in agents])
            for name in ("speed_m_s", "start_s", "climb_s", "landing_s", "error_m")
        )
        self._faults = None if faults is None else faults(self._dynamics)
        if self._faults is not None:
            self._error_m = self._error_m + self._faults.gust_error_m
        self._settle_s = np.array(
            [np.nan if one.settle_s is None else one.settle_s for one in agents]
        )
        self._settles_late = bool(np.isnan(self._settle_s).any())
        count = len(agents)
        self.flies_s, self.lands_s = np.full(count, np.inf), np.full(count, np.inf)
        """When each was in the plane, and left it again: between ticks, too. (n,) [s]"""
        order = sorted(range(count), key=lambda row: (-agents[row].priority, row))
        self._rank = np.empty(count, np.intp)
        self._rank[order] = np.arange(count)
        self._motions = self._dynamics.at_rest(self._home_m)
        self._zones: Capsules | None = None
        self._granted: _Granted | None = None
        self._ahead: list[_Decided] = []
        """Ticks that are decided already, the next one last."""
        self._phase = np.full(count, _WAITS)
        self._has_reached, self._returns = np.zeros((2, count), np.bool_)
        self._ready_s = np.full(count, np.inf)
        """When each has arrived, is up, or is down."""
        self._goal_m = np.full((count, 2), np.nan)
        self._command = self._velocity_m_s = np.zeros((count, 2))
        self._waited_s = np.zeros(count)
        self._left_m = np.full(count, np.inf)
        """The least that was left of the way to its goal."""
        self.turns_back_s = np.full(count, np.inf)
        """When each had to fly home before it was done. (n,) [s]"""
        self._on_s = np.zeros(count)
        """When each last came on, or wanted to go nowhere. [s]"""
        self._leader: int | None = None
        """Whose way the others clear."""
        self._led_s = np.full(count, -np.inf)
        """When each last began to lead. [s]"""
        self._turned_s = self._moved_s = self.cleared_s = 0.0
        """When turns were taken, when somebody moved, and for how long ways were cleared. [s]"""
        self._held = np.zeros(count, np.bool_)
        """Who has not come on for long since anybody did."""
        self._come_down = 0
        """How many have begun to land, and landed."""
        self.deadlock: tuple[str, ...] = ()
        """Who could not go on at the end."""

    @property
    def time_s(self) -> float:
        """Time since the beginning. [s]"""
        return self._tick * self._tick_s

    @property
    def has_landed(self) -> BoolArray:
        """Who is on the ground again. (n,)"""
        return np.asarray(self._phase == _LANDED)

    @property
    def is_over(self) -> bool:
        """Whether all have landed, or cannot go on, or the time is over."""
        is_lost = False if self._faults is None else self._faults.is_lost(self.time_s)
        is_done = bool((self.has_landed | is_lost).all())
        return bool(is_done or self.deadlock or self.time_s >= self._until_s - 1e-9)

    def places(self) -> tuple[FloatArray, FloatArray]:
        """Return where agents are now, and how they move. (n, 2) [m], [m s⁻¹]"""
        return self._motions.place_m + self.carried_m, self._velocity_m_s

    @property
    def keeps_apart(self) -> bool:
        """Whether its policy keeps agents apart."""
        return self._policy.keeps_apart

    @property
    def error_m(self) -> FloatArray:
        """How far each may be from where it reports to be, by likely gusts too. (n,) [m]"""
        return self._error_m

    @property
    def disobeys(self) -> BoolArray:
        """Who does not do now what it is told, or late. (n,)"""
        return self._nobody if self._faults is None else self._faults.disobeys(self.time_s)

    def stop_ways_m(self) -> FloatArray:
        """Return where agents report to come, told now to stop. (n, samples, 2) [m]"""
        return self._dynamics.ways_m(self._motions)

    @property
    def carried_m(self) -> FloatArray:
        """From where agents report to be to where they are. (n, 2) [m]"""
        return self._nothing if self._faults is None else self._faults.carried_m

    @property
    def against_m_s(self) -> FloatArray:
        """The gusts that agents fly against by now. (n, 2) [m s⁻¹]"""
        return self._nothing if self._faults is None else self._faults.answered_m_s

    @property
    def _is_deaf(self) -> BoolArray:
        """Who keeps its command, whatever it is told. (n,)"""
        return self._nobody if self._faults is None else self._faults.is_deaf(self.time_s)

    def run(self, meter: Meter | None = None) -> Iterator[Step]:
        """Yield what happens, step by step."""
        while True:
            if not self._ahead or self._has_arrived().any():
                self._ahead.clear()
                self._change_phases()
                if self.is_over:
                    return
            step = self._next()
            if meter is not None:
                self._turn_back(meter.take(step))
            yield step

    def _turn_back(self, has_to: BoolArray) -> None:
        """Let agents fly home that have to; note who was not on its way home already."""
        early = has_to & ~self._returns & differ(self._goal_m, self._home_m)
        self.turns_back_s[early] = self.time_s
        if (has_to & ~self._returns).any():
            self._ahead.clear()
        self._returns |= has_to

    @property
    def zones(self) -> Capsules:
        """Where each may still come, told now to stop."""
        if self._zones is None:
            self._zones = self._stop_zones() if self._granted is None else self._renewed()
        return self._zones

    def _stop_zones(self) -> Capsules:
        ways_m = self._dynamics.ways_m(self._motions)
        zones = capsules_about(ways_m, self._velocity_m_s, more_m=self._error_m)
        return zones_ahead(zones, self._dynamics, self._motions, self._is_deaf)

    @property
    def is_there(self) -> BoolArray:
        """Who is in the air, in the way of others. (n,)"""
        return np.asarray((self._phase != _WAITS) & (self._phase != _LANDED))

    def _next(self) -> Step:
        """Go on by one step."""
        if self._ahead:
            return self._fly(self._ahead.pop())
        situation = self._situation()
        wanted = self._wanted(situation)
        is_led = situation.is_led & (self._phase == _FLIES)
        situation = replace(situation, wanted_m_s=wanted, is_led=is_led)
        if self._faults is not None and self._policy.keeps_apart:
            situation = self._faults.evading(situation)
        wanted = situation.wanted_m_s
        command = self._policy_m_s(situation)
        if self._faults is not None:
            command = self._faults.given_m_s(situation, command)
        wants = differ(wanted)
        waits = wants & (sizes(command) < 0.5 * sizes(wanted))
        ticks, motions = self._skipped(self._ticks_to_skip(command, waits))
        if motions is None:
            motions = self._dynamics.advanced(self._motions, command)
        decided = _Decided(command, wanted, waits, motions)
        self._granted = None
        if self._policy.keeps_apart:
            self._granted = _Granted(situation, command, sizes(command))
        if ticks == 1:
            self._decide_ahead(situation, decided)
        step = self._fly(decided, ticks)
        self._take_turns(wants, situation.has_arrived)
        return step

    def _fly(self, decided: _Decided, ticks: int = 1) -> Step:
        """Fly what is decided, for some ticks."""
        command, waits = decided.command_m_s, decided.waits
        place_m, velocity_m_s = self.places()
        step = Step(
            begin_s=self.time_s,
            end_s=self.time_s + ticks * self._tick_s,
            phase=self._phase.copy(),
            place_m=place_m,
            velocity_m_s=velocity_m_s,
            command_m_s=command,
            wanted_m_s=decided.wanted_m_s,
            waits=waits,
            carried_m=self.carried_m,
            against_m_s=self.against_m_s,
        )
        self._motions = decided.motions
        self._velocity_m_s = self._dynamics.velocity_m_s(decided.motions)
        self._zones = None
        if self._faults is not None:
            self._zones = self.zones  # by who hears commands now
        self._note_arrivals(command, ticks)
        self._tick += ticks
        if self._faults is not None:
            self._faults.go_on(self.time_s)
        self._command = command
        self._waited_s = np.where(waits, self._waited_s + ticks * self._tick_s, 0.0)
        return step

    def _decide_ahead(self, situation: SwarmSituation, now: _Decided) -> None:
        """Decide on ticks to come as on this one, where all that is foreseen in them is free.

        Agents fly on to their goals and stop there; those that stop, wait or go aside do so, until somebody
        arrives.
        """
        moves = differ(now.command_m_s)
        leads = moves & ~differ(now.command_m_s, now.wanted_m_s)
        aside = moves & ~leads
        most = self._calm_ticks(now.waits | aside)
        if aside.any():  # who flies as it does not want to asks again before it is at its goal
            left_m = sizes(self._goal_m - situation.rest_m)[aside]
            left_ticks = left_m / (self._tick_s * sizes(now.command_m_s[aside]))
            most = min(most, int(left_ticks.min()))
        if most < _AHEAD_TICKS[-1] or (situation.has_arrived & ~moves).any():
            return
        commands = self._dynamics.leading_ahead_m_s(
            now.motions,
            self._ways_m(now.motions, leads),
            self._speed,
            min(most, _AHEAD_TICKS[0]) - 1,
        )
        decided = [now]
        for leading in commands:
            command = np.where(leads[:, None], leading, now.command_m_s)
            wanted = np.where(leads[:, None], leading, now.wanted_m_s)
            motions = self._dynamics.advanced(decided[-1].motions, command)
            decided.append(_Decided(command, wanted, now.waits, motions))
        for ticks in _AHEAD_TICKS:
            if ticks > len(decided):
                continue
            flown = [one.motions for one in decided[:ticks]]
            if self._policy.keeps_apart:
                zones = situation.zones_ahead(flown, moves)
                if zones is None:
                    continue
                speed_m_s = np.where(moves, self._speed, 0.0)
                self._granted = _Granted(situation, now.command_m_s, speed_m_s, ticks, zones)
            self._ahead = decided[ticks - 1 : 0 : -1]
            return

    def _policy_m_s(self, situation: SwarmSituation) -> FloatArray:
        """Return what the policy commands, and those that clear the way of another."""
        leader = self._leader
        if leader is None:
            return cleared_m_s(situation, commands_m_s(self._policy, situation))
        self.cleared_s += self._tick_s
        unit = self._goal_m[leader] - situation.place_m[leader]
        way_m = min(float(np.hypot(*unit)), _CLEARED_S * float(self._speed[leader]))
        unit = unit / max(float(np.hypot(*unit)), 1e-9)
        begin_m = situation.place_m[leader, None]
        way = Capsules.about(begin_m, begin_m + way_m * unit, self.zones.radius_m[leader, None])
        situation = clearing(situation, leader, way)
        rank, is_evading = situation.rank.copy(), situation.is_evading.copy()
        rank[leader], is_evading[leader] = -1, True
        situation = replace(situation, rank=rank, is_evading=is_evading)
        command = commands_m_s(self._policy, situation)
        command[enters(situation, command, leader, way)] = 0.0
        return cleared_m_s(situation, command)

    def _renewed(self) -> Capsules:
        """Return the zones agents are in now.

        A capsule about what is left of a way may stick out of the one that was granted, which held the way
        before: where it is then too near to another's, the one granted stays.
        """
        assert self._granted is not None
        granted, zones = self._granted, self._stop_zones()
        situation = granted.situation
        fastest_m_s = np.maximum(granted.speed_m_s, sizes(situation.velocity_m_s))
        first, second, _ = situation.touching(fastest_m_s, granted.ticks)
        kept = np.zeros(len(fastest_m_s), np.bool_)
        while len(first):
            near = distances_m(zones.select(first), zones.select(second)) < self._separation_m
            more = np.zeros(len(fastest_m_s), np.bool_)
            more[first[near]] = more[second[near]] = True
            more &= ~kept
            if not more.any():
                break
            kept |= more
            zones.put(more, granted.zones.select(more))
        return zones

    def _note_arrivals(self, command: FloatArray, ticks: int) -> None:
        """Note when agents that came to their goals in this tick will stand there.

        A tick flown at a part of the speed stands for so much of it at the speed.
        """
        flies = self._phase == _FLIES
        moves = differ(command)
        still = flies & ~moves
        # who is sent to where it stands is there, too
        reached = flies & ~(still & self._has_reached)
        reached &= sizes(self._dynamics.rest_m(self._motions) - self._goal_m) <= _NEAR_GOAL_M
        if reached.any():
            part = sizes(command) / self._speed
            ready_s = np.where(np.isinf(self._ready_s), self.time_s, self._ready_s)
            begun_s = np.maximum(ready_s, self.time_s)
            ends_s = begun_s + (part + ticks - 1) * self._tick_s + self._settle_s
            ends_s = np.where(np.isnan(ends_s), np.inf, ends_s)
            self._ready_s = np.where(reached, ends_s, self._ready_s)
        self._ready_s[flies & moves & ~reached] = np.inf
        self._has_reached = reached | (self._has_reached & still)

    def _change_phases(self) -> None:
        ends_s = self.time_s + self._tick_s - 1e-9
        up = (self._phase == _CLIMBS) & (self._ready_s <= ends_s)
        self._phase[up] = _FLIES
        self.flies_s[up] = self._ready_s[up]
        down = (self._phase == _LANDS) & (self._ready_s <= self.time_s + 1e-9)
        self._phase[down] = _LANDED
        waits = (self._phase == _WAITS) & ~self._is_deaf
        ready = np.flatnonzero(waits & (self._start_s <= ends_s))
        for agent in ready[np.argsort(self._rank[ready])].tolist():
            there = np.flatnonzero(self.is_there & self._policy.keeps_apart)
            own = self.zones.select(np.full(len(there), agent))
            if (distances_m(own, self.zones.select(there)) >= self._separation_m).all():
                self._phase[agent] = _CLIMBS
                begins_s = max(float(self._start_s[agent]), self.time_s)
                self._ready_s[agent] = begins_s + self._climb_s[agent]
                if self._ready_s[agent] <= ends_s:
                    self._phase[agent] = _FLIES
                    self.flies_s[agent] = self._ready_s[agent]

    def _situation(self) -> SwarmSituation:
        rest = self._dynamics.rest_m(self._motions)
        has_arrived = self._has_arrived()
        return SwarmSituation(
            time_s=self.time_s,
            tick_s=self._tick_s,
            place_m=self._motions.place_m.copy(),
            velocity_m_s=self._velocity_m_s,
            rest_m=rest,
            command_m_s=self._command,
            wanted_m_s=np.zeros_like(rest),
            speed_m_s=self._speed,
            has_arrived=has_arrived,
            rank=self._rank,
            waited_s=self._waited_s,
            is_there=self.is_there,
            is_led=(self._phase == _FLIES) & ~self._is_deaf,
            is_deaf=self._is_deaf,
            is_evading=np.zeros_like(has_arrived),
            error_m=self._error_m,
            separation_m=self._separation_m,
            zones=self.zones,
            dynamics=self._dynamics,
            motions=self._motions,
        )

    def _has_arrived(self) -> BoolArray:
        """Return who stands at its goal, by the time or, where that does not tell, as it moves. (n,)"""
        is_due = self._ready_s <= self.time_s + self._tick_s - 1e-9
        if self._settles_late and self._has_reached.any():
            rest = self._dynamics.rest_m(self._motions)
            slow = sizes(self._velocity_m_s) <= _STANDS * self._speed
            near = sizes(rest - self._motions.place_m) <= _STANDS * self._speed
            is_due = np.where(np.isnan(self._settle_s), slow & near, is_due)
        return np.asarray(self._has_reached & is_due & (self._phase == _FLIES))

    def _wanted(self, situation: SwarmSituation) -> FloatArray:
        """Return the velocities that lead to the goals: as fast as may be, and to rest exactly there.

        Who stands from a moment between two ticks on flies for the rest of the tick only: so much slower in
        all of it.
        """
        goal = goals_m(self._algorithm, situation)
        at_home = self._returns & ~differ(self._goal_m, self._home_m)
        goal[self._returns] = self._home_m[self._returns]
        goal[at_home & situation.has_arrived] = np.nan
        done = situation.is_led & np.isnan(goal[:, 0])
        self._phase[done] = _LANDS
        self.lands_s[done] = np.where(np.isinf(self._ready_s), self.time_s, self._ready_s)[done]
        self._ready_s[done] = (self.lands_s + self._landing_s)[done]
        # who is held back where it stands has not arrived at the goal after
        is_same = ~differ(goal, self._goal_m)
        self._has_reached &= is_same
        self._left_m[~is_same] = np.inf
        self._goal_m = goal
        goes = situation.is_led & ~done & ~np.isnan(goal[:, 0])
        late_s = np.where(np.isinf(self._ready_s), 0.0, self._ready_s - self.time_s)
        part = 1.0 - np.clip(late_s / self._tick_s, 0.0, 1.0)
        way = self._ways_m(self._motions, goes)
        found = self._dynamics.leading_m_s(self._motions, way, part * self._speed)
        is_same = differ(found) & (sizes(found - self._command) <= _SAME * self._speed)
        found[is_same] = self._command[is_same]
        return found

    def _ways_m(self, motions: Motions, goes: BoolArray) -> FloatArray:
        """Return what is left of the ways of those that go. (n, 2) [m]"""
        way = np.where(goes[:, None], self._goal_m - self._dynamics.rest_m(motions), 0.0)
        way[sizes(way) <= _SAME_M] = 0.0
        return way

    def _skipped(self, most: int) -> tuple[int, Motions | None]:
        """Return ticks that are passed over, and the motions after them; ``None``: only one is flown.

        So few that ways are as good as straight and even: distances are taken along their chords.
        """
        ticks = most
        while ticks > 1:
            motions = self._dynamics.advanced_evenly(self._motions, ticks)
            changes_m_s = sizes(self._dynamics.velocity_m_s(motions) - self._velocity_m_s)
            # who speeds up steadily is never farther from its chord
            if changes_m_s.max(initial=0.0) * ticks * self._tick_s <= 4.0 * _BEND_M:
                return ticks, motions
            ticks //= 2
        return 1, None

    def _ticks_to_skip(self, command: FloatArray, waits: BoolArray) -> int:
        """Return for how many ticks nothing can change: nobody comes near another or to its goal."""
        if not self._dynamics.is_even(self._motions, command):
            return 1
        speed = np.hypot(*command.T)
        going = speed > 0.0
        settles = (self._phase == _FLIES) & ~going & ~waits
        if settles.any() or (np.abs(speed - self._speed)[going] > 1e-9).any():
            return 1
        ticks = float(self._calm_ticks(waits))
        rest = self._dynamics.rest_m(self._motions)
        to_goal = np.hypot(*(self._goal_m - rest).T)[going] / (speed[going] * self._tick_s)
        ticks = min(ticks, float(np.min(to_goal, initial=np.inf)) - 1.0)
        if ticks < 2.0:
            return 1
        fast = SWING * float(speed.max(initial=0.0)) * self._tick_s
        first, second = near_pairs(
            self.zones, self._separation_m + 2.0 * fast * ticks, self.is_there
        )
        if len(first):
            room = distances_m(self.zones.select(first), self.zones.select(second))
            closing = SWING * (speed[first] + speed[second]) * self._tick_s
            open_ = closing > 0.0
            room = (room - self._separation_m)[open_] / closing[open_]
            ticks = min(ticks, float(np.min(room, initial=np.inf)))
        return max(1 << int(math.log2(max(ticks, 1.0))), 1)

    def _calm_ticks(self, waits: BoolArray) -> int:
        """Return for how many ticks at most nothing begins or ends that is known by its time."""
        if self._policy.needs_ticks or self._faults is not None or self._leader is not None:
            return 1
        is_up = self._phase != _WAITS
        waits_below = ~is_up & (self._start_s <= self.time_s)
        ticks = float(_SKIPPED_WAITING if (waits | waits_below).any() else MOST_SKIPPED)
        rises = (self._phase == _CLIMBS) | (self._phase == _LANDS)
        # who was sent on before it stood sets out as it does
        rises |= (self._phase == _FLIES) & ~self._has_reached & (self._ready_s > self.time_s)
        next_s = np.where(
            rises, self._ready_s, np.where(is_up | waits_below, np.inf, self._start_s)
        )
        changes_s = getattr(self._algorithm, "changes_s", math.inf)
        ends_s = min(
            float(next_s.min(initial=np.inf)),
            self._until_s,
            changes_s if changes_s > self.time_s else math.inf,
        )
        return int(max(min(ticks, (ends_s - self.time_s) / self._tick_s), 1.0))

    def _take_turns(self, wants: BoolArray, has_arrived: BoolArray) -> None:
        """Let another go first where agents wait for each other; see who cannot go on at all."""
        with np.errstate(invalid="ignore"):  # who lands has no goal
            left_m = np.hypot(*(self._goal_m - self._dynamics.rest_m(self._motions)).T)
            least_m = np.minimum(_COMES_ON_M, _COMES_ON_S * self._speed)
            comes_on = wants & (left_m < self._left_m - least_m)
        self._left_m[comes_on] = left_m[comes_on]
        comes_down = int(np.count_nonzero(self._phase >= _LANDS))
        comes_down += int(np.count_nonzero(self.has_landed))
        if comes_on.any() or comes_down > self._come_down:
            self._moved_s, self._come_down = self.time_s, comes_down
            self._held[:] = False
        stuck = self._waited_s >= _TURN_S
        if stuck.any() and self.time_s >= self._turned_s + _TURN_S:
            self._turned_s = self.time_s
            rows = np.flatnonzero(stuck)
            ranks = np.sort(self._rank[rows])
            order = np.argsort(self._rank[rows])
            self._rank = self._rank.copy()
            self._rank[rows[order]] = np.roll(ranks, 1)
        self._on_s[comes_on | ~wants] = self.time_s
        self._held |= self.time_s >= self._on_s + _TURN_S
        self._choose_leader(wants, has_arrived, left_m)
        if wants.any() and self.time_s >= self._moved_s + _STUCK_S:
            held = np.flatnonzero(self._held & (self._phase == _FLIES)).tolist()
            self.deadlock = tuple(self.agents[row].name for row in held)

    def _choose_leader(self, wants: BoolArray, has_arrived: BoolArray, left_m: FloatArray) -> None:
        """Let one lead of those that do not come on: who has not led for longest, the nearest first."""
        leader, leads = self._leader, (self._phase == _FLIES) & ~has_arrived
        if leader is not None and leads[leader] and self.time_s < self._led_s[leader] + _LEADS_S:
            return
        self._leader = None
        jammed = wants & leads & ~self._is_deaf & (self.time_s >= self._on_s + _JAMMED_S)
        jammed = np.flatnonzero(jammed)
        if len(jammed):
            self._leader = int(jammed[np.lexsort((left_m[jammed], self._led_s[jammed]))[0]])
            self._led_s[self._leader] = self.time_s
