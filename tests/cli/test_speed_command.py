"""``mavjoule speed`` and ``--speed``."""

from __future__ import annotations

import csv
import io
import json
from pathlib import Path

import pytest
from made_missions import mission as made_mission
from made_missions import rtl, speed, takeoff, waypoint

from planner.cli.main import main
from planner.mission.files import write_mission


def test_the_table_marks_the_present_and_the_best_speeds(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["speed", mission, "--vehicle", "arducopter-sitl-quad", "--step", "5"]) == 0
    said = capsys.readouterr()
    for name in ("present", "best endurance", "best range", "fastest that fits"):
        assert f"\n{name} " in said.out
    assert said.err == ""


def test_json_and_csv_hold_the_same_points(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["speed", mission, "--battery", "77Wh", "--from", "4", "--to", "6", "--step", "1"]
    assert main([*arguments, "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert [point["speed_m_s"] for point in document["points"]] == [4.0, 5.0, 6.0]
    assert document["marks"]["best_range"] is None
    assert document["is_power_over_speed_known"] is False
    assert main([*arguments, "--format", "csv"]) == 0
    rows = list(csv.DictReader(io.StringIO(capsys.readouterr().out)))
    assert [float(row["energy_wh"]) for row in rows] == [
        point["energy_wh"] for point in document["points"]
    ]


@pytest.mark.parametrize("wrong", [["--from", "0"], ["--to", "fast"], ["--step", "-1"]])
def test_a_wrong_speed_is_a_sentence(
    wrong: list[str], mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["speed", mission, *wrong]) == 2
    said = capsys.readouterr()
    assert wrong[1] in said.err
    assert said.out == ""


def test_a_broken_mission_is_unusable(broken: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["speed", broken]) == 2
    assert capsys.readouterr().err.startswith("mavjoule: broken.plan:1:")


def test_a_check_at_another_speed_says_that_the_file_flies_otherwise(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", mission, "--battery", "77Wh", "--format", "json"]
    assert main(arguments) == 0
    before = json.loads(capsys.readouterr().out)["missions"][0]
    assert main([*arguments, "--speed", "5"]) == 0
    after = json.loads(capsys.readouterr().out)["missions"][0]
    assert after["totals"]["time_s"] > before["totals"]["time_s"]
    assert "T111" in {finding["code"] for finding in after["findings"]}
    assert "T111" not in {finding["code"] for finding in before["findings"]}


@pytest.mark.parametrize("command", [["upload", "slow.plan", "--yes"], ["guard"]])
def test_what_is_sent_or_armed_is_judged_at_its_own_speeds(
    command: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    given = ["--vehicle", "holybro-x500-v2", "--battery", "5Ah@14.8V", "--speed", "8"]
    assert main([*command[:2], "udpin:127.0.0.1:19599", *command[2:], *given]) == 2
    assert f"{command[0]} judges the mission at its own speeds" in capsys.readouterr().err


def test_a_mission_that_is_too_slow_as_filed_is_no_go_at_any_speed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """2 km out at 1 m/s take 130 W for over half an hour: 77 Wh hold no such flight."""
    monkeypatch.chdir(tmp_path)
    slow = made_mission(takeoff(20), speed(1.0), waypoint(2000, 20), rtl())
    write_mission(slow, Path("slow.plan"))
    arguments = ["check", "slow.plan", "--battery", "77Wh", "--format", "concise"]
    arguments += ["--vehicle", "falkowski-2023-quadrotor"]
    for given in ([], ["--speed", "10"]):
        assert main([*arguments, *given]) == 1
    assert "at the speeds of the file, which are flown" in capsys.readouterr().out
    Path("mavjoule.toml").write_text("speed_m_s = 10\n", encoding="utf-8")
    assert main(arguments) == 1


def test_the_speed_can_stand_in_the_configuration_and_the_range_is_looked_at_anyway(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = 'speed_m_s = 5\nvehicle = "falkowski-2023-quadrotor"\n'
    Path("mavjoule.toml").write_text(lines, encoding="utf-8")
    assert main(["check", mission, "--battery", "77Wh"]) == 0
    assert "T111" in capsys.readouterr().out
    assert main(["speed", mission, "--battery", "77Wh"]) == 0
    assert "\n  9.0  " in capsys.readouterr().out


def test_the_curve_is_drawn_where_the_energy_is_known(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["speed", mission, "--step", "5", "--plots", "drawn", "--vehicle"]
    assert main([*arguments, "arducopter-sitl-quad"]) == 0
    assert {path.name for path in Path("drawn").iterdir()} == {"speed.svg", "speed.png"}
    assert main([*arguments, "px4-sih-quad"]) == 0
    assert "nothing is drawn into drawn" in capsys.readouterr().err


def test_the_edge_of_the_search_is_no_best_speed(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["speed", mission, "--vehicle", "arducopter-sitl-quad", "--battery", "9Ah@22.2V"]
    # of this vehicle the power is least near 6.6 m/s, the energy over distance at more than 12 m/s
    assert main([*arguments, "--from", "1", "--to", "3", "--step", "1"]) == 0
    out = capsys.readouterr().out
    assert "\nbest endurance (edge) " in out
    assert "Best endurance is not found: 3.00 m/s is the fastest speed looked at (--to)" in out
    assert main([*arguments, "--from", "8", "--to", "9", "--step", "1", "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["marks_at_edge"] == [
        *("best_endurance", "best_range", "fastest_fitting", "fastest_clear")
    ]


def test_the_fastest_looked_at_is_not_the_fastest_that_fits(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["speed", mission, "--vehicle", "arducopter-sitl-quad", "--battery", "9Ah@22.2V"]
    assert main([*arguments, "--from", "2", "--to", "3", "--step", "1"]) == 0
    out = capsys.readouterr().out
    assert "\nfastest that fits (edge) " in out
    assert "Fastest that fits: 3.00 m/s is the fastest speed looked at (--to)" in out
    # 0.2 Wh are used up at any speed: none is the fastest
    tight = [*arguments[:-1], "0.2Wh", "--from", "2", "--to", "3", "--step", "1"]
    assert main(tight) == 0
    out = capsys.readouterr().out
    assert "fastest that fits" not in out
    codes = {line.partition("NO-GO ")[2] for line in out.splitlines() if " NO-GO " in line}
    assert codes
    assert all(one.split() == sorted(one.split()) for one in codes)
