"""The common time base of one flight, and the series of its recording brought onto it."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.logs.record import STEP_S

if TYPE_CHECKING:
    from planner.logs.flights import FlightSpan
    from planner.logs.record import FloatArray
    from planner.logs.recording import Recording


@frozen(eq=False)
class Column:
    """A quantity on the time base of a flight."""

    values: FloatArray
    """NaN where it is not known."""
    found_in: str
    """Message and fields of the log, or what it is computed from."""
    rate_hz: float | None
    """Rate of the samples in the log."""

    @property
    def is_known(self) -> bool:
        """Whether there is a value at all."""
        return bool(np.isfinite(self.values).any())

    def else_from(self, other: Column) -> Column:
        """Return the column with what it does not know filled from another."""
        known = np.isfinite(self.values)
        if not np.any(np.isfinite(other.values[~known])):
            return self
        return replace(
            self,
            values=np.where(known, self.values, other.values),
            found_in=f"{self.found_in}, else {other.found_in}",
        )

    def plus(self, offset: float) -> Column:
        """Return the column with an offset added."""
        return replace(self, values=self.values + offset)


@frozen(eq=False)
class Grid:
    """The times of a record's samples."""

    recording: Recording
    span: FlightSpan
    time_s: FloatArray
    """On the recording's clock, :data:`~planner.logs.record.STEP_S` apart. [s]"""

    @classmethod
    def of(cls, recording: Recording, span: FlightSpan) -> Grid:
        """Return the grid of a flight: from its beginning, as far as it goes."""
        # The nudge keeps the last sample of a flight of whole steps.
        count = int((span.end_s - span.begin_s) / STEP_S + 1e-6) + 1
        return cls(
            recording=recording,
            span=span,
            time_s=span.begin_s + np.arange(count, dtype=np.float64) * STEP_S,
        )

    def column(self, name: str, *, is_mean: bool = False) -> Column | None:
        """Return a series of the recording on the grid; ``None`` where it tells nothing here."""
        series = self.recording.series.get(name)
        if series is None:
            return None
        values = series.mean_at(self.time_s) if is_mean else series.at(self.time_s)
        if series.period is not None:
            values %= series.period
        column = Column(values=values, found_in=series.found_in, rate_hz=series.rate_hz)
        return column if column.is_known else None

    def together(self, values: FloatArray, found_in: str, *sources: Column) -> Column:
        """Return a column computed from others; its rate is that of the slowest."""
        rates = [source.rate_hz for source in sources if source.rate_hz is not None]
        return Column(values=values, found_in=found_in, rate_hz=min(rates, default=None))
