"""Residuals of a model over manoeuvres and their slopes to its parameters, in closed form."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from planner.identify.manoeuvre import simulated_answers
from planner.identify.noise import Noise, fit_noise
from planner.physics.response import make_modes

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.identify.manoeuvre import Manoeuvre
    from planner.identify.structure import Structure

FloatArray = npt.NDArray[np.float64]

LEAST_FACTOR = 1e-9
"""Lower bound of the coefficients of the factors: stable, though as good as undamped. [rad/s]"""
_DIFFERENCE = 1e-5
"""Of the size of a factor: central differences of closed forms good to 1e-13 leave about 1e-8."""


class Residuals:
    """The residuals of a parameter vector, and their slopes, over all manoeuvres."""

    def __init__(self, manoeuvres: Sequence[Manoeuvre], structure: Structure) -> None:
        self.manoeuvres = manoeuvres
        self.structure = structure
        self.weights = np.ones(len(manoeuvres))
        self.samples = sum(m.time_s.size for m in manoeuvres)
        self.source_samples: dict[str, int] = {}
        for manoeuvre in manoeuvres:
            before = self.source_samples.get(manoeuvre.source, 0)
            self.source_samples[manoeuvre.source] = before + manoeuvre.time_s.size
        self._at: FloatArray | None = None
        self._residuals: list[FloatArray] = []
        self._slopes: list[FloatArray] = []

    def of(self, parameters: FloatArray) -> FloatArray:
        """Weighted residuals of all samples, (samples,)."""
        self._evaluate(parameters)
        return np.concatenate([w * r for w, r in zip(self.weights, self._residuals, strict=True)])

    def slopes(self, parameters: FloatArray) -> FloatArray:
        """Weighted derivatives to the free parameters, (samples, parameters)."""
        self._evaluate(parameters)
        return np.concatenate([w * s for w, s in zip(self.weights, self._slopes, strict=True)])

    def blocks(self, parameters: FloatArray) -> Iterator[tuple[Manoeuvre, FloatArray, FloatArray]]:
        """Yield each manoeuvre with its residuals and slopes, not weighted."""
        self._evaluate(parameters)
        yield from zip(self.manoeuvres, self._residuals, self._slopes, strict=True)

    def noises(self, parameters: FloatArray) -> dict[str, Noise]:
        """Noise of each source."""
        of_source: dict[str, list[FloatArray]] = {source: [] for source in self.source_samples}
        for manoeuvre, residuals, _ in self.blocks(parameters):
            of_source[manoeuvre.source].append(residuals)
        # each manoeuvre took its offset, the model its share of the parameters
        free = self.structure.free_size
        return {
            source: fit_noise(
                stretches,
                parameters=len(stretches)
                + round(free * self.source_samples[source] / self.samples),
            )
            for source, stretches in of_source.items()
        }

    def _evaluate(self, parameters: FloatArray) -> None:
        if self._at is not None and np.array_equal(self._at, parameters):
            return
        structure = self.structure
        factors = structure.factors(parameters)
        steps = np.diag(_DIFFERENCE * structure.factor_sizes(factors))
        shifted = np.concatenate([factors[None], factors + steps, factors - steps])
        denominators = np.array([structure.denominator(f) for f in shifted])
        coefficients = structure.coefficients(parameters)
        numerator = coefficients[: structure.numerator_size]
        delay_s = float(parameters[-1])
        answers = basis_answers(denominators, structure.numerator_size, delay_s, self.manoeuvres)
        slopes = basis_answers(
            denominators[:1], structure.numerator_size, delay_s, self.manoeuvres, derivative=1
        )
        # to all coefficients of numerator, factors and delay; then to the free ones
        free = parameters.size - factors.size - 1
        chain = np.zeros((numerator.size + factors.size + 1, parameters.size))
        chain[: numerator.size] = structure.coefficient_slopes(parameters)[: numerator.size]
        chain[numerator.size :, free:] = np.eye(factors.size + 1)
        self._residuals, self._slopes = [], []
        for manoeuvre, basis, slope in zip(self.manoeuvres, answers, slopes, strict=True):
            whole = np.einsum("sjn,j->sn", basis, numerator)
            up, down = np.split(whole[1:], 2)
            to_factors = (up - down) / (2.0 * np.diagonal(steps)[:, None])
            to_delay = -numerator @ slope[0]
            jacobian = np.concatenate([basis[0], to_factors, to_delay[None]]).T @ chain
            residuals = whole[0] - manoeuvre.answer
            # the offset of the manoeuvre, eliminated
            self._residuals.append(residuals - residuals.mean())
            self._slopes.append(jacobian - jacobian.mean(axis=0))
        self._at = parameters.copy()


def basis_answers(
    denominators: FloatArray,
    numerator_size: int,
    delay_s: float | FloatArray,
    manoeuvres: Sequence[Manoeuvre],
    *,
    derivative: int = 0,
) -> list[FloatArray]:
    """Answers of 1, s, s²… over each denominator to each manoeuvre.

    Parameters
    ----------
    denominators : ndarray, shape (d, n + 1)
        Descending powers of s.
    numerator_size : int
        Number m of powers of s in the numerator.
    delay_s : float or ndarray, shape (d,)
        Delays, broadcast against the denominators. [s]
    manoeuvres : sequence of Manoeuvre
        Their references.
    derivative : int
        1 for the slopes of the answers.

    Returns
    -------
    list of ndarray, each shape (d, m, samples)
        Highest power of s first.
    """
    systems = denominators.shape[0]
    modes = make_modes(
        np.broadcast_to(
            np.eye(numerator_size)[None, :, None], (systems, numerator_size, 1, numerator_size)
        ),
        np.broadcast_to(
            denominators[:, None, None], (systems, numerator_size, 1, denominators.shape[1])
        ),
    )
    return simulated_answers(
        modes, np.reshape(delay_s, (-1, 1, 1)), manoeuvres, derivative=derivative
    )
