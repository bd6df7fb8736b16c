"""QGroundControl's plans: a JSON file with mission, fence and rally points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.catalogue.loader import MISSION_VERSION, PLAN_VALUE, REQUIRED_KEY
from planner.errors import MissionFileError
from planner.frozen import frozen
from planner.mission.items import Home, Mission, MissionFormat
from planner.mission.json_document import JsonDocument, describe, parse_json
from planner.mission.json_fields import JsonFields
from planner.mission.plan_areas import read_fence, read_rally_points
from planner.mission.plan_items import read_items
from planner.mission.remarks import Remarks
from planner.mission.vehicle_kind import tell_vehicle

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.geo.fence import Fence, RallyPoint
    from planner.mission.items import MissionItem, VehicleEvidence

FILE_VERSION = 1
SECTION_VERSION = 2

AUTOPILOTS = {3: Autopilot.ARDUPILOT, 12: Autopilot.PX4}
"""By MAV_AUTOPILOT."""


@frozen(eq=False)
class PlanDocument:
    """What a JSON mission was read from: enough to write it back without losing anything."""

    json: JsonDocument
    """The whole file as parsed: unknown keys, complex items, fence and rally points as they were;
    ``json.origin.text`` is the file itself."""
    section: dict[str, Any]
    """The mission section; in a file from before plans the whole of it."""
    origins: tuple[int, ...]
    """For each mission item the index of the element it comes from; the items of one complex item
    share theirs."""

    @property
    def elements(self) -> list[dict[str, Any]]:
        """The section's simple and complex items."""
        elements: list[dict[str, Any]] = self.section["items"]
        return elements


def is_legacy(document: JsonDocument) -> bool:
    """Return whether a JSON text is a mission file from before plans, by what it holds."""
    root = document.root
    return (
        isinstance(root, dict)
        and isinstance(root.get("items"), list)
        and (root.get("fileType") == "Mission" or not {"fileType", "mission"} & root.keys())
        and bool({"MAV_AUTOPILOT", "firmwareType", "plannedHomePosition"} & root.keys())
    )


def read_plan_text(text: str, *, source: str) -> Mission:
    """Return the mission in the text of a plan.

    Parameters
    ----------
    text : str
        The whole text.
    source : str
        Its file name, for messages.

    Raises
    ------
    MissionFileError
        If it is no plan or cannot be understood, with line and column.
    """
    return read_plan(parse_json(text, source=source), source)


def read_plan(document: JsonDocument, source: str) -> Mission:
    """Return the mission in a parsed plan.

    Parameters
    ----------
    document : JsonDocument
        The parsed text.
    source : str
        Its file name.

    Returns
    -------
    Mission
        Its ``document`` is a `PlanDocument`.

    Raises
    ------
    MissionFileError
        If it is no plan or cannot be understood, with line and column.
    """
    remarks = Remarks()
    plan = _plan_fields(document)
    section = plan.fields("mission", "the mission")
    _check_file_version(plan)
    _check_required_keys(plan, section, remarks)
    _check_values(plan, section, remarks)
    _check_mission_version(section, remarks)
    autopilot = read_autopilot(section, "firmwareType")
    read = read_items(section, remarks, autopilot=autopilot)
    home = read_home(section)
    fence: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    if "geoFence" in plan.value:
        fence = read_fence(plan.fields("geoFence", "the fence"), remarks)
    if "rallyPoints" in plan.value:
        rally = read_rally_points(plan.fields("rallyPoints", "the rally points"), remarks)
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=read.items,
        home=home,
        autopilot=autopilot,
        vehicle=read_vehicle(section, read.items, home),
        fence=fence,
        rally=rally,
        findings=(*document.findings, *remarks.findings()),
        document=PlanDocument(json=document, section=section.value, origins=read.origins),
    )


def read_autopilot(section: JsonFields, key: str) -> Autopilot | None:
    """Return the firmware a key names by MAV_AUTOPILOT, ``None`` where it is none of ours."""
    return AUTOPILOTS.get(section.whole(key, most=255, default=0))


