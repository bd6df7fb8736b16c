"""Plans of fleets: who flies what when, and that the check of the fleet passes what is written."""

from __future__ import annotations

import signal
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from judged_plans import faults, planned_fleet
from made_fleet import OUT, SEPARATION, pad, place, up, vehicles
from made_missions import item, mission, north, rtl

import planner
from planner.cli.fleet import interrupting
from planner.errors import FleetPlanError, UsageError
from planner.fleet.fleet import Sortie
from planner.fleet.reader import read_fleet
from planner.fleet.schedule import Objective, Option, Patience, Task
from planner.mission.files import write_mission
from planner.mission.formats.plan import read_plan_text
from planner.report.fleet import plan_text
from planner.report.text import Medium
from planner.service.fleet import SortieChecks, check_fleet
from planner.service.fleet_plan import PLAN_FILE, FleetPlan, plan_fleet, write_plan
from planner.service.fleet_ways import Candidate, Ways
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import Mission

PADS = pad("a", 0, 0) + pad("b", 0, 300)
TWO = vehicles("a", "b") + SEPARATION + PADS
BESIDE = mission(up(20), place(100, 300, 20), rtl())
"""As `OUT`, from the pad of the second vehicle."""
SWAP = "[swap]\ntime_s = 60\n"


def planned(
    folder: Path,
    *tables: str,
    minimize: str = "makespan",
    jobs: dict[str, Mission] | None = None,
    patience: Patience | None = None,
) -> FleetPlan:
    """Return the plan of a fleet of tables, for a folder beside its file."""
    text = "schema = 1\n"
    for name, one in (jobs or {"first": OUT, "second": BESIDE}).items():
        write_mission(one, folder / f"{name}.plan")
        if f"[job.{name}]" not in "".join(tables):
            text += f'[job.{name}]\nmission = "{name}.plan"\n'
    (folder / "given.toml").write_text(text + "\n".join(tables), encoding="utf-8")
    return plan_fleet(
        read_fleet(folder / "given.toml"),
        minimize=minimize,
        folder=folder / "out",
        patience=patience,
    )


def test_two_jobs_are_flown_side_by_side_and_what_is_written_passes_the_check(
    tmp_path: Path,
) -> None:
    made = planned(tmp_path, TWO)
    assert [one.start_s for one in made.fleet.sorties.values()] == [0.0, 0.0]
    assert {one.vehicle for one in made.fleet.sorties.values()} == {"a", "b"}
    assert made.schedule.is_best
    alone = planner.check(OUT, planner.load_vehicle("arducopter-sitl-quad")).totals
    # the pad 300 m farther east is good to a centimetre
    assert made.result.totals.makespan_s == pytest.approx(alone.time_s, rel=1e-3)
    assert [row.vehicles for row in made.rows] == [1, 2]
    single, both = made.rows
    assert single.makespan_s > 2.0 * both.makespan_s  # it has to get there
    assert made.marks(single) == ("fewest in time",)
    assert (both.least_energy_wh, made.marks(both)) == (both.energy_wh, ("least energy",))
    assert single.least_energy_wh == single.energy_wh > both.energy_wh
    assert all(row.is_clear for row in made.rows)
    file = write_plan(made, tmp_path / "out")
    assert file == tmp_path / "out" / PLAN_FILE
    again = check_fleet(read_fleet(file))
    assert again.verdict == made.result.verdict == "go"
    assert again.totals.makespan_s == pytest.approx(made.result.totals.makespan_s, abs=2e-3)
    twice = planned(tmp_path, TWO)
    other = write_plan(twice, tmp_path / "out", force=True)
    assert other.read_bytes() == file.read_bytes()
    # a mission of its own for each sortie, here the whole of its job
    for name, one in read_fleet(file).sorties.items():
        assert one.mission == str(tmp_path / "out" / f"{name}.plan")
        job = Path(made.fleet.jobs[one.job].mission)
        assert Path(one.mission).read_bytes() == job.read_bytes()
    with pytest.raises(UsageError, match="exists already"):
        write_plan(twice, tmp_path / "out")


