"""The battery that flies: the model's own, or another one that a label describes.

A label, ``8Ah@22.2V`` or ``177Wh``, says how much a battery holds and not what it is made of.  What it
leaves open is that of the model's own battery where the voltage fits: its cells, its curve scaled to
the voltage, its resistance over as many more cells in parallel, its C-rate.  Without such a battery the
cells are those its voltage means: labels say 3.6 V for a cylindrical lithium-ion cell, 3.7 to 3.85 V for
lithium-polymer.  What nothing tells the kind of is judged by the kind that bears most.
"""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.values import Value, field_values, replace
from planner.vehicle.battery import Battery, Chemistry
from planner.vehicle.reader import load_chemistry

if TYPE_CHECKING:
    from planner.arrays import FloatArray

ASSUMED_CHEMISTRY, LITHIUM_ION = "lipo", "li-ion"
"""What most multicopters fly with, and bears most; and what those of long endurance fly with."""
_KINDS = {ASSUMED_CHEMISTRY: "lithium-polymer", LITHIUM_ION: "lithium-ion"}
MOST_LITHIUM_ION_V = 3.65
"""Nominal voltage of a cell up to which its label means lithium-ion: halfway from 3.6 to 3.7 V. [V]"""
LIPO_CELL_V = 3.7
"""Nominal voltage of a cell where a battery is labelled by its number of cells, as lithium-polymer is. [V]"""
FULL_LIPO_CELL_V = 4.2
"""Of such a cell when it is charged. [V]"""
_LABELLED_WITHIN_V = 0.05
"""Voltages are labelled to a tenth. [V]"""
_LEAST_VOLTAGE, _MOST_VOLTAGE = 0.85, 1.18
"""Of the vehicle's own battery: one cell of six fewer is outside, another chemistry of as many is not. [-]"""
_FULLEST_CELL_V = 4.4
"""The most a charged cell has: 4.35 V of a high-voltage one, and what voltmeters are off by. [V]"""
CELL_V, _OWN_CELL_V = (3.55, 3.9), (3.0, 3.9)
"""Nominal voltage of one cell as labels have it: 3.6 to 3.85 V of lithium with cobalt, manganese or
nickel, 3.2 V of iron phosphate; the second where the number of cells is known already. [V]"""
_SAME_LABEL = 0.02
"""A label this fraction above the energy of the model's own battery is that battery's: rounding. [-]"""
_LABEL = frozenset({"capacity_ah", "capacity_wh", "nominal_voltage_v"})


_SAME_CURVE = 1e-3
"""Ratios to the curve of a kind of cell that differ by no more are one: model files have millivolts. [-]"""
_OVERCHARGED = 1.01
"""A full battery shows up to this over its curve: chargers and voltmeters are as far off."""
_VOLTMETER = 0.01
"""Voltmeters show so much less than there is; the cold and what just flew cost no more at rest. [-]"""


class RestCurve(Value, kw_only=False, eq=False):
    """Open-circuit voltages of a whole battery over its state of charge."""

    state_of_charge: tuple[float, ...]
    voltage_v: FloatArray
    is_assumed: bool
    """Whether it is that of a kind of cell, not one of this battery."""

    def at(self, state_of_charge: float) -> float:
        """Return the voltage at a state of charge. [V]"""
        return float(np.interp(state_of_charge, self.state_of_charge, self.voltage_v))

    def charge(self, voltage_v: float) -> float:
        """Return the state of charge at a voltage, that of the nearest end beyond the curve. [-]"""
        return float(np.interp(voltage_v, self.voltage_v, self.state_of_charge))


class ShownCharge(Value):
    """What a voltmeter shows of the charge of a battery without load."""

    voltage_v: float
    charge: float
    """By the curve of its cells. [-]"""
    most: float
    """The most it can be: voltmeters are off, and where the curve is only that of a kind of cell, it may be
    of the other one. [-]"""


