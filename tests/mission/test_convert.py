"""Missions in another format, and missions flown at one speed."""

from __future__ import annotations

import copy
import json
import os
from typing import TYPE_CHECKING, Any

import pytest
from generated_plans import plans
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from made_missions import HOME, item, jump, mission, north, rtl, speed, takeoff, waypoint
from made_missions import mission as made
from plan_text import PLAN, SURVEY, plan_of, plan_with, simple_item
from qgc_rules import refuse_plan, refuse_text
from thinning import examples

import planner
from planner.autopilot import Autopilot
from planner.errors import MissionFileError, OutputError, UsageError
from planner.geo.fence import RallyPoint
from planner.mission.commands import Command
from planner.mission.convert import convert_mission, mission_at_speed, route_at_speed
from planner.mission.files import read_mission_bytes
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.wpl import read_wpl
from planner.mission.items import MissionFormat
from planner.mission.route.route import make_route
from planner.service.conversion import convert_file
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
    assert codes(there.findings) == ["L213"]  # it does not say what fence there is
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
    assert losses(mission, MissionFormat.PLAN)["L206"] == "2 comments left out"
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
@settings(max_examples=examples(15), deadline=None, suppress_health_check=[HealthCheck.too_slow])
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
    result = convert_file(source, target)
    assert result.items == 6
    assert codes(result.findings) == ["L102"]
    assert codes(result.losses) == ["L201", "L202", "L204", "L154"]
    assert len(read_mission_bytes(target.read_bytes(), source="b").items) == 6


def test_what_is_no_mission_is_not_converted(tmp_path: Path) -> None:
    source = tmp_path / "a.plan"
    source.write_text("[]", encoding="utf-8")
    with pytest.raises(MissionFileError):
        convert_file(source, tmp_path / "b.txt")
    assert list(tmp_path.iterdir()) == [source]


def codes(findings: tuple[Finding, ...]) -> list[str]:
    return [finding.code for finding in findings]


VEHICLES = {
    None: "falkowski-2023-quadrotor",
    Autopilot.PX4: "px4-sih-quad",
    Autopilot.ARDUPILOT: "arducopter-sitl-quad",
}


def commanded(made: Mission) -> list[tuple[float | None, float | None]]:
    return [(one.param1, one.param2) for one in made.items if one.command == 178]


def test_a_speed_is_inserted_before_the_first_leg_and_jumps_lead_where_they_did() -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), waypoint(0.0, 30.0), jump(2, 1.0), rtl())
    changed = mission_at_speed(made, 7.0)
    assert [one.command for one in changed.items] == [22, 178, 16, 16, 177, 20]
    assert commanded(changed) == [(1.0, 7.0)]
    assert changed.items[4].param1 == 3.0  # the same place: it is flown at that speed already
    assert [one.jump_id for one in changed.items] == [1, 2, 3, 4, 5, 6]
    # From a jump to the item inserted ArduPilot flies to the place behind the jump (#31021).
    onward = mission(*made.items[:4], waypoint(900.0, 30.0), rtl())
    for dialect in (Autopilot.ARDUPILOT, None):
        for flown in (onward, mission_at_speed(onward, 7.0)):
            found = make_route(flown, dialect=dialect).findings
            assert "T124" not in {one.code for one in found}


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT, None])
def test_a_speed_is_inserted_before_the_jump_that_leads_to_the_first_leg(
    autopilot: Autopilot | None,
) -> None:
    there, back = waypoint(100.0, 30.0), waypoint(0.0, 30.0)
    made = replace(mission(takeoff(30.0), jump(4, 1), back, there, rtl()), autopilot=autopilot)
    changed = mission_at_speed(made, 7.0)
    assert [one.command for one in changed.items] == [22, 178, 177, 16, 16, 20]
    assert changed.items[2].param1 == 5.0
    stages = make_route(changed, dialect=autopilot).stages
    assert [stage.speed_m_s for stage in stages[1:-1]] == [7.0]


def test_a_speed_is_inserted_before_the_condition_that_would_hold_it_back() -> None:
    """While it flies to item 4 ArduPilot waits 30 s before it runs what is behind the condition."""
    wait = item(112, params=(30.0, 0.0, 0.0, 0.0), frame=2)
    made = mission(takeoff(30.0), wait, speed(5.0), waypoint(100.0, 30.0), rtl())
    changed = mission_at_speed(made, 7.0)
    assert [one.command for one in changed.items] == [22, 178, 112, 178, 16, 20]
    assert commanded(changed) == [(1.0, 7.0), (1.0, 7.0)]
    px4 = mission_at_speed(replace(made, autopilot=Autopilot.PX4), 7.0)
    assert [one.command for one in px4.items] == [22, 112, 178, 16, 20]


def test_commanded_speeds_are_changed_in_place_and_others_left() -> None:
    made = mission(takeoff(30.0), speed(5.0), speed(2.0, kind=2.0), waypoint(100.0, 30.0), rtl())
    changed = mission_at_speed(replace(made, autopilot=Autopilot.ARDUPILOT), 7.0)
    assert commanded(changed) == [(1.0, 7.0), (2.0, 2.0)]


