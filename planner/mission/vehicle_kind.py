"""For what kind of vehicle a mission was written: by the plan's own word, else by its commands."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    command_name,
    is_destination,
)
from planner.mission.items import VehicleEvidence, VehicleKind

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.mission.items import MissionItem

_TYPES: Mapping[int, tuple[VehicleKind, str]] = {
    1: (VehicleKind.FIXED_WING, "fixed wing"),
    2: (VehicleKind.MULTICOPTER, "quadrotor"),
    # Both autopilots fly a helicopter's mission as they fly a multicopter's; its power is another.
    3: (VehicleKind.HELICOPTER, "coaxial"),
    4: (VehicleKind.HELICOPTER, "helicopter"),
    10: (VehicleKind.ROVER, "ground rover"),
    11: (VehicleKind.BOAT, "surface boat"),
    12: (VehicleKind.SUBMARINE, "submarine"),
    13: (VehicleKind.MULTICOPTER, "hexarotor"),
    14: (VehicleKind.MULTICOPTER, "octorotor"),
    15: (VehicleKind.MULTICOPTER, "tricopter"),
    **dict.fromkeys(range(19, 26), (VehicleKind.VTOL, "VTOL")),
    29: (VehicleKind.MULTICOPTER, "dodecarotor"),
    35: (VehicleKind.MULTICOPTER, "decarotor"),
}
"""MAV_TYPE; what is not here and not 0 (generic) is another kind."""
_GENERIC = 0

_VTOL_ONLY = frozenset(
    {Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND, Command.DO_VTOL_TRANSITION}
)
_FIXED_WING_ONLY = frozenset(
    {
        Command.NAV_CONTINUE_AND_CHANGE_ALT,
        Command.NAV_ALTITUDE_WAIT,
        Command.DO_GO_AROUND,
        Command.DO_INVERTED_FLIGHT,
    }
)
_ROVER_ONLY = frozenset({Command.DO_SET_REVERSE, Command.NAV_SET_YAW_SPEED})

_LEAST_PITCH_DEG = 5.0
_MOST_PITCH_DEG = 45.0
_METRES_PER_DEGREE = 111_195.0
"""Of latitude on a sphere: near enough to recognise a landing approach."""
_SHORTEST_APPROACH_M = 50.0
"""From 5 m of height a plane that glides 1 in 10 needs as much; missions come in from 100 m and more."""
_SURVEY_TAKEOFF = (20.0, 30.0)
"""Pitch [°] and altitude [m] that Mission Planner's survey writes for every kind of vehicle."""


def vehicle_evidence(
    items: Sequence[MissionItem],
    *,
    vehicle_type: int | None = None,
    home_altitude_amsl_m: float | None = None,
) -> VehicleEvidence | None:
    """Return for what kind of vehicle a mission was written, and the evidence.

    A plan's MAV_TYPE wins over the commands unless it is 0 (generic).  The altitude of home distinguishes
    a dive from country below sea level [m AMSL].  ``None`` where there is no evidence: most missions of
    multicopters, and those of other vehicles that a multicopter could fly as well.

    A take-off pitch alone is no proof: QGroundControl wrote 15° into multicopter plans too (13 of
    47 such take-offs in public files), and Mission Planner's survey 20° into everything.  Neither
    is a circle or its radius.  DO_LAND_START alone is none either, ArduCopter knows it.
    """
    if vehicle_type is not None and vehicle_type != _GENERIC:
        kind, name = _TYPES.get(vehicle_type, (VehicleKind.OTHER, ""))
        reason = f"the file has vehicleType {vehicle_type}" + (f" ({name})" if name else "")
        may_be_flown = kind is VehicleKind.HELICOPTER
        return VehicleEvidence(
            kind=kind, is_certain=not may_be_flown, reason=reason, is_weak=may_be_flown
        )
    for commands, kind in (
        (_VTOL_ONLY, VehicleKind.VTOL),
        (_FIXED_WING_ONLY, VehicleKind.FIXED_WING),
        (_ROVER_ONLY, VehicleKind.ROVER),
    ):
        for number, item in enumerate(items, start=1):
            if item.command in commands:
                reason = f"item {number} is {command_name(item.command)}"
                return VehicleEvidence(kind=kind, is_certain=True, reason=reason)
    return _fixed_wing_evidence(items) or _altitude_evidence(items, home_altitude_amsl_m)


