"""How far the ground between two places lies off the straight line that joins it there."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.geo.geodesy import distance_m

if TYPE_CHECKING:
    from planner.geo.terrain import TerrainGrid

_SAMPLES = 65


class GroundBetween(NamedTuple):
    """The ground between two places, against the straight line over it."""

    off_line_m: float
    """Farthest from the straight line that joins the ground at both ends. [m]"""
    steepest: float
    """Steepest rise or fall over horizontal distance. [-]"""
    height_amsl_m: tuple[float, ...]
    """Evenly spaced from one end to the other. [m AMSL]"""


def ground_between(
    terrain: TerrainGrid, from_deg: tuple[float, float], to_deg: tuple[float, float]
) -> GroundBetween | None:
    """Return what the ground does between two places; ``None`` where it is not known all along.

    Parameters
    ----------
    terrain : TerrainGrid
        The ground.
    from_deg, to_deg : tuple of float
        Latitude and longitude. [°]
    """
    length_m = float(distance_m(*from_deg, *to_deg))
    if length_m == 0.0:
        return None
    share = np.linspace(0.0, 1.0, _SAMPLES)
    ground = terrain.height_amsl_m(
        from_deg[0] + share * (to_deg[0] - from_deg[0]),
        from_deg[1] + share * (to_deg[1] - from_deg[1]),
    )
    if np.ma.getmaskarray(ground).any():
        return None
    height = np.asarray(ground, np.float64)
    line = height[0] + share * (height[-1] - height[0])
    return GroundBetween(
        off_line_m=float(np.abs(height - line).max()),
        steepest=float(np.abs(np.diff(height)).max()) * (_SAMPLES - 1) / length_m,
        height_amsl_m=tuple(height.tolist()),
    )
