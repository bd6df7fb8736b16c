"""How well a model describes manoeuvres, those it was not fitted to above all."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.identify.manoeuvres import simulated_answers
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.identify.manoeuvres import Manoeuvre
    from planner.physics.response import TransferFunction


_LAGS = 20


class Quality(Value):
    """How one manoeuvre is described by a model."""

    fit_percent: float
    """100 for a perfect model, 0 for one no better than the mean, negative for a worse one. [%]"""
    rms: float
    """Root mean square of the residuals. [output]"""
    whiteness: float
    """Chance that white noise has residuals of such a memory; small where the model leaves
    something over. [-]"""
    is_held_out: bool
    """Whether the manoeuvre was kept from the fit."""
    source: str
    """Name of the log."""


def fit_percent(measured: FloatArray, predicted: FloatArray) -> float:
    r"""Fit as MATLAB's ``compare`` gives it.

    .. math:: 100 \left(1 - \frac{\lVert y - \hat y \rVert}{\lVert y - \bar y \rVert}\right)

    Parameters
    ----------
    measured, predicted : ndarray, shape (n,)
        Answers y and ŷ. [output]

    Returns
    -------
    float
        At most 100; -inf for a wrong prediction of a constant. [%]
    """
    error = float(np.linalg.norm(measured - predicted))
    if error == 0.0:
        return 100.0
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100.0 * (1.0 - error / spread) if spread > 0.0 else -np.inf


def whiteness(residuals: FloatArray) -> float:
    r"""Chance that white noise has residuals of such a memory: the test of Ljung and Box.

    .. math:: Q = n (n + 2) \sum_{k=1}^{h} \frac{r_k^2}{n - k} \sim \chi^2_h

    G. Ljung, G. Box, Biometrika 65 (1978) 297; with h = 20 lags, fewer where there are fewer than four
    samples for each.

    Parameters
    ----------
    residuals : ndarray, shape (n,)
        Residuals about any mean. [output]

    Returns
    -------
    float
        Small for residuals with a memory. [-]
    """
    from scipy.stats import chi2

    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    used = min(_LAGS, residuals.size // 4)
    if power == 0.0 or used < 1:
        return 1.0
    statistic = sum(
        (float(centred[lag:] @ centred[:-lag]) / power) ** 2 / (residuals.size - lag)
        for lag in range(1, used + 1)
    )
    return float(chi2.sf(residuals.size * (residuals.size + 2) * statistic, used))


def evaluate_model(
    system: TransferFunction, manoeuvres: Sequence[Manoeuvre]
) -> tuple[Quality, ...]:
    """Describe each manoeuvre by a model; its offset is the mean answer before the command.

    Parameters
    ----------
    system : TransferFunction
        The model.
    manoeuvres : sequence of Manoeuvre
        Held out from the fit, or not.

    Returns
    -------
    tuple of Quality
        One for each manoeuvre.
    """
    found = []
    answers = simulated_answers(system.modes, system.delay_s, manoeuvres)
    for manoeuvre, answer in zip(manoeuvres, answers, strict=True):
        predicted = manoeuvre.answer_before + answer
        residuals = manoeuvre.answer - predicted
        found.append(
            Quality(
                fit_percent=fit_percent(manoeuvre.answer, predicted),
                rms=float(np.sqrt(np.mean(residuals**2))),
                whiteness=whiteness(residuals),
                is_held_out=manoeuvre.is_held_out,
                source=manoeuvre.source,
            )
        )
    return tuple(found)
