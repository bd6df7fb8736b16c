from __future__ import annotations

import json
from concurrent.futures import Executor, Future
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from guarded_vehicle import GuardedVehicle, guarded
from virtual_vehicle import VirtualLine

from planner.cli.guard import Duration
from planner.cli.main import main

if TYPE_CHECKING:
    from collections.abc import Callable

URL = "udp:127.0.0.1:14550"
VEHICLE = ("--vehicle", "falkowski-2023-quadrotor")
CHECK = (*VEHICLE, "--battery", "77Wh", "--autopilot", "step")


class AtOnce(Executor):
    """Runs what it is given before virtual time goes on."""

    def __init__(self, _: int) -> None:
        """Need no threads."""

    def submit(self, function: Callable[..., Any], /, *given: Any, **named: Any) -> Future[Any]:  # noqa: ANN401 - as the base has it
        future: Future[Any] = Future()
        future.set_result(function(*given, **named))
        return future


@pytest.fixture
def vehicle(monkeypatch: pytest.MonkeyPatch) -> GuardedVehicle:
    """A vehicle that asks at 20 s and falls silent at 30 s."""
    one = guarded()
    one.script = [(20.0, GuardedVehicle.ask), (30.0, fall_silent)]
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: VirtualLine(one))
    monkeypatch.setattr("planner.service.guard.ThreadPoolExecutor", AtOnce)
    return one


def fall_silent(vehicle: GuardedVehicle) -> None:
    vehicle.is_silent = True


def interrupt(_: GuardedVehicle) -> None:
    raise KeyboardInterrupt


