r"""The uncertainty of a prediction: many flights of one mission, as samples of what is not known.

Sampled are the conditions (wind, payload, temperature, charge) and the errors of the model as the
``[spread]`` of its file has them.  With the energy :math:`E_s` of each state,

.. math:: E = (1 + \varepsilon) \sum_s (1 + \eta_s)\, E_s(w, m, T), \qquad
          t = (1 + \tau)\, t_0 + \sum_{legs} \lambda + \sum_{landings} \delta,

ε common to a flight, with a part that grows in proportion to the wind, η to all its states of one kind
(climbing, level, descending), τ to its time, λ of each leg with its turn or stop, δ of each landing until the
motors stop.  All but λ come from n flights, so each is its standard deviation times a sample of Student's t
with n degrees of freedom: with few flights the standard deviation is itself little known (Student, Biometrika
6 (1908) 1).  Legs are many: λ is normal.  Where PX4's position is noisy its time waits for the vehicle, and
what a flight takes is spread in proportion to that noise, down to what flights without noise show; the noise
itself is drawn where it is the model's, its logarithm normal.

Approximations:

* The motion is that of the mean wind and is not flown again: a sample changes the power along it.
* Over the box of the sampled conditions the energy is interpolated by Chebyshev polynomials in each
  of them (L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 2 and 3),
  from exact evaluations at a fixed number of points.
* Returns are judged from the points where they are tightest in mean and in extreme conditions, to
  where the vehicle goes in mean ones; the stop before the return is that of mean conditions.
* Charge follows energy, at the mean voltage of the prediction; the energy a battery holds is taken
  at the mean power and temperature.

The samples are always the same: what differs between two predictions is never chance.
"""

from __future__ import annotations

import math
from functools import cached_property, lru_cache
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from planner.autopilot import Autopilot
from planner.flight.budget import (
    MOST_CHANCE_EMPTY,
    ChargedPack,
    battery_temperature_c,
    predict_discharges,
)
from planner.flight.motion.kinematics import QUADRATURE_WEIGHTS, STATE_INDEX, STATES, FlightState
from planner.flight.prediction import segment_energies_j
from planner.flight.returns.tightest import sweep_returns
from planner.quantity import mean_of, sd_of
from planner.units import j_from_wh, wh_from_j
from planner.values import Value, replace
from planner.vehicle.law_factors import STEADY_FLIGHTS, is_narrowable, level_fractions
from planner.vehicle.model import Basis
from planner.vehicle.power import CruisePower
from planner.vehicle.repeatability import REPEATABILITY

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping

    from planner.arrays import FloatArray, IntArray
    from planner.flight.budget import BatteryBudget, Totals
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Flight
    from planner.flight.returns.path import Returns
    from planner.flight.returns.tightest import ReturnPlan, ReturnSweep
    from planner.setup import Setup
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import ModelSpread, VehicleModel


_LEAST_WH = 1e-9
"""A flight whose sample takes none counts as if it took this."""
SAMPLES = 10_000
_SEED = 1908
_LEAST_WIND_POINTS, _MOST_WIND_POINTS = 5, 17
"""On each component of the wind: one for each m/s of half its range, and the most for a table of
powers, which has corners.  Against direct evaluation of samples of surveys in winds of up to 10 ± 3 m/s
from anywhere: within 0.1 % for momentum theory, 1.2 % (standard deviation 0.5 %) for a table."""
_AIR_AND_MASS_POINTS = 3
"""On payload and temperature, over which the power bends little."""
_LEAST_ROWS, _MOST_ROWS = 64, 1000
"""Samples at once, at least and at most."""
_PRODUCTS = 2**18
"""Of numbers, no more of which OpenBLAS works out in one thread.  A second one goes on waiting for work on a
core of its own: a check in an uncertain wind took up to twice the processor time."""
_CHARGE_POINTS = 5
LOW, HIGH = 0.1, 0.9
_BRAKE = STATE_INDEX[FlightState.BRAKE]
_CLIMBS = {FlightState.TAKEOFF, FlightState.CLIMB}
_DESCENDS = {FlightState.DESCEND, FlightState.LAND}


def kind_of(state: FlightState) -> FlightState:
    """Return the state that stands for all whose power errs alike: climb, cruise or descend."""
    if state in _CLIMBS:
        return FlightState.CLIMB
    return FlightState.DESCEND if state in _DESCENDS else FlightState.CRUISE


