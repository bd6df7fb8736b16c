"""Further battery monitors, each with failsafes and arming limits of its own."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Rule, Severity
from planner.flight.failsafe import PX4_BATTERY_ACTIONS, ardupilot_events, px4_events
from planner.rules.arming import is_checked
from planner.rules.arming_checks import BATTERY
from planner.rules.assessment import numbers
from planner.rules.battery_arming import (
    ARMING_REFUSED,
    never_armed_with,
    not_armed_by_px4,
    not_armed_with,
    profile_of,
    stated_name,
)
from planner.rules.declaration import ARDUPILOT, PACK, PX4, NotEvaluated, judges
from planner.rules.failsafe import (
    FAILSAFE_BEFORE_END,
    first_reported,
    has_landing,
    unwatched_by_px4,
)
from planner.values import replace
from planner.vehicle.parameters.table import OriginKind, parameter_table

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.battery import Battery
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters


_THRESHOLDS: Mapping[str, str] = {
    "battery_low_v": "battery_low_action",
    "battery_critical_v": "battery_critical_action",
    "battery_low_ah": "battery_low_action",
    "battery_critical_ah": "battery_critical_action",
}
"""Thresholds of ArduPilot's monitors, and which action each has."""

SECOND_BATTERY = Rule(
    "E128 further-battery-monitor",
    Severity.INFO,
    summary="The vehicle has further battery monitors, each with failsafes of its own.",
    why="Any of them returns, lands or refuses to arm as the first does.",
    how="ArduPilot: BATT2_ to BATT9_, BATTA_ to BATTG_ with a _MONITOR above 0; PX4: BAT2_ and BAT3_ with a "
    "_SOURCE of 0 or more.  One whose _CAPACITY is that of the battery that flies, to 10 %, is judged as the "
    "first (E103, E114); of any other a threshold that acts, and _ARM_VOLT, is not checked (X904).",
    fix="",
)
_SAME_PACK = 0.1
"""Capacities that differ by no more are those of one battery: labels, and what wear leaves. [-]"""


@judges(SECOND_BATTERY, FAILSAFE_BEFORE_END, ARMING_REFUSED, needs=(PACK, ARDUPILOT))
def _further_monitors(
    a: Assessment, pack: Battery, parameters: ArduPilotParameters
) -> Iterator[Finding | NotEvaluated]:
    values = numbers(a)
    profile = profile_of(a)
    for monitor in (f"BATT{number}" for number in "23456789ABCDEFG"):
        if values.get(f"{monitor}_MONITOR", 0.0) <= 0.0:
            continue
        own = _of_monitor(parameters, monitor, values)
        watched = [
            spelt
            for quantity_name, action in _THRESHOLDS.items()
            if (spelt := stated_name(own, quantity_name)) and getattr(own, quantity_name) > 0.0
            if getattr(own, action)
        ]
        yield a.finding(
            SECOND_BATTERY,
            f"battery monitor {monitor}: "
            + (f"acts by {', '.join(watched)}" if watched else "no threshold of it acts"),
        )
        if _is_pack(pack, values.get(f"{monitor}_CAPACITY")):
            lands = has_landing(a.mission)
            events = ardupilot_events(profile, own, has_landing=lands, monitor=monitor)
            yield from first_reported(a, list(events))
            if is_checked(a, BATTERY):
                yield from not_armed_with(a, profile, own, monitor)
            continue
        needs = f"what it feeds; {monitor}_CAPACITY is not that of the battery that flies"
        if watched:
            yield NotEvaluated(
                rule=FAILSAFE_BEFORE_END, asked_by=f"{watched[0]} of a further battery", needs=needs
            )
        if is_checked(a, BATTERY):
            yield from never_armed_with(a, own, monitor)
            if own.arm_battery_min_v > 0.0:
                yield NotEvaluated(
                    rule=ARMING_REFUSED,
                    asked_by=f"{monitor}_ARM_VOLT of a further battery",
                    needs=needs,
                )


def _of_monitor(
    parameters: ArduPilotParameters, monitor: str, values: Mapping[str, float]
) -> ArduPilotParameters:
    """Return the parameters with those of another monitor in the place of the first's."""
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.table import Origin

    given: dict[str, float] = {}
    origins = dict(parameters.origins)
    for name, row in parameter_table(ArduPilotParameters).items():
        if not row.now.name.startswith("BATT_"):
            continue
        spelt = row.now.name.replace("BATT", monitor, 1)
        value = values.get(spelt)
        given[name] = row.default_si if value is None else row.now.si(value)
        origins[name] = Origin(
            kind=OriginKind.DEFAULT if value is None else OriginKind.FILE, name=spelt
        )
    return replace(parameters, **given, origins=origins)


@judges(SECOND_BATTERY, FAILSAFE_BEFORE_END, ARMING_REFUSED, needs=(PACK, PX4))
def _further_batteries(
    a: Assessment, pack: Battery, parameters: Px4Parameters
) -> Iterator[Finding | NotEvaluated]:
    values = numbers(a)
    for name in ("BAT2", "BAT3"):
        if values.get(f"{name}_SOURCE", -1.0) < 0.0:
            continue
        yield a.finding(
            SECOND_BATTERY, f"{name}_SOURCE is {values[f'{name}_SOURCE']:g}: {name} counts too"
        )
        if not _is_pack(pack, values.get(f"{name}_CAPACITY")):
            if parameters.battery_action in PX4_BATTERY_ACTIONS:
                yield NotEvaluated(
                    rule=FAILSAFE_BEFORE_END,
                    asked_by=f"COM_LOW_BAT_ACT of {parameters.battery_action} by a further battery",
                    needs=f"what it feeds; {name}_CAPACITY is not that of the battery that flies",
                )
            continue
        own = replace(
            parameters,
            battery_source=0,
            battery_capacity_ah=values[f"{name}_CAPACITY"] / 1000.0,
            battery_cells=int(values.get(f"{name}_N_CELLS", 0.0)),
            battery_empty_cell_v=values.get(f"{name}_V_EMPTY", 3.6),
            battery_full_cell_v=values.get(f"{name}_V_CHARGED", 4.05),
            battery_cell_resistance_ohm=values.get(f"{name}_R_INTERNAL", -1.0),
        )
        profile = profile_of(a)
        if parameters.battery_action in PX4_BATTERY_ACTIONS:
            yield from first_reported(a, list(px4_events(a.returns, profile, pack, own)))
        yield from not_armed_by_px4(a, profile, pack, own, name)
        yield from unwatched_by_px4(a, profile, pack, own, name)


def _is_pack(pack: Battery, capacity_mah: float | None) -> bool:
    """Return whether a monitor counts the charge of the battery that flies."""
    full_ah = pack.charge_ah
    if capacity_mah is None or not full_ah:
        return False
    return abs(capacity_mah / 1000.0 / full_ah - 1.0) <= _SAME_PACK
