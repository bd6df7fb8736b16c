"""Which findings are reported, and why the others are not; none is ever dropped."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.findings import Finding
    from planner.rules.baseline import Baseline


@frozen
class Exemption:
    """Codes that are not reported of one mission, or of one of its items."""

    codes: tuple[str, ...]
    """Codes, or beginnings of codes."""
    item: int | None = None
    """Mission item from 1 in flown order; ``None``: every item, and what has none."""
    origin: str
    """Where it is written, for whoever wonders why a finding is not reported."""

    def covers(self, finding: Finding) -> bool:
        """Return whether a finding of the mission is not to be reported."""
        is_here = self.item is None or self.item == finding.item
        return is_here and finding.code.startswith(self.codes)


@frozen
class Selection:
    """What is asked to be reported; as it stands, everything."""

    select: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings to report; empty: all."""
    extend_select: tuple[str, ...] = ()
    """Codes, or beginnings of codes, to report whatever ``select`` and ``ignore`` say."""
    ignore: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings not to report."""
    exemptions: tuple[Exemption, ...] = ()
    baseline: Baseline | None = None
    """Findings that are known already."""

    def asks_for(self, code: str) -> bool:
        """Return whether a rule that is off by default is selected."""
        return code.startswith((*self.select, *self.extend_select))

    def divide(
        self, findings: Iterable[Finding], *, file: str
    ) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
        """Return the findings to report and those not, each worst first, then by item.

        Parameters
        ----------
        findings : iterable of Finding
            Everything that was found about one mission.
        file : str
            The mission's file, as the baseline may know it.

        Returns
        -------
        reported, suppressed : tuple of Finding
            The second with the reason as their ``suppression``.
        """
        reported: list[Finding] = []
        suppressed: list[Finding] = []
        for finding in sorted(findings, key=lambda f: (-f.severity, f.item or 0, f.code)):
            reason = self.reason(finding, file=file)
            if reason is None:
                reported.append(finding)
            else:
                suppressed.append(replace(finding, suppression=reason))
        return tuple(reported), tuple(suppressed)

    def reason(self, finding: Finding, *, file: str) -> str | None:
        """Return why a finding is not to be reported; ``None`` where it is."""
        code = finding.code
        if not code.startswith(self.extend_select):
            if self.select and not code.startswith(self.select):
                return f"not among the selected codes {', '.join(self.select)}"
            for start in self.ignore:
                if code.startswith(start):
                    return f"ignored as {start}"
        for exemption in self.exemptions:
            if exemption.covers(finding):
                return f"ignored by {exemption.origin}"
        if self.baseline is not None and self.baseline.holds(finding, file=file):
            return f"known from {self.baseline.source}"
        return None
