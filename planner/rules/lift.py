"""Rules on what the rotors have to lift, and in what air."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.catalogue.energy import CONDITION_NOT_MODELLED, LIFT_UNKNOWN
from planner.findings import Severity
from planner.physics.atmosphere import SEA_LEVEL_DENSITY_KG_M3

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment

MOST_LIFT = 1.5
"""More thrust, in times of that of the model's flights, is not taken for granted: vehicles are built to
hover at half of what they have or somewhat more."""
_THINNER_TOLD, _THINNER_REFUSED = 1.1, 1.2
"""Thinness of air that is not counted: 5 % and 10 % of the power of a hover."""


def check_lift(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where much more has to be lifted, or in thinner air, than was identified."""
    extremes = a.flight.extremes
    if extremes is None or not a.vehicle.is_power_known:
        return
    thin = float(a.flight.power.air_density_kg_m3(extremes.highest_m))
    thinner = _reference_density_kg_m3(a) / thin
    heavier = _times_heavier(a)
    if thinner * heavier > MOST_LIFT:
        mass_kg = a.flight.power.mass_kg
        load = "the flight" if mass_kg is None else quantity.mass(mass_kg)
        yield LIFT_UNKNOWN.finding(
            f"{load} in air of {quantity.decimals(thin, 2)} kg/m³ takes "
            f"{quantity.beside(thinner * heavier, MOST_LIFT, _times)} the thrust of the flights the "
            "model was identified on: whether the vehicle has it is not known"
        )
        return
    # E108 tells of a temperature that is not counted already.
    told = _THINNER_TOLD if a.conditions.temperature_c is None else _THINNER_REFUSED
    if not a.vehicle.knows_air_density and thinner > told:
        yield CONDITION_NOT_MODELLED.finding(
            f"air of {quantity.decimals(thin, 2)} kg/m³, {_times(thinner)} thinner than at sea level, is "
            "not counted: the model's power knows no air density",
            severity=Severity.ERROR if thinner > _THINNER_REFUSED else None,
        )


def _times_heavier(a: Assessment) -> float:
    """Return the mass that flies over the heaviest the model was identified with."""
    vehicle, mass_kg = a.vehicle, a.flight.power.mass_kg
    limit = vehicle.valid_for.mass_kg
    known_kg = vehicle.mass_kg if limit is None else limit.high
    if not vehicle.knows_mass or mass_kg is None or known_kg is None:
        return 1.0  # a payload that is not counted is E108's
    return mass_kg / known_kg


def _reference_density_kg_m3(a: Assessment) -> float:
    limit = a.vehicle.valid_for.air_density_kg_m3
    return SEA_LEVEL_DENSITY_KG_M3 if limit is None else limit.low


def _times(ratio: float) -> str:
    return f"{quantity.decimals(ratio, 1)} times"
