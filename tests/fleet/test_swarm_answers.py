"""Algorithms and policies of one's own that answer what nobody can fly: a sentence says what and why."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
import pytest
from made_swarm import fleet_of, formation, search

from planner import UsageError, simulate_fleet
from planner.fleet.swarm.algorithms import strips
from planner.fleet.swarm.coverage import SearchArea

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.fleet.swarm.situation import SwarmSituation

FLEET = fleet_of(formation(20.0))


class Own:
    """An algorithm and a policy that answer what a function makes of the situation."""

    needs_ticks, keeps_apart = True, True

    def __init__(self, answer: Callable[[SwarmSituation], Any]) -> None:
        self.goals_m = self.commands_m_s = answer


@pytest.mark.parametrize("role", ["algorithm", "policy"])
@pytest.mark.parametrize(
    ("answer", "said"),
    [
        (lambda _: None, "must return an array of the shape (2, 2)"),
        (lambda now: now.place_m[:1], "got an array of the shape (1, 2)"),
        (lambda now: now.place_m[:, 0], "got an array of the shape (2,)"),
        (lambda _: "north", "got 'north'"),
        (lambda _: [[0.0, 0.0], [0.0, float("nan")]], "returned (0, nan) for agent 1"),
        (lambda now: now.place_m + np.inf, "returned (inf, inf) for agent 0"),
    ],
)
def test_an_answer_that_cannot_be_flown_is_refused(
    role: str, answer: Callable[[SwarmSituation], Any], said: str
) -> None:
    own: Any = {role: Own(answer)}
    with pytest.raises(UsageError) as refused:
        simulate_fleet(FLEET, **own)
    assert said in str(refused.value)
    assert str(refused.value).startswith("Own.")


def test_no_policy_commands_more_than_the_speed_of_an_agent() -> None:
    fleet = fleet_of(search(agents=1))
    fast = Own(lambda now: 1.01 * now.speed_m_s[:, None] * [1.0, 0.0])
    with pytest.raises(
        UsageError, match=r"returned \(10\.\d+, 0\) for agent 0.* no more than situa"
    ):
        simulate_fleet(fleet, policy=fast)
    full = Own(lambda now: now.speed_m_s[:, None] * [1.0, 0.0])
    assert simulate_fleet(fleet, policy=full, until_s=60.0).distance_m > 100.0


def test_lists_are_answers_too() -> None:
    def goals(now: SwarmSituation) -> list[list[float]]:
        home = [[east, north] for east, north in now.place_m.tolist()]
        return home if now.time_s < 60.0 else [[float("nan")] * 2] * 2

    assert simulate_fleet(FLEET, algorithm=Own(goals)).is_clear
    stands = Own(lambda _: [[0, 0], [0, 0]])
    assert simulate_fleet(FLEET, policy=stands, until_s=30.0).distance_m == pytest.approx(0.0)


def test_what_is_no_policy_or_algorithm_is_refused() -> None:
    for own in ({"policy": object()}, {"algorithm": object()}, {"algorithm": Own}):
        with pytest.raises(UsageError, match="must be an object with"):
            simulate_fleet(FLEET, **own)


@pytest.mark.parametrize("until_s", [-5.0, 0.0, float("nan"), "x"])
def test_a_time_before_the_beginning_is_refused(until_s: Any) -> None:  # noqa: ANN401 - what is refused
    with pytest.raises(UsageError, match="until_s must be above 0"):
        simulate_fleet(FLEET, until_s=until_s)


def test_an_area_is_refused_that_holds_too_many_lanes_or_cells() -> None:
    # 10,000 lanes in 10 km are 1 m each; a million cells in 10 km by 10 km have sides of 10 m
    low, high = np.zeros(2), np.array([10_000.0, 10_000.0])
    assert len(strips(low, high, lane_m=1.0, agents=1)[0]) == 20_000
    with pytest.raises(UsageError, match=r"lane_m: .* give 1.0 m or more"):
        strips(low, high, lane_m=0.5, agents=1)
    sides = {"west_m": 0.0, "south_m": 0.0, "east_m": 10_000.0, "north_m": 10_000.0}
    SearchArea(**sides, radius_m=5.0).refuse_too_fine()
    with pytest.raises(UsageError, match=r"sensor_radius_m: .* give 5.0 m or more"):
        SearchArea(**sides, radius_m=4.9).refuse_too_fine()


def test_an_area_is_refused_before_anything_is_simulated() -> None:
    steps: list[str] = []
    fleet = fleet_of(search().replace("lane_m = 20", "lane_m = 20\nsensor_radius_m = 0.1"))
    simulate_fleet(fleet, until_s=1.0, on_step=steps.append)  # 80 m by 60 m: cells of 7 cm
    assert steps
