"""Rows of the tables of autopilot parameters: names, units, versions, defaults, limits.

A table is the dataclass of an autopilot's parameters itself: each of its fields is a quantity in
SI, and carries the row that says under which names and units the autopilot knows it.
"""

from __future__ import annotations

import math
from dataclasses import field, fields
from enum import StrEnum
from typing import TYPE_CHECKING, Any, TypeAlias

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping


Version: TypeAlias = tuple[int, int]
"""Major and minor version of a firmware."""

SI_PER_UNIT: Mapping[str, float] = {
    "": 1.0,
    "m": 1.0,
    "cm": 1e-2,
    "km": 1e3,
    "m/s": 1.0,
    "cm/s": 1e-2,
    "m/s²": 1.0,
    "cm/s²": 1e-2,
    "m/s³": 1.0,
    "cm/s³": 1e-2,
    "1/s": 1.0,
    "s": 1.0,
    "ms": 1e-3,
    "deg": math.radians(1.0),
    "cdeg": math.radians(1e-2),
    "deg/s": math.radians(1.0),
    "cdeg/s": math.radians(1e-2),
    "deg/s²": math.radians(1.0),
    "V": 1.0,
    "A": 1.0,
    "mAh": 1e-3,
}
"""SI per unit of a parameter; charge stays in ampere-hours, as on every battery."""


@frozen
class Spelling:
    """A name under which an autopilot knows a quantity, and the unit it counts it in."""

    name: str
    unit: str
    since: Version | None = None
    """First version with this name; ``None`` where it is the oldest known or unknown."""

    def si(self, value: float) -> float:
        """Return a value of this spelling in SI."""
        return value * SI_PER_UNIT[self.unit]


@frozen
class Parameter:
    """One row: everything the planner knows about one parameter."""

    now: Spelling
    formerly: Spelling | None
    """The older name and unit, before ``now.since``."""
    default: float
    """The autopilot's default on a multicopter, in the unit of ``now``."""
    meaning: str
    above: float | None
    """The value in SI must be greater than this."""
    at_least: float | None
    at_most: float | None
    never: float | None
    """A value inside the limits that cannot be meant either."""
    zero_means: tuple[str, float] | None
    """(quantity, factor) that a value of 0 stands for."""

    @property
    def spellings(self) -> tuple[Spelling, ...]:
        """Every spelling, the newest first."""
        return (self.now,) if self.formerly is None else (self.now, self.formerly)

    @property
    def is_choice(self) -> bool:
        """Whether the value is a whole number: a choice, a set of bits, a count."""
        return isinstance(self.default, int)

    def is_possible(self, value_si: float) -> bool:
        """Return whether a value in SI can be meant."""
        return (
            math.isfinite(value_si)
            and (self.above is None or value_si > self.above)
            and (self.at_least is None or value_si >= self.at_least)
            and (self.at_most is None or value_si <= self.at_most)
            and value_si != self.never
            and (not self.is_choice or value_si == round(value_si))
        )


def parameter(
    name: str,
    unit: str,
    default: float,
    meaning: str,
    *,
    since: Version | None = None,
    formerly: tuple[str, str] | None = None,
    above: float | None = None,
    at_least: float | None = None,
    at_most: float | None = None,
    never: float | None = None,
    zero_means: tuple[str, float] | None = None,
) -> Any:  # noqa: ANN401 -- dataclasses type what makes a field as Any too
    """Make a field of a parameters' dataclass together with its row of the table.

    Parameters
    ----------
    name, unit : str
        Newest name, and the unit the autopilot counts it in.
    default : float
        Default on a multicopter, in that unit; an ``int`` makes the parameter a choice.
    meaning : str
        What it is, in a few words.
    since : tuple of int, optional
        First version with this name.
    formerly : tuple of str, optional
        Older name and unit.
    above, at_least, at_most, never : float, optional
        Limits of a value in SI beyond which it cannot be meant, and one it cannot be.
    zero_means : tuple, optional
        (quantity, factor) that a value of 0 stands for.
    """
    now = Spelling(name=name, unit=unit, since=since)
    row = Parameter(
        now=now,
        formerly=None if formerly is None else Spelling(name=formerly[0], unit=formerly[1]),
        default=default,
        meaning=meaning,
        above=above,
        at_least=at_least,
        at_most=at_most,
        never=never,
        zero_means=zero_means,
    )
    default_si = default if row.is_choice else now.si(default)
    return field(default=default_si, metadata={"parameter": row})


def parameter_table(parameters: type) -> dict[str, Parameter]:
    """Return the rows of a parameters' dataclass by quantity, the name of the field."""
    return {
        entry.name: entry.metadata["parameter"]
        for entry in fields(parameters)
        if "parameter" in entry.metadata
    }


class OriginKind(StrEnum):
    """Where the value of a parameter was taken from."""

    FILE = "parameter file"
    MODEL = "vehicle model"
    DEFAULT = "autopilot default"


@frozen
class Origin:
    """Where one value was taken from, so that a result can say it."""

    kind: OriginKind
    name: str
    """Parameter as it is spelled there."""
    source: str = ""
    """The file; empty for defaults."""
    line: int | None = None

    def __str__(self) -> str:
        """Return for example ``WPNAV_SPEED, vehicle.param line 12``."""
        if self.kind is OriginKind.DEFAULT:
            return f"{self.name}, default"
        return f"{self.name}, {self.source}" + ("" if self.line is None else f" line {self.line}")
