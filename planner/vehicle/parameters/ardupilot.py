"""The parameters ArduPilot's Copter flies missions with.

Version 4.7 renamed and rescaled most of them, from centimetres to metres (ArduPilot #31970,
#32147, #32184 and its page of parameter name changes).  Defaults are those of Copter 4.6 and 4.7.
"""

from __future__ import annotations

import math
from typing import Any

from planner.units import GRAVITY_M_S2
from planner.vehicle.declared import NOT_NEGATIVE, POSITIVE, Range
from planner.vehicle.parameters.table import AutopilotParameters, parameter

_FASTEST_M_S = 50.0
"""Faster than any multicopter that flies missions: beyond it a unit was mistaken. [m/s]"""
_SLOWEST_M_S = 0.1
"""Slowest speed ArduPilot documents for a mission: below it a unit was mistaken. [m/s]"""
_SPEED = _ACCELERATION = Range(_SLOWEST_M_S, _FASTEST_M_S)
_SPEED_OR_0 = Range(0.0, _FASTEST_M_S)
_HEIGHT = Range(0.0, 1000.0)
_VOLTAGE_ONLY = 3
"""BATT_MONITOR of an analogue voltage without a current."""
_SI_NAMES = (4, 7)
"""The version that renamed parameters and counts in metres."""


def _renamed(
    now: str,
    formerly: str,
    *row: Any,  # noqa: ANN401 - those of `parameter`
    **more: Any,  # noqa: ANN401
) -> Any:  # noqa: ANN401 - as `parameter`
    """Make the row of a parameter that had another name and unit before 4.7."""
    return parameter(now, *row, formerly=formerly, since=_SI_NAMES, **more)


_BENDY_RULER = 1
"""OA_TYPE of it alone."""
_FAST_WAYPOINTS = 4
"""Bit of OA_OPTIONS (``OA_OPTION_FAST_WAYPOINTS``)."""
_ARMING_DELAY_S = 2.0
"""``ARMING_DELAY_SEC`` of ArduCopter/config.h: the motors stand still for so long after arming. [s]"""
_SHORTEST_RISE_S = 0.2
"""Of the jerk: twice the shortest time constant of the attitude that counts. [s]"""


