"""Schedules of a fleet against figures by hand."""

from __future__ import annotations

import math
from itertools import permutations, product
from typing import TYPE_CHECKING

import numpy as np
import pytest

from planner.fleet.schedule import (
    Means,
    Objective,
    Option,
    PackGroup,
    PackUse,
    Schedule,
    Task,
    best_schedule,
    smallest_conflict,
)

if TYPE_CHECKING:
    from planner.fleet.schedule import Conflicts

HOUR = 3600.0


def tasks_of(durations_s: list[float], vehicles: list[str], *packs: PackUse) -> list[Task]:
    """Sorties that any vehicle flies in the same time, each for its seconds in Wh."""
    return [
        Task(
            name=f"sortie {number}",
            options=tuple(
                Option(vehicle=one, duration_s=time_s, energy_wh=time_s, packs=packs)
                for one in vehicles
            ),
        )
        for number, time_s in enumerate(durations_s)
    ]


def free(vehicles: list[str]) -> dict[str, tuple[float, float]]:
    return {one: (0.0, float("inf")) for one in vehicles}


def test_nine_sorties_on_four_vehicles_take_twelve_where_the_longest_first_takes_fifteen() -> None:
    vehicles = ["a", "b", "c", "d"]
    made = best_schedule(
        tasks_of([7, 7, 6, 6, 5, 5, 4, 4, 4], vehicles),
        Means(vehicles=free(vehicles)),
        {},
        minimize=Objective.MAKESPAN,
    )
    assert made is not None
    assert (made.makespan_s, made.is_best, made.bound) == (12.0, True, 12.0)


@pytest.mark.parametrize(
    ("count", "chargers", "makespan_h"),
    [
        # A flight of 30 min, 2 min to change, an hour to charge: a pack is back after 92 min.
        (3, 2, 3 * 32 / 60 + 0.5),  # a flight every 32 min; the fourth on the first, full at 92
        (2, 2, (92 + 32 + 30) / 60),
        (1, 1, (3 * 92 + 30) / 60),
    ],
)
def test_packs_and_chargers_limit_how_often_a_vehicle_flies(
    count: int, chargers: int, makespan_h: float
) -> None:
    tasks = tasks_of([0.5 * HOUR] * 4, ["a"], PackUse(packs="p", charge_s={"c": HOUR}))
    made = best_schedule(
        tasks,
        Means(
            vehicles=free(["a"]),
            packs={"p": PackGroup(count=count)},
            chargers={"c": chargers},
            swap_s=120.0,
        ),
        {},
        minimize=Objective.MAKESPAN,
    )
    assert made is not None
    assert made.makespan_s == pytest.approx(makespan_h * HOUR)
    assert made.is_best


def test_three_tracks_through_one_point_start_as_far_apart_as_all_three_need() -> None:
    # 10 m/s, 10 m, at 0°, 60° and 120°: pairwise advice starts the second and the third together.
    tasks = tasks_of([100.0] * 3, ["a", "b", "c"])
    tracks = [
        Task(name=task.name, options=(task.options[number],)) for number, task in enumerate(tasks)
    ]
    near = {(0, 1): 1.1608, (1, 2): 1.1608, (0, 2): 2.0106}
    conflicts = {((i, 0), (j, 0)): ((-apart, apart),) for (i, j), apart in near.items()}
    made = best_schedule(
        tracks, Means(vehicles=free(["a", "b", "c"])), conflicts, minimize=Objective.MAKESPAN
    )
    assert made is not None
    # whole milliseconds: 1.161 twice
    assert made.makespan_s == pytest.approx(100.0 + 2.3216, abs=1e-3)


def test_twelve_flights_of_which_any_two_start_apart_are_proven_to_need_eleven_gaps() -> None:
    # Each 2 s after the one before, whichever that is: pair by pair the solver would try every order.
    tasks = [
        Task(name=task.name, options=(task.options[number],))
        for number, task in enumerate(tasks_of([100.0] * 12, [f"v{n}" for n in range(12)]))
    ]
    conflicts = {((i, 0), (j, 0)): ((-2.0, 2.0),) for i in range(12) for j in range(i + 1, 12)}
    means = Means(vehicles=free([f"v{n}" for n in range(12)]))
    made = best_schedule(tasks, means, conflicts, minimize=Objective.MAKESPAN, effort_s=0.3)
    assert made is not None
    assert (made.makespan_s, made.is_best) == (122.0, True)


@pytest.mark.parametrize(("count", "least"), [(4, 2), (5, 3), (6, 2)])
def test_a_ring_of_conflicts_takes_two_layers_or_three(count: int, least: int) -> None:
    def made(layers: int, latest_s: float) -> tuple[list[Task], Means, Conflicts]:
        tasks = [
            Task(
                name=f"sortie {place}",
                options=tuple(
                    Option(vehicle=f"v{place}", duration_s=100.0, energy_wh=10.0 + layer)
                    for layer in range(layers)
                ),
                latest_s=latest_s,
            )
            for place in range(count)
        ]
        conflicts = {
            ((one, layer), ((one + 1) % count, layer)): ((-50.0, 50.0),)
            for one in range(count)
            for layer in range(layers)
        }
        return tasks, Means(vehicles=free([f"v{place}" for place in range(count)])), conflicts

    found = best_schedule(*made(least, 100.0), minimize=Objective.ENERGY)
    assert found is not None
    tasks, means, conflicts = made(least - 1, 100.0)
    assert best_schedule(tasks, means, conflicts, minimize=Objective.ENERGY) is None
    core = smallest_conflict(tasks, means, conflicts)
    # an even ring lacks a second layer for any two neighbours, an odd one for all of it
    assert len(core) == (count if count % 2 else 2)
    # 50 s later there is no need of another layer
    assert best_schedule(*made(1, math.inf), minimize=Objective.ENERGY) is not None


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
        vehicles=free(vehicles),
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


def brute_force(tasks: list[Task], means: Means, conflicts: Conflicts) -> dict[Objective, float]:
    """Least amounts among schedules that take the sorties in any order, each as early as it can.

    Packs are charged as they land, on the charger that has them back first.
    """
    least: dict[Objective, float] = {}
    packs = [(name, n) for name, group in means.packs.items() for n in range(group.count)]
    for order in permutations(range(len(tasks))):
        for ways in product(*(range(len(tasks[one].options)) for one in order)):
            for taken in product(range(len(packs)), repeat=len(order)):
                found = _in_order(
                    order, ways, [packs[one] for one in taken], tasks, means, conflicts
                )
                if found is not None:
                    for name, amount in found.items():
                        least[name] = min(least.get(name, math.inf), amount)
    return least


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


@pytest.mark.parametrize("seed", range(6))
def test_no_order_of_a_small_fleet_is_better_than_the_schedule(seed: int) -> None:
    rng = np.random.default_rng(seed)
    tasks, means, conflicts = random_fleet(rng, sorties=3)
    least = brute_force(tasks, means, conflicts)
    for objective in Objective:
        made = best_schedule(tasks, means, conflicts, minimize=objective)
        if made is None:
            assert objective not in least
            continue
        assert faults(made, tasks, means, conflicts) == []
        assert made.is_best
        assert made.amount(objective) == pytest.approx(made.bound, abs=1e-6)
        assert made.amount(objective) <= least.get(objective, math.inf) + 1e-6
