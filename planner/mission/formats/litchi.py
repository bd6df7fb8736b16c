"""Missions in Litchi's CSV: waypoints with altitudes, speeds and stays; the app's settings are not in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.errors import MissionFileError
from planner.findings import Place
from planner.mission.commands import Frame
from planner.mission.formats.foreign import LONGEST_ACTION_S, RoutePoint, foreign_mission
from planner.mission.items import MOST_ITEMS

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.mission.items import Mission


_HEAD = ("latitude", "longitude", "altitude")
_STAY = 0.0
"""Action that waits, for so many milliseconds."""
_NONE = -1.0
_ACTIONS = frozenset({1.0, 2.0, 3.0, 4.0, 5.0})
"""Photo, beginning and end of a recording, turn of the vehicle, tilt of the camera."""
_FRAMES = {0.0: Frame.GLOBAL_RELATIVE_ALT, 1.0: Frame.GLOBAL_TERRAIN_ALT}
_MOST_ACTIONS = 15


def is_litchi(line: str) -> bool:
    """Return whether a line is the head of such a file."""
    names = [name.partition("(")[0].strip().lower() for name in line.split(",")[:3]]
    return tuple(names) == _HEAD


def read_litchi(text: str, *, source: str) -> Mission:
    """Return the mission in a Litchi CSV text.

    Raises MissionFileError with the line of what cannot be read, and where its units are not metric.
    """
    import csv

    rows = csv.reader(text.splitlines())
    names = [name.strip().lower() for name in next(rows)]
    imperial = [name for name in names if name.endswith(("(ft)", "(mph)", "(feet)"))]
    if imperial or "altitude(m)" not in names:
        msg = f"Litchi mission without metric units ({', '.join(imperial) or names[2]}): export it in metres"
        raise MissionFileError(msg, source=source, place=Place(1, 1))
    points: list[RoutePoint] = []
    modes: set[float] = set()
    left_out: set[str] = set()
    for cells in rows:
        if not any(cell.strip() for cell in cells):
            continue
        if len(points) >= MOST_ITEMS:
            msg = f"more than {MOST_ITEMS:,} waypoints: MAVLink can send no more"
            raise MissionFileError(msg, source=source, place=Place(rows.line_num, 1))
        row = _Row(dict(zip(names, cells, strict=False)), Place(rows.line_num, 1), source)
        modes.add(row.number("altitudemode", 0.0))
        points.append(row.point(left_out))
    if len(modes) > 1 or not modes <= _FRAMES.keys():
        msg = (
            "Litchi mission with some altitudes above the ground and some above the take-off: "
            "give all of them alike"
        )
        raise MissionFileError(msg, source=source)
    unset = [number for number, point in enumerate(points, 1) if point.speed_m_s is None]
    if unset and len(unset) < len(points):
        msg = (
            f"waypoint {unset[0]} is flown at the app's cruising speed, which is not in the file: "
            "give each waypoint a speed"
        )
        raise MissionFileError(msg, source=source, place=points[unset[0] - 1].place)
    return foreign_mission(
        points,
        what="a Litchi mission (CSV)",
        source=source,
        frame=_FRAMES[modes.pop()] if modes else Frame.GLOBAL_RELATIVE_ALT,
        assumed=[
            "a return home at the end",
            "the vehicle's own speed" if unset else "each speed from its waypoint on",
            *sorted(left_out),
        ],
    )


class _Row:
    """A row by the names of its columns."""

    def __init__(self, cells: Mapping[str, str], place: Place, source: str) -> None:
        self._cells, self._place, self._source = cells, place, source

    def number(self, name: str, default: float | None = None) -> float:
        """Return the number in a column; where that is missing or empty a default, if there is one."""
        text = self._cells.get(name, "").strip()
        if not text and default is not None:
            return default
        try:
            return float(text)
        except ValueError:
            msg = f"{name}: expected a number, got {text[:40]!r}"
            raise MissionFileError(msg, source=self._source, place=self._place) from None

    def point(self, left_out: set[str]) -> RoutePoint:
        """Return the waypoint, and add what of it is left out."""
        hold_ms, wait_s = 0.0, 0.0
        for number in range(1, _MOST_ACTIONS + 1):
            action = self.number(f"actiontype{number}", _NONE)
            if action == _STAY:
                hold_ms += self.number(f"actionparam{number}", 0.0)
            elif action != _NONE:
                left_out.add("no time for camera and gimbal")
                wait_s += LONGEST_ACTION_S if action in _ACTIONS else math.inf
        if self.number("curvesize(m)", 0.0) > 0.0:
            left_out.add("straight legs instead of curved turns")
        speed_m_s = self.number("speed(m/s)", 0.0)
        return RoutePoint(
            latitude_deg=self.number("latitude"),
            longitude_deg=self.number("longitude"),
            altitude_m=self.number("altitude(m)"),
            speed_m_s=None if speed_m_s == 0.0 else speed_m_s,
            hold_s=hold_ms / 1_000.0,
            unstated_wait_s=wait_s,
            place=self._place,
        )
