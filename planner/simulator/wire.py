"""Simulated vehicles at the end of a line with faults: bytes in, bytes out, and no clock."""

from __future__ import annotations

import heapq
import select
import socket
import threading
import time
from contextlib import suppress
from itertools import count
from typing import TYPE_CHECKING

from planner.link.address import LinkKind
from planner.link.mission import MissionKind
from planner.link.wire import Codec, Decoders, open_line, opening_error
from planner.simulator.faults import ITEMS, Direction, LineFaults
from planner.simulator.vehicle import SimulatedVehicle
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from planner.link.address import LinkAddress
    from planner.link.signing import Signer
    from planner.link.wire import Message, VehicleLine
    from planner.simulator.setup import VehicleSetup
    from planner.simulator.vehicle import Predict


_TRANSFERS = ("MISSION_", "PARAM_", "LOG_", "FILE_TRANSFER_PROTOCOL")
_NO_TRANSFER = frozenset({"MISSION_CURRENT", "MISSION_ITEM_REACHED"})
_TWIN_NORTH_DEG = 0.001
"""The second vehicle is 111 m away."""


class PassedMessage(Value):
    """One message that was put on the line, whether it arrived or not."""

    is_to_vehicle: bool
    message: Message
    time_s: float


class SimulatedWire:
    """One vehicle, or two with one system id, at the end of a line with faults."""

    def __init__(
        self,
        vehicle: SimulatedVehicle,
        faults: LineFaults | None = None,
        *,
        predict: Predict = lambda _: None,
        signer: Signer | None = None,
    ) -> None:
        faults = faults or LineFaults()
        self.vehicle = vehicle
        self._vehicles = [vehicle]
        if vehicle.setup.misbehaviour.has_twin:
            self._vehicles.append(SimulatedVehicle(_twin(vehicle.setup), predict))
        self._faults = faults
        self._inwards = Direction(faults.to_vehicle, faults.seed)
        self._outwards = Direction(faults.from_vehicle, faults.seed + 1)
        self._encoders = [
            Codec(one.setup.system, one.setup.component, signer) for one in self._vehicles
        ]
        self._decoders = Decoders(0, 0, signer)
        self._order = count()
        self._coming: list[tuple[float, int, Message]] = []
        self._going: list[tuple[float, int, bytes]] = []
        self._transferred = 0
        self._silent_until_s: float | None = None
        self.on_message: Callable[[PassedMessage], None] | None = None
        """Receives every message that either side puts on the line."""

    @property
    def deadline_s(self) -> float:
        """When `due` has something to do. [s]"""
        deadlines = [one.deadline_s for one in self._vehicles]
        deadlines += [waiting[0][0] for waiting in (self._coming, self._going) if waiting]
        return min(deadlines)

    def receive(self, data: bytes, now_s: float, peer: Hashable = None) -> None:
        """Take bytes of a ground station; what comes of them is sent when it is `due`."""
        for received in self._decoders.decode(data, peer):
            self._note(received, now_s, is_to_vehicle=True)
            if self._is_silent(received, now_s):
                continue
            for arrival_s in self._inwards.arrivals_s(now_s):
                heapq.heappush(self._coming, (arrival_s, next(self._order), received))

    def due(self, now_s: float) -> list[bytes]:
        """Return the frames that arrive at the ground station by now."""
        while self._coming and self._coming[0][0] <= now_s:
            self._deliver(heapq.heappop(self._coming)[2], now_s)
        for index, vehicle in enumerate(self._vehicles):
            if vehicle.deadline_s <= now_s:
                for sent in vehicle.expire(now_s):
                    self._send(sent, index, now_s)
        arrived = []
        while self._going and self._going[0][0] <= now_s:
            arrived.append(heapq.heappop(self._going)[2])
        return arrived

    def _deliver(self, received: Message, now_s: float) -> None:
        """Give a message to everyone on the vehicle's end."""
        for index, vehicle in enumerate(self._vehicles):
            for sent in vehicle.feed(received, now_s):
                self._send(sent, index, now_s)

    def _send(self, sent: Message, index: int, now_s: float) -> None:
        self._note(sent, now_s, is_to_vehicle=False)
        frame = self._encoders[index].encode(sent)
        if self._is_silent(sent, now_s):
            return
        frame = self._outwards.damaged(frame, is_item=sent.name in ITEMS)
        for arrival_s in self._outwards.arrivals_s(now_s):
            heapq.heappush(self._going, (arrival_s, next(self._order), frame))

    def _note(self, passed: Message, now_s: float, *, is_to_vehicle: bool) -> None:
        if self.on_message is not None:
            self.on_message(
                PassedMessage(is_to_vehicle=is_to_vehicle, message=passed, time_s=now_s)
            )

    def _is_silent(self, passed: Message, now_s: float) -> bool:
        """Return whether nothing passes now, and count the messages of transfers until then."""
        if self._faults.silent_after is None:
            return False
        if self._silent_until_s is None:
            if is_transfer(passed):
                self._transferred += 1
            if self._transferred <= self._faults.silent_after:
                return False
            self._silent_until_s = now_s + self._faults.silence_s
        return now_s < self._silent_until_s


