from __future__ import annotations

import struct

import pytest
from simulated_vehicles import Bench, named

from planner.autopilot import Autopilot
from planner.simulator.setup import INT16, INT32, REAL32

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])


def _value(bench: Bench, name: str) -> tuple[float, int]:
    answers = bench.send("PARAM_REQUEST_READ", param_index=-1, param_id=name)
    assert [one["param_id"] for one in answers] == [name]
    return answers[0]["param_value"], answers[0]["param_type"]


@BOTH
def test_the_list_holds_every_parameter_once_in_order(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    sent = named("PARAM_VALUE", bench.send("PARAM_REQUEST_LIST"))
    sent += bench.wait_for("PARAM_VALUE")
    known = [one for one in sent if one["param_id"] != "_HASH_CHECK"]
    assert [one["param_index"] for one in known] == list(range(len(known)))
    assert {one["param_count"] for one in known} == {len(known)}
    assert len({one["param_id"] for one in known}) == len(known)
    assert len(sent) - len(known) == (autopilot is PX4)  # PX4's check sum comes with its list


@BOTH
def test_a_parameter_is_found_by_its_number_and_by_its_name(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    (by_index,) = bench.send("PARAM_REQUEST_READ", param_index=3, param_id="")
    assert _value(bench, by_index["param_id"])[0] == by_index["param_value"]


@BOTH
def test_nothing_is_said_of_a_parameter_that_it_does_not_have(autopilot: Autopilot) -> None:
    bench = Bench(autopilot)
    assert bench.send("PARAM_REQUEST_READ", param_index=-1, param_id="NO_SUCH") == []
    assert bench.send("PARAM_REQUEST_READ", param_index=9999, param_id="") == []


def test_px4_sends_whole_numbers_byte_for_byte() -> None:
    value, kind = _value(Bench(PX4), "SYS_AUTOSTART")
    assert kind == INT32
    assert struct.pack("<f", value) == struct.pack("<i", 4001)


def test_ardupilot_sends_whole_numbers_as_they_are() -> None:
    assert _value(Bench(ARDUPILOT), "SYSID_THISMAV") == (1.0, INT16)


def test_the_names_are_those_of_the_version() -> None:
    # Copter 4.6 counts WPNAV_SPEED in cm/s; its default is 10 m/s.
    assert _value(Bench(ARDUPILOT), "WPNAV_SPEED") == (1000.0, REAL32)


@pytest.mark.parametrize(
    ("autopilot", "name"), [(PX4, "BAT1_CAPACITY"), (ARDUPILOT, "BATT_CAPACITY")]
)
def test_it_knows_the_capacity_of_its_battery(autopilot: Autopilot, name: str) -> None:
    assert _value(Bench(autopilot), name)[0] == 8000.0  # mAh of 8 Ah


@pytest.mark.parametrize(("autopilot", "name"), [(PX4, "MPC_XY_CRUISE"), (ARDUPILOT, "RTL_ALT")])
def test_setting_a_parameter_changes_nothing_and_is_noted(autopilot: Autopilot, name: str) -> None:
    bench = Bench(autopilot)
    before = _value(bench, name)
    (answer,) = bench.send("PARAM_SET", param_id=name, param_value=3.25, param_type=REAL32)
    assert answer["param_value"] == before[0]
    assert _value(bench, name) == before
    assert [act.name for act in bench.vehicle.acts] == ["PARAM_SET"]
