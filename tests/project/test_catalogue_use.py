"""Every rule is told by something: a rule that nothing tells promises a check that is not made."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from planner import catalogue
from planner.findings import Rule

PLANNER = Path(__file__).parents[2] / "planner"


def _assigned_rules() -> set[str]:
    """Return the names that modules of the catalogue give to rules."""
    names = set()
    for path in (PLANNER / "catalogue").glob("*.py"):
        for node in ast.parse(path.read_text(encoding="utf-8")).body:
            if (
                isinstance(node, ast.Assign)
                and isinstance(node.value, ast.Call)
                and isinstance(node.value.func, ast.Name)
                and node.value.func.id == Rule.__name__
            ):
                names |= {target.id for target in node.targets if isinstance(target, ast.Name)}
    return names


def _used_names() -> set[str]:
    """Return the names and attributes that the other modules read."""
    names = set()
    for path in PLANNER.rglob("*.py"):
        if path.parent.name == "catalogue":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Name):
                names.add(node.id)
            elif isinstance(node, ast.Attribute):
                names.add(node.attr)
    return names


def test_every_rule_of_the_catalogue_is_told_somewhere() -> None:
    rules = _assigned_rules()
    assert len(rules) > 100
    assert rules - _used_names() == set()


def test_the_texts_of_a_rule_are_sentences_and_its_fix_is_none() -> None:
    for rule in catalogue.rules().values():
        for text in (rule.summary, rule.why, rule.how):
            assert text.endswith("."), rule.code
            assert not re.search(r"[a-z0-9)]\. [A-Z]|[^.?!:]  |\b(\w+) \1\b", text), rule.code
        for text in (rule.fix, rule.example):
            assert not text.endswith("."), rule.code
