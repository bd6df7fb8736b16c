"""A fleet planned: jobs divided into sorties, sorties given to vehicles and packs, all of them clear.

What a sortie takes is its check, on the vehicle and the pack that may fly it; when two of them may start
follows from their predicted flights; the rest is `planner.fleet.schedule`.  What the check of the whole
fleet still finds between two sorties, as on returns, is forbidden and planned again.
"""

from __future__ import annotations

import math
from functools import cached_property
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from planner import quantity
from planner.errors import FleetPlanError, SplitError, UsageError
from planner.files import make_output_folder, write_output_files
from planner.findings import Severity
from planner.fleet.approach import Meeting
from planner.fleet.fleet import Sortie
from planner.fleet.return_flights import return_conflict
from planner.fleet.schedule import (
    EFFORT_S,
    Means,
    Objective,
    Option,
    PackGroup,
    PackUse,
    Task,
    best_schedule,
    smallest_conflict,
)
from planner.fleet.separation import home_above_m, predict_conflicts
from planner.fleet.shifts import ClosedShifts
from planner.fleet.writer import fleet_file_text
from planner.mission.formats.plan import read_plan_text
from planner.service.fleet import (
    SortieChecks,
    check_fleet,
    initial_charge,
    pack_battery,
    usable_chargers,
)
from planner.service.fleet_separation import fleet_spacing, members, return_flights
from planner.service.split import split_under
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

    from planner.fleet.fleet import Fleet, Job, Pack, Separation
    from planner.fleet.return_flights import ReturnFlights
    from planner.fleet.schedule import Departure, Schedule
    from planner.fleet.separation import Member
    from planner.mission.items import Mission
    from planner.service.fleet import FleetResult, FlownSortie

    Closed = dict[tuple[tuple[int, int], tuple[int, int]], tuple[tuple[float, float], ...]]

PLAN_FILE = "fleet.toml"
_LONGEST_NAME = 28
"""Of a job in the name of a part, which has 40 at most."""
_MOST_REPAIRS = 60
"""Times a plan is made again without what the check of the fleet found."""
_FINER = 4
"""Parts of the intervals in which returns are looked at first, where all starts are asked for."""
_RETURNS_ROUND_S = 1.0
"""To what starts are found that keep the returns of another clear; each try looks at all of them. [s]"""
_MOST_DOUBLED = 12
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
    gap: float
    """How far the makespan may be above the least there is. [-]"""


class FleetPlan(Value):
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
        in_time = [one for one in self.rows if one.is_in_time]
        if not row.is_in_time:
            return ("too late",)
        found = ["fewest in time"] if row is in_time[0] else []
        least = min(in_time, key=lambda one: one.energy_wh)
        return (*found, "least energy") if row is least else (*found,)


class _Part(Value, eq=False):
    """A job, or a part of it."""

    name: str
    job: Job
    path: str
    text: str | None
    """Of the file to be written; ``None``: the file of the job itself."""


class _Candidate(Value, eq=False):
    """The jobs in so many sorties, and everything the schedule asks of them."""

    parts: tuple[_Part, ...]
    flights: tuple[tuple[FlownSortie, ...], ...]
    """Of each part, as each of its options is flown."""
    tasks: tuple[Task, ...]
    conflicts: Closed


