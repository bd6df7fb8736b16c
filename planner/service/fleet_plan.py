"""A fleet planned: jobs divided into sorties, sorties given to vehicles and packs, all of them clear.

What a sortie takes is its check, on the vehicle and the pack that may fly it; when two of them may start
follows from their predicted flights; the rest is `planner.fleet.schedule`.  What the check of the whole
fleet still finds between two sorties, as on returns, is forbidden and planned again.
"""

from __future__ import annotations

import math
from glob import escape
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

from planner import quantity
from planner.errors import FleetPlanError, UsageError
from planner.files import is_among, make_output_folder, write_output_files
from planner.findings import Severity
from planner.fleet.schedule import EFFORT_S, Objective, Patience, best_schedule, smallest_conflict
from planner.fleet.separation import predict_conflicts
from planner.fleet.writer import fleet_file_text
from planner.mission.formats.exchange import read_bytes
from planner.presented import Presented
from planner.selection import FileIgnore, exemptions_of
from planner.service.fleet import check_fleet
from planner.service.fleet_meetings import Meetings
from planner.service.fleet_separation import Encounters, fleet_spacing, members
from planner.service.fleet_ways import Ways, listed
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping, Sequence

    from planner.fleet.fleet import Fleet
    from planner.fleet.schedule import Departure, Means, Schedule
    from planner.service.fleet import FleetResult, FlownSortie
    from planner.service.fleet_meetings import Closed
    from planner.service.fleet_ways import Candidate

PLAN_FILE = "fleet.toml"
_MOST_REPAIRS = 60
"""Times a plan is made again without what the check of the fleet found."""
_ROW_REPAIRS = 8
"""The same for a row of the table of numbers of vehicles, which else says that its returns are not clear."""
_HURRIED = 0.1
"""Share of the effort for schedules in which two may still come too near to each other."""
_MOST_DOUBLED = 12
_SAME = 1e-3
"""Amounts no farther apart are equal: the schedule counts in thousandths. [s, Wh]"""
_FORBIDDEN_S = 5.0
"""About a difference of starts that the check found wrong; twice as much each time it is found again. [s]"""


class PlanRow(Value):
    """What the operation takes with so many vehicles."""

    vehicles: int
    """As many may fly, or fewer."""
    sorties: int
    energy_wh: float
    makespan_s: float
    packs: int
    largest_sortie_wh: float
    is_in_time: bool
    """Whether all have landed by the end of the operation."""
    is_clear: bool
    """Whether the check of the whole fleet finds no two in each other's way, on returns too."""
    gap: float
    """How far the makespan may be above the least there is. [-]"""
    least_energy_wh: float | None = None
    """The least that so many vehicles or fewer take where they need not hurry, all landed by the end of the
    operation; ``None``: not known. [Wh]"""


class FleetPlan(Presented):
    """A fleet with its sorties."""

    fleet: Fleet
    result: FleetResult
    """The check of it."""
    missions: Mapping[str, str]
    """Text of each file that the sorties fly parts of jobs from, by path."""
    minimize: Objective
    schedule: Schedule
    rows: tuple[PlanRow, ...]
    """For one vehicle, two, and so on; those that cannot be flown are left out."""
    cut_short: str = ""
    """Why nothing better was looked for; empty: it was."""

    @property
    def gap(self) -> float:
        """How far it may be above the least there is. [-]"""
        return self.schedule.gap(self.minimize)

    @property
    def amount_text(self) -> str:
        """How much it has of what there should be least of."""
        amount = self.schedule.amount(self.minimize)
        match self.minimize:
            case Objective.ENERGY:
                return quantity.energy(amount)
            case Objective.MAKESPAN:
                return quantity.duration(amount)
            case Objective.VEHICLES:
                return quantity.count(int(amount), "vehicle")
            case Objective.BATTERIES:
                return quantity.count(int(amount), "pack")

    def marks(self, row: PlanRow) -> tuple[str, ...]:
        """Return what a number of vehicles is: the fewest in time, the one of least energy."""
        if not row.is_in_time:
            return ("too late",)
        if not row.is_clear:
            return ("returns not clear",)
        in_time = [one for one in self.rows if one.is_in_time and one.is_clear]
        found = ["fewest in time"] if row is in_time[0] else []
        known = [one for one in in_time if one.least_energy_wh is not None]
        least_wh = min((one.least_energy_wh or 0.0 for one in known), default=0.0)
        first = next(
            (one for one in known if (one.least_energy_wh or 0.0) <= least_wh + _SAME), None
        )
        return (*found, "least energy") if row is first else (*found,)