@pytest.mark.parametrize("kind", [2.0, 3.0, 15.0])
def test_a_mission_for_any_autopilot_is_flown_at_the_speed_by_each(kind: float) -> None:
    """PX4 takes a speed of whatever type for that of level flight; ArduPilot flies the climb at it."""
    out, back = waypoint(100.0, 30.0), waypoint(0.0, 60.0)
    made = mission(takeoff(30.0), speed(5.0), out, speed(2.0, kind=kind), back, jump(4, 1.0), rtl())
    changed = mission_at_speed(made, 7.0)
    assert commanded(changed) == [(1.0, 7.0), (kind, 2.0), (1.0, 7.0)]
    assert [one.param1 for one in changed.items if one.command == 177] == [4.0]
    for autopilot in (Autopilot.PX4, Autopilot.ARDUPILOT):
        stages = make_route(changed, dialect=autopilot).stages
        assert [stage.speed_m_s for stage in stages[1:-1]] == [7.0] * 3


def test_px4_takes_every_speed_for_that_of_level_flight() -> None:
    made = mission(takeoff(30.0), speed(3.0, kind=2.0), waypoint(100.0, 30.0), rtl())
    changed = mission_at_speed(replace(made, autopilot=Autopilot.PX4), 7.0)
    assert commanded(changed) == [(1.0, 7.0)]


def test_a_take_off_that_goes_somewhere_is_governed_too() -> None:
    made = mission(item(22, north(50.0), 30.0), waypoint(100.0, 30.0), rtl())
    assert [one.command for one in mission_at_speed(made, 7.0).items] == [178, 22, 16, 20]


def test_a_mission_without_level_legs_stays_as_it_is() -> None:
    made = mission(takeoff(30.0), rtl())
    assert mission_at_speed(made, 7.0) == made


def test_a_return_keeps_the_speed_of_the_vehicle() -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), rtl())
    stages = route_at_speed(make_route(made), 7.0).stages
    assert [stage.speed_m_s for stage in stages] == [None, 7.0, None]


@pytest.mark.parametrize("autopilot", [Autopilot.ARDUPILOT, None])
@pytest.mark.parametrize(
    ("queue", "kept"), [((), [7.0]), ((3.0, 4.0), [7.0, 3.0, 4.0]), ((-2.0,), [7.0, -2.0])]
)
def test_the_speeds_that_a_return_is_flown_at_are_kept(
    queue: tuple[float, ...], kept: list[float], autopilot: Autopilot | None
) -> None:
    # All but the first of the queue are carried out when the return has begun.
    items = (takeoff(30.0), speed(5.0), waypoint(100.0, 30.0), *map(speed, queue), rtl())
    made = replace(mission(*items), autopilot=autopilot)
    assert [one[1] for one in commanded(mission_at_speed(made, 7.0))] == kept


@pytest.mark.parametrize("wrong", [0.0, -3.0, float("nan"), float("inf"), 101.0, 10**400])
def test_a_speed_nothing_flies_at_is_refused(wrong: float) -> None:
    made = mission(takeoff(30.0), waypoint(100.0, 30.0), rtl())
    with pytest.raises(UsageError, match=r"must be (above 0|a finite number)"):
        mission_at_speed(made, wrong)
    with pytest.raises(UsageError, match=r"must be (above 0|a finite number)"):
        planner.check(made, planner.load_vehicle(VEHICLES[None]), speed_m_s=wrong)


def items() -> st.SearchStrategy[list[MissionItem]]:
    places = st.integers(-40, 40).map(lambda tens: 10.0 * tens)
    one = st.one_of(
        st.builds(waypoint, places, st.sampled_from([20.0, 35.0])),
        st.builds(speed, st.sampled_from([-2.0, 0.0, 3.0, 8.0]), st.sampled_from([0.0, 1.0, 2.0])),
        st.builds(
            lambda place, turns: item(18, north(place), 30.0, params=(turns, 0.0, 15.0, None)),
            places,
            st.sampled_from([1.0, 2.0]),
        ),
        st.builds(lambda target: jump(target, 1.0), st.integers(1, 6)),
        st.builds(
            lambda command, value: item(command, params=(value, 0.0, 0.0, 0.0), frame=2),
            st.sampled_from([112, 114, 115]),  # conditions: a delay, a distance, a heading
            st.sampled_from([1.0, 15.0]),
        ),
    )
    return st.lists(one, min_size=1, max_size=7)


@pytest.mark.parametrize("autopilot", VEHICLES)
@given(body=items(), at=st.sampled_from([2.5, 6.0, 9.0]), away=st.booleans(), lands=st.booleans())
@settings(max_examples=examples(8), deadline=None)
def test_the_saved_mission_flies_what_the_override_flies(
    autopilot: Autopilot | None, body: list[MissionItem], at: float, *, away: bool, lands: bool
) -> None:
    vehicle = planner.load_vehicle(VEHICLES[autopilot])
    start = item(22, north(30.0 if away else 0.0), 20.0)
    end = item(21, north(120.0), 0.0) if lands else rtl()
    made = replace(mission(start, *body, end), autopilot=autopilot)
    asked = planner.check(made, vehicle, speed_m_s=at)
    saved = planner.check(mission_at_speed(made, at), vehicle)
    assert saved.totals.time_s == pytest.approx(asked.totals.time_s, rel=1e-12)
    assert saved.totals.distance_m == pytest.approx(asked.totals.distance_m, rel=1e-12)
    assert saved.totals.energy_wh == pytest.approx(asked.totals.energy_wh, rel=1e-12, nan_ok=True)
    again = planner.check(mission_at_speed(made, at), vehicle, speed_m_s=at)
    assert "T111" not in {one.code for one in again.findings}
