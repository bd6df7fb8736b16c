"""The sorties of a fleet simulated as filed: the flights of their checks, and who gives way."""

from __future__ import annotations

from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_fleet import checked, pad, place, sortie, up, vehicles
from made_missions import item, mission, north, rtl
from made_swarm import drawn_missions, simulated

from planner.errors import UsageError
from planner.findings import Severity
from planner.fleet.reader import read_fleet
from planner.fleet.swarm.yielding import Passage, Traveller, Yielding
from planner.mission.files import write_mission
from planner.service.fleet_separation import members
from planner.service.swarm_missions import planned_sorties
from planner.service.swarm_sorties import StoppedSorties

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.fleet.swarm.tracks import ZoneTrack
    from planner.mission.items import Mission
    from planner.service.swarm import SwarmAgent

SEPARATION = "[separation]\nhorizontal_m = 10\n"
STEP, ARDUPILOT, PX4 = "falkowski-2023-quadrotor", "arducopter-sitl-quad", "px4-sih-quad"
TO_NORTH = mission(up(50), place(300, 0, 50), rtl())
TO_EAST = mission(up(50), place(150, 150, 50), rtl())
"""From 150 m north and west: east across the track of the other, at its middle."""


def settles_s() -> float:
    """When the article's response to a step is within 2 % for good, sampled by `scipy`."""
    from scipy.interpolate import CubicSpline
    from scipy.signal import lti, step

    sampled_s, sampled = step(lti([0.3588], [1.0, 0.935, 0.3588]), T=np.linspace(0.0, 20.0, 2001))
    time_s = np.linspace(0.0, 20.0, 200_001)
    value = CubicSpline(sampled_s, sampled)(time_s)
    return 0.6 + float(time_s[np.flatnonzero(np.abs(value - 1.0) > 0.02)[-1]])


def crossing(one: str = STEP, two: str = STEP, *, later_s: float = 0.0) -> tuple[str, ...]:
    """Two whose tracks cross."""
    return (
        SEPARATION + pad("a", 0, 0) + pad("b", 150, -150),
        vehicles("a", model=one) + vehicles("b", model=two),
        sortie("s1", "a", 0.0, job="to_north") + sortie("s2", "b", later_s, job="to_east"),
    )


MISSIONS: dict[str, Mission] = {"to_north": TO_NORTH, "to_east": TO_EAST}


@pytest.mark.parametrize("models", [(STEP, STEP), (PX4, ARDUPILOT)])
def test_without_avoidance_each_flies_as_its_check_says(models: tuple[str, str]) -> None:
    tables = crossing(*models, later_s=3.5)
    flown = simulated(*tables, policy="none", **MISSIONS)
    check = checked(*tables, **MISSIONS)
    for agent, one in zip(flown.agents, check.sorties, strict=True):
        assert agent.name == one.name
        assert agent.start_s == one.start_s
        assert agent.time_s == pytest.approx(one.time_s, abs=1e-6)
        # the model of the PX4 has no power
        assert (agent.energy_wh or 0.0) == pytest.approx(one.energy_wh or 0.0, rel=1e-9)
        assert agent.has_landed


@pytest.mark.parametrize("model", [STEP, ARDUPILOT, PX4])
def test_one_that_is_alone_flies_as_its_check_says_though_it_would_stop(model: str) -> None:
    tables = (
        SEPARATION + pad("a", 0, 0) + vehicles("a", model=model),
        sortie("s1", "a", 2.0, job="to_north"),
    )
    (agent,) = simulated(*tables, policy="stop", to_north=TO_NORTH).agents
    (one,) = checked(*tables, to_north=TO_NORTH).sorties
    assert agent.time_s == pytest.approx(one.time_s, abs=1e-6)
    # the model of the PX4 has no power
    assert (agent.energy_wh or 0.0) == pytest.approx(one.energy_wh or 0.0, rel=1e-9)
    assert (agent.stops, agent.waited_s) == (0, 0.0)


def test_without_avoidance_they_meet_where_the_check_of_the_fleet_says() -> None:
    tables = crossing()
    flown = simulated(*tables, policy="none", **MISSIONS)
    check = checked(*tables, **MISSIONS)
    said = [one for one in check.findings if one.finding.code == "S101"]
    assert len(said) == 1
    (near,) = flown.distances.nearest
    assert {near.first, near.second} == set(said[0].sorties)
    assert near.time_s == pytest.approx(said[0].at_s, abs=0.01)
    # By places every millisecond about then, of the flights themselves.
    separation = check.fleet.separation
    assert separation is not None
    one, two = (each.trajectory for each in members(check.fleet, separation, check.sorties))
    at_s = near.time_s + np.linspace(-2.0, 2.0, 4001)
    apart_m = np.hypot(*(one.place_m(at_s) - two.place_m(at_s))[:, :2].T)
    assert near.time_s == pytest.approx(at_s[apart_m.argmin()], abs=0.01)
    assert near.distance_m == pytest.approx(apart_m.min(), abs=0.02)
    assert [one.code for one in flown.findings if one.code == "S128"] == ["S128"]