class FlownPack(Value):
    """The battery that flies, and what had to be assumed of it."""

    battery: Battery | None
    is_own: bool = False
    """Whether it is the model's own."""
    added_kg: float = 0.0
    """Its mass over that of the model's own, never below 0: how light a small pack is nobody said. [kg]"""
    assumed: str = ""
    """What is assumed of its cells, in words; empty where nothing is."""

    def charge_at_rest(self, voltage_v: float) -> float:
        """Return the state of charge that a voltage without load means. [-]

        By the curve of its kind of cell, else by its own; no label scales either.

        Raises
        ------
        UsageError
            If no curve is known, or the voltage is none of this battery.
        """
        pack = self.battery
        shown = quantity.exact(voltage_v)
        curve = None if pack is None else rest_curve(pack)
        if curve is None:
            msg = (
                f"a charge of {shown} V needs the curve of the battery: give --battery with cells, "
                "such as 5.2Ah@4S, or the charge as a percentage"
            )
            raise UsageError(msg)
        volts = curve.voltage_v.tolist()
        if not volts[0] <= voltage_v <= volts[-1] * _OVERCHARGED:
            low, high = (quantity.decimals(one, 1) for one in (volts[0], volts[-1]))
            msg = (
                f"a charge of {shown} V: this battery has {low} V when empty and {high} V when full"
            )
            raise UsageError(msg)
        return curve.charge(voltage_v)

    def charge_shown(self, voltage_v: float) -> ShownCharge | None:
        """Return what a voltmeter shows of the charge without load; ``None``: no curve is known."""
        pack = self.battery
        curve = None if pack is None else rest_curve(pack)
        if pack is None or curve is None:
            return None
        most_v = voltage_v * (1.0 + _VOLTMETER)
        curves = [curve]
        if curve.is_assumed and pack.cells_in_series is not None:
            curves += [_curve_of(kind, pack.cells_in_series) for kind in _KINDS]
        return ShownCharge(
            voltage_v=voltage_v,
            charge=curve.charge(voltage_v),
            most=max(one.charge(most_v) for one in curves),
        )


def chemistry_of(battery: Battery | None) -> Chemistry:
    """Return the kind of cell a battery is judged by: its own where that has limits, else the assumed."""
    own = None if battery is None or battery.chemistry is None else battery.chemistry
    found = load_chemistry(own or ASSUMED_CHEMISTRY)
    return load_chemistry(ASSUMED_CHEMISTRY) if found.highest_wh_kg is None else found


def high_resistance_ohm(battery: Battery, temperature_c: float) -> float | None:
    """Return the resistance that 9 of 10 batteries of its cells and charge stay below; ``None``: unknown. [Ω]

    By the prior of models/priors/multicopter.toml, at its temperature by its kind of cell, at its age.
    """
    from planner.vehicle.priors import multicopter_priors

    if battery.new_charge_ah is None or battery.cells_in_series is None:
        return None
    of_1_ah_ohm, kind = multicopter_priors()["cell_resistance"].high, chemistry_of(battery)
    return replace(
        battery,
        internal_resistance_ohm=battery.cells_in_series * of_1_ah_ohm / battery.new_charge_ah,
        resistance_temperature_c=kind.resistance_temperature_c,
        resistance_factor=kind.resistance_factor,
    ).resistance_ohm(temperature_c)


@lru_cache(maxsize=64)
def rest_curve(battery: Battery) -> RestCurve | None:
    """Return the curve a voltmeter sees on a battery without load; ``None``: it is not known.

    A label scales what the battery holds, not what it shows: a curve that was scaled to one is taken as the
    cells, or the flights, have it.
    """
    if battery.ocv_soc is None or battery.ocv_v is None:
        return None
    volts = np.array(battery.ocv_v)
    if battery.chemistry is not None and battery.cells_in_series is not None:
        kind = load_chemistry(battery.chemistry)
        if battery.ocv_soc == kind.ocv_soc:
            of_cells = _curve_of(kind.name, battery.cells_in_series)
            scale = volts / of_cells.voltage_v
            if float(np.ptp(scale)) < _SAME_CURVE:
                return of_cells
    return RestCurve(battery.ocv_soc, volts / (battery.label_factor or 1.0), is_assumed=False)


def _curve_of(kind: str, cells: int) -> RestCurve:
    """Return the curve of so many cells of a kind in series."""
    chemistry = load_chemistry(kind)
    return RestCurve(chemistry.ocv_soc, cells * np.array(chemistry.cell_ocv_v), is_assumed=True)


def lowest_voltage_v(battery: Battery) -> float:
    """Return the voltage under load below which its cells are not flown; 0: how many is unknown. [V]"""
    cells = battery.cells_in_series
    if cells is None and battery.ocv_v is not None:
        cells = cells_of_full_voltage(battery.ocv_v[-1])
    if cells is None and battery.voltage_v is not None:
        cells = cells_of_voltage(battery.voltage_v)
    return (cells or 0) * (chemistry_of(battery).lowest_cell_v or 0.0)


