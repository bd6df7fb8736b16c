"""The tables of parameters against what the firmwares' own sources say."""

from __future__ import annotations

import math
import re
from pathlib import Path

import pytest

import planner.vehicle
from planner.autopilot import Autopilot
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import parameters_from_text
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.resolve import PARAMETERS_OF, FlightParameters, resolve_parameters
from planner.vehicle.parameters.table import parameter_table

ROOM = Path(planner.vehicle.__file__).parent

RENAMED_IN_4_7 = [
    # ArduPilot #31562, #31970, #32147, #32184, and its page "Parameter Name Changes"
    ("WPNAV_SPEED", 500, "WP_SPD", 5, "cruise_speed_m_s", 5.0),
    ("WPNAV_SPEED_UP", 300, "WP_SPD_UP", 3, "climb_speed_m_s", 3.0),
    ("WPNAV_SPEED_DN", 120, "WP_SPD_DN", 1.2, "descent_speed_m_s", 1.2),
    ("WPNAV_ACCEL", 100, "WP_ACC", 1, "acceleration_m_s2", 1.0),
    ("WPNAV_ACCEL_C", 400, "WP_ACC_CNR", 4, "corner_acceleration_m_s2", 4.0),
    ("WPNAV_ACCEL_Z", 80, "WP_ACC_Z", 0.8, "vertical_acceleration_m_s2", 0.8),
    ("WPNAV_RADIUS", 500, "WP_RADIUS_M", 5, "waypoint_radius_m", 5.0),
    ("WPNAV_JERK", 3, "WP_JERK", 3, "jerk_m_s3", 3.0),
    ("WPNAV_TER_MARGIN", 5, "WP_TER_MARGIN", 5, "terrain_margin_m", 5.0),
    ("ATC_SLEW_YAW", 9000, "ATC_RATE_WPY_MAX", 90, "yaw_rate_rad_s", math.pi / 2),
    ("ANGLE_MAX", 4500, "ATC_ANGLE_MAX", 45, "attitude_lean_max_rad", math.pi / 4),
    ("ATC_ACCEL_R_MAX", 18000, "ATC_ACC_R_MAX", 180, "attitude_roll_acceleration_rad_s2", math.pi),
    (
        "ATC_ACCEL_P_MAX",
        9000,
        "ATC_ACC_P_MAX",
        90,
        "attitude_pitch_acceleration_rad_s2",
        math.pi / 2,
    ),
    ("CIRCLE_RADIUS", 2000, "CIRCLE_RADIUS_M", 20, "circle_radius_m", 20.0),
    ("LAND_SPEED", 30, "LAND_SPD_MS", 0.3, "land_speed_m_s", 0.3),
    ("LAND_SPEED_HIGH", 200, "LAND_SPD_HIGH_MS", 2, "land_high_speed_m_s", 2.0),
    ("LAND_ALT_LOW", 500, "LAND_ALT_LOW_M", 5, "land_slow_height_m", 5.0),
    ("RTL_ALT", 3000, "RTL_ALT_M", 30, "return_altitude_m", 30.0),
    ("RTL_ALT_FINAL", 200, "RTL_ALT_FINAL_M", 2, "return_final_altitude_m", 2.0),
    ("RTL_CLIMB_MIN", 500, "RTL_CLIMB_MIN_M", 5, "return_climb_min_m", 5.0),
    ("RTL_SPEED", 700, "RTL_SPEED_MS", 7, "return_speed_m_s", 7.0),
]

