"""Mission files of every format, recognised by their content, never by their suffix."""

from __future__ import annotations

import gc
from contextlib import contextmanager
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from planner.errors import MissionFileError, UsageError
from planner.files import write_output_file
from planner.findings import Rule, Severity
from planner.mission.formats.exchange import (
    describe_text,
    describe_xml,
    read_bytes,
    read_text,
    xml_root,
)
from planner.mission.formats.json_document import parse_json
from planner.mission.formats.plan import read_plan
from planner.mission.items import MissionFormat
from planner.values import replace

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

    from planner.findings import Finding
    from planner.mission.items import Mission


_SUFFIXES = {
    MissionFormat.PLAN: frozenset({".plan", ".mission", ".json"}),
    MissionFormat.WPL: frozenset({".waypoints", ".txt", ".wpl"}),
}
"""Where QGroundControl and Mission Planner look for each format."""
WRITTEN_SUFFIXES = {
    ".plan": MissionFormat.PLAN,
    ".json": MissionFormat.PLAN,
    ".waypoints": MissionFormat.WPL,
    ".txt": MissionFormat.WPL,
}
"""QGroundControl chooses its reader by the suffix and opens nothing else."""


def read_mission(path: str | Path) -> Mission:
    """Return the mission in a file, or in standard input for ``-``.

    Parameters
    ----------
    path : str or Path
        A plan, a ``QGC WPL`` text, one of their older forms, or either of them compressed; a line with
        altitudes in KML, KMZ or GeoJSON; Litchi's CSV; DJI's WPML.  What it is shows in its content.

    Returns
    -------
    Mission
        With what reading it brought to light as findings.

    Raises
    ------
    MissionFileError
        If it cannot be read, is no mission or is broken.
    """
    return read_mission_bytes(read_bytes(path), source=str(path))


def read_mission_bytes(data: bytes, *, source: str) -> Mission:
    """Return the mission in the bytes of a file; see `read_mission`."""
    content = read_text(data, source=source)
    with _collection_paused():
        mission = _read_content(content.text, source=source, beside=content.beside)
    findings = [*content.findings, *_check_suffix(mission, content.inner_name or source)]
    return replace(mission, findings=(*findings, *mission.findings)) if findings else mission


def write_mission(mission: Mission, path: str | Path) -> tuple[Finding, ...]:
    """Write a mission to a file, whole or not at all.

    Parameters
    ----------
    mission : Mission
        One read from a plan keeps in a plan all that its file held.
    path : str or Path
        ``.plan`` or ``.json`` for a plan, ``.waypoints`` or ``.txt`` for ``QGC WPL`` text.

    Returns
    -------
    tuple of Finding
        What the file does not hold, and what reading it brings to light.

    Raises
    ------
    UsageError
        If the suffix is none of these.
    OutputError
        If the format cannot hold the mission, or the file cannot be written.
    """
    file_format = WRITTEN_SUFFIXES.get(PurePath(path).suffix.lower())
    if file_format is None:
        known = ", ".join(WRITTEN_SUFFIXES)
        msg = f"{path}: the suffix decides the format: give a name ending in {known}"
        raise UsageError(msg)
    from planner.mission.convert import convert_mission  # a check writes none

    conversion = convert_mission(mission, file_format)
    write_output_file(Path(path), conversion.text)
    return conversion.findings


@contextmanager
def _collection_paused() -> Iterator[None]:
    """Keep the garbage collector from going through a growing mission again and again.

    Nothing of it is garbage: on 10,000 items it costs a quarter of the time.
    """
    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_enabled:
            gc.enable()


def _read_content(text: str, *, source: str, beside: str) -> Mission:
    """Return the mission in a text by what it begins with."""
    if text.lstrip().startswith(("{", "[")):
        return _read_json(text, source=source)
    if text.lstrip().startswith("<"):
        return _read_xml(text, source=source, beside=beside)
    from planner.mission.formats.wpl import read_lines

    for _, line in read_lines(text, source=source):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if reader := _line_reader(line):
            return reader(text, source=source)
        break
    raise MissionFileError(describe_text(text), source=source)


def _read_json(text: str, *, source: str) -> Mission:
    document = parse_json(text, source=source)
    root = document.root
    if isinstance(root, dict) and isinstance(root.get("type"), str) and "items" not in root:
        from planner.mission.formats.geojson import is_geojson, read_geojson

        if is_geojson(root):
            return read_geojson(root, source=source)
    return read_plan(document, source)


def _read_xml(text: str, *, source: str, beside: str) -> Mission:
    if xml_root(text) != "kml":
        raise MissionFileError(describe_xml(text), source=source)
    from planner.mission.formats.kml import read_kml

    return read_kml(text, source=source, template=beside)


def _line_reader(line: str) -> Callable[..., Mission] | None:
    """Return who reads a text whose first line that says something is this; ``None``: nobody."""
    from planner.mission.formats import wpl

    if wpl.has_wpl_header(line) or wpl.is_row(line):
        return wpl.read_wpl
    if line.lower().startswith("latitude,"):
        from planner.mission.formats.litchi import is_litchi, read_litchi

        return read_litchi if is_litchi(line) else None
    if wpl.is_rally_line(line):
        return wpl.read_rally_list
    return wpl.read_fence_list if wpl.is_fence_line(line) else None


FILE_SUFFIX = Rule(
    "L161 file-suffix",
    Severity.INFO,
    summary="The file's suffix does not match its content.",
    why="QGroundControl chooses the parser by the suffix and refuses the file.",
    how="Text is expected in .waypoints, .txt and .wpl, JSON in .plan, .mission and .json.",
    fix="rename the file",
)


def _check_suffix(mission: Mission, name: str) -> list[Finding]:
    """Return the finding about a suffix that belongs to another format."""
    if mission.file_format is MissionFormat.FOREIGN:
        return []
    suffix = PurePath(name).suffix.lower()
    if not any(suffix in _SUFFIXES[other] for other in _SUFFIXES if other != mission.file_format):
        return []
    what = "JSON" if mission.file_format is MissionFormat.PLAN else "QGC WPL text"
    return [FILE_SUFFIX.finding(f"{what} in a file named {suffix}: QGroundControl refuses it")]
