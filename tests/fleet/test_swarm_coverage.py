"""What a swarm sees of an area, against closed forms and a union of `shapely`."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
from made_swarm import search, simulated

from planner.fleet.swarm.algorithms import Lanes, Waypoints, strips
from planner.fleet.swarm.coverage import Goal, SearchArea, predict_coverage
from planner.fleet.swarm.flights import Record
from planner.fleet.swarm.simulation import AgentPhase

AREA = SearchArea(west_m=0.0, south_m=0.0, east_m=200.0, north_m=50.0, radius_m=10.0)


def flown(*ways: list[tuple[float, float]], step_s: float = 10.0) -> Record:
    """Agents that fly straight from place to place, each in so long."""
    place_m = np.array(ways, np.float64).swapaxes(0, 1)
    steps, count = len(place_m) - 1, len(ways)
    begin_s = step_s * np.arange(steps + 1.0)
    return Record(
        begin_s=begin_s,
        place_m=place_m,
        velocity_m_s=np.zeros_like(place_m),
        command_m_s=np.zeros((steps, count, 2)),
        phase=np.full((steps, count), AgentPhase.FLIES),
        waits=np.zeros((steps, count), np.bool_),
        flies_s=np.zeros(count),
        lands_s=np.full(count, np.inf),
        has_landed=np.zeros(count, np.bool_),
    )


def seen(record: Record, area: SearchArea = AREA) -> Goal:
    return Goal.of("area seen", predict_coverage(record, area).seen_s)


def test_a_strip_is_as_wide_as_what_is_seen_and_counts_once() -> None:
    # 20 m of 50 m; the pieces of 0.9 m of time of the cells in front of it are seen before it is there
    once = seen(flown([(-20.0, 25.0), (220.0, 25.0)]))
    assert once.fraction == pytest.approx(0.4, abs=1e-12)
    twice = seen(flown([(-20.0, 25.0), (220.0, 25.0)], [(220.0, 25.0), (-20.0, 25.0)]))
    assert twice.fraction == pytest.approx(0.4, abs=1e-12)


def test_times_are_those_at_which_the_circle_reaches_the_cells() -> None:
    # 240 m in 10 s: the middle row of cells, half a metre beside the track, is seen √(100 - ¼) m ahead
    coverage = predict_coverage(flown([(-20.0, 25.0), (220.0, 25.0)]), AREA)
    assert coverage.seen_s.shape == (50, 200)
    east_m = np.arange(200) + 0.5
    ahead_m = np.sqrt(10.0**2 - 0.5**2)
    assert coverage.seen_s[25] == pytest.approx((east_m - ahead_m + 20.0) / 24.0, abs=1e-9)
    assert np.isinf(coverage.seen_s[0]).all()


def test_what_many_see_is_the_union_of_what_each_does() -> None:
    # The raster is wrong by what lies within half a cell of the edge of the union, half of it either way.
    draw = np.random.default_rng(1)
    ways = [
        list(zip(draw.uniform(-30, 230, 3), draw.uniform(-30, 80, 3), strict=True))
        for _ in range(2)
    ]
    coverage = seen(flown(*ways))
    union = shapely.union_all(
        [shapely.buffer(shapely.LineString(way), 10.0, quad_segs=64) for way in ways]
    )
    exact = shapely.intersection(union, shapely.box(0, 0, 200, 50))
    assert 0.2 < coverage.fraction < 0.98
    within = 0.5 * exact.length * 1.0 / (200.0 * 50.0)
    assert coverage.fraction == pytest.approx(exact.area / 10_000.0, abs=0.25 * within)


def test_only_who_flies_in_the_plane_sees() -> None:
    record = flown([(-20.0, 25.0), (100.0, 25.0), (220.0, 25.0)])
    record.phase[1] = AgentPhase.LANDS
    # all cells of the western half but for the corners beyond the circle at its end, one half disk more
    expected = (20 * 100 + np.pi * 100 / 2) / 10_000.0
    assert seen(record).fraction == pytest.approx(expected, abs=1e-3)


def test_a_goal_is_reached_with_the_part_that_completes_it() -> None:
    goal = Goal.of("agents home", np.array([30.0, np.inf, 10.0, 20.0]))
    assert [goal.time_to_s(one) for one in (0.25, 0.26, 0.5, 0.75, 0.9, 1.0)] == [
        10.0, 20.0, 20.0, 30.0, None, None,
    ]  # fmt: skip
    assert goal.fraction == 0.75
    assert goal.fraction_at(np.array([9.9, 10.0, 25.0, 1e9])).tolist() == [0.0, 0.25, 0.5, 0.75]


def test_a_search_alone_sees_all_of_its_area_and_says_when() -> None:
    result = simulated(search(agents=1))
    assert result.coverage is not None
    assert result.coverage.cell_m == pytest.approx(1.0, abs=0.02)
    assert result.goal.fraction == 1.0
    half_s, most_s, all_s = (result.goal.time_to_s(one) for one in (0.5, 0.9, 1.0))
    assert half_s is not None
    assert most_s is not None
    assert all_s is not None
    assert half_s < most_s < all_s < float(result.record.lands_s[0])
    # half of three lanes is seen when the front of the circle, which is π r / 4 ahead on average, is in the
    # middle of the second; to a cell of a metre
    record = result.record
    east_m, north_m = (np.interp(half_s, record.begin_s, one) for one in record.place_m[:, 0].T)
    assert (east_m, north_m) == pytest.approx((40.0 + np.pi * 10.0 / 4.0, 50.0), abs=1.0)


@pytest.mark.parametrize("policy", ["stop", "orca-stop"])
def test_what_others_push_an_agent_off_is_seen_after_all(policy: str) -> None:
    """Six on lanes next to each other, from pads nearer to each other than their stops are long."""
    flown = simulated(search(agents=6), policy=policy)
    assert flown.stops > 0
    assert flown.goal.fraction == pytest.approx(1.0, abs=0.005)


def test_an_agent_alone_flies_its_lanes_once() -> None:
    """In the time of the same ends as places to go to, one after the other."""
    lanes = simulated(search(agents=1)).agents[0]
    low_m, high_m, home_m = np.array([0.0, 20.0]), np.array([80.0, 80.0]), np.zeros((1, 2))
    [way] = strips(low_m, high_m, lane_m=20.0, agents=1)
    places = simulated(search(agents=1), algorithm=Waypoints([np.vstack((way, home_m))])).agents[0]
    # degrees and metres of the area are rounded to a centimetre
    assert lanes.time_s == pytest.approx(places.time_s, abs=1.0)
    assert lanes.distance_m == pytest.approx(places.distance_m, abs=1.0)


class Pushed:
    """What `Lanes` looks at: where agents are, and who has arrived."""

    def __init__(self, *place_m: float, has_arrived: bool = False) -> None:
        self.place_m, self.has_arrived = np.array([place_m]), np.array([has_arrived])


def test_a_lane_is_flown_again_where_an_agent_was_off_it_three_times_at_most() -> None:
    home_m, way = np.array([[-10.0, 0.0]]), np.array([(0.0, 0.0), (100.0, 0.0)])
    lanes = Lanes([way], home_m=home_m, off_m=1.0)

    def goal_at(*place_m: float, has_arrived: bool = False) -> list[float]:
        situation: Any = Pushed(*place_m, has_arrived=has_arrived)
        goals: list[list[float]] = lanes.goals_m(situation).tolist()
        return goals[0]

    assert goal_at(-10.0, 0.0) == [0.0, 0.0]
    for times in range(3):
        begin, end = ((0.0, 100.0), (20.0, 60.0), (20.0, 60.0))[times]
        assert goal_at(begin, 0.0, has_arrived=True) == [end, 0.0]
        assert goal_at(20.0, 0.9) == [end, 0.0]
        assert goal_at(25.0, 1.1) == [end, 0.0]  # off since 20 m
        assert goal_at(40.0, -5.0) == [end, 0.0]
        assert goal_at(60.0, 0.0) == [end, 0.0]
        then = [20.0, 0.0] if times < 2 else [-10.0, 0.0]
        assert goal_at(end, 0.0, has_arrived=True) == then
    assert np.isnan(goal_at(-10.0, 0.0, has_arrived=True)).all()
