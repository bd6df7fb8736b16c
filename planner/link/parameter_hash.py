"""PX4's hash over all parameters: one message tells whether any has changed."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.link.message import message
from planner.link.retransmission import Retransmission

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.settings import LinkSettings

HASH_NAME = "_HASH_CHECK"
_BY_NAME = -1


class ParameterHashRequest:
    """The hash, which a vehicle may not have: then it is ``None``.

    Parameters
    ----------
    settings : LinkSettings
        How patient to be.
    retries : int
        How often to ask again.
    """

    def __init__(self, settings: LinkSettings, *, retries: int) -> None:
        self._timer = Retransmission(settings, retries=retries)
        self.content: bytes | None = None
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When to ask again. [s]"""
        return self._timer.deadline_s

    @property
    def progress(self) -> tuple[int, int | None]:
        """Whether it is there."""
        return int(self.content is not None), 1

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for it."""
        self._timer.sent(now_s)
        return (self._request(),)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name == "PARAM_VALUE" and received["param_id"] == HASH_NAME:
            self._timer.answered(now_s)
            self.content = received["param_bytes"]
            self.is_done = True
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again, or do without it."""
        if self._timer.is_used_up:
            self.is_done = True
            return ()
        self._timer.repeated(now_s)
        return (self._request(),)

    def _request(self) -> Message:
        return message("PARAM_REQUEST_READ", param_id=HASH_NAME, param_index=_BY_NAME)
