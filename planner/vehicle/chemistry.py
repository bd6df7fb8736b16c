"""Kinds of cell: named curves a battery may be made of, as data under models/chemistries."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from planner.frozen import frozen
from planner.vehicle.battery_schema import CHEMISTRY
from planner.vehicle.shipped import models_root

if TYPE_CHECKING:
    from collections.abc import Mapping

SCHEMA_VERSION = 1


@frozen
class Chemistry:
    """One kind of cell."""

    name: str
    """Also the stem of its file."""
    description: str
    source: str
    ocv_soc: tuple[float, ...]
    """States of charge from 0 to 1, rising. [-]"""
    cell_ocv_v: tuple[float, ...]
    """Open-circuit voltage of a cell at each. [V]"""
    resistance_temperature_c: tuple[float, ...] | None = None
    """Temperatures, rising. [°C]"""
    resistance_factor: tuple[float, ...] | None = None
    """Resistance at each temperature over that at the usual one. [-]"""

    def __post_init__(self) -> None:
        CHEMISTRY.refuse(self)


def chemistry_names() -> tuple[str, ...]:
    """Return the names of the shipped kinds of cell, sorted."""
    return tuple(sorted(path.stem for path in (models_root() / "chemistries").glob("*.toml")))


@lru_cache(maxsize=16)
def load_chemistry(name: str) -> Chemistry:
    """Load a shipped kind of cell.

    Raises
    ------
    ValueError
        If its file is not as it must be: a mistake in what is shipped.
    """
    path = models_root() / "chemistries" / f"{name}.toml"
    document: dict[str, Any] = tomllib.loads(path.read_text(encoding="utf-8"))
    version = document.pop("schema", None)
    problems = CHEMISTRY.problems(document)
    if version != SCHEMA_VERSION or problems or document["name"] != name:
        msg = f"{path.name}: schema {version}, name {document.get('name')!r}, {problems}"
        raise ValueError(msg)
    return Chemistry(**CHEMISTRY.cleaned(document))


def with_chemistry(battery: Mapping[str, Any]) -> dict[str, Any]:
    """Return the values of a battery with the curves of its chemistry, where it gives none itself.

    Parameters
    ----------
    battery : mapping
        Values by their keys, as a model file holds them; those needed here are right.

    Returns
    -------
    dict
        The same, with the curves of the whole battery.
    """
    chemistry = load_chemistry(battery["chemistry"])
    values = dict(battery)
    if not {"ocv_soc", "ocv_v"} & set(values):
        values["ocv_soc"] = chemistry.ocv_soc
        values["ocv_v"] = tuple(
            volts * battery["cells_in_series"] for volts in chemistry.cell_ocv_v
        )
    curve = {"resistance_temperature_c", "resistance_factor"}
    if not curve & set(values):
        values |= {key: value for key in curve if (value := getattr(chemistry, key)) is not None}
    return values
