"""Start times of two flights at which they come too near to each other.

Where a vehicle is does not depend on when it starts: pairs of short parts that are near each other give
the differences of starts that may be too near, and the ends of these are then moved together as far as
the closest approach at every start in between allows.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import closest_approach
from planner.fleet.trajectory import AT_REST_S
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.arrays import FloatArray
    from planner.fleet.approach import Meeting

ROUND_S = 1e-3
"""Ends of intervals are found to this, on the safe side, unless asked otherwise. [s]"""
_SHORT_S, _SHORT_ROUNDS = 1.0, 10.0
"""Parts are so short when their ends are looked at, or so many times what these are found to. [s], [-]"""
_MOST_ROUNDS = 60


class ClosedShifts:
    """At which starts of the second after the first two flights come too near to each other.

    Every start outside of the intervals is clear; not every one inside is too near: what is clear for
    less than a few seconds may be lost.

    Parameters
    ----------
    meeting : Meeting
        Both flights, and what they keep apart by; its ``later_s`` counts for nothing.
    within_m : float
        What is not nearer is not too near; the radius of a zone by default. [m]
    is_clear : callable, optional
        Whether nothing comes too near at any start between two; by default, whether both do not. Where
        the first stands for more than it is, such as all returns from an interval, this looks closer.
    round_s : float
        To what the ends of the intervals are found, on the safe side. [s]
    """

    def __init__(
        self,
        meeting: Meeting,
        *,
        within_m: float = math.inf,
        is_clear: Callable[[float, float], bool] | None = None,
        round_s: float = ROUND_S,
    ) -> None:
        self._meeting = meeting
        self._within_m = within_m
        if meeting.zone is not None:
            self._within_m = min(within_m, meeting.zone.horizontal_m)
        self._is_clear = is_clear or self._is_apart
        self._round_s = round_s
        self._rough = [
            *_joined(*_near_shifts(meeting, self._within_m, max(_SHORT_S, _SHORT_ROUNDS * round_s)))
        ]
        self._found: dict[tuple[float, float], tuple[float, float] | None] = {}

    def __iter__(self) -> Iterator[tuple[float, float]]:
        """Yield open intervals, rising; infinite where every start beyond is too near. [s]"""
        return (found for one in self._rough if (found := self._ends(one)) is not None)

    def around(self, later_s: float) -> tuple[float, float] | None:
        """Return the interval that a start is in; ``None``: it is clear. [s]"""
        for one in self._rough:
            if one[0] < later_s < one[1]:
                found = self._ends(one)
                if found is not None and found[0] < later_s < found[1]:
                    return found
        return None

    def _ends(self, rough: tuple[float, float]) -> tuple[float, float] | None:
        """Return an interval whose ends are moved together as far as they are clear."""
        if rough not in self._found:
            begin_s, end_s = rough
            if math.isfinite(begin_s):
                begin_s = _moved(self._is_clear, begin_s, end_s, self._round_s)
            if math.isfinite(end_s):
                end_s = _moved(self._is_clear, end_s, begin_s, self._round_s)
            self._found[rough] = (begin_s, end_s) if begin_s < end_s else None
        return self._found[rough]

    def _is_apart(self, low_s: float, high_s: float) -> bool:
        between_s, meeting = 0.5 * (high_s - low_s), self._meeting
        nearest = closest_approach(
            meeting.first,
            meeting.second,
            second_later_s=low_s + between_s,
            shift_s=meeting.shift_s + between_s,
            second_above_m=meeting.above_m,
            within_m=self._within_m,
            accuracy_m=self._within_m,
            zone=meeting.zone,
        )
        return nearest is None


def _near_shifts(
    meeting: Meeting, within_m: float, short_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return between which starts pairs of short parts that are near are flown at the same time. [s]"""
    always = replace(meeting, later_s=0.0, shift_s=4.0 * AT_REST_S)
    one, two = always.sides(within_m)
    low_s, high_s = [np.zeros(0)], [np.zeros(0)]
    for _ in range(_MOST_ROUNDS):
        one, two = always.near(one, two, within_m)
        if not len(one.part):
            break
        moves = [
            np.where(flight.is_rest[side.part], 0.0, side.end_s - side.start_s)
            for flight, side in ((meeting.first, one), (meeting.second, two))
        ]
        is_short = np.maximum(*moves) <= short_s
        slack_s = meeting.first.slack_s[one.part] + meeting.second.slack_s[two.part]
        slack_s = (slack_s + meeting.shift_s)[is_short]
        later_s, sooner_s = meeting.late_s(one.part, two.part)
        low_s.append((one.start_s - two.end_s - later_s)[is_short] - slack_s)
        high_s.append((one.end_s - two.start_s + sooner_s)[is_short] + slack_s)
        rest = np.flatnonzero(~is_short)
        is_first = (moves[0] >= moves[1])[rest]
        one, two = one.select(rest).halves(is_first), two.select(rest).halves(~is_first)
    return np.concatenate(low_s), np.concatenate(high_s)


def _joined(low_s: FloatArray, high_s: FloatArray) -> Iterator[tuple[float, float]]:
    """Yield intervals that do not touch, rising; those that end in a rest are without an end."""
    order = np.argsort(low_s, kind="stable")
    low_s, high_s = low_s[order], np.maximum.accumulate(high_s[order])
    is_apart = low_s[1:] > high_s[:-1]
    begins = low_s[np.append(True, is_apart)[: len(low_s)]]
    ends = high_s[np.append(is_apart, True)[: len(low_s)]]
    for begin, end in zip(begins.tolist(), ends.tolist(), strict=True):
        yield (
            -math.inf if begin < -0.5 * AT_REST_S else begin,
            math.inf if end > 0.5 * AT_REST_S else end,
        )


def _moved(
    is_clear: Callable[[float, float], bool], end_s: float, limit_s: float, round_s: float
) -> float:
    """Return how far from an end of an interval towards a limit every start is clear. [s]"""
    sign = math.copysign(1.0, limit_s - end_s)
    clear_s, step_s = end_s, 4.0 * _SHORT_S
    while True:
        blocked_s = clear_s + sign * min(step_s, abs(limit_s - clear_s))
        if not is_clear(min(clear_s, blocked_s), max(clear_s, blocked_s)):
            break
        clear_s, step_s = blocked_s, 2.0 * step_s
        if clear_s == limit_s or step_s > AT_REST_S:
            return clear_s
    while abs(blocked_s - clear_s) > round_s:
        middle_s = 0.5 * (clear_s + blocked_s)
        if is_clear(min(clear_s, middle_s), max(clear_s, middle_s)):
            clear_s = middle_s
        else:
            blocked_s = middle_s
    return clear_s
