"""A mission as ``QGC WPL 110`` text: the rows that every ground station reads.

The first row is home, then each item has the row of its number.  The format has one list in a
file: fence and rally rows among the items of a mission make autopilots refuse the upload, so they
are written only where there is no mission, as MAVProxy and Mission Planner save them.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.mission.commands import UNSET_YAW, Command, Frame, load_command_table
from planner.mission.fence_items import fence_items, rally_items
from planner.mission.jump_numbers import numbered_in_order
from planner.mission.wpl import HEADER

if TYPE_CHECKING:
    from planner.mission.items import Home, Mission, MissionItem

_Values = tuple[float | None, float | None, float | None]


def wpl_text(mission: Mission) -> str:
    """Return a mission as the text of a ``QGC WPL 110`` file.

    Parameters
    ----------
    mission : Mission
        Its items are numbered anew.  Where it has none, its fence is written, and where it has no
        fence either, its rally points; with items neither is.

    Returns
    -------
    str
        Twelve fields between tabs in each row, numbers in the fewest digits that read back the
        same, ``nan`` where a value is not specified, but see `written_items`.
    """
    if mission.items or not (mission.fence or mission.rally):
        rows = [_home_row(mission.home), *map(_item_row, written_items(mission))]
    else:
        rows = [] if mission.home is None else [_home_row(mission.home)]
        areas = fence_items(mission.fence) if mission.fence else rally_items(mission.rally)
        rows += map(_item_row, areas)
    numbered = [f"{number}\t{int(number == 0)}\t{row}\n" for number, row in enumerate(rows)]
    return "".join([f"{HEADER}\n", *numbered])


def with_unused_position_zero(item: MissionItem) -> MissionItem:
    """Return an item whose unset position values are 0 where its command has no use for them.

    Loaders turn the position into whole numbers, which know no NaN: MAVSDK's makes −214.7° of it,
    pymavlink's fails.  0 says the same there, and does neither.
    """
    definition = load_command_table().commands.get(item.command)
    if definition is None or definition.has_location:
        return item
    values = (item.latitude_deg, item.longitude_deg, item.altitude_m)
    latitude_deg, longitude_deg, altitude_m = (
        0.0 if value is None and not name else value
        for value, name in zip(values, definition.parameters[4:], strict=True)
    )
    return replace(
        item, latitude_deg=latitude_deg, longitude_deg=longitude_deg, altitude_m=altitude_m
    )


def written_items(mission: Mission) -> tuple[MissionItem, ...]:
    """Return the items of a mission as they are written: numbered anew, 0 where that says the same.

    ArduPilot has no use for the heading of `UNSET_YAW`, and Mission Planner leaves out rows that
    hold ``nan``: of a mission for ArduPilot it is 0.
    """
    items = map(with_unused_position_zero, numbered_in_order(mission.items))
    if mission.autopilot is not Autopilot.ARDUPILOT:
        return tuple(items)
    return tuple(
        replace(item, param4=0.0) if item.param4 is None and item.command in UNSET_YAW else item
        for item in items
    )


def _home_row(home: Home | None) -> str:
    """Return the row of home; 0, 0 is how ground stations write that they know none."""
    if home is None:
        return _row(Command.NAV_WAYPOINT, Frame.GLOBAL, position=(0.0, 0.0, 0.0))
    place = (home.latitude_deg, home.longitude_deg)
    if home.altitude_amsl_m is None:
        return _row(Command.NAV_WAYPOINT, Frame.GLOBAL_RELATIVE_ALT, position=(*place, 0.0))
    return _row(Command.NAV_WAYPOINT, Frame.GLOBAL, position=(*place, home.altitude_amsl_m))


def _item_row(item: MissionItem) -> str:
    return _row(
        item.command,
        item.frame,
        item.param1,
        item.param2,
        item.param3,
        item.param4,
        position=(item.latitude_deg, item.longitude_deg, item.altitude_m),
        autocontinue=item.autocontinue,
    )


def _row(
    command: int,
    frame: int,
    *parameters: float | None,
    position: _Values,
    autocontinue: bool = True,
) -> str:
    """Return a row after its first two fields; parameters that are not given are 0."""
    values = (*parameters, *(0.0,) * (4 - len(parameters)), *position)
    fields = [str(int(frame)), str(int(command)), *map(_number, values), str(int(autocontinue))]
    return "\t".join(fields)


def _number(value: float | None) -> str:
    return "nan" if value is None else repr(value).removesuffix(".0")
