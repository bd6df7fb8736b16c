"""The closest approach of two vehicles in continuous time, at every shift of their starts.

Nothing is sampled.  Each trajectory is a row of cubics of time; a cell is a part of the one beside a
part of the other.  In a cell both are taken for straight and even, which makes the squared distance a
convex quadratic of the two times: its least value is exact, and off by no more than the cubics are
from their chords.  Cells that are thereby too far apart are discarded, the others divided until
nothing is off by more than :data:`STRAIGHT_TOLERANCE_M`.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.trajectory import part_of_cubic
from planner.flight.motion.kinematics import Columns
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.fleet.trajectory import Trajectory

ACCURACY_M = 0.01
"""A closest approach is found to this, and never reported farther than it is. [m]"""
STRAIGHT_TOLERANCE_M = 0.002
"""With twice the error of the cubics, twice this is the accuracy. [m]"""
_MOST_ROUNDS = 60
_BLOCK = 1_000_000
"""Cells that are looked at together."""


class ClosestApproach(Value):
    """Where two vehicles come nearest to each other."""

    distance_m: float
    """No more than the distance, and less by the accuracy asked for at most. [m]"""
    first_s: float
    """Time since the start of the first; negative before it. [s]"""
    second_s: float
    """The same of the second. [s]"""
    first_item: int
    second_item: int


class _Side(Columns, eq=False):
    """One vehicle's parts in a row of cells."""

    part: IntArray
    start_s: FloatArray
    end_s: FloatArray
    control_m: FloatArray

    def within(self, least_s: FloatArray, most_s: FloatArray) -> _Side:
        """Return the parts between times, which overlap with their own."""
        width_s = np.maximum(self.end_s - self.start_s, 1e-12)
        start_s, end_s = np.maximum(self.start_s, least_s), np.minimum(self.end_s, most_s)
        cut = np.flatnonzero((start_s > self.start_s) | (end_s < self.end_s))
        control_m = self.control_m.copy()
        control_m[cut] = part_of_cubic(
            control_m[cut],
            ((start_s - self.start_s) / width_s)[cut],
            ((end_s - self.start_s) / width_s)[cut],
        )
        return replace(self, start_s=start_s, end_s=end_s, control_m=control_m)

    def halves(self, divided: BoolArray) -> _Side:
        """Return every part twice: its halves where it is divided, else the whole of it."""
        twice = self.select(np.repeat(np.arange(len(self.part)), 2))
        middle_s = np.repeat(np.where(divided, 0.5 * (self.start_s + self.end_s), np.nan), 2)
        is_second = np.arange(len(middle_s)) % 2 == 1
        return twice.within(
            np.where(is_second & ~np.isnan(middle_s), middle_s, -np.inf),
            np.where(is_second | np.isnan(middle_s), np.inf, middle_s),
        )

    @property
    def bend_m(self) -> FloatArray:
        """How far each cubic is from even motion along its chord. (n,) [m]

        The inner Bernstein polynomials of degree 3 add up to 3/4 at most.
        """
        p0, p1, p2, p3 = np.moveaxis(self.control_m, 1, 0)
        one, two = p1 - (2.0 * p0 + p3) / 3.0, p2 - (p0 + 2.0 * p3) / 3.0
        squared = np.maximum(np.sum(one**2, axis=1), np.sum(two**2, axis=1))
        return np.asarray(0.75 * np.sqrt(squared))


