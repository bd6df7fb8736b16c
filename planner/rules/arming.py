"""What keeps a vehicle from arming and stands in its parameters: one list for each autopilot.

After ``AP_Arming.cpp``, ``AP_Arming_Copter.cpp``, ``AP_MotorsMulticopter.cpp``, ``AC_Fence.cpp`` and
``AP_BattMonitor_Backend.cpp`` of ArduPilot 4.5 to 4.7.
"""

from __future__ import annotations

import math
import re
from collections import Counter
from itertools import pairwise
from typing import TYPE_CHECKING, NamedTuple

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.mission.commands import Command
from planner.mission.items import MissionFormat
from planner.mission.route.stage import StageKind
from planner.rules.declaration import ARDUPILOT, PX4, judges
from planner.rules.declaration import PARAMETERS as PARAMETERS_IN_USE
from planner.rules.fence_settings import AREAS, CIRCLE, fence_is_on

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping

    from planner.findings import Finding
    from planner.mission.items import Mission
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters
    from planner.vehicle.parameters.resolve import FlightParameters

ALWAYS, ANY, PARAMETERS, BATTERY, MISSION = None, -1, 1 << 5, 1 << 8, 1 << 14
"""Bits of ARMING_CHECK; ``ALWAYS`` is checked even where all checks are off, ``ANY`` where one is on."""
_ALL = 1
_MOST_SPIN_MIN = 0.3
"""Above it ArduPilot refuses MOT_SPIN_MIN. [-]"""
_LEAST_FAILSAFE_PWM = 910
"""Least FS_THR_VALUE: receivers lose their signal at 900. [µs]"""
_LEAST_FLOOR_M = -100.0
"""Least FENCE_ALT_MIN. [m]"""
_SATELLITES = 3
"""EK3_SRC1_POSXY of a position by satellites."""
_WITHOUT_THROTTLE = 2
"""Bit of AUTO_OPTIONS: takes off without a raised throttle."""
_COMPASS = 1
"""EK3_SRC1_YAW of a heading by compass."""
_SWITCHES = re.compile(r"RC\d+_OPTION")
_OPTIONS = 256
"""Values of RCx_OPTION from here on may repeat (``RC_Channels::duplicate_options_exist``)."""
_OUTPUTS, _OUTPUTS_OF_A_FILE = re.compile(r"SERVO\d+_FUNCTION"), 8
"""The outputs of a vehicle, and the least number of them: a file with fewer does not list them all."""
_FIRST_MOTOR = 33
"""SERVOx_FUNCTION of the first motor; the others follow."""
_MOTORS = {1: 4, 2: 6, 3: 8, 4: 8, 5: 6}
"""Motors by FRAME_CLASS: quad, hexa, octa, octa-quad, Y6."""


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
        for n in _SENSORS
        if values.get(f"RNGFND{n}_TYPE") and values.get(f"RNGFND{n}_ORIENT", _DOWN) == _DOWN
    ]
    return max(reaches_m, default=None)


class _Given(NamedTuple):
    """The parameters: those of flight in SI, any other as the file has it."""

    own: ArduPilotParameters
    values: dict[str, float]
    mission: Mission

    def value(self, *names: str, default: float) -> float:
        """Return the first of some names that the file holds, in its own unit."""
        return next((self.values[name] for name in names if name in self.values), default)

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
        if self.value("EK3_SRC1_YAW", default=_COMPASS) != _COMPASS:
            return self.values["EK3_SRC1_YAW"] == 0
        used = (self.value(f"COMPASS_USE{number}", default=1) for number in ("", 2, 3))
        return not (self.value("COMPASS_ENABLE", default=1) and any(used))

    def counted(self, pattern: re.Pattern[str]) -> Counter[int]:
        """Return how often each value is given to the parameters of a pattern."""
        return Counter(int(value) for name, value in self.values.items() if pattern.fullmatch(name))

    @property
    def motors_without_output(self) -> bool:
        """Whether a motor of the frame is on no output; not known where the file leaves outputs out."""
        motors = _MOTORS.get(int(self.value("FRAME_CLASS", default=0)), 0)
        given = self.counted(_OUTPUTS)
        return given.total() >= _OUTPUTS_OF_A_FILE and any(
            not given[number] for number in range(_FIRST_MOTOR, _FIRST_MOTOR + motors)
        )


def _both_above_0(low: float, critical: float) -> bool:
    return low > 0.0 and critical > 0.0 and critical >= low


