"""Turns: how PX4 gets from one leg to the next without stopping."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns, dot, greatest, horizontal, lengths, quotient
from planner.flight.motion.px4.braking import (
    CLAMPED_M_S,
    STILL_M,
    Px4Ramps,
    allowed_speed_m_s,
    ramp_time_s,
    turning_back,
    vertical_limits,
)
from planner.flight.motion.px4.moves import SHORTEST_L1_M, SLOWEST_TURN_M_S, directions
from planner.flight.motion.px4.straights import limits_along, make_rises
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import LegStarts
    from planner.vehicle.parameters.px4 import Px4Parameters


ALIGNED_COS = 0.98
"""Cosine of the angle to the target from which a turn counts as done (``PositionSmoothing::_isTurning``)."""
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
    """Acceleration there, zero or more: horizontal after a turn, along the leg after a reversal. [m s⁻²]"""


def corner_turns(begun: LegStarts) -> Turns:
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
    way = (begun.planned.target_m - begun.place_m)[:, :2]
    velocity = begun.velocity_m_s[:, :2]
    distance, speed = horizontal(way), horizontal(velocity)
    along = quotient(dot(way, velocity), distance, above=STILL_M)
    turning = (speed > SLOWEST_TURN_M_S) & (along < ALIGNED_COS * speed)
    turning &= distance > begun.planned.radius_m
    turns = Turns(
        duration_s=np.zeros_like(speed),
        end_m=begun.place_m.copy(),
        speed_m_s=np.maximum(along, 0.0),
        acceleration_m_s2=np.zeros_like(speed),
    )
    if turning.any():
        led, held_m_s, lead_s = _led_in(begun.select(turning))
        approached, before_s = _approached(led)
        swung = _swings(approached, held_m_s)
        duration_s = np.maximum(swung.duration_s + before_s - lead_s, 0.0)
        turns.put(turning, replace(swung, duration_s=duration_s))
    return turns


def _led_in(begun: LegStarts) -> tuple[LegStarts, FloatArray, FloatArray]:
    """Return vehicles as they would have begun to turn back without a deceleration, and by how much sooner.

    And the speeds held in the turns: what the way left allowed, which a deceleration trails.  What of it
    points along the new leg, −cos θ of it for a turn θ beyond the right angle, is part of the swing already.
    """
    parameters = begun.parameters
    velocity = begun.velocity_m_s[:, :2]
    way = (begun.planned.target_m - begun.place_m)[:, :2]
    speed = horizontal(velocity)
    backward = np.maximum(-quotient(dot(velocity, way), speed * horizontal(way)), 0.0)
    slowing = begun.slowing_m_s2 * backward
    lead_s = slowing / parameters.jerk_m_s3
    trailed_m_s = 0.5 * slowing * lead_s
    sooner_m_s = speed + trailed_m_s
    before_m = lead_s * (sooner_m_s - slowing * lead_s / 6.0)
    heading = quotient(velocity, speed[:, None])
    place, faster = begun.place_m.copy(), begun.velocity_m_s.copy()
    place[:, :2] -= heading * before_m[:, None]
    faster[:, :2] = heading * sooner_m_s[:, None]
    held = np.maximum(speed - trailed_m_s, SLOWEST_TURN_M_S)
    return replace(begun, place_m=place, velocity_m_s=faster), held, lead_s


def _approached(begun: LegStarts) -> tuple[LegStarts, FloatArray]:
    """Return vehicles that all turn where they begin to turn onto their legs, and the times until then.

    Farther off than l, ``PositionSmoothing::_getL1Point`` has no point of the leg in reach, and the one
    nearest to the vehicle is steered for: straight at the leg, as after a waypoint that counts as reached
    from farther away than the next.  From l on that point moves aside, in l/v; the velocity, which takes T
    to swing onto the leg, follows at once where T is shorter, else in the mean l/2v later.
    """
    parameters = begun.parameters
    frame, l1 = _LegFrame.of(begun), np.maximum(begun.planned.radius_m, SHORTEST_L1_M)
    v, side = frame.speed_m_s, -np.sign(frame.y_m)
    along, across = -v * frame.cos_turn, v * (side - frame.sin_turn)
    change = along[:, None] * frame.along + across[:, None] * frame.across
    onto = frame.along - side[:, None] * frame.across
    swing_s, onto_s = (
        ramp_time_s(greatest(np.abs(by)), parameters.acceleration_m_s2, parameters.jerk_m_s3)
        for by in (change, v[:, None] * onto)
    )
    l1 *= 1.0 - 0.5 * np.maximum(1.0 - l1 / (v * onto_s), 0.0)
    x = frame.x_m - 0.5 * along * swing_s
    y = frame.y_m + 0.5 * swing_s * v * (side + frame.sin_turn)
    left = -y * side - l1
    # Aligned with the target already, it is flown to straight.
    far = (left > 0.0) & (frame.length_m - x > _ALIGNED_SIN / ALIGNED_COS * (left + l1))
    if not far.any():
        return begun, np.zeros_like(v)
    place, velocity = begun.place_m.copy(), begun.velocity_m_s.copy()
    there = frame.place_m(begun.planned.begins_m, x, -side * l1)
    place[:, :2] = np.where(far[:, None], there, place[:, :2])
    straight = frame.across * (v * side)[:, None]
    velocity[:, :2] = np.where(far[:, None], straight, velocity[:, :2])
    before_s = np.where(far, swing_s + left / v, 0.0)
    return replace(begun, place_m=place, velocity_m_s=velocity), before_s


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
    def of(cls, begun: LegStarts) -> _LegFrame:
        """Return the frames of new legs."""
        begins, target = begun.planned.begins_m[:, :2], begun.planned.target_m[:, :2]
        place, velocity = begun.place_m[:, :2], begun.velocity_m_s[:, :2]
        leg = target - begins
        leg = np.where((horizontal(leg) > STILL_M)[:, None], leg, target - place)
        length, speed = horizontal(leg), horizontal(velocity)
        along = leg / length[:, None]
        left = np.column_stack((-along[:, 1], along[:, 0]))
        sideways = dot(velocity, left)
        across = np.where((sideways < 0.0)[:, None], -left, left)
        offset = place - begins
        return cls(
            along=along,
            across=across,
            length_m=length,
            x_m=dot(offset, along),
            y_m=dot(offset, across),
            cos_turn=dot(velocity, along) / speed,
            sin_turn=np.abs(sideways) / speed,
            speed_m_s=speed,
        )

    def place_m(self, begins_m: FloatArray, x_m: FloatArray, y_m: FloatArray) -> FloatArray:
        """Return places in the frame of home. (n, 2) [m]"""
        return begins_m[:, :2] + self.along * x_m[:, None] + self.across * y_m[:, None]


def _swings(begun: LegStarts, held_m_s: FloatArray) -> Turns:
    """Return the turns of vehicles that all turn, to the speeds that are held in them."""
    parameters, frame = begun.parameters, _LegFrame.of(begun)
    l1, most_m_s2 = np.maximum(begun.planned.radius_m, SHORTEST_L1_M), parameters.acceleration_m_s2
    v, sin_turn, cos_turn = frame.speed_m_s, frame.sin_turn, frame.cos_turn
    height = begun.planned.target_m[:, 2] - begun.place_m[:, 2]
    vertical_m_s, vertical_m_s2 = vertical_limits(height > 0.0, parameters)
    # The point steered for lies on the leg, and is as much higher as the leg has risen by there.
    rise = np.abs(begun.planned.target_m[:, 2] - begun.planned.begins_m[:, 2])
    steep = quotient(rise, frame.length_m, np.abs(height) / l1, above=STILL_M)
    held = _held_speed_m_s(held_m_s, steep, vertical_m_s)
    rate = np.minimum(vertical_m_s, held * steep)
    lift = np.abs(np.sign(height) * rate - begun.velocity_m_s[:, 2])
    jerk = np.full(len(v), parameters.jerk_m_s3)
    steered = np.clip(-frame.y_m / l1, -1.0, 1.0)
    for _ in range(2):
        # Towards the point steered for once the swing is over, which its own way decides.
        cos_steered = np.sqrt(1.0 - steered**2)
        swing = (held * cos_steered - v * cos_turn)[:, None] * frame.along + (
            held * steered - v * sin_turn
        )[:, None] * frame.across
        widest = greatest(np.abs(swing))
        lifts = ramp_time_s(lift, vertical_m_s2, jerk) > ramp_time_s(widest, most_m_s2, jerk)
        ramps = Px4Ramps.of(
            np.where(lifts, lift, widest), np.where(lifts, vertical_m_s2, most_m_s2), jerk
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
    way, gained, gained_m_s2 = ramps.gained(until)
    change = np.where(ramps.change_m_s > 0.0, ramps.change_m_s, 1.0)
    along_change, across_change = held * cos_steered - v * cos_turn, held * steered - v * sin_turn
    part, part_s = gained / change, way / change
    x = frame.x_m + v * cos_turn * until + along_change * part_s
    y = frame.y_m + v * sin_turn * until + across_change * part_s
    # Aligned, the velocity is still 11.5° off the target; what leads there is kept, the rest dies away.
    swung = np.hypot(v * cos_turn + along_change * part, v * sin_turn + across_change * part)
    last = np.where(swings_enough, swung, held)

    # The rest of the way, where it takes longer, as the point steered for leads.
    late = ~swings_enough & (steered > sin_aligned)
    ahead, off = np.maximum(frame.length_m - x, l1), -y
    led_s, led_x, led_y = _led(
        np.where(late, steered, sin_aligned), l1, held, parameters, ahead_m=ahead, off_m=off
    )
    x, y = x + np.where(late, led_x, 0.0), y + np.where(late, led_y, 0.0)
    # Along and across the way to the target: what is across it takes full acceleration to die away.
    over_s = _ALIGNED_SIN * last / most_m_s2
    ahead, aside = np.maximum(frame.length_m - x, l1), -y
    ahead, aside = ahead / np.hypot(ahead, aside), aside / np.hypot(ahead, aside)
    x += 0.5 * over_s * (2.0 * ALIGNED_COS * last * ahead - _ALIGNED_SIN * last * aside)
    y += 0.5 * over_s * (2.0 * ALIGNED_COS * last * aside + _ALIGNED_SIN * last * ahead)
    duration = until + np.where(late, led_s, 0.0) + over_s

    upward = np.sign(height)
    climbed = upward * np.minimum(
        _climbed_m(upward * begun.velocity_m_s[:, 2], rate, vertical_m_s, duration, swing_s=time),
        np.abs(height),
    )
    return Turns(
        duration_s=duration,
        end_m=np.column_stack(
            (frame.place_m(begun.planned.begins_m, x, y), begun.place_m[:, 2] + climbed)
        ),
        speed_m_s=np.maximum(ALIGNED_COS * last, 0.0),
        acceleration_m_s2=np.maximum(np.where(late, 0.0, along_change / change * gained_m_s2), 0.0),
    )


def _led(
    sin_steered: FloatArray,
    l1_m: FloatArray,
    speed_m_s: FloatArray,
    parameters: Px4Parameters,
    *,
    ahead_m: FloatArray,
    off_m: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return how vehicles headed for a point of the leg l away turn until aligned with the target.

    Times, and ways along and across their legs, for the target ``ahead_m`` and ``off_m`` from them.  The
    path is a tractrix, y = l sin β, to where the velocity, β off the leg, is 11.5° off the target; at
    speeds too high for it the velocity swings there at limited jerk, and beyond the leg.
    """
    sin_aligned = np.ones_like(off_m)
    for _ in range(3):
        aside = np.clip(off_m, 0.0, l1_m * sin_aligned)
        sin_aligned = np.sin(_ALIGNED_RAD + np.arctan2(aside, ahead_m))
    first = np.arcsin(np.maximum(sin_steered, sin_aligned))
    last = np.minimum(np.arcsin(sin_aligned), first)
    cosines, sines = (np.cos(first), np.cos(last)), (np.sin(first), np.sin(last))
    time_s = l1_m / speed_m_s * np.log(sines[0] / sines[1])
    along = np.log(np.tan(0.5 * first) / np.tan(0.5 * last)) + cosines[0] - cosines[1]
    change = speed_m_s * np.maximum(sines[0] - sines[1], cosines[1] - cosines[0])
    swing_s = ramp_time_s(change, parameters.acceleration_m_s2, parameters.jerk_m_s3)
    fast, swung_m = swing_s > time_s, 0.5 * swing_s * speed_m_s
    return (
        np.where(fast, swing_s, time_s),
        np.where(fast, swung_m * (cosines[0] + cosines[1]), l1_m * along),
        np.where(fast, swung_m * (sines[0] + sines[1]), off_m * (1.0 - sines[1] / sines[0])),
    )


