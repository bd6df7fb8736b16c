"""Vertices: the speeds at which waypoints are passed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.speeds import STILL_M, allowed_speed_m_s, corner_speed_m_s

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray
    from planner.flight.motion.px4.moves import Moves
    from planner.vehicle.parameters.px4 import Px4Parameters


_SAME_PLACE_M = 0.001
"""Distance below which PX4 takes two places for one (``computeStartXYSpeedFromWaypoints``). [m]"""


def final_speeds_m_s(
    moves: Moves, direction: FloatArray, parameters: Px4Parameters
) -> tuple[FloatArray, FloatArray]:
    """Return the horizontal and the vertical speed at which targets are to be passed. (n,) [m s⁻¹]

    Zero where the vehicle stops: a hold, a loiter, nothing to follow.  Else the corner speed of the two
    legs, not more than can be brought to a stop at the waypoint after: PX4 looks one ahead
    (``computeXYSpeedFromWaypoints``).  Vertically the same with NAV_MC_ALT_RAD and the angle between
    the legs in the plane of height and distance from the origin, as ``_getMaxZSpeed`` has it.
    """
    count = len(moves)
    following = np.where(moves.is_delay | moves.is_return | moves.is_first, count, np.arange(count))
    nearest = np.minimum.accumulate(np.where(moves.is_delay, count, np.arange(count))[::-1])[::-1]
    after = np.concatenate((nearest[1:], [count]))
    follows = after < count
    after = np.where(follows, after, 0)
    follows &= (following[after] == after) & ~moves.is_stop & ~moves.is_delay

    target, following_m = moves.target_m, moves.target_m[after].copy()
    following_m[:, 2] = moves.seen_height_m[after]
    way = following_m[:, :2] - target[:, :2]
    length = np.hypot(way[:, 0], way[:, 1])
    come = np.hypot(direction[:, 0], direction[:, 1])
    scale = length * come
    cosine = np.divide(
        (direction[:, :2] * way).sum(axis=1), scale, out=np.zeros(count), where=scale > 0.0
    )
    corner = corner_speed_m_s(
        cosine,
        moves.radius_m,
        gain_per_s=parameters.trajectory_gain_per_s,
        acceleration_m_s2=parameters.acceleration_m_s2,
    )
    leaving = allowed_speed_m_s(
        length,
        np.zeros(count),
        acceleration_m_s2=np.full(count, parameters.acceleration_m_s2),
        jerk_m_s3=np.full(count, parameters.jerk_m_s3),
    )
    passed = follows & (length >= np.maximum(moves.radius_m, _SAME_PLACE_M))
    level = np.where(passed, np.minimum(np.minimum(corner, leaving), moves.speed_m_s), 0.0)
    return level, np.where(
        follows, _vertex_speeds_m_s(direction, target, following_m, parameters), 0.0
    )


def _vertex_speeds_m_s(
    direction: FloatArray, target_m: FloatArray, following_m: FloatArray, parameters: Px4Parameters
) -> FloatArray:
    """Return the vertical speeds at which targets are to be passed. (n,) [m s⁻¹]"""
    distance = np.hypot(target_m[:, 0], target_m[:, 1])
    outward = np.divide(
        (direction[:, :2] * target_m[:, :2]).sum(axis=1),
        distance,
        out=-np.hypot(direction[:, 0], direction[:, 1]),
        where=distance > STILL_M,
    )
    come = np.column_stack((outward, direction[:, 2]))
    leave = np.column_stack(
        (
            np.hypot(following_m[:, 0], following_m[:, 1]) - distance,
            following_m[:, 2] - target_m[:, 2],
        )
    )
    scale = np.hypot(come[:, 0], come[:, 1]) * np.hypot(leave[:, 0], leave[:, 1])
    cosine = np.divide(
        (come * leave).sum(axis=1), scale, out=np.zeros(len(scale)), where=scale > 0.0
    )
    rising = direction[:, 2] > 0.0
    acceleration = np.where(
        rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2
    )
    limit = np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    speed = corner_speed_m_s(
        np.clip(cosine, -1.0, 1.0),
        acceleration * parameters.altitude_acceptance_m,
        gain_per_s=1.0,
        acceleration_m_s2=1.0,
    )
    differs = np.abs(leave[:, 1]) > _SAME_PLACE_M
    return np.where(differs, np.minimum(speed, limit), 0.0)
