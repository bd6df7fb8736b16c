"""The clock of a log: where it restarts, and what time untimed messages were written at."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Self

import numpy as np

from planner import numbers
from planner.catalogue.flight_log import LOG_CLOCK
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.logs.record import BoolArray, FloatArray, IntArray

_BACK_S = 1.0
"""Messages are written in the order of time but for less than this. [s]"""
_MOST_STRAYS = 5
"""So many messages in a row may be out of time; more of them are another run of the clock."""


@frozen(eq=False)
class Clock:
    """Places and times of the timed messages of a log, strays left out."""

    places: IntArray
    """Where in the log, rising: byte, line or number of the message."""
    time_s: FloatArray
    restarts: tuple[int, ...]
    """Places at which the clock begins anew."""
    strays: int
    """Messages out of time, left out."""

    @classmethod
    def of(cls, places: IntArray, time_s: FloatArray) -> Self:
        """Return the clock that timed messages show.

        A few messages that are more than a second ahead of those after them, or behind those before
        them, are strays; where there are many on both sides the clock has restarted.
        """
        order = np.argsort(places, kind="stable")
        places, time_s = places[order], time_s[order]
        kept = np.isfinite(time_s)
        places, time_s = places[kept], time_s[kept]
        is_stray = np.zeros(time_s.shape, np.bool_)
        restarts: list[int] = []
        for drop in np.flatnonzero(np.diff(time_s) < -_BACK_S).tolist():
            ahead = time_s[max(drop - _MOST_STRAYS, 0) : drop + 1] > time_s[drop + 1] + _BACK_S
            behind = time_s[drop + 1 : drop + 2 + _MOST_STRAYS] < time_s[drop] - _BACK_S
            if not np.all(ahead):
                is_stray[drop - int(np.argmin(ahead[::-1])) + 1 : drop + 1] = True
            elif not np.all(behind) or len(behind) <= _MOST_STRAYS:
                count = int(np.argmin(behind)) if not np.all(behind) else len(behind)
                is_stray[drop + 1 : drop + 1 + count] = True
            else:
                restarts.append(int(places[drop + 1]))
        return cls(
            places=places[~is_stray],
            time_s=time_s[~is_stray],
            restarts=tuple(restarts),
            strays=int(np.sum(is_stray)),
        )

    def runs(self) -> Iterator[tuple[int, int]]:
        """Return first place and place behind the last of each run, all places in one of them."""
        yield from itertools.pairwise((0, *self.restarts, np.iinfo(np.int64).max))

    def is_in_time(self, places: IntArray) -> BoolArray:
        """Return which of timed messages are no strays."""
        return np.isin(places, self.places)

    def time_at_s(self, places: IntArray) -> FloatArray:
        """Return the time of the last timed message before each place; the first one's before it."""
        before = np.searchsorted(self.places, places, side="right") - 1
        return self.time_s[np.maximum(before, 0)]

    def findings(self, source: str) -> Iterator[Finding]:
        """Return what is odd about the clock."""
        if self.restarts:
            first = np.searchsorted(self.places, self.restarts[0]) - 1
            yield LOG_CLOCK.finding(
                f"{source}: the clock restarts after {self.time_s[first]:.1f} s: the log is read as "
                f"{len(self.restarts) + 1} recordings"
            )
        if self.strays:
            yield LOG_CLOCK.finding(
                f"{source}: out of time and left out: {numbers.count(self.strays, 'message')}"
            )
