"""A mission in another file format, and what it loses on the way.

Nothing is called written before it was read back: most losses are found by comparing what the
text holds with what the mission holds.
"""

from __future__ import annotations

import math
from collections import Counter
from itertools import chain
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import MissionFileError, OutputError, UsageError
from planner.findings import Remarks, Rule, Severity
from planner.mission.commands import TAKEOFFS, Command, is_navigation
from planner.mission.formats.plan import PlanDocument, read_plan_text
from planner.mission.formats.simple_item import is_complex
from planner.mission.formats.wpl import read_wpl
from planner.mission.formats.writers import plan_text, wpl_text, written_items
from planner.mission.items import MissionFormat, MissionItem, bare_command, numbered_in_order
from planner.mission.route.order import flown_order
from planner.mission.route.queue import JUMPS, is_queued
from planner.mission.route.route import make_route
from planner.mission.route.stage import RETURN_STAGES, StageKind
from planner.units import FASTEST_M_S
from planner.values import Value, field_names, replace

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from planner.findings import Finding
    from planner.geo.fence import Fence
    from planner.mission.items import Mission
    from planner.mission.route.stage import Route
SPEED_REPLACED = Rule(
    "T111 speed-replaced",
    Severity.WARNING,
    summary="The flight is predicted at another speed than the mission commands.",
    why="What is predicted is a mission which is not in the file; the vehicle flies that which is.",
    how="A speed is given that some leg of the mission is not flown at.  The mission is judged at its own "
    "speeds as well: an error then is one.  Only speed, sweep and what is tried in review, "
    "which ask what if, go by the other alone; upload and guard take no speed.",
    fix="write the mission with this speed (mavjoule convert --speed) and check that file",
)


_FORMAT_NAMES = {MissionFormat.PLAN: "a plan", MissionFormat.WPL: "QGC WPL text"}
_WRITTEN_KEYS = frozenset(
    {"fileType", "version", "groundStation", "mission", "geoFence", "rallyPoints"}
    | {"items", "plannedHomePosition"}
)
"""Keys of a plan whose content the text has, or whose loss has a finding of its own."""
_WRITTEN_ITEM_KEYS = frozenset(
    {"type", "command", "frame", "params", "autoContinue", "doJumpId"}
    | {"Altitude", "AltitudeMode", "AMSLAltAboveTerrain"}
    | {"coordinate", "id", "param1", "param2", "param3", "param4"}
)


class Conversion(Value):
    """The text of a mission in a file format."""

    text: str
    findings: tuple[Finding, ...]
    """What it does not hold, and what reading it brings to light that was not known before."""


def convert_mission(mission: Mission, file_format: MissionFormat) -> Conversion:
    """Return the text of a mission in a file format, and what it loses.

    Raises OutputError if the format cannot hold what the mission holds, so that the text could not be
    read.
    """
    is_plan = file_format is MissionFormat.PLAN
    text = plan_text(mission) if is_plan else wpl_text(mission)
    try:
        back = (read_plan_text if is_plan else read_wpl)(text, source=mission.source)
    except MissionFileError as error:
        name = _FORMAT_NAMES[file_format]
        msg = f"{mission.source}: cannot be written as {name}: {error.message}"
        raise OutputError(msg) from error
    known = {finding.code for finding in mission.findings}
    findings = (
        *_check_items(mission, back),
        *_check_jumps(mission.items),
        *_check_areas(mission, back),
        *_check_unknown_areas(mission, back),
        *_check_home(mission, back),
        *_check_complex_items(mission, back),
        *_check_keys(mission, back),
        *_check_comments(mission),
        *(finding for finding in back.findings if finding.code not in known),
    )
    return Conversion(text=text, findings=findings)


WRITTEN_DIFFERENTLY = Rule(
    "L207 written-differently",
    Severity.ERROR,
    summary="The written file differs from the mission.",
    why="It would not be flown as the one that was checked.",
    how="What is written is read back and compared value by value: items with their jumps, home, "
    "fence, rally points.",
    fix="write the other format, and do not fly this file",
)


