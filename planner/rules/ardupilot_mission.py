"""What ArduPilot's arming check says about a Copter's mission, and what failsafes find in it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, cast

import numpy as np
import numpy.typing as npt

from planner import quantity
from planner.autopilot import Autopilot
from planner.catalogue.feasibility import (
    LAND_START_WITHOUT_LANDING,
    RALLY_FAR,
    REQUIRED_ITEM_MISSING,
    TOO_MANY_JUMPS,
)
from planner.findings import Remarks, Severity
from planner.mission.commands import Command
from planner.mission.route.jumps import is_counted

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

    from planner.findings import Finding
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.ardupilot import ArduPilotParameters

_REQUIRED: Mapping[int, Command] = {
    0: Command.NAV_LAND,
    1: Command.NAV_VTOL_LAND,
    2: Command.DO_LAND_START,
    3: Command.NAV_TAKEOFF,
    4: Command.NAV_VTOL_TAKEOFF,
    6: Command.NAV_RETURN_TO_LAUNCH,
}
"""Item by bit of ARMING_MIS_ITEMS (AP_Arming.cpp, ``mission_checks``)."""
_JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG})
_FEWEST_COUNTED, _MOST_COUNTED = 15, 100
"""AP_MISSION_MAX_NUM_DO_JUMP_COMMANDS, by the memory of the board (AP_Mission.h)."""
_RALLY_BIT = 5
_RALLY_LIMIT_M = 300.0
"""Copter's default of RALLY_LIMIT_KM. [m]"""
_LANDINGS = frozenset(
    {Command.NAV_LAND, Command.NAV_VTOL_LAND, Command.NAV_RETURN_TO_LAUNCH, Command.DO_LAND_START}
)


def check_required_items(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where an item is missing that ARMING_MIS_ITEMS asks for."""
    if a.autopilot is not Autopilot.ARDUPILOT:
        return  # reference steps have no parameters, and do not wait for their import
    parameters = cast("ArduPilotParameters | None", a.parameters)
    bits = 0 if parameters is None else parameters.mission_items_required
    if bits <= 0:
        return
    commands = {item.command for item in a.mission.items}
    missing = [
        command.name
        for bit, command in _REQUIRED.items()
        if bits & 1 << bit and command not in commands
    ]
    limit_m = _rally_limit_m(a)
    if bits & 1 << _RALLY_BIT and not any(
        math.hypot(*point_m) <= limit_m for point_m in _rally_m(a)
    ):
        within = "" if math.isinf(limit_m) else f" within {quantity.distance(limit_m)} of home"
        missing.append(f"a rally point{within}")
    if missing:
        yield REQUIRED_ITEM_MISSING.finding(
            f"ARMING_MIS_ITEMS is {bits}: ArduPilot will not arm without {', '.join(missing)}"
        )


def check_land_starts(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for each DO_LAND_START that no landing follows."""
    items = a.mission.items
    remarks = Remarks()
    for number, item in enumerate(items, start=1):
        if item.command == Command.DO_LAND_START and not any(
            later.command in _LANDINGS for later in items[number:]
        ):
            message = "DO_LAND_START: no landing follows"
            remarks.add(LAND_START_WITHOUT_LANDING, message, item=number, place=item.place)
    yield from remarks.findings()


def check_jumps(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where there are more jumps with a count than ArduPilot keeps count of."""
    reached = set(a.route.reached)
    counted = [
        (number, item)
        for number, item in enumerate(a.mission.items, start=1)
        if item.command in _JUMPS and number in reached and is_counted(item)
    ]
    if len(counted) <= _FEWEST_COUNTED:
        return
    number, item = counted[_FEWEST_COUNTED]
    too_many = len(counted) > _MOST_COUNTED
    most = f"{_MOST_COUNTED}" if too_many else f"{_FEWEST_COUNTED} on small boards"
    yield TOO_MANY_JUMPS.finding(
        f"the flight passes {len(counted)} jumps with a count: ArduPilot takes no more than {most}",
        item=number,
        place=item.place,
        severity=Severity.ERROR if too_many else None,
    )


def check_rally(a: Assessment) -> Iterator[Finding]:
    """Yield a finding where a rally point is beyond RALLY_LIMIT_KM of the mission, and home nearer.

    ``AP_Rally::find_nearest_rally_point``: beyond the limit home is taken where it is nearer.  Where it
    is not, one end of a leg is nearer to the rally point than to home.
    """
    rally, route, limit_m = a.mission.rally, a.route, _rally_limit_m(a)
    if not rally:
        return
    path_m = np.array([(0.0, 0.0), *((s.east_m, s.north_m) for s in route.stages)])
    remarks = Remarks()
    for number, (point, point_m) in enumerate(zip(rally, _rally_m(a), strict=True), start=1):
        away_m = _distance_to_path_m(point_m, path_m)
        is_nearer = np.hypot(*(path_m - point_m).T) <= np.hypot(*path_m.T)
        if away_m > limit_m and not is_nearer.any():
            remarks.add(
                RALLY_FAR,
                f"rally point {number} is {quantity.beside(away_m, limit_m, quantity.distance)} from the "
                f"mission, RALLY_LIMIT_KM is {limit_m / 1000.0:g}: ArduPilot never goes there",
                place=point.place,
            )
    yield from remarks.findings()


def _rally_limit_m(a: Assessment) -> float:
    """Return how far ArduPilot looks for a rally point; infinite where it takes any. [m]"""
    if a.autopilot is not Autopilot.ARDUPILOT or a.parameters is None:
        return _RALLY_LIMIT_M
    return cast("ArduPilotParameters", a.parameters).rally_limit_m or math.inf


def _rally_m(a: Assessment) -> npt.NDArray[np.float64]:
    """Return the rally points, east and north of home. (n, 2) [m]"""
    rally = a.mission.rally
    return np.column_stack(
        a.route.frame.east_north_m(
            [point.latitude_deg for point in rally], [point.longitude_deg for point in rally]
        )
    )


def _distance_to_path_m(point_m: npt.NDArray[np.float64], path_m: npt.NDArray[np.float64]) -> float:
    """Return the distance of a point (2,) from straight legs through points (n, 2). [m]"""
    start, way = path_m[:-1], np.diff(path_m, axis=0)
    length2 = (way**2).sum(axis=1)
    share = ((point_m - start) * way).sum(axis=1) / np.where(length2 > 0.0, length2, 1.0)
    nearest = start + np.clip(share, 0.0, 1.0)[:, None] * way
    return float(np.hypot(*(point_m - nearest).T).min())


ARDUPILOT_CHECKS: tuple[Callable[[Assessment], Iterator[Finding]], ...] = (
    check_required_items,
    check_land_starts,
    check_jumps,
    check_rally,
)
