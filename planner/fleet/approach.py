"""The closest approach of two vehicles in continuous time, at every shift of their starts.

Nothing is sampled.  Each trajectory is a row of cubics of time; a cell is a part of the one beside a
part of the other.  In a cell both are taken for straight and even, which makes the squared distance a
convex quadratic of the two times: its least value is exact, and off by no more than the cubics are
from their chords.  Cells that are thereby too far apart are discarded, the others divided until
nothing is off by more than :data:`STRAIGHT_TOLERANCE_M`.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.trajectory import part_of_cubic
from planner.flight.motion.kinematics import Columns, dot, lengths
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


class Cylinder(Value):
    """What two vehicles keep apart by: beside each other, or one above the other."""

    horizontal_m: float
    over_m: float
    """Height kept where the second is above the first; infinite: none is enough. [m]"""
    under_m: float
    """Height kept where it is below. [m]"""

    is_on_ground: bool = False
    """Whether it is kept while both are near the ground, instead of while one flies."""

    def of_height_m(self, above_m: FloatArray) -> FloatArray:
        """Return what a height of the second above the first counts as, beside each other. [m]"""
        return np.maximum(above_m * self._per_over, -above_m * self._per_under)

    @property
    def _per_over(self) -> float:
        return self.horizontal_m / self.over_m

    @property
    def _per_under(self) -> float:
        return self.horizontal_m / self.under_m

    @property
    def steepest(self) -> float:
        """What an error of height counts as, at most. [-]"""
        return max(self._per_over, self._per_under)


class ClosestApproach(Value):
    """Where two vehicles come nearest to each other."""

    distance_m: float
    """No more than the distance, and less by the accuracy asked for at most; for a cylinder heights
    count as many times as it is flatter, and what the parts are grown by is taken off. [m]"""
    first_s: float
    """Time since the start of the first; negative before it. [s]"""
    second_s: float
    """The same of the second. [s]"""
    first_item: int
    second_item: int
    beside_m: float = 0.0
    """Level distance then. [m]"""
    above_m: float = 0.0
    """Height of the second above the first then. [m]"""
    grown_m: float = 0.0
    """What the parts that are flown then are grown by. [m]"""


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
    def box_m(self) -> tuple[FloatArray, FloatArray]:
        """Lowest and highest coordinates of the control points, between which a part stays. (n, 3) [m]"""
        p0, p1, p2, p3 = np.moveaxis(self.control_m, 1, 0)
        return (
            np.minimum(np.minimum(p0, p1), np.minimum(p2, p3)),
            np.maximum(np.maximum(p0, p1), np.maximum(p2, p3)),
        )

    @property
    def bend_m(self) -> FloatArray:
        """How far each cubic is from even motion along its chord. (n,) [m]

        The inner Bernstein polynomials of degree 3 add up to 3/4 at most.
        """
        p0, p1, p2, p3 = np.moveaxis(self.control_m, 1, 0)
        one, two = p1 - (2.0 * p0 + p3) / 3.0, p2 - (p0 + 2.0 * p3) / 3.0
        squared = np.maximum(dot(one, one), dot(two, two))
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
    zone: Cylinder | None = None,
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
        What is not nearer is not looked for; the radius of a zone by default. [m]
    accuracy_m : float
        How much less than the distance is good enough where they certainly come so near; two in
        formation take many times as long to 1 cm as to 1 m. [m]
    zone : Cylinder, optional
        What they keep apart by; without it they keep a distance in space.
    """
    meeting = Meeting(
        first=first,
        second=second,
        later_s=second_later_s,
        shift_s=shift_s,
        above_m=second_above_m,
        zone=zone,
    )
    if zone is not None:
        within_m = min(within_m, zone.horizontal_m)
    one, two = meeting.sides(within_m)
    limit_m = within_m
    best: ClosestApproach | None = None
    for _ in range(_MOST_ROUNDS):
        one, two = meeting.near(one, two, limit_m)
        if not len(one.part):
            break
        bounds = meeting.bounds(one, two)
        limit_m = min(limit_m, float(np.min(bounds.most_m)))
        is_done = bounds.is_exact
        if limit_m < within_m:
            is_done = is_done | (bounds.least_m >= limit_m - accuracy_m)
        if is_done.any():
            at = int(np.flatnonzero(is_done)[np.argmin(bounds.least_m[is_done])])
            if bounds.least_m[at] < min(within_m, np.inf if best is None else best.distance_m):
                best = meeting.approach(one, two, bounds, at)
        open_ = ~is_done & (bounds.least_m < limit_m)
        if not open_.any():
            break
        one, two = bounds.divided(one, two, open_)
    return best


