"""The public names of the package."""

from __future__ import annotations

import ast
import re
from pathlib import Path

import pytest

import planner

ROOT = Path(__file__).resolve().parents[2]


@pytest.mark.parametrize("name", planner.__all__)
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(planner, name) is not None


def test_all_is_sorted_and_what_dir_shows() -> None:
    assert dir(planner) == sorted(planner.__all__) == planner.__all__


def test_type_checkers_see_the_names_that_are_resolved_at_run_time() -> None:
    source = (ROOT / "planner" / "__init__.py").read_text(encoding="utf-8")
    typed = {
        alias.name: node.module
        for node in ast.walk(ast.parse(source))
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("planner.")
        for alias in node.names
    }
    assert typed == planner._HOMES
    assert {*typed, "__version__"} == set(planner.__all__)


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'planner' has no attribute 'fly'"):
        _ = planner.fly


def test_the_version_is_one_release_number() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", planner.__version__)
