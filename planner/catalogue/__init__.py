"""The catalogue of rules, one module per family.

A code is stable: never renumbered, never reused.
"""

from __future__ import annotations

from importlib import import_module
from pkgutil import iter_modules
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
    "V": "the vehicle on the line",
    "W": "wind",
    "X": "the tool itself",
}
"""What the first letter of a code says."""


def rules() -> Mapping[str, Rule]:
    """Return every rule of every family by its code, in the order of the codes.

    Raises
    ------
    ValueError
        If two rules share a code or a name: a mistake in the catalogue itself.
    """
    found: dict[str, Rule] = {}
    for module in iter_modules(__path__):
        for value in vars(import_module(f"{__name__}.{module.name}")).values():
            if isinstance(value, Rule):
                if value.code in found:
                    msg = f"two rules share the code {value.code}"
                    raise ValueError(msg)
                found[value.code] = value
    names = {rule.name for rule in found.values()}
    if len(names) != len(found):
        msg = "two rules share a name"
        raise ValueError(msg)
    return dict(sorted(found.items()))
