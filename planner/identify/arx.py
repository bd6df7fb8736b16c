r"""ARX identification as in the article: its equations 1 and 2.

.. math:: A(q)\, y_t = B(q)\, u_{t - k} + e_t, \qquad
          A = 1 + a_1 q^{-1} + \dots + a_n q^{-n}, \quad
          B = b_1 + b_2 q^{-1} + \dots + b_m q^{-m + 1},

least squares in one regression over all manoeuvres, the delay k and the orders by search.  The
conversion to G(s) is the exact inverse of sampling behind a zero-order hold,

.. math:: \begin{bmatrix} \Phi & \Gamma \\ 0 & 1 \end{bmatrix}
          = \exp\left( h \begin{bmatrix} F & g \\ 0 & 0 \end{bmatrix} \right),

by the matrix logarithm between two forms of ``control``, which samples systems but does not convert
them back.

.. warning:: Noise of the measurement biases ARX, the more the faster the sampling
   (`ARX_BIASED`).  `planner.identify.output_error` is consistent.
"""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.findings import Rule, Severity
from planner.identify.manoeuvres import ReferenceForm
from planner.physics.response import TransferFunction
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.manoeuvres import Manoeuvre


_REAL = 1e-9
"""Distance from the real axis, and from zero, of a pole in z that lies there. [-]"""


ARX_BIASED = Rule(
    "I101 arx-biased",
    Severity.WARNING,
    summary="A model was identified by ARX alone, which noise of the measurement biases.",
    why="ARX takes noise to have passed through the poles of the vehicle.  Noise of a sensor has not: "
    "at 10 Hz the poles then come out much too fast, a natural frequency of 1.6 rad/s as 3.6 to 6.  "
    "The article identifies this way.",
    how="Fires for every model fitted by ARX without the refinement in continuous time.",
    fix="use the default, which refines the model by output error",
)


class ArxModel(Value):
    """A fitted ARX model."""

    a: tuple[float, ...]
    """a₁ … a_n of the past answers. [-]"""
    b: tuple[float, ...]
    """b₁ … b_m of the past references. [output/input]"""
    delay_samples: int
    """k, at least 1: a hold and a system without feedthrough take one sample."""
    step_s: float
    """Sampling step. [s]"""
    noise_deviation: float
    """Standard deviation of e. [output]"""
    samples: int
    """Number of equations of the regression."""

    @property
    def criterion(self) -> float:
        """Schwarz's information criterion, the less the better [-]."""
        coefficients = len(self.a) + len(self.b)
        each = math.log(self.samples)
        fit = 2.0 * self.samples * math.log(max(self.noise_deviation, 1e-300))
        return fit + each * coefficients

    def transfer_function(self) -> TransferFunction:
        """Convert to continuous time: the model whose samples behind a hold this is; equation 2.

        The sampling is inverted by the matrix logarithm; the delay is k - 1 sampling steps.

        Raises IdentificationError if no continuous system of this order samples to it, or that
        system is not stable.
        """
        import control
        from scipy.linalg import companion, logm

        order = len(self.a)
        sampled = companion([1.0, *self.a])
        poles = np.linalg.eigvals(sampled)
        if not np.all(np.abs(poles) < 1.0):
            msg = "the ARX model is not stable: refine it, or fit another order"
            raise IdentificationError(msg)
        if np.any((np.abs(poles.imag) < _REAL) & (poles.real < _REAL)):
            msg = (
                "no continuous system of this order samples to the ARX model: it has a pole at or left "
                "of z = 0"
            )
            raise IdentificationError(msg)
        held = np.block([[sampled, np.eye(order, 1)], [np.zeros((1, order)), np.ones((1, 1))]])
        generator = np.asarray(logm(held)).real / self.step_s
        output = [[*self.b, *[0.0] * (order - len(self.b))]]
        system = control.tf(
            control.ss(generator[:order, :order], generator[:order, order:], output, 0)
        )
        return TransferFunction(
            numerator=tuple(system.num[0][0].tolist()),
            denominator=tuple(system.den[0][0].tolist()),
            delay_s=(self.delay_samples - 1) * self.step_s,
        )


def fit_arx(
    manoeuvres: Sequence[Manoeuvre],
    *,
    poles: int,
    zeros: int,
    delay_samples: int,
    skipped: int | None = None,
) -> ArxModel:
    """Fit an ARX model of given orders and delay by least squares; equation 1 of the article.

    Manoeuvres are at one sampling step, references held; the mean answer before the command is taken
    off, as in the article.  Orders n and m - 1, and the delay k, at least 1, are those of the
    equation.  ``skipped`` samples come before the first equation, to compare models on the same
    ones; left out, as few as the orders and the delay need.

    Raises IdentificationError if the manoeuvres do not determine the coefficients, or do not fit
    together.
    """
    _same_step(manoeuvres)
    first = max(poles, delay_samples + zeros) if skipped is None else skipped
    rows, targets = [], []
    for manoeuvre in manoeuvres:
        answer = manoeuvre.answer - manoeuvre.answer_before
        reference = manoeuvre.reference - manoeuvre.reference[0]
        at = np.arange(first, answer.size)
        past = [-answer[at - i] for i in range(1, poles + 1)]
        inputs = [reference[at - delay_samples - i] for i in range(zeros + 1)]
        rows.append(np.stack([*past, *inputs], axis=-1))
        targets.append(answer[at])
    design, target = np.concatenate(rows), np.concatenate(targets)
    coefficients, _, rank, _ = np.linalg.lstsq(design, target)
    if rank < design.shape[1] or design.shape[0] <= design.shape[1]:
        msg = "the manoeuvres do not determine the coefficients of the ARX model"
        raise IdentificationError(msg)
    left = target - design @ coefficients
    return ArxModel(
        a=tuple(float(c) for c in coefficients[:poles]),
        b=tuple(float(c) for c in coefficients[poles:]),
        delay_samples=delay_samples,
        step_s=manoeuvres[0].step_s,
        noise_deviation=float(np.sqrt(left @ left / (target.size - coefficients.size))),
        samples=target.size,
    )


def select_arx(
    manoeuvres: Sequence[Manoeuvre], *, longest_delay_s: float, poles: int, zeros: int
) -> ArxModel:
    """Search the delay by Schwarz's criterion on the same samples.

    Raises IdentificationError if the manoeuvres determine none of the models.
    """
    _same_step(manoeuvres)
    longest = round(longest_delay_s / manoeuvres[0].step_s) + 1
    models = []
    for delay in range(1, longest + 1):
        with contextlib.suppress(IdentificationError):
            models.append(
                fit_arx(
                    manoeuvres,
                    poles=poles,
                    zeros=zeros,
                    delay_samples=delay,
                    skipped=longest + poles,
                )
            )
    if not models:
        msg = "the manoeuvres are too short for an ARX model with such a delay"
        raise IdentificationError(msg)
    return min(models, key=lambda model: model.criterion)


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
