"""ArduPilot's queue of DO_ items: what conditions hold back, and when it is carried out.

While a navigation item is flown the items between it and the one before are run one after the other,
each at once, unless a CONDITION_ item before them holds the rest back; what is still held back when the
navigation item is done is dropped (``AP_Mission::advance_current_nav_cmd``, ``advance_current_do_cmd``).
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.commands import Command, is_navigation
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.mission.items import MissionItem

CONDITIONS = frozenset({Command.CONDITION_DELAY, Command.CONDITION_DISTANCE, Command.CONDITION_YAW})
HELD = frozenset({Command.DO_CHANGE_SPEED, Command.DO_SET_HOME, Command.DO_FENCE_ENABLE})
"""Commands that change the flight or how it is judged; of any other it does not matter when."""
JUMPS = frozenset({Command.DO_JUMP, Command.DO_JUMP_TAG})
"""Followed when the next command is looked for (``AP_Mission::get_next_cmd``); a tag is carried out."""
TURN_DEG_S = 60.0
"""Greatest rate of a turn: the default of ATC_SLEW_YAW, as of AUTO_YAW_SLEW_RATE before it. [° s⁻¹]"""
_HALF_TURN_DEG, _WHOLE_TURN_DEG = 180.0, 360.0

HELD_BACK = Rule(
    "T115 held-back",
    Severity.INFO,
    summary="A condition holds back an item that changes the flight.",
    why="CONDITION_DELAY, _DISTANCE and _YAW do not stop the vehicle: they hold back the DO_ items "
    "behind them while it flies on, and what is still held back when the next place is reached is "
    "never carried out.",
    how="DO_CHANGE_SPEED, DO_SET_HOME and DO_FENCE_ENABLE behind a condition, on ArduPilot: carried out so "
    "many seconds after the leg began, so near to its place (the edge of a circle; of a return what it "
    "climbs to before it sets out: at once), or after the longest turn to the heading, as predicted: half "
    "a turn, a whole one where the item says which way round, no faster than ATC_SLEW_YAW.  The vehicle "
    "may point there already: a fence is on at once, and so is a speed where the flight takes longer by "
    "it.  A leg may last longer than predicted for want of airspeed (E105), that of a step-response model "
    "without parameters as long as ArduPilot flies it: a speed counts where the flight takes longest, one of "
    "descents that comes during a landing for all of it; one whose condition is met within 5 % of the end of "
    "its leg, or 1 m, may come or not: predicted as the flight takes longer, judged the other way too.  One "
    "that comes while a leg brakes for its end leaves that as it is (SCurve::set_speed_max; flown).  A "
    "home, or fence, that may be set before the leg is over, or not, is an error (T102).  A warning where "
    "the leg is over before; and where all but the first DO_ item are dropped before a place or a take-off "
    "that the vehicle is at already, without a hold, which is over in the loop after it begins "
    "(AP_Mission::advance_current_nav_cmd; flown), an error where the autopilot is unknown.",
    fix="use NAV_DELAY to wait, or put the item behind the place it should act at",
    instead="--target, or a mission without a leg of no length behind DO_ items",
)


def is_queued(command: int) -> bool:
    """Return whether ArduPilot carries out a command in its queue, beside the flight to the next place."""
    return not is_navigation(command) and command not in JUMPS


class Condition(Value):
    """What holds the queue back."""

    command: Command
    wait_s: float = 0.0
    """Time it takes, a turn to a heading at most. [s]"""
    least_s: float = 0.0
    """Time it takes at least: a vehicle may point to a heading already. [s]"""
    within_m: float | None = None
    """Distance to the place flown to below which it is met, 0: never; ``None``: it is one of time. [m]"""

    def __str__(self) -> str:
        if self.within_m is not None:
            return f"{self.command.name} {quantity.distance(self.within_m)}"
        if self.command == Command.CONDITION_YAW:
            return self.command.name
        return f"{self.command.name} {quantity.duration(self.wait_s)}"


def condition_of(item: MissionItem, turn_deg_s: float = TURN_DEG_S) -> Condition:
    """Return the condition that an item sets; a turn lasts as long as the longest to its heading.

    No faster than the vehicle turns (ArduCopter, ``Mode::AutoYaw::set_fixed_yaw``). [° s⁻¹]
    """
    command = Command(item.command)
    value = max(item.param1 or 0.0, 0.0)
    if command is Command.CONDITION_DISTANCE:
        return Condition(command=command, within_m=value)
    if command is Command.CONDITION_DELAY:
        return Condition(command=command, wait_s=value, least_s=value)
    longest_deg = _WHOLE_TURN_DEG if item.param3 else _HALF_TURN_DEG
    turn_deg = abs(item.param1 or 0.0) if item.param4 else longest_deg
    asked_deg_s = item.param2 if item.param2 is not None and item.param2 > 0.0 else turn_deg_s
    wait_s = turn_deg / min(asked_deg_s, turn_deg_s)
    return Condition(command=command, wait_s=wait_s, least_s=wait_s if item.param4 else 0.0)


def soonest(conditions: Sequence[Condition]) -> tuple[Condition, ...]:
    """Return conditions as they are met where no turn to a heading is left to make."""
    return tuple(replace(one, wait_s=one.least_s) for one in conditions)


class Firing(NamedTuple):
    """Where on its leg an item that conditions hold back is carried out."""

    fraction: float
    """How far along, 1: at its end. [-]"""
    early_s: float = 0.0
    """How long before its end, for which the leg brakes already and which it is flown to as before. [s]"""


class HeldItem(Value):
    """An item that conditions hold back while a leg is flown."""

    visit: int
    """Position in the order items are reached."""
    item: int
    command: Command
    conditions: tuple[Condition, ...]
    """Met one after the other, since the leg began."""
    first_stage: int
    """First and last stage of the leg, as positions in the route's stages."""
    last_stage: int
