"""QGroundControl's plans: a JSON file with mission, fence and rally points."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.findings import Remarks, Rule, Severity
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.commands import Command
from planner.mission.formats.fence_items import FENCE_INCOMPLETE, FENCE_ITEM_BROKEN
from planner.mission.formats.json_document import JsonDocument, JsonFields, describe, parse_json
from planner.mission.formats.simple_item import PLAN_VALUE, SimpleItemReader
from planner.mission.items import MOST_ITEMS, Home, Mission, MissionFormat, make_items
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.findings import Place
    from planner.mission.items import MissionItem, VehicleEvidence


class PlanItems(Value):
    """Mission items in flown order, and where in the file's list each comes from."""

    items: tuple[MissionItem, ...]
    origins: tuple[int, ...]
    """For each item the index of the element of the file's list that it comes from."""


def read_items(
    section: JsonFields,
    remarks: Remarks,
    *,
    autopilot: Autopilot | None = None,
    is_legacy: bool = False,
) -> PlanItems:
    """Return the items of a section that has a list of them.

    Parameters
    ----------
    section : JsonFields
        The section ``mission``, or a mission file of the old kind.
    is_legacy : bool
        Whether the file is from before plans, where older forms of items are no finding.
    """
    document = section.document
    elements = section.listed("items")
    for index, raw in enumerate(elements):
        if type(raw) is not dict:
            section.refuse(f"element {index + 1} of 'items' is {describe(raw)}", "items", index)
    places = document.places(elements)
    reader = SimpleItemReader(document, remarks, is_legacy=is_legacy)
    rows: list[tuple[Any, ...]] = []
    groups: list[tuple[int, list[MissionItem]]] = []
    origins: list[int] = []
    for index, (raw, place) in enumerate(zip(elements, places, strict=True)):
        number = len(origins) + 1
        if raw.get("type") == "SimpleItem" or reader.is_simple(raw, number, place):
            rows.append(reader.read(raw, number, place))
            origins.append(index)
        else:
            fields = JsonFields(document=document, value=raw, title=f"item {number}")
            group = _expand(fields, place, reader, remarks, first_number=number)
            groups.append((len(origins), group))
            origins += [index] * len(group)
        if len(origins) > MOST_ITEMS:
            section.refuse(f"more than {MOST_ITEMS:,} items: MAVLink can send no more", "items")
    simple = iter(make_items(rows))
    items: list[MissionItem] = []
    for at, group in groups:
        items += [*islice(simple, at - len(items)), *group]
    items += simple
    if any(item.command == Command.DO_JUMP for item in items):
        _compare_jump_ids(items, remarks)
        _check_jumps(items, groups, remarks, autopilot)
    return PlanItems(items=tuple(items), origins=tuple(origins))


def _expand(
    raw: JsonFields,
    place: Place,
    simple_items: SimpleItemReader,
    remarks: Remarks,
    *,
    first_number: int,
) -> list[MissionItem]:
    """Return the mission items of a complex item."""
    from planner.mission.expand.complex_items import ComplexItemReader  # many missions hold none

    reader = ComplexItemReader(simple_items=simple_items, remarks=remarks)
    return reader.read(raw, place, first_number=first_number)


JUMP_IDS = Rule(
    "L106 jump-ids",
    Severity.WARNING,
    summary="Items share a doJumpId, or have none, in a mission with a DO_JUMP.",
    why="DO_JUMP names its target by doJumpId.  QGroundControl takes the first item with it, other "
    "programs count items: the vehicle may repeat another part of the mission than was meant.",
    how="Repeated and missing ids; reported only where a DO_JUMP makes them matter.",
    fix="save the plan again with QGroundControl, and check where the jump leads",
)


def _compare_jump_ids(items: list[MissionItem], remarks: Remarks) -> None:
    """Report ids that leave open where a DO_JUMP goes."""
    first_with: dict[int, int] = {}
    for number, item in enumerate(items, start=1):
        if item.jump_id is None:
            message = f"item {number} has no doJumpId, in a mission with a DO_JUMP"
        elif item.jump_id in first_with:
            message = (
                f"items {first_with[item.jump_id]} and {number} both have doJumpId {item.jump_id}, "
                "in a mission with a DO_JUMP"
            )
        else:
            first_with[item.jump_id] = number
            continue
        remarks.add(JUMP_IDS, message, item=number, place=item.place)


JUMP_INTO_COMPLEX_ITEM = Rule(
    "L120 jump-into-complex-item",
    Severity.WARNING,
    summary="A DO_JUMP leads into a complex item.",
    why="QGroundControl looks for the target among the simple items alone, and refuses the whole file "
    "if it is not there.",
    how="The target has a doJumpId that only an item inside a survey or other complex item has.",
    fix="let the jump lead to a simple item before or after the complex one",
)