def _climbed_m(
    begun_m_s: FloatArray,
    rate_m_s: FloatArray,
    limit_m_s: FloatArray,
    duration_s: FloatArray,
    *,
    swing_s: FloatArray,
) -> FloatArray:
    """Return the heights gained in turns.

    The vertical speed changes in the time of the swing.  It is flown as one cubic, whose highest speed
    is half as much again as its mean less a quarter of that at its beginning; it keeps to the limit.
    """
    swung_s = np.minimum(duration_s, swing_s)
    grown = 0.5 * swung_s / np.maximum(swing_s, 1e-9) * (rate_m_s - begun_m_s)
    gained = swung_s * (begun_m_s + grown) + rate_m_s * (duration_s - swung_s)
    most = duration_s * (limit_m_s + 0.25 * np.maximum(begun_m_s, 0.0)) / PEAK_OVER_MEAN
    return np.asarray(np.minimum(gained, most))


def _held_speed_m_s(
    speed_m_s: FloatArray, steepness: FloatArray, vertical_m_s: FloatArray
) -> FloatArray:
    """Return the horizontal speed kept in a turn onto a leg that climbs or descends.

    The vertical limit slows both axes, as on the leg.
    """
    slowed = np.minimum(speed_m_s, quotient(vertical_m_s, steepness, np.inf, above=STILL_M))
    return np.where(speed_m_s * steepness < CLAMPED_M_S, speed_m_s, slowed)


