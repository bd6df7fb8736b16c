"""Hover laws by pencil."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.physics.hover import altitude_law_hover_power_w, density_law_hover_power_w


def test_the_altitude_law_is_a_power_of_height_held_at_the_ground() -> None:
    power_w = altitude_law_hover_power_w(
        [0.0, 4.0, 9.0], coefficient_w=10.0, exponent=0.5, lowest_height_m=4.0
    )
    assert power_w.tolist() == [20.0, 20.0, 30.0]


def test_momentum_theory_scales_with_thrust_to_the_three_halves_over_root_density() -> None:
    # P = T^1.5 / sqrt(2 rho A) with T = m g, A = 0.2 m², at 1 kg and 4 kg, 1.225 and 0.3 kg/m³
    def ideal_w(mass_kg: float, density_kg_m3: float) -> float:
        return float((mass_kg * 9.80665) ** 1.5 / np.sqrt(2.0 * density_kg_m3 * 0.2))

    scaled_w = density_law_hover_power_w(
        4.0,
        0.3,
        hover_power_w=ideal_w(1.0, 1.225),
        reference_mass_kg=1.0,
        reference_density_kg_m3=1.225,
        mass_exponent=1.5,
        density_exponent=-0.5,
    )
    assert float(scaled_w) == pytest.approx(ideal_w(4.0, 0.3), rel=1e-12)


def test_mass_and_density_broadcast() -> None:
    power_w = density_law_hover_power_w(
        np.array([[1.0], [2.0]]),
        np.array([1.0, 4.0, 16.0]),
        hover_power_w=8.0,
        reference_mass_kg=1.0,
        reference_density_kg_m3=1.0,
        mass_exponent=1.0,
        density_exponent=-0.5,
    )
    assert power_w.tolist() == [[8.0, 4.0, 2.0], [16.0, 8.0, 4.0]]


@given(
    light_kg=st.floats(0.1, 50.0),
    heavy_kg=st.floats(0.1, 50.0),
    mass_exponent=st.floats(0.0, 3.0),
)
@settings(deadline=None, max_examples=50)
def test_more_mass_never_hovers_for_less(
    light_kg: float, heavy_kg: float, mass_exponent: float
) -> None:
    power_w = density_law_hover_power_w(
        np.sort([light_kg, heavy_kg]),
        1.0,
        hover_power_w=100.0,
        reference_mass_kg=2.0,
        reference_density_kg_m3=1.225,
        mass_exponent=mass_exponent,
        density_exponent=-0.5,
    )
    assert power_w[0] <= power_w[1]
