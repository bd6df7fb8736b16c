"""Braking: how speeds come down from their peaks to what the way left allows, and follow it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.speeds import allowed_speed_m_s, half_b_m_s
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.limits import Limits


_ROUNDS = 6
"""Newton's steps on a smooth rising function, from above: to millimetres."""
_SOFTER = 1.0 + 1e-6
_LEAST_SHARE = 0.2
"""Least of b'/b, the greatest being 1. [-]"""
_SLOWER = 1e-6
"""Share of a speed by which it is no slower. [-]"""


def root(
    function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return where rising functions cross zero between bounds; the bound beyond which they do.

    Newton's steps, halving where one leaves its bracket.
    """
    x = high.copy()
    for _ in range(_ROUNDS):
        value = function(x)
        under = value <= 0.0
        low, high = np.where(under, x, low), np.where(under, high, x)
        step = 1e-6 * (1.0 + x)
        slope = (value - function(x - step)) / step
        newton = x - np.divide(value, slope, out=np.zeros_like(value), where=slope > 0.0)
        x = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return x


@frozen(eq=False)
class Onsets:
    """The beginnings of braking: deceleration at limited jerk, then a steady one."""

    onset_s: FloatArray
    steady_s: FloatArray
    speed_m_s: FloatArray
    """Speed at the end."""
    left_m: FloatArray
    """Way left to the target there."""


def onsets(limits: Limits, peak_m_s: FloatArray, begins_m: FloatArray, brakes: BoolArray) -> Onsets:
    """Return how speeds come down from their peaks to what the way left allows."""
    zero = np.zeros_like(peak_m_s)
    onset, steady, speed, left = zero.copy(), zero.copy(), peak_m_s.copy(), begins_m.copy()
    rows = np.flatnonzero(brakes)
    if not len(rows):
        return Onsets(onset_s=onset, steady_s=steady, speed_m_s=speed, left_m=left)
    limits, peak, begins = limits.select(rows), peak_m_s[rows], begins_m[rows]
    a, j, tail = limits.ramp_m_s2, limits.ramp_m_s3, limits.tail_m

    # Until full deceleration, or no speed left to lose, unless the speed is allowed before: trailing,
    # that with its deceleration taken back, which has fallen twice as far.
    trails = _trails(limits, begins)
    fall = np.where(trails, 1.0, 0.5) * j
    whole = np.minimum(a / j, np.sqrt(peak / fall))

    def shortfall_m_s(time: FloatArray, at: IntArray | slice = slice(None)) -> FloatArray:
        here = np.maximum(begins[at] - time * (peak[at] - j[at] * time**2 / 6.0), 0.0)
        short: FloatArray = some.lowest_allowed_m_s(here) - (peak[at] - fall[at] * time**2)
        return short

    some, time = limits, whole.copy()
    early = np.flatnonzero(shortfall_m_s(whole) > 0.0)
    if len(early):
        some = limits.select(early)
        time[early] = root(lambda t: shortfall_m_s(t, early), 1e-3 * whole[early], whole[early])
    ends = time * (peak - j * time**2 / 6.0) > begins - tail
    if ends.any():
        reach = np.flatnonzero(ends)
        time[reach] = root(
            lambda t: t * (peak[reach] - j[reach] * t**2 / 6.0) - (begins - tail)[reach],
            np.zeros(len(reach)),
            time[reach],
        )
    now = peak - 0.5 * j * time**2
    here = begins - time * (peak - j * time**2 / 6.0)
    # At the deceleration there is by now until the last of the laws allows the speed.
    goes_on = (trails | (time >= whole * (1.0 - 1e-9))) & ~ends
    rate = np.maximum(j * time, 1e-9)
    joined = _joined_m_s(limits, now, here, rate_m_s2=rate, trails=trails)
    joined = np.clip(joined, limits.final_m_s.min(axis=1, where=limits.binds, initial=np.inf), now)
    after = here - (now**2 - joined**2) / (2.0 * rate)
    short = after < tail
    stopped = np.sqrt(np.maximum(now**2 - 2.0 * rate * np.maximum(here - tail, 0.0), 0.0))
    joined = np.where(short, stopped, joined)
    steady[rows] = np.where(goes_on, (now - joined) / rate, 0.0)
    onset[rows] = time
    speed[rows] = np.where(goes_on, joined, now)
    at_end = ends | (goes_on & short)
    left[rows] = np.maximum(np.where(at_end, tail, np.where(goes_on, after, here)), tail)
    return Onsets(onset_s=onset, steady_s=steady, speed_m_s=speed, left_m=left)


def _trails(limits: Limits, left_m: FloatArray) -> BoolArray:
    """Return which straights are braked by one law, softer than the vehicle can brake. (n,)

    What asks for more is braked at full deceleration, not trailed.
    """
    far = np.argmin(limits.allowed_m_s(left_m), axis=1)
    near = np.argmin(limits.allowed_m_s(limits.tail_m), axis=1)
    softer = limits.brake_m_s2[np.arange(len(far)), far] <= limits.ramp_m_s2 * _SOFTER
    trails: BoolArray = (far == near) & softer
    return trails


def _joined_m_s(
    limits: Limits,
    speed_m_s: FloatArray,
    left_m: FloatArray,
    *,
    rate_m_s2: FloatArray,
    trails: BoolArray,
) -> FloatArray:
    """Return the speeds at which a deceleration comes down to what all laws allow. (n,) [m s⁻¹]

    Trailing, that is u + c, c = u̇²/2j: the deceleration a eases off to u̇ meanwhile.  With 2 d =
    2 d₀ − (v₀² − v²)/a, ((v − c)² + 2 (b/2) (v − c) − v_f²)/a_k = 2 d, first for no c, then for that of
    the u it gives.
    """
    a, law = rate_m_s2[:, None], limits.brake_m_s2
    half_b = half_b_m_s(law, limits.brake_m_s3)
    p = 1.0 / law - 1.0 / a
    twice = speed_m_s[:, None] ** 2 / a - 2.0 * left_m[:, None]
    joined = trailing = square = np.zeros_like(law)
    for _ in range(2):
        q = (half_b - trailing) / law
        taken = (trailing * (trailing - 2.0 * half_b) - limits.final_m_s**2) / law
        r = twice + taken
        square = q * q - p * r
        square_root = np.sqrt(np.maximum(square, 0.0))
        joined = np.divide(-r, q + square_root, out=np.zeros_like(r), where=q + square_root > 0.0)
        joined = np.maximum(joined, limits.final_m_s)
        rate = law * joined / (joined + half_b)
        trailing = np.where(trails[:, None], 0.5 * rate**2 / limits.brake_m_s3, 0.0)
    # Without a crossing a law that brakes harder than the vehicle allows every speed.
    lowest: FloatArray = np.where(limits.binds & (square >= 0.0), joined, np.inf).min(axis=1)
    return lowest


def _crossings_m_s(limits: Limits, far: IntArray, near: IntArray) -> FloatArray:
    """Return the speeds at which two braking laws allow the same; −1 where there is none."""
    rows = np.arange(len(far))

    def terms(law: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        a = limits.brake_m_s2[rows, law]
        half_b = half_b_m_s(a, limits.brake_m_s3[rows, law])
        return 1.0 / a, half_b / a, limits.final_m_s[rows, law] ** 2 / a

    (a1, b1, c1), (a2, b2, c2) = terms(far), terms(near)
    p, q, r = a1 - a2, b1 - b2, c2 - c1
    square = q * q - p * r
    square_root = np.sqrt(np.maximum(square, 0.0))
    big = -(q + np.copysign(square_root, q))
    first = np.divide(big, p, out=np.full_like(big, -1.0), where=p != 0.0)
    second = np.divide(r, big, out=np.full_like(big, -1.0), where=big != 0.0)
    both = np.where(second > 0.0, np.minimum(first, second), first)
    return np.where(square >= 0.0, np.where(first > 0.0, both, second), -1.0)


@frozen(eq=False)
class Followed:
    """How the braking laws are flown from where they are joined, as columns of length n."""

    far: IntArray
    near: IntArray
    crossing_m_s: FloatArray
    held_m: FloatArray
    end_m_s: FloatArray
    final_m: FloatArray
    half_b_m_s: FloatArray
    beyond_m: FloatArray

    @classmethod
    def of(cls, limits: Limits, onset: Onsets) -> Followed:
        """Return the laws from where speeds join them."""
        rows = np.arange(len(onset.speed_m_s))
        speed, left, tail = onset.speed_m_s, onset.left_m, limits.tail_m
        far = np.argmin(limits.allowed_m_s(left), axis=1)
        near = np.argmin(limits.allowed_m_s(tail), axis=1)
        a, final = limits.brake_m_s2[rows, far], limits.final_m_s[rows, far]
        true_half_b = half_b_m_s(limits.brake_m_s2, limits.brake_m_s3)
        b = 2.0 * true_half_b[rows, far]

        crossing = np.maximum(_crossings_m_s(limits, far, near), final)
        end = limits.lowest_allowed_m_s(tail)
        crosses = (far != near) & (crossing > end) & (crossing <= speed)

        # One law: through where it is joined and where it leaves.
        leaves_m, leaves_m_s = _leaving(limits, far, left)
        slower = np.maximum(speed - leaves_m_s, 0.0)
        # With b' = b; what is left then is flown at the speed it leaves with.
        kept = slower * (speed + leaves_m_s + b) / (2.0 * a)
        kept = np.minimum(kept, np.maximum(left - leaves_m, 0.0))
        brakes = slower > _SLOWER * (1.0 + speed)
        twice = np.divide(2.0 * a * kept, slower, out=speed + leaves_m_s + b, where=brakes)
        alone = 0.5 * np.clip(twice - speed - leaves_m_s, _LEAST_SHARE * b, b)
        square = (speed + alone) ** 2 - 2.0 * a * kept
        lone_end = np.sqrt(np.maximum(square, alone**2)) - alone
        lone_beyond = (speed * (speed + 2.0 * alone) - final**2) / (2.0 * a) - left

        leaves = np.where(crossing < speed, limits.way_m(crossing, far), left)
        held = leaves - limits.way_m(crossing, near)
        return cls(
            far=far,
            near=np.where(crosses, near, far),
            crossing_m_s=np.where(crosses, crossing, lone_end),
            held_m=np.where(crosses, np.maximum(held, 0.0), 0.0),
            end_m_s=np.where(crosses, end, lone_end),
            final_m=np.where(
                crosses, np.maximum(limits.way_m(end, near) - tail, 0.0), left - kept - tail
            ),
            half_b_m_s=np.where(
                crosses[:, None],
                np.column_stack((true_half_b[rows, far], true_half_b[rows, near])),
                alone[:, None],
            ),
            beyond_m=np.where(crosses, 0.0, lone_beyond),
        )


def _leaving(limits: Limits, law: IntArray, left_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where braking by a law ends, counted to the target, and the speeds there. (n,), (n,)

    At the end of the straight; but a final speed is met as far before it as the deceleration takes to be
    taken back, t = a'/j, from where it is the allowed one: v_f t + a' t²/6.
    """
    rows = np.arange(len(law))
    a, j = limits.brake_m_s2[rows, law], limits.brake_m_s3[rows, law]
    final, tail = limits.final_m_s[rows, law], limits.tail_m
    half_b = half_b_m_s(a, j)
    allowed = allowed_speed_m_s(tail, final, acceleration_m_s2=a, jerk_m_s3=j)
    rate = a * allowed / (allowed + half_b)
    trailing = allowed + 0.5 * rate**2 / j
    back_s = rate / j
    is_final = 2.0 * half_b * final > 2.0 * a * tail
    met = half_b * final / a - back_s * (final + rate * back_s / 6.0)
    within = is_final & (met > tail) & (met < left_m)
    # Between the two, what is above the final speed falls with the square of the time.
    reach = np.maximum(half_b * final / a - met, 1e-9)
    share = np.clip((tail - met) / reach, 0.0, 1.0)
    above = np.where(is_final, share**2, 1.0) * (trailing - allowed)
    return np.where(within, met, tail), np.where(within, final, allowed + above)
