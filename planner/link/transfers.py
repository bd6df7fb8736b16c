"""What transfers have in common: a request repeated until it is answered, or as often as may be."""

from __future__ import annotations

import math
import secrets
from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.link.wire import message
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.link.wire import Message


_SPREAD = 4.0
"""An answer this many times as late as usual is lost."""
_MARGIN = 1.25
"""On a slow line an answer may take so many times the usual. [-]"""
_OFTEN = 4
"""Requests of which one in five lost answers does not account for. [-]"""
_SMOOTHING = 1 / 8
"""Weight of the latest round trip in their mean, as in RFC 6298."""


class Retransmission:
    """The timer of one request at a time.

    The time until a request is repeated doubles with each attempt, from a few round trips up to the
    settings' longest; a round trip is measured only where the request went out once (RFC 6298).  An
    answer to a request that went out often was not lost that often, but takes so long: then the next
    one is waited for longer than the settings have it.
    """

    def __init__(self, settings: LinkSettings, *, retries: int | None = None) -> None:
        self._settings = settings
        self._retries = settings.retries if retries is None else retries
        self._round_trip_s: float | None = None
        self._late_s = 0.0
        """How long an answer took to a request that went out often. [s]"""
        self._first_sent_s = 0.0
        self.attempts = 0
        self.deadline_s = math.inf
        """When it is to be repeated. [s]"""

    @property
    def is_used_up(self) -> bool:
        """Whether the request was repeated as often as may be."""
        return self.attempts > self._retries

    def sent(self, now_s: float) -> None:
        """Note a new request."""
        self.attempts = 0
        self._first_sent_s = now_s
        self.repeated(now_s)

    def repeated(self, now_s: float) -> None:
        """Note that the present request goes out once more."""
        self.deadline_s = now_s + self._timeout_s()
        self.attempts += 1

    def answered(self, now_s: float) -> None:
        """Note the answer."""
        if self.attempts == 1:
            round_trip_s = now_s - self._first_sent_s
            if self._round_trip_s is None:
                self._round_trip_s = round_trip_s
            self._round_trip_s += _SMOOTHING * (round_trip_s - self._round_trip_s)
            self._late_s = 0.0
        elif self.attempts >= _OFTEN:
            self._late_s = self.waited_s(now_s)
        self.deadline_s = math.inf
        self.attempts = 0

    def acknowledged(self, now_s: float) -> None:
        """Note that the request arrived: what it asks for follows soon, or is not there."""
        if self.attempts == 1 and self._round_trip_s is None:
            self._round_trip_s = now_s - self._first_sent_s
        self.deadline_s = now_s + self._timeout_s()

    def waited_s(self, now_s: float) -> float:
        """Return the time since the present request first went out [s]."""
        return now_s - self._first_sent_s

    def _timeout_s(self) -> float:
        known_s = max(self._round_trip_s or 0.0, self._late_s)
        longest_s = max(self._settings.reply_timeout_s, _MARGIN * known_s)
        if self._round_trip_s is None or self._late_s:
            return longest_s
        base_s = max(_SPREAD * self._round_trip_s, self._settings.shortest_timeout_s)
        return min(base_s * 2.0**self.attempts, longest_s)


