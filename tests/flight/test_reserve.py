"""The reserve as a share, as energy, and as minutes of hover."""

from __future__ import annotations

import pytest
from made_missions import mission, rtl, takeoff, waypoint

from planner.service.preflight import check
from planner.setup import Reserve, settings
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

SURVEY_QUAD = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
FLOWN = mission(takeoff(50), waypoint(500, 50), rtl())
BATTERY = Battery(capacity_wh=180.0)


def read(text: str) -> object:
    return settings()["reserve"].kind.read(text)


def test_a_reserve_is_read_as_share_energy_or_minutes_of_hover() -> None:
    assert read("20%") == 0.2
    assert read("0.25") == 0.25
    assert read("12Wh") == Reserve(energy_wh=12.0)
    assert read(" 3.5 min") == Reserve(hover_s=210.0)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("20", "ambiguous"),
        ("-1Wh", "zero or more"),
        ("-3min", "zero or more"),
        ("120%", "expected 0% to 100%"),
        ("3 h", "expected 20% of the capacity, 12Wh of energy or 3min of hover"),
    ],
)
def test_what_is_no_reserve_is_refused(text: str, told: str) -> None:
    with pytest.raises(ValueError, match=told):
        read(text)


@pytest.mark.parametrize(
    "given",
    [
        {},
        {"fraction": 0.2, "energy_wh": 1.0},
        {"fraction": 1.01},
        {"hover_s": -1.0},
        {"energy_wh": float("nan")},
    ],
)
def test_a_reserve_is_one_thing_and_not_negative(given: dict[str, float]) -> None:
    with pytest.raises(ValueError, match="reserve"):
        Reserve(**given)


def test_three_minutes_of_hover_are_their_power_times_three_minutes() -> None:
    # 353 W of hover were recorded for this vehicle: 17.65 Wh in 3 min; the model is within 3 %.
    budget = check(FLOWN, SURVEY_QUAD, battery=BATTERY, reserve=Reserve(hover_s=180.0)).battery
    assert budget is not None
    assert budget.reserve_wh == pytest.approx(353.0 * 180.0 / 3600.0, rel=0.03)
    assert budget.reserve_fraction == pytest.approx(budget.reserve_wh / 180.0)
    # What is left at landing hovers as long as it is more energy than the reserve.
    assert budget.hover_left_s is not None
    left_wh = budget.margin_wh + budget.reserve_wh
    assert budget.hover_left_s == pytest.approx(180.0 * left_wh / budget.reserve_wh)


def test_the_hover_of_a_reserve_is_one_at_ten_metres() -> None:
    # Equation 5 of the article: P(H) = 119.49 H^0.02 W.
    article = load_vehicle("falkowski-2023-quadrotor")
    battery = Battery(capacity_wh=180.0)
    budget = check(FLOWN, article, battery=battery, reserve=Reserve(hover_s=3600.0)).battery
    assert budget is not None
    assert budget.reserve_wh == pytest.approx(119.49 * 10.0**0.02, rel=1e-9)


def test_the_same_reserve_said_in_two_ways_leaves_the_same_margin() -> None:
    share = check(FLOWN, SURVEY_QUAD, battery=BATTERY, reserve=0.2).battery
    energy = check(FLOWN, SURVEY_QUAD, battery=BATTERY, reserve=Reserve(energy_wh=36.0)).battery
    assert share is not None
    assert energy is not None
    assert energy.margin_wh == pytest.approx(share.margin_wh)
    assert energy.reserve_fraction == pytest.approx(0.2)
    assert (str(share.reserve), str(energy.reserve)) == ("20 %", "36.0 Wh")


def test_a_reserve_of_energy_decides_at_its_boundary() -> None:
    need_wh = check(FLOWN, SURVEY_QUAD, battery=BATTERY).totals.energy_wh
    for slack_wh, codes in ((1e-6, set()), (-1e-6, {"E101"})):
        reserve = Reserve(energy_wh=180.0 - need_wh - slack_wh)
        result = check(FLOWN, SURVEY_QUAD, battery=BATTERY, reserve=reserve)
        assert {f.code for f in result.findings} & {"E101"} == codes


def test_a_hover_in_low_pressure_takes_the_power_of_thin_air() -> None:
    """Momentum theory: the power of a hover goes with 1 over the square root of the density."""
    reserve = Reserve(hover_s=180.0)
    held = [
        check(FLOWN, SURVEY_QUAD, battery=BATTERY, reserve=reserve, pressure_hpa=pressure_hpa)
        for pressure_hpa in (None, 990.0)
    ]
    standard, low = (one.battery.reserve_wh for one in held if one.battery is not None)
    assert low / standard == pytest.approx((1013.25 / 990.0) ** 0.5, rel=1e-6)
    assert held[1].totals.energy_wh > held[0].totals.energy_wh
