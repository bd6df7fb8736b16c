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
_STILL_M = 1e-9
_SAME_M = 1e-6
"""Ways that differ by less are as short. [m]"""


class Capsules(Columns, eq=False):
    """Everything within a distance of a straight line, one a row."""

    begin_m: FloatArray
    """East and north. (n, 2) [m]"""
    end_m: FloatArray
    radius_m: FloatArray
    """(n,) [m]"""

    def select(self, rows: IndexArray | BoolArray) -> Capsules:
        """Return some of the rows: as of any columns, in a sixth of the time."""
        return Capsules(
            begin_m=self.begin_m[rows], end_m=self.end_m[rows], radius_m=self.radius_m[rows]
        )


def in_plane(places_m: FloatArray) -> ComplexArray:
    """Return east and north (…, 2) as one complex number each, (…): a turn is then a product."""
    return np.ascontiguousarray(places_m, np.float64).view(np.complex128)[..., 0]


def sizes(vectors: FloatArray) -> FloatArray:
    """Return the lengths of vectors. (n, 2), (n,)"""
    return np.asarray(np.abs(in_plane(vectors)))


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
    goes = np.empty(ahead.shape)
    goes[:, 0] = (in_plane(velocity_m_s) * unit.conj()).real
    goes[:, 1:] = ahead[:, 1:] - ahead[:, :-1]
    turns = goes[:, 1:] * goes[:, :-1] < 0.0
    bend = 0.25 * (away[:, 2:] - 2.0 * away[:, 1:-1] + away[:, :-2])
    longer_m = np.zeros(ahead.shape)
    longer_m[:, 1:-1] = np.where(turns[:, 1:], np.abs(bend.real), 0.0)
    longer_m[:, 0] = np.where(turns[:, 0], np.abs(bend.real).max(axis=1, initial=0.0), 0.0)
    bent_m = np.abs(bend.imag).max(axis=1, initial=0.0)
    return Capsules(
        begin_m=_east_north(first + (ahead - longer_m).min(axis=1) * unit),
        end_m=_east_north(first + (ahead + longer_m).max(axis=1) * unit),
        radius_m=np.abs(away.imag).max(axis=1) + bent_m + more_m,
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
    ends = in_plane(np.array((first.begin_m, first.end_m, second.begin_m, second.end_m)))
    lines = ends[1::2] - ends[::2]
    along = lines[[1, 1, 0, 0]]  # each end against the other line
    to = ends - ends[[2, 2, 0, 0]]
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
    begin, end = in_plane(zones.begin_m), in_plane(zones.end_m)
    centre, size = 0.5 * (begin + end), 0.5 * np.abs(end - begin) + zones.radius_m
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
