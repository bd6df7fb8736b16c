"""Legs from standing that end just outside the acceptance radius, by hand calculation.

At limited jerk j a way x takes (6 x/j)^(1/3) from rest: x = j t³/6, as long as the acceleration j t is
below its limit.  Defaults: j = 4 m/s³, a radius of 2 m, 0.8 m of height.
"""

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

from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.mission.route.stage import Stage

PX4 = Px4Parameters()
J, R, BAND = 4.0, 2.0, 0.8
# A hold over the place of the take-off is settled on exactly.
STANDING = (takeoff(), go(0.0, hold=30.0))


def leg_s(leg: Stage, *after: Stage, noise_m: float = 0.0) -> float:
    """Return the time of a leg from standing until it is reported as reached. [s]"""
    motion = fly_px4((*STANDING, leg, *after), PX4, noise_m=noise_m)
    begun, reached = motion.segments.end_s[motion.arrival_segment[[1, 2]]]
    return float(reached - begun)


def level(beyond_m: float) -> Stage:
    return go(0.0, R + beyond_m)


def upright(beyond_m: float, sign: float) -> Stage:
    return go(0.0, 0.0, 50.0 + sign * (BAND + beyond_m))


def jerked_s(way_m: float) -> float:
    return math.cbrt(6.0 * way_m / J)


@pytest.mark.parametrize("beyond_m", [0.01, 0.05, 0.1, 0.2, 0.3, 0.4])
def test_a_level_leg_takes_what_its_jerk_allows(beyond_m: float) -> None:
    # (6·0.4/4)^(1/3) = 0.843 s and j t = 3.4 m/s²: the limit of 3 m/s² holds back the last centimetres.
    assert leg_s(level(beyond_m)) == pytest.approx(jerked_s(beyond_m), rel=0.01)
    assert leg_s(level(beyond_m), go(0.0, 400.0)) == pytest.approx(jerked_s(beyond_m), rel=0.01)


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("beyond_m", [0.002, 0.01, 0.02])
def test_a_climb_or_descent_takes_what_its_jerk_allows(beyond_m: float, sign: float) -> None:
    found = leg_s(upright(beyond_m, sign))
    assert found == pytest.approx(jerked_s(beyond_m), rel=0.02)


@settings(deadline=None, max_examples=examples(60))
@given(
    st.lists(st.floats(0.001, 3.0), min_size=2, max_size=2).map(sorted),
    st.sampled_from(["level", "up", "down"]),
    st.sampled_from([0.0, 0.31]),
    st.sampled_from([(), (400.0,)]),
)
def test_a_longer_leg_takes_longer_and_no_leap_longer(
    beyond_m: list[float], way: str, noise_m: float, on_m: tuple[float, ...]
) -> None:
    legs = [
        level(x) if way == "level" else upright(x, 1.0 if way == "up" else -1.0) for x in beyond_m
    ]
    short_s, long_s = (
        leg_s(leg, *(go(0.0, m, leg.height_m) for m in on_m), noise_m=noise_m) for leg in legs
    )
    assert short_s <= long_s + 1e-3
    # What is added takes no longer than from rest, where it is slowest.
    added_m = beyond_m[1] - beyond_m[0]
    alone = level(added_m) if way == "level" else upright(added_m, 1.0 if way == "up" else -1.0)
    assert long_s - short_s <= leg_s(alone, noise_m=noise_m) + 1e-3


@pytest.mark.parametrize("radius_m", [2.0, 6.0])
@pytest.mark.parametrize("course_deg", [60, 100, 140, 175])
def test_a_long_hold_ends_at_its_place_however_short_the_leg_to_it(
    radius_m: float, course_deg: int
) -> None:
    # Turned into at speed, a leg of 8 m is left beside its line; a hold of 40 s is far longer than
    # the seconds that the way back takes.
    course = math.radians(course_deg)
    east_m, north_m = 8.0 * math.sin(course), 60.0 + 8.0 * math.cos(course)
    held = replace(go(east_m, north_m, hold=40.0), acceptance_radius_m=radius_m)
    corner = replace(go(0.0, 60.0), acceptance_radius_m=radius_m)
    motion = fly_px4((takeoff(), corner, held), PX4)
    end = motion.state_at_time(motion.segments.end_s[-1:])
    # A straight that passes its place within 0.1 m leads to it.
    assert math.hypot(end.east_m[0] - east_m, end.north_m[0] - north_m) < 0.15


