"""The drawn conditions that power depends on, and the interpolation between a few of them."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np
from numpy.polynomial.chebyshev import chebpts1, chebvander

from planner.flight.draws import DRAWS
from planner.vehicle.power import CruisePower

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.flight.draws import Draws
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.power import SteadyPower
    from planner.physics.wind import Wind

_LEAST_WIND_POINTS, _MOST_WIND_POINTS = 5, 17
"""On each component of the wind: one for each m/s of half its range, and the most for a table of
powers, which has corners.  Against direct evaluation of draws of surveys in winds of up to 10 ± 3 m/s
from anywhere: within 0.1 % for momentum theory, 1.2 % (standard deviation 0.5 %) for a table."""
_AIR_AND_MASS_POINTS = 3
"""On payload and temperature, over which the power bends little."""
_ROWS_AT_ONCE = 1000


class Weather:
    """The drawn conditions that the power depends on, and the points it is evaluated at."""

    def __init__(self, draws: Draws, power: SteadyPower) -> None:
        vehicle, mass_kg = power.vehicle, power.vehicle.mass_kg
        self._power = power
        self._axes: dict[str, ChebyshevAxis] = {}
        if vehicle.knows_airspeed:
            bent = isinstance(vehicle.cruise, CruisePower)
            least = _MOST_WIND_POINTS if bent else _LEAST_WIND_POINTS
            self._axes["east_m_s"] = _wind_axis(draws.wind_east_m_s, least)
            self._axes["north_m_s"] = _wind_axis(draws.wind_north_m_s, least)
        if vehicle.knows_mass and mass_kg is not None:
            self._axes["mass_kg"] = ChebyshevAxis(mass_kg + draws.payload_kg, _AIR_AND_MASS_POINTS)
        if vehicle.knows_air_density:
            self._axes["home_temperature_c"] = ChebyshevAxis(
                draws.temperature_c, _AIR_AND_MASS_POINTS
            )

    def powers(self) -> Iterator[SteadyPower]:
        """Yield the power in the conditions of each point of the interpolation."""
        return self._powers({name: axis.points for name, axis in self._axes.items()})

    def corners(self) -> Iterator[SteadyPower]:
        """Yield the power in the most different conditions drawn; nothing where all are the same."""
        if all(len(axis.ends) == 1 for axis in self._axes.values()):
            return iter(())
        return self._powers({name: axis.ends for name, axis in self._axes.items()})

    def with_errors(self, at_points_j: FloatArray, draws: Draws) -> FloatArray:
        """Return the energies of all draws, errors of the model included.

        Parameters
        ----------
        at_points_j : ndarray
            Energies by state of k flights at the points of the interpolation.
            (points, k, states) [J]
        draws : Draws
            Errors of the model.

        Returns
        -------
        ndarray
            Not negative. (draws, k) [J]
        """
        if len(at_points_j) == 1:  # all draws have the conditions of the prediction
            mean_j = at_points_j[0]
            drawn_j = mean_j.sum(axis=1) + draws.state_error @ mean_j.T
            return np.asarray(np.maximum(drawn_j * (1.0 + draws.energy_error[:, None]), 0.0))
        count, states = at_points_j.shape[1:]
        flat_j = at_points_j.reshape(len(at_points_j), -1)
        energy_j = np.empty((DRAWS, count))
        for first in range(0, DRAWS, _ROWS_AT_ONCE):
            rows = slice(first, first + _ROWS_AT_ONCE)
            factor = 1.0 + draws.state_error[rows]
            by_state_j = (self._weights(rows) @ flat_j).reshape(-1, count, states)
            energy_j[rows] = np.einsum("nks,ns->nk", by_state_j, factor)
            energy_j[rows] *= 1.0 + draws.energy_error[rows, None]
        return np.maximum(energy_j, 0.0)

    def _weights(self, rows: slice) -> FloatArray:
        """Return the weight of each point for some draws. (rows, points)"""
        weights = np.ones((len(range(DRAWS)[rows]), 1))
        for axis in self._axes.values():
            weights = (weights[:, :, None] * axis.weights[rows, None, :]).reshape(len(weights), -1)
        return weights

    def _powers(self, values: Mapping[str, FloatArray]) -> Iterator[SteadyPower]:
        for point in product(*values.values()):
            at, power = dict(zip(values, map(float, point), strict=True)), self._power
            if "east_m_s" in at:
                power = replace(power, wind=_wind(power.wind, at["east_m_s"], at["north_m_s"]))
            yield replace(
                power,
                mass_kg=at.get("mass_kg", power.mass_kg),
                home_temperature_c=at.get("home_temperature_c", power.home_temperature_c),
            )


class ChebyshevAxis:
    """One drawn quantity: Chebyshev points over its range, and their weights for each draw."""

    def __init__(self, drawn: FloatArray, count: int) -> None:
        low, high = float(drawn.min()), float(drawn.max())
        middle, half = 0.5 * (low + high), 0.5 * (high - low)
        if half <= 1e-12 * max(abs(middle), 1.0):  # known exactly, but for rounding
            self.points = self.ends = np.array([middle])
            self.weights = np.ones((drawn.size, 1))
            return
        unit = chebpts1(count)
        self.points = middle + half * unit
        self.ends = np.array([low, high])
        self.weights = chebvander((drawn - middle) / half, count - 1) @ np.linalg.inv(
            chebvander(unit, count - 1)
        )


def _wind_axis(drawn_m_s: FloatArray, least: int) -> ChebyshevAxis:
    wanted = 2 * int(0.25 * np.ptp(drawn_m_s)) + 3
    return ChebyshevAxis(drawn_m_s, min(max(wanted, least), _MOST_WIND_POINTS))


def _wind(like: Wind, east_m_s: float, north_m_s: float) -> Wind:
    """Return a wind of these components, with the profile of another."""
    return replace(
        like,
        speed_m_s=float(np.hypot(east_m_s, north_m_s)),
        from_deg=float(np.degrees(np.arctan2(-east_m_s, -north_m_s))),
    )
