"""Cruise power over airspeed as a table with one minimum."""

from __future__ import annotations

import pytest

from planner.errors import IdentificationError
from planner.identify.power_laws import fit_cruise_curve
from planner.identify.segments import MeasuredPower


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
