"""The mission of a ULog: items as they were begun, changes of speed as they were flown."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.logs.record import LoggedItem

if TYPE_CHECKING:
    from planner.logs.ulog_topics import Topic

_RELATIVE_FRAME, _AMSL_FRAME, _MISSION_FRAME = 3, 0, 2
_CHANGE_SPEED = 178
"""MAV_CMD_DO_CHANGE_SPEED."""
_SPEED = "current.cruising_speed"
_SETTLED_S = 0.5
"""A setpoint follows its item within this time. [s]"""


def missions_flown(
    items: Topic | None, setpoints: Topic | None
) -> tuple[tuple[float, tuple[LoggedItem, ...]], ...]:
    """Return the mission as far as it was flown.

    PX4 logs an item with a place when it begins it, and the speed it then flies by: a number left
    out before an item from which on another speed is flown was a change of speed.

    Parameters
    ----------
    items : Topic, optional
        ``navigator_mission_item``.
    setpoints : Topic, optional
        ``position_setpoint_triplet``.

    Returns
    -------
    tuple
        Time and items of the only mission; empty where none is logged.
    """
    needed = ("sequence_current", "nav_cmd", "latitude", "longitude", "altitude")
    if items is None or not set(needed) <= items.fields.keys():
        return ()
    found: dict[int, LoggedItem] = {}
    begun_s: dict[int, float] = {}
    for row, time_s in enumerate(items.time_s.tolist()):
        sequence = int(items.fields["sequence_current"][row])
        begun_s.setdefault(sequence, time_s)
        found.setdefault(sequence, _item(items, row, sequence))
    if setpoints is not None and _SPEED in setpoints.fields:
        found |= _speed_changes(begun_s, setpoints)
    return ((float(items.time_s[0]), tuple(found[number] for number in sorted(found))),)


def _item(items: Topic, row: int, sequence: int) -> LoggedItem:
    latitude, longitude, altitude = (
        value if np.isfinite(value) else None
        for value in (
            float(items.fields[name][row]) for name in ("latitude", "longitude", "altitude")
        )
    )
    is_relative = items.fields.get("altitude_is_relative", np.zeros(row + 1))[row] != 0.0
    hold_s = float(items.fields.get("time_inside", np.full(row + 1, np.nan))[row])
    return LoggedItem(
        item=sequence + 1,
        command=int(items.fields["nav_cmd"][row]),
        frame=_RELATIVE_FRAME if is_relative else _AMSL_FRAME,
        param1=hold_s if np.isfinite(hold_s) else None,
        param2=None,
        param3=None,
        param4=None,
        latitude_deg=latitude,
        longitude_deg=longitude,
        altitude_m=altitude,
    )


def _speed_changes(begun_s: dict[int, float], setpoints: Topic) -> dict[int, LoggedItem]:
    """Return a change of speed for each number left out behind which another speed is flown."""
    speeds = setpoints.fields[_SPEED]
    changes: dict[int, LoggedItem] = {}
    flown: float | None = None
    for sequence in sorted(begun_s):
        row = int(np.searchsorted(setpoints.time_s, begun_s[sequence] + _SETTLED_S, "right")) - 1
        speed = max(float(speeds[row]), -1.0) if row >= 0 and np.isfinite(speeds[row]) else None
        is_other = speed is not None and speed != (-1.0 if flown is None else flown)
        if is_other and sequence - 1 not in begun_s and sequence > 0:
            changes[sequence - 1] = LoggedItem(
                item=sequence,
                command=_CHANGE_SPEED,
                frame=_MISSION_FRAME,
                param1=1.0,
                param2=speed,
                param3=-1.0,
                param4=None,
                latitude_deg=None,
                longitude_deg=None,
                altitude_m=None,
            )
        flown = flown if speed is None else speed
    return changes
