"""``mavjoule fleet simulate``: exit codes, documents, and what it says."""

from __future__ import annotations

import csv
import json
from typing import TYPE_CHECKING

import pytest
from made_swarm import formation

from planner.cli.main import main

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture
def fleet(tmp_path: Path) -> Path:
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + formation(20.0), encoding="utf-8")
    return file


def test_a_swarm_that_comes_home_apart_is_clear(
    fleet: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    trace = tmp_path / "trace.csv"
    assert main(["fleet", "simulate", str(fleet), "--trace", str(trace), "--format", "json"]) == 0
    document = json.loads(capsys.readouterr().out)
    assert document["is_clear"] is True
    assert [one["name"] for one in document["agents"]] == ["a", "b"]
    assert [one["code"] for one in document["findings"]] == ["S133"]
    rows = list(csv.DictReader(trace.read_text(encoding="utf-8").splitlines()))
    assert {row["agent"] for row in rows} == {"a", "b"}
    assert {row["phase"] for row in rows} >= {"climbs", "flies", "lands"}


def test_a_swarm_that_meets_is_not(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + formation(12.0), encoding="utf-8")
    assert main(["fleet", "simulate", str(file), "--policy", "none"]) == 1
    told = capsys.readouterr().out
    assert told.startswith("NOT CLEAR")
    assert "S128" in told


def test_a_fleet_without_swarm_is_told_so(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    text = formation(20.0)
    begin = text.index("[swarm]")
    end = text.index("[swap]")
    job = '[job.j]\nmission = "m.plan"\n'
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n" + text[:begin] + job + text[end:], encoding="utf-8")
    assert main(["fleet", "simulate", str(file)]) == 2
    assert "no table [swarm]" in capsys.readouterr().err
