"""The straight legs of a path in a local frame, as arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple, TypeAlias

import numpy as np

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.geo.geodesy import FloatArray

    IndexArray: TypeAlias = npt.NDArray[np.intp]


class PathLegs(NamedTuple):
    """The straight legs of a path of n + 1 points in a local frame."""

    start_m: FloatArray
    """East and north of the starts, shape (n, 2). [m]"""
    end_m: FloatArray
    """East and north of the ends, shape (n, 2). [m]"""
    length_m: FloatArray
    """Lengths, shape (n,). [m]"""

    def point_m(self, along_m: FloatArray, leg: IndexArray | slice = slice(None)) -> FloatArray:
        """East and north of the points so far from the start of each leg, shape (n, 2)."""
        length = np.where(self.length_m[leg] > 0.0, self.length_m[leg], 1.0)
        step = (self.end_m[leg] - self.start_m[leg]) * (along_m / length)[:, None]
        return self.start_m[leg] + step


def path_legs(east_m: npt.ArrayLike, north_m: npt.ArrayLike) -> PathLegs:
    """Return the legs of the path through points of a local frame.

    Parameters
    ----------
    east_m, north_m : array_like, shape (n,)
        At least two points. [m]

    Raises
    ------
    ValueError
        If there are fewer than two points, or one is not finite.
    """
    points = np.column_stack([np.asarray(east_m, np.float64), np.asarray(north_m, np.float64)])
    if len(points) < 2 or not np.all(np.isfinite(points)):
        msg = "a path needs two finite points or more"
        raise ValueError(msg)
    start, end = points[:-1], points[1:]
    length = np.hypot(*(end - start).T)
    # A leg shorter than a nanometre stands still: its direction would be rounding.
    length = np.where(length > 1e-9, length, 0.0)
    return PathLegs(start, np.where(length[:, None] > 0.0, end, start), length)
