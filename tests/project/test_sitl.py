"""What ``make sitl`` does without a build, and the flights it would fly with one."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

from made_missions import HOME, mission
from sitl.tour import flights, main

from planner.service.preflight import check
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from pathlib import Path

    import pytest


def test_without_a_build_it_says_what_to_name(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(sys, "argv", ["tour"])
    assert main() == 2
    assert "make sitl ARDUCOPTER=" in capsys.readouterr().out


def test_a_build_that_is_not_there_is_named(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], tmp_path: Path
) -> None:
    monkeypatch.setattr(sys, "argv", ["tour", "--px4", str(tmp_path / "px4")])
    assert main() == 2
    assert "px4: no such file" in capsys.readouterr().out


def test_its_22_flights_are_of_22_kinds_and_can_be_predicted() -> None:
    made = dict(flights(HOME))
    assert len(made) == 22
    vehicle = load_vehicle("arducopter-sitl-quad")
    for name in ("stairs", "survey, low and slow"):
        assert check(mission(*made[name]), vehicle).totals.time_s > 60.0
