"""An upload that somebody stops: whatever the settings, the vehicle gets back what it had."""

from __future__ import annotations

import pytest
from fenced_missions import box
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import MemoryLine, wire
from virtual_vehicle import VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.geo.fence import Fence
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, MissionResult
from planner.link.transfers import LinkSettings
from planner.link.upload import BrokenUploadError, InterruptedUploadError, upload_mission
from planner.link.vehicle import VehicleLink
from planner.link.wire import Message, message
from planner.values import replace

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


class _KilledError(BaseException):
    """SIGKILL: nothing is put back."""


class _KilledLine(_StoppedLine):
    """The program is killed by the n-th message of an upload."""

    def send(self, data: bytes, peer: object = None) -> None:
        try:
            super().send(data, peer)
        except KeyboardInterrupt as error:
            raise _KilledError from error


@pytest.mark.parametrize("autopilot", [Autopilot.PX4, Autopilot.ARDUPILOT])
@pytest.mark.parametrize("is_fenced", [True, False])
def test_wherever_it_is_killed_no_mission_is_without_its_fence(
    autopilot: Autopilot, *, is_fenced: bool
) -> None:
    new = replace(NEW, fence=Fence(polygons=(box(-700.0, -700.0, 700.0, 2500.0),)))
    new = new if is_fenced else NEW
    old_missions = new_missions = 0
    for number in range(1, 30):
        made = wire(autopilot)
        lists = made.vehicle.missions.lists
        before = {kind: tuple(items) for kind, items in lists.items()}
        line = _KilledLine(made)
        link = VehicleLink(line, name="simulated", purpose=Purpose.UPLOAD)
        line.left = number
        try:
            upload_mission(link, new, listen_s=0.0)
        except _KilledError:
            until_s = line.now_s() + 20.0  # what is under way arrives, a transfer is given up
            while line.now_s() < until_s:
                line.receive(until_s - line.now_s())
        else:
            break
        skipped = int(autopilot is Autopilot.ARDUPILOT)
        is_old = lists[MissionKind.MISSION][skipped:] == list(before[MissionKind.MISSION][skipped:])
        old_missions, new_missions = old_missions + is_old, new_missions + (not is_old)
        assert lists[MissionKind.FENCE] or not (is_old or is_fenced), number
        if is_fenced and not is_old:
            assert lists[MissionKind.FENCE] != list(before[MissionKind.FENCE])
    assert old_missions
    assert new_missions
    assert bool(lists[MissionKind.FENCE]) == is_fenced
