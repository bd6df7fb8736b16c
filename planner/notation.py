"""Batteries and winds as users write them: each read and written by the two functions that stand together."""

from __future__ import annotations

import math
import re

from planner.physics.wind import Wind
from planner.quantity import NUMBER, bare_number, exact, mean_of, number_before, sd_of
from planner.setting import Bearing, Number
from planner.units import FASTEST_M_S, MILLIAMPERE_HOURS_PER_AMPERE_HOUR
from planner.vehicle.battery import Battery
from planner.vehicle.pack import CELL_V, LIPO_CELL_V

_LABELLED_CELLS = range(1, 33)
_LEAST_BARE_MAH = 100.0
"""From here on the bare number of 4S5200 is mAh: no pack of a multicopter has 100 Ah in one row."""
_MOST_CHARGE_AH = 1000.0
"""No multicopter carries more; whoever writes 5200Ah means mAh, and would get a GO."""
_MOST_ENERGY_WH = 50_000.0
"""No multicopter carries more, those with a pilot in them included."""


def _matched(pattern: str, text: str) -> re.Match[str] | None:
    return re.fullmatch(pattern, text.strip(), re.IGNORECASE)


def read_battery(text: str) -> Battery:
    """Return the battery of ``5.2Ah@14.8V``, ``5200mAh@4S``, ``4S5200`` or ``77Wh``."""
    text = _as_charge(text)
    charge, _, voltage = text.partition("@")
    charge_mah, charge_ah = number_before(charge, "mAh"), number_before(charge, "Ah")
    cells, voltage_v = number_before(voltage, "S"), number_before(voltage, "V")
    if charge_mah is not None:
        charge_ah = charge_mah / MILLIAMPERE_HOURS_PER_AMPERE_HOUR
    if charge_ah is not None and (cells is not None or voltage_v is not None):
        if charge_ah > _MOST_CHARGE_AH:
            msg = f"expected a battery of at most {_MOST_CHARGE_AH:g} Ah, got {text!r}: is it mAh?"
            raise ValueError(msg)
        if cells is not None:
            voltage_v = _of_cells_v(cells)
        if charge_ah > 0.0 and voltage_v is not None and 0.0 < voltage_v < math.inf:
            return Battery(capacity_ah=charge_ah, nominal_voltage_v=voltage_v)
    if (energy_wh := number_before(text, "Wh")) is not None:
        if energy_wh > _MOST_ENERGY_WH:
            msg = f"expected a battery of at most {_MOST_ENERGY_WH:g} Wh, got {text!r}: is it mWh?"
            raise ValueError(msg)
        if energy_wh > 0.0:
            return Battery(capacity_wh=energy_wh)
    msg = f"expected a battery, such as 5.2Ah@14.8V, 5.2Ah@4S or 77Wh, got {text!r}"
    if _matched(r"[\d.,]+\s*(m?Ah\s*@\s*[\d.,]+\s*[VS]|Wh)", text) and "," in text:
        msg = f"write decimals with a point: {text.replace(',', '.')}, not {text}"
    raise ValueError(msg)


def _as_charge(text: str) -> str:
    """Return what stands on packs, ``4S5200`` or ``4S 5.2Ah``, as charge and cells; other text as it is.

    A voltage beside the cells has to be theirs, and is what counts: ``4S5200@15.2V``.
    """
    if "s" not in text.lower():
        return text  # most are no such text: no expression is compiled
    found = _matched(rf"(\d+)S\s*{NUMBER}\s*(m?Ah)?(?:\s*@\s*{NUMBER}\s*V)?", text)
    if found is None:
        return text
    bare = "mAh" if float(found[2]) >= _LEAST_BARE_MAH else "Ah"
    charge = f"{found[2]}{found[3] or bare}"
    if found[4] is None:
        return f"{charge}@{found[1]}S"
    cells_v = _of_cells_v(float(found[1]))
    low, high = (of_cell_v / LIPO_CELL_V * cells_v for of_cell_v in CELL_V)
    if not low <= float(found[4]) <= high:
        msg = (
            f"{found[1]} cells in series have {low:.1f} to {high:.1f} V, not {found[4]} V: correct one of "
            f"them in {text!r}"
        )
        raise ValueError(msg)
    return f"{charge}@{found[4]}V"


