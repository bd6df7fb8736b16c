"""Rules on the ground under returns of the vehicle itself."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.returns.destination import HOME
from planner.mission.route.stage import StageKind
from planner.rules.clearance import (
    GROUND_THERE,
    ROUNDING_M,
    SAME_PLACE_M,
    STRAIGHT_M,
    Lowest,
    above_text,
    box_places_m,
    clearance_of,
    falls_short_m,
    led_heights_m,
    nearest_m,
    too_near_text,
)
from planner.rules.declaration import ARDUPILOT, PX4, TERRAIN, NotEvaluated, judges
from planner.rules.low_returns import (
    ReturnStretches,
    low_returns,
    return_height_is_known,
    with_low_returns,
)
from planner.rules.terrain_following import (
    OVER_TERRAIN,
    FollowingLegs,
    followed_m,
    follows_terrain,
    reach_down_m,
    returns_above_m,
    returns_begun_within_reach,
    returns_follow_terrain,
)
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.path import FlightLines, FlownPath
    from planner.flight.returns.fan import ReturnFan
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.clearance import Clearance
    from planner.rules.declaration import Found
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters

_STEEPEST_RETURNS = 20
"""So many returns, those over the steepest ground, are flown step by step."""
_MOST_RETURNS = 2_000
_RETURN_SPACING_M = 100.0
"""Returns begin no farther apart, nor than a cell, unless there would be more than can be judged; the
ground between them is judged as well. [m]"""
_MOST_CELLS = 500_000
"""Cells that returns pass over, at most: beyond, they begin farther apart."""
_WAY = 2
"""Of the lines of a return the way, behind the stop and the climb."""
_NARROW_M2 = 1e-6
"""Returns from a stretch that pass over less are one line. [m²]"""

RETURN_BELOW_TERRAIN = Rule(
    "A104 rtl-below-terrain",
    Severity.ERROR,
    summary="The vehicle's own return would meet the ground.",
    why="The height of a return counts from home and ignores hills: vehicles flew into them "
    "(QGroundControl #5524, ArduPilot #12170, PX4 #20003).",
    how="From all over the flight to where the vehicle itself would return (home, a rally point or along "
    "the mission), at the height of its return: PX4 the higher of its own and RTL_RETURN_ALT over that "
    "place, lower inside RTL_MIN_DIST; ArduPilot the higher of its own and RTL_ALT over home, whatever "
    "the ground of a rally point, in its cone; against --terrain plus --clearance: along lines from "
    "places 100 m or a cell apart as in A102, and over every centre of a cell between two lines or within "
    "--position-error of them.  Returns from a landing, a take-off, or where a load is set down count from "
    "--clearance above the ground there on, from twice that where they keep the height they begin at; from "
    "2 m on they may not meet the ground itself.  By a "
    "model without --params, whose height of returns is not known, not evaluated (X904) where they would be "
    "too low at that and at RTL_ALT as ArduPilot is delivered, 15 m.  Where "
    "RTL_ALT_TYPE follows terrain, RTL_ALT against --clearance, what stands between the posts it knows the "
    "ground by (as A102), and the 20 returns over the steepest ground, which they may climb too slowly for.  "
    "PX4 also by RTL_DESCEND_ALT above a rally point that lies below the ground: it goes down to there "
    "before it lands.  Not evaluated (X904) where --terrain has no ground under a return, and without "
    "--terrain where returns follow terrain.",
    fix="raise RTL_RETURN_ALT (PX4) or RTL_ALT (ArduPilot) above the highest ground, or fly round it",
    instead="--terrain or --clearance",
)


def return_spacing_m(cell_m: float, length_m: float) -> float:
    """Return how far apart on a path of some length the places are that returns are judged from. [m]"""
    return max(min(_RETURN_SPACING_M, cell_m), length_m / _MOST_RETURNS)


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT, TERRAIN))
def _returns_too_late(
    a: Assessment, parameters: ArduPilotParameters, terrain: TerrainGrid
) -> Iterator[Finding]:
    """Yield a finding where the ground under a return that follows it rises faster than it climbs."""
    if not returns_follow_terrain(a):
        return
    points, homeward = with_low_returns(a, a.returns.sample)
    if not len(homeward):
        return
    corners_m, _ = a.returns.straight_corners_m(points, homeward)
    ways_m = corners_m[:, 2:4, :2]
    where = a.route.frame.latitude_longitude_deg(ways_m[..., 0], ways_m[..., 1])
    ground = terrain.under(*where)
    length_m = np.hypot(*(ways_m[:, 1] - ways_m[:, 0]).T)[ground.line] * (ground.end - ground.start)
    rise_m = np.nan_to_num(ground.ground_amsl_m[:, 1] - ground.ground_amsl_m[:, 0], nan=0.0)
    climbed_m = length_m * parameters.climb_speed_m_s / parameters.return_speed_m_s
    behind_m = np.bincount(ground.line, np.maximum(rise_m - climbed_m, 0.0), len(ways_m))
    follows = returns_begun_within_reach(a, points.place_m)
    behind_m = np.where(follows, behind_m, -np.inf)
    chosen = np.argsort(-behind_m, kind="stable")[: min(_STEEPEST_RETURNS, int(follows.sum()))]
    if not len(chosen):
        return
    below_m, ahead_m = (
        followed_m(a, terrain, *ways_m[chosen, end].T).max(axis=0) for end in (0, 1)
    )
    steepest = points.select(chosen)
    above_m = returns_above_m(a, steepest, homeward[chosen], below_m=below_m, ahead_m=ahead_m)
    one = np.ones(len(chosen))
    least_m = FollowingLegs(
        start_m=ways_m[chosen, 0],
        end_m=ways_m[chosen, 1],
        above_m=np.column_stack((above_m, above_m)),
        limits_m_s=(
            parameters.return_speed_m_s * one,
            parameters.climb_speed_m_s * one,
            parameters.descent_speed_m_s * one,
        ),
        stage=2 * np.arange(len(chosen)),
    ).least_above_m(a, terrain, parameters)
    worst = int(np.nan_to_num(least_m, nan=np.inf).argmin())
    lowest_m, enough_m = float(least_m[worst]), a.setup.clearance_m - ROUNDING_M
    if lowest_m < enough_m <= parameters.return_altitude_m:
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return from here follows the ground, which rises faster than it climbs: "
            f"{too_near_text(a, lowest_m)}",
            item=a.route.stages[int(steepest.stage[worst])].item,
            fix="raise RTL_ALT, or set RTL_ALT_TYPE 0 with RTL_ALT above the highest ground",
        )


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT,))
def _returns_over_terrain(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Found]:
    has_source = parameters.terrain_enable or reach_down_m(a) is not None
    if parameters.return_altitude_type != OVER_TERRAIN or not has_source:
        return
    height_m = parameters.return_altitude_m
    if a.setup.terrain is None:
        yield NotEvaluated(
            rule=RETURN_BELOW_TERRAIN,
            asked_by="a return above terrain (RTL_ALT_TYPE 1)",
            needs=TERRAIN.what,
        )
    elif 0.0 < height_m < a.setup.clearance_m:  # at 0 it keeps the height it is at
        yield a.finding(
            RETURN_BELOW_TERRAIN, f"returns follow the ground {too_near_text(a, height_m)}"
        )


@judges(RETURN_BELOW_TERRAIN, needs=(PX4,))
def _waits_below_ground(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Judge the height at which PX4 waits over a rally point (``RtlDirect``, LOITER_DOWN)."""
    sample = a.returns.sample
    if sample is None:
        return
    points = sample.points
    targets = a.returns.destinations.targets(points.stage, sample.destination, points.stop_m)
    waits_m = targets.above_ground_m + parameters.return_descend_altitude_m
    waits_m = np.where(sample.destination > HOME, waits_m, np.inf)
    worst = int(waits_m.argmin())
    if waits_m[worst] <= ROUNDING_M:
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return to rally point {int(sample.destination[worst])} goes down to "
            f"{above_text(float(waits_m[worst]))} before it lands",
            fix="correct the altitude of the rally point: it counts from home",
        )


