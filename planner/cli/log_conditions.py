"""What no log holds, as the commands that read logs are told it: for all of them, or for one by its name."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import click

from planner.cli.options import KindType, path_option
from planner.errors import UsageError
from planner.setting import Form, Number

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from planner.identify.log_table import LogTable
    from planner.setting import Kind

MOST_MASS_KG = 1000.0


_KINDS: dict[str, tuple[str, Kind, str]] = {
    "mass_kg": (
        "--mass",
        Number("kg", 0.0, MOST_MASS_KG, is_open=True),
        "mass with battery, without payload",
    ),
    "payload_kg": ("--payload", Number("kg", 0.0, MOST_MASS_KG), "mass carried beyond it"),
    "temperature_c": ("--temperature", Number("C", -90.0, 60.0), "air at home"),
}
"""By the fields of `planner.identify.log_table.LogConditions`: option, how it is written, in words."""


def _of_log(kind: Kind) -> Callable[[str], tuple[str, Any]]:
    """Return a reader of ``0.25``, of all logs, and ``flight.bin=0.25``, of one."""

    def read(text: str) -> tuple[str, Any]:
        log, _, value = text.rpartition("=")
        return log, kind.read(value)

    return read


def log_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Add the options for what no log holds."""
    command = path_option(
        "--table",
        metavar="FILE.csv",
        help="mass, payload, temperature, battery and its levels of each log, a row each, units in the heads",
    )(command)
    for key, (option, kind, words) in reversed(_KINDS.items()):
        command = click.option(
            option,
            key,
            type=KindType(Form(_of_log(kind), str)),
            metavar=f"[LOG=]{kind.metavar}",
            multiple=True,
            help=f"{words}, in all flights or those of one log",
        )(command)
    return command


def given_log_table(asked: dict[str, Any], logs: Sequence[str]) -> LogTable:
    """Return what the options say of the logs, and take them out of what was asked.

    Raises UsageError if a log is named that is not among them, or something is said twice.
    Raises LogFileError if the table cannot be read.
    """
    from planner.identify.log_table import LogConditions, LogTable, read_log_table
    from planner.values import replace

    given: dict[str, dict[str, Any]] = {"": {}}
    for key, (option, _, _) in _KINDS.items():
        for log, value in asked.pop(key):
            own = given.setdefault(log, {})
            if key in own:
                msg = f"{option} is given twice for {log or 'all logs'}: give it once"
                raise UsageError(msg)
            own[key] = value
    file = asked.pop("table")
    table = replace(
        LogTable() if file is None else read_log_table(file),
        of_all=LogConditions(**given.pop("")),
        named=tuple(LogConditions(log=log, **own) for log, own in given.items()),
    )
    table.refuse_strangers(logs)
    return table
