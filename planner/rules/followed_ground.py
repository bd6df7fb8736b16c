"""Rules on the energy of following the ground, as far as it is not predicted."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.returns.destination import HOME
from planner.rules.declaration import ARDUPILOT, BUDGET, POWER, TERRAIN, NotEvaluated, judges
from planner.rules.terrain_following import (
    returns_above_m,
    returns_begun_within_reach,
    returns_follow_terrain,
)
from planner.units import GRAVITY_M_S2, wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import FloatArray
    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.flight.power import SteadyPower
    from planner.flight.prediction import Flight
    from planner.flight.returns.path import FlownReturns
    from planner.geo.terrain import TerrainGrid
    from planner.mission.route.stage import Stage
    from planner.rules.assessment import Assessment
    from planner.rules.declaration import Found
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_CLIMB_EFFICIENCY, _LEAST_W_KG = 0.5, 80.0
"""Of climbing: the survey quadrotor of the recordings climbs with 51 J for each metre of its 34 N, 0.67; and
the hover power over mass of a lightly loaded one, whose mass it bounds (the same quadrotor takes 101 W/kg).
[-], [W kg⁻¹]"""
_NOTHING = 0.01
"""Of the energy of a flight, less than predictions are good to: four flights of one mission differ by 0.6 %.
[-]"""

CLIMBS_NOT_COUNTED = Rule(
    "E127 climbs-not-counted",
    Severity.ERROR,
    summary="The battery does not cover the climbs over terrain that the model leaves out.",
    why="A step-response model has a power for each step of height, none for climbing and descending along "
    "the ground at full speed: over a saw-tooth of hills that was half of the energy.",
    how="Legs to items in a terrain frame over the ground of --terrain, of a step-response model: what they "
    "climb beyond the straight line, times m g over an efficiency of 0.5 (measured in simulation: 0.67), "
    "descents giving nothing back; without a mass that of a vehicle that hovers with 80 W/kg.  A warning "
    "where the margins of the flight and of its returns, less what else is not counted (E108), cover it; not "
    "below 1 % of the energy.",
    fix="use a model that is flown by ArduPilot, or leave more in the battery",
    instead="--battery or --vehicle",
)


@judges(CLIMBS_NOT_COUNTED, needs=(BUDGET, POWER))
def _climbs_not_counted(
    a: Assessment, _budget: BatteryBudget, _power: SteadyPower
) -> Iterator[Finding]:
    if a.autopilot is not Autopilot.STEP:
        return
    rises = [(_rises_m(stage), stage.item) for stage in a.route.stages if stage.follows_ground]
    if not rises:
        return
    climbed_m = sum(rise_m for rise_m, _ in rises)
    extra_wh = wh_from_j(_lift_j_m(a.flight) * climbed_m)
    if extra_wh < _NOTHING * a.totals.energy_wh:
        return
    left_wh = a.left_wh
    yield a.finding(
        CLIMBS_NOT_COUNTED,
        f"{quantity.height(climbed_m)} of climbs along the ground take up to {quantity.energy(extra_wh)}, "
        f"not counted by a step-response model; {quantity.energy(max(left_wh, 0.0))} left above the "
        "reserve",
        item=max(rises)[1],
        severity=Severity.WARNING if extra_wh <= left_wh else None,
    )


def _lift_j_m(flight: Flight) -> float:
    """Return the energy of climbing, at most. [J m⁻¹]"""
    mass_kg = flight.power.mass_kg or flight.hover_near_home_w / _LEAST_W_KG
    return mass_kg * GRAVITY_M_S2 / _CLIMB_EFFICIENCY


def _rises_m(stage: Stage) -> float:
    """Return what a leg climbs along the ground beyond the straight line between its ends. [m]"""
    ground_m = np.array(stage.followed_ground_m)
    off_m = ground_m - np.linspace(ground_m[0], ground_m[-1], len(ground_m))
    return float(np.maximum(np.diff(off_m), 0.0).sum())


RETURN_CLIMBS_NOT_COUNTED = Rule(
    "E129 return-climbs-not-counted",
    Severity.ERROR,
    summary="The battery does not cover what returns that follow the terrain climb and descend more.",
    why="A return that keeps its height above the ground climbs every hill on the way home, and from over "
    "a valley flies home at the height it had above the valley.",
    how="ArduPilot with RTL_ALT_TYPE 1 and data of the terrain, over --terrain: from all the points of E102 "
    "the climbs of the return beyond those predicted, times m g over an efficiency of 0.5 (as E127), and a "
    "hover for the time of the first climb, of the descent over home and of ground steeper than the "
    "vehicle climbs and descends, each beyond what is predicted.  An error where that is more than the "
    "margin of the return, less what else is not counted (E108); not evaluated (X904) where the ground "
    "is not known.",
    fix="leave more in the battery, or set RTL_ALT_TYPE to 0",
    instead="--battery, or the parameters of --params",
)


@judges(RETURN_CLIMBS_NOT_COUNTED, needs=(BUDGET, ARDUPILOT, TERRAIN))
def _return_climbs_not_counted(
    a: Assessment, budget: BatteryBudget, parameters: ArduPilotParameters, terrain: TerrainGrid
) -> Iterator[Found]:
    sample = a.returns.sample
    if sample is None or not returns_follow_terrain(a):
        return
    follows = returns_begun_within_reach(a, sample.points.place_m)
    homeward = np.flatnonzero((sample.destination >= HOME) & follows)
    if not len(homeward):
        return
    extra_wh = _extra_wh(a, sample, parameters, terrain)[homeward]
    taken_wh = sample.points.used_wh + sample.energy_wh
    taken_wh += a.late_return_wh(sample, a.late_returns) + a.uncounted_returns_wh
    margin_wh = (budget.above_reserve_wh - taken_wh)[homeward]
    if np.isnan(extra_wh).any():
        yield NotEvaluated(
            rule=RETURN_CLIMBS_NOT_COUNTED,
            asked_by="a return above terrain (RTL_ALT_TYPE 1)",
            needs="the ground under it: --terrain",
        )
    short_wh = np.where(margin_wh >= 0.0, np.nan_to_num(extra_wh, nan=0.0) - margin_wh, -np.inf)
    worst = int(short_wh.argmax())
    if short_wh[worst] <= 0.0:
        return
    stage = int(sample.points.stage[homeward[worst]])
    yield a.finding(
        RETURN_CLIMBS_NOT_COUNTED,
        f"a return from here follows the ground and takes up to {quantity.energy(float(extra_wh[worst]))} "
        f"more than predicted; {quantity.energy(float(margin_wh[worst]))} left above the reserve",
        item=a.route.stages[stage].item,
    )


def _extra_wh(
    a: Assessment, sample: FlownReturns, own: ArduPilotParameters, terrain: TerrainGrid
) -> FloatArray:
    """Return what returns over the ground may take beyond what is predicted of them; NaN: not known. (n,)"""
    corners_m, _ = a.returns.straight_corners_m(sample.points, sample.destination)
    ways_m, count = corners_m[:, 2:4], len(corners_m)
    where = a.route.frame.latitude_longitude_deg(ways_m[..., 0], ways_m[..., 1])
    ground = terrain.under(*where)
    ground_m = ground.ground_amsl_m - a.route.ground_datum_m
    begins = np.flatnonzero(np.diff(ground.line, prepend=-1))
    first_m, last_m = ground_m[begins, 0], ground_m[np.append(begins[1:], len(ground_m)) - 1, 1]

    def summed(of_parts: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(ground.line, of_parts, count), np.float64)

    change_m = np.diff(ground_m, axis=1)
    rises_m, falls_m = np.maximum(change_m, 0.0).sum(axis=1), np.maximum(-change_m, 0.0).sum(axis=1)
    length_m = np.hypot(*(ways_m[:, 1] - ways_m[:, 0])[:, :2].T)
    level_s = length_m[ground.line] * (ground.end - ground.start) / own.return_speed_m_s
    steep_s = rises_m / own.climb_speed_m_s + falls_m / own.descent_speed_m_s - level_s
    now_m, predicted_m = corners_m[:, 1, 2], corners_m[:, 2, 2]
    above_m = returns_above_m(a, sample.points, sample.destination, below_m=first_m, ahead_m=last_m)
    first_climb_m = np.maximum(first_m + above_m - predicted_m, 0.0)
    climb_m = np.maximum(first_m + above_m - now_m, 0.0) + summed(rises_m) - (predicted_m - now_m)
    descent_m = np.maximum(last_m + above_m - corners_m[:, 3, 2], 0.0)
    hover_s = (
        first_climb_m / own.climb_speed_m_s
        + descent_m / own.descent_speed_m_s
        + summed(np.maximum(steep_s, 0.0))
    )
    hover_w = a.flight.hover_near_home_w
    lifted_j = _lift_j_m(a.flight) * np.maximum(climb_m, 0.0)
    return wh_from_j(lifted_j + hover_w * hover_s)
