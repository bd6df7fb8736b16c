"""Parts of a split mission, read by MAVSDK's importer as by us."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import item, jump, mission, north, rtl, takeoff, waypoint
from made_terrain import ground
from qgc_rules import refuse_plan

import planner
from planner.autopilot import Autopilot
from planner.mission.formats.plan import read_plan_text
from planner.service.split import split_mission
from planner.vehicle.battery import Battery
from planner.vehicle.parameters.files import ParameterSet, ParameterValue

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavsdk.plugins.mission_raw import MissionRaw


@pytest.mark.parametrize("frame", [0, 3, 10])
def test_parts_are_imported_as_they_are_read(
    frame: int, importers: Mapping[Autopilot, MissionRaw]
) -> None:
    camera = item(206, params=(25.0, 0.0, 1.0, 0.0), frame=2)
    height_m = 450.0 if frame == 0 else 50.0
    lines = [item(16, north(metres), height_m, frame=frame) for metres in (-900.0, 1200.0, -900.0)]
    whole = mission(takeoff(40.0), waypoint(100.0, 50.0), lines[0], camera, *lines[1:], rtl())
    vehicle = planner.load_vehicle("arducopter-sitl-quad")
    split = split_mission(whole, vehicle, battery=Battery(capacity_wh=48.0), terrain=ground(0.0))
    assert len(split.parts) > 1
    check_import(split, importers, Autopilot.PX4)


@pytest.mark.parametrize("stack", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_parts_with_everything_set_again_are_imported_as_they_are_read(
    stack: Autopilot, importers: Mapping[Autopilot, MissionRaw]
) -> None:
    bent = [
        item(82, north(1100.0), 60.0, longitude_deg=8.002, params=(0.0, 0.0, 0.0, 0.0)),
        waypoint(1000.0, 60.0),
        item(18, north(500.0), 60.0, params=(1.0, 0.0, 30.0, 0.0)),
        item(115, params=(90.0, 0.0, 1.0, 0.0), frame=2),
        item(181, params=(0.0, 1.0, 0.0, 0.0), frame=2),
    ]
    whole = mission(
        takeoff(40.0),
        item(178, params=(1.0, 9.0, -1.0, 0.0), frame=2),
        item(201, north(300.0), 0.0, params=(0.0, 0.0, 0.0, 0.0)),
        item(205, params=(-90.0, 0.0, 0.0, 0.0), frame=2),
        item(206, params=(25.0, 0.0, 1.0, 0.0), frame=2),
        waypoint(1000.0, 50.0),
        *(bent if stack is Autopilot.ARDUPILOT else []),
        waypoint(100.0, 50.0),
        waypoint(1000.0, 50.0),
        jump(6, 2.0),
        item(197, params=(0.0, 0.0, 0.0, 0.0), frame=2),
        waypoint(100.0, 50.0),
        rtl(),
        autopilot=stack,
    )
    slow = {"MPC_Z_V_AUTO_UP": ParameterValue(2.5), "MPC_Z_V_AUTO_DN": ParameterValue(1.5)}
    px4 = ParameterSet(source="slow.params", values=slow, stack=Autopilot.PX4)
    split = split_mission(
        whole,
        planner.load_vehicle("arducopter-sitl-quad"),
        autopilot=stack,
        parameters=px4 if stack is Autopilot.PX4 else None,
        battery=Battery(capacity_wh=60.0),
    )
    assert len(split.parts) > 1
    for part in split.parts:
        refuse_plan(part.text)
    check_import(split, importers, stack)


def check_import(
    split: planner.Split, importers: Mapping[Autopilot, MissionRaw], stack: Autopilot
) -> None:
    """Every part is imported item by item as we read it; for ArduPilot home comes first."""
    for part in split.parts:
        ours = read_plan_text(part.text, source=part.file).items
        theirs = importers[stack].import_qgroundcontrol_mission_from_string(part.text)
        sent_items = theirs.mission_items[1 if stack is Autopilot.ARDUPILOT else 0 :]
        assert [(one.command, one.frame) for one in sent_items] == [
            (one.command, one.frame) for one in ours
        ]
        for one, sent in zip(ours, sent_items, strict=True):
            assert sent.param1 == np.float32(one.param1)
            assert sent.z == np.float32(one.altitude_m)
            if one.frame != 2:  # MAVSDK sends whole units of 1e-7°
                assert abs((one.latitude_deg or 0.0) * 1e7 - sent.x) <= 0.5 + 1e-6
