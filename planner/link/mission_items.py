"""Between the items on the line and the items of a mission."""

from __future__ import annotations

import math
import struct
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.link.mission_transfer import MissionKind, WireItem
from planner.mission.commands import (
    UNSET_YAW,
    Command,
    Frame,
    command_name,
    load_command_table,
)
from planner.mission.formats.fence_items import (
    fence_items,
    make_fence,
    make_rally_points,
    rally_items,
)
from planner.mission.items import (
    MOST_ITEMS,
    Home,
    Mission,
    MissionFormat,
    MissionItem,
    numbered_in_order,
)
from planner.mission.vehicle_kind import tell_vehicle
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.vehicle import VehicleIdentity

_FRAMES = {
    Frame.GLOBAL_INT: Frame.GLOBAL,
    Frame.GLOBAL_RELATIVE_ALT_INT: Frame.GLOBAL_RELATIVE_ALT,
    Frame.GLOBAL_TERRAIN_ALT_INT: Frame.GLOBAL_TERRAIN_ALT,
}
"""Frames that mean the same: files have the second of each pair."""
_SCALE = 1e7
"""Degrees in MISSION_ITEM_INT."""
_NO_PLACE = frozenset({2**31 - 1, -(2**31)})
"""What a value that is not a number becomes as a 32-bit one."""


def mission_of_lists(
    lists: Mapping[MissionKind, tuple[WireItem, ...] | None],
    identity: VehicleIdentity,
    *,
    home: Home | None,
    source: str,
) -> Mission:
    """Return the mission that a vehicle's lists hold.

    Parameters
    ----------
    lists : mapping of MissionKind to tuple of WireItem or None
        As they came; a list that the vehicle does not know is ``None``.
    identity : VehicleIdentity
        Whose they are.
    home : Home or None
        As the vehicle has it; where it is not known, ArduPilot's first item is.
    source : str
        What messages call the mission.
    """
    rows = lists.get(MissionKind.MISSION) or ()
    if identity.has_home_slot and rows:
        home = home or _home(rows[0])
        rows = rows[1:]
    items = tuple(
        read_item(row, identity=identity, number=number) for number, row in enumerate(rows, 1)
    )
    altitude_m = None if home is None else home.altitude_amsl_m
    fence_rows = lists.get(MissionKind.FENCE) or ()
    fence, about_fence = make_fence([read_item(row, identity=identity) for row in fence_rows])
    rally, about_rally = make_rally_points(
        [read_item(row, identity=identity) for row in lists.get(MissionKind.RALLY) or ()],
        home_altitude_amsl_m=altitude_m,
    )
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=items,
        home=home,
        autopilot=identity.autopilot,
        vehicle=tell_vehicle(
            items, vehicle_type=identity.vehicle_type, home_altitude_amsl_m=altitude_m
        ),
        fence=fence,
        rally=rally,
        findings=(*about_fence, *about_rally),
    )


def lists_of_mission(
    mission: Mission, identity: VehicleIdentity, *, home_slot: WireItem | None = None
) -> dict[MissionKind, tuple[WireItem, ...]]:
    """Return the lists that a vehicle is sent for a mission.

    Parameters
    ----------
    mission : Mission
        Its items are numbered anew.
    identity : VehicleIdentity
        Whose they will be.
    home_slot : WireItem, optional
        What ArduPilot has in its first place, which it puts its own home into whatever is sent.

    Raises
    ------
    UsageError
        If an item cannot be sent as it is.
    """
    rows = [
        wire_item(item, identity=identity, number=number)
        for number, item in enumerate(numbered_in_order(mission.items), 1)
    ]
    if identity.has_home_slot:
        rows.insert(0, home_slot or _home_row(mission.home))
    if len(rows) > MOST_ITEMS:
        msg = f"{len(rows)} items cannot be sent: MAVLink counts to {MOST_ITEMS}"
        raise UsageError(msg)
    fence = () if mission.fence is None else fence_items(mission.fence)
    return {
        MissionKind.MISSION: tuple(rows),
        MissionKind.FENCE: tuple(wire_item(item, identity=identity) for item in fence),
        MissionKind.RALLY: tuple(
            wire_item(item, identity=identity) for item in rally_items(mission.rally)
        ),
    }


def read_item(
    row: WireItem, *, identity: VehicleIdentity, number: int | None = None
) -> MissionItem:
    """Return a mission's item for one of the line.

    Parameters
    ----------
    row : WireItem
        As it came.
    identity : VehicleIdentity
        Whose it is: PX4 counts the targets of jumps from 0.
    number : int, optional
        Its number, from 1, where it is flown.
    """
    param1 = shortest(row.param1)
    if row.command == Command.DO_JUMP and param1 is not None and not identity.has_home_slot:
        param1 += 1.0
    divisor = _SCALE if _is_scaled(row.command, row.frame) else 1.0
    latitude, longitude = (
        None if value in _NO_PLACE else value / divisor for value in (row.x, row.y)
    )
    return MissionItem(
        command=row.command,
        frame=_plain_frame(row.frame),
        param1=param1,
        param2=shortest(row.param2),
        param3=shortest(row.param3),
        param4=shortest(row.param4),
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=shortest(row.z),
        autocontinue=bool(row.autocontinue),
        jump_id=number,
    )