_SHORTEST_JOIN_S = 0.1
"""Changes of velocity that take less are taken at once: 0.01 m/s. [s]"""
_SHORTEST_EASE_S = 0.02
"""Decelerations taken back in less change the speed by less than a millimetre a second. [s]"""
_NEARLY_STRAIGHT = 2.0 * ALIGNED_COS**2 - 1.0
"""Cosine of twice the angle at which a turn counts as done: a turn by less is little more than a join."""
_MOSTLY = 0.999
"""Part of a velocity along a leg that is all of it: 2.6°. [-]"""
_LONGEST_JOIN = 0.5
"""Part of a leg beyond which it is too short to be joined at its speed. [-]"""
_LONGEST_SLOW_JOIN = 0.9
"""The same of joins at less than that. [-]"""
_LEAST_FRACTION = 0.1
"""Of the speed, below which a leg is joined at once. [-]"""


_HALVINGS = 10
"""Of a range of speeds, to a thousandth of it."""
_GROWTH_ROUNDS = 2
"""Each lets the time of a join and the speed reached in it agree more closely."""


def leg_entries(begun: LegStarts) -> Turns:
    """Return the turns onto moves; where a heading is waited for, the braking and the wait."""
    parameters = begun.parameters
    turns, part = corner_turns(begun), begun.planned
    idle = part.is_wait | part.is_takeoff | ~part.is_leg
    pausing = part.pause_s > 0.0
    still = idle | pausing
    if not still.any():
        return turns
    braking_s = ramp_time_s(
        horizontal(begun.velocity_m_s), parameters.acceleration_m_s2, parameters.jerk_m_s3
    )
    stopped = begun.place_m + 0.5 * braking_s[:, None] * begun.velocity_m_s * (1.0, 1.0, 0.0)
    end = np.where(pausing[:, None], stopped, turns.end_m)
    duration = np.where(pausing, np.maximum(part.pause_s, braking_s), turns.duration_s)
    return Turns(
        duration_s=np.where(idle, 0.0, duration),
        end_m=np.where(idle[:, None], begun.place_m, end),
        speed_m_s=np.where(still, 0.0, turns.speed_m_s),
        acceleration_m_s2=np.where(still, 0.0, turns.acceleration_m_s2),
    )


