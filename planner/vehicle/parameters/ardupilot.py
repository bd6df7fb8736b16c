"""The parameters ArduPilot's Copter flies missions with.

Version 4.7 renamed and rescaled most of them, from centimetres to metres (ArduPilot #31970,
#32147, #32184 and its page of parameter name changes).  Defaults are those of Copter 4.6 and 4.7.
"""

from __future__ import annotations

from dataclasses import field
from typing import TYPE_CHECKING, Any

from planner.frozen import frozen
from planner.vehicle.parameters.table import parameter, parameter_table

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.vehicle.parameters.table import Origin


_FASTEST_M_S = 50.0
"""Faster than any multicopter that flies missions: beyond it a unit was mistaken. [m/s]"""
_SLOWEST_M_S = 0.1
"""Slowest speed ArduPilot documents for a mission: below it a unit was mistaken. [m/s]"""
_SPEED = {"at_least": _SLOWEST_M_S, "at_most": _FASTEST_M_S}
_SI_NAMES = (4, 7)
"""The version that renamed parameters and counts in metres."""


def _renamed(
    now: tuple[str, str],
    formerly: tuple[str, str],
    default: float,
    meaning: str,
    **limits: Any,  # noqa: ANN401 - those of `parameter`
) -> Any:  # noqa: ANN401 - as `parameter`
    """Make a field for a parameter of another name and unit before 4.7."""
    return parameter(*now, default, meaning, since=_SI_NAMES, formerly=formerly, **limits)


