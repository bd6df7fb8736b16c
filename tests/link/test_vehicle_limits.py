"""What a vehicle is, has room for and lacks is known before anything is sent, and where a mission begins."""

from __future__ import annotations

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import BATTERY, memory_line

from planner.autopilot import Autopilot
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, UploadOutcome, lists_of_mission
from planner.link.snapshot import fetch_snapshot
from planner.link.vehicle import VehicleLink, _revision
from planner.mission.commands import Frame
from planner.rules.structure import ardupilot_items
from planner.service.vehicle import check_vehicle
from planner.setup import Setup
from planner.values import replace
from planner.vehicle.library import load_vehicle

SETUP = Setup(load_vehicle("arducopter-sitl-quad"), battery=BATTERY)


def _link(faults: str = "") -> VehicleLink:
    line = memory_line(Autopilot.ARDUPILOT, faults)
    return VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)


@pytest.mark.parametrize(
    ("storage_b", "items"),
    [
        (4_096, 161),  # "On APM2 this gives 161 waypoints" (StorageManager.cpp)
        (8_192, 303),  # "On PX4v1 this gives 303 waypoints"
        (15_360, 303),  # optimised for parameters
        (16_384, 650),  # ArduCopter 4.7.0-dev takes a MISSION_COUNT of 650, and of 651 NO_SPACE
        (32_768, 1306),
        (None, 650),
    ],
)
def test_a_storage_holds_as_many_items_as_arducopter_has_for_it(
    storage_b: int | None, items: int
) -> None:
    assert ardupilot_items(storage_b) == items


@pytest.mark.parametrize(("count", "outcome"), [(650, "accepted"), (651, "rejected")])
def test_the_simulated_vehicle_holds_as_many(count: int, outcome: str) -> None:
    link = _link()
    far = mission(*[waypoint(float(north % 300), 30.0) for north in range(count - 1)])
    items = lists_of_mission(far, link.identity)[MissionKind.MISSION]
    assert len(items) == count
    found, why = link.upload_items(MissionKind.MISSION, items)
    assert found is UploadOutcome(outcome)
    assert ("NO_SPACE" in why) == (found is UploadOutcome.REJECTED)


def test_the_storage_of_a_vehicle_is_read_where_a_mission_is_long() -> None:
    far = mission(takeoff(30.0), *[waypoint(float(n), 30.0) for n in range(200)], rtl())
    assert fetch_snapshot(_link(), far).storage_b == 16_384
    assert fetch_snapshot(_link("no-files"), far).storage_b is None
    assert fetch_snapshot(_link()).storage_b is None  # 4 items: nothing is asked


@pytest.mark.parametrize("faults", ["no-terrain", ""])
def test_terrain_that_a_vehicle_lacks_is_told_where_the_mission_counts_heights_from_it(
    faults: str,
) -> None:
    flat = mission(takeoff(30.0), waypoint(200.0, 30.0), rtl())
    over = replace(
        flat,
        items=tuple(
            replace(item, frame=Frame.GLOBAL_TERRAIN_ALT) if item.command == 16 else item
            for item in flat.items
        ),
    )
    for sent, fires in ((over, bool(faults)), (flat, False)):
        snapshot = fetch_snapshot(_link(faults), sent)
        result = check_vehicle(snapshot, SETUP, mission=sent)
        assert any(one.code == "X910" for one in result.findings) == fires
        assert not fires or result.verdict == "no-go"


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
def test_a_mission_that_is_sent_after_a_flight_begins_at_its_beginning(
    autopilot: Autopilot,
) -> None:
    """PX4 1.17 began one without a current item at the end of the last: it returned at once."""
    line = memory_line(autopilot)
    missions = line._wire.vehicle.missions
    link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
    items = missions.lists[MissionKind.MISSION]
    missions.current = len(items) - 1
    other = tuple(replace(one, z=one.z + 1.0) for one in items)
    assert link.upload_items(MissionKind.MISSION, other)[0] is UploadOutcome.ACCEPTED
    assert missions.current == 0


@pytest.mark.parametrize(
    ("autopilot", "content"),
    [
        (Autopilot.ARDUPILOT, b"8264a9b4"),  # its first characters
        (Autopilot.PX4, bytes.fromhex("b4a96482")),  # its first bytes, in a number of 64 bits
    ],
)
def test_a_revision_is_read_as_the_autopilot_sends_it(autopilot: Autopilot, content: bytes) -> None:
    identity = memory_line(autopilot)._wire.vehicle.setup.identity
    assert _revision(content, identity) == "8264a9b4"


def test_a_simulated_vehicle_reports_its_fence_and_that_it_may_arm() -> None:
    for autopilot, prearm in ((Autopilot.PX4, 0), (Autopilot.ARDUPILOT, 1 << 28)):
        line = memory_line(autopilot)
        link = VehicleLink(line, name="simulated")
        link.fetch_state()
        status = link.connection.telemetry.latest("SYS_STATUS")
        assert status is not None
        health = status["onboard_control_sensors_health"]
        assert (health & 1 << 20, health & 1 << 28) == (1 << 20, prearm)
