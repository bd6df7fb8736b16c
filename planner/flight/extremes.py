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

    def at(values: FloatArray, place: np.intp) -> Extreme:
        return Extreme(
            value=float(values[np.unravel_index(place, values.shape)]),
            segment=int(piece_segment[place // nodes]),
        )

    ground_m_s, climb_m_s = state.ground_speed_m_s, state.climb_m_s
    return Extremes(
        ground_speed_m_s=at(ground_m_s, np.argmax(ground_m_s)),
        airspeed_m_s=at(airspeed_m_s, np.argmax(airspeed_m_s)),
        climb_m_s=at(climb_m_s, np.argmax(climb_m_s)),
        descent_m_s=at(climb_m_s, np.argmin(climb_m_s)),
        highest_m=float(state.height_m.max()),
        lowest_m=float(state.height_m.min()),
    )
