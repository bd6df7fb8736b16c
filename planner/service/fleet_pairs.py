"""How far the pairs of a fleet that come nearest to each other are apart over time."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner.fleet.approach import Meeting
from planner.fleet.separation import as_flown, home_above_m
from planner.fleet.swarm.zones import Capsules, distances_m
from planner.service.fleet_separation import (
    DOWNWASH,
    GROUND_SEPARATION,
    RETURN_CROSSES,
    fleet_spacing,
)
from planner.service.separation import SEPARATION
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.arrays import FloatArray, IntArray
    from planner.fleet.separation import Member, Spacing
    from planner.service.fleet import FleetResult

_STEP_S = 0.5
_SAMPLES = 4000
"""Of the distance of a pair, before the least is looked for between them."""
_POINTS = 180
MOST_PAIRS = 6
"""Curves in a picture that can be told apart."""
_FINER = 21
_ROUNDS = 4
"""In each the least is looked for on a grid ten times as fine: from half a second to half a millisecond."""
_SHIFTS = tuple(number / 8.0 for number in range(-8, 9) if number)
"""Of the start errors and spreads of times that curves are drawn at; the least is looked for between them."""
APART_CODES = frozenset(
    rule.code for rule in (SEPARATION, DOWNWASH, GROUND_SEPARATION, RETURN_CROSSES)
)


class PairDistance(Value, eq=False):
    """How far two sorties are apart over time, as their separation is judged.

    Beside each other, less the errors of position, and from all that a stop passes where they may be told to,
    or above each other, whichever is more; a height counts as many times as the zone about a vehicle is
    flatter than wide.
    """

    first: str
    second: str
    time_s: FloatArray
    """Of the first. (n,) [s]"""
    planned_m: FloatArray
    """Both as planned. (n,) [m]"""
    may_m: FloatArray
    """How near they may come by the start errors and the spread of their times, or as their own autopilots
    fly. (n,) [m]"""
    part: IntArray
    """Which stretch of time without a gap each belongs to. (n,)"""
    least_s: float
    """When they may come nearest. [s]"""
    least_m: float


class _Pair(Value, eq=False):
    """Two sorties of two vehicles, and how far they are apart."""

    first: Member
    second: Member
    spacing: Spacing

    def together_s(self) -> tuple[float, float]:
        """Return from when until when both are there. [s]"""
        sides = self.first, self.second
        return (
            max(one.start_s + float(one.trajectory.start_s[0]) for one in sides),
            min(one.start_s + float(one.trajectory.end_s[-1]) for one in sides),
        )

    def apart_m(self, time_s: FloatArray, shift_s: FloatArray | float = 0.0) -> FloatArray:
        """Return how far the first is from the second so much later or sooner; NaN: not judged. (n,) [m]

        Neither is where one is not there, or both are near the ground.
        """
        zone = self.spacing.zone(self.first, self.second)
        assert zone is not None  # of a fleet it is a cylinder
        zones, heights_m, lifts_m = [], [], []
        is_judged, are_low = np.ones((2, len(time_s)), dtype=bool)
        for side, at_s in ((self.first, time_s), (self.second, time_s + shift_s)):
            flown, own_s = side.trajectory, at_s - side.start_s
            part = flown.part_at(own_s)
            place_m, stop_m = flown.place_and_stop_m(own_s)
            level_m, grown_m = place_m[:, :2], flown.grown_m[part]
            zones.append(Capsules.about(level_m, level_m + stop_m, grown_m))
            heights_m.append(place_m[:, 2])
            lifts_m.append(flown.lifted_m[part])
            is_judged &= (own_s >= flown.start_s[0]) & (own_s <= flown.end_s[-1])
            are_low &= flown.is_low[part]
        beside_m = distances_m(*zones)
        above_m = heights_m[1] - heights_m[0] + home_above_m(self.first, self.second)
        above_m = np.sign(above_m) * np.maximum(np.abs(above_m) - sum(lifts_m), 0.0)
        away_m = np.maximum(np.maximum(beside_m, zone.of_height_m(above_m)), 0.0)
        return np.where(is_judged & ~are_low, away_m, np.nan)

    def shifts_s(self, time_s: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return from what to what times of the second count beside those of the first. (n,), (n,) [s]"""
        first, second = self.first.trajectory, self.second.trajectory
        one = first.part_at(time_s - self.first.start_s)
        two = second.part_at(time_s - self.second.start_s)
        slack_s = first.slack_s[one] + second.slack_s[two] + 2.0 * self.spacing.start_error_s
        later_s, sooner_s = Meeting(first=first, second=second).late_s(one, two)
        return -slack_s - later_s, slack_s + sooner_s

    def least_m(self, time_s: FloatArray) -> FloatArray:
        """Return how near they may come at times, sooner or later than planned. (n,) [m]"""
        low_s, high_s = self.shifts_s(time_s)
        least_m = self.apart_m(time_s)
        for fraction in _SHIFTS if (high_s - low_s).any() else ():
            shift_s = low_s + 0.5 * (1.0 + fraction) * (high_s - low_s)
            least_m = np.fmin(least_m, self.apart_m(time_s, shift_s))
        return least_m

    def nearest(self, about_s: float, step_s: float) -> tuple[float, float]:
        """Return when, and how near, they come nearest about a time."""
        low_s, high_s = (float(one[0]) for one in self.shifts_s(np.array([about_s])))
        shift_s, reach_s = 0.5 * (low_s + high_s), 0.5 * (high_s - low_s)
        least_m = float(self.apart_m(np.array([about_s]))[0])
        for _ in range(_ROUNDS):
            times_s = np.linspace(about_s - step_s, about_s + step_s, _FINER)
            shifts_s = np.clip(shift_s + np.linspace(-reach_s, reach_s, _FINER), low_s, high_s)
            grid_s, by_s = (one.ravel() for one in np.meshgrid(times_s, np.unique(shifts_s)))
            away_m = self.apart_m(grid_s, by_s)
            if np.isfinite(away_m).any():
                at = int(np.nanargmin(away_m))
                about_s, shift_s, least_m = float(grid_s[at]), float(by_s[at]), float(away_m[at])
            step_s, reach_s = (2.0 * one / (_FINER - 1) for one in (step_s, reach_s))
        return about_s, least_m