def slowed_turns(begun: LegStarts, turns: Turns) -> tuple[Turns, FloatArray]:
    """Return turns onto legs too steep for the speed they are begun with, and the vertical speeds reached.

    Without a turn, the horizontal speed falls to what the vertical limit leaves, or to that of the leg,
    while the vertical one comes to what goes with it, both in the time of the slower; or to less, where
    the leg is too low for that (`_reached_m_s`).  So it does on legs that climb more than they are long,
    or within the acceptance radius, where the height alone is waited for.  Of all other legs the vertical
    speed is 0. [m s⁻¹]
    """
    parameters = begun.parameters
    part, place, velocity = begun.planned, begun.place_m, begun.velocity_m_s
    way = part.target_m - place
    level, height, upward = horizontal(way), np.abs(way[:, 2]), np.sign(way[:, 2])
    limit, vertical = vertical_limits(way[:, 2] > 0.0, parameters)
    left = quotient(limit * level, height, np.inf, above=STILL_M)
    slows = part.is_leg & ~part.is_takeoff & (turns.duration_s == 0.0) & (part.pause_s == 0.0)
    # Within the acceptance radius, as over the waypoint before.
    near = (level < part.reach_m + STILL_M) | (horizontal(part.target_m - part.begins_m) < STILL_M)
    near &= height > parameters.altitude_acceptance_m
    steep = ((height > level) | near) & (horizontal(velocity) > SLOWEST_TURN_M_S)
    slows &= (left < turns.speed_m_s) | steep
    if slows.any():
        sight = _Sight.of(begun, directions(way)[0], turns.speed_m_s, turns.speed_m_s)
        slows &= ~sight.counts | near
    upright_m_s = np.zeros_like(height)
    rows = np.flatnonzero(slows)
    if not len(rows):
        return turns, upright_m_s
    level, height, upward = level[rows], height[rows], upward[rows]
    limit, vertical, velocity = limit[rows], vertical[rows], velocity[rows]
    first_m_s, climbing = turns.speed_m_s[rows], np.minimum(upward * velocity[:, 2], limit)
    after = np.minimum(left, part.speed_m_s)[rows]
    whole = np.minimum(limit, quotient(after * height, level, limit, above=STILL_M))
    reached = _reached_m_s(
        height,
        climbing,
        whole,
        part.final_upright_m_s[rows],
        acceleration_m_s2=vertical,
        jerk_m_s3=parameters.jerk_m_s3,
    )
    upright_m_s[rows] = reached
    after = np.minimum(after * quotient(reached, whole), first_m_s)
    time = np.maximum(
        ramp_time_s(first_m_s - after, parameters.acceleration_m_s2, parameters.jerk_m_s3),
        ramp_time_s(np.abs(reached - climbing), vertical, parameters.jerk_m_s3),
    )
    speed = horizontal(velocity)
    along = velocity / np.where(speed > 0.0, speed, 1.0)[:, None]
    end = place[rows] + along * (0.5 * (first_m_s + after) * time)[:, None]
    end[:, 2] = place[rows, 2] + upward * 0.5 * (climbing + reached) * time
    slowed = turns.select(np.arange(len(slows)))
    slowed.put(
        rows,
        Turns(duration_s=time, end_m=end, speed_m_s=after, acceleration_m_s2=np.zeros_like(time)),
    )
    return slowed, upright_m_s