JUMP_SHIFTED = Rule(
    "L121 jump-shifted-by-mavsdk",
    Severity.INFO,
    summary="MAVSDK's import makes a DO_JUMP lead one item too far.",
    why="A plan numbers its items from 1, PX4 from 0.  QGroundControl converts the number at upload, "
    "MAVSDK's import does not: the vehicle repeats another part of the mission.",
    how="A plan for PX4 that holds a DO_JUMP; for ArduPilot MAVSDK puts home first, as item 0.",
    fix="upload the plan with QGroundControl",
)


def _check_jumps(
    items: list[MissionItem],
    groups: list[tuple[int, list[MissionItem]]],
    remarks: Remarks,
    autopilot: Autopilot | None,
) -> None:
    """Report where ground stations change a DO_JUMP."""
    inside = {at + n for at, group in groups for n in range(len(group))}
    simple_ids = {item.jump_id for at, item in enumerate(items) if at not in inside}
    number_of = {item.jump_id: at + 1 for at, item in enumerate(items)}
    for number, item in enumerate(items, start=1):
        if item.command != Command.DO_JUMP or item.param1 is None:
            continue
        named = int(item.param1)
        if named in number_of and named not in simple_ids:
            message = (
                f"the DO_JUMP of item {number} leads to item {number_of[named]}, inside a complex "
                "item: QGroundControl refuses the file"
            )
            remarks.add(JUMP_INTO_COMPLEX_ITEM, message, item=number, place=item.place)
        elif autopilot is Autopilot.PX4:
            message = (
                f"the DO_JUMP of item {number} names item {named}: after MAVSDK's import it leads "
                f"to item {named + 1}"
            )
            remarks.add(JUMP_SHIFTED, message, item=number, place=item.place)


AREA_VERSION = 1
SECTION_VERSION = 2


def read_fence(section: JsonFields, remarks: Remarks) -> Fence | None:
    """Return the fence of a plan.

    Returns
    -------
    Fence or None
        ``None`` where every loader passes over the section (version 1 or none).
    """
    if not _is_current(section, "the fence", remarks):
        return None
    _check_keys(section, ("polygons", "circles"), remarks)
    polygons = []
    for index, raw in _objects(section, "polygons"):
        area = JsonFields(document=section.document, value=raw, title=f"fence polygon {index + 1}")
        area.whole("version", least=AREA_VERSION, most=AREA_VERSION, default=AREA_VERSION)
        _check_keys(area, ("version",), remarks)
        vertices = tuple(area.position("polygon", n) for n in range(len(area.listed("polygon"))))
        place = section.document.place(raw)
        if len(vertices) < 3:
            corners = quantity.count(len(vertices), "vertex", "vertices")
            message = f"{area.title} has {corners} and encloses nothing: left out"
            remarks.add(FENCE_INCOMPLETE, message, place=place)
            continue
        polygons.append(
            FencePolygon(inclusion=area.truth("inclusion"), vertices_deg=vertices, place=place)
        )
    circles = []
    for index, raw in _objects(section, "circles"):
        area = JsonFields(document=section.document, value=raw, title=f"fence circle {index + 1}")
        area.whole("version", least=AREA_VERSION, most=AREA_VERSION, default=AREA_VERSION)
        _check_keys(area, ("version",), remarks)
        circle = area.fields("circle", area.title)
        circle.listed("center")
        latitude_deg, longitude_deg = circle.position("center")
        radius_m = circle.number("radius")
        place = section.document.place(raw)
        if radius_m <= 0.0:
            message = f"{area.title} has radius {radius_m:g} m and encloses nothing: left out"
            remarks.add(FENCE_INCOMPLETE, message, place=place)
            continue
        circles.append(
            FenceCircle(
                inclusion=area.truth("inclusion"),
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                radius_m=radius_m,
                place=place,
            )
        )
    breach_return: tuple[float, float, float | None] | None = None
    if "breachReturn" in section.value:
        values = section.listed("breachReturn")
        altitude = section.altitude("breachReturn", 2) if len(values) > 2 else None
        breach_return = (*section.position("breachReturn"), altitude)
    return Fence(
        polygons=tuple(polygons), circles=tuple(circles), breach_return_deg_m=breach_return
    )


