"""Jobs done in several processes: what they come to in the order of the jobs, and an end at Ctrl-C."""

from __future__ import annotations

import gc
import os
import signal
from collections import deque
from collections.abc import Sized
from contextlib import contextmanager
from itertools import islice
from threading import Thread
from typing import TYPE_CHECKING, TypeVar

from planner.errors import WorkersError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Future, ProcessPoolExecutor
    from multiprocessing.synchronize import Event

Job = TypeVar("Job")
Done = TypeVar("Done")

_SEARCHED_AFTER = 50_000
"""Values that are made between two searches for what only refers to itself."""
_THREADS = "OPENBLAS_NUM_THREADS"
_AHEAD = 4
"""Jobs a process has waiting, so that it never waits for this one; the others are not asked for yet."""
_AHEAD_OF_HELPER = 2
"""And where this one does jobs too: it waits for those at the end."""

_stopped: Event | None = None
"""Of a process that works for another: whether that one wants no more."""


def core_count() -> int:
    """Return how many processor cores this process may use."""
    if hasattr(os, "sched_getaffinity"):  # not where a container or taskset gives it fewer
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@contextmanager
def done_in_order(
    work: Callable[[Job], Done],
    jobs: Iterable[Job],
    *,
    workers: int,
    start: Callable[[], None] | None = None,
    helps: bool = False,
) -> Iterator[Iterable[Done]]:
    """Give what jobs come to, one by one in their order, done in this process or in several.

    Parameters
    ----------
    work : callable
        What is done with each job: a function of a module, as other processes have to find it.
    jobs : iterable
        Values that can be pickled, as what they come to; taken a few ahead of what is done.
    workers : int
        Processes at most; the results do not depend on them.
    start : callable, optional
        Called first in each process; it can be pickled, with what all jobs have in common.
    helps : bool, optional
        Whether this process is one of these, which does a job where it would wait: for short ones, of which
        all that they come to is kept.

    Raises
    ------
    WorkersError
        Where the results are taken, if one of the processes was killed.
    """
    if isinstance(jobs, Sized):
        workers = min(workers, len(jobs))
    if workers < 2:
        if start is not None:
            start()
        yield map(work, jobs)
        return
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    context = get_context("spawn")
    stop = context.Event()
    others = workers - helps
    ahead = others * (_AHEAD_OF_HELPER if helps else _AHEAD)
    with ProcessPoolExecutor(
        others, mp_context=context, initializer=_obey, initargs=(stop, start)
    ) as pool:
        try:
            left = iter(jobs)
            with (
                _unheard(),
                _single_threaded(),
            ):  # as the first jobs are handed in, all processes start
                waiting = deque(pool.submit(work, job) for job in islice(left, ahead))
            if helps and start is not None:
                start()
            yield _unless_killed(_in_order(pool, work, waiting, left, ahead=ahead, helps=helps))
        finally:
            stop.set()
            pool.shutdown(cancel_futures=True)


def _in_order(
    pool: ProcessPoolExecutor,
    work: Callable[[Job], Done],
    waiting: deque[Future[Done]],
    left: Iterator[Job],
    *,
    ahead: int,
    helps: bool,
) -> Iterator[Done]:
    def hand_in() -> None:
        busy = sum(not one.done() for one in waiting) if helps else len(waiting)
        waiting.extend(pool.submit(work, job) for job in islice(left, max(ahead - busy, 0)))

    while waiting:
        first = waiting.popleft()
        while helps and not first.done() and (own := [*islice(left, 1)]):
            waiting.append(_done_here(work, *own))
            hand_in()
        done = first.result()
        hand_in()
        yield done


def _done_here(work: Callable[[Job], Done], job: Job) -> Future[Done]:
    """Return a job as another process would have done it: an error is told in its turn."""
    from concurrent.futures import Future

    done = Future[Done]()
    try:
        done.set_result(work(job))
    except Exception as error:  # noqa: BLE001 - raised where the result is taken
        done.set_exception(error)
    return done


def search_seldom() -> None:
    """Have what only refers to itself searched for seldom: it is little, and costs a fifteenth of a check."""
    gc.set_threshold(_SEARCHED_AFTER)


def end_if_stopped() -> None:
    """End the job of a worker as by Ctrl-C where nobody waits for it any more."""
    if _stopped is not None and _stopped.is_set():
        raise KeyboardInterrupt


def _obey(stop: Event, start: Callable[[], None] | None) -> None:
    """Note what ends this process: the one that made it, which may be killed."""
    global _stopped  # noqa: PLW0603 - what a process is given at its start
    _stopped = stop
    search_seldom()
    Thread(target=_end_with_parent, daemon=True).start()
    if start is not None:
        start()


def _end_with_parent() -> None:
    from multiprocessing import parent_process

    parent = parent_process()
    if parent is not None:
        parent.join()
        os._exit(1)  # nobody waits for it any more, and it would for ever


def _unless_killed(done: Iterable[Done]) -> Iterator[Done]:
    from concurrent.futures.process import BrokenProcessPool

    try:
        yield from done
    except BrokenProcessPool as error:
        msg = "a process of this call was killed, probably for want of memory: give it less at once"
        raise WorkersError(msg) from error


@contextmanager
def _single_threaded() -> Iterator[None]:
    """Start processes whose matrices have one thread: there are as many of them as cores."""
    before = os.environ.get(_THREADS)
    os.environ.setdefault(_THREADS, "1")
    try:
        yield
    finally:
        if before is None:
            del os.environ[_THREADS]


@contextmanager
def _unheard() -> Iterator[None]:
    """Start processes that never hear Ctrl-C, as they inherit; this one hears it when that is done."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)