def test_without_avoidance_drawn_missions_meet_when_the_check_of_the_fleet_says() -> None:
    """And come as near as places every millisecond say, to the centimetre an approach is found to."""
    tables, missions = drawn_missions(7, models=(STEP,))
    tables += "[conditions]\nposition_error_m = 0\n"
    flown = simulated(tables, policy="none", **missions)
    check = checked(tables, **missions)
    separation = check.fleet.separation
    assert separation is not None
    members_of = {one.file: one for one in members(check.fleet, separation, check.sorties)}
    said = {
        frozenset(one.sorties): one.at_s for one in check.findings if one.finding.code == "S101"
    }
    near = [one for one in flown.distances.nearest if one.distance_m < 9.99]
    assert {frozenset((one.first, one.second)) for one in near} == set(said)
    for one in near:
        assert one.time_s == pytest.approx(said[frozenset((one.first, one.second))], abs=0.01)
        sampled_s = one.time_s + np.linspace(-3.0, 3.0, 6001)
        first_m, second_m = (
            members_of[name].trajectory.place_m(sampled_s - members_of[name].start_s)
            for name in (one.first, one.second)
        )
        apart_m = np.linalg.norm(first_m - second_m, axis=1)
        assert one.distance_m == pytest.approx(apart_m.min(), abs=0.01)


def test_the_trace_of_missions_has_their_heights() -> None:
    record = simulated(*crossing(), policy="none", **MISSIONS).record
    assert record.height_m is not None
    assert record.height_m.max() == pytest.approx(50.0, rel=0.01)  # G1 overshoots by 0.9 %
    assert record.height_m[0] == pytest.approx([0.0, 0.0])


EXACT = "[conditions]\nposition_error_m = 0\n"


def level(one: SwarmAgent) -> list[tuple[str, float, float]]:
    """States, times and distances of a flight, between its take-off and its landing."""
    assert one.flight is not None
    return [
        (str(each.state), each.duration_s, each.distance_m)
        for each in one.flight.segments
        if each.state not in {"takeoff", "land"}
    ]


def test_who_goes_later_stops_in_time_before_a_track_that_crosses() -> None:
    """§6: 32.654 m to the farthest point of a stop, and the 10 m that are kept: 42.654 m."""
    tables = crossing()
    flown = simulated(*tables, EXACT, **MISSIONS)
    first, second = flown.agents
    check = checked(*tables, EXACT, **MISSIONS)
    assert first.stops == 0
    assert first.time_s == check.sorties[0].time_s
    assert first.energy_wh == check.sorties[0].energy_wh
    (_, _, accelerated_m), (_, _, cruised_m), (brakes, _, _), (hovers, held_s, _) = level(second)[
        :4
    ]
    assert (brakes, hovers) == ("brake", "hover")
    assert 150.0 - (accelerated_m + cruised_m) == pytest.approx(42.654, rel=0.003)
    assert held_s >= 1.0
    assert not [one for one in flown.findings if one.code in {"S128", "S129", "S130"}]
    assert flown.distances.nearest[0].distance_m >= 10.0
    # A command of 0 for T on a straight costs T: until it has settled, and the hold.
    stops = [one for one in level(second) if one[0] == "hover"]
    own = check.sorties[1]
    after_s = second.time_s - own.time_s
    on_ways = [held_s for _, held_s, _ in stops]
    assert second.stops == len(stops)
    assert second.waited_s <= sum(on_ways)
    # The second stop is where it turns back, and stands anyway.
    assert after_s == pytest.approx(settles_s() + sum(on_ways), abs=1e-3)
    assert second.distance_m == pytest.approx(600.0, abs=0.5)
    assert second.energy_wh is not None
    assert own.energy_wh is not None
    assert second.energy_wh > own.energy_wh


