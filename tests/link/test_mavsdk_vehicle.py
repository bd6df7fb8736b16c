"""Our client against a vehicle that MAVSDK's server plugins make: another implementation's.

Its files are those of every simulated vehicle: see `planner.simulator.servers`.
"""

from __future__ import annotations

import socket
from typing import TYPE_CHECKING, Any

import mavsdk
import pytest
from mavsdk import ComponentType, Configuration, Mavsdk
from mavsdk.plugins.mission_raw_server import MissionRawServer
from mavsdk.plugins.param_server import ParamServer
from mavsdk.plugins.telemetry_server import (
    Battery,
    Heading,
    LandedState,
    Position,
    StatusText,
    StatusTextType,
    TelemetryServer,
    VelocityNed,
    VtolState,
)
from simulated_vehicles import free_port
from virtual_vehicle import waypoints

from planner.link.address import LinkAddress, LinkKind
from planner.link.connection import Purpose
from planner.link.mission import MissionKind, UploadOutcome
from planner.link.vehicle import LinkRequest, VehicleLink, open_link

if TYPE_CHECKING:
    from collections.abc import Iterator

WHOLE = {"COM_ARM_AUTH_REQ": -5, "LARGE": 2_000_000_001}
REAL = {"MPC_XY_CRUISE": 6.1, **{f"P{number}": 0.5 * number for number in range(80)}}


@pytest.fixture
def met() -> Iterator[tuple[Any, VehicleLink]]:
    """Return the server component of a vehicle, and our link to it."""
    mavsdk.log_subscribe(lambda *_: True)
    port = free_port(socket.SOCK_DGRAM)
    address = LinkAddress(kind=LinkKind.UDP_LISTEN, host="127.0.0.1", port=port)
    kind = Configuration.create_with_component_type(ComponentType.AUTOPILOT)
    with Mavsdk(kind) as sdk:
        sdk.add_any_connection(f"udpout://127.0.0.1:{port}")
        component = sdk.server_component(0)
        parameters = ParamServer(component)
        for name, whole in WHOLE.items():
            parameters.provide_param_int(name, whole)
        for name, real in REAL.items():
            parameters.provide_param_float(name, real)
        missions = MissionRawServer(component)
        missions.subscribe_incoming_mission(lambda *_: None)  # or it answers nobody
        with open_link(LinkRequest(address=address), purpose=Purpose.UPLOAD) as link:
            yield component, link
        for server in (missions, parameters):
            server.destroy()


def test_every_parameter_of_mavsdk_is_read(met: tuple[Any, VehicleLink]) -> None:
    _, link = met
    fetched = {one.name: one.number(is_bytewise=True) for one in link.fetch_parameters()}
    assert fetched == {**WHOLE, **{name: pytest.approx(value) for name, value in REAL.items()}}


def test_a_mission_that_mavsdk_took_is_the_one_that_was_sent(met: tuple[Any, VehicleLink]) -> None:
    _, link = met
    for items in (waypoints(7), waypoints(3)):
        assert link.upload_items(MissionKind.MISSION, items)[0] is UploadOutcome.ACCEPTED
        assert link.fetch_items(MissionKind.MISSION) == items


def test_what_mavsdk_tells_of_its_state_is_understood(met: tuple[Any, VehicleLink]) -> None:
    component, link = met
    server = TelemetryServer(component)
    here = Position(47.0, 8.5, 488.25, 12.5)
    server.publish_home(Position(46.9, 8.4, 480.0, 0.0))
    server.publish_position(here, VelocityNed(0.0, 0.0, 0.0), Heading(90.0))
    server.publish_battery(Battery(voltage_v=15.2, remaining_percent=0.5))
    server.publish_sys_status(Battery(voltage_v=15.2, remaining_percent=0.5), *[True] * 5)
    server.publish_extended_sys_state(VtolState.UNDEFINED, LandedState.IN_AIR)
    server.publish_status_text(StatusText(StatusTextType.CRITICAL, "Mission rejected: so it is"))
    said = link.listen(1.0)
    state = link.connection.telemetry.state()
    server.destroy()
    assert [(one.severity, one.text) for one in said] == [(2, "Mission rejected: so it is")]
    assert state.home is not None
    # Its height is left out: MAVSDK 4.1 sends metres times 0.001 for millimetres.
    assert (state.home.latitude_deg, state.home.longitude_deg) == (46.9, 8.4)
    assert state.position is not None
    assert state.position.longitude_deg == pytest.approx(8.5, abs=1e-7)
    assert state.position.height_above_home_m == 12.5
    assert state.battery is not None
    assert state.battery.remaining_fraction == 0.5  # MAVSDK 4.1 takes a fraction here
    assert state.battery.voltage_v == pytest.approx(15.2, abs=1e-3)
    assert state.is_landed is False
