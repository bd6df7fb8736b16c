"""Values that declare of each field what it holds, in which unit and range, and refuse the rest.

The declaration is in the annotation of the field, as a `Key`.  The constructor of the value, the
reader and the writer of model files and the tables of keys in models/README.md follow from it, so the
annotations here are objects: no ``from __future__ import annotations``.
"""

import datetime as dt
import math
from collections.abc import Iterable, Iterator, Mapping
from enum import StrEnum
from functools import lru_cache
from itertools import pairwise
from types import SimpleNamespace, UnionType
from typing import TYPE_CHECKING, Any, TypeAlias, Union, get_args, get_origin

from msgspec import NODEFAULT

from planner import quantity
from planner.errors import described, is_number, nearest_hint, shortened
from planner.values import Value

if TYPE_CHECKING:
    from typing import Annotated as Annotated  # noqa: PLC0414 - for the modules that declare
else:

    class _AsTuple:
        def __getitem__(self, given: tuple[Any, "Key"]) -> tuple[Any, "Key"]:
            return given

    # What typing makes of a type and a key takes 2,000 times as long, for each field at every start.
    Annotated = _AsTuple()

Problem: TypeAlias = tuple[str, str]
"""(key, what is wrong with it)."""
Problems: TypeAlias = Iterator[Problem]
Named: TypeAlias = tuple[tuple[str, float], ...]
"""Numbers by names that no declaration knows beforehand, in the order of the file."""

_MOST_UNKNOWN_KEYS = 20
"""Unknown keys named one by one; a file with more is another kind of file."""


class Interval(Value):
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


_LEAST, _MOST = 1e-30, 1e30
"""Of numbers that are measured: their squares, and those of one over another, are numbers too."""


class Range(Value, kw_only=False):
    """The range in which a number can be meant."""

    low: float = -math.inf
    high: float = math.inf
    excludes_low: bool = False

    def problem(self, value: float) -> str | None:
        """Return what is wrong with a value, or ``None``."""
        if self.excludes_low and not value > self.low + _LEAST:
            return f"must be greater than {self.low:g}, got {value:g}"
        low, high = max(self.low, -_MOST), min(self.high, _MOST)
        if not value >= low:
            return f"must not be below {low:g}, got {value:g}"
        if not value <= high:
            return f"must not be above {high:g}, got {value:g}"
        return None

    @property
    def limits(self) -> list[str]:
        """The range in words, nothing for an end that is open."""
        low = [f"{'above' if self.excludes_low else 'at least'} {self.low:g}"]
        high = [f"at most {self.high:g}"]
        return low * math.isfinite(self.low) + high * math.isfinite(self.high)


ANY = Range()
POSITIVE = Range(0.0, excludes_low=True)
NOT_NEGATIVE = Range(0.0)


class KeyKind(StrEnum):
    """What a key holds, in the words of the documentation."""

    TEXT = "text"
    TEXTS = "list of texts"
    INTEGER = "whole number"
    NUMBER = "number"
    NUMBERS = "list of numbers"
    INTERVAL = "[lowest, highest]"
    DATE = "date"
    TIME = "date and time with its offset"
    SWITCH = "true or false"
    NAMED = "numbers by name"

    def holds(self, value: Any) -> bool:  # noqa: ANN401 -- anything may be given
        """Return whether a value is of this kind; NaN and infinity never are."""
        if not isinstance(value, _TYPES[self]):
            return False
        match self:
            case KeyKind.DATE | KeyKind.TIME:
                has_time = isinstance(value, dt.datetime)
                is_right = has_time is (self is KeyKind.TIME)
                return is_right and (not has_time or value.tzinfo is not None)
            case KeyKind.INTEGER | KeyKind.NUMBER:
                return is_number(value)
            case KeyKind.NUMBERS | KeyKind.INTERVAL:
                pair = (value.low, value.high) if self is KeyKind.INTERVAL else value
                return all(map(is_number, pair))
            case KeyKind.TEXTS:
                return all(isinstance(entry, str) for entry in value)
        return True  # each of named numbers is looked at by its own name

    def from_toml(self, raw: Any) -> Any:  # noqa: ANN401 -- whatever TOML holds
        """Return the value that TOML holds, as it is where it is not of this kind."""
        match self, raw:
            case KeyKind.NUMBER, _ if is_number(raw):
                return float(raw)
            case KeyKind.NUMBERS, list() if all(map(is_number, raw)):
                return tuple(map(float, raw))
            case KeyKind.TEXTS, list():
                return tuple(raw)
            case KeyKind.INTERVAL, [low, high] if (
                is_number(low) and is_number(high) and low <= high
            ):
                return Interval(low=float(low), high=float(high))
            case KeyKind.NAMED, dict():
                return tuple(
                    (name, KeyKind.NUMBER.from_toml(number)) for name, number in raw.items()
                )
        return raw


