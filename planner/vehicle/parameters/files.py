"""Reader of parameter files: QGroundControl, Mission Planner, MAVProxy.

======================  =========================================================
written by              a line
======================  =========================================================
QGroundControl          vehicle, component, name, value, type, separated by tabs
Mission Planner         name and value, separated by a comma
MAVProxy, SITL          name and value, separated by blanks; ``@READONLY`` may follow
======================  =========================================================

All of them know empty lines and comments that begin with ``#``.
"""

from __future__ import annotations

import re
from functools import cached_property
from typing import TYPE_CHECKING

from planner import quantity
from planner.autopilot import Autopilot
from planner.errors import ParameterFileError
from planner.fetched import FetchMark
from planner.files import decoded, read_bounded, refuse_large
from planner.findings import Place, Rule, Severity
from planner.values import Value
from planner.vehicle.parameters.ardupilot import ArduPilotParameters
from planner.vehicle.parameters.px4 import Px4Parameters
from planner.vehicle.parameters.table import parameter_names

if TYPE_CHECKING:
    from collections.abc import Collection, Iterable, Mapping
    from pathlib import Path

    from planner.findings import Finding
    from planner.vehicle.parameters.table import Version


MOST_BYTES = 1 << 22
_GREATEST = 3.4028235e38
"""Of a float of 32 bits, which is what a parameter is."""
_WHAT = "parameter file"
"""A vehicle has some thousand parameters, some 100 KB; anything larger is another kind of file."""

_AUTOPILOT_COMPONENT = "1"
"""MAV_COMP_ID_AUTOPILOT1; gimbals and cameras have parameters of their own."""
_NAME = re.compile(r"[A-Z][A-Z0-9_]{0,15}", re.ASCII)
_DEVELOPMENT = re.compile(r"\s*#\s*Version:\s*v?[\d.]+\s*dev\b")
_NUMBER = re.compile(
    r"[-+]?(\d+(\.\d*)?|\.\d+)([eE][-+]?\d+)?|[-+]?(nan|inf)|0[xX][0-9a-fA-F]{1,16}",
    re.ASCII | re.IGNORECASE,
)
_FORMS = "a line is NAME,value or NAME value, or QGroundControl's five columns"


class ParameterValue(Value, kw_only=False):
    """A value as a vehicle holds it, in the unit of its parameter."""

    value: float | None
    """``None`` where the vehicle holds no number."""
    line: int | None = None
    """Line of the file; ``None`` where there is no file."""


class ParameterSet(Value, dict=True):
    """The parameters of one vehicle, by their own names."""

    source: str
    """The file, or the link they were fetched from."""
    values: Mapping[str, ParameterValue]
    stack: Autopilot | None
    """Whose they are; ``None`` where neither a header nor the names say."""
    version: Version | None = None
    """Major and minor version of the firmware, where it is known."""
    is_development: bool = False
    """Whether it is a build on the way to that version."""
    fetched: FetchMark | None = None
    """Where ``mavjoule fetch`` wrote the file."""
    storage_b: int | None = None
    """Storage of the autopilot for parameters and lists, where it was read. [B]"""
    findings: tuple[Finding, ...] = ()
    """What is odd about the file."""

    def numbers(self) -> Mapping[str, float]:
        """Return the values that are numbers, by name."""
        return self._numbers

    @cached_property
    def _numbers(self) -> Mapping[str, float]:
        return {name: one.value for name, one in self.values.items() if one.value is not None}


def read_parameters(path: str | Path) -> ParameterSet:
    """Read the parameters of the autopilot in a file of any of the known forms.

    Raises
    ------
    ParameterFileError
        If the file cannot be read, or a line is no parameter.
    """
    data = read_bounded(path, most_bytes=MOST_BYTES, error=ParameterFileError, what=_WHAT)
    return parameters_from_text(data, source=str(path))


def parameters_from_text(data: bytes, *, source: str) -> ParameterSet:
    """Return the parameters of the autopilot in a file of UTF-8, which errors and findings call ``source``.

    Raises
    ------
    ParameterFileError
        If a line is no parameter, or none is there.
    """
    refuse_large(data, source=source, most_bytes=MOST_BYTES, error=ParameterFileError, what=_WHAT)
    text = decoded(data, source=source, error=ParameterFileError, what=_WHAT)
    lines = [line.rstrip("\r") for line in text.split("\n")]
    values: dict[str, ParameterValue] = {}
    repeated: list[str] = []
    vehicles: set[str] = set()
    for number, line in enumerate(lines, start=1):
        row = _parameter_row(line, Place(line=number, column=1), source=source)
        if row is None:
            continue
        vehicle, name, value = row
        vehicles.add(vehicle)
        before = values.get(name)
        if before is not None and before.value != value:
            repeated.append(
                f"{name} is {_shown(before.value)} in line {before.line} and {_shown(value)} in "
                f"line {number}"
            )
        values[name] = ParameterValue(value, number)
    if not values:
        msg = f"holds no parameter: {_FORMS}"
        raise ParameterFileError(msg, source=source)
    header = [line for line in lines if line.lstrip().startswith("#")]
    return ParameterSet(
        source=source,
        values=values,
        stack=_header_stack(header) or stack_of_names(values),
        version=_header_version(header),
        is_development=any(_DEVELOPMENT.match(line) for line in header),
        fetched=next(filter(None, map(FetchMark.read_comment, header)), None),
        findings=_repetitions(repeated, vehicles, source=source),
    )


