"""The figures of a data sheet: how they are written, and what they mean."""

from __future__ import annotations

import math
import re
from enum import StrEnum

from planner import quantity
from planner.quantity import NUMBER, read_in
from planner.units import GRAVITY_M_S2, MASS_UNITS_KG
from planner.values import Value

_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": 0.0254, '"': 0.0254}


class HoverKind(StrEnum):
    """What a figure of the hover is."""

    CURRENT = "A"
    POWER = "W"
    TIME = "min"
    LONGEST = "min max"
    """Advertised longest flight time: flown forward, at the speed of least power."""
    THROTTLE = "%"

    @property
    def label(self) -> str:
        """What it is, in words."""
        return _LABELS[self]


_LABELS = {
    HoverKind.CURRENT: "hover current",
    HoverKind.POWER: "hover power",
    HoverKind.TIME: "hover time",
    HoverKind.LONGEST: "longest flight time",
    HoverKind.THROTTLE: "hover throttle",
}


class HoverFigure(Value):
    """One figure of the hover, in the unit of its kind; a throttle as a fraction."""

    kind: HoverKind
    value: float

    @property
    def prior(self) -> str:
        """Name of the prior of what it is off by."""
        return f"hover_{self.kind.name.lower()}"

    def __str__(self) -> str:
        """Return the text it is read from: ``18A``, ``260W``, ``22min``, ``25min max``, ``38%``."""
        shown = 100.0 * self.value if self.kind is HoverKind.THROTTLE else self.value
        return f"{quantity.exact(shown)}{self.kind}"


class MotorTable(Value):
    """Full throttle of one motor with its propeller, as in the table of its maker."""

    thrust_n: float
    power_w: float


def read_mass(text: str) -> float:
    """Return the mass of ``3.5``, ``3.5kg``, ``3500g`` or ``7.7lb``. [kg]"""
    return _above_0(read_in(text, MASS_UNITS_KG), "mass", text)


def read_propeller(text: str) -> float:
    """Return the diameter of ``10in``, ``254mm`` or ``0.254m``; a bare number of 3 and more is inches. [m]"""
    found = re.fullmatch(NUMBER, text.strip())
    if found and float(found[1]) >= 3.0:
        return float(found[1]) * _LENGTH_UNITS["in"]
    return _above_0(read_in(text, _LENGTH_UNITS), "diameter", text)


def read_hover(text: str) -> HoverFigure:
    """Return the figure of ``18A``, ``260W``, ``22min``, ``25min max`` or ``38%``."""
    found = re.fullmatch(rf"{NUMBER}\s*(A|W|min|min\s*max|%)", text.strip(), re.IGNORECASE)
    if found is None:
        msg = (
            "expected a current, power, hover time, longest flight time or throttle: 18A, 260W, 22min, "
            f"25min max or 38%, got {text!r}"
        )
        raise ValueError(msg)
    unit = re.sub(r"\s*max", " max", found[2].lower())
    kind = next(one for one in HoverKind if one.lower() == unit)
    value = _above_0(float(found[1]), "figure of the hover", text)
    if kind is not HoverKind.THROTTLE:
        return HoverFigure(kind=kind, value=value)
    if value >= 100.0:
        msg = f"a hover throttle is below 100 %, got {text!r}"
        raise ValueError(msg)
    return HoverFigure(kind=kind, value=value / 100.0)


def read_motor(text: str) -> MotorTable:
    """Return thrust and power of ``1250g@310W``, one motor at full throttle."""
    thrust, at, power = text.partition("@")
    if not at:
        msg = f"expected one motor at full throttle, such as 1250g@310W, got {text!r}"
        raise ValueError(msg)
    thrust_kg, power_w = read_mass(thrust), read_in(power, {"W": 1.0})
    return MotorTable(thrust_n=thrust_kg * GRAVITY_M_S2, power_w=_above_0(power_w, "power", text))


def _above_0(value: float, what: str, text: str) -> float:
    if not 0.0 < value < math.inf:
        msg = f"a {what} is above 0, got {text!r}"
        raise ValueError(msg)
    return value
