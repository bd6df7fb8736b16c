"""A number with its standard error."""

from __future__ import annotations

from dataclasses import dataclass
from statistics import NormalDist


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """A number that was measured, and how well."""

    name: str
    value: float
    error: float
    """Standard error, in the unit of the value."""

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the interval that holds the truth with a probability, errors taken as normal."""
        half = NormalDist().inv_cdf(0.5 + 0.5 * confidence) * self.error
        return self.value - half, self.value + half