def _reached_m_s(
    height_m: FloatArray,
    begun_m_s: FloatArray,
    limit_m_s: FloatArray,
    final_m_s: FloatArray,
    *,
    acceleration_m_s2: FloatArray,
    jerk_m_s3: float,
) -> FloatArray:
    """Return the vertical speeds that climbs and descents of heights grow to. (n,) [m s⁻¹]

    Their acceleration falls from where it would lead to more than the way left allows
    (``VelocitySmoothing``): the speed it leads to is that allowed there, and more than allowed where it is
    reached.
    """
    least, most = np.minimum(begun_m_s, limit_m_s), limit_m_s
    for _ in range(_HALVINGS):
        middle = 0.5 * (least + most)
        ramps = Px4Ramps.of(
            np.maximum(middle - begun_m_s, 0.0), acceleration_m_s2, np.full_like(middle, jerk_m_s3)
        )
        growing_s = ramps.jerk_s + ramps.steady_s
        way = begun_m_s * growing_s + ramps.gained(growing_s)[0]
        left_m = np.maximum(height_m - way, 0.0)
        allowed = allowed_speed_m_s(left_m, final_m_s, acceleration_m_s2, jerk_m_s3)
        is_allowed = middle < allowed
        least, most = np.where(is_allowed, middle, least), np.where(is_allowed, most, middle)
    return np.asarray(most)


def joined_turns(
    begun: LegStarts,
    turns: Turns,
    slowed: BoolArray,
    *,
    fraction: float = 1.0,
    reached_m_s: FloatArray | None = None,
    rounds: int = _GROWTH_ROUNDS,
) -> Turns:
    """Return turns by which legs that need none are joined: nothing changes its velocity at once.

    What is across the new leg, up to 11.5° of the velocity and what is left of a climb, dies away at
    limited jerk, each axis in the time of the slowest, while the speed along the leg begins to grow.
    A climb that becomes a descent is one change of speed (``VelocitySmoothing::computeDirection``): it
    joins the leg at rest, with the acceleration it has by then.  Legs too short for that are joined at a
    fraction of the speed.
    """
    parameters = begun.parameters
    part, place, velocity = begun.planned, begun.place_m, begun.velocity_m_s
    direction, length = directions(part.ends_m - place)
    reached_m_s = turns.speed_m_s if reached_m_s is None else reached_m_s
    sight = _Sight.of(begun, direction, turns.speed_m_s, reached_m_s)
    direction, level_m_s = sight.direction, np.minimum(turns.speed_m_s, sight.speed_m_s)
    level, upright = horizontal(direction), np.abs(direction[:, 2])
    shallow = level >= upright
    projected = np.maximum(dot(velocity, direction), 0.0)
    speed = np.where(shallow, level_m_s / np.where(shallow & (level > 0.0), level, 1.0), projected)
    speed = speed * fraction
    change = np.abs(direction * speed[:, None] - velocity)
    _, vertical = vertical_limits(direction[:, 2] > 0.0, parameters)
    acceleration, jerk = parameters.acceleration_m_s2, parameters.jerk_m_s3
    level_s = ramp_time_s(greatest(change[:, :2]), acceleration, jerk)
    lift = np.where(
        shallow & (fraction == 1.0),
        direction[:, 2] * quotient(np.maximum(sight.speed_m_s, level_m_s), level) - velocity[:, 2],
        change[:, 2],
    )
    lift_s = ramp_time_s(np.abs(lift), vertical, jerk)
    time = np.maximum(level_s, lift_s)
    straight = (turns.duration_s == 0.0) | (
        (turns.duration_s < time) & (projected > _NEARLY_STRAIGHT * lengths(velocity))
    )
    joins = part.is_leg & ~part.is_takeoff & straight & ~slowed & (part.pause_s == 0.0)
    joins &= (time > _SHORTEST_JOIN_S) & (length > 0.0)
    if not joins.any():
        return turns
    # A turn holds the whole speed, of which only a part leads along the leg as it begins.
    turned_m_s = quotient(horizontal(velocity), level)
    join = _Join(
        way_m=direction * length[:, None],
        speed_m_s=speed,
        time_s=time,
        held_m_s=np.where(shallow & (turns.duration_s > 0.0), np.maximum(speed, turned_m_s), speed),
        held_s=np.minimum(turns.duration_s, time),
        is_paced=lift_s > level_s,
    )
    along = _Headway.of(begun, join, grows=joins & shallow & (fraction == 1.0))
    after = along.speed_m_s
    aside = velocity - direction * speed[:, None]
    end = place + direction * along.way_m[:, None] + 0.5 * aside * time[:, None]
    backward = -dot(velocity, direction)
    reverses = joins & ~shallow & (backward > _MOSTLY * lengths(velocity))
    back_m, back_s = turning_back(np.where(reverses, backward, 0.0), vertical, jerk)
    end = np.where(reverses[:, None], place - direction * back_m[:, None], end)
    time = np.where(reverses, back_s, time)
    turned_m_s2 = np.minimum(vertical, np.sqrt(2.0 * jerk * np.where(reverses, backward, 0.0)))
    # A height that changes its way leaves the speed along the leg as it is.
    lifts = shallow & (lift_s > level_s)
    longest = np.where(lifts | (fraction < 1.0), _LONGEST_SLOW_JOIN, _LONGEST_JOIN)
    ahead_m = np.where(reverses, dot(end - place, direction), along.way_m)
    kept_m = np.where(reverses, ahead_m, speed * time)
    fits = (kept_m < longest * length) & (ahead_m < _LONGEST_SLOW_JOIN * length)
    short = np.flatnonzero(joins & ~fits)
    joins &= fits
    joined = Turns(
        duration_s=np.where(joins, time, turns.duration_s),
        end_m=np.where(joins[:, None], end, turns.end_m),
        speed_m_s=np.where(joins & shallow, after * level, turns.speed_m_s),
        acceleration_m_s2=np.select(
            [joins & shallow, joins & reverses],
            [along.acceleration_m_s2 * level, turned_m_s2],
            turns.acceleration_m_s2,
        ),
    )
    # A climb that grows with the speed along the leg takes the longer to change.
    growing = (
        np.flatnonzero(joins & lifts & sight.counts & (after > speed)) if rounds else short[:0]
    )
    if len(growing) and fraction == 1.0:
        joined.put(
            growing,
            joined_turns(
                begun.select(growing),
                turns.select(growing),
                slowed[growing],
                reached_m_s=(after * level)[growing],
                rounds=rounds - 1,
            ),
        )
    if len(short) and fraction > _LEAST_FRACTION:
        some, turns_left = begun.select(short), turns.select(short)
        slower = joined_turns(some, turns_left, slowed[short], fraction=0.5 * fraction)
        joined.put(short, slower)
    return joined