def test_what_is_ignored_of_the_file_of_a_job_is_of_what_is_written_for_it(tmp_path: Path) -> None:
    fast = item(178, None, 0, params=(1, 60, -1, 0))  # the model does not know that: E105 at item 4
    jobs = {
        name: mission(up(20), place(100, east_m, 20), fast, place(300, east_m, 20), rtl())
        for name, east_m in (("first", 0), ("second", 300))
    }
    ignores = '[conditions]\nfail_on = "warning"\n[conditions.per_file_ignores]\n'
    with pytest.raises(FleetPlanError, match="second cannot be flown: it is a no-go"):
        planned(tmp_path, TWO, ignores + '"first.plan" = ["E105"]\n', jobs=jobs)
    ignores += '"first.plan" = ["E105"]\n"second.plan#4" = ["E1"]\n"*" = ["X9"]\n'
    made = planned(tmp_path, TWO, ignores, jobs=jobs)
    file = write_plan(made, tmp_path / "out")
    assert check_fleet(read_fleet(file)).verdict == "go"
    lines = file.read_text(encoding="utf-8").splitlines()
    start = lines.index("[conditions.per_file_ignores]") + 1
    assert sorted(lines[start : lines.index("", start)]) == [
        '"first.plan" = ["E105", "X9"]',
        '"second.plan" = ["X9"]',
        '"second.plan#4" = ["E1"]',
    ]


def test_least_vehicles_fly_one_after_the_other(tmp_path: Path) -> None:
    made = planned(tmp_path, TWO, minimize="vehicles")
    first, second = made.fleet.sorties.values()
    assert first.vehicle == second.vehicle
    flown = {one.name: one for one in made.result.sorties}
    # no pack is named, so nothing is changed in between
    assert second.start_s == pytest.approx(flown[first.name].end_s, abs=2e-3)


def test_a_vehicle_that_lands_elsewhere_flies_last(tmp_path: Path) -> None:
    """From 600 m away it is carried in 429 s: the flight that comes home is the first."""
    away = mission(up(20), place(100, 0, 20), item(21, north(600.0), 0.0))
    tables = vehicles("a") + pad("a", 0, 0) + SWAP
    jobs = {"away": away, "back": OUT}
    made = planned(tmp_path, tables, jobs=jobs)
    first, second = made.result.sorties
    assert (first.sortie.job, second.sortie.job) == ("back", "away")
    assert second.start_s == pytest.approx(first.end_s + 60.0, abs=2e-3)
    # a start at 300 s leaves time for the other, but not to carry the vehicle back
    later = '[job.back]\nmission = "back.plan"\nearliest_s = 300\n'
    made = planned(tmp_path, later, tables, jobs=jobs)
    assert [one.sortie.job for one in made.result.sorties] == ["back", "away"]
    # brought back at 10 m/s it is there in time
    made = planned(tmp_path, later, tables + "carry_m_s = 10\n", jobs=jobs)
    assert [one.sortie.job for one in made.result.sorties] == ["away", "back"]


def test_one_pack_is_charged_between_two_flights(tmp_path: Path) -> None:
    tables = (
        vehicles("a") + pad("a", 0, 0) + SWAP + '[pack.P]\nbattery = "170Wh"\n'
        "[charger.C]\ncharge_soc = [0, 1]\ncharge_s = [0, 3600]\n"
    )
    made = planned(tmp_path, tables)
    first, second = made.result.sorties
    # an hour from empty to full, even in the charge
    charged_s = 3600.0 * (1.0 - (first.charge_left or 0.0))
    assert second.start_s == pytest.approx(first.end_s + 60.0 + charged_s, abs=0.01)
    assert second.charge == pytest.approx(1.0, abs=1e-4)
    assert made.result.verdict == "go"


def test_what_is_least_says_how_packs_are_charged_and_why_a_vehicle_does_not_fly(
    tmp_path: Path,
) -> None:
    """Both flights begin where the first vehicle stands, and the one pack is charged in between."""
    pack = SWAP + '[pack.P]\nbattery = "170Wh"\n'
    charger = "[charger.C]\ncharge_soc = [0, 1]\ncharge_s = [0, 3600]\n"
    twice = {"first": OUT, "second": OUT}
    text = plan_text(planned(tmp_path, TWO, pack + charger, jobs=twice), medium=Medium(width=400))
    assert "no plan of these sorties has less where every pack is charged full before" in text
    assert "Not used: b. No plan found with more vehicles has a shorter makespan: " in text
    assert "the last to start, waits for pack P to be charged.\n" in text
    # with neither packs nor a second flight nobody waits for anything
    text = plan_text(planned(tmp_path, TWO, jobs={"first": OUT}), medium=Medium(width=400))
    assert "charged full" not in text
    assert "Not used: b. No plan found with more vehicles has a shorter makespan.\n" in text
    # all that are there fly: nothing to say
    assert "Not used" not in plan_text(planned(tmp_path, TWO), medium=Medium(width=400))


