"""Profiles: what a site, a club or an operation asks of every mission and vehicle, in TOML.

=============  ==================================================================
table          holds
=============  ==================================================================
``site``       place, greatest distance from it and height above home, items that
               every mission must have
``expect``     ``params``: values of the vehicle's parameters, in their own units: a
               number, ``[lowest, highest]``, or ``{value = …, tolerance = …}``
``manual``     what a person has to look at before take-off, texts by section:
               ``Airframe = ["Propellers tight", "Battery strapped"]``
=============  ==================================================================
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from planner.errors import ProfileFileError, described, is_number, nearest_hint
from planner.files import read_bounded, toml_document
from planner.mission.commands import load_command_table
from planner.values import Value
from planner.vehicle.declared import POSITIVE, Annotated, Key, Part, Range, read_fields

MOST_BYTES = 1 << 20
_TABLES = ("site", "expect", "manual")
_SINGLE_PRECISION = 1e-6
"""Vehicles hold 7 digits of a number."""


class ExpectedValue(Value, kw_only=False):
    """The values of one parameter that are as they should be, in its own unit."""

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        """Return ``3000``, or ``13.8 to 14.4``."""
        return " to ".join(f"{value:.6g}" for value in dict.fromkeys((self.low, self.high)))

    def holds(self, value: float) -> bool:
        """Return whether a value is as expected, to the digits a vehicle holds."""
        slack = _SINGLE_PRECISION * max(abs(self.low), abs(self.high))
        return self.low - slack <= value <= self.high + slack


class ManualItem(Value):
    """One thing a person has to look at."""

    section: str
    prompt: str


class Site(Part):
    """Where the missions of a profile fly; ``None`` and empty where it does not ask."""

    latitude_deg: Annotated[float | None, Key("place of the site", "°", Range(-90.0, 90.0))] = None
    longitude_deg: Annotated[float | None, Key("place of the site", "°", Range(-180.0, 180.0))] = (
        None
    )
    max_distance_m: Annotated[
        float | None, Key("greatest distance from the site, else from home", "m", POSITIVE)
    ] = None
    max_height_above_home_m: Annotated[
        float | None, Key("greatest height of the flight", "m", POSITIVE)
    ] = None
    required_items: Annotated[
        tuple[str, ...], Key("commands every mission must have, without MAV_CMD_")
    ] = ()


class SiteProfile(Site):
    """What a profile asks for."""

    source: str
    expected: tuple[ExpectedValue, ...] = ()
    manual: tuple[ManualItem, ...] = ()


def read_profile(path: str | Path) -> SiteProfile:
    """Read a profile.

    Raises
    ------
    ProfileFileError
        If the file cannot be read, or holds a wrong key or value.
    """
    source = str(path)
    document = _document(Path(path), source)
    problems = [
        f"{name} is not a table of a profile{nearest_hint(name, _TABLES)}"
        for name in document
        if name not in _TABLES
    ]
    site, expect = document.get("site", {}), document.get("expect", {})
    if not isinstance(site, dict) or not isinstance(expect, dict):
        msg = "site and expect must be tables"
        raise ProfileFileError(msg, source=source)
    values, site_problems = read_fields(Site, site)
    problems += [f"site.{key} {problem}" for key, problem in site_problems]
    if ("latitude_deg" in site) is not ("longitude_deg" in site):
        problems.append("site needs latitude_deg and longitude_deg, or neither of them")
    problems += [
        f"expect.{name} is not a table of a profile" for name in expect if name != "params"
    ]
    params = expect.get("params", {})
    if not isinstance(params, dict):
        problems.append(f"expect.params must be a table, got {described(params)}")
        params = {}
    expected = []
    for name, raw in params.items():
        interval = _interval(raw)
        if interval is None:
            problems.append(
                f"expect.params.{name} must be a number, [lowest, highest] or "
                f"{{value = …, tolerance = …}}, got {described(raw)}"
            )
        else:
            expected.append(ExpectedValue(name, *interval))
    manual, manual_problems = _manual(document.get("manual", {}))
    problems += manual_problems
    if problems:
        raise ProfileFileError("; ".join(problems[:5]), source=source)
    values["required_items"] = _commands(values.get("required_items", ()), source)
    return SiteProfile(source=source, expected=tuple(expected), manual=manual, **values)


def _document(path: Path, source: str) -> Mapping[str, Any]:
    data = read_bounded(path, most_bytes=MOST_BYTES, error=ProfileFileError, what="profile")
    return toml_document(data, source=source, error=ProfileFileError, what="profile")


def _manual(raw: Any) -> tuple[tuple[ManualItem, ...], list[str]]:  # noqa: ANN401 - whatever TOML holds
    """Return what a person has to look at, and what is wrong with how it is written."""
    if not isinstance(raw, dict):
        return (), [f"manual must be a table of sections, got {described(raw)}"]
    items, problems = [], []
    for section, prompts in raw.items():
        if isinstance(prompts, list) and all(isinstance(one, str) and one for one in prompts):
            items += [ManualItem(section=section, prompt=prompt) for prompt in prompts]
        else:
            problems.append(f"manual.{section} must be a list of texts, got {described(prompts)}")
    return tuple(items), problems


def _interval(raw: Any) -> tuple[float, float] | None:  # noqa: ANN401 - whatever TOML holds
    """Return lowest and highest of an expected value as TOML holds it; ``None`` if it is none."""
    match raw:
        case {"value": value, **others} if set(others) <= {"tolerance"}:
            tolerance: Any = others.get("tolerance", 0.0)
            if is_number(value) and is_number(tolerance) and tolerance >= 0.0:
                return value - tolerance, value + tolerance
        case [low, high] if is_number(low) and is_number(high) and low <= high:
            return float(low), float(high)
        case int() | float() if is_number(raw):
            return float(raw), float(raw)
    return None


def _commands(names: tuple[str, ...], source: str) -> tuple[str, ...]:
    known = {definition.name for definition in load_command_table().commands.values()}
    bare = tuple(name.strip().upper().removeprefix("MAV_CMD_") for name in names)
    for name in bare:
        if name not in known:
            msg = f"site.required_items: there is no command {name}{nearest_hint(name, known)}"
            raise ProfileFileError(msg, source=source)
    return bare
