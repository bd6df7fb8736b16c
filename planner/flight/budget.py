"""The budget of a flight: what it takes, what the battery holds, what is left."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.prediction import ItemArrival
from planner.mission.commands import command_name
from planner.quantity import mean_of
from planner.setup import Reserve
from planner.units import JOULES_PER_WATT_HOUR, MILLIAMPERE_HOURS_PER_AMPERE_HOUR, wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.prediction import Flight
    from planner.flight.returns.path import FlownReturns
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.setup import Setup
    from planner.vehicle.battery import Battery


class Totals(Value):
    """The whole flight, from the start of the take-off to disarmed on the ground."""

    time_s: float = 0.0
    distance_m: float = 0.0
    """Over the ground, what the vehicle wanders about its way included. [m]"""
    climb_m: float = 0.0
    descent_m: float = 0.0
    energy_wh: float = 0.0
    """NaN where the power of the vehicle was not identified; powers too. [Wh]"""
    charge_mah: float | None = None
    """``None`` while no voltage is known. [mAh]"""
    mean_power_w: float = 0.0
    peak_power_w: float = 0.0
    energy_wh_p10: float | None = None
    """``None`` while the model carries no spread. [Wh]"""
    energy_wh_p90: float | None = None
    time_s_p10: float | None = None
    time_s_p90: float | None = None
    charge_mah_p10: float | None = None
    charge_mah_p90: float | None = None
    wander_m: float = 0.0
    """Part of the distance that no segment has: PX4 wanders with a noisy position, drag carries ArduPilot
    past its stops and wide of splines. [m]"""


class BatteryBudget(Value):
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
    """The reserve as it was asked for; ``None``: as a fraction."""
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
    empty_probability: float | None = None
    """Chance that the battery is empty before the landing; ``None`` as above. [-]"""

    @property
    def above_reserve_wh(self) -> float:
        """Energy that may be used before the reserve is touched. [Wh]"""
        return self.usable_wh - self.reserve_wh


NOTHING_FLOWN = Totals()
"""The totals of a mission that holds no flight."""


def flight_totals(
    flight: Flight, battery: Battery | None, discharge: Discharge | None = None
) -> Totals:
    """Return the totals of a flight.

    Its charge is that of the currents where they are predicted, else at the battery's nominal
    voltage, if it has one.
    """
    energy_wh = wh_from_j(flight.energy_j)
    climb_m, descent_m = flight.motion.climbed_m
    charge_ah = None if discharge is None else discharge.charge_ah
    if charge_ah is None and battery is not None and battery.voltage_v is not None:
        charge_ah = energy_wh / battery.voltage_v
    return Totals(
        time_s=flight.time_s,
        distance_m=flight.motion.distance_m,
        climb_m=climb_m,
        descent_m=descent_m,
        energy_wh=energy_wh,
        charge_mah=(None if charge_ah is None else charge_ah * MILLIAMPERE_HOURS_PER_AMPERE_HOUR),
        mean_power_w=flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0,
        peak_power_w=flight.peak_power_w,
        wander_m=flight.motion.wander_m,
    )


def item_arrivals(mission: Mission, route: Route, flight: Flight) -> tuple[ItemArrival, ...]:
    """Return for every item of a mission when it is reached and left, and the energy used by then.

    An item that only sets something is reached and left when the item before it is left.
    """
    motion = flight.motion
    end_s = np.concatenate(([0.0], motion.segments.end_s))
    energy_wh = np.concatenate(([0.0], np.cumsum(wh_from_j(flight.segment_energy_j))))
    left = np.maximum.accumulate(motion.done_segment)
    stages = list(zip(route.stages, _reached(motion).tolist(), left.tolist(), strict=True))
    if len(stages) > 1 and stages[0][0].item == stages[1][0].item:
        del stages[0]  # a take-off the file does not hold serves its first flown item
    reached, gone = [], []
    left_at, at = 0, 0
    for number in route.reached:
        reached_at = left_at
        if at < len(stages) and stages[at][0].item == number:
            while stages[at][0].is_underway:
                at += 1
            reached_at, left_at = stages[at][1] + 1, stages[at][2] + 1
            at += 1
        reached.append(reached_at)
        gone.append(left_at)
    times = (end_s[reached].tolist(), energy_wh[reached].tolist(), end_s[gone].tolist())
    passes: dict[int, list[tuple[float, float, float]]] = {}
    for number, one in zip(route.reached, zip(*times, strict=True), strict=True):
        passes.setdefault(number, []).append(one)
    rows = []
    for number, item in enumerate(mission.items, 1):
        name = command_name(item.command)
        if own := passes.get(number):
            first, *later = own
            rows.append(ItemArrival(number, name, *first, tuple(later)))
        else:
            rows.append(ItemArrival(number, name, None, None))
    return tuple(rows)


def _reached(motion: Motion) -> IntArray:
    """Return for each stage the last segment before it holds at its place; −1 for none. (stages,)

    Some autopilots report an item only after its hold.
    """
    state, arrival = motion.segments.state, motion.arrival_segment
    moving = np.where(state != STATE_INDEX[FlightState.HOVER], np.arange(len(state)), -1)
    before = np.append(-1, np.maximum.accumulate(motion.done_segment)[:-1])
    reached = np.maximum(np.maximum.accumulate(moving)[arrival], before)
    return np.where(arrival < 0, arrival, np.minimum(reached, arrival))


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
    totals, battery, reserve, discharge
        The flight's totals, what it flies with, what is to stay, what is known of voltages.
    charge : float
        Fraction of the capacity at the start. [-]
    hover_power_w : float
        Power of a hover over the landing place. [W]
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


class Discharge(Value, eq=False):
    """What a flight takes out of a battery, as columns over its segments and in figures."""

    state_of_charge: FloatArray
    """At the end of each segment; negative where the battery is empty before. (n,) [-]"""
    voltage_v: FloatArray
    """Under load, at the end of each segment. (n,) [V]"""
    current_a: FloatArray
    """At the end of each segment. (n,) [A]"""
    lowest_voltage_v: float
    """Under the highest load near each moment of the flight. [V]"""
    lowest_voltage_segment: int
    can_deliver: bool
    """Whether the battery has the power for every moment of the flight."""
    highest_current_a: float
    highest_current_segment: int
    charge_ah: float
    """Charge the flight takes. [Ah]"""
    usable_wh: float
    """Energy from the charge at the start down to the cut-off, at the mean power. [Wh]"""


def battery_temperature_c(setup: Setup, flight: Flight) -> float:
    """Return the temperature of the battery: as set, else that of the air at home. [°C]"""
    if setup.battery_temperature_c is not None:
        return setup.battery_temperature_c
    return flight.power.home_temperature_c


def predict_discharge(
    flight: Flight, battery: Battery, *, charge: float, temperature_c: float
) -> Discharge | None:
    """Return what a flight takes out of a battery whose curve and resistance are known.

    ``None`` where the charge, the open-circuit curve or the resistance of the battery is not known,
    where the power of the flight is not, and where nothing is flown.

    Parameters
    ----------
    charge : float
        State of charge at the start. [-]
    temperature_c : float
        Temperature of the battery. [°C]
    """
    circuit = battery.circuit(temperature_c)
    motion = flight.motion
    if circuit is None or not len(motion.piece_segment):
        return None
    loads = flight.loads
    left = circuit.state_of_charge_after(
        loads.mean_w, loads.variance_w2, motion.piece_duration_s, from_soc=charge
    )
    # The charge at the end of a piece is its lowest: what the peak of the piece meets is no less.
    open_v = circuit.open_circuit_v(left)
    peak_w = loads.peak_w
    peak_v = circuit.loaded_v(open_v, peak_w)
    lowest, strongest = int(np.argmin(peak_v)), int(np.argmax(peak_w / peak_v))

    last = motion.last_piece
    end_w = loads.end_w[last]
    end_v = circuit.loaded_v(open_v[last], end_w)
    used_w = flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0
    empty = circuit.empty_state_of_charge(used_w, battery.cutoff_voltage_v or 0.0)
    return Discharge(
        state_of_charge=left[last],
        voltage_v=end_v,
        current_a=end_w / end_v,
        lowest_voltage_v=float(peak_v[lowest]),
        lowest_voltage_segment=int(motion.piece_segment[lowest]),
        can_deliver=bool((open_v * open_v >= 4.0 * circuit.resistance_ohm * peak_w).all()),
        highest_current_a=float(peak_w[strongest] / peak_v[strongest]),
        highest_current_segment=int(motion.piece_segment[strongest]),
        charge_ah=circuit.capacity_ah * (charge - float(left[-1])),
        usable_wh=circuit.delivered_wh(used_w, charge, empty),
    )


class FlightBattery(Value, eq=False):
    """What a flight takes, and what it leaves of the pack it flies with."""

    pack: Battery | None
    """As worn as it is; ``None``: none is known."""
    discharge: Discharge | None
    """``None``: the power or what the pack needs for it is not known."""
    totals: Totals
    budget: BatteryBudget | None
    """``None``: the power or the pack is not known."""


def flight_battery(flight: Flight, setup: Setup) -> FlightBattery:
    """Return what a flight takes, and what it leaves of the pack of a setup."""
    pack = setup.flown_pack.battery
    if pack is not None:
        pack = pack.aged(
            health=setup.battery_health, resistance_factor=setup.battery_resistance_factor
        )
    if pack is None or not setup.vehicle.is_power_known:
        totals = flight_totals(flight, pack)
        return FlightBattery(pack=pack, discharge=None, totals=totals, budget=None)
    charge, reserve = mean_of(setup.charge), setup.reserve
    discharge = predict_discharge(
        flight, pack, charge=charge, temperature_c=battery_temperature_c(setup, flight)
    )
    totals = flight_totals(flight, pack, discharge)
    budget = battery_budget(
        totals,
        pack,
        charge=charge,
        reserve=reserve if isinstance(reserve, Reserve) else Reserve(fraction=float(reserve)),
        hover_power_w=flight.hover_near_home_w,
        discharge=discharge,
    )
    return FlightBattery(pack=pack, discharge=discharge, totals=totals, budget=budget)


class ReturnDischarge(Value, eq=False):
    """What holds and returns from n points of a flight ask of its battery."""

    lowest_voltage_v: FloatArray
    """Under the highest load of the hover there and of each moment of the return. (n,) [V]"""
    end_voltage_v: FloatArray
    """Under load, at the lowest of the ends of the parts of the return. (n,) [V]"""
    can_deliver: BoolArray
    """Whether the battery has the power for every moment of it. (n,)"""


def predict_return_discharge(
    returns: FlownReturns, flight: Flight, battery: Battery, discharge: Discharge, setup: Setup
) -> ReturnDischarge | None:
    """Return what holds and returns ask of a battery, from the charge that is left where they begin."""
    circuit = battery.circuit(battery_temperature_c(setup, flight))
    if circuit is None:
        return None
    points, loads = returns.points, returns.loads
    soc = np.concatenate(([mean_of(setup.charge)], discharge.state_of_charge))
    before, after = soc[points.segment], soc[points.segment + 1]
    begun = before + points.fraction * (after - before)
    left = circuit.state_of_charge_after(
        loads.mean_w, loads.variance_w2, loads.duration_s, from_soc=begun[:, None]
    )
    open_v = circuit.open_circuit_v(left)
    return ReturnDischarge(
        lowest_voltage_v=circuit.loaded_v(open_v, loads.peak_w).min(axis=1),
        end_voltage_v=circuit.loaded_v(open_v, loads.end_w).min(axis=1),
        can_deliver=np.all(open_v * open_v >= 4.0 * circuit.resistance_ohm * loads.peak_w, axis=1),
    )
