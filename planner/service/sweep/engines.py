"""Engines: where batches are worked out.  Here, on the cores of this machine, or on a Dask cluster.

Each gives the same bytes for the same batch, and none keeps anything: a batch that is lost with its
worker is worked out again.
"""

from __future__ import annotations

import gc
import logging
import pickle
import time
from collections import deque
from contextlib import contextmanager, suppress
from functools import partial
from importlib import import_module
from itertools import chain
from threading import local
from typing import TYPE_CHECKING, Any, Protocol

from planner import __version__
from planner.errors import ExitCode, MavjouleError, WorkersError
from planner.service.sweep.batches import run_batch
from planner.service.sweep.memory import RememberingSteps
from planner.service.sweep.plan import program_mark
from planner.workers import done_in_order, end_if_stopped, search_seldom

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator
    from pathlib import Path
    from types import ModuleType

    from planner.service.sweep.batches import Job
    from planner.service.sweep.plan import SweepPlan

Timed = tuple[bytes, float]
"""A batch, and what it took in processor time. [s]"""
Done = tuple[int, int, bytes, float]
"""A job with that."""
_AHEAD = 4
"""Jobs a worker of a cluster has waiting, so that it never waits for this process."""
_LOOKED_S = 5.0
"""Between two looks at how many workers a cluster has."""
_MOST_DEATHS = 3
"""Times workers may be killed without a batch between: a batch that kills them is not asked for again."""
_WAIT_S = 30.0
"""For a scheduler, and for its first worker."""


class EngineError(MavjouleError):
    """Workers that cannot work, or are lost; what is done stays done."""

    exit_code = ExitCode.LINK


class Engine(Protocol):
    """Works out batches, in any order."""

    def run(self, plan: SweepPlan, jobs: Iterable[Job]) -> Iterator[Done]:
        """Yield each job with its batch, as it is done; jobs are taken a few ahead of that."""
        ...


class CoresEngine:
    """Processes on the cores of this machine, or this one alone."""

    def __init__(self, workers: int) -> None:
        self._workers = workers

    def run(self, plan: SweepPlan, jobs: Iterable[Job]) -> Iterator[Done]:
        """Yield each job with its batch, in their order; workers that are killed are replaced."""
        left, deaths = iter(jobs), 0
        taken: deque[Job] = deque()
        start = partial(_take, pickle.dumps(plan))

        def noted(jobs: Iterable[Job]) -> Iterator[Job]:
            for job in jobs:
                taken.append(job)
                yield job

        is_done = False
        while not is_done:
            again = tuple(taken)
            taken.clear()
            todo = noted(chain(again, left))
            try:
                with done_in_order(_work, todo, workers=self._workers, start=start) as batches:
                    for batch in batches:
                        deaths = 0
                        yield *taken.popleft(), *batch
                is_done = True
            except WorkersError as error:
                deaths += 1
                if deaths == _MOST_DEATHS:
                    raise _deadly(taken[0], deaths) from error


_own: dict[str, Any] = {}
"""Of a process that works: the plan it works on."""


def _take(data: bytes) -> None:
    _own["plan"], _own["steps"] = pickle.loads(data), RememberingSteps()


def _work(job: Job) -> Timed:
    end_if_stopped()
    return _timed(_own["plan"], job, _own["steps"])


def _timed(plan: SweepPlan, job: Job, steps: RememberingSteps) -> Timed:
    begun_s = time.thread_time()
    return run_batch(plan, *job, steps), time.thread_time() - begun_s


