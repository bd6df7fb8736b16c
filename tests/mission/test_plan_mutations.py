"""Whatever happens to a plan, it is read or refused in a sentence, never in a traceback."""

from __future__ import annotations

import copy
import json
import math
from typing import TYPE_CHECKING, Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from plan_text import LANDING, PLAN, STRUCTURE_SCAN
from thinning import examples

from planner.errors import MissionFileError
from planner.mission.formats.plan import read_plan_text

if TYPE_CHECKING:
    from planner.mission.items import Mission

OLDER_SURVEY: dict[str, Any] = {
    "type": "ComplexItem",
    "complexItemType": "survey",
    "version": 3,
    "cameraTriggerDistance": 20,
    "hoverAndCapture": True,
    "grid": {
        "altitude": 50,
        "angle": 30,
        "relativeAltitude": True,
        "spacing": 25,
        "turnAroundDistance": 10,
    },
    "polygon": [[47.398, 8.545], [47.398, 8.546], [47.399, 8.546]],
}
FULL = copy.deepcopy(PLAN)
FULL["mission"]["items"] += [STRUCTURE_SCAN, LANDING, OLDER_SURVEY]
LEGACY = {
    "MAV_AUTOPILOT": 3,
    "complexItems": [],
    "items": [
        {
            "autoContinue": True,
            "command": 16,
            "coordinate": [47.4, 8.5, 30],
            "frame": 3,
            "id": 1,
            "param1": 0,
            "param2": 0,
            "param3": 0,
            "param4": 0,
            "type": "missionItem",
        }
    ],
    "plannedHomePosition": {"coordinate": [47.3, 8.5, 400], "id": 0},
    "version": "1.0",
}
STARTS = st.sampled_from([FULL, LEGACY])
VALUES = st.sampled_from(
    [
        None,
        True,
        "",
        "Plan",
        "survey",
        0,
        -1,
        2,
        7,
        1e-300,
        1e300,
        -1e38,
        10**400,
        [],
        [0, 0],
        [None] * 7,
        {},
        {"a": [{}]},
        copy.deepcopy(PLAN["mission"]["items"][2]),
        STRUCTURE_SCAN,
    ]
)


def paths(value: Any, path: tuple[str | int, ...] = ()) -> list[tuple[str | int, ...]]:  # noqa: ANN401 (JSON)
    inner: list[tuple[str | int, Any]] = []
    if isinstance(value, dict):
        inner = list(value.items())
    elif isinstance(value, list):
        inner = list(enumerate(value))
    return [path, *(each for key, below in inner for each in paths(below, (*path, key)))]


def read_or_refuse(text: str) -> Mission | None:
    try:
        return read_plan_text(text, source="a.plan")
    except MissionFileError:
        return None


def check(mission: Mission | None) -> None:
    for item in () if mission is None else mission.items:
        numbers = [
            *(item.param1, item.param2, item.param3, item.param4),
            *(item.latitude_deg, item.longitude_deg, item.altitude_m),
        ]
        assert all(value is None or math.isfinite(value) for value in numbers)
        assert type(item.command) is int
        assert item.place is not None


def test_the_unchanged_files_are_read() -> None:
    for start in (FULL, LEGACY):
        mission = read_or_refuse(json.dumps(start))
        assert mission is not None
        check(mission)


@settings(max_examples=examples(120), deadline=None)
@given(start=STARTS, data=st.data())
def test_values_may_change_to_anything(start: dict[str, Any], data: st.DataObject) -> None:
    plan: Any = copy.deepcopy(start)
    for _ in range(data.draw(st.integers(1, 3))):
        path = data.draw(st.sampled_from(paths(plan)))
        value = copy.deepcopy(data.draw(VALUES))
        if not path:
            plan = value
            break
        target = plan
        for step in path[:-1]:
            target = target[step]
        if data.draw(st.booleans()):
            target[path[-1]] = value
        else:
            del target[path[-1]]
        if not isinstance(plan, dict) or not plan:
            break
    check(read_or_refuse(json.dumps(plan, indent=data.draw(st.sampled_from([None, 2])))))


@settings(max_examples=examples(100), deadline=None)
@given(start=STARTS, data=st.data())
def test_texts_may_be_cut_repeated_or_overwritten(
    start: dict[str, Any], data: st.DataObject
) -> None:
    text = json.dumps(start, indent=1)
    begin = data.draw(st.integers(0, len(text)))
    end = data.draw(st.integers(begin, min(len(text), begin + 200)))
    junk = data.draw(st.text('{}[]",:0189eE+-.\\ \nNa\x00é\ud800', max_size=10))
    change = data.draw(st.sampled_from(["cut", "repeat", "overwrite", "truncate"]))
    changed = {
        "cut": text[:begin] + text[end:],
        "repeat": text[:end] + text[begin:end] + text[end:],
        "overwrite": text[:begin] + junk + text[end:],
        "truncate": text[:begin],
    }[change]
    check(read_or_refuse(changed))


@settings(max_examples=examples(60), deadline=None)
@given(data=st.binary(max_size=60))
def test_random_bytes_are_refused(data: bytes) -> None:
    assert read_or_refuse(data.decode("latin-1")) is None


@pytest.mark.parametrize("start", [FULL, LEGACY], ids=["plan", "legacy"])
@pytest.mark.parametrize("value", [None, True, "x", 10**400, [[]], {}], ids=repr)
def test_every_value_may_be_of_the_wrong_type(start: dict[str, Any], value: object) -> None:
    for path in paths(start)[1:]:
        plan: Any = copy.deepcopy(start)
        target = plan
        for step in path[:-1]:
            target = target[step]
        target[path[-1]] = value
        check(read_or_refuse(json.dumps(plan)))


@pytest.mark.parametrize("start", [FULL, LEGACY], ids=["plan", "legacy"])
def test_every_key_may_be_missing_or_stand_twice(start: dict[str, Any]) -> None:
    for path in paths(start)[1:]:
        plan: Any = copy.deepcopy(start)
        target = plan
        for step in path[:-1]:
            target = target[step]
        if isinstance(path[-1], str):
            key = json.dumps(path[-1])
            target["\ue000"] = target[path[-1]]
            twice = json.dumps(plan, ensure_ascii=False).replace('"\ue000"', key)
            with pytest.raises(MissionFileError, match="appears twice"):
                read_plan_text(twice, source="a.plan")
            del target["\ue000"]
        del target[path[-1]]
        check(read_or_refuse(json.dumps(plan)))
