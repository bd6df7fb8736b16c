"""One quantity as a log has it: samples at their own times; and the way onto a common time base."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING, Self

import numpy as np

from planner.frozen import frozen
from planner.logs.record import STEP_S

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.logs.record import FloatArray

LEAST_GAP_S = 1.0
"""A silence shorter than this is bridged by a straight line, whatever the rate. [s]"""
GAP_INTERVALS = 3.0
"""Nor is a silence a gap before it is this many times the usual time between samples. [-]"""


@frozen(eq=False)
class Series:
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
        """Return the values at other times, NaN where the samples do not tell.

        Events hold until the next.  Everything else moves on straight lines between neighbours,
        but not across a gap: a silence of more than :data:`GAP_INTERVALS` usual intervals and of
        more than :data:`LEAST_GAP_S`.  A value before the first or after the last sample is
        theirs for the usual interval.

        Parameters
        ----------
        time_s : ndarray
            Times on the log's clock, in any order. [s]

        Returns
        -------
        ndarray
            Values, of the same shape.
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

        Where the log has fewer than two samples a step, this is :meth:`at`.

        Parameters
        ----------
        time_s : ndarray
            Times on the log's clock, :data:`~planner.logs.record.STEP_S` apart. [s]

        Returns
        -------
        ndarray
            Values, of the same shape.
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
