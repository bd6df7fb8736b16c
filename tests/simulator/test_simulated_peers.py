"""Clients of others against the simulated vehicle, over real sockets on this computer."""

from __future__ import annotations

import queue
import socket
import time
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import mavsdk
import pytest
from mavsdk import Configuration, Mavsdk
from mavsdk.plugins.arm_authorizer_server import ArmAuthorizerServer, RejectionReason
from mavsdk.plugins.ftp import Ftp, FtpResult
from mavsdk.plugins.log_files import LogFiles
from mavsdk.plugins.mission_raw import MissionRaw
from mavsdk.plugins.param import Param
from mavsdk.plugins.telemetry import Telemetry
from simulated_vehicles import free_port, memory_line, request, vehicle

from planner.autopilot import Autopilot
from planner.link.address import LinkAddress, LinkKind
from planner.link.mission import MissionKind
from planner.link.vehicle import LinkRequest, VehicleLink, open_link
from planner.service.simulation import open_simulation

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    from planner.simulator.vehicle import SimulatedVehicle
    from planner.simulator.wire import PassedMessage

PX4, ARDUPILOT = Autopilot.PX4, Autopilot.ARDUPILOT
BOTH = pytest.mark.parametrize("autopilot", [PX4, ARDUPILOT])
DEADLINE_S = 10.0


@contextmanager
def _simulated(
    autopilot: Autopilot,
    address: LinkAddress,
    *,
    said: queue.Queue[str] | None = None,
    authoriser: int | None = None,
) -> Iterator[SimulatedVehicle]:
    """Have a vehicle speak in a thread; what it says as text is put into a queue."""
    asked = request(autopilot, authoriser=authoriser)
    made = vehicle(autopilot, authoriser=authoriser)
    runner, wire = open_simulation(made, asked, address)

    def _hear(passed: PassedMessage) -> None:
        if said is not None and passed.message.name == "STATUSTEXT":
            said.put(passed.message["text"])

    wire.on_message = _hear
    with runner:
        yield made


def _udp() -> tuple[int, LinkAddress]:
    port = free_port(socket.SOCK_DGRAM)
    return port, LinkAddress(kind=LinkKind.UDP_SEND, host="127.0.0.1", port=port)


def _tcp() -> tuple[int, LinkAddress]:
    port = free_port(socket.SOCK_STREAM)
    return port, LinkAddress(kind=LinkKind.TCP_LISTEN, host="127.0.0.1", port=port)


@contextmanager
def _mavsdk(port: int, configuration: Configuration | None = None) -> Iterator[tuple[Any, Any]]:
    """Return MAVSDK and the vehicle that it found at a port of this computer."""
    mavsdk.log_subscribe(lambda *_: True)
    configuration = configuration or Configuration.create_manual(246, 190, True)  # noqa: FBT003 - positional there
    with Mavsdk(configuration) as sdk:
        sdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        system = sdk.first_autopilot(DEADLINE_S)
        assert system is not None
        yield sdk, system


@BOTH
def test_mavsdk_reads_mission_fence_rally_points_and_parameters(autopilot: Autopilot) -> None:
    port, address = _udp()
    with _simulated(autopilot, address) as made, _mavsdk(port) as (_, system):
        raw = MissionRaw(system)
        for kind, items in (
            (MissionKind.MISSION, raw.download_mission()),
            (MissionKind.FENCE, raw.download_geofence()),
            (MissionKind.RALLY, raw.download_rallypoints()),
        ):
            held = made.missions.lists[kind]
            assert [(i.command, i.frame, i.x, i.y, i.z) for i in items] == [
                (i.command, i.frame, i.x, i.y, pytest.approx(i.z)) for i in held
            ]
        found = Param(system).get_all_params()
        values = {one.name: one.value for one in (*found.int_params, *found.float_params)}
        for one in made.setup.parameters:
            # MAVSDK reads ArduPilot's whole numbers as they are, PX4's byte for byte.
            assert values[one.name] == pytest.approx(one.value, rel=1e-6), one.name


@BOTH
def test_mavsdk_reads_what_we_read(autopilot: Autopilot) -> None:
    port, address = _udp()
    link = VehicleLink(memory_line(autopilot), name="simulated")
    with _simulated(autopilot, address), _mavsdk(port) as (_, system):
        raw = MissionRaw(system)
        for kind, theirs in (
            (MissionKind.MISSION, raw.download_mission()),
            (MissionKind.FENCE, raw.download_geofence()),
            (MissionKind.RALLY, raw.download_rallypoints()),
        ):
            ours = link.fetch_items(kind) or ()
            assert [
                *((one.command, one.frame, one.x, one.y, one.z, one.autocontinue) for one in ours)
            ] == [(one.command, one.frame, one.x, one.y, one.z, one.autocontinue) for one in theirs]
            for one, other in zip(ours, theirs, strict=True):
                for name in ("param1", "param2", "param3", "param4"):
                    value = getattr(other, name)
                    assert getattr(one, name) == pytest.approx(value, nan_ok=True)


@BOTH
def test_mavsdk_uploads_a_mission_and_clears_it(autopilot: Autopilot) -> None:
    port, address = _udp()
    with _simulated(autopilot, address) as made, _mavsdk(port) as (_, system):
        raw = MissionRaw(system)
        items = raw.download_mission()
        items[1].z = 55.0
        raw.upload_mission(items)
        assert made.missions.lists[MissionKind.MISSION][1].z == 55.0
        raw.clear_mission()
        # MAVSDK clears ArduPilot's by sending it one item, home.
        assert len(made.missions.lists[MissionKind.MISSION]) == int(autopilot is ARDUPILOT)


