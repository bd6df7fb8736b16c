"""When the items that conditions hold back are carried out, by the flight as it is predicted."""

from __future__ import annotations

import math
from collections import Counter
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.commands import Command
from planner.mission.route.queue import HELD_BACK, Firing, soonest
from planner.mission.route.stage import LEVEL_FIRST, FenceAction, OtherRoute, StageKind
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterable, Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.motion.kinematics import Motion
    from planner.flight.pilot import Pilot
    from planner.mission.items import Mission
    from planner.mission.route.queue import HeldItem
    from planner.mission.route.stage import Route

_MOST_PASSES = 12
"""Each pass settles the next leg at least; all at once settle in two or three."""
_MOST_ALONE = 100
"""So many are settled one by one, a flight for each, where all at once do not."""
_SAME = 1e-3
"""Fractions of a leg that differ by less are one."""
_AS_EARLY_S = 1e-3
"""Times before the end of a leg that differ by less are one. [s]"""
_AT_AN_END_M = 0.5
"""Nearer to the beginning or the end of a leg than this it is not divided. [m]"""
_NEAR_M = 2.0 * _AT_AN_END_M
"""Places on a leg nearer to each other than this are one, where no prediction agrees with itself. [m]"""
_CURVES = frozenset({StageKind.SPLINE, StageKind.CIRCLE})
"""Stages that are not divided where a speed changes."""
_BRAKED_FOR = frozenset({StageKind.GO, StageKind.LOITER})
"""Straight legs behind which nothing of their stage is flown at the speeds commanded."""
_LEG_ERROR = 0.05
"""How far the time of a leg may be off. [-]"""
_PLACE_ERROR_M = 1.0
"""How far off a vehicle is where its leg is over: recorded copters stop up to 0.8 m off. [m]"""
_LEFT_M = 0.1
"""A return that has got so far has begun its way home. [m]"""
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_BEGINNING, _END = Firing(0.0), Firing(1.0)
_ENDS = frozenset({None, _BEGINNING, _END})
"""Where on a leg it is not divided: nowhere, its beginning, its end."""
_SAME_S = 0.5
"""Flights that take so little longer take the same time. [s]"""
_MOST_OTHERS = 7
"""Flights looked at besides the one predicted: of three speeds that may be carried out or not."""
_SAMPLES = 1000
"""Times at which the distance to the place of a leg is looked at."""


class QueueFlights(Value):
    """The flights by whose times a queue may go on."""

    pilots: tuple[Pilot, ...]
    """Who may fly it; the first as predicted."""
    late_s: Callable[[Motion], FloatArray] | None = None
    """How much longer the segments of each may last besides; ``None``: no longer. (s,) [s]"""

    def times(self, route: Route) -> tuple[_Times, ...]:
        """Return when the legs of a route begin and end, as predicted first."""
        every = []
        for pilot in self.pilots:
            motion = pilot.fly(route)[0]
            every.append(_Times(route, motion))
            late_s = None if self.late_s is None else self.late_s(motion)
            if late_s is not None and late_s.any():
                every.append(_Times(route, motion, late_s))
        return tuple(every)

    def longest_s(self, route: Route) -> float:
        """Return how long a route takes at most. [s]"""
        return max(times.flight_s for times in self.times(route))


class _QueuedMission(Value):
    """What a mission may be flown like: its routes by where items held back are carried out, and by whom."""

    mission: Mission
    make: Callable[[Mapping[int, Firing]], Route]
    flights: QueueFlights
    pinned: Mapping[int, Firing | None]
    """Where visits are carried out, whatever their times say; ``None``: nowhere."""


class _Settled(Value):
    """Where on its leg an item is carried out, by what flight takes longest."""

    item: HeldItem
    """With the conditions that are met so."""
    at: Firing | None
    """``None``: nowhere."""
    finding: Finding | None = None
    """That it may be another."""
    others: tuple[Firing | None, ...] = ()
    """The first and last where it may be as well, as its conditions are met as its leg ends."""


def route_with_queue(
    mission: Mission, make: Callable[[Mapping[int, Firing]], Route], flights: QueueFlights
) -> Route:
    """Return the route of a mission, its items held back carried out when the flight is so far.

    ``make`` lays the route out by where on their legs they are carried out.  When that is depends on the
    flight, and the flight on it: it is predicted until neither changes.
    """
    return _route_with(_QueuedMission(mission=mission, make=make, flights=flights, pinned={}))


