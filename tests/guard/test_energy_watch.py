"""The energy of a vehicle in flight: what is measured, held against what the model says."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
import pytest
from made_missions import HOME, mission, north, rtl, takeoff, waypoint

from planner.guard.energy import (
    BatteryMeter,
    Concern,
    EnergyState,
    EnergyWarning,
    EnergyWatch,
    Prediction,
)
from planner.link.telemetry import BatteryState, VehiclePosition
from planner.service.preflight import CheckResult, check
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

OUT_AND_BACK = mission(takeoff(50.0), waypoint(1000.0, 50.0), waypoint(2000.0, 50.0), rtl())
RESERVE_WH = 10.0


@cache
def checked() -> CheckResult:
    return check(
        OUT_AND_BACK, load_vehicle("arducopter-sitl-quad"), battery=Battery(capacity_wh=200)
    )


def meter(
    battery: Battery, start: BatteryState, *, charge: float = 1.0, usable_wh: float = 140.0
) -> BatteryMeter:
    assessment = checked().assessment
    assert assessment is not None
    prediction = Prediction(
        returns=assessment.returns,
        battery=battery,
        charge=charge,
        usable_wh=usable_wh,
        reserve_wh=RESERVE_WH,
        temperature_c=15.0,
    )
    return BatteryMeter(prediction, start)


def test_the_measurement_that_leaves_least_is_trusted_and_named() -> None:
    battery = Battery(capacity_ah=10.0, nominal_voltage_v=10.0)
    start = BatteryState(consumed_wh=5.0, consumed_ah=0.5)
    one = meter(battery, start, charge=0.9, usable_wh=90.0)
    left = one.energy_left(BatteryState(consumed_wh=25.0, consumed_ah=3.5, remaining_fraction=0.7))
    assert left is not None
    # 90 − (25 − 5) = 70; 0.9 − 3/10 = 0.6 of 100; 0.7 of 100
    assert dict(left.by_source) == pytest.approx(
        {"energy count": 70.0, "charge count": 60.0, "the vehicle's percentage": 70.0}
    )
    assert left.source == "charge count"
    assert left.energy_wh == pytest.approx(60.0)


def test_the_last_charge_of_a_battery_holds_less_energy_than_the_first() -> None:
    battery = Battery(capacity_ah=10.0, ocv_soc=(0.0, 1.0), ocv_v=(12.0, 16.0))
    one = meter(battery, BatteryState())
    left = one.energy_left(BatteryState(remaining_fraction=0.5))
    assert left is not None
    # from half down to empty the mean voltage is 13 V: 10 Ah · 0.5 · 13 V
    assert left.energy_wh == pytest.approx(65.0)


@pytest.mark.parametrize(
    ("began", "now", "left_wh"),
    [
        (1.0, 0.9, 40.0),  # counted from a full battery that was half used: 0.5 less the 0.1 since
        (0.51, 0.41, 40.0),
        (0.5, 0.4, 40.0),  # as it was checked
        (0.4, 0.3, 30.0),  # lower than it was checked: the vehicle's own counts
        (None, 0.4, 40.0),
    ],
)
def test_a_percentage_that_began_above_the_charge_counts_only_what_was_used(
    began: float | None, now: float, left_wh: float
) -> None:
    battery = Battery(capacity_ah=10.0, nominal_voltage_v=10.0)
    one = meter(battery, BatteryState(remaining_fraction=began), charge=0.5, usable_wh=50.0)
    left = one.energy_left(BatteryState(remaining_fraction=now))
    assert left is not None
    assert left.energy_wh == pytest.approx(left_wh)


def test_a_percentage_tells_no_more_than_a_whole_one() -> None:
    battery = Battery(capacity_ah=10.0, ocv_soc=(0.0, 1.0), ocv_v=(12.0, 16.0))
    one = meter(battery, BatteryState(), usable_wh=120.0)
    left = one.energy_left(BatteryState(remaining_fraction=0.5))
    assert left is not None
    assert left.step_wh == pytest.approx(10.0 * 0.01 * 15.98)  # the mean voltage of the first one


def test_measurements_that_contradict_each_other_are_told_once() -> None:
    assessment = checked().assessment
    assert assessment is not None
    prediction = Prediction(
        returns=assessment.returns,
        battery=Battery(capacity_wh=200.0),
        charge=1.0,
        usable_wh=200.0,
        reserve_wh=RESERVE_WH,
        temperature_c=15.0,
    )
    watch = EnergyWatch(prediction, start=BatteryState(consumed_wh=0.0))
    place = VehiclePosition(
        altitude_amsl_m=0.0,
        latitude_deg=north(500.0),
        longitude_deg=HOME.longitude_deg,
        height_above_home_m=50.0,
    )
    reading = BatteryState(consumed_wh=20.0, remaining_fraction=0.7)  # 180 and 140 Wh left
    _, warnings = watch.take(2, place, reading, 60.0)
    assert Concern.MEASURES_DIFFER in {one.concern for one in warnings}
    assert "180 Wh by energy count, 140 Wh by the vehicle's percentage" in warnings[-1].text
    assert len(warnings[-1].headline) <= 50
    state, warnings = watch.take(2, place, reading, 61.0)
    assert not warnings
    assert state is not None
    assert Concern.MEASURES_DIFFER in {one.concern for one in state.warnings}  # though not new


def test_voltage_is_asked_only_where_nothing_counts() -> None:
    battery = Battery(
        capacity_ah=10.0, ocv_soc=(0.0, 1.0), ocv_v=(12.0, 16.0), internal_resistance_ohm=0.1
    )
    one = meter(battery, BatteryState())
    left = one.energy_left(BatteryState(voltage_v=13.0, current_a=10.0))
    assert left is not None
    assert left.source == "voltage"
    assert left.energy_wh == pytest.approx(65.0)  # 13 V + 0.1 Ω · 10 A = 14 V: half full
    assert one.energy_left(BatteryState()) is None


@dataclass
class Flown:
    time_s: float
    energy_left_wh: float
    state: EnergyState
    warnings: tuple[EnergyWarning, ...]


@cache
def fly(capacity_wh: float, *, factor: float) -> list[Flown]:
    """Fly as predicted, taking a multiple of the energy predicted."""
    assessment = checked().assessment
    assert assessment is not None
    home = assessment.returns
    prediction = Prediction(
        returns=home,
        battery=Battery(capacity_wh=capacity_wh),
        charge=1.0,
        usable_wh=capacity_wh,
        reserve_wh=RESERVE_WH,
        temperature_c=15.0,
    )
    watch = EnergyWatch(prediction, start=BatteryState(consumed_wh=0.0), warn_before_s=60.0)
    flown = []
    end_s = home.start_s + home.flight.motion.segments.duration_s
    for time_s in np.arange(5.0, home.flight.time_s - 1.0, 5.0).tolist():
        segment = int(np.searchsorted(home.start_s, time_s, side="right")) - 1
        share = (time_s - home.start_s[segment]) / (end_s[segment] - home.start_s[segment])
        points = home.points(np.array([segment]), np.array([share]))
        item = home.route.stages[int(points.stage[0])].item
        place = VehiclePosition(
            altitude_amsl_m=0.0,
            latitude_deg=north(float(points.place_m[0, 1])),
            longitude_deg=HOME.longitude_deg,
            height_above_home_m=float(points.place_m[0, 2]),
        )
        used_wh = factor * float(points.used_wh[0])
        state, warnings = watch.take(item, place, BatteryState(consumed_wh=used_wh), time_s)
        assert state is not None
        flown.append(Flown(time_s, capacity_wh - used_wh, state, warnings))
    return flown


def total_wh() -> float:
    return checked().totals.energy_wh


def test_a_flight_as_predicted_keeps_its_margin_and_warns_of_nothing() -> None:
    flown = fly(200.0, factor=1.0)
    margins = [one.state.finish_margin_wh for one in flown]
    # what is left less the reserve less the whole flight, all along; a step of 2 m or so is 0.1 Wh
    assert margins == pytest.approx([200.0 - RESERVE_WH - total_wh()] * len(margins), abs=0.5)
    assert [one.state.ratio for one in flown][-1] == pytest.approx(1.0, abs=0.01)
    assert not any(one.warnings for one in flown)


def test_a_flight_that_takes_less_is_not_held_to_go_on_so() -> None:
    flown = fly(200.0, factor=0.7)
    late = flown[len(flown) // 2].state
    assert late.ratio == pytest.approx(0.7, abs=0.02)
    assert late.finish_wh == pytest.approx(late.progress.finish_wh)


def test_a_flight_that_takes_more_is_held_to_go_on_so() -> None:
    flown = fly(200.0, factor=1.5)
    late = flown[len(flown) // 2].state
    assert late.ratio == pytest.approx(1.5, abs=0.03)
    assert late.finish_wh == pytest.approx(1.5 * late.progress.finish_wh, rel=0.03)


@pytest.mark.parametrize("factor", [1.0, 1.3])
def test_the_warning_comes_while_the_way_home_still_leaves_the_reserve(factor: float) -> None:
    capacity_wh = 0.75 * factor * total_wh() + RESERVE_WH
    flown = fly(capacity_wh, factor=factor)
    said = [(one, warning) for one in flown for warning in one.warnings]
    first = {warning.concern: one for one, warning in reversed(said)}
    soon, late = first[Concern.RETURN_SOON], first[Concern.NO_RETURN]
    assert soon.time_s < late.time_s
    # it turns back at once, and the way home takes as much more as the flight so far
    home_wh = factor * soon.state.progress.return_wh
    assert soon.energy_left_wh - home_wh >= RESERVE_WH
    lead_s = soon.state.lead_s
    assert lead_s is not None
    assert 40.0 <= lead_s <= 60.0  # warned within two looks of the minute asked for
    # and the lead is true: after it, the way home no longer leaves the reserve
    assert late.time_s - soon.time_s == pytest.approx(lead_s, abs=15.0)


def test_a_warning_is_said_once() -> None:
    flown = fly(0.6 * total_wh() + RESERVE_WH, factor=1.0)
    concerns = [warning.concern for one in flown for warning in one.warnings]
    assert len(concerns) == len(set(concerns))
    assert Concern.NO_FINISH in concerns


def test_headlines_fit_into_one_message() -> None:
    flown = fly(0.6 * total_wh() + RESERVE_WH, factor=1.0)
    for one in flown:
        for warning in one.warnings:
            assert len(warning.headline.encode()) <= 50
