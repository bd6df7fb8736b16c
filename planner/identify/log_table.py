"""What no log holds, for each of several logs: a table in CSV, a row for each, units in the heads.

The columns are declared once, as the fields of `LogConditions`; a column of numbers may be in any of the
units of its kind, which ends its head: ``payload_g``, ``temperature_f``.
"""

import csv
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from statistics import median
from typing import Any, Self

from planner import quantity
from planner.errors import LogFileError, UsageError, nearest_hint
from planner.files import decoded, read_bounded
from planner.findings import Place
from planner.logs.csv import separator_of
from planner.quantity import read_number
from planner.units import MASS_UNITS_KG
from planner.values import Value, field_names, replace
from planner.vehicle.declared import (
    NOT_NEGATIVE,
    POSITIVE,
    Annotated,
    InvalidValueError,
    Key,
    KeyKind,
    Part,
    Problems,
    Range,
    declared,
)

_MOST_BYTES = 1 << 20
"""A row of 100 characters for each of 10,000 logs."""
_UNITS: Mapping[str, Mapping[str, tuple[float, float]]] = {
    "_kg": {f"_{unit}": (kilograms, 0.0) for unit, kilograms in MASS_UNITS_KG.items()},
    "_c": {"_c": (1.0, 0.0), "_f": (5.0 / 9.0, -160.0 / 9.0), "_k": (1.0, -273.15)},
    "_percent": {"_percent": (1.0, 0.0), "_fraction": (100.0, 0.0)},
}
"""By the end of a field's name: ends of heads, each with factor and summand to the field's unit."""


class LogConditions(Part):
    """What is known of the flights of one log beside it; what is not given is as for all."""

    log: Annotated[
        str, Key("file name of the log, with as much of its folders as tells it apart")
    ] = "*"
    payload_kg: Annotated[
        float | None, Key("carried beyond the mass of the vehicle", "kg", NOT_NEGATIVE)
    ] = None
    mass_kg: Annotated[
        float | None, Key("take-off mass with battery, without payload", "kg", POSITIVE)
    ] = None
    temperature_c: Annotated[float | None, Key("air at home", "°C", Range(-90.0, 60.0))] = None
    battery: Annotated[str | None, Key("name of the battery that flew")] = None
    level_start_percent: Annotated[
        float | None, Key("charge of the battery before", "%", Range(0.0, 100.0))
    ] = None
    level_end_percent: Annotated[
        float | None, Key("charge of the battery after", "%", Range(0.0, 100.0))
    ] = None
    notes: Annotated[str | None, Key("read by nobody")] = None

    def inconsistencies(self) -> Problems:
        """Yield what is wrong with levels that are not both given, or rise in flight."""
        levels = (self.level_start_percent, self.level_end_percent)
        if levels.count(None) == 1:
            yield "level_start_percent", "and level_end_percent mean nothing without each other"
        elif levels[0] is not None and levels[1] is not None and not levels[0] > levels[1]:
            yield "level_end_percent", "must be lower than level_start_percent"

    def is_of(self, log: str) -> bool:
        """Whether this is the log: its path ends as this names it."""
        own = Path(self.log).parts
        return own == Path(log).parts[-len(own) :]

    def beside(self, other: Self) -> Self:
        """Return what is known here, and of another what is not."""
        lacking = [name for name in field_names(self) if getattr(self, name) is None]
        return replace(self, **{name: getattr(other, name) for name in lacking})


class LogTable(Value):
    """What is known of flights beside their logs: of single logs by name, of each by a file, of all."""

    source: str = ""
    rows: tuple[LogConditions, ...] = ()
    """Of the file; it has one for each log."""
    named: tuple[LogConditions, ...] = ()
    """Given beside the file for single logs: they go before it."""
    of_all: LogConditions = LogConditions()
    """Where neither says anything."""

    @property
    def mass_kg(self) -> float | None:
        """Take-off mass of the vehicle: that of all, else the median of the rows. [kg]"""
        if self.of_all.mass_kg is not None:
            return self.of_all.mass_kg
        masses = [row.mass_kg for row in self.rows + self.named if row.mass_kg is not None]
        return median(masses) if masses else None

    def of(self, log: str) -> LogConditions:
        """Return what is known of the flights of a log.

        Raises UsageError if the file has no row of it, or more than one.
        """
        own = [row for row in self.rows if row.is_of(log)]
        if self.source and len(own) != 1:
            what = "no row" if not own else f"{len(own)} rows"
            msg = (
                f"{self.source}: {what} for {log}: give each log one, with its file name under log"
            )
            raise UsageError(msg)
        found = LogConditions(log=log)
        for row in (*(one for one in self.named if one.is_of(log)), *own, self.of_all):
            found = found.beside(row)
        return found if found.mass_kg is not None else replace(found, mass_kg=self.mass_kg)

    def refuse_strangers(self, logs: Sequence[str]) -> None:
        """Raise UsageError where something is known of a log that is none of these."""
        for one in self.named:
            if not any(one.is_of(log) for log in logs):
                msg = f"{one.log} is none of the logs{nearest_hint(one.log, logs)}"
                raise UsageError(msg)


