"""How many agents a swarm should have: energy of the group and time to the goal against their number."""

from __future__ import annotations

import math
from itertools import islice
from typing import TYPE_CHECKING, Literal

import numpy as np

from planner import quantity
from planner.errors import UsageError
from planner.findings import Rule, Severity
from planner.fleet.fleet import SwarmAlgorithm
from planner.presented import Presented
from planner.service.swarm import GOAL_FRACTIONS, simulate_fleet
from planner.service.swarm_findings import SWARM_UNSEEN
from planner.values import Value, field_names, replace
from planner.workers import done_in_order, end_if_stopped

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

    from planner.findings import Finding
    from planner.fleet.fleet import Fleet
    from planner.fleet.swarm.algorithms import Algorithm
    from planner.fleet.swarm.policies import Policy

SWARM_NUMBERS = Rule(
    "S139 swarm-no-number",
    Severity.ERROR,
    summary="No number of agents that was simulated does what the swarm is to do.",
    why="None of them is a swarm to fly.",
    how="A number does where every run is clear (all home, apart, above their reserves, the area searched "
    "seen), and nine of ten end by latest_s of [operation] or --deadline and reach --goal, where given.",
    fix="see to what makes the runs not clear, or simulate other numbers, another policy, larger packs or a "
    "later deadline",
    instead="other numbers",
)
SWARM_FAULT_ABSENT = Rule(
    "S144 swarm-fault-absent",
    Severity.WARNING,
    summary="A fault of the file is not tried with every number of agents.",
    why="What it leads to in a swarm of so few is not known.",
    how="The vehicle it befalls is not among the first of the file that fly in every run.",
    fix="have it befall one of the first vehicles, ask for more --agents, or leave it out with --faults",
    instead="a fault of a vehicle that flies in every run",
)


class Statistic(Value):
    """A figure of several runs; infinite where a run that counts for it never got there."""

    mean: float
    p10: float
    p90: float

    @classmethod
    def of(cls, figures: Sequence[float]) -> Statistic:
        """Return mean and nearest-rank quantiles: they hold for figures that are infinite, too."""
        p10, p90 = np.quantile(figures, (0.1, 0.9), method="inverted_cdf").tolist()
        return cls(mean=math.fsum(figures) / len(figures), p10=p10, p90=p90)


class SwarmRun(Value):
    """What one simulation comes to; infinite: not known, or never reached."""

    agents: int
    seed: int
    goal: str
    """``area seen`` or ``agents home``."""
    unclear: tuple[str, ...]
    """Codes of what was found for which it is not clear."""
    energy_wh: float
    makespan_s: float
    landed_s: float
    """When the last has landed. [s]"""
    time_to_50_s: float
    time_to_90_s: float
    time_to_100_s: float
    waited_s: float
    stops: float
    findings: tuple[Finding, ...] = ()
    suppressed: tuple[Finding, ...] = ()

    @property
    def is_clear(self) -> bool:
        """Whether all came home, apart and above their reserves, and what they search was seen."""
        return not self.unclear


class AgentsRow(Value):
    """What so many agents take."""

    agents: int
    runs: int
    clear: int
    """Runs in which all came home, apart and above their reserves, and what they search was seen."""
    energy_wh: Statistic
    """Of the group. [Wh]"""
    makespan_s: Statistic
    """From the first take-off to the last landing. [s]"""
    landed_s: Statistic
    """When the last has landed. [s]"""
    time_to_50_s: Statistic
    """Until half of the goal is reached. [s]"""
    time_to_90_s: Statistic
    time_to_100_s: Statistic
    waited_s: Statistic
    """Of all agents together. [s]"""
    stops: Statistic


_FIGURES = field_names(AgentsRow)[3:]


