"""Every format, the baseline and the count of codes, from the command line."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import TYPE_CHECKING
from xml.etree import ElementTree as ET

from sarif_kit.validate import validation_errors

from planner.cli.main import main
from planner.errors import ExitCode

if TYPE_CHECKING:
    import pytest

TOO_SMALL = ("--battery", "5Wh")
ENOUGH = ("--battery", "77Wh")
# The shipped model does not know the temperature: it is a warning, with its value in it.
LOADED = (*ENOUGH, "--temperature", "20", "--fail-on", "warning")


def test_sarif_of_real_missions_is_valid_and_has_lines(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", mission, broken, *TOO_SMALL, "--format", "sarif"]) == 2
    log = json.loads(capsys.readouterr().out)
    assert validation_errors(log) == []
    [run] = log["runs"]
    assert run["invocations"][0]["exitCode"] == ExitCode.UNUSABLE
    [landing] = [one for one in run["results"] if one["ruleId"] == "E101"]
    place = landing["locations"][0]["physicalLocation"]
    # Item 3 of the mission, where the reserve is gone, is line 5 of the file.
    assert place["artifactLocation"]["uri"] == "out.waypoints"
    assert place["region"]["startLine"] == 5


def test_a_mission_named_by_its_whole_path_is_relative_in_sarif(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", str(Path(mission).resolve()), *ENOUGH, "--format", "sarif"])
    [run] = json.loads(capsys.readouterr().out)["runs"]
    assert run["properties"]["missions"][0]["file"] == "out.waypoints"


def test_junit_fails_what_fail_on_says(mission: str, capsys: pytest.CaptureFixture[str]) -> None:
    def failures(*arguments: str) -> set[str]:
        main(["check", mission, *arguments, "--format", "junit"])
        root = ET.fromstring(capsys.readouterr().out.partition("\n")[2])
        return {
            case.attrib["name"].split()[0]
            for case in root.iter("testcase")
            if case.find("failure") is not None
        }

    assert failures(*LOADED) == {"verdict", "E108"}
    assert failures(*LOADED[:-2]) == set()


def test_annotations_go_out_and_a_table_is_added_to_the_summary(
    mission: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("summary.md").write_text("before\n", encoding="utf-8")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
    assert main(["check", mission, *TOO_SMALL, "--format", "github"]) == 1
    said = capsys.readouterr()
    assert said.out.startswith("::error title=mavjoule E1")
    assert said.err == ""
    summary = Path("summary.md").read_text(encoding="utf-8")
    assert summary.startswith("before\n### mavjoule: 1 mission: 0 GO, 1 NO-GO\n")
    assert "| NO-GO | out.waypoints |" in summary


def test_other_formats_add_nothing_to_the_summary(
    mission: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
    assert main(["check", mission, *ENOUGH]) == 0
    assert not Path("summary.md").exists()


def test_a_summary_that_cannot_be_written_is_said_and_the_verdict_stands(
    mission: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "nowhere/summary.md")
    assert main(["check", mission, *ENOUGH, "--format", "github"]) == 0
    said = capsys.readouterr()
    assert "1 mission: 1 GO" in said.out
    assert "GITHUB_STEP_SUMMARY: nowhere/summary.md cannot be written" in said.err


def test_a_summary_on_a_disk_that_is_full_is_not_begun(
    mission: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("summary.md").write_text("# before\n", encoding="utf-8")
    monkeypatch.setenv("GITHUB_STEP_SUMMARY", "summary.md")
    write = os.write

    def half(file: int, data: bytes) -> int:
        return write(file, data[: len(data) // 2])

    monkeypatch.setattr("os.write", half)
    assert main(["check", mission, *ENOUGH, "--format", "github"]) == 0
    assert Path("summary.md").read_text(encoding="utf-8") == "# before\n"
    assert "summary.md cannot be written: No space left" in capsys.readouterr().err


def test_gitlab_s_report_goes_to_the_file_its_pipeline_collects(mission: str) -> None:
    arguments = ["--format", "gitlab", "--output", "gl-code-quality-report.json"]
    assert main(["check", mission, *TOO_SMALL, *arguments]) == 1
    issues = json.loads(Path("gl-code-quality-report.json").read_text(encoding="utf-8"))
    assert {"E101", "E102"} <= {issue["check_name"] for issue in issues}
    assert {issue["location"]["path"] for issue in issues} == {"out.waypoints"}


def test_statistics_count_by_code_in_text_and_json(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", mission, mission, *TOO_SMALL, "--ignore", "E107", "--statistics"]
    assert main(arguments) == 1
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == "2 missions: 0 GO, 2 NO-GO"
    heads, first, second, *_ = lines[4:]
    assert heads.split()[0] == "count"
    assert first.split() == ["2", "0", "2", "E101", "error", "reserve-below-minimum"]
    assert second.split() == ["2", "0", "2", "E102", "error", "no-return-point"]
    assert ["0", "2", "2", "E107", "info", "cruise-power-assumed"] in [
        line.split() for line in lines
    ]
    main([*arguments, "--format", "json"])
    counted = json.loads(capsys.readouterr().out)["statistics"]
    assert [(one["code"], one["count"], one["suppressed"]) for one in counted[:2]] == [
        ("E101", 2, 0),
        ("E102", 2, 0),
    ]


def test_a_known_finding_is_not_reported_again_until_it_changes(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    arguments = ["check", mission, *LOADED]
    assert main([*arguments, "--write-baseline", "known.json"]) == 1, "judged without any"
    said = capsys.readouterr()
    assert "E108" in said.out
    assert "findings written to known.json" in said.err
    assert main([*arguments, "--baseline", "known.json"]) == 0
    out = capsys.readouterr().out
    assert "E108" not in out
    assert out.splitlines()[0] == "GO  out.waypoints (1 warning suppressed)"
    assert main([*arguments, "--temperature", "25", "--baseline", "known.json"]) == 1
    assert "temperature of 25" in capsys.readouterr().out


def test_writing_a_baseline_looks_past_the_one_of_the_configuration(mission: str) -> None:
    arguments = ["check", mission, *LOADED]
    main([*arguments, "--write-baseline", "known.json"])
    first = Path("known.json").read_text(encoding="utf-8")
    settings = 'baseline = "known.json"\nvehicle = "falkowski-2023-quadrotor"\n'
    Path("mavjoule.toml").write_text(settings, encoding="utf-8")
    assert main(arguments) == 0
    assert main([*arguments, "--write-baseline", "known.json"]) == 1
    assert Path("known.json").read_text(encoding="utf-8") == first


def test_no_baseline_makes_a_battery_suffice(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    main(["check", mission, *TOO_SMALL, "--write-baseline", "known.json"])
    assert "3 errors left out that take part in every verdict" in capsys.readouterr().err
    assert main(["check", mission, *TOO_SMALL, "--baseline", "known.json"]) == 1
    out = capsys.readouterr().out
    assert "E101" in out
    assert "E107" not in out


def test_a_mission_that_cannot_be_read_is_named_and_not_in_the_way_of_a_baseline(
    mission: str, broken: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", broken, *LOADED, "--write-baseline", "known.json"]) == 2
    assert not Path("known.json").exists()
    capsys.readouterr()
    assert main(["check", mission, broken, *LOADED, "--write-baseline", "known.json"]) == 2
    assert "not checked, and not in known.json: broken.plan\n" in capsys.readouterr().err
    assert main(["check", mission, *LOADED, "--baseline", "known.json"]) == 0
    assert "E107" not in capsys.readouterr().out


def test_a_verdict_on_standard_error_says_what_it_does_not_count(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    warned = ["--battery", "77Wh", "--temperature", "20", "--fail-on", "warning"]
    arguments = ["check", mission, *warned, "--ignore", "E", "--format", "sarif"]
    assert main([*arguments, "--output", "report.sarif"]) == 0
    assert capsys.readouterr().err == (
        "mavjoule: 1 mission: 1 GO, 0 NO-GO (1 warning suppressed); the report is in report.sarif\n"
    )
