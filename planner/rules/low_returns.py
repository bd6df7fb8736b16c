"""Returns that begin low: in a landing, the climb behind one, or where a load is set down.

The flight is near the ground there because it means to be; its returns are not: ``ModeRTL`` and ``RTL``
climb to their height where they are, and fly home from there.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.rules.clearance import ROUNDING_M
from planner.rules.terrain_following import (
    following_parameters,
    known_above_m,
    reach_down_m,
    returns_follow_terrain,
)
from planner.values import Value, replace

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.returns.path import FlownReturns, ReturnPoints
    from planner.rules.assessment import Assessment

_NOT_AIRBORNE = [STATE_INDEX[state] for state in (FlightState.TAKEOFF, FlightState.LAND)]
_LEVEL = [
    STATE_INDEX[state] for state in (FlightState.ACCELERATE, FlightState.CRUISE, FlightState.BRAKE)
]
_HALVINGS = 30
"""The time at which a height is passed is found to a nanosecond of a leg."""
_OF_LANDING = 2.0
"""Times --clearance above where it lands, from where on returns count that keep their height: so what rises
up to --clearance above that place is near none."""
_LOWEST_M = 2.0
"""Above where it lands, from where on returns may not meet the ground itself: lower, it is down within 4 s at
the 0.5 m/s of LAND_SPEED. [m]"""


class ReturnStretches(Value, eq=False):
    """Stretches of a flight from which returns are judged."""

    time_s: FloatArray
    """Of the flight, at both ends of each. (n, 2) [s]"""
    stage: IntArray
    """(n,)"""
    item: IntArray
    """(n,)"""
    clearance_m: float
    """What is asked of them. [m]"""
    is_low: bool = False
    """Whether they are climbs and descents at the ground, each as the lowest place that counts."""

    def points(self, a: Assessment) -> ReturnPoints:
        """Return the points they begin at. (n,)"""
        return replace(a.returns.points(*a.returns.at(self.time_s[:, 0])), stage=self.stage)


def is_vertical_at_ground(a: Assessment) -> BoolArray:
    """Return whether segments take off, land, or set down a load: they begin or end at the ground. (s,)"""
    columns = a.flight.motion.segments
    sets_down = np.isin(a.returns.segment_stage, a.route.rows_of(StageKind.SET_DOWN))
    # It stands, or climbs and descends: what is left is the level way there.
    lowers = sets_down & ~np.isin(columns.state, _LEVEL)
    return np.asarray(np.isin(columns.state, _NOT_AIRBORNE) | lowers)


def return_height_is_known(a: Assessment) -> bool:
    """Return whether parameters, or the mission's file, say how high the vehicle returns."""
    places = a.returns.destinations
    return places.parameters is not None or places.stated_height_m is not None


def low_returns(a: Assessment, *, follow: bool, is_lowest: bool = False) -> ReturnStretches:
    """Return the lowest returns that count: level above home, or those that follow the ground.

    Returns from higher up there lead over the same ground, no lower.  Within --clearance of the ground those
    that are ``is_lowest`` count: there it lands, or has just taken off, and it is asked that they miss the
    ground.
    """
    path, returns = a.path, a.returns
    own = [stage.item for stage in a.route.stages_of(*RETURN_STAGES)]
    counts = is_vertical_at_ground(a)[path.segment] & ~np.isin(path.item, own)
    counts &= follow <= returns_follow_terrain(a)
    legs = np.flatnonzero(counts)
    places_m = np.column_stack((path.east_m, path.north_m, path.height_m))
    above_m = known_above_m(a, places_m)
    above_m = np.where(np.isnan(above_m), path.height_m, above_m)
    top_m = np.maximum(above_m[legs], above_m[legs + 1])
    # The height at which each begins, above the ground.
    least_m = _least_above_m(a, legs, above_m, follow=follow, is_lowest=is_lowest)
    lowest_m = np.maximum(np.minimum(above_m[legs], above_m[legs + 1]), least_m)
    kept = lowest_m <= top_m
    if follow and (reach_m := reach_down_m(a)) is not None:
        kept &= lowest_m <= reach_m
    legs, lowest_m = legs[kept], lowest_m[kept]
    stage = returns.segment_stage[path.segment[legs]]
    order = np.lexsort((lowest_m, stage))
    first = order[np.diff(stage[order], prepend=-1) != 0]
    legs, lowest_m, stage = legs[first], lowest_m[first], stage[first]
    height_m = lowest_m - above_m[legs] + path.height_m[legs]
    time_s = _passed_s(a, legs, height_m)
    return ReturnStretches(
        time_s=np.stack((time_s, time_s), axis=1),
        stage=stage,
        item=path.item[legs],
        clearance_m=0.0 if is_lowest else a.setup.clearance_m,
        is_low=True,
    )


