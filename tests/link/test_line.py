"""Real lines: serial over a pair of pseudo terminals, TCP both ways round, and what may go wrong."""

from __future__ import annotations

import errno
import os
import select
import socket
import sys
import threading
from contextlib import closing, contextmanager
from typing import TYPE_CHECKING, Any

import pytest
from made_missions import mission, rtl, takeoff, waypoint
from simulated_vehicles import free_port, request, vehicle, wire
from virtual_vehicle import VirtualLine, VirtualVehicle

from planner.autopilot import Autopilot
from planner.errors import LinkError
from planner.link.address import LinkAddress, LinkKind, read_address
from planner.link.connection import Connection, Purpose
from planner.link.mission import MissionKind
from planner.link.transfers import LinkSettings
from planner.link.upload import _put_back, is_same, upload_mission
from planner.link.vehicle import LinkRequest, VehicleLink, open_link
from planner.link.wire import Codec, message, open_line, opening_error
from planner.service.simulation import open_simulation
from planner.service.vehicle import fetch_logs, fetch_vehicle
from planner.simulator.wire import SimulationRunner

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planner.link.wire import Message, VehicleLine
    from planner.simulator.wire import PassedMessage, SimulatedWire

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
SERIAL = pytest.mark.skipif(sys.platform == "win32", reason="Windows has no pseudo terminals")
IMPATIENT = LinkSettings(heartbeat_timeout_s=2.0, reply_timeout_s=0.2, retries=3)


class Cable:
    """Two serial ports whose wires are crossed."""

    def __init__(self) -> None:
        self._masters: list[int] = []
        self._slaves: list[int] = []
        for _ in range(2):
            master, slave = os.openpty()
            self._masters.append(master)
            self._slaves.append(slave)
        self.devices = [os.ttyname(slave) for slave in self._slaves]
        self._stop, self._stopping = os.pipe()
        self._thread = threading.Thread(target=self._carry, name="cable", daemon=True)
        self._thread.start()

    def _carry(self) -> None:
        one, other = self._masters
        while True:
            ready, _, _ = select.select([one, other, self._stop], [], [])
            if self._stop in ready:
                return
            for end in ready:
                os.write(other if end == one else one, os.read(end, 4096))

    def pull(self) -> None:
        """Pull it out; once is enough."""
        if self._masters:
            os.write(self._stopping, b"x")
            self._thread.join()
            for end in (*self._masters, *self._slaves, self._stop, self._stopping):
                os.close(end)
            self._masters = []


@pytest.fixture
def cable() -> Iterator[Cable]:
    made = Cable()
    yield made
    made.pull()


@contextmanager
def _speaking(autopilot: Autopilot, address: LinkAddress) -> Iterator[None]:
    """Have a vehicle with files speak on a line."""
    runner, _ = open_simulation(vehicle(autopilot), request(autopilot), address)
    with runner:
        yield


@SERIAL
@BOTH
def test_everything_comes_over_a_serial_line(
    autopilot: Autopilot, cable: Cable, tmp_path: Path
) -> None:
    theirs, ours = (read_address(f"{device},115200") for device in cable.devices)
    assert ours.kind is LinkKind.SERIAL
    with _speaking(autopilot, theirs):
        snapshot = fetch_vehicle(LinkRequest(address=ours))
        assert [item.command for item in snapshot.mission.items] == [22, 16, 16, 20]
        assert snapshot.mission.fence is not None
        assert len(snapshot.parameters) == len(vehicle(autopilot).setup.parameters)
        fetched = fetch_logs(LinkRequest(address=ours), is_all=True, folder=tmp_path)
    (log,) = vehicle(autopilot).setup.logs
    assert fetched.downloaded[0].path.read_bytes() == log.content
    assert fetched.downloaded[0].is_confirmed  # by the checksum of its server


def _use(line: VehicleLine) -> None:
    for _ in range(100):  # the first bytes may still go somewhere
        line.send(bytes(300))
        line.receive(0.01)


@SERIAL
def test_a_serial_line_that_is_pulled_out_breaks_with_a_sentence(cable: Cable) -> None:
    theirs, ours = (read_address(device) for device in cable.devices)
    with closing(open_line(theirs)), closing(open_line(ours)) as line:
        cable.pull()
        with pytest.raises(LinkError, match=r"the serial line broke: .*is the cable in"):
            _use(line)


