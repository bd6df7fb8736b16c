"""A fleet judged as a whole: figures by hand (swarm of the article's vehicle), and its hard cases."""

from __future__ import annotations

import json
import math
from typing import TYPE_CHECKING

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from made_fleet import (
    OUT,
    PACK,
    SEPARATION,
    SWAP,
    checked,
    pad,
    place,
    sortie,
    unpowered,
    up,
    vehicles,
)
from made_missions import item, mission, north, rtl
from made_trajectories import place as place_at
from made_trajectories import straight, trajectory
from thinning import examples

from planner.cli.main import main
from planner.findings import Severity
from planner.fleet.approach import Cylinder, closest_approach
from planner.fleet.charging import PackDay
from planner.fleet.fleet import Charger, Pack
from planner.fleet.separation import Member, Spacing, clearing_delay_s, predict_conflicts
from planner.flight.budget import BatteryBudget
from planner.geo.fence import RallyPoint
from planner.service.fleet import charge_left
from planner.values import replace
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding
    from planner.fleet.trajectory import Trajectory
    from planner.service.fleet import FleetResult

V_M_S = 9.9470
"""True speed of the article's vehicle at a command of 10 m/s."""
LEVEL = Spacing(separation_m=10.0, height_error_m=0.0)


def flying(flown: Trajectory, start_s: float) -> Member:
    """A vehicle that is put on its place when it starts, and cleared away where it ends."""
    start, end = flown.start_s.copy(), flown.end_s.copy()
    start[0], end[-1] = -1e-6, flown.duration_s + 1e-6
    return Member(
        file="",
        trajectory=replace(flown, start_s=start, end_s=end),
        start_s=start_s,
        home_amsl_m=0.0,
        above_m=10.0,
        below_m=10.0,
    )


def through(angle_deg: float, start_s: float) -> Member:
    """A vehicle that passes 0, 0 after 60 s in some direction."""
    east, north = (60.0 * V_M_S * f(math.radians(angle_deg)) for f in (math.cos, math.sin))
    return flying(straight((0, -east, -north, 100), (120, east, north, 100)), start_s)


@pytest.mark.parametrize(
    ("angle_deg", "delay_s"),
    [(0, 1.0053), (30, 1.0408), (60, 1.1608), (90, 1.4217), (120, 2.0106), (150, 3.8843)],
)
def test_crossing_tracks_need_the_start_delay_of_their_angle(
    angle_deg: float, delay_s: float
) -> None:
    """10 m = v τ cos(a/2), less the centimetre of the accuracy."""
    assert delay_s == pytest.approx(
        10.0 / (V_M_S * math.cos(math.radians(angle_deg / 2))), abs=6e-5
    )
    for share, conflicts in ((0.998, 1), (1.0, 0)):
        pair = [through(0, 0.0), through(angle_deg, share * delay_s)]
        assert len(list(predict_conflicts(pair, LEVEL))) == conflicts


def test_delays_that_clear_pairs_do_not_clear_three_through_one_point() -> None:
    pairs = [(0, 60, 2.0), (0, 120, 3.0), (60, 120, 2.0)]
    for one, two, delay_s in pairs:
        assert clearing_delay_s(through(one, 0.0), through(two, 0.0), LEVEL) == delay_s
    fleet = [through(0, 0), through(60, 2.0), through(120, 2.0)]
    [found] = [one for one in predict_conflicts(fleet, LEVEL) if one.first == 1]
    assert found.approach.distance_m == pytest.approx(0.0, abs=0.5)  # to 5 % of the separation
    for starts_s in ((0.0, 2.0, 4.0), (0.0, 1.1608, 2.3216)):
        fleet = [through(60.0 * n, start_s) for n, start_s in enumerate(starts_s)]
        assert list(predict_conflicts(fleet, LEVEL)) == []


def test_one_mission_twice_with_a_hold_is_a_conflict_below_that_delay() -> None:
    held = straight((0, 0, 0, 50), (10, 100, 0, 50), (40, 100, 0, 50), (60, 300, 0, 50))
    for delay_s, conflicts in ((3.0, 1), (28.9, 1), (31.1, 0)):  # 10 m are a second on either side
        pair = [flying(held, start_s) for start_s in (0.0, delay_s)]
        assert len(list(predict_conflicts(pair, LEVEL))) == conflicts


