r"""How far whole flights were from predictions.

For flights f the model was not fitted to, with the relative error of the energy of state s

.. math:: r_{fs} = \varepsilon_f + \eta_{fs},

the part common to a flight and that of each state are separated by moments: the deviation of a state
from its whole flight holds no common part.  Errors count from zero, so that a bias is part of the
spread: the next flight meets it as well.
"""

from __future__ import annotations

import contextlib
from collections import defaultdict
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError, MavjouleError
from planner.flight.motion.kinematics import FlightState
from planner.identify.power import identify_power, manoeuvre_powers, power_of_manoeuvres
from planner.identify.ramps import durations_s, fit_ramps, timed_flight
from planner.identify.segments import (
    climb_rate_m_s,
    find_states,
    record_air_density_kg_m3,
    speed_through_air_m_s,
)
from planner.identify.verification import KnownConditions, verify_flight
from planner.units import SECONDS_PER_HOUR
from planner.values import Value, replace
from planner.vehicle.model import STATE_NAMES, ModelSpread
from planner.vehicle.power import AltitudeLaw, CruisePower, WholeLaw, whole_power_w

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from planner.arrays import FloatArray
    from planner.identify.assembly import IdentificationSettings
    from planner.identify.power import PowerIdentification
    from planner.identify.ramps import TimedFlight
    from planner.identify.segments import MeasuredPower
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import Ramps, VehicleModel


class FlownAndPredicted(Value):
    """One flight and its prediction by a model that was not fitted to it."""

    flown_time_s: float
    predicted_time_s: float
    flown_energy_j: Mapping[str, float]
    """By the name of the state; empty where the power was not recorded. [J]"""
    predicted_energy_j: Mapping[str, float]
    """Of the same states. [J]"""
    flown_stops_m: Sequence[float] = ()
    """Stopping distances, one by one. [m]"""
    predicted_stops_m: Sequence[float] = ()


def fit_spread(flights: Sequence[FlownAndPredicted], *, source: str) -> ModelSpread:
    """Return how far flights were from their predictions.

    Standard deviations are about zero, rounded up to four decimals, and ``None`` for what no flight
    shows. ``source`` is which flights, and how they were compared, for the model file.

    Raises IdentificationError if there is no flight, or nothing is predicted of one.
    """
    if not flights or any(flight.predicted_time_s <= 0.0 for flight in flights):
        msg = "the spread of a model needs flights and their predictions"
        raise IdentificationError(msg)
    common, states = _energy_fractions([flight for flight in flights if flight.flown_energy_j])
    return ModelSpread(
        n_flights=len(flights),
        source=source,
        time_fraction=_root_mean_square(
            flight.flown_time_s / flight.predicted_time_s - 1.0 for flight in flights
        ),
        energy_fraction=common,
        energy_state_fraction=states,
        stopping_distance_fraction=_root_mean_square(
            flown / predicted - 1.0
            for flight in flights
            for flown, predicted in zip(flight.flown_stops_m, flight.predicted_stops_m, strict=True)
            if predicted > 0.0
        ),
    )


def _energy_fractions(
    flights: Sequence[FlownAndPredicted],
) -> tuple[float | None, tuple[tuple[str, float], ...]]:
    """Return the deviation common to the states of a flight, and that of each state by itself."""
    from scipy.optimize import nnls

    if not flights:
        return None, ()
    predicted = _by_state(flight.predicted_energy_j for flight in flights)
    flown = _by_state(flight.flown_energy_j for flight in flights)
    fraction = predicted / predicted.sum(axis=1, keepdims=True)
    whole = flown.sum(axis=1) / predicted.sum(axis=1) - 1.0
    # (r_s - r)² = (1 - w_s)² σ_s² + Σ_k≠s w_k² σ_k², for each state of each flight that has it
    flight, state = np.nonzero(fraction > 0.0)
    deviation = flown[flight, state] / predicted[flight, state] - 1.0 - whole[flight]
    coefficients = np.square(fraction[flight])
    coefficients[np.arange(state.size), state] = np.square(1.0 - fraction[flight, state])
    # a state of little energy is little known and matters little: weighed by what it is of a flight
    weight = fraction[flight, state]
    variances, _ = nnls(weight[:, None] * coefficients, weight * np.square(deviation))
    of_states = np.square(fraction) @ variances
    common = float(np.mean(np.square(whole) - of_states))
    return _rounded_up(np.sqrt(max(common, 0.0))), tuple(
        (name, _rounded_up(np.sqrt(variance)))
        for name, variance, seen in zip(STATE_NAMES, variances, fraction.any(axis=0), strict=True)
        if seen
    )


