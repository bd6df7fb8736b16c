"""The catalogue: every rule, wherever it is declared.

A code is stable: never renumbered, never reused.
"""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

import msgspec

from planner.findings import Rule
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping


class Entry(Value):
    """What tests/generate_catalogue.py records of a rule."""

    name: str
    module: str
    """Where it is declared: beside what reports it."""
    example: str
    """A message of it, as its case in the tests makes it."""
    severity: str = "info"
    """As declared; a finding may be milder or worse."""
    instead: str = ""
    """What to give instead of ignoring it; where that is named, no setting switches its errors off."""
    leaves_open: bool = False
    """Whether it fires where something could not be checked."""


FAMILIES: Mapping[str, str] = {
    "A": "altitude and terrain",
    "E": "energy and the model",
    "F": "fence and rally points",
    "I": "identification",
    "L": "loaders and writers",
    "M": "mission structure",
    "P": "parameters",
    "R": "records of flights",
    "S": "several vehicles",
    "T": "time and items",
    "V": "the vehicle on the link",
    "W": "wind",
    "X": "the tool itself",
}
"""What the first letter of a code means."""
PX4_EVENTS: Mapping[str, str] = {
    "navigator_mis_no_home_rel_alt": "M107",
    "navigator_mis_unsup_cmd": "M105",
    "navigator_mis_vtol_items": "M105",
    "navigator_mis_starts_w_landing": "M108",
    "navigator_mis_starts_w_landing2": "M108",
    "navigator_mis_takeoff_too_low": "A106",
    "navigator_mis_takeoff_not_first": "M101",
    "navigator_mis_takeoff_missing": "M116",
    "navigator_mis_land_missing": "M116",
    "navigator_mis_takeoff_or_land_missing": "M116",
    "navigator_mis_add_land_or_rm_to": "M116",
    "navigator_mis_add_to_or_rm_land": "M116",
    "feasibility_mis_in_air_landing_req": "M116",
    "navigator_mis_first_wp_far": "M104",
    "navigator_mis_first_wp_too_far": "M104",
    "navigator_mis_wp_gate_too_close": "M119",
    # Landing patterns are checked on fixed-wing and VTOL vehicles only.
    "navigator_mis_approach_wp_below_land": "M111",
    "navigator_mis_land_wp_inside_orbit_radius": "M111",
    "navigator_mis_unsupported_landing_approach_wp": "M111",
    "navigator_mis_glide_slope_too_steep": "M111",
    "navigator_mis_correct_glide_slope": "M111",
    "navigator_mis_multiple_land": "M111",
    "navigator_mis_land_before_rtl": "M111",
    "navigator_mis_invalid_land": "M111",
    "navigator_mis_do_jump_invalid": "M103",
    "navigator_mis_geofence_violation": "F101",
    "navigator_mis_geofence_path_violation": "F101",
    "navigator_mis_geofence_jump_breach": "F101",
    "navigator_mis_geofence_loiter_breach": "F107",
    "navigator_mis_geofence_no_home": "F104",
    "navigator_mis_geofence_no_home2": "F104",
    "navigator_geofence_invalid_against_home": "F104",
}
"""Code of the rule by the name of PX4's event about the same: ``events::ID`` in FeasibilityChecker.cpp and
the geofence checks, 1.14 to early 2026."""


@cache
def entries() -> Mapping[str, Entry]:
    """Return where each rule is declared, by its code: known without importing the rules."""
    text = Path(__file__).with_suffix(".json").read_bytes()
    return msgspec.json.decode(text, type=dict[str, Entry])


def kept_on() -> Mapping[str, str]:
    """Return what to give instead of ignoring a rule, by the codes that cannot be ignored."""
    return {
        code: entry.instead
        for code, entry in entries().items()
        if entry.instead and entry.severity == "error"
    }


@cache
def rule(code: str) -> Rule:
    """Return a rule by its code."""
    # At once: a warning of numpy in another thread adds to what a module holds (__warningregistry__).
    declared = tuple(vars(import_module(entries()[code].module)).values())
    return next(one for one in declared if isinstance(one, Rule) and one.code == code)


def rules() -> Mapping[str, Rule]:
    """Return every rule by its code, in the order of the codes."""
    return {code: rule(code) for code in entries()}


def events_of(code: str) -> tuple[str, ...]:
    """Return PX4's events about what a rule reports."""
    return tuple(event for event, rule in PX4_EVENTS.items() if rule == code)
