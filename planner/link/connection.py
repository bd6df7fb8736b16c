"""One line with one vehicle on it: messages in and out, heartbeats, and the transfers that run."""

from __future__ import annotations

import math
from enum import Enum
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.telemetry import Telemetry, VehicleIdentity
from planner.link.wire import Codec, Decoders, frame_content, message

if TYPE_CHECKING:
    from collections.abc import Callable, Hashable, Mapping

    from planner.link.signing import Signer
    from planner.link.transfers import LinkSettings, Transfer
    from planner.link.wire import Message, VehicleLine


_NO_AUTOPILOT = 8
"""MAV_AUTOPILOT_INVALID: cameras, gimbals, ground stations."""
_GROUND_STATION = 6
"""MAV_TYPE_GCS."""
_AUTOPILOT_COMPONENT = 1
_MOST_HEARD = 64
"""Vehicles remembered; a swarm's are named one by one."""


class TwoVehiclesError(LinkError):
    """Two senders answer to one system id: nothing that comes by it can be trusted."""


class HeartbeatWatch:
    """Every autopilot heard, each bound to the sender of its first heartbeat.

    A datagram names its sender's ids, and anybody can write them: what comes by the ids of a vehicle
    from anywhere else is of a second one, or of somebody who plays it.
    """

    def __init__(self, system: int | None = None) -> None:
        self._system = system
        self._heard: dict[tuple[int, int], VehicleIdentity] = {}
        self._peers: dict[tuple[int, int], Hashable] = {}
        self._uids: dict[int, str] = {}
        self.others: set[int] = set()
        """System ids of vehicles that are not the one to listen to."""
        self.last_heard_s: float | None = None
        """When the latest heartbeat of any of them came. [s]"""

    @property
    def systems(self) -> tuple[int, ...]:
        """The system ids heard, in their order."""
        return tuple(sorted({system for system, _ in self._heard}))

    def take(self, received: Message, peer: Hashable, now_s: float) -> None:
        """Take a message of any kind; `TwoVehiclesError` where two answer to one system id."""
        if self._system is not None and received.system != self._system:
            if _is_vehicle(received) and len(self.others) < _MOST_HEARD:
                self.others.add(received.system)
            return
        if received.name == "HEARTBEAT":
            self._take_heartbeat(received, peer, now_s)
        bound = self._peers.get((received.system, received.component), peer)
        if bound != peer:
            self._refuse(received.system, f"{_place(bound)} and {_place(peer)} send by it")
        if received.name == "AUTOPILOT_VERSION":
            uid = uid_text(received)
            known = self._uids.setdefault(received.system, uid)
            if uid and known and uid != known:
                self._refuse(received.system, f"autopilots {known} and {uid} answer")
            self._uids[received.system] = known or uid

    def chosen(self) -> VehicleIdentity | None:
        """Return the vehicle to speak to, ``None`` where none was heard; `LinkError` of several."""
        if len(self.systems) > 1:
            ids = ", ".join(map(str, self.systems))
            msg = f"several vehicles are on the line (system ids {ids}): name one with --system-id"
            raise LinkError(msg)
        if not self._heard:
            return None
        return min(
            self._heard.values(), key=lambda h: (h.component != _AUTOPILOT_COMPONENT, h.component)
        )

    def _take_heartbeat(self, received: Message, peer: Hashable, now_s: float) -> None:
        if not _is_vehicle(received):
            return
        self.last_heard_s = now_s
        key = (received.system, received.component)
        one = VehicleIdentity(
            system=received.system,
            component=received.component,
            autopilot_number=received["autopilot"],
            vehicle_type=received["type"],
        )
        if key not in self._heard and len(self._heard) >= _MOST_HEARD:
            return
        known = self._heard.setdefault(key, one)
        if known != one:
            self._refuse(
                received.system,
                f"MAV_AUTOPILOT {known.autopilot_number} of MAV_TYPE {known.vehicle_type} and "
                f"MAV_AUTOPILOT {one.autopilot_number} of MAV_TYPE {one.vehicle_type} answer",
            )
        for other in self._heard.values():
            if other.system == one.system and other.component != one.component:
                self._refuse(
                    one.system,
                    f"autopilots are heard as component {other.component} and {one.component}",
                )
        self._peers.setdefault(key, peer)

    def _refuse(self, system: int, why: str) -> None:
        msg = (
            f"two vehicles answer to system id {system}: {why}; give each an id of its own "
            "(MAV_SYS_ID, SYSID_THISMAV), or leave one of them off the line; one that came back from "
            "another port is met by calling again"
        )
        raise TwoVehiclesError(msg)

    def peer_of(self, vehicle: VehicleIdentity) -> Hashable:
        """Return the sender that a vehicle is bound to."""
        return self._peers[vehicle.system, vehicle.component]