def test_who_goes_later_stops_in_time_before_one_that_hovers() -> None:
    hovering = mission(up(50), place(300, 0, 50, hold_s=90.0), rtl())
    passing = mission(up(50), place(600, 0, 50), rtl())
    flown = simulated(
        SEPARATION + EXACT + pad("a", 300, 0) + pad("b", 0, 0),
        vehicles("a", "b", model=STEP),
        sortie("s1", "a", 0.0, job="hovering") + sortie("s2", "b", 0.0, job="passing"),
        hovering=hovering,
        passing=passing,
    )
    (_, _, accelerated_m), (_, _, cruised_m), *_ = level(flown.agents[1])
    assert 300.0 - (accelerated_m + cruised_m) == pytest.approx(42.654, rel=0.003)
    assert all(one.has_landed for one in flown.agents)
    assert "S128" not in {one.code for one in flown.findings}


def test_two_head_on_stop_where_their_zones_touch_and_are_reported() -> None:
    """§6: 75.308 m apart when told from 10 m/s, 11.528 m at rest; neither can pass the other."""
    with TemporaryDirectory() as folder:
        there, back = (
            mission(up(50), place(600.0 * far, 0, 50, hold_s=1.0), place(300, 0, 50))
            for far in (1.0, 0.0)
        )
        for name, one in (("there", there), ("back", back)):
            write_mission(one, Path(folder) / f"{name}.plan")
        file = Path(folder) / "fleet.toml"
        file.write_text(
            "schema = 1\n"
            + "".join(f'[job.{name}]\nmission = "{name}.plan"\n' for name in ("there", "back"))
            + "[separation]\nhorizontal_m = 10\n"
            + EXACT
            + pad("a", 0, 0)
            + pad("b", 600, 0)
            + vehicles("a", "b", model=STEP)
            + sortie("s1", "a", 0.0, job="there")
            + sortie("s2", "b", 0.0, job="back"),
            encoding="utf-8",
        )
        fleet = read_fleet(file)
        flown = planned_sorties(fleet)
    separation = fleet.separation
    assert separation is not None
    sorties = StoppedSorties(fleet, separation, flown)
    agents = [Traveller(track, 0.0, rank) for rank, track in enumerate(sorties.tracks)]
    for agent in agents:  # both are on their way already
        agent.passage, agent.start_s = Passage.FLIES, 0.0
    before = [one.track for one in agents]
    told_s: list[float] = []
    yielding = Yielding(agents, sorties, sorties.keeps)
    yielding.time_s = 1.0
    yielding.run(600.0, told_s.append)
    assert yielding.stuck == [0, 1]
    # The other as soon as it comes nearer: 2 mm beyond what is kept, and 1e-4 of a part of 2.5 m.
    assert told_s[1] == pytest.approx(told_s[0], abs=0.02)

    def gap_m(time_s: float, tracks: Sequence[ZoneTrack]) -> float:
        north_m = [
            np.interp(
                time_s,
                one.time_s[np.isfinite(one.time_s)],
                one.place_m[: np.isfinite(one.time_s).sum(), 1],
            )
            for one in tracks
        ]
        return float(north_m[1] - north_m[0])

    assert gap_m(told_s[0], before) == pytest.approx(75.308, rel=0.003)
    assert gap_m(590.0, [one.track for one in agents]) == pytest.approx(11.528, abs=0.003 * 75.308)


def test_missions_as_filed_are_not_left_for_reciprocal_velocities() -> None:
    with pytest.raises(UsageError, match="which orca-stop leaves"):
        simulated(*crossing(), policy="orca-stop", **MISSIONS)


def test_a_fleet_without_sorties_has_nothing_to_simulate() -> None:
    with pytest.raises(UsageError, match="no sortie"):
        simulated(*crossing()[:2], policy="none", **MISSIONS)


def test_a_mission_that_cannot_be_read_is_named_with_what_is_wrong() -> None:
    sorties = sortie("s1", "a", 0.0, job="away")
    job = '[job.away]\nmission = "away.plan"\n'
    with pytest.raises(UsageError, match=r"s1 cannot be read: .*away\.plan: no such file"):
        simulated(crossing()[0] + crossing()[1] + job, sorties, policy="stop")


@pytest.mark.parametrize(("seed", "most"), [(4, 4), (11, 4), (573, 8)])
def test_whoever_flies_them_drawn_missions_keep_apart(seed: int, most: int) -> None:
    """`tests/bench/test_swarm_campaign.py` draws a thousand.

    In the last, who goes later flies home already, and cannot be stopped: who goes first has to be.
    """
    tables, missions = drawn_missions(seed, most=most)
    flown = simulated(tables, policy="stop", **missions)
    codes = {one.code for one in flown.findings}
    assert "S128" not in codes
    assert all(one.has_landed for one in flown.agents) or "S129" in codes