def test_a_request_is_answered_and_a_lost_link_ends_in_exit_3(
    vehicle: GuardedVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guard", URL, *CHECK, "--valid-for", "60s", "--lost-after", "10s"]) == 3
    ((_, answer),) = vehicle.answers
    assert (answer["result"], answer["result_param2"]) == (0, 60)
    said = capsys.readouterr()
    assert said.out == ""
    lines = said.err.splitlines()
    assert lines[0] == "mavjoule: connecting to udpin:127.0.0.1:14550"
    assert any("verdict go: " in line and "go: go" not in line for line in lines)
    assert any("arm request accepted for 60 s: go, " in line for line in lines)
    assert "was not heard for 10 s" in lines[-1]
    assert "Traceback" not in said.err


def test_every_decision_is_a_line_of_the_log_behind_what_was_there(vehicle: GuardedVehicle) -> None:
    Path("guard.jsonl").write_text('{"earlier": true}\n', encoding="utf-8")
    assert main(["guard", URL, *CHECK, "--lost-after", "5s", "--log", "guard.jsonl"]) == 3
    lines = [json.loads(line) for line in Path("guard.jsonl").read_text().splitlines()]
    assert lines[0] == {"earlier": True}
    assert [line["kind"] for line in lines[1:]][:3] == ["arming", "verdict", "answer"]
    answer = lines[3]
    assert answer["schema"] == 1
    assert answer["result"] == "accepted"
    assert answer["verdict"] == "go"
    assert answer["vehicle"] == "udpin:127.0.0.1:14550"
    assert answer["time"].endswith("+00:00")
    assert vehicle.results() == [0]


def test_a_log_that_cannot_be_written_is_said_before_anything_else(
    vehicle: GuardedVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guard", URL, *CHECK, "--log", "no/such/folder.jsonl"]) == 2
    assert "cannot be written" in capsys.readouterr().err
    assert not vehicle.received


def test_a_model_that_there_is_none_of_is_said_before_anything_else(
    vehicle: GuardedVehicle, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guard", URL, "--vehicle", "no-such-model"]) == 2
    assert "no-such-model" in capsys.readouterr().err
    assert not vehicle.received


@pytest.mark.parametrize(
    ("given", "missing"),
    [
        ((), "without a vehicle and a battery: give --vehicle and --battery"),
        (("--battery", "77Wh"), "without a vehicle: give --vehicle"),
        (VEHICLE, "without a battery: give --battery"),
    ],
)
def test_it_does_not_start_without_vehicle_and_battery(
    vehicle: GuardedVehicle,
    tmp_path: Path,
    given: tuple[str, ...],
    missing: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    (tmp_path / "mavjoule.toml").write_text("", encoding="utf-8")
    assert main(["guard", URL, *given]) == 2
    said = capsys.readouterr().err
    assert said == f"mavjoule: guard does not start {missing}\n"
    assert not vehicle.received


def test_a_vehicle_model_with_its_battery_names_both(vehicle: GuardedVehicle) -> None:
    model = ("--vehicle", "arducopter-sitl-quad", "--lost-after", "5s")
    assert main(["guard", URL, *model]) == 3
    assert vehicle.received


@pytest.mark.parametrize(
    ("line", "named"),
    [
        ('battery = "4000Wh"', "battery: give --battery, or"),
        ('ignore = "M1"', "ignore: give --ignore, or"),
        ('select = "T"', "select: give --select, or"),
        ('fail_on = "error"', "fail_on: give --fail-on, or"),
        ('baseline = "known.json"', "baseline: give --baseline, or"),
        ('vehicle = "px4-sih-quad"', "vehicle: give --vehicle, or"),
        ("reserve = 0\nrisk = 1.0", "reserve, risk: give --reserve, --risk, or"),
        ("charge = 1.0\nwind = 0", "charge, wind: give --charge, --wind, or"),
    ],
)
def test_a_file_that_sets_what_was_not_typed_is_refused(
    vehicle: GuardedVehicle,
    tmp_path: Path,
    line: str,
    named: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    file = tmp_path / "mavjoule.toml"
    file.write_text(f"{line}\n", encoding="utf-8")
    own = {"battery": VEHICLE, "vehicle": CHECK[2:]}.get(line.partition(" ")[0], CHECK)
    assert main(["guard", URL, *own]) == 2
    assert capsys.readouterr().err == (
        f"mavjoule: guard obeys only what is typed, and mavjoule.toml sets {named} move the file\n"
    )
    assert not vehicle.received


@pytest.mark.parametrize(
    "typed",
    [("--select", "T"), ("--fail-on", "error"), ("--reserve", "0"), ("--ignore", "M,T,P,W,V")],
)
def test_a_mission_of_twice_the_battery_arms_nothing_whatever_is_typed(
    vehicle: GuardedVehicle, typed: tuple[str, ...]
) -> None:
    small = (*VEHICLE, "--autopilot", "step", "--battery", "5Wh", "--lost-after", "5s")
    assert main(["guard", URL, *small, *typed]) == 3
    assert vehicle.results() == [2]  # denied


def test_a_file_that_sets_only_how_reports_look_does_no_harm(
    vehicle: GuardedVehicle, tmp_path: Path
) -> None:
    (tmp_path / "mavjoule.toml").write_text('format = "json"\n', encoding="utf-8")
    assert main(["guard", URL, *CHECK, "--lost-after", "5s"]) == 3
    assert vehicle.results() == [0]


def test_an_error_that_is_not_reported_as_asked_is_no_reason_to_arm(
    vehicle: GuardedVehicle, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    site = tmp_path / "site.toml"
    site.write_text("[site]\nmax_height_above_home_m = 5\n", encoding="utf-8")
    asked = ("--profile", str(site), "--ignore", "A114")
    assert main(["guard", URL, *CHECK, *asked, "--lost-after", "5s"]) == 3
    assert vehicle.results() == [2]  # denied
    assert "verdict no-go: A114 too-high-for-site" in capsys.readouterr().err


def test_ctrl_c_ends_in_130(vehicle: GuardedVehicle, capsys: pytest.CaptureFixture[str]) -> None:
    vehicle.script = [(25.0, interrupt)]
    assert main(["guard", URL, *CHECK]) == 130
    assert "Traceback" not in capsys.readouterr().err


def test_with_keep_a_lost_vehicle_is_waited_for(
    vehicle: GuardedVehicle, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    other = guarded(script=[(20.0, GuardedVehicle.ask), (25.0, interrupt)])
    lines = [VirtualLine(vehicle), VirtualLine(other)]
    monkeypatch.setattr("planner.link.vehicle.open_line", lambda _: lines.pop(0))
    monkeypatch.setattr("planner.service.guard._REOPEN_S", 0.0)
    assert main(["guard", URL, *CHECK, "--lost-after", "5s", "--keep"]) == 130
    assert other.results() == [0]
    assert "waiting for it" in capsys.readouterr().err


@pytest.mark.parametrize(("reported", "answer"), [(5, 2), (89, 2), (91, 0)])
def test_a_charge_that_is_given_counts_unless_the_vehicle_reports_less(
    vehicle: GuardedVehicle, reported: int, answer: int, capsys: pytest.CaptureFixture[str]
) -> None:
    vehicle.battery_remaining = reported
    assert main(["guard", URL, *CHECK, "--lost-after", "5s", "--charge", "100%"]) == 3
    assert vehicle.results() == [answer]  # 0 accepted, 2 denied
    assert ("V109" in capsys.readouterr().err) == bool(answer)


@pytest.mark.parametrize(("critical", "answer"), [(0.07, 0), (0.93, 2)])
def test_a_vehicle_is_judged_by_its_own_failsafes_whatever_file_is_typed(
    vehicle: GuardedVehicle,
    critical: float,
    answer: int,
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """It reports 95 % of the charge: at 93 % it returns from the middle of its mission."""
    own = {"BAT_CRIT_THR": (critical, 9), "COM_LOW_BAT_ACT": (3.0, 6)}
    vehicle.parameters = {**vehicle.parameters, **own}
    typed = tmp_path / "typed.params"
    typed.write_text("BAT_CRIT_THR,0.07\n", encoding="utf-8")
    assert main(["guard", URL, *CHECK, "--lost-after", "5s", "--params", str(typed)]) == 3
    assert vehicle.results() == [answer]
    assert ("E103" in capsys.readouterr().err) == bool(answer)


@pytest.mark.parametrize("text", ["0s", "soon", "-3s", "2days"])
def test_a_validity_that_is_none_is_bad_usage(
    text: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["guard", URL, "--valid-for", text]) == 2
    assert "--valid-for" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("90", 90.0), ("60s", 60.0), ("2 min", 120.0), ("1h", 3600.0), ("24H", 86_400.0)],
)
def test_durations_are_written_in_seconds_minutes_and_hours(text: str, seconds: float) -> None:
    assert Duration().read(text) == seconds
