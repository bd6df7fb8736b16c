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
from planner.geo.fence import Fence, FencePolygon
from planner.mission.commands import Command, Frame
from planner.mission.formats.area_names import (
    CLOSED,
    CONTRARY,
    FENCES,
    FOREIGN_PHRASES,
    OTHERS,
    AreaSide,
    phrases_text,
    plain_name,
    side_of,
)
from planner.mission.items import MOST_ITEMS, Home, ItemSequence, Mission, MissionFormat
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence


FORMAT_FOREIGN = Rule(
    "L165 format-foreign",
    Severity.WARNING,
    summary="The mission was read from another program's format.",
    why="A drawing, or a mission of another maker's drone, does not hold all that is flown: what is "
    "predicted is one reading of it, and no autopilot of PX4 or ArduPilot loads the file.",
    how="A line of KML or GeoJSON with altitudes, waypoints of Litchi's CSV or of DJI's WPML.  What the file "
    "does not hold is named: home, take-off, end, speed, turns.  Areas beside the line are its fence (F115).",
    fix="write it as a plan (mavjoule convert), complete it in a ground station and check that",
)


AREA_SIDE_UNKNOWN = Rule(
    "F115 area-side-unknown",
    Severity.ERROR,
    summary="Nothing settles what an area of a drawing is there for.",
    why="An area around the flight may be its fence, or one that nobody may fly in: either reading passes "
    "what the other refuses.",
    how="Areas of KML and GeoJSON, by their property inclusion, else by what they, or the folder around "
    f"them, are called.  To stay out of: {phrases_text(AreaSide.OUTSIDE)}.  To stay inside: "
    f"{phrases_text(AreaSide.INSIDE)}; {', '.join(FENCES)} alone.  Of the work: "
    f"{phrases_text(AreaSide.WORK)}; and their like in {', '.join(FOREIGN_PHRASES)}.  With the contrary "
    f"({CONTRARY.replace('|', ', ')}), both sides or none of these nothing is settled, nor inside where that "
    f"is closed ({CLOSED.replace('|', ', ')}) or others fly ({OTHERS.replace('|', ', ')}), and the area is "
    "left out of the fence.  It is enough to be inside one of those to stay inside.  Called alike, numbers "
    "aside, they are parts of one, unless half of one or more lies within the other; of others that have "
    "places in common a flight that is not inside each is not settled.  Nor is one that leaves the areas of "
    "the work where nothing else is to be stayed inside.",
    fix="call the area 'stay inside' or 'no-fly', or give it the property inclusion, true or false; draw "
    "what is one area as one",
    instead="a name that says it",
    leaves_open=True,
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
    unstated_wait_s: float = 0.0
    """What else it may wait there, at most; infinite where nothing says how long. [s]"""
    place: Place | None = None


LONGEST_ACTION_S = 6.0
"""Of photos and recordings: DJI's waypoint missions go on with the next action after that (DJI Mobile SDK,
``DJIWaypointActionType``); turns of gimbal and vehicle are taken to last no longer. [s]"""
_ONE = "one of them"
"""The area that all parts are of where it is enough to be inside one."""
_START = Place(1, 1)


def left_out(shapes: Mapping[str, int]) -> list[str]:
    """Return what is drawn in a file beside its line and is not taken, for what is assumed."""
    counts = [quantity.count(count, name) for name, count in shapes.items() if count]
    return [f"{' and '.join(counts)} left out"] if counts else []


class DrawnArea(Value):
    """An area beside the line of a drawing, or a hole of one."""

    polygon: FencePolygon
    words: str
    """What it is called."""
    side: AreaSide | None
    """What it is there for, or the area around a hole; ``None``: nothing settles it."""


def drawn_areas(
    rings: Sequence[Sequence[Sequence[float]]],
    words: str,
    *,
    is_inside: bool | None = None,
    source: str,
) -> Iterator[DrawnArea]:
    """Yield an area of its outer ring, and its holes as areas to stay out of.

    Corners are longitude and latitude [°]; the first may be written again as the last.  Where it is not
    stated whether to stay inside it, what the area is called says so, as in `side_of`.

    Raises
    ------
    MissionFileError
        If a ring has fewer than three corners, or one that is not on the earth, or if an area to stay out
        of has holes.
    """
    side = side_of(words)
    if is_inside is not None:
        side = AreaSide.INSIDE if is_inside else AreaSide.OUTSIDE
    is_out = side is AreaSide.OUTSIDE
    if len(rings) > 1 and is_out:
        msg = "an area to stay out of with a hole: mend or remove it"
        raise MissionFileError(msg, source=source)
    for number, ring in enumerate(rings or [[]]):
        corners = [
            (corner[1], corner[0]) for corner in ring if len(corner) > 1 and _on_earth(*corner[:2])
        ]
        is_whole = len(corners) == len(ring)
        if corners[1:] and corners[0] == corners[-1]:
            corners.pop()
        if len(corners) < 3 or not is_whole:
            msg = (
                "an area with fewer than three corners, or one that is no place: mend or remove it"
            )
            raise MissionFileError(msg, source=source)
        polygon = FencePolygon(inclusion=not (is_out or number), vertices_deg=tuple(corners))
        yield DrawnArea(polygon=polygon, words=words, side=side)


def _fence_of(areas: Sequence[DrawnArea]) -> Fence | None:
    """Return the fence that areas draw, and what else they may mean; ``None``: none is drawn."""

    def fence(sides: Mapping[AreaSide | None, bool]) -> tuple[FencePolygon, ...]:
        """Return the polygons of some sides; whether it is enough to be inside one of them."""
        return tuple(
            replace(one.polygon, area=_ONE if sides[one.side] else plain_name(one.words) or _ONE)
            if one.polygon.inclusion
            else one.polygon
            for one in areas
            if one.side in sides
        )

    insides = sum(one.side is AreaSide.INSIDE and one.polygon.inclusion for one in areas)
    readings = []
    if insides > 1:
        readings.append(fence({AreaSide.INSIDE: False, AreaSide.OUTSIDE: True}))
    if not insides and any(one.side is AreaSide.WORK for one in areas):
        readings.append(fence({AreaSide.WORK: True, AreaSide.OUTSIDE: True}))
    certain = fence({AreaSide.INSIDE: True, AreaSide.OUTSIDE: True})
    if not certain and not readings:
        return None
    return Fence(polygons=certain, readings=tuple(Fence(polygons=one) for one in readings))


def _uses(areas: Sequence[DrawnArea]) -> Iterator[str]:
    """Yield what areas are taken for, in words."""
    for inclusion, side in ((True, AreaSide.INSIDE), (False, AreaSide.OUTSIDE)):
        fenced = [one for one in areas if one.side in {AreaSide.INSIDE, AreaSide.OUTSIDE}]
        if count := sum(one.polygon.inclusion is inclusion for one in fenced):
            yield f"{quantity.count(count, 'area')} as the fence {side}"
    for other, use in ((AreaSide.WORK, "as where the work is"), (None, "left out of the fence")):
        if count := sum(one.side is other and one.polygon.inclusion for one in areas):
            yield f"{quantity.count(count, 'area')} {use}"


def _remark_unsettled(areas: Sequence[DrawnArea], remarks: Remarks) -> None:
    for area in areas:
        if area.side is None and area.polygon.inclusion:
            name = " ".join(area.words.split())[:40]
            said = f"area '{name}'" if name else "an area without a name"
            remarks.add(
                AREA_SIDE_UNKNOWN, f"{said}: nothing settles whether to stay inside it or out of it"
            )


def _on_earth(longitude_deg: float, latitude_deg: float) -> bool:
    return abs(latitude_deg) <= 90.0 and abs(longitude_deg) <= 180.0


class RouteEnds(Value):
    """How a route is begun and ended; ``None``: the file does not hold it."""

    home_deg: tuple[float, float] | None = None
    """Latitude and longitude of the take-off. [°]"""
    takeoff_height_m: float | None = None
    """In the frame of the route; ``None``: that of the first point. [m]"""
    first_speed_m_s: float | None = None
    """From the take-off to the first point. [m s⁻¹]"""
    ending: Ending = Ending.RETURN
    return_height_m: float | None = None
    """To which it climbs before it returns. [m]"""


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
    ends: RouteEnds | None = None,
    assumed: Sequence[str] = (),
    areas: Sequence[DrawnArea] = (),
) -> Mission:
    """Return the mission that flies points from home, by default the first, after a take-off there.

    ``what`` names the format and ``assumed`` what its reader had to assume besides home and take-off.

    Raises MissionFileError for no point, more than a vehicle can hold, or one that is not on the earth.
    """
    if not points:
        msg = f"{what} without a point to fly to"
        raise MissionFileError(msg, source=source)
    ends = ends or RouteEnds()
    for number, point in enumerate(points, 1):
        _refuse_impossible(point, f"point {number}", source=source)
    _refuse_ends(ends, what, source=source)
    remarks = Remarks()
    first, last = points[0], points[-1]
    sequence = ItemSequence(first_number=1, place=first.place or _START, remarks=remarks)
    speed_m_s = _begin(sequence, ends, frame, first)
    for point in points:
        sequence.place = point.place or _START
        sequence.add_waypoint(_at(point), frame=frame, hold_s=point.hold_s)
        if point.speed_m_s is not None and point.speed_m_s != speed_m_s:
            speed_m_s = point.speed_m_s
            sequence.add(Command.DO_CHANGE_SPEED, 1.0, speed_m_s, -1.0)
    _end(sequence, ends, frame, first=first, last=last)
    if len(sequence.items) > MOST_ITEMS:
        msg = f"{what} of {len(points):,} points: MAVLink can send {MOST_ITEMS:,} items"
        raise MissionFileError(msg, source=source)
    told = [*(() if ends.home_deg else ("home at the first point, a take-off there",)), *assumed]
    told += _uses(areas)
    remarks.add(
        FORMAT_FOREIGN,
        f"read from {what} of {quantity.count(len(points), 'point')}; assumed: {'; '.join(told)}",
        place=first.place or _START,
    )
    _remark_unsettled(areas, remarks)
    return Mission(
        source=source,
        file_format=MissionFormat.FOREIGN,
        items=tuple(sequence.items),
        home=None if ends.home_deg is None else Home(*ends.home_deg, None),
        return_height_m=ends.return_height_m,
        unstated_wait_s=sum(point.unstated_wait_s for point in points),
        fence=_fence_of(areas),
        findings=remarks.findings(),
    )


