"""What is imported is paid for on every call: nothing heavy on the way of a check."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
HEAVY = (
    "altair",
    "control",
    "jinja2",
    "matplotlib",
    "mavsdk",
    "pymavlink",
    "pyproj",
    "pyulog",
    "rasterio",
    "rich",
    "scipy",
    "shapely",
    "textual",
    "vl_convert",
    "importlib.metadata",
)
"""Libraries no check needs, and a module that costs more than the version it tells."""


def _loaded(code: str) -> set[str]:
    """Return which heavy modules a fresh interpreter holds after running some code."""
    code += f"\nimport sys; print(*[name for name in {HEAVY!r} if name in sys.modules])"
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=ROOT
    )
    return set(done.stdout.splitlines()[-1].split())


@pytest.mark.parametrize(
    "module", ["planner", "planner.cli.main", "planner.cli.check", "planner.service.preflight"]
)
def test_an_import_pulls_in_nothing_heavy(module: str) -> None:
    assert _loaded(f"import {module}") == set()


def test_a_whole_check_pulls_in_nothing_heavy() -> None:
    check = "main(['check', 'missions/delivery-fjord.waypoints', '--format', 'json'])"
    assert _loaded(f"from planner.cli.main import main; {check}") == set()


def test_the_guard_sees_what_it_guards_against() -> None:
    assert "altair" in _loaded("import altair")


def test_importing_the_package_does_not_even_import_numpy() -> None:
    done = subprocess.run(
        [sys.executable, "-c", "import planner, sys; print('numpy' in sys.modules)"],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert done.stdout.strip() == "False"
