"""The battery a vehicle flies with."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.frozen import frozen
from planner.physics.battery import delivered_energy_wh
from planner.vehicle.battery_schema import BATTERY, CHEMISTRY
from planner.vehicle.shipped import models_root

if TYPE_CHECKING:
    from collections.abc import Mapping


@frozen
class Battery:
    """A battery as its label, or its identification, describes it.

    Its energy is given, or its charge and either a nominal voltage or an open-circuit curve.  Values
    are those of the new battery; age and health say what is left of it.
    """

    capacity_ah: float | None = None
    """Charge of the full battery. [Ah]"""
    capacity_wh: float | None = None
    """Energy of the full battery. [Wh]"""
    nominal_voltage_v: float | None = None
    """Energy over charge of the full battery. [V]"""
    cells_in_series: int | None = None
    cells_in_parallel: int | None = None
    """``None``: one row of cells."""
    chemistry: str | None = None
    """Kind of cell the curves were taken from; the curves themselves are below."""
    cell_capacity_ah: float | None = None
    """Charge of one full cell, where that of the whole battery is not given. [Ah]"""
    cell_resistance_ohm: float | None = None
    """Resistance of one cell, where that of the whole battery is not given. [Ω]"""
    internal_resistance_ohm: float | None = None
    """Resistance of the whole battery. [Ω]"""
    resistance_temperature_c: tuple[float, ...] | None = None
    """Temperatures of the battery, rising. [°C]"""
    resistance_factor: tuple[float, ...] | None = None
    """Resistance at each temperature over the one given. [-]"""
    resistance_age_factor: float | None = None
    """Resistance over that of the new battery. [-]"""
    health: float | None = None
    """Charge over that of the new battery. [-]"""
    ocv_soc: tuple[float, ...] | None = None
    """States of charge from 0 to 1, rising. [-]"""
    ocv_v: tuple[float, ...] | None = None
    """Open-circuit voltage at each state of charge. [V]"""
    cutoff_voltage_v: float | None = None
    """Voltage under load at which the battery counts as empty. [V]"""
    max_c_rate: float | None = None
    """Highest current over the charge of the new battery. [h⁻¹]"""

    def __post_init__(self) -> None:
        BATTERY.refuse(self)

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
        return self._new_energy_wh * (self.health or 1.0)

    @property
    def _new_energy_wh(self) -> float:
        if self.capacity_wh is not None:
            return self.capacity_wh
        # __post_init__ has refused a battery in which these are missing as well
        assert self.new_charge_ah is not None
        if self.nominal_voltage_v is not None:
            return self.new_charge_ah * self.nominal_voltage_v
        assert self.ocv_soc is not None
        assert self.ocv_v is not None
        return delivered_energy_wh(
            0.0,
            from_state_of_charge=1.0,
            to_state_of_charge=0.0,
            capacity_ah=self.new_charge_ah,
            resistance_ohm=0.0,
            ocv_soc=self.ocv_soc,
            ocv_v=self.ocv_v,
        )

    @property
    def voltage_v(self) -> float | None:
        """Nominal voltage; ``None`` where only the energy is known [V]."""
        if self.nominal_voltage_v is None and self.new_charge_ah is not None:
            return self._new_energy_wh / self.new_charge_ah
        return self.nominal_voltage_v

    def aged(self, *, health: float | None, resistance_factor: float | None) -> Battery:
        """Return this battery as old as it is today; ``None`` leaves what it says itself.

        Parameters
        ----------
        health : float or None
            Charge over that of the new battery. [-]
        resistance_factor : float or None
            Resistance over that of the new battery. [-]

        Raises
        ------
        ValueError
            If no battery is like this.
        """
        if health is None and resistance_factor is None:
            return self
        return replace(
            self,
            health=self.health if health is None else health,
            resistance_age_factor=(
                self.resistance_age_factor if resistance_factor is None else resistance_factor
            ),
        )

    def resistance_ohm(self, temperature_c: float) -> float | None:
        """Return the resistance of the whole battery, at its age and a temperature; ``None`` unknown.

        Parameters
        ----------
        temperature_c : float
            Temperature of the battery. [°C]

        Returns
        -------
        float or None
            Resistance. [Ω]
        """
        resistance_ohm = self.internal_resistance_ohm
        if resistance_ohm is None and self.cell_resistance_ohm is not None:
            cells = (self.cells_in_series or 1) / (self.cells_in_parallel or 1)
            resistance_ohm = self.cell_resistance_ohm * cells
        if resistance_ohm is None:
            return None
        if self.resistance_temperature_c is not None and self.resistance_factor is not None:
            resistance_ohm *= float(
                np.interp(temperature_c, self.resistance_temperature_c, self.resistance_factor)
            )
        return resistance_ohm * (self.resistance_age_factor or 1.0)


SCHEMA_VERSION = 1


@frozen
class Chemistry:
    """One kind of cell."""

    name: str
    """Also the stem of its file."""
    description: str
    source: str
    ocv_soc: tuple[float, ...]
    """States of charge from 0 to 1, rising. [-]"""
    cell_ocv_v: tuple[float, ...]
    """Open-circuit voltage of a cell at each. [V]"""
    resistance_temperature_c: tuple[float, ...] | None = None
    """Temperatures, rising. [°C]"""
    resistance_factor: tuple[float, ...] | None = None
    """Resistance at each temperature over that at the usual one. [-]"""

    def __post_init__(self) -> None:
        CHEMISTRY.refuse(self)


def chemistry_names() -> tuple[str, ...]:
    """Return the names of the shipped kinds of cell, sorted."""
    return tuple(sorted(path.stem for path in (models_root() / "chemistries").glob("*.toml")))


@lru_cache(maxsize=16)
def load_chemistry(name: str) -> Chemistry:
    """Load a shipped kind of cell.

    Raises
    ------
    ValueError
        If its file is not as it must be: a mistake in what is shipped.
    """
    path = models_root() / "chemistries" / f"{name}.toml"
    document: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    version = document.pop("schema", None)
    problems = CHEMISTRY.problems(document)
    if version != SCHEMA_VERSION or problems or document["name"] != name:
        msg = f"{path.name}: schema {version}, name {document.get('name')!r}, {problems}"
        raise ValueError(msg)
    return Chemistry(**CHEMISTRY.cleaned(document))


def with_chemistry(battery: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a battery with the curves of its chemistry, where it gives none itself.

    Parameters
    ----------
    battery : mapping
        Values by their keys, as a model file holds them; those needed here are right.

    Returns
    -------
    dict
        The same, with the curves of the whole battery.
    """
    chemistry = load_chemistry(battery["chemistry"])
    values = dict(battery)
    if not {"ocv_soc", "ocv_v"} & set(values):
        values["ocv_soc"] = chemistry.ocv_soc
        values["ocv_v"] = tuple(
            volts * battery["cells_in_series"] for volts in chemistry.cell_ocv_v
        )
    curve = {"resistance_temperature_c", "resistance_factor"}
    if not curve & set(values):
        values |= {key: value for key in curve if (value := getattr(chemistry, key)) is not None}
    return values
