"""What is imported is paid for on every call: nothing heavy on the way of a check."""

from __future__ import annotations

import os
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
THREADS = "OPENBLAS_NUM_THREADS"


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


@pytest.mark.parametrize("given", [None, "3"])
def test_the_command_gives_matrices_one_thread_unless_the_user_says_more(given: str | None) -> None:
    """Numpy's OpenBLAS reads it once, at its import: the command has to come first."""
    code = "from planner.cli.main import main; import os, sys; early = 'numpy' not in sys.modules"
    code += f"; main(['--version']); print(early, os.environ['{THREADS}'])"
    others = {name: value for name, value in os.environ.items() if name != THREADS}
    done = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
        env=others if given is None else {**others, THREADS: given},
    )
    assert done.stdout.splitlines()[-1] == f"True {given or 1}"
