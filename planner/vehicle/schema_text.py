"""The schema of model files in Markdown, rendered from the one the reader uses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.vehicle.schema import SCHEMA, VERSION

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.vehicle.keys import Key, Table


def schema_text() -> str:
    """Return a section of Markdown for every table of a model file, in the order of the schema."""
    sections = []
    for table in SCHEMA:
        keys = (VERSION, *table.keys) if not table.name else table.keys
        parts = [f"### {_heading(table)}", table.meaning]
        if keys:
            parts.append(_key_table(keys))
        sections.append("\n\n".join(parts))
    return "\n\n".join(sections) + "\n"


def _heading(table: Table) -> str:
    if not table.name:
        return "Top of the file"
    heading = f"`[{table.name}]`"
    if table.selector is not None:
        key, value = table.selector
        heading += f' with `{key} = "{value}"`'
    return heading + (", required" if table.required else "")


def _key_table(keys: Iterable[Key]) -> str:
    rows = [
        f"| `{key.name}` | {key.kind} | {key.unit} | {'yes' if key.required else ''} "
        f"| {key.meaning}{_limits(key)} |"
        for key in keys
    ]
    return "\n".join(
        ["| key | holds | unit | required | meaning |", "|---|---|---|---|---|", *rows]
    )


def _limits(key: Key) -> str:
    """Return what a value must be besides its kind, in words."""
    limits = []
    if key.choices:
        limits.append("one of " + ", ".join(f"`{choice}`" for choice in key.choices))
    if key.above is not None:
        limits.append(f"above {key.above:g}")
    if key.at_least is not None:
        limits.append(f"at least {key.at_least:g}")
    if key.at_most is not None:
        limits.append(f"at most {key.at_most:g}")
    return f" ({', '.join(limits)})" if limits else ""
