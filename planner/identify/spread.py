r"""What fits leave open: draws of models, and how far whole flights were from predictions.

For flights f the model was not fitted to, with the relative error of the energy of state s

.. math:: r_{fs} = \varepsilon_f + \eta_{fs},

the part common to a flight and that of each state are told apart by moments: the deviation of a state
from its whole flight holds no common part.  Errors count from zero, so that a bias is part of the
spread: the next flight meets it as well.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.frozen import frozen
from planner.vehicle.model import ModelSpread
from planner.vehicle.spread_schema import STATE_NAMES

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    import numpy.typing as npt

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]


@frozen
class FlownAndPredicted:
    """One flight and its prediction by a model that was not fitted to it."""

    flown_time_s: float
    predicted_time_s: float
    flown_energy_j: Mapping[str, float]
    """By the name of the state; empty where the power was not recorded. [J]"""
    predicted_energy_j: Mapping[str, float]
    """Of the same states. [J]"""
    flown_stops_m: Sequence[float] = ()
    """Stopping distances, one by one. [m]"""
    predicted_stops_m: Sequence[float] = ()


def fit_spread(flights: Sequence[FlownAndPredicted], *, source: str) -> ModelSpread:
    """Return how far flights were from their predictions.

    Parameters
    ----------
    flights : sequence of FlownAndPredicted
        Flights that the model was not fitted to.
    source : str
        Which flights, and how they were compared, for the model file.

    Returns
    -------
    ModelSpread
        Standard deviations about zero, rounded up to four decimals; ``None`` for what
        no flight tells.

    Raises
    ------
    IdentificationError
        If there is no flight, or nothing is predicted of one.
    """
    if not flights or any(flight.predicted_time_s <= 0.0 for flight in flights):
        msg = "the spread of a model needs flights and their predictions"
        raise IdentificationError(msg)
    common, states = _energy_fractions([flight for flight in flights if flight.flown_energy_j])
    return ModelSpread(
        n_flights=len(flights),
        source=source,
        time_fraction=_root_mean_square(
            flight.flown_time_s / flight.predicted_time_s - 1.0 for flight in flights
        ),
        energy_fraction=common,
        energy_state_fraction=states,
        stopping_distance_fraction=_root_mean_square(
            flown / predicted - 1.0
            for flight in flights
            for flown, predicted in zip(flight.flown_stops_m, flight.predicted_stops_m, strict=True)
            if predicted > 0.0
        ),
    )


def _energy_fractions(
    flights: Sequence[FlownAndPredicted],
) -> tuple[float | None, tuple[tuple[str, float], ...]]:
    """Return the deviation that the states of a flight share, and that of each state by itself."""
    from scipy.optimize import nnls

    if not flights:
        return None, ()
    predicted = _by_state(flight.predicted_energy_j for flight in flights)
    flown = _by_state(flight.flown_energy_j for flight in flights)
    share = predicted / predicted.sum(axis=1, keepdims=True)
    whole = flown.sum(axis=1) / predicted.sum(axis=1) - 1.0
    # (r_s - r)² = (1 - w_s)² σ_s² + Σ_k≠s w_k² σ_k², for each state of each flight that has it
    flight, state = np.nonzero(share > 0.0)
    deviation = flown[flight, state] / predicted[flight, state] - 1.0 - whole[flight]
    coefficients = np.square(share[flight])
    coefficients[np.arange(state.size), state] = np.square(1.0 - share[flight, state])
    # a state of little energy is little known and matters little: weighed by what it is of a flight
    weight = share[flight, state]
    variances, _ = nnls(weight[:, None] * coefficients, weight * np.square(deviation))
    of_states = np.square(share) @ variances
    common = float(np.mean(np.square(whole) - of_states))
    return _rounded_up(np.sqrt(max(common, 0.0))), tuple(
        (name, _rounded_up(np.sqrt(variance)))
        for name, variance, seen in zip(STATE_NAMES, variances, share.any(axis=0), strict=True)
        if seen
    )


def _by_state(energies_j: Iterable[Mapping[str, float]]) -> FloatArray:
    """Return energies by state, (flights, states). [J]"""
    return np.array([[one.get(name, 0.0) for name in STATE_NAMES] for one in energies_j])


def _root_mean_square(fractions: Iterable[float]) -> float | None:
    values = np.array(list(fractions))
    return _rounded_up(np.sqrt(np.mean(np.square(values)))) if values.size else None


def _rounded_up(fraction: float) -> float:
    return float(np.ceil(1e4 * fraction - 1e-6) / 1e4)