def _by_state(energies_j: Iterable[Mapping[str, float]]) -> FloatArray:
    return np.array([[one.get(name, 0.0) for name in STATE_NAMES] for one in energies_j])


def _root_mean_square(fractions: Iterable[float]) -> float | None:
    values = np.array(list(fractions))
    return _rounded_up(np.sqrt(np.mean(np.square(values)))) if values.size else None


def _rounded_up(fraction: float) -> float:
    return float(np.ceil(1e4 * fraction - 1e-6) / 1e4)


_LEAST_FLIGHTS = 2


def left_out_spread(
    model: VehicleModel,
    records: Sequence[FlightRecord],
    steady: Sequence[MeasuredPower],
    settings: IdentificationSettings,
) -> ModelSpread | None:
    """Compare each flight with its prediction by the power of the others.

    ``None`` where there are fewer than two flights, or none can be compared.
    """
    if len(records) < _LEAST_FLIGHTS:
        return None
    compared: list[FlownAndPredicted] = []
    is_whole = True
    for record in records:
        without = _model_without(model, record, steady, settings)
        if without is not None:
            whole = _whole_flight(record, without, settings) if record.mission_items else None
            is_whole &= whole is not None
            one = whole or _energy_alone(record, without, settings)
            compared += [] if one is None else [one]
    if not compared:
        return None
    how = "from its mission alone" if is_whole else "along the motion flown"
    found = fit_spread(
        compared, source=f"{len(compared)} flights, each predicted {how} by a model made without it"
    )
    if not is_whole:
        found = replace(found, time_fraction=None, stopping_distance_fraction=None)
    return None if found.time_fraction is None and found.energy_fraction is None else found


def _model_without(
    model: VehicleModel,
    record: FlightRecord,
    steady: Sequence[MeasuredPower],
    settings: IdentificationSettings,
) -> VehicleModel | None:
    if not model.is_power_known:
        return model
    own = f"{record.source}#{record.number}"
    power = identify_power(
        [f for f in steady if f.source != own], mass_deviation_kg=settings.payload_deviation_kg
    )
    if not power.is_known:
        return None
    return replace(model, hover=power.hover, cruise=power.cruise, vertical=power.vertical)


def _whole_flight(
    record: FlightRecord, model: VehicleModel, settings: IdentificationSettings
) -> FlownAndPredicted | None:
    own = settings.conditions_of(record)
    known = KnownConditions(
        payload_kg=own.payload_kg or 0.0,
        temperature_c=own.temperature_c,
        position_noise_m=model.position_noise_m,  # whoever plans a flight knows no other
    )
    try:
        found = verify_flight(record, model, known)
    except MavjouleError:  # what cannot be predicted shows nothing of predictions
        return None
    joules = SECONDS_PER_HOUR
    has_energy = found.measured.energy_wh is not None and found.predicted.energy_wh is not None
    of_states = [
        s for s in found.states if has_energy and s.energy_wh is not None and s.predicted_energy_wh
    ]
    stops = [(s.measured_m, s.predicted_m) for s in found.stops if s.predicted_m]
    return FlownAndPredicted(
        flown_time_s=found.measured.time_s,
        predicted_time_s=found.predicted.time_s,
        flown_energy_j={s.state.value: joules * (s.energy_wh or 0.0) for s in of_states},
        predicted_energy_j={
            s.state.value: joules * (s.predicted_energy_wh or 0.0) for s in of_states
        },
        flown_stops_m=tuple(measured_m for measured_m, _ in stops),
        predicted_stops_m=tuple(predicted_m for _, predicted_m in stops),
    )


