"""Manoeuvres: short rows of cubic pieces, each beginning and ending at given places and speeds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.state import STATE_INDEX
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.state import FlightState


@frozen(eq=False)
class Manoeuvres:
    """Manoeuvres of one kind, one per row; each is one segment."""

    key: IntArray
    """Place in the order of the flight. (n,)"""
    state: FlightState
    speed_m_s: FloatArray
    """Highest speed. (n,) [m s⁻¹]"""
    stopping_distance_m: FloatArray
    """Way to stand still from that speed; NaN for none. (n,) [m]"""
    duration_s: FloatArray
    """Duration of each piece. (n, k) [s]"""
    coefficients: FloatArray
    """Rising powers of the piece's own time for east, north, height. (n, k, 3, 4)"""
    is_grounded: BoolArray
    """Whether a piece stands on the ground at no power. (k,)"""

    @property
    def state_index(self) -> IntArray:
        """The state as a position in ``STATES``. (n,)"""
        return np.full(len(self.key), STATE_INDEX[self.state])


def make_manoeuvres(
    key: IntArray,
    state: FlightState,
    *,
    position_m: FloatArray,
    velocity_m_s: FloatArray,
    duration_s: FloatArray,
    speed_m_s: FloatArray | None = None,
    stopping_distance_m: FloatArray | None = None,
    grounded: tuple[int, ...] = (),
) -> Manoeuvres:
    """Return manoeuvres through given places at given velocities and times.

    Parameters
    ----------
    key : ndarray of int
        Place in the order of the flight. (n,)
    state : FlightState
        What the vehicle does.
    position_m, velocity_m_s : ndarray
        East, north, height above home at the ends of the pieces. (n, k + 1, 3) [m, m s⁻¹]
    duration_s : ndarray
        Of the pieces; those of no duration are left out. (n, k) [s]
    speed_m_s : ndarray, optional
        Highest speed; default that at the ends of the pieces. (n,) [m s⁻¹]
    stopping_distance_m : ndarray, optional
        Way to stand still from there; default none. (n,) [m]
    grounded : tuple of int
        Pieces that stand on the ground at no power.

    Notes
    -----
    Each piece is the cubic with these ends (Hermite): constant acceleration is reproduced exactly.
    """
    start, end = position_m[:, :-1], position_m[:, 1:]
    leaving, arriving = velocity_m_s[:, :-1], velocity_m_s[:, 1:]
    per_s = np.divide(1.0, duration_s, out=np.zeros_like(duration_s), where=duration_s > 0.0)
    per_s = per_s[..., None]
    mean = (end - start) * per_s
    coefficients = np.stack(
        (
            start,
            leaving,
            (3.0 * mean - 2.0 * leaving - arriving) * per_s,
            (leaving + arriving - 2.0 * mean) * per_s**2,
        ),
        axis=-1,
    )
    is_grounded = np.zeros(duration_s.shape[1], np.bool_)
    is_grounded[list(grounded)] = True
    if speed_m_s is None:
        speed_m_s = np.sqrt((velocity_m_s**2).sum(axis=-1)).max(axis=1, initial=0.0)
    if stopping_distance_m is None:
        stopping_distance_m = np.full(len(key), np.nan)
    return Manoeuvres(
        key=key,
        state=state,
        speed_m_s=speed_m_s,
        stopping_distance_m=stopping_distance_m,
        duration_s=duration_s,
        coefficients=coefficients,
        is_grounded=is_grounded,
    )


def make_vertical(
    key: IntArray,
    state: FlightState,
    *,
    place_m: FloatArray,
    height_m: tuple[FloatArray, ...],
    climb_m_s: tuple[FloatArray, ...],
    duration_s: tuple[FloatArray, ...],
    grounded: tuple[int, ...] = (),
) -> Manoeuvres:
    """Return manoeuvres straight up and down.

    Parameters
    ----------
    key, state, grounded
        As in :func:`make_manoeuvres`.
    place_m : ndarray
        East and north first. (n, 2 or 3) [m]
    height_m, climb_m_s : tuple of ndarray
        Height above home and climb speed at the k + 1 ends of the pieces. (n,) [m, m s⁻¹]
    duration_s : tuple of ndarray
        Durations of the k pieces. (n,) [s]
    """
    count, ends = len(key), len(height_m)
    position, velocity = np.empty((count, ends, 3)), np.zeros((count, ends, 3))
    position[..., :2] = place_m[:, None, :2]
    position[..., 2] = np.column_stack(height_m)
    velocity[..., 2] = np.column_stack(climb_m_s)
    return make_manoeuvres(
        key,
        state,
        position_m=position,
        velocity_m_s=velocity,
        duration_s=np.column_stack(duration_s),
        grounded=grounded,
    )


def hold(
    key: IntArray, state: FlightState, *, place_m: FloatArray, duration_s: FloatArray
) -> Manoeuvres:
    """Return standstills at places for times. (n, 3) [m], (n,) [s]"""
    return make_manoeuvres(
        key,
        state,
        position_m=np.repeat(place_m[:, None], 2, axis=1),
        velocity_m_s=np.zeros((len(key), 2, 3)),
        duration_s=duration_s[:, None],
    )
