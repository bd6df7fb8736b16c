"""Rules on the fence that need no flight: of files that hold a fence and rally points alone."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.fence import FENCE_OFF, FENCE_TOO_LARGE, HOME_OUTSIDE, RALLY_OUTSIDE
from planner.findings import FlightStretch

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding, Place
    from planner.geo.fence import Fence, RallyPoint
    from planner.geo.geodesy import LocalFrame
    from planner.geo.path import Barrier
    from planner.mission.items import Mission
    from planner.vehicle.parameters.resolve import FlightParameters

_PX4_POINTS = 64
"""Points PX4 stores (``DM_KEY_FENCE_POINTS_MAX``); 16 on small boards."""
_ARDUPILOT_VERTICES = 255
"""ArduPilot counts the vertices of a polygon in one byte."""


def check_fence_alone(
    mission: Mission, autopilot: Autopilot, parameters: FlightParameters | None
) -> Iterator[Finding]:
    """Yield what is wrong with the fence and the rally points of a mission that flies nowhere."""
    fence = mission.fence
    if not fence:
        return
    from planner.geo.fence import make_fence_area
    from planner.geo.path import make_fence_frame
    from planner.rules.fence_settings import inclusions_unite

    home = mission.home
    frame = make_fence_frame(
        fence, None if home is None else (home.latitude_deg, home.longitude_deg)
    )
    area = make_fence_area(fence, frame, inclusions_unite=inclusions_unite(parameters))
    yield from check_size(autopilot, fence)
    yield from check_enforcement(parameters)
    yield from area.findings
    home_deg = None if home is None else (home.latitude_deg, home.longitude_deg)
    yield from check_places(frame, area.barriers, home_deg=home_deg, rally=mission.rally)


def check_size(autopilot: Autopilot, fence: Fence) -> Iterator[Finding]:
    """Yield a finding where the autopilot cannot hold all of a fence."""
    if autopilot is Autopilot.PX4:
        points = sum(len(p.vertices_deg) for p in fence.polygons) + len(fence.circles)
        if points > _PX4_POINTS:
            yield FENCE_TOO_LARGE.finding(f"the fence has {points} points, PX4 holds {_PX4_POINTS}")
    elif autopilot is Autopilot.ARDUPILOT:
        for polygon in fence.polygons:
            if len(polygon.vertices_deg) > _ARDUPILOT_VERTICES:
                yield FENCE_TOO_LARGE.finding(
                    f"a polygon of the fence has {len(polygon.vertices_deg)} vertices, ArduPilot "
                    f"counts to {_ARDUPILOT_VERTICES}",
                    place=polygon.place,
                )
                return


def check_enforcement(parameters: FlightParameters | None) -> Iterator[Finding]:
    """Yield a finding where the parameters leave the fence without effect."""
    if parameters is None:
        return
    from planner.rules.fence_settings import why_not_enforced

    reason = why_not_enforced(parameters)
    if reason is not None:
        yield FENCE_OFF.finding(reason)


def check_places(
    frame: LocalFrame,
    barriers: Sequence[Barrier],
    *,
    home_deg: tuple[float, float] | None,
    rally: Sequence[RallyPoint],
) -> Iterator[Finding]:
    """Yield findings where home or a rally point is outside."""
    import numpy as np

    if not barriers:
        return
    places: list[tuple[str, tuple[float, float], Place | None]] = []
    if home_deg is not None:
        places.append(("home", home_deg, None))
    places += [
        (f"rally point {number}", (point.latitude_deg, point.longitude_deg), point.place)
        for number, point in enumerate(rally, start=1)
    ]
    for name, (latitude_deg, longitude_deg), place in places:
        point_m = np.column_stack(frame.east_north_m([latitude_deg], [longitude_deg]))
        distance_m = [float(barrier.signed_distance_m(point_m)[0]) for barrier in barriers]
        if min(distance_m) >= 0.0:
            continue
        worst = distance_m.index(min(distance_m))
        there = (round(latitude_deg, 7), round(longitude_deg, 7))
        yield (HOME_OUTSIDE if name == "home" else RALLY_OUTSIDE).finding(
            f"{name} is {quantity.distance(-distance_m[worst])} beyond {barriers[worst].label}",
            place=place,
            stretch=FlightStretch(start_deg=there, end_deg=there, distance_m=-distance_m[worst]),
        )
