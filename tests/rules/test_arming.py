"""What keeps ArduPilot from arming and stands in its parameters, with the checks that are on."""

from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint
from rule_cases.case import ARDUPILOT, PLAIN, PX4, STEP, found

from planner.autopilot import Target
from planner.findings import Severity

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.mission.items import MissionItem

NO_COMPASS = "CAL_MAG0_ID,0\nCAL_MAG1_ID,0\nCAL_MAG2_ID,0\nCAL_MAG3_ID,0\n"
OUTSIDE = "EK3_SRC1_POSXY,6\nEK3_SRC1_VELXY,6\nEK3_SRC1_POSZ,1\nEK3_SRC1_VELZ,6\nEK3_SRC1_YAW,6\n"
COMPASSES = "COMPASS_DEV_ID,1\nCOMPASS_DEV_ID2,2\nCOMPASS_DEV_ID3,0\n"
FENCE = "FENCE_ENABLE,1\nFENCE_TYPE,7\nFENCE_RADIUS,1000\nFENCE_ALT_MAX,120\n"


# Flown in ArduPilot's SITL: armed in AUTO it returns to where it took off, armed in LOITER to the home set.
@pytest.mark.parametrize(
    ("options", "to_m", "before", "is_told"),
    [
        (1, 150.0, True, True),
        (3, 150.0, True, True),
        (2, 150.0, True, False),
        (1, 0.5, True, False),
        (1, 150.0, False, False),
    ],
)
def test_a_home_set_before_a_vehicle_arms_in_auto_is_set_back_by_that(
    options: int, to_m: float, *, before: bool, is_told: bool
) -> None:
    home, up = item(179, north(to_m), 0.0), takeoff(20)
    legs = (home, up) if before else (up, home)
    one = mission(*legs, waypoint(150, 20), rtl())
    told = [f for f in found(one, ARDUPILOT, f"AUTO_OPTIONS,{options}\n") if f.code == "T102"]
    assert [f.severity for f in told if "armed in AUTO" in f.message] == [Severity.ERROR] * is_told


def refuses(parameters: str, code: str = "M127") -> bool:
    return code in {one.code for one in found(PLAIN, ARDUPILOT, parameters)}


def offsets(compass: str, *values_mgauss: float) -> str:
    return "".join(
        f"COMPASS_OFS{compass}_{axis},{value:g}\n"
        for axis, value in zip("XYZ", values_mgauss, strict=True)
    )


def outputs(frame_class: float, *functions: int) -> str:
    """Return the eight outputs of a vehicle, those not named without a function."""
    given = dict.fromkeys(range(1, 9), 0) | dict(enumerate(functions, start=1))
    rows = "".join(f"SERVO{number}_FUNCTION,{function}\n" for number, function in given.items())
    return f"FRAME_CLASS,{frame_class:g}\n{rows}"


@pytest.mark.parametrize(("frame", "is_told"), [(7, False), (8, True), (10, True), (12, False)])
def test_rotors_with_flaps_or_tilt_are_told(frame: int, *, is_told: bool) -> None:
    told = [
        one.severity
        for one in found(PLAIN, ARDUPILOT, f"FRAME_CLASS,{frame}\n")
        if one.code == "M111"
    ]
    assert told == [Severity.WARNING] * is_told


