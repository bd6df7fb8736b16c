"""Geodesics and local frames against PROJ; ArduPilot's lines against its own formula."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyproj import Geod
from thinning import examples

from planner.geo.fence import Fence, FencePolygon, make_fence_area
from planner.geo.geodesy import (
    SEMI_MAJOR_AXIS_M,
    LocalFrame,
    bow_m,
    distance_m,
    distance_m_and_azimuth_deg,
    latitude_longitude_deg,
    most_distance_m,
    straight_length_m,
)

# Karney's geodesics in PROJ: another method, right to nanometres.
GEOD = Geod(ellps="WGS84")
# Vincenty's series leave out terms of the sixth order of the flattening: below 0.1 mm.
MILLIMETRE = 1e-3

LATITUDES = st.one_of(
    st.floats(-90.0, 90.0), st.sampled_from([90.0, -90.0, 89.99999, -89.999, 0.0])
)
LONGITUDES = st.one_of(
    st.floats(-180.0, 180.0), st.sampled_from([180.0, -180.0, 179.9999, -179.9999, 0.0])
)


@given(LATITUDES, LONGITUDES, LATITUDES, LONGITUDES)
@example(89.0, 10.0, 90.0, 10.0)  # the longest degree there is
@example(0.0, 179.95, 0.0, -179.95)
def test_no_distance_is_longer_than_the_most_that_is_said_of_it(
    latitude: float, longitude: float, other_latitude: float, other_longitude: float
) -> None:
    _, _, true_m = GEOD.inv(longitude, latitude, other_longitude, other_latitude)
    most_m = most_distance_m((latitude, longitude), (other_latitude, other_longitude))
    assert most_m >= true_m - MILLIMETRE


def test_the_most_across_the_antimeridian_is_that_of_the_short_way() -> None:
    # a tenth of a degree of 111.69 km
    assert most_distance_m((0.0, 179.95), (0.0, -179.95)) == pytest.approx(11_169.0, abs=1.0)


@given(LATITUDES, LONGITUDES, st.floats(0.01, 5e6), st.floats(0.0, 360.0))
@example(90.0, 0.0, 2e4, 77.0)
@example(0.0, 179.95, 2e4, 90.0)
@settings(max_examples=examples(300), deadline=None)
def test_distance_and_azimuth_agree_with_proj_anywhere(
    latitude: float, longitude: float, length: float, azimuth: float
) -> None:
    end_longitude, end_latitude, _ = GEOD.fwd(longitude, latitude, azimuth, length)
    expected_azimuth, _, expected = GEOD.inv(longitude, latitude, end_longitude, end_latitude)
    distance, found_azimuth = distance_m_and_azimuth_deg(
        latitude, longitude, end_latitude, end_longitude
    )
    assert float(distance) == pytest.approx(expected, abs=MILLIMETRE)
    across = expected * math.sin(math.radians(float(found_azimuth) - expected_azimuth))
    assert abs(across) < MILLIMETRE
    assert 0.0 <= float(found_azimuth) < 360.0


@given(LATITUDES, LONGITUDES, st.floats(0.0, 5e6), st.floats(0.0, 360.0))
@settings(max_examples=examples(300), deadline=None)
def test_the_end_of_a_geodesic_agrees_with_proj_anywhere(
    latitude: float, longitude: float, length: float, azimuth: float
) -> None:
    found_latitude, found_longitude = latitude_longitude_deg(latitude, longitude, length, azimuth)
    end_longitude, end_latitude, _ = GEOD.fwd(longitude, latitude, azimuth, length)
    _, _, gap = GEOD.inv(float(found_longitude), float(found_latitude), end_longitude, end_latitude)
    assert gap < MILLIMETRE
    assert -180.0 <= float(found_longitude) < 180.0


def test_the_equator_across_the_antimeridian_is_an_arc_of_the_semi_major_axis() -> None:
    expected = SEMI_MAJOR_AXIS_M * math.radians(0.02)
    distance, azimuth = distance_m_and_azimuth_deg(0.0, 179.99, 0.0, -179.99)
    assert float(distance) == pytest.approx(expected, abs=MILLIMETRE)
    assert float(azimuth) == pytest.approx(90.0, abs=1e-9)


def test_a_quarter_meridian_has_its_published_length() -> None:
    # 10 001 965.729 m: e.g. R. Rapp, Geometric Geodesy I (1991), for the WGS 84 ellipsoid.
    assert float(distance_m(0.0, 30.0, 90.0, -100.0)) == pytest.approx(10_001_965.729, abs=1e-3)


def test_a_point_is_at_no_distance_from_itself() -> None:
    distance, azimuth = distance_m_and_azimuth_deg(47.0, 8.0, 47.0, 8.0 + 360.0)
    assert float(distance) == 0.0
    assert float(azimuth) == 0.0


@pytest.mark.parametrize(("latitude", "longitude"), [(0.0, 180.0), (0.1, 179.9), (-0.3, -179.7)])
def test_antipodal_points_get_the_documented_approximation(
    latitude: float, longitude: float
) -> None:
    _, _, expected = GEOD.inv(0.0, 0.0, longitude, latitude)
    assert float(distance_m(0.0, 0.0, latitude, longitude)) == pytest.approx(expected, rel=0.006)


def test_an_antipodal_pair_does_not_spoil_its_neighbours() -> None:
    _, _, expected = GEOD.inv(0.0, 0.0, 0.1, 0.1)
    distance = distance_m(0.0, 0.0, [0.0, 0.1], [180.0, 0.1])
    assert distance[1] == pytest.approx(expected, abs=MILLIMETRE)


def test_arrays_broadcast_and_keep_their_shape() -> None:
    distance = distance_m(np.zeros((2, 1)), 0.0, 0.0, np.array([[0.0, 1.0, 2.0]]))
    assert distance.shape == (2, 3)
    assert distance[0, 2] == pytest.approx(2.0 * SEMI_MAJOR_AXIS_M * math.pi / 180.0, abs=1e-3)


FRAMES = st.builds(
    lambda latitude, longitude: LocalFrame(latitude_deg=latitude, longitude_deg=longitude),
    st.one_of(st.floats(-90.0, 90.0), st.sampled_from([90.0, -90.0, 89.95, -89.999])),
    st.one_of(st.floats(-180.0, 180.0), st.sampled_from([180.0, -180.0, 179.99])),
)
ANGLES = st.floats(0.0, 2.0 * math.pi)


def polar(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.sin(angle), radius * math.cos(angle)


@given(FRAMES, st.floats(0.0, 2e5), ANGLES)
@settings(max_examples=examples(200), deadline=None)
def test_positions_come_back(frame: LocalFrame, radius: float, angle: float) -> None:
    east, north = polar(radius, angle)
    found = frame.east_north_m(*frame.latitude_longitude_deg(east, north))
    # Degrees as floats are good for 1e-9 m.
    assert np.allclose(found, (east, north), rtol=0.0, atol=1e-6)


@given(FRAMES, st.floats(0.0, 2e4), ANGLES, st.floats(0.0, 2e4), ANGLES)
@settings(max_examples=examples(300), deadline=None)
def test_legs_of_20_km_near_the_origin_have_their_true_length_within_10_cm(
    frame: LocalFrame, radius: float, angle: float, far_radius: float, far_angle: float
) -> None:
    (east, far_east), (north, far_north) = zip(
        polar(radius, angle), polar(far_radius, far_angle), strict=True
    )
    latitude, longitude = frame.latitude_longitude_deg([east, far_east], [north, far_north])
    _, _, expected = GEOD.inv(longitude[0], latitude[0], longitude[1], latitude[1])
    assert math.hypot(far_east - east, far_north - north) == pytest.approx(expected, abs=0.1)


@given(FRAMES, st.floats(0.0, 2e4), ANGLES, ANGLES)
@settings(max_examples=examples(100), deadline=None)
def test_the_middle_of_a_straight_leg_is_within_10_cm_of_the_geodesics(
    frame: LocalFrame, radius: float, angle: float, direction: float
) -> None:
    east, north = polar(radius, angle)
    half_east, half_north = polar(1e4, direction)
    latitude, longitude = frame.latitude_longitude_deg(
        [east - half_east, east, east + half_east], [north - half_north, north, north + half_north]
    )
    azimuth, _, length = GEOD.inv(longitude[0], latitude[0], longitude[2], latitude[2])
    middle_longitude, middle_latitude, _ = GEOD.fwd(
        longitude[0], latitude[0], azimuth, length / 2.0
    )
    _, _, gap = GEOD.inv(middle_longitude, middle_latitude, longitude[1], latitude[1])
    assert gap < 0.1


def test_axes_point_east_and_north() -> None:
    frame = LocalFrame(latitude_deg=0.0, longitude_deg=180.0)
    east, north = frame.east_north_m([0.0, 0.001], [-179.999, 180.0])
    # a · 0.001° along the equator; M(0) = a (1 − e²) = 6 335 439.327 m along the meridian.
    assert east == pytest.approx([111.3195, 0.0], abs=1e-3)
    assert north == pytest.approx([0.0, 110.5743], abs=1e-3)


def test_a_20_km_leg_along_the_47th_parallel_bows_by_8_4_m() -> None:
    # PX4 #28759; s² tan(φ) / 8 R with R = 6.39e6 m gives 8.39 m.
    frame = LocalFrame(latitude_deg=47.0, longitude_deg=8.0)
    _, longitude = frame.latitude_longitude_deg(1e4, 0.0)
    _, north = frame.east_north_m(47.0, longitude)
    assert float(north) == pytest.approx(8.4, abs=0.05)


@pytest.mark.parametrize(
    ("latitude", "longitude"), [(90.1, 0.0), (math.nan, 0.0), (0.0, math.nan), (0.0, math.inf)]
)
def test_an_origin_that_is_no_place_is_refused(latitude: float, longitude: float) -> None:
    with pytest.raises(ValueError, match="_deg must be"):
        LocalFrame(latitude_deg=latitude, longitude_deg=longitude)


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
