"""How well a model describes manoeuvres."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_manoeuvres import manoeuvres

from planner.identify.responses import evaluate_model
from planner.identify.uncertainty import fit_percent, whiteness
from planner.physics.response import TransferFunction

TRUTH = TransferFunction(numerator=(0.3569,), denominator=(1.0, 0.935, 0.3588), delay_s=0.6)


def test_the_fit_is_that_of_the_definition() -> None:
    measured = np.array([0.0, 0.0, 3.0, 3.0])  # 1.5 from its mean: norm 3
    assert fit_percent(measured, measured) == 100.0
    assert fit_percent(measured, np.full(4, 1.5)) == 0.0
    assert fit_percent(measured, np.array([1.5, 0.0, 3.0, 3.0])) == pytest.approx(50.0)
    assert fit_percent(np.ones(3), np.zeros(3)) == -np.inf


def test_white_residuals_pass_and_remembering_ones_do_not() -> None:
    white = np.random.default_rng(61).standard_normal((200, 300))
    chances = np.array([whiteness(row) for row in white])
    # uniform on [0, 1]: 5 % of 200 below 0.05, three standard errors 4.6 %
    assert np.mean(chances < 0.05) == pytest.approx(0.05, abs=0.046)
    remembering = np.convolve(white[0], np.ones(5), mode="valid")
    assert whiteness(remembering) < 1e-6
    assert whiteness(np.zeros(50)) == 1.0


def test_the_true_model_leaves_white_noise_of_its_size() -> None:
    cuts = manoeuvres(62)["G4"]
    for quality in evaluate_model(TRUTH, cuts):
        assert quality.rms == pytest.approx(0.2, rel=0.15)
        assert quality.fit_percent > 90.0
    slow = TransferFunction(numerator=(0.1,), denominator=(1.0, 0.6, 0.1), delay_s=0.6)
    assert all(q.whiteness < 1e-9 for q in evaluate_model(slow, cuts))
