"""Every way to end has its exit code, and none is a traceback."""

from __future__ import annotations

from pathlib import Path

import pytest

from planner import errors
from planner.cli.main import main
from planner.errors import ExitCode, MavjouleError
from planner.setup import FORMATS

ENOUGH = ("--battery", "77Wh")
TOO_SMALL = ("--battery", "5Wh")


@pytest.mark.parametrize(
    ("arguments", "code"),
    [
        (("check", "out.waypoints", *ENOUGH), 0),
        (("check", "out.waypoints", *TOO_SMALL), 1),
        (("check", "out.waypoints"), 1),  # no battery known
        (("check", "out.waypoints", *TOO_SMALL, "--exit-zero"), 0),
        (("check", "out.waypoints", *ENOUGH, "--temperature", "20", "--fail-on", "warning"), 1),
        (("check", "out.waypoints", *ENOUGH, "--temperature", "20"), 0),
        (("check", "out.waypoints", *ENOUGH, "--payload", "1"), 1),
        (("check", "broken.plan"), 2),
        (("check", "broken.plan", "--exit-zero"), 2),
        (("check", "out.waypoints", "broken.plan", *TOO_SMALL), 2),
        (("check", "missing.plan"), 2),
        (("check", "."), 2),
        (("check", "-", "-"), 2),
        (("check",), 2),
        (("check", "out.waypoints", "--reserve", "20"), 2),
        (("check", "out.waypoints", "--vehicle", "no-such-model"), 2),
        (("check", "out.waypoints", "--vehicle", "missing.toml"), 2),
        (("check", "out.waypoints", "--format", "xml"), 2),
        (("check", "out.waypoints", "--output", "out.waypoints"), 2),
        (("check", "out.waypoints", "--output", "nowhere/report.txt"), 2),
        (("check", "out.waypoints", "--select", "Q1"), 2),
        (("check", "out.waypoints", *TOO_SMALL, "--select", "X", "--extend-select", "E1"), 1),
        (("check", "out.waypoints", *TOO_SMALL, "--ignore", "E1"), 1),
        (("check", "out.waypoints", *TOO_SMALL, "--ignore", "E101"), 2),
        (("check", "out.waypoints", "--extend-select", "Q1"), 2),
        (("check", "out.waypoints", "--baseline", "missing.json"), 2),
        (("check", "out.waypoints", *ENOUGH, "--statistics"), 0),
        (("check", "out.waypoints", *TOO_SMALL, "--statistics"), 1),
        (("check", "out.waypoints", *ENOUGH, "--statistics", "--format", "sarif"), 2),
        (("check", "out.waypoints", *ENOUGH, "--write-baseline", "out.waypoints"), 2),
        (("check", "out.waypoints", *TOO_SMALL, "--write-baseline", "known.json"), 1),
        *(
            (("check", "out.waypoints", *battery, "--format", name), code)
            for name in FORMATS
            for battery, code in ((ENOUGH, 0), (TOO_SMALL, 1))
        ),
        (("segments", "out.waypoints"), 0),
        (("segments", "broken.plan"), 2),
        (("models",), 0),
        (("rules",), 0),
        (("explain", "E101"), 0),
        (("explain", "reserve-below-minimum"), 0),
        (("explain", "E999"), 2),
        (("--version",), 0),
        (("--help",), 0),
        (("check", "--help"), 0),
        (("fly", "out.waypoints"), 2),
        ((), 2),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, tuple) else None,
)
def test_every_end_has_its_code(
    arguments: tuple[str, ...],
    code: int,
    mission: str,
    broken: str,
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert Path(mission).exists()
    assert Path(broken).exists()
    assert main(arguments) == code
    said = capsys.readouterr()
    assert "Traceback" not in said.out + said.err
    if code == 2:
        assert "not checked" in said.out.lower() or said.err.strip(), "a failure is explained"


def _classes() -> list[type[MavjouleError]]:
    return [
        value
        for value in vars(errors).values()
        if isinstance(value, type) and issubclass(value, MavjouleError)
    ]


def _make(kind: type[MavjouleError]) -> MavjouleError:
    if issubclass(kind, errors.InputError):
        return kind("is wrong", source="file")
    return kind("is wrong")


@pytest.mark.parametrize("kind", _classes(), ids=lambda kind: kind.__name__)
def test_every_error_ends_in_its_exit_code_and_one_sentence(
    kind: type[MavjouleError],
    mission: str,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    def fail(*_: object) -> None:
        raise _make(kind)

    monkeypatch.setattr("planner.cli.check.check_file", fail)
    assert main(["check", mission]) == kind.exit_code
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.endswith("is wrong\n")
    assert said.err.startswith("mavjoule: ")
    assert said.err.count("\n") == 1


def test_an_interruption_ends_in_130(mission: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupt(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("planner.cli.check.check_file", interrupt)
    assert main(["check", mission]) == 130


def _crash(*_: object, **__: object) -> None:
    message = "division by zero"
    raise ZeroDivisionError(message)


def test_a_bug_is_called_a_bug_and_tells_how_to_see_more(
    mission: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("planner.cli.listings.rule_text", _crash)
    assert main(["explain", "E101"]) == ExitCode.NO_GO  # the input is usable
    said = capsys.readouterr().err
    assert "bug in mavjoule" in said
    assert "ZeroDivisionError: division by zero" in said
    assert "MAVJOULE_TRACEBACK=1" in said
    assert said.count("\n") == 1
    monkeypatch.setenv("MAVJOULE_TRACEBACK", "1")
    monkeypatch.setattr("planner.service.preflight.assess", _crash)
    for arguments in (["explain", "E101"], ["check", mission]):
        assert main(arguments) == 1
        assert "Traceback (most recent call last)" in capsys.readouterr().err


@pytest.mark.parametrize(
    ("where", "arguments"),
    [
        ("planner.cli.identify.identify_logs", ["identify", "a.ulg", "-o", "a.toml"]),
        ("planner.cli.verify.verify_logs", ["verify", "arducopter-sitl-quad", "a.ulg"]),
        ("planner.service.vehicle.fetch_vehicle", ["fetch", "udp:127.0.0.1:14550", "-o", "a.plan"]),
    ],
)
def test_a_bug_outside_of_a_check_ends_as_one_within(
    where: str, arguments: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(where, _crash)
    assert main(arguments) == ExitCode.NO_GO


def test_a_broken_configuration_ends_in_2_with_file_and_key(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mavjoule.toml").write_text("reserv = 1", encoding="utf-8")
    assert main(["check", mission]) == ExitCode.UNUSABLE
    assert (
        "mavjoule.toml: reserv is not a setting; did you mean reserve?" in capsys.readouterr().err
    )


def test_another_vehicles_mission_is_refused_with_what_to_do(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    vtol = "1\t0\t3\t84\t0\t0\t0\t0\t47.1\t8.5\t20\t1"
    path = tmp_path / "vtol.waypoints"
    path.write_text(f"QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1\n{vtol}\n")
    assert main(["check", str(path), *ENOUGH]) == ExitCode.UNUSABLE
    report = capsys.readouterr().out
    assert "this is a VTOL mission (item 1 is NAV_VTOL_TAKEOFF)" in report
    assert "fix: give a multicopter's mission" in report
