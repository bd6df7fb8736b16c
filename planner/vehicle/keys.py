"""Keys and tables of a model file: what each holds, and what is refused."""

from __future__ import annotations

import datetime as dt
from dataclasses import field
from enum import StrEnum
from itertools import pairwise
from typing import TYPE_CHECKING, Any

from planner.errors import described, is_number, nearest_hint
from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Mapping

    CrossCheck = Callable[[Mapping[str, Any]], Iterable[tuple[str, str]]]

_MOST_UNKNOWN_KEYS = 20
"""Unknown keys named one by one; a file with more is another kind of file."""


@frozen
class Interval:
    """A closed interval of a quantity."""

    low: float
    high: float

    def __post_init__(self) -> None:
        if not self.low <= self.high:  # `not <=` also refuses NaN
            msg = f"an interval must not end below its beginning, got [{self.low}, {self.high}]"
            raise ValueError(msg)

    def __contains__(self, value: float) -> bool:
        """Return whether the value lies in the interval, its ends included."""
        return self.low <= value <= self.high


class Kind(StrEnum):
    """What a key holds, in the words of the documentation."""

    TEXT = "text"
    TEXTS = "list of texts"
    INTEGER = "whole number"
    NUMBER = "number"
    NUMBERS = "list of numbers"
    INTERVAL = "[lowest, highest]"
    DATE = "date"

    def holds(self, value: object) -> bool:
        """Return whether a value as TOML holds it is of this kind; NaN and infinity never are."""
        entries = value if isinstance(value, list | tuple) else None
        match self:
            case Kind.TEXT:
                right = isinstance(value, str)
            case Kind.INTEGER:
                right = isinstance(value, int) and is_number(value)
            case Kind.NUMBER:
                right = is_number(value)
            case Kind.DATE:
                right = isinstance(value, dt.date) and not isinstance(value, dt.datetime)
            case Kind.TEXTS:
                right = entries is not None and all(isinstance(entry, str) for entry in entries)
            case Kind.NUMBERS:
                right = entries is not None and all(map(is_number, entries))
            case Kind.INTERVAL:
                right = entries is not None and len(entries) == 2 and all(map(is_number, entries))
        return right


@frozen
class Key:
    """One key of a table and what its value must be."""

    name: str
    kind: Kind
    meaning: str
    unit: str = ""
    required: bool = True
    choices: tuple[str, ...] = ()
    above: float | None = None
    """The value, or each value of a list, must be greater than this."""
    at_least: float | None = None
    at_most: float | None = None
    least_count: int = 0
    most_count: int = 1000
    is_rising: bool = False
    """Each value of a list must be greater than the one before."""

    def problem(self, value: object) -> str | None:
        """Return what is wrong with a value as TOML holds it, or ``None``."""
        if not self.kind.holds(value):
            return f"must be a {self.kind}, got {described(value)}"
        if self.choices and value not in self.choices:
            choices = ", ".join(self.choices)
            return f"must be one of {choices}, got {described(value)}"
        if isinstance(value, str):
            return None if value.strip() else "must not be empty"
        if isinstance(value, list | tuple):
            if not self.least_count <= len(value) <= self.most_count:
                return f"must have {self.least_count} to {self.most_count} values, got {len(value)}"
            return None if self.kind is Kind.TEXTS else self._number_problem(tuple(value))
        return None if self.kind is Kind.DATE else self._number_problem((value,))

    def _number_problem(self, values: tuple[Any, ...]) -> str | None:
        for value in values:
            if self.above is not None and not value > self.above:
                return f"must be greater than {self.above:g}, got {value:g}"
            if self.at_least is not None and not value >= self.at_least:
                return f"must not be below {self.at_least:g}, got {value:g}"
            if self.at_most is not None and not value <= self.at_most:
                return f"must not be above {self.at_most:g}, got {value:g}"
        for before, after in pairwise(values):
            if self.is_rising and not after > before:
                return f"must rise from value to value, but {after:g} follows {before:g}"
            if self.kind is Kind.INTERVAL and not after >= before:
                return f"must not end below its beginning, got [{before:g}, {after:g}]"
        return None

    def cleaned(self, value: Any) -> Any:  # noqa: ANN401 -- whatever TOML holds
        """Return a value without problem in the type the model's values hold it in."""
        match self.kind:
            case Kind.NUMBER:
                return float(value)
            case Kind.NUMBERS:
                return tuple(map(float, value))
            case Kind.TEXTS:
                return tuple(value)
            case Kind.INTERVAL:
                return Interval(low=float(value[0]), high=float(value[1]))
            case _:
                return value


def _nothing_to_compare(_: Mapping[str, Any]) -> Iterable[tuple[str, str]]:
    return ()


@frozen
class Table:
    """One table of a model file: its keys, and what must hold between them."""

    name: str
    """Dotted name; empty for the top of the file."""
    meaning: str
    keys: tuple[Key, ...] = ()
    required: bool = False
    selector: tuple[str, str] | None = None
    """(key, value) which selects this variant among the tables of the same name."""
    is_free: bool = False
    """Any name with a number is accepted."""
    cross_check: CrossCheck = field(default=_nothing_to_compare)
    """Yields (key, problem) for what does not fit together; sees values that are right alone."""

    def problems(
        self, raw: Mapping[str, Any], *, tables_inside: Iterable[str] = ()
    ) -> list[tuple[str, str]]:
        """Return (key, problem) for everything wrong in the table."""
        if self.is_free:
            return [
                (name, f"must be a number, got {described(value)}")
                for name, value in raw.items()
                if not is_number(value)
            ]
        known = {key.name for key in self.keys}
        possible = {*known, *tables_inside}
        unknown = [name for name in raw if name not in possible]
        found = [
            (name, f"is no key of a model file{nearest_hint(name, possible)}")
            for name in unknown[:_MOST_UNKNOWN_KEYS]
        ]
        if len(unknown) > _MOST_UNKNOWN_KEYS:
            found.append(("*", f"has {len(unknown)} unknown keys: is this a model file?"))
        for key in self.keys:
            if key.name not in raw:
                if key.required:
                    found.append((key.name, f"is missing ({key.meaning})"))
            elif (problem := key.problem(raw[key.name])) is not None:
                found.append((key.name, problem))
        return found or list(self.cross_check(raw))

    def cleaned(self, raw: Mapping[str, Any]) -> dict[str, Any]:
        """Return the values of a table without problems."""
        if self.is_free:
            return {name: float(value) for name, value in raw.items()}
        return {key.name: key.cleaned(raw[key.name]) for key in self.keys if key.name in raw}

    def refuse(self, value: object) -> None:
        """Raise what is wrong in a value whose attributes are the keys of this table.

        Raises
        ------
        ValueError
            With every problem in one sentence.
        """
        held = {key.name: getattr(value, key.name) for key in self.keys}
        raw = {name: _as_toml(entry) for name, entry in held.items() if entry is not None}
        if problems := self.problems(raw):
            raise ValueError("; ".join(f"{key} {problem}" for key, problem in problems))


def _as_toml(value: object) -> object:
    return (value.low, value.high) if isinstance(value, Interval) else value
