"""A fleet simulated as a swarm: its vehicles move by their models and keep apart by a policy."""

from __future__ import annotations

import math
from collections import defaultdict
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.findings import Severity
from planner.fleet.fleet import LATEST_S, FaultKind, Fleet, Separation, SwarmAlgorithm
from planner.fleet.swarm.algorithms import Lanes, RandomSearch, Waypoints, strips
from planner.fleet.swarm.answers import refuse_without
from planner.fleet.swarm.coverage import Goal, SearchArea, predict_coverage
from planner.fleet.swarm.distances import Kept, predict_distances
from planner.fleet.swarm.faults import SwarmFaults, gust_m_s
from planner.fleet.swarm.flights import Record, agent_flight
from planner.fleet.swarm.policies import POLICIES
from planner.fleet.swarm.simulation import Agent, AgentPhase, Swarm
from planner.flight.budget import flight_battery
from planner.flight.motion.kinematics import STATES
from planner.presented import Presented
from planner.quantity import mean_of
from planner.service.fleet import charge_left
from planner.service.fleet_times import (
    TIMES_UNKNOWN,
    pack_assumed,
    pack_clashes,
    pad_clashes,
    too_early,
    unsuited,
    vehicle_clashes,
)
from planner.service.preflight import verdict
from planner.service.separation import uncounted_wait
from planner.service.swarm_batteries import SwarmBatteries
from planner.service.swarm_bodies import make_bodies
from planner.service.swarm_faults import drop_of, judge_faults, with_drop, with_gusts
from planner.service.swarm_findings import (
    HEIGHTS_UNKNOWN,
    SWARM_ENERGY,
    SWARM_SEPARATION,
    cleared_findings,
    late_findings,
    overflown_findings,
    pack_findings,
    swarm_findings,
    unseen_findings,
)
from planner.service.swarm_missions import flown_together, fly_giving_way, planned_sorties
from planner.service.swarm_vehicles import PadStay, VehicleCheck, check_vehicle, ground_findings
from planner.units import wh_from_j
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.findings import Finding
    from planner.fleet.fleet import Fault, SwarmTask
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.coverage import Coverage
    from planner.fleet.swarm.distances import Approach, Distances
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.simulation import Step
    from planner.flight.budget import BatteryBudget
    from planner.flight.prediction import Flight
    from planner.geo.geodesy import LocalFrame
    from planner.service.fleet import FlownSortie
    from planner.service.preflight import CheckResult
    from planner.service.swarm_bodies import SwarmBody
    from planner.service.swarm_faults import SwarmFaultReport
    from planner.service.swarm_missions import FiledFlights
    from planner.setup import Setup

GOAL_FRACTIONS = (0.5, 0.9, 1.0)
"""Of the goal, whose times are reported. [-]"""
_HOUR_S = 3600.0
_OFF_LANE = 0.05
"""Of the width of a lane: farther beside it an agent misses what it is to see. [-]"""
_LATER_S = 0.5
"""Later than predicted by less is not told. [s]"""
_ROUNDING_M = 1e-6
"""By so much may places be rounded: agents that keep their separation exactly come no nearer. [m]"""

_LEAVES_TRACKS = (
    "missions are flown along their tracks, which orca-stop leaves: choose the policy stop or none"
)


class SwarmAgent(Value, eq=False):
    """What one agent of a simulated swarm did."""

    name: str
    vehicle: str
    flight: Flight | None
    """What it flew; ``None``: it never took off."""
    start_s: float
    """When it took off. [s]"""
    has_landed: bool
    stops: int
    """How often it had to brake for others."""
    waited_s: float
    """For how long it did not get what it wanted. [s]"""
    energy_wh: float | None
    """``None``: not known. [Wh]"""
    energy_by_state_wh: Mapping[str, float]
    battery: BatteryBudget | None = None
    charge: float = 1.0
    """State of charge of its pack at the take-off. [-]"""
    empty_s: float | None = None
    """When a battery that drops is empty before the landing. [s]"""
    gusts_wh: float | None = None
    """What flying against gusts took of its energy; ``None``: it met none. [Wh]"""
    strongest_gust_m_s: float = 0.0
    """That it flew against. [m s⁻¹]"""
    turned_back_s: float | None = None
    """When it flew home for its battery before it was done; ``None``: it did not. [s]"""

    @property
    def time_s(self) -> float:
        """In the air. [s]"""
        return 0.0 if self.flight is None else self.flight.time_s

    @property
    def charge_left(self) -> float | None:
        """State of charge of its pack at the end; ``None``: not known. [-]"""
        return charge_left(self.battery, self.charge)

    @property
    def distance_m(self) -> float:
        """Horizontal distance flown. [m]"""
        return 0.0 if self.flight is None else float(self.flight.motion.segments.distance_m.sum())


