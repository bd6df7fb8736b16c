"""Distances of flown legs to fences against another implementation of geodesics and projections."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from fenced_missions import VEHICLES
from hypothesis import Phase, given, settings
from hypothesis import strategies as st
from made_missions import item, mission
from pyproj import Geod, Transformer
from thinning import examples

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon
from planner.mission.items import Home
from planner.rules.fenced_flight import make_fenced_flight
from planner.service.preflight import check
from planner.values import replace
from planner.vehicle.library import load_vehicle

GEOD = Geod(ellps="WGS84")
SHARES = np.linspace(0.0, 1.0, 2001)


def frame_at(latitude: float, longitude: float) -> Transformer:
    """Return the transformer from degrees to metres about a place."""
    return Transformer.from_crs(
        "EPSG:4326", f"+proj=aeqd +lat_0={latitude} +lon_0={longitude} +ellps=WGS84", always_xy=True
    )


def straight_deg(
    autopilot: Autopilot, home: Home, start: tuple[float, float], end: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return longitudes and latitudes along what an autopilot takes for a straight leg."""
    if autopilot is Autopilot.ARDUPILOT:
        return straight_for_ardupilot_deg(home, start, end)
    metres = frame_at(home.latitude_deg, home.longitude_deg)
    a, b = (np.array(metres.transform(*place)) for place in (start, end))
    way = a[:, None] + (b - a)[:, None] * SHARES
    longitude, latitude = metres.transform(way[0], way[1], direction="INVERSE")
    return longitude, latitude


def straight_for_ardupilot_deg(
    home: Home, start: tuple[float, float], end: tuple[float, float]
) -> tuple[np.ndarray, np.ndarray]:
    """Return the same straight in ArduPilot's metres (``get_vector_xy_from_origin_NE``)."""

    def scale(latitude: np.ndarray) -> np.ndarray:
        return np.cos(np.radians(0.5 * (latitude + home.latitude_deg)))

    (lon_a, lat_a), (lon_b, lat_b) = start, end
    latitude = lat_a + SHARES * (lat_b - lat_a)
    turn = [(lon - home.longitude_deg + 180.0) % 360.0 - 180.0 for lon in (lon_a, lon_b)]
    east = [t * scale(np.array(lat)) for t, lat in zip(turn, (lat_a, lat_b), strict=True)]
    return home.longitude_deg + (east[0] + SHARES * (east[1] - east[0])) / scale(latitude), latitude


@given(
    st.sampled_from(list(Autopilot)),
    st.one_of(
        st.floats(-70.0, 70.0), st.sampled_from([89.9, -89.95, 0.0]), st.sampled_from([47.0, 65.0])
    ),
    st.sampled_from([8.0, 179.99, -179.95]),
    st.floats(0.0, 360.0),
    st.floats(0.0, 360.0),
    st.floats(200.0, 20_000.0),
    st.floats(0.25, 0.75),
    st.floats(30.0, 300.0),
    st.floats(5.0, 2_000.0),
    st.booleans(),
)
@settings(max_examples=examples(20), deadline=None, phases=[Phase.generate])
def test_clearances_of_flown_legs_agree_with_geodesics(
    autopilot: Autopilot,
    latitude: float,
    longitude: float,
    bearing: float,
    course: float,
    length_m: float,
    share: float,
    off_m: float,
    side_m: float,
    round_: bool,  # noqa: FBT001 - drawn
) -> None:
    if autopilot is Autopilot.ARDUPILOT and abs(latitude) > 70.0:
        latitude = math.copysign(70.0, latitude)  # its metres are none at the poles
    home = Home(latitude_deg=latitude, longitude_deg=longitude, altitude_amsl_m=100.0)
    start = GEOD.fwd(longitude, latitude, bearing, 500.0)[:2]
    end = GEOD.fwd(*start, course, length_m)[:2]
    lons, lats = straight_deg(autopilot, home, start, end)
    near = int(share * (len(SHARES) - 1))
    ahead = GEOD.inv(lons[near], lats[near], lons[near + 1], lats[near + 1])[0]
    reach = off_m + side_m
    middle = GEOD.fwd(lons[near], lats[near], ahead + 90.0, reach)[:2]
    metres = frame_at(middle[1], middle[0])
    leg = shapely.LineString(np.column_stack(metres.transform(lons, lats)))
    if round_:
        fence = Fence(
            circles=(
                FenceCircle(
                    inclusion=False,
                    latitude_deg=middle[1],
                    longitude_deg=middle[0],
                    radius_m=side_m,
                ),
            )
        )
        expected_m = leg.distance(shapely.Point(0.0, 0.0)) - side_m
    else:
        corners = [GEOD.fwd(*middle, ahead + 45.0 + 90.0 * i, side_m)[:2] for i in range(4)]
        fence = Fence(
            polygons=(
                FencePolygon(inclusion=False, vertices_deg=tuple((y, x) for x, y in corners)),
            )
        )
        edges = []
        for a, b in zip(corners, corners[1:] + corners[:1], strict=True):
            if autopilot is Autopilot.ARDUPILOT:
                edge = straight_for_ardupilot_deg(home, a, b)
            else:
                turn = (b[0] - a[0] + 180.0) % 360.0 - 180.0
                edge = (a[0] + SHARES * turn, a[1] + SHARES * (b[1] - a[1]))
            edges.append(shapely.LineString(np.column_stack(metres.transform(*edge))))
        expected_m = min(leg.distance(edge) for edge in edges)
    # It stands long at the first place, so that the second leg begins just there.
    made = mission(
        item(22, latitude, 20.0, longitude_deg=longitude),
        item(16, start[1], 20.0, longitude_deg=start[0], params=(30.0, 0.0, 0.0, None)),
        item(16, end[1], 20.0, longitude_deg=end[0]),
        home=home,
    )
    result = check(replace(made, fence=fence), load_vehicle(VEHICLES[autopilot]))
    assert result.assessment is not None
    flown = make_fenced_flight(result.assessment)
    legs = flown.legs(np.flatnonzero(flown.path.item == 3))
    [barrier] = flown.area.barriers
    found_m = float(barrier.leg_clearance(legs).clearance_m.min())
    assert found_m == pytest.approx(expected_m, abs=0.1)