# Each condition as the source has it: one value that it refuses, the nearest that it takes.
@pytest.mark.parametrize(
    ("refused", "taken"),
    [
        ("FRAME_CLASS,0\n", "FRAME_CLASS,1\n"),
        ("MOT_SPIN_ARM,0.16\nMOT_SPIN_MIN,0.15\n", "MOT_SPIN_ARM,0.15\nMOT_SPIN_MIN,0.15\n"),
        ("MOT_SPIN_MIN,0.31\n", "MOT_SPIN_MIN,0.3\n"),
        ("PILOT_SPEED_UP,0\n", "PILOT_SPEED_UP,1\n"),
        ("GPS1_TYPE,0\n", "GPS1_TYPE,0\nGPS2_TYPE,1\n"),
        ("GPS_TYPE,0\n", f"GPS1_TYPE,0\nVISO_TYPE,1\n{OUTSIDE}"),
        # From here to RC2_MAX tried in ArduPilot's simulation, with the sentences of the source.
        ("AHRS_EKF_TYPE,0\n", "AHRS_EKF_TYPE,3\n"),
        ("EK3_SRC1_VELZ,1\n", "EK3_SRC1_VELZ,0\n"),
        ("EK3_SRC1_POSZ,5\n", "EK3_SRC1_POSZ,1\n"),
        ("EK3_SRC1_POSZ,0\n", "EK3_SRC1_POSZ,0\nAHRS_EKF_TYPE,11\n"),
        ("EK3_SRC1_POSZ,2\n", "EK3_SRC1_POSZ,2\nRNGFND2_TYPE,8\n"),
        ("EK3_SRC2_VELXY,5\n", "EK3_SRC2_VELXY,5\nFLOW_TYPE,1\n"),
        ("EK3_SRC3_POSXY,6\n", "EK3_SRC3_POSXY,6\nVISO_TYPE,1\n"),
        ("EK3_SRC3_YAW,4\n", "EK3_SRC3_YAW,4\nAHRS_EKF_TYPE,11\n"),
        ("EK3_SRC2_POSXY,4\n", "EK3_SRC2_POSXY,4\nBCN_TYPE,1\n"),
        ("RC7_OPTION,32\nRC8_OPTION,31\n", "RC7_OPTION,32\nRC8_OPTION,30\n"),
        ("RC7_OPTION,32\nRC8_OPTION,165\n", "RC7_OPTION,31\nRC8_OPTION,165\n"),
        ("SERIAL2_PROTOCOL,23\nSERIAL7_PROTOCOL,23\n", "SERIAL2_PROTOCOL,23\n"),
        ("FRAME_CLASS,6\n", "FRAME_CLASS,5\n"),
        ("FRAME_CLASS,99\n", "FRAME_CLASS,15\n"),
        ("FRAME_CLASS,1\nFRAME_TYPE,10\n", "FRAME_CLASS,5\nFRAME_TYPE,10\n"),
        ("FRAME_CLASS,2\nFRAME_TYPE,12\n", "FRAME_CLASS,4\nFRAME_TYPE,12\n"),
        ("FRAME_CLASS,1\nFRAME_TYPE,99\n", "FRAME_CLASS,7\nFRAME_TYPE,99\n"),
        ("FRAME_CLASS,12\nFRAME_TYPE,3\n", "FRAME_CLASS,3\nFRAME_TYPE,3\n"),
        (outputs(7, 33, 34, 36), outputs(7, 33, 34, 36, 39)),
        (outputs(12, *range(33, 41), 82, 83, 84, 0), outputs(12, *range(33, 41), 82, 83, 84, 85)),
        (outputs(14, *range(33, 43)), outputs(14, *range(33, 41), 82, 83)),
        (outputs(14, *range(33, 37), 0, 0, 0, 0, 0, 0), outputs(10)),
        ("FRAME_CLASS,14\nFRAME_TYPE,2\n", "FRAME_CLASS,7\nFRAME_TYPE,2\n"),
        ("EK3_MAG_CAL,5\n", "EK3_MAG_CAL,3\n"),
        (offsets("", 0, 0, 0), offsets("", 0, 0, 0.1)),
        (offsets("", 0, 0, 0), f"{offsets('', 0, 0, 0)}COMPASS_LEARN,3\n"),
        (offsets("", 0, 0, 0), f"{offsets('2', 0, 0, 0)}COMPASS_DEV_ID2,0\n"),
        (f"{COMPASSES}{offsets('2', 0, 0, 0)}", f"{COMPASSES}{offsets('3', 0, 0, 0)}"),
        (
            f"{COMPASSES}{offsets('2', 0, 0, 0)}",
            f"{COMPASSES}{offsets('2', 0, 0, 0)}COMPASS_USE2,0\n",
        ),
        # The second device is the first in order: COMPASS_USE2 is of the other.
        (
            f"{COMPASSES}COMPASS_PRIO1_ID,2\n{offsets('2', 0, 0, 0)}COMPASS_USE2,0\n",
            f"{COMPASSES}COMPASS_PRIO1_ID,1\n{offsets('2', 0, 0, 0)}COMPASS_USE2,0\n",
        ),
        (offsets("", 1801, 0, 0), offsets("", 1800, 0, 0)),
        (offsets("", 1200, 1200, 1200), offsets("", 1039, 1039, 1039)),  # 1800 / √3 = 1039.2
        (f"{offsets('', 851, 0, 0)}COMPASS_OFFS_MAX,850\n", offsets("", 851, 0, 0)),
        (
            "COMPASS_DEV_ID,0\nCOMPASS_DEV_ID2,0\nCOMPASS_DEV_ID3,0\n",
            "COMPASS_DEV_ID,0\nCOMPASS_DEV_ID2,1\nCOMPASS_DEV_ID3,0\n",
        ),
        (
            "INS_ACC2_ID,1\nINS_ACC2OFFS_X,0\nINS_ACC2OFFS_Y,0\nINS_ACC2OFFS_Z,0\n",
            "INS_ACC2_ID,0\nINS_ACC2OFFS_X,0\nINS_ACC2OFFS_Y,0\nINS_ACC2OFFS_Z,0\n",
        ),
        ("ANGLE_MAX,999\n", "ANGLE_MAX,1000\n"),
        ("ANGLE_MAX,999\nPSC_ANGLE_MAX,20\n", "PSC_ANGLE_MAX,9\n"),
        ("ANGLE_MAX,8001\n", "ANGLE_MAX,8000\n"),
        (
            "CHUTE_ENABLED,1\nRELAY1_FUNCTION,1\n",
            "CHUTE_ENABLED,1\nRELAY1_FUNCTION,1\nRELAY2_FUNCTION,2\n",
        ),
        ("ACRO_BAL_ROLL,4.6\n", "ACRO_BAL_ROLL,4.5\n"),
        ("ACRO_BAL_PITCH,1\nATC_ANG_PIT_P,0.9\n", "ACRO_BAL_ROLL,1\nATC_ANG_PIT_P,1\n"),
        ("PSC_VELZ_P,0\n", "PSC_VELZ_P,0.1\n"),
        ("PSC_D_VEL_P,0\n", "PSC_D_VEL_P,0.1\nPSC_VELZ_P,0\n"),
        ("ATC_ANG_YAW_P,0\n", "ATC_ANG_YAW_P,0.1\n"),
        ("ATC_RAT_RLL_P,0\n", "ATC_RAT_RLL_P,0\nATC_RAT_RLL_FF,0.1\n"),
        ("ATC_RAT_PIT_I,-0.1\nATC_RAT_PIT_FF,0.1\n", "ATC_RAT_PIT_D,0\n"),
        ("ATC_RAT_YAW_D,-0.1\n", "ATC_RAT_YAW_D,0\n"),
        (
            f"CHUTE_ENABLED,1\nCHUTE_TYPE,10\n{outputs(1, 33, 34, 35, 36)}",
            f"CHUTE_ENABLED,1\nCHUTE_TYPE,10\n{outputs(1, 33, 34, 35, 36, 27)}",
        ),
        (
            f"CHUTE_ENABLED,1\nCHUTE_TYPE,10\n{outputs(1, 33, 34, 35, 36)}",
            f"CHUTE_ENABLED,0\nCHUTE_TYPE,10\n{outputs(1, 33, 34, 35, 36)}",
        ),
        (
            "INS_ACCOFFS_X,0\nINS_ACCOFFS_Y,0\nINS_ACCOFFS_Z,0\n",
            "INS_ACCOFFS_X,0\nINS_ACCOFFS_Y,0\nINS_ACCOFFS_Z,0.001\n",
        ),
        ("RC5_MIN,1501\n", "RC5_MIN,1500\n"),
        ("RC1_TRIM,900\n", "RC1_TRIM,1100\n"),
        ("RC1_MAX,1800\nRC1_TRIM,1801\n", "RC1_MAX,1800\nRC1_TRIM,1800\n"),
        ("RC2_MAX,1699\n", "RC5_MAX,1699\n"),
        ("RC8_MIN,1501\n", "RC9_MIN,1501\n"),  # its receiver had eight channels
        ("RC4_MIN,1301\n", "RC4_MIN,1300\n"),
        ("RC5_MIN,1301\nRCMAP_YAW,5\n", "RC4_MIN,1301\nRCMAP_YAW,5\n"),
        ("SERVO9_FUNCTION,7\nSERVO9_MIN,1501\n", "SERVO9_FUNCTION,0\nSERVO9_MIN,1501\n"),
        ("SERVO1_FUNCTION,33\nSERVO1_MAX,1499\n", "SERVO1_FUNCTION,33\nSERVO1_MAX,1500\n"),
        ("EK3_SRC1_POSXY,0\n", "EK3_SRC1_POSXY,3\n"),
        ("PILOT_SPD_UP,0\n", "PILOT_SPD_UP,0.5\n"),
        ("FS_THR_VALUE,909\n", "FS_THR_VALUE,910\n"),
        ("FS_THR_VALUE,909\n", "FS_THR_VALUE,909\nFS_THR_ENABLE,0\n"),
        # The first three tried in ArduPilot's simulation: "Need Position Estimate", never armed.
        ("EK3_SRC1_YAW,0\n", "EK3_SRC1_YAW,3\n"),
        ("COMPASS_ENABLE,0\n", "COMPASS_ENABLE,0\nEK3_SRC1_YAW,2\nGPS_TYPE,17\nGPS_TYPE2,18\n"),
        # Tried with receivers that tell no heading: "Need Position Estimate".
        ("EK3_SRC1_YAW,2\n", "EK3_SRC1_YAW,2\nGPS1_TYPE,1\nGPS2_TYPE,26\n"),
        ("EK3_SRC1_YAW,8\n", "EK3_SRC1_YAW,6\nVISO_TYPE,1\n"),
        ("COMPASS_ENABLE,0\nEK3_SRC1_YAW,3\n", "EK3_SRC1_YAW,3\n"),
        # Tried: "EKF attitude is bad"; never starts; calibrates; "GPS 1: not healthy".
        ("INS_USE,0\nINS_USE2,0\nINS_USE3,0\n", "INS_USE,0\nINS_USE2,0\n"),
        ("INS_ENABLE_MASK,0\n", "INS_ENABLE_MASK,1\n"),
        ("ESC_CALIBRATION,3\n", "ESC_CALIBRATION,1\n"),
        ("ESC_CALIBRATION,2\n", "ESC_CALIBRATION,9\n"),
        ("GPS_AUTO_SWITCH,0\nGPS_PRIMARY,1\n", "GPS_AUTO_SWITCH,1\nGPS_PRIMARY,1\n"),
        (
            "GPS_AUTO_SWITCH,0\nGPS_PRIMARY,1\nGPS_TYPE2,0\n",
            "GPS_AUTO_SWITCH,0\nGPS_PRIMARY,1\nGPS_TYPE2,2\n",
        ),
        (
            "COMPASS_USE,0\nCOMPASS_USE2,0\nCOMPASS_USE3,0\n",
            "COMPASS_USE,0\nCOMPASS_USE2,0\nCOMPASS_USE3,1\n",
        ),
        ("MOT_PWM_MIN,2000\nMOT_PWM_MAX,1000\n", "MOT_PWM_MIN,1000\nMOT_PWM_MAX,2000\n"),
        ("MOT_PWM_MIN,2000\nMOT_PWM_MAX,2000\n", "MOT_PWM_MIN,1999\nMOT_PWM_MAX,2000\n"),
        ("MOT_PWM_MIN,0\n", "MOT_PWM_MIN,1\n"),
        ("EK3_ENABLE,0\n", "EK3_ENABLE,0\nAHRS_EKF_TYPE,2\nEK2_ENABLE,1\n"),
        ("AHRS_EKF_TYPE,2\n", "AHRS_EKF_TYPE,2\nEK2_ENABLE,1\n"),
        # Tried: "EKF attitude is bad", "Need Alt Estimate", never armed.
        ("EK3_IMU_MASK,0\n", "EK3_IMU_MASK,1\n"),
        (
            "AHRS_EKF_TYPE,2\nEK2_ENABLE,1\nEK2_IMU_MASK,0\n",
            "AHRS_EKF_TYPE,2\nEK2_ENABLE,1\nEK3_IMU_MASK,0\n",
        ),
        ("FS_THR_VALUE,975\nRC3_MIN,985\n", "FS_THR_VALUE,975\nRC3_MIN,986\n"),
        ("RC3_MIN,900\n", "RC3_MIN,900\nRCMAP_THROTTLE,1\n"),
        ("RC7_OPTION,9\nRC8_OPTION,9\n", "RC7_OPTION,9\nRC8_OPTION,10\n"),
        ("RC7_OPTION,255\nRC8_OPTION,255\n", "RC7_OPTION,256\nRC8_OPTION,256\n"),
        ("RC7_OPTION,9\nRC8_OPTION,9\n", "RC7_OPTION,0\nRC8_OPTION,0\n"),
        # Flown: "Mode channel and RC5_OPTION conflict", never armed; without the check of RC it flies.
        ("RC5_OPTION,9\n", "RC9_OPTION,9\n"),
        ("FLTMODE_CH,7\nRC7_OPTION,9\n", "FLTMODE_CH,0\nRC5_OPTION,9\n"),
        ("RC5_OPTION,9\nARMING_SKIPCHK,0\n", "RC5_OPTION,9\nARMING_SKIPCHK,64\n"),
        (outputs(1, 33, 34, 35, 33), outputs(1, 36, 34, 35, 33)),
        (outputs(2, 33, 34, 35, 36), outputs(2, 33, 34, 35, 36, 37, 38)),
        (outputs(1, 33, 34, 35), "FRAME_CLASS,1\nSERVO1_FUNCTION,33\n"),
        ("ACRO_BAL_ROLL,-0.1\n", "ACRO_BAL_ROLL,0\n"),
        ("RTL_ALT_TYPE,1\nTERRAIN_ENABLE,0\n", "RTL_ALT_TYPE,1\nTERRAIN_ENABLE,1\n"),
        (
            "RTL_ALT_TYPE,1\nTERRAIN_ENABLE,0\n",
            "RTL_ALT_TYPE,1\nTERRAIN_ENABLE,0\nRNGFND1_TYPE,8\nRNGFND1_MAX_CM,1500\n",
        ),
        # It looks forward, or is not used to follow the ground, or reaches less far than RTL_ALT, 15 m.
        (
            "RTL_ALT_TYPE,1\nTERRAIN_ENABLE,0\nRNGFND1_TYPE,8\nRNGFND1_ORIENT,0\n",
            "RTL_ALT_TYPE,1\nRNGFND1_TYPE,8\nRNGFND1_ORIENT,0\n",
        ),
        (
            "RTL_ALT_TYPE,1\nTERRAIN_ENABLE,0\nRNGFND1_TYPE,8\nWPNAV_RFND_USE,0\n",
            "RTL_ALT_TYPE,1\nRNGFND1_TYPE,8\nWPNAV_RFND_USE,0\n",
        ),
        (
            "RTL_ALT_TYPE,1\nRNGFND1_TYPE,8\nRNGFND1_MAX_CM,1499\n",
            "RTL_ALT_TYPE,1\nRNGFND1_TYPE,8\nRNGFND1_MAX_CM,1500\n",
        ),
        # 120 less -10 are 130: half of it is 65.
        (f"{FENCE}FENCE_MARGIN,65\n", f"{FENCE}FENCE_MARGIN,64.9\n"),
        (f"{FENCE}FENCE_MARGIN,65\n", "FENCE_ENABLE,0\nFENCE_ALT_MAX,120\nFENCE_MARGIN,65\n"),
        (
            f"{FENCE}FENCE_MARGIN,31\nFENCE_RADIUS,30\n",
            f"{FENCE}FENCE_MARGIN,30\nFENCE_RADIUS,30\n",
        ),
        (f"{FENCE}FENCE_MARGIN_XY,1001\n", f"{FENCE}FENCE_MARGIN_XY,1000\n"),
        (f"{FENCE}FENCE_MARGIN_XY,1001\n", f"{FENCE}FENCE_MARGIN_XY,50\nFENCE_MARGIN,55\n"),
        ("FENCE_ENABLE,1\nFENCE_TYPE,0\n", "FENCE_ENABLE,0\nFENCE_TYPE,0\n"),
        # A fence of areas alone, and a plan that brings none: tried in ArduPilot's simulation.
        ("FENCE_ENABLE,1\nFENCE_TYPE,4\n", "FENCE_ENABLE,1\nFENCE_TYPE,5\nFENCE_ALT_MAX,120\n"),
        (f"{FENCE}FENCE_ALT_MIN,-101\n", f"{FENCE}FENCE_ALT_MIN,-100\n"),
        ("BATT_LOW_VOLT,20\nBATT_CRT_VOLT,20\n", "BATT_LOW_VOLT,20\nBATT_CRT_VOLT,19.9\n"),
        ("BATT_LOW_VOLT,19\nBATT_CRT_VOLT,20\n", "BATT_LOW_VOLT,0\nBATT_CRT_VOLT,20\n"),
        ("BATT_LOW_MAH,500\nBATT_CRT_MAH,800\n", "BATT_LOW_MAH,800\nBATT_CRT_MAH,500\n"),
    ],
)
def test_a_parameter_that_arming_refuses_is_an_error_and_the_nearest_it_takes_is_none(
    refused: str, taken: str
) -> None:
    assert refuses(refused)
    assert not refuses(taken)
    assert "M127" in {one.code for one in found(PLAIN, STEP, f"{refused}WPNAV_SPEED,1000\n")}