class SwarmResult(Presented, eq=False):
    """What the simulation of a swarm comes to."""

    file: str
    fleet: Fleet
    algorithm: str
    policy: str
    seed: int
    agents: tuple[SwarmAgent, ...]
    separation_m: float
    """Most that any two keep, the errors of both places included. [m]"""
    distances: Distances
    record: Record
    frame: LocalFrame
    """In which places are given."""
    findings: tuple[Finding, ...]
    suppressed: tuple[Finding, ...] = ()
    coverage: Coverage | None = None
    """What of the area was seen when; ``None``: there is no area, or nobody knows how far its agents see."""
    faults: SwarmFaultReport | None = None
    """What faults led to; ``None``: there is none."""
    is_cut_short: bool = False
    """Whether the simulation was interrupted."""

    @property
    def is_clear(self) -> bool:
        """Whether all came home, apart and above their reserves; no verdict on flying it."""
        return verdict(self.findings, self.fleet.group_setup.fail_on) == "go"

    @property
    def energy_wh(self) -> float | None:
        """Of all agents; ``None``: of one it is not known. [Wh]"""
        known = [one.energy_wh for one in self.agents if one.energy_wh is not None]
        return sum(known) if len(known) == len(self.agents) else None

    @property
    def makespan_s(self) -> float:
        """From the first take-off to the last landing. [s]"""
        ends = [one.start_s + one.time_s for one in self.agents if one.flight is not None]
        return max(ends) - min(one.start_s for one in self.agents) if ends else 0.0

    @property
    def landed_s(self) -> float:
        """When the last has landed; infinite: not all have. [s]"""
        ends = [one.start_s + one.time_s if one.has_landed else math.inf for one in self.agents]
        return max(ends, default=0.0)

    @property
    def distance_m(self) -> float:
        """Flown by all agents, horizontally. [m]"""
        return sum(one.distance_m for one in self.agents)

    @property
    def stops(self) -> int:
        """How often agents had to brake for others."""
        return sum(one.stops for one in self.agents)

    @property
    def waited_s(self) -> float:
        """For how long agents together did not get what they wanted. [s]"""
        return sum(one.waited_s for one in self.agents)

    @property
    def energy_by_state_wh(self) -> Mapping[str, float]:
        """Of all agents whose energy is known. [Wh]"""
        sums: defaultdict[str, float] = defaultdict(float)
        for one in self.agents:
            for state, energy_wh in one.energy_by_state_wh.items():
                sums[state] += energy_wh
        return sums

    @property
    def goal(self) -> Goal:
        """The area seen, where there is one, or else all agents home; times count from the beginning."""
        if self.coverage is not None:
            return Goal.of("area seen", self.coverage.seen_s)
        ends = [one.start_s + one.time_s if one.has_landed else math.inf for one in self.agents]
        return Goal.of("agents home", np.array(ends))

    def closest(self, name: str) -> Approach | None:
        """Return where an agent came nearest to another; ``None``: to none within five separations."""
        return next((a for a in self.distances.nearest if name in (a.first, a.second)), None)


