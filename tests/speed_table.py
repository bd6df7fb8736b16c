"""What has to be fast, as ratios to what other programs take for the same: ``make bench``.

Prints the table and keeps it; ``--compare`` marks what became slower than in the last kept run by more
than the noise of both.  Of a ratio it is the median over rounds in which both are measured one after
the other, so that another load on the machine meets both; its noise is half the spread of the middle
half of the rounds.  Times are of the processor, but for starts, counted in instructions (callgrind), and
for work shared by cores, which passes meanwhile.  ``--flights FOLDER`` is that of the recorded flights which
the shipped models are identified from; without it identification is measured on made flights alone.
``--write`` writes the table into ``tests/bench/README.md``.
"""

from __future__ import annotations

import asyncio
import json
import math
import os
import pickle
import re
import shutil
import subprocess
import sys
import time
from datetime import UTC, date, datetime
from functools import partial
from pathlib import Path
from statistics import median, quantiles
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING

import msgspec
import numpy as np
from dataflash_writer import copter_log
from long_missions import plan
from made_fleet import place, up
from made_missions import mission, rtl
from made_record import record_of
from mavsdk_importers import mavsdk_importers
from pymavlink.DFReader import DFReader_binary
from pymavlink.mavwp import MAVWPLoader
from pyulog import ULog
from reviews import review_app, settled
from sampled_flight import SAMPLE_S, Manoeuvre, SampledVehicle
from simulated_experiment import fly_horizontally, fly_vertically
from textual.app import App
from ulog_writer import px4_log

from planner.autopilot import Autopilot
from planner.identify.assembly import IdentificationSettings
from planner.identify.battery import PackSettings
from planner.identify.identification import identify_vehicle
from planner.identify.log_table import LogConditions, LogTable
from planner.logs.files import read_log
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.items import MissionFormat
from planner.report.html.page import check_html
from planner.service.identification import identify_logs
from planner.service.preflight import check
from planner.service.separation import keep_apart
from planner.service.speed import speed_curve
from planner.service.split import split_mission
from planner.service.sweep.memory import RememberingSteps
from planner.service.sweep.outcome import check_cases
from planner.service.sweep.sweep import make_plan
from planner.setup import Setup, Together
from planner.values import Value, replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.mission.items import Mission
    from planner.service.preflight import CheckResult
    from planner.service.sweep.plan import SweepPlan

KEPT = Path(__file__).parents[1] / ".benchmarks" / "speed.json"
PAGE = Path(__file__).parent / "bench" / "README.md"
PAGE_HEAD = """# What mavjoule takes, beside what others take

Written by `make bench COMPARE=--write`: the median over rounds, and how many times of what stands beside it,
measured in turn.  Times are of the processor of the machine it was written on; the ratios hold on others.

"""
MISSIONS = Path(__file__).parents[1] / "missions"
ROUNDS = 7
LEG_M = 120.0
ARTICLE = "falkowski-2023-quadrotor"
MODELS = {ARTICLE: 12, "px4-quad-2kg": 12, "arducopter-sitl-quad": 3}
"""By the autopilot of the mission each flies."""
LOGS = {
    ".BIN": [
        f"ardupilot-{one}/flight.BIN"
        for one in ("S_A_vertical", "S_B_horizontal", "S_C_speedsweep")
    ],
    ".ulg": [f"px4-{one}/flight.ulg" for one in ("A_vertical", "B_horizontal", "C_speed_sweep")],
}
"""What the shipped models of the simulated vehicles are identified from, by what they end in."""
WORSE = 0.05
"""Beyond the noise of both: how much slower is told at least. [-]"""


class Row(Value, kw_only=False):
    """One line of the table."""

    what: str
    ours: str
    """What it takes, with its unit."""
    than: str
    ratio: float
    noise: float
    goal: str


def seconds(work: Callable[[], object]) -> float:
    """Return the processor time of one run."""
    begun = time.process_time()
    work()
    return time.process_time() - begun


def elapsed(work: Callable[[], object]) -> float:
    """Return the time that passes in one run, of which several cores may do parts."""
    begun = time.perf_counter()
    work()
    return time.perf_counter() - begun


