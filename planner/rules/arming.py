"""Rules on arming: what keeps a vehicle from it, and what disarms it before it takes off."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.route.route import OTHER_VEHICLE
from planner.mission.route.state import ITEM_NOT_MODELLED
from planner.rules.arming_checks import (
    ALWAYS,
    ANY,
    ROTORS_WITH_FLAPS,
    ArduPilotGiven,
    refused_by_ardupilot,
    refused_by_px4,
)
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, PX4, NotEvaluated, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters

_ALL = 1
_ARMS_IN_AUTO = 1
"""Bit of AUTO_OPTIONS: arms in AUTO, in which the mission has begun by then."""
_WITHOUT_THROTTLE = 2
"""Bit of AUTO_OPTIONS: takes off without a raised throttle."""
_UNSURE_S = 0.5
"""The check is made ten times a second (flown: 0.1 s are enough), and arming itself takes a moment. [s]"""
_WARNED_WITHIN_S = 1.0
_HERE_M = 1.0
"""A home so near to where the vehicle stands is there. [m]"""
_FLIES_BLIND = (4, 7)
"""The version from which on ArduPilot arms without a source of the height; tried in its simulation.  Its
estimator takes the height for constant then (``NavEKF3_core::selectHeightForFusion``)."""


WOULD_NOT_ARM = Rule(
    "M127 would-not-arm",
    Severity.ERROR,
    summary="The vehicle would not arm with these parameters.",
    why="A vehicle that refuses to arm on the field costs the day; the reason stands in its parameter "
    "file the evening before.",
    how="PX4: COM_ARMABLE 0; COM_HOME_EN 0 (without a home it refuses heights above home, and never "
    "returns); SYS_HAS_GPS 0 or EKF2_GPS_CTRL without bit 0, and no EKF2_AGP_CTRL or EKF2_EV_CTRL: a mission "
    "needs a position (modeCheck.cpp); SYS_HAS_MAG 0 or EKF2_MAG_TYPE 5, and bit 3 in neither EKF2_GPS_CTRL "
    "nor EKF2_EV_CTRL: no position without a heading (tried in PX4's simulation); no height (EKF2_BARO_CTRL "
    "or SYS_HAS_BARO 0, bit 1 in neither of these two, EKF2_RNG_CTRL 0: tried); CAL_ACCn_ID, CAL_GYROn_ID "
    "or, with SYS_HAS_MAG, CAL_MAGn_ID all 0; EKF2_EN 0 without LPE_EN (no position in PX4's simulation); a "
    "receiver (COM_RC_IN_MODE not 1 or 4) with RCn_TRIM not between RCn_MIN and RCn_MAX, or that above "
    "2500.  ArduPilot, with ARMING_CHECK and ARMING_SKIPCHK as they are.  Always: EK3_SRC1_POSZ 0 (from 4.7 "
    "on ArduPilot arms, and measures no height), FRAME_CLASS of no multicopter, FRAME_TYPE that FRAME_CLASS "
    "1 to 4, 12 or 14 has not (each tried in ArduPilot's simulation), MOT_SPIN_ARM above MOT_SPIN_MIN, "
    "MOT_SPIN_MIN above 0.3, AHRS_EKF_TYPE 0, or 2 or 3 with EK2_ENABLE or EK3_ENABLE 0, or EK2_IMU_MASK or "
    "EK3_IMU_MASK 0, EK3_SRCn_ of a sensor that is not there (GPS1_TYPE, FLOW_TYPE, VISO_TYPE, BCN_TYPE, "
    "WENC_TYPE 0, no rangefinder that looks down), EK3_SRC1_POSXY 0, EK3_MAG_CAL 5 or 6 with EK3_SRC1_YAW 1 "
    "(compass), EK3_SRC1_YAW 0 or 8, 1 with COMPASS_ENABLE 0 or each COMPASS_USE 0, 2 with GPSn_TYPE 0 to 2, "
    "INS_ENABLE_MASK 0 or each INS_USE 0, ESC_CALIBRATION 2 or 3, GPS_AUTO_SWITCH 0 with GPS_PRIMARY 1 and "
    "GPS2_TYPE 0, MOT_PWM_MIN below 1 or not "
    "below MOT_PWM_MAX, a motor of FRAME_CLASS 1 to 5, 7, 12 or 14 on none of eight SERVOx_FUNCTION or more, "
    "RCx_OPTION 32 with 31 or 165, SERIALn_PROTOCOL 23 twice; an output in use with SERVOx_TRIM not between "
    "its MIN and MAX.  Receiver: of channels 1 to 8 RCx_TRIM not between RCx_MIN and RCx_MAX, of the sticks "
    "RCx_MIN above 1300 or RCx_MAX below 1700.  INS_ACCOFFS_ all 0, or those of a second or third "
    "accelerometer with an ID.  Compass, where COMPASS_USE is on and COMPASS_LEARN not 3: COMPASS_OFS_ all 0 "
    "of one in use, or of the first beyond COMPASS_OFFS_MAX (1800); each COMPASS_DEV_ID 0.  Parameters: "
    "PILOT_SPEED_UP 0, FS_THR_VALUE below 910 or above RC3_MIN less 11, two equal RCx_OPTION, ACRO_BAL_ROLL "
    "or _PITCH negative or above ATC_ANG_RLL_P or _PIT_P, a gain PSC_ or ATC_ that must be above 0, a "
    "parachute by servo without SERVOx_FUNCTION 27, by relay without RELAYn_FUNCTION 2, ANGLE_MAX below 10° "
    "or above 80°, RTL_ALT_TYPE 1 with TERRAIN_ENABLE 0 and no rangefinder.  A fence in use: FENCE_TYPE 0, "
    "or 4 without an area, FENCE_MARGIN at or above half of FENCE_ALT_MAX less FENCE_ALT_MIN, "
    "FENCE_MARGIN_XY (0: FENCE_MARGIN) above FENCE_RADIUS or the radius of an inclusion circle; "
    "FENCE_ALT_MIN below -100 m.  Battery: BATT_CRT_VOLT or BATT_CRT_MAH at or above BATT_LOW_VOLT or "
    "BATT_LOW_MAH (above it from 4.7 on), all above 0.",
    fix="correct the parameter on the vehicle",
    instead="the parameters of --params",
)


@judges(WOULD_NOT_ARM, needs=(ARDUPILOT,))
def _would_not_arm(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    given = ArduPilotGiven(parameters, numbers(a), a.mission)
    for check, said in refused_by_ardupilot(given):
        if is_checked(a, check):
            yield a.finding(WOULD_NOT_ARM, f"ArduPilot does not arm: {said}")
    if given.has_no_height:
        is_refused = a.target is not None and a.target.version and a.target.version < _FLIES_BLIND
        does = (
            "does not arm"
            if is_refused
            else "before 4.7 does not arm, later ones measure no height"
        )
        yield a.finding(WOULD_NOT_ARM, f"EK3_SRC1_POSZ is 0: ArduCopter {does}")


@judges(OTHER_VEHICLE, needs=(ARDUPILOT,))
def _other_vehicle(a: Assessment, _parameters: ArduPilotParameters) -> Iterator[Finding]:
    frame = int(numbers(a).get("FRAME_CLASS", 1))
    if (other := ROTORS_WITH_FLAPS.get(frame)) is not None:
        yield a.finding(
            OTHER_VEHICLE,
            f"FRAME_CLASS is {frame}, {other}: its outputs are not checked, nor that the model is one of it",
            severity=Severity.WARNING,
            fix="use a model of this vehicle, and check its outputs by hand",
        )


@judges(WOULD_NOT_ARM, needs=(PX4,))
def _would_not_arm_px4(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    for said in refused_by_px4(numbers(a)):
        yield a.finding(WOULD_NOT_ARM, f"PX4 does not arm: {said}")


TAKEOFF_BLOCKED = Rule(
    "M131 takeoff-blocked",
    Severity.ERROR,
    summary="The vehicle arms and stays on the ground.",
    why="ArduPilot arms, says 'Takeoff blocked: ESC RPM too low' and stands on the ground with the mission "
    "begun (AP_Vehicle::motors_takeoff_check); PX4 waits with its motors off until it is thrown.",
    how="DISARM_DELAY of less than 0.5 s more than MOT_SPOOL_TIME and 2 s, or MOT_SAFE_TIME with "
    "MOT_SAFE_DISARM where that is more, and AUTO_OPTIONS takes off without a raised throttle: disarmed on "
    "the ground before the motors are up (flown with 3 s and MOT_SPOOL_TIME 1, not with 0.9; with 4 and 2, "
    "not 1.9); less than 1 s more is a warning, and where the throttle is raised by hand, which keeps it "
    "armed.  MOT_SPOOL_TIME at or above DISARM_DELAY is an error in any case.  TKOFF_RPM_MIN above 0 with no "
    "source of telemetry from the motors' controllers: no SERIALn_PROTOCOL of 16 or 38, SERVO_BLH_BDMASK 0, "
    "no CAN_Pn_DRIVER, SIM_ESC_TELEM not 1; not checked (X904) in a file that names no serial port; with "
    "telemetry a warning: how fast the motors turn at MOT_SPIN_MIN is not known.  Or TKOFF_RPM_MAX above 0 "
    "and below TKOFF_RPM_MIN.  PX4: COM_THROW_EN is 1 (flown: 160 s on the ground).",
    fix="set TKOFF_RPM_MIN to 0, or connect and set up the telemetry",
    instead="the parameters of --params",
)
_TELEMETRY_PORTS = frozenset({16, 38})
"""SERIALn_PROTOCOL of telemetry from motor controllers, and of FETtec's."""
_PORT = r"SERIAL\d+_PROTOCOL"
_TELLS_SPEEDS = r"SERVO_BLH_BDMASK|CAN_P\d_DRIVER|SIM_ESC_TELEM"


