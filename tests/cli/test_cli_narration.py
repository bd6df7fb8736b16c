"""What is said on standard error while someone waits."""

from __future__ import annotations

import pytest

from planner.cli.output import narrate_seldom


def test_steps_are_said_only_to_whoever_waits(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    now_s = 0.0
    monkeypatch.setattr("time.monotonic", lambda: now_s)
    narrate_step = narrate_seldom()
    for now_s, step in ((0.1, "first"), (1.9, "second"), (2.5, "third"), (3.0, "fourth")):
        narrate_step(step)
    assert capsys.readouterr().err == "mavjoule: third\n"
