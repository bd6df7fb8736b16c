"""Settings from ``mavjoule.toml`` or ``[tool.mavjoule]`` of a ``pyproject.toml``.

The nearest folder of a mission upward that has one wins, and alone: nothing is merged.  A key is
the long option with underscores and the unit where it has one, or with hyphens as the option; a
path is relative to the file.
"""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.cli.options import CHECK_GROUPS
from planner.errors import ConfigurationError, InputError, UsageError, described, nearest_hint
from planner.files import read_bounded, toml_document
from planner.selection import exemptions_of
from planner.setting import declared
from planner.setup import SETTINGS_FILE, SettingsFile, files_named, settings
from planner.values import Value

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from planner.setting import Declared

OWN_FILE = "mavjoule.toml"
SHARED_FILE = "pyproject.toml"
_SHARED_TABLE = "tool.mavjoule"
_MOST_BYTES = 1 << 20
_WHAT = "settings file"


class Configuration(Value):
    """What one file sets."""

    values: Mapping[str, Any]
    """Values by the key of their setting."""
    path: Path | None = None
    """``None`` where there is no file."""


def find_configuration(folder: Path) -> Configuration:
    """Return the configuration of the nearest folder upward that has one; an empty one without any.

    Raises ConfigurationError if the nearest file is broken or holds a wrong key or value.
    """
    start = folder.resolve()
    for place in (start, *start.parents):
        for name in (OWN_FILE, SHARED_FILE):
            if _exists(place / name):
                found = read_configuration(place / name)
                if found is not None:
                    return found
    return Configuration(values={})


def _exists(path: Path) -> bool:
    """Return whether there is a file, or something else by the name of our own file."""
    try:
        return path.is_file() or (path.name == OWN_FILE and os.path.lexists(path))
    except OSError:  # a folder that may not be looked into holds no settings for us
        return False


def read_configuration(path: Path) -> Configuration | None:
    """Return the configuration in a file, ``None`` for a ``pyproject.toml`` that has none.

    Raises ConfigurationError if the file is broken or holds a wrong key or value.
    """
    document = _document(path)
    prefix = ""
    if path.name == SHARED_FILE:
        tools = document.get("tool", {})
        if not isinstance(tools, dict) or "mavjoule" not in tools:
            return None
        document, prefix = tools["mavjoule"], f"{_SHARED_TABLE}."
        if not isinstance(document, dict):
            msg = f"{path}: {_SHARED_TABLE} must be a table, got {described(document)}"
            raise ConfigurationError(msg)
    known = {key: setting for key, setting in settings().items() if setting.in_file}
    values = {}
    for name, raw in document.items():
        key = name.replace("-", "_")
        setting = known.get(key)
        if setting is None and (typed := settings().get(key)) is not None:
            msg = f"{path}: {prefix}{name} may not be set by a file: give {typed.option}"
            raise ConfigurationError(msg)
        if setting is None:
            shown = name if name.isprintable() else repr(name)
            msg = f"{path}: {prefix}{shown} is not a setting{nearest_hint(key, known)}"
            raise ConfigurationError(msg)
        if key in values:
            msg = f"{path}: {prefix}{name} is given twice, with hyphens and with underscores"
            raise ConfigurationError(msg)
        try:
            values[key] = setting.kind.from_toml(raw, path)
        except ValueError as error:
            msg = f"{path}: {prefix}{name}: {error}"
            raise ConfigurationError(msg) from error
    return Configuration(values=values, path=path)


def _document(path: Path) -> dict[str, Any]:
    if path.exists() and not path.is_file():
        msg = f"{path}: must be a file, to hold settings"
        raise ConfigurationError(msg)
    try:
        data = read_bounded(path, most_bytes=_MOST_BYTES, error=InputError, what=_WHAT)
        if path.name == SHARED_FILE and b"mavjoule" not in data:
            return {}  # someone else's file, broken or not
        return toml_document(data, source=str(path), error=InputError, what=_WHAT)
    except InputError as error:
        place = error.place
        where = "" if place is None else f" (line {place.line}, column {place.column})"
        msg = f"{path}: {error.message}{where}"
        raise ConfigurationError(msg) from error


def mission_settings(mission: str, given: Mapping[str, Any]) -> dict[str, Any]:
    """Return the settings of one mission by key: the command line's over its configuration's.

    The folder of ``-``, standard input, is the current one; ``per_file_ignores`` are the exemptions that
    this mission meets.
    """
    path = Path(mission)
    found = find_configuration(path.parent)
    own = dict(found.values)
    if met := exemptions_of(own.pop("per_file_ignores", ()), path):
        own["per_file_ignores"] = met
    declared = settings()
    texts = tuple((key, declared[key].kind.text(own[key])) for key in own if key not in given)
    if not texts:
        return {**own, **given}
    return {**own, **given, SETTINGS_FILE: SettingsFile(path=_shown(found.path), values=texts)}


def files_read(missions: Sequence[str], *settings: Mapping[str, Any]) -> list[str]:
    """Return every file that is read for missions under settings by key: theirs, and those these name.

    With them the settings files, also those of which every value was given otherwise.
    """
    folders = dict.fromkeys(Path(mission).parent for mission in missions)
    found = (find_configuration(folder).path for folder in folders)
    named = (file for values in settings for file in files_named(values))
    return [*missions, *dict.fromkeys(named), *(str(path) for path in found if path is not None)]


def _shown(path: Path | None) -> str:
    """Return a path as whoever called knows it: from the current folder where it lies below."""
    here = Path.cwd()
    below = path is not None and path.is_relative_to(here)
    return str(path.relative_to(here) if path is not None and below else path)


def typed_settings(mission: str, given: Mapping[str, Any], *, command: str) -> dict[str, Any]:
    """Return the settings of a command that obeys only what was typed.

    A file beside a mission comes from whoever made the mission: it must neither let a vehicle arm nor
    put a mission there.

    Raises
    ------
    UsageError
        If a configuration sets how a mission is flown or judged, and the command line does not.
    """
    values = mission_settings(mission, given)
    file = values.pop(SETTINGS_FILE, None)
    if file is not None:
        declared = settings()
        judging = [declared[key] for key, _ in file.values if declared[key].group in CHECK_GROUPS]
        if judging:
            names = ", ".join(setting.key for setting in judging)
            options = ", ".join(setting.option for setting in judging if setting.option)
            typed = f"give {options}, or" if options else "give its codes to --ignore, or"
            msg = f"{command} obeys only what is typed, and {file.path} sets {names}: {typed} move the file"
            raise UsageError(msg)
    return dict(given)


def common_settings(missions: Sequence[Mapping[str, Any]], cls: type[Declared]) -> dict[str, Any]:
    """Return the settings of a value that is one for all missions of a call, by key.

    Raises UsageError if the configurations of two missions see it differently.
    """
    common: dict[str, Any] = {}
    for setting in declared(cls):
        values = {mission.get(setting.key) for mission in missions}
        if len(values) > 1:
            msg = (
                f"the configurations of these missions disagree about {setting.key}: "
                f"give {setting.option}, or check them one by one"
            )
            raise UsageError(msg)
        if (value := values.pop()) is not None:
            common[setting.key] = value
    files = [file for mission in missions if (file := mission.get(SETTINGS_FILE)) is not None]
    if files:
        paths = ", ".join(dict.fromkeys(file.path for file in files))
        texts = {key: text for file in files for key, text in file.values}
        common[SETTINGS_FILE] = SettingsFile(path=paths, values=tuple(texts.items()))
    return common
