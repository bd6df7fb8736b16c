"""PX4's braking and speeding up along straights: the law, its motion, and legs too short to cruise."""

from __future__ import annotations

import numpy as np
import pytest
from ardupilot_missions import go, takeoff
from hypothesis import given, settings
from hypothesis import strategies as st
from px4_flights import fly_px4
from stepped_point import leg_time_s
from thinning import examples

from planner.flight.motion.kinematics import STATES, FlightState
from planner.flight.motion.px4.braking import (
    Px4Ramps,
    allowed_speed_m_s,
    braking_distance_m,
    braking_time_s,
    ramp_time_s,
)
from planner.flight.motion.px4.laws import Brakes, Px4Law, wright_omega
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
CRUISE, BRAKE = STATES.index(FlightState.CRUISE), STATES.index(FlightState.BRAKE)


@given(st.floats(-600.0, 600.0))
def test_wrights_omega_solves_its_equation(y: float) -> None:
    omega = float(wright_omega(np.array(y)))
    assert omega + np.log(omega) == pytest.approx(y, abs=1e-10)


def test_wrights_omega_vanishes_after_a_hold_of_days() -> None:
    assert wright_omega(np.array(-1e6)) == 0.0


def law(speed_m_s: float, final_m_s: float = 0.0) -> Px4Law:
    aim = np.zeros((1, 3, 4))
    aim[0, :, 0] = 100.0, 0.0, 50.0
    brakes = Brakes(
        direction=np.array([[1.0, 0.0, 0.0]]),
        start_m_s=np.array([speed_m_s]),
        final_m_s=np.array([final_m_s]),
        acceleration_m_s2=np.array([3.0]),
        half_b_m_s=np.array([4.5]),
        rate=np.ones(1),
    )
    return Px4Law.of(aim, brakes)


def test_braking_from_12_to_2_m_s_takes_6_seconds() -> None:
    # (12 − 2)/3 + (2 · 3/4) ln(12/2) = 3.333 + 2.688.
    state = law(12.0).state_at(np.array([0]), np.array([6.021]))
    assert state.east_m_s == pytest.approx(2.0, abs=1e-3)
    # Left: (2² + 9 · 2)/6 = 3.667 m.
    assert state.east_m == pytest.approx(100.0 - 3.667, abs=1e-3)


@pytest.mark.parametrize("speed_m_s", [3.0, 10.0])
@pytest.mark.parametrize(
    ("acceleration_m_s2", "jerk_m_s3"), [(3.0, 4.0), (1.0, 4.0), (0.5, 4.0), (2.0, 8.0)]
)
def test_a_leg_takes_as_long_as_a_point_that_keeps_to_the_law(
    acceleration_m_s2: float, jerk_m_s3: float, speed_m_s: float
) -> None:
    changed = replace(PX4, acceleration_m_s2=acceleration_m_s2, jerk_m_s3=jerk_m_s3)
    there = replace(go(0.0, 200.0, hold=1.0), speed_m_s=speed_m_s)
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), there), changed)
    took_s = float(np.diff(motion.segments.end_s[motion.arrival_segment[1:]])[0]) - 1.0
    stepped_s = leg_time_s(
        200.0, speed_m_s, acceleration_m_s2=acceleration_m_s2, jerk_m_s3=jerk_m_s3
    )
    assert took_s == pytest.approx(stepped_s, abs=0.1)


@pytest.mark.parametrize("length_m", [6.0, 8.0, 12.0, 20.0])
@pytest.mark.parametrize(("acceleration_m_s2", "jerk_m_s3"), [(1.0, 4.0), (1.0, 20.0), (2.0, 20.0)])
def test_a_leg_too_short_for_its_speed_is_sped_along_at_a_steady_acceleration(
    length_m: float, acceleration_m_s2: float, jerk_m_s3: float
) -> None:
    # From rest x = ½ a (t − a/2j)² + a³/24j² once the jerk is over; the next leg goes on, 2 m before.
    a, j = acceleration_m_s2, jerk_m_s3
    changed = replace(PX4, acceleration_m_s2=a, jerk_m_s3=j)
    short, on = go(0.0, length_m), go(0.0, 300.0)
    places = [replace(one, speed_m_s=10.0) for one in (short, on)]
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), *places), changed)
    took_s = float(np.diff(motion.segments.end_s[motion.arrival_segment[1:3]])[0])
    way_m = length_m - 2.0 - a**3 / (24.0 * j**2)
    assert took_s == pytest.approx(0.5 * a / j + np.sqrt(2.0 * way_m / a), abs=0.002)


