"""What a vehicle can do in calm air: how long it hovers, how far it goes at each speed."""

from __future__ import annotations

import math
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UsageError, nearest_hint
from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState
from planner.flight.power import SteadyPower
from planner.physics.atmosphere import standard_temperature_c
from planner.physics.wind import Wind
from planner.presented import Presented
from planner.units import JOULES_PER_WATT_HOUR
from planner.values import Value
from planner.vehicle.library import is_named_by, load_vehicle, model_names

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import FloatArray
    from planner.vehicle.model import VehicleModel

RESERVE = 0.2
"""Charge that stays in the battery. [-]"""
_HEIGHT_M = 50.0
"""Above home, at sea level. [m]"""
_FASTEST_UNKNOWN_M_S = 15.0
_MOST_ROWS = 20
_LOADS = 6
"""Payloads that the hover is given for, from none to the most that the model holds for."""


class LevelFlight(Value):
    """Steady level flight at one airspeed in calm air, until the reserve is reached."""

    speed_m_s: float
    power_w: float
    endurance_s: float | None
    """``None`` where no battery is known, or it does not give the power. [s]"""

    @property
    def energy_wh_per_km(self) -> float | None:
        """Energy over distance; ``None`` in hover. [Wh km⁻¹]"""
        if self.speed_m_s == 0.0:
            return None
        return self.power_w / self.speed_m_s * 1000.0 / JOULES_PER_WATT_HOUR

    @property
    def range_m(self) -> float | None:
        """Distance flown; ``None`` where the endurance is not known. [m]"""
        return None if self.endurance_s is None else self.speed_m_s * self.endurance_s


class LoadedHover(Value):
    """The hover with a payload."""

    payload_kg: float
    flight: LevelFlight


class Endurance(Presented):
    """What a vehicle can do in calm standard air, 50 m above sea level, to a reserve of 20 %."""

    vehicle: VehicleModel
    mass_kg: float | None
    """Take-off mass with payload. [kg]"""
    speeds: tuple[LevelFlight, ...]
    """From hover on, over the speeds the model holds for; hover alone where it does not know how its power
    changes with the airspeed, and nothing where it knows no power."""
    loads: tuple[LoadedHover, ...] = ()
    """The hover over the payload, from none to the heaviest the model holds for; nothing where it does not
    know how its power changes with the mass, or holds for one mass only."""

    @property
    def hover(self) -> LevelFlight | None:
        """The hover; ``None`` where the model knows no power."""
        return self.speeds[0] if self.speeds else None

    @property
    def longest(self) -> LevelFlight | None:
        """Best endurance; ``None`` where power over speed is not known."""
        return min(self.speeds, key=lambda one: one.power_w) if self.speeds[1:] else None

    @property
    def farthest(self) -> LevelFlight | None:
        """Best range; ``None`` where power over speed is not known."""
        moving = self.speeds[1:]
        return min(moving, key=lambda one: one.power_w / one.speed_m_s) if moving else None


def predict_endurance(vehicle: VehicleModel, *, payload_kg: float = 0.0) -> Endurance:
    """Return what a vehicle can do with a payload. [kg]

    The payload counts where the model knows how its power changes with the mass.
    """
    mass_kg = None if vehicle.mass_kg is None else vehicle.mass_kg + payload_kg
    if not vehicle.is_power_known:
        return Endurance(vehicle=vehicle, mass_kg=mass_kg, speeds=())
    limits = vehicle.valid_for.speed_m_s
    fastest_m_s = _FASTEST_UNKNOWN_M_S if limits is None else limits.high
    if not vehicle.knows_airspeed:
        fastest_m_s = 0.0
    step_m_s = math.ceil(max(fastest_m_s, 1.0) / _MOST_ROWS)
    speeds_m_s = np.unique([*np.arange(0.0, fastest_m_s, step_m_s), fastest_m_s])
    return Endurance(
        vehicle=vehicle,
        mass_kg=mass_kg,
        speeds=_flights(vehicle, mass_kg, speeds_m_s),
        loads=tuple(_loaded(vehicle)),
    )


def _loaded(vehicle: VehicleModel) -> Iterator[LoadedHover]:
    own_kg, limits = vehicle.mass_kg, vehicle.valid_for.mass_kg
    if own_kg is None or limits is None or not vehicle.knows_mass or limits.high <= own_kg:
        return
    for payload_kg in np.linspace(0.0, limits.high - own_kg, _LOADS).tolist():
        [flight] = _flights(vehicle, own_kg + payload_kg, np.zeros(1))
        yield LoadedHover(payload_kg=payload_kg, flight=flight)


def _flights(
    vehicle: VehicleModel, mass_kg: float | None, speed_m_s: FloatArray
) -> tuple[LevelFlight, ...]:
    power = SteadyPower(
        vehicle=vehicle,
        mass_kg=mass_kg,
        home_amsl_m=0.0,
        home_temperature_c=standard_temperature_c(0.0),
        wind=Wind(),
    )
    flown = map(partial(_flight, vehicle), speed_m_s.tolist(), _level_w(power, speed_m_s).tolist())
    return tuple(flown)


def list_models(words: Sequence[str] = ()) -> tuple[Endurance, ...]:
    """Return the shipped models whose name or description holds all words, each with what it can do.

    Raises
    ------
    UsageError
        If there is none.
    """
    models = map(load_vehicle, model_names())
    found = tuple(predict_endurance(one) for one in models if is_named_by(one, words))
    if not found:
        asked = " ".join(words)
        msg = (
            f"no shipped model is called {asked!r}{nearest_hint(asked, model_names())} (mavjoule models "
            "lists all; mavjoule vehicle new makes one from a data sheet)"
        )
        raise UsageError(msg)
    return found


def _level_w(power: SteadyPower, speed_m_s: FloatArray) -> FloatArray:
    zero = np.zeros_like(speed_m_s)
    state = KinematicState.of((zero, zero, zero + _HEIGHT_M), (zero, speed_m_s, zero))
    cruise, hover = (STATE_INDEX[one] for one in (FlightState.CRUISE, FlightState.HOVER))
    return power.power_w(state, np.where(speed_m_s > 0.0, cruise, hover), speed_m_s)


def _flight(vehicle: VehicleModel, speed_m_s: float, power_w: float) -> LevelFlight:
    return LevelFlight(
        speed_m_s=speed_m_s, power_w=power_w, endurance_s=_endurance_s(vehicle, power_w)
    )


def _endurance_s(vehicle: VehicleModel, power_w: float) -> float | None:
    """Return how long the model's own battery gives a power, down to the reserve. [s]"""
    battery = vehicle.battery
    if battery is None:
        return None
    circuit = battery.circuit(standard_temperature_c(0.0))
    if circuit is None:
        return (1.0 - RESERVE) * battery.energy_wh * JOULES_PER_WATT_HOUR / power_w
    empty = max(RESERVE, circuit.empty_state_of_charge(power_w, battery.cutoff_voltage_v or 0.0))
    energy_wh = circuit.delivered_wh(power_w, 1.0, empty)
    return energy_wh * JOULES_PER_WATT_HOUR / power_w if energy_wh > 0.0 else None
