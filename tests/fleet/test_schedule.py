"""Schedules of a fleet against figures by hand."""

from __future__ import annotations

import math
import threading
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_schedules import brute_force, faults, random_fleet, unbounded

from planner.fleet.schedule import (
    Means,
    Objective,
    Option,
    PackGroup,
    PackUse,
    Patience,
    Task,
    best_schedule,
    smallest_conflict,
)
from planner.fleet.turns import first_turns

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


def test_nine_sorties_on_four_vehicles_take_twelve_where_the_longest_first_takes_fifteen() -> None:
    vehicles = ["a", "b", "c", "d"]
    made = best_schedule(
        tasks_of([7, 7, 6, 6, 5, 5, 4, 4, 4], vehicles),
        Means(vehicles=unbounded(vehicles)),
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
            vehicles=unbounded(["a"]),
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
        tracks, Means(vehicles=unbounded(["a", "b", "c"])), conflicts, minimize=Objective.MAKESPAN
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
    means = Means(vehicles=unbounded([f"v{n}" for n in range(12)]))
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
        return tasks, Means(vehicles=unbounded([f"v{place}" for place in range(count)])), conflicts

    found = best_schedule(*made(least, 100.0), minimize=Objective.ENERGY)
    assert found is not None
    tasks, means, conflicts = made(least - 1, 100.0)
    assert best_schedule(tasks, means, conflicts, minimize=Objective.ENERGY) is None
    core = smallest_conflict(tasks, means, conflicts)
    # an even ring lacks a second layer for any two neighbours, an odd one for all of it
    assert len(core) == (count if count % 2 else 2)
    # 50 s later there is no need of another layer
    assert best_schedule(*made(1, math.inf), minimize=Objective.ENERGY) is not None


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


@pytest.mark.parametrize(("seed", "sorties"), [(3, 4), (11, 6), (70, 5)])
def test_sorties_that_wait_for_packs_are_planned_to_the_least(seed: int, sorties: int) -> None:
    # One schedule better than the last by a millisecond, and packs away for no time at all: the search
    # ended at 162 s of 68, and at 304 s of 283.
    rng = np.random.default_rng(seed)
    tasks, means, conflicts = random_fleet(rng, sorties=sorties)
    made = best_schedule(tasks, means, conflicts, minimize=Objective.MAKESPAN)
    assert made is not None
    assert faults(made, tasks, means, conflicts) == []
    least = brute_force(tasks, means, conflicts, draws=(rng, 300))
    assert made.makespan_s <= least[Objective.MAKESPAN]
    assert made.is_best


def test_sorties_on_few_packs_begin_with_each_in_its_turn() -> None:
    """Two packs of 100 s and a charger of 1,000 s: a pack is full at 1,110, 2,110, 3,110 s …"""
    uses = PackUse(packs="P", charge_s={"c": 1000.0})
    tasks = tasks_of([100.0] * 5, ["a", "b"], uses)
    means = Means(
        vehicles=unbounded(["a", "b"]),
        packs={"P": PackGroup(count=2)},
        chargers={"c": 1},
        swap_s=10.0,
    )
    turns = first_turns(tasks, means, {}, most_vehicles=1)
    assert turns is not None
    starts = [turns.of_tasks[place].start for place in range(5)]
    assert starts == [0, 110_000, 1_110_000, 2_110_000, 3_110_000]
    made = best_schedule(tasks, means, {}, minimize=Objective.MAKESPAN, effort_s=0.1)
    assert made is not None
    # three charges before the last flight: the bound says so too
    assert (made.makespan_s, made.bound, made.is_best) == (3210.0, 3210.0, True)


def test_who_starts_in_turn_keeps_out_of_the_way_of_those_before() -> None:
    tasks = tasks_of([100.0, 100.0], ["a", "b"])
    closed = {
        ((0, one), (1, two)): ((-math.inf, 30.0), (40.0, 130.0)) for one in (0, 1) for two in (0, 1)
    }
    means = Means(vehicles={"a": (5.0, math.inf), "b": (5.0, math.inf)})
    turns = first_turns(tasks, means, closed, most_vehicles=None)
    assert turns is not None
    assert [turns.of_tasks[place].start for place in (0, 1)] == [5_000, 35_000]
    late = Means(vehicles={"a": (0.0, 150.0)})
    assert first_turns(tasks_of([100.0, 100.0], ["a"]), late, {}, most_vehicles=None) is None


def test_a_search_that_is_stopped_keeps_the_best_so_far() -> None:
    rng = np.random.default_rng(1)
    names = [f"v{number}" for number in range(25)]
    tasks = [
        Task(name=task.name, options=(task.options[number],))
        for number, task in enumerate(tasks_of(rng.uniform(50.0, 60.0, 25).tolist(), names))
    ]
    conflicts = {
        ((i, 0), (j, 0)): ((-float(rng.uniform(1.0, 9.0)), float(rng.uniform(1.0, 9.0))),)
        for i in range(25)
        for j in range(i + 1, 25)
    }
    patience = Patience()
    threading.Timer(0.3, patience.stop).start()
    made = best_schedule(
        tasks,
        Means(vehicles=unbounded(names)),
        conflicts,
        minimize=Objective.MAKESPAN,
        effort_s=30.0,
        patience=patience,
    )
    assert patience.cut_short == "it was interrupted"
    assert made is not None
    assert (faults(made, tasks, Means(vehicles=unbounded(names)), conflicts), made.is_best) == (
        [],
        False,
    )
