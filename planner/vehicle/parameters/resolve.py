"""The parameters a flight is predicted with: from the file, the model, or the defaults."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, TypeAlias

from planner import quantity
from planner.autopilot import Autopilot, Target
from planner.catalogue.parameter import (
    PARAMETER_IMPOSSIBLE,
    PARAMETER_MISSPELT,
    PARAMETER_OVERRULED,
    PARAMETER_RENAMED,
    PARAMETER_UNIT_SUSPECT,
    PARAMETER_UNKNOWN_TO_TARGET,
    PARAMETERS_ASSUMED,
    PARAMETERS_OF_ANOTHER_AUTOPILOT,
)
from planner.errors import nearest_hint
from planner.findings import Severity
from planner.frozen import frozen
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import ParameterSet, ParameterValue
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import Origin, OriginKind, parameter_table

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from planner.findings import Finding, Rule
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.table import Parameter, Spelling, Version


FlightParameters: TypeAlias = Px4Parameters | ArduPilotParameters

PARAMETERS_OF: Mapping[Autopilot, type[Px4Parameters] | type[ArduPilotParameters]] = {
    Autopilot.PX4: Px4Parameters,
    Autopilot.ARDUPILOT: ArduPilotParameters,
}
"""The parameters each autopilot flies missions with."""

_UNUSUAL = 30.0
"""A value so many times larger or smaller than usual may be in another unit."""
_USUAL_SI: Mapping[str, float] = {
    "corner_acceleration_m_s2": 5.0,
    "land_high_speed_m_s": 1.5,
    "return_final_altitude_m": 5.0,
    "return_climb_min_m": 5.0,
    "return_speed_m_s": 5.0,
    "pilot_descent_speed_m_s": 2.5,
    "pilot_takeoff_altitude_m": 2.5,
}
"""What is usual for quantities whose default is 0."""

_NAMED = 3
"""Parameters named in one finding; the others are counted."""


@frozen
class ResolvedParameters:
    """The parameters a flight is predicted with, and what has to be known about them."""

    values: FlightParameters
    """In SI, each with its origin."""
    findings: tuple[Finding, ...]


_OF_RALLY_POINTS = frozenset({"rally_limit_m", "rally_includes_home"})


def resolve_parameters(
    autopilot: Autopilot,
    *,
    file: ParameterSet | None = None,
    model: VehicleModel | None = None,
    version: Version | None = None,
    has_rally: bool = True,
) -> ResolvedParameters:
    """Return the value of every parameter a flight depends on, and where it comes from.

    Parameters
    ----------
    autopilot : Autopilot
        PX4 or ArduPilot.
    file : ParameterSet, optional
        The vehicle's own parameters; they come first.
    model : VehicleModel, optional
        Its ``[parameters]`` come second, if it was identified under this autopilot.
    version : tuple of int, optional
        Version of the firmware the parameters are for; default what the file says.
    has_rally : bool
        Whether there are rally points; without any, defaults of parameters about them are not told.

    Returns
    -------
    ResolvedParameters
        Parameters in SI with their origins; what is in neither has the autopilot's default.

    Raises
    ------
    ValueError
        If the autopilot is neither PX4 nor ArduPilot.
    """
    if autopilot not in PARAMETERS_OF:
        msg = f"{autopilot} has no parameters"
        raise ValueError(msg)
    resolution = _Resolution(autopilot, version)
    if file is not None:
        if file.stack is None or file.stack is autopilot:
            resolution.take(file, OriginKind.FILE)
            resolution.note_misspelt(file)
        else:
            resolution.refuse(file, file.stack)
    if model is not None and model.reference is autopilot:
        values = {name: ParameterValue(value) for name, value in model.parameters}
        resolution.take(
            ParameterSet(source=model.source, values=values, stack=autopilot), OriginKind.MODEL
        )
    untold = frozenset() if has_rally else _OF_RALLY_POINTS
    return resolution.resolved(() if file is None else file.findings, untold)


def parameter_problems(
    autopilot: Autopilot, values: Mapping[str, float]
) -> Iterator[tuple[str, str]]:
    """Yield (name, problem) for parameters of a model that an autopilot cannot fly with."""
    rows = {
        spelling.name: (row, spelling)
        for row in parameter_table(PARAMETERS_OF[autopilot]).values()
        for spelling in row.spellings
    }
    for name, value in values.items():
        if name not in rows:
            yield name, f"is no parameter of a mission flight{nearest_hint(name, rows)}"
            continue
        row, spelling = rows[name]
        if not row.is_possible(spelling.si(value)):
            yield name, f"cannot be {_with_unit(value, spelling)}"
        if spelling is not row.now and row.now.name in values:
            yield name, f"is the old name of {row.now.name}: give one of them"


class _Resolution:
    """Values found so far, and the sentences about them by rule."""

    def __init__(self, autopilot: Autopilot, version: Version | None) -> None:
        self.autopilot = autopilot
        self.version = version
        self.table = parameter_table(PARAMETERS_OF[autopilot])
        self.values_si: dict[str, float] = {}
        self.origins: dict[str, Origin] = {}
        self.impossible: list[str] = []
        self.suspect: list[str] = []
        self.unknown: list[str] = []
        self.misspelt: list[str] = []
        self.disagreeing: list[str] = []
        self.agreeing: list[str] = []
        self.findings: list[Finding] = []

    def refuse(self, given: ParameterSet, stack: Autopilot) -> None:
        """Note that a file belongs to another autopilot."""
        self.findings.append(
            PARAMETERS_OF_ANOTHER_AUTOPILOT.finding(
                f"{given.source} holds parameters of {stack.label}, the flight is predicted for "
                f"{self.autopilot.label}"
            )
        )

    def take(self, given: ParameterSet, kind: OriginKind) -> None:
        """Take every quantity that is not known yet from one set."""
        for field, row in self.table.items():
            present = [spelling for spelling in row.spellings if spelling.name in given.values]
            if field in self.origins or not present:
                continue
            spelling = present[0]
            if len(present) > 1:
                spelling = self._chosen(row, given)
            elif kind is OriginKind.FILE:
                self._note_unknown(row, given, spelling)
            entry = given.values[spelling.name]
            value_si = math.nan if entry.value is None else spelling.si(entry.value)
            if row.is_possible(value_si):
                value_si = round(value_si) if row.is_choice else value_si
                self.values_si[field] = value_si
                self.origins[field] = Origin(
                    kind=kind, name=spelling.name, source=given.source, line=entry.line
                )
                self._note_suspect(field, row, given, spelling)
            else:
                self.origins[field] = Origin(kind=OriginKind.DEFAULT, name=row.now.name)
                self.impossible.append(
                    f"{_described(given, spelling)} cannot be meant: "
                    f"{_with_unit(row.default, row.now)}, the default, is assumed"
                )

    def note_misspelt(self, given: ParameterSet) -> None:
        """Note names of a file that are nobody's, and a letter away from one that is missing."""
        known = {
            spelling.name
            for kind in PARAMETERS_OF.values()
            for row in parameter_table(kind).values()
            for spelling in row.spellings
        }
        missing = [
            spelling.name
            for field, row in self.table.items()
            if field not in self.origins
            for spelling in row.spellings
        ]
        nobodys = [name for name in given.values if name not in known]
        for name, meant in misspelt_names(nobodys, missing):
            entry = given.values[name]
            value = "" if entry.value is None else f" = {entry.value:g}"
            line = "" if entry.line is None else f" (line {entry.line})"
            self.misspelt.append(f"{name}{value}{line} is no parameter: is it {meant}?")

    def _note_unknown(self, row: Parameter, given: ParameterSet, spelling: Spelling) -> None:
        """Note a name that the version asked for does not know."""
        since = row.now.since
        if self.version is None or since is None or row.formerly is None:
            return
        known = row.now if self.version >= since else row.formerly
        if spelling is not known:
            firmware = Target(self.autopilot, self.version).label
            entry = given.values[spelling.name]
            line = "" if entry.line is None else f" (line {entry.line})"
            self.unknown.append(
                f"{firmware} does not know {spelling.name}{line}, it is {known.name} there"
            )

    def _note_suspect(
        self, field: str, row: Parameter, given: ParameterSet, spelling: Spelling
    ) -> None:
        """Note a value that would be usual in the unit of the quantity's other name."""
        value = given.values[spelling.name].value
        usual_si = _USUAL_SI.get(field, row.now.si(row.default))
        other = next((one for one in row.spellings if one is not spelling), None)
        if not value or other is None or other.unit == spelling.unit or usual_si <= 0.0:
            return

        def is_unusual(value_si: float) -> bool:
            return not usual_si / _UNUSUAL <= abs(value_si) <= usual_si * _UNUSUAL

        if is_unusual(spelling.si(value)) and not is_unusual(other.si(value)):
            self.suspect.append(
                f"{_described(given, spelling)} is flown as given; in the unit of {other.name} it "
                f"were {_with_unit(other.si(value) / row.now.si(1.0), row.now)}"
            )

    def _chosen(self, row: Parameter, given: ParameterSet) -> Spelling:
        """Return the spelling to use where both are present, and note that they are."""
        now, formerly = row.spellings
        version = self.version or given.version
        is_old = version is not None and now.since is not None and version < now.since
        chosen = formerly if is_old else now
        values_si = [
            math.nan if value is None else spelling.si(value)
            for spelling in row.spellings
            for value in (given.values[spelling.name].value,)
        ]
        agree = math.isclose(*values_si, rel_tol=1e-6)  # files hold 7 digits
        (self.agreeing if agree else self.disagreeing).append(
            f"{_described(given, formerly)} and {_described(given, now)} "
            f"{'mean the same' if agree else 'disagree'}: {chosen.name} is used"
        )
        return chosen

    def resolved(
        self, file_findings: tuple[Finding, ...], untold: frozenset[str]
    ) -> ResolvedParameters:
        """Return the parameters, with the defaults of what was found nowhere, told but for some."""
        assumed = [
            row.now.name
            for field, row in self.table.items()
            if field not in self.origins and field not in untold
        ]
        origins = dict(self.origins)
        for field, row in self.table.items():
            origins.setdefault(field, Origin(kind=OriginKind.DEFAULT, name=row.now.name))
        fields: dict[str, Any] = {**self.values_si, "origins": origins}
        values: FlightParameters = PARAMETERS_OF[self.autopilot](**fields)
        findings = [
            *file_findings,
            *self.findings,
            *_joined(PARAMETER_RENAMED, self.disagreeing + self.agreeing, self._renamed_severity),
            *_joined(PARAMETER_IMPOSSIBLE, self.impossible),
            *_joined(PARAMETER_UNIT_SUSPECT, self.suspect),
            *_joined(PARAMETER_UNKNOWN_TO_TARGET, self.unknown),
            *_joined(PARAMETER_MISSPELT, self.misspelt),
            *_joined(PARAMETER_OVERRULED, list(self._overruled(values))),
        ]
        if assumed:
            findings.append(PARAMETERS_ASSUMED.finding(self._assumed_sentence(assumed)))
        return ResolvedParameters(values=values, findings=tuple(findings))

    @property
    def _renamed_severity(self) -> Severity:
        return Severity.ERROR if self.disagreeing else Severity.WARNING

    def _overruled(self, values: FlightParameters) -> Iterator[str]:
        """Yield a sentence for every given value the vehicle will not fly at."""
        for field, given_si in self.values_si.items():
            row, flown_si = self.table[field], getattr(values, field)
            stands_for_another = row.zero_means is not None and given_si == 0.0
            # files hold single precision, PX4 writes what it overwrites with into them
            if not stands_for_another and not math.isclose(given_si, flown_si, rel_tol=1e-5):
                given, flown = given_si / row.now.si(1.0), flown_si / row.now.si(1.0)
                yield (
                    f"{self.origins[field]}: {row.now.name} = {_with_unit(given, row.now)} is "
                    f"overruled, {_with_unit(flown, row.now)} is flown"
                )

    def _assumed_sentence(self, assumed: list[str]) -> str:
        names = ", ".join(assumed[:_NAMED])
        more = len(assumed) - _NAMED
        rest = f" and {quantity.count(more, 'more parameter')}" if more > 0 else ""
        return f"{self.autopilot.label}'s defaults are assumed for {names}{rest}"


