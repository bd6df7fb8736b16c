"""``mavjoule convert``: a mission in another file format."""

from __future__ import annotations

from pathlib import Path

import click

from planner import quantity
from planner.cli.options import setting_option
from planner.cli.output import narrate, refuse_overwriting
from planner.errors import UsageError
from planner.report.text import Medium, finding_lines
from planner.service.conversion import convert_file
from planner.service.preflight import bugs_of


@click.command("convert")
@click.argument("source", metavar="IN")
@click.argument("target", metavar="OUT", type=click.Path(path_type=Path))
@click.option("--force", is_flag=True, help="overwrite OUT")
@setting_option("speed_m_s", help="command this ground speed for every level leg", unset="")
def command(*, source: str, target: Path, force: bool, speed_m_s: float | None) -> None:
    """Write a mission in another file format.

    IN is a QGroundControl plan, an older JSON mission or a QGC WPL file, or - for standard input.
    OUT ends in .plan or .json for a plan, in .waypoints or .txt for QGC WPL text.  What is
    odd about the mission and what OUT cannot hold is reported on standard error.
    """
    refuse_overwriting(target, (source,))
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