def _place(peer: Hashable) -> str:
    """Return ``192.168.1.7:14550`` of a socket's address."""
    match peer:
        case (host, port, *_):
            return f"{host}:{port}"
    return str(peer)


def _is_vehicle(received: Message) -> bool:
    return (
        received.name == "HEARTBEAT"
        and received.system != 0
        and received["autopilot"] != _NO_AUTOPILOT
        and received["type"] != _GROUND_STATION
    )


def uid_text(version: Message) -> str:
    """Return the autopilot's own number of an AUTOPILOT_VERSION; empty where it sends none."""
    uid2 = bytes(version.fields.get("uid2") or ())
    if any(uid2):
        return uid2.hex().rstrip("0")
    return f"{version['uid']:x}" if version["uid"] else ""


class Purpose(Enum):
    """What a line to a vehicle is opened for."""

    READ = "read"
    UPLOAD = "upload"
    """Mission, fence and rally points are replaced."""
    GUARD = "guard"
    """Arming is authorised or not, the verdict is announced."""


_HEARTBEAT = 0
_COMMAND_LONG = 76
_FILE_TRANSFER = 110

_READING: Mapping[int, str] = {
    _HEARTBEAT: "HEARTBEAT",
    4: "PING",
    20: "PARAM_REQUEST_READ",
    21: "PARAM_REQUEST_LIST",
    43: "MISSION_REQUEST_LIST",
    47: "MISSION_ACK",
    51: "MISSION_REQUEST_INT",
    _COMMAND_LONG: "COMMAND_LONG",
    _FILE_TRANSFER: "FILE_TRANSFER_PROTOCOL",
    111: "TIMESYNC",
    117: "LOG_REQUEST_LIST",
    119: "LOG_REQUEST_DATA",
    122: "LOG_REQUEST_END",
    412: "REQUEST_EVENT",
}
_UPLOADING: Mapping[int, str] = {44: "MISSION_COUNT", 73: "MISSION_ITEM_INT"}
_GUARDING: Mapping[int, str] = {77: "COMMAND_ACK", 253: "STATUSTEXT"}

MESSAGES: Mapping[Purpose, Mapping[int, str]] = {
    Purpose.READ: _READING,
    Purpose.UPLOAD: {**_READING, **_UPLOADING},
    Purpose.GUARD: {**_READING, **_GUARDING},
}
"""By purpose, the numbers and names of the messages that may go out."""
COMMANDS: Mapping[int, str] = {
    410: "GET_HOME_POSITION",
    511: "SET_MESSAGE_INTERVAL",
    512: "REQUEST_MESSAGE",
    519: "REQUEST_PROTOCOL_VERSION",
    520: "REQUEST_AUTOPILOT_CAPABILITIES",
}
"""The commands that a COMMAND_LONG may hold: each asks for a message and does nothing else."""
FILE_OPERATIONS: Mapping[int, str] = {
    0: "None",
    1: "TerminateSession",
    2: "ResetSessions",
    3: "ListDirectory",
    4: "OpenFileRO",
    5: "ReadFile",
    14: "CalcFileCRC32",
    15: "BurstReadFile",
}
"""The operations of the file protocol that may go out: none of them writes."""

_COMMAND_AT = 28
"""Offset of the command in the content of a COMMAND_LONG."""
_OPERATION_AT = 6
"""Offset of the operation in the content of a FILE_TRANSFER_PROTOCOL."""


