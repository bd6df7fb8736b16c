"""Turns: how PX4 gets from one leg onto the next without stopping."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.ramps import Ramps, ramp_time_s
from planner.flight.motion.px4.speeds import STILL_M
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import FloatArray

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


@frozen(eq=False)
class Turns(Columns):
    """What is left of a turn when the vehicle heads for its target, as columns of length n."""

    duration_s: FloatArray
    """Zero where nothing is turned."""
    end_m: FloatArray
    """Place: east, north, height above home. (n, 3) [m]"""
    speed_m_s: FloatArray
    """Horizontal speed there, towards the target. [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    """Horizontal acceleration there, zero or more. [m s⁻²]"""


@frozen(eq=False)
class Approach(Columns):
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


def turns_onto_legs(approach: Approach, *, acceleration_m_s2: float, jerk_m_s3: float) -> Turns:
    """Return the turns onto new legs.

    Parameters
    ----------
    approach : Approach
        How the vehicle comes. (n rows)
    acceleration_m_s2, jerk_m_s3 : float
        MPC_ACC_HOR and MPC_JERK_AUTO. [m s⁻², m s⁻³]

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
    count = len(speed)
    duration, acceleration = np.zeros(count), np.zeros(count)
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


@frozen(eq=False)
class _LegFrame:
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
    def of(cls, approach: Approach) -> _LegFrame:
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


def _swings(approach: Approach, *, acceleration_m_s2: float, jerk_m_s3: float) -> Turns:
    """Return the turns of vehicles that all turn."""
    frame = _LegFrame.of(approach)
    v, sin_turn, cos_turn = frame.speed_m_s, frame.sin_turn, frame.cos_turn
    l1 = np.maximum(approach.radius_m, SHORTEST_L1_M)
    height = approach.target_m[:, 2] - approach.place_m[:, 2]
    held = _held_speed_m_s(v, np.abs(height), l1, approach.vertical_m_s)
    rate = np.minimum(approach.vertical_m_s, held * np.abs(height) / l1)
    lift = np.abs(np.sign(height) * rate - approach.climb_m_s)
    jerk = np.full(len(v), jerk_m_s3)
    lift_s = ramp_time_s(lift, acceleration_m_s2=approach.vertical_m_s2, jerk_m_s3=jerk)
    steered = np.clip(-frame.y_m / l1, -1.0, 1.0)
    for _ in range(2):
        # Towards the point steered for once the swing is over, which its own way decides.
        cos_steered = np.sqrt(1.0 - steered**2)
        swing = (held * cos_steered - v * cos_turn)[:, None] * frame.along + (
            held * steered - v * sin_turn
        )[:, None] * frame.across
        widest = np.abs(swing).max(axis=1)
        lifts = lift_s > ramp_time_s(widest, acceleration_m_s2=acceleration_m_s2, jerk_m_s3=jerk)
        ramps = Ramps.of(
            np.where(lifts, lift, widest),
            acceleration_m_s2=np.where(lifts, approach.vertical_m_s2, acceleration_m_s2),
            jerk_m_s3=jerk,
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
    return (
        half_s * (along * ahead - across * aside),
        half_s * (along * aside + across * ahead),
    )


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
    approach: Approach,
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
