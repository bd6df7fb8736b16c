"""Agents that avoid each other: no separation lost, everyone arrives, and ORCA as it is published."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fleet import pad, place, up, vehicles
from made_missions import item, mission, north
from made_swarm import (
    MODEL,
    NORTH_DEG,
    SEPARATION_M,
    agent,
    drawn_swarm,
    formation,
    least_m,
    on_circle,
    search,
    simulated,
)
from thinning import examples

from planner.fleet.swarm.algorithms import RandomSearch, Waypoints, strips
from planner.fleet.swarm.orca import Neighbours, half_planes, nearest_velocities_m_s
from planner.fleet.swarm.policies import NoAvoidance, OrcaStop, StopInTime
from planner.fleet.swarm.simulation import Swarm
from planner.mission.route.stage import StageKind
from planner.service.preflight import check_mission
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.situation import SwarmSituation


@pytest.mark.parametrize("count", [2, 3, 8])
def test_agents_on_a_circle_reach_the_other_side_apart(count: int) -> None:
    agents, ways = on_circle(count)
    swarm = Swarm(agents, Waypoints(ways), OrcaStop(), separation_m=SEPARATION_M, until_s=600.0)
    places_m, zones_m = least_m(swarm)
    assert places_m >= SEPARATION_M
    assert zones_m >= SEPARATION_M
    assert swarm.deadlock == ()
    end_m = swarm.places()[0]
    assert np.allclose(end_m, np.array(ways)[:, 0], atol=1.0)  # a leg of a mission ends within 1 m


@pytest.mark.parametrize("count", [2, 3, 8])
def test_agents_on_a_circle_fly_the_same_until_their_order_decides(count: int) -> None:
    """Each as the first, turned: nobody is preferred but by the rank of who is told to wait."""
    agents, ways = on_circle(count)
    swarm = Swarm(agents, Waypoints(ways), OrcaStop(), separation_m=SEPARATION_M, until_s=600.0)
    turns = np.exp(-2j * np.pi * np.arange(count) / count)
    compared = 0
    for step in swarm.run():
        stops = (step.command_m_s == 0.0).all(axis=1)
        if step.waits.any() != step.waits.all() or stops.any() != stops.all():
            break
        places = (step.place_m[:, 0] + 1j * step.place_m[:, 1]) * turns
        assert np.abs(places - places[0]).max() <= 1e-6
        compared += 1
    # past the middle, where they meet: 200 m at 5 m/s are 40 s; eight cannot all go first there
    assert compared * 0.5 > (40.0 if count < 8 else 10.0)


def test_without_avoidance_they_meet() -> None:
    agents, ways = on_circle(2)
    swarm = Swarm(agents, Waypoints(ways), NoAvoidance(), separation_m=SEPARATION_M, until_s=600.0)
    assert least_m(swarm)[0] < SEPARATION_M


def test_two_that_meet_head_on_stop_and_go_round() -> None:
    agents, ways = on_circle(2)
    swarm = Swarm(agents, Waypoints(ways), StopInTime(), separation_m=SEPARATION_M, until_s=900.0)
    assert least_m(swarm)[0] >= SEPARATION_M
    assert swarm.deadlock == ()
    assert np.allclose(swarm.places()[0], np.array(ways)[:, 0], atol=1.0)


@settings(max_examples=examples(3), deadline=None)
@given(seed=st.integers(0, 10**6), policy=st.sampled_from([StopInTime(), OrcaStop()]))
def test_whatever_the_delay_and_the_overshoot_no_separation_is_lost(
    seed: int, policy: Policy
) -> None:
    swarm = drawn_swarm(seed, policy, most=8)
    places_m, zones_m = least_m(swarm)
    assert places_m >= SEPARATION_M - 1e-9
    assert zones_m >= SEPARATION_M - 1e-9


def test_the_same_seed_gives_the_same_flight() -> None:
    def ends() -> bytes:
        home = np.array([(0.0, 0.0), (40.0, 0.0)])
        agents = [agent("a", 0.0, 0.0), agent("b", 40.0, 0.0)]
        search = RandomSearch(np.zeros(2), np.full(2, 300.0), home_m=home, ends_s=100.0, seed=5)
        swarm = Swarm(agents, search, OrcaStop(), separation_m=SEPARATION_M, until_s=600.0)
        return b"".join(step.place_m.tobytes() for step in swarm.run())

    assert ends() == ends()


@pytest.mark.parametrize("ends_s", [60.0, 77.0, 90.5])
def test_a_search_ends_when_it_is_to_end(ends_s: float) -> None:
    """Alone on a long way, of which ticks are passed over: it turns for home at that tick."""
    home_m = np.zeros((1, 2))
    search = RandomSearch(np.zeros(2), np.full(2, 3000.0), home_m=home_m, ends_s=ends_s, seed=5)
    alone = [agent("a", 0.0, 0.0)]
    swarm = Swarm(alone, search, StopInTime(), separation_m=SEPARATION_M, until_s=200.0)
    steps = [*swarm.run()]
    assert max(one.end_s - one.begin_s for one in steps) > 2.0
    ways = [one.wanted_m_s[0] @ -one.place_m[0] for one in steps]
    # Of two ways that lead away, and back: the first moment it wants back.
    assert next(one.begin_s for one, way in zip(steps, ways, strict=True) if way > 0.0) == ends_s


class Asked:
    """``stop`` that counts how often it is asked: every tick, or where something may change."""

    keeps_apart = True

    def __init__(self, *, needs_ticks: bool) -> None:
        self.needs_ticks, self.times = needs_ticks, 0

    def commands_m_s(self, situation: SwarmSituation) -> np.ndarray:
        self.times += 1
        return StopInTime().commands_m_s(situation)


def test_what_is_foreseen_is_flown_as_if_asked_every_tick() -> None:
    """Nobody waits for another: ticks decided ahead are those decided one by one."""
    ways = [np.array([(0.0, 300.0), (200.0, 300.0)]), np.array([(500.0, 90.0), (300.0, 0.0)])]
    flown, asked = [], []
    for needs_ticks in (True, False):
        policy = Asked(needs_ticks=needs_ticks)
        agents = [agent("a", 0.0, 0.0), agent("b", 500.0, 0.0, speed_m_s=8.0)]
        swarm = Swarm(agents, Waypoints(ways), policy, separation_m=SEPARATION_M, until_s=600.0)
        steps = [*swarm.run()]
        flown.append({one.begin_s: one.place_m for one in steps})
        asked.append(policy.times)
        assert swarm.has_landed.all()
    same = sorted(set(flown[0]) & set(flown[1]))
    assert len(same) > 50
    assert max(np.abs(flown[0][time_s] - flown[1][time_s]).max() for time_s in same) < 1e-6
    assert asked[1] < 0.3 * asked[0]
    # Where ticks are passed over places lie on the chord, as near as where an agent brakes in a tick.
    place_m = np.array([flown[1][time_s].ravel() for time_s in flown[1]])
    chords_m = np.stack([np.interp([*flown[0]], [*flown[1]], one) for one in place_m.T], axis=1)
    assert np.abs(chords_m - [one.ravel() for one in flown[0].values()]).max() < 0.05


def test_the_energy_of_a_state_does_not_depend_on_how_agents_are_stepped_through() -> None:
    """By events and by ticks, to the two seconds that a step is long where speeding up ends."""
    far = formation(60.0).replace(repr(NORTH_DEG), repr(NORTH_DEG + 0.003))
    alone = far.split("[vehicle.b]")[0]
    taken = [
        simulated(alone, policy=policy).agents[0].energy_by_state_wh
        for policy in ("none", "orca-stop")
    ]
    assert taken[0].keys() == taken[1].keys()
    for state, energy_wh in taken[0].items():
        assert energy_wh == pytest.approx(taken[1][state], abs=150.0 * 2.0 / 3600.0), state


class HalfSpeed:
    """A policy that is asked where something may change, and has everyone fly half as fast as it wants."""

    needs_ticks, keeps_apart = False, True

    def commands_m_s(self, situation: SwarmSituation) -> np.ndarray:
        return 0.5 * situation.wanted_m_s


def test_who_flies_slower_than_it_wants_is_asked_again_before_it_is_at_its_goal() -> None:
    ways = [np.array([(100.0, 0.0), (100.0, 57.0)])]
    alone = [agent("a", 0.0, 0.0)]
    swarm = Swarm(alone, Waypoints(ways), HalfSpeed(), separation_m=10.0, until_s=300.0)
    places_m = np.array([one.place_m[0] for one in swarm.run()])
    assert swarm.has_landed.all()
    # G4 overshoots by 2 % of the speed and of the way of its stop
    assert places_m.max(axis=0) == pytest.approx((100.0, 57.0), abs=1.0)


class Heedless:
    """A policy that says it keeps agents apart, and does not."""

    needs_ticks, keeps_apart = True, True

    def commands_m_s(self, situation: SwarmSituation) -> np.ndarray:
        return situation.wanted_m_s


def test_a_policy_that_leaves_no_room_to_stop_is_found_out_before_they_meet() -> None:
    agents, ways = on_circle(2)
    swarm = Swarm(agents, Waypoints(ways), Heedless(), separation_m=SEPARATION_M, until_s=600.0)
    with pytest.raises(AssertionError, match="'a0', 'a1'"):
        [*swarm.run()]
    # 5 m/s each: told by 42.654 m both stop 10 m apart, a tick brings them 5 m nearer.
    apart_m = float(np.hypot(*(swarm.places()[0][0] - swarm.places()[0][1])))
    assert 42.654 - 2.0 * 5.0 < apart_m < 42.654 + 5.0


def test_strips_share_an_area_out() -> None:
    # nine lanes of 10 m for two: four and five
    ways = strips(np.zeros(2), np.array([100.0, 90.0]), lane_m=10.0, agents=2)
    lanes = [sorted({float(north) for _, north in way}) for way in ways]
    assert [len(one) for one in lanes] in ([4, 5], [5, 4])
    assert sorted(north for one in lanes for north in one) == [5.0 + 10.0 * k for k in range(9)]


@pytest.mark.parametrize("agents", [4, 5, 6, 7, 20])
def test_fewer_strips_than_agents_are_divided_among_all(agents: int) -> None:
    ways = strips(np.zeros(2), np.array([100.0, 30.0]), lane_m=10.0, agents=agents)
    flown: dict[float, list[tuple[float, float]]] = {}
    for way in ways:
        assert len(way) >= 2  # nobody takes off for nothing
        for (begin, row_m), (end, _) in zip(way[::2].tolist(), way[1::2].tolist(), strict=True):
            flown.setdefault(row_m, []).append((min(begin, end), max(begin, end)))
    assert sorted(flown) == [5.0, 15.0, 25.0]
    for parts in flown.values():  # end to end, each once
        assert [begin for begin, _ in sorted(parts)] == [
            0.0,
            *(end for _, end in sorted(parts)[:-1]),
        ]
        assert max(end for _, end in parts) == 100.0


SPEED_M_S = 5.0


def drawn_disks(seed: int) -> tuple[Neighbours, np.ndarray, np.ndarray]:
    """All others of each of six disks, the velocities of all and those they want."""
    draw = np.random.default_rng(seed)
    count = 6
    place_m = draw.uniform(-30.0, 30.0, (count, 2))
    velocity_m_s = draw.uniform(-4.0, 4.0, (count, 2))
    radius_m = draw.uniform(1.0, 4.0, count)
    rows = np.array([[c for c in range(count) if c != row] for row in range(count)])
    neighbours = Neighbours(
        rows=rows,
        apart_m=place_m[rows] - place_m[:, None],
        reach_m=radius_m[:, None] + radius_m[rows],
    )
    return neighbours, velocity_m_s, draw.uniform(-4.0, 4.0, (count, 2))


@pytest.mark.parametrize("seed", range(4))
def test_velocities_are_those_of_the_published_half_planes(seed: int) -> None:
    """Against the obstacle by its definition, and the programme solved by its corners, exactly."""
    horizon_s = 8.0
    neighbours, velocity_m_s, wanted = drawn_disks(seed)
    evades = np.ones(len(wanted), np.bool_)
    planes = half_planes(neighbours, velocity_m_s, evades, horizon_s=horizon_s, tick_s=0.25)
    best, possible = nearest_velocities_m_s(planes, wanted, np.full(len(wanted), SPEED_M_S))
    checked = 0
    for row in range(len(wanted)):
        own = []
        for other, p, radius in zip(
            neighbours.rows[row], neighbours.apart_m[row], neighbours.reach_m[row], strict=True
        ):
            v = velocity_m_s[row] - velocity_m_s[other]
            if np.hypot(*p) <= radius:
                break
            edge = _nearest_edge(p, v, radius, horizon_s)
            inside = _meets(p, v, radius, horizon_s)
            normal = (edge - v) if inside else (v - edge)
            if np.hypot(*normal) < 1e-6:
                break
            normal = normal / np.hypot(*normal)
            own.append((velocity_m_s[row] + 0.5 * (edge - v), normal))
        if len(own) < len(neighbours.rows[row]):
            continue
        found = _nearest_by_corners(own, wanted[row], SPEED_M_S)
        assert possible[row] == (found is not None)
        if found is not None:
            assert best[row] == pytest.approx(found, abs=1e-6)
            checked += 1
    assert checked


def _nearest_by_corners(
    planes: list[tuple[np.ndarray, np.ndarray]], wanted: np.ndarray, speed: float
) -> np.ndarray | None:
    """The velocity nearest to one wanted, of all places where a best one can be; whether there is any
    within the greatest speed is asked of `scipy.optimize.linprog` with a polygon about the circle.
    """
    from scipy.optimize import linprog

    tries = [wanted, wanted * min(1.0, speed / np.hypot(*wanted))]
    edges = [(a, np.array([-n[1], n[0]])) for a, n in planes]
    for a, along in edges:
        tries.append(a + ((wanted - a) @ along) * along)
        middle = a - (a @ along) * along
        half = speed**2 - middle @ middle
        if half >= 0.0:
            tries += [middle + np.sqrt(half) * along, middle - np.sqrt(half) * along]
        for b, other in edges:
            turn = along[0] * other[1] - along[1] * other[0]
            if abs(turn) > 1e-9:
                gap = b - a
                tries.append(a + (gap[0] * other[1] - gap[1] * other[0]) / turn * along)
    allowed = [
        one
        for one in tries
        if np.hypot(*one) <= speed + 1e-9 and all((one - a) @ n >= -1e-9 for a, n in planes)
    ]
    round_ = 2.0 * np.pi * np.arange(720) / 720
    sides = np.stack((np.cos(round_), np.sin(round_)), axis=1)
    around = linprog(
        [0.0, 0.0],
        A_ub=np.vstack((sides, *(-n[None] for _, n in planes))),
        b_ub=np.concatenate((np.full(720, speed), [-(a @ n) for a, n in planes])),
        bounds=[(None, None)] * 2,
    )
    assert bool(allowed) == (around.status == 0)
    return min(allowed, key=lambda one: float(((one - wanted) ** 2).sum()), default=None)


def _meets(p: np.ndarray, v: np.ndarray, radius: float, horizon_s: float) -> bool:
    """Whether a relative velocity brings two disks together within the horizon."""
    time_s = np.clip((p @ v) / max(v @ v, 1e-12), 0.0, horizon_s)
    return bool(np.hypot(*(p - time_s * v)) < radius)


def _nearest_edge(p: np.ndarray, v: np.ndarray, radius: float, horizon_s: float) -> np.ndarray:
    """The point of the edge of the truncated cone that is nearest to a relative velocity."""
    distance = np.hypot(*p)
    leg = np.sqrt(distance**2 - radius**2)
    turn = np.arcsin(radius / distance)
    towards = np.arctan2(p[1], p[0])
    edges = []
    for side in (1.0, -1.0):
        angle = towards + side * turn
        unit = np.array([np.cos(angle), np.sin(angle)])
        edges.append(max(float(v @ unit), leg / horizon_s) * unit)
    # the arc of the disk that cuts the cone off, between where the legs touch it, on the near side
    away = v - p / horizon_s
    away = away / np.hypot(*away)
    if np.arccos(np.clip(-(away @ p) / distance, -1.0, 1.0)) <= 0.5 * np.pi - turn:
        edges.append(p / horizon_s + radius / horizon_s * away)
    return min(edges, key=lambda edge: float(((edge - v) ** 2).sum()))


class Fetch:
    """An algorithm of one's own: everyone flies to one place after the other has, and back."""

    def __init__(self, place_m: tuple[float, float], home_m: np.ndarray) -> None:
        self._place_m, self._home_m = np.array(place_m), home_m
        self._turn, self._fetched = 0, False

    def goals_m(self, situation) -> np.ndarray:  # type: ignore[no-untyped-def]  # noqa: ANN001
        arrived = situation.has_arrived[self._turn]
        if arrived and not self._fetched:
            self._fetched = True
        elif arrived and self._turn + 1 < len(self._home_m):
            self._turn, self._fetched = self._turn + 1, False
        goals = self._home_m.copy()
        if not self._fetched:
            goals[self._turn] = self._place_m
        return goals


