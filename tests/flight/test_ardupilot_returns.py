"""ArduPilot's return to launch against pencil and paper; one test per parameter."""

from __future__ import annotations

import math

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, fly, go, home, land, stage, states, takeoff, time_s, took_s
from ardupilot_times import RISE_S, START_S, STEP_S, VERTICAL_START_S, landing_s, leg_s
from hypothesis import given, settings
from hypothesis import strategies as st
from made_returns import to_home
from thinning import examples

from planner.findings import Severity
from planner.flight.motion.ardupilot.pilot import ardupilot_returns
from planner.flight.motion.ardupilot.stages import return_height_m
from planner.mission.route.stage import Stage, StageKind
from planner.vehicle.parameters.ardupilot import ArduPilotParameters


def return_s(
    parameters: ArduPilotParameters, *, distance: float = 1000.0, height: float = 50.0
) -> float:
    return time_s(ardupilot_returns(np.array([[distance, 0.0, height]]), to_home(), parameters))


def way_back_s(distance: float = 1000.0, v: float = 10.0) -> float:
    """Level leg and wait, without the delay of a start from rest."""
    return leg_s(distance, v) - START_S + 5.0


def test_a_return_above_rtl_alt_keeps_its_height() -> None:
    step = STEP_S / 2  # the centimetre before overlaps by half its time
    expected = step + START_S + way_back_s() + landing_s(50.0) + 2.1
    assert return_s(DEFAULTS) == pytest.approx(expected, abs=1e-3)


@pytest.mark.parametrize("top", [80.0, 120.0])
def test_rtl_alt_is_climbed_to_and_landed_from(top: float) -> None:
    parameters = ArduPilotParameters(return_altitude_m=top)
    climb = (top - 50.0) / 2.5 + 2.5 + 1.0 + RISE_S + VERTICAL_START_S
    # The corner at the top is passed until the vertical acceleration is whole: 1.3 s either side; the lag
    # of the lean costs a hundredth.
    expected = climb - 2.6 + way_back_s() + landing_s(top) + 2.1
    assert return_s(parameters) == pytest.approx(expected, abs=0.02)


def test_rtl_climb_min_is_climbed_at_least() -> None:
    by_climb = return_s(ArduPilotParameters(return_climb_min_m=30.0))
    assert by_climb == pytest.approx(
        return_s(ArduPilotParameters(return_altitude_m=80.0)), abs=1e-9
    )


def test_the_cone_keeps_near_returns_low() -> None:
    # 20 m away a slope of 3 allows 60 m; 10 m away 30 m, but never down.
    high = ArduPilotParameters(return_altitude_m=100.0)
    near = return_s(high, distance=20.0)
    assert near == pytest.approx(
        return_s(ArduPilotParameters(return_altitude_m=60.0), distance=20.0), abs=1e-9
    )
    assert return_s(high, distance=10.0) == pytest.approx(return_s(DEFAULTS, distance=10.0))
    flat = ArduPilotParameters(return_altitude_m=100.0, return_cone_slope=0.4)
    assert return_s(flat, distance=20.0) > near + 20.0


def test_the_ceiling_of_the_fence_keeps_returns_below_it() -> None:
    fenced = ArduPilotParameters(return_altitude_m=90.0, fence_enable=1, fence_height_max_m=72.0)
    assert return_s(fenced) == pytest.approx(
        return_s(ArduPilotParameters(return_altitude_m=70.0)), abs=1e-9
    )
    off = ArduPilotParameters(return_altitude_m=90.0, fence_height_max_m=72.0)
    assert return_s(off) > return_s(fenced)


METRES = st.integers(-100, 300).map(float)


def target_cm(
    own: ArduPilotParameters, alt_amsl: float, goal_amsl: float, home_amsl: float, way: float
) -> float:
    """Return the altitude above home of ``ModeRTL::compute_return_target``, line by line [cm]."""
    curr_alt = alt_amsl - home_amsl
    target_alt = max(goal_amsl - home_amsl, 0.0)
    min_rtl_alt = max(30.0, curr_alt + max(0.0, 100.0 * own.return_climb_min_m))
    target_alt = max(target_alt, 100.0 * own.return_altitude_m, min_rtl_alt)
    if own.return_cone_slope >= 0.5:
        target_alt = min(target_alt, max(way * own.return_cone_slope, min_rtl_alt))
    if own.fence_enable:
        target_alt = min(target_alt, 100.0 * (own.fence_height_max_m - own.fence_margin_m))
    return max(target_alt, curr_alt)


