r"""Tracks that several fly along, and where the stop zone of each is on its own.

The zone of an agent at a moment reaches from where it is to the farthest point it gets to, told then to
stop: along its track, as a stop inserted into its mission is flown.  Two zones come too near to each other
only where the tracks do.  That is found once, in space; when it happens follows from the times at
which either zone reaches a part of its track, and leaves it again.  Nothing is sampled in time.
"""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.fleet.swarm.zones import Capsules, distances_m
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import BoolArray, FloatArray, IndexArray
    from planner.fleet.approach import Cylinder

PART_M = 2.5
"""Tracks are divided into parts no longer than this: regions begin where a part does. [m]"""
_TRIES, _ROUNDS = 9, 5
"""Each round looks at an eighth of the one before: to 1e-4 of a part. [-]"""
_MOST_TRIED = 40
"""Parts tried one after the other; if none is too near by then the next is taken for it. [-]"""
_BEFORE_S = 1e-6
REST_M = 1e-6
"""One that rests so near to the end of its track has not stopped before it. [m]"""


class ZoneTrack(Value, eq=False, dict=True):
    """The track of one agent by knots, straight in between, and what its zone reaches at each."""

    place_m: FloatArray
    """East, north and height, of all in one frame. (k, 3) [m]"""
    is_low: BoolArray
    """Whether it stands, takes off or lands near the ground, between two knots. (k - 1,)"""
    time_s: FloatArray
    """When it is at each knot; infinite: nobody knows yet. (k,) [s]"""
    rest_m: FloatArray
    """Way along the track at which it comes to rest, told at the knot to stop. (k,) [m]"""
    tip_m: FloatArray
    """Farthest it gets then, not falling. (k,) [m]"""
    begins_run: BoolArray
    """Whether what begins with the knot cannot be stopped before its end. (k,)"""

    @cached_property
    def arc_m(self) -> FloatArray:
        """Way along the track to each knot. (k,) [m]"""
        steps = np.sqrt((np.diff(self.place_m, axis=0) ** 2).sum(axis=1))
        return np.concatenate(([0.0], np.cumsum(steps)))

    @cached_property
    def entered_s(self) -> FloatArray:
        """When the zone first reaches each knot. (k,) [s]"""
        return self.reached_s(self.arc_m)

    def reached_s(self, arc_m: FloatArray) -> FloatArray:
        """Return when the zone first reaches places along the track; infinite: nobody knows. [s]"""
        last = len(self.tip_m) - 1
        after = np.searchsorted(self.tip_m, arc_m - 1e-9, side="left")
        inside = np.clip(after, 1, last)
        low_s, high_s = self.time_s[inside - 1], self.time_s[inside]
        low_m, high_m = self.tip_m[inside - 1], self.tip_m[inside]
        with np.errstate(invalid="ignore", divide="ignore"):
            part = np.clip((arc_m - low_m) / (high_m - low_m), 0.0, 1.0)
            even_s = low_s + part * (high_s - low_s)
        found = np.where(self.begins_run[inside - 1], low_s, even_s)
        found = np.where(np.isinf(high_s), np.inf, found)
        return np.where(after == 0, self.time_s[0], np.where(after > last, np.inf, found))

    def span_m(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return from where until where along the track the zone is at times. [m]"""
        known = int(np.searchsorted(self.time_s, np.inf))
        times, tips = self.time_s[:known], self.tip_m[:known]
        at = np.clip(np.searchsorted(times, time_s, side="right") - 1, 0, known - 1)
        ahead = tips[np.minimum(at + 1, known - 1)]
        return (
            np.interp(time_s, times, self.arc_m[:known]),
            np.where(self.begins_run[at], ahead, np.interp(time_s, times, tips)),
        )

    def rest_at_m(self, time_s: float) -> float:
        """Return where along the track it comes to rest, told at a time to stop. [m]"""
        known = int(np.searchsorted(self.time_s, np.inf))
        times = self.time_s[:known]
        at = max(int(np.searchsorted(times, time_s, side="right")) - 1, 0)
        if at + 1 < known and self.begins_run[at]:
            return float(self.rest_m[at if time_s <= times[at] + _BEFORE_S else at + 1])
        return float(np.interp(time_s, times, self.rest_m[:known]))

    def may_stop(self, time_s: float) -> bool:
        """Return whether one told at a time to stop rests before the end of the track."""
        return bool(self.rest_at_m(time_s) < self.arc_m[-1] - REST_M)

    def moved(self, knot: int, time_s: float) -> ZoneTrack:
        """Return the track of one that is at a knot at another time, and later by as much after it."""
        times = self.time_s.copy()
        with np.errstate(invalid="ignore"):
            times[knot:] += time_s - times[knot]
        return replace(self, time_s=times)

    def capsules(self, rows: IndexArray) -> Capsules:
        """Return the parts of the track between knots, in the plane."""
        begin_m, end_m = self.place_m[rows, :2], self.place_m[rows + 1, :2]
        return Capsules.about(begin_m, end_m, np.zeros(len(rows)))


class Contact(NamedTuple):
    """When two zones first come too near to each other."""

    time_s: float
    entries_m: tuple[float, float]
    """Where along either track the part begins in which they may."""
    clears_s: tuple[float, float]
    """How much later either would have to be for the other to have left what is too near. [s]"""


class Crossing(Value, eq=False):
    """The parts of two tracks that are too near to each other, one pair of parts a row."""

    first: IndexArray
    second: IndexArray
    region: IndexArray
    """Pairs of parts next to each other are of one region. (n,)"""
    entries_m: dict[int, tuple[float, float]]
    """Where along either track a region begins, of those that were asked for. [m]"""


def find_crossing(
    one: ZoneTrack, two: ZoneTrack, keeps: Cylinder, after_s: float
) -> Crossing | None:
    """Return where two tracks are nearer to each other than they may; ``None``: nowhere.

    What either has left behind by a time is not looked at: nobody comes there again.
    """
    from scipy.spatial import cKDTree

    reach_m = keeps.horizontal_m
    low = np.maximum(one.place_m[:, :2].min(axis=0), two.place_m[:, :2].min(axis=0)) - reach_m
    high = np.minimum(one.place_m[:, :2].max(axis=0), two.place_m[:, :2].max(axis=0)) + reach_m
    kept = [_within(each, low, high, after_s) for each in (one, two)]
    if not len(kept[0]) or not len(kept[1]):
        return None
    middles, sizes = zip(
        *(_middles(each, rows) for each, rows in zip((one, two), kept, strict=True)), strict=True
    )
    found = cKDTree(middles[0]).sparse_distance_matrix(
        cKDTree(middles[1]), reach_m + max(sizes[0]) + max(sizes[1]), output_type="ndarray"
    )
    first, second = kept[0][found["i"]], kept[1][found["j"]]
    is_near = distances_m(one.capsules(first), two.capsules(second)) < reach_m
    heights = [
        (
            np.minimum(each.place_m[rows, 2], each.place_m[rows + 1, 2]),
            np.maximum(each.place_m[rows, 2], each.place_m[rows + 1, 2]),
        )
        for each, rows in ((one, first), (two, second))
    ]
    (low_1, high_1), (low_2, high_2) = heights
    is_near &= (low_2 - high_1 < keeps.over_m) & (low_1 - high_2 < keeps.under_m)
    is_near &= ~(one.is_low[first] & two.is_low[second])
    first, second = first[is_near], second[is_near]
    if not len(first):
        return None
    order = np.lexsort((second, first))
    first, second = first[order], second[order]
    return Crossing(first=first, second=second, region=_regions(first, second), entries_m={})


def _entries_m(
    one: ZoneTrack, two: ZoneTrack, crossing: Crossing, region: int, reach_m: float
) -> tuple[float, float]:
    """Return where along either track a region begins."""
    if region not in crossing.entries_m:
        rows = crossing.region == region
        first, second = crossing.first[rows], crossing.second[rows]
        begins = first == first.min(), second == second.min()
        crossing.entries_m[region] = (
            _entry_m(one, int(first.min()), two, second[begins[0]], reach_m),
            _entry_m(two, int(second.min()), one, first[begins[1]], reach_m),
        )
    return crossing.entries_m[region]


def _within(track: ZoneTrack, low_m: FloatArray, high_m: FloatArray, after_s: float) -> IndexArray:
    """Return the parts of a track that are in a box, and not left before a time."""
    begin, end = track.place_m[:-1, :2], track.place_m[1:, :2]
    is_in = ((np.maximum(begin, end) >= low_m) & (np.minimum(begin, end) <= high_m)).all(axis=1)
    return np.flatnonzero(is_in & (track.time_s[1:] >= after_s))


def _middles(track: ZoneTrack, rows: IndexArray) -> tuple[FloatArray, FloatArray]:
    begin, end = track.place_m[rows, :2], track.place_m[rows + 1, :2]
    return 0.5 * (begin + end), 0.5 * np.hypot(*(end - begin).T)


def _regions(first: IndexArray, second: IndexArray) -> IndexArray:
    """Return the regions of pairs of parts, in order: those next to each other are of one. (n,)"""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    count, width = len(first), int(second.max()) + 3
    keys = first * width + second + 1
    ones, others = [], []
    for step in (1, width - 1, width, width + 1):
        at = np.clip(np.searchsorted(keys, keys + step), 0, count - 1)
        rows = np.flatnonzero(keys[at] == keys + step)
        ones.append(rows)
        others.append(at[rows])
    edges = (np.concatenate(ones), np.concatenate(others))
    graph = coo_array((np.ones(len(edges[0])), edges), shape=(count, count))
    return np.asarray(connected_components(graph, directed=False)[1], np.intp)


def _entry_m(own: ZoneTrack, at: int, other: ZoneTrack, rows: IndexArray, reach_m: float) -> float:
    """Return where along a part a track comes as near as that to parts of another."""
    line = other.capsules(np.tile(rows, _TRIES))
    begin, end = own.place_m[at, :2], own.place_m[at + 1, :2]

    def is_near(parts: FloatArray) -> BoolArray:
        points = np.repeat(begin + parts[:, None] * (end - begin), len(rows), axis=0)
        dots = Capsules.about(points, points, np.zeros(len(points)))
        return np.asarray((distances_m(dots, line) < reach_m).reshape(_TRIES, -1).any(axis=1))

    part = _first(0.0, 1.0, is_near)
    part = 0.0 if part is None else part
    return float(own.arc_m[at] + part * (own.arc_m[at + 1] - own.arc_m[at]))


def _first(low: float, high: float, is_so: Callable[[FloatArray], BoolArray]) -> float | None:
    """Return just before where something first is so, of what is tried evenly; ``None``: nowhere."""
    for _ in range(_ROUNDS):
        tried = np.linspace(low, high, _TRIES)
        found = is_so(tried)
        at = int(found.argmax())
        if not found[at]:
            return None
        if at == 0:
            break
        low, high = float(tried[at - 1]), float(tried[at])
    return low


def first_contact(
    one: ZoneTrack, two: ZoneTrack, crossing: Crossing, after_s: float, reach_m: float
) -> Contact | None:
    """Return when two zones first come too near to each other from a time on; ``None``: never."""
    first, second = crossing.first, crossing.second
    begin_s = np.maximum(one.entered_s[first], two.entered_s[second])
    begin_s = np.maximum(begin_s, after_s)
    left_s = one.time_s[first + 1], two.time_s[second + 1]
    end_s = np.minimum(*left_s)
    rows = np.flatnonzero((begin_s < end_s) & (begin_s < np.inf))
    rows = rows[np.argsort(begin_s[rows], kind="stable")]
    best_s, best = np.inf, -1
    for number, row in enumerate(rows.tolist()):
        if begin_s[row] >= best_s:
            break
        if number >= _MOST_TRIED:
            best_s, best = float(begin_s[row]), row
            break
        found_s = _nearing_s(
            one, two, (int(first[row]), int(second[row])), float(begin_s[row]), reach_m
        )
        if found_s < best_s:
            best_s, best = found_s, row
    if best < 0:
        return None
    return Contact(
        time_s=best_s,
        entries_m=_entries_m(one, two, crossing, int(crossing.region[best]), reach_m),
        clears_s=(
            float(left_s[1][best] - one.entered_s[first[best]]),
            float(left_s[0][best] - two.entered_s[second[best]]),
        ),
    )


def _nearing_s(
    one: ZoneTrack, two: ZoneTrack, parts: tuple[int, int], begin_s: float, reach_m: float
) -> float:
    """Return when what zones have of one part each comes too near; infinite: they do not there. [s]"""
    sides = ((one, parts[0]), (two, parts[1]))
    whole_s = [float(track.entered_s[part + 1]) for track, part in sides]
    left_s = min(float(track.time_s[part + 1]) for track, part in sides)
    end_s = min(left_s, max([begin_s, *(one_s for one_s in whole_s if one_s < np.inf)]))

    def is_near(times_s: FloatArray) -> BoolArray:
        is_there = np.ones(_TRIES, np.bool_)
        lines = []
        for track, part in sides:
            low_m, high_m = track.span_m(times_s)
            begin_m, length_m = track.arc_m[part], track.arc_m[part + 1] - track.arc_m[part]
            is_there &= (high_m >= begin_m - 1e-6) & (low_m <= begin_m + length_m + 1e-6)
            at, way = track.place_m[part, :2], np.diff(track.place_m[part : part + 2, :2], axis=0)
            begin, end = (
                at + np.clip((one_m - begin_m) / max(length_m, 1e-12), 0.0, 1.0)[:, None] * way
                for one_m in (low_m, high_m)
            )
            lines.append(Capsules.about(begin, end, np.zeros(_TRIES)))
        return is_there & (distances_m(*lines) < reach_m)

    found_s = _first(begin_s, end_s, is_near)
    return float(np.inf) if found_s is None else found_s
