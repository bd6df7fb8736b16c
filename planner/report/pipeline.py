"""Where a pipeline looks for a mission's file, and how it knows a finding again."""

from __future__ import annotations

import hashlib
import json
import os
import re
from collections import Counter
from pathlib import PurePath
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.findings import Finding

_NUMBER = re.compile(r"\d+(?:\.\d+)?")


def pipeline_path(file: str, *, folder: Path) -> str:
    """Return a mission's path with forward slashes, from the folder where it lies below it.

    The folder is where the pipeline runs, usually the top of the repository.
    """
    path = PurePath(os.path.normpath(file))
    if path.is_absolute() and path.is_relative_to(folder):
        path = path.relative_to(folder)
    return path.as_posix()


def fingerprints(findings: Sequence[Finding], *, path: str) -> list[str]:
    """Return what stays the same of each finding while its numbers and its line change.

    Code, file, item and the words of the message, hashed; and which of several that agree in all
    of them it is.
    """
    seen: Counter[str] = Counter()
    marks = []
    for finding in findings:
        words = _NUMBER.sub("#", finding.message)
        known = json.dumps([finding.code, path, finding.item, words])
        mark = hashlib.sha256(known.encode("ascii")).hexdigest()[:32]
        seen[mark] += 1
        marks.append(f"{mark}:{seen[mark]}")
    return marks
