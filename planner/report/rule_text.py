"""Rules of the catalogue as text."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.report.table import table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Rule
    from planner.report.medium import Medium


def rules_text(rules: Sequence[Rule]) -> str:
    """Return the catalogue, a line per rule."""
    rows = [(rule.code, rule.severity.label, rule.name, rule.summary) for rule in rules]
    return "\n".join(table_lines(rows, alignment="<<<<")) + "\n"


def rule_text(rule: Rule, *, medium: Medium) -> str:
    """Return one rule in full: what, why, how, an example, what to do, how to turn it off."""
    lines = [medium.paint(f"{rule.code} {rule.name} [{rule.severity.label}]", "bold")]
    lines += medium.wrapped(rule.summary)
    parts = (
        ("Why", rule.why),
        ("How", rule.how),
        ("Example", rule.example),
        ("Fix", rule.fix),
        ("Turn off", f'--ignore {rule.code}, or ignore = ["{rule.code}"] in mavjoule.toml'),
    )
    for title, text in parts:
        lines += ["", *medium.wrapped(f"{title + ':':<10}{text}", indent=10)]
    return "\n".join(lines) + "\n"
