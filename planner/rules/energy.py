"""Rules on energy: the battery, the reserve, the way home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.energy import (
    BATTERY_UNKNOWN,
    DISCHARGE_RATE_HIGH,
    RESERVE_AT_RISK,
    RESERVE_BELOW_MINIMUM,
    RETURN_BELOW_RESERVE,
    VOLTAGE_LOW,
)
from planner.flight.returns.destination import ALONG, HERE, HOME, LANDING

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.flight.returns.path import FlightPoint
    from planner.rules.assessment import Assessment

_SAME_SHORTFALL = 0.05
"""E102 leaves its shortfall to E101 where they differ by no more than this share. [-]"""
_AT_THE_END = 0.995
"""A point this far along its leg is at its end. [-]"""


def check_battery(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where no battery is known, or the flight eats into the reserve."""
    battery, needed_wh = a.battery, a.totals.energy_wh
    if not a.vehicle.is_power_known:
        return  # E109 says so
    if battery is None:
        yield BATTERY_UNKNOWN.finding(
            f"no battery is known: the flight needs {quantity.energy(needed_wh)}, "
            "the capacity is not given"
        )
        return
    if battery.margin_wh >= 0.0:
        return
    available_wh = battery.margin_wh + needed_wh
    item = next(
        (
            arrival.item
            for arrival in a.items
            if arrival.energy_used_wh is not None and arrival.energy_used_wh > available_wh
        ),
        None,
    )
    reserve = f"the reserve of {reserve_name(battery)}"
    there = (
        f"{quantity.energy(available_wh)} are there above {reserve}"
        if available_wh >= 0.0
        else f"and the battery starts {quantity.energy(-available_wh)} below {reserve}"
    )
    yield RESERVE_BELOW_MINIMUM.finding(
        f"the flight needs {quantity.energy(needed_wh)}, {there}: "
        f"short by {quantity.energy(-battery.margin_wh)}",
        item=item,
        place=None if item is None else a.mission.items[item - 1].place,
    )


def check_return(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the way home from some point eats into the reserve."""
    way, battery = a.return_plan, a.battery
    if way is None or battery is None or way.margin_wh is None or way.margin_wh >= 0.0:
        return
    turn, empty = way.last_return, way.last_return_empty
    reach = "from nowhere" if turn is None else f"only up to {place_along(turn)}"
    message = f"gets {destination_name(way.destination)} above the reserve {reach}"
    if empty is not None and (turn is None or place_along(empty) != place_along(turn)):
        message += f", and at all only up to {place_along(empty)}"
    if battery.margin_wh >= 0.0 or way.margin_wh < (1.0 + _SAME_SHORTFALL) * battery.margin_wh:
        worst = f"item {way.tightest_item}" if way.tightest is None else place_along(way.tightest)
        message += (
            f": from {worst} the way takes {quantity.energy(way.energy_home_wh)}, "
            f"{quantity.energy(-way.margin_wh)} more than is left"
        )
    item = way.tightest_item if turn is None else turn.item
    yield RETURN_BELOW_RESERVE.finding(message, item=item, place=a.mission.items[item - 1].place)


def reserve_name(battery: BatteryBudget) -> str:
    """Return the reserve as it was asked for: ``20 %``, ``12.0 Wh``, ``3 min 00 s of hover``."""
    if battery.reserve is None:
        return quantity.percent(battery.reserve_fraction)
    return str(battery.reserve)


def place_along(point: FlightPoint) -> str:
    """Return a point of a flight in words: ``item 7, 120 m along its leg``."""
    if point.along_m < _AT_THE_END * point.leg_m:
        return f"item {point.item}, {quantity.distance(point.along_m)} along its leg"
    return f"item {point.item}"


def destination_name(destination: int) -> str:
    """Return where a return leads in words: ``home``, ``to rally point 2``."""
    if destination > HOME:
        return f"to rally point {destination}"
    return {
        LANDING: "to the mission's landing",
        ALONG: "back along the mission",
        HERE: "down where it is",
    }.get(destination, "home")


def check_risk(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where flights that differ from the prediction may eat into the reserve."""
    battery, way = a.battery, a.return_plan
    if battery is None or battery.below_reserve_probability is None or battery.margin_wh < 0.0:
        return  # nothing is known of it, or E101 says worse
    reserve = f"the reserve of {reserve_name(battery)}"
    more = f"more than {quantity.percent(a.risk)}"
    landing, returning = battery.below_reserve_probability, None
    if way is not None and way.margin_wh is not None and way.margin_wh >= 0.0:
        returning = way.below_reserve_probability
    if landing > a.risk:
        yield RESERVE_AT_RISK.finding(
            f"{quantity.beside(landing, a.risk, quantity.chance)} chance to land below {reserve}, {more}"
        )
    elif way is not None and returning is not None and returning > a.risk:
        yield RESERVE_AT_RISK.finding(
            f"{quantity.beside(returning, a.risk, quantity.chance)} chance that the way home from here, "
            f"or from another point, ends below {reserve}, {more}",
            item=way.tightest_item,
            place=a.mission.items[way.tightest_item - 1].place,
        )


def check_voltage(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the voltage under load falls below the cut-off of the battery."""
    discharge = a.discharge
    if a.pack is None or discharge is None:
        return
    cutoff_v, lowest_v = a.pack.cutoff_voltage_v, discharge.lowest_voltage_v
    if not discharge.can_deliver:
        message = (
            f"the battery cannot deliver the power asked of it: {quantity.decimals(lowest_v, 1)} V "
            "is left at its terminals"
        )
    elif cutoff_v is not None and lowest_v < cutoff_v:
        message = (
            f"{quantity.beside(lowest_v, cutoff_v, _volts)} under load, the battery counts as empty at "
            f"{_volts(cutoff_v)}"
        )
    else:
        return
    item = int(a.flight.motion.segments.item[discharge.lowest_voltage_segment])
    yield VOLTAGE_LOW.finding(message, item=item, place=a.mission.items[item - 1].place)


def _volts(voltage_v: float) -> str:
    return f"{quantity.decimals(voltage_v, 1)} V"


def _rate(rate: float) -> str:
    return quantity.decimals(rate, 1)


def check_discharge_rate(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where more current is drawn than the battery is made for."""
    budget, discharge, pack = a.battery, a.discharge, a.pack
    if budget is None or discharge is None or pack is None or pack.max_c_rate is None:
        return
    rate = budget.highest_c_rate
    if rate is None or rate <= pack.max_c_rate:
        return
    item = int(a.flight.motion.segments.item[discharge.highest_current_segment])
    yield DISCHARGE_RATE_HIGH.finding(
        f"up to {quantity.decimals(discharge.highest_current_a, 0)} A, "
        f"{quantity.beside(rate, pack.max_c_rate, _rate)} times the charge an hour, "
        f"the battery is made for {_rate(pack.max_c_rate)}",
        item=item,
        place=a.mission.items[item - 1].place,
    )