def plan_fleet(
    fleet: Fleet,
    *,
    minimize: Objective | str = Objective.MAKESPAN,
    folder: Path | str = "",
    effort_s: float = EFFORT_S,
    patience: Patience | None = None,
    on_step: Callable[[str], None] = lambda _: None,
) -> FleetPlan:
    """Return a plan of who flies which part of which job when, on which pack.

    Parameters
    ----------
    fleet : Fleet
        As `planner.read_fleet` returns it; its own sorties are not looked at.
    minimize : str
        ``energy``, ``makespan``, ``vehicles`` or ``batteries``.
    folder : Path or str
        Where the parts are to be written, for their names.
    effort_s : float
        For each schedule, in the deterministic time of the solver. [s]
    patience : Patience, optional
        What may cut the search short; the plan then says so.
    on_step : callable
        Called with how far the plan is, in words.

    Returns
    -------
    FleetPlan
        Nothing is written yet: `write_plan` does.  ``plan.result`` is a go.

    Raises
    ------
    FleetPlanError
        If there is no plan, with the sorties that are in each other's way.
    UsageError
        If a value is unusable, or OR-Tools is not installed.
    """
    try:
        objective = Objective(minimize)
    except ValueError as error:
        msg = f"minimize must be one of {', '.join(Objective)}: got {minimize!r}"
        raise UsageError(msg) from error
    if not fleet.jobs:
        msg = f"{fleet.source}: no jobs: there is nothing to plan"
        raise FleetPlanError(msg)
    patience = patience or Patience()
    planning = _Planning(fleet, Ways(fleet, Path(folder)), effort_s, patience)
    plan = planning.whole(objective)
    on_step(f"planned: {plan.amount_text}")
    return replace(plan, rows=planning.rows(on_step), cut_short=patience.cut_short)


def write_plan(plan: FleetPlan, folder: Path | str, *, force: bool = False) -> Path:
    """Write a plan into a folder: ``fleet.toml``, and the mission of each sortie; return the file.

    A sortie that flies the whole of its job has the job's own file, byte for byte.

    Parameters
    ----------
    plan : FleetPlan
        As `plan_fleet` returns it for this folder.
    folder : Path or str
        Made where it is not there.
    force : bool
        Write over files that are there already.

    Raises
    ------
    UsageError
        If there are such files already, or the fleet file itself would be written over.
    OutputError
        If a file cannot be written: then none is.
    FleetFileError
        If the fleet file cannot be read any more.
    MissionFileError
        If the mission of a job cannot.
    """
    folder = Path(folder)
    file = folder / PLAN_FILE
    if is_among(file, [plan.fleet.source]):
        msg = f"{file} is the fleet that is planned: give another folder"
        raise UsageError(msg)
    texts: dict[Path, str | bytes] = {Path(path): text for path, text in plan.missions.items()}
    sorties, ignores = {}, []
    for name, sortie in plan.fleet.sorties.items():
        path = sortie.mission
        if path is None:
            job = Path(plan.fleet.jobs[sortie.job].mission)
            path = str(folder / f"{name}{job.suffix}")
            texts[Path(path)] = read_bytes(job)
        sorties[name] = replace(sortie, mission=path)
        # what was not reported of the file that was judged is not of the one that is written for it
        judged = Path(plan.fleet.mission_of(sortie))
        ignores += [
            FileIgnore(folder=folder, pattern=escape(Path(path).name), exemption=one)
            for one in exemptions_of(plan.fleet.file_ignores, judged)
        ]
    written = replace(plan.fleet, sorties=sorties, file_ignores=tuple(ignores))
    texts[file] = fleet_file_text(written, folder)
    if not force and (there := [path for path in texts if path.exists()]):
        msg = f"{there[0]} exists already: give another folder, or --force"
        raise UsageError(msg)
    jobs = (job.mission for job in plan.fleet.jobs.values())
    read = [*plan.fleet.setting_files, *jobs]
    if own := [path for path in texts if is_among(path, read)]:
        msg = f"{own[0]} is read for this plan: give another folder"
        raise UsageError(msg)
    make_output_folder(folder, holding="the plan")
    write_output_files(texts)
    return file


