"""Laws of hover and cruise power fitted to mean powers."""

from __future__ import annotations

import numpy as np
import pytest
from experiment_manoeuvres import hovers
from simulated_experiment import HOVER_COEFFICIENT_W, HOVER_EXPONENT, fly_vertically

from planner.errors import IdentificationError
from planner.identify.power import identify_hover
from planner.identify.power_laws import fit_altitude_law, fit_cruise_curve, fit_density_law
from planner.identify.segments import MeasuredPower


def hover(
    power_w: float,
    height_m: float = 100.0,
    *,
    error_w: float = 0.1,
    mass_kg: float | None = None,
    air_density_kg_m3: float | None = None,
) -> MeasuredPower:
    return MeasuredPower(
        power_w=power_w,
        error_w=error_w,
        duration_s=60.0,
        height_above_home_m=height_m,
        mass_kg=mass_kg,
        air_density_kg_m3=air_density_kg_m3,
    )


def test_the_articles_law_comes_back_from_exact_levels() -> None:
    levels = [hover(119.49 * height**0.02, height) for height in (1.0, 50.0, 100.0, 400.0)]
    fit = fit_altitude_law(levels)
    assert fit.law.coefficient_w == pytest.approx(119.49, rel=1e-9)
    assert fit.law.exponent == pytest.approx(0.02, abs=1e-10)


def test_the_exponent_comes_back_from_the_noisy_experiment() -> None:
    # 5 W over 80 s at each of seven levels leave a standard error of 0.001
    fit = fit_altitude_law(hovers(fly_vertically(np.random.default_rng(21))))
    coefficient, exponent = fit.estimates
    assert exponent.value == pytest.approx(HOVER_EXPONENT, abs=0.002)
    assert 0.0007 < exponent.error < 0.0013
    assert abs(coefficient.value - HOVER_COEFFICIENT_W) < 3.0 * coefficient.error


def test_two_levels_give_the_law_through_them() -> None:
    fit = fit_altitude_law([hover(100.0, 10.0), hover(110.0, 100.0)])
    assert fit.law.exponent == pytest.approx(np.log10(1.1))
    assert fit.law.coefficient_w == pytest.approx(100.0 / 1.1)


def test_scatter_beyond_the_errors_widens_them() -> None:
    powers = (130.0, 136.0, 131.0, 137.0)
    heights = (100.0, 200.0, 300.0, 400.0)
    fits = [
        fit_altitude_law([hover(p, h, error_w=e) for p, h in zip(powers, heights, strict=True)])
        for e in (0.01, 0.1)
    ]
    tight, loose = (fit.estimates[1].error for fit in fits)
    assert tight == pytest.approx(loose, rel=1e-3)


def test_hovers_at_one_height_are_refused() -> None:
    with pytest.raises(IdentificationError, match="two heights"):
        fit_altitude_law([hover(130.0), hover(131.0)])
    with pytest.raises(IdentificationError, match="two heights"):
        fit_altitude_law([hover(130.0, 0.2), hover(131.0, 0.9)])  # both below the lowest


def test_a_law_that_makes_no_sense_is_refused() -> None:
    with pytest.raises(IdentificationError, match="exponent"):
        fit_altitude_law([hover(100.0, 100.0), hover(500.0, 200.0)])
    with pytest.raises(IdentificationError, match="positive"):
        fit_altitude_law([hover(0.0, 100.0), hover(100.0, 200.0)])


def test_one_hover_gives_a_density_law_with_the_exponents_of_theory() -> None:
    fit = fit_density_law([hover(200.0, mass_kg=2.0, air_density_kg_m3=1.2)])
    assert fit.law.hover_power_w == pytest.approx(200.0)
    assert (fit.law.reference_mass_kg, fit.law.reference_density_kg_m3) == pytest.approx((2.0, 1.2))
    assert (fit.law.mass_exponent, fit.law.density_exponent) == (1.5, -0.5)
    assert fit.exponents_from_theory == ("mass_exponent", "density_exponent")
    # They are reported as not shown (I107).
    _, outcome, _ = identify_hover([hover(200.0, mass_kg=2.0, air_density_kg_m3=1.2)])
    assert outcome.not_shown == ("mass_exponent", "density_exponent")


def test_exponents_are_measured_where_the_hovers_tell_them() -> None:
    flights = [
        hover(
            150.0 * (mass / 2.0) ** 1.3 * (density / 1.2) ** -0.4,
            mass_kg=mass,
            air_density_kg_m3=density,
        )
        for mass in (1.8, 2.0, 2.4)
        for density in (1.0, 1.2)
    ]
    fit = fit_density_law(flights)
    assert fit.exponents_from_theory == ()
    assert fit.law.mass_exponent == pytest.approx(1.3)
    assert fit.law.density_exponent == pytest.approx(-0.4)
    names = [estimate.name for estimate in fit.estimates]
    assert names == ["hover_power_w", "mass_exponent", "density_exponent"]


def test_an_exponent_the_hovers_hardly_tell_is_that_of_theory() -> None:
    flights = [
        hover(150.0 + error, error_w=3.0, mass_kg=2.0, air_density_kg_m3=density)
        for density, error in ((1.20, 2.0), (1.18, -2.0), (1.19, 1.0))
    ]
    assert fit_density_law(flights).law.density_exponent == -0.5


def test_a_vehicle_whose_power_hardly_knows_the_density_gets_that_of_theory() -> None:
    # Recorded of ArduPilot's simulated quad: +0.065 over 0.8 % of density, 0.05 % of the power.
    flights = [
        hover(354.6 * density**0.065, error_w=0.04, mass_kg=3.0, air_density_kg_m3=density)
        for density in (1.150, 1.153, 1.156, 1.159)
    ]
    fit = fit_density_law(flights)
    assert fit.law.density_exponent == -0.5
    assert fit.exponents_from_theory == ("mass_exponent", "density_exponent")
    # Over 20 % of density the same exponent is 1.2 % of the power.
    wide = [
        hover(354.6 * density**0.065, error_w=0.04, mass_kg=3.0, air_density_kg_m3=density)
        for density in (0.96, 1.04, 1.10, 1.16)
    ]
    with pytest.raises(IdentificationError, match="no usable law"):
        fit_density_law(wide)


def test_a_density_law_needs_mass_and_density_and_sense() -> None:
    with pytest.raises(IdentificationError, match="mass_kg"):
        fit_density_law([hover(100.0, air_density_kg_m3=1.2)])
    with pytest.raises(IdentificationError, match="no hover"):
        fit_density_law([])
    upside_down = [
        hover(100.0 * density**2.0, mass_kg=2.0, air_density_kg_m3=density)
        for density in (0.9, 1.0, 1.1, 1.2)
    ]
    with pytest.raises(IdentificationError, match="no usable law"):
        fit_density_law(upside_down)


def cruise(speed_m_s: float, power_w: float, error_w: float = 1.0) -> MeasuredPower:
    return MeasuredPower(
        power_w=power_w,
        error_w=error_w,
        duration_s=30.0,
        height_above_home_m=50.0,
        airspeed_m_s=speed_m_s,
        air_density_kg_m3=1.18,
        mass_kg=2.5,
    )


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
