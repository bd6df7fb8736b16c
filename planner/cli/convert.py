"""``mavjoule convert``: a mission in another file format."""

from __future__ import annotations

from pathlib import Path

import click

from planner import quantity
from planner.cli.options import path_option, setting_option
from planner.cli.output import narrate, refuse_output_file
from planner.errors import ExitCode, UsageError
from planner.findings import Severity
from planner.report.text import Medium, finding_lines
from planner.service.conversion import convert_file
from planner.service.preflight import bugs_of


@click.command("convert")
@click.argument("source", metavar="IN")
@click.argument("out", metavar="[OUT]", required=False, type=click.Path(path_type=Path))
@path_option("-o", "--output", metavar="OUT", help="where the mission is written, as OUT")
@click.option("--force", is_flag=True, help="overwrite OUT")
@setting_option("speed_m_s", help="command this ground speed for every level leg", unset="")
def command(
    *, source: str, out: Path | None, output: Path | None, force: bool, speed_m_s: float | None
) -> ExitCode:
    """Write a mission in another file format.

    IN is a QGroundControl plan, an older JSON mission or a QGC WPL file, or - for standard input.
    OUT ends in .plan or .json for a plan, in .waypoints or .txt for QGC WPL text.  What is
    odd about the mission and what OUT cannot hold is reported on standard error.

    Exit codes: 0 OUT is written, 1 it is, and something reported is an error: a check
    of OUT may not know of it, 2 unusable input or usage.
    """
    targets = [path for path in (out, output) if path is not None]
    if len(targets) != 1:
        msg = "give the file to write once: as OUT, or with -o"
        raise UsageError(msg)
    [target] = targets
    refuse_output_file(target, (source,))
    if target.exists() and not force:
        msg = f"{target} exists: give another file, or --force to overwrite it"
        raise UsageError(msg)
    with bugs_of(source):
        result = convert_file(source, target, speed_m_s=speed_m_s)
        for file, findings in ((result.file, result.findings), (result.target, result.losses)):
            for finding in findings:
                for line in finding_lines(finding, file=file, medium=Medium()):
                    narrate(line)
        narrate(
            f"{quantity.count(result.items, 'item')} of {result.file} written to {result.target}"
        )
    reported = (*result.findings, *result.losses)
    is_wrong = any(one.severity is Severity.ERROR for one in reported)
    return ExitCode.NO_GO if is_wrong else ExitCode.GO
