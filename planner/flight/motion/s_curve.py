"""S-curves: motion along a line with limited speed, acceleration, jerk and snap, in closed form.

After ArduPilot's ``AP_Math/SCurve.cpp``.  A change of speed has up to seven parts: the jerk rises,
holds, falls; the acceleration holds; and the same mirrored.  ArduPilot lets the jerk rise along a
raised cosine for t_j.  Here a rise is a step at its middle, so that all motion is cubic in time: jerk
ramps of t_j shift the whole by t_j/2 on either side and lengthen the steady acceleration by t_j, which
keeps accelerations, speeds and durations as they are and moves positions by less than
J t_j² t / 40 (2 mm/s for 1 m/s³ and 0.3 s).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.speed_ramps import SpeedRamps, peak_speed_from_rest_m_s, speed_ramps
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.flight.motion.kinematics import BoolArray, FloatArray

_BISECTIONS = 40
_ROOM_RISES = 12.0


@frozen(eq=False)
class SCurves:
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


@frozen(eq=False)
class Phases:
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
    *,
    speed_m_s: FloatArray,
    acceleration_m_s2: FloatArray,
    jerk_m_s3: FloatArray,
    jerk_rise_s: FloatArray,
    start_m_s: FloatArray | None = None,
    end_m_s: FloatArray | None = None,
    first_m_s: FloatArray | None = None,
    wait_s: FloatArray | None = None,
) -> SCurves:
    """Return the fastest motion along lines within limits.

    Parameters
    ----------
    length_m : ndarray
        Lengths, greater than zero. (n,) [m]
    speed_m_s, acceleration_m_s2, jerk_m_s3 : ndarray
        Limits along each line. (n,) [m s⁻¹, m s⁻², m s⁻³]
    jerk_rise_s : ndarray
        Time the jerk takes to rise to its limit. (n,) [s]
    start_m_s, end_m_s : ndarray, optional
        Speeds at the ends; default at rest, and never above the limit. (n,) [m s⁻¹]
    first_m_s : ndarray, optional
        Lower speed that lines from rest are planned with first; where it is below the limit they speed
        up to it and then once more, as ``SCurve::set_speed_max`` has it; default infinite. (n,) [m s⁻¹]
    wait_s : ndarray, optional
        Time before anything moves; default none. (n,) [s]
    """
    limits = {
        "acceleration_m_s2": acceleration_m_s2,
        "jerk_m_s3": jerk_m_s3,
        "jerk_rise_s": jerk_rise_s,
    }
    zero = np.zeros_like(length_m)
    start = zero if start_m_s is None else np.minimum(start_m_s, speed_m_s)
    end = zero if end_m_s is None else np.minimum(end_m_s, speed_m_s)
    peak = np.minimum(speed_m_s, peak_speed_from_rest_m_s(length_m, **limits))
    moving = np.flatnonzero((start > 0.0) | (end > 0.0))
    if len(moving):
        peak[moving] = _peak_between(
            length_m[moving],
            start[moving],
            end[moving],
            speed_m_s[moving],
            {name: limit[moving] for name, limit in limits.items()},
        )
        # A speed that the length cannot take away or build up is left out at the end.
        start, end = np.minimum(start, peak), np.minimum(end, peak)
    again = None
    first = peak
    if first_m_s is not None and (first_m_s < peak).any():
        first, peak = _peak_again(length_m, first_m_s, peak, end, limits)
        end = np.minimum(end, peak)
        again = speed_ramps(peak - first, **limits)
    up = speed_ramps(first - start, **limits)
    down = up if again is None and start is end else speed_ramps(peak - end, **limits)
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
        cruise_s=np.divide(left_m, peak, out=np.zeros_like(peak), where=peak > 0.0),
    )


def _peak_again(
    length_m: FloatArray,
    first_m_s: FloatArray,
    peak_m_s: FloatArray,
    end_m_s: FloatArray,
    limits: dict[str, FloatArray],
) -> tuple[FloatArray, FloatArray]:
    """Return first speed and peak where lines from rest speed up twice.

    The second time needs 12 jerk rises at the first speed between speeding up and slowing down
    (``SCurve::set_speed_max``); where they are not there, the first speed stays.
    """
    first = np.minimum(first_m_s, peak_m_s)
    ramp_s = speed_ramps(first, **limits).duration_s
    room = length_m - first * ramp_s
    twice = (first < peak_m_s) & (room > _ROOM_RISES * limits["jerk_rise_s"] * first)
    rows = {name: limit[twice] for name, limit in limits.items()}
    begun, last = first[twice], end_m_s[twice]
    length = length_m[twice] - 0.5 * (first * ramp_s)[twice]

    def fits(peak: FloatArray) -> BoolArray:
        more = 0.5 * (begun + peak) * speed_ramps(peak - begun, **rows).duration_s
        end = np.minimum(last, peak)
        return more + 0.5 * (end + peak) * speed_ramps(peak - end, **rows).duration_s <= length

    peak = first.copy()
    peak[twice] = _highest(fits, begun, peak_m_s[twice])
    return first, peak


def _peak_between(
    length_m: FloatArray,
    start_m_s: FloatArray,
    end_m_s: FloatArray,
    speed_m_s: FloatArray,
    limits: dict[str, FloatArray],
) -> FloatArray:
    """Return the highest speed on ways that begin or end in motion, by bisection."""

    def fits(peak: FloatArray) -> BoolArray:
        needed = np.zeros_like(peak)
        for other in (start_m_s, end_m_s):
            ends = np.minimum(other, peak)
            needed += 0.5 * (ends + peak) * speed_ramps(peak - ends, **limits).duration_s
        return needed <= length_m

    return _highest(fits, np.zeros_like(speed_m_s), speed_m_s)


def _highest(
    fits: Callable[[FloatArray], BoolArray], low: FloatArray, high: FloatArray
) -> FloatArray:
    """Return the highest values between two that fit, by bisection; ``low`` where none does."""
    at_once = fits(high)
    most = high
    for _ in range(_BISECTIONS):
        middle = 0.5 * (low + high)
        good = fits(middle)
        low, high = np.where(good, middle, low), np.where(good, high, middle)
    return np.where(at_once, most, low)
