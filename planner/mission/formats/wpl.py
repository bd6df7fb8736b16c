"""Mission text: rows after a ``QGC WPL`` header in every dialect real files are written in, and older lists.

Version 110 begins with a home row that is not flown, version 120 has none.  Rows are numbered by
their order, as every loader does; DO_JUMP refers to those numbers.  ArduPilot's older lists have a
line "latitude longitude" for each point of a fence, "RALLY …" for each rally point.
"""

from __future__ import annotations

import math
import re
from functools import lru_cache
from io import StringIO
from itertools import chain
from typing import TYPE_CHECKING, NoReturn

from planner import quantity
from planner.errors import MissionFileError
from planner.findings import Place, Remarks, Rule, Severity
from planner.geo.fence import Fence, FencePolygon, RallyPoint
from planner.mission.commands import (
    AMSL_FRAMES,
    GLOBAL_FRAMES,
    RELATIVE_FRAMES,
    TAKEOFFS,
    TERRAIN_FRAMES,
    Command,
    command_name,
    frame_name,
    has_location,
    load_command_table,
)
from planner.mission.formats.fence_items import (
    FENCE_COMMANDS,
    FENCE_ITEM_BROKEN,
    encloses_area,
    make_fence,
    make_rally_points,
)
from planner.mission.items import MOST_ITEMS, Home, Mission, MissionFormat, MissionItem
from planner.mission.vehicle_kind import vehicle_evidence
from planner.values import Value, replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Sequence

    from planner.findings import Finding


FIELDS = (
    *("sequence number", "current", "frame", "command"),
    *("parameter 1", "parameter 2", "parameter 3", "parameter 4"),
    *("latitude", "longitude", "altitude", "autocontinue"),
)
MOST_LINES = 1_000_000
LONGEST_LINE = 10_000
UNSET = frozenset({"nan", "+nan", "-nan", "null", "none", "undefined"})

_EXPECTED = f"expected 12 ({', '.join(FIELDS)})"
_DEGREES = "degrees from -{0:g} to {0:g}"
_PARAMETER = (3.4e38, "a number")
"""MAVLink sends parameters as 32-bit numbers."""
_LIMITS = (_PARAMETER,) * 7
_LIMITS_OF_A_PLACE = (
    *(_PARAMETER,) * 4,
    *((90.0, _DEGREES), (180.0, _DEGREES), (100_000.0, "an altitude within 100 km")),
)
"""Beyond these a latitude [°], longitude [°] or altitude [m] is a mistake."""
_MOST_OF_A_BYTE, _MOST_COMMAND = 255, 65_535
_NUMBER = re.compile(r"[+-]?(?:[0-9]+(?:\.[0-9]*)?|\.[0-9]+)(?:[eE][+-]?[0-9]{1,4})?")
_TOKEN = re.compile(r"[^\s,]+")
_CLEAN_WHOLE, _CLEAN_REAL = r"([0-9]{1,9})", r"(-?[0-9]{1,30}(?:\.[0-9]+)?)"
_CLEAN_PARAMETER = _CLEAN_REAL.replace("(", "(nan|", 1)
_CLEAN_ROW = re.compile(
    "\t".join([*[_CLEAN_WHOLE] * 4, *[_CLEAN_PARAMETER] * 4, *[_CLEAN_REAL] * 3, _CLEAN_WHOLE])
)
"""A row as ground stations write it, read at once; whatever else may be a row is read field by field."""
_DECIMAL_COMMA = re.compile(r"[+-]?[0-9]+,[0-9]+")


class WplRow(Value, gc=False):
    """One row, converted."""

    sequence: int
    item: MissionItem
    """Still without its number."""
    place: Place
    extra_fields: int
    """How many fields follow the twelfth."""
    has_unset: bool
    is_tabbed: bool
    """Whether the row is 12 fields between tabs, as QGroundControl wants it."""


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


