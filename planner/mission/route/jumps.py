"""The order in which items are flown: jumps followed as often as they say, loops found.

DO_JUMP names its target by id (``doJumpId`` of a plan, the row's number in a text file),
DO_JUMP_TAG by the tag of a JUMP_TAG item.  Both autopilots count how often each jump was taken for
the whole mission: an inner loop is not started anew by an outer one (ArduPilot AP_Mission
``jump_tracking``; PX4 ``do_jump_current_count``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.mission.commands import Command, command_name
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Finding
    from planner.mission.items import MissionItem


MOST_VISITS = 20_000
"""A mission whose jumps lead past so many items again is cut here, and said to be."""
_FOREVER = -1
_FOREVER_IN_16_BITS = 65_535  # PX4 keeps -1 as this, ArduPilot keeps this as -1
_ENDLESS = frozenset({_FOREVER, _FOREVER_IN_16_BITS})


class FlownOrder(Value):
    """The items of a mission in the order they are reached."""

    visits: tuple[int, ...]
    """Item numbers from 1, repeated where a jump leads back."""
    lap_start: int | None = None
    """Where the last lap of an endless loop begins, as a position in ``visits``; it is flown once
    more after the loop closed, to its end.  ``None`` where the mission ends."""
    lap_item: int | None = None
    """The item that closes the endless loop."""
    findings: tuple[Finding, ...] = ()


JUMPS_TOO_LONG = Rule(
    "T106 jumps-too-long",
    Severity.ERROR,
    summary="The jumps of the mission lead past too many items to predict.",
    why="A count mistaken by a digit makes a mission of days, which is reported, not computed.",
    how="Items are followed in flown order, up to 20,000 more than there are in the file.",
    fix="give the jumps smaller counts",
)


def flown_order(items: tuple[MissionItem, ...], meaning: Autopilot | None) -> FlownOrder:
    """Return in which order items are reached, from the first to the end or once round for ever.

    Parameters
    ----------
    items : tuple of MissionItem
        In file order.
    meaning : Autopilot, optional
        By whose rules; PX4 knows no jump tags.
    """
    jumps = {Command.DO_JUMP, Command.DO_JUMP_TAG}
    if not any(item.command in jumps for item in items):
        return FlownOrder(visits=tuple(range(1, len(items) + 1)))
    targets, findings = _targets(items, meaning)
    visits: list[int] = []
    taken: dict[int, int] = {}
    closed: tuple[int, int] | None = None
    at = 0
    while at < len(items):
        if len(visits) == len(items) + MOST_VISITS:
            findings.append(
                JUMPS_TOO_LONG.finding(
                    f"the jumps lead past more than {MOST_VISITS:,} items: "
                    "the prediction ends there, the mission continues",
                )
            )
            break
        item = items[at]
        visits.append(at + 1)
        target = targets.get(at)
        if target is None:
            at += 1
        elif closed is not None and closed[0] == at:
            break
        else:
            repeats = _repeats(item)
            is_endless = repeats in _ENDLESS
            if is_endless and target <= at:
                closed = (at, len(visits))
                at = target
            elif is_endless or taken.get(at, 0) < repeats:
                taken[at] = taken.get(at, 0) + 1
                at = target
            else:
                at += 1
    return FlownOrder(
        visits=tuple(visits),
        lap_start=None if closed is None else closed[1],
        lap_item=None if closed is None else closed[0] + 1,
        findings=tuple(findings),
    )


JUMP_TARGET = Rule(
    "M103 jump-target",
    Severity.ERROR,
    summary="A jump leads nowhere.",
    why="A jump to a missing item ends the mission or makes the autopilot refuse it; a jump to itself "
    "once skipped the whole mission (ArduPilot #28604).",
    how="The target of DO_JUMP or DO_JUMP_TAG is no item of the mission, or the jump itself.",
    fix="give the jump the id of an item before or after it",
)


def _targets(
    items: tuple[MissionItem, ...], meaning: Autopilot | None
) -> tuple[dict[int, int], list[Finding]]:
    """Return for each jump that leads somewhere its target, both as positions in ``items``."""
    by_id = {item.jump_id: at for at, item in reversed(list(enumerate(items)))}
    by_tag = {
        item.param1: at
        for at, item in reversed(list(enumerate(items)))
        if item.command == Command.JUMP_TAG
    }
    targets: dict[int, int] = {}
    findings: list[Finding] = []
    for at, item in enumerate(items):
        if item.command not in {Command.DO_JUMP, Command.DO_JUMP_TAG}:
            continue
        is_tag = item.command == Command.DO_JUMP_TAG
        named = item.param1
        target = None
        if named is not None:
            target = by_tag.get(named) if is_tag else by_id.get(int(named))
        problem = None
        if is_tag and meaning is Autopilot.PX4:
            problem = "PX4 has no jump tags"
        elif target is None:
            problem = f"no {'tag' if is_tag else 'item'} {_plain(named)}"
        elif target == at:
            problem = "jumps to itself"
        if problem is None and target is not None:
            targets[at] = target
        else:
            findings.append(
                JUMP_TARGET.finding(
                    f"{command_name(item.command)}: {problem}; predicted without the jump",
                    item=at + 1,
                    place=item.place,
                )
            )
    return targets, findings


def is_counted(item: MissionItem) -> bool:
    """Return whether a jump is taken a number of times, and not for ever."""
    return _repeats(item) not in _ENDLESS


def _repeats(item: MissionItem) -> int:
    """Return how often a jump is taken; any negative count is for ever."""
    repeats = 0.0 if item.param2 is None else item.param2
    return _FOREVER if repeats < 0.0 else int(min(repeats, _FOREVER_IN_16_BITS))


def _plain(number: float | None) -> str:
    return "(not given)" if number is None else f"{number:g}"


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
