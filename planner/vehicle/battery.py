"""The battery a vehicle flies with, and the kinds of cell it may be made of."""

import math
from functools import lru_cache

import numpy as np

from planner.physics.battery import BatteryCircuit
from planner.values import replace
from planner.vehicle.declared import (
    NOT_NEGATIVE,
    POSITIVE,
    Annotated,
    Key,
    Part,
    Problems,
    Range,
    curve,
    together_problems,
)

_CAPACITY_TOLERANCE = 0.02
"""How far capacity_wh may be from capacity_ah times nominal_voltage_v: rounding on a label. [-]"""
_SOC = curve("states of charge, rising from 0 to 1", within=Range(0.0, 1.0))
_RESISTANCE_TEMPERATURE = Key(
    "battery temperatures, rising; beyond them the factor of the nearest",
    "°C",
    Range(-60.0, 100.0),
    count=(1, 1000),
    rises=True,
)
_RESISTANCE_FACTOR = Key(
    "resistance at each temperature over the given one", range=POSITIVE, count=(1, 1000)
)
_CELLS = Range(1, 400)


class Battery(Part):
    """The battery the vehicle flies with; optional, --battery replaces it.

    Give an energy, or a charge and either the nominal voltage or an open-circuit curve; an energy
    alone leaves the charge unknown.  With a curve and a resistance the voltage under load is predicted
    and the energy down to the cut-off is what counts.  Values are those of the whole battery when it
    was new, but where the key says cell; age and health say what is left of it.
    """

    capacity_ah: Annotated[float | None, Key("charge of the full battery", "Ah", POSITIVE)] = None
    capacity_wh: Annotated[float | None, Key("energy of the full battery", "Wh", POSITIVE)] = None
    nominal_voltage_v: Annotated[
        float | None, Key("energy over charge of the full battery", "V", POSITIVE)
    ] = None
    cells_in_series: Annotated[int | None, Key("number of cells in series", range=_CELLS)] = None
    cells_in_parallel: Annotated[
        int | None, Key("number of such rows in parallel, 1 where not given", range=_CELLS)
    ] = None
    chemistry: Annotated[
        str | None,
        Key(
            "kind of cell, a file of models/chemistries: gives the curves this table does not; needs "
            "cells_in_series"
        ),
    ] = None
    cell_capacity_ah: Annotated[
        float | None, Key("charge of one full cell, instead of capacity_ah", "Ah", POSITIVE)
    ] = None
    cell_resistance_ohm: Annotated[
        float | None,
        Key("resistance of one cell, instead of internal_resistance_ohm", "ohm", NOT_NEGATIVE),
    ] = None
    internal_resistance_ohm: Annotated[
        float | None, Key("resistance of the whole battery", "ohm", NOT_NEGATIVE)
    ] = None
    resistance_temperature_c: Annotated[tuple[float, ...] | None, _RESISTANCE_TEMPERATURE] = None
    resistance_factor: Annotated[tuple[float, ...] | None, _RESISTANCE_FACTOR] = None
    resistance_age_factor: Annotated[
        float | None,
        Key(
            "resistance of this battery over that of the new one, 1 where not given",
            range=Range(1.0, 20.0),
        ),
    ] = None
    health: Annotated[
        float | None,
        Key(
            "charge of this battery over that of the new one, 1 where not given",
            range=Range(0.0, 1.0, excludes_low=True),
        ),
    ] = None
    ocv_soc: Annotated[tuple[float, ...] | None, _SOC] = None
    ocv_v: Annotated[
        tuple[float, ...] | None,
        curve("open-circuit voltage at each ocv_soc, rising", "V", POSITIVE),
    ] = None
    cutoff_voltage_v: Annotated[
        float | None, Key("voltage under load at which the battery counts as empty", "V", POSITIVE)
    ] = None
    max_c_rate: Annotated[
        float | None, Key("highest current over the charge of the new battery", "1/h", POSITIVE)
    ] = None
    label_factor: float | None = None
    """Of the curve over what a voltmeter shows without load: it is scaled so that the energy is that of a
    label; ``None``: it is not.  No key of a file. [-]"""

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        yield from self._capacity_problems()
        for whole, cell in (
            ("capacity_ah", "cell_capacity_ah"),
            ("internal_resistance_ohm", "cell_resistance_ohm"),
        ):
            if getattr(self, whole) is not None and getattr(self, cell) is not None:
                yield cell, f"is given and {whole} as well: give one"
        for name in ("chemistry", "cell_resistance_ohm"):
            if getattr(self, name) is not None and self.cells_in_series is None:
                yield "cells_in_series", f"is missing: {name} needs it"
        yield from together_problems(self, "resistance_temperature_c", "resistance_factor")
        yield from _open_circuit_problems(self, "ocv_v")
        full_v = math.inf if self.ocv_v is None else self.ocv_v[-1]
        if self.cutoff_voltage_v is not None and self.cutoff_voltage_v >= full_v:
            yield "cutoff_voltage_v", "must be below the voltage of the full battery"
        factor = self.label_factor
        if factor is not None and (self.ocv_v is None or not 0.0 < factor < math.inf):
            yield "label_factor", "must be positive, and needs ocv_v, which it scales"

    def _capacity_problems(self) -> Problems:
        charge_ah = self.new_charge_ah
        if charge_ah is None and self.capacity_wh is None:
            yield "capacity_ah", "is missing, and capacity_wh as well: give at least one"
        elif self.capacity_wh is None and self.nominal_voltage_v is None and self.ocv_v is None:
            yield "nominal_voltage_v", "is missing: a charge alone is no energy"
        elif charge_ah and self.capacity_wh and self.nominal_voltage_v:
            product_wh = charge_ah * self.nominal_voltage_v
            if not math.isclose(self.capacity_wh, product_wh, rel_tol=_CAPACITY_TOLERANCE):
                problem = f"is not capacity_ah x nominal_voltage_v = {product_wh:g} Wh"
                yield "capacity_wh", problem
        elif self.ocv_v is not None and charge_ah is None:
            yield "capacity_ah", "is missing: an open-circuit curve runs over the charge"

    @property
    def new_charge_ah(self) -> float | None:
        """Charge of the full battery when it was new; ``None`` where only its energy is known [Ah]."""
        if self.capacity_ah is not None:
            return self.capacity_ah
        if self.cell_capacity_ah is not None:
            return self.cell_capacity_ah * (self.cells_in_parallel or 1)
        if self.capacity_wh is not None and self.nominal_voltage_v is not None:
            return self.capacity_wh / self.nominal_voltage_v
        return None

    @property
    def charge_ah(self) -> float | None:
        """Charge of the full battery; ``None`` where only its energy is known [Ah]."""
        return None if self.new_charge_ah is None else self.new_charge_ah * (self.health or 1.0)

    @property
    def energy_wh(self) -> float:
        """Energy of the full battery [Wh]."""
        return self.new_energy_wh * (self.health or 1.0)

    @property
    def new_energy_wh(self) -> float:
        """Energy of the full battery when it was new [Wh]."""
        if self.capacity_wh is not None:
            return self.capacity_wh
        # the constructor has refused a battery in which these are missing as well
        assert self.new_charge_ah is not None
        if self.nominal_voltage_v is not None:
            return self.new_charge_ah * self.nominal_voltage_v
        assert self.ocv_soc is not None
        assert self.ocv_v is not None
        return _curve_wh(self.new_charge_ah, self.ocv_soc, self.ocv_v)

    @property
    def voltage_v(self) -> float | None:
        """Nominal voltage; ``None`` where only the energy is known [V]."""
        if self.nominal_voltage_v is None and self.new_charge_ah is not None:
            return self.new_energy_wh / self.new_charge_ah
        return self.nominal_voltage_v

    @property
    def new_resistance_ohm(self) -> float | None:
        """Resistance of the whole battery when it was new, at no temperature in particular. [Ω]"""
        if self.internal_resistance_ohm is None and self.cell_resistance_ohm is not None:
            cells = (self.cells_in_series or 1) / (self.cells_in_parallel or 1)
            return self.cell_resistance_ohm * cells
        return self.internal_resistance_ohm

    def aged(self, *, health: float | None, resistance_factor: float | None) -> "Battery":
        """Return this battery as old as it is today; ``None`` leaves what it says itself.

        ``health`` is the charge, ``resistance_factor`` the resistance over that of the new battery. [-]

        Raises
        ------
        ValueError
            If no battery is like this.
        """
        given = {"health": health, "resistance_age_factor": resistance_factor}
        changed = {name: value for name, value in given.items() if value is not None}
        return _changed(self, **changed) if changed else self

    def resistance_ohm(self, temperature_c: float) -> float | None:
        """Return the resistance of the whole battery, at its age and temperature; ``None``: unknown. [Ω]"""
        resistance_ohm = self.new_resistance_ohm
        if resistance_ohm is None:
            return None
        if self.resistance_temperature_c is not None and self.resistance_factor is not None:
            resistance_ohm *= float(
                np.interp(temperature_c, self.resistance_temperature_c, self.resistance_factor)
            )
        return resistance_ohm * (self.resistance_age_factor or 1.0)

    def circuit(self, temperature_c: float) -> BatteryCircuit | None:
        """Return charge, resistance and curve at a temperature; ``None`` where one is unknown."""
        charge_ah, resistance_ohm = self.charge_ah, self.resistance_ohm(temperature_c)
        if charge_ah is None or resistance_ohm is None or not self.ocv_soc or not self.ocv_v:
            return None
        return BatteryCircuit(
            capacity_ah=charge_ah,
            resistance_ohm=resistance_ohm,
            ocv_soc=self.ocv_soc,
            ocv_v=self.ocv_v,
        )


