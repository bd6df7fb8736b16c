"""What can go wrong, as one tree; each class knows the exit code it ends in.  How messages quote input."""

from __future__ import annotations

import math
from contextlib import contextmanager
from enum import IntEnum
from typing import TYPE_CHECKING, ClassVar

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

    from planner.findings import Place


class ExitCode(IntEnum):
    """Exit codes of the command, part of the contract with scripts."""

    GO = 0
    NO_GO = 1
    UNUSABLE = 2
    LINK = 3
    INTERRUPTED = 130


class MavjouleError(Exception):
    """Root of every error a user can cause; its text is one clear sentence."""

    exit_code: ClassVar[ExitCode] = ExitCode.UNUSABLE


class InputError(MavjouleError):
    """A file that cannot be used.

    Parameters
    ----------
    message : str
        What is wrong and what to do, without the file's name.
    source : str
        The file (or ``-`` for standard input, or a URL).
    place : Place, optional
        Line and column, where they are known.
    key : str, optional
        Dotted key or item inside the file, where line and column are not known.
    """

    def __init__(
        self, message: str, *, source: str, place: Place | None = None, key: str | None = None
    ) -> None:
        self.message = message
        self.source = source
        self.place = place
        self.key = key
        where = source
        if place is not None:
            where += f":{place.line}:{place.column}"
        if key is not None:
            where += f": {key}"
        super().__init__(f"{where}: {message}")

    def __reduce__(self) -> tuple[object, ...]:
        """Return how another process raises the same: by its fields, not by its text."""
        return _with_fields, (type(self), self.args, self.__dict__)


def _with_fields(
    kind: type[InputError], arguments: tuple[object, ...], fields: dict[str, object]
) -> InputError:
    error = kind.__new__(kind, *arguments)
    error.__dict__ |= fields
    return error


class MissionFileError(InputError):
    """A mission file that is not one, or is broken."""


class NoMissionFileError(MissionFileError):
    """A path with no file that can be opened: nothing there, a folder, a device, no permission."""


class OtherVehicleError(MissionFileError):
    """A mission for a kind of vehicle that is not predicted."""


class ProblemsError(InputError):
    """A file with problems; ``problems`` holds every one of them."""

    def __init__(
        self,
        message: str,
        *,
        source: str,
        place: Place | None = None,
        key: str | None = None,
        problems: tuple[str, ...] = (),
    ) -> None:
        super().__init__(message, source=source, place=place, key=key)
        self.problems = problems or (str(self),)


class VehicleFileError(ProblemsError):
    """A vehicle model file with problems."""


class FleetFileError(ProblemsError):
    """A fleet file with problems."""


class ParameterFileError(InputError):
    """An autopilot parameter file that cannot be read."""


class TerrainFileError(InputError):
    """A terrain grid that cannot be read."""


class BaselineFileError(InputError):
    """A baseline of known findings that cannot be read."""


class ProfileFileError(InputError):
    """A profile of a site that cannot be read."""


class LogFileError(InputError):
    """A flight log that cannot be read."""


class UsageError(MavjouleError):
    """Options that make no sense, alone or together."""


class MissingLibraryError(UsageError):
    """A library of an extra that is not installed."""


class ConfigurationError(MavjouleError):
    """A configuration file with a wrong key or value."""


class OutputError(MavjouleError):
    """A report that cannot be written."""


class WorkersError(MavjouleError):
    """A process that worked for this one was killed."""


class SplitError(MavjouleError):
    """A mission that cannot be split into flights that are each a go."""

    exit_code: ClassVar[ExitCode] = ExitCode.NO_GO


class FleetPlanError(MavjouleError):
    """Jobs that the vehicles, packs and hours of a fleet do not suffice for."""

    exit_code: ClassVar[ExitCode] = ExitCode.NO_GO


class CheckFailedError(MavjouleError):
    """A bug: nothing is known of what was asked, through no fault of the input."""

    exit_code: ClassVar[ExitCode] = ExitCode.NO_GO


class IdentificationError(MavjouleError):
    """Flight data that do not determine what is asked of them."""


class LinkError(MavjouleError):
    """The vehicle did not answer, or broke off."""

    exit_code: ClassVar[ExitCode] = ExitCode.LINK


EXTRAS = {
    "cluster": ("dask", "distributed"),
    "export": ("gpxpy", "simplekml"),
    "fleet": ("ortools", "scipy"),
    "identify": ("control", "pymavlink", "scipy"),
    "link": ("mavsdk", "pymavlink", "serial"),
    "parquet": ("pyarrow",),
    "report": ("altair", "jinja2", "vl_convert"),
    "terrain": ("rasterio",),
}
"""Modules that only an extra of the installation brings, ``pip install 'mavjoule[link]'``, by its name."""


def missing_library(error: BaseException) -> MissingLibraryError | None:
    """Return the error that names the extra a module is missing of; ``None`` for every other error.

    Where several bring it, that of the room it is imported in.
    """
    if not isinstance(error, ModuleNotFoundError):
        return None
    library = (error.name or "").partition(".")[0]
    extras = [extra for extra, modules in EXTRAS.items() if library in modules]
    if not extras:
        return None
    rooms: set[str] = set()
    trace = error.__traceback__
    while trace is not None:
        rooms.update(trace.tb_frame.f_globals.get("__name__", "").split(".")[1:2])
        trace = trace.tb_next
    extra = next((one for one in extras if one in rooms), extras[0])
    return _not_installed(library, extra)


@contextmanager
def libraries_of(extra: str) -> Iterator[None]:
    """Import within it what an extra brings; raise ``MissingLibraryError`` where that is missing."""
    try:
        yield
    except ImportError as error:
        raise _not_installed((error.name or "").partition(".")[0], extra) from error


def _not_installed(library: str, extra: str) -> MissingLibraryError:
    return MissingLibraryError(f"{library} is not installed: pip install 'mavjoule[{extra}]'")


def bug_text(error: BaseException) -> str:
    """Return the sentence about an error that is none of the above."""
    return f"this is a bug in mavjoule, not in your files: {type(error).__name__}: {error}"


def is_number(value: object) -> bool:
    """Return whether a value is a finite number that a float can hold."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    try:
        return math.isfinite(value)
    except OverflowError:  # a whole number of more than 308 digits
        return False


def described(value: object) -> str:
    """Return a short description of a value that is not what it should be."""
    match value:
        case bool():
            return str(value).lower()
        case dict():
            return "a table"
        case int() if not is_number(value):
            return "a whole number out of range"
        case list() | tuple():
            return shortened("[" + ", ".join(described(entry) for entry in value[:8]) + "]")
    return shortened(repr(value) if isinstance(value, str) else str(value))


def shortened(text: str) -> str:
    """Return a text that fits in a message."""
    return text if len(text) <= 40 else f"{text[:37]}..."


def nearest_hint(name: str, known: Iterable[str]) -> str:
    """Return a hint at the nearest known spelling, empty where none is near."""
    from difflib import get_close_matches

    close = get_close_matches(name, sorted(known), n=1)
    return f"; did you mean {close[0]}?" if close else ""


class PathTooLongError(Exception):
    """A path of more points or legs than can be looked at; its text says how many."""