def codes(result: FleetResult) -> set[str]:
    """The codes of what is found of a fleet as a whole."""
    return {one.finding.code for one in result.findings}


def messages(result: FleetResult, code: str) -> list[str]:
    """What is told of a rule."""
    found: list[Finding] = [one.finding for one in result.findings]
    return [one.message for one in found if one.code == code]


coordinate = st.floats(-30.0, 30.0)


@st.composite
def flights(draw: st.DrawFn) -> Trajectory:
    """Three cubics without a jump."""
    points = draw(st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=10, max_size=10))
    rows = np.array(points)
    widths = draw(st.lists(st.floats(1.0, 8.0), min_size=3, max_size=3))
    return trajectory(
        [0.0, *np.cumsum(widths).tolist()], np.stack([rows[0:4], rows[3:7], rows[6:10]])
    )


@settings(max_examples=examples(25), deadline=None)
@given(flights(), flights(), st.floats(-10.0, 10.0), st.floats(1.0, 20.0), st.floats(1.0, 20.0))
def test_no_sample_at_20_hz_is_in_a_zone_that_is_said_to_be_kept(
    first: Trajectory, second: Trajectory, later_s: float, over_m: float, under_m: float
) -> None:
    zone = Cylinder(horizontal_m=8.0, over_m=over_m, under_m=under_m)
    found = closest_approach(first, second, second_later_s=later_s, zone=zone)
    begin_s, end_s = min(0.0, later_s), max(first.duration_s, second.duration_s + later_s)
    time_s = np.arange(begin_s, end_s + 0.05, 0.05)
    between_m = place_at(second, time_s - later_s) - place_at(first, time_s)
    level_m = np.hypot(between_m[:, 0], between_m[:, 1])
    height_m = zone.of_height_m(between_m[:, 2])
    nearest_m = np.maximum(level_m, height_m).min()
    if found is None:
        assert nearest_m >= zone.horizontal_m - 1e-6
    else:
        assert found.distance_m <= nearest_m + 1e-6


def test_copies_from_pads_farther_apart_than_the_separation_are_clear() -> None:
    names = ["a", "b", "c"]
    tables = SEPARATION + "".join(pad(name, 0, 20.0 * n) for n, name in enumerate(names))
    jobs = {f"m{n}": mission(up(20), place(100, 20.0 * n, 20), rtl()) for n in range(3)}
    sorties = [sortie(f"s{n}", name, 0.0, job=f"m{n}") for n, name in enumerate(names)]
    result = checked(tables, vehicles(*names), *sorties, **jobs)
    assert result.verdict == "go"
    assert codes(result) == {"S118"}


def test_the_energy_of_the_group_is_that_of_its_sorties() -> None:
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 0, 200) + vehicles("a", "b")
    tables += sortie("s1", "a", 0.0) + sortie("s2", "b", 100.0)
    result = checked(tables)
    own = [one.assessment.totals for one in result.sorties if one.assessment is not None]
    assert result.totals.energy_wh == pytest.approx(sum(one.energy_wh for one in own))
    assert sum(result.totals.energy_by_state_wh.values()) == pytest.approx(result.totals.energy_wh)
    assert result.totals.makespan_s == pytest.approx(100.0 + own[1].time_s)
    assert result.totals.is_energy_whole


def test_a_vehicle_of_unknown_power_keeps_apart_and_is_left_out_of_the_energy() -> None:
    assert not unpowered().is_power_known
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 0, 8) + vehicles("a")
    result = checked(
        tables,
        vehicles("b", model="unpowered.toml"),
        sortie("s1", "a", 0.0),
        sortie("s2", "b", 0.0),
    )
    assert messages(result, "S113") == ["energy of the group without s2: 1 sortie of 2 counted"]
    assert "S101" in codes(result)
    assert not result.totals.is_energy_whole
    assert result.totals.energy_wh == result.sorties[0].energy_wh


def day(chargers: int) -> PackDay:
    """Three packs for a flight every 32 min; flights of 30 min, charges of 60, swaps of 2."""
    charger = Charger(count=chargers, charge_soc=(0.0, 1.0), charge_s=(0.0, 3600.0), name="c")
    packs = {name: Pack(name=name, group=name) for name in "123"}
    needs_s = {name: [1920.0 * n for n in range(number, 9, 3)] for number, name in enumerate("123")}
    made = PackDay(packs, lambda _: Battery(capacity_wh=77.0), [charger], needs_s)
    for name in packs:
        made.put_down(name, 0.0, 1.0)
    return made


