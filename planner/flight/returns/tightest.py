"""The point of a flight from which the return is tightest, and the points of no return.

The energy used by a point of a flight and that of the return from there are summed over a sweep of points.
Between two points the sum grows by little more than the flight uses there, so a tighter point, or an earlier
point of no return, than the sweep has found can hide in few places.  These are swept once more, finer: what
is used, and what a stop takes, changes there with the speed and is worked out at each point, while the
return from the place of the stop changes evenly along a line, and no flight is needed to know it.
"""

from __future__ import annotations

import math
from functools import cached_property, partial
from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import Columns, dot, lengths, quotient, summed
from planner.flight.returns.path import thinned
from planner.flight.returns.sample import SWEEP_POINTS, in_order, returns_unbroken, spread_up_to
from planner.units import wh_from_j
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Hashable, Iterator, Mapping, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.budget import BatteryBudget
    from planner.flight.returns.path import FlightPoint, FlownReturns, Returns

TOLERANCE = 5e-4
"""Energy used between points of the refinement, over the energy looked for: half of the 0.1 % by which a
point may be tighter than the one found. [-]"""
_UNEVEN = 1e-3
"""Energy of a return over the energy looked for by which a point may be off the line through the points
beside it: halfway to them, the interpolation is off by about a quarter of that. [-]"""
_AT_ONCE = 1024
"""Points that returns are flown from at once: of more, none is flown quicker."""
_SAME_PLACE_M2 = 1e-6
"""Squared distance of stops that are at one place. [m²]"""
_FEW = 8
"""Points whose return is looked at in many conditions, besides those that are tightest in extreme ones."""
_ALIKE = 1e-9
"""Sums that differ by no more than this fraction, the error of their rounding, are the same. [-]"""


class ReturnPlan(Value):
    """The return from the point of the flight where it is tightest.

    It leads where the vehicle itself would go: home, or a rally point.
    """

    tightest_item: int
    energy_home_wh: float
    """Energy to stop, return and land from there. [Wh]"""
    margin_wh: float | None
    """Energy left there less the reserve less the return; ``None`` with no battery. [Wh]"""
    tightest: FlightPoint | None = None
    time_home_s: float | None = None
    """Time to stop, return and land from there. [s]"""
    destination: int = 0
    """Where the vehicle would return to from there: 0 for home, n for rally point n, below 0 as in
    `planner.flight.returns.destination`."""
    last_return: FlightPoint | None = None
    """The point of no return: the last from which it returns above the reserve; ``None`` where it does
    from all."""
    last_return_empty: FlightPoint | None = None
    """The last from which it returns at all, with nothing left; ``None`` where it does from all."""
    below_reserve_probability: float | None = None
    """Chance that some return uses part of the reserve; ``None`` without a spread. [-]"""
    empty_probability: float | None = None
    """Chance that the battery is empty before some return has landed; ``None`` without a spread. [-]"""