def _of_cells_v(count: float) -> float:
    """Return the nominal voltage of cells in series; raise ``ValueError`` for a count of no battery. [V]"""
    if count not in _LABELLED_CELLS:
        msg = f"expected a battery of 1 to {_LABELLED_CELLS[-1]} cells in series, got {count:g}"
        raise ValueError(msg)
    return count * LIPO_CELL_V


def battery_text(battery: Battery) -> str:
    """Return ``5.2Ah@14.8V`` or ``77Wh``; raise ``ValueError`` for a battery that says more."""
    if battery.capacity_wh is not None:
        return f"{exact(battery.capacity_wh)}Wh"
    if battery.capacity_ah is None or battery.nominal_voltage_v is None:
        msg = "battery: no option describes this battery"
        raise ValueError(msg)
    return f"{exact(battery.capacity_ah)}Ah@{exact(battery.nominal_voltage_v)}V"


_WIND = (Number("m/s", 0.0, FASTEST_M_S, with_spread=True), Bearing(with_spread=True))
"""Its speed, and the direction it blows from."""


def read_wind(text: str) -> Wind:
    """Return the wind of ``5@270``, 5 m/s from west, ``10kt@W``, or with deviations ``5±2@270±20``."""
    if bare_number(text.strip()) == 0.0:
        return Wind()
    try:
        speed_m_s, from_deg = (
            kind.read(side) for kind, side in zip(_WIND, text.split("@"), strict=True)
        )
    except ValueError as error:
        reason = f": {error}" if text.count("@") == 1 else f", got {text!r}"
        msg = (
            "expected speed and the direction it blows from, such as 5@270, 10kt@W or 5±2@270±20"
            f"{reason}"
        )
        raise ValueError(msg) from error
    return Wind(
        speed_m_s=mean_of(speed_m_s),
        from_deg=mean_of(from_deg),
        speed_sd_m_s=sd_of(speed_m_s),
        from_sd_deg=sd_of(from_deg),
    )


def wind_text(wind: Wind) -> str:
    """Return ``5@270`` or ``5±2@270±20``; its profile is another setting."""
    sides = ((wind.speed_m_s, wind.speed_sd_m_s), (wind.from_deg, wind.from_sd_deg))
    return "@".join(exact(mean) + (f"±{exact(sd)}" if sd else "") for mean, sd in sides)


def read_wind_profile(text: str) -> Wind:
    """Return a still air that has the profile of ``power:0.2@10m`` or ``log:0.03m@10m``."""
    if found := _matched(rf"power\s*:\s*{NUMBER}\s*@\s*{NUMBER}\s*m?", text):
        return Wind(shear_exponent=float(found[1]), reference_height_m=float(found[2]))
    if found := _matched(rf"log\s*:\s*{NUMBER}\s*m?\s*@\s*{NUMBER}\s*m?", text):
        return Wind(roughness_length_m=float(found[1]), reference_height_m=float(found[2]))
    msg = (
        "expected power:EXPONENT@HEIGHT or log:ROUGHNESS@HEIGHT, such as power:0.2@10m or "
        f"log:0.03m@10m, got {text!r}"
    )
    raise ValueError(msg)


def wind_profile_text(wind: Wind) -> str:
    """Return ``power:0.2@10`` or ``log:0.03@10``."""
    height = exact(wind.reference_height_m or 0.0)
    if wind.shear_exponent is not None:
        return f"power:{exact(wind.shear_exponent)}@{height}"
    return f"log:{exact(wind.roughness_length_m or 0.0)}@{height}"