def stack_of_names(names: Iterable[str]) -> Autopilot | None:
    """Return the autopilot that knows most of the names; ``None`` where it is not one of them.

    By the names that are read here; where those say nothing, by what the names begin with.
    """
    present = set(names)
    by_name = {
        autopilot: len(present & parameter_names(table))
        for autopilot, table in (
            (Autopilot.PX4, Px4Parameters),
            (Autopilot.ARDUPILOT, ArduPilotParameters),
        )
    }
    by_group = {
        autopilot: sum(own.match(name) is not None for name in present)
        for autopilot, own in _GROUPS.items()
    }
    for known in (by_name, by_group):
        if known[Autopilot.PX4] != known[Autopilot.ARDUPILOT]:
            return max(known, key=known.__getitem__)
    return None


def _beginnings(groups: str, *names: str) -> re.Pattern[str]:
    """Return what names of groups, numbered or not, match, and other names."""
    return re.compile("|".join((rf"(?:{'|'.join(groups.split())})\d*(?:_|$)", *names)))


_GROUPS = {
    Autopilot.ARDUPILOT: _beginnings(
        "ACRO AHRS ANGLE ARMING ATC AUTOTUNE AVD AVOID BARO BATT BCN BRD CAN CHUTE CIRCLE COMPASS DEV DID "
        "DISARM EAHRS EK FENCE FFT FHLD FILT FLOW FLTMODE FOLL FORMAT FRAME FRSKY FS GCS GRIP GUID INITIAL "
        "INS LAND LGR LOG LOIT MOT NTF OA PHLD PILOT PLDP PLND PRX PSC RALLY RCMAP RELAY RNGFND RSSI SCHED "
        "SERIAL SERVO SID SIMPLE SPRAY SRTL STAT SUPER SURFTRAK SYSID TCAL TELEM TERRAIN THROW TKOFF TUNE "
        "VISO WINCH WP WPNAV WVANE ZIGZ",
        *(r"(?:CAM|GPS|OSD)\d_", r"RC\d+_OPTION", "RTL_OPTIONS", "MIS_RESTART"),
    ),
    Autopilot.PX4: _beginnings(
        "ASPD ATT BAT CA CAL CBRK COM CP EKF FD FLW FW GF HTE IMU LND LNDFW LNDMC LPE MAN MC MOTFAIL MPC NAV "
        "NPFG PLD PWM RO RWTO SDLOG SENS SER SIH SYS TC TEL TRIG UAVCAN UXRCE VT WV"
    ),
}
"""What the names of parameters begin with that one autopilot has and the other has not: of ArduCopter 4.5 to
4.7, PX4 1.13 to 1.17."""


def _parameter_row(line: str, place: Place, *, source: str) -> tuple[str, str, float | None] | None:
    """Return vehicle, name and value of a line; ``None`` for comments and other components.

    The vehicle is its MAVLink system, where the line names one.
    """
    vehicle = ""
    line = line.split("#", 1)[0]
    columns = line.replace(",", " ").split()
    if not columns:
        return None
    if len(columns) == 5 and columns[0].isdigit() and columns[1].isdigit():
        if columns[1] != _AUTOPILOT_COMPONENT:
            return None
        vehicle, columns = columns[0], columns[2:4]
    elif len(columns) == 3 and columns[2] == "@READONLY":
        columns = columns[:2]
    if len(columns) != 2 or not _NAME.fullmatch(columns[0]):
        msg = f"is not a parameter: {_FORMS}"
        raise ParameterFileError(msg, source=source, place=place)
    if not _NUMBER.fullmatch(columns[1]):
        shown = columns[1] if len(columns[1]) <= 40 else f"{columns[1][:37]}..."
        msg = f"the value of {columns[0]} must be a number, got {shown!r}"
        raise ParameterFileError(msg, source=source, place=place)
    return vehicle, columns[0], _number(columns[1])


def _number(text: str) -> float | None:
    value = float(int(text, 16)) if text[:2].lower() == "0x" else float(text)
    return value if abs(value) <= _GREATEST else None


def _shown(value: float | None) -> str:
    return "not a number" if value is None else f"{value:g}"


PARAMETER_REPEATED = Rule(
    "P104 parameter-repeated",
    Severity.WARNING,
    summary="A parameter is in the file more than once, with different values.",
    why="The file does not show which of them is on the vehicle.",
    how="Names are counted; the last value is used, as by the programs that load such files.  An error where "
    "the lines are of several vehicles, by the first of QGroundControl's five columns: which flies is not "
    "known.",
    fix="delete the value that is not on the vehicle",
    instead="--params of one vehicle",
)


def _repetitions(
    repeated: list[str], vehicles: Collection[str], *, source: str
) -> tuple[Finding, ...]:
    if not repeated:
        return ()
    others = quantity.count(len(repeated) - 1, "more parameter")
    more = f", and so {others}" if len(repeated) > 1 else ""
    message = f"{source}: {repeated[0]}: the last value is used{more}"
    if len(vehicles) > 1:
        message += f"; the file holds vehicles {' and '.join(sorted(vehicles))}"
    severity = Severity.ERROR if len(vehicles) > 1 else None
    return (PARAMETER_REPEATED.finding(message, severity=severity),)


def _header_stack(header: list[str]) -> Autopilot | None:
    """Return whose file it is by QGroundControl's ``# Stack: PX4 Pro``."""
    for line in header:
        if match := re.match(r"\s*#\s*Stack:\s*(\S+)", line):
            return {"px4": Autopilot.PX4, "ardupilot": Autopilot.ARDUPILOT}.get(match[1].lower())
    return None


def _header_version(header: list[str]) -> Version | None:
    """Return the firmware's version by QGroundControl's ``# Version: 1.17.0 dev``."""
    for line in header:
        if match := re.match(r"\s*#\s*Version:\s*v?(\d{1,4})\.(\d{1,4})", line):
            return int(match[1]), int(match[2])
    return None
