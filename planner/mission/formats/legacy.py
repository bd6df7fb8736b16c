"""QGroundControl's JSON missions from before plans: no fence, no rally points, items at the top.

Version 1.0 (2016) has ``param1`` to ``param4`` and ``coordinate`` in each item and an item for
home; version 2 (2017) has the mission section of a plan as the whole file.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.findings import Remarks, Rule, Severity
from planner.mission.formats.json_document import JsonFields, describe
from planner.mission.formats.plan import (
    PlanDocument,
    read_autopilot,
    read_home,
    read_items,
    read_vehicle,
)
from planner.mission.formats.simple_item import COMPLEX_ITEM_UNKNOWN
from planner.mission.items import Home, Mission, MissionFormat

if TYPE_CHECKING:
    from planner.mission.formats.json_document import JsonDocument


LEGACY_FORMAT = Rule(
    "L117 legacy-format",
    Severity.WARNING,
    summary="The file is written in a JSON format from before plans.",
    why="QGroundControl since 3.3 opens plans only; other programs never read it.",
    how="The file has items at its top, or the file type 'Mission'.",
    fix="open it in an old QGroundControl and save it as a plan",
)


def read_legacy(document: JsonDocument, source: str) -> Mission:
    """Return the mission in a JSON text from before plans.

    Parameters
    ----------
    document : JsonDocument
        A parsed text for which `is_legacy` holds.
    source : str
        Its file name.

    Returns
    -------
    Mission
        Its ``document`` is a `PlanDocument`.

    Raises
    ------
    MissionFileError
        If it cannot be understood, with line and column.
    """
    remarks = Remarks()
    mission = JsonFields(document=document, value=document.root, title="the mission")
    version = mission.value.get("version")
    if version not in ("1.0", 1, 2, None):
        mission.refuse(f'its version is {describe(version)}, expected "1.0" or 2', "version")
    message = (
        f"a mission file of version {'unknown' if version is None else version}, from before "
        "plans: QGroundControl no longer opens it, and it holds no fence"
    )
    remarks.add(LEGACY_FORMAT, message, place=document.place(mission.value))
    complex_items = mission.value.get("complexItems")
    if complex_items:
        message = f"'complexItems' is {describe(complex_items)}: missing from this prediction"
        place = document.place(mission.value, "complexItems")
        remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=place)
    firmware_key = "MAV_AUTOPILOT" if "MAV_AUTOPILOT" in mission.value else "firmwareType"
    autopilot = read_autopilot(mission, firmware_key)
    read = read_items(mission, remarks, autopilot=autopilot, is_legacy=True)
    home = _read_home(mission)
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=read.items,
        home=home,
        autopilot=autopilot,
        vehicle=read_vehicle(mission, read.items, home),
        findings=(*document.findings, *remarks.findings()),
        document=PlanDocument(json=document, section=mission.value, origins=read.origins),
    )


def _read_home(mission: JsonFields) -> Home | None:
    """Return the planned home, which version 1.0 writes as an item."""
    key = "plannedHomePosition"
    if not isinstance(mission.value.get(key), dict):
        return read_home(mission)
    home = mission.fields(key, "the planned home")
    coordinate = home.listed("coordinate")
    if len(coordinate) != 3:
        home.refuse("'coordinate' must be [latitude, longitude, altitude]", "coordinate")
    latitude_deg, longitude_deg = home.position("coordinate")
    return Home(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=home.altitude("coordinate", 2),
    )