@lru_cache(maxsize=64)  # a check asks for that of its battery a dozen times
def _curve_wh(charge_ah: float, ocv_soc: tuple[float, ...], ocv_v: tuple[float, ...]) -> float:
    """Return the energy of a full battery by its open-circuit curve. [Wh]"""
    circuit = BatteryCircuit(capacity_ah=charge_ah, ocv_soc=ocv_soc, ocv_v=ocv_v)
    return circuit.delivered_wh(0.0, 1.0, 0.0)


@lru_cache(maxsize=256)  # a sweep asks for the same few again and again
def _changed(battery: Battery, **changed: float) -> Battery:
    return replace(battery, **changed)


class Chemistry(Part):
    """A kind of cell, in a file of its own under models/chemistries."""

    name: Annotated[str, Key("must equal the file name without .toml")]
    description: Annotated[str, Key("what the cell is")]
    source: Annotated[str, Key("where the numbers were read")]
    ocv_soc: Annotated[tuple[float, ...], _SOC]
    cell_ocv_v: Annotated[
        tuple[float, ...],
        curve("open-circuit voltage of a cell at each ocv_soc, rising", "V", POSITIVE),
    ]
    resistance_temperature_c: Annotated[tuple[float, ...] | None, _RESISTANCE_TEMPERATURE] = None
    resistance_factor: Annotated[tuple[float, ...] | None, _RESISTANCE_FACTOR] = None
    typical_wh_kg: Annotated[
        float | None, Key("energy over mass of a usual battery of such cells", "Wh/kg", POSITIVE)
    ] = None
    highest_wh_kg: Annotated[
        float | None, Key("energy over mass of the best battery there is", "Wh/kg", POSITIVE)
    ] = None
    sustained_c_rate: Annotated[
        float | None,
        Key(
            "highest mean current over the charge that any battery bears until empty",
            "1/h",
            POSITIVE,
        ),
    ] = None
    peak_c_rate: Annotated[
        float | None,
        Key("highest current over the charge that any battery bears for seconds", "1/h", POSITIVE),
    ] = None

    lowest_cell_v: Annotated[
        float | None, Key("voltage of a cell under load below which none is flown", "V", POSITIVE)
    ] = None

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together."""
        limits = (
            "typical_wh_kg",
            "highest_wh_kg",
            "sustained_c_rate",
            "peak_c_rate",
            "lowest_cell_v",
        )
        missing = [name for name in limits if getattr(self, name) is None]
        if 0 < len(missing) < len(limits):
            yield missing[0], "is missing: the limits of a battery are given together"
        yield from _open_circuit_problems(self, "cell_ocv_v")
        yield from together_problems(self, "resistance_temperature_c", "resistance_factor")


def _open_circuit_problems(part: Battery | Chemistry, volts: str) -> Problems:
    problems = list(together_problems(part, "ocv_soc", volts))
    yield from problems
    soc = part.ocv_soc
    if not problems and soc is not None and (soc[0], soc[-1]) != (0.0, 1.0):
        yield "ocv_soc", "must run from 0 to 1: nothing is extrapolated"
