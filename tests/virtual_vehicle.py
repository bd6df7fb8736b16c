"""A small autopilot at the end of a line that loses, repeats and reorders, all in virtual time.

It knows what the client has to cope with: PX4's order of requests and its forgetting, ArduPilot's
home slot, its repeated questions and its items that are replaced one by one.
"""

from __future__ import annotations

import heapq
import math
import random
import struct
from dataclasses import dataclass, field
from itertools import count
from typing import Any

from planner.link.mission import ITEM_FIELDS, MissionKind, MissionResult, WireItem
from planner.link.wire import Codec, Message, message

PX4, ARDUPILOT = 12, 3
_DELAY_S = 0.01


def wire_item(**changes: float) -> WireItem:
    fields: dict[str, Any] = {
        "frame": 3,
        "command": 16,
        "x": 470_000_000,
        "y": 80_000_000,
        "z": 30.0,
        **{f"param{n}": 0.0 for n in (1, 2, 3, 4)},
    }
    return WireItem(**(fields | changes))


def waypoints(number: int) -> tuple[WireItem, ...]:
    return tuple(wire_item(x=470_000_000 + 1000 * n, z=20.0 + n) for n in range(number))


@dataclass
class VirtualVehicle:
    """What answers; its fields are what a test looks at."""

    autopilot: int = PX4
    heading_cdeg: int = 9000
    lists: dict[MissionKind, tuple[WireItem, ...]] = field(
        default_factory=lambda: dict.fromkeys(MissionKind, ())
    )
    parameters: dict[str, tuple[float, int]] = field(default_factory=dict)
    """Value and MAV_PARAM_TYPE by name."""
    system: int = 1
    component: int = 1
    uid: int = 0xABCDEF
    battery_remaining: int = 80
    voltage_mv: int = 15_200
    is_armed: bool = False
    landed_state: int = 1
    """MAV_LANDED_STATE: 1 on the ground, 2 in the air."""
    home: tuple[int, int, int] | None = (470_000_000, 80_000_000, 488_000)
    place: tuple[int, int, int] = (470_000_000, 80_000_000, 488_100)
    unsupported: frozenset[MissionKind] = frozenset()
    refused_command: int | None = None
    """An item with it is refused."""
    rejection_text: str = ""
    """Said in a STATUSTEXT after a mission came."""
    received: list[Message] = field(default_factory=list)
    incoming: list[WireItem] | None = None
    incoming_kind: MissionKind = MissionKind.MISSION
    incoming_count: int = 0
    asked_s: float = 0.0
    taken_s: float = 0.0
    sending: tuple[MissionKind, int, float] | None = None
    """PX4: the list being read, the next item, and when it last heard of it."""
    heartbeat_s: float = 0.0

    def tick(self, now_s: float) -> list[Message]:
        """Return what it says by itself."""
        said: list[Message] = []
        if now_s >= self.heartbeat_s:
            self.heartbeat_s = now_s + 1.0
            beat = message(
                "HEARTBEAT",
                type=2,
                autopilot=self.autopilot,
                base_mode=128 if self.is_armed else 0,
                system_status=3,
                mavlink_version=3,
            )
            said.append(beat)
        if self.incoming is not None and now_s - self.taken_s > 8.0:
            self.incoming = None
        if self.incoming is not None and now_s - self.asked_s > 1.0:
            said.append(self._question(now_s))
        return said

    def take(self, one: Message, now_s: float) -> list[Message]:
        """Return its answers."""
        if one.name != "HEARTBEAT":
            self.received.append(one)
        handler = getattr(self, f"_on_{one.name.lower()}", None)
        return [] if handler is None else handler(one, now_s)

    def _on_command_long(self, one: Message, _: float) -> list[Message]:
        wanted = self._answers().get(int(one["param1"]))
        result = 0 if wanted is not None else 3
        ack = message("COMMAND_ACK", command=one["command"], result=result)
        return [ack, wanted] if wanted is not None else [ack]

    def _answers(self) -> dict[int, Message]:
        answers = {
            148: message(
                "AUTOPILOT_VERSION",
                flight_sw_version=(1 << 24 | 16 << 16 | 2 << 8 | 255),
                capabilities=16 if self.autopilot == PX4 else 1 << 17,
                uid=self.uid,
                flight_custom_version=bytes(8),
                middleware_custom_version=bytes(8),
                os_custom_version=bytes(8),
                uid2=bytes(18),
            ),
            1: message(
                "SYS_STATUS",
                battery_remaining=self.battery_remaining,
                voltage_battery=self.voltage_mv,
                current_battery=120,
            ),
            147: message(
                "BATTERY_STATUS",
                battery_remaining=self.battery_remaining,
                voltages=[self.voltage_mv, *[65_535] * 9],
                voltages_ext=[0] * 4,
                temperature=2150,
                current_battery=-1,
                current_consumed=-1,
            ),
            33: message(
                "GLOBAL_POSITION_INT",
                lat=self.place[0],
                lon=self.place[1],
                alt=self.place[2],
                relative_alt=100,
                hdg=self.heading_cdeg,
            ),
            245: message("EXTENDED_SYS_STATE", landed_state=self.landed_state),
        }
        if self.home is not None:
            latitude, longitude, altitude = self.home
            answers[242] = message(
                "HOME_POSITION",
                latitude=latitude,
                longitude=longitude,
                altitude=altitude,
                q=[math.nan] * 4,
            )
        return answers

    def _on_mission_request_list(self, one: Message, now_s: float) -> list[Message]:
        kind = MissionKind(one["mission_type"])
        if kind in self.unsupported:
            return [self._ack(kind, MissionResult.UNSUPPORTED)]
        self.sending = (kind, 0, now_s)
        return [message("MISSION_COUNT", count=len(self.lists[kind]), mission_type=int(kind))]

    def _on_mission_request_int(self, one: Message, now_s: float) -> list[Message]:
        kind, seq = MissionKind(one["mission_type"]), one["seq"]
        if seq >= len(self.lists[kind]):
            return [self._ack(kind, MissionResult.INVALID_SEQUENCE)]
        if self.autopilot == PX4:
            if self.sending is None or self.sending[0] != kind or now_s - self.sending[2] > 5.0:
                return []
            expected = self.sending[1]
            if seq not in {expected, expected - 1}:
                self.sending = None
                return [self._ack(kind, MissionResult.ERROR)]
            self.sending = (kind, seq + 1, now_s)
        item = self.lists[kind][seq]
        fields = {name: getattr(item, name) for name in ITEM_FIELDS}
        return [message("MISSION_ITEM_INT", seq=seq, mission_type=int(kind), **fields)]

    def _on_mission_count(self, one: Message, now_s: float) -> list[Message]:
        kind = MissionKind(one["mission_type"])
        if kind in self.unsupported:
            return [self._ack(kind, MissionResult.UNSUPPORTED)]
        if one["count"] == 0:
            self.lists[kind] = ()
            self.incoming = None
            return [self._ack(kind, MissionResult.ACCEPTED)]
        self.incoming, self.incoming_kind, self.incoming_count = [], kind, one["count"]
        self.taken_s = now_s
        if self.autopilot == ARDUPILOT:
            self.lists[kind] = self.lists[kind][: one["count"]]
        return [self._question(now_s)]

    def _on_mission_item_int(self, one: Message, now_s: float) -> list[Message]:
        kind = MissionKind(one["mission_type"])
        if self.incoming is None or kind is not self.incoming_kind:
            is_last = self.autopilot == PX4 and one["seq"] + 1 == len(self.lists[kind])
            result = MissionResult.ACCEPTED if is_last else MissionResult.ERROR
            return [self._ack(kind, result)]
        if one["seq"] != len(self.incoming):
            if self.autopilot == ARDUPILOT:
                return [self._ack(kind, MissionResult.INVALID_SEQUENCE)]
            return []
        if one["command"] == self.refused_command:
            self.incoming = None
            return [self._ack(kind, MissionResult.UNSUPPORTED)]
        self.incoming.append(WireItem(**{name: one[name] for name in ITEM_FIELDS}))
        self.taken_s = now_s
        if self.autopilot == ARDUPILOT:
            done = len(self.incoming)
            self.lists[kind] = (*self.incoming, *self.lists[kind][done:])
        if len(self.incoming) < self.incoming_count:
            return [self._question(now_s)]
        self.lists[kind] = tuple(self.incoming)
        self.incoming = None
        said = [self._ack(kind, MissionResult.ACCEPTED)]
        if self.rejection_text and kind is MissionKind.MISSION:
            said.append(message("STATUSTEXT", severity=2, text=self.rejection_text))
        return said

    def _question(self, now_s: float) -> Message:
        assert self.incoming is not None
        self.asked_s = now_s
        name = "MISSION_REQUEST" if self.autopilot == ARDUPILOT else "MISSION_REQUEST_INT"
        return message(name, seq=len(self.incoming), mission_type=int(self.incoming_kind))

    def _ack(self, kind: MissionKind, result: MissionResult) -> Message:
        return message("MISSION_ACK", type=int(result), mission_type=int(kind))

    def _on_param_request_list(self, _: Message, __: float) -> list[Message]:
        return [self._parameter(index) for index in range(len(self.parameters))]

    def _on_param_request_read(self, one: Message, _: float) -> list[Message]:
        known = 0 <= one["param_index"] < len(self.parameters)
        return [self._parameter(one["param_index"])] if known else []

    def _parameter(self, index: int) -> Message:
        name, (value, kind) = list(self.parameters.items())[index]
        if self.autopilot == PX4 and kind == 6:
            (value,) = struct.unpack("<f", struct.pack("<i", int(value)))
        return message(
            "PARAM_VALUE",
            param_id=name,
            param_value=value,
            param_type=kind,
            param_count=len(self.parameters),
            param_index=index,
        )


