"""When the items that conditions hold back are carried out, by the flight as it is predicted."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.commands import Command
from planner.mission.route.queue import HELD_BACK, soonest
from planner.mission.route.stage import LEVEL_FIRST, StageKind
from planner.mission.route.walk import ITEM_NOT_MODELLED
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Container, Iterator, Mapping, Sequence

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
_AT_AN_END_M = 0.5
"""Nearer to the beginning or the end of a leg than this it is not divided. [m]"""
_NEAR_M = 2.0 * _AT_AN_END_M
"""Places on a leg nearer to each other than this are one, where no prediction agrees with itself. [m]"""
_CURVES = frozenset({StageKind.SPLINE, StageKind.CIRCLE})
"""Stages that are not divided where a speed changes."""
_LEG_ERROR = 0.05
"""How far the time of a leg may be off. [-]"""
_PLACE_ERROR_M = 1.0
"""How far off a vehicle is where its leg is over: recorded copters stop up to 0.8 m off. [m]"""
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_SAMPLES = 1000
"""Times at which the distance to the place of a leg is looked at."""


def route_with_queue(
    mission: Mission, make: Callable[[Mapping[int, float]], Route], pilot: Pilot
) -> Route:
    """Return the route of a mission, its items held back carried out when the flight is so far.

    ``make`` lays the route out by where on their legs they are carried out.  When that is depends on the
    flight, and the flight on it: it is predicted until neither changes.
    """
    firings: dict[int, float] = {}
    before: dict[int, float] = {}
    close: set[int] = set()
    held: list[HeldItem] = []
    route = make(firings)
    for _ in range(_MOST_PASSES):
        if not route.held or not route.stages:
            return route
        if sum(_may_turn(one) for one in route.held) > _MOST_ALONE:
            return _unsettled(mission, route)
        times = _Times(route, pilot.fly(route)[0])
        close |= {one.item for one in route.held if times.is_close(one)}
        found, held, bounded = _carried_out(mission, times, firings, make, pilot)
        if found.keys() == firings.keys() and all(
            abs(found[visit] - firings[visit]) < _SAME for visit in found
        ):
            route = replace(route, findings=(*route.findings, *bounded))
            return _told(mission, route, held, times, close)
        before, firings = firings, found
        route = make(firings)
    other = make(before)
    if _are_near(route, firings, before):  # it is carried out where legs are divided, or just not
        times = _Times(route, pilot.fly(route)[0])
        if (last := _Times(other, pilot.fly(other)[0])).flight_s > times.flight_s:
            route, times = other, last
        return _told(mission, route, held, times, close)
    if len(route.held) > _MOST_ALONE:
        return _unsettled(mission, route)
    firings, held = _one_by_one(route.held, make, pilot)
    route = make(firings)
    return _told(mission, route, held, _Times(route, pilot.fly(route)[0]), close)


def _carried_out(
    mission: Mission,
    times: _Times,
    firings: Mapping[int, float],
    make: Callable[[Mapping[int, float]], Route],
    pilot: Pilot,
) -> tuple[dict[int, float], list[HeldItem], list[Finding]]:
    """Return where items are carried out by a flight that does so at ``firings``, and what they wait for.

    And what is only bounded.
    """
    found: dict[int, float] = {}
    held: list[HeldItem] = []
    bounded: list[Finding] = []
    for each in times.held:
        others = {visit: at for visit, at in firings.items() if visit != each.visit}
        one = _as_it_takes_longest(each, others, make, pilot)
        held.append(one)
        if times.changes_a_curve(one):
            fraction, finding = _bound(mission, one, others, make, pilot)
            bounded += [finding] if finding else []
        else:
            fraction = times.fraction(one)
        if fraction is not None:
            found[one.visit] = fraction
    return found, held, bounded


def _told(
    mission: Mission, route: Route, held: Sequence[HeldItem], times: _Times, close: Container[int]
) -> Route:
    """Return a route with what becomes of its items held back, whose conditions are those of ``held``."""
    conditions = {one.visit: one.conditions for one in held}
    told = [replace(one, conditions=conditions[one.visit]) for one in route.held]
    return replace(route, findings=(*route.findings, *_reported(mission, told, times, close)))


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


def _may_turn(one: HeldItem) -> bool:
    """Return whether an item waits for a turn that may be shorter, or none."""
    return soonest(one.conditions) != one.conditions


def _as_it_takes_longest(
    one: HeldItem,
    others: Mapping[int, float],
    make: Callable[[Mapping[int, float]], Route],
    pilot: Pilot,
) -> HeldItem:
    """Return a speed behind a turn with the turn by which the flight takes longest: the longest, or none."""
    if one.command is not Command.DO_CHANGE_SPEED or not _may_turn(one):
        return one
    at_once = replace(one, conditions=soonest(one.conditions))
    here, times = _flown_without(one.visit, others, make, pilot)
    last, first = (
        times.fraction(replace(here, conditions=each.conditions)) for each in (one, at_once)
    )
    if first is None or first == last:
        return one
    first_s, last_s = (
        times.flight_s
        if at is None
        else float(pilot.fly(make({**others, one.visit: at}))[0].segments.end_s[-1])
        for at in (first, last)
    )
    return at_once if first_s > last_s else one


def _flown_without(
    visit: int,
    others: Mapping[int, float],
    make: Callable[[Mapping[int, float]], Route],
    pilot: Pilot,
) -> tuple[HeldItem, _Times]:
    """Return an item where the others are carried out and it is not, and the times of that flight."""
    without = make(others)
    here = next(one for one in without.held if one.visit == visit)
    return here, _Times(without, pilot.fly(without)[0])


def _one_by_one(
    held: tuple[HeldItem, ...], make: Callable[[Mapping[int, float]], Route], pilot: Pilot
) -> tuple[dict[int, float], list[HeldItem]]:
    """Return where items are carried out, each by the flight without it, and what they wait for.

    Until an item is carried out the leg is flown so.
    """
    settled: dict[int, float] = {}
    chosen: list[HeldItem] = []
    for visit in sorted(one.visit for one in held):
        here, times = _flown_without(visit, settled, make, pilot)
        chosen.append(_as_it_takes_longest(here, settled, make, pilot))
        fraction = times.fraction(chosen[-1])
        if fraction is not None:
            settled[visit] = fraction
    return settled, chosen


def _are_near(route: Route, firings: Mapping[int, float], before: Mapping[int, float]) -> bool:
    """Return whether items are carried out at nearly the same places by two predictions."""
    if firings.keys() != before.keys():
        return False
    ends = {one.visit: (route.stages[one.last_stage], one.first_stage) for one in route.held}
    for visit, fraction in firings.items():
        end, first = ends[visit]
        start = route.stages[first - 1] if first else replace(end, east_m=0.0, north_m=0.0)
        length_m = math.hypot(end.east_m - start.east_m, end.north_m - start.north_m)
        if abs(fraction - before[visit]) * length_m > _NEAR_M:
            return False
    return True


def _bound(
    mission: Mission,
    one: HeldItem,
    others: Mapping[int, float],
    make: Callable[[Mapping[int, float]], Route],
    pilot: Pilot,
) -> tuple[float | None, Finding | None]:
    """Return at which end of its leg a speed is carried out that changes on a curve, and say so.

    Until then the leg is flown as without it.  From whichever end it takes longer, it is predicted.
    """
    here, times = _flown_without(one.visit, others, make, pilot)
    fraction = times.fraction(replace(here, conditions=one.conditions))
    if fraction in {None, 0.0, 1.0}:
        return fraction, None
    first_s, last_s = (
        float(pilot.fly(make({**others, one.visit: end}))[0].segments.end_s[-1])
        for end in (0.0, 1.0)
    )
    end = "beginning" if first_s > last_s else "end"
    finding = ITEM_NOT_MODELLED.finding(
        f"{one.command.name} is carried out in the middle of item {times.item_of(here)}, "
        f"which is no straight leg: predicted from its {end}, which takes "
        f"{quantity.duration(abs(first_s - last_s))} longer",
        item=one.item,
        place=mission.items[one.item - 1].place,
    )
    return float(first_s <= last_s), finding


class _Times:
    """When the legs of a route begin and end, and where the vehicle is."""

    def __init__(self, route: Route, motion: Motion) -> None:
        self.held = route.held
        self._motion = motion
        end_s = np.concatenate(([0.0], motion.segments.end_s))
        self.flight_s = float(end_s[-1])
        self._items = [stage.item for stage in route.stages]
        self._kinds = [stage.kind for stage in route.stages]
        # The queue runs while the vehicle holds, too; not while it brakes out of a circle.
        is_circle = np.array([kind is StageKind.CIRCLE for kind in self._kinds])
        done = motion.done_segment
        done = done - (is_circle & (done > 0) & (motion.segments.state[done] == _BRAKE))
        self._done_s = end_s[np.maximum.accumulate(done) + 1]
        self._places_m = np.array([(s.east_m, s.north_m, s.height_m) for s in route.stages])

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
                away = self._place_m(every)[:, :2] - self._places_m[one.last_stage, :2]
                near = np.flatnonzero(np.hypot(*away.T) < condition.within_m)
                if not len(near):
                    return None
                at_s = float(every[near[0]])
        return at_s

    def is_close(self, one: HeldItem) -> bool:
        """Return whether a condition is met so near to the end of its leg that either may be first."""
        begin_s, end_s = self.span_s(one)
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
        away_m = (self._place_m(np.array([end_s])) - self._places_m[one.last_stage])[0, :2]
        return any(abs(each - float(np.hypot(*away_m))) < _PLACE_ERROR_M for each in near_m)

    def fraction(self, one: HeldItem) -> float | None:
        """Return how far along its leg an item is carried out; ``None`` where it never is. [-]"""
        at_s = self.fires_s(one)
        if at_s is None:
            return None
        start_m = self._places_m[one.first_stage - 1] if one.first_stage else np.zeros(3)
        end_m = self._places_m[one.last_stage]
        here_m = self._place_m(np.array([at_s]))[0]
        if (kind := self._kinds[one.last_stage]) in LEVEL_FIRST | {StageKind.RETURN}:
            start_m, end_m, here_m = start_m[:2], end_m[:2], here_m[:2]
        if kind is StageKind.CIRCLE:
            return 0.5  # anywhere on it
        length_m = float(np.linalg.norm(end_m - start_m))
        ahead_m = float(np.linalg.norm(end_m - here_m))
        if ahead_m < _AT_AN_END_M:
            return 1.0
        if ahead_m > length_m - _AT_AN_END_M:
            return 0.0
        return 1.0 - ahead_m / length_m

    def _place_m(self, time_s: FloatArray) -> FloatArray:
        return self._motion.state_at_time(time_s).place_m


def _reported(
    mission: Mission, held: Sequence[HeldItem], times: _Times, close: Container[int]
) -> Iterator[Finding]:
    """Yield of each item that is held back what becomes of it the first time."""
    seen: set[int] = set()
    for one in held:
        if one.item in seen:
            continue
        seen.add(one.item)
        at_s, (begin_s, end_s) = times.fires_s(one), times.span_s(one)
        after = f"{one.command.name} is held back by {one.conditions[-1]}"
        rule = HELD_BACK
        severity: Severity | None = None
        if one.item in close:
            over = f"the leg is over within {quantity.percent(_LEG_ERROR)} of that"
            if one.conditions[-1].within_m is not None:
                over = f"the leg is over within {quantity.distance(_PLACE_ERROR_M)} of that"
            elif at_s is None and _may_turn(one):
                over = "the leg may be over before the turn is, or not"
            rule, severity = ITEM_NOT_MODELLED, Severity.ERROR
            message = f"{after}, and {over}: whether it is carried out cannot be predicted"
        elif at_s is None:
            severity = Severity.WARNING
            message = f"{after}: never carried out, the leg is over after "
            message += quantity.duration(end_s - begin_s)
        else:
            message = f"{after}: carried out {quantity.duration(at_s - begin_s)} into the leg"
        yield rule.finding(
            message, severity=severity, item=one.item, place=mission.items[one.item - 1].place
        )
