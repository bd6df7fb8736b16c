"""What a vehicle on the line measures of its battery is held against the battery of the check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from guarded_vehicle import HOME, OUT_AND_BACK
from rule_cases.energy import set_to

from planner.findings import Severity
from planner.link.mission import MissionKind
from planner.link.snapshot import VehicleReading, make_snapshot
from planner.link.telemetry import BatteryState, VehicleIdentity, VehicleState
from planner.mission.items import Home
from planner.rules.battery import BATTERY_VOLTAGE_DIFFERS, CAPACITY_SETTING_DIFFERS
from planner.service.guard import judge_vehicle
from planner.service.preflight import CheckResult
from planner.service.vehicle import check_vehicle, go_objection
from planner.setup import Setup
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
