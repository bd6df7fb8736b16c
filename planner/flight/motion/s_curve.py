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
_LEAST = 1e-300
"""Keeps a quotient finite."""
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
        speed = acceleration * (0.5 * jerking + steady)
        way = acceleration * (jerking * jerking / 6.0 + 0.5 * steady * since)
        # The jerk falls gradually: the acceleration is all there only when it has.
        rising = since < self.jerk_s + self.rest_s
        return way, speed, np.where(rising, acceleration * _ALMOST, acceleration)

    def speed_after(self, time_s: FloatArray) -> FloatArray:
        """Return the speed gained a time after the beginning, at any time."""
        duration = self.duration_s
        time = np.clip(time_s, 0.0, duration)
        is_late = time > 0.5 * duration
        _, speed, _ = self.begun(np.where(is_late, duration - time, time))
        return np.where(is_late, self.change_m_s - speed, speed)


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
    for _ in range(_NEWTON_ROUNDS):  # of no length x is 0, and stays
        x -= (x * x * (x - rise) - volume) / np.maximum(x * (3.0 * x - 2.0 * rise), _LEAST)
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


_SECANTS, _BISECTIONS = 20, 40
"""Nearly all roots are found to the last place after ten secants; those that are not, by halvings."""
_FOUND = 1e-15
"""Change of a root, over its value, that it is found to."""
_ROOM_RISES = 12.0
"""``SCurve::set_speed_max`` changes the speed where the cruise is longer than so many jerk rises. [-]"""


class PlannedCurves(NamedTuple):
    """What S-curves were planned with before the speed along them was changed under way."""

    speed_m_s: FloatArray
    """Speed limit they were planned with. (n,) [m s⁻¹]"""
    changed_s: FloatArray
    """Time from their beginning at which it was changed. (n,) [s]"""
    is_changed: BoolArray
    """Whether it was. (n,)"""


