"""A bug in the check of one mission: that mission has no verdict, and nothing else is touched."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

import pytest
from guarded_vehicle import OUT_AND_BACK, GuardedVehicle, guarded
from made_missions import HOME, item, mission, north, rtl, takeoff, waypoint
from reviews import review_app, settled, text_of
from rule_cases.case import PLENTY, vehicle_of
from virtual_vehicle import VirtualLine

from planner.autopilot import Autopilot
from planner.cli.main import main
from planner.guard.decision import Decision, GuardSettings
from planner.guard.energy import EnergyWatch
from planner.guard.session import GuardSession, GuardStatus
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.vehicle import VehicleLink
from planner.service import preflight
from planner.service.guard import judge_vehicle
from planner.service.preflight import check
from planner.setup import FORMATS, Setup
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Mission
    from planner.service.preparation import Preparation

ROW = "{n}\t0\t3\t{command}\t0\t0\t0\t0\t{latitude}\t8\t20\t1\n"
HOME_ROW = "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1\n"
SHORT = (
    HOME_ROW + ROW.format(n=1, command=22, latitude=47) + ROW.format(n=2, command=20, latitude=0)
)
VEHICLE = ("--vehicle", "falkowski-2023-quadrotor", "--battery", "170Wh")
BUG = "this is a bug in mavjoule, not in your files: ZeroDivisionError: division by zero"


def crash(*_: object, **__: object) -> None:
    message = "division by zero"
    raise ZeroDivisionError(message)


@pytest.fixture
def two(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[str, str]:
    """Two good missions, the check of the first of which will fail."""
    monkeypatch.chdir(tmp_path)
    for name in ("bad.waypoints", "good.waypoints"):
        (tmp_path / name).write_text(SHORT, encoding="utf-8")
    whole = preflight.assess

    def assess(prepared: Preparation) -> object:
        if prepared.mission.source.startswith("bad"):
            crash()
        return whole(prepared)

    monkeypatch.setattr(preflight, "assess", assess)
    return "bad.waypoints", "good.waypoints"


def checked(
    capsys: pytest.CaptureFixture[str], *arguments: str, code: int
) -> tuple[dict[str, dict[str, Any]], str]:
    """Return the missions of a check by file, and what it narrates."""
    assert main(["check", *arguments, *VEHICLE, "--format", "json"]) == code
    said = capsys.readouterr()
    return {one["file"]: one for one in json.loads(said.out)["missions"]}, said.err


@pytest.mark.parametrize(
    "arguments",
    [
        ("check", "bad.waypoints"),
        ("segments", "bad.waypoints"),
        ("speed", "bad.waypoints"),
        ("split", "bad.waypoints"),
        ("compare", "bad.waypoints", "good.waypoints"),
        ("compare", "good.waypoints", "bad.waypoints"),
    ],
    ids=" ".join,
)
def test_a_bug_is_no_fault_of_the_input_in_any_command(
    two: tuple[str, str], arguments: tuple[str, ...], capsys: pytest.CaptureFixture[str]
) -> None:
    battery = () if arguments[0] == "segments" else VEHICLE[2:]
    assert main([*arguments, *VEHICLE[:2], *battery]) == 1
    said = capsys.readouterr()
    text = said.out + said.err
    assert BUG in text
    assert arguments[0] == "segments" or f"{two[0]}: X905 check-failed" in text


def test_a_bug_in_a_text_of_a_mission_is_none_of_the_mission(
    two: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    for where, arguments in (
        ("report.speed_curve.speed_curve_text", ("speed", two[1])),
        ("report.comparison.comparison_text", ("compare", two[1], two[1], "--b", "--wind 3@0")),
        ("cli.convert.convert_file", ("convert", two[1], "a.plan")),
        ("service.vehicle.compare_files", ("diff", two[1], two[1])),
    ):
        monkeypatch.setattr(f"planner.{where}", crash)
        given = VEHICLE if arguments[0] in {"speed", "compare"} else ()
        assert main([*arguments, *given]) == 1
        said = capsys.readouterr().err
        assert "X905 check-failed" in said
        assert BUG in said


def test_a_bug_is_an_error_of_its_mission_and_of_no_other(
    two: tuple[str, str], capsys: pytest.CaptureFixture[str]
) -> None:
    missions, said = checked(capsys, *two, code=1)
    bad, good = (missions[name] for name in two)
    assert (bad["verdict"], bad["verdict_text"]) == ("no-go", "NOT CHECKED")
    assert [(one["code"], one["message"]) for one in bad["findings"]] == [("X905", BUG)]
    assert good["verdict"] == "go"
    assert said == ""


def test_no_setting_hides_a_bug(two: tuple[str, str], capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["check", *two, *VEHICLE, "--ignore", "X905"]) == 2
    assert "X905 cannot be ignored" in capsys.readouterr().err
    missions, _ = checked(capsys, *two, "--select", "E", code=1)
    assert missions[two[0]]["findings"][0]["code"] == "X905"


@pytest.mark.parametrize("report", FORMATS)
def test_a_report_that_fails_is_an_error_of_the_mission_it_fails_for(
    report: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "long.waypoints").write_text(
        SHORT.replace("\t47\t8\t20", "\t47\t8\t30"), encoding="utf-8"
    )
    (tmp_path / "short.waypoints").write_text(SHORT, encoding="utf-8")
    from planner.cli import check_output

    whole = check_output.rendered

    def rendered(results: preflight.Results, *given: Any, **more: Any) -> str:  # noqa: ANN401 - as it takes
        if any(getattr(one, "segments", ()) and one.file == "long.waypoints" for one in results):
            crash()
        return whole(results, *given, **more)

    monkeypatch.setattr("planner.cli.check.rendered", rendered)
    names = ["short.waypoints", "long.waypoints"]
    assert main(["check", *names, *VEHICLE, "--format", report]) == 1
    out = capsys.readouterr().out
    assert "ZeroDivisionError" in out
    if report == "json":
        verdicts = [one["verdict"] for one in json.loads(out)["missions"]]
        assert verdicts == ["go", "no-go"]


def test_a_page_that_fails_leaves_the_report_and_no_go(
    two: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("planner.cli.check_output.write_page", crash)
    missions, _ = checked(capsys, two[1], "--report", "page.html", code=1)
    assert [one["code"] for one in missions[two[1]]["findings"]] == ["X905"]


def test_a_separation_that_fails_is_an_error_of_all_it_was_about(
    two: tuple[str, str], monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr("planner.service.separation.predict_conflicts", crash)
    missions, _ = checked(capsys, two[1], two[1], "--separation", "5", code=1)
    assert [one["findings"][0]["code"] for one in missions.values()] == ["X905"]


PAYLOAD_PLACE = 94
ALONE = (
    mission(item(PAYLOAD_PLACE, north(0), 10.0), home=None),
    mission(item(PAYLOAD_PLACE, None, 0.0), home=None),
    mission(item(PAYLOAD_PLACE, HOME.latitude_deg, 10.0)),
)


@pytest.mark.parametrize("autopilot", list(Autopilot))
@pytest.mark.parametrize("one", ALONE)
def test_a_mission_that_goes_nowhere_is_judged(one: Mission, autopilot: Autopilot) -> None:
    result = check(one, vehicle_of(autopilot), autopilot=autopilot, battery=PLENTY)
    assert result.verdict == "no-go"
    assert {finding.code for finding in result.findings} & {"M102", "M108"}


SETUP = Setup(load_vehicle(), battery=Battery(capacity_wh=77.0), autopilot=Autopilot.STEP)


class OverError(Exception):
    """The time of a test is up."""


def decisions_of(vehicle: GuardedVehicle, *, until_s: float) -> list[Decision]:
    """Return what a guard decides in virtual time, until a time."""
    line, decisions = VirtualLine(vehicle), list[Decision]()

    def on_status(_: GuardStatus) -> None:
        if line.time_s >= until_s:
            raise OverError

    session = GuardSession(
        VehicleLink(line, name="virtual", purpose=Purpose.GUARD),
        GuardSettings(),
        judge=lambda snapshot: judge_vehicle(snapshot, SETUP),
        on_decision=decisions.append,
        on_status=on_status,
    )
    with pytest.raises(OverError):
        session.run()
    return decisions


@pytest.mark.parametrize(
    "place", ["planner.service.preflight.assess", "planner.service.vehicle.parameter_set"]
)
def test_a_guard_refuses_what_it_cannot_check_and_goes_on(
    place: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def mend(vehicle: GuardedVehicle) -> None:
        monkeypatch.undo()
        vehicle.lists[MissionKind.MISSION] = (*OUT_AND_BACK[:2], OUT_AND_BACK[1], OUT_AND_BACK[2])

    monkeypatch.setattr(place, crash)
    vehicle = guarded(script=[(20.0, GuardedVehicle.ask), (22.0, mend), (60.0, GuardedVehicle.ask)])
    decisions_of(vehicle, until_s=65.0)
    refused, accepted = vehicle.results()
    assert refused != 0
    assert accepted == 0


def test_a_guard_that_cannot_follow_the_energy_says_so_once_and_goes_on(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def fly(vehicle: GuardedVehicle) -> None:
        vehicle.is_armed, vehicle.place = True, (*vehicle.place[:2], 50_000)

    monkeypatch.setattr(EnergyWatch, "take", crash)
    vehicle = guarded(script=[(20.0, fly)])
    told = [one.text for one in decisions_of(vehicle, until_s=40.0) if one.kind == "energy"]
    assert told == [f"the energy in flight is not followed: {BUG}"]


@pytest.mark.asyncio
async def test_a_review_of_what_fails_has_no_verdict(two: tuple[str, str]) -> None:
    async with review_app(two[0]).run_test(size=(80, 24)) as pilot:
        screen = await settled(pilot)
        assert text_of(screen, "#verdict").startswith("– NO VERDICT")


def test_a_source_that_no_encoding_takes_is_reported_in_every_format() -> None:
    from planner.cli.check_output import rendered
    from planner.errors import ExitCode
    from planner.setup import Output
    from planner.values import replace

    for source in ("a\ud800.plan", "/x/\udcff\ud800.plan", "\udcff.plan", "a\x00\x1b[2J.plan"):
        flown = replace(mission(takeoff(20), waypoint(100, 20), rtl()), source=source)
        result = check(flown, vehicle_of(Autopilot.STEP), battery=PLENTY)
        for name in FORMATS:
            text = rendered([result], Output(format=name), exit_code=ExitCode.GO)
            assert "\x1b" not in text.encode().decode()
