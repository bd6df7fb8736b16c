from __future__ import annotations

from typing import TYPE_CHECKING

import pytest
from generated_plans import FENCES, HOMES, RALLY_POINTS, item_lists
from hypothesis import given, settings
from made_missions import HOME, item, jump, rtl, takeoff, waypoint
from made_missions import mission as made
from pymavlink import mavwp
from qgc_rules import refuse_text
from thinning import examples

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.mission.commands import has_location, load_command_table
from planner.mission.convert import convert_mission
from planner.mission.formats.wpl import read_wpl
from planner.mission.formats.writers import wpl_text
from planner.mission.items import MissionFormat
from planner.values import replace

if TYPE_CHECKING:
    from pathlib import Path

    from planner.mission.items import Home, Mission, MissionItem

SQUARE = ((1.0, 2.0), (1.0, 3.0), (2.0, 3.0), (2.0, 2.0))


def read(text: str) -> Mission:
    return read_wpl(text, source="a.waypoints")


def placeless(items: tuple[MissionItem, ...]) -> list[MissionItem]:
    return [replace(one, place=None) for one in items]


def rows(mission: Mission) -> list[str]:
    text = wpl_text(mission)
    refuse_text(text)
    return text.splitlines()[1:]


def test_a_mission_is_written_row_by_row_behind_its_home() -> None:
    mission = made(
        takeoff(30.0),
        item(16, 47.00125, 540.5, frame=0, params=(2.5, 0.0, 0.0, 90.0), autocontinue=False),
        item(178, 0.0, 0.0, frame=2, params=(1.0, 8.0, -1.0, 0.0), longitude_deg=0.0),
    )
    assert wpl_text(mission) == (
        "QGC WPL 110\n"
        "0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1\n"
        "1\t0\t3\t22\t0\t0\t0\tnan\t47\t8\t30\t1\n"
        "2\t0\t0\t16\t2.5\t0\t0\t90\t47.00125\t8\t540.5\t0\n"
        "3\t0\t2\t178\t1\t8\t-1\t0\t0\t0\t0\t1\n"
    )


def test_an_unknown_home_is_the_blank_row_that_mission_planner_writes() -> None:
    mission = made(takeoff(30.0), home=None)
    assert rows(mission)[0] == "0\t1\t0\t16\t0\t0\t0\t0\t0\t0\t0\t1"
    assert read(wpl_text(mission)).home is None


def test_a_home_of_unknown_altitude_does_not_come_to_lie_at_sea_level() -> None:
    home = replace(HOME, altitude_amsl_m=None)
    mission = made(takeoff(30.0), home=home)
    assert rows(mission)[0] == "0\t1\t3\t16\t0\t0\t0\t0\t47\t8\t0\t1"
    assert read(wpl_text(mission)).home == home


def test_an_unset_position_is_0_only_where_the_command_has_none() -> None:
    mission = made(rtl(), replace(takeoff(30.0), latitude_deg=None, longitude_deg=None))
    _, home, start = rows(mission)
    assert home.split("\t")[8:11] == ["0", "0", "0"]
    assert start.split("\t")[7:11] == ["nan", "nan", "nan", "30"]


def test_jumps_go_to_rows_wherever_the_numbers_began() -> None:
    # Without a home row the first item is number 0, as in files written for PX4.
    mission = made(
        replace(takeoff(30.0), jump_id=0),
        replace(waypoint(50.0, 30.0), jump_id=1),
        replace(jump(1, 3.0), jump_id=2),
    )
    assert rows(mission)[3].split("\t")[3:6] == ["177", "2", "3"]


def test_numbers_are_written_so_that_they_read_back_the_same() -> None:
    values = (0.1 + 0.2, 3.3e38, 1e-300, -0.0)
    one = item(16, 47.123456789012345, 1.0 / 3.0, params=values)
    [again] = read(wpl_text(made(one))).items
    assert again == replace(one, jump_id=1, place=again.place)


def test_fence_and_rally_points_do_not_stand_among_the_items_of_a_mission() -> None:
    fence = Fence(polygons=(FencePolygon(inclusion=True, vertices_deg=SQUARE),))
    point = RallyPoint(latitude_deg=1.0, longitude_deg=2.0, height_above_home_m=30.0)
    mission = replace(made(takeoff(30.0)), fence=fence, rally=(point,))
    assert wpl_text(mission) == wpl_text(made(takeoff(30.0)))


