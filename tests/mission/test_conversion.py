from __future__ import annotations

import copy
import json
import os
from typing import TYPE_CHECKING, Any

import pytest
from generated_plans import plans
from hypothesis import HealthCheck, given, settings
from made_missions import HOME, item, jump, rtl, takeoff, waypoint
from made_missions import mission as made
from plan_text import PLAN, SURVEY, plan_of, plan_with, simple_item
from qgc_rules import refuse_plan, refuse_text

import planner
from planner import service
from planner.autopilot import Autopilot
from planner.errors import MissionFileError, OutputError, UsageError
from planner.geo.fence import RallyPoint
from planner.mission.commands import Command
from planner.mission.convert import convert_mission
from planner.mission.files import read_mission_bytes
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.wpl import read_wpl
from planner.mission.items import MissionFormat
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.findings import Finding
    from planner.mission.items import Mission, MissionItem

WPL = """QGC WPL 110
0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1
1\t0\t3\t22\t0\t0\t0\t0\t47\t8\t30\t1
2\t0\t10\t16\t5\t0\t0\t0\t47.001\t8\t35.5\t1
3\t0\t3\t177\t2\t3\t0\t0\t0\t0\t0\t0
4\t0\t3\t20\t0\t0\t0\t0\t0\t0\t0\t1
"""


def plan(text: str) -> Mission:
    return read_plan_text(text, source="a.plan")


def losses(mission: Mission, file_format: MissionFormat) -> dict[str, str]:
    return {f.code: f.message for f in convert_mission(mission, file_format).findings}


def placeless(items: tuple[MissionItem, ...]) -> list[MissionItem]:
    return [replace(one, place=None) for one in items]


def test_a_text_mission_loses_nothing_in_a_plan_and_back() -> None:
    mission = read_wpl(WPL, source="a.txt")
    there = convert_mission(mission, MissionFormat.PLAN)
    refuse_plan(there.text)
    assert there.findings == ()
    middle = plan(there.text)
    assert placeless(middle.items) == placeless(mission.items)
    assert middle.home == mission.home
    back = convert_mission(middle, MissionFormat.WPL)
    assert back.text == WPL


def test_a_plan_in_text_says_all_that_is_left_out() -> None:
    said = losses(plan(json.dumps(PLAN)), MissionFormat.WPL)
    assert said["L201"] == (
        "left out the fence (2 areas) and 2 rally points: "
        "QGC WPL text has no place for them beside items"
    )
    assert said["L202"] == "1 complex item (survey) written as plain items"
    assert said["L204"] == (
        "QGC WPL text has no place for firmwareType, vehicleType, cruiseSpeed, hoverSpeed, "
        "globalPlanAltitudeMode: left out"
    )
    assert said["L154"].startswith("4 rows with 'nan'")
    assert said.keys() == {"L201", "L202", "L204", "L154"}


def test_keys_of_items_that_text_has_no_place_for_are_named() -> None:
    own = simple_item(16, 3, 0, 0, 0, 0, 47.4, 8.5, 50, number=1) | {"note": "mast", "id": 4}
    assert "items.note: left out" in losses(plan(plan_of(own)), MissionFormat.WPL)["L204"]


def test_a_complex_item_without_items_is_an_error_where_it_is_lost() -> None:
    strange = {"type": "ComplexItem", "complexItemType": "spiral", "version": 1}
    mission = plan(plan_of(strange, simple_item(22, 3, 0, 0, 0, 0, 47.4, 8.5, 30, number=1)))
    said = losses(mission, MissionFormat.WPL)
    assert said["L203"] == "1 complex item (spiral) cannot be expanded: not in the written file"
    assert losses(mission, MissionFormat.PLAN) == {}


def test_a_changed_survey_is_said_to_be_written_out() -> None:
    mission = plan(plan_of(copy.deepcopy(SURVEY)))
    changed = replace(mission, items=(*mission.items[:1], rtl()))
    assert losses(changed, MissionFormat.PLAN).keys() == {"L202"}


def test_an_unknown_home_is_said() -> None:
    nowhere = made(takeoff(30.0), home=None)
    assert losses(nowhere, MissionFormat.WPL)["L205"] == "home unknown: written as 0, 0"
    somewhere = made(takeoff(30.0), home=replace(HOME, altitude_amsl_m=None))
    assert losses(somewhere, MissionFormat.WPL)["L205"].startswith("altitude of home unknown")
    assert losses(nowhere, MissionFormat.PLAN) == {}
    at_zero = made(takeoff(30.0), home=replace(HOME, latitude_deg=0.0, longitude_deg=0.0))
    assert losses(at_zero, MissionFormat.WPL)["L205"].startswith("home at 0, 0")


