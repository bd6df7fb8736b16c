"""Momentum theory by pencil, in its limits and against the roots of its polynomial."""

from __future__ import annotations

import doctest
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.physics import atmosphere, battery, rotor, wind
from planner.physics.rotor import (
    FASTEST_DESCENT_RATIO,
    Acceleration,
    Rotor,
    hover_induced_velocity_m_s,
    induced_velocity_ratio,
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
    air = {"mass_kg": MASS_KG, "air_density_kg_m3": DENSITY_KG_M3}
    air = {name: changed.pop(name, value) for name, value in air.items()}
    rotor = Rotor(DISK_M2, 0.0, 1.0, 1.0, 0.0, 0.0)._replace(**changed)
    return float(momentum_power_w(airspeed_m_s, climb_m_s, rotor, acceleration=None, **air))


def accelerating_w(airspeed_m_s: float, acceleration: Acceleration, **changed: float) -> float:
    """Return the power of that disk in level flight that accelerates."""
    return float(
        momentum_power_w(
            airspeed_m_s,
            0.0,
            Rotor(DISK_M2, 0.0, 1.0, 1.0, 0.0, 0.0)._replace(**changed),
            mass_kg=MASS_KG,
            air_density_kg_m3=DENSITY_KG_M3,
            acceleration=acceleration,
        )
    )


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


def test_the_solution_is_good_to_ten_digits_everywhere() -> None:
    # From axial flight to twenty times the induced velocity of hover, densest where hover is near.
    edgewise = np.concatenate((np.linspace(0.0, 3.0, 121), np.linspace(3.0, 20.0, 86)))[:, None]
    axial = np.linspace(FASTEST_DESCENT_RATIO, 4.0, 111)
    ratio = induced_velocity_ratio(edgewise, axial)
    np.testing.assert_allclose(ratio * np.hypot(edgewise, axial + ratio), 1.0, rtol=0.0, atol=1e-10)


@given(
    edgewise=st.floats(min_value=0.0, max_value=20.0),
    axial=st.floats(min_value=FASTEST_DESCENT_RATIO, max_value=10.0),
)
@settings(max_examples=examples(200), deadline=None)
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


def test_accelerating_upwards_is_hovering_at_more_weight() -> None:
    # T = m (g + a), and a disk takes T^1.5: half a g more takes 1.5^1.5 = 1.837 of hover
    rising = Acceleration(along_m_s2=0.0, across_m_s2=0.0, up_m_s2=0.5 * GRAVITY_M_S2)
    assert accelerating_w(0.0, rising) == pytest.approx(IDEAL_W * 1.5**1.5, rel=1e-12)


@pytest.mark.parametrize("sideways", [(0.75, 0.0), (0.0, 0.75), (-0.45, 0.6)])
def test_setting_off_to_any_side_leans_the_thrust(sideways: tuple[float, float]) -> None:
    # 0.75 g to the side: T = m g hypot(1, 0.75) = 1.25 m g; at rest nothing is gained yet
    along, across = (part * GRAVITY_M_S2 for part in sideways)
    leaning = Acceleration(along_m_s2=along, across_m_s2=across, up_m_s2=0.0)
    assert accelerating_w(0.0, leaning) == pytest.approx(IDEAL_W * 1.25**1.5, rel=1e-12)


def test_gaining_speed_takes_the_power_that_kinetic_energy_grows_by() -> None:
    # m a V = 2 x 3 x 8 W, counted by k_a alone; a turn gains no speed
    gaining = Acceleration(along_m_s2=3.0, across_m_s2=5.0, up_m_s2=0.0)
    assert accelerating_w(8.0, gaining, induced_factor=0.0) == pytest.approx(48.0, rel=1e-12)
    turning = gaining._replace(along_m_s2=0.0)
    assert accelerating_w(8.0, turning, induced_factor=0.0) == 0.0


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


@pytest.mark.parametrize(
    ("descent", "induced"),
    [
        (0.25, 1.0 + 0.28125 - 0.08575 + 0.02684375 - 0.00255859375),
        (0.5, 1.0 + 0.5625 - 0.343 + 0.21475 - 0.0409375),
        (1.0, 1.0 + 1.125 - 1.372 + 1.718 - 0.655),
    ],
)
def test_a_vortex_ring_takes_what_was_measured_of_rotors(descent: float, induced: float) -> None:
    # T (v_i − V) of an ideal disk with the induced velocity of Leishman's polynomial
    found = power_w(0.0, -descent * HOVER_M_S, vortex_ring_factor=1.0)
    assert found == pytest.approx((induced - descent) * IDEAL_W, rel=1e-9)


def test_no_vortex_ring_forms_in_climbs_or_fast_flight() -> None:
    for airspeed, climb in ((0.0, 3.0), (5.0, 0.0), (1.3 * HOVER_M_S, -2.0)):
        assert power_w(airspeed, climb, vortex_ring_factor=1.0) == power_w(airspeed, climb)
    slow, faster = (power_w(v, -3.0, vortex_ring_factor=1.0) - power_w(v, -3.0) for v in (1.0, 4.0))
    assert slow > faster > 0.0


@given(
    # A heavy vehicle that dives fast wins more height than its weight costs it.
    airspeed=st.floats(min_value=0.0, max_value=20.0),
    climb=st.floats(min_value=-1.5, max_value=8.0),
    more_kg=st.floats(min_value=0.0, max_value=3.0),
)
@settings(max_examples=examples(100), deadline=None)
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
