"""The missions that a folder stands for, and which of them are left out."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import NoMissionFileError
from planner.files import meets_pattern
from planner.mission.formats.exchange import MISSION_SUFFIXES
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence

_BEGINNINGS = {".txt": (b"QGC WPL",), ".json": (b'"fileType"', b'"Plan"')}
"""What missions called as other files are hold in their first bytes."""
_OF_GIT = ".git"
_FIRST_BYTES = 4096


class FolderMissions(Value):
    """The missions in a folder and below it."""

    files: tuple[Path, ...]
    """Sorted by their paths."""
    excluded: int
    """Missions that meet a pattern given."""
    met: frozenset[str]
    """The patterns that a mission, or a folder on the way to it, meets."""
    hidden: int
    """Missions and folders left out because their names begin with a dot; what git keeps is not counted."""
    links: int
    """Links to folders, which are not followed."""
    others: int
    """Files that are no missions by their names and beginnings."""


def is_mission(path: Path) -> bool:
    """Return whether a file is a mission by its name, or by its beginning where others have such names."""
    suffix = path.suffix.lower()
    if suffix not in _BEGINNINGS:
        return suffix in MISSION_SUFFIXES
    try:
        with path.open("rb") as file:
            first = file.read(_FIRST_BYTES)
    except OSError:
        return False
    return all(text in first for text in _BEGINNINGS[suffix])


def find_missions(folder: Path, *, exclude: Sequence[str] = ()) -> FolderMissions:
    """Return the missions that a folder stands for; hidden ones are left out.

    Parameters
    ----------
    folder : Path
        Links to folders in it are not followed.
    exclude : sequence of str
        Patterns as of ``[per_file_ignores]``, which count from this folder or from the current one.
        A folder that meets one is left out whole.

    Raises
    ------
    NoMissionFileError
        If a folder cannot be looked into.
    """

    def refuse(error: OSError) -> None:
        msg = f"cannot be looked into: {error.strerror or error}"
        raise NoMissionFileError(msg, source=str(error.filename))

    files, excluded, others, hidden, links = [], 0, 0, 0, 0
    met: set[str] = set()
    for place, folders, names in os.walk(folder, onerror=refuse):
        hidden += sum(name.startswith(".") and name != _OF_GIT for name in folders)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        links += sum(Path(place, name).is_symlink() for name in folders)
        for name in sorted(names):
            path = Path(place, name)
            if not is_mission(path):
                others += not name.startswith(".")
            elif name.startswith("."):
                hidden += 1
            elif meets := patterns_met(path, exclude, folder=folder):
                excluded += 1
                met |= meets
            else:
                files.append(path)
    return FolderMissions(
        files=tuple(files),
        excluded=excluded,
        met=frozenset(met),
        others=others,
        hidden=hidden,
        links=links,
    )


def patterns_met(path: Path, patterns: Sequence[str], *, folder: Path | None = None) -> set[str]:
    """Return the patterns that a path, or a folder on the way to it, meets from either folder."""
    met: set[str] = set()
    here = Path.cwd()
    whole = Path(os.path.normpath(here / path))
    for start in (here, *((folder,) if folder is not None else ())):
        below = Path(os.path.normpath(here / start))
        if not whole.is_relative_to(below):
            continue
        inside = whole.relative_to(below)
        ways = [inside, *inside.parents][:-1]
        met |= {one for one in patterns if any(meets_pattern(way, one) for way in ways)}
    return met
