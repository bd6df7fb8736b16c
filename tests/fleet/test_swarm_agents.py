"""Numbers of agents: statistics over seeds, what is chosen, and the same in one process and in several."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import pad, vehicles
from made_swarm import MODEL, NORTH_DEG, fleet_of, formation, simulated

from planner.errors import UsageError
from planner.fleet.swarm.algorithms import Waypoints
from planner.report.swarm import numbers_json, numbers_text
from planner.report.text import Medium
from planner.service.swarm_agents import Statistic, SwarmNumbers, SwarmRun, simulate_numbers
from planner.values import replace

if TYPE_CHECKING:
    from planner.fleet.fleet import Fleet


def run(agents: int, seed: int, *, energy_wh: float, time_s: float, clear: bool = True) -> SwarmRun:
    return SwarmRun(
        agents=agents,
        seed=seed,
        goal="area seen",
        unclear=() if clear else ("S137",),
        energy_wh=energy_wh,
        makespan_s=time_s,
        landed_s=time_s,
        time_to_50_s=0.4 * time_s,
        time_to_90_s=0.7 * time_s,
        time_to_100_s=math.inf,
        waited_s=0.0,
        stops=0.0,
    )


def numbers(*runs: SwarmRun, deadline_s: float | None) -> SwarmNumbers:
    return SwarmNumbers(
        file="f.toml",
        algorithm="random",
        policy="stop",
        seeds=2,
        deadline_s=deadline_s,
        reach_percent=None,
        runs=runs,
    )


def test_a_statistic_is_of_nearest_ranks_and_says_what_never_happened() -> None:
    figures = [float(one) for one in range(1, 21)]
    assert Statistic.of(figures) == Statistic(mean=10.5, p10=2.0, p90=18.0)
    once = Statistic.of([*figures[:-1], math.inf])
    assert (once.mean, once.p90) == (math.inf, 18.0)
    assert Statistic.of([7.0]) == Statistic(mean=7.0, p10=7.0, p90=7.0)


def test_the_number_chosen_is_clear_in_time_and_of_least_energy() -> None:
    found = numbers(
        *(run(1, seed, energy_wh=50.0, time_s=900.0) for seed in range(2)),
        *(run(2, seed, energy_wh=52.0 + seed, time_s=500.0) for seed in range(2)),
        *(run(3, seed, energy_wh=51.0, time_s=400.0, clear=seed > 0) for seed in range(2)),
        *(run(4, seed, energy_wh=51.5, time_s=350.0) for seed in range(2)),
        deadline_s=600.0,
    )
    marks = {row.agents: found.marks(row) for row in found.rows}
    assert marks == {
        1: ("too late",),
        2: ("fewest in time",),
        3: ("not clear",),
        4: ("least energy",),
    }
    assert found.rows[1].energy_wh.mean == 52.5
    free = replace(found, deadline_s=None)
    assert free.fewest_in_time is None
    assert free.least_energy is not None
    assert free.least_energy.agents == 1
    # all runs come to 90 % of the goal, and none to all of it
    assert replace(found, reach_percent=90).chosen == found.chosen
    none = replace(found, reach_percent=100)
    assert none.chosen == ()
    assert none.marks(none.rows[0]) == ("too late", "goal missed")
    text = numbers_text(found, medium=Medium())
    assert text.startswith("Fewest home by 10:00: 2 agents; least energy: 4 agents, 51.5 Wh\n")
    assert "52.0 Wh to 53.0 Wh" in text
    assert '"time_to_100_s_mean": null' in numbers_json(found, version="1")


def test_each_number_is_the_simulation_of_so_many() -> None:
    """A formation of two that do not meet: twice the energy of one, in the same time."""
    found = simulate_numbers(fleet_of(formation(20.0)), (2, 1, 2), seeds=range(5), policy="none")
    one, two = found.rows
    assert [(row.agents, row.runs) for row in found.rows] == [(1, 1), (2, 1)]  # nothing is drawn
    whole = simulated(formation(20.0), policy="none")
    assert two.energy_wh.mean == whole.energy_wh
    assert two.energy_wh.mean == pytest.approx(2.0 * one.energy_wh.mean, rel=1e-9)
    assert two.makespan_s.mean == whole.makespan_s
    assert one.makespan_s.mean == pytest.approx(whole.makespan_s, rel=1e-9)
    assert found.least_energy == one
    assert [one.code for one in found.findings] == ["S133"]


def test_what_runs_find_is_told_of_the_numbers_to_choose_or_of_all() -> None:
    """Its model counts no wind: a warning of each run; on packs that are too small none is clear."""
    windy = '[conditions]\nwind = "2@270"\n' + formation(20.0)
    found = simulate_numbers(fleet_of(windy), (1, 2), policy="none")
    whole = simulated(windy, policy="none")
    assert found.least_energy is not None
    wind, again = (
        [one for one in of.findings if one.code == "S142" and "wind" in one.message]
        for of in (found, whole)
    )
    assert again
    assert [one.message for one in wind] == [
        f"{one.message} (2 agents; 2 of 2 runs)" for one in again
    ]
    small = formation(20.0, '[swap]\ntime_s = 60\n[pack.P]\nbattery = "6Wh"\ncount = 2\n')
    none = simulate_numbers(fleet_of(small), (1, 2), policy="none")
    unclear = sorted({code for run in none.runs for code in run.unclear})
    assert unclear
    assert (
        none.findings[0].message
        == f"1 to 2 agents: none is clear in every run ({', '.join(unclear)})"
    )
    assert {one.code for one in none.findings} >= {"S139", *unclear}


RANDOM = (
    "[separation]\nhorizontal_m = 10\n"
    + pad("a", 0, 0)
    + pad("b", 0, 40)
    + '[swarm]\nalgorithm = "random"\nheight_m = 20\nsearch_s = 60\nsensor_radius_m = 10\n'
    + f"south_deg = 47.0\nwest_deg = 8.0\nnorth_deg = {NORTH_DEG!r}\neast_deg = 8.001\n"
    + '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = 2\n'
    + vehicles("a", "b", model=MODEL)
)


def test_what_is_drawn_is_drawn_by_each_seed_the_same_in_one_process_and_in_two() -> None:
    fleet = fleet_of(RANDOM)
    alone = simulate_numbers(fleet, (1,), seeds=(3, 4), policy="none")
    assert alone.runs[0].energy_wh != alone.runs[1].energy_wh
    together = simulate_numbers(fleet, (1,), seeds=(3, 4), policy="none", workers=2)
    assert numbers_json(alone, version="1") == numbers_json(together, version="1")


def out_and_back(fleet: Fleet, seed: int) -> Waypoints:
    """An algorithm of one's own: so many times 50 m north and back, all at once."""
    way = np.array([(0.0, 50.0), (0.0, 0.0)] * (1 + seed))
    return Waypoints([way + np.array((40.0 * row, 0.0)) for row in range(len(fleet.vehicles))])


def test_an_algorithm_of_ones_own_is_made_for_each_run() -> None:
    found = simulate_numbers(
        fleet_of(RANDOM), (1,), seeds=(0, 1), policy="none", algorithm=out_and_back
    )
    assert found.algorithm == "out_and_back"
    first, second = found.runs
    assert second.makespan_s > first.makespan_s + 10.0


def test_who_stops_it_gets_what_is_done() -> None:
    def stop(text: str) -> None:
        if text.startswith("1 of"):
            raise KeyboardInterrupt

    found = simulate_numbers(fleet_of(formation(20.0)), (1, 2), on_step=stop)
    assert found.is_cut_short
    assert [row.agents for row in found.rows] == [1]
    text = numbers_text(found, medium=Medium())
    assert text.startswith("Cut short: no number of agents to choose")
    assert found.least_energy is None


@pytest.mark.parametrize("agents", [(0,), (1, 3), ()])
def test_numbers_the_fleet_does_not_have_are_refused(agents: tuple[int, ...]) -> None:
    with pytest.raises(
        UsageError, match="has 2 vehicles: numbers of agents must be from 1 to that"
    ):
        simulate_numbers(fleet_of(formation(20.0)), agents)
