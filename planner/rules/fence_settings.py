"""What a vehicle's parameters say of its fence: limits around home, and whether it is enforced."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.flight.fence_schedule import (
    AREAS,
    CEILING,
    CIRCLE,
    FLOOR,
    fence_is_on,
    waits_for_guided,
)
from planner.flight.pilot import is_of_ardupilot
from planner.values import Value

if TYPE_CHECKING:
    from planner.mission.route.stage import Route
    from planner.vehicle.parameters.resolve import FlightParameters

_ONE_INCLUSION_IS_ENOUGH = 2
"""Bit of ArduPilot's FENCE_OPTIONS."""
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
        ceiling_m=parameters.fence_height_max_m if kind & CEILING else None,
        ceiling_name="FENCE_ALT_MAX",
        floor_m=parameters.fence_height_min_m if kind & FLOOR else None,
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
            (
                waits_for_guided(parameters) and not is_switched_on,
                "fence_auto_enable",
                "the fence is off after a take-off in AUTO, on after one in GUIDED alone",
            ),
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
