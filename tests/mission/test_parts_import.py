"""Parts of a split mission, read by MAVSDK's importer as by us."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
import pytest
from made_missions import item, mission, north, rtl, takeoff, waypoint

import planner
from planner.autopilot import Autopilot
from planner.fixes.split import split_mission
from planner.mission.plan import read_plan_text
from planner.vehicle.battery import Battery

if TYPE_CHECKING:
    from collections.abc import Mapping

    from mavsdk.plugins.mission_raw import MissionRaw


@pytest.mark.parametrize("frame", [0, 3, 10])
def test_parts_are_imported_as_they_are_read(
    frame: int, importers: Mapping[Autopilot, MissionRaw]
) -> None:
    camera = item(206, params=(25.0, 0.0, 1.0, 0.0), frame=2)
    height_m = 450.0 if frame == 0 else 50.0
    lines = [
        item(16, north(metres), height_m, frame=frame) for metres in (-1200.0, 1200.0, -1200.0)
    ]
    whole = mission(takeoff(40.0), waypoint(100.0, 50.0), lines[0], camera, *lines[1:], rtl())
    vehicle = planner.load_vehicle("arducopter-sitl-quad")
    split = split_mission(whole, vehicle, battery=Battery(capacity_wh=45.0))
    assert len(split.parts) > 1
    for part in split.parts:
        ours = read_plan_text(part.text, source=part.file).items
        theirs = importers[Autopilot.PX4].import_qgroundcontrol_mission_from_string(part.text)
        assert [(one.command, one.frame) for one in theirs.mission_items] == [
            (one.command, one.frame) for one in ours
        ]
        for one, sent in zip(ours, theirs.mission_items, strict=True):
            assert sent.param1 == np.float32(one.param1)
            assert sent.z == np.float32(one.altitude_m)
            if one.frame != 2:  # MAVSDK sends whole units of 1e-7°
                assert abs((one.latitude_deg or 0.0) * 1e7 - sent.x) <= 0.5 + 1e-6