def _route_with(queued: _QueuedMission) -> Route:
    make, flights = queued.make, queued.flights
    firings: dict[int, Firing] = {}
    before: dict[int, Firing] = {}
    close = _Close()
    settled: list[_Settled] = []
    route = make(firings)
    for _ in range(_MOST_PASSES):
        if not route.held or not route.stages:
            return route
        every = flights.times(route)
        close.add(queued.mission, route.held, every)
        if (
            sum(_is_open(one, every) or one.visit in close.speeds for one in route.held)
            > _MOST_ALONE
        ):
            return _unsettled(queued.mission, route)
        settled = [_settled(queued, one, every, firings, close) for one in route.held]
        found = _firings(settled)
        if found.keys() == firings.keys() and all(
            _is_same(found[visit], firings[visit]) for visit in found
        ):
            return _told(queued, route, settled, every, close)
        before, firings = firings, found
        route = make(firings)
    other = make(before)
    if _are_near(route, firings, before):  # it is carried out where legs are divided, or just not
        every, last = flights.times(route), flights.times(other)
        if last[0].flight_s > every[0].flight_s:
            route, every = other, last
        return _told(queued, route, settled, every, close)
    if len(route.held) > _MOST_ALONE:
        return _unsettled(queued.mission, route)
    settled = _one_by_one(queued, route.held)
    route = make(_firings(settled))
    return _told(queued, route, settled, flights.times(route), close)


class _Close:
    """Items whose conditions are met so near to the end of a leg that either may be first."""

    def __init__(self) -> None:
        self.items: set[int] = set()
        """Those of which that is an error."""
        self.speeds: set[int] = set()
        """Visits of speeds that are flown either way: each the only one of its leg."""

    def add(self, mission: Mission, held: Iterable[HeldItem], every: Sequence[_Times]) -> None:
        """Add those that are by the times of one more prediction."""
        on_legs = Counter(one.last_stage for one in held if one.command is Command.DO_CHANGE_SPEED)
        for one in held:
            if not _is_close(mission, one, every):
                continue
            if one.command is Command.DO_CHANGE_SPEED and on_legs[one.last_stage] == 1:
                self.speeds.add(one.visit)
            else:
                self.items.add(one.item)


def _firings(settled: Iterable[_Settled]) -> dict[int, Firing]:
    return {one.item.visit: one.at for one in settled if one.at is not None}


def _told(
    queued: _QueuedMission,
    route: Route,
    settled: Sequence[_Settled],
    every: Sequence[_Times],
    close: _Close,
) -> Route:
    """Return a route with what becomes of its items held back, and those that are as likely."""
    mission = queued.mission
    by_visit = {one.item.visit: one for one in settled}
    told = [
        replace(each, item=replace(one, conditions=each.item.conditions))
        for one in route.held
        for each in (by_visit[one.visit],)
    ]
    either = [] if queued.pinned else [one for one in told if one.others]
    others: tuple[OtherRoute, ...] = ()
    if math.prod(1 + len(one.others) for one in either) - 1 > _MOST_OTHERS:
        close.items |= {one.item.item for one in either}
    else:
        others = tuple(_others(queued, either))
    found = (*route.findings, *_reported(mission, told, every, close.items))
    return replace(route, findings=found, others=others)


def _others(queued: _QueuedMission, either: Sequence[_Settled]) -> Iterator[OtherRoute]:
    """Yield the routes on which speeds are carried out elsewhere than predicted, or nowhere."""
    every = product(*((one.at, *one.others) for one in either))
    next(every)  # as predicted
    for places in every:
        pinned = {one.item.visit: at for one, at in zip(either, places, strict=True)}
        moved = {
            one.item.item: "never carried out" if at is None else "carried out"
            for one, at in zip(either, places, strict=True)
            if at != one.at
        }
        note = " and ".join(f"item {item} is {what}" for item, what in moved.items())
        yield OtherRoute(route=_route_with(replace(queued, pinned=pinned)), note=f"if {note}")


def _unsettled(mission: Mission, route: Route) -> Route:
    """Return a route with the error that nobody knows when its items held back are carried out."""
    one = route.held[0]
    finding = ITEM_NOT_MODELLED.finding(
        f"{one.command.name}: when its condition is met cannot be predicted",
        severity=Severity.ERROR,
        item=one.item,
        place=mission.items[one.item - 1].place,
    )
    return replace(route, findings=(*route.findings, finding))


