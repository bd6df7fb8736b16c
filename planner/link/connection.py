"""One line with one vehicle on it: messages in and out, heartbeats, and the transfers that run."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.codec import Codec, message
from planner.link.heartbeats import HeartbeatWatch
from planner.link.parameters import (
    Gate,
    Purpose,
)
from planner.link.telemetry import Telemetry

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable

    from planner.link.codec import (
        Message,
        Transfer,
    )
    from planner.link.exchange import LinkSettings
    from planner.link.heartbeats import Heard
    from planner.link.line import Line

OWN_SYSTEM, OWN_COMPONENT = 245, 190
"""A ground station of its own: 255 is usually the pilot's, whose absence ArduPilot acts upon."""
_HEARTBEAT_S = 1.0
_OTHERS_S = 1.2
"""Time in which every vehicle on a line has sent a heartbeat. [s]"""
_TYPE_GROUND_STATION, _NO_AUTOPILOT, _STATE_ACTIVE = 6, 8, 4
_TO_TRY = (
    "is the vehicle switched on, and is this the address that its telemetry goes to (PX4's simulator "
    "sends to udpin:0.0.0.0:14540 and 14550, ArduPilot's listens on tcp:127.0.0.1:5760, a radio is "
    "/dev/ttyUSB0:57600)?"
)