class _Join(Columns, eq=False):
    """What n legs are joined with, while what is across them dies away."""

    way_m: FloatArray
    """To the end of the leg. (n, 3)"""
    speed_m_s: FloatArray
    """Along the leg, as it begins."""
    time_s: FloatArray
    held_m_s: FloatArray
    """What a turn holds, for so long."""
    held_s: FloatArray
    is_paced: BoolArray
    """Whether the climb takes longer than what is level: it sets the time of all axes."""


class _Headway(Value, eq=False):
    """How far legs have got along themselves in the time of a join."""

    way_m: FloatArray
    speed_m_s: FloatArray
    acceleration_m_s2: FloatArray
    """Zero or more."""

    @classmethod
    def of(cls, begun: LegStarts, join: _Join, *, grows: BoolArray) -> _Headway:
        """Return the headway along the ways that are left, begun with speeds along them.

        What is across a leg changes beside what is along it: there a deceleration that the leg is begun
        with is taken back, and the speed goes on as on a leg that needs no join, once a turn is over that
        holds it.  Others keep their speed.
        """
        parameters = begun.parameters
        headway = cls(
            way_m=join.speed_m_s * join.time_s,
            speed_m_s=join.speed_m_s.copy(),
            acceleration_m_s2=np.zeros_like(join.speed_m_s),
        )
        rows = np.flatnonzero(grows)
        if not len(rows):
            return headway
        part, place, jerk = begun.planned.select(rows), begun.place_m[rows], parameters.jerk_m_s3
        join = join.select(rows)
        speed, time, units = join.held_m_s, join.time_s, _units(join.way_m)
        slowing = np.minimum(begun.slowing_m_s2[rows], np.sqrt(2.0 * jerk * speed))
        slowing = np.minimum(slowing, jerk * time)
        slowed_s = slowing / jerk
        slowed_m = slowed_s * (speed - slowing * slowed_s / 3.0)
        begun_m_s = speed - 0.5 * slowing * slowed_s
        slowed_m += begun_m_s * np.maximum(join.held_s - slowed_s, 0.0)
        slowed_s = np.maximum(slowed_s, join.held_s)
        limits = limits_along(place + units * slowed_m[:, None], place + join.way_m, part)
        rises = make_rises(limits, begun_m_s, np.zeros_like(begun_m_s))
        ramps, left_s = rises.ramps(limits), time - slowed_s
        ramp_s = np.minimum(left_s, ramps.duration_s)
        grown_m, grown_m_s, grown_m_s2 = ramps.gained(ramp_s)
        faster = np.sign(rises.peak_m_s - begun_m_s)
        reached = begun_m_s + faster * grown_m_s
        far = slowed_m + begun_m_s * ramp_s + faster * grown_m
        length = lengths(join.way_m) + part.tail_m
        # From the top of the ramp on it keeps its speed until the way left allows no more.
        kept_m = np.maximum(length - far - limits.laws.reach_m(reached), 0.0)
        kept_s = np.minimum(left_s - ramp_s, quotient(kept_m, reached))
        far, braked_s, last = far + kept_s * reached, left_s - ramp_s - kept_s, reached
        evenly = join.is_paced & (faster > 0.0) & (ramp_s < left_s)
        far, braked_s = np.where(evenly, slowed_m, far), np.where(evenly, left_s, braked_s)
        before = np.where(evenly, begun_m_s, reached)
        for _ in range(3):
            braked_m = 0.5 * (before + last) * braked_s
            left_m = np.maximum(length - far - braked_m, part.tail_m)
            last = limits.laws.lowest_allowed_m_s(left_m)
            last = np.minimum(last, reached)
        # With what is across, which is half of it in the mean, it is flown as one cubic of time.
        velocity, level = begun.velocity_m_s[rows, :2], horizontal(units)
        along = units[:, :2] / level[:, None]
        first = dot(velocity, along)
        # A climb that allows less than the leg is begun with slows it no sooner than it can brake.
        least = first / level - limits.ramp_m_s2 * time
        last = np.maximum(np.where(braked_s > 0.0, last, reached), least)
        dying = 0.5 * (first - join.speed_m_s * level)
        mean = _cubic_mean_m_s(
            (far + braked_m) / time * level + dying,
            first,
            last * level,
            horizontal(velocity - along * first[:, None]),
            most_m_s=np.maximum(limits.cruise_m_s * level, horizontal(velocity)),
            change_m_s=limits.ramp_m_s2 * level * time,
        )
        headway.way_m[rows] = (mean - dying) * time / level
        headway.speed_m_s[rows] = last
        headway.acceleration_m_s2[rows] = np.where(
            (ramp_s < left_s) | (faster < 0.0), 0.0, grown_m_s2
        )
        return headway


