"""The shipped model of a PX4 vehicle that nobody flew: its numbers are those of its own readings."""

from __future__ import annotations

import math

import pytest

from planner.autopilot import Autopilot
from planner.physics.rotor import Rotor, momentum_power_w
from planner.vehicle.library import load_vehicle
from planner.vehicle.power import MomentumLaw

QUAD = load_vehicle("px4-quad-2kg")


def rotor(rotor_radius_m: float) -> Rotor:
    law = QUAD.cruise
    assert isinstance(law, MomentumLaw)
    return Rotor(
        disk_area_m2=4.0 * math.pi * rotor_radius_m**2,
        drag_area_m2=law.drag_area_m2,
        induced_factor=law.induced_factor,
        axial_factor=law.axial_factor,
        profile_factor=law.profile_factor,
        profile_speed_factor=law.profile_speed_factor,
    )


def test_a_px4_user_without_logs_gets_power_and_its_spread() -> None:
    assert QUAD.reference is Autopilot.PX4
    assert QUAD.is_power_known
    assert QUAD.spread is not None
    assert QUAD.spread.energy_fraction == 0.2
    assert QUAD.battery is not None
    assert QUAD.position_noise_m == 0.1


def test_the_disk_is_that_of_ten_inch_rotors_and_hover_that_of_the_efficiencies_named() -> None:
    law = QUAD.cruise
    assert isinstance(law, MomentumLaw)
    assert law.disk_area_m2 == pytest.approx(4.0 * math.pi * (5.0 * 0.0254) ** 2, rel=1e-3)
    # T sqrt(T/(2 rho A)) over a figure of merit of 0.6 and 0.8 for motors and controllers.
    thrust_n = 2.0 * 9.80665
    ideal_w = thrust_n * math.sqrt(thrust_n / (2.0 * 1.225 * law.disk_area_m2))
    found = momentum_power_w(0.0, 0.0, rotor(0.127), mass_kg=2.0, air_density_kg_m3=1.225)
    assert float(found) == pytest.approx(ideal_w / (0.6 * 0.8), rel=0.01)


def test_its_factors_give_the_hover_of_a_real_vehicle_within_their_spread() -> None:
    # Rodrigues et al., Sci. Data 8:155 (2021): DJI Matrice 100, four rotors of 0.33 m, 3.715 kg without its
    # load; 509 W in the mean of thirteen flights.
    found = momentum_power_w(0.0, 0.0, rotor(0.165), mass_kg=3.715, air_density_kg_m3=1.225)
    assert QUAD.spread is not None
    assert float(found) == pytest.approx(509.0, rel=QUAD.spread.energy_fraction)
