"""Rules on what the vehicle decides itself: failsafes, arming, the returns it has."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.catalogue.energy import (
    ARMING_REFUSED,
    FAILSAFE_BEFORE_END,
    HOVER_THROTTLE_HIGH,
    RALLY_UNREACHABLE,
)
from planner.findings import Severity
from planner.flight.failsafe import (
    RETURNS,
    WARNS,
    ardupilot_events,
    battery_course,
    px4_events,
)
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
)
from planner.mission.route.stage import StageKind
from planner.rules.energy import place_along
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import OriginKind

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.findings import Finding
    from planner.flight.failsafe import BatteryCourse, FailsafeEvent
    from planner.rules.assessment import Assessment

_MOST_RALLY_PLACES = 200
_MOST_HOVER_THRUST = 0.7
"""Share of the thrust above which a hover leaves too little for control. [-]"""
_GOES_DOWN = (STATE_INDEX[FlightState.LAND], STATE_INDEX[FlightState.DESCEND])


def _course(a: Assessment) -> BatteryCourse | None:
    if a.pack is None:
        return None
    return battery_course(a.returns, a.pack, a.discharge, charge=a.charge)


def check_failsafes(a: Assessment) -> Iterator[Finding]:
    """Yield where the vehicle's own battery failsafe would act before the mission lands."""
    course, parameters = _course(a), a.parameters
    if course is None or a.pack is None or parameters is None:
        return
    if isinstance(parameters, Px4Parameters):
        events = list(px4_events(a.returns, course, a.pack, parameters))
    else:
        events = list(ardupilot_events(course, parameters))
    events = [event for event in events if not _comes_too_late(a, event)]
    events.sort(key=lambda event: (event.segment, event.share))
    acting = [event for event in events if event.action != WARNS]
    warning = [event for event in events if event.action == WARNS]
    if acting:
        yield _told(a, acting[0], Severity.ERROR)
        warning = [
            event
            for event in warning
            if (event.segment, event.share) < (acting[0].segment, acting[0].share)
        ]
    if warning:
        yield _told(a, warning[0], Severity.INFO)


def _comes_too_late(a: Assessment, event: FailsafeEvent) -> bool:
    """Return whether the vehicle does by then what the failsafe would make it do."""
    returns = a.returns
    kind = a.route.stages[returns.segment_stage[event.segment]].kind
    if kind is StageKind.RETURN and event.action in {RETURNS, WARNS}:
        return True
    state = a.flight.motion.segments.state[event.segment]
    return kind in {StageKind.LAND, StageKind.RETURN} and state in _GOES_DOWN


def _told(a: Assessment, event: FailsafeEvent, severity: Severity) -> Finding:
    point = a.returns.flight_point(event.segment, event.share)
    return FAILSAFE_BEFORE_END.finding(
        f"the vehicle itself {event.action} at {place_along(point)}: {event.reading}",
        severity=severity,
        item=point.item,
        place=a.mission.items[point.item - 1].place,
    )


def check_arming(a: Assessment) -> Iterator[Finding]:
    """Yield what the battery at the start keeps the vehicle from arming by."""
    course, parameters = _course(a), a.parameters
    if course is None or parameters is None:
        return
    if isinstance(parameters, Px4Parameters):
        least, name = parameters.arm_battery_min_fraction, "COM_ARM_BAT_MIN"
        if least < 0.0:
            least, name = parameters.battery_critical_fraction, "BAT_CRIT_THR"
        charge = float(course.fraction[0])
        if charge < least:
            yield ARMING_REFUSED.finding(
                f"PX4 does not arm with {quantity.beside(charge, least, quantity.percent)} of the charge: "
                f"{name} is {quantity.percent(least)}"
            )
        return
    if course.rest_v is not None and course.rest_v[0] < parameters.arm_battery_min_v:
        yield ARMING_REFUSED.finding(
            f"ArduPilot does not arm with {quantity.decimals(float(course.rest_v[0]), 1)} V: "
            f"BATT_ARM_VOLT is {quantity.decimals(parameters.arm_battery_min_v, 1)} V"
        )
    if parameters.battery_capacity_ah < parameters.arm_battery_min_ah:
        yield ARMING_REFUSED.finding(
            f"ArduPilot never arms: BATT_ARM_MAH is "
            f"{quantity.charge(1000.0 * parameters.arm_battery_min_ah)}, BATT_CAPACITY "
            f"{quantity.charge(1000.0 * parameters.battery_capacity_ah)}"
        )


def check_rally(a: Assessment) -> Iterator[Finding]:
    """Yield rally points that are never chosen, or cannot be reached above the reserve."""
    rally = a.mission.rally
    if not rally or a.battery is None:
        return
    returns = a.returns
    ends = returns.stage_ends
    ends = ends[
        [
            a.route.stages[stage].kind not in {StageKind.LAND, StageKind.RETURN}
            for stage in returns.segment_stage[ends].tolist()
        ]
    ]
    if not len(ends):
        return
    if len(ends) > _MOST_RALLY_PLACES:
        ends = ends[np.linspace(0, len(ends) - 1, _MOST_RALLY_PLACES).astype(np.intp)]
    points = returns.points(ends, np.ones(len(ends)))
    chosen = np.unique(returns.chosen(points))
    above_wh = a.battery.usable_wh - a.battery.reserve_wh - points.used_wh - points.stop_wh
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
    for numbers_of, why in (
        (out_of_reach, f"cannot be reached above the reserve from any item: short by {short}"),
        (never, "is chosen from no item: the vehicle goes home or to another rally point"),
    ):
        if numbers_of:
            more = len(numbers_of) - 1
            rest = f" (and {more} more)" if more else ""
            yield RALLY_UNREACHABLE.finding(
                f"rally point {numbers_of[0]} {why}{rest}",
                severity=Severity.WARNING if numbers_of is out_of_reach else Severity.INFO,
                place=rally[numbers_of[0] - 1].place,
            )


def check_hover_throttle(a: Assessment) -> Iterator[Finding]:
    """Yield where hovering takes more of the thrust than leaves room for control."""
    parameters, pack, discharge = a.parameters, a.pack, a.discharge
    if parameters is None or isinstance(parameters, Px4Parameters):
        return
    origin = parameters.origins.get("hover_throttle")
    if origin is None or origin.kind is OriginKind.DEFAULT:
        return  # the default says nothing about this vehicle
    if discharge is None or pack is None or pack.ocv_v is None:
        return
    heavier = 1.0
    if a.vehicle.mass_kg and a.flight.power.mass_kg:
        heavier = a.flight.power.mass_kg / a.vehicle.mass_kg
    lowest = int(np.argmin(discharge.voltage_v))
    voltage_v = float(discharge.voltage_v[lowest])
    share = parameters.hover_throttle * heavier * (pack.ocv_v[-1] / voltage_v) ** 2
    if share <= _MOST_HOVER_THRUST:
        return
    item = int(a.flight.motion.segments.item[lowest])
    yield HOVER_THROTTLE_HIGH.finding(
        f"hovering takes {quantity.percent(share)} of the thrust that is there at "
        f"{quantity.decimals(voltage_v, 1)} V, {quantity.percent(parameters.hover_throttle)} when full",
        item=item,
        place=a.mission.items[item - 1].place,
    )


FAILSAFE_CHECKS: tuple[Callable[[Assessment], Iterator[Finding]], ...] = (
    check_failsafes,
    check_arming,
    check_rally,
    check_hover_throttle,
)
"""What is asked of flights with an autopilot's parameters and a battery."""
