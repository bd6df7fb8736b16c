"""The parameters PX4 flies multicopter missions with.

Defaults are those of PX4's 1.17 line on a multicopter: ``src/modules/mc_pos_control``,
``navigator``, ``commander``, with the multicopter values of ``rc.mc_defaults``.
"""

from __future__ import annotations

from planner.values import force_setattr
from planner.vehicle.declared import NOT_NEGATIVE, POSITIVE, Range
from planner.vehicle.parameters.table import AutopilotParameters, parameter

_FASTEST_M_S = 50.0
"""Faster than any multicopter that flies missions: beyond it a unit was mistaken. [m/s]"""
_SPEED = Range(0.0, _FASTEST_M_S, excludes_low=True)


class Px4Parameters(AutopilotParameters, eq=False):
    """PX4's parameters in SI; without arguments the defaults of a multicopter.

    As on the vehicle, MPC_XY_VEL_ALL, MPC_Z_VEL_ALL and SYS_VEHICLE_RESP overwrite what they govern
    unless they are negative, and design values are kept inside the absolute limits
    (``MulticopterPositionControl::parameters_update``).
    """

    cruise_speed_m_s: float = parameter("MPC_XY_CRUISE m/s", 5.0, "speed of missions", _SPEED)
    speed_max_m_s: float = parameter("MPC_XY_VEL_MAX m/s", 12.0, "greatest speed", _SPEED)
    climb_speed_m_s: float = parameter("MPC_Z_V_AUTO_UP m/s", 3.0, "climb rate of missions", _SPEED)
    descent_speed_m_s: float = parameter(
        "MPC_Z_V_AUTO_DN m/s", 1.5, "descent rate of missions", _SPEED
    )
    climb_speed_max_m_s: float = parameter(
        "MPC_Z_VEL_MAX_UP m/s", 3.0, "greatest climb rate", _SPEED
    )
    descent_speed_max_m_s: float = parameter(
        "MPC_Z_VEL_MAX_DN m/s", 1.5, "greatest descent rate", _SPEED
    )
    acceleration_m_s2: float = parameter(
        "MPC_ACC_HOR m/s²", 3.0, "horizontal acceleration", Range(0.0, 50.0, excludes_low=True)
    )
    acceleration_up_m_s2: float = parameter(
        "MPC_ACC_UP_MAX m/s²", 4.0, "upward acceleration", Range(0.0, 50.0, excludes_low=True)
    )
    acceleration_down_m_s2: float = parameter(
        "MPC_ACC_DOWN_MAX m/s²", 3.0, "downward acceleration", Range(0.0, 50.0, excludes_low=True)
    )
    jerk_m_s3: float = parameter(
        "MPC_JERK_AUTO m/s³", 4.0, "jerk of missions", Range(0.0, 500.0, excludes_low=True)
    )
    trajectory_gain_per_s: float = parameter(
        "MPC_XY_TRAJ_P 1/s", 0.5, "gain of the corner speed", Range(0.0, 10.0, excludes_low=True)
    )
    position_gain_per_s: float = parameter(
        "MPC_XY_P 1/s", 0.95, "speed per position error", Range(0.0, 10.0, excludes_low=True)
    )
    position_error_max_m: float = parameter(
        "MPC_XY_ERR_MAX m", 2.0, "error at which the trajectory waits", POSITIVE
    )
    speed_all_m_s: float = parameter(
        "MPC_XY_VEL_ALL m/s",
        -10.0,
        "overwrites horizontal speeds",
        Range(high=_FASTEST_M_S),
        never=0.0,
    )
    climb_speed_all_m_s: float = parameter(
        "MPC_Z_VEL_ALL m/s", -3.0, "overwrites vertical speeds", Range(high=_FASTEST_M_S), never=0.0
    )
    responsiveness: float = parameter(
        "SYS_VEHICLE_RESP", -0.4, "overwrites accelerations and jerk", Range(high=1.0)
    )

    acceptance_radius_m: float = parameter(
        "NAV_ACC_RAD m", 2.0, "radius in which a waypoint counts as reached", POSITIVE
    )
    altitude_acceptance_m: float = parameter(
        "NAV_MC_ALT_RAD m", 0.8, "height band of a reached waypoint", POSITIVE
    )
    yaw_mode: int = parameter(
        "MPC_YAW_MODE", 0, "heading: 0 along the way, 1 to home, 2 from it, 4 turns first, 5 fixed"
    )
    yaw_rate_rad_s: float = parameter(
        "MPC_YAWRAUTO_MAX deg/s", 60.0, "yaw rate of missions", POSITIVE
    )
    yaw_acceleration_rad_s2: float = parameter(
        "MPC_YAWRAUTO_ACC deg/s²", 20.0, "yaw acceleration of missions", POSITIVE
    )
    yaw_acceptance_rad: float = parameter(
        "MIS_YAW_ERR deg", 12.0, "heading band of a reached waypoint", NOT_NEGATIVE
    )
    yaw_timeout_s: float = parameter(
        "MIS_YAW_TMT s", -1.0, "longest wait for a heading; negative: no end"
    )
    takeoff_speed_m_s: float = parameter(
        "MPC_TKO_SPEED m/s",
        1.5,
        "climb rate below MPC_LAND_ALT1",
        Range(0.0, 10.0, excludes_low=True),
    )
    takeoff_ramp_s: float = parameter(
        "MPC_TKO_RAMP_T s", 3.0, "time over which thrust builds up", NOT_NEGATIVE
    )
    spool_up_s: float = parameter(
        "COM_SPOOLUP_TIME s", 1.0, "time for motors to spool up", NOT_NEGATIVE
    )
    land_speed_m_s: float = parameter(
        "MPC_LAND_SPEED m/s",
        0.7,
        "descent rate below MPC_LAND_ALT2",
        Range(0.0, 10.0, excludes_low=True),
    )
    land_slow_height_m: float = parameter(
        "MPC_LAND_ALT1 m", 10.0, "height below which a landing slows down", NOT_NEGATIVE
    )
    land_slowest_height_m: float = parameter(
        "MPC_LAND_ALT2 m", 5.0, "height below which a landing is slow", NOT_NEGATIVE
    )
    land_crawl_height_m: float = parameter(
        "MPC_LAND_ALT3 m", 1.0, "height below which it crawls, with range sensor", NOT_NEGATIVE
    )
    land_crawl_speed_m_s: float = parameter(
        "MPC_LAND_CRWL m/s", 0.3, "descent rate of crawling", Range(0.0, 10.0, excludes_low=True)
    )

    disarm_delay_s: float = parameter(
        "COM_DISARM_LAND s", 2.0, "time from landed to disarmed; negative: never"
    )

    takeoff_land_required: int = parameter(
        "MIS_TKO_LAND_REQ",
        0,
        "what a mission must contain",
        NOT_NEGATIVE,
        formerly="MIS_TAKEOFF_REQ",
    )
    first_waypoint_distance_m: float = parameter(
        "MIS_DIST_1WP m", 10000.0, "warned beyond this from home; not positive: never"
    )

    return_altitude_m: float = parameter(
        "RTL_RETURN_ALT m", 30.0, "height over home of the way back", NOT_NEGATIVE
    )
    return_descend_altitude_m: float = parameter(
        "RTL_DESCEND_ALT m", 10.0, "height of the wait over home", NOT_NEGATIVE
    )
    return_land_delay_s: float = parameter(
        "RTL_LAND_DELAY s", 0.0, "wait over home; negative: no landing"
    )
    return_min_distance_m: float = parameter(
        "RTL_MIN_DIST m", 10.0, "distance within which the cone holds", NOT_NEGATIVE
    )
    return_cone_angle_rad: float = parameter(
        "RTL_CONE_ANG deg", 45.0, "half angle of the cone over home", NOT_NEGATIVE
    )
    return_type: int = parameter("RTL_TYPE", 0, "where a return goes", NOT_NEGATIVE)
    return_time_factor: float = parameter(
        "RTL_TIME_FACTOR", 1.1, "factor on the time of a return", NOT_NEGATIVE
    )
    return_time_margin_s: float = parameter(
        "RTL_TIME_MARGIN s", 100.0, "margin on the time of a return", NOT_NEGATIVE
    )

    battery_capacity_ah: float = parameter(
        "BAT1_CAPACITY mAh", -1.0, "charge of the battery; negative: not known"
    )
    battery_cells: int = parameter("BAT1_N_CELLS", 0, "cells in series; 0: not known", NOT_NEGATIVE)
    battery_empty_cell_v: float = parameter(
        "BAT1_V_EMPTY V", 3.6, "voltage of an empty cell", POSITIVE
    )
    battery_full_cell_v: float = parameter(
        "BAT1_V_CHARGED V", 4.05, "voltage of a full cell", POSITIVE
    )
    battery_mean_current_a: float = parameter(
        "BAT_AVRG_CURRENT A", 15.0, "current assumed at take-off", POSITIVE
    )
    battery_low_fraction: float = parameter(
        "BAT_LOW_THR", 0.15, "charge at which it warns", Range(0.0, 1.0)
    )
    battery_critical_fraction: float = parameter(
        "BAT_CRIT_THR", 0.07, "charge that is critical", Range(0.0, 1.0)
    )
    battery_emergency_fraction: float = parameter(
        "BAT_EMERGEN_THR", 0.05, "charge that is an emergency", Range(0.0, 1.0)
    )
    battery_action: int = parameter(
        "COM_LOW_BAT_ACT", 0, "0 warn, 2 land, 3 return and land", NOT_NEGATIVE
    )
    return_time_action: int = parameter(
        "COM_FLTT_LOW_ACT", 0, "0 none, 1 warn, 3 return when time runs out", NOT_NEGATIVE
    )
    arm_battery_min_fraction: float = parameter(
        "COM_ARM_BAT_MIN", -1.0, "charge to arm with; negative: the critical one", Range(high=1.0)
    )
    flight_time_max_s: float = parameter(
        "COM_FLT_TIME_MAX s", -1.0, "longest flight; negative: no limit"
    )
    wind_max_m_s: float = parameter("COM_WIND_MAX m/s", -1.0, "strongest wind; negative: no limit")

    fence_action: int = parameter("GF_ACTION", 2, "what a breach leads to", NOT_NEGATIVE)
    fence_distance_max_m: float = parameter(
        "GF_MAX_HOR_DIST m", 0.0, "greatest distance from home; 0: no limit", NOT_NEGATIVE
    )
    fence_height_max_m: float = parameter(
        "GF_MAX_VER_DIST m", 0.0, "greatest height over home; 0: no limit", NOT_NEGATIVE
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.responsiveness >= 0.0:
            fraction = self.responsiveness**2  # PX4: less sensitive at the lower end
            self._overwrite("responsiveness", "acceleration_m_s2", _between(1.0, 15.0, fraction))
            self._overwrite("responsiveness", "acceleration_up_m_s2", _between(1.0, 15.0, fraction))
            self._overwrite(
                "responsiveness", "acceleration_down_m_s2", _between(0.8, 15.0, fraction)
            )
            self._overwrite("responsiveness", "jerk_m_s3", _between(1.0, 25.0, fraction))
        if self.speed_all_m_s >= 0.0:
            self._overwrite("speed_all_m_s", "cruise_speed_m_s", self.speed_all_m_s)
            self._overwrite("speed_all_m_s", "speed_max_m_s", self.speed_all_m_s)
        if self.climb_speed_all_m_s >= 0.0:
            for quantity, factor in (
                ("climb_speed_m_s", 1.0),
                ("climb_speed_max_m_s", 1.0),
                ("descent_speed_m_s", 0.75),
                ("descent_speed_max_m_s", 0.75),
                ("takeoff_speed_m_s", 0.6),
                ("land_speed_m_s", 0.5),
            ):
                self._overwrite("climb_speed_all_m_s", quantity, factor * self.climb_speed_all_m_s)
        for limit, quantity in (
            ("speed_max_m_s", "cruise_speed_m_s"),
            ("climb_speed_max_m_s", "climb_speed_m_s"),
            ("descent_speed_max_m_s", "descent_speed_m_s"),
            ("climb_speed_max_m_s", "takeoff_speed_m_s"),
            ("descent_speed_max_m_s", "land_speed_m_s"),
        ):
            if getattr(self, quantity) > getattr(self, limit):
                self._overwrite(limit, quantity, getattr(self, limit))

    def _overwrite(self, by: str, quantity: str, value: float) -> None:
        """Set a quantity while the value is being made, with the origin of what governs it."""
        force_setattr(self, quantity, value)
        origins = {name: origin for name, origin in self.origins.items() if name != quantity}
        if by in self.origins:
            origins[quantity] = self.origins[by]
        force_setattr(self, "origins", origins)


def _between(low: float, high: float, fraction: float) -> float:
    return low + fraction * (high - low)
