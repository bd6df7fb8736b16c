"""A review of sample missions, in a folder of its own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

MISSIONS = Path(__file__).parents[2] / "missions"


@pytest.fixture(scope="session", autouse=True)
def _vehicle(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Name the vehicle that flies in the settings above all folders of the tests."""
    settings = tmp_path_factory.getbasetemp() / "mavjoule.toml"
    settings.write_text('vehicle = "falkowski-2023-quadrotor"\n', encoding="utf-8")


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run beside copies of the sample missions, with nothing of the environment."""
    for file in MISSIONS.iterdir():
        shutil.copy(file, tmp_path)
    monkeypatch.chdir(tmp_path)
    for name in ("NO_COLOR", "MAVJOULE_TRACEBACK", "TEXTUAL_THEME"):
        monkeypatch.delenv(name, raising=False)