PX4_DEFAULTS = {
    # mc_pos_control, navigator and commander parameters of 2026-03, rc.mc_defaults for multicopters
    "cruise_speed_m_s": 5.0,
    "speed_max_m_s": 12.0,
    "climb_speed_m_s": 3.0,
    "descent_speed_m_s": 1.5,
    "climb_speed_max_m_s": 3.0,
    "descent_speed_max_m_s": 1.5,
    "acceleration_m_s2": 3.0,
    "acceleration_up_m_s2": 4.0,
    "acceleration_down_m_s2": 3.0,
    "jerk_m_s3": 4.0,
    "trajectory_gain_per_s": 0.5,
    "position_error_max_m": 2.0,
    "takeoff_speed_m_s": 1.5,
    "takeoff_ramp_s": 3.0,
    "spool_up_s": 1.0,
    "land_speed_m_s": 0.7,
    "land_slow_height_m": 10.0,
    "land_slowest_height_m": 5.0,
    "land_crawl_height_m": 1.0,
    "land_crawl_speed_m_s": 0.3,
    "acceptance_radius_m": 2.0,  # 10 m in general, 2 m on multicopters
    "altitude_acceptance_m": 0.8,
    "return_altitude_m": 30.0,  # 60 m in general, 30 m on multicopters
    "return_descend_altitude_m": 10.0,  # 30 m in general, 10 m on multicopters
    "return_land_delay_s": 0.0,
    "return_min_distance_m": 10.0,
    "return_cone_angle_rad": math.pi / 4,
    "return_type": 0,
    "return_time_factor": 1.1,
    "return_time_margin_s": 100.0,
    "disarm_delay_s": 2.0,
    "yaw_mode": 0,
    "yaw_rate_rad_s": math.pi / 3,
    "yaw_acceleration_rad_s2": math.pi / 9,
    "yaw_acceptance_rad": math.pi / 15,
    "battery_capacity_ah": -0.001,
    "battery_mean_current_a": 15.0,
    "battery_empty_cell_v": 3.6,
    "battery_full_cell_v": 4.05,
    "battery_low_fraction": 0.15,
    "battery_critical_fraction": 0.07,
    "battery_emergency_fraction": 0.05,
    "battery_action": 0,
    "return_time_action": 0,
}

ARDUPILOT_DEFAULTS = {
    # AC_WPNav.cpp, ArduCopter/Parameters.cpp, config.h and AP_BattMonitor_Params.cpp of 2025-12
    "cruise_speed_m_s": 10.0,
    "climb_speed_m_s": 2.5,
    "descent_speed_m_s": 1.5,
    "acceleration_m_s2": 2.5,
    "corner_acceleration_m_s2": 5.0,  # 0 stands for twice the acceleration
    "vertical_acceleration_m_s2": 1.0,
    "waypoint_radius_m": 2.0,
    "jerk_m_s3": 1.0,
    "land_speed_m_s": 0.5,
    "land_high_speed_m_s": 1.5,  # 0 stands for the descent speed
    "land_slow_height_m": 10.0,
    "return_altitude_m": 15.0,
    "return_final_altitude_m": 0.0,
    "return_climb_min_m": 0.0,
    "return_speed_m_s": 10.0,  # 0 stands for the cruise speed
    "return_loiter_s": 5.0,
    "return_cone_slope": 3.0,
    "return_altitude_type": 0,
    "attitude_lean_max_rad": math.pi / 6,
    "lean_angle_max_rad": math.pi / 6,  # 0 stands for that of the attitude
    "circle_radius_m": 10.0,
    "circle_rate_rad_s": math.pi / 9,
    "yaw_rate_rad_s": math.pi / 3,
    "spool_up_s": 0.5,
    "spool_down_s": 0.5,  # 0 stands for that
    "safe_time_s": 1.0,
    "safe_disarm": 0,
    "takeoff_slew_s": 2.0,
    "terrain_margin_m": 10.0,
    "battery_capacity_ah": 3.3,
    "battery_low_v": 10.5,
    "battery_low_timer_s": 10.0,
    "battery_low_ah": 0.0,
    "battery_critical_v": 0.0,
    "battery_critical_ah": 0.0,
    "battery_low_action": 0,
    "battery_critical_action": 0,
    "battery_voltage_source": 0,
}


def flown(text: str, autopilot: Autopilot) -> FlightParameters:
    file = parameters_from_text(text.encode(), source="vehicle.param")
    return resolve_parameters(autopilot, file=file).values