@SERIAL
def test_a_serial_port_that_another_program_has_is_not_read_by_two(cable: Cable) -> None:
    address = read_address(cable.devices[0])
    with closing(open_line(address)), pytest.raises(LinkError, match="another program has it open"):
        open_line(address)


@SERIAL
def test_a_device_that_is_none_is_told() -> None:
    with pytest.raises(LinkError, match="cannot be opened: No such file"):
        open_line(read_address("/dev/ttyNONE7"))
    with pytest.raises(
        LinkError, match=r"Inappropriate ioctl for device; that is not a serial device"
    ):
        open_line(read_address("/dev/null"))


@BOTH
def test_a_vehicle_may_connect_to_us_over_tcp(autopilot: Autopilot) -> None:
    port = free_port(socket.SOCK_STREAM)
    ours = LinkAddress(kind=LinkKind.TCP_LISTEN, host="127.0.0.1", port=port)
    theirs = LinkAddress(kind=LinkKind.TCP_CONNECT, host="127.0.0.1", port=port)
    with closing(open_line(ours)) as line, SimulationRunner(wire(autopilot), theirs):
        items = VehicleLink(line, name=ours.text).fetch_items(MissionKind.MISSION)
    assert [item.command for item in items or ()][-4:] == [22, 16, 16, 20]


def _tcp() -> tuple[LinkAddress, LinkAddress]:
    """Return the addresses of a vehicle that listens, and of who calls it."""
    port = free_port(socket.SOCK_STREAM)
    theirs = LinkAddress(kind=LinkKind.TCP_LISTEN, host="127.0.0.1", port=port)
    return theirs, LinkAddress(kind=LinkKind.TCP_CONNECT, host="127.0.0.1", port=port)