@given(st.floats(0.5, 20.0), st.floats(0.0, 3.0), st.floats(0.0, 15.0))
def test_the_speed_of_the_braking_law_is_the_slope_of_its_way(
    speed_m_s: float, final_m_s: float, time_s: float
) -> None:
    around = time_s + np.array([-1e-4, 0.0, 1e-4])
    state = law(speed_m_s, final_m_s).state_at(np.zeros(3, dtype=np.intp), around)
    slope = (state.east_m[2] - state.east_m[0]) / 2e-4
    assert state.east_m_s[1] == pytest.approx(slope, abs=1e-5)


@given(st.floats(0.1, 30.0), st.floats(0.0, 5.0), st.floats(0.5, 10.0), st.floats(0.5, 20.0))
def test_the_way_kept_for_braking_allows_the_speed_it_is_kept_for(
    speed_m_s: float, final_m_s: float, a: float, j: float
) -> None:
    limits = {"acceleration_m_s2": np.array(a), "jerk_m_s3": np.array(j)}
    way = braking_distance_m(np.array(speed_m_s), np.array(final_m_s), **limits)
    assert allowed_speed_m_s(way, np.array(final_m_s), **limits) == pytest.approx(
        max(speed_m_s, final_m_s), rel=1e-6
    )


def test_slowing_down_in_steps_takes_as_long_as_in_one() -> None:
    limits = {"acceleration_m_s2": np.array(3.0), "half_b_m_s": np.array(4.5)}
    whole = braking_time_s(np.array(10.0), np.array(1.0), **limits)
    parts = braking_time_s(np.array(10.0), np.array(4.0), **limits) + braking_time_s(
        np.array(4.0), np.array(1.0), **limits
    )
    assert parts == pytest.approx(whole)


def test_speeding_up_to_12_m_s_takes_4_75_seconds_and_28_5_m() -> None:
    # v/a + a/j = 4 + 0.75 s at half the speed on the mean.
    ramp = Px4Ramps.of(
        np.array([12.0]), acceleration_m_s2=np.array([3.0]), jerk_m_s3=np.array([4.0])
    )
    way, speed, acceleration = ramp.gained(ramp.duration_s)
    assert ramp.duration_s == pytest.approx(4.75)
    assert (way[0], speed[0], acceleration[0]) == pytest.approx((28.5, 12.0, 0.0), abs=1e-9)


@given(st.floats(0.01, 20.0), st.floats(0.0, 1.0))
def test_a_ramp_has_gained_a_fraction_when_it_says(change_m_s: float, fraction: float) -> None:
    change, limits = np.array([change_m_s]), (np.array([3.0]), np.array([4.0]))
    ramp = Px4Ramps.of(change, *limits)
    _, gained, _ = ramp.gained(ramp.time_at_s(np.array([fraction])))
    assert gained == pytest.approx(fraction * change_m_s, abs=1e-6)
    assert ramp.duration_s == pytest.approx(ramp_time_s(change, *limits))


