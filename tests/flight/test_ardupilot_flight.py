"""ArduPilot's flights against pencil, paper and recorded figures; one test per parameter."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from ardupilot_missions import DEFAULTS, fly, go, stage, states, takeoff, time_s, took_s
from hypothesis import given, settings
from hypothesis import strategies as st

from planner.findings import Severity
from planner.flight.motion.ardupilot.flight import ardupilot_ways_home, fly_ardupilot
from planner.flight.motion.ardupilot.stops import stopping_distance_m
from planner.flight.state import STATES
from planner.mission.stage import Stage, StageKind
from planner.physics.wind import Wind
from planner.vehicle.ardupilot_parameters import ArduPilotParameters

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import Motion

RISE_S = 0.3
"""Twice ATC_INPUT_TC of 0.15 s."""
START_S = 0.3
"""What a start from rest loses: twice ATC_INPUT_TC."""
VERTICAL_START_S = 0.37
STEP_S = 8 * (0.01 * RISE_S / 8) ** 0.25
"""The S-curve of the centimetre to which heights are rounded before landings."""


def leg_s(length: float, v: float = 10.0, a: float = 2.5, j: float = 1.0) -> float:
    """A stop-to-stop leg with steady acceleration and cruise."""
    return length / v + v / a + a / j + RISE_S + START_S


def landing_s(height: float, v: float = 1.5, slow: float = 0.5, low: float = 10.0) -> float:
    """From standing to touch-down with an acceleration of 1 and a gain of 1."""
    slowing_m = v**2 / 2 + 0.5
    steady = (height - low - slowing_m - v**2 / 2) / v
    return v + steady + (v - 1.0) + math.log(1.0 / slow) + (low + slow) / slow


def land(east_m: float = 0.0, north_m: float = 0.0) -> Stage:
    return stage(StageKind.LAND, east_m, north_m, 0.0)


def home() -> Stage:
    return stage(StageKind.RETURN, 0.0, 0.0, 0.0)


def hop_s(parameters: ArduPilotParameters, length: float = 1000.0) -> float:
    return took_s(fly(takeoff(), go(length, hold=1.0), parameters=parameters), 1) - 1.0


# Straight legs.


@pytest.mark.parametrize("speed", [5.0, 7.0, 10.0, 14.0])
def test_wp_spd_sets_the_time_of_a_leg(speed: float) -> None:
    # At 5 m/s the acceleration of 2.5 is not reached: two ramps of 2 (a + 0.3), a (0.3 + a) = 5.
    a = -0.15 + (0.15**2 + 5.0) ** 0.5
    expected = leg_s(1000.0, speed) if speed > 7.0 - 1e-9 else 200.0 + 2 * (a + 0.3) + START_S
    assert hop_s(ArduPilotParameters(cruise_speed_m_s=speed)) == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize("acceleration", [1.0, 2.0, 2.5])
def test_wp_acc_sets_the_time_of_a_leg(acceleration: float) -> None:
    parameters = ArduPilotParameters(acceleration_m_s2=acceleration)
    assert hop_s(parameters) == pytest.approx(leg_s(1000.0, a=acceleration), abs=1e-6)


@pytest.mark.parametrize("jerk", [1.0, 2.0, 3.0])
def test_wp_jerk_sets_the_time_of_a_leg(jerk: float) -> None:
    parameters = ArduPilotParameters(jerk_m_s3=jerk)
    assert hop_s(parameters) == pytest.approx(leg_s(1000.0, j=jerk), abs=1e-6)


def test_atc_input_tc_counts_four_times_in_a_leg() -> None:
    slow = ArduPilotParameters(attitude_time_constant_s=0.25)
    assert hop_s(slow) - hop_s(DEFAULTS) == pytest.approx(4 * 0.1, abs=1e-9)


@pytest.mark.parametrize(
    ("speed", "length", "flown"),
    [
        (3.0, 150.0, 54.06),
        (5.0, 250.0, 55.13),
        (8.0, 400.0, 56.33),
        (10.0, 500.0, 57.09),
        (12.0, 600.0, 58.02),
        (15.0, 700.0, 55.71),
    ],
)
def test_legs_take_the_time_they_were_flown_in(speed: float, length: float, flown: float) -> None:
    # A recorded speed sweep, mean of both directions; they differ by 0.1 s.
    parameters = ArduPilotParameters(cruise_speed_m_s=speed)
    assert hop_s(parameters, length) == pytest.approx(flown, abs=0.2)


def test_a_climbing_leg_keeps_to_the_climb_speed_along_its_line() -> None:
    # 100 m up over 100 m: 2.5 / sin 45° along the line, WP_ACC_Z / sin 45°, both lags by half.
    motion = fly(takeoff(), go(100.0, height_m=150.0, hold=1.0))
    root = 2.0**0.5
    expected = 100.0 / 2.5 + 2.5 / 1.0 + root + RISE_S + 0.5 * (START_S + VERTICAL_START_S)
    assert took_s(motion, 1) - 1.0 == pytest.approx(expected, abs=1e-6)


@pytest.mark.parametrize(("end_m", "speed"), [(150.0, 2.0), (150.0, 4.0), (20.0, 1.5), (20.0, 3.0)])
def test_wp_spd_up_and_wp_spd_dn_set_vertical_legs(end_m: float, speed: float) -> None:
    parameters = ArduPilotParameters(climb_speed_m_s=speed, descent_speed_m_s=speed)
    motion = fly(takeoff(), go(0.0, height_m=end_m, hold=1.0), parameters=parameters)
    expected = abs(end_m - 50.0) / speed + speed + 1.0 + RISE_S + VERTICAL_START_S
    assert took_s(motion, 1) - 1.0 == pytest.approx(expected, abs=1e-6)


def test_wp_acc_z_sets_vertical_legs() -> None:
    motion = fly(
        takeoff(),
        go(0.0, height_m=150.0, hold=1.0),
        parameters=ArduPilotParameters(vertical_acceleration_m_s2=0.5),
    )
    expected = 100.0 / 2.5 + 2.5 / 0.5 + 0.5 + RISE_S + VERTICAL_START_S
    assert took_s(motion, 1) - 1.0 == pytest.approx(expected, abs=1e-6)


def test_speeds_of_the_mission_overrule_the_parameters() -> None:
    level = stage(StageKind.GO, 700.0, speed=7.0, hold=1.0)
    up = stage(StageKind.GO, 700.0, 0.0, 150.0, climb=4.0, hold=1.0)
    down = stage(StageKind.GO, 700.0, 0.0, 50.0, descent=2.0, hold=1.0)
    motion = fly(takeoff(), level, up, down)
    assert took_s(motion, 1) - 1.0 == pytest.approx(leg_s(700.0, 7.0), abs=1e-6)
    assert took_s(motion, 2) - 1.0 == pytest.approx(
        25.0 + 4.0 + 1.0 + RISE_S + VERTICAL_START_S, abs=1e-6
    )
    assert took_s(motion, 3) - 1.0 == pytest.approx(
        50.0 + 2.0 + 1.0 + RISE_S + VERTICAL_START_S, abs=1e-6
    )


# Corners and stops.


def corner_half_s(radius: float = 2.0) -> float:
    """Half the overlap at 90°: within the jerk, the rise of it shifting all by its half."""
    return 0.5 * RISE_S + math.cbrt(6 * radius / math.sqrt(2.0))


@pytest.mark.parametrize("radius", [0.5, 2.0, 5.0])
def test_wp_radius_sets_what_a_corner_saves(radius: float) -> None:
    parameters = ArduPilotParameters(waypoint_radius_m=radius)
    motion = fly(
        takeoff(), go(500.0), go(500.0, 500.0), go(0.0, 500.0, hold=1.0), parameters=parameters
    )
    half = corner_half_s(radius)
    if radius < 3.0:  # beyond, the acceleration is steady half-way
        assert took_s(motion, 1) == pytest.approx(leg_s(500.0) - half, abs=1e-3)
        assert took_s(motion, 2) == pytest.approx(leg_s(500.0) - START_S - 2 * half, abs=1e-3)
    else:
        assert took_s(motion, 2) < leg_s(500.0) - 2 * corner_half_s(2.0)


def test_a_survey_line_and_its_turn_take_the_time_they_were_flown_in() -> None:
    # Recorded: 220 m lines 24.43 s, 40 m between them 6.90 s, again and again.
    motion = fly(
        takeoff(), go(220.0), go(220.0, 40.0), go(0.0, 40.0), go(0.0, 80.0), go(220.0, 80.0)
    )
    assert took_s(motion, 2) == pytest.approx(6.90, abs=0.02)
    assert took_s(motion, 3) == pytest.approx(24.43, abs=0.02)


def test_wp_acc_cnr_slows_corners_down() -> None:
    stages = (takeoff(), go(500.0), go(500.0, 500.0), go(0.0, 500.0, hold=1.0))
    motion = fly(*stages, parameters=ArduPilotParameters(corner_acceleration_m_s2=1.5))
    # Half-way J t √2 = 1.5.
    half = 0.5 * RISE_S + 1.5 / 2**0.5
    assert took_s(motion, 2) == pytest.approx(leg_s(500.0) - START_S - 2 * half, abs=1e-3)


@pytest.mark.parametrize(
    "following",
    [
        land(500.0, 500.0),
        home(),
        stage(StageKind.CIRCLE, 500.0, 500.0, turns=1, radius=20.0),
        stage(StageKind.CHANGE_HEIGHT, 500.0, 500.0, 80.0),
        stage(StageKind.DELAY, hold=5.0),
        stage(StageKind.TAKEOFF, 500.0, 0.0, 80.0),
    ],
    ids=lambda s: s.kind.value,
)
def test_some_items_are_stopped_for(following: Stage) -> None:
    assert took_s(fly(takeoff(), go(500.0), following), 1) == pytest.approx(leg_s(500.0), abs=1e-9)


@pytest.mark.parametrize("kind", [StageKind.GO, StageKind.LOITER, StageKind.SET_DOWN])
def test_some_items_are_flown_through_to(kind: StageKind) -> None:
    motion = fly(takeoff(), go(500.0), stage(kind, 500.0, 500.0))
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0) - corner_half_s(), abs=1e-3)


def test_a_hold_and_the_end_of_the_mission_are_stops() -> None:
    motion = fly(takeoff(), go(500.0, hold=4.0), go(500.0, 500.0))
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0) + 4.0, abs=1e-9)
    assert took_s(motion, 2) == pytest.approx(leg_s(500.0), abs=1e-9)


def test_a_waypoint_given_twice_is_a_stop() -> None:
    motion = fly(takeoff(), go(500.0), go(500.0), go(500.0, 500.0))
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0), abs=1e-9)
    assert took_s(motion, 2) == 0.0
    assert took_s(motion, 3) == pytest.approx(leg_s(500.0), abs=1e-9)


def test_delays_and_loiter_times_are_exact() -> None:
    motion = fly(
        takeoff(), stage(StageKind.LOITER, 500.0, hold=30.0), stage(StageKind.DELAY, hold=12.0)
    )
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0) + 30.0, abs=1e-9)
    assert took_s(motion, 2) == pytest.approx(12.0, abs=1e-9)


def test_a_higher_speed_commanded_in_passing_is_taken_up_at_the_corner() -> None:
    slow = stage(StageKind.GO, 500.0, speed=5.0)
    fast = stage(StageKind.GO, 500.0, 500.0, speed=10.0, hold=1.0)
    motion = fly(takeoff(), slow, fast)
    # Two ramps of 5 m/s with the mean speeds 2.5 and 7.5 instead of one with 5.
    a = -0.15 + (0.15**2 + 5.0) ** 0.5
    ramp = 2 * (a + 0.3)
    expected = 2 * ramp + (500.0 - 10.0 * ramp - 34.0) / 10.0 + 6.8 - corner_half_s()
    assert took_s(motion, 2) - 1.0 == pytest.approx(expected, abs=1e-3)


# Take-off and landing.


@pytest.mark.parametrize("height", [15.0, 50.0, 200.0])
def test_a_takeoff_takes_the_time_it_was_flown_in(height: float) -> None:
    assert time_s(fly(takeoff(height))) == pytest.approx(height / 2.5 + 6.34, abs=0.15)
    parameters = ArduPilotParameters(climb_speed_m_s=3.5, vertical_acceleration_m_s2=0.8)
    if height > 40.0:
        recorded = height / 3.5 + 8.94
        assert time_s(fly(takeoff(height), parameters=parameters)) == pytest.approx(
            recorded, abs=0.15
        )


def test_the_vehicle_stands_at_no_power_until_its_motors_idle() -> None:
    motion = fly(takeoff(), home())
    grounded = motion.piece_is_grounded
    assert grounded is not None
    # 2 s after arming and half a second of spooling up; 1.6 s and the same again after touch-down.
    assert grounded[0]
    assert grounded[-1]
    assert grounded.sum() == 2
    assert motion.piece_duration_s[grounded] == pytest.approx([2.5, 2.1])


def test_mot_spool_time_counts_before_and_after() -> None:
    slow = ArduPilotParameters(spool_up_s=1.5)
    added = time_s(fly(takeoff(), home(), parameters=slow)) - time_s(fly(takeoff(), home()))
    assert added == pytest.approx(2.0, abs=1e-9)


@pytest.mark.parametrize(
    ("changed", "factor"),
    [
        (ArduPilotParameters(takeoff_slew_s=4.0), 4.0 * 0.35),
        (ArduPilotParameters(hover_throttle=0.5), 2.0 * 0.5),
    ],
)
def test_tkoff_slew_time_and_hover_throttle_set_the_lift_off(
    changed: ArduPilotParameters, factor: float
) -> None:
    added = time_s(fly(takeoff(), parameters=changed)) - time_s(fly(takeoff()))
    assert added == pytest.approx((factor - 0.7) * (1 + 0.5 / 9.80665), abs=1e-9)


@pytest.mark.parametrize("height", [20.0, 50.0, 200.0])
def test_a_landing_goes_by_wp_spd_dn_then_by_land_spd(height: float) -> None:
    motion = fly(takeoff(height), land())
    assert took_s(motion, 1) == pytest.approx(STEP_S + landing_s(height) + 2.1, abs=1e-6)


@pytest.mark.parametrize(("v", "extra"), [(1.5, 1.6), (2.5, 2.9)])
def test_a_landing_takes_the_time_it_was_flown_in(v: float, extra: float) -> None:
    motion = fly(takeoff(100.0), land(), parameters=ArduPilotParameters(descent_speed_m_s=v))
    recorded = 90.0 / v + 20.0 + extra + 2.1
    assert took_s(motion, 1) - STEP_S == pytest.approx(recorded, abs=0.3)


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        (ArduPilotParameters(land_speed_m_s=0.3), landing_s(100.0, slow=0.3)),
        (ArduPilotParameters(land_slow_height_m=30.0), landing_s(100.0, low=30.0)),
        (ArduPilotParameters(land_slow_height_m=0.0), landing_s(100.0, low=1.0)),
        (ArduPilotParameters(land_high_speed_m_s=3.0), landing_s(100.0, v=3.0)),
        (ArduPilotParameters(descent_speed_m_s=2.0), landing_s(100.0, v=2.0)),
    ],
    ids=["LAND_SPD", "LAND_ALT_LOW", "LAND_ALT_LOW 0", "LAND_SPD_HIGH", "WP_SPD_DN"],
)
def test_each_parameter_of_landings_moves_them_by_its_law(
    parameters: ArduPilotParameters, expected: float
) -> None:
    motion = fly(takeoff(100.0), land(), parameters=parameters)
    assert took_s(motion, 1) == pytest.approx(STEP_S + expected + 2.1, abs=1e-6)


def test_speeds_of_the_mission_do_not_change_landings() -> None:
    commanded = stage(StageKind.LAND, 0.0, 0.0, 0.0, descent=4.0)
    assert time_s(fly(takeoff(), commanded)) == time_s(fly(takeoff(), land()))


def test_a_landing_elsewhere_is_flown_to_level_first() -> None:
    motion = fly(takeoff(), land(500.0))
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0) + landing_s(50.0) + 2.1, abs=1e-6)
    assert states(motion)[1:] == ["accelerate", "cruise", "brake", "land"]


# Return to launch.


def return_s(
    parameters: ArduPilotParameters, *, distance: float = 1000.0, height: float = 50.0
) -> float:
    return time_s(ardupilot_ways_home(np.array([[distance, 0.0, height]]), np.zeros(3), parameters))


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
    # The corner at the top is passed until the vertical acceleration is whole: 1.3 s either side.
    expected = climb - 2.6 + way_back_s() + landing_s(top) + 2.1
    assert return_s(parameters) == pytest.approx(expected, abs=1e-3)


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


def test_rtl_speed_sets_the_way_back() -> None:
    slow = return_s(ArduPilotParameters(return_speed_m_s=8.0))
    assert slow - return_s(DEFAULTS) == pytest.approx(leg_s(1000.0, 8.0) - leg_s(1000.0), abs=1e-6)


def test_rtl_loit_time_is_waited() -> None:
    waits = return_s(ArduPilotParameters(return_loiter_s=25.0))
    assert waits - return_s(DEFAULTS) == pytest.approx(20.0, abs=1e-9)


def test_a_final_altitude_ends_the_return_in_the_air_and_says_so() -> None:
    parameters = ArduPilotParameters(return_final_altitude_m=20.0)
    motion = ardupilot_ways_home(np.array([[100.0, 0.0, 50.0]]), np.zeros(3), parameters)
    assert states(motion)[-1] == "descend"
    assert motion.segments.climb_m[-1] == pytest.approx(-30.0)
    assert [finding.code for finding in motion.findings] == ["M102"]


def codes_of(parameters: ArduPilotParameters, last: Stage) -> list[tuple[str, Severity]]:
    motion = fly(takeoff(), go(500.0), last, parameters=parameters)
    return [(finding.code, finding.severity) for finding in motion.findings]


def test_rtl_alt_type_over_terrain_is_said_for_the_way_home_too() -> None:
    terrain = ArduPilotParameters(return_altitude_type=1)
    assert codes_of(terrain, home()) == [("A113", Severity.WARNING)]
    assert codes_of(terrain, land()) == [("A113", Severity.WARNING)]
    assert codes_of(DEFAULTS, home()) == []


def test_a_return_that_may_wait_for_its_heading_says_so() -> None:
    # Half a turn at 60°/s takes 3 s.
    hasty = ArduPilotParameters(return_loiter_s=2.0)
    assert codes_of(hasty, home()) == [("T107", Severity.INFO)]
    assert codes_of(hasty, land()) == []
    assert codes_of(ArduPilotParameters(return_loiter_s=3.1), home()) == []
    held = ArduPilotParameters(return_loiter_s=2.0, yaw_behavior=0)
    assert codes_of(held, home()) == []
    slow = ArduPilotParameters(yaw_rate_rad_s=math.radians(30.0))
    assert codes_of(slow, home()) == [("T107", Severity.INFO)]


def test_a_return_starts_from_a_stop_and_its_speed_is_not_the_mission_s() -> None:
    fast = fly(takeoff(), stage(StageKind.GO, 500.0, speed=15.0), home())
    assert took_s(fast, 2) == pytest.approx(return_s(DEFAULTS, distance=500.0), abs=1e-6)


def test_ways_home_are_those_of_single_flights() -> None:
    points = np.array([[300.0, 400.0, 80.0], [0.0, -50.0, 5.0], [-1000.0, 0.0, 12.0]])
    together = ardupilot_ways_home(points, np.zeros(3), DEFAULTS).segments
    for row, point in enumerate(points):
        alone = ardupilot_ways_home(point[None], np.zeros(3), DEFAULTS).segments
        mine = together.item == row
        assert together.duration_s[mine] == pytest.approx(alone.duration_s, abs=1e-9)
        assert together.distance_m[mine] == pytest.approx(alone.distance_m, abs=1e-9)


# Circles, changes of height, loads, splines.


def circle_s(parameters: ArduPilotParameters, *, speed: float = 10.0, turns: float = 2.0) -> float:
    """The circle alone: it begins where the vehicle is, on its edge."""
    motion = fly(
        takeoff(),
        stage(StageKind.GO, 20.0, hold=1.0),
        stage(StageKind.CIRCLE, turns=turns, radius=20.0, speed=speed),
        parameters=parameters,
    )
    return took_s(motion, 2)


def test_a_circle_of_20_m_at_4_m_s_takes_31_seconds_a_turn() -> None:
    # 2π 20/4 = 31.4 s; recorded 31 to 32 s.
    assert circle_s(DEFAULTS, speed=4.0, turns=3) - circle_s(
        DEFAULTS, speed=4.0, turns=2
    ) == pytest.approx(2 * math.pi * 5.0, abs=1e-6)


@pytest.mark.parametrize(
    ("parameters", "rate"),
    [
        (DEFAULTS, (0.5 * 2.5 * 20) ** 0.5 / 20),
        (ArduPilotParameters(acceleration_m_s2=1.6), 4.0 / 20),
        (ArduPilotParameters(circle_rate_rad_s=0.1), 0.1),
    ],
    ids=["half the acceleration", "WP_ACC", "CIRCLE_RATE"],
)
def test_circles_are_as_fast_as_their_rate_and_half_the_acceleration_allow(
    parameters: ArduPilotParameters, rate: float
) -> None:
    speeding_up = 0.5 * rate / (parameters.acceleration_m_s2 / 20)
    assert circle_s(parameters) == pytest.approx(4 * math.pi / rate + speeding_up, abs=1e-6)


def test_circles_turn_clockwise_and_the_other_way_for_a_negative_radius() -> None:
    for radius, north in ((20.0, -1.0), (-20.0, 1.0)):
        motion = fly(takeoff(), go(20.0, hold=1.0), stage(StageKind.CIRCLE, turns=1, radius=radius))
        begun = float(motion.segments.end_s[motion.done_segment[1]])
        state = motion.state_at_time(np.array([begun + 1.0]))
        assert np.sign(state.north_m_s[0]) == north  # east of the centre, northwards or southwards


def test_a_circle_is_flown_to_from_more_than_three_metres() -> None:
    motion = fly(takeoff(), stage(StageKind.CIRCLE, 100.0, turns=1, radius=20.0))
    assert motion.segments.distance_m.sum() == pytest.approx(
        80.0 + 2 * math.pi * 20.0 + 6.15, abs=0.3
    )


def test_a_circle_of_no_turns_ends_at_its_edge() -> None:
    motion = fly(takeoff(), stage(StageKind.CIRCLE, 100.0, turns=0, radius=20.0), go(100.0))
    assert motion.segments.distance_m.sum() == pytest.approx(100.0, abs=1e-6)


def test_circle_radius_is_used_where_the_item_has_none() -> None:
    motion = fly(
        takeoff(),
        stage(StageKind.CIRCLE, 100.0, turns=1),
        parameters=ArduPilotParameters(circle_radius_m=30.0),
    )
    assert motion.segments.distance_m[: motion.arrival_segment[1]].sum() == pytest.approx(
        70.0, abs=0.1
    )


def test_a_circle_without_any_radius_is_a_turn_on_the_spot() -> None:
    motion = fly(
        takeoff(),
        stage(StageKind.CIRCLE, turns=2),
        parameters=ArduPilotParameters(circle_radius_m=0.0, circle_rate_rad_s=0.5),
    )
    assert states(motion)[-1] == "hover"
    # The rate of 0.5 is reached within a second: half a second more.
    assert motion.segments.duration_s[-1] == pytest.approx(4 * math.pi / 0.5 + 0.5, abs=1e-6)


def test_a_change_of_height_ends_with_the_square_root_controller() -> None:
    motion = fly(takeoff(), stage(StageKind.CHANGE_HEIGHT, height_m=100.0))
    # Up by 2.5: 2.5 s and 3.125 m to speed up; 1.5 s and 2.625 m to slow down to 1, the last metre
    # exponentially to 5 cm.
    expected = 2.5 + (50.0 - 3.125 - 3.625) / 2.5 + 1.5 + math.log(20.0)
    assert took_s(motion, 1) == pytest.approx(expected, abs=1e-6)


def test_a_load_is_set_down_and_left_behind() -> None:
    motion = fly(takeoff(20.0), stage(StageKind.SET_DOWN, 500.0, height_m=20.0))
    assert states(motion)[-3:] == ["descend", "hover", "climb"]
    # 0.5 m/s after half a second of speeding up, 0.125 m.
    assert motion.segments.duration_s[-3] == pytest.approx(0.5 + 19.875 / 0.5)
    assert motion.segments.duration_s[-2] == pytest.approx(0.5)
    assert motion.segments.climb_m[-3:] == pytest.approx([-20.0, 0.0, 20.0])


def test_pldp_parameters_move_the_setting_down() -> None:
    parameters = ArduPilotParameters(place_descent_speed_m_s=1.0, place_delay_s=3.0)
    motion = fly(
        takeoff(20.0), stage(StageKind.SET_DOWN, 500.0, height_m=20.0), parameters=parameters
    )
    assert motion.segments.duration_s[-3] == pytest.approx(1.0 + 19.5)
    assert motion.segments.duration_s[-2] == pytest.approx(3.5)


def test_a_spline_through_points_on_a_line_is_a_leg_with_half_the_acceleration() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k) for k in (1, 2, 3)]
    motion = fly(takeoff(), *points)
    # From rest to rest over 600 m at 10 m/s with 1.25 m/s².
    assert time_s(motion) - time_s(fly(takeoff())) == pytest.approx(60.0 + 10.0 / 1.25, rel=0.03)
    assert motion.segments.distance_m.sum() == pytest.approx(600.0, rel=1e-3)


def test_splines_keep_their_speed_where_they_hardly_bend() -> None:
    points = [stage(StageKind.SPLINE, 200.0 * k, 10.0 * (k % 2)) for k in range(1, 6)]
    motion = fly(takeoff(), *points)
    piece = np.arange(len(motion.piece_duration_s))
    begins = motion.piece_start_s()
    speed = motion.state_at(piece, 0.5 * motion.piece_duration_s).ground_speed_m_s
    first, last = (motion.segments.end_s[motion.arrival_segment[k]] for k in (1, 4))
    assert speed[(begins > first) & (begins < last)].min() > 9.0


def test_straight_legs_join_splines_at_speed() -> None:
    motion = fly(takeoff(), go(300.0), stage(StageKind.SPLINE, 600.0), go(900.0, hold=1.0))
    stopped = 3 * leg_s(300.0)
    assert motion.segments.duration_s[1:].sum() < stopped - 2 * 5.0


# Wind and lean.


def windy(wind_m_s: float, limit: float | None, *, speed: float = 10.0) -> tuple[float, list[str]]:
    motion = fly_ardupilot(
        (takeoff(), stage(StageKind.GO, 1000.0, speed=speed, hold=1.0)),
        DEFAULTS,
        wind=Wind(speed_m_s=wind_m_s, from_deg=90.0),
        airspeed_limit_m_s=limit,
    )
    cruise = [STATES[s].value for s in motion.segments.state].index("cruise")
    return float(motion.segments.speed_m_s[cruise]), [f.code for f in motion.findings]


def test_ground_speed_is_held_in_wind_until_the_lean_limit() -> None:
    assert windy(8.0, None) == (10.0, [])
    assert windy(8.0, 20.0) == (10.0, [])
    speed, codes = windy(8.0, 15.0)
    assert speed == pytest.approx(7.0)
    assert codes == ["W102"]


def test_a_speed_beyond_the_lean_limit_is_not_reached_in_still_air() -> None:
    speed, codes = windy(0.0, 10.26, speed=15.0)
    assert speed == pytest.approx(10.26)
    assert codes == ["W102"]


def test_no_headway_is_an_error() -> None:
    assert windy(16.0, 15.0)[1] == ["W101"]


def profiled(*stages: Stage, limit: float = 15.0) -> Motion:
    # 5 m/s from east at 10 m, growing with the root of the height: 10 m/s at 40 m, 15 m/s at 90 m.
    wind = Wind(speed_m_s=5.0, from_deg=90.0, reference_height_m=10.0, shear_exponent=0.5)
    return fly_ardupilot(stages, DEFAULTS, wind=wind, airspeed_limit_m_s=limit)


def test_a_wind_that_grows_with_height_slows_the_higher_leg_more() -> None:
    low = profiled(takeoff(10.0), go(1000.0, height_m=10.0, hold=1.0))
    high = profiled(takeoff(40.0), go(1000.0, height_m=40.0, hold=1.0))
    assert max(low.segments.speed_m_s) == pytest.approx(10.0)
    assert low.findings == ()
    assert high.segments.speed_m_s[1:].max() == pytest.approx(5.0)
    assert [f.code for f in high.findings] == ["W102"]


def test_a_leg_through_a_wind_profile_is_flown_at_the_lowest_speed_it_meets() -> None:
    climbing = profiled(takeoff(10.0), go(1000.0, height_m=40.0, hold=1.0))
    # 5 m/s over the ground at its upper end, along a line that rises 30 m on 1,000 m
    assert climbing.segments.speed_m_s[1:].max() == pytest.approx(5.0)
    assert [f.code for f in profiled(takeoff(90.0), go(500.0, height_m=90.0)).findings] == ["W101"]


def test_splines_keep_to_the_lean_limit_as_well() -> None:
    spline = stage(StageKind.SPLINE, 1000.0, 0.0, 40.0)
    motion = profiled(takeoff(40.0), spline)
    assert motion.segments.speed_m_s[-1] == pytest.approx(5.0)
    assert [f.code for f in motion.findings] == ["W102"]


def test_a_vehicle_at_its_lean_limit_starts_later() -> None:
    # 0.5 /s of drag at the limit of 11.3 m/s: (c ln(6.5/2) − 5 % of 4.5 s) later; recorded 0.4 s.
    def took(limit: float | None) -> float:
        motion = fly_ardupilot((takeoff(), go(1000.0)), DEFAULTS, airspeed_limit_m_s=limit)
        return took_s(motion, 1)

    drag = 9.80665 * math.tan(math.radians(30.0)) / 11.3
    assert took(11.3) - took(None) == pytest.approx(drag * math.log(3.25) - 0.05 * 4.5, abs=1e-6)
    assert took(40.0) == took(None)


def test_the_autopilot_s_metre_is_not_the_ellipsoid_s() -> None:
    # At 47° a degree of latitude is 111,170 m long and taken for 111,319 m: 0.13 % more.
    def took(stages: tuple[Stage, ...]) -> float:
        return took_s(fly_ardupilot(stages, DEFAULTS, home_latitude_deg=47.0), 1)

    north = took((takeoff(), go(0.0, 10_000.0)))
    east = took((takeoff(), go(10_000.0)))
    assert north - leg_s(10_000.0) == pytest.approx(1000.0 * 0.00134, abs=0.02)
    assert east - leg_s(10_000.0) == pytest.approx(-1000.0 * 0.0018, abs=0.02)


# Stops.


@pytest.mark.parametrize(
    ("speed", "recorded"),
    [(3.0, 4.0), (5.0, 8.7), (8.0, 17.5), (10.0, 25.0), (12.0, 35.0), (15.0, 51.0)],
)
def test_stops_are_as_long_as_recorded(speed: float, recorded: float) -> None:
    assert stopping_distance_m(np.array([speed]), DEFAULTS)[0] == pytest.approx(
        recorded, abs=max(0.5, 0.05 * recorded)
    )


def test_standing_still_needs_no_way() -> None:
    assert stopping_distance_m(np.array([0.0]), DEFAULTS)[0] == 0.0


def test_cruise_and_brake_know_their_stop() -> None:
    motion = fly(takeoff(), go(500.0), go(500.0, 500.0, hold=1.0), home())
    stop = float(stopping_distance_m(np.array([10.0]), DEFAULTS)[0])
    for state, way in zip(states(motion), motion.segments.stopping_distance_m, strict=True):
        if state in {"cruise", "brake"}:
            assert way == pytest.approx(stop)
        else:
            assert math.isnan(way)


@given(
    speed=st.floats(0.5, 20.0),
    acceleration=st.floats(0.5, 6.0),
    jerk=st.floats(0.5, 10.0),
)
@settings(max_examples=60, deadline=None)
def test_stops_grow_with_speed_and_shrink_with_acceleration(
    speed: float, acceleration: float, jerk: float
) -> None:
    some = ArduPilotParameters(acceleration_m_s2=acceleration, jerk_m_s3=jerk)
    more = ArduPilotParameters(acceleration_m_s2=1.2 * acceleration, jerk_m_s3=jerk)
    slow, fast = stopping_distance_m(np.array([speed, 1.1 * speed]), some)
    assert 0.0 < slow < fast
    assert stopping_distance_m(np.array([speed]), more)[0] <= slow + 1e-9
    assert slow > 0.5 * speed**2 / acceleration * 0.97**2
