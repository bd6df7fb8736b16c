"""Sorties that give way to each other along their tracks: by events, none of them sampled."""

from __future__ import annotations

import math
from enum import IntEnum
from typing import TYPE_CHECKING, NamedTuple, Protocol

import numpy as np

from planner.fleet.swarm.tracks import find_crossing, first_contact

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.fleet.approach import Cylinder
    from planner.fleet.swarm.tracks import Contact, Crossing, ZoneTrack

_FREE_S = 10.0
"""For so long the way of one that stands must be free: setting out and stopping again takes 7 s with the
article's response, less would be creeping. [s]"""
_RETRY_S = 0.5
"""It asks again no sooner. [s]"""
_EPSILON_S = 1e-6
_MOST_STOPS = 500
"""An agent told to stop more often does not come on. [-]"""


class Passage(IntEnum):
    """What an agent is about on its track."""

    WAITS = 0
    """On the ground, before its start."""
    FLIES = 1
    STANDS = 2
    """Told to stop, and not yet to fly on."""


class Wait(NamedTuple):
    """A time for which an agent did not get on."""

    begin_s: float
    end_s: float


class LateLink(NamedTuple):
    """When, and by how much, what an agent has to do for others reaches it late."""

    begin_s: float
    end_s: float
    late_s: float


class Traveller:
    """One agent of `Yielding`.

    Parameters
    ----------
    track : ZoneTrack
        Of its whole flight, from a take-off at 0 s.
    ready_s : float
        When it would start. [s]
    rank : int
        Who has the lower goes first.
    after : int, optional
        Who has to have landed before: the same vehicle's flight before this one.
    after_s : float
        So long before. [s]
    deaf_s : tuple of float
        From when until when it hears no command. [s]
    link : LateLink, optional
        By which it is told late to stop, and to fly on again.
    """

    def __init__(
        self,
        track: ZoneTrack,
        ready_s: float,
        rank: int,
        *,
        after: int | None = None,
        after_s: float = 0.0,
        deaf_s: tuple[float, float] = (math.inf, math.inf),
        link: LateLink | None = None,
    ) -> None:
        self.whole = track
        """With times as if it got on at once."""
        self.track = track
        """With times as far as they are known."""
        self.ready_s, self.rank = ready_s, rank
        self.after, self.after_s, self.deaf_s = after, after_s, deaf_s
        self.link = link
        self.told_s = math.inf
        """When what it was told reaches it, by a link that is late. [s]"""
        self.passage = Passage.WAITS
        self.start_s = math.inf
        self.stood_s = ready_s
        """Since when it could get on. [s]"""
        self.holds_knot = 0
        """From which on it flies on. [-]"""
        self.next_s = ready_s
        """When it asks again whether its way is free; infinite: when another gets on. [s]"""
        self.blocked_by: int | None = None
        self.waits: list[Wait] = []
        self.stops = 0
        self.goes_on = False
        """Whether it could not be stopped when it was told, and never will be."""

    def is_deaf(self, time_s: float) -> bool:
        """Return whether it hears no command at a time."""
        begins_s, ends_s = self.deaf_s
        return begins_s <= time_s < ends_s


class Event(NamedTuple):
    """That an agent has to be told to stop."""

    time_s: float
    agent: int
    is_touch: bool
    """Whether both are where they may meet already."""


class Sorties(Protocol):
    """The flights behind the tracks."""

    def stopped(
        self, agent: int, rest_m: float, knot: int, start_s: float
    ) -> tuple[ZoneTrack, int] | None:
        """Return the track of a flight that stops so far along its last one, and the knot it flies on from.

        It is told after a knot of that, and started at a time.  Times count from the beginning of the
        operation, the stop being as short as it can be; ``None``: it cannot stop there.
        """
        ...

    def resumed(self, agent: int, later_s: float, start_s: float) -> ZoneTrack | None:
        """Return the track of a flight that stands for so much longer than that.

        ``None``: it is that of the shortest stop, and later by as much.
        """
        ...