class Gate:
    """Lets frames out, or not."""

    def __init__(self, purpose: Purpose) -> None:
        self.purpose = purpose

    def lets_out(self, frame: bytes) -> bool:
        """Return whether a whole MAVLink frame of either version may go out."""
        if len(frame) >= 12 and frame[0] == 0xFD and len(frame) >= 12 + frame[1]:
            number = int.from_bytes(frame[7:10], "little")
        elif len(frame) >= 8 and frame[0] == 0xFE and len(frame) >= 8 + frame[1]:
            number = frame[5]
        else:
            return False
        content = frame_content(frame)
        if number == _COMMAND_LONG:
            command = int.from_bytes(content[_COMMAND_AT : _COMMAND_AT + 2], "little")
            return command in COMMANDS
        if number == _FILE_TRANSFER:
            operation = int.from_bytes(content[_OPERATION_AT : _OPERATION_AT + 1], "little")
            return operation in FILE_OPERATIONS
        return number in MESSAGES[self.purpose]


_RECEIVED = frozenset(
    {
        *("HEARTBEAT", "AUTOPILOT_VERSION", "COMMAND_ACK", "COMMAND_LONG", "STATUSTEXT"),
        *("SYS_STATUS", "BATTERY_STATUS", "EXTENDED_SYS_STATE", "HOME_POSITION", "TIMESYNC"),
        *("GLOBAL_POSITION_INT", "WIND", "WIND_COV", "EVENT", "CURRENT_EVENT_SEQUENCE"),
        "RESPONSE_EVENT_ERROR",
        *("TERRAIN_REPORT", "MISSION_COUNT", "MISSION_ITEM_INT", "MISSION_ACK", "MISSION_REQUEST"),
        *("MISSION_REQUEST_INT", "MISSION_CLEAR_ALL", "MISSION_WRITE_PARTIAL_LIST"),
        *("MISSION_CURRENT", "PARAM_VALUE", "PARAM_SET"),
        *("FILE_TRANSFER_PROTOCOL", "LOG_ENTRY", "LOG_DATA"),
    }
)
"""What is looked at; of all that vehicles send, most is something else."""
OWN_SYSTEM, OWN_COMPONENT = 245, 190
"""A ground station of its own: 255 is usually the pilot's, whose absence ArduPilot acts upon."""
_HEARTBEAT_S = 1.0
_OTHERS_S = 1.2
"""Time in which every vehicle on a line has sent a heartbeat. [s]"""
_STATE_ACTIVE = 4
"""MAV_STATE."""
_TO_TRY = (
    "is the vehicle switched on, and is this the address that its telemetry goes to (PX4's simulator "
    "sends to udpin:0.0.0.0:14540 and 14550, ArduPilot's listens on tcp:127.0.0.1:5760, a radio is "
    "/dev/ttyUSB0:57600)?"
)


