"""The points of a flight from which returns are flown to know them all: for energy, wind and voltage."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.route.stage import RETURN_STAGES, StageKind

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.returns.path import Returns

SWEEP_POINTS = 128
"""Points of the sweep, and at most of its refinement: so many cost half of the prediction of a thousand
items, and the missions they were tried on hide no point that is 0.03 % tighter than the one found."""
_TAKEOFF = STATE_INDEX[FlightState.TAKEOFF]
_LANDINGS = frozenset({StageKind.LAND}) | RETURN_STAGES


def sample_points(returns: Returns) -> tuple[IntArray, FloatArray] | None:
    """Return segments, and fractions of them, in flown order; ``None`` with no point in the air.

    Segments of the take-off and of stages that land are left out: there the vehicle stands still, or
    lands where it is going anyway.
    """
    judged, continues = _judged(returns)
    columns = returns.flight.motion.segments
    lone_takeoff = (columns.state == _TAKEOFF) & ~_lands(returns) & ~np.append(judged[1:], False)
    starts = np.flatnonzero(judged & ~continues[:-1])
    ends = np.flatnonzero((judged & ~continues[1:]) | lone_takeoff)
    if not len(ends):
        return None
    spread, fraction = _evenly(returns, judged, _used(returns, judged)[-1])
    segment = np.concatenate((ends, starts, spread))
    return in_order(segment, np.concatenate((np.ones(len(ends)), np.zeros(len(starts)), fraction)))


def spread_by_energy(returns: Returns, *limits_wh: float) -> tuple[IntArray, FloatArray]:
    """Return points even in energy up to limits that the flight exceeds, finer than the sample's. [Wh]"""
    judged, _ = _judged(returns)
    used_wh = _used(returns, judged)[-1]
    spread = [_evenly(returns, judged, limit) for limit in limits_wh if limit < used_wh]
    none = (np.zeros(0, dtype=np.intp), np.zeros(0))
    segments, fractions = zip(none, *spread, strict=True)
    return np.concatenate(segments), np.concatenate(fractions)


def returns_unbroken(returns: Returns) -> IntArray:
    """Return how many segments up to each, it included, do not continue the one before. (s,)"""
    _, continues = _judged(returns)
    return np.cumsum(~continues[:-1])


def in_order(segment: IntArray, fraction: FloatArray) -> tuple[IntArray, FloatArray]:
    """Return points in flown order, each once."""
    order = np.lexsort((fraction, segment))
    segment, fraction = segment[order], fraction[order]
    new = np.append(True, (np.diff(segment) != 0) | (np.diff(fraction) != 0.0))
    return segment[new], fraction[new]


def _lands(returns: Returns) -> BoolArray:
    """Return whether segments serve a stage that lands. (s,)"""
    lands = np.array([one.kind in _LANDINGS for one in returns.route.stages])
    return np.asarray(lands[returns.segment_stage])


def _judged(returns: Returns) -> tuple[BoolArray, BoolArray]:
    """Return from which segments returns are flown, and which continue the one before.

    The one before is judged then, and home has not moved. (s,), (s + 1,)
    """
    judged = ~_lands(returns) & (returns.flight.motion.segments.state != _TAKEOFF)
    home = returns.destinations.home_of(returns.segment_stage)
    continues = np.zeros(len(judged) + 1, dtype=np.bool_)
    continues[1:-1] = judged[1:] & judged[:-1] & (home[1:] == home[:-1])
    return judged, continues


def _own(returns: Returns, judged: BoolArray) -> FloatArray:
    """Return the energy judged segments use, or where no power is known their time. (s,) [Wh] or [s]"""
    used = np.diff(returns.used_wh)
    if not np.isfinite(used).all():
        used = returns.flight.motion.segments.duration_s
    return np.where(judged, used, 0.0)


def _used(returns: Returns, judged: BoolArray) -> FloatArray:
    return np.cumsum(_own(returns, judged))


def _evenly(returns: Returns, judged: BoolArray, most: float) -> tuple[IntArray, FloatArray]:
    """Return segments, and fractions of them, even in what judged segments use, up to a limit.

    The end of a stage is taken for a point near it: there the sum has its corners.
    """
    own = _own(returns, judged)
    used = np.cumsum(own)
    stage_ends = returns.stage_ends[judged[returns.stage_ends]]
    grid = np.linspace(0.0, most, SWEEP_POINTS + 1)[1:]
    near = np.searchsorted(grid, used[stage_ends])
    last = np.append(near[1:] != near[:-1], True)[: len(near)] & (near < SWEEP_POINTS)
    even = np.delete(grid, near[last])
    segment = np.minimum(np.searchsorted(used, even), len(used) - 1)
    left = (used[segment] - even) / np.maximum(own[segment], 1e-12)
    segment = np.concatenate((stage_ends[last], segment))
    fraction = np.concatenate((np.ones(np.count_nonzero(last)), np.clip(1.0 - left, 0.0, 1.0)))
    return segment[judged[segment]], fraction[judged[segment]]