def _fixed_wing_evidence(items: Sequence[MissionItem]) -> VehicleEvidence | None:
    commands = [item.command for item in items]
    reasons: list[str] = []
    for number, item in enumerate(items, start=1):
        if (
            item.command == Command.NAV_TAKEOFF
            and item.param1 is not None
            and _LEAST_PITCH_DEG <= item.param1 <= _MOST_PITCH_DEG
            and (item.param1, item.altitude_m) != _SURVEY_TAKEOFF
        ):
            reasons.append(f"item {number} takes off with a pitch of {item.param1:g}°")
            break
    starts = [n for n, command in enumerate(commands, start=1) if command == Command.DO_LAND_START]
    approaches = bool(starts) and Command.NAV_LAND in commands[starts[0] :]
    if approaches:
        reasons.append(f"item {starts[0]} is DO_LAND_START before a NAV_LAND")
    is_certain = len(reasons) == 2
    if not reasons or (not is_certain and _comes_down_upright(items)):
        return None
    return VehicleEvidence(
        kind=VehicleKind.FIXED_WING,
        is_certain=is_certain,
        reason=" and ".join(reasons),
        is_weak=not approaches,
    )


def _comes_down_upright(items: Sequence[MissionItem]) -> bool:
    """Return whether a mission returns, or lands where no plane could come down from so near."""
    before: MissionItem | None = None
    for item in items:
        if item.command == Command.NAV_RETURN_TO_LAUNCH:
            return True
        if item.latitude_deg is None or item.longitude_deg is None:
            continue
        if item.command == Command.NAV_LAND and before is not None:
            north_deg = item.latitude_deg - (before.latitude_deg or 0.0)
            east_deg = item.longitude_deg - (before.longitude_deg or 0.0)
            east_deg *= math.cos(math.radians(item.latitude_deg))
            if math.hypot(north_deg, east_deg) * _METRES_PER_DEGREE < _SHORTEST_APPROACH_M:
                return True
        if is_destination(item.command):
            before = item
    return False


def _altitude_evidence(
    items: Sequence[MissionItem], home_altitude_amsl_m: float | None
) -> VehicleEvidence | None:
    """Return the evidence in altitudes that are all at or below the ground, with no take-off."""
    if any(item.command in TAKEOFFS for item in items):
        return None
    heights_m = [
        _height_m(item, home_altitude_amsl_m)
        for item in items
        if is_destination(item.command) and (item.latitude_deg or item.longitude_deg)
    ]
    known_m = [height for height in heights_m if height is not None]
    if len(known_m) < max(2, len(heights_m)) or max(known_m) > 0.0:
        return None
    if min(known_m) < 0.0:
        kind, where = VehicleKind.SUBMARINE, "at or below home's height"
    else:
        kind, where = VehicleKind.ROVER, "at height 0"
    reason = f"all {len(known_m)} places are {where} and there is no take-off"
    return VehicleEvidence(kind=kind, is_certain=True, reason=reason)


def _height_m(item: MissionItem, home_altitude_amsl_m: float | None) -> float | None:
    """Return an item's height above home or terrain, ``None`` where it is not known."""
    if item.altitude_m is None:
        return None
    if item.frame in RELATIVE_FRAMES | TERRAIN_FRAMES:
        return item.altitude_m
    # Files mix up AMSL and height above home too often to trust anything but the sea floor.
    if (
        item.frame in AMSL_FRAMES
        and home_altitude_amsl_m is not None
        and item.altitude_m < min(0.0, home_altitude_amsl_m)
    ):
        return item.altitude_m - home_altitude_amsl_m
    return None
