"""A sweep: each case is what a check finds, and the table is the same however it was worked out."""

from __future__ import annotations

import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from multiprocessing import active_children
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec
import pytest
from made_missions import item, north, rtl, speed, takeoff, waypoint
from made_missions import mission as made_mission

import planner
from planner.autopilot import Autopilot
from planner.cli.main import main
from planner.errors import ExitCode, OutputError, UsageError
from planner.fleet.reader import read_fleet
from planner.physics.wind import Wind
from planner.report.sweep import sweep_text
from planner.report.sweep_table import write_sweep
from planner.report.text import Medium
from planner.service.preflight import Steps
from planner.service.sweep.batches import Batch, Jobs
from planner.service.sweep.engines import (
    ClusterEngine,
    CoresEngine,
    EngineError,
    refuse_other_programs,
)
from planner.service.sweep.memory import RememberingSteps
from planner.service.sweep.outcome import check_case, check_cases
from planner.service.sweep.plan import program_mark
from planner.service.sweep.sweep import make_plan, sweep
from planner.setup import Setup
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.mission.items import Mission
    from planner.service.sweep.engines import Engine
    from planner.service.sweep.outcome import CaseOutcome
    from planner.service.sweep.plan import SweepPlan
    from planner.service.sweep.sweep import SweepProgress

MISSION = Path(__file__).resolve().parents[2] / "missions" / "crossing-too-far.plan"
VARY = ("wind=0,5,11", "wind-from=0,90,180,270", "temperature=0,30", "health=1,0.3")
"""(1 + 2 x 4) x 2 x 2 = 36 cases."""


@pytest.fixture(scope="module")
def mission() -> Mission:
    return made_mission(takeoff(60.0), waypoint(400.0, 60.0), waypoint(100.0, 60.0), rtl())


@pytest.fixture(scope="module")
def setup() -> Setup:
    return Setup.of(
        {"vehicle": "falkowski-2023-quadrotor", "battery": planner.Battery(capacity_wh=20.0)}
    )


@pytest.mark.parametrize("model", ["dji-matrice-100", "arducopter-sitl-quad"])
def test_each_case_is_what_a_check_finds(mission: Mission, model: str) -> None:
    vehicle = planner.load_vehicle(model)
    result = sweep(
        mission,
        Setup(vehicle=vehicle),
        vary={"wind": [0, 9], "wind-from": "0,180", "charge": [0.9, 0.25]},
    )
    columns = result.columns()
    assert len(columns["verdict"]) == 6
    assert set(columns["verdict"]) == {"go", "no-go"}, "the cases differ"
    # of reference steps that nobody is named for as PX4 and ArduPilot fly it, too
    readings = 3 if vehicle.reference is Autopilot.STEP else 1
    assert result.tally.flights == 3 * readings, "the charge changes no flight"
    for row in range(6):
        case = {name: values[row] for name, values in columns.items()}
        found = planner.check(
            mission,
            vehicle,
            wind=Wind(speed_m_s=case["wind_m_s"], from_deg=case["wind_from_deg"] or 0.0),
            charge=case["charge"],
        )
        assert case["verdict"] == found.verdict
        assert case["codes"] == ",".join(dict.fromkeys(one.code for one in found.findings))
        assert found.battery is not None
        assert found.return_plan is not None
        expected = {
            "time_s": found.totals.time_s,
            "energy_wh": found.totals.energy_wh,
            "energy_wh_p10": found.totals.energy_wh_p10,
            "energy_wh_p90": found.totals.energy_wh_p90,
            "margin_wh": found.battery.margin_wh,
            "return_margin_wh": found.return_plan.margin_wh,
            "below_reserve_probability": found.battery.below_reserve_probability,
            "lowest_voltage_v": found.battery.lowest_voltage_v,
        }
        assert {key: case[key] for key in expected} == pytest.approx(expected, rel=1e-9)


