"""Limits along lines in space, from the horizontal and the vertical one."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray


def limits_along(
    direction: FloatArray, horizontal: FloatArray | float, vertical: FloatArray | float
) -> FloatArray:
    """Return speed or acceleration limits along directions: ``kinematic_limit`` of AP_Math.

    Parameters
    ----------
    direction : ndarray
        East, north, up, of any length; the horizontal limit holds where it is zero. (…, 3)
    horizontal, vertical : ndarray or float
        Limits. (…)
    """
    size = np.sqrt((direction**2).sum(axis=-1))
    level = np.sqrt(direction[..., 0] ** 2 + direction[..., 1] ** 2)
    upward = np.abs(direction[..., 2])
    over = np.full(size.shape, np.inf)
    limit = np.minimum(
        np.divide(horizontal * size, level, out=over.copy(), where=level > 0.0),
        np.divide(vertical * size, upward, out=over, where=upward > 0.0),
    )
    return np.where(size > 0.0, limit, horizontal)
