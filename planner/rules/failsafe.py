"""Rules on what the vehicle decides itself: failsafes, arming, returns to rally points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.failsafe import RETURNS, WARNS, ardupilot_events, battery_profile, px4_events
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.returns.path import thinned
from planner.mission.route.stage import StageKind
from planner.rules.declaration import (
    ARDUPILOT,
    BUDGET,
    DISCHARGE,
    PACK,
    PARAMETERS,
    NotEvaluated,
    judges,
)
from planner.rules.energy import place_along
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import OriginKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget, Discharge
    from planner.flight.failsafe import BatteryProfile, FailsafeEvent
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_MOST_RALLY_PLACES = 200
_MOST_HOVER_THRUST = 0.7
"""Fraction of the thrust above which a hover leaves too little for control. [-]"""
_GOES_DOWN = (STATE_INDEX[FlightState.LAND], STATE_INDEX[FlightState.DESCEND])


def _profile(a: Assessment, pack: Battery) -> BatteryProfile:
    return battery_profile(a.returns, pack, a.discharge, charge=a.charge)


FAILSAFE_BEFORE_END = Rule(
    "E103 onboard-failsafe-before-end",
    Severity.ERROR,
    summary="The vehicle's own battery failsafe would end the mission early.",
    why="A failsafe is decided on board, by thresholds no ground station compares with the plan: "
    "returns that come far too early are reported again and again (PX4 #17007: at 32 % while set to 15 "
    "%), and one set to land sets the vehicle down wherever it is (ArduPilot #7333).",
    how="The charge, voltage and time of the predicted flight against the parameters.  PX4: charge "
    "below BAT_LOW_THR, BAT_CRIT_THR, BAT_EMERGEN_THR with COM_LOW_BAT_ACT, counted from BAT1_CAPACITY "
    "and estimated from the open-circuit voltage between BAT1_V_EMPTY and BAT1_V_CHARGED, whichever is "
    "less; RTL_TIME_FACTOR × time to return + RTL_TIME_MARGIN against charge over mean current (50 s, "
    "from BAT_AVRG_CURRENT) with COM_FLTT_LOW_ACT, PX4's own estimate: no wind, no braking; "
    "COM_FLT_TIME_MAX.  ArduPilot: BATT_CAPACITY less the charge used below BATT_LOW_MAH and "
    "BATT_CRT_MAH, voltage under load (at rest with BATT_FS_VOLTSRC 1) below BATT_LOW_VOLT and "
    "BATT_CRT_VOLT for BATT_LOW_TIMER, with BATT_FS_LOW_ACT and BATT_FS_CRT_ACT.  An error where the "
    "vehicle returns or lands, information where it only warns; not checked in the last landing.",
    fix="shorten the mission, start with a fuller battery, or set the failsafe to what the battery "
    "can give",
    instead="the vehicle's own parameters with --params",
)


@judges(FAILSAFE_BEFORE_END, needs=(PACK, PARAMETERS))
def _failsafe_before_end(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding | NotEvaluated]:
    profile = _profile(a, pack)
    if isinstance(parameters, Px4Parameters):
        events = list(px4_events(a.returns, profile, pack, parameters))
    else:
        events = list(ardupilot_events(profile, parameters))
    events = [event for event in events if not _comes_too_late(a, event)]
    events.sort(key=lambda event: (event.segment, event.fraction))
    yield from _unwatched(profile, parameters)
    acting = next((event for event in events if event.action != WARNS), None)
    warning = next((event for event in events if event.action == WARNS), None)
    if acting is not None:
        yield _reported(a, acting, Severity.ERROR)
    if warning is not None and (
        acting is None or (warning.segment, warning.fraction) < (acting.segment, acting.fraction)
    ):
        yield _reported(a, warning, Severity.INFO)


def _unwatched(profile: BatteryProfile, parameters: FlightParameters) -> Iterator[NotEvaluated]:
    """Yield the thresholds of a parameter file that the battery says too little for."""
    if isinstance(parameters, Px4Parameters):
        return
    for name, quantity_name, is_known, shown in (
        ("BATT_LOW_VOLT", "battery_low_v", profile.loaded_v is not None, _volts),
        ("BATT_CRT_VOLT", "battery_critical_v", profile.loaded_v is not None, _volts),
        ("BATT_ARM_VOLT", "arm_battery_min_v", profile.rest_v is not None, _volts),
        ("BATT_LOW_MAH", "battery_low_ah", profile.used_ah is not None, _milliampere_hours),
        ("BATT_CRT_MAH", "battery_critical_ah", profile.used_ah is not None, _milliampere_hours),
    ):
        threshold = getattr(parameters, quantity_name)
        origin = parameters.origins.get(quantity_name)
        if is_known or threshold <= 0.0 or origin is None or origin.kind is not OriginKind.FILE:
            continue
        yield NotEvaluated(
            rule=ARMING_REFUSED if name == "BATT_ARM_VOLT" else FAILSAFE_BEFORE_END,
            asked_by=f"{name} of {shown(threshold)}",
            needs="the battery's charge and voltage, such as --battery 5.2Ah@14.8V, or its cells in "
            "the vehicle model",
        )


def _volts(voltage_v: float) -> str:
    return f"{quantity.decimals(voltage_v, 1)} V"


def _milliampere_hours(charge_ah: float) -> str:
    return quantity.charge(1000.0 * charge_ah)


def _comes_too_late(a: Assessment, event: FailsafeEvent) -> bool:
    """Return whether the vehicle does by then what the failsafe would make it do."""
    kind = a.route.stages[a.returns.segment_stage[event.segment]].kind
    if kind is StageKind.RETURN and event.action in {RETURNS, WARNS}:
        return True
    state = a.flight.motion.segments.state[event.segment]
    return kind in {StageKind.LAND, StageKind.RETURN} and state in _GOES_DOWN


def _reported(a: Assessment, event: FailsafeEvent, severity: Severity) -> Finding:
    point = a.returns.flight_point(event.segment, event.fraction)
    return a.finding(
        FAILSAFE_BEFORE_END,
        f"the vehicle itself {event.action} at {place_along(point)}: {event.reading}",
        severity=severity,
        item=point.item,
    )


ARMING_REFUSED = Rule(
    "E114 battery-refused-at-arming",
    Severity.ERROR,
    summary="The vehicle would not arm with this battery.",
    why="A vehicle that refuses to arm on the field costs the day.",
    how="Charge at the start below COM_ARM_BAT_MIN, or BAT_CRIT_THR where that is negative (PX4); "
    "open-circuit voltage at the start below BATT_ARM_VOLT, BATT_CAPACITY below BATT_ARM_MAH "
    "(ArduPilot).",
    fix="charge the battery, or correct the parameter",
    instead="--charge, or the parameters of --params",
)


@judges(ARMING_REFUSED, needs=(PACK, PARAMETERS))
def _arming_refused(
    a: Assessment, pack: Battery, parameters: FlightParameters
) -> Iterator[Finding]:
    profile = _profile(a, pack)
    if isinstance(parameters, Px4Parameters):
        least, name = parameters.arm_battery_min_fraction, "COM_ARM_BAT_MIN"
        if least < 0.0:
            least, name = parameters.battery_critical_fraction, "BAT_CRIT_THR"
        charge = float(profile.fraction[0])
        if charge < least:
            yield a.finding(
                ARMING_REFUSED,
                f"PX4 does not arm at {quantity.beside(charge, least, quantity.percent)} charge: {name} is "
                f"{quantity.percent(least)}",
            )
        return
    if profile.rest_v is not None and profile.rest_v[0] < parameters.arm_battery_min_v:
        yield a.finding(
            ARMING_REFUSED,
            f"ArduPilot does not arm at {quantity.decimals(float(profile.rest_v[0]), 1)} V: BATT_ARM_VOLT "
            f"is {quantity.decimals(parameters.arm_battery_min_v, 1)} V",
        )
    if parameters.battery_capacity_ah < parameters.arm_battery_min_ah:
        yield a.finding(
            ARMING_REFUSED,
            f"ArduPilot never arms: BATT_ARM_MAH is "
            f"{quantity.charge(1000.0 * parameters.arm_battery_min_ah)}, BATT_CAPACITY "
            f"{quantity.charge(1000.0 * parameters.battery_capacity_ah)}",
        )


RALLY_UNREACHABLE = Rule(
    "E106 rally-unreachable",
    Severity.WARNING,
    summary="A rally point is useless: never chosen, or not reachable above the reserve.",
    why="A rally point is drawn as the place of safety; a vehicle that never goes there, or cannot, "
    "needs the return home after all (ArduPilot #4701: rally in range of the whole path, #30575).",
    how="From the ends of the mission's stages, or 200 of them: a warning where the energy left above "
    "the reserve does not reach the rally point from any of them; a note where the vehicle's own rules "
    "(RTL_TYPE; RALLY_LIMIT_KM, RALLY_INCL_HOME) never choose it.",
    fix="move the rally point to where the mission is far from home, or remove it",
)


@judges(RALLY_UNREACHABLE, needs=(BUDGET,))
def _rally_unreachable(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    rally, returns = a.mission.rally, a.returns
    if not rally:
        return
    ends = returns.stage_ends
    ends = ends[
        [
            a.route.stages[stage].kind not in {StageKind.LAND, StageKind.RETURN}
            for stage in returns.segment_stage[ends].tolist()
        ]
    ]
    if not len(ends):
        return
    points = returns.end_points(thinned(ends, _MOST_RALLY_PLACES))
    chosen = np.unique(returns.chosen(points))
    above_wh = budget.usable_wh - budget.reserve_wh - points.used_wh - points.stop_wh
    never: list[int] = []
    out_of_reach: list[int] = []
    missed_by_wh: list[float] = []
    for number in range(1, len(rally) + 1):
        _, way_wh = returns.fly(points.stop_m, points.stage, number)
        short_wh = float((way_wh - above_wh).min())
        if short_wh > 0.0:
            out_of_reach.append(number)
            missed_by_wh.append(short_wh)
        elif number not in chosen:
            never.append(number)
    short = quantity.energy(missed_by_wh[0]) if missed_by_wh else ""
    for points_found, why, severity in (
        (
            out_of_reach,
            f"cannot be reached above the reserve from any item ({short} short)",
            Severity.WARNING,
        ),
        (never, "is never chosen: returns lead home or to another rally point", Severity.INFO),
    ):
        if points_found:
            rest = f" (and {len(points_found) - 1} more)" if len(points_found) > 1 else ""
            yield a.finding(
                RALLY_UNREACHABLE,
                f"rally point {points_found[0]} {why}{rest}",
                severity=severity,
                place=rally[points_found[0] - 1].place,
            )


HOVER_THROTTLE_HIGH = Rule(
    "E116 hover-throttle-high",
    Severity.WARNING,
    summary="Late in the flight the vehicle needs most of its thrust to hover.",
    why="A vehicle that hovers at three quarters of its throttle has little left to climb or to stay "
    "upright with, less still as the battery sags: 77 % at the take-off nearly lost one (ArduPilot "
    "#5244).",
    how="MOT_THST_HOVER, where the parameter file or the model gives it, times the mass with payload "
    "over that without, times (V_full / V)² for the lowest voltage under load at the end of a segment; "
    "fires above 0.7.  Needs the battery's curve; PX4 has no hover throttle that is known beforehand.",
    fix="carry less, fly a shorter mission, or use a battery that sags less",
    instead="--payload, or the parameters of --params",
)


@judges(HOVER_THROTTLE_HIGH, needs=(ARDUPILOT, PACK, DISCHARGE))
def _hover_throttle_high(
    a: Assessment, parameters: ArduPilotParameters, pack: Battery, discharge: Discharge
) -> Iterator[Finding]:
    origin = parameters.origins.get("hover_throttle")
    if origin is None or origin.kind is OriginKind.DEFAULT or pack.ocv_v is None:
        return  # the default is of no vehicle in particular
    heavier = 1.0
    if a.vehicle.mass_kg and a.flight.power.mass_kg:
        heavier = a.flight.power.mass_kg / a.vehicle.mass_kg
    lowest = int(np.argmin(discharge.voltage_v))
    voltage_v = float(discharge.voltage_v[lowest])
    thrust = parameters.hover_throttle * heavier * (pack.ocv_v[-1] / voltage_v) ** 2
    if thrust > _MOST_HOVER_THRUST:
        yield a.finding(
            HOVER_THROTTLE_HIGH,
            f"hovering takes {quantity.percent(thrust)} of the thrust at "
            f"{quantity.decimals(voltage_v, 1)} V, {quantity.percent(parameters.hover_throttle)} when full",
            item=a.item_of(lowest),
        )
