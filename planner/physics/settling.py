"""When a response has reached its end, when it first gets somewhere, how far it goes beyond.

Horizons come from the moduli of the decaying terms, turning points from `planner.physics.extrema`,
and times from Newton's rule between two turning points: nothing is sampled, nothing is missed.
"""

from __future__ import annotations

from math import comb, factorial
from typing import TYPE_CHECKING

import numpy as np

from planner.physics.extrema import Extremum, ModulusBound, monotone_between, monotone_roots

if TYPE_CHECKING:
    import numpy.typing as npt

    from planner.physics.modes import FloatArray
    from planner.physics.response import Response

_CHUNK_RADIANS = 2000.0
_GRID = 64
_REFINEMENTS = 4  # 63^-4 of a time constant
_NEGLIGIBLE = 1e-12  # of the largest term: the response is taken to have ended


def final_value(response: Response, *, derivative: int = 0) -> float | None:
    """Value that the response, or a derivative of it, tends to.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    derivative : int
        1 for the slope, -1 for the integral.

    Returns
    -------
    float or None
        None where it grows or swings for ever.
    """
    bound = ModulusBound.of(response, derivative)
    if bound.slowest_rate >= 0.0:
        return None
    # polynomials of all edges about t = 0; beyond the last edge only a constant may remain
    length = max((len(part[3]) for part in bound.parts), default=0)
    sums, sizes = np.zeros(length + 1), np.zeros(length + 1)
    for (start_s, _, _, polynomial), edge in zip(bound.parts, response.edges, strict=True):
        for power, coefficient in enumerate(polynomial):
            for j in range(power + 1):
                term = (
                    float(edge.amplitude)
                    * coefficient
                    / factorial(power)
                    * comb(power, j)
                    * (-start_s) ** (power - j)
                )
                sums[j] += term
                sizes[j] += abs(term)
    if np.any(np.abs(sums[1:]) > 1e-12 * sizes[1:]):
        return None
    return float(sums[0])


def settling_times_s(
    response: Response, tolerances: npt.ArrayLike, *, target: float | None = None
) -> FloatArray:
    """First times after which the response stays within tolerances of its final value.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    tolerances : array_like
        Largest distance allowed, positive. [output]
    target : float, optional
        Level to stay near to, where it is not the final value. [output]

    Returns
    -------
    ndarray
        In the shape of the tolerances, exact to about 1e-12 s; 0 where the response is never
        farther away, inf where it never settles. [s]

    Raises
    ------
    ValueError
        If a tolerance is not positive.
    """
    allowed = np.asarray(tolerances, dtype=np.float64)
    if not np.all(allowed > 0.0):
        msg = f"a settling tolerance must be positive, got {allowed.tolist()}"
        raise ValueError(msg)
    times = np.full(allowed.size, np.inf)
    final = final_value(response)
    if final is None:
        return times.reshape(allowed.shape)
    level = final if target is None else target
    slack = allowed.ravel() - abs(final - level)
    bound = ModulusBound.of(response, 0)
    open_ = np.flatnonzero(slack > 0.0)
    chunk_s = _CHUNK_RADIANS / max(float(response.system.modes.fastest_rad_s), 1e-300)
    high = np.inf
    while open_.size:
        # backwards from where no tolerance can be exceeded any more
        high = min(high, _horizon_s(bound, float(slack[open_].min())))
        low = max(high - chunk_s, 0.0)
        cuts = monotone_between(response, low, high, derivative=0)
        away = response.value(cuts) - level
        farther = np.abs(away) > allowed.ravel()[open_, None]
        farther[:, -1] = False  # by the bound; rounding may say otherwise
        found = farther.any(axis=1)
        last = cuts.size - 1 - np.argmax(farther[found, ::-1], axis=1)
        limit = level + np.sign(away[last]) * allowed.ravel()[open_[found]]
        times[open_[found]] = _reached(response, limit, cuts[last], cuts[last + 1], 0)
        open_ = open_[~found]
        if low == 0.0:
            times[open_] = 0.0
            break
        high, chunk_s = low, 2.0 * chunk_s
    return times.reshape(allowed.shape)