def _read_rows(
    lines: Iterator[tuple[int, str]], *, source: str
) -> tuple[list[WplRow], dict[str, int]]:
    """Return the rows of the lines that follow the header, and how many other lines there are."""
    rows: list[WplRow] = []
    others = {"comment": 0, "blank line": 0}
    for number, line in lines:
        row = _read_clean_row(number, line)
        if row is None:
            stripped = line.strip()
            if not stripped:
                others["blank line"] += 1
                continue
            content, mark, _ = line.partition("#")
            others["comment"] += bool(mark) or stripped.startswith("//")
            if stripped.startswith(("#", "//")):
                continue
            row = _read_row(number, content, is_whole_line=not mark, source=source)
        rows.append(row)
        if len(rows) > MOST_ITEMS:
            msg = f"more than {MOST_ITEMS:,} rows: MAVLink can send no more than that"
            raise MissionFileError(msg, source=source, place=row.place)
    return rows, others


class _Fields(Value):
    """The fields of one line without its comment."""

    content: str
    texts: list[str]
    line: int
    source: str

    def refuse(self, message: str, index: int = 0) -> NoReturn:
        """Raise the error about a field, or the whole line."""
        raise MissionFileError(message, source=self.source, place=self.place(index))

    def place(self, index: int = 0) -> Place:
        """Return where a field begins."""
        columns = [match.start() + 1 for match in _TOKEN.finditer(self.content)] or [1]
        return Place(self.line, columns[index])

    def _refuse_value(self, index: int, expected: str) -> NoReturn:
        found = self.texts[index][:40]
        self.refuse(f"the {FIELDS[index]} is '{found}': expected {expected}", index)

    def whole(self, index: int, most: int) -> int:
        """Return a field as a whole number; some programs write it as ``3.0``."""
        text = self.texts[index]
        value = float(text) if _NUMBER.fullmatch(text) else math.nan
        if not (0.0 <= value <= most and value.is_integer()):  # also refuses NaN
            self._refuse_value(index, f"a whole number from 0 to {most}")
        return int(value)

    def real(self, index: int, most: float, expected: str) -> float | None:
        """Return a field as a number of at most some size, ``None`` where it is unset."""
        text = self.texts[index]
        if not _NUMBER.fullmatch(text):
            if text.lower() not in UNSET:
                self._refuse_value(index, "a number")
            return None
        value = float(text)
        if abs(value) > most:
            is_scaled = expected is _DEGREES and abs(value) > 1e5
            hint = " (this looks like degrees × 10⁷)" if is_scaled else ""
            self._refuse_value(index, expected.format(most) + hint)
        return value


def _read_clean_row(line: int, content: str) -> WplRow | None:
    """Return a row as ground stations write it; ``None``: it is another, or a value is out of range."""
    match = _CLEAN_ROW.fullmatch(content)
    if match is None:
        return None
    first, _, second, third, a, b, c, d, x, y, z, last = match.groups()
    frame, command, autocontinue = int(second), int(third), int(last)
    if frame > _MOST_OF_A_BYTE or command > _MOST_COMMAND or autocontinue > _MOST_OF_A_BYTE:
        return None
    p5, p6, p7 = float(x), float(y), float(z)
    most_5, most_6, most_7 = _most_of_a_place(frame, command)
    if not (-most_5 <= p5 <= most_5 and -most_6 <= p6 <= most_6 and -most_7 <= p7 <= most_7):
        return None
    p1 = None if a == "nan" else float(a)
    p2 = None if b == "nan" else float(b)
    p3 = None if c == "nan" else float(c)
    p4 = None if d == "nan" else float(d)
    place = Place(line, 1)
    return WplRow(
        sequence=int(first),
        item=MissionItem(
            command, frame, p1, p2, p3, p4, p5, p6, p7, autocontinue != 0, place=place
        ),
        place=place,
        extra_fields=0,
        has_unset=None in (p1, p2, p3, p4),
        is_tabbed=True,
    )


@lru_cache
def _most_of_a_place(frame: int, command: int) -> tuple[float, ...]:
    """Return how large the last three of the values of an item may be."""
    return tuple(most for most, _ in _limits(frame, command)[4:])