class SCurves(Value, eq=False):
    """Motion along lines, one per row: wait, speed up, perhaps change speed, cruise, slow down."""

    length_m: FloatArray
    start_m_s: FloatArray
    """Speed at the beginning. (n,) [m s⁻¹]"""
    end_m_s: FloatArray
    """Speed at the end. (n,) [m s⁻¹]"""
    peak_m_s: FloatArray
    """Speed of the cruise. (n,) [m s⁻¹]"""
    first_m_s: FloatArray
    """Speed reached from the beginning: the peak, unless the speed is changed under way. (n,) [m s⁻¹]"""
    up: SpeedRamps
    """From the speed at the beginning to the first speed."""
    change: SpeedRamps | None
    """From the first speed to the peak, up or down; ``None`` where no row has one."""
    down: SpeedRamps
    """From the peak to the last speed, backwards in time a ramp as well."""
    wait_s: FloatArray
    """Time before anything moves. (n,) [s]"""
    cruise_s: FloatArray

    @property
    def duration_s(self) -> FloatArray:
        """Duration of each curve. (n,) [s]"""
        up_s = self.up.duration_s
        if self.change is not None:
            up_s = up_s + self.change.duration_s
        return self.wait_s + up_s + self.cruise_s + self.down.duration_s

    @property
    def beyond_m(self) -> FloatArray:
        """How far each leads on beyond the end of its line, which it cannot brake for. (n,) [m]"""
        way_m = 0.5 * (self.start_m_s + self.first_m_s) * self.up.duration_s
        way_m += 0.5 * (self.peak_m_s + self.end_m_s) * self.down.duration_s
        if self.change is not None:
            way_m += 0.5 * (self.first_m_s + self.peak_m_s) * self.change.duration_s
        return np.asarray(way_m - self.length_m)

    def phases(self) -> Phases:
        """Return the parts of constant jerk.

        The last five are the cruise and the braking; the rests of the ramps are part of what they
        rest in.
        """
        zero = np.zeros_like(self.length_m)
        durations, jerks = [self.wait_s], [zero]
        sign = np.where(self.peak_m_s < self.first_m_s, -1.0, 1.0)
        for ramps, way in ((self.up, 1.0), (self.change, sign)):
            if ramps is not None:
                durations[-1] = durations[-1] + ramps.rest_s
                durations += [ramps.jerk_s, ramps.steady_s, ramps.jerk_s, ramps.rest_s]
                jerks += [way * ramps.jerk_m_s3, zero, -way * ramps.jerk_m_s3, zero]
        down = self.down
        durations[-1] = durations[-1] + self.cruise_s + down.rest_s
        durations += [down.jerk_s, down.steady_s, down.jerk_s, down.rest_s]
        jerks += [-down.jerk_m_s3, zero, down.jerk_m_s3, zero]
        duration, jerk = np.column_stack(durations), np.column_stack(jerks)
        return Phases.after(self.start_m_s, duration, jerk)

    def at(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return way and speed a time after the beginning of each curve, within it. (n,) each"""
        phases = self.phases()
        rows = np.arange(len(time_s))
        part = np.maximum((phases.start_s <= time_s[:, None]).sum(axis=1) - 1, 0)
        t = time_s - phases.start_s[rows, part]
        speed, acceleration = phases.speed_m_s[rows, part], phases.acceleration_m_s2[rows, part]
        jerk = phases.jerk_m_s3[rows, part]
        way = phases.way_m[rows, part] + t * (speed + t * (0.5 * acceleration + t * jerk / 6.0))
        return way, speed + t * (acceleration + 0.5 * t * jerk)


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
    planned: PlannedCurves | None = None,
    wait_s: FloatArray | None = None,
) -> SCurves:
    """Return the fastest motion along lines within limits.

    By default they begin and end at rest; speeds at the ends are never above the limit.  ``planned`` is
    what lines from rest were planned with before the limit became what it is (:func:`_changed`).
    ``wait_s`` is the time before anything moves.
    """
    zero = np.zeros_like(length_m)
    start = zero if start_m_s is None else np.minimum(start_m_s, speed_m_s)
    end = zero if end_m_s is None else np.minimum(end_m_s, speed_m_s)
    peak_from_rest = peak_speed_from_rest_m_s(length_m, limits)
    peak = np.minimum(speed_m_s, peak_from_rest)
    moving = np.flatnonzero((start > 0.0) | (end > 0.0))
    if len(moving):
        peak[moving] = _peak_between(
            length_m[moving], start[moving], end[moving], speed_m_s[moving], limits.select(moving)
        )
        # A speed that the length cannot take away or build up is left out at the end.
        start, end = np.minimum(start, peak), np.minimum(end, peak)
    first, change = peak, None
    if planned is not None and planned.is_changed.any():
        rows = np.flatnonzero(planned.is_changed)
        start, first, peak = start.copy(), peak.copy(), peak.copy()
        first[rows], peak[rows] = _changed(
            length_m[rows],
            np.minimum(planned.speed_m_s, peak_from_rest)[rows],
            speed_m_s[rows],
            start_m_s=(zero if start_m_s is None else start_m_s)[rows],
            changed_s=planned.changed_s[rows],
            end_m_s=(zero if end_m_s is None else end_m_s)[rows],
            limits=limits.select(rows),
        )
        start[rows] = np.minimum((zero if start_m_s is None else start_m_s)[rows], first[rows])
        change = speed_ramps(np.abs(peak - first), limits)
    up = speed_ramps(first - start, limits)
    if change is not None:
        ramps_m = 0.5 * ((start + first) * up.duration_s + (first + peak) * change.duration_s)
        end = np.minimum(end, peak)
        rows = rows[end[rows] > 0.0]
        end[rows] = _braked_m_s(
            (length_m - ramps_m)[rows], end[rows], peak[rows], limits.select(rows)
        )
    down = up if change is None and start is end else speed_ramps(peak - end, limits)
    ramps_m = 0.5 * ((start + first) * up.duration_s + (end + peak) * down.duration_s)
    if change is not None:
        ramps_m += 0.5 * (first + peak) * change.duration_s
    left_m = np.maximum(length_m - ramps_m, 0.0)
    return SCurves(
        length_m=length_m,
        start_m_s=start,
        end_m_s=end,
        peak_m_s=peak,
        first_m_s=first,
        up=up,
        change=change,
        down=down,
        wait_s=zero if wait_s is None else wait_s,
        cruise_s=quotient(left_m, peak),
    )


def _changed(
    length_m: FloatArray,
    planned_m_s: FloatArray,
    speed_m_s: FloatArray,
    *,
    changed_s: FloatArray,
    start_m_s: FloatArray,
    end_m_s: FloatArray,
    limits: SpeedLimits,
) -> tuple[FloatArray, FloatArray]:
    """Return first speeds and peaks of lines whose speed is changed under way.

    Lines from rest speed up then; the others are at the speed they were planned with, ``start_m_s``.

    Notes
    -----
    ``SCurve::set_speed_max``.  Only what is left of the steady acceleration (``SEG_ACCEL_MAX``) can be
    cut short, so a lower speed is not lower than what the jerks alone come to.  Any further change is
    made in what is a cruise then, if it takes longer than 12 jerk rises, and within half its length; up
    to no more than the speed at which it takes that long.
    """
    ramps = speed_ramps(planned_m_s, limits)
    rise = 2.0 * ramps.rest_s
    # The jerk falls for a whole rise before and after the steady acceleration proper.
    steady_begins = ramps.jerk_s + rise
    steady_s = np.maximum(ramps.steady_s - rise, 0.0)
    left_s = np.clip(steady_begins + steady_s - changed_s, 0.0, steady_s)
    first = np.minimum(
        planned_m_s, np.maximum(speed_m_s, planned_m_s - ramps.acceleration_m_s2 * left_s)
    )
    first = np.where(start_m_s > 0.0, start_m_s, first)
    ramps_m = 0.5 * first * speed_ramps(first - start_m_s, limits).duration_s
    end = np.minimum(end_m_s, first)
    ramps_m += 0.5 * (first + end) * speed_ramps(first - end, limits).duration_s
    cruise_m = np.maximum(length_m - ramps_m, 0.0)
    fitting_s = np.cbrt(np.abs(speed_m_s - first) * limits.jerk_rise_s / (2.0 * limits.jerk_m_s3))
    room_s = _ROOM_RISES * np.minimum(fitting_s, limits.jerk_rise_s)
    slower = (speed_m_s < first) & (first * room_s < cruise_m)
    faster = (speed_m_s > first) & (first * room_s < cruise_m)
    goal = np.where(faster, np.minimum(speed_m_s, quotient(cruise_m, room_s, np.inf)), speed_m_s)
    low, most = np.minimum(first, goal), np.abs(goal - first)
    change = _highest(
        lambda by: (low + 0.5 * by) * speed_ramps(by, limits).duration_s - 0.5 * cruise_m,
        np.zeros_like(most),
        most,
    )
    peak = np.where(slower, first - change, np.where(faster, first + change, first))
    return first, peak


def _braked_m_s(
    length_m: FloatArray, end_m_s: FloatArray, peak_m_s: FloatArray, limits: SpeedLimits
) -> FloatArray:
    """Return the speeds at the ends of lines that are to be braked to speeds lowered under way. (n,) [m s⁻¹]

    Notes
    -----
    ``SCurve::set_speed_max`` takes off what could be sped up from the end backwards in the length that is
    left, of a speed that is higher: where that does not come to all of it, the target flies on beyond the
    end until it is taken off.
    """
    gained = speed_after_m_s(np.maximum(length_m, 0.0), end_m_s, peak_m_s, limits)
    return np.asarray(peak_m_s - (gained - end_m_s))


def peak_speed_from_start_m_s(
    length_m: FloatArray, start_m_s: FloatArray, speed_m_s: FloatArray, limits: SpeedLimits
) -> FloatArray:
    """Return the highest speed that lines begun in motion come to within half their length. (n,) [m s⁻¹]

    Notes
    -----
    ``SCurve::set_origin_speed_max``: the new speeding up is planned for half the track, to no more than
    what it was planned for from rest.
    """
    most = np.minimum(speed_m_s, peak_speed_from_rest_m_s(length_m, limits))
    start = np.minimum(start_m_s, most)
    return _highest(
        lambda peak: (start + peak) * speed_ramps(peak - start, limits).duration_s - length_m,
        start,
        most,
    )


def speed_after_m_s(
    length_m: FloatArray, start_m_s: FloatArray, speed_m_s: FloatArray, limits: SpeedLimits
) -> FloatArray:
    """Return the highest speeds reached at the ends of lines begun in motion."""
    start = np.minimum(start_m_s, speed_m_s)
    return _highest(
        lambda end: 0.5 * (start + end) * speed_ramps(end - start, limits).duration_s - length_m,
        start,
        speed_m_s,
    )


def _peak_between(
    length_m: FloatArray,
    start_m_s: FloatArray,
    end_m_s: FloatArray,
    speed_m_s: FloatArray,
    limits: SpeedLimits,
) -> FloatArray:
    """Return the highest speed on ways that begin or end in motion."""

    def excess(peak: FloatArray) -> FloatArray:
        needed = np.zeros_like(peak)
        for other in (start_m_s, end_m_s):
            ends = np.minimum(other, peak)
            needed += 0.5 * (ends + peak) * speed_ramps(peak - ends, limits).duration_s
        return needed - length_m

    return _highest(excess, np.zeros_like(speed_m_s), speed_m_s)


def _highest(
    excess: Callable[[FloatArray], FloatArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the highest values between two whose excess, which only grows, is not above 0.

    ``low`` where there is none.  By secants between a value below and one above; of an end that is kept
    twice in a row the excess counts half (the Illinois rule).  Where it rises as a cube root, by halvings.
    """
    least, most, root = low, high, high
    below, above = lowest, highest = excess(low), excess(high)
    was_over = np.zeros(root.shape, np.bool_)
    was_under = was_over
    for _ in range(_SECANTS):
        before = root
        root = most - quotient((most - least) * above, above - below)
        is_found = np.abs(root - before) <= _FOUND * np.abs(root)
        if is_found.all():
            break
        found = excess(root)
        is_over = found > 0.0
        below, above = (
            np.where(is_over, np.where(was_over, 0.5 * below, below), found),
            np.where(is_over, found, np.where(was_under, 0.5 * above, above)),
        )
        least, most = np.where(is_over, least, root), np.where(is_over, root, most)
        was_over, was_under = is_over, ~is_over
    else:
        halved, _ = bisected(lambda value: excess(value) <= 0.0, low, high, _BISECTIONS)
        root = np.where(is_found, root, halved)
    return np.where(highest <= 0.0, high, np.where(lowest > 0.0, low, root))


def bisected(
    holds: Callable[[FloatArray], BoolArray],
    low: FloatArray,
    high: FloatArray,
    rounds: int,
    *,
    at_once: int = 1,
) -> tuple[FloatArray, FloatArray]:
    """Return bounds of where something ceases to hold, after so many halvings. (n,)

    So many of them ``at_once``: it is asked for rows of values then, (rows, n).
    """
    width = high - low
    if at_once == 1:
        for _ in range(rounds):
            width = 0.5 * width
            middle = low + width
            low = np.where(holds(middle), middle, low)
        return low, low + width
    steps = np.arange(1.0, 2.0**at_once)[:, None]
    for _ in range(rounds // at_once):
        width = 0.5**at_once * width
        low = low + width * np.count_nonzero(holds(low + steps * width), axis=0)
    return low, low + width