def against(
    what: str,
    work: Callable[[], object],
    than: str,
    other: Callable[[], object],
    *,
    goal: str,
    rounds: int = ROUNDS,
    clock: Callable[[Callable[[], object]], float] = seconds,
) -> Row:
    """Return how many times as long one takes as another."""
    work(), other()
    pairs = [(clock(work), clock(other)) for _ in range(rounds)]
    ratios = [ours / max(theirs, 1e-6) for ours, theirs in pairs]
    low, _, high = quantiles(ratios, n=4)
    ours_ms = 1e3 * median(ours for ours, _ in pairs)
    return Row(what, f"{ours_ms:.3g} ms", than, median(ratios), 0.5 * (high - low), goal)


def instructions(*arguments: str) -> int:
    """Return how many instructions Python takes for something, its modules compiled."""
    command = ["valgrind", "--tool=callgrind", "--callgrind-out-file=/dev/null", sys.executable]
    done = subprocess.run(
        [*command, *arguments],
        env={**os.environ, "PYTHONHASHSEED": "0", "PYTHONDONTWRITEBYTECODE": ""},
        capture_output=True,
        text=True,
        check=False,
    )
    found = re.search(r"Collected : (\d+)", done.stderr)
    assert found is not None, done.stderr
    return int(found[1])


def starts() -> Iterator[Row]:
    """Yield what it takes from start to verdict of the shipped missions."""
    if shutil.which("valgrind") is None:
        sys.stderr.write("starts are not measured: valgrind is not installed\n")
        return
    run = ("-c", "from planner.cli.__main__ import main; main()", "check", "--vehicle", ARTICLE)
    names = sorted(one.name for one in MISSIONS.iterdir() if one.suffix in {".plan", ".waypoints"})
    for name in names:  # for the compiled modules
        subprocess.run(
            [sys.executable, *run, str(MISSIONS / name)],
            env={**os.environ, "PYTHONDONTWRITEBYTECODE": ""},
            capture_output=True,
            check=False,
        )
    numpy = instructions("-c", "import numpy")
    for name in names:
        ours = instructions(*run, str(MISSIONS / name))
        what = f"start to verdict, {name}"
        yield Row(
            what, f"{ours / 1e6:.0f} M instructions", "import numpy", ours / numpy, 0.0, "2.0"
        )


def mission_of(count: int, autopilot: int) -> Mission:
    """Return a mission of so many items."""
    return read_mission_bytes(plan(count, autopilot=autopilot).encode(), source="bench.plan")


def crossing(number: int, of: int) -> Mission:
    """Return a way of 100 items to the other side of a circle of 2 km, through its middle."""
    angle = 2.0 * math.pi * number / of
    north_m, east_m = 2000.0 * math.cos(angle), 2000.0 * math.sin(angle)
    along = [1.0 - 2.0 * n / 97 for n in range(98)]
    way = (place(north_m * x + 3.0 * (n % 2), east_m * x, 20.0) for n, x in enumerate(along))
    return mission(up(20), *way, rtl())


def fly(vehicle: SampledVehicle, moves: list[Manoeuvre]) -> None:
    """Fly each of some manoeuvres, sampled."""
    for one in moves:
        vehicle.fly(one)


def step_through(result: CheckResult) -> float:
    """Return the energy of a flight stepped at 50 Hz, as a naive planner does it. [J]

    The speed of each segment follows its reference with a lag; power is hover power and drag.
    """
    speed, energy_j = np.zeros(3), 0.0
    for one in result.segments:
        wanted = np.array((one.speed_m_s or 0.0, 0.0, one.climb_m / max(one.duration_s, SAMPLE_S)))
        for _ in range(round(one.duration_s / SAMPLE_S)):
            speed += SAMPLE_S * (wanted - speed)
            energy_j += SAMPLE_S * (120.0 + 0.05 * float(speed @ speed))
    return energy_j