class VirtualLine:
    """A line in virtual time; what is lost, repeated and late is drawn from a seed."""

    def __init__(
        self,
        *vehicles: VirtualVehicle,
        loss: float = 0.0,
        repeated: float = 0.0,
        late: float = 0.0,
        seed: int = 1,
        cut_after: int | None = None,
        cut_s: float = math.inf,
    ) -> None:
        self.time_s = 0.0
        self.vehicles = vehicles
        self.sent: list[bytes] = []
        self.exchanged = 0
        """Messages in both directions, heartbeats not counted."""
        self.is_closed = False
        self._chances = (loss, repeated, late)
        self._random = random.Random(seed)
        self._cut_after = cut_after
        self._cut_s = cut_s
        self._cut_until_s: float | None = None
        self._codecs = [Codec(v.system, v.component) for v in vehicles]
        self._ears = [Codec(0, 0) for _ in vehicles]
        self._events: list[tuple[float, int, int | None, Any]] = []
        self._number = count()
        self._tick_s = 0.0

    def now_s(self) -> float:
        return self.time_s

    def close(self) -> None:
        self.is_closed = True

    def send(self, data: bytes, peer: object = None) -> None:
        self.sent.append(data)
        for index in range(len(self.vehicles)):
            if peer is None or peer == index:
                self._carry(index, data, is_heartbeat=data[7:10] == b"\0\0\0")

    def receive(self, timeout_s: float) -> list[tuple[Any, bytes]]:
        until_s = self.time_s + max(timeout_s, 0.0)
        if not self._tick_s:  # a vehicle may have been on another line before
            for vehicle in self.vehicles:
                vehicle.heartbeat_s = 0.0
        while True:
            next_s = min(self._events[0][0] if self._events else math.inf, self._tick_s)
            if next_s > until_s:
                self.time_s = until_s
                return []
            self.time_s = max(self.time_s, next_s)
            if self._tick_s <= self.time_s:
                self._tick_s = self.time_s + 0.1
                for number, vehicle in enumerate(self.vehicles):
                    self._say(number, vehicle.tick(self.time_s))
            while self._events and self._events[0][0] <= self.time_s:
                _, _, index, data = heapq.heappop(self._events)
                if index is None:
                    return [data]
                for one in self._ears[index].decode(data):
                    self._say(index, self.vehicles[index].take(one, self.time_s))

    def _say(self, index: int, messages: list[Message]) -> None:
        for one in messages:
            data = self._codecs[index].encode(one, target=(245, 190))
            self._carry(None, (index, data), is_heartbeat=one.name == "HEARTBEAT")

    def _carry(self, index: int | None, data: object, *, is_heartbeat: bool) -> None:
        if not is_heartbeat:
            self.exchanged += 1
        if self._cut_after is not None and self.exchanged > self._cut_after:
            if self._cut_until_s is None:
                self._cut_until_s = self.time_s + self._cut_s
            if self.time_s < self._cut_until_s:
                return
        loss, repeated, late = self._chances
        if self._random.random() < loss:
            return
        for _ in range(2 if self._random.random() < repeated else 1):
            delay_s = _DELAY_S * (
                self._random.uniform(1, 30) if self._random.random() < late else 1
            )
            event = (self.time_s + delay_s, next(self._number), index, data)
            heapq.heappush(self._events, event)