def simulate_fleet(
    fleet: Fleet,
    *,
    algorithm: Algorithm | None = None,
    policy: Policy | str | None = None,
    seed: int = 0,
    until_s: float | None = None,
    on_step: Callable[[str], None] | None = None,
) -> SwarmResult:
    """Simulate the vehicles of a fleet as a swarm.

    Parameters
    ----------
    fleet : Fleet
        As `planner.read_fleet` returns it, with a table ``[swarm]`` and a pad for each vehicle, or with
        sorties, which then fly their missions as filed.
    algorithm : Algorithm, optional
        What the swarm does; by default what the file says.
    policy : Policy or str, optional
        How its agents avoid each other: ``none``, ``stop``, ``orca-stop``, or one of your own; by default
        ``orca-stop``, and ``stop`` of missions as filed.
    seed : int, optional
        Of everything that is drawn.
    until_s : float, optional
        When the simulation ends at the latest; by default after an hour, and of missions as filed after
        the last. [s]
    on_step : callable, optional
        Is told how far it has come.

    Returns
    -------
    SwarmResult
        Whether it is clear, agents with their flights and energy, distances, the record of all steps.

    Raises
    ------
    UsageError
        If the fleet has nothing to simulate, or a name is that of no policy.
    """
    if until_s is not None and not (isinstance(until_s, int | float) and until_s > 0.0):
        msg = f"until_s must be above 0 seconds, got {until_s!r}"
        raise UsageError(msg)
    task = fleet.swarm
    if algorithm is None and (task is None or task.algorithm is SwarmAlgorithm.MISSIONS):
        return _simulate_missions(fleet, policy or "stop", seed, until_s, on_step)
    if task is None or task.height_m is None:
        msg = f"{fleet.source}: an algorithm of your own needs a table [swarm] with height_m"
        raise UsageError(msg)
    if algorithm is not None:
        refuse_without(algorithm, "algorithm", ("goals_m",))
    policy = policy or "orca-stop"
    frame, bodies, unpacked = make_bodies(fleet, task)
    agents = [body.agent for body in bodies]
    checks = _vehicle_checks(fleet, bodies)
    separation_m = 0.0 if fleet.separation is None else fleet.separation.horizontal_m
    kept = _policy(policy)
    moving = tuple(one for one in fleet.faults.values() if one.kind is not FaultKind.BATTERY_DROPS)
    faults = None
    if moving:
        faults = partial(
            SwarmFaults,
            moving,
            tuple(one.name for one in agents),
            height_m=task.height_m,
            seed=seed,
        )
    area = _search_area(task, frame)
    drops = [drop_of(fleet, one.name) for one in agents]
    gusts_m_s = [_gusts_of_m_s(moving, one.name, task.height_m) for one in agents]
    swarm = Swarm(
        agents,
        _algorithm(task, frame, agents, seed) if algorithm is None else algorithm,
        kept,
        separation_m=separation_m,
        until_s=_HOUR_S if until_s is None else until_s,
        faults=faults,
    )
    batteries = SwarmBatteries(
        bodies,
        drops,
        separation_m,
        gusts_m_s=gusts_m_s,
        errors_m=swarm.error_m,
        # of no headway at all S142 tells
        uncounted=[one.uncounted if math.isfinite(one.uncounted) else 0.0 for one in checks],
    )
    steps: list[Step] = []
    is_cut_short = False
    try:
        for step in swarm.run(batteries):
            steps.append(step)
            if on_step is not None:
                on_step(f"{quantity.duration(step.end_s)} simulated")
    except KeyboardInterrupt:
        if not steps:
            raise
        is_cut_short = True
    record = Record.of(steps, swarm)
    errors_m = {one.name: one.error_m for one in agents}
    distances = predict_distances(record, tuple(errors_m), fleet.widest_separation_m)
    flown = tuple(
        with_drop(
            with_gusts(_flown(record, row, body, float(swarm.turns_back_s[row])), record, row), drop
        )
        for row, (body, drop) in enumerate(zip(bodies, drops, strict=True))
    )
    coverage = None if area is None else predict_coverage(record, area)
    too_near = [
        Kept(near, required_m)
        for near in distances.nearest
        for required_m in [separation_m + errors_m[near.first] + errors_m[near.second]]
        if near.distance_m < required_m - _ROUNDING_M
    ]
    report = judge_faults(
        fleet,
        flown,
        record,
        vehicles=[one.name for one in agents],
        errors_m=[*errors_m.values()],
        too_near=[one.approach for one in too_near],
    )
    stays = _stays(fleet, bodies, flown, record)
    found = (
        *swarm_findings(
            flown, too_near, swarm.deadlock, report, checks, keeps_apart=kept.keeps_apart
        ),
        *ground_findings(fleet, stays),
        *overflown_findings(fleet, stays, record, {one.agent.name: one.height_m for one in bodies}),
        *unseen_findings(coverage, task),
        *late_findings(fleet, [(one, one.name, None) for one in flown]),
        *pack_findings(fleet, unpacked),
        *(
            ()
            if isinstance(policy, str)
            else cleared_findings(type(policy).__name__, swarm.cleared_s)
        ),
    )
    findings, suppressed = fleet.group_setup.selection.divide(found, file=fleet.source)
    return SwarmResult(
        file=fleet.source,
        fleet=fleet,
        algorithm=str(task.algorithm) if algorithm is None else type(algorithm).__name__,
        policy=policy if isinstance(policy, str) else type(policy).__name__,
        seed=seed,
        agents=flown,
        separation_m=fleet.widest_separation_m,
        distances=distances,
        record=record,
        frame=frame,
        findings=findings,
        suppressed=suppressed,
        coverage=coverage,
        faults=report,
        is_cut_short=is_cut_short,
    )


