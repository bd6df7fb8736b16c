"""Tables of the keys of files, as README files hold them: from the declarations of the keys."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.vehicle.declared import KeyKind, declared

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.vehicle.declared import Field, Key, Part


def section(
    heading: str, meaning: str, part: type[Part] | None = None, *, first: Sequence[str] = ()
) -> str:
    """A section with a row for each key of a table, after some rows of its own."""
    rows = [] if part is None else [row(field) for field in declared(part).values() if field.kind]
    rows = [*first, *(one for one in rows if one)]
    head = ["| key | holds | unit | required | meaning |", "|---|---|---|---|---|"]
    return "\n\n".join([f"### {heading}", meaning, *(["\n".join(head + rows)] if rows else [])])


def limits(key: Key) -> str:
    """What a value must be besides its kind, in brackets."""
    choices = (
        ["one of " + ", ".join(f"`{choice}`" for choice in key.choices)] if key.choices else []
    )
    words = ", ".join(choices + key.range.limits)
    return f" ({words})" if words else ""


def row(field: Field) -> str:
    """A row of the table of keys; empty for what has a table of its own."""
    if field.kind is KeyKind.NAMED:
        return ""
    key, required = field.key, "yes" if field.is_required else ""
    meaning = f"{key.meaning}{limits(key)}"
    return f"| `{field.name}` | {field.kind} | {key.unit} | {required} | {meaning} |"
