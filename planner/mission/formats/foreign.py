"""Missions from formats that are none of MAVLink's: their points as items, and what had to be assumed.

Such a file holds neither home nor, mostly, a take-off, a landing and a speed.
"""

from __future__ import annotations

import math
from enum import StrEnum
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place, Remarks, Rule, Severity
from planner.geo.fence import Fence
from planner.mission.commands import Command, Frame
from planner.mission.items import MOST_ITEMS, Home, ItemSequence, Mission, MissionFormat
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.geo.fence import FencePolygon


FORMAT_FOREIGN = Rule(
    "L165 format-foreign",
    Severity.WARNING,
    summary="The mission was read from another program's format.",
    why="A drawing, or a mission of another maker's drone, does not hold all that is flown: what is "
    "predicted is one reading of it, and no autopilot of PX4 or ArduPilot loads the file.",
    how="A line of KML or GeoJSON with altitudes, waypoints of Litchi's CSV or of DJI's WPML.  What the file "
    "does not hold is named: home, take-off, end, speed, turns.",
    fix="write it as a plan (mavjoule convert), complete it in a ground station and check that",
)


class Ending(StrEnum):
    """What follows the last point."""

    RETURN = "a return home"
    LAND = "a landing at the last point"
    HOVER = "a hover without end at the last point"
    FIRST = "a hover without end at the first point"


class RoutePoint(Value):
    """A point of the way to fly."""

    latitude_deg: float
    longitude_deg: float
    altitude_m: float
    """In the frame of its route. [m]"""
    speed_m_s: float | None = None
    """From here on; ``None``: as before, at first the vehicle's own. [m s⁻¹]"""
    hold_s: float = 0.0
    place: Place | None = None


_START = Place(1, 1)


def line_points(
    corners: Sequence[Sequence[float]], line: str, *, source: str, advice: str = ""
) -> list[RoutePoint]:
    """Return the points of a line whose corners are longitude, latitude [°] and altitude [m].

    Raises
    ------
    MissionFileError
        If a corner has no altitude; ``advice`` ends the sentence.
    """
    points = []
    for number, corner in enumerate(corners, 1):
        if len(corner) < 3:
            msg = f"point {number} of {line} has no altitude{advice}"
            raise MissionFileError(msg, source=source)
        longitude_deg, latitude_deg, altitude_m = corner[:3]
        points.append(
            RoutePoint(
                latitude_deg=latitude_deg, longitude_deg=longitude_deg, altitude_m=altitude_m
            )
        )
    return points


def foreign_mission(
    points: Sequence[RoutePoint],
    *,
    what: str,
    source: str,
    frame: Frame,
    ending: Ending = Ending.RETURN,
    takeoff_height_m: float | None = None,
    assumed: Sequence[str] = (),
    areas: Sequence[FencePolygon] = (),
) -> Mission:
    """Return the mission that flies points: from home at the first, after a take-off there.

    ``what`` names the format and ``assumed`` what its reader had to assume besides home and take-off.  The
    take-off is to the altitude of the first point, or to a height [m] where the file holds one.

    Raises MissionFileError for no point, more than a vehicle can hold, or one that is not on the earth.
    """
    if not points:
        msg = f"{what} without a point to fly to"
        raise MissionFileError(msg, source=source)
    for number, point in enumerate(points, 1):
        _refuse_impossible(point, number, source=source)
    if takeoff_height_m is not None and not 0.0 < takeoff_height_m < math.inf:
        msg = f"{what} with a take-off to {takeoff_height_m:g} m: give a height above 0"
        raise MissionFileError(msg, source=source)
    remarks = Remarks()
    first, last = points[0], points[-1]
    sequence = ItemSequence(first_number=1, place=first.place or _START, remarks=remarks)

    def at(point: RoutePoint, altitude_m: float | None = None) -> tuple[float, float, float]:
        height_m = point.altitude_m if altitude_m is None else altitude_m
        return point.latitude_deg, point.longitude_deg, height_m

    sequence.add(
        Command.NAV_TAKEOFF, 0.0, 0.0, 0.0, None, frame=frame, position=at(first, takeoff_height_m)
    )
    speed_m_s = None
    for point in points:
        sequence.place = point.place or _START
        sequence.add_waypoint(at(point), frame=frame, hold_s=point.hold_s)
        if point.speed_m_s is not None and point.speed_m_s != speed_m_s:
            speed_m_s = point.speed_m_s
            sequence.add(Command.DO_CHANGE_SPEED, 1.0, speed_m_s, -1.0)
    _end(sequence, ending, frame, first=at(first), last=at(last))
    if len(sequence.items) > MOST_ITEMS:
        msg = f"{what} of {len(points):,} points: MAVLink can send {MOST_ITEMS:,} items"
        raise MissionFileError(msg, source=source)
    told = ["home at the first point, a take-off there", *assumed]
    if areas:
        told.append(f"{quantity.count(len(areas), 'area')} as the fence to stay inside")
    remarks.add(
        FORMAT_FOREIGN,
        f"read from {what} of {quantity.count(len(points), 'point')}; assumed: {'; '.join(told)}",
        place=first.place or _START,
    )
    return Mission(
        source=source,
        file_format=MissionFormat.FOREIGN,
        items=tuple(sequence.items),
        home=Home(first.latitude_deg, first.longitude_deg, None),
        fence=Fence(polygons=tuple(areas)) if areas else None,
        findings=remarks.findings(),
    )


def _end(
    sequence: ItemSequence,
    ending: Ending,
    frame: Frame,
    *,
    first: tuple[float, float, float],
    last: tuple[float, float, float],
) -> None:
    """Add what follows the last point."""
    free_yaw = (0.0, 0.0, 0.0, None)
    match ending:
        case Ending.RETURN:
            sequence.add(Command.NAV_RETURN_TO_LAUNCH)
        case Ending.LAND:
            ground, place = Frame.GLOBAL_RELATIVE_ALT, (*last[:2], 0.0)
            sequence.add(Command.NAV_LAND, *free_yaw, frame=ground, position=place)
        case Ending.HOVER | Ending.FIRST:
            place = last if ending is Ending.HOVER else first
            sequence.add(Command.NAV_LOITER_UNLIM, *free_yaw, frame=frame, position=place)


def _refuse_impossible(point: RoutePoint, number: int, *, source: str) -> None:
    values = (point.latitude_deg, point.longitude_deg, point.altitude_m, point.hold_s)
    speed_m_s = point.speed_m_s
    if (
        not all(map(math.isfinite, (*values, speed_m_s or 0.0)))
        or abs(point.latitude_deg) > 90.0
        or abs(point.longitude_deg) > 180.0
    ):
        msg = (
            f"point {number}: {point.latitude_deg:g}, {point.longitude_deg:g} is no place to fly to"
        )
        raise MissionFileError(msg, source=source, place=point.place)
    if point.hold_s < 0.0 or (speed_m_s is not None and speed_m_s <= 0.0):
        msg = f"point {number}: a hold and a speed are not negative, a speed is not 0"
        raise MissionFileError(msg, source=source, place=point.place)