@pytest.mark.parametrize(
    ("old", "old_value", "new", "new_value", "quantity", "si"),
    RENAMED_IN_4_7,
    ids=[row[0] for row in RENAMED_IN_4_7],
)
def test_the_old_and_the_new_name_mean_the_same_quantity(
    old: str, old_value: float, new: str, new_value: float, quantity: str, si: float
) -> None:
    before = flown(f"{old},{old_value}\n", Autopilot.ARDUPILOT)
    after = flown(f"{new},{new_value}\n", Autopilot.ARDUPILOT)
    assert getattr(before, quantity) == pytest.approx(si, rel=1e-12)
    assert getattr(after, quantity) == pytest.approx(si, rel=1e-12)
    assert before.origins[quantity].name == old
    assert after.origins[quantity].name == new


def test_every_rename_of_the_table_is_tested() -> None:
    renamed = {
        (row.formerly.name, row.now.name)
        for row in parameter_table(ArduPilotParameters).values()
        if row.formerly is not None
    }
    assert renamed == {(row[0], row[2]) for row in RENAMED_IN_4_7} | {
        (old, new) for old, new, _ in RENAMED_BEFORE_4
    }


RENAMED_BEFORE_4 = [
    # Copter's conversion_table of 3.6, and BATT_ARM_VOLT of 4.0: no unit changed.
    ("FS_BATT_ENABLE", "BATT_FS_LOW_ACT", "battery_low_action"),
    ("FS_BATT_VOLTAGE", "BATT_LOW_VOLT", "battery_low_v"),
    ("FS_BATT_MAH", "BATT_LOW_MAH", "battery_low_ah"),
    ("ARMING_VOLT_MIN", "BATT_ARM_VOLT", "arm_battery_min_v"),
]
RENAMED_IN_1_11 = [
    # Battery::migrateParam
    ("BAT_SOURCE", "BAT1_SOURCE", "battery_source"),
    ("BAT_CAPACITY", "BAT1_CAPACITY", "battery_capacity_ah"),
    ("BAT_N_CELLS", "BAT1_N_CELLS", "battery_cells"),
    ("BAT_V_EMPTY", "BAT1_V_EMPTY", "battery_empty_cell_v"),
    ("BAT_V_CHARGED", "BAT1_V_CHARGED", "battery_full_cell_v"),
    ("BAT_R_INTERNAL", "BAT1_R_INTERNAL", "battery_cell_resistance_ohm"),
]


@pytest.mark.parametrize(
    ("autopilot", "old", "new", "quantity"),
    [
        *((Autopilot.ARDUPILOT, *row) for row in RENAMED_BEFORE_4),
        *((Autopilot.PX4, *row) for row in RENAMED_IN_1_11),
    ],
)
def test_the_battery_of_an_older_firmware_is_read_as_its_successor_reads_it(
    autopilot: Autopilot, old: str, new: str, quantity: str
) -> None:
    before, after = (flown(f"{name},2\n", autopilot) for name in (old, new))
    assert getattr(before, quantity) == getattr(after, quantity)
    assert before.origins[quantity].name == old


def test_the_older_name_of_px4_s_required_items_is_known() -> None:
    parameters = flown("MIS_TAKEOFF_REQ,1\nMPC_XY_CRUISE,5\n", Autopilot.PX4)
    assert isinstance(parameters, Px4Parameters)
    assert parameters.takeoff_land_required == 1


@pytest.mark.parametrize(("quantity", "default"), PX4_DEFAULTS.items())
def test_px4_defaults_are_those_of_a_multicopter(quantity: str, default: float) -> None:
    assert getattr(Px4Parameters(), quantity) == pytest.approx(default, rel=1e-12)


@pytest.mark.parametrize(("quantity", "default"), ARDUPILOT_DEFAULTS.items())
def test_ardupilot_defaults_are_those_of_copter(quantity: str, default: float) -> None:
    assert getattr(ArduPilotParameters(), quantity) == pytest.approx(default, rel=1e-12)


