"""Lines that ArduPilot takes for straight.

ArduPilot computes in metres north and east of an origin near home: north from the difference of the
latitudes, east from that of the longitudes times the cosine of the mean of the two latitudes
(``Location::get_vector_xy_from_origin_NE``).  Its legs and the edges of its fences are straight there.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.geo.geodesy import SEMI_MAJOR_AXIS_M

if TYPE_CHECKING:
    from planner.geo.geodesy import FloatArray

_STEEPEST_DEG = 85.0
"""Beyond it ArduPilot's metres are none, and nobody flies it there. [°]"""


def bow_m(way_m: FloatArray, share: FloatArray, latitude_deg: float) -> FloatArray:
    """Return how far a leg is from the straight line of a local frame.

    Parameters
    ----------
    way_m : ndarray, shape (n, 2)
        East and north way of the whole leg. [m]
    share : ndarray, shape (n,)
        Where on it, from 0 to 1. [-]
    latitude_deg : float
        Latitude of the origin. [°]

    Returns
    -------
    ndarray, shape (n, 2)
        East and north; to second order of way over radius of the Earth. [m]

    Notes
    -----
    With e, n the way, u the share and k = tan φ / 2R: u (1 − u) k (e n, −e²).  At 47° the middle of a leg
    of 20 km along a parallel lies 8.4 m south of the straight line: on the parallel.
    """
    latitude = math.radians(max(-_STEEPEST_DEG, min(_STEEPEST_DEG, latitude_deg)))
    bend = math.tan(latitude) / (2.0 * SEMI_MAJOR_AXIS_M)
    east, north = way_m[:, 0], way_m[:, 1]
    weight = share * (1.0 - share) * bend
    return np.column_stack((weight * east * north, -weight * east**2))


def straight_length_m(tolerance_m: float, latitude_deg: float) -> float:
    """Return the greatest length of a leg that is straight within a tolerance. [m]"""
    latitude = math.radians(min(_STEEPEST_DEG, abs(latitude_deg)))
    bend = math.tan(latitude) / (8.0 * SEMI_MAJOR_AXIS_M)
    return math.sqrt(tolerance_m / bend) if bend > 0.0 else math.inf