def read_rally_points(section: JsonFields, remarks: Remarks) -> tuple[RallyPoint, ...]:
    """Return the rally points of a plan."""
    if not _is_current(section, "the list of rally points", remarks):
        return ()
    points = []
    raw_points = section.listed("points")
    places = section.document.element_places(section.value, "points")
    for index, (raw, place) in enumerate(zip(raw_points, places, strict=True)):
        if not isinstance(raw, list) or len(raw) != 3:
            section.refuse(
                f"rally point {index + 1} must be [latitude, longitude, altitude]", "points", index
            )
        latitude_deg, longitude_deg = section.position("points", index)
        height_m = section.altitude("points", index, 2)
        if height_m is None:
            message = f"rally point {index + 1} has no altitude: left out"
            remarks.add(FENCE_ITEM_BROKEN, message, place=place)
            continue
        points.append(
            RallyPoint(
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                height_above_home_m=height_m,
                place=place,
            )
        )
    return tuple(points)


FENCE_VERSION = Rule(
    "L107 fence-version",
    Severity.WARNING,
    summary="The fence or the rally points are of version 1, which every loader ignores.",
    why="The file looks fenced and the vehicle flies without a fence; no program reports it.",
    how="Section version 1 or none, and something in it besides empty lists.",
    fix="draw the fence again in QGroundControl and save",
)


def _is_current(section: JsonFields, what: str, remarks: Remarks) -> bool:
    """Return whether loaders read a section; report what they pass over."""
    version = section.whole("version", most=2**31, default=1)
    if version == SECTION_VERSION:
        return True
    if version != 1:
        section.refuse(
            f"{what} is of version {version}, expected {SECTION_VERSION}: "
            "no program reads it, save the plan again",
            "version",
        )
    if any(value not in ([], {}, None) for key, value in section.value.items() if key != "version"):
        which = "of version 1" if "version" in section.value else "without a version"
        message = f"{what} is {which}: every loader ignores what is in it, and so does this check"
        remarks.add(FENCE_VERSION, message, place=section.document.place(section.value))
    return False


def _check_keys(fields: JsonFields, keys: tuple[str, ...], remarks: Remarks) -> None:
    """Report keys that QGroundControl requires and we can do without."""
    for key in keys:
        if key not in fields.value:
            message = f"{fields.title} has no '{key}': QGroundControl refuses the file"
            remarks.add(PLAN_VALUE, message, place=fields.document.place(fields.value))


def _objects(section: JsonFields, key: str) -> list[tuple[int, dict[str, Any]]]:
    """Return the objects in a list with their indexes; a missing list is an empty one."""
    if key not in section.value:
        return []
    values = list(enumerate(section.listed(key)))
    for index, value in values:
        if not isinstance(value, dict):
            section.refuse(f"'{key}' element {index + 1} must be an object", key, index)
    return values


FILE_VERSION = 1

AUTOPILOTS: dict[int, Autopilot] = {3: Autopilot.ARDUPILOT, 12: Autopilot.PX4}
"""By MAV_AUTOPILOT."""


class PlanDocument(Value, eq=False):
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
    """Return the mission in the text of a plan."""
    return read_plan(parse_json(text, source=source), source)


def read_plan(document: JsonDocument, source: str) -> Mission:
    """Return the mission in a parsed plan.

    Returns
    -------
    Mission
        Its ``document`` is a `PlanDocument`.
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
        msg = f"this is JSON but not a plan: its value is {describe(root)}"
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
            f"this is JSON but not a plan: 'fileType' and 'mission' are missing, it holds {keys}",
            root,
        )
    return JsonFields(document=document, value=root, title="the plan")


def _check_file_version(plan: JsonFields) -> None:
    if plan.value.get("version", FILE_VERSION) != FILE_VERSION:
        plan.refuse(
            f"its version is {describe(plan.value['version'])}, expected {FILE_VERSION}: "
            "it was written by a program from another time",
            "version",
        )


REQUIRED_KEY = Rule(
    "L101 plan-key-missing",
    Severity.WARNING,
    summary="A key that QGroundControl requires is missing from the plan.",
    why="QGroundControl refuses the whole file at the first key it misses, MAVSDK too where a section "
    "is missing; nothing in the missing part is checked, a fence for instance.",
    how="Looks for the keys that QGroundControl's loader requires and that can be done without.",
    fix="open the plan in the program that wrote it and save it as a QGroundControl plan",
)


def _check_required_keys(plan: JsonFields, section: JsonFields, remarks: Remarks) -> None:
    """Report which of the keys are missing that QGroundControl requires and we can do without."""
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
    """Report values that QGroundControl wants to be of a type, and we have no use for."""
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


MISSION_VERSION = Rule(
    "L102 mission-version",
    Severity.WARNING,
    summary="The mission section is not version 2.",
    why="MAVSDK refuses it; QGroundControl does not look at it, and may misread the file.",
    how="Compares mission.version with 2.",
    fix="save the plan again with QGroundControl",
)


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
    return vehicle_evidence(
        items,
        vehicle_type=section.whole("vehicleType", most=255, default=0),
        home_altitude_amsl_m=None if home is None else home.altitude_amsl_m,
    )
