"""Power by pencil: momentum theory in its limits and against its polynomial, hover laws, curves."""

from __future__ import annotations

import doctest
import math
from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.physics import atmosphere, battery, rotor, wind
from planner.physics.rotor import (
    FASTEST_DESCENT_RATIO,
    altitude_law_hover_power_w,
    density_law_hover_power_w,
    di_franco_buttazzo_power_w,
    hover_induced_velocity_m_s,
    induced_velocity_ratio,
    liu_power_w,
    momentum_power_w,
)
from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
    from types import ModuleType

MASS_KG, DENSITY_KG_M3, DISK_M2 = 2.0, 1.225, 0.2
WEIGHT_N = MASS_KG * GRAVITY_M_S2
HOVER_M_S = math.sqrt(WEIGHT_N / (2.0 * DENSITY_KG_M3 * DISK_M2))  # 6.3267
IDEAL_W = WEIGHT_N * HOVER_M_S  # 124.09


def power_w(airspeed_m_s: float, climb_m_s: float, **changed: float) -> float:
    """Return the power of an ideal disk without drag, with what is changed about it."""
    values: dict[str, Any] = {
        "mass_kg": MASS_KG,
        "air_density_kg_m3": DENSITY_KG_M3,
        "disk_area_m2": DISK_M2,
        "drag_area_m2": 0.0,
        "induced_factor": 1.0,
        "axial_factor": 1.0,
        "profile_factor": 0.0,
        "profile_speed_factor": 0.0,
    }
    return float(momentum_power_w(airspeed_m_s, climb_m_s, **(values | changed)))


@pytest.mark.parametrize("module", [rotor, atmosphere, battery, wind])
def test_the_examples_in_the_documentation_hold(module: ModuleType) -> None:
    failed, tried = doctest.testmod(module)
    assert tried > 0
    assert failed == 0


def test_the_induced_velocity_of_hover_is_that_of_the_disk() -> None:
    assert hover_induced_velocity_m_s(
        WEIGHT_N, DENSITY_KG_M3, disk_area_m2=DISK_M2
    ) == pytest.approx(6.3267, abs=1e-4)


@pytest.mark.parametrize(
    ("edgewise", "axial", "ratio"),
    [
        (0.0, 0.0, 1.0),
        (0.0, 1.0, (math.sqrt(5.0) - 1.0) / 2.0),  # u (1 + u) = 1
        (0.0, -0.5, 0.25 + math.sqrt(1.0625)),  # u (u − 1/2) = 1
        (1.0, 0.0, math.sqrt((math.sqrt(5.0) - 1.0) / 2.0)),  # u² (1 + u²) = 1
        (10.0, 0.0, 0.1 * (1.0 - 0.5e-4)),  # 1/x (1 − 1/(2 x⁴)) for fast flight
    ],
)
def test_known_solutions_are_found(edgewise: float, axial: float, ratio: float) -> None:
    assert induced_velocity_ratio(edgewise, axial) == pytest.approx(ratio, abs=1e-7)


@given(
    edgewise=st.floats(min_value=0.0, max_value=20.0),
    axial=st.floats(min_value=FASTEST_DESCENT_RATIO, max_value=10.0),
)
@settings(max_examples=200, deadline=None)
def test_the_solution_is_the_only_positive_root(edgewise: float, axial: float) -> None:
    # Squared, u² (x² + (z + u)²) = 1 is a polynomial of the fourth degree.
    roots = np.roots([1.0, 2.0 * axial, edgewise**2 + axial**2, 0.0, -1.0])
    positive = [r.real for r in roots if abs(r.imag) < 1e-7 and r.real > 0.0]
    assert len(positive) == 1
    # np.roots finds roots of polynomials with coefficients of up to 500 to about 1e-8.
    assert float(induced_velocity_ratio(edgewise, axial)) == pytest.approx(positive[0], abs=1e-7)


def test_beyond_the_fastest_descent_there_are_descents_with_several_solutions() -> None:
    roots = np.roots([1.0, -4.2, 0.4**2 + 2.1**2, 0.0, -1.0])
    assert sum(abs(r.imag) < 1e-9 and r.real > 0.0 for r in roots) == 3


def test_an_ideal_disk_hovers_on_thrust_times_induced_velocity() -> None:
    assert power_w(0.0, 0.0) == pytest.approx(IDEAL_W, rel=1e-12)


def test_climbing_at_the_induced_velocity_takes_the_golden_ratio_of_hover() -> None:
    # T (V + v_i) with v_i = 0.618 v_h
    assert power_w(0.0, HOVER_M_S) == pytest.approx(IDEAL_W * (1.0 + math.sqrt(5.0)) / 2.0)


def test_a_very_fast_climb_takes_the_power_of_lifting_alone() -> None:
    assert power_w(0.0, 100.0 * HOVER_M_S) == pytest.approx(WEIGHT_N * 100.0 * HOVER_M_S, rel=2e-4)


