"""What a mission file is checked against."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Severity
from planner.flight.conditions import Conditions
from planner.selection import Selection
from planner.values import Value, field

if TYPE_CHECKING:
    from pathlib import Path

    from planner.autopilot import Autopilot, Target
    from planner.flight.budget import Reserve
    from planner.flight.conditions import Spread
    from planner.vehicle.battery import Battery


DEFAULT_VEHICLE = "falkowski-2023-quadrotor"
"""The article's quadrotor, which flies where no vehicle is named."""


class CheckRequest(Value):
    """What a mission file is checked against."""

    vehicle: str = DEFAULT_VEHICLE
    """Name of a shipped model, or path of a model file."""
    autopilot: Autopilot | None = None
    """``None``: the model's own way of commanding."""
    parameters: Path | None = None
    """Autopilot parameter file."""
    speed_m_s: float | None = None
    """Ground speed of every level leg; ``None``: as the mission commands. [m s⁻¹]"""
    target: Target | None = None
    """Version of the firmware whose rules count; ``None``: of the parameter file, else any."""
    terrain: tuple[Path, ...] = ()
    """Grids of ground heights; none: the ground is level with home."""
    clearance_m: float = 0.0
    """Height over the terrain that has to be kept. [m]"""
    profile: Path | None = None
    """What a site asks for."""
    battery: Battery | None = None
    """``None``: the model's own."""
    charge: float | Spread = 1.0
    """State of charge at the start, 0 to 1. [-]"""
    reserve: float | Reserve = 0.2
    """What stays in the battery; a number is a share of the capacity. [-]"""
    risk: float = 0.05
    """Chance of landing below the reserve above which it is told, 0 to 1. [-]"""
    conditions: Conditions = field(default_factory=Conditions)
    selection: Selection = field(default_factory=Selection)
    """Which findings are reported."""
    baseline: Path | None = None
    """File of the findings that are known already."""
    fail_on: Severity = Severity.ERROR
    """From which severity on a finding makes the mission a no-go."""
    with_trace: bool = False
    """Whether the result holds the flight sampled over time."""