def _is_open(one: HeldItem, every: Sequence[_Times]) -> bool:
    """Return whether it is open where an item is carried out that the time of the flight depends on."""
    if one.command is not Command.DO_CHANGE_SPEED:
        return False
    return _may_turn(one) or _may_last(one, every) or every[0].changes_a_curve(one)


def _may_last(one: HeldItem, every: Sequence[_Times]) -> bool:
    """Return whether the leg of an item may last longer than predicted."""
    lasts_s = [end_s - begin_s for begin_s, end_s in (times.span_s(one) for times in every)]
    return max(lasts_s) - min(lasts_s) > _SAME * max(lasts_s)


def _may_turn(one: HeldItem) -> bool:
    """Return whether an item waits for a turn that may be shorter, or none."""
    return soonest(one.conditions) != one.conditions


def _is_close(mission: Mission, one: HeldItem, every: Sequence[_Times]) -> bool:
    """Return whether it is open whether an item is carried out, or where, that a place depends on.

    Or so near to the end of its leg that the time of the flight does not tell, either.
    """
    if any(times.is_close(one) for times in every):
        return True
    if one.command is Command.DO_CHANGE_SPEED or not _may_last(one, every):
        return False
    found = [times.fires(one) for times in every]
    fractions = [each.fraction for each in found if each is not None]
    if len(fractions) < len(found):
        return bool(fractions)
    item = mission.items[one.item - 1]
    if one.command is not Command.DO_SET_HOME or not item.sets_home_here:
        return False
    return max(fractions) - min(fractions) > _LEG_ERROR


def _settled(
    queued: _QueuedMission,
    one: HeldItem,
    every: Sequence[_Times],
    firings: Mapping[int, Firing],
    close: _Close,
) -> _Settled:
    """Return where an item is carried out by flights ``every`` that carry out at ``firings``."""
    if one.visit in queued.pinned:
        return _Settled(item=one, at=queued.pinned[one.visit])
    if not _is_open(one, every) and one.visit not in close.speeds:
        at = every[0].fires(one)
        if at is not None and one.command is Command.DO_FENCE_ENABLE:
            # Where the leg may last longer it is on from the first place, and off from the last.
            found = [each for each in (times.fires(one) for times in every) if each is not None]
            is_on = queued.mission.items[one.item - 1].param1 == FenceAction.ON
            at = min(found) if is_on else max(found)
        return _Settled(item=one, at=at)
    others = {visit: at for visit, at in firings.items() if visit != one.visit}
    return _as_it_takes_longest(queued, one.visit, others)


def _as_it_takes_longest(
    queued: _QueuedMission, visit: int, others: Mapping[int, Firing]
) -> _Settled:
    """Return where a speed is carried out by which the flight takes longest, others at ``others``.

    The turn before it may be the longest or none, its leg last longer or not, or be over just then; on a
    curve it changes at one of the ends.  Until then the leg is flown as without it.
    """
    make, flights = queued.make, queued.flights
    route = make(others)
    every = flights.times(route)
    one = next(each for each in route.held if each.visit == visit)
    if visit in queued.pinned:
        return _Settled(item=one, at=queued.pinned[visit])
    waiting = [(times, waits) for times in every for waits in _waits(one)]
    is_bent = any(_is_within_a_curve(times, waits) for times, waits in waiting)
    is_close = any(times.is_close(waits) for times, waits in waiting)
    possible = _possible(one, every)
    if len(possible) == 1:
        [(at, waits)] = possible.items()
        return _Settled(item=waits, at=at)
    lasts_s = {
        at: flights.longest_s(route if at is None else make({**others, visit: at}))
        for at in possible
    }
    longest = max(possible, key=lambda at: lasts_s[at])
    added_s = lasts_s[longest] - min(lasts_s.values())
    finding = None
    if is_bent or is_close or (added_s > _SAME_S and _may_be_dropped(one, every)):
        finding = _bounded(queued.mission, one, every, longest, added_s, is_bent=is_bent)
    elsewhere: tuple[Firing | None, ...] = ()
    if is_close:
        in_order = sorted(possible, key=lambda at: Firing(math.inf) if at is None else at)
        elsewhere = tuple(at for at in (in_order[0], in_order[-1]) if at != longest)
    return _Settled(item=possible[longest], at=longest, finding=finding, others=elsewhere)


def _waits(one: HeldItem) -> tuple[HeldItem, HeldItem]:
    """Return an item as it waits for the longest turn, and for none."""
    return one, replace(one, conditions=soonest(one.conditions))