def checks() -> Iterator[Row]:
    """Yield what checks take, and what is made of them."""
    article = load_vehicle(ARTICLE)
    for name, autopilot in MODELS.items():
        vehicle, small = load_vehicle(name), mission_of(10, autopilot)
        yield against(
            f"check, 10 items, {name}",
            partial(check, small, vehicle),
            "a loop in numpy at 50 Hz",
            partial(step_through, check(small, vehicle)),
            goal="4 ms",
        )
    for count, every, goal in ((10, 1, "1 / 100"), (100, 1, "1 / 500"), (1_000, 10, "1 / 150")):
        mission, sampled = mission_of(count, 12), SampledVehicle()
        moves = [
            Manoeuvre(
                "level" if s.climb_m == 0.0 else "climb" if s.climb_m > 0.0 else "descent",
                LEG_M if s.climb_m == 0.0 else s.climb_m,
                50.0,
            )
            for s in check(mission, article).segments
            if s.climb_m != 0.0 or s.state == "accelerate"
        ]
        yield against(
            f"check, {count} items, all of it",
            partial(check, mission, article),
            f"control.forced_response at 50 Hz{', of a tenth of it' if every > 1 else ''}",
            partial(fly, sampled, moves[::every]),
            goal=goal,
            rounds=2,
        )
    for name, autopilot in MODELS.items():
        vehicle, mission = load_vehicle(name), mission_of(1_000, autopilot)
        text = plan(1_000, autopilot=autopilot)
        yield against(
            f"check, 1,000 items, {name}",
            partial(check, mission, vehicle),
            "json.loads of the plan",
            partial(json.loads, text),
            goal="10 ms (ArduPilot: 15)",
        )
    vehicle = replace(load_vehicle("arducopter-sitl-quad"), battery=None)
    mission = mission_of(1_000, 3)
    result = check(mission, vehicle)
    battery = Battery(capacity_wh=0.3 * result.totals.energy_wh / 0.8)

    def once() -> object:
        return check(mission, vehicle, battery=battery)

    yield against(
        "page, 1,000 items",
        lambda: check_html([result], version="1", made_at=datetime.now(UTC)),
        "its check",
        once,
        goal="800 ms",
        rounds=5,
    )
    yield against(
        "split, 1,000 items",
        lambda: split_mission(mission, vehicle, battery=battery),
        "its check",
        once,
        goal="1000 ms",
        rounds=3,
    )
    yield against(
        "speed, 1,000 items",
        lambda: speed_curve(mission, Setup(vehicle=vehicle, battery=battery)),
        "its check",
        once,
        goal="500 ms",
        rounds=3,
    )
    text = plan(1_000, autopilot=3)
    shipped = against(
        "result to ship, 1,000 items",
        lambda: pickle.dumps(result),
        "json.loads of the plan",
        lambda: json.loads(text),
        goal="20 kB",
    )
    yield replace(shipped, ours=f"{shipped.ours}, {len(pickle.dumps(result)) / 1e3:.1f} kB")


def readers(folder: Path) -> Iterator[Row]:
    """Yield what reading missions and logs takes."""
    text = plan(1_000)
    data = text.encode()
    yield against(
        "read .plan, 1,000 items",
        lambda: read_mission_bytes(data, source="bench.plan"),
        "json.loads",
        lambda: json.loads(text),
        goal="2.5",
        rounds=31,
    )
    rows = convert_mission(mission_of(1_000, 12), MissionFormat.WPL).text
    wpl = folder / "bench.waypoints"
    wpl.write_text(rows, encoding="utf-8")
    yield against(
        "read WPL, 1,000 items",
        lambda: read_mission_bytes(rows.encode(), source="bench.waypoints"),
        "pymavlink",
        lambda: MAVWPLoader().load(str(wpl)),
        goal="",
        rounds=15,
    )
    with mavsdk_importers() as importers:
        importer = importers[Autopilot.PX4]
        yield against(
            "read .plan, 1,000 items",
            lambda: read_mission_bytes(data, source="bench.plan"),
            "MAVSDK",
            lambda: importer.import_qgroundcontrol_mission_from_string(text),
            goal="",
            rounds=15,
        )
        yield against(
            "read WPL, 1,000 items",
            lambda: read_mission_bytes(rows.encode(), source="bench.waypoints"),
            "MAVSDK",
            lambda: importer.import_mission_planner_mission_from_string(rows),
            goal="5 ms",
            rounds=15,
        )
    flight, topics = folder / "bench.bin", folder / "bench.ulg"
    flight.write_bytes(copter_log().content())
    topics.write_bytes(px4_log().content())

    yield against(
        f"read DataFlash, {flight.stat().st_size / 1e6:.1f} MB",
        lambda: read_log(flight),
        "pymavlink",
        partial(read_by_pymavlink, [flight]),
        goal="35 ms/MB",
        rounds=3,
    )
    yield against(
        f"read ULog, {topics.stat().st_size / 1e6:.1f} MB",
        lambda: read_log(topics),
        "pyulog",
        partial(read_by_pyulog, [topics]),
        goal="",
        rounds=3,
    )


