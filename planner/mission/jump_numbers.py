"""Items numbered anew, the jumps among them going where they went before."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from planner.mission.commands import Command

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.mission.items import MissionItem

_NOWHERE = 0.0
"""No item has this number: a jump there stays one that leads nowhere."""


def numbered_in_order(items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return items whose jump ids are 1, 2, 3 and so on, DO_JUMP targets renamed with them.

    That is the number ground stations give an item in a plan, and a row after the home row in a
    text file.  A jump whose target is missing keeps it, unless an item would now answer to it.
    """
    number_of: dict[int, int] = {}
    for number, item in enumerate(items, start=1):
        if item.jump_id is not None:
            number_of.setdefault(item.jump_id, number)
    return tuple(
        replace(
            item,
            jump_id=number,
            param1=_target(item.param1, number_of, last=len(items))
            if item.command == Command.DO_JUMP
            else item.param1,
        )
        for number, item in enumerate(items, start=1)
    )


def _target(named: float | None, number_of: dict[int, int], *, last: int) -> float | None:
    """Return the new number of what a jump names."""
    if named is None:
        return None
    number = number_of.get(int(named))
    if number is not None:
        return float(number)
    return _NOWHERE if 1 <= int(named) <= last else named
