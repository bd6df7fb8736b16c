"""What leaves a fence is never a go: flown paths and returns by another implementation of geometry."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
import shapely
from fenced_missions import VEHICLES, at, circle, degrees, rally
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from made_missions import HOME, mission, rtl, takeoff
from pyproj import Transformer
from thinning import examples

from planner.autopilot import Autopilot
from planner.findings import Severity
from planner.geo.fence import Fence, FencePolygon
from planner.service.preflight import CheckResult, check
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.mission.items import Mission

METRES = Transformer.from_crs(
    "EPSG:4326",
    f"+proj=aeqd +lat_0={HOME.latitude_deg} +lon_0={HOME.longitude_deg} +ellps=WGS84",
    always_xy=True,
)
_ALIKE_M = 0.15
"""What two implementations may differ by: 5 cm of the flown path, 1 cm in 100 m of the frames. [m]"""
_ROOM_M = 60.0
"""More than any of the vehicles needs to react and to stop from 10 m/s. [m]"""


def places_m(latitude_deg: object, longitude_deg: object) -> np.ndarray:
    """Return east and north of home. (n, 2) [m]"""
    return np.column_stack(METRES.transform(longitude_deg, latitude_deg))


@st.composite
def missions(draw: st.DrawFn) -> Mission:
    """Return a mission of a few places, a star about home that keeps it in, and what it keeps out of."""
    metres = st.floats(-280.0, 280.0)
    places = draw(st.lists(st.tuples(metres, metres), min_size=1, max_size=4))
    radii_m = draw(st.lists(st.floats(90.0, 500.0), min_size=7, max_size=7))
    star = [
        degrees(radius_m * np.sin(angle), radius_m * np.cos(angle))
        for radius_m, angle in zip(radii_m, np.linspace(0.0, 2.0 * np.pi, 8)[:-1], strict=True)
    ]
    holes = draw(st.lists(st.tuples(metres, metres, st.floats(2.0, 40.0)), max_size=2))
    rallies = draw(st.lists(st.tuples(metres, metres), max_size=1))
    if draw(st.booleans()):  # round a corner and back, past something near the straight way home
        east_m, north_m = draw(st.tuples(st.floats(150.0, 280.0), st.floats(150.0, 280.0)))
        places = [(east_m, 0.0), (east_m, north_m), (east_m, 0.0)]
        share, off_m = draw(st.tuples(st.floats(0.3, 0.8), st.floats(-30.0, 30.0)))
        holes = [(share * east_m - off_m, share * north_m, draw(st.floats(2.0, 20.0)))]
        star, rallies = [degrees(*own) for own in ((-400, -400), (400, -400), (0, 900))], []
    return replace(
        mission(takeoff(20.0), *(at(*place) for place in places), rtl()),
        fence=Fence(
            polygons=(FencePolygon(inclusion=True, vertices_deg=tuple(star)),),
            circles=tuple(circle(*hole, inclusion=False) for hole in holes),
        ),
        rally=tuple(rally(*place) for place in rallies),
    )


def allowed(one: Mission) -> shapely.Geometry:
    """Return where the fence of a mission allows to fly, in metres from home."""
    assert one.fence is not None
    [star] = one.fence.polygons
    area = shapely.Polygon(places_m(*np.array(star.vertices_deg).T))
    for hole in one.fence.circles:
        [centre] = places_m([hole.latitude_deg], [hole.longitude_deg])
        area = area.difference(shapely.Point(centre).buffer(hole.radius_m, quad_segs=64))
    return area


def flown(one: Mission, result: CheckResult, *, to_rally: bool) -> shapely.Geometry:
    """Return the flown path and straight returns from all over it, home or to a nearer rally point."""
    assert result.trace is not None
    path = places_m(result.trace.latitude_deg, result.trace.longitude_deg)
    ends = np.zeros((1, 2))
    if to_rally and one.rally:
        point = one.rally[0]
        ends = np.vstack((ends, places_m([point.latitude_deg], [point.longitude_deg])))
    away_m = np.hypot(*np.moveaxis(path[:, None] - ends, 2, 0))
    clear = np.ones(len(path), dtype=bool)
    if len(ends) > 1:  # which is nearer depends on where it stops
        clear = np.abs(away_m[:, 0] - away_m[:, 1]) > _ROOM_M
    chosen = ends[away_m.argmin(axis=1)]
    lines = np.stack((path, chosen), axis=1)[clear]
    return shapely.MultiLineString([path, *lines[:: max(len(lines) // 400, 1)]])


def fence_errors(result: CheckResult) -> set[str]:
    """Return the codes of errors of the fence."""
    return {
        one.code
        for one in result.findings
        if one.severity is Severity.ERROR and one.code.startswith("F")
    }


@pytest.mark.parametrize("autopilot", list(Autopilot))
@settings(max_examples=examples(12), deadline=None, phases=(Phase.generate,))
@given(one=missions())
def test_a_path_or_a_return_out_of_the_fence_is_never_a_go(
    autopilot: Autopilot, one: Mission
) -> None:
    vehicle = load_vehicle(VEHICLES[autopilot])
    result = check(one, vehicle, battery=Battery(capacity_wh=170.0), with_trace=True)
    area = allowed(one)
    lines = flown(one, result, to_rally=autopilot is not Autopilot.STEP)
    if not area.buffer(_ALIKE_M).covers(lines):
        assert fence_errors(result)
        assert result.verdict == "no-go"
    if one.rally:
        return  # near to where it begins to lead elsewhere is left out above
    if area.buffer(-_ROOM_M).covers(lines):
        assert not fence_errors(result)
