"""How patient the link is."""

from __future__ import annotations

import math

from planner.frozen import frozen


@frozen
class LinkSettings:
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

    def __post_init__(self) -> None:
        for name in ("heartbeat_timeout_s", "reply_timeout_s", "shortest_timeout_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value > 0.0):
                msg = f"{name} must be positive, got {value}"
                raise ValueError(msg)
        if self.retries < 0:
            msg = f"retries must not be negative, got {self.retries}"
            raise ValueError(msg)
