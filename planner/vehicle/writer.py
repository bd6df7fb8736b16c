"""Writer of model files: what it writes, the strict reader reads back as the same model."""

from __future__ import annotations

import datetime as dt
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.files import write_output_file
from planner.vehicle.battery_schema import BATTERY
from planner.vehicle.keys import Interval
from planner.vehicle.law_tables import cruise_table, hover_table
from planner.vehicle.power_schema import LOADS, VERTICAL
from planner.vehicle.ramp_schema import RAMPS
from planner.vehicle.reader import vehicle_from_toml
from planner.vehicle.response_schema import RESPONSE_TABLES
from planner.vehicle.schema import (
    FIT,
    PARAMETERS,
    PROVENANCE,
    SCHEMA_VERSION,
    SPEED,
    TOP,
    VALID_FOR,
    VERSION,
)
from planner.vehicle.spread_schema import SPREAD, STATE_SPREAD

if TYPE_CHECKING:
    from collections.abc import Iterable, Sequence

    from planner.vehicle.keys import Table
    from planner.vehicle.model import VehicleModel

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_WIDEST = 96
"""Longer lists are broken over several lines."""


def write_vehicle(path: str | Path, vehicle: VehicleModel, *, remarks: Sequence[str] = ()) -> None:
    """Write a model file, whole or not at all.

    Parameters
    ----------
    path : str or Path
        The file; its stem must be the name of the model.
    vehicle : VehicleModel
        The model.
    remarks : sequence of str
        Comments at the top of the file, a line each.

    Raises
    ------
    UsageError
        If the file is not called like the model.
    OutputError
        If the file cannot be written.
    """
    path = Path(path)
    if path.name != f"{vehicle.name}.toml":
        msg = (
            f"a model called {vehicle.name} stands in a file {vehicle.name}.toml, not {path.name}: "
            "name both the same"
        )
        raise UsageError(msg)
    text = vehicle_text(vehicle, remarks=remarks)
    read = vehicle_from_toml(text.encode(), name=vehicle.name, source=vehicle.source)
    if replace(read, source=vehicle.source) != vehicle:  # people fly on what is read, not on this
        msg = f"{vehicle.name} is not read back as it was written"
        raise AssertionError(msg)
    write_output_file(path, text)


def vehicle_text(vehicle: VehicleModel, *, remarks: Sequence[str] = ()) -> str:
    """Return a model as the text of its file.

    Parameters
    ----------
    vehicle : VehicleModel
        The model.
    remarks : sequence of str
        Comments at the top, a line each.

    Returns
    -------
    str
        TOML, every number with all of its digits.
    """
    blocks = [_comments(remarks)] if remarks else []
    blocks.append([f"{VERSION.name} = {SCHEMA_VERSION}", *_lines(TOP, vehicle)])
    if vehicle.default_speed_m_s is not None:
        blocks.append(_block(SPEED, {"default_m_s": vehicle.default_speed_m_s}))
    blocks += [
        _block(hover_table(vehicle.hover, vehicle.cruise), vehicle.hover),
        *(
            _block(table, response)
            for name, table in RESPONSE_TABLES.items()
            if (response := getattr(vehicle.responses, name)) is not None
        ),
        _block(cruise_table(vehicle.cruise), vehicle.cruise),
    ]
    optional = (
        (RAMPS, vehicle.ramps),
        (VERTICAL, vehicle.vertical),
        (LOADS, vehicle.loads),
        (BATTERY, vehicle.battery),
    )
    blocks += [_block(table, value) for table, value in optional if value is not None]
    if vehicle.parameters:
        blocks.append(_free_block(PARAMETERS, vehicle.parameters))
    blocks += [_block(VALID_FOR, vehicle.valid_for), _block(PROVENANCE, vehicle.provenance)]
    if vehicle.spread is not None:
        blocks.append(_block(SPREAD, vehicle.spread))
        if vehicle.spread.energy_state_fraction:
            blocks.append(_free_block(STATE_SPREAD, vehicle.spread.energy_state_fraction))
    if vehicle.provenance.fit:
        blocks.append(_free_block(FIT, vehicle.provenance.fit))
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _comments(remarks: Iterable[str]) -> list[str]:
    return [f"# {line}".rstrip() for remark in remarks for line in remark.splitlines() or [""]]


def _block(table: Table, value: object) -> list[str]:
    lines = [f"[{table.name}]"]
    if table.selector is not None:
        key, choice = table.selector
        lines.append(f"{key} = {_toml(choice)}")
    return [*lines, *_lines(table, value)]


def _lines(table: Table, value: object) -> list[str]:
    """Return the keys of a table with the values that an object, or a mapping, has for them."""
    lines = []
    defaults = getattr(type(value), "__dataclass_fields__", {})
    for key in table.keys:
        held = value.get(key.name) if isinstance(value, dict) else getattr(value, key.name, None)
        is_default = key.name in defaults and held == defaults[key.name].default
        if held is not None and held not in ((), "") and not is_default:
            lines.append(f"{key.name} = {_toml(held)}")
    return lines


def _free_block(table: Table, values: Iterable[tuple[str, float]]) -> list[str]:
    return [f"[{table.name}]", *(f"{_key(name)} = {_toml(value)}" for name, value in values)]


def _key(name: str) -> str:
    return name if _BARE_KEY.fullmatch(name) else _toml(name)


def _toml(value: object) -> str:
    """Return a value as TOML holds it."""
    match value:
        case str():
            # a string of JSON is one of TOML, but for the one control character JSON leaves alone
            return json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007F")
        case float():
            return repr(value + 0.0)  # minus nothing is nothing
        case dt.date():
            return value.isoformat()
        case Interval():
            return f"[{_toml(value.low)}, {_toml(value.high)}]"
        case tuple():
            return _toml_list([_toml(entry) for entry in value])
        case _:
            return repr(value)


def _toml_list(entries: list[str]) -> str:
    line = f"[{', '.join(entries)}]"
    if len(line) <= _WIDEST:
        return line
    lines, row = [], ""
    for entry in entries:
        if row and len(row) + len(entry) + 2 > _WIDEST - 5:
            lines.append(row)
            row = ""
        row += f"{entry}, "
    lines.append(row)
    return "[\n" + "".join(f"    {row.rstrip()}\n" for row in lines) + "]"
