"""Turns: how PX4 turns from one leg to the next without stopping."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import Columns, clipped, dot, greatest, horizontal, quotient
from planner.flight.motion.px4.braking import (
    CLAMPED_M_S,
    STILL_M,
    Px4Ramps,
    ramp_time_s,
    vertical_limits,
)
from planner.flight.motion.px4.moves import ALIGNED_COS, SHORTEST_L1_M, SLOWEST_TURN_M_S
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.flight.motion.px4.legs import LegStarts
    from planner.vehicle.parameters.px4 import Px4Parameters


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


class _Corners(Columns, eq=False):
    """Vehicles that all turn, and the legs they turn onto, as columns of length n."""

    parameters: Px4Parameters
    place_m: FloatArray
    """As of `LegStarts`, like the next two. (n, 3) [m]"""
    velocity_m_s: FloatArray
    slowing_m_s2: FloatArray
    begins_m: FloatArray
    """As of `PlannedLegs`, like what follows. (n, 3) [m]"""
    target_m: FloatArray
    radius_m: FloatArray

    @classmethod
    def of(cls, begun: LegStarts, turning: BoolArray) -> _Corners:
        """Return some of the legs that are begun."""
        return cls(
            parameters=begun.parameters,
            place_m=begun.place_m[turning],
            velocity_m_s=begun.velocity_m_s[turning],
            slowing_m_s2=begun.slowing_m_s2[turning],
            begins_m=begun.planned.begins_m[turning],
            target_m=begun.planned.target_m[turning],
            radius_m=begun.planned.radius_m[turning],
        )


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
    turning, along, speed = turning_legs(begun)
    turns = Turns(
        duration_s=np.zeros_like(speed),
        end_m=begun.place_m.copy(),
        speed_m_s=np.maximum(along, 0.0),
        acceleration_m_s2=np.zeros_like(speed),
    )
    if turning.any():
        led, held_m_s, lead_s = _led_in(_Corners.of(begun, turning))
        approached, frame, before_s = _approached(led)
        swung = _swings(approached, frame, held_m_s)
        duration_s = np.maximum(swung.duration_s + before_s - lead_s, 0.0)
        turns.put(turning, replace(swung, duration_s=duration_s))
    return turns


def turning_legs(begun: LegStarts) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return which legs are begun by a turn, and their speeds towards their targets and in all. (n,) each

    Notes
    -----
    ``PositionSmoothing::_isTurning``: moving, 11.5° off the target, and outside its acceptance radius.
    """
    way = (begun.planned.target_m - begun.place_m)[:, :2]
    velocity = begun.velocity_m_s[:, :2]
    distance, speed = horizontal(way), horizontal(velocity)
    along = quotient(dot(way, velocity), distance, above=STILL_M)
    turning = (speed > SLOWEST_TURN_M_S) & (along < ALIGNED_COS * speed)
    turning &= distance > begun.planned.radius_m
    return turning, along, speed


def _led_in(begun: _Corners) -> tuple[_Corners, FloatArray, FloatArray]:
    """Return vehicles as they would have begun to turn back without a deceleration, and by how much sooner.

    And the speeds held in the turns: what the way left allowed, which a deceleration trails.  What of it
    points along the new leg, −cos θ of it for a turn θ beyond the right angle, is part of the swing already.
    """
    parameters = begun.parameters
    velocity = begun.velocity_m_s[:, :2]
    way = (begun.target_m - begun.place_m)[:, :2]
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


def _approached(begun: _Corners) -> tuple[_Corners, _LegFrame, FloatArray]:
    """Return vehicles that all turn where they begin to turn onto their legs, how these lie, and when.

    Farther off than l, ``PositionSmoothing::_getL1Point`` has no point of the leg in reach, and the one
    nearest to the vehicle is steered for: straight at the leg, as after a waypoint that counts as reached
    from farther away than the next.  From l on that point moves aside, in l/v; the velocity, which takes T
    to swing onto the leg, follows at once where T is shorter, else in the mean l/2v later.
    """
    parameters = begun.parameters
    frame, l1 = _LegFrame.of(begun), np.maximum(begun.radius_m, SHORTEST_L1_M)
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
        return begun, frame, np.zeros_like(v)
    place, velocity = begun.place_m.copy(), begun.velocity_m_s.copy()
    there = frame.place_m(begun.begins_m, x, -side * l1)
    place[:, :2] = np.where(far[:, None], there, place[:, :2])
    straight = frame.across * (v * side)[:, None]
    velocity[:, :2] = np.where(far[:, None], straight, velocity[:, :2])
    before_s = np.where(far, swing_s + left / v, 0.0)
    begun = replace(begun, place_m=place, velocity_m_s=velocity)
    return begun, _LegFrame.of(begun), before_s


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
    def of(cls, begun: _Corners) -> _LegFrame:
        """Return the frames of new legs."""
        begins, target = begun.begins_m[:, :2], begun.target_m[:, :2]
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


def _swings(begun: _Corners, frame: _LegFrame, held_m_s: FloatArray) -> Turns:
    """Return the turns of vehicles that all turn, to the speeds that are held in them."""
    parameters = begun.parameters
    l1, most_m_s2 = np.maximum(begun.radius_m, SHORTEST_L1_M), parameters.acceleration_m_s2
    v, sin_turn, cos_turn = frame.speed_m_s, frame.sin_turn, frame.cos_turn
    height = begun.target_m[:, 2] - begun.place_m[:, 2]
    vertical_m_s, vertical_m_s2 = vertical_limits(height > 0.0, parameters)
    # The point steered for lies on the leg, and is as much higher as the leg has risen by there.
    rise = np.abs(begun.target_m[:, 2] - begun.begins_m[:, 2])
    steep = quotient(rise, frame.length_m, np.abs(height) / l1, above=STILL_M)
    held = _held_speed_m_s(held_m_s, steep, vertical_m_s)
    rate = np.minimum(vertical_m_s, held * steep)
    lift = np.abs(np.sign(height) * rate - begun.velocity_m_s[:, 2])
    jerk = np.full(len(v), parameters.jerk_m_s3)
    steered = clipped(-frame.y_m / l1, -1.0, 1.0)
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
        steered = clipped(-y_swung / l1, -1.0, 1.0)
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
        end_m=np.column_stack((frame.place_m(begun.begins_m, x, y), begun.place_m[:, 2] + climbed)),
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
        aside = clipped(off_m, 0.0, l1_m * sin_aligned)
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
