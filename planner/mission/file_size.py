"""The largest file that is read as a mission."""

from __future__ import annotations

from planner.errors import MissionFileError

LARGEST_FILE_BYTES = 64 * 2**20
"""No mission of 65,535 items comes near it, in any format."""


def refuse_large(data: bytes, *, source: str) -> None:
    """Raise where the content of a file is too large.

    Raises
    ------
    MissionFileError
        If it is.
    """
    if len(data) > LARGEST_FILE_BYTES:
        size = LARGEST_FILE_BYTES // 2**20
        msg = f"more than {size} MiB: no mission is that large"
        raise MissionFileError(msg, source=source)