def first_crossings_s(
    response: Response,
    levels: npt.ArrayLike,
    *,
    window_s: float | None = None,
    derivative: int = 0,
) -> FloatArray:
    """First times at which the response, or a derivative of it, reaches levels.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    levels : array_like
        Levels, above or below zero, where everything rests before time 0.
    window_s : float, optional
        Search in [0, window]; left out, for ever, which needs a final value. [s]
    derivative : int
        1 for the slope, -1 for the integral, such as the way of a speed response.

    Returns
    -------
    ndarray
        In the shape of the levels, exact to about 1e-12 s; inf where one is never reached. [s]

    Raises
    ------
    ValueError
        If there is neither a window nor a final value.
    """
    wanted = np.asarray(levels, dtype=np.float64)
    flat = wanted.ravel()
    if window_s is None:
        final = _needed_final_value(response, derivative)
        distance = np.abs(flat - final)
        window_s = _ended_s(response, derivative, float(distance.min(initial=np.inf)))
    cuts = monotone_between(response, 0.0, window_s, derivative=derivative)
    values = response.derivative(cuts, derivative)
    upward = flat >= 0.0  # at rest before 0: a jump at 0 reaches what lies between
    first = np.where(
        upward,
        np.searchsorted(np.maximum.accumulate(values), flat),
        np.searchsorted(-np.minimum.accumulate(values), -flat),
    )
    times = np.full(flat.size, np.inf)
    times[first == 0] = cuts[0]
    inside = (first > 0) & (first < cuts.size)
    after = first[inside]
    times[inside] = _reached(response, flat[inside], cuts[after - 1], cuts[after], derivative)
    return times.reshape(wanted.shape)


def overshoot(response: Response) -> Extremum | None:
    """Farthest point beyond the final value, seen from the start at zero.

    Returns
    -------
    Extremum or None
        Time and value of the point, not the excess over the final value; None where the response
        never goes beyond, or its final value is zero.

    Raises
    ------
    ValueError
        If there is no final value.
    """
    final = _needed_final_value(response, 0)
    cuts = monotone_between(response, 0.0, _ended_s(response, 0, 0.0), derivative=0)
    values = response.value(cuts)
    beyond = np.sign(final) * (values - final)
    farthest = int(np.argmax(beyond))
    if beyond[farthest] <= _NEGLIGIBLE * np.abs(values).max():
        return None
    return Extremum(float(cuts[farthest]), float(values[farthest]))


def peak_slope(response: Response, window_s: float | None = None) -> Extremum:
    """Point of the largest slope, upward or downward.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    window_s : float, optional
        Search in [0, window]; left out, for ever, which needs a slope that settles. [s]

    Returns
    -------
    Extremum
        Its time, and the slope with its sign.

    Raises
    ------
    ValueError
        If there is neither a window nor a final slope.
    """
    if window_s is None:
        _needed_final_value(response, 1)
        window_s = _ended_s(response, 1, 0.0)
    cuts = monotone_between(response, 0.0, window_s, derivative=1)
    slopes = response.slope(cuts)
    steepest = int(np.argmax(np.abs(slopes)))
    return Extremum(float(cuts[steepest]), float(slopes[steepest]))


def _reached(
    response: Response, level: FloatArray, low: FloatArray, high: FloatArray, derivative: int
) -> FloatArray:
    return monotone_roots(
        lambda t: (
            response.derivative(t, derivative) - level,
            response.derivative(t, derivative + 1),
        ),
        low,
        high,
    )


def _needed_final_value(response: Response, derivative: int) -> float:
    final = final_value(response, derivative=derivative)
    if final is None:
        msg = "this response has no final value; give the window to search in"
        raise ValueError(msg)
    return final


def _ended_s(response: Response, derivative: int, distance: float) -> float:
    """Time from which the response is nearer to its end than a distance, or at it."""
    bound = ModulusBound.of(response, derivative)
    size = float(bound.beyond(np.array([bound.last_edge_s]))[0])
    return _horizon_s(bound, max(distance, _NEGLIGIBLE * size))


def _horizon_s(bound: ModulusBound, allowed: float) -> float:
    """Time after which the decaying terms stay below what is allowed; after the last edge."""
    # exp(-1000) is zero: the last time always serves
    spans = np.geomspace(1e-3, 1e3, _GRID) / -bound.slowest_rate
    times = bound.last_edge_s + np.concatenate([[0.0], spans])
    for _ in range(_REFINEMENTS):
        first = int(np.argmax(bound.beyond(times) <= allowed))
        if first == 0:
            break
        times = np.linspace(times[first - 1], times[first], _GRID)
    first = int(np.argmax(bound.beyond(times) <= allowed))
    # a little later, where rounding does not matter
    return float(times[first]) * (1.0 + 1e-15) + 1e-9