class ReturnSweep(Columns, eq=False, dict=True):
    """What returns from n points of a flight take, in flown order."""

    segment: IntArray
    """(n,)"""
    fraction: FloatArray
    """Of the segment's time that has passed. (n,) [-]"""
    time_s: FloatArray
    """Since the start of the flight. (n,) [s]"""
    destination: IntArray
    """Where the vehicle itself would return to, as in `planner.flight.returns.destination`. (n,)"""
    used_wh: FloatArray
    """Energy used by then. (n,) [Wh]"""
    return_wh: FloatArray
    """Energy to stop, return and land. (n,) [Wh]"""
    return_s: FloatArray
    """Time to stop, return and land. (n,) [s]"""
    stop_wh: FloatArray
    """Energy of that to stop. (n,) [Wh]"""
    stop_s: FloatArray
    """Time of that to stop. (n,) [s]"""
    stop_m: FloatArray
    """Where it has stopped. (n, 3) [m]"""
    after_stop_j: FloatArray
    """Energy of that to return and land, by state. (n, states) [J]"""

    @cached_property
    def sum_wh(self) -> FloatArray:
        """Energy used by the time the vehicle has landed. (n,) [Wh]"""
        return self.used_wh + self.return_wh

    @cached_property
    def tightest(self) -> int:
        """The row from which the return is tightest."""
        # Braking to a stop is as tight all along: its end, where the vehicle stands still, is reported.
        sum_wh = self.sum_wh
        return int(np.flatnonzero(sum_wh >= sum_wh.max() * (1.0 - _ALIKE))[-1])

    @cached_property
    def few_tightest_rows(self) -> IntArray:
        """The rows from which returns are tightest, in flown order."""
        return np.sort(np.argsort(-self.sum_wh, kind="stable")[:_FEW])

    @cached_property
    def few_tightest(self) -> Self:
        """The sweep of these alone."""
        return self.select(self.few_tightest_rows)

    def last_below(self, limit_wh: float) -> int | None:
        """Return the last row before the first whose sum exceeds a limit; ``None``: none does."""
        over = np.flatnonzero(self.sum_wh > limit_wh)
        return max(int(over[0]) - 1, 0) if len(over) else None

    def lead_s(self, time_s: float, used_wh: float, available_wh: float) -> float | None:
        """Return the time from a point of the flight to the point of no return. [s]

        The point is passed at ``time_s`` [s] with ``used_wh`` used, and ``available_wh`` may be used from
        there on [Wh].  ``None`` where there is no such point ahead, 0 where the next is beyond it already.
        """
        ahead = np.flatnonzero(self.time_s > time_s)
        short_wh = self.sum_wh[ahead] - used_wh - available_wh
        first = np.flatnonzero(short_wh > 0.0)[:1]
        if not len(first):
            return None
        if first[0] == 0:
            return 0.0
        rows = slice(first[0] - 1, first[0] + 1)
        return float(np.interp(0.0, short_wh[rows], self.time_s[ahead[rows]])) - time_s

    def at(self, row: int) -> tuple[int, float]:
        """Return the segment and the fraction of its time of a row."""
        return int(self.segment[row]), float(self.fraction[row])


def sweep_returns(returns: Returns, *limits_wh: float) -> ReturnSweep | None:
    """Return a sweep that holds the tightest point, and the points of no return for limits [Wh].

    ``None`` with no point in the air.  Segments of the take-off and of stages that land are left out: there
    the vehicle stands still, or lands where it is going anyway, and the energy of the whole flight decides.
    """
    [sweep] = sweep_returns_each(returns, [limits_wh])
    return sweep


def sweep_returns_each(
    returns: Returns, limits_wh: Sequence[tuple[float, ...]]
) -> Sequence[ReturnSweep | None]:
    """Return a sweep for each of several groups of limits, as `sweep_returns`."""
    if returns.sampled is None:
        return [None] * len(limits_wh)
    asked = [_Refinement.of(returns, [one for one in group if one > 0.0]) for group in limits_wh]
    made: dict[Hashable, ReturnSweep] = {}

    def sweep(one: _Refinement) -> ReturnSweep:
        if one.key not in made:
            made.update(_refined_each(returns, {one.key: one for one in asked}))
        return made[one.key]

    return [returns.recalled(one.key, partial(sweep, one)) for one in asked]