@pytest.mark.parametrize(
    ("speed_m_s", "vary", "verdict"),
    [
        (None, "charge=100%", "no-go"),
        (10.0, "charge=100%", "no-go"),  # what is given for all cases is not flown
        (None, "speed=10", "go"),  # what if it were
    ],
)
def test_a_speed_that_does_not_vary_is_no_what_if(
    speed_m_s: float | None, vary: str, verdict: str
) -> None:
    """2 km out at the 1 m/s of the file take 130 W for over half an hour: more than 62 Wh."""
    slow = made_mission(takeoff(20.0), speed(1.0), waypoint(2000.0, 20.0), rtl())
    setup = Setup.of(
        {
            "vehicle": "falkowski-2023-quadrotor",
            "battery": planner.Battery(capacity_wh=77.0),
            "speed_m_s": speed_m_s,
        }
    )
    assert list(sweep(slow, setup, vary=[vary]).columns()["verdict"]) == [verdict]
    if vary == "charge=100%":
        assert (
            planner.check(slow, setup.vehicle, battery=setup.battery, speed_m_s=speed_m_s).verdict
            == verdict
        )


@pytest.mark.parametrize("model", ["falkowski-2023-quadrotor", "arducopter-sitl-quad"])
def test_what_cases_share_changes_no_bit(mission: Mission, model: str) -> None:
    setup = Setup.of({"vehicle": model, "battery": planner.Battery(capacity_wh=20.0)})
    vary = ["wind=3,9", "wind-from=0,180", "temperature=0,30", "charge=100%,40%"]
    plan, steps = make_plan(mission, setup, vary=vary), RememberingSteps()
    there_and_back = [*range(len(plan.cases)), *reversed(range(len(plan.cases)))]
    found = {number: check_case(plan, number, steps) for number in there_and_back}
    assert found == {number: check_case(plan, number, Steps()) for number in found}
    assert len({one.margin_wh for one in found.values()}) > 1, "the cases differ"


@pytest.mark.parametrize("model", ["falkowski-2023-quadrotor", "dji-matrice-100", "px4-quad-2kg"])
@pytest.mark.parametrize(
    "vary",
    [
        "battery=20Wh,5.2Ah@14.8V,2Ah@14.8V,1Ah@14.8V",
        "battery-temperature=-5,25",
        "battery-resistance=1,3",
        "health=1,0.5",
        "charge=100%,60%,30%",
        "reserve=20%,60%",
        "risk=1%,30%",
        "temperature=-5,35",
        "payload=0,0.3",
        "position-error=1,10",
        "pressure=900,1013",
    ],
)
def test_what_varies_alone_is_never_taken_for_what_was_before(
    mission: Mission, model: str, vary: str
) -> None:
    """Models that count no mass of a battery fly the same on each: 1 Ah passed for 5.2 Ah, a go."""
    setup = Setup.of({"vehicle": model, "battery": planner.Battery(capacity_wh=40.0)})
    plan, steps = make_plan(mission, setup, vary=[vary]), RememberingSteps()
    plain = [check_case(plan, number, Steps()) for number in range(len(plan.cases))]
    assert [check_case(plan, number, steps) for number in range(len(plain))] == plain
    assert [check_case(plan, number, steps) for number in reversed(range(len(plain)))] == plain[
        ::-1
    ]


