"""The budget of a flight: what it takes, what the battery holds, what is left."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.segment import ItemArrival
from planner.frozen import frozen
from planner.mission.commands import command_name
from planner.mission.slots import make_many
from planner.units import (
    JOULES_PER_WATT_HOUR,
    MILLIAMPERE_HOURS_PER_AMPERE_HOUR,
    wh_from_j,
)

if TYPE_CHECKING:
    from planner.flight.discharge import Discharge
    from planner.flight.homeward import FlightPoint
    from planner.flight.prediction import Flight
    from planner.flight.reserve import Reserve
    from planner.flight.return_search import ReturnSearch
    from planner.mission.items import Mission
    from planner.mission.stage import Route
    from planner.vehicle.battery import Battery


@frozen
class Totals:
    """The whole flight, from the start of the take-off to disarmed on the ground."""

    time_s: float
    distance_m: float
    """Over the ground, what the vehicle wanders about its way included. [m]"""
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
    time_s_p10: float | None = None
    time_s_p90: float | None = None
    charge_mah_p10: float | None = None
    charge_mah_p90: float | None = None
    wander_m: float = 0.0
    """Share of the distance that no segment has: PX4 wanders with a noisy position. [m]"""


@frozen
class BatteryBudget:
    """What the battery holds against what the flight takes."""

    capacity_wh: float
    usable_wh: float
    """Energy in the battery at the start: down to the cut-off at the mean power of the flight where
    the battery's curve is known, else capacity times charge. [Wh]"""
    used_fraction: float
    """Energy of the flight over capacity. [-]"""
    reserve_fraction: float
    reserve_wh: float
    """Energy that is to stay in the battery. [Wh]"""
    margin_wh: float
    """Usable energy less the reserve less the energy of the flight. [Wh]"""
    reserve: Reserve | None = None
    """The reserve as it was asked for; ``None``: as a share."""
    hover_left_s: float | None = None
    """Time of hover that the energy left at landing would last. [s]"""
    charge_left_fraction: float | None = None
    """Of the full charge, at the end; these three are ``None`` without the battery's curve. [-]"""
    lowest_voltage_v: float | None = None
    """Under load, along the flight. [V]"""
    highest_c_rate: float | None = None
    """Highest current over the charge of the new battery. [h⁻¹]"""
    below_reserve_probability: float | None = None
    """Chance to land below the reserve; ``None`` while the model carries no spread. [-]"""

    @property
    def above_reserve_wh(self) -> float:
        """Energy that may be used before the reserve is touched. [Wh]"""
        return self.usable_wh - self.reserve_wh


@frozen
class ReturnBudget:
    """The point of the flight from which the way home is tightest.

    The way home leads where the vehicle itself would go: home, or a rally point.
    """

    tightest_item: int
    energy_home_wh: float
    """Energy to stop, fly home and land from there. [Wh]"""
    margin_wh: float | None
    """Energy left there less the reserve less the way home; ``None`` with no battery. [Wh]"""
    tightest: FlightPoint | None = None
    time_home_s: float | None = None
    """Time to stop, fly home and land from there. [s]"""
    destination: int = 0
    """Where the vehicle would return to from there: 0 for home, n for rally point n, −1 for the
    mission's landing, −2 along the mission, −3 for down where it is."""
    last_return: FlightPoint | None = None
    """The point of no return: the last from which it gets home above the reserve; ``None`` where it
    does from all."""
    last_return_empty: FlightPoint | None = None
    """The last from which it gets home at all, with nothing left; ``None`` where it does from all."""
    below_reserve_probability: float | None = None
    """Chance that some way home eats into the reserve; ``None`` without a spread. [-]"""


_NOT_FLOWN = (None, None)
"""Time of arrival and energy used by then of an item that is not flown."""

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