@judges(TAKEOFF_BLOCKED, needs=(ARDUPILOT,))
def _takeoff_blocked(
    a: Assessment, _parameters: ArduPilotParameters
) -> Iterator[Finding | NotEvaluated]:
    values = numbers(a)
    least, most = values.get("TKOFF_RPM_MIN", 0.0), values.get("TKOFF_RPM_MAX", 0.0)
    if least <= 0.0:
        return
    ports = {int(value) for name, value in values.items() if re.fullmatch(_PORT, name)}
    is_told = any(value and re.fullmatch(_TELLS_SPEEDS, name) for name, value in values.items())
    asked = f"TKOFF_RPM_MIN is {least:g}"
    if 0.0 < most < least:
        yield a.finding(
            TAKEOFF_BLOCKED, f"{asked} and TKOFF_RPM_MAX {most:g}: ArduPilot never takes off"
        )
    elif is_told or ports & _TELEMETRY_PORTS:
        yield a.finding(
            TAKEOFF_BLOCKED,
            f"{asked}: ArduPilot takes off only if the motors turn as fast at MOT_SPIN_MIN, which is not "
            "known here, else says 'Takeoff blocked: ESC RPM out of range' and disarms",
            severity=Severity.WARNING,
            fix="measure their speed at MOT_SPIN_MIN, and set TKOFF_RPM_MIN below it",
        )
    elif ports:
        message = f"{asked}: without telemetry from the motors ArduPilot never takes off"
        yield a.finding(TAKEOFF_BLOCKED, message)
    else:
        yield NotEvaluated(
            rule=TAKEOFF_BLOCKED,
            asked_by=f"TKOFF_RPM_MIN of {least:g}",
            needs="the parameters that say whether motors tell their speeds: SERIALn_PROTOCOL, "
            "SERVO_BLH_BDMASK",
        )


