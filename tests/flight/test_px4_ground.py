"""PX4 near the ground: take-offs, landings, and what is stood on the ground before and after."""

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

from planner.flight.motion.kinematics import STATES
from planner.flight.motion.px4.lift_off import lift_off
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.px4 import Px4Parameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion

PX4 = Px4Parameters()


def done_s(*stages: Stage, parameters: Px4Parameters = PX4) -> np.ndarray:
    motion = fly_px4(stages, parameters)
    return motion.segments.end_s[motion.done_segment]


def land(east_m: float = 0.0, north_m: float = 0.0, ground_m: float = 0.0) -> Stage:
    return stage(StageKind.LAND, east_m, north_m, ground_m)


def touched_s(motion: Motion) -> float:
    """Return when the vehicle is on the ground for good."""
    times = np.arange(0.0, motion.segments.end_s[-1], 0.01)
    return float(times[np.flatnonzero(motion.state_at_time(times).height_m > 0.005)[-1]])


def grounded_s(motion: Motion) -> float:
    assert motion.piece_is_grounded is not None
    return float(motion.piece_duration_s[motion.piece_is_grounded].sum())


def test_a_landing_below_home_is_slow_from_where_it_would_be_over_home() -> None:
    level, lower = (
        done_s(takeoff(30.0), land(0.0, 0.0, ground_m))[-1] for ground_m in (0.0, -100.0)
    )
    # 100 m more at MPC_LAND_SPEED, 0.7 m/s.
    assert lower - level == pytest.approx(100.0 / 0.7, abs=0.5)


@pytest.mark.parametrize(
    ("change", "longer_s"),
    [
        ({"spool_up_s": 3.0}, 2.0),
        # Flown: 19.2 m after 20.1 s and 22.2 s instead of 17.4 s.
        ({"takeoff_ramp_s": 5.0}, 2.7),
        ({"takeoff_speed_m_s": 1.0}, 4.8),
        # Slow up to 20 m instead of 10 m, and at full speed on from there: 10/1.5 − 10/3.
        ({"land_slow_height_m": 20.0}, 10.0 / 1.5 - 10.0 / 3.0),
        ({"climb_speed_m_s": 2.0}, None),
    ],
)
def test_each_parameter_of_a_takeoff_moves_it_as_its_law_says(
    change: dict[str, float], longer_s: float | None
) -> None:
    changed = replace(PX4, **change)
    difference = done_s(takeoff(100.0), parameters=changed)[0] - done_s(takeoff(100.0))[0]
    if longer_s is None:
        # 75 to 85 m of the climb at 2 m/s instead of 3 m/s.
        assert 75.0 / 6.0 < difference < 85.0 / 6.0
    else:
        # Speeding up from 1 m/s to 3 m/s takes 0.2 s longer than from 1.5 m/s.
        assert difference == pytest.approx(longer_s, abs=0.25)


@pytest.mark.parametrize(
    ("speed_m_s", "most_m_s", "ramp_s", "flown_s"),
    [
        (1.5, 3.0, 3.0, 11.6),
        (1.5, 1.5, 3.0, 12.1),  # the limit rises more slowly
        (1.5, 1.3, 3.0, 13.3),
        (1.5, 3.0, 5.0, 14.2),
        (3.2, 3.0, 2.4, 6.7),
        # What went down on the ground is made good first: lifts off after 8 s, 9 s and 10.2 s.
        (1.0, 3.0, 3.0, 16.1),
        (0.8, 3.0, 3.0, 19.7),
        (0.6, 3.0, 3.0, 25.9),
        (0.6, 1.0, 3.0, 26.9),
        (0.54, 0.9, 3.0, 29.9),
    ],
)
def test_a_takeoff_is_at_9_9_m_when_it_was_flown_there(
    speed_m_s: float, most_m_s: float, ramp_s: float, flown_s: float
) -> None:
    assert _at_9_9_m_s(speed_m_s, most_m_s, ramp_s) == pytest.approx(flown_s, abs=0.45)


@pytest.mark.parametrize(
    ("speed_m_s", "most_m_s", "ramp_s", "flown_s"),
    [
        (1.5, 1.1, 1.5, 18.5),
        (1.5, 1.0, 3.0, 22.8),
        (1.5, 0.5, 3.0, 45.9),
        (3.0, 2.0, 3.0, 12.2),
        (3.2, 1.5, 2.4, 14.7),
        (5.0, 3.0, 3.0, 8.5),
    ],
)
def test_a_takeoff_beyond_the_limit_of_climbs_stops_again_and_again(
    speed_m_s: float, most_m_s: float, ramp_s: float, flown_s: float
) -> None:
    """Within half a stop: they are predicted as a steady climb at their mean."""
    assert _at_9_9_m_s(speed_m_s, most_m_s, ramp_s) == pytest.approx(flown_s, abs=1.3)


