"""Corners flown through, against the figures derived from SCurve.cpp and against their four limits."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.ardupilot.legs import Corners, half_overlap_s
from planner.flight.motion.s_curve import SpeedLimits, speed_ramps
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray


def corner(
    turn_deg: float,
    *,
    speed: float = 10.0,
    jerk: float = 1.0,
    acceleration: float = 2.5,
    rise: float = 0.0,
    climb_deg: float = 0.0,
) -> Corners:
    ramps = speed_ramps(
        np.array([speed]), SpeedLimits(np.array([acceleration]), np.array([jerk]), np.array([rise]))
    )
    return Corners.of(
        *directions(turn_deg, climb_deg),
        slowing=ramps,
        speeding=ramps,
        speed_limit_m_s=np.array([speed]),
    )


def directions(turn_deg: float, climb_deg: float) -> tuple[FloatArray, FloatArray]:
    """Northward, and by an angle to the right of it and upwards."""
    turn, climb = np.radians(turn_deg), np.radians(climb_deg)
    level = np.cos(climb)
    after = np.array([[np.sin(turn) * level, np.cos(turn) * level, np.sin(climb)]])
    return np.array([[0.0, 1.0, 0.0]]), after


def limits(radius: float, across: float) -> ArduPilotParameters:
    return ArduPilotParameters(
        waypoint_radius_m=radius, corner_acceleration_m_s2=across, vertical_acceleration_m_s2=1.0
    )


def passed(some: Corners, *, radius: float = 2.0, across: float = 5.0) -> tuple[float, float]:
    """Overlap and speed of a corner."""
    half = half_overlap_s(some, limits(radius, across))
    return 2.0 * float(half[0]), float(some.speed_m_s(half)[0])


@pytest.mark.parametrize(
    ("turn_deg", "overlap_s", "speed_m_s"),
    [
        (10.0, 6.5, 10.0),
        (30.0, 5.7, 7.7),
        (45.0, 5.0, 5.8),
        (60.0, 4.6, 4.5),
        (90.0, 4.1, 2.9),
        (120.0, 3.8, 1.8),
        (180.0, 3.6, 0.0),
    ],
)
def test_corners_are_passed_as_derived_from_the_source(
    turn_deg: float, overlap_s: float, speed_m_s: float
) -> None:
    # The figures are given to a tenth, the jerk rising at once.
    overlap, speed = passed(corner(turn_deg))
    assert overlap == pytest.approx(overlap_s, abs=0.05)
    assert speed == pytest.approx(speed_m_s, abs=0.06)


@pytest.mark.parametrize(
    ("turn_deg", "leg_m_s", "corner_m_s"),
    [
        (90.0, 10.0, 2.9),
        (151.0, 10.0, 0.8),
        (61.0, 5.0, 4.29),
        (47.0, 10.0, 5.6),
        (13.0, 10.0, 9.96),
    ],
)
def test_corners_are_as_fast_as_recorded(
    turn_deg: float, leg_m_s: float, corner_m_s: float
) -> None:
    # Recorded flights; 0.1 m/s of noise.
    assert passed(corner(turn_deg, speed=leg_m_s, rise=0.3))[1] == pytest.approx(
        corner_m_s, abs=0.1
    )


def test_the_overlap_within_the_jerk_is_the_cube_root_of_the_radius() -> None:
    # 2 sin(45°) J t³/6 = R.
    t = (6 * 2.0 / (2 * np.sin(np.pi / 4))) ** (1 / 3)
    assert passed(corner(90.0))[0] == pytest.approx(2 * t, abs=1e-3)


def test_eight_times_the_radius_doubles_the_overlap() -> None:
    assert passed(corner(90.0), radius=0.8)[0] == pytest.approx(
        2 * passed(corner(90.0), radius=0.1)[0], abs=1e-3
    )


def test_eight_times_the_jerk_halves_the_overlap() -> None:
    slow, fast = (
        passed(corner(90.0, jerk=j, acceleration=9.0), radius=0.1, across=50.0)[0]
        for j in (1.0, 8.0)
    )
    assert fast == pytest.approx(slow / 2, abs=1e-3)


def test_a_small_corner_acceleration_shortens_the_overlap() -> None:
    # Half-way the acceleration is 2 J t sin(90°/2) = 1.5.
    assert passed(corner(90.0), across=1.5)[0] == pytest.approx(2 * 1.5 / 2**0.5, abs=1e-3)


def test_a_level_leg_meets_a_vertical_one_at_a_metre_a_second() -> None:
    # The vertical acceleration is below its limit of 1 until A/J + t_j = 1.3 s: speeds there
    # 1.15²/2 = 0.66 and 0.65, recorded about 1 m/s and 0.25 m beside the corner on either axis.
    level = speed_ramps(
        np.array([10.0]), SpeedLimits(np.array([2.5]), np.array([1.0]), np.array([0.3]))
    )
    upward = speed_ramps(
        np.array([2.5]), SpeedLimits(np.array([1.0]), np.array([1.0]), np.array([0.3]))
    )
    some = Corners.of(
        *directions(0.0, 90.0), slowing=level, speeding=upward, speed_limit_m_s=np.array([2.5])
    )
    overlap, speed = passed(some)
    assert overlap == pytest.approx(2 * 1.3, abs=1e-3)
    assert speed == pytest.approx(np.hypot(1.15**2 / 2, 0.65), abs=1e-3)
    assert level.begun(np.array([1.3]))[0][0] == pytest.approx(0.25, abs=0.01)


def test_straight_on_the_speed_is_kept() -> None:
    overlap, speed = passed(corner(0.0))
    assert overlap == pytest.approx(6.5, abs=1e-6)
    assert speed == pytest.approx(10.0, abs=1e-5)


@given(
    turn=st.floats(0.0, 180.0),
    climb=st.floats(-80.0, 80.0),
    speed=st.floats(1.0, 15.0),
    jerk=st.floats(0.5, 5.0),
    radius=st.floats(0.5, 10.0),
    across=st.floats(0.5, 10.0),
)
@settings(max_examples=examples(150), deadline=None)
def test_corners_keep_all_four_limits_and_no_longer_overlap_would(
    turn: float, climb: float, speed: float, jerk: float, radius: float, across: float
) -> None:
    some = corner(turn, speed=speed, jerk=jerk, climb_deg=climb, rise=0.3)
    half = half_overlap_s(some, limits(radius, across))
    before, after = directions(turn, climb)

    def kept(half_s: FloatArray) -> bool:
        (left, gone), (left_v, gone_v), (left_a, gone_a) = some.ramps.begun(half_s)
        offset = gone * after[0] - left * before[0]
        velocity = gone_v * after[0] + left_v * before[0]
        acceleration = gone_a * after[0] - left_a * before[0]
        return bool(
            np.linalg.norm(offset) <= radius + 1e-9
            and np.linalg.norm(velocity) <= speed + 1e-9
            and np.hypot(*acceleration[:2]) <= across + 1e-9
            and abs(acceleration[2]) <= 1.0 + 1e-9
        )

    assert kept(half)
    if half[0] < 0.5 * some.ramps.duration_s[0, 0] - 0.01:
        assert not kept(half + 0.005)
