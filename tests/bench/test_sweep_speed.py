"""What a sweep costs: a case, a worker, a task, memory; and that it survives being killed anywhere.

Measured in processor time, as ratios; `make bench` prints them.
"""

from __future__ import annotations

import os
import random
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import planner
from planner.service.preflight import Steps
from planner.service.sweep.engines import ClusterEngine, CoresEngine
from planner.service.sweep.memory import RememberingSteps
from planner.service.sweep.outcome import check_case, check_cases
from planner.service.sweep.sweep import make_plan, sweep
from planner.setup import Setup

ROOT = Path(__file__).resolve().parents[2]
MISSION = ROOT / "missions" / "crossing-too-far.plan"
RUN = (sys.executable, "-c", "import sys; from planner.cli.main import main; sys.exit(main())")
KILLS = 50
AIR = ("wind=0:12:3", "wind-from=0:315:45", "temperature=-5,15,30")
PACK = ("charge=100%:60%:2%", "health=1.0,0.95,0.9,0.85,0.8")


def survey(legs: int) -> planner.Mission:
    """Return a survey of so many legs of 60 m."""
    from made_missions import item, mission, north, rtl, takeoff

    items = [
        item(16, north(8.0 * (leg // 2)), 50.0, longitude_deg=8.0 + 0.0008 * ((leg + 1) // 2 % 2))
        for leg in range(legs)
    ]
    return mission(takeoff(50.0), *items, rtl())


@pytest.mark.bench
@pytest.mark.parametrize(
    "vehicle", ["falkowski-2023-quadrotor", "px4-quad-2kg", "arducopter-sitl-quad"]
)
def test_a_case_of_100_items_beside_a_check(vehicle: str) -> None:
    setup = Setup.of({"vehicle": vehicle, "battery": planner.Battery(capacity_wh=200.0)})
    plan = make_plan(survey(98), setup, vary=[*AIR, *PACK])
    numbers, steps = range(2100), RememberingSteps()
    begun_s = time.process_time()
    remembered = [*check_cases(plan, numbers, steps)]
    case_s = (time.process_time() - begun_s) / len(numbers)
    some = numbers[:: len(numbers) // 20]
    begun_s = time.process_time()
    plain = [check_case(plan, number, Steps()) for number in some]
    check_s = (time.process_time() - begun_s) / len(some)
    assert plain == [remembered[number] for number in some]
    print(
        f"\n{vehicle}: {1e3 * case_s:.2f} ms a case, a check {check_s / case_s:.0f} times that, "
        f"{steps.flights} flights for {len(numbers)} cases"
    )


@pytest.mark.bench
def test_workers_of_a_cluster_by_their_processor_time() -> None:
    from distributed import LocalCluster

    setup = Setup.of(
        {"vehicle": "falkowski-2023-quadrotor", "battery": planner.Battery(capacity_wh=77.0)}
    )
    vary = [*AIR, *PACK]
    mission = survey(98)
    begun_s = time.process_time()
    alone = sweep(mission, setup, vary=vary, engine=CoresEngine(1))
    own_s = time.process_time() - begun_s
    for workers in (2, 4):
        begun_s = time.process_time()
        with LocalCluster(
            n_workers=workers, threads_per_worker=1, dashboard_address=":0"
        ) as cluster:
            started_s = _processor_s(cluster)
            there = sweep(
                mission, setup, vary=vary, engine=ClusterEngine(cluster.scheduler_address)
            )
            worked_s = _processor_s(cluster) - started_s
        client_s = time.process_time() - begun_s
        assert list(there.rows()) == list(alone.rows())
        print(
            f"\n{workers} workers: {own_s:.1f} s alone, {worked_s:.1f} s of theirs: "
            f"{own_s / worked_s:.0%} of linear; client and scheduler {client_s:.1f} s"
        )


def _processor_s(cluster: object) -> float:
    from distributed import Client

    with Client(cluster) as client:
        return float(sum(client.run(time.process_time).values()))


@pytest.mark.bench
def test_a_sweep_killed_at_any_moment_is_the_same_byte_for_byte(tmp_path: Path) -> None:
    arguments = [*RUN, "sweep", str(MISSION), "--vehicle", "falkowski-2023-quadrotor"]
    arguments += ["--battery", "77Wh", "--workers", "2"]
    arguments += [word for axis in (*AIR, "charge=100%:60%:10%") for word in ("--vary", axis)]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}

    def run(name: str, *, kill_s: float | None = None) -> bool:
        """Run it; return whether it was killed before its end."""
        process = subprocess.Popen(
            [*arguments, "-o", str(tmp_path / name)],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
        )
        try:
            process.wait(kill_s)
        except subprocess.TimeoutExpired:
            process.send_signal(signal.SIGKILL)
            process.wait()
            return True
        return False

    begun_s = time.monotonic()
    run("whole.csv")
    whole_s = time.monotonic() - begun_s
    draw = random.Random(1)
    killed = 0
    for _ in range(KILLS):
        killed += run("killed.csv", kill_s=draw.uniform(0.1, 1.0) * whole_s)
        if (tmp_path / "killed.csv").exists():
            assert (tmp_path / "killed.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
            (tmp_path / "killed.csv").unlink()
    run("killed.csv")
    assert (tmp_path / "killed.csv").read_bytes() == (tmp_path / "whole.csv").read_bytes()
    print(f"\n{killed} of {KILLS} runs were killed: the table is the same")


@pytest.mark.bench
def test_a_cluster_whose_parts_are_killed_makes_the_same_table(tmp_path: Path) -> None:
    """SIGKILL of a worker, which another replaces, and of the scheduler, after which it is run again."""
    environment = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'tests'}"}
    arguments = [*RUN, "sweep", str(MISSION), "--vehicle", "px4-quad-2kg"]
    arguments += [word for axis in (*AIR, "charge=100%:80%:10%") for word in ("--vary", axis)]

    def start(*words: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *words],
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            env=environment,
        )

    def sweep_there(name: str) -> subprocess.Popen[bytes]:
        words = [*arguments, "-o", str(tmp_path / name), "--scheduler", "tcp://127.0.0.1:18786"]
        return subprocess.Popen(
            words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, env=environment
        )

    def cluster() -> list[subprocess.Popen[bytes]]:
        scheduler = start("scheduler", "--port", "18786", "--no-dashboard", "--host", "127.0.0.1")
        time.sleep(4.0)
        return [scheduler, *(worker() for _ in range(2))]

    def worker() -> subprocess.Popen[bytes]:
        return start(
            "worker", "tcp://127.0.0.1:18786", "--nthreads", "1", "--no-nanny", "--no-dashboard"
        )

    def end(parts: list[subprocess.Popen[bytes]]) -> None:
        for one in parts:
            one.kill()
            one.wait()

    def batches(name: str, client: subprocess.Popen[bytes], least: int) -> None:
        while client.poll() is None and len(list(tmp_path.glob(f"{name}.parts/*-*.json"))) < least:
            time.sleep(0.05)

    parts = cluster()
    try:
        subprocess.run([*arguments, "-o", str(tmp_path / "whole.csv")], check=True, env=environment)
        client = sweep_there("worker.csv")
        batches("worker.csv", client, 3)
        parts[1].kill()
        parts.append(worker())
        client.communicate()
        assert client.returncode == 0
        client = sweep_there("scheduler.csv")
        batches("scheduler.csv", client, 3)
        parts[0].kill()
        _, told = client.communicate()
        print(f"\nthe scheduler killed: exit {client.returncode}, {told.decode().splitlines()[-1]}")
        end(parts)
        parts = cluster()
        client = sweep_there("scheduler.csv")
        client.communicate()
        whole = (tmp_path / "whole.csv").read_bytes()
        for name in ("worker.csv", "scheduler.csv"):
            assert (tmp_path / name).read_bytes() == whole
    finally:
        end(parts)


@pytest.mark.bench
def test_the_memory_of_100_000_cases(tmp_path: Path) -> None:
    arguments = [*RUN, "sweep", str(MISSION), "--vehicle", "falkowski-2023-quadrotor"]
    arguments += ["--battery", "77Wh", "--workers", "1", "-o", str(tmp_path / "a.parquet")]
    vary = ("wind=0:6:3", "wind-from=0,180", "charge=100%:60.1%:0.1%", "health=1.0:0.802:0.002")
    for axis in (*vary[:2], "charge=100%:80.1%:0.1%", vary[3]):
        arguments += ["--vary", axis]
    code = (
        "import resource, sys; from planner.cli.main import main; main(sys.argv[1:]); "
        "print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss // 1024)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, *arguments[3:]],
        capture_output=True,
        check=True,
        text=True,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )
    print(f"\n{done.stdout.splitlines()[0]}: {done.stdout.splitlines()[-1]} MB")
