"""Ground speeds that can be held against the wind, by pencil."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.headway import SLOWEST_M_S, headway_m_s, held_speeds_m_s
from planner.physics.wind import Wind

EAST = np.array([[1.0, 0.0]])
LEVEL = np.zeros((1, 1))


def headway(wind: Wind, way: tuple[float, float] = (1.0, 0.0), *heights: float) -> float:
    height = np.array([heights or (0.0,)])
    [speed] = headway_m_s(np.array([way]), height, wind=wind, airspeed_limit_m_s=10.0)
    return float(speed)


def test_wind_along_the_way_is_added_and_across_it_takes_the_other_side_of_a_triangle() -> None:
    assert headway(Wind(speed_m_s=6.0, from_deg=90.0)) == pytest.approx(4.0)
    assert headway(Wind(speed_m_s=6.0, from_deg=270.0)) == pytest.approx(16.0)
    assert headway(Wind(speed_m_s=6.0, from_deg=0.0)) == pytest.approx(8.0)  # 6, 8, 10
    assert headway(Wind(speed_m_s=6.0, from_deg=0.0), (0.0, -3.0)) == pytest.approx(16.0)


def test_a_wind_across_as_fast_as_the_vehicle_leaves_no_headway() -> None:
    assert headway(Wind(speed_m_s=10.0, from_deg=0.0)) == 0.0
    assert headway(Wind(speed_m_s=11.0, from_deg=90.0)) == pytest.approx(-1.0)


def test_a_profile_counts_at_the_worse_end_of_a_way() -> None:
    # Twice the wind at four times the height.
    wind = {"speed_m_s": 3.0, "reference_height_m": 10.0, "shear_exponent": 0.5}
    assert headway(Wind(from_deg=90.0, **wind), (1.0, 0.0), 10.0, 40.0) == pytest.approx(4.0)
    assert headway(Wind(from_deg=270.0, **wind), (1.0, 0.0), 10.0, 40.0) == pytest.approx(13.0)


@given(speed=st.floats(0.0, 20.0), from_deg=st.floats(0.0, 360.0), share=st.floats(0.0, 1.0))
@settings(max_examples=examples(60), deadline=None)
def test_no_height_between_the_ends_is_slower_than_both(
    speed: float, from_deg: float, share: float
) -> None:
    wind = Wind(speed_m_s=speed, from_deg=from_deg, reference_height_m=10.0, roughness_length_m=0.1)
    lowest = headway(wind, (1.0, 0.0), 5.0, 120.0)
    assert headway(wind, (1.0, 0.0), 5.0 + share * 115.0) >= lowest - 1e-9


def test_what_cannot_be_held_is_flown_slower_and_said() -> None:
    way = np.vstack((EAST, -EAST, 0.0 * EAST))
    speed, slowed = held_speeds_m_s(
        np.array([8.0, 8.0, 8.0]),
        way,
        np.array([2, 3, 4]),
        height_m=np.zeros((3, 1)),
        wind=Wind(speed_m_s=6.0, from_deg=90.0),
        airspeed_limit_m_s=10.0,
    )
    assert speed == pytest.approx([4.0, 8.0, 8.0])
    assert slowed is not None
    assert slowed.item.tolist() == [2]
    assert slowed.held_m_s == pytest.approx([4.0])
    assert slowed.commanded_m_s == pytest.approx([8.0])
    stuck, slowed = held_speeds_m_s(
        np.array([8.0]),
        EAST,
        np.array([2]),
        height_m=LEVEL,
        wind=Wind(speed_m_s=12.0, from_deg=90.0),
        airspeed_limit_m_s=10.0,
    )
    assert stuck == pytest.approx([SLOWEST_M_S])
    assert slowed is None  # W101's


@given(
    st.floats(5.0, 30.0), st.floats(0.0, 1.0), st.floats(0.0, 360.0), st.floats(0.0, 2.0 * np.pi)
)
@settings(max_examples=examples(50), deadline=None)
def test_upwind_is_the_slowest_way(
    airspeed_m_s: float, part: float, from_deg: float, way_rad: float
) -> None:
    """W101 looks at no way where the wind leaves enough of the airspeed upwind."""
    wind = Wind(speed_m_s=part * airspeed_m_s, from_deg=from_deg)
    way = np.array([[np.sin(way_rad), np.cos(way_rad)]])
    [held] = headway_m_s(way, LEVEL, wind=wind, airspeed_limit_m_s=airspeed_m_s)
    assert held >= airspeed_m_s - wind.speed_m_s - 1e-6
