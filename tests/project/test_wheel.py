"""What is shipped works where there is no checkout."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PIP_INSTALL = (sys.executable, "-m", "pip", "install", "--quiet", "--no-index", "--no-deps")


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("wheel")
    subprocess.run(
        [sys.executable, "-m", "hatchling", "build", "-t", "wheel", "-d", str(folder)],
        cwd=ROOT,
        check=True,
        capture_output=True,
    )
    [path] = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the wheel installed, and nothing of the checkout."""
    folder = tmp_path_factory.mktemp("installed")
    subprocess.run(
        [*PIP_INSTALL, "--target", str(folder), str(wheel)], check=True, capture_output=True
    )
    return folder


def _run(installed: Path, *arguments: str) -> str:
    done = subprocess.run(
        [sys.executable, str(installed / "bin" / "mavjoule"), *arguments],
        cwd=installed.parent,
        env={**os.environ, "PYTHONPATH": str(installed), "PYTHONUTF8": "1"},
        capture_output=True,
        text=True,
        encoding="utf-8",
        check=False,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_the_wheel_holds_every_model_and_mission_and_no_test(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    shipped = [
        f"planner/_data/{path.relative_to(ROOT).as_posix()}"
        for folder in ("models", "missions")
        for path in (ROOT / folder).rglob("*")
        if path.is_file()
    ]
    assert shipped
    assert set(shipped) <= names
    assert "planner/py.typed" in names
    page = (ROOT / "planner/report/html").glob("page.*")
    assert {path.relative_to(ROOT).as_posix() for path in page} <= names
    assert not [name for name in names if name.startswith("tests/")]


def test_the_installed_command_runs_from_the_installed_package(installed: Path) -> None:
    code = "import planner; print(planner.__file__)"
    done = subprocess.run(
        [sys.executable, "-c", code],
        cwd=installed.parent,
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=True,
    )
    assert Path(done.stdout.strip()) == installed / "planner" / "__init__.py"
    assert _run(installed, "--version").startswith("mavjoule ")


def test_the_installed_command_lists_its_models(installed: Path) -> None:
    models = json.loads(_run(installed, "models", "--format", "json"))["models"]
    assert {model["name"] for model in models} == {
        path.stem for path in (ROOT / "models").glob("*.toml")
    }


def test_the_installed_command_checks_a_shipped_mission(installed: Path) -> None:
    mission = installed / "planner" / "_data" / "missions" / "survey-vineyard.plan"
    named = ("--vehicle", "falkowski-2023-quadrotor")
    [checked] = json.loads(_run(installed, "check", str(mission), *named, "--format", "json"))[
        "missions"
    ]
    assert checked["verdict"] == "go"
    assert checked["segments"]
