"""A message that a vehicle is asked to send once (MAV_CMD_REQUEST_MESSAGE)."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.link.message import message
from planner.link.retransmission import Retransmission

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.settings import LinkSettings

REQUEST_MESSAGE = 512
_TEMPORARILY_REJECTED, _IN_PROGRESS = 1, 5
"""MAV_RESULT: asked again when the time has come."""
_ACCEPTED = 0


class MessageRequest:
    """One message, which may not be had: then it is ``None``.

    Parameters
    ----------
    name : str
        The message.
    number : int
        Its number.
    settings : LinkSettings
        How patient to be.
    retries : int
        How often to ask again.
    """

    def __init__(self, name: str, number: int, settings: LinkSettings, *, retries: int) -> None:
        self._name = name
        self._number = number
        self._timer = Retransmission(settings, retries=retries)
        self.answer: Message | None = None
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When to ask again. [s]"""
        return self._timer.deadline_s

    @property
    def progress(self) -> tuple[int, int | None]:
        """Whether it is there."""
        return int(self.answer is not None), 1

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for it."""
        self._timer.sent(now_s)
        return (self._request(),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name == self._name:
            self._timer.answered(now_s)
            self.answer = received
            self.is_done = True
        elif received.name == "COMMAND_ACK" and received["command"] == REQUEST_MESSAGE:
            self.is_done = received["result"] not in {
                _ACCEPTED,
                _TEMPORARILY_REJECTED,
                _IN_PROGRESS,
            }
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again, or do without it."""
        if self._timer.is_used_up:
            self.is_done = True
            return ()
        self._timer.repeated(now_s)
        return (self._request(),)

    def _request(self) -> Message:
        return message("COMMAND_LONG", command=REQUEST_MESSAGE, param1=float(self._number))
