"""A MAVLink message as a value, and what a transfer of many of them is."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, Protocol

from planner.frozen import frozen

if TYPE_CHECKING:
    from collections.abc import Mapping


@frozen
class Message:
    """One message, received or to be sent."""

    name: str
    """As in the dialect: ``MISSION_COUNT``."""
    fields: Mapping[str, Any]
    """By MAVLink's names and in its units; of one to be sent, its target may be left out."""
    system: int = 0
    """Who sent it; 0 for our own."""
    component: int = 0

    def __getitem__(self, field: str) -> Any:  # noqa: ANN401 - numbers, texts and arrays
        return self.fields[field]


def message(name: str, **fields: Any) -> Message:  # noqa: ANN401 - numbers, texts and arrays
    """Return a message to be sent."""
    return Message(name=name, fields=fields)


class Transfer(Protocol):
    """An exchange of messages, without the line: it is fed messages and times.

    Every method returns what is to be sent; `planner.errors.LinkError` is raised where the
    exchange cannot go on.
    """

    @property
    def is_done(self) -> bool:
        """Whether nothing more is waited for."""

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""

    @property
    def progress(self) -> tuple[int, int | None]:
        """How much is done, and of how much, where that is known."""

    def begin(self, now_s: float) -> tuple[Message, ...]:
        """Return the first messages."""

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle, of any kind."""

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Take it that the deadline has passed."""
