"""Draws of what is not known of a flight: its conditions, and the errors of the model."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import STATES
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.conditions import Conditions
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.power import SteadyPower
    from planner.vehicle.model import ModelSpread

DRAWS = 10_000
_SEED = 1908


@frozen(eq=False)
class Draws:
    """What is drawn for each scenario; all (draws,), but the errors of the states."""

    wind_east_m_s: FloatArray
    wind_north_m_s: FloatArray
    payload_kg: FloatArray
    temperature_c: FloatArray
    charge: FloatArray
    time_error: FloatArray
    energy_error: FloatArray
    state_error: FloatArray
    """(draws, states)"""
    stopping_error: FloatArray


def make_draws(
    spread: ModelSpread, conditions: Conditions, power: SteadyPower, *, charge: tuple[float, float]
) -> Draws:
    """Draw conditions and errors of the model, always the same ones.

    Parameters
    ----------
    spread : ModelSpread
        Errors of the model.
    conditions : Conditions
        Mean conditions and their standard deviations.
    power : SteadyPower
        Whose temperature holds where the conditions give none.
    charge : tuple of float
        Mean and standard deviation of the state of charge at the start. [-]

    Returns
    -------
    Draws
        A wind drawn below zero blows the other way; a payload is not below zero, a charge not above
        all.  The draws of one quantity do not depend on the spread of another.
    """
    normal, student = _standard_draws(spread.n_flights)
    wind = conditions.wind
    speed_m_s = wind.speed_m_s + wind.speed_sd_m_s * normal[0]
    from_rad = np.radians(wind.from_deg + wind.from_sd_deg * normal[1])
    charge_mean, charge_sd = charge
    of_states = dict(spread.energy_state_fraction)
    return Draws(
        wind_east_m_s=-speed_m_s * np.sin(from_rad),
        wind_north_m_s=-speed_m_s * np.cos(from_rad),
        payload_kg=np.maximum(conditions.payload_kg + conditions.payload_sd_kg * normal[2], 0.0),
        temperature_c=power.home_temperature_c + conditions.temperature_sd_c * normal[3],
        charge=np.clip(charge_mean + charge_sd * normal[4], 0.0, 1.0),
        time_error=(spread.time_fraction or 0.0) * student[0],
        energy_error=(spread.energy_fraction or 0.0) * student[1],
        stopping_error=(spread.stopping_distance_fraction or 0.0) * student[2],
        state_error=np.array([of_states.get(state, 0.0) for state in STATES]) * student[3:].T,
    )


@lru_cache(maxsize=2)
def _standard_draws(n_flights: int) -> tuple[FloatArray, FloatArray]:
    """Return draws of the normal and of Student's distribution, made once: they are always the same."""
    random = np.random.default_rng(_SEED)
    normal = random.standard_normal((5, DRAWS))
    student = random.standard_t(n_flights, (3 + len(STATES), DRAWS))
    normal.setflags(write=False)
    student.setflags(write=False)
    return normal, student