def _cubic_mean_m_s(
    wanted_m_s: FloatArray,
    first_m_s: FloatArray,
    last_m_s: FloatArray,
    aside_m_s: FloatArray,
    *,
    most_m_s: FloatArray,
    change_m_s: FloatArray,
) -> FloatArray:
    """Return the mean horizontal speed nearest to one wanted with which a cubic keeps to its limits.

    Its velocity is a parabola within the triangle v₀, 3 m − v₀ − v₁, v₁ (Bézier), of which half of what
    is aside is left in the middle.  Its acceleration at the ends is (6 m − 4 v₀ − 2 v₁)/T and
    (2 v₀ + 4 v₁ − 6 m)/T.
    """
    corner = np.sqrt(np.maximum(most_m_s**2 - (0.5 * aside_m_s) ** 2, 0.0))
    ends = 4.0 * first_m_s + 2.0 * last_m_s, 2.0 * first_m_s + 4.0 * last_m_s
    least = (np.maximum(*ends) - change_m_s) / 6.0
    most = (np.minimum(*ends) + change_m_s) / 6.0
    most = np.minimum(np.maximum(most, least), (corner + first_m_s + last_m_s) / 3.0)
    return np.asarray(np.minimum(np.maximum(wanted_m_s, least), most))


def _units(way_m: FloatArray) -> FloatArray:
    """Return unit vectors, zero for a way of no length. (n, 3)"""
    return directions(way_m)[0]


