"""Rules on what PX4 asks of its fence beyond the way that is flown: waypoints, and the place it predicts."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.path import PATH_TOLERANCE_M
from planner.geo.barrier import swept_areas
from planner.mission.commands import RELATIVE_FRAMES, Command, command_name
from planner.mission.route.stage import RETURN_STAGES
from planner.rules.declaration import FENCE, PX4, Need, judges
from planner.rules.fence import PATH_CROSSES

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.arrays import BoolArray, FloatArray, IntArray
    from planner.findings import Finding
    from planner.mission.items import MissionItem
    from planner.rules.assessment import Assessment
    from planner.rules.fence_settings import FenceLimits
    from planner.vehicle.parameters.px4 import Px4Parameters

_CHECKED_EVERY_S = 0.2
"""``GEOFENCE_CHECK_INTERVAL_US``; so much more way is added. [s]"""
_AT_REST_M_S = 0.2
"""Slower than this the velocity measured points anywhere. [m s⁻¹]"""
_HEIGHT_MARGIN_M = 2.0
"""So near to the limit a height may be off: PX4 was recorded up to 1.6 m above commanded heights. [m]"""
_CLIMBED_M = 0.25
"""So often an upright climb is looked at: one line of the path may be all of it. [m]"""
_DOES = {2: "holds there", 3: "returns", 4: "cuts its motors", 5: "lands there"}
"""What GF_ACTION makes of a breach; those below only warn."""
_LEAST_ACTION, _RETURNS = min(_DOES), 3
_CHECKED = frozenset(
    {
        *(Command.NAV_WAYPOINT, Command.NAV_LOITER_UNLIM, Command.NAV_LOITER_TIME),
        *(Command.NAV_LAND, Command.NAV_TAKEOFF, Command.NAV_LOITER_TO_ALT),
        *(Command.NAV_VTOL_TAKEOFF, Command.NAV_VTOL_LAND),
    }
)
"""Items with a place to PX4 (``MissionBlock::item_contains_position``)."""

PREDICTED_BREACH = Rule(
    "F116 predicted-breach",
    Severity.ERROR,
    summary="PX4 takes the flight to be about to leave its fence.",
    why="With GF_PREDICT 1 PX4 asks not where it is but where it would stop if it still accelerated now.  "
    "Flown at 10 m/s towards a waypoint 4 m within GF_MAX_HOR_DIST it left the mission 48 m before that "
    "limit, climbing at 3 m/s 10 m below GF_MAX_VER_DIST; with GF_PREDICT 0 it flew the same mission.",
    how="GF_PREDICT 1 with GF_ACTION 2 to 5: at every place of the flight the place so far ahead as "
    "GeofenceBreachAvoidance::computeBrakingDistanceMultirotor has it: a braking by MPC_ACC_HOR and "
    "MPC_JERK_AUTO that begins with the greater of it and MPC_ACC_HOR_MAX forwards, and 0.2 s at its speed; "
    "at rest to all sides; within --position-error of every area and of GF_MAX_HOR_DIST.  So much above it, "
    "by MPC_ACC_UP_MAX and MPC_ACC_DOWN_MAX, within 2 m of GF_MAX_VER_DIST.  With GF_ACTION 3 "
    "returns of the mission go on, and its own returns are not looked at.",
    fix="set GF_PREDICT 0, or give it more room",
    instead="GF_PREDICT 0, or a mission farther from its fence",
)

WAYPOINT_OUTSIDE = Rule(
    "F117 waypoint-outside",
    Severity.ERROR,
    summary="PX4 refuses the mission: an item's place is outside its fence.",
    why="PX4 looks at every item of the list before it starts a mission, not at what is flown: 'Geofence "
    "violation for waypoint'.",
    how="The place of every take-off, waypoint, loiter and landing, jumped over or behind the return too, "
    "against every area, GF_MAX_HOR_DIST and GF_MAX_VER_DIST, whatever GF_ACTION "
    "(MissionFeasibilityChecker::checkGeofence, Geofence::check).",
    fix="move the item to where the fence allows it, or delete it where it is not flown",
    instead="a mission whose places are all in the fence",
)


def _checking(a: Assessment) -> Autopilot | None:
    is_target = a.target is not None and a.target.autopilot is Autopilot.PX4
    return Autopilot.PX4 if is_target or PX4.of(a) is not None else None


_CHECKED_BY_PX4: Need[Autopilot] = Need("a mission for PX4", _checking, is_subject=True)


@judges(PREDICTED_BREACH, needs=(FENCE, PX4))
def _predicted_breach(
    a: Assessment, limits: FenceLimits, parameters: Px4Parameters
) -> Iterator[Finding]:
    if not parameters.fence_predicts or parameters.fence_action < _LEAST_ACTION:
        return
    yield from _predicted_beyond(a, parameters)
    if limits.ceiling_m is not None:
        yield from _predicted_above(a, parameters, limits.ceiling_m)


def _predicted_beyond(a: Assessment, parameters: Px4Parameters) -> Iterator[Finding]:
    """Yield the first place from which the one predicted is beyond an area or the distance from home."""
    flown = a.fenced
    speed = flown.path.speed_m_s
    *reach_m, rest_m = predicted_m(
        np.append(speed, 0.0),
        begins_m_s2=max(parameters.acceleration_m_s2, parameters.acceleration_limit_m_s2),
        brakes_m_s2=parameters.acceleration_m_s2,
        jerk_m_s3=parameters.jerk_m_s3,
    ).tolist()
    ahead_m, margin_m = flown.ahead_m(np.array(reach_m)), flown.position_error_m
    legs = np.arange(len(flown.group))
    found: list[tuple[int, str]] = []
    for barrier in flown.area.barriers:
        if flown.is_clear_of(barrier, beside_m=max(reach_m)):
            continue
        points = [p[rows] for p in (flown.points_m, ahead_m) for rows in (legs, legs + 1)]
        areas = swept_areas(np.concatenate(points), np.tile(legs, len(points)))
        beside_m = barrier.signed_distance_m(flown.points_m[1:])
        near = areas.near(barrier, margin_m)
        near |= (speed[1:] < _AT_REST_M_S) & (beside_m < rest_m + margin_m)
        near &= flown.is_on(barrier) & _matters(a, parameters, flown.path.segment)
        if near.any():
            found.append((int(near.argmax()), barrier.label))
    if found:
        leg, label = min(found)
        row = leg + int(speed[leg + 1] > speed[leg])
        yield a.finding(
            PREDICTED_BREACH,
            f"GF_PREDICT 1: at {quantity.speed(float(speed[row]))} PX4 looks "
            f"{quantity.distance(reach_m[row])} ahead, and finds itself beyond {label}: "
            f"it {_DOES[min(parameters.fence_action, max(_DOES))]}",
            item=int(flown.path.item[leg]),
            fix="set GF_PREDICT 0, fly slower, or keep as far from the fence",
        )


def _predicted_above(
    a: Assessment, parameters: Px4Parameters, ceiling_m: float
) -> Iterator[Finding]:
    """Yield the first place from which the height predicted is above the ceiling."""
    returns, motion = a.returns, a.flight.motion
    is_upright = a.path.length_m < PATH_TOLERANCE_M
    path = a.path.cut(motion, np.where(is_upright, _CLIMBED_M, np.inf))
    segment = np.append(path.segment, path.segment[-1])
    places = returns.destinations
    datum_m = places.home_datum_m[places.home_of(returns.segment_stage[segment])]
    climb_m_s = motion.state_at_time(path.time_s).climb_m_s
    up, down = parameters.acceleration_up_m_s2, parameters.acceleration_down_m_s2
    reach_m = predicted_m(
        np.maximum(climb_m_s, 0.0),
        begins_m_s2=max(up, down),
        brakes_m_s2=down,
        jerk_m_s3=parameters.jerk_m_s3,
    )
    over_m = path.height_m - datum_m + np.where(climb_m_s > -_AT_REST_M_S, reach_m, 0.0)
    above = (over_m > ceiling_m - _HEIGHT_MARGIN_M) & _matters(a, parameters, segment)
    if above.any():
        first = int(above.argmax())
        yield a.finding(
            PREDICTED_BREACH,
            f"GF_PREDICT 1: climbing at {quantity.speed(max(float(climb_m_s[first]), 0.0))} PX4 looks "
            f"{quantity.distance(float(reach_m[first]))} up, and finds itself above GF_MAX_VER_DIST "
            f"({quantity.height(ceiling_m)}): it {_DOES[min(parameters.fence_action, max(_DOES))]}",
            item=int(path.item[min(first, len(path.item) - 1)]),
            fix="set GF_PREDICT 0, or stay farther below the limit",
        )


def _matters(a: Assessment, parameters: Px4Parameters, segment: IntArray) -> BoolArray:
    """Return whether a breach in each segment changes the flight: to return, a return need not be told.

    Flown: its own RTL says "approaching or outside geofence" with GF_ACTION 3, and goes on.
    """
    returns = [stage.kind in RETURN_STAGES for stage in a.route.stages]
    is_returning = np.array([*returns, False])[a.returns.segment_stage[segment]]
    return ~(is_returning & (parameters.fence_action == _RETURNS))


def predicted_m(
    speed_m_s: FloatArray, *, begins_m_s2: float, brakes_m_s2: float, jerk_m_s3: float
) -> FloatArray:
    """Return how far ahead PX4 predicts a vehicle to stop.

    Parameters
    ----------
    speed_m_s : ndarray
        Not negative. [m s⁻¹]
    begins_m_s2 : float
        Acceleration forwards that it begins with. [m s⁻²]
    brakes_m_s2, jerk_m_s3 : float
        Greatest deceleration, and greatest change of it. [m s⁻², m s⁻³]

    Returns
    -------
    ndarray
        [m]

    Notes
    -----
    ``VelocitySmoothing``: the acceleration goes to zero, then from there to a stop, both by the greatest
    jerk.  Flown: 48.5 m at 10 m/s, 37 m at 8 m/s, seen up to 0.2 s late.
    """
    wait_s = begins_m_s2 / jerk_m_s3
    gained_m = speed_m_s * wait_s + begins_m_s2 * wait_s**2 / 3.0
    fastest = speed_m_s + 0.5 * begins_m_s2 * wait_s
    peak = np.maximum(np.minimum(brakes_m_s2, np.sqrt(fastest * jerk_m_s3)), 1e-6)
    stop_m: FloatArray = 0.5 * fastest * (fastest / peak + peak / jerk_m_s3)
    return gained_m + stop_m + _CHECKED_EVERY_S * speed_m_s


@judges(WAYPOINT_OUTSIDE, needs=(FENCE, _CHECKED_BY_PX4))
def _waypoint_outside(
    a: Assessment, limits: FenceLimits, _autopilot: Autopilot
) -> Iterator[Finding]:
    placed = [
        (number, item, (item.latitude_deg, item.longitude_deg))
        for number, item in enumerate(a.mission.items, start=1)
        if item.command in _CHECKED
        and item.latitude_deg is not None
        and item.longitude_deg is not None
    ]
    if not placed:
        return
    flown = a.fenced
    degrees = np.array([there for *_, there in placed])
    points_m = np.column_stack(flown.frame.east_north_m(*degrees.T))
    # Of the homes, the one there is when the mission is sent.
    barriers = [one for one in flown.area.barriers if not flown.is_of_moved_home(one)]
    inside_m = [one.signed_distance_m(points_m) for one in barriers]
    reached = {stage.item for stage in a.route.stages}
    for row, (number, item, _) in enumerate(placed):
        name = f"{command_name(item.command)}: PX4 refuses the mission: "
        for barrier, clear_m in zip(barriers, inside_m, strict=True):
            if (out_m := -float(clear_m[row])) > PATH_TOLERANCE_M:
                side = "outside" if barrier.keep_inside else "inside"
                yield a.finding(
                    WAYPOINT_OUTSIDE,
                    f"{name}its place is {quantity.distance(out_m)} {side} {barrier.label}",
                    item=number,
                    fix=PATH_CROSSES.fix if number in reached else None,
                )
                return
        height_m = _above_home_m(a, item)
        if limits.ceiling_m is not None and height_m >= limits.ceiling_m:
            yield a.finding(
                WAYPOINT_OUTSIDE,
                f"{name}{quantity.beside(height_m, limits.ceiling_m, quantity.height)} above home; "
                f"{limits.ceiling_name} is {quantity.height(limits.ceiling_m)}",
                item=number,
            )
            return


def _above_home_m(a: Assessment, item: MissionItem) -> float:
    """Return the height of an item above the home there is when the mission is sent. [m]"""
    if item.altitude_m is None:
        return -math.inf
    if item.frame in RELATIVE_FRAMES:
        return item.altitude_m
    return item.altitude_m - a.route.home_amsl_m if a.route.knows_home_amsl else -math.inf
