"""What is known of the parts a verdict rests on: when each was read, and what spoke against it since."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from planner.frozen import frozen
from planner.link.guarding import READ_PARTS, Part

if TYPE_CHECKING:
    from planner.link.guarding import GuardSettings

_STALE_FACTOR = 2.0
"""Nothing rests on what is so many times as old as it should be."""
_PLURAL = frozenset({Part.PARAMETERS, Part.RALLY})


@frozen
class Objection:
    """Why the parts are no ground for a verdict."""

    part: Part
    text: str
    may_pass: bool
    """Whether reading goes on."""


class _Reading:
    """One part."""

    def __init__(self) -> None:
        self.fingerprint: str | None = None
        self.began_s = -math.inf
        """When the latest successful reading began. [s]"""
        self.notices = 0
        """Signs of a change so far."""
        self.notices_read = 0
        """How many there were when the latest successful reading began."""
        self.why = ""
        self.first_notice_s = self.notice_s = -math.inf
        self.failure = ""
        self.failed_s = -math.inf
        self.asked: tuple[float, int] | None = None
        """When the reading that goes on began, and how many notices there were."""

    @property
    def is_unread(self) -> bool:
        """Whether the part is not as it was read, for all that is known."""
        return self.fingerprint is None or self.notices_read < self.notices or bool(self.failure)


class Readings:
    """The parts, of which some are needed.

    Parameters
    ----------
    settings : GuardSettings
        Which, and how old they may be.
    """

    def __init__(self, settings: GuardSettings) -> None:
        self._settings = settings
        self._of = {part: _Reading() for part in Part}
        self._needed = tuple(part for part in Part if part in settings.needed)

    def notice(self, part: Part, why: str, now_s: float) -> None:
        """Take a sign that a part has changed."""
        reading = self._of[part]
        if reading.notices_read == reading.notices:
            reading.first_notice_s = now_s
        reading.notices += 1
        reading.notice_s = now_s
        reading.why = why

    def read(self, part: Part, fingerprint: str, now_s: float) -> None:
        """Take a part that was asked for, or told by the vehicle; others are passed over."""
        reading = self._of[part]
        if part in READ_PARTS:
            if reading.asked is None:
                return
            reading.began_s, reading.notices_read = reading.asked
        else:
            reading.began_s, reading.notices_read = now_s, reading.notices
        reading.asked = None
        reading.fingerprint = fingerprint
        reading.failure = ""

    def failed(self, part: Part, why: str, now_s: float) -> None:
        """Take it that a part could not be read."""
        reading = self._of[part]
        reading.asked = None
        reading.failure = why
        reading.failed_s = now_s

    @property
    def is_complete(self) -> bool:
        """Whether every needed part is as it was read, for all that is known."""
        return not any(self._of[part].is_unread for part in self._needed)

    def fingerprints(self) -> dict[Part, str]:
        """Return the fingerprints of the needed parts that were read."""
        known = ((part, self._of[part].fingerprint) for part in self._needed)
        return {part: fingerprint for part, fingerprint in known if fingerprint is not None}

    def mark(self) -> object:
        """Return a value that changes with any part that is read, or any sign of a change of one."""
        return tuple((self._of[p].fingerprint, self._of[p].notices) for p in READ_PARTS)

    def age_s(self, now_s: float) -> float | None:
        """Return the age of the oldest needed part; ``None`` while one was never read [s]."""
        age_s = now_s - min((self._of[part].began_s for part in self._needed), default=now_s)
        return age_s if math.isfinite(age_s) else None

    def confirmed_since(self, since_s: float) -> bool:
        """Return whether every needed part that is asked for was read from a time on."""
        return all(self._of[part].began_s >= since_s for part in self._needed if part in READ_PARTS)

    def objection(self, now_s: float) -> Objection | None:
        """Return why no verdict can rest on the parts; ``None`` where one can."""
        oldest_s = _STALE_FACTOR * self._settings.oldest_s
        for part in self._needed:
            reading = self._of[part]
            be = "are" if part in _PLURAL else "is"
            have = "have" if part in _PLURAL else "has"
            if reading.failure:
                why = f"the {part} could not be read: {reading.failure}"
                return Objection(part=part, text=why, may_pass=False)
            if reading.fingerprint is None:
                why = f"the {part} {have} not been read yet"
                return Objection(part=part, text=why, may_pass=reading.asked is not None)
            if reading.is_unread:
                why = f"the {part} may have changed and {be} read again ({reading.why})"
                return Objection(part=part, text=why, may_pass=True)
            if now_s - reading.began_s > oldest_s:
                why = f"the {part} {have} not been heard of for more than {oldest_s:g} s"
                return Objection(part=part, text=why, may_pass=reading.asked is not None)
        return None

    def due(self, now_s: float, *, confirmed_since_s: float | None) -> tuple[Part, ...]:
        """Return the parts to ask for now; they then count as asked for.

        Parameters
        ----------
        now_s : float
            The time. [s]
        confirmed_since_s : float or None
            A request waits for every part to have been read from this time on. [s]
        """
        parts = tuple(
            part
            for part in self._needed
            if part in READ_PARTS and self._is_due(self._of[part], now_s, confirmed_since_s)
        )
        for part in parts:
            self._of[part].asked = (now_s, self._of[part].notices)
        return parts

    def _is_due(self, reading: _Reading, now_s: float, confirmed_since_s: float | None) -> bool:
        settings = self._settings
        if reading.asked is not None:
            return False
        if reading.failure:
            return now_s - reading.failed_s >= settings.retry_s
        if confirmed_since_s is not None and reading.began_s < confirmed_since_s:
            return True
        if reading.notices_read < reading.notices:
            return (
                confirmed_since_s is not None
                or now_s - reading.notice_s >= settings.debounce_s
                or now_s - reading.first_notice_s >= settings.longest_debounce_s
            )
        return reading.fingerprint is None or now_s - reading.began_s >= settings.oldest_s