def _limits(frame: int, command: int) -> tuple[tuple[float, str], ...]:
    """Return how large each of the seven values of an item may be."""
    is_place = frame in GLOBAL_FRAMES and (has_location(command) or command == 0)
    return _LIMITS_OF_A_PLACE if is_place else _LIMITS


def _read_row(line: int, content: str, *, is_whole_line: bool, source: str) -> WplRow:
    tabbed = [field.strip() for field in content.split("\t")]
    fields = _Fields(content=content, texts=_TOKEN.findall(content), line=line, source=source)
    texts = fields.texts
    if len(tabbed) == len(FIELDS) and "," in content:
        _refuse_decimal_comma(tabbed, fields)
    if len(texts) < len(FIELDS):
        what = f"the row has {len(texts)} values, {_EXPECTED}"
        if len(texts) == 1:
            what = f"'{texts[0][:40]}' is not a mission row: expected 12 values"
        fields.refuse(what)
    fields.whole(1, 2**31 - 1)
    sequence, frame, command = (
        fields.whole(0, 2**31 - 1),
        fields.whole(2, _MOST_OF_A_BYTE),
        fields.whole(3, _MOST_COMMAND),
    )
    autocontinue = fields.whole(11, _MOST_OF_A_BYTE) != 0
    if len(texts) > len(FIELDS) and (  # with extra fields the columns may be shifted
        command not in load_command_table().commands
        or frame_name(frame).startswith(("RESERVED", "MAV_FRAME"))
        or texts[11] not in {"0", "1"}
    ):
        fields.refuse(
            f"the row has {len(texts)} values, {_EXPECTED}, and its first 12 make no sense"
        )
    limits = _limits(frame, command)
    values = [fields.real(index, *limit) for index, limit in enumerate(limits, start=4)]
    p1, p2, p3, p4, p5, p6, p7 = values
    place = Place(line, content.index(texts[0]) + 1)
    return WplRow(
        sequence=sequence,
        item=MissionItem(command, frame, p1, p2, p3, p4, p5, p6, p7, autocontinue, place=place),
        place=place,
        extra_fields=len(texts) - len(FIELDS),
        has_unset=None in values,
        is_tabbed=is_whole_line and len(tabbed) == len(FIELDS) and all(tabbed),
    )


def _refuse_decimal_comma(tabbed: Sequence[str], fields: _Fields) -> None:
    for name, field in zip(FIELDS, tabbed, strict=True):
        if _DECIMAL_COMMA.fullmatch(field):
            msg = f"the {name} is '{field}': write a decimal point, not a comma"
            place = Place(fields.line, fields.content.index(field) + 1)
            raise MissionFileError(msg, source=fields.source, place=place)


HEADER = "QGC WPL 110"
_HEADER = re.compile(r"QGC[\s,]*WP[\s,]*L[\s,]*(?P<version>.*)", re.IGNORECASE)
_VERSION = re.compile(r"(110|120)[\s,]*")
_AREA_COMMANDS = FENCE_COMMANDS | {Command.NAV_RALLY_POINT}


def has_wpl_header(line: str) -> bool:
    """Return whether a line is the header of this format, in whatever version."""
    return _HEADER.match(line.strip()) is not None


