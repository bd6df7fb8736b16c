"""Whether legs of different kinds want variances of their own; not in the gate.

``make calibration`` writes the table.  Each flight is left out in turn; the errors of the legs of the others,
of a flight one normal vector, have the covariance

.. math:: \\tau^2 p p^T + diag(\\lambda_k^2, \\delta^2) + \\beta^2 B,

p the predicted times, τ common to the flight, λ of each leg of kind k, δ of the landing, β what one leg loses
to the next (B the differences between neighbours).  The likeliest, with what is known beforehand as
`planner.identify.spread` counts it, predict the whole flight left out, by Student's t.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import minimize
from scipy.special import beta
from scipy.stats import t as student_t

from planner.flight.motion.kinematics import FlightState
from planner.flight.uncertainty import kind_of

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.identify.spread import FlownAndPredicted
    from planner.vehicle.repeatability import Repeatability

    Leg = tuple[int, Mapping[FlightState, float]]
    """Its number in the flight, and how long it is predicted to be in each state. [s]"""

_LANDING = -1
_LEVEL, _VERTICAL, _STANDING, _TAKEOFF, _THROUGH = range(5)


def alike(_: Leg) -> int:
    """Return one kind for all legs."""
    return 0


def by_direction(leg: Leg) -> int:
    """Return whether a leg is mostly level, vertical or standing."""
    kinds = [FlightState.CRUISE, FlightState.CLIMB, FlightState.HOVER]
    lasts_s = dict.fromkeys(kinds, 0.0)
    for state, duration_s in leg[1].items():
        is_standing = state is FlightState.HOVER
        is_level = kind_of(state) is FlightState.CRUISE
        lasts_s[state if is_standing else kinds[0 if is_level else 1]] += duration_s
    return kinds.index(max(kinds, key=lasts_s.__getitem__))


def by_ends(leg: Leg) -> int:
    """Return the same with the first leg, and level ones that are not braked at the end, apart."""
    number, states = leg
    kind = by_direction(leg)
    if number == 0:
        return _TAKEOFF
    return _THROUGH if kind == _LEVEL and FlightState.BRAKE not in states else kind


WAYS: tuple[tuple[Callable[[Leg], int], int], ...] = ((alike, 1), (by_direction, 3), (by_ends, 5))


def kinds_row(
    label: str,
    flights: Sequence[FlownAndPredicted],
    states: Sequence[Sequence[Mapping[FlightState, float]]],
    known: Repeatability,
) -> str:
    """Return how well flights left out are predicted, by how many kinds of legs there are."""
    cells = []
    for kind, count in WAYS:
        errors = []
        for flight, of_legs in zip(flights, states, strict=True):
            landing = () if flight.landing_s is None else (flight.landing_s,)
            flown, predicted = np.array([*flight.legs_s, *landing]).T
            kinds = [kind(leg) for leg in enumerate(of_legs)] + [_LANDING] * len(landing)
            errors.append((flown - predicted, predicted, np.array(kinds)))
        cells.append(_scores(errors, count, known))
    of_legs_percent = 100.0 * float(np.median([of_legs for _, of_legs in cells[1]]))
    means = [f"{100.0 * float(np.mean([score for score, _ in cell])):.3f} %" for cell in cells]
    return f"| {' | '.join([label, *means, f'{of_legs_percent:.0f} %'])} |"


KINDS_HEAD = (
    "| family | all legs alike | level, vertical, standing | and first, flown through | the legs of it |",
    "|---|---|---|---|---|",
)
_Errors = tuple["FloatArray", "FloatArray", "IntArray"]


def _scores(
    errors: Sequence[_Errors], count: int, known: Repeatability
) -> list[tuple[float, float]]:
    """Return of each flight its score by the others, and what of its variance is that of legs."""
    found = []
    for number, (error, predicted, kinds) in enumerate(errors):
        others = [*errors[:number], *errors[number + 1 :]]
        flight, landing, *legs = _variances(others, count, known)
        of_legs = sum(legs[kind] for kind in kinds.tolist() if kind != _LANDING)
        variance = flight * predicted.sum() ** 2 + landing * (_LANDING in kinds) + of_legs
        deviation = np.sqrt(variance) / predicted.sum()
        score = _ranked_score(error.sum() / predicted.sum() / deviation, len(others))
        found.append((float(deviation * score), float(of_legs / variance)))
    return found


def _variances(errors: Sequence[_Errors], count: int, known: Repeatability) -> FloatArray:
    """Return the likeliest variances of flights, landings, each kind of leg, and between legs."""
    assert known.leg_s is not None
    assert known.landing_s is not None
    prior = 2.0 * np.log([known.time_fraction, known.landing_s, *[known.leg_s] * (count + 1)])

    def unlikelihood(logarithms: FloatArray) -> float:
        flight, landing, *legs, between = np.exp(logarithms)
        sum_ = np.log1p(0.25 * np.square(logarithms - prior)).sum()
        for error, predicted, kinds in errors:
            steps = np.diff(np.eye(error.size), axis=0)
            own = np.array([*legs, landing])[kinds]
            covariance = flight * np.outer(predicted, predicted) + np.diag(own)
            covariance += between * steps.T @ steps
            sum_ += 0.5 * np.linalg.slogdet(covariance)[1]
            sum_ += 0.5 * error @ np.linalg.solve(covariance, error)
        return float(sum_)

    bounds = [(at - 2.0 * np.log(10.0), at + 12.0) for at in prior]
    best = minimize(unlikelihood, prior, method="L-BFGS-B", bounds=bounds)
    return np.asarray(np.exp(best.x[:-1]))


def _ranked_score(error: float, freedom: int) -> float:
    """Return the continuous ranked probability score of Student's t, of an error in its deviations.

    A. Jordan, F. Krüger, S. Lerch, J. Stat. Softw. 90 (2019) 12, appendix A.
    """
    tail = 2.0 * student_t.cdf(error, freedom) - 1.0
    dense = 2.0 * student_t.pdf(error, freedom) * (freedom + error**2) / (freedom - 1.0)
    even = 2.0 * np.sqrt(freedom) / (freedom - 1.0)
    return float(
        error * tail + dense - even * beta(0.5, freedom - 0.5) / beta(0.5, 0.5 * freedom) ** 2
    )
