"""Rules on the ground under the whole flight, and beside it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.returns.destination import HOME
from planner.mission.commands import GLOBAL_FRAMES, RELATIVE_FRAMES
from planner.mission.route.position import TERRAIN_ASSUMED_LEVEL
from planner.mission.route.route import HOME_UNKNOWN
from planner.mission.route.stage import LANDED_STAGES, RETURN_STAGES, StageKind
from planner.rules.clearance import (
    GROUND_THERE,
    ROUNDING_M,
    SAME_PLACE_M,
    STRAIGHT_M,
    Lowest,
    above_text,
    asked_clearance_m,
    box_places_m,
    circle_m,
    clearance_of,
    falls_short_m,
    led_heights_m,
    near_home_cut,
    near_home_m,
    nearest_m,
    sides_of,
    too_near_text,
)
from planner.rules.declaration import TERRAIN, TERRAIN_ABOUT_UNKNOWN_HOME, NotEvaluated, judges
from planner.rules.left_open import IN_SIGHT_M
from planner.rules.low_returns import is_vertical_at_ground
from planner.rules.terrain_following import (
    FollowingLegs,
    following_parameters,
    follows_terrain,
    known_above_m,
    returns_follow_terrain,
    returns_from_ends_m,
    stage_ends_m,
)
from planner.rules.terrain_returns import (
    RETURN_BELOW_TERRAIN,
    level_returns_too_low,
    return_spacing_m,
    returns_too_low,
)
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.path import FlightLines, FlownPath
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.clearance import Clearance
    from planner.rules.declaration import Found

IN_THE_AIR = frozenset(
    {StageKind.GO, StageKind.SPLINE, StageKind.LOITER, StageKind.CIRCLE, StageKind.CHANGE_HEIGHT}
)
_OVER_GROUND = (IN_THE_AIR - {StageKind.CIRCLE}) | {StageKind.RETURN}
"""Stages with a straight leg that may follow the ground."""
_LEVEL_WITHIN_M = 1.0
"""Nearer to home's height, rounding may be meant. [m]"""
_OVERSHOOT_M = 3.0
"""Steps and curves pass no lower than this below the places they lead to. [m]"""
_ALIKE_M = 0.01
"""Places that differ by less are as low as each other: the first is named. [m]"""
_STRAIGHT_ON = math.cos(0.5)
"""Of the angle by which a path turns at most without a corner. [-]"""

BELOW_TERRAIN = Rule(
    "A102 below-terrain",
    Severity.ERROR,
    summary="The flight meets the ground, or passes nearer to it than --clearance.",
    why="Waypoints above the ground do not keep the leg between them above a ridge; height above "
    "ground is requested again and again (MissionPlanner #706, QGroundControl #4007).",
    how="Height of the predicted flight minus the ground of --terrain along the whole flight without take-"
    "off and landing: cut wherever it passes from cell to cell, so that no ridge falls between two samples "
    "(of cells that touch at a corner and are higher than those beside them a ridge is taken to join the "
    "two); --position-error to both sides of it too, around where it "
    "turns, ends, or goes up or down, and at every centre nearer than that of cells narrower than twice "
    "as much; fires below --clearance, 5 m by default (heights above home and grids err by some metres "
    "each).  Legs that follow terrain on ArduPilot are judged by their height above it, less what they "
    "get too low where the ground rises faster than they climb (it looks at the ground below alone), and, "
    "without a rangefinder, by what stands between the posts it knows the ground by, TERRAIN_SPACING (100 m) "
    "apart: the ground of --terrain at these, straight between them.  "
    "Not evaluated (X904) where --terrain has no ground under the path, or --position-error beside it: "
    "a hole in its grid, or beyond its end.  Without --terrain the ground is level with home: a path "
    "more than 1 m below it fires, and one nearer to it than --clearance is not evaluated (X904), by more "
    "than 1 m between places that are asked for no lower (PX4 ends a take-off NAV_MC_ALT_RAD below its "
    "height): it cannot be wrong by less than ground that is known.  Up to 19 m from home, where the vehicle "
    "stood, the clearance is what ground of 15° rises, 5 m in 19 m.  A place that is passed up to "
    "0.8 m lower (NAV_MC_ALT_RAD), by a fifth of the clearance at most, counts as high as the mission leads "
    "to it.",
    fix="fly higher there, or add a waypoint before the ridge",
    instead="--terrain, --home-amsl or --clearance",
)