def read_wpl(text: str, *, source: str) -> Mission:
    """Return the mission that a ``QGC WPL`` text without a byte order mark holds.

    Fence and rally rows become its fence and rally points, not items.
    """
    lines = read_lines(text, source=source)
    remarks = Remarks()
    version, first_row = _read_header(lines, remarks, source=source)
    rows, others = _read_rows(chain(first_row, lines), source=source)
    home: Home | None = None
    first_item = 0
    if version != "120" and rows and rows[0].item.command not in _AREA_COMMANDS:
        if _is_home(rows):
            home = _make_home(rows[0].item)
            first_item = 1
        else:
            _report_missing_home(rows[0], remarks)
    # A first row numbered 1 or more has its home row left out, as Mission Planner sees it.
    base = 1 if rows and rows[0].sequence > 0 and version != "120" else 0
    listed = [replace(row.item, jump_id=n) for n, row in enumerate(rows, start=base)][first_item:]
    items = tuple(item for item in listed if item.command not in _AREA_COMMANDS)
    home_altitude_amsl_m = None if home is None else home.altitude_amsl_m
    if version is not None:
        _check_dialect(rows, others, remarks)
    _check_rows(rows, base, remarks)
    fence, about_fence = make_fence(listed)
    rally, about_rally = make_rally_points(listed, home_altitude_amsl_m=home_altitude_amsl_m)
    areas = [item for item in listed if item.command in _AREA_COMMANDS]
    about_areas = [_mixed_areas(areas, has_items=bool(items))] if areas else []
    return Mission(
        source=source,
        file_format=MissionFormat.WPL,
        items=items,
        home=home,
        vehicle=vehicle_evidence(items, home_altitude_amsl_m=home_altitude_amsl_m),
        fence=fence,
        rally=rally,
        findings=(*remarks.findings(), *about_fence, *about_rally, *about_areas),
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
    lines: Iterator[tuple[int, str]], remarks: Remarks, *, source: str
) -> tuple[str | None, list[tuple[int, str]]]:
    """Return the version of the header, or ``None`` and the first row of a text that has none."""
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
            remarks.add(TEXT_HEADER, message, place=place)
            return None, [(number, line)]
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
            return version[1], []
        remarks.add(TEXT_HEADER, message, place=place)
        return version[1], []
    msg = "the file holds no mission rows"
    raise MissionFileError(msg, source=source)


def _refuse_version(version: str, *, source: str, place: Place) -> NoReturn:
    if version.upper().startswith("PB"):
        msg = "QGC WPL PB is pymavlink's protobuf form: save it as QGC WPL 110 with MAVProxy"
    elif version.startswith("100"):
        msg = "QGC WPL 100 has other columns: save it as QGC WPL 110 with MAVProxy"
    else:
        msg = f"the version is '{version[:20]}', expected QGC WPL 110 or 120"
    raise MissionFileError(msg, source=source, place=place)


def _is_home(rows: Sequence[WplRow]) -> bool:
    """Return whether the first row of a version 110 file is home; the rule L152 explains it."""
    first = rows[0].item
    if rows[0].sequence != 0 or first.command not in {0, Command.NAV_WAYPOINT}:
        return False
    if first.command == 0 or first.frame in AMSL_FRAMES or not first.altitude_m:
        return True
    return len(rows) > 1 and rows[1].item.command in TAKEOFFS


def _make_home(row: MissionItem) -> Home | None:
    """Return the home of a home row; 0, 0 is how Mission Planner writes that it knows none."""
    if row.latitude_deg is None or row.longitude_deg is None:
        return None
    if row.latitude_deg == row.longitude_deg == 0.0:
        return None
    altitude_m = row.altitude_m if row.frame in AMSL_FRAMES else None
    return Home(row.latitude_deg, row.longitude_deg, altitude_m)


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


def _report_missing_home(row: WplRow, remarks: Remarks) -> None:
    item = row.item
    name = command_name(item.command)
    if item.command == Command.NAV_WAYPOINT and row.sequence == 0 and item.frame in RELATIVE_FRAMES:
        name += f" {item.altitude_m:g} m above home"
    planner = ", Mission Planner puts a blank home before it" if row.sequence > 0 else ""
    message = (
        f"the first row is {name}, sequence {row.sequence}, and not home: flown here as item 1; "
        "QGroundControl takes it as home and drops it, ArduPilot overwrites it with its own home"
    )
    remarks.add(TEXT_NO_HOME_ROW, message + planner, item=1, place=row.place)


TEXT_DIALECT = Rule(
    "L151 text-dialect",
    Severity.INFO,
    summary="The file is written in a dialect that not every loader reads.",
    why="QGroundControl wants exactly 12 fields between tabs and no comments or blank lines, "
    "pymavlink any white space, Mission Planner also commas; the others refuse the whole file.",
    how="Each row is cut at tabs alone; rows that do not give 12 fields, and other lines, count.",
    fix="save the mission again with the ground station that will upload it",
)


