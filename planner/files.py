"""Small texts read from files; texts written so that a reader never meets half of them."""

from __future__ import annotations

import os
import re
import stat
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from planner.errors import OutputError
from planner.findings import Place
from planner.values import Value

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
    _write_together({path: data})


def write_output_files(texts: Mapping[Path, str]) -> None:
    """Write several texts, the whole contents of each file: all of them or, where one fails, none.

    Every text is on the disk before the first takes its place.

    Raises
    ------
    OutputError
        If one cannot be written; the others are as they were before.
    """
    _write_together({path: text.encode("utf-8") for path, text in texts.items()})


class _Staged(Value):
    """A file that waits beside its place."""

    path: Path
    """As it was asked for."""
    target: Path
    temporary: Path
    before: Path
    """What was in its place, under another name until all are written."""


def _write_together(contents: Mapping[Path, bytes]) -> None:
    staged: list[_Staged] = []
    placed: list[_Staged] = []
    path = Path()
    try:
        for path, data in contents.items():
            target = Path(os.path.realpath(path))
            if target.exists() and not target.is_file():
                target.write_bytes(data)
                continue
            beside = target.with_name(f".mavjoule-{os.urandom(6).hex()}.part")
            one = _Staged(
                path=path, target=target, temporary=beside, before=beside.with_suffix(".before")
            )
            staged.append(one)
            _stage(one, data)
        for one in staged:
            path = one.path
            if len(staged) > 1:  # a single one is in its place at once, or not at all
                _keep(one)
                placed.append(one)
            one.temporary.replace(one.target)
        for folder in {one.target.parent for one in staged}:
            _sync(folder)
    except BaseException as error:  # an interruption too
        for one in reversed(placed):
            _put_back(one)
        if not isinstance(error, OSError):
            raise
        msg = f"{path}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
    finally:
        for one in staged:
            one.temporary.unlink(missing_ok=True)
            one.before.unlink(missing_ok=True)


def _stage(one: _Staged, data: bytes) -> None:
    with one.temporary.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    if one.target.exists():
        one.temporary.chmod(stat.S_IMODE(one.target.stat().st_mode))


def _keep(one: _Staged) -> None:
    if not one.target.exists():
        return
    try:
        one.before.hardlink_to(one.target)
    except OSError:  # a file system without links
        one.before.write_bytes(one.target.read_bytes())


def _put_back(one: _Staged) -> None:
    """Undo what took a place, where it did: its temporary file is gone then."""
    if one.temporary.exists():
        return
    if one.before.exists():
        one.before.replace(one.target)
    else:
        one.target.unlink(missing_ok=True)


def _sync(folder: Path) -> None:
    """Have the names in a folder on the disk, where the system can."""
    if os.name == "nt":
        return
    with suppress(OSError):  # some network file systems cannot, and what is written is in its place
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


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
