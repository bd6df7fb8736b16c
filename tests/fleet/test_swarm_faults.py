"""What goes wrong in a simulated swarm: who is hit, and whether everyone else is still safe."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import pad, place, sortie, up, vehicles
from made_missions import mission, rtl
from made_swarm import (
    AT_ONCE,
    G4,
    MODEL,
    SEPARATION_M,
    agent,
    drawn_swarm,
    fleet_of,
    search,
    simulated,
    with_faults,
)

from planner.errors import FleetFileError
from planner.fleet.fleet import Fault, FaultKind
from planner.fleet.swarm.dynamics import Dynamics, DynamicsStack
from planner.fleet.swarm.faults import SwarmFaults, gust_m_s
from planner.fleet.swarm.flights import Record
from planner.fleet.swarm.policies import NoAvoidance, OrcaStop, StopInTime
from planner.fleet.swarm.simulation import AgentPhase, Swarm
from planner.physics.wind import Wind
from planner.report.swarm import outcome_text
from planner.service.preflight import check_mission
from planner.service.swarm_agents import simulate_numbers
from planner.service.swarm_faults import with_gusts
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from planner.arrays import FloatArray
    from planner.fleet.swarm.policies import Policy
    from planner.fleet.swarm.situation import SwarmSituation
    from planner.service.swarm import SwarmResult
FLIES_AWAY = Fault(kind=FaultKind.KEEPS_COMMAND, vehicle="a", at_s=20.0)


def recorded(swarm: Swarm) -> Record:
    return Record.of([*swarm.run()], swarm)


def apart_m(record: Record, first: int, second: int) -> FloatArray:
    return np.asarray(np.hypot(*(record.place_m[:, first] - record.place_m[:, second]).T))


class Waits:
    """An algorithm: the first flies east, the others stay until the end."""

    def __init__(self, goals_m: FloatArray) -> None:
        self._goals_m = goals_m

    def goals_m(self, situation: SwarmSituation) -> FloatArray:  # noqa: ARG002 - asked of every algorithm
        return self._goals_m.copy()


@cache
def flown_past(policy: StopInTime | OrcaStop | NoAvoidance, *faults: Fault) -> Record:
    """The first flies east through where the second hovers, beside which the third does."""
    agents = [agent("a", 0.0, 0.0), agent("b", 150.0, 0.0), agent("c", 150.0, 14.0)]
    goals_m = np.array([(400.0, 0.0), (150.0, 0.0), (150.0, 14.0)])
    names = [one.name for one in agents]
    return recorded(
        Swarm(
            agents,
            Waits(goals_m),
            policy,
            separation_m=SEPARATION_M,
            until_s=65.0,
            faults=lambda stack: SwarmFaults(faults, names, stack, height_m=30.0, seed=0),
        )
    )


@pytest.mark.parametrize("policy", [StopInTime(), OrcaStop()])
def test_who_keeps_its_command_is_avoided_by_all_others(policy: StopInTime | OrcaStop) -> None:
    record = flown_past(policy, FLIES_AWAY)
    assert record.place_m[-1, 0, 0] > 250.0  # it has not stopped for anybody
    assert apart_m(record, 0, 1).min() >= SEPARATION_M
    assert apart_m(record, 0, 2).min() >= SEPARATION_M
    assert apart_m(record, 1, 2).min() >= SEPARATION_M
    # Afterwards both go back to where they were.
    assert record.place_m[-1, 1:] == pytest.approx(np.array([(150.0, 0.0), (150.0, 14.0)]), abs=0.5)


def test_without_avoidance_it_flies_through_them() -> None:
    assert apart_m(flown_past(NoAvoidance(), FLIES_AWAY), 0, 1).min() < SEPARATION_M


def test_a_kept_command_is_that_of_the_tick_before() -> None:
    record = flown_past(StopInTime(), FLIES_AWAY)
    kept = record.command_m_s[record.begin_s[:-1] >= 20.0, 0]
    assert (kept == kept[0]).all()
    assert kept[0] == pytest.approx((5.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("seed", "policy"), [(1, StopInTime()), (2, OrcaStop())])
def test_whoever_flies_away_the_others_keep_apart(seed: int, policy: Policy) -> None:
    """`tests/bench/test_swarm_campaign.py` draws a thousand."""
    fault = Fault(kind=FaultKind.KEEPS_COMMAND, vehicle="a0", at_s=4.0)
    record = recorded(drawn_swarm(seed, policy, fault, most=8))
    there = (record.phase > AgentPhase.WAITS) & (record.phase < AgentPhase.LANDED)
    for first in range(1, there.shape[1]):
        for second in range(first + 1, there.shape[1]):
            both = np.flatnonzero(there[:, first] & there[:, second])
            assert (apart_m(record, first, second)[both] >= SEPARATION_M - 1e-9).all()


def test_the_gusts_of_the_low_altitude_model_are_as_by_hand() -> None:
    # At 1,000 ft 0.177 + 0.000823 h is 1: a tenth of the wind, and the height itself.
    assert gust_m_s(10.0, 304.8) == pytest.approx((1.0, 304.8), rel=1e-12)
    # At 100 ft it is 0.2593: 1 / 0.2593^0.4 = 1.7158, 30.48 m / 0.2593^1.2 = 153.97 m.
    assert gust_m_s(10.0, 30.48) == pytest.approx((1.7158, 153.97), rel=1e-4)
    assert gust_m_s(10.0, 1.0) == gust_m_s(10.0, 3.048)


def carried(dynamics: Dynamics, agents: int, ticks: int) -> tuple[SwarmFaults, np.ndarray]:
    """Return where gusts of a wind of 10 m/s have carried agents by each tick. (ticks, n, 2) [m]"""
    stack = DynamicsStack([dynamics] * agents, 0.5)
    faults = SwarmFaults(
        [Fault(kind=FaultKind.GUSTS, wind_m_s=10.0)],
        [f"a{row}" for row in range(agents)],
        stack,
        height_m=30.48,
        seed=3,
    )
    ways = []
    for tick in range(ticks):
        faults.go_on(0.5 * (tick + 1))
        ways.append(faults.carried_m)
    return faults, np.array(ways)


def test_gusts_carry_an_agent_by_what_it_has_not_answered() -> None:
    assert np.allclose(carried(Dynamics(response=AT_ONCE), 2, 20)[1], 0.0)
    late = carried(Dynamics(response=G4), 200, 80)
    # Likely gusts of three standard deviations: 3 × 1.7158 m/s for the 3.2059 s a stop takes.
    assert late[0].gust_error_m == pytest.approx(3.0 * 1.7158 * 3.20591, rel=1e-3)
    # The gusts last 154 m / 10 m/s = 15.4 s, longer than the answer: all but a third of that at most, and of
    # 400 axes 0.3 % are beyond three standard deviations.
    far = np.abs(late[1][-1]) / late[0].gust_error_m[:, None]
    assert (far > 1.0).mean() <= 0.01
    assert 0.6 / 3.0 < np.sqrt((far**2).mean()) <= 1.0 / 3.0


def test_gusts_are_the_same_by_the_same_seed() -> None:
    one, two = (carried(Dynamics(response=G4), 3, 10)[1] for _ in range(2))
    assert one.tobytes() == two.tobytes()
    assert not np.allclose(one[-1, 0], one[-1, 1])


def faulty(kind: str, *keys: str, agents: int = 2) -> str:
    return search(agents=agents) + "\n".join(("[fault.f]", f'kind = "{kind}"', *keys)) + "\n"


DROPS = ('vehicle = "v1"', "at_s = 20")
ADRIFT = ('vehicle = "v1"', "at_s = 40", "drift_m_s = 0.25", "toward_deg = 90")


def test_who_has_lost_its_position_is_where_it_does_not_say() -> None:
    flown = simulated(faulty("loses-position", *ADRIFT), policy="stop")
    record = flown.record
    assert isinstance(record.carried_m, np.ndarray)
    away_m = 0.25 * np.clip(record.begin_s - 40.0, 0.0, None)
    assert record.carried_m[:, 1, 0] == pytest.approx(away_m, abs=1e-9)
    assert np.abs(record.carried_m[:, 1, 1]).max() == pytest.approx(0.0, abs=1e-9)
    assert not record.carried_m[:, 0].any()
    assert flown.faults is not None
    assert flown.faults.others == ("v0",)
    [lost] = [one.message for one in flown.findings if one.code == "S135"]
    landed_s = flown.agents[1].start_s + flown.agents[1].time_s
    assert lost.startswith(f"v1 lands {0.25 * (landed_s - 40.0):.0f} m off its pad")


def test_a_battery_that_drops_has_so_much_less_at_the_landing() -> None:
    whole = simulated(search(agents=2), policy="stop").agents[1]
    flown = simulated(faulty("battery-drops", *DROPS, "charge_left = 0.25"), policy="stop")
    one = flown.agents[1]
    assert one.battery is not None
    assert one.flight is not None
    assert whole.battery is not None
    used_wh = one.flight.energy_j / 3600.0
    time_s = np.arange(0.0, 20.005, 0.01)  # still climbing
    then_wh = float(np.trapezoid(one.flight.power_w(time_s), time_s)) / 3600.0
    left_wh = 0.25 * one.battery.usable_wh - (used_wh - then_wh)
    # the energy by then is read off between seconds
    assert one.battery.margin_wh == pytest.approx(left_wh - one.battery.reserve_wh, abs=0.001)
    same = simulated(faulty("battery-drops", *DROPS, "charge_left = 1"), policy="stop").agents[1]
    assert same.battery is not None
    assert same.battery.margin_wh == whole.battery.margin_wh


def test_an_empty_battery_does_not_bring_it_home() -> None:
    flown = simulated(faulty("battery-drops", *DROPS, "charge_left = 0"), policy="stop")
    assert flown.agents[1].empty_s == pytest.approx(20.0, abs=1.0)  # looked at every second
    assert [one.code for one in flown.findings if one.code in {"S131", "S135"}] == ["S135"]
    assert flown.faults is not None
    assert flown.faults.are_others_safe


def test_a_link_that_is_not_late_changes_nothing() -> None:
    keys = ('vehicle = "v1"', "late_s = 0")
    late = simulated(faulty("link-late", *keys), policy="stop").record
    on_time = simulated(faulty("gusts", "wind_m_s = 0"), policy="stop").record
    assert late.place_m.tobytes() == on_time.place_m.tobytes()


def test_a_late_link_hits_the_one_it_gives_way_to() -> None:
    flown = simulated(faulty("link-late", 'vehicle = "v1"', "late_s = 3"), policy="stop")
    hits = [one for one in flown.findings if one.code == "S134"]
    assert hits
    assert all("v1" in one.message for one in hits)
    assert flown.faults is not None
    assert not flown.faults.are_others_safe
    assert not flown.is_clear


def test_who_lands_under_orca_stop_stays_over_its_pad() -> None:
    # The other flies close by the pad while the first comes down.
    agents = [replace(agent("a", 0.0, 0.0), landing_s=40.0), agent("b", -60.0, 11.0)]
    swarm = with_faults(
        agents, [np.array([(0.0, 0.0)]), np.array([(60.0, 11.0)])], OrcaStop(), until_s=120.0
    )
    record = recorded(swarm)
    lands = record.phase[:, 0] == AgentPhase.LANDS
    assert lands.any()
    assert np.abs(record.place_m[:-1, 0][lands]).max() < 0.01
    assert apart_m(record, 0, 1)[:-1][lands].min() >= SEPARATION_M


def test_a_fault_that_begins_after_the_landing_was_not_tried() -> None:
    flown = simulated(faulty("keeps-command", 'vehicle = "v1"', "at_s = 3000"), policy="stop")
    assert [one.code for one in flown.findings if one.code > "S133"][:1] == ["S136"]
    assert not flown.is_clear


def test_gusts_are_drawn_for_each_run_of_numbers_of_agents() -> None:
    fleet = fleet_of(faulty("gusts", "wind_m_s = 2", agents=2))
    assert len(simulate_numbers(fleet, (1,), seeds=range(2), policy="stop").runs) == 2
    fleet = fleet_of(faulty("link-late", 'vehicle = "v1"', "late_s = 1", agents=2))
    assert len(simulate_numbers(fleet, (1,), seeds=range(2), policy="stop").runs) == 1


@pytest.mark.parametrize(
    ("kind", "keys", "problem"),
    [
        ("gusts", (), "fault.f.wind_m_s: is missing: gusts needs it"),
        ("keeps-command", (), "fault.f.vehicle: is missing: keeps-command befalls one"),
        ("keeps-command", ('vehicle = "v9"',), "there is none called 'v9'"),
        ("gusts", ("wind_m_s = 3", "late_s = 1"), "fault.f.late_s: is not a key of gusts"),
        ("link-late", ('vehicle = "v1"', "late_s = -1"), "must not be below 0"),
        ("link-late", ('vehicle = "v1"', "late_s = 1", "lasts_s = 0"), "must be greater than 0"),
    ],
)
def test_what_a_fault_lacks_is_said(kind: str, keys: tuple[str, ...], problem: str) -> None:
    with pytest.raises(FleetFileError, match="fault") as error:
        fleet_of(faulty(kind, *keys))
    assert problem in str(error.value)


FILED = (
    "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + vehicles("a", model=MODEL),
    '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\n',
    sortie("s1", "a", 0.0, job="there", more='pack = "P"'),
)


def test_missions_as_filed_have_batteries_that_drop() -> None:
    there = mission(up(50), place(200, 0, 50), rtl())
    fault = '[fault.f]\nkind = "battery-drops"\nvehicle = "a"\nat_s = 30\ncharge_left = 0.0\n'
    flown = simulated(*FILED, fault, there=there)
    assert flown.agents[0].empty_s == pytest.approx(30.0, abs=1.0)
    assert "S135" in {one.code for one in flown.findings}


def across(fault: str = "", policy: str = "stop") -> SwarmResult:
    """Two missions that cross, started at the same time: the second gives way to the first."""
    one = mission(up(30), place(200, 0, 30), rtl())
    other = mission(up(30), place(100, 100, 30), rtl())
    pads = pad("a", 0, 0) + pad("b", 100, -100) + vehicles("a", "b", model=MODEL)
    packs = '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = 2\n'
    sorties = packs + "".join(
        sortie(f"s{number}", vehicle, 0.0, job=job, more=f'pack = "P-{number}"')
        for number, vehicle, job in ((1, "a", "one"), (2, "b", "other"))
    )
    tables = ("[separation]\nhorizontal_m = 10\n" + pads, sorties, fault)
    return simulated(*tables, policy=policy, one=one, other=other)


def deaf(vehicle: str, at_s: float, more: str = "") -> str:
    keys = f'kind = "keeps-command"\nvehicle = "{vehicle}"\nat_s = {at_s}\n{more}'
    return f"[fault.f]\n{keys}"


def test_who_flies_its_mission_and_hears_no_stop_is_given_way_to() -> None:
    assert [one.stops > 0 for one in across().agents] == [False, True]
    flown = across(deaf("b", 5.0))
    assert [one.stops > 0 for one in flown.agents] == [True, False]
    assert all(one.has_landed for one in flown.agents)
    assert not {"S128", "S134", "S135"} & {one.code for one in flown.findings}
    assert flown.faults is not None
    assert flown.faults.are_others_safe


def test_who_stands_and_hears_nothing_stands_until_it_hears_again() -> None:
    stood_s = 62.0
    waits = across().record.waits[:, 1]
    assert waits[int(2.0 * stood_s)]  # every half second
    ends = across(deaf("b", stood_s, "lasts_s = 100\n"))
    assert ends.agents[1].waited_s > 90.0
    assert all(one.has_landed for one in ends.agents)
    never = across(deaf("b", stood_s))
    assert [one.has_landed for one in never.agents] == [True, False]
    assert "S135" in {one.code for one in never.findings}


def late(late_s: float) -> str:
    return f'[fault.f]\nkind = "link-late"\nvehicle = "b"\nlate_s = {late_s}\n'


def test_who_is_told_late_to_stop_meets_the_other_as_if_it_were_told_nothing() -> None:
    on_time = across(late(0.0))
    assert on_time.record.place_m.tobytes() == across().record.place_m.tobytes()
    [met] = across(policy="none").distances.nearest
    flown = across(late(60.0))
    assert flown.distances.nearest[0].distance_m == pytest.approx(met.distance_m, abs=0.1)
    assert flown.distances.nearest[0].time_s == pytest.approx(met.time_s, abs=0.1)
    [hit] = [one.message for one in flown.findings if one.code == "S134"]
    assert hit.endswith("(f: b does 1 min 00 s late what it has to do for others from 0:00 on)")
    assert flown.faults is not None
    assert not flown.faults.are_others_safe


def test_who_has_lost_its_position_flies_beside_its_track_and_meets_the_other() -> None:
    keys = 'vehicle = "b"\nat_s = 10\ndrift_m_s = 0.25\ntoward_deg = 90\n'
    flown = across(f'[fault.f]\nkind = "loses-position"\n{keys}')
    [calm] = across().distances.nearest
    [near] = flown.distances.nearest
    # The first flies north across the way of the second, which stands west of it: drifting east it comes
    # nearer by all of what it has drifted by then.
    drifted_m = 0.25 * (near.time_s - 10.0)
    assert near.distance_m == pytest.approx(calm.distance_m - drifted_m, abs=0.1)
    assert isinstance(flown.record.carried_m, np.ndarray)
    assert not flown.record.carried_m[:, 0].any()
    assert {"S134", "S135"} <= {one.code for one in flown.findings}
    assert not flown.is_clear


def test_gusts_blow_missions_off_their_tracks_and_zones_leave_room_for_them() -> None:
    fault = '[fault.f]\nkind = "gusts"\nwind_m_s = 5\n'
    flown = across(fault)
    record = flown.record
    assert isinstance(record.carried_m, np.ndarray)
    assert np.abs(record.carried_m[:, 0]).max() > 0.5
    # Nothing blows it about on the ground: before its start, and after its landing.
    down = record.phase[:, 1] == AgentPhase.LANDED
    assert len({tuple(one) for one in record.carried_m[:-1, 1][down].tolist()}) <= 2
    assert apart_m(record, 0, 1).min() >= 15.0
    assert [one.has_landed for one in flown.agents] == [True, True]
    untold = [one.message for one in flown.findings if one.code == "S140"]
    assert untold[0] == "energy of gusts is not counted for s1, s2: no airspeed term in the model"
    assert not flown.is_clear


def test_what_flying_against_gusts_takes_is_what_a_wind_as_strong_does() -> None:
    """An even one, against `planner.check` of the same mission in that wind."""
    there = mission(up(50), place(200, 0, 50), place(200, 150, 50, 10.0), rtl())
    model = "arducopter-sitl-quad"
    tables = "[separation]\nhorizontal_m = 10\n" + pad("a", 0, 0) + vehicles("a", model=model)
    flown = simulated(tables, sortie("s", "a", 0.0, job="there"), policy="none", there=there)
    [one] = flown.agents
    wind_m_s = 4.0 * np.sqrt(0.5)
    against = np.full(flown.record.place_m.shape, wind_m_s)
    assert one.energy_wh is not None
    blown = with_gusts(one, replace(flown.record, against_m_s=against), 0)
    assert blown.gusts_wh is not None
    vehicle = load_vehicle(model)
    calm, windy = (
        check_mission(there, Setup(vehicle=vehicle, wind=wind)).totals
        for wind in (Wind(), Wind(speed_m_s=4.0, from_deg=225.0))
    )
    assert calm is not None
    assert windy is not None
    # 15.52 Wh and 15.12 Wh; steps of 0.5 s
    assert blown.gusts_wh == pytest.approx(windy.energy_wh - calm.energy_wh, rel=0.02)
    assert blown.energy_wh == pytest.approx(one.energy_wh + blown.gusts_wh)
    assert sum(blown.energy_by_state_wh.values()) == pytest.approx(blown.energy_wh)
    assert one.battery is not None
    assert blown.battery is not None
    assert blown.battery.margin_wh - one.battery.margin_wh == pytest.approx(-blown.gusts_wh)


def coming_down(off_m: float, *, pads_m: float = 60.0) -> SwarmResult:
    """One that has lost its position comes down so far west of its pad; the other stands on its own there.

    At a drift of 0.5 m/s begun as long before the landing.
    """
    tables = "[separation]\nhorizontal_m = 10\nmin_nav_alt_m = 2\n" + pad("a", 0, 0)
    tables += pad("b", 0, pads_m) + vehicles("a", "b")
    both = sortie("s1", "a", 0.0, job="short") + sortie("s2", "b", 0.0, job="long")
    jobs = {
        "short": mission(up(20), place(40, 0, 20), rtl()),
        "long": mission(up(20), place(300, 200, 20), place(-300, 200, 20), rtl()),
    }
    calm = simulated(tables, both, **jobs).agents[1]
    fault = '[fault.f]\nkind = "loses-position"\nvehicle = "b"\ndrift_m_s = 0.5\ntoward_deg = 270\n'
    return simulated(tables, both, fault + f"at_s = {calm.time_s - 2.0 * off_m!r}\n", **jobs)


def test_one_that_comes_down_on_one_that_stands_is_told() -> None:
    hit = coming_down(60.0)
    assert hit.faults is not None
    [outcome] = hit.faults.outcomes
    [near] = outcome.hits
    # nearest while it is 2 m up still: the drift of the rest of its landing is left
    assert near.beside_m == pytest.approx(0.5 * (hit.agents[1].time_s - near.time_s), abs=0.1)
    assert near.time_s > hit.agents[0].time_s + 60.0
    assert not hit.faults.are_others_safe
    assert {"S116", "S134", "S135"} <= {one.code for one in hit.findings}
    # beside it when it is 2 m up: 10 m, 2.5 m of its own error, and none of who stands
    drifts_m = near.beside_m
    for more_m, is_safe in ((-0.5, True), (0.5, False)):
        off_m = 60.0 - 12.5 + drifts_m + more_m
        flown = coming_down(off_m)
        assert flown.faults is not None
        assert flown.faults.are_others_safe is is_safe
        assert "S116" not in {one.code for one in flown.findings}
    # 5 m beside it, the errors of both, is too near on the ground
    assert "S116" not in {one.code for one in coming_down(54.0).findings}
    assert "S116" in {one.code for one in coming_down(56.0).findings}


def test_one_that_lands_below_its_reserve_has_not_survived() -> None:
    there = mission(up(50), place(200, 0, 50), rtl())

    def dropping(charge_left: float) -> SwarmResult:
        keys = f'vehicle = "a"\nat_s = 5\ncharge_left = {charge_left!r}\n'
        return simulated(*FILED, f'[fault.f]\nkind = "battery-drops"\n{keys}', there=there)

    [agent] = simulated(*FILED, there=there).agents
    assert agent.battery is not None
    assert agent.energy_wh is not None
    # what it takes and the reserve, of what is usable; 5 s take less than half a percent
    needed = agent.battery.reserve_fraction + agent.energy_wh / agent.battery.capacity_wh
    for more, text in ((0.005, "survived"), (-0.01, "s1 lands below its reserve")):
        flown = dropping(needed + more)
        assert flown.faults is not None
        assert [outcome_text(one) for one in flown.faults.outcomes] == [text]
        assert ("S131" in {one.code for one in flown.findings}) is (more < 0.0)
    [message] = [one.message for one in dropping(0.01).findings if one.code == "S135"]
    assert message.startswith("s1 has an empty battery from ")


def test_gusts_of_all_leave_nobody_else() -> None:
    for of, others in (("", ()), ('vehicle = "a"\n', ("s2",))):
        flown = across(f'[fault.f]\nkind = "gusts"\nwind_m_s = 3\n{of}')
        assert flown.faults is not None
        assert flown.faults.others == others