def test_a_waypoint_reached_braking_hands_on_its_deceleration() -> None:
    """Legs of 3 m: 1.53 s each, flown by PX4 in simulation; 1.37 s if a deceleration ended at once."""
    ways = [go(20.0 + 3.0 * k, height_m=10.0) for k in range(12)]
    motion = fly_px4((takeoff(10.0), *ways), PX4)
    legs_s = np.diff(motion.segments.end_s[motion.arrival_segment])[3:9]
    assert legs_s == pytest.approx(np.full(6, 1.53), abs=0.1)


def test_legs_right_behind_a_takeoff_do_not_wait_for_its_climb() -> None:
    """Legs of 3 m from 0.8 m below their height on: 1.42, 1.36 and 1.56 s, flown by a build of PX4.

    0.5 s is what a leg from standing is off at most; waiting for the climb's tail they took 5.6 s.
    """
    ways = [go(3.0 * k, height_m=15.0) for k in range(1, 12)]
    motion = fly_px4((takeoff(15.0), *ways), PX4)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert reached_s[3] - reached_s[0] == pytest.approx(1.42 + 1.36 + 1.56, abs=0.5)


def ring(sides: int, radius_m: float) -> list[tuple[float, float, float]]:
    """Return the corners of a ring that is flown from home back to it."""
    angles = [2.0 * math.pi * k / sides for k in range(1, sides + 1)]
    return [(radius_m * (1.0 - math.cos(a)), radius_m * math.sin(a), 20.0) for a in angles]


# From the first of the waypoints that a build of PX4 was flown over, at 5 m/s with quiet sensors, to the
# one behind so many legs; by ``PositionSmoothing`` stepped at 100 Hz with a vehicle that follows exactly
# 66.1, 41.5, 28.0, 37.8 and 26.4 s.
FLOWN = {
    "a ring of 36 sides of 7 m": (ring(36, 40.0), 35, 66.66, 0.03),
    "a ring of 24 sides of 5 m": (ring(24, 20.0), 23, 42.00, 0.03),
    "20 m up and down 3 m": (
        [(0.0, 20.0 * k, 20.0 + 3.0 * (k % 2)) for k in range(1, 10)],
        7,
        28.15,
        0.02,
    ),
    "triangles of 10 m": (
        [(0.0, 15.0, 20.0), *(((10.0, 15.0, 20.0), (5.0, 23.7, 20.0), (0.0, 15.0, 20.0)) * 4)],
        11,
        39.00,
        0.02,
    ),
    # What the vehicle lags as it turns about, 0.1 s each time, is left out.
    "there and back over 10 m": (
        [(0.0, 20.0 - 10.0 * (k % 2), 20.0) for k in range(11)],
        8,
        27.26,
        0.05,
    ),
}


@pytest.mark.parametrize("name", FLOWN)
def test_short_legs_take_what_they_were_flown_in(name: str) -> None:
    places, legs, flown_s, rel = FLOWN[name]
    motion = fly_px4((takeoff(), *(go(*place) for place in places)), PX4)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert reached_s[1 + legs] - reached_s[1] == pytest.approx(flown_s, rel=rel)


@pytest.mark.parametrize("rise_m", [0.5, 1.0, 2.0])
def test_heights_that_change_do_not_slow_short_legs(rise_m: float) -> None:
    """Legs of 10 m up and down: ``PositionSmoothing`` stepped at 100 Hz flies 2.15 to 2.22 s each."""
    places = [(0.0, 10.0 * k, 20.0 + rise_m * (k % 2)) for k in range(1, 12)]
    motion = fly_px4((*STANDING, *(go(*place) for place in places)), PX4)
    legs_s = np.diff(motion.segments.end_s[motion.arrival_segment])[3:-2]
    assert legs_s == pytest.approx(np.full(len(legs_s), 2.18), abs=0.1)


@pytest.mark.parametrize(
    ("length_m", "rise_m", "flown_s"),
    [
        (8.0, 5.0, 43.50),
        (15.0, 5.0, 44.53),
        (15.0, 8.0, 60.99),
        (20.0, 8.0, 62.87),
        (20.0, 12.0, 82.45),
        (30.0, 8.0, 70.07),
        (30.0, 15.0, 100.90),
    ],
)
def test_steep_saw_teeth_are_joined_in_the_time_of_their_climb(
    length_m: float, rise_m: float, flown_s: float
) -> None:
    """Eleven legs up and down at 5 m/s, from standing: ``PositionSmoothing`` stepped at 100 Hz."""
    places = [(0.0, length_m * k, 20.0 + rise_m * (k % 2)) for k in range(1, 12)]
    standing = takeoff(20.0), go(0.0, height_m=20.0, hold=30.0)
    motion = fly_px4((*standing, *(go(*place) for place in places)), PX4)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert reached_s[-1] - reached_s[1] == pytest.approx(flown_s, rel=0.02)


