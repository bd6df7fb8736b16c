"""What keeps a vehicle from arming and stands in its parameters: one list for each autopilot.

After ``AP_Arming.cpp``, ``AP_Arming_Copter.cpp``, ``AP_MotorsMulticopter.cpp``, ``AC_Fence.cpp``,
``AP_BattMonitor_Backend.cpp``, ``AP_NavEKF_Source.cpp``, ``AC_AttitudeControl.cpp``, ``AC_PosControl.cpp``
and ``AP_Parachute.cpp`` of ArduPilot 4.5 to 4.7, and PX4's ``HealthAndArmingChecks``.
"""

from __future__ import annotations

import math
from collections import Counter
from typing import TYPE_CHECKING

from planner.flight.fence_schedule import AREAS, CIRCLE, fence_is_on
from planner.mission.items import MissionFormat
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from planner.mission.items import Mission
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

ALWAYS, ANY = None, -1
"""Checks without a bit of ARMING_CHECK: even where all checks are off, and where one is on."""
COMPASS, INS, PARAMETERS, RC, BATTERY, MISSION = (1 << bit for bit in (2, 4, 5, 6, 8, 14))
"""Bits of ARMING_CHECK."""
_MOST_SPIN_MIN = 0.3
"""Above it ArduPilot refuses MOT_SPIN_MIN. [-]"""
_LEAST_FAILSAFE_PWM = 910
"""Least FS_THR_VALUE: receivers lose their signal at 900. [µs]"""
_LEAST_FLOOR_M = -100.0
"""Least FENCE_ALT_MIN. [m]"""
_COMPASS = 1
"""EK3_SRC1_YAW of a heading by compass."""
_EKF3 = 3
"""AHRS_EKF_TYPE that has the sources EK3_SRCn_."""
_SOURCES: Mapping[str, tuple[int, frozenset[int]]] = {
    "POSXY": (3, frozenset({0, 3, 4, 6})),
    "VELXY": (3, frozenset({0, 3, 5, 6, 7})),
    "POSZ": (1, frozenset({0, 1, 2, 3, 4, 6})),
    "VELZ": (3, frozenset({0, 3, 6})),
    "YAW": (1, frozenset({0, 1, 2, 3, 6, 8})),
}
"""What the first set of sources is by default, and what each may be; POSZ may be 0 from 4.7 on."""
_LATER_SOURCES: Mapping[str, int] = {"POSZ": 1}
"""What a second or third set is by default: else nothing."""
_HEADINGS_BY_SATELLITES = frozenset({2, 3})
"""EK3_SRCn_YAW: no sensor is asked for here, 2 and 3 need two receivers that tell it themselves."""
_WITHOUT_HEADING = frozenset({0, 1, 2})
"""GPSn_TYPE of none, of one found by itself and of u-blox: they tell no heading."""
_MODES_ON = 5
"""FLTMODE_CH: the channel of the flight modes."""
_NO_START = frozenset({2, 3})
"""ESC_CALIBRATION that begins as the vehicle is switched on."""
_SENSOR_TYPES: Mapping[int, tuple[str, str]] = {
    4: ("beacons", "BCN_TYPE"),
    5: ("optical flow", "FLOW_TYPE"),
    6: ("a position from outside", "VISO_TYPE"),
    7: ("wheel encoders", "WENC_TYPE"),
}
"""Sensors by the number of a source, and the parameter that switches each on: 0 by default."""
_RANGEFINDER, _SATELLITES, _GSF = 2, 3, 8
"""Numbers of sources; the last a heading from the velocities of satellites."""
_CHANNELS = range(1, 9)
"""Every receiver has so many; of those it has not ArduPilot checks nothing."""
_LEAST_MAX_PWM, _MOST_MIN_PWM = 1700, 1300
"""Of the four channels of the sticks (``RC_Channel::RC_CALIB_MAX_LIMIT_PWM``, ``_MIN_``). [µs]"""
_STICKS: Mapping[str, int] = {"ROLL": 1, "PITCH": 2, "THROTTLE": 3, "YAW": 4}
"""RCMAP_ parameters and their defaults."""
_ALL_OUTPUTS = range(1, 33)
_PARACHUTE, _SERVO = 27, 10
"""SERVOx_FUNCTION of a parachute, and CHUTE_TYPE of one released by a servo."""
_RC_INPUT = 23
"""SERIALn_PROTOCOL of a receiver."""
_INTERLOCK, _STOPS = 32, frozenset({31, 165})
"""RCx_OPTION of the motor interlock and of the emergency stops."""
_MULTICOPTERS = frozenset({1, 2, 3, 4, 5, 7, 8, 9, 10, 12, 14, 15, 16, 17})
"""FRAME_CLASS that Copter flies: 6, 11 and 13 are helicopters, 0 none (``AP_Motors::motor_frame_class``)."""
ROTORS_WITH_FLAPS: Mapping[int, str] = {
    8: "one rotor above flaps",
    9: "two rotors, one above the other, over flaps",
    10: "two rotors that tilt",
}
"""FRAME_CLASS of what Copter flies that is steered otherwise than by the speed of its rotors."""
_FRAME_TYPES: Mapping[int, frozenset[int]] = {
    1: frozenset({0, 1, 2, 3, 4, 5, 6, 12, 13, 14, 18, 19}),
    2: frozenset({0, 1, 3, 13, 14}),
    3: frozenset({0, 1, 2, 3, 13, 14, 15}),
    4: frozenset({0, 1, 2, 3, 12, 14, 18, 20, 21}),
    12: frozenset({0, 1}),
    14: frozenset({0, 1, 14}),
}
"""FRAME_TYPE by FRAME_CLASS of quad, hexa, octa, octa-quad, dodeca-hexa and deca, as ArduCopter 4.7 takes
them in simulation (``AP_MotorsMatrix::setup_motors``); a Y6 or a tricopter takes any."""
_COMPASSES = ("", "2", "3")
_MOST_OFFSET = 1800.0
"""COMPASS_OFFS_MAX, its default. [mGauss]"""
_IN_FLIGHT = 3
"""COMPASS_LEARN that finds the offsets in flight: the compass is not looked at before."""
_LEAST_LEAN_RAD, _MOST_LEAN_RAD = math.radians(10.0), math.radians(80.0)
"""Of ANGLE_MAX (``AP_Arming_Copter::parameter_checks``)."""
_YAW_FROM_OUTSIDE = frozenset({5, 6})
"""EK3_MAG_CAL of a heading from outside, which EK3_SRC1_YAW has replaced."""
_PARACHUTE_RELAY, _RELAYS = 2, range(4)
"""RELAYn_FUNCTION of a parachute, and CHUTE_TYPE of one released by a relay."""
_GAINS = (
    ("PSC_NE_POS_P", "PSC_POSXY_P"),
    ("PSC_D_POS_P", "PSC_POSZ_P"),
    ("PSC_D_VEL_P", "PSC_VELZ_P"),
    ("PSC_D_ACC_P", "PSC_ACCZ_P"),
    ("PSC_D_ACC_I", "PSC_ACCZ_I"),
    *((f"ATC_ANG_{axis}_P",) for axis in ("RLL", "PIT", "YAW")),
)
"""Gains above 0, each from 4.7 on and before."""
_SWITCHES, _PORTS, _RELAY_FUNCTIONS = (
    ("RC", "_OPTION"),
    ("SERIAL", "_PROTOCOL"),
    ("RELAY", "_FUNCTION"),
)
"""Parameters of which there are several: what stands before and after the number."""
_OPTIONS = 256
"""Values of RCx_OPTION from here on may repeat (``RC_Channels::duplicate_options_exist``)."""
_OUTPUTS, _OUTPUTS_OF_A_FILE = ("SERVO", "_FUNCTION"), 8
"""The outputs of a vehicle, and the least number of them: a file with fewer does not list them all."""
_MOTOR_OUTPUTS = (*range(33, 41), *range(82, 86))
"""SERVOx_FUNCTION of the twelve motors."""
_MOTORS: Mapping[int, tuple[int, ...]] = {
    **{kind: _MOTOR_OUTPUTS[:count] for kind, count in {1: 4, 2: 6, 3: 8, 4: 8, 5: 6}.items()},
    7: (33, 34, 36, 39),
    12: _MOTOR_OUTPUTS,
    14: _MOTOR_OUTPUTS[:10],
}
"""Those that each FRAME_CLASS of `_FRAME_TYPES` asks for, a Y6 and a tricopter with its servo: each tried in
ArduPilot's simulation, where classes 8 to 10 ask for none."""


