"""Which model is looked for: orders, what is known beforehand, and how it is parameterised.

The denominator is a product of factors, :math:`s^2 + a_1 s + a_0` and for odd orders one
:math:`s + p`, with positive coefficients: every stable denominator can be written so, and no
other.  Up to the second order the coefficients of the factors are those of the denominator.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.physics.response import MAX_ORDER, TransferFunction
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import FloatArray


_SMALLEST_FACTOR = 1e-6
"""Nothing that is flown changes over a million seconds. [rad/s]"""


class Structure(Value):
    """Orders of a transfer function with delay, and its steady gain where that is known.

    Raises
    ------
    ValueError
        If the degrees are out of range, or a gain is not finite.
    """

    numerator_degree: int
    """Number of zeros."""
    denominator_degree: int
    """Number of poles."""
    steady_gain: float | None = None
    """Gain at s = 0 where it is known, 1 for a vehicle that arrives where it is sent. [-]"""

    def __post_init__(self) -> None:
        if not 0 <= self.numerator_degree < self.denominator_degree <= MAX_ORDER:
            msg = (
                f"a structure needs fewer zeros than poles, and {MAX_ORDER} poles at most, got "
                f"{self.numerator_degree} and {self.denominator_degree}"
            )
            raise ValueError(msg)
        if self.steady_gain is not None and not math.isfinite(self.steady_gain):
            msg = f"a steady gain must be finite, got {self.steady_gain}"
            raise ValueError(msg)

    @property
    def coefficient_names(self) -> tuple[str, ...]:
        """Names in the order of :meth:`coefficients`: b from the highest power, a, delay_s."""
        return (
            *(f"b{power}" for power in range(self.numerator_degree, -1, -1)),
            *(f"a{power}" for power in range(self.denominator_degree - 1, -1, -1)),
            "delay_s",
        )

    @property
    def numerator_size(self) -> int:
        """Number of numerator coefficients, known ones included."""
        return self.numerator_degree + 1

    @property
    def free_size(self) -> int:
        """Number of parameters that are fitted."""
        return len(self.coefficient_names) - (self.steady_gain is not None)

    def denominator(self, factors: FloatArray) -> FloatArray:
        """Monic denominator from the coefficients of its factors, descending powers of s."""
        product = np.ones(1)
        for i in range(0, self.denominator_degree - 1, 2):
            product = np.convolve(product, [1.0, factors[i], factors[i + 1]])
        if self.denominator_degree % 2:
            product = np.convolve(product, [1.0, factors[-1]])
        return product

    def factor_sizes(self, factors: FloatArray) -> FloatArray:
        """Return what is a change worth speaking of: a₁ of an undamped pair is 0, its ω_n is not."""
        sizes = np.maximum(factors, _SMALLEST_FACTOR)
        first = slice(0, self.denominator_degree - 1, 2)
        second = slice(1, self.denominator_degree, 2)
        sizes[first] = np.maximum(sizes[first], np.sqrt(sizes[second]))
        return sizes

    def denominator_slopes(self, factors: FloatArray) -> FloatArray:
        """Return the derivatives of the denominator, but for its leading one, to the factors.

        Returns
        -------
        ndarray, shape (n, n)
            Row: coefficient; column: coefficient of a factor.
        """
        # a denominator is linear in each coefficient of a factor: differences are exact
        base = self.denominator(factors)
        unit = np.eye(self.denominator_degree)
        columns = [self.denominator(factors + step)[1:] - base[1:] for step in unit]
        return np.stack(columns, axis=-1)

    def coefficients(self, parameters: FloatArray) -> FloatArray:
        """Coefficients and delay from the free parameters.

        Parameters
        ----------
        parameters : ndarray, shape (free_size,)
            Free numerator coefficients, coefficients of the factors, delay.

        Returns
        -------
        ndarray
            In the order of :attr:`coefficient_names`.
        """
        factors = self.factors(parameters)
        denominator = self.denominator(factors)[1:]
        numerator = parameters[: parameters.size - factors.size - 1]
        if self.steady_gain is not None:
            numerator = np.append(numerator, self.steady_gain * denominator[-1])
        return np.concatenate([numerator, denominator, parameters[-1:]])

    def coefficient_slopes(self, parameters: FloatArray) -> FloatArray:
        """Return the derivatives of :meth:`coefficients`, shape (names, free_size)."""
        factors = self.factors(parameters)
        poles, zeros = factors.size, self.numerator_size
        free = parameters.size - poles - 1
        slopes = np.zeros((zeros + poles + 1, parameters.size))
        slopes[:free, :free] = np.eye(free)
        slopes[zeros:-1, free:-1] = self.denominator_slopes(factors)
        slopes[-1, -1] = 1.0
        if self.steady_gain is not None:
            slopes[zeros - 1] = self.steady_gain * slopes[-2]
        return slopes

    def factors(self, parameters: FloatArray) -> FloatArray:
        """Coefficients of the factors of the denominator among the free parameters."""
        return parameters[-1 - self.denominator_degree : -1]

    def transfer_function(self, coefficients: FloatArray) -> TransferFunction:
        """Model of coefficients in the order of :attr:`coefficient_names`."""
        return TransferFunction(
            numerator=tuple(coefficients[: self.numerator_size]),
            denominator=(1.0, *coefficients[self.numerator_size : -1]),
            delay_s=float(coefficients[-1]),
        )


MOTION = Structure(numerator_degree=0, denominator_degree=2)
"""Altitude and speed, G1 and G4 of the article."""
FOLLOWING = Structure(numerator_degree=0, denominator_degree=1)
"""How a vehicle follows a reference that was shaped for it."""
POWER = Structure(numerator_degree=1, denominator_degree=2)
"""Power of a climb, a descent or a stop, G2, G3 and G5."""
POWER_WITHOUT_ZERO = Structure(numerator_degree=0, denominator_degree=2)
"""Power whose zero the manoeuvres do not show."""