def _joined(
    rule: Rule, sentences: list[str], severity: Severity | None = None
) -> Iterator[Finding]:
    """Yield one finding for all sentences of a rule, none where there is none."""
    if sentences:
        more = (
            f", and {quantity.count(len(sentences) - 1, 'more parameter')}"
            if len(sentences) > 1
            else ""
        )
        yield rule.finding(sentences[0] + more, severity=severity)


def _described(given: ParameterSet, spelling: Spelling) -> str:
    entry = given.values[spelling.name]
    value = "no number" if entry.value is None else _with_unit(entry.value, spelling)
    return f"{spelling.name} = {value}" + ("" if entry.line is None else f" (line {entry.line})")


def _with_unit(value: float, spelling: Spelling) -> str:
    return f"{value:.6g} {spelling.unit}".rstrip()


def misspelt_names(given: Collection[str], wanted: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield (name given, name wanted) for names that nobody knows and that were meant otherwise.

    Parameters
    ----------
    given : collection of str
        Names of a file that are not known.
    wanted : collection of str
        Names that are known, and not in the file.

    Yields
    ------
    tuple of str
        Names apart by one letter too many, too few or wrong, or two that changed places.  Digits do
        not count: BATT2_CAPACITY is another battery.
    """
    for name in given:
        for other in wanted:
            if abs(len(name) - len(other)) <= 1 and _is_a_slip(name, other):
                yield name, other
                break


def _is_a_slip(given: str, wanted: str) -> bool:
    first = next(
        (at for at, (a, b) in enumerate(zip(given, wanted, strict=False)) if a != b),
        min(len(given), len(wanted)),
    )
    before, after = given[first:], wanted[first:]
    if len(given) == len(wanted):
        swapped = before[:2] == after[:2][::-1] and before[2:] == after[2:]
        replaced = before[1:] == after[1:]
        return swapped or (replaced and not (before[0].isdigit() or after[0].isdigit()))
    longer, shorter = (before, after) if len(given) > len(wanted) else (after, before)
    return longer[1:] == shorter and not longer[0].isdigit()
