"""What a swarm does: algorithms that give each agent the place it wants to be at next."""

from __future__ import annotations

from collections import deque
from itertools import pairwise
from typing import TYPE_CHECKING, Protocol

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.fleet.swarm.zones import differ

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.fleet.swarm.situation import SwarmSituation


_MOST_LANES = 10_000
_TURNS = 3
"""So many times at most a lane is flown, where others push an agent off it. [-]"""
_LEAST_M = 1e-9
_LEAST_WAY = 0.01
"""Part of the diagonal of an area that a direction drawn leads through at least. [-]"""


class Algorithm(Protocol):
    """What a swarm does: `planner.fleet.Algorithm`.

    It is made for one simulation and may keep what it has done; it is asked again in the same order with
    the same seed, whatever the machine.  One whose goals change at a time of their own, and not where an
    agent arrives, says so by an attribute ``changes_s``: until then ticks in which nothing happens may be
    passed over.
    """

    def goals_m(self, situation: SwarmSituation) -> FloatArray:
        """Return the place each agent flies to, east and north; NaN: it is done, and lands. (n, 2) [m]

        ``situation.has_arrived`` says who stands where it was sent to.
        """
        ...


class Waypoints:
    """Every agent flies along places of its own, stands at each, and lands at the last.

    Parameters
    ----------
    ways : sequence of ndarray
        Places of each agent, (places, 2) [m].
    hold_s : float
        For so long it stands at each. [s]
    together : bool
        Whether all go on to the next place when the last has arrived, as a formation does.
    """

    def __init__(
        self, ways: Sequence[FloatArray], *, hold_s: float = 0.0, together: bool = False
    ) -> None:
        longest = max((len(way) for way in ways), default=0)
        self._ways = np.full((len(ways), longest + 1, 2), np.nan)
        for row, way in enumerate(ways):
            self._ways[row, : len(way)] = way
        self._next = np.zeros(len(ways), np.intp)
        self._stood_s = np.full(len(ways), np.inf)
        self._hold_s, self._together = hold_s, together
        self._rows = np.arange(len(ways))

    def goals_m(self, situation: SwarmSituation) -> FloatArray:
        """Return the next place of each."""
        last = self._next >= self._ways.shape[1] - 1
        arrived = situation.has_arrived & ~last
        self._stood_s = np.where(arrived, np.minimum(self._stood_s, situation.time_s), np.inf)
        goes = arrived & (situation.time_s >= self._stood_s + self._hold_s - 1e-9)
        if self._together:
            goes &= bool((goes | last).all())
        self._next[goes] += 1
        self._stood_s[goes] = np.inf
        return self._ways[self._rows, self._next]


class Lanes:
    """Every agent flies lanes of its own, then again what it was pushed off of them, and lands at home.

    Parameters
    ----------
    ways : sequence of ndarray
        Ends of the lanes of each agent, two of each lane, (2 k, 2) [m].
    home_m : ndarray
        Where each lands, (n, 2) [m].
    off_m : float
        Farther beside a lane an agent is off it. [m]
    """

    def __init__(self, ways: Sequence[FloatArray], *, home_m: FloatArray, off_m: float) -> None:
        self._lanes = [
            deque((*ends, 1) for ends in zip(way[::2], way[1::2], strict=True)) for way in ways
        ]
        self._home_m, self._off_m = home_m, off_m
        self._begin, self._end = home_m.copy(), home_m.copy()
        self._turn = np.zeros(len(ways), np.intp)
        """For which time its lane is flown; 0 on its way home."""
        self._flies_lane = np.zeros(len(ways), np.bool_)
        """Whether it is sent to the end of its lane, not to its begin."""
        self._along_m, self._left_m = np.zeros(len(ways)), np.full(len(ways), np.nan)
        """How far it is along its lane, and where it left it; NaN: it is on it."""
        for agent in range(len(ways)):
            self._take_next(agent)

    def goals_m(self, situation: SwarmSituation) -> FloatArray:
        """Return the ends of their lanes, their begins of those on their way there."""
        self._note_off(situation.place_m)
        for agent in np.flatnonzero(situation.has_arrived).tolist():
            if self._turn[agent] == 0:
                self._begin[agent] = np.nan
            elif self._flies_lane[agent]:
                self._take_next(agent)
            else:
                self._flies_lane[agent] = True
                self._along_m[agent], self._left_m[agent] = 0.0, np.nan
        return np.where(self._flies_lane[:, None], self._end, self._begin)

    def _take_next(self, agent: int) -> None:
        """Send an agent to the begin of its next lane, or home."""
        home_m = self._home_m[agent]
        lane = self._lanes[agent].popleft() if self._lanes[agent] else (home_m, home_m, 0)
        self._begin[agent], self._end[agent], self._turn[agent] = lane
        self._flies_lane[agent] = False

    def _note_off(self, place_m: FloatArray) -> None:
        """Note what agents miss of their lanes: from where they left them to where they are back on them."""
        rows = np.flatnonzero(self._flies_lane)
        way = self._end[rows] - self._begin[rows]
        length_m = np.hypot(*way.T)
        unit = way / np.maximum(length_m, _LEAST_M)[:, None]
        away_m = place_m[rows] - self._begin[rows]
        along_m = np.clip((away_m * unit).sum(axis=1), 0.0, length_m)
        is_off = np.abs(away_m[:, 0] * unit[:, 1] - away_m[:, 1] * unit[:, 0]) > self._off_m
        left_m = self._left_m[rows]
        leaves, is_back = is_off & np.isnan(left_m), ~is_off & (along_m > left_m + self._off_m)
        for one in np.flatnonzero(is_back).tolist():
            agent = int(rows[one])
            if self._turn[agent] < _TURNS:
                ends = (
                    self._begin[agent] + at_m * unit[one] for at_m in (left_m[one], along_m[one])
                )
                self._lanes[agent].append((*ends, int(self._turn[agent]) + 1))
        self._left_m[rows] = np.where(leaves, self._along_m[rows], np.where(is_off, left_m, np.nan))
        self._along_m[rows] = along_m


