"""Straights: the straight part of a leg, from the end of its turn to where the next leg begins."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.px4.braking import Followed, onsets, root
from planner.flight.motion.px4.columns import Columns
from planner.flight.motion.px4.ramps import Ramps, cut_ramp_time_s, ramp_time_s
from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, FloatArray, IntArray
    from planner.flight.motion.px4.limits import Limits


@frozen(eq=False)
class Straights(Columns):
    """How straights are flown: ramp, cruise, onset of braking, and braking by up to two laws."""

    ramp_from_m_s: FloatArray
    """Speed at which the ramp would begin without acceleration."""
    ramp_begun_s: FloatArray
    """Time of the ramp that lies before the straight, flown in the turn."""
    is_cut: BoolArray
    """Whether the straight ends before the ramp takes its acceleration back."""
    peak_m_s: FloatArray
    cruise_m: FloatArray
    onset_s: FloatArray
    """Time in which the deceleration grows at limited jerk."""
    steady_s: FloatArray
    """Time at the deceleration it has grown to."""
    joined_m_s: FloatArray
    """Speed at which braking joins the allowed speed."""
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
    """How far behind the target the law flown alone would end at its final speed; below 0: before."""

    def near_way_m(self, limits: Limits, speed_m_s: FloatArray) -> FloatArray:
        """Return how far before the target braking by the near law has speeds. (n,) [m]"""
        rows = np.arange(len(speed_m_s))
        a, final = limits.brake_m_s2[rows, self.near], limits.final_m_s[rows, self.near]
        way = speed_m_s * (speed_m_s + 2.0 * self.half_b_m_s[:, 1]) - final**2
        left: FloatArray = way / (2.0 * a) - self.beyond_m
        return left

    def ramps(self, limits: Limits) -> Ramps:
        """Return the ramps to the peak speeds."""
        change = np.abs(self.peak_m_s - self.ramp_from_m_s)
        whole = Ramps.of(change, acceleration_m_s2=limits.ramp_m_s2, jerk_m_s3=limits.ramp_m_s3)
        return whole.cut(self.is_cut, change, acceleration_m_s2=limits.ramp_m_s2)


@frozen(eq=False)
class _Climb(Columns):
    """The speeds at which straights begin, and the ways of ramps from there."""

    limits: Limits
    start_m_s: FloatArray
    ramp_from_m_s: FloatArray
    begun_s: FloatArray
    begun_m: FloatArray

    def ways_m(self, speed_m_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the ways of ramps to speeds: whole ones, and until the acceleration is taken back."""
        a, j = self.limits.ramp_m_s2, self.limits.ramp_m_s3
        change = np.abs(speed_m_s - self.ramp_from_m_s)
        whole = (
            0.5
            * (speed_m_s + self.ramp_from_m_s)
            * ramp_time_s(change, acceleration_m_s2=a, jerk_m_s3=j)
        )
        back_s = np.minimum(a, np.sqrt(j * change)) / j
        back = back_s * (speed_m_s - np.sign(speed_m_s - self.ramp_from_m_s) * j * back_s**2 / 6.0)
        return whole - self.begun_m, whole - back - self.begun_m

    def cut_way_m(self, speed_m_s: FloatArray) -> FloatArray:
        """Return the ways of ramps up to speeds that are cut off there. [m]"""
        a, j = self.limits.ramp_m_s2, self.limits.ramp_m_s3
        time = cut_ramp_time_s(
            np.maximum(speed_m_s - self.ramp_from_m_s, 0.0), acceleration_m_s2=a, jerk_m_s3=j
        )
        jerk_s = np.minimum(time, a / j)
        steady_s = time - jerk_s
        way = self.ramp_from_m_s * time + jerk_s**2 * j * (jerk_s / 6.0 + 0.5 * steady_s)
        return way + 0.5 * j * jerk_s * steady_s**2 - self.begun_m