def test_comments_of_a_text_are_counted() -> None:
    text = WPL.replace("\n2\t", "\n# over the barn\n2\t").replace("\n4\t", "\n// home\n4\t")
    mission = read_wpl(text, source="a.txt")
    assert losses(mission, MissionFormat.PLAN) == {"L206": "2 comments left out"}
    assert losses(mission, MissionFormat.WPL)["L206"] == "2 comments left out"


def test_a_firmware_that_no_document_holds_is_lost_in_text() -> None:
    mission = made(takeoff(30.0), autopilot=Autopilot.PX4)
    assert losses(mission, MissionFormat.WPL)["L204"] == (
        "QGC WPL text has no place for the firmware: left out"
    )


def test_a_jump_to_nowhere_is_said() -> None:
    mission = made(takeoff(30.0), jump(9, 1.0), rtl())
    for file_format in MissionFormat:
        assert losses(mission, file_format)["L208"] == (
            "the DO_JUMP of item 2 names item 9, which does not exist"
        )


def test_what_reads_back_differently_is_an_error() -> None:
    vertex = item(Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION, 47.0, 0.0)
    mission = made(takeoff(30.0), vertex, waypoint(10.0, 30.0))
    said = losses(mission, MissionFormat.WPL)
    assert said["L207"].startswith("item 2 reads back with another command")
    assert "L207" not in losses(mission, MissionFormat.PLAN)


def test_rally_points_beside_a_fence_that_is_alone_are_lost() -> None:
    mission = plan(plan_with([], "mission", "items"))
    said = losses(mission, MissionFormat.WPL)
    assert said["L201"].startswith("left out 2 rally points")
    point = RallyPoint(latitude_deg=47.0, longitude_deg=8.0, height_above_home_m=20.0)
    alone = replace(made(), rally=(point,))
    assert "L201" not in losses(alone, MissionFormat.WPL)


def test_a_mission_that_no_plan_can_hold_is_not_written() -> None:
    mission = made(item(16, 47.0, 200_000.0))
    with pytest.raises(OutputError, match=r"made\.plan: cannot be written as a plan: item 1"):
        convert_mission(mission, MissionFormat.PLAN)


@given(content=plans())
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_no_plan_reads_back_differently_from_text(content: dict[str, Any]) -> None:
    mission = plan(json.dumps(content))
    there = convert_mission(mission, MissionFormat.WPL)
    refuse_text(there.text)
    assert not {"L207", "L203"} & {finding.code for finding in there.findings}
    back = convert_mission(read_wpl(there.text, source="a.txt"), MissionFormat.PLAN)
    refuse_plan(back.text)
    assert [one.command for one in plan(back.text).items] == [one.command for one in mission.items]


@pytest.mark.parametrize("name", ["b.plan", "b.json", "b.waypoints", "b.TXT"])
def test_the_suffix_tells_the_format(name: str, tmp_path: Path) -> None:
    mission = read_wpl(WPL, source="a.txt")
    planner.write_mission(mission, tmp_path / name)
    again = planner.read_mission(tmp_path / name)
    assert (again.file_format is MissionFormat.PLAN) is (name in {"b.plan", "b.json"})
    assert placeless(again.items) == placeless(mission.items)
    assert [finding for finding in again.findings if finding.code == "L161"] == []


@pytest.mark.parametrize("name", ["b", "b.kml", "-", "b.mission"])
def test_another_suffix_is_a_sentence(name: str, tmp_path: Path) -> None:
    with pytest.raises(UsageError, match=r"ending in \.plan, \.json, \.waypoints, \.txt"):
        planner.write_mission(made(takeoff(30.0)), tmp_path / name)
    assert list(tmp_path.iterdir()) == []


def test_a_file_that_cannot_be_written_stays_as_it_was(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "b.plan"
    path.write_text("precious", encoding="utf-8")

    def full(_: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OutputError, match="No space left on device"):
        planner.write_mission(made(takeoff(30.0)), path)
    assert path.read_text(encoding="utf-8") == "precious"
    assert list(tmp_path.iterdir()) == [path]


def test_converting_tells_what_was_odd_and_what_is_lost(tmp_path: Path) -> None:
    source, target = tmp_path / "a.plan", tmp_path / "b.waypoints"
    source.write_text(plan_with(7, "mission", "version"), encoding="utf-8")
    result = service.convert_file(source, target)
    assert result.items == 6
    assert codes(result.findings) == ["L102"]
    assert codes(result.losses) == ["L201", "L202", "L204", "L154"]
    assert len(read_mission_bytes(target.read_bytes(), source="b").items) == 6


def test_what_is_no_mission_is_not_converted(tmp_path: Path) -> None:
    source = tmp_path / "a.plan"
    source.write_text("[]", encoding="utf-8")
    with pytest.raises(MissionFileError):
        service.convert_file(source, tmp_path / "b.txt")
    assert list(tmp_path.iterdir()) == [source]


def codes(findings: tuple[Finding, ...]) -> list[str]:
    return [finding.code for finding in findings]
