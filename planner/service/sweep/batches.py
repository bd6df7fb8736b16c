"""Batches: the cases of a sweep in pieces, each a file that is on the disk whole or not at all.

They lie in a folder beside the table, with the marks of the plan they are of.  A sweep that is broken off
at any moment goes on with those that are missing; one whose input has changed starts anew, and puts
aside what there was.
"""

from __future__ import annotations

import re
from collections import deque
from contextlib import contextmanager, suppress
from itertools import count as count_from
from typing import TYPE_CHECKING

import msgspec

from planner.errors import OutputError
from planner.files import alone_in, make_output_folder, replacing
from planner.service.sweep.outcome import CaseOutcome, check_cases
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    from planner.service.sweep.cases import Cases
    from planner.service.sweep.memory import RememberingSteps
    from planner.service.sweep.plan import SweepPlan

_NAME = re.compile(r"(\d+)-(\d+)\.json")
_PLAN = "plan.json"
_TEMPORARY = ".mavjoule-"
Job = tuple[int, int]
"""Number of the first case of a batch, and how many it has."""
_SHORTEST_S, _LONGEST_S = 0.5, 3.0
"""What a batch is to take: its overhead is some milliseconds, and a scheduler hands out some 300 a second."""
_LEAST_BATCHES = 64
"""Of what is left of a sweep that does not take long: workers end at about the same time."""
_MOST_IN_BATCH = 5000
_PROBED = 24
"""Cases of a batch while nobody knows how long they take."""
_WEIGHT = 0.3
"""Of the latest batch, in how long a case takes."""


class Batch(Value):
    """The outcomes of cases that follow one another."""

    mark: str
    """Of the plan."""
    first: int
    """Number of the first case."""
    outcomes: tuple[CaseOutcome, ...]
    checks: int
    """How many were worked out: conditions that are equal are once."""
    flights: int
    """How many were flown for them."""


class _Marks(Value):
    marks: dict[str, str]


def run_batch(plan: SweepPlan, first: int, count: int, steps: RememberingSteps) -> bytes:
    """Return the batch of some cases as it is written to its file."""
    before = steps.flights
    outcomes = tuple(check_cases(plan, range(first, first + count), steps))
    batch = Batch(
        mark=plan.mark, first=first, outcomes=outcomes, checks=count, flights=steps.flights - before
    )
    return msgspec.json.encode(batch)


