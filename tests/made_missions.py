"""Missions made in code, for tests that need a value and no file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.mission.items import Home, Mission, MissionFormat, MissionItem, VehicleEvidence
from planner.values import replace

if TYPE_CHECKING:
    from planner.autopilot import Autopilot

HOME = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=400.0)
METRES_PER_DEGREE_NORTH = 111_176.0
"""Length of a degree of latitude at 47° north on WGS 84 (M = 6 369 900 m), to 1 m in a kilometre."""


def north(metres: float) -> float:
    """Return the latitude so many metres north of home."""
    return HOME.latitude_deg + metres / METRES_PER_DEGREE_NORTH


def item(
    command: int,
    latitude_deg: float | None = None,
    altitude_m: float | None = 0.0,
    *,
    params: tuple[float | None, ...] = (0.0, 0.0, 0.0, None),
    frame: int = 3,
    longitude_deg: float | None = None,
    jump_id: int | None = None,
    autocontinue: bool = True,
) -> MissionItem:
    """Return an item; with a latitude it lies on home's meridian unless told otherwise."""
    if latitude_deg is not None and longitude_deg is None:
        longitude_deg = HOME.longitude_deg
    return MissionItem(
        command=command,
        frame=frame,
        param1=params[0],
        param2=params[1],
        param3=params[2],
        param4=params[3],
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_m=altitude_m,
        autocontinue=autocontinue,
        jump_id=jump_id,
    )


def takeoff(height_m: float) -> MissionItem:
    return item(22, HOME.latitude_deg, height_m)


def waypoint(metres_north: float, height_m: float, *, hold_s: float = 0.0) -> MissionItem:
    return item(16, north(metres_north), height_m, params=(hold_s, 0.0, 0.0, None))


def speed(speed_m_s: float, kind: float = 1.0) -> MissionItem:
    return item(178, params=(kind, speed_m_s, -1.0, 0.0), frame=2)


def jump(target: int, repeats: float) -> MissionItem:
    return item(177, params=(float(target), repeats, 0.0, 0.0), frame=2)


def rtl() -> MissionItem:
    return item(20, frame=2, params=(0.0, 0.0, 0.0, 0.0))


def mission(
    *items: MissionItem,
    home: Home | None = HOME,
    autopilot: Autopilot | None = None,
    vehicle: VehicleEvidence | None = None,
) -> Mission:
    """Return a mission; items without a jump id get their number."""
    numbered = tuple(
        i if i.jump_id is not None else _numbered(i, number)
        for number, i in enumerate(items, start=1)
    )
    return Mission(
        source="made.plan",
        file_format=MissionFormat.PLAN,
        items=numbered,
        home=home,
        autopilot=autopilot,
        vehicle=vehicle,
    )


def _numbered(one: MissionItem, number: int) -> MissionItem:
    return replace(one, jump_id=number)
