"""The point of a flight from which the return is tightest, and the points of no return.

The energy used by a point of a flight and that of the return from there are summed over a sweep of points.
Between two points the sum grows by little more than the flight uses there, so a tighter point, or an earlier
point of no return, than the sweep has found can hide in few places.  These are swept once more, finer.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.flight.returns.path import thinned
from planner.flight.returns.sample import SWEEP_POINTS, in_order, returns_unbroken, spread_by_energy
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.budget import BatteryBudget
    from planner.flight.returns.path import FlightPoint, FlownReturns, Returns

TOLERANCE = 5e-4
"""Energy used between points of the refinement, over the energy looked for: half of the 0.1 % by which a
point may be tighter than the one found. [-]"""
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


class ReturnSweep(Columns, eq=False):
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
    after_stop_j: FloatArray
    """Energy of that to return and land, by state. (n, states) [J]"""

    @property
    def sum_wh(self) -> FloatArray:
        """Energy used by the time the vehicle has landed. (n,) [Wh]"""
        return self.used_wh + self.return_wh

    @property
    def tightest(self) -> int:
        """The row from which the return is tightest."""
        # Braking to a stop is as tight all along: its end, where the vehicle stands still, is reported.
        sum_wh = self.sum_wh
        return int(np.flatnonzero(sum_wh >= sum_wh.max() * (1.0 - _ALIKE))[-1])

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
    sample = returns.sample
    if sample is None:
        return None
    limits_wh = tuple(limit_wh for limit_wh in limits_wh if limit_wh > 0.0)
    sweep = _swept(sample)
    spread = spread_by_energy(returns, *limits_wh)
    if len(spread[0]):
        sweep = _with(sweep, returns, *spread)
    segment, fraction = _between(returns, sweep, limits_wh)
    return _with(sweep, returns, segment, fraction) if len(segment) else sweep


def plan_return(returns: Returns, sweep: ReturnSweep, battery: BatteryBudget | None) -> ReturnPlan:
    """Return the return from where it is tightest, against what the battery holds, if that is known."""
    row = sweep.tightest
    needed_wh = float(sweep.sum_wh[row])
    margin_wh = None if battery is None else battery.above_reserve_wh - needed_wh
    if margin_wh is not None and abs(margin_wh) <= _ALIKE * needed_wh:
        margin_wh = 0.0  # an error of rounding is no shortfall
    last, empty = (
        None if at is None else returns.flight_point(*sweep.at(at))
        for at in (
            map(sweep.last_below, return_limits_wh(battery))
            if margin_wh is not None and margin_wh < 0.0
            else (None, None)
        )
    )
    return ReturnPlan(
        tightest_item=returns.route.stages[returns.segment_stage[sweep.segment[row]]].item,
        energy_home_wh=float(sweep.return_wh[row]),
        margin_wh=margin_wh,
        tightest=returns.flight_point(*sweep.at(row)),
        time_home_s=float(sweep.return_s[row]),
        destination=int(sweep.destination[row]),
        last_return=last,
        last_return_empty=empty,
    )


def return_limits_wh(battery: BatteryBudget | None) -> tuple[float, ...]:
    """Return the energies that returns are held against: above the reserve, and all. [Wh]"""
    return () if battery is None else (battery.above_reserve_wh, battery.usable_wh)


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
        after_stop_j=flown.state_energy_j,
    )


def _with(
    sweep: ReturnSweep, returns: Returns, segment: IntArray, fraction: FloatArray
) -> ReturnSweep:
    """Return a sweep and further points, in flown order."""
    points = returns.points(*in_order(segment, fraction))
    both = ReturnSweep.joined([sweep, _swept(returns.flown(points))])
    return both.select(np.lexsort((both.fraction, both.segment)))


def _between(
    returns: Returns, sweep: ReturnSweep, limits_wh: tuple[float, ...]
) -> tuple[IntArray, FloatArray]:
    """Return points between those of a sweep where what is wanted may hide."""
    sum_wh, used_wh = sweep.sum_wh, np.diff(sweep.used_wh)
    bound_wh = np.maximum(sum_wh[:-1], sum_wh[1:]) + used_wh
    inside = np.diff(returns_unbroken(returns)[sweep.segment]) == 0
    parts = np.zeros(len(used_wh))
    for limit_wh in (float(sum_wh.max()), *limits_wh):
        over = np.flatnonzero(sum_wh > limit_wh)
        hides = inside & (bound_wh > limit_wh)
        if len(over):  # what comes after the limit is exceeded does not matter
            hides[over[0] :] = False
        left = np.flatnonzero(hides)
        wanted = np.ceil(used_wh / (TOLERANCE * limit_wh))
        left = left[np.argsort(-bound_wh[left], kind="stable")]
        left = left[np.cumsum(wanted[left]) <= SWEEP_POINTS]
        parts[left] = np.maximum(parts[left], wanted[left])
    segments: list[IntArray] = [np.zeros(0, dtype=np.intp)]
    fractions: list[FloatArray] = [np.zeros(0)]
    for row in np.flatnonzero(parts).tolist():
        begin_s, end_s = sweep.time_s[row : row + 2]
        even, fraction = returns.at(np.linspace(begin_s, end_s, int(parts[row]) + 1)[1:-1])
        ends = thinned(np.arange(sweep.segment[row], sweep.segment[row + 1]), int(parts[row]))
        segments += [even, ends]
        fractions += [fraction, np.ones(len(ends))]
    return np.concatenate(segments), np.concatenate(fractions)