@frozen
class ArduPilotParameters:
    """Copter's parameters in SI; without arguments its defaults.

    Where a 0 stands for another parameter, the value that flies is filled in.
    """

    cruise_speed_m_s: float = _renamed(
        ("WP_SPD", "m/s"),
        ("WPNAV_SPEED", "cm/s"),
        10.0,
        "speed of missions; 5 m/s before 4.1",
        **_SPEED,
    )
    climb_speed_m_s: float = _renamed(
        ("WP_SPD_UP", "m/s"), ("WPNAV_SPEED_UP", "cm/s"), 2.5, "climb rate of missions", **_SPEED
    )
    descent_speed_m_s: float = _renamed(
        ("WP_SPD_DN", "m/s"), ("WPNAV_SPEED_DN", "cm/s"), 1.5, "descent rate of missions", **_SPEED
    )
    acceleration_m_s2: float = _renamed(
        ("WP_ACC", "m/s²"),
        ("WPNAV_ACCEL", "cm/s²"),
        2.5,
        "horizontal acceleration of missions",
        at_least=0.1,
        at_most=50.0,
    )
    corner_acceleration_m_s2: float = _renamed(
        ("WP_ACC_CNR", "m/s²"),
        ("WPNAV_ACCEL_C", "cm/s²"),
        0.0,
        "acceleration in corners; 0: twice WP_ACC",
        at_least=0.0,
        at_most=50.0,
        zero_means=("acceleration_m_s2", 2.0),
    )
    vertical_acceleration_m_s2: float = _renamed(
        ("WP_ACC_Z", "m/s²"),
        ("WPNAV_ACCEL_Z", "cm/s²"),
        1.0,
        "vertical acceleration of missions",
        at_least=0.1,
        at_most=50.0,
    )
    jerk_m_s3: float = _renamed(
        ("WP_JERK", "m/s³"),
        ("WPNAV_JERK", "m/s³"),
        1.0,
        "jerk of missions",
        above=0.0,
        at_most=500.0,
    )
    waypoint_radius_m: float = _renamed(
        ("WP_RADIUS_M", "m"),
        ("WPNAV_RADIUS", "cm"),
        2.0,
        "radius in which a waypoint counts as reached",
        at_least=0.05,
        at_most=100.0,
    )
    uses_range_finder: int = _renamed(
        ("WP_RFND_USE", ""),
        ("WPNAV_RFND_USE", ""),
        1,
        "whether terrain is followed by range finder",
        at_least=0.0,
    )
    terrain_margin_m: float = _renamed(
        ("WP_TER_MARGIN", "m"),
        ("WPNAV_TER_MARGIN", "m"),
        10.0,
        "error over terrain at which the vehicle waits",
        at_least=0.0,
    )
    yaw_behavior: int = parameter("WP_YAW_BEHAVIOR", "", 2, "heading along the way", at_least=0.0)
    yaw_rate_rad_s: float = _renamed(
        ("ATC_RATE_WPY_MAX", "deg/s"),
        ("ATC_SLEW_YAW", "cdeg/s"),
        60.0,
        "yaw rate of missions",
        above=0.0,
        at_most=20.0,
    )
    lean_angle_max_rad: float = _renamed(
        ("ATC_ANGLE_MAX", "deg"),
        ("ANGLE_MAX", "cdeg"),
        30.0,
        "greatest lean angle",
        at_least=0.1,
        at_most=1.5,
    )
    attitude_time_constant_s: float = parameter(
        "ATC_INPUT_TC",
        "s",
        0.15,
        "time constant of the attitude; jerk rises within twice of it",
        at_least=0.0,
        at_most=1.0,
    )
    circle_radius_m: float = _renamed(
        ("CIRCLE_RADIUS_M", "m"),
        ("CIRCLE_RADIUS", "cm"),
        10.0,
        "radius of circles without one of their own",
        at_least=0.0,
    )
    circle_rate_rad_s: float = parameter(
        "CIRCLE_RATE", "deg/s", 20.0, "greatest turn rate of circles; negative: counter-clockwise"
    )

    land_speed_m_s: float = _renamed(
        ("LAND_SPD_MS", "m/s"),
        ("LAND_SPEED", "cm/s"),
        0.5,
        "descent rate below LAND_ALT_LOW_M",
        at_least=_SLOWEST_M_S,
        at_most=10.0,
    )
    land_high_speed_m_s: float = _renamed(
        ("LAND_SPD_HIGH_MS", "m/s"),
        ("LAND_SPEED_HIGH", "cm/s"),
        0.0,
        "descent rate of a landing above it; 0: WP_SPD_DN",
        at_least=0.0,
        at_most=_FASTEST_M_S,
        zero_means=("descent_speed_m_s", 1.0),
    )
    land_slow_height_m: float = _renamed(
        ("LAND_ALT_LOW_M", "m"),
        ("LAND_ALT_LOW", "cm"),
        10.0,
        "height below which a landing is slow",
        at_least=0.0,
        at_most=1000.0,
    )
    return_altitude_m: float = _renamed(
        ("RTL_ALT_M", "m"),
        ("RTL_ALT", "cm"),
        15.0,
        "height over home of the way back; 0: as it is",
        at_least=0.0,
        at_most=3000.0,
    )
    return_final_altitude_m: float = _renamed(
        ("RTL_ALT_FINAL_M", "m"),
        ("RTL_ALT_FINAL", "cm"),
        0.0,
        "height at which a return ends; 0: landed",
        at_least=0.0,
        at_most=1000.0,
    )
    return_climb_min_m: float = _renamed(
        ("RTL_CLIMB_MIN_M", "m"),
        ("RTL_CLIMB_MIN", "cm"),
        0.0,
        "least climb of a return",
        at_least=0.0,
        at_most=1000.0,
    )
    return_speed_m_s: float = _renamed(
        ("RTL_SPEED_MS", "m/s"),
        ("RTL_SPEED", "cm/s"),
        0.0,
        "speed of a return; 0: WP_SPD",
        at_least=0.0,
        at_most=_FASTEST_M_S,
        zero_means=("cruise_speed_m_s", 1.0),
    )
    return_loiter_s: float = parameter(
        "RTL_LOIT_TIME", "ms", 5000.0, "wait over home before landing", at_least=0.0
    )
    return_cone_slope: float = parameter(
        "RTL_CONE_SLOPE", "", 3.0, "height over distance of the cone over home", at_least=0.0
    )
    return_altitude_type: int = parameter(
        "RTL_ALT_TYPE", "", 0, "0: over home, 1: over terrain", at_least=0.0
    )

    rally_limit_m: float = parameter(
        "RALLY_LIMIT_KM",
        "km",
        0.3,
        "distance within which a rally point is taken though home is nearer; 0: no limit",
        at_least=0.0,
    )
    rally_includes_home: int = parameter(
        "RALLY_INCL_HOME", "", 1, "1: home counts among the rally points", at_least=0.0
    )

    spool_up_s: float = parameter(
        "MOT_SPOOL_TIME", "s", 0.5, "time for motors to spool up", at_least=0.0
    )
    hover_throttle: float = parameter(
        "MOT_THST_HOVER", "", 0.35, "throttle at which it hovers", above=0.0, at_most=1.0
    )
    takeoff_slew_s: float = parameter(
        "TKOFF_SLEW_TIME", "s", 2.0, "time over which thrust builds up", at_least=0.0
    )
    disarm_delay_s: float = parameter(
        "DISARM_DELAY", "s", 10.0, "time from landed to disarmed outside missions", at_least=0.0
    )
    place_descent_speed_m_s: float = parameter(
        "PLDP_SPEED_DN",
        "m/s",
        0.0,
        "descent rate of payload placing; 0: LAND_SPD_MS",
        at_least=0.0,
        at_most=10.0,
        zero_means=("land_speed_m_s", 1.0),
    )
    place_delay_s: float = parameter(
        "PLDP_DELAY", "s", 0.0, "wait after payload placing", at_least=0.0
    )
    mission_options: int = parameter("MIS_OPTIONS", "", 0, "bits: 4 lands and goes on")
    mission_items_required: int = parameter(
        "ARMING_MIS_ITEMS", "", 0, "bits: what a mission must contain to arm"
    )

    pilot_climb_speed_m_s: float = _renamed(
        ("PILOT_SPD_UP", "m/s"),
        ("PILOT_SPEED_UP", "cm/s"),
        2.5,
        "climb rate under the pilot",
        above=0.0,
        at_most=_FASTEST_M_S,
    )
    pilot_descent_speed_m_s: float = _renamed(
        ("PILOT_SPD_DN", "m/s"),
        ("PILOT_SPEED_DN", "cm/s"),
        0.0,
        "descent rate under the pilot; 0: PILOT_SPD_UP",
        at_least=0.0,
        at_most=_FASTEST_M_S,
        zero_means=("pilot_climb_speed_m_s", 1.0),
    )
    pilot_vertical_acceleration_m_s2: float = _renamed(
        ("PILOT_ACC_Z", "m/s²"),
        ("PILOT_ACCEL_Z", "cm/s²"),
        2.5,
        "vertical acceleration under the pilot",
        above=0.0,
        at_most=50.0,
    )
    pilot_takeoff_altitude_m: float = _renamed(
        ("PILOT_TKO_ALT_M", "m"),
        ("PILOT_TKOFF_ALT", "cm"),
        0.0,
        "height of a take-off under the pilot",
        at_least=0.0,
    )
    loiter_speed_m_s: float = _renamed(
        ("LOIT_SPEED_MS", "m/s"),
        ("LOIT_SPEED", "cm/s"),
        12.5,
        "greatest speed in loiter",
        above=0.0,
        at_most=_FASTEST_M_S,
    )
    loiter_acceleration_m_s2: float = _renamed(
        ("LOIT_ACC_MAX_M", "m/s²"),
        ("LOIT_ACC_MAX", "cm/s²"),
        5.0,
        "greatest acceleration in loiter",
        above=0.0,
        at_most=50.0,
    )
    loiter_brake_acceleration_m_s2: float = _renamed(
        ("LOIT_BRK_ACC_M", "m/s²"),
        ("LOIT_BRK_ACCEL", "cm/s²"),
        2.5,
        "braking in loiter",
        above=0.0,
        at_most=50.0,
    )
    loiter_brake_jerk_m_s3: float = _renamed(
        ("LOIT_BRK_JRK_M", "m/s³"),
        ("LOIT_BRK_JERK", "cm/s³"),
        5.0,
        "jerk of braking in loiter",
        above=0.0,
        at_most=500.0,
    )

    battery_capacity_ah: float = parameter(
        "BATT_CAPACITY", "mAh", 3300.0, "charge of the battery; 0: not known", at_least=0.0
    )
    battery_low_v: float = parameter(
        "BATT_LOW_VOLT", "V", 10.5, "voltage that is low; 0: not watched", at_least=0.0
    )
    battery_low_timer_s: float = parameter(
        "BATT_LOW_TIMER", "s", 10.0, "time a voltage must be low; 0: not watched", at_least=0.0
    )
    battery_low_ah: float = parameter(
        "BATT_LOW_MAH", "mAh", 0.0, "charge left that is low; 0: not watched", at_least=0.0
    )
    battery_critical_v: float = parameter(
        "BATT_CRT_VOLT", "V", 0.0, "voltage that is critical; 0: not watched", at_least=0.0
    )
    battery_critical_ah: float = parameter(
        "BATT_CRT_MAH", "mAh", 0.0, "charge left that is critical; 0: not watched", at_least=0.0
    )
    battery_low_action: int = parameter(
        "BATT_FS_LOW_ACT", "", 0, "0 none, 1 land, 2 return, …", at_least=0.0
    )
    battery_critical_action: int = parameter(
        "BATT_FS_CRT_ACT", "", 0, "0 none, 1 land, 2 return, …", at_least=0.0
    )
    battery_voltage_source: int = parameter(
        "BATT_FS_VOLTSRC", "", 0, "0 as measured, 1 compensated for sag", at_least=0.0
    )
    arm_battery_min_v: float = parameter(
        "BATT_ARM_VOLT", "V", 0.0, "voltage to arm with; 0: not watched", at_least=0.0
    )
    arm_battery_min_ah: float = parameter(
        "BATT_ARM_MAH", "mAh", 0.0, "charge left to arm with; 0: not watched", at_least=0.0
    )

    fence_enable: int = parameter("FENCE_ENABLE", "", 0, "whether the fence is on", at_least=0.0)
    fence_auto_enable: int = parameter(
        "FENCE_AUTOENABLE", "", 0, "whether the fence comes on by itself", at_least=0.0
    )
    fence_type: int = parameter(
        "FENCE_TYPE", "", 7, "bits: 1 ceiling, 2 circle, 4 polygons, 8 floor", at_least=0.0
    )
    fence_action: int = parameter("FENCE_ACTION", "", 1, "what a breach leads to", at_least=0.0)
    fence_options: int = parameter(
        "FENCE_OPTIONS", "", 0, "bits: 2 one inclusion area is enough", at_least=0.0
    )
    fence_height_max_m: float = parameter(
        "FENCE_ALT_MAX", "m", 100.0, "ceiling over home", at_least=0.0
    )
    fence_height_min_m: float = parameter("FENCE_ALT_MIN", "m", -10.0, "floor over home")
    fence_radius_m: float = parameter(
        "FENCE_RADIUS", "m", 150.0, "radius of the circle around home", above=0.0
    )
    fence_margin_m: float = parameter(
        "FENCE_MARGIN", "m", 2.0, "distance kept from the fence", at_least=0.0
    )

    origins: Mapping[str, Origin] = field(default_factory=dict, hash=False, compare=False)
    """Where the value of each quantity comes from; a quantity not in it has its default."""

    def __post_init__(self) -> None:
        for quantity, row in parameter_table(ArduPilotParameters).items():
            if row.zero_means is not None and getattr(self, quantity) == 0.0:
                other, factor = row.zero_means
                object.__setattr__(self, quantity, factor * getattr(self, other))
