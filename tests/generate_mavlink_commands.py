"""Write ``planner/mission/mavlink_commands.json`` from the dialects that pymavlink carries.

Run it as ``python tests/generate_mavlink_commands.py`` after pymavlink has been updated; a test
compares the file with what this would write.
"""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

import pymavlink.dialects.v20

TARGET = Path(__file__).parents[1] / "planner" / "mission" / "mavlink_commands.json"
DIALECTS = ("common", "ardupilotmega")
UNUSED = ("empty", "reserved", "unused", "user defined")
LONGEST_NAME = 32


def read_enumerations(dialect: str, folder: Path) -> dict[str, dict[int, ElementTree.Element]]:
    """Return the entries of MAV_CMD and MAV_FRAME by value, with those of included dialects."""
    entries: dict[str, dict[int, ElementTree.Element]] = {"MAV_CMD": {}, "MAV_FRAME": {}}
    # The definition files are pymavlink's own, installed with it.
    root = ElementTree.parse(folder / f"{dialect}.xml").getroot()
    for include in root.findall("include"):
        included = read_enumerations((include.text or "").removesuffix(".xml"), folder)
        for name, values in included.items():
            entries[name].update(values)
    for name, values in entries.items():
        for entry in root.iterfind(f"enums/enum[@name='{name}']/entry"):
            values[int(entry.attrib["value"], 0)] = entry
    return entries


def make_parameter_names(entry: ElementTree.Element) -> list[str]:
    """Return the seven parameter names of a command, ``""`` where it has none."""
    names = [""] * 7
    for parameter in entry.iterfind("param"):
        text = " ".join((parameter.text or "").split())
        label = parameter.attrib.get("label", "")
        if not label and not text.lower().startswith(UNUSED):
            # A parameter without a label is named by the first words of its description.
            label = re.split(r"[.,:(]", text, maxsplit=1)[0].strip()
            if len(label) > LONGEST_NAME:
                label = ""
        names[int(parameter.attrib["index"]) - 1] = label
    return names


def make_table() -> dict[str, Any]:
    """Return the content of the data file."""
    folder = Path(next(iter(pymavlink.dialects.v20.__path__)))
    commands: dict[int, ElementTree.Element] = {}
    frames: dict[int, ElementTree.Element] = {}
    for dialect in DIALECTS:
        entries = read_enumerations(dialect, folder)
        commands.update(entries["MAV_CMD"])
        frames.update(entries["MAV_FRAME"])
    return {
        "commands": {
            str(number): [
                entry.attrib["name"].removeprefix("MAV_CMD_"),
                entry.attrib.get("hasLocation") == "true",
                entry.attrib.get("isDestination") == "true",
                *make_parameter_names(entry),
            ]
            for number, entry in sorted(commands.items())
        },
        "frames": {
            str(number): entry.attrib["name"].removeprefix("MAV_FRAME_")
            for number, entry in sorted(frames.items())
        },
    }


def write_table(path: Path) -> None:
    """Write the data file, a line per entry so that changes can be read."""
    table = make_table()
    sections = []
    for name, entries in table.items():
        lines = ",\n".join(f"{json.dumps(key)}: {json.dumps(entries[key])}" for key in entries)
        sections.append(f"{json.dumps(name)}: {{\n{lines}\n}}")
    path.write_text("{\n" + ",\n".join(sections) + "\n}\n", encoding="utf-8")


if __name__ == "__main__":
    write_table(TARGET)
