r"""Modes of one system whose poles are repeated, nearly repeated or close to each other.

A residue sum over a group of poles is a divided difference.  With
:math:`g = N / (s^{z+k} \prod_{j \notin C} (s - p_j))`,

.. math:: I_k(t) = \sum_{C} \left( g\, e^{\cdot t} \right)[p_1, \dots, p_m]
          = \sum_{C} \sum_{i=1}^{m} g[p_i, \dots, p_m]\; \exp_t[p_1, \dots, p_i],

and the divided difference f[p_i … p_j] is entry (i, j) of f of the bidiagonal matrix with the poles
on its diagonal and ones above [1]_.  No difference of two poles of a group is ever divided by, so
exactly repeated, nearly repeated and merely close poles are one case.  At times when a group has
hardly begun to act, |p| t < 1, it is taken together with the integrators at the origin.

References
----------
.. [1] G. Opitz, "Steigungsmatrizen", Z. angew. Math. Mech. 44 (1964), T52-T54.
"""

from __future__ import annotations

from itertools import pairwise
from math import factorial
from typing import TYPE_CHECKING, TypeAlias

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    FloatArray: TypeAlias = npt.NDArray[np.float64]
    ComplexArray: TypeAlias = npt.NDArray[np.complex128]


SEPARATION = 0.1
"""Poles closer than this fraction of the larger modulus belong to one group."""

_UNDAMPED = 1e-12
_TAYLOR_DEGREE = 26  # of a matrix of norm 2: 2^27 / 27! is 1e-20


@frozen(eq=False)
class DecayTerms:
    """Bound of the exponential part of a response: the sum of m t^q / q! exp(σ t)."""

    rates: FloatArray
    """Real parts σ. [s⁻¹]"""

    degrees: npt.NDArray[np.int64]
    """Powers q."""

    magnitudes: FloatArray
    """Magnitudes m."""

    def rows(self) -> list[tuple[float, int, float]]:
        """Rate, power and magnitude of each term."""
        columns = (self.rates, self.degrees, self.magnitudes)
        return list(zip(*(column.tolist() for column in columns), strict=True))


@frozen(eq=False)
class ClusteredModes:
    """One system, its poles gathered in groups of neighbours."""

    numerator: FloatArray
    """Strictly proper numerator over the leading coefficient, descending powers."""

    groups: tuple[ComplexArray, ...]
    """Poles other than the origin by neighbourhood, conjugates included. [rad s⁻¹]"""

    integrators: int
    """Poles at the origin."""

    def impulse_integral(self, t_s: FloatArray, k: int) -> FloatArray:
        """Impulse response integrated k times, at non-negative times of any shape."""
        t = np.ravel(t_s)
        total = np.zeros(t.shape)
        # a group joins the origin until its slowest pole has acted: one split of the times each
        begins_s = [1.0 / np.abs(group).min() for group in self.groups]
        limits_s = [0.0, *sorted(set(begins_s)), np.inf]
        for from_s, until_s in pairwise(limits_s):
            here = (t >= from_s) & (t < until_s)
            if np.any(here):
                waiting = [begin_s > from_s for begin_s in begins_s]
                total[here] = self._divided_sum(t[here], k, waiting)
        return total.reshape(np.shape(t_s))

    def _divided_sum(self, t: FloatArray, k: int, waiting: Sequence[bool]) -> FloatArray:
        total = np.zeros(t.shape)
        for nodes, column, weight in self._columns(k, waiting):
            centre = nodes.mean()
            differences = _divided_exponentials(np.multiply.outer(t, nodes - centre))
            powers = column * t[:, None] ** np.arange(nodes.size)
            total += weight * (np.exp(centre * t) * (powers * differences).sum(axis=1)).real
        return total

    def decay_terms(self, k: int) -> DecayTerms:
        """Bound of the exponential part of the k-fold integral, without its polynomial.

        From the mean value form |exp_t[p_1 … p_i]| ≤ t^(i-1)/(i-1)! exp(max Re p t).
        """
        rates: list[float] = []
        degrees: list[int] = []
        magnitudes: list[float] = []
        for nodes, column, weight in self._columns(k, [False] * len(self.groups)):
            if np.any(nodes):  # the group at the origin is the polynomial part
                rates += [float(growth_rate(nodes).max())] * nodes.size
                degrees += range(nodes.size)
                magnitudes += [weight * float(abs(c)) for c in column]
        return DecayTerms(
            rates=np.array(rates),
            degrees=np.array(degrees, dtype=np.int64),
            magnitudes=np.array(magnitudes),
        )

    def _columns(
        self, k: int, waiting: Sequence[bool]
    ) -> list[tuple[ComplexArray, ComplexArray, float]]:
        """Return groups as nodes, divided differences g[p_i … p_m], and 2 for a conjugate pair."""
        powers = self.integrators + k
        numerator = np.concatenate([self.numerator, np.zeros(max(-powers, 0))])
        groups = [group for group, waits in zip(self.groups, waiting, strict=True) if not waits]
        slow = [group for group, waits in zip(self.groups, waiting, strict=True) if waits]
        origin = np.concatenate([np.zeros(max(powers, 0)), *slow])
        if origin.size:
            groups.append(origin)
        result = []
        for i, nodes in enumerate(groups):
            weight = _conjugate_weight(nodes)
            if weight > 0.0:
                others = [pole for j, group in enumerate(groups) if j != i for pole in group]
                result.append((nodes, _last_column(numerator, others, nodes), weight))
        return result


