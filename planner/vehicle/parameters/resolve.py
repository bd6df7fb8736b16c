"""The parameters a flight is predicted with: from the file, the model, or the defaults."""

from __future__ import annotations

import math
from bisect import bisect_left
from functools import lru_cache
from typing import TYPE_CHECKING, Any, TypeAlias

from planner import quantity
from planner.autopilot import Autopilot, Target
from planner.findings import Rule, Severity
from planner.values import Value
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.files import ParameterSet, ParameterValue
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import Origin, OriginKind, Spelling, parameter_table

if TYPE_CHECKING:
    from collections.abc import Collection, Iterator, Mapping

    from planner.findings import Finding
    from planner.vehicle.model import VehicleModel
    from planner.vehicle.parameters.table import Parameter, Version


PARAMETERS_ASSUMED = Rule(
    "P101 parameters-assumed",
    Severity.INFO,
    summary="Autopilot parameters the flight depends on are not given; defaults are assumed.",
    why="Speeds, accelerations and return heights are set on every vehicle; a plan checked against "
    "the defaults is a plan for another vehicle.",
    how="A parameter is taken from the parameter file, else from the model's [parameters], else the "
    "autopilot's multicopter default is assumed; the finding names those assumed.",
    fix="give the vehicle's own parameters with --params",
)

PARAMETERS_OF_ANOTHER_AUTOPILOT = Rule(
    "P106 parameters-of-another-autopilot",
    Severity.ERROR,
    summary="The parameter file belongs to another autopilot than the one predicted.",
    why="None of its names means anything to the other: the prediction would rest on defaults.",
    how="The file's header, or else the names in it, show whose it is; of ArduPilot's, names that only "
    "Plane, Rover, Sub or Blimp has (TECS_, KFF_, ATC_STR_RAT_, JS_GAIN_, FINS_ …) and none that only Copter "
    "has.",
    fix="give the file of this vehicle, or choose the autopilot with --autopilot",
    instead="the vehicle's own parameters with --params",
)

PARAMETER_RENAMED = Rule(
    "P102 parameter-renamed",
    Severity.ERROR,
    summary="A parameter is given under its old and its new name.",
    why="ArduPilot 4.7 renamed its parameters and changed from centimetres to metres; a file with "
    "both names does not show which of them is used (ArduPilot #31562, MissionPlanner #3678).",
    how="Both names of one quantity are present.  The one of the file's firmware version is used, the "
    "new one where no version is given.  Only a warning where both mean the same.",
    fix="save the parameters again from the vehicle, or delete the name that its firmware does not use",
    instead="parameters of --params under one name each",
)

PARAMETER_IMPOSSIBLE = Rule(
    "P105 parameter-impossible",
    Severity.ERROR,
    summary="A parameter has a value it cannot have; the default is assumed.",
    why="A value in the unit of another firmware version is off by a factor of 100: WP_SPD = 500 "
    "would be 500 m/s, WPNAV_SPEED = 5 would be 5 cm/s (ArduPilot #31562).",
    how="The value in SI is outside what a multicopter can mean, or is not a number.",
    fix="correct the value; look at the unit first",
    instead="--params with possible values",
)

PARAMETER_OVERRULED = Rule(
    "P107 parameter-overruled",
    Severity.WARNING,
    summary="A parameter is overruled by another one, as it will be on the vehicle.",
    why="The vehicle will not fly at the value that was set.",
    how="PX4 keeps design values inside its absolute limits (MPC_XY_CRUISE inside MPC_XY_VEL_MAX), "
    "and overwrites them where MPC_XY_VEL_ALL, MPC_Z_VEL_ALL or SYS_VEHICLE_RESP is not negative; a take-off "
    "with MPC_TKO_SPEED above 1.3 times MPC_Z_VEL_MAX_UP brakes to a full stop again and again up to "
    "MPC_LAND_ALT1 (FlightTaskAuto::_checkEmergencyBraking; flown 0.6 m/s for 1 m/s); ArduPilot "
    "accelerates no more than the lean allows, g tan(PSC_ANGLE_MAX), or of ATC_ANGLE_MAX where that is 0.",
    fix="raise the limit on the vehicle, or lower the value",
)

