"""Formats from before plans: older JSON, text lists of fence and rally points."""

from __future__ import annotations

import json
from typing import Any

import pytest

from planner.autopilot import Autopilot
from planner.errors import MissionFileError
from planner.findings import Place
from planner.geo.fence import FencePolygon, RallyPoint
from planner.mission.formats.json_document import parse_json
from planner.mission.formats.plan import is_legacy, read_plan
from planner.mission.formats.wpl import read_fence_list, read_rally_list
from planner.mission.items import Home, Mission


def legacy_item(number: int, command: int = 16, **changes: Any) -> dict[str, Any]:  # noqa: ANN401 (JSON)
    return {
        "autoContinue": True,
        "command": command,
        "coordinate": [47.4, 8.5 + number / 1000, 30],
        "frame": 3,
        "id": number,
        "param1": 5,
        "param2": 0,
        "param3": 0,
        "param4": 90,
        "type": "missionItem",
    } | changes


VERSION_1 = {
    "MAV_AUTOPILOT": 3,
    "complexItems": [],
    "groundStation": "QGroundControl",
    "items": [legacy_item(1, 22), legacy_item(2), legacy_item(3, 177)],
    "plannedHomePosition": legacy_item(0, coordinate=[47.39, 8.49, 400], frame=0),
    "version": "1.0",
}
VERSION_2 = {
    "firmwareType": 12,
    "vehicleType": 2,
    "groundStation": "QGroundControl",
    "items": [
        {
            "autoContinue": True,
            "command": 16,
            "coordinate": [47.4, 8.5, 30],
            "doJumpId": 1,
            "frame": 3,
            "params": [0, 0, 0, 0],
            "type": "SimpleItem",
        }
    ],
    "plannedHomePosition": [47.39, 8.49, 400],
    "version": 2,
}


def read(value: dict[str, Any]) -> Mission:
    document = parse_json(json.dumps(value), source="a.mission")
    assert is_legacy(document)
    return read_plan(document, "a.mission")


def test_version_one_has_parameters_by_name_and_an_item_for_home() -> None:
    mission = read(VERSION_1)
    assert [item.command for item in mission.items] == [22, 16, 177]
    assert [item.jump_id for item in mission.items] == [1, 2, 3]
    item = mission.items[1]
    assert (item.param1, item.param4, item.longitude_deg) == (5.0, 90.0, 8.502)
    assert mission.home == Home(latitude_deg=47.39, longitude_deg=8.49, altitude_amsl_m=400.0)
    assert mission.autopilot is Autopilot.ARDUPILOT
    assert [finding.code for finding in mission.findings] == ["L117"]


@pytest.mark.parametrize("file_type", [None, "Mission"])
def test_version_two_is_a_mission_section_alone(file_type: str | None) -> None:
    value = VERSION_2 if file_type is None else VERSION_2 | {"fileType": file_type}
    mission = read(value)
    assert (mission.items[0].altitude_m, mission.items[0].param4) == (30.0, 0.0)
    assert mission.autopilot is Autopilot.PX4
    assert mission.home is not None
    assert [finding.code for finding in mission.findings] == ["L117"]


def test_a_missing_home_is_unknown() -> None:
    value = {key: each for key, each in VERSION_1.items() if key != "plannedHomePosition"}
    assert read(value).home is None


def test_complex_items_of_version_one_are_left_out_with_an_error() -> None:
    mission = read(VERSION_1 | {"complexItems": [{"complexItemType": "survey", "id": 2}]})
    assert "L112" in [finding.code for finding in mission.findings]


@pytest.mark.parametrize(
    "value",
    [
        {"fileType": "Plan", "items": [], "firmwareType": 12},
        {"mission": {}, "items": [], "firmwareType": 12},
        {"items": []},
        {"items": {}, "firmwareType": 12},
        [],
    ],
)
def test_a_plan_or_anything_else_is_not_taken_for_a_legacy_file(value: object) -> None:
    assert not is_legacy(parse_json(json.dumps(value), source="a.mission"))


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"version": 3}, "its version is 3, expected"),
        ({"items": [{"type": "missionItem"}]}, "item 1: its type is the text 'missionItem'"),
        ({"items": [legacy_item(1, coordinate=[1, 2])]}, "must be [latitude, longitude, altitude]"),
        ({"items": [legacy_item(1, coordinate=[91, 2, 3])]}, "its latitude is 91"),
        ({"items": [legacy_item(1, param2="x")]}, "its parameter 2 is the text 'x'"),
        ({"plannedHomePosition": {"coordinate": [1, 2]}}, "the planned home: 'coordinate' must be"),
        ({"plannedHomePosition": {}}, "the planned home: 'coordinate' is missing"),
        ({"MAV_AUTOPILOT": "PX4"}, "'MAV_AUTOPILOT' is the text 'PX4', expected a number"),
    ],
)
def test_a_legacy_file_that_cannot_be_understood_is_refused_with_its_place(
    changes: dict[str, Any], sentence: str
) -> None:
    with pytest.raises(MissionFileError) as caught:
        read(VERSION_1 | changes)
    assert sentence in caught.value.message
    assert caught.value.place is not None


