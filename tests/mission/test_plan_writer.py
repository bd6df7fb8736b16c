from __future__ import annotations

import copy
import json
from typing import TYPE_CHECKING, Any

import pytest
from generated_plans import FENCES, HOMES, RALLY_POINTS, item_lists, plans
from hypothesis import HealthCheck, given, settings
from made_missions import item, jump, rtl, takeoff, waypoint
from made_missions import mission as made
from plan_text import PLAN, SURVEY, plan_of, plan_with, plan_without, simple_item
from qgc_rules import RefusedError, refuse_plan
from thinning import examples

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.files import read_mission_bytes
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.writers import plan_text
from planner.mission.items import Home, VehicleEvidence, VehicleKind
from planner.values import replace

if TYPE_CHECKING:
    from planner.mission.items import Mission, MissionItem


def read(text: str) -> Mission:
    return read_plan_text(text, source="a.plan")


def written(mission: Mission) -> dict[str, Any]:
    """The plan of a mission, which QGroundControl opens."""
    text = plan_text(mission)
    refuse_plan(text)
    plan: dict[str, Any] = json.loads(text)
    return plan


def written_items(mission: Mission) -> list[dict[str, Any]]:
    items: list[dict[str, Any]] = written(mission)["mission"]["items"]
    return items


def placeless(items: tuple[MissionItem, ...]) -> list[MissionItem]:
    return [replace(one, place=None) for one in items]


def test_a_plan_that_nobody_changed_is_written_as_the_file_it_was() -> None:
    text = json.dumps(PLAN, indent=3).replace("47.4,", "4.74E1 ,")
    assert plan_text(read(text)) == text


def test_a_changed_item_keeps_what_no_loader_knows() -> None:
    own = simple_item(16, 3, 0, 0, 0, None, 47.4, 8.5, 50, number=2) | {"note": "mind the mast"}
    mission = read(plan_of(simple_item(22, 3, 0, 0, 0, None, 47.4, 8.5, 30, number=1), own))
    higher = replace(mission.items[1], altitude_m=62.5, param1=3.0)
    first, second = written_items(replace(mission, items=(mission.items[0], higher)))
    assert first == simple_item(22, 3, 0, 0, 0, None, 47.4, 8.5, 30, number=1)
    assert second == own | {"Altitude": 62.5, "params": [3, 0, 0, None, 47.4, 8.5, 62.5]}


def test_everything_else_of_a_changed_plan_stays() -> None:
    plan = copy.deepcopy(PLAN) | {"site": {"name": "Bäckerwiese \U0001f681 \ud800"}}
    plan["mission"]["pilot"] = [1, None, 2.50]
    mission = read(json.dumps(plan))
    changed = written(replace(mission, items=(*mission.items[:-1], rtl())))
    changed["mission"]["items"] = plan["mission"]["items"]
    assert changed == plan


def test_an_item_put_in_moves_the_numbers_and_the_jumps_behind_it() -> None:
    mission = read(
        plan_of(
            simple_item(22, 3, 0, 0, 0, None, 47.4, 8.5, 30, number=1),
            SURVEY,  # holds ids 3 and 4
            simple_item(16, 3, 0, 0, 0, None, 47.41, 8.5, 30, number=5),
            {"type": "SimpleItem", "command": 177, "frame": 2, "autoContinue": True}
            | {"doJumpId": 6, "params": [5, 2, 0, 0, 0, 0, 0]},
        )
    )
    items = (mission.items[0], waypoint(50.0, 30.0), *mission.items[1:])
    first, new, survey, target, back = written_items(replace(mission, items=items))
    inner = survey["TransectStyleComplexItem"]["Items"]
    assert [first["doJumpId"], new["doJumpId"], target["doJumpId"]] == [1, 2, 5]
    assert [each["doJumpId"] for each in inner] == [3, 4]
    assert (back["doJumpId"], back["params"][:2]) == (6, [5, 2])
    assert survey == SURVEY


def test_a_complex_item_stays_only_while_its_items_are_as_they_were() -> None:
    mission = read(json.dumps(PLAN))
    lower = replace(mission.items[2], altitude_m=40.0)
    items = (*mission.items[:2], lower, *mission.items[3:])
    elements = written_items(replace(mission, items=items))
    assert [element["type"] for element in elements] == ["SimpleItem"] * 6
    assert elements[2]["params"][6] == 40


def test_a_complex_item_that_cannot_be_expanded_keeps_its_place() -> None:
    strange = {"type": "ComplexItem", "complexItemType": "spiral", "version": 1, "turns": 3}
    first = simple_item(22, 3, 0, 0, 0, None, 47.4, 8.5, 30, number=1)
    last = simple_item(16, 3, 0, 0, 0, None, 47.4, 8.5, 30, number=2)
    mission = read(plan_of(strange, first, strange, last, strange))
    text = plan_text(replace(mission, items=(mission.items[1],)))
    elements = json.loads(text)["mission"]["items"]
    assert [element.get("turns") for element in elements] == [3, 3, None, 3]


