"""Draws of models from what their fits leave open, for predictions with a spread."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.physics.transfer_function import TransferFunctionStack

if TYPE_CHECKING:
    from collections.abc import Callable

    import numpy.typing as npt

    from planner.identify.hover import AltitudeLawFit
    from planner.identify.response_fit import ResponseFit

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]

_LEAST_VALID = 0.05
"""Share of valid draws below which a covariance describes no model. [-]"""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ResponseSpread:
    """Models that the manoeuvres are consistent with."""

    systems: TransferFunctionStack
    """Of batch shape (draws,), each stable and with a delay that is not negative."""
    valid_share: float
    """Share of the draws that were such models; the others were drawn again. [-]"""


def draw_responses(fit: ResponseFit, count: int, generator: np.random.Generator) -> ResponseSpread:
    """Draw models from the covariance of a fit.

    Parameters
    ----------
    fit : ResponseFit
        The fit.
    count : int
        Number of models.
    generator : numpy.random.Generator
        Source of chance.

    Returns
    -------
    ResponseSpread
        The models as one stack.

    Raises
    ------
    IdentificationError
        If hardly any draw is a stable model: the fit is too uncertain for a spread.
    """
    structure = fit.structure
    poles = slice(structure.numerator_size, -1)

    def is_valid(coefficients: FloatArray) -> BoolArray:
        denominators = np.insert(coefficients[:, poles], 0, 1.0, axis=1)
        return _is_hurwitz(denominators) & (coefficients[:, -1] >= 0.0)

    drawn, share = _draw(fit.coefficients, fit.covariance, count, generator, is_valid)
    return ResponseSpread(
        systems=TransferFunctionStack(
            numerators=drawn[:, : structure.numerator_size],
            denominators=np.insert(drawn[:, poles], 0, 1.0, axis=1),
            delay_s=drawn[:, -1],
        ),
        valid_share=share,
    )


def draw_altitude_laws(
    fit: AltitudeLawFit, count: int, generator: np.random.Generator
) -> FloatArray:
    """Draw coefficients K and exponents z of hover laws.

    Parameters
    ----------
    fit : AltitudeLawFit
        The fit.
    count : int
        Number of laws.
    generator : numpy.random.Generator
        Source of chance.

    Returns
    -------
    ndarray, shape (count, 2)
        K and z of each. [W, -]

    Raises
    ------
    IdentificationError
        If hardly any draw has a positive power.
    """
    mean = np.array([fit.law.coefficient_w, fit.law.exponent])
    laws, _ = _draw(mean, fit.covariance, count, generator, lambda drawn: drawn[:, 0] > 0.0)
    return laws


def _draw(
    mean: FloatArray,
    covariance: FloatArray,
    count: int,
    generator: np.random.Generator,
    is_valid: Callable[[FloatArray], BoolArray],
) -> tuple[FloatArray, float]:
    """Draws from a normal distribution that are valid, and their share of all draws."""
    # scaled, because coefficients differ by many powers of ten
    scale = np.sqrt(np.diagonal(covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    kept: list[FloatArray] = []
    valid = tried = 0
    while valid < count:
        drawn = mean + generator.standard_normal((count, mean.size)) @ root.T
        good = drawn[is_valid(drawn)]
        kept.append(good)
        valid += good.shape[0]
        tried += count
        if valid < _LEAST_VALID * tried:
            msg = "the fit is too uncertain to draw models from it: fly more manoeuvres"
            raise IdentificationError(msg)
    return np.concatenate(kept)[:count], valid / tried


def _is_hurwitz(denominators: FloatArray) -> BoolArray:
    """Whether all roots of monic polynomials lie left of the imaginary axis, shape (count,)."""
    positive: BoolArray = np.all(denominators > 0.0, axis=1)
    if denominators.shape[1] <= 3:
        return positive
    companions = np.zeros((denominators.shape[0], *[denominators.shape[1] - 1] * 2))
    companions[:, 0] = -denominators[:, 1:]
    rows = np.arange(1, companions.shape[1])
    companions[:, rows, rows - 1] = 1.0
    stable: BoolArray = np.linalg.eigvals(companions).real.max(axis=1) < 0.0
    return positive & stable