def growth_rate(poles: npt.ArrayLike) -> FloatArray:
    """Real parts of poles; zero where the damping ratio is lost in the rounding of the roots."""
    p = np.asarray(poles)
    rate: FloatArray = np.where(np.abs(p.real) > _UNDAMPED * np.abs(p), p.real, 0.0)
    return rate


def is_clustered(poles: ComplexArray) -> npt.NDArray[np.bool_]:
    """Whether partial fractions of single poles would lose digits.

    Parameters
    ----------
    poles : ndarray, shape (…, n)
        Poles other than the origin.

    Returns
    -------
    ndarray, shape (…)
        True where two poles are neighbours.
    """
    modulus = np.abs(poles)
    result = np.zeros(poles.shape[:-1], dtype=np.bool_)
    for i in range(poles.shape[-1]):
        for j in range(i):
            gap = np.abs(poles[..., i] - poles[..., j])
            result |= gap < SEPARATION * np.maximum(modulus[..., i], modulus[..., j])
    return result


def neighbours(poles: ComplexArray) -> tuple[ComplexArray, ...]:
    """Poles in groups: each pole is close to another one of its group."""
    groups: list[list[complex]] = []
    for pole in poles:
        close = [
            group
            for group in groups
            if any(abs(pole - p) < SEPARATION * max(abs(pole), abs(p)) for p in group)
        ]
        groups = [group for group in groups if group not in close]
        groups.append([complex(pole), *(p for group in close for p in group)])
    return tuple(np.array(group, dtype=np.complex128) for group in groups)


def _conjugate_weight(nodes: ComplexArray) -> float:
    """1 for a group that is its own conjugate, else 2 for the upper and 0 for the lower one."""
    if np.array_equal(np.sort_complex(nodes), np.sort_complex(nodes.conj())):
        return 1.0
    return 2.0 if nodes.imag.sum() > 0.0 else 0.0


def _last_column(
    numerator: FloatArray, others: Sequence[complex], nodes: ComplexArray
) -> ComplexArray:
    """Divided differences g[p_i … p_m] of g = numerator / product of (s - other)."""
    chain = np.diag(nodes) + np.eye(nodes.size, k=1)
    unit = np.eye(nodes.size)
    column: ComplexArray = np.zeros(nodes.size, dtype=np.complex128)
    for coefficient in numerator:
        column = chain @ column + coefficient * unit[:, -1]
    for other in others:
        column = np.asarray(np.linalg.solve(chain - other * unit, column), dtype=np.complex128)
    return column


def _divided_exponentials(nodes: ComplexArray) -> ComplexArray:
    """Divided differences exp[x_1 … x_j] of each row of nodes, by scaling and squaring.

    Parameters
    ----------
    nodes : ndarray, shape (times, m)

    Returns
    -------
    ndarray, shape (times, m)
        Column j - 1 holds exp[x_1 … x_j]; 1/(j - 1)! exp(x) for equal nodes x.
    """
    times, size = nodes.shape
    if not np.any(nodes):
        row = np.array([1.0 / factorial(j) for j in range(size)], dtype=np.complex128)
        return np.broadcast_to(row, (times, size))
    largest = np.maximum(np.abs(nodes).max(axis=1), 1.0)
    squarings = np.ceil(np.log2(largest)).astype(np.int64)
    scale = np.exp2(-squarings.astype(np.float64))[:, None, None]
    diagonal = nodes[:, None, :] * scale
    term = np.broadcast_to(np.eye(size, dtype=np.complex128), (times, size, size))
    total = np.array(term)
    for degree in range(1, _TAYLOR_DEGREE + 1):
        product = term * diagonal
        product[:, :, 1:] += term[:, :, :-1] * scale
        term = product / degree
        total += term
    for done in range(int(squarings.max())):
        unfinished = squarings > done
        total[unfinished] = total[unfinished] @ total[unfinished]
    result: ComplexArray = total[:, 0, :]
    return result
