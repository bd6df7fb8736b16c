"""Headway: the ground speeds a vehicle can hold against the wind."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import SlowedLegs, is_nonzero

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.physics.wind import Wind

SLOWEST_M_S = 0.1
"""What is left of a speed without headway, so that the flight ends; a finding reports it. [m s⁻¹]"""


def headway_m_s(
    way_m: FloatArray, height_m: FloatArray, *, wind: Wind | None, airspeed_limit_m_s: float
) -> FloatArray:
    """Return the highest ground speeds that can be held on ways; not positive without headway. (n,) [m s⁻¹]

    An autopilot holds its ground speed until the tilt reaches its limit; with the airspeed v_max there it
    is w_along + √(v_max² − w_across²).  That is concave in the strength of the wind, so that on a way
    through a wind profile the lowest is met at one of its ends; it is taken for the whole way.

    Parameters
    ----------
    way_m : ndarray
        East and north way, of any length but zero. (n, 2) [m]
    height_m : ndarray
        Heights above home that each way lies between, or the only one. (n, k) [m]
    wind : Wind, optional
        ``None``: none.
    airspeed_limit_m_s : float
        Airspeed at the greatest tilt. [m s⁻¹]
    """
    east, north = (0.0, 0.0) if wind is None else (wind.east_m_s, wind.north_m_s)
    length = np.hypot(way_m[:, 0], way_m[:, 1])[:, None]
    factor = np.ones(height_m.shape) if wind is None else wind.speed_factor(height_m)
    along = factor * (east * way_m[:, :1] + north * way_m[:, 1:]) / length
    across = factor * (north * way_m[:, :1] - east * way_m[:, 1:]) / length
    room = airspeed_limit_m_s**2 - across**2
    speed = np.where(room > 0.0, along + np.sqrt(np.maximum(room, 0.0)), 0.0)
    return np.asarray(speed.min(axis=1))


def held_speeds_m_s(
    speed_m_s: FloatArray,
    way_m: FloatArray,
    item: IntArray,
    *,
    height_m: FloatArray,
    wind: Wind | None,
    airspeed_limit_m_s: float | None,
) -> tuple[FloatArray, SlowedLegs | None]:
    """Return the ground speeds that can be held on legs, and the legs slower than commanded. (n,) [m s⁻¹]

    Parameters
    ----------
    speed_m_s : ndarray
        Commanded. (n,) [m s⁻¹]
    way_m, height_m, wind, airspeed_limit_m_s
        As for `headway_m_s`; without a limit of the airspeed all speeds are held.
    item : ndarray of int
        Mission item of each. (n,)
    """
    if airspeed_limit_m_s is None or not len(way_m):
        return speed_m_s, None
    moves = is_nonzero(way_m)
    limit = speed_m_s.copy()
    limit[moves] = headway_m_s(
        way_m[moves], height_m[moves], wind=wind, airspeed_limit_m_s=airspeed_limit_m_s
    )
    held = np.minimum(speed_m_s, np.maximum(limit, SLOWEST_M_S))
    slowed = slowed_legs(speed_m_s, limit, item, moves=moves)
    return np.where(moves, held, speed_m_s), slowed


def slowed_legs(
    speed_m_s: FloatArray, limit_m_s: FloatArray, item: IntArray, *, moves: BoolArray
) -> SlowedLegs | None:
    """Return the legs with less speed than commanded; those with none at all are no such legs."""
    slowed = np.flatnonzero(moves & (limit_m_s > SLOWEST_M_S) & (limit_m_s < speed_m_s))
    if not len(slowed):
        return None
    return SlowedLegs(
        item=item[slowed], commanded_m_s=speed_m_s[slowed], held_m_s=limit_m_s[slowed]
    )