def groups_within(meeting: Meeting, group: IntArray, within_m: float) -> BoolArray:
    """Return which groups of the first's parts come nearer to the second than they may, or may do so.

    ``group`` is that of each of the first's parts, counted from 0.  Certain to the accuracy: a group that is
    nearer is always among them.
    """
    found = np.zeros(int(group.max(initial=-1)) + 1, np.bool_)
    one, two = meeting.sides(within_m)
    for _ in range(_MOST_ROUNDS):
        one, two = meeting.near(one, two, within_m)
        if not len(one.part):
            break
        bounds = meeting.bounds(one, two)
        is_near = bounds.is_exact | (bounds.most_m < within_m)
        found[group[one.part[is_near & (bounds.least_m < within_m)]]] = True
        open_ = ~bounds.is_exact & (bounds.least_m < within_m) & ~found[group[one.part]]
        one, two = bounds.divided(one, two, open_)
    return found


class _Bounds(Value, eq=False):
    """How near the sides of cells come to each other."""

    least_m: FloatArray
    """No more than the least distance in each cell. (n,) [m]"""
    most_m: FloatArray
    """No less than it. (n,) [m]"""
    is_exact: BoolArray
    """Whether these two are as near to each other as they have to be. (n,)"""
    first_s: FloatArray
    second_s: FloatArray
    sizes: tuple[FloatArray, FloatArray]
    """What makes either side of a cell uncertain: the greater is divided. (n,)"""

    def divided(self, one: _Side, two: _Side, kept: BoolArray) -> tuple[_Side, _Side]:
        """Return both halves of some cells."""
        rest = np.flatnonzero(kept)
        is_first = self.sizes[0][rest] >= self.sizes[1][rest]
        return one.select(rest).halves(is_first), two.select(rest).halves(~is_first)


