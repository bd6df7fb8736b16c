"""The parameters PX4 flies multicopter missions with.

Defaults are those of PX4's 1.17 line on a multicopter: ``src/modules/mc_pos_control``,
``navigator``, ``commander``, with the multicopter values of ``rc.mc_defaults``; where 1.15 and 1.16 have
others, by those files of the two.
"""

from __future__ import annotations

from planner.vehicle.declared import NOT_NEGATIVE, POSITIVE, Range
from planner.vehicle.parameters.table import AutopilotParameters, parameter

_FASTEST_M_S = 50.0
"""Faster than any multicopter that flies missions: beyond it a unit was mistaken. [m/s]"""
_SPEED = _ACCELERATION = Range(0.0, _FASTEST_M_S, excludes_low=True)
_SLOW = _GAIN = Range(0.0, 10.0, excludes_low=True)
_GAIN_OR_NONE = Range(0.0, 10.0)
_JERK = Range(0.0, 500.0, excludes_low=True)
_OR_NEGATIVE = Range(high=_FASTEST_M_S)
_FRACTION = Range(0.0, 1.0)
_1_16, _1_17 = (1, 16), (1, 17)
_SUPPLY_BREAKER = 894281
"""CBRK_SUPPLY_CHK that switches the checks of the battery off (``CBRK_SUPPLY_CHK_KEY``)."""
DEPLOYMENT_WAIT = "MIS_PD_TO"
"""The wait of before 1.16, which gimbals did not have."""


