"""How agents avoid each other: from what they know to the velocity they command."""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner.fleet.swarm.orca import Neighbours, half_planes, nearest_velocities_m_s
from planner.fleet.swarm.zones import differ, gaps_m
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.arrays import BoolArray, FloatArray, IndexArray
    from planner.fleet.swarm.situation import SwarmSituation

_PARTS = (0.5, 0.25, 0.0)
"""Of a velocity from which no stop is free, what is tried next. [-]"""
_ROUND_RAD = 0.5 * np.pi
"""How far who waits goes round at most. [rad]"""
_ASIDE_RAD = (0.5 * np.pi, -0.5 * np.pi, np.pi, 0.75 * np.pi, -0.75 * np.pi)
"""Where who has stood for long goes, clockwise from its way: the first that is free. [rad]"""
_TREE_FROM = 150
"""From so many agents on the nearest are found by a tree. [-]"""


class Policy(Protocol):
    """A rule of avoidance: `planner.fleet.Policy`.

    It may keep nothing from tick to tick but what it finds again in the situation.  Where agents that want
    to go on have not for a minute, one after the other leads: the simulation commands the others out of its
    way, whatever the policy answers, and says for how long (S145).
    """

    @property
    def needs_ticks(self) -> bool:
        """Whether it must be asked every tick; else only where something may change.

        Then what agents do is foreseen for up to eight ticks, four while somebody waits, and is not asked
        for again before somebody arrives, if all of that leaves every stop free.
        """
        ...

    @property
    def keeps_apart(self) -> bool:
        """Whether agents wait on the ground until nobody is in the way of their take-off."""
        ...

    def commands_m_s(self, situation: SwarmSituation) -> FloatArray:
        """Return the velocities agents command until the next tick, east and north. (n, 2) [m s⁻¹]

        No more than the ``speed_m_s`` of each: its model is asked about no other.

        Parameters
        ----------
        situation : SwarmSituation
            Everything agents know of themselves and of each other: places, velocities, where they come to
            rest, and the velocities they want.  Its ``may`` says which commands leave every stop free.
        """
        ...


class NoAvoidance(Value):
    """``none``: everyone flies as it wants, and comes as near to others as that leads to."""

    needs_ticks: bool = False
    keeps_apart: bool = False

    def commands_m_s(self, situation: SwarmSituation) -> FloatArray:
        """Return what agents want."""
        return situation.wanted_m_s


class StopInTime(Value):
    """``stop``: who goes later by its rank brakes in time, stands, and flies on when its way is free.

    It flies on when the way is free for a while, so that nobody creeps.  Who has stood for long gets out of
    the way, to its right if that is free, one after the other by rank, until its own way is free.
    """

    needs_ticks: bool = False
    keeps_apart: bool = True
    resumes_s: float = 2.0
    """For so long the way of one that stands must be free. [s]"""
    patience_s: float = 20.0
    """For so long it stands before it goes aside. [s]"""

    def commands_m_s(self, situation: SwarmSituation) -> FloatArray:
        """Return what agents want, nothing for those that stop."""
        wanted, before = situation.wanted_m_s, situation.command_m_s
        wants, stands = differ(wanted), ~differ(before)
        goes_aside = ~stands & ((before * wanted).sum(axis=1) < 0.5 * (wanted**2).sum(axis=1))
        held = wants & (stands | goes_aside)
        if held.any():
            ticks = max(round(self.resumes_s / situation.tick_s), 1)
            stays = held & ~situation.may(wanted, ticks)
            aside = stays & (goes_aside | (situation.waited_s >= self.patience_s))
            tried = np.where(stays[:, None], np.where(goes_aside[:, None], before, 0.0), wanted)
            if aside.any():
                tried = self._aside_m_s(situation, tried, aside, ticks)
            wanted = tried
        return np.where(situation.may(wanted)[:, None], wanted, 0.0)

    def _aside_m_s(
        self, situation: SwarmSituation, command_m_s: FloatArray, aside: BoolArray, ticks: int
    ) -> FloatArray:
        """Return commands by which agents go aside: on as before, else to their right.

        Where that is not free, the last of them by rank goes to wherever it is: if all did, those that stand
        symmetrically would all come back.
        """
        wanted, found = situation.wanted_m_s, command_m_s
        lacks = aside & ~(situation.may(found) & differ(found))
        is_found = np.zeros(len(lacks), np.bool_)
        for number, angle_rad in enumerate(_ASIDE_RAD):
            if not lacks.any():
                break
            turned = _turned_right(wanted, np.full(len(wanted), angle_rad))
            tried = np.where(lacks[:, None], turned, found)
            free = lacks & situation.may(tried, ticks if number else 1)
            found = np.where(free[:, None], turned, found)
            is_found |= free & (number > 0)
            lacks &= ~free
        stays = is_found & (situation.rank < np.max(situation.rank, where=is_found, initial=-1))
        return np.where((lacks | stays)[:, None], 0.0, found)


