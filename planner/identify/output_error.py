r"""Continuous-time models with delay, fitted to manoeuvres by output error.

The sum of squares of

.. math:: e(t_i) = y(t_i) - o_m - \hat y(t_i; b, a, T)

over the samples of all manoeuvres m is made least by a Levenberg-Marquardt method in a trust region
with bounds; ŷ is the answer in closed form, exact between samples, so that the delay is any real
number.  The offset o_m of each manoeuvre enters linearly and is eliminated.  Under noise at the
output, white or not, the estimate is consistent, where an ARX fit is not.  Its covariance counts the memory
of the noise (`planner.identify.uncertainty.least_squares_covariance`); where that has none it is
:math:`\sigma^2 (J^T J)^{-1}`, the Cramér-Rao bound.

A denominator of first or second order is stable where its coefficients are positive, and only there:
bounds on them guarantee stability, and a delay that is not negative.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import IdentificationError
from planner.identify.manoeuvres import simulated_answers
from planner.identify.uncertainty import Estimate, Noise, fit_noise, least_squares_covariance
from planner.physics.response import TransferFunction, make_modes
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.identify.manoeuvres import Manoeuvre


_SMALLEST = 1e-6
"""Nothing that is flown changes over a million seconds. [rad/s]"""


class Structure(Value):
    """Orders of a transfer function with delay, and its steady gain where that is known."""

    numerator_degree: int
    """Number of zeros, fewer than poles."""
    denominator_degree: int
    """Number of poles, one or two."""
    steady_gain: float | None = None
    """Gain at s = 0 where it is known, 1 for a vehicle that arrives where it is sent. [-]"""

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

    def denominator(self, parameters: FloatArray) -> FloatArray:
        """Coefficients of the denominator, but for the leading one, among the free parameters."""
        return parameters[-1 - self.denominator_degree : -1]

    def coefficients(self, parameters: FloatArray) -> FloatArray:
        """Coefficients and delay from the free parameters: a known gain adds the last numerator's."""
        if self.steady_gain is None:
            return np.array(parameters)
        last = self.steady_gain * parameters[-2]
        return np.insert(parameters, self.numerator_degree, last)

    def coefficient_slopes(self) -> FloatArray:
        """Return the derivatives of :meth:`coefficients`, shape (names, free_size)."""
        slopes = np.eye(self.free_size)
        if self.steady_gain is None:
            return slopes
        return np.insert(slopes, self.numerator_degree, self.steady_gain * slopes[-2], axis=0)

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
LEAST_COEFFICIENT = 1e-9
"""Lower bound of those of the denominator: stable, though as good as undamped. [rad/s]"""
_DIFFERENCE = 1e-5
"""Of the size of a coefficient: central differences of closed forms good to 1e-13 leave about 1e-8."""


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
        # each manoeuvre took its offset, the model its part of the parameters
        free = self.structure.free_size
        return {
            source: fit_noise(
                spans,
                parameters=len(spans) + round(free * self.source_samples[source] / self.samples),
            )
            for source, spans in of_source.items()
        }

    def _evaluate(self, parameters: FloatArray) -> None:
        if self._at is not None and np.array_equal(self._at, parameters):
            return
        structure = self.structure
        denominator = structure.denominator(parameters)
        sizes = np.maximum(denominator, _SMALLEST)
        if sizes.size == 2:  # a₁ of an undamped pair is 0, its natural frequency is not
            sizes[0] = max(sizes[0], np.sqrt(sizes[1]))
        steps = np.diag(_DIFFERENCE * sizes)
        shifted = np.concatenate([denominator[None], denominator + steps, denominator - steps])
        denominators = np.insert(shifted, 0, 1.0, axis=1)
        numerator = structure.coefficients(parameters)[: structure.numerator_size]
        delay_s = float(parameters[-1])
        answers = basis_answers(denominators, structure.numerator_size, delay_s, self.manoeuvres)
        slopes = basis_answers(
            denominators[:1], structure.numerator_size, delay_s, self.manoeuvres, derivative=1
        )
        chain = structure.coefficient_slopes()
        self._residuals, self._slopes = [], []
        for manoeuvre, basis, slope in zip(self.manoeuvres, answers, slopes, strict=True):
            whole = np.einsum("sjn,j->sn", basis, numerator)
            up, down = np.split(whole[1:], 2)
            to_denominator = (up - down) / (2.0 * np.diagonal(steps)[:, None])
            to_delay = -numerator @ slope[0]
            jacobian = np.concatenate([basis[0], to_denominator, to_delay[None]]).T @ chain
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

    Denominators (d, n + 1) have descending powers of s, delays broadcast against them. Each array
    is (d, m, samples), the highest of m powers of s first; ``derivative`` 1 gives the slopes.
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


_TIME_CONSTANTS = 4.0
"""exp(-4) is 2 %."""


def response_window_s(system: TransferFunction) -> float:
    """Return the delay and one damped period, as the article's models are read. [s]

    For a system that does not swing it is the delay and four of its slowest time constants, after
    which 2 % are left.
    """
    slowest = min(-pole.real for pole in system.poles)
    return system.delay_s + (system.damped_period_s or _TIME_CONSTANTS / max(slowest, 1e-9))


