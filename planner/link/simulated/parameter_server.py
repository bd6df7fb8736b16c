"""The parameter protocol on the vehicle's side.  What is to be set is noted, and stays as it was."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

from planner.autopilot import Autopilot
from planner.link.message import message
from planner.link.simulated.server import NEVER_S

if TYPE_CHECKING:
    from planner.link.message import Message
    from planner.link.simulated.setup import VehicleSetup

_AT_ONCE = 10
_PAUSE_S = 0.02
"""Vehicles send a list a few at a time, or a radio would lose most of it. [s]"""
_BY_NAME = -1
_HASH_NAME, _HASH_INDEX, _UINT32 = "_HASH_CHECK", 65_535, 5
"""PX4 begins its list with a check sum that is no parameter."""


class ParameterServer:
    """A vehicle's parameters.

    Parameters
    ----------
    setup : VehicleSetup
        Whose they are.
    """

    def __init__(self, setup: VehicleSetup) -> None:
        self._autopilot = setup.autopilot
        self._parameters = setup.parameters
        self._index = {one.name: number for number, one in enumerate(setup.parameters)}
        self._waiting: deque[int] = deque()
        self.deadline_s = NEVER_S

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of any kind, and return the answers."""
        match received.name:
            case "PARAM_REQUEST_LIST":
                self._waiting = deque(range(len(self._parameters)))
                first = (_hash_check(),) if self._autopilot is Autopilot.PX4 else ()
                return first + self.expire(now_s)
            case "PARAM_REQUEST_READ":
                return self._read(received["param_index"], received["param_id"])
            case "PARAM_SET":  # what it is answers; nothing is ever set
                return self._read(_BY_NAME, received["param_id"])
        return ()

    def expire(self, now_s: float) -> tuple[Message, ...]:
        """Send the next few of the list."""
        count = min(_AT_ONCE, len(self._waiting))
        sent = tuple(self._value(self._waiting.popleft()) for _ in range(count))
        self.deadline_s = now_s + _PAUSE_S if self._waiting else NEVER_S
        return sent

    def _read(self, index: int, name: str) -> tuple[Message, ...]:
        if index == _BY_NAME:
            if name == _HASH_NAME and self._autopilot is Autopilot.PX4:
                return (_hash_check(),)
            index = self._index.get(name, _BY_NAME)
        # Neither autopilot answers about a parameter that it does not have.
        return (self._value(index),) if 0 <= index < len(self._parameters) else ()

    def _value(self, index: int) -> Message:
        parameter = self._parameters[index]
        return message(
            "PARAM_VALUE",
            param_id=parameter.name,
            param_value=parameter.sent_value(self._autopilot),
            param_type=parameter.kind,
            param_count=len(self._parameters),
            param_index=index,
        )


def _hash_check() -> Message:
    return message(
        "PARAM_VALUE",
        param_id=_HASH_NAME,
        param_value=0.0,
        param_type=_UINT32,
        param_index=_HASH_INDEX,
    )
