"""Pieces of a file that come in any order, put in order."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

_MOST_AHEAD = 1 << 20
"""Bytes kept beyond a gap; further ones come again. [B]"""


class ChunkStream:
    """A file of known size, written from one end to the other.

    Parameters
    ----------
    size : int
        Of the whole file. [B]
    start : int
        How much of it is there already. [B]
    write : callable
        Given each piece in its order.
    """

    def __init__(self, size: int, start: int, write: Callable[[bytes], None]) -> None:
        self.size = size
        self.offset = start
        """Everything before this is written. [B]"""
        self._write = write
        self._ahead: dict[int, bytes] = {}

    @property
    def is_whole(self) -> bool:
        """Whether everything is written."""
        return self.offset >= self.size

    def take(self, offset: int, content: bytes) -> bool:
        """Take a piece; return whether something could be written."""
        content = content[: max(self.size - offset, 0)]
        if not content or offset + len(content) <= self.offset:
            return False
        if offset > self.offset:
            if offset - self.offset < _MOST_AHEAD:
                self._ahead[offset] = content
            return False
        self._put(content[self.offset - offset :])
        while self.offset in self._ahead:
            self._put(self._ahead.pop(self.offset))
        self._ahead = {at: one for at, one in self._ahead.items() if at > self.offset}
        return True

    def gap(self) -> int | None:
        """Return how many bytes are missing before the next piece that is there."""
        return min(self._ahead) - self.offset if self._ahead else None

    def _put(self, content: bytes) -> None:
        self._write(content)
        self.offset += len(content)
