"""Findings as lines of text, in the shape editors and pipelines know."""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from planner.findings import Finding, Severity
from planner.report import numbers
from planner.report.plain_text import printable

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.report.medium import Medium

_STYLES = {Severity.ERROR: "red", Severity.WARNING: "yellow", Severity.INFO: "dim"}
_INDENT = 4


def finding_lines(finding: Finding, *, file: str, medium: Medium) -> list[str]:
    """Return ``site.plan:41:9: E101 reserve-below-minimum [error] item 7: …`` and its fix."""
    head = f"{printable(file)}:"
    if finding.place is not None:
        head += f"{finding.place.line}:{finding.place.column}:"
    text = f"{head} {_label(finding)} [{finding.severity.label}] {_said(finding)}"
    first, *rest = medium.wrapped(text, indent=_INDENT)
    first = first.replace(
        f" {finding.code} ", f" {medium.paint(finding.code, _STYLES[finding.severity])} ", 1
    )
    lines = [first, *rest]
    if finding.fix:
        fix = f"{' ' * _INDENT}fix: {printable(finding.fix)}"
        lines += medium.wrapped(fix, indent=_INDENT + 5)
    return lines


def note_lines(finding: Finding, *, medium: Medium) -> list[str]:
    """Return a finding of severity info as a note, without file and fix."""
    return medium.wrapped(f"  {_label(finding)}: {_said(finding)}", indent=_INDENT)


def tally_line(findings: Sequence[Finding]) -> str:
    """Return how many findings there are of each severity, or that there are none."""
    counts = dict.fromkeys(reversed(Severity), 0)
    for finding in findings:
        counts[finding.severity] += 1
    nouns = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "assumption"}
    said = [numbers.count(number, nouns[severity]) for severity, number in counts.items() if number]
    if counts[Severity.ERROR] or counts[Severity.WARNING]:
        return f"Found {', '.join(said)}."
    return f"All checks passed{', with ' + said[0] if said else ''}."


def _label(finding: Finding) -> str:
    return f"{finding.code} {finding.name}"


def _said(finding: Finding) -> str:
    message = printable(finding.message)
    if finding.item is None or re.search(rf"\bitem {finding.item}\b", message):
        return message
    return f"item {finding.item}: {message}"
