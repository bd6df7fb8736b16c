"""PX4's return: how high it flies, where it waits, and many returns at once."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from made_missions import item, mission, north, waypoint
from made_missions import takeoff as takeoff_item
from made_returns import to_home
from px4_flights import fly_px4, px4_returns

from planner.flight.motion.kinematics import STATES, Motion
from planner.flight.motion.px4.moves import moves_of_stages, return_heights_m
from planner.flight.pilot import make_pilot
from planner.mission.route.stage import Stage, StageKind
from planner.service.preflight import check
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.px4 import Px4Parameters

PX4 = Px4Parameters()
RETURN = stage(StageKind.RETURN, height_m=0.0)


@pytest.mark.parametrize(
    ("distance_m", "height_m", "flown_m"),
    [
        (200.0, 12.0, 30.0),  # RTL_RETURN_ALT
        (200.0, 80.0, 80.0),  # higher already: keeps its height
        (8.0, 2.0, 8.0),  # in the cone of 45° within RTL_MIN_DIST: 8/tan 45°
        (8.0, 20.0, 20.0),
        (3.0, 1.0, 4.0),  # outside the acceptance radius twice that at least
        (1.5, 1.0, 3.0),  # within it twice the distance
    ],
)
def test_returns_are_flown_at_the_height_of_the_source(
    distance_m: float, height_m: float, flown_m: float
) -> None:
    found = return_heights_m(np.array([distance_m]), np.array([height_m]), PX4)
    assert found == pytest.approx(flown_m)


@pytest.mark.parametrize(
    ("change", "flown_m"),
    [
        ({"return_altitude_m": 50.0}, 10.0),
        ({"return_min_distance_m": 5.0}, 30.0),
        ({"return_cone_angle_rad": math.radians(60.0)}, 10.0 / math.tan(math.radians(60.0))),
        ({"return_cone_angle_rad": 0.0}, 30.0),
        ({"acceptance_radius_m": 7.0}, 14.0),
    ],
)
def test_each_parameter_of_the_cone_moves_the_height_10_m_from_home(
    change: dict[str, float], flown_m: float
) -> None:
    changed = replace(PX4, **change)
    found = return_heights_m(np.array([10.0]), np.array([2.0]), changed)
    assert found == pytest.approx(flown_m)


@pytest.mark.parametrize(
    ("distance_m", "highest_m"),
    [
        (6.9, 12.0),  # nearer than RTL_MIN_DIST less 3 m: 6.9 m in its cone, lower than it is
        (7.1, 30.0),
        (9.0, 30.0),  # so predicted, flown from 10.5 m in the wind: RTL_RETURN_ALT
        (10.5, 30.0),
    ],
)
def test_a_mission_s_return_about_its_least_distance_takes_the_higher_way(
    distance_m: float, highest_m: float
) -> None:
    motion = fly_px4((takeoff(12.0), go(0.0, distance_m, 12.0, hold=9.0), RETURN), PX4)
    state = motion.state_at_time(np.linspace(0.0, float(motion.segments.end_s[-1]), 2000))
    assert state.height_m.max() == pytest.approx(highest_m, abs=0.5)


@pytest.mark.parametrize(
    ("radius_m", "least_m", "far_m", "near_m", "flown_s"),
    [
        (8.0, 10.0, 60.0, 4.0, 80.6),
        (8.0, 5.0, 60.0, 1.0, 80.5),
        (15.0, 20.0, 90.0, 12.0, 90.0),
        (6.0, 30.0, 70.0, 26.0, 85.8),
        (6.0, 30.0, 90.0, 25.0, 93.9),
    ],
)
def test_a_mission_s_return_begins_where_a_wide_waypoint_near_home_counts_as_reached(
    radius_m: float, least_m: float, far_m: float, near_m: float, flown_s: float
) -> None:
    # Flown in simulation, and to 29.7 to 29.9 m: up to 18 m higher and 20 s longer than from the waypoint.
    wide = replace(PX4, acceptance_radius_m=radius_m, return_min_distance_m=least_m)
    motion = fly_px4((takeoff(12.0), go(0.0, far_m, 12.0), go(0.0, near_m, 12.0), RETURN), wide)
    assert float(motion.segments.end_s[-1]) == pytest.approx(flown_s, rel=0.035)
    assert _highest_m(motion) == pytest.approx(30.0, abs=0.5)


@pytest.mark.parametrize(
    ("radius_m", "near_m", "highest_m"),
    [
        # Within 3 m of the place, what a return's is uncertain by: 6.9 m and 7.1 m count, less than 10 m by
        # those 3 m and more.
        (2.9, 6.9, 12.0),
        (2.9, 7.1, 30.0),
        # Begun 5 m before it, at 6.9 m in the cone, no higher than 2 NAV_ACC_RAD, and at 7.1 m beyond it.
        (5.0, 1.9, 12.0),
        (5.0, 2.1, 30.0),
    ],
)
def test_a_return_is_as_high_as_where_its_waypoint_counts_as_reached_decides(
    radius_m: float, near_m: float, highest_m: float
) -> None:
    wide = replace(PX4, acceptance_radius_m=radius_m)
    motion = fly_px4((takeoff(12.0), go(0.0, 60.0, 12.0), go(0.0, near_m, 12.0), RETURN), wide)
    assert _highest_m(motion) == pytest.approx(highest_m, abs=0.5)


@pytest.mark.parametrize(
    ("least_m", "near_m", "flown_s", "highest_m"),
    [
        (0.0, 1.0, 84.5, 30.0),
        (1.0, 1.0, 84.6, 30.0),
        (0.0, 0.0, 62.4, 12.0),  # at home: within NAV_ACC_RAD of it as it counts as reached
    ],
)
def test_a_waypoint_beside_home_counts_as_reached_beyond_its_radius(
    least_m: float, near_m: float, flown_s: float, highest_m: float
) -> None:
    # Flown in simulation, from 60 m north of home: reached up to 2 m before the place, 3 m from home.
    near = replace(PX4, return_min_distance_m=least_m)
    motion = fly_px4((takeoff(12.0), go(0.0, 60.0, 12.0), go(0.0, near_m, 12.0), RETURN), near)
    assert float(motion.segments.end_s[-1]) == pytest.approx(flown_s, rel=0.035)
    assert _highest_m(motion) == pytest.approx(highest_m, abs=0.8)  # flown 29.6 m


@pytest.mark.parametrize(
    ("begins_m", "climbs_m", "radius_m", "flown_s"),
    [
        (160.0, 40.0, 10.0, 133.2),
        (170.0, 40.0, 10.0, 134.5),
        (185.0, 40.0, 5.0, 138.3),
        (170.0, 70.0, 10.0, 164.8),
    ],
)
def test_a_return_behind_a_steep_climb_begins_at_its_waypoint_s_height(
    begins_m: float, climbs_m: float, radius_m: float, flown_s: float
) -> None:
    # Flown in simulation, from 20 m up to a waypoint 200 m east, where the return was up there as well.
    fast = replace(PX4, acceptance_radius_m=radius_m, cruise_speed_m_s=8.0)
    top_m = 20.0 + climbs_m
    way = (takeoff(20.0), go(begins_m, 0.0, 20.0), go(200.0, 0.0, top_m), RETURN)
    motion = fly_px4(way, fast)
    assert float(motion.segments.end_s[-1]) == pytest.approx(flown_s, rel=0.015)
    half_way_home = motion.state_at_time(np.array([_at_m(motion, 100.0)]))
    assert half_way_home.height_m == pytest.approx(top_m, abs=0.7)


@pytest.mark.parametrize(("way_m", "flown_s"), [(10.0, 113.2), (4.0, 118.2)])
def test_a_return_behind_a_steep_descent_begins_at_its_waypoint_s_height(
    way_m: float, flown_s: float
) -> None:
    # Flown in simulation, from 60 m down to 15 m and home at RTL_RETURN_ALT.
    wide = replace(PX4, acceptance_radius_m=10.0 if way_m == 10.0 else 2.0)
    last = replace(go(30.0, -way_m, 15.0), acceptance_radius_m=way_m)
    motion = fly_px4((takeoff(60.0), go(30.0, 0.0, 60.0), last, RETURN), wide)
    assert float(motion.segments.end_s[-1]) == pytest.approx(flown_s, rel=0.015)
    half_way_home = motion.state_at_time(np.array([_at_m(motion, 15.0)]))
    assert half_way_home.height_m == pytest.approx(30.0, abs=0.7)


@pytest.mark.parametrize(
    ("rise_m", "before_m"),
    [
        # over 40 m, so that the height counts where the radius is reached: 0.8 m before
        (3.19, 10.0),
        (8.0, 4.0),
        (32.0, 0.0),  # 1 m before, within what a return's place is uncertain by
    ],
)
def test_a_return_begins_where_the_later_of_radius_and_height_is_reached(
    rise_m: float, before_m: float
) -> None:
    high = replace(PX4, acceptance_radius_m=10.0, return_altitude_m=90.0)
    way = (takeoff(20.0), go(160.0, 0.0, 20.0), go(200.0, 0.0, 20.0 + rise_m), RETURN)
    moves = moves_of_stages(way, high)
    first = np.flatnonzero(moves.is_return)[0]
    assert moves.target_m[first, 0] == pytest.approx(200.0 - before_m, abs=0.05)


@pytest.mark.parametrize(("radius_m", "height_m"), [(0.8, 45.0), (2.0, 43.0), (3.0, 42.0)])
def test_a_return_begins_short_of_its_waypoint_s_height_by_a_wide_altitude_radius(
    radius_m: float, height_m: float
) -> None:
    wide = replace(PX4, altitude_acceptance_m=radius_m)
    upright = (takeoff(20.0), go(60.0, 0.0, 20.0), go(60.0, 0.0, 45.0), RETURN)
    moves = moves_of_stages(upright, wide)
    first = np.flatnonzero(moves.is_return)[0]
    assert moves.target_m[first, 2] == pytest.approx(height_m, abs=0.01)


def _at_m(motion: Motion, east_m: float) -> float:
    """Return when a flight is so far east for the last time. [s]"""
    time_s = np.linspace(0.0, float(motion.segments.end_s[-1]), 4000)
    return float(time_s[np.flatnonzero(motion.state_at_time(time_s).east_m > east_m)[-1]])


def _highest_m(motion: Motion) -> float:
    state = motion.state_at_time(np.linspace(0.0, float(motion.segments.end_s[-1]), 2000))
    return float(state.height_m.max())


def test_a_return_from_above_its_height_does_not_climb() -> None:
    motion = fly_px4((takeoff(50.0), go(0.0, 300.0), RETURN), PX4)
    states = [STATES[state] for state in motion.segments.state]
    assert states == ["takeoff", *["accelerate", "cruise", "brake"] * 2, "land"]


def test_a_return_takes_what_was_recorded() -> None:
    # 200 m away at 12 m: back, down and disarmed 86.9 s after the return began, with position noise.
    motion = fly_px4((takeoff(12.0), go(0.0, 200.0, 12.0, hold=5.0), RETURN), PX4, noise_m=0.32)
    end = motion.segments.end_s[motion.done_segment]
    assert end[2] - end[1] == pytest.approx(86.9, rel=0.03)


def test_a_return_waits_where_it_is_told_to() -> None:
    waits = replace(PX4, return_land_delay_s=25.0)
    motion = fly_px4((takeoff(50.0), go(0.0, 300.0), RETURN), waits)
    states = [STATES[state] for state in motion.segments.state]
    assert states[-4:] == ["brake", "descend", "hover", "land"]
    assert motion.segments.duration_s[-2] == pytest.approx(25.0)
    # It stands at RTL_DESCEND_ALT.
    assert motion.state_at_time(motion.segments.end_s[-2:-1]).height_m == pytest.approx(
        10.0, abs=0.01
    )


def test_a_return_that_does_not_land_ends_in_the_air() -> None:
    stays = replace(PX4, return_land_delay_s=-1.0)
    motion = fly_px4((takeoff(50.0), go(0.0, 300.0), RETURN), stays)
    assert STATES[motion.segments.state[-1]] == "descend"
    end = motion.state_at_time(motion.segments.end_s[-1:])
    assert end.height_m == pytest.approx(10.0, abs=0.85)


@pytest.mark.parametrize(
    ("change", "end", "said"),
    [
        ({}, RETURN, ""),
        ({"return_land_delay_s": -1.0}, RETURN, ""),
        ({"disarm_delay_s": -1.0}, RETURN, "COM_DISARM_LAND -1 s"),
        ({"return_land_delay_s": -1.0}, go(0.0, 10.0), ""),
    ],
)
def test_what_a_return_does_otherwise_is_said(
    change: dict[str, float], end: Stage, said: str
) -> None:
    changed = replace(PX4, **change)
    findings = fly_px4((takeoff(20.0), go(0.0, 100.0), end), changed).findings
    assert [finding.code for finding in findings] == (["T110"] if said else [])
    assert all(finding.message.startswith(said) for finding in findings)


def test_a_return_leads_to_the_home_it_is_given() -> None:
    moved = stage(StageKind.RETURN, 400.0, 0.0, 20.0)
    motion = fly_px4((takeoff(25.0), go(0.0, 300.0, 25.0), moved), PX4)
    end = motion.state_at_time(motion.segments.end_s[-1:])
    assert (end.east_m[0], end.height_m[0]) == pytest.approx((400.0, 20.0), abs=0.02)
    heights = motion.state_at_time(np.arange(0.0, motion.segments.end_s[-1], 0.2)).height_m
    # RTL_RETURN_ALT counts from there.
    assert heights.max() == pytest.approx(50.0, abs=0.05)


def test_many_ways_home_are_each_flown_alone() -> None:
    rng = np.random.default_rng(7)
    places = rng.uniform((-400.0, -400.0, 3.0), (400.0, 400.0, 100.0), (40, 3))
    together = px4_returns(places, to_home(returns=len(places)), PX4)
    durations = np.bincount(together.segments.item, together.segments.duration_s, minlength=40)
    alone = [px4_returns(place[None], to_home(), PX4).segments.duration_s.sum() for place in places]
    assert durations == pytest.approx(alone, abs=0.02)
    starts = np.searchsorted(
        together.piece_segment, np.searchsorted(together.segments.item, np.arange(40))
    )
    begun = together.state_at(starts, np.zeros(40))
    assert np.column_stack((begun.east_m, begun.north_m, begun.height_m)) == pytest.approx(places)


def test_a_way_home_from_home_is_a_landing() -> None:
    anyhow = replace(PX4, yaw_acceptance_rad=math.pi)
    motion = px4_returns(np.array([[0.0, 0.0, 40.0]]), to_home(), anyhow)
    assert [STATES[state] for state in motion.segments.state] == ["land"]


def test_a_way_home_begun_at_speed_begins_with_a_stop() -> None:
    # 3 m/s², 4 m/s³: 0.75 s of jerk take 1.125 m/s off 12 m/s over 9 − 4 · 0.75³/6 = 8.719 m, the other
    # 10.875 m/s 3.625 s and 10.875²/6 = 19.711 m; 28 m and 4.3 s recorded.
    parameters = replace(PX4, acceleration_m_s2=3.0, jerk_m_s3=4.0)
    pilot = make_pilot(Setup(load_vehicle("px4-sih-quad")), parameters)
    way_m, stop_s = pilot.stop(np.array([0.0, 12.0]))
    assert way_m == pytest.approx([0.0, 28.430], abs=1e-3)
    assert stop_s == pytest.approx([0.0, 4.375])
    # From 1 m/s the acceleration is not reached: √(2/4) s at 2/3 m/s.
    way_m, stop_s = pilot.stop(np.array([1.0]))
    assert (way_m[0], stop_s[0]) == pytest.approx((2.0 / 3.0 * math.sqrt(0.5), math.sqrt(0.5)))


@pytest.mark.parametrize("above_m", [40.0, 5.0])
def test_drag_changes_nothing_of_a_return_that_only_goes_up_and_down(above_m: float) -> None:
    # On the map nothing moves that could lag; the heading of home is waited for alike.
    over_home = np.array([[0.0, 0.0, above_m]])
    lagging, rigid = (
        px4_returns(over_home, to_home(), PX4, drag_per_s=drag_per_s) for drag_per_s in (0.3, None)
    )
    assert lagging.segments.duration_s == pytest.approx(rigid.segments.duration_s, abs=1e-9)
    assert lagging.distance_m == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("away_m", [2.0, 5.0])
def test_a_return_that_passes_right_over_home_as_it_begins_to_land_settles_on_it(
    away_m: float,
) -> None:
    """What is left to home is rounding: no speed over it is its rate (a warning is an error here)."""
    made = mission(takeoff_item(5.0), waypoint(0.0, 0.0), item(19, north(away_m), 2.0))
    along = parameters_from_text(b"RTL_TYPE,2\n", source="p.param")
    result = check(made, load_vehicle("px4-quad-2kg"), parameters=along)
    assert result.assessment is not None


def test_returns_from_one_place_to_one_target_are_as_those_from_each() -> None:
    # The second target is another: 10 m farther, 2 s longer at 5 m/s.
    places = np.array([(40.0, 0.0, 35.0), (40.0, 0.0, 20.0), (40.0, 0.0, 35.0), (40.0, 0.0, 35.0)])
    home = to_home(returns=4)
    ground_m = home.ground_m.copy()
    ground_m[2] = -10.0, 0.0, 0.0
    targets = replace(home, ground_m=ground_m)
    motion = px4_returns(places, targets, PX4)
    alone = [
        px4_returns(places[[row]], replace(to_home(), ground_m=ground_m[[row]]), PX4)
        for row in range(4)
    ]
    time_s = np.bincount(motion.segments.item, motion.segments.duration_s)
    assert time_s == pytest.approx([one.segments.end_s[-1] for one in alone], rel=1e-12)
    assert time_s[3] == time_s[0]
    assert time_s[2] == pytest.approx(time_s[0] + 2.0, abs=1e-6)
    pieces = [len(one.piece_segment) for one in alone]
    assert np.bincount(motion.segments.item[motion.piece_segment]).tolist() == pieces
    ends = np.cumsum([len(one.segments.item) for one in alone]) - 1
    assert motion.done_segment.tolist() == ends.tolist()
    last = motion.state_at(
        motion.last_piece[ends], motion.piece_duration_s[motion.last_piece[ends]]
    )
    assert last.east_m == pytest.approx([0.0, 0.0, -10.0, 0.0], abs=1e-3)