class ArduPilotParameters(AutopilotParameters, eq=False):
    """Copter's parameters in SI; without arguments its defaults."""

    # speed of missions; 5 m/s before 4.1
    cruise_speed_m_s: float = _renamed("WP_SPD m/s", "WPNAV_SPEED cm/s", 10.0, _SPEED)
    climb_speed_m_s: float = _renamed("WP_SPD_UP m/s", "WPNAV_SPEED_UP cm/s", 2.5, _SPEED)
    descent_speed_m_s: float = _renamed("WP_SPD_DN m/s", "WPNAV_SPEED_DN cm/s", 1.5, _SPEED)
    acceleration_m_s2: float = _renamed("WP_ACC m/s²", "WPNAV_ACCEL cm/s²", 2.5, _ACCELERATION)
    # acceleration in corners; 0: twice WP_ACC, in 4.4 that itself (ArduPilot #22431, #25928)
    corner_acceleration_m_s2: float = _renamed(
        "WP_ACC_CNR m/s²",
        "WPNAV_ACCEL_C cm/s²",
        0.0,
        Range(0.0, 50.0),
        zero_means=("acceleration_m_s2", 2.0),
        zero_meant=((4, 4), 1.0),
        usual=5.0,
    )
    vertical_acceleration_m_s2: float = _renamed(
        "WP_ACC_Z m/s²", "WPNAV_ACCEL_Z cm/s²", 1.0, _ACCELERATION
    )
    jerk_m_s3: float = _renamed(
        "WP_JERK m/s³", "WPNAV_JERK m/s³", 1.0, Range(0.0, 500.0, excludes_low=True)
    )
    waypoint_radius_m: float = _renamed("WP_RADIUS_M m", "WPNAV_RADIUS cm", 2.0, Range(0.05, 100.0))
    terrain_margin_m: float = _renamed("WP_TER_MARGIN m", "WPNAV_TER_MARGIN m", 10.0, NOT_NEGATIVE)
    yaw_behavior: int = parameter("WP_YAW_BEHAVIOR", 2, NOT_NEGATIVE)
    yaw_rate_rad_s: float = _renamed(
        "ATC_RATE_WPY_MAX deg/s", "ATC_SLEW_YAW cdeg/s", 60.0, Range(0.0, 20.0, excludes_low=True)
    )
    # of the attitude; of the position controller, which flies missions (0: the same)
    attitude_lean_max_rad: float = _renamed(
        "ATC_ANGLE_MAX deg", "ANGLE_MAX cdeg", 30.0, Range(0.1, 1.5)
    )
    lean_angle_max_rad: float = parameter(
        "PSC_ANGLE_MAX deg", 0.0, Range(0.0, 1.5), zero_means=("attitude_lean_max_rad", 1.0)
    )
    # of the attitude; 0: no limit (``AC_AttitudeControl::get_slew_yaw_max_degs``)
    attitude_yaw_rate_rad_s: float = parameter("ATC_RATE_Y_MAX deg/s", 0.0, NOT_NEGATIVE)
    # of rolls and pitches, 0: none; they bound the jerk of legs
    attitude_roll_rate_rad_s: float = parameter("ATC_RATE_R_MAX deg/s", 0.0, NOT_NEGATIVE)
    attitude_pitch_rate_rad_s: float = parameter("ATC_RATE_P_MAX deg/s", 0.0, NOT_NEGATIVE)
    # of these, 0: none; they bound how fast that jerk rises
    attitude_roll_acceleration_rad_s2: float = _renamed(
        "ATC_ACC_R_MAX deg/s²", "ATC_ACCEL_R_MAX cdeg/s²", 1100.0, NOT_NEGATIVE
    )
    attitude_pitch_acceleration_rad_s2: float = _renamed(
        "ATC_ACC_P_MAX deg/s²", "ATC_ACCEL_P_MAX cdeg/s²", 1100.0, NOT_NEGATIVE
    )
    # time constant of the attitude; jerk rises within twice of it, or more slowly
    attitude_time_constant_s: float = parameter("ATC_INPUT_TC s", 0.15, Range(0.0, 1.0))
    circle_radius_m: float = _renamed("CIRCLE_RADIUS_M m", "CIRCLE_RADIUS cm", 10.0, NOT_NEGATIVE)
    # greatest turn rate of circles; negative: counter-clockwise
    circle_rate_rad_s: float = parameter("CIRCLE_RATE deg/s", 20.0)

    land_speed_m_s: float = _renamed(
        "LAND_SPD_MS m/s", "LAND_SPEED cm/s", 0.5, Range(_SLOWEST_M_S, 10.0)
    )
    # descent rate of a landing above it; 0: WP_SPD_DN
    land_high_speed_m_s: float = _renamed(
        "LAND_SPD_HIGH_MS m/s",
        "LAND_SPEED_HIGH cm/s",
        0.0,
        _SPEED_OR_0,
        zero_means=("descent_speed_m_s", 1.0),
        usual=1.5,
    )
    land_slow_height_m: float = _renamed("LAND_ALT_LOW_M m", "LAND_ALT_LOW cm", 10.0, _HEIGHT)
    precision_landing: int = parameter("PLND_ENABLED", 0, NOT_NEGATIVE)
    # what becomes of a landing that loses its target: 0 lands, 1 climbs and tries again, 2 then hovers
    precision_strictness: int = parameter("PLND_STRICT", 1, NOT_NEGATIVE)
    # height over home of the way back; 0: as it is
    return_altitude_m: float = _renamed("RTL_ALT_M m", "RTL_ALT cm", 15.0, Range(0.0, 3000.0))
    # height at which a return ends; 0: landed
    return_final_altitude_m: float = _renamed(
        "RTL_ALT_FINAL_M m", "RTL_ALT_FINAL cm", 0.0, _HEIGHT, usual=5.0
    )
    return_climb_min_m: float = _renamed(
        "RTL_CLIMB_MIN_M m", "RTL_CLIMB_MIN cm", 0.0, _HEIGHT, usual=5.0
    )
    # speed of a return; 0: WP_SPD
    return_speed_m_s: float = _renamed(
        "RTL_SPEED_MS m/s",
        "RTL_SPEED cm/s",
        0.0,
        _SPEED_OR_0,
        zero_means=("cruise_speed_m_s", 1.0),
        usual=5.0,
    )
    return_loiter_s: float = parameter("RTL_LOIT_TIME ms", 5000.0, NOT_NEGATIVE)
    return_cone_slope: float = parameter("RTL_CONE_SLOPE", 3.0, NOT_NEGATIVE)
    # 0: over home, 1: over terrain
    return_altitude_type: int = parameter("RTL_ALT_TYPE", 0, NOT_NEGATIVE)
    # that SmartRTL remembers; 0: it is switched off
    smart_return_points: int = parameter("SRTL_POINTS", 300, NOT_NEGATIVE)

    # distance within which a rally point is taken though home is nearer; 0: no limit
    rally_limit_m: float = parameter("RALLY_LIMIT_KM km", 0.3, NOT_NEGATIVE)
    # 1: home counts among the rally points
    rally_includes_home: int = parameter("RALLY_INCL_HOME", 1, NOT_NEGATIVE)

    spool_up_s: float = parameter("MOT_SPOOL_TIME s", 0.5, NOT_NEGATIVE)
    # until the motors stand still; 0: MOT_SPOOL_TIME
    spool_down_s: float = parameter(
        "MOT_SPOOL_TIM_DN s", 0.0, NOT_NEGATIVE, zero_means=("spool_up_s", 1.0)
    )
    # motors held back after arming, with MOT_SAFE_DISARM
    safe_time_s: float = parameter("MOT_SAFE_TIME s", 1.0, NOT_NEGATIVE)
    safe_disarm: int = parameter("MOT_SAFE_DISARM", 0, NOT_NEGATIVE)
    hover_throttle: float = parameter("MOT_THST_HOVER", 0.35, Range(0.0, 1.0, excludes_low=True))
    takeoff_slew_s: float = parameter("TKOFF_SLEW_TIME s", 2.0, NOT_NEGATIVE)
    # descent rate of payload placing; 0: LAND_SPD_MS
    place_descent_speed_m_s: float = parameter(
        "PLDP_SPEED_DN m/s", 0.0, Range(0.0, 10.0), zero_means=("land_speed_m_s", 1.0)
    )
    place_delay_s: float = parameter("PLDP_DELAY s", 0.0, NOT_NEGATIVE)
    # bits: what a mission must contain to arm
    mission_items_required: int = parameter("ARMING_MIS_ITEMS", 0)
    # bits: 4 a mission continues after a landing where a take-off comes next
    mission_options: int = parameter("MIS_OPTIONS", 0, NOT_NEGATIVE)

    # kilobytes on the card for missions
    mission_card_kb: float = parameter("BRD_SD_MISSION", 0.0, NOT_NEGATIVE)
    terrain_enable: int = parameter("TERRAIN_ENABLE", 1, NOT_NEGATIVE)
    # 0: none
    rangefinder_type: int = parameter("RNGFND1_TYPE", 0, NOT_NEGATIVE)

    # 0 none: no failsafe and no check of the battery; else what measures it.  ArduPilot's default is 0,
    # but who sets thresholds has a monitor: a file without this parameter is of one that measures.
    battery_monitor: int = parameter("BATT_MONITOR", 4, NOT_NEGATIVE)
    # of capacity, charges left, voltages and times 0: not known, not watched
    battery_capacity_ah: float = parameter("BATT_CAPACITY mAh", 3300.0, NOT_NEGATIVE)
    battery_low_v: float = parameter(
        "BATT_LOW_VOLT V", 10.5, NOT_NEGATIVE, formerly="FS_BATT_VOLTAGE V"
    )
    battery_low_timer_s: float = parameter("BATT_LOW_TIMER s", 10.0, NOT_NEGATIVE)
    battery_low_ah: float = parameter(
        "BATT_LOW_MAH mAh", 0.0, NOT_NEGATIVE, formerly="FS_BATT_MAH mAh"
    )
    battery_critical_v: float = parameter("BATT_CRT_VOLT V", 0.0, NOT_NEGATIVE)
    battery_critical_ah: float = parameter("BATT_CRT_MAH mAh", 0.0, NOT_NEGATIVE)
    # of these two 0 none, 1 land, 2 return, …
    battery_low_action: int = parameter(
        "BATT_FS_LOW_ACT", 0, NOT_NEGATIVE, formerly="FS_BATT_ENABLE"
    )
    battery_critical_action: int = parameter("BATT_FS_CRT_ACT", 0, NOT_NEGATIVE)
    battery_voltage_source: int = parameter("BATT_FS_VOLTSRC", 0, NOT_NEGATIVE)
    arm_battery_min_v: float = parameter(
        "BATT_ARM_VOLT V", 0.0, NOT_NEGATIVE, formerly="ARMING_VOLT_MIN V"
    )
    arm_battery_min_ah: float = parameter("BATT_ARM_MAH mAh", 0.0, NOT_NEGATIVE)

    # round obstacles: 0 none, 1 BendyRuler, 2 Dijkstra, 3 both; bits: 4 flies on while it plans
    path_planner: int = parameter("OA_TYPE", 0, NOT_NEGATIVE)
    path_planner_options: int = parameter("OA_OPTIONS", 1, NOT_NEGATIVE)

    fence_enable: int = parameter("FENCE_ENABLE", 0, NOT_NEGATIVE)
    fence_auto_enable: int = parameter("FENCE_AUTOENABLE", 0, NOT_NEGATIVE)
    # bits: 1 ceiling, 2 circle, 4 polygons, 8 floor
    fence_type: int = parameter("FENCE_TYPE", 7, NOT_NEGATIVE)
    fence_action: int = parameter("FENCE_ACTION", 1, NOT_NEGATIVE)
    # bits: 2 one inclusion area is enough
    fence_options: int = parameter("FENCE_OPTIONS", 0, NOT_NEGATIVE)
    fence_height_max_m: float = parameter("FENCE_ALT_MAX m", 100.0, NOT_NEGATIVE)
    fence_height_min_m: float = parameter("FENCE_ALT_MIN m", -10.0)
    fence_radius_m: float = parameter("FENCE_RADIUS m", 300.0, POSITIVE)
    fence_margin_m: float = parameter("FENCE_MARGIN m", 2.0, NOT_NEGATIVE)
    # level; 0: the same
    fence_level_margin_m: float = parameter(
        "FENCE_MARGIN_XY m", 0.0, NOT_NEGATIVE, zero_means=("fence_margin_m", 1.0)
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        # ``AC_PosControl`` leans no further, whatever acceleration is asked for.
        most_m_s2 = GRAVITY_M_S2 * math.tan(self.lean_angle_max_rad)
        is_own = self.lean_angle_max_rad != self.attitude_lean_max_rad
        limit = "lean_angle_max_rad" if is_own else "attitude_lean_max_rad"
        for quantity in ("acceleration_m_s2", "corner_acceleration_m_s2"):
            if getattr(self, quantity) > most_m_s2:
                self.overwrite(limit, quantity, most_m_s2)
        if 0.0 < self.attitude_yaw_rate_rad_s < self.yaw_rate_rad_s:
            self.overwrite(
                "attitude_yaw_rate_rad_s", "yaw_rate_rad_s", self.attitude_yaw_rate_rad_s
            )
        # ``AC_WPNav::calc_scurve_jerk_and_snap``: of both the lesser, none where one is 0
        rates = ("attitude_roll_rate_rad_s", "attitude_pitch_rate_rad_s")
        slowest = min(rates, key=lambda name: float(getattr(self, name)))
        if 0.0 < (most_m_s3 := GRAVITY_M_S2 * getattr(self, slowest)) < self.jerk_m_s3:
            self.overwrite(slowest, "jerk_m_s3", most_m_s3)

    @property
    def held_back_s(self) -> float:
        """How long the motors stand still after arming (``AP_MotorsMulticopter::output_logic``). [s]"""
        return max(_ARMING_DELAY_S, self.safe_time_s if self.safe_disarm else 0.0)

    @property
    def jerk_rise_s(self) -> float:
        """How long the jerk of a leg takes to rise. [s]

        Notes
        -----
        ``calc_scurve_jerk_and_snap``: half the snap J π / 2 max(ATC_INPUT_TC, 0.1), or half of g times the
        lesser angular acceleration where that is less, and ``calculate_path``: t_j = J π / 2 snap.
        """
        turning_rad_s2 = min(
            self.attitude_roll_acceleration_rad_s2, self.attitude_pitch_acceleration_rad_s2
        )
        rise_s = max(2.0 * self.attitude_time_constant_s, _SHORTEST_RISE_S)
        if turning_rad_s2 <= 0.0:
            return rise_s
        return max(rise_s, math.pi * self.jerk_m_s3 / (GRAVITY_M_S2 * turning_rad_s2))

    @property
    def plans_legs_anew(self) -> bool:
        """Whether a path planner round obstacles lets the vehicle stand before each leg, and fly no spline.

        Notes
        -----
        ``AC_WPNav_OA::update_wpnav``: until the planner has answered for a new destination its place is
        one to stop at; what was planned behind it, and a spline to it, are dropped then.  So it is asked for
        once more, without the next one, where there was one.
        """
        return self.path_planner > 0 and not self.path_planner_options & _FAST_WAYPOINTS

    @property
    def stops_at_waypoints(self) -> bool:
        """Whether it stops at each but splines: BendyRuler never finds the way behind to be clear, either.

        ``AP_OAPathPlanner::avoidance_thread``, ``AC_WPNav::force_stop_at_next_wp``.
        """
        return self.plans_legs_anew or self.path_planner == _BENDY_RULER

    @property
    def measures_current(self) -> bool:
        """Whether the charge used is known on board: not with an analogue voltage alone."""
        return self.battery_monitor not in {0, _VOLTAGE_ONLY}

    @property
    def measures_battery(self) -> bool:
        """Whether anything on board measures the battery."""
        return self.battery_monitor != 0
