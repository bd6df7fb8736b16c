"""A fleet simulated as a swarm: its vehicles move by their models and keep apart by a policy."""

from __future__ import annotations

import math
from collections import defaultdict
from functools import lru_cache, partial
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.fleet.fleet import LATEST_S, FaultKind, Fleet, Separation, SwarmAlgorithm
from planner.fleet.swarm.algorithms import RandomSearch, Waypoints, strips
from planner.fleet.swarm.answers import refuse_without
from planner.fleet.swarm.coverage import Goal, SearchArea, predict_coverage
from planner.fleet.swarm.distances import predict_distances
from planner.fleet.swarm.faults import SwarmFaults, gust_m_s
from planner.fleet.swarm.flights import BRAKE, Record, agent_flight, first_landing, flight_states
from planner.fleet.swarm.policies import POLICIES
from planner.fleet.swarm.simulation import Agent, AgentPhase, Swarm
from planner.fleet.swarm.zones import Capsules, near_pairs
from planner.flight.budget import flight_battery
from planner.flight.motion.kinematics import STATES
from planner.flight.motion.steps import SPEED_TOLERANCE
from planner.flight.pilot import flight_parameters, make_pilot
from planner.flight.prediction import predict_flight
from planner.geo.geodesy import LocalFrame
from planner.mission.route.stage import Route, Stage, StageKind
from planner.physics.response import StepResponse, TransferFunction
from planner.presented import Presented
from planner.quantity import mean_of
from planner.service.fleet import charge_left, initial_charge, setup_with
from planner.service.fleet_times import TIMES_UNKNOWN, pack_assumed
from planner.service.preflight import verdict
from planner.service.separation import uncounted_wait
from planner.service.swarm_dynamics import agent_dynamics
from planner.service.swarm_faults import (
    drop_of,
    fault_findings,
    judge_faults,
    with_drop,
    with_gusts,
)
from planner.service.swarm_missions import fly_as_filed, fly_giving_way
from planner.service.swarm_vehicles import (
    PadStay,
    VehicleCheck,
    check_vehicle,
    ground_findings,
    vehicle_findings,
)
from planner.units import JOULES_PER_WATT_HOUR, wh_from_j
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence

    from planner.arrays import BoolArray, FloatArray
    from planner.findings import Finding
    from planner.fleet.fleet import Fault, FleetVehicle, Pack, SwarmTask
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.coverage import Coverage
    from planner.fleet.swarm.distances import Approach, Distances
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.simulation import Step
    from planner.flight.budget import BatteryBudget
    from planner.flight.prediction import Flight
    from planner.service.preflight import CheckResult
    from planner.service.swarm_faults import SwarmFaultReport
    from planner.service.swarm_missions import FiledFlights
    from planner.setup import Setup
    from planner.vehicle.model import VehicleModel

GOAL_FRACTIONS = (0.5, 0.9, 1.0)
"""Of the goal, whose times are reported. [-]"""
_UNSEEN = 1e-3
"""Less of an area than this is not shown in percent with a digit after the point. [-]"""
_LEAST_M = 1.0
"""The plane is no lower above any pad. [m]"""
_HOUR_S = 3600.0
_BATTERY_S = 10.0
"""How often an agent asks whether its battery still brings it home. [s]"""
_GUSTS = (0.0, 1.0, 2.0, 3.0, 4.0, 5.0)
"""Sizes of gusts whose power is known, in standard deviations. [-]"""
_EXPECTED = 1
"""Of those, what an agent expects on its way home: no less than what gusts take on average. [-]"""
_TURNS = 5.0
"""Ways of a stop that turning home and coming to rest there take the time of: each of the two stops lasts as
long as twice its way, evenly braked, and the first leads away from home. [-]"""

_LEAVES_TRACKS = (
    "missions are flown along their tracks, which orca-stop leaves: choose the policy stop or none"
)

_HELD_APART = (
    "put their pads and places farther apart, or have one start later: the policy gives way already"
)
_HEIGHTS_UNKNOWN = "give amsl_m of both pads, or missions with the altitude of their homes"