@pytest.mark.parametrize(
    ("text", "always", "bit"),
    [
        ("MOT_SPIN_MIN,0.4\n", True, 5),
        ("PILOT_SPEED_UP,0\n", False, 5),
        ("BATT_LOW_VOLT,19\nBATT_CRT_VOLT,20\n", False, 8),
        ("RC1_TRIM,900\n", False, 6),
        ("INS_ACCOFFS_X,0\nINS_ACCOFFS_Y,0\nINS_ACCOFFS_Z,0\n", False, 4),
        (offsets("", 1801, 0, 0), False, 2),
        ("FRAME_CLASS,1\nFRAME_TYPE,10\n", True, 5),
        ("EK3_SRC1_VELZ,1\n", True, 5),
    ],
)
def test_checks_that_are_off_refuse_nothing_but_what_is_always_checked(
    text: str,
    always: bool,  # noqa: FBT001 - a table of cases
    bit: int,
) -> None:
    assert refuses(f"{text}ARMING_CHECK,1\n")
    assert refuses(f"{text}ARMING_CHECK,{1 << bit}\n")
    assert refuses(f"{text}ARMING_CHECK,{1 << 14}\n") == always
    assert refuses(f"{text}ARMING_CHECK,0\n") == always
    assert refuses(f"{text}ARMING_SKIPCHK,{1 << bit}\n") == always
    assert refuses(f"{text}ARMING_SKIPCHK,-1\n") == always


