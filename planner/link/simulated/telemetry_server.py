"""The streams of a simulated vehicle, and the commands that ask for messages."""

from __future__ import annotations

import math
from collections import deque
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.message import message
from planner.link.simulated.server import answer
from planner.link.simulated.telemetry_messages import NUMBERS, make_telemetry

if TYPE_CHECKING:
    from collections.abc import Callable, Mapping

    from planner.link.message import Message
    from planner.link.simulated.telemetry_messages import Situation

_STREAMS: Mapping[str, float] = {
    "HEARTBEAT": 1.0,
    "GLOBAL_POSITION_INT": 0.25,
    "ATTITUDE": 0.25,
    "SYS_STATUS": 1.0,
    "BATTERY_STATUS": 1.0,
    "EXTENDED_SYS_STATE": 1.0,
    "GPS_RAW_INT": 1.0,
    "MISSION_CURRENT": 1.0,
    "HOME_POSITION": 2.0,
    "WIND_COV": 1.0,
    "WIND": 1.0,
}
"""Seconds between messages."""
_UNASKED: Mapping[Autopilot, frozenset[str]] = {
    Autopilot.PX4: frozenset(_STREAMS) - {"WIND"},
    Autopilot.ARDUPILOT: frozenset({"HEARTBEAT"}),
}
"""What is sent at no one's request: of ArduPilot's streams, all rates are 0 at first."""
_DATA_STREAMS = frozenset(_STREAMS) - {"HEARTBEAT", "HOME_POSITION", "WIND_COV"}
"""What REQUEST_DATA_STREAM begins, in one or another of its groups (ArduPilot)."""
_FASTEST_S = 0.02
GET_HOME_POSITION, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE = 410, 511, 512
REQUEST_AUTOPILOT_CAPABILITIES = 520
_ACCEPTED, _DENIED, _UNSUPPORTED, _FAILED = 0, 2, 3, 4
"""MAV_RESULT."""
_NAMES = {number: name for name, number in NUMBERS.items()}
_MOST_ACTS = 1000
_ACTS = frozenset(
    {
        *("COMMAND_LONG", "COMMAND_INT", "PARAM_SET", "SET_MODE", "MISSION_SET_CURRENT"),
        *("MANUAL_CONTROL", "RC_CHANNELS_OVERRIDE", "SET_POSITION_TARGET_GLOBAL_INT"),
        *("SET_POSITION_TARGET_LOCAL_NED", "SET_ATTITUDE_TARGET", "SET_HOME_POSITION"),
    }
)
"""Messages that would do something to a real vehicle."""
_QUESTIONS = frozenset(
    {GET_HOME_POSITION, SET_MESSAGE_INTERVAL, REQUEST_MESSAGE, REQUEST_AUTOPILOT_CAPABILITIES}
)


class TelemetryServer:
    """Sends what is due, and what is asked for.

    Parameters
    ----------
    situation : callable
        Returns the vehicle's situation at a time [s].
    autopilot : Autopilot
        Whose streams it has.
    """

    def __init__(self, situation: Callable[[float], Situation], autopilot: Autopilot) -> None:
        self._situation = situation
        self._autopilot = autopilot
        self._intervals_s = {name: _STREAMS[name] for name in _UNASKED[autopilot]}
        self._due_s = dict.fromkeys(self._intervals_s, -1.0)
        self.acts: deque[Message] = deque(maxlen=_MOST_ACTS)
        """What ground stations sent that would move, set or arm a real vehicle: none of it is done."""

    @property
    def deadline_s(self) -> float:
        """When the next message is due. [s]"""
        return min(self._due_s.values())

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        if received.name in _ACTS and received.fields.get("command") not in _QUESTIONS:
            self.acts.append(received)
        match received.name:
            case "COMMAND_LONG" | "COMMAND_INT":
                return self._command(received, now_s)
            case "REQUEST_DATA_STREAM" if self._autopilot is Autopilot.ARDUPILOT:
                self._set_streams(received, now_s)
            case "TIMESYNC" if received["tc1"] == 0:
                boot_ns = round(self._situation(now_s).boot_s * 1e9)
                return (message("TIMESYNC", tc1=boot_ns, ts1=received["ts1"]),)
            case "PING" if received["target_system"] == 0:
                values = {name: received[name] for name in ("time_usec", "seq")}
                return (answer(received, "PING", **values),)
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send what is due."""
        at = self._situation(now_s)
        sent = []
        for name, due_s in self._due_s.items():
            if due_s <= now_s:
                # A late clock does not make up for what was left out.
                self._due_s[name] = now_s + self._intervals_s[name]
                sent.append(make_telemetry(name, at))
        return tuple(one for one in sent if one is not None)

    def _command(self, received: Message, now_s: float) -> tuple[Message, ...]:
        result, sent = _ACCEPTED, None
        match received["command"]:
            case command if command == GET_HOME_POSITION:
                sent = make_telemetry("HOME_POSITION", self._situation(now_s))
            case command if command == REQUEST_AUTOPILOT_CAPABILITIES:
                sent = make_telemetry("AUTOPILOT_VERSION", self._situation(now_s))
            case command if command == REQUEST_MESSAGE:
                name = _asked_name(received)
                sent = make_telemetry(name, self._situation(now_s))
                unknown = _DENIED if self._autopilot is Autopilot.PX4 else _FAILED
                result = unknown if sent is None else _ACCEPTED
            case command if command == SET_MESSAGE_INTERVAL:
                result = self._set_interval(received, now_s)
            case _:
                result = _DENIED
        ack = answer(received, "COMMAND_ACK", command=received["command"], result=result)
        return (ack,) if sent is None else (ack, sent)

    def _set_streams(self, received: Message, now_s: float) -> None:
        """Begin or end what ArduPilot sends in groups, here all of them together."""
        rate_hz = received["req_message_rate"] if received["start_stop"] else 0
        for name in _DATA_STREAMS:
            self._intervals_s.pop(name, None)
            self._due_s.pop(name, None)
            if rate_hz:
                self._intervals_s[name] = max(1.0 / rate_hz, _FASTEST_S)
                self._due_s[name] = now_s

    def _set_interval(self, received: Message, now_s: float) -> int:
        name = _asked_name(received)
        if not name:
            return _UNSUPPORTED
        interval_us = received["param2"]
        if not math.isfinite(interval_us):
            return _DENIED
        self._intervals_s.pop(name, None)
        self._due_s.pop(name, None)
        if interval_us == 0:
            interval_us = _STREAMS.get(name, 1.0) * 1e6
        if interval_us > 0:
            self._intervals_s[name] = max(interval_us / 1e6, _FASTEST_S)
            self._due_s[name] = now_s
        return _ACCEPTED


def _asked_name(received: Message) -> str:
    """Return the name of the message whose number is the first parameter; empty for none."""
    number = received["param1"]
    return _NAMES.get(round(number), "") if math.isfinite(number) else ""