def _gusts_of_m_s(faults: Sequence[Fault], vehicle: str, height_m: float) -> float:
    """Return the standard deviation of the gusts that a vehicle is to meet; the last such fault counts."""
    winds = [
        one.wind_m_s
        for one in faults
        if one.kind is FaultKind.GUSTS and one.vehicle in {None, vehicle}
    ]
    return gust_m_s(winds[-1] or 0.0, height_m)[0] if winds else 0.0


def _simulate_missions(
    fleet: Fleet,
    policy: Policy | str,
    seed: int,
    until_s: float | None,
    on_step: Callable[[str], None] | None,
) -> SwarmResult:
    """Return what becomes of the sorties of a fleet, each of which flies its mission."""
    if policy not in {"none", "stop"}:
        _policy(policy)
        raise UsageError(_LEAVES_TRACKS)
    latest_s = LATEST_S if until_s is None else until_s
    planned = planned_sorties(fleet)
    if policy == "none":
        filed = flown_together(fleet, planned, until_s=latest_s, is_planned=True, seed=seed)
    else:

        def on_event(time_s: float) -> None:
            if on_step is not None:
                on_step(f"{quantity.duration(time_s)} simulated")

        giving_way = partial(fly_giving_way, fleet, until_s=latest_s, seed=seed, on_event=on_event)
        filed = giving_way(planned)
    agents, report, found = _judge_missions(fleet, filed, keeps_apart=policy != "none")
    if policy != "none":
        found += [
            TIMES_UNKNOWN.finding(
                f"{one.name} {late}: when it flies is not known",
                fix="give the parameters of the vehicle, or the target that its mission is for",
            )
            for one in planned
            if (late := _flies_later(one))
        ]
    flies_own = any(len(one.ways) > 1 for one in planned)
    if policy != "none" and flies_own and not filed.is_cut_short:
        _, _, others = _judge_missions(
            fleet, giving_way([one.as_its_own_flies for one in planned]), keeps_apart=True
        )
        known = {one.code for one in found if one.severity is Severity.ERROR}
        found += [
            replace(one, message=f"{one.message} (as its own autopilot flies)")
            for one in others
            if one.severity is Severity.ERROR and one.code not in known
        ]
    findings, suppressed = fleet.group_setup.selection.divide(found, file=fleet.source)
    return SwarmResult(
        file=fleet.source,
        fleet=fleet,
        algorithm=str(SwarmAlgorithm.MISSIONS),
        policy=str(policy),
        seed=seed,
        agents=agents,
        separation_m=fleet.widest_separation_m,
        distances=filed.distances,
        record=filed.record,
        frame=filed.frame,
        findings=findings,
        suppressed=suppressed,
        faults=report,
        is_cut_short=filed.is_cut_short,
    )


def _judge_missions(
    fleet: Fleet, filed: FiledFlights, *, keeps_apart: bool
) -> tuple[tuple[SwarmAgent, ...], SwarmFaultReport | None, list[Finding]]:
    """Return what the sorties of a fleet did, what faults did to them, and what is found of that."""
    vehicles = [one.sortie.vehicle for one in filed.sorties]
    agents = tuple(
        with_drop(with_gusts(_sortie_flown(filed, row), filed.record, row), drop_of(fleet, vehicle))
        for row, vehicle in enumerate(vehicles)
    )
    report = judge_faults(
        fleet,
        agents,
        filed.record,
        vehicles=vehicles,
        errors_m=[fleet.vehicles[one].setup.position_margin_m for one in vehicles],
        too_near=[one.approach for one in filed.too_near],
    )
    checks = [VehicleCheck(one.name, one.result, is_filed=True) for one in filed.sorties]
    found = swarm_findings(
        agents, filed.too_near, filed.deadlock, report, checks, keeps_apart=keeps_apart
    )
    found += [
        SWARM_SEPARATION.finding(message, fix=HEIGHTS_UNKNOWN) for message in filed.incomparable
    ]
    found += [SWARM_ENERGY.finding(message) for message in filed.uncharged]
    found += [
        TIMES_UNKNOWN.finding(f"{one.name}: {wait}: no time and no separation of it is known")
        for one in filed.sorties
        if (wait := uncounted_wait(one.result))
    ]
    gone = [
        one for one, agent in zip(filed.sorties, agents, strict=True) if agent.flight is not None
    ]
    for clashes in (pack_clashes, vehicle_clashes, pad_clashes, unsuited, too_early):
        found += [one.finding for one in clashes(fleet, gone)]
    found += ground_findings(fleet, filed.stays)
    found += late_findings(
        fleet,
        [
            (agent, one.sortie.vehicle, one.sortie.job)
            for agent, one in zip(agents, filed.sorties, strict=True)
        ],
    )
    without = [
        one.name
        for one, agent in zip(filed.sorties, agents, strict=True)
        if one.sortie.pack is None and agent.battery is not None
    ]
    found += pack_assumed(without)
    return agents, report, found