def test_a_job_that_may_be_split_is_shared_out(tmp_path: Path) -> None:
    long = mission(
        up(30), *(place(200.0 + 1000.0 * (row % 2), 40.0 * row, 30.0) for row in range(10)), rtl()
    )
    tables = (
        vehicles("a")
        + pad("a", 0, 0)
        + SWAP
        + '[pack.P]\nbattery = "60Wh"\ncount = 6\n'
        + '[job.long]\nmission = "long.plan"\nmay_split = true\n'
    )
    made = planned(tmp_path, tables, jobs={"long": long}, minimize="batteries")
    assert len(made.fleet.sorties) > 1
    assert {Path(path).name for path in made.missions} == {
        f"{name}.plan" for name in made.fleet.sorties
    }
    file = write_plan(made, tmp_path / "out")
    assert check_fleet(read_fleet(file)).verdict == "go"


def test_the_least_energy_is_of_plans_for_energy_not_of_the_fastest(tmp_path: Path) -> None:
    long = mission(
        up(30), *(place(200.0 + 300.0 * (row % 2), 20.0 * row, 30.0) for row in range(6)), rtl()
    )
    tables = SEPARATION + SWAP + pad("a", 0, 0) + pad("b", 0, 100) + vehicles("a", "b")
    tables += '[pack.P]\nbattery = "170Wh"\ncount = 2\n'
    tables += '[job.long]\nmission = "long.plan"\nmay_split = true\n'
    made = planned(tmp_path, tables, jobs={"long": long})
    one, two = made.rows
    # shared out, the second takes off, comes home and lands as well
    assert two.makespan_s < one.makespan_s
    assert two.energy_wh > one.energy_wh == one.least_energy_wh == two.least_energy_wh
    assert (made.marks(one), made.marks(two)) == (("fewest in time", "least energy"), ())
    assert "least energy" in plan_text(made, medium=Medium(width=200))


FACING = (
    SEPARATION
    + pad("a", 0, 0)
    + pad("b", 200, 0)
    + vehicles("a", more='equipment = ["of a"]')
    + vehicles("b", more='equipment = ["of b"]')
    + '[job.first]\nmission = "first.plan"\nneeds = ["of a"]\n'
    + '[job.second]\nmission = "second.plan"\nneeds = ["of b"]\n'
)
"""Two jobs, each for a vehicle of its own."""
ALONG = {  # the same 200 m towards each other: no start but a late one clears them
    "first": mission(up(20), place(200, 60, 20), rtl()),
    "second": mission(up(20), place(0, 60, 20), rtl()),
}
LAYERS = "[layers]\nlowest_m = 30\nhighest_m = 80\nstep_m = 10\n"
"""10 m: 5 m of separation and twice 2.5 m of height errors."""


def test_what_only_a_late_start_clears_is_lifted_to_a_layer(tmp_path: Path) -> None:
    made = planned(tmp_path, FACING + LAYERS, jobs=ALONG)
    assert [one.start_s for one in made.fleet.sorties.values()] == [0.0, 0.0]
    # one of them, and no farther than to the lowest layer above it
    [(path, text)] = made.missions.items()
    assert path.endswith("-30m.plan")
    heights_m = [item.altitude_m for item in read_plan_text(text, source=path).items]
    assert heights_m == [30.0, 30.0, 0.0]
    file = write_plan(made, tmp_path / "out")
    again = check_fleet(read_fleet(file))
    assert again.verdict == made.result.verdict == "go"
    told = [one.finding.message for one in again.findings if one.finding.code == "S119"]
    lifted = Path(path).name.removesuffix("-30m.plan")
    assert told == [f"{lifted} is flown 10 m above the heights of job {lifted}"]


