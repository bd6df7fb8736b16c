"""The local frame a fence is looked at in."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.geo.geodesy import distance_m
from planner.geo.local_frame import LocalFrame

if TYPE_CHECKING:
    from planner.geo.fence import Fence

_NEAR_HOME_M = 50_000.0
"""A fence this near home is drawn in the frame of home: distances are 1 cm in a kilometre true. [m]"""


def make_fence_frame(fence: Fence, home_deg: tuple[float, float] | None) -> LocalFrame:
    """Return the frame of home, or one at a fence that is far from it or has no home. [°]"""
    places = [vertex for polygon in fence.polygons for vertex in polygon.vertices_deg]
    places += [(circle.latitude_deg, circle.longitude_deg) for circle in fence.circles]
    sane = [place for place in places if abs(place[0]) <= 90.0 and abs(place[1]) <= 180.0]
    if home_deg is None:
        home_deg = sane[0] if sane else (0.0, 0.0)
    elif sane and np.max(distance_m(*home_deg, *np.array(sane).T)) >= _NEAR_HOME_M:
        home_deg = sane[0]
    return LocalFrame(latitude_deg=home_deg[0], longitude_deg=home_deg[1])