PARAMETER_UNIT_SUSPECT = Rule(
    "P108 parameter-unit-suspect",
    Severity.ERROR,
    summary="A parameter has a value that looks as if it was meant in its other unit.",
    why="ArduPilot 4.7 changed from centimetres to metres: RTL_ALT_M = 1500 is 1500 m, RTL_ALT = 15 "
    "is 15 cm, and both are possible values (ArduPilot #31562, MissionPlanner #3678).",
    how="The value is more than 30 times larger or smaller than usual, and a hundredth or hundred "
    "times of it is not.  Usual is the default, or the value in effect where that is 0.",
    fix="correct the value, or ignore the code where it is meant",
)

PARAMETER_UNKNOWN_TO_TARGET = Rule(
    "P109 parameter-unknown-to-target",
    Severity.WARNING,
    summary="A parameter's name does not exist in this version of the firmware.",
    why="A vehicle ignores unknown names and keeps its values: a file of ArduPilot 4.6 loaded into "
    "4.7 sets none of the renamed parameters (ArduPilot #31970).",
    how="The version of --target against the version in which the parameter was renamed; not of a file "
    "that names this version itself, nor of a vehicle on the line, whose names are those it has.  The "
    "value is used all the same.",
    fix="save the parameters again from the vehicle",
)

PARAMETER_MISSPELT = Rule(
    "P110 parameter-misspelt",
    Severity.ERROR,
    summary="A parameter's name exists in no version, and is a letter away from one that matters.",
    why="A vehicle ignores unknown names and keeps its value, and the prediction takes the default: "
    "neither is the value in the file.",
    how="Unknown names of the parameter file, against those the flight depends on and the file does "
    "not hold: one letter too many, too few or wrong, or two swapped.  A digit makes another parameter "
    "(BATT2_CAPACITY).",
    fix="correct the name, or delete the line",
    instead="--params with the right name",
)

FlightParameters: TypeAlias = Px4Parameters | ArduPilotParameters

PARAMETERS_OF: Mapping[Autopilot, type[Px4Parameters] | type[ArduPilotParameters]] = {
    Autopilot.PX4: Px4Parameters,
    Autopilot.ARDUPILOT: ArduPilotParameters,
}
"""The parameters each autopilot flies missions with."""