class BatchFolder:
    """The finished batches of a sweep on the disk."""

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self._folder, self._plan = folder, plan
        self.aside: Path | None = None
        """Where the batches of another plan were put; ``None``: there were none."""

    @contextmanager
    def held(self) -> Iterator[None]:
        """Keep other sweeps from the folder, which is made where it is not there.

        Raises
        ------
        OutputError
            If another has it, or it cannot be made.
        """
        make_output_folder(self._folder, holding="the batches of a sweep")
        with alone_in(self._folder):
            yield

    def open(self) -> tuple[str, ...]:
        """Take what is there; return what has changed since, for which it starts anew.

        Raises
        ------
        OutputError
            If the folder cannot be written, or holds something else.
        """
        for path in self._folder.glob(f"{_TEMPORARY}*"):  # of one that was killed as it wrote
            path.unlink(missing_ok=True)
        known = self._folder / _PLAN
        others = [one for one in self._folder.iterdir() if not self._is_own(one.name)]
        if others:
            msg = f"{self._folder}: holds {others[0].name}, which is no batch of a sweep: move it"
            raise OutputError(msg)
        changed: tuple[str, ...] = ()
        if known.exists() or any(self._files()):
            before: dict[str, str] = {}
            with suppress(FileNotFoundError, msgspec.DecodeError):  # then nothing is known of them
                before = msgspec.json.decode(known.read_bytes(), type=_Marks).marks
            if before == self._plan.marks:
                return ()
            changed = tuple(
                name for name, mark in self._plan.marks.items() if before.get(name) != mark
            )
        if any(self._files()):  # of another plan, or of none that is known
            self._put_aside()
        self._write(_PLAN, msgspec.json.encode(_Marks(marks=self._plan.marks)))
        return changed

    def _put_aside(self) -> None:
        """Keep the batches that are there in a folder beside, from which their sweep can go on."""
        beside = (self._folder.with_name(f"{self._folder.name}.{n}") for n in count_from(1))
        self.aside = next(path for path in beside if not path.exists())
        make_output_folder(self.aside, holding="the batches of a sweep")
        known = self._folder / _PLAN
        for path in [*(path for path, _, _ in self._files()), *([known] if known.exists() else ())]:
            path.replace(self.aside / path.name)

    def done(self) -> dict[int, int]:
        """Return the whole batches there are: how many cases each holds, by the number of its first."""
        return {first: count for _, first, count in self._files()}

    def write(self, data: bytes, first: int, count: int) -> None:
        """Put a batch on the disk."""
        self._write(f"{first:010d}-{count}.json", data)

    def read(self, first: int, count: int) -> Batch | None:
        """Return a batch; ``None`` where its file is damaged, which is taken away then."""
        path = self._folder / f"{first:010d}-{count}.json"
        with suppress(OSError, msgspec.DecodeError):
            batch = msgspec.json.decode(path.read_bytes(), type=Batch)
            if batch.mark == self._plan.mark and (batch.first, len(batch.outcomes)) == (
                first,
                count,
            ):
                return batch
        path.unlink(missing_ok=True)
        return None

    def remove(self) -> None:
        """Take the batches away, and the folder if it holds nothing else."""
        for path, _, _ in self._files():
            path.unlink(missing_ok=True)
        (self._folder / _PLAN).unlink(missing_ok=True)
        with suppress(OSError):
            self._folder.rmdir()

    def _write(self, name: str, data: bytes) -> None:
        with replacing(self._folder / name) as file:
            file.write(data)

    def _is_own(self, name: str) -> bool:
        return name == _PLAN or bool(_NAME.fullmatch(name))

    def _files(self) -> Iterator[tuple[Path, int, int]]:
        for path in sorted(self._folder.iterdir()):
            if found := _NAME.fullmatch(path.name):
                yield path, int(found[1]), int(found[2])


class Jobs:
    """The batches that are missing, cut as they are asked for: as long as those before them tell.

    They end where what changes slowly changes: what follows from it is worked out once.
    """

    def __init__(self, cases: Cases, done: Mapping[int, int]) -> None:
        self._strides = cases.strides
        self._gaps: deque[tuple[int, int]] = deque()
        self._case_s: float | None = None
        self.left = len(cases) - sum(done.values())
        """Cases that nobody has asked for."""
        at = 0
        for first, count in [*sorted(done.items()), (len(cases), 0)]:
            if first > at:
                self._gaps.append((at, first))
            at = max(at, first + count)

    def __iter__(self) -> Iterator[Job]:
        """Return itself."""
        return self

    def __next__(self) -> Job:
        """Return the first case of the next batch, and how many it has."""
        if not self._gaps:
            raise StopIteration
        first, end = self._gaps.popleft()
        size = self._size()
        unit = next(stride for stride in self._strides if stride <= size)  # the last is 1
        cut = min(-(-(first + size) // unit) * unit, end)
        if cut < end:
            self._gaps.appendleft((cut, end))
        self.left -= cut - first
        return first, cut - first

    def took(self, count: int, seconds: float) -> None:
        """Note what a batch took, in processor time. [s]"""
        case_s = seconds / count
        self._case_s = (
            case_s if self._case_s is None else self._case_s + _WEIGHT * (case_s - self._case_s)
        )

    def _size(self) -> int:
        if self._case_s is None:
            return _PROBED
        batch_s = min(max(self.left * self._case_s / _LEAST_BATCHES, _SHORTEST_S), _LONGEST_S)
        return max(1, min(round(batch_s / max(self._case_s, 1e-6)), _MOST_IN_BATCH))
