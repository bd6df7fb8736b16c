"""QGroundControl's plans, and its JSON missions from before plans: mission, fence and rally points.

JSON of version 1.0 (2016) has ``param1`` to ``param4`` and ``coordinate`` in each item and an item
for home; version 2 (2017) has the mission section of a plan as the whole file.
"""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.fetched import KEY as FETCHED_KEY
from planner.fetched import FetchMark
from planner.findings import Remarks, Rule, Severity
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.commands import Command
from planner.mission.formats.fence_items import FENCE_INCOMPLETE, FENCE_ITEM_BROKEN, encloses_area
from planner.mission.formats.json_document import JsonDocument, JsonFields, describe, parse_json
from planner.mission.formats.simple_item import COMPLEX_ITEM_UNKNOWN, PLAN_VALUE, SimpleItemReader
from planner.mission.items import MOST_ITEMS, Home, ItemSequence, Mission, MissionFormat, make_items
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator

    from planner.mission.items import MissionItem


FILE_VERSION = 1
SECTION_VERSION = 2
AREA_VERSION = 1

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
    """Return the mission in the text of a plan, or in JSON from before plans."""
    return read_plan(parse_json(text, source=source), source)


def read_plan(document: JsonDocument, source: str) -> Mission:
    """Return the mission in parsed JSON; its ``document`` is a `PlanDocument`."""
    remarks = Remarks()
    plan: JsonFields | None = None
    if is_legacy(document):
        section = JsonFields(document=document, value=document.root, title="the mission")
        _check_legacy(section, remarks)
    else:
        plan = _plan_fields(document)
        section = plan.fields("mission", "the mission")
        _check_plan(plan, section, remarks)
        _check_unread(plan, ("geoFence", "rallyPoints"), remarks)
    _check_unread(section, (), remarks)
    firmware_key = "firmwareType"
    if plan is None and "MAV_AUTOPILOT" in section.value:
        firmware_key = "MAV_AUTOPILOT"
    autopilot = AUTOPILOTS.get(section.whole(firmware_key, most=255, default=0))
    items, origins = _read_items(section, remarks, autopilot, is_legacy=plan is None)
    home = _read_home(section, is_legacy=plan is None)
    fence: Fence | None = None
    rally: tuple[RallyPoint, ...] = ()
    if plan is not None and "geoFence" in plan.value:
        fence = _read_fence(plan.fields("geoFence", "the fence"), remarks)
    if plan is not None and "rallyPoints" in plan.value:
        rally = _read_rally_points(plan.fields("rallyPoints", "the rally points"), remarks)
    return Mission(
        source=source,
        file_format=MissionFormat.PLAN,
        items=items,
        home=home,
        autopilot=autopilot,
        vehicle=vehicle_evidence(
            items,
            vehicle_type=section.whole("vehicleType", most=255, default=0),
            home_altitude_amsl_m=None if home is None else home.altitude_amsl_m,
        ),
        fence=fence,
        rally=rally,
        fetched=None if plan is None else FetchMark.read(plan.value.get(FETCHED_KEY)),
        findings=(*document.findings, *remarks.findings()),
        document=PlanDocument(json=document, section=section.value, origins=origins),
    )


def _plan_fields(document: JsonDocument) -> JsonFields:
    """Return the top of a plan; refuse anything else."""
    root = document.root
    if not isinstance(root, dict):
        msg = f"this is JSON but not a plan: its value is {describe(root)}"
        raise MissionFileError(msg, source=document.origin.source)
    plan = JsonFields(document=document, value=root, title="the plan")
    if "fileType" in root:
        if root["fileType"] != "Plan":
            found = describe(root["fileType"])
            document.refuse(f"the file type is {found}, expected 'Plan'", root, "fileType")
        if "mission" not in root:
            document.refuse("the plan has no section 'mission': there is nothing to fly", root)
    elif not isinstance(root.get("mission"), dict):
        keys = ", ".join(f"'{key[:20]}'" for key in list(root)[:4]) or "nothing"
        message = "this is JSON but not a plan: 'fileType' and 'mission' are missing, it holds "
        document.refuse(message + keys, root)
    if root.get("version", FILE_VERSION) != FILE_VERSION:
        plan.refuse(
            f"its version is {describe(root['version'])}, expected {FILE_VERSION}: "
            "it was written by a program from another time",
            "version",
        )
    return plan


REQUIRED_KEY = Rule(
    "L101 plan-key-missing",
    Severity.WARNING,
    summary="A key that QGroundControl requires is missing from the plan.",
    why="QGroundControl refuses the whole file at the first key it misses, MAVSDK too where a section "
    "is missing; nothing in the missing part is checked, a fence for instance.",
    how="Looks for the keys that QGroundControl's loader requires and that can be done without.",
    fix="open the plan in the program that wrote it and save it as a QGroundControl plan",
)

MISSION_VERSION = Rule(
    "L102 mission-version",
    Severity.WARNING,
    summary="The mission section is not version 2.",
    why="MAVSDK refuses it; QGroundControl does not look at it, and may misread the file.",
    how="Compares mission.version with 2.",
    fix="save the plan again with QGroundControl",
)


