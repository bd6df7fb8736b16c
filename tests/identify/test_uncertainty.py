"""What a fit leaves over: noise with a memory, its errors, and how well a model describes."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_manoeuvres import manoeuvres
from scipy.signal import lfilter

from planner.errors import IdentificationError
from planner.identify.responses import evaluate_model
from planner.identify.uncertainty import (
    Noise,
    fit_noise,
    fit_percent,
    least_squares_covariance,
    mean_with_error,
    told_fit_percent,
    whiteness,
)
from planner.physics.response import TransferFunction


def remembering(
    generator: np.random.Generator, memory: float, shape: tuple[int, ...]
) -> np.ndarray:
    """Stationary first-order noise of variance 1 / (1 - memory²), along the last axis."""
    white = generator.standard_normal(shape)
    white[..., 0] /= np.sqrt(1.0 - memory**2)
    return np.asarray(lfilter([1.0], [1.0, -memory], white, axis=-1))


def test_white_noise_has_no_memory() -> None:
    noise = fit_noise([5.0 * np.random.default_rng(1).standard_normal(4000)], parameters=0)
    assert noise.is_white
    assert noise.deviation == pytest.approx(5.0, rel=0.04)  # 3.5 / sqrt(2 · 4000)
    np.testing.assert_array_equal(noise.autocovariances(3)[1:], 0.0)


def test_the_memory_of_first_order_noise_is_found() -> None:
    stretches = list(remembering(np.random.default_rng(2), 0.8, (4, 3000)))
    noise = fit_noise(stretches, parameters=0)
    assert noise.memory[0] == pytest.approx(0.8, abs=0.03)
    assert noise.innovation_variance == pytest.approx(1.0, rel=0.05)
    expected = 0.8 ** np.arange(8) / (1.0 - 0.64)
    np.testing.assert_allclose(noise.autocovariances(8), expected, atol=0.35)


def test_the_variance_is_corrected_for_what_was_fitted() -> None:
    residuals = np.array([1.0, -1.0, 1.0, -1.0])
    assert fit_noise([residuals], parameters=2).variance == pytest.approx(2.0)  # 4 / (4 - 2)


def test_no_residuals_say_nothing() -> None:
    with pytest.raises(ValueError, match="2 residuals"):
        fit_noise([np.zeros(2)], parameters=2)


def test_residuals_of_zero_are_noise_of_zero() -> None:
    assert fit_noise([np.zeros(50)], parameters=1).variance == 0.0


def test_the_error_of_a_mean_counts_the_memory() -> None:
    # of a long first-order stretch: sigma² (1 + φ) / (1 - φ) / n, here 1 / (1 - 0.9)² / n
    stretches = remembering(np.random.default_rng(3), 0.9, (300, 2000))
    means, errors = zip(*(mean_with_error([s]) for s in stretches), strict=True)
    expected = 1.0 / (1.0 - 0.9) / np.sqrt(2000)
    assert np.median(errors) == pytest.approx(expected, rel=0.1)
    held = np.mean(np.abs(means) < 1.96 * np.array(errors))
    assert held > 0.88  # of 95 %: five standard errors of 300 draws below


def test_the_covariance_of_white_noise_is_the_textbook_one() -> None:
    design = np.stack([np.ones(40), np.arange(40.0)], axis=-1)
    noise = Noise(variance=4.0)
    found = least_squares_covariance([(1.0, design, noise)])
    np.testing.assert_allclose(found, 4.0 * np.linalg.inv(design.T @ design), rtol=1e-12)


def test_the_covariance_under_memory_is_that_of_its_matrix() -> None:
    design = np.stack([np.ones(30), np.sin(np.arange(30.0))], axis=-1)
    noise = Noise(variance=2.0, memory=(0.7,), correlations=(0.7,))
    lags = np.abs(np.subtract.outer(np.arange(30), np.arange(30)))
    inverse = np.linalg.inv(design.T @ design)
    expected = inverse @ design.T @ (2.0 * 0.7**lags) @ design @ inverse
    np.testing.assert_allclose(
        least_squares_covariance([(1.0, design, noise)]), expected, rtol=1e-10
    )


def test_columns_that_say_the_same_are_refused() -> None:
    design = np.ones((20, 2))
    with pytest.raises(IdentificationError, match="do not determine"):
        least_squares_covariance([(1.0, design, Noise(variance=1.0))])


TRUTH = TransferFunction(numerator=(0.3569,), denominator=(1.0, 0.935, 0.3588), delay_s=0.6)


def test_the_fit_is_that_of_the_definition() -> None:
    measured = np.array([0.0, 0.0, 3.0, 3.0])  # 1.5 from its mean: norm 3
    assert fit_percent(measured, measured) == 100.0
    assert fit_percent(measured, np.full(4, 1.5)) == 0.0
    assert fit_percent(measured, np.array([1.5, 0.0, 3.0, 3.0])) == pytest.approx(50.0)
    assert fit_percent(np.ones(3), np.zeros(3)) == -np.inf
    assert told_fit_percent(measured, np.full(4, 1.5)) == 0.0
    assert told_fit_percent(np.ones(1), np.zeros(1)) is None


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