def _at(point: RoutePoint, altitude_m: float | None = None) -> tuple[float, float, float]:
    height_m = point.altitude_m if altitude_m is None else altitude_m
    return point.latitude_deg, point.longitude_deg, height_m


def _begin(
    sequence: ItemSequence, ends: RouteEnds, frame: Frame, first: RoutePoint
) -> float | None:
    """Add the take-off; return the speed commanded to the first point. [m s⁻¹]"""
    there = _at(first, ends.takeoff_height_m)
    start = there if ends.home_deg is None else (*ends.home_deg, there[2])
    sequence.add(Command.NAV_TAKEOFF, 0.0, 0.0, 0.0, None, frame=frame, position=start)
    if ends.first_speed_m_s is not None and ends.home_deg is not None:
        sequence.add(Command.DO_CHANGE_SPEED, 1.0, ends.first_speed_m_s, -1.0)
        return ends.first_speed_m_s
    return None


def _end(
    sequence: ItemSequence, ends: RouteEnds, frame: Frame, *, first: RoutePoint, last: RoutePoint
) -> None:
    """Add what follows the last point."""
    free_yaw = (0.0, 0.0, 0.0, None)
    match ends.ending:
        case Ending.RETURN:
            if (ends.return_height_m or 0.0) > last.altitude_m:
                sequence.add_waypoint(_at(last, ends.return_height_m), frame=frame)
            sequence.add(Command.NAV_RETURN_TO_LAUNCH)
        case Ending.LAND:
            ground, place = Frame.GLOBAL_RELATIVE_ALT, _at(last, 0.0)
            sequence.add(Command.NAV_LAND, *free_yaw, frame=ground, position=place)
        case Ending.HOVER | Ending.FIRST:
            place = _at(last if ends.ending is Ending.HOVER else first)
            sequence.add(Command.NAV_LOITER_UNLIM, *free_yaw, frame=frame, position=place)


