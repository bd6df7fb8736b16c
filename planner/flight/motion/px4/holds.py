"""Holds: how vehicles come to rest at a waypoint, and how far they are when they leave it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.curves import Curves
from planner.flight.motion.px4.laws import wright_omega
from planner.flight.motion.px4.speeds import STILL_M, allowed_speed_m_s, half_b_m_s

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray
    from planner.flight.motion.px4.layout import Layout
    from planner.flight.motion.px4.limits import Limits
    from planner.flight.motion.px4.straights import Straights
    from planner.vehicle.parameters.px4 import Px4Parameters

_LEAST_SHARE = 0.5
"""Of b, that of a braking law which leads to a stop: below it the vehicle is too fast. [-]"""
_ASTRAY_M = 0.1
"""Distance from its target at which a straight may pass and yet lead to it. [m]"""


def creeps(layout: Layout, limits: Limits, straights: Straights) -> BoolArray:
    """Return which moves end in a hold that goes on braking to a stop at the target. (n,)

    They arrive at the speed the braking law has there.
    """
    return layout.is_leg & (layout.hold_s > 0.0) & _leads_to_target(layout, limits, straights)


def creeping_half_b_m_s(limits: Limits, straights: Straights) -> FloatArray:
    """Return b'/2 of the braking laws that lead from where legs end to a stop at the target. (n,)"""
    rows = np.arange(len(limits.tail_m))
    a, speed = limits.brake_m_s2[rows, straights.near], straights.end_m_s
    half_b: FloatArray = 0.5 * (2.0 * a * limits.tail_m / np.maximum(speed, 1e-9) - speed)
    return half_b


def _leads_to_target(layout: Layout, limits: Limits, straights: Straights) -> BoolArray:
    """Return which straights go on to their targets by a braking law that stops there. (n,)"""
    rows = np.arange(len(limits.tail_m))
    near = straights.near
    share = creeping_half_b_m_s(limits, straights) / half_b_m_s(
        limits.brake_m_s2[rows, near], limits.brake_m_s3[rows, near]
    )
    stops = (limits.final_m_s[rows, near] == 0.0) & limits.binds[rows, near]
    creeping: BoolArray = (
        stops
        & (limits.length_m > STILL_M)
        & (straights.end_m_s > 0.0)
        & (share > _LEAST_SHARE)
        & (share < 1.0 + STILL_M)
        & (
            np.sqrt(((limits.direction - layout.direction) ** 2).sum(axis=1)) * layout.tail_m
            < _ASTRAY_M
        )
    )
    return creeping


def settlings(
    begin_m: FloatArray,
    velocity_m_s: FloatArray,
    target_m: FloatArray,
    parameters: Px4Parameters,
) -> Curves:
    """Return how vehicles in motion settle on places near by.

    They take the time to stop and turn back, and for twice the way at the speed allowed at its
    beginning.  (n rows)
    """
    way = np.sqrt(((target_m - begin_m) ** 2).sum(axis=1))
    speed = np.sqrt((velocity_m_s**2).sum(axis=1))
    a, j = parameters.acceleration_m_s2, parameters.jerk_m_s3
    allowed = allowed_speed_m_s(
        way,
        np.zeros_like(way),
        acceleration_m_s2=np.full_like(way, a),
        jerk_m_s3=np.full_like(way, j),
    )
    back = np.divide(2.0 * way, allowed, out=np.zeros_like(way), where=allowed > 0.0)
    duration = back + 2.0 * (speed / a + a / j)
    still = np.zeros_like(begin_m)
    rises = target_m[:, 2] > begin_m[:, 2]
    return Curves.between(
        begin_m,
        velocity_m_s,
        target_m,
        still,
        duration_s=duration,
        level_m_s=allowed,
        upright_m_s=np.minimum(
            allowed, np.where(rises, parameters.climb_speed_m_s, parameters.descent_speed_m_s)
        ),
    )


def ends_of_moves(
    part: Layout,
    place_m: FloatArray,
    velocity_m_s: FloatArray,
    limits: Limits,
    straights: Straights,
    *,
    parameters: Px4Parameters,
) -> tuple[FloatArray, FloatArray]:
    """Return where and how fast moves end, holds included."""
    rows = np.arange(len(place_m))
    speed = straights.end_m_s
    begin = place_m + limits.direction * limits.length_m[:, None]
    moving = limits.length_m > STILL_M
    velocity = np.where(moving[:, None], limits.direction * speed[:, None], velocity_m_s)
    end = begin.copy()
    holds = part.hold_s > 0.0
    creeping = part.is_leg & holds & _leads_to_target(part, limits, straights)
    settling = np.flatnonzero(holds & ~creeping & (part.is_leg | part.stands))
    if creeping.any():
        near = straights.near
        half_b = np.where(creeping, creeping_half_b_m_s(limits, straights), 1.0)
        a = limits.brake_m_s2[rows, near]
        begun = np.where(creeping, speed / half_b, 1.0)
        left = half_b * wright_omega(begun + np.log(begun) - part.hold_s * a / half_b)
        way = left * (left + 2.0 * half_b) / (2.0 * a)
        aim = begin + limits.direction * (part.tail_m - way)[:, None]
        end = np.where(creeping[:, None], aim, end)
        velocity = np.where(creeping[:, None], limits.direction * left[:, None], velocity)
    if len(settling):
        target = part.target_m[settling]
        curves = settlings(begin[settling], velocity[settling], target, parameters)
        settle_s = curves.duration_s.sum(axis=1)
        over = (part.hold_s[settling] >= settle_s)[:, None]
        place, left_m_s = curves.state_at(np.minimum(part.hold_s[settling], settle_s))
        end[settling] = np.where(over, target, place)
        velocity[settling] = np.where(over, 0.0, left_m_s)
    landed = ~part.is_leg & ~part.stands
    end = np.where(landed[:, None], part.target_m, end)
    return end, np.where(landed[:, None], 0.0, velocity)
