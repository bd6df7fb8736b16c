"""Two checks side by side."""

from __future__ import annotations

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint

import planner
from planner.physics.wind import Wind
from planner.service.comparison import compare_results
from planner.values import replace
from planner.vehicle.battery import Battery

ARTICLE = planner.load_vehicle("falkowski-2023-quadrotor")
SURVEYOR = planner.load_vehicle("arducopter-sitl-quad")
MADE = mission(takeoff(50.0), waypoint(1500.0, 50.0), rtl())


def test_a_longer_leg_costs_its_length_at_hover_power() -> None:
    # Article: hover at 100 m takes 119.49 * 100 ** 0.02 = 131.02 W, 10 m/s commanded are 9.947 m/s.
    near, far = (
        mission(takeoff(100.0), waypoint(metres, 100.0), item(21, north(metres), 0.0))
        for metres in (500.0, 1500.0)
    )
    comparison = compare_results(planner.check(near, ARTICLE), planner.check(far, ARTICLE))
    assert comparison.time_s == pytest.approx(1000.0 / 9.947, rel=2e-3)
    assert comparison.energy_wh == pytest.approx(131.02 * 1000.0 / 9.947 / 3600.0, rel=2e-3)
    assert comparison.distance_m == pytest.approx(1000.0, rel=2e-3)
    apart = {
        str(state): (b.energy_wh or 0.0) - (a.energy_wh or 0.0) for state, a, b in comparison.states
    }
    assert apart["cruise"] == pytest.approx(comparison.energy_wh, rel=1e-6)
    assert apart["takeoff"] == pytest.approx(0.0, abs=1e-9)


def test_compared_with_itself_nothing_differs() -> None:
    result = planner.check(MADE, SURVEYOR)
    comparison = compare_results(result, result)
    assert comparison.time_s == comparison.distance_m == comparison.energy_wh == 0.0
    assert comparison.margin_wh == comparison.return_margin_wh == 0.0
    assert comparison.gained == comparison.lost == ()


def test_turned_round_every_difference_changes_its_sign() -> None:
    a = planner.check(MADE, SURVEYOR)
    b = planner.check(MADE, SURVEYOR, wind=Wind(speed_m_s=6.0, from_deg=0.0))
    there, back = compare_results(a, b), compare_results(b, a)
    for name in ("time_s", "distance_m", "energy_wh", "margin_wh", "return_margin_wh"):
        assert getattr(there, name) == -getattr(back, name)
    assert (there.gained, there.lost) == (back.lost, back.gained)


def test_states_add_up_to_the_totals() -> None:
    comparison = compare_results(
        planner.check(MADE, SURVEYOR), planner.check(MADE, SURVEYOR, reserve=0.5)
    )
    flown_a = [a for _, a, _ in comparison.states]
    flown_b = [b for _, _, b in comparison.states]
    for shares, result in ((flown_a, comparison.a), (flown_b, comparison.b)):
        assert sum(one.time_s for one in shares) == pytest.approx(result.totals.time_s)
        assert sum(one.energy_wh or 0.0 for one in shares) == pytest.approx(result.totals.energy_wh)


def test_a_smaller_battery_loses_margin_and_gains_findings() -> None:
    bare = replace(SURVEYOR, battery=None)  # its labels are all that is known
    comparison = compare_results(
        planner.check(MADE, bare, battery=Battery(capacity_wh=100.0)),
        planner.check(MADE, bare, battery=Battery(capacity_wh=20.0)),
    )
    assert comparison.margin_wh == pytest.approx(-0.8 * 80.0)
    assert comparison.energy_wh == 0.0
    assert "E101" in {one.code for one in comparison.gained}
    assert comparison.lost == ()


def test_without_a_battery_or_power_differences_are_not_known() -> None:
    timed = planner.load_vehicle("px4-sih-quad")
    comparison = compare_results(planner.check(MADE, SURVEYOR), planner.check(MADE, timed))
    assert comparison.energy_wh is None
    assert comparison.margin_wh is None
    assert comparison.return_margin_wh is None
