"""A line in memory with a clock of its own: hours pass in a moment, the same way every time."""

from __future__ import annotations

from collections import deque
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable

    from planner.link.simulated.wire import SimulatedWire

_PEER = "simulated"


class MemoryLine:
    """The ground station's end of a line to a simulated vehicle; a `planner.link.line.Line`.

    Parameters
    ----------
    wire : SimulatedWire
        The other end.
    """

    def __init__(self, wire: SimulatedWire) -> None:
        self._wire = wire
        self._now_s = 0.0
        self._arrived: deque[bytes] = deque()
        self.is_closed = False

    def now_s(self) -> float:
        """Return the time, which only `receive` moves [s]."""
        return self._now_s

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return the frames that come first, or none; the time is then when they came."""
        until_s = self._now_s + max(timeout_s, 0.0)
        while True:
            self._arrived += self._wire.due(self._now_s)
            if self._arrived:
                found: list[tuple[Hashable, bytes]] = [(_PEER, one) for one in self._arrived]
                self._arrived.clear()
                return found
            deadline_s = self._wire.deadline_s
            if deadline_s > until_s:
                self._now_s = until_s
                return []
            self._now_s = max(self._now_s, deadline_s)

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - one vehicle
        """Put bytes on the line."""
        self._wire.receive(data, self._now_s, _PEER)

    def close(self) -> None:
        """Note that nobody listens any more."""
        self.is_closed = True