@pytest.mark.parametrize(("most_m_s", "stops"), [(1.5 / 1.3 - 1e-6, True), (1.5 / 1.3, False)])
def test_a_takeoff_stops_beyond_1_3_times_the_limit(most_m_s: float, *, stops: bool) -> None:
    assert bool(lift_off(replace(PX4, climb_speed_max_m_s=most_m_s)).stops_every_m) is stops


def test_a_pulse_of_a_takeoff_is_as_its_laws_say() -> None:
    """To 1.3 m/s at 0.5 m/s², 2.66 s and 1.7 m, and in 0.78 s and 0.55 m to a stop; 0.6 m/s flown."""
    begins = lift_off(replace(PX4, climb_speed_max_m_s=1.0))
    assert begins.stops_every_m == pytest.approx(2.25, abs=0.03)
    assert begins.speed_m_s == pytest.approx(0.61, abs=0.01)


def _at_9_9_m_s(speed_m_s: float, most_m_s: float, ramp_s: float) -> float:
    changed = replace(
        PX4, takeoff_speed_m_s=speed_m_s, climb_speed_max_m_s=most_m_s, takeoff_ramp_s=ramp_s
    )
    motion = fly_px4((takeoff(30.0),), changed)
    times = np.arange(0.0, motion.segments.end_s[0], 0.01)
    return float(times[np.argmax(motion.state_at_time(times).height_m > 9.9)])


def test_a_takeoff_stands_at_no_power_until_half_its_ramp() -> None:
    motion = fly_px4((takeoff(),), PX4)
    assert grounded_s(motion) == pytest.approx(1.0 + 0.5 * 3.0)
    state = motion.state_at_time(np.array([4.19, 4.3]))
    assert state.height_m[0] == 0.0
    assert state.height_m[1] > 0.0


def test_a_takeoff_away_from_home_climbs_first() -> None:
    away = stage(StageKind.TAKEOFF, 100.0, 0.0, 30.0)
    motion = fly_px4((away,), PX4)
    states = [STATES[state] for state in motion.segments.state]
    assert states[0] == "takeoff"
    assert states[1:] == ["accelerate", "cruise", "brake"]
    climbed = motion.state_at_time(motion.segments.end_s[:1])
    assert climbed.height_m == pytest.approx(30.0 - 0.8)
    assert climbed.east_m == 0.0
    # Both are one item, done when the vehicle is there.
    assert motion.done_segment.tolist() == [len(motion.segments.item) - 1]


@pytest.mark.parametrize("height_m", [0.5, 2.5, 6.0, 9.0, 12.0])
def test_a_low_takeoff_ends_below_its_height_and_never_above(height_m: float) -> None:
    motion = fly_px4((takeoff(height_m), go(0.0, 0.0, height_m, hold=30.0)), PX4)
    heights = motion.state_at_time(np.arange(0.0, motion.segments.end_s[-1], 0.05)).height_m
    assert heights.max() <= height_m + 1e-6
    assert heights[-1] == pytest.approx(height_m, abs=0.01)


def test_a_low_takeoff_brakes_at_the_acceleration_of_its_thrust_ramp() -> None:
    """Below MPC_LAND_ALT1 1.5 m/s in 3 s: u² + b u = 2 · 0.5 · 0.8, b = 4 · 0.5²/4, 0.8 m below the end."""
    motion = fly_px4((takeoff(8.0), go(0.0, 0.0, 8.0, hold=30.0)), PX4)
    done = motion.state_at_time(motion.segments.end_s[motion.done_segment[:1]])
    assert done.height_m == pytest.approx(7.2)
    assert done.climb_m_s == pytest.approx(-0.125 + math.sqrt(0.125**2 + 0.8), abs=0.03)


def test_a_takeoff_to_no_height_flies_nowhere() -> None:
    motion = fly_px4((takeoff(0.0), go(0.0, 0.0, 0.0)), PX4)
    assert motion.segments.end_s[-1] == pytest.approx(4.2)
    assert motion.segments.climb_m.sum() == 0.0


