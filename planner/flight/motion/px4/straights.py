"""Straights: the straight part of a leg, from the end of its turn to where the next leg begins.

Each is one profile along a line: a ramp at limited jerk to a peak, a cruise, the onset of braking at limited
jerk, and braking by what the way left allows: on one axis, or first on one and then on the other.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Self

import numpy as np

from planner.flight.motion.kinematics import (
    Columns,
    clipped,
    greatest,
    horizontal,
    quotient,
    rows_of,
)
from planner.flight.motion.px4.braking import (
    CLAMPED_M_S,
    Px4Ramps,
    allowed_speed_m_s,
    half_b_m_s,
    ramp_time_s,
    vertical_limits,
)
from planner.flight.motion.px4.lift_off import takeoff_acceleration_m_s2
from planner.flight.motion.px4.moves import directions
from planner.values import field_names, field_values, replace

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.legs import PlannedLegs


_ROUNDS = 6
"""Newton's steps on a smooth rising function, from above: to millimetres."""
_FOUND = 1e-12
"""Share of what is sought by which a step of Newton's changes nothing any more. [-]"""
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
    x = high
    near = np.empty((2, len(x)))
    for _ in range(_ROUNDS):
        step = 1e-6 * (1.0 + x)
        near[0], near[1] = x, x - step
        value, before = function(near)
        under = value <= 0.0
        low, high = np.where(under, x, low), np.where(under, high, x)
        newton, last = x - quotient(value, (value - before) / step), x
        x = np.where((newton >= low) & (newton <= high), newton, 0.5 * (low + high))
        if (np.abs(x - last) <= _FOUND * x).all():
            break
    return x


class BrakingLaw(Columns, eq=False):
    """One braking law for each straight: u² + b u = 2 a d + v_f² at a way d before a point."""

    acceleration_m_s2: FloatArray
    jerk_m_s3: FloatArray
    final_m_s: FloatArray
    half_b_m_s: FloatArray
    """b/2: 2 a²/j, or what it is flown with."""
    beyond_m: FloatArray
    """How far beyond the target that point is; below 0: before."""

    def way_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target speeds are allowed. (n,) [m]"""
        square = speed_m_s * (speed_m_s + 2.0 * self.half_b_m_s) - self.final_m_s**2
        return np.asarray(square / (2.0 * self.acceleration_m_s2)) - self.beyond_m

    def end_m_s(self, speed_m_s: FloatArray, way_m: FloatArray) -> FloatArray:
        """Return the speeds that others come down to on ways, none below 0. (n,) [m s⁻¹]"""
        half_b = self.half_b_m_s
        square = (speed_m_s + half_b) ** 2 - 2.0 * self.acceleration_m_s2 * way_m
        return np.sqrt(np.maximum(square, half_b**2)) - half_b

    def through(self, half_b_m_s: FloatArray, speed_m_s: FloatArray, left_m: FloatArray) -> Self:
        """Return the laws with another b/2 that lead through speeds where so much way is left."""
        law = replace(self, half_b_m_s=half_b_m_s)
        return replace(law, beyond_m=law.way_m(speed_m_s) - left_m)


class AxisLaws(Columns, eq=False):
    """The braking laws of the horizontal and of the vertical axes, as rows: (2, n) each."""

    binds: BoolArray
    """Which count."""
    acceleration_m_s2: FloatArray
    jerk_m_s3: FloatArray
    final_m_s: FloatArray
    half_b_m_s: FloatArray

    def select(self, rows: IntArray | BoolArray) -> Self:
        """Return the laws of some straights."""
        return type(self)(
            **{name: one.take(rows, axis=1) for name, one in field_values(self).items()}
        )

    def put(self, rows: IntArray | BoolArray, values: Self) -> None:
        """Overwrite the laws of some straights, in place."""
        for name in field_names(self):
            getattr(self, name)[:, rows] = getattr(values, name)

    def one(self, axis: IntArray) -> BrakingLaw:
        """Return the law of one axis of each straight."""
        at = axis, np.arange(len(axis))
        return BrakingLaw(
            acceleration_m_s2=self.acceleration_m_s2[at],
            jerk_m_s3=self.jerk_m_s3[at],
            final_m_s=self.final_m_s[at],
            half_b_m_s=self.half_b_m_s[at],
            beyond_m=np.zeros(len(axis)),
        )

    def allowance(self) -> Callable[[FloatArray], FloatArray]:
        """Return what gives the speeds allowed so far from the target, infinite where unbound. (…, 2, n)"""
        half_b, twice = self.half_b_m_s, 2.0 * self.acceleration_m_s2
        half_b_squared, final_squared = half_b**2, self.final_m_s**2
        least = np.where(self.binds, self.final_m_s, np.inf)

        def allowed_m_s(left_m: FloatArray) -> FloatArray:
            square: FloatArray = twice * left_m[..., None, :]
            square += half_b_squared
            square += final_squared
            allowed = np.sqrt(square, out=square)
            allowed -= half_b
            return np.maximum(allowed, least, out=allowed)

        return allowed_m_s

    def lower(self, left_m: FloatArray) -> IntArray:
        """Return the axis that allows less at distances from the target; of equals the first. (n,)"""
        level, upright = self.allowance()(left_m)
        return np.asarray(upright < level, dtype=np.intp)

    def lowest_allowance(self) -> Callable[[FloatArray], FloatArray]:
        """Return what gives the speeds both axes allow at distances from the target. (…, n) [m s⁻¹]"""
        allowance = self.allowance()

        def allowed_m_s(left_m: FloatArray) -> FloatArray:
            allowed = allowance(left_m)
            return np.asarray(np.minimum(allowed[..., 0, :], allowed[..., 1, :]))

        return allowed_m_s

    def lowest_allowed_m_s(self, left_m: FloatArray) -> FloatArray:
        """Return the speeds both axes allow at distances from the target. (…, n) [m s⁻¹]"""
        return self.lowest_allowance()(left_m)

    def reach_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target braking from speeds begins. (…, n) [m]"""
        speed, final = speed_m_s[..., None, :], self.final_m_s
        square = speed * (speed + 2.0 * self.half_b_m_s) - final**2
        brakes = self.binds & (speed > final)
        way = np.where(brakes, square / (2.0 * self.acceleration_m_s2), 0.0)
        return np.asarray(np.maximum(way[..., 0, :], way[..., 1, :]))


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
    laws: AxisLaws


