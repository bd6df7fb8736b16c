"""The battery along a flight, against its energy, small steps of time and what must hold."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import item, mission, north, rtl, speed, takeoff, waypoint
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.flight.budget import ChargedPack, Discharge, predict_discharges
from planner.flight.pilot import make_pilot
from planner.flight.prediction import Flight, predict_flight
from planner.mission.route.route import make_route
from planner.physics.wind import Wind
from planner.service.preflight import CheckResult, check
from planner.setup import Setup
from planner.values import field_names, replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.findings import Finding

SURVEY = replace(load_vehicle("arducopter-sitl-quad"), battery=None)  # PACK is described whole
DELIVERY = mission(
    takeoff(60.0),
    waypoint(900.0, 60.0, hold_s=20.0),
    waypoint(900.0, 10.0),
    waypoint(900.0, 90.0),
    rtl(),
    autopilot=Autopilot.ARDUPILOT,
)
PACK = Battery(
    capacity_ah=5.0,
    cells_in_series=6,
    internal_resistance_ohm=0.04,
    ocv_soc=(0.0, 0.1, 0.25, 0.5, 0.75, 0.9, 1.0),
    ocv_v=(21.0, 21.42, 21.78, 22.26, 23.58, 24.48, 25.14),
    cutoff_voltage_v=20.4,
)


def flown() -> Flight:
    setup = Setup(SURVEY)
    route = make_route(DELIVERY, dialect=Autopilot.ARDUPILOT, home_amsl_m=400.0)
    pilot = make_pilot(setup, ArduPilotParameters())
    return predict_flight(route, setup, pilot)


FLIGHT = flown()


def charged(battery: Battery, charge: float = 1.0) -> ChargedPack:
    return ChargedPack(battery=battery, charge=charge, temperature_c=15.0)


def discharged(battery: Battery = PACK, *, charge: float = 1.0) -> Discharge:
    [discharge] = predict_discharges(FLIGHT, [charged(battery, charge)])
    assert discharge is not None
    return discharge


@cache
def checked(battery: Battery | None = PACK, **asked: float | Wind) -> CheckResult:
    return check(DELIVERY, SURVEY, battery=battery, **asked)  # type: ignore[arg-type]  # by name


def found(result: CheckResult, code: str) -> list[Finding]:
    return [finding for finding in result.findings if finding.code == code]


def test_the_charge_left_is_that_of_small_steps_of_time() -> None:
    assert PACK.ocv_soc is not None
    assert PACK.ocv_v is not None
    step_s = 0.05
    times_s = np.arange(0.5 * step_s, FLIGHT.time_s, step_s)
    soc = 1.0
    for power_w in FLIGHT.power_w(times_s).tolist():
        open_v = float(np.interp(soc, PACK.ocv_soc, PACK.ocv_v))
        current_a = (open_v - np.sqrt(open_v**2 - 0.16 * power_w)) / 0.08
        soc -= current_a * step_s / (5.0 * 3600.0)
    discharge = discharged()
    assert discharge.state_of_charge[-1] == pytest.approx(soc, abs=1e-4)
    assert discharge.charge_ah == pytest.approx(5.0 * (1.0 - soc), rel=2e-4)


def test_the_columns_are_of_one_length_and_the_charge_only_falls() -> None:
    discharge = discharged()
    count = len(FLIGHT.motion.segments.item)
    for column in (discharge.state_of_charge, discharge.voltage_v):
        assert len(column) == count
    assert (np.diff(discharge.state_of_charge) <= 0.0).all()
    assert (discharge.voltage_v >= discharge.lowest_voltage_v - 1e-9).all()


def test_the_lowest_voltage_is_met_near_the_end_of_the_last_climb() -> None:
    # Climbing takes most, and the last climb, item 4, meets the emptiest battery; of little
    # resistance it would be the end of the flight.
    discharge = discharged(replace(PACK, internal_resistance_ohm=0.16))
    assert FLIGHT.motion.segments.item[discharge.lowest_voltage_segment] == 4


def test_what_is_usable_is_less_than_the_curve_holds_and_falls_with_the_charge() -> None:
    full, half = discharged(), discharged(charge=0.5)
    assert full.usable_wh < PACK.energy_wh
    assert half.usable_wh < 0.5 * full.usable_wh  # the lower half has the lower voltage


def test_packs_that_are_worked_out_together_are_each_as_alone() -> None:
    # One that is worn, one of another curve, one of no curve at all, and one too weak for the flight;
    # and more than are discharged in one.
    assert PACK.ocv_v is not None
    packs = [
        charged(PACK),
        charged(replace(PACK, health=0.7, resistance_age_factor=2.0), 0.6),
        charged(replace(PACK, ocv_v=tuple(0.99 * volts for volts in PACK.ocv_v))),
        charged(Battery(capacity_wh=100.0)),
        charged(replace(PACK, internal_resistance_ohm=1.5)),
        *(charged(PACK, 1.0 - 0.02 * number) for number in range(12)),
    ]
    together = predict_discharges(FLIGHT, packs)
    for pack, one in zip(packs, together, strict=True):
        [alone] = predict_discharges(FLIGHT, [pack])
        assert (one is None) == (alone is None) == (pack.battery.ocv_v is None)
        if one is not None and alone is not None:
            for name in set(field_names(Discharge)) - {"packs", "pack"}:
                assert np.array_equal(getattr(one, name), getattr(alone, name)), name
    assert [one is not None and one.can_deliver for one in together[:5]] == [
        True,
        True,
        True,
        False,
        False,
    ]


def test_returns_that_stay_above_a_voltage_for_certain_do_when_worked_out() -> None:
    certain = never_below = 0
    for resistance_ohm in (0.0, 0.02, 0.08, 0.2, 0.5):
        pack = replace(PACK, internal_resistance_ohm=resistance_ohm)
        for charge in (1.0, 0.8, 0.6, 0.5, 0.4):
            assessment = checked(pack, charge=charge).assessment
            assert assessment is not None
            back = assessment.return_discharge
            assert back is not None
            for voltage_v in np.arange(12.0, 25.0, 0.5).tolist():
                stays = bool((back.lowest_voltage_v >= voltage_v).all() and back.can_deliver.all())
                never_below += stays
                if assessment.returns_stay_above(voltage_v):
                    assert stays, (resistance_ohm, charge, voltage_v)
                    certain += 1
    # It says so of most: what it does not say is worked out.
    assert 0.7 * never_below < certain < never_below


@pytest.mark.parametrize(
    "battery",
    [
        Battery(capacity_wh=100.0),
        Battery(capacity_ah=5.2, nominal_voltage_v=14.8),
        replace(PACK, internal_resistance_ohm=None),
    ],
)
def test_of_a_battery_without_a_curve_or_resistance_nothing_is_invented(battery: Battery) -> None:
    assert predict_discharges(FLIGHT, [charged(battery)]) == (None,)
    budget = checked(battery).battery
    assert budget is not None
    assert budget.lowest_voltage_v is None
    assert budget.usable_wh == pytest.approx(battery.energy_wh)


def test_a_result_tells_charge_voltage_and_rate() -> None:
    result = checked()
    assert result.battery is not None
    assert result.totals.charge_mah is not None
    left = result.battery.charge_left_fraction
    assert left is not None
    assert 5000.0 * (1.0 - left) == pytest.approx(result.totals.charge_mah)
    assert result.battery.lowest_voltage_v is not None
    # The mean voltage lies between the lowest under load and the full one.
    mean_v = 1000.0 * result.totals.energy_wh / result.totals.charge_mah
    assert result.battery.lowest_voltage_v < mean_v < 25.14


def test_a_voltage_below_the_cut_off_is_a_no_go_before_the_energy_is_used_up() -> None:
    assert found(checked(), "E104") == []
    resistive = replace(PACK, internal_resistance_ohm=0.16, cutoff_voltage_v=20.9)
    result = checked(resistive, reserve=0.0)
    [low] = found(result, "E104")
    assert low.item == 4
    assert "20.9 V" in low.message
    assert result.verdict == "no-go"
    assert result.battery is not None
    assert result.battery.charge_left_fraction is not None
    assert result.battery.charge_left_fraction > 0.0


@pytest.mark.parametrize(
    ("chemistry", "below_v"),
    [
        ("lipo", 18.0),
        ("li-ion", 15.0),
        (None, 18.0),
    ],  # six cells: 3.0, 2.5 and, assumed, 3.0 V each
)
def test_a_battery_that_states_no_cut_off_has_that_of_its_cells(
    chemistry: str | None, below_v: float
) -> None:
    # Without resistance the voltage under load is the open-circuit one, here next to flat.
    for held_v, fires in ((below_v + 0.1, False), (below_v - 0.1, True)):
        flat = replace(
            PACK,
            internal_resistance_ohm=0.0,
            cutoff_voltage_v=None,
            chemistry=chemistry,
            ocv_soc=(0.0, 1.0),
            ocv_v=(held_v, held_v + 0.01),
        )
        low = found(checked(flat, reserve=0.0), "E104")
        assert bool(low) is fires
        assert all(f"the cut-off is {below_v:.1f} V, as of" in one.message for one in low)


def test_a_battery_that_cannot_give_the_power_is_a_no_go() -> None:
    # 25 V over 4 x 0.4 Ω are at most 391 W; climbing takes 458 W.
    weak = replace(PACK, internal_resistance_ohm=0.4, cutoff_voltage_v=None)
    result = checked(weak)
    [low] = found(result, "E104")
    assert "cannot deliver" in low.message
    assert result.verdict == "no-go"


@pytest.mark.parametrize(("max_c_rate", "fires"), [(3.0, True), (6.0, False)])
def test_more_current_than_the_battery_is_made_for_is_marked(
    max_c_rate: float,
    fires: bool,  # noqa: FBT001 - a table of cases
) -> None:
    # 458 W from 23 V are 20 A: 4 times 5 Ah an hour.
    assert bool(found(checked(replace(PACK, max_c_rate=max_c_rate)), "E110")) is fires


@pytest.mark.parametrize(
    ("max_c_rate", "severity"), [(None, Severity.ERROR), (20.0, Severity.ERROR), (100.0, None)]
)
def test_a_rate_does_not_excuse_what_no_battery_gives(
    max_c_rate: float | None, severity: Severity | None
) -> None:
    # 458 W from 25 V at most are 18 A: 37 times 0.5 Ah an hour, 36 are the most of lithium-polymer.
    small = replace(PACK, capacity_ah=0.5, max_c_rate=max_c_rate)
    rates = [one.severity for one in found(checked(small), "E110")]
    assert rates == ([] if severity is None else [severity])


def test_an_empty_battery_gives_no_current() -> None:
    # 458 W from 24 V are 19 A, 16 times 1.2 Ah an hour; 353 W from the 9 V of an empty pack were 33 times.
    assert PACK.ocv_v is not None
    curve = (10.0, *PACK.ocv_v[1:])
    small = replace(PACK, capacity_ah=1.2, internal_resistance_ohm=0.02, ocv_v=curve)
    result = checked(replace(small, max_c_rate=25.0))
    assert found(result, "E101")
    assert not found(result, "E110")


NEED_WH = checked().totals.energy_wh


@given(
    payload_kg=st.floats(min_value=0.0, max_value=2.0),
    warmer_c=st.floats(min_value=0.0, max_value=25.0),
    higher_m=st.floats(min_value=0.0, max_value=2500.0),
)
@settings(max_examples=examples(10), deadline=None)
def test_load_heat_and_altitude_never_lower_the_need_nor_raise_the_margin(
    payload_kg: float, warmer_c: float, higher_m: float
) -> None:
    kept = checked(temperature_c=12.4)
    assert kept.battery is not None
    for asked in (
        {"temperature_c": 12.4, "payload_kg": payload_kg},
        {"temperature_c": 12.4 + warmer_c},
        {"temperature_c": 12.4, "home_amsl_m": 400.0 + higher_m},
    ):
        harder = checked(PACK, **asked)
        assert harder.battery is not None
        assert harder.totals.energy_wh >= kept.totals.energy_wh - 1e-9
        assert harder.battery.margin_wh <= kept.battery.margin_wh + 1e-9


@given(
    health=st.floats(min_value=0.5, max_value=1.0),
    age=st.floats(min_value=1.0, max_value=2.5),
    charge=st.floats(min_value=0.5, max_value=1.0),
)
@settings(max_examples=examples(20), deadline=None)
def test_wear_and_less_charge_never_lower_the_need_nor_raise_the_margin(
    health: float, age: float, charge: float
) -> None:
    new = checked()
    worn = checked(replace(PACK, health=health, resistance_age_factor=age), charge=charge)
    assert new.battery is not None
    assert worn.battery is not None
    assert worn.totals.energy_wh == pytest.approx(new.totals.energy_wh)
    # The reserve is a share of a capacity that wears with the battery.
    reserve_wh = 0.2 * new.battery.capacity_wh * (1.0 - health)
    assert worn.battery.margin_wh <= new.battery.margin_wh + reserve_wh + 1e-9
    assert worn.battery.usable_wh <= new.battery.usable_wh + 1e-9


def test_twice_the_capacity_leaves_the_need_and_halves_the_share() -> None:
    double = checked(replace(PACK, capacity_ah=10.0))
    assert double.battery is not None
    assert double.totals.energy_wh == pytest.approx(NEED_WH)
    assert double.battery.used_fraction == pytest.approx(0.5 * NEED_WH / PACK.energy_wh)


def test_payload_wind_and_temperature_change_the_answer_of_a_model_that_knows_them() -> None:
    for asked in (
        {"payload_kg": 0.5},
        {"temperature_c": 35.0},
        {"wind": Wind(speed_m_s=8.0, from_deg=0.0)},
    ):
        result = checked(**asked)
        assert abs(result.totals.energy_wh - NEED_WH) > 0.005 * NEED_WH
        assert found(result, "E108") == []


def outside(result: CheckResult) -> list[str]:
    return [finding.message for finding in found(result, "E105")]


def test_inside_the_identified_box_nothing_is_said() -> None:
    assert outside(checked()) == []
    assert outside(checked(wind=Wind(speed_m_s=5.0, from_deg=180.0))) == []


def test_airspeed_mass_and_air_outside_the_identified_box_are_said() -> None:
    [windy] = outside(checked(wind=Wind(speed_m_s=8.0, from_deg=180.0)))
    assert "18.0 m/s" in windy
    [heavy] = outside(checked(payload_kg=0.5))
    assert "4.00 kg" in heavy
    [thin] = outside(checked(home_amsl_m=2500.0))
    assert "0.95 to 0.96 kg/m³" in thin


def test_a_parameter_that_flies_faster_than_identified_costs_margin() -> None:
    fast = replace(SURVEY, parameters=(("WPNAV_SPEED", 1800.0), ("WPNAV_SPEED_UP", 400.0)))
    result = check(DELIVERY, fast, battery=PACK)
    climbing, speeding = found(result, "E105")
    assert "18.0 m/s flown" in speeding.message
    assert "it may take" in speeding.message
    assert "4.0 m/s" in climbing.message


def test_a_commanded_speed_beyond_the_box_is_said_once() -> None:
    hasty = replace(DELIVERY, items=(DELIVERY.items[0], speed(17.0), *DELIVERY.items[1:]))
    assert len(outside(check(hasty, SURVEY, battery=PACK))) == 1


ONE_WAY = mission(
    takeoff(60.0), waypoint(900.0, 60.0), item(21, north(900.0)), autopilot=Autopilot.ARDUPILOT
)


def test_a_return_takes_its_charge_as_in_small_steps_of_time() -> None:
    assert PACK.ocv_soc is not None
    assert PACK.ocv_v is not None
    a = check(ONE_WAY, SURVEY, battery=PACK).assessment
    assert a is not None
    assert a.discharge is not None
    assert a.return_discharge is not None
    sample = a.returns.sample
    assert sample is not None
    point = len(sample.destination) - 1  # over the place of the landing, 900 m away
    segments = sample.flight.motion.segments
    assert sample.points.fraction[point] == 1.0
    begin_s, end_s = segments.end_s[segments.item < point].max(), segments.end_s.max()
    step_s = 0.05
    soc, lowest_v = float(a.discharge.state_of_charge[sample.points.segment[point]]), 99.0
    for power_w in sample.flight.power_w(np.arange(begin_s, end_s, step_s)).tolist():
        open_v = float(np.interp(soc, PACK.ocv_soc, PACK.ocv_v))
        root_v = np.sqrt(open_v**2 - 0.16 * power_w)
        lowest_v = min(lowest_v, 0.5 * (open_v + root_v))
        soc -= (open_v - root_v) / 0.08 * step_s / (5.0 * 3600.0)
    # The peak of a part of the motion is held against the charge at its end: up to 0.1 V less.
    assert lowest_v - 0.1 < a.return_discharge.lowest_voltage_v[point] < lowest_v + 0.005


def test_a_return_below_the_cut_off_is_a_no_go_though_the_flight_stays_above_it() -> None:
    a = check(ONE_WAY, SURVEY, battery=PACK).assessment
    assert a is not None
    assert a.discharge is not None
    assert a.return_discharge is not None
    returning_v = float(a.return_discharge.lowest_voltage_v.min())
    assert returning_v < a.discharge.lowest_voltage_v - 0.05
    between_v = 0.5 * (returning_v + a.discharge.lowest_voltage_v)
    result = check(ONE_WAY, SURVEY, battery=replace(PACK, cutoff_voltage_v=between_v), reserve=0.0)
    [low] = found(result, "E104")
    assert "on the return" in low.message
    assert result.verdict == "no-go"
