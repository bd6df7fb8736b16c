"""Values of settings as text that reads back as the same value."""

from __future__ import annotations

import os
from enum import Enum
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.autopilot import TARGETS, Target
from planner.findings import Severity
from planner.flight.budget import Reserve
from planner.flight.conditions import Spread
from planner.physics.wind import Wind
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

_SHARES = frozenset({"charge", "reserve", "risk", "battery_health"})


def setting_text(key: str, value: object) -> str:
    """Return a value as one writes it on the command line; its setting reads the same value back.

    Raises
    ------
    ValueError
        If no text of an option says this value.
    """
    if key == "wind_profile" and isinstance(value, Wind):
        return _profile(value)
    if isinstance(value, int | float) and not isinstance(value, bool | Enum):
        return _scalar(key, value)
    if isinstance(value, Spread):
        return f"{_scalar(key, value.mean)}±{_scalar(key, value.sd)}"
    for kind, text_of in _TEXTS.items():
        if isinstance(value, kind):
            return text_of(value)
    msg = f"{key}: no option says {value!r}"
    raise ValueError(msg)


def option_arguments(option: str, key: str, value: object) -> list[str]:
    """Return the words of a command line that set a value."""
    if isinstance(value, tuple) and all(isinstance(one, Path) for one in value):
        return [word for one in value for word in (option, str(one))]
    return [option, setting_text(key, value)]


def command_text(words: Sequence[str]) -> str:
    """Return words as one types them in the shell of this system."""
    if os.name == "nt":
        import subprocess

        return subprocess.list2cmdline(words)
    import shlex

    return shlex.join(words)


def _exact(value: float) -> str:
    return f"{value:g}" if float(f"{value:g}") == value else repr(float(value))


def _scalar(key: str, value: float) -> str:
    if key not in _SHARES:
        return _exact(value)
    percent = float(f"{100.0 * value:.10g}")
    return f"{_exact(percent)}%" if percent / 100.0 == value else _share(value)


def _share(value: float) -> str:
    return "1.0" if value == 1.0 else _exact(value)


def _wind(wind: Wind) -> str:
    parts = ((wind.speed_m_s, wind.speed_sd_m_s), (wind.from_deg, wind.from_sd_deg))
    return "@".join(_exact(mean) + (f"±{_exact(sd)}" if sd else "") for mean, sd in parts)


def _profile(wind: Wind) -> str:
    if wind.shear_exponent is not None:
        kind, figure = "power", wind.shear_exponent
    else:
        kind, figure = "log", wind.roughness_length_m or 0.0
    return f"{kind}:{_exact(figure)}@{_exact(wind.reference_height_m or 0.0)}"


def _reserve(reserve: Reserve) -> str:
    if reserve.energy_wh is not None:
        return f"{_exact(reserve.energy_wh)}Wh"
    if reserve.hover_s is not None:
        return f"{_exact(reserve.hover_s / 60.0)}min"
    return _scalar("reserve", reserve.fraction or 0.0)


def _battery(battery: Battery) -> str:
    if battery.capacity_wh is not None:
        return f"{_exact(battery.capacity_wh)}Wh"
    if battery.capacity_ah is None or battery.nominal_voltage_v is None:
        msg = "battery: no option says this battery"
        raise ValueError(msg)
    return f"{_exact(battery.capacity_ah)}Ah@{_exact(battery.nominal_voltage_v)}V"


_TEXTS: dict[type, Callable[[Any], str]] = {
    Wind: _wind,
    Reserve: _reserve,
    Battery: _battery,
    Target: lambda target: next(name for name, one in TARGETS.items() if one == target),
    Severity: lambda severity: severity.label,
    str: str,
    Path: str,
    tuple: lambda several: ",".join(str(one) for one in several),
}
"""How values of each type are written; an autopilot is its own text."""