def fleets() -> Iterator[Row]:
    """Yield what keeping flights apart takes, and what a case of a sweep does."""
    vehicle = load_vehicle("arducopter-sitl-quad")
    missions = [crossing(number, 20) for number in range(20)]
    results = [check(one, vehicle) for one in missions]
    yield against(
        "20 flights of 100 items at once, all crossing",
        lambda: keep_apart(results, Together(separation_m=10.0)),
        "their checks",
        lambda: [check(one, vehicle) for one in missions],
        goal="200 ms",
        rounds=3,
    )
    for name, autopilot in MODELS.items():
        setup = Setup(vehicle=load_vehicle(name), battery=Battery(capacity_wh=200.0))
        mission = mission_of(100, autopilot)
        axes = ("wind=0:12:6", "wind-from=0:315:45", "charge=100%:60%:10%", "health=1.0,0.9,0.8")
        cases = make_plan(mission, setup, vary=list(axes))
        count = len(cases.cases)

        def every(cases: SweepPlan = cases, count: int = count) -> None:
            for _ in check_cases(cases, range(count), RememberingSteps()):
                pass

        row = against(
            f"sweep of {count} cases, 100 items, {name}",
            every,
            "its check",
            partial(check, mission, setup.vehicle, battery=setup.battery),
            goal="1 ms a case",
            rounds=2,
        )
        yield replace(row, ours=f"{row.ours}, {float(row.ours.split()[0]) / count:.2g} ms a case")


def recorded_flights(folder: Path) -> Iterator[Row]:
    """Yield what identifying a vehicle from whole logs takes."""
    for kind, mass_kg, than, read in (
        (".BIN", 3.5, "reading them by pymavlink", read_by_pymavlink),
        (".ulg", 1.0, "reading them by pyulog", read_by_pyulog),
    ):
        settings = IdentificationSettings(
            name="bench",
            date=date(2026, 1, 1),
            version="1",
            logs=LogTable(of_all=LogConditions(mass_kg=mass_kg)),
            pack=PackSettings(cells_in_series=6, chemistry="lipo-ardupilot-sitl"),
        )
        logs = [folder / name for name in LOGS[kind]]
        size = sum(log.stat().st_size for log in logs) / 1e6
        yield against(
            f"identify, {size:.0f} MB of {kind[1:]}",
            partial(identify_logs, logs, settings),
            than,
            partial(read, logs),
            goal="3 s",
            rounds=2,
        )


def read_by_pymavlink(logs: list[Path]) -> None:
    """Read every message of some logs."""
    for path in logs:
        log = DFReader_binary(str(path))
        while log.recv_msg() is not None:
            pass


def read_by_pyulog(logs: list[Path]) -> None:
    """Read some logs."""
    for path in logs:
        ULog(str(path))


def identification() -> Iterator[Row]:
    """Yield what identifying a vehicle takes."""

    def flights() -> list[object]:
        draw = np.random.default_rng(1)
        return [fly_vertically(draw), fly_horizontally(draw)]

    settings = IdentificationSettings(name="bench", date=date(2026, 1, 1), version="1")
    draw = np.random.default_rng(1)
    records = [
        record_of(fly_vertically(draw), is_vertical=True),
        record_of(fly_horizontally(draw), is_vertical=False),
    ]
    yield against(
        "identify, two flights at 10 Hz",
        lambda: identify_vehicle(records, settings),
        "flying them in control",
        flights,
        goal="",
        rounds=3,
    )


