"""The missions that a folder stands for, and which of them are left out."""

from __future__ import annotations

import os
from pathlib import Path, PurePath
from typing import IO, TYPE_CHECKING

from planner.errors import NoMissionFileError
from planner.files import meets_pattern
from planner.mission.formats.exchange import LARGEST_FILE_BYTES, MISSION_SUFFIXES
from planner.mission.formats.litchi import is_litchi
from planner.values import Value

if TYPE_CHECKING:
    import gzip
    import zipfile
    from collections.abc import Mapping, Sequence

_BEGINNINGS: Mapping[str, tuple[bytes, ...]] = {
    ".txt": (b"QGC WPL",),
    ".json": (b'"fileType"', b'"Plan"'),
}
"""What missions called as other files are hold in their first bytes."""
_LINES: Mapping[str, tuple[bytes, ...]] = {
    ".kml": (b"LineString", b"wpml:"),
    ".wpml": (b"wpml:",),
    ".geojson": (b'"LineString"',),
    ".json": (b'"LineString"',),
}
"""Of what files of many uses hold one thing that is flown, anywhere: maps of areas alone are no missions."""
_PACKED = frozenset({".kmz", ".zip"})
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
    others: tuple[Path, ...]
    """Files that are no missions by their names and contents, but those whose names begin with a dot."""


def is_mission(path: Path) -> bool:
    """Return whether a file is a mission by its name, or by its content where others have such names."""
    suffix = path.suffix.lower()
    if suffix == ".gz" or suffix in _PACKED:
        return _packs_mission(path, suffix)
    if suffix in MISSION_SUFFIXES:
        return True
    try:
        with path.open("rb") as file:
            return _holds_mission(path.name, file)
    except OSError:
        return _is_called_mission(path)


def _is_called_mission(path: Path) -> bool:
    """Return whether a file that is locked or damaged is one by its name: the reader says what it has."""
    suffix = path.suffix.lower()
    return PurePath(path.stem).suffix.lower() in MISSION_SUFFIXES or suffix == ".kmz"


def _packs_mission(path: Path, suffix: str) -> bool:
    # what packed files are read with is imported for them alone
    import gzip
    import zipfile
    import zlib

    try:
        if suffix == ".gz":
            with gzip.open(path) as file:
                return _holds_mission(path.stem, file)
        with zipfile.ZipFile(path) as archive:
            return any(_is_packed_mission(archive, name) for name in archive.namelist())
    except (OSError, EOFError, zlib.error, zipfile.BadZipFile, RuntimeError, NotImplementedError):
        return _is_called_mission(path)


def _is_packed_mission(archive: zipfile.ZipFile, name: str) -> bool:
    with archive.open(name) as file:
        return _holds_mission(name, file)


def _holds_mission(name: str, file: IO[bytes] | gzip.GzipFile) -> bool:
    """Return whether a file that is called so is a mission."""
    suffix = PurePath(name).suffix.lower()
    if suffix in MISSION_SUFFIXES:
        return True
    if suffix not in {".csv", *_BEGINNINGS, *_LINES}:
        return False
    first = file.read(_FIRST_BYTES)
    if suffix == ".csv":
        return is_litchi(first.partition(b"\n")[0].decode("utf-8-sig", "replace").strip())
    if suffix in _BEGINNINGS and all(text in first for text in _BEGINNINGS[suffix]):
        return True
    whole = first + file.read(LARGEST_FILE_BYTES) if suffix in _LINES else b""
    return any(text in whole for text in _LINES.get(suffix, ()))


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

    files, others, excluded, hidden, links = [], [], 0, 0, 0
    met: set[str] = set()
    for place, folders, names in os.walk(folder, onerror=refuse):
        hidden += sum(name.startswith(".") and name != _OF_GIT for name in folders)
        folders[:] = sorted(name for name in folders if not name.startswith("."))
        links += sum(Path(place, name).is_symlink() for name in folders)
        for name in sorted(names):
            path = Path(place, name)
            if not is_mission(path):
                others += [path] * (not name.startswith("."))
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
        others=tuple(others),
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
