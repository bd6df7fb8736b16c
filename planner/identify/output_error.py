r"""Continuous-time models with delay, fitted to what they should answer: output error.

The sum of squares of

.. math:: e(t_i) = y(t_i) - o_m - \hat y(t_i; b, a, T)

over the samples of all manoeuvres m is made least by a Levenberg-Marquardt method in a trust region
with bounds; ŷ is the answer in closed form, exact between samples, so that the delay is any real
number.  The offset o_m of each manoeuvre enters linearly and is eliminated.  Under noise at the
output, white or not, the estimate is consistent, where an ARX fit is not.  Its covariance counts the memory
of the noise (`planner.identify.noise.least_squares_covariance`); where that has none it is
:math:`\sigma^2 (J^T J)^{-1}`, the Cramér-Rao bound.

Stability and a delay that is not negative are guaranteed by the parameterisation
(`planner.identify.structure`) and bounds.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from planner import numbers
from planner.errors import IdentificationError
from planner.identify.noise import least_squares_covariance
from planner.identify.residuals import LEAST_FACTOR, Residuals, basis_answers
from planner.identify.response_fit import ResponseFit

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.manoeuvre import Manoeuvre
    from planner.identify.structure import Structure

FloatArray = npt.NDArray[np.float64]

_GRID_FREQUENCIES, _GRID_DAMPINGS, _GRID_DELAYS = 12, (0.05, 0.3, 0.8, 1.5), 7
_STARTS = 3
_WEIGHT_PASSES = 2
_AT_BOUND = 0.999
_NO_DELAY_S = 1e-6
"""The trust region stays inside its bounds: a delay that ends on one comes out as next to nothing."""


def fit_response(
    manoeuvres: Sequence[Manoeuvre],
    structure: Structure,
    *,
    longest_delay_s: float | None = None,
) -> ResponseFit:
    """Fit a continuous-time model with delay to manoeuvres, all at once.

    Parameters
    ----------
    manoeuvres : sequence of Manoeuvre
        Of one kind, from any number of flights, each from rest; cut to the window the model is
        to hold in, where it is to hold in a window only.
    structure : Structure
        The model that is looked for.
    longest_delay_s : float, optional
        Upper bound of the delay; left out, half the shortest time after a command. [s]

    Returns
    -------
    ResponseFit
        The model, stable and with a delay that is not negative, with its covariance.

    Raises
    ------
    IdentificationError
        If there are no manoeuvres or too few samples, the fit does not end, or the manoeuvres do
        not determine the parameters.
    """
    if not manoeuvres:
        msg = "there is no manoeuvre to fit a model to"
        raise IdentificationError(msg)
    residuals = Residuals(manoeuvres, structure)
    after = min(m.time_s.size - m.first_change for m in manoeuvres)
    if after <= 2 * structure.free_size:
        size = numbers.count(structure.free_size, "parameter")
        msg = f"too few samples after a command for {size}: {after}"
        raise IdentificationError(msg)
    span_s = min(float(m.time_s[-1]) - m.command_s for m in manoeuvres)
    delay_s = 0.5 * span_s if longest_delay_s is None else longest_delay_s
    bounds = _bounds(structure, max(m.step_s for m in manoeuvres), delay_s)

    found = _best(residuals, _grid(residuals, span_s=span_s, longest_delay_s=delay_s), bounds)
    for _ in range(_WEIGHT_PASSES if len(residuals.source_samples) > 1 else 0):
        noises = residuals.noises(found)
        deviations = np.array([noises[m.source].deviation for m in manoeuvres])
        if not deviations.all():
            break  # nothing to weigh: a source without noise
        residuals.weights = deviations.mean() / deviations
        found = _best(residuals, [found], bounds)
    return _result(residuals, found, bounds)


def select_response(
    manoeuvres: Sequence[Manoeuvre],
    structures: Sequence[Structure],
    *,
    longest_delay_s: float | None = None,
) -> ResponseFit:
    """Fit several structures and return the fit with the least criterion of Schwarz.

    A zero that the manoeuvres do not show is left out this way: it and the delay would trade
    places within their errors.

    Parameters
    ----------
    manoeuvres, longest_delay_s
        As for `fit_response`.
    structures : sequence of Structure
        What to choose from.

    Returns
    -------
    ResponseFit
        The fit that describes the manoeuvres best for its number of parameters.

    Raises
    ------
    IdentificationError
        If none of the structures can be fitted: the sentence of the last.
    """
    fits: list[ResponseFit] = []
    refused: IdentificationError | None = None
    for structure in structures:
        try:
            fits.append(fit_response(manoeuvres, structure, longest_delay_s=longest_delay_s))
        except IdentificationError as error:
            refused = error
    if fits:
        return min(fits, key=lambda fit: fit.criterion)
    raise refused or IdentificationError("there is no structure to choose from")


def _bounds(
    structure: Structure, step_s: float, longest_delay_s: float
) -> tuple[FloatArray, FloatArray]:
    """Lower and upper bounds of the free parameters."""
    poles = structure.denominator_degree
    # what is faster than half the sampling rate leaves no trace
    fastest = math.pi / step_s
    low = np.full(structure.free_size, -np.inf)
    high = np.full(structure.free_size, np.inf)
    low[-1 - poles : -1] = LEAST_FACTOR
    high[-1 - poles : -1] = [*[4.0 * fastest, fastest**2] * (poles // 2), *[fastest] * (poles % 2)]
    low[-1], high[-1] = 0.0, longest_delay_s
    return low, high


def _grid(residuals: Residuals, *, span_s: float, longest_delay_s: float) -> list[FloatArray]:
    """Best parameter vectors of a grid of poles and delays; numerators follow linearly."""
    structure = residuals.structure
    fastest = 0.5 / max(m.step_s for m in residuals.manoeuvres)
    frequencies = np.geomspace(1.0 / span_s, max(fastest, 2.0 / span_s), _GRID_FREQUENCIES)
    delays = np.linspace(0.0, 0.6 * longest_delay_s, _GRID_DELAYS)
    target = _centred([m.answer for m in residuals.manoeuvres])
    found: list[tuple[float, FloatArray]] = []
    for frequency in frequencies:
        for damping in _GRID_DAMPINGS:
            factors = _start_factors(structure, frequency, damping)
            denominator = structure.denominator(factors)
            basis = basis_answers(
                denominator[None], structure.numerator_size, delays, residuals.manoeuvres
            )
            design = _centred(basis)
            left = np.broadcast_to(target, (delays.size, target.size))
            if structure.steady_gain is not None:
                left = target - structure.steady_gain * denominator[-1] * design[:, -1]
                design = design[:, :-1]
            # normal equations, of one or two unknowns: a start need not be exact
            told = np.einsum("dmn,dn->dm", design, left)
            normal = design @ np.swapaxes(design, -1, -2)
            numerators = np.einsum("dij,dj->di", np.linalg.pinv(normal, hermitian=True), told)
            costs = np.einsum("dn,dn->d", left, left) - np.einsum("dm,dm->d", told, numerators)
            found += [
                (float(cost), np.concatenate([numerator, factors, [delay_s]]))
                for cost, numerator, delay_s in zip(costs, numerators, delays, strict=True)
            ]
    found.sort(key=lambda pair: pair[0])
    return [parameters for _, parameters in found[:_STARTS]]


def _centred(parts: Sequence[FloatArray]) -> FloatArray:
    """Join what is given of each manoeuvre, (…, n) each, without its mean."""
    return np.concatenate([w - w.mean(axis=-1, keepdims=True) for w in parts], axis=-1)


def _start_factors(structure: Structure, frequency: float, damping: float) -> FloatArray:
    """Factors of equal frequency, a little apart."""
    factors: list[float] = []
    for i in range(structure.denominator_degree // 2):
        apart = frequency * 2.0**i
        factors += [2.0 * damping * apart, apart**2]
    if structure.denominator_degree % 2:
        factors.append(frequency * 2.0 ** (structure.denominator_degree // 2))
    return np.array(factors)


def _best(
    residuals: Residuals, starts: Sequence[FloatArray], bounds: tuple[FloatArray, FloatArray]
) -> FloatArray:
    """Parameters with the least cost that is reached from the starts."""
    from scipy.optimize import least_squares

    best: tuple[FloatArray, float] | None = None
    for start in starts:
        inside = np.clip(start, bounds[0], bounds[1])
        result = least_squares(
            residuals.of, inside, jac=residuals.slopes, bounds=bounds, x_scale="jac", max_nfev=200
        )
        if result.success and (best is None or result.cost < best[1]):
            best = (np.asarray(result.x), float(result.cost))
    if best is None:
        msg = "the fit of the model did not end: the manoeuvres do not look like such a model"
        raise IdentificationError(msg)
    return best[0]


def _result(
    residuals: Residuals, parameters: FloatArray, bounds: tuple[FloatArray, FloatArray]
) -> ResponseFit:
    structure = residuals.structure
    poles = structure.factors(parameters)
    if np.any(poles > _AT_BOUND * structure.factors(bounds[1])):
        msg = "the answer is faster than the sampling can tell: log at a higher rate"
        raise IdentificationError(msg)
    if parameters[-1] > _AT_BOUND * bounds[1][-1]:
        msg = f"no delay below {bounds[1][-1]:.3g} s fits: the answer does not follow the reference"
        raise IdentificationError(msg)
    noises = residuals.noises(parameters)
    sizes = residuals.source_samples
    fit_cost = sum(sizes[s] * math.log(max(noises[s].innovation_variance, 1e-300)) for s in sizes)
    covariance = least_squares_covariance(
        [
            (weight, slopes, noises[manoeuvre.source])
            for weight, (manoeuvre, _, slopes) in zip(
                residuals.weights, residuals.blocks(parameters), strict=True
            )
        ]
    )
    chain = structure.coefficient_slopes(parameters)
    coefficients = structure.coefficients(parameters)
    if coefficients[-1] < _NO_DELAY_S:
        coefficients[-1] = 0.0
    return ResponseFit(
        structure=structure,
        transfer_function=structure.transfer_function(coefficients),
        covariance=chain @ covariance @ chain.T,
        noises=noises,
        criterion=fit_cost + parameters.size * math.log(residuals.samples),
        samples=residuals.samples,
        manoeuvres=len(residuals.manoeuvres),
    )
