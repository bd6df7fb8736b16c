"""Missions from formats that are none of MAVLink's: their points as items, and what had to be assumed.

Such a file holds neither home nor, mostly, a take-off, a landing and a speed.
"""

from __future__ import annotations

import math
import re
from enum import StrEnum
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place, Remarks, Rule, Severity
from planner.geo.fence import Fence, FencePolygon
from planner.mission.commands import Command, Frame
from planner.mission.items import MOST_ITEMS, Home, ItemSequence, Mission, MissionFormat
from planner.values import Value

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
    summary="Nothing settles whether an area of a drawing is to be stayed inside or out of.",
    why="An area around the flight may be its fence, or one that nobody may fly in: either reading passes "
    "what the other refuses.",
    how="Areas of KML and GeoJSON that neither say so by what they, or the folder around them, are called "
    "(geofence, flight area, stay inside …; no-fly, keep out, NFZ, danger …), nor by the property inclusion; "
    "or say both, or the contrary (not, outside, free).  Predicted with a fence to stay inside.",
    fix="call the area 'stay inside' or 'no-fly', or give it the property inclusion, true or false",
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
_KEEP_OUT = re.compile(
    r"\b(no ?(fly|flights?|flying|go|entry|access|drones?|ua[sv]s?)|(keep|stay) ?(out|away|clear)|off limits|"
    r"exclusion|excluded?|prohibited|forbidden|restricted|nfz|avoid|danger|dangerous|hazards?|obstacles?)\b"
)
"""In what areas are called that are to be stayed out of."""
_KEEP_IN = re.compile(
    r"\b(inclusion|included?|(keep|stay|remain) ?(in|inside|within)|geo ?fence|containment|aoi|"
    r"(operations?|operational|survey|mission|flight|flying|work|working|search|mapping|project) "
    r"(area|zone|volume|geography|box|boundary|perimeter|polygon|fence)|"
    r"(field|site|farm|property) (boundary|perimeter))\b|^(fence|boundary|perimeter)$",
    re.MULTILINE,
)
"""In what areas are called that are to be stayed inside."""
_TURNS_ROUND = re.compile(r"\b(not|never|non|outside|beyond|without|free|except|unless)\b")
"""What makes the contrary of what stands beside it."""
_START = Place(1, 1)


def side_of(words: str) -> bool | None:
    """Return whether an area is to be stayed inside by what it is called, a name a line.

    ``None``: that does not settle it.
    """
    lines = re.sub(r"[^\w\n]|[_\d]", " ", words.lower()).splitlines()
    plain = "\n".join(" ".join(line.split()) for line in lines)
    rest, outs = _KEEP_OUT.subn(";", plain)  # a flight zone is none where there is no flight
    is_in, is_out = _KEEP_IN.search(rest) is not None, outs > 0
    return None if is_in == is_out or _TURNS_ROUND.search(plain) else is_in


def left_out(shapes: Mapping[str, int]) -> list[str]:
    """Return what is drawn in a file beside its line and is not taken, for what is assumed."""
    counts = [quantity.count(count, name) for name, count in shapes.items() if count]
    return [f"{' and '.join(counts)} left out"] if counts else []


class DrawnArea(Value):
    """An area beside the line of a drawing."""

    polygon: FencePolygon
    words: str
    """What it is called."""
    is_sided: bool
    """Whether anything says which side of it is flown on."""


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
    side = side_of(words) if is_inside is None else is_inside
    is_out, is_sided = side is False, side is not None
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
        yield DrawnArea(
            polygon=polygon, words=" ".join(words.split()), is_sided=is_sided or number > 0
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
    for inclusion, side in ((True, "inside"), (False, "out of")):
        if count := sum(area.polygon.inclusion is inclusion for area in areas):
            told.append(f"{quantity.count(count, 'area')} as the fence to stay {side}")
    remarks.add(
        FORMAT_FOREIGN,
        f"read from {what} of {quantity.count(len(points), 'point')}; assumed: {'; '.join(told)}",
        place=first.place or _START,
    )
    for area in areas:
        if not area.is_sided:
            said = f"area '{area.words[:40]}'" if area.words else "an area without a name"
            remarks.add(
                AREA_SIDE_UNKNOWN, f"{said}: nothing settles whether to stay inside it or out of it"
            )
    return Mission(
        source=source,
        file_format=MissionFormat.FOREIGN,
        items=tuple(sequence.items),
        home=None if ends.home_deg is None else Home(*ends.home_deg, None),
        return_height_m=ends.return_height_m,
        unstated_wait_s=sum(point.unstated_wait_s for point in points),
        fence=Fence(polygons=tuple(area.polygon for area in areas)) if areas else None,
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
