r"""Rational transfer functions with a delay, as identified from flights.

.. math:: G(s) = e^{-s T} \frac{b_m s^m + \dots + b_1 s + b_0}{a_n s^n + \dots + a_1 s + a_0},
          \qquad m \le n

========================  ==============  =====================================================
name                      symbol, unit    meaning
========================  ==============  =====================================================
numerator                 b_m … b_0       descending powers of s
denominator               a_n … a_0       descending powers of s, a_n not zero
delay_s                   T, s            dead time between command and answer
dc_gain                   G(0)            steady output over steady input
natural_frequency_rad_s   ω_n, rad s⁻¹    √(a_0 / a_2) of a second-order system
damping_ratio             ζ               a_1 / (2 √(a_0 a_2)) of a second-order system
damped_period_s           s               2π / (ω_n √(1 - ζ²))
mean_residence_time_s     s               T + a_1/a_0 - b_1/b_0, how far the answer lags behind
========================  ==============  =====================================================
"""

from __future__ import annotations

import math
from dataclasses import field
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.physics.clusters import growth_rate
from planner.physics.modes import make_modes, roots

if TYPE_CHECKING:
    from planner.physics.modes import FloatArray, Modes


@frozen
class TransferFunction:
    """One linear system: a proper rational function of s and a delay.

    Raises
    ------
    ValueError
        If a coefficient list is empty or not finite, the leading denominator coefficient is zero,
        the numerator is of higher degree than the denominator, or the delay is negative.
    """

    numerator: tuple[float, ...]
    """Coefficients in descending powers of s."""

    denominator: tuple[float, ...]
    """Coefficients in descending powers of s, the first not zero."""

    delay_s: float = 0.0
    """Dead time. [s]"""

    def __post_init__(self) -> None:
        for name in ("numerator", "denominator"):
            coefficients = tuple(float(c) for c in getattr(self, name))
            if not coefficients:
                msg = f"the {name} of a transfer function needs at least one coefficient"
                raise ValueError(msg)
            if not all(math.isfinite(c) for c in coefficients):
                msg = f"the {name} of a transfer function must be finite, got {coefficients}"
                raise ValueError(msg)
            object.__setattr__(self, name, coefficients)
        if self.denominator[0] == 0.0:
            msg = (
                "the leading denominator coefficient must not be zero, "
                f"got {self.denominator}; leave leading zeros out"
            )
            raise ValueError(msg)
        significant = len(self.numerator)
        while significant > 1 and self.numerator[-significant] == 0.0:
            significant -= 1
        if significant > len(self.denominator):
            msg = (
                f"the transfer function is improper: numerator of degree {significant - 1} over "
                f"denominator of degree {len(self.denominator) - 1}"
            )
            raise ValueError(msg)
        object.__setattr__(self, "numerator", self.numerator[-significant:])
        if not 0.0 <= self.delay_s < math.inf:
            msg = f"delay_s must be finite and not negative, got {self.delay_s}"
            raise ValueError(msg)

    @property
    def order(self) -> int:
        """Degree of the denominator."""
        return len(self.denominator) - 1

    @property
    def poles(self) -> tuple[complex, ...]:
        """Roots of the denominator, imaginary parts descending, integrators last [rad s⁻¹]."""
        last = len(self.denominator)
        while self.denominator[last - 1] == 0.0:
            last -= 1
        found = roots(np.array(self.denominator[:last]))
        return (*(complex(p) for p in found), *(0j,) * (len(self.denominator) - last))

    @property
    def is_stable(self) -> bool:
        """Whether every pole has a negative real part, beyond the rounding of the roots."""
        return bool(np.all(growth_rate(self.poles) < 0.0))

    @property
    def dc_gain(self) -> float | None:
        """Gain at s = 0 after common factors s; None where a pole at the origin remains."""
        numerator, denominator = self.numerator, self.denominator
        while numerator and denominator[-1] == 0.0:
            if numerator[-1] != 0.0:
                return None
            numerator, denominator = numerator[:-1], denominator[:-1]
        return numerator[-1] / denominator[-1] if numerator else 0.0

    @property
    def natural_frequency_rad_s(self) -> float | None:
        """Undamped natural frequency of a second-order system, else None [rad s⁻¹]."""
        if self.order != 2 or self.denominator[2] / self.denominator[0] <= 0.0:
            return None
        return math.sqrt(self.denominator[2] / self.denominator[0])

    @property
    def damping_ratio(self) -> float | None:
        """Damping ratio of a second-order system, else None [-]."""
        frequency = self.natural_frequency_rad_s
        if frequency is None:
            return None
        return self.denominator[1] / self.denominator[0] / (2.0 * frequency)

    @property
    def damped_period_s(self) -> float | None:
        """Period of the oscillation of a second-order system; None if it does not swing [s]."""
        frequency, damping = self.natural_frequency_rad_s, self.damping_ratio
        if frequency is None or damping is None or abs(damping) >= 1.0:
            return None
        return math.tau / (frequency * math.sqrt((1.0 - damping) * (1.0 + damping)))

    @property
    def mean_residence_time_s(self) -> float:
        r"""Delay plus the area between the steady answer and the step response [s].

        .. math:: \int_0^\infty \left(1 - \frac{y(t)}{G(0)}\right) dt
                  = -\frac{1}{G(0)} \left.\frac{dG}{ds}\right|_0
                  = T + \frac{a_1}{a_0} - \frac{b_1}{b_0}

        A speed of v0, commanded to zero, covers v0 times this before it has stopped; for a
        second-order system without zeros T + 2ζ/ω_n.

        Raises
        ------
        ValueError
            If the system is not stable or its gain at s = 0 is zero.
        """
        if not self.is_stable or self.numerator[-1] == 0.0:
            msg = f"only a stable system with a steady gain has a mean residence time, not {self}"
            raise ValueError(msg)
        numerator = (0.0, *self.numerator)
        denominator = (0.0, *self.denominator)
        lag_s = denominator[-2] / denominator[-1] - numerator[-2] / numerator[-1]
        return self.delay_s + lag_s

    @property
    def modes(self) -> Modes:
        """Poles and residues for `planner.physics.response`, computed once per system."""
        return _modes(self.numerator, self.denominator)