class Px4Parameters(AutopilotParameters, eq=False):
    """PX4's parameters in SI; without arguments the defaults of a multicopter.

    As on the vehicle, MPC_XY_VEL_ALL, MPC_Z_VEL_ALL and SYS_VEHICLE_RESP overwrite what they govern
    unless they are negative, and design values are kept inside the absolute limits
    (``MulticopterPositionControl::parameters_update``).
    """

    cruise_speed_m_s: float = parameter("MPC_XY_CRUISE m/s", 5.0, _SPEED)
    speed_max_m_s: float = parameter("MPC_XY_VEL_MAX m/s", 12.0, _SPEED)
    climb_speed_m_s: float = parameter("MPC_Z_V_AUTO_UP m/s", 3.0, _SPEED)
    descent_speed_m_s: float = parameter("MPC_Z_V_AUTO_DN m/s", 1.5, _SPEED)
    climb_speed_max_m_s: float = parameter("MPC_Z_VEL_MAX_UP m/s", 3.0, _SPEED)
    descent_speed_max_m_s: float = parameter("MPC_Z_VEL_MAX_DN m/s", 1.5, _SPEED)
    acceleration_m_s2: float = parameter("MPC_ACC_HOR m/s²", 3.0, _ACCELERATION)
    # of a pilot's sticks; the fence predicts with it (GF_PREDICT)
    acceleration_limit_m_s2: float = parameter("MPC_ACC_HOR_MAX m/s²", 5.0, _ACCELERATION)
    acceleration_up_m_s2: float = parameter("MPC_ACC_UP_MAX m/s²", 4.0, _ACCELERATION)
    acceleration_down_m_s2: float = parameter("MPC_ACC_DOWN_MAX m/s²", 3.0, _ACCELERATION)
    lean_angle_max_rad: float = parameter("MPC_TILTMAX_AIR deg", 45.0, Range(0.1, 1.56))
    jerk_m_s3: float = parameter("MPC_JERK_AUTO m/s³", 4.0, _JERK)
    trajectory_gain_per_s: float = parameter("MPC_XY_TRAJ_P 1/s", 0.5, _GAIN)
    position_gain_per_s: float = parameter("MPC_XY_P 1/s", 0.95, _GAIN)
    position_error_max_m: float = parameter("MPC_XY_ERR_MAX m", 2.0, POSITIVE)
    velocity_gain_per_s: float = parameter("MPC_XY_VEL_P_ACC 1/s", 1.8, _GAIN)
    velocity_integral_gain_per_s2: float = parameter("MPC_XY_VEL_I_ACC 1/s²", 0.4, _GAIN_OR_NONE)
    velocity_derivative_gain: float = parameter("MPC_XY_VEL_D_ACC", 0.2, _GAIN_OR_NONE)
    vertical_position_gain_per_s: float = parameter("MPC_Z_P 1/s", 1.0, _GAIN)
    vertical_velocity_gain_per_s: float = parameter("MPC_Z_VEL_P_ACC 1/s", 4.0, _GAIN)
    vertical_integral_gain_per_s2: float = parameter("MPC_Z_VEL_I_ACC 1/s²", 2.0, _GAIN)
    # overwrites horizontal speeds
    speed_all_m_s: float = parameter("MPC_XY_VEL_ALL m/s", -10.0, _OR_NEGATIVE, never=0.0)
    # overwrites vertical speeds
    climb_speed_all_m_s: float = parameter("MPC_Z_VEL_ALL m/s", -3.0, _OR_NEGATIVE, never=0.0)
    # overwrites accelerations and jerk
    responsiveness: float = parameter("SYS_VEHICLE_RESP", -0.4, Range(high=1.0))

    acceptance_radius_m: float = parameter("NAV_ACC_RAD m", 2.0, POSITIVE)
    altitude_acceptance_m: float = parameter("NAV_MC_ALT_RAD m", 0.8, POSITIVE)
    loiter_radius_m: float = parameter("NAV_LOITER_RAD m", 80.0, POSITIVE)
    # heading: 0 along the way, 1 to home, 2 from it, 4 turns first, 5 fixed
    yaw_mode: int = parameter("MPC_YAW_MODE", 0)
    yaw_rate_rad_s: float = parameter(
        "MPC_YAWRAUTO_MAX deg/s", 60.0, POSITIVE, earlier=((_1_17, 45.0),)
    )
    # of the attitude, which follows the heading no faster
    attitude_yaw_rate_rad_s: float = parameter("MC_YAWRATE_MAX deg/s", 200.0, POSITIVE)
    yaw_acceleration_rad_s2: float = parameter(
        "MPC_YAWRAUTO_ACC deg/s²", 20.0, POSITIVE, earlier=((_1_17, 60.0),)
    )
    yaw_acceptance_rad: float = parameter("MIS_YAW_ERR deg", 12.0, NOT_NEGATIVE)
    # longest wait for a heading; negative: no end
    yaw_timeout_s: float = parameter("MIS_YAW_TMT s", -1.0)
    # wait for a gripper or a winch, since 1.16 for a gimbal too
    payload_wait_s: float = parameter(
        "MIS_COMMAND_TOUT s",
        0.0,
        NOT_NEGATIVE,
        formerly=f"{DEPLOYMENT_WAIT} s",
        since=_1_16,
        earlier=((_1_16, 5.0),),
    )
    takeoff_speed_m_s: float = parameter("MPC_TKO_SPEED m/s", 1.5, _SLOW)
    takeoff_ramp_s: float = parameter("MPC_TKO_RAMP_T s", 3.0, NOT_NEGATIVE)
    spool_up_s: float = parameter("COM_SPOOLUP_TIME s", 1.0, NOT_NEGATIVE)
    land_speed_m_s: float = parameter("MPC_LAND_SPEED m/s", 0.7, _SLOW)
    land_slow_height_m: float = parameter("MPC_LAND_ALT1 m", 10.0, NOT_NEGATIVE)
    land_slowest_height_m: float = parameter("MPC_LAND_ALT2 m", 5.0, NOT_NEGATIVE)
    land_crawl_height_m: float = parameter("MPC_LAND_ALT3 m", 1.0, NOT_NEGATIVE)
    land_crawl_speed_m_s: float = parameter("MPC_LAND_CRWL m/s", 0.3, _SLOW)

    # precision landings of returns: 0 none, 1 where a target is seen, 2 search for it
    return_precision_landing: int = parameter("RTL_PLD_MD", 0, NOT_NEGATIVE)
    target_search_s: float = parameter("PLD_SRCH_TOUT s", 10.0, NOT_NEGATIVE)
    target_searches: int = parameter("PLD_MAX_SRCH", 3, NOT_NEGATIVE)
    target_search_height_m: float = parameter("PLD_SRCH_ALT m", 10.0, NOT_NEGATIVE)

    # time from landed to disarmed; negative: never
    disarm_delay_s: float = parameter("COM_DISARM_LAND s", 2.0)

    takeoff_land_required: int = parameter(
        "MIS_TKO_LAND_REQ", 0, NOT_NEGATIVE, formerly="MIS_TAKEOFF_REQ"
    )
    # warned beyond this from home; not positive: never
    first_waypoint_distance_m: float = parameter("MIS_DIST_1WP m", 10000.0)

    return_altitude_m: float = parameter("RTL_RETURN_ALT m", 30.0, NOT_NEGATIVE)
    return_descend_altitude_m: float = parameter("RTL_DESCEND_ALT m", 10.0, NOT_NEGATIVE)
    # wait over home; negative: no landing
    return_land_delay_s: float = parameter("RTL_LAND_DELAY s", 0.0)
    return_min_distance_m: float = parameter("RTL_MIN_DIST m", 10.0, NOT_NEGATIVE)
    return_cone_angle_rad: float = parameter("RTL_CONE_ANG deg", 45.0, NOT_NEGATIVE)
    return_type: int = parameter("RTL_TYPE", 0, NOT_NEGATIVE)
    return_time_factor: float = parameter("RTL_TIME_FACTOR", 1.1, NOT_NEGATIVE)
    return_time_margin_s: float = parameter("RTL_TIME_MARGIN s", 100.0, NOT_NEGATIVE)

    # -1 nothing measures the battery: no failsafe; 0 power module, 1 external, 2 speed controllers
    battery_source: int = parameter("BAT1_SOURCE", 0, Range(-1.0, 10.0), formerly="BAT_SOURCE")
    supply_breaker: int = parameter("CBRK_SUPPLY_CHK", 0, NOT_NEGATIVE)
    # charge of the battery; negative: not known
    battery_capacity_ah: float = parameter("BAT1_CAPACITY mAh", -1.0, formerly="BAT_CAPACITY mAh")
    # cells in series; 0: not known
    battery_cells: int = parameter("BAT1_N_CELLS", 0, NOT_NEGATIVE, formerly="BAT_N_CELLS")
    battery_empty_cell_v: float = parameter(
        "BAT1_V_EMPTY V", 3.6, POSITIVE, formerly="BAT_V_EMPTY V"
    )
    battery_full_cell_v: float = parameter(
        "BAT1_V_CHARGED V", 4.05, POSITIVE, formerly="BAT_V_CHARGED V"
    )
    # of a cell, by which the drop under load is taken out of the voltage; negative: estimated
    battery_cell_resistance_ohm: float = parameter(
        "BAT1_R_INTERNAL ohm", -1.0, formerly="BAT_R_INTERNAL ohm"
    )
    battery_mean_current_a: float = parameter("BAT_AVRG_CURRENT A", 15.0, POSITIVE)
    battery_low_fraction: float = parameter("BAT_LOW_THR", 0.15, _FRACTION)
    battery_critical_fraction: float = parameter("BAT_CRIT_THR", 0.07, _FRACTION)
    battery_emergency_fraction: float = parameter("BAT_EMERGEN_THR", 0.05, _FRACTION)
    # 0 warn, 2 land, 3 return and land
    battery_action: int = parameter("COM_LOW_BAT_ACT", 0, NOT_NEGATIVE)
    # 0 none, 1 warn, 3 return when time runs out; off by default since PX4 #25267
    return_time_action: int = parameter("COM_FLTT_LOW_ACT", 0, NOT_NEGATIVE, earlier=((_1_17, 3),))
    # charge to arm with; negative: the critical one
    arm_battery_min_fraction: float = parameter(
        "COM_ARM_BAT_MIN", -1.0, Range(high=1.0), earlier=((_1_16, 0.0),)
    )
    # held before a failsafe's action, so that a pilot may take over
    failsafe_hold_s: float = parameter("COM_FAIL_ACT_T s", 5.0, NOT_NEGATIVE)
    # longest flight; 0 or less: no limit
    flight_time_max_s: float = parameter("COM_FLT_TIME_MAX s", -1.0)
    wind_max_m_s: float = parameter("COM_WIND_MAX m/s", -1.0)  # strongest; 0 or less: no limit
    # 0 none, 1 warn, 2 hold, 3 return, 4 terminate, 5 land; so the next
    wind_max_action: int = parameter("COM_WIND_MAX_ACT", 0, NOT_NEGATIVE)
    # largest error of the position; 0 or less: no limit
    position_error_limit_m: float = parameter("COM_POS_LOW_EPH m", -1.0)
    position_error_action: int = parameter("COM_POS_LOW_ACT", 3, NOT_NEGATIVE)
    # thrust of a hover over the greatest
    hover_throttle: float = parameter("MPC_THR_HOVER", 0.5, Range(0.0, 1.0, excludes_low=True))

    fence_action: int = parameter("GF_ACTION", 2, NOT_NEGATIVE)
    # 1: a place ahead of the vehicle is tested, not where it is
    fence_predicts: int = parameter("GF_PREDICT", 0, NOT_NEGATIVE)
    # greatest distance from home; 0: no limit
    fence_distance_max_m: float = parameter("GF_MAX_HOR_DIST m", 0.0, NOT_NEGATIVE)
    # greatest height over home; 0: no limit
    fence_height_max_m: float = parameter("GF_MAX_VER_DIST m", 0.0, NOT_NEGATIVE)

    @property
    def measures_battery(self) -> bool:
        """Whether anything on board measures the battery, and the commander asks it.

        ``BatteryChecks::checkAndReport`` leaves with the circuit breaker, before arming and in flight.
        """
        return self.battery_source >= 0 and self.supply_breaker != _SUPPLY_BREAKER

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.responsiveness >= 0.0:
            fraction = self.responsiveness**2  # PX4: less sensitive at the lower end
            for quantity, low, high in (
                ("acceleration_m_s2", 1.0, 15.0),
                ("acceleration_limit_m_s2", 2.0, 15.0),
                ("acceleration_up_m_s2", 1.0, 15.0),
                ("acceleration_down_m_s2", 0.8, 15.0),
                ("jerk_m_s3", 1.0, 25.0),
            ):
                self.overwrite("responsiveness", quantity, low + fraction * (high - low))
        if self.speed_all_m_s >= 0.0:
            self.overwrite("speed_all_m_s", "cruise_speed_m_s", self.speed_all_m_s)
            self.overwrite("speed_all_m_s", "speed_max_m_s", self.speed_all_m_s)
        if self.climb_speed_all_m_s >= 0.0:
            for quantity, factor in (
                ("climb_speed_m_s", 1.0),
                ("climb_speed_max_m_s", 1.0),
                ("descent_speed_m_s", 0.75),
                ("descent_speed_max_m_s", 0.75),
                ("takeoff_speed_m_s", 0.6),
                ("land_speed_m_s", 0.5),
            ):
                self.overwrite("climb_speed_all_m_s", quantity, factor * self.climb_speed_all_m_s)
        for limit, quantity in (
            ("speed_max_m_s", "cruise_speed_m_s"),
            ("climb_speed_max_m_s", "climb_speed_m_s"),
            ("descent_speed_max_m_s", "descent_speed_m_s"),
            ("descent_speed_max_m_s", "land_speed_m_s"),
            ("attitude_yaw_rate_rad_s", "yaw_rate_rad_s"),
        ):
            if getattr(self, quantity) > getattr(self, limit):
                self.overwrite(limit, quantity, getattr(self, limit))
