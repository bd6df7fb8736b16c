"""The log protocol on the vehicle's side: LOG_REQUEST_LIST and LOG_REQUEST_DATA."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.message import message
from planner.link.simulated.server import NEVER_S

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.simulated.setup import VehicleSetup

_CHUNK = 90
"""Bytes of a LOG_DATA."""
_AT_ONCE = 20
_PAUSE_S = 0.02


class LogServer:
    """A vehicle's logs.

    Parameters
    ----------
    setup : VehicleSetup
        Whose they are.
    """

    def __init__(self, setup: VehicleSetup) -> None:
        self._logs = setup.logs
        self._first_id = int(setup.autopilot is Autopilot.ARDUPILOT)
        self._waiting: deque[Message] = deque()
        self.deadline_s = NEVER_S

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        match received.name:
            case "LOG_REQUEST_LIST":
                self._waiting = deque(self._entries(received["start"], received["end"]))
            case "LOG_REQUEST_DATA":
                self._waiting = deque(
                    self._pieces(received["id"], received["ofs"], received["count"])
                )
            case "LOG_REQUEST_END":
                self._waiting.clear()
            case _:
                return ()
        return self.expire(now_s)

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the next few."""
        count = min(_AT_ONCE, len(self._waiting))
        sent = tuple(self._waiting.popleft() for _ in range(count))
        self.deadline_s = now_s + _PAUSE_S if self._waiting else NEVER_S
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

    def _pieces(self, number: int, offset: int, count: int) -> list[Message]:
        index = number - self._first_id
        if not 0 <= index < len(self._logs):
            return []
        content = self._logs[index].content
        end = min(offset + count, len(content))
        pieces = []
        for start in range(offset, end, _CHUNK):
            data = content[start : min(start + _CHUNK, end)]
            pieces.append(_data(number, start, data))
        if offset + count > len(content) and not (pieces and len(content) % _CHUNK):
            pieces.append(_data(number, max(offset, len(content)), b""))  # that is the end
        return pieces


def _data(number: int, offset: int, data: bytes) -> Message:
    return message(
        "LOG_DATA", id=number, ofs=offset, count=len(data), data=list(data.ljust(_CHUNK, b"\0"))
    )
