"""What is said on standard error while someone waits."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.cli.link import TransferProgress
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


def test_where_there_is_no_terminal_what_is_waited_for_is_said_every_five_seconds(
    capsys: pytest.CaptureFixture[str],
) -> None:
    times_s = iter((0.0, 1.0, 4.9, 5.0, 5.0, 6.0, 9.9, 10.0, 10.0, 11.0, 15.0, 15.0, 16.0))
    tell = TransferProgress(lambda: next(times_s))  # read again after what was said
    for _ in range(6):
        tell("the vehicle's heartbeat", 0, None)
    for done in (1, 2, 3, 3):
        tell("mission", done, 3)
    assert capsys.readouterr().err.splitlines() == [
        "mavjoule: waiting for the vehicle's heartbeat",
        "mavjoule: waiting for the vehicle's heartbeat",
        "mavjoule: mission: 2 of 3",
        "mavjoule: mission: 3 of 3",
    ]
