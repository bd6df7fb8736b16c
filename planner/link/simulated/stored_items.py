"""What PX4 and ArduPilot make of an item that is uploaded, and which ones they refuse."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.link.mission_kind import MissionKind, MissionResult
from planner.mission.ardupilot_storage import stored_hold_s, stored_radius_m, stored_turns
from planner.mission.command_support import Support, support
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    UNSET_YAW,
    Command,
    Frame,
    has_location,
)
from planner.mission.fence_items import FENCE_COMMANDS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.mission_transfer import WireItem
    from planner.vehicle.parameters.table import Version

_LONGEST_HOLD_S = 65_535.0
_PX4_FRAMES = (
    (AMSL_FRAMES, Frame.GLOBAL_INT),
    (RELATIVE_FRAMES, Frame.GLOBAL_RELATIVE_ALT_INT),
)
"""PX4 sends MISSION_ITEM_INT in the frames that are named after it."""
_ARDUPILOT_FRAMES = (
    (AMSL_FRAMES, Frame.GLOBAL),
    (RELATIVE_FRAMES, Frame.GLOBAL_RELATIVE_ALT),
    (TERRAIN_FRAMES, Frame.GLOBAL_TERRAIN_ALT),
)
_CENTIMETRES = 100.0
"""ArduPilot keeps altitudes as whole centimetres."""


_PARAMETERS = ("param1", "param2", "param3", "param4")
_PX4_PARAMETERS: Mapping[int, tuple[str, ...]] = {
    Command.NAV_WAYPOINT: ("param1", "param2", "param4"),
    Command.NAV_LOITER_UNLIM: ("param3", "param4"),
    Command.NAV_LOITER_TIME: _PARAMETERS,
    Command.NAV_LAND: ("param2", "param4"),
    Command.NAV_TAKEOFF: ("param4",),
    Command.NAV_LOITER_TO_ALT: ("param1", "param2", "param4"),
    Command.NAV_VTOL_TAKEOFF: ("param4",),
    Command.NAV_VTOL_LAND: ("param4",),
    **dict.fromkeys(FENCE_COMMANDS, ("param1",)),
}
"""By command of a place, the parameters that come back (format_mavlink_mission_item)."""
_PX4_FLAGS: Mapping[int, tuple[str, ...]] = {
    Command.NAV_LOITER_TIME: ("param2", "param4"),
    Command.NAV_LOITER_TO_ALT: ("param1", "param4"),
}
"""Parameters that PX4 keeps as yes or no."""


def refusal(
    item: WireItem, kind: MissionKind, autopilot: Autopilot, version: Version
) -> MissionResult | None:
    """Return with what an autopilot refuses an item at upload; ``None`` if it takes it."""
    if autopilot is Autopilot.ARDUPILOT and (wrong := _no_number(item)) is not None:
        return wrong
    if kind is MissionKind.FENCE:
        return None if item.command in FENCE_COMMANDS else MissionResult.UNSUPPORTED
    if kind is MissionKind.RALLY:
        if item.command != Command.NAV_RALLY_POINT:
            return MissionResult.UNSUPPORTED
        is_taken = autopilot is Autopilot.PX4 or item.frame in RELATIVE_FRAMES  # above home alone
        return None if is_taken else MissionResult.UNSUPPORTED_FRAME
    is_place = has_location(item.command)
    if autopilot is Autopilot.PX4 and is_place and item.frame in TERRAIN_FRAMES:
        return MissionResult.UNSUPPORTED_FRAME
    known = support(item.command, autopilot, frame=item.frame, version=version)
    return MissionResult.UNSUPPORTED if known is Support.REFUSED else None


def _no_number(item: WireItem) -> MissionResult | None:
    """Return which value of an item is no number, as ArduPilot minds (sanity_check_params)."""
    values = {
        MissionResult.INVALID_PARAM1: item.param1,
        MissionResult.INVALID_PARAM2: item.param2,
        MissionResult.INVALID_PARAM3: item.param3,
        MissionResult.INVALID_PARAM4: 0.0 if item.command in UNSET_YAW else item.param4,
        MissionResult.INVALID_PARAM7: item.z,
    }
    return next((wrong for wrong, value in values.items() if not math.isfinite(value)), None)


def stored_item(item: WireItem, kind: MissionKind, autopilot: Autopilot) -> WireItem:
    """Return an item as the vehicle sends it back."""
    if autopilot is Autopilot.PX4:
        return _stored_by_px4(item, kind)
    if kind is not MissionKind.MISSION:
        return _stored_area(item, kind)
    item = replace(_with_frame(item, _ARDUPILOT_FRAMES), autocontinue=1)
    if has_location(item.command):
        item = replace(item, z=int(item.z * _CENTIMETRES) / _CENTIMETRES)
    match item.command:
        case Command.NAV_WAYPOINT | Command.NAV_LOITER_TIME:
            hold_s = stored_hold_s(min(max(item.param1, 0.0), _LONGEST_HOLD_S))
            return replace(item, param1=hold_s, param2=0.0, param3=0.0, param4=0.0)
        case Command.NAV_LOITER_TURNS if item.param1 > 0.0:
            return replace(
                item, param1=stored_turns(item.param1), param3=stored_radius_m(item.param3)
            )
    return item


def _stored_area(item: WireItem, kind: MissionKind) -> WireItem:
    """Return what ArduPilot keeps of a fence's item or a rally point (MissionItemProtocol_*)."""
    kept = replace(item, param1=0.0, param2=0.0, param3=0.0, param4=0.0, autocontinue=0)
    if kind is MissionKind.FENCE:
        return replace(kept, frame=int(Frame.GLOBAL), param1=item.param1, z=0.0)
    return replace(kept, frame=int(Frame.GLOBAL_RELATIVE_ALT), z=float(int(item.z)))


def _stored_by_px4(item: WireItem, kind: MissionKind) -> WireItem:
    """Return what PX4 keeps: of an item with a place, what it knows of its command alone."""
    item = _with_frame(item, _PX4_FRAMES)
    if item.frame == Frame.MISSION:
        return item
    if kind is MissionKind.FENCE:
        item = replace(item, frame=int(Frame.GLOBAL_INT), autocontinue=0)
    known = _PX4_PARAMETERS.get(item.command, ())
    kept: dict[str, Any] = {
        name: getattr(item, name) if name in known else 0.0 for name in _PARAMETERS
    }
    for name in _PX4_FLAGS.get(item.command, ()):
        kept[name] = float(kept[name] > 0.0)
    if item.command in UNSET_YAW and "param4" in known:
        kept["param4"] = kept["param4"] % 360.0  # NaN stays what it is
    return replace(item, **kept)


def _with_frame(item: WireItem, frames: tuple[tuple[frozenset[Frame], Frame], ...]) -> WireItem:
    for same, frame in frames:
        if item.frame in same:
            return replace(item, frame=int(frame))
    return item
