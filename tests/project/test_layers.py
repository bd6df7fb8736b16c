"""The layers of the house are held by a tool that really looks."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]


@pytest.fixture
def house(tmp_path: Path) -> Path:
    """A copy of the package and its contract."""
    shutil.copytree(
        ROOT / "planner", tmp_path / "planner", ignore=shutil.ignore_patterns("__pycache__")
    )
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    return tmp_path


def _lint(folder: Path) -> subprocess.CompletedProcess[str]:
    code = "from importlinter.cli import lint_imports_command as command; command()"
    return subprocess.run(
        [sys.executable, "-c", code, "--no-cache"],
        cwd=folder,
        env={**os.environ, "PYTHONPATH": str(folder), "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )


def test_the_house_as_it_stands_keeps_its_layers(house: Path) -> None:
    done = _lint(house)
    assert done.returncode == 0, done.stdout


AGAINST_THE_FLOW = {
    "units": "planner.service.preflight",
    "physics/wind": "planner.flight.motion.kinematics",
    "mission/items": "planner.vehicle.model",
    "service": "planner.report.text",
    "report/text": "planner.cli.main",
}


def test_every_import_against_the_flow_is_found(house: Path) -> None:
    for module, imported in AGAINST_THE_FLOW.items():
        path = house / "planner" / module
        path = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
        with path.open("a", encoding="utf-8") as file:
            file.write(f"\nimport {imported}\n")
    done = _lint(house)
    assert done.returncode != 0
    for module, imported in AGAINST_THE_FLOW.items():
        name = f"planner.{module.replace('/', '.')}"
        assert re.search(rf"{name} -> {imported} \(", done.stdout), done.stdout


def test_a_module_nobody_placed_is_found(house: Path) -> None:
    (house / "planner" / "helpers.py").write_text('"""Anything."""\n', encoding="utf-8")
    done = _lint(house)
    assert done.returncode != 0
    assert "helpers" in done.stdout + done.stderr
