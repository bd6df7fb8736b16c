from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyproj import Geod

from planner.geo.geodesy import LocalFrame

GEOD = Geod(ellps="WGS84")

FRAMES = st.builds(
    lambda latitude, longitude: LocalFrame(latitude_deg=latitude, longitude_deg=longitude),
    st.one_of(st.floats(-90.0, 90.0), st.sampled_from([90.0, -90.0, 89.95, -89.999])),
    st.one_of(st.floats(-180.0, 180.0), st.sampled_from([180.0, -180.0, 179.99])),
)
ANGLES = st.floats(0.0, 2.0 * math.pi)


def polar(radius: float, angle: float) -> tuple[float, float]:
    return radius * math.sin(angle), radius * math.cos(angle)


@given(FRAMES, st.floats(0.0, 2e5), ANGLES)
@settings(max_examples=200, deadline=None)
def test_positions_come_back(frame: LocalFrame, radius: float, angle: float) -> None:
    east, north = polar(radius, angle)
    found = frame.east_north_m(*frame.latitude_longitude_deg(east, north))
    # Degrees as floats are good for 1e-9 m.
    assert np.allclose(found, (east, north), rtol=0.0, atol=1e-6)


@given(FRAMES, st.floats(0.0, 2e4), ANGLES, st.floats(0.0, 2e4), ANGLES)
@settings(max_examples=300, deadline=None)
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
@settings(max_examples=100, deadline=None)
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
