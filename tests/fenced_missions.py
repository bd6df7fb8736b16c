"""Missions about home with fences given in metres, and what the rules of fences say of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from made_missions import HOME, item, mission

from planner.autopilot import Autopilot
from planner.flight.pilot import make_pilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.geo.geodesy import LocalFrame
from planner.mission.route.route import make_route
from planner.service.preflight import check
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.resolve import resolve_parameters

if TYPE_CHECKING:
    from planner.findings import Finding
    from planner.flight.motion.kinematics import Motion
    from planner.mission.items import MissionItem

FRAME = LocalFrame(latitude_deg=HOME.latitude_deg, longitude_deg=HOME.longitude_deg)
VEHICLES = {
    Autopilot.STEP: "falkowski-2023-quadrotor",
    Autopilot.PX4: "px4-sih-quad",
    Autopilot.ARDUPILOT: "arducopter-sitl-quad",
}


def degrees(east_m: float, north_m: float) -> tuple[float, float]:
    """Return latitude and longitude of a place about home."""
    latitude_deg, longitude_deg = FRAME.latitude_longitude_deg(east_m, north_m)
    return float(latitude_deg), float(longitude_deg)


def at(
    east_m: float,
    north_m: float,
    height_m: float = 20.0,
    *,
    command: int = 16,
    **more: Any,  # noqa: ANN401 - whatever item takes
) -> MissionItem:
    """Return an item at a place about home."""
    latitude_deg, longitude_deg = degrees(east_m, north_m)
    return item(command, latitude_deg, height_m, longitude_deg=longitude_deg, **more)


def box(
    west: float, south: float, east: float, north: float, *, inclusion: bool = True
) -> FencePolygon:
    """Return a rectangle."""
    corners = ((west, south), (east, south), (east, north), (west, north))
    return FencePolygon(
        inclusion=inclusion, vertices_deg=tuple(degrees(*corner) for corner in corners)
    )


def circle(east: float, north: float, radius_m: float, *, inclusion: bool = True) -> FenceCircle:
    """Return a circle."""
    latitude_deg, longitude_deg = degrees(east, north)
    return FenceCircle(
        inclusion=inclusion,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        radius_m=radius_m,
    )


def rally(east_m: float, north_m: float) -> RallyPoint:
    """Return a rally point."""
    latitude_deg, longitude_deg = degrees(east_m, north_m)
    return RallyPoint(
        latitude_deg=latitude_deg, longitude_deg=longitude_deg, height_above_home_m=20.0
    )


def motion_of(autopilot: Autopilot, *items: MissionItem) -> Motion:
    """Return how an autopilot flies items, with the parameters of its model."""
    vehicle = load_vehicle(VEHICLES[autopilot])
    parameters = None
    if autopilot is not Autopilot.STEP:
        parameters = resolve_parameters(autopilot, model=vehicle).values
    route = make_route(mission(*items), dialect=autopilot)
    return make_pilot(Setup(vehicle), parameters).fly(route)[0]


def findings_of(
    items: tuple[MissionItem, ...],
    *areas: FencePolygon | FenceCircle,
    autopilot: Autopilot = Autopilot.STEP,
    parameters: str = "",
    rally_points: tuple[RallyPoint, ...] = (),
    **conditions: Any,  # noqa: ANN401 - whatever check takes
) -> dict[str, Finding]:
    """Return what the rules of fences say of a mission, by code; each code once at most."""
    fence = Fence(
        polygons=tuple(a for a in areas if isinstance(a, FencePolygon)),
        circles=tuple(a for a in areas if isinstance(a, FenceCircle)),
    )
    made = replace(mission(*items), fence=fence or None, rally=rally_points)
    result = check(
        made,
        load_vehicle(VEHICLES[autopilot]),
        battery=Battery(capacity_wh=170.0),
        parameters=(
            parameters_from_text(parameters.encode(), source="p.param") if parameters else None
        ),
        **conditions,
    )
    found = [finding for finding in result.findings if finding.code.startswith("F")]
    assert len({finding.code for finding in found}) == len(found)
    return {finding.code: finding for finding in found}