@pytest.mark.parametrize(
    ("text", "code"), [("BATT_ARM_VOLT,60\n", "E114"), ("ARMING_MIS_ITEMS,1\n", "M116")]
)
def test_the_other_rules_of_arming_heed_the_checks_that_are_on(text: str, code: str) -> None:
    assert refuses(text, code)
    assert not refuses(f"{text}ARMING_CHECK,0\n", code)
    assert not refuses(f"{text}ARMING_SKIPCHK,-1\n", code)


@pytest.mark.parametrize(("height_m", "endless"), [(38.0, False), (38.1, True)])
@pytest.mark.parametrize("avoids", ["", "AVOID_ENABLE,2\n"])
def test_a_loiter_into_the_margin_of_the_ceiling_never_gets_there(
    height_m: float, avoids: str, *, endless: bool
) -> None:
    # FENCE_ALT_MAX 40 less FENCE_MARGIN 2, as in ArduPilot's simulation: 38.0 m to the end.
    climb = mission(takeoff(20), item(31, north(100), height_m), rtl())
    text = f"FENCE_ENABLE,1\nFENCE_TYPE,1\nFENCE_ALT_MAX,40\n{avoids}"
    assert ("T101" in {one.code for one in found(climb, ARDUPILOT, text)}) is (
        endless and not avoids
    )


