"""The arguments of the library's use cases: what is of a wrong type is refused by a sentence."""

from __future__ import annotations

import math
import sys
from typing import TYPE_CHECKING

import numpy as np

from planner.errors import UsageError
from planner.flight.budget import Reserve

if TYPE_CHECKING:
    from collections.abc import Mapping

_TYPES = {
    "mission": ("planner.mission.items", "Mission", "planner.read_mission(path)"),
    "vehicle": ("planner.vehicle.model", "VehicleModel", "planner.load_vehicle(name)"),
    "battery": (
        "planner.vehicle.battery",
        "Battery",
        "planner.Battery(capacity_ah=…, nominal_voltage_v=…)",
    ),
    "charge": ("planner.flight.conditions", "Spread", "a number, or planner.Spread(mean=…, sd=…)"),
    "reserve": ("planner.flight.budget", "Reserve", "a number, or planner.Reserve(energy_wh=…)"),
    "wind": ("planner.physics.wind", "Wind", "planner.Wind(speed_m_s=…, from_deg=…)"),
    "payload_kg": (
        "planner.flight.conditions",
        "Spread",
        "a number, or planner.Spread(mean=…, sd=…)",
    ),
    "temperature_c": (
        "planner.flight.conditions",
        "Spread",
        "a number, or planner.Spread(mean=…, sd=…)",
    ),
    "autopilot": ("planner.autopilot", "Autopilot", "planner.Autopilot.PX4, for example"),
    "parameters": (
        "planner.vehicle.parameters.files",
        "ParameterSet",
        "planner.vehicle.parameters.files.read_parameters(path)",
    ),
    "terrain": ("planner.geo.terrain", "TerrainGrid", "planner.geo.terrain.read_terrain(path)"),
    "target": ("planner.autopilot", "Target", "planner.Target(planner.Autopilot.PX4)"),
    "profile": ("planner.site_profile", "SiteProfile", "planner.read_profile(path)"),
    "selection": ("planner.selection", "Selection", "planner.Selection(ignore=…)"),
    "fail_on": ("planner.findings", "Severity", "planner.Severity.WARNING, for example"),
    "with_trace": ("builtins", "bool", "True or False"),
}
"""Module and name of the class of an argument, and how to come by one."""
_ALSO_NUMBERS = frozenset({"charge", "reserve", "payload_kg", "temperature_c"})
_NUMBERS = (int, float, np.integer, np.floating)
_REQUIRED = frozenset(
    {
        "mission",
        "vehicle",
        "charge",
        "reserve",
        "risk",
        "payload_kg",
        "reaction_time_s",
        "position_error_m",
        "clearance_m",
        "fail_on",
        "with_trace",
        "separation_m",
        "min_nav_alt_m",
        "start_error_s",
        "starts_s",
    }
)
"""What cannot be ``None``."""


def refuse_wrong_types(arguments: Mapping[str, object]) -> None:
    """Refuse arguments that are of another type than a use case takes.

    Parameters
    ----------
    arguments : mapping of str to object
        By name; what has no class of its own is a number.

    Raises
    ------
    UsageError
        If one is, or if a number is not finite; it says what to give.
    """
    for name, value in arguments.items():
        if value is None and name not in _REQUIRED:
            continue
        module, wanted, example = _TYPES.get(name, ("", "", "a number"))
        # A class whose module nobody has loaded yet has no instances.
        kind = getattr(sys.modules.get(module), wanted, None)
        if kind is not None and isinstance(value, kind):
            continue
        takes_number = not wanted or name in _ALSO_NUMBERS
        if takes_number and isinstance(value, _NUMBERS) and not isinstance(value, bool):
            if math.isfinite(value):
                continue
            msg = f"{name} must be a finite number, got {value!r}"
            raise UsageError(msg)
        msg = f"{name} must be {example}: got {_shown(value)}"
        raise UsageError(msg)


def refuse_out_of_range(*, clearance_m: float, **shares: float) -> None:
    """Refuse shares that are none, and a clearance below the ground.

    Raises
    ------
    UsageError
        If a value is out of its range.
    """
    for name, fraction in shares.items():
        if not 0.0 <= fraction <= 1.0:
            msg = f"{name} must be a fraction from 0 to 1, got {fraction}"
            raise UsageError(msg)
    if clearance_m < 0.0:
        msg = f"clearance_m must be zero or more, got {clearance_m}"
        raise UsageError(msg)


def reserve_of(given: float | Reserve) -> Reserve:
    """Return a reserve that may be given as a share of the capacity.

    Raises
    ------
    UsageError
        If it is no share.
    """
    if isinstance(given, Reserve):
        return given
    try:
        return Reserve(fraction=float(given))
    except ValueError as error:
        msg = f"reserve must be a fraction from 0 to 1, got {given}"
        raise UsageError(msg) from error


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else f"a {type(value).__name__}"
