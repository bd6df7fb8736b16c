"""Frozen values with slots, made thousands at once."""

from __future__ import annotations

from collections import deque
from dataclasses import fields
from typing import TYPE_CHECKING, Any, TypeVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

Value = TypeVar("Value")


def make_many(kind: type[Value], columns: Iterable[Sequence[Any]]) -> list[Value]:
    """Return values of a frozen dataclass with slots.

    Parameters
    ----------
    kind : type
        The dataclass; it has no ``__post_init__``.
    columns : iterable of sequence
        For each field, in their order, its value in each of them; no column for no values.

    Notes
    -----
    The ``__init__`` of a frozen dataclass sets each value by its name.  This sets a column at a
    time through its slot, in less than half the time.
    """
    made: list[Value] = []
    for number, (field, column) in enumerate(zip(fields(kind), columns, strict=False)):  # type: ignore[arg-type]  # a dataclass, as the docstring asks
        if number == 0:
            made = [object.__new__(kind) for _ in column]
        deque(map(getattr(kind, field.name).__set__, made, column), maxlen=0)
    return made
