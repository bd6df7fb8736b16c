r"""Where a response turns: found without sampling, so that none is missed.

The slope f of a response is a sum of exponentials times polynomials.  On an interval of half width
w about m, with :math:`|f''| \le M` there from the moduli of its terms,

.. math:: |f(m)| > |f'(m)| w + M w^2 / 2 \;\Rightarrow\; \text{no root}, \qquad
          |f'(m)| > M w \;\Rightarrow\; \text{at most one root};

any other interval is halved.  Every root that changes the sign of f is therefore bracketed alone
and then polished by Newton's rule inside its bracket.
"""

from __future__ import annotations

from math import factorial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.physics.clusters import DecayTerms
    from planner.physics.modes import FloatArray
    from planner.physics.response import Response

_FIRST_SPLIT = 32
_MOST_INTERVALS = 1_000_000
_NOISE = 1e-14  # of the moduli of the terms: below it a slope is rounding
_SHORTEST_S = 1e-10


class Extremum(NamedTuple):
    """A point of a response."""

    time_s: float
    """Time since the beginning of the input. [s]"""

    value: float
    """Value there, of the response or of the derivative that was asked for."""


@frozen(eq=False)
class ModulusBound:
    """Bound of a derivative of a response from the moduli of its terms."""

    parts: tuple[tuple[float, float, DecayTerms, tuple[float, ...]], ...]
    """Per edge: start with delay [s], |amplitude|, decaying terms, polynomial coefficients."""

    @classmethod
    def of(cls, response: Response, derivative: int) -> ModulusBound:
        """Bound of one derivative of the response of one system.

        Raises
        ------
        ValueError
            If the response has a stack of systems or arrays of amplitudes.
        """
        modes = response.system.modes
        parts = []
        for edge in response.edges:
            if modes.shape or np.ndim(edge.amplitude) or np.ndim(edge.start_s):
                msg = "the shape of a response is analysed for one system and one amplitude"
                raise ValueError(msg)
            k = edge.order + 1 - derivative
            start_s = float(edge.start_s) + float(response.system.delay_s)
            amplitude = abs(float(edge.amplitude))
            parts.append((start_s, amplitude, modes.decay_terms(k), modes.polynomial_part(k)))
        return cls(parts=tuple(parts))

    def over(self, start_s: FloatArray, end_s: FloatArray) -> FloatArray:
        """Bound on each interval [start, end], between two edges."""
        total = np.zeros(start_s.shape)
        for edge_s, amplitude, terms, polynomial in self.parts:
            since, until = start_s - edge_s, end_s - edge_s
            bound = np.zeros(start_s.shape)
            for rate, degree, magnitude in terms.rows():
                worst = until if rate > 0.0 else since
                bound += magnitude * until**degree / factorial(degree) * np.exp(rate * worst)
            for power, coefficient in enumerate(polynomial):
                bound += abs(coefficient) * until**power / factorial(power)
            total += np.where(since < 0.0, 0.0, amplitude * bound)
        return total

    def beyond(self, time_s: FloatArray) -> FloatArray:
        """Bound of the decaying part from each time on, after all edges."""
        total = np.zeros(time_s.shape)
        for edge_s, amplitude, terms, _ in self.parts:
            for rate, degree, magnitude in terms.rows():
                # t^q exp(σ t) falls from t = -q/σ on
                worst = np.maximum(time_s - edge_s, -degree / rate)
                decay = worst**degree / factorial(degree) * np.exp(rate * worst)
                total += amplitude * magnitude * decay
        return total

    @property
    def last_edge_s(self) -> float:
        """When the last edge begins to show [s]."""
        return max((part[0] for part in self.parts), default=0.0)

    @property
    def slowest_rate(self) -> float:
        """Largest real part of a mode that takes part; -inf where there is none [s⁻¹]."""
        rates = [
            rate
            for _, amplitude, terms, _ in self.parts
            for rate, _, magnitude in terms.rows()
            if amplitude * magnitude > 0.0
        ]
        return max(rates, default=-np.inf)


def turning_points(
    response: Response, window_s: float, *, derivative: int = 0
) -> tuple[Extremum, ...]:
    """Both ends of the window and every point between where the response turns or jumps.

    Between two neighbours of the list the response is monotone.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    window_s : float
        The window is [0, window_s]. [s]
    derivative : int
        1 for the turning points of the slope, -1 for those of the integral.

    Returns
    -------
    tuple of Extremum
        In order of time; a jump gives the points just before and at it.

    Raises
    ------
    ValueError
        If the window is not positive and finite, or holds hundreds of thousands of turns.
    """
    if not 0.0 < window_s < np.inf:
        msg = f"the window must be positive and finite, got {window_s}"
        raise ValueError(msg)
    times = monotone_between(response, 0.0, window_s, derivative=derivative)
    values = response.derivative(times, derivative)
    return tuple(map(Extremum, times.tolist(), values.tolist()))


