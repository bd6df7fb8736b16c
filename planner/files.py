"""Small texts read from files; texts written so that a reader never meets half of them."""

from __future__ import annotations

import os
import stat
from pathlib import Path
from typing import TYPE_CHECKING

from planner.errors import OutputError
from planner.findings import Place

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.errors import InputError


def read_small_file(path: str | Path, *, most_bytes: int, error: type[InputError]) -> bytes:
    """Return the bytes of a file, one more than the most there may be where it is too large.

    Raises
    ------
    InputError
        Of the kind given, if the file cannot be read.
    """
    try:
        with Path(path).open("rb") as file:
            return file.read(most_bytes + 1)
    except (OSError, ValueError) as refused:  # ValueError: a zero byte in the path
        msg = f"cannot be read: {getattr(refused, 'strerror', None) or refused}"
        raise error(msg, source=str(path)) from refused


def small_text(
    data: bytes, *, source: str, most_bytes: int, error: type[InputError], what: str
) -> str:
    """Return bytes as the text of a small file, which is called by what it should be.

    Raises
    ------
    InputError
        Of the kind given, if there are too many bytes, or they are not UTF-8.
    """
    if len(data) > most_bytes:
        msg = f"is larger than {most_bytes >> 10} KiB: this is not a {what}"
        raise error(msg, source=source)
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as refused:
        place = Place(line=data.count(b"\n", 0, refused.start) + 1, column=1)
        msg = f"is not UTF-8 text: this is not a {what}"
        raise error(msg, source=source, place=place) from refused


def write_output_file(path: Path, text: str) -> None:
    """Write a text as `write_output_bytes` writes bytes."""
    write_output_bytes(path, text.encode("utf-8"))


def write_output_bytes(path: Path, data: bytes) -> None:
    """Write or replace a file atomically: into a temporary file beside it, then in its place.

    A link is followed, the permissions of a file that is replaced are kept; a device or a pipe is
    written to directly.

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


def write_output_files(texts: Mapping[Path, str]) -> None:
    """Write several texts, the whole contents of each file: all of them or, where one fails, none.

    Raises
    ------
    OutputError
        If one cannot be written; the others are as they were before.
    """
    before: dict[Path, bytes | None] = {}
    for path in texts:
        try:
            before[path] = path.read_bytes() if path.is_file() else None
        except OSError as error:
            msg = f"{path}: cannot be read, so that it could be put back: {error.strerror or error}"
            raise OutputError(msg) from error
    written: list[Path] = []
    try:
        for path, text in texts.items():
            write_output_file(path, text)
            written.append(path)
    except BaseException:  # an interruption too
        for path in written:
            content = before[path]
            if content is None:
                path.unlink(missing_ok=True)
            else:
                path.write_bytes(content)
        raise


def make_output_folder(folder: Path, *, holding: str) -> None:
    """Make a folder for files, which a message names in the plural, where it is not there.

    Raises
    ------
    OutputError
        If it is a file or cannot be made.
    """
    if folder.exists() and not folder.is_dir():
        msg = f"{folder}: is a file; {holding} are written to a folder, name a new or another one"
        raise OutputError(msg)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"{folder}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
