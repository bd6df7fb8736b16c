"""The table of a sweep: a row for each case, with its settings and what it comes to, in columns.

The rows are the same however the sweep was worked out: they follow the numbers of the cases.
"""

from __future__ import annotations

from functools import cached_property
from itertools import product
from typing import TYPE_CHECKING, Any

import numpy as np

from planner.service.sweep.outcome import CaseOutcome
from planner.values import Value, field_names

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.arrays import IntArray
    from planner.service.sweep.cases import Cases

TIME = "time"
"""Column of when the weather of a row was measured."""
NO_WEATHER = CaseOutcome(verdict=None, refused="the weather of this time has a gap")


class TableColumns(Value):
    """The columns of a table: those of what varies, then those of outcomes."""

    names: tuple[str, ...]
    is_number: tuple[bool, ...]


class CaseTable(Value, eq=False, dict=True):
    """How the rows of a table follow from the cases."""

    cases: Cases

    @cached_property
    def columns(self) -> TableColumns:
        """The heads, and which columns hold numbers."""
        axes = self.cases.axes
        numbers = [
            all(isinstance(axis.cell(v), float | None) for v in axis.values) for axis in axes
        ]
        time = [TIME] if self._has_times else []
        texts = {"verdict", "codes", "breaks_first", "refused"}
        outcome = field_names(CaseOutcome)
        return TableColumns(
            names=(*(axis.key for axis in axes), *time, *outcome),
            is_number=(*numbers, *(False for _ in time), *(one not in texts for one in outcome)),
        )

    def rows(self, first: int, outcomes: Sequence[CaseOutcome]) -> Iterator[list[Any]]:
        """Yield the rows of cases that follow one another: one, or one for each time of its weather."""
        for number, outcome in enumerate(outcomes, first):
            settings = self._settings(self.cases.places(number))
            results = [getattr(outcome, name) for name in field_names(CaseOutcome)]
            for time in self._times(number):
                yield [*settings, *time, *results]

    def rows_without_weather(self) -> Iterator[list[Any]]:
        """Yield the rows of times whose weather has a gap: nothing is known of them."""
        if not self.cases.unchecked_times:
            return
        results = [getattr(NO_WEATHER, name) for name in field_names(CaseOutcome)]
        others = [range(len(b.points)) if b.times is None else (None,) for b in self.cases.blocks]
        for time in self.cases.unchecked_times:
            for places in product(*others):
                yield [*self._settings(places), time, *results]

    def times_of(self, number: int) -> tuple[str, ...] | None:
        """Return when the weather of a case was measured; ``None``: it is not measured."""
        for block, place in zip(self.cases.blocks, self.cases.places(number), strict=True):
            if block.times is not None:
                return block.times[place]
        return None

    def _times(self, number: int) -> tuple[tuple[str, ...], ...]:
        times = self.times_of(number)
        return ((),) if times is None else tuple((time,) for time in times)

    def _settings(self, places: Sequence[int | None]) -> list[Any]:
        return [
            cell
            for cells, block, place in zip(self._cells, self.cases.blocks, places, strict=True)
            for cell in (cells[place] if place is not None else (None,) * len(block.axes))
        ]

    @cached_property
    def _cells(self) -> tuple[tuple[tuple[Any, ...], ...], ...]:
        return tuple(
            tuple(
                tuple(axis.cell(value) for axis, value in zip(block.axes, point, strict=True))
                for point in block.points
            )
            for block in self.cases.blocks
        )

    @property
    def _has_times(self) -> bool:
        return any(block.times is not None for block in self.cases.blocks)


def case_places(cases: Cases, first: int, count: int) -> IntArray:
    """Return the positions of cases in each block. (count, blocks)"""
    numbers = np.arange(first, first + count)
    return np.stack(
        [
            numbers // stride % len(block.points)
            for block, stride in zip(cases.blocks, cases.strides, strict=True)
        ],
        axis=1,
    )
