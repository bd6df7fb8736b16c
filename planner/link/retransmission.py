"""When a request is repeated, and when its answer is given up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from planner.link.settings import LinkSettings

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
        """How often the present request was sent."""
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