class Rises(Columns, eq=False):
    """How speeds change from those that straights begin with to their peaks, upwards or downwards."""

    from_m_s: FloatArray
    """Speed at which the ramp would begin without acceleration."""
    begun_s: FloatArray
    """Time of the ramp that lies before the straight, flown in the turn."""
    is_cut: BoolArray
    """Whether the straight ends before the ramp takes its acceleration back."""
    peak_m_s: FloatArray
    way_m: FloatArray

    def ramps(self, limits: Limits) -> Px4Ramps:
        """Return the ramps to the peak speeds."""
        change = np.abs(self.peak_m_s - self.from_m_s)
        return Px4Ramps.of(change, limits.ramp_m_s2, limits.ramp_m_s3, is_cut=self.is_cut)


class Brakings(Columns, eq=False):
    """How straights are braked: the onset at limited jerk, then one law, or two."""

    onset_s: FloatArray
    """Time in which the deceleration grows at limited jerk."""
    steady_s: FloatArray
    """Time at the deceleration it has grown to."""
    joined_m_s: FloatArray
    """Speed at which braking joins the allowed speed."""
    far: BrakingLaw
    """Law braked by first from there, like the next as it is flown."""
    near: BrakingLaw
    """Law braked by last."""
    crossing_m_s: FloatArray
    """Speed at which the near law takes over; the end speed where the far one is the only one."""
    held_m: FloatArray
    """Way at that speed, where the far law asks for no less before the near one does."""
    end_m_s: FloatArray
    final_m: FloatArray
    """Way at the end flown at the end speed: a corner speed reached before its corner."""

    @classmethod
    def none(cls, speed_m_s: FloatArray, law: BrakingLaw) -> Self:
        """Return how straights end that are not braked, at these speeds."""
        zero, every = np.zeros_like(speed_m_s), np.arange(len(speed_m_s))
        return cls(
            onset_s=zero,
            steady_s=zero.copy(),
            joined_m_s=speed_m_s.copy(),
            far=law,
            near=law.select(every),
            crossing_m_s=speed_m_s.copy(),
            held_m=zero.copy(),
            end_m_s=speed_m_s.copy(),
            final_m=zero.copy(),
        )


