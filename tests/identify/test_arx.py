"""ARX is exact without noise, converts as control samples, and stands noise by instruments."""

from __future__ import annotations

import control
import numpy as np
import pytest
from scipy.signal import lfilter
from simulated_experiment import G1, G2, G3, G4, G5, STEP_S, Model

from planner.errors import IdentificationError
from planner.identify.arx import ArxModel, fit_arx, select_arx
from planner.identify.manoeuvres import Manoeuvre, ReferenceForm
from planner.identify.output_error import MOTION, fit_response
from planner.identify.responses import evaluate_model
from planner.values import replace

MODELS = {"G1": G1, "G2": G2, "G3": G3, "G4": G4, "G5": G5}


def step_of(
    model: Model, *, size: float = 10.0, noise: float = 0.0, seed: int = 0, after_s: float = 40.0
) -> Manoeuvre:
    time_s = np.arange(-100.0, round(after_s / STEP_S)) * STEP_S
    reference = np.where(time_s > -0.5 * STEP_S, size, 0.0)
    answer = Model(
        model.numerator, model.denominator, model.delay_s, input_gain=model.input_gain
    ).answer(np.diff(reference, prepend=0.0))
    disturbed = answer + noise * np.random.default_rng(seed).standard_normal(answer.size)
    return Manoeuvre(time_s=time_s, reference=reference, answer=7.0 + disturbed)


@pytest.mark.parametrize("name", MODELS)
def test_without_noise_the_model_comes_back(name: str) -> None:
    model = MODELS[name]
    # 2.9 s of delay, and 1.5 s of rest before the command: the onset counts all the same
    cut = step_of(model)
    short = {c: getattr(cut, c)[85:] for c in ("time_s", "reference", "answer")}
    found = select_arx(
        [replace(cut, **short)], longest_delay_s=4.0, poles=2, zeros=len(model.numerator) - 1
    )
    numerator = model.input_gain * np.array(model.numerator)
    np.testing.assert_allclose(found.numerator, numerator, atol=1e-6)
    np.testing.assert_allclose(found.denominator, model.denominator, atol=1e-6)
    assert found.delay_s == pytest.approx(model.delay_s)


@pytest.mark.parametrize("name", ["G2", "G3", "G5"])
@pytest.mark.parametrize(("noise_w", "least_percent"), [(0.5, 85.0), (3.0, 60.0)])
def test_powers_come_back_through_noise(name: str, noise_w: float, least_percent: float) -> None:
    # four climbs, four descents and two stops are the article's experiment
    model, size = MODELS[name], 10.0 if name == "G5" else 100.0
    assert model.window_s is not None
    steps = [
        step_of(model, size=size, noise=noise_w, seed=seed, after_s=model.window_s)
        for seed in range(2 if name == "G5" else 4)
    ]
    system = select_arx(steps, longest_delay_s=2.0, poles=2, zeros=1)
    [quality] = evaluate_model(system, [step_of(model, size=size, after_s=model.window_s)])
    assert quality.fit_percent >= least_percent


@pytest.mark.parametrize(
    ("numerator", "denominator"),
    [
        ([2.0], [1.0, 0.5]),
        ([1.0, 3.0], [1.0, 3.0, 2.0]),
        ([-0.5, 1.0], [1.0, 0.8, 4.0]),
        ([1.0, 0.2, 3.0], [1.0, 2.0, 5.0, 1.0]),
    ],
)
def test_conversion_undoes_what_control_samples(
    numerator: list[float], denominator: list[float]
) -> None:
    sampled = control.sample_system(control.tf(numerator, denominator), 0.2, "zoh")
    b, a = np.ravel(sampled.num[0][0]), np.ravel(sampled.den[0][0])
    model = ArxModel(
        a=tuple(a[1:] / a[0]),
        b=tuple(b[-len(a) + 1 :] / a[0]),
        delay_s=0.4,
        step_s=0.2,
        simulated_error=1.0,
    )
    found = model.transfer_function()
    padded = np.zeros(len(denominator) - 1)
    padded[-len(numerator) :] = numerator
    offset = len(padded) - len(found.numerator)
    np.testing.assert_allclose(found.numerator, padded[offset:], atol=1e-9)
    np.testing.assert_allclose(found.denominator, denominator, atol=1e-9)
    assert found.delay_s == pytest.approx(0.4)


def test_the_delay_is_found_where_noise_is_as_arx_takes_it() -> None:
    # through 1/A: every second of it, the model the regression is made for
    model = Model((2.0,), (1.0, 2.0, 2.0), 0.7)
    clean = step_of(model)
    sampled = control.sample_system(control.tf([2.0], [1.0, 2.0, 2.0]), STEP_S, "zoh")
    white = 0.02 * np.random.default_rng(4).standard_normal(clean.answer.size)
    coloured = lfilter([1.0], np.ravel(sampled.den[0][0]), white)
    cut = Manoeuvre(time_s=clean.time_s, reference=clean.reference, answer=clean.answer + coloured)
    found = select_arx([cut], longest_delay_s=2.0, poles=2, zeros=0)
    # one sample: of noise with this memory the best simulation may be one beside the truth
    assert found.delay_s == pytest.approx(0.7, abs=1.01 * STEP_S)


def test_instruments_take_out_what_noise_of_the_measurement_does_to_least_squares() -> None:
    # known beforehand: a natural frequency of 1.6 rad/s came back as 3.6 to 6
    cuts = [step_of(Model((2.56,), (1.0, 2.24, 2.56), 0.4), noise=0.2, seed=s) for s in range(4)]

    def frequency_rad_s(passes: int) -> float:
        model = fit_arx(cuts, poles=2, delay_samples=4, every=5, passes=passes)
        poles = np.log(np.roots([1.0, *model.a]).astype(complex)) / model.step_s
        return float(np.sqrt(np.abs(np.prod(poles))))

    assert frequency_rad_s(0) > 1.8 * 1.6
    assert frequency_rad_s(4) == pytest.approx(1.6, rel=0.1)
    refined = fit_response(cuts, MOTION)
    assert refined.transfer_function.natural_frequency_rad_s == pytest.approx(1.6, rel=0.03)


@pytest.mark.parametrize(
    ("a", "message"),
    [
        ((-0.56, -0.43), "left of z = 0"),  # poles 0.99 and -0.43
        ((-2.1, 1.1), "not stable"),
        ((-0.5, 0.0), "left of z = 0"),  # a pole at z = 0
    ],
)
def test_what_has_no_stable_continuous_counterpart_is_refused(
    a: tuple[float, ...], message: str
) -> None:
    model = ArxModel(a=a, b=(0.1, 0.1), delay_s=0.0, step_s=0.1, simulated_error=1.0)
    with pytest.raises(IdentificationError, match=message):
        model.transfer_function()


def test_manoeuvres_that_do_not_fit_together_are_refused() -> None:
    cut = step_of(G4)
    with pytest.raises(IdentificationError, match="one sampling step"):
        fit_arx([cut, cut.every(2)], poles=2, delay_samples=1)
    ramp = Manoeuvre(
        time_s=cut.time_s,
        reference=cut.reference,
        answer=cut.answer,
        reference_form=ReferenceForm.LINEAR,
    )
    with pytest.raises(IdentificationError, match="held"):
        fit_arx([ramp], poles=2, delay_samples=1)
    with pytest.raises(IdentificationError, match="no manoeuvre"):
        fit_arx([], poles=2, delay_samples=1)
    with pytest.raises(IdentificationError, match="too short"):
        select_arx([step_of(G4, after_s=0.3)], longest_delay_s=1.0, poles=2, zeros=1)
