"""The command as it is started."""

from __future__ import annotations

import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

from planner.cli.__main__ import main
from planner.errors import ExitCode

ROOT = Path(__file__).resolve().parents[2]
_INTERRUPTED_AT = """
import signal, sys

class CtrlC:
    def find_spec(self, name, path=None, target=None):
        if name == {at!r}:
            signal.raise_signal(signal.SIGINT)

sys.meta_path.insert(0, CtrlC())
from planner.cli.__main__ import main
sys.exit(main())
"""


@pytest.mark.parametrize("at", ["click", "planner.errors", "planner.workers"])
def test_ctrl_c_while_it_starts_is_no_traceback(at: str) -> None:
    run = (sys.executable, "-c", _INTERRUPTED_AT.format(at=at), "--version")
    done = subprocess.run(run, capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout, done.stderr) == (ExitCode.INTERRUPTED, "", "")


def test_the_script_starts_there() -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert project["project"]["scripts"]["mavjoule"] == f"{main.__module__}:main"
