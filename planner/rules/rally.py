"""Rules on rally points, and on what the vehicle holds beside the file."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.flight.fence_schedule import AREAS, fence_is_on
from planner.flight.returns.path import thinned
from planner.mission.items import MissionFormat
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT, BUDGET, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_MOST_RALLY_PLACES = 200

RALLY_UNREACHABLE = Rule(
    "E106 rally-unreachable",
    Severity.WARNING,
    summary="A rally point is useless: never chosen, or not reachable above the reserve.",
    why="A rally point is drawn as the place of safety; a vehicle that never goes there, or cannot, "
    "needs the return home after all (ArduPilot #4701: rally in range of the whole path, #30575).",
    how="From wherever returns are judged, or 200 of these points: a warning where the energy left above "
    "the reserve does not reach the rally point from any of them; a note where the vehicle's own rules "
    "(RTL_TYPE; RALLY_LIMIT_KM, RALLY_INCL_HOME) never choose it.",
    fix="move the rally point to where the mission is far from home, or remove it",
)


@judges(RALLY_UNREACHABLE, needs=(BUDGET,))
def _rally_unreachable(a: Assessment, budget: BatteryBudget) -> Iterator[Finding]:
    rally, returns = a.mission.rally, a.returns
    if not rally:
        return
    sample = returns.sample
    if sample is None or not len(sample.points.segment):
        return
    points, chosen = sample.points, np.unique(sample.destination)
    rows = thinned(np.arange(len(points.segment)), _MOST_RALLY_PLACES)
    above_wh = (budget.above_reserve_wh - points.used_wh - points.stop_wh)[rows]
    never: list[int] = []
    out_of_reach: list[int] = []
    missed_by_wh: list[float] = []
    for number in range(1, len(rally) + 1):
        _, way_wh = returns.fly(points.stop_m[rows], points.stage[rows], number)
        short_wh = float((way_wh - above_wh).min())
        if short_wh > 0.0:
            out_of_reach.append(number)
            missed_by_wh.append(short_wh)
        elif number not in chosen:
            never.append(number)
    short = quantity.energy(missed_by_wh[0]) if missed_by_wh else ""
    for points_found, why, severity in (
        (
            out_of_reach,
            f"cannot be reached above the reserve from any item ({short} short)",
            Severity.WARNING,
        ),
        (never, "is never chosen: returns lead home or to another rally point", Severity.INFO),
    ):
        if points_found:
            rest = f" (and {len(points_found) - 1} more)" if len(points_found) > 1 else ""
            yield a.finding(
                RALLY_UNREACHABLE,
                f"rally point {points_found[0]} {why}{rest}",
                severity=severity,
                place=rally[points_found[0] - 1].place,
            )


HELD_AREAS_UNKNOWN = Rule(
    "F114 held-areas-unknown",
    Severity.ERROR,
    summary="The vehicle holds a fence or rally points that the mission's file does not.",
    why="A text file replaces the mission and nothing else: the fence and the rally points that were there "
    "before stay, stop the flight in the air or lead its returns elsewhere, and nobody has looked at them.",
    how="ArduPilot and a file in QGC WPL, which holds neither: FENCE_TOTAL above 0, or no fence selected but "
    "areas (FENCE_TYPE 4), where the fence is on for areas and acts (FENCE_ENABLE, FENCE_AUTOENABLE or "
    "DO_FENCE_ENABLE, FENCE_TYPE bit 4, FENCE_ACTION); RALLY_TOTAL above 0.",
    fix="check a plan that holds them, such as mavjoule fetch writes",
    instead="a plan that holds them",
    leaves_open=True,
)


@judges(HELD_AREAS_UNKNOWN, needs=(ARDUPILOT,))
def _held_areas_unknown(a: Assessment, parameters: ArduPilotParameters) -> Iterator[Finding]:
    if a.mission.file_format is not MissionFormat.WPL:
        return
    values = numbers(a)
    points = values.get("FENCE_TOTAL", float(parameters.fence_type == AREAS))
    is_on = fence_is_on(parameters) or a.route.fence_switched_on is not None
    acts = bool(parameters.fence_type & AREAS and parameters.fence_action)
    if points > 0.0 and is_on and acts and not a.mission.fence:
        yield a.finding(
            HELD_AREAS_UNKNOWN,
            "the fence areas on the vehicle (FENCE_TOTAL, FENCE_TYPE) are not in this file: the flight is "
            "not checked against them",
        )
    if values.get("RALLY_TOTAL", 0.0) > 0.0 and not a.mission.rally:
        yield a.finding(
            HELD_AREAS_UNKNOWN,
            "the rally points on the vehicle (RALLY_TOTAL) are not in this file: where its returns lead is "
            "unknown",
        )