class ResponseFit(Value, eq=False):
    """A transfer function fitted to manoeuvres."""

    structure: Structure
    transfer_function: TransferFunction
    covariance: FloatArray
    """Of the coefficients in the order of ``structure.coefficient_names``."""
    noises: Mapping[str, Noise]
    """What the fit left over, by source. [output]"""
    criterion: float
    """Schwarz's criterion, to compare fits of the same manoeuvres: the less the better. [-]"""

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
        """How long after a command a power response is used [s]."""
        return response_window_s(self.transfer_function)

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
        """Return one of the estimates by its name."""
        return {row.name: row for row in self.estimates}[name]

    def _derived(self) -> tuple[Estimate, ...]:
        """Figures that follow from the coefficients, by linear propagation of error."""
        names = self.structure.coefficient_names
        value = dict(zip(names, self.coefficients.tolist(), strict=True))
        a0, b0 = value["a0"], value["b0"]
        of_gain = {"b0": 1.0 / a0, "a0": -b0 / a0**2}
        if self.structure.steady_gain is not None:
            of_gain = {}  # given, without an error: propagated, what rounding leaves of one
        rows = [("steady_gain", b0 / a0, of_gain)]
        if self.structure.denominator_degree == 2:
            frequency, a1 = math.sqrt(a0), value["a1"]
            of_damping = {"a1": 0.5 / frequency, "a0": -0.25 * a1 / frequency**3}
            rows += [
                ("natural_frequency_rad_s", frequency, {"a0": 0.5 / frequency}),
                ("damping_ratio", 0.5 * a1 / frequency, of_damping),
            ]
        estimates = []
        for name, number, slopes in rows:
            gradient = np.array([slopes.get(coefficient, 0.0) for coefficient in names])
            variance = float(gradient @ self.covariance @ gradient)
            estimates.append(Estimate(name=name, value=number, error=math.sqrt(max(variance, 0.0))))
        return tuple(estimates)


_GRID_FREQUENCIES, _GRID_DAMPINGS, _GRID_DELAYS = 12, (0.05, 0.3, 0.8, 1.5), 7
_STARTS = 3
_WEIGHT_PASSES = 2
_AT_BOUND = 0.999
_NO_DELAY_S = 1e-6
"""The trust region stays inside its bounds: a delay that ends on one comes out as next to nothing."""


def fit_response(
    manoeuvres: Sequence[Manoeuvre], structure: Structure, *, longest_delay_s: float | None = None
) -> ResponseFit:
    """Fit a continuous-time model with delay to manoeuvres, all at once.

    Manoeuvres are of one kind, from any number of flights, each from rest; cut to the window the
    model is to hold in, where it is to hold in a window only. The delay is at most
    ``longest_delay_s``, or half the shortest time after a command. The model is stable and its
    delay not negative.

    Raises IdentificationError if there are no manoeuvres or too few samples, the fit does not end,
    or the manoeuvres do not determine the parameters.
    """
    if not manoeuvres:
        msg = "there is no manoeuvre to fit a model to"
        raise IdentificationError(msg)
    residuals = Residuals(manoeuvres, structure)
    after = min(m.time_s.size - m.first_change for m in manoeuvres)
    if after <= 2 * structure.free_size:
        size = quantity.count(structure.free_size, "parameter")
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

    Raises IdentificationError if none of the structures can be fitted: the sentence of the last.
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
    poles = structure.denominator_degree
    # what is faster than half the sampling rate leaves no trace
    fastest = math.pi / step_s
    low = np.full(structure.free_size, -np.inf)
    high = np.full(structure.free_size, np.inf)
    low[-1 - poles : -1] = LEAST_COEFFICIENT
    high[-1 - poles : -1] = [fastest] if poles == 1 else [4.0 * fastest, fastest**2]
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
        starts = [[frequency]]
        if structure.denominator_degree == 2:
            starts = [[2.0 * damping * frequency, frequency**2] for damping in _GRID_DAMPINGS]
        poles, delay_s = np.repeat(starts, delays.size, axis=0), np.tile(delays, len(starts))
        basis = basis_answers(
            np.insert(poles, 0, 1.0, axis=1),
            structure.numerator_size,
            delay_s,
            residuals.manoeuvres,
        )
        design = _centred(basis)
        left = np.broadcast_to(target, (delay_s.size, target.size))
        if structure.steady_gain is not None:
            left = target - structure.steady_gain * poles[:, -1:] * design[:, -1]
            design = design[:, :-1]
        # normal equations, of one or two unknowns: a start need not be exact
        projected = np.einsum("dmn,dn->dm", design, left)
        normal = design @ np.swapaxes(design, -1, -2)
        numerators = np.einsum("dij,dj->di", np.linalg.pinv(normal, hermitian=True), projected)
        costs = np.einsum("dn,dn->d", left, left) - np.einsum("dm,dm->d", projected, numerators)
        parameters = np.column_stack([numerators, poles, delay_s])
        found += zip(costs.tolist(), parameters, strict=True)
    found.sort(key=lambda pair: pair[0])
    return [parameters for _, parameters in found[:_STARTS]]


def _centred(parts: Sequence[FloatArray]) -> FloatArray:
    """Join what is given of each manoeuvre, (…, n) each, without its mean."""
    return np.concatenate([w - w.mean(axis=-1, keepdims=True) for w in parts], axis=-1)


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
    fastest = structure.denominator(bounds[1])
    if np.any(structure.denominator(parameters) > _AT_BOUND * fastest):
        msg = "the answer is faster than the sampling shows: log at a higher rate"
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
    chain = structure.coefficient_slopes()
    coefficients = structure.coefficients(parameters)
    if coefficients[-1] < _NO_DELAY_S:
        coefficients[-1] = 0.0
    return ResponseFit(
        structure=structure,
        transfer_function=structure.transfer_function(coefficients),
        covariance=chain @ covariance @ chain.T,
        noises=noises,
        criterion=fit_cost + parameters.size * math.log(residuals.samples),
    )
