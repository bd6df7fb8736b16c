"""``mavjoule check``: the pre-flight check."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from planner import __version__, service
from planner.cli.configuration import mission_settings
from planner.cli.options import given_settings, setting_options
from planner.cli.output import narrate, refuse_overwriting, standard_medium, write_data
from planner.cli.settings import (
    BUDGET_SETTINGS,
    FLIGHT_SETTINGS,
    REPORT_SETTINGS,
    check_request,
    report_request,
)
from planner.errors import ExitCode, UsageError
from planner.report.columns_csv import columns_csv
from planner.report.json_report import check_json, check_json_lines
from planner.report.text import check_text, tally
from planner.service import UnreadableMission

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from planner.cli.settings import ReportRequest
    from planner.service import CheckResult


@click.command("check")
@click.argument("missions", metavar="MISSION...", nargs=-1, required=True)
@setting_options((*FLIGHT_SETTINGS, *BUDGET_SETTINGS, *REPORT_SETTINGS))
def command(missions: tuple[str, ...], **options: object) -> ExitCode:
    """Predict missions and judge each: go or no-go.

    MISSION is a QGroundControl plan or a QGC WPL file, or - for standard input.  Defaults come
    from mavjoule.toml, or [tool.mavjoule] in pyproject.toml, in the nearest folder of the mission
    upward.

    Exit codes: 0 every mission is a go, 1 one is a no-go, 2 unusable input, usage or
    configuration.
    """
    if missions.count("-") > 1:
        msg = "standard input can be read once: give - once"
        raise UsageError(msg)
    given = given_settings(options)
    settings = [mission_settings(mission, given) for mission in missions]
    report = report_request(settings)
    if report.trace is not None and len(missions) > 1:
        msg = "--trace takes a single mission: check them one by one"
        raise UsageError(msg)
    refuse_overwriting(report.output, missions)
    refuse_overwriting(report.trace, missions)
    results = [
        service.check_file(mission, check_request(values))
        for mission, values in zip(missions, settings, strict=True)
    ]
    if report.trace is not None:
        _write_trace(results[0], report.trace)
    write_data(_rendered(results, report), output=report.output)
    if report.output is not None:
        narrate(f"{tally(results)}; the report is in {report.output}")
    return _exit_code(results, is_zero=report.exit_zero)


def _rendered(results: Sequence[CheckResult | UnreadableMission], report: ReportRequest) -> str:
    match report.format:
        case "json":
            return check_json(results, version=__version__)
        case "json-lines":
            return check_json_lines(results, version=__version__)
        case _:
            return check_text(results, medium=standard_medium(report.output))


def _write_trace(result: CheckResult | UnreadableMission, path: Path) -> None:
    trace = None if isinstance(result, UnreadableMission) else result.trace
    if trace is None:
        narrate(f"nothing is flown: {path} is not written")
    else:
        write_data(columns_csv(trace.columns()), output=path)


def _exit_code(results: Sequence[CheckResult | UnreadableMission], *, is_zero: bool) -> ExitCode:
    if any(isinstance(result, UnreadableMission) for result in results):
        return ExitCode.UNUSABLE
    if any(result.verdict == "no-go" for result in results) and not is_zero:
        return ExitCode.NO_GO
    return ExitCode.GO
