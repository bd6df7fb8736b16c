"""The spread of a model: each flight predicted by a model made without it.

A flight whose log holds its mission is predicted whole, as `mavjoule verify` does.  Of one without a
mission the energy alone is predicted, along the motion that was flown.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import MavjouleError
from planner.identify.power_states import identify_power
from planner.identify.spread import FlownAndPredicted, fit_spread
from planner.identify.states import find_states, slope_per_s
from planner.identify.steady import speed_through_air_m_s
from planner.identify.steady_flight import record_air_density_kg_m3
from planner.identify.verification import KnownConditions, verify_flight
from planner.units import SECONDS_PER_HOUR
from planner.vehicle.power import (
    WholeLaw,
    whole_power_w,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.identify.settings import IdentificationSettings
    from planner.identify.steady import SteadyPower
    from planner.logs.record import FlightRecord
    from planner.vehicle.model import ModelSpread, VehicleModel

_LEAST_FLIGHTS = 2
_SLOPE_S = 3.0
"""Window of a climb rate told by heights alone. [s]"""


def left_out_spread(
    model: VehicleModel,
    records: Sequence[FlightRecord],
    steady: Sequence[SteadyPower],
    settings: IdentificationSettings,
) -> ModelSpread | None:
    """Compare each flight with its prediction by the power of the others.

    Parameters
    ----------
    model : VehicleModel
        Made of all flights, by an autopilot's references.
    records : sequence of FlightRecord
        The flights.
    steady : sequence of SteadyPower
        Their steady flight.
    settings : IdentificationSettings
        What no log tells.

    Returns
    -------
    ModelSpread or None
        ``None`` where there are fewer than two flights, or none can be compared.
    """
    if len(records) < _LEAST_FLIGHTS:
        return None
    compared: list[FlownAndPredicted] = []
    is_whole = True
    for record in records:
        without = _model_without(model, record, steady, settings)
        if without is None:
            continue
        whole = _whole_flight(record, without, settings) if record.mission_items else None
        is_whole &= whole is not None
        one = whole or _energy_alone(record, without, settings)
        if one is not None:
            compared.append(one)
    if not compared:
        return None
    how = "from its mission alone" if is_whole else "along the motion flown"
    found = fit_spread(
        compared,
        source=f"{len(compared)} flights, each predicted {how} by a model made without it",
    )
    if not is_whole:
        found = replace(found, time_fraction=None, stopping_distance_fraction=None)
    return None if found.time_fraction is None and found.energy_fraction is None else found


def _model_without(
    model: VehicleModel,
    record: FlightRecord,
    steady: Sequence[SteadyPower],
    settings: IdentificationSettings,
) -> VehicleModel | None:
    """Return the model with the power of the other flights."""
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
    known = KnownConditions(
        payload_kg=settings.payload_kg,
        temperature_c=settings.temperature_c,
        position_noise_m=settings.position_noise_m,  # whoever plans a flight knows no other
    )
    try:
        found = verify_flight(record, model, known)
    except MavjouleError:  # what cannot be predicted tells nothing about predictions
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
    law = model.cruise
    if not isinstance(law, WholeLaw) or model.mass_kg is None:
        return None
    speed = speed_through_air_m_s(record)
    density = record_air_density_kg_m3(record, home_temperature_c=settings.temperature_c)
    step_s = float(record.time_s[1] - record.time_s[0])
    climb = record.climb_m_s
    if not np.isfinite(climb).any():
        climb = slope_per_s(record.height_above_home_m, round(_SLOPE_S / step_s), step_s)
    columns = np.stack([speed, climb, record.power_w, density])
    known = np.isfinite(columns).all(axis=0)
    predicted_w = np.zeros(known.size)
    predicted_w[known] = whole_power_w(
        law,
        airspeed_m_s=speed[known],
        climb_rate_m_s=climb[known],
        mass_kg=model.mass_kg + settings.payload_kg,
        air_density_kg_m3=density[known],
    )
    flown: dict[str, float] = {}
    predicted: dict[str, float] = {}
    for segment in find_states(record):
        part = np.zeros(known.size, dtype=np.bool_)
        part[segment.samples] = True
        part &= known
        name = segment.state.value
        flown[name] = flown.get(name, 0.0) + step_s * float(record.power_w[part].sum())
        predicted[name] = predicted.get(name, 0.0) + step_s * float(predicted_w[part].sum())
    if not sum(predicted.values()) > 0.0:
        return None
    return FlownAndPredicted(
        flown_time_s=record.duration_s,
        predicted_time_s=record.duration_s,
        flown_energy_j=flown,
        predicted_energy_j=predicted,
    )
