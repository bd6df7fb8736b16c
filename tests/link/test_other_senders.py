"""A line belongs to its vehicle: what comes by its ids from anywhere else never counts."""

from __future__ import annotations

import socket
import tracemalloc
from contextlib import ExitStack, closing, suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import pytest
from guarded_vehicle import GuardedVehicle, guarded
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import free_port, wire
from virtual_vehicle import PX4, VirtualLine, VirtualVehicle, waypoints

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.guard.authorisation import go_judgement
from planner.guard.decision import GuardSettings
from planner.guard.session import GuardSession
from planner.link.address import LinkAddress, LinkKind
from planner.link.connection import Connection, Purpose, TwoVehiclesError
from planner.link.mission import MissionKind
from planner.link.transfers import LinkSettings
from planner.link.upload import upload_mission
from planner.link.vehicle import LinkRequest, VehicleLink, open_link
from planner.link.wire import Codec, Message, UdpLine, message
from planner.simulator.wire import SimulationRunner

if TYPE_CHECKING:
    from collections.abc import Callable

FULL = message(
    "BATTERY_STATUS",
    battery_remaining=100,
    voltages=[16_800, *[65_535] * 9],
    voltages_ext=[0] * 4,
    current_battery=-1,
)
BEAT = message("HEARTBEAT", type=2, autopilot=PX4, system_status=3, mavlink_version=3)
SPOOFED = {
    "battery": FULL,
    "status": message("SYS_STATUS", battery_remaining=100, voltage_battery=16_800),
    "heartbeat": BEAT,
    "count": message("MISSION_COUNT", count=1, mission_type=0),
    "item": message("MISSION_ITEM_INT", seq=0, command=21, frame=2, mission_type=0),
    "acceptance": message("MISSION_ACK", type=0, mission_type=0),
    "parameter": message("PARAM_VALUE", param_id="COM_ARM_AUTH_REQ", param_count=1),
    "home": message("HOME_POSITION", latitude=1, longitude=1, altitude=1, q=[0.0] * 4),
    "request to arm": message("COMMAND_LONG", target_system=245, command=3001),
}


@dataclass
class Spoofer(VirtualVehicle):
    """A second sender: it plays the vehicle, by one message, from a time on."""

    says: Message = BEAT
    from_s: float = 0.0
    heard: list[str] = field(default_factory=list)

    def tick(self, now_s: float) -> list[Message]:
        return [self.says] if now_s >= self.from_s else []

    def take(self, one: Message, now_s: float) -> list[Message]:
        if now_s >= self.from_s:
            self.heard.append(one.name)
        return []


def _vehicle() -> VirtualVehicle:
    one = VirtualVehicle(battery_remaining=21)
    one.lists[MissionKind.MISSION] = waypoints(40)
    one.parameters = {f"P{number}": (0.5, 9) for number in range(40)}
    return one


@pytest.mark.parametrize("says", SPOOFED.values(), ids=SPOOFED)
@pytest.mark.parametrize("act", ["mission", "parameters", "state", "upload"])
def test_what_another_sender_says_by_its_ids_ends_what_is_under_way(
    says: Message, act: str
) -> None:
    spoofer = Spoofer(says=says, from_s=1.35)  # the vehicle is found after 1.2 s
    line = VirtualLine(_vehicle(), spoofer)
    link = VehicleLink(line, name="virtual", purpose=Purpose.UPLOAD)
    acts: dict[str, Callable[[], object]] = {
        "mission": lambda: [link.fetch_items(kind) for kind in MissionKind],
        "parameters": lambda: [link.fetch_parameters() for _ in range(30)],
        "state": lambda: [link.fetch_state() for _ in range(9)],
        "upload": lambda: link.upload_items(MissionKind.MISSION, waypoints(40)),
    }
    assert line.now_s() < spoofer.from_s
    with pytest.raises(TwoVehiclesError, match=r"two vehicles answer to system id 1: 0 and 1 send"):
        acts[act]()
    assert spoofer.heard == []  # nothing was sent to it
    battery = link.connection.telemetry.state().battery
    assert battery is None or battery.remaining_fraction == 0.21


def test_two_senders_are_told_before_anything_is_asked() -> None:
    for says in (FULL, BEAT):
        line = VirtualLine(_vehicle(), Spoofer(says=says))
        with pytest.raises(TwoVehiclesError):
            VehicleLink(line, name="virtual")


def test_who_is_heard_first_is_not_believed_either() -> None:
    vehicle = _vehicle()
    with pytest.raises(TwoVehiclesError):
        VehicleLink(VirtualLine(Spoofer(says=BEAT), vehicle), name="virtual")
    assert {one.name for one in vehicle.received} <= {"HEARTBEAT"}


def test_a_companion_of_its_system_id_may_speak_from_elsewhere_and_does_not_count() -> None:
    for says in SPOOFED.values():
        companion = Spoofer(says=says, component=191)
        if says is BEAT:  # that of a companion computer: MAV_TYPE 18, no autopilot
            companion.says = message("HEARTBEAT", type=18, autopilot=8, mavlink_version=3)
        link = VehicleLink(VirtualLine(_vehicle(), companion), name="virtual")
        assert link.fetch_items(MissionKind.MISSION) == waypoints(40)
        battery = link.fetch_state().battery
        assert battery is not None
        assert battery.remaining_fraction == 0.21


NEW = mission(takeoff(35.0), *(waypoint(10.0 * one, 35.0) for one in range(1, 30)), rtl())


