"""Quantities as people write them on a command line: ``5.2Ah@14.8V``, ``20%``, ``5@270``.

What is not known exactly is a mean and a standard deviation: ``5±2@270±20``, or ``5+-2@270+-20``.

Each function returns a value, or raises ``ValueError`` with one sentence that says what to write.
"""

from __future__ import annotations

import re
from typing import TYPE_CHECKING

from planner.flight.budget import Reserve
from planner.flight.conditions import (
    Conditions,
    Spread,
    joined,
)
from planner.physics.wind import Wind
from planner.units import MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Callable

_NUMBER = r"([+-]?(?:\d+\.?\d*|\.\d+)(?:e[+-]?\d+)?)"
_CHARGE_AND_VOLTAGE = re.compile(rf"{_NUMBER}\s*(m?)Ah\s*@\s*{_NUMBER}\s*V", re.IGNORECASE)
_ENERGY = re.compile(rf"{_NUMBER}\s*Wh", re.IGNORECASE)
_MINUTES = re.compile(rf"{_NUMBER}\s*min", re.IGNORECASE)
_PERCENT = re.compile(rf"{_NUMBER}\s*%", re.IGNORECASE)
_PLAIN = re.compile(_NUMBER, re.IGNORECASE)
_POWER_PROFILE = re.compile(rf"power\s*:\s*{_NUMBER}\s*@\s*{_NUMBER}\s*m?", re.IGNORECASE)
_LOG_PROFILE = re.compile(rf"log\s*:\s*{_NUMBER}\s*m?\s*@\s*{_NUMBER}\s*m?", re.IGNORECASE)
_GIVE_OR_TAKE = re.compile(r"±|\+/?-")
_WIND_SPEED = re.compile(rf"{_NUMBER}\s*(?:m/s)?", re.IGNORECASE)
_BEARING = re.compile(rf"{_NUMBER}\s*°?")

_FASTEST_M_S = 100.0
"""No multicopter is faster."""
_MOST_CHARGE_AH = 1000.0
"""No multicopter carries more; whoever writes 5200Ah means mAh, and would be told 'go'."""
_MOST_ENERGY_WH = 50_000.0
"""No multicopter carries more, those with a pilot in them included."""
_HEAVIEST_KG = 1000.0
"""No multicopter lifts more."""
_FARTHEST_M = 10_000.0
_LATEST_START_S = 86_400.0


def battery(text: str) -> Battery:
    """Return the battery of ``5.2Ah@14.8V``, ``5200mAh@14.8V`` or ``77Wh``."""
    if found := _CHARGE_AND_VOLTAGE.fullmatch(text.strip()):
        charge_ah, voltage_v = float(found[1]), float(found[3])
        if found[2]:
            charge_ah /= MILLIAMPERE_HOURS_PER_AMPERE_HOUR
        if charge_ah > _MOST_CHARGE_AH:
            msg = f"{text!r} is more charge than any multicopter carries: is it mAh?"
            raise ValueError(msg)
        _refuse_not_positive(text, charge_ah, voltage_v)
        return Battery(capacity_ah=charge_ah, nominal_voltage_v=voltage_v)
    if found := _ENERGY.fullmatch(text.strip()):
        energy_wh = float(found[1])
        _refuse_not_positive(text, energy_wh)
        if energy_wh > _MOST_ENERGY_WH:
            msg = f"{text!r} is more energy than any multicopter carries: is it mWh?"
            raise ValueError(msg)
        return Battery(capacity_wh=energy_wh)
    msg = f"{text!r} is no battery: write charge and voltage, 5.2Ah@14.8V, or energy, 77Wh"
    raise ValueError(msg)


def fraction(text: str) -> float:
    """Return the fraction of ``20%`` or ``0.2``.

    A bare ``1`` is refused: it may mean 1 % or all of it.
    """
    if found := _PERCENT.fullmatch(text.strip()):
        value = float(found[1]) / 100.0
    elif _PLAIN.fullmatch(text.strip()):
        value = float(text)
        if value >= 1.0 and text.strip() != "1.0":
            msg = f"{text!r} is ambiguous: write {text.strip()}%, or a fraction below 1 such as 0.2"
            raise ValueError(msg)
    else:
        msg = f"{text!r} is no share: write 20% or 0.2"
        raise ValueError(msg)
    if not 0.0 <= value <= 1.0:
        msg = f"{text!r} is out of range: 0% to 100%"
        raise ValueError(msg)
    return value


