"""The extremes of a flight in the air it meets, and the segments in which they are reached."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray, IntArray, KinematicState


@frozen
class Extreme:
    """A highest or lowest value, and where it is reached."""

    value: float
    segment: int


@frozen
class Extremes:
    """The box a flight stays in, at the nodes of its quadrature."""

    ground_speed_m_s: Extreme
    airspeed_m_s: Extreme
    climb_m_s: Extreme
    descent_m_s: Extreme
    """Lowest climb rate. [m s⁻¹]"""
    highest_m: float
    """Height above home. [m]"""
    lowest_m: float


def flight_extremes(
    state: KinematicState, airspeed_m_s: FloatArray, piece_segment: IntArray
) -> Extremes:
    """Return the extremes of a flight.

    Parameters
    ----------
    state : KinematicState
        At the nodes of every piece. (p, k)
    airspeed_m_s : ndarray
        Horizontal speed through the air there. (p, k) [m s⁻¹]
    piece_segment : ndarray of int
        The segment of each piece. (p,)

    Returns
    -------
    Extremes
        Of at least one piece.
    """
    nodes = airspeed_m_s.shape[1]

    def highest(values: FloatArray, sign: float = 1.0) -> Extreme:
        place = int(np.argmax(sign * values))
        return Extreme(value=float(values.flat[place]), segment=int(piece_segment[place // nodes]))

    return Extremes(
        ground_speed_m_s=highest(state.ground_speed_m_s),
        airspeed_m_s=highest(airspeed_m_s),
        climb_m_s=highest(state.climb_m_s),
        descent_m_s=highest(state.climb_m_s, -1.0),
        highest_m=float(state.height_m.max()),
        lowest_m=float(state.height_m.min()),
    )
