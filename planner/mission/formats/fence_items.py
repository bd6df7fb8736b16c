"""Fence areas and rally points that come as mission items (commands 5000 to 5004 and 5100)."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Remarks, Rule, Severity
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.commands import AMSL_FRAMES, RELATIVE_FRAMES, Command, Frame
from planner.mission.items import MissionItem

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding, Place


_POLYGONS = {
    Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION: True,
    Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION: False,
}
_CIRCLES = {Command.NAV_FENCE_CIRCLE_INCLUSION: True, Command.NAV_FENCE_CIRCLE_EXCLUSION: False}
FENCE_COMMANDS: frozenset[int] = frozenset({Command.NAV_FENCE_RETURN_POINT, *_POLYGONS, *_CIRCLES})


FENCE_INCOMPLETE = Rule(
    "L164 fence-incomplete",
    Severity.ERROR,
    summary="A fence area is incomplete, or its vertices are not as many as it declares.",
    why="Nothing is checked against an incomplete area; an autopilot refuses such a fence, and the "
    "vehicle then flies without one.",
    how="The first parameter of each vertex is its polygon's number of vertices, at least 3; a circle "
    "has a centre and a radius above 0.",
    fix="save the fence again with a ground station, and send it to the vehicle",
    instead="a fence whose areas are whole",
)


def encloses_area(
    what: str, vertices: Sequence[object], remarks: Remarks, place: Place | None
) -> bool:
    """Return whether vertices enclose an area; report where they are too few."""
    if len(vertices) >= 3:
        return True
    corners = quantity.count(len(vertices), "vertex", "vertices")
    remarks.add(
        FENCE_INCOMPLETE, f"{what} has {corners} and encloses nothing: left out", place=place
    )
    return False


def make_fence(items: Sequence[MissionItem]) -> tuple[Fence | None, tuple[Finding, ...]]:
    """Return the fence that fence items describe, ``None`` if there are none, and what is wrong with it.

    Items that are no fence items are passed over, but end a polygon.
    """
    if not any(item.command in FENCE_COMMANDS for item in items):
        return None, ()
    polygons: list[FencePolygon] = []
    circles: list[FenceCircle] = []
    remarks = Remarks()
    breach_return: tuple[float, float, float | None] | None = None
    # A vertex that declares another count begins another polygon, whatever was announced.
    for (command, _), group in groupby(items, key=lambda item: (item.command, item.param1)):
        if command in _POLYGONS:
            inclusion = _POLYGONS[Command(command)]
            polygons += _make_polygons(tuple(group), remarks, inclusion=inclusion)
        elif command in _CIRCLES:
            for item in group:
                latitude_deg, longitude_deg = item.latitude_deg, item.longitude_deg
                radius_m = item.param1 or 0.0
                if latitude_deg is None or longitude_deg is None or radius_m <= 0.0:
                    message = (
                        f"the fence circle {_where(item)} has no centre or no radius: left out"
                    )
                    remarks.add(FENCE_INCOMPLETE, message, place=item.place)
                    continue
                circles.append(
                    FenceCircle(
                        inclusion=_CIRCLES[Command(command)],
                        latitude_deg=latitude_deg,
                        longitude_deg=longitude_deg,
                        radius_m=radius_m,
                        place=item.place,
                    )
                )
        elif command == Command.NAV_FENCE_RETURN_POINT:
            for item in group:
                if item.latitude_deg is not None and item.longitude_deg is not None:
                    breach_return = (item.latitude_deg, item.longitude_deg, item.altitude_m)
    fence = Fence(
        polygons=tuple(polygons), circles=tuple(circles), breach_return_deg_m=breach_return
    )
    return fence, remarks.findings()


def _make_polygons(
    items: tuple[MissionItem, ...], remarks: Remarks, *, inclusion: bool
) -> list[FencePolygon]:
    """Cut a run of vertices that declare the same count into polygons of so many."""
    polygons: list[FencePolygon] = []
    count = items[0].param1
    declared = int(count) if count is not None and count >= 1.0 else None
    size = declared or len(items)
    for start in range(0, len(items), size):
        first = items[start]
        vertices = tuple(
            (item.latitude_deg, item.longitude_deg)
            for item in items[start : start + size]
            if item.latitude_deg is not None and item.longitude_deg is not None
        )
        what = f"the fence polygon {_where(first)}"
        if encloses_area(what, vertices, remarks, first.place):
            polygons.append(
                FencePolygon(inclusion=inclusion, vertices_deg=vertices, place=first.place)
            )
            if len(vertices) != declared:
                corners = quantity.count(len(vertices), "vertex", "vertices")
                wrong = "declares no number" if declared is None else f"declares {declared}"
                remarks.add(
                    FENCE_INCOMPLETE, f"{what} has {corners} and {wrong}", place=first.place
                )
    return polygons


FENCE_ITEM_BROKEN = Rule(
    "L158 fence-item-broken",
    Severity.WARNING,
    summary="A rally point is incomplete, or the list of a fence's points is not closed.",
    why="An autopilot refuses such points, and the vehicle then returns home and not to them.",
    how="Each rally point has a place and an altitude; a list of a fence ends where it begins.",
    fix="save fence and rally points again with a ground station",
)

RALLY_ALTITUDE_REFERENCE = Rule(
    "L159 rally-altitude-reference",
    Severity.ERROR,
    summary="A rally point's altitude is not written as height above home.",
    why="A vehicle that returns at the wrong height hits what it should clear.",
    how="AMSL altitudes are reduced by home's altitude; where it is unknown, and above terrain, they are "
    "read as heights above home.",
    fix="write rally altitudes relative to home (frame 3)",
)


def make_rally_points(
    items: Sequence[MissionItem], *, home_altitude_amsl_m: float | None
) -> tuple[tuple[RallyPoint, ...], tuple[Finding, ...]]:
    """Return the rally points among items, and what had to be assumed about their altitude.

    AMSL altitudes are reduced by that of home. [m AMSL]
    """
    points: list[RallyPoint] = []
    remarks = Remarks()
    for item in items:
        if item.command != Command.NAV_RALLY_POINT:
            continue
        number = len(points) + 1
        if item.latitude_deg is None or item.longitude_deg is None or item.altitude_m is None:
            message = f"rally point {number} has no place or altitude: left out"
            remarks.add(FENCE_ITEM_BROKEN, message, place=item.place)
            continue
        height_m = item.altitude_m
        if item.frame in AMSL_FRAMES and home_altitude_amsl_m is not None:
            height_m -= home_altitude_amsl_m
        elif item.frame not in RELATIVE_FRAMES:
            message = (
                f"rally point {number} is not relative to home (frame {item.frame}): "
                f"{height_m:g} m above home assumed"
            )
            remarks.add(RALLY_ALTITUDE_REFERENCE, message, place=item.place)
        points.append(RallyPoint(item.latitude_deg, item.longitude_deg, height_m, item.place))
    return tuple(points), remarks.findings()


def fence_items(fence: Fence) -> tuple[MissionItem, ...]:
    """Return a fence as the items that autopilots keep; `make_fence` reads them back.

    Its return point comes first, then its polygons, then its circles.
    """
    items: list[MissionItem] = []
    if fence.breach_return_deg_m is not None:
        latitude_deg, longitude_deg, height_m = fence.breach_return_deg_m
        # ArduPilot refuses a fence with a value that is not a number, and does not use this one.
        position = (latitude_deg, longitude_deg, 0.0 if height_m is None else height_m)
        relative = Frame.GLOBAL_RELATIVE_ALT
        items.append(_area_item(Command.NAV_FENCE_RETURN_POINT, position, frame=relative))
    vertex_of = {inclusion: command for command, inclusion in _POLYGONS.items()}
    for polygon in fence.polygons:
        count = float(len(polygon.vertices_deg))
        items += [
            _area_item(vertex_of[polygon.inclusion], (*place, 0.0), param1=count)
            for place in polygon.vertices_deg
        ]
    circle_of = {inclusion: command for command, inclusion in _CIRCLES.items()}
    for circle in fence.circles:
        position = (circle.latitude_deg, circle.longitude_deg, 0.0)
        command = circle_of[circle.inclusion]
        items.append(_area_item(command, position, param1=circle.radius_m))
    return tuple(items)


def rally_items(points: Sequence[RallyPoint]) -> tuple[MissionItem, ...]:
    """Return rally points as the items that autopilots keep; `make_rally_points` reads them back."""
    return tuple(
        _area_item(
            Command.NAV_RALLY_POINT,
            (point.latitude_deg, point.longitude_deg, point.height_above_home_m),
            frame=Frame.GLOBAL_RELATIVE_ALT,
        )
        for point in points
    )


def _area_item(
    command: Command,
    position: tuple[float, float, float],
    *,
    param1: float = 0.0,
    frame: Frame = Frame.GLOBAL,
) -> MissionItem:
    return MissionItem(int(command), int(frame), param1, 0.0, 0.0, 0.0, *position)


def _where(item: MissionItem) -> str:
    return "without a place" if item.place is None else f"from line {item.place.line}"