def wire_item(
    item: MissionItem, *, identity: VehicleIdentity, number: int | None = None
) -> WireItem:
    """Return an item as it goes over the line.

    Parameters
    ----------
    item : MissionItem
        Numbered in order: a jump names the number of an item.
    identity : VehicleIdentity
        Whose it will be: ArduPilot takes 0 where a value is not specified.
    number : int, optional
        Its number, for messages.

    Raises
    ------
    UsageError
        If it has no place, or one that no number stands for.
    """
    what = f"item {number} ({command_name(item.command)})" if number else "an area's item"
    is_ardupilot = identity.autopilot is Autopilot.ARDUPILOT
    param1 = item.param1
    if item.command == Command.DO_JUMP and param1 is not None and not identity.has_home_slot:
        param1 -= 1.0
    unset_yaw = math.nan if not is_ardupilot or item.command in UNSET_YAW else 0.0
    unset = 0.0 if is_ardupilot else math.nan
    is_scaled = _is_scaled(item.command, item.frame)
    place: list[int] = []
    for value in (item.latitude_deg, item.longitude_deg):
        if value is None and is_scaled and not is_ardupilot:
            msg = f"{what} has no place: PX4 would take it to be at 0°, 0°"
            raise UsageError(msg)
        scaled = round((value or 0.0) * (_SCALE if is_scaled else 1.0))
        if not -(2**31) <= scaled < 2**31:
            msg = f"{what} cannot be sent: {value} does not fit into MISSION_ITEM_INT"
            raise UsageError(msg)
        place.append(scaled)
    if item.altitude_m is None and is_scaled:
        msg = f"{what} has no altitude: open the plan in QGroundControl with terrain, and save it"
        raise UsageError(msg)
    return WireItem(
        frame=item.frame,
        command=item.command,
        param1=single(unset if param1 is None else param1),
        param2=single(unset if item.param2 is None else item.param2),
        param3=single(unset if item.param3 is None else item.param3),
        param4=single(unset_yaw if item.param4 is None else item.param4),
        x=place[0],
        y=place[1],
        z=single(unset if item.altitude_m is None else item.altitude_m),
        autocontinue=int(item.autocontinue),
    )


def single(value: float) -> float:
    """Return what is left of a number in the four bytes that MAVLink has for it."""
    try:
        return float(struct.unpack("<f", struct.pack("<f", value))[0])
    except OverflowError:
        return math.copysign(math.inf, value)


def shortest(value: float) -> float | None:
    """Return the number with the fewest digits that four bytes hold as this one: 2.1 for 2.0999999.

    Parameters
    ----------
    value : float
        Out of four bytes.

    Returns
    -------
    float or None
        ``None`` where it is no number.
    """
    if not math.isfinite(value):
        return None
    for digits in range(6, 10):
        short = float(f"{value:.{digits}g}")
        if single(short) == value:
            return short
    return value


def _is_scaled(command: int, frame: int) -> bool:
    """Return whether the fifth and sixth parameter are degrees times 10⁷.

    In the frame without a place, and in commands without one, they stand as they are.
    """
    if frame == Frame.MISSION:
        return False
    definition = load_command_table().commands.get(command)
    return definition is None or definition.has_location


def _plain_frame(frame: int) -> int:
    return int(_FRAMES[Frame(frame)]) if frame in set(_FRAMES) else frame


def _home(row: WireItem) -> Home | None:
    """Return the home of ArduPilot's first item; 0, 0 is how it says that it has none yet."""
    if row.x == 0 and row.y == 0:
        return None
    return Home(
        latitude_deg=row.x / _SCALE, longitude_deg=row.y / _SCALE, altitude_amsl_m=shortest(row.z)
    )


def _home_row(home: Home | None) -> WireItem:
    """Return what stands in the first place until ArduPilot puts its own home there."""
    nowhere = WireItem(
        frame=0,
        command=int(Command.NAV_WAYPOINT),
        param1=0.0,
        param2=0.0,
        param3=0.0,
        param4=0.0,
        x=0,
        y=0,
        z=0.0,
    )
    if home is None:
        return nowhere
    return replace(
        nowhere,
        x=round(home.latitude_deg * _SCALE),
        y=round(home.longitude_deg * _SCALE),
        z=single(home.altitude_amsl_m or 0.0),
    )
