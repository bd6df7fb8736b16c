"""The tables of keys in missions/README.md follow from the classes of a fleet and from the settings.

``python tests/fleet/test_fleet_readme.py`` writes them (``make readme``).
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import TYPE_CHECKING

from key_tables import section

from planner.fleet.fleet import (
    Charger,
    Fault,
    FleetOperation,
    Job,
    Layers,
    Pack,
    Pad,
    Separation,
    Sortie,
    Swap,
    SwarmTask,
    VehicleTable,
)
from planner.fleet.reader import TABLES, condition_settings, pack_settings, vehicle_settings
from planner.vehicle.reader import SCHEMA_VERSION

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.setting import Setting
    from planner.vehicle.declared import Part

README = Path(__file__).parents[2] / "missions" / "README.md"
BEGIN, END = "<!-- fleet begins -->\n\n", "\n<!-- fleet ends -->"
TOP = f"`schema = {SCHEMA_VERSION}` stands at the top of the file."
SINGLE: Mapping[str, type[Part]] = {
    "operation": FleetOperation,
    "separation": Separation,
    "layers": Layers,
    "swarm": SwarmTask,
    "swap": Swap,
}
NAMED: Mapping[str, type[Part]] = {
    "vehicle": VehicleTable,
    "pack": Pack,
    "charger": Charger,
    "pad": Pad,
    "job": Job,
    "sortie": Sortie,
    "fault": Fault,
}


def keys_text(settings: Mapping[str, Setting]) -> str:
    return ", ".join(f"`{key}`" for key in settings)


def described(part: type[Part]) -> str:
    return " ".join(inspect.cleandoc(part.__doc__ or "").split())


def schema_text() -> str:
    blocks = [TOP]
    for table in TABLES:
        if table == "conditions":
            text = (
                "Settings of `mavjoule check` for every vehicle, written as in mavjoule.toml: "
                f"{keys_text(condition_settings())}."
            )
            blocks.append(section("`[conditions]`", text))
        elif table in SINGLE:
            blocks.append(section(f"`[{table}]`", described(SINGLE[table]), SINGLE[table]))
        else:
            own = {"vehicle": vehicle_settings, "pack": pack_settings}.get(table, dict)()
            text = described(NAMED[table])
            if own:
                text += f"  Settings: {keys_text(own)}."
            blocks.append(section(f"`[{table}.NAME]`", text, NAMED[table]))
    return "\n\n".join(blocks) + "\n"


def rendered(readme: str) -> str:
    begin, end = readme.index(BEGIN) + len(BEGIN), readme.index(END)
    return readme[:begin] + schema_text() + readme[end:]


def test_the_tables_of_keys_are_those_of_the_classes() -> None:
    readme = README.read_text(encoding="utf-8")
    assert readme == rendered(readme), "make readme"


if __name__ == "__main__":
    README.write_text(rendered(README.read_text(encoding="utf-8")), encoding="utf-8")
