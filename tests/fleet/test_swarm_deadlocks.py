"""Agents that wait for each other: resolved by turns, by going aside, or reported with their members."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import pad, place, sortie, up, vehicles
from made_missions import mission, rtl
from made_swarm import MODEL, SEPARATION_M, agent, on_circle, simulated, with_faults
from swarm_judge import JUDGED_TO_M, least_distance_m, least_of_flights_m

from planner.fleet.swarm.flights import Record
from planner.fleet.swarm.policies import OrcaStop, StopInTime
from planner.fleet.swarm.simulation import Swarm
from planner.values import replace

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.situation import SwarmSituation
    from planner.mission.items import Mission
    from planner.service.swarm import SwarmResult

POLICIES = [StopInTime(), OrcaStop()]


def judged(swarm: Swarm) -> Swarm:
    record = Record.of([*swarm.run()], swarm)
    assert least_distance_m(record) >= SEPARATION_M - JUDGED_TO_M
    return swarm


@pytest.mark.parametrize("policy", POLICIES)
def test_three_that_each_want_the_place_of_the_next_get_there(policy: Policy) -> None:
    agents, _ = on_circle(3, radius_m=15.0)
    places = [np.array([(one.east_m, one.north_m)]) for one in agents]
    swarm = judged(with_faults(agents, [places[1], places[2], places[0]], policy))
    assert swarm.has_landed.all()


@pytest.mark.parametrize("policy", POLICIES)
@pytest.mark.parametrize("count", [2, 4, 5, 6])
def test_exact_symmetry_is_broken_by_rank(policy: Policy, count: int) -> None:
    agents, ways = on_circle(count, radius_m=60.0)
    assert judged(with_faults(agents, ways, policy)).has_landed.all()


@pytest.mark.parametrize("policy", POLICIES)
def test_two_that_stand_a_centimetre_beyond_the_gap_set_out(policy: Policy) -> None:
    agents = [agent("ahead", 0.0, 0.0), agent("behind", 0.0, 10.01)]
    ways = [np.array([(0.0, -100.0)]), np.array([(0.0, -80.0)])]
    assert judged(with_faults(agents, ways, policy)).has_landed.all()


class Stays:
    """An algorithm: the first flies far away, the others stay for ever."""

    def __init__(self, goals_m: FloatArray) -> None:
        self._goals_m = goals_m

    def goals_m(self, situation: SwarmSituation) -> FloatArray:  # noqa: ARG002 - as every algorithm
        return self._goals_m.copy()


def boxed_in(policy: Policy) -> Swarm:
    """One between three that stay, 11.4 m from it and 19.7 m from each other: no gap of 20 m."""
    around, _ = on_circle(3, radius_m=11.4)
    agents = [agent("in", 0.0, 0.0), *around]
    goals_m = np.array([(100.0, 0.0), *((one.east_m, one.north_m) for one in around)])
    return judged(Swarm(agents, Stays(goals_m), policy, separation_m=SEPARATION_M, until_s=300.0))


@pytest.mark.parametrize("policy", POLICIES)
def test_an_agent_boxed_in_is_let_out(policy: Policy) -> None:
    swarm = boxed_in(policy)
    assert swarm.places()[0][0] == pytest.approx((100.0, 0.0), abs=1.0)
    # Those that made way are back.
    assert np.hypot(*swarm.places()[0][1:].T) == pytest.approx([11.4] * 3, abs=1.0)


@pytest.mark.parametrize("policy", POLICIES)
def test_two_that_want_to_stay_at_one_place_are_reported_by_name(policy: Policy) -> None:
    agents = [agent("a", -40.0, 0.0), agent("b", 40.0, 0.0), agent("c", 0.0, 60.0)]
    goals_m = np.array([(0.0, 0.0), (5.0, 0.0), (60.0, 60.0)])
    swarm = Swarm(agents, Stays(goals_m), policy, separation_m=SEPARATION_M, until_s=900.0)
    assert judged(swarm).deadlock == ("a", "b")


def test_who_waits_to_land_on_pads_next_to_each_other_lands() -> None:
    """Nine on three rows of pads, come home from everywhere: reciprocal velocities alone jam over them."""
    home_m = np.array([(16.0 * (n % 3), -16.0 * (1 + n // 3)) for n in range(9)])
    drawn_m = np.random.default_rng(1).uniform(0.0, 120.0, (9, 1, 2))
    agents = [
        replace(agent(f"a{n}", *one), landing_s=20.0, climb_s=10.0)
        for n, one in enumerate(home_m.tolist())
    ]
    ways = [np.vstack((way, home)) for way, home in zip(drawn_m, home_m, strict=True)]
    assert judged(with_faults(agents, ways, OrcaStop())).has_landed.all()


SEPARATION = "[separation]\nhorizontal_m = 10\n"


def filed(routes: dict[str, list[tuple[float, float]]], *, model: str = MODEL) -> SwarmResult:
    """One vehicle a route, from a pad at its first place along the others and home again, all at once."""
    tables, missions = SEPARATION, {}
    for name, (first, *others) in routes.items():
        tables += pad(name, *first) + vehicles(name, model=model)
        tables += sortie(f"s-{name}", name, 0.0, job=f"m{name}")
        missions[f"m{name}"] = flown(others)
    return simulated(tables, policy="stop", **missions)


def flown(places: list[tuple[float, float]]) -> Mission:
    return mission(up(30), *(place(north, east, 30) for north, east in places), rtl())


def is_told(result: SwarmResult) -> bool:
    """Whether all keep apart, and land or are named."""
    assert "S128" not in {one.code for one in result.findings}
    assert least_of_flights_m(result, above_m=10.0) >= 15.0 - JUDGED_TO_M
    named = " ".join(one.message for one in result.findings if one.code == "S129")
    return all(one.has_landed or one.name in named for one in result.agents)


def test_filed_tracks_in_a_ring_each_into_the_next_are_flown_by_turns_or_named() -> None:
    # A triangle of 60 m, each from the middle of a side round the next corner to the next middle.
    corner = [(0.0, 0.0), (0.0, 60.0), (52.0, 30.0)]
    middle = [(0.0, 30.0), (26.0, 45.0), (26.0, 15.0)]
    assert is_told(
        filed({f"v{k}": [middle[k], corner[(k + 1) % 3], middle[(k + 1) % 3]] for k in range(3)})
    )


def test_of_equal_priorities_the_first_in_the_file_goes_first() -> None:
    result = filed({"a": [(0, 0), (200, 0)], "b": [(100, -100), (100, 100)]})
    assert [one.stops > 0 for one in result.agents] == [False, True]
    assert is_told(result)
    assert all(one.has_landed for one in result.agents)


@pytest.mark.parametrize("model", [MODEL, "px4-sih-quad", "arducopter-sitl-quad"])
def test_a_stop_longer_than_the_leg_is_free(model: str) -> None:
    # Legs of 8 m along the way; a stop from full speed takes four times as much.
    steps = [(8.0 * k, 2.0 * (-1) ** k) for k in range(1, 16)]
    result = filed({"a": [(60, -100), (60, 100)], "b": [(0, 0), *steps]}, model=model)
    assert is_told(result)
    assert all(one.has_landed for one in result.agents)
