"""The log protocol on the vehicle's side: LOG_REQUEST_LIST and LOG_REQUEST_DATA."""

from __future__ import annotations

from itertools import islice
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.message import message
from planner.link.simulated.server import NEVER_S

if TYPE_CHECKING:
    from collections.abc import Iterator

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
