"""The log protocol: a vehicle's list of logs, and one of them, whatever the line loses."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import LinkError
from planner.frozen import frozen
from planner.link.chunks import ChunkStream
from planner.link.exchange import Exchange
from planner.link.message import message

if TYPE_CHECKING:
    from collections.abc import Callable

    from planner.link.message import Message
    from planner.link.settings import LinkSettings

_ALL = 0xFFFF
_WINDOW = 90 * 256
"""Bytes asked for at once: 90 in each message. [B]"""


@frozen
class VehicleLog:
    """A log that a vehicle keeps."""

    name: str
    """File name to keep it under."""
    size_bytes: int
    path: str = ""
    """On the vehicle's file system; empty where it has only a number."""
    number: int | None = None
    """In the log protocol."""


class LogListing(Exchange):
    """The logs a vehicle is asked for.

    Parameters
    ----------
    settings : LinkSettings
        How patient to be.
    """

    def __init__(self, settings: LinkSettings) -> None:
        super().__init__(settings)
        self._count: int | None = None
        self._sizes: dict[int, int] = {}

    @property
    def progress(self) -> tuple[int, int | None]:
        """Logs so far, and how many there are."""
        return len(self._sizes), self._count

    @property
    def sizes(self) -> dict[int, int]:
        """Size by number, once it is done. [B]"""
        return dict(sorted(self._sizes.items()))

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if received.name != "LOG_ENTRY":
            return ()
        self._count = received["num_logs"]
        if self._count and received["id"] not in self._sizes:
            self._sizes[received["id"]] = received["size"]
            self._timer.sent(now_s)
        self.is_done = len(self._sizes) >= self._count
        return ()

    def _requests(self) -> tuple[Message, ...]:
        return (message("LOG_REQUEST_LIST", start=0, end=_ALL),)

    def _give_up(self, now_s: float) -> None:  # noqa: ARG002 - as every exchange
        got, count = self.progress
        msg = f"the list of logs stalled at {got} of {'?' if count is None else count}"
        raise LinkError(msg)


class LogDownload(Exchange):
    """One log by its number, after the vehicle was asked for its list.

    LOG_REQUEST_END is not part of it: PX4 forgets its list by it, and sends no other log.

    Parameters
    ----------
    log : VehicleLog
        Which.
    start : int
        How much of it is there already. [B]
    write : callable
        Given each piece in its order.
    settings : LinkSettings
        How patient to be.
    """

    def __init__(
        self, log: VehicleLog, start: int, write: Callable[[bytes], None], settings: LinkSettings
    ) -> None:
        super().__init__(settings)
        self._log = log
        self._stream = ChunkStream(log.size_bytes, start, write)
        self._asked_until = 0
        self.is_done = self._stream.is_whole

    @property
    def progress(self) -> tuple[int, int | None]:
        """Bytes so far, and how many there are."""
        return self._stream.offset, self._stream.size

    def feed(self, received: Message, now_s: float) -> tuple[Message, ...]:
        """Take a message of the vehicle."""
        if self.is_done or received.name != "LOG_DATA" or received["id"] != self._log.number:
            return ()
        content = bytes(received["data"])[: received["count"]]
        offset = received["ofs"]
        has_grown = self._stream.take(offset, content)
        if self._stream.is_whole:
            self.is_done = True
            return ()
        if has_grown:
            self._timer.answered(now_s)
            self._timer.sent(now_s)
        if has_grown and self._stream.offset >= self._asked_until:
            return self._requests()
        if offset + len(content) >= self._asked_until:  # the end of what was asked for is here
            return self._requests()
        return ()

    def _give_up(self, now_s: float) -> None:  # noqa: ARG002 - as every exchange
        done, size = self.progress
        msg = (
            f"{self._log.name} stalled at {done} of {size} bytes; what came is kept, call again to "
            "go on"
        )
        raise LinkError(msg)

    def _requests(self) -> tuple[Message, ...]:
        start = self._stream.offset
        count = min(self._stream.gap() or _WINDOW, _WINDOW, self._stream.size - start)
        self._asked_until = start + count
        return (message("LOG_REQUEST_DATA", id=self._log.number, ofs=start, count=count),)
