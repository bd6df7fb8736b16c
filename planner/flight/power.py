"""Power along a flight: the steady part, and what identified transients add to it."""

from __future__ import annotations

from functools import cached_property, lru_cache
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState
from planner.physics.atmosphere import SEA_LEVEL_PRESSURE_PA, air_density_kg_m3
from planner.physics.wind import Wind
from planner.units import GRAVITY_M_S2
from planner.values import Value, field_names, replace
from planner.vehicle.power import CruisePower, WholeLaw, hover_power_w, whole_power_w

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.physics.response import StepResponse
    from planner.physics.rotor import Acceleration
    from planner.vehicle.model import Responses, VehicleModel


_HOVER = STATE_INDEX[FlightState.HOVER]
_LEVEL = (STATE_INDEX[FlightState.ACCELERATE], STATE_INDEX[FlightState.CRUISE])
_LEAST_SPEED_M_S = 1e-9
"""Keeps a ratio of speeds finite where a vehicle stands still."""


class SteadyPower(Value):
    """The steady power of one vehicle in the air of one day."""

    vehicle: VehicleModel
    mass_kg: float | None
    """With payload; ``None`` where the model does not know its own. [kg]"""
    home_amsl_m: float
    home_temperature_c: float
    wind: Wind
    sea_level_pressure_pa: float = SEA_LEVEL_PRESSURE_PA

    @property
    def counted(self) -> SteadyPower:
        """The same without what no law of the vehicle looks at: where it is equal, powers are."""
        vehicle = self.vehicle
        return replace(
            self,
            wind=self.wind if vehicle.knows_airspeed else Wind(),
            home_temperature_c=self.home_temperature_c if vehicle.knows_air_density else 0.0,
            sea_level_pressure_pa=(
                self.sea_level_pressure_pa if vehicle.knows_air_density else SEA_LEVEL_PRESSURE_PA
            ),
        )

    def power_w(
        self,
        state: KinematicState,
        flight_state: IntArray,
        commanded_speed_m_s: FloatArray,
        is_grounded: BoolArray | None = None,
        acceleration_m_s2: FloatArray | None = None,
    ) -> FloatArray:
        """Return hover power, plus the steady part of each state, plus what else is switched on. [W]

        NaN where the model does not know its power.

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
        acceleration_m_s2 : ndarray, optional
            East, north and up; default none.  (3, …)
        """
        vehicle = self.vehicle
        if not vehicle.is_power_known:
            return np.full(state.height_m.shape, np.nan)
        # where no law of the vehicle looks at the density, none is computed
        density = self.air_density_kg_m3(state.height_m) if vehicle.knows_air_density else 0.0
        power = self._flying_w(state, flight_state, commanded_speed_m_s, density, acceleration_m_s2)
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
        acceleration_m_s2: FloatArray | None,
    ) -> FloatArray:
        """Return the power of the motors in the air. [W]"""
        vehicle, cruise = self.vehicle, self.vehicle.cruise
        power: FloatArray | None = None
        if vehicle.hover is not None:
            power = hover_power_w(
                vehicle.hover,
                height_above_home_m=state.height_m,
                mass_kg=self.mass_kg,
                air_density_kg_m3=density,
            )
            if cruise is None and vehicle.vertical is None:
                return power  # it does not depend on how the vehicle moves
        if vehicle.reference is Autopilot.STEP:
            state, acceleration_m_s2 = _not_of_responses(
                state, acceleration_m_s2, flight_state, vehicle.responses
            )
        if power is None:
            return self._whole_w(cruise, state, density, acceleration_m_s2)
        if vehicle.vertical is not None:
            power = power + vehicle.vertical.above_hover_w(state.climb_m_s)
        if cruise is None:
            return power
        if not isinstance(cruise, CruisePower):
            moving = self._whole_w(cruise, state, density, acceleration_m_s2)
            return power + moving - self._hover_w(cruise, density)
        above = cruise.above_hover_w(self.airspeed_m_s(state))
        if vehicle.reference is Autopilot.STEP:
            level = (flight_state == _LEVEL[0]) | (flight_state == _LEVEL[1])
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
        fraction = speed / np.maximum(commanded_speed_m_s, _LEAST_SPEED_M_S)

        def above_hover_w(factor: FloatArray | float) -> FloatArray:
            east, north = factor * state.east_m_s, factor * state.north_m_s
            moving = replace(state, east_m_s=east, north_m_s=north)
            return cruise.above_hover_w(self.airspeed_m_s(moving))

        standing = above_hover_w(0.0)
        cruising = above_hover_w(1.0 / np.maximum(fraction, _LEAST_SPEED_M_S))
        return standing + (cruising - standing) * fraction

    def _whole_w(
        self,
        law: object,
        state: KinematicState,
        density: FloatArray | float,
        acceleration_m_s2: FloatArray | None,
    ) -> FloatArray:
        assert isinstance(law, WholeLaw)  # a model without hover law has one: see its checks
        airspeed = self.airspeed_m_s(state)
        return whole_power_w(
            law,
            airspeed_m_s=airspeed,
            climb_rate_m_s=state.climb_m_s,
            mass_kg=self.mass_kg,
            air_density_kg_m3=density,
            acceleration=(
                None
                if acceleration_m_s2 is None
                else _in_the_air(acceleration_m_s2, self._velocity_through_air(state), airspeed)
            ),
        )

    def _hover_w(self, law: WholeLaw, density: FloatArray | float) -> FloatArray:
        return whole_power_w(
            law,
            airspeed_m_s=0.0,
            climb_rate_m_s=0.0,
            mass_kg=self.mass_kg,
            air_density_kg_m3=density,
        )

    def airspeed_m_s(self, state: KinematicState) -> FloatArray:
        """Return the horizontal speed through the air: over ground less the wind's. [m s⁻¹]"""
        if self.wind.speed_m_s == 0.0:
            return state.ground_speed_m_s
        return np.hypot(*self._velocity_through_air(state))

    def _velocity_through_air(self, state: KinematicState) -> tuple[FloatArray, FloatArray]:
        """Return the horizontal velocity through the air, east and north. [m s⁻¹]"""
        if self.wind.speed_m_s == 0.0:
            return state.east_m_s, state.north_m_s
        factor = self.wind.speed_factor(state.height_m)
        return (
            state.east_m_s - self.wind.east_m_s * factor,
            state.north_m_s - self.wind.north_m_s * factor,
        )

    def hover_w(self, place_m: FloatArray) -> FloatArray:
        """Return the powers of hovers at places (n, 3) [m]. (n,) [W]"""
        zero = np.zeros(len(place_m))
        state = KinematicState.of(place_m.T, (zero, zero, zero))
        return self.power_w(state, np.full(len(zero), _HOVER), zero)

    def air_density_kg_m3(self, height_above_home_m: npt.ArrayLike) -> FloatArray:
        """Return the density of the air of the day at heights. [kg m⁻³]"""
        return air_density_kg_m3(
            np.asarray(height_above_home_m) + self.home_amsl_m,
            home_amsl_m=self.home_amsl_m,
            home_temperature_c=self.home_temperature_c,
            sea_level_pressure_pa=self.sea_level_pressure_pa,
        )


