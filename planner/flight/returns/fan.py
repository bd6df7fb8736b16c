"""The fan of returns: the lines a vehicle may fly home along, from every place of its flight."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.flight.path import FlightLines
from planner.flight.returns.path import along_m
from planner.mission.route.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.arrays import FloatArray, IntArray
    from planner.flight.returns.path import Returns
    from planner.mission.route.stage import ReturnPath

_SWITCH_SHARE = 2.0**-20
"""Of a stretch: so near the place is found from which on returns lead elsewhere. [-]"""
_MOST_SWITCHES = 8
"""Places of such a kind on one stretch of `_ONE_CHOICE_M`."""
_ONE_CHOICE_M = 100.0
"""Where returns may lead to several places, stretches are no longer. [m]"""


class ReturnFan(Columns, eq=False):
    """Returns from n stretches of the flight: all of a stretch lie between those of its two ends."""

    stretch: IntArray
    """Stretch asked for that each is, or is part of, rising. (n,)"""
    segment: IntArray
    fraction: FloatArray
    """Of the segment's time at its ends. (n, 2) [-]"""
    destination: IntArray
    """Where the vehicle itself would return to, as in `planner.flight.returns.destination`. (n,)"""
    corners_m: FloatArray
    """Where it decides, stops, sets out, arrives over its target, lands. (n, 2, 5, 3) [m]"""


def return_fan(
    returns: Returns, segment: IntArray, fraction: FloatArray
) -> tuple[ReturnFan, FlightLines]:
    """Return the returns from stretches of the flight, and the lines they follow along the mission.

    Parameters
    ----------
    returns : Returns
        The flight and the rules by which it can be broken off.
    segment : ndarray of int
        Segment of each stretch, at least one. (n,)
    fraction : ndarray
        Of the time of the segment, at both ends of the stretch. (n, 2) [-]
    """
    stretch = np.arange(len(segment))
    places = returns.destinations
    if not places.along and (len(places.rally_ground_m) or places.landing is not None):
        length_m = returns.flight.motion.segments.distance_m[segment] * np.ptp(fraction, axis=1)
        parts = np.maximum(np.ceil(length_m / _ONE_CHOICE_M), 1.0).astype(np.intp)
        stretch = np.repeat(stretch, parts)
        number = np.arange(len(stretch)) - np.repeat(np.cumsum(parts) - parts, parts)
        shares = np.stack((number, number + 1), axis=1) / parts[stretch, None]
        begin, way = fraction[stretch, :1], np.diff(fraction[stretch], axis=1)
        stretch, fraction = _switched(returns, segment, stretch, begin + shares * way)
    segment = segment[stretch]
    ends = [returns.points(segment, fraction[:, end]) for end in (0, 1)]
    destination = returns.chosen(ends[0])
    corners, paths = zip(
        *(returns.straight_corners_m(one, destination) for one in ends), strict=True
    )
    fan = ReturnFan(
        stretch=stretch,
        segment=segment,
        fraction=fraction,
        destination=destination,
        corners_m=np.stack(corners, axis=1),
    )
    return fan, _lines_along(dict(zip(map(id, paths[0]), paths[0], strict=True)).values())


def _switched(
    returns: Returns, segment: IntArray, stretch: IntArray, fraction: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Return parts of stretches, divided where returns begin to lead elsewhere."""

    def chosen(rows: IntArray, at: FloatArray) -> IntArray:
        return returns.chosen(returns.points(segment[stretch[rows]], at))

    for _ in range(_MOST_SWITCHES):
        every = np.arange(len(stretch))
        first = chosen(every, fraction[:, 0])
        rows = np.flatnonzero(first != chosen(every, fraction[:, 1]))
        if not len(rows):
            break
        low, high = fraction[rows].T.copy()
        step = 1.0
        while step > _SWITCH_SHARE:
            step, middle = 0.5 * step, 0.5 * (low + high)
            is_same = chosen(rows, middle) == first[rows]
            low, high = np.where(is_same, middle, low), np.where(is_same, high, middle)
        after = np.stack((high, fraction[rows, 1]), axis=1)
        fraction[rows, 1] = low
        stretch, fraction = np.concatenate((stretch, stretch[rows])), np.vstack((fraction, after))
        order = np.lexsort((fraction[:, 0], stretch))
        stretch, fraction = stretch[order], fraction[order]
    return stretch, fraction


def _lines_along(paths: Iterable[ReturnPath | None]) -> FlightLines:
    """Return the lines of returns along the mission after their first place, each once."""
    found: dict[tuple[tuple[float, ...], tuple[float, ...]], None] = {}
    # The way of a return from farther on is that of one from before, and more.
    for path in sorted(filter(None, paths), key=lambda one: -len(one.stages)):
        places = [tuple(one) for one in along_m(path, np.zeros(3)).tolist()]
        first = (
            1 if path.stages[0].kind is StageKind.GO else 2
        )  # of the first place, the second is lower
        for begin, end in pairwise(places[first - 1 :]):
            if (begin, end) in found:
                break
            if begin[:2] != end[:2]:  # descents and landings are not ways over ground
                found[begin, end] = None
    lines = np.array(list(found), dtype=np.float64).reshape(-1, 2, 3)
    return FlightLines(start_m=lines[:, 0], end_m=lines[:, 1], owner=np.arange(len(lines)))
