"""The use cases, called alike by the command line, the terminal UI and scripts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, ReturnBudget, Totals
    from planner.flight.conditions import Conditions
    from planner.flight.segment import ItemArrival, Segment

Verdict = Literal["go", "no-go"]


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckResult:
    """Everything the check of one mission has to say."""

    file: str
    verdict: Verdict
    vehicle_name: str
    vehicle_source: str
    conditions: Conditions
    totals: Totals
    battery: BatteryBudget | None
    way_home: ReturnBudget | None
    segments: tuple[Segment, ...]
    items: tuple[ItemArrival, ...]
    findings: tuple[Finding, ...]
    """Worst first, then by item."""
