"""The text format with a ``QGC WPL`` header, in every dialect real files are written in.

Version 110 begins with a home row that is not flown, version 120 has none.  Rows are numbered by
their order, as every loader does; DO_JUMP refers to those numbers.
"""

from __future__ import annotations

import re
from itertools import chain
from typing import TYPE_CHECKING, NoReturn

from planner import numbers
from planner.catalogue.loader_text import (
    TEXT_DIALECT,
    TEXT_EXTRA_COLUMNS,
    TEXT_FENCE_ROWS,
    TEXT_HEADER,
    TEXT_NO_HOME_ROW,
    TEXT_NO_MISSION,
    TEXT_SEQUENCE,
    TEXT_TERRAIN_ROWS,
    TEXT_UNSET_VALUE,
)
from planner.errors import MissionFileError
from planner.findings import Place, Severity
from planner.mission.commands import (
    AMSL_FRAMES,
    RELATIVE_FRAMES,
    TERRAIN_FRAMES,
    Command,
    command_name,
)
from planner.mission.fence_items import FENCE_COMMANDS, make_fence, make_rally_points
from planner.mission.items import Home, Mission, MissionFormat, MissionItem
from planner.mission.vehicle_kind import tell_vehicle
from planner.mission.wpl_rows import is_row, read_lines, read_rows

if TYPE_CHECKING:
    from collections.abc import Iterator, Sequence

    from planner.findings import Finding, Rule
    from planner.mission.wpl_rows import Row, RowText

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
    source : str
        Its name, for messages.

    Returns
    -------
    Mission
        Fence and rally rows become its fence and rally points, not items.

    Raises
    ------
    MissionFileError
        If the version is another than 110 or 120, or a row is broken.
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
    vehicle = tell_vehicle(items, home_altitude_amsl_m=home_altitude_amsl_m)
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
            message = f"the header stands in line {number}: other loaders want it in the first"
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


def _is_home(rows: Sequence[Row]) -> bool:
    """Return whether the first row of a version 110 file is home; the rule L152 explains it."""
    first = rows[0]
    if first.sequence != 0 or first.command not in {0, Command.NAV_WAYPOINT}:
        return False
    if first.command == 0 or first.frame in AMSL_FRAMES or not first.values[6]:
        return True
    return len(rows) > 1 and rows[1].command in _TAKEOFFS


def _make_home(row: Row) -> Home | None:
    """Return the home of a home row; 0, 0 is how Mission Planner writes that it knows none."""
    *_, latitude_deg, longitude_deg, altitude_m = row.values
    if latitude_deg is None or longitude_deg is None or (latitude_deg == longitude_deg == 0.0):
        return None
    return Home(
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_amsl_m=altitude_m if row.frame in AMSL_FRAMES else None,
    )


def _missing_home(row: Row) -> Finding:
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


def _make_item(row: Row, *, jump_id: int) -> MissionItem:
    param1, param2, param3, param4, latitude_deg, longitude_deg, altitude_m = row.values
    return MissionItem(
        command=row.command,
        frame=row.frame,
        param1=param1,
        param2=param2,
        param3=param3,
        param4=param4,
        latitude_deg=latitude_deg,
        longitude_deg=longitude_deg,
        altitude_m=altitude_m,
        autocontinue=row.autocontinue,
        jump_id=jump_id,
        place=row.place,
    )


def _check_dialect(content: RowText, *, has_header: bool) -> list[Finding]:
    """Return what QGroundControl would refuse about the way the rows are written."""
    untabbed = [row for row in content.rows if not row.is_tabbed and not row.extra_fields]
    reasons = []
    if untabbed:
        first = untabbed[0].place.line
        reasons.append(
            f"not 12 fields between tabs in {numbers.count(len(untabbed), 'row')} (first in line {first})"
        )
    if content.comment_lines:
        reasons.append(f"{numbers.count(content.comment_lines, 'comment')}")
    if content.blank_lines:
        reasons.append(f"{numbers.count(content.blank_lines, 'blank line')}")
    if not reasons or not has_header:
        return []
    message = f"QGroundControl refuses this file: {', '.join(reasons)}"
    return [TEXT_DIALECT.finding(message, place=untabbed[0].place if untabbed else None)]


def _check_rows(rows: Sequence[Row], *, base: int) -> list[Finding]:
    """Return what loaders misread about the content of the rows, one finding per trap."""
    findings: list[Finding] = []

    def report(rule: Rule, affected: Sequence[Row], message: str) -> None:
        if affected:
            where = f" (first in line {affected[0].place.line})"
            findings.append(
                rule.finding(
                    f"{numbers.count(len(affected), 'row')} {message}{where}",
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
            f"{numbers.count(len(misnumbered), 'row')} out of sequence, first {row.sequence} where "
            f"{expected} is due: rows are numbered by their order"
            + (", and DO_JUMP goes by that order" if jumps else "")
        )
        severity = Severity.WARNING if jumps else Severity.INFO
        findings.append(TEXT_SEQUENCE.finding(message, place=row.place, severity=severity))
    return findings


def _mixed_areas(areas: Sequence[MissionItem], *, has_items: bool) -> Finding:
    """Return the finding about fence and rally rows, alone or inside a mission."""
    rally = sum(item.command == Command.NAV_RALLY_POINT for item in areas)
    parts = [f"{numbers.count(len(areas) - rally, 'fence row')}"] if len(areas) > rally else []
    if rally:
        parts.append(f"{numbers.count(rally, 'rally row')}")
    what = " and ".join(parts)
    if not has_items:
        return TEXT_NO_MISSION.finding(
            f"the file holds {what} and no mission", place=areas[0].place
        )
    message = f"{what} inside the mission: checked as fence and rally, refused as mission items"
    return TEXT_FENCE_ROWS.finding(message, place=areas[0].place)