SWITCH = {action: item(207, frame=2, params=(action, 0.0, 0.0, 0.0)) for action in (0.0, 1.0, 2.0)}
CEILING = "FENCE_TYPE,1\nFENCE_ALT_MAX,40\n"
FLOOR = "FENCE_TYPE,8\nFENCE_ALT_MIN,10\n"


def moved_home(up_m: float) -> MissionItem:
    """Return a DO_SET_HOME so much higher than the first home, 400 m AMSL."""
    return item(179, north(0), 400.0 + up_m, frame=0)


@pytest.mark.parametrize(
    ("text", "before", "height_m", "endless"),
    [
        # what is on then: FENCE_ENABLE, FENCE_AUTOENABLE, and what the mission switches
        (f"{CEILING}FENCE_ENABLE,0\n", (), 39.0, False),
        (f"{CEILING}FENCE_ENABLE,0\n", (SWITCH[1.0],), 39.0, True),
        (f"{CEILING}FENCE_AUTOENABLE,3\n", (), 39.0, True),
        # switched on by a take-off in GUIDED alone: flown in AUTO, to 39.0 m and home
        (f"{CEILING}FENCE_AUTOENABLE,1\n", (), 39.0, False),
        (f"{CEILING}FENCE_AUTOENABLE,1\nFENCE_ENABLE,1\n", (), 39.0, False),
        (f"{CEILING}FENCE_AUTOENABLE,2\nFENCE_ENABLE,1\n", (), 39.0, True),
        (f"{CEILING}FENCE_ENABLE,1\n", (SWITCH[0.0],), 60.0, False),
        (f"{CEILING}FENCE_ENABLE,1\n", (SWITCH[2.0],), 39.0, True),
        # above the home that counts, 38 m of it
        (f"{CEILING}FENCE_ENABLE,1\n", (moved_home(10.0),), 37.0, False),
        (f"{CEILING}FENCE_ENABLE,1\n", (moved_home(-10.0),), 39.0, True),
        # nor down into the margin of the floor, 12 m
        (f"{FLOOR}FENCE_ENABLE,1\n", (), 12.0, False),
        (f"{FLOOR}FENCE_ENABLE,1\n", (), 11.9, True),
        (f"{FLOOR}FENCE_ENABLE,1\n", (SWITCH[2.0],), 11.9, False),
        # level there it is off by some decimetres, and has to climb or descend
        (f"{CEILING}FENCE_ENABLE,1\n", (waypoint(50, 39.0),), 39.0, True),
        (f"{CEILING}FENCE_ENABLE,1\n", (waypoint(50, 39.2),), 39.0, True),
        (f"{CEILING}FENCE_ENABLE,1\n", (waypoint(50, 39.6),), 39.0, False),
        (f"{FLOOR}FENCE_ENABLE,1\n", (waypoint(50, 11.0),), 11.0, True),
        (f"{FLOOR}FENCE_ENABLE,1\n", (waypoint(50, 10.5),), 11.0, False),
        (f"{FLOOR}FENCE_ENABLE,0\n", (), 11.9, False),
        # which the height switches on, but for 1 with FENCE_ENABLE 0 (flown at 11.5 m)
        (f"{FLOOR}FENCE_AUTOENABLE,2\n", (), 11.9, True),
        (f"{FLOOR}FENCE_AUTOENABLE,1\n", (), 11.9, False),
        (f"{FLOOR}FENCE_AUTOENABLE,1\nFENCE_ENABLE,1\n", (), 11.9, True),
        (f"{FLOOR}FENCE_ENABLE,1\nAVOID_ENABLE,2\n", (), 11.9, False),
    ],
)
def test_a_loiter_never_gets_into_the_margin_of_what_is_on(
    text: str, before: tuple[MissionItem, ...], height_m: float, *, endless: bool
) -> None:
    loiter = item(31, north(100), height_m)
    reported = found(mission(takeoff(20), *before, loiter, rtl()), ARDUPILOT, text)
    assert ("T101" in {one.code for one in reported}) is endless


