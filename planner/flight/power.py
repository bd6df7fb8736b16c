"""Power along a flight: hover power where the vehicle is, plus the steady part of its state.

What the identified transients add on top is in ``planner.flight.transients``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import STATE_INDEX, FlightState
from planner.physics.atmosphere import air_density_kg_m3
from planner.vehicle.hover_law import DensityLaw, hover_power_w

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray, KinematicState
    from planner.vehicle.model import VehicleModel


@dataclass(frozen=True, slots=True, kw_only=True)
class SteadyPower:
    """The steady power of one vehicle in the air of one day."""

    vehicle: VehicleModel
    mass_kg: float | None
    """With payload; ``None`` where the model does not know its own. [kg]"""
    home_amsl_m: float
    home_temperature_c: float

    def hover_w(self, height_above_home_m: FloatArray) -> FloatArray:
        """Return hover power at heights. [W]"""
        density: FloatArray | float = 0.0
        if isinstance(self.vehicle.hover, DensityLaw):  # an altitude law does not look at it
            density = air_density_kg_m3(
                height_above_home_m + self.home_amsl_m,
                home_amsl_m=self.home_amsl_m,
                home_temperature_c=self.home_temperature_c,
            )
        return hover_power_w(
            self.vehicle.hover,
            height_above_home_m=height_above_home_m,
            mass_kg=self.mass_kg,
            air_density_kg_m3=density,
        )

    def power_w(
        self, state: KinematicState, flight_state: IntArray, commanded_speed_m_s: FloatArray
    ) -> FloatArray:
        """Return hover power plus the steady part of each state.

        Cruising costs its own power; accelerating, the power grows in proportion to the speed, from
        hover power to that of the cruise (article, section 3.1.2).

        Parameters
        ----------
        state : KinematicState
            Where the vehicle is and how it moves.
        flight_state : ndarray of int
            Positions in ``STATES``, in the shape of the state.
        commanded_speed_m_s : ndarray
            Speed of the cruise a leg leads to. [m s⁻¹]
        """
        power = self.hover_w(state.height_m)
        cruise = self.vehicle.cruise
        if cruise is None:
            return power
        level = (flight_state == STATE_INDEX[FlightState.ACCELERATE]) | (
            flight_state == STATE_INDEX[FlightState.CRUISE]
        )
        commanded = commanded_speed_m_s[level]
        above = np.interp(commanded, cruise.speed_m_s, cruise.power_above_hover_w)
        power[level] += above * state.ground_speed_m_s[level] / commanded
        return power