@pytest.mark.parametrize(
    ("model", "parameters"),
    [
        ("arducopter-sitl-quad", "BATT_LOW_MAH,{low}\nBATT_FS_LOW_ACT,3\nBATT_CAPACITY,8000\n"),
        ("px4-quad-2kg", "RTL_TYPE,3\nCOM_FLT_TIME_MAX,{end}\n"),
    ],
)
def test_returns_begun_anew_are_those_of_a_check(
    model: str, parameters: str, tmp_path: Path
) -> None:
    """They are other returns from the flight: what is remembered of its own is not theirs."""
    last = rtl() if model.startswith("ardu") else item(21, north(300.0), 0.0)
    flown = made_mission(takeoff(30.0), waypoint(300.0, 30.0), last)
    plain = planner.check(flown, planner.load_vehicle(model))
    used_mah = plain.totals.charge_mah or 0.0
    file = tmp_path / "own.param"
    low, end = round(8000.0 - used_mah + 25.0), round(plain.totals.time_s - 12.0)
    file.write_text(parameters.format(low=low, end=end), encoding="utf-8")
    setup = Setup(vehicle=planner.load_vehicle(model), parameters=planner.read_parameters(file))
    plan, steps = make_plan(flown, setup, vary=["reserve=20%,25%,30%"]), RememberingSteps()
    anew = [check_case(plan, number, Steps()) for number in range(len(plan.cases))]
    assert [check_case(plan, number, steps) for number in range(len(anew))] == anew
    assert [check_case(plan, number, steps) for number in reversed(range(len(anew)))] == anew[::-1]
    assert "E103" in anew[0].codes


@pytest.mark.parametrize("model", ["px4-quad-2kg", "arducopter-sitl-quad"])
def test_packs_that_are_counted_together_change_no_bit(mission: Mission, model: str) -> None:
    """From one that does for it to one that is empty before the landing."""
    setup = Setup.of({"vehicle": model, "battery": planner.Battery(capacity_wh=40.0)})
    vary = ["temperature=0,30", "charge=100%:40%:10%", "health=1,0.7", "reserve=20%,2min"]
    plan = make_plan(mission, setup, vary=vary)
    numbers = range(3, len(plan.cases))
    together = list(check_cases(plan, numbers, RememberingSteps()))
    assert together == [check_case(plan, number, Steps()) for number in numbers]
    assert len({one.verdict for one in together}) > 1
    assert len({one.breaks_first for one in together}) > 2


def test_workers_that_are_threads_do_not_look_at_each_other(mission: Mission, setup: Setup) -> None:
    """What each remembers it has looked at is its own."""
    vary = ["wind=3,9", "wind-from=0,180", "temperature=0,30", "charge=100%,40%"]
    plan = make_plan(mission, setup, vary=vary)
    numbers = range(len(plan.cases))
    alone = [check_case(plan, number, Steps()) for number in numbers]
    interval_s = sys.getswitchinterval()
    sys.setswitchinterval(1e-5)

    def work(order: Sequence[int]) -> dict[int, CaseOutcome]:
        steps = RememberingSteps()
        return {number: check_case(plan, number, steps) for number in order}

    try:
        with ThreadPoolExecutor(2) as threads:
            both = list(threads.map(work, (numbers, numbers[::-1])))
    finally:
        sys.setswitchinterval(interval_s)
    for found in both:
        assert [found[number] for number in numbers] == alone


def _swept(
    mission: Mission,
    setup: Setup,
    folder: Path,
    name: str = "a.csv",
    on_progress: Callable[[SweepProgress], None] | None = None,
) -> bytes:
    table, parts = folder / name, folder / f"{name}.parts"
    result = sweep(mission, setup, vary=VARY, folder=parts, on_progress=on_progress)
    write_sweep(result, table)
    result.remove_batches()
    assert not (folder / f"{name}.parts").exists(), "what is in the table is not kept twice"
    return table.read_bytes()


def test_a_sweep_that_is_broken_off_ends_as_if_it_was_not(
    mission: Mission, setup: Setup, tmp_path: Path
) -> None:
    whole = _swept(mission, setup, tmp_path)
    assert whole.count(b"\n") == 37

    def break_off(progress: SweepProgress) -> None:
        if progress.done > 24:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        sweep(mission, setup, vary=VARY, folder=tmp_path / "b.csv.parts", on_progress=break_off)
    kept = sorted((tmp_path / "b.csv.parts").glob("*-*.json"))
    assert len(kept) > 1
    kept[0].write_bytes(kept[0].read_bytes()[:-7])  # as no program of ours leaves it
    seen: list[SweepProgress] = []
    assert _swept(mission, setup, tmp_path, "b.csv", on_progress=seen.append) == whole
    assert seen[0].begun > 0, "what was done is not done again"