def _is_within_a_curve(times: _Times, one: HeldItem) -> bool:
    return times.changes_a_curve(one) and times.fires(one) not in _ENDS


def _possible(one: HeldItem, every: Sequence[_Times]) -> dict[Firing | None, HeldItem]:
    """Return where on its leg an item may be carried out, with the conditions that are met so."""
    possible: dict[Firing | None, HeldItem] = {}
    for times in every:
        for waits in _waits(one):
            at = times.fires(waits)
            ends = [_END, _BEGINNING] if _is_within_a_curve(times, waits) else [at]
            if times.is_close(waits):
                is_curve = times.changes_a_curve(one)
                ends += [None, _END, _BEGINNING if is_curve else times.fires(_sooner(waits))]
            for end in ends:
                if not any(_is_same(end, known) for known in possible):
                    possible[end] = waits
    return possible


def _is_same(one: Firing | None, other: Firing | None) -> bool:
    if one is None or other is None:
        return one is other
    is_as_early = abs(one.early_s - other.early_s) < _AS_EARLY_S
    return is_as_early and abs(one.fraction - other.fraction) < _SAME


def _sooner(one: HeldItem) -> HeldItem:
    """Return an item whose conditions are met as soon on its leg as one may err that ends with it."""
    sooner = tuple(
        replace(
            each,
            wait_s=each.wait_s / (1.0 + _LEG_ERROR),
            within_m=each.within_m and each.within_m + _PLACE_ERROR_M,
        )
        for each in one.conditions
    )
    return replace(one, conditions=sooner)


def _may_be_dropped(one: HeldItem, every: Sequence[_Times]) -> bool:
    """Return whether the leg of an item is over before its conditions are met, or not, by who flies."""
    return len({times.fires_s(one) is None for times in every}) > 1


def _bounded(
    mission: Mission,
    one: HeldItem,
    every: Sequence[_Times],
    at: Firing | None,
    added_s: float,
    *,
    is_bent: bool,
) -> Finding:
    """Return that an item may be carried out elsewhere than at ``at``, by which the flight takes longest."""
    if is_bent:
        ends = {None: "without it", _BEGINNING: "from its beginning", _END: "from its end"}
        what = (
            f"{one.command.name} is carried out in the middle of item {every[0].item_of(one)}, which is no "
            f"straight leg: predicted {ends[at]}"
        )
    else:
        over = _over_with_it(one) if _is_close_by(one, every) else _over(one, every)
        what = f"{_after(one)}, and {over}: predicted as "
        what += "never carried out" if at is None else "carried out"
    longer = f", which takes {quantity.duration(added_s)} longer"
    return ITEM_NOT_MODELLED.finding(
        what + longer * (is_bent or added_s > _SAME_S),
        item=one.item,
        place=mission.items[one.item - 1].place,
    )


def _after(one: HeldItem) -> str:
    return f"{one.command.name} is held back by {one.conditions[-1]}"


def _over(one: HeldItem, every: Sequence[_Times]) -> str:
    """Return when the leg of an item may be over, in words."""
    if not _may_last(one, every):
        return _over_with_it(one)
    spans_s = [end_s - begin_s for begin_s, end_s in (times.span_s(one) for times in every)]
    soon, late = quantity.duration(min(spans_s)), quantity.duration(max(spans_s))
    if soon == late:
        return f"the leg may be over after {soon}, or just later"
    return f"the leg may be over after {soon} or after {late}"


def _over_with_it(one: HeldItem) -> str:
    """Return that the leg of an item may be over just as its condition is met, in words."""
    within = quantity.percent(_LEG_ERROR)
    if one.conditions[-1].within_m is not None:
        within = quantity.distance(_PLACE_ERROR_M)
    return f"the leg is over within {within} of that"


def _is_close_by(one: HeldItem, every: Sequence[_Times]) -> bool:
    return any(times.is_close(one) for times in every)


def _one_by_one(queued: _QueuedMission, held: tuple[HeldItem, ...]) -> list[_Settled]:
    """Return where items are carried out, each by the flight without it, and what they wait for.

    Until an item is carried out the leg is flown so.
    """
    settled: list[_Settled] = []
    for visit in sorted(one.visit for one in held):
        settled.append(_as_it_takes_longest(queued, visit, _firings(settled)))
    return settled