def _sortie_flown(filed: FiledFlights, row: int) -> SwarmAgent:
    """Return what the agent of one sortie did."""
    one = filed.sorties[row]
    assessment = one.assessment
    assert assessment is not None  # it flies
    has_started = one.start_s <= filed.record.begin_s[-1]
    return SwarmAgent(
        name=one.name,
        vehicle=assessment.vehicle.name,
        flight=assessment.flight if has_started else None,
        start_s=one.start_s,
        has_landed=bool(filed.record.has_landed[row]),
        stops=filed.stops[row],
        waited_s=sum(one.end_s - one.begin_s for one in filed.waits[row]),
        energy_wh=one.energy_wh if has_started else 0.0,
        energy_by_state_wh=_energy_by_state_wh(assessment.flight, assessment.setup)
        if has_started
        else {},
        battery=assessment.battery,
        charge=mean_of(assessment.setup.charge),
    )


def _energy_by_state_wh(flight: Flight, setup: Setup) -> dict[str, float]:
    """Return the energy of a flight by its states; empty: it is not known. [Wh]"""
    if not setup.vehicle.is_power_known:
        return {}
    energies = wh_from_j(flight.segment_energy_j)
    sums = np.bincount(flight.motion.segments.state, energies, len(STATES))
    return {str(state): float(one) for state, one in zip(STATES, sums, strict=True) if one}


def _flies_later(one: FlownSortie) -> str:
    """Return that a flight is later than simulated; empty: by little, or it is simulated so too."""
    if one.assessment is None or len(one.ways) > 1:
        return ""
    later_s = float(one.assessment.lateness.passed_s.max(initial=0.0))
    if later_s < _LATER_S:
        return ""
    return f"may be up to {quantity.duration(later_s)} later than predicted (E108)"


def _policy(policy: Policy | str) -> Policy:
    if not isinstance(policy, str):
        refuse_without(policy, "policy", ("commands_m_s", "needs_ticks", "keeps_apart"))
        return policy
    if policy not in POLICIES:
        msg = f"policy must be one of {', '.join(POLICIES)}, got {policy!r}"
        raise UsageError(msg)
    return POLICIES[policy]()


