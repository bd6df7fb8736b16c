"""What autopilots send back of items is not what they were sent: an upload must know the difference."""

from __future__ import annotations

import math

import pytest
from made_missions import item, mission, takeoff, waypoint
from simulated_vehicles import memory_line
from virtual_vehicle import wire_item

from planner.autopilot import Autopilot
from planner.geo.fence import Fence, FenceCircle, FencePolygon, RallyPoint
from planner.link.connection import Purpose
from planner.link.mission import MissionKind
from planner.link.upload import upload_mission
from planner.link.vehicle import VehicleLink
from planner.simulator.missions import stored_item
from planner.values import replace

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
_UNSET = None
_NORTH_DEG = 47.003
_OF_PX4 = [
    item(16, _NORTH_DEG, 30.0, params=(2.5, 3.0, 7.0, -90.0)),
    item(16, _NORTH_DEG, 30.0, params=(0.0, 0.0, 0.0, 450.0)),
    item(19, _NORTH_DEG, 30.0, params=(9.0, 1.0, 20.0, _UNSET)),
    item(19, _NORTH_DEG, 30.0, params=(9.0, 0.0, 20.0, 90.0)),
    item(31, _NORTH_DEG, 50.0, params=(1.0, 30.0, 5.0, 1.0)),
    item(201, _NORTH_DEG, 10.0, params=(3.0, 0.0, 0.0, 0.0)),
    item(195, _NORTH_DEG, 10.0, params=(0.0, 0.0, 0.0, 0.0)),
    item(178, frame=2, params=(1.0, 7.5, -1.0, 0.0)),
    item(93, frame=2, params=(4.0, -1.0, -1.0, -1.0)),
    item(17, _NORTH_DEG, 30.0, params=(0.0, 0.0, 25.0, 0.0)),
    item(21, _NORTH_DEG, 0.0, params=(0.0, 1.0, 0.0, 180.0)),
]
_OF_ARDUPILOT = [
    item(16, _NORTH_DEG, 30.127, params=(2.7, 3.0, 7.0, 90.0)),
    item(19, _NORTH_DEG, 30.0, params=(9.0, 0.0, 20.0, _UNSET)),
    item(18, _NORTH_DEG, 30.0, params=(3.0, 0.0, 25.0, 0.0)),
    item(82, _NORTH_DEG, 30.0, params=(1.0, 0.0, 0.0, 0.0)),
    item(178, frame=2, params=(1.0, 7.5, -1.0, 0.0)),
    item(21, _NORTH_DEG, 0.0, params=(0.0, 1.0, 0.0, 180.0)),
]
CASES = [*((PX4, one) for one in _OF_PX4), *((ARDUPILOT, one) for one in _OF_ARDUPILOT)]


@pytest.mark.parametrize(("autopilot", "one"), CASES)
def test_what_an_autopilot_does_not_send_back_is_no_reason_to_take_a_mission_away_again(
    autopilot: Autopilot, one: object
) -> None:
    sent = mission(takeoff(30.0), one, waypoint(200.0, 30.0))  # type: ignore[arg-type] # as made
    link = VehicleLink(memory_line(autopilot), name="simulated", purpose=Purpose.UPLOAD)
    result = upload_mission(link, sent, listen_s=1.0)
    assert result.is_good, result
    assert result.restored is None


@BOTH
def test_fences_and_rally_points_come_back_as_they_are_kept(autopilot: Autopilot) -> None:
    fence = Fence(
        polygons=(
            FencePolygon(inclusion=True, vertices_deg=((46.9, 7.9), (46.9, 8.2), (47.2, 8.0))),
        ),
        circles=(
            FenceCircle(inclusion=False, latitude_deg=47.1, longitude_deg=8.1, radius_m=12.5),
        ),
    )
    rally = RallyPoint(latitude_deg=47.0, longitude_deg=8.01, height_above_home_m=30.7)
    sent = replace(mission(takeoff(30.0), waypoint(100.0, 30.0)), fence=fence, rally=(rally,))
    link = VehicleLink(memory_line(autopilot), name="simulated", purpose=Purpose.UPLOAD)
    result = upload_mission(link, sent, listen_s=1.0)
    assert result.is_good, result
    (kept,) = link.fetch_items(MissionKind.RALLY) or ()
    assert kept.z == (30.0 if autopilot is ARDUPILOT else pytest.approx(30.7))  # whole metres
    frames = {one.frame for one in link.fetch_items(MissionKind.FENCE) or ()}
    assert frames == ({0} if autopilot is ARDUPILOT else {5})


def test_px4_turns_headings_into_the_circle_and_keeps_none_as_none() -> None:
    def heading(param4: float) -> float:
        sent = wire_item(param4=param4)
        return stored_item(sent, MissionKind.MISSION, PX4).param4

    assert heading(-90.0) == 270.0
    assert heading(450.0) == 90.0
    assert math.isnan(heading(math.nan))