def plan_returns(
    returns: Returns,
    sweeps: Sequence[ReturnSweep | None],
    batteries: Sequence[BatteryBudget | None],
) -> list[ReturnPlan | None]:
    """Return the returns from where they are tightest, against what batteries hold, if that is known."""
    drafts = [
        None if sweep is None else (sweep, *_planned_rows(sweep, battery))
        for sweep, battery in zip(sweeps, batteries, strict=True)
    ]
    at = dict.fromkeys(sweep.at(row) for sweep, _, rows in filter(None, drafts) for row in rows)
    points = dict(zip(at, returns.flight_points(tuple(at)), strict=True)) if at else {}
    plans: list[ReturnPlan | None] = []
    for draft in drafts:
        if draft is None:
            plans.append(None)
            continue
        sweep, margin_wh, (row, *last_rows) = draft
        last = [points[sweep.at(one)] for one in last_rows]
        plans.append(
            ReturnPlan(
                tightest_item=returns.route.stages[returns.segment_stage[sweep.segment[row]]].item,
                energy_home_wh=float(sweep.return_wh[row]),
                margin_wh=margin_wh,
                tightest=points[sweep.at(row)],
                time_home_s=float(sweep.return_s[row]),
                destination=int(sweep.destination[row]),
                last_return=next(iter(last), None),
                last_return_empty=next(iter(last[1:]), None),
            )
        )
    return plans


def _planned_rows(
    sweep: ReturnSweep, battery: BatteryBudget | None
) -> tuple[float | None, list[int]]:
    """Return what is left above the reserve after the tightest return, and the rows of a plan. [Wh]

    The first is the tightest; the points of no return are behind it.
    """
    row = sweep.tightest
    if battery is None:
        return None, [row]
    needed_wh = float(sweep.sum_wh[row])
    margin_wh = battery.above_reserve_wh - needed_wh
    if abs(margin_wh) <= _ALIKE * needed_wh:
        margin_wh = 0.0  # an error of rounding is no shortfall
    if margin_wh >= 0.0:
        return margin_wh, [row]
    last_rows = map(sweep.last_below, return_limits_wh(battery))
    # All return where more is used.
    return margin_wh, [row, *(one for one in last_rows if one is not None)]


def return_limits_wh(battery: BatteryBudget | None) -> tuple[float, ...]:
    """Return the energies that returns are held against: above the reserve, and all. [Wh]"""
    return () if battery is None else (battery.above_reserve_wh, battery.usable_wh)


class _CoarseSweep(Value, eq=False):
    """A sweep before it is refined, and what between its n points may hide, whatever the limits."""

    sweep: ReturnSweep
    used_wh: FloatArray
    """By the flight from each point to the next. (n - 1,) [Wh]"""
    bound_wh: FloatArray
    """Above the sum anywhere between them; nothing where the flight does not continue. (n - 1,) [Wh]"""
    along: BoolArray
    """Whether one line is flown between them, and returns lead to one place. (n - 1,)"""
    off_wh: FloatArray
    """How far a point is off the straight between those before and after it on its line. (n - 2,) [Wh]"""

    @classmethod
    def of(cls, returns: Returns, segment: IntArray, fraction: FloatArray) -> Self:
        """Return the sample of the returns with further points."""
        if len(segment):
            flown = returns.sample_and(returns.points(*in_order(segment, fraction)))
            sweep = _merged(*map(_swept, flown))
        else:
            assert returns.sample is not None
            sweep = _swept(returns.sample)
        sum_wh, used_wh = sweep.sum_wh, sweep.used_wh[1:] - sweep.used_wh[:-1]
        unbroken, destination = returns_unbroken(returns)[sweep.segment], sweep.destination
        inside = unbroken[1:] == unbroken[:-1]
        bound_wh = np.maximum(sum_wh[:-1], sum_wh[1:]) + used_wh

        ends = returns.line_ends
        line: IntArray = np.cumsum(ends) - ends
        is_end = ends[sweep.segment] & (sweep.fraction >= 1.0)
        along = np.asarray((line[sweep.segment] + is_end)[:-1] == line[sweep.segment[1:]])
        along &= destination[1:] == destination[:-1]
        way_m = lengths(sweep.stop_m[1:] - sweep.stop_m[:-1])
        after_wh = wh_from_j(summed(sweep.after_stop_j))
        part = quotient(way_m[:-1], way_m[:-1] + way_m[1:], 0.5)
        off_wh = np.abs(after_wh[:-2] + part * (after_wh[2:] - after_wh[:-2]) - after_wh[1:-1])
        return cls(
            sweep=sweep,
            used_wh=used_wh,
            bound_wh=np.where(inside, bound_wh, -np.inf),
            along=along,
            off_wh=np.where(along[:-1] & along[1:] & ~is_end[1:-1], off_wh, 0.0),
        )

    def parts_between(self, limits_wh: Sequence[float]) -> tuple[IntArray, BoolArray]:
        """Return in how many parts to sweep each stretch between points once more, and where it is even.

        0 parts: not at all.  Returns change evenly along a line but where a height or a wait of them begins
        to count: a point is off the straight there. (n - 1,)
        """
        sum_wh = self.sweep.sum_wh
        most_wh = float(sum_wh.max())
        parts = np.zeros(len(self.used_wh), dtype=np.intp)
        for limit_wh in (most_wh, *limits_wh):
            left = np.flatnonzero(self.bound_wh > limit_wh)
            if limit_wh < most_wh:  # what comes after the limit is exceeded does not matter
                left = left[left < np.argmax(sum_wh > limit_wh)]
            wanted = np.ceil(self.used_wh[left] / (TOLERANCE * limit_wh)).astype(np.intp)
            order = np.argsort(-self.bound_wh[left], kind="stable")
            order = order[np.cumsum(wanted[order]) <= SWEEP_POINTS]
            parts[left[order]] = np.maximum(parts[left[order]], wanted[order])
        is_off = self.off_wh > _UNEVEN * min(most_wh, *limits_wh, math.inf)
        return parts, self.along & ~(np.append(False, is_off) | np.append(is_off, False))


