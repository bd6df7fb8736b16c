"""Limits along lines in space, from the horizontal and the vertical one; drag from the lean limit."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.units import GRAVITY_M_S2

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters


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


def drag_per_s(parameters: ArduPilotParameters, airspeed_limit_m_s: float) -> float:
    """Return the deceleration by drag over the airspeed: at the limit the greatest lean holds it. [s⁻¹]"""
    return GRAVITY_M_S2 * math.tan(parameters.lean_angle_max_rad) / airspeed_limit_m_s