def _check_items(mission: Mission, back: Mission) -> Iterator[Finding]:
    """Yield a finding where the items read back differently; their numbers may."""
    is_text = back.file_format is MissionFormat.WPL
    items = written_items(mission) if is_text else numbered_in_order(mission.items)
    pairs = zip(items, numbered_in_order(back.items), strict=False)
    for number, (item, read) in enumerate(pairs, start=1):
        if item != replace(read, place=item.place):
            changed = ", ".join(
                name
                for name in field_names(item)
                if name != "place" and getattr(item, name) != getattr(read, name)
            )
            message = f"item {number} reads back with another {changed}"
            yield WRITTEN_DIFFERENTLY.finding(message, item=number)
            return
    if len(mission.items) != len(back.items):
        message = f"items written: {len(mission.items)}, read back: {len(back.items)}"
        yield WRITTEN_DIFFERENTLY.finding(message)


JUMP_NOT_WRITTEN = Rule(
    "L208 jump-not-written",
    Severity.WARNING,
    summary="A jump leads to an item that is not there.",
    why="QGroundControl refuses a plan with such a jump; ArduPilot ends the mission at it.",
    how="The target of DO_JUMP is compared with the numbers of the items.",
    fix="give the jump the number of an item",
)


def _check_jumps(items: Sequence[MissionItem]) -> tuple[Finding, ...]:
    remarks = Remarks()
    for number, item in enumerate(numbered_in_order(items), start=1):
        if item.command != Command.DO_JUMP:
            continue
        if item.param1 is None or not 1 <= int(item.param1) <= len(items):
            named = items[number - 1].param1
            what = "no item" if named is None else f"item {named:g}, which does not exist"
            remarks.add(JUMP_NOT_WRITTEN, f"the DO_JUMP of item {number} names {what}", item=number)
    return remarks.findings()


AREAS_NOT_WRITTEN = Rule(
    "L201 areas-not-written",
    Severity.WARNING,
    summary="The fence or the rally points are not in the written file.",
    why="A QGC WPL file is one list of items.  Fence and rally rows among the items of a mission make "
    "an autopilot refuse the upload, so a mission in this format flies without them unless they are "
    "loaded from elsewhere.",
    how="Text is written without fence and rally points wherever there are items to fly.",
    fix="write a .plan, or load fence and rally points from a file of their own",
)


def _check_areas(mission: Mission, back: Mission) -> Iterator[Finding]:
    lost: list[str] = []
    fence, read_fence = _placeless_fence(mission.fence), _placeless_fence(back.fence)
    rally, read_rally = (
        [replace(point, place=None) for point in points] for points in (mission.rally, back.rally)
    )
    if fence is not None and read_fence is None:
        lost.append(f"the fence ({quantity.count(fence.area_count, 'area')})")
    elif fence != read_fence:
        yield WRITTEN_DIFFERENTLY.finding("the fence reads back with other areas")
    polygons = () if mission.fence is None else mission.fence.polygons
    inside = [polygon for polygon in polygons if polygon.inclusion and polygon.area]
    if len(inside) > 1:
        areas = quantity.count(len(inside), "area")
        yield WRITTEN_DIFFERENTLY.finding(
            f"of {areas} to stay inside one is enough in the drawing; of a fence each has to be kept",
            fix="draw them as one area",
        )
    if rally and not read_rally:
        lost.append(quantity.count(len(rally), "rally point"))
    elif rally != read_rally:
        yield WRITTEN_DIFFERENTLY.finding("the rally points read back at other places")
    if lost:
        message = f"left out {' and '.join(lost)}: QGC WPL text has no place for them beside items"
        yield AREAS_NOT_WRITTEN.finding(message)


AREAS_TAKEN_FOR_NONE = Rule(
    "L213 areas-taken-for-none",
    Severity.WARNING,
    summary="A plan is written that states no fence and no rally points; the text did not say.",
    why="A check of the plan looks at no fence that the vehicle may hold (F114 asks it of a text), and a "
    "ground station that sends the plan removes fence and rally points from the vehicle.",
    how="QGC WPL text without fence and rally rows is written as a plan.",
    fix="add the vehicle's fence and rally points to the plan: mavjoule fetch reads them",
)


def _check_unknown_areas(mission: Mission, back: Mission) -> Iterator[Finding]:
    if (
        mission.file_format is MissionFormat.WPL
        and mission.fence is None
        and back.fence is not None
    ):
        yield AREAS_TAKEN_FOR_NONE.finding(
            "the text does not say what fence and rally points there are: the plan states none"
        )


