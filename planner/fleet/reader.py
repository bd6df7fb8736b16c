"""Reader of fleet files, TOML: strict, and with every problem of a file in one error.

The keys of each table are declared by the classes of `planner.fleet.fleet`, those of ``[conditions]``
and of the settings among a vehicle's and a pack's by `planner.setup`.  Paths count from the folder of
the file; nothing in it names what is written.
"""

from __future__ import annotations

import hashlib
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from planner.errors import FleetFileError, MavjouleError, described, nearest_hint
from planner.files import read_bounded, toml_document
from planner.fleet.fleet import (
    Charger,
    Fault,
    Fleet,
    FleetOperation,
    FleetVehicle,
    Job,
    Layers,
    NamedPart,
    Pack,
    Pad,
    Separation,
    Sortie,
    Swap,
    SwarmTask,
    VehicleTable,
)
from planner.setting import Group
from planner.setup import RestVoltage, Setup, files_named, settings
from planner.values import field_values, replace
from planner.vehicle.declared import Draft, Part, shown
from planner.vehicle.library import load_vehicle
from planner.vehicle.reader import Reading, file_error, refuse_version

if TYPE_CHECKING:
    from collections.abc import Iterable, Mapping

    from planner.setting import Setting, SettingValue

    Settings = Mapping[str, SettingValue]
    _Named = dict[str, tuple[Part | Draft, dict[str, SettingValue]]]

MOST_BYTES = 1 << 22
"""A thousand vehicles with ten sorties each are a megabyte."""
WHAT = "fleet file"
_NAME = re.compile(r"\w[\w.-]{0,39}")
_NAME_LENGTH = "1 to 40, the first neither - nor ."
"""Files of a plan are called by it."""
_NAMED: Mapping[type[NamedPart], str] = {
    VehicleTable: "vehicle",
    Pack: "pack",
    Charger: "charger",
    Pad: "pad",
    Job: "job",
    Sortie: "sortie",
    Fault: "fault",
}
TABLES = ("operation", "conditions", "separation", "layers", "swarm", "swap", *_NAMED.values())
"""Tables of a fleet file, in the order of the documentation."""
FILE_IGNORES = "per_file_ignores"
_WHOLE = frozenset({"fail_on", FILE_IGNORES, "select", "extend_select", "ignore", "baseline"})
"""Settings of the whole group, not of a vehicle."""
_OF_PAD = frozenset({"vehicle", "home_amsl_m"})
"""What the file says otherwise: ``model``, and ``amsl_m`` of a pad."""
_REFERENCES: Mapping[type[NamedPart], Mapping[str, str]] = {
    VehicleTable: {"pad": "pad"},
    Pack: {"fits": "vehicle"},
    Charger: {"packs": "pack"},
    Sortie: {"job": "job", "vehicle": "vehicle", "pack": "pack", "pad": "pad"},
    Fault: {"vehicle": "vehicle"},
}
"""Keys that name another table, and which."""

P = TypeVar("P", bound=Part)
N = TypeVar("N", bound=NamedPart)


def condition_settings() -> dict[str, Setting]:
    """Return the settings that ``[conditions]`` may hold, by key."""
    return {
        key: one
        for key, one in settings().items()
        if one.group in {Group.FLIGHT, Group.JUDGEMENT} and one.in_file and key not in _OF_PAD
    }


def vehicle_settings() -> dict[str, Setting]:
    """Return the settings that ``[vehicle.NAME]`` may hold, by key."""
    return {key: one for key, one in condition_settings().items() if key not in _WHOLE}


def pack_settings() -> dict[str, Setting]:
    """Return the settings that ``[pack.NAME]`` may hold, by key."""
    return {key: one for key, one in settings().items() if one.group is Group.BATTERY}


def read_fleet(path: str | Path, *, given: Settings | None = None) -> Fleet:
    """Read a fleet file and the vehicle models, parameters and grids it names; missions are not opened.

    Parameters
    ----------
    path : str or Path
        The file.
    given : mapping, optional
        Settings by key that count before those of the file, for every vehicle.

    Raises
    ------
    FleetFileError
        If the file cannot be read or anything in it is wrong; ``problems`` holds all of it.
    """
    source = str(path)
    data = read_bounded(path, most_bytes=MOST_BYTES, error=FleetFileError, what=WHAT)
    document = toml_document(data, source=source, error=FleetFileError, what=WHAT)
    refuse_version(
        document.pop("schema", None),
        source=source,
        error=FleetFileError,
        after="missions/README.md",
    )
    reading = _FleetReading(Path(path), given or {})
    fleet = reading.fleet(document, source=source)
    if reading.problems:
        raise file_error(reading.problems, source=source, error=FleetFileError)
    return replace(fleet, digest=digest(data))


