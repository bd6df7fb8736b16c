"""What PX4's feasibility check says about a multicopter's mission, and speeds it does not fly.

After ``FeasibilityChecker.cpp`` and ``mission_block.cpp`` of PX4 1.14 to early 2026.
"""

from __future__ import annotations

from itertools import pairwise
from typing import TYPE_CHECKING, cast

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.feasibility import (
    FIRST_WAYPOINT_FAR,
    GATE_AT_WAYPOINT,
    REQUIRED_ITEM_MISSING,
)
from planner.catalogue.time import SPEED_CLAMPED
from planner.catalogue.wind import WIND_LIMIT
from planner.findings import Remarks, Severity
from planner.geo.geodesy import distance_m
from planner.mission.commands import Command

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.px4 import Px4Parameters

_CLOSEST_GATE_M = 0.05
_WARNS_ONLY = (1, 16)
"""The version from which a first place far away is a warning (PX4 #23568)."""
_PLACES = frozenset(
    {
        Command.NAV_WAYPOINT,
        Command.NAV_LOITER_UNLIM,
        Command.NAV_LOITER_TIME,
        Command.NAV_LAND,
        Command.NAV_TAKEOFF,
        Command.NAV_LOITER_TO_ALT,
        Command.NAV_VTOL_TAKEOFF,
        Command.NAV_VTOL_LAND,
        Command.CONDITION_GATE,
    }
)
"""``MissionBlock::item_contains_position``."""
_TAKEOFF, _LANDING, _BOTH, _BOTH_OR_NONE = {1}, {2}, {3}, {4, 5}
"""MIS_TKO_LAND_REQ; 5 asks for more in the air only."""


_FIRST_PLACE_M = 10_000.0
"""Default of MIS_DIST_1WP. [m]"""


def _parameters(a: Assessment) -> Px4Parameters | None:
    """Return PX4's parameters where PX4 flies: reference steps do not wait for their import."""
    if a.autopilot is not Autopilot.PX4:
        return None
    return cast("Px4Parameters | None", a.parameters)


def check_required_items(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a take-off or landing is missing that MIS_TKO_LAND_REQ asks for."""
    parameters = _parameters(a)
    if parameters is None:
        return
    required = parameters.takeoff_land_required
    commands = {item.command for item in a.mission.items}
    takes_off = not commands.isdisjoint({Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF})
    lands = Command.NAV_LAND in commands
    missing = []
    if not takes_off and (required in _TAKEOFF | _BOTH or (required in _BOTH_OR_NONE and lands)):
        missing.append("NAV_TAKEOFF")
    if not lands and (required in _LANDING | _BOTH or (required in _BOTH_OR_NONE and takes_off)):
        missing.append("NAV_LAND")
    if missing:
        home = "; a return is no landing to it" if "NAV_LAND" in missing else ""
        yield REQUIRED_ITEM_MISSING.finding(
            f"MIS_TKO_LAND_REQ is {required}: PX4 refuses the mission without "
            f"{' and '.join(missing)}{home}"
        )


def check_first_place(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the first place is farther from home than MIS_DIST_1WP."""
    parameters = _parameters(a)
    limit_m = _FIRST_PLACE_M if parameters is None else parameters.first_waypoint_distance_m
    home = a.mission.home
    if home is None or limit_m <= 0.0:
        return
    number, *place = next(_places(a), (0, 0.0, 0.0))
    if not number:
        return
    there_m = float(distance_m(home.latitude_deg, home.longitude_deg, *place))
    if there_m >= limit_m:
        version = None if a.target is None else a.target.version
        refuses = version is not None and version < _WARNS_ONLY
        yield FIRST_WAYPOINT_FAR.finding(
            f"the first place is {quantity.beside(there_m, limit_m, quantity.distance)} from home, "
            f"MIS_DIST_1WP is {quantity.distance(limit_m)}: PX4 "
            f"{'refuses the mission' if refuses else 'warns'}",
            item=number,
            place=a.mission.items[number - 1].place,
            severity=Severity.ERROR if refuses else None,
        )


def check_gates(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a gate lies at a place of its neighbours."""
    items = a.mission.items
    if all(item.command != Command.CONDITION_GATE for item in items):
        return
    for (before, *there), (number, *here) in pairwise(_places(a)):
        commands = {items[before - 1].command, items[number - 1].command}
        apart_m = float(distance_m(*there, *here))
        if Command.CONDITION_GATE in commands and apart_m < _CLOSEST_GATE_M:
            yield GATE_AT_WAYPOINT.finding(
                f"is {apart_m:.2f} m from item {before}, one of them a gate: PX4 refuses the mission",
                item=number,
                place=items[number - 1].place,
            )


def check_speeds(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for commanded speeds above MPC_XY_VEL_MAX, where PX4 flies."""
    parameters = _parameters(a)
    if parameters is None:
        return
    limit_m_s = parameters.speed_max_m_s
    remarks = Remarks()
    for number, item in enumerate(a.mission.items, start=1):
        if item.command == Command.DO_CHANGE_SPEED and (item.param2 or 0.0) > limit_m_s:
            remarks.add(
                SPEED_CLAMPED,
                f"{quantity.beside(item.param2 or 0.0, limit_m_s, quantity.speed)} is commanded, "
                f"MPC_XY_VEL_MAX allows {quantity.speed(limit_m_s)}: {quantity.speed(limit_m_s)} is flown",
                item=number,
                place=item.place,
            )
    yield from remarks.findings()


def check_wind_limit(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where the wind is above COM_WIND_MAX."""
    parameters = _parameters(a)
    limit_m_s = -1.0 if parameters is None else parameters.wind_max_m_s
    wind_m_s = a.conditions.wind.speed_m_s
    if 0.0 < limit_m_s < wind_m_s:
        yield WIND_LIMIT.finding(
            f"{quantity.beside(wind_m_s, limit_m_s, quantity.speed)} of wind, COM_WIND_MAX is "
            f"{quantity.speed(limit_m_s)}"
        )


def _places(a: Assessment) -> Iterator[tuple[int, float, float]]:
    """Yield number, latitude and longitude of the items with a place. [°]"""
    for number, item in enumerate(a.mission.items, start=1):
        latitude_deg, longitude_deg = item.latitude_deg, item.longitude_deg
        if item.command in _PLACES and latitude_deg is not None and longitude_deg is not None:
            yield number, latitude_deg, longitude_deg


PX4_CHECKS: tuple[Callable[[Assessment], Iterator[Finding]], ...] = (
    check_required_items,
    check_first_place,
    check_gates,
    check_speeds,
    check_wind_limit,
)