@pytest.mark.parametrize("packs", [("P-1", "P-2"), ("P-1", "P-1")])
def test_a_pack_that_comes_back_late_has_a_charge_nobody_knows(packs: tuple[str, str]) -> None:
    pack = '[swap]\ntime_s = 60\n[pack.P]\nbattery = "5.2Ah@14.8V"\ncount = 2\n'
    first, again = (f'pack = "{one}"' for one in packs)
    flown = simulated(
        crossing()[0] + crossing()[1] + pack,
        sortie("s1", "a", 0.0, job="to_north")
        + sortie("s2", "b", 0.0, job="to_east", more=first)
        + sortie("s3", "b", 400.0, job="to_east", more=again),
        **MISSIONS,
    )
    said = [one.message for one in flown.findings if "comes back" in one.message]
    assert len(said) == (packs[0] == packs[1])


def test_who_lands_elsewhere_is_carried_back_before_it_flies_again() -> None:
    """350 m on foot, 250 s at 1.4 m/s, and a swap of 60 s."""
    away = mission(up(20), place(100, 0, 20), item(21, north(350.0), 0.0))
    tables = SEPARATION + pad("a", 0, 0) + vehicles("a", model=ARDUPILOT) + "[swap]\ntime_s = 60\n"
    again = sortie("s1", "a", 0.0, job="away") + sortie("s2", "a", 300.0, job="to_north")
    first, second = simulated(tables, again, away=away, to_north=TO_NORTH).agents
    assert second.start_s == pytest.approx(first.time_s + 60.0 + 250.0, abs=1.5)
    as_planned = simulated(tables, again, policy="none", away=away, to_north=TO_NORTH)
    assert "S108" in {one.code for one in as_planned.findings}
    assert not as_planned.is_clear


TWICE = SEPARATION + pad("a", 0, 0) + pad("b", 150, -150) + "[swap]\ntime_s = 60\n"
"""As `crossing`, in tables to be changed."""


@pytest.mark.parametrize(
    ("tables", "code"),
    [
        (
            TWICE
            + vehicles("a", "b")
            + sortie("s1", "a", 0.0)
            + sortie("s2", "b", 600.0, job="to_east"),
            "",
        ),
        # one pack in both
        (
            TWICE
            + '[pack.P]\nbattery = "170Wh"\n'
            + vehicles("a", "b")
            + sortie("s1", "a", 0.0, more='pack = "P"')
            + sortie("s2", "b", 10.0, job="to_east", more='pack = "P"'),
            "S105",
        ),
        (
            TWICE
            + vehicles("a")
            + vehicles("b", more="available_from_s = 601")
            + sortie("s1", "a", 0.0)
            + sortie("s2", "b", 600.0, job="to_east"),
            "S108",
        ),
        (
            TWICE
            + '[pack.P]\nbattery = "170Wh"\nfits = ["b"]\n'
            + vehicles("a", "b")
            + sortie("s1", "a", 0.0, more='pack = "P"'),
            "S110",
        ),
    ],
)
def test_what_sorties_share_is_as_the_check_of_the_fleet_has_it(tables: str, code: str) -> None:
    tables = tables.replace('job = "out"', 'job = "to_north"')
    found = {one.code for one in checked(tables, **MISSIONS).all_findings}
    flown = simulated(tables, **MISSIONS)
    told = {one.code for one in flown.findings if one.severity > Severity.INFO}
    assert flown.is_clear is not bool(code)
    assert ({code} <= told) if code else not told
    assert not code or code in found


def test_nobody_takes_off_from_a_pad_on_which_another_stands() -> None:
    """A minute to clear it away, and one to put the next there."""
    tables = TWICE + vehicles("a", "b") + sortie("s1", "a", 0.0, job="to_north")
    [alone] = simulated(tables, **MISSIONS).agents
    for later_s, is_free in ((118.0, False), (122.0, True)):
        second = sortie("s2", "b", alone.time_s + later_s, job="to_north", more='pad = "a"')
        found = {one.code for one in simulated(tables, second, **MISSIONS).findings}
        assert ("S109" in found) is not is_free


@pytest.mark.parametrize(("ground_m", "is_near"), [(59.0, False), (61.0, True)])
def test_pads_are_apart_as_far_as_the_ground_asks_for(ground_m: float, *, is_near: bool) -> None:
    separation = SEPARATION + f"ground_m = {ground_m}\n"
    both = pad("a", 0, 0) + pad("b", 0, 60) + vehicles("a", "b")
    two = sortie("s1", "a", 0.0, job="to_north") + sortie("s2", "b", 0.0, job="beside")
    beside = mission(up(50), place(300, 60, 50), rtl())
    flown = simulated(separation, both, two, to_north=TO_NORTH, beside=beside)
    assert flown.is_clear is not is_near
    assert ("S116" in {one.code for one in flown.findings}) is is_near