@pytest.mark.parametrize(("chargers", "is_always_full"), [(2, True), (1, False)])
def test_three_packs_and_two_chargers_keep_one_vehicle_flying(
    chargers: int, *, is_always_full: bool
) -> None:
    packs = day(chargers)
    taken = []
    for number in range(9):
        name = "123"[number % 3]
        taken.append(packs.take(name, 1920.0 * number))
        packs.put_down(name, 1920.0 * number + 1920.0, 0.0)
    assert all(charge == 1.0 for charge in taken) is is_always_full
    assert packs.finish()[0].end_s == 1920.0 + 3600.0


def test_the_pack_that_is_needed_next_is_charged_first() -> None:
    charger = Charger(charge_soc=(0.0, 1.0), charge_s=(0.0, 1000.0), name="c")
    packs = {name: Pack(name=name, group=name) for name in "ab"}
    made = PackDay(
        packs, lambda _: Battery(capacity_wh=77.0), [charger], {"a": [5000.0], "b": [1250.0]}
    )
    made.put_down("a", 0.0, 0.5)
    made.put_down("b", 0.0, 0.5)
    assert made.take("b", 1250.0) == 1.0
    assert [(one.pack, one.start_s, one.end_s) for one in made.finish()] == [
        ("b", 0.0, 500.0),
        ("a", 500.0, 1000.0),
    ]


def test_a_sortie_is_checked_with_what_the_chargers_have_put_back() -> None:
    tables = pad("a", 0, 0) + vehicles("a") + SWAP + PACK
    tables += "[charger.c]\ncharge_soc = [0, 1]\ncharge_s = [0, 36000]\n"
    tables += sortie("s1", "a", 0.0, more='pack = "P"') + sortie(
        "s2", "a", 400.0, more='pack = "P"'
    )
    result = checked(tables)
    first, second = result.sorties
    assert first.charge_left is not None
    assert second.charge is not None
    waited_s = 400.0 - first.end_s - 60.0
    assert second.charge == pytest.approx(first.charge_left + waited_s / 36000.0)
    assert second.result.setup.charge == second.charge  # type: ignore[union-attr]


def test_a_return_that_meets_one_in_the_air_is_no_warning_because_it_also_meets_it_standing() -> (
    None
):
    # From 200 m north a's returns lead to the rally point, 15 m beside b's pad; those begun before b
    # starts find it standing there, those begun later cross its flight half-way.
    there = place(100, 150, 0)
    assert there.latitude_deg is not None
    assert there.longitude_deg is not None
    rally = RallyPoint(there.latitude_deg, there.longitude_deg, 20.0)
    waits = mission(up(20), place(200, 0, 20, hold_s=400.0), item(21, north(200), 0.0))
    jobs = {
        "a": replace(waits, rally=(rally,)),
        "b": mission(up(20), place(150, 75, 20, hold_s=30.0), rtl()),
    }
    tables = "[separation]\nhorizontal_m = 20\n" + pad("a", 0, 0) + pad("b", 100, 165)
    tables += vehicles("a", "b") + sortie("s1", "a", 0.0, job="a")
    for start_s, severity in ((200.0, Severity.ERROR), (8000.0, Severity.WARNING)):
        result = checked(tables, sortie("s2", "b", start_s, job="b"), **jobs)
        assert [one.finding.severity for one in result.findings if one.finding.code == "S115"] == [
            severity
        ]


IN_THE_AIR = mission(up(20), place(100, 0, 20))


def test_one_that_ends_in_the_air_does_not_start_again() -> None:
    tables = (
        pad("a", 0, 0) + vehicles("a") + SWAP + sortie("s1", "a", 0.0) + sortie("s2", "a", 900.0)
    )
    told = messages(checked(tables, out=IN_THE_AIR), "S108")
    assert told == ["s2 cannot start: s1 leaves a in the air, without a landing"]


