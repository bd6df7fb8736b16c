"""The beginnings of legs: turns, waits for headings, and slowing down for a slope."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.ramps import ramp_time_s
from planner.flight.motion.px4.speeds import STILL_M, braking_distance_m
from planner.flight.motion.px4.turns import (
    ALIGNED_COS,
    PEAK_OVER_MEAN,
    Approach,
    Turns,
    turns_onto_legs,
)

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray
    from planner.flight.motion.px4.layout import Layout
    from planner.vehicle.parameters.px4 import Px4Parameters


_SHORTEST_JOIN_S = 0.1
"""Changes of velocity that take less are taken at once: 0.01 m/s. [s]"""
_NEARLY_STRAIGHT = 2.0 * ALIGNED_COS**2 - 1.0
"""Cosine of twice the angle at which a turn counts as done: a turn by less is little more than a join."""
_LONGEST_JOIN = 0.5
"""Share of a leg beyond which it is too short to be joined at its speed. [-]"""
_LONGEST_SLOW_JOIN = 0.9
"""The same of joins at less than that. [-]"""
_LEAST_SHARE = 0.1
"""Share of the speed below which a leg is joined at once. [-]"""


def turns_onto_moves(
    part: Layout, place_m: FloatArray, velocity_m_s: FloatArray, parameters: Px4Parameters
) -> Turns:
    """Return the turns onto moves; where a heading is waited for, the braking and the wait."""
    rising = part.target_m[:, 2] > place_m[:, 2]
    turns = turns_onto_legs(
        Approach(
            place_m=place_m,
            velocity_m_s=velocity_m_s[:, :2],
            begins_m=part.begins_m,
            target_m=part.target_m,
            radius_m=part.radius_m,
            vertical_m_s=np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s),
            climb_m_s=velocity_m_s[:, 2],
            vertical_m_s2=np.where(
                rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2
            ),
        ),
        acceleration_m_s2=parameters.acceleration_m_s2,
        jerk_m_s3=parameters.jerk_m_s3,
    )
    idle = part.stands | part.is_takeoff | ~part.is_leg
    pausing = part.pause_s > 0.0
    if not (idle | pausing).any():
        return turns
    speed = np.hypot(velocity_m_s[:, 0], velocity_m_s[:, 1])
    braking_s = ramp_time_s(
        speed, acceleration_m_s2=parameters.acceleration_m_s2, jerk_m_s3=parameters.jerk_m_s3
    )
    stopped = place_m + 0.5 * braking_s[:, None] * velocity_m_s * np.array([1.0, 1.0, 0.0])
    duration = np.where(pausing, np.maximum(part.pause_s, braking_s), turns.duration_s)
    still = idle | pausing
    return Turns(
        duration_s=np.where(idle, 0.0, duration),
        end_m=np.where(idle[:, None], place_m, np.where(pausing[:, None], stopped, turns.end_m)),
        speed_m_s=np.where(still, 0.0, turns.speed_m_s),
        acceleration_m_s2=np.where(still, 0.0, turns.acceleration_m_s2),
    )


def slowed_turns(
    part: Layout,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    turns: Turns,
    parameters: Px4Parameters,
) -> tuple[Turns, BoolArray]:
    """Return turns onto legs too steep for the speed they are begun with, and which legs these are.

    Without a turn, the horizontal speed falls to what the vertical limit leaves, or to that of the leg,
    while the vertical one comes to what goes with it, both in the time of the slower.
    """
    way = part.target_m - place_m
    level, height = np.hypot(way[:, 0], way[:, 1]), np.abs(way[:, 2])
    rising = way[:, 2] > 0.0
    limit = np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    left = np.divide(limit * level, height, out=np.full_like(level, np.inf), where=height > STILL_M)
    slows = part.is_leg & ~part.is_takeoff & (turns.duration_s == 0.0) & (left < turns.speed_m_s)
    slows &= part.pause_s == 0.0
    if not slows.any():
        return turns, slows
    left = np.minimum(left, part.speed_m_s)
    after = np.where(slows, left, turns.speed_m_s)
    reached = np.minimum(
        limit, np.divide(after * height, level, out=limit.copy(), where=level > STILL_M)
    )
    vertical = np.where(rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    begun = np.clip(np.sign(way[:, 2]) * velocity_m_s[:, 2], -limit, limit)
    jerk = np.full_like(limit, parameters.jerk_m_s3)
    time = np.maximum(
        ramp_time_s(
            turns.speed_m_s - after,
            acceleration_m_s2=np.full_like(limit, parameters.acceleration_m_s2),
            jerk_m_s3=jerk,
        ),
        ramp_time_s(np.abs(reached - begun), acceleration_m_s2=vertical, jerk_m_s3=jerk),
    )
    slows &= height > limit * time
    speed = np.hypot(velocity_m_s[:, 0], velocity_m_s[:, 1])
    along = velocity_m_s / np.where(speed > 0.0, speed, 1.0)[:, None]
    end = place_m + along * (0.5 * (turns.speed_m_s + after) * time)[:, None]
    end[:, 2] = place_m[:, 2] + np.sign(way[:, 2]) * 0.5 * (begun + reached) * time
    return (
        Turns(
            duration_s=np.where(slows, time, turns.duration_s),
            end_m=np.where(slows[:, None], end, turns.end_m),
            speed_m_s=np.where(slows, after, turns.speed_m_s),
            acceleration_m_s2=np.where(slows, 0.0, turns.acceleration_m_s2),
        ),
        slows,
    )


def joined_turns(
    part: Layout,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    turns: Turns,
    slowed: BoolArray,
    *,
    parameters: Px4Parameters,
    share: float = 1.0,
) -> Turns:
    """Return turns by which legs that need none are joined: nothing changes its velocity at once.

    What is across the new leg, up to 11.5° of the velocity and what is left of a climb, dies away at
    limited jerk, each axis in the time of the slowest, while the speed along the leg begins to grow.
    Legs too short for that are joined at a share of the speed.
    """
    way = part.ends_m - place_m
    length = np.sqrt((way**2).sum(axis=1))
    direction = np.divide(way, length[:, None], out=np.zeros_like(way), where=length[:, None] > 0.0)
    level, upright = np.hypot(direction[:, 0], direction[:, 1]), np.abs(direction[:, 2])
    shallow = level >= upright
    projected = np.maximum((velocity_m_s * direction).sum(axis=1), 0.0)
    speed = np.where(
        shallow, turns.speed_m_s / np.where(shallow & (level > 0.0), level, 1.0), projected
    )
    speed = speed * share
    change = np.abs(direction * speed[:, None] - velocity_m_s)
    rising = direction[:, 2] > 0.0
    vertical = np.where(rising, parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    jerk = np.full_like(length, parameters.jerk_m_s3)
    time = np.maximum(
        ramp_time_s(
            change[:, :2].max(axis=1),
            acceleration_m_s2=parameters.acceleration_m_s2,
            jerk_m_s3=jerk,
        ),
        ramp_time_s(change[:, 2], acceleration_m_s2=vertical, jerk_m_s3=jerk),
    )
    straight = (turns.duration_s == 0.0) | (
        (turns.duration_s < time)
        & (projected > _NEARLY_STRAIGHT * np.sqrt((velocity_m_s**2).sum(axis=1)))
    )
    joins = part.is_leg & ~part.is_takeoff & straight & ~slowed & (part.pause_s == 0.0)
    joins &= (time > _SHORTEST_JOIN_S) & (length > 0.0)
    if not joins.any():
        return turns
    # The speed along the leg grows meanwhile, no further than half way to its limit.
    limit = np.minimum(
        np.divide(part.speed_m_s, level, out=np.full_like(level, np.inf), where=level > 0.0),
        np.divide(
            np.where(rising, parameters.climb_speed_m_s, parameters.descent_speed_m_s),
            upright,
            out=np.full_like(level, np.inf),
            where=upright > 0.0,
        ),
    )
    growing = np.minimum(time, parameters.acceleration_m_s2 / parameters.jerk_m_s3)
    growing = np.minimum(growing, np.sqrt(np.maximum(limit - speed, 0.0) / parameters.jerk_m_s3))
    # It must be allowed by the way left once the acceleration is taken back.
    settled = speed + jerk * growing**2
    left = length + part.tail_m - settled * (time + growing)
    level_reach = braking_distance_m(
        settled * level,
        part.final_level_m_s,
        acceleration_m_s2=np.full_like(length, parameters.acceleration_m_s2),
        jerk_m_s3=jerk,
    )
    upright_reach = braking_distance_m(
        settled * upright,
        part.final_upright_m_s,
        acceleration_m_s2=vertical,
        jerk_m_s3=jerk,
    )
    grows = (
        shallow & (share == 1.0) & (level_reach <= left * level) & (upright_reach <= left * upright)
    )
    growing = np.where(grows, growing, 0.0)
    after = speed + 0.5 * jerk * growing**2
    end = place_m + 0.5 * (velocity_m_s + direction * after[:, None]) * time[:, None]
    longest = _LONGEST_JOIN if share == 1.0 else _LONGEST_SLOW_JOIN
    fits = ((end - place_m) * direction).sum(axis=1) < longest * length
    short = np.flatnonzero(joins & ~fits)
    joins &= fits
    joined = Turns(
        duration_s=np.where(joins, time, turns.duration_s),
        end_m=np.where(joins[:, None], end, turns.end_m),
        speed_m_s=np.where(joins & shallow, after * level, turns.speed_m_s),
        acceleration_m_s2=np.where(
            joins & shallow, jerk * growing * level, turns.acceleration_m_s2
        ),
    )
    if len(short) and share > _LEAST_SHARE:
        slower = joined_turns(
            part.select(short),
            place_m[short],
            velocity_m_s[short],
            turns.select(short),
            slowed[short],
            parameters=parameters,
            share=0.5 * share,
        )
        joined.put(short, slower)
    return joined


def cut_short(
    part: Layout,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    turns: Turns,
    ends_m: FloatArray,
    *,
    parameters: Px4Parameters,
) -> tuple[Turns, FloatArray]:
    """Return turns that lead no further than the end of their leg, and ends not before their turn.

    A turn cut to next to nothing still takes the time to bring the vehicle across to its end, and to
    turn its velocity into the leg.
    """
    goal = ((ends_m - place_m) * part.direction).sum(axis=1)
    turned = ((turns.end_m - place_m) * part.direction).sum(axis=1)
    flies = part.is_leg & ~part.is_takeoff
    behind = flies & (goal <= 0.0)
    beyond = flies & ~behind & (turned > goal)
    share = np.where(behind, 0.0, np.where(beyond, goal / np.where(beyond, turned, 1.0), 1.0))
    end = np.where(beyond[:, None], ends_m, turns.end_m)
    end = np.where(behind[:, None], place_m, end)
    across = np.abs(end - place_m)
    slowest = min(parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    least_s = PEAK_OVER_MEAN * np.maximum(
        np.hypot(across[:, 0], across[:, 1]) / part.speed_m_s, across[:, 2] / slowest
    )
    along = np.maximum((velocity_m_s * part.direction).sum(axis=1), 0.0)
    turned_m_s = np.abs(velocity_m_s - part.direction * along[:, None])
    vertical = min(parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    accelerations = np.array([parameters.acceleration_m_s2] * 2 + [vertical])
    least_s = np.maximum(least_s, (turned_m_s / accelerations).max(axis=1))
    duration_s = turns.duration_s * share
    return (
        Turns(
            duration_s=np.where(beyond, np.maximum(duration_s, least_s), duration_s),
            end_m=end,
            speed_m_s=turns.speed_m_s,
            acceleration_m_s2=turns.acceleration_m_s2,
        ),
        np.where(behind[:, None], place_m, ends_m),
    )