def test_a_changed_input_starts_anew_and_says_what(
    mission: Mission, setup: Setup, tmp_path: Path
) -> None:
    folder = tmp_path / "c.parts"
    sweep(mission, setup, vary=["wind=0,5", "wind-from=90"], folder=folder)
    again = sweep(mission, setup, vary=["wind=0,5", "wind-from=90"], folder=folder)
    assert (again.resumed, again.changed) == (2, ())
    other = sweep(mission, setup, vary=["wind=0,6", "wind-from=90"], folder=folder)
    assert (other.resumed, other.changed) == (0, ("what varies",))
    heavier = replace(setup, reserve=0.3)
    assert sweep(mission, heavier, vary=["wind=0,6", "wind-from=90"], folder=folder).changed == (
        "the settings",
    )


def test_a_folder_of_something_else_is_left_alone(
    mission: Mission, setup: Setup, tmp_path: Path
) -> None:
    (tmp_path / "photo.jpg").write_bytes(b"")
    with pytest.raises(OutputError, match=r"holds photo\.jpg, which is no batch of a sweep"):
        sweep(mission, setup, vary=["wind=0,5", "wind-from=90"], folder=tmp_path)


def test_two_sweeps_do_not_work_in_one_folder(
    mission: Mission, setup: Setup, tmp_path: Path
) -> None:
    folder = tmp_path / "d.parts"

    def sweep_too(_: SweepProgress) -> None:
        sweep(mission, setup, vary=["wind=0,5", "wind-from=90"], folder=folder)

    with pytest.raises(OutputError, match=r"d\.parts: another mavjoule is at work in it"):
        sweep(
            mission, setup, vary=["wind=0,5", "wind-from=90"], folder=folder, on_progress=sweep_too
        )
    (folder / ".mavjoule-0123456789ab.part").write_bytes(b"{")  # of one killed as it wrote
    result = sweep(mission, setup, vary=["wind=0,5", "wind-from=90"], folder=folder)
    assert (result.resumed, len(list(result.rows()))) == (2, 2)
    result.remove_batches()
    assert not folder.exists()


def test_batches_take_half_a_second_and_end_where_the_air_changes(
    mission: Mission, setup: Setup
) -> None:
    vary = ["temperature=0:30:1", "wind=1:4:1", "wind-from=90", "charge=100%:60.5%:0.5%"]
    cases = make_plan(mission, setup, vary=vary).cases
    assert (len(cases), cases.strides[-1]) == (31 * 4 * 80, 1)
    jobs = Jobs(cases, {200: 100})
    assert next(jobs) == (0, 24), "while it is not known how long a case takes"
    jobs.took(24, 24 * 0.002)
    assert next(jobs) == (24, 176), "up to what is there"
    assert next(jobs) == (300, 260), "250 are half a second, and at 560 the air changes"
    covered = sum(count for _, count in jobs) + 24 + 176 + 100 + 260
    assert covered == len(cases)
    assert jobs.left == 0


def test_several_workers_make_the_same_batches(mission: Mission, setup: Setup) -> None:
    plan, jobs = make_plan(mission, setup, vary=VARY), [(0, 20), (20, 16)]
    assert _outcomes(CoresEngine(2), plan, jobs) == _outcomes(CoresEngine(1), plan, jobs)


def _outcomes(engine: Engine, plan: SweepPlan, jobs: list[tuple[int, int]]) -> list[object]:
    done = sorted(engine.run(plan, jobs))
    assert [job[:2] for job in done] == jobs
    return [msgspec.json.decode(data, type=Batch).outcomes for _, _, data, _ in done]