def _in_the_air(
    acceleration_m_s2: FloatArray, through_air: tuple[FloatArray, FloatArray], airspeed: FloatArray
) -> Acceleration:
    """Return accelerations along and across the airspeed; across it where there is none.

    Of those a vehicle follows: one that leans 45 degrees, as far as autopilots lean by default, has that of
    gravity.  What references ask beyond it (the cusp of a spline) is flown otherwise, and not counted.
    """
    from planner.physics.rotor import Acceleration

    is_followed = np.linalg.norm(acceleration_m_s2, axis=0) <= GRAVITY_M_S2
    east, north, up = acceleration_m_s2 * is_followed
    size = np.maximum(airspeed, _LEAST_SPEED_M_S)
    ahead_east, ahead_north = through_air[0] / size, through_air[1] / size
    along = east * ahead_east + north * ahead_north
    across = np.sqrt(np.maximum(east * east + north * north - along * along, 0.0))
    return Acceleration(along_m_s2=along, across_m_s2=across, up_m_s2=up)


def _not_of_responses(
    state: KinematicState,
    acceleration_m_s2: FloatArray | None,
    flight_state: IntArray,
    responses: Responses,
) -> tuple[KinematicState, FloatArray | None]:
    """Return a motion without what identified responses describe: it is not counted twice.

    They are the power above hover of a manoeuvre: the braking, the climb, the descent.
    """
    east, north, climb = state.east_m_s, state.north_m_s, state.climb_m_s
    if responses.brake_power is not None:
        moving = np.where(flight_state == STATE_INDEX[FlightState.BRAKE], 0.0, 1.0)
        east, north = moving * east, moving * north
        if acceleration_m_s2 is not None:
            acceleration_m_s2 = acceleration_m_s2 * moving
    if responses.climb_power is not None:
        climb = np.minimum(climb, 0.0)
    if responses.descent_power is not None:
        climb = np.maximum(climb, 0.0)
    if acceleration_m_s2 is not None:
        # of a climb that is not counted the change is not either
        level = np.where(climb == state.climb_m_s, 1.0, 0.0)
        acceleration_m_s2 = np.stack((*acceleration_m_s2[:2], acceleration_m_s2[2] * level))
    return replace(state, east_m_s=east, north_m_s=north, climb_m_s=climb), acceleration_m_s2