def fly_straights(
    limits: Limits, *, start_m_s: FloatArray, acceleration_m_s2: FloatArray
) -> Straights:
    """Return how straights are flown that begin at speeds and accelerations along them.

    Parameters
    ----------
    limits : Limits
        (n rows)
    start_m_s, acceleration_m_s2 : ndarray
        Speed and acceleration at the beginning, zero or more. (n,) [m s⁻¹, m s⁻²]

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
        begun_s=begun_s,
        begun_m=begun_s * (ramp_from + jerk * begun_s**2 / 6.0),
    )
    total = limits.length_m + limits.tail_m
    peak, length = limits.cruise_m_s.copy(), limits.length_m
    _, until_back = climb.ways_m(peak)
    short = np.flatnonzero(until_back + limits.reach_m(peak) > total)
    lowest = start_m_s + 0.5 * begun * begun_s
    if len(short):
        peak[short] = _peaks_m_s(climb.select(short), lowest[short], total[short])
    # Nothing above the speed begun with is allowed: the way left decides from the beginning.
    late = lowest * (1.0 + 1e-9) >= peak
    late &= (begun == 0.0) | (peak < limits.cruise_m_s)
    ramped, _ = climb.ways_m(peak)
    slows = late & (ramped <= length) & (peak >= limits.cruise_m_s)
    ramped = np.where(late & ~slows, 0.0, ramped)
    peak = np.where(late & ~slows, start_m_s, peak)
    is_cut = ~late & (ramped > length)
    if is_cut.any():
        cut = np.flatnonzero(is_cut)
        cut_climb = climb.select(cut)
        peak[cut] = _cut_speeds_m_s(cut_climb, peak[cut])
        ramped[cut] = cut_climb.cut_way_m(peak[cut])
    held = late & ~slows
    return _braked(
        limits,
        peak,
        total - ramped,
        ramp_from_m_s=np.where(held, peak, ramp_from),
        ramp_begun_s=np.where(held, 0.0, begun_s),
        is_cut=is_cut,
    )


def _peaks_m_s(climb: _Climb, lowest_m_s: FloatArray, total_m: FloatArray) -> FloatArray:
    """Return the peak speeds of straights too short for their cruise. (n,) [m s⁻¹]"""
    low, high = lowest_m_s, np.maximum(climb.limits.cruise_m_s, lowest_m_s)

    def excess(speed: FloatArray) -> FloatArray:
        _, until_back = climb.ways_m(speed)
        over: FloatArray = until_back + climb.limits.reach_m(speed) - total_m
        return over

    return root(excess, low, high)


def _cut_speeds_m_s(climb: _Climb, highest_m_s: FloatArray) -> FloatArray:
    """Return the speeds that ramps have reached where their straights end. (n,) [m s⁻¹]"""
    length = climb.limits.length_m
    return root(lambda speed: climb.cut_way_m(speed) - length, climb.start_m_s, highest_m_s)


def _braked(
    limits: Limits,
    peak_m_s: FloatArray,
    left_m: FloatArray,
    *,
    ramp_from_m_s: FloatArray,
    ramp_begun_s: FloatArray,
    is_cut: BoolArray,
) -> Straights:
    """Return straights from the end of their ramps on, ``left_m`` before their targets."""
    kept = np.maximum(limits.reach_m(peak_m_s), limits.tail_m)
    brakes = (kept > limits.tail_m) & ~is_cut
    kept = np.where(is_cut, limits.tail_m, kept)
    cruise = np.maximum(left_m - kept, 0.0)
    onset = onsets(limits, peak_m_s, left_m - cruise, brakes)
    follows = brakes & (onset.left_m > limits.tail_m)
    law = Followed.of(limits, onset)
    return Straights(
        ramp_from_m_s=ramp_from_m_s,
        ramp_begun_s=ramp_begun_s,
        is_cut=is_cut,
        peak_m_s=peak_m_s,
        cruise_m=cruise,
        onset_s=onset.onset_s,
        steady_s=onset.steady_s,
        joined_m_s=onset.speed_m_s,
        far=law.far,
        near=np.where(follows, law.near, law.far),
        crossing_m_s=np.where(follows, law.crossing_m_s, onset.speed_m_s),
        held_m=np.where(follows, law.held_m, 0.0),
        end_m_s=np.where(follows, law.end_m_s, onset.speed_m_s),
        final_m=np.where(follows, law.final_m, 0.0),
        half_b_m_s=law.half_b_m_s,
        beyond_m=law.beyond_m,
    )