def _swept(flown: FlownReturns) -> ReturnSweep:
    points = flown.points
    return ReturnSweep(
        segment=points.segment,
        fraction=points.fraction,
        time_s=points.time_s,
        destination=flown.destination,
        used_wh=points.used_wh,
        return_wh=flown.energy_wh,
        return_s=flown.time_s,
        stop_wh=points.stop_wh,
        stop_s=points.stop_s,
        stop_m=points.stop_m,
        after_stop_j=flown.state_energy_j,
    )


def _merged(*sweeps: ReturnSweep) -> ReturnSweep:
    every = ReturnSweep.joined(sweeps)
    return every.select(np.lexsort((every.fraction, every.segment)))


class _Refinement(Value, eq=False, dict=True):
    """Where a sweep is to be looked at once more."""

    key: Hashable
    """Of what follows from it."""
    sweep: ReturnSweep
    parts: IntArray
    """As of `_CoarseSweep.parts_between`, like what follows."""
    along: BoolArray

    @classmethod
    def of(cls, returns: Returns, limits_wh: Sequence[float]) -> Self:
        """Return where what limits ask for may hide."""
        spread = spread_up_to(returns, *limits_wh)
        points = tuple(one.tobytes() for one in spread)
        coarse = returns.recalled(points, lambda: _CoarseSweep.of(returns, *spread))
        parts, along = coarse.parts_between(limits_wh)
        key = (points, parts.tobytes(), along.tobytes())
        return cls(key=key, sweep=coarse.sweep, parts=parts, along=along)

    @cached_property
    def even_rows(self) -> IntArray:
        """Rows of the sweep behind which points are interpolated."""
        return np.flatnonzero((self.parts > 1) & self.along)

    def uneven_points(self, returns: Returns) -> FloatArray:
        """Return segments and fractions of points to fly from, where what is between is not even. (m, 2)"""
        sweep, parts = self.sweep, self.parts
        points = [np.zeros((0, 2))]
        for row in np.flatnonzero((parts > 0) & ~self.along).tolist():
            begin_s, end_s = sweep.time_s[row : row + 2]
            even = returns.at(np.linspace(begin_s, end_s, parts[row] + 1)[1:-1])
            ends = thinned(np.arange(sweep.segment[row], sweep.segment[row + 1]), parts[row])
            points += [np.column_stack(even), np.column_stack((ends, np.ones(len(ends))))]
        found = np.concatenate(points)
        return np.column_stack(in_order(*found.T)) if len(found) else found


