"""What is said on standard error while someone waits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.cli.output import narrate_seldom

if TYPE_CHECKING:
    import pytest


def test_steps_are_said_only_to_whoever_waits(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # the clock is read when it begins, before each step, and after what was said
    readings = iter([0.0, 0.1, 1.9, 2.5, 2.5, 3.0])
    monkeypatch.setattr("time.monotonic", lambda: next(readings))
    narrate_step = narrate_seldom()
    for step in ("first", "second", "third", "fourth"):
        narrate_step(step)
    assert capsys.readouterr().err == "mavjoule: third\n"
