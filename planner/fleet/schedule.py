"""Which vehicle flies which sortie when, on which pack: the best there is, by constraint programming.

Everything is numbers by now: what a sortie takes on a vehicle is known from its check, and which
differences of start times two sorties must not have, from where they come too near to each other.  The
solver is CP-SAT of OR-Tools with one worker, a fixed seed and a limit in its own deterministic time, so
that the same input gives the same schedule.  Times are whole milliseconds in it, always rounded to the
safe side.
"""

from __future__ import annotations

import math
from collections import defaultdict
from concurrent.futures import ThreadPoolExecutor, wait
from enum import StrEnum
from time import monotonic
from typing import TYPE_CHECKING, Any

from planner.errors import UsageError, libraries_of
from planner.fleet.turns import MS, closed_ms, first_turns, ms
from planner.values import Value, field, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping, Sequence

    from ortools.sat.python.cp_model import CpModel, CpSolver, IntVar, LinearExprT

    from planner.fleet.turns import FirstSchedule

    Conflicts = Mapping[tuple[tuple[int, int], tuple[int, int]], Sequence[tuple[float, float]]]
    """For two sorties, each with one of its options: open intervals that the start of the second after
    the start of the first must not be in. [s]"""

_MWH = 1000
EFFORT_S = 1.0
"""Of the solver's deterministic time, which is two to four of a core, for what is minimized. [s]

Twenty flights that all cross are planned in less than 5 s of a core with it, to 0.02 % of the least; ten
times as much finds nothing better."""
_FIRST = 10.0
"""As many times as much where nothing at all was found. [-]"""
_FURTHER = 0.1
"""Share of it for each objective that only tells equal schedules apart. [-]"""
_EVER = math.inf
_HURRIED_S = 0.1
"""Effort for each schedule once the search is cut short: what is there is made whole. [s]"""
_LEAST_S = 0.05
_LOOK_AGAIN_S = 0.5
_HALVED_AFTER = 20
"""Conflicts after which the range that the least can be in is divided elsewhere."""
_PLAIN, _RELAXED = 0.2, 0.6
"""Shares of the effort without linear relaxations, then with them from the best that is found.

Of 40 drawn fleets of five and six sorties both together prove all in 8 s; either alone leaves some as much
as 7 % above the least, and takes twice as long. [-]"""
_WIDE, _WIDELY = 100, 0.3
"""Ways to fly, of all sorties together, above which there are no relaxations, and the share of the effort
then: 20 sorties in 20 layers have 400, and are planned in half of the time to the same schedule. [-]"""


class Patience:
    """How long a search may go on: until a time of the clock, or until it is told to stop.

    Neither is known before: what is found then may be another plan the next time.

    Parameters
    ----------
    time_limit_s : float, optional
        Of the clock, from now on. [s]
    """

    def __init__(self, time_limit_s: float = _EVER) -> None:
        self._limit_s = time_limit_s
        self._until_s = monotonic() + time_limit_s
        self._solver: CpSolver | None = None
        self._told = False

    @property
    def cut_short(self) -> str:
        """Why nothing better is looked for; empty: it still is."""
        if self._told:
            return "it was interrupted"
        return f"its {self._limit_s:g} s were over" if monotonic() >= self._until_s else ""

    def stop(self) -> None:
        """Let the search end with the best there is by now; for a signal or another thread."""
        self._told = True
        if self._solver is not None:
            self._solver.stop_search()

    def solved(self, solver: CpSolver, model: CpModel) -> Any:  # noqa: ANN401 - a status of OR-Tools
        """Return how a model is solved, in a thread: signals do not reach the solver."""
        solver.parameters.catch_sigint_signal = False
        if not self.cut_short and self._until_s < _EVER:
            solver.parameters.max_time_in_seconds = max(self._until_s - monotonic(), _LEAST_S)
        self._solver = solver
        with ThreadPoolExecutor(1) as pool:
            solving = pool.submit(solver.solve, model)
            try:
                while wait([solving], _LOOK_AGAIN_S).not_done:
                    if self._told:  # before the solver had begun
                        solver.stop_search()
                return solving.result()
            except BaseException:
                solver.stop_search()
                raise
            finally:
                self._solver = None


