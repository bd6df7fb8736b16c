"""Rules on the ground between the posts that ArduPilot knows it by, where it follows them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.mission.route.stage import StageKind
from planner.rules.clearance import (
    ROUNDING_M,
    SAME_PLACE_M,
    STRAIGHT_M,
    asked_clearance_m,
    sides_of,
    too_near_text,
)
from planner.rules.declaration import ARDUPILOT, TERRAIN, judges
from planner.rules.low_returns import with_low_returns
from planner.rules.terrain import BELOW_TERRAIN, IN_THE_AIR
from planner.rules.terrain_following import (
    followed_m,
    followed_part_m,
    follows_terrain,
    known_above_m,
    least_followed_m,
    reach_down_m,
    returns_above_m,
    returns_follow_terrain,
    returns_from_ends_m,
    spacing_m,
    stage_ends_m,
)
from planner.rules.terrain_returns import RETURN_BELOW_TERRAIN

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.path import FlightLines
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_FIX = "fly higher there, or set TERRAIN_SPACING to the cells of the grid"


@judges(BELOW_TERRAIN, needs=(TERRAIN,))
def _follows_posts(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where a leg that follows the ground passes too near to what is between its posts."""
    rows = _rows_by_posts(a, IN_THE_AIR | {StageKind.RETURN})
    if not rows:
        return
    from planner.flight.path import FlightLines

    lines = _followed_lines(a, terrain, rows)
    if lines is None:
        return
    sides = sides_of(lines, a.setup.position_margin_m)
    lowest = _lowest(a, terrain, FlightLines.joined([lines, *sides]))
    if lowest is not None:
        clearance_m, row = lowest
        item = a.route.stages[row].item
        yield a.finding(BELOW_TERRAIN, _text(a, clearance_m), item=item, fix=_FIX)


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT, TERRAIN))
def _returns_follow_posts(
    a: Assessment, _parameters: ArduPilotParameters, terrain: TerrainGrid
) -> Iterator[Finding]:
    if not returns_follow_terrain(a) or reach_down_m(a) is not None:
        return
    from planner.flight.path import FlightLines

    points, homeward = with_low_returns(a, a.returns.sample)
    if not len(homeward):
        return
    corners_m, _ = a.returns.straight_corners_m(points, homeward)
    ways_m = corners_m[:, 2:4].copy()
    below_m, ahead_m = (least_followed_m(a, terrain, ways_m[:, end]) for end in (0, 1))
    above_m = returns_above_m(a, points, homeward, below_m=below_m, ahead_m=ahead_m)
    ways_m[..., 2] = above_m[:, None]
    lines = FlightLines(start_m=ways_m[:, 0], end_m=ways_m[:, 1], owner=np.arange(len(ways_m)))
    lowest = _lowest(a, terrain, lines)
    if lowest is not None:
        clearance_m, row = lowest
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return from here {_text(a, clearance_m)}",
            item=a.route.stages[int(points.stage[row])].item,
            fix=_FIX,
        )


def heights_by_posts_m(a: Assessment) -> tuple[IntArray, FloatArray]:
    """Return the heights above the first home at which legs and circles follow the ground by its posts.

    The stage of each, and the least and greatest wherever posts are (2, n). (n,) [m]
    """
    terrain, rows, lines = a.setup.terrain, _rows_by_posts(a, IN_THE_AIR), None
    if terrain is not None and rows:
        lines = _followed_lines(a, terrain, rows)
    if terrain is None or lines is None:
        return np.zeros(0, np.intp), np.zeros((2, 0))
    lines = lines.cut(followed_part_m(lines))
    ends_m = np.concatenate((lines.start_m, lines.end_m))
    each_m = followed_m(a, terrain, *ends_m[:, :2].T) + ends_m[:, 2]
    return np.tile(lines.owner, 2), np.array((each_m.min(axis=0), each_m.max(axis=0)))


