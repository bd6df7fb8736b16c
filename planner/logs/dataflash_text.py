"""Reader of DataFlash logs written out as text (``.log``): a message a line.

The name, then the fields, with commas between; FMT lines define the names of the fields.  Numbers
are written in whole units already.
"""

from __future__ import annotations

from array import array
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from planner.logs.dataflash_messages import (
    WANTED,
    DataflashLog,
    MessageFormat,
    MessageTable,
    message_format,
)

if TYPE_CHECKING:
    from mmap import mmap

MAGIC = b"FMT, "
"""The first bytes: the first line defines FMT itself."""

_TEXT_LETTERS = frozenset("nNZM")
"""Format letters of texts; modes are written as numbers or by name."""


@dataclass(slots=True)
class _Rows:
    """The lines of one message so far."""

    message: MessageFormat
    wanted: tuple[tuple[int, str, bool], ...]
    """Number, name and whether it is text, of each field wanted."""
    places: array[int] = field(default_factory=lambda: array("q"))
    numbers: dict[str, array[float]] = field(default_factory=dict)
    texts: dict[str, list[str]] = field(default_factory=dict)


def read_text(data: mmap) -> DataflashLog:
    """Return the wanted messages of a DataFlash log in text.

    Parameters
    ----------
    data : mmap
        The file.

    Returns
    -------
    DataflashLog
        Empty where the file holds no message.
    """
    rows: dict[bytes, _Rows] = {}
    unreadable = 0
    first_unreadable: int | None = None
    number = 0
    while line := data.readline():
        number += 1
        name = line[: line.find(b",")].strip()
        if name == b"FMT":
            _define(line.decode("latin-1"), rows)
        elif name in rows and not _add(line.decode("latin-1"), number, rows[name]):
            unreadable += 1
            first_unreadable = first_unreadable or number
    return DataflashLog(
        tables={text.message.name: _table(text) for text in rows.values() if len(text.places)},
        size=number,
        unit="lines",
        unreadable=unreadable,
        first_unreadable=first_unreadable,
    )


def _define(line: str, rows: dict[bytes, _Rows]) -> None:
    parts = line.split(",", 5)
    if len(parts) < 6:
        return
    message = message_format(parts[3], parts[4], parts[5])
    key = message.name.encode("latin-1")
    if message.name not in WANTED or len(message.fields) != len(message.letters) or key in rows:
        return
    wanted = tuple(
        (number, name, letter in _TEXT_LETTERS)
        for number, (name, letter) in enumerate(zip(message.fields, message.letters, strict=True))
        if name in WANTED[message.name]
    )
    rows[key] = _Rows(
        message=message,
        wanted=wanted,
        numbers={name: array("d") for _, name, is_text in wanted if not is_text},
        texts={name: [] for _, name, is_text in wanted if is_text},
    )


def _add(line: str, place: int, rows: _Rows) -> bool:
    """Add a line; return whether it is what its FMT says."""
    count = len(rows.message.fields)
    parts = line.split(",", count)[1:]
    if len(parts) != count:
        return False
    try:
        numbers = [float(parts[number]) for number, _, is_text in rows.wanted if not is_text]
    except ValueError:
        return False
    for values, value in zip(rows.numbers.values(), numbers, strict=True):
        values.append(value)
    for number, name, is_text in rows.wanted:
        if is_text:
            rows.texts[name].append(parts[number].strip())
    rows.places.append(place)
    return True


def _table(rows: _Rows) -> MessageTable:
    return MessageTable(
        message=rows.message,
        places=np.array(rows.places, np.int64),
        numbers={name: np.array(values, np.float64) for name, values in rows.numbers.items()},
        texts={name: tuple(texts) for name, texts in rows.texts.items()},
    )
