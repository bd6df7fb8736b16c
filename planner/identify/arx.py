r"""ARX identification as in the article: its equations 1 and 2.

.. math:: A(q)\, y_t = B(q)\, u_{t - k} + e_t, \qquad
          A = 1 + a_1 q^{-1} + \dots + a_n q^{-n}, \quad
          B = b_1 + b_2 q^{-1} + \dots + b_m q^{-m + 1},

in one regression over all manoeuvres, at several samplings h; the delay, and which sampling is kept, by how
well the model simulates what was measured.  What is of order n and sampled behind a hold has n coefficients
b, whatever zeros it has.  Least squares, which noise of the measurement biases, begin; instruments, the
answers as the model before simulates them, take most of the bias out (T. Söderström, P. Stoica, System
Identification, 1989, chapter 8).  The conversion to G(s) is the exact inverse of sampling,

.. math:: \begin{bmatrix} \Phi & \Gamma \\ 0 & 1 \end{bmatrix}
          = \exp\left( h \begin{bmatrix} F & g \\ 0 & 0 \end{bmatrix} \right),

by the matrix logarithm between two forms of ``control``, which samples systems but does not convert
them back.

.. warning:: It knows no errors of its own, and what it finds scatters more than by
   `planner.identify.output_error` (`ARX_BIASED`).
"""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.errors import IdentificationError
from planner.findings import Rule, Severity
from planner.identify.manoeuvres import ReferenceForm, simulated_answers
from planner.physics.response import TransferFunction
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray
    from planner.identify.manoeuvres import Manoeuvre


_REAL = 1e-9
"""Distance from the real axis, and from zero, of a pole in z that lies there. [-]"""
_UNDAMPED = 1e-6
"""How far beyond the unit circle rounding carries the poles of what is not damped, as G5. [-]"""
_PASSES = 4
"""With instruments: after so many they have settled. [-]"""
_STRIDE = 5
"""Samples from one delay to the next that is tried, before all about the best. [-]"""
_CONVERTED = 4
"""Models of each sampling that are converted: zeros that a system has not stand in for part of a delay, so
that its neighbours simulate almost as well until these are left out. [-]"""
_SAMPLINGS = (1, 2, 5, 10, 20)
"""Samples of the log in one of the regression: noise biases it less when sampled slowly."""


ARX_BIASED = Rule(
    "I101 arx-biased",
    Severity.WARNING,
    summary="A model was identified by ARX alone, which noise of the measurement biases.",
    why="ARX takes noise to have passed through the poles of the vehicle.  Noise of a sensor has not: by "
    "least squares at 10 Hz a natural frequency of 1.6 rad/s comes out as 3.6 to 6.  Slower sampling and "
    "instruments take most of that out, but no errors of the coefficients are known.  The article "
    "identifies this way.",
    how="Fires for every model fitted by ARX without the refinement in continuous time.",
    fix="use the default, which refines the model by output error",
)


class ArxModel(Value):
    """A fitted ARX model."""

    a: tuple[float, ...]
    """a₁ … a_n of the past answers. [-]"""
    b: tuple[float, ...]
    """b₁ … b_n of the past references. [output/input]"""
    delay_s: float
    """Beyond the one sample that a hold and a system without feedthrough take: k - 1 of them. [s]"""
    step_s: float
    """Sampling step of the regression. [s]"""
    simulated_error: float
    """Root mean square of what its simulation leaves of the answers. [output]"""

    def transfer_function(self) -> TransferFunction:
        """Convert to continuous time: the model whose samples behind a hold this is; equation 2.

        The sampling is inverted by the matrix logarithm.

        Raises IdentificationError if no continuous system of this order samples to it, or that
        system is not stable.
        """
        from scipy.linalg import companion, logm
        from scipy.signal import ss2tf

        order = len(self.a)
        largest = max(abs(np.roots([1.0, *self.a])))
        if not largest < 1.0 + _UNDAMPED:
            msg = "the ARX model is not stable: refine it, or fit another order"
            raise IdentificationError(msg)
        inside = min(1.0, (1.0 - _REAL) / largest)
        sampled = companion([1.0, *(a * inside**i for i, a in enumerate(self.a, 1))])
        poles = np.linalg.eigvals(sampled)
        if np.any((np.abs(poles.imag) < _REAL) & (poles.real < _REAL)):
            msg = (
                "no continuous system of this order samples to the ARX model: it has a pole at or left "
                "of z = 0"
            )
            raise IdentificationError(msg)
        held = np.block([[sampled, np.eye(order, 1)], [np.zeros((1, order)), np.ones((1, 1))]])
        generator = np.asarray(logm(held)).real / self.step_s
        numerator, denominator = ss2tf(
            generator[:order, :order], generator[:order, order:], [self.b], [[0.0]]
        )
        return TransferFunction(
            numerator=tuple(numerator[0, 1:].tolist()),  # without the feedthrough, which is 0
            denominator=tuple(denominator.tolist()),
            delay_s=self.delay_s,
        )


