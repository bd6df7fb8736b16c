"""Rules on the ground: under the whole flight, under every return, and where it lands."""

from __future__ import annotations

import math
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import is_of_ardupilot
from planner.flight.returns.destination import HERE, HOME
from planner.mission.commands import TERRAIN_FRAMES, Command
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.mission.route.walk import TERRAIN_ASSUMED_LEVEL
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, PARAMETERS, PX4, TERRAIN, NotEvaluated, judges
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.flight.path import FlightLines, FlownPath
    from planner.flight.returns.fan import ReturnFan
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.px4 import Px4Parameters
    from planner.vehicle.parameters.resolve import FlightParameters

    Found = Finding | NotEvaluated

_IN_THE_AIR = frozenset(
    {StageKind.GO, StageKind.SPLINE, StageKind.LOITER, StageKind.CIRCLE, StageKind.CHANGE_HEIGHT}
)
_LANDS = frozenset({StageKind.LAND, StageKind.RETURN})
_OVER_GROUND = (_IN_THE_AIR - {StageKind.CIRCLE}) | {StageKind.RETURN}
"""Stages with a straight leg that may follow the ground."""
_MOST_PLACES = 4000
"""Of a leg at which the ground is looked up."""
_STEEPEST_RETURNS = 20
"""So many returns, those over the steepest ground, are flown step by step."""
_LEVEL_WITHIN_M = 1.0
"""Nearer to home's height, rounding may be meant. [m]"""
_OVERSHOOT_M = 3.0
"""Steps and curves pass no lower than this below the places they lead to. [m]"""
_PART_M = 2.5
"""Lines near home are judged in parts so long: the ground there may rise by 0.7 m in one. [m]"""
_STRAIGHT_M = 1000.0
"""Lines so long are straight in degrees too, to 2 cm at 47°. [m]"""
_MOST_RETURNS = 2_000
_RETURN_SPACING_M = 100.0
"""Returns begin no farther apart, nor than a cell, unless there would be more than can be judged; the
ground between them is judged as well. [m]"""
_MOST_CELLS = 500_000
"""Cells that returns pass over, at most: beyond, they begin farther apart."""
_NARROW_M2 = 1e-6
"""Returns from a stretch that pass over less are one line. [m²]"""
_BOX_PLACES = 5
"""Along each side of a box, and in it: enough for the box in a projection."""
_OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_STEEP_DEG, _TOO_STEEP_DEG = 7.0, 15.0
"""Slopes to warn of, and to refuse, at a landing: of helicopters the US Army lands all on up to 7°, those
on wheels with an advisory on up to 15°, none beyond (FM 3-21.38, landing sites). [°]"""
_FASTER, _TOO_FAST_M_S = 1.1, 2.0
"""Over the speed of landing, and in all: LAND_SPEED is documented from 0.3 m/s to 2 m/s. [-], [m s⁻¹]"""
_SLOWED_WITHIN_M, _HEIGHTS = 50.0, 501
"""What it takes to slow down from 20 m/s by 4 m/s², and at how many heights speeds are looked up. [m], [-]"""
_RISE = math.tan(math.radians(_TOO_STEEP_DEG))
"""Of the ground around where a vehicle can stand: 5 m in 19 m. [-]"""
_NOT_AIRBORNE = [STATE_INDEX[state] for state in (FlightState.TAKEOFF, FlightState.LAND)]
_LEVEL = [
    STATE_INDEX[state] for state in (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
]
_ALIKE_M = 0.01
"""Places that differ by less are as low as each other: the first is named. [m]"""
_STRAIGHT_ON = math.cos(0.5)
"""Of the angle by which a path turns at most without a corner. [-]"""
_CIRCLE_PARTS = 12
"""Chords of a circle: within 9 cm of one of 2.5 m."""
_SAME_PLACE_M = 1e-3
"""Lines shorter over ground go up and down. [m]"""
_ROUNDING_M = 1e-4
"""Heights of grids are of single precision. [m]"""

BELOW_TERRAIN = Rule(
    "A102 below-terrain",
    Severity.ERROR,
    summary="The flight meets the ground, or passes nearer to it than --clearance.",
    why="Waypoints above the ground do not keep the leg between them above a ridge; height above "
    "ground is requested again and again (MissionPlanner #706, QGroundControl #4007).",
    how="Height of the predicted flight minus the ground of --terrain along the whole flight without take-"
    "off and landing: cut wherever it passes from cell to cell, and at the least of each cell, so that "
    "no ridge falls between two samples; --position-error to both sides of it too, around where it "
    "turns, ends, or goes up or down, and at every centre nearer than that of cells narrower than twice "
    "as much; fires below --clearance, 5 m by default (heights above home and grids err by some metres "
    "each).  Legs that follow terrain on ArduPilot are judged by their height above it, less what they "
    "get too low where the ground rises faster than they climb (it looks at the ground below alone).  "
    "Not evaluated (X904) where --terrain has no ground under the path, or --position-error beside it: "
    "a hole in its grid, or beyond its end.  Without --terrain the ground is level with home: a path "
    "more than 1 m below it fires, and one nearer to it than --clearance is not evaluated (X904), by more "
    "than 1 m between places that are asked for no lower (PX4 ends a take-off NAV_MC_ALT_RAD below its "
    "height): it cannot be wrong by less than ground that is known.  Around home, where the vehicle stood, "
    "the clearance is what ground of 15° rises, 5 m in 19 m.",
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
    "--position-error of them.  Where "
    "RTL_ALT_TYPE follows terrain, RTL_ALT against --clearance, and the 20 returns over the steepest "
    "ground, which they may climb too slowly for.  PX4 also by RTL_DESCEND_ALT above a rally "
    "point that lies below the ground: it goes down to there before it lands.  Not evaluated (X904) where "
    "--terrain has no ground under a return, and without --terrain where returns follow terrain.",
    fix="raise RTL_RETURN_ALT (PX4) or RTL_ALT (ArduPilot) above the highest ground, or fly round it",
    instead="--terrain or --clearance",
)


GROUND_CLEARANCE = Rule(
    "A116 ground-clearance",
    Severity.INFO,
    summary="Least and greatest height above the ground.",
    why="Legal limits count from the ground, not from home (MissionPlanner #706).",
    how="As for A102, as far as the grid reaches.",
    fix="",
)


_GROUND_THERE = "a grid without holes there: --terrain, with several files where one ends"


class _Clearance(Value, eq=False):
    """Height above the ground along lines, in parts in which it is a parabola."""

    line: IntArray
    """Line each part is of, rising. (k,)"""
    start: FloatArray
    """Where on its line each part begins and ends, 0 to 1. (k,)"""
    end: FloatArray
    length_m: FloatArray
    """Over ground. (k,) [m]"""
    at_m: FloatArray
    """At the beginning, the middle and the end; above home's level where the ground is not known. (k, 3)"""
    is_known: BoolArray
    """Whether the ground is. (k,)"""
    asked_m: FloatArray
    """What is to be kept. (k,) [m]"""
    is_missed: BoolArray
    """Whether the ground is not known where it matters: not by home, where the vehicle stood. (k,)"""

    def extremes_m(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the least and the greatest of each part, and where on the line the least is. (k,)"""
        first, middle, last = self.at_m.T
        bend = 2.0 * (first - 2.0 * middle + last)
        slope = last - first - bend
        turns = np.abs(bend) > _ROUNDING_M
        top = np.clip(-slope / np.where(turns, 2.0 * bend, 1.0), 0.0, 1.0)
        top = np.where(turns, top, 0.0)
        values = np.stack((first, first + top * (slope + top * bend), last))
        place = np.stack((np.zeros(len(top)), top, np.ones(len(top))))
        lowest = values.argmin(axis=0)[None]
        where = np.take_along_axis(place, lowest, axis=0)[0]
        return (
            np.take_along_axis(values, lowest, axis=0)[0],
            values.max(axis=0),
            self.start + where * (self.end - self.start),
        )

    def length_too_low_m(self) -> FloatArray:
        """Return the length of each part that is lower than is asked for. (k,) [m]"""
        first, middle, last = self.at_m.T - self.asked_m
        bend = 2.0 * (first - 2.0 * middle + last)
        slope = last - first - bend
        turns = np.abs(bend) > _ROUNDING_M
        root = np.sqrt(np.maximum(slope**2 - 4.0 * bend * first, 0.0))
        twice = np.where(turns, 2.0 * bend, 1.0)
        straight = -first / np.where(slope != 0.0, slope, 1.0)
        cuts = np.sort(
            [
                np.zeros(len(bend)),
                np.clip(np.where(turns, (-slope - root) / twice, straight), 0.0, 1.0),
                np.clip(np.where(turns, (-slope + root) / twice, straight), 0.0, 1.0),
                np.ones(len(bend)),
            ],
            axis=0,
        )
        middles = 0.5 * (cuts[1:] + cuts[:-1])
        below = first + middles * (slope + middles * bend) < 0.0
        share: FloatArray = (np.diff(cuts, axis=0) * below).sum(axis=0)
        return share * self.length_m


def _clearance(
    a: Assessment, terrain: TerrainGrid | None, lines: FlightLines, *, beside_m: float = 0.0
) -> _Clearance:
    """Return the height above the ground along lines no longer than what is straight.

    Of lines ``beside_m`` of the flight it is asked what is asked of the flight. [m]
    """
    ends = np.stack((lines.start_m, lines.end_m), axis=1)
    if terrain is None or not a.route.knows_home_amsl:
        line = np.arange(len(ends))
        start, end = np.zeros(len(ends)), np.ones(len(ends))
        ground_m = np.full((len(ends), 3), np.nan)
    else:
        ground = terrain.under(*a.route.frame.latitude_longitude_deg(ends[..., 0], ends[..., 1]))
        line, start, end = ground.line, ground.start, ground.end
        ground_m = ground.ground_amsl_m - a.route.ground_datum_m
    along = np.stack((start, 0.5 * (start + end), end), axis=1)
    place_m = ends[line, :1] + along[..., None] * (ends[line, 1:] - ends[line, :1])
    is_known = ~np.isnan(ground_m).any(axis=1)
    ground_m = np.where(is_known[:, None], ground_m, 0.0)
    from_home_m = np.hypot(place_m[..., 0], place_m[..., 1]).max(axis=1)
    from_home_m = np.maximum(from_home_m - beside_m, 0.0)
    near_home_m = a.setup.clearance_m / _RISE
    return _Clearance(
        line=line,
        start=start,
        end=end,
        length_m=lines.length_m[line] * (end - start),
        at_m=place_m[..., 2] - ground_m,
        is_known=is_known,
        asked_m=np.minimum(a.setup.clearance_m, _RISE * from_home_m) - _ROUNDING_M,
        is_missed=~is_known & (from_home_m > near_home_m),
    )


def _near_home_cut(lines: FlightLines, clearance_m: float) -> FlightLines:
    """Return lines, those cut that begin or end where less than the whole clearance is asked for."""
    from planner.flight.path import FlightLines

    near_m = clearance_m / _RISE
    near = np.minimum(*(np.hypot(*end[:, :2].T) for end in (lines.start_m, lines.end_m))) < near_m
    if not near.any():
        return lines
    both = FlightLines.joined([lines.select(~near), lines.select(near).cut(_PART_M)])
    return both.select(np.argsort(both.owner, kind="stable"))


@judges(BELOW_TERRAIN)
def _level_ground(a: Assessment) -> Iterator[Found]:
    """Judge a low flight over ground that is not known at all."""
    if a.setup.terrain is None and _may_be_low(a):
        flown = _flown(a, None, _STRAIGHT_M)
        if flown is not None:
            yield from _too_low(a, flown)


@judges(BELOW_TERRAIN, RETURN_BELOW_TERRAIN, GROUND_CLEARANCE, needs=(TERRAIN,))
def _ground(a: Assessment, terrain: TerrainGrid) -> Iterator[Found]:
    cell_m = terrain.cell_m
    # Places to return from are among the points of the path.
    longest_m = max(
        min(_RETURN_SPACING_M, cell_m),
        float(a.flight.motion.segments.distance_m.sum()) / _MOST_RETURNS,
    )
    flown = _flown(a, terrain, min(longest_m, _STRAIGHT_M))
    if flown is None:
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
            needs=_GROUND_THERE,
            item=int(item[is_missed.argmax()]),
        )
    elif not over:
        yield from _beside(a, terrain, flown)
    yield from _follows_too_low(a)
    returns = _returns(a, terrain, flown.path, flown.legs, cell_m)
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


class _Flown(Value, kw_only=False, eq=False):
    """The flight over ground, but where it begins or ends at it."""

    path: FlownPath
    legs: IntArray
    """Of the path, those that are judged."""
    clearance: _Clearance
    item: IntArray
    """Of each part of the clearance. (k,)"""


def _flown(a: Assessment, terrain: TerrainGrid | None, straight_m: float) -> _Flown | None:
    """Return the height of a flight over ground; ``None`` where it only goes up and down."""
    from planner.flight.path import flown_path

    path = flown_path(a.flight.motion, straight_m=straight_m, with_heights=True)
    legs = np.flatnonzero(~_is_vertical_at_ground(a)[path.segment])
    return _over(a, terrain, path, legs) if len(legs) else None


def _over(a: Assessment, terrain: TerrainGrid | None, path: FlownPath, legs: IntArray) -> _Flown:
    """Return the height of legs of a path over ground."""
    from planner.flight.path import flown_lines

    lines = _near_home_cut(flown_lines(path, legs), a.setup.clearance_m)
    clearance = _clearance(a, terrain, lines)
    return _Flown(path, legs, clearance, path.item[lines.owner[clearance.line]])


def items_too_low(
    a: Assessment, terrain: TerrainGrid, path: FlownPath, legs: IntArray
) -> frozenset[int]:
    """Return the first items on whose legs of a path a vehicle were too low, within its position error."""
    flown = _over(a, terrain, path, legs)
    found = (*_too_low(a, flown), *_beside(a, terrain, flown))
    return frozenset(one.item for one in found if one.item is not None)


def _may_be_low(a: Assessment) -> bool:
    """Return whether a flight may pass lower above home than --clearance."""
    if a.route.rows_of(StageKind.SPLINE):
        return True
    low_m, others = a.setup.clearance_m + _OVERSHOOT_M, _LANDS | RETURN_STAGES
    return any(stage.height_m < low_m and stage.kind not in others for stage in a.route.stages)


def _is_vertical_at_ground(a: Assessment) -> BoolArray:
    """Return whether segments take off, land, or set down a load: they begin or end at the ground. (s,)"""
    columns = a.flight.motion.segments
    sets_down = np.isin(a.returns.segment_stage, a.route.rows_of(StageKind.SET_DOWN))
    # It stands, or climbs and descends: what is left is the level way there.
    lowers = sets_down & ~np.isin(columns.state, _LEVEL)
    return np.asarray(np.isin(columns.state, _NOT_AIRBORNE) | lowers)


def _above(clearance_m: float, what: str = "the ground") -> str:
    side = "below" if clearance_m < 0.0 else "above"
    return f"{quantity.height(abs(clearance_m))} {side} {what}"


def _asked(a: Assessment, clearance_m: float) -> str:
    """Return what was asked for, where the ground itself is not met."""
    asked = quantity.height(a.setup.clearance_m)
    return "" if clearance_m < 0.0 else f" (--clearance {asked})"


def _too_low(a: Assessment, flown: _Flown) -> Iterator[Found]:
    """Yield a finding where the flight is below the ground, or nearer to it than asked for."""
    clearance, item = flown.clearance, flown.item
    least_m, _, _ = clearance.extremes_m()
    follows = np.array([_follows_terrain(a, number) for number in range(len(a.mission.items) + 1)])
    low = (least_m < clearance.asked_m) & ~follows[item]
    is_known = clearance.is_known
    falls_short_m = np.where(_is_asked_high(a)[item], _LEVEL_WITHIN_M, 0.0)
    unsure = low & ~is_known & (least_m >= -_LEVEL_WITHIN_M)
    unsure &= least_m < clearance.asked_m - falls_short_m
    if a.setup.terrain is not None:
        unsure &= ~clearance.is_missed  # reported with all the ground that is not known
    if unsure.any():
        lowest_m = float(least_m[unsure].min())
        yield NotEvaluated(
            rule=BELOW_TERRAIN,
            asked_by=f"a flight {_above(lowest_m, 'home')}, over ground that is not known,",
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
        f"{_above(lowest_m)}{_asked(a, lowest_m)}{assumed}{before}{whole}",
        item=int(item[worst]),
        fix=None
        if is_known[worst]
        else "correct the altitude, or give --terrain where the ground falls away",
    )


def _is_asked_high(a: Assessment) -> BoolArray:
    """Return whether an item leads the vehicle no lower than --clearance above home. (items + 1,)"""
    is_high = np.ones(len(a.mission.items) + 1, dtype=np.bool_)
    from_m = math.inf  # a take-off is judged where it has ended
    for stage in a.route.stages:
        goes_down = stage.kind in _LANDS | RETURN_STAGES
        is_high[stage.item] &= not goes_down and min(from_m, stage.height_m) >= a.setup.clearance_m
        from_m = stage.height_m
    return is_high


def _beside(a: Assessment, terrain: TerrainGrid, flown: _Flown) -> Iterator[Found]:
    """Yield a finding where the ground beside the path is too high, as near as the vehicle may be to it.

    The path is judged shifted to both sides, and all around where it turns, ends, or goes up or down; of
    cells so fine that one may be between, every centre is.
    """
    from planner.flight.path import FlightLines, flown_lines

    error_m, path = a.setup.position_margin_m, flown.path
    follows = [_follows_terrain(a, int(item)) for item in path.item[flown.legs]]
    lines = flown_lines(path, flown.legs[~np.array(follows)])
    if not len(lines.owner) or error_m <= 0.0:
        return
    way_m = (lines.end_m - lines.start_m)[:, :2]
    across = np.column_stack((-way_m[:, 1], way_m[:, 0], np.zeros(len(way_m))))
    across *= error_m / np.maximum(np.hypot(*way_m.T), _SAME_PLACE_M)[:, None]
    sides = FlightLines.joined(
        [
            replace(lines, start_m=lines.start_m + side, end_m=lines.end_m + side)
            for side in (-across, across)
        ]
        + [_around(lines, error_m)]
    )
    sides = _near_home_cut(
        sides.select(np.argsort(sides.owner, kind="stable")), a.setup.clearance_m
    )
    clearance = _clearance(a, terrain, sides, beside_m=error_m)
    if clearance.is_missed.any():
        leg = int(sides.owner[clearance.line[clearance.is_missed.argmax()]])
        yield NotEvaluated(
            rule=BELOW_TERRAIN,
            asked_by=f"the ground within {_beside_m(a)} of the path",
            needs=_GROUND_THERE,
            item=int(path.item[leg]),
        )
    least_m, _, _ = clearance.extremes_m()
    low_m = np.where(clearance.is_known & (least_m < clearance.asked_m), least_m, np.inf)
    worst = int(low_m.argmin())
    lowest_m, leg = float(low_m[worst]), int(sides.owner[clearance.line[worst]])
    peak = _highest_beside(a, terrain, lines)
    if peak is not None and peak.clearance_m < lowest_m:
        lowest_m, leg = peak.clearance_m, int(lines.owner[peak.row])
    if lowest_m < np.inf:
        yield a.finding(
            BELOW_TERRAIN,
            f"{_above(lowest_m, f'the ground within {_beside_m(a)} of the path')}{_asked(a, lowest_m)}",
            item=int(path.item[leg]),
            fix="fly higher there, or farther from it; --position-error says how wrong the position may be",
        )


def _around(lines: FlightLines, radius_m: float) -> FlightLines:
    """Return circles about where lines turn, end, or go up or down, at the lower end of these."""
    from planner.flight.path import FlightLines

    way_m = (lines.end_m - lines.start_m)[:, :2]
    ahead = way_m / np.maximum(lines.length_m, _SAME_PLACE_M)[:, None]
    goes_on = np.append((ahead[:-1] * ahead[1:]).sum(axis=1) > _STRAIGHT_ON, False)
    goes_on[:-1] &= (lines.end_m[:-1] == lines.start_m[1:]).all(axis=1)
    lower = (lines.start_m[:, 2] <= lines.end_m[:, 2])[:, None]
    is_upright = lines.length_m < _SAME_PLACE_M
    first = np.append(True, (lines.end_m[:-1] != lines.start_m[1:]).any(axis=1))
    centre_m = np.concatenate(
        (
            lines.end_m[~goes_on],
            lines.start_m[first],
            np.where(lower, lines.start_m, lines.end_m)[is_upright],
        )
    )
    owner = np.concatenate([lines.owner[one] for one in (~goes_on, first, is_upright)])
    angle = np.linspace(0.0, 2.0 * math.pi, _CIRCLE_PARTS + 1)
    circle_m = radius_m * np.column_stack((np.cos(angle), np.sin(angle), np.zeros(len(angle))))
    points_m = centre_m[:, None] + circle_m
    return FlightLines(
        start_m=points_m[:, :-1].reshape(-1, 3),
        end_m=points_m[:, 1:].reshape(-1, 3),
        owner=np.repeat(owner, _CIRCLE_PARTS),
    )


def _beside_m(a: Assessment) -> str:
    return quantity.height(a.setup.position_margin_m)


def _highest_beside(a: Assessment, terrain: TerrainGrid, lines: FlightLines) -> _Low | None:
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
        level_m, *frame.latitude_longitude_deg(*_box_m(box_m))
    )
    if not len(latitude):
        return None
    peaks_m = np.column_stack(frame.east_north_m(latitude, longitude))
    tree = shapely.STRtree(shapely.linestrings(ends_m[..., :2]))
    peak, row = tree.query(shapely.points(peaks_m), predicate="dwithin", distance=error_m)
    if not len(row):
        return None
    _, height_m = _nearest_m(peaks_m[peak], ends_m[row, 0], ends_m[row, 1])
    clearance_m = height_m - (ground_amsl_m[peak] - a.route.ground_datum_m)
    asked_m = np.minimum(a.setup.clearance_m, _RISE * np.hypot(*peaks_m[peak].T)) - _ROUNDING_M
    clearance_m = np.where(clearance_m < asked_m, clearance_m, np.inf)
    worst = int(clearance_m.argmin())
    if not np.isfinite(clearance_m[worst]):
        return None
    return _Low(
        float(clearance_m[worst]), int(row[worst]), np.append(peaks_m[peak[worst]], height_m[worst])
    )


def _nearest_m(
    place_m: FloatArray, start_m: FloatArray, end_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return how far lines are from places on the map, and their heights there; of upright ones the least."""
    way_m = end_m - start_m
    squared = (way_m[:, :2] ** 2).sum(axis=1)
    along = ((place_m - start_m[:, :2]) * way_m[:, :2]).sum(axis=1)
    share = np.clip(along / np.maximum(squared, _SAME_PLACE_M**2), 0.0, 1.0)
    nearest_m = start_m + share[:, None] * way_m
    lower_m = np.minimum(start_m[:, 2], end_m[:, 2])
    return (
        np.hypot(*(place_m - nearest_m[:, :2]).T),
        np.where(squared > _SAME_PLACE_M**2, nearest_m[:, 2], lower_m),
    )


def _follows_terrain(a: Assessment, number: int) -> bool:
    """Return whether ArduPilot follows the ground to an item, from 1; a return by RTL_ALT_TYPE."""
    by = a.autopilot
    if by is Autopilot.STEP and a.setup.terrain is not None and a.target is not None:
        by = a.target.autopilot
    if by is not Autopilot.ARDUPILOT or number <= 0:
        return False
    item = a.mission.items[number - 1]
    if item.command == Command.NAV_RETURN_TO_LAUNCH:
        return returns_follow_terrain(a)
    return item.frame in TERRAIN_FRAMES


def _follows_too_low(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where ArduPilot follows the ground nearer to it than asked for."""
    for stage in a.route.stages:
        if stage.kind not in _IN_THE_AIR or not _follows_terrain(a, stage.item):
            continue
        height_m = a.mission.items[stage.item - 1].altitude_m or 0.0
        if 0.0 != height_m < a.setup.clearance_m:  # at 0 ArduPilot keeps its height
            yield a.finding(
                BELOW_TERRAIN,
                f"follows the ground {_above(height_m)}{_asked(a, height_m)}",
                item=stage.item,
            )
            return


class _FollowingLegs(Value, eq=False):
    """Straight legs that ArduPilot flies at a height above the ground."""

    start_m: FloatArray
    """East and north. (n, 2) [m]"""
    end_m: FloatArray
    above_m: FloatArray
    """Height above the ground asked for at the beginning and the end. (n, 2) [m]"""
    limits_m_s: tuple[FloatArray, FloatArray, FloatArray]
    """Of horizontal flight, climbs and descents. (n,) each"""
    stage: IntArray
    """Those of consecutive numbers follow each other. (n,)"""

    def least_above_m(
        self, a: Assessment, terrain: TerrainGrid, parameters: ArduPilotParameters
    ) -> FloatArray:
        """Return the least height of each above the ground, as it is flown; NaN: not known. (n,) [m]"""
        from planner.flight.motion.ardupilot.stages import followed_above_m

        length_m = np.hypot(*(self.end_m - self.start_m).T)
        ground_m = []
        for start_m, end_m, long_m in zip(self.start_m, self.end_m, length_m, strict=True):
            count = min(int(long_m / max(terrain.cell_m, _PART_M)) + 2, _MOST_PLACES)
            places_m = start_m + np.linspace(0.0, 1.0, count)[:, None] * (end_m - start_m)
            where = a.route.frame.latitude_longitude_deg(*places_m.T)
            ground_m.append(terrain.height_amsl_m(*where).filled(np.nan))
        is_known = np.array([not np.isnan(own).any() for own in ground_m], np.bool_)
        level = [
            own if known else np.zeros(2) for own, known in zip(ground_m, is_known, strict=True)
        ]
        least_m = followed_above_m(
            self.stage,
            level,
            length_m,
            self.above_m,
            limits_m_s=self.limits_m_s,
            parameters=parameters,
        )
        return np.where(is_known, least_m, np.nan)


@judges(BELOW_TERRAIN, needs=(TERRAIN,))
def _follows_too_late(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where the ground that a leg follows rises faster than ArduPilot climbs."""
    stages = a.route.stages
    rows = [
        row
        for row, stage in enumerate(stages)
        if row and stage.kind in _OVER_GROUND and _follows_terrain(a, stage.item)
    ]
    if not rows:
        return
    parameters = _ardupilots(a)
    place_m = np.array([(one.east_m, one.north_m, one.height_m) for one in stages])
    ground_m = terrain.height_amsl_m(*a.route.frame.latitude_longitude_deg(*place_m[:, :2].T))
    above_m = place_m[:, 2] - (ground_m.filled(np.nan) - a.route.ground_datum_m)
    stage = np.array(rows, np.intp)
    is_return = np.array([stages[row].kind is StageKind.RETURN for row in rows])
    kept_m = np.fmax(above_m[stage - 1], parameters.return_altitude_m)
    asked_m = np.where(
        is_return[:, None],
        np.column_stack((kept_m, kept_m)),
        np.column_stack((above_m[stage - 1], above_m[stage])),
    )
    cruise_m_s = np.where(is_return, parameters.return_speed_m_s, parameters.cruise_speed_m_s)

    def limit(name: str, otherwise: FloatArray | float) -> FloatArray:
        given = np.array([getattr(stages[row], name) or np.nan for row in rows])
        return np.where(np.isnan(given), otherwise, given)

    least_m = _FollowingLegs(
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
    enough_m = a.setup.clearance_m - _ROUNDING_M
    is_low = (least_m < enough_m) & (
        asked_m.min(axis=1) >= enough_m
    )  # else it is told as asked for
    if is_low.any():
        worst = int(np.where(is_low, least_m, np.inf).argmin())
        lowest_m = float(least_m[worst])
        yield a.finding(
            BELOW_TERRAIN,
            f"follows the ground, which rises faster than it climbs: {_above(lowest_m)}"
            f"{_asked(a, lowest_m)}",
            item=stages[rows[worst]].item,
            fix="fly higher or more slowly there, or add an item where the ground begins to rise",
        )


def _ardupilots(a: Assessment) -> ArduPilotParameters:
    """Return the parameters ArduPilot follows the ground by: a file's, else as it is delivered."""
    from planner.vehicle.parameters.resolve import resolve_parameters

    own = ARDUPILOT.of(a) or resolve_parameters(Autopilot.ARDUPILOT, model=a.vehicle).values
    assert is_of_ardupilot(own)
    return own


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT, TERRAIN))
def _returns_too_late(
    a: Assessment, parameters: ArduPilotParameters, terrain: TerrainGrid
) -> Iterator[Finding]:
    """Yield a finding where the ground under a return that follows it rises faster than it climbs."""
    sample = a.returns.sample
    if sample is None or not len(sample.destination) or not returns_follow_terrain(a):
        return
    corners_m, _ = a.returns.straight_corners_m(sample.points, sample.destination)
    ways_m = corners_m[:, 2:4, :2]
    where = a.route.frame.latitude_longitude_deg(ways_m[..., 0], ways_m[..., 1])
    ground = terrain.under(*where)
    length_m = np.hypot(*(ways_m[:, 1] - ways_m[:, 0]).T)[ground.line] * (ground.end - ground.start)
    rise_m = np.nan_to_num(ground.ground_amsl_m[:, 2] - ground.ground_amsl_m[:, 0], nan=0.0)
    climbed_m = length_m * parameters.climb_speed_m_s / parameters.return_speed_m_s
    behind_m = np.bincount(ground.line, np.maximum(rise_m - climbed_m, 0.0), len(ways_m))
    chosen = np.argsort(-behind_m, kind="stable")[:_STEEPEST_RETURNS]
    first = np.searchsorted(ground.line, chosen)
    above_m = corners_m[chosen, 1, 2] - (ground.ground_amsl_m[first, 0] - a.route.ground_datum_m)
    above_m = np.fmax(above_m, parameters.return_altitude_m)
    one = np.ones(len(chosen))
    least_m = _FollowingLegs(
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
    lowest_m, enough_m = float(least_m[worst]), a.setup.clearance_m - _ROUNDING_M
    if lowest_m < enough_m <= parameters.return_altitude_m:
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return from here follows the ground, which rises faster than it climbs: {_above(lowest_m)}"
            f"{_asked(a, lowest_m)}",
            item=a.route.stages[int(sample.points.stage[chosen[worst]])].item,
            fix="raise RTL_ALT, or set RTL_ALT_TYPE 0 with RTL_ALT above the highest ground",
        )


def _rangefinder_reach_m(a: Assessment) -> float | None:
    from planner.rules.arming_checks import rangefinder_reach_m

    return rangefinder_reach_m(numbers(a))


def returns_follow_terrain(a: Assessment) -> bool:
    """Return whether returns keep a height above the ground.

    ``ModeRTL::compute_return_target``: with terrain data or a rangefinder, else above home as ever.
    """
    own = ARDUPILOT.of(a)
    if own is None or own.return_altitude_type != _OVER_TERRAIN:
        return False
    reach_m = _rangefinder_reach_m(a)
    if reach_m is not None:  # out of its reach ModeRTL begins again, above home
        return own.return_altitude_m <= reach_m
    return bool(own.terrain_enable)


def tops_over_terrain_m(a: Assessment, corners_m: FloatArray) -> FloatArray:
    """Return the greatest height above the first home of returns that may follow the ground of --terrain.

    Where none does, or the ground is not known, −∞.  ``corners_m`` are those of `Returns.straight_corners_m`.
    (n,) [m]
    """
    terrain, tops_m = a.setup.terrain, np.full(len(corners_m), -np.inf)
    own = ARDUPILOT.of(a)
    if terrain is None or own is None or not returns_follow_terrain(a):
        return tops_m
    ways_m = corners_m[:, 2:4, :2]
    ground = terrain.under(*a.route.frame.latitude_longitude_deg(ways_m[..., 0], ways_m[..., 1]))
    ground_m = ground.ground_amsl_m.max(axis=1) - a.route.ground_datum_m
    begins = np.flatnonzero(np.diff(ground.line, prepend=-1))
    below_m = ground.ground_amsl_m[begins, 0] - a.route.ground_datum_m
    above_m = np.fmax(corners_m[:, 1, 2] - below_m, own.return_altitude_m)
    np.fmax.at(tops_m, ground.line, ground_m + above_m[ground.line])
    return tops_m


@judges(RETURN_BELOW_TERRAIN, needs=(ARDUPILOT,))
def _returns_over_terrain(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Found]:
    has_source = parameters.terrain_enable or _rangefinder_reach_m(a) is not None
    if parameters.return_altitude_type != _OVER_TERRAIN or not has_source:
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
            RETURN_BELOW_TERRAIN,
            f"returns follow the ground {_above(height_m)}{_asked(a, height_m)}",
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
    if waits_m[worst] <= _ROUNDING_M:
        yield a.finding(
            RETURN_BELOW_TERRAIN,
            f"a return to rally point {int(sample.destination[worst])} goes down to "
            f"{_above(float(waits_m[worst]))} before it lands",
            fix="correct the altitude of the rally point: it counts from home",
        )


def _returns(
    a: Assessment, terrain: TerrainGrid, path: FlownPath, legs: IntArray, cell_m: float
) -> Iterator[Found]:
    """Yield a finding where a return of the vehicle meets the ground."""
    from planner.flight.path import FlightLines
    from planner.flight.returns.fan import return_fan

    if returns_follow_terrain(a):
        return
    # The mission's own return is judged as it is flown.
    own = [stage.item for stage in a.route.stages_of(StageKind.RETURN)]
    legs = legs[~np.isin(path.item[legs], own)]
    if not len(legs):
        return
    stage = a.returns.segment_stage[path.segment[legs]]
    along_m = np.cumsum(path.length_m[legs])
    spacing_m = max(min(_RETURN_SPACING_M, cell_m), float(along_m[-1]) / _MOST_RETURNS)
    # Legs that follow each other on a stage, no longer than the spacing, are one stretch.
    number = np.floor((along_m - path.length_m[legs]) / spacing_m)
    new = (np.diff(number, prepend=-1.0) != 0.0) | (np.diff(stage, prepend=-1) != 0)
    new |= np.diff(legs, prepend=-2) != 1
    first = np.flatnonzero(new)
    last = np.append(first[1:], len(legs)) - 1
    time_s = np.stack((path.time_s[legs[first]], path.time_s[legs[last] + 1]), axis=1)
    fan, along = return_fan(a.returns, time_s, stage[first])
    item = path.item[legs[first]][fan.stretch]
    # From where it decides to over where it lands; the landing itself is not judged.
    corners = fan.corners_m[:, :, :4].reshape(-1, 4, 3)
    lines = FlightLines(
        start_m=corners[:, :-1].reshape(-1, 3),
        end_m=corners[:, 1:].reshape(-1, 3),
        owner=np.repeat(np.arange(len(corners)) // 2, 3),
    )
    # Between lines the ground is highest at centres of cells, all of which are judged.
    every = int(np.ceil(float(lines.length_m.sum()) / (cell_m * _MOST_CELLS))) or 1
    lines = lines.select(lines.owner % every == 0)
    count = len(fan.stretch)
    both = FlightLines.joined([lines, replace(along, owner=along.owner + count)])
    both = both.cut(_STRAIGHT_M)
    clearance = _clearance(a, terrain, both)
    least_m, _, where = clearance.extremes_m()
    if clearance.is_missed.any():
        owner = int(both.owner[clearance.line[clearance.is_missed.argmax()]])
        yield NotEvaluated(
            rule=RETURN_BELOW_TERRAIN,
            asked_by="the ground under a return",
            needs=_GROUND_THERE,
            item=int(item[owner]) if owner < count else None,
        )
    is_low = clearance.is_known & (least_m < clearance.asked_m)
    least_m = np.where(is_low, least_m, np.inf)
    worst = int(least_m.argmin())
    line = int(clearance.line[worst])
    place_m = both.start_m[line] + where[worst] * (both.end_m[line] - both.start_m[line])
    low = _Low(float(least_m[worst]), int(both.owner[line]), place_m)
    peak = _lowest_over_peaks(a, terrain, fan)
    if peak is not None and peak.clearance_m < low.clearance_m:
        low = peak
    if low.clearance_m >= a.setup.clearance_m - _ROUNDING_M:
        return
    above = f"{_above(low.clearance_m)}{_asked(a, low.clearance_m)}"
    if low.row >= count:
        yield a.finding(RETURN_BELOW_TERRAIN, f"the return along the mission is {above}")
        return
    to_go_m = float(np.hypot(*(fan.corners_m[low.row, 0, 3] - low.place_m)[:2]))
    goal = "home" if fan.destination[low.row] == HOME else "its landing"
    yield a.finding(
        RETURN_BELOW_TERRAIN,
        f"a return from here, {quantity.height(float(low.place_m[2]))} above home, is {above}, "
        f"{quantity.distance(to_go_m)} from {goal}",
        item=int(item[low.row]),
    )


class _Low(Value, kw_only=False, eq=False):
    """The place where a return is nearest to the ground."""

    clearance_m: float
    row: int
    """Of the fan; beyond it, on what returns follow along the mission."""
    place_m: FloatArray
    """East, north, height above home. (3,) [m]"""


def _lowest_over_peaks(a: Assessment, terrain: TerrainGrid, fan: ReturnFan) -> _Low | None:
    """Return where a return between the two ends of a stretch passes lowest over the centre of a cell."""
    import shapely

    turn_m, over_m = fan.corners_m[:, :, 2], fan.corners_m[:, 0, 3]
    lowest_m = min(float(turn_m[..., 2].min()), float(over_m[:, 2].min()))
    every_m = np.concatenate((turn_m.reshape(-1, 3), over_m))
    frame = a.route.frame
    latitude, longitude, ground_amsl_m = terrain.peaks_above(
        a.route.ground_datum_m + lowest_m - a.setup.clearance_m,
        *frame.latitude_longitude_deg(*_box_m(every_m)),
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
    edges = [_nearest_m(peaks_m[peak], *ends) for ends in combinations(corners, 2)]
    away_m, beside_m = (np.stack(one) for one in zip(*edges, strict=True))
    beside_m = np.take_along_axis(beside_m, away_m.argmin(axis=0)[None], axis=0)[0]
    height_m = np.where(is_inside, height_m, beside_m)
    clearance_m = height_m - (ground_amsl_m[peak] - a.route.ground_datum_m)
    clearance_m = np.where(np.isnan(clearance_m), np.inf, clearance_m)
    worst = int(clearance_m.argmin())
    place_m = np.append(peaks_m[peak[worst]], height_m[worst])
    return _Low(float(clearance_m[worst]), int(row[worst]), place_m)


def _box_m(places_m: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return east and north of places all around others, on the edge of their box. [m]"""
    low, high = places_m[:, :2].min(axis=0), places_m[:, :2].max(axis=0)
    shares = np.linspace(0.0, 1.0, _BOX_PLACES)
    east, north = np.meshgrid(*(low[:, None] + (high - low)[:, None] * shares))
    return east.ravel(), north.ravel()


LANDING_SLOPE = Rule(
    "A117 landing-slope",
    Severity.ERROR,
    summary="The ground slopes, or rises beside the place, where the mission or a return lands.",
    why="A multicopter that sets down on a slope slides, or tips and strikes the ground with its "
    "rotors: the motors stop only when the autopilot takes it to have landed.",
    how="The steepest slope of --terrain within half a cell of each landing, and of where the vehicle "
    "itself would return to from anywhere: home, a rally point, the mission's landing.  A warning above "
    "7° and an error above 15°: of helicopters the US Army lands all on the first, none on more than the "
    "second (FM 3-21.38).  An error too where ground within --position-error of such a place, but home, or "
    "of where a load is set down is higher than it by more than 15° over that distance (a wall, trees).  Not "
    "evaluated (X904) where --terrain has no ground there, but at home, where the "
    "vehicle stood.",
    fix="land on flatter ground, or give a finer grid where the place itself is flat",
    instead="--terrain with a finer grid",
)


@judges(LANDING_SLOPE, needs=(TERRAIN,))
def _landing_slope(a: Assessment, terrain: TerrainGrid) -> Iterator[Found]:
    """Judge where the mission lands, and where the vehicle itself would return to."""
    places: dict[tuple[float, float], tuple[str, int | None]] = {
        (stage.east_m, stage.north_m): ("lands", stage.item) for stage in a.route.stages_of(*_LANDS)
    }
    sample = a.returns.sample
    if sample is not None:
        home = np.flatnonzero(sample.destination != HERE)
        points = sample.points
        targets = a.returns.destinations.targets(points.stage, sample.destination, points.stop_m)
        for east_m, north_m in np.unique(targets.ground_m[home, :2], axis=0).tolist():
            places.setdefault((east_m, north_m), ("a return lands", None))
    sets_down: dict[tuple[float, float], tuple[str, int | None]] = {
        (stage.east_m, stage.north_m): ("sets a load down", stage.item)
        for stage in a.route.stages
        if stage.kind is StageKind.SET_DOWN
    }
    if not places:
        yield from _lands_beside(a, terrain, sets_down)
        return
    half_m = 0.5 * terrain.cell_m
    around = half_m * np.array([(0.0, 0.0), (1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])
    place_m = np.array(list(places))[:, None] + around
    where = a.route.frame.latitude_longitude_deg(place_m[..., 0], place_m[..., 1])
    height_m = terrain.height_amsl_m(*where).filled(np.nan)
    rise = np.abs(height_m[:, 1:] - height_m[:, :1]) / half_m
    # By the end of a grid that side of a place counts which is known.
    axes = np.fmax(rise[:, ::2], rise[:, 1::2])
    slope_deg = np.degrees(np.arctan(np.hypot(*axes.T)))
    named = list(places.values())
    unknown = np.isnan(slope_deg)
    away = np.hypot(*place_m[:, 0].T) > a.setup.position_margin_m  # it stood at home
    if (unknown & away).any():
        lands, item = named[int((unknown & away).argmax())]
        yield NotEvaluated(
            rule=LANDING_SLOPE,
            also=(LANDS_FAST,),
            asked_by=f"the ground where the vehicle {lands}"
            if item
            else "the ground where a return lands",
            needs=_GROUND_THERE,
            item=item,
        )
    worst = int(np.where(unknown, -1.0, slope_deg).argmax())
    if slope_deg[worst] > _STEEP_DEG:
        lands, item = named[worst]
        yield a.finding(
            LANDING_SLOPE,
            f"{lands} on ground that slopes by {quantity.decimals(float(slope_deg[worst]), 0)}°",
            item=item,
            severity=None if slope_deg[worst] > _TOO_STEEP_DEG else Severity.WARNING,
        )
    if slope_deg[worst] <= _TOO_STEEP_DEG or unknown[worst]:
        yield from _lands_beside(a, terrain, sets_down | places)


def _lands_beside(
    a: Assessment,
    terrain: TerrainGrid,
    places: Mapping[tuple[float, float], tuple[str, int | None]],
) -> Iterator[Finding]:
    """Yield the place beside which the ground is highest, where the vehicle may come down on it."""
    error_m, frame = a.setup.position_margin_m, a.route.frame
    worst: tuple[float, str, int | None] = (_RISE * error_m + _ROUNDING_M, "", None)
    angle = np.linspace(0.0, 2.0 * math.pi, _CIRCLE_PARTS, endpoint=False)
    for (east_m, north_m), (what, item) in places.items():
        if math.hypot(east_m, north_m) <= error_m:
            continue  # it stood at home
        around_m = np.array([east_m, north_m]) + error_m * np.column_stack(
            (np.cos(angle), np.sin(angle))
        )
        around = frame.latitude_longitude_deg(*around_m.T)
        [own_m] = terrain.height_amsl_m(
            *frame.latitude_longitude_deg(np.array([east_m]), np.array([north_m]))
        ).filled(np.nan)
        if np.isnan(own_m):
            continue  # not evaluated, by the slope
        beside_m = [terrain.height_amsl_m(*around).filled(np.nan)]
        latitude, longitude, peaks_m = terrain.peaks_above(own_m, *around)
        away_m = np.hypot(
            *(np.column_stack(frame.east_north_m(latitude, longitude)) - (east_m, north_m)).T
        )
        beside_m.append(peaks_m[away_m <= error_m])
        rise_m = float(np.fmax.reduce(np.concatenate(beside_m))) - float(own_m)
        if rise_m > worst[0]:
            worst = (rise_m, what, item)
    rise_m, what, item = worst
    if what:
        yield a.finding(
            LANDING_SLOPE,
            f"{what} within {_beside_m(a)} of ground that is {quantity.height(rise_m)} higher",
            item=item,
            fix="land farther from it; --position-error says how wrong the position may be",
        )


LANDS_FAST = Rule(
    "T117 lands-fast",
    Severity.ERROR,
    summary="The vehicle may touch the ground before it has slowed down.",
    why="An autopilot that does not measure the ground slows a landing down by its height above home: on a "
    "hill it comes down at the speed of its descent (tried in ArduPilot's simulation, 50 m above home: 'SIM "
    "Hit ground at 4.97 m/s').",
    how="The speed of the descent at the height above home of the ground of --terrain, where the mission "
    "lands or a return leads: ArduPilot without a rangefinder that looks down "
    "(Mode::get_alt_above_ground_cm; TERRAIN_ENABLE gives no data by itself), and PX4, whose range sensor no "
    "parameter names.  A warning where it is above 1.1 times LAND_SPEED or MPC_LAND_SPEED; an error above "
    "2 m/s, the most that ArduPilot's LAND_SPEED may be set to.",
    fix="lower the descent speed (LAND_SPEED_HIGH or WPNAV_SPEED_DN, MPC_Z_V_AUTO_DN) to that of the "
    "landing, or land no more than 10 m (LAND_ALT_LOW, MPC_LAND_ALT2 5 m) higher than home",
    instead="the parameters of --params",
)


@judges(LANDS_FAST, needs=(PARAMETERS, TERRAIN))
def _lands_fast(
    a: Assessment, parameters: FlightParameters, _terrain: TerrainGrid
) -> Iterator[Found]:
    places, stages = a.returns.destinations, a.route.stages
    landing = np.array(a.route.rows_of(*_LANDS), np.intp)
    ground_m = np.array([stages[row].height_m for row in landing.tolist()])
    above_m = ground_m - places.home_datum_m[places.home_of(landing)]
    item: list[int | None] = [stages[row].item for row in landing.tolist()]
    sample = a.returns.sample
    if sample is not None:
        home = np.flatnonzero(sample.destination != HERE)
        targets = places.targets(sample.points.stage, sample.destination, sample.points.stop_m)
        above_m = np.append(above_m, (targets.ground_m[:, 2] - targets.datum_m)[home])
        item += [None] * len(home)
    if not len(above_m):
        return
    worst = int(above_m.argmax())
    if ARDUPILOT.of(a) is not None and _rangefinder_reach_m(a) is not None:
        return
    speed_m_s, slow_m_s = _touch_down_m_s(parameters, float(above_m[worst]))
    if speed_m_s <= _FASTER * slow_m_s:
        return
    lands = "lands" if item[worst] is not None else "a return lands"
    height = quantity.height(float(above_m[worst]))
    yield a.finding(
        LANDS_FAST,
        f"{lands} {height} above home, where the autopilot may still descend at "
        f"{quantity.speed(speed_m_s)}: it slows down by its height above home",
        item=item[worst],
        severity=None if speed_m_s > _TOO_FAST_M_S else Severity.WARNING,
    )


LANDS_HARD = Rule(
    "T120 lands-hard",
    Severity.ERROR,
    summary="The parameters have the vehicle touch level ground too fast.",
    why="It breaks its landing gear, or falls over with its rotors turning: at the end of the mission, and "
    "on each return.",
    how="The speed at which it comes down to the height of home, by LAND_SPEED (LAND_SPD_MS from 4.7 on), or "
    "MPC_LAND_SPEED and the limits above it, without what a range sensor would take off; on PX4 no slower "
    "than MPC_ACC_UP_MAX can make it between MPC_LAND_ALT1, MPC_LAND_ALT2 and the ground: an error above "
    "2 m/s, the most that ArduPilot's LAND_SPEED may be set to.  A vehicle that does not land is not judged.",
    fix="set LAND_SPEED to 0.5 m/s, MPC_LAND_SPEED to 0.7 m/s, as delivered",
    instead="the parameters of --params",
)


@judges(LANDS_HARD, needs=(PARAMETERS,))
def _lands_hard(a: Assessment, parameters: FlightParameters) -> Iterator[Found]:
    speed_m_s, _ = _touch_down_m_s(parameters, 0.0)
    if speed_m_s > _TOO_FAST_M_S + 1e-6:  # files write it in single precision
        yield a.finding(
            LANDS_HARD,
            f"touches the ground at {quantity.speed(speed_m_s)}; vehicles stand "
            f"{quantity.speed(_TOO_FAST_M_S)} at most",
        )


def _touch_down_m_s(parameters: FlightParameters, above_m: float) -> tuple[float, float]:
    """Return how fast a vehicle may meet ground so high above home, and how fast it should. [m s⁻¹]"""
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

    slow_m_s, height_m = parameters.land_speed_m_s, np.array([above_m])
    if isinstance(parameters, ArduPilotParameters):
        from planner.flight.motion.ardupilot.vertical import landing_speed_m_s

        return float(landing_speed_m_s(height_m, parameters)[0]), slow_m_s
    from planner.flight.motion.px4.landing import DescentProfile

    before_m = np.linspace(0.0, _SLOWED_WITHIN_M, _HEIGHTS)
    speed_m_s = DescentProfile.of(parameters).speed_m_s(above_m + before_m)
    # From each height it is no slower at the ground than the acceleration upwards allows.
    squared = speed_m_s**2 - 2.0 * parameters.acceleration_up_m_s2 * before_m
    return math.sqrt(max(float(squared.max()), 0.0)), slow_m_s
