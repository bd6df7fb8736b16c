"""The layers that flights of a fleet are lifted to, and which of them are."""

from __future__ import annotations

import math
from functools import reduce
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Rule, Severity
from planner.mission.files import read_mission
from planner.mission.lift import highest_m, raised_items, why_not_lifted
from planner.service.fleet import FleetFinding

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.fleet.fleet import Fleet, Layers, Separation
    from planner.mission.items import Mission
    from planner.physics.response import TransferFunction
    from planner.service.fleet import FlownSortie

_SHOWN_M = 0.05
"""What is less rounds to nothing in a message, and is no other height. [m]"""

LAYER_STEP = Rule(
    "S117 layer-step",
    Severity.WARNING,
    summary="The layers of the fleet are nearer to each other than vehicles in two of them may be.",
    why="A plan that puts flights into neighbouring layers to clear them would not clear them.",
    how="step_m of [layers] against the greatest above_m or below_m of two vehicles, the height errors of "
    "both, and by how much each overshoots a climb to highest_m (G1 of a step-response model).",
    fix="make step_m of [layers] larger",
)

LIFTED = Rule(
    "S119 other-height",
    Severity.INFO,
    summary="A sortie is flown at other heights than the mission of its job.",
    why="What a camera covers, how far it is to trees and masts, and what a permit allows all follow from "
    "the height the job was planned for.",
    how="The heights above home in the sortie's own mission against those of the job's at the same places: "
    "fires where they differ by 0.05 m or more.  mavjoule fleet plan lifts flights to [layers] to keep them "
    "apart; each is checked as it is flown.",
    fix="see that the job can be done from there, or start the sorties one after the other",
)

NOT_LIFTED = Rule(
    "S120 no-layer",
    Severity.INFO,
    summary="A job cannot be lifted to the layers of the fleet.",
    why="A plan can keep it apart by its start alone.",
    how="With [layers] and several vehicles that fly: a mission with heights that are not "
    "above home, with none at all, or with one that no layer is above.",
    fix="give its heights above home, or the fleet a higher layer",
)


def layer_findings(fleet: Fleet, flown: Sequence[FlownSortie]) -> Iterator[FleetFinding]:
    """Yield what is found of the layers of a fleet."""
    missions = dict(_missions(fleet))
    yield from _other_heights(flown, missions)
    layers, separation = fleet.layers, fleet.separation
    together = {one.sortie.vehicle for one in flown}
    if layers is None or separation is None or len(together) < 2:
        return
    yield from _steps(fleet, separation, layers)
    for job, mission in missions.items():
        why = why_not_lifted(mission)
        if not why and layers.heights_m[-1] <= (top_m := highest_m(mission)):
            why = f"no layer is above its {quantity.height(top_m)}"
        if why:
            yield FleetFinding(finding=NOT_LIFTED.finding(f"job {job} stays at its heights: {why}"))


def _missions(fleet: Fleet) -> Iterator[tuple[str, Mission]]:
    """Yield the missions of jobs that can be read, where there is something to compare."""
    own = {one.job for one in fleet.sorties.values() if one.mission is not None}
    for name, job in fleet.jobs.items():
        if name in own or fleet.layers is not None:
            try:
                yield name, read_mission(job.mission)
            except MissionFileError:
                continue  # its sorties tell


def _other_heights(
    flown: Sequence[FlownSortie], missions: dict[str, Mission]
) -> Iterator[FleetFinding]:
    for one in flown:
        job = one.sortie.job
        if one.sortie.mission is None or one.assessment is None or job not in missions:
            continue
        by_m = _differences_m(one.assessment.mission, missions[job])
        if not by_m:
            continue
        how_far = [
            f"{quantity.height(abs(each))} {'above' if each > 0 else 'below'}" for each in by_m
        ]
        message = (
            f"{one.name} is flown {' to '.join(dict.fromkeys(how_far))} the heights of job {job}"
        )
        yield FleetFinding(finding=LIFTED.finding(message), sorties=(one.name,))


def _differences_m(own: Mission, job: Mission) -> tuple[float, ...]:
    """Return by how much a mission is above that of its job: the same everywhere, or least and most. [m]

    Empty where it is not.  A place may be passed at several heights.
    """
    there: dict[tuple[float | None, float | None], list[float]] = {}
    for item in raised_items(job):
        there.setdefault((item.latitude_deg, item.longitude_deg), []).append(item.altitude_m or 0.0)
    found = [
        {round((item.altitude_m or 0.0) - height_m, 2) for height_m in at}
        for item in raised_items(own)
        if (at := there.get((item.latitude_deg, item.longitude_deg))) is not None
    ]
    if not found:
        return ()
    everywhere = reduce(set.intersection, found)
    if everywhere:
        by_m = min(everywhere, key=abs)
        return () if abs(by_m) < _SHOWN_M else (by_m,)
    nearest = [min(each, key=abs) for each in found]
    return min(nearest), max(nearest)


def _steps(fleet: Fleet, separation: Separation, layers: Layers) -> Iterator[FleetFinding]:
    heights_m = []
    for vehicle in fleet.vehicles.values():
        response = vehicle.setup.vehicle.responses.altitude
        overshoot = 0.0 if response is None else _overshoot(response.transfer_function)
        above_m = separation.horizontal_m if separation.above_m is None else separation.above_m
        below_m = above_m if separation.below_m is None else separation.below_m
        free_m = max(
            above_m if vehicle.above_m is None else vehicle.above_m,
            below_m if vehicle.below_m is None else vehicle.below_m,
        )
        heights_m.append((free_m, separation.height_error_m + overshoot * layers.highest_m))
    free_m = max(free_m for free_m, _ in heights_m)
    errors_m = sum(sorted(error_m for _, error_m in heights_m)[-2:])
    if layers.step_m < free_m + errors_m:
        message = (
            f"step_m of [layers] is {quantity.height(layers.step_m)}, {quantity.height(free_m + errors_m)} "
            f"needed: {quantity.height(free_m)} of separation, {quantity.height(errors_m)} of height "
            "errors and overshoots"
        )
        yield FleetFinding(finding=LAYER_STEP.finding(message))


def _overshoot(response: TransferFunction) -> float:
    """Return how far a second-order response passes a step, over the step. [-]"""
    damping = response.damping_ratio
    if damping is None or not 0.0 < damping < 1.0:
        return 0.0
    return math.exp(-math.pi * damping / math.sqrt(1.0 - damping**2))