_TYPES: Mapping[KeyKind, Any] = {
    KeyKind.TEXT: str,
    KeyKind.TEXTS: tuple,
    KeyKind.INTEGER: int,
    KeyKind.NUMBER: int | float,
    KeyKind.NUMBERS: tuple,
    KeyKind.INTERVAL: Interval,
    KeyKind.DATE: dt.date,
    KeyKind.TIME: dt.datetime,
    KeyKind.SWITCH: bool,
    KeyKind.NAMED: tuple,
}
_KINDS: Mapping[Any, KeyKind] = {
    str: KeyKind.TEXT,
    int: KeyKind.INTEGER,
    float: KeyKind.NUMBER,
    dt.date: KeyKind.DATE,
    dt.datetime: KeyKind.TIME,
    bool: KeyKind.SWITCH,
    tuple[str, ...]: KeyKind.TEXTS,
    tuple[float, ...]: KeyKind.NUMBERS,
    Interval: KeyKind.INTERVAL,
    Named: KeyKind.NAMED,
}


class Key(Value, kw_only=False):
    """What a field holds: its declaration, in the annotation of the field."""

    meaning: str
    unit: str = ""
    range: Range = ANY
    """Of the value, or of each value of a list."""
    choices: tuple[str, ...] = ()
    """The texts a text may be, or the names numbers by name may have."""
    count: tuple[int, int] = (0, 1000)
    """Least and greatest length of a list."""
    rises: bool = False
    """Each value of a list must be greater than the one before."""
    absent: Mapping[str, str] = {}
    """Of variants of a table: the names that stand for none of them, and what each means."""

    def text_problem(self, text: str) -> str | None:
        """Return what is wrong with a text, or ``None``."""
        if self.choices and text not in self.choices:
            return f"must be one of {', '.join(self.choices)}, got {described(text)}"
        return None if text.strip() else "must not be empty"

    def list_problem(self, figures: tuple[float, ...]) -> str | None:
        """Return what is wrong with several numbers, or ``None``."""
        least, most = self.count
        if not least <= len(figures) <= most:
            return f"must have {least} to {most} values, got {len(figures)}"
        problems = [problem for one in figures if (problem := self.range.problem(one))]
        if self.rises:
            problems += [
                f"must rise from value to value, but {after:g} follows {before:g}"
                for before, after in pairwise(figures)
                if not after > before
            ]
        return problems[0] if problems else None


def curve(meaning: str, unit: str = "", within: Range = ANY) -> Key:
    """Declare a list of two values or more that rise."""
    return Key(meaning, unit, within, count=(2, 1000), rises=True)


class Field(Value):
    """A field of a value with its declaration and what follows from its type."""

    name: str
    """Of the field, and of the key or table in a file."""
    key: Key
    kind: KeyKind | None = None
    """``None`` where the field holds a table."""
    choice: type[StrEnum] | None = None
    """What a text is turned into."""
    parts: tuple[type["Part"], ...] = ()
    """What the table may hold: variants of it, where there are several."""
    may_be_none: bool = False
    default: Any = NODEFAULT

    @property
    def is_required(self) -> bool:
        """Whether a file must give it."""
        return self.default is NODEFAULT

    def from_toml(self, raw: Any) -> Any:  # noqa: ANN401 -- whatever TOML holds
        """Return the value that TOML holds, as it is where it cannot be the value of this field."""
        if self.choice is not None and raw in [*self.choice]:
            return self.choice(raw)
        return raw if self.kind is None else self.kind.from_toml(raw)

    def problems(self, value: Any) -> Problems:  # noqa: ANN401 -- also values of a wrong type
        """Yield what is wrong with a value."""
        if self.kind is None:
            if not isinstance(value, self.parts):
                yield self.name, f"must be a table [{self.name}], got {described(value)}"
        elif self.kind is not KeyKind.NAMED:
            if problem := self._problem(value):
                yield self.name, problem
        elif not self.kind.holds(value):
            yield self.name, f"must be a table of numbers, got {described(value)}"
        else:
            for name, number in value:
                if self.key.choices and name not in self.key.choices:
                    problem = f"is not a key of this file{nearest_hint(name, self.key.choices)}"
                elif is_number(number):
                    problem = self.key.range.problem(number)
                else:
                    problem = f"must be a number, got {described(number)}"
                if problem:
                    yield f"{self.name}.{shown(name)}", problem

    def _problem(self, value: Any) -> str | None:  # noqa: ANN401 -- also values of a wrong type
        kind = self.kind or KeyKind.TEXT
        if not kind.holds(value):
            is_reversed = kind is KeyKind.INTERVAL and _is_pair(value)
            should = "not end below its beginning" if is_reversed else f"be a {kind}"
            return f"must {should}, got {described(value)}"
        match kind:
            case KeyKind.TEXT:
                return self.key.text_problem(value)
            case KeyKind.INTEGER | KeyKind.NUMBER:
                return self.key.range.problem(value)
            case KeyKind.INTERVAL:
                return self.key.list_problem((value.low, value.high))
            case KeyKind.NUMBERS:
                return self.key.list_problem(value)
        return None


