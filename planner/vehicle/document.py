"""Documents: the TOML of a model file, before anything in it is judged but its version."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from planner import quantity
from planner.errors import VehicleFileError, described, shortened
from planner.findings import Place
from planner.vehicle.schema import SCHEMA_VERSION, VERSION

MOST_BYTES = 1 << 18
"""A model file is a few kilobytes; anything larger is another kind of file."""


def document_from_toml(data: bytes, *, source: str) -> dict[str, Any]:
    """Return the tables of a model file, without its version.

    Parameters
    ----------
    data : bytes
        TOML in UTF-8.
    source : str
        What errors call the file.

    Raises
    ------
    VehicleFileError
        If this is no TOML, or the file is of a version that is not read.
    """
    document = _parsed(data, source=source)
    _refuse_version(document.pop(VERSION.name, None), source=source)
    return document


def _parsed(data: bytes, *, source: str) -> dict[str, Any]:
    if len(data) > MOST_BYTES:
        msg = f"is larger than {MOST_BYTES // 1024} KiB: this is no model file"
        raise single_problem(msg, source=source)
    try:
        text = data.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = data.count(b"\n", 0, error.start) + 1
        msg = f"is not UTF-8 text (line {line}): this is no model file"
        raise single_problem(msg, source=source) from error
    try:
        return tomllib.loads(text)
    except RecursionError as error:
        msg = "is nested too deeply for a model file"
        raise single_problem(msg, source=source) from error
    except ValueError as error:  # TOMLDecodeError, or a number with thousands of digits
        raise _syntax_error(str(error), text, source=source) from error


def _syntax_error(message: str, text: str, *, source: str) -> VehicleFileError:
    where = re.search(r" \((?:at line (\d+), column (\d+)|at end of document)\)$", message)
    if where is None:
        return single_problem(f"is not TOML: {message}", source=source)
    if where[1] is None:
        lines = text.split("\n")
        place = Place(line=len(lines), column=len(lines[-1]) + 1)
    else:
        place = Place(line=int(where[1]), column=int(where[2]))
    message = f"is not TOML: {message[: where.start()]}"
    return VehicleFileError(
        message,
        source=source,
        place=place,
        problems=(f"{source}:{place.line}:{place.column}: {message}",),
    )


def _refuse_version(version: object, *, source: str) -> None:
    """Raise before anything else is judged: another version may mean everything differently."""
    if version == SCHEMA_VERSION and VERSION.kind.holds(version):
        return
    if version is None:
        problem = f"is missing: write schema = {SCHEMA_VERSION} at the top of the file"
    elif VERSION.kind.holds(version) and isinstance(version, int) and version > SCHEMA_VERSION:
        problem = (
            f"{shortened(str(version))} is newer than this program, which reads schema "
            f"{SCHEMA_VERSION}: update mavjoule"
        )
    else:
        problem = (
            f"must be {SCHEMA_VERSION}, got {described(version)}: there is no such version; "
            "write the file again after models/README.md"
        )
    raise file_error([(VERSION.name, problem)], source=source)


def single_problem(message: str, *, source: str) -> VehicleFileError:
    """Return the error of a file with which one thing is wrong."""
    return VehicleFileError(message, source=source, problems=(f"{source}: {message}",))


def file_error(problems: list[tuple[str, str]], *, source: str) -> VehicleFileError:
    """Return the error of a file with problems (key, what is wrong); at least one."""
    key, message = problems[0]
    more = (
        f" (and {quantity.count(len(problems) - 1, 'more problem')})" if len(problems) > 1 else ""
    )
    return VehicleFileError(
        message + more,
        source=source,
        key=key,
        problems=tuple(f"{source}: {key}: {problem}" for key, problem in problems),
    )