@pytest.mark.parametrize(
    ("lands_m", "late_s", "is_ready"),
    [(100.0, 70.0, False), (100.0, 73.0, True), (19.0, 1.0, True), (21.0, 1.0, False)],
)
def test_a_vehicle_that_lands_elsewhere_is_carried_to_its_start(
    lands_m: float, late_s: float, *, is_ready: bool
) -> None:
    """100 m at 1.4 m/s take 71.4 s, besides the swap."""
    landing = item(21, place(lands_m, 0, 0).latitude_deg, 0.0)
    lands = mission(up(20), place(lands_m, 0, 20), landing)
    tables = pad("a", 0, 0) + vehicles("a") + SWAP + sortie("s1", "a", 0.0)
    [alone] = checked(tables, out=lands).sorties
    start_s = alone.end_s + 60.0 + late_s
    told = messages(checked(tables, sortie("s2", "a", start_s), out=lands), "S108")
    assert bool(told) is not is_ready
    assert all("m from where s1 lands; carried there at a walk, a is ready" in one for one in told)


def back_from(
    landing_m: float, later_s: float, swap: str = SWAP
) -> tuple[str, list[tuple[Severity, str]]]:
    """Verdict and S108 of a vehicle that lands so far north of its pad, and starts there so much later."""
    away = mission(up(20), place(100, 0, 20), item(21, north(landing_m), 0.0))
    tables = pad("a", 0, 0) + vehicles("a") + sortie("s1", "a", 0.0, job="away")
    [first] = checked(swap, tables, away=away).sorties
    again = sortie("s2", "a", first.end_s + later_s, job="out")
    result = checked(swap, tables, again, away=away, out=OUT)
    found = (one.finding for one in result.findings if one.finding.code == "S108")
    return result.verdict, [(one.severity, one.message) for one in found]


def test_a_vehicle_that_lands_out_of_sight_is_brought_by_somebody() -> None:
    """700 m are carried in 500 s on foot, at 1.4 m/s; a swap takes 60 s."""
    for later_s, is_there in ((558.0, False), (562.0, True)):
        verdict, [(severity, message)] = back_from(700.0, later_s)
        assert verdict == ("go" if is_there else "no-go")
        assert severity is (Severity.WARNING if is_there else Severity.ERROR)
        assert ("somebody has to bring a there" in message) is is_there
    # 490 m are in sight: 350 s
    assert back_from(490.0, 412.0) == ("go", [])
    # brought at 7 m/s: in 100 s
    driven = SWAP + "carry_m_s = 7\n"
    assert back_from(700.0, 162.0, driven) == ("go", [])
    verdict, [(severity, message)] = back_from(700.0, 158.0, driven)
    assert (verdict, severity) == ("no-go", Severity.ERROR)
    assert "carried there at 7.0 m/s" in message


def test_a_pack_that_lands_far_away_is_not_flown_at_home_before_it_is_back() -> None:
    """Beyond what is seen of a vehicle, 500 m, a swap does not bring it: 510 m take 364 s.

    From 387.4 and 412.4 m north of one pad it is so far to the other, 300 m east of it.
    """
    for landing_m, later_s, is_there in (
        (387.4, 61.0, True),
        (412.4, 422.0, False),
        (412.4, 427.0, True),
    ):
        away = mission(up(20), place(100, 0, 20), item(21, north(landing_m), 0.0))
        pads = pad("a", 0, 0) + pad("b", 0, 300) + vehicles("a", "b")
        tables = SEPARATION + SWAP + PACK + pads
        first = sortie("s1", "a", 0.0, job="away", more='pack = "P"')
        [alone] = checked(tables, first, away=away).sorties
        second = sortie("s2", "b", alone.end_s + later_s, job="out", more='pack = "P"')
        out = mission(up(20), place(100, 300, 20), rtl())
        found = messages(checked(tables, first, second, away=away, out=out), "S105")
        assert bool(found) is not is_there, (landing_m, later_s, found)