_OTHER = {Autopilot.PX4: Autopilot.ARDUPILOT, Autopilot.ARDUPILOT: Autopilot.PX4}
_NOTED = (
    PARAMETER_RENAMED,
    PARAMETER_IMPOSSIBLE,
    PARAMETER_UNIT_SUSPECT,
    PARAMETER_UNKNOWN_TO_TARGET,
    PARAMETER_MISSPELT,
    PARAMETER_OVERRULED,
)
"""What is noted of single parameters, in the order of the findings."""
_UNUSUAL = 30.0
"""A value so many times larger or smaller than usual may be in another unit."""
_OF_SUB_TOO = frozenset(
    {
        *("WPNAV_SPEED", "WP_SPD", "PILOT_SPEED_UP", "PILOT_SPD_UP"),
        *("MOT_THST_HOVER", "ANGLE_MAX", "ATC_ANGLE_MAX"),
    }
)
"""Names of Copter's that a submarine has as well."""
COPTER_ONLY = _OF_SUB_TOO | {"LAND_SPEED", "RTL_ALT", "RTL_ALT_M"}
"""Names of Copter's that no plane, rover or blimp of ArduPilot's has: a plane's begin with Q_, its return
has ALT_HOLD_RTL, later RTL_ALTITUDE."""
_OTHER_VEHICLES: Mapping[str, tuple[str, ...]] = {
    "ArduSub": (
        "JS_GAIN_",
        "JS_THR_GAIN",
        "BTN0_",
        "FRAME_CONFIG",
        "SURFACE_DEPTH",
        "FS_LEAK_",
        "FS_PRESS_",
    ),
    "ArduPlane": (
        *(
            "TECS_",
            "AIRSPEED_",
            "ARSPD_FBW_",
            "RTL_ALTITUDE",
            "LIM_PITCH_",
            "PTCH_LIM_",
            "LIM_ROLL_",
        ),
        *(
            "ROLL_LIMIT_",
            "KFF_",
            "RLL2SRV_",
            "PTCH2SRV_",
            "YAW2SRV_",
            "RLL_RATE_",
            "PTCH_RATE_",
            "Q_",
        ),
        *(
            "TRIM_THROTTLE",
            "TRIM_ARSPD_",
            "RUDDER_ONLY",
            "STAB_PITCH_DOWN",
            "WP_LOITER_RAD",
            "STALL_PREVENT",
        ),
    ),
    "Rover": (
        *(
            "ATC_STR_",
            "ATC_SPEED_",
            "ATC_TURN_MAX",
            "CRUISE_",
            "MODE_CH",
            "TURN_RADIUS",
            "TURN_MAX_G",
        ),
        *("SAIL_", "BAL_PITCH_"),
    ),
    "ArduPlane or Rover": ("NAVL1_", "STEER2SRV_"),
    "Blimp": (
        "FINS_",
        "LOIT_VEL",
        "LOIT_POS",
        "LOIT_MAX_",
        "VELXY_",
        "VELYAW_",
        "POSXY_",
        "POSYAW_",
    ),
}
"""Beginnings of names that Copter has none of, by whose they are."""
_NAMED = 3
"""Parameters named in one finding; the others are counted."""
_SWITCHED_BY = {"precision_strictness": "precision_landing", "path_planner_options": "path_planner"}
"""Which quantity has to be other than 0 for a vehicle to have another parameter at all."""


def _other_vehicle(file: ParameterSet) -> str:
    """Return which of ArduPilot's other vehicles a file is of; empty where it may be Copter's."""
    if file.stack is Autopilot.PX4:
        return ""
    own = COPTER_ONLY.intersection(file.values)
    names = sorted(file.values)

    def has(beginning: str) -> bool:
        at = bisect_left(names, beginning)
        return at < len(names) and names[at].startswith(beginning)

    return next(
        (
            vehicle
            for vehicle, beginnings in _OTHER_VEHICLES.items()
            if any(map(has, beginnings))
            and not (own - _OF_SUB_TOO if vehicle == "ArduSub" else own)
        ),
        "",
    )


class ResolvedParameters(Value):
    """The parameters a flight is predicted with, and what has to be known about them."""

    values: FlightParameters
    """In SI, each with its origin."""
    findings: tuple[Finding, ...]


def resolve_parameters(
    autopilot: Autopilot,
    *,
    file: ParameterSet | None = None,
    model: VehicleModel | None = None,
    version: Version | None = None,
    has_rally: bool = True,
) -> ResolvedParameters:
    """Return the value of every parameter a flight depends on in SI, and where it comes from.

    Parameters
    ----------
    autopilot : Autopilot
        PX4 or ArduPilot.
    file : ParameterSet, optional
        The vehicle's own parameters; they come first.
    model : VehicleModel, optional
        Its ``[parameters]`` come second, if it was identified under this autopilot; defaults last.
    version : tuple of int, optional
        Version of the firmware the parameters are for; default what the file says.
    has_rally : bool
        Without rally points, assumed parameters about them are not reported.

    Raises
    ------
    ValueError
        If the autopilot is neither PX4 nor ArduPilot.
    """
    if autopilot not in PARAMETERS_OF:
        msg = f"{autopilot} has no parameters"
        raise ValueError(msg)
    if file is None:
        return _of_model(autopilot, model, version, has_rally=has_rally)
    return _resolved(autopilot, file, model, version, has_rally=has_rally)


@lru_cache(maxsize=16)  # asked for every mission again
def _of_model(
    autopilot: Autopilot, model: VehicleModel | None, version: Version | None, *, has_rally: bool
) -> ResolvedParameters:
    return _resolved(autopilot, None, model, version, has_rally=has_rally)