def _refined_each(
    returns: Returns, asked: Mapping[Hashable, _Refinement]
) -> Iterator[tuple[Hashable, ReturnSweep]]:
    """Yield sweeps with points where what is wanted may hide: along a line interpolated, else flown."""
    of_sweep: dict[int, list[tuple[Hashable, _Refinement]]] = {}
    for key, one in asked.items():
        of_sweep.setdefault(id(one.sweep), []).append((key, one))
    for alike in of_sweep.values():
        sweep = alike[0][1].sweep
        rows = np.concatenate([one.even_rows for _, one in alike])
        parts = [one.parts[one.even_rows] for _, one in alike]
        further = _interpolated(sweep, returns, rows, np.concatenate(parts)) if len(rows) else None
        flown = _flown_each(returns, [one.uneven_points(returns) for _, one in alike])
        end = 0
        for (key, _), own, refined in zip(alike, parts, flown, strict=True):
            begin, end = end, end + int((own - 1).sum())
            between = [] if further is None else [further.select(np.arange(begin, end))]
            yield key, _merged(sweep, *between, *refined)


def _flown_each(
    returns: Returns, points: Sequence[FloatArray]
) -> Iterator[tuple[ReturnSweep, ...]]:
    """Yield the sweeps of groups of points, by segments and fractions, flown as few times as can be."""
    asked = np.concatenate(points)
    if not len(asked):
        yield from [()] * len(points)
        return
    every, row = np.unique(asked, axis=0, return_inverse=True)
    flown = ReturnSweep.joined(
        [
            _swept(returns.flown(returns.points(some[:, 0].astype(np.intp), some[:, 1])))
            for some in np.split(every, range(_AT_ONCE, len(every), _AT_ONCE))
        ]
    )
    end = 0
    for own in points:
        begin, end = end, end + len(own)
        yield (flown.select(row.ravel()[begin:end]),)


def _interpolated(
    sweep: ReturnSweep, returns: Returns, rows: IntArray, parts: IntArray
) -> ReturnSweep:
    """Return points that divide the stretches after rows of a sweep evenly in time into parts.

    From where it has stopped, a vehicle returns as in between of the two ends of its stretch.
    """
    count = parts - 1
    row = rows.repeat(count)
    number = np.arange(1, len(row) + 1) - (count.cumsum() - count).repeat(count)
    part = number / parts.repeat(count)
    time_s = sweep.time_s[row] + part * (sweep.time_s[row + 1] - sweep.time_s[row])
    points = returns.points(*returns.at(time_s))
    way_m = sweep.stop_m[row + 1] - sweep.stop_m[row]
    ahead_m2 = dot(points.stop_m - sweep.stop_m[row], way_m)
    part = quotient(ahead_m2, dot(way_m, way_m), part, above=_SAME_PLACE_M2)
    part = np.minimum(np.maximum(part, 0.0), 1.0)

    def between(ends: FloatArray) -> FloatArray:
        mixed: FloatArray = ends[row].T + part * (ends[row + 1] - ends[row]).T
        return mixed.T

    after_stop_j = between(sweep.after_stop_j)
    return ReturnSweep(
        segment=points.segment,
        fraction=points.fraction,
        time_s=points.time_s,
        destination=sweep.destination[row],
        used_wh=points.used_wh,
        return_wh=points.stop_wh + wh_from_j(summed(after_stop_j)),
        return_s=points.stop_s + between(sweep.return_s - sweep.stop_s),
        stop_wh=points.stop_wh,
        stop_s=points.stop_s,
        stop_m=points.stop_m,
        after_stop_j=after_stop_j,
    )