def _algorithm(task: SwarmTask, frame: LocalFrame, agents: Sequence[Agent], seed: int) -> Algorithm:
    """Return what the file has the swarm do."""
    home_m = np.array([(one.east_m, one.north_m) for one in agents])
    count = len(agents)
    if task.algorithm is SwarmAlgorithm.EXCHANGE:
        return Waypoints([home_m[(row + (count + 1) // 2) % count][None] for row in range(count)])
    north_deg, east_deg = task.north_deg, task.east_deg
    assert north_deg is not None  # the table sees to it
    assert east_deg is not None
    high_m = np.array(frame.east_north_m(north_deg, east_deg), np.float64)
    if task.algorithm is SwarmAlgorithm.FORMATION:
        return Waypoints([np.array([one + high_m, one]) for one in home_m], together=True)
    south_deg, west_deg = task.south_deg, task.west_deg
    assert south_deg is not None
    assert west_deg is not None
    low_m = np.array(frame.east_north_m(south_deg, west_deg), np.float64)
    if task.algorithm is SwarmAlgorithm.RANDOM:
        assert task.search_s is not None
        return RandomSearch(low_m, high_m, home_m=home_m, ends_s=task.search_s, seed=seed)
    assert task.lane_m is not None
    ways = strips(low_m, high_m, lane_m=task.lane_m, agents=count)
    return Lanes(ways, home_m=home_m, off_m=_OFF_LANE * task.lane_m)


def _search_area(task: SwarmTask, frame: LocalFrame) -> SearchArea | None:
    """Return the area and how far agents see; ``None``: one of the two is not given."""
    west, south, east, north = task.west_deg, task.south_deg, task.east_deg, task.north_deg
    radius_m = task.sensor_radius_m
    if radius_m is None and task.lane_m is not None:
        radius_m = 0.5 * task.lane_m
    if west is None or south is None or east is None or north is None or radius_m is None:
        return None
    (west_m, south_m), (east_m, north_m) = (
        map(float, frame.east_north_m(*corner)) for corner in ((south, west), (north, east))
    )
    area = SearchArea(
        west_m=west_m, south_m=south_m, east_m=east_m, north_m=north_m, radius_m=radius_m
    )
    area.refuse_too_fine()
    return area


def _vehicle_checks(fleet: Fleet, bodies: Sequence[SwarmBody]) -> list[VehicleCheck]:
    """Return what a check finds of each agent; those that are alike are checked once."""
    known: list[tuple[tuple[Setup, float, float | None], CheckResult]] = []
    checks = []
    for body in bodies:
        name, speed_m_s = body.agent.name, body.agent.speed_m_s
        pad = fleet.pads[fleet.vehicles[name].pad or ""]
        what = body.setup, body.height_m, pad.amsl_m
        result = next((made for of, made in known if of == what), None)
        if result is None:
            result = check_vehicle(body.setup, pad, height_m=body.height_m, speed_m_s=speed_m_s)
            known.append((what, result))
        checks.append(VehicleCheck(name, result))
    return checks


def _stays(
    fleet: Fleet, bodies: Sequence[SwarmBody], flown: Sequence[SwarmAgent], record: Record
) -> list[PadStay]:
    """Return when agents are on the ground, or so low that they count as on it."""
    low_m = (fleet.separation or Separation(horizontal_m=1.0)).min_nav_alt_m
    stays = []
    for row, (body, one) in enumerate(zip(bodies, flown, strict=True)):
        agent, part = body.agent, min(low_m / body.height_m, 1.0)
        starts_s = math.inf if one.flight is None else one.start_s
        pad = np.array([agent.east_m, agent.north_m])
        up_s = starts_s + part * agent.climb_s
        stays.append(PadStay(one.name, one.name, pad, -math.inf, up_s, starts_s, agent.error_m))
        if one.has_landed:
            down_s = one.start_s + one.time_s
            low_s, place_m = down_s - part * agent.landing_s, record.place_m[-1, row]
            stays.append(
                PadStay(one.name, one.name, place_m, low_s, math.inf, down_s, agent.error_m)
            )
    return stays


def _flown(record: Record, row: int, body: SwarmBody, turns_back_s: float) -> SwarmAgent:
    """Return what one agent did; ``turns_back_s`` is infinite of one that did not turn back."""
    flight = agent_flight(
        record, row, vertical=body.vertical, speed_m_s=body.agent.speed_m_s, height_m=body.height_m
    )
    waits = record.waits[:, row]
    started = np.flatnonzero(record.phase[:, row] != AgentPhase.WAITS)
    energy_wh, by_state, budget = None, {}, None
    if flight is not None and body.setup.vehicle.is_power_known:
        energy_wh = float(wh_from_j(flight.segment_energy_j).sum())
        by_state = _energy_by_state_wh(flight, body.setup)
        budget = flight_battery(flight, body.setup).budget
    return SwarmAgent(
        name=body.agent.name,
        vehicle=body.setup.vehicle.name,
        flight=flight,
        start_s=float(record.begin_s[started[0]]) if len(started) else body.agent.start_s,
        has_landed=bool(record.has_landed[row]),
        stops=int(np.count_nonzero(np.diff(np.append(False, waits).astype(np.int8)) == 1)),
        waited_s=float(record.duration_s[waits].sum()),
        energy_wh=energy_wh,
        energy_by_state_wh=by_state,
        battery=budget,
        charge=mean_of(body.setup.charge),
        turned_back_s=turns_back_s if math.isfinite(turns_back_s) else None,
    )
