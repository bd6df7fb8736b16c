"""The rows of a ``QGC WPL`` text: cut into fields, converted, each with its place."""

from __future__ import annotations

import math
import re
from io import StringIO
from typing import TYPE_CHECKING, NoReturn

from planner.errors import MissionFileError
from planner.findings import Place
from planner.frozen import frozen
from planner.mission.commands import (
    GLOBAL_FRAMES,
    frame_name,
    has_location,
    load_command_table,
)

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

FIELDS = (
    "sequence number",
    "current",
    "frame",
    "command",
    "parameter 1",
    "parameter 2",
    "parameter 3",
    "parameter 4",
    "latitude",
    "longitude",
    "altitude",
    "autocontinue",
)
MOST_ROWS = 65_535
"""MISSION_COUNT is a 16-bit number."""
MOST_LINES = 1_000_000
LONGEST_LINE = 10_000
HIGHEST_M = 100_000.0
"""Beyond it an altitude is a mistake. [m]"""
UNSET = frozenset({"nan", "+nan", "-nan", "null", "none", "undefined"})

_LARGEST_FLOAT32 = 3.4e38
"""MAVLink sends parameters as 32-bit numbers."""
_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_TOKEN = re.compile(r"[^\s,]+")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")


@frozen
class Row:
    """One row, converted."""

    sequence: int
    frame: int
    command: int
    values: tuple[float | None, ...]
    """The seven parameters."""
    autocontinue: bool
    place: Place
    extra_fields: int
    """How many fields follow the twelfth."""
    is_tabbed: bool
    """Whether the row is 12 fields between tabs, as QGroundControl wants it."""


@frozen
class RowText:
    """Every row of a text, and what else there was."""

    rows: tuple[Row, ...]
    comment_lines: int
    blank_lines: int


