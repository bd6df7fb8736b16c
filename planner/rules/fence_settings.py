"""What a vehicle's parameters say of its fence: limits around home, and whether it is enforced."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planner.flight.pilot import is_of_ardupilot
from planner.mission.route.stage import FenceAction, StageKind
from planner.values import Value

if TYPE_CHECKING:
    from planner.arrays import BoolArray
    from planner.mission.route.stage import Route
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters
    from planner.vehicle.parameters.resolve import FlightParameters

_CEILING, CIRCLE, AREAS, _FLOOR = 1, 2, 4, 8
"""Bits of ArduPilot's FENCE_TYPE."""
_ONE_INCLUSION_IS_ENOUGH = 2
"""Bit of ArduPilot's FENCE_OPTIONS."""
_ON_AFTER_TAKEOFF = frozenset({1, 2})
"""Values of FENCE_AUTOENABLE that switch the fence on when a take-off is done."""
_PX4_WARNS = 1
"""GF_ACTION up to which PX4 does nothing about a breach."""


class FenceLimits(Value):
    """The fence that parameters draw around home; ``None`` where they draw none."""

    distance_m: float | None = None
    distance_name: str = ""
    """The parameter with its value."""
    ceiling_m: float | None = None
    """Over home. [m]"""
    ceiling_name: str = ""
    floor_m: float | None = None
    """Over home. [m]"""
    floor_name: str = ""

    def __bool__(self) -> bool:
        return (self.distance_m, self.ceiling_m, self.floor_m) != (None, None, None)


class FenceSchedule(Value, eq=False):
    """What of the fence is on while each stage of a route is flown. (stages,) each"""

    areas: BoolArray
    """The areas of the mission's file: unless the mission itself switches them off."""
    limits: BoolArray
    """The limits around home: as parameters and mission have it."""
    floor: BoolArray


def fence_schedule(route: Route, parameters: FlightParameters | None) -> FenceSchedule:
    """Return when the fence is on, by parameters and by the mission's DO_FENCE_ENABLE.

    Notes
    -----
    ``AP_Mission::start_command_fence``; after a take-off of the mission FENCE_AUTOENABLE 1 and 2 switch
    it on again (``auto_enable_fence_after_takeoff``).  What FENCE_AUTOENABLE switches off for a landing
    is taken to be on: the flight to the place is fenced.  Areas that parameters alone leave off are judged,
    for they were drawn to be kept; that they are off is F111.
    """
    is_on = not is_of_ardupilot(parameters) or fence_is_on(parameters)
    again = is_of_ardupilot(parameters) and parameters.fence_auto_enable in _ON_AFTER_TAKEOFF
    count = len(route.stages)
    areas, limits, floor = (np.full(count, on) for on in (True, is_on, is_on))
    events: list[tuple[int, FenceAction]] = [
        (one.first_stage, one.action) for one in route.fence_switches
    ]
    if again and events:
        # It is on when the take-off is complete, before the items behind it are carried out.
        events[:0] = [
            (number + 1, FenceAction.ON)
            for number, stage in enumerate(route.stages)
            if stage.kind is StageKind.TAKEOFF
        ]
        events.sort(key=lambda event: event[0])
    for first, action in events:
        floor[first:] = action is FenceAction.ON
        if action is not FenceAction.FLOOR_OFF:
            areas[first:] = limits[first:] = action is FenceAction.ON
    return FenceSchedule(areas=areas, limits=limits, floor=floor)


def is_from_file(parameters: FlightParameters | None) -> bool:
    """Return whether a parameter file says anything of the fence."""
    return parameters is not None and any(
        name.startswith("fence_") and origin.is_file for name, origin in parameters.origins.items()
    )


def limits_from_parameters(
    parameters: FlightParameters | None, *, is_switched_on: bool = False
) -> FenceLimits:
    """Return the limits around home that are enforced, or will be once the mission switches them on."""
    if parameters is None:
        return FenceLimits()
    if not is_of_ardupilot(parameters):
        distance_m, ceiling_m = parameters.fence_distance_max_m, parameters.fence_height_max_m
        return FenceLimits(
            distance_m=distance_m or None,
            distance_name=f"GF_MAX_HOR_DIST ({distance_m:g} m)",
            ceiling_m=ceiling_m or None,
            ceiling_name="GF_MAX_VER_DIST",
        )
    kind = parameters.fence_type if fence_is_on(parameters) or is_switched_on else 0
    return FenceLimits(
        distance_m=parameters.fence_radius_m if kind & CIRCLE else None,
        distance_name=f"FENCE_RADIUS ({parameters.fence_radius_m:g} m)",
        ceiling_m=parameters.fence_height_max_m if kind & _CEILING else None,
        ceiling_name="FENCE_ALT_MAX",
        floor_m=parameters.fence_height_min_m if kind & _FLOOR else None,
        floor_name="FENCE_ALT_MIN",
    )


def limits_in_use(route: Route, parameters: FlightParameters | None) -> FenceLimits:
    """Return the limits around home that are on at some time of a flight."""
    switched_on = route.fence_switched_on is not None and is_from_file(parameters)
    return limits_from_parameters(parameters, is_switched_on=switched_on)


def inclusions_unite(parameters: FlightParameters | None) -> bool:
    """Return whether one inclusion area is enough."""
    return is_of_ardupilot(parameters) and bool(parameters.fence_options & _ONE_INCLUSION_IS_ENOUGH)


def fence_margin_m(parameters: FlightParameters | None) -> float:
    """Return the level distance the autopilot itself keeps from its fence. [m]"""
    return parameters.fence_level_margin_m if is_of_ardupilot(parameters) else 0.0


def why_not_enforced(
    parameters: FlightParameters | None, *, is_switched_on: bool = False
) -> str | None:
    """Return what leaves a fence of areas without effect; ``None`` where no file says so."""
    if parameters is None:
        return None
    reasons: tuple[tuple[bool, str, str], ...]
    if is_of_ardupilot(parameters):
        reasons = (
            (not (fence_is_on(parameters) or is_switched_on), "fence_enable", "the fence is off"),
            (not parameters.fence_type & AREAS, "fence_type", "polygons and circles are off"),
            (parameters.fence_action == 0, "fence_action", "a breach is only reported"),
        )
    else:
        does = "only warns of" if parameters.fence_action else "does nothing about"
        weak = parameters.fence_action <= _PX4_WARNS
        reasons = ((weak, "fence_action", f"PX4 {does} a breach"),)
    for holds, quantity, reason in reasons:
        origin = parameters.origins.get(quantity)
        if holds and origin is not None and origin.is_file:
            return f"{origin}: {reason}"
    return None


def fence_is_on(parameters: ArduPilotParameters) -> bool:
    """Return whether the parameters switch the fence on."""
    return bool(parameters.fence_enable or parameters.fence_auto_enable)