_DOWN = 25
"""RNGFNDn_ORIENT of a sensor that looks down."""
_REACH_M = 7.0
"""RNGFNDn_MAX_CM, its default. [m]"""
_SENSORS = "123456789A"


def rangefinder_reach_m(values: Mapping[str, float]) -> float | None:
    """Return how far the rangefinder reaches that ArduPilot follows the ground by; ``None``: by none. [m]

    Notes
    -----
    ``AC_WPNav::get_terrain_source``: a rangefinder that looks down and is used (WPNAV_RFND_USE, WP_RFND_USE
    from 4.7 on) is the one source of the ground's height; its readings are healthy up to RNGFNDn_MAX.
    """
    if not values.get("WP_RFND_USE", values.get("WPNAV_RFND_USE", 1.0)):
        return None
    reaches_m = [
        values.get(f"RNGFND{n}_MAX", values.get(f"RNGFND{n}_MAX_CM", 100.0 * _REACH_M) / 100.0)
        for n in looking_down(values)
    ]
    return max(reaches_m, default=None)


def looking_down(values: Mapping[str, float]) -> Iterator[str]:
    """Yield the numbers of the rangefinders that look down."""
    for n in _SENSORS:
        if values.get(f"RNGFND{n}_TYPE") and values.get(f"RNGFND{n}_ORIENT", _DOWN) == _DOWN:
            yield n


