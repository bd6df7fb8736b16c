"""Waypoints that PX4 takes for reached where the vehicle is, by their acceptance radius."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

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

_CLOSE_M = 1e-3
"""By which what counts as reached from its edge may be outside. [m]"""

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
    for stage, away_m, is_reached in _arrivals(a, parameters):
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


def _arrivals(a: Assessment, parameters: Px4Parameters) -> Iterator[tuple[Stage, float, bool]]:
    """Yield each waypoint, how far it is as it comes next, and whether it is reached there. -, [m], -

    From where the vehicle is by then, which is not the place of a LOITER_TO_ALT that it passed.
    """
    motion, stages = a.flight.motion, a.route.stages
    done_s = np.append(motion.segments.end_s, 0.0)[motion.done_segment]  # -1: not begun
    here = motion.state_at_time(done_s)
    places = zip(here.east_m.tolist(), here.north_m.tolist(), here.height_m.tolist(), strict=True)
    for stage, (east_m, north_m, height_m) in zip(stages[1:], places, strict=False):
        if stage.kind not in _FLOWN_TO or stage.is_here:
            continue
        radius_m = stage.acceptance_radius_m or parameters.acceptance_radius_m
        away_m = math.hypot(east_m - stage.east_m, north_m - stage.north_m)
        is_level = abs(height_m - stage.height_m) <= parameters.altitude_acceptance_m + _CLOSE_M
        yield stage, away_m, is_level and away_m <= radius_m + _CLOSE_M