def test_nobody_says_that_a_battery_is_changed() -> None:
    """Without a pack and a swap the flights of a vehicle are counted on one battery of its model."""
    [alone] = checked(pad("a", 0, 0) + vehicles("a"), sortie("s0", "a", 0.0)).sorties
    assert alone.assessment is not None
    assert alone.assessment.battery is not None
    assert alone.energy_wh is not None
    margin_wh = alone.assessment.battery.margin_wh
    # as often as its battery holds above the reserve, and once more
    holds = 1 + int(margin_wh / alone.energy_wh)
    many = "".join(
        sortie(f"s{number}", "a", number * (alone.end_s + 70.0)) for number in range(holds + 1)
    )
    result = checked(pad("a", 0, 0) + vehicles("a"), many)
    found = [one.finding for one in result.findings if one.finding.code == "S108"]
    assert sorted(one.severity for one in found) == [Severity.WARNING] * (holds - 1) + [
        Severity.ERROR
    ]
    assert result.verdict == "no-go"
    assert not messages(checked(SWAP, pad("a", 0, 0) + vehicles("a"), many), "S108")


def test_one_that_ends_in_the_air_is_in_the_way_for_ever() -> None:
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 200, 0) + vehicles("a", "b")
    back = mission(up(20), place(0, 0, 20), place(200, 0, 20), rtl())
    sorties = sortie("s1", "a", 0.0, job="stays"), sortie("s2", "b", 5000.0, job="back")
    assert "S101" in codes(checked(tables, *sorties, stays=IN_THE_AIR, back=back))


def test_one_that_lands_on_the_pad_of_another_is_told() -> None:
    tables = SEPARATION + pad("a", 0, 0) + pad("b", 100, 0) + vehicles("a", "b")
    lands = mission(up(20), place(100, 0, 20), item(21, place(100, 0, 0).latitude_deg, 0.0))
    sorties = sortie("s1", "a", 0.0, job="lands"), sortie("s2", "b", 500.0, job="out")
    result = checked(tables, *sorties, lands=lands, out=OUT)
    assert any(text.startswith("pad b: ") for text in messages(result, "S109"))


def test_unknown_altitudes_of_homes_leave_the_separation_open() -> None:
    nowhere = (pad("a", 0, 0) + pad("b", 0, 200)).replace("amsl_m = 400\n", "")
    tables = (
        SEPARATION + nowhere + vehicles("a", "b") + sortie("s1", "a", 0.0) + sortie("s2", "b", 0.0)
    )
    home = OUT.home
    assert home is not None
    result = checked(tables, out=replace(OUT, home=replace(home, altitude_amsl_m=0.0)))
    [told] = messages(result, "S104")
    assert told.startswith("heights of s1 and s2 cannot be compared")
    assert (result.verdict, result.verdict_text) == ("no-go", "NOT CHECKED")
    # what is not known of a collision is no more ignored than one
    ignored = checked(
        tables + '[conditions]\nignore = ["S"]\n',
        out=replace(OUT, home=replace(home, altitude_amsl_m=0.0)),
    )
    assert messages(ignored, "S104") == [told]
    assert ignored.verdict_text == "NOT CHECKED"


# 10 m at 0.2 m/s take 50 s, at 1.6 m/s, as the response comes down, some 6.
@pytest.mark.parametrize(("land_cm_s", "codes_found"), [(50, set()), (20, {"S108", "S111"})])
def test_a_vehicle_that_lands_late_is_not_ready_before(
    tmp_path: Path, land_cm_s: int, codes_found: set[str]
) -> None:
    """30 s after its predicted landing and the swap it starts again, and is over hours 30 s after that."""
    (tmp_path / "a.param").write_text(f"LAND_SPEED,{land_cm_s}\n")
    model, file = "falkowski-2023-quadrotor", f'params = "{tmp_path}/a.param"'
    given = pad("a", 0, 0) + vehicles("a", model=model, more=file) + SWAP
    [alone] = checked(given, sortie("s1", "a", 0.0)).sorties
    again_s = alone.time_s + 60.0 + 30.0
    limit_s = again_s + alone.time_s + 30.0
    hours = f"[operation]\nlatest_s = {limit_s!r}\n"
    result = checked(given, hours, sortie("s1", "a", 0.0), sortie("s2", "a", again_s))
    assert codes(result) & {"S108", "S111", "S127"} == codes_found


def test_a_battery_has_less_left_by_what_a_flight_is_later_than_its_model() -> None:
    budget = BatteryBudget(
        capacity_wh=100.0,
        usable_wh=90.0,
        used_fraction=0.3,
        reserve_fraction=0.2,
        reserve_wh=20.0,
        margin_wh=40.0,
    )
    assert charge_left(budget, 0.9) == pytest.approx(0.6)
    assert charge_left(budget, 0.9, late_wh=15.0) == pytest.approx(0.45)
    assert charge_left(budget, 0.9, late_wh=70.0) == 0.0


