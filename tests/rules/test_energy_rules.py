"""The battery, the reserve and the return."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import pytest
from made_missions import HOME, item, mission, north, rtl, speed, takeoff, waypoint
from made_terrain import ground, slope
from rule_cases.energy import followed_wh, over_ground

from planner.errors import UsageError
from planner.findings import Severity
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.model import ModelSpread

if TYPE_CHECKING:
    from planner.service.preflight import CheckResult

VEHICLE = load_vehicle("falkowski-2023-quadrotor")
OUT_AND_BACK = mission(takeoff(100), waypoint(1000, 100), rtl())


def checked(capacity_wh: float | None, *, charge: float = 1.0, reserve: float = 0.2) -> CheckResult:
    battery = None if capacity_wh is None else Battery(capacity_wh=capacity_wh)
    return check(OUT_AND_BACK, VEHICLE, battery=battery, charge=charge, reserve=reserve)


PLENTY_WH = 1000.0
PLENTY = Battery(capacity_wh=PLENTY_WH)
LAND = item(21, HOME.latitude_deg, 0.0)
NEED_WH = checked(1000.0).totals.energy_wh


def errors(result: CheckResult) -> list[str]:
    return [f.code for f in result.findings if f.severity is Severity.ERROR]


def test_an_unknown_battery_is_a_no_go() -> None:
    result = checked(None)
    assert errors(result) == ["E100"]
    assert result.verdict == "no-go"
    assert result.battery is None


def test_enough_above_the_reserve_is_a_go() -> None:
    # 20 % reserve: the need is 80 % of this capacity; a thousandth more is enough.
    result = checked(NEED_WH / 0.8 * 1.001)
    assert errors(result) == []
    assert result.verdict == "go"
    assert result.battery is not None
    assert 0.0 < result.battery.margin_wh < 0.01 * NEED_WH


def test_a_little_too_little_is_a_no_go_and_names_the_item_that_touches_the_reserve() -> None:
    result = checked(NEED_WH / 0.8 * 0.999)
    assert "E101" in errors(result)
    assert result.verdict == "no-go"
    [finding] = [f for f in result.findings if f.code == "E101"]
    assert finding.item == 3


def test_exactly_the_reserve_left_is_a_go() -> None:
    result = checked(2.0 * NEED_WH, reserve=0.5)
    assert result.battery is not None
    assert result.battery.margin_wh == 0.0
    assert result.verdict == "go"


def test_exactly_nothing_left_is_a_no_go() -> None:
    result = checked(NEED_WH, reserve=0.0)
    assert result.battery is not None
    assert result.battery.margin_wh == 0.0
    assert errors(result) == ["E124"]
    assert "50 % chance that the battery is empty before the landing" in str(result.findings)


def test_charge_and_reserve_are_shares_of_the_capacity() -> None:
    result = checked(100.0, charge=0.7, reserve=0.25)
    assert result.battery is not None
    assert result.battery.usable_wh == pytest.approx(70.0)
    assert result.battery.margin_wh == pytest.approx(45.0 - NEED_WH)
    assert result.battery.used_fraction == pytest.approx(NEED_WH / 100.0)


def test_capacity_changes_only_shares() -> None:
    small, large = checked(100.0), checked(10_000.0)
    assert small.totals == large.totals
    assert small.battery is not None
    assert large.battery is not None
    assert small.battery.used_fraction == pytest.approx(100.0 * large.battery.used_fraction)


def test_the_way_home_is_tightest_where_energy_used_and_way_home_are_most() -> None:
    result = checked(100.0)
    assert result.return_plan is not None
    assert result.return_plan.tightest_item == 2
    # Home from the far end is what is left of the mission: its own return.
    used = next(i.energy_used_wh for i in result.items if i.item == 2)
    assert used is not None
    assert result.return_plan.energy_home_wh == pytest.approx(NEED_WH - used)
    assert result.return_plan.margin_wh == pytest.approx(80.0 - NEED_WH)


def test_a_mission_that_ends_far_away_has_no_way_home_in_its_reserve() -> None:
    one_way = mission(takeoff(100), waypoint(1000, 100))
    need = check(one_way, VEHICLE, battery=Battery(capacity_wh=1e3)).totals.energy_wh
    result = check(one_way, VEHICLE, battery=Battery(capacity_wh=need / 0.8 * 1.01))
    assert "E101" not in errors(result)
    assert "E102" in errors(result)


def test_the_way_to_a_landing_far_away_is_judged_as_that_to_a_place_over_it() -> None:
    there = item(21, north(1000), 0.0)
    over_it = check(mission(takeoff(100), waypoint(1000, 100), there), VEHICLE, battery=PLENTY)
    alone = check(mission(takeoff(100), there), VEHICLE, battery=PLENTY)
    margins_wh = []
    for result in (over_it, alone):
        plan = result.return_plan
        assert plan is not None
        assert plan.margin_wh is not None
        margins_wh.append(plan.margin_wh)
    # one more stop, of 7 s at 130 W, is all that the place adds
    assert margins_wh[1] == pytest.approx(margins_wh[0], abs=0.5)
    # and both keep less than half: the way back is as long
    assert max(margins_wh) < PLENTY_WH - 1.3 * (alone.totals.energy_wh or 0.0)


@pytest.mark.parametrize(("charge", "reserve"), [(1.1, 0.2), (-0.1, 0.2), (1.0, float("nan"))])
def test_shares_beyond_all_are_refused(charge: float, reserve: float) -> None:
    with pytest.raises(UsageError, match=r"must be a (fraction|finite number)"):
        checked(100.0, charge=charge, reserve=reserve)


def test_charge_needs_a_voltage() -> None:
    assert checked(100.0).totals.charge_mah is None
    with_voltage = check(
        OUT_AND_BACK, VEHICLE, battery=Battery(capacity_ah=5.0, nominal_voltage_v=20.0)
    )
    # 1 Wh at 20 V is 50 mAh.
    assert with_voltage.totals.charge_mah == pytest.approx(50.0 * NEED_WH)


def test_the_worst_place_to_return_from_is_told_where_it_lies_within_a_leg() -> None:
    # At 12 m/s the mission comes home on less energy than a return at 10 m/s: the sooner the worse.
    quad = replace(load_vehicle("arducopter-sitl-quad"), battery=None)  # its weight is not asked
    fast = mission(takeoff(40), speed(12.0), waypoint(3000, 40), waypoint(30, 40), LAND)
    plenty = check(fast, quad, battery=Battery(capacity_wh=1000.0), reserve=0.0)
    assert plenty.return_plan is not None
    assert plenty.return_plan.margin_wh is not None
    worst_wh, need_wh = 1000.0 - plenty.return_plan.margin_wh, plenty.totals.energy_wh
    assert worst_wh > need_wh + 1.0
    between = Battery(capacity_wh=0.5 * (worst_wh + need_wh))
    result = check(fast, quad, battery=between, reserve=0.0)
    assert sorted(errors(result)) == ["E102", "E124"]
    [finding] = [f for f in result.findings if f.code == "E102"]
    assert re.search(r"; from \d+ m into the leg to item 4 the return takes", finding.message)
    assert result.return_plan is not None
    turn = result.return_plan.last_return
    assert turn is not None
    assert finding.stretch is not None, "pictures show the point of no return at its place"
    assert finding.stretch.start_deg == finding.stretch.end_deg
    assert finding.stretch.start_deg == (turn.latitude_deg, turn.longitude_deg)


def test_an_item_is_reached_at_its_place_and_not_where_a_take_off_put_before_it_ends() -> None:
    without = check(mission(waypoint(300, 100), rtl()), VEHICLE)
    with_it = check(mission(takeoff(100), waypoint(300, 100), rtl()), VEHICLE)
    assert without.totals == with_it.totals
    first, reached = without.items[0], with_it.items[1]
    assert (first.item, reached.item) == (1, 2)
    assert first.energy_used_wh == pytest.approx(reached.energy_used_wh)
    # 300 m at 10 m/s after the climb
    climbed = with_it.items[0].energy_used_wh
    assert climbed is not None
    assert first.energy_used_wh is not None
    assert first.energy_used_wh > climbed + 30.0 * 119.49 / 3600.0


def test_a_mission_that_flies_nothing_takes_nothing() -> None:
    totals = check(mission(rtl()), VEHICLE).totals
    assert [totals.time_s, totals.distance_m, totals.climb_m, totals.descent_m] == [0.0] * 4
    assert [totals.energy_wh, totals.mean_power_w, totals.peak_power_w] == [0.0] * 3
    assert (totals.charge_mah, totals.wander_m) == (None, 0.0)


def test_only_a_noisy_position_makes_a_vehicle_wander() -> None:
    assert checked(100.0).totals.wander_m == 0.0
    quad = load_vehicle("px4-sih-quad")
    still, noisy = (check(OUT_AND_BACK, quad, position_noise_m=m).totals for m in (0.0, 0.3))
    assert still.wander_m == 0.0
    assert noisy.wander_m > 0.0


NEVER_EXACT = replace(
    VEHICLE, spread=ModelSpread(n_flights=1_000_000, source="made", energy_fraction=0.05)
)


def at_risk(margin_sds: float, *, risk: float = 0.05) -> CheckResult:
    """Return a check whose margin is so many standard deviations of the energy."""
    battery = Battery(capacity_wh=NEED_WH * (1.0 + 0.05 * margin_sds) / 0.8)
    return check(OUT_AND_BACK, NEVER_EXACT, battery=battery, risk=risk)


def codes(result: CheckResult) -> list[str]:
    return [f.code for f in result.findings]


def test_a_margin_that_one_flight_of_ten_does_not_keep_is_a_warning_but_a_go() -> None:
    result = at_risk(1.2816)  # 10 % of a normal distribution
    [finding] = [f for f in result.findings if f.code == "E119"]
    assert re.match(r"(9\.\d|10|11) % chance of landing below the 20 % reserve", finding.message)
    assert finding.severity is Severity.WARNING
    assert result.verdict == "go"


def test_a_margin_of_three_standard_deviations_is_told_by_no_finding() -> None:
    assert "E119" not in codes(at_risk(3.0))


def test_the_chance_to_be_told_of_is_the_callers_and_its_bound_belongs_to_it() -> None:
    assert "E119" not in codes(at_risk(1.2816, risk=0.2))
    assert "E119" in codes(at_risk(3.0, risk=0.0))
    assert "E119" not in codes(at_risk(1.2816, risk=1.0))
    result = at_risk(1.2816)
    assert result.battery is not None
    chance = result.battery.below_reserve_probability
    assert chance is not None
    assert "E119" not in codes(at_risk(1.2816, risk=chance))
    assert "E119" in codes(at_risk(1.2816, risk=chance - 1e-9))


def test_what_falls_short_already_is_not_said_twice() -> None:
    result = at_risk(-0.5)
    assert "E101" in codes(result)
    assert "E119" not in codes(result)


def test_a_way_home_at_risk_names_its_item() -> None:
    one_way = mission(takeoff(100), waypoint(1000, 100))
    calm = check(one_way, NEVER_EXACT, battery=Battery(capacity_wh=1e3))
    assert calm.return_plan is not None
    assert calm.return_plan.margin_wh is not None
    need_wh = 800.0 - calm.return_plan.margin_wh
    result = check(one_way, NEVER_EXACT, battery=Battery(capacity_wh=need_wh * 1.05 / 0.8))
    [finding] = [f for f in result.findings if f.code == "E119"]
    assert finding.item == 2
    assert "return from some point" in finding.message


@pytest.mark.parametrize("risk", [-0.1, 1.1, float("nan")])
def test_a_chance_beyond_all_is_refused(risk: float) -> None:
    with pytest.raises(UsageError, match=r"risk must be a (fraction|finite number)"):
        at_risk(1.0, risk=risk)


@pytest.mark.parametrize(
    "given",
    [{"payload_kg": -1.0}, {"temperature_c": 100.0}, {"home_amsl_m": 1e6}],
    ids=["payload", "temperature", "home"],
)
def test_a_condition_out_of_its_range_is_wrong_usage(given: dict[str, float]) -> None:
    with pytest.raises(UsageError, match=next(iter(given))):
        check(OUT_AND_BACK, VEHICLE, **given)  # type: ignore[arg-type] # one keyword at a time


@pytest.mark.parametrize(("covered", "fires"), [(0.98, True), (1.02, False)])
def test_a_return_from_over_a_valley_keeps_its_height_above_it(
    covered: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # 5° down to the north: 78.7 m below home after 900 m, over which it climbs them; over home it is 78.7 m
    # higher than predicted and descends at 1.5 m/s.
    rise_m = 900.0 * math.tan(math.radians(5.0))
    told = over_ground(slope(5.0), covered * followed_wh(rise_m, rise_m / 1.5))
    assert ("E129" in {one.code for one in told}) is fires


def test_ground_that_is_not_known_under_a_return_is_reported() -> None:
    told = over_ground(ground(0.0, at_m=-900.0, rows=120), 100.0)  # it ends 200 m north of home
    assert any(one.code == "X904" and "E129" in one.message for one in told)


@pytest.mark.parametrize(
    ("degrees_c", "left", "severity"),
    [
        # 80 % at 0 °C and 75 % at -10 °C: between them 0.5 % a degree.
        (-1.0, 0.204, Severity.ERROR),
        (-1.0, 0.206, Severity.WARNING),
        (-9.0, 0.244, Severity.ERROR),
        (-9.0, 0.246, Severity.WARNING),
        (-11.0, 0.9, Severity.ERROR),
    ],
)
def test_a_battery_that_may_be_empty_in_the_cold_is_no_go(
    degrees_c: float, left: float, severity: Severity
) -> None:
    def judged(capacity_wh: float) -> CheckResult:
        pack = Battery(capacity_wh=capacity_wh)
        return check(
            OUT_AND_BACK, VEHICLE, battery=pack, battery_temperature_c=degrees_c, reserve=0.0
        )

    # What its model does not count of the air at 500 m AMSL, 1.1673 kg/m³ for 1.225 (ISO 2533).
    need_wh = judged(1000.0).totals.energy_wh * math.sqrt(1.225 / 1.1673)
    cold = [f for f in judged(need_wh / (1.0 - left)).findings if f.code == "E122"]
    assert [one.severity for one in cold] == [severity]


@pytest.mark.parametrize(("share", "below"), [(0.99, True), (1.01, False)])
def test_a_battery_that_may_land_below_the_reserve_in_the_cold_is_told_so(
    share: float, *, below: bool
) -> None:
    """At −10 °C a cell gives 75 % at least: of 0.75 C the flight and a reserve of 0.2 C are left or not."""

    def judged(capacity_wh: float) -> CheckResult:
        pack = Battery(capacity_wh=capacity_wh)
        return check(OUT_AND_BACK, VEHICLE, battery=pack, battery_temperature_c=-10.0, reserve=0.2)

    need_wh = judged(1000.0).totals.energy_wh * math.sqrt(1.225 / 1.1673)
    result = judged(share * need_wh / (0.75 - 0.2))
    [cold] = [f for f in result.findings if f.code == "E122"]
    assert cold.severity is Severity.WARNING
    assert ("below the reserve" in cold.message) is below
