"""Reader of model files: strict, and with every problem of a file in one error."""

from __future__ import annotations

import tomllib
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner import quantity
from planner.errors import VehicleFileError, described, nearest_hint, shortened
from planner.files import read_bounded, refuse_large, toml_document
from planner.vehicle.battery import Battery, Chemistry
from planner.vehicle.declared import Draft, InvalidValueError, declared, read_fields
from planner.vehicle.model import HOVER_WITHOUT_LAW, NOT_GIVEN, OF_CRUISE, VehicleModel
from planner.vehicle.power import WholeLaw

if TYPE_CHECKING:
    from collections.abc import Sequence

    from planner.errors import ProblemsError
    from planner.vehicle.declared import Field, Part, Problem

SCHEMA_VERSION = 1
MOST_BYTES = 1 << 18
_WHAT = "model file"
"""A model file is a few kilobytes; anything larger is another kind of file."""

_PACKAGE = Path(__file__).resolve().parents[1]


def models_root() -> Path:
    """Return the folder of the shipped models and kinds of cell."""
    packaged = _PACKAGE / "_data" / "models"  # in a wheel
    return packaged if packaged.is_dir() else _PACKAGE.parent / "models"


def read_vehicle(path: str | Path) -> VehicleModel:
    """Read a model file, ``<name>.toml``; the ``source`` of the model is the path.

    Raises
    ------
    VehicleFileError
        If the file cannot be read or anything in it is wrong; ``problems`` holds all of it.
    """
    data = read_bounded(path, most_bytes=MOST_BYTES, error=VehicleFileError, what=_WHAT)
    return vehicle_from_toml(data, name=Path(path).stem, source=str(path))


@lru_cache(maxsize=16)  # many missions are checked with one
def vehicle_from_toml(data: bytes, *, name: str, source: str) -> VehicleModel:
    """Return the model that TOML in UTF-8 describes.

    ``name`` is what the file must call its model, the stem of the file; ``source`` what errors and the model
    call the file.

    Raises
    ------
    VehicleFileError
        If anything is wrong; ``problems`` holds all of it.
    """
    refuse_large(data, source=source, most_bytes=MOST_BYTES, error=VehicleFileError, what=_WHAT)
    document = toml_document(data, source=source, error=VehicleFileError, what=_WHAT)
    refuse_version(
        document.pop("schema", None),
        source=source,
        error=VehicleFileError,
        after="models/README.md",
    )
    reading = Reading()
    held = reading.fields(VehicleModel, document)
    if isinstance(held["name"], str) and held["name"] != name:
        problem = (
            f"is {described(held['name'])}, but the file is called {shortened(name)}.toml: "
            "they must be the same"
        )
        reading.note("name", problem)
    draft: Any = Draft(**held)
    for key, problem in VehicleModel.inconsistencies(draft):
        reading.note(key, problem)
    law = reading.chosen.get("hover.law")
    is_of_cruise = isinstance(draft.cruise, WholeLaw)
    if not reading.problems and law == (NOT_GIVEN if is_of_cruise else OF_CRUISE):
        reading.note("hover.law", HOVER_WITHOUT_LAW)
    if reading.problems:
        raise file_error(reading.problems, source=source, error=VehicleFileError)
    return VehicleModel(source=source, **held)


def chemistry_names() -> tuple[str, ...]:
    """Return the names of the shipped kinds of cell, sorted."""
    return tuple(sorted(path.stem for path in (models_root() / "chemistries").glob("*.toml")))


@lru_cache(maxsize=16)
def load_chemistry(name: str) -> Chemistry:
    """Load a shipped kind of cell.

    Raises
    ------
    ValueError
        If its file is not as it must be: a mistake in what is shipped.
    """
    path = models_root() / "chemistries" / f"{name}.toml"
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    version = document.pop("schema", None)
    reading = Reading()
    chemistry = reading.part(Chemistry, document)
    if version != SCHEMA_VERSION or not isinstance(chemistry, Chemistry) or chemistry.name != name:
        msg = f"{path.name}: schema {version}, name {document.get('name')!r}, {reading.problems}"
        raise ValueError(msg)
    return chemistry