def _refuse_ends(ends: RouteEnds, what: str, *, source: str) -> None:
    """Refuse a beginning and an end that cannot be flown."""
    for value, name in (
        (ends.takeoff_height_m, "take-off to {:g} m: give a height above 0"),
        (ends.first_speed_m_s, "way to the first point at {:g} m/s: give a speed above 0"),
        (ends.return_height_m, "return at {:g} m: give a height above 0"),
    ):
        if value is not None and not 0.0 < value < math.inf:
            msg = f"{what} with a {name.format(value)}"
            raise MissionFileError(msg, source=source)
    if ends.home_deg is not None:
        latitude_deg, longitude_deg = ends.home_deg
        home = RoutePoint(latitude_deg=latitude_deg, longitude_deg=longitude_deg, altitude_m=0.0)
        _refuse_impossible(home, "the place of the take-off", source=source)


def _refuse_impossible(point: RoutePoint, name: str, *, source: str) -> None:
    values = (point.latitude_deg, point.longitude_deg, point.altitude_m, point.hold_s)
    speed_m_s = point.speed_m_s
    if not all(map(math.isfinite, (*values, speed_m_s or 0.0))) or not _on_earth(
        point.longitude_deg, point.latitude_deg
    ):
        msg = f"{name}: {point.latitude_deg:g}, {point.longitude_deg:g} is no place to fly to"
        raise MissionFileError(msg, source=source, place=point.place)
    if point.hold_s < 0.0 or (speed_m_s is not None and speed_m_s <= 0.0):
        msg = f"{name}: a hold and a speed are not negative, a speed is not 0"
        raise MissionFileError(msg, source=source, place=point.place)