def level_returns_too_low(
    a: Assessment, terrain: TerrainGrid, path: FlownPath, legs: IntArray
) -> Iterator[Found]:
    """Yield a finding where a return from legs of the path meets the ground."""
    stretches = _level_stretches(a, path, legs, terrain.cell_m)
    yield from _judged(a, terrain, stretches, terrain.cell_m)


def returns_too_low(
    a: Assessment, terrain: TerrainGrid, path: FlownPath, legs: IntArray, cell_m: float
) -> Iterator[Found]:
    """Yield a finding where a return of the vehicle meets the ground.

    ``legs`` are those of the path on which it neither takes off nor lands: from there returns are judged
    besides.
    """
    found: list[Found] = []
    for stretches in _stretches(a, path, legs, cell_m):
        for one in _judged(a, terrain, stretches, cell_m):
            if not (found and isinstance(one, NotEvaluated)):
                found.append(one)
                yield one
        if any(not isinstance(one, NotEvaluated) for one in found):
            return


def _stretches(
    a: Assessment, path: FlownPath, legs: IntArray, cell_m: float
) -> Iterator[ReturnStretches]:
    """Yield the stretches from which returns are judged: of legs, and low ones, from less and less high."""
    yield _level_stretches(a, path, legs, cell_m)
    yield low_returns(a, follow=False)
    yield low_returns(a, follow=False, is_lowest=True)


