"""Autopilot parameters as values: a field is a quantity in SI, its default the row that declares it.

A row says under which names and units the autopilot knows the quantity, by version of the firmware,
its default and the range in which it can be meant.
"""

from __future__ import annotations

import math
from enum import StrEnum
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

from planner.values import Value, force_setattr
from planner.vehicle.declared import ANY, Range

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
    "1/s": 1.0,
    "1/s²": 1.0,
    "s": 1.0,
    "ms": 1e-3,
    "deg": math.radians(1.0),
    "cdeg": math.radians(1e-2),
    "deg/s": math.radians(1.0),
    "cdeg/s": math.radians(1e-2),
    "deg/s²": math.radians(1.0),
    "cdeg/s²": math.radians(1e-2),
    "V": 1.0,
    "A": 1.0,
    "ohm": 1.0,
    "mAh": 1e-3,
}
"""SI per unit of a parameter; charge stays in ampere-hours, as on every battery."""


_MOST_SI = 1e7
"""No time, way or speed of a flight is more: 116 days, the way from the equator to a pole."""


class Spelling(Value):
    """A name under which an autopilot knows a quantity, and the unit it counts it in."""

    name: str
    unit: str = ""
    since: Version | None = None
    """First version with this name; ``None`` where it is the oldest known or unknown."""

    def si(self, value: float) -> float:
        """Return a value of this spelling in SI."""
        return value * SI_PER_UNIT[self.unit]


class Parameter(Value):
    """One row: everything the planner knows about one parameter."""

    now: Spelling
    formerly: Spelling | None
    """The older name and unit, before ``now.since``."""
    default: float
    """The autopilot's default on a multicopter, in the unit of ``now``."""
    range: Range
    """In which a value in SI can be meant."""
    never: float | None
    """A value inside the range that cannot be meant either."""
    zero_means: tuple[str, float] | None
    """(quantity, factor) whose value a 0 means."""
    zero_meant: tuple[Version, float] | None
    """(version, factor) of a firmware to which a 0 means another factor."""
    usual: float
    """A usual value in the unit of ``now``: the default, where that is not 0."""
    earlier: tuple[tuple[Version, float], ...] = ()
    """(first version without it, default) of older firmware, the oldest first."""

    @property
    def spellings(self) -> tuple[Spelling, ...]:
        """Every spelling, the newest first."""
        return (self.now,) if self.formerly is None else (self.now, self.formerly)

    @property
    def is_choice(self) -> bool:
        """Whether the value is a whole number: a choice, a set of bits, a count."""
        return isinstance(self.default, int)

    @property
    def default_si(self) -> float:
        """The default in SI."""
        return self.in_si(self.default)

    def in_si(self, value: float) -> float:
        """Return a value in the unit of ``now`` in SI; a choice stays as it is."""
        return value if self.is_choice else self.now.si(value)

    def default_of(self, version: Version | None) -> float:
        """Return the default of a version, in the unit of ``now``; of the newest where none is known."""
        if version is None:
            return self.default
        return next((older for before, older in self.earlier if version < before), self.default)

    def spelling_of(self, version: Version | None) -> Spelling:
        """Return the name a version knows the quantity by; the newest where none is known."""
        since = self.now.since
        is_old = version is not None and since is not None and version < since
        return self.formerly if is_old and self.formerly is not None else self.now

    def is_possible(self, value_si: float) -> bool:
        """Return whether a value in SI can be meant."""
        return (
            math.isfinite(value_si)
            and (self.is_choice or abs(value_si) <= _MOST_SI)
            and self.range.problem(value_si) is None
            and value_si != self.never
            and (not self.is_choice or value_si == round(value_si))
        )


