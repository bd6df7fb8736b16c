"""The catalogue: every rule, wherever it is declared.

A code is stable: never renumbered, never reused.
"""

from __future__ import annotations

import json
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from planner.findings import Rule

if TYPE_CHECKING:
    from collections.abc import Mapping

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
MODULES = (
    "planner.rules.altitude",
    "planner.rules.energy",
    "planner.rules.failsafe",
    "planner.rules.feasibility",
    "planner.rules.fence",
    "planner.rules.model",
    "planner.rules.site",
    "planner.rules.stop_buffer",
    "planner.rules.structure",
    "planner.rules.terrain",
    "planner.catalogue.altitude",
    "planner.catalogue.energy",
    "planner.catalogue.fence",
    "planner.catalogue.flight_log",
    "planner.catalogue.identification",
    "planner.catalogue.loader",
    "planner.catalogue.loader_text",
    "planner.catalogue.loader_writer",
    "planner.catalogue.mission",
    "planner.catalogue.parameter",
    "planner.catalogue.swarm",
    "planner.catalogue.time",
    "planner.catalogue.tool",
    "planner.catalogue.vehicle",
    "planner.catalogue.verification",
    "planner.catalogue.wind",
)
"""Where rules are declared: beside what reports them, imported only to list them."""


@cache
def rules() -> Mapping[str, Rule]:
    """Return every rule by its code, in the order of the codes."""
    found = [
        value
        for module in MODULES
        for value in vars(import_module(module)).values()
        if isinstance(value, Rule)
    ]
    return {rule.code: rule for rule in sorted(found, key=lambda rule: rule.code)}


@cache
def examples() -> Mapping[str, str]:
    """Return a message of each rule by its code, as tests/rule_examples.py records it.

    The codes are known from here without importing the rules.
    """
    text = (Path(__file__).parent / "examples.json").read_text(encoding="utf-8")
    known: Mapping[str, str] = json.loads(text)
    return known
