"""Ramps: a vehicle of a closed autopilot from rest to rest, by hand calculation."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from thinning import examples

from planner.flight.motion.kinematics import STATES
from planner.flight.motion.ramps import fly_ramps
from planner.flight.motion.steps import StepLegs, StepSpeeds
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.model import Ramps

RAMPS = Ramps(
    start_s=5.0,
    climb_m_s=3.0,
    climb_wait_s=2.0,
    acceleration_m_s2=2.0,
    braking_m_s2=4.0,
    turn_wait_s=2.5,
    descent_m_s=3.0,
    landing_m_s=1.0,
    landing_height_m=10.0,
    stop_s=2.0,
)


def _stage(kind: StageKind, north_m: float, height_m: float, **more: Any) -> Stage:  # noqa: ANN401 - fields of the stage
    return Stage(kind=kind, item=1, east_m=0.0, north_m=north_m, height_m=height_m, **more)


OUT_AND_DOWN = (
    _stage(StageKind.TAKEOFF, 0.0, 30.0),
    _stage(StageKind.GO, 200.0, 30.0, speed_m_s=8.0),
    _stage(StageKind.GO, 203.0, 30.0, speed_m_s=8.0, hold_s=7.0),
    _stage(StageKind.LAND, 203.0, 0.0),
)


def test_every_segment_takes_what_hand_calculation_gives() -> None:
    motion = fly_ramps(StepLegs.of(OUT_AND_DOWN, speeds=StepSpeeds(8.0, 8.0)), RAMPS)
    told = [
        (STATES[state].value, round(duration, 6))
        for state, duration in zip(
            motion.segments.state.tolist(), motion.segments.duration_s.tolist(), strict=True
        )
    ]
    # Climb of 30 m: 3/2 + 3/4 s of ramps, 2.25 and 1.125 m, 26.625 m at 3 m/s.
    # 200 m at 8 m/s: 4 s and 16 m, 2 s and 8 m, 176 m in 22 s.
    # 3 m: peak of sqrt(2 x 3 x 2 x 4 / 6) = 2.828 m/s; 1.414 s and 0.707 s.
    # Landing: 20 m to 10 m as a climb, 16.625 m at 3 m/s; then 0.5 s to 1 m/s over 0.25 m, 9.75 s.
    peak_s = np.sqrt(8.0) / 2.0
    assert told == [
        ("takeoff", 5.0),
        ("takeoff", 11.125),
        ("hover", 2.0),
        ("accelerate", 4.0),
        ("cruise", 22.0),
        ("brake", 2.0),
        ("hover", 2.5),
        ("accelerate", round(peak_s, 6)),
        ("cruise", 0.0),
        ("brake", round(0.5 * peak_s, 6)),
        ("hover", 7.0),
        ("land", round(2.25 + 16.625 / 3.0 + 10.25, 6)),
        ("land", 2.0),
    ]
    assert motion.segments.stopping_distance_m[4] == pytest.approx(8.0)  # 8²/(2 x 4)
    assert motion.piece_is_grounded is not None
    grounded = motion.piece_duration_s[motion.piece_is_grounded]
    assert grounded.tolist() == [5.0, 2.0]
    ends = motion.segments.end_s
    assert ends[motion.arrival_segment[1]] == pytest.approx(5.0 + 11.125 + 2.0 + 28.0)


def test_position_and_velocity_do_not_jump() -> None:
    motion = fly_ramps(StepLegs.of(OUT_AND_DOWN, speeds=StepSpeeds(8.0, 8.0)), RAMPS)
    ends = motion.piece_start_s[1:]
    before, after = motion.state_at_time(ends - 1e-9), motion.state_at_time(ends + 1e-9)
    np.testing.assert_allclose(before.north_m, after.north_m, atol=1e-6)
    np.testing.assert_allclose(before.height_m, after.height_m, atol=1e-6)
    np.testing.assert_allclose(before.ground_speed_m_s, after.ground_speed_m_s, atol=1e-6)
    climb = np.abs(before.climb_m_s - after.climb_m_s)
    assert np.flatnonzero(climb > 1e-6).size == 1  # touch-down, at 1 m/s
    assert climb.max() == pytest.approx(1.0, abs=1e-6)


@settings(max_examples=examples(40), deadline=None)
@given(
    st.floats(0.1, 500.0), st.floats(0.5, 20.0), st.floats(0.5, 8.0), st.floats(0.5, 8.0),
    st.floats(1.0, 120.0),
)  # fmt: skip
def test_legs_arrive_where_they_are_sent(
    north_m: float, speed_m_s: float, gain_m_s2: float, brake_m_s2: float, height_m: float
) -> None:
    ramps = replace(RAMPS, acceleration_m_s2=gain_m_s2, braking_m_s2=brake_m_s2)
    stages = (
        _stage(StageKind.TAKEOFF, 0.0, height_m),
        _stage(StageKind.GO, north_m, height_m, speed_m_s=speed_m_s),
        _stage(StageKind.LAND, north_m, 0.0),
    )
    motion = fly_ramps(StepLegs.of(stages, speeds=StepSpeeds(8.0, 8.0)), ramps)
    end = motion.state_at_time(motion.segments.end_s[-1:])
    assert end.north_m[0] == pytest.approx(north_m)
    assert end.height_m[0] == pytest.approx(0.0, abs=1e-9)
    assert motion.segments.distance_m.sum() == pytest.approx(north_m)
    assert motion.segments.climb_m.sum() == pytest.approx(0.0, abs=1e-9)
    assert motion.segments.speed_m_s.max() <= max(speed_m_s, 3.0) + 1e-9


def test_circles_are_flown_at_the_commanded_speed() -> None:
    stages = (
        _stage(StageKind.TAKEOFF, 0.0, 30.0),
        _stage(StageKind.CIRCLE, 100.0, 30.0, speed_m_s=5.0, turns=2.0, radius_m=10.0),
    )
    motion = fly_ramps(StepLegs.of(stages, speeds=StepSpeeds(8.0, 8.0)), RAMPS)
    assert motion.segments.duration_s[-1] == pytest.approx(2.0 * 2.0 * np.pi * 10.0 / 5.0)