def test_a_missing_parameter_is_refused() -> None:
    item = {key: value for key, value in legacy_item(1).items() if key != "param3"}
    with pytest.raises(MissionFileError, match="'param3' is missing"):
        read(VERSION_1 | {"items": [item]})


FENCE = "47.05\t8.05\n47.0\t8.0\n47.0\t8.1\n47.1\t8.1\n47.0\t8.0\n"


def test_a_fence_list_is_a_return_point_and_one_closed_polygon() -> None:
    mission = read_fence_list("# our field\n" + FENCE, source="fence.txt")
    assert mission.fence is not None
    assert mission.fence.polygons == (
        FencePolygon(
            inclusion=True, vertices_deg=((47.0, 8.0), (47.0, 8.1), (47.1, 8.1)), place=Place(3, 1)
        ),
    )
    assert mission.fence.breach_return_deg_m == (47.05, 8.05, None)
    assert mission.items == ()
    assert [finding.code for finding in mission.findings] == ["L157"]


def test_a_fence_that_is_not_closed_is_told() -> None:
    mission = read_fence_list(FENCE.replace("47.0\t8.0\n", "47.0\t7.9\n", 1), source="f")
    assert mission.fence is not None
    assert len(mission.fence.polygons[0].vertices_deg) == 4
    assert [finding.code for finding in mission.findings] == ["L158", "L157"]


def test_a_fence_of_two_points_is_left_out_and_told() -> None:
    mission = read_fence_list("47 8\n47.1 8.1\n", source="f")
    assert not mission.fence
    assert "L164" in [finding.code for finding in mission.findings]


def test_rally_lines_become_rally_points_above_home() -> None:
    text = "RALLY 47.1\t8.2\t60.0\t40.0\t0.0\t0\nRALLY 47.3\t8.4\t50\t40\t0\t0\n"
    mission = read_rally_list(text, source="r")
    assert mission.rally == (
        RallyPoint(
            latitude_deg=47.1, longitude_deg=8.2, height_above_home_m=60.0, place=Place(1, 1)
        ),
        RallyPoint(
            latitude_deg=47.3, longitude_deg=8.4, height_above_home_m=50.0, place=Place(2, 1)
        ),
    )
    assert [finding.code for finding in mission.findings] == ["L157"]


@pytest.mark.parametrize("line", ["47 8 9", "47 x", "97 8", "47 181", "47 nan"])
def test_a_broken_fence_line_is_refused_with_its_place(line: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_fence_list(f"{FENCE}  {line}\n", source="f")
    assert caught.value.place == Place(6, 3)


@pytest.mark.parametrize(
    "line", ["RALLY 47 8 60", "RALLY 47 8 high 40 0 0", "RALLY 97 8 60 40 0 0", "47 8"]
)
def test_a_broken_rally_line_is_refused_with_its_place(line: str) -> None:
    with pytest.raises(MissionFileError) as caught:
        read_rally_list(f"RALLY 47 8 60 40 0 0\n{line}\n", source="r")
    assert caught.value.place == Place(2, 1)


def test_more_points_than_mavlink_can_send_are_refused() -> None:
    with pytest.raises(MissionFileError, match="65,535 points"):
        read_fence_list("47 8\n" * 65_536, source="f")


@pytest.mark.parametrize("key", ["geoFence", "rallyPoints"])
def test_a_fence_in_a_file_from_before_plans_is_told(key: str) -> None:
    mission = read(
        {**VERSION_2, key: {"version": 2, "circles": [{}], "points": [[47.0, 8.0, 9.0]]}}
    )
    assert [finding.code for finding in mission.findings] == ["L117", "L107"]
    assert mission.fence is None
