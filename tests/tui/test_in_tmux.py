"""The command as a pilot runs it: in a real terminal, that of tmux."""

from __future__ import annotations

import os
import shlex
import shutil
import subprocess
import sys
import time
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

pytestmark = pytest.mark.skipif(shutil.which("tmux") is None, reason="tmux is not installed")

DEADLINE_S = 40.0
"""Longer than the slowest machine takes; a text that is there is met at once."""


class Pane:
    """A pane of a tmux of its own."""

    def __init__(self, socket: str) -> None:
        self._socket = socket

    def run(self, *words: str) -> str:
        done = subprocess.run(
            ["tmux", "-S", self._socket, *words], capture_output=True, text=True, check=True
        )
        return done.stdout

    def keys(self, *keys: str) -> None:
        self.run("send-keys", *keys)

    def wait_for(self, text: str) -> str:
        """Return what is shown once it holds a text."""
        end = time.monotonic() + DEADLINE_S
        while time.monotonic() < end:
            shown = self.run("capture-pane", "-p")
            if text in shown:
                return shown
        pytest.fail(f"{text!r} is not shown:\n{shown}")


@pytest.fixture
def pane(tmp_path: Path) -> Iterator[Pane]:
    found = Pane(str(tmp_path / "s"))
    command = shlex.join(
        [
            sys.executable,
            "-c",
            "import sys; from planner.cli.main import main; sys.exit(main(sys.argv[1:]))",
            "review",
            "crossing-too-far.plan",
        ]
    )
    shell = f"{command}; echo ended with $?; exec cat"
    subprocess.run(
        [
            "tmux",
            "-S",
            str(tmp_path / "s"),
            "-f",
            os.devnull,
            "new-session",
            "-d",
            "-x",
            "80",
            "-y",
            "24",
            "-c",
            str(tmp_path),
            shell,
        ],
        check=True,
        env={**os.environ, "TERM": "xterm-256color", "LC_ALL": "C.UTF-8"},
    )
    yield found
    found.run("kill-server")


def test_a_new_user_finds_why_it_fails_and_what_makes_it_go(pane: Pane) -> None:
    shown = pane.wait_for("would make it a GO")
    assert "✖ NO-GO" in shown
    assert "short of the 20 %" in shown
    assert "E101" in shown
    pane.keys("w")
    pane.wait_for("suggestions (Tab")
    pane.wait_for("Take back all")  # the keyboard is in the form
    pane.keys("Up")  # from the first field around to the suggestions
    pane.keys("Enter")
    pane.wait_for("NO-GO → GO")
    pane.keys("Escape")
    pane.wait_for("what was found")  # Escape and q together would be Alt+q
    pane.keys("q")
    pane.wait_for("ended with 0")