class ArduPilotGiven(Value, kw_only=False, eq=False):
    """The parameters: those of flight in SI, any other as the file has it."""

    own: ArduPilotParameters
    values: Mapping[str, float]
    mission: Mission

    def value(self, *names: str, default: float) -> float:
        """Return the first of some names that the file holds, in its own unit."""
        return next((self.values[name] for name in names if name in self.values), default)

    @property
    def has_no_height(self) -> bool:
        """Whether the estimator is told to use no source of the height."""
        is_used = self.value("AHRS_EKF_TYPE", default=_EKF3) == _EKF3
        return is_used and self.value("EK3_SRC1_POSZ", default=1) == 0

    @property
    def has_fence(self) -> bool:
        """Whether AC_Fence checks its parameters."""
        own = self.own
        return bool(own.fence_type) and fence_is_on(own)

    @property
    def lacks_areas(self) -> bool:
        """Whether the vehicle has no fence area: a plan brings its own, a text file leaves what is there."""
        holds = self.mission.file_format is MissionFormat.WPL and self.value(
            "FENCE_TOTAL", default=1
        )
        return not (self.mission.fence or holds)

    @property
    def lacks_heading(self) -> bool:
        """Whether nothing gives a heading on the ground: without one there is no position."""
        source = self.value("EK3_SRC1_YAW", default=_COMPASS)
        used = (self.value(f"COMPASS_USE{number}", default=1) for number in ("", 2, 3))
        by_compass = self.value("COMPASS_ENABLE", default=1) and any(used)
        receivers = (
            self.value("GPS1_TYPE", "GPS_TYPE", default=1),
            self.value("GPS2_TYPE", "GPS_TYPE2", default=0),
        )
        if source == _COMPASS:
            return not by_compass
        if source in _HEADINGS_BY_SATELLITES and _WITHOUT_HEADING.issuperset(receivers):
            return source == min(_HEADINGS_BY_SATELLITES) or not by_compass
        return source in {0, _GSF}

    @property
    def compasses(self) -> tuple[str, ...]:
        """The compasses that are asked before arming, by their number, the first first; none where it is not.

        Offsets belong to a device, COMPASS_USE to a place in the order of COMPASS_PRIOn_ID.
        """
        if self.value("COMPASS_LEARN", default=0) == _IN_FLIGHT or not (
            self.value("COMPASS_ENABLE", default=1) and self.value("COMPASS_USE", default=1)
        ):
            return ()
        used = []
        for place, own in enumerate(_COMPASSES, 1):
            first = self.value(f"COMPASS_PRIO{place}_ID", default=0)
            of_device = [
                n for n in _COMPASSES if first and self.values.get(f"COMPASS_DEV_ID{n}") == first
            ]
            number = (of_device or [own])[0]
            is_there = place == 1 or self.value(f"COMPASS_DEV_ID{number}", default=0)
            if is_there and self.value(f"COMPASS_USE{own}", default=1):
                used.append(number)
        return tuple(used)

    def offsets(self, compass: str) -> tuple[float | None, ...]:
        """Return what a compass is off by. [mGauss]"""
        return tuple(self.values.get(f"COMPASS_OFS{compass}_{axis}") for axis in "XYZ")

    def are_zero(self, names: Iterable[str]) -> bool:
        """Return whether the file has all of some parameters, each 0."""
        return all(self.values.get(name) == 0.0 for name in names)

    def unordered(self, prefix: str) -> Iterator[str]:
        """Yield where a trim is not between its least and its greatest."""
        trim = self.value(f"{prefix}_TRIM", default=1500)
        if self.value(f"{prefix}_MIN", default=1100) > trim:
            yield f"{prefix}_MIN is above {prefix}_TRIM"
        if self.value(f"{prefix}_MAX", default=1900) < trim:
            yield f"{prefix}_MAX is below {prefix}_TRIM"

    def counted(self, alike: tuple[str, str]) -> Counter[int]:
        """Return how often each value is given to parameters that differ by a number."""
        before, after = alike
        return Counter(
            int(value)
            for name, value in self.values.items()
            if name.startswith(before)
            and name.endswith(after)
            and name[len(before) : -len(after)].isdecimal()
        )

    @property
    def motors_without_output(self) -> bool:
        """Whether a motor of the frame is on no output; not known where the file leaves outputs out."""
        motors = _MOTORS.get(int(self.value("FRAME_CLASS", default=0)), ())
        given = self.counted(_OUTPUTS)
        return given.total() >= max(_OUTPUTS_OF_A_FILE, len(motors)) and any(
            not given[number] for number in motors
        )