@pytest.mark.parametrize(("planned_m", "told"), [(400.0, 0), (480.0, 1), (0.0, 0)])
def test_a_pad_at_another_altitude_than_the_mission_was_planned_from_is_told(
    planned_m: float, told: int
) -> None:
    home = OUT.home
    assert home is not None
    tables = pad("a", 0, 0) + vehicles("a") + sortie("s1", "a", 0.0)  # at 400 m
    result = checked(tables, out=replace(OUT, home=replace(home, altitude_amsl_m=planned_m)))
    [flown] = result.sorties
    assert [one.code for one in flown.result.findings].count("A115") == told


def test_two_of_one_system_id_are_told() -> None:
    tables = (
        SEPARATION + pad("a", 0, 0) + pad("b", 0, 200) + vehicles("a", "b", more="system_id = 7")
    )
    result = checked(tables, sortie("s1", "a", 0.0), sortie("s2", "b", 0.0))
    assert messages(result, "S102") == ["b and a both have system id 7"]


def test_a_job_without_a_sortie_is_no_go_and_not_a_green_nothing() -> None:
    result = checked(pad("a", 0, 0) + vehicles("a"))
    assert messages(result, "S112") == ["job out has no sortie"]
    assert (result.verdict_text, result.totals.sorties) == ("NOT CHECKED", 0)


def test_charging_in_the_cold_is_told_with_both_temperatures() -> None:
    tables = pad("a", 0, 0) + vehicles("a") + SWAP + PACK + "[charger.c]\nc_rate = 1\n"
    tables += "[conditions]\ntemperature_c = -5\n"
    tables += sortie("s1", "a", 0.0, more='pack = "P"') + sortie(
        "s2", "a", 4000.0, more='pack = "P"'
    )
    assert messages(checked(tables), "S107") == [
        "pack P is not charged for s2: charger c charges from 0 °C up, it is -5 °C there"
    ]


def fleet_file(folder: Path, mission_file: str) -> Path:
    """A fleet of one sortie of two vehicles."""
    file = folder / "fleet.toml"
    tables = SEPARATION + vehicles("a", "b").replace('pad = "a"', "").replace('pad = "b"', "")
    file.write_text(
        f'schema = 1\n[job.out]\nmission = "{mission_file}"\n{tables}'
        + sortie("s1", "a", 0.0)
        + sortie("s2", "b", 3.0)
    )
    return file


