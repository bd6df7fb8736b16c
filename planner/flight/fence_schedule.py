"""When the fence is on: by parameters, and as the mission switches it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.pilot import is_of_ardupilot
from planner.mission.route.stage import FenceAction, StageKind
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray, FloatArray
    from planner.mission.route.stage import Route
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

CEILING, CIRCLE, AREAS, FLOOR = 1, 2, 4, 8
"""Bits of ArduPilot's FENCE_TYPE."""
_ON_AFTER_TAKEOFF = frozenset({1, 2})
"""Values of FENCE_AUTOENABLE that switch the fence on when a take-off is done."""


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
    route: Route, parameters: FlightParameters | None, *, as_legs_begin: bool = False
) -> FenceSchedule:
    """Return when the fence is on, by parameters and by the mission's DO_FENCE_ENABLE.

    As it is while stages are flown, or ``as_legs_begin``: ArduPilot carries out all DO_ items behind a place
    but the first when the next leg has begun (``AP_Mission::advance_current_do_cmd``).

    Notes
    -----
    ``AP_Mission::start_command_fence``; after a take-off of the mission FENCE_AUTOENABLE 1 and 2 switch
    it on again (``auto_enable_fence_after_takeoff``).  What FENCE_AUTOENABLE switches off for a landing
    is taken to be on: the flight to the place is fenced.  Areas that parameters alone leave off are judged,
    for they were drawn to be kept; that they are off is F111.  From 4.6
    on ``AC_Fence::get_auto_disable_fences`` leaves a floor on for landings that was switched on by hand,
    before that any that FENCE_AUTOENABLE does not switch off.
    """
    is_on = not is_of_ardupilot(parameters) or fence_is_on(parameters)
    again = is_of_ardupilot(parameters) and parameters.fence_auto_enable in _ON_AFTER_TAKEOFF
    count = len(route.stages)
    areas, limits, floor, by_mission = (np.full(count, on) for on in (True, is_on, is_on, False))
    events = [
        (one.first_stage + (one.is_late and as_legs_begin), one.action, True)
        for one in route.fence_switches
    ]
    if again and events:
        # It is on when the take-off is complete, before the items behind it are carried out.
        events[:0] = [(row + 1, FenceAction.ON, False) for row in route.rows_of(StageKind.TAKEOFF)]
        events.sort(key=lambda event: event[0])
    for first, action, is_of_mission in events:
        floor[first:] = action is FenceAction.ON
        by_mission[first:] = floor[first:] & is_of_mission
        if action is not FenceAction.FLOOR_OFF:
            areas[first:] = limits[first:] = action is FenceAction.ON
    return FenceSchedule(areas=areas, limits=limits, floor=floor, floor_by_mission=by_mission)


def return_ceilings_m(
    route: Route, parameters: ArduPilotParameters, schedule: FenceSchedule
) -> FloatArray:
    """Return how high returns may climb that begin in each stage, above the home that counts. (stages,) [m]

    ``ModeRTL::compute_return_target`` asks which limits are enabled as a return begins: FENCE_ALT_MAX less
    FENCE_MARGIN where that is one of them, else infinite.
    """
    count = len(route.stages)
    if not parameters.fence_type & CEILING:
        return np.full(count, np.inf)
    is_on = schedule.limits.copy()
    if not parameters.fence_enable and parameters.fence_auto_enable in _ON_AFTER_TAKEOFF:
        is_on[route.rows_of(StageKind.TAKEOFF)] = False
    ceiling_m = parameters.fence_height_max_m - parameters.fence_margin_m
    return np.where(is_on, ceiling_m, np.inf)


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
    """Return whether the parameters switch the fence on."""
    return bool(parameters.fence_enable or parameters.fence_auto_enable)