class SwarmNumbers(Presented):
    """What numbers of agents take, and which of them to choose."""

    file: str
    algorithm: str
    policy: str
    seeds: int
    """Runs of each number; one where nothing is drawn."""
    deadline_s: float | None
    """By when all are to have landed. [s]"""
    reach_percent: int | None
    """How much of the goal is to be reached."""
    runs: tuple[SwarmRun, ...]
    findings: tuple[Finding, ...] = ()
    suppressed: tuple[Finding, ...] = ()
    is_cut_short: bool = False
    """Whether runs are missing, as somebody ended it."""

    @property
    def goal(self) -> str:
        """``area seen`` or ``agents home``."""
        return self.runs[0].goal

    @property
    def rows(self) -> tuple[AgentsRow, ...]:
        """A row of each number, the fewest first."""
        rows = []
        for agents in sorted({one.agents for one in self.runs}):
            own = [one for one in self.runs if one.agents == agents]
            figures = {key: Statistic.of([getattr(one, key) for one in own]) for key in _FIGURES}
            clear = sum(one.is_clear for one in own)
            rows.append(AgentsRow(agents=agents, runs=len(own), clear=clear, **figures))
        return tuple(rows)

    @property
    def chosen(self) -> tuple[AgentsRow, ...]:
        """Rows whose runs are all clear; nine of ten in time, and at the goal, where that is asked for.

        None where runs are missing: nobody knows what these would come to.
        """
        if self.is_cut_short:
            return ()
        return tuple(
            row
            for row in self.rows
            if row.clear == row.runs and self._is_in_time(row) and self._is_at_goal(row)
        )

    def _is_in_time(self, row: AgentsRow) -> bool:
        return self.deadline_s is None or row.landed_s.p90 <= self.deadline_s

    def _is_at_goal(self, row: AgentsRow) -> bool:
        if self.reach_percent is None:
            return True
        reached: Statistic = getattr(row, f"time_to_{self.reach_percent}_s")
        return math.isfinite(reached.p90)

    @property
    def least_energy(self) -> AgentsRow | None:
        """The number that takes the least energy on average; ``None``: there is none."""
        known = [row for row in self.chosen if math.isfinite(row.energy_wh.mean)]
        return min(known, key=lambda row: row.energy_wh.mean, default=None)

    @property
    def fewest_in_time(self) -> AgentsRow | None:
        """The fewest that are in time; ``None``: there is no deadline, or none is."""
        return self.chosen[0] if self.chosen and self.deadline_s is not None else None

    def unclear(self, row: AgentsRow) -> tuple[str, ...]:
        """Return the codes of what makes runs of a row not clear."""
        runs = (one for one in self.runs if one.agents == row.agents)
        return tuple(sorted({code for one in runs for code in one.unclear}))

    def marks(self, row: AgentsRow) -> tuple[str, ...]:
        """Return what there is to be said of a row."""
        marks = []
        if row == self.fewest_in_time:
            marks.append("fewest in time")
        if row == self.least_energy:
            marks.append("least energy")
        if row.clear < row.runs:
            marks.append("not clear")
        else:
            marks += ["too late"] * (not self._is_in_time(row))
            marks += ["goal missed"] * (not self._is_at_goal(row))
        return tuple(marks)


class NumbersLimits(Value):
    """When runs end, and what a number of agents has to do to be chosen."""

    until_s: float = 3600.0
    """When each run ends at the latest. [s]"""
    deadline_s: float | None = None
    """By when all are to have landed in nine of ten runs; ``None``: ``latest_s`` of ``[operation]``. [s]"""
    reach_percent: int | None = None
    """How much of the goal, 50, 90 or 100 %, nine of ten runs are to reach."""


_NONE = NumbersLimits()


def simulate_numbers(
    fleet: Fleet,
    agents: Iterable[int],
    *,
    seeds: Iterable[int] = range(20),
    policy: Policy | str = "orca-stop",
    algorithm: Callable[[Fleet, int], Algorithm] | None = None,
    limits: NumbersLimits = _NONE,
    workers: int = 1,
    on_step: Callable[[str], None] | None = None,
) -> SwarmNumbers:
    """Simulate the first vehicles of a fleet as a swarm, so many of them, by several seeds.

    Parameters
    ----------
    fleet : Fleet
        As of `planner.simulate_fleet`; with its table ``[swarm]``.
    agents : iterable of int
        Numbers of agents, each of the first vehicles of the file.
    seeds : iterable of int, optional
        Each number is simulated once by each; by the first alone where nothing is drawn.
    policy : Policy or str, optional
        As of `planner.simulate_fleet`.
    algorithm : callable, optional
        Makes what the swarm does, from the fleet with its vehicles and the seed of a run.
    limits : NumbersLimits, optional
        When runs end, and what a number has to do to be chosen.
    workers : int, optional
        Processes it is made in; the result does not depend on them.
    on_step : callable, optional
        Is told how far it has come.

    Returns
    -------
    SwarmNumbers
        Rows of figures over the seeds, and the numbers to choose.

    Raises
    ------
    UsageError
        If the fleet has no swarm, or not so many vehicles.
    """
    task, numbers = fleet.swarm, sorted(set(agents))
    if task is None or task.algorithm is SwarmAlgorithm.MISSIONS:
        msg = f"{fleet.source}: numbers of agents need a table [swarm] whose algorithm is not missions"
        raise UsageError(msg)
    if not numbers or numbers[0] < 1 or numbers[-1] > len(fleet.vehicles):
        have = quantity.count(len(fleet.vehicles), "vehicle")
        msg = f"{fleet.source}: has {have}: numbers of agents must be from 1 to that"
        raise UsageError(msg)
    is_drawn = algorithm is not None or task.algorithm is SwarmAlgorithm.RANDOM
    is_drawn |= any(one.is_drawn for one in fleet.faults.values())
    draws = [*seeds] if is_drawn else [*seeds][:1]
    asked = [
        _Asked(
            fleet=_of_first(fleet, count),
            seed=seed,
            policy=policy,
            algorithm=algorithm,
            until_s=limits.until_s,
        )
        for count in numbers
        for seed in draws
    ]
    runs: list[SwarmRun] = []
    is_cut_short = False
    with done_in_order(_run, asked, workers=workers) as made:
        try:
            for run in made:
                runs.append(run)
                if on_step is not None:
                    on_step(f"{len(runs)} of {len(asked)} simulations")
        except KeyboardInterrupt:
            if not runs:
                raise
            is_cut_short = True
    found = SwarmNumbers(
        file=fleet.source,
        algorithm=str(task.algorithm) if algorithm is None else algorithm.__name__,
        policy=policy if isinstance(policy, str) else type(policy).__name__,
        seeds=len(draws),
        deadline_s=fleet.operation.latest_s if limits.deadline_s is None else limits.deadline_s,
        reach_percent=limits.reach_percent,
        runs=tuple(runs),
        is_cut_short=is_cut_short,
    )
    none = () if found.chosen else (SWARM_NUMBERS.finding(_why_none(found)),)
    told = (*none, *_untried(fleet, numbers[0]), *_found_in_runs(found, "findings"))
    return replace(found, findings=told, suppressed=tuple(_found_in_runs(found, "suppressed")))