SWARM_SEPARATION = Rule(
    "S128 swarm-separation",
    Severity.ERROR,
    summary="Two agents of a simulated swarm come too near to each other.",
    why="A policy that only looks at velocities lets vehicles with delay and braking meet: they "
    "stop too late.",
    how="Least distance of any two in the air during the simulation, along the chords of its steps, against "
    "horizontal_m of [separation] and the position errors of both.",
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
    summary="An agent of a simulated swarm is still in the air when the simulation ends.",
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
    summary="An agent of a simulated swarm flies against gusts that its model says nothing of.",
    why="What was not counted is not clear: an agent without a term of airspeed lands with the energy of "
    "calm air in any gusts.",
    how="Gusts of [fault] that the agent flies against, in a model without an airspeed term, or, with the "
    "wind, at the highest speed of its [valid_for] or above: whether it holds its place then nobody knows.",
    fix="give a model with an airspeed term, identified up to such speeds, or simulate less wind",
    instead="a model with an airspeed term",
)

SWARM_TURNED_BACK = Rule(
    "S141 swarm-turned-back",
    Severity.WARNING,
    summary="An agent of a simulated swarm flies home for its battery before it is done.",
    why="What it was to do is left undone, though it lands above its reserve.",
    how="Every 10 s each agent holds what is left above its reserve against its way home, its stops and its "
    "landing, in the wind and the gusts it expects, and after those that land beside it.",
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

SWARM_UNCHECKED = Rule(
    "S133 swarm-unchecked",
    Severity.INFO,
    summary="A simulation does not look at everything a check of a mission does.",
    why="What was not looked at is not clear.",
    how="Every simulation.",
    fix="check the missions that are to be flown with mavjoule fleet check",
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
    """Distance kept, the errors of both places included. [m]"""
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


class _Body(Value, eq=False):
    """One vehicle ready to be simulated."""

    agent: Agent
    setup: Setup
    vertical: Flight
    height_m: float
    """Of the plane above its home. [m]"""
    stop_m: float
    """Farthest it gets when told to stop at its speed. [m]"""


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
    frame, bodies, unpacked = _bodies(fleet, task)
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
    batteries = _Batteries(bodies, drops, separation_m, gusts_m_s=gusts_m_s, errors_m=swarm.error_m)
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
    distances = predict_distances(record, tuple(one.name for one in agents), separation_m)
    flown = tuple(
        with_drop(
            with_gusts(_flown(record, row, body, float(swarm.turns_back_s[row])), record, row), drop
        )
        for row, (body, drop) in enumerate(zip(bodies, drops, strict=True))
    )
    allowed_m = separation_m + 2.0 * max((one.error_m for one in agents), default=0.0)
    coverage = None if area is None else predict_coverage(record, area)
    too_near = [one for one in distances.nearest if one.distance_m < allowed_m]
    report = judge_faults(
        fleet,
        flown,
        record,
        vehicles=[one.name for one in agents],
        errors_m=[one.error_m for one in agents],
        too_near=too_near,
    )
    found = (
        *_findings(
            flown,
            [(allowed_m, one) for one in too_near],
            swarm.deadlock,
            report,
            checks,
            keeps_apart=kept.keeps_apart,
        ),
        *ground_findings(fleet, _stays(fleet, bodies, flown, record)),
        *_unseen(coverage, task),
        *_late(fleet, [(one, one.name, None) for one in flown]),
        *_pack_findings(fleet, unpacked),
    )
    findings, suppressed = fleet.group_setup.selection.divide(found, file=fleet.source)
    return SwarmResult(
        file=fleet.source,
        fleet=fleet,
        algorithm=str(task.algorithm) if algorithm is None else type(algorithm).__name__,
        policy=policy if isinstance(policy, str) else type(policy).__name__,
        seed=seed,
        agents=flown,
        separation_m=allowed_m,
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
    if policy == "none":
        filed = fly_as_filed(fleet, until_s=latest_s, seed=seed)
    else:

        def on_event(time_s: float) -> None:
            if on_step is not None:
                on_step(f"{quantity.duration(time_s)} simulated")

        filed = fly_giving_way(fleet, until_s=latest_s, seed=seed, on_event=on_event)
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
        errors_m=[fleet.vehicles[one].setup.position_error_m for one in vehicles],
        too_near=[near for _, near in filed.approaches],
    )
    checks = [VehicleCheck(one.name, one.result, is_filed=True) for one in filed.sorties]
    found = _findings(
        agents, filed.approaches, filed.deadlock, report, checks, keeps_apart=policy != "none"
    )
    found += [
        SWARM_SEPARATION.finding(message, fix=_HEIGHTS_UNKNOWN) for message in filed.incomparable
    ]
    found += [SWARM_ENERGY.finding(message) for message in filed.uncharged]
    found += [
        TIMES_UNKNOWN.finding(f"{one.name}: {wait}: no time and no separation of it is known")
        for one in filed.sorties
        if (wait := uncounted_wait(one.result))
    ]
    found += _late(
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
    findings, suppressed = fleet.group_setup.selection.divide(found, file=fleet.source)
    separation_m = 0.0 if fleet.separation is None else fleet.separation.horizontal_m
    errors_m = [one.setup.position_error_m for one in fleet.vehicles.values()]
    return SwarmResult(
        file=fleet.source,
        fleet=fleet,
        algorithm=str(SwarmAlgorithm.MISSIONS),
        policy=str(policy),
        seed=seed,
        agents=agents,
        separation_m=separation_m + 2.0 * max(errors_m),
        distances=filed.distances,
        record=filed.record,
        frame=filed.frame,
        findings=findings,
        suppressed=suppressed,
        faults=report,
        is_cut_short=filed.is_cut_short,
    )


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


def _policy(policy: Policy | str) -> Policy:
    if not isinstance(policy, str):
        refuse_without(policy, "policy", ("commands_m_s", "needs_ticks", "keeps_apart"))
        return policy
    if policy not in POLICIES:
        msg = f"policy must be one of {', '.join(POLICIES)}, got {policy!r}"
        raise UsageError(msg)
    return POLICIES[policy]()


def _bodies(fleet: Fleet, task: SwarmTask) -> tuple[LocalFrame, list[_Body], list[str]]:
    """Return the vehicles ready to fly, in the frame of the first pad, and who has no pack of the file."""
    without = [one.name for one in fleet.vehicles.values() if one.pad is None]
    if without:
        msg = (
            f"{fleet.source}: vehicle.{without[0]}: pad is missing: a swarm takes off from its pads"
        )
        raise UsageError(msg)
    pads = [fleet.pads[one.pad] for one in fleet.vehicles.values() if one.pad is not None]
    frame = LocalFrame(latitude_deg=pads[0].latitude_deg, longitude_deg=pads[0].longitude_deg)
    plane_m = task.height_m
    assert plane_m is not None  # the table sees to it
    taken: set[str] = set()
    bodies, unpacked = [], []
    for vehicle, pad in zip(fleet.vehicles.values(), pads, strict=True):
        pack = _free_pack(fleet, vehicle, taken)
        if pack is None:
            unpacked.append(vehicle.name)
        charge = 1.0 if pack is None else mean_of(initial_charge(pack))
        setup = setup_with(vehicle.setup, pack, None if pack is None else charge, 0.0)
        rise_m = 0.0
        if pads[0].amsl_m is not None and pad.amsl_m is not None:
            rise_m = pads[0].amsl_m - pad.amsl_m
        if plane_m + rise_m < _LEAST_M:
            msg = (
                f"{fleet.source}: swarm.height_m: {quantity.height(plane_m)} above the first pad is "
                f"{quantity.height(plane_m + rise_m)} above pad {pad.name}: give {quantity.height(_LEAST_M)} "
                "or more above each"
            )
            raise UsageError(msg)
        bodies.append(
            _body(
                vehicle,
                setup,
                frame.east_north_m(pad.latitude_deg, pad.longitude_deg),
                height_m=plane_m + rise_m,
                home_amsl_m=pad.amsl_m or 0.0,
            )
        )
    return frame, bodies, unpacked


def _free_pack(fleet: Fleet, vehicle: FleetVehicle, taken: set[str]) -> Pack | None:
    """Return the pack a vehicle takes of those that are left: the first of those that fit the fewest."""
    free = [
        one
        for one in fleet.packs.values()
        if one.name not in taken and (not one.fits or vehicle.name in one.fits)
    ]
    if not free:
        return None
    pack = min(free, key=lambda one: len(one.fits) or math.inf)
    taken.add(pack.name)
    return pack


def _pack_findings(fleet: Fleet, unpacked: Sequence[str]) -> Iterator[Finding]:
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


def _body(
    vehicle: FleetVehicle,
    setup: Setup,
    place_m: tuple[FloatArray, FloatArray],
    *,
    height_m: float,
    home_amsl_m: float,
) -> _Body:
    """Return one vehicle with its way up and down, and how it answers velocities."""
    parameters, _ = flight_parameters(setup)
    pilot = make_pilot(setup, parameters)
    route = Route(
        stages=(
            Stage(StageKind.TAKEOFF, 1, 0.0, 0.0, height_m),
            Stage(StageKind.LAND, 2, 0.0, 0.0, 0.0),
        ),
        frame=LocalFrame(latitude_deg=0.0, longitude_deg=0.0),
        home_amsl_m=home_amsl_m,
    )
    vertical = predict_flight(route, setup, pilot)
    lands = first_landing(vertical.motion)
    durations = vertical.motion.segments.duration_s
    dynamics, speed_m_s = agent_dynamics(setup, pilot)
    settle_s = None
    if math.isinf(dynamics.acceleration_m_s2):
        settle_s = _settle_s(dynamics.response)
    return _Body(
        agent=Agent(
            name=vehicle.name,
            dynamics=dynamics,
            speed_m_s=speed_m_s,
            east_m=float(place_m[0]),
            north_m=float(place_m[1]),
            start_s=vehicle.available_from_s,
            climb_s=float(durations[:lands].sum()),
            landing_s=float(durations[lands:].sum()),
            settle_s=settle_s,
            error_m=setup.position_error_m,
        ),
        setup=setup,
        vertical=vertical,
        height_m=height_m,
        stop_m=float(pilot.farthest_stop_m(np.array([speed_m_s]))[0]),
    )


@lru_cache(maxsize=64)
def _settle_s(response: TransferFunction) -> float:
    """Return how long a stop takes until the legs of a mission count it as one. [s]"""
    return float(StepResponse(system=response).settling_times_s(SPEED_TOLERANCE))


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
    return Waypoints([np.vstack((way, home)) for way, home in zip(ways, home_m, strict=True)])


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


def _unseen(coverage: Coverage | None, task: SwarmTask) -> list[Finding]:
    """Return what a search has left out; one in directions drawn promises nothing."""
    if coverage is None or task.algorithm is not SwarmAlgorithm.SEARCH:
        return []
    unseen = 1.0 - float(np.isfinite(coverage.seen_s).mean())
    if unseen <= _UNSEEN:
        return []
    reach = quantity.height(coverage.area.radius_m)
    message = f"{quantity.percent(unseen)} of the area not seen: no agent came within {reach} of it"
    return [SWARM_UNSEEN.finding(message)]


def _late(fleet: Fleet, flown: Sequence[tuple[SwarmAgent, str, str | None]]) -> list[Finding]:
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


def _vehicle_checks(fleet: Fleet, bodies: Sequence[_Body]) -> list[VehicleCheck]:
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
    fleet: Fleet, bodies: Sequence[_Body], flown: Sequence[SwarmAgent], record: Record
) -> list[PadStay]:
    """Return when agents are on the ground, or so low that they count as on it."""
    low_m = (fleet.separation or Separation(horizontal_m=1.0)).min_nav_alt_m
    stays = []
    for row, (body, one) in enumerate(zip(bodies, flown, strict=True)):
        agent, part = body.agent, min(low_m / body.height_m, 1.0)
        starts_s = math.inf if one.flight is None else one.start_s
        pad = np.array([agent.east_m, agent.north_m])
        up_s = starts_s + part * agent.climb_s
        stays.append(PadStay(one.name, pad, -math.inf, up_s, starts_s, agent.error_m))
        if one.has_landed:
            down_s = one.start_s + one.time_s
            low_s, place_m = down_s - part * agent.landing_s, record.place_m[-1, row]
            stays.append(PadStay(one.name, place_m, low_s, math.inf, down_s, agent.error_m))
    return stays


class _Batteries:
    """What agents know of their batteries: who has to fly home now.

    Each counts its own energy as it goes, by the more of hovering and flying level, and every braking from
    the speed commanded before, into the gusts it meets; the energy of its flight is predicted from the
    whole of it afterwards.  On its way home it expects gusts of their standard deviation all along.  Its
    way home is as long as it would be alone, and as others in the air take to land beside it before: those
    whose pads are as near to its own as their stop zones reach.
    """

    def __init__(
        self,
        bodies: Sequence[_Body],
        drops: Sequence[Fault | None],
        separation_m: float,
        *,
        gusts_m_s: Sequence[float],
        errors_m: Sequence[float] | FloatArray,
    ) -> None:
        self._home_m = np.array([(one.agent.east_m, one.agent.north_m) for one in bodies])
        self._speed = np.array([one.agent.speed_m_s for one in bodies])
        figures = [_figures(one, gust_m_s) for one, gust_m_s in zip(bodies, gusts_m_s, strict=True)]
        self._left_wh, self._power_w, self._brake_wh, self._landing_wh = (
            np.array([getattr(one, name) for one in figures])
            for name in ("left_wh", "power_w", "brake_wh", "landing_wh")
        )
        self._gusts_m_s = np.array(gusts_m_s)
        self._drops = [
            (row, drop.at_s, (drop.charge_left or 0.0) * one.usable_wh - one.reserve_wh)
            for row, (drop, one) in enumerate(zip(drops, figures, strict=True))
            if drop is not None
        ]
        self._landing_s = np.array([one.agent.landing_s for one in bodies])
        self._stop_m = np.array([one.stop_m for one in bodies])
        pads = Capsules.about(self._home_m, self._home_m, self._stop_m + np.array(errors_m))
        self._beside = near_pairs(pads, separation_m)
        self._asked_s = 0.0
        self._was_braking = np.zeros(len(bodies), np.bool_)
        self._asked_m_s = np.zeros((2, len(bodies)))
        """Speeds commanded in the last two steps: the last of a leg is commanded in part."""
        self._returns = np.zeros(len(bodies), np.bool_)

    def take(self, step: Step) -> BoolArray:
        """Take a step; return who has to fly home now. (n,)"""
        flies = step.phase == AgentPhase.FLIES
        state = flight_states(step.velocity_m_s, step.command_m_s, self._speed)
        brakes = flies & (state == BRAKE)
        begins = brakes & ~self._was_braking
        power_w = self._power_w[:, 0]
        if self._gusts_m_s.any():
            met = np.hypot(*step.against_m_s.T) / np.maximum(self._gusts_m_s, 1e-9)
            power_w = np.array(
                [np.interp(one, _GUSTS, row) for one, row in zip(met, self._power_w, strict=True)]
            )
        self._left_wh = self._left_wh - np.where(
            flies, power_w * (step.end_s - step.begin_s) / JOULES_PER_WATT_HOUR, 0.0
        )
        before = self._asked_m_s.max(axis=0) / self._speed
        self._left_wh = self._left_wh - np.where(begins, before * self._brake_wh, 0.0)
        self._was_braking = brakes
        self._asked_m_s = np.stack((self._asked_m_s[1], np.hypot(*step.command_m_s.T)))
        for row, at_s, most_wh in self._drops:
            if step.begin_s <= at_s < step.end_s:
                self._left_wh[row] = min(self._left_wh[row], most_wh)
        if step.end_s >= self._asked_s + _BATTERY_S:
            self._asked_s = step.end_s
            way_m = np.hypot(*(step.place_m - self._home_m).T)
            home_s = (way_m + _TURNS * self._stop_m) / self._speed + _BATTERY_S
            home_s = home_s + self._others_land_s(step)
            needed_wh = (
                self._landing_wh
                + 2.0 * self._brake_wh
                + self._power_w[:, _EXPECTED] * home_s / JOULES_PER_WATT_HOUR
            )
            self._returns = self._returns | (flies & (self._left_wh < needed_wh))
        return self._returns

    def _others_land_s(self, step: Step) -> FloatArray:
        """Return how long those take that may land beside each, one after the other. (n,) [s]"""
        is_up = (step.phase > AgentPhase.WAITS) & (step.phase < AgentPhase.LANDED)
        landing_s = np.where(is_up, self._landing_s, 0.0)
        first, second = self._beside
        count = len(landing_s)
        return np.asarray(
            np.bincount(first, landing_s[second], count)
            + np.bincount(second, landing_s[first], count)
        )


class _Figures(NamedTuple):
    """What an agent counts its battery by."""

    left_wh: float = math.inf
    """For its level flight, above the reserve. [Wh]"""
    power_w: Sequence[float] = (0.0,) * len(_GUSTS)
    """At level flight in gusts of `_GUSTS`. [W]"""
    brake_wh: float = 0.0
    """Of one braking. [Wh]"""
    landing_wh: float = 0.0
    usable_wh: float = math.inf
    """At the take-off. [Wh]"""
    reserve_wh: float = 0.0


def _figures(body: _Body, gusts_m_s: float) -> _Figures:
    flight, setup = body.vertical, body.setup
    segments = wh_from_j(flight.segment_energy_j)
    lands = first_landing(flight.motion)
    budget = flight_battery(flight, setup).budget
    if budget is None:
        return _Figures()
    speeds_m_s = (0.0, body.agent.speed_m_s)
    powers = [
        [_level_power_w(body, one, part * gusts_m_s) for one in speeds_m_s] for part in _GUSTS
    ]
    # a weaker gust takes as much where a stronger one takes less
    power_w = np.maximum.accumulate(np.max(powers, axis=1)).tolist()
    brake = setup.vehicle.responses.brake_power
    brake_wh = 0.0
    if brake is not None:
        joules = -body.agent.speed_m_s * float(brake.unit_step.integral(brake.window_s))
        brake_wh = max(float(wh_from_j(joules)), 0.0)
    return _Figures(
        left_wh=budget.above_reserve_wh - float(segments[:lands].sum()),
        power_w=power_w,
        brake_wh=brake_wh,
        landing_wh=float(segments[lands:].sum()),
        usable_wh=budget.usable_wh,
        reserve_wh=budget.reserve_wh,
    )


def _level_power_w(body: _Body, speed_m_s: float, gust_m_s: float) -> float:
    """Return the power of steady level flight in the plane, into the wind and a gust. [W]"""
    from planner.flight.motion.kinematics import STATE_INDEX, FlightState, KinematicState

    wind = body.setup.wind
    ahead = np.array([-wind.east_m_s, -wind.north_m_s])
    size = float(np.hypot(*ahead))
    unit = ahead / size if size else np.array([1.0, 0.0])
    one = np.ones(1)
    state = KinematicState.of(
        (0.0 * one, 0.0 * one, body.height_m * one),
        (*((speed_m_s + gust_m_s) * axis * one for axis in unit), 0.0 * one),
    )
    kind = np.array([STATE_INDEX[FlightState.CRUISE if speed_m_s else FlightState.HOVER]])
    return float(body.vertical.power.power_w(state, kind, np.array([speed_m_s]))[0])


def _flown(record: Record, row: int, body: _Body, turns_back_s: float) -> SwarmAgent:
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


def _findings(
    flown: Sequence[SwarmAgent],
    too_near: Sequence[tuple[float, Approach]],
    deadlock: Sequence[str],
    faults: SwarmFaultReport | None,
    checks: Sequence[VehicleCheck],
    *,
    keeps_apart: bool,
) -> list[Finding]:
    """Return what is found of agents and of every two that come nearer than is required."""
    text_of = {near: _too_near_text(near, required_m) for required_m, near in too_near}
    outcomes = () if faults is None else faults.outcomes
    by_faults = {near for one in outcomes for near in one.hits}
    lost = {name for one in outcomes for name in one.lost}
    return [
        *(
            SWARM_SEPARATION.finding(text, fix=_HELD_APART if keeps_apart else None)
            for near, text in text_of.items()
            if near not in by_faults
        ),
        *fault_findings(faults, text_of.__getitem__),
        *_deadlock_findings(deadlock),
        *vehicle_findings(checks),
        *_agent_findings(
            [one for one in flown if one.name not in lost],
            {one.name: one.uncounted for one in checks},
        ),
        _unchecked(),
        *_gusts_beyond_models(flown),
    ]


def _deadlock_findings(members: Sequence[str]) -> Iterator[Finding]:
    if members:
        verb = "wait for each other" if len(members) > 1 else "waits for others"
        yield SWARM_DEADLOCK.finding(f"{', '.join(members)} {verb} and cannot go on")


def _too_near_text(near: Approach, required_m: float) -> str:
    return (
        f"{near.first} and {near.second}: "
        f"{quantity.beside(near.distance_m, required_m, quantity.distance)} apart at "
        f"{quantity.duration(near.time_s)}; {quantity.distance(required_m)} required"
    )


def _agent_findings(
    flown: Sequence[SwarmAgent], uncounted: Mapping[str, float]
) -> Iterator[Finding]:
    """Yield what is found of each agent by itself.

    ``uncounted`` is what each may take beyond its energy, as its model does not know. [-]
    """
    up = [one.name for one in flown if not one.has_landed]
    if up:
        verb = "has" if len(up) == 1 else "have"
        yield SWARM_UNFINISHED.finding(f"{', '.join(up)} {verb} not landed")
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
                    f"{quantity.energy(more_wh)} more that its model does not count: "
                    f"{quantity.energy(one.battery.margin_wh)} are left above its reserve"
                )


def _unchecked() -> Finding:
    message = (
        "fences, terrain, voltages, returns, the autopilot's failsafes and how far the conditions may be off "
        "were not looked at"
    )
    return SWARM_UNCHECKED.finding(message)


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


def _vehicle_of(agent: SwarmAgent) -> VehicleModel:
    assert agent.flight is not None
    return agent.flight.power.vehicle