def test_an_algorithm_of_ones_own_flies() -> None:
    home = np.array([(0.0, 0.0), (40.0, 0.0)])
    agents = [agent("a", 0.0, 0.0), agent("b", 40.0, 0.0)]
    swarm = Swarm(
        agents, Fetch((20.0, 100.0), home), StopInTime(), separation_m=10.0, until_s=300.0
    )
    reached = np.full(2, np.inf)
    for step in swarm.run():
        reached = np.minimum(reached, np.hypot(*(step.place_m - (20.0, 100.0)).T))
    assert (reached < 1.0).all()


def test_an_agent_alone_takes_what_the_check_of_its_mission_says() -> None:
    """To 1e-6 s and 1e-9 of the energy, as legs of a mission end where agents stand."""
    points = [(100.0, 0.0), (100.0, 150.0), (0.0, 0.0)]
    flown = mission(up(50), *[place(*one, 50) for one in points], item(21, north(0), 0))
    checked = check_mission(flown, Setup(vehicle=load_vehicle(MODEL))).assessment
    assert checked is not None
    stages = [stage for stage in checked.route.stages if stage.kind is StageKind.GO]
    way = np.array([(stage.east_m, stage.north_m) for stage in stages])
    alone = simulated(
        "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + vehicles("a", model=MODEL),
        '[swarm]\nalgorithm = "exchange"\nheight_m = 50\n',
        algorithm=Waypoints([way]),
    ).agents[0]
    assert alone.time_s == pytest.approx(checked.totals.time_s, abs=1e-6)
    assert alone.energy_wh == pytest.approx(checked.totals.energy_wh, rel=1e-9)


