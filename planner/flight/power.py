"""Power along a flight: what it takes to be where the vehicle is, moving as it does.

What the identified transients add on top is in ``planner.flight.transients``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.state import STATE_INDEX, FlightState
from planner.physics.atmosphere import air_density_kg_m3
from planner.vehicle.cruise_law import CruisePower, WholeLaw, whole_power_w
from planner.vehicle.hover_law import hover_power_w

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray, KinematicState
    from planner.physics.wind import Wind
    from planner.vehicle.model import VehicleModel


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyPower:
    """The steady power of one vehicle in the air of one day."""

    vehicle: VehicleModel
    mass_kg: float | None
    """With payload; ``None`` where the model does not know its own. [kg]"""
    home_amsl_m: float
    home_temperature_c: float
    wind: Wind

    def power_w(
        self,
        state: KinematicState,
        flight_state: IntArray,
        commanded_speed_m_s: FloatArray,
        is_grounded: BoolArray | None = None,
    ) -> FloatArray:
        """Return hover power, plus the steady part of each state, plus what else is switched on.

        Parameters
        ----------
        state : KinematicState
            Where the vehicle is and how it moves.
        flight_state : ndarray of int
            Positions in ``STATES``; this and the next two broadcast against the state.
        commanded_speed_m_s : ndarray
            Speed of the cruise a leg leads to. [m s⁻¹]
        is_grounded : ndarray of bool, optional
            Where the vehicle stands on the ground; default nowhere.

        Returns
        -------
        ndarray
            Electrical power, NaN where the model does not know it. [W]
        """
        vehicle = self.vehicle
        if not vehicle.is_power_known:
            return np.full(state.height_m.shape, np.nan)
        density = self._air_density_kg_m3(state.height_m)
        power = self._flying_w(state, flight_state, commanded_speed_m_s, density)
        if vehicle.loads is not None:
            if is_grounded is not None:
                power = np.where(is_grounded, vehicle.loads.ground_idle_w, power)
            power = power + vehicle.loads.avionics_w
        return power

    def _flying_w(
        self,
        state: KinematicState,
        flight_state: IntArray,
        commanded_speed_m_s: FloatArray,
        density: FloatArray | float,
    ) -> FloatArray:
        """Return the power of the motors in the air. [W]"""
        vehicle, cruise = self.vehicle, self.vehicle.cruise
        if vehicle.hover is None:
            return self._whole_w(cruise, self._airspeed_m_s(state), state.climb_m_s, density)
        power = hover_power_w(
            vehicle.hover,
            height_above_home_m=state.height_m,
            mass_kg=self.mass_kg,
            air_density_kg_m3=density,
        )
        if vehicle.vertical is not None:
            power = power + vehicle.vertical.above_hover_w(state.climb_m_s)
        if cruise is None:
            return power
        if not isinstance(cruise, CruisePower):
            airspeed = self._airspeed_m_s(state)
            moving = self._whole_w(cruise, airspeed, state.climb_m_s, density)
            return power + moving - self._whole_w(cruise, 0.0 * airspeed, 0.0 * airspeed, density)
        if vehicle.reference is Autopilot.STEP:
            return power + _stepped_w(cruise, state, flight_state, commanded_speed_m_s)
        return power + cruise.above_hover_w(self._airspeed_m_s(state))

    def _whole_w(
        self,
        law: object,
        airspeed_m_s: FloatArray,
        climb_rate_m_s: FloatArray,
        density: FloatArray | float,
    ) -> FloatArray:
        assert isinstance(law, WholeLaw)  # a model without hover law has one: see its checks
        return whole_power_w(
            law,
            airspeed_m_s=airspeed_m_s,
            climb_rate_m_s=climb_rate_m_s,
            mass_kg=self.mass_kg,
            air_density_kg_m3=density,
        )

    def _airspeed_m_s(self, state: KinematicState) -> FloatArray:
        """Return the horizontal speed through the air: over ground less the wind's. [m s⁻¹]"""
        if self.wind.speed_m_s == 0.0:
            return state.ground_speed_m_s
        factor = self.wind.speed_factor(state.height_m)
        return np.hypot(
            state.east_m_s - self.wind.east_m_s * factor,
            state.north_m_s - self.wind.north_m_s * factor,
        )

    def _air_density_kg_m3(self, height_above_home_m: FloatArray) -> FloatArray | float:
        if not self.vehicle.knows_air_density:
            return 0.0  # no law of this vehicle looks at it
        return air_density_kg_m3(
            height_above_home_m + self.home_amsl_m,
            home_amsl_m=self.home_amsl_m,
            home_temperature_c=self.home_temperature_c,
        )


def _stepped_w(
    cruise: CruisePower,
    state: KinematicState,
    flight_state: IntArray,
    commanded_speed_m_s: FloatArray,
) -> FloatArray:
    """Return the power above hover of level flight by reference steps.

    Accelerating, it grows in proportion to the speed, from none to that of the cruise the leg leads
    to (article, section 3.1.2); braking is a transient.
    """
    above = np.zeros(state.height_m.shape)
    flight_state = np.broadcast_to(flight_state, above.shape)
    level = (flight_state == STATE_INDEX[FlightState.ACCELERATE]) | (
        flight_state == STATE_INDEX[FlightState.CRUISE]
    )
    commanded = np.broadcast_to(commanded_speed_m_s, above.shape)[level]
    above[level] = cruise.above_hover_w(commanded) * state.ground_speed_m_s[level] / commanded
    return above
