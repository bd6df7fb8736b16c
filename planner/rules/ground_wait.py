"""Rules on waits on the ground: what they take of the battery, and whether the vehicle stays armed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
from planner.flight.motion.px4.lift_off import noticed_s
from planner.mission.commands import Command
from planner.mission.route.stage import StageKind
from planner.mission.route.walk import WAIT_NOT_COUNTED
from planner.rules.assessment import numbers
from planner.rules.declaration import BUDGET, POWER, PX4, judges
from planner.rules.declaration import PARAMETERS as PARAMETERS_IN_USE
from planner.units import wh_from_j

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.findings import Finding
    from planner.flight.budget import BatteryBudget
    from planner.flight.power import SteadyPower
    from planner.rules.assessment import Assessment
    from planner.vehicle.parameters.resolve import FlightParameters

_WITHOUT_THROTTLE = 2
"""Bit of AUTO_OPTIONS: takes off without a raised throttle."""
_MOST_IDLE = 0.12
"""Power of idling motors over that of hover, at most, where the model has none (models/priors). [-]"""


_MOST_LEFT_OUT = 0.05
"""Of the battery: voltages and failsafes are predicted no better. [-]"""


@judges(WAIT_NOT_COUNTED, needs=(BUDGET, POWER))
def _idles_before_takeoff(
    a: Assessment, budget: BatteryBudget, _power: SteadyPower
) -> Iterator[Finding]:
    """Yield a wait before the take-off during which idling motors take more than can be left out."""
    wait_s, item = _wait_before_takeoff(a)
    if not 0.0 < wait_s < math.inf:
        return
    loads = a.vehicle.loads
    idle_w = (
        _MOST_IDLE * a.flight.hover_near_home_w
        if loads is None
        else loads.ground_idle_w + loads.avionics_w
    )
    idle_wh, left_wh = float(wh_from_j(idle_w * wait_s)), a.left_wh
    share = idle_wh / budget.capacity_wh
    if idle_wh > left_wh or share > _MOST_LEFT_OUT:
        yield a.finding(
            WAIT_NOT_COUNTED,
            f"idling on the ground for {quantity.duration(wait_s)} takes {quantity.energy(idle_wh)}, "
            f"{quantity.percent(share)} of the battery: voltage and failsafes are predicted without it; the "
            f"flight leaves {quantity.energy(max(left_wh, 0.0))} above the reserve",
            item=item,
            severity=Severity.ERROR,
            fix="wait less, or disarmed",
        )


DISARMS_ON_THE_GROUND = Rule(
    "T121 disarms-on-the-ground",
    Severity.ERROR,
    summary="The vehicle disarms while it waits on the ground, and does not take off again.",
    why="It stands where it landed, away from home and with the mission broken off: tried in ArduPilot's "
    "simulation, 'Disarming motors' 10 s after the landing.",
    how="ArduPilot: NAV_DELAY of DISARM_DELAY (10 s) or more, or until a time of day, before a take-off, "
    "first or after a landing (Copter::auto_disarm_check); an error where AUTO_OPTIONS takes off without a "
    "raised throttle, a "
    "warning else: with the stick above zero it stays armed.  PX4: NAV_DELAY before the first take-off, or "
    "COM_SPOOLUP_TIME where that is longer, and the part of MPC_TKO_RAMP_T until thrust is beyond what "
    "counts as landed, of COM_SPOOLUP_TIME and COM_DISARM_PRFLT (11 s) or more; a warning from "
    "COM_DISARM_PRFLT on, which counts from arming in older versions (Commander::handleAutoDisarm).  "
    "Not where the delay of disarming is 0, on PX4 0 or less.",
    fix="wait less, or set the delay of disarming longer than the wait",
    instead="the parameters of --params",
)


_THRUSTS = (("MPC_THR_MIN", 0.12), ("MPC_THR_HOVER", 0.5))
"""What a multicopter gives at least, and hovers with, by PX4's parameters. [-]"""


@judges(DISARMS_ON_THE_GROUND, needs=(PARAMETERS_IN_USE,))
def _disarms_on_the_ground(a: Assessment, _parameters: FlightParameters) -> Iterator[Finding]:
    values, own = numbers(a), PX4.of(a)
    waits = [_wait_before_takeoff(a)]
    stick = ", unless the throttle stick is held above zero"
    if own is None:
        name, after_s = "DISARM_DELAY", values.get("DISARM_DELAY", 10.0)
        sure_s = after_s if int(values.get("AUTO_OPTIONS", 0)) & _WITHOUT_THROTTLE else math.inf
        waits += [
            (stage.hold_s + _wait_for_the_clock_s(a, range(stage.item + 1, then.item)), stage.item)
            for row in a.route.rows_of(StageKind.LAND, StageKind.RETURN)
            for stage, then in pairwise(a.route.stages[row : row + 2])
        ]
    else:  # it counts from arming until the vehicle no longer counts as landed
        name, after_s = "COM_DISARM_PRFLT", values.get("COM_DISARM_PRFLT", 10.0)
        sure_s, stick = after_s + own.spool_up_s, ", where that counts from arming (older versions)"
        thrusts = (values.get(thrust, default) for thrust, default in _THRUSTS)
        waits = [(max(waits[0][0], own.spool_up_s) + noticed_s(own, *thrusts), waits[0][1])]
    longest_s, item = max(waits)
    if not 0.0 < after_s <= longest_s:
        return
    is_certain = sure_s <= longest_s
    lasts = quantity.duration(longest_s) if longest_s < math.inf else "until a time of day"
    within = quantity.duration(sure_s if is_certain else after_s)
    name += " after the spin-up" if is_certain and sure_s > after_s else ""
    yield a.finding(
        DISARMS_ON_THE_GROUND,
        f"waits {lasts} on the ground: the vehicle disarms after {within} ({name}) and does not take off"
        f"{'' if is_certain else stick}",
        item=item,
        severity=None if is_certain else Severity.WARNING,
    )


def _wait_before_takeoff(a: Assessment) -> tuple[float, int]:
    """Return the time of the delays before the first stage, and the last of their items."""
    first, wait_s, last = a.route.stages[0].item, 0.0, 1
    for number in a.route.reached:
        item = a.mission.items[number - 1]
        if number == first:
            break
        if item.command == Command.NAV_DELAY and (item.param1 or 0.0) > 0.0:
            wait_s, last = wait_s + (item.param1 or 0.0), number
        clock_s = _wait_for_the_clock_s(a, [number])
        if clock_s and a.autopilot is not Autopilot.PX4:
            wait_s, last = clock_s, number
    return wait_s, last


def _wait_for_the_clock_s(a: Assessment, numbered: Iterable[int]) -> float:
    """Return the longest that items wait until a time of day: without end, or not at all."""
    reached = set(a.route.reached)
    for number in numbered:
        item = a.mission.items[number - 1]
        clock = (item.param2, item.param3, item.param4)
        if (
            number in reached
            and item.command == Command.NAV_DELAY
            and (item.param1 or 0.0) <= 0.0
            and any(part is not None and part >= 0.0 for part in clock)
        ):
            return math.inf
    return 0.0