def _check_dialect(rows: Sequence[WplRow], others: dict[str, int], remarks: Remarks) -> None:
    """Report what QGroundControl would refuse about the way the rows are written."""
    untabbed = [row.place for row in rows if not row.is_tabbed and not row.extra_fields]
    reasons = []
    if untabbed:
        count, first = quantity.count(len(untabbed), "row"), untabbed[0].line
        reasons.append(f"not 12 fields between tabs in {count} (first in line {first})")
    reasons += [quantity.count(count, what) for what, count in others.items() if count]
    if reasons:
        message = f"QGroundControl refuses this file: {', '.join(reasons)}"
        remarks.add(TEXT_DIALECT, message, place=untabbed[0] if untabbed else None)


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


_TRAPS: tuple[tuple[Rule, Callable[[WplRow], bool], str], ...] = (
    (TEXT_UNSET_VALUE, lambda row: row.has_unset, "with 'nan' or 'null': read as not specified"),
    (
        TEXT_EXTRA_COLUMNS,
        lambda row: row.extra_fields > 0,
        "with more than 12 fields: the rest is left out",
    ),
    (
        TEXT_TERRAIN_ROWS,
        lambda row: row.item.frame in TERRAIN_FRAMES,
        "above terrain: QGroundControl imports them as AMSL",
    ),
)
"""Rows whose content loaders misread: by which rule, which they are, and what is reported."""


def _check_rows(rows: Sequence[WplRow], base: int, remarks: Remarks) -> None:
    """Report what loaders misread about the rows, one finding per trap."""
    for rule, is_affected, what in _TRAPS:
        affected = [row.place for row in rows if is_affected(row)]
        if affected:
            where = f"(first in line {affected[0].line})"
            message = f"{quantity.count(len(affected), 'row')} {what} {where}"
            remarks.add(rule, message, place=affected[0])
    misnumbered = [(row, n) for n, row in enumerate(rows, start=base) if row.sequence != n]
    if misnumbered:
        row, expected = misnumbered[0]
        jumps = any(other.item.command == Command.DO_JUMP for other in rows)
        message = (
            f"{quantity.count(len(misnumbered), 'row')} out of sequence, first {row.sequence} where "
            f"{expected} is due: rows are numbered by their order"
            + (", and DO_JUMP goes by that order" if jumps else "")
        )
        severity = Severity.WARNING if jumps else Severity.INFO
        remarks.add(TEXT_SEQUENCE, message, place=row.place, severity=severity)


