"""Frozen values with slots, made thousands at once."""

from __future__ import annotations

from collections import deque
from dataclasses import MISSING, fields
from itertools import repeat
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
        For each field, in their order, its value in each of them; the last fields may be left to
        their defaults.  No column for no values.

    Raises
    ------
    TypeError
        If a column is left out for a field without a default.

    Notes
    -----
    The ``__init__`` of a frozen dataclass sets each value by its name.  This sets a column at a
    time through its slot, in less than half the time.
    """
    given = list(columns)
    made = [object.__new__(kind) for _ in given[0]] if given else []
    for number, field in enumerate(fields(kind)):  # type: ignore[arg-type]  # a dataclass, as the docstring asks
        if number >= len(given) and made and field.default is MISSING:
            msg = f"{kind.__name__} needs a column for {field.name}"
            raise TypeError(msg)
        column = given[number] if number < len(given) else repeat(field.default)
        deque(map(getattr(kind, field.name).__set__, made, column), maxlen=0)
    return made