def extremum(
    response: Response, window_s: float, *, highest: bool, derivative: int = 0
) -> Extremum:
    """Highest or lowest point in [0, window], ends included; the first of equals.

    Parameters
    ----------
    response : Response
        Of one system, to one amplitude.
    window_s : float
        End of the window. [s]
    highest : bool
        True for the highest, False for the lowest point.
    derivative : int
        1 for the slope, -1 for the integral.

    Returns
    -------
    Extremum
        Time and value.
    """
    points = turning_points(response, window_s, derivative=derivative)
    if highest:
        return max(points, key=lambda point: point.value)
    return min(points, key=lambda point: point.value)


def monotone_between(
    response: Response, start_s: float, end_s: float, *, derivative: int
) -> FloatArray:
    """Cut [start, end] into pieces on which a derivative is monotone.

    Returns
    -------
    ndarray
        Rising, both ends included; both sides of every edge.
    """
    moduli = ModulusBound.of(response, derivative + 1)
    curvature = ModulusBound.of(response, derivative + 3)
    begins = sorted({part[0] for part in moduli.parts if start_s < part[0] < end_s})
    cuts = [np.array([start_s, end_s]), np.array(begins), np.nextafter(begins, -np.inf)]
    for low, high in zip([start_s, *begins], [*begins, end_s], strict=True):
        if any(part[0] <= low for part in moduli.parts):
            slope = _Slope(response=response, order=derivative + 1, size=moduli, bend=curvature)
            cuts.append(slope.sign_changes(low, high))
    rising = np.sort(np.concatenate(cuts))
    # np.unique would do, but brings numpy.ma along
    return rising[np.concatenate(([True], rising[1:] > rising[:-1]))]


@frozen(eq=False)
class _Slope:
    """A derivative of a response whose roots are sought."""

    response: Response
    order: int
    size: ModulusBound
    """Bound of the derivative itself."""
    bend: ModulusBound
    """Bound of its second derivative."""

    def __call__(self, t_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        derivative = self.response.derivative
        return derivative(t_s, self.order), derivative(t_s, self.order + 1)

    def sign_changes(self, start_s: float, end_s: float) -> FloatArray:
        """Return the roots with a change of sign between two neighbouring edges."""
        # the derivative just before the next edge, not behind its jump
        grid = np.linspace(start_s, np.nextafter(end_s, start_s), _FIRST_SPLIT + 1)
        low, high = grid[:-1], grid[1:]
        lows, highs = [], []
        while low.size:
            if low.size > _MOST_INTERVALS:
                msg = (
                    f"the {end_s - start_s:.6g} s to search hold too many oscillations; "
                    "give a shorter window"
                )
                raise ValueError(msg)
            middle, half = 0.5 * (low + high), 0.5 * (high - low)
            f, slope = (np.abs(part) for part in self(middle))
            bend = self.bend.over(low, high)
            reach = slope * half + 0.5 * bend * half**2
            empty = (f > reach) | (f + reach <= _NOISE * self.size.over(low, high))
            single = (slope > bend * half) | (half <= _SHORTEST_S + 1e-15 * middle)
            found = single & ~empty
            lows.append(low[found])
            highs.append(high[found])
            again = ~(single | empty)
            low, middle, high = low[again], middle[again], high[again]
            low, high = np.concatenate([low, middle]), np.concatenate([middle, high])
        low, high = np.concatenate(lows), np.concatenate(highs)
        changes = np.sign(self(low)[0]) * np.sign(self(high)[0]) <= 0.0
        return monotone_roots(self, low[changes], high[changes])


def monotone_roots(
    function: Callable[[FloatArray], tuple[FloatArray, FloatArray]],
    low: FloatArray,
    high: FloatArray,
) -> FloatArray:
    """Root of a function in each bracket, by Newton's rule kept inside the bracket.

    Parameters
    ----------
    function : callable
        Values and slopes at an array of arguments; of different or zero sign at the two ends.
    low, high : ndarray
        The brackets.

    Returns
    -------
    ndarray
        Roots, to a few units in the last place or 1e-12, whichever is larger.
    """
    low, high = np.array(low), np.array(high)
    if not low.size:
        return low
    at_low, at_high = function(low)[0], function(high)[0]
    sign = np.where(at_low > 0.0, -1.0, 1.0)
    known = np.where(at_low == 0.0, low, high)
    is_known = (at_low == 0.0) | (at_high == 0.0)
    root = 0.5 * (low + high)
    for turn in range(200):
        f, slope = function(root)
        below = f * sign < 0.0
        low, high = np.where(below, root, low), np.where(below, high, root)
        step = np.divide(-f, slope, out=np.full(root.shape, np.inf), where=slope != 0.0)
        newton = root + step
        tolerance = 1e-12 + 4e-16 * np.abs(root)
        done = (np.abs(step) <= tolerance) | (high - low <= tolerance) | is_known
        if done.all():
            break
        # a bisection now and then, so that slow progress of Newton's rule cannot last
        safe = (newton > low) & (newton < high) & (turn % 4 < 3)
        root = np.where(done, root, np.where(safe, newton, 0.5 * (low + high)))
    return np.where(is_known, known, root)
