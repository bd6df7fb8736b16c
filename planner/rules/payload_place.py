"""What keeps ArduPilot from setting down a load, or from climbing back (``PayloadPlace``).

After ``ArduCopter/mode_auto.cpp``; flown with ArduCopter 4.7.0-dev of 31 December 2025 in simulation.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner import quantity
from planner.findings import Rule, Severity
from planner.mission.commands import Command
from planner.mission.route.stage import StageKind
from planner.rules.arming_checks import looking_down
from planner.rules.assessment import numbers
from planner.rules.declaration import ARDUPILOT_TARGET, judges

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.autopilot import Target
    from planner.findings import Finding
    from planner.rules.assessment import Assessment

_TURNED_ROUND = (4, 7)
"""The version whose builds between November 2025 and January 2026 sink where they should climb."""
_RELEASES = 0.0
"""Action of DO_GRIPPER (GRIPPER_ACTIONS)."""

LOAD_NOT_PLACED = Rule(
    "T122 load-not-placed",
    Severity.ERROR,
    summary="The vehicle does not set down its load, or does not climb back from there.",
    why="ArduPilot carries a load on without a message to its pilot's eyes, or skips the place; what the "
    "flight was for does not happen.",
    how="NAV_PAYLOAD_PLACE on ArduPilot, as PayloadPlace::run has it.  It gives up, climbs back and "
    "continues with its load where no ground comes within param1 (0: no limit), counted from where it "
    "begins to descend, and where PLDP_RNG_MAX is set without a rangefinder that looks down.  It continues "
    "at once, without flying there, where its gripper (GRIP_ENABLE 1) is open: after a DO_GRIPPER that "
    "releases or another load set down, without a grab in between (GRIP_AUTOCLOSE 0); a warning where no "
    "parameters say whether it has one.  Development builds of 4.7.0 cannot be checked: those between "
    "ArduPilot's changes 31513 and 31844 (November 2025 to January 2026) fly into the ground instead of "
    "climbing back.",
    fix="give param1 as 0 or more than the height above the ground, or mend what the message names",
    instead="a load that is set down",
)


@judges(LOAD_NOT_PLACED, needs=(ARDUPILOT_TARGET,))
def _load_not_placed(a: Assessment, _target: Target) -> Iterator[Finding]:
    placing = {one.item: one for one in a.route.stages_of(StageKind.SET_DOWN)}
    if not placing:
        return
    first, parameters = next(iter(placing)), a.setup.parameters
    if parameters and parameters.is_development and parameters.version == _TURNED_ROUND:
        yield a.finding(
            LOAD_NOT_PLACED,
            "not checked: development builds of ArduPilot 4.7.0 of December 2025 fly into the ground after "
            "NAV_PAYLOAD_PLACE (ArduPilot #31844), and the version does not say which build this is",
            item=first,
            fix="fly a release",
        )
    if numbers(a).get("PLDP_RNG_MAX", 0.0) > 0.0 and not any(looking_down(numbers(a))):
        yield a.finding(
            LOAD_NOT_PLACED,
            "PLDP_RNG_MAX is set and no rangefinder looks down: the load is not let go at the ground",
            item=first,
            fix="set PLDP_RNG_MAX to 0, or set up the rangefinder",
        )
    for number, stage in placing.items():
        if stage.lowered_m < stage.above_ground_m:
            yield a.finding(
                LOAD_NOT_PLACED,
                f"gives up {quantity.height(stage.gives_up_m)} down, where the ground is "
                f"{quantity.height(stage.above_ground_m)} below: the load is carried on",
                item=number,
            )
    yield from _gripper_open(a)


def _gripper_open(a: Assessment) -> Iterator[Finding]:
    """Yield a finding for every place that an open gripper makes the vehicle skip."""
    values = numbers(a)
    if values and not (values.get("GRIP_ENABLE") and not values.get("GRIP_AUTOCLOSE")):
        return
    severity = None if values else Severity.WARNING
    opened, found = "", set[int]()
    for number in a.route.reached:
        item = a.mission.items[number - 1]
        if item.command == Command.DO_GRIPPER:
            opened = f"DO_GRIPPER in item {number}" if item.param2 == _RELEASES else ""
        elif item.command == Command.NAV_PAYLOAD_PLACE:
            if opened and number not in found:
                found.add(number)
                one = "the gripper" if values else "a gripper"
                yield a.finding(
                    LOAD_NOT_PLACED,
                    f"skipped, without flying there: {opened} leaves {one} open",
                    item=number,
                    severity=severity,
                    fix="grab the load by DO_GRIPPER before the item",
                )
            opened = f"the load set down in item {number}"
