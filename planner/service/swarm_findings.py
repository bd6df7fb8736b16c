"""What is found in the simulation of a swarm."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.findings import Rule, Severity
from planner.fleet.fleet import FaultKind, Fleet, SwarmAlgorithm
from planner.fleet.swarm.distances import closest_of_chords
from planner.fleet.swarm.simulation import AgentPhase
from planner.service.fleet_times import pack_assumed
from planner.service.swarm_faults import fault_findings
from planner.service.swarm_vehicles import LEFT_OUT, VehicleCheck, vehicle_findings

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from planner.findings import Finding
    from planner.fleet.fleet import SwarmTask
    from planner.fleet.swarm.coverage import Coverage
    from planner.fleet.swarm.distances import Kept
    from planner.fleet.swarm.flights import Record
    from planner.service.swarm import SwarmAgent
    from planner.service.swarm_faults import FaultOutcome, SwarmFaultReport
    from planner.service.swarm_vehicles import PadStay
    from planner.vehicle.model import VehicleModel

_UNSEEN = 1e-3
"""Less of an area than this is not shown in percent with a digit after the point. [-]"""
_HELD_APART = (
    "put their pads and places farther apart, or have one start later: the policy gives way already"
)
HEIGHTS_UNKNOWN = "give amsl_m of both pads, or missions with the altitude of their homes"
SWARM_SEPARATION = Rule(
    "S128 swarm-separation",
    Severity.ERROR,
    summary="Two agents of a simulated swarm come too near to each other.",
    why="A policy that only looks at velocities lets vehicles with delay and braking meet: they "
    "stop too late.",
    how="Least distance of any two in the air during the simulation, along the chords of its steps, against "
    "horizontal_m of [separation] and the position errors of both; and of one over another on its pad, where "
    "the plane is no more than above_m or below_m and two height_error_m above that.",
    fix="use a policy that keeps every stop free: --policy stop or orca-stop",
    instead="--policy stop or orca-stop",
)
SWARM_DEADLOCK = Rule(
    "S129 swarm-deadlock",
    Severity.ERROR,
    summary="Agents of a simulated swarm wait for each other for ever.",
    why="Who yields to one that yields to it hovers until its battery is empty.",
    how="For four minutes nobody has come nearer to its goal or landed, though they took turns and the "
    "others cleared the way of one after the other.  Missions as filed stay on their tracks: nobody gets on.",
    fix="give the agents other goals or other tracks; of missions as filed, other starts",
    instead="other goals, tracks or starts",
)
SWARM_UNFINISHED = Rule(
    "S130 swarm-unfinished",
    Severity.ERROR,
    summary="An agent of a simulated swarm is in the air, or has not set out, when the simulation ends.",
    why="What it takes to come home is not counted.",
    how="The simulation ended by --until, or by a deadlock, before all had landed.",
    fix="simulate longer with --until, or give the swarm less to do",
    instead="a longer --until",
)
SWARM_ENERGY = Rule(
    "S131 swarm-energy",
    Severity.ERROR,
    summary="An agent of a simulated swarm lands below its reserve, or nobody knows whether it does.",
    why="Waiting for others takes energy that no mission counts.",
    how="Energy of what the agent flew, by its power model, against what is in its pack less the reserve; "
    "with what wind and air may take that the model does not count, as in a check.  Fires too where the "
    "model has no power, or no battery is known.",
    fix="give it a larger pack, fewer neighbours or another policy, or a model with its power and battery",
    instead="a larger pack, or another policy",
)
SWARM_UNSEEN = Rule(
    "S137 swarm-area-unseen",
    Severity.WARNING,
    summary="The search of a simulated swarm ends before all of the area was seen.",
    why="What nobody flew over was not searched, though all came home.",
    how="Part of the area that no agent in the plane of the swarm came within the sensor radius of, in cells "
    "of a tenth of that radius.  Up to 0.1 % is below what percentages show.",
    fix="give the swarm more agents or larger packs, simulate longer, or set lane_m to at most twice "
    "sensor_radius_m",
)
SWARM_LATE = Rule(
    "S138 swarm-late",
    Severity.ERROR,
    summary="An agent of a simulated swarm lands after the end of the operation, its job or its vehicle.",
    why="Giving way takes time that no mission counts, and then the area is no longer the swarm's.",
    how="Landing of each agent in the simulation against latest_s of [operation] and of its job, and "
    "available_until_s of its vehicle, where they are given.",
    fix="start sooner, fly more agents or fewer, or end the operation later",
)
SWARM_GUSTS = Rule(
    "S140 swarm-gusts-unknown",
    Severity.ERROR,
    summary="An agent of a simulated swarm flies against gusts that its model says nothing of, or without "
    "the wind they belong to.",
    why="What was not counted is not clear: an agent without a term of airspeed lands with the energy of "
    "calm air in any gusts.",
    how="Gusts of [fault] that the agent flies against, in a model without an airspeed term, or, with the "
    "wind, at the highest speed of its [valid_for] or above: whether it holds its place then nobody knows.  "
    "Or wind_m_s of the fault above the wind of [conditions]: the gusts blow, the wind they belong to does "
    "not.",
    fix="give a model with an airspeed term, identified up to such speeds, or simulate less wind",
    instead="a model with an airspeed term",
)
SWARM_TURNED_BACK = Rule(
    "S141 swarm-turned-back",
    Severity.WARNING,
    summary="An agent of a simulated swarm flies home for its battery before it is done.",
    why="What it was to do is left undone, though it lands above its reserve.",
    how="At least every 10 s each agent holds what is left above its reserve against its way home, its stops "
    "and its landing, in the wind and the gusts it expects, and after those that land beside it.",
    fix="give it a larger pack or less to do, or fly more agents",
    instead="a larger pack, or more agents",
)
SWARM_NO_PACK = Rule(
    "S143 swarm-no-pack",
    Severity.ERROR,
    summary="An agent of a simulated swarm has no pack: those of the file are with others, or do not fit.",
    why="Who has no battery does not fly; that of its model says nothing of what is on the shelf.",
    how="Each vehicle in the order of the file takes, of the packs left that fit it, the first of those that "
    "fit the fewest vehicles.  Fires where none is left, and the file has any.",
    fix="add a [pack.NAME] for it, raise count, or fly fewer vehicles",
    instead="a pack for each vehicle",
)
SWARM_CLEARED = Rule(
    "S145 swarm-jam-cleared",
    Severity.WARNING,
    summary="A jam was cleared in place of what a policy of one's own commands.",
    why="Time, energy and what is clear are then not those of the policy alone.",
    how="Where an agent that wants to go on has not for a minute, the simulation commands the others out of "
    "its way, one after the other; --policy stop and orca-stop are meant so.",
    fix="have the policy resolve it: situation.waited_s says for how long each has not got what it wants",
    instead="a policy that leaves nobody waiting for a minute",
)
SWARM_UNCHECKED = Rule(
    "S133 swarm-unchecked",
    Severity.INFO,
    summary="A simulation does not look at everything a check of a mission does.",
    why="What was not looked at is not clear.",
    how="Every simulation.",
    fix="check the missions that are to be flown with mavjoule fleet check",
)


def swarm_findings(
    flown: Sequence[SwarmAgent],
    too_near: Sequence[Kept],
    deadlock: Sequence[str],
    faults: SwarmFaultReport | None,
    checks: Sequence[VehicleCheck],
    *,
    keeps_apart: bool,
) -> list[Finding]:
    """Return what is found of agents and of every two that come nearer than is required."""
    text_of = {one.approach: _too_near_text(one) for one in too_near}
    outcomes = () if faults is None else faults.outcomes
    by_faults = {near for one in outcomes for near in one.hits}
    lost = {name for one in outcomes for name in one.lost}
    there = [one for one in flown if one.name not in lost]
    return [
        *(
            SWARM_SEPARATION.finding(text, fix=_HELD_APART if keeps_apart else None)
            for near, text in text_of.items()
            if near not in by_faults
        ),
        *fault_findings(faults, text_of.__getitem__),
        *_deadlock_findings(deadlock),
        *vehicle_findings(checks),
        *_unfinished(there),
        *_agent_findings(there, {one.name: one.uncounted for one in checks}),
        _unchecked(),
        *_gusts_beyond_models(flown),
        *_gusts_without_wind(flown, outcomes),
    ]


def cleared_findings(policy: str, cleared_s: float) -> Iterator[Finding]:
    """Yield for how long ways were cleared in place of what a policy of one's own commands."""
    if cleared_s > 0.0:
        yield SWARM_CLEARED.finding(
            f"for {quantity.duration(cleared_s)} the way of one was cleared in place of what {policy} "
            "commands"
        )


