"""What QGroundControl, MAVSDK or an autopilot refuse or misread is refused or told here."""

from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

import pytest
from plan_text import PLAN, STRUCTURE_SCAN, SURVEY, plan_of, plan_with, simple_item
from qgc_rules import RefusedError, refuse_plan

from planner.errors import MissionFileError
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.writers import plan_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.mission.items import Mission

WRONG_VALUES: tuple[object, ...] = (None, "text", 9, True, [], {})
REFUSED_BY_QGROUNDCONTROL = ("QGroundControl", "every loader")
UNEXPANDED = "L112"
"""Says that part of the mission is missing, whatever QGroundControl makes of it."""


def read(text: str) -> Mission:
    return read_plan_text(text, source="m.plan")


def every_path(value: object, path: tuple[str | int, ...] = ()) -> Iterator[tuple[str | int, ...]]:
    if path:
        yield path
    inner: dict[Any, object] = {}
    if isinstance(value, dict):
        inner = value
    elif isinstance(value, list):
        inner = dict(enumerate(value))
    for key, each in inner.items():
        yield from every_path(each, (*path, key))


def changed_plans() -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the plan with each of its values left out, or of a wrong type, one at a time."""
    plan = copy.deepcopy(PLAN)
    plan["mission"]["items"].insert(3, copy.deepcopy(STRUCTURE_SCAN))
    for path in every_path(plan):
        for wrong in ("left out", *WRONG_VALUES):
            changed = copy.deepcopy(plan)
            holder: Any = changed
            for step in path[:-1]:
                holder = holder[step]
            if wrong != "left out":
                holder[path[-1]] = wrong
            elif isinstance(holder, dict):
                del holder[path[-1]]
            # QGroundControl casts any number to a mode; only what is written is held to those.
            if not (path[-1] == "AltitudeMode" and wrong == 9):
                yield f"{path} {wrong!r}", changed


def is_refused(plan: dict[str, Any]) -> bool:
    try:
        refuse_plan(json.dumps(plan))
    except (RefusedError, AttributeError, KeyError, TypeError):  # no object where one is due
        return True
    return False


def test_what_qgroundcontrol_refuses_is_refused_or_told() -> None:
    silent, refused, told = [], 0, 0
    for name, plan in changed_plans():
        if not is_refused(plan):
            continue
        try:
            findings = read(json.dumps(plan)).findings
        except MissionFileError:
            refused += 1
            continue
        told += 1
        if not any(
            f.code == UNEXPANDED or any(word in f.message for word in REFUSED_BY_QGROUNDCONTROL)
            for f in findings
        ):
            silent.append(name)
    assert silent == []
    assert refused > 300
    assert told > 100


def test_what_is_read_all_the_same_is_written_so_that_qgroundcontrol_opens_it() -> None:
    """Complex items apart, which are kept as they are: what is wrong in them has been told."""
    complex_items = {("mission", "items", 2), ("mission", "items", 3)}
    checked = 0
    for name, plan in changed_plans():
        if any(str(path)[:-1] in name and "'type'" not in name for path in complex_items):
            continue
        try:
            mission = read(json.dumps(plan))
        except MissionFileError:
            continue
        refuse_plan(plan_text(mission))
        checked += 1
    assert checked > 100


def test_a_jump_into_a_complex_item_is_refused_by_qgroundcontrol_and_told() -> None:
    jump = simple_item(177, 2, 4, 1, 0, 0, 0, 0, 0, number=5)
    takeoff, waypoint = PLAN["mission"]["items"][:2]
    text = plan_of(takeoff, waypoint, SURVEY, jump)
    assert is_refused(json.loads(text))
    [finding] = read(text).findings
    assert finding.code == "L120"
    assert finding.item == 5
    assert "leads to item 4, inside a complex item" in finding.message


@pytest.mark.parametrize(("firmware", "codes"), [(12, ["L121"]), (3, []), (0, [])])
def test_a_jump_of_a_px4_plan_goes_astray_in_mavsdk(firmware: int, codes: list[str]) -> None:
    """The importer itself is asked in test_mavsdk_importer.py."""
    takeoff, waypoint = PLAN["mission"]["items"][:2]
    jump = simple_item(177, 2, 2, 1, 0, 0, 0, 0, 0, number=3)
    plan = json.loads(plan_of(takeoff, waypoint, jump))
    plan["mission"]["firmwareType"] = firmware
    assert [finding.code for finding in read(json.dumps(plan)).findings] == codes


@pytest.mark.parametrize(
    ("value", "path", "sentence"),
    [
        (None, ("groundStation",), "'groundStation' is null, expected a text"),
        ("5", ("mission", "hoverSpeed"), "'hoverSpeed' is the text '5', expected a number"),
        (None, ("mission", "items", 0, "doJumpId"), "'doJumpId' of item 1 is null"),
        (None, ("mission", "items", 0, "Altitude"), "item 1 needs a number in 'Altitude'"),
        ("Survey", ("mission", "items", 2, "type"), "'type' is the text 'Survey'"),
    ],
)
def test_the_value_that_qgroundcontrol_refuses_is_named(
    value: object, path: tuple[str | int, ...], sentence: str
) -> None:
    text = plan_with(value, *path)
    assert is_refused(json.loads(text))
    [finding] = read(text).findings
    assert finding.code == "L119"
    assert sentence in finding.message