def _energy_alone(
    record: FlightRecord, model: VehicleModel, settings: IdentificationSettings
) -> FlownAndPredicted | None:
    """Return the energy of each state along the motion flown."""
    law, mass_kg = model.cruise, settings.flown_mass_kg(record)
    if not isinstance(law, WholeLaw) or mass_kg is None:
        return None
    speed = speed_through_air_m_s(record)
    temperature_c = settings.conditions_of(record).temperature_c
    density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
    climb = climb_rate_m_s(record)
    columns = np.stack([speed, climb, record.power_w, density])
    known = np.isfinite(columns).all(axis=0)
    predicted_w = np.zeros(known.size)
    predicted_w[known] = whole_power_w(
        law,
        airspeed_m_s=speed[known],
        climb_rate_m_s=climb[known],
        mass_kg=mass_kg,
        air_density_kg_m3=density[known],
    )
    flown: dict[str, float] = defaultdict(float)
    predicted: dict[str, float] = defaultdict(float)
    power_w = np.where(known, record.power_w, 0.0)
    for segment in find_states(record):
        flown[segment.state.value] += record.step_s * float(power_w[segment.samples].sum())
        predicted[segment.state.value] += record.step_s * float(predicted_w[segment.samples].sum())
    if not sum(predicted.values()) > 0.0:
        return None
    return FlownAndPredicted(
        flown_time_s=record.duration_s,
        predicted_time_s=record.duration_s,
        flown_energy_j=flown,
        predicted_energy_j=predicted,
    )


def ramp_spread(
    records: Sequence[FlightRecord], settings: IdentificationSettings
) -> ModelSpread | None:
    """Compare each flight with its prediction by the ramps and the power of the others.

    ``None`` where there are no ramps without one of the flights.
    """
    usable: list[tuple[TimedFlight, tuple[MeasuredPower, ...]]] = []
    for record in records:
        with contextlib.suppress(IdentificationError):
            flight = timed_flight(record)
            temperature_c = settings.conditions_of(record).temperature_c
            density = record_air_density_kg_m3(record, home_temperature_c=temperature_c)
            mass_kg = settings.flown_mass_kg(record)
            powers = manoeuvre_powers(record, air_density_kg_m3=density, mass_kg=mass_kg)
            usable.append((flight, powers))
    compared = []
    for number, (flight, powers) in enumerate(usable):
        others = usable[:number] + usable[number + 1 :]
        try:
            ramps = fit_ramps([other for other, _ in others])
        except IdentificationError:
            return None
        deviation_kg = settings.payload_deviation_kg
        power, _ = power_of_manoeuvres([own for _, own in others], deviation_kg)
        compared.append(_compared(flight, powers, ramps, power))
    if not compared:
        return None
    has_masses = all(settings.flown_mass_kg(record) is not None for record in records)
    found = fit_spread(
        compared,
        source=(
            f"{len(compared)} flights, each predicted from its legs by a model made without it"
            f"{'' if has_masses else '; with unknown loads'}"
        ),
    )
    # A manoeuvre holds several states: what they share is all that is known.  Where a stop was commanded
    # these logs do not hold, so that no stopping distance can be compared.
    return replace(found, energy_state_fraction=(), stopping_distance_fraction=None)


def _compared(
    flight: TimedFlight, powers: Sequence[MeasuredPower], ramps: Ramps, power: PowerIdentification
) -> FlownAndPredicted:
    durations = list(zip(flight.manoeuvres, durations_s(flight, ramps), strict=True))
    flown_j, predicted_j = 0.0, 0.0
    for mean in powers if power.is_known else ():
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


def _power_w(power: PowerIdentification, mean: MeasuredPower) -> float:
    """Return what the other flights predict for a manoeuvre, by its airspeed and climb rate. [W]"""
    if isinstance(power.cruise, WholeLaw):
        return float(
            whole_power_w(
                power.cruise,
                airspeed_m_s=mean.airspeed_m_s,
                climb_rate_m_s=mean.climb_rate_m_s,
                mass_kg=mean.mass_kg,
                air_density_kg_m3=mean.air_density_kg_m3 or 0.0,
            )
        )
    assert isinstance(power.hover, AltitudeLaw)
    total = power.hover.coefficient_w
    if isinstance(power.cruise, CruisePower):
        total += float(power.cruise.above_hover_w(np.array(mean.airspeed_m_s)))
    if power.vertical is not None:
        total += float(power.vertical.above_hover_w(np.array(mean.climb_rate_m_s)))
    return total