class RandomSearch:
    """Every agent flies in directions drawn by a seed, each until it meets the edge of the area.

    The way of stochastic recovery: who has lost the others finds them, or the target, by directions that
    nobody can foresee.

    Parameters
    ----------
    low_m, high_m : ndarray
        Corners of the area, east and north. (2,) [m]
    home_m : ndarray
        Where each lands, (n, 2) [m].
    ends_s : float
        When all fly home. [s]
    seed : int
    """

    def __init__(
        self, low_m: FloatArray, high_m: FloatArray, *, home_m: FloatArray, ends_s: float, seed: int
    ) -> None:
        self._low, self._high = np.asarray(low_m, np.float64), np.asarray(high_m, np.float64)
        self._draws = [np.random.default_rng((seed, agent)) for agent in range(len(home_m))]
        self._goal_m = np.full(home_m.shape, np.nan)
        self._home_m, self.changes_s = home_m, ends_s

    def goals_m(self, situation: SwarmSituation) -> FloatArray:
        """Return where each direction leads to."""
        if situation.time_s >= self.changes_s:
            home = situation.has_arrived & ~differ(self._goal_m, self._home_m)
            self._goal_m = np.where(home[:, None], np.nan, self._home_m)
            return self._goal_m
        for agent in np.flatnonzero(situation.has_arrived | np.isnan(self._goal_m[:, 0])).tolist():
            self._goal_m[agent] = self._drawn_m(agent, situation.place_m[agent])
        return self._goal_m

    def _drawn_m(self, agent: int, place_m: FloatArray) -> FloatArray:
        """Return where a direction drawn leaves the area; directions that leave it here are drawn again."""
        size = float(np.hypot(*(self._high - self._low)))
        place_m = np.clip(place_m, self._low, self._high)
        while True:
            angle_rad = self._draws[agent].uniform(0.0, 2.0 * np.pi)
            unit = np.array([np.cos(angle_rad), np.sin(angle_rad)])
            with np.errstate(divide="ignore", invalid="ignore"):
                ways = np.where(unit > 0.0, self._high - place_m, self._low - place_m) / unit
            way_m = float(np.nanmin(ways))
            if way_m > _LEAST_WAY * size:
                return np.asarray(place_m + way_m * unit)


def strips(
    low_m: FloatArray, high_m: FloatArray, *, lane_m: float, agents: int
) -> list[FloatArray]:
    """Return ways that cover a rectangle by lanes, as many next to each other for each agent. [m]

    Lanes run east and west, every second one of an agent back; shares differ by one lane at most.  Of fewer
    lanes than agents each is divided, so that nobody has none.

    Raises UsageError if they are more than a simulation can hold.
    """
    count = max(int(np.ceil((high_m[1] - low_m[1]) / lane_m)), 1)
    if count > _MOST_LANES:
        least_m = float((high_m[1] - low_m[1]) / _MOST_LANES)
        msg = (
            f"lane_m: lanes of {quantity.distance(lane_m)} are {count:,} in this area, {_MOST_LANES:,} at "
            f"most: give {quantity.distance(least_m)} or more, or a smaller area"
        )
        raise UsageError(msg)
    width_m, length_m = (high_m[1] - low_m[1]) / count, high_m[0] - low_m[0]
    parts = -(-agents // count)
    shares = np.linspace(0, count * parts, agents + 1).round().astype(int).tolist()
    ways = []
    for begin, end in pairwise(shares):
        way: list[tuple[float, float]] = []
        first = begin // parts
        for number in range(first, -(-end // parts)):
            north_m = low_m[1] + (number + 0.5) * width_m
            bounds = max(begin - number * parts, 0), min(end - number * parts, parts)
            ends = [(low_m[0] + bound / parts * length_m, north_m) for bound in bounds]
            way.extend(ends if (number - first) % 2 == 0 else ends[::-1])
        ways.append(np.array(way).reshape(-1, 2))
    return ways
