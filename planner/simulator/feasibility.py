"""What PX4 says against a mission after it has taken it (FeasibilityChecker.cpp, in part)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.mission.commands import Command, Support, support
from planner.simulator.parameters import parameter_values
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.link.mission_transfer import WireItem
    from planner.simulator.setup import VehicleSetup


_TAKEOFF, _LANDING, _BOTH, _BOTH_OR_NONE = 1, 2, 3, 4
"""MIS_TKO_LAND_REQ."""
_LANDINGS = frozenset({Command.NAV_LAND})
"""A return is none."""


class Rejection(Value):
    """Why a vehicle will not fly a mission."""

    text: str
    """As its text says it; empty where only an event does."""
    event: str = ""
    """Name of the event that says it; empty where none does."""
    item: int | None = None
    """What the event is about, from 1."""


def rejection(items: Sequence[WireItem], setup: VehicleSetup) -> Rejection | None:
    """Return why a vehicle will not fly the mission it holds; ``None`` where it will.

    ArduPilot says nothing at this time: it looks at its mission when it arms.
    """
    wrong = setup.misbehaviour
    if wrong.rejection or wrong.event:
        return Rejection(text=wrong.rejection, event=wrong.event)
    if setup.autopilot is not Autopilot.PX4 or not items:
        return None
    for number, item in enumerate(items, 1):
        known = support(item.command, setup.autopilot, frame=item.frame, version=setup.version[:2])
        if known is Support.BLOCKS_ARMING:
            text = f"Mission rejected: item {number}: unsupported cmd: {item.command}"
            return Rejection(text=text, event="navigator_mis_unsup_cmd", item=number)
    return _missing(items, int(parameter_values(setup.parameters).get("MIS_TKO_LAND_REQ", 0)))


def _missing(items: Sequence[WireItem], required: int) -> Rejection | None:
    """Return what MIS_TKO_LAND_REQ asks for and the mission has not."""
    has_takeoff = any(item.command == Command.NAV_TAKEOFF for item in items)
    has_landing = any(item.command in _LANDINGS for item in items)
    text, event = "", ""
    if required == _TAKEOFF and not has_takeoff:
        text, event = "Takeoff waypoint required.", "takeoff_missing"
    elif required == _LANDING and not has_landing:
        text, event = "Landing waypoint/pattern required.", "land_missing"
    elif required == _BOTH and not (has_takeoff and has_landing):
        text, event = "Takeoff or Landing item missing.", "takeoff_or_land_missing"
    elif required == _BOTH_OR_NONE and has_takeoff and not has_landing:
        text, event = "Add Landing item or remove Takeoff.", "add_land_or_rm_to"
    elif required == _BOTH_OR_NONE and has_landing and not has_takeoff:
        text, event = "Add Takeoff item or remove Landing.", "add_to_or_rm_land"
    if not text:
        return None
    return Rejection(text=f"Mission rejected: {text}", event=f"navigator_mis_{event}")