@pytest.mark.parametrize(
    "text",
    [
        plan_without("fileType"),
        plan_without("version"),
        plan_without("groundStation"),
        plan_without("geoFence"),
        plan_without("rallyPoints"),
        plan_without("rallyPoints", "version"),
        plan_without("geoFence", "circles"),
        plan_without("mission", "plannedHomePosition"),
        plan_without("mission", "firmwareType"),
        plan_without("mission", "items", 1, "type"),
        plan_without("mission", "items", 1, "autoContinue"),
        plan_with(1, "mission", "items", 1, "autoContinue"),
        plan_with([47.3987, 8.5455, 50], "mission", "items", 1, "coordinate"),
        plan_with(True, "version"),  # noqa: FBT003 (JSON)
        plan_with({}, "rallyPoints"),
    ],
)
def test_what_qgroundcontrol_refuses_is_mended(text: str) -> None:
    with pytest.raises(RefusedError):
        refuse_plan(text)
    mission = read(text)
    again = read(plan_text(mission))
    refuse_plan(plan_text(mission))
    assert placeless(again.items) == placeless(mission.items)
    assert again.home == mission.home


def test_a_fence_that_every_loader_ignores_stays_one() -> None:
    section = {"version": 1, "polygon": [[47.39, 8.53]], "polygons": [{"inclusion": True}]}
    plan = written(read(plan_with(section, "geoFence")))
    assert plan["geoFence"] == section


def test_an_empty_section_of_an_older_version_becomes_a_current_one() -> None:
    plan = written(read(plan_with({"version": 1, "parameters": []}, "geoFence")))
    assert plan["geoFence"] == {"version": 2, "polygons": [], "circles": []}


def test_a_new_fence_and_new_rally_points_replace_the_old_ones() -> None:
    fence = Fence(
        polygons=(FencePolygon(inclusion=True, vertices_deg=((1.0, 2.0), (1.0, 3.0), (2.0, 3.0))),),
        circles=(FenceCircle(inclusion=False, latitude_deg=1.5, longitude_deg=2.5, radius_m=8.5),),
    )
    point = RallyPoint(latitude_deg=1.0, longitude_deg=2.0, height_above_home_m=30.0)
    mission = read(json.dumps(PLAN))
    plan = written(replace(mission, fence=fence, rally=(point,)))
    assert plan["geoFence"] == {
        "version": 2,
        "polygons": [{"version": 1, "inclusion": True, "polygon": [[1, 2], [1, 3], [2, 3]]}],
        "circles": [
            {"version": 1, "inclusion": False, "circle": {"center": [1.5, 2.5], "radius": 8.5}}
        ],
    }
    assert plan["rallyPoints"] == {"version": 2, "points": [[1, 2, 30]]}
    assert plan["mission"] == PLAN["mission"]


def test_a_fence_taken_away_is_no_longer_in_the_plan() -> None:
    plan = written(replace(read(json.dumps(PLAN)), fence=None, rally=()))
    assert plan["geoFence"] == {"version": 2, "polygons": [], "circles": []}
    assert plan["rallyPoints"]["points"] == []


def test_another_home_firmware_and_vehicle_are_written() -> None:
    mission = read(json.dumps(PLAN))
    vehicle = VehicleEvidence(kind=VehicleKind.ROVER, is_certain=True, reason="told")
    home = Home(latitude_deg=47.0, longitude_deg=8.0, altitude_amsl_m=None)
    section = written(replace(mission, home=home, autopilot=Autopilot.ARDUPILOT, vehicle=vehicle))[
        "mission"
    ]
    assert section == PLAN["mission"] | {
        "plannedHomePosition": [47, 8, None],
        "firmwareType": 3,
        "vehicleType": 10,
    }


def test_a_mission_that_came_from_no_plan_becomes_a_whole_one() -> None:
    vehicle = VehicleEvidence(kind=VehicleKind.MULTICOPTER, is_certain=True, reason="told")
    mission = made(
        takeoff(30.0),
        item(16, 47.001, 540.5, frame=0, autocontinue=False),
        jump(2, 3.0),
        rtl(),
        autopilot=Autopilot.PX4,
        vehicle=vehicle,
    )
    assert written(mission) == {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "mavjoule",
        "mission": {
            "version": 2,
            "cruiseSpeed": 15,
            "hoverSpeed": 5,
            "firmwareType": 12,
            "vehicleType": 2,
            "plannedHomePosition": [47, 8, 400],
            "items": [
                simple_item(22, 3, 0, 0, 0, None, 47, 8, 30, number=1),
                simple_item(16, 0, 0, 0, 0, None, 47.001, 8, 540.5, number=2)
                | {"autoContinue": False},
                _plain_item(177, [2, 3, 0, 0, None, None, 0], number=3),
                _plain_item(20, [0, 0, 0, 0, None, None, 0], number=4),
            ],
        },
        "geoFence": {"version": 2, "polygons": [], "circles": []},
        "rallyPoints": {"version": 2, "points": []},
    }


