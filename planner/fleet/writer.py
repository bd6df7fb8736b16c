"""Writer of fleet files: a fleet file as it was given, with the sorties of a plan, for another folder."""

from __future__ import annotations

import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.errors import FleetFileError
from planner.files import read_bounded, toml_document
from planner.fleet.reader import FILE_IGNORES, MOST_BYTES, TABLES, WHAT, digest
from planner.setting import File, Files
from planner.setup import settings
from planner.vehicle.writer import toml_key, toml_value

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from planner.fleet.fleet import Fleet

_MODEL = "model"


def fleet_file_text(fleet: Fleet, folder: str | Path) -> str:
    """Return the text of the file of a fleet, with its sorties, and with paths counted from another folder.

    Parameters
    ----------
    fleet : Fleet
        As it was read, with other sorties; their own mission files as they are opened, and patterns of
        files as they are met there.
    folder : str or Path
        Where the text is to be written.

    Raises
    ------
    FleetFileError
        If the file cannot be read any more, or is another by now.
    """
    source, folder = Path(fleet.source), Path(folder)
    data = read_bounded(source, most_bytes=MOST_BYTES, error=FleetFileError, what=WHAT)
    if digest(data) != fleet.digest:
        msg = "has changed since it was read: plan it again"
        raise FleetFileError(msg, source=fleet.source)
    document = toml_document(data, source=str(source), error=FleetFileError, what=WHAT)
    document["sortie"] = {
        name: {
            key: _from(folder, given) if key == "mission" else given
            for key in ("job", "vehicle", "start_s", "pack", "pad", "mission")
            if (given := getattr(one, key)) is not None
        }
        for name, one in fleet.sorties.items()
    }
    moved = {
        table: _moved(document[table], source, folder) if table != "sortie" else document[table]
        for table in TABLES
        if table in document
    }
    if FILE_IGNORES in (conditions := moved.get("conditions", {})):
        conditions[FILE_IGNORES] = _ignored(fleet)
    lines = [f"schema = {toml_value(document['schema'])}"] if "schema" in document else []
    for table, keys in moved.items():
        lines += _table(toml_key(table), keys)
    return "\n".join(lines).lstrip("\n") + "\n"


def _moved(keys: Mapping[str, Any], source: Path, folder: Path) -> dict[str, Any]:
    """Return the keys of a table, and of those in it, with paths counted from a folder."""
    known = settings()
    found: dict[str, Any] = {}
    for key, value in keys.items():
        kind = known["vehicle"].kind if key == _MODEL else getattr(known.get(key), "kind", None)
        if isinstance(value, dict):
            found[key] = _moved(value, source, folder)
        elif key == "mission" and isinstance(value, str):
            found[key] = _from(folder, source.parent / value)
        elif isinstance(kind, Files) and isinstance(value, list):
            found[key] = [_from(folder, source.parent / one) for one in value]
        elif isinstance(kind, File) and isinstance(value, str):
            # A name, and a path that is whole, are the same from any folder.
            is_path = kind.beside(value, Path("elsewhere")) != value
            found[key] = _from(folder, kind.beside(value, source.parent)) if is_path else value
        else:
            found[key] = value
    return found


def _ignored(fleet: Fleet) -> dict[str, list[str]]:
    """Return the codes that are not reported of some files, by pattern and item."""
    found: dict[str, dict[str, None]] = {}
    for one in fleet.file_ignores:
        item = "" if one.exemption.item is None else f"#{one.exemption.item}"
        found.setdefault(one.pattern + item, {}).update(dict.fromkeys(one.exemption.codes))
    return {key: [*codes] for key, codes in found.items()}


def _from(folder: Path, path: str | Path) -> str:
    """Return a path counted from a folder, an absolute one as it is."""
    path = Path(path)
    return str(path) if path.is_absolute() else Path(os.path.relpath(path, folder)).as_posix()


def _table(name: str, keys: Mapping[str, Any]) -> Iterator[str]:
    """Yield the lines of a table, then of those in it."""
    plain = {key: value for key, value in keys.items() if not isinstance(value, dict)}
    if plain or not keys:
        yield from ("", f"[{name}]")
        yield from (f"{toml_key(key)} = {toml_value(value)}" for key, value in plain.items())
    for key, value in keys.items():
        if isinstance(value, dict):
            yield from _table(f"{name}.{toml_key(key)}", value)
