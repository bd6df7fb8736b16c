"""Series: one quantity as a log has it, samples at their own times; and the clock of a log."""

from __future__ import annotations

import itertools
from typing import TYPE_CHECKING, Self

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.logs.record import STEP_S
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding


LEAST_GAP_S = 1.0
"""A silence shorter than this is bridged by a straight line, whatever the rate. [s]"""
GAP_INTERVALS = 3.0
"""Nor is a silence a gap before it is this many times the usual time between samples. [-]"""


class Series(Value, eq=False):
    """Samples of one quantity, finite and in the order of time."""

    time_s: FloatArray
    """On the log's own clock, rising. [s]"""
    values: FloatArray
    """In the unit of the column it becomes."""
    found_in: str
    """Message and fields of the log."""
    period: float | None = None
    """360 for angles, which are interpolated the short way round."""
    is_event: bool = False
    """Whether a value holds until the next one, instead of moving there on a straight line."""

    @classmethod
    def of(
        cls,
        time_s: npt.ArrayLike,
        values: npt.ArrayLike,
        found_in: str,
        *,
        period: float | None = None,
        is_event: bool = False,
    ) -> Self:
        """Return a series of what is finite of the samples, sorted, the last of equal times kept."""
        times, samples = np.asarray(time_s, np.float64), np.asarray(values, np.float64)
        known = np.isfinite(times) & np.isfinite(samples)
        times, samples = times[known], samples[known]
        order = np.argsort(times, kind="stable")
        times, samples = times[order], samples[order]
        last = np.append(times[1:] > times[:-1], [True])[: len(times)]
        return cls(
            time_s=times[last],
            values=samples[last],
            found_in=found_in,
            period=period,
            is_event=is_event,
        )

    def __len__(self) -> int:
        return len(self.time_s)

    @property
    def interval_s(self) -> float | None:
        """Usual time between samples; ``None`` where there are not two."""
        return float(np.median(np.diff(self.time_s))) if len(self) > 1 else None

    @property
    def rate_hz(self) -> float | None:
        """Usual rate of the samples; ``None`` for events, and where there are not two samples."""
        return None if self.is_event or self.interval_s is None else 1.0 / self.interval_s

    def between(self, begin_s: float, end_s: float) -> Self:
        """Return the samples from one time to another, both included."""
        chosen = slice(
            np.searchsorted(self.time_s, begin_s), np.searchsorted(self.time_s, end_s, "right")
        )
        return replace(self, time_s=self.time_s[chosen], values=self.values[chosen])

    def at(self, time_s: FloatArray) -> FloatArray:
        """Return the values at other times, NaN where there are no samples.

        Events hold until the next.  Everything else moves on straight lines between neighbours,
        but not across a gap: a silence of more than :data:`GAP_INTERVALS` usual intervals and of
        more than :data:`LEAST_GAP_S`.  A value before the first or after the last sample is
        theirs for the usual interval.
        """
        if not len(self):
            return np.full(time_s.shape, np.nan)
        if self.is_event:
            before = np.searchsorted(self.time_s, time_s, side="right") - 1
            return np.where(before >= 0, self.values[np.maximum(before, 0)], np.nan)
        usual_s = self.interval_s or 0.0
        path = self.values if self.period is None else np.unwrap(self.values, period=self.period)
        values = np.interp(time_s, self.time_s, path)
        after = np.searchsorted(self.time_s, time_s, side="left")
        before = np.searchsorted(self.time_s, time_s, side="right") - 1
        last = len(self) - 1
        silence_s = self.time_s[np.minimum(after, last)] - self.time_s[np.maximum(before, 0)]
        is_unknown = silence_s > max(LEAST_GAP_S, GAP_INTERVALS * usual_s)
        is_unknown |= time_s < self.time_s[0] - usual_s
        is_unknown |= time_s > self.time_s[-1] + usual_s
        return np.where(is_unknown, np.nan, values)

    def mean_at(self, time_s: FloatArray) -> FloatArray:
        """Return the mean around each of even times, so that the integral of a fast signal is kept.

        The times are :data:`~planner.logs.record.STEP_S` apart.  Where the log has fewer than two
        samples a step, this is :meth:`at`.
        """
        values = self.at(time_s)
        if self.interval_s is None or self.interval_s > STEP_S / 2.0 or not len(time_s):
            return values
        cell = np.floor((self.time_s - time_s[0]) / STEP_S + 0.5)
        inside = (cell >= 0) & (cell < len(time_s))
        cells = cell[inside].astype(np.int64)
        counts = np.bincount(cells, minlength=len(time_s))
        sums = np.bincount(cells, weights=self.values[inside], minlength=len(time_s))
        filled = counts > 0
        values[filled] = sums[filled] / counts[filled]
        return values


