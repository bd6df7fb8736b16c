r"""The spread of a prediction: many flights of one mission, as draws of what is not known.

Drawn are the conditions (wind, payload, temperature, charge) and the errors of the model as the
``[spread]`` of its file has them.  With the energy :math:`E_s` of each state,

.. math:: E = (1 + \varepsilon) \sum_s (1 + \eta_s)\, E_s(w, m, T), \qquad t = (1 + \tau)\, t_0,

ε common to a flight, η of each state, τ of the time.  They come from n flights, so each is its
standard deviation times a draw of Student's t with n degrees of freedom: with few flights the
standard deviation is itself little known (Student, Biometrika 6 (1908) 1).

Approximations:

* The motion is that of the mean wind and is not flown again: a draw changes the power along it.
* Over the box of the drawn conditions the energy is interpolated by Chebyshev polynomials in each
  of them (L. N. Trefethen, Approximation Theory and Approximation Practice, 2013, chapters 2 and 3),
  from exact evaluations at a fixed number of points.
* Ways home are judged from the points where they are tightest in mean and in extreme conditions, to
  where the vehicle goes in mean ones; the stop before the way home is that of mean conditions.
* Charge follows energy, at the mean voltage of the prediction; the energy a battery holds is taken
  at the mean power and temperature.

The draws are always the same: what differs between two predictions is never chance.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.discharge import predict_discharge
from planner.flight.draws import make_draws
from planner.flight.homeward import by_item_and_state_j, make_homeward
from planner.flight.prediction import make_flight, segment_energies_j
from planner.flight.return_search import ReturnSearch
from planner.flight.state import STATE_INDEX, STATES, FlightState
from planner.flight.weather import ChebyshevAxis, Weather
from planner.frozen import frozen
from planner.units import j_from_wh, wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.flight.budget import BatteryBudget, ReturnBudget, Totals
    from planner.flight.conditions import Conditions
    from planner.flight.homeward import Homeward, Points
    from planner.flight.motion.kinematics import FloatArray, IntArray
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Flight
    from planner.vehicle.battery import Battery
    from planner.vehicle.model import ModelSpread

_CHARGE_POINTS = 5
_TIGHTEST = 8
"""Points whose way home is looked at besides those tightest at the corners of the conditions."""
_LOW, _HIGH = 0.1, 0.9
_BRAKE = STATE_INDEX[FlightState.BRAKE]


@frozen(eq=False)
class Scenarios:
    """What flights of one mission take, a row per draw; ``None`` where it is not known."""

    time_s: FloatArray | None = None
    energy_wh: FloatArray | None = None
    margin_wh: FloatArray | None = None
    """Energy above the reserve after the landing. [Wh]"""
    return_margin_wh: FloatArray | None = None
    """Least energy above the reserve after going home from any stage. [Wh]"""
    stopping_factor: FloatArray | None = None
    """Stopping distances over those predicted. [-]"""

    def _flight(self, flight: Flight) -> Flight:
        """Return the flight with the stopping distances that one of ten exceeds."""
        if self.stopping_factor is None:
            return flight
        return replace(flight, stopping_factor_p90=_p10_p90(self.stopping_factor)[1])

    def added_to(
        self,
        flight: Flight,
        totals: Totals,
        battery: BatteryBudget | None,
        way_home: ReturnBudget | None,
    ) -> tuple[Flight, Totals, BatteryBudget | None, ReturnBudget | None]:
        """Return what is predicted of a flight together with its spread."""
        return (
            self._flight(flight),
            self._totals(totals),
            None if battery is None else self._battery(battery),
            None if way_home is None else self._way_home(way_home),
        )

    def _totals(self, totals: Totals) -> Totals:
        """Return totals with what one flight of ten stays below, and one exceeds."""
        if self.time_s is not None:
            low_s, high_s = _p10_p90(self.time_s)
            totals = replace(totals, time_s_p10=low_s, time_s_p90=high_s)
        if self.energy_wh is not None:
            low_wh, high_wh = _p10_p90(self.energy_wh)
            totals = replace(totals, energy_wh_p10=low_wh, energy_wh_p90=high_wh)
            if totals.charge_mah is not None:
                mah_per_wh = totals.charge_mah / totals.energy_wh
                totals = replace(
                    totals, charge_mah_p10=low_wh * mah_per_wh, charge_mah_p90=high_wh * mah_per_wh
                )
        return totals

    def _battery(self, battery: BatteryBudget) -> BatteryBudget:
        """Return a budget with the share of the flights that land below the reserve."""
        return replace(battery, below_reserve_probability=_share_below(self.margin_wh))

    def _way_home(self, way_home: ReturnBudget) -> ReturnBudget:
        """Return a way home with the share of the flights in which some way home is too long."""
        return replace(way_home, below_reserve_probability=_share_below(self.return_margin_wh))


def predict_scenarios(
    homeward: Homeward,
    conditions: Conditions,
    *,
    spread: ModelSpread,
    charge: tuple[float, float] = (1.0, 0.0),
    battery: Battery | None = None,
    budget: BatteryBudget | None = None,
    search: ReturnSearch | None = None,
) -> Scenarios:
    """Return what many flights of a mission take.

    Parameters
    ----------
    homeward : Homeward
        The flight in mean conditions, and the rules by which it can be broken off.
    conditions : Conditions
        With their standard deviations.
    spread : ModelSpread
        Of the model that flies.
    charge : tuple of float
        Mean and standard deviation of the state of charge at the start. [-]
    battery : Battery, optional
        The battery that flies.
    budget : BatteryBudget, optional
        What it holds in mean conditions.
    search : ReturnSearch, optional
        The ways home as far as they are looked at already.

    Returns
    -------
    Scenarios
        Its energies are ``None`` where the power of the vehicle or the spread of its energy is not
        known.
    """
    flight = homeward.flight
    power = flight.power
    draws = make_draws(spread, conditions, power, charge=charge)
    timed = Scenarios(
        time_s=(
            None
            if spread.time_fraction is None
            else np.maximum(flight.time_s * (1.0 + draws.time_error), 0.0)
        ),
        stopping_factor=(
            None
            if spread.stopping_distance_fraction is None
            else np.maximum(1.0 + draws.stopping_error, 0.0)
        ),
    )
    if not power.vehicle.is_power_known or spread.energy_fraction is None:
        return timed
    weather = Weather(draws, power)
    points, home_j = _tightest_points(search or ReturnSearch(homeward), weather)
    at_points = _energies_j(homeward, points, home_j, weather.powers())
    energy_wh = wh_from_j(weather.with_errors(at_points, draws))
    drawn = replace(timed, energy_wh=energy_wh[:, 0])
    if budget is None or battery is None:
        return drawn
    above_wh = _usable_wh(flight, battery, budget, draws.charge, conditions) - budget.reserve_wh
    return replace(
        drawn,
        margin_wh=above_wh - energy_wh[:, 0],
        return_margin_wh=above_wh - energy_wh[:, 1:].max(axis=1) if points else None,
    )


def predict_energy_band(
    homeward: Homeward,
    conditions: Conditions,
    segments: IntArray,
    *,
    spread: ModelSpread,
    charge: tuple[float, float] = (1.0, 0.0),
) -> tuple[FloatArray, FloatArray] | None:
    """Return the energy that one flight of ten stays below, and one exceeds, along a flight.

    Parameters
    ----------
    homeward : Homeward
        The flight in mean conditions.
    conditions : Conditions
        With their standard deviations.
    segments : ndarray of int
        Segments at whose ends it is asked for. (n,)
    spread : ModelSpread
        Of the model that flies.
    charge : tuple of float
        Mean and standard deviation of the state of charge at the start. [-]

    Returns
    -------
    tuple of ndarray or None
        By the draws of `predict_scenarios`, so that at the end of the last segment it is the totals'.
        ``None`` where the power of the vehicle or the spread of its energy is not known.
        Both (n,) [Wh]
    """
    flight = homeward.flight
    power = flight.power
    if not power.vehicle.is_power_known or spread.energy_fraction is None:
        return None
    draws = make_draws(spread, conditions, power, charge=charge)
    weather = Weather(draws, power)
    powers = tuple(weather.powers())
    used_j = np.stack([used[segments + 1] for used in _used_by_state_j(flight, powers)])
    energy_wh = wh_from_j(weather.with_errors(used_j, draws))
    low_wh, high_wh = np.quantile(energy_wh, (_LOW, _HIGH), axis=0)
    return low_wh, high_wh


def _tightest_points(
    searched: ReturnSearch, weather: Weather
) -> tuple[Points | None, FloatArray | None]:
    """Return where the way home may be tightest, in mean and extreme conditions.

    And where there are none but mean ones, the energies home by state. (points, states) [J]
    """
    homeward = searched.homeward
    flight = homeward.flight
    places: set[tuple[int, float]] = set()
    home_j: FloatArray | None = None
    there = (make_flight(flight.motion, flight.transients, power) for power in weather.corners())
    elsewhere = (
        ReturnSearch(make_homeward(homeward.route, flown, homeward.pilot, homeward.destinations))
        for flown in there
    )
    for search in (searched, *elsewhere):
        if search.tightest() is None or search.nodes is None:
            return None, None
        most = 1 if places else _TIGHTEST
        rows = np.sort(np.argsort(-search.nodes.sum_wh, kind="stable")[:most])  # in flown order
        home_j = None if places else search.nodes.home_j[rows]
        places |= {search.nodes.at(row) for row in rows.tolist()}
    segment, share = zip(*sorted(places), strict=True)
    return homeward.points(np.array(segment, dtype=np.intp), np.array(share)), home_j


def _energies_j(
    homeward: Homeward,
    points: Points | None,
    home_j: FloatArray | None,
    powers: Iterable[SteadyPower],
) -> FloatArray:
    """Return energies by state in several conditions: of the flight, and home from each point.

    Where all draws have the conditions of the prediction, the energies home are those given.

    Returns
    -------
    ndarray
        First the whole flight, then for each point the flight up to it and home from there.
        (conditions, 1 + points, states) [J]
    """
    powers, flight = tuple(powers), homeward.flight
    count = 0 if points is None else len(points.segment)
    energies_j = np.empty((len(powers), 1 + count, len(STATES)))
    for row, used_j in zip(energies_j, _used_by_state_j(flight, powers), strict=True):
        row[0] = used_j[-1]
        if points is not None:
            before_j, after_j = used_j[points.segment], used_j[points.segment + 1]
            row[1:] = before_j + points.share[:, None] * (after_j - before_j)
    if points is not None:
        energies_j[:, 1:, _BRAKE] += j_from_wh(points.stop_wh)
        ways = _home_by_state_j(homeward, points, powers) if home_j is None else (home_j,)
        for row, way_j in zip(energies_j, ways, strict=True):
            row[1:] += way_j
    return energies_j


def _used_by_state_j(flight: Flight, powers: tuple[SteadyPower, ...]) -> Iterator[FloatArray]:
    """Yield the energies of a flight by state in several conditions, before each segment and at last.

    (segments + 1, states) [J]
    """
    states = flight.motion.segments.state
    flown: Iterable[FloatArray] = (flight.segment_energy_j,)
    if len(powers) > 1:  # else all draws have the conditions of the prediction
        flown = segment_energies_j(flight.motion, flight.transients, powers)
    for own_j in flown:
        used_j = np.zeros((len(states) + 1, len(STATES)))
        used_j[np.arange(1, len(states) + 1), states] = own_j
        np.cumsum(used_j, axis=0, out=used_j)
        yield used_j


def _home_by_state_j(
    homeward: Homeward, points: Points, powers: Iterable[SteadyPower]
) -> Iterator[FloatArray]:
    """Yield the energies home from points by state in several conditions. (points, states) [J]"""
    targets = homeward.destinations.targets(points.stage, homeward.chosen(points), points.stop_m)
    motion, transients = homeward.pilot.fly_home(points.stop_m, targets, homeward.route)
    for own_j in segment_energies_j(motion, transients, powers):
        yield by_item_and_state_j(motion, own_j, len(points.segment))


def _usable_wh(
    flight: Flight,
    battery: Battery,
    budget: BatteryBudget,
    drawn: FloatArray,
    conditions: Conditions,
) -> FloatArray | float:
    """Return the energy in the battery at the start for drawn states of charge. (draws,) [Wh]"""
    axis = ChebyshevAxis(drawn, _CHARGE_POINTS)
    if len(axis.points) == 1:
        return budget.usable_wh
    temperature_c = conditions.battery_temperature_c
    if temperature_c is None:
        temperature_c = flight.power.home_temperature_c
    usable_wh: list[float] = []
    for point in axis.points:
        discharge = predict_discharge(
            flight, battery, charge=float(point), temperature_c=temperature_c
        )
        usable_wh.append(
            budget.capacity_wh * float(point) if discharge is None else discharge.usable_wh
        )
    drawn_wh: FloatArray = axis.weights @ np.array(usable_wh)
    return drawn_wh


def _p10_p90(values: FloatArray) -> tuple[float, float]:
    low, high = np.quantile(values, (_LOW, _HIGH))
    return float(low), float(high)


def _share_below(margin_wh: FloatArray | None) -> float | None:
    return None if margin_wh is None else float(np.mean(margin_wh < 0.0))
