"""What PX4 says against a mission after it has taken it (FeasibilityChecker.cpp, in part)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.simulated.parameters import parameter_values
from planner.mission.command_support import Support, support
from planner.mission.commands import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.link.mission_transfer import WireItem
    from planner.link.simulated.setup import VehicleSetup

_TAKEOFF, _LANDING, _BOTH, _BOTH_OR_NONE = 1, 2, 3, 4
"""MIS_TKO_LAND_REQ."""
_LANDINGS = frozenset({Command.NAV_LAND, Command.NAV_RETURN_TO_LAUNCH})


def rejection(items: Sequence[WireItem], setup: VehicleSetup) -> str:
    """Return why a vehicle will not fly the mission it holds; empty where it will.

    ArduPilot says nothing at this time: it looks at its mission when it arms.
    """
    if setup.misbehaviour.rejection:
        return setup.misbehaviour.rejection
    if setup.autopilot is not Autopilot.PX4:
        return ""
    for number, item in enumerate(items, 1):
        known = support(item.command, setup.autopilot, frame=item.frame, version=setup.version[:2])
        if known is Support.BLOCKS_ARMING:
            return f"Mission rejected: item {number} not supported"
    return _missing(items, int(parameter_values(setup.parameters).get("MIS_TKO_LAND_REQ", 0)))


def _missing(items: Sequence[WireItem], required: int) -> str:
    """Return what MIS_TKO_LAND_REQ asks for and the mission has not."""
    has_takeoff = any(item.command == Command.NAV_TAKEOFF for item in items)
    has_landing = any(item.command in _LANDINGS for item in items)
    if required in {_TAKEOFF, _BOTH} and not has_takeoff:
        return "Mission rejected: takeoff waypoint required"
    if required in {_LANDING, _BOTH} and not has_landing:
        return "Mission rejected: landing waypoint required"
    if required == _BOTH_OR_NONE and has_takeoff is not has_landing:
        return "Mission rejected: takeoff or landing missing"
    return ""
