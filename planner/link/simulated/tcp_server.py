"""The vehicle's end of a TCP line, to which ground stations come and from which they go."""

from __future__ import annotations

import select
import socket
import time
from contextlib import suppress
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Hashable

    from planner.link.address import LinkAddress

_CHUNK = 1 << 16
_MOST_PEERS = 16
_PATIENCE_S = 1.0
"""Who does not take what is sent in this time has gone. [s]"""


class TcpServerLine:
    """A port that any number of ground stations connect to; a `planner.link.line.Line`.

    Parameters
    ----------
    address : LinkAddress
        Where to listen; the port 0 is any that is free.
    """

    def __init__(self, address: LinkAddress) -> None:
        family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
        self._listener = socket.create_server((address.host, address.port), family=family)
        self._streams: list[socket.socket] = []

    def now_s(self) -> float:
        """Return a time that only grows [s]."""
        return time.monotonic()

    def receive(self, timeout_s: float) -> list[tuple[Hashable, bytes]]:
        """Return what has come, each with its sender."""
        ready, _, _ = select.select([self._listener, *self._streams], [], [], max(timeout_s, 0.0))
        found: list[tuple[Hashable, bytes]] = []
        for one in ready:
            if one is self._listener:
                self._accept()
                continue
            data = b""
            with suppress(OSError):
                data = one.recv(_CHUNK)
            if data:
                found.append((one, data))
            else:
                self._forget(one)
        return found

    def send(self, data: bytes, peer: Hashable | None = None) -> None:  # noqa: ARG002 - all hear it
        """Send a frame to everyone who is connected."""
        for one in list(self._streams):
            try:
                one.sendall(data)
            except OSError:
                self._forget(one)

    def close(self) -> None:
        """Close the port and hang up."""
        for one in (self._listener, *self._streams):
            one.close()
        self._streams.clear()

    def _accept(self) -> None:
        stream, _ = self._listener.accept()
        if len(self._streams) >= _MOST_PEERS:
            stream.close()
            return
        stream.settimeout(_PATIENCE_S)
        stream.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self._streams.append(stream)

    def _forget(self, stream: socket.socket) -> None:
        stream.close()
        self._streams.remove(stream)