@pytest.mark.parametrize(("version", "endless"), [((4, 5), False), ((4, 6), True), (None, True)])
def test_the_floor_is_kept_from_a_version_on(
    version: tuple[int, int] | None, *, endless: bool
) -> None:
    target = Target(ARDUPILOT, version) if version else None
    loiter = mission(takeoff(20), item(31, north(100), 11.9), rtl())
    reported = found(loiter, ARDUPILOT, f"{FLOOR}FENCE_ENABLE,1\n", target=target)
    assert ("T101" in {one.code for one in reported}) is endless


@pytest.mark.parametrize(
    ("parameters", "refuses_it"),
    [
        ("EKF2_GPS_CTRL,0\n", True),
        ("EKF2_GPS_CTRL,6\n", True),
        ("EKF2_GPS_CTRL,1\n", False),
        ("EKF2_GPS_CTRL,0\nEKF2_EV_CTRL,15\n", False),
        ("SYS_HAS_GPS,0\n", True),
        ("MPC_XY_CRUISE,5\n", False),
        ("COM_ARMABLE,0\n", True),
        ("COM_ARMABLE,1\n", False),
        ("COM_HOME_EN,0\n", True),
        ("COM_HOME_EN,1\n", False),
        ("CAL_ACC0_ID,0\nCAL_ACC1_ID,0\nCAL_ACC2_ID,0\nCAL_ACC3_ID,0\n", True),
        ("CAL_ACC0_ID,0\nCAL_ACC1_ID,9\nCAL_ACC2_ID,0\nCAL_ACC3_ID,0\n", False),
        ("CAL_ACC0_ID,0\nCAL_ACC1_ID,0\nCAL_ACC2_ID,0\n", False),  # not the whole of it
        (NO_COMPASS, True),
        (f"{NO_COMPASS}SYS_HAS_MAG,0\nEKF2_EV_CTRL,15\n", False),
        ("EKF2_MAG_TYPE,5\n", True),
        ("EKF2_MAG_TYPE,5\nEKF2_GPS_CTRL,7\n", True),
        ("EKF2_MAG_TYPE,5\nEKF2_GPS_CTRL,15\n", False),
        ("SYS_HAS_MAG,0\n", True),
        # Tried: "Resolve system health failures first".
        ("EKF2_BARO_CTRL,0\nEKF2_GPS_CTRL,5\n", True),
        ("EKF2_BARO_CTRL,0\nEKF2_GPS_CTRL,7\n", False),
        ("EKF2_BARO_CTRL,1\nEKF2_GPS_CTRL,5\n", False),
        ("EKF2_BARO_CTRL,0\nEKF2_GPS_CTRL,5\nEKF2_RNG_CTRL,2\n", False),
        ("SYS_HAS_BARO,0\nEKF2_GPS_CTRL,5\n", True),
        ("RC1_TRIM,999\n", True),
        ("RC1_TRIM,1000\n", False),
        ("RC18_MAX,1499\n", True),
        ("RC18_MAX,2501\n", True),
        ("RC18_MAX,2500\n", False),
        ("RC1_TRIM,999\nCOM_RC_IN_MODE,4\n", False),
        ("EKF2_EN,0\n", True),
        ("EKF2_EN,0\nLPE_EN,1\n", False),
        ("EKF2_EN,0\nSYS_MC_EST_GROUP,1\n", False),
    ],
)
def test_px4_arms_for_no_mission_without_a_position_or_a_calibration(
    parameters: str, *, refuses_it: bool
) -> None:
    assert ("M127" in {one.code for one in found(PLAIN, PX4, parameters)}) is refuses_it


def delivering(wait_s: float, hour: float = -1.0) -> list[Severity]:
    """Return what is said of a delivery with a wait on the ground; AUTO_OPTIONS 3 needs no throttle."""
    one = mission(
        takeoff(20),
        item(21, north(200)),
        item(93, frame=2, params=(wait_s, hour, -1.0, -1.0)),
        takeoff(20),
        waypoint(300, 20),
        rtl(),
    )
    text = "MIS_OPTIONS,4\nAUTO_OPTIONS,3\nDISARM_DELAY,20\n"
    return [f.severity for f in found(one, ARDUPILOT, text) if f.code == "T121"]


def test_a_wait_on_the_ground_as_long_as_disarming_takes_ends_a_delivery() -> None:
    assert delivering(20.0) == [Severity.ERROR]
    assert delivering(19.0) == []
    assert delivering(-1.0, hour=18.0) == [Severity.ERROR]
    assert delivering(0.0) == []