def is_transfer(passed: Message) -> bool:
    """Return whether a message belongs to a transfer, and is not sent at intervals."""
    return passed.name.startswith(_TRANSFERS) and passed.name not in _NO_TRANSFER


def _twin(setup: VehicleSetup) -> VehicleSetup:
    """Return another vehicle that was given the same system id, with a mission of its own."""
    home = replace(setup.home, latitude_deg=setup.home.latitude_deg + _TWIN_NORTH_DEG)
    missions = setup.lists[MissionKind.MISSION]
    return replace(
        setup,
        home=home,
        lists={**setup.lists, MissionKind.MISSION: missions[:-1]},
        uid=bytes(255 - byte for byte in setup.uid),
        misbehaviour=replace(setup.misbehaviour, has_twin=False),
    )


_CHUNK = 1 << 16
_MOST_PEERS = 16
_PATIENCE_S = 1.0
"""Who does not take what is sent in this time has gone. [s]"""


class TcpServerLine:
    """A port that any number of ground stations connect to; a `planner.link.wire.VehicleLine`."""

    def __init__(self, address: LinkAddress) -> None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self._listener = socket.create_server((address.host, address.port), family=family)
        self._streams: list[socket.socket] = []

    def now_s(self) -> float:
        """Return a time that only grows [s]."""
        return time.monotonic()

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, each with its sender."""
        ready, _, _ = select.select([self._listener, *self._streams], [], [], max(timeout_s, 0.0))
        found: list[tuple[Hashable, bytes]] = []
        for one in ready:
            if one is self._listener:
                self._accept()
                continue
            data = b""
            with suppress(OSError):
                data = one.recv(_CHUNK)
            if data:
                found.append((one, data))
            else:
                self._forget(one)
        return found

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - all hear it
        """Send a frame to everyone who is connected."""
        for one in list(self._streams):
            try:
                one.sendall(data)
            except OSError:
                self._forget(one)

    def close(self) -> None:
        """Close the port and hang up."""
        for one in (self._listener, *self._streams):
            one.close()
        self._streams.clear()

    def _accept(self) -> None:
        stream, _ = self._listener.accept()
        if len(self._streams) >= _MOST_PEERS:
            stream.close()
            return
        stream.settimeout(_PATIENCE_S)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._streams.append(stream)

    def _forget(self, stream: socket.socket) -> None:
        stream.close()
        self._streams.remove(stream)


_LONGEST_WAIT_S = 0.1
"""Until it is seen that somebody wants it to stop. [s]"""


class SimulationRunner:
    """Keeps a simulated vehicle speaking on its end of a line.

    `LinkError` where the line cannot be opened.
    """

    def __init__(self, wire: SimulatedWire, address: LinkAddress) -> None:
        self._wire = wire
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._line = _open(address)

    def __enter__(self) -> SimulationRunner:
        """Speak in a thread."""
        self._thread = threading.Thread(target=self.run, name="simulated vehicle", daemon=True)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        """Stop, and close the line."""
        self.close()

    def now_s(self) -> float:
        """Return the time by the clock of the line [s]."""
        return self._line.now_s()

    def run(self) -> None:
        """Speak until `close` is called, or the program is interrupted.

        `LinkError` where the line breaks, other than by ground stations that come and go.
        """
        while not self._stop.is_set():
            self._turn()

    def close(self) -> None:
        """Stop speaking and close the line; once is enough."""
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self._line.close()

    def _turn(self) -> None:
        now_s = self._line.now_s()
        for frame in self._wire.due(now_s):
            self._line.send(frame)
        wait_s = min(max(self._wire.deadline_s - now_s, 0.0), _LONGEST_WAIT_S)
        for peer, data in self._line.receive(wait_s):
            self._wire.receive(data, self._line.now_s(), peer)


def _open(address: LinkAddress) -> VehicleLine:
    if address.kind is not LinkKind.TCP_LISTEN:
        return open_line(address)
    try:
        return TcpServerLine(address)
    except OSError as error:
        raise opening_error(address, error) from error