def many_files(folder: Path) -> Iterator[Row]:
    """Yield what the check of many files in one call takes on the cores here."""
    for number in range(315):
        mission = plan(10 + number % 90, autopilot=3)
        (folder / f"{number:03d}.plan").write_text(mission, encoding="utf-8")
    run = "import os, sys; {} from planner.cli.__main__ import main; main()"
    words = ("check", str(folder), "--vehicle", "arducopter-sitl-quad", "--format", "json-lines")

    def call(first: str = "") -> None:
        command = [sys.executable, "-c", run.format(first), *words]
        subprocess.run(command, capture_output=True, check=False)

    yield against(
        "check of 315 files, 10 to 99 items",
        call,
        "on one core",
        partial(call, "os.sched_setaffinity(0, {min(os.sched_getaffinity(0))});"),
        goal="4 s, 0.5 on two cores",
        rounds=3,
        clock=elapsed,
    )


def keys() -> Iterator[Row]:
    """Yield what a key press takes in the review, all panes following."""

    async def presses(app: App[None], times: list[float]) -> None:
        async with app.run_test(size=(160, 48)) as pilot:
            if not isinstance(app, Bare):
                await settled(pilot)
                await pilot.press("4")
            for _ in range(40):
                begun = time.process_time()
                await pilot.press("down")
                times.append(time.process_time() - begun)

    ours, theirs = list[float](), list[float]()
    for _ in range(3):
        asyncio.run(presses(review_app(str(MISSIONS / "survey-vineyard.plan")), ours))
        asyncio.run(presses(Bare(), theirs))
    ratios = [one / median(theirs) for one in ours]
    low, middle, high = quantiles(ratios, n=4)
    taken = f"{1e3 * median(ours):.3g} ms"
    yield Row("key press", taken, "in an empty Textual app", middle, 0.5 * (high - low), "16 ms")


class Bare(App[None]):
    """Textual alone."""


def table(rows: list[Row], before: dict[tuple[str, str], Row]) -> list[str]:
    """Return the table, with what became slower than before."""
    lines = ["| | takes | times | of | goal | |", "|---|---|---|---|---|---|"]
    for row in rows:
        old, told = before.get((row.what, row.than)), ""
        if old is not None and row.ratio > old.ratio * (1.0 + WORSE) + row.noise + old.noise:
            told = f"slower: was {old.ratio:.3g}"
        times = f"{row.ratio:.3g} ± {row.noise:.1g}" if row.noise else f"{row.ratio:.3g}"
        lines.append(f"| {row.what} | {row.ours} | {times} | {row.than} | {row.goal} | {told} |")
    return lines


def main(*arguments: str) -> int:
    """Measure, print and keep; with ``--compare`` end in 1 where something became slower."""
    before: dict[tuple[str, str], Row] = {}
    if "--compare" in arguments:
        if not KEPT.exists():
            sys.stderr.write(f"{KEPT} is not there: run make bench first, then with --compare\n")
            return 2
        kept = msgspec.json.decode(KEPT.read_bytes(), type=list[Row])
        before = {(row.what, row.than): row for row in kept}
    with TemporaryDirectory() as folder:
        rows = [*starts(), *readers(Path(folder)), *checks(), *fleets(), *identification(), *keys()]
    with TemporaryDirectory() as folder:
        rows += many_files(Path(folder))
    if "--flights" in arguments:
        rows += recorded_flights(Path(arguments[arguments.index("--flights") + 1]))
    else:
        sys.stderr.write("whole logs are not measured: make bench FLIGHTS=folder\n")
    lines = table(rows, before)
    sys.stdout.write("\n".join(lines) + "\n")
    if "--write" in arguments:
        PAGE.write_text("\n".join((PAGE_HEAD.rstrip(), "", *lines, "")), encoding="utf-8")
    KEPT.parent.mkdir(exist_ok=True)
    KEPT.write_bytes(msgspec.json.format(msgspec.json.encode(rows)))
    return int(any("| slower" in line for line in lines))


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]))