def _check_plan(plan: JsonFields, section: JsonFields, remarks: Remarks) -> None:
    """Report keys that are missing or of another type, and that we can do without."""
    head = ("fileType", "version", "groundStation", "geoFence", "rallyPoints")
    missing = [key for key in head if key not in plan.value]
    wanted = ("plannedHomePosition", "firmwareType")
    missing += [f"mission.{key}" for key in wanted if key not in section.value]
    rally_points = plan.value.get("rallyPoints")
    if isinstance(rally_points, dict) and "version" not in rally_points:
        missing.append("rallyPoints.version")
    if missing:
        message = f"{', '.join(missing)} missing: QGroundControl refuses the file"
        if "geoFence" in missing:
            message += ", MAVSDK too, and no fence can be checked"
        remarks.add(REQUIRED_KEY, message, place=plan.place())
    for fields, key, expected, types in (
        (plan, "groundStation", "a text", {str}),
        (plan, "version", "a number", {int, float}),
        (section, "cruiseSpeed", "a number", {int, float}),
        (section, "hoverSpeed", "a number", {int, float}),
    ):
        value = fields.value.get(key)
        if key in fields.value and type(value) not in types:
            message = f"'{key}' is {describe(value)}, expected {expected}: QGroundControl refuses the file"
            remarks.add(PLAN_VALUE, message, place=fields.place(key))
    version = section.value.get("version")
    if version != SECTION_VERSION:
        which = (
            f"of version {describe(version)}" if "version" in section.value else "without a version"
        )
        message = f"the mission is {which}, read as version {SECTION_VERSION}: MAVSDK refuses it"
        remarks.add(MISSION_VERSION, message, place=section.place("version"))


LEGACY_FORMAT = Rule(
    "L117 legacy-format",
    Severity.WARNING,
    summary="The file is written in a JSON format from before plans.",
    why="QGroundControl since 3.3 opens plans only; other programs never read it.",
    how="The file has items at its top, or the file type 'Mission'.",
    fix="open it in an old QGroundControl and save it as a plan",
)


def _check_legacy(mission: JsonFields, remarks: Remarks) -> None:
    """Report what a mission from before plans lacks; refuse an unknown version."""
    version = mission.value.get("version")
    if version not in ("1.0", 1, 2, None):
        mission.refuse(f'its version is {describe(version)}, expected "1.0" or 2', "version")
    message = (
        f"a mission file of version {'unknown' if version is None else version}, from before "
        "plans: QGroundControl no longer opens it, and it has no place for a fence"
    )
    remarks.add(LEGACY_FORMAT, message, place=mission.place())
    complex_items = mission.value.get("complexItems")
    if complex_items:
        message = f"'complexItems' is {describe(complex_items)}: missing from this prediction"
        remarks.add(COMPLEX_ITEM_UNKNOWN, message, place=mission.place("complexItems"))


def _read_home(section: JsonFields, *, is_legacy: bool) -> Home | None:
    """Return the planned home, which version 1.0 writes as an item; ``None`` where its place is null."""
    key = "plannedHomePosition"
    if key not in section.value:
        return None
    if is_legacy and isinstance(section.value[key], dict):
        section, key = section.fields(key, "the planned home"), "coordinate"
    values = section.listed(key)
    if len(values) != 3:
        section.refuse(f"'{key}' must be [latitude, longitude, altitude]", key)
    altitude_m = section.altitude(key, 2)
    if key != "coordinate" and (values[0] is None or values[1] is None):
        return None
    return Home(*section.position(key), altitude_m)


def _read_items(
    section: JsonFields, remarks: Remarks, autopilot: Autopilot | None, *, is_legacy: bool
) -> tuple[tuple[MissionItem, ...], tuple[int, ...]]:
    """Return the items in flown order, and for each the index of the element it comes from."""
    elements, places = section.objects("items")
    reader = SimpleItemReader(section.document, remarks, is_legacy=is_legacy)
    rows: list[tuple[Any, ...]] = []
    groups: list[tuple[int, list[MissionItem]]] = []
    origins: list[int] = []
    clean = reader.clean_rows(elements, places)
    for index, (raw, place, row) in enumerate(zip(elements, places, clean, strict=True)):
        number = len(origins) + 1
        if row is not None:
            rows.append(row)
            origins.append(index)
        elif raw.get("type") == "SimpleItem" or reader.is_simple(raw, number, place):
            rows.append(reader.read(raw, number, place))
            origins.append(index)
        else:
            from planner.mission.expand.complex_items import expand  # many missions hold none

            group = ItemSequence(first_number=number, place=place, remarks=remarks)
            expand(section.document, raw, reader, group)
            groups.append((len(origins), group.items))
            origins += [index] * len(group.items)
        if len(origins) > MOST_ITEMS:
            section.refuse(f"more than {MOST_ITEMS:,} items: MAVLink can send no more", "items")
    simple = iter(make_items(rows))
    items: list[MissionItem] = []
    for at, expanded in groups:
        items += [*islice(simple, at - len(items)), *expanded]
    items += simple
    if Command.DO_JUMP in [item.command for item in items]:
        _compare_jump_ids(items, remarks)
        _check_jumps(items, groups, remarks, autopilot)
    return tuple(items), tuple(origins)


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


