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
from planner.physics.transfer_function import TransferFunctionStack
from planner.vehicle.model import ModelSpread
from planner.vehicle.spread_schema import STATE_NAMES

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping, Sequence

    import numpy.typing as npt

    from planner.identify.hover import AltitudeLawFit
    from planner.identify.response_fit import ResponseFit

    FloatArray = npt.NDArray[np.float64]
    BoolArray = npt.NDArray[np.bool_]

_LEAST_VALID = 0.05
"""Share of valid draws below which a covariance describes no model. [-]"""


@frozen(eq=False)
class ResponseSpread:
    """Models that the manoeuvres are consistent with."""

    systems: TransferFunctionStack
    """Of batch shape (draws,), each stable and with a delay that is not negative."""
    valid_share: float
    """Share of the draws that were such models; the others were drawn again. [-]"""


def draw_responses(fit: ResponseFit, count: int, generator: np.random.Generator) -> ResponseSpread:
    """Draw models from the covariance of a fit.

    Parameters
    ----------
    fit : ResponseFit
        The fit.
    count : int
        Number of models.
    generator : numpy.random.Generator
        Source of chance.

    Returns
    -------
    ResponseSpread
        The models as one stack.

    Raises
    ------
    IdentificationError
        If hardly any draw is a stable model: the fit is too uncertain for a spread.
    """
    structure = fit.structure
    poles = slice(structure.numerator_size, -1)

    def is_valid(coefficients: FloatArray) -> BoolArray:
        denominators = np.insert(coefficients[:, poles], 0, 1.0, axis=1)
        return _is_hurwitz(denominators) & (coefficients[:, -1] >= 0.0)

    drawn, share = _draw(fit.coefficients, fit.covariance, count, generator, is_valid)
    return ResponseSpread(
        systems=TransferFunctionStack(
            numerators=drawn[:, : structure.numerator_size],
            denominators=np.insert(drawn[:, poles], 0, 1.0, axis=1),
            delay_s=drawn[:, -1],
        ),
        valid_share=share,
    )


def draw_altitude_laws(
    fit: AltitudeLawFit, count: int, generator: np.random.Generator
) -> FloatArray:
    """Draw coefficients K and exponents z of hover laws.

    Parameters
    ----------
    fit : AltitudeLawFit
        The fit.
    count : int
        Number of laws.
    generator : numpy.random.Generator
        Source of chance.

    Returns
    -------
    ndarray, shape (count, 2)
        K and z of each. [W, -]

    Raises
    ------
    IdentificationError
        If hardly any draw has a positive power.
    """
    mean = np.array([fit.law.coefficient_w, fit.law.exponent])
    laws, _ = _draw(mean, fit.covariance, count, generator, lambda drawn: drawn[:, 0] > 0.0)
    return laws


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


def _draw(
    mean: FloatArray,
    covariance: FloatArray,
    count: int,
    generator: np.random.Generator,
    is_valid: Callable[[FloatArray], BoolArray],
) -> tuple[FloatArray, float]:
    """Draws from a normal distribution that are valid, and their share of all draws."""
    # scaled, because coefficients differ by many powers of ten
    scale = np.sqrt(np.diagonal(covariance))
    scale = np.where(scale > 0.0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(scale, scale))
    root = scale[:, None] * vectors * np.sqrt(np.maximum(values, 0.0))
    kept: list[FloatArray] = []
    valid = tried = 0
    while valid < count:
        drawn = mean + generator.standard_normal((count, mean.size)) @ root.T
        good = drawn[is_valid(drawn)]
        kept.append(good)
        valid += good.shape[0]
        tried += count
        if valid < _LEAST_VALID * tried:
            msg = "the fit is too uncertain to draw models from it: fly more manoeuvres"
            raise IdentificationError(msg)
    return np.concatenate(kept)[:count], valid / tried


def _is_hurwitz(denominators: FloatArray) -> BoolArray:
    """Whether all roots of monic polynomials lie left of the imaginary axis, shape (count,)."""
    positive: BoolArray = np.all(denominators > 0.0, axis=1)
    if denominators.shape[1] <= 3:
        return positive
    companions = np.zeros((denominators.shape[0], *[denominators.shape[1] - 1] * 2))
    companions[:, 0] = -denominators[:, 1:]
    rows = np.arange(1, companions.shape[1])
    companions[:, rows, rows - 1] = 1.0
    stable: BoolArray = np.linalg.eigvals(companions).real.max(axis=1) < 0.0
    return positive & stable
