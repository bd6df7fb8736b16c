"""What a vehicle on the line measures of its battery is held against the battery of the check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from flown_battery import FLOWN
from guarded_vehicle import HOME, OUT_AND_BACK
from rule_cases.energy import set_to

from planner.findings import Severity
from planner.link.mission import MissionKind
from planner.link.snapshot import VehicleReading, make_snapshot
from planner.link.telemetry import BatteryState, VehicleIdentity, VehicleState
from planner.mission.items import Home
from planner.quantity import mean_of
from planner.rules.battery import BATTERY_VOLTAGE_DIFFERS, CAPACITY_SETTING_DIFFERS
from planner.service.guard import judge_vehicle
from planner.service.preflight import CheckResult
from planner.service.vehicle import (
    CHARGE_BELOW_GIVEN,
    CHARGE_BY_VOLTAGE,
    CHARGE_NOT_TOLD,
    check_vehicle,
    go_objection,
)
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.link.snapshot import VehicleSnapshot

SIX_CELLS = Battery(
    capacity_ah=8.0,
    cells_in_series=6,
    internal_resistance_ohm=0.02,
    ocv_soc=(0.0, 1.0),
    ocv_v=(19.8, 25.2),
)
"""From 3.3 to 4.2 V a cell; 22.5 V at half of its charge."""
HOME_HERE = Home(latitude_deg=HOME[0] / 1e7, longitude_deg=HOME[1] / 1e7, altitude_amsl_m=200.0)


def snapshot_of(battery: BatteryState | None) -> VehicleSnapshot:
    lists = {MissionKind.MISSION: OUT_AND_BACK, MissionKind.FENCE: (), MissionKind.RALLY: ()}
    state = VehicleState(home=HOME_HERE, battery=battery, is_armed=False)
    return make_snapshot(
        VehicleIdentity(system=1, component=1, autopilot_number=12, vehicle_type=2),
        VehicleReading(state=state, lists=lists, parameters=()),
        address="virtual",
    )


def found(battery: BatteryState | None, pack: Battery | None = SIX_CELLS) -> list[str]:
    """Return what E121 says of a vehicle on the line."""
    result = check_vehicle(snapshot_of(battery), Setup(load_vehicle(), battery=pack))
    assert isinstance(result, CheckResult)
    code = BATTERY_VOLTAGE_DIFFERS.code
    messages = [one.message for one in result.findings if one.code == code]
    assert bool(messages) <= (result.verdict == "no-go")
    return messages


@pytest.mark.parametrize(
    ("measured_v", "charge", "fires"),
    [
        (12.6, 1.0, True),  # three cells, full
        (21.0, 1.0, True),  # five, full: 0.833
        (29.4, 1.0, True),  # seven, full: 1.167 times, and 4.9 V for each of six
        (25.2, 1.0, False),
        (21.5, 1.0, False),  # 0.853: six cells of a battery that is not as full as reported
        (22.5, 0.5, False),
        (19.0, 0.5, True),  # 0.844 of 22.5 V
        (26.6, 0.5, True),  # 1.182, and 4.43 V a cell
        (26.5, 0.5, True),  # 1.178, and 4.42 V
        (26.1, 1.0, False),  # six of high voltage
        (25.2, None, False),  # not reported: full is assumed
        (12.6, None, True),
        (None, 1.0, False),
    ],
)
def test_a_measured_voltage_is_held_against_that_of_the_battery_at_its_charge(
    measured_v: float | None, charge: float | None, *, fires: bool
) -> None:
    messages = found(BatteryState(voltage_v=measured_v, remaining_fraction=charge))
    assert bool(messages) == fires


def test_the_message_names_both_voltages() -> None:
    (message,) = found(BatteryState(voltage_v=12.6, remaining_fraction=1.0))
    assert "measures 12.6 V" in message
    assert "25.2 V at 100 %" in message


def test_what_a_current_drops_is_counted() -> None:
    """100 A over 0.02 ohm are 2 V: 20.0 V under load are 22.0 V at rest, 0.873 of 25.2 V."""
    assert found(BatteryState(voltage_v=20.0, remaining_fraction=1.0, current_a=0.0))
    assert not found(BatteryState(voltage_v=20.0, remaining_fraction=1.0, current_a=100.0))


def test_a_battery_of_unknown_voltage_cannot_be_compared() -> None:
    assert not found(BatteryState(voltage_v=12.6), Battery(capacity_wh=178.0))
    assert not found(None)


def test_another_battery_on_the_line_is_no_go_for_guard_and_upload() -> None:
    snapshot = snapshot_of(BatteryState(voltage_v=12.6, remaining_fraction=1.0))
    setup = Setup(load_vehicle(), battery=SIX_CELLS)
    judgement, _ = judge_vehicle(snapshot, setup)
    assert (judgement.verdict, judgement.code) == ("no-go", BATTERY_VOLTAGE_DIFFERS.code)
    assert go_objection(check_vehicle(snapshot, setup)) == "the verdict is NO-GO"


FOUR_CELLS = Battery(capacity_ah=5.2, nominal_voltage_v=14.8)
"""By their label: lithium-polymer or, who knows, lithium-ion."""


def charge_of(
    battery: BatteryState, pack: Battery, *, is_armed: bool = False, given: float | None = None
) -> tuple[float, set[str]]:
    """Return the charge that counts, and which of what is said of it is."""
    snapshot = snapshot_of(battery)
    snapshot = replace(snapshot, state=replace(snapshot.state, is_armed=is_armed))
    setup = Setup(load_vehicle(), battery=pack, charge=1.0 if given is None else given)
    result = check_vehicle(snapshot, setup, is_charge_given=given is not None)
    assert isinstance(result, CheckResult)
    codes = {CHARGE_BELOW_GIVEN.code, CHARGE_BY_VOLTAGE.code, CHARGE_NOT_TOLD.code}
    return mean_of(result.setup.charge), codes & {one.code for one in result.findings}


def test_a_half_used_battery_that_is_full_to_the_vehicle_is_half_used() -> None:
    """ArduCopter SITL with 11.299 V said 11.30 V and 100 %, had 50 %, and fell on a go.

    0.5 and (11.3 - 11.129) / (11.789 - 11.129) of the quarter above it: 56.5 %.
    """
    battery = BatteryState(voltage_v=11.3, remaining_fraction=1.0, current_a=0.0)
    charge, codes = charge_of(battery, FLOWN)
    assert charge == pytest.approx(0.565, abs=0.0005)
    assert codes == {CHARGE_BY_VOLTAGE.code}
    assert charge_of(battery, FLOWN, given=1.0) == (1.0, {CHARGE_BELOW_GIVEN.code})
    assert charge_of(battery, FLOWN, given=0.56) == (0.56, set())


@pytest.mark.parametrize(
    ("measured_v", "reported", "counts"),
    [
        (22.5, 1.0, 0.5),  # 19.8 V and half of 5.4 V
        (24.41, 1.0, 0.8537),  # 1 % more is 24.654 V, 89.9 %
        (24.42, 1.0, None),  # 24.664 V, 90.1 %: ten less than told
        (25.2, 1.0, None),
        (26.1, 1.0, None),  # of cells of high voltage
        (21.74, 0.5, 0.3593),  # 21.957 V, 39.96 %
        (21.75, 0.5, None),  # 21.968 V, 40.1 %
        (25.2, 0.5, None),  # the vehicle's own is the lower one
        (24.41, None, 0.8537),  # not told: full is assumed
        (24.42, None, None),
        (None, 1.0, None),
        (19.0, 0.5, None),  # another battery (E121)
    ],
)
def test_a_voltage_that_says_clearly_less_charge_counts(
    measured_v: float | None, reported: float | None, counts: float | None
) -> None:
    battery = BatteryState(voltage_v=measured_v, remaining_fraction=reported)
    charge, codes = charge_of(battery, SIX_CELLS)
    told = {CHARGE_NOT_TOLD.code} if reported is None else set()
    expected = told if counts is None else {CHARGE_BY_VOLTAGE.code}
    assert codes == expected
    own = 1.0 if reported is None else reported
    assert charge == pytest.approx(own if counts is None else counts, abs=0.0001)


@pytest.mark.parametrize(
    ("measured_v", "reported", "counts"),
    [
        (16.2, 1.0, None),  # PX4 takes 4.05 V a cell for full (BAT1_V_CHARGED)
        (16.16, 1.0, None),  # 4.0804 V a cell with 1 %: lipo has 90 % at 4.08 V
        (16.15, 1.0, 0.8575),  # 4.0779 V; 75 % at 3.93 V and 15 % more at 4.08 V: 4.0375 V
        (15.2, 1.0, 0.6023),  # stored at 3.8 V: 50 % at 3.71 V, 75 % at 3.93 V
        (14.49, 0.5, None),  # 3.6587 V: li-ion has 40 % at 3.6575 V, lipo 34 %
        (14.48, 0.5, 0.225),  # 3.6562 V; lipo 10 % at 3.57 V, 25 % at 3.63 V: 3.62 V
    ],
)
def test_cells_that_only_a_label_names_may_be_of_the_kind_that_has_more(
    measured_v: float, reported: float, counts: float | None
) -> None:
    battery = BatteryState(voltage_v=measured_v, remaining_fraction=reported)
    charge, codes = charge_of(battery, FOUR_CELLS)
    assert codes == (set() if counts is None else {CHARGE_BY_VOLTAGE.code})
    assert charge == pytest.approx(reported if counts is None else counts, abs=0.0005)


def test_a_current_on_the_ground_drops_some_of_the_voltage() -> None:
    """1 A over 0.02 ohm: 24.41 V are 24.43 V at rest, 24.40 V are 24.42 V, 24.39 V too few."""
    for measured_v, codes in ((24.41, set()), (24.40, set()), (24.39, {CHARGE_BY_VOLTAGE.code})):
        battery = BatteryState(voltage_v=measured_v, remaining_fraction=1.0, current_a=1.0)
        assert charge_of(battery, SIX_CELLS)[1] == codes


def test_no_charge_is_read_under_motors_or_without_a_curve() -> None:
    battery = BatteryState(voltage_v=22.5, remaining_fraction=1.0)
    assert charge_of(battery, SIX_CELLS, is_armed=True) == (1.0, set())
    assert charge_of(battery, Battery(capacity_wh=178.0)) == (1.0, set())


@pytest.mark.parametrize(("measured_v", "fires"), [(24.41, True), (24.42, False)])
def test_a_given_charge_is_held_against_the_voltage_too(measured_v: float, *, fires: bool) -> None:
    battery = BatteryState(voltage_v=measured_v, remaining_fraction=1.0)
    assert charge_of(battery, SIX_CELLS, given=1.0) == (
        1.0,
        {CHARGE_BELOW_GIVEN.code} if fires else set(),
    )


@pytest.mark.parametrize(
    ("share", "others", "fires"),
    [
        (0.79, "", True),
        (0.81, "", False),
        (1.26, "", True),
        (0.5, "BATT2_MONITOR,4\nBATT2_CAPACITY,4000\n", False),  # two of half the charge
        (0.5, "BATT2_MONITOR,0\nBATT2_CAPACITY,4000\n", True),  # the second measures nothing
        (1.0, "BATT2_MONITOR,4\nBATT2_CAPACITY,3300\n", False),  # of something else
        (0.0, "", False),  # unknown to the vehicle
        (2.0, "BATT_MONITOR,0\n", False),
    ],
)
def test_a_capacity_far_from_the_battery_s_is_reported(
    share: float, others: str, *, fires: bool
) -> None:
    rule = CAPACITY_SETTING_DIFFERS
    reported = [one.severity for one in set_to(share, others) if one.code == rule.code]
    assert reported == [Severity.WARNING] * fires
