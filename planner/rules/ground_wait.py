"""Rules on waits on the ground: what they take of the battery, and whether the vehicle stays armed."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.findings import Rule, Severity
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
    "warning else: with the stick above zero it stays armed.  PX4: NAV_DELAY before the first take-off, "
    "COM_SPOOLUP_TIME and MPC_TKO_RAMP_T, after which it lifts off, of COM_DISARM_PRFLT (10 s) or more.  "
    "Not where the delay of disarming is 0, on PX4 0 or less.",
    fix="wait less, or set the delay of disarming longer than the wait",
    instead="the parameters of --params",
)


@judges(DISARMS_ON_THE_GROUND, needs=(PARAMETERS_IN_USE,))
def _disarms_on_the_ground(a: Assessment, _parameters: FlightParameters) -> Iterator[Finding]:
    values, is_px4 = numbers(a), PX4.of(a) is not None
    name = "COM_DISARM_PRFLT" if is_px4 else "DISARM_DELAY"
    after_s = values.get(name, 10.0)
    waits = [_wait_before_takeoff(a)]
    if not is_px4:
        waits += [
            (stage.hold_s + _wait_for_the_clock_s(a, range(stage.item + 1, then.item)), stage.item)
            for row in a.route.rows_of(StageKind.LAND, StageKind.RETURN)
            for stage, then in pairwise(a.route.stages[row : row + 2])
        ]
    else:  # it counts from arming until it has lifted off
        own = PX4.of(a)
        assert own is not None
        waits = [(waits[0][0] + own.spool_up_s + own.takeoff_ramp_s, waits[0][1])]
    longest_s, item = max(waits)
    if not 0.0 < after_s <= longest_s:
        return
    is_certain = is_px4 or bool(int(values.get("AUTO_OPTIONS", 0)) & _WITHOUT_THROTTLE)
    lasts = quantity.duration(longest_s) if longest_s < math.inf else "until a time of day"
    stick = "" if is_certain else ", unless the throttle stick is held above zero"
    yield a.finding(
        DISARMS_ON_THE_GROUND,
        f"waits {lasts} on the ground: the vehicle disarms after "
        f"{quantity.duration(after_s)} ({name}) and does not take off{stick}",
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