def _plan_fields(document: JsonDocument) -> JsonFields:
    """Return the top of a plan; refuse anything else."""
    root = document.root
    if not isinstance(root, dict):
        msg = f"this is JSON but no plan: its value is {describe(root)}"
        raise MissionFileError(msg, source=document.origin.source)
    if "fileType" in root:
        if root["fileType"] != "Plan":
            document.refuse(
                f"the file type is {describe(root['fileType'])}, expected 'Plan'", root, "fileType"
            )
        if "mission" not in root:
            document.refuse("the plan has no section 'mission': there is nothing to fly", root)
    elif not isinstance(root.get("mission"), dict):
        keys = ", ".join(f"'{key[:20]}'" for key in list(root)[:4]) or "nothing"
        document.refuse(
            f"this is JSON but no plan: 'fileType' and 'mission' are missing, it holds {keys}", root
        )
    return JsonFields(document=document, value=root, title="the plan")


def _check_file_version(plan: JsonFields) -> None:
    if plan.value.get("version", FILE_VERSION) != FILE_VERSION:
        plan.refuse(
            f"its version is {describe(plan.value['version'])}, expected {FILE_VERSION}: "
            "it was written by a program from another time",
            "version",
        )


def _check_required_keys(plan: JsonFields, section: JsonFields, remarks: Remarks) -> None:
    """Tell which of the keys are missing that QGroundControl requires and we can do without."""
    head = ("fileType", "version", "groundStation", "geoFence", "rallyPoints")
    missing = [key for key in head if key not in plan.value]
    missing += [
        f"mission.{key}"
        for key in ("plannedHomePosition", "firmwareType")
        if key not in section.value
    ]
    rally_points = plan.value.get("rallyPoints")
    if isinstance(rally_points, dict) and "version" not in rally_points:
        missing.append("rallyPoints.version")
    if not missing:
        return
    message = f"{', '.join(missing)} missing: QGroundControl refuses the file"
    if "geoFence" in missing:
        message += ", MAVSDK too, and no fence can be checked"
    remarks.add(REQUIRED_KEY, message, place=plan.document.place(plan.value))


def _check_values(plan: JsonFields, section: JsonFields, remarks: Remarks) -> None:
    """Tell about values that QGroundControl wants to be of a type, and we have no use for."""
    wanted = (
        (plan, "groundStation", "a text", str),
        (plan, "version", "a number", (int, float)),
        (section, "cruiseSpeed", "a number", (int, float)),
        (section, "hoverSpeed", "a number", (int, float)),
    )
    for fields, key, expected, types in wanted:
        value = fields.value.get(key)
        if key in fields.value and (not isinstance(value, types) or isinstance(value, bool)):
            message = f"'{key}' is {describe(value)}, expected {expected}: QGroundControl refuses the file"
            remarks.add(PLAN_VALUE, message, place=fields.document.place(fields.value, key))


def _check_mission_version(section: JsonFields, remarks: Remarks) -> None:
    version = section.value.get("version")
    if version == SECTION_VERSION:
        return
    is_written = "version" in section.value
    message = (
        f"the mission is {f'of version {describe(version)}' if is_written else 'without a version'}"
        f", read as version {SECTION_VERSION}: MAVSDK refuses it"
    )
    place = section.document.place(section.value, "version")
    remarks.add(MISSION_VERSION, message, place=place)


def read_home(section: JsonFields) -> Home | None:
    """Return the planned home; ``None`` where its place is null or missing."""
    key = "plannedHomePosition"
    if key not in section.value:
        return None
    values = section.listed(key)
    if len(values) != 3:
        section.refuse(f"'{key}' must be [latitude, longitude, altitude]", key)
    altitude_m = section.altitude(key, 2)
    if values[0] is None or values[1] is None:
        return None
    latitude_deg, longitude_deg = section.position(key)
    return Home(latitude_deg=latitude_deg, longitude_deg=longitude_deg, altitude_amsl_m=altitude_m)


def read_vehicle(
    section: JsonFields, items: Sequence[MissionItem], home: Home | None
) -> VehicleEvidence | None:
    """Return the kind of vehicle by the file's word, else by its commands."""
    return tell_vehicle(
        items,
        vehicle_type=section.whole("vehicleType", most=255, default=0),
        home_altitude_amsl_m=None if home is None else home.altitude_amsl_m,
    )
