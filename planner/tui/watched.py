"""The files that decide a verdict, and which of them were written since they were looked at."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from planner.cli.configuration import OWN_FILE, SHARED_FILE

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.tui.what_if import WhatIf

_FILES = ("params", "profile", "baseline")
"""Settings that name a file."""


def deciding_files(file: str, what_if: WhatIf) -> tuple[Path, ...]:
    """Return the files that decide a verdict: mission, model, parameters, profile, configuration.

    Parameters
    ----------
    file : str
        The mission; of one that is no file only the folder counts, for the configuration.
    what_if : WhatIf
        What it is checked with; files that are typed and not there yet count too.
    """
    values = {**what_if.settings, **what_if.changes}
    named = [Path(str(values[key])) for key in _FILES if values.get(key)]
    vehicle = str(values.get("vehicle") or "")
    if vehicle.endswith(".toml"):
        named.append(Path(vehicle))
    named += values.get("terrain", ())
    folder = Path(file).parent.resolve()
    places = (folder, *folder.parents)
    settings = [place / name for place in places for name in (OWN_FILE, SHARED_FILE)]
    return tuple(dict.fromkeys((Path(file), *named, *settings)))


class FileWatch:
    """When files were written, as far as they were looked at."""

    def __init__(self) -> None:
        self._stamps: dict[Path, tuple[int, int] | None] = {}

    def follow(self, files: Iterable[Path]) -> None:
        """Look at files from now on, at others no longer."""
        self._stamps = {
            file: self._stamps[file] if file in self._stamps else file_stamp(file) for file in files
        }

    def changed(self) -> tuple[Path, ...]:
        """Return the files that were written, made or removed since the last look."""
        now = {file: file_stamp(file) for file in self._stamps}
        changed = tuple(file for file, stamp in now.items() if stamp != self._stamps[file])
        self._stamps = now
        return changed


def file_stamp(file: Path) -> tuple[int, int] | None:
    """Return when a file was written and how long it is; ``None`` where it is not there."""
    try:
        found = file.stat()
    except OSError:
        return None
    return found.st_mtime_ns, found.st_size
