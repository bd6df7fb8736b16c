"""Rules as text."""

from __future__ import annotations

from planner.findings import Rule, Severity
from planner.report.medium import Medium
from planner.report.rule_text import rule_text, rules_text

RULE = Rule(
    code="Z101",
    name="made-up",
    severity=Severity.WARNING,
    summary="It says something.",
    why="Because.",
    how="By hand.",
    example="one is two",
    fix="do it right",
)


def test_a_rule_is_explained_in_full_with_the_way_to_turn_it_off() -> None:
    assert rule_text(RULE, medium=Medium()).splitlines() == [
        "Z101 made-up [warning]",
        "It says something.",
        "",
        "Why:      Because.",
        "",
        "How:      By hand.",
        "",
        "Example:  one is two",
        "",
        "Fix:      do it right",
        "",
        'Turn off: --ignore Z101, or ignore = ["Z101"] in mavjoule.toml',
    ]


def test_the_list_of_rules_has_a_line_each() -> None:
    assert rules_text([RULE]) == "Z101  warning  made-up  It says something.\n"
