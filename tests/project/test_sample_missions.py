"""Every sample mission has the verdict its README states, with the settings beside it."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest

from planner.cli.main import main

MISSIONS = Path(__file__).parents[2] / "missions"
ROW = re.compile(r"^\| `([^`]+)` \| .* \| (go|no-go)(?:: (\w+))? \|$", re.MULTILINE)
ROWS = ROW.findall((MISSIONS / "README.md").read_text(encoding="utf-8"))
STATED = [row for row in ROWS if not row[0].endswith(".toml")]
FLEETS = [row for row in ROWS if row[0].endswith(".toml")]


def test_every_sample_stands_in_the_readme() -> None:
    held = {p.name for p in MISSIONS.iterdir() if p.suffix in {".plan", ".waypoints"}}
    assert held == {name for name, _, _ in STATED}
    assert len(held) >= 4


FLOWN_BY = ("--vehicle", "falkowski-2023-quadrotor")


@pytest.mark.parametrize(("name", "verdict", "code"), STATED)
def test_a_sample_has_the_verdict_it_is_said_to_have(
    name: str, verdict: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", str(MISSIONS / name), *FLOWN_BY, "--format", "json"]) == (
        verdict == "no-go"
    )
    [checked] = json.loads(capsys.readouterr().out)["missions"]
    assert checked["verdict"] == verdict
    errors = {f["code"] for f in checked["findings"] if f["severity"] == "error"}
    assert (code in errors) if code else not errors


def test_every_fleet_stands_in_the_readme() -> None:
    held = {f"fleets/{path.name}" for path in (MISSIONS / "fleets").glob("*.toml")}
    assert held == {name for name, _, _ in FLEETS}
    assert len(held) >= 3


@pytest.mark.parametrize(("name", "verdict", "code"), FLEETS)
def test_a_fleet_has_the_verdict_it_is_said_to_have(
    name: str, verdict: str, code: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command = ["fleet", "check", str(MISSIONS / name), "--format", "json"]
    assert main(command) == (verdict == "no-go")
    checked = json.loads(capsys.readouterr().out)
    assert checked["verdict"] == verdict
    found = {f["code"] for f in checked["findings"] if f["severity"] == "error"}
    assert (code in found) if code else not found
    assert all(one["mission"]["verdict"] == "go" for one in checked["sorties"])


def test_the_sample_of_a_swarm_is_clear(capsys: pytest.CaptureFixture[str]) -> None:
    [sample] = (MISSIONS / "swarms").glob("*.toml")
    assert f"missions/swarms/{sample.name}" in (MISSIONS / "README.md").read_text(encoding="utf-8")
    assert main(["fleet", "simulate", str(sample), "--format", "json"]) == 0
    assert json.loads(capsys.readouterr().out)["goal"]["fraction"] == 1.0