def _resolved(
    autopilot: Autopilot,
    file: ParameterSet | None,
    model: VehicleModel | None,
    version: Version | None,
    *,
    has_rally: bool,
) -> ResolvedParameters:
    resolution = _Resolution(autopilot, version, file)
    findings: list[Finding] = []
    if file is not None:
        findings += file.findings
        other = _other_vehicle(file)
        if file.stack in {None, autopilot} and not other:
            resolution.take(file, OriginKind.FILE)
            resolution.note_misspelt(file)
        else:
            theirs = other or ("" if file.stack is None else file.stack.label)
            message = (
                f"{file.source} holds parameters of {theirs}, the flight is predicted for "
                f"{'ArduCopter' if other else autopilot.label}"
            )
            findings.append(PARAMETERS_OF_ANOTHER_AUTOPILOT.finding(message))
    if model is not None and model.reference is autopilot:
        values = {name: ParameterValue(value) for name, value in model.parameters}
        resolution.take(
            ParameterSet(source=model.source, values=values, stack=autopilot), OriginKind.MODEL
        )
    flown = resolution.values()
    findings += resolution.findings()
    assumed = [
        row.spelling_of(resolution.flown_version).name
        for name, row in resolution.table.items()
        if name not in resolution.origins
        and (has_rally or not name.startswith("rally_"))
        and (name not in _SWITCHED_BY or getattr(flown, _SWITCHED_BY[name]))
    ]
    if assumed:
        more = len(assumed) - _NAMED
        rest = f" and {quantity.count(more, 'more parameter')}" if more > 0 else ""
        names = ", ".join(assumed[:_NAMED])
        message = f"{autopilot.label}'s defaults are assumed for {names}{rest}"
        findings.append(PARAMETERS_ASSUMED.finding(message))
    return ResolvedParameters(values=flown, findings=tuple(findings))


def parameter_problems(
    autopilot: Autopilot, values: Mapping[str, float]
) -> Iterator[tuple[str, str]]:
    """Yield (name, problem) for parameters of a model that an autopilot cannot fly with.

    Parameters that no prediction depends on are left alone, as in a parameter file.
    """
    rows = _rows_by_name(autopilot)
    unknown = [name for name in values if name not in rows]
    for name, meant in misspelt_names(unknown, [name for name in rows if name not in values]):
        yield name, f"is unknown; did you mean {meant}?"
    others = _rows_by_name(_OTHER[autopilot])
    for name, value in values.items():
        if name in others:
            yield name, f"is a parameter of {_OTHER[autopilot].label}"
        if name not in rows:
            continue
        row, spelling = rows[name]
        if not row.is_possible(spelling.si(value)):
            yield name, f"cannot be {_with_unit(value, spelling)}"
        if spelling is not row.now and row.now.name in values:
            yield name, f"is the old name of {row.now.name}: give one of them"


def _rows_by_name(autopilot: Autopilot) -> dict[str, tuple[Parameter, Spelling]]:
    return {
        spelling.name: (row, spelling)
        for row in parameter_table(PARAMETERS_OF[autopilot]).values()
        for spelling in row.spellings
    }