def test_who_is_sent_to_where_it_stands_is_there_and_lands() -> None:
    """An exchange of one, by the steps of whose model it hovers as long as one stop takes."""
    alone = simulated(
        "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + vehicles("a", model=MODEL),
        '[swarm]\nalgorithm = "exchange"\nheight_m = 50\n',
    ).agents[0]
    assert alone.has_landed
    assert alone.distance_m == 0.0


def test_flights_are_in_the_frames_of_their_homes() -> None:
    """Two 40 m apart change places: each takes off at its own pad, and lands on the other's."""
    flown = simulated(
        "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + pad("b", 0, 40),
        vehicles("a", "b", model=MODEL) + '[swarm]\nalgorithm = "exchange"\nheight_m = 50\n',
        policy="none",
    )
    for one, east_m in zip(flown.agents, (40.0, -40.0), strict=True):
        assert one.flight is not None
        times_s = np.array([0.0, 5.0, one.time_s - 5.0, one.time_s])
        place_m = one.flight.motion.state_at_time(times_s).place_m
        assert place_m[:2, :2] == pytest.approx(0.0, abs=1e-9)
        assert place_m[2:, 0] == pytest.approx(east_m, abs=0.05)
        assert place_m[2:, 1] == pytest.approx(0.0, abs=0.05)


