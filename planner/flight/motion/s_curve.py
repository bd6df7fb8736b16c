"""S-curves: motion along a line with limited speed, acceleration, jerk and snap, in closed form.

After ArduPilot's ``AP_Math/SCurve.cpp``.  A change of speed has up to seven parts: the jerk rises,
holds, falls; the acceleration holds; and the same mirrored.  ArduPilot lets the jerk rise along a
raised cosine for t_j.  Here a rise is a step at its middle, so that all motion is cubic in time: jerk
ramps of t_j shift the whole by t_j/2 on either side and lengthen the steady acceleration by t_j, which
keeps accelerations, speeds and durations as they are and moves positions by less than
J t_j² t / 40 (2 mm/s for 1 m/s³ and 0.3 s).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner.flight.motion.kinematics import Columns, quotient
from planner.values import Value, field_values

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.arrays import BoolArray, FloatArray, IntArray


class SpeedLimits(NamedTuple):
    """What a change of speed keeps to, one row each."""

    acceleration_m_s2: FloatArray
    jerk_m_s3: FloatArray
    jerk_rise_s: FloatArray
    """Time t_j the jerk takes to rise to its limit. (n,) [s]"""

    def select(self, rows: IntArray | BoolArray) -> SpeedLimits:
        """Return the limits of some rows."""
        return SpeedLimits(*(limit[rows] for limit in self))


_NEWTON_ROUNDS = 8
"""The cubic is convex beyond its root: from above, Newton halves its error at least."""
_ALMOST = 1.0 - 1e-6
"""Part of an acceleration that is nearly reached. [-]"""


class SpeedRamps(Columns, eq=False):
    """Changes of speed: rest, jerk, steady acceleration, jerk back, rest; one per row."""

    change_m_s: FloatArray
    """Change of speed, zero or more; the ramp is the same backwards. (n,) [m s⁻¹]"""
    acceleration_m_s2: FloatArray
    """Greatest acceleration reached. (n,) [m s⁻²]"""
    jerk_m_s3: FloatArray
    rest_s: FloatArray
    """Time before and after, in which the jerk is on its way. (n,) [s]"""
    jerk_s: FloatArray
    """Time of either jerk. (n,) [s]"""
    steady_s: FloatArray
    """Time of steady acceleration. (n,) [s]"""

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each ramp. (n,) [s]"""
        return 2.0 * (self.rest_s + self.jerk_s) + self.steady_s

    def beside(self, other: SpeedRamps) -> SpeedRamps:
        """Return these ramps and others in two rows. (2, n)"""
        columns = field_values(self).items()
        return SpeedRamps(**{name: np.stack((own, getattr(other, name))) for name, own in columns})

    def begun(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return way, speed and acceleration a time after the beginning, from rest.

        Only in the first half of the ramp, which is all that corners ask for.
        """
        since = np.maximum(time_s - self.rest_s, 0.0)
        jerking = np.minimum(since, self.jerk_s)
        steady = since - jerking
        acceleration = self.jerk_m_s3 * jerking
        speed = 0.5 * acceleration * jerking + acceleration * steady
        way = jerking * (acceleration * jerking / 6.0 + 0.5 * acceleration * steady)
        way += 0.5 * acceleration * steady**2
        # The jerk falls gradually: the acceleration is all there only when it has.
        rising = since < self.jerk_s + self.rest_s
        return way, speed, np.where(rising, acceleration * _ALMOST, acceleration)


def speed_ramps(change_m_s: FloatArray, limits: SpeedLimits) -> SpeedRamps:
    """Return the fastest changes of speed within limits.

    ``SCurve::calculate_path``: ΔV = a (t_j + a/J) without steady acceleration, ΔV = A (t_j + A/J + t_4) with
    it.  Where the whole limits do not fit, the rise is shortened at the same snap.
    """
    fitting_s = np.cbrt(change_m_s * limits.jerk_rise_s / (2.0 * limits.jerk_m_s3))
    rise, jerk = _shortened(fitting_s, limits)
    half = 0.5 * jerk * rise
    reached = np.sqrt(half**2 + jerk * change_m_s) - half
    acceleration = np.minimum(limits.acceleration_m_s2, reached)
    moving = acceleration > 0.0
    jerk_s = np.divide(acceleration, jerk, out=np.zeros_like(jerk), where=moving)
    return SpeedRamps(
        change_m_s=change_m_s,
        acceleration_m_s2=acceleration,
        jerk_m_s3=jerk,
        rest_s=np.where(moving, 0.5 * rise, 0.0),
        jerk_s=jerk_s,
        steady_s=np.maximum(quotient(change_m_s, acceleration) - jerk_s, 0.0),
    )


def peak_speed_from_rest_m_s(length_m: FloatArray, limits: SpeedLimits) -> FloatArray:
    """Return the highest speed on the way from rest to rest where no speed limit holds. (n,) [m s⁻¹]

    Each half of the way is one ramp: V (V/A + A/J + t_j) = L with steady acceleration, and 2 a (t_j + a/J)² =
    L without: x = t_j + a/J solves x³ − t_j x² = L/2J.
    """
    most = limits.acceleration_m_s2
    fitting_s = np.sqrt(np.sqrt(length_m * limits.jerk_rise_s / (8.0 * limits.jerk_m_s3)))
    rise, jerk = _shortened(fitting_s, limits)
    safe_jerk = np.where(jerk > 0.0, jerk, 1.0)
    volume = length_m / (2.0 * safe_jerk)
    x = rise + np.cbrt(volume)
    for _ in range(_NEWTON_ROUNDS):
        x -= quotient(x * x * (x - rise) - volume, x * (3.0 * x - 2.0 * rise))
    reached = jerk * (x - rise)
    ramp_s = most / safe_jerk + rise
    steady = 0.5 * (np.sqrt((most * ramp_s) ** 2 + 4.0 * most * length_m) - most * ramp_s)
    return np.where(reached < most, reached * x, steady)


def _shortened(fitting_s: FloatArray, limits: SpeedLimits) -> tuple[FloatArray, FloatArray]:
    """Return rise and jerk where the whole rise does not fit: snap stays, π J / 2 t_j."""
    most, jerk_m_s3, rise_s = limits
    limit = np.sqrt(most * rise_s / jerk_m_s3)
    rise = np.minimum(np.minimum(rise_s, fitting_s), limit)
    return rise, jerk_m_s3 * quotient(rise, rise_s, 1.0)


_BISECTIONS = 40
_ROOM_RISES = 12.0


class SCurves(Value, eq=False):
    """Motion along lines, one per row: wait, speed up, perhaps speed up again, cruise, slow down."""

    length_m: FloatArray
    start_m_s: FloatArray
    """Speed at the beginning. (n,) [m s⁻¹]"""
    end_m_s: FloatArray
    """Speed at the end. (n,) [m s⁻¹]"""
    peak_m_s: FloatArray
    up: SpeedRamps
    """From the speed at the beginning to the peak, or to a first lower speed."""
    again: SpeedRamps | None
    """From that first speed to the peak; ``None`` where no row has one."""
    down: SpeedRamps
    """From the peak to the last speed, backwards in time a ramp as well."""
    wait_s: FloatArray
    """Time before anything moves. (n,) [s]"""
    cruise_s: FloatArray

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each curve. (n,) [s]"""
        up_s = self.up.duration_s
        if self.again is not None:
            up_s = up_s + self.again.duration_s
        return self.wait_s + up_s + self.cruise_s + self.down.duration_s

    def phases(self) -> Phases:
        """Return the parts of constant jerk.

        The last five are the cruise and the braking; the rests of the ramps are part of what they
        rest in.
        """
        zero = np.zeros_like(self.length_m)
        durations, jerks = [self.wait_s], [zero]
        for ramps in (self.up, self.again):
            if ramps is not None:
                durations[-1] = durations[-1] + ramps.rest_s
                durations += [ramps.jerk_s, ramps.steady_s, ramps.jerk_s, ramps.rest_s]
                jerks += [ramps.jerk_m_s3, zero, -ramps.jerk_m_s3, zero]
        down = self.down
        durations[-1] = durations[-1] + self.cruise_s + down.rest_s
        durations += [down.jerk_s, down.steady_s, down.jerk_s, down.rest_s]
        jerks += [-down.jerk_m_s3, zero, down.jerk_m_s3, zero]
        duration, jerk = np.column_stack(durations), np.column_stack(jerks)
        return Phases.after(self.start_m_s, duration, jerk)


class Phases(Value, eq=False):
    """Parts of constant jerk, one after the other along each line: k columns."""

    start_s: FloatArray
    """Beginning of each part, since the beginning of the line. (n, k) [s]"""
    way_m: FloatArray
    """Way at the beginning of each part. (n, k) [m]"""
    speed_m_s: FloatArray
    acceleration_m_s2: FloatArray
    jerk_m_s3: FloatArray

    @classmethod
    def after(cls, start_m_s: FloatArray, duration_s: FloatArray, jerk_m_s3: FloatArray) -> Phases:
        """Return the phases that follow from speeds at the beginning, durations and jerks."""
        t, j = duration_s, jerk_m_s3
        a = _summed_before(0.0, j * t)
        v = _summed_before(start_m_s, t * (a + 0.5 * j * t))
        return cls(
            start_s=_summed_before(0.0, t),
            way_m=_summed_before(0.0, t * (v + t * (0.5 * a + j * t / 6.0))),
            speed_m_s=v,
            acceleration_m_s2=a,
            jerk_m_s3=j,
        )


def _summed_before(first: FloatArray | float, change: FloatArray) -> FloatArray:
    """Return what has come together by the beginning of each part, from a first value. (n, k)"""
    total = np.empty_like(change)
    total[:, 0] = first
    total[:, 1:] = change[:, :-1]
    return np.cumsum(total, axis=1, out=total)


def s_curves(
    length_m: FloatArray,
    limits: SpeedLimits,
    *,
    speed_m_s: FloatArray,
    start_m_s: FloatArray | None = None,
    end_m_s: FloatArray | None = None,
    first_m_s: FloatArray | None = None,
    wait_s: FloatArray | None = None,
) -> SCurves:
    """Return the fastest motion along lines within limits.

    By default they begin and end at rest; speeds at the ends are never above the limit.  Lines from rest
    are planned with ``first_m_s`` first; where it is below the limit they speed up to it and then once
    more, as ``SCurve::set_speed_max`` has it.  ``wait_s`` is the time before anything moves.
    """
    zero = np.zeros_like(length_m)
    start = zero if start_m_s is None else np.minimum(start_m_s, speed_m_s)
    end = zero if end_m_s is None else np.minimum(end_m_s, speed_m_s)
    peak = np.minimum(speed_m_s, peak_speed_from_rest_m_s(length_m, limits))
    moving = np.flatnonzero((start > 0.0) | (end > 0.0))
    if len(moving):
        peak[moving] = _peak_between(
            length_m[moving], start[moving], end[moving], speed_m_s[moving], limits.select(moving)
        )
        # A speed that the length cannot take away or build up is left out at the end.
        start, end = np.minimum(start, peak), np.minimum(end, peak)
    again = None
    first = peak
    if first_m_s is not None and (first_m_s < peak).any():
        first, peak = _peak_again(length_m, first_m_s, peak, end, limits)
        end = np.minimum(end, peak)
        again = speed_ramps(peak - first, limits)
    up = speed_ramps(first - start, limits)
    down = up if again is None and start is end else speed_ramps(peak - end, limits)
    ramps_m = 0.5 * ((start + first) * up.duration_s + (end + peak) * down.duration_s)
    if again is not None:
        ramps_m += 0.5 * (first + peak) * again.duration_s
    left_m = np.maximum(length_m - ramps_m, 0.0)
    return SCurves(
        length_m=length_m,
        start_m_s=start,
        end_m_s=end,
        peak_m_s=peak,
        up=up,
        again=again,
        down=down,
        wait_s=zero if wait_s is None else wait_s,
        cruise_s=quotient(left_m, peak),
    )


def _peak_again(
    length_m: FloatArray,
    first_m_s: FloatArray,
    peak_m_s: FloatArray,
    end_m_s: FloatArray,
    limits: SpeedLimits,
) -> tuple[FloatArray, FloatArray]:
    """Return first speed and peak where lines from rest speed up twice.

    The second time needs 12 jerk rises at the first speed between speeding up and slowing down
    (``SCurve::set_speed_max``); where they are not there, the first speed stays.
    """
    first = np.minimum(first_m_s, peak_m_s)
    ramp_s = speed_ramps(first, limits).duration_s
    room = length_m - first * ramp_s
    twice = (first < peak_m_s) & (room > _ROOM_RISES * limits.jerk_rise_s * first)
    rows = limits.select(twice)
    begun, last = first[twice], end_m_s[twice]
    length = length_m[twice] - 0.5 * (first * ramp_s)[twice]

    def fits(peak: FloatArray) -> BoolArray:
        more = 0.5 * (begun + peak) * speed_ramps(peak - begun, rows).duration_s
        end = np.minimum(last, peak)
        return more + 0.5 * (end + peak) * speed_ramps(peak - end, rows).duration_s <= length

    peak = first.copy()
    peak[twice] = _highest(fits, begun, peak_m_s[twice])
    return first, peak


def _peak_between(
    length_m: FloatArray,
    start_m_s: FloatArray,
    end_m_s: FloatArray,
    speed_m_s: FloatArray,
    limits: SpeedLimits,
) -> FloatArray:
    """Return the highest speed on ways that begin or end in motion, by bisection."""

    def fits(peak: FloatArray) -> BoolArray:
        needed = np.zeros_like(peak)
        for other in (start_m_s, end_m_s):
            ends = np.minimum(other, peak)
            needed += 0.5 * (ends + peak) * speed_ramps(peak - ends, limits).duration_s
        return needed <= length_m

    return _highest(fits, np.zeros_like(speed_m_s), speed_m_s)


def _highest(
    fits: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the highest values between two that fit; ``low`` where none does."""
    return np.where(fits(high), high, bisected(fits, low, high, _BISECTIONS)[0])


def bisected(
    holds: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray, rounds: int
) -> tuple[FloatArray, FloatArray]:
    """Return bounds of where something ceases to hold, after so many halvings."""
    for _ in range(rounds):
        middle = 0.5 * (low + high)
        good = holds(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return low, high