def _deadlock_findings(members: Sequence[str]) -> Iterator[Finding]:
    if members:
        verb = "wait for each other" if len(members) > 1 else "waits for others"
        yield SWARM_DEADLOCK.finding(f"{', '.join(members)} {verb} and cannot go on")


def _too_near_text(kept: Kept) -> str:
    """Return how near two come to each other, for a finding."""
    near, required = kept.approach, quantity.distance(kept.beside_m)
    away = quantity.beside(near.beside_m, kept.beside_m, quantity.distance)
    at = quantity.duration(near.time_s)
    if kept.above_m is None:
        text = f"{away} apart at {at}; {required} required"
    else:
        above = quantity.beside(near.above_m, kept.above_m, quantity.height)
        text = (
            f"{away} beside and {above} above each other at {at}; {required} beside or "
            f"{quantity.height(kept.above_m)} above required"
        )
    return f"{near.first} and {near.second}: {text}"


def _unfinished(flown: Sequence[SwarmAgent]) -> Iterator[Finding]:
    waits = [one.name for one in flown if one.flight is None]
    up = [one.name for one in flown if not (one.has_landed or one.name in waits)]
    for names, what in ((waits, "taken off"), (up, "landed")):
        if names:
            verb = "has" if len(names) == 1 else "have"
            yield SWARM_UNFINISHED.finding(f"{', '.join(names)} {verb} not {what}")


