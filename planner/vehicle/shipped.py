"""Where the shipped models are: in the wheel and in a checkout alike."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path


def models_root() -> Path:
    """Return the folder of the shipped models."""
    packaged = Path(str(files("planner"))) / "_data" / "models"  # in a wheel
    return packaged if packaged.is_dir() else Path(__file__).resolve().parents[2] / "models"
