"""Findings as lines of text, in the shape editors and pipelines know."""

from __future__ import annotations

import re
from collections import Counter
from typing import TYPE_CHECKING

from planner import numbers
from planner.findings import Finding, Severity
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
    text = f"{head} {label(finding)} [{finding.severity.label}] {said(finding)}"
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
    return medium.wrapped(f"  {label(finding)}: {said(finding)}", indent=_INDENT)


def tally(findings: Sequence[Finding]) -> str:
    """Return how many findings there are of each severity: ``1 error, 2 assumptions``."""
    nouns = {Severity.ERROR: "error", Severity.WARNING: "warning", Severity.INFO: "assumption"}
    counts = Counter(finding.severity for finding in findings)
    return ", ".join(
        numbers.count(counts[severity], noun)
        for severity, noun in nouns.items()
        if counts[severity]
    )


def closing_line(findings: Sequence[Finding], *, suppressed: Sequence[Finding]) -> str:
    """Return what was found, or that nothing was, and what was found but not reported."""
    if any(finding.severity > Severity.INFO for finding in findings):
        text = f"Found {tally(findings)}."
    elif findings:
        text = f"All checks passed, with {tally(findings)}."
    else:
        text = "All checks passed."
    if suppressed:
        text += f" Not reported, as asked: {tally(suppressed)}."
    return text


def label(finding: Finding) -> str:
    """Return what a finding is called: ``E101 reserve-below-minimum``."""
    return f"{finding.code} {finding.name}"


def said(finding: Finding) -> str:
    """Return the message of a finding, safe to print, with its item."""
    message = printable(finding.message)
    if finding.item is None or re.search(rf"\bitem {finding.item}\b", message):
        return message
    return f"item {finding.item}: {message}"