def test_a_fence_alone_is_written_as_ground_stations_save_one() -> None:
    fence = Fence(
        polygons=(
            FencePolygon(inclusion=False, vertices_deg=SQUARE[:3]),
            FencePolygon(inclusion=False, vertices_deg=SQUARE[1:]),
        ),
        circles=(FenceCircle(inclusion=True, latitude_deg=1.5, longitude_deg=2.5, radius_m=80.0),),
        breach_return_deg_m=(1.25, 2.25, None),
    )
    mission = replace(made(home=None), fence=fence)
    assert rows(mission) == [
        "0\t1\t3\t5000\t0\t0\t0\t0\t1.25\t2.25\t0\t1",
        "1\t0\t0\t5002\t3\t0\t0\t0\t1\t2\t0\t1",
        "2\t0\t0\t5002\t3\t0\t0\t0\t1\t3\t0\t1",
        "3\t0\t0\t5002\t3\t0\t0\t0\t2\t3\t0\t1",
        "4\t0\t0\t5002\t3\t0\t0\t0\t1\t3\t0\t1",
        "5\t0\t0\t5002\t3\t0\t0\t0\t2\t3\t0\t1",
        "6\t0\t0\t5002\t3\t0\t0\t0\t2\t2\t0\t1",
        "7\t0\t0\t5003\t80\t0\t0\t0\t1.5\t2.5\t0\t1",
    ]


def test_rally_points_alone_are_written_above_home() -> None:
    point = RallyPoint(latitude_deg=1.5, longitude_deg=2.5, height_above_home_m=30.0)
    mission = replace(made(home=HOME), rally=(point,))
    assert rows(mission) == [
        "0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1",
        "1\t0\t3\t5100\t0\t0\t0\t0\t1.5\t2.5\t30\t1",
    ]


def test_an_empty_mission_is_its_home_row() -> None:
    assert rows(made()) == ["0\t1\t0\t16\t0\t0\t0\t0\t47\t8\t400\t1"]


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("wpl") / "a.waypoints"


@given(items=item_lists(), home=HOMES)
@settings(max_examples=examples(80), deadline=None)
def test_any_mission_is_read_back_as_it_was_by_us_and_by_pymavlink(
    items: tuple[MissionItem, ...], home: Home | None, path: Path
) -> None:
    text = wpl_text(made(*items, home=home))
    refuse_text(text)
    again = read(text)
    said = [_said(one) for one in items]
    assert placeless(again.items) == said
    assert again.home == home
    path.write_text(text, encoding="utf-8")
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(path)) == len(items) + 1
    for one, row in zip(said, loader.wpoints[1:], strict=True):
        assert (row.seq, row.frame, row.command) == (one.jump_id, one.frame, one.command)
        assert bool(row.autocontinue) is one.autocontinue
        values = (row.param1, row.param2, row.param3, row.param4, row.x, row.y, row.z)
        assert [None if value != value else value for value in values] == [  # noqa: PLR0124 (NaN)
            *(one.param1, one.param2, one.param3, one.param4),
            *(one.latitude_deg, one.longitude_deg, one.altitude_m),
        ]


def _said(one: MissionItem) -> MissionItem:
    """An item with 0 for unset positions that its command does not use (see the writer)."""
    table = load_command_table().commands
    if one.command not in table or has_location(one.command):
        return one
    used = table[one.command].parameters[4:]
    latitude_deg, longitude_deg, altitude_m = (
        0.0 if value is None and not name else value
        for value, name in zip(
            (one.latitude_deg, one.longitude_deg, one.altitude_m), used, strict=True
        )
    )
    return replace(
        one, latitude_deg=latitude_deg, longitude_deg=longitude_deg, altitude_m=altitude_m
    )


@given(fence=FENCES.filter(bool), rally=RALLY_POINTS.filter(bool))
@settings(max_examples=examples(40), deadline=None)
def test_any_fence_and_any_rally_points_are_read_back_as_they_were(
    fence: Fence, rally: tuple[RallyPoint, ...]
) -> None:
    again = read(wpl_text(replace(made(home=None), fence=fence))).fence
    assert again is not None
    assert [replace(one, place=None) for one in again.polygons] == list(fence.polygons)
    assert [replace(one, place=None) for one in again.circles] == list(fence.circles)
    assert again.breach_return_deg_m == fence.breach_return_deg_m
    points = read(wpl_text(replace(made(home=None), rally=rally))).rally
    assert [replace(one, place=None) for one in points] == list(rally)


def test_a_heading_that_ardupilot_has_no_use_for_is_0_and_others_stay_unset() -> None:
    items = (takeoff(30.0), item(115, params=(None, 0.0, 0.0, None), longitude_deg=0.0))
    assert rows(made(*items))[1].split("\t")[7] == "nan"
    flown = replace(made(*items), autopilot=Autopilot.ARDUPILOT)
    _, start, turn = rows(flown)
    assert "nan" not in start
    # ArduPilot refuses a CONDITION_YAW without an angle: 0 would be another order, to turn north.
    assert turn.split("\t")[4] == "nan"


def test_text_for_ardupilot_is_written_without_a_word_that_is_told_on_reading_it() -> None:
    made_for = replace(made(takeoff(30.0), waypoint(100.0, 30.0)), autopilot=Autopilot.ARDUPILOT)
    assert read(wpl_text(made_for)).findings == ()
    assert {one.code for one in convert_mission(made_for, MissionFormat.WPL).findings} == {"L204"}
