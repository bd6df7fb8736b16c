"""Rules on energy: the battery, the reserve, the way home."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import numbers
from planner.catalogue.energy import (
    BATTERY_UNKNOWN,
    RESERVE_BELOW_MINIMUM,
    RETURN_BELOW_RESERVE,
)

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.checks.case import Case
    from planner.findings import Finding


def check_battery(case: Case) -> Iterator[Finding]:
    """Yield a finding where no battery is known, or the flight eats into the reserve."""
    battery, needed_wh = case.battery, case.totals.energy_wh
    if not case.vehicle.is_power_known:
        return  # E109 says so
    if battery is None:
        yield BATTERY_UNKNOWN.finding(
            f"no battery is known: the flight needs {numbers.energy(needed_wh)}, "
            "the capacity is not given"
        )
        return
    if battery.margin_wh >= 0.0:
        return
    available_wh = battery.margin_wh + needed_wh
    item = next(
        (
            arrival.item
            for arrival in case.items
            if arrival.energy_used_wh is not None and arrival.energy_used_wh > available_wh
        ),
        None,
    )
    yield RESERVE_BELOW_MINIMUM.finding(
        f"the flight needs {numbers.energy(needed_wh)}, "
        f"{numbers.energy(max(available_wh, 0.0))} are there above the reserve of "
        f"{numbers.percent(battery.reserve_fraction)}: "
        f"short by {numbers.energy(-battery.margin_wh)}",
        item=item,
        place=None if item is None else case.mission.items[item - 1].place,
    )


def check_way_home(case: Case) -> Iterator[Finding]:
    """Yield a finding where the way home from some point eats into the reserve."""
    way = case.way_home
    if way is None or way.margin_wh is None or way.margin_wh >= 0.0:
        return
    yield RETURN_BELOW_RESERVE.finding(
        f"from here the way home takes {numbers.energy(way.energy_home_wh)}, "
        f"{numbers.energy(-way.margin_wh)} more than is left above the reserve",
        item=way.tightest_item,
        place=case.mission.items[way.tightest_item - 1].place,
    )
