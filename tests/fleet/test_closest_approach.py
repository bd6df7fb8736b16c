"""The closest approach of two vehicles: by hand, against dense sampling, and at rest."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_missions import (
    HOME,
    METRES_PER_DEGREE_NORTH,
    item,
    mission,
    north,
    rtl,
    takeoff,
    waypoint,
)
from made_terrain import ground
from made_trajectories import place, straight, trajectory
from thinning import examples

from planner.fleet.approach import ACCURACY_M, closest_approach
from planner.fleet.separation import Member, Spacing, clearing_delay_s, predict_conflicts
from planner.fleet.trajectory import Pace, Trajectory, make_trajectory, part_of_cubic
from planner.geo.geodesy import LocalFrame
from planner.service.preflight import check
from planner.values import field_values, replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment


VEHICLES = ("falkowski-2023-quadrotor", "arducopter-sitl-quad", "px4-sih-quad")
ROUNDING_M = 1e-6
"""Straight and even motion is followed exactly, but for rounding."""


EAST = straight((0, -50, 0, 30), (20, 50, 0, 30))
"""5 m/s eastward through 0, 0, which is reached after 10 s."""


def test_two_straight_legs_by_hand() -> None:
    # From 8 m west and 6 m south of the first's place with 5 m/s north, 1 m higher: the vector between
    # is (8 + 5t', 6 - 5t', -1) for t' = t - 10; its level part is least at t' = -0.2: 7 and 7.
    other = straight((0, -8, -56, 31), (20, -8, 44, 31))
    found = closest_approach(EAST, other)
    assert found is not None
    assert found.distance_m == pytest.approx(math.sqrt(49 + 49 + 1), abs=ROUNDING_M)
    assert found.first_s == found.second_s == pytest.approx(9.8)


@pytest.mark.parametrize("later_s", [-9.0, -4.0, 0.0, 4.0, 9.0])
@pytest.mark.parametrize("late_s", [(5.0, 0.0), (0.0, 5.0), (5.0, 2.0)])
def test_who_may_be_late_comes_so_much_nearer_to_who_is_behind(
    later_s: float, late_s: tuple[float, float]
) -> None:
    """Both through one place at 5 m/s, at right angles: 5 τ / √2 for what is between their times there."""
    northward = straight((0, 0, -50, 30), (20, 0, 50, 30))
    one, two = (
        replace(flown, late_s=np.full((len(flown.item), 2), late))
        for flown, late in zip((EAST, northward), late_s, strict=True)
    )
    between_s = max(later_s - late_s[0], -later_s - late_s[1], 0.0)
    # Of two alike one is late by so much only as the other is not.
    pace = Pace(flown_by=(), passed_s=np.zeros((2, 1)))
    alike_1, alike_2 = (replace(one, pace=pace), replace(two, pace=pace))
    least_s, most_s = sorted((0.0, late_s[0] - late_s[1]))
    alike_s = max(later_s - most_s, least_s - later_s, 0.0)
    for first, second, gap_s in ((one, two, between_s), (alike_1, alike_2, alike_s)):
        found = closest_approach(first, second, second_later_s=later_s)
        assert found is not None
        assert found.distance_m == pytest.approx(5.0 * gap_s / math.sqrt(2.0), abs=ROUNDING_M)


def test_a_limit_leaves_out_what_is_not_nearer() -> None:
    other = straight((0, -8, -56, 31), (20, -8, 44, 31))
    assert closest_approach(EAST, other, within_m=math.sqrt(99.0) - 0.001) is None
    assert closest_approach(EAST, other, within_m=math.sqrt(99.0) + 0.001) is not None


@pytest.mark.parametrize("late_s", [4.0, -4.0])
@pytest.mark.parametrize("shift_s", [0.0, 1.0, 3.0, 4.0, 9.0])
def test_a_shift_of_starts_brings_crossing_vehicles_nearer_either_way(
    late_s: float, shift_s: float
) -> None:
    """Both through one place at 5 m/s, at right angles, a time τ apart: 5 τ / √2 at the least."""
    northward = straight((0, 0, -50, 30), (20, 0, 50, 30))
    found = closest_approach(EAST, northward, second_later_s=late_s, shift_s=shift_s)
    back = closest_approach(northward, EAST, second_later_s=-late_s, shift_s=shift_s)
    expected_m = 5.0 * max(4.0 - shift_s, 0.0) / math.sqrt(2.0)
    assert found is not None
    assert back is not None
    assert found.distance_m == pytest.approx(expected_m, abs=ROUNDING_M)
    assert back.distance_m == pytest.approx(expected_m, abs=ROUNDING_M)
    assert abs(found.first_s - found.second_s - late_s) <= shift_s + 1e-9


@pytest.mark.parametrize("shift_s", [0.0, 2.0])
def test_two_in_formation_keep_their_distance(shift_s: float) -> None:
    beside = straight((0, -50, 4, 33), (20, 50, 4, 33))
    found = closest_approach(EAST, beside, shift_s=shift_s)
    assert found is not None
    assert found.distance_m == pytest.approx(5.0, abs=ROUNDING_M)


LANDED = straight((0, 0, 3, 0), (1, 0, 3, 0), low_ends=True)


def test_a_landed_vehicle_is_in_the_way_of_one_in_the_air() -> None:
    late = closest_approach(straight((0, -50, 0, 4), (20, 50, 0, 4)), LANDED)
    early = closest_approach(straight((0, -50, 0, 4), (20, 50, 0, 4)), LANDED, second_later_s=500.0)
    assert late is not None
    assert early is not None
    assert late.distance_m == pytest.approx(5.0, abs=ROUNDING_M)  # 3 m aside, 4 m above
    assert early.distance_m == pytest.approx(5.0, abs=ROUNDING_M)
    assert (late.second_s > LANDED.duration_s, early.second_s < 0.0) == (True, True)


def test_two_on_the_ground_are_not_judged() -> None:
    near = straight((0, 0, 2, 0), (1, 0, 2, 0), low_ends=True)
    low = {"is_low": np.array([True, True, True])}
    ground = [Trajectory(**field_values(one) | low) for one in (near, LANDED)]
    assert closest_approach(*ground) is None
    assert not ground[0].is_ever_flying
    assert closest_approach(near, ground[1]) is not None


def test_one_that_ended_in_the_air_stays_there() -> None:
    waits = straight((0, 30, 1, 10), (2, 30, 1, 30))  # over before the other comes by, 1 m aside
    found = closest_approach(EAST, waits)
    assert found is not None
    assert found.distance_m == pytest.approx(1.0, abs=ROUNDING_M)
    assert found.first_s == found.second_s == pytest.approx(16.0)


coordinate = st.floats(-30.0, 30.0)


@st.composite
def flights(draw: st.DrawFn) -> Trajectory:
    """Return three cubics without a jump, each of some seconds."""
    points = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=10, max_size=10))
    rows = np.array(points)
    control_m = np.stack([rows[0:4], rows[3:7], rows[6:10]])
    widths = draw(st.lists(st.floats(1.0, 8.0), min_size=3, max_size=3))
    return trajectory([0.0, *np.cumsum(widths).tolist()], control_m)


@settings(max_examples=examples(60), deadline=None)
@given(flights(), flights(), st.floats(-10.0, 10.0))
def test_the_closest_approach_is_that_of_dense_sampling(
    first: Trajectory, second: Trajectory, later_s: float
) -> None:
    found = closest_approach(first, second, second_later_s=later_s)
    assert found is not None
    begin_s, end_s = min(0.0, later_s), max(first.duration_s, second.duration_s + later_s)
    time_s = np.arange(begin_s, end_s + 0.001, 0.001)
    between_m = place(first, time_s) - place(second, time_s - later_s)
    apart_m = np.linalg.norm(between_m, axis=1)
    assert found.distance_m <= apart_m.min() + ROUNDING_M
    # Between two samples it comes nearer by half the way from the one to the other at the most.
    half_m = 0.5 * np.linalg.norm(np.diff(between_m, axis=0), axis=1)
    least_m = float(np.min(np.minimum(apart_m[1:], apart_m[:-1]) - half_m))
    assert found.distance_m >= least_m - ACCURACY_M


@settings(max_examples=examples(40), deadline=None)
@given(flights(), flights(), st.floats(-5.0, 5.0), st.floats(0.1, 3.0))
def test_no_shift_within_the_error_comes_nearer(
    first: Trajectory, second: Trajectory, later_s: float, shift_s: float
) -> None:
    found = closest_approach(first, second, second_later_s=later_s, shift_s=shift_s)
    assert found is not None
    each = [
        closest_approach(first, second, second_later_s=later_s + share * shift_s)
        for share in (-1.0, -0.5, 0.0, 0.3, 1.0)
    ]
    assert found.distance_m <= min(one.distance_m for one in each if one is not None) + ACCURACY_M
    there_s = found.first_s - found.second_s
    assert abs(there_s - later_s) <= shift_s + 1e-6
    at = closest_approach(first, second, second_later_s=there_s)
    assert at is not None
    assert at.distance_m == pytest.approx(found.distance_m, abs=ACCURACY_M)


@settings(max_examples=examples(40), deadline=None)
@given(flights(), flights(), st.floats(0.5, 30.0), st.floats(0.0, 2.0))
def test_a_rough_answer_is_none_where_the_exact_one_is_and_never_too_far(
    first: Trajectory, second: Trajectory, within_m: float, shift_s: float
) -> None:
    exact = closest_approach(first, second, shift_s=shift_s, within_m=within_m)
    for accuracy_m in (0.5, np.inf):
        rough = closest_approach(
            first, second, shift_s=shift_s, within_m=within_m, accuracy_m=accuracy_m
        )
        assert (rough is None) is (exact is None)
        if rough is not None and exact is not None:
            most_m = exact.distance_m + ACCURACY_M
            assert most_m - accuracy_m - ACCURACY_M <= rough.distance_m <= most_m


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_a_part_of_a_cubic_lies_on_it(begin: float, end: float, share: float) -> None:
    whole = EAST.control_m[1:2] + np.array([[0.0], [9.0], [-4.0], [2.0]])
    part = part_of_cubic(whole, np.array([begin]), np.array([end]))
    one, other = (trajectory([0.0, 1.0], control) for control in (part, whole))
    at = begin + share * (end - begin)
    np.testing.assert_allclose(
        place(one, np.array([share * (1 - 1e-12)])),
        place(other, np.array([at * (1 - 1e-12)])),
        atol=1e-6,
    )


def case_of(one: Mission, vehicle: str) -> Assessment:
    assessment = check(one, load_vehicle(vehicle)).assessment
    assert assessment is not None
    return assessment


CURVED = mission(
    takeoff(20),
    waypoint(60, 30, hold_s=3.0),
    item(18, north(80), 30.0, params=(1.0, 0.0, 15.0, 0.0)),
    item(16, north(120), 25.0, longitude_deg=8.001),
    rtl(),
)


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_the_cubics_follow_every_law_of_motion(vehicle: str) -> None:
    assessment = case_of(CURVED, vehicle)
    away = LocalFrame(latitude_deg=47.001, longitude_deg=8.002)
    for frame in (assessment.route.frame, away):
        cubics = make_trajectory(
            assessment.flight.motion, assessment.route, frame, min_nav_alt_m=2.5
        )
        assert cubics.duration_s == pytest.approx(assessment.flight.time_s, abs=1e-9)
        time_s = np.linspace(0.0, assessment.flight.time_s, 20_011, endpoint=False)
        state = assessment.flight.motion.state_at_time(time_s)
        there = assessment.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
        flown = np.stack((*frame.east_north_m(*there), state.height_m), axis=-1)
        # The cubics are good to 1.5 mm where they are looked at, and may be worse in between.
        np.testing.assert_allclose(place(cubics, time_s), flown, atol=2e-3)
    high_s = time_s[state.height_m > 2.5]
    step_s = time_s[1]
    low = cubics.is_low & ~cubics.is_rest
    assert cubics.is_low[[0, -1]].all()
    assert cubics.end_s[low & (cubics.start_s < high_s[0])].max() == pytest.approx(
        high_s[0], abs=step_s
    )
    assert cubics.start_s[low & (cubics.start_s > high_s[0])].min() == pytest.approx(
        high_s[-1], abs=step_s
    )
    assert cubics.control_m[-1, :, 2] == pytest.approx(0.0, abs=1e-9)  # on the ground, at last


def test_a_flight_without_a_landing_ends_in_the_air() -> None:
    assessment = case_of(mission(takeoff(20), waypoint(60, 30)), VEHICLES[1])
    made = make_trajectory(
        assessment.flight.motion, assessment.route, assessment.route.frame, min_nav_alt_m=2.5
    )
    assert (made.is_low[0], made.is_low[-1]) == (True, False)
    np.testing.assert_allclose(made.control_m[-1], [[0.0, 60.0, 30.0]] * 4, atol=0.01)


def test_a_flight_down_a_hill_flies_though_it_is_below_home() -> None:
    """Home on a ridge 80 m above the land: up by 5 m, down to a place below, where 10 m count."""
    terrain = ground(80.0, at_m=0.0)
    hill = mission(takeoff(5), waypoint(200, -40), item(21, north(300), 0.0))
    assessment = check(
        hill, load_vehicle(VEHICLES[1]), terrain=terrain, home_amsl_m=480.0
    ).assessment
    assert assessment is not None
    made = make_trajectory(
        assessment.flight.motion, assessment.route, assessment.route.frame, min_nav_alt_m=10.0
    )
    low = made.is_low & ~made.is_rest
    assert made.control_m[-1, 0, 2] == pytest.approx(-80.0, abs=0.1)
    assert made.is_ever_flying
    assert made.start_s[low].min() > 0.5 * made.duration_s
    assert made.control_m[low][:, :, 2].max() == pytest.approx(-70.0, abs=0.1)


@pytest.mark.parametrize(("apart_m", "conflicts"), [(9.9898, 1), (9.9902, 0)])
def test_more_than_a_centimetre_nearer_than_the_separation_is_too_near(
    apart_m: float, conflicts: int
) -> None:
    beside = straight((0, -50, apart_m, 30), (20, 50, apart_m, 30))
    fleet = [
        Member(file=name, trajectory=one, start_s=0.0, home_amsl_m=400.0)
        for name, one in (("a", EAST), ("b", beside))
    ]
    assert len(list(predict_conflicts(fleet, Spacing(separation_m=10.0)))) == conflicts


def test_the_delay_that_clears_is_the_smallest_whole_second() -> None:
    """5 τ / √2 must be 10 m but for the accuracy: τ ≥ 2.83 s, and 2 · 1 s more for late starts."""
    northward = straight((0, 0, -50, 30), (20, 0, 50, 30))
    first, second = (
        Member(file=name, trajectory=one, start_s=0.0, home_amsl_m=400.0)
        for name, one in (("a", EAST), ("b", northward))
    )
    for error_s, expected_s in ((0.0, 3.0), (1.0, 5.0)):
        spacing = Spacing(separation_m=10.0, start_error_s=error_s)
        assert len(list(predict_conflicts([first, second], spacing))) == 1
        assert clearing_delay_s(first, second, spacing) == expected_s


def test_a_delay_may_be_longer_than_the_flight_that_is_in_the_way() -> None:
    """The first holds for 29 of 30 s where the second passes; each may start 5 s late or early."""
    holds = straight((0, 0, 0, 30), (29, 0, 0, 30), (30, 0, 500, 30))
    passes = straight((0, 0, -500, 30), (1, 0, 0, 30), (20, 100, 0, 30))
    first, second = (
        Member(file=name, trajectory=one, start_s=0.0, home_amsl_m=400.0)
        for name, one in (("a", holds), ("b", passes))
    )
    # it is there after a second, and has to be 2 · 5 s later than 29 s
    assert clearing_delay_s(first, second, Spacing(separation_m=3.0, start_error_s=5.0)) == 39.0


def test_no_delay_clears_what_stands_in_the_way() -> None:
    waits = straight((0, 30, 1, 10), (2, 30, 1, 30))
    first, second = (
        Member(file=name, trajectory=one, start_s=0.0, home_amsl_m=400.0)
        for name, one in (("a", waits), ("b", EAST))
    )
    assert clearing_delay_s(first, second, Spacing(separation_m=3.0)) is None


@pytest.mark.parametrize("vehicle", VEHICLES)
def test_real_flights_are_as_near_as_their_samples(vehicle: str) -> None:
    """Out and back past each other, 35 m east of each other at home, in the frame of the first."""
    degrees_east = 35.0 / (METRES_PER_DEGREE_NORTH * math.cos(math.radians(47.0)))
    other = mission(
        takeoff(25),
        item(16, north(110), 31.0, longitude_deg=HOME.longitude_deg - 0.5 * degrees_east),
        item(21, north(0), 0.0, longitude_deg=HOME.longitude_deg + degrees_east),
    )
    cases = [case_of(CURVED, vehicle), case_of(other, vehicle)]
    frame = cases[0].route.frame
    made = [
        make_trajectory(assessment.flight.motion, assessment.route, frame, min_nav_alt_m=2.5)
        for assessment in cases
    ]
    found = closest_approach(*made)
    assert found is not None
    nearest_s, half_s = 0.5 * made[0].duration_s, made[0].duration_s
    for step_s in (0.01, 0.001):
        time_s = np.arange(max(0.0, nearest_s - half_s), nearest_s + half_s, step_s)
        places = []
        for assessment in cases:
            state = assessment.flight.motion.state_at_time(time_s)
            there = assessment.route.frame.latitude_longitude_deg(state.east_m, state.north_m)
            places.append(np.stack((*frame.east_north_m(*there), state.height_m), axis=-1))
        apart_m = np.linalg.norm(places[0] - places[1], axis=1)
        apart_m[(places[0][:, 2] < 2.5) & (places[1][:, 2] < 2.5)] = np.inf
        nearest_s, half_s = float(time_s[np.argmin(apart_m)]), 0.05
    assert apart_m.min() - ACCURACY_M <= found.distance_m <= apart_m.min() + 1e-6