def _placeless_fence(fence: Fence | None) -> Fence | None:
    """Return a fence without places in a file, ``None`` for one that holds nothing."""
    if fence is None or not (fence or fence.breach_return_deg_m):
        return None
    breach_return = fence.breach_return_deg_m
    if breach_return is not None:  # no autopilot uses its altitude, and text has 0 for none
        breach_return = (*breach_return[:2], breach_return[2] or 0.0)
    return replace(
        fence.as_held,
        polygons=tuple(replace(polygon, place=None) for polygon in fence.as_held.polygons),
        circles=tuple(replace(circle, place=None) for circle in fence.circles),
        breach_return_deg_m=breach_return,
        readings=(),
    )


HOME_NOT_KNOWN = Rule(
    "L205 home-not-known",
    Severity.INFO,
    summary="The home row is partly or wholly unknown.",
    why="The first row of a QGC WPL file has to be home, with numbers.  Autopilots replace it with "
    "their own home, but ground stations show it and judge AMSL altitudes by it.",
    how="An unknown home is written as 0, 0 as Mission Planner does; where only its altitude is "
    "unknown, as 0 m above itself.",
    fix="set the planned home in a ground station",
)


def _check_home(mission: Mission, back: Mission) -> Iterator[Finding]:
    home = mission.home
    is_text = back.file_format is MissionFormat.WPL
    if is_text and home is not None and home.latitude_deg == home.longitude_deg == 0.0:
        yield HOME_NOT_KNOWN.finding("home at 0, 0 reads back as unknown, as text writes it")
    elif home != back.home:
        yield WRITTEN_DIFFERENTLY.finding("home reads back at another place")
    elif is_text and mission.items:
        if home is None:
            yield HOME_NOT_KNOWN.finding("home unknown: written as 0, 0")
        elif home.altitude_amsl_m is None:
            message = "altitude of home unknown: written as 0 m above home itself"
            yield HOME_NOT_KNOWN.finding(message)


COMPLEX_ITEMS_WRITTEN_OUT = Rule(
    "L202 complex-items-written-out",
    Severity.INFO,
    summary="Surveys and other complex items are written as the items they expand to.",
    why="The same is flown, but the area can no longer be edited as one.",
    how="Counts the complex items that the file held and the written one does not.",
    fix="keep the plan to edit it",
)

COMPLEX_ITEM_NOT_WRITTEN = Rule(
    "L203 complex-item-not-written",
    Severity.ERROR,
    summary="A complex item that cannot be expanded is not in the written file.",
    why="Part of the mission is missing from the file, and nothing in it shows that.",
    how="Counts the complex items that expand to no items and are not in the written file.",
    fix="open the plan in QGroundControl, save it, and convert what it saved",
)


def _check_complex_items(mission: Mission, back: Mission) -> Iterator[Finding]:
    rules = (
        (COMPLEX_ITEMS_WRITTEN_OUT, "written as plain items"),
        (COMPLEX_ITEM_NOT_WRITTEN, "cannot be expanded: not in the written file"),
    )
    kinds = zip(_complex_kinds(mission), _complex_kinds(back), rules, strict=True)
    for before, after, (rule, what) in kinds:
        if lost := before - after:
            items = quantity.count(lost.total(), "complex item")
            yield rule.finding(f"{items} ({', '.join(lost)}) {what}")


def _complex_kinds(mission: Mission) -> tuple[Counter[str], Counter[str]]:
    """Return the kinds of complex items with items, and of those without."""
    kinds: tuple[Counter[str], Counter[str]] = (Counter(), Counter())
    document = mission.document
    if isinstance(document, PlanDocument):
        with_items = set(document.origins)
        for index, raw in enumerate(document.elements):
            if is_complex(raw):
                kind = str(raw.get("complexItemType", raw.get("type")))
                kinds[index not in with_items][kind] += 1
    return kinds


KEYS_NOT_WRITTEN = Rule(
    "L204 keys-not-written",
    Severity.INFO,
    summary="QGC WPL text has no place for some keys of the plan.",
    why="QGC WPL text names no firmware and no kind of vehicle, so a check of it cannot detect that "
    "the mission was meant for another one.",
    how="Lists the keys at the top of the plan and of its mission that have no counterpart.",
    fix="name the autopilot when you check the text, as with --autopilot px4",
)


