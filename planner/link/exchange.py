"""What transfers share: a request that is repeated until it is answered, or as often as may be."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.link.retransmission import Retransmission

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.settings import LinkSettings


class Exchange:
    """The requests of a `planner.link.message.Transfer`, of which there is one at a time.

    Parameters
    ----------
    settings : LinkSettings
        How patient to be.
    retries : int, optional
        How often to ask again; default as the settings have it.
    """

    def __init__(self, settings: LinkSettings, *, retries: int | None = None) -> None:
        self._settings = settings
        self._timer = Retransmission(settings, retries=retries)
        self.is_done = False

    @property
    def deadline_s(self) -> float:
        """When to ask again. [s]"""
        return self._timer.deadline_s

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Ask for the first time."""
        self._timer.sent(now_s)
        return self._requests()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Ask again, or give up.

        Raises
        ------
        LinkError
            If it was asked often enough, and what was asked for cannot be done without.
        """
        if self._timer.is_used_up:
            self._give_up(now_s)
            return ()
        self._timer.repeated(now_s)
        return self._requests()

    def _requests(self) -> tuple[Message, ...]:
        """Return what asks for what is missing now."""
        raise NotImplementedError

    def _give_up(self, now_s: float) -> None:
        """Raise `planner.errors.LinkError`, or do without."""
        raise NotImplementedError