def _both_above_0(low: float, critical: float) -> bool:
    return low > 0.0 and critical > 0.0 and critical >= low


_CONDITIONS: tuple[tuple[int | None, str, Callable[[ArduPilotGiven], bool]], ...] = (
    (
        ALWAYS,
        "MOT_SPIN_ARM is above MOT_SPIN_MIN",
        lambda p: p.value("MOT_SPIN_ARM", default=0.1) > p.value("MOT_SPIN_MIN", default=0.15),
    ),
    (
        ALWAYS,
        "MOT_SPIN_MIN is above 0.3",
        lambda p: p.value("MOT_SPIN_MIN", default=0.15) > _MOST_SPIN_MIN + 1e-6,
    ),
    (
        ALWAYS,
        "AHRS_EKF_TYPE is 0: no estimate of its height",
        lambda p: p.value("AHRS_EKF_TYPE", default=_EKF3) == 0,
    ),
    (
        ALWAYS,
        "one RCx_OPTION is the motor interlock (32), another an emergency stop (31 or 165)",
        lambda p: (
            bool(switches := p.counted(_SWITCHES))
            and bool(switches[_INTERLOCK])
            and any(switches[stop] for stop in _STOPS)
        ),
    ),
    (ALWAYS, "two SERIALn_PROTOCOL are 23, a receiver", lambda p: p.counted(_PORTS)[_RC_INPUT] > 1),
    (
        ALWAYS,
        "FRAME_CLASS is that of no multicopter",
        lambda p: p.value("FRAME_CLASS", default=1) not in _MULTICOPTERS,
    ),
    (
        ALWAYS,
        "FRAME_TYPE is none of FRAME_CLASS",
        lambda p: (
            (kind := int(p.value("FRAME_TYPE", default=1)))
            not in _FRAME_TYPES.get(int(p.value("FRAME_CLASS", default=0)), {kind})
        ),
    ),
    (
        ALWAYS,
        "EK3_MAG_CAL is 5 or 6, a heading from outside, and EK3_SRC1_YAW a compass",
        lambda p: (
            p.value("EK3_MAG_CAL", default=0) in _YAW_FROM_OUTSIDE
            and p.value("EK3_SRC1_YAW", default=_COMPASS) == _COMPASS
            and p.value("AHRS_EKF_TYPE", default=_EKF3) == _EKF3
        ),
    ),
    (
        ALWAYS,
        "EK3_SRC1_POSXY is 0: no position",
        lambda p: p.value("EK3_SRC1_POSXY", default=_SATELLITES) == 0,
    ),
    (
        ALWAYS,
        "no heading: EK3_SRC1_YAW is 0 or 8, 1 with no compass in use, or 2 with no receiver that tells it",
        lambda p: p.lacks_heading,
    ),
    (
        ALWAYS,
        "MOT_PWM_MIN is below 1, or not below MOT_PWM_MAX",
        lambda p: (
            not 1 <= p.value("MOT_PWM_MIN", default=1000) < p.value("MOT_PWM_MAX", default=2000)
        ),
    ),
    (
        ALWAYS,
        "AHRS_EKF_TYPE is 3 and EK3_ENABLE 0, or 2 and EK2_ENABLE 0: that estimate does not run",
        lambda p: any(
            p.value("AHRS_EKF_TYPE", default=_EKF3) == number
            and p.value(f"EK{number}_ENABLE", default=float(number == _EKF3)) == 0
            for number in (2, _EKF3)
        ),
    ),
    (
        ALWAYS,
        "EK3_IMU_MASK is 0, or EK2_IMU_MASK with AHRS_EKF_TYPE 2: the estimate has no sensor to run on",
        lambda p: any(
            p.value("AHRS_EKF_TYPE", default=_EKF3) == number
            and p.value(f"EK{number}_IMU_MASK", default=3) == 0
            for number in (2, _EKF3)
        ),
    ),
    (
        ALWAYS,
        "INS_ENABLE_MASK is 0, or each INS_USE: the estimate has no sensor to run on",
        lambda p: (
            p.value("INS_ENABLE_MASK", default=127) == 0
            or not any(p.value(f"INS_USE{number}", default=1) for number in ("", 2, 3))
        ),
    ),
    (
        ALWAYS,
        "ESC_CALIBRATION is 2 or 3: it calibrates the motors' controllers as it is switched on, and stays so",
        lambda p: p.value("ESC_CALIBRATION", default=0) in _NO_START,
    ),
    (
        ALWAYS,
        "GPS_AUTO_SWITCH is 0 and GPS_PRIMARY 1: the second receiver is used, and there is none",
        lambda p: (
            p.value("GPS_AUTO_SWITCH", default=1) == 0
            and p.value("GPS_PRIMARY", default=0) == 1
            and p.value("GPS2_TYPE", "GPS_TYPE2", default=0) == 0
        ),
    ),
    (
        PARAMETERS,
        "PILOT_SPEED_UP is not above 0",
        lambda p: p.value("PILOT_SPD_UP", "PILOT_SPEED_UP", default=2.5) <= 0.0,
    ),
    (
        PARAMETERS,
        "FS_THR_VALUE is below 910",
        lambda p: (
            p.value("FS_THR_ENABLE", default=1) != 0
            and p.value("FS_THR_VALUE", default=975) < _LEAST_FAILSAFE_PWM
        ),
    ),
    (
        PARAMETERS,
        "RC3_MIN is not more than 10 above FS_THR_VALUE",
        lambda p: (
            p.value("FS_THR_ENABLE", default=1) != 0
            and p.value("RCMAP_THROTTLE", default=3) == 3
            and p.value("RC3_MIN", default=math.inf) <= p.value("FS_THR_VALUE", default=975) + 10
        ),
    ),
    (
        RC,
        "the channel of FLTMODE_CH has an RCx_OPTION",
        lambda p: (
            p.value(f"RC{p.value('FLTMODE_CH', default=_MODES_ON):.0f}_OPTION", default=0) > 0
        ),
    ),
    (
        PARAMETERS,
        "two RCx_OPTION are the same",
        lambda p: any(
            times > 1 for option, times in p.counted(_SWITCHES).items() if 0 < option < _OPTIONS
        ),
    ),
    (ALWAYS, "a motor of FRAME_CLASS is on no SERVOx_FUNCTION", lambda p: p.motors_without_output),
    (
        PARAMETERS,
        "CHUTE_TYPE is 10, a servo, and no SERVOx_FUNCTION is 27",
        lambda p: (
            p.value("CHUTE_ENABLED", default=0) > 0
            and p.value("CHUTE_TYPE", default=0) == _SERVO
            and p.counted(_OUTPUTS).total() >= _OUTPUTS_OF_A_FILE
            and not p.counted(_OUTPUTS)[_PARACHUTE]
        ),
    ),
    (
        PARAMETERS,
        "CHUTE_TYPE is a relay, and no RELAYn_FUNCTION is 2",
        lambda p: (
            p.value("CHUTE_ENABLED", default=0) > 0
            and p.value("CHUTE_TYPE", default=0) in _RELAYS
            and bool(relays := p.counted(_RELAY_FUNCTIONS))
            and not relays[_PARACHUTE_RELAY]
        ),
    ),
    (
        PARAMETERS,
        "ANGLE_MAX is below 10° or above 80°",
        lambda p: (
            not (_LEAST_LEAN_RAD - 1e-6 <= p.own.attitude_lean_max_rad <= _MOST_LEAN_RAD + 1e-6)
        ),
    ),
    (
        INS,
        "INS_ACCOFFS_X, _Y and _Z are 0: the accelerometer is not calibrated",
        lambda p: p.are_zero(f"INS_ACCOFFS_{axis}" for axis in "XYZ"),
    ),
    (
        INS,
        "INS_ACC2OFFS_ or INS_ACC3OFFS_ are 0, of an accelerometer that is there: it is not calibrated",
        lambda p: any(
            p.value(f"INS_ACC{number}_ID", default=0)
            and p.are_zero(f"INS_ACC{number}OFFS_{axis}" for axis in "XYZ")
            for number in (2, 3)
        ),
    ),
    (
        COMPASS,
        "COMPASS_OFS_, of a compass that is there and in use, are 0: it is not calibrated",
        lambda p: any(p.offsets(compass) == (0.0, 0.0, 0.0) for compass in p.compasses),
    ),
    (
        COMPASS,
        "COMPASS_DEV_ID, COMPASS_DEV_ID2 and COMPASS_DEV_ID3 are 0: there is no compass",
        lambda p: bool(p.compasses) and p.are_zero(f"COMPASS_DEV_ID{n}" for n in _COMPASSES),
    ),
    (
        COMPASS,
        "COMPASS_OFS_ is beyond COMPASS_OFFS_MAX",
        lambda p: any(
            None not in (offsets := p.offsets(compass))
            and math.hypot(*(one or 0.0 for one in offsets))
            > p.value("COMPASS_OFFS_MAX", default=_MOST_OFFSET)
            for compass in p.compasses[:1]
        ),
    ),
    (
        PARAMETERS,
        "ACRO_BAL_ROLL or ACRO_BAL_PITCH is negative, or above ATC_ANG_RLL_P or ATC_ANG_PIT_P",
        lambda p: any(
            not 0.0 <= p.value(balance, default=1) <= p.value(gain, default=4.5)
            for balance, gain in (
                ("ACRO_BAL_ROLL", "ATC_ANG_RLL_P"),
                ("ACRO_BAL_PITCH", "ATC_ANG_PIT_P"),
            )
        ),
    ),
    (
        PARAMETERS,
        "RTL_ALT_TYPE is 1, over terrain, with TERRAIN_ENABLE 0 and no rangefinder that looks down",
        lambda p: (
            p.own.return_altitude_type == 1
            and not p.own.terrain_enable
            and rangefinder_reach_m(p.values) is None
        ),
    ),
    (
        PARAMETERS,
        "RTL_ALT_TYPE is 1, over terrain, and RTL_ALT beyond the reach of the rangefinder",
        lambda p: (
            p.own.return_altitude_type == 1
            and p.own.return_altitude_m > (rangefinder_reach_m(p.values) or math.inf)
        ),
    ),
    (
        ANY,
        "FENCE_ENABLE is 1 and nothing that FENCE_TYPE selects is there",
        lambda p: (
            bool(p.own.fence_enable) and not p.own.fence_type & ~(AREAS if p.lacks_areas else 0)
        ),
    ),
    (
        ANY,
        "FENCE_MARGIN is half of FENCE_ALT_MAX less FENCE_ALT_MIN, or more",
        lambda p: (
            p.has_fence
            and p.own.fence_height_max_m - p.own.fence_height_min_m <= 2.0 * p.own.fence_margin_m
        ),
    ),
    (
        ANY,
        "FENCE_MARGIN_XY, or FENCE_MARGIN where that is 0, is above FENCE_RADIUS",
        lambda p: (
            p.has_fence
            and bool(p.own.fence_type & CIRCLE)
            and p.own.fence_radius_m < p.own.fence_level_margin_m
        ),
    ),
    (
        ANY,
        "FENCE_MARGIN_XY, or FENCE_MARGIN where that is 0, is above the radius of an inclusion circle",
        lambda p: (
            p.has_fence
            and bool(p.own.fence_type & AREAS)
            and any(
                circle.inclusion and circle.radius_m < p.own.fence_level_margin_m
                for circle in (p.mission.fence.circles if p.mission.fence else ())
            )
        ),
    ),
    (
        ANY,
        "FENCE_ALT_MIN is below -100 m",
        lambda p: p.has_fence and p.own.fence_height_min_m < _LEAST_FLOOR_M,
    ),
    (
        BATTERY,
        "BATT_CRT_VOLT is not below BATT_LOW_VOLT",
        lambda p: (
            p.own.measures_battery and _both_above_0(p.own.battery_low_v, p.own.battery_critical_v)
        ),
    ),
    (
        BATTERY,
        "BATT_CRT_MAH is not below BATT_LOW_MAH",
        lambda p: (
            p.own.measures_battery
            and _both_above_0(p.own.battery_low_ah, p.own.battery_critical_ah)
        ),
    ),
)
"""Check of ARMING_CHECK, what is said, and whether it is so."""


