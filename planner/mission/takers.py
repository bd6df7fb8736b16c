"""Which autopilots take a mission that is uploaded: they alone may fly it where nobody says who does."""

from __future__ import annotations

from functools import cache
from operator import attrgetter
from typing import TYPE_CHECKING

from planner.autopilot import TARGETS_SHOWN, Autopilot
from planner.mission.commands import (
    NEEDS_ALTITUDE,
    ROIS_BY_MODE,
    Command,
    Support,
    px4_takes_roi,
    support,
)
from planner.mission.items import MissionFormat

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.mission.items import Mission, MissionItem

NAME_IT = f"name who flies it (--target {' or '.join(TARGETS_SHOWN)}, or --params)"
"""What to do where the autopilots do not agree."""
BOTH = (Autopilot.PX4, Autopilot.ARDUPILOT)
_MAY_BE_UNSET: Mapping[int, frozenset[int]] = {
    Command.NAV_WAYPOINT: frozenset({4}),
    Command.NAV_LOITER_UNLIM: frozenset({4}),
    Command.NAV_LAND: frozenset({4}),
    Command.NAV_TAKEOFF: frozenset({4}),
    Command.NAV_ARC_WAYPOINT: frozenset({2, 3, 4}),
    Command.NAV_VTOL_TAKEOFF: frozenset({4}),
    Command.NAV_VTOL_LAND: frozenset({3, 4}),
}
"""Parameters that ArduPilot takes as NaN (AP_Mission.cpp, ``sanity_check_params``)."""


def may_fly(mission: Mission, named: Autopilot | None) -> frozenset[Autopilot]:
    """Return who may fly a mission: who is named, else PX4 and ArduPilot, but whoever refuses the upload.

    That shows at the desk, and the other one flies it.  None of another maker's files, which neither loads.
    """
    if named is not None:
        return frozenset({named})
    if mission.file_format is MissionFormat.FOREIGN:
        return frozenset()
    return frozenset(one for one in BOTH if _is_taken(mission, one))


def unless_named(message: str, able: frozenset[Autopilot]) -> str:
    """Return what one autopilot does, and what to do where another may be meant."""
    return f"{message}; {NAME_IT}" if len(able) > 1 else message


def _is_taken(mission: Mission, autopilot: Autopilot) -> bool:
    asked = {(item.command, item.frame) for item in mission.items}
    refusals = (support(command, autopilot, frame=frame) for command, frame in asked)
    if Support.REFUSED in refusals:
        return False
    if autopilot is Autopilot.ARDUPILOT:
        return all(unset_value(item) is None for item in mission.items)
    rois = mission.numbered(*ROIS_BY_MODE)
    return all(px4_takes_roi(item.param1, item.frame) for _, item in rois)


def unset_value(item: MissionItem) -> str | None:
    """Return the first value that ArduPilot refuses an item without, where it is not a number."""
    values = _wanted_values(item.command)(item)
    return [*_wanted(item.command).values()][values.index(None)] if None in values else None


def _wanted(command: int) -> dict[str, str]:
    """Return which values of a command may not be NaN, and what they are called."""
    wanted = {
        f"param{n}": f"parameter {n}"
        for n in range(1, 5)
        if n not in _MAY_BE_UNSET.get(command, ())
    }
    return wanted | ({"altitude_m": "the altitude"} if command in NEEDS_ALTITUDE else {})


@cache
def _wanted_values(command: int) -> Callable[[MissionItem], tuple[float | None, ...]]:
    """Return what takes those values from an item."""
    return attrgetter(*_wanted(command))