class Transfer:
    """An exchange of messages without the line: it is fed messages and times, and asks one thing at a time.

    Every method returns what is to be sent; `planner.errors.LinkError` is raised where the exchange
    cannot continue.
    """

    def __init__(self, settings: LinkSettings, *, retries: int | None = None) -> None:
        self._settings = settings
        self._timer = Retransmission(settings, retries=retries)
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""
        return self._timer.deadline_s

    @property
    def progress(self) -> tuple[int, int | None]:
        """How much is done, and of how much, where that is known."""
        return int(self.is_done), None

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle, of any kind."""
        raise NotImplementedError

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for the first time."""
        self._timer.sent(now_s)
        return self._requests()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again; give up where that was done often enough."""
        if self._timer.is_used_up:
            if stalled := self._stalled(self._timer.waited_s(now_s)):
                raise LinkError(stalled)
            self.is_done = True
            return ()
        self._timer.repeated(now_s)
        return self._requests()

    def _requests(self) -> tuple[Message, ...]:
        """Return what asks for what is missing now."""
        raise NotImplementedError

    def _stalled(self, waited_s: float) -> str:  # noqa: ARG002 - as who cannot do without
        """Return the message of giving up; empty where it can be done without."""
        return ""

    def _go_on(self, now_s: float) -> tuple[Message, ...]:
        """Note that an answer came, and ask for what is missing now."""
        self._timer.answered(now_s)
        self._timer.sent(now_s)
        return self._requests()


REQUEST_MESSAGE = 512
_ACCEPTED, _TEMPORARILY_REJECTED, _IN_PROGRESS = 0, 1, 5
"""MAV_RESULT: it may still come, or is asked for again when the time has come."""
_MAY_COME = frozenset({_ACCEPTED, _TEMPORARILY_REJECTED, _IN_PROGRESS})
HASH_NAME = "_HASH_CHECK"
"""PX4's hash over all parameters: one message shows whether any has changed."""
_BY_NAME = -1
_TOKEN_BITS = 62


class Question(Transfer):
    """One request, and the message that answers it: ``None`` where it does not come.

    Stray replies may still come to an earlier question, repeated, by the same command: a COMMAND_ACK
    does not name the question.  Where it has to be fresh, a message that may have been under way before
    is no answer: it has to be sent after the echo of a TIMESYNC that goes out with the question.
    """

    def __init__(
        self,
        request: Message,
        settings: LinkSettings,
        *,
        retries: int,
        stray: int = 0,
        is_fresh: bool = False,
    ) -> None:
        super().__init__(settings, retries=retries)
        self._request = request
        self._token = secrets.randbits(_TOKEN_BITS) if is_fresh else None
        self._is_echoed = not is_fresh
        self._stray = stray
        self._asked = 0
        self.answer: Message | None = None
        self.is_heard = False
        """Whether the vehicle replied at all, be it that it has no such message."""

    @property
    def stray(self) -> int:
        """Refusals of this question and earlier ones that may still come."""
        own = 0 if self.answer is not None else self._asked
        return max(self._stray + own, 0)

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name == "TIMESYNC" and received["tc1"] and received["ts1"] == self._token:
            self._is_echoed = True
        elif self._is_answer(received):
            if not self._is_echoed:
                return ()  # it may have been under way before
            self._timer.answered(now_s)
            self.answer = received
            self.is_done = self.is_heard = True
        elif self._is_reply(received):
            self.is_heard = True
            is_final = received["result"] not in _MAY_COME
            self.is_done = is_final and self._stray <= 0
            self._stray -= is_final
        return ()

    def _requests(self) -> tuple[Message, ...]:
        self._asked += 1
        if self._token is None:
            return (self._request,)
        return (message("TIMESYNC", tc1=0, ts1=self._token), self._request)

    def _is_answer(self, received: Message) -> bool:
        raise NotImplementedError

    def _is_reply(self, received: Message) -> bool:
        is_command = received.name == "COMMAND_ACK" and "command" in self._request.fields
        return is_command and received["command"] == self._request["command"]


class MessageRequest(Question):
    """A message that the vehicle is asked to send once (MAV_CMD_REQUEST_MESSAGE)."""

    def __init__(
        self, name: str, number: int, settings: LinkSettings, *, retries: int, stray: int = 0
    ) -> None:
        request = message("COMMAND_LONG", command=REQUEST_MESSAGE, param1=float(number))
        super().__init__(request, settings, retries=retries, stray=stray)
        self._name = name

    def _is_answer(self, received: Message) -> bool:
        return received.name == self._name