def test_a_table_reads_back_in_one_line(mission: Mission, setup: Setup, tmp_path: Path) -> None:
    import pandas as pd
    import polars as pl

    result = sweep(mission, setup, vary=VARY)
    for name in ("e.parquet", "e.csv"):
        write_sweep(result, tmp_path / name)
    frame = pd.read_parquet(tmp_path / "e.parquet")
    assert frame.shape == (36, len(result.table.columns.names))
    assert (frame["verdict"] == "go").sum() == pl.read_csv(tmp_path / "e.csv")["verdict"].eq(
        "go"
    ).sum()
    assert frame["wind_from_deg"].isna().sum() == 4, "a calm comes from nowhere"
    pd.testing.assert_frame_equal(result.to_dataframe(library="pandas"), frame, check_dtype=False)
    assert result.to_dataframe(library="polars").equals(pl.read_parquet(tmp_path / "e.parquet"))
    with pytest.raises(UsageError, match=r"is written to a .parquet or .csv file"):
        write_sweep(result, tmp_path / "e.xlsx")


def test_what_it_comes_to_is_counted_by_value(mission: Mission, setup: Setup) -> None:
    result = sweep(mission, setup, vary=VARY)
    columns = result.columns()
    rows = range(36)
    go = [columns["verdict"][row] == "go" for row in rows]
    assert result.tally.counts.tolist() == [sum(go), 36, 0]
    by_health = {
        label: (found, checked) for label, found, checked in result.tally.shares("battery_health")
    }
    assert by_health == {
        label: (sum(go[r] for r in rows if columns["battery_health"][r] == health), 18)
        for label, health in (("30%", 0.3), ("100%", 1.0))
    }
    # The calm counts for every direction: (1 + 2) x 2 x 2 cases each.
    assert [checked for *_, checked in result.tally.shares("wind_from_deg")] == [12, 12, 12, 12]
    text = sweep_text(result, medium=Medium())
    assert text.startswith(f"GO in {sum(go)} of 36 cases")


def test_a_fleet_is_judged_as_a_whole_in_every_case() -> None:
    path = MISSION.parent / "fleets" / "survey-two-quads.toml"
    columns = sweep(planner.read_fleet(path), vary=["wind=0,9", "wind-from=90"]).columns()
    for row, wind in enumerate([Wind(), Wind(speed_m_s=9.0, from_deg=90.0)]):
        found = planner.check_fleet(read_fleet(path, given={"wind": wind}))
        assert columns["verdict"][row] == found.verdict
        assert columns["codes"][row] == ",".join(
            dict.fromkeys(one.code for one in found.all_findings)
        )
        assert columns["energy_wh"][row] == pytest.approx(found.totals.energy_wh, rel=1e-9)
    assert columns["verdict"] == ["go", "no-go"]
    with pytest.raises(UsageError, match="each vehicle, pack or job of a fleet has its own"):
        sweep(planner.read_fleet(path), vary=["payload=0,1"])


def test_a_cluster_makes_the_same_batches(mission: Mission, setup: Setup) -> None:
    from distributed import LocalCluster

    plan, jobs = make_plan(mission, setup, vary=VARY), [(0, 20), (20, 16)]
    with LocalCluster(n_workers=1, processes=False, dashboard_address=":0") as cluster:
        there = _outcomes(ClusterEngine(cluster.scheduler_address), plan, jobs)
    assert there == _outcomes(CoresEngine(1), plan, jobs)