def test_what_is_found_of_two_flights_holds_for_both_lifted_as_far_or_farther() -> None:
    lifts = {(task, 0): {0.0: 0, 10.0: 1} for task in (0, 1)}
    lifts |= {(task, 1): {10.0: 1} for task in (0, 1)}
    made = Candidate(parts=(), flights=(), tasks=(), conflicts={}, lifts=lifts)
    made.close(((0, 0), (1, 0)), [(-1.0, 1.0), (0.5, 2.0)])
    low, high = ((0, 0), (1, 0)), ((0, 1), (1, 1))
    assert made.conflicts == {low: ((-1.0, 2.0),), high: ((-1.0, 2.0),)}
    made.close(high, [(2.0, 4.0)])  # intervals are open: a start 2 s later is none of both
    made.close(((0, 0), (1, 1)), [(-5.0, 5.0)])
    assert made.conflicts[low] == ((-1.0, 2.0),)
    assert made.conflicts[high] == ((-1.0, 2.0), (2.0, 4.0))
    assert made.conflicts[(0, 0), (1, 1)] == ((-5.0, 5.0),)


@pytest.mark.parametrize(("lasts_s", "by_one"), [(2.0, True), (1.9, False)])
def test_what_is_found_of_two_flights_holds_by_alike_vehicles(
    lasts_s: float, *, by_one: bool
) -> None:
    """By one vehicle they follow each other: an interval within their times asks no more of it."""
    tasks = tuple(
        Task(
            name=name,
            options=tuple(
                Option(vehicle=one, duration_s=lasts_s, energy_wh=1.0) for one in ("a", "b")
            ),
        )
        for name in ("one", "two")
    )
    alike = {(task, option): (0, 1) for task in (0, 1) for option in (0, 1)}
    made = Candidate(parts=(), flights=(), tasks=tasks, conflicts={}, alike=alike)
    made.close(((0, 0), (1, 1)), [(-1.0, 2.0)])
    others = {((0, 0), (1, 1)), ((0, 1), (1, 0))}
    same = {((0, 0), (1, 0)), ((0, 1), (1, 1))}
    assert made.conflicts == dict.fromkeys(others | same if by_one else others, ((-1.0, 2.0),))


def test_what_one_vehicle_must_not_have_stays_beside_what_is_found_of_alike_ones() -> None:
    """That it is carried back takes 60 s: whatever is found of two vehicles, it is not there before."""
    option = Option(vehicle="a", duration_s=10.0, energy_wh=1.0)
    options = (option, replace(option, vehicle="b"))
    alike = {(task, number): (0, 1) for task in (0, 1) for number in (0, 1)}
    made = Candidate(
        parts=(),
        flights=(),
        tasks=(Task(name="one", options=options), Task(name="two", options=options)),
        conflicts={((0, 0), (1, 0)): ((-70.0, 70.0),)},
        alike=alike,
    )
    made.close(((0, 0), (1, 1)), [(-1.0, 2.0)])
    assert made.conflicts[(0, 0), (1, 0)] == ((-70.0, 70.0),)
    assert made.conflicts[(0, 1), (1, 0)] == ((-1.0, 2.0),)


def test_alike_vehicles_share_their_checks(tmp_path: Path) -> None:
    write_mission(OUT, tmp_path / "out.plan")
    text = 'schema = 1\n[job.out]\nmission = "out.plan"\n' + SEPARATION
    for name, more in (("a", ""), ("b", ""), ("laden", "payload_kg = 0.1\n")):
        text += f'[vehicle.{name}]\nmodel = "arducopter-sitl-quad"\n{more}'
    (tmp_path / "fleet.toml").write_text(text, encoding="utf-8")
    fleet = read_fleet(tmp_path / "fleet.toml")
    checks = SortieChecks(fleet)
    one, alike, laden = (
        checks.flown(Sortie(name=name, job="out", vehicle=name, start_s=0.0), None).result
        for name in fleet.vehicles
    )
    assert one is alike
    assert laden is not one


def test_vehicles_that_nothing_tells_apart_are_looked_at_as_many_as_fly(tmp_path: Path) -> None:
    write_mission(OUT, tmp_path / "out.plan")
    text = 'schema = 1\n[job.out]\nmission = "out.plan"\n' + SEPARATION
    for name, more in (("a", ""), ("b", ""), ("c", ""), ("later", "available_from_s = 60\n")):
        text += f'[vehicle.{name}]\nmodel = "arducopter-sitl-quad"\n{more}'
    (tmp_path / "fleet.toml").write_text(text, encoding="utf-8")
    ways = Ways(read_fleet(tmp_path / "fleet.toml"), tmp_path)
    every = ways.candidate((None,))
    flown_by = [
        [one.vehicle for one in ways.by_few(every, count).tasks[0].options] for count in (1, 2, 3)
    ]
    assert flown_by == [["a", "later"], ["a", "b", "later"], ["a", "b", "c", "later"]]


