"""What faults do to a simulated swarm: who is hit, and whether everyone else is still safe."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.fleet.fleet import FaultKind
from planner.flight.motion.kinematics import STATE_INDEX, STATES, FlightState
from planner.service.fleet_timeline import energy_by_time
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from planner.findings import Finding
    from planner.fleet.fleet import Fault, Fleet
    from planner.fleet.swarm.distances import Approach
    from planner.fleet.swarm.flights import Record
    from planner.flight.budget import BatteryBudget
    from planner.service.swarm import SwarmAgent

SWARM_FAULT_HITS = Rule(
    "S134 swarm-fault-hits",
    Severity.ERROR,
    summary="A fault in a simulated swarm brings an agent too near to another.",
    why="Policies count on every agent doing what it is told, where it says it is.",
    how="Least distance of two in the air, one of which has a fault by then, against horizontal_m of "
    "[separation] and the position errors of both; places are where the agents are, not where they say.",
    fix="keep a larger horizontal_m, or fly so that nobody crosses the way of another",
    instead="--faults without it",
)

SWARM_FAULT_LOST = Rule(
    "S135 swarm-fault-lost",
    Severity.ERROR,
    summary="An agent of a simulated swarm does not get home after its fault.",
    why="A vehicle that flies away, runs empty or lands elsewhere comes down on what is below it.",
    how="It has not landed by the end, its battery is empty before it lands, or it lands farther off its "
    "pad than its position error.",
    fix="give it a failsafe that brings it home, a larger reserve or a second source of its position",
    instead="--faults without it",
)

SWARM_FAULT_UNTRIED = Rule(
    "S136 swarm-fault-untried",
    Severity.ERROR,
    summary="A fault of a simulated swarm begins when its agents are on the ground again.",
    why="What was not tried was not survived.",
    how="at_s of the fault against the landing of every agent it befalls, and against the end of the "
    "simulation.",
    fix="let the fault begin sooner",
    instead="--faults without it",
)


class FaultOutcome(Value):
    """What one fault led to."""

    name: str
    fault: Fault
    agents: tuple[str, ...]
    """Whom it befell; empty: it began too late."""
    hits: tuple[Approach, ...] = ()
    """Where one of them then came too near to another, the nearest first."""
    lost: Mapping[str, str] = {}
    """Those of them that do not get home, and why."""
    below_reserve: tuple[str, ...] = ()
    """Those of them that get home below the reserve of their packs."""


class SwarmFaultReport(Value):
    """What all faults led to."""

    outcomes: tuple[FaultOutcome, ...]
    others: tuple[str, ...]
    """Agents that no fault is of."""
    are_others_safe: bool
    """Whether they come home, apart from everyone and above their reserves."""


def fault_text(fault: Fault) -> str:
    """Return what a fault is, in a few words."""
    who = fault.vehicle or "all"
    since = f"from {quantity.clock(fault.at_s)} on"
    if fault.lasts_s is not None:
        since = f"from {quantity.clock(fault.at_s)} to {quantity.clock(fault.at_s + fault.lasts_s)}"
    what = {
        FaultKind.KEEPS_COMMAND: "keeps its last command",
        FaultKind.LOSES_POSITION: f"errs about its position by {_as_given(fault.drift_m_s)}",
        FaultKind.BATTERY_DROPS: f"has {quantity.percent(fault.charge_left)} of its battery",
        FaultKind.LINK_LATE: f"does {quantity.duration(fault.late_s)} late what it has to do for others",
        FaultKind.GUSTS: f"in gusts of a wind of {_as_given(fault.wind_m_s)}",
    }[fault.kind]
    return f"{who} {what} {since}"


def _as_given(speed_m_s: float | None) -> str:
    """Return a speed of the file: one of 0.25 m/s is no 0.2 m/s."""
    return quantity.ABSENT if speed_m_s is None else f"{speed_m_s:.3g} m/s"


def drop_of(fleet: Fleet, vehicle: str) -> Fault | None:
    """Return what the battery of a vehicle drops by; the first such fault counts."""
    return next(
        (
            one
            for one in fleet.faults.values()
            if one.kind is FaultKind.BATTERY_DROPS and one.vehicle == vehicle
        ),
        None,
    )


def with_drop(agent: SwarmAgent, drop: Fault | None) -> SwarmAgent:
    """Return what an agent did whose battery drops: what it then has left."""
    flight, battery = agent.flight, agent.battery
    if drop is None or flight is None or battery is None:
        return agent
    own_s = max(drop.at_s - agent.start_s, 0.0)
    if own_s >= flight.time_s:
        return agent
    assert drop.charge_left is not None  # the table sees to it
    time_s, used_wh = energy_by_time(flight)
    by_then_wh = float(np.interp(own_s, time_s, used_wh))
    left_wh = battery.usable_wh - by_then_wh
    lost_wh = max(left_wh - drop.charge_left * battery.usable_wh, 0.0)
    is_empty = used_wh > battery.usable_wh - lost_wh
    is_empty &= time_s >= own_s
    empty_s = agent.start_s + float(time_s[np.argmax(is_empty)]) if is_empty.any() else None
    return replace(agent, empty_s=empty_s, battery=_with_less(battery, lost_wh))


def with_gusts(agent: SwarmAgent, record: Record, row: int) -> SwarmAgent:
    """Return what an agent did that flies against gusts: with what that takes more or less.

    By the steady power of the model at the airspeed it then has; where that has no term of airspeed, none.
    """
    flight, against_m_s = agent.flight, record.against_m_s
    if not isinstance(against_m_s, np.ndarray) or flight is None or agent.energy_wh is None:
        return agent
    own_s = record.begin_s - agent.start_s
    is_up = (own_s >= 0.0) & (own_s < flight.time_s)
    if not against_m_s[is_up, row].any():
        return agent
    time_s, segments = own_s[is_up], flight.motion.segments
    more_w = flight.power_of_airspeed_w(time_s, -against_m_s[is_up, row])
    kind = segments.state[
        np.minimum(np.searchsorted(segments.end_s, time_s), len(segments.item) - 1)
    ]
    more_wh = wh_from_j(more_w * np.diff(record.begin_s).mean())
    sums = np.bincount(kind, more_wh, len(STATES))
    by_state = {
        name: energy_wh + float(sums[STATE_INDEX[FlightState(name)]])
        for name, energy_wh in agent.energy_by_state_wh.items()
    }
    gusts_wh = float(more_wh.sum())
    battery = agent.battery
    return replace(
        agent,
        gusts_wh=gusts_wh,
        strongest_gust_m_s=float(np.hypot(*against_m_s[is_up, row].T).max()),
        energy_wh=agent.energy_wh + gusts_wh,
        energy_by_state_wh=by_state,
        battery=None if battery is None else _with_less(battery, gusts_wh),
    )


def _with_less(battery: BatteryBudget, lost_wh: float) -> BatteryBudget:
    """Return a budget with so much less left at the landing; what follows from its curve is not known."""
    if lost_wh == 0.0:
        return battery
    return replace(
        battery,
        used_fraction=battery.used_fraction + lost_wh / battery.capacity_wh,
        margin_wh=battery.margin_wh - lost_wh,
        hover_left_s=None,
        charge_left_fraction=None,
        lowest_voltage_v=None,
        below_reserve_probability=None,
        empty_probability=None,
    )


def judge_faults(
    fleet: Fleet,
    flown: Sequence[SwarmAgent],
    record: Record,
    *,
    vehicles: Sequence[str],
    errors_m: Sequence[float],
    too_near: Sequence[Approach],
) -> SwarmFaultReport | None:
    """Return what faults led to; ``None``: there is none.

    Parameters
    ----------
    fleet : Fleet
        With its faults.
    flown : sequence of SwarmAgent
    record : Record
    vehicles : sequence of str
        Names of the vehicles of the agents.
    errors_m : sequence of float
        How wrong their places may be. [m]
    too_near : sequence of Approach
        Of every two that come too near to each other.
    """
    if not fleet.faults:
        return None
    end_s = float(record.begin_s[-1])
    outcomes = []
    for name, fault in fleet.faults.items():
        rows = [
            row
            for row, (agent, vehicle) in enumerate(zip(flown, vehicles, strict=True))
            if fault.vehicle in {None, vehicle} and fault.at_s < _until_s(agent, end_s)
        ]
        names = tuple(flown[row].name for row in rows)
        lost = {
            flown[row].name: why
            for row in rows
            for why in [_why_lost(fault, flown[row], record, row, errors_m[row])]
            if why
        }
        below_reserve = tuple(
            one.name
            for one in (flown[row] for row in rows)
            if one.name not in lost and one.battery is not None and one.battery.margin_wh < 0.0
        )
        hits = tuple(
            one
            for one in too_near
            if one.time_s >= fault.at_s and (one.first in names or one.second in names)
        )
        outcomes.append(
            FaultOutcome(
                name=name,
                fault=fault,
                agents=names,
                hits=hits,
                lost=lost,
                below_reserve=below_reserve,
            )
        )
    named = {one.vehicle for one in fleet.faults.values()}
    others = [
        one
        for one, vehicle in zip(flown, vehicles, strict=True)
        if not named & {None, vehicle}  # None: of all
    ]
    names_of_others = tuple(one.name for one in others)
    return SwarmFaultReport(
        outcomes=tuple(outcomes),
        others=names_of_others,
        are_others_safe=all(
            one.has_landed and one.battery is not None and one.battery.margin_wh >= 0.0
            for one in others
        )
        and not any(
            near.first in names_of_others or near.second in names_of_others for near in too_near
        ),
    )


def _until_s(agent: SwarmAgent, end_s: float) -> float:
    """Return until when something can befall an agent."""
    return agent.start_s + agent.time_s if agent.has_landed else end_s


def _why_lost(fault: Fault, agent: SwarmAgent, record: Record, row: int, error_m: float) -> str:
    """Return why an agent does not get home; empty: it does, or that is not by this fault."""
    if fault.kind is FaultKind.BATTERY_DROPS and agent.empty_s is not None:
        return f"has an empty battery from {quantity.clock(agent.empty_s)} on"
    if not agent.has_landed:
        if fault.kind is FaultKind.GUSTS:
            return ""
        away_m = math.dist(record.place_m[-1, row], record.place_m[0, row])
        return f"is {quantity.distance(away_m)} from its pad at the end, and has not landed"
    if fault.kind is FaultKind.LOSES_POSITION:
        assert isinstance(record.carried_m, np.ndarray)  # it was carried
        down = min(
            int(np.searchsorted(record.begin_s, agent.start_s + agent.time_s)),
            len(record.begin_s) - 1,
        )
        off_m = float(np.hypot(*record.carried_m[down, row]))
        if off_m > error_m:
            return (
                f"lands {quantity.distance(off_m)} off its pad; its position error is "
                f"{quantity.distance(error_m)}"
            )
    return ""


def fault_findings(
    report: SwarmFaultReport | None, text_of: Callable[[Approach], str]
) -> Iterator[Finding]:
    """Yield what is found of faults."""
    if report is None:
        return
    told: set[Approach] = set()
    for one in report.outcomes:
        what = fault_text(one.fault)
        if not one.agents:
            yield SWARM_FAULT_UNTRIED.finding(
                f"{one.name}: {what}: by then it has landed, or the simulation is over"
            )
        for near in one.hits:
            if near not in told:
                told.add(near)
                yield SWARM_FAULT_HITS.finding(f"{text_of(near)} ({one.name}: {what})")
        for name, why in one.lost.items():
            yield SWARM_FAULT_LOST.finding(f"{name} {why} ({one.name}: {what})")
