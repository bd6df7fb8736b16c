"""Inputs made of frames: each of its right length and check sum, so that damage reaches what reads them."""

from __future__ import annotations

import struct
from typing import TYPE_CHECKING, Any

from fuzz.mutation import damaged
from pymavlink.generator.mavcrc import x25crc

from planner.link.wire import load_dialect
from planner.logs.tlog import WANTED

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable
    from random import Random

_ULOG_HEAD = 16
_MOST_CONTENT = 255
_DAMAGED = 0.08
"""So many of the pieces are damaged inside, the others whole."""


def ulog_maker(log: bytes) -> Callable[[Random], bytes]:
    """Return a maker of logs from the messages of one: some definitions, a run of data."""
    head, at, pieces = log[:_ULOG_HEAD], _ULOG_HEAD, []
    while at + 3 <= len(log):
        (size,) = struct.unpack_from("<H", log, at)
        pieces.append((log[at + 2 : at + 3], log[at + 3 : at + 3 + size]))
        at += 3 + size
    first = next(number for number, (kind, _) in enumerate(pieces) if kind == b"A")
    definitions = pieces[:first]
    subscriptions = [one for one in pieces if one[0] == b"A"]
    data = [one for one in pieces if one[0] == b"D"]

    def make(draw: Random) -> bytes:
        begin = draw.randrange(len(data))
        keep = draw.choice((0.15, 0.5, 1.0))
        chosen = [one for one in definitions + subscriptions if draw.random() < keep]
        out = [head if draw.random() < 0.99 else damaged(head, draw)]
        for kind, body in chosen + data[begin : begin + draw.choice((1, 4, 20))]:
            held = damaged(body, draw)[:_MOST_CONTENT] if draw.random() < _DAMAGED else body
            size = len(held) if draw.random() < 0.99 else draw.randrange(1 << 16)
            out.append(struct.pack("<H", size) + kind + held)
        return b"".join(out)

    return make


def dataflash_maker(messages: list[bytes]) -> Callable[[Random], bytes]:
    """Return a maker of binary logs from the messages of one, its definitions first."""
    definitions = [one for one in messages if one[2] == 128]
    data = [one for one in messages if one[2] != 128]

    def make(draw: Random) -> bytes:
        begin = draw.randrange(len(data))
        keep = draw.choice((0.2, 0.5, 1.0))
        chosen = [one for one in definitions if draw.random() < keep]
        chosen += data[begin : begin + draw.choice((1, 5, 30))]
        return b"".join(damaged(one, draw) if draw.random() < _DAMAGED else one for one in chosen)

    return make


def mavlink_frame(kind: Any, content: bytes, draw: Random) -> bytes:  # noqa: ANN401 - pymavlink has no types
    """Return a frame of version 2 whose check sum is right."""
    system, component = draw.choice((1, 1, 1, 2, 255, 0)), draw.choice((1, 1, 1, 190, 0))
    body = bytes((len(content), 0, 0, draw.randrange(256), system, component))
    body += kind.id.to_bytes(3, "little") + content
    crc = x25crc(body)
    crc.accumulate(bytes((kind.crc_extra,)))
    frame: bytes = b"\xfd" + body + struct.pack("<H", crc.crc)
    return frame


def _content(kind: Any, draw: Random) -> bytes:  # noqa: ANN401 - as above
    size = kind.unpacker.size
    return draw.choice(
        (
            lambda: draw.randbytes(size),
            lambda: bytes(size),
            lambda: b"\xff" * size,
            lambda: damaged(bytes(size), draw)[:_MOST_CONTENT],
            lambda: draw.randbytes(draw.randrange(size + 1)),
        )
    )()


def _kinds(names: Iterable[str] | None) -> list[Any]:
    every = sorted(load_dialect().mavlink_map.values(), key=lambda kind: kind.id)
    return [kind for kind in every if names is None or kind.msgname in names]


def stream_maker() -> Callable[[Random], bytes]:
    """Return a maker of streams: any message of the dialect, and noise between."""
    kinds = _kinds(None)

    def make(draw: Random) -> bytes:
        out = []
        for _ in range(draw.choice((1, 2, 5))):
            kind = draw.choice(kinds)
            frame = mavlink_frame(kind, _content(kind, draw), draw)
            out.append(damaged(frame, draw) if draw.random() < 0.1 else frame)
        return b"".join(out)

    return make


def tlog_maker(frames: list[bytes]) -> Callable[[Random], bytes]:
    """Return a maker of telemetry logs: frames of one, and messages that it reads with any content."""
    kinds = _kinds(WANTED)

    def make(draw: Random) -> bytes:
        begin = draw.randrange(len(frames))
        out = frames[begin : begin + draw.choice((2, 6, 12))]
        for _ in range(draw.choice((1, 2, 5))):
            kind = draw.choice(kinds)
            stamp = draw.choice((out[0][:8], bytes(8), b"\xff" * 8, draw.randbytes(8)))
            one = stamp + mavlink_frame(kind, _content(kind, draw), draw)
            out.insert(draw.randrange(len(out) + 1), one)
        if draw.random() < 0.2:
            at = draw.randrange(len(out))
            out[at] = damaged(out[at], draw)
        return b"".join(out)

    return make