@judges(TAKEOFF_BLOCKED, needs=(ARDUPILOT,))
def _disarmed_before(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield a delay that is over before the motors are: ``Copter::auto_disarm_check`` counts from arming.

    Until they leave ``GROUND_IDLE``, 2 s of ``ap.in_arming_delay`` and MOT_SPOOL_TIME later, or the throttle
    is raised.  What comes then, such as TKOFF_SLEW_TIME, does not count (flown).
    """
    values = numbers(a)
    spools_s, delay_s = parameters.spool_up_s, values.get("DISARM_DELAY", 10.0)
    ready_s = spools_s + parameters.held_back_s
    if not 0.0 < delay_s < ready_s + _WARNED_WITHIN_S:
        return
    by_itself = bool(int(values.get("AUTO_OPTIONS", 0)) & _WITHOUT_THROTTLE)
    is_sure = delay_s <= spools_s or (by_itself and delay_s < ready_s + _UNSURE_S)
    may_be = "may disarm" if by_itself and not is_sure else "disarms"
    stick = "" if by_itself or is_sure else ", unless the throttle stick is raised before"
    yield a.finding(
        TAKEOFF_BLOCKED,
        f"the motors are up {quantity.duration(ready_s)} after arming (MOT_SPOOL_TIME): ArduPilot {may_be} "
        f"on the ground after {quantity.duration(delay_s)} (DISARM_DELAY){stick}",
        severity=None if is_sure else Severity.WARNING,
        fix="set DISARM_DELAY to 10 and MOT_SPOOL_TIME to 0.5, their defaults",
    )


@judges(TAKEOFF_BLOCKED, needs=(PX4,))
def _waits_to_be_thrown(a: Assessment, _parameters: Px4Parameters) -> Iterator[Finding]:
    if numbers(a).get("COM_THROW_EN") == 1.0:
        yield a.finding(
            TAKEOFF_BLOCKED,
            "COM_THROW_EN is 1: PX4 arms with its motors off and waits to be thrown up; a take-off from the "
            "ground is predicted",
            fix="set COM_THROW_EN to 0",
        )


@judges(ITEM_NOT_MODELLED, needs=(ARDUPILOT,))
def _homes_set_before_arming(a: Assessment, _parameters: ArduPilotParameters) -> Iterator[Finding]:
    """Yield a home set before the take-off: arming moves it back where the mission has begun by then.

    ``AP_Arming_Copter::arm``: "Reset home position if it has already been set before (but not locked)".
    """
    if not int(numbers(a).get("AUTO_OPTIONS", 0)) & _ARMS_IN_AUTO:
        return
    for home in a.route.moved_homes:
        is_away = math.hypot(home.east_m, home.north_m) > _HERE_M or abs(home.datum_m) > _HERE_M
        if home.first_stage == 0 and is_away:
            yield a.finding(
                ITEM_NOT_MODELLED,
                "DO_SET_HOME before the take-off: armed in AUTO, as AUTO_OPTIONS allows, ArduPilot carries "
                "it out before it arms, and arming sets home where the vehicle stands; armed in another "
                "mode it counts",
                severity=Severity.ERROR,
                item=home.item,
                fix="put DO_SET_HOME behind the take-off",
            )


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
