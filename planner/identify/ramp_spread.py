"""The spread of a model of ramps: each flight predicted by the ramps and the power of the others.

What a log without references and without a mission tells of a flight is its manoeuvres: how far each leg
went and how fast it was flown, how high the climb was.  Their durations and energies are predicted from
these by a model made without the flight.  Loads that no log tells are part of the spread: the next flight
carries some as well.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.flight.state import FlightState
from planner.identify.manoeuvre_power import (
    at_mean_load,
    identify_manoeuvre_power,
    manoeuvre_powers,
)
from planner.identify.ramp_fit import durations_s, fit_ramps
from planner.identify.spread import FlownAndPredicted, fit_spread
from planner.identify.steady_flight import record_air_density_kg_m3
from planner.identify.timed_manoeuvres import timed_flight
from planner.vehicle.power import AltitudeLaw, CruisePower

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.power_states import PowerIdentification
    from planner.identify.settings import IdentificationSettings
    from planner.identify.steady import SteadyPower
    from planner.identify.timed_manoeuvres import TimedFlight
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import ModelSpread, Ramps


def ramp_spread(
    records: Sequence[FlightRecord], settings: IdentificationSettings
) -> ModelSpread | None:
    """Compare each flight with its prediction by the ramps and the power of the others.

    Parameters
    ----------
    records : sequence of FlightRecord
        Flights without references.
    settings : IdentificationSettings
        What no log tells.

    Returns
    -------
    ModelSpread or None
        ``None`` where ramps cannot be told without one of the flights.
    """
    told: list[tuple[TimedFlight, tuple[SteadyPower, ...]]] = []
    for record in records:
        flight = timed_flight(record)
        if not flight.refusal:
            density = record_air_density_kg_m3(record, home_temperature_c=settings.temperature_c)
            powers = manoeuvre_powers(record, air_density_kg_m3=density, mass_kg=None)
            told.append((flight, powers))
    compared = []
    for number, (flight, powers) in enumerate(told):
        others = told[:number] + told[number + 1 :]
        try:
            ramps = fit_ramps([other for other, _ in others])
        except IdentificationError:
            return None
        power = identify_manoeuvre_power(at_mean_load([own for _, own in others]))
        compared.append(_compared(flight, powers, ramps, power))
    if not compared:
        return None
    found = fit_spread(
        compared,
        source=(
            f"{len(compared)} flights, each predicted from its legs by a model made without it; "
            "with loads that are not told"
        ),
    )
    # A manoeuvre holds several states: what they share is all that is told.  Where a stop was commanded
    # these logs do not tell, so that no stopping distance can be compared.
    return replace(found, energy_state_fraction=(), stopping_distance_fraction=None)


def _compared(
    flight: TimedFlight, powers: Sequence[SteadyPower], ramps: Ramps, power: PowerIdentification
) -> FlownAndPredicted:
    durations = durations_s(flight, ramps)
    flown_j, predicted_j = 0.0, 0.0
    for mean in powers if isinstance(power.hover, AltitudeLaw) else ():
        # a manoeuvre that takes longer than predicted takes its power for longer
        middle_s = mean.start_s + 0.5 * mean.duration_s
        own, duration_s = next(
            (m, s) for m, s in reversed(durations) if m.start_s <= middle_s or m is flight.takeoff
        )
        flown_j += mean.power_w * mean.duration_s
        predicted_j += _power_w(power, mean) * mean.duration_s * duration_s / own.duration_s
    return FlownAndPredicted(
        flown_time_s=sum(m.duration_s for m, _ in durations),
        predicted_time_s=sum(s for _, s in durations),
        flown_energy_j={FlightState.CRUISE.value: flown_j} if predicted_j > 0.0 else {},
        predicted_energy_j={FlightState.CRUISE.value: predicted_j} if predicted_j > 0.0 else {},
    )


def _power_w(power: PowerIdentification, mean: SteadyPower) -> float:
    """Return what the others say of a manoeuvre, by its airspeed and climb rate. [W]"""
    assert isinstance(power.hover, AltitudeLaw)
    total = power.hover.coefficient_w
    if isinstance(power.cruise, CruisePower):
        total += float(power.cruise.above_hover_w(np.array(mean.airspeed_m_s)))
    if power.vertical is not None:
        total += float(power.vertical.above_hover_w(np.array(mean.climb_rate_m_s)))
    return total
