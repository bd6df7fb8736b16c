"""Where agents may still come, told now to stop: upright capsules about the ways of their stops."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IndexArray

_BOXED = 60
"""From so many agents on near ones are found by a tree instead of all pairs."""
_STILL_M = 1e-9


class Capsules(Columns, eq=False):
    """Everything within a distance of a straight line, one a row."""

    begin_m: FloatArray
    """East and north. (n, 2) [m]"""
    end_m: FloatArray
    radius_m: FloatArray
    """(n,) [m]"""


def capsules_about(ways_m: FloatArray, *, more_m: FloatArray | float = 0.0) -> Capsules:
    """Return capsules that hold ways (n, samples, 2) [m], and ``more_m`` about them.

    Between its samples a way is no farther from their chords than an eighth of its second differences.
    """
    first, last = ways_m[:, 0], ways_m[:, -1]
    along = last - first
    length = np.hypot(*along.T)
    unit = np.where(
        length[:, None] > _STILL_M, along / np.maximum(length, _STILL_M)[:, None], [1.0, 0.0]
    )
    away = ways_m - first[:, None]
    ahead = np.einsum("nmx,nx->nm", away, unit)
    beside = np.abs(away[..., 1] * unit[:, None, 0] - away[..., 0] * unit[:, None, 1])
    bend = np.diff(ways_m, n=2, axis=1)
    bent_m = 0.25 * np.sqrt((bend**2).sum(axis=2)).max(axis=1, initial=0.0)
    return Capsules(
        begin_m=first + ahead.min(axis=1)[:, None] * unit,
        end_m=first + ahead.max(axis=1)[:, None] * unit,
        radius_m=beside.max(axis=1) + bent_m + more_m,
    )


def distances_m(first: Capsules, second: Capsules) -> FloatArray:
    """Return how far capsules are apart, row by row; negative where they overlap. (n,) [m]"""
    a, b, c, d = first.begin_m, first.end_m, second.begin_m, second.end_m
    apart = np.minimum(
        np.minimum(_to_line_m(a, c, d), _to_line_m(b, c, d)),
        np.minimum(_to_line_m(c, a, b), _to_line_m(d, a, b)),
    )
    crosses = (_side(a, b, c) * _side(a, b, d) < 0.0) & (_side(c, d, a) * _side(c, d, b) < 0.0)
    return np.asarray(np.where(crosses, 0.0, apart) - first.radius_m - second.radius_m)


def _to_line_m(point: FloatArray, begin: FloatArray, end: FloatArray) -> FloatArray:
    along = end - begin
    square = np.maximum((along**2).sum(axis=1), _STILL_M**2)
    part = np.clip(((point - begin) * along).sum(axis=1) / square, 0.0, 1.0)
    return np.asarray(np.hypot(*(point - begin - part[:, None] * along).T))


def _side(begin: FloatArray, end: FloatArray, point: FloatArray) -> FloatArray:
    along, to = end - begin, point - begin
    return np.asarray(along[:, 0] * to[:, 1] - along[:, 1] * to[:, 0])


@lru_cache(maxsize=16)
def _all_pairs(count: int) -> tuple[IndexArray, IndexArray]:
    return np.triu_indices(count, 1)


def near_pairs(
    zones: Capsules, reach_m: float, is_known: BoolArray | None = None
) -> tuple[IndexArray, IndexArray]:
    """Return pairs of rows, the first the smaller, whose capsules may be within a distance.

    Rows that are not known to anybody are in no pair.
    """
    centre = 0.5 * (zones.begin_m + zones.end_m)
    size = 0.5 * np.hypot(*(zones.end_m - zones.begin_m).T) + zones.radius_m
    count = len(centre)
    if count < _BOXED:
        first, second = _all_pairs(count)
    else:
        from scipy.spatial import cKDTree

        found = cKDTree(centre).query_pairs(
            2.0 * float(size.max()) + reach_m, output_type="ndarray"
        )
        found = found[np.lexsort((found[:, 1], found[:, 0]))]
        first, second = found[:, 0], found[:, 1]
    apart = centre[second] - centre[first]
    kept = (apart**2).sum(axis=1) < (size[first] + size[second] + reach_m) ** 2
    if is_known is not None:
        kept &= is_known[first] & is_known[second]
    return first[kept], second[kept]
