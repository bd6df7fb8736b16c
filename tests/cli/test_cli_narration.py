"""What is said on standard error while someone waits."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

from planner.cli.link import TransferProgress
from planner.cli.output import narrate, progress

if TYPE_CHECKING:
    import pytest


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        """Pretend."""
        return True


def _said(monkeypatch: pytest.MonkeyPatch, stream: io.StringIO) -> str:
    """What is shown of four jobs, of which two are done before two seconds have passed."""
    readings = iter([0.0, 0.1, 1.9, 2.5, 3.0])  # when it begins, and at each job
    monkeypatch.setattr("time.monotonic", lambda: next(readings))
    monkeypatch.setattr("sys.stderr", stream)
    assert list(progress("abcd", of=4, label="checked")) == list("abcd")
    narrate("done")
    return stream.getvalue()


def test_how_many_are_done_is_shown_only_to_whoever_waits_at_a_terminal(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    steps = ("checked 3 of 4", "checked 4 of 4", "")
    shown = "".join(f"\r\x1b[K{step}" for step in steps)
    assert _said(monkeypatch, _Terminal()) == f"{shown}mavjoule: done\n"
    assert _said(monkeypatch, io.StringIO()) == "mavjoule: done\n"


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
