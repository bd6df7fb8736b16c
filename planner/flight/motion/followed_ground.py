"""Flight that follows the ground: lifted by how far the ground is off the line between two items."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
    KinematicState,
    horizontal,
    quotient,
)
from planner.mission.route.stage import StageKind
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.motion.kinematics import Motion
    from planner.geo.terrain import TerrainGrid
    from planner.mission.route.stage import Route

_SHORTEST_PART_M = 2.0
"""Ground is looked up no more often: grids hold no more, and positions are no better. [m]"""
_MOST_PARTS = 4000
_LEVEL_M = 0.1
"""Ground that is off the line by less lifts nothing: degrees are no straight lines, to so much. [m]"""
_ON_CIRCLE_M = 1.0
_SLOWED = 0.99
"""A leg that takes no longer than by so much is not slowed by the ground. [-]"""
_STEEPEST, _BISECTIONS = 1e3, 30
_CRUISE = STATE_INDEX[FlightState.CRUISE]
_SHAPE = np.array([0.0, 0.25, 0.5, 0.75, 1.0])


class ClimbLimits(Value):
    """What a vehicle keeps to over the ground."""

    cruise_m_s: float
    climb_m_s: float
    descent_m_s: float


class LiftedLaw(Value, eq=False):
    """Another motion, each row a part of one of its pieces at another speed, lifted at a steady rate."""

    motion: Motion
    piece: IntArray
    """(rows,)"""
    start_s: FloatArray
    """Time of the piece at which the part begins. (rows,) [s]"""
    lift_m: FloatArray
    """At the beginning. (rows,) [m]"""
    rate_m_s: FloatArray
    time_scale: FloatArray
    """Time of the piece that passes in a second. (rows,) [-]"""

    def state_at(self, row: IntArray, time_s: FloatArray) -> KinematicState:
        """Return the state of ``row`` at its own time."""
        scale = self.time_scale[row]
        state = self.motion.state_at(self.piece[row], self.start_s[row] + scale * time_s)
        return replace(
            state,
            east_m_s=state.east_m_s * scale,
            north_m_s=state.north_m_s * scale,
            height_m=state.height_m + self.lift_m[row] + self.rate_m_s[row] * time_s,
            climb_m_s=state.climb_m_s * scale + self.rate_m_s[row],
        )


class _Points(Value, eq=False):
    """Places along a part of a motion, one more than there are parts."""

    piece: IntArray
    """Of each part. (k,)"""
    start_s: FloatArray
    """Time of the piece at which each part begins. (k,) [s]"""
    duration_s: FloatArray
    """(k,) [s]"""
    place_m: FloatArray
    """East, north, height above home at each point. (k + 1, 3) [m]"""
    stage: IntArray
    """Of each part. (k,)"""
    is_cruise: BoolArray
    """Whether a part is of a cruise, whose speed the ground may change. (k,)"""
    time_scale: FloatArray
    """Time of the piece that passes in a second. (k,) [-]"""

    @property
    def time_s(self) -> FloatArray:
        """Of each point since the first. (k + 1,) [s]"""
        return np.concatenate(([0.0], np.cumsum(self.duration_s)))


def follow_ground(
    motion: Motion, route: Route, terrain: TerrainGrid | None, limits: ClimbLimits
) -> Motion:
    """Return a motion along a route, lifted over the ground on stages that follow it.

    Notes
    -----
    ArduPilot's path is straight in heights above terrain, on circles level in them
    (``AC_WPNav::update_wpnav``, ``AC_Circle::update``: the terrain's offset is added to the target).  It
    climbs and descends no faster than its limits: begun early before ground that rises faster, so that the
    path is nowhere below the height asked for, but where it begins and ends.  What such descents may give
    back of the power of climbing is not counted: no flight was identified on that went up and down so.
    """
    if terrain is None or not any(stage.follows_ground for stage in route.stages):
        return motion
    stage = motion.segment_stage
    lifted = []
    for first, last in _runs(route):
        own = np.flatnonzero((stage >= first) & (stage <= last))
        if not len(own):
            continue
        points = _points(motion, own, stage, terrain.cell_m)
        where = route.frame.latitude_longitude_deg(*points.place_m[:, :2].T)
        ground_m = terrain.height_amsl_m(*where).filled(np.nan) - route.ground_datum_m
        if np.isnan(ground_m).any():
            continue
        lift_m = _lift_m(points, route, ground_m)
        if np.abs(lift_m).max() < _LEVEL_M:
            continue
        height_m = points.place_m[:, 2] + lift_m
        points = _retimed(points, route, height_m, limits)
        flown_m = _flyable_m(height_m, points, limits)
        lifted.append((points, flown_m - points.place_m[:, 2]))
    return _lifted(motion, lifted) if lifted else motion


_LEVEL_GROUND_M = 2.0
"""Ground that stays so near to its height at the beginning is level: grids are no better. [m]"""
_LOWERS = frozenset({StageKind.LAND, StageKind.SET_DOWN})


def following_to_land(route: Route, terrain: TerrainGrid) -> Route | None:
    """Return a route whose legs to landings keep their height above the ground; ``None`` where they have it.

    Notes
    -----
    ``ModeAuto::terrain_adjusted_location``: a LAND or PAYLOAD_PLACE item with a place is flown to at the
    present height above terrain, where the vehicle knows the terrain here and there; else level.
    """
    stages = list(route.stages)
    for number, (before, stage) in enumerate(pairwise(route.stages), start=1):
        ends_m = np.array([(one.east_m, one.north_m) for one in (before, stage)])
        length_m = math.dist(*ends_m)
        if stage.kind not in _LOWERS or stage.follows_ground or length_m < _SHORTEST_PART_M:
            continue
        count = min(int(length_m / max(terrain.cell_m, _SHORTEST_PART_M)) + 2, _MOST_PARTS)
        share = np.linspace(0.0, 1.0, count)[:, None]
        places_m = ends_m[0] + share * (ends_m[1] - ends_m[0])
        ground_m = terrain.height_amsl_m(*route.frame.latitude_longitude_deg(*places_m.T)).filled(
            np.nan
        )
        if not np.abs(ground_m - ground_m[0]).max() > _LEVEL_GROUND_M:  # level, or not known
            continue
        rise_m = float(ground_m[-1] - ground_m[0])
        sets_down = stage.kind is StageKind.SET_DOWN
        stages[number] = replace(
            stage,
            followed_ground_m=tuple(ground_m.tolist()),
            follows_ground=True,
            above_ground_m=stage.above_ground_m + rise_m * sets_down,
        )
    return None if stages == list(route.stages) else replace(route, stages=tuple(stages))


def _runs(route: Route) -> Iterator[tuple[int, int]]:
    """Yield first and last of stages that follow each other over the ground.

    A circle ends elsewhere than over its centre: the stage after it begins at that height.
    """
    first: int | None = None
    for number, stage in enumerate((*route.stages, None)):
        if stage is not None and stage.follows_ground:
            first = number if first is None else first
        elif first is not None:
            is_circle = route.stages[number - 1].kind is StageKind.CIRCLE
            yield first, number if stage is not None and is_circle else number - 1
            first = None


def _points(motion: Motion, segments: IntArray, stage: IntArray, cell_m: float) -> _Points:
    """Return places no farther apart than a cell along consecutive segments."""
    piece = np.flatnonzero(
        (motion.piece_segment >= segments[0]) & (motion.piece_segment <= segments[-1])
    )
    duration_s = motion.piece_duration_s[piece]
    shape = motion.state_at(piece[:, None], duration_s[:, None] * _SHAPE)
    length_m = shape.ground_speed_m_s.max(axis=1) * duration_s
    step_m = max(cell_m, _SHORTEST_PART_M, float(length_m.sum()) / _MOST_PARTS)
    parts = np.maximum(np.ceil(length_m / step_m), 1.0).astype(np.intp)
    owner = np.repeat(np.arange(len(piece)), parts)
    number = np.arange(len(owner)) - np.repeat(np.cumsum(parts) - parts, parts)
    each_s = (duration_s / parts)[owner]
    begin = motion.state_at(piece[owner], number * each_s).place_m
    end = motion.state_at(piece[-1:], duration_s[-1:]).place_m
    return _Points(
        piece=piece[owner],
        start_s=number * each_s,
        duration_s=each_s,
        place_m=np.concatenate((begin, end)),
        stage=stage[motion.piece_segment[piece[owner]]],
        is_cruise=motion.segments.state[motion.piece_segment[piece[owner]]] == _CRUISE,
        time_scale=np.ones(len(owner)),
    )


def _lift_m(points: _Points, route: Route, ground_m: FloatArray) -> FloatArray:
    """Return how far the ground lifts each point. (k + 1,) [m]"""
    lift_m = np.zeros(len(ground_m))
    moved_m = horizontal(np.diff(points.place_m, axis=0))
    begin_m = 0.0
    for number in np.unique(points.stage).tolist():
        own = np.flatnonzero(points.stage == number)
        at = np.append(own, own[-1] + 1)
        stage, ground = route.stages[number], ground_m[at]
        way_m = np.concatenate(([0.0], np.cumsum(moved_m[own])))
        if stage.kind is StageKind.CIRCLE and stage.follows_ground:
            centre_m = np.array([stage.east_m, stage.north_m])
            away_m = horizontal(points.place_m[at] - np.append(centre_m, 0.0))
            on = int((np.abs(away_m - away_m[-1]) < _ON_CIRCLE_M).argmax())
            fraction = np.clip(way_m / way_m[on], 0.0, 1.0) if way_m[on] > 0.0 else np.ones(len(at))
            level_m = stage.followed_ground_m[-1] - route.ground_datum_m
            lift = ground - ground[0] + (ground[0] - level_m) * fraction
        else:
            fraction = way_m / way_m[-1] if way_m[-1] > 0.0 else np.ones(len(at))
            lift = ground - (ground[0] + fraction * (ground[-1] - ground[0]))
            lift = lift * stage.follows_ground
        lift_m[at] = lift + (1.0 - fraction) * begin_m
        begin_m = float(lift_m[at[-1]])
    return lift_m


def _retimed(points: _Points, route: Route, height_m: FloatArray, limits: ClimbLimits) -> _Points:
    """Return the same places, cruises slow where the ground is steep and fast where it is not.

    What a leg takes in all is known (`followed_speed_m_s`): at the commanded speed where the vehicle climbs
    and descends within its limits, more slowly elsewhere.
    """
    duration_s, change_m = points.duration_s.copy(), np.diff(height_m)
    way_m = horizontal(np.diff(points.place_m, axis=0))
    vertical_s = np.where(
        change_m > 0.0, change_m / limits.climb_m_s, -change_m / limits.descent_m_s
    )
    for number in np.unique(points.stage).tolist():
        own = np.flatnonzero((points.stage == number) & points.is_cruise)
        stage, whole_s = route.stages[number], float(duration_s[own].sum())
        if stage.kind is StageKind.CIRCLE or not stage.follows_ground or whole_s <= 0.0:
            continue
        fast_s = way_m[own] / (stage.speed_m_s or limits.cruise_m_s)
        if fast_s.sum() >= _SLOWED * whole_s:
            continue
        low, steepest = 1.0, 1.0
        if np.maximum(fast_s, vertical_s[own]).sum() > whole_s:
            steepest = _STEEPEST
            for _ in range(_BISECTIONS):
                middle = 0.5 * (low + steepest)
                if np.maximum(fast_s, vertical_s[own] / middle).sum() > whole_s:
                    low = middle
                else:
                    steepest = middle
        wanted_s = np.maximum(fast_s, vertical_s[own] / steepest)
        duration_s[own] = wanted_s * whole_s / wanted_s.sum()
    scale = quotient(points.duration_s, duration_s, 1.0) * points.time_scale
    return replace(points, duration_s=duration_s, time_scale=scale)


def _flyable_m(height_m: FloatArray, points: _Points, limits: ClimbLimits) -> FloatArray:
    """Return heights that neither rise nor fall faster than the vehicle. (k + 1,) [m]

    They are the lowest such ones nowhere below those asked for, but as the first and the last allow.
    """
    time_s = points.time_s
    # The straight path keeps its own limits.
    duration_s = np.maximum(points.duration_s, 1e-6)
    own_m_s = np.diff(points.place_m[:, 2]) / duration_s
    up_m_s = max(limits.climb_m_s, float(own_m_s.max(initial=0.0)))
    down_m_s = max(limits.descent_m_s, float(-own_m_s.min(initial=0.0)))
    falls = np.maximum.accumulate(height_m + down_m_s * time_s) - down_m_s * time_s
    rises = np.maximum.accumulate((falls - up_m_s * time_s)[::-1])[::-1] + up_m_s * time_s
    from_start = height_m[0] + up_m_s * time_s
    to_end = height_m[-1] + down_m_s * (time_s[-1] - time_s)
    return np.asarray(np.minimum(np.minimum(rises, from_start), to_end))


def _lifted(motion: Motion, lifted: list[tuple[_Points, FloatArray]]) -> Motion:
    """Return a motion some pieces of which are divided and lifted."""
    points = [one for one, _ in lifted]
    piece = np.concatenate([one.piece for one in points])
    duration_s = np.concatenate([one.duration_s for one in points])
    rise_m = np.concatenate([np.diff(lift) for _, lift in lifted])
    law = LiftedLaw(
        motion=motion,
        piece=piece,
        start_s=np.concatenate([one.start_s for one in points]),
        lift_m=np.concatenate([lift[:-1] for _, lift in lifted]),
        rate_m_s=rise_m / np.maximum(duration_s, 1e-6),
        time_scale=np.concatenate([one.time_scale for one in points]),
    )
    rest = np.ones(len(motion.piece_segment), np.bool_)
    rest[piece] = False
    others = np.flatnonzero(rest)
    origin = np.concatenate((others, piece))
    order = np.argsort(origin, kind="stable")
    origin = origin[order]
    fall_m_s = np.maximum(-law.rate_m_s, 0.0)
    is_new = np.concatenate((np.zeros(len(others), np.bool_), np.ones(len(piece), np.bool_)))[order]
    row = np.concatenate((motion.piece_row[others], np.arange(len(piece))))[order]
    kept_s = motion.piece_duration_s[others]
    grounded = motion.piece_is_grounded
    segments, segment = motion.segments, motion.piece_segment[piece]
    count = len(segments.climb_m)
    climb_m = segments.climb_m + np.bincount(segment, rise_m, count)
    longer_s = np.bincount(segment, duration_s * (1.0 - law.time_scale), count)
    longer = replace(segments, climb_m=climb_m, duration_s=segments.duration_s + longer_s)
    return replace(
        motion,
        segments=longer,
        beside=None if motion.beside is None else motion.beside.moved(segments.end_s, longer.end_s),
        laws=(*motion.laws, law),
        piece_segment=motion.piece_segment[origin],
        piece_law=np.where(is_new, len(motion.laws), motion.piece_law[origin]),
        piece_row=row,
        piece_offset_s=np.where(is_new, 0.0, motion.piece_offset_s[origin]),
        piece_duration_s=np.concatenate((kept_s, duration_s))[order],
        piece_fall_m_s=np.concatenate((np.zeros(len(others)), fall_m_s))[order],
        piece_is_grounded=None if grounded is None else grounded[origin],
    )
