"""A question that a vehicle may leave unanswered: asked some times, and then done without."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.link.exchange import Exchange
from planner.link.message import message

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.settings import LinkSettings

REQUEST_MESSAGE = 512
_ACCEPTED, _TEMPORARILY_REJECTED, _IN_PROGRESS = 0, 1, 5
"""MAV_RESULT: it may still come, or is asked for again when the time has come."""
_MAY_COME = frozenset({_ACCEPTED, _TEMPORARILY_REJECTED, _IN_PROGRESS})
HASH_NAME = "_HASH_CHECK"
"""PX4's hash over all parameters: one message tells whether any has changed."""
_BY_NAME = -1


class Question(Exchange):
    """One request, and the message that answers it: ``None`` where it does not come.

    Parameters
    ----------
    request : Message
        What to ask.
    settings : LinkSettings
        How patient to be.
    retries : int
        How often to ask again.
    stray : int
        Words that may still come to an earlier question, repeated, by the same command: a
        COMMAND_ACK does not tell which.
    """

    def __init__(
        self, request: Message, settings: LinkSettings, *, retries: int, stray: int = 0
    ) -> None:
        super().__init__(settings, retries=retries)
        self._request = request
        self._stray = stray
        self._asked = 0
        self.answer: Message | None = None
        self.is_heard = False
        """Whether the vehicle said anything to it, be it that it has no such message."""

    @property
    def stray(self) -> int:
        """Words to this question and earlier ones, that it cannot be had, which may still come."""
        own = 0 if self.answer is not None else self._asked
        return max(self._stray + own, 0)

    @property
    def progress(self) -> tuple[int, int | None]:
        """Whether it is there."""
        return int(self.answer is not None), 1

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if self._is_answer(received):
            self._timer.answered(now_s)
            self.answer = received
            self.is_done = self.is_heard = True
        elif self._is_word(received):
            self.is_heard = True
            is_final = received["result"] not in _MAY_COME
            self.is_done = is_final and self._stray <= 0
            self._stray -= is_final
        return ()

    def _requests(self) -> tuple[Message, ...]:
        self._asked += 1
        return (self._request,)

    def _give_up(self, now_s: float) -> None:  # noqa: ARG002 - it does without
        self.is_done = True

    def _is_answer(self, received: Message) -> bool:
        raise NotImplementedError

    def _is_word(self, received: Message) -> bool:
        """Return whether a COMMAND_ACK is about it."""
        is_command = received.name == "COMMAND_ACK" and "command" in self._request.fields
        return is_command and received["command"] == self._request["command"]


class MessageRequest(Question):
    """A message that the vehicle is asked to send once (MAV_CMD_REQUEST_MESSAGE).

    Parameters
    ----------
    name : str
        The message.
    number : int
        Its number.
    settings : LinkSettings
        How patient to be.
    retries, stray : int
        As of any question.
    """

    def __init__(
        self, name: str, number: int, settings: LinkSettings, *, retries: int, stray: int = 0
    ) -> None:
        request = message("COMMAND_LONG", command=REQUEST_MESSAGE, param1=float(number))
        super().__init__(request, settings, retries=retries, stray=stray)
        self._name = name

    def _is_answer(self, received: Message) -> bool:
        return received.name == self._name


class ParameterHashRequest(Question):
    """PX4's hash over the parameters.

    Parameters
    ----------
    settings : LinkSettings
        How patient to be.
    retries : int
        How often to ask again.
    """

    def __init__(self, settings: LinkSettings, *, retries: int) -> None:
        request = message("PARAM_REQUEST_READ", param_id=HASH_NAME, param_index=_BY_NAME)
        super().__init__(request, settings, retries=retries)

    @property
    def content(self) -> bytes | None:
        """The four bytes of the hash; ``None`` where the vehicle has none."""
        return None if self.answer is None else bytes(self.answer["param_bytes"])

    def _is_answer(self, received: Message) -> bool:
        return received.name == "PARAM_VALUE" and received["param_id"] == HASH_NAME
