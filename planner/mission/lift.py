"""A mission flown higher: every height above home that it leads to raised by the same."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.mission.commands import RELATIVE_FRAMES, Command, frame_name
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem

_RAISED = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_SPLINE_WAYPOINT, Command.NAV_ARC_WAYPOINT),
        *(Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TURNS, Command.NAV_LOITER_TIME),
        *(Command.NAV_LOITER_TO_ALT, Command.NAV_TAKEOFF),
    }
)
"""Landings stay where they are, and so does what a camera looks at."""


def raised_items(mission: Mission) -> list[MissionItem]:
    """Return the items that lead to a height above home; 0 is the height there is, to ArduPilot."""
    return [item for item in mission.items if _is_raised(item)]


def highest_m(mission: Mission) -> float:
    """Return the greatest height above home that a mission leads to; 0 where it names none. [m]"""
    return max((item.altitude_m or 0.0 for item in raised_items(mission)), default=0.0)


def why_not_lifted(mission: Mission) -> str:
    """Return why a mission cannot be flown higher by raising its heights above home; empty: it can."""
    for number, item in enumerate(mission.items, 1):
        if item.command == Command.DO_SET_HOME:
            return f"item {number} moves the home that heights are above"
        if item.command in _RAISED and item.unresolved_agl_m is not None:
            return f"item {number} has a height above the ground that nobody has worked out"
        is_led = item.command in _RAISED and item.altitude_m is not None
        if is_led and item.frame not in RELATIVE_FRAMES:
            return f"item {number} is in {frame_name(item.frame)}, not above home"
    return "" if raised_items(mission) else "none of its items has a height above home"


def lifted(mission: Mission, by_m: float) -> Mission:
    """Return a mission whose heights above home are all so much greater."""
    return replace(
        mission,
        items=tuple(
            replace(item, altitude_m=item.altitude_m + by_m)
            if _is_raised(item) and item.altitude_m is not None
            else item
            for item in mission.items
        ),
    )


def _is_raised(item: MissionItem) -> bool:
    return item.command in _RAISED and item.frame in RELATIVE_FRAMES and bool(item.altitude_m)
