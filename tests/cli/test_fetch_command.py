from __future__ import annotations

import json
from typing import TYPE_CHECKING

import pytest
from virtual_vehicle import ARDUPILOT, PX4, VirtualLine, VirtualVehicle, wire_item

import planner
from planner.cli.main import main
from planner.link.mission import MissionKind
from planner.vehicle.parameters.files import read_parameters

if TYPE_CHECKING:
    from pathlib import Path

URL = "udp:127.0.0.1:14550"
HOME = wire_item(frame=0, x=470_000_000, y=80_000_000, z=488.0)
ITEMS = (
    wire_item(command=22, z=30.0),
    wire_item(x=470_010_000, param1=2.5, z=40.0, frame=6),
    wire_item(command=178, frame=2, param1=1.0, param2=7.1, param3=-1.0, x=0, y=0, z=0.0),
    wire_item(x=470_020_000, param4=float("nan"), z=40.2),
    wire_item(command=20, frame=2, x=0, y=0, z=0.0),
)
FENCE = tuple(
    wire_item(command=5001, frame=0, param1=3.0, x=x, y=y, z=0.0)
    for x, y in ((469_900_000, 79_900_000), (470_100_000, 79_900_000), (470_000_000, 80_200_000))
)
RALLY = (wire_item(command=5100, x=470_005_000, z=25.0),)


def _vehicle(autopilot: int = PX4) -> VirtualVehicle:
    mission = (HOME, *ITEMS) if autopilot == ARDUPILOT else ITEMS
    return VirtualVehicle(
        autopilot=autopilot,
        lists={MissionKind.MISSION: mission, MissionKind.FENCE: FENCE, MissionKind.RALLY: RALLY},
        parameters={
            "BAT1_CAPACITY": (5200.0, 9),
            "MPC_XY_CRUISE": (6.1, 9),
            "NAV_RCL_ACT": (-2.0, 6),
        },
    )


@pytest.fixture
def on_line(monkeypatch: pytest.MonkeyPatch) -> list[VirtualLine]:
    """What a test puts here is what an address opens."""
    lines: list[VirtualLine] = []
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines.pop(0))
    return lines


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
@pytest.mark.parametrize("loss", [0.0, 0.2])
def test_what_is_on_the_vehicle_is_in_the_files(
    on_line: list[VirtualLine],
    tmp_path: Path,
    autopilot: int,
    loss: float,
    capsys: pytest.CaptureFixture[str],
) -> None:
    on_line.append(VirtualLine(_vehicle(autopilot), loss=loss))
    assert main(["fetch", URL, "-o", "site.plan"]) == 0
    mission = planner.read_mission("site.plan")
    assert [item.command for item in mission.items] == [22, 16, 178, 16, 20]
    assert [item.altitude_m for item in mission.items] == [30.0, 40.0, 0.0, 40.2, 0.0]
    assert mission.items[1].frame == 3  # 6 says the same, and files have 3
    assert mission.items[1].latitude_deg == 47.001
    assert mission.items[2].param2 == 7.1
    assert mission.items[3].param4 is None
    assert mission.home is not None
    assert mission.home.altitude_amsl_m == 488.0
    assert mission.fence is not None
    assert mission.fence.polygons[0].vertices_deg[2] == (47.0, 8.02)
    assert mission.rally[0].height_above_home_m == 25.0
    parameters = read_parameters(tmp_path / "site.params")
    values = {name: one.value for name, one in parameters.values.items()}
    assert values == {"BAT1_CAPACITY": 5200.0, "MPC_XY_CRUISE": 6.1, "NAV_RCL_ACT": -2.0}
    assert parameters.stack == ("px4" if autopilot == PX4 else "ardupilot")
    assert parameters.version == (1, 16)
    said = capsys.readouterr()
    assert "connecting to udpin:127.0.0.1:14550" in said.err
    assert f"mission: {5 if autopilot == PX4 else 6} of" in said.err
    assert "80 % full, 15.20 V, of 5.2 Ah" in said.out


CHECK = ("--vehicle", "px4-sih-quad", "--battery", "170Wh", "--format", "json")