@pytest.mark.parametrize("amp_hours", np.random.default_rng(19).uniform(0.22, 0.42, 3).tolist())
def test_agents_fly_home_while_their_batteries_bring_them_there(amp_hours: float) -> None:
    """What remains is the reserve at least, though two of them want to land 30 m apart."""
    packs = f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "{amp_hours:.3f}Ah@14.8V"\ncount = 2\n'
    flown = simulated(search(packs=packs), policy="stop")
    for one in flown.agents:
        assert one.has_landed
        assert one.battery is not None
        assert one.battery.margin_wh >= 0.0
    assert any(one.turned_back_s is not None for one in flown.agents)
    # they did not see it all
    assert "S137" in {one.code for one in flown.findings}


@pytest.mark.parametrize("policy", ["none", "stop", "orca-stop"])
def test_one_that_flies_far_out_turns_home_in_time(policy: str) -> None:
    """Its battery is empty to the reserve some seconds before the far end of its last way out."""
    home = np.zeros(2)
    ways = [np.array([(0.0, 600.0), home] * 2)]
    tables = (
        "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + vehicles("a", model=MODEL),
        '[swarm]\nalgorithm = "exchange"\nheight_m = 50\n',
    )
    whole = simulated(*tables, policy=policy, algorithm=Waypoints(ways)).agents[0]
    assert whole.energy_wh is not None
    # 4 s of cruise on the way out and as many on the way back are missing
    short_wh = whole.energy_wh - 2.0 * 4.0 * 131.0 / 3600.0
    packs = f'[swap]\ntime_s = 60\n[pack.P]\nbattery = "{short_wh / 0.8:.3f}Wh"\ncount = 1\n'
    [one] = simulated(*tables, packs, policy=policy, algorithm=Waypoints(ways)).agents
    assert one.turned_back_s is not None
    assert one.battery is not None
    # at most the 20 s that it may fly on and back until it asks again, two stops and twice their way
    assert 0.0 <= one.battery.margin_wh < (20.0 + 16.0) * 131.0 / 3600.0 + 0.3


