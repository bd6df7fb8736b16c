"""Cruise power over airspeed as a table with one minimum, and as momentum theory."""

from __future__ import annotations

import numpy as np
import pytest

from planner.errors import IdentificationError
from planner.identify.cruise import fit_cruise_curve, fit_momentum_law
from planner.identify.steady import SteadyPower
from planner.physics.rotor import momentum_power_w

LAW = {
    "mass_kg": 2.5,
    "air_density_kg_m3": 1.18,
    "disk_area_m2": 0.4,
    "drag_area_m2": 0.05,
    "induced_factor": 1.5,
    "axial_factor": 1.5,
    "profile_factor": 0.3,
    "profile_speed_factor": 0.0,
}


def cruise(speed_m_s: float, power_w: float, error_w: float = 1.0) -> SteadyPower:
    return SteadyPower(
        power_w=power_w,
        error_w=error_w,
        duration_s=30.0,
        height_above_home_m=50.0,
        airspeed_m_s=speed_m_s,
        air_density_kg_m3=LAW["air_density_kg_m3"],
        mass_kg=LAW["mass_kg"],
    )


def swept(noise: float = 0.0) -> list[SteadyPower]:
    generator = np.random.default_rng(31)
    return [
        cruise(
            speed,
            float(momentum_power_w(speed, 0.0, **LAW)) + noise * generator.standard_normal(),
            max(noise, 0.1),
        )
        for speed in (0.0, 3.0, 5.0, 8.0, 10.0, 12.0, 15.0)
    ]


def test_a_curve_with_one_minimum_is_kept() -> None:
    cruises = [cruise(5.0, 180.0), cruise(10.0, 150.0), cruise(15.0, 210.0)]
    curve = fit_cruise_curve(cruises, [200.0] * 3)
    assert curve.speed_m_s == (0.0, 5.0, 10.0, 15.0)
    assert curve.power_above_hover_w == (0.0, -20.0, -50.0, 10.0)
    assert curve.smoothing_w == 0.0


def test_a_bump_is_levelled_by_the_weighted_mean_of_its_neighbours() -> None:
    powers = [150.0, 160.0, 154.0, 200.0]  # the second rises too early for a fall to the third
    cruises = [cruise(5.0 * (i + 1), p) for i, p in enumerate(powers)]
    curve = fit_cruise_curve(cruises, [200.0] * 4)
    assert curve.power_above_hover_w == pytest.approx((0.0, -50.0, -43.0, -43.0, 0.0))
    assert curve.smoothing_w == pytest.approx(3.0)


def test_flights_of_nearly_one_speed_are_one_point() -> None:
    cruises = [cruise(9.9, 150.0, 1.0), cruise(10.1, 160.0, 2.0)]
    curve = fit_cruise_curve(cruises, [200.0, 202.0])
    assert len(curve.speed_m_s) == 2
    # weights 1 and 1/4: -50 and -42
    assert curve.power_above_hover_w[1] == pytest.approx((-50.0 - 42.0 / 4.0) / 1.25)
    assert curve.error_w[1] > 1.25**-0.5  # they differ by more than their errors


def test_no_steady_flight_at_a_speed_is_refused() -> None:
    with pytest.raises(IdentificationError, match="cruise power"):
        fit_cruise_curve([cruise(0.1, 200.0)], [200.0])


def test_momentum_theory_comes_back() -> None:
    fit = fit_momentum_law(swept(), disk_area_m2=0.4)
    assert fit.drag_area_m2 == pytest.approx(0.05, rel=1e-4)
    assert fit.loss_factor == pytest.approx(1.5, rel=1e-4)
    assert fit.profile_factor == pytest.approx(0.3, rel=1e-3)
    powers = fit.power_w([0.0, 10.0], mass_kg=2.5, air_density_kg_m3=1.18)
    np.testing.assert_allclose(powers, momentum_power_w([0.0, 10.0], 0.0, **LAW), rtol=1e-6)


def test_momentum_theory_comes_back_within_its_errors() -> None:
    fit = fit_momentum_law(swept(noise=0.5), disk_area_m2=0.4)
    for estimate, truth in zip(fit.estimates, (0.05, 1.5, 0.3), strict=True):
        assert abs(estimate.value - truth) < 3.5 * estimate.error
        assert estimate.error < 0.5 * truth


def test_too_few_speeds_for_momentum_theory_are_refused() -> None:
    with pytest.raises(IdentificationError, match="three speeds"):
        fit_momentum_law([cruise(0.0, 200.0), cruise(10.0, 180.0)], disk_area_m2=0.4)
    unknown = SteadyPower(
        power_w=200.0, error_w=1.0, duration_s=9.0, height_above_home_m=9.0, airspeed_m_s=4.0
    )
    with pytest.raises(IdentificationError, match="mass and air density"):
        fit_momentum_law([unknown], disk_area_m2=0.4)