@judges(BELOW_TERRAIN)
def _above_unknown_terrain(a: Assessment) -> Iterator[Found]:
    """Without the ground there, a height above it means nothing."""
    for assumed in a.findings:
        if assumed.code == TERRAIN_ASSUMED_LEVEL.code:
            yield NotEvaluated(
                rule=BELOW_TERRAIN,
                asked_by="an altitude above terrain",
                needs=TERRAIN.what if a.setup.terrain is None else "the ground there: --terrain",
                item=assumed.item,
            )
            break


GROUND_CLEARANCE = Rule(
    "A116 ground-clearance",
    Severity.INFO,
    summary="Least and greatest height above the ground.",
    why="Legal limits count from the ground, not from home (MissionPlanner #706).",
    how="As for A102, as far as the grid reaches.",
    fix="",
)


@judges(BELOW_TERRAIN)
def _level_ground(a: Assessment) -> Iterator[Found]:
    """Judge a low flight over ground that is not known at all."""
    if a.setup.terrain is None and _may_be_low(a):
        flown = _flown(a, None, STRAIGHT_M)
        if flown is not None:
            yield from _too_low(a, flown)


@judges(BELOW_TERRAIN, RETURN_BELOW_TERRAIN, GROUND_CLEARANCE, needs=(TERRAIN,))
def _ground(a: Assessment, terrain: TerrainGrid) -> Iterator[Found]:
    cell_m = terrain.cell_m
    # Places to return from are among the points of the path.
    spacing_m = return_spacing_m(cell_m, float(a.flight.motion.segments.distance_m.sum()))
    flown = _flown(a, terrain, min(spacing_m, STRAIGHT_M))
    if flown is None:
        yield from returns_too_low(a, terrain, a.path, np.zeros(0, np.intp), cell_m)
        return
    clearance, item = flown.clearance, flown.item
    is_known, is_missed = clearance.is_known, clearance.is_missed
    over = tuple(_too_low(a, flown))
    yield from over
    if is_missed.any():
        missed_m = float(clearance.length_m[is_missed].sum())
        span = "all" if not is_known.any() else quantity.distance(missed_m)
        yield NotEvaluated(
            rule=BELOW_TERRAIN,
            also=(RETURN_BELOW_TERRAIN,),
            asked_by=f"the ground under {span} of the flight",
            needs=GROUND_THERE,
            item=int(item[is_missed.argmax()]),
        )
    elif not over:
        yield from _beside(a, terrain, flown)
    yield from _follows_too_low(a)
    returns = returns_too_low(a, terrain, flown.path, flown.legs, cell_m)
    yield from (one for one in returns if not (is_missed.any() and isinstance(one, NotEvaluated)))
    if not is_known.any():
        return
    least_m, greatest_m, _ = clearance.extremes_m()
    lowest = int(np.where(is_known, least_m, np.inf).argmin())
    highest = int(np.where(is_known, greatest_m, -np.inf).argmax())
    yield a.finding(
        GROUND_CLEARANCE,
        f"{quantity.height(float(least_m[lowest]))} (item {int(item[lowest])}) to "
        f"{quantity.height(float(greatest_m[highest]))} (item {int(item[highest])}) above the ground"
        + ("" if is_known.all() else ", where it is known"),
        item=int(item[lowest]),
    )