def test_agents_in_gusts_fly_home_sooner_and_still_above_their_reserves() -> None:
    """At 10 m/s gusts of a wind of 12 m/s take more of its power: it keeps more for its way home."""
    packs = '[swap]\ntime_s = 60\n[pack.P]\nbattery = "1.0Ah@14.8V"\ncount = 1\n'
    tables = search(agents=1, packs=packs).replace(MODEL, "arducopter-sitl-quad")
    turned_s = []
    for fault in ("", '[fault.f]\nkind = "gusts"\nwind_m_s = 12.0\n'):
        flown = simulated(tables, fault, policy="stop")
        [one] = flown.agents
        assert one.has_landed
        assert one.battery is not None
        assert one.battery.margin_wh >= 0.0
        assert one.turned_back_s is not None
        assert "S141" in {found.code for found in flown.findings}
        turned_s.append(one.turned_back_s)
    # it asks every 10 s
    assert turned_s[1] < turned_s[0] - 5.0


class HeldAtFirst:
    """A policy that holds everyone back for a minute where it first arrives."""

    needs_ticks, keeps_apart = True, False

    def commands_m_s(self, situation: SwarmSituation) -> np.ndarray:
        is_held = (situation.time_s < 60.0) & (np.abs(situation.place_m[:, 0] - 50.0) < 1.0)
        return np.where(is_held[:, None], 0.0, situation.wanted_m_s)


