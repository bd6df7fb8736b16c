"""The text format with a ``QGC WPL`` header, in every dialect real files are written in.

Version 110 begins with a home row that is not flown, version 120 has none.  Rows are numbered by
their order, as every loader does; DO_JUMP refers to those numbers.
"""

from __future__ import annotations

import math
import re
from io import StringIO
from itertools import chain
from typing import TYPE_CHECKING, NoReturn

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place, Rule, Severity
from planner.mission.commands import (
    AMSL_FRAMES,
    GLOBAL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    command_name,
    frame_name,
    has_location,
    load_command_table,
)
from planner.mission.formats.fence_items import FENCE_COMMANDS, make_fence, make_rally_points
from planner.mission.items import Home, Mission, MissionFormat, MissionItem
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding


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


class WplRow(Value):
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


class RowText(Value):
    """Every row of a text, and what else there was."""

    rows: tuple[WplRow, ...]
    comment_lines: int
    blank_lines: int


def read_lines(text: str, *, source: str) -> Iterator[tuple[int, str]]:
    """Yield the lines of a text with their numbers from 1."""
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
    """Return the rows of the lines that follow the header."""
    rows: list[WplRow] = []
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


class _Fields(Value):
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
        """Return the place of a field."""
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
        """Return a field as a number, ``None`` where it is unset."""
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