class _Planning:
    """The plans of one fleet for several numbers of vehicles, which share every check."""

    def __init__(self, fleet: Fleet, ways: Ways, effort_s: float, patience: Patience) -> None:
        self._fleet = fleet
        self._ways = ways
        self._effort_s = effort_s
        self._patience = patience
        self._is_hurried = False
        """Whether two may still come too near to each other: then the best is not looked for."""
        self._divisions: dict[tuple[int | None, ...], Candidate] = {}
        self._by_few: dict[tuple[Candidate, int], Candidate] = {}
        """Candidates without vehicles that so many do without."""
        self._in_layers: dict[Candidate, Candidate] = {}
        self._encounters = Encounters()
        self._meetings: dict[object, Meetings] = {}
        self._again: dict[object, int] = {}
        """How often nothing was known of a difference of starts that was found wrong, by flights."""
        self._schedules: dict[object, tuple[Closed, Schedule | None]] = {}
        """The last of each candidate, with the differences of starts it has not."""

    def rows(self, on_step: Callable[[str], None]) -> tuple[PlanRow, ...]:
        """Return what one vehicle takes, two, and so on, without those that take the same as fewer.

        Of a search that is cut short no more than the first there is.
        """
        rows: list[PlanRow] = []
        for count in range(1, len(self._fleet.vehicles) + 1):
            if rows and self._patience.cut_short:
                break
            if count > max(len(one.tasks) for one in self._candidates(count)):
                continue  # no division has a sortie for each: it is what fewer take
            row = self._row(count)
            on_step(f"planned with {quantity.count(count, 'vehicle')}")
            if row is not None:
                rows.append(row)
        least: Schedule | None = None
        for place, row in reversed([*enumerate(rows)]):
            if self._patience.cut_short or not row.is_in_time:
                break
            if least is None or least.vehicles > row.vehicles:
                least = self._least_energy(row.vehicles)
                on_step(f"planned for energy with {quantity.count(row.vehicles, 'vehicle')}")
            if least is not None:
                rows[place] = replace(row, least_energy_wh=least.energy_wh)
        return tuple(
            row
            for before, row in zip([None, *rows], rows, strict=False)
            if before is None or row != replace(before, vehicles=row.vehicles)
        )

    def _candidates(self, vehicles: int) -> list[Candidate]:
        """Return the divisions of the jobs that are tried for so many vehicles."""
        counts = self._ways.counts(vehicles)
        for one in counts:
            if one not in self._divisions:
                self._divisions[one] = self._ways.candidate(one)
        return [self._divisions[one] for one in counts]

    def _few(self, candidates: Sequence[Candidate], vehicles: int) -> list[Candidate]:
        """Return candidates without the ways of vehicles that so many do without."""
        for one in candidates:
            if (one, vehicles) not in self._by_few:
                self._by_few[one, vehicles] = self._ways.by_few(one, vehicles)
        return [self._by_few[one, vehicles] for one in candidates]

    def _all_candidates(self) -> list[Candidate]:
        """Return those for every number of vehicles; the first only, where the search is cut short."""
        found: dict[Candidate, None] = {}
        for count in range(1, len(self._fleet.vehicles) + 1):
            if found and self._patience.cut_short:
                break
            found |= dict.fromkeys(self._candidates(count))
        return [*found]

    def _row(self, vehicles: int) -> PlanRow | None:
        """Return what takes so many vehicles least time."""
        endless = replace(self._ways.means(), latest_s=math.inf)
        found = self._judged(
            Objective.MAKESPAN,
            self._few(self._candidates(vehicles), vehicles),
            endless,
            vehicles=vehicles,
            repairs=_ROW_REPAIRS,
        )
        if found is None:
            return None
        schedule, candidate, result = found
        latest_s = self._fleet.operation.latest_s
        largest_wh = max(
            candidate.tasks[one.task].options[one.option].energy_wh for one in schedule.departures
        )
        return PlanRow(
            vehicles=vehicles,
            sorties=len(schedule.departures),
            energy_wh=schedule.energy_wh,
            makespan_s=schedule.makespan_s,
            packs=schedule.packs,
            largest_sortie_wh=largest_wh,
            is_in_time=latest_s is None or schedule.makespan_s <= latest_s,
            is_clear=not self._at_fault(candidate, result),
            gap=schedule.gap(Objective.MAKESPAN),
        )

    def _least_energy(self, vehicles: int) -> Schedule | None:
        """Return what takes so many vehicles or fewer least energy, in time; ``None``: none is known."""
        found = self._judged(
            Objective.ENERGY,
            self._few(self._all_candidates(), vehicles),
            self._ways.means(),
            vehicles=vehicles,
            repairs=_ROW_REPAIRS,
        )
        if found is None:
            return None
        schedule, candidate, result = found
        return None if self._at_fault(candidate, result) else schedule

    def whole(self, minimize: Objective) -> FleetPlan:
        """Return the plan with least of something, and nothing wrong with the fleet as a whole."""
        candidates, means = self._all_candidates(), self._ways.means()
        found = self._judged(minimize, candidates, means, repairs=_MOST_REPAIRS)
        if found is None:
            raise FleetPlanError(self._why_not(candidates, means))
        schedule, _, result = found
        planned = result.fleet
        if result.verdict != "go":
            fail_on = self._fleet.group_setup.fail_on
            wrong = max(
                (one for one in result.all_findings if one.severity >= fail_on),
                key=lambda one: one.severity,
            )
            msg = f"{self._fleet.source}: no plan was found that is a go: {wrong.code} {wrong.message}"
            raise FleetPlanError(msg)
        flown = (one.mission for one in planned.sorties.values())
        return FleetPlan(
            fleet=planned,
            result=result,
            missions={path: self._ways.texts[path] for path in flown if path is not None},
            minimize=minimize,
            schedule=schedule,
            rows=(),
        )

    def _judged(
        self,
        minimize: Objective,
        candidates: Sequence[Candidate],
        means: Means,
        *,
        vehicles: int | None = None,
        repairs: int,
    ) -> tuple[Schedule, Candidate, FleetResult] | None:
        """Return the best schedule of several divisions of the jobs, with the check of the fleet.

        What that finds between two sorties is forbidden and planned again, so many times at most: with
        little effort until nothing is found, then with all of it.
        """
        clear = None
        self._is_hurried = True
        for _ in range(repairs):
            found = self._best(candidates, minimize, means, vehicles)
            if found is None:
                return None
            schedule, candidate = found
            planned = self._planned(candidate, schedule)
            if vehicles is not None:  # a row of the table: what it survives is not asked
                operation = replace(planned.operation, must_survive=())
                planned = replace(planned, operation=operation)
            result = check_fleet(planned, checks=self._ways.checks)
            last = schedule, candidate, result
            if not self._forbidden(candidate, schedule, result):
                clear = last
                if schedule.is_best or not self._is_hurried:
                    break
                self._is_hurried = False
        return clear or last

    def _best(
        self,
        candidates: Sequence[Candidate],
        minimize: Objective,
        means: Means,
        vehicles: int | None,
    ) -> tuple[Schedule, Candidate] | None:
        """Return the best schedule of several divisions, without those that can have no better one."""
        flying = len(self._fleet.vehicles) if vehicles is None else vehicles
        found: tuple[Schedule, Candidate] | None = None
        by_least = {one: one.least(minimize, flying) for one in candidates}
        for candidate, least in sorted(by_least.items(), key=lambda one: one[1]):
            if found is not None and least > found[0].amount(minimize) + _SAME:
                break
            other = self._cleared(candidate, minimize, means, vehicles)
            if other is not None and (
                found is None or _rank(other[0], minimize) < _rank(found[0], minimize)
            ):
                found = other
        return found

    def _cleared(
        self, candidate: Candidate, minimize: Objective, means: Means, vehicles: int | None
    ) -> tuple[Schedule, Candidate] | None:
        """Return the best schedule in which no two come too near to each other in the air.

        In layers only where something is better then: a wait on the ground costs nothing.
        """
        if candidate in self._in_layers:
            candidate.learn(self._in_layers[candidate])
        below = self._apart(candidate, minimize, means, vehicles)
        if self._fleet.layers is None or not candidate.met:
            return None if below is None else (below, candidate)
        free = self._schedule(candidate, {}, minimize, means, vehicles)
        if free is None:
            return None
        if below is not None and below.amount(minimize) <= free.amount(minimize) + _SAME:
            return below, candidate
        layered = self._layered(candidate)
        above = self._apart(layered, minimize, means, vehicles, or_else=below)
        found = [(one, of) for one, of in ((below, candidate), (above, layered)) if one is not None]
        return min(found, key=lambda one: _rank(one[0], minimize), default=None)

    def _layered(self, candidate: Candidate) -> Candidate:
        """Return a candidate in which those that come too near to others may be lifted to layers."""
        layered = self._in_layers.get(candidate, candidate)
        layered.learn(candidate)
        if not layered.met <= {task for task, _ in layered.lifts}:
            self._in_layers[candidate] = layered = self._ways.lifted(layered)
        return layered

    def _apart(
        self,
        candidate: Candidate,
        minimize: Objective,
        means: Means,
        vehicles: int | None,
        *,
        or_else: Schedule | None = None,
    ) -> Schedule | None:
        """Return the best schedule of a candidate in which no two come too near to each other.

        What they must not have is looked for where a schedule without it has it: what is best without
        more of it is best.  With something else to fly the search may be cut short: ``None`` then, too.
        """
        while or_else is None or not self._patience.cut_short:
            schedule = self._schedule(candidate, candidate.conflicts, minimize, means, vehicles)
            if schedule is None or not self._too_near(candidate, schedule):
                return schedule
        return None

    def _schedule(
        self,
        candidate: Candidate,
        conflicts: Closed,
        minimize: Objective,
        means: Means,
        vehicles: int | None,
    ) -> Schedule | None:
        if vehicles is None:
            vehicles = len(self._fleet.vehicles)
        at = candidate, minimize, means.latest_s, vehicles, self._is_hurried, bool(conflicts)
        if at not in self._schedules or self._schedules[at][0] != conflicts:
            self._schedules[at] = (
                {**conflicts},
                best_schedule(
                    candidate.tasks,
                    means,
                    conflicts,
                    minimize=minimize,
                    most_vehicles=vehicles,
                    effort_s=self._effort_s * (_HURRIED if self._is_hurried else 1.0),
                    patience=self._patience,
                ),
            )
        return self._schedules[at][1]

    def _flown(self, candidate: Candidate, schedule: Schedule) -> list[FlownSortie]:
        """Return every sortie as a schedule flies it."""
        found = []
        for one in schedule.departures:
            way = candidate.flights[one.task][one.option]
            pack = None
            if one.pack is not None:
                group, number = one.pack
                pack = self._ways.groups[group][number].name
            sortie = replace(
                way.sortie, name=candidate.parts[one.task].name, start_s=one.start_s, pack=pack
            )
            found.append(replace(way, sortie=sortie))
        return found

    def _planned(self, candidate: Candidate, schedule: Schedule) -> Fleet:
        """Return the fleet with its sorties in the order of their starts."""
        flown = sorted(self._flown(candidate, schedule), key=lambda one: (one.start_s, one.name))
        return replace(self._fleet, sorties={one.name: one.sortie for one in flown})

    def _too_near(self, candidate: Candidate, schedule: Schedule) -> bool:
        """Return whether two come too near to each other in the air; if so, forbid their starts."""
        separation, flown = self._fleet.separation, self._flown(candidate, schedule)
        if separation is None or len({one.sortie.vehicle for one in flown}) < 2:
            return False
        together = members(self._fleet, separation, flown, self._encounters)
        near = [*predict_conflicts(together, fleet_spacing(separation))]
        for one in near:
            pair = (schedule.departures[one.first], schedule.departures[one.second])
            self._forbid(candidate, *pair, with_returns=False)
        return bool(near)

    def _forbidden(self, candidate: Candidate, schedule: Schedule, result: FleetResult) -> bool:
        """Return whether the check of the fleet found two sorties at fault; if so, forbid their starts."""
        pairs = self._at_fault(candidate, result)
        for first, second in pairs:
            pair = (schedule.departures[first], schedule.departures[second])
            self._forbid(candidate, *pair, with_returns=True)
        return bool(pairs)

    @staticmethod
    def _at_fault(candidate: Candidate, result: FleetResult) -> list[tuple[int, ...]]:
        """Return the pairs of sorties that the check of the fleet found in each other's way."""
        places = {part.name: number for number, part in enumerate(candidate.parts)}
        return sorted(
            {
                tuple(sorted(places[name] for name in pair))
                for one in result.findings
                if one.finding.severity is Severity.ERROR and len(one.sorties) > 1
                for pair in combinations(one.sorties, 2)
            }
        )

    def _forbid(
        self, candidate: Candidate, one: Departure, two: Departure, *, with_returns: bool
    ) -> None:
        """Forbid the difference of two starts, and those about it that are no better."""
        later_s = two.start_s - one.start_s
        at = (one.task, one.option), (two.task, two.option)
        ways = [candidate.flights[task][option] for task, option in at]
        closed = self._closed(ways[0], ways[1], later_s, with_returns=with_returns)
        if not closed:
            twice = self._again[candidate, at] = self._again.get((candidate, at), -1) + 1
            width_s = _FORBIDDEN_S * 2.0 ** min(twice, _MOST_DOUBLED)
            closed = [(later_s - width_s, later_s + width_s)]
        candidate.met.update((one.task, two.task))
        candidate.close(at, closed)

    def _closed(
        self, one: FlownSortie, two: FlownSortie, later_s: float, *, with_returns: bool
    ) -> list[tuple[float, float]]:
        """Return why two sorties must not start so long after each other, as intervals about it. [s]"""
        separation = self._fleet.separation
        if separation is None or not one.time_s > 0.0 < two.time_s:
            return []
        key = (
            id(one.result),
            id(two.result),
        )  # kept by the checks: vehicles that are alike have one
        if key not in self._meetings:
            self._meetings[key] = Meetings(self._fleet, separation, (one, two), self._encounters)
        return self._meetings[key].about(later_s, with_returns=with_returns)

    def _why_not(self, candidates: Sequence[Candidate], means: Means) -> str:
        """Return why there is no plan."""
        source = self._fleet.source
        for candidate in candidates:
            for part, ways in zip(candidate.parts, candidate.flights, strict=True):
                if not ways:
                    return f"{source}: {self._ways.unflyable(part)}"
        candidate = candidates[0]
        core = smallest_conflict(
            candidate.tasks, means, candidate.conflicts, effort_s=self._effort_s
        )
        names = listed([candidate.parts[one].name for one in core])
        if len(core) == 1:
            return (
                f"{source}: {names} cannot be flown in its hours: allow it more time, or a vehicle and "
                "a pack that are there then"
            )
        return (
            f"{source}: {names} cannot all be flown in their hours, apart from each other: allow more "
            "time, more vehicles, packs or chargers, other places or heights"
        )


def _rank(schedule: Schedule, minimize: Objective = Objective.MAKESPAN) -> tuple[float, ...]:
    """Return what is compared of two schedules."""
    return (
        schedule.amount(minimize),
        schedule.energy_wh,
        schedule.makespan_s,
        float(schedule.packs),
        float(len(schedule.departures)),
    )