def test_who_is_held_back_has_not_arrived_at_its_next_goal() -> None:
    ways = [np.array([(50.0, 0.0), (50.0, 60.0)])]
    settles = [replace(agent("a", 0.0, 0.0), settle_s=6.0)]
    swarm = Swarm(settles, Waypoints(ways), HeldAtFirst(), separation_m=10.0, until_s=300.0)
    steps = [*swarm.run()]
    assert swarm.places()[0] == pytest.approx(np.array([(50.0, 60.0)]), abs=1.0)
    assert steps[-1].begin_s > 60.0


class EveryTick(NoAvoidance):
    """The same by ticks: nothing is decided ahead."""

    needs_ticks: bool = True


@pytest.mark.parametrize("seed", range(4))
def test_what_is_decided_ahead_is_what_every_tick_decides(seed: int) -> None:
    """All are sent home while some have come to their goals and do not stand there yet."""
    home_m = np.array([(0.0, 0.0), (60.0, 0.0), (0.0, 60.0)])
    agents = [
        replace(agent(f"a{row}", *place, speed_m_s=8.0), settle_s=6.2)
        for row, place in enumerate(home_m.tolist())
    ]
    ways = []
    for policy in (NoAvoidance(), EveryTick()):
        searching = RandomSearch(
            np.zeros(2), np.full(2, 60.0), home_m=home_m, ends_s=100.0, seed=seed
        )
        swarm = Swarm(agents, searching, policy, separation_m=10.0, until_s=600.0)
        steps = list(swarm.run())
        time_s = [one.begin_s for one in steps]
        ways.append(dict(zip(time_s, (one.place_m for one in steps), strict=True)))
    ahead, ticked = ways
    # rounding alone: 1e-9 m after some 1,000 steps
    assert max(float(np.abs(ahead[at] - ticked[at]).max()) for at in ahead) < 1e-9