@pytest.mark.parametrize(
    ("autopilot", "text", "severities"),
    [
        (ARDUPILOT, "AUTO_OPTIONS,2\n", [Severity.ERROR]),
        (ARDUPILOT, "AUTO_OPTIONS,1\n", [Severity.WARNING]),
        (ARDUPILOT, "DISARM_DELAY,61\n", []),
        (ARDUPILOT, "DISARM_DELAY,0\n", []),
        (PX4, "COM_DISARM_PRFLT,10\n", [Severity.ERROR]),
        # The spin-up's second is over by then: 61 s after arming it still counts as landed.
        (PX4, "COM_DISARM_PRFLT,60\n", [Severity.ERROR]),
        (PX4, "COM_DISARM_PRFLT,61\n", [Severity.WARNING]),
        (PX4, "COM_DISARM_PRFLT,62\n", []),
        (PX4, "COM_DISARM_PRFLT,-1\n", []),
    ],
)
def test_a_wait_before_the_first_take_off_disarms(
    autopilot: Autopilot, text: str, severities: list[Severity]
) -> None:
    wait = item(93, frame=2, params=(60.0, -1.0, -1.0, -1.0))
    told = found(mission(wait, *PLAIN.items), autopilot, text)
    assert [one.severity for one in told if one.code == "T121"] == severities


@pytest.mark.parametrize(
    ("wait_s", "text", "severities"),
    [
        # Flown by a build, at 7, 7.5 and 8.5 s as at 9 and 10 s, which older versions may not let pass.
        (7.0, "", []),
        (7.5, "", []),
        (8.5, "", []),
        (9.0, "", [Severity.WARNING]),
        # It disarms 11 s after arming, whatever the wait: seen with 12 s.
        (10.5, "", [Severity.ERROR]),
        (12.0, "", [Severity.ERROR]),
        (4.0, "COM_DISARM_PRFLT,9\nCOM_SPOOLUP_TIME,4\n", []),  # flown
        # Flown, with as slow a ramp.
        (0.0, "COM_SPOOLUP_TIME,4\nMPC_TKO_RAMP_T,6\nMPC_TKO_SPEED,0.8\n", [Severity.WARNING]),
    ],
)
def test_a_wait_before_px4s_take_off_passes_while_it_spins_up(
    wait_s: float, text: str, severities: list[Severity]
) -> None:
    wait = item(93, frame=2, params=(wait_s, -1.0, -1.0, -1.0))
    told = found(mission(wait, *PLAIN.items), PX4, text)
    assert [one.severity for one in told if one.code == "T121"] == severities


@pytest.mark.parametrize(("monitor", "returns"), [(3, False), (4, True)])
def test_a_charge_that_nothing_measures_brings_no_vehicle_home(
    monitor: int,
    returns: bool,  # noqa: FBT001 - a table of cases
) -> None:
    text = f"BATT_MONITOR,{monitor}\nBATT_CAPACITY,8000\nBATT_LOW_MAH,7990\nBATT_FS_LOW_ACT,2\n"
    assert refuses(text, "E103") == returns


def motors(driver: str, *functions: int) -> str:
    """Return the outputs of a driver of PX4's."""
    return "".join(f"{driver}_FUNC{n},{function}\n" for n, function in enumerate(functions, 1))


@pytest.mark.parametrize(
    ("autopilot", "text", "told"),
    [
        (ARDUPILOT, "PSC_NE_VEL_P,0\n", True),
        (ARDUPILOT, "PSC_VELXY_P,0\n", True),
        (ARDUPILOT, "PSC_VELXY_P,0.1\n", False),
        (PX4, "MC_PITCHRATE_K,0\n", True),
        (PX4, "MC_YAW_P,0\n", True),
        (PX4, "MC_PITCHRATE_I,0\n", False),
        (PX4, "CA_AIRFRAME,1\n", True),
        (PX4, "CA_AIRFRAME,8\n", False),  # rotors that tilt
        (PX4, "MAV_TYPE,1\n", True),
        (PX4, "MAV_TYPE,22\n", True),
        (PX4, "MAV_TYPE,13\n", False),
        (PX4, "MAV_TYPE,4\n", True),
        # atan(3 / 9.81) = 17.0°, MPC_ACC_HOR as delivered
        (PX4, "CBRK_FLIGHTTERM,0\nFD_FAIL_P,16\n", True),
        (PX4, "CBRK_FLIGHTTERM,0\nFD_FAIL_R,16\n", True),
        (PX4, "CBRK_FLIGHTTERM,0\nFD_FAIL_P,18\n", False),
        (PX4, "CBRK_FLIGHTTERM,0\nFD_FAIL_P,0\n", False),
        (PX4, "CBRK_FLIGHTTERM,121212\nFD_FAIL_P,10\n", False),
        (PX4, "CA_AIRFRAME,12\n", True),
        (PX4, "SYS_AUTOSTART,16001\n", True),
        (PX4, "SYS_AUTOSTART,13000\n", True),
        (PX4, "SYS_AUTOSTART,2100\n", True),
        (PX4, "SYS_AUTOSTART,4001\n", False),
        (PX4, "SYS_AUTOSTART,12001\n", False),
        (PX4, "CA_AIRFRAME,0\nCA_ROTOR_COUNT,0\n", True),
        (PX4, "CA_AIRFRAME,0\nCA_ROTOR_COUNT,4\n", False),
        (PX4, "SYS_CTRL_ALLOC,0\nCA_ROTOR_COUNT,0\n", False),  # mixers, before 1.14
        (PX4, f"CA_ROTOR_COUNT,4\n{motors('PWM_MAIN', 0, 0, 0, 0)}", True),
        (PX4, f"CA_ROTOR_COUNT,4\n{motors('PWM_MAIN', 101, 102, 103, 0)}", True),
        (PX4, f"CA_ROTOR_COUNT,4\n{motors('PWM_AUX', 104, 103, 102, 101)}", False),
        (
            PX4,
            (
                f"CA_ROTOR_COUNT,4\n{motors('PWM_MAIN', 0, 0, 0, 0)}"
                f"{motors('UAVCAN_EC', 101, 102, 103, 104)}"
            ),
            False,
        ),
        (PX4, f"CA_ROTOR_COUNT,4\n{motors('PWM_MAIN', 0, 0, 0)}", False),  # not the whole of it
        (PX4, f"{motors('PWM_MAIN', 0, 0, 0, 0)}", False),
        (PX4, "SYS_HITL,1\n", True),
        (PX4, "SYS_HITL,2\n", False),
    ],
)
def test_a_gain_of_0_that_arming_lets_pass_is_an_error(
    autopilot: Autopilot,
    text: str,
    told: bool,  # noqa: FBT001 - a table of cases
) -> None:
    assert ("M130" in {one.code for one in found(PLAIN, autopilot, text)}) is told