def read_log_table(path: str | Path) -> LogTable:
    """Read a table of logs from CSV.

    Raises
    ------
    LogFileError
        If it cannot be read, has a column that is not known or twice, lacks ``log``, or holds what cannot
        be: with its line and its column.
    """
    source = str(path)
    data = read_bounded(path, most_bytes=_MOST_BYTES, error=LogFileError, what="table of logs")
    text = decoded(data, source=source, error=LogFileError, what="table of logs")
    first, *_ = text.splitlines() or [""]
    lines = csv.reader(text.splitlines(keepends=True), strict=True, delimiter=separator_of(first))
    try:
        heads = [head.strip() for head in next(lines, [])]
        columns = _columns(heads, source)
        rows = tuple(
            _row(cells, heads, columns, (source, lines.line_num)) for cells in lines if cells
        )
    except csv.Error as error:
        msg = f"is not CSV: {error}"
        raise LogFileError(
            msg, source=source, place=Place(line=lines.line_num, column=1)
        ) from error
    logs = [row.log for row in rows]
    if twice := [log for log in logs if logs.count(log) > 1]:
        msg = f"has two rows for {twice[0]}"
        raise LogFileError(msg, source=source, key="log")
    return LogTable(source=source, rows=rows)


def _columns(heads: Sequence[str], source: str) -> list[tuple[str, float, float]]:
    """Return the field of each column, with factor and summand to its unit."""
    known = dict(_known_heads())
    found: list[tuple[str, float, float]] = []
    for number, head in enumerate(heads):
        problem = ""
        if head not in known:
            others = f": known are {', '.join(declared(LogConditions))}"
            problem = f"is not known here{nearest_hint(head, known) or others}"
        elif known[head][0] in [name for name, *_ in found]:
            problem = f"gives {known[head][0]} a second time"
        if problem:
            msg = f"column {head!r} {problem}"
            raise LogFileError(msg, source=source, place=_place(1, heads, number))
        found.append(known[head])
    if "log" not in heads:
        msg = "needs a column log, with the file name of each log"
        raise LogFileError(msg, source=source, place=_place(1, heads, 0))
    return found


def _known_heads() -> Iterator[tuple[str, tuple[str, float, float]]]:
    for name in declared(LogConditions):
        end = next((end for end in _UNITS if name.endswith(end)), None)
        if end is None:
            yield name, (name, 1.0, 0.0)
        else:
            for other, (factor, summand) in _UNITS[end].items():
                yield name.removesuffix(end) + other, (name, factor, summand)


def _place(line: int, cells: Sequence[str], number: int) -> Place:
    """Return where a cell begins, of a line without quotes."""
    return Place(line=line, column=1 + sum(len(cell) + 1 for cell in cells[:number]))


def _row(
    cells: Sequence[str],
    heads: Sequence[str],
    columns: Sequence[tuple[str, float, float]],
    where: tuple[str, int],
) -> LogConditions:
    """Return a row; an empty cell is not given."""
    source, line = where
    if len(cells) != len(heads):
        msg = f"has {quantity.count(len(cells), 'column')}, the heads are {len(heads)}"
        raise LogFileError(msg, source=source, place=_place(line, cells, 0))
    fields = declared(LogConditions)
    held: dict[str, Any] = {}
    for number, (name, factor, summand) in enumerate(columns):
        text = cells[number].strip()
        if not text:
            continue
        held[name] = text
        if fields[name].kind is KeyKind.NUMBER:
            try:
                held[name] = factor * read_number(text) + summand
            except ValueError as error:
                msg = f"{heads[number]}: {error}"
                raise LogFileError(msg, source=source, place=_place(line, cells, number)) from error
    number = heads.index("log")
    if "log" not in held:
        msg = "names no log"
        raise LogFileError(msg, source=source, place=_place(line, cells, number))
    try:
        return LogConditions(**held)
    except InvalidValueError as error:
        name, problem = error.problems[0]
        number = next(n for n, (field, *_) in enumerate(columns) if field == name)
        msg = f"{heads[number]}: {problem}"
        raise LogFileError(msg, source=source, place=_place(line, cells, number)) from error