_LANDING, _FIRST_STATE = 3, 4
"""Rows of the samples of Student's distribution, after those of time, energy and stops."""
_KINDS = [_FIRST_STATE + STATE_INDEX[kind_of(state)] for state in STATES]


class ModelErrors(Value, eq=False, dict=True):
    """Errors of a model in each scenario; all (samples,), but those of the states."""

    time: FloatArray
    """Relative, of a whole flight. [-]"""
    leg_s: FloatArray
    """Of one leg; of n legs √n times as much. [s]"""
    landing_s: FloatArray | None
    """``None`` where no landing of the vehicle was compared. [s]"""
    energy: FloatArray
    state: FloatArray
    """(states, samples)"""
    stopping: FloatArray
    """Relative, of a stopping distance. [-]"""
    landing_rank: FloatArray
    """Fraction of landings that are sooner found over."""
    wait_rank: FloatArray
    """Fraction of the cases of waits that are not certain before the one that it is."""
    noise: FloatArray
    """Relative, of the noise of the position. [-]"""

    @cached_property
    def stopping_factor(self) -> FloatArray:
        """Stopping distances over those predicted. (samples,) [-]"""
        return np.maximum(1.0 + self.stopping, 0.0)

    @cached_property
    def stopping_factor_p90(self) -> float:
        """Exceeded by one stop of ten. [-]"""
        return _p10_p90(self.stopping_factor)[1]

    def times_s(self, time_s: float, *, legs: int, landings: int) -> FloatArray:
        """Return what flights of a predicted time take, without what the autopilot adds. [s]"""
        sampled_s = time_s * (1.0 + self.time) + math.sqrt(legs) * self.leg_s
        if self.landing_s is not None:
            sampled_s += math.sqrt(landings) * self.landing_s
        return sampled_s

    def wait_delay_s(self, spread_s: FloatArray | None) -> FloatArray:
        """Return how much longer than predicted it is waited where that is not certain. [s]"""
        if spread_s is None:
            return np.zeros_like(self.wait_rank)
        return spread_s[(self.wait_rank * len(spread_s)).astype(np.intp)]

    def landing_delay_s(self, sooner_s: float, later_s: float) -> FloatArray:
        """Return how much later than predicted landings are over: most often as predicted. [s]

        The triangular distribution of the least, the likeliest and the most that is known.
        """
        whole = sooner_s + later_s
        is_sooner = self.landing_rank * whole < sooner_s
        return np.where(
            is_sooner,
            np.sqrt(self.landing_rank * whole * sooner_s) - sooner_s,
            later_s - np.sqrt((1.0 - self.landing_rank) * whole * later_s),
        )

    def energies_j(self, by_state_j: FloatArray) -> FloatArray:
        """Return what flights of predicted energies take, not negative. (..., samples) [J]

        ``by_state_j`` is (..., states).
        """
        # By einsum, which has one thread: see `_PRODUCTS`.
        sampled_j = np.einsum("...s,sn->...n", by_state_j, self.state)
        sampled_j += by_state_j.sum(axis=-1, keepdims=True)
        sampled_j *= 1.0 + self.energy
        return np.asarray(np.maximum(sampled_j, 0.0, out=sampled_j))


@lru_cache(maxsize=2)
def sample_errors(spread: ModelSpread) -> ModelErrors:
    """Return samples of the errors of a model, always the same ones."""
    normal, student, landing_rank, wait_rank, noise = _standard_samples(spread.n_flights)
    of_states = dict(spread.energy_state_fraction)
    landing_s = spread.landing_time_s
    return ModelErrors(
        time=(spread.time_fraction or 0.0) * student[0],
        leg_s=(spread.leg_time_s or 0.0) * normal[_LEG],
        landing_s=None if landing_s is None else landing_s * student[_LANDING],
        energy=(spread.energy_fraction or 0.0) * student[1],
        state=np.array([[of_states.get(state, 0.0)] for state in STATES]) * student[_KINDS],
        stopping=(spread.stopping_distance_fraction or 0.0) * student[2],
        landing_rank=landing_rank,
        wait_rank=wait_rank,
        noise=np.expm1((spread.position_noise_fraction or 0.0) * noise),
    )