class Connection:
    """The messages of one vehicle, over an open line, which is closed with it."""

    def __init__(
        self,
        line: VehicleLine,
        *,
        name: str,
        settings: LinkSettings,
        purpose: Purpose = Purpose.READ,
        system: int | None = None,
        own_system: int = OWN_SYSTEM,
        signer: Signer | None = None,
    ) -> None:
        self._line = line
        self._signer = signer
        self._settings = settings
        self.own_system = own_system
        self._encoder = Codec(own_system, OWN_COMPONENT, signer)
        self._decoders = Decoders(own_system, OWN_COMPONENT, signer, used=_RECEIVED)
        self._next_heartbeat_s = line.now_s()
        self._watch = HeartbeatWatch(system)
        self._vehicle: VehicleIdentity | None = None
        self._peer: Hashable | None = None
        self._bytes = self._messages = 0
        """That came."""
        self.name = name
        self.gate = Gate(purpose)
        self.telemetry = Telemetry()
        self.on_frame: Callable[[bytes], None] | None = None
        """Receives every piece of bytes that came: MAVSDK reads along here."""
        self.on_message: Callable[[Message], None] | None = None
        """Receives every message of anybody at once, within transfers too: a guard listens here."""
        self.on_turn: Callable[[], None] | None = None
        """Called whenever there was something, or nothing for `longest_wait_s`."""
        self.longest_wait_s = math.inf
        self.is_restoring = False
        """Whether a vehicle gets back what it had: what others send then counts for nothing."""

    @property
    def vehicle(self) -> VehicleIdentity:
        """The vehicle that was heard; `LinkError` before."""
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
        if self._signer is not None:
            self._signer.close()

    def wait_for_vehicle(self, on_wait: Callable[[], None] = lambda: None) -> VehicleIdentity:
        """Return the vehicle on the line, once it was heard and no other one was.

        `LinkError` where none is heard in time, or several are.
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
        self._peer = self._watch.peer_of(self.vehicle)
        return self.vehicle

    def _unheard(self) -> str:
        missing = f"no heartbeat in {self._settings.heartbeat_timeout_s:g} s on {self.name}"
        if self._watch.others:
            ids = ", ".join(map(str, sorted(self._watch.others)))
            return (
                f"{missing} of that system id: heard were {ids}; name one of them with --system-id"
            )
        if refused := self._decoders.refused:
            return (
                f"{missing} that is signed by the key: {refused} other messages were refused; does the "
                "vehicle have this key (--signing-key), and is the clock of this computer right?"
            )
        heard = self._messages + self._decoders.skipped
        if self._bytes and not heard:
            return (
                f"{missing}: {self._bytes} bytes came, but no MAVLink; is the speed of the line right "
                "(--baud, of telemetry radios 57600, of USB and companions often 115200 or 921600)?"
            )
        if heard:
            return f"{missing}: only ground stations and other devices were heard; {_TO_TRY}"
        return f"{missing}: {_TO_TRY}"

    def listen(self, duration_s: float) -> None:
        """Take what comes for a time."""
        until_s = self.now_s + duration_s
        while self.now_s < until_s:
            self._turn(until_s)

    def hears_vehicle(self, timeout_s: float) -> bool:
        """Return whether another heartbeat of the vehicle comes within a time [s]."""
        self.telemetry.forget("HEARTBEAT")
        return self.awaited("HEARTBEAT", timeout_s) is not None

    def awaited(self, name: str, timeout_s: float) -> Message | None:
        """Return the latest message of a name, one that comes within a time [s] where none was kept."""
        until_s = self.now_s + timeout_s
        while self.telemetry.latest(name) is None and self.now_s < until_s:
            self._turn(until_s)
        return self.telemetry.latest(name)

    def run(self, transfer: Transfer, on_progress: Callable[[], None] = lambda: None) -> None:
        """Run a transfer to its end: `LinkError` where it stalls or the line breaks.

        Progress is reported after each message of the vehicle, and about every second.
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
        """Send a message to the vehicle; `ValueError` of one that may not go out, a mistake here."""
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
            if peer == self._peer or not self.is_restoring:
                ours += self._take(data, peer)
        if self.on_turn is not None:
            self.on_turn()
        return ours

    def _take(self, data: bytes, peer: Hashable) -> list[Message]:
        """Take bytes of a sender; return the vehicle's messages to us."""
        self._bytes += len(data)
        ours: list[Message] = []
        for received in self._decoders.decode(data, peer):
            self._messages += 1
            self._watch.take(received, peer, self.now_s)
            if self._is_elsewhere(received, peer):
                continue
            if self._is_ours(received):
                self.telemetry.take(received)
                ours.append(received)
            if self.on_message is not None:
                self.on_message(received)
        if self.on_frame is not None and peer == self._peer:
            self.on_frame(data)
        return ours

    def _is_elsewhere(self, received: Message, peer: Hashable) -> bool:
        """Return whether a message has our vehicle's system id and came from another sender.

        Its autopilot's are refused before; a companion's may come so, and are nothing that counts.
        """
        if self._vehicle is None or peer == self._peer:
            return False
        return received.system == self._vehicle.system

    def _is_ours(self, received: Message) -> bool:
        """Return whether a message is the vehicle's, and not meant for another ground station."""
        if self._vehicle is None:
            return False
        if (received.system, received.component) != (self._vehicle.system, self._vehicle.component):
            return False
        return received.fields.get("target_system", 0) in {0, self.own_system}

    def _send_heartbeat(self) -> None:
        self.send(
            message(
                "HEARTBEAT",
                type=_GROUND_STATION,
                autopilot=_NO_AUTOPILOT,
                system_status=_STATE_ACTIVE,
                mavlink_version=3,
            )
        )
