"""What the check of a mission has to say."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

from planner.findings import Severity
from planner.selection import Selection
from planner.values import Value, field

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, Totals
    from planner.flight.conditions import Conditions
    from planner.flight.prediction import (
        ItemArrival,
        Segment,
        Trace,
    )
    from planner.flight.returns.tightest import ReturnPlan
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.resolve import FlightParameters


Verdict = Literal["go", "no-go"]


class CheckResult(Value):
    """Everything the check of one mission has to say."""

    file: str
    verdict: Verdict
    vehicle_name: str
    vehicle_source: str
    conditions: Conditions
    totals: Totals
    battery: BatteryBudget | None
    return_plan: ReturnPlan | None
    segments: Sequence[Segment]
    items: tuple[ItemArrival, ...]
    findings: tuple[Finding, ...]
    """Worst first, then by item."""
    suppressed: tuple[Finding, ...] = ()
    """Findings kept out of the report and of the verdict, each with the reason."""
    fail_on: Severity = Severity.ERROR
    """From which severity on a finding made the mission a no-go."""
    parameters: FlightParameters | None = None
    """What the autopilot was taken to fly with, each value with its origin."""
    trace: Trace | None = None
    """The flight sampled over time, where it was asked for and something is flown."""
    assessment: Assessment | None = None
    """Everything the rules looked at, for pictures; ``None`` where nothing is flown."""
    selection: Selection = field(default_factory=Selection)
    """Which findings were asked for, for whatever is found about several missions together."""


class UnreadableMission(Value):
    """A mission file about which nothing can be said but why; never a go."""

    file: str
    findings: tuple[Finding, ...]
    """X901 file-unreadable."""
    verdict: Literal["no-go"] = "no-go"
    suppressed: tuple[Finding, ...] = ()
    """Nothing ever is: that a file cannot be read is always told."""
