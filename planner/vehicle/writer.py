"""Writer of model files: what it writes, the strict reader reads back as the same model."""

from __future__ import annotations

import datetime as dt
import json
import re
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import UsageError
from planner.files import write_output_file
from planner.values import replace
from planner.vehicle.declared import Interval, KeyKind, Part, declared
from planner.vehicle.model import NOT_GIVEN, OF_CRUISE
from planner.vehicle.reader import SCHEMA_VERSION, vehicle_from_toml

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.vehicle.model import VehicleModel

_BARE_KEY = re.compile(r"[A-Za-z0-9_-]+")
_WIDEST = 96
"""Longer lists are broken over several lines."""


def write_vehicle(path: str | Path, vehicle: VehicleModel, *, remarks: Sequence[str] = ()) -> None:
    """Write a model file, whole or not at all; ``remarks`` are comments at its top, a line each.

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
            f"a model called {vehicle.name} belongs in a file {vehicle.name}.toml, not {path.name}: "
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
    """Return a model as the TOML of its file, every number with all of its digits."""
    lines = [line for remark in remarks for line in remark.splitlines() or [""]]
    blocks = [[f"# {line}".rstrip() for line in lines]] if remarks else []
    [top, *tables] = _blocks(vehicle, "")
    blocks += [[f"schema = {SCHEMA_VERSION}", *top], *tables]
    return "\n\n".join("\n".join(block) for block in blocks) + "\n"


def _blocks(part: Part, where: str) -> Iterator[list[str]]:
    """Yield the keys of a part, then the blocks of the tables in it."""
    held = {name: (field, getattr(part, name)) for name, field in declared(type(part)).items()}
    tag = part.__struct_config__
    yield [
        *([f"{tag.tag_field} = {toml_value(tag.tag)}"] if tag.tag else []),
        *(
            f"{name} = {toml_value(value)}"
            for name, (field, value) in held.items()
            if field.kind not in {None, KeyKind.NAMED} and value != field.default
        ),
    ]
    for name, (field, value) in held.items():
        heading = f"[{where}{name}]"
        if field.kind is KeyKind.NAMED and value:
            yield [heading, *(f"{toml_key(key)} = {toml_value(number)}" for key, number in value)]
        elif isinstance(value, Part):
            [keys, *tables] = _blocks(value, f"{where}{name}.")
            if keys:
                yield [heading, *keys]
            yield from tables
        elif field.key.absent:
            # the one law that a file names and the model does not hold: hover in the cruise law
            is_of_cruise = OF_CRUISE in field.key.absent and held["cruise"][1] is not None
            selector = field.parts[0].__struct_config__.tag_field
            yield [heading, f"{selector} = {toml_value(OF_CRUISE if is_of_cruise else NOT_GIVEN)}"]


def toml_key(name: str) -> str:
    """Return a key as TOML holds it."""
    return name if _BARE_KEY.fullmatch(name) else toml_value(name)


def toml_value(value: object) -> str:
    """Return a value as TOML holds it."""
    match value:
        case bool():
            text = str(value).lower()
        case str():
            # a string of JSON is one of TOML, but for the one control character JSON leaves alone
            text = json.dumps(str(value), ensure_ascii=False).replace("\x7f", "\\u007F")
        case float():
            text = repr(value + 0.0)  # minus nothing is nothing
        case dt.date():
            text = value.isoformat()
        case Interval():
            text = f"[{toml_value(value.low)}, {toml_value(value.high)}]"
        case tuple() | list():
            text = _toml_list([toml_value(entry) for entry in value])
        case dict():
            keys = ", ".join(f"{toml_key(key)} = {toml_value(one)}" for key, one in value.items())
            text = f"{{{keys}}}"
        case _:
            text = repr(value)
    return text


def _toml_list(entries: list[str]) -> str:
    line = f"[{', '.join(entries)}]"
    if len(line) <= _WIDEST:
        return line
    rows = [""]
    for entry in entries:
        if rows[-1] and len(rows[-1]) + len(entry) + 2 > _WIDEST - 5:
            rows.append("")
        rows[-1] += f"{entry}, "
    return "[\n" + "".join(f"    {row.rstrip()}\n" for row in rows) + "]"