def parameter(
    name: str,
    default: float,
    range: Range = ANY,  # noqa: A002 - as the field
    *,
    formerly: str = "",
    since: Version | None = None,
    never: float | None = None,
    zero_means: tuple[str, float] | None = None,
    zero_meant: tuple[Version, float] | None = None,
    usual: float | None = None,
    earlier: tuple[tuple[Version, float], ...] = (),
) -> Any:  # noqa: ANN401 -- a default of a number
    """Make the row of a field; a name is followed by its unit: ``WP_SPD m/s``.

    A default that is an ``int`` makes the parameter a choice.  ``formerly`` is the name before the
    version ``since``, ``usual`` a value that is, where the default is 0, ``earlier`` the defaults of older
    firmware, each with the first version that has it no more.
    """
    spelt, unit, *_ = f"{name} ".split(" ")
    old, old_unit, *_ = f"{formerly} ".split(" ")
    return Parameter(
        now=Spelling(name=spelt, unit=unit, since=since),
        formerly=Spelling(name=old, unit=old_unit) if formerly else None,
        default=default,
        range=range,
        never=never,
        zero_means=zero_means,
        zero_meant=zero_meant,
        usual=default if usual is None else usual,
        earlier=earlier,
    )


class AutopilotParameters(Value, eq=False):
    """The parameters of an autopilot in SI; without arguments its defaults.

    Where a 0 means another parameter, the value that flies is filled in.
    """

    origins: Mapping[str, Origin] = {}
    """Where the value of each quantity comes from; a quantity not in it has its default."""

    def __post_init__(self) -> None:
        table = parameter_table(type(self))
        for quantity, row in table.items():
            if getattr(self, quantity) is row:
                force_setattr(self, quantity, row.default_si)
        for quantity, row in table.items():
            if row.zero_means is not None and getattr(self, quantity) == 0.0:
                other, factor = row.zero_means
                force_setattr(self, quantity, factor * getattr(self, other))

    def overwrite(self, by: str, quantity: str, value: float) -> None:
        """Set a quantity while the value is being made, with the origin of what governs it."""
        force_setattr(self, quantity, value)
        origins = {name: origin for name, origin in self.origins.items() if name != quantity}
        if by in self.origins:
            origins[quantity] = self.origins[by]
        force_setattr(self, "origins", origins)

    def __eq__(self, other: object) -> bool:
        """Return whether the same values are flown, wherever they come from."""
        return type(other) is type(self) and all(
            getattr(self, quantity) == getattr(other, quantity)
            for quantity in parameter_table(type(self))
        )

    def __hash__(self) -> int:
        """Return the hash of the values."""
        return hash(tuple([getattr(self, quantity) for quantity in parameter_table(type(self))]))


@lru_cache(maxsize=8)
def parameter_table(parameters: type[AutopilotParameters]) -> Mapping[str, Parameter]:
    """Return the rows of an autopilot's parameters by quantity, the name of the field."""
    names, defaults = parameters.__struct_fields__, parameters.__struct_defaults__
    return {
        name: row for name, row in zip(names, defaults, strict=True) if isinstance(row, Parameter)
    }


@lru_cache(maxsize=8)
def parameter_names(parameters: type[AutopilotParameters]) -> frozenset[str]:
    """Return the names of an autopilot's parameters that are read, as all of its versions spell them."""
    rows = parameter_table(parameters).values()
    return frozenset(one.name for row in rows for one in row.spellings)


class OriginKind(StrEnum):
    """Where the value of a parameter was taken from."""

    FILE = "parameter file"
    MODEL = "vehicle model"
    DEFAULT = "autopilot default"


class Origin(Value):
    """Where one value was taken from, so that a result can say it."""

    kind: OriginKind
    name: str
    """Parameter as it is spelled there."""
    source: str = ""
    """The file; empty for defaults."""
    line: int | None = None

    @property
    def is_file(self) -> bool:
        """Whether it was given."""
        return self.kind is OriginKind.FILE

    @property
    def is_default(self) -> bool:
        """Whether nothing says it."""
        return self.kind is OriginKind.DEFAULT

    def __str__(self) -> str:
        """Return for example ``WPNAV_SPEED, vehicle.param line 12``."""
        if self.is_default:
            return f"{self.name}, default"
        return f"{self.name}, {self.source}" + ("" if self.line is None else f" line {self.line}")
