"""PX4's events on the vehicle's side (mavlink_events.cpp): said once, and again when asked for."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from planner.link.message import message
from planner.link.simulated.server import NEVER_S
from planner.link.vehicle_events import event_number

if TYPE_CHECKING:
    from planner.link.message import Message

_EVERY_S = 3.0
"""Between messages that tell the number of the latest event. [s]"""
_FIRST = 65_525
"""PX4 begins its numbers so that they soon begin anew."""
_KEPT = 20
_ERROR, _INFO = 3, 6
"""Log levels, outwards and for its own log."""


class EventServer:
    """The events of a vehicle.

    Parameters
    ----------
    is_reporting : bool
        Whether it reports events at all: ArduPilot does not.
    """

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
        told = message(
            "EVENT",
            id=event_number(name),
            sequence=self._sequence,
            log_levels=_INFO << 4 | _ERROR,
            arguments=b"" if item is None else item.to_bytes(2, "little"),
        )
        self._kept.append(told)
        return (told,)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:  # noqa: ARG002 - as every server
        """Take a message of any kind, and return the answers."""
        if received.name != "REQUEST_EVENT" or not self._is_reporting:
            return ()
        span = (received["last_sequence"] - received["first_sequence"]) & 0xFFFF
        return tuple(
            told
            for told in self._kept
            if (told["sequence"] - received["first_sequence"]) & 0xFFFF <= span
        )

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Tell the number of the latest event."""
        self.deadline_s = now_s + _EVERY_S
        return (message("CURRENT_EVENT_SEQUENCE", sequence=self._sequence),)