def reserve(text: str) -> float | Reserve:
    """Return the reserve of ``20%``, ``12Wh``, or ``3min`` of hover; a number is a share."""
    if found := _ENERGY.fullmatch(text.strip()):
        given = float(found[1])
        unit = Reserve(energy_wh=given) if given >= 0.0 else None
    elif found := _MINUTES.fullmatch(text.strip()):
        given = float(found[1])
        unit = Reserve(hover_s=60.0 * given) if given >= 0.0 else None
    else:
        try:
            return fraction(text)
        except ValueError as error:
            if _PERCENT.fullmatch(text.strip()) or _PLAIN.fullmatch(text.strip()):
                raise
            msg = f"{text!r} is no reserve: write a share, 20%, energy, 12Wh, or hover, 3min"
            raise ValueError(msg) from error
    if unit is None:
        msg = f"{text!r} is out of range: a reserve is zero or more"
        raise ValueError(msg)
    return unit


def wind(text: str) -> Wind:
    """Return the wind of ``5@270``: 5 m/s from west."""
    if _PLAIN.fullmatch(text.strip()) and float(text) == 0.0:
        return Wind()
    parts = [_GIVE_OR_TAKE.split(part.strip()) for part in text.split("@")]
    found = [
        [form.fullmatch(one.strip()) for one in part]
        for form, part in zip((_WIND_SPEED, _BEARING), parts, strict=False)
    ]
    numbers = [[float(one[1]) for one in part if one is not None] for part in found]
    if (
        len(parts) != 2
        or any(None in part for part in found)
        or any(len(part) > 2 for part in parts)
    ):
        msg = (
            f"{text!r} is no wind: write speed in m/s and the direction it blows from, 5@270, "
            "or 5±2@270±20"
        )
        raise ValueError(msg)
    (speed_m_s, speed_sd_m_s), (from_deg, from_sd_deg) = (
        (part[0], part[1] if len(part) == 2 else 0.0) for part in numbers
    )
    if not 0.0 <= speed_m_s <= 100.0 or not 0.0 <= speed_sd_m_s <= 100.0:
        msg = f"{text!r} is out of range: the speed of the wind is 0 to 100 m/s"
        raise ValueError(msg)
    if not 0.0 <= from_deg <= 360.0 or not 0.0 <= from_sd_deg <= 360.0:
        msg = f"{text!r} is out of range: the wind blows from 0 to 360°"
        raise ValueError(msg)
    return Wind(
        speed_m_s=speed_m_s,
        from_deg=from_deg,
        speed_sd_m_s=speed_sd_m_s,
        from_sd_deg=from_sd_deg,
    )


def wind_profile(text: str) -> Wind:
    """Return a still air that has the profile of ``power:0.2@10m`` or ``log:0.03m@10m``."""
    if found := _POWER_PROFILE.fullmatch(text.strip()):
        return Wind(shear_exponent=float(found[1]), reference_height_m=float(found[2]))
    if found := _LOG_PROFILE.fullmatch(text.strip()):
        return Wind(roughness_length_m=float(found[1]), reference_height_m=float(found[2]))
    msg = (
        f"{text!r} is no wind profile: write power:EXPONENT@HEIGHT, power:0.2@10m, or "
        "log:ROUGHNESS@HEIGHT, log:0.03m@10m, with the height the wind is given for"
    )
    raise ValueError(msg)


def charge(text: str) -> float | Spread:
    """Return the state of charge of ``95%``, ``0.95`` or ``95±2%``."""
    share, sd = _give_or_take(text, unit="%", read=fraction)
    return joined(share, sd)


def payload_kg(text: str) -> float | Spread:
    """Return the mass of ``0.5``, ``0.5kg`` or ``0.5±0.1``."""
    mass_kg, sd_kg = _give_or_take(text, unit="kg", read=lambda one: _number(one, unit="kg"))
    if mass_kg > _HEAVIEST_KG:
        msg = (
            f"{text!r} must be at most {_HEAVIEST_KG:g} kg, no multicopter lifts more: is it grams?"
        )
        raise ValueError(msg)
    # refuses what is less than nothing
    return Conditions(payload_kg=mass_kg, payload_sd_kg=sd_kg).payload_spread_kg


def home_amsl_m(text: str) -> float:
    """Return the altitude of ``488`` or ``488m``."""
    altitude_amsl_m = _number(text, unit="m")
    Conditions(home_amsl_m=altitude_amsl_m)  # refuses what is no place on Earth
    return altitude_amsl_m


