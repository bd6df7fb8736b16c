"""Turns: how PX4 gets from one leg to the next without stopping."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns
from planner.flight.motion.px4.moves import directions
from planner.flight.motion.px4.speeds import (
    STILL_M,
    Px4Ramps,
    braking_distance_m,
    ramp_time_s,
    vertical_limits,
)
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import PlannedLegs
    from planner.vehicle.parameters.px4 import Px4Parameters


ALIGNED_COS = 0.98
"""Cosine of the angle to the target from which a turn counts as done (``PositionSmoothing::_isTurning``)."""
SLOWEST_TURN_M_S = 0.2
"""Speed below which nothing is turned (``PositionSmoothing::_isTurning``). [m s⁻¹]"""
SHORTEST_L1_M = 5.0
"""Least distance of the point steered for on the new leg (``PositionSmoothing::_getL1Point``). [m]"""
CLAMPED_M_S = 0.5
"""Speed below which one axis is slowed alone (``clampToXYNorm``, ``clampToZNorm``). [m s⁻¹]"""
PEAK_OVER_MEAN = 1.5
"""Highest over mean speed of a cubic from rest to rest. [-]"""

_ALIGNED_RAD = math.acos(ALIGNED_COS)
_ALIGNED_SIN = math.sin(_ALIGNED_RAD)


class Turns(Columns, eq=False):
    """What is left of a turn when the vehicle heads for its target, as columns of length n."""

    duration_s: FloatArray
    """Zero where nothing is turned."""
    end_m: FloatArray
    """Place: east, north, height above home. (n, 3) [m]"""
    speed_m_s: FloatArray
    """Horizontal speed there, towards the target. [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    """Horizontal acceleration there, zero or more. [m s⁻²]"""


class TurnApproach(Columns, eq=False):
    """How vehicles come to the waypoints at which new legs begin, as columns of length n."""

    place_m: FloatArray
    """Where the new leg becomes the one flown. (n, 3) [m]"""
    velocity_m_s: FloatArray
    """Horizontal velocity there. (n, 2) [m s⁻¹]"""
    begins_m: FloatArray
    """Where the new leg begins: the waypoint left. (n, 3) [m]"""
    target_m: FloatArray
    """Where it ends. (n, 3) [m]"""
    radius_m: FloatArray
    """Acceptance radius of its target. [m]"""
    vertical_m_s: FloatArray
    """Greatest vertical speed of the new leg. [m s⁻¹]"""
    climb_m_s: FloatArray
    """Vertical velocity at the place, upwards positive. [m s⁻¹]"""
    vertical_m_s2: FloatArray
    """Vertical acceleration. [m s⁻²]"""


def corner_turns(approach: TurnApproach, *, acceleration_m_s2: float, jerk_m_s3: float) -> Turns:
    """Return the turns into new legs at MPC_ACC_HOR and MPC_JERK_AUTO.

    Notes
    -----
    ``PositionSmoothing::_generateVelocitySetpoint``: while the velocity is more than 11.5° off the
    target, the speed stays what it was and the vehicle steers for the point of the new leg that is
    max(r, 5 m) away.  The velocity swings there at limited jerk, each axis in the time of the slowest
    (``VelocitySmoothing::timeSynchronization``); from the distance y off the leg that point lies
    asin(y/l) to its side.  Where the swing alone does not turn far enough, y decays as e^(−v t/l) (the
    path is a tractrix) until it does.  Then the speed is free again, with the acceleration the swing
    has by then.
    """
    way = approach.target_m[:, :2] - approach.place_m[:, :2]
    distance = np.hypot(way[:, 0], way[:, 1])
    speed = np.hypot(approach.velocity_m_s[:, 0], approach.velocity_m_s[:, 1])
    along = np.divide(
        (way * approach.velocity_m_s).sum(axis=1),
        distance,
        out=np.zeros_like(speed),
        where=distance > STILL_M,
    )
    turning = (
        (speed > SLOWEST_TURN_M_S) & (along < ALIGNED_COS * speed) & (distance > approach.radius_m)
    )
    duration, acceleration = np.zeros_like(speed), np.zeros_like(speed)
    free_speed, end = np.maximum(along, 0.0), approach.place_m.copy()
    if turning.any():
        swung = _swings(
            approach.select(turning), acceleration_m_s2=acceleration_m_s2, jerk_m_s3=jerk_m_s3
        )
        duration[turning], acceleration[turning] = swung.duration_s, swung.acceleration_m_s2
        free_speed[turning], end[turning] = swung.speed_m_s, swung.end_m
    return Turns(
        duration_s=duration, end_m=end, speed_m_s=free_speed, acceleration_m_s2=acceleration
    )


class _LegFrame(Value, eq=False):
    """Coordinates along and across new legs; velocities across come out as zero or more."""

    along: FloatArray
    """Unit vectors. (n, 2)"""
    across: FloatArray
    length_m: FloatArray
    x_m: FloatArray
    """Place at which the leg becomes the one flown."""
    y_m: FloatArray
    cos_turn: FloatArray
    sin_turn: FloatArray
    speed_m_s: FloatArray

    @classmethod
    def of(cls, approach: TurnApproach) -> _LegFrame:
        """Return the frames of new legs."""
        leg = approach.target_m[:, :2] - approach.begins_m[:, :2]
        length = np.hypot(leg[:, 0], leg[:, 1])
        straight = approach.target_m[:, :2] - approach.place_m[:, :2]
        leg = np.where((length > STILL_M)[:, None], leg, straight)
        length = np.hypot(leg[:, 0], leg[:, 1])
        along = leg / length[:, None]
        velocity = approach.velocity_m_s
        speed = np.hypot(velocity[:, 0], velocity[:, 1])
        left = np.column_stack((-along[:, 1], along[:, 0]))
        sideways = (velocity * left).sum(axis=1)
        across = np.where((sideways < 0.0)[:, None], -left, left)
        offset = approach.place_m[:, :2] - approach.begins_m[:, :2]
        return cls(
            along=along,
            across=across,
            length_m=length,
            x_m=(offset * along).sum(axis=1),
            y_m=(offset * across).sum(axis=1),
            cos_turn=(velocity * along).sum(axis=1) / speed,
            sin_turn=np.abs(sideways) / speed,
            speed_m_s=speed,
        )

    def place_m(self, begins_m: FloatArray, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """Return places in the frame of home. (n, 2) [m]"""
        return begins_m[:, :2] + self.along * x_m[:, None] + self.across * y_m[:, None]


def _swings(approach: TurnApproach, *, acceleration_m_s2: float, jerk_m_s3: float) -> Turns:
    """Return the turns of vehicles that all turn."""
    frame = _LegFrame.of(approach)
    v, sin_turn, cos_turn = frame.speed_m_s, frame.sin_turn, frame.cos_turn
    l1 = np.maximum(approach.radius_m, SHORTEST_L1_M)
    height = approach.target_m[:, 2] - approach.place_m[:, 2]
    held = _held_speed_m_s(v, np.abs(height), l1, approach.vertical_m_s)
    rate = np.minimum(approach.vertical_m_s, held * np.abs(height) / l1)
    lift = np.abs(np.sign(height) * rate - approach.climb_m_s)
    jerk = np.full(len(v), jerk_m_s3)
    lift_s = ramp_time_s(lift, approach.vertical_m_s2, jerk)
    steered = np.clip(-frame.y_m / l1, -1.0, 1.0)
    for _ in range(2):
        # Towards the point steered for once the swing is over, which its own way decides.
        cos_steered = np.sqrt(1.0 - steered**2)
        swing = (held * cos_steered - v * cos_turn)[:, None] * frame.along + (
            held * steered - v * sin_turn
        )[:, None] * frame.across
        widest = np.abs(swing).max(axis=1)
        lifts = lift_s > ramp_time_s(widest, acceleration_m_s2, jerk)
        ramps = Px4Ramps.of(
            np.where(lifts, lift, widest),
            np.where(lifts, approach.vertical_m_s2, acceleration_m_s2),
            jerk,
        )
        time = ramps.duration_s
        y_swung = (frame.y_m + 0.5 * time * v * sin_turn) / (1.0 + 0.5 * time * held / l1)
        steered = np.clip(-y_swung / l1, -1.0, 1.0)
    x_swung = frame.x_m + 0.5 * time * (v * cos_turn + held * cos_steered)
    aligned = _ALIGNED_RAD + np.arctan2(-y_swung, np.maximum(frame.length_m - x_swung, l1))
    cos_steered = np.sqrt(1.0 - steered**2)

    # The swing is aligned at the fraction σ where (1 − σ) of the old and σ of the new velocity
    # together point along φ: (1 − σ) v sin(θ − φ) = σ v' sin(φ − β).
    cos_aligned, sin_aligned = np.cos(aligned), np.sin(aligned)
    old = np.maximum(v * (sin_turn * cos_aligned - cos_turn * sin_aligned), 0.0)
    new = held * (sin_aligned * cos_steered - cos_aligned * steered)
    swings_enough = new > 0.0
    fraction = np.where(swings_enough, old / np.where(swings_enough, old + new, 1.0), 1.0)
    until = ramps.time_at_s(fraction)
    way, gained, rate = ramps.gained(until)
    change = np.where(ramps.change_m_s > 0.0, ramps.change_m_s, 1.0)
    share, share_way = gained / change, way / change
    along_change = held * cos_steered - v * cos_turn
    x = frame.x_m + v * cos_turn * until + along_change * share_way
    y = frame.y_m + v * sin_turn * until + (held * steered - v * sin_turn) * share_way
    # Aligned, the velocity is still 11.5° off the target; what leads there is kept, the rest dies away.
    sideways = v * sin_turn + (held * steered - v * sin_turn) * share
    swung = np.hypot(v * cos_turn + along_change * share, sideways)
    free = ALIGNED_COS * np.where(swings_enough, swung, held)

    # The rest of the way, where it takes longer, along the tractrix.
    late = ~swings_enough & (steered > sin_aligned)
    ratio = np.where(late, steered / np.where(late, sin_aligned, 1.0), 1.0)
    decay_s = l1 / held * np.log(ratio)
    half_angles = np.where(
        late, np.tan(0.5 * np.arcsin(steered)) / np.tan(0.5 * np.where(late, aligned, 1.0)), 1.0
    )
    x += np.where(late, l1 * (np.log(half_angles) + cos_steered - cos_aligned), 0.0)
    y = np.where(late, y / ratio, y)
    last = np.where(swings_enough, swung, held)
    over_s = _ALIGNED_SIN * last / acceleration_m_s2
    ahead_m = np.maximum(frame.length_m - x, l1)
    ahead_m, aside_m = _straightened_m(last, free, over_s, ahead_m=ahead_m, aside_m=-y)
    duration = until + decay_s + over_s
    climbed = _climbed_m(approach, held, l1, duration_s=duration, swing_s=time)
    end = np.column_stack(
        (
            frame.place_m(approach.begins_m, x + ahead_m, y + aside_m),
            approach.place_m[:, 2] + climbed,
        )
    )
    return Turns(
        duration_s=duration,
        end_m=end,
        speed_m_s=np.maximum(free, 0.0),
        acceleration_m_s2=np.maximum(np.where(late, 0.0, along_change / change * rate), 0.0),
    )


def _straightened_m(
    last_m_s: FloatArray,
    free_m_s: FloatArray,
    time_s: FloatArray,
    *,
    ahead_m: FloatArray,
    aside_m: FloatArray,
) -> tuple[FloatArray, FloatArray]:
    """Return the ways, along and across, in which what is across the way to the target dies away.

    Aligned, that is still the sine of 11.5° of the speed; it takes full acceleration, as the target is
    headed for.
    """
    way = np.hypot(ahead_m, aside_m)
    ahead, aside = ahead_m / way, aside_m / way
    along = ALIGNED_COS * last_m_s + free_m_s
    across = _ALIGNED_SIN * last_m_s
    half_s = 0.5 * time_s
    return (half_s * (along * ahead - across * aside), half_s * (along * aside + across * ahead))


def _held_speed_m_s(
    speed_m_s: FloatArray, height_m: FloatArray, l1_m: FloatArray, vertical_m_s: FloatArray
) -> FloatArray:
    """Return the horizontal speed kept in a turn onto a leg that climbs or descends.

    The point steered for has the height of the target already: towards it the way is steeper than the
    leg, and the vertical limit slows both axes.
    """
    steep = height_m / l1_m
    slowed = np.minimum(
        speed_m_s,
        np.divide(vertical_m_s, steep, out=np.full_like(steep, np.inf), where=steep > STILL_M),
    )
    return np.where(speed_m_s * steep < CLAMPED_M_S, speed_m_s, slowed)


def _climbed_m(
    approach: TurnApproach,
    held_m_s: FloatArray,
    l1_m: FloatArray,
    *,
    duration_s: FloatArray,
    swing_s: FloatArray,
) -> FloatArray:
    """Return the heights gained in turns, upwards positive.

    The vertical speed changes in the time of the swing.  It is flown as one cubic, whose highest speed
    is half as much again as its mean less a quarter of that at its beginning; it keeps to the limit.
    """
    height = approach.target_m[:, 2] - approach.place_m[:, 2]
    upward = np.sign(height)
    begun, limit = upward * approach.climb_m_s, approach.vertical_m_s
    rate = np.minimum(limit, held_m_s * np.abs(height) / l1_m)
    swung_s = np.minimum(duration_s, swing_s)
    share = swung_s / np.maximum(swing_s, 1e-9)
    gained = swung_s * (begun + 0.5 * share * (rate - begun)) + rate * (duration_s - swung_s)
    most = duration_s * (limit + 0.25 * np.maximum(begun, 0.0)) / PEAK_OVER_MEAN
    climbed: FloatArray = upward * np.minimum(np.minimum(gained, most), np.abs(height))
    return climbed


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


def leg_entries(
    part: PlannedLegs, place_m: FloatArray, velocity_m_s: FloatArray, parameters: Px4Parameters
) -> Turns:
    """Return the turns onto moves; where a heading is waited for, the braking and the wait."""
    vertical, lift = vertical_limits(part.target_m[:, 2] > place_m[:, 2], parameters)
    turns = corner_turns(
        TurnApproach(
            place_m=place_m,
            velocity_m_s=velocity_m_s[:, :2],
            begins_m=part.begins_m,
            target_m=part.target_m,
            radius_m=part.radius_m,
            vertical_m_s=vertical,
            climb_m_s=velocity_m_s[:, 2],
            vertical_m_s2=lift,
        ),
        acceleration_m_s2=parameters.acceleration_m_s2,
        jerk_m_s3=parameters.jerk_m_s3,
    )
    idle = part.stands | part.is_takeoff | ~part.is_leg
    pausing = part.pause_s > 0.0
    if not (idle | pausing).any():
        return turns
    speed = np.hypot(velocity_m_s[:, 0], velocity_m_s[:, 1])
    braking_s = ramp_time_s(speed, parameters.acceleration_m_s2, parameters.jerk_m_s3)
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
    part: PlannedLegs,
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
    limit, vertical = vertical_limits(way[:, 2] > 0.0, parameters)
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
    begun = np.clip(np.sign(way[:, 2]) * velocity_m_s[:, 2], -limit, limit)
    jerk = parameters.jerk_m_s3
    time = np.maximum(
        ramp_time_s(turns.speed_m_s - after, parameters.acceleration_m_s2, jerk),
        ramp_time_s(np.abs(reached - begun), vertical, jerk),
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
    part: PlannedLegs,
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
    direction, length = directions(way)
    level, upright = np.hypot(direction[:, 0], direction[:, 1]), np.abs(direction[:, 2])
    shallow = level >= upright
    projected = np.maximum((velocity_m_s * direction).sum(axis=1), 0.0)
    speed = np.where(
        shallow, turns.speed_m_s / np.where(shallow & (level > 0.0), level, 1.0), projected
    )
    speed = speed * share
    change = np.abs(direction * speed[:, None] - velocity_m_s)
    climb, vertical = vertical_limits(direction[:, 2] > 0.0, parameters)
    jerk = parameters.jerk_m_s3
    time = np.maximum(
        ramp_time_s(change[:, :2].max(axis=1), parameters.acceleration_m_s2, jerk),
        ramp_time_s(change[:, 2], vertical, jerk),
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
        np.divide(climb, upright, out=np.full_like(level, np.inf), where=upright > 0.0),
    )
    growing = np.minimum(time, parameters.acceleration_m_s2 / parameters.jerk_m_s3)
    growing = np.minimum(growing, np.sqrt(np.maximum(limit - speed, 0.0) / parameters.jerk_m_s3))
    # It must be allowed by the way left once the acceleration is taken back.
    settled = speed + jerk * growing**2
    left = length + part.tail_m - settled * (time + growing)
    level_reach = braking_distance_m(
        settled * level, part.final_level_m_s, parameters.acceleration_m_s2, jerk
    )
    upright_reach = braking_distance_m(settled * upright, part.final_upright_m_s, vertical, jerk)
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
    part: PlannedLegs,
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