def read_lines(text: str, *, source: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text with their numbers from 1.

    Raises
    ------
    MissionFileError
        If there are more lines, or a line is longer, than any mission has.
    """
    # newline=None: CRLF, CR and LF all end a line, and nothing else does.
    for number, line in enumerate(StringIO(text, newline=None), start=1):
        if number > MOST_LINES:
            msg = f"more than {MOST_LINES:,} lines: no mission is that long"
            raise MissionFileError(msg, source=source)
        if len(line) > LONGEST_LINE:
            msg = f"a line of {len(line):,} characters: no mission row is that long"
            raise MissionFileError(msg, source=source, place=Place(number, 1))
        yield number, line.rstrip("\n")


def is_row(line: str) -> bool:
    """Return whether a line looks like a row: twelve fields that are numbers or unset."""
    tokens = _TOKEN.findall(line[:LONGEST_LINE])
    return len(tokens) >= len(FIELDS) and all(
        _NUMBER.fullmatch(token) or token.lower() in UNSET for token in tokens[: len(FIELDS)]
    )


def read_rows(lines: Iterator[tuple[int, str]], *, source: str) -> RowText:
    """Return the rows of the lines that follow the header.

    Raises
    ------
    MissionFileError
        If a row is broken, with its line and column and what was expected there.
    """
    rows: list[Row] = []
    comments = blanks = 0
    for number, line in lines:
        stripped = line.strip()
        if not stripped:
            blanks += 1
        elif stripped.startswith(("#", "//")):
            comments += 1
        else:
            row, has_comment = _read_row(number, line, source=source)
            comments += has_comment
            rows.append(row)
            if len(rows) > MOST_ROWS:
                msg = f"more than {MOST_ROWS:,} rows: MAVLink can send no more than that"
                raise MissionFileError(msg, source=source, place=row.place)
    return RowText(rows=tuple(rows), comment_lines=comments, blank_lines=blanks)


@frozen
class _Fields:
    """The fields of one line, each with its column."""

    texts: tuple[str, ...]
    columns: tuple[int, ...]
    line: int
    source: str

    @classmethod
    def cut(cls, content: str, *, line: int, source: str) -> _Fields:
        """Return the fields of a line without its comment."""
        matches = list(_TOKEN.finditer(content))
        return cls(
            texts=tuple(match.group() for match in matches),
            columns=tuple(match.start() + 1 for match in matches),
            line=line,
            source=source,
        )

    def place(self, index: int) -> Place:
        """Return where a field stands."""
        return Place(self.line, self.columns[index])

    def refuse(self, index: int, expected: str) -> NoReturn:
        """Raise the error about a field."""
        msg = f"the {FIELDS[index]} is '{self.texts[index][:40]}': expected {expected}"
        raise MissionFileError(msg, source=self.source, place=self.place(index))

    def whole(self, index: int, most: int) -> int:
        """Return a field as a whole number; some programs write it as ``3.0``."""
        text = self.texts[index]
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        # Also refuses NaN.
        if not (0.0 <= value <= most and value.is_integer()):
            self.refuse(index, f"a whole number from 0 to {most}")
        return int(value)

    def real(self, index: int) -> float | None:
        """Return a field as a number, ``None`` where it says that there is none."""
        text = self.texts[index]
        if text.lower() in UNSET:
            return None
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not abs(value) <= _LARGEST_FLOAT32:
            self.refuse(index, "a number")
        return value

    def degrees(self, index: int, most: float) -> None:
        """Refuse a field that is no angle of at most so many degrees."""
        value = self.real(index)
        if value is not None and abs(value) > most:
            hint = " (this looks like degrees × 10⁷)" if abs(value) > 1e5 else ""
            self.refuse(index, f"degrees from −{most:g} to {most:g}{hint}")

    def metres(self, index: int) -> None:
        """Refuse a field that is no altitude anybody flies at."""
        value = self.real(index)
        if value is not None and abs(value) > HIGHEST_M:
            self.refuse(index, f"an altitude within {HIGHEST_M / 1000.0:g} km")


def _read_row(number: int, line: str, *, source: str) -> tuple[Row, bool]:
    """Return the row of one line, and whether a comment follows it."""
    content, mark, _ = line.partition("#")
    tabbed = [field.strip() for field in content.split("\t")]
    _refuse_decimal_comma(tabbed, content, line=number, source=source)
    fields = _Fields.cut(content, line=number, source=source)
    if len(fields.texts) < len(FIELDS):
        _refuse_short_row(fields)
    fields.whole(1, 2**31 - 1)
    row = Row(
        sequence=fields.whole(0, 2**31 - 1),
        frame=fields.whole(2, 255),
        command=fields.whole(3, 65_535),
        values=tuple(fields.real(index) for index in range(4, 11)),
        autocontinue=fields.whole(11, 255) != 0,
        place=fields.place(0),
        extra_fields=len(fields.texts) - len(FIELDS),
        is_tabbed=not mark and len(tabbed) == len(FIELDS) and all(tabbed),
    )
    if row.extra_fields:
        _refuse_shifted_row(row, fields)
    if row.frame in GLOBAL_FRAMES and (has_location(row.command) or row.command == 0):
        fields.degrees(8, 90.0)
        fields.degrees(9, 180.0)
        fields.metres(10)
    return row, bool(mark)


def _refuse_decimal_comma(tabbed: Sequence[str], content: str, *, line: int, source: str) -> None:
    """Refuse a row between whose tabs a number is written with a comma."""
    if len(tabbed) != len(FIELDS):
        return
    for field, name in zip(tabbed, FIELDS, strict=True):
        if _DECIMAL_COMMA.fullmatch(field):
            msg = f"the {name} is '{field}': write a decimal point, not a comma"
            raise MissionFileError(msg, source=source, place=Place(line, content.index(field) + 1))


def _refuse_short_row(fields: _Fields) -> NoReturn:
    if len(fields.texts) == 1:
        msg = f"'{fields.texts[0][:40]}' is no mission row: expected 12 values"
    else:
        msg = f"the row has {len(fields.texts)} values, expected 12: {', '.join(FIELDS)}"
    raise MissionFileError(
        msg,
        source=fields.source,
        place=fields.place(0) if fields.columns else Place(fields.line, 1),
    )


def _refuse_shifted_row(row: Row, fields: _Fields) -> None:
    """Refuse a row with extra fields whose first twelve make no sense: columns are shifted."""
    sane_frame = not frame_name(row.frame).startswith(("RESERVED", "MAV_FRAME"))
    if not (
        row.command in load_command_table().commands
        and sane_frame
        and fields.texts[11] in {"0", "1"}
    ):
        msg = (
            f"the row has {len(fields.texts)} values, expected 12 ({', '.join(FIELDS)}), "
            "and its first 12 make no sense"
        )
        raise MissionFileError(msg, source=fields.source, place=row.place)