def plan_fleet(
    fleet: Fleet,
    *,
    minimize: Objective | str = Objective.MAKESPAN,
    folder: Path | str = "",
    effort_s: float = EFFORT_S,
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
    planning = _Planning(fleet, Path(folder), effort_s, on_step)
    rows: list[PlanRow] = []
    candidates: list[_Candidate] = []
    for count in range(1, len(fleet.vehicles) + 1):
        row, candidate = planning.row(count)
        if row is not None and (not rows or row != replace(rows[-1], vehicles=row.vehicles)):
            rows.append(row)
        candidates += candidate
    return planning.whole(objective, candidates, tuple(rows))


def write_plan(plan: FleetPlan, folder: Path | str, *, force: bool = False) -> Path:
    """Write a plan into a folder: ``fleet.toml``, and a mission for each part of a job; return the file.

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
    """
    folder = Path(folder)
    file = folder / PLAN_FILE
    if file.exists() and file.samefile(plan.fleet.source):
        msg = f"{file} is the fleet that is planned: give another folder"
        raise UsageError(msg)
    texts = {Path(path): text for path, text in plan.missions.items()}
    texts[file] = fleet_file_text(plan.fleet.source, folder, plan.fleet.sorties)
    if not force and (there := [path for path in texts if path.exists()]):
        msg = f"{there[0]} exists already: give another folder, or --force"
        raise UsageError(msg)
    make_output_folder(folder, holding="the plan")
    write_output_files(texts)
    return file


class _Planning:
    """The plans of one fleet for several numbers of vehicles, which share every check."""

    def __init__(
        self, fleet: Fleet, folder: Path, effort_s: float, on_step: Callable[[str], None]
    ) -> None:
        self._fleet = fleet
        self._folder = folder
        self._effort_s = effort_s
        self._on_step = on_step
        self._missions: dict[str, Mission] = {}
        self._checks = SortieChecks(fleet, self._missions)
        self._divided: dict[tuple[str, int | None], tuple[_Part, ...]] = {}
        self._candidates: dict[tuple[int | None, ...], _Candidate] = {}
        self._groups: dict[str, list[Pack]] = {}
        for pack in fleet.packs.values():
            self._groups.setdefault(pack.group or pack.name, []).append(pack)
        self._chargers = usable_chargers(fleet)
        self._refusals: dict[str, str] = {}
        self._meetings: dict[object, _Meetings] = {}

    def row(self, vehicles: int) -> tuple[PlanRow | None, list[_Candidate]]:
        """Return what takes so many vehicles least time, and the divisions that were tried for it."""
        best: tuple[Schedule, _Candidate] | None = None
        candidates = [self._candidate(counts) for counts in self._counts(vehicles)]
        endless = replace(self._means(), latest_s=math.inf)
        for candidate in candidates:
            schedule = self._cleared(candidate, Objective.MAKESPAN, endless, vehicles)
            if schedule is not None and (best is None or _rank(schedule) < _rank(best[0])):
                best = schedule, candidate
        self._on_step(f"planned with {quantity.count(vehicles, 'vehicle')}")
        if best is None:
            return None, candidates
        schedule, candidate = best
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
            gap=schedule.gap(Objective.MAKESPAN),
        ), candidates

    def whole(
        self, minimize: Objective, candidates: Sequence[_Candidate], rows: tuple[PlanRow, ...]
    ) -> FleetPlan:
        """Return the plan with least of something, and nothing wrong with the fleet as a whole."""
        means = self._means()
        for _ in range(_MOST_REPAIRS):
            schedule, candidate = self._best(minimize, candidates, means)
            planned = self._planned(candidate, schedule)
            result = check_fleet(planned, checks=self._checks)
            if not self._forbidden(candidate, schedule, result):
                break
        if result.verdict != "go":
            wrong = next(one for one in result.all_findings if one.severity is Severity.ERROR)
            msg = f"{self._fleet.source}: no plan was found that is a go: {wrong.code} {wrong.message}"
            raise FleetPlanError(msg)
        return FleetPlan(
            fleet=planned,
            result=result,
            missions={part.path: part.text for part in candidate.parts if part.text is not None},
            minimize=minimize,
            schedule=schedule,
            rows=rows,
        )

    def _best(
        self, minimize: Objective, candidates: Sequence[_Candidate], means: Means
    ) -> tuple[Schedule, _Candidate]:
        """Return the best schedule of several divisions of the jobs."""
        found = [
            (schedule, candidate)
            for candidate in dict.fromkeys(candidates)
            if (schedule := self._cleared(candidate, minimize, means, None)) is not None
        ]
        if not found:
            raise FleetPlanError(self._why_not(candidates, means))
        return min(found, key=lambda one: _rank(one[0], minimize))

    def _counts(self, vehicles: int) -> list[tuple[int | None, ...]]:
        """Return in how many even sorties to fly each job, ``None``: the fewest it takes.

        The fewest, as many as a share of the vehicles, and as many as give each vehicle the same number.
        """
        jobs = [*self._fleet.jobs.values()]
        fewest = [len(self._parts(job, None)) for job in jobs]
        times_s = [self._time_s(job) for job in jobs]
        whole_s = sum(times_s) or 1.0
        shares = [math.ceil(vehicles * one / whole_s - 1e-9) for one in times_s]
        wanted = (
            [max(one, share) for one, share in zip(fewest, shares, strict=True)],
            [vehicles * math.ceil(one / vehicles) for one in fewest],
        )
        found: dict[tuple[int | None, ...], None] = {(None,) * len(jobs): None}
        for counts in wanted:
            even = (
                count if job.may_split and count > 1 and self._parts(job, count) else None
                for job, count in zip(jobs, counts, strict=True)
            )
            found[tuple(even)] = None
        return [*found]

    def _time_s(self, job: Job) -> float:
        """Return the time of all sorties of a job, in the fewest. [s]"""
        flown = (self._ways(part) for part in self._parts(job, None))
        return math.fsum(min((one.time_s for one in ways), default=0.0) for ways in flown)

    def _parts(self, job: Job, count: int | None) -> tuple[_Part, ...]:
        """Return a job in so many parts, or the fewest; empty where that is not possible."""
        at = (job.name, count)
        if at not in self._divided:
            whole = _Part(name=job.name, job=job, path=job.mission, text=None)
            if count in {None, 1} and (not job.may_split or self._ways(whole)):
                self._divided[at] = (whole,)
            else:
                self._divided[at] = self._split(job, count) if job.may_split else ()
            if count is None and not self._divided[at]:
                # it cannot be flown, and the schedule says why
                self._divided[at] = (whole,)
        return self._divided[at]

    def _split(self, job: Job, count: int | None) -> tuple[_Part, ...]:
        """Return a job split for the first vehicle and pack, of most energy first, that can fly it."""
        for sortie in sorted(self._sorties(job, job.name, None), key=self._energy_wh, reverse=True):
            setup = self._checks.setup(sortie, self._full(sortie))
            try:
                split = split_under(self._checks.mission(sortie), setup, parts=count)
            except SplitError as error:
                self._refusals.setdefault(job.name, str(error))
                continue
            width = len(split.parts)
            found = []
            for number, part in enumerate(split.parts, start=1):
                # even parts are others than the fewest: their files must not have one name
                kind = "" if count is None else "even-"
                name = f"{self._stem(job)}-{kind}{number:02}of{width:02}"
                path = str(self._folder / f"{name}.plan")
                found.append(_Part(name=name, job=job, path=path, text=part.text))
                self._missions[path] = read_plan_text(part.text, source=path)
            return tuple(found)
        return ()

    def _stem(self, job: Job) -> str:
        """Return how the names of a job's parts begin: its own name, or what is left of a long one."""
        if len(job.name) <= _LONGEST_NAME:
            return job.name
        place = [*self._fleet.jobs].index(job.name)
        return f"{job.name[: _LONGEST_NAME - 4]}-{place:03}"

    def _energy_wh(self, sortie: Sortie) -> float:
        if sortie.pack is None:
            battery = self._fleet.vehicles[sortie.vehicle].setup.vehicle.battery
        else:
            battery = pack_battery(self._fleet, self._fleet.packs[sortie.pack])
        return 0.0 if battery is None else battery.energy_wh

    def _sorties(self, job: Job, name: str, path: str | None) -> Iterator[Sortie]:
        """Yield the ways to fly a job or a part of it: by vehicle, and by group of packs."""
        for vehicle in self._fleet.vehicles.values():
            if not set(job.needs) <= set(vehicle.equipment):
                continue
            packs: Iterable[str | None] = [
                group[0].name
                for group in self._groups.values()
                if not group[0].fits or vehicle.name in group[0].fits
            ]
            for pack in packs if self._groups else (None,):
                yield Sortie(
                    name=name,
                    job=job.name,
                    vehicle=vehicle.name,
                    start_s=0.0,
                    pack=pack,
                    mission=path,
                )

    def _full(self, sortie: Sortie) -> float | None:
        """Return how full its pack is: full, but for one that no charger takes. [-]"""
        if sortie.pack is None:
            return None
        pack = self._fleet.packs[sortie.pack]
        return 1.0 if self._takers(pack) else initial_charge(pack)

    def _takers(self, pack: Pack) -> list[Any]:
        return [one for one in self._chargers if one.charges(pack)]

    def _ways(self, part: _Part) -> list[FlownSortie]:
        """Return the ways to fly a part that are a go."""
        path = None if part.text is None else part.path
        flown = (
            self._checks.flown(sortie, self._full(sortie))
            for sortie in self._sorties(part.job, part.name, path)
        )
        return [one for one in flown if one.result.verdict == "go"]

    def _candidate(self, counts: tuple[int | None, ...]) -> _Candidate:
        if counts not in self._candidates:
            jobs = [*self._fleet.jobs.values()]
            parts = tuple(
                part
                for job, count in zip(jobs, counts, strict=True)
                for part in self._parts(job, count)
            )
            flights = tuple(tuple(self._ways(part)) for part in parts)
            tasks = tuple(
                Task(
                    name=part.name,
                    options=tuple(map(self._option, ways)),
                    earliest_s=part.job.earliest_s,
                    latest_s=math.inf if part.job.latest_s is None else part.job.latest_s,
                    priority=part.job.priority,
                )
                for part, ways in zip(parts, flights, strict=True)
            )
            self._candidates[counts] = _Candidate(
                parts=parts, flights=flights, tasks=tasks, conflicts={}
            )
        return self._candidates[counts]

    def _option(self, flown: FlownSortie) -> Option:
        name = flown.sortie.pack
        packs: tuple[PackUse, ...] = ()
        if name is not None:
            pack = self._fleet.packs[name]
            left = flown.charge_left or 0.0
            packs = (PackUse(packs=pack.group or name, charge_s=self._charge_s(pack, left)),)
        energy_wh = flown.energy_wh
        return Option(
            vehicle=flown.sortie.vehicle,
            duration_s=flown.time_s,
            energy_wh=math.nan if energy_wh is None else energy_wh,
            packs=packs,
        )

    def _charge_s(self, pack: Pack, charge: float) -> dict[str, float]:
        """Return how long a pack takes to be full, by the chargers that take it. [s]"""
        battery = pack_battery(self._fleet, pack)
        if battery is None:
            return {}
        return {one.name: one.charge_time_s(battery, charge) for one in self._takers(pack)}

    def _means(self) -> Means:
        fleet = self._fleet
        return Means(
            vehicles={
                name: (
                    one.available_from_s,
                    math.inf if one.available_until_s is None else one.available_until_s,
                )
                for name, one in fleet.vehicles.items()
            },
            packs={
                name: PackGroup(
                    count=len(group),
                    charge_first_s=self._charge_s(group[0], charge)
                    if (charge := initial_charge(group[0])) < 1.0
                    else {},
                )
                for name, group in self._groups.items()
            },
            chargers={one.name: one.count for one in self._chargers},
            swap_s=0.0 if fleet.swap is None else fleet.swap.time_s,
            latest_s=math.inf if fleet.operation.latest_s is None else fleet.operation.latest_s,
        )

    def _cleared(
        self, candidate: _Candidate, minimize: Objective, means: Means, vehicles: int | None
    ) -> Schedule | None:
        """Return the best schedule in which no two come too near to each other in the air.

        What they must not have is looked for where a schedule without it has it: what is best without
        more of it is best.
        """
        while True:
            schedule = best_schedule(
                candidate.tasks,
                means,
                candidate.conflicts,
                minimize=minimize,
                most_vehicles=vehicles,
                effort_s=self._effort_s,
            )
            if schedule is None or not self._too_near(candidate, schedule):
                return schedule

    def _flown(self, candidate: _Candidate, schedule: Schedule) -> list[FlownSortie]:
        """Return every sortie as a schedule flies it."""
        found = []
        for one in schedule.departures:
            way = candidate.flights[one.task][one.option]
            pack = None
            if one.pack is not None:
                group, number = one.pack
                pack = self._groups[group][number].name
            sortie = replace(
                way.sortie, name=candidate.parts[one.task].name, start_s=one.start_s, pack=pack
            )
            found.append(replace(way, sortie=sortie))
        return found

    def _planned(self, candidate: _Candidate, schedule: Schedule) -> Fleet:
        """Return the fleet with its sorties in the order of their starts."""
        flown = sorted(self._flown(candidate, schedule), key=lambda one: (one.start_s, one.name))
        return replace(self._fleet, sorties={one.name: one.sortie for one in flown})

    def _too_near(self, candidate: _Candidate, schedule: Schedule) -> bool:
        """Return whether two come too near to each other in the air; if so, forbid their starts."""
        separation = self._fleet.separation
        flown = [one for one in self._flown(candidate, schedule) if one.time_s > 0.0]
        if separation is None or len({one.sortie.vehicle for one in flown}) < 2:
            return False
        together = members(self._fleet, separation, flown)
        near = [*predict_conflicts(together, fleet_spacing(separation))]
        for one in near:
            pair = (schedule.departures[one.first], schedule.departures[one.second])
            self._forbid(candidate, *pair, with_returns=False)
        return bool(near)

    def _forbidden(self, candidate: _Candidate, schedule: Schedule, result: FleetResult) -> bool:
        """Return whether the check of the fleet found two sorties at fault; if so, forbid their starts."""
        places = {part.name: number for number, part in enumerate(candidate.parts)}
        pairs = {
            tuple(sorted(places[name] for name in pair))
            for one in result.findings
            if one.finding.severity is Severity.ERROR and len(one.sorties) > 1
            for pair in combinations(one.sorties, 2)
        }
        for first, second in sorted(pairs):
            pair = (schedule.departures[first], schedule.departures[second])
            self._forbid(candidate, *pair, with_returns=True)
        return bool(pairs)

    def _forbid(
        self, candidate: _Candidate, one: Departure, two: Departure, *, with_returns: bool
    ) -> None:
        """Forbid the difference of two starts, and those about it that are no better."""
        later_s = two.start_s - one.start_s
        at = (one.task, one.option), (two.task, two.option)
        ways = [candidate.flights[task][option] for task, option in at]
        before = candidate.conflicts.get(at, ())
        closed = self._closed(ways[0], ways[1], later_s, with_returns=with_returns)
        if not closed:
            width_s = _FORBIDDEN_S * 2.0 ** min(len(before), _MOST_DOUBLED)
            closed = [(later_s - width_s, later_s + width_s)]
        candidate.conflicts[at] = tuple(sorted({*before, *closed}))

    def _closed(
        self, one: FlownSortie, two: FlownSortie, later_s: float, *, with_returns: bool
    ) -> list[tuple[float, float]]:
        """Return why two sorties must not start so long after each other, as intervals about it. [s]"""
        separation = self._fleet.separation
        if separation is None or not one.time_s > 0.0 < two.time_s:
            return []
        key = tuple(
            (each.sortie.name, each.sortie.vehicle, each.sortie.pack) for each in (one, two)
        )
        if key not in self._meetings:
            self._meetings[key] = _Meetings(self._fleet, separation, (one, two))
        return self._meetings[key].about(later_s, with_returns=with_returns)

    def _why_not(self, candidates: Sequence[_Candidate], means: Means) -> str:
        """Return why there is no plan."""
        source = self._fleet.source
        for candidate in candidates:
            for part, ways in zip(candidate.parts, candidate.flights, strict=True):
                if not ways:
                    return f"{source}: {self._unflyable(part)}"
        candidate = candidates[0]
        core = smallest_conflict(
            candidate.tasks, means, candidate.conflicts, effort_s=self._effort_s
        )
        names = _listed([candidate.parts[one].name for one in core])
        if len(core) == 1:
            return (
                f"{source}: {names} cannot be flown in its hours: allow it more time, or a vehicle and "
                "a pack that are there then"
            )
        return (
            f"{source}: {names} cannot all be flown in their hours, apart from each other: allow more "
            "time, more vehicles or packs, other places or heights"
        )

    def _unflyable(self, part: _Part) -> str:
        """Return why nothing flies a part."""
        flown = [
            self._checks.flown(sortie, self._full(sortie))
            for sortie in self._sorties(
                part.job, part.name, None if part.text is None else part.path
            )
        ]
        if not flown:
            needs = f" with {_listed(part.job.needs)}" if part.job.needs else ""
            return (
                f"{part.name} cannot be flown: there is no vehicle{needs} with a pack that fits it"
            )
        refusal = self._refusals.get(part.job.name)
        if refusal is not None:
            return refusal
        one = flown[0]
        wrong = next(
            (each for each in one.result.findings if each.severity is Severity.ERROR), None
        )
        why = "" if wrong is None else f": {wrong.code} {wrong.message}"
        more = (
            "" if part.job.may_split else "; may_split = true lets it be flown in several sorties"
        )
        return f"{part.name} cannot be flown: it is a no-go on {one.sortie.vehicle}{why}{more}"


