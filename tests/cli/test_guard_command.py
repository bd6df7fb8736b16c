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
CHECK = ("--battery", "77Wh", "--autopilot", "step")


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
    assert any("verdict go: go, " in line for line in lines)
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


def test_a_charge_that_is_given_counts_more_than_the_vehicles(vehicle: GuardedVehicle) -> None:
    vehicle.battery_remaining = 5
    assert main(["guard", URL, *CHECK, "--lost-after", "5s", "--charge", "100%"]) == 3
    assert vehicle.results() == [0]


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