def _least_above_m(
    a: Assessment, legs: IntArray, above_m: FloatArray, *, follow: bool, is_lowest: bool
) -> FloatArray:
    """Return the height above the ground from which on returns count on legs. (n,) [m]

    Those that climb from --clearance to a height of their own count from there.
    """
    path, low_m = a.path, a.setup.clearance_m
    kept_m = max(_OF_LANDING * low_m, _LOWEST_M)
    if is_lowest:
        least_m = np.full(len(legs), _LOWEST_M)
    elif follow:
        climbs = following_parameters(a).return_altitude_m > low_m
        least_m = np.full(len(legs), low_m if climbs else kept_m)
    else:
        climbing = _climbs_from(a, legs, path.height_m[legs] - above_m[legs] + low_m)
        least_m = np.where(climbing, low_m, kept_m)
    if not return_height_is_known(a):
        # No autopilot as it is delivered returns lower than ArduPilot.
        ground_m = path.height_m[legs] - above_m[legs]
        least_m = np.maximum(least_m, following_parameters(a).return_altitude_m - ground_m)
    if not follow and returns_follow_terrain(a):
        reach_m = reach_down_m(a)  # from within it they follow the ground
        least_m = np.maximum(least_m, np.inf if reach_m is None else reach_m + ROUNDING_M)
    return least_m


def _climbs_from(a: Assessment, legs: IntArray, begin_m: FloatArray) -> BoolArray:
    """Return whether returns from heights above the places of legs climb to one of their own. (n,)"""
    stage = a.returns.segment_stage[a.path.segment[legs]]
    points = replace(a.returns.points(*a.returns.at(a.path.time_s[legs])), stage=stage)
    place_m, stop_m = points.place_m.copy(), points.stop_m.copy()
    place_m[:, 2] = stop_m[:, 2] = begin_m
    points = replace(points, place_m=place_m, stop_m=stop_m)
    corners_m, _ = a.returns.straight_corners_m(points, a.returns.chosen(points))
    climbs: BoolArray = corners_m[:, 2, 2] > begin_m + ROUNDING_M
    return climbs


def _passed_s(a: Assessment, legs: IntArray, height_m: FloatArray) -> FloatArray:
    """Return when heights are passed on legs that climb or descend. (n,) [s]"""
    path, motion = a.path, a.flight.motion
    begin_s, end_s = path.time_s[legs].copy(), path.time_s[legs + 1].copy()
    rises = path.height_m[legs + 1] >= path.height_m[legs]
    for _ in range(_HALVINGS):
        middle_s = 0.5 * (begin_s + end_s)
        is_over = motion.state_at_time(middle_s).height_m >= height_m
        is_before = is_over != rises
        begin_s, end_s = (
            np.where(is_before, middle_s, begin_s),
            np.where(is_before, end_s, middle_s),
        )
    return np.where(rises, end_s, begin_s)


def with_low_returns(a: Assessment, sample: FlownReturns | None) -> tuple[ReturnPoints, IntArray]:
    """Return the points of a sample and the low ones that follow the ground, and where they lead. (n,)"""
    from planner.flight.returns.path import ReturnPoints

    low = low_returns(a, follow=True).points(a)
    homeward = a.returns.chosen(low)
    if sample is None:
        return low, homeward
    return ReturnPoints.joined((sample.points, low)), np.append(sample.destination, homeward)
