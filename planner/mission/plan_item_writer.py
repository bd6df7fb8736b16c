"""The list of items of a plan: elements of the file kept, changed or new."""

from __future__ import annotations

from itertools import groupby
from typing import TYPE_CHECKING, Any

from planner.mission.commands import has_location
from planner.mission.jump_numbers import numbered_in_order
from planner.mission.plan import PlanDocument
from planner.mission.simple_item import (
    ALTITUDE_KEYS,
    ALTITUDE_MODE_OF_FRAME,
    CALCULATED_MODE,
    has_whole_copies,
    is_complex,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.mission.items import Mission, MissionItem

_OLDER_KEYS = ("coordinate", "id", "param1", "param2", "param3", "param4")
_LARGEST_EXACT = 2**53
"""Whole numbers up to here are the same in a double."""


def write_elements(items: tuple[MissionItem, ...], *, before: Mission) -> list[dict[str, Any]]:
    """Return the elements of a plan's ``items``.

    An item that stands at the place of an element of the file is written on top of it, so that
    keys nobody knows are kept.  A complex item stays while all of its items are as they were, and
    one that stands for no items keeps its place in the list.

    Parameters
    ----------
    items : tuple of MissionItem
        In flown order; they are numbered anew unless they are those of ``before``.
    before : Mission
        The mission as it was read; its document is not changed.
    """
    document = before.document if isinstance(before.document, PlanDocument) else None
    elements = [] if document is None else document.elements
    spans = {} if document is None else _spans(document.origins)
    origins = {before.items[span.start].place: origin for origin, span in spans.items()}
    numbered = items if items == before.items else numbered_in_order(items)
    waiting = [index for index in range(len(elements)) if index not in spans]
    written: list[dict[str, Any]] = []
    at = 0
    while at < len(items):
        origin = origins.get(items[at].place)
        raw: dict[str, Any] = {}
        if origin is not None:
            while waiting and waiting[0] < origin:
                written.append(_named_complex(elements[waiting.pop(0)]))
            raw = elements[origin]
            if is_complex(raw):
                group = before.items[spans[origin]]
                end = at + len(group)
                if items[at:end] == group:
                    written.append(_complex_element(numbered[at:end], raw))
                    at = end
                    continue
                raw = {}
        written.append(_simple_element(numbered[at], raw))
        at += 1
    written += (_named_complex(elements[index]) for index in waiting)
    return written


def put(fields: dict[str, Any], key: str, value: object) -> None:
    """Set a key, unless the file says the same in its own way of writing."""
    was = fields.get(key)
    if was != value or isinstance(was, bool) is not isinstance(value, bool):  # 1 == True
        fields[key] = value


def _spans(origins: Sequence[int]) -> dict[int, slice]:
    """Return for each element that stands for items which of them they are."""
    spans: dict[int, slice] = {}
    for origin, group in groupby(range(len(origins)), key=origins.__getitem__):
        indexes = list(group)
        spans[origin] = slice(indexes[0], indexes[-1] + 1)
    return spans


def _named_complex(raw: dict[str, Any]) -> dict[str, Any]:
    """Return a complex item that says it is one."""
    return raw if raw.get("type") == "ComplexItem" else raw | {"type": "ComplexItem"}


def _complex_element(items: Sequence[MissionItem], raw: dict[str, Any]) -> dict[str, Any]:
    """Return a complex item as it was, the items that it holds with their present numbers."""
    raw = _named_complex(raw)
    transects = raw.get("TransectStyleComplexItem")
    if not isinstance(transects, dict) or "Items" not in transects:
        return raw
    inner = [_simple_element(*pair) for pair in zip(items, transects["Items"], strict=True)]
    return raw | {"TransectStyleComplexItem": transects | {"Items": inner}}


def _simple_element(item: MissionItem, raw: dict[str, Any]) -> dict[str, Any]:
    """Return an item on top of what the file held at its place."""
    element = dict(raw)
    params = raw.get("params", [])
    has_present_form = len(params) == 7 and "coordinate" not in raw
    if not has_present_form:
        for key in _OLDER_KEYS:
            element.pop(key, None)
    has_same_altitude = (
        has_present_form
        and (params[6], raw["frame"]) == (item.altitude_m, item.frame)
        and has_whole_copies(raw)
    )
    if not has_same_altitude:
        for key in ALTITUDE_KEYS:
            element.pop(key, None)
        element |= _altitude_copies(item)
    put(element, "autoContinue", item.autocontinue)
    put(element, "command", item.command)
    if item.jump_id is None:
        element.pop("doJumpId", None)
    else:
        put(element, "doJumpId", item.jump_id)
    put(element, "frame", item.frame)
    values = (
        *(item.param1, item.param2, item.param3, item.param4),
        *(item.latitude_deg, item.longitude_deg, item.altitude_m),
    )
    put(element, "params", [_number(value) for value in values])
    put(element, "type", "SimpleItem")
    return element


def _altitude_copies(item: MissionItem) -> dict[str, Any]:
    """Return the copies that QGroundControl shows, as it writes them itself.

    It leaves them out of items without a place, and refuses them without a number.
    """
    mode = ALTITUDE_MODE_OF_FRAME.get(item.frame)
    if item.unresolved_agl_m is not None:
        values = (None, _number(item.unresolved_agl_m), CALCULATED_MODE)
        return dict(zip(ALTITUDE_KEYS, values, strict=True))
    if item.altitude_m is None or mode is None or not has_location(item.command):
        return {}
    return dict(zip(ALTITUDE_KEYS, (None, _number(item.altitude_m), mode), strict=True))


def _number(value: float | None) -> float | None:
    """Return a number that is written in the fewest digits: ``5`` for 5.0."""
    if value is None or value % 1.0 or abs(value) > _LARGEST_EXACT:
        return value
    return int(value)