class Objective(StrEnum):
    """What a plan has least of; what is equal in that is told apart by the rest, in this order."""

    ENERGY = "energy"
    MAKESPAN = "makespan"
    VEHICLES = "vehicles"
    BATTERIES = "batteries"


class PackUse(Value):
    """A group of alike packs that a flight may take one of, full."""

    packs: str
    charge_s: Mapping[str, float] = field(default_factory=dict)
    """How long it is charged afterwards, by charger; without any it is not flown on again. [s]"""


class Option(Value):
    """One way to fly a sortie."""

    vehicle: str
    duration_s: float
    energy_wh: float
    """NaN: not known, and not counted. [Wh]"""
    packs: tuple[PackUse, ...] = ()
    """Any one of them; empty: a pack of its own, always full."""


class Task(Value):
    """A sortie to be flown once."""

    name: str
    options: tuple[Option, ...]
    earliest_s: float = 0.0
    latest_s: float = _EVER
    """Landed by then. [s]"""
    priority: int = 0


class PackGroup(Value):
    """Packs that are alike."""

    count: int
    charge_first_s: Mapping[str, float] = field(default_factory=dict)
    """How long each is charged before its first flight, by charger; empty: full. [s]"""


class Means(Value):
    """What there is to fly with."""

    vehicles: Mapping[str, tuple[float, float]]
    """From when to when each is there. [s]"""
    packs: Mapping[str, PackGroup] = field(default_factory=dict)
    chargers: Mapping[str, int] = field(default_factory=dict)
    """Packs each kind charges at the same time."""
    swap_s: float = 0.0
    """From landed to ready, and to the pack on a charger. [s]"""
    latest_s: float = _EVER


class Departure(Value):
    """When and how one sortie is flown."""

    task: int
    option: int
    start_s: float
    pack: tuple[str, int] | None
    """Group and number from 0; ``None``: a pack of its own."""


class Schedule(Value):
    """A schedule, and how much better another could be at most."""

    departures: tuple[Departure, ...]
    """One of each task, in their order."""
    energy_wh: float
    makespan_s: float
    """When the last has landed. [s]"""
    vehicles: int
    packs: int
    bound: float
    """No schedule has less of the objective: Wh, s, or a count."""
    is_best: bool
    """The bound is reached: it is proven that nothing is better."""

    def amount(self, objective: Objective) -> float:
        """Return how much it has of what there should be least of."""
        return {
            Objective.ENERGY: self.energy_wh,
            Objective.MAKESPAN: self.makespan_s,
            Objective.VEHICLES: float(self.vehicles),
            Objective.BATTERIES: float(self.packs),
        }[objective]

    def gap(self, objective: Objective) -> float:
        """Return how far it may be above the least there is, as a share of it. [-]"""
        amount = self.amount(objective)
        return 0.0 if self.is_best or amount <= 0.0 else max(1.0 - self.bound / amount, 0.0)


_ORDER: Mapping[Objective, tuple[Objective, ...]] = {
    Objective.ENERGY: (Objective.ENERGY, Objective.MAKESPAN, Objective.BATTERIES),
    Objective.MAKESPAN: (Objective.MAKESPAN, Objective.ENERGY, Objective.BATTERIES),
    Objective.VEHICLES: (Objective.VEHICLES, Objective.ENERGY, Objective.MAKESPAN),
    Objective.BATTERIES: (Objective.BATTERIES, Objective.ENERGY, Objective.MAKESPAN),
}


def best_schedule(
    tasks: Sequence[Task],
    means: Means,
    conflicts: Conflicts,
    *,
    minimize: Objective,
    most_vehicles: int | None = None,
    effort_s: float = EFFORT_S,
    patience: Patience | None = None,
) -> Schedule | None:
    """Return the best schedule of all tasks; ``None``: there is none.

    Parameters
    ----------
    tasks, means
        What is flown, and with what.
    conflicts : mapping
        As `Conflicts`; pairs that are not in it never meet.
    minimize : Objective
        What there should be least of.  Equal schedules are told apart by the others, then by early
        starts, those of higher priority first.
    most_vehicles : int, optional
        Fly with no more of them.
    effort_s : float
        Of deterministic time. [s]
    patience : Patience, optional
        What may cut it short.

    Raises
    ------
    UsageError
        If OR-Tools is not installed, or the effort ends before anything is found.
    """
    solver = _Solver(tasks, means, conflicts, most_vehicles, patience or Patience())
    return solver.best(minimize, effort_s=effort_s)