class Straights(Columns, eq=False):
    """How straights are flown: rise, cruise, braking."""

    rise: Rises
    cruise_m: FloatArray
    braking: Brakings

    @classmethod
    def unmoved(cls, limits: Limits, speed_m_s: FloatArray) -> Self:
        """Return straights of no length, left at the speed they are begun with."""
        zero = np.zeros_like(speed_m_s)
        rise = Rises(
            from_m_s=speed_m_s.copy(),
            begun_s=zero,
            is_cut=np.zeros(len(zero), dtype=np.bool_),
            peak_m_s=speed_m_s.copy(),
            way_m=zero.copy(),
        )
        law = limits.laws.one(np.zeros(len(zero), dtype=np.intp))
        return cls(rise=rise, cruise_m=zero.copy(), braking=Brakings.none(speed_m_s, law))


def make_rises(limits: Limits, start_m_s: FloatArray, acceleration_m_s2: FloatArray) -> Rises:
    """Return the rises of straights that begin at speeds and accelerations along them, zero or more.

    Notes
    -----
    The speed grows until the speed it would have with its acceleration taken back is that allowed by the
    way left (``VelocitySmoothing::computeDirection``), or the cruise's.  Where the cruise is not reached,
    the way goes on being used up while the acceleration turns round, and full deceleration brings the
    speed back: the 2 a/j s which the allowed speed keeps in hand are for this.
    """
    a, j, length = limits.ramp_m_s2, limits.ramp_m_s3, limits.length_m
    # An acceleration begun with must be taken back before the cruise speed.
    below = np.maximum(limits.cruise_m_s - start_m_s, 0.0)
    begun = np.minimum(np.minimum(acceleration_m_s2, a), np.sqrt(2.0 * j * below))
    begun_s = begun / j
    first = start_m_s - 0.5 * begun * begun_s
    begun_m = begun_s * (first + j * begun_s**2 / 6.0)
    total, peak = length + limits.tail_m, limits.cruise_m_s.copy()
    lowest = start_m_s + 0.5 * begun * begun_s
    until_back = _way_until_back_m(peak, first, a, j) - begun_m
    short = rows_of(until_back + limits.laws.reach_m(peak) > total)
    if len(short):
        laws, some = limits.laws.select(short), (first[short], a[short], j[short])
        least, before, whole = lowest[short], begun_m[short], total[short]
        peak[short] = root(
            lambda speed: _way_until_back_m(speed, *some) - before + laws.reach_m(speed) - whole,
            least,
            np.maximum(peak[short], least),
        )
    # Nothing above the speed begun with is allowed: the way left decides from the beginning.
    late = lowest * (1.0 + _SAME) >= peak
    late &= (begun == 0.0) | (peak < limits.cruise_m_s)
    ramped = 0.5 * (peak + first) * ramp_time_s(np.abs(peak - first), a, j) - begun_m
    held = late & ~((ramped <= length) & (peak >= limits.cruise_m_s))
    # A change within the rounding is none: it would take the square root of that.
    held |= (begun == 0.0) & (np.abs(start_m_s - peak) <= _SAME * peak)
    ramped = np.where(held, 0.0, ramped)
    peak = np.where(held, start_m_s, peak)
    is_cut = ~late & (ramped > length)
    cut = rows_of(is_cut)
    if len(cut):
        used, some = (begun_m + length)[cut], (first[cut], a[cut], j[cut])
        peak[cut] = root(lambda speed: _cut_way_m(speed, *some) - used, start_m_s[cut], peak[cut])
        ramped[cut] = _cut_way_m(peak[cut], *some) - begun_m[cut]
    return Rises(
        from_m_s=np.where(held, peak, first),
        begun_s=np.where(held, 0.0, begun_s),
        is_cut=is_cut,
        peak_m_s=peak,
        way_m=ramped,
    )


