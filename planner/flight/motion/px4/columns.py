"""Columns: frozen values of arrays of one length, taken apart and put together by rows."""

from __future__ import annotations

from dataclasses import fields
from typing import TYPE_CHECKING, Any, Self

from planner.frozen import frozen

if TYPE_CHECKING:
    from planner.flight.motion.kinematics import BoolArray, IntArray


@frozen(eq=False)
class Columns:
    """Arrays whose first axis counts the same rows, and further columns of these rows."""

    def select(self, rows: IntArray | BoolArray) -> Self:
        """Return some of the rows."""
        chosen: dict[str, Any] = {}
        for name in [column.name for column in fields(self)]:
            value = getattr(self, name)
            chosen[name] = value.select(rows) if isinstance(value, Columns) else value[rows]
        return type(self)(**chosen)

    def put(self, rows: IntArray, values: Self) -> None:
        """Overwrite some of the rows, in place."""
        for name in [column.name for column in fields(self)]:
            mine, given = getattr(self, name), getattr(values, name)
            if isinstance(mine, Columns):
                mine.put(rows, given)
            else:
                mine[rows] = given
