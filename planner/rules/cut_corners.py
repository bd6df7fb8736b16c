"""Corners that a vehicle's own autopilot cuts, where its model of reference steps stops at them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.flight.pilot import CONDITION_NOT_MODELLED
from planner.rules.declaration import FENCE, PARAMETERS, PROFILE, NotEvaluated, judges
from planner.rules.lateness import own_motion

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.flight.path import FlownPath
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.resolve import FlightParameters

_PART_M, _MOST_PARTS = 2.5, 20_000
"""Ways are looked at in parts so long, longer ones where those were more."""
_BESIDE = ("the fence", "ground as high", "the site's max_distance_m")
"""What is near, in words, in the order of the rules."""


@judges(CONDITION_NOT_MODELLED, needs=(PARAMETERS,))
def _cut_corners(a: Assessment, parameters: FlightParameters) -> Iterator[NotEvaluated]:
    """Yield what is too near to the ways across corners, as the autopilot of the parameters flies them."""
    fence, terrain, profile = FENCE.of(a), a.setup.terrain, PROFILE.of(a)
    longest_m = None if profile is None else profile.max_distance_m
    if a.autopilot is not Autopilot.STEP or (
        fence is None and terrain is None and longest_m is None
    ):
        return
    from planner.flight.path import flown_path
    from planner.rules.fence import PATH_CROSSES
    from planner.rules.site import TOO_FAR_FOR_SITE, path_distances_m
    from planner.rules.terrain import BELOW_TERRAIN, items_too_low

    own = own_motion(a, parameters)
    if own is None:
        return
    part_m = max(_PART_M, float(own.segments.distance_m.sum()) / _MOST_PARTS)
    path = flown_path(own, straight_m=part_m, with_heights=True)
    off_m = _off_m(a, path)
    rows = np.flatnonzero(off_m > a.setup.position_margin_m)
    if not len(rows):
        return
    nowhere = np.zeros(len(rows), np.bool_)
    near = {PATH_CROSSES: nowhere, BELOW_TERRAIN: nowhere, TOO_FAR_FOR_SITE: nowhere}
    if fence is not None:
        near[PATH_CROSSES] = _is_by_fence(a, path, rows)
    if terrain is not None:
        low = items_too_low(a, terrain, path, rows)
        near[BELOW_TERRAIN] = np.array([item in low for item in path.item[rows].tolist()])
    if profile is not None and longest_m is not None:
        near[TOO_FAR_FOR_SITE] = path_distances_m(a, profile, path)[rows] > longest_m
    for (rule, are_near), what in zip(near.items(), _BESIDE, strict=True):
        if are_near.any():
            row = int(rows[are_near][off_m[rows[are_near]].argmax()])
            yield NotEvaluated(
                rule=rule,
                asked_by=f"{what} at a corner that the vehicle's own autopilot cuts by "
                f"{quantity.distance(float(off_m[row]))}",
                needs="a vehicle model that is flown by that autopilot",
                item=int(path.item[row]),
            )


def _off_m(a: Assessment, path: FlownPath) -> FloatArray:
    """Return how far the middles of the legs of a path are from that of the flight. (n,) [m]"""
    import shapely

    from planner.flight.path import flown_path

    flown = flown_path(a.flight.motion)
    points_m = np.column_stack((flown.east_m, flown.north_m))
    ways = shapely.linestrings(np.stack((points_m[:-1], points_m[1:]), axis=1))
    own_m = np.column_stack((path.east_m, path.north_m))
    middles = shapely.points(0.5 * (own_m[:-1] + own_m[1:]))
    (rows, _), away_m = shapely.STRtree(ways).query_nearest(
        middles, return_distance=True, all_matches=False
    )
    off_m = np.zeros(len(middles))
    off_m[rows] = away_m
    return off_m


def _is_by_fence(a: Assessment, path: FlownPath, rows: IntArray) -> BoolArray:
    """Return whether legs of a path pass an area of the fence that is on within the position error. (k,)"""
    from planner.rules.fenced_flight import make_fenced_flight, straight_legs

    fenced = make_fenced_flight(a)
    places_deg = a.route.frame.latitude_longitude_deg(path.east_m, path.north_m)
    points_m = np.column_stack(fenced.frame.east_north_m(*places_deg))
    legs = straight_legs(points_m[rows], points_m[rows + 1])
    near = np.zeros(len(rows), np.bool_)
    for barrier in (*fenced.area.barriers, *fenced.around_homes):
        if fenced.is_on(barrier).any():
            near |= barrier.leg_clearance(legs).clearance_m < fenced.position_error_m
    return near
