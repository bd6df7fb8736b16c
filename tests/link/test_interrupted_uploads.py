"""An upload that somebody stops: whatever the settings, the vehicle gets back what it had."""

from __future__ import annotations

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import MemoryLine, wire
from virtual_vehicle import VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, MissionResult
from planner.link.transfers import LinkSettings
from planner.link.upload import BrokenUploadError, InterruptedUploadError, upload_mission
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message, message

NEW = mission(takeoff(35.0), waypoint(300.0, 35.0), waypoint(600.0, 35.0), rtl())
SENT = frozenset({44, 73})
"""MISSION_COUNT and MISSION_ITEM_INT."""


class _StoppedLine(MemoryLine):
    """Ctrl-C comes with the n-th message of an upload."""

    left = 0

    def send(self, data: bytes, peer: object = None) -> None:
        super().send(data, peer)
        if data[7] in SENT and self.left:
            self.left -= 1
            if not self.left:
                raise KeyboardInterrupt


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
@pytest.mark.parametrize("faults", ["delay=0.15", "delay=0.3,loss=5%"])
def test_with_impatient_settings_the_old_mission_is_put_back_as_long_as_heartbeats_come(
    autopilot: Autopilot, faults: str
) -> None:
    for number in range(1, 9, 2):  # a fence of 5 messages, and a mission of 5
        made = wire(autopilot, faults)
        before = dict(made.vehicle.missions.lists)
        line = _StoppedLine(made)
        # The connection is made patiently, or nothing would be sent at all.
        link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
        line.left = number
        link.settings = LinkSettings(reply_timeout_s=0.7, retries=3)
        with pytest.raises(LinkError) as stopped:
            upload_mission(link, NEW, listen_s=1.0)
        if line.left:  # it stalled before: nothing was sent, or put back too
            assert not isinstance(stopped.value, BrokenUploadError)
        else:
            assert isinstance(stopped.value, InterruptedUploadError)
            assert str(stopped.value).endswith(
                "the old mission is on the vehicle, it was read back whole"
            )
        skipped = int(autopilot is Autopilot.ARDUPILOT)  # home is the vehicle's own
        for kind in MissionKind:
            assert made.vehicle.missions.lists[kind][skipped:] == before[kind][skipped:]


class _BusyVehicle(VirtualVehicle):
    """Takes one list, and then nothing any more; its heartbeats come."""

    def _on_mission_count(self, one: Message, now_s: float) -> list[Message]:
        if any(old.name == "MISSION_ITEM_INT" for old in self.received):
            kind = one["mission_type"]
            return [message("MISSION_ACK", type=MissionResult.DENIED, mission_type=kind)]
        return super()._on_mission_count(one, now_s)


def test_a_vehicle_that_is_busy_is_called_so() -> None:
    class Stopped(VirtualLine):
        items = 0

        def send(self, data: bytes, peer: object = None) -> None:
            super().send(data, peer)
            self.items += data[7] == 73
            if data[7] == 73 and self.items == 3:
                raise KeyboardInterrupt

    vehicle = _BusyVehicle(autopilot=3)
    vehicle.lists[MissionKind.MISSION] = waypoints(4)
    line = Stopped(vehicle)
    link = VehicleLink(line, name="virtual", purpose=Purpose.UPLOAD)
    with pytest.raises(InterruptedUploadError) as stopped:
        upload_mission(link, NEW, listen_s=1.0)
    said = str(stopped.value)
    assert "the vehicle is busy and did not take back what it had (the old mission: DENIED)" in said
    assert "does not answer" not in said
    assert line.now_s() < 120.0


def test_a_vehicle_that_falls_silent_is_called_so() -> None:
    class Stopped(VirtualLine):
        def send(self, data: bytes, peer: object = None) -> None:
            if data[7] == 73:
                self._cut_after = 0
                raise KeyboardInterrupt
            super().send(data, peer)

    vehicle = VirtualVehicle()
    vehicle.lists[MissionKind.MISSION] = waypoints(4)
    link = VehicleLink(Stopped(vehicle), name="virtual", purpose=Purpose.UPLOAD)
    with pytest.raises(
        InterruptedUploadError, match=r"interrupted; the vehicle does not answer any more"
    ):
        upload_mission(link, NEW, listen_s=1.0)
