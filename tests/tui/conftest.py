"""A review of sample missions, in a folder of its own."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

MISSIONS = Path(__file__).parents[2] / "missions"


@pytest.fixture(autouse=True)
def _own_folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Run beside copies of the sample missions, with nothing of the environment."""
    for file in filter(Path.is_file, MISSIONS.iterdir()):
        shutil.copy(file, tmp_path)
    with (tmp_path / "mavjoule.toml").open("a", encoding="utf-8") as settings:
        settings.write('vehicle = "falkowski-2023-quadrotor"\n')
    monkeypatch.chdir(tmp_path)
    for name in ("NO_COLOR", "MAVJOULE_TRACEBACK", "TEXTUAL_THEME"):
        monkeypatch.delenv(name, raising=False)
