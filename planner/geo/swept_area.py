"""Areas that something sweeps over: convex hulls of points, and which of them a barrier is near."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from planner.frozen import frozen
from planner.geo.barrier import CircleBarrier

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.geo.barrier import Barrier
    from planner.geo.geodesy import FloatArray
    from planner.geo.path_legs import IndexArray


@frozen(eq=False)
class SweptAreas:
    """Convex areas in local metres, each the hull of its points.  See :func:`swept_areas`."""

    points_m: FloatArray
    """East and north of all points. (m, 2) [m]"""
    first: IndexArray
    """Index of the first point of each area. (n,)"""
    hulls: Any
    """Polygons, lines or points of shapely, which has no types. (n,)"""

    def near(self, barrier: Barrier, margin_m: float) -> npt.NDArray[np.bool_]:
        """Whether some place of each area is within a margin of a barrier, or beyond it.

        Parameters
        ----------
        barrier : Barrier
            An area of the fence.
        margin_m : float
            Distance to keep. [m]

        Returns
        -------
        ndarray of bool, shape (n,)
            By whole areas and whole edges, never by samples.
        """
        import shapely

        if isinstance(barrier, CircleBarrier):
            centre = np.array([barrier.east_m, barrier.north_m])
            if barrier.keep_inside:  # the farthest place of a hull is one of its points
                away = np.hypot(*(self.points_m - centre).T)
                farthest: npt.NDArray[np.bool_] = (
                    np.maximum.reduceat(away, self.first) > barrier.radius_m - margin_m
                )
                return farthest
            distance = shapely.distance(self.hulls, shapely.Point(centre))
            return np.asarray(distance < barrier.radius_m + margin_m)
        start = self.points_m[self.first]
        near = (
            shapely.intersects_xy(barrier.region, start[:, 0], start[:, 1]) != barrier.keep_inside
        )
        within, _ = barrier.edges.query(self.hulls, predicate="dwithin", distance=margin_m)
        near[within] = True
        return np.asarray(near)


def swept_areas(points_m: FloatArray, owner: IndexArray) -> SweptAreas:
    """Return the convex hulls of points.

    Parameters
    ----------
    points_m : ndarray, shape (m, 2)
        East and north. [m]
    owner : ndarray of int, shape (m,)
        The area each point belongs to, from 0 up to the last, in any order; each has two or more.
    """
    import shapely

    order = np.argsort(owner, kind="stable")
    points, owner = points_m[order], owner[order]
    first = np.flatnonzero(np.diff(owner, prepend=-1))
    return SweptAreas(
        points_m=points,
        first=first,
        # A line through the points has their hull, and is made faster than a set of them.
        hulls=shapely.convex_hull(shapely.linestrings(points, indices=owner)),
    )