@pytest.mark.parametrize("parameters", [Px4Parameters, ArduPilotParameters])
def test_every_row_is_sound(parameters: type[FlightParameters]) -> None:
    table = parameter_table(parameters)
    names = [spelling.name for row in table.values() for spelling in row.spellings]
    assert len(set(names)) == len(names)
    assert all(len(name) <= 16 for name in names), "MAVLink has 16 characters for a name"
    for quantity, row in table.items():
        assert row.is_possible(row.now.si(row.default)), quantity
        if row.zero_means is not None:
            assert row.zero_means[0] in table
            assert row.is_possible(0.0)


def test_the_two_autopilots_share_no_name() -> None:
    px4, ardupilot = (
        {spelling.name for row in parameter_table(stack).values() for spelling in row.spellings}
        for stack in (Px4Parameters, ArduPilotParameters)
    )
    assert not px4 & ardupilot


def test_a_zero_stands_for_another_parameter_of_the_same_vehicle() -> None:
    parameters = ArduPilotParameters(
        acceleration_m_s2=1.0, descent_speed_m_s=2.0, cruise_speed_m_s=6.0
    )
    assert parameters.corner_acceleration_m_s2 == 2.0
    assert parameters.land_high_speed_m_s == 2.0
    assert parameters.return_speed_m_s == 6.0


# A lean of 10° accelerates by g tan 10° = 1.7292 m/s²; one of 30° by 5.66, more than the 5.0 of corners.
@pytest.mark.parametrize(
    ("text", "lean_deg", "straight_m_s2", "corner_m_s2"),
    [
        ("PSC_ANGLE_MAX,10\n", 10.0, 1.72918, 1.72918),
        ("ANGLE_MAX,1000\n", 10.0, 1.72918, 1.72918),
        ("ANGLE_MAX,1000\nPSC_ANGLE_MAX,30\n", 30.0, 2.5, 5.0),
        ("PSC_ANGLE_MAX,20\n", 20.0, 2.5, 3.56933),
        ("PSC_ANGLE_MAX,10\nWPNAV_ACCEL,100\n", 10.0, 1.0, 1.72918),
    ],
)
def test_ardupilot_accelerates_no_more_than_its_position_controller_leans(
    text: str, lean_deg: float, straight_m_s2: float, corner_m_s2: float
) -> None:
    values = flown(text, Autopilot.ARDUPILOT)
    assert isinstance(values, ArduPilotParameters)
    assert math.degrees(values.lean_angle_max_rad) == pytest.approx(lean_deg)
    assert values.acceleration_m_s2 == pytest.approx(straight_m_s2, rel=1e-5)
    assert values.corner_acceleration_m_s2 == pytest.approx(corner_m_s2, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "jerk_m_s3"),
    [
        # the lesser of both times g: 3°/s are 0.5135 m/s³; none where one is 0
        ("ATC_RATE_R_MAX,3\nATC_RATE_P_MAX,4\n", 0.513475),
        ("ATC_RATE_R_MAX,4\nATC_RATE_P_MAX,3\n", 0.513475),
        ("ATC_RATE_R_MAX,0\nATC_RATE_P_MAX,3\n", 1.0),
        ("ATC_RATE_R_MAX,90\nATC_RATE_P_MAX,90\n", 1.0),
        ("ATC_RATE_R_MAX,10\nATC_RATE_P_MAX,10\nWPNAV_JERK,10\n", 1.711584),
    ],
)
def test_rates_of_the_attitude_limit_the_jerk_of_ardupilots_legs(
    text: str, jerk_m_s3: float
) -> None:
    """``AC_WPNav::calc_scurve_jerk_and_snap``."""
    values = flown(text, Autopilot.ARDUPILOT)
    assert isinstance(values, ArduPilotParameters)
    assert values.jerk_m_s3 == pytest.approx(jerk_m_s3, rel=1e-5)


