"""Rules of the catalogue as text."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from planner.catalogue import FAMILIES, entries, events_of
from planner.findings import Severity
from planner.report.text import table_lines

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Rule
    from planner.report.text import Medium


def rules_text(rules: Sequence[Rule]) -> str:
    """Return the catalogue, a line per rule under the heading of its family.

    A rule that has to be selected is marked; the events of PX4 that a rule stands for follow it.
    """
    rows = [
        (
            f"  {rule.code}",
            rule.severity.label if rule.is_default else f"{rule.severity.label}, off",
            rule.name,
            rule.summary,
        )
        for rule in rules
    ]
    lines: list[str] = []
    table = zip(rules, table_lines(rows, alignment="<<<<"), strict=True) if rows else ()
    for family, members in groupby(table, key=lambda entry: entry[0].code[0]):
        lines += ["", f"{family}: {FAMILIES.get(family, 'others')}"]
        for rule, line in members:
            lines.append(line)
            lines += [f"        = {event}" for event in events_of(rule.code)]
    lines += ["", "off: asked only where --select or --extend-select names it", "= an event of PX4"]
    return "\n".join(lines[1:]) + "\n"


def rule_text(rule: Rule, *, medium: Medium) -> str:
    """Return one rule in full: what, why, how, an example, what to do, how to turn it off."""
    lines = [medium.paint(f"{rule.code} {rule.name} [{rule.severity.label}]", "bold")]
    lines += medium.wrapped(rule.summary)
    for title, text in explanation(rule):
        lines += ["", *medium.wrapped(f"{title + ':':<10}{text}", indent=10)]
    return "\n".join(lines) + "\n"


def explanation(rule: Rule) -> tuple[tuple[str, str], ...]:
    """Return the parts of a rule's explanation, each with its title."""
    parts = [
        ("Why", rule.why),
        ("How", rule.how),
        ("Example", entry.example if (entry := entries().get(rule.code)) is not None else ""),
        ("Fix", rule.fix),
    ]
    if events := events_of(rule.code):
        parts.append(("PX4", ", ".join(events)))
    if not rule.is_default:
        parts.append(("Turn on", f"--extend-select {rule.code}"))
    parts.append(("Turn off", way_off(rule)))
    return tuple(part for part in parts if part[1])


def way_off(rule: Rule) -> str:
    """Return how to turn a rule off: everywhere, for a file, for an item, for what is known."""
    code = rule.code
    if rule.instead and rule.severity is Severity.ERROR:
        return f"not possible: it takes part in every verdict; give {rule.instead}"
    text = (
        f'--ignore {code}, or ignore = ["{code}"] in mavjoule.toml; for one file or item, under '
        f'[per_file_ignores], "site.plan" = ["{code}"] or "site.plan#12" = ["{code}"]; '
    )
    if rule.instead:
        return text + f"its errors take part in every verdict: give {rule.instead}"
    return text + "for what is there already, --baseline."
