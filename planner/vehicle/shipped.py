"""Where the shipped models are: in the wheel and in a checkout alike."""

from __future__ import annotations

from pathlib import Path

_PACKAGE = Path(__file__).resolve().parents[1]


def models_root() -> Path:
    """Return the folder of the shipped models."""
    packaged = _PACKAGE / "_data" / "models"  # in a wheel
    return packaged if packaged.is_dir() else _PACKAGE.parent / "models"