def spread_at_noise(
    spread: ModelSpread, vehicle: VehicleModel, noise_m: float | None
) -> ModelSpread:
    """Return the spread of times with another noise of the position than that of the model's flights.

    PX4's time waits for the vehicle in proportion to how far it seems from its trajectory.
    """
    known_m = vehicle.position_noise_m
    if vehicle.reference is not Autopilot.PX4 or not known_m or noise_m in {None, known_m}:
        return spread
    ratio = (noise_m or 0.0) / known_m
    still = REPEATABILITY[Autopilot.PX4]
    left = max(1.0 - ratio**2, 0.0)
    return replace(
        spread,
        **{
            name: math.sqrt((ratio * noisy) ** 2 + left * (without or 0.0) ** 2)
            for name, without in (
                ("time_fraction", still.time_fraction),
                ("leg_time_s", still.leg_s),
                ("landing_time_s", still.landing_s),
            )
            if (noisy := getattr(spread, name)) is not None
        },
    )


_LEVEL = (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
_COVERED_M_S = max(speed_m_s for speed_m_s, _ in STEADY_FLIGHTS["cruise"])
"""Airspeed up to which a spread says how far the energy of level flight may be off."""
_GRID = 8
"""Airspeeds beyond it between which that hardly bends."""


def spread_at_airspeeds(spread: ModelSpread, flight: Flight) -> ModelSpread:
    """Return the spread of energies at the airspeeds of a flight, where they are beyond those it is of.

    Of models that flights have narrowed: at what was not flown the law is what the data sheet had, and
    the drag, which nothing has shown, goes by the cube of the airspeed.
    """
    vehicle, motion = flight.power.vehicle, flight.motion
    if vehicle.provenance.basis is not Basis.REFINED or not is_narrowable(vehicle):
        return spread
    airspeed = flight.power.airspeed_m_s(flight.node_state)
    of_piece = motion.segments.state[motion.piece_segment]
    level = np.isin(of_piece, [STATE_INDEX[one] for one in _LEVEL])
    fastest_m_s = float(airspeed[level].max(initial=0.0))
    if fastest_m_s <= _COVERED_M_S:
        return spread
    grid_m_s = np.linspace(_COVERED_M_S, fastest_m_s, _GRID)
    fractions = level_fractions(vehicle, grid_m_s)
    taken_j = np.maximum(flight.node_power_w, 0.0) * QUADRATURE_WEIGHTS
    taken_j = taken_j[level] * motion.piece_duration_s[level, None]
    total_j = float(taken_j.sum())
    if not total_j > 0.0:
        return spread
    mean = float((taken_j * np.interp(airspeed[level], grid_m_s, fractions)).sum()) / total_j
    more = math.sqrt(max(mean**2 - float(fractions[0]) ** 2, 0.0))
    states = {one.value for one in _LEVEL}
    return replace(
        spread,
        energy_state_fraction=tuple(
            (state, math.hypot(fraction, more) if state in states else fraction)
            for state, fraction in spread.energy_state_fraction
        ),
    )


@lru_cache(maxsize=4)  # a spread is looked through whenever one is made
def spread_in_wind(spread: ModelSpread, speed_m_s: float) -> ModelSpread:
    """Return the spread of energies in a wind: what it adds goes into what all states share."""
    if spread.energy_fraction is None or not spread.energy_fraction_s_m:
        return spread
    fraction = math.hypot(spread.energy_fraction, spread.energy_fraction_s_m * speed_m_s)
    return replace(spread, energy_fraction=fraction, energy_fraction_s_m=None)


class UnknownSamples(Value, eq=False):
    """What is not known, for each scenario; all (samples,), but the errors of the states."""

    wind_east_m_s: FloatArray
    wind_north_m_s: FloatArray
    load_kg: FloatArray
    """Beyond the model's own mass: payload, and what the battery weighs more."""
    temperature_c: FloatArray
    errors: ModelErrors


def sample_unknowns(spread: ModelSpread, setup: Setup, power: SteadyPower) -> UnknownSamples:
    """Return samples of the conditions and of the errors of the model, always the same ones.

    The temperature is spread about that of the power.  A wind sampled below zero blows the other way; a
    payload is not below zero.  The samples of one quantity do not depend on the
    spread of another.
    """
    normal, *_ = _standard_samples(spread.n_flights)
    wind = setup.wind

    def about(mean: float, sd: float, row: int) -> FloatArray:
        return mean + sd * normal[row] if sd else np.array(mean)

    speed_m_s = about(wind.speed_m_s, wind.speed_sd_m_s, 0)
    from_rad = np.radians(about(wind.from_deg, wind.from_sd_deg, 1))
    payload_kg = about(mean_of(setup.payload_kg), sd_of(setup.payload_kg), 2)
    return UnknownSamples(
        wind_east_m_s=_of_all(-speed_m_s * np.sin(from_rad)),
        wind_north_m_s=_of_all(-speed_m_s * np.cos(from_rad)),
        load_kg=_of_all(np.maximum(payload_kg, 0.0) + setup.flown_pack.added_kg),
        temperature_c=_of_all(about(power.home_temperature_c, sd_of(setup.temperature_c), 3)),
        errors=sample_errors(spread_in_wind(spread, math.hypot(wind.speed_m_s, wind.speed_sd_m_s))),
    )


def _of_all(sampled: FloatArray) -> FloatArray:
    """Return a value for each sample, of what all know the same or each its own. (samples,)"""
    return np.broadcast_to(sampled, SAMPLES)


def sample_charge(spread: ModelSpread, setup: Setup) -> FloatArray:
    """Return samples of the state of charge at the start, not below none and not above all. (samples,) [-]"""
    normal, *_ = _standard_samples(spread.n_flights)
    return np.asarray(np.clip(mean_of(setup.charge) + sd_of(setup.charge) * normal[4], 0.0, 1.0))


_LEAST_FREEDOM = 2
"""Of deviations that one flight shows, or none: what is known beforehand counts as one flight beside it
(``planner.vehicle.repeatability``).  With one, half of a battery had a chance of 1 % to be too little. [-]"""
_LEG = 5
"""Row of the samples of the normal distribution, after those of the conditions."""


@lru_cache(maxsize=2)
def _standard_samples(n_flights: int) -> tuple[FloatArray, ...]:
    """Return samples: normal, Student's, twice uniform, and normal again, made once."""
    random = np.random.default_rng(_SEED)
    normal = random.standard_normal((6, SAMPLES))
    freedom = max(n_flights, _LEAST_FREEDOM)
    student = random.standard_t(freedom, (4 + len(STATES), SAMPLES))
    first, second = random.random((2, SAMPLES))
    found = (normal, student, first, second, random.standard_normal(SAMPLES))
    for samples in found:
        samples.setflags(write=False)
    return found


class Weather:
    """The sampled conditions that the power depends on, and the points it is evaluated at."""

    def __init__(self, samples: UnknownSamples, power: SteadyPower) -> None:
        vehicle, mass_kg = power.vehicle, power.vehicle.mass_kg
        self._power = power
        self._axes: dict[str, ChebyshevAxis] = {}
        if vehicle.knows_airspeed:
            bent = isinstance(vehicle.cruise, CruisePower)
            least = _MOST_WIND_POINTS if bent else _LEAST_WIND_POINTS
            for name, sampled in (
                ("east_m_s", samples.wind_east_m_s),
                ("north_m_s", samples.wind_north_m_s),
            ):
                wanted = 2 * int(0.25 * np.ptp(sampled)) + 3
                count = min(max(wanted, least), _MOST_WIND_POINTS)
                self._axes[name] = ChebyshevAxis(sampled, count)
        if vehicle.knows_mass and mass_kg is not None:
            masses_kg = mass_kg + samples.load_kg
            self._axes["mass_kg"] = ChebyshevAxis(masses_kg, _AIR_AND_MASS_POINTS)
        if vehicle.knows_air_density:
            axis = ChebyshevAxis(samples.temperature_c, _AIR_AND_MASS_POINTS)
            self._axes["home_temperature_c"] = axis

    def powers(self) -> Iterator[SteadyPower]:
        """Yield the power in the conditions of each point of the interpolation."""
        return self._powers({name: axis.points for name, axis in self._axes.items()})

    def corners(self) -> Iterator[SteadyPower]:
        """Yield the power in the most different conditions sampled; nothing where all are the same."""
        if all(len(axis.ends) == 1 for axis in self._axes.values()):
            return iter(())
        return self._powers({name: axis.ends for name, axis in self._axes.items()})

    def with_errors(self, at_points_j: FloatArray, samples: UnknownSamples) -> FloatArray:
        """Return the energies of all samples, errors of the model included, not negative. (k, samples) [J]

        ``at_points_j`` are energies by state of k flights at the points of the interpolation.
        (points, k, states) [J]
        """
        errors = samples.errors
        if len(at_points_j) == 1:  # all samples have the conditions of the prediction
            return errors.energies_j(at_points_j[0])
        count, states = at_points_j.shape[1:]
        flat_j = at_points_j.reshape(len(at_points_j), -1)
        energy_j = np.empty((count, SAMPLES))
        at_once = min(max(_PRODUCTS // flat_j.size, _LEAST_ROWS), _MOST_ROWS)
        for first in range(0, SAMPLES, at_once):
            rows = slice(first, first + at_once)
            factor = 1.0 + errors.state[:, rows]
            by_state_j = (self._weights(rows) @ flat_j).reshape(-1, count, states)
            energy_j[:, rows] = np.einsum("nks,sn->kn", by_state_j, factor)
            energy_j[:, rows] *= 1.0 + errors.energy[rows]
        return np.maximum(energy_j, 0.0)

    def _weights(self, rows: slice) -> FloatArray:
        """Return the weight of each point for some samples. (rows, points)"""
        weights = np.ones((len(range(SAMPLES)[rows]), 1))
        for axis in self._axes.values():
            weights = (weights[:, :, None] * axis.weights[rows, None, :]).reshape(len(weights), -1)
        return weights

    def _powers(self, values: Mapping[str, FloatArray]) -> Iterator[SteadyPower]:
        for point in product(*values.values()):
            at, power = dict(zip(values, map(float, point), strict=True)), self._power
            if "east_m_s" in at:
                east, north = at.pop("east_m_s"), at.pop("north_m_s")
                wind = replace(
                    power.wind,
                    speed_m_s=float(np.hypot(east, north)),
                    from_deg=float(np.degrees(np.arctan2(-east, -north))),
                )
                power = replace(power, wind=wind)
            yield replace(power, **at)


class ChebyshevAxis:
    """One sampled quantity: Chebyshev points over its range, and their weights for each sample."""

    def __init__(self, sampled: FloatArray, count: int) -> None:
        low, high = float(sampled.min()), float(sampled.max())
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        if half <= 1e-12 * max(abs(middle), 1.0):  # known exactly, but for rounding
            self.points = self.ends = np.array([middle])
            self.weights = np.broadcast_to(1.0, (sampled.size, 1))
            return
        from numpy.polynomial.chebyshev import chebpts1, chebvander  # for conditions with a spread

        unit = chebpts1(count)
        self.points = middle + half * unit
        self.ends = np.array([low, high])
        of_samples = chebvander((sampled - middle) / half, count - 1)
        of_points = np.linalg.inv(chebvander(unit, count - 1))
        self.weights = np.einsum("sn,np->sp", of_samples, of_points)


class Scenarios(Value, eq=False):
    """What flights of one mission take, a row per sample; ``None`` where it is not known."""

    time_s: FloatArray | None = None
    energy_wh: FloatArray | None = None
    margin_wh: FloatArray | None = None
    """Energy above the reserve after the landing. [Wh]"""
    return_margin_wh: FloatArray | None = None
    """Least energy above the reserve after a return from any stage. [Wh]"""
    stopping_factor: FloatArray | None = None
    """Stopping distances over those predicted. [-]"""
    return_wh: FloatArray | None = None
    """Most energy used by the landing of a return from any stage. [Wh]"""
    time_band_s: tuple[float, float] | None = None
    """What one flight of ten stays below, and one exceeds. [s]"""
    energy_band_wh: tuple[float, float] | None = None
    stopping_factor_p90: float | None = None

    def added_to(
        self,
        flight: Flight,
        totals: Totals,
        battery: BatteryBudget | None,
        return_plan: ReturnPlan | None,
    ) -> tuple[Flight, Totals, BatteryBudget | None, ReturnPlan | None]:
        """Return what is predicted of a flight with what one flight of ten stays below, and one exceeds.

        Of battery and return it is the fraction of the flights that use part of the reserve.
        """
        if self.stopping_factor_p90 is not None:
            flight = flight.with_stops(self.stopping_factor_p90)
        spread: dict[str, float] = {}
        if self.time_band_s is not None:
            spread["time_s_p10"], spread["time_s_p90"] = self.time_band_s
        if self.energy_band_wh is not None:
            low_wh, high_wh = self.energy_band_wh
            spread |= {"energy_wh_p10": low_wh, "energy_wh_p90": high_wh}
            if totals.charge_mah is not None:
                per_wh = totals.charge_mah / totals.energy_wh
                spread |= {"charge_mah_p10": low_wh * per_wh, "charge_mah_p90": high_wh * per_wh}
        reserve_wh = 0.0 if battery is None else battery.reserve_wh
        if battery is not None:
            battery = replace(
                battery,
                below_reserve_probability=_fraction_below(self.margin_wh),
                empty_probability=_fraction_below(self.margin_wh, -reserve_wh),
                empty_factor=self._empty_factor(reserve_wh),
            )
        if return_plan is not None:
            return_plan = replace(
                return_plan,
                below_reserve_probability=_fraction_below(self.return_margin_wh),
                empty_probability=_fraction_below(self.return_margin_wh, -reserve_wh),
            )
        return flight, replace(totals, **spread), battery, return_plan

    def _empty_factor(self, reserve_wh: float) -> float | None:
        """Return how many times as much all may take until too many flights or returns end empty."""
        least = int(MOST_CHANCE_EMPTY * SAMPLES)
        factors = [
            float(np.partition(held_wh / np.maximum(taken_wh, _LEAST_WH), least)[least])
            for taken_wh, margin_wh in (
                (self.energy_wh, self.margin_wh),
                (self.return_wh, self.return_margin_wh),
            )
            if taken_wh is not None and margin_wh is not None
            for held_wh in (taken_wh + margin_wh + reserve_wh,)
        ]
        return min(factors, default=None)


def predict_scenarios(
    returns: Returns,
    setup: Setup,
    *,
    spread: ModelSpread,
    battery: Battery | None = None,
    budget: BatteryBudget | None = None,
    sweep: ReturnSweep | None = None,
) -> Scenarios:
    """Return what many flights of a mission take.

    Energies are ``None`` where the power of the vehicle or the spread of its energy is not known.

    Parameters
    ----------
    returns : Returns
        The flight in mean conditions, and the rules by which it can be broken off.
    setup : Setup
        With the standard deviations of what is not known exactly.
    spread : ModelSpread
        Of the model that flies.
    battery, budget : Battery and BatteryBudget, optional
        What flies, and what it holds in mean conditions.
    sweep : ReturnSweep, optional
        The returns, where they are swept already.
    """
    scenarios = sample_flights(returns, setup, spread=spread, sweep=sweep)
    return against_battery(
        scenarios, returns.flight, setup, spread=spread, battery=battery, budget=budget
    )


def sample_times(flight: Flight, setup: Setup, spread: ModelSpread) -> Scenarios:
    """Return how long many flights of a mission last, and how far their stops get, in whatever air."""
    spread = spread_at_noise(spread, flight.power.vehicle, setup.position_noise_m)
    errors = sample_errors(spread)
    time_s = None
    if spread.time_fraction is not None:
        motion = flight.motion
        legs, landings = motion.leg_count, motion.landing_count
        time_s = errors.times_s(flight.time_s, legs=legs, landings=landings)
        time_s += errors.wait_delay_s(motion.wait_spread_s)
        if setup.position_noise_m in {None, flight.power.vehicle.position_noise_m}:  # not measured
            time_s += errors.noise * motion.noise_delay_s
        if errors.landing_s is None:
            time_s += errors.landing_delay_s(*motion.landing_spread_s)
        time_s = np.maximum(time_s, 0.0)
    stops = spread.stopping_distance_fraction is not None
    return Scenarios(
        time_s=time_s,
        stopping_factor=errors.stopping_factor if stops else None,
        time_band_s=None if time_s is None else _p10_p90(time_s),
        stopping_factor_p90=errors.stopping_factor_p90 if stops else None,
    )


def sample_flights(
    returns: Returns,
    setup: Setup,
    *,
    spread: ModelSpread,
    sweep: ReturnSweep | None = None,
    timed: Scenarios | None = None,
) -> Scenarios:
    """Return what many flights of a mission take, whatever they fly on; as for `predict_scenarios`.

    ``timed`` is what `sample_times` has of them, where that is known.
    """
    power = returns.flight.power
    timed = timed or sample_times(returns.flight, setup, spread)
    if not power.vehicle.is_power_known or spread.energy_fraction is None:
        return timed
    samples = sample_unknowns(spread, setup, power)
    weather = Weather(samples, power)
    sweep = sweep or sweep_returns(returns)
    tightest = None if sweep is None else _with_corners(returns, sweep, weather)
    at_points = _energies_j(returns, tightest, weather.powers())
    energy_wh = wh_from_j(weather.with_errors(at_points, samples))
    energy_wh[0] += _waiting_wh(returns.flight, samples)
    return replace(
        timed,
        energy_wh=energy_wh[0],
        energy_band_wh=_p10_p90(energy_wh[0]),
        return_wh=energy_wh[1:].max(axis=0) if tightest else None,
    )


def against_battery(
    scenarios: Scenarios,
    flight: Flight,
    setup: Setup,
    *,
    spread: ModelSpread,
    battery: Battery | None,
    budget: BatteryBudget | None,
) -> Scenarios:
    """Return what flights take with what a battery has left of it; as for `predict_scenarios`."""
    energy_wh, return_wh = scenarios.energy_wh, scenarios.return_wh
    if budget is None or battery is None or energy_wh is None:
        return scenarios
    usable_wh: FloatArray | float = budget.usable_wh
    if sd_of(setup.charge):
        charge = sample_charge(spread, setup)
        usable_wh = _usable_wh(flight, battery, budget, charge, setup)
    above_wh = usable_wh - budget.reserve_wh
    return replace(
        scenarios,
        margin_wh=above_wh - energy_wh,
        return_margin_wh=None if return_wh is None else above_wh - return_wh,
    )


def predict_energy_band(
    returns: Returns, setup: Setup, segments: IntArray, *, spread: ModelSpread
) -> tuple[FloatArray, FloatArray] | None:
    """Return the energy that one flight of ten stays below, and one exceeds, at the ends of segments.

    By the samples of `predict_scenarios`: at the end of the last segment it is the totals'.  ``None``
    where the power of the vehicle or the spread of its energy is not known.  Both (n,) [Wh]
    """
    flight = returns.flight
    power = flight.power
    if not power.vehicle.is_power_known or spread.energy_fraction is None:
        return None
    samples = sample_unknowns(spread, setup, power)
    weather = Weather(samples, power)
    powers = tuple(weather.powers())
    used_j = np.stack([used[segments + 1] for used in _used_by_state_j(flight, powers)])
    energy_wh = wh_from_j(weather.with_errors(used_j, samples))
    energy_wh[segments >= flight.motion.wait_segment] += _waiting_wh(flight, samples)
    low_wh, high_wh = np.quantile(energy_wh, (LOW, HIGH), axis=1)
    return low_wh, high_wh


def _waiting_wh(flight: Flight, samples: UnknownSamples) -> FloatArray:
    """Return what waits that are not certain take beyond those predicted, in a hover. (samples,) [Wh]"""
    spread_s = flight.motion.wait_spread_s
    if spread_s is None:
        return np.zeros(SAMPLES)
    segments = flight.motion.segments
    hovers = segments.state == STATE_INDEX[FlightState.HOVER]
    hovers = hovers if hovers.any() else np.ones_like(hovers)
    hover_w = flight.segment_energy_j[hovers].sum() / segments.duration_s[hovers].sum()
    return wh_from_j(hover_w * samples.errors.wait_delay_s(spread_s))


def tightest_rows(sweep: ReturnSweep, setup: Setup) -> ReturnSweep:
    """Return the rows that `sample_flights` looks at: where conditions are known, those tightest in them."""
    return sweep.few_tightest if _is_known(setup) else sweep


def _is_known(setup: Setup) -> bool:
    """Return whether the conditions that the power depends on are known exactly."""
    wind, given = setup.wind, (setup.payload_kg, setup.temperature_c)
    return not (wind.speed_sd_m_s or wind.from_sd_deg or any(map(sd_of, given)))


def _with_corners(returns: Returns, sweep: ReturnSweep, weather: Weather) -> ReturnSweep:
    """Return the rows where the return is tightest, in mean and in extreme conditions."""
    corners = tuple(weather.corners())
    if not corners:
        return sweep.few_tightest
    rows = set(sweep.few_tightest_rows.tolist())
    sum_j = _energies_j(returns, sweep, corners)[:, 1:].sum(axis=-1)
    rows |= set(sum_j.argmax(axis=1).tolist())
    return sweep.select(np.array(sorted(rows)))


def _energies_j(
    returns: Returns, sweep: ReturnSweep | None, powers: Iterable[SteadyPower]
) -> FloatArray:
    """Return energies by state in several conditions: of the flight, and of the returns of a sweep.

    First the whole flight, then for each row the flight up to there and the return from there.
    (conditions, 1 + rows, states) [J]
    """
    powers, flight = tuple(powers), returns.flight
    count = 0 if sweep is None else len(sweep.segment)
    energies_j = np.empty((len(powers), 1 + count, len(STATES)))
    for row, used_j in zip(energies_j, _used_by_state_j(flight, powers), strict=True):
        row[0] = used_j[-1]
        if sweep is not None:
            before_j, after_j = used_j[sweep.segment], used_j[sweep.segment + 1]
            row[1:] = before_j + sweep.fraction[:, None] * (after_j - before_j)
    if sweep is not None:
        energies_j[:, 1:, _BRAKE] += j_from_wh(sweep.stop_wh)
        flown: Iterable[FloatArray] = (sweep.after_stop_j,)
        if len(powers) > 1:  # else all samples have the conditions of the prediction
            points = returns.points(sweep.segment, sweep.fraction)
            _, flown = returns.fly_by_state(
                points.stop_m, points.stage, sweep.destination, powers=powers
            )
        for row, return_j in zip(energies_j, flown, strict=True):
            row[1:] += return_j
    return energies_j


def _used_by_state_j(flight: Flight, powers: tuple[SteadyPower, ...]) -> Iterator[FloatArray]:
    """Yield the energies of a flight by state in several conditions, before each segment and at last.

    (segments + 1, states) [J]
    """
    states = flight.motion.segments.state
    flown: Iterable[FloatArray] = (flight.segment_energy_j,)
    if len(powers) > 1:  # else all samples have the conditions of the prediction
        flown = segment_energies_j(flight.motion, flight.transients, powers)
    for own_j in flown:
        used_j = np.zeros((len(states) + 1, len(STATES)))
        used_j[np.arange(1, len(states) + 1), states] = own_j
        np.cumsum(used_j, axis=0, out=used_j)
        yield used_j


def _usable_wh(
    flight: Flight, battery: Battery, budget: BatteryBudget, sampled: FloatArray, setup: Setup
) -> FloatArray | float:
    """Return the energy in the battery at the start for sampled states of charge. (samples,) [Wh]"""
    axis = ChebyshevAxis(sampled, _CHARGE_POINTS)
    if len(axis.points) == 1:
        return budget.usable_wh
    temperature_c = battery_temperature_c(setup, flight)
    usable_wh = budget.capacity_wh * axis.points
    packs = [
        ChargedPack(battery=battery, charge=charge, temperature_c=temperature_c)
        for charge in axis.points.tolist()
    ]
    for row, discharge in enumerate(predict_discharges(flight, packs)):
        if discharge is not None:
            usable_wh[row] = discharge.usable_wh
    return np.asarray(axis.weights @ usable_wh)


def _p10_p90(values: FloatArray) -> tuple[float, float]:
    # Of so many samples what `np.quantile` does besides is a fifth of it.
    place = np.array((LOW, HIGH)) * (len(values) - 1)
    below = place.astype(np.intp)
    parted = np.partition(values, (*below, *(below + 1)))
    found = parted[below] + (place - below) * (parted[below + 1] - parted[below])
    return float(found[0]), float(found[1])


def _fraction_below(margin_wh: FloatArray | None, limit_wh: float = 0.0) -> float | None:
    return None if margin_wh is None else float(np.count_nonzero(margin_wh < limit_wh) / SAMPLES)