TEXT_FENCE_ROWS = Rule(
    "L156 text-fence-rows",
    Severity.ERROR,
    summary="Fence or rally rows are among the items of a mission.",
    why="They belong to lists of their own: an autopilot refuses them inside a mission, and with them "
    "the whole upload, or flies without the fence.",
    how="Counts rows with commands 5000 to 5004 and 5100 in a file that also holds mission items.",
    fix="save fence and rally points in files of their own",
    instead="a fence in a file of its own",
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
    counts = {"fence row": len(areas) - rally, "rally row": rally}
    what = " and ".join(quantity.count(count, row) for row, count in counts.items() if count)
    if not has_items:
        return TEXT_NO_MISSION.finding(
            f"the file holds {what} and no mission", place=areas[0].place
        )
    message = f"{what} inside the mission: checked as fence and rally, refused as mission items"
    return TEXT_FENCE_ROWS.finding(message, place=areas[0].place)


_FENCE_LINE = re.compile(r"[+-]?\d+(?:\.\d*)?[\s,]+[+-]?\d+(?:\.\d*)?")
_RALLY_LINE = re.compile(r"RALLY\s", re.IGNORECASE)


def is_fence_line(line: str) -> bool:
    """Return whether a line is one point of an old fence list."""
    return _FENCE_LINE.fullmatch(line.strip()) is not None


def is_rally_line(line: str) -> bool:
    """Return whether a line is one point of an old rally list."""
    return _RALLY_LINE.match(line.strip()) is not None


def read_fence_list(text: str, *, source: str) -> Mission:
    """Return a mission without items whose fence is the listed one.

    The first point is where to return to after a breach, the others are the vertices of one
    inclusion polygon, whose last point repeats the first (pymavlink's ``MAVFenceLoader``).
    """
    points: list[tuple[float, float]] = []
    places: list[Place] = []
    for fields in _read_fields(text, source=source):
        if len(fields.texts) != 2:
            values = quantity.count(len(fields.texts), "value")
            fields.refuse(f"the line has {values}, expected a latitude and a longitude")
        points.append(_read_position(fields, 0))
        places.append(fields.place())
    remarks = Remarks()
    vertices = points[1:]
    if len(vertices) >= 2 and vertices[0] == vertices[-1]:
        vertices.pop()
    else:
        message = "the fence is not closed: its last point does not repeat the second line"
        remarks.add(FENCE_ITEM_BROKEN, message, place=places[-1])
    polygons: tuple[FencePolygon, ...] = ()
    if encloses_area("the fence", vertices, remarks, places[0]):
        polygon = FencePolygon(inclusion=True, vertices_deg=tuple(vertices), place=places[1])
        polygons = (polygon,)
    what = f"a fence of {quantity.count(len(vertices), 'vertex', 'vertices')}"
    fence = Fence(polygons=polygons, breach_return_deg_m=(*points[0], None))
    return _without_items(text, what, remarks, fence=fence, source=source)


def read_rally_list(text: str, *, source: str) -> Mission:
    """Return a mission without items with the listed rally points.

    A line is ``RALLY latitude longitude altitude break-altitude land-direction flags``, the
    altitude in metres above home.
    """
    points: list[RallyPoint] = []
    for fields in _read_fields(text, source=source):
        if not is_rally_line(" ".join(fields.texts) + " ") or len(fields.texts) != 7:
            expected = "'RALLY latitude longitude altitude break-altitude direction flags'"
            fields.refuse(f"expected {expected}")
        place_deg = _read_position(fields, 1)
        points.append(RallyPoint(*place_deg, _read_number(fields, 3), fields.place()))
    what = quantity.count(len(points), "rally point")
    return _without_items(text, what, Remarks(), rally=tuple(points), source=source)


def _read_fields(text: str, *, source: str) -> list[_Fields]:
    """Return the fields of every line that is not blank and no comment."""
    found = []
    for number, line in read_lines(text, source=source):
        content = line.strip()
        if content and not content.startswith("#"):
            texts = re.split(r"[\s,]+", content)
            found.append(_Fields(content=line, texts=texts, line=number, source=source))
            if len(found) > MOST_ITEMS:
                found[-1].refuse(
                    f"more than {MOST_ITEMS:,} points: MAVLink can send no more than that"
                )
    return found


def _read_position(fields: _Fields, index: int) -> tuple[float, float]:
    latitude_deg, longitude_deg = (_read_number(fields, index + n) for n in (0, 1))
    if abs(latitude_deg) > 90.0 or abs(longitude_deg) > 180.0:
        fields.refuse(f"{latitude_deg:g}, {longitude_deg:g} is not a latitude and longitude")
    return latitude_deg, longitude_deg


def _read_number(fields: _Fields, index: int) -> float:
    try:
        value = float(fields.texts[index])
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        fields.refuse(f"expected a number, found '{fields.texts[index][:40]}'")
    return value


def _without_items(
    text: str,
    what: str,
    remarks: Remarks,
    *,
    source: str,
    fence: Fence | None = None,
    rally: tuple[RallyPoint, ...] = (),
) -> Mission:
    remarks.add(TEXT_NO_MISSION, f"the file holds {what} and no mission")
    return Mission(
        source=source,
        file_format=MissionFormat.WPL,
        items=(),
        fence=fence,
        rally=rally,
        findings=remarks.findings(),
        document=text,
    )
