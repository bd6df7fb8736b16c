"""Colour, width and the bar of progress follow the terminal."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import pytest

from planner.cli.output import standard_medium
from planner.report.text import Medium


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def _show_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    # in the test itself: pytest changes standard output after fixtures have run
    monkeypatch.setattr(sys, "stdout", _Terminal())
    monkeypatch.setenv("TERM", "xterm")
    monkeypatch.setenv("COLUMNS", "90")


def test_a_terminal_has_colour_and_its_width(monkeypatch: pytest.MonkeyPatch) -> None:
    _show_terminal(monkeypatch)
    assert standard_medium() == Medium(width=90, is_coloured=True)


def test_a_very_wide_terminal_is_not_used_whole(monkeypatch: pytest.MonkeyPatch) -> None:
    _show_terminal(monkeypatch)
    monkeypatch.setenv("COLUMNS", "300")
    assert standard_medium().width == 100


@pytest.mark.parametrize(("name", "value"), [("NO_COLOR", "1"), ("TERM", "dumb")])
def test_whoever_wants_no_colour_gets_none(
    monkeypatch: pytest.MonkeyPatch, name: str, value: str
) -> None:
    _show_terminal(monkeypatch)
    monkeypatch.setenv(name, value)
    assert not standard_medium().is_coloured


def test_an_empty_no_color_asks_for_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    _show_terminal(monkeypatch)
    monkeypatch.setenv("NO_COLOR", "")
    assert standard_medium().is_coloured


def test_a_report_in_a_file_has_neither_colour_nor_width(monkeypatch: pytest.MonkeyPatch) -> None:
    _show_terminal(monkeypatch)
    assert standard_medium(Path("report.txt")) == Medium()


def test_a_pipe_has_neither_colour_nor_width(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "stdout", io.StringIO())
    assert standard_medium() == Medium()
