"""Gauss-Legendre quadrature: exact for polynomials up to degree 2 n - 1 with n points.

The nodes and weights stand here as numbers, because `numpy.polynomial`, which computes them, takes
longer to import than a small mission takes to check.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.arrays import FloatArray


_HALVES = {
    3: ((0.0, 0.8888888888888888), (0.7745966692414834, 0.5555555555555556)),
    4: ((0.33998104358485626, 0.6521451548625461), (0.8611363115940526, 0.34785484513745385)),
    8: (
        (0.1834346424956498, 0.362683783378362),
        (0.525532409916329, 0.31370664587788727),
        (0.7966664774136267, 0.22238103445337448),
        (0.9602898564975363, 0.10122853629037626),
    ),
}
"""By the number of points: nodes that are not negative and their weights, on −1 to 1 (Abramowitz
and Stegun, table 25.4)."""


def unit_quadrature(points: int) -> tuple[FloatArray, FloatArray]:
    """Return rising nodes and weights of the integral over 0 to 1, with 3, 4 or 8 points."""
    half = _HALVES[points]
    pairs = sorted({(sign * node, weight) for node, weight in half for sign in (-1.0, 1.0)})
    nodes, weights = np.array(pairs).T
    return 0.5 * (nodes + 1.0), 0.5 * weights


def unit_derivative(points: int, at: FloatArray) -> FloatArray:
    """Return the weights of values at the nodes in the derivative at places between 0 and 1.

    That of the polynomial through them: exact up to degree ``points`` − 1.  (…, points)
    """
    powers = np.arange(points)
    slopes = powers * np.asarray(at)[..., None] ** np.maximum(powers - 1, 0)
    return np.asarray(slopes @ _coefficients_of_values(points))


@cache
def _coefficients_of_values(points: int) -> FloatArray:
    nodes, _ = unit_quadrature(points)
    return np.asarray(np.linalg.inv(nodes[:, None] ** np.arange(points)), np.float64)
