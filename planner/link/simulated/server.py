"""What every protocol of the simulated vehicle is, and how it answers."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, Protocol

from planner.link.message import message

if TYPE_CHECKING:
    from planner.link.message import Message

NEVER_S = math.inf
"""Deadline of a server that waits for nothing. [s]"""


class Server(Protocol):
    """One protocol, on the vehicle's side."""

    @property
    def deadline_s(self) -> float:
        """When `expire` is to be called, unless something came before. [s]"""

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Take it that the deadline has passed."""


def answer(received: Message, name: str, **fields: Any) -> Message:  # noqa: ANN401 - as MAVLink has it
    """Return a message to whoever sent another one."""
    return message(
        name, target_system=received.system, target_component=received.component, **fields
    )