def _found_in_runs(
    numbers: SwarmNumbers, what: Literal["findings", "suppressed"]
) -> Iterator[Finding]:
    """Yield what was found in runs of the numbers to choose, or of all where there is none: each code once.

    As of the most agents, which fly all the vehicles that fewer fly.
    """
    chosen = {row.agents for row in numbers.chosen}
    runs = [one for one in numbers.runs if one.agents in chosen or not chosen]
    most: dict[str, list[SwarmRun]] = {}
    for run in sorted(runs, key=lambda one: (-one.agents, one.seed)):
        for code in dict.fromkeys(one.code for one in getattr(run, what)):
            most.setdefault(code, []).append(run)
    for code, having in most.items():
        agents = quantity.count(having[0].agents, "agent")
        so_many = f"{agents}; {len(having)} of {quantity.count(len(runs), 'run')}"
        for finding in getattr(having[0], what):
            if finding.code == code:
                yield replace(finding, message=f"{finding.message} ({so_many})")


def _untried(fleet: Fleet, fewest: int) -> Iterator[Finding]:
    """Yield faults that befall none of the first vehicles."""
    order = {name: number for number, name in enumerate(fleet.vehicles, start=1)}
    for name, fault in fleet.faults.items():
        if fault.vehicle is not None and order[fault.vehicle] > fewest:
            agents = quantity.count(order[fault.vehicle], "agent")
            yield SWARM_FAULT_ABSENT.finding(
                f"fault {name} befalls {fault.vehicle}: it is not tried with fewer than {agents}"
            )


def _of_first(fleet: Fleet, count: int) -> Fleet:
    """Return a fleet of the first vehicles of another, and what goes wrong with them."""
    vehicles = dict(islice(fleet.vehicles.items(), count))
    faults = {
        name: one
        for name, one in fleet.faults.items()
        if one.vehicle is None or one.vehicle in vehicles
    }
    return replace(fleet, vehicles=vehicles, faults=faults)


def _why_none(numbers: SwarmNumbers) -> str:
    rows = numbers.rows
    span = f"{rows[0].agents} to {rows[-1].agents} agents" if len(rows) > 1 else "the only number"
    if all(row.clear < row.runs for row in rows):
        codes = sorted({code for run in numbers.runs for code in run.unclear})
        return f"{span}: none is clear in every run ({', '.join(codes)})"
    also = []
    if numbers.deadline_s is not None:
        also.append(f"home by {quantity.clock(numbers.deadline_s)}")
    if numbers.reach_percent is not None:
        also.append(f"at {numbers.reach_percent} % of the goal")
    return f"{span}: none is clear in every run and, in nine of ten, {' and '.join(also)}"


class _Asked(Value):
    """One simulation that is to be made."""

    fleet: Fleet
    seed: int
    policy: Policy | str
    algorithm: Callable[[Fleet, int], Algorithm] | None
    until_s: float


def _go_on(_: str) -> None:
    end_if_stopped()


def _run(asked: _Asked) -> SwarmRun:
    """Make a simulation; one that is interrupted counts for nothing."""
    result = simulate_fleet(
        asked.fleet,
        algorithm=None if asked.algorithm is None else asked.algorithm(asked.fleet, asked.seed),
        policy=asked.policy,
        seed=asked.seed,
        until_s=asked.until_s,
        on_step=_go_on,
    )
    if result.is_cut_short:
        raise KeyboardInterrupt
    goal, landed_s = result.goal, result.landed_s
    is_home = math.isfinite(landed_s)
    to_50_s, to_90_s, to_100_s = (
        math.inf if time_s is None else time_s for time_s in map(goal.time_to_s, GOAL_FRACTIONS)
    )
    return SwarmRun(
        agents=len(result.agents),
        seed=asked.seed,
        goal=goal.what,
        unclear=tuple(
            sorted(
                {
                    one.code
                    for one in result.findings
                    if one.severity >= asked.fleet.group_setup.fail_on
                    or one.code == SWARM_UNSEEN.code
                }
            )
        ),
        energy_wh=result.energy_wh if is_home and result.energy_wh is not None else math.inf,
        makespan_s=result.makespan_s if is_home else math.inf,
        landed_s=landed_s,
        time_to_50_s=to_50_s,
        time_to_90_s=to_90_s,
        time_to_100_s=to_100_s,
        waited_s=result.waited_s,
        stops=float(result.stops),
        findings=result.findings,
        suppressed=result.suppressed,
    )
