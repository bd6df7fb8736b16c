"""Every rule is declared once, reported by something, and tried where it fires, beside and on its limit.

The cases are by subject in tests/rule_cases; a rule without them does not pass.
"""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from rule_examples import CASES, example

from planner import catalogue
from planner.findings import Rule

if TYPE_CHECKING:
    from collections.abc import Iterator

PLANNER = Path(catalogue.__file__).parents[1]
CODES = sorted(CASES)


def _trees() -> Iterator[tuple[str, ast.Module]]:
    for path in PLANNER.rglob("*.py"):
        parts = path.relative_to(PLANNER.parent).with_suffix("").parts
        yield ".".join(parts), ast.parse(path.read_text(encoding="utf-8"))


def test_every_rule_is_listed_once_and_has_its_three_cases() -> None:
    assert list(catalogue.rules()) == CODES
    assert list(catalogue.examples()) == CODES
    names = {rule.name for rule in catalogue.rules().values()}
    assert len(names) == len(CODES)


def test_every_module_with_a_rule_is_listed_and_every_rule_is_reported() -> None:
    declared: dict[str, str] = {}
    used: set[str] = set()
    for module, tree in _trees():
        for node in ast.walk(tree):
            if isinstance(node, ast.Assign) and isinstance(node.value, ast.Call):
                called, target = node.value.func, node.targets[0]
                if isinstance(called, ast.Name) and called.id == Rule.__name__:
                    assert isinstance(target, ast.Name)
                    declared[target.id] = module
            if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
                used.add(node.id)
    assert len(declared) == len(CODES)
    assert set(declared.values()) == set(catalogue.MODULES)
    assert declared.keys() - used == set()


def test_the_texts_of_a_rule_are_sentences_and_its_fix_is_none() -> None:
    for rule in catalogue.rules().values():
        for text in (rule.summary, rule.why, rule.how):
            assert text.endswith("."), rule.code
            assert not re.search(r"[a-z0-9)]\. [A-Z]|[^.?!:]  |\b(\w+) \1\b", text), rule.code
        for text in (rule.fix, catalogue.examples()[rule.code]):
            assert not text.endswith("."), rule.code


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_reported_where_its_text_says_and_its_example_is_its_message(code: str) -> None:
    assert (
        list(_miscounted(*(one.message for one in CASES[code].fires() if one.code == code))) == []
    )
    assert catalogue.examples()[code] == example(code), "run tests/rule_examples.py"


@pytest.mark.parametrize("code", CODES)
def test_a_rule_is_silent_about_what_is_near_and_right(code: str) -> None:
    assert [finding.message for finding in CASES[code].silent() if finding.code == code] == []


@pytest.mark.parametrize("code", CODES)
def test_a_rule_takes_its_limit_as_its_text_says(code: str) -> None:
    found = [finding.message for finding in CASES[code].boundary() if finding.code == code]
    assert bool(found) is CASES[code].fires_at_boundary, found


def _miscounted(*messages: str) -> Iterator[str]:
    """Yield ``1 parts`` and the like, but not ``item 1 takes``."""
    for message in messages:
        for word, counted in re.findall(
            r"(\w*)[ (]*(?<![\w.,/])(1 (?:more |[A-Z]+ )?[a-z]{3,}s)\b", message
        ):
            if word not in _NUMBERED:
                yield counted


_NUMBERED = {"item", "point", "polygon", "circle", "flight", "vertex", "instance", "line"}