def closest_pairs(result: FleetResult, all_: Sequence[Member]) -> tuple[PairDistance, ...]:
    """Return the pairs of sorties that come nearest to each other, those in conflict first."""
    separation = result.fleet.separation
    if separation is None:
        return ()
    spacing = fleet_spacing(separation)
    step_s = max(_STEP_S, sum(one.trajectory.duration_s for one in all_) / _SAMPLES)
    steps = [
        np.arange(one.start_s // step_s, (one.start_s + one.trajectory.duration_s) // step_s + 2.0)
        for one in all_
    ]
    grid_s = np.unique(np.concatenate(steps)) * step_s if steps else np.zeros(0)
    too_near = {
        frozenset(one.sorties) for one in result.findings if one.finding.code in APART_CODES
    }
    found = []
    for one, two in combinations(all_, 2):
        pair = _Pair(first=one, second=two, spacing=spacing)
        from_s, until_s = pair.together_s()
        time_s = grid_s[(grid_s >= from_s) & (grid_s <= until_s)]
        if one.vehicle == two.vehicle or not len(time_s):
            continue
        away_m = pair.apart_m(time_s)
        if np.isfinite(away_m).any():
            is_clear = frozenset((one.file, two.file)) not in too_near
            found.append((is_clear, float(np.nanmin(away_m)), pair, time_s, away_m))
    found.sort(key=lambda one: one[:2])
    return tuple(
        _distance(pair, time_s, away_m, step_s) for _, _, pair, time_s, away_m in found[:MOST_PAIRS]
    )


def _distance(
    pair: _Pair, time_s: FloatArray, planned_m: FloatArray, step_s: float
) -> PairDistance:
    ways = [replace(pair, first=one, second=two) for one, two in as_flown(pair.first, pair.second)]
    ways_m = np.array([one.least_m(time_s) for one in ways])
    may_m = np.fmin.reduce(ways_m)
    at = int(np.nanargmin(may_m))
    nearest = ways[int(np.nanargmin(ways_m[:, at]))]
    least_s, least_m = nearest.nearest(float(time_s[at]), step_s)
    chosen, part = shown_samples(np.where(np.isfinite(planned_m), may_m, np.nan))
    return PairDistance(
        first=pair.first.file,
        second=pair.second.file,
        time_s=time_s[chosen],
        planned_m=planned_m[chosen],
        may_m=may_m[chosen],
        part=part,
        least_s=least_s,
        least_m=min(least_m, float(np.nanmin(may_m))),
    )


def shown_samples(away_m: FloatArray) -> tuple[IntArray, IntArray]:
    """Return which samples of a distance are shown, and which stretch without a gap each belongs to."""
    known = np.flatnonzero(np.isfinite(away_m))
    part = np.cumsum(np.diff(known, prepend=known[0]) > 1).astype(np.intp)
    # Of each short time the nearest: a curve must not be above what it stands for.
    short = np.arange(len(known)) * _POINTS // max(len(known), _POINTS)
    order = np.lexsort((away_m[known], short))
    chosen = np.sort(order[np.flatnonzero(np.diff(short[order], prepend=-1))])
    return known[chosen], part[chosen]