def _plain_item(command: int, params: list[float | None], *, number: int) -> dict[str, Any]:
    """An item without a place, which has no altitude to show."""
    return {
        "type": "SimpleItem",
        "command": command,
        "frame": 2,
        "autoContinue": True,
        "doJumpId": number,
        "params": params,
    }


def test_an_older_json_mission_becomes_a_plan_that_keeps_what_it_held() -> None:
    older = {
        "version": "1.0",
        "MAV_AUTOPILOT": 3,
        "groundStation": "QGroundControl",
        "complexItems": [{"type": "survey"}],
        "plannedHomePosition": {"type": "missionItem", "coordinate": [47, 8, 400]},
        "items": [
            {"type": "missionItem", "id": 1, "command": 22, "frame": 3, "autoContinue": True}
            | {"param1": 15, "param2": 0, "param3": 0, "param4": 0, "coordinate": [47, 8, 30]},
            {"type": "missionItem", "id": 2, "command": 16, "frame": 0, "autoContinue": True}
            | {"param1": 0, "param2": 0, "param3": 0, "param4": 0, "coordinate": [47, 8.1, 450]}
            | {"note": "over the barn"},
        ],
    }
    mission = read_mission_bytes(json.dumps(older).encode(), source="a.mission")
    plan = written(mission)
    assert plan["groundStation"] == "QGroundControl"
    assert plan["mission"] == {
        "version": 2,
        "cruiseSpeed": 15,
        "hoverSpeed": 5,
        "firmwareType": 3,
        "complexItems": [{"type": "survey"}],
        "plannedHomePosition": [47, 8, 400],
        "items": [
            simple_item(22, 3, 15, 0, 0, 0, 47, 8, 30, number=1),
            simple_item(16, 0, 0, 0, 0, 0, 47, 8.1, 450, number=2) | {"note": "over the barn"},
        ],
    }


def test_numbers_are_written_so_that_they_read_back_the_same() -> None:
    values = (0.1 + 0.2, 2.0**53 + 2.0, 1e-300, -0.0)
    one = item(16, 47.123456789012345, 1.0 / 3.0, params=values)
    text = plan_text(made(one))
    assert "NaN" not in text
    [again] = read(text).items
    assert again == replace(one, jump_id=1, place=again.place)


def test_a_jump_to_nowhere_does_not_come_to_lead_somewhere() -> None:
    mission = made(
        takeoff(30.0), item(177, params=(7.0, 1.0, 0.0, 0.0), frame=2, jump_id=40), rtl()
    )
    assert json.loads(plan_text(mission))["mission"]["items"][1]["params"][0] == 7
    near = replace(mission, items=(mission.items[0], replace(mission.items[1], param1=2.0)))
    assert json.loads(plan_text(near))["mission"]["items"][1]["params"][0] == 0


@given(plan=plans())
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_plan_read_and_written_is_the_same_file(plan: dict[str, Any]) -> None:
    text = json.dumps(plan)
    refuse_plan(text)
    assert plan_text(read(text)) == text


@given(plan=plans())
@settings(max_examples=examples(60), deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_plan_with_one_item_more_still_holds_all_it_held(plan: dict[str, Any]) -> None:
    mission = read(json.dumps(plan))
    again = read(plan_text(replace(mission, items=(*mission.items, rtl()))))
    assert [replace(one, jump_id=None) for one in placeless(again.items)[:-1]] == [
        replace(one, jump_id=None) for one in placeless(mission.items)
    ]
    held = again.document.json.root
    elements = held["mission"]["items"]
    assert len(elements) == len(plan["mission"]["items"]) + 1
    for element, before in zip(elements, plan["mission"]["items"], strict=False):
        assert _unnumbered(element) == _unnumbered(before)
    held["mission"]["items"] = plan["mission"]["items"]
    assert held == plan


def _unnumbered(element: dict[str, Any]) -> dict[str, Any]:
    plain = {key: value for key, value in element.items() if key != "doJumpId"}
    transects = plain.get("TransectStyleComplexItem")
    if transects is not None:
        inner = [_unnumbered(each) for each in transects["Items"]]
        plain["TransectStyleComplexItem"] = transects | {"Items": inner}
    return plain


@given(items=item_lists(), home=HOMES, fence=FENCES, rally=RALLY_POINTS)
@settings(max_examples=examples(80), deadline=None)
def test_any_mission_is_read_back_from_its_plan_as_it_was(
    items: tuple[MissionItem, ...], home: Home | None, fence: Fence, rally: tuple[RallyPoint, ...]
) -> None:
    mission = replace(made(*items, home=home), fence=fence, rally=rally)
    text = plan_text(mission)
    refuse_plan(text)
    again = read(text)
    assert placeless(again.items) == list(items)
    assert again.home == home
    assert again.fence is not None
    assert [replace(one, place=None) for one in again.fence.polygons] == list(fence.polygons)
    assert [replace(one, place=None) for one in again.fence.circles] == list(fence.circles)
    assert again.fence.breach_return_deg_m == fence.breach_return_deg_m
    assert [replace(one, place=None) for one in again.rally] == list(rally)
    assert {finding.code for finding in again.findings} == set()
