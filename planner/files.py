"""Small texts read from files; texts written so that a reader never meets half of them."""

from __future__ import annotations

import errno
import os
import re
import stat
import time
from contextlib import contextmanager, suppress
from fnmatch import fnmatchcase
from pathlib import Path, PurePath
from typing import TYPE_CHECKING, Any, BinaryIO

from planner.errors import OutputError
from planner.findings import Place
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping, Sequence

    from planner.errors import InputError


_LONGEST_WRITE_S = 3600.0
"""After which nobody is still writing a temporary file: a trace of 200,000 rows, takes seconds."""
_DEEPEST = 100
"""Parts of a TOML key: the parser takes a time with the square of them (40,000 take a minute), and no key
of ours has more than four."""
_DEEP_KEY = rf"""(?<![\w-])(?:(?:[\w-]++|"[^"\n]*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){{{_DEEPEST}}}"""


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
        has_dots = any(line.count(".") >= _DEEPEST for line in text.split("\n"))
        if not (has_dots and re.search(_DEEP_KEY, text)):
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


def _followed(path: Path) -> Path:
    """Return the file that links lead to; a pipe behind /dev/stdout has no name but that.

    Raises OutputError for ``missing/../file``, which is no file to the system: whoever asks whether it is
    there would be told no, and what is at its end be replaced.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        return path
    target = Path(os.path.realpath(path))
    parent = path.parent
    if (target.exists() and not path.exists()) or (target.parent.exists() and not parent.exists()):
        msg = f"{path}: cannot be written: {os.strerror(errno.ENOENT)}"
        raise OutputError(msg)
    return target


def is_among(path: Path, names: Iterable[str]) -> bool:
    """Return whether a file that is written would take the place of one of these.

    Raises OutputError if nothing can be written there.
    """
    target = _followed(path)
    if not target.is_file():  # a device takes nobody's place
        return False
    for name in dict.fromkeys(names):
        with suppress(OSError, ValueError):  # not there, or not the name of a file
            if target.samefile(name):
                return True
    return False


def refuse_unwritable(path: Path) -> None:
    """Raise OutputError where a file cannot be written, before the work for it is done."""
    target = _followed(path)
    folder = target.parent
    replaces = not target.exists() or target.is_file()
    cause = None
    if target.is_dir():
        cause = errno.EISDIR
    elif not folder.is_dir():
        cause = errno.ENOTDIR if folder.exists() else errno.ENOENT
    elif not os.access(folder if replaces else target, os.W_OK):
        cause = errno.EACCES
    if cause is not None:
        msg = f"{path}: cannot be written: {os.strerror(cause)}"
        raise OutputError(msg)


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


@contextmanager
def replacing(path: Path) -> Iterator[BinaryIO]:
    """Open a file to write piece by piece; it takes its place whole and at once, as it is closed.

    Raises
    ------
    OutputError
        If it cannot be written; what was there before is untouched.
    """
    target = _followed(path)
    beside = target.with_name(f".mavjoule-{os.urandom(6).hex()}.part")
    try:
        with beside.open("xb") as file:
            yield file
            file.flush()
            os.fsync(file.fileno())
        if target.exists():
            beside.chmod(stat.S_IMODE(target.stat().st_mode))
        beside.replace(target)
        _sync(target.parent)
    except OSError as error:
        msg = f"{path}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error
    finally:
        beside.unlink(missing_ok=True)


def write_output_files(contents: Mapping[Path, str | bytes]) -> None:
    """Write several files, the whole contents of each: all of them or, where one fails, none.

    Every one is on the disk before the first takes its place, and no file that is replaced stands
    beside a new one at any moment: a program that is killed leaves old ones or new ones.  One that
    was replaced then is beside its place, as ``.mavjoule-….before``.

    Raises
    ------
    OutputError
        If one cannot be written; the others are as they were before.
    """
    _write_together(
        {
            path: one.encode("utf-8") if isinstance(one, str) else one
            for path, one in contents.items()
        }
    )


def append_output(path: Path, text: str) -> None:
    """Append a text to a file, whole or not at all; `OSError` where it cannot be."""
    data = text.encode("utf-8")
    # One write to a file opened for appending: those of two programs do not mix.
    file = os.open(path, os.O_WRONLY | os.O_APPEND | os.O_CREAT, 0o644)
    try:
        written = os.write(file, data)
        if written < len(data):  # half a text would spoil the next one too
            os.ftruncate(file, os.fstat(file).st_size - written)
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
    finally:
        os.close(file)


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
    aside: list[_Staged] = []
    placed: list[_Staged] = []
    lost: list[_Staged] = []
    try:
        for path, data in contents.items():
            _stage(path, data, staged)
        if len(staged) > 1:  # a single one takes the place of the old at once
            _put_aside(staged, aside)
        for one in staged:
            placed.append(one)
            one.temporary.replace(one.target)
        _sync_folders(staged)
        _take_away([part for one in staged for part in _forsaken(one.target.parent)])
    except BaseException as error:  # an interruption too
        lost = _put_back(aside, placed if len(staged) > 1 else [])
        if not isinstance(error, OSError):
            raise
        msg = (
            f"{_at(contents, staged, aside, placed)}: cannot be written: {error.strerror or error}"
        )
        if lost:
            names = ", ".join(f"{one.path} is in {one.before}" for one in lost)
            msg = f"{msg}; what was there cannot be put back either: {names}"
        raise OutputError(msg) from error
    finally:
        _take_away(
            [one.temporary for one in staged] + [one.before for one in aside if one not in lost]
        )


def _take_away(paths: list[Path]) -> None:
    """Remove what waited beside places; an interruption waits until that is done."""
    try:
        for path in paths:
            with suppress(OSError):  # what cannot be removed is no part of any file
                path.unlink(missing_ok=True)
    except KeyboardInterrupt:
        _take_away(paths)
        raise


def _forsaken(folder: Path) -> list[Path]:
    """Return the temporary files in a folder whose program was killed before it could take them away."""
    found = []
    for one in folder.glob(".mavjoule-*.part"):
        with suppress(OSError):  # its own program takes it away just now
            if time.time() - one.lstat().st_mtime > _LONGEST_WRITE_S:
                found.append(one)
    return found


def _at(contents: Mapping[Path, bytes], *stages: list[_Staged]) -> Path:
    """Return the file that was being written: the last of the latest stage."""
    reached = [stage[-1].path for stage in stages if stage]
    return reached[-1] if reached else next(iter(contents))


def _stage(path: Path, data: bytes, staged: list[_Staged]) -> None:
    """Write a file beside its place, or a device as it is."""
    target = _followed(path)
    beside = target.with_name(f".mavjoule-{os.urandom(6).hex()}.part")
    one = _Staged(path=path, target=target, temporary=beside, before=beside.with_suffix(".before"))
    if target.exists() and not target.is_file():
        try:
            target.write_bytes(data)
        except OSError as error:
            msg = f"{path}: cannot be written: {error.strerror or error}"
            raise OutputError(msg) from error
        return
    staged.append(one)
    with one.temporary.open("xb") as file:
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    if one.target.exists():
        one.temporary.chmod(stat.S_IMODE(one.target.stat().st_mode))


def _put_aside(staged: list[_Staged], aside: list[_Staged]) -> None:
    """Take what is in the places away, and keep it."""
    for one in staged:
        if one.target.exists():
            aside.append(one)
            one.target.replace(one.before)
    _sync_folders(staged)


def _put_back(aside: list[_Staged], placed: list[_Staged]) -> list[_Staged]:
    """Undo what was put aside and placed; return what cannot be put back.

    An interruption is taken up again: where files are says what is left to do.
    """
    lost = []
    try:
        for one in placed:
            if one not in aside and not one.temporary.exists():
                with suppress(OSError):
                    one.target.unlink(missing_ok=True)
        for one in aside:
            try:
                if one.before.exists():
                    one.before.replace(one.target)
            except OSError:
                lost.append(one)
    except KeyboardInterrupt:
        return _put_back(aside, placed)
    return lost


def _sync_folders(staged: list[_Staged]) -> None:
    for folder in {one.target.parent for one in staged}:
        _sync(folder)


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
    _followed(folder)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        msg = f"{folder}: cannot be written: {error.strerror or error}"
        raise OutputError(msg) from error


@contextmanager
def alone_in(folder: Path) -> Iterator[None]:
    """Keep other programs that ask for the same out of a folder, where the system can.

    Raises
    ------
    OutputError
        If another is at work in it.
    """
    try:
        import fcntl
    except ImportError:  # Windows
        yield
        return
    descriptor = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):  # some network file systems cannot
            try:
                fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError as error:
                msg = f"{folder}: another mavjoule is at work in it: wait for its end, or name another output"
                raise OutputError(msg) from error
        yield
    finally:
        os.close(descriptor)


_ANY_FOLDERS = "**"


def refuse_pattern(pattern: str) -> None:
    """Raise ``ValueError`` where no path below a folder can meet a pattern."""
    parts = pattern.split("/")
    if not all(parts) or ".." in parts or "." in parts or "\\" in pattern:
        msg = "must be a path below this folder, with forward slashes, such as *.plan"
        raise ValueError(msg)


def meets_pattern(path: PurePath, pattern: str) -> bool:
    """Return whether a path below a folder meets a pattern, as of `FileIgnore`."""
    parts = pattern.split("/")
    if len(parts) == 1:
        parts = [_ANY_FOLDERS, *parts]
    return _meet(path.parts, parts)


def _meet(parts: Sequence[str], patterns: Sequence[str]) -> bool:
    if not patterns:
        return not parts
    if patterns[0] == _ANY_FOLDERS:
        return any(_meet(parts[start:], patterns[1:]) for start in range(len(parts) + 1))
    return bool(parts) and fnmatchcase(parts[0], patterns[0]) and _meet(parts[1:], patterns[1:])
