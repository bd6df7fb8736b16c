"""Volumes of space and time that contain a flight, with everything it may be off by."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.fleet.return_flights import FlownFan, ReturnFlights
    from planner.fleet.trajectory import Trajectory

_CORNERS = 4
"""Of a quarter of a round end: 16 to a circle, which are 2 % farther out than it. [-]"""
_STRAIGHTENED_M = 0.5
"""How far a corner may lie outside its outline before that is made larger: a fifth of the position error of a
common receiver, 2.5 m. [m]"""
_MARGIN_M = 0.1
"""For coordinates to 1e-7 °, 1 cm, and for edges that are geodesics: 3 cm in 20 km. [m]"""
_WIDEST_M = 25.0
"""Intervals whose returns lie farther apart are divided, each part in a volume of its own: ten times the
position error of a common receiver. [m]"""
_MOST_DIVISIONS = 3


class Volume(Value, eq=False):
    """An outline on the ground, heights and times."""

    outline_m: FloatArray
    """Corners, east and north, of a convex outline; the first is not repeated. (n, 2) [m]"""
    low_m: float
    """Above home. [m]"""
    high_m: float
    start_s: float
    """Since the planned start of the flight. [s]"""
    end_s: float


def flight_volumes(flown: Trajectory, *, longest_s: float) -> Iterator[Volume]:
    """Yield volumes that contain a flight between its rests, one after another in time.

    Parameters
    ----------
    flown : Trajectory
        With its errors of position, of height and of time.
    longest_s : float
        About how long each lasts. [s]
    """
    rows = np.flatnonzero(~flown.is_rest)
    number = (flown.start_s[rows] // longest_s).astype(np.int64)
    for group in np.split(rows, np.flatnonzero(np.diff(number)) + 1):
        if len(group):
            yield _volume(flown, group)


def return_volumes(flights: ReturnFlights, *, count: int) -> Iterator[Volume]:
    """Yield volumes that contain the returns from every moment of a flight, by when they are begun.

    Parameters
    ----------
    flights : ReturnFlights
        The returns.
    count : int
        At least so many intervals of the flight, where it has so many.
    """
    begin_s, end_s = flights.first_intervals()
    step = max(len(begin_s) // count, 1)
    begin_s, end_s = begin_s[::step], np.append(begin_s[::step][1:], end_s[-1:])
    for division in range(_MOST_DIVISIONS + 1):
        if not len(begin_s):
            return
        fan = flights.fan(begin_s, end_s)
        is_wide = (fan.away_m > _WIDEST_M) & (end_s > begin_s)
        if division == _MOST_DIVISIONS:
            is_wide[:] = False
        yield from _of_intervals(fan, np.flatnonzero(~is_wide))
        begin_s, end_s = fan.divided(is_wide)


def _of_intervals(fan: FlownFan, intervals: IntArray) -> Iterator[Volume]:
    whole = fan.whole
    for number in intervals.tolist():
        rows = np.flatnonzero(fan.group == number)
        if len(rows):
            yield _volume(whole, rows)


def _volume(flown: Trajectory, rows: IntArray) -> Volume:
    """Return the volume of some parts: a cubic stays among its control points."""
    from shapely import MultiPoint

    error_m = float(flown.error_m[rows].max())
    around_m = float(flown.grown_m[rows].max()) + error_m + _STRAIGHTENED_M + _MARGIN_M
    corners = MultiPoint(flown.control_m[rows, :, :2].reshape(-1, 2)).convex_hull
    # Corners of a buffer are on its circles, its edges inside them.
    outline = corners.simplify(_STRAIGHTENED_M).buffer(
        around_m / math.cos(math.pi / 4.0 / _CORNERS), quad_segs=_CORNERS
    )
    up_m = float(flown.lifted_m[rows].max()) + error_m
    return Volume(
        outline_m=np.array(outline.exterior.coords)[:-1],
        low_m=float(flown.control_m[rows, :, 2].min()) - up_m,
        high_m=float(flown.control_m[rows, :, 2].max()) + up_m,
        start_s=float((flown.start_s - flown.slack_s)[rows].min()),
        end_s=float(
            (flown.end_s + flown.slack_s + flown.late_s[:, 1] + flown.longer_s)[rows].max()
        ),
    )
