"""A point that follows an allowed speed at limited acceleration and jerk, stepped in time.

The slow way to what the product has in closed form, and independent of it: each step turns the jerk so
that the speed the point would have with its acceleration taken back moves to the allowed one.
"""

from __future__ import annotations

import math

_STEP_S = 0.002


def leg_time_s(
    length_m: float,
    speed_m_s: float,
    *,
    start_m_s: float = 0.0,
    final_m_s: float = 0.0,
    acceleration_m_s2: float = 3.0,
    jerk_m_s3: float = 4.0,
    radius_m: float = 2.0,
) -> float:
    """Return the time from the start of a leg to within a radius of its end. [s]"""
    a_most, jerk = acceleration_m_s2, jerk_m_s3
    half_b = 2.0 * a_most**2 / jerk
    way, speed, acceleration, time = 0.0, start_m_s, 0.0, 0.0
    while length_m - way > radius_m:
        allowed = math.sqrt(half_b**2 + 2.0 * a_most * (length_m - way) + final_m_s**2) - half_b
        wanted = min(speed_m_s, max(allowed, final_m_s))
        settled = speed + acceleration * abs(acceleration) / (2.0 * jerk)
        change = jerk * _STEP_S
        if abs(wanted - settled) < 0.5 * change * _STEP_S and abs(acceleration) < change:
            acceleration = 0.0
        else:
            acceleration += math.copysign(change, wanted - settled)
        acceleration = max(-a_most, min(a_most, acceleration))
        way += speed * _STEP_S
        speed += acceleration * _STEP_S
        time += _STEP_S
    return time