def _are_near(route: Route, firings: Mapping[int, Firing], before: Mapping[int, Firing]) -> bool:
    """Return whether items are carried out at nearly the same places by two predictions."""
    if firings.keys() != before.keys():
        return False
    ends = {one.visit: (route.stages[one.last_stage], one.first_stage) for one in route.held}
    for visit, (fraction, early_s) in firings.items():
        if abs(early_s - before[visit].early_s) > _SAME_S:
            return False
        end, first = ends[visit]
        start = route.stages[first - 1] if first else replace(end, east_m=0.0, north_m=0.0)
        length_m = math.hypot(end.east_m - start.east_m, end.north_m - start.north_m)
        if abs(fraction - before[visit].fraction) * length_m > _NEAR_M:
            return False
    return True


class _Times:
    """When the legs of a route begin and end, and where the vehicle is."""

    def __init__(self, route: Route, motion: Motion, late_s: FloatArray | None = None) -> None:
        self._motion = motion
        self._own_end_s = end_s = np.concatenate(([0.0], motion.segments.end_s))
        if late_s is not None:
            end_s = end_s + np.concatenate(([0.0], np.cumsum(late_s)))
        self._end_s = end_s
        self.flight_s = float(end_s[-1])
        self._items = [stage.item for stage in route.stages]
        self._kinds = [stage.kind for stage in route.stages]
        # The queue runs while the vehicle holds, too; not while it brakes out of a circle.
        is_circle = np.array([kind is StageKind.CIRCLE for kind in self._kinds])
        done = motion.done_segment
        done = done - (is_circle & (done > 0) & (motion.segments.state[done] == _BRAKE))
        self._done_s = end_s[np.maximum.accumulate(done) + 1]
        self._places_m = np.array([(s.east_m, s.north_m, s.height_m) for s in route.stages])
        self._radius_m = np.where(is_circle, [abs(s.radius_m) for s in route.stages], 0.0)

    def item_of(self, one: HeldItem) -> int:
        """Return the item whose leg holds an item back."""
        return self._items[one.last_stage]

    def changes_a_curve(self, one: HeldItem) -> bool:
        """Return whether an item commands the speed of a leg that is not straight."""
        is_speed = one.command is Command.DO_CHANGE_SPEED
        return is_speed and self._kinds[one.last_stage] in _CURVES

    def span_s(self, one: HeldItem) -> tuple[float, float]:
        """Return when the leg of an item begins and ends. [s]"""
        first = one.first_stage
        begin = float(self._done_s[first - 1]) if first else 0.0
        return begin, float(self._done_s[one.last_stage])

    def fires_s(self, one: HeldItem) -> float | None:
        """Return when the conditions of an item are met; ``None`` where its leg ends before. [s]"""
        at_s, end_s = self.span_s(one)
        for condition in one.conditions:
            at_s += condition.wait_s
            if at_s >= end_s:
                return None
            if condition.within_m is not None:
                every = np.linspace(at_s, end_s, _SAMPLES)
                near = np.flatnonzero(self._away_m(one, every) < condition.within_m)
                if not len(near):
                    return None
                at_s = float(every[near[0]])
        return at_s

    def _away_m(self, one: HeldItem, time_s: FloatArray) -> FloatArray:
        """Return how far the vehicle is, level, from what its autopilot flies to just then. (n,) [m]

        That is the edge of a circle, or its target there; of a return the place straight above while it
        climbs (ArduCopter, ``ModeAuto::wp_distance_m``, ``ModeRTL::climb_start``).
        """
        here_m = self._place_m(time_s)[:, :2]
        away_m = np.hypot(*(here_m - self._places_m[one.last_stage, :2]).T)
        if self._kinds[one.last_stage] is StageKind.RETURN:
            begun_m = self._place_m(np.array([self.span_s(one)[0]]))[:, :2]
            has_left = np.hypot(*(here_m - begun_m).T) > _LEFT_M
            return np.where(has_left, away_m, 0.0)
        return np.asarray(np.abs(away_m - self._radius_m[one.last_stage]))

    def is_close(self, one: HeldItem) -> bool:
        """Return whether a condition is met so near to the end of its leg that either may be first."""
        begin_s, end_s = self.span_s(one)
        if self.fires_s(one) == begin_s:
            return False
        near_m = [c.within_m for c in one.conditions if c.within_m is not None]
        if 0.0 in near_m:  # none is below it (ArduCopter, ``ModeAuto::verify_within_distance``)
            return False
        if one.command is Command.DO_SET_HOME and self.fires_s(one) is None:
            at_once = replace(one, conditions=soonest(one.conditions))
            if self.fires_s(at_once) is not None:  # the turn may be shorter
                return True
        wait_s = sum(condition.wait_s for condition in one.conditions)
        if wait_s > 0.0 and abs(begin_s + wait_s - end_s) < _LEG_ERROR * (end_s - begin_s):
            return True
        if not near_m:
            return False
        [away_m] = self._away_m(one, np.array([end_s]))
        return any(abs(each - away_m) < _PLACE_ERROR_M for each in near_m)

    def early_s(self, one: HeldItem, at_s: float) -> float | None:
        """Return how long before the end of its leg a speed is commanded that is braked for already. [s]

        ``None``: it is not.  ``SCurve::set_speed_max`` leaves a track as it is then.
        """
        braking_s = self._motion.braking_s
        row = one.last_stage
        is_speed = one.command is Command.DO_CHANGE_SPEED
        if braking_s is None or not is_speed or self._kinds[row] not in _BRAKED_FOR:
            return None
        begin_s, end_s = np.interp(braking_s[row], self._own_end_s, self._end_s)
        return float(end_s - at_s) if begin_s <= at_s < end_s else None

    def fires(self, one: HeldItem) -> Firing | None:
        """Return where on its leg an item is carried out; ``None`` where it never is."""
        at_s = self.fires_s(one)
        if at_s is None:
            return None
        early_s = self.early_s(one, at_s)
        if early_s is not None:
            return Firing(1.0, early_s)
        start_m = self._places_m[one.first_stage - 1] if one.first_stage else np.zeros(3)
        end_m = self._places_m[one.last_stage]
        here_m = self._place_m(np.array([at_s]))[0]
        if (kind := self._kinds[one.last_stage]) in LEVEL_FIRST | {StageKind.RETURN}:
            start_m, end_m, here_m = start_m[:2], end_m[:2], here_m[:2]
        if kind is StageKind.CIRCLE:
            return Firing(0.5)  # anywhere on it
        length_m = float(np.linalg.norm(end_m - start_m))
        ahead_m = float(np.linalg.norm(end_m - here_m))
        if ahead_m < _AT_AN_END_M:
            return _END
        if ahead_m > length_m - _AT_AN_END_M:
            return _BEGINNING
        return Firing(1.0 - ahead_m / length_m)

    def _place_m(self, time_s: FloatArray) -> FloatArray:
        if self._end_s is not self._own_end_s:  # later segments are flown more slowly throughout
            time_s = np.interp(time_s, self._end_s, self._own_end_s)
        return self._motion.state_at_time(time_s).place_m