# The same few responses are asked for every mission: the peak needs root finding.
@lru_cache(maxsize=64)
def _whole_j(unit: StepResponse, window_s: float) -> float:
    return float(unit.integral(window_s))


@lru_cache(maxsize=64)
def _peak_s(unit: StepResponse, window_s: float, *, highest: bool) -> float:
    return unit.extremum(window_s, highest=highest).time_s


class Transients(Value, eq=False, dict=True):
    """Windows of power responses as columns, in the order of their start.

    A row may pause at ``pause_at_s`` for ``pause_s``: a climb longer than the identified step holds its
    peak rate there, and the power belonging to it.
    """

    responses: tuple[StepResponse | None, ...]
    """Answers to unit steps, W per unit of input; ``None`` where the model has none."""
    window_s: tuple[float, ...]
    """Window of each response, from the step on. [s]"""
    segment: IntArray
    """Segment that begins the window. (n,)"""
    response: IntArray
    """Position in ``responses``. (n,)"""
    amplitude: FloatArray
    """Size of the input step. (n,)"""
    start_s: FloatArray
    pause_at_s: FloatArray
    pause_s: FloatArray

    def select(self, rows: BoolArray) -> Transients:
        """Return some of the windows."""
        columns = {name: getattr(self, name)[rows] for name in field_names(self)[2:]}
        return replace(self, **columns)

    def end_s(self) -> FloatArray:
        """Return when each window ends. (n,) [s]"""
        return np.asarray(self.start_s + self.pause_s + np.asarray(self.window_s)[self.response])

    @cached_property
    def _known(self) -> list[tuple[BoolArray, StepResponse, float]]:
        """The rows of each response there is, with the response and its window."""
        known = zip(self.responses, self.window_s, strict=True)
        return [
            (rows, unit, window_s)
            for index, (unit, window_s) in enumerate(known)
            if unit is not None and (rows := self.response == index).any()
        ]

    def power_w(self, row: IntArray, time_s: FloatArray) -> FloatArray:
        """Return the power of windows ``row`` at times counted from their start; zero outside. [W]"""
        paused = np.maximum(time_s - self.pause_at_s[row], 0.0)
        own = time_s - np.minimum(paused, self.pause_s[row])
        power = np.zeros(own.shape)
        for rows, unit, window in self._known:
            inside = rows[row] & (own >= 0.0) & (own < window)
            power[inside] = self.amplitude[row[inside]] * unit.value(own[inside])
        return power

    def energy_j(self) -> FloatArray:
        """Return the energy of each whole window: integral of the response plus the pause. (n,) [J]"""
        energy = np.zeros(len(self.segment))
        for rows, unit, window in self._known:
            pause_s = self.pause_s[rows]
            paused_j: FloatArray | float = 0.0
            if pause_s.any():
                pause_at_s = self.pause_at_s[rows]  # of one response all the same
                at_s = sorted({*pause_at_s.tolist()})
                paused_j = unit.value(at_s)[np.searchsorted(at_s, pause_at_s)] * pause_s
            energy[rows] = self.amplitude[rows] * (_whole_j(unit, window) + paused_j)
        return energy

    def peak_times_s(self) -> FloatArray:
        """Return when each window's power is highest, since the start of the flight. (n,) [s]"""
        times = np.zeros(len(self.segment))
        for rows, unit, window in self._known:
            rising_s, falling_s = (_peak_s(unit, window, highest=one) for one in (True, False))
            times[rows] = np.where(self.amplitude[rows] > 0.0, rising_s, falling_s)
        late = times > self.pause_at_s
        return self.start_s + times + np.where(late, self.pause_s, 0.0)

    def total_power_w(self, time_s: FloatArray) -> FloatArray:
        """Return the sum of all windows at times since the start of the flight. [W]"""
        if not len(self.start_s):
            return np.zeros(np.shape(time_s))
        times = np.ravel(time_s)
        order = times.argsort(kind="stable")
        first = times.searchsorted(self.start_s, sorter=order)
        last = times.searchsorted(self.end_s(), side="right", sorter=order)
        # the times of one window after those of the one before
        count = last - first
        row = np.arange(len(count)).repeat(count)
        at = order[np.arange(len(row)) - (count.cumsum() - count - first).repeat(count)]
        power = self.power_w(row, times[at] - self.start_s[row])
        total = np.bincount(at, power, len(times)).astype(np.float64)
        return total.reshape(np.shape(time_s))


_NONE = np.zeros(0)
NO_TRANSIENTS = Transients(
    responses=(),
    window_s=(),
    segment=_NONE.astype(np.intp),
    response=_NONE.astype(np.intp),
    amplitude=_NONE,
    start_s=_NONE,
    pause_at_s=_NONE,
    pause_s=_NONE,
)
"""What a vehicle has whose references are shaped."""
