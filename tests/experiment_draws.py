"""One draw of the simulated experiment, identified in four ways; what the bench repeats and counts.

A draw of n flights of each kind is simulated as one flight with the noise divided by √n.  For a fit of
the output that is no approximation: manoeuvres of one command answer alike, and their mean tells all that
they tell together (`tests/identify/test_output_error.py` compares the two).  ARX it flatters: averaging
takes away noise that biases it.
"""

from __future__ import annotations

import contextlib
import math
from typing import TYPE_CHECKING

import numpy as np
from experiment_manoeuvres import TRUTH, manoeuvres
from simulated_experiment import ALTITUDE_NOISE_M, POWER_NOISE_W, SPEED_NOISE_M_S

from planner.errors import IdentificationError
from planner.identify.arx import select_arx
from planner.identify.output_error import (
    LEAST_COEFFICIENT,
    MOTION,
    POWER,
    POWER_WITHOUT_ZERO,
    Residuals,
    ResponseFit,
    select_response,
)
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.identify.manoeuvres import Manoeuvre
    from planner.identify.output_error import Structure
    from planner.physics.response import TransferFunction

    # figure: value, standard error (NaN where the method tells none)
    Figures = dict[str, tuple[float, float]]

WAYS = ("refined", "ARX mode", "ARX lstsq", "sippy")
DEVIATIONS = {
    "G1": ALTITUDE_NOISE_M,
    "G2": POWER_NOISE_W,
    "G3": POWER_NOISE_W,
    "G4": SPEED_NOISE_M_S,
    "G5": POWER_NOISE_W,
}
FIGURES = {name: model.figures for name, model in TRUTH.items()}
# a zero that 10 Hz and 5 W of noise hide acts as so much delay: G5 is found without it
FIGURES["G5"]["delay_s"] += 0.02583 / 0.3294
STRUCTURES = {
    name: (MOTION,) if name in {"G1", "G4"} else (POWER, POWER_WITHOUT_ZERO) for name in TRUTH
}
LONGEST_DELAY_S = 4.0


def joined(steps: list[Manoeuvre]) -> Manoeuvre:
    """Return the mean of manoeuvres of one command and its negative, as one manoeuvre."""
    signs = [np.sign(m.reference[-1] - m.reference[0]) for m in steps]
    answers = [s * (m.answer - m.answer_before) for s, m in zip(signs, steps, strict=True)]
    reference = signs[0] * (steps[0].reference - steps[0].reference[0])
    return replace(steps[0], reference=reference, answer=np.mean(answers, axis=0))


def identified(job: tuple[int, int]) -> dict[tuple[str, str], Figures]:
    """Return figures by model and way, of a seed and a number of flights of each kind."""
    seed, flights = job
    found: dict[tuple[str, str], Figures] = {}
    for name, steps in manoeuvres(seed, noise=flights**-0.5).items():
        fit = select_response(steps if flights == 1 else [joined(steps)], STRUCTURES[name])
        found[name, "refined"] = {
            figure: (fit.estimate(figure).value, fit.estimate(figure).error)
            for figure in FIGURES[name]
        }
        zeros = STRUCTURES[name][0].numerator_degree
        found[name, "ARX mode"] = {}
        # G5 is not damped: noise moves its poles out of the unit circle now and then
        with contextlib.suppress(IdentificationError):
            mode = select_arx(steps, longest_delay_s=LONGEST_DELAY_S, poles=2, zeros=zeros)
            found[name, "ARX mode"] = _unknown_errors(_of_mode(mode))
        found[name, "ARX lstsq"] = _by_least_squares(name, steps)
        found[name, "sippy"] = _by_sippy(name, joined(steps))
    return found


