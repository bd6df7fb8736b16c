"""Waypoints that PX4 takes for reached where the vehicle is, by their acceptance radius."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.route.stage import StageKind
from planner.rules.declaration import PX4, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_FLOWN_TO = frozenset({StageKind.GO, StageKind.SPLINE, StageKind.LOITER})
_AFAR_M = 10.0
"""Farther away than what is taken for reached on purpose: the widest NAV_ACC_RAD of multicopters."""

REACHED_FROM_AFAR = Rule(
    "T126 reached-from-afar",
    Severity.WARNING,
    summary="PX4 takes waypoints for reached before it flies to them.",
    why="A radius in centimetres, or that of a circle, typed for the acceptance radius: a square of 100 m is "
    "flown in 55 s by a vehicle that takes off and lands, and what was to be seen there is not.",
    how="Waypoints and holds more than 10 m from where the vehicle is when they come next, within their "
    "acceptance radius (parameter 2, else NAV_ACC_RAD) and, of its height, NAV_MC_ALT_RAD "
    "(MissionBlock::is_mission_item_reached_or_completed).  An error where the mission flies to none.",
    fix="give the radius in metres, well below the way from one waypoint to the next",
    instead="a smaller acceptance radius",
)


@judges(REACHED_FROM_AFAR, needs=(PX4,))
def _reached_from_afar(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    radii_m = (stage.acceptance_radius_m or 0.0 for stage in a.route.stages)
    if max(radii_m, default=0.0) <= _AFAR_M >= parameters.acceptance_radius_m:
        return
    passed_by: list[tuple[Stage, float]] = []
    flown = 0
    for stage, away_m, is_reached in _arrivals(a.route.stages, parameters):
        if is_reached and away_m > _AFAR_M:
            passed_by.append((stage, away_m))
        flown += not is_reached and away_m > _AFAR_M
    if not passed_by:
        return
    (first, away_m), count = passed_by[0], len(passed_by)
    radius_m = first.acceptance_radius_m or parameters.acceptance_radius_m
    yield a.finding(
        REACHED_FROM_AFAR,
        f"reached from {quantity.distance(away_m)} away, by an acceptance radius of "
        f"{quantity.distance(radius_m)}"
        + (f"; {count - 1} more like it" if count > 1 else "")
        + ("" if flown else "; the mission flies to no waypoint"),
        item=first.item,
        severity=None if flown else Severity.ERROR,
    )


def _arrivals(
    stages: tuple[Stage, ...], parameters: Px4Parameters
) -> Iterator[tuple[Stage, float, bool]]:
    """Yield each waypoint, how far it is as it comes next, and whether it is reached there. -, [m], -"""
    here: tuple[float, float, float] | None = None
    for stage in stages:
        there = stage.east_m, stage.north_m, stage.height_m
        if here is None or stage.kind not in _FLOWN_TO or stage.is_here:
            here = there
            continue
        radius_m = stage.acceptance_radius_m or parameters.acceptance_radius_m
        away_m = math.dist(here[:2], there[:2])
        is_level = abs(here[2] - there[2]) <= parameters.altitude_acceptance_m
        is_reached = is_level and away_m <= radius_m
        yield stage, away_m, is_reached
        if not is_reached:
            left = 0.0 if away_m <= radius_m else radius_m / away_m
            east_m, north_m = (t + left * (h - t) for t, h in zip(there[:2], here[:2], strict=True))
            here = east_m, north_m, there[2]