def _check_keys(mission: Mission, back: Mission) -> Iterator[Finding]:
    """Yield what a plan holds beyond its items, home, fence and rally points."""
    lost: list[str] = []
    document = mission.document
    if isinstance(document, PlanDocument):
        if back.file_format is MissionFormat.WPL:
            keys = (*document.json.root, *document.section)
            lost += [key for key in keys if key not in _WRITTEN_KEYS]
            simple = (raw for raw in document.elements if not is_complex(raw))
            keys = tuple(dict.fromkeys(key for raw in simple for key in raw))
            lost += [f"items.{key}" for key in keys if key not in _WRITTEN_ITEM_KEYS]
    else:
        if mission.autopilot is not None and back.autopilot is not mission.autopilot:
            lost.append("the firmware")
        if mission.vehicle_kind is not None and back.vehicle_kind is not mission.vehicle_kind:
            lost.append("the kind of vehicle")
    if lost:
        names = ", ".join(dict.fromkeys(lost))
        message = f"{_FORMAT_NAMES[back.file_format]} has no place for {names}: left out"
        yield KEYS_NOT_WRITTEN.finding(message)


COMMENTS_NOT_WRITTEN = Rule(
    "L206 comments-not-written",
    Severity.INFO,
    summary="The comments of a text file are not in the written file.",
    why="JSON has no comments, and QGroundControl refuses text with any.",
    how="Counts lines that begin with '#' or '//' and rows followed by '#'.",
    fix="keep the file with the comments",
)


def _check_comments(mission: Mission) -> Iterator[Finding]:
    if isinstance(mission.document, str):
        comments = sum(
            "#" in line or line.lstrip().startswith("//") for line in mission.document.splitlines()
        )
        if comments:
            yield COMMENTS_NOT_WRITTEN.finding(f"{quantity.count(comments, 'comment')} left out")


_HORIZONTAL = frozenset({None, 0.0, 1.0})
"""Types of DO_CHANGE_SPEED that set the speed of level flight: airspeed and ground speed."""
_GROUND_SPEED = 1.0
_ELSEWHERE_M = 0.01
"""A place this near is the same one. [m]"""


def route_at_speed(route: Route, speed_m_s: float) -> Route:
    """Return a route whose every leg is flown at one speed over ground.

    Climbs and descents keep theirs, and so does a return, whose speed is set in the vehicle.
    """
    return next(routes_at_speeds(route, (speed_m_s,)))


def routes_at_speeds(route: Route, speeds_m_s: Iterable[float]) -> Iterator[Route]:
    """Yield a route at each of several speeds, as `route_at_speed`."""
    level = set(_level_stages(route))
    is_level = [number in level for number in range(len(route.stages))]
    for speed_m_s in speeds_m_s:
        _refuse(speed_m_s)
        stages = (
            replace(stage, speed_m_s=speed_m_s) if is_its else stage
            for stage, is_its in zip(route.stages, is_level, strict=True)
        )
        yield replace(route, stages=tuple(stages))


def level_speeds(route: Route) -> frozenset[float | None]:
    """Return the speeds a route commands on its level legs; ``None``: the vehicle's own. [m s⁻¹]"""
    return frozenset(route.stages[number].speed_m_s for number in _level_stages(route))


def mission_at_speed(mission: Mission, speed_m_s: float) -> Mission:
    """Return a mission that commands one speed for every level leg.

    Parameters
    ----------
    mission : Mission
        Its DO_CHANGE_SPEED of level flight are changed in place; one is inserted before the first leg
        where none governs that one, and the jumps lead where they led before.  In a file for PX4 every
        DO_CHANGE_SPEED counts as the speed of level flight; in one for any autopilot one is inserted behind
        those of climbs and descents, which PX4 takes for it.
    speed_m_s : float
        At most 100. [m s⁻¹]
    """
    _refuse(speed_m_s)
    dialect = mission.autopilot
    commanded = replace(
        bare_command(Command.DO_CHANGE_SPEED), param1=_GROUND_SPEED, param2=speed_m_s, param3=-1.0
    )
    kept = _of_returns(mission.items, dialect)
    written = [
        [item if number in kept else _changed(item, speed_m_s, dialect)]
        for number, item in enumerate(mission.items, start=1)
    ]
    if dialect is None:
        for number, rows in enumerate(written, start=1):
            is_other = (
                rows[0].command == Command.DO_CHANGE_SPEED and rows[0].param1 not in _HORIZONTAL
            )
            if is_other and number not in kept:
                rows.append(commanded)
    first = _first_ungoverned(mission, dialect)
    if first is not None:
        # A jump leads to the place behind it, as before: ArduPilot flies elsewhere from one to a DO_ item.
        written[first - 1].insert(0, commanded)
    items = tuple(chain.from_iterable(written))
    if len(items) > len(mission.items):
        items = numbered_in_order(items)
    return replace(mission, items=items)