class _Sight(Value, eq=False):
    """Directions to targets as they are seen once a climb has changed."""

    direction: FloatArray
    """(n, 3)"""
    speed_m_s: FloatArray
    """Horizontal speed that leads there, no more than asked for. [m s⁻¹]"""
    counts: BoolArray
    """Where a climb changes on a leg that goes farther than it climbs or descends."""

    @classmethod
    def of(
        cls, begun: LegStarts, direction: FloatArray, begun_m_s: FloatArray, after_m_s: FloatArray
    ) -> _Sight:
        """Return the sights for horizontal speeds at the beginning and at the end of the change.

        PX4 points the velocity at the target from where its trajectory is.  In a time t, from the speed
        v₀ to v, the height goes on by (w₀ + w) t/2; what is left of it and of the way L then gives the
        climb, w = v (h − w₀ t/2)/(L − v₀ t/2), and the change from w₀ to w the time.  Where w is beyond
        its limit, v falls to what goes with that.
        """
        parameters = begun.parameters
        climbing_m_s = begun.velocity_m_s[:, 2]
        way = begun.planned.target_m - begun.place_m
        level, height = horizontal(way), way[:, 2]
        along = quotient(direction[:, :2], horizontal(direction)[:, None])
        limit, vertical = vertical_limits(height > 0.0, parameters)
        climb = after_m_s * quotient(height, level, above=STILL_M)
        for _ in range(4):
            time_s = ramp_time_s(
                np.abs(np.clip(climb, -limit, limit) - climbing_m_s), vertical, parameters.jerk_m_s3
            )
            left = np.maximum(level - 0.5 * begun_m_s * time_s, 0.25 * level)
            slope = quotient(height - 0.5 * climbing_m_s * time_s, left, above=STILL_M)
            climb = after_m_s * slope
        speed = np.minimum(after_m_s, quotient(limit, np.abs(slope), np.inf))
        climb = speed * slope
        counts = (horizontal(direction) > np.abs(direction[:, 2])) & (begun_m_s > SLOWEST_TURN_M_S)
        # The tail of a climb on a level leg dies away by itself.
        counts &= begun.planned.is_leg & (begun.planned.direction[:, 2] != 0.0)
        counts &= np.abs(climb) < speed
        seen, _ = directions(np.column_stack((along * speed[:, None], climb)))
        return cls(
            direction=np.where(counts[:, None], seen, direction),
            speed_m_s=np.where(counts, speed, after_m_s),
            counts=counts,
        )


def eased_turns(begun: LegStarts, turns: Turns, slowed: BoolArray) -> Turns:
    """Return turns by which legs that go straight on take back the deceleration they are begun with.

    The waypoint counts as reached while the vehicle brakes for it: a waypoint after it at once allows
    more, but the deceleration falls at limited jerk, and the speed with it until it has gone.
    """
    parameters = begun.parameters
    part, velocity = begun.planned, begun.velocity_m_s
    speed, jerk = lengths(velocity), parameters.jerk_m_s3
    direction, _ = directions(part.ends_m - begun.place_m)
    along = dot(velocity, direction)
    eases = part.is_leg & ~part.is_takeoff & ~slowed & (part.pause_s == 0.0)
    eases &= (turns.duration_s == 0.0) & (along > ALIGNED_COS * speed)
    slowing = np.where(eases, begun.slowing_m_s2, 0.0)
    slowing = np.minimum(slowing, np.sqrt(2.0 * jerk * speed))
    time = slowing / jerk
    eases &= time > _SHORTEST_EASE_S
    if not eases.any():
        return turns
    way = time * (speed - jerk * time**2 / 3.0)
    after = speed - 0.5 * jerk * time**2
    heading = quotient(velocity, speed[:, None])
    level = horizontal(heading)
    return Turns(
        duration_s=np.where(eases, time, turns.duration_s),
        end_m=np.where(eases[:, None], begun.place_m + heading * way[:, None], turns.end_m),
        speed_m_s=np.where(eases, after * level, turns.speed_m_s),
        acceleration_m_s2=np.where(eases, 0.0, turns.acceleration_m_s2),
    )


def cut_short(begun: LegStarts, turns: Turns, ends_m: FloatArray) -> tuple[Turns, FloatArray]:
    """Return turns that lead no further than the end of their leg, and ends not before their turn.

    A turn cut to next to nothing still takes the time to bring the vehicle across to its end, and to
    turn its velocity into the leg.
    """
    parameters = begun.parameters
    part, place, velocity = begun.planned, begun.place_m, begun.velocity_m_s
    goal = dot(ends_m - place, part.direction)
    turned = dot(turns.end_m - place, part.direction)
    flies = part.is_leg & ~part.is_takeoff
    passed = flies & (goal <= 0.0)
    beyond = flies & ~passed & (turned > goal)
    fraction = np.where(passed, 0.0, np.where(beyond, goal / np.where(beyond, turned, 1.0), 1.0))
    end = np.where(beyond[:, None], ends_m, turns.end_m)
    end = np.where(passed[:, None], place, end)
    across = np.abs(end - place)
    slowest = min(parameters.climb_speed_m_s, parameters.descent_speed_m_s)
    least_s = PEAK_OVER_MEAN * np.maximum(
        horizontal(across) / part.speed_m_s, across[:, 2] / slowest
    )
    along = np.maximum(dot(velocity, part.direction), 0.0)
    turned_m_s = np.abs(velocity - part.direction * along[:, None])
    vertical = min(parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2)
    accelerations = np.array([parameters.acceleration_m_s2] * 2 + [vertical])
    least_s = np.maximum(least_s, greatest(turned_m_s / accelerations))
    duration_s = turns.duration_s * fraction
    duration_s = np.where(beyond, np.maximum(duration_s, least_s), duration_s)
    return (
        replace(turns, duration_s=duration_s, end_m=end),
        np.where(passed[:, None], place, ends_m),
    )
