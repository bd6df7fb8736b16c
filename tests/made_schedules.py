"""Random small fleets as numbers, what brute force finds for them, and what is wrong with a schedule."""

from __future__ import annotations

import math
from itertools import permutations, product
from typing import TYPE_CHECKING

from planner.fleet.schedule import Means, Objective, Option, PackGroup, PackUse, Schedule, Task

if TYPE_CHECKING:
    from collections.abc import Iterator

    import numpy as np

    from planner.fleet.schedule import Conflicts


def unbounded(vehicles: list[str]) -> dict[str, tuple[float, float]]:
    return {one: (0.0, float("inf")) for one in vehicles}


def random_fleet(rng: np.random.Generator, sorties: int) -> tuple[list[Task], Means, Conflicts]:
    """Up to 3 vehicles, 4 packs of two kinds and 2 chargers."""
    vehicles = ["a", "b", "c"][: int(rng.integers(1, 4))]
    kinds = ["large", "small"][: int(rng.integers(1, 3))]
    chargers = {"fast": 1, "slow": 1} if rng.random() < 0.8 else {}
    tasks = []
    for number in range(sorties):
        options: list[Option] = []
        for vehicle in vehicles:
            if rng.random() < 0.8 or (vehicle == vehicles[-1] and not options):
                time_s = float(rng.integers(5, 40))
                uses = tuple(
                    PackUse(
                        packs=kind,
                        charge_s={name: float(rng.integers(10, 60)) for name in chargers},
                    )
                    for kind in kinds
                )
                options.append(
                    Option(
                        vehicle=vehicle,
                        duration_s=time_s,
                        energy_wh=time_s * float(rng.integers(1, 4)),
                        packs=uses,
                    )
                )
        tasks.append(
            Task(
                name=f"sortie {number}",
                options=tuple(options),
                earliest_s=float(rng.integers(0, 20)) if rng.random() < 0.3 else 0.0,
                latest_s=float(rng.integers(60, 200)) if rng.random() < 0.3 else math.inf,
            )
        )
    conflicts = {}
    for i in range(sorties):
        for j in range(i + 1, sorties):
            if rng.random() < 0.5:
                width_s = float(rng.integers(2, 25))
                for a, b in product(range(len(tasks[i].options)), range(len(tasks[j].options))):
                    if tasks[i].options[a].vehicle != tasks[j].options[b].vehicle:
                        conflicts[(i, a), (j, b)] = ((-width_s, width_s / 2.0),)
    means = Means(
        vehicles=unbounded(vehicles),
        packs={kind: PackGroup(count=int(rng.integers(1, 3))) for kind in kinds},
        chargers=chargers,
        swap_s=float(rng.integers(0, 5)),
    )
    return tasks, means, conflicts


def is_clear(chosen: list[tuple[int, int, float]], conflicts: Conflicts) -> bool:
    """Whether no two of (task, option, start) are where they must not be."""
    for one, a, first_s in chosen:
        for two, b, second_s in chosen:
            for low_s, high_s in conflicts.get(((one, a), (two, b)), ()):
                if low_s + 1e-9 < second_s - first_s < high_s - 1e-9:
                    return False
    return True


def brute_force(
    tasks: list[Task],
    means: Means,
    conflicts: Conflicts,
    *,
    draws: tuple[np.random.Generator, int] | None = None,
) -> dict[Objective, float]:
    """Least amounts among schedules that take the sorties in any order, each as early as it can.

    Packs are charged as they land, on the charger that has them back first.  All of them, or so many
    that are drawn: what these find is possible too.
    """
    packs = [(name, n) for name, group in means.packs.items() for n in range(group.count)]
    every: Iterator[tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]] = (
        (order, ways, taken)
        for order in permutations(range(len(tasks)))
        for ways in product(*(range(len(tasks[one].options)) for one in order))
        for taken in product(range(len(packs)), repeat=len(order))
    )
    if draws is not None:
        rng, count = draws
        every = (_drawn(rng, tasks, len(packs)) for _ in range(count))
    least: dict[Objective, float] = {}
    for order, ways, taken in every:
        found = _in_order(order, ways, [packs[one] for one in taken], tasks, means, conflicts)
        if found is not None:
            for name, amount in found.items():
                least[name] = min(least.get(name, math.inf), amount)
    return least


