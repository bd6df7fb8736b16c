"""Power along a flight: what it takes to be where the vehicle is, moving as it does.

What the identified transients add on top is in ``planner.flight.transients``.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.state import STATE_INDEX, FlightState
from planner.frozen import frozen
from planner.physics.atmosphere import air_density_kg_m3
from planner.vehicle.power import (
    CruisePower,
    WholeLaw,
    hover_power_w,
    whole_power_w,
)

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray, KinematicState
    from planner.physics.wind import Wind
    from planner.vehicle.model import Responses, VehicleModel

_LEVEL = (STATE_INDEX[FlightState.ACCELERATE], STATE_INDEX[FlightState.CRUISE])
_LEAST_SPEED_M_S = 1e-9
"""Keeps a ratio of speeds finite where a vehicle stands."""


@frozen
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
        # where no law of the vehicle looks at the density, none is computed
        density = self.air_density_kg_m3(state.height_m) if vehicle.knows_air_density else 0.0
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
        if vehicle.reference is Autopilot.STEP:
            state = _not_of_responses(state, flight_state, vehicle.responses)
        if vehicle.hover is None:
            return self._whole_w(cruise, self.airspeed_m_s(state), state.climb_m_s, density)
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
            airspeed = self.airspeed_m_s(state)
            moving = self._whole_w(cruise, airspeed, state.climb_m_s, density)
            return power + moving - self._whole_w(cruise, 0.0 * airspeed, 0.0 * airspeed, density)
        above = cruise.above_hover_w(self.airspeed_m_s(state))
        if vehicle.reference is Autopilot.STEP:
            level = np.isin(flight_state, _LEVEL)
            above = np.where(level, self._stepped_w(cruise, state, commanded_speed_m_s), above)
        return power + above

    def _stepped_w(
        self, cruise: CruisePower, state: KinematicState, commanded_speed_m_s: FloatArray
    ) -> FloatArray:
        """Return the power above hover of level flight by reference steps.

        Accelerating, it grows in proportion to the speed, from that of standing in the wind to that
        of the cruise the leg leads to (article, section 3.1.2).
        """
        speed = state.ground_speed_m_s
        share = speed / np.maximum(commanded_speed_m_s, _LEAST_SPEED_M_S)
        scale = 1.0 / np.maximum(share, _LEAST_SPEED_M_S)
        standing, cruising = (
            cruise.above_hover_w(
                self.airspeed_m_s(
                    replace(
                        state, east_m_s=factor * state.east_m_s, north_m_s=factor * state.north_m_s
                    )
                )
            )
            for factor in (0.0, scale)
        )
        return standing + (cruising - standing) * share

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

    def airspeed_m_s(self, state: KinematicState) -> FloatArray:
        """Return the horizontal speed through the air: over ground less the wind's. [m s⁻¹]"""
        if self.wind.speed_m_s == 0.0:
            return state.ground_speed_m_s
        factor = self.wind.speed_factor(state.height_m)
        return np.hypot(
            state.east_m_s - self.wind.east_m_s * factor,
            state.north_m_s - self.wind.north_m_s * factor,
        )

    def air_density_kg_m3(self, height_above_home_m: npt.ArrayLike) -> FloatArray:
        """Return the density of the air of the day at heights. [kg m⁻³]"""
        return air_density_kg_m3(
            np.asarray(height_above_home_m) + self.home_amsl_m,
            home_amsl_m=self.home_amsl_m,
            home_temperature_c=self.home_temperature_c,
        )


def _not_of_responses(
    state: KinematicState, flight_state: IntArray, responses: Responses
) -> KinematicState:
    """Return a motion without what identified responses describe: it is not counted twice.

    They are the power above hover of a manoeuvre: the braking, the climb, the descent.
    """
    if responses.brake_power is not None:
        moving = np.where(flight_state == STATE_INDEX[FlightState.BRAKE], 0.0, 1.0)
        state = replace(state, east_m_s=moving * state.east_m_s, north_m_s=moving * state.north_m_s)
    if responses.climb_power is not None:
        state = replace(state, climb_m_s=np.minimum(state.climb_m_s, 0.0))
    if responses.descent_power is not None:
        state = replace(state, climb_m_s=np.maximum(state.climb_m_s, 0.0))
    return state