@lru_cache(maxsize=1024)
def _modes(numerator: tuple[float, ...], denominator: tuple[float, ...]) -> Modes:
    return make_modes(np.array(numerator), np.array(denominator))


@frozen(eq=False)
class TransferFunctionStack:
    """Many systems of the same order, evaluated at once, such as draws of one model.

    The batch shape B broadcasts against times and amplitudes by numpy's rules: arrays of shape
    (draws, n + 1) answer a scalar time with shape (draws,), arrays of shape (draws, 1, n + 1)
    answer times of shape (times,) with shape (draws, times).

    Raises
    ------
    ValueError
        If the arrays do not fit together, are not finite, are improper, have a zero leading
        denominator coefficient, or differ in the number of poles at the origin.
    """

    numerators: FloatArray
    """Coefficients in descending powers of s, shape (…, m + 1)."""

    denominators: FloatArray
    """Coefficients in descending powers of s, shape (…, n + 1)."""

    delay_s: FloatArray | float = 0.0
    """Dead times, broadcast against B. [s]"""

    modes: Modes = field(init=False, repr=False)
    """Poles and residues for `planner.physics.response`."""

    def __post_init__(self) -> None:
        numerators = np.asarray(self.numerators, dtype=np.float64)
        denominators = np.asarray(self.denominators, dtype=np.float64)
        delay_s = np.asarray(self.delay_s, dtype=np.float64)
        shape = denominators.shape[:-1]
        if numerators.shape[:-1] != shape or not numerators.shape or not denominators.shape:
            msg = (
                "numerators and denominators of a stack need the same leading shape, "
                f"got {numerators.shape} and {denominators.shape}"
            )
            raise ValueError(msg)
        if not 0 < numerators.shape[-1] <= denominators.shape[-1]:
            msg = (
                f"the stack is empty or improper: {numerators.shape[-1]} numerator and "
                f"{denominators.shape[-1]} denominator coefficients"
            )
            raise ValueError(msg)
        if not (np.isfinite(numerators).all() and np.isfinite(denominators).all()):
            msg = "the coefficients of a stack of transfer functions must be finite"
            raise ValueError(msg)
        if np.any(denominators[..., 0] == 0.0):
            msg = "no leading denominator coefficient of a stack may be zero"
            raise ValueError(msg)
        trailing = np.cumprod(denominators[..., ::-1] == 0.0, axis=-1).sum(axis=-1)
        if trailing.size and trailing.min() != trailing.max():
            msg = "all systems of a stack need the same number of poles at the origin"
            raise ValueError(msg)
        if not np.all((delay_s >= 0.0) & (delay_s < np.inf)):
            msg = "the delays of a stack must be finite and not negative"
            raise ValueError(msg)
        object.__setattr__(self, "numerators", numerators)
        object.__setattr__(self, "denominators", denominators)
        object.__setattr__(self, "delay_s", delay_s)
        object.__setattr__(self, "modes", make_modes(numerators, denominators))