class Meeting(Value, eq=False, dict=True):
    """Two vehicles in the air at the same time, and what they keep apart by."""

    first: Trajectory
    second: Trajectory
    later_s: float = 0.0
    """Start of the second after that of the first. [s]"""
    shift_s: float = 0.0
    """The second may start so much sooner or later than that. [s]"""
    above_m: float = 0.0
    """Home of the second above that of the first. [m]"""
    zone: Cylinder | None = None

    def sides(self, within_m: float) -> tuple[_Side, _Side]:
        """Return the cells of parts that may be near each other at the same time."""
        one, two = (
            _Side(
                part=part,
                start_s=side.start_s[part],
                end_s=side.end_s[part],
                control_m=side.control_m[part],
            )
            for side, part in zip((self.first, self.second), self._cells(within_m), strict=True)
        )
        two.control_m[..., 2] += self.above_m
        return one, two

    def near(self, one: _Side, two: _Side, limit_m: float) -> tuple[_Side, _Side]:
        """Return the cells that can be flown at the same time, and in which both may be so near."""
        one, two = _side_by_side(one, two, *self._windows_s(one.part, two.part))
        (low_1_m, high_1_m), (low_2_m, high_2_m) = one.box_m, two.box_m
        gap = np.maximum(low_1_m - high_2_m, low_2_m - high_1_m)
        above = low_2_m[:, 2] > high_1_m[:, 2]
        gap_m = np.maximum(gap, 0.0)
        level_m = np.hypot(gap_m[:, 0], gap_m[:, 1])
        if self.zone is None:
            beside_m = np.maximum(level_m - self._grown_m(one.part, two.part), 0.0)
            box_m = np.hypot(beside_m, gap_m[:, 2])
        else:
            apart_m = np.maximum(gap_m[:, 2] - self._lifted_m(one.part, two.part), 0.0)
            height_m = self.zone.of_height_m(np.where(above, apart_m, -apart_m))
            box_m = np.maximum(level_m - self._grown_m(one.part, two.part), height_m)
        rows = np.flatnonzero(box_m < limit_m)
        return one.select(rows), two.select(rows)

    def bounds(self, one: _Side, two: _Side) -> _Bounds:
        """Return how near the sides of cells come to each other."""
        bends_m = one.bend_m, two.bend_m
        cubic_m = self.first.error_m[one.part] + self.second.error_m[two.part]
        off_m = bends_m[0] + bends_m[1]
        later_s, shift_s = self._windows_s(one.part, two.part)
        if self.zone is None:
            distance_m, first_s, second_s = _straight_approach(one, two, later_s, shift_s, axes=3)
            least_m = distance_m - off_m
            grown_m = self._grown_m(one.part, two.part)
            if grown_m.any():  # beside each other alone: no farther than their heights are apart
                heights_m = [side.control_m[..., 2] for side in (one, two)]
                low_m, high_m = (
                    np.stack([f(each, axis=1) for each in heights_m]) for f in (np.min, np.max)
                )
                apart_m = np.maximum(low_m - high_m[::-1], 0.0).max(axis=0)
                least_m = np.maximum(least_m - grown_m, np.minimum(apart_m, least_m))
            return _Bounds(
                least_m=np.maximum(least_m - cubic_m, 0.0),
                most_m=distance_m + off_m + cubic_m,
                is_exact=off_m <= STRAIGHT_TOLERANCE_M,
                first_s=first_s,
                second_s=second_s,
                sizes=bends_m,
            )
        zone = self.zone
        level_m, first_s, second_s = _straight_approach(one, two, later_s, shift_s, axes=2)
        level_m = level_m - self._grown_m(one.part, two.part)
        low_m, high_m = (side.control_m[..., 2] for side in (one, two))
        # While both are flown at the same times the height between them is even too.
        ends_m = high_m[:, [0, 3]] - low_m[:, [0, 3]]
        is_joint = shift_s == 0.0
        least_above_m = np.where(
            is_joint, ends_m.min(axis=1) - off_m, high_m.min(axis=1) - low_m.max(axis=1)
        )
        most_above_m = np.where(
            is_joint, ends_m.max(axis=1) + off_m, high_m.max(axis=1) - low_m.min(axis=1)
        )
        lifted_m = self._lifted_m(one.part, two.part)
        nearest_m = np.clip(0.0, least_above_m - lifted_m, most_above_m + lifted_m)
        above_m = (_chord_m(two, second_s) - _chord_m(one, first_s))[:, 2]
        above_m = np.sign(above_m) * np.maximum(np.abs(above_m) - lifted_m, 0.0)
        steepest = zone.steepest
        off_height_m, cubic_m = off_m * steepest, cubic_m * max(1.0, steepest)
        least_m = np.maximum(level_m - off_m, zone.of_height_m(nearest_m)) - cubic_m
        most_m = np.maximum(level_m + off_m, zone.of_height_m(above_m) + off_height_m) + cubic_m
        climbs = (np.ptp(low_m, axis=1) * steepest, np.ptp(high_m, axis=1) * steepest)
        return _Bounds(
            least_m=np.maximum(least_m, 0.0),
            most_m=most_m,
            is_exact=most_m - least_m - 2.0 * cubic_m
            <= 2.0 * STRAIGHT_TOLERANCE_M * max(1.0, steepest),
            first_s=first_s,
            second_s=second_s,
            sizes=(bends_m[0] + climbs[0], bends_m[1] + climbs[1]),
        )

    def approach(self, one: _Side, two: _Side, bounds: _Bounds, row: int) -> ClosestApproach:
        """Return how near the sides of one cell come."""
        rows = np.array([row])
        one, two = one.select(rows), two.select(rows)
        first_s, second_s = bounds.first_s[rows], bounds.second_s[rows]
        between_m = (_chord_m(two, second_s) - _chord_m(one, first_s))[0]
        return ClosestApproach(
            distance_m=float(bounds.least_m[row]),
            first_s=float(first_s[0]),
            second_s=float(second_s[0]),
            first_item=int(self.first.item[one.part[0]]),
            second_item=int(self.second.item[two.part[0]]),
            beside_m=float(np.hypot(*between_m[:2])),
            above_m=float(between_m[2]),
            grown_m=float(self._grown_m(one.part, two.part)[0]),
        )

    def late_s(self, one: IntArray, two: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return how much later, and how much sooner, the second may be beside parts. (n,), (n,) [s]

        Two alike are late by the same at the same place: only what one loses beyond the other counts.
        """
        first, second = self.first.late_s[one], self.second.late_s[two]
        later_s, sooner_s = second[:, 1], first[:, 1]
        if self._are_alike:
            later_s = np.maximum(later_s - first[:, 0], 0.0)
            sooner_s = np.maximum(sooner_s - second[:, 0], 0.0)
        return later_s + self.second.longer_s[two], sooner_s + self.first.longer_s[one]

    @cached_property
    def _are_alike(self) -> bool:
        one, two = self.first.pace, self.second.pace
        return one is not None and two is not None and one.is_that_of(two)

    def _windows_s(self, one: IntArray, two: IntArray) -> tuple[FloatArray, FloatArray]:
        """Return how much later the second starts beside parts, and how much sooner or later than that. (n,)

        Parts that may be late count as half of it later, and so much sooner or later. (n,) [s], [s]
        """
        later_s, sooner_s = self.late_s(one, two)
        slack_s = self.shift_s + self.first.slack_s[one] + self.second.slack_s[two]
        return self.later_s + 0.5 * (later_s - sooner_s), slack_s + 0.5 * (later_s + sooner_s)

    def _grown_m(self, one: IntArray, two: IntArray) -> FloatArray:
        return self.first.grown_m[one] + self.second.grown_m[two]

    def _lifted_m(self, one: IntArray, two: IntArray) -> FloatArray:
        return self.first.lifted_m[one] + self.second.lifted_m[two]

    def _cells(self, within_m: float) -> tuple[IntArray, IntArray]:
        """Return the parts of both that may be near each other at the same time, one of them flown."""
        first, second = self.first, self.second
        above = np.array([0.0, 0.0, self.above_m])
        reach_m = np.array([within_m, within_m, within_m])
        reach_m[:2] += first.widest_m + second.widest_m
        down_m = within_m
        if self.zone is not None:
            lifted_m = float(first.lifted_m.max() + second.lifted_m.max())
            reach_m[2], down_m = self.zone.over_m + lifted_m, self.zone.under_m + lifted_m
        (low_1_m, high_1_m), (low_2_m, high_2_m) = first.box_m, second.box_m
        gap = np.maximum(
            low_2_m + above - high_1_m - reach_m,
            low_1_m - high_2_m - above - [*reach_m[:2], down_m],
        )
        if (gap >= 0.0).any():
            return np.zeros(0, np.intp), np.zeros(0, np.intp)
        slack_s = self.shift_s + first.slack_s + float(second.slack_s.max())
        latest_s = first.late_s[:, 1] + first.longer_s
        soonest_s = first.start_s - self.later_s - slack_s - second.latest_s
        latest_s += first.end_s - self.later_s + slack_s
        low = np.searchsorted(second.end_s, soonest_s, side="left")
        high = np.searchsorted(second.start_s, latest_s, side="right")
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
            kept = ~(first.is_rest[one] & second.is_rest[two])
            both_low = first.is_low[one] & second.is_low[two]
            kept &= both_low if self.zone is not None and self.zone.is_on_ground else ~both_low
            for axis in range(3):
                one, two = one[kept], two[kept]
                below = second.low_m[two, axis] + above[axis] - first.high_m[one, axis]
                over = first.low_m[one, axis] - second.high_m[two, axis] - above[axis]
                kept = (below < reach_m[axis]) & (over < (down_m if axis == 2 else reach_m[axis]))
            found.append((one[kept], two[kept]))
        ones, twos = zip(*found, strict=True)
        return np.concatenate(ones), np.concatenate(twos)


def _side_by_side(
    one: _Side, two: _Side, later_s: FloatArray, shift_s: FloatArray
) -> tuple[_Side, _Side]:
    """Return the parts of cells that can be flown at the same time."""
    together = np.flatnonzero(
        (one.start_s - later_s - shift_s <= two.end_s)
        & (two.start_s <= one.end_s - later_s + shift_s)
    )
    one, two, later_s, shift_s = (
        one.select(together),
        two.select(together),
        later_s[together],
        shift_s[together],
    )
    return (
        one.within(two.start_s + later_s - shift_s, two.end_s + later_s + shift_s),
        two.within(one.start_s - later_s - shift_s, one.end_s - later_s + shift_s),
    )


def _chord_m(side: _Side, time_s: FloatArray) -> FloatArray:
    """Return the places on the chords of parts at times. (n, 3) [m]"""
    width_s = np.maximum(side.end_s - side.start_s, 1e-12)
    fraction = ((time_s - side.start_s) / width_s)[:, None]
    return side.control_m[:, 0] + fraction * (side.control_m[:, 3] - side.control_m[:, 0])


def _straight_approach(
    one: _Side, two: _Side, later_s: FloatArray, shift_s: FloatArray, *, axes: int
) -> tuple[FloatArray, FloatArray, FloatArray]:
    r"""Return the least distance of even straight motions, and both times of it. (n,) [m, s, s]

    With the times s and r since the beginning of either part the vector between both is
    :math:`p + v s - w r`.  Its square is convex; over the polygon :math:`0 \le s \le S`,
    :math:`0 \le r \le R`, :math:`|s - r + c| \le` shift, it is least where its gradient vanishes or
    on one of the six edges, along each of which it is a parabola.  Without a shift it is a line.
    """
    width_1, width_2 = one.end_s - one.start_s, two.end_s - two.start_s
    one_m, two_m = one.control_m[..., :axes], two.control_m[..., :axes]
    v = (one_m[:, 3] - one_m[:, 0]) / np.maximum(width_1, 1e-12)[:, None]
    w = (two_m[:, 3] - two_m[:, 0]) / np.maximum(width_2, 1e-12)[:, None]
    p = one_m[:, 0] - two_m[:, 0]
    apart_s = one.start_s - later_s - two.start_s
    zero = np.zeros(len(p))
    tries: list[tuple[FloatArray, FloatArray]] = []
    shifts = (-shift_s, shift_s) if shift_s.any() else (zero,)
    if len(shifts) > 1:
        tries += _shifted_tries((v, w, p), (width_1, width_2), apart_s, shift_s)
    relative = v - w
    squared = dot(relative, relative)
    for shift in shifts:  # along a shift: r = s + c
        ahead = apart_s + shift
        at = p - w * ahead[:, None]
        best = np.divide(-dot(at, relative), squared, out=zero.copy(), where=squared > 0.0)
        low, high = np.maximum(0.0, -ahead), np.minimum(width_1, width_2 - ahead)
        s = np.where(low <= high, np.clip(best, low, high), np.nan)
        tries.append((s, s + ahead))
    times = np.array(tries)
    gaps = p + times[:, 0, :, None] * v - times[:, 1, :, None] * w
    distances = lengths(gaps)
    distances[np.isnan(distances)] = np.inf
    found = np.argmin(distances, axis=0)
    every = np.arange(len(found))
    return (
        distances[found, every],
        one.start_s + times[found, 0, every],
        two.start_s + times[found, 1, every],
    )


def _shifted_tries(
    vectors: tuple[FloatArray, FloatArray, FloatArray],
    widths_s: tuple[FloatArray, FloatArray],
    apart_s: FloatArray,
    shift_s: FloatArray,
) -> list[tuple[FloatArray, FloatArray]]:
    """Return the times within the polygon and along its edges of s and of r; NaN: outside of it."""
    (v, w, p), (width_1, width_2) = vectors, widths_s
    vv, ww, vw, pv, pw = (dot(a, b) for a, b in ((v, v), (w, w), (v, w), (p, v), (p, w)))
    zero = np.zeros(len(p))
    determinant = vv * ww - vw**2
    crossing = determinant > 1e-12 * vv * ww
    safe = np.where(crossing, determinant, 1.0)
    s, r = (pw * vw - pv * ww) / safe, (pw * vv - pv * vw) / safe
    inside = crossing & (s >= 0.0) & (s <= width_1) & (r >= 0.0) & (r <= width_2)
    inside &= np.abs(s - r + apart_s) <= shift_s
    tries = [(np.where(inside, s, np.nan), r)]
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
    return tries
