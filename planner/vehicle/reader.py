"""Reader of model files: strict, and with every problem of a file in one error."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from planner.autopilot import Autopilot
from planner.errors import described, nearest_hint, shortened
from planner.physics.response import TransferFunction
from planner.vehicle.battery import (
    Battery,
    chemistry_names,
    with_chemistry,
)
from planner.vehicle.battery_schema import BATTERY
from planner.vehicle.consistency import (
    mass_problems,
    power_problems_together,
    reference_problems,
)
from planner.vehicle.document import (
    MOST_BYTES,
    document_from_toml,
    file_error,
    single_problem,
)
from planner.vehicle.keys import Kind
from planner.vehicle.law_tables import MASS_TABLES, WHOLE_TABLES, cruise_law, hover_law
from planner.vehicle.model import (
    Loads,
    ManoeuvreResponse,
    Provenance,
    Ramps,
    Responses,
    ValidFor,
    VehicleModel,
)
from planner.vehicle.power import VerticalPower
from planner.vehicle.power_schema import (
    CRUISE_NOT_GIVEN,
    HOVER_NOT_GIVEN,
    HOVER_OF_CRUISE,
    LOADS,
    VERTICAL,
)
from planner.vehicle.ramp_schema import RAMPS
from planner.vehicle.response_schema import RESPONSE_TABLES
from planner.vehicle.schema import (
    FIT,
    PARAMETERS,
    PROVENANCE,
    SCHEMA,
    SPEED,
    TOP,
    VALID_FOR,
)
from planner.vehicle.spread_schema import SPREAD, STATE_SPREAD

if TYPE_CHECKING:
    from collections.abc import Mapping

    from planner.vehicle.keys import Table
    from planner.vehicle.model import ModelSpread


def read_vehicle(path: str | Path) -> VehicleModel:
    """Read a model file.

    Parameters
    ----------
    path : str or Path
        The file, ``<name>.toml``.

    Returns
    -------
    VehicleModel
        The model; its ``source`` is the path.

    Raises
    ------
    VehicleFileError
        If the file cannot be read or anything in it is wrong; ``problems`` holds all of it.
    """
    path = Path(path)
    source = str(path)
    try:
        with path.open("rb") as file:
            data = file.read(MOST_BYTES + 1)
    except (OSError, ValueError) as error:  # ValueError: a zero byte in the path
        reason = getattr(error, "strerror", None) or str(error)
        msg = f"cannot be read: {reason}"
        raise single_problem(msg, source=source) from error
    return vehicle_from_toml(data, name=path.stem, source=source)


def vehicle_from_toml(data: bytes, *, name: str, source: str) -> VehicleModel:
    """Return the model that the bytes of a model file describe.

    Parameters
    ----------
    data : bytes
        TOML in UTF-8.
    name : str
        The name the file must give its model: the stem of the file.
    source : str
        What errors and the model call the file.

    Returns
    -------
    VehicleModel
        The model.

    Raises
    ------
    VehicleFileError
        If anything is wrong; ``problems`` holds all of it.
    """
    content = _Content(document_from_toml(data, source=source))
    content.check(name)
    if content.problems:
        raise file_error(content.problems, source=source)
    try:
        return content.model(source)
    except ValueError as error:  # what only the values themselves can know
        raise single_problem(str(error), source=source) from error


class _Content:
    """The document of a model file, its problems, and the values made of it."""

    def __init__(self, document: dict[str, Any]) -> None:
        self.document = document
        self.problems: list[tuple[str, str]] = []
        self._cleaned: dict[str, dict[str, Any]] = {}
        self._chosen: dict[str, Table] = {}

    def check(self, name: str) -> None:
        """Collect every problem of the document, and the cleaned tables."""
        for table_name in dict.fromkeys(table.name for table in SCHEMA):
            self._check_table(table_name)
        given_name = self.document.get("name")
        if isinstance(given_name, str) and given_name != name:
            problem = (
                f"is {described(given_name)}, but the file is called {shortened(name)}.toml: "
                "they must be the same"
            )
            self.problems.append(("name", problem))
        self._check_together()

    def _check_table(self, name: str) -> None:
        variants = [table for table in SCHEMA if table.name == name]
        raw = self._raw(name)
        if raw is None:
            if variants[0].required:
                self.problems.append((name, f"is missing: the file needs a table [{name}]"))
            return
        if not isinstance(raw, dict):
            self.problems.append((name, f"must be a table [{name}], got {described(raw)}"))
            return
        table = self._variant(variants, raw)
        if table is None:
            return
        if table.selector is not None:
            raw = {key: value for key, value in raw.items() if key != table.selector[0]}
        if table is BATTERY:
            raw = self._with_chemistry(raw)
        problems = table.problems(raw, tables_inside=_tables_inside(name))
        self.problems += [(_dotted(name, key), problem) for key, problem in problems]
        if not problems:
            self._cleaned[name] = table.cleaned(raw)
            self._chosen[name] = table

    def _with_chemistry(self, raw: dict[str, Any]) -> dict[str, Any]:
        """Return a battery with the curves of its kind of cell, if it names one that is known."""
        chemistry = raw.get("chemistry")
        if not isinstance(chemistry, str) or not Kind.INTEGER.holds(raw.get("cells_in_series")):
            return raw  # what is wrong with either is told by the table
        if chemistry not in (names := chemistry_names()):
            hint = nearest_hint(chemistry, names)
            problem = f"must be one of {', '.join(names)}, got {described(chemistry)}{hint}"
            self.problems.append((_dotted(BATTERY.name, "chemistry"), problem))
            return raw
        return with_chemistry(raw)

    def _variant(self, variants: list[Table], raw: Mapping[str, Any]) -> Table | None:
        """Return the table the file selects; collect the problem where it selects none."""
        selectors = [table.selector for table in variants if table.selector is not None]
        if not selectors:
            return variants[0]
        key = selectors[0][0]
        values = [value for _, value in selectors]
        chosen = raw.get(key)
        for table, value in zip(variants, values, strict=True):
            if chosen == value:
                return table
        hint = nearest_hint(chosen, values) if isinstance(chosen, str) else ""
        got = f", got {described(chosen)}" if key in raw else ""
        problem = f"must be one of {', '.join(values)}{got}{hint}"
        self.problems.append((_dotted(variants[0].name, key), problem))
        return None

    def _check_together(self) -> None:
        reference = self._cleaned.get(TOP.name, {}).get("reference")
        if reference is not None:
            self.problems += reference_problems(
                Autopilot(reference),
                has_altitude_response=self._raw("responses.altitude") is not None,
                has_speed_response=self._raw("responses.speed") is not None,
                has_ramps=self._raw(RAMPS.name) is not None,
                has_default_speed=self._raw(SPEED.name) is not None,
                has_parameters=self._raw(PARAMETERS.name) is not None,
            )
            parameters = self._cleaned.get(PARAMETERS.name, {})
            if reference != Autopilot.STEP:
                from planner.vehicle.parameters.resolve import parameter_problems

                self.problems += [
                    (_dotted(PARAMETERS.name, key), problem)
                    for key, problem in parameter_problems(Autopilot(reference), parameters)
                ]
        hover, cruise = self._chosen.get("hover"), self._chosen.get("cruise")
        if hover is not None and cruise is not None:
            self.problems += power_problems_together(
                is_hover_of_cruise=hover is HOVER_OF_CRUISE,
                is_hover_known=hover is not HOVER_NOT_GIVEN,
                is_cruise_whole=cruise in WHOLE_TABLES,
                is_cruise_known=cruise is not CRUISE_NOT_GIVEN,
                has_vertical=self._raw(VERTICAL.name) is not None,
            )
        needing = [
            f'{table.selector[0]} = "{table.selector[1]}"'
            for table in (hover, cruise)
            if table is not None and table.selector is not None and table in MASS_TABLES
        ]
        self.problems += mass_problems(needing=needing, has_mass="mass_kg" in self.document)

    def _raw(self, dotted: str) -> object:
        """Return what the document holds under a dotted name, ``None`` where there is nothing."""
        found: object = self.document
        for part in dotted.split(".") if dotted else ():
            found = found.get(part) if isinstance(found, dict) else None
        return found

    def model(self, source: str) -> VehicleModel:
        """Return the model of a document without problems."""
        top = self._cleaned[TOP.name]
        reference = Autopilot(top.pop("reference"))
        vertical = self._cleaned.get(VERTICAL.name)
        loads = self._cleaned.get(LOADS.name)
        battery = self._cleaned.get(BATTERY.name)
        ramps = self._cleaned.get(RAMPS.name)
        return VehicleModel(
            **top,
            source=source,
            reference=reference,
            hover=hover_law(self._chosen["hover"], self._cleaned["hover"]),
            responses=self._responses(),
            ramps=None if ramps is None else Ramps(**ramps),
            cruise=cruise_law(self._chosen["cruise"], self._cleaned["cruise"]),
            loads=None if loads is None else Loads(**loads),
            vertical=None if vertical is None else VerticalPower(**vertical),
            battery=None if battery is None else Battery(**battery),
            default_speed_m_s=self._cleaned.get(SPEED.name, {}).get("default_m_s"),
            parameters=tuple(self._cleaned.get(PARAMETERS.name, {}).items()),
            spread=self._spread(),
            valid_for=ValidFor(**self._cleaned[VALID_FOR.name]),
            provenance=Provenance(
                **self._cleaned[PROVENANCE.name],
                fit=tuple(self._cleaned.get(FIT.name, {}).items()),
            ),
        )

    def _spread(self) -> ModelSpread | None:
        values = self._cleaned.get(SPREAD.name)
        if values is None:
            return None
        from planner.vehicle.model import ModelSpread

        states = self._cleaned.get(STATE_SPREAD.name, {})
        return ModelSpread(**values, energy_state_fraction=tuple(states.items()))

    def _responses(self) -> Responses:
        responses = {}
        for name, table in RESPONSE_TABLES.items():
            if (values := self._cleaned.get(table.name)) is not None:
                transfer_function = TransferFunction(
                    numerator=values.pop("numerator"),
                    denominator=values.pop("denominator"),
                    delay_s=values.pop("delay_s"),
                )
                responses[name] = ManoeuvreResponse(transfer_function=transfer_function, **values)
        return Responses(**responses)


def _tables_inside(name: str) -> set[str]:
    """Return the names of the tables directly inside a table."""
    prefix = f"{name}." if name else ""
    inside = {table.name.removeprefix(prefix) for table in SCHEMA if table.name.startswith(prefix)}
    return {part.split(".")[0] for part in inside if part}


def _dotted(table: str, key: str) -> str:
    shown = key if key.isprintable() else repr(key)
    return f"{table}.{shortened(shown)}" if table else shortened(shown)
