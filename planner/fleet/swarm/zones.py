"""Where agents may still come, told now to stop: upright capsules about the ways of their stops."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns

if TYPE_CHECKING:
    from planner.arrays import BoolArray, ComplexArray, FloatArray, IndexArray

_TREE_FROM = 150
"""From so many agents on near ones are found by a tree instead of all pairs: loading it takes 0.1 s."""
_BEND = 0.25
"""Room for what lies between samples, of their second differences: twice that of a parabola. [-]"""
_OTHER, _OTHER_BEGIN = np.array([1, 1, 0, 0]), np.array([2, 2, 0, 0])
"""Of the ends of two lines, the first's two and the second's: the other line, and the end it begins at."""
_STILL_M = 1e-9
_SAME_M = 1e-6
"""Ways that differ by less are as short. [m]"""


class Capsules(Columns, eq=False):
    """Everything within a distance of a straight line, one a row."""

    begin: ComplexArray
    """East and north `in_plane`. (n,) [m]"""
    end: ComplexArray
    radius_m: FloatArray
    """(n,) [m]"""

    @classmethod
    def about(cls, begin_m: FloatArray, end_m: FloatArray, radius_m: FloatArray) -> Capsules:
        """Return the capsules about lines from east and north (n, 2) [m] to others."""
        return cls(begin=in_plane(begin_m), end=in_plane(end_m), radius_m=radius_m)

    @property
    def begin_m(self) -> FloatArray:
        """Where the lines begin, east and north. (n, 2) [m]"""
        return _east_north(self.begin)

    @property
    def end_m(self) -> FloatArray:
        """Where they end. (n, 2) [m]"""
        return _east_north(self.end)

    def select(self, rows: IndexArray | BoolArray) -> Capsules:
        """Return some of the rows: as of any columns, in a third of the time."""
        return Capsules(begin=self.begin[rows], end=self.end[rows], radius_m=self.radius_m[rows])

    def put(self, rows: IndexArray | BoolArray, values: Capsules) -> None:
        """Overwrite some of the rows, in place."""
        self.begin[rows], self.end[rows] = values.begin, values.end
        self.radius_m[rows] = values.radius_m


def in_plane(places_m: FloatArray) -> ComplexArray:
    """Return east and north (…, 2) as one complex number each, (…): a turn is then a product."""
    return np.ascontiguousarray(places_m, np.float64).view(np.complex128)[..., 0]


def sizes(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors. (n, 2), (n,)"""
    return np.asarray(np.abs(in_plane(vectors)))


def differ(vectors: FloatArray, others: FloatArray | float = 0.0) -> BoolArray:
    """Return which vectors (n, 2) are not those of others, or not zero. (n,)"""
    other = others if isinstance(others, float) else in_plane(others)
    return np.asarray(in_plane(vectors) != other)


def _east_north(places_m: ComplexArray) -> FloatArray:
    return np.ascontiguousarray(places_m)[..., None].view(np.float64)


def capsules_about(
    ways_m: FloatArray, velocity_m_s: FloatArray, *, more_m: FloatArray | float = 0.0
) -> Capsules:
    """Return capsules that hold ways (n, samples, 2) [m], and ``more_m`` about them.

    Between its samples a way is no farther from their chords than an eighth of its second differences: aside
    of any of them, ahead of those where it turns back.  It may turn before the second, too, if its velocity
    at the first (n, 2) [m s⁻¹] leads the other way.  So who sets out along a straight line takes no more
    room beside it than who stands, and none behind it.
    """
    ways = in_plane(ways_m)
    first = ways[:, 0]
    along = ways[:, -1] - first
    length = np.abs(along)
    unit = np.where(length > _STILL_M, along / np.maximum(length, _STILL_M), 1.0)
    away = (ways - first[:, None]) * unit.conj()[:, None]
    ahead = away.real
    steps = away[:, 1:] - away[:, :-1]
    goes = np.empty(ahead.shape)
    goes[:, 0] = (in_plane(velocity_m_s) * unit.conj()).real
    goes[:, 1:] = steps.real
    turns = goes[:, 1:] * goes[:, :-1] < 0.0
    bends = steps[:, 1:] - steps[:, :-1]
    bent_m = np.abs(bends.real)
    longer_m = np.zeros(ahead.shape)
    np.multiply(bent_m, turns[:, 1:], out=longer_m[:, 1:-1])
    longer_m[:, 0] = bent_m.max(axis=1, initial=0.0) * turns[:, 0]
    longer_m *= _BEND
    aside_m = np.abs(away.imag).max(axis=1) + _BEND * np.abs(bends.imag).max(axis=1, initial=0.0)
    return Capsules(
        begin=first + (ahead - longer_m).min(axis=1) * unit,
        end=first + (ahead + longer_m).max(axis=1) * unit,
        radius_m=aside_m + more_m,
    )


