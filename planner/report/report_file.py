"""Writing a report to a file so that a reader never meets half of one."""

from __future__ import annotations

import os
from pathlib import Path

from planner.errors import OutputError


def write_report_file(path: Path, text: str) -> None:
    """Write a text atomically: into a temporary file beside it, then in its place.

    A link is followed; a device or a pipe is written to directly.

    Parameters
    ----------
    path : Path
        The file to write or replace.
    text : str
        Its whole contents.

    Raises
    ------
    OutputError
        If the file cannot be written; what was there before is untouched.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".{target.name}.{os.getpid()}.part")
    try:
        if target.exists() and not target.is_file():
            target.write_text(text, encoding="utf-8", newline="")
            return
        try:
            temporary.write_text(text, encoding="utf-8", newline="")
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        msg = f"{path}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
