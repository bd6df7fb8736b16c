"""The figures of a data sheet: how they are written, and what they mean."""

from __future__ import annotations

import math
import re
from enum import StrEnum

from planner import quantity
from planner.quantity import NUMBER, read_in
from planner.units import GRAVITY_M_S2, MASS_UNITS_KG
from planner.values import Value

_INCH_M = 0.0254
_LENGTH_UNITS = {"m": 1.0, "cm": 1e-2, "mm": 1e-3, "in": _INCH_M, "inch": _INCH_M, '"': _INCH_M}
_BARE_INCHES = (3.0, 40.0)
"""What a bare number is taken for inches between; 1045 is the code of a propeller of 10 x 4.5 in."""
_HEAVIEST_KG = 1000.0
_ROTORS = (3, 16)


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
    mass_kg = _above_0(read_in(text, MASS_UNITS_KG), "mass", text)
    if mass_kg > _HEAVIEST_KG:
        msg = f"{text!r} is {quantity.exact(mass_kg)} kg: write grams as {quantity.exact(mass_kg)}g"
        raise ValueError(msg)
    return mass_kg


def read_rotors(text: str) -> int:
    """Return the number of rotors, 3 to 16."""
    low, high = _ROTORS
    if not re.fullmatch("[0-9]{1,2}", text.strip()) or not low <= int(text) <= high:
        msg = f"expected {low} to {high} rotors, two on one arm counted as two, got {text!r}"
        raise ValueError(msg)
    return int(text)


def read_propeller(text: str) -> float:
    """Return the diameter of ``10in``, ``10x4.5``, ``254mm`` or ``0.254m``. [m]

    A bare number of 3 to 40 is in inches, and so is the first of two, which are diameter and pitch.
    """
    with_pitch = re.fullmatch(
        rf"{NUMBER}\s*x\s*{NUMBER}(?:\s*(?:in|inch|\"))?", text.strip(), re.IGNORECASE
    )
    bare = with_pitch or re.fullmatch(NUMBER, text.strip())
    inches = float(bare[1]) if bare else 0.0
    low, high = _BARE_INCHES
    if inches > high:
        msg = f"{text!r} is not a diameter in inches: write it as 10in, 10x4.5 or 254mm"
        raise ValueError(msg)
    if inches >= low or with_pitch:
        return _above_0(inches * _INCH_M, "diameter", text)
    return _above_0(read_in(text, _LENGTH_UNITS), "diameter", text)


def read_hover(text: str) -> HoverFigure:
    """Return the figure of ``18A``, ``260W``, ``4kW``, ``22min``, ``25min max`` or ``38%``."""
    found = re.fullmatch(rf"{NUMBER}\s*(A|k?W|min|min\s*max|%)", text.strip(), re.IGNORECASE)
    if found is None:
        msg = (
            "expected a current, power, hover time, longest flight time or throttle: 18A, 260W, 22min, "
            f"25min max or 38%, got {text!r}"
        )
        raise ValueError(msg)
    unit = re.sub(r"\s*max", " max", found[2].lower())
    kind = next(one for one in HoverKind if one.lower() == unit.removeprefix("k"))
    thousands = 1000.0 if unit.startswith("k") else 1.0
    value = _above_0(thousands * float(found[1]), "figure of the hover", text)
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
        msg = f"a {what} is above 0 and finite, got {text!r}"
        raise ValueError(msg)
    return value
