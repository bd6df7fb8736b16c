"""Rules on the ground of a terrain grid: under the whole flight, and under every return."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.returns.destination import HOME
from planner.mission.commands import TERRAIN_FRAMES
from planner.mission.route.route import NO_TERRAIN_DATA
from planner.mission.route.stage import StageKind
from planner.rules.altitude import BELOW_TERRAIN
from planner.rules.declaration import ARDUPILOT, TERRAIN, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment

_MOST_SAMPLES = 500_000
_MOST_RETURNS = 2_000
_RETURN_SPACING_M = 100.0
"""Returns begin no farther apart, unless the flight is longer than 200 km. [m]"""
_MOST_ALONG = 50
"""So many where they lead along the mission, whose legs are judged as they are flown."""
_OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""
_AIRBORNE = [
    STATE_INDEX[state]
    for state in FlightState
    if state not in {FlightState.TAKEOFF, FlightState.LAND}
]


class _Way(NamedTuple):
    """A flight as samples in the order they are flown, take-off and landing left out."""

    height_m: FloatArray
    """Above home. [m]"""
    clearance_m: FloatArray
    """Above the ground, NaN where that is unknown. [m]"""
    step_m: FloatArray
    """Way from the sample before; 0 where that is left out. [m]"""
    time_s: FloatArray
    """Since the start of the flight. [s]"""
    item: IntArray
    follows_terrain: BoolArray


RETURN_BELOW_TERRAIN = Rule(
    "A104 rtl-below-terrain",
    Severity.ERROR,
    summary="The vehicle's own return would meet the ground.",
    why="The height of a return counts from home and ignores hills: vehicles flew into them "
    "(QGroundControl #5524, ArduPilot #12170, PX4 #20003).",
    how="From places along the flight to where the vehicle itself would return (home, a rally point "
    "or along the mission), at the height of its return: PX4 the higher of its own and RTL_RETURN_ALT "
    "over that place, lower inside RTL_MIN_DIST; ArduPilot the higher of its own and RTL_ALT, in its "
    "cone; against --terrain plus --clearance.  Not checked where RTL_ALT_TYPE follows terrain.",
    fix="raise RTL_RETURN_ALT (PX4) or RTL_ALT (ArduPilot) above the highest ground, or fly round it",
    instead="--terrain or --clearance",
)


GROUND_CLEARANCE = Rule(
    "A116 ground-clearance",
    Severity.INFO,
    summary="Least and greatest height above the ground.",
    why="Legal limits count from the ground, not from home (MissionPlanner #706).",
    how="As for A102; X902 reports any part of the flight outside the grid.",
    fix="",
)


@judges(BELOW_TERRAIN, RETURN_BELOW_TERRAIN, GROUND_CLEARANCE, NO_TERRAIN_DATA, needs=(TERRAIN,))
def _ground(a: Assessment, terrain: TerrainGrid) -> Iterator[Finding]:
    way = _sampled(a, terrain)
    if way is None:
        return
    unknown = np.isnan(way.clearance_m)
    if unknown.any():
        whole = unknown.all()
        some = "the whole flight" if whole else quantity.distance(float(way.step_m[unknown].sum()))
        yield a.finding(
            NO_TERRAIN_DATA,
            f"{some} outside the terrain grid: clearance not checked{'' if whole else ' there'}",
            item=int(way.item[unknown.argmax()]),
            severity=Severity.WARNING,
            fix="give --terrain the grids of the whole mission",
        )
        if whole:
            return
    yield from _too_low(a, way)
    lowest, highest = int(np.nanargmin(way.clearance_m)), int(np.nanargmax(way.clearance_m))
    item = int(way.item[lowest])
    yield a.finding(
        GROUND_CLEARANCE,
        f"{quantity.height(float(way.clearance_m[lowest]))} (item {item}) to "
        f"{quantity.height(float(way.clearance_m[highest]))} (item {int(way.item[highest])}) above the "
        "ground",
        item=item,
    )
    yield from _returns(a, way, terrain)


def _sampled(a: Assessment, terrain: TerrainGrid) -> _Way | None:
    """Return the flight in steps of half a cell or less; ``None`` where nothing is in the air."""
    motion = a.flight.motion
    spacing_m = 0.5 * min(tile.cell_m for tile in terrain.tiles)
    states = motion.segments.state[motion.piece_segment]
    pieces = np.flatnonzero(np.isin(states, _AIRBORNE) & (motion.piece_duration_s > 0.0))
    if not len(pieces):
        return None
    ends = np.linspace(0.0, 1.0, 5) * motion.piece_duration_s[pieces, None]
    speed_m_s = motion.state_at(pieces[:, None], ends).ground_speed_m_s.max(axis=1)
    length_m = speed_m_s * motion.piece_duration_s[pieces]
    spacing_m = max(spacing_m, float(length_m.sum()) / _MOST_SAMPLES)
    count = np.ceil(length_m / spacing_m).astype(np.intp) + 2
    piece = np.repeat(pieces, count)
    fraction = _counted_up(count) / (np.repeat(count, count) - 1)
    state = motion.state_at(piece, fraction * motion.piece_duration_s[piece])
    step_m = np.zeros(len(piece))
    step_m[1:] = np.hypot(np.diff(state.east_m), np.diff(state.north_m))
    step_m[1:][np.diff(piece) > 1] = 0.0
    item = motion.segments.item[motion.piece_segment[piece]]
    frames = np.array([one.frame for one in a.mission.items])
    return _Way(
        height_m=state.height_m,
        clearance_m=state.height_m - _ground_m(a, terrain, state.east_m, state.north_m),
        step_m=step_m,
        time_s=motion.piece_start_s()[piece] + fraction * motion.piece_duration_s[piece],
        item=item,
        follows_terrain=np.isin(frames[item - 1], list(TERRAIN_FRAMES))
        & (a.autopilot is Autopilot.ARDUPILOT),
    )


def _counted_up(count: IntArray) -> IntArray:
    """Return 0 to ``n - 1`` for each ``n`` of some counts, one after the other."""
    numbered: IntArray = np.arange(int(count.sum())) - np.repeat(np.cumsum(count) - count, count)
    return numbered


def _ground_m(
    a: Assessment, terrain: TerrainGrid, east_m: FloatArray, north_m: FloatArray
) -> FloatArray:
    """Return the height of the ground above home, NaN where the grid does not have it. [m]"""
    heights = terrain.height_amsl_m(*a.route.frame.latitude_longitude_deg(east_m, north_m))
    ground_m: FloatArray = heights.filled(np.nan) - a.route.home_amsl_m
    return ground_m


def _above(clearance_m: float) -> str:
    side = "below" if clearance_m < 0.0 else "above"
    return f"{quantity.height(abs(clearance_m))} {side} the ground"


def _too_low(a: Assessment, way: _Way) -> Iterator[Finding]:
    """Yield a finding where the flight is below the ground, or nearer to it than asked for."""
    low = (way.clearance_m < a.setup.clearance_m) & ~way.follows_terrain
    if not low.any():
        return
    worst = int(np.where(low, way.clearance_m, np.inf).argmin())
    item, lowest_m = int(way.item[worst]), float(way.clearance_m[worst])
    to_go_m = float(way.step_m[worst + 1 :][way.item[worst + 1 :] == item].sum())
    before = f", {quantity.distance(to_go_m)} before its end" if to_go_m >= 1.0 else ""
    asked = "" if lowest_m < 0.0 else f" (--clearance {quantity.height(a.setup.clearance_m)})"
    yield a.finding(
        BELOW_TERRAIN,
        f"{_above(lowest_m)}{asked}{before}; {quantity.distance(float(way.step_m[low].sum()))} of the "
        "path too low",
        item=item,
    )


def _returns(a: Assessment, way: _Way, terrain: TerrainGrid) -> Iterator[Finding]:
    """Yield a finding where a return of the vehicle meets the ground."""
    ardupilot, returns = ARDUPILOT.of(a), a.returns
    if ardupilot is not None and ardupilot.return_altitude_type == _OVER_TERRAIN:
        return
    along_m = np.cumsum(way.step_m)
    most = _MOST_ALONG if returns.destinations.along else _MOST_RETURNS
    spacing_m = max(_RETURN_SPACING_M, float(along_m[-1]) / most)
    # One place for each spacing along the way, the last of each item besides.
    first = np.diff(np.floor(along_m / spacing_m), prepend=-1.0) > 0.0
    first |= np.diff(way.item, append=0) != 0
    # The mission's own return is judged as it is flown.
    own = [stage.item for stage in a.route.stages if stage.kind is StageKind.RETURN]
    begun = np.flatnonzero(first & ~np.isin(way.item, own))
    if not len(begun):
        return
    points = returns.points(*returns.at(way.time_s[begun]))
    chosen = returns.chosen(points)
    # From where it stops to over where it lands; the landing itself is not judged.
    paths = [corners[1:-1] for corners in returns.corners_m(points, chosen)]
    start_m = np.concatenate([path[:-1] for path in paths])
    leg_m = np.concatenate([np.diff(path, axis=0) for path in paths])
    owner = np.repeat(np.arange(len(paths)), [len(path) - 1 for path in paths])
    length_m = np.hypot(leg_m[:, 0], leg_m[:, 1])
    cell_m = 0.5 * min(tile.cell_m for tile in terrain.tiles)
    cell_m = max(cell_m, float(length_m.sum()) / _MOST_SAMPLES)
    count = np.ceil(length_m / cell_m).astype(np.intp) + 1
    leg = np.repeat(np.arange(len(count)), count)
    place_m = start_m[leg] + (_counted_up(count) / count[leg])[:, None] * leg_m[leg]
    ground_m = _ground_m(a, terrain, place_m[:, 0], place_m[:, 1])
    clearance_m = np.where(np.isnan(ground_m), np.inf, place_m[:, 2] - ground_m)
    worst = int(clearance_m.argmin())
    lowest_m = float(clearance_m[worst])
    if lowest_m >= a.setup.clearance_m:
        return
    begin = int(owner[leg[worst]])
    to_go_m = float(np.hypot(*(paths[begin][-1, :2] - place_m[worst, :2])))
    yield a.finding(
        RETURN_BELOW_TERRAIN,
        f"a return from here, {quantity.height(float(place_m[worst, 2]))} above home, is "
        f"{_above(lowest_m)} {quantity.distance(to_go_m)} from "
        f"{'home' if chosen[begin] == HOME else 'its landing'}",
        item=int(way.item[begun[begin]]),
    )