FENCE_VERSION = Rule(
    "L107 fence-version",
    Severity.ERROR,
    summary="The fence or the rally points are where, or of a version that, every loader ignores.",
    why="The file looks fenced and the vehicle flies without a fence; no program reports it.",
    how="A section of version 1 or none, called otherwise ('geofence'), inside the mission, or in a file "
    "from before plans; and something in it besides empty lists.",
    fix="draw the fence again in QGroundControl and save",
    instead="a fence of a known version",
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
    if _holds(section.value):
        which = "of version 1" if "version" in section.value else "without a version"
        message = f"{what} is {which}: every loader ignores what is in it, and so does this check"
        remarks.add(FENCE_VERSION, message, place=section.place())
    return False


def _holds(section: object) -> bool:
    """Return whether there is anything in a section besides empty lists."""
    if not isinstance(section, dict):
        return bool(section)
    return any(value not in ([], {}, None) for key, value in section.items() if key != "version")


_SECTIONS = frozenset({"geofence", "fence", "rallypoints", "rally"})
_AREAS = frozenset({"polygon", "polygons", "circle", "circles", "area", "areas"})


def _check_unread(
    fields: JsonFields, read: Collection[str], remarks: Remarks, meant: Collection[str] = _SECTIONS
) -> None:
    """Report fences and rally points that are where no loader looks for them."""
    for key, value in fields.value.items():
        if key.lower().replace("_", "") in meant and key not in read and _holds(value):
            message = f"'{key}' is where no loader looks: all ignore what is in it, and so does this check"
            remarks.add(FENCE_VERSION, message, place=fields.place(key))


def _read_fence(section: JsonFields, remarks: Remarks) -> Fence | None:
    """Return the fence of a plan; ``None`` where every loader passes over it (version 1 or none)."""
    if not _is_current(section, "the fence", remarks):
        return None
    _check_keys(section, ("polygons", "circles"), remarks)
    _check_unread(section, ("polygons", "circles"), remarks, _AREAS)
    polygons, circles = [], []
    for area in _areas(section, "polygons", remarks):
        vertices = tuple(area.position("polygon", n) for n in range(len(area.listed("polygon"))))
        place = area.place()
        if encloses_area(area.title, vertices, remarks, place):
            inclusion = area.truth("inclusion")
            polygons.append(FencePolygon(inclusion=inclusion, vertices_deg=vertices, place=place))
    for area in _areas(section, "circles", remarks):
        circle = area.fields("circle", area.title)
        circle.listed("center")
        latitude_deg, longitude_deg = circle.position("center")
        radius_m = circle.number("radius")
        if radius_m <= 0.0:
            message = f"{area.title} has radius {radius_m:g} m and encloses nothing: left out"
            remarks.add(FENCE_INCOMPLETE, message, place=area.place())
            continue
        circles.append(
            FenceCircle(
                inclusion=area.truth("inclusion"),
                latitude_deg=latitude_deg,
                longitude_deg=longitude_deg,
                radius_m=radius_m,
                place=area.place(),
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


def _areas(section: JsonFields, key: str, remarks: Remarks) -> Iterator[JsonFields]:
    """Yield the polygons or circles of a fence; a missing list is an empty one."""
    for index, raw in enumerate(section.listed(key) if key in section.value else ()):
        if not isinstance(raw, dict):
            section.refuse(f"'{key}' element {index + 1} must be an object", key, index)
        title = f"fence {key.removesuffix('s')} {index + 1}"
        area = JsonFields(document=section.document, value=raw, title=title)
        area.whole("version", least=AREA_VERSION, most=AREA_VERSION, default=AREA_VERSION)
        _check_keys(area, ("version",), remarks)
        yield area


def _check_keys(fields: JsonFields, keys: tuple[str, ...], remarks: Remarks) -> None:
    """Report keys that QGroundControl requires and we can do without."""
    for key in keys:
        if key not in fields.value:
            message = f"{fields.title} has no '{key}': QGroundControl refuses the file"
            remarks.add(PLAN_VALUE, message, place=fields.place())


def _read_rally_points(section: JsonFields, remarks: Remarks) -> tuple[RallyPoint, ...]:
    if not _is_current(section, "the list of rally points", remarks):
        return ()
    if not (raw_points := section.listed("points")):
        return ()  # as most: no place in the text is looked for
    points = []
    places = section.document.element_places(section.value, "points")
    for index, (raw, place) in enumerate(zip(raw_points, places, strict=True)):
        if not isinstance(raw, list) or len(raw) != 3:
            section.refuse(
                f"rally point {index + 1} must be [latitude, longitude, altitude]", "points", index
            )
        place_deg = section.position("points", index)
        height_m = section.altitude("points", index, 2)
        if height_m is None:
            message = f"rally point {index + 1} has no altitude: left out"
            remarks.add(FENCE_ITEM_BROKEN, message, place=place)
        else:
            points.append(RallyPoint(*place_deg, height_m, place))
    return tuple(points)