def digest(data: bytes) -> str:
    """Return what tells whether a fleet file has changed."""
    return hashlib.sha256(data).hexdigest()


def is_fleet_file(path: str | Path) -> bool:
    """Return whether a file has the tables of a fleet; nothing is said of what it says of them."""
    try:
        data = read_bounded(path, most_bytes=MOST_BYTES, error=FleetFileError, what=WHAT)
        document = toml_document(data, source=str(path), error=FleetFileError, what=WHAT)
    except FleetFileError:
        return False
    return all(isinstance(document.get(one), dict) for one in ("vehicle", "job"))


class _FleetReading(Reading):
    """The problems found while the tables of a fleet file are turned into values."""

    def __init__(self, path: Path, given: Settings) -> None:
        super().__init__()
        self._path = path
        self._given = given
        self._files: dict[tuple[str, str], Any] = {}
        """What was read from a file that a setting names, by key and what is written."""
        self._named_files: dict[str, None] = {}

    def fleet(self, document: dict[str, Any], *, source: str) -> Fleet:
        """Return the fleet of a document; with problems it is not whole."""
        for name in document:
            if name not in TABLES:
                self.note(shown(name), f"is not a table of this file{nearest_hint(name, TABLES)}")
        known = condition_settings()
        conditions, rest = self._settings(
            self._table_of(document, "conditions"), known, "conditions."
        )
        for key in rest:
            self.note(
                f"conditions.{shown(key)}", f"is not a key of this file{nearest_hint(key, known)}"
            )
        # Which are met each mission tells, no vehicle.
        ignores: Any = conditions.pop(FILE_IGNORES, ())
        named = {part: self._named(document, part) for part in _NAMED}
        setups = {
            name: self._setup(one, {**conditions, **own}, f"vehicle.{shown(name)}")
            for name, (one, own) in named[VehicleTable].items()
        }
        self._cross_check(named, document)
        return Fleet(
            source=source,
            vehicles={
                name: FleetVehicle(**field_values(one), setup=setups[name])
                for name, one in _right(named, VehicleTable)
            },
            packs={each.name: each for _, one in _right(named, Pack) for each in _each(one)},
            chargers=dict(_right(named, Charger)),
            pads=dict(_right(named, Pad)),
            jobs=dict(_right(named, Job)),
            sorties=dict(_right(named, Sortie)),
            faults=dict(_right(named, Fault)),
            operation=self._single(document, "operation", FleetOperation) or FleetOperation(),
            separation=self._single(document, "separation", Separation),
            layers=self._single(document, "layers", Layers),
            swarm=self._single(document, "swarm", SwarmTask),
            swap=self._single(document, "swap", Swap),
            setting_files=tuple(self._named_files),
            file_ignores=ignores,
        )

    def _table_of(self, document: Mapping[str, Any], name: str, where: str = "") -> dict[str, Any]:
        """Return a table; an empty one where it is not given, or is none."""
        raw = document.get(name, {})
        if isinstance(raw, dict):
            return raw
        self.note(where + name, f"must be a table [{where}{name}], got {described(raw)}")
        return {}

    def _single(self, document: Mapping[str, Any], name: str, part: type[P]) -> P | None:
        if name not in document:
            return None
        found = self.part(part, self._table_of(document, name), f"{name}.")
        return found if isinstance(found, part) else None

    def _named(self, document: Mapping[str, Any], part: type[NamedPart]) -> _Named:
        """Return the tables ``[table.NAME]``, each with the settings among its keys."""
        table = _NAMED[part]
        settings_of = {VehicleTable: vehicle_settings, Pack: pack_settings}.get(part, dict)
        known: Mapping[str, Setting] = settings_of()
        found: _Named = {}
        tables = self._table_of(document, table)
        for name in tables:
            where = f"{table}.{shown(name)}"
            if not _NAME.fullmatch(name):
                self.note(where, f"must be a name of letters, digits, _, - and . ({_NAME_LENGTH})")
            own, rest = self._settings(
                self._table_of(tables, name, f"{table}."), known, f"{where}."
            )
            for key, beside in (("mission", self._beside), ("model", self._model)):
                if isinstance(rest.get(key), str) and rest[key].strip():
                    rest[key] = beside(rest[key])
            battery = own.pop("battery", None)
            one = self.part(part, rest, f"{where}.")
            if isinstance(one, Pack):
                one = replace(one, battery=battery or one.battery, settings=own)
            found[name] = (replace(one, name=name) if isinstance(one, NamedPart) else one), own
        return found

    def _beside(self, text: str) -> str:
        """Return a path counted from the folder of the file."""
        return str(self._path.parent / text)

    def _model(self, text: str) -> str:
        """Return the path of a model counted from there, and a name as it is."""
        return str(settings()["vehicle"].kind.from_toml(text, self._path))

    def _settings(
        self, raw: Mapping[str, Any], known: Mapping[str, Setting], where: str
    ) -> tuple[dict[str, SettingValue], dict[str, Any]]:
        """Return the settings among the keys of a table, and its other keys."""
        values: dict[str, SettingValue] = {}
        rest: dict[str, Any] = {}
        for key, written in raw.items():
            if key not in known or (key == "battery" and isinstance(written, dict)):
                rest[key] = written
                continue
            try:
                values[key] = known[key].kind.from_toml(written, self._path)
            except ValueError as error:
                self.note(f"{where}{key}", str(error))
            if isinstance(values.get(key), RestVoltage):
                del values[key]
                self.note(
                    f"{where}{key}", "give it as a percentage: packs of a fleet are charged anew"
                )
        return values, rest

    def _setup(self, vehicle: Part | Draft, own: Settings, where: str) -> Setup:
        """Return how a vehicle is flown, without a pack."""

        def loaded(setting: Setting, written: SettingValue) -> SettingValue:
            if setting.load is None:
                return written
            at = (setting.key, repr(written))
            if at not in self._files:
                try:
                    self._files[at] = setting.loaded(written)
                except MavjouleError as error:
                    key = "model" if setting.key == "vehicle" else setting.key
                    self.note(f"{where}.{key}", str(error))
                    self._files[at] = load_vehicle() if key == "model" else None
            return self._files[at]

        model = getattr(vehicle, "model", None)
        values = {"vehicle": model if isinstance(model, str) else None, **own, **self._given}
        self._named_files |= dict.fromkeys(files_named(values))
        return Setup.of(values, loaded=loaded)

    def _cross_check(
        self, named: Mapping[type[NamedPart], _Named], document: Mapping[str, Any]
    ) -> None:
        """Note names that stand for nothing, and what is missing beside something else."""
        names = {_NAMED[part]: {*tables} for part, tables in named.items()}
        for name in ("vehicle",) if "swarm" in document else ("vehicle", "job"):
            if not names[name]:
                self.note(name, f"is missing: the file needs a table [{name}.NAME]")
        if len(names["vehicle"]) > 1 and "separation" not in document:
            self.note("separation", "is missing: say how far the vehicles keep apart")
        if names["pack"] and "swap" not in document:
            self.note("swap", "is missing: say how long it takes to change a pack")
        one_each = {each.name for _, one in _right(named, Pack) for each in _each(one)}
        for part, keys in _REFERENCES.items():
            for name, (one, _) in named[part].items():
                for key, table in keys.items():
                    known = names[table] | (one_each if table == "pack" else set())
                    if part is Sortie and table == "pack":
                        known = one_each
                    self._refer(
                        f"{_NAMED[part]}.{shown(name)}.{key}", getattr(one, key, None), known
                    )

    def _refer(self, key: str, given: object, known: set[str]) -> None:
        for name in given if isinstance(given, tuple) else (given,):
            if isinstance(name, str) and name not in known:
                self.note(key, f"there is none called {described(name)}{nearest_hint(name, known)}")


def _right(named: Mapping[type[NamedPart], _Named], part: type[N]) -> Iterable[tuple[str, N]]:
    """Yield the parts without a problem by name."""
    for name, (one, _) in named[part].items():
        if isinstance(one, part):
            yield name, one


def _each(pack: Pack) -> Iterable[Pack]:
    """Return the packs a table stands for."""
    names = [pack.name]
    if pack.count > 1:
        names = [f"{pack.name}-{number + 1}" for number in range(pack.count)]
    return (replace(pack, name=name, group=pack.name) for name in names)
