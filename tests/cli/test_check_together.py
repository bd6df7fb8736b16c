"""Missions that fly at the same time, from the command line and the library."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

import planner
from planner.cli.main import main
from planner.errors import UsageError
from planner.service.preflight import UnreadableMission


@pytest.fixture
def neighbour(mission: str) -> str:
    """The same flight 0.0002° of longitude farther east: 14.3 m at 50° north."""
    text = Path(mission).read_text(encoding="utf-8").replace("\t20.0\t", "\t20.0002\t", 3)
    Path("beside.waypoints").write_text(text, encoding="utf-8")
    return "beside.waypoints"


def _checked(
    capsys: pytest.CaptureFixture[str], *arguments: str
) -> tuple[int, list[dict[str, Any]]]:
    code = main(["check", *arguments, "--battery", "77Wh", "--format", "json"])
    missions: list[dict[str, Any]] = json.loads(capsys.readouterr().out)["missions"]
    return code, missions


def _told(mission: dict[str, Any], code: str, key: str = "findings") -> list[str]:
    return [finding["message"] for finding in mission[key] if finding["code"] == code]


def test_missions_of_one_call_are_independent_unless_asked(
    mission: str, neighbour: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, missions = _checked(capsys, mission, neighbour)
    assert (code, [_told(one, "S101") for one in missions]) == (0, [[], []])


def test_two_too_near_to_each_other_are_both_no_go(
    mission: str, neighbour: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, missions = _checked(capsys, mission, neighbour, "--separation", "15")
    assert (code, [one["verdict"] for one in missions]) == (1, ["no-go", "no-go"])
    for one, other in ((missions[0], neighbour), (missions[1], mission)):
        [message] = _told(one, "S101")
        assert message.startswith(f"14 m from {other}, 15 m required by --separation: at ")
    code, missions = _checked(capsys, mission, neighbour, "--separation", "14")
    assert (code, [_told(one, "S101") for one in missions]) == (0, [[], []])


def test_the_start_delay_that_is_told_clears_the_two(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    """One crosses the way of the other, out and back."""
    rows = Path(mission).read_text(encoding="utf-8")
    east = rows.replace("\t50.0\t20.0\t", "\t50.003\t19.997\t").replace(
        "50.005\t20.0", "50.003\t20.003"
    )
    Path("across.waypoints").write_text(east, encoding="utf-8")
    arguments = (mission, "across.waypoints", "--separation", "100")
    code, missions = _checked(capsys, *arguments)
    assert code == 1
    [fix] = [f["fix"] for f in missions[0]["findings"] if f["code"] == "S101"]
    delay = fix.removeprefix("start across.waypoints ").split(" s later")[0]
    assert _checked(capsys, *arguments, "--start", f"0,{delay}")[0] == 0
    assert _checked(capsys, *arguments, "--start", f"0,{float(delay) - 1.0}")[0] == 1


def test_that_two_meet_takes_part_in_the_verdict_whatever_is_ignored(
    mission: str, neighbour: str, capsys: pytest.CaptureFixture[str]
) -> None:
    near = (mission, neighbour, "--separation", "15")
    assert main(["check", *near, "--ignore", "S101"]) == 2
    assert "the separation that is really required" in capsys.readouterr().err
    assert main(["check", *near, "--battery", "77Wh", "--write-baseline", "known.json"]) == 1
    capsys.readouterr()
    for accepting in (("--ignore", "S"), ("--select", "X"), ("--baseline", "known.json")):
        code, missions = _checked(capsys, *near, *accepting)
        assert (code, [one["verdict"] for one in missions]) == (1, ["no-go", "no-go"])
        assert all(len(_told(one, "S101")) == 1 for one in missions)
    code, missions = _checked(capsys, mission, neighbour, "--separation", "5", "--ignore", "S")
    assert (code, [_told(one, "S101") for one in missions]) == (0, [[], []])


def test_a_mission_that_cannot_be_read_is_no_part_of_it_and_that_is_told(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    code, missions = _checked(capsys, mission, broken, "--separation", "5")
    assert code == 2
    assert _told(missions[0], "S104") == [
        "broken.plan cannot be read: no separation from it is checked"
    ]


def test_a_configuration_may_ask_for_it(
    mission: str, neighbour: str, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("mavjoule.toml").write_text(
        'vehicle = "falkowski-2023-quadrotor"\nseparation_m = 15\nmin_nav_alt_m = 3\n',
        encoding="utf-8",
    )
    assert _checked(capsys, mission, neighbour)[0] == 1
    assert _checked(capsys, mission)[0] == 0  # alone: nothing to be kept away from


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("out.waypoints", "--separation", "5"), "give those of one flight together"),
        (("out.waypoints", "out.waypoints", "--start", "0,1"), "--start goes with --separation"),
        (("out.waypoints", "out.waypoints", "--start-error", "1"), "--start-error goes with"),
        (
            ("out.waypoints", "out.waypoints", "--separation", "5", "--start", "1"),
            "one time for each of the 2 missions",
        ),
        (("out.waypoints", "out.waypoints", "--separation", "0"), "above 0"),
        (
            ("out.waypoints", "out.waypoints", "--separation", "5", "--start", "0,x"),
            "expected a number in s",
        ),
        (("out.waypoints", "out.waypoints", "--separation", "5", "--start", "0,-1"), "0 to"),
        (("out.waypoints", "--separation", "5", "--min-nav-alt", "-1"), "0 to 10000 m"),
    ],
)
def test_what_makes_no_sense_is_a_usage_error(
    mission: str, arguments: tuple[str, ...], said: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert mission == "out.waypoints"
    assert main(["check", *arguments]) == 2
    assert said in capsys.readouterr().err


def test_the_library_judges_results_together(mission: str, neighbour: str) -> None:
    vehicle = planner.load_vehicle("falkowski-2023-quadrotor")
    battery = planner.Battery(capacity_wh=77.0)
    results = [
        planner.check(
            planner.read_mission(file),
            vehicle,
            battery=battery,
            selection=planner.Selection(ignore=ignored),
        )
        for file, ignored in ((mission, ("S101",)), (neighbour, ()))
    ]
    together = planner.check_together(results, separation_m=15.0)
    assert [one.verdict for one in together] == ["no-go", "no-go"]
    assert [one.suppressed for one in together] == [(), ()]
    again = planner.check_together(together, separation_m=14.0)  # takes the place of the first
    assert again == planner.check_together(results, separation_m=14.0) == tuple(results)
    assert planner.check_together([], separation_m=5.0) == ()
    unread = UnreadableMission(file="x", findings=())
    assert planner.check_together([unread], separation_m=5.0) == (unread,)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"separation_m": 0.0}, "separation_m must be above 0 and at most 10000 m, got 0.0"),
        ({"separation_m": None}, "separation_m must be a number"),
        ({"separation_m": float("nan")}, "separation_m must be a finite number"),
        ({"separation_m": 5.0, "min_nav_alt_m": -1.0}, "min_nav_alt_m must be 0 to 10000 m"),
        ({"separation_m": 5.0, "start_error_s": "1"}, "start_error_s must be a number"),
        ({"separation_m": 5.0, "starts_s": (0.0, 1.0)}, "2 starts given for 1 mission"),
        ({"separation_m": 5.0, "starts_s": ("0",)}, "starts_s must be a finite number"),
    ],
)
def test_the_library_refuses_what_makes_no_sense(given: dict[str, Any], said: str) -> None:
    with pytest.raises(UsageError, match=f"^{said}"):
        planner.check_together([UnreadableMission(file="x", findings=())], **given)


def test_the_library_takes_results_and_not_missions(mission: str) -> None:
    wrong: Any = [planner.read_mission(mission)]
    with pytest.raises(UsageError, match=r"results must be those of planner\.check"):
        planner.check_together(wrong, separation_m=5.0)