def closest_approach(
    first: Trajectory,
    second: Trajectory,
    *,
    second_later_s: float = 0.0,
    shift_s: float = 0.0,
    second_above_m: float = 0.0,
    within_m: float = np.inf,
    accuracy_m: float = ACCURACY_M,
) -> ClosestApproach | None:
    """Return the closest approach of two vehicles while not both are near the ground.

    ``None`` where they do not come so near, or where never one of both flies.

    Parameters
    ----------
    first, second : Trajectory
        In one frame.
    second_later_s : float
        Start of the second after that of the first. [s]
    shift_s : float
        The second may start so much sooner or later than that; all of these starts count. [s]
    second_above_m : float
        Home of the second above that of the first. [m]
    within_m : float
        What is not nearer is not looked for. [m]
    accuracy_m : float
        How much less than the distance is good enough where they certainly come so near; two in
        formation take many times as long to 1 cm as to 1 m. [m]
    """
    cells = _cells(
        first,
        second,
        later_s=second_later_s,
        shift_s=shift_s,
        above_m=second_above_m,
        within_m=within_m,
    )
    one, two = (
        _Side(
            part=part,
            start_s=side.start_s[part],
            end_s=side.end_s[part],
            control_m=side.control_m[part],
        )
        for side, part in zip((first, second), cells, strict=True)
    )
    two.control_m[..., 2] += second_above_m
    limit_m = within_m
    best: ClosestApproach | None = None
    for _ in range(_MOST_ROUNDS):
        one, two = _side_by_side(one, two, second_later_s, shift_s)
        near = np.flatnonzero(_box_distance_m(one.control_m, two.control_m) < limit_m)
        one, two = one.select(near), two.select(near)
        if not len(near):
            break
        distance_m, first_s, second_s = _straight_approach(one, two, second_later_s, shift_s)
        bends_m = one.bend_m, two.bend_m
        cubic_m = first.error_m[one.part] + second.error_m[two.part]
        off_m = bends_m[0] + bends_m[1]
        least_m = np.maximum(distance_m - off_m - cubic_m, 0.0)
        limit_m = min(limit_m, float(np.min(distance_m + off_m + cubic_m)))
        is_done = off_m <= STRAIGHT_TOLERANCE_M
        if limit_m < within_m:
            is_done |= least_m >= limit_m - accuracy_m
        if is_done.any():
            at = int(np.flatnonzero(is_done)[np.argmin(least_m[is_done])])
            if least_m[at] < min(within_m, np.inf if best is None else best.distance_m):
                best = ClosestApproach(
                    distance_m=float(least_m[at]),
                    first_s=float(first_s[at]),
                    second_s=float(second_s[at]),
                    first_item=int(first.item[one.part[at]]),
                    second_item=int(second.item[two.part[at]]),
                )
        rest = np.flatnonzero(~is_done & (least_m < limit_m))
        is_first = bends_m[0][rest] >= bends_m[1][rest]
        one, two = one.select(rest).halves(is_first), two.select(rest).halves(~is_first)
    return best


