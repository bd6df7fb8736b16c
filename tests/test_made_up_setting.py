"""A setting is declared in one place, and everything that lists settings has it from there."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
BEFORE = "    fail_on: Severity = setting(\n"
DECLARED = """
    moon_phase: float = setting(
        Number("days", 0.0, 29.5),
        Group.FLIGHT,
        "age of the moon",
        default=7.0,
        unset="7",
        label="Moon",
        rows=(Row("moon_phase", "Age of the moon", quantity.duration),),
    )
"""
USED = """
import json, sys, types
from pathlib import Path
from click.testing import CliRunner

module = types.ModuleType("planner.setup")
sys.modules["planner.setup"] = module
exec(compile(sys.stdin.read(), "planner/setup.py", "exec"), vars(module))

import planner
from planner.cli.check import command
from planner.cli.configuration import read_configuration
from planner.errors import UsageError
from planner.report.figures import FIGURES
from planner.tui.what_if import form_settings

Path("mavjoule.toml").write_text("moon_phase = 3.5")
mission = sys.argv[1]
checked = json.loads(CliRunner().invoke(command, [mission, "--format", "json"]).output)
try:
    planner.check(planner.read_mission(mission), planner.load_vehicle(), moon_phase=30.0)
except UsageError as error:
    refused = str(error)
print(json.dumps({
    "help": CliRunner().invoke(command, ["--help"]).output,
    "file": dict(read_configuration(Path("mavjoule.toml")).values),
    "fields": [setting.label for setting in form_settings()],
    "json": checked["missions"][0]["conditions"]["moon_phase"],
    "page": [one.label for _, rows in FIGURES for one in rows if "moon" in one.path],
    "refused": refused,
}))
"""


def test_a_setting_declared_in_one_place_is_everywhere(tmp_path: Path) -> None:
    source = (ROOT / "planner" / "setup.py").read_text(encoding="utf-8")
    assert source.count(BEFORE) == 1
    done = subprocess.run(
        [sys.executable, "-c", USED, str(ROOT / "missions" / "delivery-fjord.waypoints")],
        input=source.replace(BEFORE, DECLARED + "\n" + BEFORE),
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(ROOT), "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    assert "--moon-phase DAYS" in found["help"]
    assert "age of the moon [default: 7]" in found["help"]
    assert found["file"] == {"moon_phase": 3.5}
    assert "Moon" in found["fields"]
    assert found["json"] == 7.0
    assert found["page"] == ["Age of the moon"]
    assert found["refused"] == "moon_phase must be 0 to 29.5 days, got 30.0"
