"""What holds for every flight ArduPilot flies."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, ends, fly, go, stage, states, takeoff, took_s
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion

PLACES = st.sampled_from([-300.0, -40.0, -3.0, 0.0, 0.5, 7.0, 60.0, 250.0, 2000.0])
HEIGHTS = st.sampled_from([3.0, 20.0, 50.0, 50.5, 120.0])
KINDS = st.sampled_from(
    [
        StageKind.GO,
        StageKind.GO,
        StageKind.GO,
        StageKind.SPLINE,
        StageKind.LOITER,
        StageKind.DELAY,
        StageKind.CIRCLE,
        StageKind.CHANGE_HEIGHT,
        StageKind.SET_DOWN,
    ]
)


@st.composite
def missions(draw: st.DrawFn) -> tuple[Stage, ...]:
    between = [
        stage(
            draw(KINDS),
            draw(PLACES),
            draw(PLACES),
            draw(HEIGHTS),
            speed=draw(st.sampled_from([None, 3.0, 8.0, 14.0])),
            hold=draw(st.sampled_from([0.0, 0.0, 0.0, 4.0])),
            turns=draw(st.sampled_from([0.0, 0.5, 1.0, 2.0])),
            radius=draw(st.sampled_from([-30.0, 0.0, 12.0])),
        )
        for _ in range(draw(st.integers(1, 8)))
    ]
    last = draw(st.sampled_from([StageKind.LAND, StageKind.RETURN, None]))
    landing = () if last is None else (stage(last, draw(PLACES), draw(PLACES), 0.0),)
    return (takeoff(draw(HEIGHTS)), *between, *landing)


def assert_is_sound(motion: Motion) -> None:
    segments = motion.segments
    assert (segments.duration_s > 0.0).all()
    assert (motion.piece_duration_s > 0.0).all()
    assert (np.diff(motion.piece_segment) >= 0).all()
    by_segment = np.bincount(motion.piece_segment, motion.piece_duration_s, len(segments.item))
    assert by_segment == pytest.approx(segments.duration_s, abs=1e-6)
    position, velocity = ends(motion)
    assert np.isfinite(position).all()
    assert np.isfinite(velocity).all()
    rise = position[1, :, 2] - position[0, :, 2]
    assert np.bincount(motion.piece_segment, rise) == pytest.approx(segments.climb_m, abs=1e-6)


@given(stages=missions())
@settings(max_examples=examples(120), deadline=None)
def test_segments_and_pieces_are_contiguous_and_the_way_has_no_gap(
    stages: tuple[Stage, ...],
) -> None:
    motion = fly(*stages)
    assert_is_sound(motion)
    position, _ = ends(motion)
    assert np.abs(position[0, 1:] - position[1, :-1]).max(initial=0.0) < 1e-6
    assert position[0, 0] == pytest.approx([0.0, 0.0, 0.0])


def test_a_leg_that_speeds_up_twice_meets_a_spline_where_it_begins() -> None:
    # Found by the test above: the leg was as fast at its end as if it had begun at full speed.
    motion = fly(
        takeoff(50.0),
        stage(StageKind.GO, 7.0, 0.5, 120.0, speed=3.0),
        stage(StageKind.GO, -40.0, -40.0, 120.0),
        stage(StageKind.SPLINE, -40.0, 0.5, 120.0, speed=14.0),
    )
    assert_is_sound(motion)
    position, velocity = ends(motion)
    assert np.abs(position[0, 1:] - position[1, :-1]).max() < 1e-6
    assert np.abs(velocity[0, 1:] - velocity[1, :-1]).max() < 1e-6


@given(stages=missions())
@settings(max_examples=examples(60), deadline=None)
def test_speeds_change_in_a_jump_only_at_touch_down_and_about_circles(
    stages: tuple[Stage, ...],
) -> None:
    motion = fly(*stages)
    _, velocity = ends(motion)
    jump = np.abs(velocity[0, 1:] - velocity[1, :-1]).max(axis=1)
    jumps = np.flatnonzero(jump > 1e-3)
    landed = [s.kind in {StageKind.LAND, StageKind.RETURN, StageKind.SET_DOWN} for s in stages]
    circles = [s.kind is StageKind.CIRCLE for s in stages]
    assert len(jumps) <= sum(landed) + 2 * sum(circles)


@pytest.mark.parametrize(
    "stages",
    [
        (
            stage(StageKind.SPLINE, 0.0, 250.0, 120.0, speed=14.0),
            replace(stage(StageKind.SET_DOWN, -40.0, 60.0), above_ground_m=120.0),
        ),
        (
            stage(StageKind.SPLINE, 0.5, 60.0, 120.0),
            stage(StageKind.SPLINE, 0.0, 0.0, 20.0, speed=8.0),
        ),
    ],
)
def test_splines_meet_what_follows_in_one_direction(stages: tuple[Stage, ...]) -> None:
    # Found at random: a level leg behind a spline that descended, and one that came back upon itself.
    motion = fly(takeoff(20.0), *stages)
    _, velocity = ends(motion)
    jumps = np.abs(velocity[0, 1:] - velocity[1, :-1]).max(axis=1) > 1e-3
    touching_down = sum(s.kind is StageKind.SET_DOWN for s in stages)
    assert jumps.sum() == touching_down


@given(stages=missions())
@settings(max_examples=examples(60), deadline=None)
def test_stages_are_arrived_at_in_order_and_where_they_are(stages: tuple[Stage, ...]) -> None:
    motion = fly(*stages)
    assert (np.diff(motion.done_segment) >= 0).all()
    assert (motion.arrival_segment <= motion.done_segment).all()
    end = motion.segments.end_s
    radius = DEFAULTS.waypoint_radius_m
    for some, done in zip(stages, motion.done_segment, strict=True):
        if some.kind in {StageKind.GO, StageKind.LOITER, StageKind.SPLINE}:
            state = motion.state_at_time(np.array([end[done]]))
            away = np.array([some.east_m, some.north_m, some.height_m]) - np.array(
                [state.east_m[0], state.north_m[0], state.height_m[0]]
            )
            assert np.linalg.norm(away) <= radius + 1e-6


@given(
    east=st.lists(st.floats(-500.0, 500.0), min_size=2, max_size=8),
    north=st.floats(5.0, 400.0),
    speed=st.floats(1.0, 18.0),
)
@settings(max_examples=examples(60), deadline=None)
def test_no_corner_is_faster_than_its_legs_nor_bends_harder_than_allowed(
    east: list[float], north: float, speed: float
) -> None:
    parameters = ArduPilotParameters(cruise_speed_m_s=speed)
    points = [go(x, north * k) for k, x in enumerate(east, start=1)]
    motion = fly(takeoff(), *points, parameters=parameters)
    piece = np.repeat(np.arange(len(motion.piece_duration_s)), 5)
    share = np.tile(np.linspace(0.0, 1.0, 5), len(motion.piece_duration_s))
    state = motion.state_at(piece, share * motion.piece_duration_s[piece])
    assert state.ground_speed_m_s.max() <= speed * 1.001
    # Two legs of WP_ACC each at most.
    step = 1e-4
    later = motion.state_at(piece, share * motion.piece_duration_s[piece] + step)
    acceleration = np.hypot(later.east_m_s - state.east_m_s, later.north_m_s - state.north_m_s)
    assert acceleration.max() / step <= 2 * parameters.acceleration_m_s2 * 1.01


@given(scale=st.floats(0.3, 4.0))
@settings(max_examples=examples(30), deadline=None)
def test_a_survey_turned_about_takes_the_same_time(scale: float) -> None:
    def time(turn: float) -> float:
        cosine, sine = np.cos(turn), np.sin(turn)
        corners = [(200.0, 0.0), (200.0, 30.0), (0.0, 30.0), (0.0, 60.0), (200.0, 60.0)]
        points = [
            go(scale * (x * cosine - y * sine), scale * (x * sine + y * cosine)) for x, y in corners
        ]
        return float(fly(takeoff(), *points).segments.duration_s.sum())

    assert time(0.7) == pytest.approx(time(0.0), abs=1e-6)


def test_the_states_of_a_flight_follow_each_other() -> None:
    motion = fly(
        takeoff(),
        go(300.0),
        go(300.0, height_m=90.0),
        go(300.0, height_m=60.0, hold=5.0),
        go(0.0, height_m=60.0),
        stage(StageKind.RETURN, 0.0, 0.0, 0.0),
    )
    assert states(motion) == [
        "takeoff",
        *("accelerate", "cruise", "brake"),
        "climb",
        "descend",
        "hover",
        *("accelerate", "cruise", "brake"),
        "hover",  # the centimetre of the return
        "hover",
        "land",
    ]


def test_a_straight_line_of_waypoints_is_one_cruise() -> None:
    motion = fly(takeoff(), *(go(100.0 * k) for k in range(1, 8)))
    assert states(motion)[1:] == ["accelerate", *(["cruise"] * 7), "brake"]
    for index in range(2, 7):
        assert took_s(motion, index) == pytest.approx(10.0, abs=1e-3)


def test_one_stage_alone_is_flown() -> None:
    assert_is_sound(fly(takeoff()))
    # A mission that begins with a place: ArduPilot would not arm; the motion is still defined.
    assert_is_sound(fly(go(100.0, height_m=20.0)))


def test_a_thousand_items_are_a_thousand_arrivals() -> None:
    points = [go(200.0 * (k // 2 % 2), 30.0 * k) for k in range(1000)]
    motion = fly_ardupilot((takeoff(), *points), DEFAULTS)
    assert_is_sound(motion)
    assert len(np.unique(motion.arrival_segment)) == 1001


def test_a_vehicle_that_does_not_see_where_it_goes_next_stops() -> None:
    on = (takeoff(20.0), go(0.0, 60.0, 20.0), go(60.0, 60.0, 20.0))
    unseen = (on[0], replace(on[1], is_next_unseen=True), on[2])
    held = (on[0], replace(on[1], hold_s=1e-6), on[2])
    all_s = [float(fly(*flown).segments.end_s[-1]) for flown in (on, unseen, held)]
    assert all_s[1] == pytest.approx(all_s[2], abs=0.02)
    assert all_s[0] < all_s[1] - 1.0