def _level_stretches(
    a: Assessment, path: FlownPath, legs: IntArray, cell_m: float
) -> ReturnStretches:
    """Return the stretches of legs: those that follow each other on a stage, no longer than the spacing."""
    legs = _level_returned(a, path, legs)
    stage = a.returns.segment_stage[path.segment[legs]]
    along_m = np.cumsum(path.length_m[legs])
    spacing_m = return_spacing_m(cell_m, float(along_m[-1]) if len(legs) else 0.0)
    number = np.floor((along_m - path.length_m[legs]) / spacing_m)
    new = (np.diff(number, prepend=-1.0) != 0.0) | (np.diff(stage, prepend=-1) != 0)
    new |= np.diff(legs, prepend=-2) != 1
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(legs))[: len(first)] - 1
    return ReturnStretches(
        time_s=np.stack((path.time_s[legs[first]], path.time_s[legs[last] + 1]), axis=1),
        stage=stage[first],
        item=path.item[legs[first]],
        clearance_m=a.setup.clearance_m,
    )


def _judged(
    a: Assessment, terrain: TerrainGrid, stretches: ReturnStretches, cell_m: float
) -> Iterator[Found]:
    """Yield a finding where a return from stretches of the flight meets the ground."""
    from planner.flight.path import FlightLines
    from planner.flight.returns.fan import return_fan

    if not len(stretches.stage):
        return
    fan, along = return_fan(a.returns, stretches.time_s, stretches.stage)
    if stretches.is_low:  # straight down from there it lands
        way_m = (fan.corners_m[:, 0, 3] - fan.corners_m[:, 0, 2])[:, :2]
        fan = fan.select(np.hypot(*way_m.T) > SAME_PLACE_M)
    item = stretches.item[fan.stretch]
    lines = _lines_of(a, fan, item, is_low=stretches.is_low)
    # Between lines the ground is highest at centres of cells, all of which are judged.
    every = int(np.ceil(float(lines.length_m.sum()) / (cell_m * _MOST_CELLS))) or 1
    lines = lines.select(lines.owner % every == 0)
    count = len(fan.stretch)
    both = FlightLines.joined([lines, replace(along, owner=along.owner + count)])
    if not len(both.owner):
        return
    both = both.cut(STRAIGHT_M)
    # They begin as high as the mission leads there, or keep to a height of their own.
    led_m = np.full(len(item), -np.inf) if stretches.is_low else led_heights_m(a)[item]
    led_m = np.append(led_m, -np.inf)
    asked_m = stretches.clearance_m
    led_by_m = led_m[np.minimum(both.owner, count)]
    clearance = clearance_of(a, terrain, both, led_m=led_by_m, clearance_m=asked_m)
    if clearance.is_missed.any():
        owner = int(both.owner[clearance.line[clearance.is_missed.argmax()]])
        yield NotEvaluated(
            rule=RETURN_BELOW_TERRAIN,
            asked_by="the ground under a return",
            needs=GROUND_THERE,
            item=int(item[owner]) if owner < count else None,
        )
    low = _lowest_on(both, clearance)
    peak = _lowest_over_peaks(a, terrain, fan, led_m, clearance_m=asked_m)
    if peak is not None and peak.clearance_m < low.clearance_m:
        low = peak
    if low.clearance_m >= asked_m - ROUNDING_M:
        return
    above = too_near_text(a, low.clearance_m)
    if low.row >= count:
        yield a.finding(RETURN_BELOW_TERRAIN, f"the return along the mission is {above}")
        return
    number = int(item[low.row])
    if stretches.is_low and not return_height_is_known(a):
        yield NotEvaluated(
            rule=RETURN_BELOW_TERRAIN,
            asked_by=f"a return from where it lands or sets out, at "
            f"{quantity.height(float(fan.corners_m[low.row, 0, 2, 2]))} above home {above},",
            needs="the height it returns at: --params",
            item=number,
        )
        return
    to_go_m = float(np.hypot(*(fan.corners_m[low.row, 0, 3] - low.place_m)[:2]))
    goal = "home" if fan.destination[low.row] == HOME else "its landing"
    begun = ""
    if stretches.is_low:
        begun = f", begun {quantity.height(float(fan.corners_m[low.row, 0, 0, 2]))} above home"
    yield a.finding(
        RETURN_BELOW_TERRAIN,
        f"a return from here{begun}, {quantity.height(float(low.place_m[2]))} above home, is {above}, "
        f"{quantity.distance(to_go_m)} from {goal}",
        item=number,
    )


