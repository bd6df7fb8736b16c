from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import pytest
from virtual_vehicle import PX4, VirtualLine, VirtualVehicle, wire_item

from planner.cli.main import main
from planner.link.mission import MissionKind

if TYPE_CHECKING:
    from pathlib import Path

URL = "udp:127.0.0.1:14550"
_SOMEWHERE = {"x": 500_000_000, "y": 200_000_000}


@pytest.fixture
def vehicle(monkeypatch: pytest.MonkeyPatch) -> VirtualVehicle:
    """A PX4 vehicle with a mission of 556 m there and back, as the file ``mission`` has it."""
    there = (500_000_000, 200_000_000, 200_000)
    one = VirtualVehicle(autopilot=PX4, home=there, place=there)
    one.lists[MissionKind.MISSION] = (
        wire_item(command=22, z=100.0, **_SOMEWHERE, param4=math.nan),
        wire_item(z=100.0, x=500_050_000, y=200_000_000, param4=math.nan),
        wire_item(command=20, frame=2, x=0, y=0, z=0.0),
    )
    one.parameters = {"MPC_XY_CRUISE": (7.0, 9), "MPC_Z_V_AUTO_UP": (3.0, 9)}
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: VirtualLine(one))
    return one


def _check(capsys: pytest.CaptureFixture[str], *options: str) -> tuple[int, dict[str, object]]:
    ended = main(["check", URL, "--format", "json", "--battery", "77Wh", *options])
    document = json.loads(capsys.readouterr().out)
    return ended, document["missions"][0]


def test_a_heading_the_vehicle_does_not_know_is_not_taken(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.heading_cdeg = 65_535  # UINT16_MAX, GLOBAL_POSITION_INT.hdg
    assert _check(capsys)[1]["conditions"]["heading_deg"] is None  # type: ignore[index] # an object


def test_the_mission_on_the_vehicle_is_checked_with_its_own_charge_home_and_parameters(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    assert vehicle.battery_remaining == 80
    ended, result = _check(capsys)
    messages = {f["code"]: f["message"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects
    assert messages["V101"] == (
        "taken from PX4 1.16.2 (system 1): charge 80 %, heading 90°, home 200.0 m AMSL, "
        "2 parameters"
    )
    assert result["file"] == "udpin:127.0.0.1:14550"
    assert result["conditions"]["home_amsl_m"] == 200.0  # type: ignore[index] # an object
    assert result["conditions"]["heading_deg"] == 90.0  # type: ignore[index] # an object
    assert len(result["items"]) == 3  # type: ignore[arg-type] # a list
    assert ended == (0 if result["verdict"] == "go" else 1)


def test_a_vehicle_carried_from_its_home_is_judged_from_where_it_will_arm(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    at_home = _check(capsys)[1]["totals"]
    vehicle.place = (499_950_000, 200_000_000, 230_000)  # 556 m south of it, 30 m higher
    result = _check(capsys)[1]
    messages = {f["code"]: f["message"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects
    # sqrt(556² + 30²) = 556.8
    assert "home 230.0 m AMSL where it stands, 557 m from the home it reports" in messages["V101"]
    assert result["conditions"]["home_amsl_m"] == 230.0  # type: ignore[index] # an object
    # From there to the take-off and on, and back there: two of 556 m more.
    farther_m = result["totals"]["distance_m"] - at_home["distance_m"]  # type: ignore[index] # objects
    assert farther_m == pytest.approx(2 * 556.0, rel=0.01)
    vehicle.is_armed = True
    assert _check(capsys)[1]["conditions"]["home_amsl_m"] == 200.0  # type: ignore[index] # an object


def test_an_empty_battery_on_the_vehicle_is_a_no_go(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.battery_remaining = 3
    ended, result = _check(capsys)
    assert (ended, result["verdict"]) == (1, "no-go")
    assert "E101" in {f["code"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects


def test_a_charge_that_is_given_counts_more_than_the_vehicles(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.battery_remaining = 3
    _, result = _check(capsys, "--charge", "100%")
    messages = {f["code"]: f["message"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects
    assert "E101" not in messages
    assert "charge" not in messages["V101"]


def test_parameters_and_home_of_the_vehicle_count_whatever_is_typed(
    vehicle: VirtualVehicle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.parameters = {"RTL_RETURN_ALT": (60.0, 9), "MPC_Z_V_AUTO_UP": (3.0, 9)}
    own = _check(capsys)[1]
    typed = tmp_path / "typed.params"
    typed.write_text("RTL_RETURN_ALT,30\nMPC_Z_V_AUTO_UP,3\nMPC_XY_CRUISE,9\n", encoding="utf-8")
    result = _check(capsys, "--params", str(typed), "--home-amsl", "100")[1]
    said = [f["message"] for f in result["findings"] if f["code"] == "V110"]  # type: ignore[attr-defined] # a list of objects
    assert said == [
        f"{typed} is not used: PX4 1.16.2 (system 1) holds RTL_RETURN_ALT 60 (30)",
        "--home-amsl 100 m is not used: PX4 1.16.2 (system 1) reports its home at 200 m AMSL",
    ]
    assert [result[key] for key in ("totals", "return", "conditions")] == [
        own[key] for key in ("totals", "return", "conditions")
    ]


def test_a_vehicle_that_does_not_tell_its_charge_is_told(
    vehicle: VirtualVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.battery_remaining = -1
    _, result = _check(capsys)
    assert "V102" in {f["code"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects


def test_a_vehicle_that_does_not_answer_ends_in_exit_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: VirtualLine())
    assert main(["check", URL]) == 3
    assert "no heartbeat in 10 s" in capsys.readouterr().err


@pytest.mark.parametrize(
    "areas",
    [
        [{"command": 5001, "param1": 3.0}, {"command": 5001, "param1": 3.0}],  # one is missing
        [{"command": 5003, "param1": 0.0}],
        [{"command": 5001, "param1": 5.0}] * 4,
    ],
)
def test_a_fence_that_is_not_whole_on_the_vehicle_is_a_no_go(
    vehicle: VirtualVehicle, areas: list[dict[str, float]], capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.lists[MissionKind.FENCE] = tuple(wire_item(**area, **_SOMEWHERE) for area in areas)
    ended, result = _check(capsys)
    assert (ended, result["verdict"]) == (1, "no-go")
    assert "L164" in {f["code"] for f in result["findings"]}  # type: ignore[attr-defined] # a list of objects