@lru_cache(maxsize=64)
def flown_pack(given: Battery | None, own: Battery | None) -> FlownPack:
    """Return the battery that flies.

    Parameters
    ----------
    given : Battery or None
        As the user gives it; ``None``: the model's own flies.
    own : Battery or None
        The model's.
    """
    if given is None or given == own:
        return FlownPack(battery=own, is_own=True)
    added_kg = 0.0 if own is None else _added_kg(given, own)
    said = {name for name, value in field_values(given).items() if value is not None}
    if not said <= _LABEL:
        return FlownPack(battery=given, added_kg=added_kg)
    if own is not None and fits_voltage(given, own):
        return replace(_like(given, own), added_kg=added_kg)
    return replace(_by_voltage(given), added_kg=added_kg)


def fits_voltage(given: Battery, own: Battery) -> bool:
    """Return whether a battery may have as many cells as the model's own, as far as is known."""
    given_v, own_v = given.voltage_v, own.voltage_v
    if given_v is None or own_v is None:
        return True
    as_labelled_v = own_v * (1.0 + _SAME_LABEL)
    return _voltage_fits(given_v, own_v, own, CELL_V[1], at_least_v=as_labelled_v)


def measured_voltage_fits(measured_v: float, expected_v: float, pack: Battery) -> bool:
    """Return whether a battery, which has another open-circuit voltage now, may show what was measured."""
    return _voltage_fits(measured_v, expected_v, pack, _FULLEST_CELL_V)


def _voltage_fits(
    voltage_v: float, other_v: float, pack: Battery, most_cell_v: float, *, at_least_v: float = 0.0
) -> bool:
    """Return whether as many cells in series may have a voltage as have the other one.

    However many those of a battery are: no cell has more than it can.
    """
    cells = pack.cells_in_series or cells_of_voltage(pack.voltage_v)
    most_v = _MOST_VOLTAGE * other_v
    if cells is not None:
        most_v = min(most_v, max(cells * most_cell_v, at_least_v))
    return _LEAST_VOLTAGE * other_v <= voltage_v <= most_v


def is_of_another_kind(battery: Battery) -> bool:
    """Return whether cells have less than lithium-polymer and lithium-ion ones are labelled with.

    Iron phosphate has 3.2 V: nothing of its curve is known here.
    """
    cells, voltage_v = battery.cells_in_series, battery.voltage_v
    return cells is not None and voltage_v is not None and voltage_v / cells < CELL_V[0]


def _added_kg(given: Battery, own: Battery) -> float:
    typical_wh_kg = chemistry_of(own).typical_wh_kg
    assert typical_wh_kg is not None  # a chemistry that is judged by has it
    more_wh = given.new_energy_wh - own.new_energy_wh
    return more_wh / typical_wh_kg if more_wh > _SAME_LABEL * own.new_energy_wh else 0.0


def _like(given: Battery, own: Battery) -> FlownPack:
    """Return a labelled battery of the cells of the model's own."""
    charge_ah, own_v, own_ah = given.new_charge_ah, own.voltage_v, own.new_charge_ah
    if charge_ah is None and own_v is not None:
        charge_ah = given.new_energy_wh / own_v
    volts = 1.0 if own_v is None or given.voltage_v is None else given.voltage_v / own_v
    if charge_ah is None or own_ah is None:
        return FlownPack(battery=given)
    rows = charge_ah / own_ah
    cell_v = None if own.cells_in_series is None else volts * (own_v or 0.0) / own.cells_in_series
    cells = own.cells_in_series
    others = replace(given, cells_in_series=cells)
    if is_of_another_kind(others) and not is_of_another_kind(own):
        many = quantity.count(cells or 0, "cell")
        assumed = (
            f"{many} of another kind than those of the model's own, as "
            f"{quantity.voltage(given.voltage_v or 0.0)} mean: their voltages are unknown"
        )
        return FlownPack(battery=others, assumed=assumed)
    if cell_v is not None and not _OWN_CELL_V[0] <= cell_v <= _OWN_CELL_V[1]:
        cells = cells_of_voltage(given.voltage_v)
    resistance_ohm = own.new_resistance_ohm
    scaled: dict[str, Any] = {
        "capacity_ah": charge_ah,
        "cells_in_series": cells,
        "chemistry": own.chemistry if cells is not None else None,
        "internal_resistance_ohm": None if resistance_ohm is None else resistance_ohm / rows,
        "resistance_temperature_c": own.resistance_temperature_c,
        "resistance_factor": own.resistance_factor,
        "ocv_soc": own.ocv_soc,
        "ocv_v": None if own.ocv_v is None else tuple(volts * one for one in own.ocv_v),
        "cutoff_voltage_v": None if own.cutoff_voltage_v is None else volts * own.cutoff_voltage_v,
        "max_c_rate": own.max_c_rate,
        "label_factor": None if own.ocv_v is None else volts * _cells_over(own, given, cells),
    }
    known = {name: value for name, value in scaled.items() if value is not None}
    assumed = ""
    if resistance_ohm is not None or own.ocv_v is not None:
        times = quantity.decimals(rows, 2)
        assumed = "cells like those of the model's own battery"
        if times != "1.00":
            assumed += f", with {times} times the charge"
    return FlownPack(battery=replace(given, **known), assumed=assumed)