@pytest.mark.parametrize(
    ("change", "longer_s"),
    [
        # 0.7 to 1.5 m/s over 5 m is e-folding at 0.16/s; 5 m at 0.7 m/s, of them 1 m at 0.3 m/s.
        (
            {"land_speed_m_s": 0.5},
            4.0 / 0.5 - 4.0 / 0.7 + math.log(3.0) / 0.2 - math.log(1.5 / 0.7) / 0.16,
        ),
        ({"land_crawl_speed_m_s": 0.2}, 0.7 / 0.2 - 0.7 / 0.3),
        ({"land_crawl_height_m": 2.0}, 1.0 / 0.3 - 1.0 / 0.7),
        ({"descent_speed_m_s": 1.0}, None),
        ({"disarm_delay_s": 10.0}, 0.0),
    ],
)
def test_each_parameter_of_a_landing_moves_it_as_its_law_says(
    change: dict[str, float], longer_s: float | None
) -> None:
    stages = (takeoff(40.0), land())
    changed = replace(PX4, **change)
    before, after = (np.diff(done_s(*stages, parameters=p))[0] for p in (PX4, changed))
    if longer_s is None:
        # 29 m to 34 m at 1.0 m/s instead of 1.5 m/s.
        assert 29.0 / 3.0 < after - before < 34.0 / 3.0
    else:
        # Crawling begins by slowing down, over some decimetres.
        assert after - before == pytest.approx(longer_s, abs=0.35)


def test_a_mission_disarms_as_soon_as_it_has_landed_and_a_return_later() -> None:
    for end, delay_s in ((land(), 0.0), (stage(StageKind.RETURN, height_m=0.0), 2.0)):
        motion = fly_px4((takeoff(40.0), end), PX4)
        stood_s = motion.segments.end_s[-1] - touched_s(motion)
        assert stood_s == pytest.approx(3.45 + delay_s, abs=0.05)
        assert grounded_s(motion) == pytest.approx(2.5 + 3.45 + delay_s)


def test_a_landing_elsewhere_is_flown_to_level() -> None:
    motion = fly_px4((takeoff(30.0), land(0.0, 120.0)), PX4)
    states = [STATES[state] for state in motion.segments.state]
    assert states == ["takeoff", "accelerate", "cruise", "brake", "land"]
    arrived = motion.state_at_time(motion.segments.end_s[3:4])
    assert arrived.height_m == pytest.approx(30.0, abs=0.05)
    landed = motion.state_at_time(motion.segments.end_s[-1:])
    assert (landed.north_m[0], landed.height_m[0]) == pytest.approx((120.0, 0.0), abs=0.01)


@settings(deadline=None, max_examples=examples(40))
@given(st.floats(0.2, 120.0), st.floats(-30.0, 30.0))
def test_landings_end_on_the_ground_they_were_meant_for(height_m: float, ground_m: float) -> None:
    over = max(ground_m, 0.0) + height_m
    motion = fly_px4((takeoff(over), go(0.0, 0.0, over, hold=60.0), land(ground_m=ground_m)), PX4)
    end = motion.state_at_time(motion.segments.end_s[-1:])
    assert end.height_m == pytest.approx(ground_m, abs=0.01)
    descent = motion.segments.duration_s[-1]
    least = (over - ground_m) / 1.5
    below_s = max(-ground_m, 0.0) * (1.0 / 0.7 - 1.0 / 1.5)
    # Slow over 10 m and below home, crawling over one, landed.
    assert least < descent < least + 8.5 + 5.0 + 5.0 + below_s


@pytest.mark.parametrize(
    ("change", "risen_s"),
    [
        # Flown by PX4's simulator from the items' beginnings: 5 m above the ground after 4.05 to 4.46 s of
        # six climbs by the defaults, and after 3.74 and 3.83 s at 2 m/s with a ramp of 1 s.
        ({}, 4.3),
        ({"climb_speed_m_s": 2.0, "takeoff_ramp_s": 1.0, "acceleration_up_m_s2": 3.0}, 3.8),
    ],
)
def test_a_climb_behind_a_landing_is_no_takeoff(change: dict[str, float], risen_s: float) -> None:
    parameters = replace(PX4, **change)
    motion = fly_px4((takeoff(25.0), land(), stage(StageKind.TAKEOFF, 0.0, 0.0, 25.0)), parameters)
    landed_s = float(motion.segments.end_s[motion.done_segment][1])
    times = np.arange(landed_s, landed_s + 10.0, 0.01)
    above = np.flatnonzero(motion.state_at_time(times).height_m > 5.0)
    assert times[above[0]] - landed_s == pytest.approx(risen_s, abs=0.3)


@pytest.mark.parametrize("change", [{"spool_up_s": 5.0}, {"takeoff_speed_m_s": 0.5}])
def test_what_slows_a_takeoff_does_not_slow_a_climb_behind_a_landing(
    change: dict[str, float],
) -> None:
    again = (takeoff(25.0), land(), stage(StageKind.TAKEOFF, 0.0, 0.0, 25.0))
    for parameters in (PX4, replace(PX4, **change)):
        done = done_s(*again, parameters=parameters)
        assert done[2] - done[1] == pytest.approx(13.0, abs=0.5)  # flown 11.6 to 13.0 s
