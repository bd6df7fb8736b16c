"""The shipped model of the article: printed coefficients, explicit readings, reference values."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest

from planner.autopilot import Autopilot
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import AltitudeLaw, DensityLaw, hover_power_w

if TYPE_CHECKING:
    from planner.vehicle.model import VehicleModel


@pytest.fixture(scope="module")
def article() -> VehicleModel:
    return load_vehicle("falkowski-2023-quadrotor")


# Sensors 2023, 23(23), 9378, equations 6 to 10, as printed
PRINTED = {
    "altitude": ((0.03071,), (1.0, 0.2923, 0.03071), 2.9),
    "climb_power": ((0.07023, 0.02383), (1.0, 0.006887, 0.06957), 0.2),
    "descent_power": ((0.09489, -0.00001339), (1.0, 0.228, 0.05344), 0.5),
    "speed": ((0.03569,), (1.0, 0.935, 0.3588), 0.6),
    "brake_power": ((0.02583, -0.3294), (1.0, 1.905e-10, 0.2492), 0.6),
}


def response_of(article: VehicleModel, name: str) -> Any:  # noqa: ANN401 - one of four classes
    return getattr(article.responses, name)


@pytest.mark.parametrize("name", PRINTED)
def test_the_five_models_have_the_printed_coefficients(article: VehicleModel, name: str) -> None:
    response = response_of(article, name)
    assert (response.numerator, response.denominator, response.delay_s) == PRINTED[name]


def test_ten_metres_per_second_commanded_end_at_9_947(article: VehicleModel) -> None:
    # reading of equation 9: 10 x 10 x 0.03569 / 0.3588
    response = response_of(article, "speed")
    gain = response.input_gain * response.numerator[-1] / response.denominator[-1]
    assert gain * 10.0 == pytest.approx(9.947, abs=5e-4)


@pytest.mark.parametrize(
    ("name", "stated_s"),
    [("climb_power", 24.0235), ("descent_power", None), ("brake_power", 13.1865)],
)
def test_windows_are_delay_plus_one_damped_period(
    article: VehicleModel, name: str, stated_s: float | None
) -> None:
    response = response_of(article, name)
    _, a1, a0 = response.denominator
    damped_period_s = math.tau / math.sqrt(a0 - a1**2 / 4.0)
    assert response.window_s == pytest.approx(response.delay_s + damped_period_s, abs=1e-9)
    if stated_s is not None:
        assert response.window_s == pytest.approx(stated_s, abs=5e-5)


def test_motion_models_have_no_window(article: VehicleModel) -> None:
    assert not hasattr(response_of(article, "altitude"), "window_s")
    assert not hasattr(response_of(article, "speed"), "window_s")


@pytest.mark.parametrize(
    ("height_m", "power_w"),
    [(1, 119.490), (50, 129.214), (100, 131.018), (200, 132.847), (300, 133.929), (400, 134.702)],
)
def test_hover_power_follows_equation_5(
    article: VehicleModel, height_m: float, power_w: float
) -> None:
    law = article.hover
    assert isinstance(law, AltitudeLaw)
    hover_w = hover_power_w(
        law, height_above_home_m=height_m, mass_kg=None, air_density_kg_m3=1.225
    )
    assert float(hover_w) == pytest.approx(power_w, abs=5e-4)


def test_hover_power_is_held_below_one_metre(article: VehicleModel) -> None:
    heights_m = np.array([-5.0, 0.0, 0.5, 1.0])
    assert isinstance(article.hover, AltitudeLaw)
    hover_w = hover_power_w(
        article.hover, height_above_home_m=heights_m, mass_kg=None, air_density_kg_m3=1.225
    )
    assert hover_w.tolist() == [119.49] * 4


def test_what_the_article_does_not_give_is_not_invented(article: VehicleModel) -> None:
    assert article.cruise is None
    assert article.vertical is None
    assert article.battery is None
    assert article.mass_kg is None


def test_the_identified_range_is_stated(article: VehicleModel) -> None:
    assert article.reference is Autopilot.STEP
    assert article.default_speed_m_s == 10.0
    for name in ("altitude", "climb_power", "descent_power"):
        assert response_of(article, name).identified_step_m == 100.0
    for name in ("speed", "brake_power"):
        assert response_of(article, name).identified_speed_m_s == 10.0
    box = article.valid_for
    assert box.height_above_home_m is not None
    assert (box.height_above_home_m.low, box.height_above_home_m.high) == (0.0, 400.0)
    assert box.hover_height_above_home_m is not None
    assert box.hover_height_above_home_m.low == 100.0


@pytest.mark.parametrize("equation", ["Equation 3", "Equation 5", "Equation 7", "Equation 9"])
def test_every_reading_is_written_down(article: VehicleModel, equation: str) -> None:
    assert any(reading.startswith(equation) for reading in article.provenance.readings)


def test_a_density_law_without_a_mass_is_refused() -> None:
    law = DensityLaw(
        hover_power_w=353.0,
        reference_mass_kg=3.5,
        reference_density_kg_m3=1.225,
        mass_exponent=1.5,
        density_exponent=-0.5,
    )
    with pytest.raises(ValueError, match="mass"):
        hover_power_w(law, height_above_home_m=0.0, mass_kg=None, air_density_kg_m3=1.225)
    # momentum theory: doubling mass and halving density is 2^1.5 x 2^0.5 = 4
    hover_w = hover_power_w(law, height_above_home_m=0.0, mass_kg=7.0, air_density_kg_m3=0.6125)
    assert float(hover_w) == pytest.approx(4.0 * 353.0, rel=1e-12)