class OrcaStop(Value):
    """``orca-stop``: reciprocal velocities, of those from which a stop is still free.

    Where an agent stops is where it is told to: that place moves at the velocity commanded, at once, as
    reciprocal velocities take it.  Of two zones it keeps disks apart about the places where they are
    nearest to each other: who flies abreast of another keeps its way.
    """

    needs_ticks: bool = True
    keeps_apart: bool = True
    horizon_s: float = 12.0
    """Time for which two agents keep apart by the velocities they take. [s]"""
    neighbours: int = 10
    """So many of the nearest are looked at."""
    patience_s: float = 4.0
    """Who has waited so long for its way goes round to the right, the farther the longer it waits. [s]"""

    def commands_m_s(self, situation: SwarmSituation) -> FloatArray:
        """Return the velocities nearest to those wanted, slower where no stop would be free."""
        wanted = _turned_right(
            situation.wanted_m_s,
            np.clip(situation.waited_s / self.patience_s, 0.0, 1.0) * _ROUND_RAD,
        )
        planes = half_planes(
            self._neighbours(situation),
            situation.command_m_s,
            situation.is_led,
            horizon_s=self.horizon_s,
            tick_s=situation.tick_s,
        )
        best, is_possible = nearest_velocities_m_s(planes, wanted, situation.speed_m_s)
        # who takes off or lands stays over its pad
        command = np.where((is_possible & situation.is_led)[:, None], best, 0.0)
        for part in _PARTS:
            may = situation.may(command)
            if may.all():
                return command
            command = np.where(may[:, None], command, part * command)
        return command

    def _neighbours(self, situation: SwarmSituation) -> Neighbours:
        """Return whom each keeps apart from."""
        zones = situation.zones
        middle_m = 0.5 * (zones.begin_m + zones.end_m)
        rows = nearest_neighbours(middle_m, situation.is_there, self.neighbours)
        own, other = np.repeat(np.arange(len(rows)), rows.shape[1]), rows.ravel()
        apart_m = gaps_m(zones.select(own), zones.select(other))
        reach_m = situation.separation_m + zones.radius_m[own] + zones.radius_m[other]
        return Neighbours(
            rows=rows, apart_m=apart_m.reshape(*rows.shape, 2), reach_m=reach_m.reshape(rows.shape)
        )


def _turned_right(velocity_m_s: FloatArray, angle_rad: FloatArray) -> FloatArray:
    east, north = velocity_m_s.T
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.stack((east * cos + north * sin, north * cos - east * sin), axis=1)


def nearest_neighbours(place_m: FloatArray, is_there: BoolArray, most: int) -> IndexArray:
    """Return the nearest others of each agent, nearest first, -1 where there are fewer. (n, most)"""
    there = np.flatnonzero(is_there)
    found = np.full((len(place_m), most), -1, np.intp)
    count = min(most, len(there) - 1)
    if count < 1:
        return found
    if len(there) < _TREE_FROM:
        east, north = place_m[there].T
        apart = (east[:, None] - east) ** 2 + (north[:, None] - north) ** 2
        np.fill_diagonal(apart, np.inf)
        order = np.argsort(apart, axis=1, kind="stable")[:, :count]
    else:
        from scipy.spatial import cKDTree

        order = cKDTree(place_m[there]).query(place_m[there], k=count + 1)[1][:, 1:]
    found[there, :count] = there[order]
    return found


POLICIES: Mapping[str, type[NoAvoidance | StopInTime | OrcaStop]] = {
    "none": NoAvoidance,
    "stop": StopInTime,
    "orca-stop": OrcaStop,
}
"""Policies by the names they are called by."""
