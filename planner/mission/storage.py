"""What ArduPilot's storage of missions keeps of the numbers of items, in 16 bits each (``AP_Mission``)."""

from __future__ import annotations

from ctypes import c_float
from typing import TYPE_CHECKING

from planner.mission.commands import Command

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.mission.items import MissionItem

LONGEST_STORED_HOLD_S = 65_535.0

_MOST = 255
_COARSE_M = 10
_FRACTIONS = 256
_OVER_PLACES: Mapping[int, slice] = {
    Command.NAV_DELAY: slice(1, 4),
    Command.NAV_SET_YAW_SPEED: slice(1, 3),
    Command.NAV_ALTITUDE_WAIT: slice(1, 3),
}
"""Parameters of items without a place that lie where others have altitude, latitude and longitude."""
_ABOVE_TERRAIN_BIT = 4


def stored_hold_s(hold_s: float) -> float:
    """Return the hold that ArduPilot keeps: whole seconds. [s]"""
    return float(int(hold_s))


def stored_turns(turns: float) -> float:
    """Return the turns of a circle that ArduPilot keeps: whole ones, or a part of one. [-]"""
    if turns < 1.0:
        return int(turns * _FRACTIONS) / _FRACTIONS
    return float(min(int(turns), _MOST))


def stored_radius_m(radius_m: float) -> float:
    """Return the radius of a circle that ArduPilot keeps: whole metres, or tens of them. [m]"""
    size_m = abs(radius_m)
    kept_m = int(size_m) if size_m <= _MOST else min(int(size_m) // _COARSE_M, _MOST) * _COARSE_M
    return float(-kept_m if radius_m < 0.0 else kept_m)


def reads_as_place(item: MissionItem, *, above_terrain: bool) -> bool:
    """Return whether an item without a place has one to an item right before, above terrain or not.

    Notes
    -----
    ``AP_Mission::Content`` is a union: hour, minute and second of a delay are the altitude of a ``Location``,
    the lowest byte of its seconds that one's flags.  Flown with 1.3 s, whose byte says above terrain and not
    relative: ArduCopter stops with an error (``Location::get_alt_frame``), in SITL for good.
    """
    over = _OVER_PLACES.get(item.command)
    if over is None:
        return False
    flags = bytes(c_float(item.param1 or 0.0))[0]
    return bool(flags & _ABOVE_TERRAIN_BIT) or (any(item.parameters[over]) and not above_terrain)