def test_a_vehicle_that_hangs_up_for_good_ends_the_transfer(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("planner.link.wire.RECONNECT_S", 0.3)
    theirs, ours = _tcp()
    runner = SimulationRunner(wire(PX4), theirs)
    with runner, open_link(LinkRequest(address=ours)) as link:
        runner.close()
        with pytest.raises(LinkError, match=r"closed the line|the line broke"):
            link.fetch_items(MissionKind.MISSION)


def _hang_up(runner: SimulationRunner, made: SimulatedWire, name: str, count: int) -> None:
    """Have the line of everyone break with the n-th message of a name."""
    left = [count]

    def hear(passed: PassedMessage) -> None:
        left[0] -= passed.message.name == name
        if not left[0]:
            left[0] = -1
            for stream in runner._line._streams:  # type: ignore[attr-defined] # a server's
                stream.shutdown(socket.SHUT_RDWR)

    made.on_message = hear


@BOTH
def test_a_stream_that_breaks_is_made_again_and_the_transfer_goes_on(autopilot: Autopilot) -> None:
    theirs, ours = _tcp()
    made = wire(autopilot, "no-files")
    runner = SimulationRunner(made, theirs)
    with runner, open_link(LinkRequest(address=ours)) as link:
        _hang_up(runner, made, "MISSION_ITEM_INT", 2)
        items = link.fetch_items(MissionKind.MISSION)
    assert [item.command for item in items or ()][-4:] == [22, 16, 16, 20]


def test_an_upload_whose_stream_breaks_for_a_while_leaves_the_old_mission_or_the_new(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It breaks for longer than the transfer waits: the old mission is put back by another stream."""
    monkeypatch.setattr("planner.link.wire.RECONNECT_S", 0.0)

    def put_back(*given: Any) -> str:  # noqa: ANN401 - as `_put_back` takes them
        # From here on the line is patient again: a busy machine may take a moment to be heard.
        monkeypatch.setattr("planner.link.wire.RECONNECT_S", 10.0)
        return _put_back(*given)

    monkeypatch.setattr("planner.link.upload._put_back", put_back)
    theirs, ours = _tcp()
    made = wire(Autopilot.ARDUPILOT)
    before = {kind: list(items) for kind, items in made.vehicle.missions.lists.items()}
    runner = SimulationRunner(made, theirs)
    with runner, open_link(LinkRequest(address=ours), purpose=Purpose.UPLOAD) as link:
        _hang_up(runner, made, "MISSION_ITEM_INT", 2)
        with pytest.raises(LinkError, match="the old mission is on the vehicle"):
            upload_mission(link, mission(takeoff(35.0), waypoint(300.0, 35.0), rtl()), listen_s=0.0)
    assert all(is_same(made.vehicle.missions.lists[kind], before[kind]) for kind in MissionKind)


@pytest.mark.parametrize(
    ("spelling", "error", "advice"),
    [
        ("udpin:0.0.0.0:14550", OSError(errno.EADDRINUSE, "x"), "close the other ground station"),
        ("udpin:10.0.0.9:14550", OSError(errno.EADDRNOTAVAIL, "x"), "by udpout or tcp"),
        ("udpin:0.0.0.0:80", OSError(errno.EACCES, "x"), "use another one"),
        ("tcp:10.0.0.9:5760", OSError(errno.ECONNREFUSED, "x"), "nothing listens there"),
        ("tcp:10.0.0.9:5760", TimeoutError("timed out"), "does a firewall keep it away"),
        ("tcp:10.0.0.9:5760", OSError(errno.EHOSTUNREACH, "x"), "is the network up"),
        ("tcp:nohost:5760", socket.gaierror(-2, "x"), "no such host; check its spelling"),
        ("/dev/ttyUSB0", OSError(errno.EACCES, "x"), "join the group that owns it"),
        ("/dev/ttyUSB0", OSError(errno.EBUSY, "x"), "another program has it open"),
        ("/dev/ttyUSB0", OSError(errno.ENOENT, "x"), "serial device"),
    ],
)
def test_why_a_line_cannot_be_opened_comes_with_what_to_try(
    spelling: str, error: OSError, advice: str
) -> None:
    said = str(opening_error(read_address(spelling), error))
    assert said.startswith(f"{read_address(spelling).text} cannot be opened: ")
    assert advice in said
    assert "\n" not in said


class _Sending(VirtualVehicle):
    """Says its own, whatever comes."""

    says: tuple[Message, ...] = ()

    def tick(self, now_s: float) -> list[Message]:  # noqa: ARG002 - as every vehicle
        return list(self.says)

    def take(self, one: Message, now_s: float) -> list[Message]:  # noqa: ARG002 - as every vehicle
        return []


def _unheard(line: VirtualLine, *, system: int | None = None) -> str:
    connection = Connection(line, name="virtual", settings=IMPATIENT, system=system)
    with pytest.raises(LinkError) as caught:
        connection.wait_for_vehicle()
    return str(caught.value)


def test_another_system_id_than_the_one_asked_for_is_told() -> None:
    vehicles = (VirtualVehicle(system=1), VirtualVehicle(system=4))
    said = _unheard(VirtualLine(*vehicles), system=7)
    assert "of that system id: heard were 1, 4; name one of them with --system-id" in said


def test_ground_stations_alone_are_told() -> None:
    station = _Sending()
    station.says = (message("HEARTBEAT", type=6, autopilot=8, mavlink_version=3),)
    assert "only ground stations and other devices were heard" in _unheard(VirtualLine(station))


def test_bytes_that_are_no_mavlink_ask_for_the_speed_of_the_line(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    line = VirtualLine(VirtualVehicle())
    monkeypatch.setattr(Codec, "decode", lambda *_: [])
    assert "bytes came, but no MAVLink; is the speed of the line right" in _unheard(line)


def test_silence_names_the_usual_addresses() -> None:
    assert "udpin:0.0.0.0:14540 and 14550" in _unheard(VirtualLine())


@pytest.mark.parametrize("autopilot", [3, 12])
def test_a_vehicle_that_does_not_hear_us_is_told_from_one_that_is_not_there(autopilot: int) -> None:
    deaf = _Sending()
    deaf.says = (message("HEARTBEAT", type=2, autopilot=autopilot, mavlink_version=3),)
    with pytest.raises(LinkError, match=r"answers nothing: does the line carry both ways"):
        VehicleLink(VirtualLine(deaf), name="virtual", settings=IMPATIENT)


def test_what_the_vehicle_says_to_a_transfer_that_stalls_is_told() -> None:
    class _Armed(VirtualVehicle):
        def _on_mission_request_list(self, _: Message, __: float) -> list[Message]:
            return [message("STATUSTEXT", severity=3, text="Not while armed")]

    link = VehicleLink(VirtualLine(_Armed()), name="virtual", settings=IMPATIENT)
    with pytest.raises(LinkError, match=r"stalled.*; the vehicle reports: Not while armed$"):
        link.fetch_items(MissionKind.MISSION)
