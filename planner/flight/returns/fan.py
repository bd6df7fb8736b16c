"""The fan of returns: the lines a vehicle may fly home along, from every place of its flight."""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns, lengths
from planner.flight.path import FlightLines, refuse_endless
from planner.flight.returns.path import along_m
from planner.mission.route.stage import StageKind
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.arrays import FloatArray, IntArray
    from planner.flight.returns.path import ReturnPoints, Returns
    from planner.mission.route.stage import ReturnPath

_HALVINGS = 20
"""The place from which on returns lead elsewhere is found to a millionth of a stretch."""
_MOST_SWITCHES = 8
"""Places of such a kind on one stretch of `_ONE_CHOICE_M`."""
_ONE_CHOICE_M = 100.0
"""Where returns may lead to several places, stretches are no longer. [m]"""


class ReturnFan(Columns, eq=False):
    """Returns from n stretches of the flight: all of a stretch lie between those of its two ends."""

    stretch: IntArray
    """Stretch asked for that each is, or is part of, rising. (n,)"""
    stage: IntArray
    """Position in the route's stages. (n,)"""
    destination: IntArray
    """Where the vehicle itself would return to, as in `planner.flight.returns.destination`. (n,)"""
    corners_m: FloatArray
    """Where it decides, stops, sets out, arrives over its target, lands. (n, 2, 5, 3) [m]"""


def return_fan(
    returns: Returns, time_s: FloatArray, stage: IntArray
) -> tuple[ReturnFan, FlightLines]:
    """Return the returns from stretches of the flight, and the lines they follow along the mission.

    Parameters
    ----------
    returns : Returns
        The flight and the rules by which it can be broken off.
    time_s : ndarray
        Of the flight, at both ends of each stretch, at least one. (n, 2) [s]
    stage : ndarray of int
        Stage each stretch is of. (n,)
    """
    stretch = np.arange(len(stage))
    places = returns.destinations
    if not places.along and (len(places.rally_ground_m) or places.landing is not None):
        ends = [_points(returns, own_s, stage).place_m for own_s in time_s.T]
        parts = np.ceil(lengths((ends[1] - ends[0])[:, :2]) / _ONE_CHOICE_M).astype(np.intp)
        parts = np.maximum(parts, 1)
        refuse_endless(int(parts.sum()))
        stretch = np.repeat(stretch, parts)
        number = np.arange(len(stretch)) - np.repeat(np.cumsum(parts) - parts, parts)
        shares = np.stack((number, number + 1), axis=1) / parts[stretch, None]
        begin_s, spent_s = time_s[stretch, :1], np.diff(time_s[stretch], axis=1)
        stretch, time_s = _switched(returns, stage, stretch, begin_s + shares * spent_s)
    stage = stage[stretch]
    count = len(stage)
    points = _points(returns, time_s.T.ravel(), np.tile(stage, 2))
    destination = returns.chosen(points)[:count]
    corners_m, paths = returns.straight_corners_m(points, np.tile(destination, 2))
    fan = ReturnFan(
        stretch=stretch,
        stage=stage,
        destination=destination,
        corners_m=np.stack((corners_m[:count], corners_m[count:]), axis=1),
    )
    return fan, _lines_along({id(path): path for path in paths[:count]}.values())


def _points(returns: Returns, time_s: FloatArray, stage: IntArray) -> ReturnPoints:
    return replace(returns.points(*returns.at(time_s)), stage=stage)


def _switched(
    returns: Returns, stage: IntArray, stretch: IntArray, time_s: FloatArray
) -> tuple[IntArray, FloatArray]:
    """Return parts of stretches, divided where returns begin to lead elsewhere."""

    def chosen(rows: IntArray, at_s: FloatArray) -> IntArray:
        return returns.chosen(_points(returns, at_s, stage[stretch[rows]]))

    for _ in range(_MOST_SWITCHES):
        every = np.arange(len(stretch))
        first = chosen(every, time_s[:, 0])
        rows = np.flatnonzero(first != chosen(every, time_s[:, 1]))
        if not len(rows):
            break
        low_s, high_s = time_s[rows].T.copy()
        for _ in range(_HALVINGS):
            middle_s = 0.5 * (low_s + high_s)
            is_same = chosen(rows, middle_s) == first[rows]
            low_s, high_s = np.where(is_same, middle_s, low_s), np.where(is_same, high_s, middle_s)
        after_s = np.stack((high_s, time_s[rows, 1]), axis=1)
        time_s[rows, 1] = low_s
        stretch, time_s = np.concatenate((stretch, stretch[rows])), np.vstack((time_s, after_s))
        order = np.lexsort((time_s[:, 0], stretch))
        stretch, time_s = stretch[order], time_s[order]
    return stretch, time_s


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