def bound(name: str, structure: Structure) -> Figures:
    """Return the truth of a model and its Cramér-Rao bound in one experiment."""
    truth = TRUTH[name]
    numerator = [truth.input_gain * b for b in truth.numerator][-structure.numerator_size :]
    delay_s = FIGURES[name]["delay_s"]
    if name == "G5" and structure.numerator_degree:
        delay_s = truth.delay_s
    denominator = np.maximum(truth.denominator[1:], LEAST_COEFFICIENT)
    parameters = np.array([*numerator, *denominator, delay_s])
    residuals = Residuals(manoeuvres(0)[name], structure)
    slopes = residuals.slopes(parameters)
    covariance: FloatArray = np.asarray(DEVIATIONS[name] ** 2 * np.linalg.inv(slopes.T @ slopes))
    fit = ResponseFit(
        structure=structure,
        transfer_function=structure.transfer_function(structure.coefficients(parameters)),
        covariance=covariance,
        noises={},
        criterion=0.0,
    )
    return {f: (fit.estimate(f).value, fit.estimate(f).error) for f in FIGURES[name]}


def _of_mode(system: TransferFunction) -> dict[str, float]:
    *_, a1, a0 = system.denominator
    return {
        "steady_gain": system.numerator[-1] / a0,
        "natural_frequency_rad_s": math.sqrt(a0),
        "damping_ratio": a1 / (2.0 * math.sqrt(a0)),
        "delay_s": system.delay_s,
    }


def _continuous(coefficients: FloatArray, step_s: float) -> dict[str, float]:
    """Gain, natural frequency and damping of a₁, a₂, b₁ …, by the logarithms of the poles."""
    a, b = coefficients[:2], coefficients[2:]
    poles = np.log(np.roots([1.0, *a]).astype(complex)) / step_s
    frequency = math.sqrt(abs(np.prod(poles)))
    return {
        "steady_gain": float(b.sum() / (1.0 + a.sum())),
        "natural_frequency_rad_s": frequency,
        "damping_ratio": float(-poles.sum().real / (2.0 * frequency)),
    }


def _by_least_squares(name: str, steps: list[Manoeuvre]) -> Figures:
    """ARX(2, 2) by ``numpy.linalg.lstsq``, told the true delay: the best plain ARX can do."""
    step_s = steps[0].step_s
    lag = round(TRUTH[name].delay_s / step_s) + 1
    rows, targets = [], []
    for m in steps:
        y = m.answer - m.answer_before
        u = np.concatenate([np.zeros(lag + 1), m.reference - m.reference[0]])
        k = np.arange(2, y.size)
        rows.append(np.stack([-y[k - 1], -y[k - 2], u[k + 1], u[k]], axis=-1))
        targets.append(y[k])
    design, target = np.concatenate(rows), np.concatenate(targets)
    solution = np.linalg.lstsq(design, target)[0]
    variance = float(np.sum((target - design @ solution) ** 2)) / (target.size - 4)
    covariance = variance * np.linalg.inv(design.T @ design)
    figures = _continuous(solution, step_s)
    slopes: dict[str, list[float]] = {figure: [] for figure in figures}
    for i, size in enumerate(1e-6 * np.abs(solution)):
        shift = np.eye(4)[i] * size
        up, down = _continuous(solution + shift, step_s), _continuous(solution - shift, step_s)
        for figure, values in slopes.items():
            values.append((up[figure] - down[figure]) / (2.0 * size))
    return {
        figure: (value, math.sqrt(max(np.array(g) @ covariance @ np.array(g), 0.0)))
        for (figure, value), g in zip(figures.items(), slopes.values(), strict=True)
    }


def _by_sippy(name: str, manoeuvre: Manoeuvre) -> Figures:
    """ARX(2, 2) of sippy-unipi, where it is installed: with casadi it is too heavy to demand."""
    try:
        from sippy_unipi import system_identification
    except ImportError:
        return {}
    lag = round(TRUTH[name].delay_s / manoeuvre.step_s)
    answer = manoeuvre.answer - manoeuvre.answer_before
    model = system_identification(
        answer[None], manoeuvre.reference[None], "ARX", ARX_orders=[2, 2, lag]
    )
    # padded with zeros for the delay
    a = np.asarray(model.G.den[0][0])[1:3]
    b = np.trim_zeros(np.asarray(model.G.num[0][0]))
    return _unknown_errors(_continuous(np.concatenate([a, b]), manoeuvre.step_s))


def _unknown_errors(figures: dict[str, float]) -> Figures:
    return {figure: (value, math.nan) for figure, value in figures.items()}
