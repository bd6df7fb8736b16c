"""When the fence is on: by parameters, and as the mission switches it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.pilot import is_of_ardupilot
from planner.mission.route.stage import FenceAction, StageKind
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.mission.route.stage import FenceSwitch, Route
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

CEILING, CIRCLE, AREAS, FLOOR = 1, 2, 4, 8
"""Bits of ArduPilot's FENCE_TYPE."""
_OFF_ON_THE_GROUND, _AFTER_TAKEOFF = 1, 2
"""FENCE_AUTOENABLE, of Copter from 4.6 on.  Both switch the fence on when a take-off in GUIDED is done:
``ModeGuided::takeoff_run`` alone calls ``auto_enable_fence_after_takeoff``, in AUTO it stays off (flown).  1
switches it off while the vehicle stands or lands, even with FENCE_ENABLE 1 (``AC_Fence::check``; flown).  The
floor is switched on by the height, in any mode: with FENCE_ENABLE, and from 2 on
(``auto_enable_fence_floor``; flown)."""


class FenceSchedule(Value, eq=False):
    """What of the fence is on while each stage of a route is flown. (stages,) each"""

    areas: BoolArray
    """The areas of the mission's file: unless the mission itself switches them off."""
    limits: BoolArray
    """The limits around home: as parameters and mission have it."""
    floor: BoolArray
    floor_by_mission: BoolArray
    """Of these the floor that the mission has switched on, which stays on for landings."""


def fence_schedule(
    route: Route,
    parameters: FlightParameters | None,
    *,
    acts: bool = False,
    as_legs_begin: bool = False,
) -> FenceSchedule:
    """Return when the fence is on, by parameters and by the mission's DO_FENCE_ENABLE.

    What is judged: a fence that FENCE_AUTOENABLE switches on at all.  Or what ``acts`` on a flight in AUTO:
    nothing that waits for a take-off in GUIDED.

    As it is while stages are flown, or ``as_legs_begin``: ArduPilot carries out all DO_ items behind a place
    but the first when the next leg has begun (``AP_Mission::advance_current_do_cmd``).

    Notes
    -----
    ``AP_Mission::start_command_fence``.  What FENCE_AUTOENABLE switches off for a landing
    is taken to be on: the flight to the place is fenced.  Areas that parameters alone leave off are judged,
    for they were drawn to be kept; that they are off is F111.  From 4.6
    on ``AC_Fence::get_auto_disable_fences`` leaves a floor on for landings that was switched on by hand,
    before that any that FENCE_AUTOENABLE does not switch off.
    """
    is_on = has_floor = True
    events: list[tuple[int, FenceSwitch | None]] = [
        (one.first_stage, one) for one in route.fence_switches
    ]
    if is_of_ardupilot(parameters):
        is_on = has_floor = fence_is_on(parameters)
        if acts and waits_for_guided(parameters):
            is_on, has_floor = False, parameters.fence_auto_enable != _OFF_ON_THE_GROUND
            has_floor |= bool(parameters.fence_enable)
        if acts and parameters.fence_auto_enable == _OFF_ON_THE_GROUND:
            events += [(row, None) for row in route.rows_of(StageKind.TAKEOFF)]
            events.sort(key=lambda event: event[0])
    count = len(route.stages)
    areas, limits, floor, by_mission = (
        np.full(count, on) for on in (True, is_on, has_floor, False)
    )
    for row, one in events:
        if one is None:
            limits[row:] = False
            continue
        first = row + (one.is_late and as_legs_begin)
        by_mission[first:] = floor[first:] = one.action is FenceAction.ON
        if one.action is not FenceAction.FLOOR_OFF:
            areas[first:] = limits[first:] = one.action is FenceAction.ON
    return FenceSchedule(areas=areas, limits=limits, floor=floor, floor_by_mission=by_mission)


def return_ceilings_m(parameters: ArduPilotParameters, schedule: FenceSchedule) -> FloatArray:
    """Return how high returns may climb that begin in each stage, above the home that counts. (stages,) [m]

    ``ModeRTL::compute_return_target`` asks which limits are enabled as a return begins: FENCE_ALT_MAX less
    FENCE_MARGIN where that is one of them, else infinite.
    """
    if not parameters.fence_type & CEILING:
        return np.full(len(schedule.limits), np.inf)
    ceiling_m = parameters.fence_height_max_m - parameters.fence_margin_m
    return np.where(schedule.limits, ceiling_m, np.inf)


def rally_is_taken(
    parameters: ArduPilotParameters,
    schedule: FenceSchedule,
    *,
    height_m: FloatArray,
    from_home_m: FloatArray,
) -> BoolArray:
    """Return whether a return that begins in a stage may lead to a rally point. (stages, r)

    ``AP_Rally_Copter::is_valid`` asks ``AC_Fence::check_destination_within_fence``: of the heights and of the
    circle around home; a point outside of an area is an error of its own (F103).

    Parameters
    ----------
    parameters, schedule
        When what of its fence is on.
    height_m : ndarray
        Of each point above the home that counts. (r,) [m]
    from_home_m : ndarray
        Distance of each from the home that counts in a stage. (stages, r) [m]
    """
    kind = parameters.fence_type
    limits, floor = schedule.limits[:, None], schedule.floor[:, None]
    is_out = limits & bool(kind & CEILING) & (height_m > parameters.fence_height_max_m)
    is_out |= floor & bool(kind & FLOOR) & (height_m < parameters.fence_height_min_m)
    return ~(is_out | limits & bool(kind & CIRCLE) & (from_home_m > parameters.fence_radius_m))


def fence_is_on(parameters: ArduPilotParameters) -> bool:
    """Return whether the parameters switch the fence on, in one mode or another."""
    return bool(parameters.fence_enable or parameters.fence_auto_enable)


def waits_for_guided(parameters: ArduPilotParameters) -> bool:
    """Return whether the fence is on after a take-off in GUIDED, and off after one in AUTO."""
    automatic = parameters.fence_auto_enable
    return automatic == _OFF_ON_THE_GROUND or (
        automatic == _AFTER_TAKEOFF and not parameters.fence_enable
    )
