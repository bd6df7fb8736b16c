"""Small texts read from files; texts written so that a reader never meets half of them."""

from __future__ import annotations

import os
import re
import stat
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from planner.errors import OutputError
from planner.findings import Place

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.errors import InputError


_DEEPEST = 100
"""Parts of a TOML key: the parser takes a time with the square of them (40,000 take a minute), and no key
of ours has more than four."""
_DEEP_KEY = re.compile(
    rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_DEEPEST}}}"""
)


def read_bounded(path: str | Path, *, most_bytes: int, error: type[InputError], what: str) -> bytes:
    """Return the bytes of a small file or pipe, which is called by what it should be.

    Raises
    ------
    InputError
        Of the kind given, if it cannot be read, is no file, or holds more than there may be.
    """
    source = str(path)
    try:
        mode = Path(path).stat().st_mode
        if not (stat.S_ISREG(mode) or stat.S_ISFIFO(mode)):
            msg = (
                f"cannot be read: is {'a folder' if stat.S_ISDIR(mode) else 'a device'}, not a file"
            )
            raise error(msg, source=source)
        with open_pipe(path) if stat.S_ISFIFO(mode) else Path(path).open("rb") as file:
            data = file.read(most_bytes + 1)
    except (OSError, ValueError) as refused:  # ValueError: a zero byte in the path
        msg = f"cannot be read: {getattr(refused, 'strerror', None) or refused}"
        raise error(msg, source=source) from refused
    refuse_large(data, source=source, most_bytes=most_bytes, error=error, what=what)
    return data


def open_pipe(path: str | Path) -> BinaryIO:
    """Open a pipe for reading; one that nobody writes to is at its end and not waited for."""
    descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK)
    os.set_blocking(descriptor, True)
    return os.fdopen(descriptor, "rb")


def refuse_large(
    data: bytes, *, source: str, most_bytes: int, error: type[InputError], what: str
) -> None:
    """Raise an error of the kind given where there are more bytes than there may be."""
    if len(data) > most_bytes:
        msg = f"is larger than {most_bytes >> 10} KiB: this is not a {what}"
        raise error(msg, source=source)


def decoded(data: bytes, *, source: str, error: type[InputError], what: str) -> str:
    """Return bytes as the text of a small file, which is called by what it should be.

    Raises
    ------
    InputError
        Of the kind given, if they are not UTF-8.
    """
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError as refused:
        place = Place(line=data.count(b"\n", 0, refused.start) + 1, column=1)
        msg = f"is not UTF-8 text: this is not a {what}"
        raise error(msg, source=source, place=place) from refused


def toml_document(
    data: bytes, *, source: str, error: type[InputError], what: str
) -> dict[str, Any]:
    """Return what TOML in UTF-8 holds, which is called by what it should be.

    Raises
    ------
    InputError
        Of the kind given, if it is not TOML, or nested deeper than any such file.
    """
    import tomllib

    text = decoded(data, source=source, error=error, what=what)
    try:
        if not _DEEP_KEY.search(text):
            return tomllib.loads(text)
    except RecursionError:
        pass
    except ValueError as refused:  # TOMLDecodeError, or a number with thousands of digits
        message, place = str(refused), None
        if where := re.search(r" \((?:at line (\d+), column (\d+)|at end of document)\)$", message):
            lines = text.split("\n")
            place = Place(
                line=int(where[1] or len(lines)), column=int(where[2] or len(lines[-1]) + 1)
            )
            message = message[: where.start()]
        msg = f"is not TOML: {message}"
        raise error(msg, source=source, place=place) from refused
    msg = f"is nested too deeply for a {what}"
    raise error(msg, source=source)


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
