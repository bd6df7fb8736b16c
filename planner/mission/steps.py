"""A mission in flown order: jumps written out, each step with the stage it makes and what is set."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.errors import SplitError
from planner.frozen import frozen
from planner.mission.carried_state import CarriedState, carried_state
from planner.mission.commands import Command, command_name
from planner.mission.stage import StageKind

if TYPE_CHECKING:
    from planner.autopilot import Autopilot
    from planner.mission.items import Mission, MissionItem
    from planner.mission.stage import Route, Stage

_JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG, Command.JUMP_TAG})
ENDS = frozenset({StageKind.LAND, StageKind.RETURN})
"""Stages after which a flight is over."""


@frozen
class Steps:
    """A mission in flown order, jumps written out, each step with the stage that it makes."""

    mission: Mission
    route: Route
    meaning: Autopilot | None
    items: tuple[MissionItem, ...]
    numbers: tuple[int, ...]
    """The item of the mission each step is, from 1."""
    stages: tuple[int | None, ...]
    """Position in the route's stages; ``None``: no flight."""
    states: tuple[CarriedState, ...]
    """What is set before each step, and behind the last."""
    first: int
    """The first step behind the take-off."""
    flying: tuple[int, ...]
    """The steps behind the take-off that fly."""
    has_jumps: bool

    @property
    def ends(self) -> bool:
        """Whether the mission ends on the ground."""
        return self.route.stages[-1].kind in ENDS

    def stage(self, step: int) -> Stage:
        """Return the stage of a step that flies."""
        number = self.stages[step]
        assert number is not None
        return self.route.stages[number]

    def stage_before(self, step: int) -> Stage:
        """Return the stage before that of a step that flies."""
        number = self.stages[step]
        assert number is not None
        return self.route.stages[number - 1]

    def length_m(self, step: int) -> float:
        """Return the length over ground of the leg to a step. [m]"""
        here, there = self.stage_before(step), self.stage(step)
        return math.hypot(there.east_m - here.east_m, there.north_m - here.north_m)


def make_steps(mission: Mission, route: Route, meaning: Autopilot | None) -> Steps:
    """Return a mission in flown order.

    Parameters
    ----------
    mission : Mission
        It has a home.
    route : Route
        What the mission asks for.
    meaning : Autopilot, optional
        Whose reading of the items counts.

    Raises
    ------
    SplitError
        If it has no end, or parts of it would not mean what they do in it.
    """
    _refuse_unsuitable(mission, route)
    at = 1 if is_takeoff_assumed(route) else 0
    items: list[MissionItem] = []
    numbers: list[int] = []
    stages: list[int | None] = []
    states = [CarriedState()]
    for number in route.reached:
        item = mission.items[number - 1]
        flies = at < len(route.stages) and route.stages[at].item == number
        if item.command not in _JUMPS:
            items.append(item)
            numbers.append(number)
            stages.append(at if flies else None)
            before = states[-1]
            states.append(before if flies else carried_state((*before.items, item), meaning))
        at += flies
    first = next(step for step, stage in enumerate(stages) if stage is not None)
    if not is_takeoff_assumed(route):
        first += 1
    return Steps(
        mission=mission,
        route=route,
        meaning=meaning,
        items=tuple(items),
        numbers=tuple(numbers),
        stages=tuple(stages),
        states=tuple(states),
        first=first,
        flying=tuple(step for step in range(first, len(items)) if stages[step] is not None),
        has_jumps=any(
            item.command in {Command.DO_JUMP, Command.DO_JUMP_TAG} for item in mission.items
        ),
    )


def is_takeoff_assumed(route: Route) -> bool:
    """Return whether a route begins with a take-off that no item asks for."""
    stages = route.stages
    return len(stages) > 1 and stages[0].item == stages[1].item


def _refuse_unsuitable(mission: Mission, route: Route) -> None:
    why = None
    if mission.home is None:
        why = "where home is must be known, for every part comes back to it: set the planned home"
    elif route.lap is not None:
        why = f"item {route.lap.item} jumps back for ever: give the jump a count"
    elif route.moved_homes:
        why = (
            "DO_SET_HOME moves home: heights and returns of the parts would count from another "
            "place; take it out of the mission"
        )
    elif len(route.stages) < 2:
        why = "there is no leg to divide"
    else:
        for stage in route.stages:
            command = mission.items[stage.item - 1].command
            if command == Command.NAV_LOITER_UNLIM:
                why = f"item {stage.item} {command_name(command)} never ends: give it a time"
    if why is not None:
        msg = f"{mission.source}: cannot be split: {why}"
        raise SplitError(msg)
