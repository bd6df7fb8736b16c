"""The ways to fly the jobs of a fleet: in parts, on each vehicle and pack, and in layers.

What a way takes is the check of it: only those that are a go are ways.
"""

from __future__ import annotations

import math
from itertools import product
from typing import TYPE_CHECKING, Any

from planner.errors import SplitError
from planner.findings import Severity
from planner.fleet.fleet import Sortie
from planner.fleet.schedule import Means, Objective, Option, PackGroup, PackUse, Task
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.formats.plan import read_plan_text
from planner.mission.items import MissionFormat
from planner.mission.lift import highest_m, lifted, why_not_lifted
from planner.service.fleet import (
    SortieChecks,
    flies_alike,
    initial_charge,
    pack_battery,
    usable_chargers,
)
from planner.service.fleet_meetings import carry_shifts, pad_shifts
from planner.service.split import split_under
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence
    from pathlib import Path

    from planner.fleet.fleet import Fleet, Job, Pack
    from planner.mission.items import Mission
    from planner.service.fleet import FlownSortie
    from planner.service.fleet_meetings import Closed

    _Pair = tuple[tuple[int, int], tuple[int, int]]

_LONGEST_NAME = 28
"""Of a job in the name of a part, which has 40 at most."""
_MOST_LIFTED = 400
"""Flights in layers that are checked for one division of the jobs."""


class JobPart(Value, eq=False):
    """A job, or a part of it."""

    name: str
    job: Job
    path: str | None = None
    """Of the file to be written; ``None``: the file of the job itself."""


class Candidate(Value, eq=False):
    """The jobs in so many sorties, and everything the schedule asks of them."""

    parts: tuple[JobPart, ...]
    flights: tuple[tuple[FlownSortie, ...], ...]
    """Of each part, as each of its options is flown."""
    tasks: tuple[Task, ...]
    conflicts: Closed
    """Differences of starts that are known to be wrong; more are added as they are found."""
    met: set[int] = field(default_factory=set)
    """Tasks that come too near to another in flight."""
    lifts: Mapping[tuple[int, int], Mapping[float, int]] = field(default_factory=dict)
    """Of each task and option that has layers: itself and the same flight higher, by how far lifted."""
    alike: Mapping[tuple[int, int], tuple[int, ...]] = field(default_factory=dict)
    """Of each task and option those that are the same flight by alike vehicles, itself among them."""

    def least(self, objective: Objective, vehicles: int) -> float:
        """Return what no schedule on so many vehicles has less of; infinite: there is none."""
        match objective:
            case Objective.ENERGY:
                return math.fsum(
                    min((0.0 if math.isnan(wh) else wh for wh in each), default=math.inf)
                    for each in ([way.energy_wh for way in one.options] for one in self.tasks)
                )
            case Objective.MAKESPAN:
                flown_s = [
                    min((way.duration_s for way in one.options), default=math.inf)
                    for one in self.tasks
                ]
                ends_s = (one.earliest_s + s for one, s in zip(self.tasks, flown_s, strict=True))
                return max(math.fsum(flown_s) / vehicles, *ends_s)
            case _:
                return 1.0

    def close(self, at: _Pair, closed: Iterable[tuple[float, float]]) -> None:
        """Forbid two flights differences of their starts, and to both as far lifted, or farther.

        These are the same flights; the check of the fleet finds what else is wrong with them.
        """
        ladders = [self.lifts.get(one, {}) for one in at]
        pairs = [at]
        if ladders[0] and ladders[1] and min(ladders[0]) == min(ladders[1]):
            by_m = sorted(ladders[0].keys() & ladders[1].keys())
            pairs = [((at[0][0], ladders[0][one]), (at[1][0], ladders[1][one])) for one in by_m]
        for pair in pairs:
            own = _joined([*closed, *self.conflicts.get(pair, ())])
            for one in self._alike(pair, own):  # which may have others of their own
                self.conflicts[one] = _joined([*own, *self.conflicts.get(one, ())])

    def _alike(self, pair: _Pair, closed: Sequence[tuple[float, float]]) -> Iterator[_Pair]:
        """Yield the pairs of flights that are the same as two but for which of alike vehicles fly them.

        By one vehicle they are in the air one after the other, whatever keeps others apart.
        """
        (i, a), (j, b) = pair
        own = [self.alike.get(one, (one[1],)) for one in pair]
        if max(map(len, own)) == 1:
            yield pair
            return
        lasts_s = [self.tasks[task].options[option].duration_s for task, option in pair]
        is_in_turn = all(-lasts_s[1] <= low and high <= lasts_s[0] for low, high in closed)
        for one, two in product(*own):
            by = self.tasks[i].options[one].vehicle, self.tasks[j].options[two].vehicle
            if (one, two) == (a, b) or is_in_turn or by[0] != by[1]:
                yield (i, one), (j, two)

    def learn(self, other: Candidate) -> None:
        """Take over what is known of the flights that another candidate of the same parts has too."""
        if other is self:
            return
        self.met.update(other.met)
        for at, closed in other.conflicts.items():
            if all(option < len(self.flights[task]) for task, option in at):
                own = self.conflicts.get(at, ())
                if not all(any(a <= low and high <= b for a, b in own) for low, high in closed):
                    self.close(at, closed)