def _way_until_back_m(
    speed_m_s: FloatArray, first_m_s: FloatArray, a: FloatArray, j: FloatArray
) -> FloatArray:
    """Return the ways of ramps until their acceleration is taken back. (…, n) [m]"""
    change = speed_m_s - first_m_s
    size, back_s = np.abs(change), np.minimum(a, np.sqrt(j * np.abs(change))) / j
    whole = 0.5 * (speed_m_s + first_m_s) * ramp_time_s(size, a, j)
    return whole - back_s * (speed_m_s - np.sign(change) * j * back_s**2 / 6.0)


def _cut_way_m(
    speed_m_s: FloatArray, first_m_s: FloatArray, a: FloatArray, j: FloatArray
) -> FloatArray:
    """Return the ways of ramps up to speeds that are cut off there. (…, n) [m]"""
    time = ramp_time_s(np.maximum(speed_m_s - first_m_s, 0.0), a, j, is_cut=True)
    jerk_s = np.minimum(time, a / j)
    steady_s = time - jerk_s
    way = first_m_s * time + jerk_s**2 * j * (jerk_s / 6.0 + 0.5 * steady_s)
    return way + 0.5 * j * jerk_s * steady_s**2


def fly_straights(
    limits: Limits, start_m_s: FloatArray, acceleration_m_s2: FloatArray
) -> Straights:
    """Return how straights are flown that begin at speeds and accelerations along them, zero or more.

    Notes
    -----
    Braking is ruled as a rise is (`make_rises`): at a deceleration a' the speed is above the allowed one,
    v − a'²/2j = u.  Following it a' is about −u̇ = 2 a u/(2 u + b).  It is flown as v² + b' v = 2 a d + c,
    through where that is first met and through where it leaves.  Ten recorded stops from 3 to 12 m/s were
    0.13 to 0.62 s sooner than by u.
    """
    rise = make_rises(limits, start_m_s, acceleration_m_s2)
    peak, tail, laws = rise.peak_m_s, limits.tail_m, limits.laws
    left = limits.length_m + tail - rise.way_m
    kept = np.maximum(laws.reach_m(peak), tail)
    rows = rows_of((kept > tail) & ~rise.is_cut)
    cruise = np.maximum(left - np.where(rise.is_cut, tail, kept), 0.0)
    left = left - cruise
    if len(rows) == len(peak):
        braking = _brakings(limits, peak, left)
    else:
        braking = Brakings.none(peak, laws.one(laws.lower(left)))
        if len(rows):
            braking.put(rows, _brakings(limits.select(rows), peak[rows], left[rows]))
    return Straights(rise=rise, cruise_m=cruise, braking=braking)


def _brakings(limits: Limits, peak_m_s: FloatArray, begins_m: FloatArray) -> Brakings:
    """Return how straights are braked from their peaks on, where so much way is left."""
    onset_s, steady_s, speed, left = _onsets(limits, peak_m_s, begins_m)
    laws, tail = limits.laws, limits.tail_m
    far_axis, near_axis = laws.lower(left), laws.lower(tail)
    far = laws.one(far_axis)
    law, end, final = _alone(far, limits, speed, left)
    follows = left > tail
    braking = replace(
        Brakings.none(np.where(follows, end, speed), law),
        onset_s=onset_s,
        steady_s=steady_s,
        joined_m_s=speed,
        final_m=np.where(follows, final, 0.0),
    )
    rows = rows_of(follows & (far_axis != near_axis))
    if not len(rows):
        return braking
    far, near, end = (
        far.select(rows),
        laws.one(near_axis).select(rows),
        laws.lowest_allowed_m_s(tail),
    )
    crossing = np.maximum(_crossings_m_s(far, near), far.final_m_s)
    crosses = rows_of((crossing > end[rows]) & (crossing <= speed[rows]))
    if len(crosses):
        rows, crossing = rows[crosses], crossing[crosses]
        far, near, limits = far.select(crosses), near.select(crosses), limits.select(rows)
        # Joined while trailing the other law, it is met above what it allows.
        far = far.through(far.half_b_m_s, speed[rows], left[rows])
        leaves = np.where(crossing < speed[rows], far.way_m(crossing), left[rows])
        near_m, end, tail = near.way_m(crossing), end[rows], tail[rows]
        nears = np.minimum(near_m, leaves)
        final = np.maximum(near.way_m(end) - tail, 0.0)
        # What is met late, or asks for more than the vehicle can brake, ends the same way faster.
        softest = np.maximum(near.half_b_m_s, _softest_m_s(limits, near, crossing))
        last = near.through(softest, crossing, nears)
        faster = (softest > near.half_b_m_s) | (nears < near_m)
        crossed = replace(
            braking.select(rows),
            far=far,
            near=last,
            crossing_m_s=crossing,
            held_m=leaves - nears,
            end_m_s=np.where(faster, last.end_m_s(crossing, nears - final - tail), end),
            final_m=final,
        )
        braking.put(rows, crossed)
    return braking


