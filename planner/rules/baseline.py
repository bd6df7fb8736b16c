"""The baseline: findings that were seen, accepted and need not be told again.

A finding is known as it was said.  Another number, item or severity makes it another finding,
which is reported: a shortfall that has grown comes back.  What the battery cannot do is never
taken into a baseline, because it depends on the day as much as on the file.
"""

from __future__ import annotations

import json
import os
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from typing import TYPE_CHECKING

from planner.errors import BaselineFileError
from planner.findings import Severity
from planner.frozen import frozen
from planner.output_file import write_output_file

if TYPE_CHECKING:
    from collections.abc import Iterable

    from planner.findings import Finding

SCHEMA = 1
ENERGY_FAMILY = "E"


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class KnownFinding:
    """What makes a finding the same as one seen before."""

    file: str
    """Path from the baseline's folder, with forward slashes; ``-`` for standard input."""
    item: int
    """Mission item from 1; 0 where none applies."""
    code: str
    severity: str
    message: str


@frozen
class Baseline:
    """The findings of a baseline file."""

    source: str
    folder: Path
    """The folder of the file, from which its paths count."""
    known: frozenset[KnownFinding]

    def holds(self, finding: Finding, *, file: str) -> bool:
        """Return whether a finding of a mission is known, and may be."""
        return may_be_known(finding) and _known(finding, file, self.folder) in self.known


def may_be_known(finding: Finding) -> bool:
    """Return whether a baseline may hold a finding: not an error of energy."""
    return not (finding.code.startswith(ENERGY_FAMILY) and finding.severity is Severity.ERROR)


def read_baseline(path: Path) -> Baseline:
    """Return the baseline in a file.

    Raises
    ------
    BaselineFileError
        If the file cannot be read or is no baseline.
    """
    source = str(path)
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
    except OSError as error:
        msg = f"cannot be read: {error.strerror or error}"
        raise BaselineFileError(msg, source=source) from error
    except (ValueError, RecursionError) as error:
        msg = f"is not JSON: {error}"
        raise BaselineFileError(msg, source=source) from error
    try:
        schema, entries = document["schema"], document["known"]
        known = frozenset(KnownFinding(**entry) for entry in entries)
        # A list or a table in the place of a text is found out by the hash, a number here.
        is_sound = schema == SCHEMA and all(map(_is_sound, known))
    except (KeyError, TypeError):
        is_sound = False
    if not is_sound:
        msg = "is no baseline of this version: write it anew with --write-baseline"
        raise BaselineFileError(msg, source=source)
    return Baseline(source=source, folder=_folder(path), known=known)


def write_baseline(path: Path, findings: Iterable[tuple[str, Finding]]) -> tuple[int, int]:
    """Write findings, each with the file of its mission, as a baseline.

    Returns
    -------
    written, refused : int
        How many findings the baseline holds, and how many it must not hold.

    Raises
    ------
    OutputError
        If the file cannot be written; what was there before is untouched.
    """
    given = list(findings)
    known = {
        _known(finding, file, _folder(path)) for file, finding in given if may_be_known(finding)
    }
    document = {"schema": SCHEMA, "known": [asdict(one) for one in sorted(known)]}
    write_output_file(path, json.dumps(document, ensure_ascii=True, indent=2) + "\n")
    return len(known), sum(not may_be_known(finding) for _, finding in given)


def _known(finding: Finding, file: str, folder: Path) -> KnownFinding:
    return KnownFinding(
        file=_path_from(folder, file),
        item=finding.item or 0,
        code=finding.code,
        severity=finding.severity.label,
        message=finding.message,
    )


def _is_sound(known: KnownFinding) -> bool:
    texts = (known.file, known.code, known.severity, known.message)
    return type(known.item) is int and all(isinstance(text, str) for text in texts)


def _folder(path: Path) -> Path:
    return Path(os.path.abspath(path)).parent  # noqa: PTH100 - as the missions': links not followed


def _path_from(folder: Path, file: str) -> str:
    if file == "-":
        return file
    whole = os.path.abspath(file)  # noqa: PTH100 - links not followed
    try:
        return PurePath(os.path.relpath(whole, folder)).as_posix()
    except ValueError:  # another drive
        return PurePath(whole).as_posix()
