"""What the gate leaves out of long tests."""

from __future__ import annotations

import ast
import json
from pathlib import Path
from typing import TYPE_CHECKING, cast

from hypothesis import settings
from thinning import LONG, LONG_S, SHORT_S, WHOLE, examples, long_tests, thinned

if TYPE_CHECKING:
    from collections.abc import Sequence

    import pytest

TESTS = Path(__file__).parent


class Case:
    def __init__(self, nodeid: str) -> None:
        self.nodeid = nodeid


def shown(cases: Sequence[object]) -> list[str]:
    return [cast("Case", case).nodeid for case in cases]


def test_of_a_long_test_cases_from_all_over_it_are_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(json, "loads", lambda _: {"a.py::long": 2, "a.py::out": 0, "a.py::few": 9})
    names = [f"a.py::long[{n}]" for n in range(6)] + ["a.py::out", "a.py::few[0]", "a.py::other"]

    run, left_out = thinned([cast("pytest.Item", Case(name)) for name in names])

    assert shown(run) == ["a.py::long[0]", "a.py::long[3]", "a.py::few[0]", "a.py::other"]
    assert sorted(shown(run) + shown(left_out)) == sorted(names)


def test_cases_are_left_out_until_a_test_is_short_and_no_module_is_left_empty() -> None:
    each_s = 2.0 * SHORT_S
    took_s = {
        "a.py::long": [each_s] * 10,
        "a.py::of_short_cases": [0.5 * SHORT_S] * 100,
        "b.py::one": [LONG_S + 1.0],
        "b.py::other": [LONG_S + 0.5],
        f"{WHOLE[0]}test_c.py::one": [100.0],
    }

    assert long_tests(took_s) == {
        "a.py::long": int(LONG_S / each_s),
        "b.py::one": 0,
        "b.py::other": 1,
    }


def test_fewer_examples_are_drawn_but_two_at_least() -> None:
    drawn = settings().max_examples
    assert examples(100) == drawn
    assert examples(1) == 2


def test_every_test_that_is_thinned_is_there() -> None:
    names = {
        f"{file.relative_to(TESTS.parent).as_posix()}::{one.name}"
        for file in TESTS.rglob("test_*.py")
        for one in ast.parse(file.read_text(encoding="utf-8")).body
        if isinstance(one, ast.FunctionDef | ast.AsyncFunctionDef)
    }
    gone = json.loads(LONG.read_text(encoding="utf-8")).keys() - names
    assert not gone, "run: make long"