class InvalidValueError(ValueError):
    """A value that cannot be: ``problems`` holds everything that is wrong with it."""

    def __init__(self, problems: Iterable[Problem]) -> None:
        self.problems = tuple(problems)
        super().__init__("; ".join(f"{key} {problem}" for key, problem in self.problems))


class Part(Value):
    """A value that declares its fields; the text of its class describes its table in a file."""

    def __post_init__(self) -> None:
        held = {name: getattr(self, name) for name in declared(type(self))}
        if problems := [*field_problems(type(self), held)] or [*self.inconsistencies()]:
            raise InvalidValueError(problems)

    def inconsistencies(self) -> Problems:
        """Yield what does not fit together in fields that are right alone."""
        yield from ()


class Draft(SimpleNamespace):
    """What was readable of a part; without attributes, a field that is missing or wrong."""


@lru_cache(maxsize=64)
def declared(part: type[Part]) -> Mapping[str, Field]:
    """Return the fields of a part that declare themselves, by name."""
    names, defaults = part.__struct_fields__, part.__struct_defaults__
    default_of = dict(zip(names[len(names) - len(defaults) :], defaults, strict=True))
    found = {}
    annotations: dict[str, Any] = {}
    for base in reversed(part.__mro__):  # objects, as above: nothing is to be evaluated
        annotations |= vars(base).get("__annotations__", {})
    for name, annotation in annotations.items():
        if not isinstance(annotation, tuple):
            continue
        hint, key = annotation
        types = get_args(hint) if get_origin(hint) in {Union, UnionType} else (hint,)
        may_be_none = type(None) in types
        types = tuple(one for one in types if one is not type(None))
        kind, choice = _KINDS.get(types[0]), None
        if kind is None and issubclass(types[0], StrEnum):
            kind, choice = KeyKind.TEXT, types[0]
            key = Key(key.meaning, choices=tuple(choice))
        found[name] = Field(
            name=name,
            key=key,
            kind=kind,
            choice=choice,
            parts=types if kind is None else (),
            may_be_none=may_be_none,
            default=default_of.get(name, NODEFAULT),
        )
    return found


def read_fields(part: type[Part], raw: Mapping[str, Any]) -> tuple[dict[str, Any], list[Problem]]:
    """Return what a table of TOML gives for the fields that hold no table, and what is wrong with it."""
    held = {
        name: field.from_toml(raw[name])
        for name, field in declared(part).items()
        if field.kind is not None and name in raw
    }
    return held, [*_key_problems(part, raw), *field_problems(part, held)]


def field_problems(part: type[Part], held: Mapping[str, Any]) -> Problems:
    """Yield what is wrong with values of fields, each looked at alone."""
    for name, field in declared(part).items():
        if name in held and not (held[name] is None and field.may_be_none):
            yield from field.problems(held[name])


def _key_problems(part: type[Part], raw: Mapping[str, Any]) -> Problems:
    """Yield the keys of a table that no field knows, and those that are missing."""
    fields = declared(part)
    unknown = [name for name in raw if name not in fields]
    for name in unknown[:_MOST_UNKNOWN_KEYS]:
        yield shown(name), f"is not a key of this file{nearest_hint(name, fields)}"
    if len(unknown) > _MOST_UNKNOWN_KEYS:
        yield "*", f"has {len(unknown)} unknown keys: is this the right file?"
    for name, field in fields.items():
        if field.is_required and name not in raw:
            what = f"the file needs a table [{name}]" if field.kind is None else field.key.meaning
            yield name, f"is missing ({what})"


def length_problems(part: Part, first: str, second: str) -> Problems:
    """Yield the problem of two lists that must have the same length, and do not."""
    one, other = getattr(part, first), getattr(part, second)
    if len(one) != len(other):
        yield second, f"has {quantity.count(len(other), 'value')}, {first} has {len(one)}"


def together_problems(part: Part, first: str, second: str) -> Problems:
    """Yield what is wrong with two lists of which neither means anything alone."""
    missing = [name for name in (first, second) if getattr(part, name) is None]
    if len(missing) == 1:
        [present] = {first, second} - set(missing)
        yield missing[0], f"is missing: {present} is given"
    elif not missing:
        yield from length_problems(part, first, second)


def shown(name: str) -> str:
    """Return a key as messages show it."""
    return shortened(name if name.isprintable() else repr(name))


def _is_pair(value: object) -> bool:
    return isinstance(value, list) and len(value) == 2 and all(map(is_number, value))
