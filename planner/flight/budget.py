"""The budget of a flight: what it takes, what the battery holds, what is left."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True, kw_only=True)
class Totals:
    """The whole flight, from the start of the take-off to disarmed on the ground."""

    time_s: float
    distance_m: float
    climb_m: float
    descent_m: float
    energy_wh: float
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
