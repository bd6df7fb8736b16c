"""A fitted response: the model, and how well each of its numbers is known."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from planner.frozen import frozen
from planner.identify.estimate import Estimate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.identify.noise import Noise
    from planner.identify.structure import Structure
    from planner.physics.response import TransferFunction

FloatArray = npt.NDArray[np.float64]

_TIME_CONSTANTS = 4.0
"""exp(-4) is 2 %."""


@frozen(eq=False)
class ResponseFit:
    """A transfer function fitted to manoeuvres."""

    structure: Structure
    transfer_function: TransferFunction
    covariance: FloatArray
    """Of the coefficients in the order of ``structure.coefficient_names``."""
    noises: Mapping[str, Noise]
    """What the fit left over, by source. [output]"""
    criterion: float
    """Schwarz's criterion, to compare fits of the same manoeuvres: the less the better. [-]"""
    samples: int
    """Number of samples fitted."""
    manoeuvres: int
    """Number of manoeuvres fitted."""

    @property
    def coefficients(self) -> FloatArray:
        """Values in the order of ``structure.coefficient_names``."""
        system = self.transfer_function
        missing = self.structure.numerator_size - len(system.numerator)
        return np.array(
            [0.0] * missing + [*system.numerator, *system.denominator[1:], system.delay_s]
        )

    @property
    def window_s(self) -> float:
        """How long after a command a power response is used [s].

        Delay and one damped period, as the article's models are read; for a system that does not
        swing delay and four of its slowest time constants, after which 2 % are left.
        """
        system = self.transfer_function
        period_s = system.damped_period_s
        if period_s is None:
            slowest = min(-pole.real for pole in system.poles)
            period_s = _TIME_CONSTANTS / max(slowest, 1e-9)
        return system.delay_s + period_s

    @property
    def estimates(self) -> tuple[Estimate, ...]:
        """Every coefficient and the delay, then steady gain, and frequency and damping if any."""
        rows = [
            Estimate(name=name, value=float(value), error=math.sqrt(max(variance, 0.0)))
            for name, value, variance in zip(
                self.structure.coefficient_names,
                self.coefficients,
                np.diagonal(self.covariance),
                strict=True,
            )
        ]
        return (*rows, *self._derived())

    def estimate(self, name: str) -> Estimate:
        """Return one of the estimates by its name.

        Raises
        ------
        KeyError
            If there is none of that name.
        """
        for row in self.estimates:
            if row.name == name:
                return row
        raise KeyError(name)

    def _derived(self) -> tuple[Estimate, ...]:
        """Figures that follow from the coefficients, by linear propagation of error."""
        names = self.structure.coefficient_names
        at = {name: position for position, name in enumerate(names)}
        value = dict(zip(names, self.coefficients, strict=True))
        a0, b0 = float(value["a0"]), float(value["b0"])
        rows = [("steady_gain", b0 / a0, {"b0": 1.0 / a0, "a0": -b0 / a0**2})]
        if self.structure.denominator_degree == 2:
            frequency = math.sqrt(a0)
            a1 = float(value["a1"])
            rows += [
                ("natural_frequency_rad_s", frequency, {"a0": 0.5 / frequency}),
                (
                    "damping_ratio",
                    0.5 * a1 / frequency,
                    {"a1": 0.5 / frequency, "a0": -0.25 * a1 / frequency**3},
                ),
            ]
        estimates = []
        for name, number, slopes in rows:
            gradient = np.zeros(len(names))
            for coefficient, slope in slopes.items():
                gradient[at[coefficient]] = slope
            variance = float(gradient @ self.covariance @ gradient)
            estimates.append(Estimate(name=name, value=number, error=math.sqrt(max(variance, 0.0))))
        return tuple(estimates)
