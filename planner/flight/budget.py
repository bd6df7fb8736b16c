"""The budget of a flight: what it takes, what the battery holds, what is left."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.prediction import ItemArrival
from planner.mission.commands import command_name
from planner.physics.battery import joined
from planner.quantity import mean_of
from planner.setup import Reserve
from planner.units import (
    JOULES_PER_WATT_HOUR,
    MILLIAMPERE_HOURS_PER_AMPERE_HOUR,
    SECONDS_PER_HOUR,
    wh_from_j,
)
from planner.values import Value, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.flight.prediction import Flight
    from planner.flight.returns.path import FlownReturns, ReturnPoints
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
    from planner.physics.battery import BatteryCircuit
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


MOST_CHANCE_EMPTY = 0.01
"""Of landing with an empty battery, or of an empty one before home: one flight of a hundred is lost."""


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
    empty_factor: float | None = None
    """How many times as much all flights may take until `MOST_CHANCE_EMPTY` of them, or of their returns,
    end with an empty battery; ``None`` as above. [-]"""

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
    stages = [stage.item for stage in route.stages]
    underway = [stage.is_underway for stage in route.stages]
    # ends of segments, of which none is the beginning of the flight
    arrived = (_reached(motion) + 1).tolist()
    left = (np.maximum.accumulate(motion.done_segment) + 1).tolist()
    # a take-off the file does not hold serves its first flown item
    at = int(len(stages) > 1 and stages[0] == stages[1])
    reached, gone, left_at = [], [], 0
    for number in route.reached:
        reached_at = left_at
        if at < len(stages) and stages[at] == number:
            while underway[at]:
                at += 1
            reached_at, left_at = arrived[at], left[at]
            at += 1
        reached.append(reached_at)
        gone.append(left_at)
    times = (end_s[reached].tolist(), energy_wh[reached].tolist(), end_s[gone].tolist())
    first: dict[int, tuple[float, float, float]] = {}
    later: dict[int, list[tuple[float, float, float]]] = {}
    for number, one in zip(route.reached, zip(*times, strict=True), strict=True):
        if first.setdefault(number, one) is not one:
            later.setdefault(number, []).append(one)
    rows = []
    for number, item in enumerate(mission.items, 1):
        name, further = command_name(item.command), tuple(later.get(number, ()))
        arrival_s, used_wh, left_s = first.get(number, (None, None, None))
        rows.append(ItemArrival(number, name, arrival_s, used_wh, left_s, further))
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
    lowest_voltage_v: float
    """Under the highest load near each moment of the flight. [V]"""
    lowest_voltage_segment: int
    can_deliver: bool
    """Whether the battery has the power for every moment of the flight."""
    highest_current_a: float
    """While there is charge left. [A]"""
    highest_current_segment: int
    charge_ah: float
    """Charge the flight takes. [Ah]"""
    usable_wh: float
    """Energy from the charge at the start down to the cut-off, at the mean power. [Wh]"""
    packs: ParallelPacks
    """That it was worked out with, this battery among them."""
    pack: int
    """Position in these."""


def battery_temperature_c(setup: Setup, flight: Flight) -> float:
    """Return the temperature of the battery: as set, else that of the air at home. [°C]"""
    if setup.battery_temperature_c is not None:
        return setup.battery_temperature_c
    return flight.power.home_temperature_c


_MOST_SAG, _ROUNDING = 0.24, 1e-9


class ChargedPack(Value, eq=False):
    """A battery as it is when a flight begins."""

    battery: Battery
    """As worn as it is."""
    charge: float
    """State of charge. [-]"""
    temperature_c: float


class ParallelPacks(Value, eq=False, dict=True):
    """k packs of one curve that a flight might be flown with, worked out in one."""

    circuits: Sequence[BatteryCircuit]
    state_of_charge: FloatArray
    """At the start of the flight and at the end of each of its n segments. (n + 1, k) [-]"""

    def charge_at(self, points: ReturnPoints, packs: int | slice) -> FloatArray:
        """Return what some of the packs have left at points of the flight. (k, points) or (points,) [-]"""
        soc = self.state_of_charge.T[packs]
        before, after = soc[..., points.segment], soc[..., points.segment + 1]
        return np.asarray(before + points.fraction * (after - before))

    @cached_property
    def of_returns(self) -> dict[int, tuple[FlownReturns, Sequence[ReturnDischarge]]]:
        """What returns were found to ask of each, by the identity of the returns."""
        return {}


_DISCHARGED_TOGETHER = 12
"""So many packs are discharged in one: of more, the arrays leave the cache of a core."""


def predict_discharges(
    flight: Flight, packs: Sequence[ChargedPack]
) -> tuple[Discharge | None, ...]:
    """Return what a flight takes out of each of several packs.

    ``None`` where the charge, the open-circuit curve or the resistance of the battery is not known,
    where the power of the flight is not, and where nothing is flown.
    """
    found: list[Discharge | None] = [None] * len(packs)
    alike: dict[tuple[tuple[float, ...], tuple[float, ...]], list[tuple[int, BatteryCircuit]]] = {}
    for number, one in enumerate(packs):
        circuit = one.battery.circuit(one.temperature_c)
        if circuit is not None and len(flight.motion.piece_segment):
            alike.setdefault((circuit.ocv_soc, circuit.ocv_v), []).append((number, circuit))
    for members in alike.values():
        for first in range(0, len(members), _DISCHARGED_TOGETHER):
            numbers, circuits = zip(*members[first : first + _DISCHARGED_TOGETHER], strict=True)
            discharges = _discharges(flight, [packs[n] for n in numbers], circuits)
            for number, discharge in zip(numbers, discharges, strict=True):
                found[number] = discharge
    return tuple(found)


def _discharges(
    flight: Flight, packs: Sequence[ChargedPack], circuits: Sequence[BatteryCircuit]
) -> Iterator[Discharge]:
    """Yield what a flight takes out of each of some packs of one curve."""
    motion, loads = flight.motion, flight.loads
    circuit = joined(circuits)
    charge = np.array([one.charge for one in packs])
    left = circuit.state_of_charge_after(
        loads.mean_w[:, None],
        loads.variance_w2[:, None],
        motion.piece_duration_s[:, None],
        from_soc=charge,
    )
    # The charge at the end of a piece is its lowest: what the peak of the piece meets is no less.
    open_v = circuit.open_circuit_v(left)
    peak_w = loads.peak_w[:, None]
    peak_v, can_deliver = circuit.loaded_v(open_v, peak_w), circuit.can_deliver(open_v, peak_w)
    current_a = np.where(left > 0.0, peak_w / peak_v, 0.0)  # an empty pack gives none
    lowest, strongest = peak_v.argmin(axis=0), current_a.argmax(axis=0)

    last = motion.last_piece
    soc = np.concatenate((charge[None], left[last]))
    end_v = circuit.loaded_v(open_v[last], loads.end_w[last, None])
    used_w = flight.energy_j / flight.time_s if flight.time_s > 0.0 else 0.0
    together = ParallelPacks(circuits=circuits, state_of_charge=soc)
    columns = np.ascontiguousarray(soc[1:].T), np.ascontiguousarray(end_v.T)
    for number, (one, own, low, high, state_of_charge, voltage_v) in enumerate(
        zip(packs, circuits, lowest.tolist(), strongest.tolist(), *columns, strict=True)
    ):
        empty = own.empty_state_of_charge(used_w, one.battery.cutoff_voltage_v or 0.0)
        yield Discharge(
            state_of_charge=state_of_charge,
            voltage_v=voltage_v,
            lowest_voltage_v=float(peak_v[low, number]),
            lowest_voltage_segment=int(motion.piece_segment[low]),
            can_deliver=bool(can_deliver[number]),
            highest_current_a=float(current_a[high, number]),
            highest_current_segment=int(motion.piece_segment[high]),
            charge_ah=own.capacity_ah * (one.charge - float(left[-1, number])),
            usable_wh=own.delivered_wh(used_w, one.charge, empty),
            packs=together,
            pack=number,
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
    [battery] = flight_batteries(flight, [setup])
    return battery


def flight_batteries(flight: Flight, setups: Sequence[Setup]) -> tuple[FlightBattery, ...]:
    """Return what a flight takes, and what it leaves of the packs of setups that differ in these alone."""
    packs = [_flown_pack(flight, setup) for setup in setups]
    is_known = setups[0].vehicle.is_power_known
    counted = [pack for pack in packs if pack is not None and is_known]
    discharges = iter(predict_discharges(flight, counted))
    return tuple(
        _flight_battery(flight, setup, pack, next(discharges, None) if pack is not None else None)
        for setup, pack in zip(setups, packs, strict=True)
    )


def _flown_pack(flight: Flight, setup: Setup) -> ChargedPack | None:
    pack = setup.flown_pack.battery
    if pack is None:
        return None
    worn = pack.aged(health=setup.battery_health, resistance_factor=setup.battery_resistance_factor)
    return ChargedPack(
        battery=worn,
        charge=mean_of(setup.charge),
        temperature_c=battery_temperature_c(setup, flight),
    )


def _flight_battery(
    flight: Flight, setup: Setup, pack: ChargedPack | None, discharge: Discharge | None
) -> FlightBattery:
    worn = None if pack is None else pack.battery
    totals = flight_totals(flight, worn, discharge)
    if pack is None or not setup.vehicle.is_power_known:
        return FlightBattery(pack=worn, discharge=None, totals=totals, budget=None)
    reserve = setup.reserve
    budget = battery_budget(
        totals,
        pack.battery,
        charge=pack.charge,
        reserve=reserve if isinstance(reserve, Reserve) else Reserve(fraction=float(reserve)),
        hover_power_w=flight.hover_near_home_w,
        discharge=discharge,
    )
    return FlightBattery(pack=worn, discharge=discharge, totals=totals, budget=budget)


class ReturnDischarge(Value, eq=False, kw_only=False):
    """What holds and returns from n points of a flight ask of its battery."""

    lowest_voltage_v: FloatArray
    """Under the highest load of the hover there and of each moment of the return. (n,) [V]"""
    end_voltage_v: FloatArray
    """Under load, at the lowest of the ends of the parts of the return. (n,) [V]"""
    can_deliver: BoolArray
    """Whether the battery has the power for every moment of it. (n,)"""


def stay_above(returns: FlownReturns, discharge: Discharge, voltage_v: float) -> bool:
    r"""Return whether no hold and no return brings a battery below a voltage; if not, they may.

    Much less work than `predict_return_discharge`, and enough for most packs.

    Notes
    -----
    Above the charge at which the highest load brings the battery to V, a load of mean power P and variance
    σ² takes no more current than :math:`P / V (1 + s)`, where :math:`s = R P_{max} / V^2`: 1 / V(P) and
    :math:`R \sigma^2 / (E^2 - 4 R P)^{3/2}`, with :math:`\sigma^2 \le P (P_{max} - P)`, come to no more for
    s below 0.24.  Where that current leaves so much charge, it was never less.
    """
    circuit = discharge.packs.circuits[discharge.pack]
    highest_w, taken_j = returns.demand
    empty = circuit.empty_state_of_charge(highest_w, voltage_v)
    if empty <= 0.0:  # the curve does not fall so far
        return True
    drop_v2, least_v2 = circuit.resistance_ohm * highest_w, voltage_v**2
    if drop_v2 > _MOST_SAG * least_v2 or not least_v2:
        return False
    sag = drop_v2 / least_v2
    charge_c = circuit.capacity_ah * SECONDS_PER_HOUR
    used = taken_j * (1.0 + sag) / (voltage_v * charge_c)
    left = discharge.packs.charge_at(returns.points, discharge.pack) - used
    return bool(left.min() > empty + _ROUNDING)


def predict_return_discharge(returns: FlownReturns, discharge: Discharge) -> ReturnDischarge:
    """Return what holds and returns ask of a battery, from the charge that is left where they begin."""
    known = discharge.packs.of_returns
    if id(returns) not in known:
        known[id(returns)] = returns, tuple(_return_discharges(returns, discharge.packs))
    return known[id(returns)][1][discharge.pack]


def _return_discharges(returns: FlownReturns, packs: ParallelPacks) -> Iterator[ReturnDischarge]:
    """Yield what holds and returns ask of each of some packs."""
    points, loads = returns.points, returns.loads
    circuit = joined(packs.circuits).over_an_axis()
    # Loads first, then packs, then points.
    mean_w, variance_w2, peak_w, end_w, duration_s = (
        np.ascontiguousarray(column.T)[:, None] for column in field_values(loads).values()
    )
    begun = packs.charge_at(points, slice(None))
    left = circuit.state_of_charge_after(mean_w, variance_w2, duration_s, from_soc=begun)
    open_v = circuit.open_circuit_v(left)
    lowest_v = circuit.loaded_v(open_v, peak_w).min(axis=0)
    end_v = circuit.loaded_v(open_v, end_w).min(axis=0)
    can_deliver = circuit.can_deliver(open_v, peak_w)
    for columns in zip(lowest_v, end_v, can_deliver, strict=True):
        yield ReturnDischarge(*columns)
