"""Cruise power over airspeed: a table of steady flights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.errors import IdentificationError
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Sequence

    import numpy.typing as npt

    from planner.identify.steady import SteadyPower

    FloatArray = npt.NDArray[np.float64]

_SAME_SPEED_M_S = 0.5
"""Steady flights closer than this are one point of the table. [m/s]"""
_LEAST_ERROR_W = 1e-3
"""Keeps the weights finite where there is no noise. [W]"""


@frozen
class CruiseCurve:
    """Power above hover over airspeed, falling to one minimum and rising after it."""

    speed_m_s: tuple[float, ...]
    """Airspeeds, rising from 0. [m/s]"""
    power_above_hover_w: tuple[float, ...]
    """Power above hover, 0 at 0. [W]"""
    error_w: tuple[float, ...]
    """Standard error of each mean before smoothing. [W]"""
    smoothing_w: float
    """Most that a mean was moved by to give one minimum. [W]"""


def fit_cruise_curve(
    cruises: Sequence[SteadyPower], hover_powers_w: Sequence[float]
) -> CruiseCurve:
    """Fit a table of cruise power with one minimum.

    Steady flights of nearly one speed are joined by their weighted mean; then the curve is made to
    fall to one minimum and to rise after it, by isotonic regression on both sides of the minimum that
    moves the means least.  Hover, at speed 0, is its first point.

    Parameters
    ----------
    cruises : sequence of SteadyPower
        Steady level flights at one speed or more.
    hover_powers_w : sequence of float
        Hover power at the height, mass and density of each. [W]

    Returns
    -------
    CruiseCurve
        The table.

    Raises
    ------
    IdentificationError
        If there is no steady flight at a speed.
    """
    moving = [
        (c.airspeed_m_s, c.power_w - hover_w, max(c.error_w, _LEAST_ERROR_W))
        for c, hover_w in zip(cruises, hover_powers_w, strict=True)
        if c.airspeed_m_s > _SAME_SPEED_M_S
    ]
    if not moving:
        msg = "no steady level flight at a speed: cruise power cannot be told"
        raise IdentificationError(msg)
    points = [_joined(group) for group in _grouped(sorted(moving))]
    speeds, powers, errors = (np.array(column) for column in zip(*points, strict=True))
    smooth = _with_one_minimum(powers, errors)
    return CruiseCurve(
        speed_m_s=(0.0, *speeds.tolist()),
        power_above_hover_w=(0.0, *smooth.tolist()),
        error_w=(0.0, *errors.tolist()),
        smoothing_w=float(np.abs(smooth - powers).max()),
    )


Point = tuple[float, float, float]


def _grouped(points: Sequence[Point]) -> list[list[Point]]:
    """Neighbours in speed together, none farther from the first of its group than the limit."""
    groups: list[list[Point]] = []
    for point in points:
        if groups and point[0] - groups[-1][0][0] < _SAME_SPEED_M_S:
            groups[-1].append(point)
        else:
            groups.append([point])
    return groups


def _joined(group: Sequence[Point]) -> Point:
    """Weighted mean of speed and power, and its error; by the scatter where that is larger."""
    speeds, powers, errors = (np.array(column) for column in zip(*group, strict=True))
    weights = errors**-2.0
    mean = float(np.average(powers, weights=weights))
    error = float(weights.sum() ** -0.5)
    if len(group) > 1:
        scatter = float(np.average((powers - mean) ** 2, weights=weights)) / (len(group) - 1)
        error = max(error, scatter**0.5)
    return float(np.average(speeds, weights=weights)), mean, error


def _with_one_minimum(powers: FloatArray, errors: FloatArray) -> FloatArray:
    """Nearest curve that falls and then rises."""
    from scipy.optimize import isotonic_regression

    weights = errors**-2.0
    best, least = powers, np.inf
    for split in range(powers.size + 1):
        parts = [
            np.asarray(isotonic_regression(powers[part], weights=weights[part], increasing=rises).x)
            for part, rises in ((slice(split), False), (slice(split, None), True))
            if powers[part].size
        ]
        curve = np.concatenate(parts)
        cost = float(weights @ (curve - powers) ** 2)
        if cost < least:
            best, least = curve, cost
    return best
