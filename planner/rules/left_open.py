"""Rules about what a mission's file leaves open: where it takes off, how long another maker's drone waits."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.commands import Command
from planner.mission.route.route import HOME_UNKNOWN
from planner.mission.route.walk import ITEM_NOT_MODELLED
from planner.rules.assessment import numbers
from planner.rules.declaration import BUDGET, judges
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.rules.assessment import Assessment

IN_SIGHT_M = 500.0
"""How far from its first place a mission without a home is taken to begin: as far as a small multicopter is
seen. [m]"""

ACTIONS_NOT_COUNTED = Rule(
    "E131 actions-not-counted",
    Severity.WARNING,
    summary="What a drone does at its points takes time that is not predicted.",
    why="DJI's and Litchi's missions stop for photos, recordings and turns; the file says of hovers only how "
    "long they are.",
    how="6 s for each photo, beginning and end of a recording, turn of the gimbal or of the vehicle, at the "
    "power of a hover: DJI's waypoint missions go on with the next action after that "
    "(DJIWaypointActionType).  An error where the margin does not hold it, and where nothing says how long "
    "an action lasts: panoramas, scans, hovers that no point triggers, unknown actions.",
    fix="write the mission as a plan (mavjoule convert), with a hold at each point, and check that",
    instead="a mission with its holds",
)


@judges(ACTIONS_NOT_COUNTED)
def _actions_not_counted(a: Assessment) -> Iterator[Finding]:
    wait_s = a.mission.unstated_wait_s
    if not wait_s > 0.0:
        return
    if math.isinf(wait_s):
        message = "actions at points last nobody knows how long: not counted"
        yield a.finding(ACTIONS_NOT_COUNTED, message, severity=Severity.ERROR)
        return
    needed_wh = wh_from_j(a.flight.hover_near_home_w * wait_s)
    short_wh = needed_wh - _left_wh(a)
    yield a.finding(
        ACTIONS_NOT_COUNTED,
        f"actions at points may take {quantity.duration(wait_s)} and {quantity.energy(needed_wh)} more than "
        "predicted" + f"; {quantity.energy(short_wh)} short of the reserve" * (short_wh > 0.0),
        severity=Severity.ERROR if short_wh > 0.0 else None,
    )


@judges(HOME_UNKNOWN, needs=(BUDGET,))
def _home_unknown(a: Assessment, _budget: BatteryBudget) -> Iterator[Finding]:
    speed_m_s = getattr(a.own_parameters, "cruise_speed_m_s", a.setup.vehicle.default_speed_m_s)
    wait_s = a.mission.unstated_wait_s
    if a.mission.home is not None or not speed_m_s or math.isinf(wait_s):
        return
    hover_w = a.flight.hover_near_home_w
    mean_w = a.totals.mean_power_w or hover_w
    way_wh = wh_from_j(max(hover_w, mean_w) * 2.0 * IN_SIGHT_M / speed_m_s)
    left_wh = _left_wh(a) - wh_from_j(hover_w * wait_s)
    short_wh = way_wh - left_wh
    if not short_wh > 0.0:
        if way_wh > 0.0 and math.isfinite(left_wh):
            farthest = quantity.distance(IN_SIGHT_M * left_wh / way_wh)
            yield a.finding(
                HOME_UNKNOWN,
                f"no home in the file: the battery lasts for a take-off up to {farthest} from the first "
                "place; from farther away it is not checked",
            )
        return
    yield a.finding(
        HOME_UNKNOWN,
        f"no home in the file: from {quantity.distance(IN_SIGHT_M)} away the way there and back takes "
        f"{quantity.energy(way_wh)} more, {quantity.energy(short_wh)} short of the reserve",
        severity=Severity.ERROR,
    )


GRAB, _GRABS_ENABLED = 1, ("GRIP_ENABLE", "PD_GRIPPER_EN")


@judges(ITEM_NOT_MODELLED)
def _picked_up(a: Assessment) -> Iterator[Finding]:
    """Report a load picked up on the way, of which no mass is given."""
    values = numbers(a)
    if quantity.mean_of(a.setup.payload_kg) or any(
        values.get(name) == 0.0 for name in _GRABS_ENABLED
    ):
        return
    first, flying = a.route.stages[0].item, False
    for number in a.route.reached:
        item = a.mission.items[number - 1]
        flying |= number == first
        if flying and item.command == Command.DO_GRIPPER and int(item.param2 or 0.0) == GRAB:
            yield a.finding(
                ITEM_NOT_MODELLED,
                "DO_GRIPPER picks up a load on the way: its mass is not known, and it is carried from there",
                severity=Severity.ERROR,
                item=number,
                fix="give the mass of the load with --payload",
            )
            return


def _left_wh(a: Assessment) -> float:
    """Return the margin of the flight, or of the tightest return, less what is not counted otherwise. [Wh]

    What is short already is that of E101 and E102.
    """
    plan = a.return_plan
    if a.battery is None or a.battery.margin_wh < 0.0:
        return math.inf
    flown_wh, returned_wh = a.uncounted.energies_wh(plan)
    if not math.isfinite(flown_wh):
        return math.inf
    left_wh = a.battery.margin_wh - flown_wh
    if plan is None or plan.margin_wh is None or plan.margin_wh < 0.0:
        return left_wh
    return min(left_wh, plan.margin_wh - returned_wh)
