"""Straights: the straight part of a leg, from the end of its turn to where the next leg begins."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import Columns, greatest, horizontal, quotient
from planner.flight.motion.px4.braking import (
    CLAMPED_M_S,
    Px4Ramps,
    allowed_speed_m_s,
    braking_distance_m,
    half_b_m_s,
    ramp_time_s,
    vertical_limits,
)
from planner.flight.motion.px4.landing import takeoff_acceleration_m_s2
from planner.flight.motion.px4.moves import directions
from planner.values import field_values

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import PlannedLegs
    from planner.vehicle.parameters.px4 import Px4Parameters


_ROUNDS = 6
"""Newton's steps on a smooth rising function, from above: to millimetres."""
_SOFTER = 1.0 + 1e-6
_LEAST_SHARE = 0.2
"""Least of b'/b, the greatest being 1. [-]"""
_SLOWER = 1e-6
"""Share of a speed by which it is no slower. [-]"""
_SAME = 1e-9
"""Share of a speed by which it is the same. [-]"""


def root(
    function: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return where rising functions cross zero between bounds; the bound beyond which they do.

    Newton's steps, halving where one leaves its bracket.  Functions take rows of places, (2, n).
    """
    x = high.copy()
    for _ in range(_ROUNDS):
        step = 1e-6 * (1.0 + x)
        value, before = function(np.stack((x, x - step)))
        under = value <= 0.0
        low, high = np.where(under, x, low), np.where(under, high, x)
        slope = (value - before) / step
        newton = x - quotient(value, slope)
        x = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
    return x


class Onsets(Columns, eq=False):
    """The beginnings of braking: deceleration at limited jerk, then a steady one."""

    onset_s: FloatArray
    """Time in which the deceleration grows at limited jerk."""
    steady_s: FloatArray
    """Time at the deceleration it has grown to."""
    joined_m_s: FloatArray
    """Speed at which braking joins the allowed speed."""
    left_m: FloatArray
    """Way left to the target there."""


def onsets(limits: Limits, peak_m_s: FloatArray, begins_m: FloatArray, brakes: BoolArray) -> Onsets:
    """Return how speeds come down from their peaks to what the way left allows."""
    zero = np.zeros_like(peak_m_s)
    onset, steady, speed, left = zero.copy(), zero.copy(), peak_m_s.copy(), begins_m.copy()
    result = Onsets(onset_s=onset, steady_s=steady, joined_m_s=speed, left_m=left)
    rows = np.flatnonzero(brakes)
    if not len(rows):
        return result
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
    lowest = np.minimum(*np.where(limits.binds, limits.final_m_s, np.inf).T)
    joined = np.clip(joined, lowest, now)
    after = here - (now**2 - joined**2) / (2.0 * rate)
    short = after < tail
    stopped = np.sqrt(np.maximum(now**2 - 2.0 * rate * np.maximum(here - tail, 0.0), 0.0))
    joined = np.where(short, stopped, joined)
    steady[rows] = np.where(goes_on, (now - joined) / rate, 0.0)
    onset[rows] = time
    speed[rows] = np.where(goes_on, joined, now)
    at_end = ends | (goes_on & short)
    left[rows] = np.maximum(np.where(at_end, tail, np.where(goes_on, after, here)), tail)
    return result


def _trails(limits: Limits, left_m: FloatArray) -> BoolArray:
    """Return which straights are braked by one law, softer than the vehicle can brake. (n,)

    What asks for more is braked at full deceleration, not trailed.
    """
    far, near = limits.lower(left_m), limits.lower(limits.tail_m)
    softer = limits.law(far).acceleration_m_s2 <= limits.ramp_m_s2 * _SOFTER
    return np.asarray((far == near) & softer)


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
        r = twice + (trailing * (trailing - 2.0 * half_b) - limits.final_m_s**2) / law
        square = q * q - p * r
        joined = np.maximum(quotient(-r, q + np.sqrt(np.maximum(square, 0.0))), limits.final_m_s)
        rate = law * joined / (joined + half_b)
        trailing = np.where(trails[:, None], 0.5 * rate**2 / limits.brake_m_s3, 0.0)
    # Without a crossing a law that brakes harder than the vehicle allows every speed.
    allowing = np.where(limits.binds & (square >= 0.0), joined, np.inf)
    return np.asarray(np.minimum(*allowing.T))


def _crossings_m_s(limits: Limits, far: IntArray, near: IntArray) -> FloatArray:
    """Return the speeds at which two braking laws allow the same; −1 where there is none."""

    def terms(law: IntArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        a, final, half_b = limits.law(law)
        return 1.0 / a, half_b / a, final**2 / a

    (a1, b1, c1), (a2, b2, c2) = terms(far), terms(near)
    p, q, r = a1 - a2, b1 - b2, c2 - c1
    square = q * q - p * r
    square_root = np.sqrt(np.maximum(square, 0.0))
    big = -(q + np.copysign(square_root, q))
    first = np.divide(big, p, out=np.full_like(big, -1.0), where=p != 0.0)
    second = np.divide(r, big, out=np.full_like(big, -1.0), where=big != 0.0)
    both = np.where(second > 0.0, np.minimum(first, second), first)
    return np.where(square >= 0.0, np.where(first > 0.0, both, second), -1.0)


class Followed(Onsets, eq=False):
    """How the braking laws are flown from where they are joined: one of them, or two."""

    far: IntArray
    """Law braked by first from there."""
    near: IntArray
    """Law braked by last."""
    crossing_m_s: FloatArray
    """Speed at which the near law takes over; the end speed where the far one is the only one."""
    held_m: FloatArray
    """Way at that speed, where the far law asks for no less before the near one does."""
    end_m_s: FloatArray
    final_m: FloatArray
    """Way at the end flown at the end speed: a corner speed reached before its corner."""
    half_b_m_s: FloatArray
    """b'/2 of the far and the near law as they are flown. (n, 2) [m s⁻¹]"""
    beyond_m: FloatArray
    """How far beyond the target the laws as they are flown would end at their final speeds; below 0: before.
    (n, 2)"""

    @classmethod
    def of(cls, limits: Limits, onset: Onsets, brakes: BoolArray) -> Followed:
        """Return the laws from where speeds join them, where anything ``brakes`` and way is left."""
        speed, left, tail = onset.joined_m_s, onset.left_m, limits.tail_m
        far, near = limits.lower(left), limits.lower(tail)
        follows = brakes & (left > tail)
        far_law, near_law = limits.law(far), limits.law(near)
        a, b = far_law.acceleration_m_s2, 2.0 * far_law.half_b_m_s

        crossing = np.maximum(_crossings_m_s(limits, far, near), far_law.final_m_s)
        end = limits.lowest_allowed_m_s(tail)
        crosses = (far != near) & (crossing > end) & (crossing <= speed)

        # One law: through where it is joined and where it leaves.
        leaves_m, leaves_m_s = _leaving(limits, far, left)
        slower = np.maximum(speed - leaves_m_s, 0.0)
        # With b' = b; what is left then is flown at the speed it leaves with.
        kept = slower * (speed + leaves_m_s + b) / (2.0 * a)
        kept = np.minimum(kept, np.maximum(left - leaves_m, 0.0))
        some = slower > _SLOWER * (1.0 + speed)
        twice = np.divide(2.0 * a * kept, slower, out=speed + leaves_m_s + b, where=some)
        alone = 0.5 * np.clip(twice - speed - leaves_m_s, _LEAST_SHARE * b, b)
        alone = np.maximum(alone, _softest_m_s(limits, far_law, speed))
        square = (speed + alone) ** 2 - 2.0 * a * kept
        lone_end = np.sqrt(np.maximum(square, alone**2)) - alone

        leaves = np.where(crossing < speed, far_law.way_m(crossing), left)
        nears = near_law.way_m(crossing)
        held = np.where(crosses, np.maximum(leaves - nears, 0.0), 0.0)
        final = np.where(crosses, np.maximum(near_law.way_m(end) - tail, 0.0), left - kept - tail)
        # What asks for more than the vehicle can brake ends the same way faster.
        softest = np.maximum(near_law.half_b_m_s, _softest_m_s(limits, near_law, crossing))
        softer = softest > near_law.half_b_m_s
        square = (crossing + softest) ** 2 - 2.0 * near_law.acceleration_m_s2 * (
            nears - final - tail
        )
        end = np.where(softer, np.sqrt(np.maximum(square, softest**2)) - softest, end)
        both = np.column_stack((far_law.half_b_m_s, softest))
        both_beyond = near_law._replace(half_b_m_s=softest).way_m(crossing) - nears
        lone_beyond = far_law._replace(half_b_m_s=alone).way_m(speed) - left
        zero = np.zeros_like(speed)
        return cls(
            **field_values(onset),
            far=far,
            near=np.where(crosses & follows, near, far),
            crossing_m_s=np.where(follows, np.where(crosses, crossing, lone_end), speed),
            held_m=np.where(follows, held, 0.0),
            end_m_s=np.where(follows, np.where(crosses, end, lone_end), speed),
            final_m=np.where(follows, final, 0.0),
            half_b_m_s=np.where(crosses[:, None], both, alone[:, None]),
            beyond_m=np.where(crosses, (zero, both_beyond), lone_beyond).T,
        )


def _softest_m_s(limits: Limits, law: BrakingLaw, speed_m_s: FloatArray) -> FloatArray:
    """Return b'/2 with which a law asks speeds for no more than the vehicle can brake. (n,) [m s⁻¹]

    a u/(u + b'/2) is the greatest where braking begins.  A height's law of a gentle slope asks for more.
    """
    return np.asarray(speed_m_s * (law.acceleration_m_s2 / limits.ramp_m_s2 - 1.0))


def _leaving(limits: Limits, law: IntArray, left_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return where braking by a law ends, counted to the target, and the speeds there. (n,), (n,)

    At the end of the straight; but a final speed is met as far before it as the deceleration takes to be
    taken back, t = a'/j, from where it is the allowed one: v_f t + a' t²/6.
    """
    a, final, half_b = limits.law(law)
    j, tail = limits.brake_m_s3[np.arange(len(law)), law], limits.tail_m
    allowed = allowed_speed_m_s(tail, final, a, j)
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


class Straights(Followed, eq=False):
    """How straights are flown: ramp, cruise, onset of braking, and braking by up to two laws."""

    ramp_from_m_s: FloatArray
    """Speed at which the ramp would begin without acceleration."""
    ramp_begun_s: FloatArray
    """Time of the ramp that lies before the straight, flown in the turn."""
    is_cut: BoolArray
    """Whether the straight ends before the ramp takes its acceleration back."""
    peak_m_s: FloatArray
    cruise_m: FloatArray

    def near_way_m(self, limits: Limits) -> FloatArray:
        """Return how far before the target braking by the near law begins. (n,) [m]"""
        law = limits.law(self.near)._replace(half_b_m_s=self.half_b_m_s[:, 1])
        return law.way_m(self.crossing_m_s) - self.beyond_m[:, 1]

    def ramps(self, limits: Limits) -> Px4Ramps:
        """Return the ramps to the peak speeds."""
        change = np.abs(self.peak_m_s - self.ramp_from_m_s)
        return Px4Ramps.of(change, limits.ramp_m_s2, limits.ramp_m_s3, is_cut=self.is_cut)


class _Climb(Columns, eq=False):
    """The speeds at which straights begin, and the ways of ramps from there."""

    limits: Limits
    start_m_s: FloatArray
    ramp_from_m_s: FloatArray
    begun_m: FloatArray

    def ways_m(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ways of ramps to speeds: whole ones, and until the acceleration is taken back."""
        a, j = self.limits.ramp_m_s2, self.limits.ramp_m_s3
        change = np.abs(speed_m_s - self.ramp_from_m_s)
        whole = 0.5 * (speed_m_s + self.ramp_from_m_s) * ramp_time_s(change, a, j)
        back_s = np.minimum(a, np.sqrt(j * change)) / j
        back = back_s * (speed_m_s - np.sign(speed_m_s - self.ramp_from_m_s) * j * back_s**2 / 6.0)
        return whole - self.begun_m, whole - back - self.begun_m

    def cut_way_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the ways of ramps up to speeds that are cut off there. [m]"""
        a, j = self.limits.ramp_m_s2, self.limits.ramp_m_s3
        time = ramp_time_s(np.maximum(speed_m_s - self.ramp_from_m_s, 0.0), a, j, is_cut=True)
        jerk_s = np.minimum(time, a / j)
        steady_s = time - jerk_s
        way = self.ramp_from_m_s * time + jerk_s**2 * j * (jerk_s / 6.0 + 0.5 * steady_s)
        return way + 0.5 * j * jerk_s * steady_s**2 - self.begun_m


def fly_straights(
    limits: Limits, *, start_m_s: FloatArray, acceleration_m_s2: FloatArray
) -> Straights:
    """Return how straights are flown that begin at speeds and accelerations along them, zero or more.

    Notes
    -----
    The speed grows until the speed it would have with its acceleration taken back is that allowed by the
    way left (``VelocitySmoothing::computeDirection``), or the cruise's.  Where the cruise is not reached,
    the way goes on being used up while the acceleration turns round, and full deceleration brings the
    speed back: the 2 a/j s which the allowed speed keeps in hand are for this.

    Braking is ruled by the same: at a deceleration a' the speed is above the allowed one, v − a'²/2j = u.
    Following it a' is about −u̇ = 2 a u/(2 u + b).  It is flown as v² + b' v = 2 a d + c, through where that
    is first met and through where it leaves.  Ten recorded stops from 3 to 12 m/s were 0.13 to 0.62 s
    sooner than by u.
    """
    jerk = limits.ramp_m_s3
    # An acceleration begun with must be taken back before the cruise speed.
    below = np.maximum(limits.cruise_m_s - start_m_s, 0.0)
    begun = np.minimum(np.minimum(acceleration_m_s2, limits.ramp_m_s2), np.sqrt(2.0 * jerk * below))
    begun_s = begun / jerk
    ramp_from = start_m_s - 0.5 * begun * begun_s
    climb = _Climb(
        limits=limits,
        start_m_s=start_m_s,
        ramp_from_m_s=ramp_from,
        begun_m=begun_s * (ramp_from + jerk * begun_s**2 / 6.0),
    )
    total = limits.length_m + limits.tail_m
    peak, length = limits.cruise_m_s.copy(), limits.length_m
    _, until_back = climb.ways_m(peak)
    short = np.flatnonzero(until_back + limits.reach_m(peak) > total)
    lowest = start_m_s + 0.5 * begun * begun_s
    if len(short):
        some = climb.select(short)
        peak[short] = root(
            lambda speed: some.ways_m(speed)[1] + some.limits.reach_m(speed) - total[short],
            lowest[short],
            np.maximum(peak[short], lowest[short]),
        )
    # Nothing above the speed begun with is allowed: the way left decides from the beginning.
    late = lowest * (1.0 + _SAME) >= peak
    late &= (begun == 0.0) | (peak < limits.cruise_m_s)
    ramped, _ = climb.ways_m(peak)
    held = late & ~((ramped <= length) & (peak >= limits.cruise_m_s))
    # A change within the rounding is none: it would take the square root of that.
    held |= (begun == 0.0) & (np.abs(start_m_s - peak) <= _SAME * peak)
    ramped = np.where(held, 0.0, ramped)
    peak = np.where(held, start_m_s, peak)
    is_cut = ~late & (ramped > length)
    if is_cut.any():
        cut = climb.select(is_cut)
        peak[is_cut] = root(
            lambda speed: cut.cut_way_m(speed) - cut.limits.length_m, cut.start_m_s, peak[is_cut]
        )
        ramped[is_cut] = cut.cut_way_m(peak[is_cut])
    left = total - ramped
    kept = np.maximum(limits.reach_m(peak), limits.tail_m)
    brakes = (kept > limits.tail_m) & ~is_cut
    cruise = np.maximum(left - np.where(is_cut, limits.tail_m, kept), 0.0)
    followed = Followed.of(limits, onsets(limits, peak, left - cruise, brakes), brakes)
    return Straights(
        **field_values(followed),
        ramp_from_m_s=np.where(held, peak, ramp_from),
        ramp_begun_s=np.where(held, 0.0, begun_s),
        is_cut=is_cut,
        peak_m_s=peak,
        cruise_m=cruise,
    )


class BrakingLaw(NamedTuple):
    """One braking law for each straight: u² + b u = 2 a d + v_f² at a way d before the target."""

    acceleration_m_s2: FloatArray
    final_m_s: FloatArray
    half_b_m_s: FloatArray

    def way_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target speeds are allowed. (n,) [m]"""
        square = speed_m_s * (speed_m_s + 2.0 * self.half_b_m_s) - self.final_m_s**2
        return np.asarray(square / (2.0 * self.acceleration_m_s2))


class Limits(Columns, eq=False):
    """What limits the speed along straights; lengths and speeds count along them."""

    direction: FloatArray
    """Unit vectors. (n, 3)"""
    length_m: FloatArray
    tail_m: FloatArray
    """From the end of the straight on to its target."""
    cruise_m_s: FloatArray
    ramp_m_s2: FloatArray
    """Greatest acceleration."""
    ramp_m_s3: FloatArray
    """Greatest jerk of it."""
    binds: BoolArray
    """Which of the two braking laws count. (n, 2)"""
    brake_m_s2: FloatArray
    """Acceleration of the braking laws: of the horizontal and of the vertical axes. (n, 2)"""
    brake_m_s3: FloatArray
    """Jerk of the braking laws. (n, 2)"""
    final_m_s: FloatArray
    """Final speed of the braking laws. (n, 2)"""

    def law(self, index: IntArray) -> BrakingLaw:
        """Return one law of each row, by its column."""
        rows = np.arange(len(index))
        a = self.brake_m_s2[rows, index]
        half_b = half_b_m_s(a, self.brake_m_s3[rows, index])
        return BrakingLaw(a, self.final_m_s[rows, index], half_b)

    def allowed_m_s(self, distance_m: FloatArray) -> FloatArray:
        """Return the speeds both laws allow so far from the target, infinite where unbound. (…, n, 2)"""
        speed = allowed_speed_m_s(
            distance_m[..., None], self.final_m_s, self.brake_m_s2, self.brake_m_s3
        )
        return np.where(self.binds, speed, np.inf)

    def lower(self, distance_m: FloatArray) -> IntArray:
        """Return the law that allows less at distances from the target; of equals the first. (n,)"""
        allowed = self.allowed_m_s(distance_m)
        return np.asarray(allowed[:, 1] < allowed[:, 0], dtype=np.intp)

    def lowest_allowed_m_s(self, distance_m: FloatArray) -> FloatArray:
        """Return the speeds all laws allow at distances from the target. (…, n) [m s⁻¹]"""
        allowed = self.allowed_m_s(distance_m)
        return np.asarray(np.minimum(allowed[..., 0], allowed[..., 1]))

    def reach_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target braking from speeds begins. (…, n) [m]"""
        way = braking_distance_m(
            speed_m_s[..., None], self.final_m_s, self.brake_m_s2, self.brake_m_s3
        )
        bound = np.where(self.binds, way, 0.0)
        return np.asarray(np.maximum(bound[..., 0], bound[..., 1]))


def limits_along(
    start_m: FloatArray, end_m: FloatArray, planned: PlannedLegs, parameters: Px4Parameters
) -> Limits:
    """Return what limits the speed along the straights of legs, between these ends. (n, 3)

    Notes
    -----
    The velocity points at the target; its horizontal and its vertical part both stay below what their
    axes allow, so the slower scales the whole (``clampToXYNorm``, ``clampToZNorm``).  With c and s the
    horizontal and vertical parts of the direction, an axis limited to v, a, j limits the straight to
    v/c, a/c, j/c.  Below 0.5 m/s only the slow axis is slowed: a gentle slope that ends level does not
    stop the flight.  Each of the north and east axes has the whole acceleration to itself.
    """
    direction, length = directions(end_m - start_m)
    speed, tail = planned.speed_m_s, planned.tail_m
    level, upright = horizontal(direction), np.abs(direction[:, 2])
    vertical_speed, vertical = vertical_limits(direction[:, 2] > 0.0, parameters)
    low = planned.is_takeoff & ~planned.takeoffs.is_free
    vertical = np.where(low, takeoff_acceleration_m_s2(parameters), vertical)
    jerk = np.full_like(length, parameters.jerk_m_s3)
    shares = np.maximum(np.column_stack((level, upright)), 1e-9)
    cruise = np.minimum(speed / shares[:, 0], vertical_speed / shares[:, 1])

    acceleration = np.column_stack((np.full_like(length, parameters.acceleration_m_s2), vertical))
    at_end = np.minimum(
        speed, allowed_speed_m_s(level * tail, planned.final_level_m_s, acceleration[:, 0], jerk)
    )
    steep = upright > level
    binds = np.column_stack(
        (
            ~steep | (level * cruise >= CLAMPED_M_S),
            steep | (at_end * upright >= CLAMPED_M_S * shares[:, 0]),
        )
    )

    # Acceleration: the axis that takes longest sets the time of all.
    widest = np.maximum(greatest(np.abs(direction[:, :2])), 1e-9)
    axes = np.column_stack((widest, shares[:, 1]))
    times = ramp_time_s(cruise[:, None] * axes, acceleration, jerk[:, None])
    slowest = np.where(times[:, 1] > times[:, 0], 1, 0)
    rows = np.arange(len(length))
    share = axes[rows, slowest]
    return Limits(
        direction=direction,
        length_m=length,
        tail_m=tail,
        cruise_m_s=cruise,
        ramp_m_s2=acceleration[rows, slowest] / share,
        ramp_m_s3=jerk / share,
        binds=binds,
        brake_m_s2=acceleration / shares,
        brake_m_s3=jerk[:, None] / shares,
        final_m_s=np.column_stack((planned.final_level_m_s, planned.final_upright_m_s)) / shares,
    )