def _onsets(
    limits: Limits, peak_m_s: FloatArray, begins_m: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return how speeds come down from their peaks to what the way left allows, (n,) each.

    The times in which the deceleration grows, and for which it stays, the speeds at which braking joins the
    allowed ones, and the ways left there.
    """
    a, j, tail, laws = limits.ramp_m_s2, limits.ramp_m_s3, limits.tail_m, limits.laws
    peak, begins = peak_m_s, begins_m
    # Until full deceleration, or no speed left to lose, unless the speed is allowed before: trailing,
    # that with its deceleration taken back, which has fallen twice as far.
    trails = _trails(limits, begins)
    fall = np.where(trails, 1.0, 0.5) * j
    whole = time = np.minimum(a / j, np.sqrt(peak / fall))

    falling = begins, peak, j, fall
    early = rows_of(_shortfall_m_s(whole, laws.lowest_allowance(), falling) > 0.0)
    if len(early):
        allowance, some = laws.select(early).lowest_allowance(), tuple(x[early] for x in falling)
        time, most = whole.copy(), whole[early]
        time[early] = root(lambda t: _shortfall_m_s(t, allowance, some), 1e-3 * most, most)
    ends = _fallen_m(time, peak, j) > begins - tail
    # Where t (v − j t²/6) is the way left, by the sine of an angle thrice as large.
    last_s = np.sqrt(2.0 * peak / j)
    share = quotient(1.5 * (begins - tail), peak * last_s)
    time = np.where(ends, 2.0 * last_s * np.sin(np.arcsin(clipped(share, 0.0, 1.0)) / 3.0), time)
    now = peak - 0.5 * j * time**2
    here = begins - _fallen_m(time, peak, j)
    # At the deceleration there is by now until the last of the laws allows the speed.
    goes_on = (trails | (time >= whole * (1.0 - 1e-9))) & ~ends
    rate = np.maximum(j * time, 1e-9)
    joined = _joined_m_s(limits, now, here, rate_m_s2=rate, trails=trails)
    lowest = np.minimum(*np.where(laws.binds, laws.final_m_s, np.inf))
    joined = clipped(joined, lowest, now)
    after = here - (now**2 - joined**2) / (2.0 * rate)
    short = after < tail
    stopped = np.sqrt(np.maximum(now**2 - 2.0 * rate * np.maximum(here - tail, 0.0), 0.0))
    joined = np.where(short, stopped, joined)
    return (
        time,
        np.where(goes_on, (now - joined) / rate, 0.0),
        np.where(goes_on, joined, now),
        np.maximum(np.where(ends | (goes_on & short), tail, np.where(goes_on, after, here)), tail),
    )


def _fallen_m(time_s: FloatArray, peak_m_s: FloatArray, j: FloatArray) -> FloatArray:
    """Return the ways in which decelerations grow from peak speeds. (…, n) [m]"""
    return time_s * (peak_m_s - j * time_s**2 / 6.0)


def _shortfall_m_s(
    time_s: FloatArray,
    allowance: Callable[[FloatArray], FloatArray],
    falling: tuple[FloatArray, ...],
) -> FloatArray:
    """Return what is allowed beyond what peak speeds have fallen to, by how fast they fall. (…, n)"""
    begins, peak, j, fall = falling
    here = np.maximum(begins - _fallen_m(time_s, peak, j), 0.0)
    return allowance(here) - (peak - fall * time_s**2)


def _trails(limits: Limits, left_m: FloatArray) -> BoolArray:
    """Return which straights are braked by one law, softer than the vehicle can brake. (n,)

    What asks for more is braked at full deceleration, not trailed.
    """
    laws = limits.laws
    far, near = laws.lower(left_m), laws.lower(limits.tail_m)
    softer = laws.one(far).acceleration_m_s2 <= limits.ramp_m_s2 * _SOFTER
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
    a, half_b = limits.laws.acceleration_m_s2, limits.laws.half_b_m_s
    final_m_s, j = limits.laws.final_m_s, limits.laws.jerk_m_s3
    p = 1.0 / a - 1.0 / rate_m_s2
    twice = speed_m_s**2 / rate_m_s2 - 2.0 * left_m
    joined = trailing = square = np.zeros_like(a)
    for _ in range(2):
        q = (half_b - trailing) / a
        r = twice + (trailing * (trailing - 2.0 * half_b) - final_m_s**2) / a
        square = q * q - p * r
        joined = np.maximum(quotient(-r, q + np.sqrt(np.maximum(square, 0.0))), final_m_s)
        rate = a * joined / (joined + half_b)
        trailing = np.where(trails, 0.5 * rate**2 / j, 0.0)
    # Without a crossing a law that brakes harder than the vehicle allows every speed.
    return np.asarray(np.minimum(*np.where(limits.laws.binds & (square >= 0.0), joined, np.inf)))


def _crossings_m_s(far: BrakingLaw, near: BrakingLaw) -> FloatArray:
    """Return the speeds at which two braking laws allow the same; −1 where there is none."""
    a1, a2 = far.acceleration_m_s2, near.acceleration_m_s2
    p, q = 1.0 / a1 - 1.0 / a2, far.half_b_m_s / a1 - near.half_b_m_s / a2
    r = near.final_m_s**2 / a2 - far.final_m_s**2 / a1
    square = q * q - p * r
    big = -(q + np.copysign(np.sqrt(np.maximum(square, 0.0)), q))
    first = np.divide(big, p, out=np.full_like(big, -1.0), where=p != 0.0)
    second = np.divide(r, big, out=np.full_like(big, -1.0), where=big != 0.0)
    both = np.where(second > 0.0, np.minimum(first, second), first)
    return np.where(square >= 0.0, np.where(first > 0.0, both, second), -1.0)


def _alone(
    law: BrakingLaw, limits: Limits, speed_m_s: FloatArray, left_m: FloatArray
) -> tuple[BrakingLaw, FloatArray, FloatArray]:
    """Return one law through where it is joined and where it leaves, the end speed, and the way at it.

    With b' = b; what is left then is flown at the speed it leaves with.
    """
    a, b = law.acceleration_m_s2, 2.0 * law.half_b_m_s
    leaves_m, leaves_m_s = _leaving(law, limits.tail_m, left_m)
    slower = np.maximum(speed_m_s - leaves_m_s, 0.0)
    kept = slower * (speed_m_s + leaves_m_s + b) / (2.0 * a)
    kept = np.minimum(kept, np.maximum(left_m - leaves_m, 0.0))
    some = slower > _SLOWER * (1.0 + speed_m_s)
    twice = np.divide(2.0 * a * kept, slower, out=speed_m_s + leaves_m_s + b, where=some)
    alone = 0.5 * clipped(twice - speed_m_s - leaves_m_s, _LEAST_SHARE * b, b)
    alone = np.maximum(alone, _softest_m_s(limits, law, speed_m_s))
    lone = law.through(alone, speed_m_s, left_m)
    return lone, lone.end_m_s(speed_m_s, kept), left_m - kept - limits.tail_m


def _softest_m_s(limits: Limits, law: BrakingLaw, speed_m_s: FloatArray) -> FloatArray:
    """Return b'/2 with which a law asks speeds for no more than the vehicle can brake. (n,) [m s⁻¹]

    a u/(u + b'/2) is the greatest where braking begins.  A height's law of a gentle slope asks for more.
    """
    return np.asarray(speed_m_s * (law.acceleration_m_s2 / limits.ramp_m_s2 - 1.0))


def _leaving(
    law: BrakingLaw, tail_m: FloatArray, left_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where braking by a law ends, counted to the target, and the speeds there. (n,), (n,)

    At the end of the straight; but a final speed is met as far before it as the deceleration takes to be
    taken back, t = a'/j, from where it is the allowed one: v_f t + a' t²/6.
    """
    a, final, half_b, j = law.acceleration_m_s2, law.final_m_s, law.half_b_m_s, law.jerk_m_s3
    allowed = allowed_speed_m_s(tail_m, final, a, j)
    rate = a * allowed / (allowed + half_b)
    trailing = allowed + 0.5 * rate**2 / j
    back_s = rate / j
    is_final = 2.0 * half_b * final > 2.0 * a * tail_m
    met = half_b * final / a - back_s * (final + rate * back_s / 6.0)
    within = is_final & (met > tail_m) & (met < left_m)
    # Between the two, what is above the final speed falls with the square of the time.
    reach = np.maximum(half_b * final / a - met, 1e-9)
    share = clipped((tail_m - met) / reach, 0.0, 1.0)
    above = np.where(is_final, share**2, 1.0) * (trailing - allowed)
    return np.where(within, met, tail_m), np.where(within, final, allowed + above)


def limits_along(start_m: FloatArray, end_m: FloatArray, planned: PlannedLegs) -> Limits:
    """Return what limits the speed along the straights of legs, between these ends. (n, 3)

    Notes
    -----
    The velocity points at the target; its horizontal and its vertical part both stay below what their
    axes allow, so the slower scales the whole (``clampToXYNorm``, ``clampToZNorm``).  With c and s the
    horizontal and vertical parts of the direction, an axis limited to v, a, j limits the straight to
    v/c, a/c, j/c.  Below 0.5 m/s only the slow axis is slowed: a gentle slope that ends level does not
    stop the flight.  Each of the north and east axes has the whole acceleration to itself.
    """
    parameters = planned.parameters
    direction, length = directions(end_m - start_m)
    speed, tail, jerk = planned.speed_m_s, planned.tail_m, parameters.jerk_m_s3
    parts = np.empty((2, len(length)))
    parts[0], parts[1] = level, upright = horizontal(direction), np.abs(direction[:, 2])
    shares = np.maximum(parts, 1e-9)
    vertical_speed, vertical = vertical_limits(direction[:, 2] > 0.0, parameters)
    low = planned.is_takeoff & ~planned.takeoffs.is_free
    acceleration = np.empty_like(shares)
    acceleration[0] = parameters.acceleration_m_s2
    acceleration[1] = np.where(low, takeoff_acceleration_m_s2(parameters), vertical)
    cruise = np.minimum(speed / shares[0], vertical_speed / shares[1])

    final = planned.final_level_m_s
    at_end = np.minimum(speed, allowed_speed_m_s(level * tail, final, acceleration[0], jerk))
    steep = upright > level
    binds = np.empty_like(shares, dtype=np.bool_)
    binds[0] = ~steep | (level * cruise >= CLAMPED_M_S)
    binds[1] = steep | (at_end * upright >= CLAMPED_M_S * shares[0])

    # Acceleration: the axis that takes longest sets the time of all.
    axes = shares.copy()
    axes[0] = np.maximum(greatest(np.abs(direction[:, :2])), 1e-9)
    level_s, upright_s = ramp_time_s(cruise * axes, acceleration, jerk)
    share = np.where(upright_s > level_s, axes[1], axes[0])
    brake_m_s2, brake_m_s3 = acceleration / shares, jerk / shares
    return Limits(
        direction=direction,
        length_m=length,
        tail_m=tail,
        cruise_m_s=cruise,
        ramp_m_s2=np.where(upright_s > level_s, acceleration[1], acceleration[0]) / share,
        ramp_m_s3=jerk / share,
        laws=AxisLaws(
            binds=binds,
            acceleration_m_s2=brake_m_s2,
            jerk_m_s3=brake_m_s3,
            final_m_s=np.array((final, planned.final_upright_m_s)) / shares,
            half_b_m_s=half_b_m_s(brake_m_s2, brake_m_s3),
        ),
    )