@settings(max_examples=examples(100))
@given(
    alt=METRES,
    goal=METRES,
    home=METRES,
    way=st.integers(0, 400).map(float),
    slope=st.sampled_from([0.0, 0.4, 0.5, 3.0]),
    climb=st.sampled_from([0.0, 7.0]),
    fence=st.booleans(),
)
def test_return_heights_are_those_of_the_source_whatever_home_and_goal(
    *, alt: float, goal: float, home: float, way: float, slope: float, climb: float, fence: bool
) -> None:
    own = ArduPilotParameters(
        return_altitude_m=40.0,
        return_climb_min_m=climb,
        return_cone_slope=slope,
        fence_enable=int(fence),
        fence_height_max_m=90.0,
    )
    found = return_height_m(
        np.array([[0.0, 0.0, alt]]),
        np.array([[way, 0.0, goal]]),
        np.array([home]),
        np.array([np.nan]),
        own,
    )
    above_cm = target_cm(own, 100.0 * alt, 100.0 * goal, 100.0 * home, 100.0 * way)
    assert found == pytest.approx(home + above_cm / 100.0, abs=1e-9)


def test_a_final_altitude_counts_from_home_not_from_the_ground_of_a_rally_point() -> None:
    parameters = ArduPilotParameters(return_final_altitude_m=20.0, return_altitude_m=60.0)
    start_m = np.array([[100.0, 0.0, 50.0]])
    motion = ardupilot_returns(start_m, to_home(15.0), parameters)
    assert motion.segments.climb_m[-1] == pytest.approx(-40.0)
    moved = ardupilot_returns(start_m, to_home(15.0, datum_m=15.0), parameters)
    assert moved.segments.climb_m[-1] == pytest.approx(-40.0)
    assert moved.segments.climb_m.sum() == pytest.approx(15.0 + 20.0 - 50.0)


def test_ground_above_the_height_of_a_return_is_stood_on_at_that_height() -> None:
    start_m = np.array([[100.0, 0.0, 50.0]])
    hill = to_home(80.0, above_ground_m=-80.0)  # its altitude given as home's
    motion = ardupilot_returns(start_m, hill, DEFAULTS)
    assert motion.segments.climb_m.sum() == pytest.approx(0.0)
    assert (motion.segments.duration_s >= 0.0).all()


def test_rtl_speed_sets_the_way_back() -> None:
    slow = return_s(ArduPilotParameters(return_speed_m_s=8.0))
    assert slow - return_s(DEFAULTS) == pytest.approx(leg_s(1000.0, 8.0) - leg_s(1000.0), abs=1e-6)


def test_rtl_loit_time_is_waited() -> None:
    waits = return_s(ArduPilotParameters(return_loiter_s=25.0))
    assert waits - return_s(DEFAULTS) == pytest.approx(20.0, abs=1e-9)


def test_a_final_altitude_ends_the_return_in_the_air() -> None:
    parameters = ArduPilotParameters(return_final_altitude_m=20.0)
    motion = ardupilot_returns(np.array([[100.0, 0.0, 50.0]]), to_home(), parameters)
    assert states(motion)[-1] == "descend"
    assert motion.segments.climb_m[-1] == pytest.approx(-30.0)


def codes_of(parameters: ArduPilotParameters, last: Stage) -> list[tuple[str, Severity]]:
    motion = fly(takeoff(), go(500.0), last, parameters=parameters)
    return [(finding.code, finding.severity) for finding in motion.findings]


def test_rtl_alt_type_over_terrain_is_said_for_the_way_home_too() -> None:
    terrain = ArduPilotParameters(return_altitude_type=1)
    assert codes_of(terrain, home()) == [("A113", Severity.WARNING)]
    assert codes_of(terrain, land()) == [("A113", Severity.WARNING)]
    assert codes_of(DEFAULTS, home()) == []


