"""What reading a mission brings to light, gathered so that a repeated trap is told once."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.findings import Finding, Place, Rule, Severity


@dataclass(slots=True)
class Remarks:
    """Findings by rule: the first of each with its place, and how many more there are."""

    _first: dict[tuple[str, Severity], Finding] = field(default_factory=dict)
    _count: dict[tuple[str, Severity], int] = field(default_factory=dict)

    def add(
        self,
        rule: Rule,
        message: str,
        *,
        item: int | None = None,
        place: Place | None = None,
        severity: Severity | None = None,
    ) -> None:
        """Add one occurrence of a rule; only the first of each rule and severity is told."""
        finding = rule.finding(message, item=item, place=place, severity=severity)
        key = (finding.code, finding.severity)
        self._first.setdefault(key, finding)
        self._count[key] = self._count.get(key, 0) + 1

    def findings(self) -> tuple[Finding, ...]:
        """Return one finding for each rule and severity, in the order in which they came up."""
        return tuple(
            finding
            if self._count[key] == 1
            else replace(finding, message=f"{finding.message} (and {self._count[key] - 1} more)")
            for key, finding in self._first.items()
        )
