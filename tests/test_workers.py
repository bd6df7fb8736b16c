"""Jobs in several processes: their order, their end, and what is told where one is killed."""

from __future__ import annotations

import math
import multiprocessing
import os
import pickle

import pytest

from planner.errors import MissionFileError, VehicleFileError, WorkersError
from planner.findings import Place
from planner.workers import done_in_order


@pytest.mark.parametrize("workers", [1, 2])
def test_results_come_in_the_order_of_the_jobs_and_an_interruption_ends_all(workers: int) -> None:
    jobs = [20_000, 1, 9_000, 2, 0]  # the first takes longest
    with done_in_order(math.factorial, jobs, workers=workers) as done:
        assert list(done) == [math.factorial(job) for job in jobs]

    def interrupted() -> None:
        with done_in_order(math.factorial, [3] * 1000, workers=workers) as done:
            assert next(iter(done)) == 6
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        interrupted()
    assert multiprocessing.active_children() == []


def test_a_worker_that_is_killed_is_told_in_a_sentence() -> None:
    with (
        pytest.raises(WorkersError, match="a process of this call was killed"),
        done_in_order(os._exit, [1, 1], workers=2) as done,
    ):
        list(done)


def test_an_error_about_a_file_is_the_same_from_another_process() -> None:
    for error in (
        MissionFileError("is broken", source="a.plan", place=Place(4, 7)),
        VehicleFileError("2 problems", source="a.toml", key="rotor", problems=("one", "two")),
    ):
        again = pickle.loads(pickle.dumps(error))
        assert type(again) is type(error)
        assert str(again) == str(error)
        assert vars(again) == vars(error)