def flight_totals(
    flight: Flight, battery: Battery | None, discharge: Discharge | None = None
) -> Totals:
    """Return the totals of a flight.

    Its charge is that of the currents where they are predicted, else at the battery's nominal
    voltage, if it has one.
    """
    columns = flight.motion.segments
    energy_wh = wh_from_j(flight.energy_j)
    charge_ah = None if discharge is None else discharge.charge_ah
    if charge_ah is None and battery is not None and battery.voltage_v is not None:
        charge_ah = energy_wh / battery.voltage_v
    return Totals(
        time_s=flight.time_s,
        distance_m=float(columns.distance_m.sum()) + flight.motion.wander_m,
        climb_m=float(columns.climb_m[columns.climb_m > 0.0].sum()),
        descent_m=float(-columns.climb_m[columns.climb_m < 0.0].sum()),
        energy_wh=energy_wh,
        charge_mah=(None if charge_ah is None else charge_ah * MILLIAMPERE_HOURS_PER_AMPERE_HOUR),
        mean_power_w=flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0,
        peak_power_w=flight.peak_power_w,
        wander_m=flight.motion.wander_m,
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
    ends = list(first.values())
    reached = dict(
        zip(first, zip(end_s[ends].tolist(), energy_wh[ends].tolist(), strict=True), strict=True)
    )
    numbers = range(1, len(mission.items) + 1)
    rows = [reached.get(number, _NOT_FLOWN) for number in numbers]
    names = [command_name(item.command) for item in mission.items]
    return tuple(make_many(ItemArrival, (numbers, names, *zip(*rows, strict=True))))


def battery_budget(
    totals: Totals,
    battery: Battery,
    *,
    charge: float,
    reserve: Reserve,
    hover_power_w: float,
    discharge: Discharge | None = None,
) -> BatteryBudget:
    """Return what a battery holds against the totals of a flight.

    Parameters
    ----------
    totals : Totals
        Of the flight.
    battery : Battery
        Its energy.
    charge : float
        Share of the capacity at the start. [-]
    reserve : Reserve
        What is to stay.
    hover_power_w : float
        Power of a hover over the landing place. [W]
    discharge : Discharge, optional
        What is known of voltages and currents.
    """
    capacity_wh = battery.energy_wh
    usable_wh = capacity_wh * charge if discharge is None else discharge.usable_wh
    reserve_wh = reserve.wh(capacity_wh=capacity_wh, hover_power_w=hover_power_w)
    left_wh = usable_wh - totals.energy_wh
    budget = BatteryBudget(
        capacity_wh=capacity_wh,
        usable_wh=usable_wh,
        used_fraction=totals.energy_wh / capacity_wh,
        reserve_fraction=reserve_wh / capacity_wh if reserve.fraction is None else reserve.fraction,
        reserve_wh=reserve_wh,
        reserve=reserve,
        margin_wh=usable_wh - reserve_wh - totals.energy_wh,
        hover_left_s=(
            max(left_wh, 0.0) * JOULES_PER_WATT_HOUR / hover_power_w
            if hover_power_w > 0.0
            else None
        ),
    )
    if discharge is None or battery.new_charge_ah is None:
        return budget
    return replace(
        budget,
        charge_left_fraction=float(discharge.state_of_charge[-1]),
        lowest_voltage_v=discharge.lowest_voltage_v,
        highest_c_rate=discharge.highest_current_a / battery.new_charge_ah,
    )


def way_home_limits_wh(battery: BatteryBudget | None) -> tuple[float, ...]:
    """Return the energies that ways home are held against: without the reserve, and with it. [Wh]"""
    return () if battery is None else (battery.above_reserve_wh, battery.usable_wh)


def way_home(search: ReturnSearch, battery: BatteryBudget | None) -> ReturnBudget | None:
    """Return the point from which the way home is tightest; ``None`` with no point in the air.

    Parameters
    ----------
    search : ReturnSearch
        The ways home.
    battery : BatteryBudget or None
        What it has to be done with; ``None``: not known.
    """
    homeward = search.homeward
    tightest = search.tightest()
    if tightest is None or search.nodes is None:
        return None
    nodes = search.nodes
    budget = ReturnBudget(
        tightest_item=homeward.route.stages[homeward.segment_stage[nodes.segment[tightest]]].item,
        energy_home_wh=float(nodes.way_wh[tightest]),
        margin_wh=None,
        tightest=homeward.flight_point(*nodes.at(tightest)),
        time_home_s=float(nodes.way_s[tightest]),
        destination=int(nodes.destination[tightest]),
    )
    if battery is None:
        return budget
    above_reserve_wh = battery.above_reserve_wh
    needed_wh = float(nodes.sum_wh[tightest])
    budget = replace(budget, margin_wh=above_reserve_wh - needed_wh)
    if needed_wh <= above_reserve_wh:
        return budget
    last, dry = search.last_below(*way_home_limits_wh(battery))
    found = homeward.flight_points([search.nodes.at(row) for row in (last, dry) if row is not None])
    return replace(
        budget,
        last_return=None if last is None else found[0],
        last_return_empty=None if dry is None else found[-1],
    )
