"""Where other readers differ from ours, each difference with the number of its trap.

MAVSDK's importers and pymavlink's loader give the same items as ours, field by field, but for what
stands here; test_mavsdk_importer.py and test_wpl_properties.py look for more on files made at
random.

====  ===========================  ==============================================================
trap  the others                   we
====  ===========================  ==============================================================
4     MAVSDK sends 0, 0 for null   know no position
4     MAVSDK sends NaN for the     know no altitude of home
      altitude of home
7     MAVSDK keeps a DO_JUMP of    take it for the id it is, and tell (L121)
      PX4 as it is, one too far
10    MAVSDK and pymavlink keep    keep it as home, no item
      the home row as an item
10    MAVSDK puts a copy of the    fly the first row, and tell (L152)
      first row before it for
      ArduPilot
12    pymavlink refuses null       take it for not specified, and tell (L154)
27    MAVSDK and pymavlink keep    make a fence of them, and tell (L156)
      fence rows as items
====  ===========================  ==============================================================

What they refuse and we read is told by a finding: JSON without fence or rally points (L101), versions
(L102, L113), complex items other than a survey (L115, L116), text in other dialects (L150, L151).
"""

from __future__ import annotations

import io
import json
import math
from typing import TYPE_CHECKING

import pytest
from plan_text import PLAN, plan_of, plan_with, simple_item
from pymavlink import mavwp

from planner.autopilot import Autopilot
from planner.mission.formats.plan import read_plan_text
from planner.mission.formats.wpl import read_wpl

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path
    from typing import Any

    from mavsdk.plugins.mission_raw import MissionRaw

    from planner.mission.items import Mission

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
HOME = "0\t1\t0\t16\t0\t0\t0\t0\t47.1\t8.5\t488\t1"
TAKEOFF = "1\t0\t3\t22\t0\t0\t0\t0\t47.1\t8.5\t20\t1"


def text(*rows: str) -> str:
    return "\n".join(("QGC WPL 110", *rows)) + "\n"


def read(content: str) -> Mission:
    return (read_plan_text if content.startswith("{") else read_wpl)(content, source="m")


def imported(importer: MissionRaw, content: str) -> list[Any]:
    if content.startswith("{"):
        return list(importer.import_qgroundcontrol_mission_from_string(content).mission_items)
    return list(importer.import_mission_planner_mission_from_string(content).mission_items)


def loaded(content: str, folder: Path) -> mavwp.MAVWPLoader:
    path = folder / "m.waypoints"
    path.write_text(content)
    loader = mavwp.MAVWPLoader()
    loader.load(str(path))
    return loader


def test_trap_4_null_is_no_position(importers: Mapping[Autopilot, MissionRaw]) -> None:
    takeoff = simple_item(22, 3, 0, 0, 0, None, None, None, 20, number=1)
    content = plan_of(takeoff)
    [sent] = imported(importers[PX4], content)
    [item] = read(content).items
    assert (sent.x, sent.y) == (0, 0)
    assert (item.latitude_deg, item.longitude_deg) == (None, None)


def test_trap_4_an_altitude_of_home_that_is_null_is_not_known(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    content = plan_with([47.3977, 8.5455, None], "mission", "plannedHomePosition")
    home = read(content).home
    assert home is not None
    assert home.altitude_amsl_m is None
    assert math.isnan(imported(importers[ARDUPILOT], content)[0].z)


def test_trap_7_a_jump_of_px4_leads_one_item_too_far(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    takeoff, waypoint = PLAN["mission"]["items"][:2]
    content = plan_of(takeoff, waypoint, simple_item(177, 2, 2, 1, 0, 0, 0, 0, 0, number=3))
    up, over, jump = imported(importers[PX4], content)
    assert [up.seq, over.seq, jump.seq] == [0, 1, 2]
    assert jump.param1 == over.seq + 1  # PX4 goes to the item of this number: to the jump itself
    mission = read(content)
    assert mission.items[2].param1 == mission.items[1].jump_id
    assert [finding.code for finding in mission.findings] == ["L121"]


def test_trap_10_the_home_row_is_an_item_to_others(
    importers: Mapping[Autopilot, MissionRaw], tmp_path: Path
) -> None:
    content = text(HOME, TAKEOFF)
    assert [item.command for item in read(content).items] == [22]
    assert [sent.command for sent in imported(importers[PX4], content)] == [16, 22]
    assert [row.command for row in loaded(content, tmp_path).wpoints] == [16, 22]


def test_trap_10_a_first_row_that_is_not_home_is_copied_for_ardupilot(
    importers: Mapping[Autopilot, MissionRaw],
) -> None:
    content = text(TAKEOFF.replace("1", "0", 1))
    copy, first = imported(importers[ARDUPILOT], content)
    assert (copy.command, first.command) == (16, 22)
    assert (copy.x, copy.y, copy.z) == (first.x, first.y, first.z)
    assert [item.command for item in read(content).items] == [22]
    assert [finding.code for finding in read(content).findings] == ["L152"]


def test_trap_12_null_is_no_number_to_pymavlink() -> None:
    row = TAKEOFF.replace("\t0\t47.1", "\tnull\t47.1")
    assert read(text(HOME, row)).items[0].param4 is None
    # Its own way in, load(), leaves the file open when it fails.
    with pytest.raises(ValueError, match="null"):
        mavwp.MAVWPLoader()._read_waypoints_v110(io.StringIO(row))


def test_trap_26_terrain_rows_are_read_alike(
    importers: Mapping[Autopilot, MissionRaw], tmp_path: Path
) -> None:
    """Older importers left their positions unscaled."""
    content = text(HOME, TAKEOFF, "2\t0\t10\t16\t0\t0\t0\t0\t47.2\t8.5\t30\t1")
    item = read(content).items[1]
    sent, row = imported(importers[PX4], content)[2], loaded(content, tmp_path).wp(2)
    assert (item.frame, sent.frame, row.frame) == (10, 10, 10)
    assert (sent.x, row.x) == (472_000_000, item.latitude_deg)


def test_trap_27_fence_rows_are_items_to_others(
    importers: Mapping[Autopilot, MissionRaw], tmp_path: Path
) -> None:
    circle = "2\t0\t3\t5003\t90\t0\t0\t0\t47.1\t8.5\t0\t1"
    content = text(HOME, TAKEOFF, circle)
    mission = read(content)
    assert [item.command for item in mission.items] == [22]
    assert mission.fence is not None
    assert mission.fence.circles[0].radius_m == 90.0
    assert [sent.command for sent in imported(importers[PX4], content)] == [16, 22, 5003]
    assert [row.command for row in loaded(content, tmp_path).wpoints] == [16, 22, 5003]


def test_a_plan_without_traps_is_read_alike(importers: Mapping[Autopilot, MissionRaw]) -> None:
    content = json.dumps(PLAN)
    assert [sent.command for sent in imported(importers[PX4], content)] == [
        item.command for item in read(content).items
    ]