def _lines_of(a: Assessment, fan: ReturnFan, item: IntArray, *, is_low: bool) -> FlightLines:
    """Return the lines of returns from where they decide to over where they land."""
    from planner.flight.path import FlightLines

    corners = fan.corners_m[:, :, :4].reshape(-1, 4, 3)
    lines = FlightLines(
        start_m=corners[:, :-1].reshape(-1, 3),
        end_m=corners[:, 1:].reshape(-1, 3),
        owner=np.repeat(np.arange(len(corners)) // 2, 3),
    )
    # Where it follows the ground it stops, and begins to climb, over ground it follows: its leg is judged.
    # So where it begins to climb from the ground, or may be on its way to it.
    follows = np.array([is_low or follows_terrain(a, int(number)) for number in item], np.bool_)
    return lines.select(~follows[lines.owner] | (np.arange(len(lines.owner)) % 3 == _WAY))


def _lowest_on(lines: FlightLines, clearance: Clearance) -> Lowest:
    """Return where lines are lowest of where they are too low; infinitely high where nowhere."""
    least_m, _, where = clearance.extremes_m()
    is_low = clearance.is_known & (least_m < clearance.asked_m)
    least_m = np.where(is_low, least_m, np.inf)
    worst = int(least_m.argmin())
    line = int(clearance.line[worst])
    way_m = lines.end_m[line] - lines.start_m[line]
    place_m = lines.start_m[line] + where[worst] * way_m
    return Lowest(float(least_m[worst]), int(lines.owner[line]), place_m)


def _level_returned(a: Assessment, path: FlownPath, legs: IntArray) -> IntArray:
    """Return the legs from which returns are level above home, of those that are judged."""
    if returns_follow_terrain(a):
        points_m = np.column_stack((path.east_m, path.north_m, path.height_m))
        follows = returns_begun_within_reach(a, points_m)
        legs = legs[~(follows[:-1] & follows[1:])[legs]]
    # The mission's own return is judged as it is flown.
    own = [stage.item for stage in a.route.stages_of(StageKind.RETURN)]
    return legs[~np.isin(path.item[legs], own)]


def _lowest_over_peaks(
    a: Assessment, terrain: TerrainGrid, fan: ReturnFan, led_m: FloatArray, *, clearance_m: float
) -> Lowest | None:
    """Return where a return between the two ends of a stretch is lowest over the centre of a cell.

    ``None`` where all are as high above as is asked.
    """
    import shapely

    if not len(fan.stretch):
        return None
    turn_m, over_m = fan.corners_m[:, :, 2], fan.corners_m[:, 0, 3]
    lowest_m = min(float(turn_m[..., 2].min()), float(over_m[:, 2].min()))
    every_m = np.concatenate((turn_m.reshape(-1, 3), over_m))
    frame = a.route.frame
    latitude, longitude, ground_amsl_m = terrain.peaks_above(
        a.route.ground_datum_m + lowest_m - clearance_m,
        *frame.latitude_longitude_deg(*box_places_m(every_m)),
    )
    if not len(latitude):
        return None
    peaks_m = np.column_stack(frame.east_north_m(latitude, longitude))
    corners_m = np.stack((over_m[:, :2], turn_m[:, 0, :2], turn_m[:, 1, :2]), axis=1)
    tree = shapely.STRtree(shapely.convex_hull(shapely.linestrings(corners_m)))
    peak, row = tree.query(
        shapely.points(peaks_m), predicate="dwithin", distance=a.setup.position_margin_m
    )
    # A place is over + u (turn_0 − over) + v (turn_1 − over); its height as straight lines have it.
    sides_m = corners_m[row, 1:] - corners_m[row, :1]
    from_m = peaks_m[peak] - corners_m[row, 0]
    area = sides_m[:, 0, 0] * sides_m[:, 1, 1] - sides_m[:, 0, 1] * sides_m[:, 1, 0]
    if not len(row):
        return None
    is_wide = np.abs(area) > _NARROW_M2
    whole = np.where(is_wide, area, 1.0)
    u = (from_m[:, 0] * sides_m[:, 1, 1] - from_m[:, 1] * sides_m[:, 1, 0]) / whole
    v = (from_m[:, 1] * sides_m[:, 0, 0] - from_m[:, 0] * sides_m[:, 0, 1]) / whole
    base_m = over_m[row, 2]
    height_m = base_m + u * (turn_m[row, 0, 2] - base_m) + v * (turn_m[row, 1, 2] - base_m)
    is_inside = is_wide & (u >= 0.0) & (v >= 0.0) & (u + v <= 1.0)
    # Beside it the height of its edges counts, where they are nearest.
    corners = (over_m[row], turn_m[row, 0], turn_m[row, 1])
    edges = [nearest_m(peaks_m[peak], *ends) for ends in combinations(corners, 2)]
    away_m, beside_m = (np.stack(one) for one in zip(*edges, strict=True))
    beside_m = np.take_along_axis(beside_m, away_m.argmin(axis=0)[None], axis=0)[0]
    height_m = np.where(is_inside, height_m, beside_m)
    above_m = height_m - (ground_amsl_m[peak] - a.route.ground_datum_m)
    short_m = falls_short_m(led_m[row], height_m, clearance_m)
    above_m = np.where(above_m < clearance_m - short_m, above_m, np.inf)
    worst = int(above_m.argmin())
    place_m = np.append(peaks_m[peak[worst]], height_m[worst])
    return Lowest(float(above_m[worst]), int(row[worst]), place_m)
