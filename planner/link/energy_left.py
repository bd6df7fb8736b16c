"""The energy left in a battery, by what a vehicle measures of it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen
from planner.physics.battery import delivered_energy_wh

if TYPE_CHECKING:
    from planner.vehicle.battery import Battery

_STEP = 0.01
"""Batteries tell their charge in whole percent. [-]"""


@frozen
class BatteryReading:
    """What BATTERY_STATUS says; ``None`` where the vehicle does not measure it."""

    remaining_fraction: float | None = None
    """State of charge as the vehicle counts it. [-]"""
    consumed_ah: float | None = None
    """Since the vehicle was switched on. [Ah]"""
    consumed_wh: float | None = None
    """Since the vehicle was switched on. [Wh]"""
    voltage_v: float | None = None
    """Under load. [V]"""
    current_a: float | None = None


@frozen
class EnergyLeft:
    """Energy that a battery still gives, and who says so."""

    energy_wh: float
    source: str
    """Which measurement was trusted: the one that leaves least."""
    by_source: tuple[tuple[str, float], ...]
    """What each measurement leaves. [Wh]"""
    step_wh: float
    """What the trusted one cannot tell apart. [Wh]"""

    @property
    def spread_wh(self) -> float:
        """How far the measurements are apart [Wh]."""
        left_wh = [one for _, one in self.by_source]
        return max(left_wh) - min(left_wh)


class BatteryMeter:
    """Turns readings into energies, from a charge at the start.

    Parameters
    ----------
    battery : Battery
        The one that flies.
    charge : float
        State of charge when the start was read. [-]
    usable_wh : float
        Energy in it then, as the check counts it. [Wh]
    temperature_c : float
        Of the battery. [°C]
    start : BatteryReading
        The counts then.
    """

    def __init__(
        self,
        battery: Battery,
        *,
        charge: float,
        usable_wh: float,
        temperature_c: float,
        start: BatteryReading,
    ) -> None:
        self._battery = battery
        self._charge = charge
        self._usable_wh = usable_wh
        self._resistance_ohm = battery.resistance_ohm(temperature_c)
        self._start = start

    def energy_left(self, reading: BatteryReading) -> EnergyLeft | None:
        """Return the energy left by a reading; ``None`` where it tells nothing.

        Notes
        -----
        Counts of energy and of charge, and the vehicle's own percentage, are compared, and the least
        is taken.  The voltage says little on a flat curve: it is asked only where there is no other.
        """
        step_wh = self._usable_wh - self._at(self._charge - _STEP)
        found: list[tuple[str, float, float]] = []
        start = self._start
        if reading.consumed_wh is not None and start.consumed_wh is not None:
            left_wh = self._usable_wh - (reading.consumed_wh - start.consumed_wh)
            found.append(("energy count", left_wh, 0.0))
        capacity_ah = self._battery.charge_ah
        if None not in {reading.consumed_ah, start.consumed_ah, capacity_ah}:
            assert reading.consumed_ah is not None
            assert start.consumed_ah is not None
            assert capacity_ah is not None
            taken = (reading.consumed_ah - start.consumed_ah) / capacity_ah
            found.append(("charge count", self._at(self._charge - taken), 0.0))
        if reading.remaining_fraction is not None:
            left_wh = self._at(reading.remaining_fraction)
            found.append(("the vehicle's percentage", left_wh, step_wh))
        if not found:
            fraction = self._voltage_fraction(reading)
            if fraction is None:
                return None
            found.append(("voltage", self._at(fraction), 5.0 * step_wh))
        source, energy_wh, uncertain_wh = min(found, key=lambda one: one[1])
        return EnergyLeft(
            energy_wh=max(energy_wh, 0.0),
            source=source,
            by_source=tuple((name, left_wh) for name, left_wh, _ in found),
            step_wh=uncertain_wh,
        )

    def _at(self, fraction: float) -> float:
        """Return the energy left at a state of charge, of what was usable at the start [Wh]."""
        if self._charge <= 0.0 or fraction <= 0.0:
            return 0.0
        curve_soc, curve_v = self._battery.ocv_soc, self._battery.ocv_v
        if curve_soc is None or curve_v is None:
            return self._usable_wh * fraction / self._charge
        # What stays below the cut-off is as much now as at the start.
        taken_wh = [
            delivered_energy_wh(
                0.0,
                from_state_of_charge=one,
                to_state_of_charge=0.0,
                capacity_ah=self._battery.charge_ah or 1.0,
                resistance_ohm=0.0,
                ocv_soc=curve_soc,
                ocv_v=curve_v,
            )
            for one in (self._charge, min(fraction, 1.0))
        ]
        if self._battery.charge_ah is None:
            return self._usable_wh * taken_wh[1] / taken_wh[0]
        return max(self._usable_wh - (taken_wh[0] - taken_wh[1]), 0.0)

    def _voltage_fraction(self, reading: BatteryReading) -> float | None:
        curve_soc, curve_v = self._battery.ocv_soc, self._battery.ocv_v
        if reading.voltage_v is None or curve_soc is None or curve_v is None:
            return None
        sag_v = (self._resistance_ohm or 0.0) * (reading.current_a or 0.0)
        return float(np.interp(reading.voltage_v + sag_v, curve_v, curve_soc))
