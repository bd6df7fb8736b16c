"""Writing a text to a file so that a reader never meets half of it."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from planner.errors import OutputError


def write_output_file(path: Path, text: str) -> None:
    """Write a text atomically: into a temporary file beside it, then in its place.

    A link is followed, the permissions of a file that is replaced are kept; a device or a pipe is
    written to directly.

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
    write_output_bytes(path, text.encode("utf-8"))


def write_output_bytes(path: Path, data: bytes) -> None:
    """Write bytes as `write_output_file` writes a text.

    Raises
    ------
    OutputError
        If the file cannot be written; what was there before is untouched.
    """
    target = Path(os.path.realpath(path))
    temporary = target.with_name(f".mavjoule-{os.urandom(6).hex()}.part")
    try:
        if target.exists() and not target.is_file():
            target.write_bytes(data)
            return
        try:
            with temporary.open("xb") as file:
                file.write(data)
                file.flush()
                os.fsync(file.fileno())
            if target.exists():
                temporary.chmod(stat.S_IMODE(target.stat().st_mode))
            temporary.replace(target)
        finally:
            temporary.unlink(missing_ok=True)
    except OSError as error:
        msg = f"{path}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