@pytest.mark.parametrize("autopilot", [PX4, 3])
def test_an_upload_that_somebody_speaks_into_puts_the_old_mission_back(autopilot: int) -> None:
    vehicle = _vehicle()
    vehicle.autopilot = autopilot
    line = VirtualLine(vehicle, Spoofer(says=FULL, from_s=3.0))
    link = VehicleLink(line, name="virtual", purpose=Purpose.UPLOAD)
    assert line.now_s() < 1.5
    # 30 items of two messages of 10 ms after three lists of 40 are under way at 3 s.
    link.listen(2.9 - line.now_s() - 0.85)
    with pytest.raises(LinkError, match=r"two vehicles .*the old mission is on the vehicle"):
        upload_mission(link, NEW, listen_s=1.0)
    assert "MISSION_ITEM_INT" in {one.name for one in vehicle.received}
    assert vehicle.lists[MissionKind.MISSION] == waypoints(40)


def _guard(vehicle: GuardedVehicle, spoofer: Spoofer) -> LinkError | None:
    line = VirtualLine(vehicle, spoofer)
    link = VehicleLink(line, name="virtual", purpose=Purpose.GUARD)

    def on_status(_: object) -> None:
        if line.now_s() > 30.0:
            raise TimeoutError

    session = GuardSession(
        link,
        GuardSettings(lost_after_s=15.0),
        judge=lambda _: (go_judgement(margin_wh=1.0), None),
        on_decision=lambda _: None,
        on_status=on_status,
    )
    with suppress(TimeoutError):
        try:
            session.run()
        except LinkError as error:
            return error
    return None


@pytest.mark.parametrize("says", SPOOFED.values(), ids=SPOOFED)
def test_a_guard_that_hears_another_sender_answers_nobody(says: Message) -> None:
    vehicle = guarded(battery_remaining=21, script=[(20.5, GuardedVehicle.ask)])
    error = _guard(vehicle, Spoofer(says=says, from_s=20.0))
    assert isinstance(error, TwoVehiclesError)
    assert vehicle.results() == []


def test_a_companion_neither_asks_a_guard_nor_keeps_it_from_answering() -> None:
    asks = SPOOFED["request to arm"]
    vehicle = guarded(script=[(20.0, GuardedVehicle.ask)])
    assert _guard(vehicle, Spoofer(says=asks, component=191, from_s=10.0)) is None
    assert vehicle.results() == [0]


def test_a_companion_does_not_make_a_silent_vehicle_heard() -> None:
    vehicle = guarded()
    vehicle.script = [(10.0, lambda one: setattr(one, "is_silent", True))]
    error = _guard(vehicle, Spoofer(says=FULL, component=191))
    assert "was not heard for 15 s" in str(error)


def test_a_second_sender_over_udp_ends_a_fetch() -> None:
    port = free_port(socket.SOCK_DGRAM)
    ours = LinkAddress(kind=LinkKind.UDP_LISTEN, host="127.0.0.1", port=port)
    theirs = LinkAddress(kind=LinkKind.UDP_SEND, host="127.0.0.1", port=port)
    frame = Codec(1, 1).encode(FULL)
    with (
        SimulationRunner(wire(Autopilot.PX4), theirs),
        open_link(LinkRequest(address=ours)) as link,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other,
    ):
        assert link.fetch_items(MissionKind.MISSION)
        other.sendto(frame, ("127.0.0.1", port))
        where = f"127.0.0.1:{other.getsockname()[1]}"
        with pytest.raises(TwoVehiclesError, match=where):
            link.listen(2.0)


GARBAGE = bytes((0xFD, 255, 0, 0))
"""Begins a frame that never ends: what pymavlink holds is never empty."""


def test_what_a_sender_never_finishes_is_not_kept() -> None:
    codec = Codec(1, 1)
    codec.decode(GARBAGE * 100)
    tracemalloc.start()
    for _ in range(200):
        codec.decode(GARBAGE * 1000)  # 800 kB
    kept, _ = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert kept < 50_000
    beat = Codec(1, 1).encode(BEAT)
    assert "HEARTBEAT" in {one.name for _ in range(40) for one in codec.decode(beat)}


def test_a_hundred_strange_ports_neither_hide_a_vehicle_nor_cost_memory() -> None:
    port = free_port(socket.SOCK_DGRAM)
    line = UdpLine(LinkAddress(kind=LinkKind.UDP_LISTEN, host="127.0.0.1", port=port))
    connection = Connection(line, name="flooded", settings=LinkSettings())
    frame = Codec(7, 1).encode(BEAT)

    def flood() -> None:
        with ExitStack() as opened:
            for _ in range(100):
                one = opened.enter_context(socket.socket(socket.AF_INET, socket.SOCK_DGRAM))
                one.sendto(GARBAGE * 250, ("127.0.0.1", port))  # 1 kB
            connection.listen(0.001)

    with closing(line), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as vehicle:
        flood()
        vehicle.sendto(frame, ("127.0.0.1", port))
        assert connection.wait_for_vehicle().system == 7
        tracemalloc.start()
        flood()
        before, _ = tracemalloc.get_traced_memory()
        for _ in range(5):
            flood()
        after, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert after - before < 50_000  # 500 kB came
        assert peak < 1_000_000  # 64 kB are taken at a time, and twice as much again is made of it
        connection.listen(0.1)
        vehicle.sendto(frame, ("127.0.0.1", port))
        assert connection.hears_vehicle(2.0)


def test_a_turn_takes_no_more_than_a_bound_of_what_has_come() -> None:
    line = UdpLine(
        LinkAddress(kind=LinkKind.UDP_LISTEN, host="127.0.0.1", port=free_port(socket.SOCK_DGRAM))
    )
    with closing(line), socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        for _ in range(10):
            other.sendto(bytes(20_000), ("127.0.0.1", line.port))
        taken = [len(data) for _, data in line.receive(1.0)]
    assert sum(taken[:-1]) < 1 << 16 <= sum(taken)