def _rows_by_posts(a: Assessment, kinds: frozenset[StageKind]) -> list[int]:
    """Return the stages of some kinds that follow the ground by its posts; a rangefinder sees the ground."""
    if reach_down_m(a) is not None:
        return []
    return [
        row
        for row, stage in enumerate(a.route.stages)
        if row and stage.kind in kinds and follows_terrain(a, stage.item)
    ]


def _text(a: Assessment, clearance_m: float) -> str:
    return (
        f"follows the ground by posts {quantity.distance(spacing_m(a))} apart (TERRAIN_SPACING): "
        f"{too_near_text(a, clearance_m)} between them"
    )


def _followed_lines(a: Assessment, terrain: TerrainGrid, rows: list[int]) -> FlightLines | None:
    """Return the way of stages that follow the ground, at the height above it that is asked for.

    That changes evenly from item to item; on circles and returns it stays.  ``None`` where they climb and
    hover alone.
    """
    from planner.flight.path import FlightLines, flown_lines

    stages = a.route.stages
    place_m = stage_ends_m(a)
    follows = np.isin(np.arange(len(stages)), rows)
    followed_above_m = place_m[:, 2] - least_followed_m(a, terrain, place_m)
    above_m = np.where(follows, known_above_m(a, place_m), followed_above_m)
    ends, return_m = returns_from_ends_m(a, terrain)
    path = a.path.cut(a.flight.motion, STRAIGHT_M)
    of_stage: IntArray = a.returns.segment_stage[path.segment]
    found = []
    for row in rows:
        legs = np.flatnonzero((of_stage == row) & (path.length_m > SAME_PLACE_M))
        if not len(legs):
            continue
        lines, way_m = flown_lines(path, legs), np.cumsum(path.length_m[legs])
        begin_m, end_m = above_m[row - 1], above_m[row]
        if stages[row].kind is StageKind.CIRCLE:
            begin_m = end_m
        elif stages[row].kind is StageKind.RETURN:
            begin_m = end_m = return_m[ends.searchsorted(row) - 1]
        asked_m = begin_m + (end_m - begin_m) * np.append(0.0, way_m) / way_m[-1]
        starts_m, ends_m = lines.start_m.copy(), lines.end_m.copy()
        starts_m[:, 2], ends_m[:, 2] = asked_m[:-1], asked_m[1:]
        found.append(FlightLines(start_m=starts_m, end_m=ends_m, owner=np.full(len(legs), row)))
    return FlightLines.joined(found) if found else None


def _lowest(a: Assessment, terrain: TerrainGrid, lines: FlightLines) -> tuple[float, int] | None:
    """Return how high lines above the ground that is followed pass over the ground, and the lowest's owner.

    ``None`` where everything is as high as asked for.
    """
    lines = lines.cut(followed_part_m(lines))
    ends_m = np.stack((lines.start_m, lines.end_m), axis=1)
    where = a.route.frame.latitude_longitude_deg(ends_m[..., 0], ends_m[..., 1])
    least_m = followed_m(a, terrain, ends_m[..., 0], ends_m[..., 1]).min(axis=0)
    under = terrain.under(*where)
    along = np.stack((under.start, under.end), axis=1)
    of_line = least_m[under.line]
    height_m = of_line[:, :1] + along * (of_line[:, 1:] - of_line[:, :1])
    height_m += a.route.ground_datum_m - under.ground_amsl_m
    along = along[..., None]
    place_m = ends_m[under.line, :1] + along * (ends_m[under.line, 1:] - ends_m[under.line, :1])
    height_m += place_m[..., 2]
    from_home_m = np.hypot(place_m[..., 0], place_m[..., 1])
    asked_m = asked_clearance_m(a.setup.clearance_m, from_home_m) - ROUNDING_M
    # What was asked for as low is told as that.
    is_low = (height_m < asked_m) & (place_m[..., 2] >= asked_m)
    if not is_low.any():
        return None
    part, end = np.unravel_index(int(np.where(is_low, height_m, np.inf).argmin()), is_low.shape)
    return float(height_m[part, end]), int(lines.owner[under.line[part]])
