"""Rules on the ground where a vehicle lands: its slope, and what stands beside it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.returns.destination import HERE
from planner.mission.route.stage import LANDED_STAGES, StageKind
from planner.rules.clearance import GROUND_THERE, ROUNDING_M, STEEPEST_DEG, STEEPEST_RISE, circle_m
from planner.rules.declaration import TERRAIN, NotEvaluated, judges
from planner.rules.touchdown import LANDS_FAST

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.findings import Finding
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found

_STEEP_DEG = 7.0
"""Slopes to warn of at a landing: the US Army lands all helicopters on up to 7°, those on wheels with an
advisory on up to 15° (FM 3-21.38, landing sites). [°]"""

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
        (stage.east_m, stage.north_m): ("lands", stage.item)
        for stage in a.route.stages_of(*LANDED_STAGES)
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
            needs=GROUND_THERE,
            item=item,
        )
    worst = int(np.where(unknown, -1.0, slope_deg).argmax())
    if slope_deg[worst] > _STEEP_DEG:
        lands, item = named[worst]
        yield a.finding(
            LANDING_SLOPE,
            f"{lands} on ground that slopes by {quantity.decimals(float(slope_deg[worst]), 0)}°",
            item=item,
            severity=None if slope_deg[worst] > STEEPEST_DEG else Severity.WARNING,
        )
    if slope_deg[worst] <= STEEPEST_DEG or unknown[worst]:
        yield from _lands_beside(a, terrain, sets_down | places)


def _lands_beside(
    a: Assessment,
    terrain: TerrainGrid,
    places: Mapping[tuple[float, float], tuple[str, int | None]],
) -> Iterator[Finding]:
    """Yield the place beside which the ground is highest, where the vehicle may come down on it."""
    error_m, frame = a.setup.position_margin_m, a.route.frame
    worst: tuple[float, str, int | None] = (STEEPEST_RISE * error_m + ROUNDING_M, "", None)
    for (east_m, north_m), (what, item) in places.items():
        if math.hypot(east_m, north_m) <= error_m:
            continue  # it stood at home
        around_m = np.array([east_m, north_m]) + circle_m(error_m)
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
            f"{what} within {quantity.height(error_m)} of ground that is {quantity.height(rise_m)} higher",
            item=item,
            fix="land farther from it; --position-error says how wrong the position may be",
        )
