r"""What a fit leaves over, and what that does to the errors of its estimates.

Residuals of flights are seldom white: gusts last seconds.  They are described as autoregressive,

.. math:: e_t = \sum_{i=1}^p \varphi_i e_{t-i} + w_t,

by the Yule-Walker equations, p by Schwarz's criterion [1]_; p = 0 is white noise.

References
----------
.. [1] G. Schwarz, "Estimating the Dimension of a Model", Annals of Statistics 6 (1978) 461.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray


_LONGEST_MEMORY = 20
_SAMPLES_PER_COEFFICIENT = 20
_WORST_CONDITION = 1e10
"""Of a scaled normal matrix; beyond, some combination of parameters leaves no trace."""


class Noise(Value):
    """Stationary noise at even sampling steps."""

    variance: float
    """[unit²]"""
    memory: tuple[float, ...] = ()
    """Coefficients φ of the past samples, nearest first; empty for white noise. [-]"""
    correlations: tuple[float, ...] = ()
    """Autocorrelations at the first lags, as many as there are coefficients. [-]"""

    @property
    def deviation(self) -> float:
        """Standard deviation [unit]."""
        return math.sqrt(self.variance)

    @property
    def innovation_variance(self) -> float:
        """Variance of w, what the past does not explain [unit²]."""
        explained = sum(c * r for c, r in zip(self.memory, self.correlations, strict=True))
        return self.variance * (1.0 - explained)

    @property
    def is_white(self) -> bool:
        """Whether no sample predicts the next."""
        return not self.memory

    def autocovariances(self, count: int) -> FloatArray:
        """Autocovariances at lags 0, 1, …, count - 1 [unit²]."""
        correlations = np.zeros(max(count, len(self.memory) + 1))
        correlations[0] = 1.0
        known = len(self.memory)
        correlations[1 : known + 1] = self.correlations
        memory = np.array(self.memory[::-1])
        if known:
            for lag in range(known + 1, count):
                correlations[lag] = memory @ correlations[lag - known : lag]
        return self.variance * correlations[:count]


def fit_noise(residuals: Sequence[FloatArray], *, parameters: int) -> Noise:
    """Noise of which spans of residuals are made.

    Each span is without a gap; the variance is corrected for the parameters fitted.

    Raises ValueError if there are not more residuals than parameters.
    """
    samples = sum(r.size for r in residuals)
    if samples <= parameters:
        msg = f"{samples} residuals do not determine the noise beside {parameters} parameters"
        raise ValueError(msg)
    longest = min(_LONGEST_MEMORY, samples // _SAMPLES_PER_COEFFICIENT)
    covariances = (
        np.array(
            [
                sum(float(r[lag:] @ r[: r.size - lag]) for r in residuals if r.size > lag)
                for lag in range(longest + 1)
            ]
        )
        / samples
    )
    variance = covariances[0] * samples / (samples - parameters)
    if variance == 0.0:
        return Noise(variance=0.0)
    correlations = covariances / covariances[0]
    memory = _memory(correlations, samples)
    return Noise(
        variance=float(variance),
        memory=memory,
        correlations=tuple(float(c) for c in correlations[1 : len(memory) + 1]),
    )


def _memory(correlations: FloatArray, samples: int) -> tuple[float, ...]:
    """Return the coefficients of the order with the least criterion, by Levinson's recursion."""
    best: tuple[float, ...] = ()
    least = 0.0  # of samples·ln(fraction of variance left) + order·ln(samples)
    coefficients = np.zeros(0)
    left = 1.0
    for order in range(1, correlations.size):
        reflection = (correlations[order] - coefficients @ correlations[order - 1 : 0 : -1]) / left
        coefficients = np.append(coefficients - reflection * coefficients[::-1], reflection)
        left *= 1.0 - reflection**2
        if left <= 0.0:
            break
        criterion = samples * math.log(left) + order * math.log(samples)
        if criterion < least:
            least, best = criterion, tuple(float(c) for c in coefficients)
    return best