def _bad_sources(p: ArduPilotGiven) -> Iterator[str]:
    """Yield what ``AP_NavEKF_Source::pre_arm_check`` refuses in any of the three sets."""
    if p.value("AHRS_EKF_TYPE", default=_EKF3) != _EKF3:
        return
    no_satellites = not (
        p.value("GPS1_TYPE", "GPS_TYPE", default=1) or p.value("GPS2_TYPE", "GPS_TYPE2", default=0)
    )
    for number in (1, 2, 3):
        for what, (first, allowed) in _SOURCES.items():
            default = first if number == 1 else _LATER_SOURCES.get(what, 0)
            source = int(p.value(name := f"EK3_SRC{number}_{what}", default=default))
            said = f"{name} is {source}"
            if source not in allowed:
                yield f"{said}: there is no such source"
            elif what == "YAW" and source in _HEADINGS_BY_SATELLITES:
                continue
            elif source in {_SATELLITES, _GSF} and no_satellites:
                yield f"{said}: no satellites, GPS1_TYPE is 0"
            elif source == _RANGEFINDER and not any(looking_down(p.values)):
                yield f"{said}: no rangefinder that looks down"
            elif source in _SENSOR_TYPES:
                sensor, switch = _SENSOR_TYPES[source]
                if p.value(switch, default=0) == 0:
                    yield f"{said}: no {sensor.removeprefix('a ')}, {switch} is 0"


