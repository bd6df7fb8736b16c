"""``mavjoule review`` where no terminal UI can be shown: a sentence, and what to run instead."""

from __future__ import annotations

import os
import shutil
import sys
from typing import TYPE_CHECKING

import planner
from planner.cli.main import main
from planner.cli.options import command_text

if TYPE_CHECKING:
    import pytest


def on_a_terminal(monkeypatch: pytest.MonkeyPatch, *, columns: int = 80, rows: int = 24) -> None:
    for stream in (sys.stdin, sys.stdout, sys.stderr):
        monkeypatch.setattr(stream, "isatty", lambda: True)
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setattr(shutil, "get_terminal_size", lambda: os.terminal_size((columns, rows)))


def test_no_terminal_is_told_with_what_to_run_instead(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["review", mission, "--wind", "3@90", "--reserve", "30%"]) == 2
    told = capsys.readouterr().err
    same = f"mavjoule check {mission} --wind 3@90 --reserve 30%"
    assert f"needs a terminal; run instead: {same}" in told


def test_a_dumb_terminal_is_told(
    mission: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    on_a_terminal(monkeypatch)
    monkeypatch.setenv("TERM", "dumb")
    assert main(["review", mission]) == 2
    assert "TERM=dumb; run instead: mavjoule check" in capsys.readouterr().err


def test_too_small_a_terminal_is_told(
    mission: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    on_a_terminal(monkeypatch, columns=40, rows=10)
    assert main(["review", mission]) == 2
    assert "40 × 10 characters" in capsys.readouterr().err


def test_a_missing_textual_is_told(
    mission: str, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    on_a_terminal(monkeypatch)
    for name in [name for name in sys.modules if name.startswith(("textual", "planner.tui"))]:
        monkeypatch.delitem(sys.modules, name)
    if "tui" in vars(planner):  # a second import would leave its own package there for good
        monkeypatch.delattr(planner, "tui")
    monkeypatch.setitem(sys.modules, "textual", None)
    assert main(["review", mission]) == 2
    assert "needs textual" in capsys.readouterr().err


def test_standard_input_is_told(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["review", "-"]) == 2
    assert "standard input" in capsys.readouterr().err


def test_a_vehicle_beside_a_mission_is_told(
    mission: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["review", mission, "udpin:127.0.0.1:14550"]) == 2
    assert "give its address alone" in capsys.readouterr().err


def test_what_to_run_instead_is_quoted_for_the_shell_at_hand(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    words = ["mavjoule", "check", "my site.plan"]
    assert command_text(words) == "mavjoule check 'my site.plan'"
    monkeypatch.setattr("planner.cli.options.os.name", "nt")
    assert command_text(words) == 'mavjoule check "my site.plan"'


def test_a_vehicle_that_was_never_read_ends_in_exit_3(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    from planner.tui.app import ReviewApp
    from planner.tui.screens.live import LiveScreen

    def leave(app: ReviewApp) -> None:
        screen = app.get_default_screen()
        assert isinstance(screen, LiveScreen)
        screen.lost_by = "no heartbeat in 10 s"

    on_a_terminal(monkeypatch)
    monkeypatch.setattr(ReviewApp, "run", leave)
    assert main(["review", "udpin:127.0.0.1:14550"]) == 3
    assert "no heartbeat in 10 s" in capsys.readouterr().err