def _read_row(number: int, line: str, *, source: str) -> tuple[WplRow, bool]:
    """Return the row of one line, and whether a comment follows it."""
    content, mark, _ = line.partition("#")
    tabbed = [field.strip() for field in content.split("\t")]
    _refuse_decimal_comma(tabbed, content, line=number, source=source)
    fields = _Fields.cut(content, line=number, source=source)
    if len(fields.texts) < len(FIELDS):
        _refuse_short_row(fields)
    fields.whole(1, 2**31 - 1)
    row = WplRow(
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
        msg = f"'{fields.texts[0][:40]}' is not a mission row: expected 12 values"
    else:
        msg = f"the row has {len(fields.texts)} values, expected 12: {', '.join(FIELDS)}"
    raise MissionFileError(
        msg,
        source=fields.source,
        place=fields.place(0) if fields.columns else Place(fields.line, 1),
    )


def _refuse_shifted_row(row: WplRow, fields: _Fields) -> None:
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


HEADER = "QGC WPL 110"
_HEADER = re.compile(r"QGC[\s,]*WP[\s,]*L[\s,]*(?P<version>.*)", re.IGNORECASE)
_VERSION = re.compile(r"(110|120)[\s,]*")
_TAKEOFFS = frozenset({Command.NAV_TAKEOFF, Command.NAV_VTOL_TAKEOFF})
_AREA_COMMANDS = FENCE_COMMANDS | {Command.NAV_RALLY_POINT}


def has_wpl_header(line: str) -> bool:
    """Return whether a line is the header of this format, in whatever version."""
    return _HEADER.match(line.strip()) is not None


def read_wpl(text: str, *, source: str) -> Mission:
    """Return the mission that a ``QGC WPL`` text holds.

    Parameters
    ----------
    text : str
        The whole file, without a byte order mark.

    Returns
    -------
    Mission
        Fence and rally rows become its fence and rally points, not items.
    """
    lines = read_lines(text, source=source)
    version, first_row, findings = _read_header(lines, source=source)
    content = read_rows(chain(first_row, lines), source=source)
    rows = content.rows

    home: Home | None = None
    first_item = 0
    if version != "120" and rows and rows[0].command not in _AREA_COMMANDS:
        if _is_home(rows):
            home = _make_home(rows[0])
            first_item = 1
        else:
            findings.append(_missing_home(rows[0]))

    # A first row numbered 1 or more has its home row left out, as Mission Planner sees it.
    base = 1 if rows and rows[0].sequence > 0 and version != "120" else 0
    listed = [_make_item(row, jump_id=base + index) for index, row in enumerate(rows)][first_item:]
    items = tuple(item for item in listed if item.command not in _AREA_COMMANDS)
    fence, fence_findings = make_fence(listed)
    home_altitude_amsl_m = None if home is None else home.altitude_amsl_m
    rally, rally_findings = make_rally_points(listed, home_altitude_amsl_m=home_altitude_amsl_m)
    vehicle = vehicle_evidence(items, home_altitude_amsl_m=home_altitude_amsl_m)
    findings += _check_dialect(content, has_header=version is not None)
    findings += _check_rows(rows, base=base)
    findings += [*fence_findings, *rally_findings]
    if len(items) < len(listed):
        areas = tuple(item for item in listed if item.command in _AREA_COMMANDS)
        findings.append(_mixed_areas(areas, has_items=bool(items)))
    return Mission(
        source=source,
        file_format=MissionFormat.WPL,
        items=items,
        home=home,
        autopilot=None,
        vehicle=vehicle,
        fence=fence,
        rally=rally,
        findings=tuple(findings),
        document=text,
    )


TEXT_HEADER = Rule(
    "L150 text-header",
    Severity.WARNING,
    summary="The first line is not exactly 'QGC WPL 110'.",
    why="Loaders compare the first line literally: one that differs is refused or read in another "
    "dialect (pymavlink and MAVSDK do not support 120, QGroundControl splits the line at blanks).",
    how="The first line is compared with 'QGC WPL 110'.",
    fix="make 'QGC WPL 110' the first line, or save the mission again with a ground station",
)


def _read_header(
    lines: Iterator[tuple[int, str]], *, source: str
) -> tuple[str | None, list[tuple[int, str]], list[Finding]]:
    """Read up to the header, or to the first row of a file that has none.

    Returns the version or ``None``, that first row if there is no header, and what is odd.
    """
    for number, line in lines:
        stripped = line.strip()
        if not stripped or stripped.startswith("#"):
            continue
        place = Place(number, len(line) - len(line.lstrip()) + 1)
        match = _HEADER.match(stripped)
        if match is None:
            if not is_row(line):
                msg = f"expected the header '{HEADER}', found '{stripped[:40]}'"
                raise MissionFileError(msg, source=source, place=place)
            message = f"there is no header: read as {HEADER}, other loaders refuse the file"
            return None, [(number, line)], [TEXT_HEADER.finding(message, place=place)]
        version = _VERSION.fullmatch(match["version"])
        if version is None:
            _refuse_version(match["version"], source=source, place=place)
        if version[1] == "120":
            message = "version 120 has no home row and is read by QGroundControl alone"
        elif stripped != HEADER:
            message = f"the header is {stripped[:40]!r}: read as {HEADER}, other loaders refuse it"
        elif line != HEADER:
            message = "there are blanks around the header: QGroundControl refuses the file"
        elif number > 1:
            message = f"the header is in line {number}: other loaders want it in the first"
        else:
            return version[1], [], []
        return version[1], [], [TEXT_HEADER.finding(message, place=place)]
    msg = "the file holds no mission rows"
    raise MissionFileError(msg, source=source)


def _refuse_version(version: str, *, source: str, place: Place) -> NoReturn:
    """Refuse a version of the header that is not read here."""
    if version.upper().startswith("PB"):
        msg = "QGC WPL PB is pymavlink's protobuf form: save it as QGC WPL 110 with MAVProxy"
    elif version.startswith("100"):
        msg = "QGC WPL 100 has other columns: save it as QGC WPL 110 with MAVProxy"
    else:
        msg = f"the version is '{version[:20]}', expected QGC WPL 110 or 120"
    raise MissionFileError(msg, source=source, place=place)


def _is_home(rows: Sequence[WplRow]) -> bool:
    """Return whether the first row of a version 110 file is home; the rule L152 explains it."""
    first = rows[0]
    if first.sequence != 0 or first.command not in {0, Command.NAV_WAYPOINT}:
        return False
    if first.command == 0 or first.frame in AMSL_FRAMES or not first.values[6]:
        return True
    return len(rows) > 1 and rows[1].command in _TAKEOFFS


def _make_home(row: WplRow) -> Home | None:
    """Return the home of a home row; 0, 0 is how Mission Planner writes that it knows none."""
    *_, latitude_deg, longitude_deg, altitude_m = row.values
    if latitude_deg is None or longitude_deg is None or (latitude_deg == longitude_deg == 0.0):
        return None
    return Home(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=altitude_m if row.frame in AMSL_FRAMES else None,
    )


TEXT_NO_HOME_ROW = Rule(
    "L152 text-no-home-row",
    Severity.WARNING,
    summary="The first row is not a home position, but most loaders take it for one.",
    why="Version 110 files begin with home.  Where a script wrote the take-off there, QGroundControl "
    "takes it as home and ArduPilot overwrites it: the take-off is never flown.  MAVSDK uploads it to "
    "PX4, and for ArduPilot adds a copy of it before it.",
    how="The first row is home if it is a NAV_WAYPOINT (or command 0) with sequence number 0 whose "
    "altitude is AMSL or zero, or which comes before a take-off; anything else is flown.",
    fix="put a home row before it: sequence 0, frame 0, command 16, altitude AMSL",
)


def _missing_home(row: WplRow) -> Finding:
    name = command_name(row.command)
    if row.command == Command.NAV_WAYPOINT and row.sequence == 0:
        name += f" {row.values[6]:g} m above home" if row.frame in RELATIVE_FRAMES else ""
    swallowed = (
        "QGroundControl takes it as home and drops it, ArduPilot overwrites it with its own home"
    )
    if row.sequence > 0:
        swallowed += ", Mission Planner puts a blank home before it"
    message = (
        f"the first row is {name}, sequence {row.sequence}, and not home: flown here as item 1; "
        + swallowed
    )
    return TEXT_NO_HOME_ROW.finding(message, item=1, place=row.place)


def _make_item(row: WplRow, *, jump_id: int) -> MissionItem:
    p1, p2, p3, p4, p5, p6, p7 = row.values
    return MissionItem(
        row.command,
        row.frame,
        *(p1, p2, p3, p4, p5, p6, p7),
        autocontinue=row.autocontinue,
        jump_id=jump_id,
        place=row.place,
    )


TEXT_DIALECT = Rule(
    "L151 text-dialect",
    Severity.INFO,
    summary="The file is written in a dialect that not every loader reads.",
    why="QGroundControl wants exactly 12 fields between tabs and no comments or blank lines, "
    "pymavlink any white space, Mission Planner also commas; the others refuse the whole file.",
    how="Each row is cut at tabs alone; rows that do not give 12 fields, and other lines, count.",
    fix="save the mission again with the ground station that will upload it",
)


def _check_dialect(content: RowText, *, has_header: bool) -> list[Finding]:
    """Return what QGroundControl would refuse about the way the rows are written."""
    untabbed = [row for row in content.rows if not row.is_tabbed and not row.extra_fields]
    reasons = []
    if untabbed:
        first = untabbed[0].place.line
        reasons.append(
            f"not 12 fields between tabs in {quantity.count(len(untabbed), 'row')} (first in line {first})"
        )
    if content.comment_lines:
        reasons.append(f"{quantity.count(content.comment_lines, 'comment')}")
    if content.blank_lines:
        reasons.append(f"{quantity.count(content.blank_lines, 'blank line')}")
    if not reasons or not has_header:
        return []
    message = f"QGroundControl refuses this file: {', '.join(reasons)}"
    return [TEXT_DIALECT.finding(message, place=untabbed[0].place if untabbed else None)]


TEXT_SEQUENCE = Rule(
    "L153 text-sequence",
    Severity.WARNING,
    summary="Sequence numbers are repeated or missing.",
    why="Every loader renumbers the rows in the order of the file, so a DO_JUMP goes to another row "
    "than its author meant.",
    how="Each row's number is compared with its place in the file; a warning only with a DO_JUMP.",
    fix="number the rows from 0 without gaps",
)

TEXT_UNSET_VALUE = Rule(
    "L154 text-unset-value",
    Severity.INFO,
    summary="Values are written as 'nan' or 'null'.",
    why="They are read as 'not specified'.  Mission Planner leaves rows with such a word out, "
    "pymavlink refuses 'null', QGroundControl reads it as 0; M112 reports what ArduPilot refuses of "
    "them at upload.",
    how="Counts the fields that hold such a word.",
    fix="write 0 where the autopilot is ArduPilot",
)

TEXT_EXTRA_COLUMNS = Rule(
    "L155 text-extra-columns",
    Severity.WARNING,
    summary="Rows have more than the format's 12 fields.",
    why="QGroundControl and pymavlink refuse such a file; the meaning of the extra fields is unknown.",
    how="Rows whose first 12 fields make sense are read, the rest of the row is left out.",
    fix="delete the extra fields, and make sure that the first 12 are what you mean",
)

TEXT_TERRAIN_ROWS = Rule(
    "L160 text-terrain-rows",
    Severity.WARNING,
    summary="Text rows have altitudes above terrain, which loaders get wrong.",
    why="QGroundControl shows them as AMSL when it imports text (#10596), and importers of MAVSDK "
    "before version 4 left their positions unscaled.",
    how="Counts rows in frames 10 and 11.",
    fix="upload such a file with Mission Planner or MAVProxy, or save it as a plan",
)


def _check_rows(rows: Sequence[WplRow], *, base: int) -> list[Finding]:
    """Return what loaders misread about the content of the rows, one finding per trap."""
    findings: list[Finding] = []

    def report(rule: Rule, affected: Sequence[WplRow], message: str) -> None:
        if affected:
            where = f" (first in line {affected[0].place.line})"
            findings.append(
                rule.finding(
                    f"{quantity.count(len(affected), 'row')} {message}{where}",
                    place=affected[0].place,
                )
            )

    report(
        TEXT_UNSET_VALUE,
        [row for row in rows if None in row.values],
        "with 'nan' or 'null': read as not specified",
    )
    report(
        TEXT_EXTRA_COLUMNS,
        [row for row in rows if row.extra_fields],
        "with more than 12 fields: the rest is left out",
    )
    report(
        TEXT_TERRAIN_ROWS,
        [row for row in rows if row.frame in TERRAIN_FRAMES],
        "above terrain: QGroundControl imports them as AMSL",
    )
    misnumbered = [
        (row, number) for number, row in enumerate(rows, start=base) if row.sequence != number
    ]
    if misnumbered:
        row, expected = misnumbered[0]
        jumps = any(other.command == Command.DO_JUMP for other in rows)
        message = (
            f"{quantity.count(len(misnumbered), 'row')} out of sequence, first {row.sequence} where "
            f"{expected} is due: rows are numbered by their order"
            + (", and DO_JUMP goes by that order" if jumps else "")
        )
        severity = Severity.WARNING if jumps else Severity.INFO
        findings.append(TEXT_SEQUENCE.finding(message, place=row.place, severity=severity))
    return findings


TEXT_FENCE_ROWS = Rule(
    "L156 text-fence-rows",
    Severity.ERROR,
    summary="Fence or rally rows are among the items of a mission.",
    why="They belong to lists of their own: an autopilot refuses them inside a mission, and with them "
    "the whole upload, or flies without the fence.",
    how="Counts rows with commands 5000 to 5004 and 5100 in a file that also holds mission items.",
    fix="save fence and rally points in files of their own",
)

TEXT_NO_MISSION = Rule(
    "L157 text-no-mission",
    Severity.INFO,
    summary="The file holds a fence or rally points and no mission.",
    why="It has nothing to fly: probably the wrong file was given.",
    how="Every row is a fence or rally row, or the file is ArduPilot's old list of points.",
    fix="give the mission file",
)


def _mixed_areas(areas: Sequence[MissionItem], *, has_items: bool) -> Finding:
    """Return the finding about fence and rally rows, alone or inside a mission."""
    rally = sum(item.command == Command.NAV_RALLY_POINT for item in areas)
    parts = [f"{quantity.count(len(areas) - rally, 'fence row')}"] if len(areas) > rally else []
    if rally:
        parts.append(f"{quantity.count(rally, 'rally row')}")
    what = " and ".join(parts)
    if not has_items:
        return TEXT_NO_MISSION.finding(
            f"the file holds {what} and no mission", place=areas[0].place
        )
    message = f"{what} inside the mission: checked as fence and rally, refused as mission items"
    return TEXT_FENCE_ROWS.finding(message, place=areas[0].place)