def test_drag_takes_the_cube_of_the_speed() -> None:
    drag_w = power_w(12.0, 0.0, drag_area_m2=0.02, induced_factor=0.0)
    assert drag_w == pytest.approx(0.5 * 1.225 * 0.02 * 12.0**3)


def test_profile_power_grows_with_the_square_of_the_speed() -> None:
    factors = {"induced_factor": 0.0, "profile_factor": 0.3, "profile_speed_factor": 0.1}
    assert power_w(0.0, 0.0, **factors) == pytest.approx(0.3 * IDEAL_W)
    assert power_w(2.0 * HOVER_M_S, 0.0, **factors) == pytest.approx(0.3 * IDEAL_W * 1.4)


def test_hover_power_follows_mass_and_density() -> None:
    assert power_w(0.0, 0.0, mass_kg=2.0 * MASS_KG) == pytest.approx(IDEAL_W * 2.0**1.5)
    assert power_w(0.0, 0.0, air_density_kg_m3=DENSITY_KG_M3 / 4.0) == pytest.approx(2.0 * IDEAL_W)


def test_forward_flight_is_cheaper_than_hover_before_drag_makes_it_dearer() -> None:
    slow, fast = (power_w(v, 0.0, drag_area_m2=0.03) for v in (8.0, 25.0))
    assert slow < power_w(0.0, 0.0) < fast


def test_no_descent_wins_power_back_and_none_is_cheaper_than_the_fastest_known() -> None:
    held = power_w(0.0, 1.5 * -HOVER_M_S)
    # u = 0.75 + sqrt(0.75² + 1) = 2 and z = −1.5
    assert held == pytest.approx(0.5 * IDEAL_W)
    assert power_w(0.0, -5.0 * HOVER_M_S) == pytest.approx(held)
    assert power_w(0.0, -HOVER_M_S, axial_factor=5.0) == 0.0


@given(
    # A heavy vehicle that dives fast wins more height than its weight costs it.
    airspeed=st.floats(min_value=0.0, max_value=20.0),
    climb=st.floats(min_value=-1.5, max_value=8.0),
    more_kg=st.floats(min_value=0.0, max_value=3.0),
)
@settings(max_examples=100, deadline=None)
def test_more_mass_never_takes_less_power(airspeed: float, climb: float, more_kg: float) -> None:
    light, heavy = (
        power_w(
            airspeed,
            climb,
            mass_kg=mass_kg,
            drag_area_m2=0.02,
            induced_factor=1.5,
            axial_factor=1.4,
            profile_factor=0.3,
            profile_speed_factor=0.05,
        )
        for mass_kg in (MASS_KG, MASS_KG + more_kg)
    )
    assert heavy >= light


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


IRIS: dict[str, Any] = {
    "k1": 0.8554,
    "k2_sqrt_kg_m": 0.3051,
    "c2_sqrt_m_kg": 0.3177,
    "c4_kg_m": 0.0296,
    "c5_kg_m": 0.0279,
}
"""Of an IRIS+, as public implementations quote table 3 of Liu et al. (2017)."""
CURVE: dict[str, Any] = {
    "coefficients": (2.0, -12.0, 220.0),
    "climb_power_w": 250.0,
    "climb_speed_m_s": 2.0,
    "descent_power_w": 200.0,
    "descent_speed_m_s": 1.0,
}


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
    power_w = liu_power_w(airspeed_m_s, climb_m_s, mass_kg=1.5, **IRIS)
    assert power_w == pytest.approx(by_pencil_w, abs=0.03)  # the pencil has two decimals


def test_liu_hovers_on_the_power_of_three_halves_of_the_mass() -> None:
    light, heavy = (liu_power_w(0.0, 0.0, mass_kg=mass_kg, **IRIS) for mass_kg in (1.5, 3.0))
    assert heavy / light == pytest.approx(2.0**1.5)


def test_the_curve_of_di_franco_and_buttazzo_by_pencil() -> None:
    power_w = di_franco_buttazzo_power_w(
        np.array([0.0, 3.0, 0.0, 0.0, 3.0]), np.array([0.0, 0.0, 2.0, -0.5, 1.0]), **CURVE
    )
    # 2 v² − 12 v + 220; the climb adds 15 W for each m/s, the descent takes 20 W off
    assert power_w == pytest.approx([220.0, 202.0, 250.0, 210.0, 217.0])


def test_a_metre_of_height_costs_the_same_at_any_rate() -> None:
    rates = np.array([0.5, 1.0, 4.0])
    above_w = di_franco_buttazzo_power_w(np.zeros(3), rates, **CURVE) - 220.0
    assert above_w / rates == pytest.approx([15.0, 15.0, 15.0])
