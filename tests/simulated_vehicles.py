"""Simulated vehicles to test on: at a bench without a line, and in memory with one."""

from __future__ import annotations

import socket
from collections import deque
from functools import cache
from typing import TYPE_CHECKING, Any

from fenced_missions import box, rally
from made_missions import mission, rtl, takeoff, waypoint

from planner.autopilot import Autopilot
from planner.geo.fence import Fence
from planner.link.wire import Message
from planner.physics.wind import Wind
from planner.service.simulation import (
    SimulationRequest,
    make_simulated_vehicle,
    make_simulated_wire,
    predict_flown,
)
from planner.setup import Setup
from planner.simulator.faults import Faults, read_faults
from planner.simulator.vehicle import SimulatedVehicle
from planner.values import replace
from planner.vehicle.battery import Battery
from planner.vehicle.library import load_vehicle

if TYPE_CHECKING:
    from collections.abc import Hashable, Mapping

    from planner.mission.items import Mission
    from planner.simulator.flown import FlownMission
    from planner.simulator.setup import VehicleSetup
    from planner.simulator.wire import SimulatedWire

GROUND_STATION = 245
BATTERY = Battery(capacity_ah=8.0, nominal_voltage_v=22.2)
"""177.6 Wh."""
WIND = Wind(speed_m_s=4.0, from_deg=270.0)


def out_and_back() -> Mission:
    """Return a flight of 2 km at 40 m, with a fence around it and a rally point."""
    flown = mission(takeoff(40.0), waypoint(500.0, 40.0), waypoint(1000.0, 40.0, hold_s=2.0), rtl())
    fence = Fence(polygons=(box(-500.0, -500.0, 500.0, 1500.0),))
    return replace(flown, fence=fence, rally=(rally(10.0, 20.0),))


def request(autopilot: Autopilot, faults: str = "", **changes: Any) -> SimulationRequest:  # noqa: ANN401 - as it comes
    """Return what a simulated quadrotor with a battery and wind is asked for with."""
    setup = Setup(load_vehicle("arducopter-sitl-quad"), battery=BATTERY, wind=WIND)
    return SimulationRequest(
        autopilot=autopilot, setup=setup, faults=read_faults(faults), **changes
    )


@cache
def _setup(asked: SimulationRequest) -> VehicleSetup:
    return make_simulated_vehicle(out_and_back(), asked).setup


@cache
def predicted(held: Mission, asked: SimulationRequest) -> FlownMission | None:
    """Return the flight of what a vehicle holds; the same mission is predicted once."""
    return predict_flown(held, asked)


def _of_flights(asked: SimulationRequest) -> SimulationRequest:
    """Return what flights are predicted by: neither the line nor the clock nor what is wrong with it."""
    return SimulationRequest(autopilot=asked.autopilot, setup=asked.setup)


def vehicle(
    autopilot: Autopilot,
    faults: str = "",
    given: Mapping[str, float] | None = None,
    **changes: Any,  # noqa: ANN401 - as it comes
) -> SimulatedVehicle:
    """Return a simulated vehicle with `out_and_back` on it, and some parameters of its own."""
    asked = request(autopilot, faults, **changes)
    setup = _setup(replace(asked, faults=Faults(), speed_up=1.0))
    own = tuple(
        replace(one, value=(given or {}).get(one.name, one.value)) for one in setup.parameters
    )
    return SimulatedVehicle(
        replace(setup, parameters=own, misbehaviour=asked.faults.vehicle),
        lambda held: predicted(held, _of_flights(asked)),
        speed_up=asked.speed_up,
    )


def wire(
    autopilot: Autopilot,
    faults: str = "",
    given: Mapping[str, float] | None = None,
    **changes: Any,  # noqa: ANN401 - as it comes
) -> SimulatedWire:
    """Return one behind a line."""
    asked = request(autopilot, faults, **changes)
    return make_simulated_wire(vehicle(autopilot, faults, given, **changes), asked)


_PEER = "simulated"


class MemoryLine:
    """The ground station's end of a line to a simulated vehicle; a `planner.link.wire.Line`.

    Parameters
    ----------
    wire : SimulatedWire
        The other end.
    """

    def __init__(self, wire: SimulatedWire) -> None:
        self._wire = wire
        self._now_s = 0.0
        self._arrived: deque[bytes] = deque()
        self.is_closed = False

    def now_s(self) -> float:
        """Return the time, which only `receive` moves [s]."""
        return self._now_s

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return the frames that come first, or none; the time is then when they came."""
        until_s = self._now_s + max(timeout_s, 0.0)
        while True:
            self._arrived += self._wire.due(self._now_s)
            if self._arrived:
                found: list[tuple[Hashable, bytes]] = [(_PEER, one) for one in self._arrived]
                self._arrived.clear()
                return found
            deadline_s = self._wire.deadline_s
            if deadline_s > until_s:
                self._now_s = until_s
                return []
            self._now_s = max(self._now_s, deadline_s)

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one vehicle
        """Put bytes on the line."""
        self._wire.receive(data, self._now_s, _PEER)

    def close(self) -> None:
        """Note that nobody listens any more."""
        self.is_closed = True


def memory_line(autopilot: Autopilot, faults: str = "", **changes: Any) -> MemoryLine:  # noqa: ANN401 - as it comes
    """Return a ground station's end of a line to one."""
    return MemoryLine(wire(autopilot, faults, **changes))


class Bench:
    """A vehicle without a line: what is sent to it, and what it answers, at any time."""

    def __init__(self, autopilot: Autopilot, faults: str = "", **changes: Any) -> None:  # noqa: ANN401 - as it comes
        self.vehicle = vehicle(autopilot, faults, **changes)
        self.now_s = 0.0
        self.vehicle.expire(self.now_s)
        self.send("HEARTBEAT")  # after which it has introduced itself
        if autopilot is Autopilot.ARDUPILOT:  # which sends nothing unless it is asked to
            self.send("REQUEST_DATA_STREAM", req_message_rate=4, start_stop=1)

    def send(self, name: str, sender: int = GROUND_STATION, **fields: Any) -> list[Message]:  # noqa: ANN401 - as it comes
        """Send a message to it, and return its answers."""
        received = Message(
            name=name,
            fields={"target_system": 1, "target_component": 1, **fields},
            system=sender,
            component=190,
        )
        return list(self.vehicle.feed(received, self.now_s))

    def wait(self, duration_s: float) -> list[Message]:
        """Let time pass, and return what it says meanwhile."""
        until_s = self.now_s + duration_s
        said: list[Message] = []
        while self.vehicle.deadline_s <= until_s:
            self.now_s = max(self.now_s, self.vehicle.deadline_s)
            said += self.vehicle.expire(self.now_s)
        self.now_s = until_s
        return said

    def wait_for(self, name: str, duration_s: float = 10.0) -> list[Message]:
        """Return the messages of a name that it sends in a time."""
        return named(name, self.wait(duration_s))


def named(name: str, messages: list[Message]) -> list[Message]:
    """Return those of a name."""
    return [one for one in messages if one.name == name]


def texts(messages: list[Message]) -> list[str]:
    """Return what is said as STATUSTEXT."""
    return [one["text"] for one in named("STATUSTEXT", messages)]


def free_port(kind: socket.SocketKind) -> int:
    """Return a port that nobody has at this moment."""
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])