class _Resolution:
    """Values found so far, and what has to be known about them, as sentences by rule."""

    def __init__(
        self, autopilot: Autopilot, version: Version | None, file: ParameterSet | None
    ) -> None:
        self.autopilot = autopilot
        self.version = version
        self.flown_version = version
        """Of the firmware that flies; what the file says where nothing was asked for."""
        if version is None and file is not None and file.stack in {None, autopilot}:
            self.flown_version = file.version
        self.table = parameter_table(PARAMETERS_OF[autopilot])
        self.values_si: dict[str, float] = {}
        self.origins: dict[str, Origin] = {}
        self.notes: dict[str, list[str]] = {rule.code: [] for rule in _NOTED}
        self.disagree = False
        """Whether two names of one quantity have different values."""

    def _note(self, rule: Rule, sentence: str) -> None:
        self.notes[rule.code].append(sentence)

    def take(self, given: ParameterSet, kind: OriginKind) -> None:
        """Take every quantity that is not known yet from one set."""
        for name, row in self.table.items():
            present = [spelling for spelling in row.spellings if spelling.name in given.values]
            if name in self.origins or not present:
                continue
            spelling = present[0]
            if len(present) > 1:
                spelling = self._chosen(row, given)
            elif kind is OriginKind.FILE:
                self._note_unknown(row, given, spelling)
            value_si = _si(given, spelling)
            if row.is_possible(value_si):
                self.values_si[name] = round(value_si) if row.is_choice else value_si
                line = given.values[spelling.name].line
                self.origins[name] = Origin(
                    kind=kind, name=spelling.name, source=given.source, line=line
                )
                self._note_suspect(row, given, spelling)
            else:
                self.origins[name] = self._default_origin(row)
                default = _with_unit(row.default_of(self.flown_version), row.now)
                sentence = f"{_described(given, spelling)} is not possible: default {default} used"
                self._note(PARAMETER_IMPOSSIBLE, sentence)

    def note_misspelt(self, given: ParameterSet) -> None:
        """Note names of a file that are unknown, and a letter away from one that is missing."""
        known = set().union(*(_rows_by_name(autopilot) for autopilot in PARAMETERS_OF))
        missing = [
            spelling.name
            for name, row in self.table.items()
            if name not in self.origins
            for spelling in row.spellings
        ]
        unknown = [name for name in given.values if name not in known]
        for name, meant in misspelt_names(unknown, missing):
            sentence = f"{_described(given, Spelling(name=name))} is unknown: did you mean {meant}?"
            self._note(PARAMETER_MISSPELT, sentence)

    def _note_unknown(self, row: Parameter, given: ParameterSet, spelling: Spelling) -> None:
        """Note a name that the version asked for does not know."""
        if self.version is None or row.now.since is None or row.formerly is None:
            return
        if given.version == self.version:
            return  # saved by this firmware: a build on the way to a version has names of the last one
        known = row.spelling_of(self.version)
        if spelling is not known:
            firmware = Target(self.autopilot, self.version).label
            line = _line(given.values[spelling.name])
            self._note(
                PARAMETER_UNKNOWN_TO_TARGET,
                f"{firmware} does not know {spelling.name}{line}: it is {known.name} there",
            )

    def _note_suspect(self, row: Parameter, given: ParameterSet, spelling: Spelling) -> None:
        """Note a value that would be usual in the unit of the quantity's other name."""
        value = given.values[spelling.name].value
        usual_si = row.now.si(row.usual)
        other = next((one for one in row.spellings if one is not spelling), None)
        if not value or other is None or other.unit == spelling.unit or usual_si <= 0.0:
            return

        def is_unusual(value_si: float) -> bool:
            return not usual_si / _UNUSUAL <= abs(value_si) <= usual_si * _UNUSUAL

        if is_unusual(spelling.si(value)) and not is_unusual(other.si(value)):
            meant = _with_unit(other.si(value) / row.now.si(1.0), row.now)
            self._note(
                PARAMETER_UNIT_SUSPECT,
                f"{_described(given, spelling)} is used as given; in the unit of {other.name} it "
                f"would be {meant}",
            )

    def _chosen(self, row: Parameter, given: ParameterSet) -> Spelling:
        """Return the spelling to use where both are present, and note that they are."""
        now, formerly = row.spellings
        chosen = row.spelling_of(self.version or given.version)
        now_si, formerly_si = (_si(given, spelling) for spelling in row.spellings)
        agree = math.isclose(now_si, formerly_si, rel_tol=1e-6)  # files hold 7 digits
        sentence = (
            f"{_described(given, formerly)} and {_described(given, now)} "
            f"{'mean the same' if agree else 'disagree'}: {chosen.name} is used"
        )
        if agree:
            self._note(PARAMETER_RENAMED, sentence)
        else:  # before those that agree
            self.notes[PARAMETER_RENAMED.code].insert(0, sentence)
            self.disagree = True
        return chosen

    def _default_origin(self, row: Parameter) -> Origin:
        return Origin(kind=OriginKind.DEFAULT, name=row.spelling_of(self.flown_version).name)

    def values(self) -> FlightParameters:
        """Return the parameters, with the defaults of what was found nowhere."""
        origins = {
            name: self.origins.get(name, self._default_origin(row))
            for name, row in self.table.items()
        }
        older = {
            name: row.in_si(row.default_of(self.flown_version))
            for name, row in self.table.items()
            if row.earlier
        }
        fields: dict[str, Any] = {**older, **self.values_si, "origins": origins}
        for name, row in self.table.items():
            if row.zero_means is None or row.zero_meant is None or fields.get(name):
                continue
            other, (version, factor) = row.zero_means[0], row.zero_meant
            if version == self.flown_version:
                fields[name] = factor * fields.get(other, self.table[other].default_si)
        flown: FlightParameters = PARAMETERS_OF[self.autopilot](**fields)
        for name, given_si in self.values_si.items():
            row, flown_si = self.table[name], getattr(flown, name)
            means_another = row.zero_means is not None and given_si == 0.0
            # files hold single precision, PX4 writes what it overwrites with into them
            if not means_another and not math.isclose(given_si, flown_si, rel_tol=1e-5):
                shown, used = (
                    _with_unit(one / row.now.si(1.0), row.now) for one in (given_si, flown_si)
                )
                self._note(
                    PARAMETER_OVERRULED,
                    f"{self.origins[name]}: {shown} is overruled by {flown.origins[name].name}, "
                    f"{used} is flown",
                )
        return flown

    def findings(self) -> Iterator[Finding]:
        """Yield one finding for all sentences of a rule, none where there is none."""
        for rule in _NOTED:
            if sentences := self.notes[rule.code]:
                more = quantity.count(len(sentences) - 1, "more parameter")
                agree = rule is PARAMETER_RENAMED and not self.disagree
                yield rule.finding(
                    sentences[0] + (f", and {more}" if len(sentences) > 1 else ""),
                    severity=Severity.WARNING if agree else None,
                )