@pytest.mark.parametrize(
    ("text", "rise_s"),
    [
        # π J over the lesser of both times g, where that is longer than 2 · 0.15 s: 0.3203 s for 1 rad/s²
        ("ATC_ACCEL_R_MAX,5729.578\nATC_ACCEL_P_MAX,20000\n", 0.3203),
        ("ATC_ACCEL_R_MAX,20000\nATC_ACCEL_P_MAX,5729.578\n", 0.3203),
        ("ATC_ACCEL_R_MAX,20000\nATC_ACCEL_P_MAX,20000\n", 0.3),
        ("ATC_ACCEL_R_MAX,0\nATC_ACCEL_P_MAX,5729.578\n", 0.3),  # none
        ("ATC_ACC_R_MAX,57.29578\nWP_JERK,10\n", 3.2035),
        ("WPNAV_JERK,10\n", 0.3),
        ("ATC_INPUT_TC,0.25\n", 0.5),
        ("ATC_INPUT_TC,0.05\n", 0.2),
    ],
)
def test_angular_accelerations_limit_how_fast_the_jerk_of_ardupilots_legs_rises(
    text: str, rise_s: float
) -> None:
    """``AC_WPNav::calc_scurve_jerk_and_snap``."""
    values = flown(text, Autopilot.ARDUPILOT)
    assert isinstance(values, ArduPilotParameters)
    assert values.jerk_rise_s == pytest.approx(rise_s, rel=1e-3)


def test_px4_speeds_are_overwritten_by_the_common_ones() -> None:
    parameters = Px4Parameters(speed_all_m_s=8.0, climb_speed_all_m_s=2.0)
    assert (parameters.cruise_speed_m_s, parameters.speed_max_m_s) == (8.0, 8.0)
    assert (parameters.climb_speed_m_s, parameters.descent_speed_m_s) == (2.0, 1.5)
    assert parameters.takeoff_speed_m_s == pytest.approx(1.2)
    assert parameters.land_speed_m_s == 1.0


def test_px4_responsiveness_sets_accelerations_and_jerk() -> None:
    # linear in its square: half way in SYS_VEHICLE_RESP is a quarter of the way
    parameters = Px4Parameters(responsiveness=0.5)
    assert parameters.acceleration_m_s2 == pytest.approx(1.0 + 14.0 / 4.0)
    assert parameters.acceleration_down_m_s2 == pytest.approx(0.8 + 14.2 / 4.0)
    assert parameters.jerk_m_s3 == pytest.approx(1.0 + 24.0 / 4.0)


def test_px4_keeps_design_speeds_inside_the_absolute_ones() -> None:
    parameters = Px4Parameters(
        cruise_speed_m_s=15.0,
        speed_max_m_s=10.0,
        descent_speed_max_m_s=0.5,
        climb_speed_max_m_s=1.0,
    )
    assert parameters.cruise_speed_m_s == 10.0
    # The speed of take-offs it limits in a copy of its own (MulticopterPositionControl).
    assert (parameters.climb_speed_m_s, parameters.takeoff_speed_m_s) == (1.0, 1.5)
    assert (parameters.descent_speed_m_s, parameters.land_speed_m_s) == (0.5, 0.5)


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_every_parameter_is_read_by_what_flies_or_judges(autopilot: Autopilot) -> None:
    # A row that nothing reads still refuses values: PILOT_ACC_Z,250 was a no-go once.
    [other] = {"px4", "ardupilot"} - {autopilot.value}
    tables = ROOM / "parameters"
    files = [tables / f"{autopilot.value}.py"] + [  # where one parameter governs another
        path
        for path in ROOM.parent.rglob("*.py")
        if path.parent != tables and other not in str(path.relative_to(ROOM.parent))
    ]
    text = "".join(path.read_text(encoding="utf-8") for path in files)
    for quantity in parameter_table(PARAMETERS_OF[autopilot]):
        assert re.search(rf"""[."']{quantity}\b""", text), f"nothing reads {quantity}"