def _findings_of_pair(
    plan: str, parameters: str, capsys: pytest.CaptureFixture[str]
) -> list[tuple[str, str]]:
    """Return severity and message of X908 in a check of the two."""
    capsys.readouterr()
    main(["check", plan, "--params", parameters, *CHECK])
    (result,) = json.loads(capsys.readouterr().out)["missions"]
    return [
        (one["severity"], one["message"]) for one in result["findings"] if one["code"] == "X908"
    ]


def test_files_of_two_fetches_do_not_pass_for_a_pair(
    on_line: list[VirtualLine], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    times = iter(f"2026-11-2{day}T12:00:00Z" for day in range(2, 6))
    monkeypatch.setattr("planner.service.vehicle._now", lambda: next(times))
    later, other, counted = _vehicle(), _vehicle(), _vehicle()
    later.parameters["MPC_XY_CRUISE"] = (9.0, 9)
    other.parameters, other.uid = later.parameters, 0x123456
    counted.parameters = {**counted.parameters, "STAT_FLTTIME": (77.0, 6)}
    for name, vehicle in (("old", _vehicle()), ("counted", counted), ("new", later)):
        on_line.append(VirtualLine(vehicle))
        assert main(["fetch", URL, "-o", f"{name}.plan"]) == 0
    on_line.append(VirtualLine(other))
    assert main(["fetch", URL, "-o", "other.plan"]) == 0
    for name in ("old", "new", "other"):
        assert _findings_of_pair(f"{name}.plan", f"{name}.params", capsys) == []
    assert _findings_of_pair("counted.plan", "old.params", capsys) == []  # as they were
    ((severity, text),) = _findings_of_pair("new.plan", "old.params", capsys)
    assert severity == "error"
    assert "older than the plan: fetched 2026-11-22T12:00:00Z and 2026-11-24T12:00:00Z" in text
    ((severity, text),) = _findings_of_pair("old.plan", "new.params", capsys)
    assert (severity, text.split(":")[0]) == ("warning", "the plan is older than the parameters")
    ((severity, text),) = _findings_of_pair("old.plan", "other.params", capsys)
    assert severity == "warning"
    assert "those of autopilot 123456; the plan was fetched from autopilot abcdef" in text


def test_files_without_a_mark_or_with_a_broken_one_are_not_compared(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    on_line.append(VirtualLine(_vehicle()))
    assert main(["fetch", URL, "-o", "site.plan"]) == 0
    document = json.loads((tmp_path / "site.plan").read_text(encoding="utf-8"))
    mark = document.pop("fetched")
    lines = (tmp_path / "site.params").read_text(encoding="utf-8").replace(mark[-16:], "0" * 16)
    (tmp_path / "site.params").write_text(lines, encoding="utf-8")
    broken: tuple[object, ...] = (None, "", 7, ["x"], {}, f"{mark}0", f"\u0660{mark[1:]}")
    for found in broken:
        odd = document if found is None else {**document, "fetched": found}
        (tmp_path / "odd.plan").write_text(json.dumps(odd), encoding="utf-8")
        assert _findings_of_pair("odd.plan", "site.params", capsys) == []
    (tmp_path / "odd.plan").write_text(json.dumps({**document, "fetched": mark}), encoding="utf-8")
    assert len(_findings_of_pair("odd.plan", "site.params", capsys)) == 1  # as it would be


def test_the_mark_is_kept_where_a_plan_is_written_again(
    on_line: list[VirtualLine], tmp_path: Path
) -> None:
    on_line.append(VirtualLine(_vehicle()))
    assert main(["fetch", URL, "-o", "site.plan"]) == 0
    assert main(["convert", "site.plan", "again.plan", "--speed", "4"]) == 0
    fetched = planner.read_mission("site.plan").fetched
    assert fetched is not None
    assert planner.read_mission("again.plan").fetched == fetched
    assert read_parameters(tmp_path / "site.params").fetched == fetched


def test_the_same_is_told_as_json(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    on_line.append(VirtualLine(_vehicle()))
    assert main(["fetch", URL, "-o", "site.plan", "--format", "json"]) == 0
    told = json.loads(capsys.readouterr().out)
    assert told["vehicle"]["autopilot"] == "px4"
    assert told["vehicle"]["firmware_version"] == "1.16.2"
    assert told["state"]["battery"]["remaining_fraction"] == 0.8
    assert told["counts"] == {"items": 5, "fence_areas": 1, "rally_points": 1, "parameters": 3}


def test_files_that_are_there_are_kept_unless_forced(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "site.params").write_text("mine", encoding="utf-8")
    assert main(["fetch", URL, "-o", "site.plan"]) == 2
    assert "site.params exists: give --force" in capsys.readouterr().err
    assert not (tmp_path / "site.plan").exists()
    on_line.append(VirtualLine(_vehicle()))
    assert main(["fetch", URL, "-o", "site.plan", "--force"]) == 0
    assert (tmp_path / "site.params").read_text(encoding="utf-8") != "mine"


def test_no_heartbeat_ends_in_exit_3_with_what_to_try(
    on_line: list[VirtualLine], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    line = VirtualLine()
    on_line.append(line)
    assert main(["fetch", URL, "-o", "site.plan", "--heartbeat-timeout", "4"]) == 3
    said = capsys.readouterr().err
    assert "no heartbeat in 4 s on udpin:127.0.0.1:14550" in said
    assert "udpin:0.0.0.0:14540" in said
    assert line.time_s == pytest.approx(4.0, abs=0.2)  # a tick of the virtual clock
    assert line.is_closed
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_line_cut_at_any_message_ends_in_exit_3_and_leaves_no_file(
    on_line: list[VirtualLine], tmp_path: Path, autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    whole = VirtualLine(_vehicle(autopilot))
    on_line.append(whole)
    assert main(["fetch", URL, "-o", "whole.plan"]) == 0
    expected = (tmp_path / "whole.plan").read_text(encoding="utf-8")
    for position in range(whole.exchanged):
        line = VirtualLine(_vehicle(autopilot), cut_after=position)
        on_line.append(line)
        ended = main(["fetch", URL, "-o", "cut.plan", "--retries", "2"])
        said = capsys.readouterr().err
        assert "bug" not in said
        plan = tmp_path / "cut.plan"
        if ended == 0:  # what was lost was not needed: an acknowledgement
            assert plan.read_text(encoding="utf-8") == expected, position
            plan.unlink()
        else:
            assert ended == 3, (position, said)
            assert not plan.exists()
        (tmp_path / "cut.params").unlink(missing_ok=True)
        assert line.time_s < 120.0


def test_two_vehicles_with_one_number_are_noticed(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    on_line.append(VirtualLine(_vehicle(PX4), _vehicle(ARDUPILOT)))
    assert main(["fetch", URL, "-o", "site.plan"]) == 3
    assert "two vehicles answer to system id 1" in capsys.readouterr().err


def test_of_several_vehicles_one_has_to_be_named(
    on_line: list[VirtualLine], capsys: pytest.CaptureFixture[str]
) -> None:
    second = _vehicle(ARDUPILOT)
    second.system = 7
    on_line += [VirtualLine(_vehicle(), second), VirtualLine(_vehicle(), second)]
    assert main(["fetch", URL, "-o", "site.plan"]) == 3
    assert "system ids 1, 7" in capsys.readouterr().err
    assert main(["fetch", URL, "-o", "site.plan", "--system-id", "7"]) == 0
    assert planner.read_mission("site.plan").autopilot == "ardupilot"


def test_an_address_that_is_none_ends_in_exit_2(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["fetch", "http://vehicle", "-o", "site.plan"]) == 2
    assert "'http://vehicle' is not an address of a vehicle" in capsys.readouterr().err


@pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
def test_a_vehicle_that_flies_is_told_as_armed_and_in_the_air(
    on_line: list[VirtualLine], autopilot: int, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle = _vehicle(autopilot)
    vehicle.is_armed, vehicle.landed_state = True, 2
    on_line.append(VirtualLine(vehicle))
    assert main(["fetch", URL, "-o", "out.plan", "--format", "json"]) == 0
    state = json.loads(capsys.readouterr().out)["state"]
    assert (state["is_armed"], state["is_landed"]) == (True, False)
