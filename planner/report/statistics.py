"""How often each rule fired in a call."""

from __future__ import annotations

from collections import Counter, defaultdict
from typing import TYPE_CHECKING

from planner.report.text import table_lines
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding, Severity
    from planner.service import CheckResult, UnreadableMission


class CodeCount(Value):
    """The findings of one rule and severity in all missions of a call."""

    code: str
    name: str
    severity: Severity
    count: int
    """How many are reported."""
    suppressed: int
    """How many are not."""
    missions: int
    """In how many missions there are any."""


def count_codes(results: Sequence[CheckResult | UnreadableMission]) -> tuple[CodeCount, ...]:
    """Return what was found by rule and severity: worst first, then most, then by code."""
    reported = Counter(_key(finding) for result in results for finding in result.findings)
    suppressed = Counter(_key(finding) for result in results for finding in result.suppressed)
    missions: defaultdict[tuple[str, str, Severity], set[int]] = defaultdict(set)
    for index, result in enumerate(results):
        for finding in (*result.findings, *result.suppressed):
            missions[_key(finding)].add(index)
    counts = [
        CodeCount(
            code=code,
            name=name,
            severity=severity,
            count=reported[code, name, severity],
            suppressed=suppressed[code, name, severity],
            missions=len(where),
        )
        for (code, name, severity), where in missions.items()
    ]
    return tuple(sorted(counts, key=lambda one: (-one.severity, -one.count, one.code)))


def statistics_lines(counts: Sequence[CodeCount]) -> list[str]:
    """Return counts as an aligned table; none where nothing was found."""
    if not counts:
        return ["Nothing was found."]
    heads = ("count", "not reported", "missions", "code", "severity", "name")
    rows = [
        (
            str(one.count),
            str(one.suppressed),
            str(one.missions),
            one.code,
            one.severity.label,
            one.name,
        )
        for one in counts
    ]
    return table_lines([heads, *rows], alignment=">>><<<")


def _key(finding: Finding) -> tuple[str, str, Severity]:
    return finding.code, finding.name, finding.severity