class Connection:
    """The messages of one vehicle, over a line.

    Parameters
    ----------
    line : Line
        Open; closed with the connection.
    name : str
        The normalised address, for messages.
    settings : LinkSettings
        How patient to be.
    purpose : Purpose
        What may be sent.
    system : int, optional
        System id of the vehicle; default the only one on the line.
    own_system : int
        System id of this program.
    """

    def __init__(
        self,
        line: Line,
        *,
        name: str,
        settings: LinkSettings,
        purpose: Purpose = Purpose.READ,
        system: int | None = None,
        own_system: int = OWN_SYSTEM,
    ) -> None:
        self._line = line
        self._settings = settings
        self.own_system = own_system
        self._encoder = Codec(own_system, OWN_COMPONENT)
        self._decoders: dict[Hashable, Codec] = {}
        self._next_heartbeat_s = line.now_s()
        self._watch = HeartbeatWatch(system)
        self._vehicle: Heard | None = None
        self._peer: Hashable | None = None
        self._bytes = self._messages = 0
        """That came."""
        self.name = name
        self.gate = Gate(purpose)
        self.telemetry = Telemetry()
        self.on_frame: Callable[[bytes], None] | None = None
        """Told every piece of bytes that came: MAVSDK reads along here."""
        self.on_message: Callable[[Message], None] | None = None
        """Told every message of anybody at once, within transfers too: a guard listens here."""
        self.on_turn: Callable[[], None] | None = None
        """Called whenever there was something, or nothing for `longest_wait_s`."""
        self.longest_wait_s = math.inf

    @property
    def vehicle(self) -> Heard:
        """The vehicle that was heard.

        Raises
        ------
        LinkError
            If none was heard yet.
        """
        if self._vehicle is None:
            msg = f"no vehicle was heard on {self.name}"
            raise LinkError(msg)
        return self._vehicle

    @property
    def now_s(self) -> float:
        """The time by the line's clock [s]."""
        return self._line.now_s()

    def close(self) -> None:
        """Close the line."""
        self._line.close()

    def wait_for_vehicle(self, on_wait: Callable[[], None] = lambda: None) -> Heard:
        """Return the vehicle on the line, once it was heard and no other one was.

        Parameters
        ----------
        on_wait : callable
            Told again and again that it is waited for.

        Raises
        ------
        LinkError
            If none is heard in time, or several are.
        """
        began_s = self.now_s
        until_s = began_s + self._settings.heartbeat_timeout_s
        while self._watch.last_heard_s is None:
            if self.now_s >= until_s:
                raise LinkError(self._unheard())
            self._turn(until_s)
            on_wait()
        self.listen(_OTHERS_S)
        self._vehicle = self._watch.chosen()
        return self.vehicle

    def _unheard(self) -> str:
        """Return what is to be said where no vehicle was heard in time."""
        said = f"no heartbeat in {self._settings.heartbeat_timeout_s:g} s on {self.name}"
        if self._watch.others:
            ids = ", ".join(map(str, sorted(self._watch.others)))
            return f"{said} of that system id: heard were {ids}; give one of them by --system-id"
        if self._bytes and not self._messages:
            return (
                f"{said}: {self._bytes} bytes came, but no MAVLink; is the speed of the line right "
                "(--baud, of telemetry radios 57600, of USB and companions often 115200 or 921600)?"
            )
        if self._messages:
            return f"{said}: only ground stations and other devices were heard; {_TO_TRY}"
        return f"{said}: {_TO_TRY}"

    def listen(self, duration_s: float) -> None:
        """Take what comes for a time."""
        until_s = self.now_s + duration_s
        while self.now_s < until_s:
            self._turn(until_s)

    def hears_vehicle(self, timeout_s: float) -> bool:
        """Return whether another heartbeat of the vehicle comes within a time [s]."""
        self.telemetry.forget("HEARTBEAT")
        return self.awaits_heartbeat(timeout_s)

    def awaits_heartbeat(self, timeout_s: float) -> bool:
        """Return whether a heartbeat is there that was not forgotten, or comes within a time [s]."""
        until_s = self.now_s + timeout_s
        while self.telemetry.latest("HEARTBEAT") is None and self.now_s < until_s:
            self._turn(until_s)
        return self.telemetry.latest("HEARTBEAT") is not None

    def run(self, transfer: Transfer, on_progress: Callable[[], None] = lambda: None) -> None:
        """Run a transfer to its end.

        Parameters
        ----------
        transfer : Transfer
            What is exchanged.
        on_progress : callable
            Told after each message of the vehicle, and about every second.

        Raises
        ------
        LinkError
            If the transfer stalls or the line breaks.
        """
        self._send_all(transfer.begin(self.now_s))
        while not transfer.is_done:
            for received in self._turn(transfer.deadline_s):
                if not transfer.is_done:
                    self._send_all(transfer.feed(received, self.now_s))
                    on_progress()
            on_progress()
            if not transfer.is_done and self.now_s >= transfer.deadline_s:
                self._send_all(transfer.expire(self.now_s))

    def send(self, sent: Message) -> None:
        """Send a message to the vehicle.

        Raises
        ------
        ValueError
            If it is none that may go out: a mistake in this program.
        """
        target = (
            (0, 0) if self._vehicle is None else (self._vehicle.system, self._vehicle.component)
        )
        frame = self._encoder.encode(sent, target=target)
        if not self.gate.lets_out(frame):
            msg = f"{sent.name} may not be sent on a line opened to {self.gate.purpose.value}"
            raise ValueError(msg)
        self._line.send(frame, self._peer)

    def send_frame(self, frame: bytes) -> bool:
        """Send a frame that MAVSDK made; return whether it went out."""
        if not self.gate.lets_out(frame):
            return False
        self._line.send(frame, self._peer)
        return True

    def _send_all(self, messages: tuple[Message, ...]) -> None:
        for one in messages:
            self.send(one)

    def _turn(self, until_s: float) -> list[Message]:
        """Wait until something comes or a time is reached; return the vehicle's messages to us."""
        now_s = self.now_s
        if now_s >= self._next_heartbeat_s:
            self._send_heartbeat()
            self._next_heartbeat_s = now_s + _HEARTBEAT_S
        ours: list[Message] = []
        wait_s = min(until_s, self._next_heartbeat_s) - now_s
        for peer, data in self._line.receive(min(wait_s, self.longest_wait_s)):
            if self.on_frame is not None:
                self.on_frame(data)
            if peer not in self._decoders:  # frames of two senders may be interleaved
                self._decoders[peer] = Codec(self.own_system, OWN_COMPONENT)
            self._bytes += len(data)
            for received in self._decoders[peer].decode(data):
                self._messages += 1
                self._watch.take(received, peer, self.now_s)
                if self._is_ours(received):
                    if received.name == "HEARTBEAT":
                        self._peer = peer
                    self.telemetry.take(received)
                    ours.append(received)
                if self.on_message is not None:
                    self.on_message(received)
        if self.on_turn is not None:
            self.on_turn()
        return ours

    def _is_ours(self, received: Message) -> bool:
        """Return whether a message is the vehicle's, and not meant for another ground station."""
        if self._vehicle is None:
            return False
        if (received.system, received.component) != (
            self._vehicle.system,
            self._vehicle.component,
        ):
            return False
        return received.fields.get("target_system", 0) in {0, self.own_system}

    def _send_heartbeat(self) -> None:
        self.send(
            message(
                "HEARTBEAT",
                type=_TYPE_GROUND_STATION,
                autopilot=_NO_AUTOPILOT,
                system_status=_STATE_ACTIVE,
                mavlink_version=3,
            )
        )