def test_a_worker_with_another_mavjoule_is_named(
    mission: Mission, setup: Setup, monkeypatch: pytest.MonkeyPatch
) -> None:
    class _Client:
        def run(self, *_: object, **__: object) -> dict[str, object]:
            return {"tcp://a": program_mark(), "tcp://b": "0.0.9+0123"}

    with pytest.raises(EngineError, match=r"worker tcp://b has mavjoule 0\.0\.9\+0123, this is"):
        refuse_other_programs(_Client())
    plan = make_plan(mission, setup, vary=VARY)
    monkeypatch.setattr("planner.service.sweep.engines._WAIT_S", 0.2)
    with pytest.raises(EngineError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        list(ClusterEngine("tcp://127.0.0.1:9").run(plan, [(0, 1)]))


def test_a_sweep_that_is_killed_ends_as_if_it_was_not(tmp_path: Path) -> None:
    """SIGKILL while batches are written; bench/test_sweep_speed.py does it at 50 moments."""
    arguments = ["sweep", str(MISSION), "--battery", "20Wh", "--workers", "1"]
    arguments += [word for axis in VARY for word in ("--vary", axis)]
    code = "import sys; from planner.cli.main import main; sys.exit(main(sys.argv[1:]))"
    killed = subprocess.Popen(
        [sys.executable, "-c", code, *arguments, "-o", str(tmp_path / "a.csv")],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    while killed.poll() is None and not list(tmp_path.glob("a.csv.parts/*-*.json")):
        time.sleep(0.002)
    killed.kill()
    killed.wait()
    for name in ("a.csv", "b.csv"):
        assert main([*arguments, "-o", str(tmp_path / name)]) == ExitCode.GO
    assert (tmp_path / "a.csv").read_bytes() == (tmp_path / "b.csv").read_bytes()


def test_workers_that_are_killed_change_no_row(mission: Mission, setup: Setup) -> None:
    """SIGKILL of one of two processes, twice, while the other works."""
    vary = (*VARY, "charge=100%:50%:10%", "risk=1%:10%:1%")
    whole = sweep(mission, setup, vary=vary, engine=CoresEngine(1))
    kills = iter(range(2))

    def kill(_: SweepProgress) -> None:
        if (workers := active_children()) and next(kills, None) is not None:
            workers[-1].kill()

    killed = sweep(mission, setup, vary=vary, engine=CoresEngine(2), on_progress=kill)
    assert next(kills, None) is None, "both were killed"
    assert list(killed.rows()) == list(whole.rows())
    assert killed.tally.go_share == whole.tally.go_share


def test_a_wind_without_a_direction_is_refused(
    mission: Mission, setup: Setup, tmp_path: Path
) -> None:
    """From which side is not guessed: it decides. A check refuses it too."""
    path = tmp_path / "winds.csv"
    path.write_text("time,wind [m/s]\n2025-01-01T00:00,5\n", encoding="utf-8")
    calm = tmp_path / "calm.csv"
    calm.write_text("time,wind [m/s]\n2025-01-01T00:00,0\n", encoding="utf-8")
    sentence = "nothing says where it blows from"
    for vary in (["wind=0,5"], ["gust=4"]):
        with pytest.raises(UsageError, match=f"--vary .*{sentence}"):
            make_plan(mission, setup, vary=vary)
    with pytest.raises(UsageError, match="--vary wind.*" + sentence):
        make_plan(mission, setup, vary=["wind=weibull(2,5)"], draws=3)
    with pytest.raises(UsageError, match="the weather.*" + sentence):
        make_plan(mission, setup, weather=path)
    windy = replace(setup, wind=Wind(speed_m_s=3.0, from_deg=0.0))
    assert len(make_plan(mission, windy, vary=["wind=0,5"]).cases) == 2
    assert len(make_plan(mission, setup, vary=["wind-from=0,90"], weather=path).cases) == 2
    assert len(make_plan(mission, setup, vary=["wind=0"]).cases) == 1, "a calm has none"
    assert len(make_plan(mission, setup, weather=calm).cases) == 1


@pytest.mark.parametrize("wrong", [None, planner.load_vehicle("falkowski-2023-quadrotor")])
def test_a_sweep_without_a_setup_is_told_what_is_wanted(wrong: object, mission: Mission) -> None:
    with pytest.raises(UsageError, match=r"setup must be planner\.Setup"):
        sweep(mission, wrong, vary=["wind=0,9"])  # type: ignore[arg-type]  # what is refused
