"""Rules on the ground of a terrain grid: under the whole flight, and under every way home."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.terrain import BELOW_TERRAIN, GROUND_CLEARANCE, RETURN_BELOW_TERRAIN
from planner.catalogue.tool import NO_TERRAIN_DATA
from planner.findings import Severity
from planner.flight.motion.kinematics import (
    STATE_INDEX,
    FlightState,
)
from planner.flight.returns.destination import HOME
from planner.mission.commands import TERRAIN_FRAMES
from planner.mission.route.stage import StageKind
from planner.vehicle.parameters.ardupilot import ArduPilotParameters

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment

_MOST_SAMPLES = 500_000
_MOST_RETURNS = 2_000
_RETURN_SPACING_M = 100.0
"""Ways home begin no farther apart, unless the flight is longer than 200 km. [m]"""
_MOST_ALONG = 50
"""So many where they lead along the mission, whose legs are judged as they are flown."""
_OVER_TERRAIN = 1
"""RTL_ALT_TYPE for heights above terrain."""


class _Way(NamedTuple):
    """A flight as samples in the order they are flown, take-off and landing left out."""

    east_m: FloatArray
    north_m: FloatArray
    height_m: FloatArray
    """Above home. [m]"""
    clearance_m: FloatArray
    """Above the ground, NaN where that is not known. [m]"""
    step_m: FloatArray
    """Way from the sample before; 0 where that is left out. [m]"""
    time_s: FloatArray
    """Since the start of the flight. [s]"""
    item: IntArray
    follows_terrain: BoolArray


def check_ground(a: Assessment) -> Iterator[Finding]:
    """Yield findings on the heights over ground of the flight and of every way home."""
    way = _sampled(a)
    if way is None:
        return
    unknown = np.isnan(way.clearance_m)
    if unknown.any():
        item = int(way.item[unknown.argmax()])
        some = f"{quantity.distance(float(way.step_m[unknown].sum()))} of the flight lie"
        yield NO_TERRAIN_DATA.finding(
            f"{'the whole flight lies' if unknown.all() else some} outside of the terrain grid: "
            f"heights over ground are not checked{'' if unknown.all() else ' there'}",
            item=item,
            place=a.mission.items[item - 1].place,
            severity=Severity.WARNING,
            fix="give --terrain the grids of the whole mission",
        )
    if unknown.all():
        return
    yield from _too_low(a, way)
    yield from _extremes(a, way)
    yield from _returns(a, way)


def _sampled(a: Assessment) -> _Way | None:
    """Return the flight in steps of half a cell or less; ``None`` where nothing is in the air."""
    terrain, motion = a.terrain, a.flight.motion
    if terrain is None:
        return None
    spacing_m = 0.5 * min(tile.cell_m for tile in terrain.tiles)
    states = motion.segments.state[motion.piece_segment]
    airborne = ~np.isin(
        states, [STATE_INDEX[FlightState.TAKEOFF], STATE_INDEX[FlightState.LAND]]
    ) & (motion.piece_duration_s > 0.0)
    pieces = np.flatnonzero(airborne)
    if not len(pieces):
        return None
    ends = np.linspace(0.0, 1.0, 5) * motion.piece_duration_s[pieces, None]
    speed_m_s = motion.state_at(pieces[:, None], ends).ground_speed_m_s.max(axis=1)
    length_m = speed_m_s * motion.piece_duration_s[pieces]
    spacing_m = max(spacing_m, float(length_m.sum()) / _MOST_SAMPLES)
    count = np.ceil(length_m / spacing_m).astype(np.intp) + 2
    piece = np.repeat(pieces, count)
    number = np.arange(len(piece)) - np.repeat(np.cumsum(count) - count, count)
    share = number / (np.repeat(count, count) - 1)
    state = motion.state_at(piece, share * motion.piece_duration_s[piece])
    ground_m = _ground_m(a, terrain, state.east_m, state.north_m)
    step_m = np.zeros(len(piece))
    step_m[1:] = np.hypot(np.diff(state.east_m), np.diff(state.north_m))
    step_m[1:][np.diff(piece) > 1] = 0.0
    item = motion.segments.item[motion.piece_segment[piece]]
    frames = np.array([one.frame for one in a.mission.items])
    return _Way(
        east_m=state.east_m,
        north_m=state.north_m,
        height_m=state.height_m,
        clearance_m=state.height_m - ground_m,
        step_m=step_m,
        time_s=motion.piece_start_s()[piece] + share * motion.piece_duration_s[piece],
        item=item,
        follows_terrain=np.isin(frames[item - 1], list(TERRAIN_FRAMES))
        & (a.autopilot is Autopilot.ARDUPILOT),
    )


def _ground_m(
    a: Assessment, terrain: TerrainGrid, east_m: FloatArray, north_m: FloatArray
) -> FloatArray:
    """Return the height of the ground above home, NaN where the grid does not know it. [m]"""
    heights = terrain.height_amsl_m(*a.route.frame.latitude_longitude_deg(east_m, north_m))
    ground_m: FloatArray = heights.filled(np.nan) - a.route.home_amsl_m
    return ground_m


def _too_low(a: Assessment, way: _Way) -> Iterator[Finding]:
    """Yield a finding where the flight is below the ground, or nearer to it than asked for."""
    low = (way.clearance_m < a.clearance_m) & ~way.follows_terrain
    if not low.any():
        return
    clearance_m = np.where(low, way.clearance_m, np.inf)
    worst = int(clearance_m.argmin())
    item = int(way.item[worst])
    lowest_m = float(clearance_m[worst])
    where = (
        f"{quantity.height(-lowest_m)} below the ground"
        if lowest_m < 0.0
        else f"{quantity.height(lowest_m)} over the ground, {quantity.height(a.clearance_m)} are "
        "asked for"
    )
    to_go_m = float(way.step_m[worst + 1 :][way.item[worst + 1 :] == item].sum())
    before = f" {quantity.distance(to_go_m)} before its end" if to_go_m >= 1.0 else ""
    yield BELOW_TERRAIN.finding(
        f"{where}{before}; {quantity.distance(float(way.step_m[low].sum()))} of the way are too low",
        item=item,
        place=a.mission.items[item - 1].place,
    )


def _extremes(a: Assessment, way: _Way) -> Iterator[Finding]:
    """Yield the least and the greatest height over ground."""
    lowest, highest = int(np.nanargmin(way.clearance_m)), int(np.nanargmax(way.clearance_m))
    item = int(way.item[lowest])
    yield GROUND_CLEARANCE.finding(
        f"{quantity.height(float(way.clearance_m[lowest]))} over the ground at item {item} to "
        f"{quantity.height(float(way.clearance_m[highest]))} at item {int(way.item[highest])}",
        item=item,
        place=a.mission.items[item - 1].place,
    )


def _returns(a: Assessment, way: _Way) -> Iterator[Finding]:
    """Yield a finding where a return of the vehicle meets the ground."""
    parameters, returns = a.parameters, a.returns
    if a.terrain is None or (
        isinstance(parameters, ArduPilotParameters)
        and parameters.return_altitude_type == _OVER_TERRAIN
    ):
        return
    along_m = np.cumsum(way.step_m)
    most = _MOST_ALONG if returns.destinations.follows_mission else _MOST_RETURNS
    spacing_m = max(_RETURN_SPACING_M, float(along_m[-1]) / most)
    # One place for each stretch of the way, the last of each item besides.
    first = np.diff(np.floor(along_m / spacing_m), prepend=-1.0) > 0.0
    first |= np.diff(way.item, append=0) != 0
    # The mission's own return is the way home already, and judged as it is flown.
    own = [stage.item for stage in a.route.stages if stage.kind is StageKind.RETURN]
    begun = np.flatnonzero(first & ~np.isin(way.item, own))
    if not len(begun):
        return
    points = returns.points(*returns.at(way.time_s[begun]))
    chosen = returns.chosen(points)
    # From where it stands to over where it lands; the landing itself is not asked.
    paths = [corners[1:-1] for corners in returns.corners_m(points, chosen)]
    start_m = np.concatenate([path[:-1] for path in paths])
    leg_m = np.concatenate([np.diff(path, axis=0) for path in paths])
    owner = np.repeat(np.arange(len(paths)), [len(path) - 1 for path in paths])
    length_m = np.hypot(leg_m[:, 0], leg_m[:, 1])
    cell_m = 0.5 * min(tile.cell_m for tile in a.terrain.tiles)
    cell_m = max(cell_m, float(length_m.sum()) / _MOST_SAMPLES)
    count = np.ceil(length_m / cell_m).astype(np.intp) + 1
    leg = np.repeat(np.arange(len(count)), count)
    share = (np.arange(len(leg)) - np.repeat(np.cumsum(count) - count, count)) / count[leg]
    place_m = start_m[leg] + share[:, None] * leg_m[leg]
    ground_m = _ground_m(a, a.terrain, place_m[:, 0], place_m[:, 1])
    clearance_m = np.where(np.isnan(ground_m), np.inf, place_m[:, 2] - ground_m)
    worst = int(clearance_m.argmin())
    lowest_m = float(clearance_m[worst])
    if lowest_m >= a.clearance_m:
        return
    begin = int(owner[leg[worst]])
    item = int(way.item[begun[begin]])
    end_m = paths[begin][-1, :2]
    to_go_m = float(np.hypot(*(end_m - place_m[worst, :2])))
    over = (
        f"{quantity.height(-lowest_m)} below the ground"
        if lowest_m < 0.0
        else f"{quantity.height(lowest_m)} over the ground"
    )
    where = "home" if chosen[begin] == HOME else "where it lands"
    yield RETURN_BELOW_TERRAIN.finding(
        f"a return from here at {quantity.height(float(place_m[worst, 2]))} above home is {over}, "
        f"{quantity.distance(to_go_m)} from {where}",
        item=item,
        place=a.mission.items[item - 1].place,
    )


TERRAIN_CHECKS: tuple[Callable[[Assessment], Iterator[Finding]], ...] = (check_ground,)
