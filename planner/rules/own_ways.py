"""Ways of a vehicle's own autopilot, where its model of reference steps flies others.

The model stops at corners that the autopilot cuts, and climbs in place where that climbs along a leg.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Finding
from planner.flight.motion.kinematics import STATE_INDEX, FlightState
from planner.flight.pilot import CONDITION_NOT_MODELLED, is_of_ardupilot
from planner.flight.power import NO_TRANSIENTS
from planner.flight.prediction import make_flight
from planner.flight.returns.path import make_returns
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.rules.declaration import FENCE, PROFILE, NotEvaluated, judges
from planner.rules.fenced_flight import straight_legs
from planner.rules.lateness import own_flown_of
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Rule
    from planner.flight.motion.kinematics import Motion
    from planner.flight.path import FlownPath
    from planner.geo.terrain import TerrainGrid
    from planner.rules.assessment import Assessment
    from planner.rules.fenced_flight import FencedFlight
    from planner.vehicle.parameters.resolve import FlightParameters

_PART_M, _MOST_PARTS = 2.5, 20_000
"""Ways are looked at in parts so long, longer ones where those were more."""
_OFF_M = 0.1
"""Ways nearer to those predicted are the same."""
_AT_GROUND = [STATE_INDEX[state] for state in (FlightState.TAKEOFF, FlightState.LAND)]
DELIVERED_RADIUS_M = 2.0
"""WPNAV_RADIUS, and NAV_ACC_RAD of multicopters, as they are delivered. [m]"""
_STRAIGHT = frozenset(
    {
        *RETURN_STAGES,
        *(StageKind.TAKEOFF, StageKind.GO, StageKind.LOITER, StageKind.DELAY, StageKind.LAND),
    }
)
"""Stages that autopilots fly along straight lines, but at their corners."""
_NEEDS = "a vehicle model that is flown by that autopilot"


@judges(CONDITION_NOT_MODELLED)
def _own_ways(a: Assessment) -> Iterator[NotEvaluated]:
    """Yield what is too near to the ways that the vehicle's own autopilot flies instead."""
    fence, terrain, profile = FENCE.of(a), a.setup.terrain, PROFILE.of(a)
    longest_m = None if profile is None else profile.max_distance_m
    fenced = None if fence is None else a.fenced
    if terrain is None and longest_m is None and not (fenced and _may_be_by(a, fenced)):
        return
    from planner.flight.path import flown_path
    from planner.rules.fence import PATH_CROSSES
    from planner.rules.site import PATH_SLACK_M, TOO_FAR_FOR_SITE, path_distances_m

    # A text says of no autopilot that it is for it: all of them cut corners and climb along legs.
    flown = a.own_flown or own_flown_of(a, otherwise=Autopilot.ARDUPILOT)
    if flown is None:
        return
    own = flown[1][0]
    part_m = max(_PART_M, float(own.segments.distance_m.sum()) / _MOST_PARTS)
    path = flown_path(own, straight_m=part_m, with_heights=True)
    off_m = _off_m(a, path)
    rows = np.flatnonzero(off_m > _OFF_M)
    near: list[tuple[Rule, str, IntArray]] = []
    if fenced is not None and len(rows):
        near.append((PATH_CROSSES, "the fence", rows[_is_by_fence(fenced, path, rows)]))
    if profile is not None and longest_m is not None:
        is_far = path_distances_m(a, profile, path)[1:] > longest_m + PATH_SLACK_M
        near.append((TOO_FAR_FOR_SITE, "the site's max_distance_m", rows[is_far[rows]]))
    for rule, what, there in near:
        if len(there):
            row = int(there[off_m[there].argmax()])
            yield NotEvaluated(
                rule=rule,
                asked_by=f"{what} at a corner that the vehicle's own autopilot cuts by "
                f"{quantity.distance(float(off_m[row]))}",
                needs=_NEEDS,
                item=int(path.item[row]),
            )
    aloft = np.flatnonzero(~np.isin(own.segments.state, _AT_GROUND)[path.segment])
    if terrain is not None and len(aloft):
        yield from _over_ground(_as_its_own_flies(a, own), terrain, path, aloft)


def _as_its_own_flies(a: Assessment, own: Motion) -> Assessment:
    """Return the flight as its own autopilot flies it, and the returns from there, by the model's power."""
    flown = a.returns
    flight = make_flight(own, NO_TRANSIENTS, a.flight.power)
    returns = make_returns(a.route, flight, flown.pilot, flown.destinations)
    return replace(a, flight=flight, returns=returns)


def _over_ground(
    own: Assessment, terrain: TerrainGrid, path: FlownPath, aloft: IntArray
) -> Iterator[NotEvaluated]:
    """Yield ground that is too high on the way of the vehicle's own autopilot, or on a return from it."""
    from planner.rules.terrain import BELOW_TERRAIN, items_too_low
    from planner.rules.terrain_returns import RETURN_BELOW_TERRAIN, returns_too_low

    of = "the way of the vehicle's own autopilot, which cuts corners and climbs along its legs,"
    returned = returns_too_low(own, terrain, path, aloft, terrain.cell_m)
    for rule, where, items in (
        (BELOW_TERRAIN, "on", sorted(items_too_low(own, terrain, path, aloft))),
        (
            RETURN_BELOW_TERRAIN,
            "on a return from",
            [one.item for one in returned if isinstance(one, Finding)],
        ),
    ):
        if items:
            yield NotEvaluated(
                rule=rule, asked_by=f"ground as high {where} {of}", needs=_NEEDS, item=items[0]
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


def _may_be_by(a: Assessment, fenced: FencedFlight) -> bool:
    """Return whether any way may be too near to the fence: corners are cut by less than the radius there."""
    if not _STRAIGHT.issuperset(stage.kind for stage in a.route.stages):
        return True
    given = a.own_parameters
    radius_m = DELIVERED_RADIUS_M if given is None else _radius_m(given)
    asked_m = (stage.acceptance_radius_m or 0.0 for stage in a.route.stages)
    beside_m = max(radius_m, *asked_m)
    return any(
        not fenced.is_clear_of(one, beside_m=beside_m)
        and len(fenced.legs_near(one, beside_m=beside_m))
        for one in fenced.area.barriers
    )


def _radius_m(given: FlightParameters) -> float:
    return given.waypoint_radius_m if is_of_ardupilot(given) else given.acceptance_radius_m


def _is_by_fence(fenced: FencedFlight, path: FlownPath, rows: IntArray) -> BoolArray:
    """Return whether legs of a path pass an area of the fence that is on within the position error. (k,)

    Where the flight as predicted does not do so itself on the way to the same item (F101, F102).
    """
    places_deg = fenced.assessment.route.frame.latitude_longitude_deg(path.east_m, path.north_m)
    points_m = np.column_stack(fenced.frame.east_north_m(*places_deg))
    legs = straight_legs(points_m[rows], points_m[rows + 1])
    near = np.zeros(len(rows), np.bool_)
    for barrier in fenced.area.barriers:
        asked = fenced.path.item[fenced.is_on(barrier)]
        asked = np.setdiff1d(asked, fenced.path.item[fenced.is_path_near(barrier)])
        is_asked = np.isin(path.item[rows], asked)
        if is_asked.any():
            near |= is_asked & (barrier.leg_clearance(legs).clearance_m < fenced.position_error_m)
    return near
