"""One thing that two missions do not have in common, and when two numbers say the same."""

from __future__ import annotations

import math
from enum import StrEnum

from planner.autopilot import Autopilot
from planner.frozen import frozen

_PLACE_DIGITS = 7
_CENTIMETRE_M = 0.0101
"""ArduPilot keeps altitudes in whole centimetres. [m]"""
_YAW_DEG = 0.01
"""PX4 keeps headings in radians. [°]"""
_RELATIVE = 1e-6
"""A number of four bytes has 24 bits."""


class DifferenceKind(StrEnum):
    """What a difference means for the flight."""

    CHANGED = "changed"
    MISSING = "missing"
    """In the first mission only."""
    ADDED = "added"
    """In the second mission only."""
    STORED = "stored"
    """As the autopilot stores it: rounded by a known rule, which a check reckons with."""
    UNUSED = "unused"
    """A value the autopilot does not keep, and does not fly by."""


@frozen
class Difference:
    """One thing that two missions do not have in common."""

    part: str
    """``mission``, ``fence`` or ``rally``."""
    number: int | None
    """Item, area or point, from 1, of the mission that has it."""
    field: str
    """What differs; empty where the whole is missing or added."""
    first: float | str | None
    second: float | str | None
    kind: DifferenceKind
    message: str
    """One sentence."""

    @property
    def matters(self) -> bool:
        """Whether another flight may come of it."""
        return self.kind not in {DifferenceKind.STORED, DifferenceKind.UNUSED}


def whole_difference(part: str, number: int | None, kind: DifferenceKind, what: str) -> Difference:
    """Return that the whole of something is in one mission only."""
    where = "missing" if kind is DifferenceKind.MISSING else "in the second one only"
    return Difference(
        part=part,
        number=number,
        field="",
        first=None,
        second=None,
        kind=kind,
        message=f"{what} is {where}",
    )


def place_key(value: float | None) -> int | None:
    """Return degrees as MAVLink counts them; equal where two places are."""
    return None if value is None else round(value * 10**_PLACE_DIGITS)


def is_same_number(
    first: float | None,
    second: float | None,
    autopilot: Autopilot | None,
    *,
    is_yaw: bool = False,
) -> bool:
    """Return whether two numbers say the same to an autopilot."""
    if first is None or second is None:
        # To ArduPilot a value that is not specified is 0; PX4 flies another way then.
        is_zero_none = autopilot is Autopilot.ARDUPILOT
        return first is second or (is_zero_none and not first and not second)
    if is_yaw:
        return abs(math.remainder(first - second, 360.0)) <= _YAW_DEG
    return is_close(first, second)


def is_same_altitude(
    first: float | None, second: float | None, autopilot: Autopilot | None
) -> bool:
    """Return whether two altitudes [m] say the same to an autopilot."""
    if first is not None and second is not None and autopilot is Autopilot.ARDUPILOT:
        return abs(first - second) <= _CENTIMETRE_M
    return is_same_number(first, second, autopilot)


def is_close(first: float, second: float) -> bool:
    """Return whether two numbers are one in the four bytes that MAVLink has for them."""
    return math.isclose(first, second, rel_tol=_RELATIVE, abs_tol=1e-9)


def shown(value: float | str | bool | None) -> str:  # noqa: FBT001 - a value to show
    """Return a value for a sentence."""
    if value is None:
        return "not specified"
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else f"{value:.10g}"
