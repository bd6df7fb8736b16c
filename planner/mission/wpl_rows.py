"""The rows of a ``QGC WPL`` text: cut into fields, converted, each with its place."""

from __future__ import annotations

import re
from dataclasses import dataclass
from io import StringIO
from typing import TYPE_CHECKING, NoReturn

from planner.errors import MissionFileError
from planner.findings import Place
from planner.mission.commands import Command, frame_name, has_location, load_command_table

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
UNSET = frozenset({"nan", "+nan", "-nan", "null", "none", "undefined"})

_NUMBER = re.compile(r"[+-]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_TOKEN = re.compile(r"[^\s,]+")
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")


@dataclass(frozen=True, slots=True, kw_only=True)
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


@dataclass(frozen=True, slots=True, kw_only=True)
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


def _read_row(number: int, line: str, *, source: str) -> tuple[Row, bool]:
    """Return the row of one line, and whether a comment follows it."""
    content, mark, _ = line.partition("#")
    tabbed = [field.strip() for field in content.split("\t")]
    is_tabbed = not mark and len(tabbed) == len(FIELDS) and all(tabbed)
    if len(tabbed) == len(FIELDS):
        for field, name in zip(tabbed, FIELDS, strict=True):
            if _DECIMAL_COMMA.fullmatch(field):
                column = content.index(field) + 1
                msg = f"the {name} is '{field}': write a decimal point, not a comma"
                raise MissionFileError(msg, source=source, place=Place(number, column))

    matches = list(_TOKEN.finditer(content))
    tokens = [match.group() for match in matches]
    columns = [match.start() + 1 for match in matches]
    place = Place(number, columns[0] if columns else 1)
    if len(tokens) < len(FIELDS):
        _refuse_short_row(tokens, place=place, source=source)

    def fail(index: int, expected: str) -> NoReturn:
        msg = f"the {FIELDS[index]} is '{tokens[index][:40]}': expected {expected}"
        raise MissionFileError(msg, source=source, place=Place(number, columns[index]))

    def whole(index: int, most: int) -> int:
        if not _NUMBER.fullmatch(tokens[index]):
            fail(index, f"a whole number from 0 to {most}")
        value = float(tokens[index])
        if not (0 <= value <= most and value.is_integer()):
            fail(index, f"a whole number from 0 to {most}")
        return int(value)

    def real(index: int) -> float | None:
        if tokens[index].lower() in UNSET:
            return None
        if not _NUMBER.fullmatch(tokens[index]):
            fail(index, "a number")
        value = float(tokens[index])
        # MAVLink sends these as 32-bit numbers.
        if abs(value) > 3.4e38:
            fail(index, "a number that MAVLink can send")
        return value

    command = whole(3, 65_535)
    row = Row(
        sequence=whole(0, 2**31 - 1),
        frame=whole(2, 255),
        command=command,
        values=tuple(real(index) for index in range(4, 11)),
        autocontinue=whole(11, 255) != 0,
        place=place,
        extra_fields=len(tokens) - len(FIELDS),
        is_tabbed=is_tabbed,
    )
    whole(1, 2**31 - 1)
    if row.extra_fields:
        _refuse_shifted_row(row, tokens, source=source)
    if has_location(command) or command == 0:
        for index, value, most in ((8, row.values[4], 90.0), (9, row.values[5], 180.0)):
            if value is not None and abs(value) > most:
                hint = " (it looks like degrees × 10⁷)" if abs(value) > 1e5 else ""
                fail(index, f"degrees from −{most:g} to {most:g}{hint}")
    return row, bool(mark)


def _refuse_short_row(tokens: Sequence[str], *, place: Place, source: str) -> NoReturn:
    if len(tokens) == 1:
        msg = f"'{tokens[0][:40]}' is no mission row: expected 12 values"
    else:
        msg = f"the row has {len(tokens)} values, expected 12: {', '.join(FIELDS)}"
    raise MissionFileError(msg, source=source, place=place)


def _refuse_shifted_row(row: Row, tokens: Sequence[str], *, source: str) -> None:
    """Refuse a row with extra fields whose first twelve make no sense: columns are shifted."""
    commands = load_command_table().commands
    known = row.command in commands or row.command >= Command.NAV_WAYPOINT
    sane_frame = not frame_name(row.frame).startswith(("RESERVED", "MAV_FRAME"))
    if not (known and sane_frame and tokens[11] in {"0", "1"}):
        msg = (
            f"the row has {len(tokens)} values, expected 12 ({', '.join(FIELDS)}), "
            "and its first 12 make no sense"
        )
        raise MissionFileError(msg, source=source, place=row.place)