def _agent_findings(
    flown: Sequence[SwarmAgent], uncounted: Mapping[str, float]
) -> Iterator[Finding]:
    """Yield what is found of each agent by itself.

    ``uncounted`` is what each may take beyond its energy, as its model does not know. [-]
    """
    for one in flown:
        if one.turned_back_s is not None:
            yield SWARM_TURNED_BACK.finding(
                f"{one.name} flies home for its battery from {quantity.clock(one.turned_back_s)} on, before "
                "it is done"
            )
        if one.battery is None:
            if one.flight is None:  # it never took off
                continue
            if _vehicle_of(one).is_power_known:
                message = f"{one.name}: no battery is known: neither a pack nor one in its model"
                fix = "give it a [pack.NAME] with its battery, or a model that has one"
            else:
                message = (
                    f"{one.name}: no power in its model {one.vehicle}: what it takes is not known"
                )
                fix = "give it a model with its power (mavjoule identify, mavjoule vehicle new)"
            yield SWARM_ENERGY.finding(message, fix=fix)
        elif one.battery.margin_wh < 0.0:
            yield SWARM_ENERGY.finding(
                f"{one.name} takes {quantity.energy(one.energy_wh)} and lands "
                f"{quantity.energy(-one.battery.margin_wh)} below the reserve of its pack"
            )
        elif one.energy_wh is not None and uncounted[one.name] > 0.0:
            more_wh = uncounted[one.name] * one.energy_wh
            if one.battery.margin_wh < more_wh < math.inf:  # of no headway at all S142 tells
                yield SWARM_ENERGY.finding(
                    f"{one.name} takes {quantity.energy(one.energy_wh)}, and up to "
                    f"{quantity.energy(more_wh)} more in wind and air that its model does not count: "
                    f"{quantity.energy(one.battery.margin_wh)} are left above its reserve"
                )


def _unchecked() -> Finding:
    *most, last = LEFT_OUT
    return SWARM_UNCHECKED.finding(f"{', '.join(most)} and {last} were not looked at")


def _gusts_beyond_models(flown: Sequence[SwarmAgent]) -> Iterator[Finding]:
    """Yield who flew against gusts that its model says nothing of."""
    blown = [one for one in flown if one.gusts_wh is not None and one.flight is not None]
    names = [one.name for one in blown if not _vehicle_of(one).knows_airspeed]
    if names:
        yield SWARM_GUSTS.finding(
            f"energy of gusts is not counted for {', '.join(names)}: no airspeed term in the model"
        )
    for one in blown:
        known = _vehicle_of(one).valid_for.speed_m_s
        assert one.flight is not None
        wind_m_s = one.flight.power.wind.speed_m_s
        if known is not None and one.strongest_gust_m_s + wind_m_s >= known.high:
            gust, most = quantity.speed(one.strongest_gust_m_s), quantity.speed(known.high)
            wind = f" in a wind of {quantity.speed(wind_m_s)}" if wind_m_s > 0.0 else ""
            yield SWARM_GUSTS.finding(
                f"{one.name} meets a gust of {gust}{wind}; its model was identified up to {most}"
            )


def _gusts_without_wind(
    flown: Sequence[SwarmAgent], outcomes: Sequence[FaultOutcome]
) -> Iterator[Finding]:
    """Yield gusts that belong to more wind than blows."""
    for one in outcomes:
        if one.fault.kind is not FaultKind.GUSTS or one.fault.wind_m_s is None:
            continue
        blows_m_s = min(
            (
                agent.flight.power.wind.speed_m_s
                for agent in flown
                if agent.name in one.agents and agent.flight is not None
            ),
            default=math.inf,
        )
        if blows_m_s < one.fault.wind_m_s:
            mean = quantity.speed(one.fault.wind_m_s)
            yield SWARM_GUSTS.finding(
                f"{one.name}: gusts of a wind of {mean}, and a wind of {quantity.speed(blows_m_s)}: what the "
                "rest of it takes is not counted",
                fix=f'give [conditions] wind = "{mean.removesuffix(" m/s")}@…", and from where it blows',
            )