def _bad_channels(p: ArduPilotGiven) -> Iterator[str]:
    """Yield what is wrong with the calibration of the receiver (``AP_Arming::rc_calibration_checks``)."""
    sticks = {int(p.value(f"RCMAP_{stick}", default=own)) for stick, own in _STICKS.items()}
    for number in _CHANNELS:
        yield from p.unordered(f"RC{number}")
        if number in sticks and p.value(f"RC{number}_MIN", default=1100) > _MOST_MIN_PWM:
            yield f"RC{number}_MIN is above {_MOST_MIN_PWM}"
        if number in sticks and p.value(f"RC{number}_MAX", default=1900) < _LEAST_MAX_PWM:
            yield f"RC{number}_MAX is below {_LEAST_MAX_PWM}"


def _bad_outputs(p: ArduPilotGiven) -> Iterator[str]:
    for number in _ALL_OUTPUTS:
        if p.value(f"SERVO{number}_FUNCTION", default=0) > 0:
            yield from p.unordered(f"SERVO{number}")


def _bad_gains(p: ArduPilotGiven) -> Iterator[str]:
    """Yield what ``AC_PosControl`` and ``AC_AttitudeControl`` refuse of their gains."""
    for names in _GAINS:
        if p.value(*names, default=1) <= 0.0:
            yield f"{next(name for name in names if name in p.values)} is not above 0"
    for axis in ("RLL", "PIT", "YAW"):
        feeds_forward = p.value(f"ATC_RAT_{axis}_FF", default=0) > 0.0
        for gain in "PI":
            value = p.value(name := f"ATC_RAT_{axis}_{gain}", default=1)
            if value < 0.0 or (value == 0.0 and not feeds_forward):
                yield f"{name} is not above 0"
        if p.value(name := f"ATC_RAT_{axis}_D", default=0) < 0.0:
            yield f"{name} is below 0"


