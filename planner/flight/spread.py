"""A quantity that is not known exactly."""

from __future__ import annotations

import math

from planner.frozen import frozen


@frozen
class Spread:
    """A normally distributed quantity, for example a payload of 0.5 ± 0.1 kg."""

    mean: float
    sd: float
    """Standard deviation. [unit of the mean]"""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd >= 0.0):
            msg = f"a spread is a number ± zero or more, got {self.mean} ± {self.sd}"
            raise ValueError(msg)


def divided(value: float | Spread) -> tuple[float, float]:
    """Return the mean and the standard deviation, zero for what is known exactly."""
    return (value.mean, value.sd) if isinstance(value, Spread) else (value, 0.0)


def joined(mean: float, sd: float) -> float | Spread:
    """Return a quantity of a mean and a standard deviation, a number where it is known exactly."""
    return Spread(mean=mean, sd=sd) if sd else mean
