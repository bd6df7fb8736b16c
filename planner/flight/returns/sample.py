"""The points of a flight from which returns are flown to know them all: for energy, wind and voltage."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.route.stage import RETURN_STAGES, StageKind

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.returns.path import Returns

SWEEP_POINTS = 128
"""Points of the sweep, about, and at most of its refinement: so many cost half of the prediction of a
thousand items.  Against points 20 times as dense, 600 random missions on four kinds of pilots hid none that
is 0.08 % tighter than the one found; drawn on until one did, it was 0.5 % tighter."""
_UPRIGHT = 1e-3
"""Way over climb of a segment that goes straight up or down. [-]"""
_TAKEOFF = STATE_INDEX[FlightState.TAKEOFF]


def sample_points(returns: Returns) -> tuple[IntArray, FloatArray] | None:
    """Return segments, and fractions of them, in flown order; ``None`` with no point in the air.

    Segments of the take-off, those straight down to where it lands and returns of the mission itself are
    left out: there the vehicle stands still, or lands where it is going anyway.  The points are even in
    time, so that they follow from the motion alone: flights that differ in what they weigh, in the air or
    in the battery have the same.
    """
    judged, continues = returns.judged
    columns = returns.flight.motion.segments
    lone_takeoff = (columns.state == _TAKEOFF) & ~returns.lands & ~np.append(judged[1:], False)
    starts = np.flatnonzero(judged & ~continues[:-1])
    ends = np.flatnonzero((judged & ~continues[1:]) | lone_takeoff)
    if not len(ends):
        return None
    own_s = np.where(judged, columns.duration_s, 0.0)
    spread, fraction = _evenly(returns, judged, own_s, float(own_s.sum()))
    segment = np.concatenate((ends, starts, spread))
    return in_order(segment, np.concatenate((np.ones(len(ends)), np.zeros(len(starts)), fraction)))


def spread_up_to(returns: Returns, *limits_wh: float) -> tuple[IntArray, FloatArray]:
    """Return points up to limits that the flight exceeds in half of its time or less. [Wh]

    Of the flight they take the half, the quarter, … that the limit is in: so limits near each other, as
    those of one battery at several charges, have the same points.
    """
    judged, _ = returns.judged
    own_s, time_s, used_wh = returns.judged_sums
    whole_s = float(time_s[-1])
    within_s = {_halved(float(np.interp(one, used_wh, time_s)), whole_s) for one in limits_wh}
    spread = [_evenly(returns, judged, own_s, one) for one in sorted(within_s - {whole_s})]
    none = (np.zeros(0, dtype=np.intp), np.zeros(0))
    segments, fractions = zip(none, *spread, strict=True)
    return np.concatenate(segments), np.concatenate(fractions)


def _halved(part: float, whole: float) -> float:
    """Return the least of a whole, its half, its quarter, … that holds a part."""
    return whole * 0.5 ** math.floor(math.log2(whole / part)) if part > 0.0 else whole


def returns_unbroken(returns: Returns) -> IntArray:
    """Return how many segments up to each, it included, do not continue the one before. (s,)"""
    _, continues = returns.judged
    return np.cumsum(~continues[:-1])


def line_ends(returns: Returns) -> BoolArray:
    """Return at which segments a line that is flown ends. (s,)

    It does with its stage, and where a climb begins or ends: steps of the reference
    are answered level first, then upwards.
    """
    columns = returns.flight.motion.segments
    upright = columns.distance_m < _UPRIGHT * np.abs(columns.climb_m)
    moves = upright | (columns.distance_m > 0.0)
    latest = np.maximum.accumulate(np.where(moves, np.arange(len(moves)), 0))
    goes_up, stage = upright[latest], returns.segment_stage
    return np.append((goes_up[1:] != goes_up[:-1]) | (stage[1:] != stage[:-1]), True)


def in_order(segment: IntArray, fraction: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return points in flown order, each once."""
    order = np.lexsort((fraction, segment))
    segment, fraction = segment[order], fraction[order]
    new = np.append(True, (segment[1:] != segment[:-1]) | (fraction[1:] != fraction[:-1]))
    return segment[new], fraction[new]


def landing_segments(returns: Returns) -> BoolArray:
    """Return whether segments come down where the vehicle lands, or are a return already. (s,)

    The way to the place of a landing is as any other: it may lead far from home.
    """
    columns, route = returns.flight.motion.segments, returns.route
    lands, returns_home = np.zeros((2, len(route.stages)), np.bool_)
    lands[route.rows_of(StageKind.LAND)] = True
    returning = {stage.item for stage in route.stages_of(*RETURN_STAGES)}
    if returning:
        returns_home[:] = [one.item in returning for one in route.stages]
    lands, returns_home = lands[returns.segment_stage], returns_home[returns.segment_stage]
    goes_there = columns.distance_m > _UPRIGHT * np.abs(columns.climb_m)
    return np.asarray(returns_home | (lands & ~goes_there))


def judged_segments(returns: Returns) -> tuple[BoolArray, BoolArray]:
    """Return from which segments returns are flown, and which continue the one before.

    The one before is judged then, and home has not moved. (s,), (s + 1,)
    """
    judged = ~returns.lands & (returns.flight.motion.segments.state != _TAKEOFF)
    home = returns.destinations.home_of(returns.segment_stage)
    continues = np.zeros(len(judged) + 1, dtype=np.bool_)
    continues[1:-1] = judged[1:] & judged[:-1] & (home[1:] == home[:-1])
    return judged, continues


def _evenly(
    returns: Returns, judged: BoolArray, own_s: FloatArray, most_s: float
) -> tuple[IntArray, FloatArray]:
    """Return segments, and fractions of them, even in the time of judged segments, up to so much of it.

    The end of a line is taken for a point near it: there the sum has its corners.  Of more ends near one
    point all count, unless there are too many.
    """
    passed_s = own_s.cumsum()
    ends = np.flatnonzero(returns.line_ends & judged)
    grid = most_s * (np.arange(1, SWEEP_POINTS + 1) / SWEEP_POINTS)
    near = grid.searchsorted(passed_s[ends])
    last = near < SWEEP_POINTS
    if np.count_nonzero(last) > SWEEP_POINTS:
        last &= np.append(near[1:] != near[:-1], True)
    is_even = np.ones(SWEEP_POINTS, np.bool_)
    is_even[near[last]] = False
    even = grid[is_even]
    segment = np.minimum(passed_s.searchsorted(even), len(passed_s) - 1)
    left = (passed_s[segment] - even) / np.maximum(own_s[segment], 1e-12)
    segment = np.concatenate((ends[last], segment))
    fraction = np.concatenate(
        (np.ones(np.count_nonzero(last)), 1.0 - np.minimum(np.maximum(left, 0.0), 1.0))
    )
    return segment[judged[segment]], fraction[judged[segment]]