@pytest.mark.parametrize(
    ("behavior", "yaw_deg_s", "wait_s"),
    [
        # ``AutoYaw::default_mode``: 1 and 3 turn back to the heading of the arming, half a turn at most
        (1, 5.0, 36.0),
        (3, 5.0, 36.0),
        (0, 5.0, 5.0),
        (2, 5.0, 5.0),
        (1, 60.0, 5.0),  # 3 s, within RTL_LOIT_TIME
    ],
)
def test_a_return_waits_over_home_for_the_heading_it_was_armed_with(
    behavior: int, yaw_deg_s: float, wait_s: float
) -> None:
    parameters = ArduPilotParameters(yaw_behavior=behavior, yaw_rate_rad_s=math.radians(yaw_deg_s))
    flights = (fly(takeoff(), go(500.0), home(), parameters=one) for one in (parameters, DEFAULTS))
    slow_s, usual_s = (float(one.segments.duration_s.sum()) for one in flights)
    assert slow_s - usual_s == pytest.approx(wait_s - 5.0, abs=1e-9)


def test_a_return_starts_from_a_stop_and_its_speed_is_not_the_mission_s() -> None:
    fast = fly(takeoff(), stage(StageKind.GO, 500.0, speed=15.0), home())
    assert took_s(fast, 2) == pytest.approx(return_s(DEFAULTS, distance=500.0), abs=1e-6)


def test_ways_home_are_those_of_single_flights() -> None:
    points = np.array([[300.0, 400.0, 80.0], [0.0, -50.0, 5.0], [-1000.0, 0.0, 12.0]])
    together = ardupilot_returns(points, to_home(returns=3), DEFAULTS).segments
    for row, point in enumerate(points):
        alone = ardupilot_returns(point[None], to_home(), DEFAULTS).segments
        mine = together.item == row
        assert together.duration_s[mine] == pytest.approx(alone.duration_s, abs=1e-9)
        assert together.distance_m[mine] == pytest.approx(alone.distance_m, abs=1e-9)


@pytest.mark.parametrize(
    ("jerk_m_s3", "height_m", "hold_s", "most_s"),
    [
        (12.0, 50.0, 0.0, 9.5),
        (12.0, 50.0, 9.0, 0.5),
        (12.0, 50.0, 9.6, 0.0),
        (12.0, 10.0, 0.0, 0.0),  # climbs
        (4.0, 50.0, 0.0, 10.1),  # A/J of 0.625 s
        (3.9, 50.0, 0.0, 0.0),  # and of 0.641 s
        (1.0, 50.0, 0.0, 0.0),
    ],
)
def test_a_return_begun_behind_a_stop_may_stand_still_where_wpnav_jerk_is_high(
    jerk_m_s3: float, height_m: float, hold_s: float, most_s: float
) -> None:
    # L = 4.1 mm, a centimetre on the mean, at the snap S = J π/(2 · 0.3 s) takes T = 4 (π L/S)^¼: 0.48 s at
    # 12 m/s³ (A/J: 0.21), up to 2 L/T = 17 mm/s; from 2 m off to that much 2 s times ln 117.  At 3.95 m/s³ it
    # takes 0.63 s, as long as A/J.
    motion = fly(
        takeoff(height_m),
        go(100.0, height_m=height_m, hold=hold_s),
        home(),
        parameters=ArduPilotParameters(jerk_m_s3=jerk_m_s3),
    )
    spread_s = motion.wait_spread_s
    told = [one.severity for one in motion.findings if one.code == "T102"]
    if most_s:
        assert spread_s is not None
        assert spread_s.max() == pytest.approx(most_s, abs=0.1)
        assert spread_s.min() == 0.0
        assert (spread_s == 0.0).mean() == pytest.approx(0.5, abs=0.02)
        assert motion.wait_segment == motion.arrival_segment[1] + 1
        assert told == [Severity.WARNING]
    else:
        assert spread_s is None
        assert not told
