"""Lines that ArduPilot takes for straight, against its own formula for metres."""

from __future__ import annotations

import math

import numpy as np
import pytest

from planner.geo.fence import Fence, FencePolygon, make_fence_area
from planner.geo.geodesy import (
    LocalFrame,
    bow_m,
    straight_length_m,
)

METRES_PER_DEGREE = 111_318.84502145034
"""ArduPilot's LATLON_TO_M: metres in a degree of latitude."""


def halfway_deg(
    home: LocalFrame, start_deg: tuple[float, float], end_deg: tuple[float, float], share: float
) -> tuple[float, float]:
    """Return the place on ArduPilot's straight line, by get_vector_xy_from_origin_NE and back."""

    def scale(latitude_deg: float) -> float:
        return math.cos(math.radians(0.5 * (latitude_deg + home.latitude_deg)))

    def turn(longitude_deg: float) -> float:
        return (longitude_deg - home.longitude_deg + 180.0) % 360.0 - 180.0

    east = [turn(lon) * scale(lat) for lat, lon in (start_deg, end_deg)]
    latitude = start_deg[0] + share * (end_deg[0] - start_deg[0])
    longitude = home.longitude_deg + (east[0] + share * (east[1] - east[0])) / scale(latitude)
    return latitude, longitude


@pytest.mark.parametrize("home_deg", [(47.0, 8.0), (-33.0, 179.99), (0.0, 0.0), (65.0, -20.0)])
@pytest.mark.parametrize("way_m", [(20e3, 0.0), (0.0, 20e3), (9e3, 9e3), (-6e3, 12e3)])
@pytest.mark.parametrize("share", [0.25, 0.5, 0.8])
def test_a_leg_bows_as_ardupilots_metres_do(
    home_deg: tuple[float, float], way_m: tuple[float, float], share: float
) -> None:
    home = LocalFrame(latitude_deg=home_deg[0], longitude_deg=home_deg[1])
    start = np.array([1500.0, -2000.0])
    end = start + np.array(way_m)
    (lat_a, lat_b), (lon_a, lon_b) = home.latitude_longitude_deg(
        np.array([start[0], end[0]]), np.array([start[1], end[1]])
    )
    place = halfway_deg(home, (float(lat_a), float(lon_a)), (float(lat_b), float(lon_b)), share)
    east, north = home.east_north_m(*place)
    found = start + share * (end - start) + bow_m(end[None] - start, np.array([share]), home_deg[0])
    # To second order, so that the flattening of the Earth and the distance from home are left over.
    # What is along the leg is no matter of where the line lies.
    gap = np.array([float(east), float(north)]) - found[0]
    across = abs(gap[0] * way_m[1] - gap[1] * way_m[0]) / math.hypot(*way_m)
    assert across < 0.1


def test_a_kilometre_at_47_degrees_bows_by_two_centimetres() -> None:
    # L² tan φ / 8R = 1e6 · 1.0724 / 5.1025e7 = 2.10 cm.
    found = bow_m(np.array([[1000.0, 0.0]]), np.array([0.5]), 47.0)
    assert found[0] == pytest.approx([0.0, -0.0210], abs=1e-4)
    assert straight_length_m(0.0210, 47.0) == pytest.approx(1000.0, rel=0.002)
    assert straight_length_m(0.0210, -47.0) == pytest.approx(1000.0, rel=0.002)
    assert straight_length_m(0.05, 0.0) == math.inf


@pytest.mark.parametrize("home_deg", [(47.0, 8.0), (-33.0, 179.97)])
def test_an_edge_of_ardupilots_fence_is_straight_in_its_metres(
    home_deg: tuple[float, float],
) -> None:
    home = LocalFrame(latitude_deg=home_deg[0], longitude_deg=home_deg[1])
    corners_m = ((-9e3, -9e3), (9e3, -8e3), (9e3, 9e3), (-9e3, 4e3))
    corners = [
        tuple(float(x) for x in home.latitude_longitude_deg(*corner)) for corner in corners_m
    ]
    vertices = tuple((lat, lon) for lat, lon in corners)
    fence = Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=vertices),))
    area = make_fence_area(fence, home, ardupilot_origin=home)
    plain = make_fence_area(fence, home)
    places = [
        halfway_deg(home, vertices[i], vertices[(i + 1) % 4], share)
        for i in range(4)
        for share in (0.2, 0.5, 0.9)
    ]
    east, north = home.east_north_m(*np.array(places).T)
    assert area.findings == ()
    assert np.abs(area.signed_distance_m(east, north)).max() < 0.02
    # Drawn straight in degrees the slanting edges would be elsewhere.
    assert np.abs(plain.signed_distance_m(east, north)).max() > 0.2