CHUTE = "CHUTE_ENABLED,1\nCHUTE_TYPE,10\nSERVO9_FUNCTION,27\n"


# The plain flight comes down at 1.5 m/s to 10 m, then at 0.5 m/s.  ``AP_Parachute::check_sink_rate``.
@pytest.mark.parametrize(
    ("text", "severity"),
    [
        (f"{CHUTE}CHUTE_CRT_SINK,1\n", Severity.ERROR),
        (f"{CHUTE}CHUTE_CRT_SINK,1.5\n", Severity.ERROR),
        (f"{CHUTE}CHUTE_CRT_SINK,1.6\n", Severity.WARNING),
        (f"{CHUTE}CHUTE_CRT_SINK,1.9\n", None),
        (f"{CHUTE}CHUTE_CRT_SINK,4\nLAND_SPEED_HIGH,500\n", Severity.ERROR),
        (f"{CHUTE}CHUTE_CRT_SINK,0\n", None),
        ("CHUTE_ENABLED,0\nCHUTE_CRT_SINK,1\n", None),
    ],
)
def test_a_descent_that_releases_the_parachute_is_an_error(
    text: str, severity: Severity | None
) -> None:
    told = [one.severity for one in found(PLAIN, ARDUPILOT, text) if one.code == "M132"]
    assert told == [severity] * bool(severity)


@pytest.mark.parametrize(
    ("enabled", "action", "releases"),
    [(0, None, False), (0, 0.0, False), (0, 1.0, True), (1, None, True), (1, 1.0, True)],
)
def test_a_parachute_that_the_mission_switches_on_is_released_too(
    enabled: int, action: float | None, *, releases: bool
) -> None:
    """``ModeAuto::do_parachute``; a return sinks at 1.5 m/s."""
    switch = () if action is None else (item(208, frame=2, params=(action, 0.0, 0.0, 0.0)),)
    flown = mission(takeoff(100), *switch, waypoint(100, 100), rtl())
    reported = found(flown, ARDUPILOT, f"CHUTE_ENABLED,{enabled}\nCHUTE_CRT_SINK,1\n")
    assert ("M132" in {one.code for one in reported}) is releases


CHUTE_OFF, CHUTE_ON = (item(208, frame=2, params=(does, 0.0, 0.0, 0.0)) for does in (0.0, 1.0))
WAIT = item(112, frame=2, params=(5.0, 0.0, 0.0, 0.0))
NEAR, HIGHER, LOWER = waypoint(100, 100), waypoint(200, 150), waypoint(300, 60)


# Legs descend at 1.5 m/s at most, returns too; the take-off and legs up do not.
@pytest.mark.parametrize(
    ("items", "severity"),
    [
        ((CHUTE_OFF, NEAR, rtl()), Severity.WARNING),  # a return during the take-off
        (
            (NEAR, CHUTE_OFF, HIGHER, rtl()),
            Severity.ERROR,
        ),  # a return on the way to the first place
        ((CHUTE_OFF, HIGHER, CHUTE_ON, LOWER, rtl()), Severity.ERROR),
        ((CHUTE_OFF, HIGHER, LOWER, rtl(), CHUTE_ON), Severity.WARNING),  # never reached
        ((WAIT, CHUTE_OFF, NEAR, rtl()), Severity.ERROR),  # held back, for how long is not asked
    ],
)
def test_a_parachute_is_released_only_while_it_is_on(
    items: tuple[MissionItem, ...], severity: Severity
) -> None:
    """``AP_Parachute::update`` returns at once where it is not enabled."""
    flown = mission(takeoff(100), *items)
    reported = found(flown, ARDUPILOT, "CHUTE_ENABLED,1\nCHUTE_CRT_SINK,1\n")
    assert [one.severity for one in reported if one.code == "M132"] == [severity]


def test_a_parachute_that_is_off_before_the_takeoff_is_never_released() -> None:
    flown = mission(CHUTE_OFF, takeoff(100), NEAR, rtl())
    reported = found(flown, ARDUPILOT, "CHUTE_ENABLED,1\nCHUTE_CRT_SINK,1\n")
    assert "M132" not in {one.code for one in reported}


@pytest.mark.parametrize(
    ("second", "codes"),
    [
        ("BATT2_ARM_VOLT,26\n", {"X904"}),
        ("BATT2_ARM_MAH,99999\n", {"E114"}),
        ("BATT2_ARM_MAH,1000\n", set()),
        ("BATT2_ARM_VOLT,26\nARMING_CHECK,0\n", set()),
        ("BATT2_LOW_VOLT,20\n", set()),
    ],
)
def test_a_further_monitor_may_keep_the_vehicle_from_arming(second: str, codes: set[str]) -> None:
    """``AP_BattMonitor::arming_checks`` asks each: of 1.3 Ah, it is on another battery."""
    reported = found(PLAIN, ARDUPILOT, f"BATT2_MONITOR,4\nBATT2_CAPACITY,1300\n{second}")
    assert {one.code for one in reported if one.severity is Severity.ERROR} == codes
