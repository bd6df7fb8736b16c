"""The laws of power by pencil."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.vehicle.power import AltitudeLaw, DensityLaw, DiFrancoButtazzoLaw, LiuLaw

IRIS = LiuLaw(k1=0.8554, k2_sqrt_kg_m=0.3051, c2_sqrt_m_kg=0.3177, c4_kg_m=0.0296, c5_kg_m=0.0279)
"""Of an IRIS+, as public implementations quote table 3 of Liu et al. (2017)."""
CURVE = DiFrancoButtazzoLaw(
    coefficients=(2.0, -12.0, 220.0),
    climb_power_w=250.0,
    climb_speed_m_s=2.0,
    descent_power_w=160.0,
    descent_speed_m_s=3.0,
)


def density_law(
    hover_power_w: float, reference_mass_kg: float, reference_density_kg_m3: float, exponent: float
) -> DensityLaw:
    return DensityLaw(
        hover_power_w=hover_power_w,
        reference_mass_kg=reference_mass_kg,
        reference_density_kg_m3=reference_density_kg_m3,
        mass_exponent=exponent,
        density_exponent=-0.5,
    )


def test_the_altitude_law_is_a_power_of_height_held_at_the_ground() -> None:
    law = AltitudeLaw(coefficient_w=10.0, exponent=0.5, lowest_height_m=4.0)
    assert law.power_w([0.0, 4.0, 9.0]).tolist() == [20.0, 20.0, 30.0]


def test_momentum_theory_scales_with_thrust_to_the_three_halves_over_root_density() -> None:
    # P = T^1.5 / sqrt(2 rho A) with T = m g, A = 0.2 m², at 2 kg and 4 kg, 1.225 and 0.3 kg/m³
    def ideal_w(mass_kg: float, density_kg_m3: float) -> float:
        return float((mass_kg * 9.80665) ** 1.5 / np.sqrt(2.0 * density_kg_m3 * 0.2))

    scaled_w = density_law(ideal_w(2.0, 1.225), 2.0, 1.225, 1.5).power_w(4.0, 0.3)
    assert float(scaled_w) == pytest.approx(ideal_w(4.0, 0.3), rel=1e-12)


def test_mass_and_density_broadcast() -> None:
    law = density_law(8.0, 1.0, 1.0, 1.0)
    power_w = law.power_w(np.array([[1.0], [2.0]]), np.array([1.0, 4.0, 16.0]))
    assert power_w.tolist() == [[8.0, 4.0, 2.0], [16.0, 8.0, 4.0]]


@given(light_kg=st.floats(0.1, 50.0), heavy_kg=st.floats(0.1, 50.0), exponent=st.floats(0.0, 3.0))
@settings(deadline=None, max_examples=examples(50))
def test_more_mass_never_hovers_for_less(light_kg: float, heavy_kg: float, exponent: float) -> None:
    power_w = density_law(100.0, 2.0, 1.225, exponent).power_w(np.sort([light_kg, heavy_kg]), 1.0)
    assert power_w[0] <= power_w[1]


@pytest.mark.parametrize(
    ("airspeed_m_s", "climb_m_s", "by_pencil_w"),
    [
        # T = 1.5 x 9.80665 = 14.710 N, T^1.5 = 56.419: 0.8554 x 56.419 / 0.3051 + 0.3177 x 56.419
        (0.0, 0.0, 158.18 + 17.92),
        # through the disk 1 + sqrt(1 + 14.710 / 0.093086) = 13.610 m/s: 0.8554 x 14.710 x 13.610
        (0.0, 2.0, 171.26 + 17.92),
        # drag 2.96 N, cos² = 1 / (1 + (2.96 / 14.710)²) = 0.96109, lift 2.79 x 0.96109 = 2.6814 N,
        # T = sqrt(12.0286² + 2.96²) = 12.3874 N, T^1.5 = 43.598, and 2.96 x 10 of drag
        (10.0, 0.0, 122.24 + 13.85 + 29.60),
    ],
)
def test_liu_by_pencil(airspeed_m_s: float, climb_m_s: float, by_pencil_w: float) -> None:
    power_w = IRIS.power_w(airspeed_m_s, climb_m_s, 1.5)
    assert power_w == pytest.approx(by_pencil_w, abs=0.03)  # the pencil has two decimals


def test_liu_hovers_on_the_power_of_three_halves_of_the_mass() -> None:
    light, heavy = (IRIS.power_w(0.0, 0.0, mass_kg) for mass_kg in (1.5, 3.0))
    assert heavy / light == pytest.approx(2.0**1.5)


def test_the_curve_of_di_franco_and_buttazzo_by_pencil() -> None:
    airspeed, climb = np.array([0.0, 3.0, 0.0, 0.0, 3.0]), np.array([0.0, 0.0, 2.0, -0.5, 1.0])
    # 2 v² − 12 v + 220; the climb adds 15 W for each m/s, the descent takes 20 W off
    expected = [220.0, 202.0, 250.0, 210.0, 217.0]
    assert CURVE.power_w(airspeed, climb) == pytest.approx(expected)


def test_a_metre_of_height_costs_the_same_at_any_rate() -> None:
    rates = np.array([0.5, 1.0, 4.0])
    assert (CURVE.power_w(np.zeros(3), rates) - 220.0) / rates == pytest.approx([15.0, 15.0, 15.0])