_NAMED: tuple[tuple[int | None, Callable[[ArduPilotGiven], Iterator[str]]], ...] = (
    (ALWAYS, _bad_sources),
    (RC, _bad_channels),
    (ANY, _bad_outputs),
    (PARAMETERS, _bad_gains),
)
"""Check of ARMING_CHECK, and what yields the parameters it refuses of many alike."""


def refused_by_ardupilot(p: ArduPilotGiven) -> Iterator[tuple[int | None, str]]:
    """Yield each reason for which ArduPilot would not arm, with its check of ARMING_CHECK."""
    for check, said, is_so in _CONDITIONS:
        if is_so(p):
            yield check, said
    for check, refused in _NAMED:
        for said in refused(p):
            yield check, said
            break


_OTHER_POSITIONS = ("EKF2_AGP_CTRL", "EKF2_AGP0_CTRL", "EKF2_EV_CTRL")
_HEADING = 1 << 3
"""Bit of EKF2_GPS_CTRL and EKF2_EV_CTRL: a heading by two antennas, or from outside."""
_HEIGHT = 1 << 1
"""Bit of the same: an altitude."""
_NO_COMPASS = 5
"""EKF2_MAG_TYPE."""
_LOCAL_ESTIMATOR = 1
"""SYS_MC_EST_GROUP of what LPE_EN switches on, before 1.13."""
_WITHOUT_STICKS = frozenset({1, 4})
"""COM_RC_IN_MODE that asks for no calibrated receiver."""
_PX4_CHANNELS, _MOST_PWM = range(1, 19), 2500
_CALIBRATIONS = range(4)


