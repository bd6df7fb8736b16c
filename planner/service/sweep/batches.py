"""Batches: the cases of a sweep in pieces, each a file that is on the disk whole or not at all.

They lie in a folder beside the table, with the marks of the plan they are of.  A sweep that is broken off
at any moment goes on with those that are missing; one whose input has changed starts anew.
"""

from __future__ import annotations

import re
from contextlib import suppress
from typing import TYPE_CHECKING

import msgspec

from planner.errors import OutputError
from planner.files import make_output_folder, write_output_bytes
from planner.service.sweep.outcome import CaseOutcome, check_case
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planner.service.sweep.memory import RememberingSteps
    from planner.service.sweep.plan import SweepPlan

_NAME = re.compile(r"(\d+)-(\d+)\.json")
_PLAN = "plan.json"


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
    outcomes = tuple(check_case(plan, number, steps) for number in range(first, first + count))
    batch = Batch(
        mark=plan.mark, first=first, outcomes=outcomes, checks=count, flights=steps.flights - before
    )
    return msgspec.json.encode(batch)


class BatchFolder:
    """The finished batches of a sweep on the disk."""

    def __init__(self, folder: Path, plan: SweepPlan) -> None:
        self._folder, self._plan = folder, plan

    def open(self) -> tuple[str, ...]:
        """Make the folder, or take what is there; return what has changed since, for which it starts anew.

        Raises
        ------
        OutputError
            If the folder cannot be written, or holds something else.
        """
        make_output_folder(self._folder, holding="the batches of a sweep")
        known = self._folder / _PLAN
        others = [one for one in self._folder.iterdir() if not self._is_own(one.name)]
        if others:
            msg = f"{self._folder}: holds {others[0].name}, which is no batch of a sweep: move it"
            raise OutputError(msg)
        changed: tuple[str, ...] = ()
        if known.exists():
            before: dict[str, str] = {}
            with suppress(msgspec.DecodeError):
                before = msgspec.json.decode(known.read_bytes(), type=_Marks).marks
            if before == self._plan.marks:
                return ()
            changed = tuple(
                name for name, mark in self._plan.marks.items() if before.get(name) != mark
            )
        for path, _, _ in self._files():  # of another plan, or of none that is known
            path.unlink()
        write_output_bytes(known, msgspec.json.encode(_Marks(marks=self._plan.marks)))
        return changed

    def done(self) -> dict[int, int]:
        """Return the whole batches there are: how many cases each holds, by the number of its first."""
        return {first: count for _, first, count in self._files()}

    def write(self, data: bytes, first: int, count: int) -> None:
        """Put a batch on the disk."""
        write_output_bytes(self._folder / f"{first:010d}-{count}.json", data)

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
        """Take the batches away, once they are in the table."""
        for path, _, _ in self._files():
            path.unlink(missing_ok=True)
        (self._folder / _PLAN).unlink(missing_ok=True)
        with suppress(OSError):  # something else has come into it
            self._folder.rmdir()

    def _is_own(self, name: str) -> bool:
        return name == _PLAN or bool(_NAME.fullmatch(name)) or name.startswith(".mavjoule-")

    def _files(self) -> Iterator[tuple[Path, int, int]]:
        for path in sorted(self._folder.iterdir()):
            if found := _NAME.fullmatch(path.name):
                yield path, int(found[1]), int(found[2])


def missing(total: int, done: dict[int, int], size: int) -> list[tuple[int, int]]:
    """Return the batches that are missing: the first case of each, and how many it has.

    ``size`` is how many cases each has, but for the last before one that is there.
    """
    found = []
    at = 0
    for first, count in [*sorted(done.items()), (total, 0)]:
        while at < first:
            step = min(size, first - at)
            found.append((at, step))
            at += step
        at = max(at, first + count)
    return found
