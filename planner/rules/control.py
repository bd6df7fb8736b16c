"""Rules on parameters with which an autopilot that arms does not control its vehicle."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.route.stage import StageKind
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, EXTREMES, PARAMETERS, PX4, NotEvaluated, judges
from planner.units import GRAVITY_M_S2
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.flight.prediction import Extremes
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_FULL_OVER_HALF = (4.19 / 3.71) ** 2
"""Thrust of a full lithium-polymer battery over that of a half empty one: the voltage squared
(``models/chemistries/lipo.toml``). [-]"""
_SAME_NUMBER = 1e-6
"""Numbers this near are one: files write them in single precision. [-]"""
_ARDUPILOT_GAINS = ("PSC_NE_VEL_P", "PSC_VELXY_P")
"""From 4.7 on and before; the others ArduPilot looks at itself before it arms (M127)."""
_PX4_GAINS = (
    *(f"MPC_{axis}_{gain}" for axis in ("XY", "Z") for gain in ("P", "VEL_P_ACC")),
    *(f"MC_{axis}_P" for axis in ("ROLL", "PITCH", "YAW")),
    *(f"MC_{axis}RATE_{gain}" for axis in ("ROLL", "PITCH", "YAW") for gain in "PK"),
)
"""Of position, height, attitude and rates: those that ArduPilot wants above 0 to arm, as PX4 calls them."""

_OTHER_FRAMES = {
    **dict.fromkeys((1, 2, 3, 4), "one with wings"),
    **dict.fromkeys((5, 6, 13), "a rover"),
    **dict.fromkeys((10, 11, 12), "a helicopter"),
    14: "a spacecraft",
}
"""CA_AIRFRAME of what is no multicopter (``src/modules/control_allocator/module.yaml``)."""
_OTHER_TYPES = {
    **dict.fromkeys((1, *range(19, 26)), "one with wings"),
    **dict.fromkeys((3, 4), "a helicopter"),
    **dict.fromkeys((7, 8), "an airship or a balloon"),
    **dict.fromkeys((10, 11, 12), "a rover, boat or submarine"),
}
"""MAV_TYPE of what is no multicopter (``common.xml``)."""
_OTHER_SERIES = {
    **dict.fromkeys((2, 3, 13), "one with wings"),
    16: "a helicopter",
    50: "a rover",
    60: "a submarine",
}
"""Thousands of SYS_AUTOSTART of what is no multicopter (``ROMFS/px4fmu_common/init.d/airframes``)."""
_BREAKER_OPEN = 121_212
"""CBRK_FLIGHTTERM that keeps PX4 from flight termination, its default."""
_HARDWARE_IN_THE_LOOP = 1
"""SYS_HITL; 2 is a simulation on the autopilot itself."""

_OUTPUTS = re.compile(r"\w+_FUNC\d+")
"""What PX4 puts on an output, of whatever driver: PWM_MAIN_FUNC1, UAVCAN_EC_FUNC1, VOXL_ESC_FUNC1."""
_FIRST_MOTOR = 101
"""The others follow (``src/lib/mixer_module/output_functions.yaml``)."""

CANNOT_DESCEND = Rule(
    "T118 cannot-descend",
    Severity.ERROR,
    summary="The least thrust of the parameters keeps the vehicle in the air.",
    why="With MPC_THR_MIN 0.6 on a vehicle that hovers with half of its thrust PX4's simulation climbed on "
    "from a mission 10 m high, past 400 m, and never landed.",
    how="MPC_THR_MIN over MPC_THR_HOVER: an error from 1 on; a warning from 0.78 on, for a full battery "
    "gives 1.28 times the thrust of a half empty one, with which the hover may have been measured.  Where "
    "MPC_THR_HOVER is PX4's default, 0.5, nobody measured it: not checked (X904) from 0.39 on.",
    fix="set MPC_THR_MIN well below the thrust of the hover; its default is 0.12",
    instead="the parameters of --params",
)


@judges(CANNOT_DESCEND, needs=(PX4,))
def _cannot_descend(a: Assessment, parameters: Px4Parameters) -> Iterator[Found]:
    least, hover = numbers(a).get("MPC_THR_MIN"), parameters.hover_throttle
    if least is None or least * _FULL_OVER_HALF < hover:
        return
    default = parameter_table(type(parameters))["hover_throttle"].default_si
    origin = parameters.origins.get("hover_throttle")
    is_stated = origin is not None and not origin.is_default
    if not is_stated or math.isclose(hover, default, rel_tol=_SAME_NUMBER):
        yield NotEvaluated(
            rule=CANNOT_DESCEND,
            asked_by=f"MPC_THR_MIN of {least:g}",
            needs="the throttle this vehicle hovers at; MPC_THR_HOVER is PX4's default",
        )
        return
    never = "never" if least >= hover else "with a full battery perhaps not"
    yield a.finding(
        CANNOT_DESCEND,
        f"MPC_THR_MIN is {quantity.percent(least)} of the thrust, a hover takes {quantity.percent(hover)}: "
        f"the vehicle {never} descends",
        severity=None if least >= hover else Severity.WARNING,
    )


NO_CONTROL = Rule(
    "M130 no-control",
    Severity.ERROR,
    summary="A gain of the flight controller is 0, or its motors are not driven.",
    why="The vehicle arms with it and takes off.  In calm simulated air PX4 wandered about with "
    "MPC_XY_VEL_P_ACC 0 and never reached the second waypoint; ArduPilot with PSC_NE_VEL_P, _I and _D 0 "
    "flew 1.4 km away from a mission of 30 m.",
    how="PX4: MPC_XY_P, MPC_Z_P, MPC_XY_VEL_P_ACC, MPC_Z_VEL_P_ACC, MC_ROLL_P, MC_PITCH_P, MC_YAW_P and "
    "MC_ROLLRATE_, MC_PITCHRATE_, MC_YAWRATE_ with P or K at 0 or less: of the same gains ArduPilot refuses "
    "to arm (M127).  ArduPilot: PSC_NE_VEL_P, before 4.7 PSC_VELXY_P, at 0 or less: it says nothing.  PX4 "
    "besides: CA_AIRFRAME, MAV_TYPE or SYS_AUTOSTART of what is no multicopter, CA_ROTOR_COUNT 0, a motor of "
    "CA_ROTOR_COUNT on none of as many outputs or more (PWM_MAIN_FUNC, UAVCAN_EC_FUNC and their like), "
    "SYS_HITL 1, FD_FAIL_P or FD_FAIL_R below the lean at MPC_ACC_HOR with CBRK_FLIGHTTERM other than "
    "121212; MPC_XY_VEL_I_ACC 0 in wind, which PX4 takes (its least is 0): drag over the other gains is "
    "how far it stands off.",
    fix="restore the parameters of the vehicle, or give its own file",
    instead="the parameters of --params",
)


@judges(NO_CONTROL, needs=(PARAMETERS,))
def _no_control(a: Assessment, parameters: FlightParameters) -> Iterator[Finding]:
    values, is_px4 = numbers(a), isinstance(parameters, Px4Parameters)
    gains = _PX4_GAINS if is_px4 else _ARDUPILOT_GAINS
    zero = [name for name in gains if values.get(name, 1.0) <= 0.0]
    if zero:
        rest = f" (and {len(zero) - 1} more)" if len(zero) > 1 else ""
        autopilot = "PX4" if is_px4 else "ArduPilot"
        yield a.finding(
            NO_CONTROL, f"{zero[0]} is 0: {autopilot} does not control the vehicle{rest}"
        )
    elif is_px4:
        said_of = (*_undriven(values), *_terminated(values, parameters.acceleration_m_s2))
        yield from (a.finding(NO_CONTROL, said) for said in said_of)
        if values.get("MPC_XY_VEL_I_ACC") == 0.0 and a.setup.wind.speed_m_s > 0.0:
            wind = quantity.speed(a.setup.wind.speed_m_s)
            said = f"MPC_XY_VEL_I_ACC is 0: PX4 does not correct for the wind of {wind}"
            yield a.finding(NO_CONTROL, f"{said}, stands off its places and may never reach them")


PARACHUTE_RELEASED = Rule(
    "M132 parachute-released",
    Severity.ERROR,
    summary="The vehicle descends so fast that it releases its parachute.",
    why="ArduPilot releases it, and stops its motors, where it has sunk faster than CHUTE_CRT_SINK for more "
    "than a second; a descent or a landing that is meant is no exception.",
    how="While CHUTE_ENABLED 1 or a DO_PARACHUTE has it on, and CHUTE_CRT_SINK is above 0: the fastest "
    "descent of the flight, and of returns and their landings from its greatest height (WP_SPD_DN, "
    "LAND_SPD_HIGH_MS above LAND_ALT_LOW_M, LAND_SPD_MS): an error from CHUTE_CRT_SINK on, a warning from "
    "0.8 of it, for a vehicle overshoots, and where only a return during the take-off would.  A DO_PARACHUTE "
    "0 behind a condition counts as never carried out, a 1 as carried out at once.",
    fix="raise CHUTE_CRT_SINK above the descents, or set it to 0",
    instead="the parameters of --params",
)
_NEAR_RELEASE = 0.8


@judges(PARACHUTE_RELEASED, needs=(ARDUPILOT, EXTREMES))
def _parachute_released(
    a: Assessment, parameters: ArduPilotParameters, extremes: Extremes
) -> Iterator[Finding]:
    values, stages = numbers(a), a.route.stages
    limit_m_s = values.get("CHUTE_CRT_SINK", 0.0)
    is_on = np.full(len(stages), values.get("CHUTE_ENABLED", 0.0) > 0.0)
    for switch in a.route.parachute_switches:
        is_on[switch.first_stage :] = switch.is_on
    if not (is_on.any() and limit_m_s > 0.0):
        return
    motion = a.flight.motion
    stage = np.minimum(motion.segment_stage[motion.piece_segment], len(stages) - 1)
    sinks_m_s = -float(a.flight.node_state.climb_m_s[is_on[stage]].min(initial=0.0))
    return_m_s = parameters.land_speed_m_s
    if max(extremes.highest_m, parameters.return_altitude_m) > parameters.land_slow_height_m:
        return_m_s = max(return_m_s, parameters.land_high_speed_m_s)
    is_only_taking_off = not any(is_on[[one.kind is not StageKind.TAKEOFF for one in stages]])
    if not is_only_taking_off:
        sinks_m_s = max(sinks_m_s, return_m_s)
    which, fastest_m_s = "", sinks_m_s
    if fastest_m_s < _NEAR_RELEASE * limit_m_s and is_only_taking_off:
        which, fastest_m_s = "a return during the take-off ", return_m_s
    if fastest_m_s < _NEAR_RELEASE * limit_m_s:
        return
    is_released = fastest_m_s >= limit_m_s * (1.0 - _SAME_NUMBER)
    yield a.finding(
        PARACHUTE_RELEASED,
        f"{which}descends at up to {quantity.speed(fastest_m_s)}; at CHUTE_CRT_SINK, "
        f"{quantity.speed(limit_m_s)}, "
        f"ArduPilot {'releases its parachute and stops its motors' if is_released else 'would release it'}",
        severity=None if is_released and not which else Severity.WARNING,
    )


def _terminated(values: Mapping[str, float], acceleration_m_s2: float) -> Iterator[str]:
    """Yield why PX4 stops its motors as it accelerates (``FailureDetector::updateAttitudeStatus``)."""
    if values.get("CBRK_FLIGHTTERM", _BREAKER_OPEN) == _BREAKER_OPEN:
        return
    lean_deg = math.degrees(math.atan(acceleration_m_s2 / GRAVITY_M_S2))
    for name in ("FD_FAIL_P", "FD_FAIL_R"):
        if 0.0 < (limit_deg := values.get(name, 60.0)) < lean_deg:
            yield (
                f"{name} is {limit_deg:g}° and CBRK_FLIGHTTERM {values['CBRK_FLIGHTTERM']:g}: PX4 stops its "
                f"motors where it leans farther, {lean_deg:.0f}° at MPC_ACC_HOR"
            )
            return


def _undriven(values: Mapping[str, float]) -> Iterator[str]:
    """Yield why PX4 drives no motors of a multicopter."""
    frame = int(values.get("CA_AIRFRAME", 0.0))
    for name, others, thousands in (
        ("CA_AIRFRAME", _OTHER_FRAMES, 1),
        ("MAV_TYPE", _OTHER_TYPES, 1),
        ("SYS_AUTOSTART", _OTHER_SERIES, 1000),
    ):
        value = int(values.get(name, 0.0))
        if (other := others.get(value // thousands)) is not None:
            yield f"{name} is {value}: PX4 flies {other}, no multicopter"
            return
    if values.get("SYS_CTRL_ALLOC", 1.0) and values.get("CA_ROTOR_COUNT") == frame == 0:
        yield "CA_ROTOR_COUNT is 0: PX4 drives no motor"
    elif values.get("SYS_CTRL_ALLOC", 1.0):
        yield from _without_output(values)
    if values.get("SYS_HITL") == _HARDWARE_IN_THE_LOOP:
        yield "SYS_HITL is 1: PX4 flies a simulation, and its outputs are locked"


def _without_output(values: Mapping[str, float]) -> Iterator[str]:
    """Yield which motor is on no output; of a file with fewer outputs than motors it is not known."""
    outputs = [int(value) for name, value in values.items() if _OUTPUTS.fullmatch(name)]
    motors = int(values.get("CA_ROTOR_COUNT", 0.0))
    for motor in range(motors if len(outputs) >= motors else 0):
        if _FIRST_MOTOR + motor not in outputs:
            yield f"motor {motor + 1} is on no output: no _FUNC parameter is {_FIRST_MOTOR + motor}"
            return