@pytest.mark.parametrize(
    ("length_m", "rise_m", "stairs", "flown_s"),
    [
        (15.0, 8.0, False, 56.10),
        (8.0, 5.0, False, 40.00),
        (10.0, 3.0, False, 29.10),
        (20.0, 12.0, False, 75.60),
        # A level leg behind each climb.
        (15.0, 8.0, True, 37.64),
    ],
)
def test_steep_legs_take_what_they_were_flown_in(
    length_m: float,
    rise_m: float,
    stairs: bool,  # noqa: FBT001 - a table of cases
    flown_s: float,
) -> None:
    """From the first waypoint to the last, flown by a build of PX4 at 5 m/s with quiet sensors.

    A leg is reported up to a few tenths of a second late: 3 %.
    """
    count = 9 if stairs else 11
    steps = [(k + 1) // 2 if stairs else k % 2 for k in range(1, count + 1)]
    places = [(0.0, length_m * k, 20.0 + rise_m * up) for k, up in enumerate(steps, start=1)]
    standing = takeoff(20.0), go(0.0, height_m=20.0, hold=30.0)
    motion = fly_px4((*standing, *(go(*place) for place in places)), PX4)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert reached_s[-1] - reached_s[2] == pytest.approx(flown_s, rel=0.03)


@pytest.mark.parametrize(
    ("width_m", "rise_m", "speed_m_s", "taken_s", "rel"),
    [
        # Flown by a build of PX4 with quiet sensors; what the vehicle lags as it turns back is left out.
        (20.0, 5.0, 3.0, 58.89, 0.02),
        (15.0, 3.0, 2.0, 53.35, 0.02),
        # ``PositionSmoothing`` stepped at 100 Hz with a vehicle that follows exactly.
        (30.0, 4.0, 4.0, 63.64, 0.015),
        (30.0, 1.5, 4.0, 53.45, 0.015),
        (30.0, -4.0, 4.0, 62.15, 0.015),
        (25.0, -2.0, 5.0, 44.50, 0.015),
        (40.0, 8.0, 5.0, 77.70, 0.015),
        (10.0, 2.0, 2.0, 35.46, 0.05),
    ],
)
def test_lanes_over_a_facade_take_what_they_were_flown_in(
    width_m: float, rise_m: float, speed_m_s: float, taken_s: float, rel: float
) -> None:
    """Lanes to and fro, straight up or down between them, from the first waypoint to the eleventh."""
    first_m = 20.0 if rise_m > 0.0 else 60.0
    places = [(width_m * ((k + 1) // 2 % 2), 30.0, first_m + rise_m * (k // 2)) for k in range(12)]
    legs = (replace(go(*place), speed_m_s=speed_m_s) for place in places)
    motion = fly_px4((takeoff(first_m), *legs), PX4)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert reached_s[11] - reached_s[1] == pytest.approx(taken_s, rel=rel)


def test_a_vehicle_with_drag_waits_over_a_waypoint_for_its_height_alone() -> None:
    """It overshoots the waypoint; stepped with its controller it climbs the 1.5 m in 1.70 s."""
    places = [(30.0 * ((k + 1) // 2 % 2), 30.0, 20.0 + 1.5 * (k // 2)) for k in range(8)]
    legs = (replace(go(*place), speed_m_s=4.0) for place in places)
    motion = fly_px4((takeoff(20.0), *legs), PX4, drag_per_s=1.0)
    reached_s = motion.segments.end_s[motion.arrival_segment]
    assert np.diff(reached_s)[4:7:2] == pytest.approx(1.70, abs=0.1)


@pytest.mark.parametrize("turned_deg", [30.0, 40.0, 50.0])
@pytest.mark.parametrize("length_m", [0.5, 0.6, 0.7, 1.5])
def test_the_end_of_a_flight_has_a_way_to_stop(length_m: float, turned_deg: float) -> None:
    """Also where the last place is reached within the turn to it, which ends R before that place."""
    turned = math.radians(turned_deg)
    last = go(60.0 + length_m * math.cos(turned), length_m * math.sin(turned))
    end = fly_px4((takeoff(), go(60.0), last), PX4).segments
    assert end.stopping_distance_m[-1] == pytest.approx(end.distance_m[-1] + R, abs=1e-3)
