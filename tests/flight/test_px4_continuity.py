"""What holds for any flight PX4 flies: nothing jumps, nothing is too fast, everything adds up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import go, stage, takeoff
from hypothesis import given, settings
from hypothesis import strategies as st
from px4_flights import fly_px4
from thinning import examples

from planner.flight.motion.kinematics import PolynomialLaw
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.flight.motion.kinematics import Motion

PX4 = Px4Parameters()

_KINDS = st.sampled_from(
    [
        *[StageKind.GO] * 4,
        *(StageKind.SPLINE, StageKind.LOITER, StageKind.DELAY),
        *(StageKind.CHANGE_HEIGHT, StageKind.CIRCLE, StageKind.SET_DOWN),
    ]
)
_WAYS = st.one_of(st.sampled_from([0.0, 0.0, 1.0, 3.0]), st.floats(-150.0, 150.0))


@st.composite
def missions(draw: st.DrawFn) -> tuple[Stage, ...]:
    """Missions of any items, near to each other and far, up and down."""
    east, north, height = 0.0, 0.0, draw(st.floats(1.0, 60.0))
    stages = [takeoff(height)]
    for _ in range(draw(st.integers(1, 8))):
        kind = draw(_KINDS)
        if kind is not StageKind.DELAY:
            east, north = east + draw(_WAYS), north + draw(_WAYS)
            height = max(1.0, height + draw(st.sampled_from([0.0, 0.0, 0.4, -2.0, 15.0, -20.0])))
        flown = stage(kind, east, north, height, hold=draw(st.sampled_from([0.0, 0.0, 0.7, 12.0])))
        stages.append(
            replace(
                flown,
                speed_m_s=draw(st.sampled_from([None, 2.0, 9.0, 20.0])),
                acceptance_radius_m=draw(st.sampled_from([None, 0.5, 6.0])),
                yaw_deg=draw(st.sampled_from([None, None, 0.0, 200.0])),
            )
        )
    end = draw(st.sampled_from([StageKind.RETURN, StageKind.LAND, None]))
    if end is not None:
        stages.append(stage(end, 0.0 if end is StageKind.RETURN else east, north, 0.0))
    return tuple(stages)


def jumps_m(motion: Motion) -> FloatArray:
    """Return how far apart each piece ends and the next begins, on each axis. (3, n)"""
    piece = np.arange(len(motion.piece_duration_s))
    begin = motion.state_at(piece, np.zeros(len(piece))).place_m
    end = motion.state_at(piece, motion.piece_duration_s).place_m
    return np.abs(begin[1:] - end[:-1]).T


@pytest.mark.parametrize(("north_m", "speed_m_s", "yaw_mode"), [(25.0, None, 0), (30.0, 9.0, 4)])
def test_a_steep_leg_to_a_corner_is_braked_on_from_where_it_joins_its_second_law(
    north_m: float, speed_m_s: float | None, yaw_mode: int
) -> None:
    """Joined while trailing the law of the other axis, it is met above what it allows: 0.21 m off."""
    leg = replace(go(0.0, north_m, 16.0), speed_m_s=speed_m_s)
    stages = (takeoff(1.0), leg, stage(StageKind.LAND, 0.0, north_m, 0.0))
    motion = fly_px4(stages, replace(PX4, yaw_mode=yaw_mode))
    # A micrometre: what counts as no way at all.
    assert jumps_m(motion).max() < 1e-6


def test_what_is_said_to_be_a_cubic_of_time_is_one() -> None:
    """The path over ground and trajectories of fleets look at its ends alone."""
    stages = (takeoff(20.0), go(80.0, 0.0), go(80.0, 60.0, hold=5.0))
    motion = fly_px4((*stages, stage(StageKind.RETURN, height_m=0.0)), PX4, drag_per_s=0.3)
    are = np.array([isinstance(law, PolynomialLaw) for law in motion.laws])[motion.piece_law]
    assert 0 < are.sum() < len(are)
    piece, duration_s = np.flatnonzero(are), motion.piece_duration_s[are]
    ends = motion.control_m(piece, np.zeros(len(piece)), duration_s)
    middle = np.einsum("k,nkx->nx", np.array([1.0, 3.0, 3.0, 1.0]) / 8.0, ends)
    assert motion.state_at(piece, 0.5 * duration_s).place_m == pytest.approx(middle, abs=1e-9)


@settings(deadline=None, max_examples=examples(40))
@given(missions(), st.sampled_from([0, 4]), st.floats(0.0, 0.5))
def test_pieces_follow_each_other_without_a_jump(
    stages: tuple[Stage, ...], yaw_mode: int, noise_m: float
) -> None:
    motion = fly_px4(stages, replace(PX4, yaw_mode=yaw_mode), noise_m=noise_m)
    # Centimetres: what the solver leaves of a leg of any length.
    assert jumps_m(motion).max(initial=0.0) < 0.03
    assert (motion.piece_duration_s > 0.0).all()
    assert (np.diff(motion.piece_segment) >= 0).all()


@settings(deadline=None, max_examples=examples(50))
@given(missions())
def test_segments_add_up_to_where_the_pieces_lead(stages: tuple[Stage, ...]) -> None:
    motion = fly_px4(stages, PX4)
    segments = motion.segments
    lasted = np.bincount(motion.piece_segment, motion.piece_duration_s)
    assert lasted == pytest.approx(segments.duration_s)
    end = motion.state_at_time(segments.end_s)
    assert np.cumsum(segments.climb_m) == pytest.approx(end.height_m, abs=0.2)
    times = np.linspace(0.0, segments.end_s[-1], 3000)
    state = motion.state_at_time(times)
    way = np.hypot(np.diff(state.east_m), np.diff(state.north_m)).sum()
    assert segments.distance_m.sum() == pytest.approx(way, rel=0.02, abs=2.0)
    assert (motion.arrival_segment >= -1).all()
    assert (np.diff(motion.done_segment) >= 0).all()
    assert motion.done_segment[-1] == len(segments.item) - 1


@settings(deadline=None, max_examples=examples(50))
@given(missions(), st.sampled_from([0, 4]))
def test_speeds_keep_to_what_is_commanded(stages: tuple[Stage, ...], yaw_mode: int) -> None:
    motion = fly_px4(stages, replace(PX4, yaw_mode=yaw_mode))
    count = len(motion.piece_duration_s)
    time_s = np.linspace(0.0, 1.0, 17) * motion.piece_duration_s[:, None]
    state = motion.state_at(np.arange(count)[:, None], time_s)
    # MPC_XY_CRUISE unless commanded, MPC_XY_VEL_MAX at most; what is too fast is braked.  A curve
    # is not broken up for a quarter of a per cent.
    fastest = max(min(stage.speed_m_s or 5.0, 12.0) for stage in stages)
    assert state.ground_speed_m_s.max() <= fastest * 1.0026
    assert state.climb_m_s.max() <= 3.0 * 1.0026
    assert state.climb_m_s.min() >= -1.5 * 1.0026
    # A take-off to 1 m is done at 0.2 m, 9 cm after its profile passed that: it is led back, downwards.
    assert state.height_m.min() >= -0.1


@settings(deadline=None, max_examples=examples(40))
@given(missions(), st.floats(0.01, 1.0))
def test_noise_never_saves_time_and_never_takes_more_than_it_may(
    stages: tuple[Stage, ...], noise_m: float
) -> None:
    quiet, noisy = (fly_px4(stages, PX4, noise_m=n).segments.end_s[-1] for n in (0.0, noise_m))
    # Behind half of the time at 1 − noise/2 m, over a landing place all of the time.
    assert quiet <= noisy + 1e-6
    assert noisy <= quiet / (1.0 - 0.5 * noise_m) + 1e-6


@pytest.mark.parametrize("noise_m", [-0.1, 2.0])
def test_a_noise_that_stops_time_is_refused(noise_m: float) -> None:
    with pytest.raises(ValueError, match="MPC_XY_ERR_MAX"):
        fly_px4((takeoff(),), PX4, noise_m=noise_m)


@pytest.mark.parametrize(("climb_m", "measured_m_s"), [(150.0, 2.78), (-150.0, 1.38)])
def test_noise_of_03_m_slows_climbs_and_descents_as_measured(
    climb_m: float, measured_m_s: float
) -> None:
    motion = fly_px4(
        (takeoff(200.0), go(0.0, 0.0, 200.0, hold=9.0), go(0.0, 0.0, 200.0 + climb_m)),
        PX4,
        noise_m=0.3,
    )
    middle = motion.segments.end_s[-1:] - 0.5 * motion.segments.duration_s[-1]
    assert np.abs(motion.state_at_time(middle).climb_m_s) == pytest.approx(measured_m_s, rel=0.01)


def test_noise_slows_a_landing_from_standing_as_recorded() -> None:
    # 20 s of hold at 100 m, then the landing: 94.0 s and 93.4 s until disarmed, at 0.32 to 0.35 m.
    # The landed flag of one came 3.5 s late.
    high = (takeoff(100.0), go(0.0, 0.0, 100.0, hold=25.0), stage(StageKind.LAND, 0.0, 0.0, 0.0))
    motion = fly_px4(high, PX4, noise_m=0.32)
    assert motion.segments.duration_s[-1] == pytest.approx(93.7, rel=0.03)


def test_a_flight_of_a_thousand_legs_is_that_of_its_parts() -> None:
    # Each survey line begins and ends standing, so that parts can be flown on their own.
    lines = [go(30.0 * (k // 2), 300.0 * (k % 2), hold=20.0) for k in range(1000)]
    whole = fly_px4((takeoff(), *lines), PX4)
    end = whole.segments.end_s[whole.done_segment]
    part = fly_px4((takeoff(), *lines[:11]), PX4)
    some = part.segments.end_s[part.done_segment]
    assert end[:12] == pytest.approx(some, abs=1e-6)
    laps = np.diff(end[1::2])
    assert laps == pytest.approx(laps[0], abs=0.05)


@st.composite
def cramped_missions(draw: st.DrawFn) -> tuple[Stage, ...]:
    """Missions of short legs at any speed, ended by a landing in motion or a return."""
    east, north, height, stages = 0.0, 0.0, 20.0, [takeoff(20.0)]
    for _ in range(draw(st.integers(1, 4))):
        course, length = draw(st.floats(0.0, 6.28)), draw(st.floats(1.0, 60.0))
        east, north = east + length * math.cos(course), north + length * math.sin(course)
        height = max(2.0, height + draw(st.sampled_from([0.0, 0.0, 5.0, -5.0, 20.0, -12.0])))
        stages.append(
            replace(
                go(east, north, height, hold=draw(st.sampled_from([0.0, 0.0, 0.0, 3.0]))),
                speed_m_s=draw(st.sampled_from([None, 3.0, 8.0, 12.0])),
                acceptance_radius_m=draw(st.sampled_from([None, 0.5, 6.0])),
            )
        )
    away_m = draw(st.floats(0.0, 30.0))
    ends = (stage(StageKind.LAND, east + away_m, north, 0.0), stage(StageKind.RETURN, height_m=0.0))
    return (*stages, draw(st.sampled_from(ends)))


@settings(deadline=None, max_examples=examples(60))
@given(cramped_missions())
def test_legs_too_short_for_their_speed_and_landings_in_motion_do_not_jump(
    stages: tuple[Stage, ...],
) -> None:
    motion = fly_px4(stages, PX4)
    piece = np.arange(len(motion.piece_duration_s))
    begin = motion.state_at(piece, np.zeros(len(piece)))
    end = motion.state_at(piece, motion.piece_duration_s)
    for axis in ("east_m_s", "north_m_s", "climb_m_s"):
        jump = np.abs(getattr(begin, axis)[1:] - getattr(end, axis)[:-1])[:-1]
        # The last touches down.  Speeds of 0.15 m/s are those of a landing that begins to slow down.
        assert jump.max(initial=0.0) < 0.2, axis
