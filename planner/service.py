"""The use cases, called alike by the command line, the terminal UI and scripts."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Literal

from planner.findings import Severity
from planner.flight.conditions import Conditions

if TYPE_CHECKING:
    from pathlib import Path

    from planner.autopilot import Autopilot
    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, ReturnBudget, Totals
    from planner.flight.segment import ItemArrival, Segment
    from planner.vehicle.battery import Battery

Verdict = Literal["go", "no-go"]

DEFAULT_VEHICLE = "falkowski-2023-quadrotor"
"""The article's quadrotor, which flies where no vehicle is named."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckRequest:
    """What a mission file is checked against."""

    vehicle: str = DEFAULT_VEHICLE
    """Name of a shipped model, or path of a model file."""
    autopilot: Autopilot | None = None
    """``None``: the model's own way of commanding."""
    parameters: Path | None = None
    """Autopilot parameter file."""
    battery: Battery | None = None
    """``None``: the model's own."""
    charge: float = 1.0
    """State of charge at the start, 0 to 1. [-]"""
    reserve: float = 0.2
    """Share of the capacity that stays in the battery. [-]"""
    conditions: Conditions = field(default_factory=Conditions)
    select: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings to report; empty: all."""
    ignore: tuple[str, ...] = ()
    """Codes, or beginnings of codes, of the findings not to report."""
    fail_on: Severity = Severity.ERROR
    """From which severity on a finding makes the mission a no-go."""


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


@dataclass(frozen=True, slots=True, kw_only=True)
class UnreadableMission:
    """A mission file about which nothing can be said but why; never a go."""

    file: str
    findings: tuple[Finding, ...]
    """X901 file-unreadable."""
    verdict: Literal["no-go"] = "no-go"
