"""What other repositories run of this one: the hook for pre-commit, and the lines of README and help."""

from __future__ import annotations

import re
import shlex
from pathlib import Path

import click
import pytest

from planner.cli import check
from planner.cli.main import main

ROOT = Path(__file__).resolve().parents[2]
TEXTS = (ROOT / "README.md", ROOT / "planner" / "report" / "topics" / "pipeline.md")
YAML_BLOCKS = [
    block
    for text in TEXTS
    for block in re.findall(r"```yaml\n(.*?)```", text.read_text(encoding="utf-8"), re.DOTALL)
]


def _hook() -> dict[str, str]:
    lines = (ROOT / ".pre-commit-hooks.yaml").read_text(encoding="utf-8").splitlines()
    assert all(re.match(r"(- |  )\w+: .", line) for line in lines), "one hook of plain values"
    return dict(line[2:].split(": ", 1) for line in lines)


@pytest.mark.parametrize(
    ("file", "meaning"),
    [
        ("missions/survey.plan", "taken"),
        ("a.waypoints", "taken"),
        ("a.mission", "taken"),
        ("plan.md", "left"),
        ("a.plan.bak", "left"),
        ("aplan", "left"),
    ],
)
def test_the_hook_takes_mission_files(file: str, meaning: str) -> None:
    assert bool(re.search(_hook()["files"], file)) is (meaning == "taken")


def test_the_hook_fails_where_a_mission_is_a_no_go() -> None:
    program, *arguments = shlex.split(_hook()["entry"])
    assert program == "mavjoule"
    assert _hook()["language"] == "python"
    named = ("--vehicle", "falkowski-2023-quadrotor")  # as `args` of the hook, or mavjoule.toml
    assert main([*arguments, *named, str(ROOT / "missions" / "survey-vineyard.plan")]) == 0
    assert main([*arguments, *named, str(ROOT / "missions" / "crossing-too-far.plan")]) == 1


def test_the_help_names_the_hook_by_its_id() -> None:
    assert any(f"- id: {_hook()['id']}" in block for block in YAML_BLOCKS)


@pytest.mark.parametrize(
    "line", [found for block in YAML_BLOCKS for found in re.findall(r"mavjoule check .*", block)]
)
def test_a_pipeline_that_is_shown_calls_with_options_that_exist(line: str) -> None:
    arguments = shlex.split(line)[2:]
    context = check.command.make_context("check", arguments)
    assert isinstance(context, click.Context)
    assert context.params["missions"]