class _Meetings:
    """At which differences of their starts two sorties come too near to each other."""

    def __init__(
        self, fleet: Fleet, separation: Separation, flown: tuple[FlownSortie, FlownSortie]
    ) -> None:
        self._spacing = fleet_spacing(separation)
        self._flown = flown
        # Vehicles of one name never meet; packs and starts count for nothing here.
        self._one, self._two = members(fleet, separation, flown)

    def about(self, later_s: float, *, with_returns: bool) -> list[tuple[float, float]]:
        """Return the intervals that a difference is in. [s]"""
        found = [self._flights.around(later_s)]
        if not with_returns:
            return [one for one in found if one is not None]
        found += [None if one is None else one.around(later_s) for one in self._returns[:1]]
        for back in self._returns[1:]:
            turned = None if back is None else back.around(-later_s)
            found.append(None if turned is None else (-turned[1], -turned[0]))
        return [one for one in found if one is not None]

    @cached_property
    def _flights(self) -> ClosedShifts:
        return ClosedShifts(self._meeting(self._one, self._two))

    @cached_property
    def _returns(self) -> tuple[ClosedShifts | None, ClosedShifts | None]:
        """Of the returns of the first with the second, and the other way round."""
        first, second = (each.assessment for each in self._flown)
        assert first is not None  # both fly
        assert second is not None
        frame = first.route.frame
        return (
            self._of_returns(return_flights(first, frame), self._one, self._two),
            self._of_returns(return_flights(second, frame), self._two, self._one),
        )

    def _of_returns(self, flights: ReturnFlights, one: Member, two: Member) -> ClosedShifts | None:
        begin_s, end_s = flights.first_intervals()
        if not len(begin_s):
            return None
        cuts = np.linspace(begin_s, end_s, _FINER + 1)
        fan = flights.fan(cuts[:-1].T.ravel(), cuts[1:].T.ravel())
        meeting = replace(self._meeting(one, two), first=fan.whole)

        def is_clear(low_s: float, high_s: float) -> bool:
            between_s = 0.5 * (high_s - low_s)
            at = replace(meeting, later_s=low_s + between_s, shift_s=meeting.shift_s + between_s)
            return return_conflict(flights, fan, at, self._spacing.separation_m) is None

        return ClosedShifts(meeting, is_clear=is_clear, round_s=_RETURNS_ROUND_S)

    def _meeting(self, one: Member, two: Member) -> Meeting:
        return Meeting(
            first=one.trajectory,
            second=two.trajectory,
            shift_s=2.0 * self._spacing.start_error_s,
            above_m=home_above_m(one, two),
            zone=self._spacing.zone(one, two),
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


def _listed(names: Sequence[str]) -> str:
    """Return names as they stand in a sentence."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