@pytest.mark.parametrize(
    ("speed_m_s", "recorded_m"),
    [(3.0, 5.65), (5.0, 10.85), (8.0, 20.55), (10.0, 29.35), (12.0, 38.5)],
)
def test_stops_are_as_long_as_recorded_from_98_percent_of_the_speed(
    speed_m_s: float, recorded_m: float
) -> None:
    """Means of two to four recorded stops each, which differ by up to 0.8 m among themselves."""
    there = replace(go(500.0, hold=30.0), speed_m_s=speed_m_s)
    segments = fly_px4((takeoff(), go(0.0, hold=30.0), there), PX4).segments
    stop_m = segments.stopping_distance_m[segments.state == BRAKE]
    assert len(stop_m) == 1
    assert stop_m[0] == pytest.approx(recorded_m, rel=0.05, abs=0.5)


def test_only_stops_and_cruises_have_a_stopping_distance() -> None:
    # A corner is braked for, not stopped at; a cruise could be stopped: 5 (5/6 + 0.6) = 7.17 m.
    segments = fly_px4((takeoff(), go(100.0), go(100.0, 100.0, hold=5.0)), PX4).segments
    braking = segments.stopping_distance_m[segments.state == BRAKE]
    assert np.isnan(braking).tolist() == [True, False]
    cruising = segments.stopping_distance_m[segments.state == CRUISE]
    assert cruising == pytest.approx(7.17, abs=0.01)


@pytest.mark.parametrize("speed_m_s", [3.0, 5.0, 8.0, 12.0, 16.0])
@pytest.mark.parametrize("length_m", [4.0, 8.0, 15.0, 25.0, 40.0, 60.0, 120.0])
def test_legs_of_any_length_take_as_long_as_a_point_stepped_along_them(
    length_m: float, speed_m_s: float
) -> None:
    parameters = replace(PX4, speed_max_m_s=16.0)
    # Northward: each axis has the whole acceleration to itself.
    there = replace(go(0.0, length_m, hold=30.0), speed_m_s=speed_m_s)
    motion = fly_px4((takeoff(), go(0.0, hold=30.0), there), parameters)
    end_s = motion.segments.end_s
    took = end_s[motion.arrival_segment[2]] - end_s[motion.arrival_segment[1]] - 30.0
    # A peak that is hardly a cruise is left in one jerk here, in several there.
    assert took == pytest.approx(leg_time_s(length_m, speed_m_s), abs=0.13)


@settings(deadline=None, max_examples=examples(25))
@given(
    st.floats(5.0, 150.0),
    st.floats(2.0, 12.0),
    st.floats(1.5, 6.0),
    st.floats(2.0, 10.0),
    st.floats(1.0, 4.0),
)
def test_legs_follow_acceleration_jerk_and_radius_as_a_stepped_point_does(
    length_m: float, speed_m_s: float, a: float, j: float, radius_m: float
) -> None:
    parameters = replace(
        PX4, acceleration_m_s2=a, jerk_m_s3=j, acceptance_radius_m=radius_m, speed_max_m_s=12.0
    )
    there = replace(go(0.0, length_m, hold=60.0), speed_m_s=speed_m_s)
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), there), parameters)
    end_s = motion.segments.end_s
    took = end_s[motion.arrival_segment[2]] - end_s[motion.arrival_segment[1]] - 60.0
    stepped = leg_time_s(length_m, speed_m_s, acceleration_m_s2=a, jerk_m_s3=j, radius_m=radius_m)
    # A peak that is no cruise is left a little early or late, the more the softer the jerk.
    assert took == pytest.approx(stepped, rel=0.03, abs=0.15)


def test_a_diagonal_is_sped_up_along_faster_than_an_axis() -> None:
    # Both axes give 3 m/s² each: 12 m/s take 12/(3 √2) + 0.75 = 3.58 s instead of 4.75 s.
    def speeding_s(east_m: float, north_m: float) -> float:
        there = replace(go(east_m, north_m, hold=1.0), speed_m_s=12.0)
        segments = fly_px4((takeoff(), go(0.0, hold=60.0), there), PX4).segments
        return float(segments.duration_s[segments.state == STATES.index(FlightState.ACCELERATE)][0])

    assert speeding_s(0.0, 400.0) == pytest.approx(4.75, abs=0.01)
    assert speeding_s(300.0, 300.0) == pytest.approx(3.58, abs=0.01)
