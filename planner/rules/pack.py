"""Rules on the battery itself: whether it is one for the vehicle, and how cold it is."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.energy import BATTERY_COLD, BATTERY_VOLTAGE_DIFFERS
from planner.findings import Severity

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment

LEAST_SHARE, MOST_SHARE = 0.85, 1.18
"""Of the voltage of the vehicle's own battery: one cell of six fewer, or more, is outside."""
COLD_C, TOO_COLD_C = 0.0, -10.0
"""Below the first a lithium battery gives noticeably less than its label says, below the second nobody
knows how much."""


def check_pack_voltage(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a battery of another voltage is given than the vehicle's own."""
    own, pack = a.vehicle.battery, a.pack
    own_v = None if own is None else own.voltage_v
    given_v = None if pack is None else pack.voltage_v
    if own_v is None or given_v is None or LEAST_SHARE <= given_v / own_v <= MOST_SHARE:
        return
    yield BATTERY_VOLTAGE_DIFFERS.finding(
        f"the battery has {_volts(given_v)}, that of {a.vehicle.name} has {_volts(own_v)}"
    )


def check_cold(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the battery is colder than it is known at."""
    conditions, pack = a.conditions, a.pack
    battery_c = conditions.battery_temperature_c
    degrees_c = conditions.temperature_c if battery_c is None else battery_c
    if pack is None or degrees_c is None:
        return  # the standard atmosphere is no forecast
    known_c = pack.resistance_temperature_c
    coldest_c = COLD_C if known_c is None else min(known_c[0], COLD_C)
    if degrees_c >= coldest_c:
        return
    what = (
        "the battery" if battery_c is not None else "the battery, taken to be as cold as the air,"
    )
    known = (
        "it does not say what it gives in the cold"
        if known_c is None
        else f"its resistance is known from {quantity.temperature(known_c[0])} up"
    )
    yield BATTERY_COLD.finding(
        f"{what} has {quantity.temperature(degrees_c)}: {known}",
        severity=Severity.ERROR if degrees_c < min(coldest_c, TOO_COLD_C) else None,
    )


def _volts(voltage_v: float) -> str:
    return f"{quantity.decimals(voltage_v, 1)} V"
