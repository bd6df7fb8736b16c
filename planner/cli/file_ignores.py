"""What a configuration does not want reported of some files, or of one of their items.

A pattern without a slash is met by a file of that name in any folder below the configuration's;
one with a slash counts from that folder.  A star stays within a name, ``**`` stands for any
folders.  ``#12`` at the end means the mission's item 12.
"""

from __future__ import annotations

import re
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from planner.selection import Exemption
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

_ITEM = re.compile(r"(?P<pattern>.+)#(?P<item>\d+)")
_ANY_FOLDERS = "**"


class FileIgnore(Value):
    """Codes not to report of the missions whose path meets a pattern."""

    folder: Path
    """Where the configuration is."""
    pattern: str
    item: int | None
    """``None``: every item."""
    codes: tuple[str, ...]
    origin: str
    """The configuration and the key, for whoever wonders."""

    def meets(self, mission: Path) -> bool:
        """Return whether the path of a mission below the folder meets the pattern."""
        parts = self.pattern.split("/")
        if len(parts) == 1:
            parts = [_ANY_FOLDERS, *parts]
        return _meet(mission.relative_to(self.folder).parts, parts)

    def exemption(self) -> Exemption:
        """Return what is not reported of a mission that meets the pattern."""
        return Exemption(codes=self.codes, item=self.item, origin=self.origin)


def make_file_ignore(key: str, codes: tuple[str, ...], *, configuration: Path) -> FileIgnore:
    """Return the meaning of one key of the table and its codes.

    Raises
    ------
    ValueError
        If the key can mean no file or no item.
    """
    with_item = _ITEM.fullmatch(key)
    pattern = with_item["pattern"] if with_item else key
    item = int(with_item["item"]) if with_item else None
    if item == 0:
        msg = "items count from 1, home is none"
        raise ValueError(msg)
    parts = pattern.split("/")
    if not all(parts) or ".." in parts or "." in parts or "\\" in pattern:
        msg = "must be a path below this folder, with forward slashes, such as *.plan"
        raise ValueError(msg)
    return FileIgnore(
        folder=configuration.parent.resolve(),
        pattern=pattern,
        item=item,
        codes=codes,
        origin=f"{key} in {configuration.name}",
    )


def _meet(parts: Sequence[str], patterns: Sequence[str]) -> bool:
    if not patterns:
        return not parts
    if patterns[0] == _ANY_FOLDERS:
        return any(_meet(parts[start:], patterns[1:]) for start in range(len(parts) + 1))
    return bool(parts) and fnmatchcase(parts[0], patterns[0]) and _meet(parts[1:], patterns[1:])
