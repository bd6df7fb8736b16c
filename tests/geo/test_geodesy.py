from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pyproj import Geod

from planner.geo.geodesy import (
    SEMI_MAJOR_AXIS_M,
    distance_m,
    distance_m_and_azimuth_deg,
    latitude_longitude_deg,
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


@given(LATITUDES, LONGITUDES, st.floats(0.01, 5e6), st.floats(0.0, 360.0))
@example(90.0, 0.0, 2e4, 77.0)
@example(0.0, 179.95, 2e4, 90.0)
@settings(max_examples=300, deadline=None)
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
@settings(max_examples=300, deadline=None)
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