def test_a_mission_that_cannot_be_read_is_exit_code_2(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = fleet_file(tmp_path, "none.plan")
    assert main(["fleet", "check", str(file), "--format", "json"]) == 2
    document = json.loads(capsys.readouterr().out)
    assert (document["verdict"], document["verdict_text"]) == (None, "NOT CHECKED")
    assert document["sorties"][0]["mission"]["findings"][0]["code"] == "X901"
    told = {one["code"] for one in document["findings"]}
    assert {"S104", "S113"} <= told


def test_every_problem_of_a_file_is_told_on_a_line_of_its_own(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "fleet.toml"
    file.write_text("schema = 1\n[swap]\ntime = 3\n")
    assert main(["fleet", "check", str(file)]) == 2
    lines = capsys.readouterr().err.splitlines()
    assert [line.split(": ")[2] for line in lines] == ["vehicle", "job", "swap.time", "swap.time_s"]


@pytest.mark.parametrize("where", ["command line", "fleet file"])
def test_vehicles_that_meet_take_part_in_the_verdict_whatever_is_ignored(
    where: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from planner.mission.files import write_mission

    write_mission(OUT, tmp_path / "out.plan")
    file = fleet_file(tmp_path, "out.plan")
    given = ["fleet", "check", str(file), "--format", "json"]
    assert main(given) == 1
    met = {"S114", "S116"}
    assert met <= {one["code"] for one in json.loads(capsys.readouterr().out)["findings"]}
    assert main([*given, "--ignore", "S114"]) == 2
    assert "the separation that is really required" in capsys.readouterr().err
    if where == "fleet file":
        file.write_text(file.read_text() + '\n[conditions]\nignore = ["S"]\n')
    else:
        given += ["--ignore", "S"]
    assert main(given) == 1
    document = json.loads(capsys.readouterr().out)
    assert met <= {one["code"] for one in document["findings"]}
    assert "S115" in {one["code"] for one in document["suppressed"]}  # a return that may be needed


def test_two_that_meet_in_the_air_take_part_in_the_verdict_whatever_a_file_ignores(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from planner.mission.files import write_mission

    write_mission(OUT, tmp_path / "out.plan")
    file = tmp_path / "fleet.toml"
    # pads 11 m apart, 10 m required: only on the way to the one place do they come nearer
    tables = "".join((SEPARATION, vehicles("a", "b"), pad("a", 0, 0), pad("b", 0, 11)))
    tables += sortie("s1", "a", 0.0) + sortie("s2", "b", 0.0) + '[job.out]\nmission = "out.plan"\n'
    for ignored, code in (('"S101"', 2), ('"S1", "S115"', 1), ('"S"', 1)):
        file.write_text(f"schema = 1\n{tables}[conditions]\nignore = [{ignored}]\n")
        assert main(["fleet", "check", str(file), "--format", "json"]) == code, ignored
        told = capsys.readouterr()
        if code == 1:
            document = json.loads(told.out)
            assert {one["code"] for one in document["findings"]} == {"S101"}
            assert "S115" in {one["code"] for one in document["suppressed"]}
        else:
            assert "conditions.ignore: S101 cannot be ignored" in told.err


FAST = mission(
    up(20), place(100, 0, 20), item(178, None, 0, params=(1, 60, -1, 0)), place(300, 0, 20), rtl()
)
"""Faster than the model knows: E105, a warning, at item 4."""
IGNORES = """fail_on = "warning"
[{table}per_file_ignores]
"{key}" = ["E105"]
"""


@pytest.mark.parametrize(
    ("key", "code"),
    [
        ("fast.plan", 0),
        ("*", 0),
        ("in/fast.plan", 0),
        ("fast.plan#4", 0),
        ("fast.plan#3", 1),
        ("other.plan", 1),
        ("out/*", 1),
    ],
)
def test_codes_are_ignored_of_files_as_a_check_of_these_does(
    key: str, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from planner.mission.files import write_mission

    (tmp_path / "in").mkdir()
    fast = tmp_path / "in" / "fast.plan"
    write_mission(FAST, fast)
    (tmp_path / "mavjoule.toml").write_text(IGNORES.format(table="", key=key))
    file = tmp_path / "fleet.toml"
    tables = '[vehicle.a]\nmodel = "arducopter-sitl-quad"\n' + sortie("s1", "a", 0.0)
    tables += '[job.out]\nmission = "in/fast.plan"\n'
    file.write_text(
        f"schema = 1\n{tables}[conditions]\n{IGNORES.format(table='conditions.', key=key)}"
    )
    alone = main(["check", str(fast), "--vehicle", "arducopter-sitl-quad"])
    assert (alone, main(["fleet", "check", str(file)])) == (code, code)
    told = capsys.readouterr()
    assert told.err == ""
    remark = "" if code else " (1 warning suppressed)"
    [of_fleet] = [line for line in told.out.splitlines() if "fleet.toml" in line][:1]
    assert f"fast.plan{remark}" in told.out.splitlines()[0]
    assert of_fleet == f"{'NO-GO' if code else 'GO'}  {file}{remark}"


def test_patterns_of_a_fleet_file_are_met_by_no_mission_beside_its_folder(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    from planner.mission.files import write_mission

    write_mission(FAST, tmp_path / "fast.plan")
    (tmp_path / "fleet").mkdir()
    file = tmp_path / "fleet" / "fleet.toml"
    tables = '[vehicle.a]\nmodel = "arducopter-sitl-quad"\n' + sortie("s1", "a", 0.0)
    tables += '[job.out]\nmission = "../fast.plan"\n[conditions]\n'
    file.write_text(f"schema = 1\n{tables}{IGNORES.format(table='conditions.', key='*')}")
    assert main(["fleet", "check", str(file), "--format", "json"]) == 1
    [one] = json.loads(capsys.readouterr().out)["sorties"]
    assert "E105" in {found["code"] for found in one["mission"]["findings"]}