def test_of_a_search_that_is_cut_short_the_wait_on_the_ground_is_flown(tmp_path: Path) -> None:
    """Layers are looked for only while there is time: what keeps apart on the ground is known already."""
    made = planned(tmp_path, FACING + LAYERS, jobs=ALONG, patience=Patience(0.0))
    assert made.result.verdict == "go"
    assert not made.missions
    assert made.cut_short


def test_a_wait_on_the_ground_comes_before_a_layer_where_it_takes_no_longer(tmp_path: Path) -> None:
    made = planned(tmp_path, FACING + LAYERS, jobs=ALONG, minimize="energy")
    assert not made.missions


def test_what_cannot_be_lifted_is_named(tmp_path: Path) -> None:
    above_sea = mission(up(20), replace(place(200, 60, 420), frame=0), rtl())
    made = planned(tmp_path, FACING + LAYERS, jobs={**ALONG, "first": above_sea})
    told = [one.finding.message for one in made.result.findings if one.finding.code == "S120"]
    assert told == ["job first stays at its heights: item 2 is in GLOBAL, not above home"]
    assert [Path(path).name for path in made.missions] == ["second-30m.plan"]


def test_two_from_one_pad_take_it_one_after_the_other(tmp_path: Path) -> None:
    made = planned(tmp_path, SWAP, FACING.replace('pad = "b"', 'pad = "a"'))
    first, second = made.result.sorties
    # Returns of the first lead to the pad at any time: the second is put on it when the first has been
    # cleared away, a minute after its landing, and starts a minute later.
    assert second.start_s == pytest.approx(first.end_s + 120.0, abs=2e-3)
    assert made.result.verdict == "go"
    assert made.schedule.is_best
    # the row of two vehicles is judged with the returns too, as the plan is
    [row] = made.rows
    assert row.makespan_s == pytest.approx(made.result.totals.makespan_s, abs=2e-3)
    assert (row.is_clear, made.marks(row)) == (True, ("fewest in time", "least energy"))
    unclear = replace(made, rows=(replace(row, is_clear=False),))
    assert unclear.marks(unclear.rows[0]) == ("returns not clear",)


def test_a_search_that_is_cut_short_still_ends_with_a_whole_plan(tmp_path: Path) -> None:
    patience = Patience()
    patience.stop()
    made = planned(tmp_path, TWO, patience=patience)
    assert (made.result.verdict, made.cut_short) == ("go", "it was interrupted")
    assert len(made.rows) == 1
    told = plan_text(made, medium=Medium(width=200))
    assert "The search was cut short (it was interrupted)" in told
    assert "The table ends with 1 vehicle: more were not looked at." in told
    assert planned(tmp_path, TWO, patience=Patience(0.0)).cut_short == "its 0 s were over"


def test_the_first_interrupt_stops_the_search_and_the_second_the_program() -> None:
    patience = Patience()
    with interrupting(patience.stop, "the plan is made whole"):
        signal.raise_signal(signal.SIGINT)
        assert patience.cut_short == "it was interrupted"
        with pytest.raises(KeyboardInterrupt):
            signal.raise_signal(signal.SIGINT)


@pytest.mark.parametrize("seed", [1, 2])
def test_a_judge_of_its_own_finds_nothing_wrong_with_plans_of_drawn_fleets(seed: int) -> None:
    result = planned_fleet(seed, Objective.MAKESPAN)
    assert not isinstance(result, str), result
    assert faults(result) == []


@pytest.mark.parametrize(
    ("more", "said"),
    [
        ("[operation]\nlatest_s = 30\n", "(first|second) cannot be flown in its hours"),
        ('[job.first]\nmission = "first.plan"\nneeds = ["camera"]\n', "no vehicle with camera"),
    ],
)
def test_what_cannot_be_planned_is_named(tmp_path: Path, more: str, said: str) -> None:
    with pytest.raises(FleetPlanError, match=said):
        planned(tmp_path, TWO + more)


def test_an_objective_that_is_none_is_a_sentence(tmp_path: Path) -> None:
    with pytest.raises(UsageError, match="energy, makespan, vehicles, batteries"):
        planned(tmp_path, TWO, minimize="speed")