_ROUNDS = 3
"""Rounds of requests which all arrived, and in which a message did not come that the vehicle has not: one of
five lost would be lost in each of them by a chance of 0.8 %. [-]"""
_REFUSED_ROUNDS = 2
"""Likewise where as many requests were refused as messages are missing; a line may repeat a refusal. [-]"""


class MessageRequests(Transfer):
    """Several messages that the vehicle is asked to send once, together: each may be one it has not.

    ArduPilot accepts a request for a message that it then does not send, such as its home before it has
    one; a COMMAND_ACK does not name the message.
    """

    def __init__(
        self, wanted: Mapping[str, int], settings: LinkSettings, *, retries: int, stray: int = 0
    ) -> None:
        super().__init__(settings, retries=retries)
        self.missing = dict(wanted)
        """Numbers by name."""
        self.stray = stray
        """Replies to earlier requests that may still come."""
        self._open = 0
        """Requests of this round without a reply."""
        self._refused = 0
        """Of this round."""
        self._rounds = self._refused_rounds = 0

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name in self.missing:
            del self.missing[received.name]
        elif received.name == "COMMAND_ACK" and received["command"] == REQUEST_MESSAGE:
            if self.stray > 0:
                self.stray -= 1
                return ()
            self._open = max(self._open - 1, 0)
            self._refused += received["result"] not in _MAY_COME
            self._timer.acknowledged(now_s)
        if not self.missing:
            self.is_done = True
        elif self._refused >= len(self.missing):
            self._refused_rounds += 1
            self.is_done = self._refused_rounds >= _REFUSED_ROUNDS
            if not self.is_done:
                self._timer.repeated(now_s)
                return self._requests()
        self.stray += self._open if self.is_done else 0
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again for what is missing, unless it is certain not to come."""
        self._rounds += self._open == 0
        if self._rounds >= _ROUNDS:
            self.is_done = True
            return ()
        return super().expire(now_s)

    def _requests(self) -> tuple[Message, ...]:
        self.stray += self._open
        self._open, self._refused = len(self.missing), 0
        return tuple(
            message("COMMAND_LONG", command=REQUEST_MESSAGE, param1=float(number))
            for number in self.missing.values()
        )


class EchoRequest(Question):
    """A number that comes back: whether questions can be told apart from what was under way."""

    def __init__(self, settings: LinkSettings, *, retries: int) -> None:
        self._number = secrets.randbits(_TOKEN_BITS)
        request = message("TIMESYNC", tc1=0, ts1=self._number)
        super().__init__(request, settings, retries=retries)

    def _is_answer(self, received: Message) -> bool:
        is_echo = received.name == "TIMESYNC" and received["tc1"] != 0
        return is_echo and received["ts1"] == self._number


class ParameterHashRequest(Question):
    """PX4's hash over the parameters."""

    def __init__(self, settings: LinkSettings, *, retries: int, is_fresh: bool = False) -> None:
        request = message("PARAM_REQUEST_READ", param_id=HASH_NAME, param_index=_BY_NAME)
        super().__init__(request, settings, retries=retries, is_fresh=is_fresh)

    @property
    def content(self) -> bytes | None:
        """The four bytes of the hash; ``None`` where the vehicle has none."""
        return None if self.answer is None else bytes(self.answer["param_bytes"])

    def _is_answer(self, received: Message) -> bool:
        return received.name == "PARAM_VALUE" and received["param_id"] == HASH_NAME


class LinkSettings(Value):
    """Waiting times and numbers of attempts of every transfer.

    The defaults are those of ground stations: MAVLink's guide has 1500 ms for an answer; a request
    is repeated often enough that one in five messages may be lost in either direction.
    """

    heartbeat_timeout_s: float = 10.0
    """How long to wait for the first heartbeat; vehicles send one each second. [s]"""
    reply_timeout_s: float = 1.5
    """Longest time until a request is repeated; shorter once answers came faster. [s]"""
    shortest_timeout_s: float = 0.1
    """Shortest time until a request is repeated. [s]"""
    retries: int = 12
    """How often a request is repeated before the transfer counts as stalled."""