def speed_m_s(text: str) -> float:
    """Return the speed of ``8`` or ``8m/s``."""
    return _above_zero_to(_FASTEST_M_S, text, unit="m/s")


def clearance_m(text: str) -> float:
    """Return the height of ``10`` or ``10m``."""
    return _up_to(1000.0, text, unit="m")


def temperature_c(text: str) -> float | Spread:
    """Return the temperature of ``-5``, ``-5C`` or ``15±5``."""
    air_c, sd_c = _give_or_take(text, unit="C", read=lambda one: _number(one, unit="C"))
    Conditions(temperature_c=air_c, temperature_sd_c=sd_c)  # refuses what is no weather on Earth
    return joined(air_c, sd_c)


def battery_health(text: str) -> float:
    """Return the share of ``85%`` or ``0.85``."""
    health = fraction(text)
    Conditions(battery_health=health)  # refuses a battery that holds nothing
    return health


def battery_resistance_factor(text: str) -> float:
    """Return the factor of ``1.5``."""
    factor = _number(text, unit="times")
    Conditions(battery_resistance_factor=factor)  # refuses what no battery has
    return factor


def battery_temperature_c(text: str) -> float:
    """Return the temperature of ``5`` or ``5C``."""
    battery_c = _number(text, unit="C")
    Conditions(battery_temperature_c=battery_c)  # refuses what no battery is used at
    return battery_c


def position_noise_m(text: str) -> float:
    """Return the length of ``0.3`` or ``0.3m``."""
    noise_m = _number(text, unit="m")
    Conditions(position_noise_m=noise_m)  # refuses what PX4 would stand still with
    return noise_m


def reaction_time_s(text: str) -> float:
    """Return the time of ``1.5`` or ``1.5s``."""
    time_s = _number(text, unit="s")
    Conditions(reaction_time_s=time_s)  # refuses what nobody waits
    return time_s


def position_error_m(text: str) -> float:
    """Return the length of ``2.5`` or ``2.5m``."""
    error_m = _number(text, unit="m")
    Conditions(position_error_m=error_m)  # refuses what is no position
    return error_m


def separation_m(text: str) -> float:
    """Return the distance of ``5`` or ``5m``."""
    return _above_zero_to(_FARTHEST_M, text, unit="m")


def min_nav_alt_m(text: str) -> float:
    """Return the height of ``2.5`` or ``2.5m``."""
    return _up_to(_FARTHEST_M, text, unit="m")


def start_s(text: str) -> float:
    """Return the time of ``30`` or ``30s``."""
    return _up_to(_LATEST_START_S, text, unit="s")


def starts_s(text: str) -> tuple[float, ...]:
    """Return the times of ``0,10,20``."""
    return tuple(map(start_s, text.split(",")))


def _give_or_take(text: str, *, unit: str, read: Callable[[str], float]) -> tuple[float, float]:
    """Return a quantity and its standard deviation, zero where none is given."""
    parts = [part.strip() for part in _GIVE_OR_TAKE.split(text)]
    if len(parts) == 1:
        return read(text), 0.0
    if len(parts) > 2 or not all(parts):
        msg = f"{text!r}: write a value and its standard deviation, such as 5±2"
        raise ValueError(msg)
    if parts[1].endswith(unit) and not parts[0].endswith(unit):
        parts[0] += unit  # 95±2% is 95 % ± 2 %
    mean, sd = map(read, parts)
    if sd < 0.0:
        msg = f"{text!r}: a standard deviation is not negative"
        raise ValueError(msg)
    return mean, sd


def _number(text: str, *, unit: str) -> float:
    found = re.fullmatch(rf"{_NUMBER}\s*(?:°?{unit})?", text.strip(), re.IGNORECASE)
    if found is None:
        msg = f"{text!r} is no number of {unit}"
        raise ValueError(msg)
    return float(found[1])


def _up_to(most: float, text: str, *, unit: str) -> float:
    value = _number(text, unit=unit)
    if not 0.0 <= value <= most:
        msg = f"{text!r} is out of range: 0 to {most:g} {unit}"
        raise ValueError(msg)
    return value


def _above_zero_to(most: float, text: str, *, unit: str) -> float:
    value = _number(text, unit=unit)
    if not 0.0 < value <= most:
        msg = f"{text!r} is out of range: above 0 and at most {most:g} {unit}"
        raise ValueError(msg)
    return value


def _refuse_not_positive(text: str, *values: float) -> None:
    if not all(0.0 < value < float("inf") for value in values):
        msg = f"{text!r} is out of range: a battery has more than nothing"
        raise ValueError(msg)
