"""Quantities as people read and write them: numbers into text, and text into numbers.

Three significant digits, as far as a pilot reads them; a value that is not zero is never printed
as zero, and a shortfall never loses its sign.  ``None`` is a dash.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.units import MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping


ABSENT = "—"
NUMBER = r"([+-]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[+-]?\d+)?)"
"""A number as people and TOML write it."""
PLUS_MINUS = r"±|\+/?-|~"


_SLOW_M_S, _STANDING_M_S = 0.05, 1e-3
"""Below the first a tenth of a metre a second is none, below the second it is what rounding leaves."""
_MOST_IN_FULL = 1e9
"""From here on nothing a vehicle flies, and no digit of it is worth reading."""


def energy(energy_wh: float | None) -> str:
    """Return an energy in Wh: ``24.1 Wh``."""
    return _three_digits(energy_wh, "Wh")


def charge(charge_mah: float | None) -> str:
    """Return a charge in mAh: ``1630 mAh``."""
    return _whole(charge_mah, "mAh")


def charge_of_ah(charge_ah: float) -> str:
    """Return a charge, given in Ah, as parameters and labels state it: ``1630 mAh``."""
    return charge(MILLIAMPERE_HOURS_PER_AMPERE_HOUR * charge_ah)


def power(power_w: float | None) -> str:
    """Return a power in W: ``131 W``."""
    return _whole(power_w, "W")


def voltage(voltage_v: float | None) -> str:
    """Return a voltage in V: ``14.8 V``."""
    return ABSENT if voltage_v is None else f"{decimals(voltage_v, 1)} V"


def distance(distance_m: float | None) -> str:
    """Return a distance in m, from a kilometre in km: ``432 m``, ``4.32 km``."""
    if distance_m is None or not math.isfinite(distance_m):
        return ABSENT
    if abs(distance_m) < 999.5:
        return height(distance_m)
    return _three_digits(distance_m / 1000.0, "km")


def height(height_m: float | None) -> str:
    """Return a height or a change of height in m: ``120 m``, ``2.5 m``."""
    if height_m is None or not math.isfinite(height_m):
        return ABSENT
    return f"{decimals(height_m, 1 if 0.0 < abs(height_m) < 9.95 else 0)} m"


def speed(speed_m_s: float | None) -> str:
    """Return a speed in m/s: ``5.0 m/s``, below 0.05 ``0.03 m/s``; of 1 mm/s and less nobody speaks."""
    if speed_m_s is None:
        return ABSENT
    if _STANDING_M_S < abs(speed_m_s) < _SLOW_M_S:
        return f"{speed_m_s:.1g} m/s"
    return f"{decimals(speed_m_s, 1)} m/s"


def bearing(bearing_deg: float | None) -> str:
    """Return a bearing as three digits: ``270°``, north is ``000°``."""
    if bearing_deg is None or not math.isfinite(bearing_deg):
        return ABSENT
    return f"{round(bearing_deg) % 360:03d}°"


def temperature(temperature_c: float | None) -> str:
    """Return a temperature: ``15 °C``."""
    return _whole(temperature_c, "°C")


def mass(mass_kg: float | None) -> str:
    """Return a mass in kg: ``0.50 kg``."""
    return _three_digits(mass_kg, "kg")


def percent(fraction: float | None) -> str:
    """Return a fraction as a percentage: ``31 %``, below ten ``4.2 %``."""
    if fraction is None or not math.isfinite(fraction):
        return ABSENT
    value = 100.0 * fraction
    if 0.0 < abs(value) < 0.05:
        return "< 0.1 %" if value > 0.0 else "> -0.1 %"
    text = decimals(value, 1 if abs(value) < 9.95 else 0)
    return f"{text.removesuffix('.0')} %"


def charge_left(fraction: float | None) -> str:
    """Return a fraction of the charge that is left; none where more is drawn than there was."""
    return percent(None if fraction is None else max(fraction, 0.0))


def chance(probability: float | None) -> str:
    """Return a chance as a percentage that is never none and never sure: ``3.1 %``."""
    if probability is not None and probability < 0.001:
        return "< 0.1 %"
    if probability is not None and probability > 0.999:
        return "> 99.9 %"
    return percent(probability)


def duration(duration_s: float | None) -> str:
    """Return a duration: ``4.2 s``, ``32 s``, ``11 min 32 s``, ``1 h 05 min 32 s``."""
    if duration_s is None or not math.isfinite(duration_s):
        return ABSENT
    if abs(duration_s) < 9.95:
        return f"{decimals(duration_s, 1)} s"
    if abs(duration_s) >= _MOST_IN_FULL:
        return f"{decimals(duration_s, 0)} s"
    sign = "-" if duration_s < 0.0 else ""
    minutes, seconds = divmod(round(abs(duration_s)), 60)
    hours, minutes = divmod(minutes, 60)
    if hours:
        return f"{sign}{hours} h {minutes:02d} min {seconds:02d} s"
    if minutes:
        return f"{sign}{minutes} min {seconds:02d} s"
    return f"{sign}{seconds} s"


def clock(duration_s: float | None) -> str:
    """Return a time since the start: ``14:21``, ``1:02:05``."""
    if duration_s is None or not math.isfinite(duration_s) or abs(duration_s) >= _MOST_IN_FULL:
        return ABSENT
    minutes, seconds = divmod(round(duration_s), 60)
    hours, minutes = divmod(minutes, 60)
    return f"{hours}:{minutes:02d}:{seconds:02d}" if hours else f"{minutes}:{seconds:02d}"


def decimals(value: float | None, digits: int) -> str:
    """Return a bare number with so many decimals, for columns whose head names the unit."""
    if value is None or not math.isfinite(value):
        return ABSENT
    if abs(value) >= _MOST_IN_FULL:
        return f"{value:.3g}"
    text = f"{value:.{digits}f}"
    return text.removeprefix("-") if float(text) == 0.0 else text


def beside(value: float, limit: float, shown: Callable[[float], str]) -> str:
    """Return a value beside its limit: ``just over 60 m`` where both would read the same."""
    text = shown(value)
    if value == limit or text != shown(limit):
        return text
    return f"just {'over' if value > limit else 'under'} {text}"


def signed(value: float | None, shown: Callable[[float | None], str]) -> str:
    """Return a difference with its sign: ``+5.20 Wh``, ``-12 s``; none where it rounds to nothing."""
    text = shown(value)
    is_more = value is not None and value > 0.0 and text[0].isdecimal()
    return f"+{text}" if is_more and any(one in "123456789" for one in text) else text


def count(number: float, noun: str, plural: str | None = None) -> str:
    """Return a number of things: ``1 error``, ``2 errors``, ``0.5 turns``, ``3 vertices``."""
    text = number if isinstance(number, int) else f"{number:g}"
    return f"{text} {noun if number == 1 else plural or f'{noun}s'}"


def _three_digits(value: float | None, unit: str) -> str:
    if value is None or not math.isfinite(value):
        return ABSENT
    if 0.0 < abs(value) < 0.005:
        return f"< 0.01 {unit}" if value > 0.0 else f"> -0.01 {unit}"
    digits = 2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0
    return f"{decimals(value, digits)} {unit}"


def _whole(value: float | None, unit: str) -> str:
    return f"{decimals(value, 0)} {unit}" if value is not None else ABSENT


class Spread(Value):
    """A normally distributed quantity, for example a payload of 0.5 ± 0.1 kg."""

    mean: float
    sd: float
    """Standard deviation. [unit of the mean]"""

    def __post_init__(self) -> None:
        if not (math.isfinite(self.mean) and math.isfinite(self.sd) and self.sd >= 0.0):
            msg = f"a spread is a number ± zero or more, got {self.mean} ± {self.sd}"
            raise ValueError(msg)


def bare_number(text: str) -> float | None:
    """Return the number of a text that is a `NUMBER` and nothing else; ``None`` of any other."""
    if not all(one.isdecimal() or one in "+-.eE" for one in text):
        return None  # what Python reads and people do not write: 1_000, nan, spaces
    try:
        return float(text)
    except ValueError:
        return None


def number_before(text: str, unit: str) -> float | None:
    """Return the number of ``5 Ah``, which ends in a unit in any case; ``None`` of any other text."""
    text = text.strip()
    number, end = text[: len(text) - len(unit)], text[len(text) - len(unit) :]
    return bare_number(number.rstrip()) if end.lower() == unit.lower() else None


def read_number(text: str, *, unit: str = "") -> float:
    """Return the number of ``15``, or with its unit ``15C`` or ``15 °C``; case does not matter."""
    for own in ("", unit, f"°{unit}"):
        if (number := number_before(text, own)) is not None:
            return number
    shown = "°C" if unit == "C" else unit
    msg = f"expected a number{f' in {shown}' if unit else ''}, got {text!r}"
    raise ValueError(msg)


def read_in(text: str, units: Mapping[str, float]) -> float:
    """Return the number of ``500g`` in the unit that counts 1; a bare number is in it already.

    ``units`` are what each unit's 1 is in that unit; case does not matter.
    """
    for unit, factor in ({"": 1.0} | dict(units)).items():
        if (number := number_before(text, unit)) is not None:
            return number * factor
    point = ": decimals are written with a point" if "," in text else ""
    msg = f"expected a number in {', '.join(units)}, got {text!r}{point}"
    raise ValueError(msg)


def read_fraction(text: str) -> float:
    """Return the fraction of ``20%`` or ``0.2``; a bare ``1`` is refused: 1 % or all of it?"""
    bare = text.strip()
    if (percent := number_before(bare, "%")) is not None:
        value = percent / 100.0
    elif (number := bare_number(bare)) is not None:
        value = number
        if value >= 1.0 and bare != "1.0":
            msg = f"{text!r} is ambiguous: write {bare}%, or a fraction below 1 such as 0.2"
            raise ValueError(msg)
    else:
        msg = f"expected a percentage or fraction, such as 20% or 0.2, got {text!r}"
        raise ValueError(msg)
    if not 0.0 <= value <= 1.0:
        msg = f"expected 0% to 100%, got {text!r}"
        raise ValueError(msg)
    return value


def exact(value: float) -> str:
    """Return a number as the shortest text that reads back as the same number."""
    return f"{value:g}" if float(f"{value:g}") == value else repr(float(value))


def exact_percent(fraction: float) -> str:
    """Return a fraction as a percentage, where that reads back as the same fraction."""
    percent = float(f"{100.0 * fraction:.10g}")
    if percent / 100.0 == fraction:
        return f"{exact(percent)}%"
    return "1.0" if fraction == 1.0 else exact(fraction)


def mean_of(value: float | Spread) -> float:
    """Return the mean of a quantity, which is itself where it is known exactly."""
    return value.mean if isinstance(value, Spread) else value


def sd_of(value: float | Spread | None) -> float:
    """Return the standard deviation of a quantity, zero where it is known exactly or not at all."""
    return value.sd if isinstance(value, Spread) else 0.0