def test_mavsdk_hears_where_home_is_and_how_full_the_battery_is() -> None:
    port, address = _udp()
    with _simulated(PX4, address), _mavsdk(port) as (_, system):
        telemetry = Telemetry(system)
        homes: queue.Queue[Any] = queue.Queue()
        batteries: queue.Queue[Any] = queue.Queue()
        telemetry.subscribe_home(homes.put)
        telemetry.subscribe_battery(batteries.put)
        home = homes.get(timeout=DEADLINE_S)
        assert home.latitude_deg == pytest.approx(47.0, abs=1e-7)
        assert home.absolute_altitude_m == pytest.approx(400.0, abs=1e-3)
        battery = batteries.get(timeout=DEADLINE_S)
        assert battery.remaining_percent == pytest.approx(100.0)
        # the model's curve, full; the 22.2 V of the label scale what it holds, not what it shows
        assert battery.voltage_v == pytest.approx(25.227, abs=0.002)


@BOTH
def test_mavsdk_downloads_the_log_both_ways(autopilot: Autopilot, tmp_path: Path) -> None:
    port, address = _udp()
    with _simulated(autopilot, address) as made, _mavsdk(port) as (_, system):
        (log,) = made.setup.logs
        folder, _, name = log.path.rpartition("/")
        files = Ftp(system)
        assert [one.name for one in files.list_directory(folder).entries] == [name]
        (entry,) = LogFiles(system).get_entries()
        assert entry.size_bytes == len(log.content)
        done: queue.Queue[Any] = queue.Queue()
        files.download_async(
            log.path, str(tmp_path), use_burst=True, callback=lambda result, *_: done.put(result)
        )
        while (result := done.get(timeout=DEADLINE_S)) == FtpResult.NEXT:
            pass
        assert result == FtpResult.SUCCESS
        assert (tmp_path / name).read_bytes() == log.content


@pytest.mark.parametrize(
    ("is_accepted", "text"),
    [(True, "SIMULATED: arming authorised, armed"), (False, "Arming denied: invalid waypoint 3")],
)
def test_mavsdk_authorises_arming_or_does_not(*, is_accepted: bool, text: str) -> None:
    port, address = _udp()
    authoriser = Configuration.create_manual(10, 1, True)  # noqa: FBT003 - positional there
    said: queue.Queue[str] = queue.Queue()
    with (
        _simulated(PX4, address, said=said, authoriser=10) as made,
        _mavsdk(port, authoriser) as (sdk, _),
    ):
        server = ArmAuthorizerServer(sdk.server_component(0))
        asked: queue.Queue[Any] = queue.Queue()
        server.subscribe_arm_authorization(lambda *_: asked.put("asked"))
        made.arm_at(time.monotonic())
        asked.get(timeout=DEADLINE_S)
        if is_accepted:
            server.accept_arm_authorization(30)
        else:
            server.reject_arm_authorization(False, RejectionReason.INVALID_WAYPOINT, 3)  # noqa: FBT003 - positional there
        while said.get(timeout=DEADLINE_S) != text:
            pass
        assert made.is_flying is is_accepted
        server.destroy()


def test_a_ground_station_hangs_up_and_comes_again_over_tcp() -> None:
    port, address = _tcp()
    here = LinkAddress(kind=LinkKind.TCP_CONNECT, host="127.0.0.1", port=port)
    with _simulated(PX4, address) as made:
        for _ in range(2):
            with open_link(LinkRequest(address=here)) as link:
                items = link.fetch_items(MissionKind.MISSION)
            assert items is not None
            held = made.missions.lists[MissionKind.MISSION]
            assert [(i.command, i.x, i.z) for i in items] == [(i.command, i.x, i.z) for i in held]


@BOTH
def test_pymavlink_walks_through_the_mission(autopilot: Autopilot) -> None:
    from pymavlink import mavutil

    port, address = _tcp()
    with _simulated(autopilot, address) as made:
        line = mavutil.mavlink_connection(f"tcp:127.0.0.1:{port}", source_system=247)
        try:
            line.mav.heartbeat_send(6, 8, 0, 0, 4)
            assert line.wait_heartbeat(timeout=DEADLINE_S) is not None
            line.mav.mission_request_list_send(1, 1, 0)
            count = line.recv_match(type="MISSION_COUNT", blocking=True, timeout=DEADLINE_S).count
            heights = []
            for seq in range(count):
                line.mav.mission_request_int_send(1, 1, seq, 0)
                item = line.recv_match(type="MISSION_ITEM_INT", blocking=True, timeout=DEADLINE_S)
                heights.append(item.z)
            line.mav.mission_ack_send(1, 1, 0, 0)
            assert heights == [one.z for one in made.missions.lists[MissionKind.MISSION]]
            line.mav.param_request_list_send(1, 1)
            names: set[str] = set()
            while len(names) < len(made.setup.parameters):
                value = line.recv_match(type="PARAM_VALUE", blocking=True, timeout=DEADLINE_S)
                if value.param_index < value.param_count:
                    names.add(value.param_id)
            assert names == {one.name for one in made.setup.parameters}
        finally:
            line.close()
