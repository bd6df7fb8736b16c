"""Legs of PX4 that climb or descend: both axes keep to their limits, and heights have vertices."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import go, takeoff
from hypothesis import given, settings
from hypothesis import strategies as st
from px4_flights import fly_px4
from thinning import examples

from planner.flight.motion.kinematics import STATES
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.mission.route.stage import Stage

PX4 = Px4Parameters()


def legs_s(*places: Stage, parameters: Px4Parameters = PX4) -> np.ndarray:
    """Return the times of legs that begin standing over home at 50 m."""
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), *places), parameters)
    return np.diff(motion.segments.end_s[motion.arrival_segment[1:]])


@pytest.mark.parametrize(
    ("way_m", "climb_m", "speed_m_s"),
    [
        (200.0, 100.0, 3.0 * 2.0),  # vertical limit: 3 m/s up over 100 m
        (400.0, 40.0, 10.0),  # horizontal limit
        (200.0, -45.0, 1.5 * 200.0 / 45.0),  # vertical limit: 1.5 m/s down
    ],
)
def test_the_slower_axis_sets_the_speed_of_both(
    way_m: float, climb_m: float, speed_m_s: float
) -> None:
    there = replace(go(0.0, way_m, 50.0 + climb_m, hold=1.0), speed_m_s=10.0)
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), there), PX4)
    middle = motion.segments.end_s[motion.arrival_segment[1]] + 0.5 * way_m / speed_m_s
    state = motion.state_at_time(np.array([middle]))
    assert state.ground_speed_m_s == pytest.approx(speed_m_s, rel=0.01)
    assert state.climb_m_s == pytest.approx(speed_m_s * climb_m / way_m, rel=0.01)


def test_a_steep_leg_is_a_climb_and_a_shallow_one_is_not() -> None:
    motion = fly_px4((takeoff(), go(0.0, hold=9.0), go(30.0, 0.0, 90.0), go(130.0, 0.0, 95.0)), PX4)
    states = [STATES[state] for state in motion.segments.state]
    assert states[2] == "climb"
    assert states[3:] == ["accelerate", "cruise", "brake"]


def test_a_gentle_slope_that_ends_level_is_flown_through() -> None:
    # 2 m on 100 m at 5 m/s is 0.1 m/s: below 0.5 m/s the height does not slow the way.
    level, gentle = (
        legs_s(go(0.0, 100.0, 50.0 + climb), go(0.0, 200.0, 50.0 + climb, hold=1.0))
        for climb in (0.0, 2.0)
    )
    assert gentle.sum() == pytest.approx(level.sum(), abs=0.1)


@pytest.mark.parametrize(
    ("way_m", "climb_m", "speed_m_s", "crawl_m_s"),
    [
        # 2 m before the waypoint the climb may be at most (−16 + sqrt(256 + 32 · 0.6))/2 = 0.295 m/s
        # 0.6 m below it; on a slope of 3 : 10 that is 0.98 m/s over ground.
        (100.0, 30.0, 5.0, 0.982),
        # Down at 3 m/s², (−9 + sqrt(81 + 24 · 0.6))/2 = 0.384 m/s; on 1 : 3 0.6667 m above, 0.424 m/s.
        (100.0, -30.0, 5.0, 1.279),
        (60.0, -20.0, 5.0, 1.273),
        (60.0, -20.0, 10.0, 1.273),
    ],
)
def test_a_steep_slope_that_ends_level_slows_to_a_crawl(
    way_m: float, climb_m: float, speed_m_s: float, crawl_m_s: float
) -> None:
    there = go(0.0, way_m, 50.0 + climb_m)
    aside = replace(there, east_m=100.0)
    slope = [replace(one, speed_m_s=speed_m_s) for one in (there, aside)]
    motion = fly_px4((takeoff(), go(0.0, hold=60.0), *slope), PX4)
    passed = motion.segments.end_s[motion.arrival_segment[2:3]]
    assert motion.state_at_time(passed).ground_speed_m_s == pytest.approx(crawl_m_s, abs=0.005)


@pytest.mark.parametrize("climb_m", [2.0, 10.0, 20.0, -10.0, -20.0])
@pytest.mark.parametrize(
    "change", [{}, {"acceleration_m_s2": 1.0}, {"jerk_m_s3": 20.0}], ids=["", "gentle", "brisk"]
)
def test_a_waypoint_on_a_straight_slope_costs_nothing(
    climb_m: float, change: dict[str, float]
) -> None:
    changed = replace(PX4, **change)
    end = go(0.0, 40.0, 50.0 + 2.0 * climb_m, hold=1.0)
    whole = legs_s(end, parameters=changed).sum()
    parts = legs_s(go(0.0, 20.0, 50.0 + climb_m), end, parameters=changed).sum()
    assert parts == pytest.approx(whole, abs=0.002)


def slope_s(way_m: float, fall_m: float, v: float, *, corner_m_s: float) -> float:
    """Return the time of a slope down from rest until 2 m before its end, stepped.

    It ends level in a corner: of the two braking laws the level one, at 3 m/s², leads to the speed of the
    corner, the upright one, at 3 m/s² as well, to none.
    """
    length_m, step_s = math.hypot(way_m, fall_m), 0.002
    level, upright = way_m / length_m, fall_m / length_m
    cruise = min(v / level, 1.5 / upright)
    most, jerk = min(3.0 / level, 3.0 / upright), 4.0 / max(level, upright)
    way = speed = acceleration = time = 0.0
    while (length_m - way) * level > 2.0:
        wanted = cruise
        for share, final in ((level, corner_m_s), (upright, 0.0)):
            a, half_b = 3.0 / share, 2.0 * 3.0**2 / 4.0 / share
            square = half_b**2 + 2.0 * a * (length_m - way) + (final / share) ** 2
            wanted = min(wanted, math.sqrt(square) - half_b)
        settled = speed + acceleration * abs(acceleration) / (2.0 * jerk)
        acceleration += math.copysign(jerk * step_s, wanted - settled)
        acceleration = max(-most, min(most, acceleration))
        way += speed * step_s
        speed += acceleration * step_s
        time += step_s
    return time


def test_of_two_braking_laws_that_cross_the_slower_is_flown_all_along() -> None:
    # A right angle is passed at sqrt(½ · 3 m/s² · 2 m · tan 45°) = 1.73 m/s.
    there = replace(go(0.0, 60.0, 30.0), speed_m_s=10.0)
    took = legs_s(there, replace(there, east_m=100.0))[0]
    # The law of the point has no jerk in it where one law takes over from the other.
    assert took == pytest.approx(slope_s(60.0, 20.0, 10.0, corner_m_s=1.73), abs=0.2)


def test_a_slope_that_goes_on_is_flown_through() -> None:
    whole = legs_s(go(0.0, 200.0, 90.0, hold=1.0)).sum()
    parts = legs_s(go(0.0, 100.0, 70.0), go(0.0, 200.0, 90.0, hold=1.0)).sum()
    assert parts == pytest.approx(whole, abs=0.1)


@pytest.mark.parametrize(
    ("change", "climb_m"), [({"climb_speed_m_s": 2.0}, 60.0), ({"descent_speed_m_s": 1.0}, -40.0)]
)
def test_two_thirds_of_a_vertical_speed_take_up_to_half_as_long_again(
    change: dict[str, float], climb_m: float
) -> None:
    slope = replace(go(0.0, 60.0, 50.0 + climb_m, hold=1.0), speed_m_s=10.0)
    before = legs_s(slope)[0]
    changed = replace(PX4, **change)
    after = legs_s(slope, parameters=changed)[0]
    # The ends of the leg stay as they are.
    assert 0.3 < (after - before) / before < 0.5


def height_change_s(way_m: float, v: float, *, a: float, j: float, r: float = 0.8) -> float:
    """Return the time of a height change from rest until it is within a band of its end.

    Ramp, the law u² + 4 (a²/j) u = 2 a d from where it allows v to where it is d = r from the end, and
    what is between at v.
    """
    half_b = 2.0 * a**2 / j
    last = math.sqrt(half_b**2 + 2.0 * a * r) - half_b
    ramp = v / a + a / j if v >= a**2 / j else 2.0 * math.sqrt(v / j)
    braking = (v - last) / a + 2.0 * a / j * math.log(v / last)
    # Flown is u + u̇²/2j, u̇ = 2 a u/(2 u + b): sooner by the integral of u̇²/2j dt/u.
    braking -= a / (2.0 * j) * math.log((v + half_b) / (last + half_b))
    before = v * (v + 2.0 * half_b) / (2.0 * a)
    return ramp + braking + (way_m - 0.5 * v * ramp - before) / v


@pytest.mark.parametrize(
    ("change", "up_s", "down_s"),
    [
        ({}, height_change_s(100.0, 3.0, a=4.0, j=4.0), height_change_s(100.0, 1.5, a=3.0, j=4.0)),
        ({"climb_speed_m_s": 2.0}, height_change_s(100.0, 2.0, a=4.0, j=4.0), None),
        ({"descent_speed_m_s": 1.0}, None, height_change_s(100.0, 1.0, a=3.0, j=4.0)),
        ({"acceleration_up_m_s2": 2.0}, height_change_s(100.0, 3.0, a=2.0, j=4.0), None),
        ({"acceleration_down_m_s2": 1.5}, None, height_change_s(100.0, 1.5, a=1.5, j=4.0)),
        (
            {"jerk_m_s3": 8.0},
            height_change_s(100.0, 3.0, a=4.0, j=8.0),
            height_change_s(100.0, 1.5, a=3.0, j=8.0),
        ),
        (
            {"altitude_acceptance_m": 0.2},
            height_change_s(100.0, 3.0, a=4.0, j=4.0, r=0.2),
            height_change_s(100.0, 1.5, a=3.0, j=4.0, r=0.2),
        ),
    ],
)
def test_each_parameter_moves_climbs_and_descents_as_the_law_says(
    change: dict[str, float], up_s: float | None, down_s: float | None
) -> None:
    changed = replace(PX4, **change)
    high = go(0.0, 0.0, 150.0, hold=40.0)
    took = legs_s(high, replace(high, height_m=50.0, hold_s=1.0), parameters=changed)
    usual = legs_s(high, replace(high, height_m=50.0, hold_s=1.0))
    for found, before, expected_s, hold_s in (
        (took[0], usual[0], up_s, 40.0),
        (took[1], usual[1], down_s, 1.0),
    ):
        if expected_s is None:
            assert found == pytest.approx(before, abs=0.02)
        else:
            # The onset of braking is limited in jerk, the law's is not.
            assert found - hold_s == pytest.approx(expected_s, abs=0.15)


@settings(deadline=None, max_examples=examples(40))
@given(st.floats(20.0, 300.0), st.floats(-40.0, 100.0), st.floats(2.0, 12.0))
def test_no_leg_beats_either_of_its_axes(way_m: float, climb_m: float, speed_m_s: float) -> None:
    took = legs_s(replace(go(0.0, way_m, 50.0 + climb_m, hold=1.0), speed_m_s=speed_m_s))[0] - 1.0
    vertical = abs(climb_m) - 0.8
    least = max((way_m - 2.0) / speed_m_s, vertical / (3.0 if climb_m > 0.0 else 1.5))
    assert took > least
    assert took < math.hypot((way_m + 45.0) / speed_m_s + 12.0, abs(climb_m) / 1.5 + 12.0)


def test_a_climb_turns_into_a_descent_in_one_change_of_speed() -> None:
    """From u up to 1.5 m/s down at a jerk of 4 m/s³ without a rest between: 2 √((u + 1.5)/4) s."""
    motion = fly_px4((takeoff(), go(0.0, 0.0, 80.0), go(0.0, 0.0, 60.0, hold=1.0)), PX4)
    top_s = motion.segments.end_s[motion.arrival_segment[1]]
    climb_m_s = float(motion.state_at_time(np.array([top_s])).climb_m_s[0])
    assert 0.3 < climb_m_s < 0.5
    times_s = top_s + np.arange(0.0, 5.0, 0.01)
    down_s = times_s[motion.state_at_time(times_s).climb_m_s < -1.499][0]
    assert down_s - top_s == pytest.approx(2.0 * math.sqrt((climb_m_s + 1.5) / 4.0), abs=0.04)