class Yielding:
    """Agents that each stop in time for those that go first, and fly on when their way is free.

    Where two tracks are too near to each other, parts next to each other make a region.  If the zones of both
    would meet in it, who goes later by rank stays out until the other has left; one that is in it already has
    to be left out by the other.  If both are, they stop where their zones touch.

    Parameters
    ----------
    agents : sequence of Traveller
    sorties : Sorties
    keeps : callable
        What two agents keep apart by.
    """

    def __init__(
        self,
        agents: Sequence[Traveller],
        sorties: Sorties,
        keeps: Callable[[int, int], Cylinder | None],
    ) -> None:
        self.agents = agents
        self._sorties, self._keeps = sorties, keeps
        self._crossings: dict[tuple[int, int], Crossing | None] = {}
        self._events: dict[tuple[int, int], Event | None] = {}
        self.time_s = 0.0

    def run(self, until_s: float, on_event: Callable[[float], None] | None = None) -> None:
        """Go from event to event, until nothing happens any more."""
        changes_s = {at_s for one in self.agents for at_s in one.deaf_s if math.isfinite(at_s)}
        while True:
            event = self._next_event()
            try_s, asks = min(
                (
                    (max(one.next_s, self.time_s), row)
                    for row, one in enumerate(self.agents)
                    if one.passage is not Passage.FLIES and math.isinf(one.told_s)
                ),
                default=(math.inf, -1),
            )
            told_s, told = min((one.told_s, row) for row, one in enumerate(self.agents))
            deaf_s = min((one for one in changes_s if one > self.time_s), default=math.inf)
            at_s = min(try_s, math.inf if event is None else event.time_s, deaf_s, told_s)
            if at_s >= until_s or math.isinf(at_s):
                return
            self.time_s = at_s
            if on_event is not None:
                on_event(at_s)
            if at_s == deaf_s:
                for row, one in enumerate(self.agents):
                    if at_s in one.deaf_s:
                        self._changed(row)
            elif at_s == told_s:
                self._do(told)
            elif event is None or try_s <= event.time_s:
                if self._may_get_on(asks):
                    self._tell(asks)
            else:
                self._tell(event.agent)

    def _tell(self, agent: int) -> None:
        """Tell an agent to stop, or to get on: its link may be late, but not on the ground."""
        one = self.agents[agent]
        link = None if one.passage is Passage.WAITS else one.link
        if link is None or not link.begin_s <= self.time_s < link.end_s:
            self._do(agent)
        else:
            one.told_s = self.time_s + link.late_s

    def _do(self, agent: int) -> None:
        """Let an agent do what it was told."""
        one = self.agents[agent]
        one.told_s = math.inf
        if one.passage is Passage.FLIES:
            self._stop(agent)
        else:
            self._get_on(agent)

    def _is_deaf(self, agent: int) -> bool:
        return self.agents[agent].is_deaf(self.time_s)

    @property
    def stuck(self) -> list[int]:
        """Those that do not get on."""
        return [row for row, one in enumerate(self.agents) if one.passage is not Passage.FLIES]

    def _next_event(self) -> Event | None:
        """Return when an agent is told to stop next, and which."""
        up = [row for row, one in enumerate(self.agents) if one.passage is not Passage.WAITS]
        best: Event | None = None
        for place, first in enumerate(up):
            for second in up[place + 1 :]:
                pair = (first, second)
                if pair not in self._events:
                    self._events[pair] = self._event(
                        pair, (self.agents[first].track, self.agents[second].track)
                    )
                event = self._events[pair]
                if event is None or self.agents[event.agent].told_s < math.inf:
                    continue
                if best is None or event < best:
                    best = event
        return best

    def _crossing(self, pair: tuple[int, int]) -> tuple[Crossing, float] | None:
        keeps = self._keeps(*pair)
        if keeps is None:
            return None
        if pair not in self._crossings:
            agents = [self.agents[row] for row in pair]
            # Who is on the ground has times of its own yet.
            waits = any(one.passage is Passage.WAITS for one in agents)
            after_s = -math.inf if waits else self.time_s - _EPSILON_S
            one, two = (each.track for each in agents)
            self._crossings[pair] = find_crossing(one, two, keeps, after_s)
        crossing = self._crossings[pair]
        return None if crossing is None else (crossing, keeps.horizontal_m)

    def _contact(
        self, pair: tuple[int, int], tracks: tuple[ZoneTrack, ZoneTrack]
    ) -> Contact | None:
        found = self._crossing(pair)
        if found is None:
            return None
        crossing, reach_m = found
        return first_contact(*tracks, crossing, self.time_s, reach_m)

    def _event(
        self,
        pair: tuple[int, int],
        tracks: tuple[ZoneTrack, ZoneTrack],
        contact: Contact | None = None,
        flying: int | None = None,
    ) -> Event | None:
        """Return when which of two has to be told to stop; ``None``: neither, or neither can be.

        ``flying`` counts as such whatever it does now.
        """
        contact = contact or self._contact(pair, tracks)
        if contact is None:
            return None
        entered_s = [
            float(track.reached_s(np.array([entry_m]))[0])
            for track, entry_m in zip(tracks, contact.entries_m, strict=True)
        ]
        is_in = [one_s < self.time_s - _EPSILON_S for one_s in entered_s]
        later = 0 if self.agents[pair[0]].rank > self.agents[pair[1]].rank else 1
        yields = later if is_in[0] == is_in[1] else is_in.index(False)
        for row in (yields, 1 - yields):
            agent = pair[row]
            if self._is_deaf(agent) or self.agents[agent].goes_on:
                continue
            if agent == flying or self.agents[agent].passage is Passage.FLIES:
                at_s = contact.time_s if is_in[row] else max(entered_s[row], self.time_s)
                if tracks[row].may_stop(at_s):
                    return Event(at_s, agent, all(is_in))
        return None

    def _may_get_on(self, agent: int) -> bool:
        """Return whether the way of an agent is free; note when it asks again."""
        one = self.agents[agent]
        if self._has_to_wait(agent):
            return False
        track = one.whole.moved(one.holds_knot, self.time_s)
        for other, two in enumerate(self.agents):
            if other == agent or two.passage is Passage.WAITS:
                continue
            pair = (min(agent, other), max(agent, other))
            tracks = (track, two.track) if agent < other else (two.track, track)
            contact = self._contact(pair, tracks)
            if contact is None:
                continue
            event = self._event(pair, tracks, contact, flying=agent)
            if event is not None:
                is_later = event.time_s >= self.time_s + _FREE_S
                if is_later or (event.agent != agent and not event.is_touch):
                    continue
            later_s = contact.clears_s[0 if agent < other else 1]
            one.next_s = self.time_s + max(later_s, _RETRY_S)
            one.blocked_by = other
            return False
        return True

    def _get_on(self, agent: int) -> None:
        """Let an agent take off, or fly on."""
        one = self.agents[agent]
        track = one.whole.moved(one.holds_knot, self.time_s)
        waited = Wait(one.stood_s, self.time_s)
        if waited.end_s > waited.begin_s:
            one.waits.append(waited)
        if one.passage is Passage.WAITS:
            one.start_s = self.time_s
        else:
            later_s = self.time_s - float(one.whole.time_s[one.holds_knot])
            flown = self._sorties.resumed(agent, later_s, one.start_s)
            if flown is not None:
                track = flown
                self._forget_crossings(agent)
        one.whole = one.track = track
        one.passage = Passage.FLIES
        self._changed(agent)

    def _has_to_wait(self, agent: int) -> bool:
        """Return whether an agent hears nothing, or its vehicle still flies; note until when."""
        one = self.agents[agent]
        if self._is_deaf(agent):
            one.next_s = one.deaf_s[1]
            return True
        if one.after is None:
            return False
        before = self.agents[one.after]
        free_s = math.inf
        if before.passage is Passage.FLIES:
            free_s = float(before.track.time_s[-1]) + one.after_s
        if free_s <= self.time_s:
            return False
        one.next_s, one.blocked_by = free_s, one.after
        return True

    def _stop(self, agent: int) -> None:
        """Tell an agent to stop."""
        one = self.agents[agent]
        rest_m = one.track.rest_at_m(self.time_s)
        found = None
        if one.stops < _MOST_STOPS:
            told = int(np.searchsorted(one.track.time_s, self.time_s, side="right")) - 1
            found = self._sorties.stopped(agent, rest_m, told, one.start_s)
        if found is None:
            one.goes_on = True
            self._changed(agent)
            return
        one.whole, one.holds_knot = found
        one.stops += 1
        one.stood_s = one.next_s = max(float(one.whole.time_s[one.holds_knot]), self.time_s)
        one.track = one.whole.moved(one.holds_knot, math.inf)
        one.passage = Passage.STANDS
        self._forget_crossings(agent)
        self._changed(agent)

    def _forget_crossings(self, agent: int) -> None:
        for pair in [pair for pair in self._crossings if agent in pair]:
            del self._crossings[pair]

    def _changed(self, agent: int) -> None:
        """Forget what depended on the times of an agent."""
        for pair in [pair for pair in self._events if agent in pair]:
            del self._events[pair]
        for one in self.agents:
            if one.passage is not Passage.FLIES and one.blocked_by == agent:
                one.next_s = min(one.next_s, max(self.time_s, one.stood_s))