class ClusterEngine:
    """The workers of a Dask scheduler, however many there are and wherever they are."""

    def __init__(self, scheduler: str | Path) -> None:
        self._scheduler = str(scheduler)

    def run(self, plan: SweepPlan, jobs: Iterable[Job]) -> Iterator[Done]:
        """Yield each job with its batch, as it is done; workers may come, go and die."""
        distributed = import_module("distributed")
        with _unlogged(), self._connected(distributed) as client:
            refuse_other_programs(client)
            # A task, not scattered data: the scheduler has it made again where its worker is lost.
            sent = client.submit(
                _unpacked, pickle.dumps(plan), key=f"sweep-plan-{plan.mark}", pure=False
            )
            left = iter(jobs)
            waiting: dict[Any, Job] = {}
            done = distributed.as_completed()
            ahead, looked_s = 1, -_LOOKED_S  # the first shows how long a case takes
            deaths = asked = 0
            try:
                while True:
                    while len(waiting) < ahead and (job := next(left, None)):
                        asked += 1
                        key = f"sweep-batch-{plan.mark}-{job[0]}-{job[1]}-{asked}"
                        future = client.submit(
                            _work_there, sent, job, program_mark(), key=key, pure=False
                        )
                        waiting[future] = job
                        done.add(future)
                    if not waiting:
                        return
                    future = next(done)
                    job = waiting.pop(future)
                    try:
                        timed = _result(future, self._scheduler)
                    except distributed.KilledWorker as error:  # it was there, as some of them died
                        deaths += 1
                        if deaths == _MOST_DEATHS:
                            raise _deadly(job, deaths * (error.allowed_failures + 1)) from error
                        left = chain([job], left)
                        continue
                    deaths = 0
                    yield *job, *timed
                    if time.monotonic() - looked_s > _LOOKED_S:
                        with suppress(OSError):  # lost: the next batch says so
                            ahead = _AHEAD * max(sum(client.nthreads().values()), 1)
                        looked_s = time.monotonic()
            finally:
                client.cancel(list(waiting), force=True)

    def _connected(self, distributed: ModuleType) -> Any:  # noqa: ANN401 - Dask has no types
        try:
            if self._scheduler.endswith(".json"):
                client = distributed.Client(scheduler_file=self._scheduler, timeout=_WAIT_S)
            else:
                client = distributed.Client(self._scheduler, timeout=_WAIT_S)
        except (OSError, ValueError) as error:
            msg = f"no Dask scheduler answers at {self._scheduler}: start one with 'dask scheduler'"
            raise EngineError(msg) from error
        try:
            client.wait_for_workers(1, timeout=_WAIT_S)
        except OSError as error:
            client.close()
            msg = f"the Dask scheduler {self._scheduler} has no workers: start them with 'dask worker'"
            raise EngineError(msg) from error
        return client


@contextmanager
def _unlogged() -> Iterator[None]:
    """Have a client not write tracebacks of what is said in a sentence: that its scheduler is lost."""
    logger = logging.getLogger("distributed.client")
    before = logger.disabled
    logger.disabled = True
    try:
        yield
    finally:
        logger.disabled = before


def refuse_other_programs(client: Any) -> None:  # noqa: ANN401 - Dask has no types
    """Raise ``EngineError`` where a worker has another mavjoule, or none."""
    found = client.run(program_mark, on_error="return")
    for worker, mark in sorted(found.items()):
        if isinstance(mark, BaseException):
            msg = f"worker {worker} has no mavjoule {__version__} ({mark}): install it there"
            raise EngineError(msg)
        if mark != program_mark():
            raise EngineError(_other_program(f"worker {worker}", mark))


def _other_program(worker: str, mark: str) -> str:
    return (
        f"{worker} has mavjoule {mark}, this is {program_mark()}: install the same on all machines"
    )


class _OtherProgramError(Exception):
    """A worker that came later has another mavjoule."""


def _deadly(job: Job, deaths: int) -> EngineError:
    first, count = job
    return EngineError(
        f"workers were killed {deaths} times at the cases from {first} to {first + count - 1}, perhaps for "
        "want of memory: what is done is kept, run it again with fewer workers"
    )


def _result(future: Any, scheduler: str) -> Timed:  # noqa: ANN401 - Dask has no types
    lost = f"the Dask scheduler {scheduler} is lost: what is done is kept, run it again to go on"
    if future.status in {"cancelled", "lost"}:
        raise EngineError(lost)
    try:
        timed: Timed = future.result()
    except import_module("distributed.comm").CommClosedError as error:
        raise EngineError(lost) from error
    except (_OtherProgramError, ImportError) as error:
        msg = f"a worker cannot work: {error}"
        raise EngineError(msg) from error
    return timed


_there = local()
"""Of a thread of a cluster's worker: the plan it works on, and what it remembers of it."""


def _unpacked(data: bytes) -> SweepPlan:
    plan: SweepPlan = pickle.loads(data)
    return plan


def _work_there(plan: SweepPlan, job: Job, mark: str) -> Timed:
    if program_mark() != mark:
        raise _OtherProgramError(_other_program("one of them", program_mark()))
    if getattr(_there, "mark", None) != plan.mark:
        _there.mark, _there.plan, _there.steps = plan.mark, plan, RememberingSteps()
    with _undisturbed():
        return _timed(_there.plan, job, _there.steps)


@contextmanager
def _undisturbed() -> Iterator[None]:
    """Have a worker not look where it is, nor how late its loop is, fifty times a second and more.

    Whoever works gives way to each look: together they take a fifth of the time.  Nor search often for what
    only refers to itself.
    """
    worker = import_module("distributed").get_worker()
    looks = [worker.periodic_callbacks.get(name) for name in ("profile", "tick")]
    known = [one for one in looks if one is not None]
    for one in known:
        worker.loop.add_callback(one.stop)
    searched = gc.get_threshold()
    search_seldom()
    try:
        yield
    finally:
        gc.set_threshold(*searched)
        for one in known:
            worker.loop.add_callback(one.start)
