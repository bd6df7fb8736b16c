"""Jobs in several processes: their order, their end, and what is told where one is killed."""

from __future__ import annotations

import math
import multiprocessing
import os
import pickle
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from planner.errors import MissionFileError, VehicleFileError, WorkersError
from planner.findings import Place
from planner.workers import done_in_order

if TYPE_CHECKING:
    from collections.abc import Iterator


@pytest.mark.parametrize(("workers", "helps"), [(1, False), (2, False), (2, True)])
def test_results_come_in_the_order_of_the_jobs_and_an_interruption_ends_all(
    workers: int, *, helps: bool
) -> None:
    jobs = [20_000, 1, 9_000, 2, 0, 7, 8]  # the first takes longest
    with done_in_order(math.factorial, jobs, workers=workers, helps=helps) as done:
        assert list(done) == [math.factorial(job) for job in jobs]

    def interrupted() -> None:
        with done_in_order(math.factorial, [3] * 1000, workers=workers, helps=helps) as done:
            assert next(iter(done)) == 6
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert multiprocessing.active_children() == []


@pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
def test_an_interruption_while_workers_start_is_heard_when_they_have() -> None:
    def jobs() -> Iterator[int]:
        os.kill(os.getpid(), signal.SIGINT)
        yield from range(1000)

    with pytest.raises(KeyboardInterrupt), done_in_order(math.factorial, jobs(), workers=2) as done:
        list(done)
    assert multiprocessing.active_children() == []


def test_an_error_comes_in_its_turn_from_who_helps_too() -> None:
    """The other process takes longer to start than this one to get to the error."""
    jobs = [5, 4, 3, 2, -1, 6]
    with done_in_order(math.factorial, jobs, workers=2, helps=True) as done:
        results = iter(done)
        assert [next(results) for _ in jobs[:4]] == [120, 24, 6, 2]
        with pytest.raises(ValueError, match="negative"):
            next(results)


def test_a_worker_that_is_killed_is_told_in_a_sentence() -> None:
    with (
        pytest.raises(WorkersError, match="a process of this call was killed"),
        done_in_order(os._exit, [1, 1], workers=2) as done,
    ):
        list(done)


_FACTORIALS = """
import math, os, signal, sys, time
from planner.errors import WorkersError
from planner.workers import done_in_order

def work(job):
    os.write(2, f"{os.getpid()}\\n".encode())  # at once
    time.sleep(float(sys.argv[1]))
    return math.factorial(job)

if __name__ == "__main__":
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # as the command does
    try:
        with done_in_order(work, [5, 3, 4], workers=2) as done:
            print(*done)
    except WorkersError as error:
        print(error)
"""


def _started(folder: Path, *arguments: str) -> subprocess.Popen[str]:
    script = folder / "factorials.py"
    script.write_text(_FACTORIALS, encoding="utf-8")
    return subprocess.Popen(
        [sys.executable, str(script), *arguments],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )


def test_workers_of_a_script_do_its_work(tmp_path: Path) -> None:
    with _started(tmp_path, "0") as process:
        out, _ = process.communicate()
    assert (process.returncode, out) == (0, "120 6 24\n")


@pytest.mark.skipif(not Path("/proc").is_dir(), reason="looks for the processes there")
def test_workers_end_with_who_made_them(tmp_path: Path) -> None:
    with _started(tmp_path, "600") as process:
        assert process.stderr is not None
        workers = {int(process.stderr.readline()) for _ in range(2)}
        process.kill()
        for _ in range(600):
            if not any(map(_runs, workers)):
                break
            time.sleep(0.1)
        left = {one for one in workers if _runs(one)}
        for one in left:
            os.kill(one, signal.SIGKILL)
        assert not left


@pytest.mark.skipif(not hasattr(signal, "SIGKILL"), reason="no process is killed that way")
def test_who_made_workers_ends_with_one_that_is_killed(tmp_path: Path) -> None:
    with _started(tmp_path, "600") as process:
        assert process.stderr is not None
        first, _ = (int(process.stderr.readline()) for _ in range(2))
        os.kill(first, signal.SIGKILL)
        try:
            out, _ = process.communicate(timeout=60)
        finally:
            process.kill()
    assert "a process of this call was killed" in out


def _runs(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text(encoding="utf-8").rpartition(")")[2].split()
    except OSError:
        return False
    return state[0] != "Z"


def test_an_error_about_a_file_is_the_same_from_another_process() -> None:
    for error in (
        MissionFileError("is broken", source="a.plan", place=Place(4, 7)),
        VehicleFileError("2 problems", source="a.toml", key="rotor", problems=("one", "two")),
    ):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)
