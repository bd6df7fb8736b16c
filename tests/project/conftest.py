"""What tests of the project share: its modules, read once."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parents[2] / "planner"


@pytest.fixture(scope="session")
def trees() -> dict[Path, ast.Module]:
    """The modules of the package, by their places in it."""
    return {
        path.relative_to(PACKAGE): ast.parse(path.read_text("utf-8"))
        for path in sorted(PACKAGE.rglob("*.py"))
    }
