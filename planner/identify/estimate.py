"""A number with its standard error."""

from __future__ import annotations

from statistics import NormalDist

from planner.frozen import frozen


@frozen
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