_REFUSED: tuple[tuple[int | None, str, Callable[[_Given], bool]], ...] = (
    (ALWAYS, "FRAME_CLASS is 0", lambda p: p.value("FRAME_CLASS", default=1) == 0),
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
        "no satellites (GPS1_TYPE 0) and no other position",
        lambda p: (
            p.value("GPS1_TYPE", "GPS_TYPE", default=1) == 0
            and p.value("GPS2_TYPE", "GPS_TYPE2", default=0) == 0
            and p.value("EK3_SRC1_POSXY", default=_SATELLITES) == _SATELLITES
        ),
    ),
    (
        ALWAYS,
        "EK3_SRC1_POSXY is 0: no position",
        lambda p: p.value("EK3_SRC1_POSXY", default=_SATELLITES) == 0,
    ),
    (
        ALWAYS,
        "no heading: EK3_SRC1_YAW is 0, or 1 with no compass in use",
        lambda p: p.lacks_heading,
    ),
    (
        ALWAYS,
        "MOT_PWM_MIN is above MOT_PWM_MAX",
        lambda p: p.value("MOT_PWM_MIN", default=1000) > p.value("MOT_PWM_MAX", default=2000),
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
        PARAMETERS,
        "two RCx_OPTION are the same",
        lambda p: any(
            times > 1 for option, times in p.counted(_SWITCHES).items() if 0 < option < _OPTIONS
        ),
    ),
    (ALWAYS, "a motor of FRAME_CLASS is on no SERVOx_FUNCTION", lambda p: p.motors_without_output),
    (
        PARAMETERS,
        "ACRO_BAL_ROLL or ACRO_BAL_PITCH is negative",
        lambda p: min(p.value(f"ACRO_BAL_{axis}", default=1) for axis in ("ROLL", "PITCH")) < 0.0,
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
        "FENCE_MARGIN is above FENCE_RADIUS",
        lambda p: (
            p.has_fence
            and bool(p.own.fence_type & CIRCLE)
            and p.own.fence_radius_m < p.own.fence_margin_m
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

WOULD_NOT_ARM = Rule(
    "M127 would-not-arm",
    Severity.ERROR,
    summary="The vehicle would not arm with these parameters.",
    why="A vehicle that refuses to arm on the field costs the day; the reason stands in its parameter "
    "file the evening before.",
    how="PX4: SYS_HAS_GPS 0 or EKF2_GPS_CTRL without bit 0, and no EKF2_AGP_CTRL or EKF2_EV_CTRL: a mission "
    "needs a position (modeCheck.cpp).  ArduPilot, with ARMING_CHECK and ARMING_SKIPCHK as they are.  "
    "Always: FRAME_CLASS 0, "
    "MOT_SPIN_ARM above MOT_SPIN_MIN, MOT_SPIN_MIN above 0.3, GPS1_TYPE 0 with EK3_SRC1_POSXY 3 "
    "(satellites), EK3_SRC1_POSXY 0, EK3_SRC1_YAW 0, or 1 (compass) with COMPASS_ENABLE 0 or each "
    "COMPASS_USE 0, MOT_PWM_MIN above MOT_PWM_MAX, a motor of FRAME_CLASS 1 to 5 on none of eight "
    "SERVOx_FUNCTION or more.  Parameters: PILOT_SPEED_UP 0, FS_THR_VALUE below 910 or above RC3_MIN less "
    "11, two equal RCx_OPTION, ACRO_BAL_ROLL or _PITCH negative, RTL_ALT_TYPE 1 with TERRAIN_ENABLE 0 and no "
    "rangefinder.  "
    "A fence in use: FENCE_TYPE 0, or 4 without an area, FENCE_MARGIN at or above half of FENCE_ALT_MAX less "
    "FENCE_ALT_MIN, or above "
    "FENCE_RADIUS; FENCE_ALT_MIN below -100 m.  Battery: BATT_CRT_VOLT or "
    "BATT_CRT_MAH at or above BATT_LOW_VOLT or BATT_LOW_MAH (above it from 4.7 on), all above 0.",
    fix="correct the parameter on the vehicle",
    instead="the parameters of --params",
)


@judges(WOULD_NOT_ARM, needs=(ARDUPILOT,))
def _would_not_arm(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    given = _Given(parameters, numbers(a), a.mission)
    for check, said, is_so in _REFUSED:
        if is_checked(a, check) and is_so(given):
            yield a.finding(WOULD_NOT_ARM, f"ArduPilot does not arm: {said}")


@judges(WOULD_NOT_ARM, needs=(PX4,))
def _would_not_arm_px4(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    values = numbers(a)
    others = ("EKF2_AGP_CTRL", "EKF2_AGP0_CTRL", "EKF2_EV_CTRL")
    if any(values.get(name, 0.0) for name in others):
        return
    for name, default, off in (
        ("SYS_HAS_GPS", 1.0, "SYS_HAS_GPS is 0"),
        ("EKF2_GPS_CTRL", 7.0, "EKF2_GPS_CTRL takes no position from satellites"),
    ):
        if not int(values.get(name, default)) & 1:
            yield a.finding(
                WOULD_NOT_ARM,
                f"PX4 does not arm for a mission: {off}, and nothing else gives a position",
            )
            return


DISARMS_ON_THE_GROUND = Rule(
    "T121 disarms-on-the-ground",
    Severity.ERROR,
    summary="The vehicle disarms while it waits on the ground, and does not take off again.",
    why="It stands where it landed, away from home and with the mission broken off: tried in ArduPilot's "
    "simulation, 'Disarming motors' 10 s after the landing.",
    how="ArduPilot: NAV_DELAY of DISARM_DELAY (10 s) or more, or until a time of day, before a take-off, "
    "first or after a landing (Copter::auto_disarm_check); an error where AUTO_OPTIONS takes off without a "
    "raised throttle, a "
    "warning else: with the stick above zero it stays armed.  PX4: NAV_DELAY of COM_DISARM_PRFLT (10 s) "
    "or more before the first take-off.  Not where the delay of disarming is 0, on PX4 0 or less.",
    fix="wait less, or set the delay of disarming longer than the wait",
    instead="the parameters of --params",
)


@judges(DISARMS_ON_THE_GROUND, needs=(PARAMETERS_IN_USE,))
def _disarms_on_the_ground(a: Assessment, _parameters: FlightParameters) -> Iterator[Finding]:
    values, is_px4 = numbers(a), PX4.of(a) is not None
    name = "COM_DISARM_PRFLT" if is_px4 else "DISARM_DELAY"
    after_s = values.get(name, 10.0)
    waits = [_wait_before_takeoff(a)]
    if not is_px4:
        waits += [
            (stage.hold_s + _wait_for_the_clock_s(a, range(stage.item + 1, then.item)), stage.item)
            for stage, then in pairwise(a.route.stages)
            if stage.kind in {StageKind.LAND, StageKind.RETURN}
        ]
    longest_s, item = max(waits)
    if not 0.0 < after_s <= longest_s:
        return
    is_certain = is_px4 or bool(int(values.get("AUTO_OPTIONS", 0)) & _WITHOUT_THROTTLE)
    lasts = quantity.duration(longest_s) if longest_s < math.inf else "until a time of day"
    stick = "" if is_certain else ", unless the throttle stick is held above zero"
    yield a.finding(
        DISARMS_ON_THE_GROUND,
        f"waits {lasts} on the ground: the vehicle disarms after "
        f"{quantity.duration(after_s)} ({name}) and does not take off{stick}",
        item=item,
        severity=None if is_certain else Severity.WARNING,
    )


def _wait_before_takeoff(a: Assessment) -> tuple[float, int]:
    """Return the time of the delays before the first stage, and the last of their items."""
    first, wait_s, last = a.route.stages[0].item, 0.0, 1
    for number in a.route.reached:
        item = a.mission.items[number - 1]
        if number == first:
            break
        if item.command == Command.NAV_DELAY and (item.param1 or 0.0) > 0.0:
            wait_s, last = wait_s + (item.param1 or 0.0), number
        clock_s = _wait_for_the_clock_s(a, [number])
        if clock_s and a.autopilot is not Autopilot.PX4:
            wait_s, last = clock_s, number
    return wait_s, last


def _wait_for_the_clock_s(a: Assessment, numbered: Iterable[int]) -> float:
    """Return the longest that items wait until a time of day: without end, or not at all."""
    reached = set(a.route.reached)
    for number in numbered:
        item = a.mission.items[number - 1]
        clock = (item.param2, item.param3, item.param4)
        if (
            number in reached
            and item.command == Command.NAV_DELAY
            and (item.param1 or 0.0) <= 0.0
            and any(part is not None and part >= 0.0 for part in clock)
        ):
            return math.inf
    return 0.0


def is_checked(a: Assessment, check: int | None) -> bool:
    """Return whether ArduPilot makes one of its arming checks: ARMING_SKIPCHK or ARMING_CHECK."""
    if check is ALWAYS:
        return True
    values = numbers(a)
    skipped = int(values.get("ARMING_SKIPCHK", 0))
    made = int(values.get("ARMING_CHECK", _ALL))
    if skipped == -1 or made == 0:
        return False
    return check == ANY or (not skipped & check and bool(made & (_ALL | check)))


def numbers(a: Assessment) -> dict[str, float]:
    """Return every parameter of --params that holds a number, in its own unit."""
    return {} if a.setup.parameters is None else a.setup.parameters.numbers()
