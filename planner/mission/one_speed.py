"""A mission flown at one speed: as a route, and as items one can save."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.errors import UsageError
from planner.mission.commands import Command, Frame
from planner.mission.course import FASTEST_M_S
from planner.mission.items import MissionItem
from planner.mission.jump_numbers import numbered_in_order
from planner.mission.jumps import flown_order
from planner.mission.route import make_route
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.mission.items import Mission
    from planner.mission.stage import Route

_HORIZONTAL = frozenset({None, 0.0, 1.0})
"""Types of DO_CHANGE_SPEED that set the speed of level flight: airspeed and ground speed."""
_GROUND_SPEED = 1.0
_ELSEWHERE_M = 0.01
"""A place this near is the same one. [m]"""


def route_at_speed(route: Route, speed_m_s: float) -> Route:
    """Return a route whose every leg is flown at one speed.

    Parameters
    ----------
    route : Route
        As its mission asks for it.
    speed_m_s : float
        Over ground; climbs and descents keep theirs, and so does a return, whose speed is set in the
        vehicle. [m s⁻¹]

    Raises
    ------
    UsageError
        If nothing flies at this speed.
    """
    _refuse(speed_m_s)
    level = set(_level_stages(route))
    return replace(
        route,
        stages=tuple(
            replace(stage, speed_m_s=speed_m_s) if number in level else stage
            for number, stage in enumerate(route.stages)
        ),
    )


def level_speeds(route: Route) -> frozenset[float | None]:
    """Return the speeds a route commands on its level legs; ``None``: the vehicle's own. [m s⁻¹]"""
    return frozenset(route.stages[number].speed_m_s for number in _level_stages(route))


def mission_at_speed(
    mission: Mission, speed_m_s: float, *, meaning: Autopilot | None = None
) -> Mission:
    """Return a mission that commands one speed for every level leg.

    Parameters
    ----------
    mission : Mission
        Its DO_CHANGE_SPEED of level flight are changed in place; one is inserted before the first leg
        where none governs that one, and the jumps lead where they led before.
    speed_m_s : float
        Over ground. [m s⁻¹]
    meaning : Autopilot, optional
        Whose reading of the items counts; default the file's firmware.  PX4 takes every
        DO_CHANGE_SPEED for the speed of level flight.

    Returns
    -------
    Mission
        It flies as `route_at_speed` does.

    Raises
    ------
    UsageError
        If nothing flies at this speed.
    MissionFileError
        If the mission cannot be flown.
    """
    _refuse(speed_m_s)
    meaning = mission.autopilot if meaning is None else meaning
    items = tuple(_changed(item, speed_m_s, meaning) for item in mission.items)
    first = _first_ungoverned(mission, meaning)
    if first is not None:
        before = items[first - 1]
        # it takes over the id, so that a jump to that leg passes it too
        added = MissionItem(
            command=int(Command.DO_CHANGE_SPEED),
            frame=int(Frame.MISSION),
            param1=_GROUND_SPEED,
            param2=speed_m_s,
            param3=-1.0,
            param4=0.0,
            latitude_deg=0.0,
            longitude_deg=0.0,
            altitude_m=0.0,
            jump_id=before.jump_id,
        )
        items = numbered_in_order((*items[: first - 1], added, *items[first - 1 :]))
    return replace(mission, items=items)


def _refuse(speed_m_s: object) -> None:
    if isinstance(speed_m_s, bool) or not isinstance(speed_m_s, int | float):
        msg = f"a speed must be a number, got {speed_m_s!r}"
        raise UsageError(msg)
    if not (math.isfinite(speed_m_s) and 0.0 < speed_m_s <= FASTEST_M_S):
        msg = f"a speed must be above 0 and at most {FASTEST_M_S:g} m/s, got {speed_m_s:g}"
        raise UsageError(msg)


def _sets_level_speed(item: MissionItem, meaning: Autopilot | None) -> bool:
    return item.command == Command.DO_CHANGE_SPEED and (
        meaning is Autopilot.PX4 or item.param1 in _HORIZONTAL
    )


def _changed(item: MissionItem, speed_m_s: float, meaning: Autopilot | None) -> MissionItem:
    if not _sets_level_speed(item, meaning):
        return item
    kind = item.param1 if item.param1 in _HORIZONTAL else _GROUND_SPEED
    return replace(item, param1=kind, param2=speed_m_s)


def _first_ungoverned(mission: Mission, meaning: Autopilot | None) -> int | None:
    """Return the item of the first level leg where no speed is commanded before; else ``None``."""
    route = make_route(mission, meaning=meaning)
    first = next(_level_stages(route), None)
    if first is None:
        return None
    item = route.stages[first].item
    for number in flown_order(mission.items, meaning).visits:
        if number == item:
            return number
        if _sets_level_speed(mission.items[number - 1], meaning):
            return None
    return None


def _level_stages(route: Route) -> Iterator[int]:
    """Yield the positions of the stages whose speed the mission decides: returns do not count."""
    here, was_circle = (0.0, 0.0), False
    for number, stage in enumerate(route.stages):
        there, is_circle = (stage.east_m, stage.north_m), stage.kind is StageKind.CIRCLE
        goes = is_circle or was_circle or math.dist(here, there) > _ELSEWHERE_M
        if goes and stage.kind is not StageKind.RETURN:
            yield number
        here, was_circle = there, is_circle
