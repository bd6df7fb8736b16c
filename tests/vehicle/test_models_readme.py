"""The tables of keys in models/README.md follow from the value classes.

``python tests/vehicle/test_models_readme.py`` writes them (``make readme``).
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING

from key_tables import limits, section

from planner.vehicle.declared import KeyKind, declared
from planner.vehicle.model import VehicleModel
from planner.vehicle.reader import SCHEMA_VERSION

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.vehicle.declared import Part

README = Path(__file__).parents[2] / "models" / "README.md"
BEGIN, END = "<!-- schema begins -->\n\n", "\n<!-- schema ends -->"
VERSION = f"| `schema` | whole number |  | yes | version of this schema: {SCHEMA_VERSION} |"


def sections(part: type[Part], where: str = "") -> Iterator[str]:
    """A section for every table inside a part, in the order of its fields."""
    for field in declared(part).values():
        heading = f"`[{where}{field.name}]`"
        required = ", required" if field.is_required else ""
        if field.kind is KeyKind.NAMED:
            yield section(heading, field.key.meaning + limits(field.key))
        for one in field.parts:
            tag = one.__struct_config__
            variant = f' with `{tag.tag_field} = "{tag.tag}"`' if tag.tag else ""
            meaning = field.key.meaning or " ".join(inspect.cleandoc(one.__doc__ or "").split())
            yield section(heading + variant + required, meaning, one)
            yield from sections(one, f"{where}{field.name}.")
        for name, meaning in field.key.absent.items():
            selector = field.parts[0].__struct_config__.tag_field
            yield section(f'{heading} with `{selector} = "{name}"`{required}', meaning)


def schema_text() -> str:
    top = section("Top of the file", "What is no table.", VehicleModel, first=[VERSION])
    return "\n\n".join([top, *sections(VehicleModel)]) + "\n"


def rendered(readme: str) -> str:
    begin, end = readme.index(BEGIN) + len(BEGIN), readme.index(END)
    return readme[:begin] + schema_text() + readme[end:]


def test_the_tables_of_keys_are_those_of_the_classes() -> None:
    readme = README.read_text(encoding="utf-8")
    assert readme == rendered(readme), "make readme"


if __name__ == "__main__":
    README.write_text(rendered(README.read_text(encoding="utf-8")), encoding="utf-8")