def _cells_over(own: Battery, given: Battery, cells: int | None) -> float:
    """Return how many cells in series a battery has over a labelled one, 1 where that is unknown."""
    full_v = 0.0 if own.ocv_v is None else own.ocv_v[-1]
    has = own.cells_in_series or cells_of_full_voltage(full_v) or cells_of_voltage(own.voltage_v)
    labelled = cells or cells_of_voltage(given.voltage_v)
    return 1.0 if has is None or labelled is None else has / labelled


def _by_voltage(given: Battery) -> FlownPack:
    """Return a labelled battery of the cells that its voltage means, if it means any."""
    if cells_of_voltage(given.voltage_v) is None:
        return FlownPack(battery=given)
    battery = pack_of_label(given)
    assert battery.chemistry is not None
    cells, mean = (
        f"{_KINDS[battery.chemistry]} cell",
        f"as {quantity.voltage(given.voltage_v)} mean",
    )
    number = quantity.count(battery.cells_in_series or 0, cells)
    assumed = (
        f"{number} in series, {mean}" if given.cells_in_series is None else f"{cells}s, {mean}"
    )
    return FlownPack(battery=battery, assumed=assumed)


def pack_of_label(given: Battery, kind: str | None = None) -> Battery:
    """Return a labelled battery with the cells that its voltage means, and their curve.

    The curve is scaled to the voltage of the label: what is labelled 77 Wh holds 77 Wh.  ``kind`` of cell:
    the one that the voltage means, where it is not given.
    """
    cells = cells_of_voltage(given.voltage_v)
    assert cells is not None
    assert given.voltage_v is not None
    is_lithium_ion = given.voltage_v / cells <= MOST_LITHIUM_ION_V
    chemistry = load_chemistry(kind or (LITHIUM_ION if is_lithium_ion else ASSUMED_CHEMISTRY))
    curve = Battery(
        capacity_ah=1.0,
        ocv_soc=chemistry.ocv_soc,
        ocv_v=tuple(cells * one for one in chemistry.cell_ocv_v),
    )
    volts = given.voltage_v / curve.new_energy_wh  # of 1 Ah: its mean voltage
    return replace(
        given,
        capacity_ah=given.new_charge_ah,
        cells_in_series=cells,
        chemistry=chemistry.name,
        ocv_soc=chemistry.ocv_soc,
        ocv_v=tuple(volts * cells * one for one in chemistry.cell_ocv_v),
    )


def cells_of_voltage(voltage_v: float | None) -> int | None:
    """Return the number of lithium cells in series that a voltage means; ``None``: none."""
    if voltage_v is None:
        return None
    cells = max(round(voltage_v / LIPO_CELL_V), 1)
    return cells if CELL_V[0] <= voltage_v / cells <= CELL_V[1] else None


def cells_of_full_voltage(voltage_v: float) -> int | None:
    """Return the number of lithium-polymer cells in series that have a voltage when full; ``None``: none."""
    cells = max(round(voltage_v / FULL_LIPO_CELL_V), 1)
    return (
        cells if abs(voltage_v / cells - FULL_LIPO_CELL_V) <= _LABELLED_WITHIN_V / cells else None
    )