def mean_with_error(spans: Sequence[FloatArray]) -> tuple[float, float]:
    """Mean of one quantity over spans of samples, and its standard error.

    Spans are at one sampling step, each without a gap; the error counts the memory of the noise.
    """
    joined = np.concatenate(spans)
    mean = float(joined.mean())
    noise = fit_noise([s - mean for s in spans], parameters=1)
    variance_of_sum = 0.0
    for span in spans:
        lags = np.arange(span.size)
        weights = np.where(lags == 0, 1.0, 2.0) * (span.size - lags)
        variance_of_sum += float(weights @ noise.autocovariances(span.size))
    return mean, math.sqrt(max(variance_of_sum, 0.0)) / joined.size


def least_squares_covariance(blocks: Sequence[tuple[float, FloatArray, Noise]]) -> FloatArray:
    r"""Covariance of a weighted least-squares estimate under noise with a memory.

    .. math:: N^{-1} \left( \sum_m w_m^4 J_m^T \Gamma_m J_m \right) N^{-1},
              \qquad N = \sum_m w_m^2 J_m^T J_m,

    with the autocovariances Γ of the noise; for white noise and weights of one
    :math:`\sigma^2 (J^T J)^{-1}`.

    A block is a span of samples without a gap: its weight, the derivatives (n, p) of its residuals
    to the parameters, and its noise.

    Raises IdentificationError if the residuals do not determine the parameters.
    """
    normal = sum((w**2 * slopes.T @ slopes for w, slopes, _ in blocks), np.zeros(()))
    scale = np.sqrt(np.diagonal(normal))
    if (
        not np.all(scale > 0.0)
        or np.linalg.cond(normal / np.outer(scale, scale)) > _WORST_CONDITION
    ):
        msg = "the flights do not determine all parameters of the model: take a simpler one"
        raise IdentificationError(msg)
    inverse = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    middle = sum(
        (w**4 * slopes.T @ _correlated(noise, slopes) for w, slopes, noise in blocks), np.zeros(())
    )
    covariance: FloatArray = inverse @ middle @ inverse
    return covariance


def _correlated(noise: Noise, columns: FloatArray) -> FloatArray:
    from scipy.linalg import matmul_toeplitz

    if noise.is_white:
        return noise.variance * columns
    return np.asarray(matmul_toeplitz(noise.autocovariances(columns.shape[0]), columns))


class Estimate(Value):
    """A number that was measured, and how well."""

    name: str
    value: float
    error: float
    """Standard error, in the unit of the value."""


_LAGS = 20


def fit_percent(measured: FloatArray, predicted: FloatArray) -> float:
    r"""Fit as MATLAB's ``compare`` gives it.

    .. math:: 100 \left(1 - \frac{\lVert y - \hat y \rVert}{\lVert y - \bar y \rVert}\right)

    At most 100; -inf for a wrong prediction of a constant. [%]
    """
    error = float(np.linalg.norm(measured - predicted))
    if error == 0.0:
        return 100.0
    spread = float(np.linalg.norm(measured - measured.mean()))
    return 100.0 * (1.0 - error / spread) if spread > 0.0 else -np.inf


def told_fit_percent(measured: FloatArray, predicted: FloatArray) -> float | None:
    """Return the fit; ``None``: one value, or values alike, have no spread to hold errors to. [%]"""
    fit = fit_percent(measured, predicted)
    return fit if math.isfinite(fit) else None


def whiteness(residuals: FloatArray) -> float:
    r"""Chance that white noise has residuals of such a memory: the test of Ljung and Box.

    .. math:: Q = n (n + 2) \sum_{k=1}^{h} \frac{r_k^2}{n - k} \sim \chi^2_h

    G. Ljung, G. Box, Biometrika 65 (1978) 297; with h = 20 lags, fewer where there are fewer than four
    samples for each.

    Small for residuals with a memory.
    """
    from scipy.special import chdtrc  # scipy.stats takes half a second to load

    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    used = min(_LAGS, residuals.size // 4)
    if power == 0.0 or used < 1:
        return 1.0
    statistic = sum(
        (float(centred[lag:] @ centred[:-lag]) / power) ** 2 / (residuals.size - lag)
        for lag in range(1, used + 1)
    )
    return float(chdtrc(used, residuals.size * (residuals.size + 2) * statistic))


def rounded(value: float, digits: int = 6) -> float:
    """Round to significant digits: more than flights show, few enough for people to compare."""
    return float(f"{value:.{digits}g}")
