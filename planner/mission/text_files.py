"""Mission files that are text but not JSON, told apart by their first telling line."""

from __future__ import annotations

from typing import TYPE_CHECKING

from planner.errors import MissionFileError
from planner.mission.area_text import (
    is_fence_line,
    is_rally_line,
    read_fence_list,
    read_rally_list,
)
from planner.mission.foreign import describe_text
from planner.mission.wpl import has_wpl_header, read_wpl
from planner.mission.wpl_rows import is_row, read_lines

if TYPE_CHECKING:
    from planner.mission.items import Mission


def read_mission_text(text: str, *, source: str) -> Mission:
    """Return the mission in ``QGC WPL`` text, or in a list of fence or rally points.

    Raises
    ------
    MissionFileError
        If it is none of these, or broken.
    """
    for _, line in read_lines(text, source=source):
        if not line.strip() or line.lstrip().startswith("#"):
            continue
        if has_wpl_header(line) or is_row(line):
            return read_wpl(text, source=source)
        if is_rally_line(line):
            return read_rally_list(text, source=source)
        if is_fence_line(line):
            return read_fence_list(text, source=source)
        break
    raise MissionFileError(describe_text(text), source=source)
