"""ArduPilot's flights against pencil, paper and recorded figures; one test per parameter."""

from __future__ import annotations

import math

import pytest
from ardupilot_missions import DEFAULTS, fly, go, home, land, stage, states, takeoff, time_s, took_s
from ardupilot_times import RISE_S, START_S, STEP_S, VERTICAL_START_S, landing_s, leg_s

from planner.flight.motion.ardupilot.pilot import fly_ardupilot
from planner.mission.route.stage import Stage, StageKind
from planner.values import replace
from planner.vehicle.parameters.ardupilot import ArduPilotParameters


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


LATE_S = 0.06
"""What corners so wide cost by the lag of the lean, at most. [s]"""


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
        assert took_s(motion, 2) == pytest.approx(leg_s(500.0) - START_S - 2 * half, abs=LATE_S)
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
    assert took_s(motion, 2) == pytest.approx(leg_s(500.0) - START_S - 2 * half, abs=LATE_S)


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


@pytest.mark.parametrize(("early_s", "is_begun"), [(4.5, False), (4.3, True), (0.5, True)])
def test_a_speed_that_comes_as_a_leg_brakes_counts_from_where_the_next_has_got(
    early_s: float, *, is_begun: bool
) -> None:
    # The next leg begins twice 2.04 + 0.15 s before this one ends: 4.38 s.
    first = replace(stage(StageKind.GO, 500.0), next_early_s=early_s)
    motion = fly(takeoff(), first, stage(StageKind.GO, 500.0, 500.0, speed=4.0, hold=1.0))
    a = -0.15 + (0.15**2 + 4.0) ** 0.5
    anew_s = 500.0 / 4.0 + 2 * (a + 0.3) - corner_half_s()
    assert (took_s(motion, 2) - 1.0 < anew_s - 1.0) is is_begun
    if not is_begun:
        assert took_s(motion, 2) - 1.0 == pytest.approx(anew_s, abs=0.05)


def test_a_waypoint_before_a_landing_whose_leg_is_divided_is_stopped_at_and_the_leg_is_one() -> (
    None
):
    part = replace(stage(StageKind.GO, 100.0, 300.0), is_underway=True)
    whole = fly(takeoff(), go(100.0), land(100.0, 500.0))
    divided = fly(takeoff(), go(100.0), part, land(100.0, 500.0))
    assert time_s(divided) == pytest.approx(time_s(whole), abs=1e-3)


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
    ("changed", "added_s", "flown_s"),
    [
        # Flown by ArduCopter 4.7-dev: longer by so much than by default.
        ({"spool_down_s": 2.0}, 1.5, 1.5),
        ({"spool_down_s": 5.0}, 4.5, 4.5),
        ({"safe_time_s": 5.0}, 0.0, 0.0),
        ({"safe_time_s": 5.0, "safe_disarm": 1}, 3.0, 2.9),
        ({"safe_time_s": 8.0, "safe_disarm": 1}, 6.0, 5.9),
    ],
)
def test_motors_that_stand_still_late_or_are_held_back_count(
    changed: dict[str, float], added_s: float, flown_s: float
) -> None:
    parameters = replace(ArduPilotParameters(), **changed)
    added = time_s(fly(takeoff(), home(), parameters=parameters)) - time_s(fly(takeoff(), home()))
    assert added == pytest.approx(added_s, abs=1e-9)
    assert added == pytest.approx(flown_s, abs=0.15)


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


@pytest.mark.parametrize("up_m", [0.0, 40.0, 60.0])
def test_a_landing_below_a_home_in_the_air_is_slow_from_land_alt_low_above_that(
    up_m: float,
) -> None:
    # Mode::get_alt_above_ground_cm: above home; set there 60 m up, 167 s were flown, not 102 s.
    motion = fly(takeoff(100.0), replace(land(), datum_m=up_m))
    assert took_s(motion, 1) == pytest.approx(
        STEP_S + landing_s(100.0, low=10.0 + up_m) + 2.1, abs=1e-6
    )


def test_a_landing_elsewhere_is_flown_to_level_first() -> None:
    motion = fly(takeoff(), land(500.0))
    assert took_s(motion, 1) == pytest.approx(leg_s(500.0) + landing_s(50.0) + 2.1, abs=1e-6)
    assert states(motion)[1:] == ["accelerate", "cruise", "brake", "land"]


# Changes of height and loads.


def test_a_change_of_height_ends_with_the_square_root_controller() -> None:
    motion = fly(takeoff(), stage(StageKind.CHANGE_HEIGHT, height_m=100.0))
    # Up by 2.5: 2.5 s and 3.125 m to speed up; 1.5 s and 2.625 m to slow down to 1, the last metre
    # exponentially to 5 cm.
    expected = 2.5 + (50.0 - 3.125 - 3.625) / 2.5 + 1.5 + math.log(20.0)
    assert took_s(motion, 1) == pytest.approx(expected, abs=1e-6)


def set_down(east_m: float, above_ground_m: float) -> Stage:
    return replace(stage(StageKind.SET_DOWN, east_m), above_ground_m=above_ground_m)


def test_a_load_is_set_down_and_left_behind() -> None:
    motion = fly(takeoff(20.0), set_down(500.0, 20.0))
    assert states(motion)[-3:] == ["descend", "hover", "climb"]
    # 0.5 m/s after half a second of speeding up, 0.125 m.
    assert motion.segments.duration_s[-3] == pytest.approx(0.5 + 19.875 / 0.5)
    assert motion.segments.duration_s[-2] == pytest.approx(0.5)
    assert motion.segments.climb_m[-3:] == pytest.approx([-20.0, 0.0, 20.0])


def test_pldp_parameters_move_the_setting_down() -> None:
    parameters = ArduPilotParameters(place_descent_speed_m_s=1.0, place_delay_s=3.0)
    motion = fly(takeoff(20.0), set_down(500.0, 20.0), parameters=parameters)
    assert motion.segments.duration_s[-3] == pytest.approx(1.0 + 19.5)
    assert motion.segments.duration_s[-2] == pytest.approx(3.5)


def test_the_autopilot_s_metre_is_not_the_ellipsoid_s() -> None:
    # At 47° a degree of latitude is 111,170 m long and taken for 111,319 m: 0.13 % more.
    def took(stages: tuple[Stage, ...]) -> float:
        return took_s(fly_ardupilot(stages, DEFAULTS, home_latitude_deg=47.0), 1)

    north = took((takeoff(), go(0.0, 10_000.0)))
    east = took((takeoff(), go(10_000.0)))
    assert north - leg_s(10_000.0) == pytest.approx(1000.0 * 0.00134, abs=0.02)
    assert east - leg_s(10_000.0) == pytest.approx(-1000.0 * 0.0018, abs=0.02)