def _drawn(
    rng: np.random.Generator, tasks: list[Task], packs: int
) -> tuple[tuple[int, ...], tuple[int, ...], tuple[int, ...]]:
    order = tuple(rng.permutation(len(tasks)).tolist())
    ways = tuple(int(rng.integers(len(tasks[one].options))) for one in order)
    return order, ways, tuple(rng.integers(packs, size=len(order)).tolist())


def _in_order(
    order: tuple[int, ...],
    ways: tuple[int, ...],
    taken: list[tuple[str, int]],
    tasks: list[Task],
    means: Means,
    conflicts: Conflicts,
) -> dict[Objective, float] | None:
    ready = dict.fromkeys(means.vehicles, 0.0)
    full: dict[tuple[str, int], float] = {}
    charger = dict.fromkeys(means.chargers, 0.0)
    chosen: list[tuple[int, int, float]] = []
    end_s = energy_wh = 0.0
    for one, way, pack in zip(order, ways, taken, strict=True):
        task, option = tasks[one], tasks[one].options[way]
        start_s = max(task.earliest_s, ready[option.vehicle], full.get(pack, 0.0))
        while not is_clear([*chosen, (one, way, start_s)], conflicts):
            start_s += 0.5  # all of the figures are multiples of it
        landed_s = start_s + option.duration_s
        if landed_s > task.latest_s:
            return None
        chosen.append((one, way, start_s))
        ready[option.vehicle] = landed_s + means.swap_s
        use = next(use for use in option.packs if use.packs == pack[0])
        full[pack] = math.inf
        if use.charge_s:
            name = min(
                use.charge_s, key=lambda each: max(charger[each], landed_s) + use.charge_s[each]
            )
            full[pack] = max(charger[name], landed_s + means.swap_s) + use.charge_s[name]
            charger[name] = full[pack]
        if math.isinf(start_s):
            return None
        end_s, energy_wh = max(end_s, landed_s), energy_wh + option.energy_wh
    return {
        Objective.ENERGY: energy_wh,
        Objective.MAKESPAN: end_s,
        Objective.VEHICLES: len({tasks[one].options[way].vehicle for one, way, _ in chosen}),
        Objective.BATTERIES: len(set(taken)),
    }


def faults(made: Schedule, tasks: list[Task], means: Means, conflicts: Conflicts) -> list[str]:
    """What is wrong with a schedule, by rules of its own."""
    found = []
    flown = [(one.task, one.option, one.start_s) for one in made.departures]
    if sorted(one.task for one in made.departures) != list(range(len(tasks))):
        found.append("a sortie is missing")
    if not is_clear(flown, conflicts):
        found.append("two come too near")
    for one in made.departures:
        task, option = tasks[one.task], tasks[one.task].options[one.option]
        if one.start_s < task.earliest_s or one.start_s + option.duration_s > task.latest_s + 1e-9:
            found.append("out of its times")
        for two in made.departures:
            other = tasks[two.task].options[two.option]
            if two is one or two.start_s < one.start_s:
                continue
            gap_s = two.start_s - one.start_s - option.duration_s
            if option.vehicle == other.vehicle and gap_s < means.swap_s - 1e-9:
                found.append("a vehicle flies two")
            if one.pack == two.pack and one.pack is not None:
                use = next(use for use in option.packs if use.packs == one.pack[0])
                least_s = min(use.charge_s.values(), default=math.inf) + means.swap_s
                if gap_s < least_s - 1e-9:
                    found.append("a pack is not full")
    return found