def overflown_findings(
    fleet: Fleet, stays: Sequence[PadStay], record: Record, plane_m: Mapping[str, float]
) -> Iterator[Finding]:
    """Yield agents that fly over others on the ground with too little height between them.

    ``plane_m`` is the height of the plane above the pad of each, in the order of the record. [m]
    """
    separation = fleet.separation
    if separation is None:
        return
    heights_m = {name: fleet.vehicles[name].heights_m(separation) for name in plane_m}
    error_of = {one.name: one.error_m for one in stays}
    flies = record.phase == AgentPhase.FLIES
    for stay in stays:
        there = (record.begin_s[:-1] < stay.end_s) & (record.begin_s[1:] > stay.begin_s)
        for row, name in enumerate(plane_m):
            above_m, below_m = heights_m[stay.name][0], heights_m[name][1]
            kept_m = max(above_m, below_m) + 2.0 * separation.height_error_m
            looked = np.flatnonzero(there & flies[:, row])
            if name == stay.name or plane_m[stay.name] >= kept_m or not len(looked):
                continue
            away_m = record.place_m[:, row] - stay.place_m
            apart_m, part = closest_of_chords(away_m[looked], away_m[looked + 1])
            least = int(apart_m.argmin())
            step = looked[least]
            required_m = separation.horizontal_m + stay.error_m + error_of[name]
            if apart_m[least] < required_m:
                at_s = record.begin_s[step] + part[least] * record.duration_s[step]
                beside = quantity.beside(float(apart_m[least]), required_m, quantity.distance)
                above = quantity.beside(plane_m[stay.name], kept_m, quantity.height)
                required = (
                    f"{quantity.distance(required_m)} beside or {quantity.height(kept_m)} above"
                )
                yield SWARM_SEPARATION.finding(
                    f"{name}: {beside} beside and {above} above {stay.name} on the ground at "
                    f"{quantity.duration(float(at_s))}; {required} required",
                    fix="fly higher, or put its pad where nobody flies over it",
                )


def _vehicle_of(agent: SwarmAgent) -> VehicleModel:
    assert agent.flight is not None
    return agent.flight.power.vehicle


def unseen_findings(coverage: Coverage | None, task: SwarmTask) -> list[Finding]:
    """Return what a search has left out; one in directions drawn promises nothing."""
    if coverage is None or task.algorithm is not SwarmAlgorithm.SEARCH:
        return []
    unseen = 1.0 - float(np.isfinite(coverage.seen_s).mean())
    if unseen <= _UNSEEN:
        return []
    reach = quantity.height(coverage.area.radius_m)
    message = f"{quantity.percent(unseen)} of the area not seen: no agent came within {reach} of it"
    return [SWARM_UNSEEN.finding(message)]


def late_findings(
    fleet: Fleet, flown: Sequence[tuple[SwarmAgent, str, str | None]]
) -> list[Finding]:
    """Return who is home too late, of agents with their vehicles and jobs.

    Of who is not home there is another finding.
    """
    found = []
    for one, vehicle, job in flown:
        end_s = one.start_s + one.time_s
        limits = [(fleet.operation.latest_s, "the operation ends at")]
        if vehicle in fleet.vehicles:
            until_s = fleet.vehicles[vehicle].available_until_s
            limits.append((until_s, f"{vehicle} is available until"))
        if job is not None:
            limits.append((fleet.jobs[job].latest_s, f"{job} has to be done by"))
        for limit_s, what in limits:
            if one.has_landed and limit_s is not None and end_s > limit_s:
                message = (
                    f"{one.name} lands at {quantity.clock(end_s)}, {what} {quantity.clock(limit_s)} "
                    f"({quantity.duration(end_s - limit_s)} late)"
                )
                found.append((end_s, message))
    return [SWARM_LATE.finding(message) for _, message in sorted(found)]


def pack_findings(fleet: Fleet, unpacked: Sequence[str]) -> Iterator[Finding]:
    """Yield who flies on a pack that is not in the file."""
    if not unpacked:
        return
    if not fleet.packs:
        # of a model without a battery nothing is assumed: S131 says so
        yield from pack_assumed(
            [one for one in unpacked if fleet.vehicles[one].setup.vehicle.battery is not None]
        )
        return
    have = quantity.count(len(fleet.packs), "pack")
    for name in unpacked:
        yield SWARM_NO_PACK.finding(
            f"{name}: no pack is left that fits it: {have} for {len(fleet.vehicles)} vehicles"
        )