def distances_m(first: Capsules, second: Capsules) -> FloatArray:
    """Return how far capsules are apart, row by row; negative where they overlap. (n,) [m]"""
    apart = np.abs(_ways_to_lines(first, second)).min(axis=0)
    return np.asarray(apart - first.radius_m - second.radius_m)


def gaps_m(first: Capsules, second: Capsules) -> FloatArray:
    """Return the shortest ways from the lines of capsules to those of others, row by row. (n, 2) [m]

    Where there are several it is in the middle between them: the same for both, and for all of a symmetry.
    """
    ways = _ways_to_lines(first, second)
    ways[:2] *= -1.0
    length = np.abs(ways)
    least = length.min(axis=0)
    middle = np.where(length <= least + _SAME_M, ways, 0.0).sum(axis=0)
    size = np.abs(middle)
    return _east_north(np.where(size > 0.0, least / np.maximum(size, _STILL_M), 0.0) * middle)


def _ways_to_lines(first: Capsules, second: Capsules) -> ComplexArray:
    """Return how each end of two lines is reached from the other: the first's two, the second's. (4, n) [m]

    Lines that cross are no way apart.
    """
    ends = np.array((first.begin, first.end, second.begin, second.end))
    lines = ends[1::2] - ends[::2]
    along = lines.take(_OTHER, axis=0)  # each end against the other line
    to = ends - ends.take(_OTHER_BEGIN, axis=0)
    turned = to * along.conj()
    square = np.maximum(along.real**2 + along.imag**2, _STILL_M**2)
    part = np.minimum(np.maximum(turned.real / square, 0.0), 1.0)
    side = turned.imag
    crosses = (side[0] * side[1] < 0.0) & (side[2] * side[3] < 0.0)
    return np.where(crosses, 0.0, to - part * along)


@lru_cache(maxsize=16)
def _all_pairs(count: int) -> tuple[IndexArray, IndexArray]:
    return np.triu_indices(count, 1)


def near_pairs(
    zones: Capsules, reach_m: float, is_known: BoolArray | None = None
) -> tuple[IndexArray, IndexArray]:
    """Return pairs of rows, the first the smaller, whose capsules may be within a distance.

    Rows that are not known to anybody are in no pair.
    """
    centre = 0.5 * (zones.begin + zones.end)
    size = 0.5 * np.abs(zones.end - zones.begin) + zones.radius_m
    count = len(centre)
    if count < _TREE_FROM:
        first, second = _all_pairs(count)
    else:
        from scipy.spatial import cKDTree

        found = cKDTree(_east_north(centre)).query_pairs(
            2.0 * float(size.max()) + reach_m, output_type="ndarray"
        )
        found = found[np.lexsort((found[:, 1], found[:, 0]))]
        first, second = found[:, 0], found[:, 1]
    kept = np.abs(centre[second] - centre[first]) < size[first] + size[second] + reach_m
    if is_known is not None:
        kept &= is_known[first] & is_known[second]
    return first[kept], second[kept]
