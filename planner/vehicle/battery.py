"""The battery a vehicle flies with."""

from __future__ import annotations

from dataclasses import dataclass

from planner.vehicle.schema import BATTERY


@dataclass(frozen=True, slots=True, kw_only=True)
class Battery:
    """A battery as its label, or its identification, describes it.

    Its energy is given, or its charge and nominal voltage.
    """

    capacity_ah: float | None = None
    """Charge of the full battery. [Ah]"""
    capacity_wh: float | None = None
    """Energy of the full battery. [Wh]"""
    nominal_voltage_v: float | None = None
    """Energy over charge of the full battery. [V]"""
    cells_in_series: int | None = None
    internal_resistance_ohm: float | None = None
    """Resistance of the whole battery. [Ω]"""
    ocv_soc: tuple[float, ...] | None = None
    """States of charge from 0 to 1, rising. [-]"""
    ocv_v: tuple[float, ...] | None = None
    """Open-circuit voltage at each state of charge. [V]"""
    cutoff_voltage_v: float | None = None
    """Voltage under load at which the battery counts as empty. [V]"""

    def __post_init__(self) -> None:
        BATTERY.refuse(self)

    @property
    def energy_wh(self) -> float:
        """Energy of the full battery [Wh]."""
        if self.capacity_wh is not None:
            return self.capacity_wh
        # __post_init__ has refused a battery in which these are missing as well
        assert self.capacity_ah is not None
        assert self.nominal_voltage_v is not None
        return self.capacity_ah * self.nominal_voltage_v

    @property
    def voltage_v(self) -> float | None:
        """Nominal voltage; ``None`` where only the energy is known [V]."""
        if self.nominal_voltage_v is None and self.capacity_ah is not None:
            return self.energy_wh / self.capacity_ah
        return self.nominal_voltage_v
