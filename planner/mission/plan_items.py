"""The list of items of a plan, complex items expanded: what the vehicle would receive."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.catalogue.loader import JUMP_IDS, JUMP_INTO_COMPLEX_ITEM, JUMP_SHIFTED
from planner.frozen import frozen
from planner.mission.commands import Command
from planner.mission.items import MOST_ITEMS, make_items
from planner.mission.json_document import describe
from planner.mission.json_fields import JsonFields
from planner.mission.simple_item import SimpleItemReader

if TYPE_CHECKING:
    from planner.findings import Place
    from planner.mission.items import MissionItem
    from planner.mission.remarks import Remarks


@frozen
class PlanItems:
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
    remarks : Remarks
        Where findings go.
    autopilot : Autopilot, optional
        For which the file was written.
    is_legacy : bool
        Whether the file is from before plans, where older forms of items are nothing to tell.

    Raises
    ------
    MissionFileError
        If an item cannot be understood, or there are more than MAVLink can send.
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
    """Return the mission items that a complex item stands for."""
    from planner.mission.complex_items import ComplexItemReader  # many missions hold none

    reader = ComplexItemReader(simple_items=simple_items, remarks=remarks)
    return reader.read(raw, place, first_number=first_number)


def _compare_jump_ids(items: list[MissionItem], remarks: Remarks) -> None:
    """Tell about ids that leave open where a DO_JUMP goes."""
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


def _check_jumps(
    items: list[MissionItem],
    groups: list[tuple[int, list[MissionItem]]],
    remarks: Remarks,
    autopilot: Autopilot | None,
) -> None:
    """Tell where ground stations make something else of a DO_JUMP than the file says."""
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
