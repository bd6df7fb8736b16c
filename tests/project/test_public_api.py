"""The public names of the package."""

from __future__ import annotations

import re

import pytest

import planner


@pytest.mark.parametrize("name", dir(planner))
def test_every_public_name_is_there(name: str) -> None:
    assert getattr(planner, name) is not None


def test_an_unknown_name_is_an_attribute_error() -> None:
    with pytest.raises(AttributeError, match="'planner' has no attribute 'fly'"):
        _ = planner.fly  # type: ignore[attr-defined]


def test_a_star_imports_them_all() -> None:
    names: dict[str, object] = {}
    exec("from planner import *", names)
    assert set(dir(planner)) <= names.keys()


def test_the_version_is_one_release_number() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+", planner.__version__)
