"""What every protocol of the simulated vehicle is, and how it answers."""

from __future__ import annotations

import math
from collections import deque
from itertools import islice
from typing import TYPE_CHECKING, Any, Protocol

from planner.autopilot import Autopilot
from planner.link.telemetry import event_number
from planner.link.wire import message

if TYPE_CHECKING:
    from collections.abc import Iterator

    from planner.link.wire import Message
    from planner.simulator.setup import VehicleSetup


NEVER_S = math.inf
"""Deadline of a server that waits for nothing. [s]"""


class Server(Protocol):
    """One protocol, on the vehicle's side."""

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Take it that the deadline has passed."""


def answer(received: Message, name: str, **fields: Any) -> Message:  # noqa: ANN401 - as MAVLink has it
    """Return a message to whoever sent another one."""
    return message(
        name, target_system=received.system, target_component=received.component, **fields
    )


_CHUNK = 90
"""Bytes of a LOG_DATA."""
_AT_ONCE = 20
_PAUSE_S = 0.02


class LogServer:
    """A vehicle's logs."""

    def __init__(self, setup: VehicleSetup) -> None:
        self._logs = setup.logs
        self._first_id = int(setup.autopilot is Autopilot.ARDUPILOT)
        self._waiting: Iterator[Message] = iter(())
        self.deadline_s = NEVER_S

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        match received.name:
            case "LOG_REQUEST_LIST":
                self._waiting = iter(self._entries(received["start"], received["end"]))
            case "LOG_REQUEST_DATA":
                self._waiting = self._pieces(received["id"], received["ofs"], received["count"])
            case "LOG_REQUEST_END":
                self._waiting = iter(())
            case _:
                return ()
        return self.expire(now_s)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the next few."""
        sent = tuple(islice(self._waiting, _AT_ONCE))
        self.deadline_s = now_s + _PAUSE_S if len(sent) == _AT_ONCE else NEVER_S
        return sent

    def _entries(self, start: int, end: int) -> list[Message]:
        number, first = len(self._logs), self._first_id
        last = first + number - 1
        if not number:
            return [message("LOG_ENTRY")]
        return [
            message(
                "LOG_ENTRY",
                id=first + index,
                num_logs=number,
                last_log_num=last,
                time_utc=log.time_utc_s,
                size=len(log.content),
            )
            for index, log in enumerate(self._logs)
            if start <= first + index <= end
        ]

    def _pieces(self, number: int, offset: int, count: int) -> Iterator[Message]:
        index = number - self._first_id
        if not 0 <= index < len(self._logs):
            return
        content = self._logs[index].content
        end = min(offset + count, len(content))
        last = _CHUNK
        for start in range(offset, end, _CHUNK):
            data = content[start : min(start + _CHUNK, end)]
            last = len(data)
            yield _data(number, start, data)
        if offset + count > len(content) and last == _CHUNK:
            yield _data(number, max(offset, len(content)), b"")  # that is the end


def _data(number: int, offset: int, data: bytes) -> Message:
    return message(
        "LOG_DATA", id=number, ofs=offset, count=len(data), data=list(data.ljust(_CHUNK, b"\0"))
    )


_EVERY_S = 3.0
"""Between messages with the number of the latest event. [s]"""
_FIRST = 65_525
"""PX4 begins its numbers so that they soon wrap around."""
_KEPT = 20
_ERROR, _INFO = 3, 6
"""Log levels, outwards and for its own log."""


class EventServer:
    """The events of a vehicle; ArduPilot reports none."""

    def __init__(self, *, is_reporting: bool) -> None:
        self._is_reporting = is_reporting
        self._sequence = _FIRST
        self._kept: deque[Message] = deque(maxlen=_KEPT)
        self.deadline_s = 0.0 if is_reporting else NEVER_S

    def report(self, name: str, *, item: int | None = None) -> tuple[Message, ...]:
        """Report an error by the name of its event."""
        if not self._is_reporting:
            return ()
        self._sequence = (self._sequence + 1) & 0xFFFF
        event = message(
            "EVENT",
            id=event_number(name),
            sequence=self._sequence,
            log_levels=_INFO << 4 | _ERROR,
            arguments=b"" if item is None else item.to_bytes(2, "little"),
        )
        self._kept.append(event)
        return (event,)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every server
        """Take a message of any kind, and return the answers."""
        if received.name != "REQUEST_EVENT" or not self._is_reporting:
            return ()
        first = received["first_sequence"]
        span = (received["last_sequence"] - first) & 0xFFFF
        kept = {event["sequence"]: event for event in self._kept}
        asked = [(first + step) & 0xFFFF for step in range(min(span, _KEPT) + 1)]
        return tuple(kept.get(one) or self._unavailable(received, one) for one in asked)

    def _unavailable(self, received: Message, number: int) -> Message:
        """Return that there is no such event, and the first from there on, round to the oldest."""
        ahead = [(event["sequence"] - number) & 0xFFFF for event in self._kept]
        oldest = (number + min(ahead)) & 0xFFFF if ahead else self._sequence
        fields = {"sequence": number, "sequence_oldest_available": oldest}
        return answer(received, "RESPONSE_EVENT_ERROR", **fields)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the number of the latest event."""
        self.deadline_s = now_s + _EVERY_S
        return (message("CURRENT_EVENT_SEQUENCE", sequence=self._sequence),)


_PARAMETERS_AT_ONCE = 10
_BY_NAME = -1
_HASH_NAME, _HASH_INDEX, _UINT32 = "_HASH_CHECK", 65_535, 5
"""PX4 begins its list with a check sum that is no parameter."""


class ParameterServer:
    """A vehicle's parameters."""

    def __init__(self, setup: VehicleSetup) -> None:
        self._autopilot = setup.autopilot
        self._parameters = setup.parameters
        self._index = {one.name: number for number, one in enumerate(setup.parameters)}
        self._waiting: deque[int] = deque()
        self.deadline_s = NEVER_S

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        match received.name:
            case "PARAM_REQUEST_LIST":
                self._waiting = deque(range(len(self._parameters)))
                first = (_hash_check(),) if self._autopilot is Autopilot.PX4 else ()
                return first + self.expire(now_s)
            case "PARAM_REQUEST_READ":
                return self._read(received["param_index"], received["param_id"])
            case "PARAM_SET":  # what it is answers; nothing is ever set
                return self._read(_BY_NAME, received["param_id"])
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the next few of the list."""
        count = min(_PARAMETERS_AT_ONCE, len(self._waiting))
        sent = tuple(self._value(self._waiting.popleft()) for _ in range(count))
        self.deadline_s = now_s + _PAUSE_S if self._waiting else NEVER_S
        return sent

    def _read(self, index: int, name: str) -> tuple[Message, ...]:
        if index == _BY_NAME:
            if name == _HASH_NAME and self._autopilot is Autopilot.PX4:
                return (_hash_check(),)
            index = self._index.get(name, _BY_NAME)
        # Neither autopilot answers about a parameter that it does not have.
        return (self._value(index),) if 0 <= index < len(self._parameters) else ()

    def _value(self, index: int) -> Message:
        parameter = self._parameters[index]
        return message(
            "PARAM_VALUE",
            param_id=parameter.name,
            param_value=parameter.sent_value(self._autopilot),
            param_type=parameter.kind,
            param_count=len(self._parameters),
            param_index=index,
        )


def _hash_check() -> Message:
    return message(
        "PARAM_VALUE",
        param_id=_HASH_NAME,
        param_value=0.0,
        param_type=_UINT32,
        param_index=_HASH_INDEX,
    )