def _cells(
    first: Trajectory,
    second: Trajectory,
    *,
    later_s: float,
    shift_s: float,
    above_m: float,
    within_m: float,
) -> tuple[IntArray, IntArray]:
    """Return the parts of both that may be near each other at the same time, one of them flown."""
    above = np.array([0.0, 0.0, above_m])
    gap = np.maximum(
        second.low_m.min(axis=0) + above - first.high_m.max(axis=0),
        first.low_m.min(axis=0) - second.high_m.max(axis=0) - above,
    )
    if np.linalg.norm(np.maximum(gap, 0.0)) >= within_m:
        return np.zeros(0, np.intp), np.zeros(0, np.intp)
    low = np.searchsorted(second.end_s, first.start_s - later_s - shift_s, side="left")
    high = np.searchsorted(second.start_s, first.end_s - later_s + shift_s, side="right")
    count = np.maximum(high - low, 0)
    found = []
    # In blocks: with starts as uncertain as the flights are long every part may meet every other.
    for block in np.split(
        np.arange(len(count)), np.flatnonzero(np.diff(np.cumsum(count) // _BLOCK)) + 1
    ):
        own = count[block]
        one = np.repeat(block, own)
        two = np.arange(len(one)) - np.repeat(np.cumsum(own) - own - low[block], own)
        # Where both are at rest they are as far apart as at the end of the later flight.
        kept = ~(first.is_low[one] & second.is_low[two])
        kept &= ~(first.is_rest[one] & second.is_rest[two])
        for axis in range(3):
            one, two = one[kept], two[kept]
            below = second.low_m[two, axis] + above[axis] - first.high_m[one, axis]
            over = first.low_m[one, axis] - second.high_m[two, axis] - above[axis]
            kept = (below < within_m) & (over < within_m)
        found.append((one[kept], two[kept]))
    ones, twos = zip(*found, strict=True)
    return np.concatenate(ones), np.concatenate(twos)


def _side_by_side(one: _Side, two: _Side, later_s: float, shift_s: float) -> tuple[_Side, _Side]:
    """Return the parts of cells that can be flown at the same time."""
    together = np.flatnonzero(
        (one.start_s - later_s - shift_s <= two.end_s)
        & (two.start_s <= one.end_s - later_s + shift_s)
    )
    one, two = one.select(together), two.select(together)
    return (
        one.within(two.start_s + later_s - shift_s, two.end_s + later_s + shift_s),
        two.within(one.start_s - later_s - shift_s, one.end_s - later_s + shift_s),
    )


def _box_distance_m(one_m: FloatArray, two_m: FloatArray) -> FloatArray:
    """Return how far the boxes about control points are apart. (n,) [m]"""
    gap = np.maximum(one_m.min(axis=1) - two_m.max(axis=1), two_m.min(axis=1) - one_m.max(axis=1))
    return np.asarray(np.sqrt(np.sum(np.maximum(gap, 0.0) ** 2, axis=1)))


def _straight_approach(
    one: _Side, two: _Side, later_s: float, shift_s: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Return the least distance of even straight motions, and both times of it. (n,) [m, s, s]

    With the times s and r since the beginning of either part the vector between both is
    :math:`p + v s - w r`.  Its square is convex; over the polygon :math:`0 \le s \le S`,
    :math:`0 \le r \le R`, :math:`|s - r + c| \le` shift, it is least where its gradient vanishes or
    on one of the six edges, along each of which it is a parabola.
    """
    width_1, width_2 = one.end_s - one.start_s, two.end_s - two.start_s
    v = (one.control_m[:, 3] - one.control_m[:, 0]) / np.maximum(width_1, 1e-12)[:, None]
    w = (two.control_m[:, 3] - two.control_m[:, 0]) / np.maximum(width_2, 1e-12)[:, None]
    p = one.control_m[:, 0] - two.control_m[:, 0]
    apart_s = one.start_s - later_s - two.start_s
    vv, ww, vw, pv, pw = (
        np.sum(a * b, axis=1) for a, b in ((v, v), (w, w), (v, w), (p, v), (p, w))
    )
    zero = np.zeros(len(p))
    tries: list[tuple[FloatArray, FloatArray]] = []
    determinant = vv * ww - vw**2
    crossing = determinant > 1e-12 * vv * ww
    safe = np.where(crossing, determinant, 1.0)
    s, r = (pw * vw - pv * ww) / safe, (pw * vv - pv * vw) / safe
    inside = crossing & (s >= 0.0) & (s <= width_1) & (r >= 0.0) & (r <= width_2)
    inside &= np.abs(s - r + apart_s) <= shift_s
    tries.append((np.where(inside, s, np.nan), r))
    for fixed in (zero, width_1):  # along an edge of s: r is free
        best = np.divide(pw + vw * fixed, ww, out=zero.copy(), where=ww > 0.0)
        low = np.maximum(0.0, fixed + apart_s - shift_s)
        high = np.minimum(width_2, fixed + apart_s + shift_s)
        tries.append((np.where(low <= high, fixed, np.nan), np.clip(best, low, high)))
    for fixed in (zero, width_2):
        best = np.divide(vw * fixed - pv, vv, out=zero.copy(), where=vv > 0.0)
        low = np.maximum(0.0, fixed - apart_s - shift_s)
        high = np.minimum(width_1, fixed - apart_s + shift_s)
        tries.append((np.where(low <= high, np.clip(best, low, high), np.nan), fixed))
    relative = v - w
    squared = np.sum(relative**2, axis=1)
    for shift in {-shift_s, shift_s}:  # along a shift: r = s + c
        ahead = apart_s + shift
        at = p - w * ahead[:, None]
        best = np.divide(
            -np.sum(at * relative, axis=1), squared, out=zero.copy(), where=squared > 0.0
        )
        low, high = np.maximum(0.0, -ahead), np.minimum(width_1, width_2 - ahead)
        s = np.where(low <= high, np.clip(best, low, high), np.nan)
        tries.append((s, s + ahead))
    times = np.array(tries)
    gaps = p + times[:, 0, :, None] * v - times[:, 1, :, None] * w
    distances = np.sqrt(np.sum(gaps**2, axis=2))
    distances[np.isnan(distances)] = np.inf
    found = np.argmin(distances, axis=0)
    every = np.arange(len(found))
    return (
        distances[found, every],
        one.start_s + times[found, 0, every],
        two.start_s + times[found, 1, every],
    )