_BACK_S = 1.0
"""Messages are written in the order of time but for less than this. [s]"""
_MOST_STRAYS = 5
"""So many messages in a row may be out of time; more of them are another run of the clock."""


LOG_CLOCK = Rule(
    "R103 log-clock",
    Severity.WARNING,
    summary="The clock of a log goes backwards.",
    why="Times before and after cannot be compared: speeds and energies over the jump are wrong.",
    how="A message is more than 1 s older than the one before, in a ULog than the one of its topic.  "
    "Where the clock continues from there the log is cut in two, a ULog's topic left out; single "
    "messages out of time are left out.",
    fix="nothing, if the autopilot was restarted; else mistrust the log",
)


class Clock(Value, eq=False):
    """Places and times of the timed messages of a log, strays left out."""

    places: IntArray
    """Where in the log, rising: byte, line or number of the message."""
    time_s: FloatArray
    restarts: tuple[int, ...]
    """Places at which the clock restarts."""
    strays: int
    """Messages out of time, left out."""

    @classmethod
    def of(cls, places: IntArray, time_s: FloatArray) -> Self:
        """Return the clock that timed messages show.

        A few messages that are more than a second ahead of those after them, or after those before
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
            after = time_s[drop + 1 : drop + 2 + _MOST_STRAYS] < time_s[drop] - _BACK_S
            if not np.all(ahead):
                is_stray[drop - int(np.argmin(ahead[::-1])) + 1 : drop + 1] = True
            elif not np.all(after) or len(after) <= _MOST_STRAYS:
                count = int(np.argmin(after)) if not np.all(after) else len(after)
                is_stray[drop + 1 : drop + 1 + count] = True
            else:
                restarts.append(int(places[drop + 1]))
        return cls(
            places=places[~is_stray],
            time_s=time_s[~is_stray],
            restarts=tuple(restarts),
            strays=int(np.sum(is_stray)),
        )

    @property
    def is_long(self) -> bool:
        """Whether it has messages enough to show a restart."""
        return len(self.time_s) > 2 * _MOST_STRAYS

    def runs(self) -> Iterator[tuple[int, int]]:
        """Return first place and place after the last of each run, all places in one of them."""
        yield from itertools.pairwise((0, *self.restarts, np.iinfo(np.int64).max))

    def is_in_time(self, places: IntArray) -> BoolArray:
        """Return which of timed messages are no strays."""
        if not len(self.places):
            return np.zeros(places.shape, np.bool_)
        nearest = np.minimum(np.searchsorted(self.places, places), len(self.places) - 1)
        is_kept: BoolArray = self.places[nearest] == places
        return is_kept

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
                f"{source}: out of time and left out: {quantity.count(self.strays, 'message')}"
            )


def euler_angles_deg(
    w: FloatArray, x: FloatArray, y: FloatArray, z: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return roll and yaw in [−180, 180] and pitch in [−90, 90] of unit quaternions, scalar first. [°]

    They turn from the body to its frame of reference: yaw, pitch, roll, about axes forward, right,
    down in a frame north, east, down (Diebel, "Representing Attitude", 2006, section 8.2).
    """
    roll = np.arctan2(2.0 * (w * x + y * z), 1.0 - 2.0 * (x * x + y * y))
    pitch = np.arcsin(np.clip(2.0 * (w * y - z * x), -1.0, 1.0))
    yaw = np.arctan2(2.0 * (w * z + x * y), 1.0 - 2.0 * (y * y + z * z))
    return np.degrees(roll), np.degrees(pitch), np.degrees(yaw)


def wind_north_east_m_s(
    speed_m_s: FloatArray, from_deg: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the velocity of air that comes from a direction, northward and eastward. [m/s]"""
    origin = np.radians(from_deg)
    return -speed_m_s * np.cos(origin), -speed_m_s * np.sin(origin)
