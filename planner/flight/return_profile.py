"""The way home along a whole flight, as columns: for plots, and for programs of others."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.destination import HOME
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.arrays import FloatArray, IntArray
    from planner.flight.homeward import Homeward

PROFILE_POINTS = 400
"""A flight is looked at this often, evenly in time, and at the ends of its stages. [-]"""


@frozen(eq=False)
class ReturnProfile:
    """What it takes to get home from n points of a flight, as columns in flown order."""

    time_s: FloatArray
    """Since the start of the flight. (n,) [s]"""
    item: IntArray
    """Mission item flown for. (n,)"""
    along_m: FloatArray
    """Way flown for that item. (n,) [m]"""
    latitude_deg: FloatArray
    longitude_deg: FloatArray
    height_above_home_m: FloatArray
    used_wh: FloatArray
    """Energy used by then. (n,) [Wh]"""
    destination: IntArray
    """Where the vehicle itself would return to: 0 for home, k for rally point k, below 0 as in
    `planner.flight.destination`. (n,)"""
    return_s: FloatArray
    """Time to stop, return there and land. (n,) [s]"""
    return_wh: FloatArray
    """Energy for that. (n,) [Wh]"""
    home_s: FloatArray
    """Time to stop, fly home and land, whatever the vehicle would choose. (n,) [s]"""
    home_wh: FloatArray
    rally_s: FloatArray
    """The same for each of r rally points. (n, r) [s]"""
    rally_wh: FloatArray
    """(n, r) [Wh]"""


def return_profile(homeward: Homeward) -> ReturnProfile:
    """Return the ways home of a flight at the ends of its stages and evenly in between."""
    columns = homeward.flight.motion.segments
    end_s = np.append(homeward.start_s[1:], homeward.flight.time_s)
    ends = np.flatnonzero(np.diff(homeward.segment_stage, append=-1))
    even_s = np.linspace(0.0, homeward.flight.time_s, PROFILE_POINTS)
    even = np.minimum(np.searchsorted(end_s, even_s, side="right"), len(end_s) - 1)
    duration_s = np.maximum(columns.duration_s[even], 1e-9)
    segment = np.concatenate((even, ends))
    share = np.concatenate(
        (np.clip((even_s - homeward.start_s[even]) / duration_s, 0.0, 1.0), np.ones(len(ends)))
    )
    order = np.lexsort((share, segment))
    points = homeward.points(segment[order], share[order])
    rally_count = len(homeward.destinations.rally_ground_m)
    ways = [
        homeward.way(points.stop_m, points.stage, destination)
        for destination in range(HOME, rally_count + 1)
    ]
    all_s = np.stack([points.stop_s + time_s for time_s, _ in ways], axis=1)
    all_wh = np.stack([points.stop_wh + energy_wh for _, energy_wh in ways], axis=1)
    destination = homeward.chosen(points)
    if (destination >= HOME).all():
        row = np.arange(len(order))
        own_s, own_wh = all_s[row, destination], all_wh[row, destination]
    else:
        own_s, own_wh = homeward.way(points.stop_m, points.stage, destination)
        own_s, own_wh = points.stop_s + own_s, points.stop_wh + own_wh
    latitude_deg, longitude_deg = homeward.route.frame.latitude_longitude_deg(
        points.place_m[:, 0], points.place_m[:, 1]
    )
    flown_m = np.concatenate(([0.0], np.cumsum(columns.distance_m)))
    first = np.searchsorted(homeward.segment_stage, points.stage)
    along_m = flown_m[points.segment] - flown_m[first]
    items = np.array([stage.item for stage in homeward.route.stages], dtype=np.intp)
    return ReturnProfile(
        time_s=points.time_s,
        item=items[points.stage],
        along_m=along_m + points.share * columns.distance_m[points.segment],
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        height_above_home_m=points.place_m[:, 2],
        used_wh=points.used_wh,
        destination=destination,
        return_s=own_s,
        return_wh=own_wh,
        home_s=all_s[:, HOME],
        home_wh=all_wh[:, HOME],
        rally_s=all_s[:, HOME + 1 :],
        rally_wh=all_wh[:, HOME + 1 :],
    )
