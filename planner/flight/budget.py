"""The budget of a flight: what it takes, what the battery holds, what is left."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.homeward import return_energy_j
from planner.flight.segment import ItemArrival
from planner.mission.commands import command_name
from planner.units import MILLIAMPERE_HOURS_PER_AMPERE_HOUR, wh_from_j

if TYPE_CHECKING:
    from planner.flight.pilot import Pilot
    from planner.flight.prediction import Flight
    from planner.mission.items import Mission
    from planner.mission.stage import Route
    from planner.vehicle.battery import Battery


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """The whole flight, from the start of the take-off to disarmed on the ground."""

    time_s: float
    distance_m: float
    climb_m: float
    descent_m: float
    energy_wh: float
    """NaN where the power of the vehicle was not identified; powers too. [Wh]"""
    charge_mah: float | None
    """``None`` while no voltage is known. [mAh]"""
    mean_power_w: float
    peak_power_w: float
    energy_wh_p10: float | None = None
    """``None`` while the model carries no spread. [Wh]"""
    energy_wh_p90: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class BatteryBudget:
    """What the battery holds against what the flight takes."""

    capacity_wh: float
    usable_wh: float
    """Energy in the battery at the start: capacity times charge. [Wh]"""
    used_fraction: float
    """Energy of the flight over capacity. [-]"""
    reserve_fraction: float
    margin_wh: float
    """Usable energy less the reserve less the energy of the flight. [Wh]"""


@dataclass(frozen=True, slots=True, kw_only=True)
class ReturnBudget:
    """The point of the flight from which the way home is tightest."""

    tightest_item: int
    energy_home_wh: float
    """Energy to fly home and land from there. [Wh]"""
    margin_wh: float | None
    """Energy left there less the reserve less the way home; ``None`` with no battery. [Wh]"""


NOTHING_FLOWN = Totals(
    time_s=0.0,
    distance_m=0.0,
    climb_m=0.0,
    descent_m=0.0,
    energy_wh=0.0,
    charge_mah=None,
    mean_power_w=0.0,
    peak_power_w=0.0,
)
"""The totals of a mission that holds no flight."""


def flight_totals(flight: Flight, battery: Battery | None) -> Totals:
    """Return the totals of a flight; its charge at the battery's nominal voltage, if it has one."""
    columns = flight.motion.segments
    energy_wh = wh_from_j(flight.energy_j)
    voltage_v = None if battery is None else battery.voltage_v
    return Totals(
        time_s=flight.time_s,
        distance_m=float(columns.distance_m.sum()),
        climb_m=float(columns.climb_m[columns.climb_m > 0.0].sum()),
        descent_m=float(-columns.climb_m[columns.climb_m < 0.0].sum()),
        energy_wh=energy_wh,
        charge_mah=(
            None if voltage_v is None else energy_wh / voltage_v * MILLIAMPERE_HOURS_PER_AMPERE_HOUR
        ),
        mean_power_w=flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0,
        peak_power_w=flight.peak_power_w,
    )


def item_arrivals(mission: Mission, route: Route, flight: Flight) -> tuple[ItemArrival, ...]:
    """Return for every item of a mission when it is reached and the energy used by then.

    An item that only sets something is done when the item before it is.
    """
    motion = flight.motion
    end_s = np.concatenate(([0.0], motion.segments.end_s))
    energy_wh = np.concatenate(([0.0], np.cumsum(wh_from_j(flight.segment_energy_j))))
    arrivals = list(zip(route.stages, motion.arrival_segment.tolist(), strict=True))
    if len(arrivals) > 1 and arrivals[0][0].item == arrivals[1][0].item:
        del arrivals[0]  # a take-off the file does not hold serves its first flown item
    first: dict[int, int] = {}
    done, at = -1, 0
    for number in route.reached:
        if at < len(arrivals) and arrivals[at][0].item == number:
            done = arrivals[at][1]
            at += 1
        first.setdefault(number, done + 1)
    return tuple(
        ItemArrival(
            item=number,
            command=command_name(item.command),
            arrival_s=float(end_s[first[number]]) if number in first else None,
            energy_used_wh=float(energy_wh[first[number]]) if number in first else None,
        )
        for number, item in enumerate(mission.items, start=1)
    )


def battery_budget(
    totals: Totals, battery: Battery, *, charge: float, reserve: float
) -> BatteryBudget:
    """Return what a battery holds against the totals of a flight; charge and reserve as fractions."""
    capacity_wh = battery.energy_wh
    return BatteryBudget(
        capacity_wh=capacity_wh,
        usable_wh=capacity_wh * charge,
        used_fraction=totals.energy_wh / capacity_wh,
        reserve_fraction=reserve,
        margin_wh=capacity_wh * (charge - reserve) - totals.energy_wh,
    )


def way_home(
    route: Route, flight: Flight, pilot: Pilot, battery: BatteryBudget | None
) -> ReturnBudget | None:
    """Return the stage from which the way home is tightest; ``None`` with no stage in the air."""
    stage, home_j = return_energy_j(route, pilot, flight.power)
    if not len(stage):
        return None
    home_wh = wh_from_j(home_j)
    used_wh = np.concatenate(([0.0], np.cumsum(wh_from_j(flight.segment_energy_j))))[
        flight.motion.done_segment[stage] + 1
    ]
    tightest = int(np.argmax(used_wh + home_wh))
    margin_wh = None
    if battery is not None:
        above_reserve_wh = battery.usable_wh - battery.reserve_fraction * battery.capacity_wh
        margin_wh = above_reserve_wh - float(used_wh[tightest] + home_wh[tightest])
    return ReturnBudget(
        tightest_item=route.stages[stage[tightest]].item,
        energy_home_wh=float(home_wh[tightest]),
        margin_wh=margin_wh,
    )