@judges(HOME_UNKNOWN, needs=(TERRAIN_ABOUT_UNKNOWN_HOME,))
def _from_unknown_home(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where a flight from a home near its first place may be too low over the ground.

    Begun from the lowest ground in sight it is so much lower than from the first place, and comes over the
    highest of it to there, and home.
    """
    corners_m = np.array([-IN_SIGHT_M, IN_SIGHT_M])
    box_deg = a.route.frame.latitude_longitude_deg(corners_m, corners_m)
    ground_m = terrain.heights_within_amsl_m(*box_deg)
    in_sight = quantity.distance(IN_SIGHT_M)
    if np.ma.getmaskarray(ground_m).any():
        yield a.finding(
            HOME_UNKNOWN,
            f"no home in the file: the ground within {in_sight} of the first place, where it may be, is not "
            "all known",
            severity=Severity.ERROR,
            fix="set the planned home position in the mission, or give --terrain that reaches so far",
        )
        return
    cells_m = terrain.cells_within_amsl_m(*box_deg)
    lowest_m = float(np.fmin.reduce(cells_m, initial=ground_m.min()))
    highest_m = float(np.fmax.reduce(cells_m, initial=ground_m.max()))
    lower_m = max(a.route.home_amsl_m - lowest_m, 0.0)
    if a.setup.home_amsl_m is not None:
        lower_m = 0.0
    flown = _flown(a, terrain, STRAIGHT_M)
    low_m = _way_low_m(a, lower_m, highest_m) - highest_m
    if flown is not None:
        least_m, _, _ = flown.clearance.extremes_m()
        least_m -= [_lower_m(a, number, lower_m) for number in flown.item.tolist()]
        low_m = min(low_m, float(least_m[flown.clearance.is_known].min(initial=math.inf)))
    if low_m < a.setup.clearance_m:
        yield a.finding(
            HOME_UNKNOWN,
            f"no home in the file: taken off within {in_sight} of the first place, over "
            f"{quantity.height(lowest_m)} to {quantity.height(highest_m)} AMSL, the flight may be "
            f"{too_near_text(a, low_m)}",
            severity=Severity.ERROR,
        )
    elif flown is not None and lower_m and RELATIVE_FRAMES.issuperset(_asked_frames(a)):
        below = replace(a, route=replace(a.route, ground_datum_m=a.route.ground_datum_m - lower_m))
        for one in level_returns_too_low(below, terrain, a.path, flown.legs):
            if not isinstance(one, NotEvaluated):
                yield a.finding(
                    HOME_UNKNOWN,
                    f"no home in the file: taken off {quantity.height(lower_m)} lower than the first place, "
                    f"{one.message}",
                    item=one.item,
                    severity=Severity.ERROR,
                )


def _way_low_m(a: Assessment, lower_m: float, highest_m: float) -> float:
    """Return the lowest height of the ways out and home from where home is so much lower. [m AMSL]

    On the way out it is as high as it takes off, and as the first place; from every place it may return, as
    high as it is there, or returns from as far away as the highest ground is above home (45°): nearer, cones
    keep it low.
    """
    home_m, stages = a.route.home_amsl_m - lower_m, a.route.stages
    rows = [row for row, one in enumerate(stages) if one.kind in IN_THE_AIR]
    above_m = np.array([one.height_m for one in stages])
    above_m += [lower_m - _lower_m(a, one.item, lower_m) for one in stages]
    out = [row for row in {0, *rows[:1]} if not follows_terrain(a, stages[row].item)]
    low_m = float(above_m[out].min(initial=math.inf))
    if rows and not returns_follow_terrain(a):
        row = np.array(rows)
        away_m = max(near_home_m(a.setup.clearance_m), highest_m - home_m)
        begin_m = np.column_stack((np.full(len(row), away_m), np.zeros(len(row)), above_m[row]))
        targets = a.returns.destinations.targets(row, HOME, begin_m)
        begin_m[:, :2] += targets.ground_m[:, :2]
        low_m = min(low_m, float(a.returns.pilot.return_heights_m(begin_m, targets).min()))
    return home_m + low_m


def _asked_frames(a: Assessment) -> list[int]:
    """Return the frames of the places that are flown to."""
    numbers = {one.item for one in a.route.stages if one.kind in IN_THE_AIR and one.item > 0}
    return [a.mission.items[number - 1].frame for number in numbers]


def _lower_m(a: Assessment, number: int, home_m: float) -> float:
    """Return how much lower an item is flown over a home that is so much lower. [m]

    A return keeps the height at least that the item before it asks for.
    """
    frames = [item.frame for item in a.mission.items[: max(number, 0)]]
    asked = next((frame for frame in reversed(frames) if frame in GLOBAL_FRAMES), None)
    return home_m if asked is None or asked in RELATIVE_FRAMES else 0.0


class _Flown(Value, kw_only=False, eq=False):
    """The flight over ground, but where it begins or ends at it."""

    path: FlownPath
    legs: IntArray
    """Of the path, those that are judged."""
    clearance: Clearance
    item: IntArray
    """Of each part of the clearance. (k,)"""


def _flown(a: Assessment, terrain: TerrainGrid | None, straight_m: float) -> _Flown | None:
    """Return the height of a flight over ground; ``None`` where it only goes up and down."""
    from planner.flight.path import flown_lines

    path = a.path.cut(a.flight.motion, straight_m)
    legs = np.flatnonzero(~is_vertical_at_ground(a)[path.segment])
    if not len(legs):
        return None
    lines = near_home_cut(flown_lines(path, legs), a.setup.clearance_m)
    led_m = led_heights_m(a)[path.item[lines.owner]]
    clearance = clearance_of(a, terrain, lines, led_m=led_m)
    return _Flown(path, legs, clearance, path.item[lines.owner[clearance.line]])


def _may_be_low(a: Assessment) -> bool:
    """Return whether a flight may pass lower above home than --clearance."""
    if a.route.rows_of(StageKind.SPLINE):
        return True
    low_m, others = a.setup.clearance_m + _OVERSHOOT_M, LANDED_STAGES | RETURN_STAGES
    return any(stage.height_m < low_m and stage.kind not in others for stage in a.route.stages)


def _too_low(a: Assessment, flown: _Flown) -> Iterator[Found]:
    """Yield a finding where the flight is below the ground, or nearer to it than asked for."""
    clearance, item = flown.clearance, flown.item
    least_m, _, _ = clearance.extremes_m()
    follows = np.array([follows_terrain(a, number) for number in range(len(a.mission.items) + 1)])
    low = (least_m < clearance.asked_m) & ~follows[item]
    is_known = clearance.is_known
    is_asked_high = led_heights_m(a)[item] >= a.setup.clearance_m
    unsure = low & ~is_known & (least_m >= -_LEVEL_WITHIN_M)
    unsure &= least_m < clearance.asked_m - np.where(is_asked_high, _LEVEL_WITHIN_M, 0.0)
    if a.setup.terrain is not None:
        unsure &= ~clearance.is_missed  # reported with all the ground that is not known
    if unsure.any():
        lowest_m = float(least_m[unsure].min())
        yield NotEvaluated(
            rule=BELOW_TERRAIN,
            asked_by=f"a flight {above_text(lowest_m, 'home')}, over ground that is not known,",
            needs=f"{TERRAIN.what}, or a lower --clearance than {quantity.height(a.setup.clearance_m)}",
            item=int(item[(unsure & (least_m < lowest_m + _ALIKE_M)).argmax()]),
        )
    low &= is_known | (least_m < -_LEVEL_WITHIN_M)
    if not low.any():
        return
    lowest_m = float(least_m[low].min())
    worst = int((low & (least_m < lowest_m + _ALIKE_M)).argmax())
    to_go_m = float(clearance.length_m[worst + 1 :][item[worst + 1 :] == item[worst]].sum())
    before = f", {quantity.distance(to_go_m)} before its end" if to_go_m >= 1.0 else ""
    low_m = float(clearance.length_too_low_m()[low].sum())
    whole = f"; {quantity.distance(low_m)} of the path too low" if low_m >= 1.0 else ""
    assumed = "" if is_known[worst] else ", assumed level with home"
    yield a.finding(
        BELOW_TERRAIN,
        f"{too_near_text(a, lowest_m)}{assumed}{before}{whole}",
        item=int(item[worst]),
        fix=None
        if is_known[worst]
        else "correct the altitude, or give --terrain where the ground falls away",
    )


def _beside(a: Assessment, terrain: TerrainGrid, flown: _Flown) -> Iterator[Found]:
    """Yield a finding where the ground beside the path is too high, as near as the vehicle may be to it.

    The path is judged shifted to both sides, and all around where it turns, ends, or goes up or down; of
    cells so fine that one may be between, every centre is.
    """
    from planner.flight.path import FlightLines, flown_lines

    error_m, path = a.setup.position_margin_m, flown.path
    beside = f"the ground within {quantity.height(error_m)} of the path"
    follows = [follows_terrain(a, int(item)) for item in path.item[flown.legs]]
    lines = flown_lines(path, flown.legs[~np.array(follows)])
    if not len(lines.owner) or error_m <= 0.0:
        return
    sides = FlightLines.joined([*sides_of(lines, error_m), _around(lines, error_m)])
    sides = near_home_cut(sides.select(np.argsort(sides.owner, kind="stable")), a.setup.clearance_m)
    led_m = led_heights_m(a)[path.item]
    clearance = clearance_of(a, terrain, sides, led_m=led_m[sides.owner], beside_m=error_m)
    if clearance.is_missed.any():
        leg = int(sides.owner[clearance.line[clearance.is_missed.argmax()]])
        yield NotEvaluated(
            rule=BELOW_TERRAIN, asked_by=beside, needs=GROUND_THERE, item=int(path.item[leg])
        )
    least_m, _, _ = clearance.extremes_m()
    low_m = np.where(clearance.is_known & (least_m < clearance.asked_m), least_m, np.inf)
    worst = int(low_m.argmin())
    lowest_m, leg = float(low_m[worst]), int(sides.owner[clearance.line[worst]])
    peak = _highest_beside(a, terrain, lines, led_m[lines.owner])
    if peak is not None and peak.clearance_m < lowest_m:
        lowest_m, leg = peak.clearance_m, int(lines.owner[peak.row])
    if lowest_m < np.inf:
        yield a.finding(
            BELOW_TERRAIN,
            too_near_text(a, lowest_m, beside),
            item=int(path.item[leg]),
            fix="fly higher there, or farther from it; --position-error says how wrong the position may be",
        )


def _around(lines: FlightLines, radius_m: float) -> FlightLines:
    """Return circles about where lines turn, end, or go up or down, at the lower end of these."""
    from planner.flight.path import FlightLines

    way_m = (lines.end_m - lines.start_m)[:, :2]
    ahead = way_m / np.maximum(lines.length_m, SAME_PLACE_M)[:, None]
    goes_on = np.append((ahead[:-1] * ahead[1:]).sum(axis=1) > _STRAIGHT_ON, False)
    goes_on[:-1] &= (lines.end_m[:-1] == lines.start_m[1:]).all(axis=1)
    lower = (lines.start_m[:, 2] <= lines.end_m[:, 2])[:, None]
    is_upright = lines.length_m < SAME_PLACE_M
    first = np.append(True, (lines.end_m[:-1] != lines.start_m[1:]).any(axis=1))
    centre_m = np.concatenate(
        (
            lines.end_m[~goes_on],
            lines.start_m[first],
            np.where(lower, lines.start_m, lines.end_m)[is_upright],
        )
    )
    owner = np.concatenate([lines.owner[one] for one in (~goes_on, first, is_upright)])
    points_m = centre_m[:, None] + np.pad(circle_m(radius_m), ((0, 0), (0, 1)))
    return FlightLines(
        start_m=points_m[:, :-1].reshape(-1, 3),
        end_m=points_m[:, 1:].reshape(-1, 3),
        owner=np.repeat(owner, points_m.shape[1] - 1),
    )


def _highest_beside(
    a: Assessment, terrain: TerrainGrid, lines: FlightLines, led_m: FloatArray
) -> Lowest | None:
    """Return where a line passes lowest by a centre of fine cells; ``None`` where by none too low."""
    import shapely

    error_m, frame = a.setup.position_margin_m, a.route.frame
    if terrain.cell_m >= 2.0 * error_m:
        return None
    ends_m = np.stack((lines.start_m, lines.end_m), axis=1)
    level_m = a.route.ground_datum_m + float(ends_m[..., 2].min()) - a.setup.clearance_m
    box_m = ends_m.reshape(-1, 3)
    box_m = np.concatenate((box_m - error_m, box_m + error_m))
    latitude, longitude, ground_amsl_m = terrain.peaks_above(
        level_m, *frame.latitude_longitude_deg(*box_places_m(box_m))
    )
    if not len(latitude):
        return None
    peaks_m = np.column_stack(frame.east_north_m(latitude, longitude))
    tree = shapely.STRtree(shapely.linestrings(ends_m[..., :2]))
    peak, row = tree.query(shapely.points(peaks_m), predicate="dwithin", distance=error_m)
    if not len(row):
        return None
    _, height_m = nearest_m(peaks_m[peak], ends_m[row, 0], ends_m[row, 1])
    clearance_m = height_m - (ground_amsl_m[peak] - a.route.ground_datum_m)
    asked_m = asked_clearance_m(a.setup.clearance_m, np.hypot(*peaks_m[peak].T))
    asked_m -= ROUNDING_M + falls_short_m(led_m[row], height_m, asked_m)
    clearance_m = np.where(clearance_m < asked_m, clearance_m, np.inf)
    worst = int(clearance_m.argmin())
    if not np.isfinite(clearance_m[worst]):
        return None
    return Lowest(
        float(clearance_m[worst]), int(row[worst]), np.append(peaks_m[peak[worst]], height_m[worst])
    )


def _follows_too_low(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where ArduPilot follows the ground nearer to it than asked for."""
    for stage in a.route.stages:
        if stage.kind not in IN_THE_AIR or not follows_terrain(a, stage.item):
            continue
        height_m = a.mission.items[stage.item - 1].altitude_m or 0.0
        if 0.0 != height_m < a.setup.clearance_m:  # at 0 ArduPilot keeps its height
            yield a.finding(
                BELOW_TERRAIN, f"follows the ground {too_near_text(a, height_m)}", item=stage.item
            )
            return


@judges(BELOW_TERRAIN, needs=(TERRAIN,))
def _follows_too_late(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where the ground that a leg follows rises faster than ArduPilot climbs."""
    stages = a.route.stages
    rows = [
        row
        for row, stage in enumerate(stages)
        if row and stage.kind in _OVER_GROUND and follows_terrain(a, stage.item)
    ]
    if not rows:
        return
    parameters = following_parameters(a)
    place_m = stage_ends_m(a)
    above_m, (ends, return_m) = known_above_m(a, place_m), returns_from_ends_m(a, terrain)
    stage = np.array(rows, np.intp)
    is_return = np.array([stages[row].kind is StageKind.RETURN for row in rows])
    kept_m = return_m[ends.searchsorted(stage) - 1]
    asked_m = np.where(
        is_return[:, None],
        np.column_stack((kept_m, kept_m)),
        np.column_stack((above_m[stage - 1], above_m[stage])),
    )
    cruise_m_s = np.where(is_return, parameters.return_speed_m_s, parameters.cruise_speed_m_s)

    def limit(name: str, otherwise: FloatArray | float) -> FloatArray:
        given = np.array([getattr(stages[row], name) or np.nan for row in rows])
        return np.where(np.isnan(given), otherwise, given)

    least_m = FollowingLegs(
        start_m=place_m[stage - 1, :2],
        end_m=place_m[stage, :2],
        above_m=asked_m,
        limits_m_s=(
            limit("speed_m_s", cruise_m_s),
            limit("climb_speed_m_s", parameters.climb_speed_m_s),
            limit("descent_speed_m_s", parameters.descent_speed_m_s),
        ),
        stage=stage,
    ).least_above_m(a, terrain, parameters)
    enough_m = a.setup.clearance_m - ROUNDING_M
    is_low = (least_m < enough_m) & (
        asked_m.min(axis=1) >= enough_m
    )  # else it is told as asked for
    if is_low.any():
        worst = int(np.where(is_low, least_m, np.inf).argmin())
        lowest_m = float(least_m[worst])
        yield a.finding(
            BELOW_TERRAIN,
            f"follows the ground, which rises faster than it climbs: {too_near_text(a, lowest_m)}",
            item=stages[rows[worst]].item,
            fix="fly higher or more slowly there, or add an item where the ground begins to rise",
        )