def _reported(
    mission: Mission, settled: Sequence[_Settled], every: Sequence[_Times], close: Container[int]
) -> Iterator[Finding]:
    """Yield of each item that is held back what becomes of it the first time."""
    seen: set[int] = set()
    times = every[0]
    for one, found, at in ((each.item, each.finding, each.at) for each in settled):
        if one.item in seen:
            continue
        seen.add(one.item)
        if found is not None and one.item not in close:
            yield found
            continue
        at_s, (begin_s, end_s) = times.fires_s(one), times.span_s(one)
        rule = HELD_BACK
        severity: Severity | None = None
        if one.item in close:
            over = _over_with_it(one)
            if one.conditions[-1].within_m is None and not _is_close_by(one, every):
                over = _over(one, every)
            elif at_s is None and _may_turn(one):
                over = "the leg may be over before the turn is, or not"
            rule, severity = ITEM_NOT_MODELLED, Severity.ERROR
            is_placed = over == _over(one, every) != _over_with_it(one) and at_s is not None
            is_placed &= all(each.fires_s(one) is not None for each in every)
            what = "where" if is_placed else "whether"
            message = f"{_after(one)}, and {over}: {what} it is carried out cannot be predicted"
        elif at_s is None:
            severity = Severity.WARNING
            message = f"{_after(one)}: never carried out, the leg is over after "
            message += quantity.duration(end_s - begin_s)
        else:
            message = f"{_after(one)}: carried out {quantity.duration(at_s - begin_s)} into the leg"
            if at is not None and at.early_s > 0.0:
                message += ", which brakes for its end already: it is flown on as before"
        yield rule.finding(
            message, severity=severity, item=one.item, place=mission.items[one.item - 1].place
        )