def smallest_conflict(
    tasks: Sequence[Task],
    means: Means,
    conflicts: Conflicts,
    *,
    most_vehicles: int | None = None,
    effort_s: float = EFFORT_S,
) -> tuple[int, ...]:
    """Return tasks that have no schedule while any of them left out leaves one.

    Empty where all of them have one, or none was found with the effort to tell.
    """

    def has_none(kept: Sequence[int]) -> bool:
        places = {task: place for place, task in enumerate(kept)}
        own = {
            ((places[i], a), (places[j], b)): closed
            for ((i, a), (j, b)), closed in conflicts.items()
            if i in places and j in places
        }
        model = _Solver([tasks[one] for one in kept], means, own, most_vehicles, Patience())
        return model.is_infeasible(effort_s)

    core = list(range(len(tasks)))
    if not has_none(core):
        return ()
    for one in range(len(tasks)):
        without = [task for task in core if task != one]
        if without and has_none(without):
            core = without
    return tuple(core)


class _Solver:
    """The model of one fleet in CP-SAT."""

    def __init__(
        self,
        tasks: Sequence[Task],
        means: Means,
        conflicts: Conflicts,
        most_vehicles: int | None,
        patience: Patience,
    ) -> None:
        with libraries_of("fleet"):
            from ortools.sat.python import cp_model
        self._cp = cp_model
        self._tasks = tasks
        self._means = means
        self._patience = patience
        self._model: CpModel = cp_model.CpModel()
        self._horizon = self._longest_ms(conflicts)
        self._start = [self._time(f"start {one.name}") for one in tasks]
        self._end = [self._time(f"end {one.name}") for one in tasks]
        self._flies = [
            [self._model.new_bool_var(f"{one.name} by {o.vehicle}") for o in one.options]
            for one in tasks
        ]
        self._any: dict[tuple[int, frozenset[int]], IntVar] = {}
        """Whether a task is flown in one of some ways, as far as that is asked."""
        self._takes: dict[tuple[int, str], IntVar] = {}
        self._on: dict[int, IntVar] = {}
        """When the pack of a task is put on a charger, by task."""
        self._back: dict[int, IntVar] = {}
        """When the pack of a task is full again, by task."""
        self._first: dict[str, list[IntVar]] = defaultdict(list)
        """When each pack of a group is full for the first time, where none is at the beginning."""
        self._used = {name: self._model.new_bool_var(f"{name} used") for name in means.vehicles}
        self._capacity = {
            name: self._model.new_int_var(0, group.count, f"{name} used")
            for name, group in means.packs.items()
        }
        self._options()
        self._vehicles()
        self._packs()
        self._keep_apart(conflicts)
        self._one_by_one(conflicts)
        self._alike_in_order(conflicts)
        if most_vehicles is not None:
            self._model.add(sum(self._used.values()) <= most_vehicles)
        self._makespan = self._time("makespan")
        for end in self._end:
            self._model.add(self._makespan >= end)
        self._wait_for_chargers()
        turns = first_turns(tasks, means, conflicts, most_vehicles=most_vehicles)
        if turns is not None and tasks:
            self._begin_at(turns)

    def _wait_for_chargers(self) -> None:
        """Say how long the charges take that come before other flights: all but the last of each pack.

        It follows from the rest; with it the bound of dozens of sorties on few packs is near what is found.
        """
        means, ways = (
            self._means,
            [
                [use for option in task.options for use in option.packs]
                for task in self._tasks
                if task.options and all(option.packs for option in task.options)
            ],
        )
        before = len(ways) - sum(group.count for group in means.packs.values())
        if before <= 0 or not means.chargers:
            return
        charges_s = sorted(
            min(min(use.charge_s.values(), default=0.0) for use in own) for own in ways
        )
        flight_s = min(option.duration_s for task in self._tasks for option in task.options)
        window_s = math.fsum(charges_s[:before]) / sum(means.chargers.values())
        self._model.add(self._makespan >= ms(2.0 * flight_s + means.swap_s + window_s) - 1)

    def _begin_at(self, turns: FirstSchedule) -> None:
        """Hint at a first schedule."""
        hints: list[tuple[IntVar, int]] = []
        for place, turn in turns.of_tasks.items():
            hints += [(self._start[place], turn.start), (self._end[place], turn.end)]
            hints += [(flies, way == turn.way) for way, flies in enumerate(self._flies[place])]
            if turn.packs is not None:
                hints += [(self._on[place], turn.on)]
                hints += [(self._back[place], min(turn.full, self._horizon))]
        hints += [
            (takes, turns.of_tasks[place].packs == name)
            for (place, name), takes in self._takes.items()
        ]
        for name, capacity in self._capacity.items():
            hints.append((capacity, turns.packs.get(name, 0)))
            filled = zip(self._first[name], turns.first.get(name, ()), strict=False)
            hints += [(full, at[1]) for full, at in filled]
        hints.append((self._makespan, max(turn.end for turn in turns.of_tasks.values())))
        for variable, value in hints:
            self._model.add_hint(variable, value)

    def is_infeasible(self, effort_s: float) -> bool:
        """Return whether it is proven that there is no schedule."""
        return bool(self._solved(effort_s)[1] == self._cp.INFEASIBLE)

    def best(self, minimize: Objective, *, effort_s: float) -> Schedule | None:
        """Return the best schedule; each further objective among those equal in the ones before."""
        amounts: dict[Objective, LinearExprT] = {
            Objective.ENERGY: sum(
                _whole(option.energy_wh * _MWH) * flies
                for task, own in zip(self._tasks, self._flies, strict=True)
                for option, flies in zip(task.options, own, strict=True)
            ),
            Objective.MAKESPAN: self._makespan,
            Objective.VEHICLES: sum(self._used.values()),
            Objective.BATTERIES: sum(self._capacity.values()),
        }
        early = sum(
            (1 + task.priority) * start
            for task, start in zip(self._tasks, self._start, strict=True)
        )
        stages = [*(amounts[one] for one in _ORDER[minimize]), early]
        found: CpSolver | None = None
        bound, is_best = 0.0, False
        for number, amount in enumerate(stages):
            if found is not None and self._patience.cut_short and amount is not early:
                continue  # late starts cross others, and cost more to mend than to avoid
            self._model.minimize(amount)
            solver, status = self._solved(effort_s * (_FURTHER if number else 1.0))
            if status == self._cp.UNKNOWN and found is None:
                # the first that is found is looked for longer, whoever waits: any will do
                solver = self._solver(EFFORT_S * _FIRST)
                solver.parameters.stop_after_first_solution = bool(self._patience.cut_short)
                status = Patience().solved(solver, self._model)
            if status == self._cp.INFEASIBLE and found is None:
                return None
            if status not in {self._cp.OPTIMAL, self._cp.FEASIBLE}:
                if found is None:
                    msg = (
                        f"no schedule of {len(self._tasks)} sorties was found with an effort of "
                        f"{effort_s:g} s: give it longer"
                    )
                    raise UsageError(msg)
                break
            found = solver
            if number == 0:
                bound, is_best = solver.best_objective_bound, status == self._cp.OPTIMAL
            self._model.add(amount <= round(solver.objective_value))
            self._hint(solver)
        assert found is not None
        scale = {Objective.ENERGY: _MWH, Objective.MAKESPAN: MS}.get(minimize, 1)
        return self._schedule(found, bound=bound / scale, is_best=is_best)

    def _solver(self, effort_s: float, relaxations: int = 0) -> CpSolver:
        solver: CpSolver = self._cp.CpSolver()
        solver.parameters.num_workers = 1
        solver.parameters.random_seed = 1
        solver.parameters.max_deterministic_time = effort_s
        # Else each schedule is better than the last by a millisecond: 162 s found where 68 is least.
        solver.parameters.binary_search_num_conflicts = _HALVED_AFTER
        solver.parameters.linearization_level = relaxations
        return solver

    def _solved(self, effort_s: float) -> tuple[CpSolver, Any]:
        if self._patience.cut_short:
            effort_s = min(effort_s, _HURRIED_S)
        found: tuple[CpSolver, Any] | None = None
        is_wide = sum(map(len, self._flies)) > _WIDE
        for relaxations, share in ((0, _PLAIN), (0, _WIDELY) if is_wide else (2, _RELAXED)):
            solver = self._solver(share * effort_s, relaxations)
            status = self._patience.solved(solver, self._model)
            if status == self._cp.FEASIBLE:
                self._hint(solver)
            if found is None or (
                status != self._cp.UNKNOWN
                and (
                    found[1] == self._cp.UNKNOWN
                    or solver.objective_value <= found[0].objective_value
                )
            ):
                found = solver, status
            if status in {self._cp.OPTIMAL, self._cp.INFEASIBLE}:
                break
        assert found is not None
        return found

    def _hint(self, solver: CpSolver) -> None:
        self._model.clear_hints()  # type: ignore[no-untyped-call] # of OR-Tools
        for variable in (*self._start, *(one for own in self._flies for one in own)):
            self._model.add_hint(variable, solver.value(variable))

    def _longest_ms(self, conflicts: Conflicts) -> int:
        """Return a time by which everything can have been flown one after the other, and charged."""
        swap_s = self._means.swap_s
        longest_s = max(
            (latest for latest in [self._means.latest_s] if latest < _EVER), default=0.0
        )
        for task in self._tasks:
            charges_s = [
                s for option in task.options for use in option.packs for s in use.charge_s.values()
            ]
            longest_s += max((one.duration_s for one in task.options), default=0.0) + 2.0 * swap_s
            longest_s += max(charges_s, default=0.0) + task.earliest_s
        for group in self._means.packs.values():
            longest_s += group.count * max(group.charge_first_s.values(), default=0.0)
        longest_s += sum(
            max((abs(end) for pair in closed for end in pair if math.isfinite(end)), default=0.0)
            for closed in conflicts.values()
        )
        longest_s += max((first for first, _ in self._means.vehicles.values()), default=0.0)
        return math.ceil(longest_s * MS) + 1

    def _time(self, name: str) -> IntVar:
        return self._model.new_int_var(0, self._horizon, name)

    def _options(self) -> None:
        """Have each task flown in one of its ways, within its times."""
        model, means = self._model, self._means
        for task, start, end, flies in zip(
            self._tasks, self._start, self._end, self._flies, strict=True
        ):
            model.add_exactly_one(flies)
            model.add(start >= math.ceil(task.earliest_s * MS))
            latest_s = min(task.latest_s, means.latest_s)
            if latest_s < _EVER:
                model.add(end <= math.floor(latest_s * MS))
            for option, flown in zip(task.options, flies, strict=True):
                from_s, until_s = means.vehicles[option.vehicle]
                model.add(end == start + ms(option.duration_s)).only_enforce_if(flown)
                model.add(start >= math.ceil(from_s * MS)).only_enforce_if(flown)
                if until_s < _EVER:
                    model.add(end <= math.floor(until_s * MS)).only_enforce_if(flown)
                model.add_implication(flown, self._used[option.vehicle])

    def _vehicles(self) -> None:
        """Let a vehicle fly one sortie at a time, made ready between two."""
        turns = defaultdict(list)
        for place, task in enumerate(self._tasks):
            for option, flown in zip(task.options, self._flies[place], strict=True):
                turns[option.vehicle].append(
                    self._model.new_optional_fixed_size_interval_var(
                        self._start[place],
                        ms(option.duration_s + self._means.swap_s),
                        flown,
                        f"{task.name} by {option.vehicle}",
                    )
                )
        for own in turns.values():
            self._model.add_no_overlap(own)

    def _packs(self) -> None:
        """Have a pack taken full, flown, changed and charged again."""
        model, means = self._model, self._means
        self._on_charger: dict[str, list[Any]] = {name: [] for name in means.chargers}
        busy: dict[str, list[Any]] = {
            name: self._filled_first(name) if group.charge_first_s else []
            for name, group in means.packs.items()
        }
        for place, task in enumerate(self._tasks):
            groups = sorted({use.packs for option in task.options for use in option.packs})
            if not groups:
                continue
            full = self._back[place] = self._time(f"{task.name} pack is full again")
            on = self._on[place] = self._time(f"{task.name} pack on a charger")
            model.add(on >= self._end[place] + ms(means.swap_s))
            for name in groups:
                label = f"{task.name} on {name}"
                taken = self._takes[place, name] = model.new_bool_var(label)
                least = self._least_away(task, name)
                away = model.new_int_var(least, max(self._horizon, least), f"{label} for")
                busy[name].append(
                    model.new_optional_interval_var(self._start[place], away, full, taken, label)
                )
            model.add_at_most_one(self._takes[place, name] for name in groups)
            for option, flown in zip(task.options, self._flies[place], strict=True):
                uses = [model.new_bool_var(f"{task.name} on {use.packs}") for use in option.packs]
                for use, used in zip(option.packs, uses, strict=True):
                    model.add_implication(used, self._takes[place, use.packs])
                    model.add_implication(used, flown)
                    self._charged((on, full), use.charge_s, used)
                if uses:
                    model.add_exactly_one([*uses, flown.negated()])
        for name, own in busy.items():
            model.add_cumulative(own, [1] * len(own), self._capacity[name])
        for name, own in self._on_charger.items():
            model.add_cumulative(own, [1] * len(own), means.chargers[name])

    def _least_away(self, task: Task, packs: str) -> int:
        """Return how long a pack of a group is away for a task at least: flown, changed and charged."""
        least_s = (
            option.duration_s + self._means.swap_s + min(use.charge_s.values(), default=0.0)
            for option in task.options
            for use in option.packs
            if use.packs == packs
        )
        return min(math.floor(one_s * MS) for one_s in least_s)

    def _filled_first(self, name: str) -> list[Any]:
        """Return how long each used pack of a group that is not full at the beginning is not there."""
        model, group = self._model, self._means.packs[name]
        busy = []
        for number in range(group.count):
            label = f"{name} {number}"
            used = model.new_bool_var(f"{label} used")
            model.add(self._capacity[name] > number).only_enforce_if(used)
            model.add(self._capacity[name] <= number).only_enforce_if(used.negated())
            on, full = self._time(f"{label} on a charger"), self._time(f"{label} full")
            self._charged((on, full), group.charge_first_s, used)
            busy.append(model.new_optional_interval_var(0, full, full, used, f"{label} not full"))
            self._first[name].append(full)
        return busy

    def _charged(
        self, times: tuple[IntVar, IntVar], charge_s: Mapping[str, float], when: IntVar
    ) -> None:
        """Have a pack charged on one of several chargers where a literal holds; on none, never."""
        model, (on, full) = self._model, times
        ways = []
        for name, time_s in charge_s.items():
            way = model.new_bool_var(f"charged by {name}")
            ways.append(way)
            model.add(full == on + ms(time_s)).only_enforce_if(way)
            model.add_implication(way, when)
            self._on_charger[name].append(
                model.new_optional_fixed_size_interval_var(on, ms(time_s), way, name)
            )
        if ways:
            model.add_exactly_one([*ways, when.negated()])
        else:
            model.add(full == self._horizon).only_enforce_if(when)

    def _keep_apart(self, conflicts: Conflicts) -> None:
        """Keep two sorties from starting where they would come too near to each other.

        Where any of some ways of one task has the same with any of some of another, it is said once.
        """
        alike: dict[tuple[Any, ...], dict[int, set[int]]] = defaultdict(dict)
        for ((i, a), (j, b)), closed in conflicts.items():
            alike[i, j, tuple(closed)].setdefault(a, set()).add(b)
        for (i, j, closed), others in alike.items():
            ways: dict[frozenset[int], list[int]] = defaultdict(list)
            for a, with_b in others.items():
                ways[frozenset(with_b)].append(a)
            free = self._free(closed)
            for others_b, own in ways.items():
                both = (self._flies_one(i, frozenset(own)), self._flies_one(j, others_b))
                if free is None:
                    self._model.add_bool_or([both[0].negated(), both[1].negated()])
                else:
                    self._model.add_linear_expression_in_domain(
                        self._start[j] - self._start[i], free
                    ).only_enforce_if(both)

    def _flies_one(self, task: int, options: frozenset[int]) -> IntVar:
        """Return whether a task is flown in one of some ways."""
        if len(options) == 1:
            return self._flies[task][min(options)]
        at = task, options
        if at not in self._any:
            self._any[at] = any_of = self._model.new_bool_var(f"{task} in one of {len(options)}")
            self._model.add(sum(self._flies[task][one] for one in options) == any_of)
        return self._any[at]

    def _one_by_one(self, conflicts: Conflicts) -> None:
        """Say of flights that all keep starts from each other that these follow one another.

        It follows from the pairs; with it the solver proves in seconds what it else does not in hours.
        """
        after_ms: dict[tuple[int, int], dict[tuple[int, int], int]] = defaultdict(dict)
        for (one, two), closed in conflicts.items():
            about = next(((low, high) for low, high in closed if low < 0.0 < high), None)
            if about is not None:
                low_s, high_s = (min(abs(end), self._horizon / MS) for end in about)
                after_ms[one][two] = math.floor(high_s * MS)
                after_ms[two][one] = math.floor(low_s * MS)
        left = sorted(after_ms, key=lambda one: (-len(after_ms[one]), one))
        while left:
            group: list[tuple[int, int]] = []
            for one in left:
                if all(one[0] == other[0] or other in after_ms[one] for other in group):
                    group.append(one)
            left = [one for one in left if one not in group]
            if len({task for task, _ in group}) > 2:
                self._model.add_no_overlap(
                    self._model.new_optional_fixed_size_interval_var(
                        self._start[task],
                        min(after_ms[task, way].get(other, self._horizon) for other in group),
                        self._flies[task][way],
                        f"{task} by {way} alone",
                    )
                    for task, way in group
                )

    def _alike_in_order(self, conflicts: Conflicts) -> None:
        """Start tasks that only their names tell apart in their order: fewer equal schedules."""
        meet = {place for pair in conflicts for place, _ in pair}
        last: dict[str, int] = {}
        for place, task in enumerate(self._tasks):
            if place not in meet:
                kind = repr(replace(task, name=""))
                if kind in last:
                    self._model.add(self._start[last[kind]] <= self._start[place])
                last[kind] = place

    def _free(self, closed: Iterable[tuple[float, float]]) -> Any:  # noqa: ANN401 - a Domain
        """Return the differences that are left; ``None``: none."""
        free: list[list[int]] = []
        low = -self._horizon
        for last, next_ in (closed_ms(*each) for each in sorted(closed)):
            if last >= low:
                free.append([low, last])
            low = max(low, next_)
        if low <= self._horizon:
            free.append([low, self._horizon])
        return self._cp.Domain.from_intervals(free) if free else None

    def _schedule(self, solver: CpSolver, *, bound: float, is_best: bool) -> Schedule:
        chosen = [
            next(number for number, flown in enumerate(own) if solver.boolean_value(flown))
            for own in self._flies
        ]
        options = [task.options[number] for task, number in zip(self._tasks, chosen, strict=True)]
        starts_s = [solver.value(one) / MS for one in self._start]
        packs = self._packs_of(solver)
        energies = [one.energy_wh for one in options if not math.isnan(one.energy_wh)]
        return Schedule(
            departures=tuple(
                Departure(task=place, option=number, start_s=start_s, pack=packs.get(place))
                for place, (number, start_s) in enumerate(zip(chosen, starts_s, strict=True))
            ),
            energy_wh=math.fsum(energies),
            makespan_s=max(solver.value(one) for one in self._end) / MS if self._end else 0.0,
            vehicles=len({one.vehicle for one in options}),
            packs=len(set(packs.values())),
            bound=bound,
            is_best=is_best,
        )

    def _packs_of(self, solver: CpSolver) -> dict[int, tuple[str, int]]:
        """Return which pack of its group each task flies on: the first that is full by then."""
        full: dict[str, list[int]] = {}
        for name, group in self._means.packs.items():
            first = [solver.value(one) for one in self._first[name]] or [0] * group.count
            full[name] = first
        found: dict[int, tuple[str, int]] = {}
        rising = sorted(
            (solver.value(self._start[place]), place, name)
            for (place, name), taken in self._takes.items()
            if solver.boolean_value(taken)
        )
        for start, place, name in rising:
            number = next(n for n, ready in enumerate(full[name]) if ready <= start)
            full[name][number] = solver.value(self._back[place])
            found[place] = (name, number)
        return found


def _whole(value: float) -> int:
    return 0 if math.isnan(value) else round(value)