def _refuse(speed_m_s: object) -> None:
    if isinstance(speed_m_s, bool) or not isinstance(speed_m_s, int | float):
        msg = f"a speed must be a number, got {speed_m_s!r}"
        raise UsageError(msg)
    if not 0.0 < speed_m_s <= FASTEST_M_S:
        msg = f"a speed must be above 0 and at most {FASTEST_M_S:g} m/s, got {speed_m_s}"
        raise UsageError(msg)


def _sets_level_speed(item: MissionItem, dialect: Autopilot | None) -> bool:
    return item.command == Command.DO_CHANGE_SPEED and (
        dialect is Autopilot.PX4 or item.param1 in _HORIZONTAL
    )


def _of_returns(items: Sequence[MissionItem], dialect: Autopilot | None) -> set[int]:
    """Return the items that only a return at the end comes behind, as ArduPilot flies: from 1.

    It is flown at their speeds but the first's (``MissionState.is_speed_late``); no level leg is.
    """
    if dialect is Autopilot.PX4:
        return set()
    returning, others = set[int](), set[int]()
    before, goes_on = others, False
    for number in reversed(flown_order(tuple(items), dialect).visits):
        command = items[number - 1].command
        goes_on |= command in TAKEOFFS
        if is_navigation(command):
            ends = command == Command.NAV_RETURN_TO_LAUNCH and not goes_on
            before = returning if ends else others
        before.add(number)
    return returning - others


def _changed(item: MissionItem, speed_m_s: float, dialect: Autopilot | None) -> MissionItem:
    if not _sets_level_speed(item, dialect):
        return item
    kind = item.param1 if item.param1 in _HORIZONTAL else _GROUND_SPEED
    return replace(item, param1=kind, param2=speed_m_s)


def _first_ungoverned(mission: Mission, dialect: Autopilot | None) -> int | None:
    """Return before which item a speed has to be set for the first level leg; ``None``: one is.

    That leg's own, or on ArduPilot the first of the queue before it: a speed behind another item of the
    queue is set on the way at best, and one behind a condition wherever that is met.  Where a jump leads
    there first, the jump.
    """
    route = make_route(mission, dialect=dialect)
    first = next(_level_stages(route), None)
    if first is None:
        return None
    leg = route.stages[first].item
    flown = {stage.item for stage in route.stages}
    queue: int | None = None
    visits = flown_order(mission.items, dialect).visits
    for number in visits:
        item = mission.items[number - 1]
        if number == leg:
            at = visits.index(queue or number)
            while at and (
                visits[at] != visits[at - 1] + 1
                or mission.items[visits[at - 1] - 1].command in JUMPS
            ):
                at -= 1
            return visits[at]
        if number in flown:
            queue = None
        elif queue is None and _sets_level_speed(item, dialect):
            return None
        elif is_queued(item.command) and dialect is not Autopilot.PX4:
            queue = queue or number
    return None


def _level_stages(route: Route) -> Iterator[int]:
    """Yield the positions of the stages whose speed the mission decides: returns do not count."""
    here, was_circle = (0.0, 0.0), False
    for number, stage in enumerate(route.stages):
        there, is_circle = (stage.east_m, stage.north_m), stage.kind is StageKind.CIRCLE
        goes = is_circle or was_circle or math.dist(here, there) > _ELSEWHERE_M
        if goes and stage.kind not in RETURN_STAGES:
            yield number
        here, was_circle = there, is_circle