def fit_arx(
    manoeuvres: Sequence[Manoeuvre],
    *,
    poles: int,
    delay_samples: int,
    every: int = 1,
    passes: int = _PASSES,
) -> ArxModel:
    """Fit an ARX model of given order and delay; equation 1 of the article.

    Manoeuvres are at one sampling step, references held; the mean answer before the command is taken
    off, as in the article.  Before its first sample a manoeuvre rests: its reference is known there.
    The delay, beyond the sample of the hold, is in samples of the log; ``every`` so manieth of
    them goes into the regression, the one by the delay after the command among them.

    After the least squares come ``passes`` with instruments, what the model before it simulates in
    place of the past answers, which noise is not in; the one that simulates best is returned.

    Raises IdentificationError if the manoeuvres do not determine the coefficients, or do not fit
    together.
    """
    _same_step(manoeuvres)
    flights = [_sampled(manoeuvre, delay_samples, every) for manoeuvre in manoeuvres]
    design = np.concatenate(
        [_regressors(reference, answer, poles) for reference, answer in flights]
    )
    target = np.concatenate([answer[poles:] for _, answer in flights])
    coefficients, _, rank, _ = np.linalg.lstsq(design, target)
    if rank < design.shape[1] or design.shape[0] <= design.shape[1]:
        msg = "the manoeuvres do not determine the coefficients of the ARX model"
        raise IdentificationError(msg)
    found = [_simulated(coefficients, flights)]
    for _ in range(passes):
        answers = found[-1].answers
        if not math.isfinite(found[-1].error):
            break
        instruments = np.concatenate(
            [
                _regressors(reference, answer, poles)
                for (reference, _), answer in zip(flights, answers, strict=True)
            ]
        )
        crossed = instruments.T @ design
        if np.linalg.matrix_rank(crossed) < crossed.shape[0]:
            break
        found.append(_simulated(np.linalg.solve(crossed, instruments.T @ target), flights))
    best = min(found, key=lambda one: one.error)
    step_s = manoeuvres[0].step_s
    return ArxModel(
        a=tuple(best.coefficients[:poles].tolist()),
        b=tuple(best.coefficients[poles:].tolist()),
        delay_s=delay_samples * step_s,
        step_s=every * step_s,
        simulated_error=best.error,
    )


def select_arx(
    manoeuvres: Sequence[Manoeuvre], *, longest_delay_s: float, poles: int, zeros: int
) -> TransferFunction:
    """Search sampling and delay for the system that simulates the manoeuvres best.

    ``zeros``: those it has; of fewer than the order allows, sampling leaves the others undetermined,
    and the steady gain stays.

    Raises IdentificationError if the manoeuvres determine none that has a counterpart in continuous time.
    """
    _same_step(manoeuvres)
    longest = round(longest_delay_s / manoeuvres[0].step_s)
    refused = IdentificationError("the manoeuvres are too short for an ARX model with such a delay")
    found: list[tuple[float, TransferFunction]] = []
    for every in _SAMPLINGS:
        stride = max(every, _STRIDE)
        models: dict[int, ArxModel] = {}
        for delays in (range(0, longest + 1, stride), range(1 - stride, stride)):
            near = min(models, key=lambda delay: models[delay].simulated_error, default=0)
            for delay in (near + delay for delay in delays if 0 <= near + delay <= longest):
                with contextlib.suppress(IdentificationError):
                    models[delay] = models.get(delay) or fit_arx(
                        manoeuvres, poles=poles, delay_samples=delay, every=every
                    )
        for model in sorted(models.values(), key=lambda model: model.simulated_error)[:_CONVERTED]:
            try:
                system = model.transfer_function()
            except IdentificationError as error:
                refused = error
                continue
            system = TransferFunction(
                numerator=system.numerator[-zeros - 1 :],
                denominator=system.denominator,
                delay_s=system.delay_s,
            )
            answers = simulated_answers(system.modes, system.delay_s, manoeuvres)
            left = [
                manoeuvre.answer - manoeuvre.answer_before - answer
                for manoeuvre, answer in zip(manoeuvres, answers, strict=True)
            ]
            found.append((float(np.mean(np.concatenate(left) ** 2)), system))
    if not found:
        raise refused
    return min(found, key=lambda one: one[0])[1]


def _sampled(manoeuvre: Manoeuvre, delay: int, every: int) -> tuple[FloatArray, FloatArray]:
    """Return every so manieth answer, and the references by the delay before them, from rest."""
    at = np.arange((manoeuvre.first_change + delay) % every, manoeuvre.answer.size, every)
    reference = manoeuvre.reference - manoeuvre.reference[0]
    return reference[np.maximum(at - delay, 0)], (manoeuvre.answer - manoeuvre.answer_before)[at]


def _regressors(reference: FloatArray, answer: FloatArray, poles: int) -> FloatArray:
    """Return a row for each answer that has all of its past: answers before it, references before it."""
    at = np.arange(poles, answer.size)[:, None] - np.arange(1, poles + 1)
    return np.concatenate((-answer[at], reference[at]), axis=1)


class _Simulated(NamedTuple):
    coefficients: FloatArray
    answers: list[FloatArray]
    error: float
    """Root mean square, infinite where the model runs away. [output]"""


def _simulated(
    coefficients: FloatArray, flights: Sequence[tuple[FloatArray, FloatArray]]
) -> _Simulated:
    from scipy.signal import lfilter

    a, b = np.split(coefficients, 2)
    with np.errstate(over="ignore", invalid="ignore"):
        answers = [lfilter([0.0, *b], [1.0, *a], reference) for reference, _ in flights]
        left = [own - answer for (_, own), answer in zip(flights, answers, strict=True)]
        error = float(np.sqrt(np.mean(np.concatenate(left) ** 2)))
    return _Simulated(coefficients, answers, error if math.isfinite(error) else math.inf)


def _same_step(manoeuvres: Sequence[Manoeuvre]) -> None:
    if not manoeuvres:
        msg = "there is no manoeuvre to fit an ARX model to"
        raise IdentificationError(msg)
    steps = [m.step_s for m in manoeuvres]
    if not math.isclose(min(steps), max(steps), rel_tol=1e-6):
        msg = f"ARX needs one sampling step, the manoeuvres have {min(steps):g} to {max(steps):g} s"
        raise IdentificationError(msg)
    if any(m.reference_form is not ReferenceForm.HELD for m in manoeuvres):
        msg = "ARX needs references that are held between samples"
        raise IdentificationError(msg)