def _si(given: ParameterSet, spelling: Spelling) -> float:
    value = given.values[spelling.name].value
    return math.nan if value is None else spelling.si(value)


def _line(entry: ParameterValue) -> str:
    return "" if entry.line is None else f" (line {entry.line})"


def _described(given: ParameterSet, spelling: Spelling) -> str:
    entry = given.values[spelling.name]
    value = "not a number" if entry.value is None else _with_unit(entry.value, spelling)
    return f"{spelling.name} = {value}{_line(entry)}"


def _with_unit(value: float, spelling: Spelling) -> str:
    return f"{value:.6g} {spelling.unit}".rstrip()


def misspelt_names(given: Collection[str], wanted: Collection[str]) -> Iterator[tuple[str, str]]:
    """Yield (name given, name wanted) for unknown names that were meant otherwise.

    They are apart by one letter too many, too few or wrong, or two that changed places.  Digits do not
    count: BATT2_CAPACITY is another battery.
    """
    for name in given:
        for other in wanted:
            if abs(len(name) - len(other)) <= 1 and _is_typo(name, other):
                yield name, other
                break


def _is_typo(given: str, wanted: str) -> bool:
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


def kept_parameters(
    autopilot: Autopilot, *sets: Mapping[str, float]
) -> tuple[tuple[str, float], ...]:
    """Return the parameters that a prediction depends on, each by one name.

    A later set goes before an earlier one, in each the newer name before the older.
    """
    kept: list[tuple[str, float]] = []
    for row in parameter_table(PARAMETERS_OF[autopilot]).values():
        known = (
            (spelling.name, values[spelling.name])
            for values in reversed(sets)
            for spelling in row.spellings
            if spelling.name in values and row.is_possible(spelling.si(values[spelling.name]))
        )
        kept += [one for one in (next(known, None),) if one is not None]
    return tuple(kept)
