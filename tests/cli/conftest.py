"""Missions small enough to check in a blink."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from pathlib import Path

SQUARE = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t50.0\t20.0\t200\t1
1\t0\t3\t22\t0\t0\t0\t0\t50.0\t20.0\t100\t1
2\t0\t3\t16\t0\t0\t0\t0\t50.005\t20.0\t100\t1
3\t0\t2\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""
"""Up to 100 m, 556 m north (0.005° x 111.2 km), back and down."""


@pytest.fixture(scope="session", autouse=True)
def _vehicle(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Name the vehicle that flies in the settings above all folders of the tests."""
    settings = tmp_path_factory.getbasetemp() / "mavjoule.toml"
    settings.write_text('vehicle = "falkowski-2023-quadrotor"\n', encoding="utf-8")


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run in a folder of its own, in an environment that asks for nothing."""
    monkeypatch.chdir(tmp_path)
    for name in ("NO_COLOR", "MAVJOULE_TRACEBACK", "GITHUB_STEP_SUMMARY"):
        monkeypatch.delenv(name, raising=False)


@pytest.fixture
def mission(tmp_path: Path) -> str:
    """A mission that needs about 6 Wh, by its name in the current folder."""
    (tmp_path / "out.waypoints").write_text(SQUARE, encoding="utf-8")
    return "out.waypoints"


@pytest.fixture
def broken(tmp_path: Path) -> str:
    """A file that is no mission, by its name in the current folder."""
    (tmp_path / "broken.plan").write_text('{"fileType": ', encoding="utf-8")
    return "broken.plan"