class Reading:
    """The problems found while the tables of a file are turned into values."""

    def __init__(self) -> None:
        self.problems: list[tuple[str, str]] = []
        self.chosen: dict[str, Any] = {}
        """What the file chose where a table has variants, by dotted key."""

    def note(self, key: str, problem: str) -> None:
        """Note a problem of a dotted key."""
        self.problems.append((key, problem))

    def fields(self, part: type[Part], raw: dict[str, Any], where: str = "") -> dict[str, Any]:
        """Return the fields of a part; drafts of those, and in those, with a problem."""
        fields = declared(part)
        held, problems = read_fields(part, raw)
        for key, problem in problems:
            self.note(where + key, problem)
            if key.partition(".")[0] in fields:
                held[key.partition(".")[0]] = Draft()
        for name, field in fields.items():
            if name not in held:
                if field.kind is None and name in raw:
                    held[name] = self._table(field, raw[name], where)
                else:
                    held[name] = Draft() if field.is_required else field.default
        return held

    def part(self, part: type[Part], raw: dict[str, Any], where: str = "") -> Part | Draft:
        """Return a part; a draft of it where it has problems."""
        before = len(self.problems)
        held = self.fields(part, raw, where)
        if len(self.problems) > before:
            return Draft(**held)
        try:
            return part(**held)
        except InvalidValueError as error:  # what only the fields together can tell
            for key, problem in error.problems:
                self.note(where + key, problem)
        return Draft(**held)

    def _table(self, field: Field, raw: object, where: str) -> Part | Draft | None:
        dotted = where + field.name
        if not isinstance(raw, dict):
            self.note(dotted, f"must be a table [{dotted}], got {described(raw)}")
            return Draft(**dict.fromkeys(declared(field.parts[0])))
        [part, *others] = field.parts
        if others:
            variants = {one.__struct_config__.tag: one for one in field.parts}
            selector = str(part.__struct_config__.tag_field)
            names = [*map(str, variants), *field.key.absent]
            raw = dict(raw)
            chosen = self.chosen[f"{dotted}.{selector}"] = raw.pop(selector, None)
            if chosen not in names:
                got = "" if chosen is None else f", got {described(chosen)}"
                hint = nearest_hint(chosen, names) if isinstance(chosen, str) else ""
                self.note(f"{dotted}.{selector}", f"must be one of {', '.join(names)}{got}{hint}")
                return Draft()
            if chosen in field.key.absent:
                for key in raw:
                    self.note(f"{dotted}.{key}", f'is not a key with {selector} = "{chosen}"')
                return None
            part = variants[chosen]
        elif part is Battery:
            raw = self._with_chemistry(raw)
        return self.part(part, raw, f"{dotted}.")

    def _with_chemistry(self, raw: dict[str, Any]) -> dict[str, Any]:
        """Return the table of a battery with the curves of its kind of cell where it gives none."""
        name, cells = raw.get("chemistry"), raw.get("cells_in_series")
        if not isinstance(name, str) or type(cells) is not int:
            return raw  # the table refuses what is wrong with either
        if name not in (names := chemistry_names()):
            hint = nearest_hint(name, names)
            problem = f"must be one of {', '.join(names)}, got {described(name)}{hint}"
            self.note("battery.chemistry", problem)
            return raw
        cell = load_chemistry(name)
        volts = [volts * cells for volts in cell.cell_ocv_v]
        temperatures, factors = cell.resistance_temperature_c, cell.resistance_factor
        curves: tuple[dict[str, Any], ...] = (
            {"ocv_soc": cell.ocv_soc, "ocv_v": volts},
            {"resistance_temperature_c": temperatures, "resistance_factor": factors},
        )
        for curve in curves:
            if not curve.keys() & raw.keys() and None not in curve.values():
                raw = raw | {name: list(values) for name, values in curve.items()}
        return raw


def refuse_version(version: object, *, source: str, error: type[ProblemsError], after: str) -> None:
    """Raise before anything else is judged: another version may mean everything differently."""
    if type(version) is int and version == SCHEMA_VERSION:
        return
    if version is None:
        problem = f"is missing: write schema = {SCHEMA_VERSION} at the top of the file"
    elif type(version) is int and SCHEMA_VERSION < version < 1_000_000:
        problem = (
            f"{version} is newer than this program, which reads schema {SCHEMA_VERSION}: "
            "update mavjoule"
        )
    else:
        problem = (
            f"must be {SCHEMA_VERSION}, got {described(version)}: there is no such version; "
            f"write the file again after {after}"
        )
    raise file_error([("schema", problem)], source=source, error=error)


def file_error(
    problems: Sequence[Problem], *, source: str, error: type[ProblemsError]
) -> ProblemsError:
    """Return the error of a file with problems (key, what is wrong); at least one."""
    key, message = problems[0]
    rest = quantity.count(len(problems) - 1, "more problem")
    more = f" (and {rest})" if len(problems) > 1 else ""
    return error(
        message + more,
        source=source,
        key=key,
        problems=tuple(f"{source}: {key}: {problem}" for key, problem in problems),
    )
