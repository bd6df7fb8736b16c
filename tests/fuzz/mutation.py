"""Damage to bytes: what a card, a line, an editor or an enemy does to a file, drawn from a seed."""

from __future__ import annotations

import re
from itertools import islice
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from random import Random

_NUMBERS = (
    *(
        b"0",
        b"-0",
        b"-1",
        b"1e308",
        b"-1e308",
        b"1e-320",
        b"nan",
        b"inf",
        b"-inf",
        b"NaN",
        b"Infinity",
    ),
    *(
        b"65535",
        b"65536",
        b"2147483648",
        b"-2147483649",
        b"18446744073709551616",
        b"9" * 400,
        b"9" * 5000,
    ),
    *(
        b"0.1",
        b"90.0000001",
        b"180",
        b"-181",
        b"1e",
        b"0x10",
        b"1_0",
        b"true",
        b"null",
        b'""',
        b"[]",
    ),
)
_PIECES = (
    *(b"\x00", b"\xff", b"\x00" * 600, b"\xff" * 600, b"[" * 3000, b"{" * 3000, b'"', b"'", b"\\"),
    *(
        b"\n",
        b"\r",
        b"\t",
        b",",
        b"\xed\xa0\x80",
        b"\\ud800",
        b"\xef\xbb\xbf",
        b"\x1b[2J",
        b"a." * 300,
    ),
    *(b"#", b"=", b":", b"e", b"-", b"\xc2\xb1", b"QGC WPL 110\n", b"\x1f\x8b", b"PK\x03\x04"),
)
_NUMBER = re.compile(rb"-?\d+(?:\.\d+)?")
_VALUE = re.compile(
    rb'"[^"\n]{0,99}"|-?\d+(?:\.\d+)?(?:e-?\d+)?|\[[^][]{0,99}\]|\{[^{}]{0,99}\}|true|false|null'
)
_MOST_PLACES = 50
_MOST_BYTES = 1 << 20


def _flip(data: bytes, draw: Random) -> bytes:
    at = draw.randrange(len(data))
    return data[:at] + bytes((data[at] ^ 1 << draw.randrange(8),)) + data[at + 1 :]


def _set(data: bytes, draw: Random) -> bytes:
    at = draw.randrange(len(data))
    value = draw.choice((0, 1, 0x7F, 0x80, 0xFE, 0xFF, draw.randrange(256)))
    return data[:at] + bytes((value,)) + data[at + 1 :]


def _cut(data: bytes, draw: Random) -> bytes:
    return data[: draw.randrange(len(data))]


def _leave_out(data: bytes, draw: Random) -> bytes:
    at = draw.randrange(len(data))
    return data[:at] + data[at + draw.choice((1, 2, 8, 64, 512)) :]


def _repeat(data: bytes, draw: Random) -> bytes:
    at, size = draw.randrange(len(data)), draw.choice((1, 4, 32, 256))
    return data[:at] + data[at : at + size] * draw.choice((2, 3, 20)) + data[at + size :]


def _put_in(data: bytes, draw: Random) -> bytes:
    at = draw.randrange(len(data))
    return data[:at] + draw.choice(_PIECES) + data[at:]


def _garble(data: bytes, draw: Random) -> bytes:
    at, size = draw.randrange(len(data)), draw.choice((2, 8, 64, 512))
    return data[:at] + draw.randbytes(size) + data[at + size :]


def _renumber(data: bytes, draw: Random) -> bytes:
    found = list(islice(_NUMBER.finditer(data, draw.randrange(len(data))), _MOST_PLACES))
    if not found:
        return _set(data, draw)
    one = draw.choice(found)
    return data[: one.start()] + draw.choice(_NUMBERS) + data[one.end() :]


def _exchange_lines(data: bytes, draw: Random) -> bytes:
    lines = data.split(b"\n")
    i, j = draw.randrange(len(lines)), draw.randrange(len(lines))
    lines[i], lines[j] = lines[j], lines[i]
    return b"\n".join(lines)


def _exchange_values(data: bytes, draw: Random) -> bytes:
    """Put one value of a text where another is: a list for a number, a name for a table."""
    found = list(islice(_VALUE.finditer(data, draw.randrange(len(data))), _MOST_PLACES))
    if not found:
        return _set(data, draw)
    into, other = draw.choice(found), draw.choice(found)
    return data[: into.start()] + other.group() + data[into.end() :]


_WAYS: tuple[Callable[[bytes, Random], bytes], ...] = (
    *(_flip, _set, _cut, _leave_out, _repeat, _put_in, _garble),
    *(_renumber, _renumber, _renumber, _exchange_lines, _exchange_values, _exchange_values),
)


def damaged(data: bytes, draw: Random) -> bytes:
    """Return bytes with damage at one place."""
    return draw.choice(_WAYS)(data, draw) if data else data


def mutated(seeds: Sequence[bytes], draw: Random) -> bytes:
    """Return one of some inputs with damage at one to five places, perhaps crossed with another."""
    data = draw.choice(seeds)
    if draw.random() < 0.1:
        other = draw.choice(seeds)
        data = data[: draw.randrange(len(data) + 1)] + other[draw.randrange(len(other) + 1) :]
    for _ in range(draw.choice((1, 1, 1, 2, 3, 5))):
        data = damaged(data, draw)
    return data[:_MOST_BYTES]
