"""Draws of models are models, and spread as their fit says."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from experiment_manoeuvres import hovers, manoeuvres
from simulated_experiment import fly_vertically

from planner.errors import IdentificationError
from planner.identify.hover import fit_altitude_law
from planner.identify.output_error import fit_response
from planner.identify.response_fit import ResponseFit
from planner.identify.spread import draw_altitude_laws, draw_responses
from planner.identify.structure import MOTION, POWER_WITHOUT_ZERO, Structure
from planner.physics.response import StepResponse
from planner.physics.transfer_function import TransferFunction

DRAWS = 10_000


def test_ten_thousand_draws_spread_as_the_fit_says() -> None:
    fit = fit_response(manoeuvres(51)["G4"], MOTION)
    spread = draw_responses(fit, DRAWS, np.random.default_rng(52))
    systems = spread.systems
    assert systems.denominators.shape == (DRAWS, 3)
    assert spread.valid_share == 1.0
    drawn = np.column_stack(
        [systems.numerators, systems.denominators[:, 1:], np.asarray(systems.delay_s)]
    )
    scale = np.sqrt(np.diagonal(fit.covariance))
    # errors of a mean and of a correlation over 10 000 draws: 0.01, and 0.014 at most
    np.testing.assert_allclose((drawn.mean(axis=0) - fit.coefficients) / scale, 0.0, atol=0.05)
    np.testing.assert_allclose(
        np.cov(drawn.T) / np.outer(scale, scale),
        fit.covariance / np.outer(scale, scale),
        atol=0.07,
    )
    gains = StepResponse(system=systems).value(60.0)
    assert gains.mean() == pytest.approx(fit.estimate("steady_gain").value, abs=1e-3)
    assert gains.std() == pytest.approx(fit.estimate("steady_gain").error, rel=0.05)


def test_draws_of_an_undamped_model_are_stable() -> None:
    fit = fit_response(manoeuvres(53)["G5"], POWER_WITHOUT_ZERO)
    spread = draw_responses(fit, 2000, np.random.default_rng(54))
    assert np.all(spread.systems.denominators > 0.0)
    assert np.all(np.asarray(spread.systems.delay_s) >= 0.0)
    assert 0.3 < spread.valid_share < 1.0  # about half of them would ring for ever and more


def third_order(error: float) -> ResponseFit:
    structure = Structure(numerator_degree=0, denominator_degree=3)
    return ResponseFit(
        structure=structure,
        transfer_function=TransferFunction(
            numerator=(1.0,), denominator=(1.0, 1.0, 1.2, 1.0), delay_s=1.0
        ),
        covariance=error**2 * np.eye(5),
        noises={},
        criterion=0.0,
        samples=100,
        manoeuvres=1,
    )


def test_draws_of_a_third_order_model_are_stable_by_routh() -> None:
    spread = draw_responses(third_order(0.2), 500, np.random.default_rng(55))
    _, a2, a1, a0 = spread.systems.denominators.T
    assert np.all(a2 * a1 > a0)
    assert np.all(a0 > 0.0)
    assert spread.valid_share < 1.0


def test_a_fit_too_uncertain_for_a_spread_is_refused() -> None:
    hopeless = replace(
        third_order(1e-9),
        transfer_function=TransferFunction(
            numerator=(1.0,), denominator=(1.0, 0.1, 0.1, 1.0), delay_s=1.0
        ),
    )
    with pytest.raises(IdentificationError, match="too uncertain"):
        draw_responses(hopeless, 100, np.random.default_rng(56))


def test_hover_laws_are_drawn_with_their_correlation() -> None:
    fit = fit_altitude_law(hovers(fly_vertically(np.random.default_rng(57))))
    laws = draw_altitude_laws(fit, DRAWS, np.random.default_rng(58))
    errors = [estimate.error for estimate in fit.estimates]
    np.testing.assert_allclose(laws.std(axis=0), errors, rtol=0.05)
    # K and z trade places: where the hovers were, power is known far better than K
    at_200_m = laws[:, 0] * 200.0 ** laws[:, 1]
    assert at_200_m.std() < 0.2 * errors[0] * 200.0**fit.law.exponent