class Ways:
    """The ways to fly the jobs of one fleet, each checked once.

    Parameters
    ----------
    fleet : Fleet
        Its own sorties are not looked at.
    folder : Path
        Where missions are to be written that are not those of the jobs.
    """

    def __init__(self, fleet: Fleet, folder: Path) -> None:
        self._fleet = fleet
        self._folder = folder
        self._missions: dict[str, Mission] = {}
        self.checks = SortieChecks(fleet, self._missions)
        self.texts: dict[str, str] = {}
        """Of the missions that are not those of the jobs, by path."""
        self.groups: dict[str, list[Pack]] = {}
        """Packs that are alike, by the name of their table."""
        self._divided: dict[tuple[str, int | None], tuple[JobPart, ...]] = {}
        for pack in fleet.packs.values():
            self.groups.setdefault(pack.group or pack.name, []).append(pack)
        self._chargers = usable_chargers(fleet)
        self._refusals: dict[str, str] = {}

    def counts(self, vehicles: int) -> list[tuple[int | None, ...]]:
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

    def _parts(self, job: Job, count: int | None) -> tuple[JobPart, ...]:
        """Return a job in so many parts, or the fewest; empty where that is not possible."""
        at = (job.name, count)
        if at not in self._divided:
            whole = JobPart(name=job.name, job=job)
            if count in {None, 1} and (not job.may_split or self._ways(whole)):
                self._divided[at] = (whole,)
            else:
                self._divided[at] = self._split(job, count) if job.may_split else ()
            if count is None and not self._divided[at]:
                # it cannot be flown, and the schedule says why
                self._divided[at] = (whole,)
        return self._divided[at]

    def _split(self, job: Job, count: int | None) -> tuple[JobPart, ...]:
        """Return a job split for the first vehicle and pack, of most energy first, that can fly it."""
        for sortie in sorted(
            self._sorties(job, job.name, None), key=self.checks.battery_wh, reverse=True
        ):
            setup = self.checks.setup(sortie, self._full(sortie))
            try:
                split = split_under(self.checks.mission(sortie), setup, parts=count)
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
                found.append(JobPart(name=name, job=job, path=path))
                self._missions[path] = read_plan_text(part.text, source=path)
                self.texts[path] = part.text
            return tuple(found)
        return ()

    def _stem(self, job: Job) -> str:
        """Return how the names of a job's parts begin: its own name, or what is left of a long one."""
        if len(job.name) <= _LONGEST_NAME:
            return job.name
        place = [*self._fleet.jobs].index(job.name)
        return f"{job.name[: _LONGEST_NAME - 4]}-{place:03}"

    def _sorties(self, job: Job, name: str, path: str | None) -> Iterator[Sortie]:
        """Yield the ways to fly a job or a part of it: by vehicle, and by group of packs."""
        for vehicle in self._fleet.vehicles.values():
            if not set(job.needs) <= set(vehicle.equipment):
                continue
            packs: Iterable[str | None] = [
                group[0].name
                for group in self.groups.values()
                if not group[0].fits or vehicle.name in group[0].fits
            ]
            for pack in packs if self.groups else (None,):
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

    def _ways(self, part: JobPart) -> list[FlownSortie]:
        """Return the ways to fly a part that are a go."""
        flown = (
            self.checks.flown(sortie, self._full(sortie))
            for sortie in self._sorties(part.job, part.name, part.path)
        )
        return [one for one in flown if one.result.verdict == "go"]

    def candidate(self, counts: tuple[int | None, ...]) -> Candidate:
        """Return the jobs in so many parts each, with every way to fly them."""
        parts = tuple(
            part
            for job, count in zip(self._fleet.jobs.values(), counts, strict=True)
            for part in self._parts(job, count)
        )
        flights = tuple(tuple(self._ways(part)) for part in parts)
        return self._of_flights(parts, flights)

    def _of_flights(
        self,
        parts: tuple[JobPart, ...],
        flights: tuple[tuple[FlownSortie, ...], ...],
        lifts: Mapping[tuple[int, int], Mapping[float, int]] | None = None,
    ) -> Candidate:
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
        closed = pad_shifts(self._fleet, flights) | carry_shifts(self._fleet, flights)
        return Candidate(
            parts=parts,
            flights=flights,
            tasks=tasks,
            conflicts=closed,
            lifts=lifts or {},
            alike={
                (task, option): tuple(
                    n for n, other in enumerate(ways) if other.result is way.result
                )
                for task, ways in enumerate(flights)
                for option, way in enumerate(ways)
            },
        )

    def lifted(self, candidate: Candidate) -> Candidate:
        """Return the same parts, those that come too near to others with ways in layers as well.

        Those that have them already keep them.
        """
        places = sorted(candidate.met - {place for place, _ in candidate.lifts})
        flights = [*candidate.flights]
        wide = sum(len(flights[place]) for place in places)
        flying = len({way.sortie.vehicle for ways in flights for way in ways})
        most = min(len(candidate.met), flying, max(_MOST_LIFTED // max(wide, 1), 1))
        lifts = dict(candidate.lifts)
        for place in places:
            for below, way in enumerate(candidate.flights[place]):
                rungs = {0.0: below}
                for by_m, lifted_way in self._layers(candidate.parts[place], way, most):
                    rungs[by_m] = len(flights[place])
                    flights[place] = (*flights[place], lifted_way)
                for own_m, option in rungs.items():
                    lifts[place, option] = {m: at for m, at in rungs.items() if m >= own_m}
        found = self._of_flights(candidate.parts, tuple(flights), lifts)
        found.learn(candidate)
        return found

    def _layers(
        self, part: JobPart, way: FlownSortie, most: int
    ) -> Iterator[tuple[float, FlownSortie]]:
        """Yield how far a flight is lifted to each layer above it, and the check of it there."""
        layers, mission = self._fleet.layers, self.checks.written_mission(way.sortie)
        if layers is None or why_not_lifted(mission):
            return
        top_m = highest_m(mission)
        is_wpl = mission.file_format is MissionFormat.WPL
        above_m = (height_m for height_m in layers.heights_m if height_m > top_m)
        for height_m, _ in zip(above_m, range(most), strict=False):
            name = f"{part.name}-{height_m:g}m.{'waypoints' if is_wpl else 'plan'}"
            path = str(self._folder / name)
            text = convert_mission(lifted(mission, height_m - top_m), mission.file_format).text
            if self.texts.setdefault(path, text) != text:
                continue  # the name of another job's part
            if path not in self._missions:
                self._missions[path] = read_mission_bytes(text.encode(), source=path)
            flown = self.checks.flown(replace(way.sortie, mission=path), self._full(way.sortie))
            if flown.result.verdict == "go":
                yield height_m - top_m, flown

    def by_few(self, candidate: Candidate, vehicles: int) -> Candidate:
        """Return a candidate without ways of vehicles that are one too many of their kind to be needed.

        So many vehicles do with the first so many of those that are alike.
        """
        by_kind: dict[str, set[str]] = {}
        for name in self._fleet.vehicles:
            by_kind.setdefault(self._kind(name), set())
            if len(by_kind[self._kind(name)]) < vehicles:
                by_kind[self._kind(name)].add(name)
        kept = set().union(*by_kind.values())
        if len(kept) == len(self._fleet.vehicles):
            return candidate
        flights = tuple(
            tuple(way for way in ways if way.sortie.vehicle in kept) for ways in candidate.flights
        )
        return self._of_flights(candidate.parts, flights)

    def _kind(self, name: str) -> str:
        """Return the first vehicle that only its name tells from another."""
        vehicles = self._fleet.vehicles
        return next(
            other
            for other, one in vehicles.items()
            if flies_alike(one, vehicles[name]) and self._duties(other) == self._duties(name)
        )

    def _duties(self, name: str) -> tuple[object, ...]:
        """Return what a vehicle can be used for: with what, when, on which packs."""
        own = self._fleet.vehicles[name]
        packs = [one.name for one in self._fleet.packs.values() if not one.fits or name in one.fits]
        return own.equipment, own.available_from_s, own.available_until_s, packs

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
            duration_s=flown.time_s + flown.late_s,
            energy_wh=math.nan if energy_wh is None else energy_wh,
            packs=packs,
        )

    def _charge_s(self, pack: Pack, charge: float) -> dict[str, float]:
        """Return how long a pack takes to be full, by the chargers that take it. [s]"""
        battery = pack_battery(self._fleet, pack)
        if battery is None:
            return {}
        return {one.name: one.charge_time_s(battery, charge) for one in self._takers(pack)}

    def means(self) -> Means:
        """Return what there is to fly with."""
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
                for name, group in self.groups.items()
            },
            chargers={one.name: one.count for one in self._chargers},
            swap_s=fleet.swap_s,
            latest_s=math.inf if fleet.operation.latest_s is None else fleet.operation.latest_s,
        )

    def unflyable(self, part: JobPart) -> str:
        """Return why nothing flies a part."""
        flown = [
            self.checks.flown(sortie, self._full(sortie))
            for sortie in self._sorties(part.job, part.name, part.path)
        ]
        if not flown:
            needs = f" with {listed(part.job.needs)}" if part.job.needs else ""
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


def _joined(closed: Iterable[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """Return open intervals without those that overlap, rising."""
    found: list[tuple[float, float]] = []
    for low_s, high_s in sorted(closed):
        if found and low_s < found[-1][1]:
            found[-1] = found[-1][0], max(found[-1][1], high_s)
        else:
            found.append((low_s, high_s))
    return tuple(found)


def listed(names: Sequence[str]) -> str:
    """Return names as they stand in a sentence."""
    return " and ".join(filter(None, (", ".join(names[:-1]), names[-1])))