def refused_by_px4(values: Mapping[str, float]) -> Iterator[str]:
    """Yield each reason for which PX4 would not arm for a mission."""
    if values.get("COM_ARMABLE", 1.0) < 1.0:
        yield "COM_ARMABLE is 0"
    if not values.get("COM_HOME_EN", 1.0):  # nor does it take one (``VEHICLE_CMD_DO_SET_HOME``)
        yield "COM_HOME_EN is 0: it has no home, which heights and returns count from"
    yield from _not_measured_by_px4(values)
    for sensor, name in (("accelerometer", "ACC"), ("gyroscope", "GYRO"), ("compass", "MAG")):
        calibrated = [values.get(f"CAL_{name}{number}_ID") for number in _CALIBRATIONS]
        asked = values.get("SYS_HAS_MAG", 1.0) if name == "MAG" else 1.0
        if asked and None not in calibrated and not any(calibrated):
            yield f"CAL_{name}0_ID to CAL_{name}3_ID are 0: no {sensor} is calibrated"
    if values.get("EKF2_EN") == 0 and not (
        values.get("LPE_EN", 0.0) or values.get("SYS_MC_EST_GROUP") == _LOCAL_ESTIMATOR
    ):
        yield "EKF2_EN is 0 and LPE_EN not 1: no estimate of its position"
    yield from _bad_px4_channels(values)


def _not_measured_by_px4(values: Mapping[str, float]) -> Iterator[str]:
    """Yield what nothing gives of where the vehicle is: its position, its heading, its height."""
    if not any(values.get(name, 0.0) for name in _OTHER_POSITIONS):
        if not values.get("SYS_HAS_GPS", 1.0):
            yield "SYS_HAS_GPS is 0, and nothing else gives a position"
        elif not int(values.get("EKF2_GPS_CTRL", 7.0)) & 1:
            yield "EKF2_GPS_CTRL takes no position from satellites, and nothing else gives one"
    has_compass = values.get("SYS_HAS_MAG", 1.0) and values.get("EKF2_MAG_TYPE") != _NO_COMPASS
    if not has_compass and not any(
        int(values.get(name, 0.0)) & _HEADING for name in ("EKF2_GPS_CTRL", "EKF2_EV_CTRL")
    ):
        yield "no heading: SYS_HAS_MAG is 0 or EKF2_MAG_TYPE 5, and nothing else gives one"
    has_barometer = values.get("EKF2_BARO_CTRL", 1.0) and values.get("SYS_HAS_BARO", 1.0)
    of_satellites = int(values.get("EKF2_GPS_CTRL", 7.0)) if values.get("SYS_HAS_GPS", 1.0) else 0
    of_others = of_satellites | int(values.get("EKF2_EV_CTRL", 0.0))
    if not (has_barometer or of_others & _HEIGHT or values.get("EKF2_RNG_CTRL", 0.0)):
        yield "no height: by EKF2_BARO_CTRL, EKF2_GPS_CTRL or SYS_HAS_ parameters nothing measures one"


def _bad_px4_channels(values: Mapping[str, float]) -> Iterator[str]:
    """Yield what ``RcCalibrationChecks`` finds wrong first."""
    if values.get("COM_RC_IN_MODE", 0.0) in _WITHOUT_STICKS:
        return
    for number in _PX4_CHANNELS:
        low, trim, high = (
            values.get(f"RC{number}_{end}", default)
            for end, default in (("MIN", 1000.0), ("TRIM", 1500.0), ("MAX", 2000.0))
        )
        for is_so, said in (
            (trim < low, f"RC{number}_TRIM is below RC{number}_MIN"),
            (trim > high, f"RC{number}_TRIM is above RC{number}_MAX"),
            (high > _MOST_PWM, f"RC{number}_MAX is above {_MOST_PWM}"),
        ):
            if is_so:
                yield said
                return
